/* Adjoint vectors over an instant. Where modes change and entries of d get new values, an event moves so that its guard
 * stays zero, and states move on at the rates before and behind it (the saltation of M. A. Aizerman, F. R. Gantmakher,
 * 1958). All other instants are passed again with the transitions that have fired: central differences by those of the
 * numbers of the state that they feel, which are found by halves. */
#include "adjoint.h"

#define NEARBY 3e-6      /* of the sizes of numbers: how far instants are moved */
#define NOT_FELT 1e-13   /* of the sizes of numbers: rounding of an instant */
#define FELT_CHANGE 1e-9 /* of states and rates, relative to their sizes */

/* Keeps the vectors behind an instant. */
static void keep_vectors(Instance *c) {
    Gradient *g = c->gradient;
    g->n_kept = g->n_vectors;
    for (int v = 0; v < g->n_vectors; v++) vector_of(c, v)[c->n_smooth] = 0;
    memcpy(g->behind, g->vectors, (size_t)g->n_vectors * (c->n_smooth + 1) * sizeof(double));
}

static const double *kept_vector(const Instance *c, int k) {
    return c->gradient->behind + (size_t)k * (c->n_smooth + 1);
}

/* Sizes of numbers at an instant. Lists those by which derivatives are asked for, and those that it may read: first
 * those that an instant behind has felt, last those that are zero, of which many lead to other modes. They are moved so
 * that several do not cancel each other, and the event by little. */
static void list_numbers(Instance *c, const Record *at) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    ptrdiff_t x = c->x - c->numbers, d = c->d - c->numbers, ideal = d + m->settings->ideal, width = IDEAL_HEAD + m->n_z;
    double t = fabs(((const State *)at->before)->t);
    const double *before = copied(c, at->before, c->numbers), *behind = copied(c, at->behind, c->numbers);
    g->n_listed = 0;
    for (int class = 0; class < 3; class++) {
        for (ptrdiff_t k = 0; k < (ptrdiff_t)c->n_smooth; k++) {
            int state = k >= x && k < x + m->n_x, entry = k >= d && k < d + m->n_d;
            int mode = entry && k - d < m->n_modes && m->modes[k - d].n_names > 0;
            int impulse = k > ideal && k < ideal + m->n_ideals * width && (k - ideal) % width == 1;
            double size = max_of(fabs(before[k]), fabs(behind[k]));
            g->sizes[k] = state ? size + m->nominals[k - x] : size == 0 ? 1 : size;
            if (class != (g->marks[k] && !at->start ? 0 : size == 0 ? 2 : 1)) continue;
            if (!g->asked[k] && (at->start || !(state || (entry && !mode && !impulse)))) continue;
            double later = at->start || g->speed == 0 ? 0 : fabs(g->moment[k] / g->speed * g->sizes[k]) / max_of(1, t);
            double random = 0.5 + 0.5 * fmod(0.6180339887498949 * g->n_listed, 1);
            g->motions[g->n_listed] = (g->n_listed % 2 ? -random : random) * NEARBY * g->sizes[k] / max_of(1, later);
            g->listed[g->n_listed++] = k;
        }
        if (class == 0) g->n_marked = g->n_listed;
    }
}

/* Passes an instant with some of the numbers moved to a side, which gives `moved`. Tells whether the same modes follow,
 * and whether there is more behind it than what was moved. */
