/* Derivatives of variables by time along the solution, to any order below ORDERS: Taylor series instead of numbers run
 * through the tapes (A. Griewank, A. Walther: Evaluating Derivatives, ch. 13). They are exact up to rounding. */
#include "core.h"

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
