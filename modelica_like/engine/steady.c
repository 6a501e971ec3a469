/* Steady starts: all derivatives are zero, except those of states on which nothing depends. They are sought near the
 * guesses, and else where a drive settles that runs from there in steps of time that grow without bound. */
#include "core.h"

#define MAX_NEWTON 50
#define STEADY 1e-6 /* the largest rate, in SI units, that counts as none */
/* Where unknowns are large, or inertias and heat capacities, smaller rates are no rest: what rounding leaves, unknowns
 * explain that change by this share, or it is smaller than any that is told. */
#define EXPLAINED 1e-8
#define LEAST_RATE 1e-12
#define REGULAR 1e-10 /* least entry on the diagonal of R, over the largest, that is no zero */
/* Steps in s: the first one, one that only a settled drive bears, one that nothing bears, the longest after an event,
 * as coarse ones overshoot and switch for ever. */
#define FIRST_STEP 1e-4
#define LAST_STEP 1e6
#define LEAST_STEP 1e-12
#define STEP_AFTER_EVENT 1e-3
/* Steps grow by this factor, by less with every event, and shrink where they fail. */
#define GROWTH 3.0
#define LEAST_GROWTH 1.2
#define CAUTION 0.8
#define SHRINKAGE 10.0
#define MOST_STEPS 1000
#define MOST_ITERATIONS 8
#define MOST_ROUNDS_OF_STEP 10
#define MOST_TICKS 100  /* after which what samplers keep is taken to stay */
#define STEP_FOUND 1e-9 /* change by Newton's method after which only the end of all counts: it is but a guess */

/* Rates of moving states and residuals of implicit equations, their slopes in the matrix of steps, and at the point of
 * work the rates that these explain. Tells whether they are finite. */
static int steady_equations(Instance *c, double *values) {
    const Model *m = c->model;
    int finite = 1;
    evaluate_now(c, &m->tapes.rates, c->rhs);
    tape_run(&m->tapes.jacobian, c->slots, c->jacobian);
    memset(c->matrix, 0, (size_t)m->step.n_nonzeros * sizeof(double));
    for (int k = 0; k < m->n_jacobian; k++) c->matrix[m->jacobian_to_step[k]] = c->jacobian[k];
    for (int i = 0; i < m->n_unknowns; i++) {
        c->steady_places[i] = -1;
        c->point[i] = LEAST_RATE;
    }
    for (const int *j = m->steady; j < m->steady + m->n_steady; j++)
        for (int k = m->step.colind[*j]; k < m->step.colind[*j + 1]; k++)
            c->point[m->step.row[k]] += EXPLAINED * fabs(c->matrix[k]) * (1 + fabs(c->x[*j]));
    for (int i = 0; i < m->n_steady; i++) {
        c->steady_places[m->steady[i]] = i;
        values[i] = c->rhs[m->steady[i]];
        finite &= isfinite(values[i]) && isfinite(c->point[m->steady[i]]);
    }
    return finite;
}

/* Solves (slopes - inverse for states) * x = values, in place. Returns 0, and leaves values, where that is singular. */
static int solve_sparse(Instance *c, double inverse, double *values) {
    const Model *m = c->model;
    double least = INFINITY, largest = 0, *x = c->point, size;
    for (int k = 0; k < m->n_x; k++) c->matrix[m->step_diagonal[k]] += c->steady_places[k] < 0 ? 1 : -inverse;
    if (!qr_factor(&m->step, c->matrix, c)) return 0;
    for (int j = 0; j < m->n_unknowns; j++, least = min_of(least, size), largest = max_of(largest, size))
        size = fabs(c->qr_r[m->step.r_colind[j + 1] - 1]);
    if (inverse == 0 && least <= REGULAR * largest) return 0;
    memset(x, 0, (size_t)m->n_unknowns * sizeof(double));
    for (int i = 0; i < m->n_steady; i++) x[m->steady[i]] = values[i];
    qr_solve(&m->step, c, x);
    for (int i = 0; i < m->n_steady; i++) values[i] = x[m->steady[i]];
    return 1;
}

/* The same where slopes may be singular: what nothing depends on and what is conserved stay. */
static void solve_dense(Instance *c, double *values) {
    const Model *m = c->model;
    int n = m->n_steady;
    double *slopes = c->square;
    memset(slopes, 0, (size_t)n * (size_t)n * sizeof(double));
    for (int j = 0; j < n; j++)
        for (int k = m->step.colind[m->steady[j]]; k < m->step.colind[m->steady[j] + 1]; k++)
            if (c->steady_places[m->step.row[k]] >= 0)
                slopes[(size_t)c->steady_places[m->step.row[k]] * n + j] = c->matrix[k];
    keeping_least_squares(n, n - m->n_z, slopes, slopes + (size_t)n * (size_t)n, values, c->point);
    memcpy(values, c->point, (size_t)n * sizeof(double));
}