static int pass_moved(Instance *c, const Record *at, int begin, int end, int side, double *moved, int *felt) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    const double *behind = copied(c, at->behind, c->numbers), *d = copied(c, at->behind, c->d);
    double *change = g->slope;
    double shift = 0;
    state_copy_in(c, at->before);
    memcpy(change, behind, c->n_smooth * sizeof(double));
    for (int k = begin; k < end; k++) {
        double way = side * g->motions[k];
        c->numbers[g->listed[k]] += way;
        change[g->listed[k]] += way;
        if (!at->start && g->speed != 0) shift += way * g->moment[g->listed[k]] / g->speed;
    }
    c->state.t += shift;
    for (int k = 0; k < m->n_x && shift != 0; k++) c->x[k] += shift * g->rates[k];
    Result same = at->pass(c);
    for (int k = 0; k < m->n_x && shift != 0; k++) c->x[k] -= shift * g->rates[m->n_unknowns + k];
    memcpy(moved, c->numbers, c->n_smooth * sizeof(double));
    for (ptrdiff_t n = 0; n < (ptrdiff_t)c->n_smooth; n++) {
        ptrdiff_t z = n - (c->z - c->numbers);
        *felt |= !(fabs(moved[n] - change[n]) <= NOT_FELT * g->sizes[n]) && !(z >= 0 && z < m->n_z);
    }
    for (int k = 0; k < m->n_modes; k++) same = same && (m->modes[k].n_names == 0 || c->d[k] == d[k]);
    return same;
}

/* Finds which of some numbers the instant feels, and what vectors before it owe to them; or only whether other modes
 * follow, on either side. */
static void feel(Instance *c, const Record *at, int begin, int end, int modes_only) {
    Gradient *g = c->gradient;
    if (begin >= end) return;
    double *sides[] = {g->sides, g->sides + c->n_smooth}, step = 2 * g->motions[begin];
    ptrdiff_t place = g->listed[begin];
    g->marks[place] = 0;
    int felt = 0, same = pass_moved(c, at, begin, end, 1, sides[1], &felt);
    if (same && !felt && !at->start) return;
    int both = end - begin == 1 || (at->start && (modes_only || !felt));
    if (same && both) same = pass_moved(c, at, begin, end, -1, sides[0], &felt);
    if (same && (!felt || modes_only)) return;
    if (end - begin > 1) {
        feel(c, at, begin, (begin + end) / 2, modes_only);
        feel(c, at, (begin + end) / 2, end, modes_only);
        return;
    }
    if (!same && at->start && modes_only && !g->early && begins_alike(c, at, begin)) return;
    state_copy_in(c, at->before);
    if (!same) {
        memset(g->slope, 0, (c->n_smooth + 1) * sizeof(double));
        g->slope[place] = 1;
        add_doubt(c, FAILURE_LOST_AT_OTHER_MODES, g->slope);
        return;
    }
    g->marks[place] = 1;
    for (int v = 0; v < g->n_kept; v++) vector_of(c, v)[place] = 0;
    for (size_t n = 0; n < c->n_smooth; n++) {
        if (sides[1][n] == sides[0][n]) continue;
        double change = (sides[1][n] - sides[0][n]) / step;
        for (int v = 0; v < g->n_kept; v++) vector_of(c, v)[place] += product(kept_vector(c, v)[n], change);
    }
}

/* What gives entries of d new values in the steps of an instant: in each round resets of what has fired (its modes
 * change, too), and then updates. */
typedef struct {
    const Tape *tape;
    const Reset *resets;
    int n;
    const unsigned char *fired; /* of resets */
} Assignment;

static Assignment assignment(Instance *c, const Record *at, int step) {
    const Model *m = c->model;
    if (step % 2) return (Assignment){&m->tapes.updates, m->updates, m->n_updates, NULL};
    unsigned char *fired = nothing_wanting(c), *changed = memset(c->changed, 0, (size_t)m->n_modes);
    for (int k = 0; k < m->n_transitions; k++) {
        int mode = m->transitions[k].mode;
        fired[k] = at->rounds[step / 2 * m->n_transitions + k] && !changed[mode];
        changed[mode] |= fired[k];
    }
    return (Assignment){&m->tapes.resets, m->resets, m->n_resets, fired};
}

