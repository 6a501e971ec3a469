/* Runs tapes: values, derivatives in one direction (tangent), derivatives of one combination of results (adjoint). */
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

void tape_run(const Tape *tape, double *slots, double *outputs) {
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

/* Adds to the bars of the arguments. */
void tape_adjoint(const Tape *tape, const double *slots, double *bars, const double *output_bars) {
    int k = tape->n_operations;
    memset(bars + tape->first_result, 0, (size_t)tape->n_operations * sizeof(double));
    for (int n = 0; n < tape->n_outputs; n++) bars[tape->outputs[n]] += output_bars[n];
    for (int r = tape->n_runs - 1; r >= 0; r--)
        for (int first = k - tape->runs[r].count; k > first;) {
            const Operands *one = &tape->operands[--k];
            double by_a, by_b, f = slots[tape->first_result + k], bar = bars[tape->first_result + k];
            if (bar == 0) continue;
            slopes(tape->runs[r].operation, slots[one->left], slots[one->right], f, &by_a, &by_b);
            bars[one->left] += product(by_a, bar);
            bars[one->right] += product(by_b, bar);
        }
}