/* Whether rates of moving states and residuals vanish, up to rounding; slopes that are not finite explain anything. */
static int at_rest(Instance *c) {
    const int *steady = c->model->steady;
    steady_equations(c, c->vector);
    for (int i = 0; i < c->model->n_steady; i++)
        if (!(fabs(c->vector[i]) <= STEADY) || fabs(c->vector[i]) > c->point[steady[i]]) return 0;
    return 1;
}

/* Moves the unknowns; returns the largest change over their size. */
static double move_unknowns(Instance *c, const double *values) {
    double change = 0;
    for (int j = 0; j < c->model->n_steady; j++) {
        double *x = &c->x[c->model->steady[j]];
        *x -= values[j];
        change = max_of(change, isfinite(*x) ? fabs(values[j]) / (1 + fabs(*x)) : INFINITY);
    }
    return change;
}

/* States with zero derivatives, the nearest to the guess. */
static Result solve_steady(Instance *c) {
    for (int round = 0; round < MAX_NEWTON && steady_equations(c, c->vector); round++) {
        if (!solve_sparse(c, 0, c->vector)) solve_dense(c, c->vector);
        if (move_unknowns(c, c->vector) <= 1e-13) break;
    }
    return at_rest(c) ? RESULT_OK : fail(c, NOT_STEADY, c->state.t);
}

/* What modes hold stops, with the least change of the states. */
static void stand_still(Instance *c) {
    int count = 0;
    if (c->model->n_holds == 0) return;
    find_held(c, c->terms, c->held);
    for (int k = 0; k < c->model->n_holds; k++)
        if (c->held[k]) c->standing[count++] = c->model->holds[k].motion;
    if (count > 0) move_states(c, c->standing, NULL, count);
}

static int guard_fires(const Instance *c, const Transition *one) {
    return !one->timed && is_source(c, one) && c->guards_before[one->index] > 0;
}

/* Surfaces that stick against too large a torque are not in equilibrium. */
static Result check_modes_hold(Instance *c) {
    const Model *m = c->model;
    if (m->n_guards == 0) return RESULT_OK;
    evaluate_now(c, &m->tapes.guards, c->guards_before);
    for (int k = 0; k < m->n_transitions; k++)
        if (guard_fires(c, &m->transitions[k]) && m->transitions[k].target != (int)c->d[m->transitions[k].mode])
            return fail(c, MODE_NOT_STEADY, c->state.t, k);
    return RESULT_OK;
}

/* Whether states that settle are where they were before a tick; the others drift on until the next one. */
static int stays(Instance *c, const double *before, double step) {
    const Model *m = c->model;
    int same = 1;
    for (int k = 0; k < m->n_x; k++)
        if (c->steady_places[k] >= 0) same &= fabs(c->x[k] - before[k]) <= EXPLAINED * (1 + fabs(before[k]));
        else if (isfinite(step)) c->x[k] += step * c->rhs[k];
    return same;
}

/* What samplers keep belongs to a steady state: it is one if clocks may tick, and state events happen on the way, and
 * all stays at rest. The memory of a linear controller that moves nothing in as many ticks as it has numbers never
 * does. Where all is after the last tick tells what changes, though nothing moves with it. */
Result check_ticks(Instance *c) {
    const Model *m = c->model;
    int rounds = (int)min_of(m->n_updates + m->n_resets + 1, MOST_TICKS), rests = 1;
    double step;
    if (m->n_steady == 0 || count_clocks(c) == 0) return RESULT_OK;
    for (int k = 0; k < rounds && rests; k++) {
        const double *before = keep_start(c, KEPT_TICK, 0);
        memcpy(c->d_before, c->d, (size_t)m->n_d * sizeof(double));
        if (!tick(c, &step)) return RESULT_ERROR;
        rests = at_rest(c) && stays(c, before, step);
    }
    return rests ? RESULT_OK : fail(c, MEMORY_NOT_STEADY, c->state.t);
}

/* The steady state of the present modes near the present point, as long as no clock ticks. */
Result steady_near(Instance *c) {
    stand_still(c);
    return solve_steady(c) && check_modes_hold(c);
}

/* States and modes of a steady state, from modes whose shares are known; states have their fixed start values, or also
 * defaults, before each round. */
