/* A point of the solution: evaluate tapes there, solve the implicit equations, check that all blocks are regular. */
#include "core.h"

#define MAX_NEWTON 50
#define BOUNDED_NEWTON 3 /* iterations where the work is bounded; the next step takes up what they leave */
#define SOLVED 1e-8      /* of the residual before an iteration: they are piecewise linear, and solved */

double input_at(const Instance *c, int k, double t) { return c->u[k] + c->u_rate[k] * (t - c->state.u_time); }

void load(Instance *c, double t, const double *point) {
    const Model *m = c->model;
    double *slots = c->slots;
    slots[0] = t;
    memcpy(slots + m->slot_x, point, m->n_unknowns * sizeof(double));
    for (int k = 0; k < m->n_u; k++) slots[m->slot_u + k] = input_at(c, k, t);
    if (memcmp(slots + m->slot_p, c->p, (size_t)m->n_p * sizeof(double)) != 0)
        for (int k = 0; k < m->n_p; k++) {
            if (slots[m->slot_p + k] != c->p[k] && !c->tuned[k]) c->decided_by++;
            slots[m->slot_p + k] = c->p[k];
        }
    if (memcmp(slots + m->slot_d, c->d, (size_t)m->n_d * sizeof(double)) != 0) {
        memcpy(slots + m->slot_d, c->d, (size_t)m->n_d * sizeof(double));
        c->decided_by++;
    }
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

static Result singular(Instance *c, double t, int quiet, const char *names) {
    return !quiet &&
           fail(c,
               "The Jacobian is singular at t = %.9g s in the equations for %s. Where two frictions stick on the "
               "same motion, make one compliant, or let one start open.",
               t, names);
}

double largest_of(int n, const double *values) {
    double largest = 0;
    for (int k = 0; k < n; k++) largest = fmax(largest, fabs(values[k]));
    return largest;
}

Result solve_implicit(Instance *c, double t, double *point, int quiet) {
    const Model *m = c->model;
    double *z = point + m->n_x, *step = c->vector, *matrix = c->dense_matrix, change = INFINITY, residual = 0;
    int *order = c->order, rounds = !c->bounded ? MAX_NEWTON : m->settings->implicit_linear ? 1 : BOUNDED_NEWTON;
    if (m->n_z == 0) return RESULT_OK;
    for (int round = 0; round < rounds; round++) {
        evaluate_special(c, &m->tapes.alg, t, point, step);
        if (c->bounded && round > 0 && largest_of(m->n_z, step) <= SOLVED * residual) return RESULT_OK;
        residual = largest_of(m->n_z, step);
        run_special(c, &m->tapes.alg_jacobian, matrix);
        for (int k = 0; k < m->n_z; k++)
            if (!isfinite(step[k])) return singular(c, t, quiet, text_of(m, m->implicit_names[k]));
        if (!lu_factor(m->n_z, matrix, order)) return singular(c, t, quiet, text_of(m, m->implicit_names[0]));
        lu_solve(m->n_z, matrix, order, step);
        change = 0;
        for (int k = 0; k < m->n_z; k++) {
            z[k] -= step[k];
            change = fmax(change, fabs(step[k]) / (1 + fabs(z[k])));
        }
        /* What the largest unknown leaves of a small one when it is rounded does not get smaller. */
        if (change < (c->bounded ? 1e-4 : 1e-13) || largest_of(m->n_z, step) <= 1e-14 * largest_of(m->n_z, z))
            return RESULT_OK;
    }
    if (change <= 1e-9 || c->bounded) return RESULT_OK;
    return !quiet &&
           fail(c, "The equations for %s were not solved at t = %.9g s.", text_of(m, m->implicit_names[0]), t);
}

Result solve_now(Instance *c, int quiet) { return solve_implicit(c, c->state.t, c->x, quiet); }

Result check_singular(Instance *c) {
    const Model *m = c->model;
    double t = c->state.t, *values = c->rhs;
    evaluate_now(c, &m->tapes.determinants, values);
    for (int k = 0; k < m->n_determinants; k++)
        if (!isfinite(values[k]) || fabs(values[k]) < 1e-12) return singular(c, t, 0, text_of(m, m->singular_names[k]));
    if (c->bounded) return RESULT_OK; /* the next step tells */
    tape_run(&m->tapes.rates, c->slots, values);
    for (int k = 0; k < m->n_x; k++)
        if (!isfinite(values[k]))
            return fail(c,
                "The derivative of %s is not finite at t = %.9g s. Look for a mass, inertia or ratio of zero.",
                text_of(m, m->state_names[k]), t);
    return RESULT_OK;
}

/* Bring the implicit unknowns up to date with time, states, parameters and inputs. */
Result settle(Instance *c) { return c->state.z_valid || (c->state.z_valid = solve_now(c, 0)); }
