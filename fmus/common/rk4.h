/* The classical Runge-Kutta method with a fixed step, and the location of the first event within a step. */
#ifndef RK4_H
#define RK4_H

#include <math.h>
#include <string.h>

#include "model.h"

#define MOST 12

/* Rates of change of the n unknowns y at a time. */
typedef void (*Rates)(const Model *m, double t, const double y[], double rate[]);

/* Whether an event lies before or at this point. */
typedef int (*Over)(const Model *m, double t, const double y[]);

static void rk4_step(const Model *m, Rates rates, int n, double t, double h, const double from[], double to[]) {
    double k[4][MOST], y[MOST];
    rates(m, t, from, k[0]);
    for (int j = 0; j < n; j++) y[j] = from[j] + h / 2 * k[0][j];
    rates(m, t + h / 2, y, k[1]);
    for (int j = 0; j < n; j++) y[j] = from[j] + h / 2 * k[1][j];
    rates(m, t + h / 2, y, k[2]);
    for (int j = 0; j < n; j++) y[j] = from[j] + h * k[2][j];
    rates(m, t + h, y, k[3]);
    for (int j = 0; j < n; j++) to[j] = from[j] + h / 6 * (k[0][j] + 2 * k[1][j] + 2 * k[2][j] + k[3][j]);
}

/* Step at most h from t; stop at the first event, by bisection. Return the step; *event tells whether there was one. */
static double rk4_until(const Model *m, Rates rates, Over over, int n, double t, double h, double y[], int *event) {
    double next[MOST], low = 0, high = h;
    rk4_step(m, rates, n, t, h, y, next);
    *event = over(m, t + h, next);
    while (*event && high - low > 1e-15) {
        double middle = (low + high) / 2;
        if (middle <= low || middle >= high) break;
        rk4_step(m, rates, n, t, middle, y, next);
        if (over(m, t + middle, next)) high = middle;
        else low = middle;
    }
    if (*event) rk4_step(m, rates, n, t, high, y, next);
    memcpy(y, next, n * sizeof *y);
    return high;
}

/* What an event changes; called after every step, with whether it ended at an event. */
typedef void (*After)(Model *m, int event);

/* Bring n unknowns y from m->time to `end`, in steps no longer than `step`. */
static void rk4_advance(Model *m, Rates rates, Over over, After after, int n, double y[], double end, double step) {
    while (m->time < end) {
        int event;
        m->time += rk4_until(m, rates, over, n, m->time, fmin(step, end - m->time), y, &event);
        if (end - m->time < 1e-14) m->time = end; /* what rounding has left */
        after(m, event);
    }
}

#endif
