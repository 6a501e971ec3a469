/* What tapes have as they are interpreted (tape.c) and as compiled code (straight.py). */
#ifndef CODE_H
#define CODE_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

/* Compiled on a new Linux, the FMU is to run on an old one: these functions have got new versions since glibc 2.17.
   Versions can only be told to a linker that is given libm. */
#if defined(OLD_GLIBC) && !defined(NEW_GLIBC) && defined(__GLIBC__) && (defined(__x86_64__) || defined(__aarch64__))
#ifdef __x86_64__
#define OLD(f) ".symver " #f "," #f "@GLIBC_2.2.5\n"
#else
#define OLD(f) ".symver " #f "," #f "@GLIBC_2.17\n"
#endif
__asm__(OLD(exp) OLD(log) OLD(pow) OLD(hypot) OLD(fmod));
#endif

/* What does not count is not multiplied: an inactive branch may be infinite. */
static inline double product(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }

/* As fmax and fmin, for which compilers call a library: what is no number does not count. */
static inline double max_of(double a, double b) { return a >= b || b != b ? a : b; }
static inline double min_of(double a, double b) { return a <= b || b != b ? a : b; }
/* Of a list of numbers, which stand behind their count; below and beyond, the first and the last one. */
static inline double element(const double *list, double index) {
    return list[1 + (int)min_of(max_of(index, 0), list[0] - 1)];
}

static inline double sign(double a) { return a < 0 ? -1 : a > 0 ? 1 : a; }

/* a ? b : 0 without a branch: which one is taken cannot be foreseen where a tape has not run for some time. */
static inline double if_else_zero(double a, double b) {
    uint64_t bits;
    memcpy(&bits, &b, sizeof bits);
    bits &= 0 - (uint64_t)(a != 0);
    memcpy(&b, &bits, sizeof b);
    return b;
}

typedef struct { /* a tape: what parameters and modes decide; the rest; this with slopes along given dots */
    int n_known, first_known; /* how many values; behind those of the tapes before */
    void (*known)(double *slots, double *known);
    void (*run)(double *slots, const double *known, const unsigned char *wanted, double *outputs);
    void (*slopes)(double *slots, const double *known, double *dots, double *outputs, double *slopes);
} Code;
enum { N_CODES = 8 }; /* of the first tapes of a model; of those that are not compiled, `run` is NULL */

typedef struct { /* a step of rodas.h: what it begins with, its factors; its stages, and rows of its piece */
    double t, h, u_time;
    const double *first, *rates, *slope, *u, *u_rate, *lu, *pivots, *last_lu;
    const int *last_order;
    double *stages, *last;
} Step;

typedef struct { /* tapes, and the LU of the step matrix (linear.c), with stages that go by it; or NULL */
    Code tapes[N_CODES];
    int (*factor)(const double *jacobian, double diagonal, double *lu, double *pivots, double *last);
    void (*solve)(const double *lu, const double *pivots, const double *last, const int *order, double *x);
    int (*stages)(double *slots, const double *known, const Step *step);
} Codes;

#define MOST_GROWTH                                                                                  \
    1e4 /* of LU without exchanges: rounding is 2e-12 of a row's and column's size, below tolerances \
         */

/* To a value that is larger, or no number. */
static inline void raise_to(double *most, double value) {
    if (!(value <= *most)) *most = value;
}

static inline int all_finite(int n, const double *values) {
    int finite = 1;
    for (int k = 0; k < n; k++) finite &= fabs(values[k]) <= DBL_MAX;
    return finite;
}

static inline void swap(double *a, double *b) {
    double kept = *a;
    *a = *b;
    *b = kept;
}

static inline void lu_solve(int n, const double *m, const int *order, double *x) {
    for (int j = 0; j < n; j++) swap(&x[j], &x[order[j]]);
    for (int j = 0; j < n; j++)
        for (int i = j + 1; i < n; i++) x[i] -= m[i + n * j] * x[j];
    for (int j = n - 1; j >= 0; j--) {
        x[j] /= m[j + n * j];
        for (int i = 0; i < j; i++) x[i] -= m[i + n * j] * x[j];
    }
}

#ifdef CODE_ONLY
/* One pattern fits all texts. */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-variable"
#ifndef CODES
#define CODES __attribute__((visibility("default"))) const Codes codes =
#endif
#define OPERATION(name, value, by_a, by_b)                                                              \
    static inline double value_##name(double a, double b) { return (void)b, value; }                    \
    static inline double slope_##name(double a, double b, double f, double dot_of_a, double dot_of_b) { \
        return (void)a, (void)b, (void)f, product(by_a, dot_of_a) + product(by_b, dot_of_b);            \
    }
#include "operations.h"
#undef OPERATION
#endif

#endif
