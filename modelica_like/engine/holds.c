/* Motions that modes hold: which they are, and how elements share what they hold. */
#include "core.h"

#define DEPENDENT 1e-9
#define CANCELLED 1e-14 /* what is left of the largest numbers where they cancel */
#define STIFF 1e5       /* reaction with which a motion that contradicts its being held counts, over the inertia */
#define LARGE 1e3
#define BEARABLE 0.99 /* part of its capacity that an element may bear in a split */
#define SPLITS 20     /* trials to find a split that all can bear */
#define TURNED 100.0

void mark_held(const Instance *c, const Terms *terms, unsigned char *held) {
    const Held *one = c->model->holds;
    for (int k = 0; k < c->model->n_holds; k++, one++) held[k] = c->d[one->mode] == one->number && terms[k].gain != 0;
}

/* Terms of all motions that modes may hold at the present point; marks those that are held. */
void find_held(Instance *c, Terms *terms, unsigned char *held) {
    evaluate_now(c, &c->model->tapes.hold_terms, (double *)terms);
    for (int k = 0; k < c->model->n_holds && c->state.resting; k++) terms[k].restitution = 0;
    mark_held(c, terms, held);
}

double largest_like(const Model *m, const double *values, int node) {
    double largest = 0;
    for (int n = 0; n < m->n_nodes; n++)
        if (m->units[n] == m->units[node]) largest = max_of(largest, fabs(values[n]));
    return largest;
}

/* Set held motions within rounding of zero to zero, if they are states. */
void rest(Instance *c) {
    if (c->model->n_holds == 0) return;
    find_held(c, c->terms, c->held);
    const double *values = variables_now(c);
    for (int k = 0; k < c->model->n_holds; k++) {
        const Held *one = &c->model->holds[k];
        if (c->held[k] && one->state >= 0 &&
            fabs(values[one->motion]) <= ROUNDING * largest_like(c->model, values, one->motion))
            c->x[one->state] = 0;
    }
}

/* Put rates of held motions that are zero but for rounding at zero: an importer's solver takes differences of rates for
 * a Jacobian, and what is nothing but rounding then counts as very stiff. */
void rest_rates(Instance *c, double *rates) {
    const Model *m = c->model;
    double largest = max_of(largest_of(m->n_x, rates), largest_of(m->n_z, c->z));
    if (m->n_holds == 0) return;
    find_held(c, c->terms, c->held);
    for (int k = 0; k < m->n_holds; k++) {
        int state = m->holds[k].state;
        if (c->held[k] && state >= 0 && fabs(rates[state]) <= CANCELLED * largest) rates[state] = 0;
    }
}

/* Bring dependences to the form of an identity in one column each, the largest one left; write their shares. */
static void eliminate(Instance *c, const Circuit *one, int rows, int n, double *silent, double *weighted) {
    int *pivots = c->pivots, *place = c->places;
    double *switches = c->d + one->first, *shares = switches + one->n_members;
    for (int row = 0; row < rows; row++) {
        double *own = silent + (size_t)row * n;
        int pivot = 0;
        for (int k = 1; k < n; k++)
            if (fabs(own[k]) > fabs(own[pivot])) pivot = k;
        pivots[row] = pivot;
        for (int other = 0; other < rows; other++) {
            double factor = silent[(size_t)other * n + pivot] / own[pivot];
            for (int k = 0; k < n && other != row; k++) {
                silent[(size_t)other * n + k] -= factor * own[k];
                weighted[(size_t)other * n + k] -= factor * weighted[(size_t)row * n + k];
            }
        }
    }
    for (int row = 0; row < rows; row++) {
        const double *own = weighted + (size_t)row * n;
        double largest = copysign(largest_of(n, own), own[pivots[row]]);
        switches[place[pivots[row]]] = 1;
        for (int k = 0; k < n; k++) shares[place[pivots[row]] * one->n_members + place[k]] = own[k] / largest;
    }
}