/* Carries out the first steps. Returns 0 if one of them does more than to give d new values. */
static int assign(Instance *c, const Record *at, int steps) {
    const Model *m = c->model;
    state_copy_in(c, at->before);
    for (int step = 0; step < steps; step++) {
        Assignment all = assignment(c, at, step);
        c->state.z_valid = 0;
        if (!settle(c)) return 0;
        evaluate_now(c, all.tape, c->reset_values);
        for (const Reset *reset = all.resets; reset < all.resets + all.n; reset++) {
            int entry = reset->place - m->n_x;
            double value = c->reset_values[reset->value];
            if (all.fired != NULL && !all.fired[reset->transition]) continue;
            if ((entry < 0 || entry >= m->n_d) && isinf(value) && all.fired == NULL) continue; /* sets nothing now */
            if (entry < 0 || entry >= m->n_d || reset->factor == 0) return 0;
            c->d[entry] = value / reset->factor;
        }
        for (int k = 0; k < m->n_transitions && all.fired != NULL; k++)
            if (all.fired[k]) c->d[m->transitions[k].mode] = m->transitions[k].target;
    }
    return 1;
}

/* Goes back over these steps. */
static void assign_back(Instance *c, const Record *at) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    double *bars = c->reset_values;
    for (int step = 2 * at->n_rounds - 1; step >= 0; step--) {
        if ((step % 2 ? m->n_updates : m->n_resets) == 0) continue;
        assign(c, at, step);
        Assignment all = assignment(c, at, step);
        c->state.z_valid = 0;
        if (!factor_implicit(c)) lose_back(c);
        for (int v = 0; v < g->n_vectors; v++) {
            double *d = vector_of(c, v) + (c->d - c->numbers);
            evaluate_now(c, all.tape, bars);
            memset(bars, 0, (size_t)all.tape->n_outputs * sizeof(double));
            memset(c->dots, 0, (size_t)m->slot_results * sizeof(double));
            for (const Reset *reset = all.resets; reset < all.resets + all.n; reset++) {
                int entry = reset->place - m->n_x;
                if ((all.fired != NULL && !all.fired[reset->transition]) || entry < 0 || entry >= m->n_d) continue;
                bars[reset->value] += d[entry] / reset->factor;
                d[entry] = 0;
            }
            tape_adjoint(all.tape, c->slots, c->dots, bars);
            adjoint_of_implicit(c, 1);
            add_bars(c, vector_of(c, v));
        }
    }
}

/* Does the instant only change modes and entries of d, and by rounding what is held from now on? */
static int is_plain(Instance *c, const Record *at) {
    const Model *m = c->model;
    const double *x = copied(c, at->behind, c->x), *d = copied(c, at->behind, c->d);
    int plain = m->n_ideals == 0 && assign(c, at, 2 * at->n_rounds) && !anything_shared(c);
    for (int k = 0; k < m->n_d; k++) plain = plain && d[k] == c->d[k];
    for (int k = 0; k < m->n_x; k++)
        plain = plain && fabs(x[k] - c->x[k]) <= FELT_CHANGE * (fabs(x[k]) + m->nominals[k]);
    return plain;
}

/* What begins to be held is stopped by an impulse, in proportion to its motion, which is about zero. */
static void stop_back(Instance *c, const Record *at) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    const double *before = copied(c, at->before, c->d);
    double *jump = g->work;
    state_copy_in(c, at->behind);
    if (m->n_holds > 0) find_held(c, c->terms, c->held);
    for (int k = 0; k < m->n_holds; k++) {
        const Held *hold = &m->holds[k];
        if (!c->held[k] || before[hold->mode] == hold->number) continue;
        for (int side = 0; side < 2; side++) {
            c->d[hold->approach] = -side / INSTANT;
            if (!solve_now(c, 1)) lose_back(c);
            evaluate_now(c, &m->tapes.rates, side ? jump : c->rhs);
        }
        c->d[hold->approach] = 0;
        for (int n = 0; n < m->n_x; n++) jump[n] = INSTANT * (jump[n] - c->rhs[n]);
        c->state.z_valid = 0;
        if (!factor_implicit(c)) lose_back(c);
        slope_of_output(c, &m->tapes.variables, hold->motion, c->outputs, g->slope);
        for (int v = 0; v < g->n_vectors; v++) {
            double part = dot(m->n_x, kept_vector(c, v) + (c->x - c->numbers), jump);
            for (size_t n = 0; n <= c->n_smooth; n++) vector_of(c, v)[n] += part * g->slope[n];
        }
    }
}

