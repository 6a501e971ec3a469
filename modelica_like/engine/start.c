/* Consistent start values and modes: tables say which start values determine what, Newton's method does the rest. */
#include "core.h"

#define MODE_ROUNDS 5
#define MAX_NEWTON 50
#define CONSISTENT 1e-8
#define AT_REST (-1) /* in place of a start value: the variable is zero */

/* Start values as the model says, or as they were given. */
void start_values(Instance *c) {
    evaluate_now(c, &c->model->tapes.start_values, c->start_values);
    for (int k = 0; k < c->model->n_starts; k++)
        if (c->start_given[k]) c->start_values[k] = c->start_value[k];
}

static Result apply_direct(Instance *c) {
    const Model *m = c->model;
    unsigned char *known = memset(c->known, 0, (size_t)m->n_x);
    double *x = c->x;
    for (int k = 0; k < m->n_start_direct; k++) {
        const StartOf *one = &m->start_direct[k];
        double value = c->start_values[one->start] / one->factor;
        if (known[one->position] && fabs(value - x[one->position]) > CONSISTENT * (1 + fabs(x[one->position])))
            return fail(c, STARTS_CONTRADICT, one->start, x[one->position], value);
        if (!known[one->position]) x[one->position] = value;
        known[one->position] = 1;
    }
    return RESULT_OK;
}

/* Guesses, or defaults: they contradict nothing. */
static void apply(Instance *c, const StartOf *starts, int count) {
    for (int k = 0; k < count; k++) c->x[starts[k].position] = c->start_values[starts[k].start] / starts[k].factor;
}

/* Newton's method on the equations between free states, the variables that follow from them, and start values. */
static Result solve_start_system(Instance *c) {
    const Model *m = c->model;
    double *residual = c->start_residual, *step = c->start_unknowns, error = 0;
    if (m->n_start_unknowns == 0) return RESULT_OK;
    memset(c->slots + m->slot_y, 0, m->n_y * sizeof(double));
    for (int k = 0; k < m->n_start_zero; k++) c->x[m->start_zero[k]] = 0;
    for (int round = 0; round < MAX_NEWTON; round++) {
        double change = 0;
        evaluate_now(c, &m->tapes.start_system, residual);
        tape_run(&m->tapes.start_jacobian, c->slots, c->jacobian);
        error = 0;
        for (int k = 0; k < m->n_start_unknowns; k++) {
            int given = m->start_rows[k].start;
            double target = given == AT_REST ? 0 : c->start_values[given];
            step[k] = residual[m->start_rows[k].row] - target;
            error = fmax(error, isfinite(step[k]) ? fabs(step[k]) / (1 + fabs(target)) : INFINITY);
        }
        if (!isfinite(error) || !qr_factor(&m->start, c->jacobian, c)) {
            error = INFINITY;
            break;
        }
        qr_solve(&m->start, c, step);
        for (int k = 0; k < m->n_start_unknowns; k++) {
            int column = m->start_columns[k]; /* among states, implicit unknowns, variables */
            double *y = &c->slots[m->slot_y] - m->n_unknowns, *unknown = column < m->n_unknowns ? c->x : y;
            unknown += column;
            *unknown -= step[k];
            change = fmax(change, fabs(step[k]) / (1 + fabs(*unknown)));
        }
        if (change < 1e-13) break;
    }
    if (error <= CONSISTENT) return RESULT_OK;
    return fail(c, START_NOT_FOUND, 0);
}

static Result check_dependent(Instance *c) {
    const Model *m = c->model;
    if (m->n_start_dependent == 0) return RESULT_OK;
    variables_now(c);
    for (int k = 0; k < m->n_start_dependent; k++) {
        double value = c->start_values[m->start_dependent[k].start], actual = c->variables[m->start_dependent[k].node];
        if (!(fabs(actual - value) <= CONSISTENT * (1 + fabs(value))))
            return fail(c, START_NOT_MET, value, m->start_dependent[k].start, actual);
    }
    return RESULT_OK;
}

