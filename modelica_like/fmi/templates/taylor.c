/* Derivatives of variables by time along the solution, to any order below ORDERS: Taylor series instead of numbers run
 * through the tapes (A. Griewank, A. Walther: Evaluating Derivatives, ch. 13). They are exact up to rounding. */
#include <math.h>
#include <string.h>
#include "core.h"

#define ORDERS 4

typedef double Series[ORDERS]; /* coefficients of powers of the time */

/* What does not count is not multiplied: an inactive branch may be infinite. */
static double times(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }

static void multiply(const Series a, const Series b, Series c) {
    for (int k = 0; k < ORDERS; k++) {
        c[k] = 0;
        for (int j = 0; j <= k; j++) c[k] += times(a[j], b[k - j]);
    }
}

static void divide(const Series a, const Series b, Series c) {
    for (int k = 0; k < ORDERS; k++) {
        c[k] = a[k];
        for (int j = 0; j < k; j++) c[k] -= times(c[j], b[k - j]);
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

/* Coefficient k of the integral of slope * a'. */
static double integral(const Series a, const Series slope, int k) {
    double sum = 0;
    for (int j = 1; j <= k; j++) sum += times(j * a[j], slope[k - j]);
    return sum / k;
}

/* The slope by a of f = operation(a), from the coefficients of f that are known. */
static void slope_of(int operation, const Series a, const Series f, Series slope) {
    static const Series one = {1};
    int negative = 0;
    double first = 0;
    Series s;
    memcpy(slope, f, sizeof s);
    multiply(a, a, s);
    /* clang-format off */
    switch (operation) {
        case OPERATION_EXP: return;
        case OPERATION_EXPM1: slope[0] += 1; return;
        case OPERATION_TAN:
        case OPERATION_TANH:
            multiply(f, f, slope);
            for (int k = 0; k < ORDERS && operation == OPERATION_TANH; k++) slope[k] = -slope[k];
            slope[0] += 1;
            return;
        case OPERATION_ERF:
            slope[0] = 1.1283791670955126 * exp(-s[0]);
            for (int k = 1; k < ORDERS; k++) slope[k] = -integral(s, slope, k);
            return;
        /* The slope's own slope is f or -f. */
        case OPERATION_SIN: first = cos(a[0]); negative = 1; break;
        case OPERATION_COS: first = -sin(a[0]); negative = 1; break;
        case OPERATION_SINH: first = cosh(a[0]); break;
        case OPERATION_COSH: first = sinh(a[0]); break;
        case OPERATION_LOG: divide(one, a, slope); return;
        case OPERATION_LOG1P: memcpy(s, a, sizeof s); s[0] += 1; divide(one, s, slope); return;
        default: /* inverse circular and hyperbolic functions: 1 / (±a² ± 1), or of its root */
            negative = operation == OPERATION_ASIN || operation == OPERATION_ACOS || operation == OPERATION_ATANH;
            for (int k = 0; k < ORDERS && negative; k++) s[k] = -s[k];
            s[0] += operation == OPERATION_ACOSH ? -1 : 1;
            if (operation != OPERATION_ATAN && operation != OPERATION_ATANH) root(s, s);
            divide(one, s, slope);
            for (int k = 0; k < ORDERS && operation == OPERATION_ACOS; k++) slope[k] = -slope[k];
            return;
    }
    /* clang-format on */
    slope[0] = first;
    for (int k = 1; k < ORDERS; k++) slope[k] = negative ? -integral(a, f, k) : integral(a, f, k);
}

/* f = a^b. */
static void power(const Series a, const Series b, Series f) {
    Series slope, logarithm = {log(a[0])}, exponent;
    double c1 = times(b[0], pow(a[0], b[0] - 1)), c2 = times(b[0] * (b[0] - 1) / 2, pow(a[0], b[0] - 2)),
           c3 = times(b[0] * (b[0] - 1) * (b[0] - 2) / 6, pow(a[0], b[0] - 3));
    if (b[1] == 0 && b[2] == 0 && b[3] == 0) {
        f[1] = times(c1, a[1]);
        f[2] = times(c1, a[2]) + times(c2, a[1] * a[1]);
        f[3] = times(c1, a[3]) + times(c2, 2 * a[1] * a[2]) + times(c3, a[1] * a[1] * a[1]);
        return;
    }
    slope_of(OPERATION_LOG, a, logarithm, slope);
    for (int k = 1; k < ORDERS; k++) logarithm[k] = integral(a, slope, k);
    multiply(b, logarithm, exponent);
    for (int k = 1; k < ORDERS; k++) f[k] = integral(exponent, f, k);
}

/* Coefficients of f = operation(a, b) behind the first, which is given. */
static void extend(int operation, const Series a, const Series b, Series f) {
    double value = f[0], by_a = 0, by_b = 0, turns = b[0] == 0 ? 0 : (f[0] - a[0]) / b[0];
    static const Series one = {1};
    Series s, r, t;
    /* clang-format off */
    switch (operation) {
        case OPERATION_MUL: multiply(a, b, f); return;
        case OPERATION_SQ: multiply(a, a, f); return;
        case OPERATION_DIV: divide(a, b, f); f[0] = value; return;
        case OPERATION_INV: divide(one, a, f); return;
        case OPERATION_SQRT: root(a, f); return;
        case OPERATION_POW:
        case OPERATION_CONSTPOW: power(a, b, f); return;
        case OPERATION_HYPOT:
            multiply(a, a, s); multiply(b, b, r);
            for (int k = 0; k < ORDERS; k++) s[k] += r[k];
            root(s, f); return;
        case OPERATION_ATAN2: /* (a² + b²) f' = b a' - a b' */
            multiply(a, a, s); multiply(b, b, r);
            for (int k = 0; k < ORDERS; k++) s[k] += r[k];
            divide(a, s, r); divide(b, s, t);
            for (int k = 1; k < ORDERS; k++) f[k] = integral(a, t, k) - integral(b, r, k);
            return;
        case OPERATION_ADD: by_a = 1; by_b = 1; break;
        case OPERATION_SUB: by_a = 1; by_b = -1; break;
        case OPERATION_NEG: by_a = -1; break;
        case OPERATION_TWICE: by_a = 2; break;
        case OPERATION_FMOD:
        case OPERATION_REMAINDER: by_a = 1; by_b = turns; break;
        case OPERATION_FABS: by_a = a[0] < 0 ? -1 : a[0] > 0; break;
        case OPERATION_COPYSIGN: by_a = copysign(1, a[0]) == copysign(1, b[0]) ? 1 : -1; break;
        case OPERATION_IF_ELSE_ZERO: by_b = a[0] != 0; break;
        case OPERATION_FMIN: by_a = a[0] <= b[0]; by_b = 1 - by_a; break;
        case OPERATION_FMAX: by_a = a[0] >= b[0]; by_b = 1 - by_a; break;
        case OPERATION_LT: case OPERATION_LE: case OPERATION_EQ: case OPERATION_NE: case OPERATION_NOT:
        case OPERATION_AND: case OPERATION_OR: case OPERATION_FLOOR: case OPERATION_CEIL: case OPERATION_SIGN:
            break; /* constant between jumps */
        default:
            for (int k = 1; k < ORDERS; k++) {
                slope_of(operation, a, f, s);
                f[k] = integral(a, s, k);
            }
            return;
    }
    /* clang-format on */
    for (int k = 1; k < ORDERS; k++) f[k] = times(by_a, a[k]) + times(by_b, b[k]);
}

/* Evaluates a tape, then its coefficients behind the first: coefficient n of slot k is terms[(n - 1) * n_slots + k]. */
static void run_series(Instance *c, const Tape *tape, int order, double *outputs) {
    const Model *m = c->model;
    State *s = &c->state;
    double *slots = c->work.slots, *terms = c->work.dots;
    int k = 0;
    evaluate(c, tape, s->t, c->x, c->z, outputs);
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

/* Derivative of a variable along the solution, with inputs on their straight lines and the implicit unknowns following.
 */
Result output_rate(Instance *c, uint32_t reference, int order, double *value) {
    const Model *m = c->model;
    const Variable *v = known_variable(c, reference, TYPE_FLOAT64);
    Work *w = &c->work;
    double *terms = w->dots, factorial = 1;
    int *pivots = w->order;
    if (v == NULL) return RESULT_ERROR;
    if (order < 1 || order >= ORDERS)
        return report(c, LOG_ERROR, RESULT_ERROR, "Outputs have derivatives of order 1 to %d only.", ORDERS - 1);
    if (v->kind != KIND_VARIABLE && v->kind != KIND_STATE)
        return report(
            c, LOG_ERROR, RESULT_ERROR, "%s has no time derivative: it is not a variable.", text_of(m, v->name));
    if (factor_implicit(c, pivots) != RESULT_OK) return RESULT_ERROR;
    for (int n = 1; n < ORDERS; n++) memset(terms + (n - 1) * m->n_slots, 0, m->slot_results * sizeof(double));
    terms[0] = 1;
    memcpy(terms + m->slot_u, c->u_rate, m->n_u * sizeof(double));
    for (int n = 1; n <= order; n++) {
        run_series(c, &m->tapes.rates, n - 1, w->rhs);
        for (int k = 0; k < m->n_x; k++) terms[(n - 1) * m->n_slots + m->slot_x + k] = w->rhs[k] / n;
        factorial *= n;
        if (m->n_z == 0) continue;
        run_series(c, &m->tapes.alg, n, w->vector); /* without the unknowns' own terms, in which it is linear */
        lu_solve(m->n_z, w->dense_matrix, pivots, w->vector);
        for (int k = 0; k < m->n_z; k++) terms[(n - 1) * m->n_slots + m->slot_z + k] = -w->vector[k];
    }
    c->variables_valid = 0;
    if (v->kind == KIND_VARIABLE) run_series(c, &m->tapes.variables, order, w->variables);
    *value = factorial *
             (v->kind == KIND_STATE ? terms[(order - 1) * m->n_slots + m->slot_x + v->index] : w->variables[v->index]);
    return RESULT_OK;
}
