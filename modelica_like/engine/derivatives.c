/* Derivatives inside a mode, exact: of derivatives, variables and guards by states, inputs, parameters and time, with
 * the implicit unknowns following. */
#include "core.h"

static int known_slot(const Model *m, const Variable *v) {
    const int first[N_KINDS] = {[KIND_STATE] = m->slot_x, [KIND_PARAMETER] = m->slot_p, [KIND_INPUT] = m->slot_u};
    return v->kind == KIND_TIME ? 0 : first[v->kind] > 0 ? first[v->kind] + v->index : -1;
}

/* Before the end of the initialization start values are known instead of states. */
static int is_start(const Instance *c, const Variable *v) {
    return c->state.phase == PHASE_INITIALIZATION && (v->kind == KIND_STATE || v->kind == KIND_VARIABLE);
}

Result check_knowns(Instance *c, const uint32_t *knowns, size_t n) {
    for (size_t k = 0; k < n; k++) {
        const Variable *v = known_variable(c, knowns[k], TYPE_FLOAT64);
        if (v == NULL) return RESULT_ERROR;
        if (is_start(c, v) ? v->start < 0 || v->start >= c->model->n_starts : known_slot(c->model, v) < 0)
            return fail_with(c, FAILURE_BY_NOTHING + is_start(c, v), v->reference, 0, 0);
    }
    return RESULT_OK;
}

Result check_unknowns(Instance *c, const uint32_t *unknowns, size_t n) {
    for (size_t k = 0; k < n; k++) {
        const Variable *v = known_variable(c, unknowns[k], TYPE_FLOAT64);
        if (v == NULL) return RESULT_ERROR;
        if (v->kind == KIND_DISCRETE) return fail(c, OF_DISCRETE, v->reference);
    }
    return RESULT_OK;
}

/* Factorises the Jacobian of the implicit equations at the present point, with the slots of m->tapes.rates filled. */
Result factor_implicit(Instance *c) {
    if (!settle(c)) return RESULT_ERROR;
    if (c->model->n_z == 0) return RESULT_OK;
    evaluate_special(c, &c->model->tapes.alg_jacobian, c->state.t, c->x, c->dense_matrix);
    if (!lu_factor(c->model->n_z, c->dense_matrix, c->order)) return fail(c, IMPLICIT_SINGULAR, c->state.t);
    return RESULT_OK;
}

/* Runs a tape at the present point and returns the one whose results are in the slots: a gradient needs derivatives by
 * what it has been asked for only. */
static const Tape *run_now(Instance *c, const Tape *tape, double *results) {
    if (c->passing && (tape == &c->model->tapes.alg || tape == &c->model->tapes.rates))
        return evaluate_on_tape(c, tape, c->state.t, c->x, results);
    evaluate_now(c, tape, results);
    return tape;
}

/* Derivatives of what a tape gives at the present point, with the dots of its arguments given. */
void tangent_now(Instance *c, const Tape *tape, double *results) {
    tape_tangent(run_now(c, tape, results), c->slots, c->dots, results);
}

/* With the dots of the arguments given, fills those of z. */
void tangent_of_implicit(Instance *c) {
    const Model *m = c->model;
    double *dots = c->dots;
    if (m->n_z == 0) return;
    memset(dots + m->slot_z, 0, m->n_z * sizeof(double));
    tangent_now(c, &m->tapes.alg, c->vector);
    lu_solve(m->n_z, c->dense_matrix, c->order, c->vector);
    for (int k = 0; k < m->n_z; k++) dots[m->slot_z + k] = -c->vector[k];
}

static void seed_knowns(Instance *c, const uint32_t *knowns, size_t n, const double *seed) {
    memset(c->dots, 0, c->model->slot_results * sizeof(double));
    for (size_t k = 0; k < n; k++) {
        const Variable *v = find_variable(c->model, knowns[k]);
        if (!is_start(c, v)) c->dots[known_slot(c->model, v)] += seed[k];
    }
}

