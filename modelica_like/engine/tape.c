/* Runs tapes: values, derivatives in one direction (tangent), derivatives of one combination of results (adjoint). */
#include "core.h"

#define MAX_NEWTON 50
#define BOUNDED_NEWTON 3 /* iterations where the work is bounded; the next step takes up what they leave */
/* Largest last change of unknowns in linear equations: rounding of the next one is 1e-13 of them, up to a condition of
 * 1e9. */
#define LAST_LINEAR 1e-6
#define SOLVED 1e-8 /* of the residual before an iteration: they are piecewise linear, and solved */

/* Partial derivatives of a value f = operation(a, b). A unary operation has its operand on both sides. */
void slopes(int operation, double a, double b, double f, double *by_left, double *by_right) {
#define OPERATION(name, value, by_a, by_b) \
    case OPERATION_##name:                 \
        *by_left = by_a;                   \
        *by_right = by_b;                  \
        break;
    switch (operation) {
#include "operations.h"
        default: *by_left = *by_right = 0;
    }
#undef OPERATION
}

void run_operations(const Tape *tape, double *slots) {
#define OPERATION(name, value, by_a, by_b)                                  \
    case OPERATION_##name:                                                  \
        for (int k = 0; k < count; k++) {                                   \
            double a = slots[operand[k].left], b = slots[operand[k].right]; \
            (void)b;                                                        \
            result[k] = value;                                              \
        }                                                                   \
        break;
    double *result = slots + tape->first_result;
    const Operands *operand = tape->operands;
    for (int r = 0; r < tape->n_runs; r++) {
        int count = tape->runs[r].count;
        switch (tape->runs[r].operation) {
#include "operations.h"
        }
        operand += count;
        result += count;
    }
#undef OPERATION
}

void tape_run(const Tape *tape, double *slots, double *outputs) {
    run_operations(tape, slots);
    for (int k = 0; k < tape->n_outputs; k++) outputs[k] = slots[tape->outputs[k]];
}

void tape_tangent(const Tape *tape, const double *slots, double *dots, double *output_dots) {
#define OPERATION(name, value, by_a, by_b)                                                         \
    case OPERATION_##name:                                                                         \
        for (; k < end; k++) {                                                                     \
            int left = tape->operands[k].left, right = tape->operands[k].right;                    \
            double a = slots[left], b = slots[right], f = slots[tape->first_result + k];           \
            (void)a, (void)b, (void)f;                                                             \
            dots[tape->first_result + k] = product(by_a, dots[left]) + product(by_b, dots[right]); \
        }                                                                                          \
        break;
    int k = 0;
    for (int r = 0; r < tape->n_runs; r++) {
        int end = k + tape->runs[r].count;
        switch (tape->runs[r].operation) {
#include "operations.h"
        }
    }
#undef OPERATION
    for (int n = 0; n < tape->n_outputs; n++) output_dots[n] = dots[tape->outputs[n]];
}

static inline void add_products(int count, double slope, const double *bars, double *sums) {
    for (int v = 0; v < count && slope != 0; v++) sums[v] += product(slope, bars[v]);
}

/* Adds to the bars of the arguments, of several vectors at once, which lie side by side: slopes are worked out once. */
void tape_adjoint_of(int count, const Tape *tape, const double *slots, double *bars, const double *const *output_bars) {
#define OPERATION(name, value, by_a, by_b)                                                    \
    case OPERATION_##name:                                                                    \
        while (k > first) {                                                                   \
            int left = tape->operands[--k].left, right = tape->operands[k].right, v = 0;      \
            const double *bar = results + (size_t)k * (size_t)count;                          \
            while (v < count && bar[v] == 0) v++;                                             \
            if (v == count) continue;                                                         \
            double a = slots[left], b = slots[right], f = slots[tape->first_result + k];      \
            (void)a, (void)b, (void)f;                                                        \
            add_products(count - v, by_a, bar + v, bars + (size_t)left * (size_t)count + v);  \
            add_products(count - v, by_b, bar + v, bars + (size_t)right * (size_t)count + v); \
        }                                                                                     \
        break;
    int k = tape->n_operations;
    double *results = bars + (size_t)tape->first_result * (size_t)count;
    memset(results, 0, (size_t)tape->n_operations * (size_t)count * sizeof(double));
    for (int n = 0; n < tape->n_outputs; n++)
        for (int v = 0; v < count; v++) bars[tape->outputs[n] * count + v] += output_bars[v][n];
    for (int r = tape->n_runs - 1; r >= 0; r--) {
        int first = k - tape->runs[r].count;
        switch (tape->runs[r].operation) {
#include "operations.h"
        }
    }
#undef OPERATION
}