/* What tells when the instant is: its derivatives by the numbers of the state become `slope`. Returns minus its rate,
 * 0 if the time is given, and nan if nothing tells how it moves. */
static double find_cause(Instance *c, double *slope) {
    const Model *m = c->model;
    const unsigned char *wanting = at_located_event(&c->state) ? c->wanting : nothing_wanting(c);
    double rate = -1;
    int k = 0;
    if (!at_located_event(&c->state)) find_wanting(c, c->wishes, 0);
    while (k < m->n_transitions && !wanting[k]) k++;
    if (k == m->n_transitions || c->state.n_steps == 0 || !factor_implicit(c)) return 0;
    const Transition *cause = c->gradient->cause = &m->transitions[k];
    const Tape *tape = cause->timed ? &m->tapes.moments : &m->tapes.guards;
    evaluate_now(c, tape, c->outputs);
    if (!cause->timed) rate = c->outputs[m->n_guards + cause->index];
    slope_of_output(c, tape, cause->index, c->outputs, slope);
    int nothing = rate == 0 && largest_of((int)c->n_smooth, slope) == 0;
    for (size_t n = 0; n < c->n_smooth && nothing; n++) slope[n] = 1; /* whatever moves, it may move the instant */
    return rate == 0 ? NAN : -rate;
}

/* Does it make a difference when the instant is? Rounding may decide that, and no guard. */
static int matters(Instance *c, const Record *at, const double *before, const double *behind) {
    const Model *m = c->model;
    const double *x = copied(c, at->behind, c->x), *d = copied(c, at->behind, c->d);
    int any = 0;
    for (int k = 0; k < m->n_x; k++) {
        double change = max_of(fabs(c->x[k] - x[k]), fabs(before[k] - behind[k]));
        any |= !(change <= FELT_CHANGE * (fabs(x[k]) + fabs(before[k]) + m->nominals[k]));
    }
    for (int k = 0; k < m->n_modes; k++) any |= d[k] != c->d[k] && m->modes[k].n_names == 0;
    return any;
}

/* By how much integrals grow if the instant comes later, `side` by side, and what else moves with it. */
static void move_later(Instance *c, double side) {
    Gradient *g = c->gradient;
    if (side < 0) memset(g->later, 0, (size_t)g->n_of * sizeof(double));
    if (g->along == NULL) return;
    for (int row = 0; row < g->n_of; row++) {
        if (integrand_of(g, row) < 0) continue;
        double value = variables_now(c)[integrand_of(g, row)], size = fabs(value) + fabs(g->later[row]);
        g->later[row] += side * value;
        if (side > 0 && fabs(g->later[row]) <= FELT_CHANGE * size) g->later[row] = 0;
    }
    for (int64_t k = 0; k < g->along->n_seeds && side > 0; k++)
        if (g->along->seeds[k].instant == g->instant) g->later[g->along->seeds[k].of] += g->along->seeds[k].moving;
}

/* Adds what is read before the instant, and what moves with it, at this speed of its guard. */
static void read_before(Instance *c, double speed) {
    Gradient *g = c->gradient;
    for (int row = 0; row < g->n_of && speed != 0; row++)
        for (size_t n = 0; n < c->n_smooth && g->later[row] != 0; n++)
            vector_of(c, row)[n] += g->later[row] / speed * g->moment[n];
    for (int64_t k = 0; g->along != NULL && k < g->along->n_seeds; k++)
        if (g->along->seeds[k].instant == g->instant) add_seed(c, &g->along->seeds[k]);
}