/* Weights that decide the split: what nothing limits takes nearly all, what bears nothing nearly nothing. */
static void weigh(const Model *m, const Terms *terms, double *weights) {
    double largest = 0;
    for (int k = 0; k < m->n_holds; k++) {
        weights[k] = max_of(terms[k].forward, terms[k].backward);
        if (weights[k] < UNLIMITED) largest = max_of(largest, weights[k]);
    }
    if (largest == 0) largest = 1;
    for (int k = 0; k < m->n_holds; k++) weights[k] = 1 / min_of(max_of(weights[k], largest / LARGE), largest * LARGE);
}

/* Dependences among n held motions of a circuit become the rows of `silent`; returns their number. */
static int dependences(Instance *c, const int *member, int n, double *silent) {
    const Model *m = c->model;
    double *slopes = c->square, *turns = slopes + (size_t)m->most_members * m->n_x;
    double *sizes = c->sizes;
    int rows = 0;
    for (int i = 0; i < n; i++) {
        double *slope = slopes + (size_t)i * m->n_x, square;
        slope_of_node(c, m->holds[member[i]].motion, i > 0, slope);
        square = dot(m->n_x, slope, slope);
        sizes[i] = square > 0 ? sqrt(square) : 1;
        for (int k = 0; k < m->n_x; k++) slope[k] /= sizes[i];
    }
    make_orthogonal(n, m->n_x, slopes, turns, NULL);
    for (int i = 0; i < n; i++) {
        const double *slope = slopes + (size_t)i * m->n_x;
        if (sqrt(dot(m->n_x, slope, slope)) > DEPENDENT) continue;
        for (int k = 0; k < n; k++) silent[(size_t)rows * n + k] = turns[(size_t)i * n + k] / sizes[k];
        rows++;
    }
    return rows;
}

static int shares_in(const Instance *c, const Circuit *one, int place) {
    const double *shares = c->d + one->first + one->n_members;
    for (int row = 0; row < one->n_members; row++)
        if (shares[row * one->n_members + place] != 0) return 1;
    return 0;
}

int anything_shared(const Instance *c) {
    int any = 0;
    for (int i = 0; i < c->model->n_circuits; i++)
        for (int k = 0; k < c->model->circuits[i].n_members; k++) any |= c->d[c->model->circuits[i].first + k] != 0;
    return any;
}

/* Let a motion that cannot be held by all, because it is prescribed, raise the reactions until one gives way: a
 * switched equation says sum(share * reaction) = stiff * inertia * der(motion). */
static void yield_to_contradiction(Instance *c, const Circuit *one) {
    const Model *m = c->model;
    const int *member = m->members + one->first_member;
    double *z = c->kept_z, *reaction = c->reactions, inertia = 0, stiff;
    unsigned char *other = c->other;
    int solved = 1;
    memcpy(z, c->z, (size_t)m->n_z * sizeof(double));
    for (int k = 0; k < one->n_members; k++) other[k] = c->d[one->first + k] == 0 && shares_in(c, one, k);
    for (int asked = 0; asked < 2; asked++) {
        for (int k = 0; k < one->n_members; k++)
            if (other[k]) c->d[m->holds[member[k]].approach] = asked;
        solved = solved && solve_now(c, 1);
        variables_now(c);
        for (int k = 0; k < one->n_members; k++) {
            double now = c->variables[m->holds[member[k]].reaction];
            if (asked && other[k]) inertia = max_of(inertia, fabs(now - reaction[k]));
            reaction[k] = now;
        }
    }
    for (int k = 0; k < one->n_members; k++) c->d[m->holds[member[k]].approach] = 0;
    memcpy(c->z, z, (size_t)m->n_z * sizeof(double));
    stiff = solved && isfinite(inertia) ? STIFF * inertia : 0;
    /* The larger of the two sides has coefficients of about one. */
    for (int k = 0; k < one->n_members * one->n_members; k++) c->d[one->first + one->n_members + k] /= max_of(stiff, 1);
    for (int k = 0; k < one->n_members; k++)
        if (c->d[one->first + k] == 1) c->d[one->first + k] += min_of(stiff, 1);
}