/* Newton's last step once more, with what the start equations change by instead of what they lack. */
static Result start_system_tangent(Instance *c, const double *start_dots) {
    const Model *m = c->model;
    evaluate_now(c, &m->tapes.start_system, c->start_residual);
    tape_run(&m->tapes.start_jacobian, c->slots, c->jacobian);
    if (!qr_factor(&m->start, c->jacobian, c)) return fail(c, START_SINGULAR, c->state.t);
    tangent_now(c, &m->tapes.start_system, c->start_residual);
    for (int k = 0; k < m->n_start_unknowns; k++) {
        int start = m->start_rows[k].start;
        c->start_unknowns[k] = (start < 0 ? 0 : start_dots[start]) - c->start_residual[m->start_rows[k].row];
    }
    qr_solve(&m->start, c, c->start_unknowns);
    for (int k = 0; k < m->n_start_unknowns; k++)
        if (m->start_columns[k] < m->n_x) c->dots[m->slot_x + m->start_columns[k]] = c->start_unknowns[k];
    return RESULT_OK;
}

/* What states change by with parameters, inputs and start values: through the start equations, in the modes found. */
static Result start_tangent(Instance *c, const uint32_t *knowns, size_t n, const double *seed) {
    const Model *m = c->model;
    double *dots = c->dots, *starts = c->start_values;
    c->state.solved = 0;
    if (!start_solve(c)) return RESULT_ERROR;
    if (m->settings->steady || anything_shared(c))
        return refuse(
            c, "A steady start, and one at which parts share a load, have derivatives after the initialization only.");
    seed_knowns(c, knowns, n, seed);
    tangent_now(c, &m->tapes.discrete_starts, c->guards);
    for (int k = 0; k < m->n_d; k++) dots[m->slot_d + k] = c->mode_given[k] ? 0 : c->guards[k];
    tangent_now(c, &m->tapes.start_values, starts);
    for (int k = 0; k < m->n_starts; k++) starts[k] = c->start_given[k] ? 0 : starts[k];
    for (size_t k = 0; k < n; k++) {
        const Variable *v = find_variable(m, knowns[k]);
        if (is_start(c, v)) starts[v->start] += seed[k];
    }
    for (int k = m->n_start_direct; k-- > 0;) /* the first counts */
        dots[m->slot_x + m->start_direct[k].position] = starts[m->start_direct[k].start] / m->start_direct[k].factor;
    return m->n_start_unknowns > 0 ? start_system_tangent(c, starts) : RESULT_OK;
}

/* Equations of discrete variables at the start, backwards: they begin with start values, as start_equations. */
static void update_adjoint(Instance *c) {
    const Model *m = c->model;
    double *bars = c->reset_values, *d = c->dots + m->slot_d;
    if (m->n_updates == 0 || !factor_implicit(c)) return;
    memcpy(c->d_begun, c->d, (size_t)m->n_d * sizeof(double));
    const double *starts = discrete_starts(c);
    for (int k = 0; k < m->n_updates; k++)
        if (m->updates[k].at_start >= 0) c->d[m->updates[k].at_start] = starts[m->updates[k].at_start];
    evaluate_now(c, &m->tapes.updates, bars);
    memset(bars, 0, (size_t)m->tapes.updates.n_outputs * sizeof(double));
    for (int k = 0; k < m->n_updates; k++) {
        int entry = m->updates[k].at_start;
        if (entry >= 0) bars[k] += d[entry], d[entry] = 0;
    }
    tape_adjoint(&m->tapes.updates, c->slots, c->dots, bars);
    adjoint_of_implicit(c, 1);
    memcpy(c->d, c->d_begun, (size_t)m->n_d * sizeof(double));
}

/* The same backwards, from bars of states, parameters, inputs and d, which lie in `dots`, to those of parameters and
 * inputs there, and of start values. The start has just been found here. */