/* From behind an event to before it. */
void event_back(Instance *c, const Record *at) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    double *before = g->rates, *behind = before + m->n_unknowns, *slope = g->moment;
    int plain = is_plain(c, at);
    g->early |= at->n_rounds > 0 && ((const State *)at->before)->n_steps == 0;
    keep_vectors(c);
    state_copy_in(c, at->behind);
    evaluate_now(c, &m->tapes.rates, behind);
    if (at->n_rounds > 0) note_kinks(c);
    move_later(c, -1);
    state_copy_in(c, at->before);
    g->speed = find_cause(c, slope);
    evaluate_now(c, &m->tapes.rates, before);
    move_later(c, 1);
    double speed = g->speed;
    int touches = find_touches_at(c, at, -speed);
    if (g->speed != 0 && !matters(c, at, before, behind)) g->speed = 0;
    int read = largest_of(g->n_of, g->later) > 0,
        tells = (g->speed == 0 && !read) || speed == 0 || (isfinite(1 / speed) && touches == 0);
    if (!tells) g->speed = speed = 0;
    if (plain) {
        stop_back(c, at);
        assign_back(c, at);
    } else {
        list_numbers(c, at);
        for (int k = 0; k < g->n_marked; k++) feel(c, at, k, k + 1, 0);
        feel(c, at, g->n_marked, g->n_listed, 0);
    }
    for (int v = 0; v < g->n_kept && plain && g->speed != 0; v++) {
        double *vector = vector_of(c, v), *x = vector + (c->x - c->numbers);
        double later = vector[c->n_smooth] + dot(m->n_x, x, before);
        later -= dot(m->n_x, kept_vector(c, v) + (c->x - c->numbers), behind);
        for (size_t n = 0; n < c->n_smooth; n++) vector[n] += later / g->speed * slope[n];
    }
    state_copy_in(c, at->before);
    read_before(c, speed);
    if (!tells && touches >= 0) {
        add_small_doubt(c, FAILURE_LOST_AT_TOUCH, slope);
        g->doubts[g->n_doubts - 1].place = (double)(g->cause - m->transitions);
    }
    add_touches_at(c, speed);
    int moves = tells && speed != 0 && (g->speed != 0 || read);
    g->cause_speed = speed;
    if (at->n_rounds > 0 && (moves || g->early) && factor_implicit(c)) check_meeting(c, at, assignment(c, at, 0).fired);
    if (moves) check_reading(c, at);
}

/* From behind the start to parameters, inputs and start values. */
void start_back(Instance *c, const Record *at) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    keep_vectors(c);
    list_numbers(c, at);
    state_copy_in(c, at->behind);
    int plain = !m->settings->steady && m->n_ideals == 0 && !anything_shared(c);
    feel(c, at, 0, g->n_listed, plain);
    if (!plain) return;
    state_copy_in(c, at->before);
    at->pass(c); /* what follows from the start is in the slots */
    for (int v = 0; v < g->n_kept; v++) {
        const double *old = kept_vector(c, v);
        double *vector = vector_of(c, v), *starts = g->work;
        memset(vector + (c->x - c->numbers), 0, (size_t)m->n_x * sizeof(double));
        memset(vector + (c->d - c->numbers), 0, (size_t)m->n_d * sizeof(double));
        memset(c->dots, 0, (size_t)m->slot_results * sizeof(double));
        memcpy(c->dots + m->slot_x, old + (c->x - c->numbers), (size_t)m->n_x * sizeof(double));
        memcpy(c->dots + m->slot_d, old + (c->d - c->numbers), (size_t)m->n_d * sizeof(double));
        if (!start_adjoint(c, starts)) lose_back(c);
        add_bars(c, vector);
        for (int k = 0; k < m->n_starts; k++) vector[c->start_value - c->numbers + k] += starts[k];
    }
}