/* States with zero derivatives, the nearest to the guess; what nothing depends on and what is conserved stay. An error
 * is told by who calls this, because other modes may be tried. */
static Result solve_steady(Instance *c) {
    const Model *m = c->model;
    int n = m->n_steady;
    double *rates = c->rhs, *a = c->square, *step = c->point, residual = INFINITY;
    for (int round = 0; round < MAX_NEWTON && n > 0; round++) {
        double change = 0;
        evaluate_now(c, &m->tapes.rates, rates);
        tape_run(&m->tapes.jacobian, c->slots, c->jacobian);
        memset(c->matrix, 0, (size_t)m->step.n_nonzeros * sizeof(double));
        for (int k = 0; k < m->n_jacobian; k++) c->matrix[m->jacobian_to_step[k]] = c->jacobian[k];
        memset(a, 0, (size_t)n * (size_t)n * sizeof(double));
        for (int j = 0; j < n; j++)
            for (int k = m->step.colind[m->steady[j]]; k < m->step.colind[m->steady[j] + 1]; k++)
                for (int i = 0; i < n; i++)
                    if (m->steady[i] == m->step.row[k]) a[i * n + j] = c->matrix[k];
        residual = 0;
        for (int i = 0; i < n; i++) {
            c->vector[i] = rates[m->steady[i]];
            residual = fmax(residual, isfinite(c->vector[i]) ? fabs(c->vector[i]) : INFINITY);
        }
        if (!isfinite(residual)) break;
        keeping_least_squares(n, n - m->n_z, a, a + (size_t)n * (size_t)n, c->vector, step);
        for (int j = 0; j < n; j++) {
            c->x[m->steady[j]] -= step[j];
            change = fmax(change, fabs(step[j]) / (1 + fabs(step[j])));
        }
        if (change < 1e-13) break;
    }
    return n == 0 || residual <= 1e-6 ? RESULT_OK : RESULT_ERROR;
}

/* Equations of discrete variables, whose values before the start are their start values. */
static void start_equations(Instance *c) {
    const Model *m = c->model;
    double *values = c->reset_values, *starts = c->guards;
    if (m->n_updates == 0) return;
    evaluate_now(c, &m->tapes.discrete_starts, starts);
    for (int k = 0; k < m->n_updates; k++)
        if (m->updates[k].at_start >= 0) c->d[m->updates[k].at_start] = starts[m->updates[k].at_start];
    evaluate_now(c, &m->tapes.updates, values);
    for (int k = 0; k < m->n_updates; k++)
        if (m->updates[k].at_start >= 0) c->d[m->updates[k].at_start] = values[k];
}

/* Choose modes that are not decided by their start conditions: the first that holds wins. */
void choose_modes(Instance *c) {
    evaluate_now(c, &c->model->tapes.start_conditions, c->guards);
    for (int k = 0; k < c->model->n_start_modes; k++) {
        const StartMode *one = &c->model->start_modes[k];
        if (c->guards[k] == 0 || c->decided[one->mode]) continue;
        c->decided[one->mode] = 1;
        c->d[one->mode] = one->target;
    }
}

/* What slides one way where it began the other way (`begun`, if there is a steady state before) is held: equilibrium
 * lies in between, where it stands still. Others may be asked to be as `declared`. Tells whether a mode changed. */
static int choose_start_modes(Instance *c, const double *begun, int declared) {
    const Model *m = c->model;
    memcpy(c->decided, c->mode_given, (size_t)m->n_d);
    memcpy(c->d_before, c->d, (size_t)m->n_d * sizeof(double));
    choose_modes(c);
    if (declared) memcpy(c->decided, c->mode_given, (size_t)m->n_d);
    for (int k = 0; k < m->n_holds && declared; k++) c->decided[m->holds[k].mode] = 1;
    evaluate_now(c, &m->tapes.discrete_starts, c->guards);
    for (int k = 0; k < m->n_start_modes; k++)
        if (!c->decided[m->start_modes[k].mode]) c->d[m->start_modes[k].mode] = c->guards[m->start_modes[k].mode];
    if (begun) variables_now(c);
    for (int k = 0; k < m->n_holds && begun; k++) {
        const Held *one = &m->holds[k];
        if (begun[k] * c->variables[one->motion] < 0 && c->d[one->mode] != c->d_before[one->mode])
            c->d[one->mode] = one->number;
    }
    start_equations(c);
    return memcmp(c->d_before, c->d, (size_t)m->n_d * sizeof(double)) != 0;
}