/* Writes switches and shares of a circuit; tells whether anything is shared. */
static int share_circuit(Instance *c, const Circuit *one, const unsigned char *held, const double *weights) {
    const Model *m = c->model;
    int *place = c->places, *member = c->member, n = 0, rows = 0, moved = 0;
    double *silent = c->square + (size_t)m->most_members * (m->n_x + m->most_members);
    double *weighted = silent + (size_t)m->most_members * m->most_members;
    for (int k = 0; k < one->n_members; k++) {
        member[n] = m->members[one->first_member + k];
        place[n] = k;
        n += held[member[n]];
    }
    if (n > 1) rows = dependences(c, member, n, silent);
    for (int k = 0; k < rows * n; k++) weighted[k] = silent[k] * weights[member[k % n]];
    memset(c->d + one->first, 0, (size_t)one->n_members * (size_t)(1 + one->n_members) * sizeof(double));
    eliminate(c, one, rows, n, silent, weighted);
    for (int k = 0; k < n; k++) moved |= m->holds[member[k]].moved;
    if (rows > 0 && moved) yield_to_contradiction(c, one);
    return rows > 0;
}

/* Reactions over what can be borne, of the elements that share; returns the largest. */
static double use_of(Instance *c, const Terms *terms, double *use) {
    const Model *m = c->model;
    double *z = c->kept_z, worst = 0;
    memset(use, 0, m->n_holds * sizeof(double));
    memcpy(z, c->z, (size_t)m->n_z * sizeof(double));
    if (!solve_now(c, 1)) worst = INFINITY;
    variables_now(c);
    for (int i = 0; i < m->n_circuits; i++)
        for (int place = 0; place < m->circuits[i].n_members; place++) {
            int k = m->members[m->circuits[i].first_member + place];
            double reaction = c->variables[m->holds[k].reaction];
            double limit = reaction > 0 ? terms[k].forward : terms[k].backward;
            if (!shares_in(c, &m->circuits[i], place) || !(limit > 0) || limit >= UNLIMITED) continue;
            use[k] = fabs(reaction) / limit;
            worst = max_of(worst, use[k]);
        }
    memcpy(c->z, z, (size_t)m->n_z * sizeof(double));
    return worst;
}

/* Let elements that hold the same motion share its reaction in proportion to their capacities: the reactions of the
 * least norm, weighted by the inverse of the capacities. Where that asks more of one than it can bear, the others take
 * more, as far as they can. */
void share(Instance *c) {
    const Model *m = c->model;
    Terms *terms = c->terms;
    double *weights = c->weights, *base = c->base_weights, *use = c->use, *best = c->best, least = INFINITY;
    replace_dependent(c);
    if (m->n_circuits == 0) return;
    find_held(c, terms, c->held);
    weigh(m, terms, base);
    memcpy(weights, base, (size_t)m->n_holds * sizeof(double));
    for (int trial = 0; trial < SPLITS; trial++) {
        int shared = 0;
        for (int i = 0; i < m->n_circuits; i++) shared |= share_circuit(c, &m->circuits[i], c->held, weights);
        if (c->bounded) return; /* the split by capacities, without asking whether all can bear it */
        double worst = shared ? use_of(c, terms, use) : 0;
        if (worst < least || trial == 0) memcpy(best, c->d, (size_t)m->n_d * sizeof(double));
        if (worst < least) least = worst;
        if (worst <= BEARABLE || !isfinite(worst)) break;
        for (int k = 0; k < m->n_holds; k++)
            weights[k] = use[k] > 0 ? min_of(max_of(weights[k] * use[k], base[k] / TURNED), base[k] * TURNED) : base[k];
    }
    memcpy(c->d, best, (size_t)m->n_d * sizeof(double));
}

Result share_and_solve(Instance *c) {
    share(c);
    c->variables_valid = 0;
    return solve_now(c, 0);
}