void tape_adjoint(const Tape *tape, const double *slots, double *bars, const double *output_bars) {
    tape_adjoint_of(1, tape, slots, bars, &output_bars);
}

void evaluate_special(Instance *c, const Tape *tape, double t, const double *point, double *outputs) {
    load(c, t, point);
    run_special(c, tape, outputs);
}

const Tape *evaluate_on_tape(Instance *c, const Tape *tape, double t, const double *point, double *outputs) {
    load(c, t, point);
    return run_on_tape(c, tape, outputs);
}

/* A point of the solution: evaluate tapes there, solve the implicit equations, check that all blocks are regular. */
double input_at(const Instance *c, int k, double t) { return c->u[k] + c->u_rate[k] * (t - c->state.u_time); }

/* With parameters and modes as they were loaded last. */
void load_point(Instance *c, double t, const double *point) {
    const Model *m = c->model;
    c->slots[0] = t;
    memcpy(c->slots + m->slot_x, point, m->n_unknowns * sizeof(double));
    for (int k = 0; k < m->n_u; k++) c->slots[m->slot_u + k] = input_at(c, k, t);
}

/* Parameters and modes, which decide about tapes. */
void load_decided(Instance *c) {
    const Model *m = c->model;
    double *slots = c->slots;
    if (memcmp(slots + m->slot_p, c->p, (size_t)m->n_p * sizeof(double)) != 0) {
        c->altered++;
        for (int k = 0; k < m->n_p; k++) {
            if (slots[m->slot_p + k] != c->p[k] && !c->tuned[k]) c->decided_by++, forget_sets(c);
            slots[m->slot_p + k] = c->p[k];
        }
    }
    if (memcmp(slots + m->slot_d, c->d, (size_t)m->n_d * sizeof(double)) != 0) {
        memcpy(slots + m->slot_d, c->d, (size_t)m->n_d * sizeof(double));
        c->decided_by++;
        c->altered++;
    }
}

void load(Instance *c, double t, const double *point) {
    load_point(c, t, point);
    load_decided(c);
}

void evaluate(Instance *c, const Tape *tape, double t, const double *point, double *outputs) {
    load(c, t, point);
    tape_run(tape, c->slots, outputs);
}

void evaluate_now(Instance *c, const Tape *tape, double *outputs) { evaluate(c, tape, c->state.t, c->x, outputs); }

const double *variables_now(Instance *c) {
    evaluate_now(c, &c->model->tapes.variables, c->variables);
    return c->variables;
}

int any_of(const unsigned char *marks, int n) {
    int any = 0;
    for (int k = 0; k < n; k++) any |= marks[k];
    return any;
}

double largest_of(int n, const double *values) {
    double largest = 0;
    for (int k = 0; k < n; k++) largest = max_of(largest, fabs(values[k]));
    return largest;
}

/* Factorises the Jacobian of the implicit equations, which often is that of the point before. */
static int factor_again(Instance *c) {
    int n = c->model->n_z;
    size_t size = (size_t)n * (size_t)n * sizeof(double);
    if (c->implicit_kept && memcmp(c->implicit_matrix, c->dense_matrix, size) == 0) return 1;
    memcpy(c->implicit_matrix, c->dense_matrix, size);
    memcpy(c->implicit_lu, c->dense_matrix, size);
    return c->implicit_kept = lu_factor(n, c->implicit_lu, c->implicit_order);
}

/* Size of a step of the implicit unknowns, in those. */
static double relative_step(const Instance *c, const double *step, const double *z) {
    double size = 0;
    for (int k = 0; k < c->model->n_z; k++)
        size = isfinite(step[k]) ? max_of(size, fabs(step[k]) / (1 + fabs(z[k]))) : INFINITY;
    return size;
}

/* A part of a step after which the next one, with the same slopes, is shorter; 0 if there is none. */
static int shorten_step(Instance *c, double t, double *point, double size) {
    int n_z = c->model->n_z;
    double *z = point + c->model->n_x, *next = c->vector;
    for (double part = 1; part >= LEAST_PART; part /= 2) {
        for (int k = 0; k < n_z; k++) z[k] = c->damped_z[k] - part * c->damped_step[k];
        evaluate_special(c, &c->model->tapes.alg, t, point, next);
        lu_solve(n_z, c->implicit_lu, c->implicit_order, next);
        if (relative_step(c, next, c->damped_z) <= (1 - part / 4) * size) return 1;
    }
    return 0;
}