Result find_steady(Instance *c, int fixed, int defaults) {
    const Model *m = c->model;
    for (int round = 0; round < MODE_ROUNDS; round++) {
        if (defaults) apply_defaults(c);
        if (fixed && !apply_fixed(c)) return RESULT_ERROR;
        variables_now(c);
        for (int k = 0; k < m->n_holds; k++) c->begun[k] = c->variables[m->holds[k].motion];
        stand_still(c);
        if (!solve_steady(c)) return RESULT_ERROR;
        if (!choose_start_modes(c, c->begun, 0)) return complete_start(c) && check_modes_hold(c);
        share(c);
    }
    return fail(c, START_NOT_SETTLED, 0);
}

/* One step by Euler's implicit method; 0 where Newton's method does not find it. A long step is nearly singular by
 * design; what is not finite tells if it is. */
static int step_settling(Instance *c, const double *begin, double step) {
    const int *steady = c->model->steady, states = c->model->n_steady - c->model->n_z;
    double *values = c->vector;
    for (int round = 0; round < MOST_ITERATIONS && steady_equations(c, values); round++) {
        for (int i = 0; i < states; i++) values[i] -= (c->x[steady[i]] - begin[steady[i]]) / step;
        if (!solve_sparse(c, 1 / step, values)) return 0;
        if (move_unknowns(c, values) < STEP_FOUND) return 1;
    }
    return 0;
}

/* Fires transitions, of each mode the first, with the states they reset; tells whether a mode changed. */
static int fire_settling(Instance *c) {
    const Model *m = c->model;
    int changed = 0;
    unsigned char *firing = nothing_wanting(c);
    evaluate_now(c, &m->tapes.guards, c->guards_before);
    if (m->n_resets > 0) evaluate_now(c, &m->tapes.resets, c->reset_values);
    memset(c->decided, 0, (size_t)m->n_d);
    for (int k = 0; k < m->n_transitions; k++) {
        const Transition *one = &m->transitions[k];
        if (c->decided[one->mode] || !guard_fires(c, one)) continue;
        changed |= c->d[one->mode] != one->target;
        c->decided[one->mode] = 1;
        c->d[one->mode] = one->target;
        firing[k] = 1;
    }
    int count = take_resets(c, firing, c->d_fired); /* of no discrete value */
    if (count > 0) move_states(c, c->targets, c->target_values, count);
    return changed;
}

/* Runs until nothing changes; transitions fire at the ends of steps. It is no simulation: only the end counts. */
static Result settle_down(Instance *c) {
    const Model *m = c->model;
    double step = FIRST_STEP, growth = GROWTH;
    if (!solve_now(c, 0)) return RESULT_ERROR;
    for (int k = 0; k < MOST_STEPS; k++) {
        const double *kept = keep_start(c, KEPT_SETTLING, 0);
        int found = step_settling(c, kept, step), fired;
        for (int round = 0; round < MOST_ROUNDS_OF_STEP && found && fire_settling(c); round++) {
            share(c);
            stand_still(c);
            found = solve_now(c, 0);
        }
        fired = memcmp(kept + m->n_unknowns, c->d, (size_t)m->n_d * sizeof(double)) != 0;
        if (!found) {
            keep_start(c, KEPT_SETTLING, 1);
            step /= SHRINKAGE;
            if (step < LEAST_STEP) return RESULT_ERROR;
        } else if (fired) {
            step = min_of(step, STEP_AFTER_EVENT);
            growth = max_of(growth * CAUTION, LEAST_GROWTH);
        } else if (step >= LAST_STEP) return RESULT_OK;
        else step *= growth;
    }
    return RESULT_ERROR;
}

/* With the modes that guesses choose, or with those that are declared, except which way surfaces slide: nothing but the
 * guesses can tell that. */
static Result begin_at_guesses(Instance *c, int declared) {
    begin_start(c);
    apply_defaults(c);
    if (!apply_fixed(c)) return RESULT_ERROR;
    choose_start_modes(c, NULL, declared);
    share(c);
    return RESULT_OK;
}

/* Guesses may drive a controller into its limits, and from there only the other limit is found, or nothing. If nothing
 * is found in any way, the first one tells why. */
Result start_steady(Instance *c) {
    if (begin_at_guesses(c, 0) && find_steady(c, 1, 1)) return RESULT_OK;
    Refusal first = c->tried;
    keep_start(c, KEPT_FAILED, 0);
    if (begin_at_guesses(c, 1) && find_steady(c, 1, 1)) return RESULT_OK;
    if (begin_at_guesses(c, 0) && settle_down(c)) {
        choose_start_modes(c, NULL, 0);
        share(c);
        if (find_steady(c, 1, 0)) return RESULT_OK;
    }
    keep_start(c, KEPT_FAILED, 1);
    c->tried = first;
    return RESULT_ERROR;
}
