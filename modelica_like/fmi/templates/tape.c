/* Runs tapes: values, derivatives in one direction (tangent), derivatives of one combination of results (adjoint). */
#include <math.h>
#include <string.h>
#include "core.h"

static double sign(double a) { return a < 0 ? -1 : a > 0 ? 1 : a; }

/* a ? b : 0 without a branch: which one is taken cannot be foreseen where a tape has not run for some time. */
static inline double if_else_zero(double a, double b) {
    uint64_t bits;
    memcpy(&bits, &b, sizeof bits);
    bits &= 0 - (uint64_t)(a != 0);
    memcpy(&b, &bits, sizeof b);
    return b;
}

/* Results of one run of equal operations. */
static void run_one(int operation, const Operands *operand, int count, const double *slots, double *result) {
#define EACH(name, expression)                                              \
    case OPERATION_##name:                                                  \
        for (int k = 0; k < count; k++) {                                   \
            double a = slots[operand[k].left], b = slots[operand[k].right]; \
            (void)b;                                                        \
            result[k] = expression;                                         \
        }                                                                   \
        break;
    switch (operation) {
        EACH(ADD, a + b)
        EACH(SUB, a - b)
        EACH(MUL, a * b)
        EACH(DIV, a / b)
        EACH(NEG, -a)
        EACH(EXP, exp(a))
        EACH(LOG, log(a))
        EACH(POW, pow(a, b))
        EACH(CONSTPOW, pow(a, b))
        EACH(SQRT, sqrt(a))
        EACH(SQ, a * a)
        EACH(TWICE, 2 * a)
        EACH(SIN, sin(a))
        EACH(COS, cos(a))
        EACH(TAN, tan(a))
        EACH(ASIN, asin(a))
        EACH(ACOS, acos(a))
        EACH(ATAN, atan(a))
        EACH(LT, a < b)
        EACH(LE, a <= b)
        EACH(EQ, a == b)
        EACH(NE, a != b)
        EACH(NOT, !a)
        EACH(AND, a && b)
        EACH(OR, a || b)
        EACH(FLOOR, floor(a))
        EACH(CEIL, ceil(a))
        EACH(FMOD, fmod(a, b))
        EACH(REMAINDER, remainder(a, b))
        EACH(FABS, fabs(a))
        EACH(SIGN, sign(a))
        EACH(COPYSIGN, copysign(a, b))
        EACH(IF_ELSE_ZERO, if_else_zero(a, b))
        EACH(ERF, erf(a))
        EACH(FMIN, fmin(a, b))
        EACH(FMAX, fmax(a, b))
        EACH(INV, 1 / a)
        EACH(SINH, sinh(a))
        EACH(COSH, cosh(a))
        EACH(TANH, tanh(a))
        EACH(ASINH, asinh(a))
        EACH(ACOSH, acosh(a))
        EACH(ATANH, atanh(a))
        EACH(ATAN2, atan2(a, b))
        EACH(HYPOT, hypot(a, b))
        EACH(LOG1P, log1p(a))
        EACH(EXPM1, expm1(a))
        default: break;
    }
#undef EACH
}

/* Partial derivatives of a value f = operation(a, b). */
static void slopes(int operation, double a, double b, double f, double *by_a, double *by_b) {
    double da = 0, db = 0;
    /* clang-format off */
    switch (operation) {
        case OPERATION_ADD: da = 1; db = 1; break;
        case OPERATION_SUB: da = 1; db = -1; break;
        case OPERATION_MUL: da = b; db = a; break;
        case OPERATION_DIV: da = 1 / b; db = -f / b; break;
        case OPERATION_NEG: da = -1; break;
        case OPERATION_EXP: da = f; break;
        case OPERATION_LOG: da = 1 / a; break;
        case OPERATION_POW: da = b * pow(a, b - 1); db = a == 0 ? 0 : log(a) * f; break;
        case OPERATION_CONSTPOW: da = b * pow(a, b - 1); break;
        case OPERATION_SQRT: da = 0.5 / f; break;
        case OPERATION_SQ: da = 2 * a; break;
        case OPERATION_TWICE: da = 2; break;
        case OPERATION_SIN: da = cos(a); break;
        case OPERATION_COS: da = -sin(a); break;
        case OPERATION_TAN: da = 1 + f * f; break;
        case OPERATION_ASIN: da = 1 / sqrt(1 - a * a); break;
        case OPERATION_ACOS: da = -1 / sqrt(1 - a * a); break;
        case OPERATION_ATAN: da = 1 / (1 + a * a); break;
        case OPERATION_FMOD: da = 1; db = (f - a) / b; break;
        case OPERATION_REMAINDER: da = 1; db = (f - a) / b; break;
        case OPERATION_FABS: da = sign(a); break;
        case OPERATION_COPYSIGN: da = copysign(1, a) == copysign(1, b) ? 1 : -1; break;
        case OPERATION_IF_ELSE_ZERO: db = a ? 1 : 0; break;
        case OPERATION_ERF: da = 1.1283791670955126 * exp(-a * a); break;
        case OPERATION_FMIN: da = a <= b; db = 1 - da; break;
        case OPERATION_FMAX: da = a >= b; db = 1 - da; break;
        case OPERATION_INV: da = -f * f; break;
        case OPERATION_SINH: da = cosh(a); break;
        case OPERATION_COSH: da = sinh(a); break;
        case OPERATION_TANH: da = 1 - f * f; break;
        case OPERATION_ASINH: da = 1 / sqrt(1 + a * a); break;
        case OPERATION_ACOSH: da = 1 / sqrt(a - 1) / sqrt(a + 1); break;
        case OPERATION_ATANH: da = 1 / (1 - a * a); break;
        case OPERATION_ATAN2: da = b / (a * a + b * b); db = -a / (a * a + b * b); break;
        case OPERATION_HYPOT: da = a / f; db = b / f; break;
        case OPERATION_LOG1P: da = 1 / (1 + a); break;
        case OPERATION_EXPM1: da = f + 1; break;
        default: break;              /* comparisons and roundings are constant between jumps */
    }
    /* clang-format on */
    *by_a = da;
    *by_b = db;
}

