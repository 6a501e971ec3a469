/* A point of the solution: evaluate tapes there, solve the implicit equations, check that all blocks are regular. */
#include <math.h>
#include <string.h>
#include "core.h"

#define MAX_NEWTON 50

double input_at(const State *s, int k, double t) { return s->u[k] + s->u_rate[k] * (t - s->u_time); }

static void load(Instance *c, double t, const double *x, const double *z) {
    double *slots = c->work.slots;
    const State *s = &c->state;
    slots[SLOT_T] = t;
    memcpy(slots + SLOT_X, x, N_X * sizeof(double));
    memcpy(slots + SLOT_Z, z, N_Z * sizeof(double));
    memcpy(slots + SLOT_P, s->p, N_P * sizeof(double));
    for (int k = 0; k < N_U; k++) slots[SLOT_U + k] = input_at(s, k, t);
    memcpy(slots + SLOT_D, s->d, N_D * sizeof(double));
}

void evaluate(Instance *c, const Tape *tape, double t, const double *x, const double *z, double *outputs) {
    load(c, t, x, z);
    tape_run(tape, c->work.slots, outputs);
}

static Result singular(Instance *c, double t, const char *names) {
    return report(c, LOG_ERROR, RESULT_ERROR,
        "The Jacobian is singular at t = %.9g s in the equations for %s. Where two frictions stick on the "
        "same motion, make one compliant, or let one start open.",
        t, names);
}

Result solve_implicit(Instance *c, double t, const double *x, double *z, int quiet) {
    double *step = c->work.vector, *matrix = c->work.dense_matrix, change = INFINITY;
    int order[AT_LEAST_ONE(N_Z)];
    if (N_Z == 0) return RESULT_OK;
    for (int round = 0; round < MAX_NEWTON; round++) {
        evaluate(c, &tape_alg, t, x, z, step);
        tape_run(&tape_alg_jacobian, c->work.slots, matrix);
        for (int k = 0; k < N_Z; k++)
            if (!isfinite(step[k])) return quiet ? RESULT_ERROR : singular(c, t, model_implicit_names[k]);
        if (!lu_factor(N_Z, matrix, order)) return quiet ? RESULT_ERROR : singular(c, t, model_implicit_names[0]);
        lu_solve(N_Z, matrix, order, step);
        double moved = 0, largest = 0;
        change = 0;
        for (int k = 0; k < N_Z; k++) {
            z[k] -= step[k];
            change = fmax(change, fabs(step[k]) / (1 + fabs(z[k])));
            moved = fmax(moved, fabs(step[k]));
            largest = fmax(largest, fabs(z[k]));
        }
        /* What the largest unknown leaves of a small one when it is rounded does not get smaller. */
        if (change < 1e-13 || moved <= 1e-14 * largest) return RESULT_OK;
    }
    if (change <= 1e-9) return RESULT_OK;
    return quiet ? RESULT_ERROR
                 : report(c, LOG_ERROR, RESULT_ERROR, "The equations for %s were not solved at t = %.9g s.",
                       model_implicit_names[0], t);
}

Result check_singular(Instance *c) {
    State *s = &c->state;
    double *values = c->work.rhs;
    evaluate(c, &tape_determinants, s->t, s->x, s->z, values);
    for (int k = 0; k < N_DETERMINANTS; k++)
        if (!isfinite(values[k]) || fabs(values[k]) < 1e-12) return singular(c, s->t, model_singular_names[k]);
    tape_run(&tape_rates, c->work.slots, values);
    for (int k = 0; k < N_X; k++)
        if (!isfinite(values[k]))
            return report(c, LOG_ERROR, RESULT_ERROR,
                "The derivative of %s is not finite at t = %.9g s. Look for a mass, inertia or ratio of zero.",
                model_state_names[k], s->t);
    return RESULT_OK;
}

/* Bring the implicit unknowns up to date with time, states, parameters and inputs. */
Result settle(Instance *c) {
    if (c->state.z_valid) return RESULT_OK;
    if (solve_implicit(c, c->state.t, c->state.x, c->state.z, 0) != RESULT_OK) return RESULT_ERROR;
    c->state.z_valid = 1;
    return RESULT_OK;
}
