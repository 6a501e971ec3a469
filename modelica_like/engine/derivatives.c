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
    tape_adjoint(run_now(c, &m->tapes.alg, c->residual), c->slots, c->dots, c->vector);
    memset(c->dots + m->n_slots, 0, (size_t)c->known_used * sizeof(double)); /* does not move */
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

/* Derivatives of variables by time along the solution, to any order below ORDERS: Taylor series instead of numbers run
 * through the tapes (A. Griewank, A. Walther: Evaluating Derivatives, ch. 13). They are exact up to rounding. */
#define ORDERS 4

typedef double Series[ORDERS]; /* coefficients of powers of the time */

static void multiply(const Series a, const Series b, Series c) {
    for (int k = 0; k < ORDERS; k++) {
        c[k] = 0;
        for (int j = 0; j <= k; j++) c[k] += product(a[j], b[k - j]);
    }
}

static void divide(const Series a, const Series b, Series c) {
    for (int k = 0; k < ORDERS; k++) {
        c[k] = a[k];
        for (int j = 0; j < k; j++) c[k] -= product(c[j], b[k - j]);
        c[k] /= b[0];
    }
}

static void root(const Series a, Series c) {
    c[0] = sqrt(a[0]);
    for (int k = 1; k < ORDERS; k++) {
        c[k] = a[k];
        for (int j = 1; j < k; j++) c[k] -= c[j] * c[k - j];
        c[k] /= 2 * c[0];
    }
}

static void negate(Series a) {
    for (int k = 0; k < ORDERS; k++) a[k] = -a[k];
}

/* Coefficient k of the integral of slope * a'. */
static double integral(const Series a, const Series slope, int k) {
    double sum = 0;
    for (int j = 1; j <= k; j++) sum += product(j * a[j], slope[k - j]);
    return sum / k;
}

/* The slope by a of f = operation(a), from the coefficients of f that are known. Returns 0 for an operation that is
 * linear between jumps, or has two operands. */
static int slope_of(int operation, const Series a, const Series f, Series slope) {
    static const Series one = {1};
    Series s;
    memcpy(slope, f, sizeof s);
    multiply(a, a, s);
    /* clang-format off */
    switch (operation) {
        case OPERATION_EXP: return 1;
        case OPERATION_EXPM1: slope[0] += 1; return 1;
        case OPERATION_TAN: multiply(f, f, slope); slope[0] += 1; return 1;
        case OPERATION_TANH: multiply(f, f, slope); negate(slope); slope[0] += 1; return 1;
        case OPERATION_ERF:
            slope[0] = 1.1283791670955126 * exp(-s[0]);
            for (int k = 1; k < ORDERS; k++) slope[k] = -integral(s, slope, k);
            return 1;
        /* The slope's own slope is f or -f. */
        case OPERATION_SIN: case OPERATION_COS: case OPERATION_SINH: case OPERATION_COSH:
            for (int k = 1; k < ORDERS; k++) slope[k] = integral(a, f, k);
            if (operation == OPERATION_SIN || operation == OPERATION_COS) negate(slope);
            slopes(operation, a[0], a[0], f[0], &slope[0], &s[0]);
            return 1;
        case OPERATION_LOG: divide(one, a, slope); return 1;
        case OPERATION_LOG1P: memcpy(s, a, sizeof s); s[0] += 1; divide(one, s, slope); return 1;
        /* 1 / (±a² ± 1), or 1 over its root */
        case OPERATION_ASIN: case OPERATION_ACOS: case OPERATION_ATANH: negate(s); s[0] += 1; break;
        case OPERATION_ACOSH: s[0] -= 1; break;
        case OPERATION_ATAN: case OPERATION_ASINH: s[0] += 1; break;
        default: return 0;
    }
    /* clang-format on */
    if (operation != OPERATION_ATAN && operation != OPERATION_ATANH) root(s, s);
    divide(one, s, slope);
    if (operation == OPERATION_ACOS) negate(slope);
    return 1;
}

/* f = a^b. */
static void power(const Series a, const Series b, Series f) {
    Series slope, logarithm = {log(a[0])}, exponent;
    double c1 = product(b[0], pow(a[0], b[0] - 1)), c2 = product(b[0] * (b[0] - 1) / 2, pow(a[0], b[0] - 2)),
           c3 = product(b[0] * (b[0] - 1) * (b[0] - 2) / 6, pow(a[0], b[0] - 3));
    if (b[1] == 0 && b[2] == 0 && b[3] == 0) {
        f[1] = product(c1, a[1]);
        f[2] = product(c1, a[2]) + product(c2, a[1] * a[1]);
        f[3] = product(c1, a[3]) + product(c2, 2 * a[1] * a[2]) + product(c3, a[1] * a[1] * a[1]);
        return;
    }
    slope_of(OPERATION_LOG, a, logarithm, slope);
    for (int k = 1; k < ORDERS; k++) logarithm[k] = integral(a, slope, k);
    multiply(b, logarithm, exponent);
    for (int k = 1; k < ORDERS; k++) f[k] = integral(exponent, f, k);
}

