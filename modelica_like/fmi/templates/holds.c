/* Motions that modes hold, as in initialize/holds.py: how elements share what they hold together, and impacts. */
#include <math.h>
#include <string.h>
#include "core.h"

#define TERMS 4 /* gain, capacity forward, capacity backward, restitution */
#define UNLIMITED 1e30
#define DEPENDENT 1e-9
#define ROUNDING 1e-10
#define INSTANT 1e-9 /* duration of an impact; finite forces cancel whatever it is */
#define WEIGHS_NOTHING 1e-12
#define LARGE 1e6

typedef struct {
    double gain, forward, backward, restitution;
} Terms;

typedef struct { /* of all motions that modes hold */
    double before[AT_LEAST_ONE(N_HOLDS)], approach[AT_LEAST_ONE(N_HOLDS)];
    double impulse[AT_LEAST_ONE(N_HOLDS)], reaction[AT_LEAST_ONE(N_HOLDS)];
    unsigned char entering[AT_LEAST_ONE(N_HOLDS)], loose[AT_LEAST_ONE(N_HOLDS)], held[AT_LEAST_ONE(N_HOLDS)];
    double jump[AT_LEAST_ONE(N_X)];
} Strike;

static void hold_terms(Instance *c, Terms *terms) {
    State *s = &c->state;
    evaluate(c, &tape_hold_terms, s->t, s->x, s->z, (double *)terms);
}

/* Marks the motions that are held. */
static void mark_held(Instance *c, const Terms *terms, unsigned char *held) {
    for (int k = 0; k < N_HOLDS; k++)
        held[k] = c->state.d[model_holds[k].mode] == model_holds[k].number && terms[k].gain != 0;
}

/* Put held motions that are zero but for rounding at zero, where they are states. */
void rest(Instance *c) {
    State *s = &c->state;
    Terms terms[AT_LEAST_ONE(N_HOLDS)];
    unsigned char held[AT_LEAST_ONE(N_HOLDS)];
    const double *values = c->work.variables;
    if (N_HOLDS == 0) return;
    hold_terms(c, terms);
    mark_held(c, terms, held);
    evaluate(c, &tape_variables, s->t, s->x, s->z, c->work.variables);
    for (int k = 0; k < N_HOLDS; k++) {
        const Held *one = &model_holds[k];
        double largest = 0;
        if (!held[k] || one->state < 0) continue;
        for (int n = 0; n < N_NODES; n++)
            if (model_units[n] == model_units[one->motion]) largest = fmax(largest, fabs(values[n]));
        if (fabs(values[one->motion]) <= ROUNDING * largest) s->x[one->state] = 0;
    }
}

/* ---- sharing ---------------------------------------------------------------------------------------------------- */

/* Bring dependences to the form of an identity in one column each, the largest one left; write these columns' shares.
 */
static void eliminate(
    int rows, int n, double *silent, double *weighted, const int *place, int members, double *switches) {
    double *shares = switches + members;
    int pivots[AT_LEAST_ONE(MOST_MEMBERS)];
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
        double largest = 0;
        for (int k = 0; k < n; k++) largest = fmax(largest, fabs(own[k]));
        switches[place[pivots[row]]] = 1;
        for (int k = 0; k < n; k++) shares[place[pivots[row]] * members + place[k]] = own[k] / largest;
    }
}

/* Capacities that decide the split: what nothing limits takes nearly all, what bears nothing nearly nothing. */
static void capacities(const Terms *terms, const int *member, int n, double *found) {
    double largest = 0;
    for (int k = 0; k < n; k++) {
        found[k] = fmax(terms[member[k]].forward, terms[member[k]].backward);
        if (found[k] < UNLIMITED) largest = fmax(largest, found[k]);
    }
    if (largest == 0) largest = 1;
    for (int k = 0; k < n; k++) found[k] = fmin(fmax(found[k], largest / LARGE), largest * LARGE);
}

/* Dependences among n held motions of a circuit become the rows of `silent`; returns their number. */
static int dependences(Instance *c, const int *member, int n, double *silent) {
    double *slopes = c->work.square, *turns = slopes + (size_t)MOST_MEMBERS * N_X;
    double sizes[AT_LEAST_ONE(MOST_MEMBERS)], nothing[AT_LEAST_ONE(MOST_MEMBERS)] = {0};
    int rows = 0;
    memset(turns, 0, (size_t)n * (size_t)n * sizeof(double));
    for (int i = 0; i < n; i++) {
        double *slope = slopes + (size_t)i * N_X, sum = 0;
        adjoint_of_node(c, model_holds[member[i]].motion, slope);
        for (int k = 0; k < N_X; k++) sum += slope[k] * slope[k];
        sizes[i] = sum > 0 ? sqrt(sum) : 1;
        for (int k = 0; k < N_X; k++) slope[k] /= sizes[i];
        turns[(size_t)i * n + i] = 1;
    }
    make_orthogonal(n, N_X, slopes, turns, nothing);
    for (int i = 0; i < n; i++) {
        double sum = 0;
        for (int k = 0; k < N_X; k++) sum += slopes[(size_t)i * N_X + k] * slopes[(size_t)i * N_X + k];
        if (sqrt(sum) > DEPENDENT) continue;
        for (int k = 0; k < n; k++) silent[(size_t)rows * n + k] = turns[(size_t)i * n + k] / sizes[k];
        rows++;
    }
    return rows;
}

