/* Integrals over a run, each read by an adjoint vector: one more state in the steps of adjoint.c. */
#include "adjoint.h"

#define JUMP_FELT 1e-4 /* of an integrand: less is a slope */

/* Bars of the stages of an integral over a step of length 1, or of its error, transposed as in step_back; the weights
 * of its integrand at the nodes. Returns the bar of how the integrand changes with time. */
double integral_back(int of_error, double *stages, double *weights) {
    double bars[STAGES] = {0}, moving = 0;
    bars[STAGES - 1] = 1;
    memset(weights, 0, N_NODES * sizeof(double));
    for (int i = STAGES - 1; i >= 0; i--) {
        double point = i >= LAST_POINTS - 1 && !of_error;
        stages[i] = RODAS_GAMMA * bars[i];
        moving += RODAS_D_TIME[i] * stages[i];
        weights[node_of(i)] += stages[i];
        for (int j = 0; j < i; j++)
            bars[j] += point * (i >= LAST_POINTS ? j == i - 1 : RODAS_A[i][j]) + RODAS_C[i][j] * stages[i];
    }
    for (int node = 0; node < N_NODES; node++) weights[node] += BY_NODES[node] * moving;
    return moving;
}

/* Bars of an integrand at a point of the piece: they lie in `dots`. Returns its value. */
static double seed_integrand(Instance *c, double t, const double *point, int variable) {
    const Model *m = c->model;
    const Tape *ran = evaluate_on_tape(c, &m->tapes.variables, t, point, c->variables);
    c->variables_valid = 0;
    memset(c->dots, 0, (size_t)m->slot_results * sizeof(double));
    memset(c->outputs, 0, (size_t)ran->n_outputs * sizeof(double));
    c->outputs[output_place(&m->tapes.variables, ran, variable)] = 1;
    adjoint_of_ran(c, &m->tapes.variables, ran, c->outputs);
    return c->variables[variable];
}

/* Slopes of integrands at the nodes of a step. Returns the largest error of an integral over its size. */
double slopes_of_integrands(Instance *c, double begin, double h) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    size_t n = (size_t)m->n_unknowns, all = c->n_smooth + 1;
    double stages[STAGES], weights[N_NODES], largest = 0;
    integral_back(1, stages, weights);
    for (int row = 0; row < g->n_of; row++) {
        double error = 0;
        for (int node = 0; node < N_NODES && integrand_of(g, row) >= 0; node++) {
            size_t place = (size_t)row * N_NODES + (size_t)node;
            const double *point = g->points + (size_t)node * n;
            error += h * weights[node] * seed_integrand(c, node_time(begin, h, node), point, integrand_of(g, row));
            memcpy(g->integrand_slopes + place * n, c->dots + m->slot_x, n * sizeof(double));
            memset(c->dots + m->slot_x, 0, (size_t)m->n_x * sizeof(double));
            memset(g->integrand_bars + place * all, 0, all * sizeof(double));
            add_bars(c, g->integrand_bars + place * all);
        }
        if (error != 0) largest = max_of(largest, fabs(error) / g->along->integrands[row].size);
    }
    return largest;
}

/* Integrands give bars of parameters, inputs and d, too. */
void integrals_back(Instance *c, double h) {
    Gradient *g = c->gradient;
    size_t all = c->n_smooth + 1;
    double stages[STAGES], weights[N_NODES];
    integral_back(0, stages, weights);
    for (int row = 0; row < g->n_of; row++)
        for (int node = 0; node < N_NODES && integrand_of(g, row) >= 0; node++) {
            const double *bars = g->integrand_bars + ((size_t)row * N_NODES + (size_t)node) * all;
            for (size_t k = 0; k < all; k++) vector_of(c, row)[k] += h * weights[node] * bars[k];
        }
}

/* Does an integrand jump between two neighbouring times? */
int integrands_jump(Instance *c, double before, double behind) {
    Gradient *g = c->gradient;
    int any = 0;
    for (int row = 0; row < g->n_of; row++) {
        if (integrand_of(g, row) < 0) continue;
        double values[2];
        for (int side = 0; side < 2; side++) {
            piece_at(c->model, c->piece, side ? behind : before, g->points);
            values[side] = seed_integrand(c, side ? behind : before, g->points, integrand_of(g, row));
        }
        double size = fabs(values[0]) + fabs(values[1]) + g->along->integrands[row].size / span_of(c);
        any |= fabs(values[1] - values[0]) > JUMP_FELT * size;
    }
    return any;
}