/* The steady state of the present modes, in which what they hold stands still; held motions become what they were. */
static Result find_steady(Instance *c, double *begun) {
    const Model *m = c->model;
    int count = 0;
    apply(c, m->start_default, m->n_start_default);
    if (!apply_direct(c)) return RESULT_ERROR;
    if (m->n_holds > 0) find_held(c, c->terms, c->held);
    variables_now(c);
    for (int k = 0; k < m->n_holds; k++) {
        begun[k] = c->variables[m->holds[k].motion];
        if (c->held[k]) c->standing[count++] = m->holds[k].motion;
    }
    if (count > 0) move_states(c, c->standing, NULL, count);
    return solve_steady(c);
}

/* Surfaces that stick against too large a torque are not in equilibrium. */
static Result check_modes_hold(Instance *c) {
    const Model *m = c->model;
    if (m->n_guards == 0 || !m->settings->steady) return RESULT_OK;
    evaluate_now(c, &m->tapes.guards, c->guards_before);
    for (int k = 0; k < m->n_guards; k++) {
        const Transition *one = &m->transitions[m->guard_transition[k]];
        if (guard_active(c, k) && c->guards_before[k] > 0 && one->target != (int)c->d[one->mode])
            return fail(c, MODE_NOT_STEADY, c->state.t, m->guard_transition[k]);
    }
    return RESULT_OK;
}

/* States and modes. A steady state is sought from the modes that guesses choose, or from those that are declared. */
static Result start_settled(Instance *c, double *begun, int declared) {
    const Model *m = c->model;
    memcpy(c->x, m->guesses, m->n_unknowns * sizeof(double));
    memset(c->d, 0, m->n_d * sizeof(double));
    evaluate_now(c, &m->tapes.discrete_starts, c->guards);
    for (int k = 0; k < m->n_d; k++)
        if (!c->mode_given[k]) c->d[k] = c->guards[k];
    share(c);
    start_values(c);
    apply(c, m->start_guess, m->n_start_guess);
    if (begun) {
        apply(c, m->start_default, m->n_start_default);
        if (!apply_direct(c)) return RESULT_ERROR;
        choose_start_modes(c, NULL, declared);
        share(c);
    }
    for (int round = 0; round < MODE_ROUNDS; round++) {
        if (!(begun ? find_steady(c, begun)
                    : apply_direct(c) && solve_start_system(c) && solve_now(c, 0) && check_dependent(c)))
            return RESULT_ERROR;
        if (!choose_start_modes(c, begun, 0)) return RESULT_OK;
        share(c);
    }
    if (begun) return RESULT_ERROR;
    return fail(c, START_NOT_SETTLED, 0);
}

static Result pass_start(Instance *c) {
    double *begun = c->model->settings->steady ? c->begun : NULL;
    if (!check_tables(c)) return RESULT_ERROR;
    if (!start_settled(c, begun, 0) && !(begun && start_settled(c, begun, 1)))
        return begun ? fail(c, NOT_STEADY, c->state.t) : RESULT_ERROR;
    rest(c);
    replace_dependent(c);
    if (!solve_now(c, 0) || !check_singular(c) || !check_modes_hold(c)) return RESULT_ERROR;
    c->state.z_valid = c->state.solved = 1;
    c->state.piece_valid = c->state.event_pending = c->variables_valid = 0;
    return RESULT_OK;
}

/* States from parameters and start values; events at the start have not happened yet. */
Result start_solve(Instance *c) { return gradient_through(c, pass_start, 1); }