Result start_adjoint(Instance *c, double *start_bars) {
    const Model *m = c->model;
    double *dots = c->dots, *x = dots + m->slot_x, *step = c->start_unknowns, *bars = c->start_residual;
    memset(start_bars, 0, (size_t)m->n_starts * sizeof(double));
    update_adjoint(c);
    if (m->n_start_unknowns > 0) {
        evaluate_now(c, &m->tapes.start_jacobian, c->jacobian);
        if (!qr_factor(&m->start, c->jacobian, c)) return RESULT_ERROR;
        evaluate_now(c, &m->tapes.start_system, bars);
        memset(bars, 0, (size_t)m->tapes.start_system.n_outputs * sizeof(double));
        for (int k = 0; k < m->n_start_unknowns; k++)
            step[k] = m->start_columns[k] < m->n_x ? x[m->start_columns[k]] : 0;
        qr_solve_transposed(&m->start, c, step);
        for (int k = 0; k < m->n_start_unknowns; k++) {
            if (m->start_rows[k].start >= 0) start_bars[m->start_rows[k].start] += step[k];
            bars[m->start_rows[k].row] -= step[k];
        }
        tape_adjoint(&m->tapes.start_system, c->slots, dots, bars);
        for (int k = 0; k < m->n_start_unknowns; k++)
            if (m->start_columns[k] < m->n_x) x[m->start_columns[k]] = 0;
    }
    for (int k = 0; k < m->n_start_direct; k++) { /* the first counts */
        const StartOf *from = &m->start_direct[k];
        start_bars[from->start] += x[from->position] / from->factor;
        x[from->position] = 0;
    }
    evaluate_now(c, &m->tapes.start_values, c->start_values);
    for (int k = 0; k < m->n_starts; k++) c->start_values[k] = c->start_given[k] ? 0 : start_bars[k];
    tape_adjoint(&m->tapes.start_values, c->slots, dots, c->start_values);
    evaluate_now(c, &m->tapes.discrete_starts, c->guards);
    for (int k = 0; k < m->n_d; k++) c->guards[k] = c->mode_given[k] ? 0 : dots[m->slot_d + k];
    tape_adjoint(&m->tapes.discrete_starts, c->slots, dots, c->guards);
    return RESULT_OK;
}

/* The tape that gives values of a kind of variables, or NULL. */
static const Tape *tape_of(const Model *m, int kind) {
    if (kind == KIND_DERIVATIVE) return &m->tapes.rates;
    if (kind == KIND_VARIABLE) return &m->tapes.variables;
    return kind == KIND_DERIVED ? &m->tapes.derived : kind == KIND_GUARD ? &m->tapes.guards : NULL;
}

static int is_idle(const Instance *c, const Variable *v) { return v->kind == KIND_GUARD && !guard_active(c, v->index); }

static void read_tangents(Instance *c, const uint32_t *unknowns, size_t n, double *result) {
    const Model *m = c->model;
    double *dots = c->dots, *values = c->outputs;
    for (int kind = 0; kind < N_KINDS; kind++) {
        const Tape *tape = tape_of(m, kind);
        if (tape != NULL) tangent_now(c, tape, values);
        for (size_t k = 0; k < n; k++) {
            const Variable *v = find_variable(m, unknowns[k]);
            if (v->kind != kind) continue;
            result[k] = is_idle(c, v) ? 0 : tape != NULL ? values[v->index] : dots[known_slot(m, v)];
        }
    }
}

Result directional(Instance *c, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns, size_t n_knowns,
    const double *seed, double *result) {
    if (!check_unknowns(c, unknowns, n_unknowns) || !check_knowns(c, knowns, n_knowns)) return RESULT_ERROR;
    if (c->state.phase != PHASE_INITIALIZATION) seed_knowns(c, knowns, n_knowns, seed);
    else if (!start_tangent(c, knowns, n_knowns, seed)) return RESULT_ERROR;
    if (!factor_implicit(c)) return RESULT_ERROR;
    tangent_of_implicit(c);
    read_tangents(c, unknowns, n_unknowns, result);
    return RESULT_OK;
}