/* Coefficients of f = operation(a, b) behind the first, which is given. */
static void extend(int operation, const Series a, const Series b, Series f) {
    double value = f[0], by_a, by_b;
    static const Series one = {1};
    Series s, r, t;
    /* clang-format off */
    switch (operation) {
        case OPERATION_MUL: multiply(a, b, f); return;
        case OPERATION_SQ: multiply(a, a, f); return;
        case OPERATION_DIV: divide(a, b, f); f[0] = value; return;
        case OPERATION_INV: divide(one, a, f); return;
        case OPERATION_SQRT: root(a, f); return;
        case OPERATION_POW: case OPERATION_CONSTPOW: power(a, b, f); return;
        case OPERATION_HYPOT: case OPERATION_ATAN2:
            multiply(a, a, s); multiply(b, b, r);
            for (int k = 0; k < ORDERS; k++) s[k] += r[k];
            if (operation == OPERATION_HYPOT) { root(s, f); return; }
            divide(a, s, r); divide(b, s, t); /* (a² + b²) f' = b a' - a b' */
            for (int k = 1; k < ORDERS; k++) f[k] = integral(a, t, k) - integral(b, r, k);
            return;
        default: break;
    }
    /* clang-format on */
    slopes(operation, a[0], b[0], f[0], &by_a, &by_b);
    for (int k = 1; k < ORDERS; k++)
        f[k] = slope_of(operation, a, f, s) ? integral(a, s, k) : product(by_a, a[k]) + product(by_b, b[k]);
}

/* Evaluates a tape, then its coefficients behind the first: coefficient n of slot k is terms[(n - 1) * n_slots + k]. */
static void run_series(Instance *c, const Tape *tape, int order, double *outputs) {
    const Model *m = c->model;
    double *slots = c->slots, *terms = c->dots;
    int k = 0;
    evaluate_now(c, tape, outputs);
    for (int r = 0; r < tape->n_runs; r++)
        for (int end = k + tape->runs[r].count; k < end; k++) {
            int left = tape->operands[k].left, right = tape->operands[k].right, slot = m->slot_results + k;
            Series a = {slots[left]}, b = {slots[right]}, f = {slots[slot]};
            for (int n = 1; n < ORDERS; n++) {
                a[n] = terms[(n - 1) * m->n_slots + left];
                b[n] = terms[(n - 1) * m->n_slots + right];
            }
            extend(tape->runs[r].operation, a, b, f);
            for (int n = 1; n < ORDERS; n++) terms[(n - 1) * m->n_slots + slot] = f[n];
        }
    for (int n = 0; n < tape->n_outputs && order > 0; n++)
        outputs[n] = terms[(order - 1) * m->n_slots + tape->outputs[n]];
}

/* Derivative of a variable along the solution, with inputs on their straight lines; implicit unknowns follow. */
Result output_rate(Instance *c, uint32_t reference, int order, double *value) {
    const Model *m = c->model;
    const Variable *v = known_variable(c, reference, TYPE_FLOAT64);
    double *terms = c->dots, factorial = 1;
    if (v == NULL) return RESULT_ERROR;
    if (order < 1 || order >= ORDERS) return refuse(c, "Outputs have derivatives of order 1 to %d only.", ORDERS - 1);
    if (v->kind != KIND_VARIABLE && v->kind != KIND_STATE)
        return refuse(c, "%s has no time derivative: it is not a variable.", text_of(m, v->name));
    if (!factor_implicit(c)) return RESULT_ERROR;
    for (int n = 1; n < ORDERS; n++) memset(terms + (n - 1) * m->n_slots, 0, m->slot_results * sizeof(double));
    terms[0] = 1;
    memcpy(terms + m->slot_u, c->u_rate, m->n_u * sizeof(double));
    for (int n = 1; n <= order; n++) {
        run_series(c, &m->tapes.rates, n - 1, c->rhs);
        for (int k = 0; k < m->n_x; k++) terms[(n - 1) * m->n_slots + m->slot_x + k] = c->rhs[k] / n;
        factorial *= n;
        if (m->n_z == 0) continue;
        run_series(c, &m->tapes.alg, n, c->vector); /* without the unknowns' own terms, in which it is linear */
        lu_solve(m->n_z, c->dense_matrix, c->order, c->vector);
        for (int k = 0; k < m->n_z; k++) terms[(n - 1) * m->n_slots + m->slot_z + k] = -c->vector[k];
    }
    if (v->kind == KIND_VARIABLE) run_series(c, &m->tapes.variables, order, c->outputs);
    else memcpy(c->outputs, terms + (order - 1) * m->n_slots + m->slot_x, m->n_x * sizeof(double));
    *value = factorial * c->outputs[v->index];
    memset(terms + m->n_slots, 0, 2 * (size_t)m->n_slots * sizeof(double)); /* what special tapes know does not move */
    return RESULT_OK;
}