/* A unary operation has its operand on both sides. */
static int is_binary(int operation) {
    switch (operation) {
        case OPERATION_ADD:
        case OPERATION_SUB:
        case OPERATION_MUL:
        case OPERATION_DIV:
        case OPERATION_POW:
        case OPERATION_FMOD:
        case OPERATION_REMAINDER:
        case OPERATION_COPYSIGN:
        case OPERATION_IF_ELSE_ZERO:
        case OPERATION_FMIN:
        case OPERATION_FMAX:
        case OPERATION_ATAN2:
        case OPERATION_HYPOT: return 1;
        default: return 0;
    }
}

void tape_run(const Tape *tape, double *slots, double *outputs) {
    double *result = slots + tape->first_result;
    const Operands *operand = tape->operands;
    for (int r = 0; r < tape->n_runs; r++) {
        int count = tape->runs[r].count;
        run_one(tape->runs[r].operation, operand, count, slots, result);
        operand += count;
        result += count;
    }
    for (int k = 0; k < tape->n_outputs; k++) outputs[k] = slots[tape->outputs[k]];
}

/* What does not count is not multiplied: an inactive branch may be infinite. */
static double product(double slope, double dot) { return slope == 0 || dot == 0 ? 0 : slope * dot; }

void tape_tangent(const Tape *tape, const double *slots, double *dots, double *output_dots) {
    int k = 0;
    for (int r = 0; r < tape->n_runs; r++) {
        int operation = tape->runs[r].operation, binary = is_binary(operation), end = k + tape->runs[r].count;
        for (; k < end; k++) {
            const Operands *one = &tape->operands[k];
            double by_a, by_b, dot;
            slopes(operation, slots[one->left], slots[one->right], slots[tape->first_result + k], &by_a, &by_b);
            dot = product(by_a, dots[one->left]);
            if (binary) dot += product(by_b, dots[one->right]);
            dots[tape->first_result + k] = dot;
        }
    }
    for (int n = 0; n < tape->n_outputs; n++) output_dots[n] = dots[tape->outputs[n]];
}

/* Adds to the bars of the arguments. */
void tape_adjoint(const Tape *tape, const double *slots, double *bars, const double *output_bars) {
    int k = tape->n_operations;
    memset(bars + tape->first_result, 0, (size_t)tape->n_operations * sizeof(double));
    for (int n = 0; n < tape->n_outputs; n++) bars[tape->outputs[n]] += output_bars[n];
    for (int r = tape->n_runs - 1; r >= 0; r--) {
        int operation = tape->runs[r].operation, binary = is_binary(operation), first = k - tape->runs[r].count;
        while (--k >= first) {
            const Operands *one = &tape->operands[k];
            double by_a, by_b, bar = bars[tape->first_result + k];
            if (bar == 0) continue;
            slopes(operation, slots[one->left], slots[one->right], slots[tape->first_result + k], &by_a, &by_b);
            bars[one->left] += product(by_a, bar);
            if (binary) bars[one->right] += product(by_b, bar);
        }
        k = first;
    }
}

/* Marks all slots on which marked outputs depend, whatever the values. */
void tape_reaches(const Tape *tape, double *marks, const double *output_marks) {
    memset(marks + tape->first_result, 0, (size_t)tape->n_operations * sizeof(double));
    for (int n = 0; n < tape->n_outputs; n++)
        if (output_marks[n] != 0) marks[tape->outputs[n]] = 1;
    for (int k = tape->n_operations - 1; k >= 0; k--) {
        if (marks[tape->first_result + k] == 0) continue;
        marks[tape->operands[k].left] = 1;
        marks[tape->operands[k].right] = 1;
    }
}