/* From bars of z to bars of the arguments, through the implicit equations. */
void adjoint_of_implicit(Instance *c, int regular) {
    const Model *m = c->model;
    if (m->n_z == 0) return;
    for (int k = 0; k < m->n_z; k++) c->vector[k] = -c->dots[m->slot_z + k];
    if (regular) lu_solve_transposed(m->n_z, c->dense_matrix, c->order, c->vector);
    else {
        memcpy(c->residual, c->vector, m->n_z * sizeof(double));
        evaluate_now(c, &m->tapes.alg_jacobian, c->dense_matrix);
        least_squares(m->n_z, m->n_z, c->dense_matrix, c->residual, c->vector);
    }
    memset(c->dots + m->slot_z, 0, m->n_z * sizeof(double));
    adjoint_of_ran(c, &m->tapes.alg, run_now(c, &m->tapes.alg, c->residual), c->vector);
}

/* Leaves the bars of what is known at the present point, where factor_implicit has been called, in `dots`. */
void seed_unknowns(Instance *c, const uint32_t *unknowns, size_t n_unknowns, const double *seed) {
    const Model *m = c->model;
    memset(c->dots, 0, m->slot_results * sizeof(double));
    for (size_t k = 0; k < n_unknowns; k++) {
        int slot = known_slot(m, find_variable(m, unknowns[k]));
        if (slot >= 0) c->dots[slot] += seed[k];
    }
    for (int kind = 0; kind < N_KINDS; kind++) {
        const Tape *tape = tape_of(m, kind);
        double *bars = c->outputs;
        if (tape == NULL) continue;
        evaluate_now(c, tape, bars);
        memset(bars, 0, (size_t)tape->n_outputs * sizeof(double));
        for (size_t k = 0; k < n_unknowns; k++) {
            const Variable *v = find_variable(m, unknowns[k]);
            if (v->kind == kind && !is_idle(c, v)) bars[v->index] += seed[k];
        }
        tape_adjoint(tape, c->slots, c->dots, bars);
    }
    adjoint_of_implicit(c, 1);
}

Result adjoint(Instance *c, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns, size_t n_knowns,
    const double *seed, double *result) {
    if (!check_unknowns(c, unknowns, n_unknowns) || !check_knowns(c, knowns, n_knowns) || !factor_implicit(c))
        return RESULT_ERROR;
    seed_unknowns(c, unknowns, n_unknowns, seed);
    for (size_t k = 0; k < n_knowns; k++) result[k] = c->dots[known_slot(c->model, find_variable(c->model, knowns[k]))];
    return RESULT_OK;
}

/* Total derivative of a variable by the states, z following them. Reactions whose split is undetermined make the
 * equations for z singular; what depends on them is left out. `again`: at the same point as the call before. */
void slope_of_node(Instance *c, int node, int again, double *by_state) {
    const Model *m = c->model;
    double *bars = c->outputs;
    int follows = 0;
    memset(c->dots, 0, m->slot_results * sizeof(double));
    if (!again) evaluate_now(c, &m->tapes.variables, bars);
    memset(bars, 0, m->n_nodes * sizeof(double));
    bars[node] = 1;
    tape_adjoint(&m->tapes.variables, c->slots, c->dots, bars);
    for (int k = 0; k < m->n_z; k++) follows |= c->dots[m->slot_z + k] != 0;
    if (follows) {
        evaluate_now(c, &m->tapes.alg_jacobian, c->dense_matrix);
        adjoint_of_implicit(c, lu_factor(m->n_z, c->dense_matrix, c->order));
        evaluate_now(c, &m->tapes.variables, bars);
    }
    memcpy(by_state, c->dots + m->slot_x, m->n_x * sizeof(double));
}