/* Let elements that hold the same motion share its reaction in proportion to their capacities: the reactions of the
 * least norm, weighted by the inverse of the capacities. */
void share(Instance *c) {
    State *s = &c->state;
    Terms terms[AT_LEAST_ONE(N_HOLDS)];
    unsigned char held[AT_LEAST_ONE(N_HOLDS)];
    if (N_CIRCUITS == 0) return;
    hold_terms(c, terms);
    mark_held(c, terms, held);
    for (int i = 0; i < N_CIRCUITS; i++) {
        const Circuit *one = &model_circuits[i];
        int place[AT_LEAST_ONE(MOST_MEMBERS)], member[AT_LEAST_ONE(MOST_MEMBERS)], n = 0, rows = 0;
        double *silent = c->work.square + (size_t)MOST_MEMBERS * (N_X + MOST_MEMBERS);
        double *weighted = silent + (size_t)MOST_MEMBERS * MOST_MEMBERS;
        double capacity[AT_LEAST_ONE(MOST_MEMBERS)];
        for (int k = 0; k < one->n_members; k++) {
            member[n] = model_members[one->first_member + k];
            place[n] = k;
            n += held[member[n]];
        }
        if (n > 1) rows = dependences(c, member, n, silent);
        if (n > 1) capacities(terms, member, n, capacity);
        for (int k = 0; k < rows * n; k++) weighted[k] = silent[k] / capacity[k % n];
        memset(s->d + one->first, 0, (size_t)one->n_members * (size_t)(1 + one->n_members) * sizeof(double));
        eliminate(rows, n, silent, weighted, place, one->n_members, s->d + one->first);
    }
}

/* ---- impacts ---------------------------------------------------------------------------------------------------- */

static const double *motions(Instance *c) {
    State *s = &c->state;
    evaluate(c, &tape_variables, s->t, s->x, s->z, c->work.variables);
    return c->work.variables;
}

/* Rates and reactions at the present point, with or without the approaches. */
static Result ask(Instance *c, const Strike *strike, int approaching, double *rates, double *reactions) {
    State *s = &c->state;
    const double *values;
    for (int k = 0; k < N_HOLDS; k++) s->d[model_holds[k].approach] = approaching ? strike->approach[k] : 0;
    if (solve_implicit(c, s->t, s->x, s->z, 0) != RESULT_OK) return RESULT_ERROR;
    evaluate(c, &tape_rates, s->t, s->x, s->z, c->work.rhs);
    memcpy(rates, c->work.rhs, N_X * sizeof(double));
    values = motions(c);
    for (int k = 0; k < N_HOLDS; k++) reactions[k] = strike->held[k] ? values[model_holds[k].reaction] : 0;
    return RESULT_OK;
}

/* Jump of the states, impulses and finite reactions of all that holds, with what is loose let go. */
static Result respond(Instance *c, Strike *strike) {
    State *s = &c->state;
    Terms terms[AT_LEAST_ONE(N_HOLDS)];
    double d[AT_LEAST_ONE(N_D)], z[AT_LEAST_ONE(N_Z)], rates[AT_LEAST_ONE(N_X)];
    Result result;
    memcpy(d, s->d, sizeof d);
    memcpy(z, s->z, sizeof z);
    for (int k = 0; k < N_HOLDS; k++)
        if (strike->loose[k]) s->d[model_holds[k].mode] = model_holds[k].loose;
    share(c);
    hold_terms(c, terms);
    mark_held(c, terms, strike->held);
    for (int k = 0; k < N_HOLDS; k++) strike->held[k] &= !strike->loose[k] && model_holds[k].reaction >= 0;
    result = ask(c, strike, 0, rates, strike->reaction);
    if (result == RESULT_OK) result = ask(c, strike, 1, strike->jump, strike->impulse);
    for (int k = 0; k < N_X; k++) strike->jump[k] = INSTANT * (strike->jump[k] - rates[k]);
    for (int k = 0; k < N_HOLDS; k++) strike->impulse[k] = INSTANT * (strike->impulse[k] - strike->reaction[k]);
    memcpy(s->d, d, sizeof d);
    memcpy(s->z, z, sizeof z);
    return result;
}