/* Newton's method with steps as long as they lead nearer (P. Deuflhard): whole ones go to and fro where a curve bends,
 * as that of an amplifier at its limits. From where a solution was looked for, `damped_z`. */
static int solve_damped(Instance *c, double t, double *point) {
    int n_z = c->model->n_z;
    double *z = point + c->model->n_x, *step = c->damped_step;
    memcpy(z, c->damped_z, (size_t)n_z * sizeof(double));
    for (int round = 0; round < MAX_DAMPED; round++) {
        evaluate_special(c, &c->model->tapes.alg, t, point, step);
        run_special(c, &c->model->tapes.alg_jacobian, c->dense_matrix);
        if (!factor_again(c)) return 0;
        lu_solve(n_z, c->implicit_lu, c->implicit_order, step);
        memcpy(c->damped_z, z, (size_t)n_z * sizeof(double));
        double size = relative_step(c, step, z);
        if (size <= SOLVED_DAMPED) return 1;
        if (!(size < INFINITY) || !shorten_step(c, t, point, size)) return 0;
    }
    return 0;
}

Result solve_implicit(Instance *c, double t, double *point, int quiet) {
    const Model *m = c->model;
    double *z = point + m->n_x, *step = c->vector, change = INFINITY, residual = 0;
    int linear = m->settings->implicit_linear, rounds = !c->bounded ? MAX_NEWTON : linear ? 1 : BOUNDED_NEWTON;
    double most = c->bounded ? 1e-4 : linear ? LAST_LINEAR : 1e-13;
    if (m->n_z == 0) return RESULT_OK;
    if (!quiet) memcpy(c->damped_z, z, (size_t)m->n_z * sizeof(double));
    for (int round = 0; round < rounds; round++) {
        evaluate_special(c, &m->tapes.alg, t, point, step);
        if (c->bounded && round > 0 && largest_of(m->n_z, step) <= SOLVED * residual) return RESULT_OK;
        if (c->bounded) residual = largest_of(m->n_z, step);
        for (int k = 0; k < m->n_z; k++)
            if (!isfinite(step[k])) return !quiet && fail(c, UNKNOWN_SINGULAR, t, k);
        if (round == 0 || !linear) {
            run_special(c, &m->tapes.alg_jacobian, c->dense_matrix);
            if (!factor_again(c)) return !quiet && fail(c, UNKNOWN_SINGULAR, t, 0);
        }
        lu_solve(m->n_z, c->implicit_lu, c->implicit_order, step);
        change = 0;
        for (int k = 0; k < m->n_z; k++) {
            z[k] -= step[k];
            change = max_of(change, fabs(step[k]) / (1 + fabs(z[k])));
        }
        /* What the largest unknown leaves of a small one when it is rounded does not get smaller. */
        if (change < most || largest_of(m->n_z, step) <= 1e-14 * largest_of(m->n_z, z)) return RESULT_OK;
    }
    if (change <= 1e-9 || c->bounded || (!quiet && solve_damped(c, t, point))) return RESULT_OK;
    return !quiet && fail(c, NOT_SOLVED, 0, t);
}

Result solve_now(Instance *c, int quiet) { return solve_implicit(c, c->state.t, c->x, quiet); }

Result check_singular(Instance *c) {
    const Model *m = c->model;
    double t = c->state.t, *values = c->rhs;
    evaluate_now(c, &m->tapes.determinants, values);
    for (int k = 0; k < m->n_determinants; k++)
        if (!isfinite(values[k]) || fabs(values[k]) < 1e-12) return fail(c, BLOCK_SINGULAR, t, k);
    if (c->bounded) return RESULT_OK; /* the next step tells */
    values_now(c, &m->tapes.rates, values);
    for (int k = 0; k < m->n_x; k++)
        if (!isfinite(values[k])) return fail(c, RATE_NOT_FINITE, k, t);
    return RESULT_OK;
}

/* Bring the implicit unknowns up to date with time, states, parameters and inputs. */
Result settle(Instance *c) { return c->state.z_valid || (c->state.z_valid = solve_now(c, 0)); }