/* The motion whose reaction exceeds most what its element can bear for an instant, or -1. */
static int unbearable(const Instance *c, const Strike *strike, const Terms *terms) {
    double instant = 10 * TIME_RESOLUTION * fmax(1, fabs(c->state.t)), scale = 0, most = 0;
    int worst = -1;
    for (int k = 0; k < N_HOLDS; k++) scale = fmax(scale, fabs(strike->impulse[k]));
    for (int k = 0; k < N_HOLDS; k++) {
        double sign = strike->impulse[k] > 0 ? 1 : -1, excess;
        double capacity = sign > 0 ? terms[k].forward : terms[k].backward;
        if (!strike->held[k] || capacity >= UNLIMITED || model_holds[k].loose < 0) continue;
        if (strike->entering[k] && fmax(terms[k].forward, terms[k].backward) < UNLIMITED) continue;
        excess = fabs(strike->impulse[k]) - fmax(capacity - sign * strike->reaction[k], 0) * instant;
        if (excess - WEIGHS_NOTHING * scale > most) {
            most = excess - WEIGHS_NOTHING * scale;
            worst = k;
        }
    }
    return worst;
}

/* Carries out the impact; `loose` then tells what was knocked loose or bounces. */
static Result carry_out(Instance *c, Strike *strike) {
    State *s = &c->state;
    Terms terms[AT_LEAST_ONE(N_HOLDS)];
    const double *after;
    int worst;
    hold_terms(c, terms);
    do {
        for (int k = 0; k < N_HOLDS; k++)
            strike->approach[k] = strike->entering[k] && !strike->loose[k]
                                      ? -(1 + terms[k].restitution) * strike->before[k] / INSTANT
                                      : 0;
        if (respond(c, strike) != RESULT_OK) return RESULT_ERROR;
        worst = unbearable(c, strike, terms);
        if (worst >= 0) strike->loose[worst] = 1;
    } while (worst >= 0);
    for (int k = 0; k < N_X; k++) s->x[k] += strike->jump[k];
    for (int k = 0; k < N_HOLDS; k++) {
        const Held *one = &model_holds[k];
        if (strike->entering[k] && !strike->loose[k] && one->state >= 0)
            s->x[one->state] = -terms[k].restitution * strike->before[k] / one->factor;
    }
    if (solve_implicit(c, s->t, s->x, s->z, 0) != RESULT_OK) return RESULT_ERROR;
    after = motions(c);
    for (int k = 0; k < N_HOLDS; k++) {
        int bounces = strike->approach[k] != 0 && terms[k].restitution > 0 && after[model_holds[k].motion] != 0;
        if (bounces) strike->loose[k] = 1;
    }
    return RESULT_OK;
}

/* What the impact knocks loose takes the mode that its start would take. */
static void let_go(Instance *c, const Strike *strike) {
    State *s = &c->state;
    double d[AT_LEAST_ONE(N_D)];
    unsigned char decided[AT_LEAST_ONE(N_D)];
    memcpy(d, s->d, sizeof d);
    memset(decided, 1, sizeof decided);
    evaluate(c, &tape_discrete_starts, s->t, s->x, s->z, c->work.guards);
    for (int k = 0; k < N_HOLDS; k++) {
        int mode = model_holds[k].mode;
        if (!strike->loose[k]) continue;
        s->d[mode] = c->work.guards[mode];
        decided[mode] = 0;
    }
    choose_modes(c, decided);
    for (int k = 0; k < N_HOLDS; k++) {
        int mode = model_holds[k].mode, chosen = (int)s->d[mode];
        if (chosen == (int)d[mode]) continue;
        s->d[mode] = d[mode];
        note_change(c, model_holds[k].name, mode, chosen);
        s->d[mode] = d[mode] = chosen;
    }
}

/* Stop what modes have begun to hold since `before`, by an impulse that all other components pass on. */
Result stop_motions(Instance *c, const double *before) {
    State *s = &c->state;
    Strike strike = {{0}, {0}, {0}, {0}, {0}, {0}, {0}, {0}};
    const double *values;
    int moving = 0, loose = 0;
    for (int k = 0; k < N_HOLDS; k++) {
        const Held *one = &model_holds[k];
        strike.entering[k] = s->d[one->mode] == one->number && before[one->mode] != one->number;
        moving |= strike.entering[k];
    }
    if (!moving) return RESULT_OK;
    values = motions(c);
    moving = 0;
    for (int k = 0; k < N_HOLDS; k++) {
        strike.before[k] = values[model_holds[k].motion];
        moving |= strike.entering[k] && strike.before[k] != 0;
    }
    if (!moving) return RESULT_OK;
    if (carry_out(c, &strike) != RESULT_OK) return RESULT_ERROR;
    for (int k = 0; k < N_HOLDS; k++) loose |= strike.loose[k];
    if (!loose) return RESULT_OK;
    let_go(c, &strike);
    share(c);
    return solve_implicit(c, s->t, s->x, s->z, 0);
}
