/* Adjoint vectors over a piece of a run: RODAS5P, as in integrate.c, for the linear equations of the derivatives along
 * the dense output, transposed. Its one matrix belongs to the begin of the step; how Jacobians change with time there
 * follows from those at the nodes of its stages. */
#include "adjoint.h"

#define MOST_EDGES 100  /* in a step: more are noise */
#define MOST_ERROR 10   /* tolerances, as estimated, beside the largest effects on an output: results have less */
#define OF_INTEGRANDS 8 /* further halvings, for waves that are integrated in a run that is quiet itself */
#define SHORT 1e-11     /* of a piece that has landed on an edge: it ends behind that */
#define MOST_HALVINGS 8 /* of a step: what begins on a kink is wrong in its first part only, of 4e-3 */

/* Adds bars of states, parameters, inputs and d, which lie in `dots`, and of the time. */
void add_bars(Instance *c, double *vector) {
    const Model *m = c->model;
    const struct {
        const double *numbers;
        int slot, n;
    } parts[] = {
        {c->x, m->slot_x, m->n_x}, {c->p, m->slot_p, m->n_p}, {c->u, m->slot_u, m->n_u}, {c->d, m->slot_d, m->n_d}};
    for (int k = 0; k < 4; k++)
        for (int n = 0; n < parts[k].n; n++) vector[parts[k].numbers - c->numbers + n] += c->dots[parts[k].slot + n];
    vector[c->n_smooth] += c->dots[0] + dot(m->n_u, c->dots + m->slot_u, c->u_rate);
}

/* Derivatives of an output of a tape at the present point, where factor_implicit has been called. Returns its value. */
double slope_of_output(Instance *c, const Tape *tape, int output, double *bars, double *slope) {
    memset(slope, 0, (c->n_smooth + 1) * sizeof(double));
    memset(c->dots, 0, (size_t)c->model->slot_results * sizeof(double));
    int special = tape == &c->model->tapes.guards && guard_active(c, output);
    const Tape *ran = special ? evaluate_on_tape(c, tape, c->state.t, c->x, bars) : tape;
    if (!special) evaluate_now(c, tape, bars);
    double value = bars[output];
    memset(bars, 0, (size_t)tape->n_outputs * sizeof(double));
    bars[output_place(tape, ran, output)] = 1;
    adjoint_of_ran(c, tape, ran, bars);
    adjoint_of_implicit(c, 1);
    add_bars(c, slope);
    return value;
}

/* Adds the product of a transposed Jacobian, by nonzeros of the step matrix. */
static void add_product(const Instance *c, const double *matrix, const double *left, double *product) {
    const QrPattern *a = &c->model->step;
    for (int column = 0; column < a->size; column++)
        for (int k = a->colind[column]; k < a->colind[column + 1]; k++) product[column] += matrix[k] * left[a->row[k]];
}

/* Jacobians at the nodes of a step; the matrix of the step. */
static int prepare_step(Instance *c, double begin, double h) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    size_t n = (size_t)m->n_unknowns, nonzeros = (size_t)m->step.n_nonzeros;
    memset(g->matrices, 0, N_NODES * nonzeros * sizeof(double));
    for (int node = N_NODES - 1; node >= 0; node--) {
        double t = node_time(begin, h, node), *point = g->points + (size_t)node * n;
        piece_at(m, c->piece, t, point);
        solve_implicit(c, t, point, 1); /* polynomials of unknowns are as good as the states need them */
        evaluate_special(c, &m->tapes.jacobian, t, point, c->jacobian);
        for (int k = 0; k < m->n_jacobian; k++)
            g->matrices[(size_t)node * nonzeros + m->jacobian_to_step[k]] = c->jacobian[k];
    }
    return factor_by_pattern(c, step_diagonal(h));
}

/* A vector over a step: `x` holds bars of states behind it, and becomes those of states and implicit unknowns before;
 * `rates` become bars of rates at the nodes. `integrand`: slopes of what is integrated at the nodes, or NULL. */
static void step_back(Instance *c, double h, double *x, double *rates, int of_error, const double *integrand) {
    const Gradient *g = c->gradient;
    int n = c->model->n_unknowns, n_x = c->model->n_x;
    size_t size = (size_t)n * sizeof(double), nonzeros = (size_t)c->model->step.n_nonzeros;
    double *stages = g->stages, *points = stages + STAGES * n, *moving = points + n, *changing = moving + n;
    double of_integral[STAGES], weights[N_NODES], integral_moving = 0;
    if (integrand != NULL) integral_moving = integral_back(of_error, of_integral, weights);
    memset(stages, 0, (STAGES + 3) * size);
    memset(rates, 0, N_NODES * size);
    memcpy(stages + (STAGES - 1) * n, x, size); /* bars of stages, of the present stage's point, of the slope by time */
    if (!of_error) memcpy(points, x, size);
    memset(x, 0, size);
    for (int i = STAGES - 1; i >= 0; i--) {
        double *stage = stages + i * n, *at_node = rates + node_of(i) * n;
        for (int k = 0; k < n && integrand != NULL; k++) stage[k] += h * of_integral[i] * integrand[k];
        solve_step_transposed(c, stage);
        if (i < LAST_POINTS - 1) memset(points, 0, size);
        for (int k = 0; k < n && integrand != NULL; k++)
            points[k] += h * of_integral[i] * integrand[node_of(i) * n + k];
        add_product(c, g->matrices + (size_t)node_of(i) * nonzeros, stage, points);
        for (int k = 0; k < n; k++) {
            at_node[k] += stage[k];
            moving[k] += RODAS_D_TIME[i] * stage[k];
        }
        for (int j = 0; j < i; j++) {
            double by_point = i >= LAST_POINTS ? j == i - 1 : RODAS_A[i][j], by_rate = RODAS_C[i][j] / h;
            double *other = stages + j * n;
            for (int k = 0; k < n; k++) other[k] += by_point * points[k] + (k < n_x ? by_rate * stage[k] : 0);
        }
        for (int k = 0; k < n && i < LAST_POINTS; k++) x[k] += points[k];
    }
    for (int node = 0; node < N_NODES; node++) {
        for (int k = 0; k < n; k++) changing[k] = BY_NODES[node] * moving[k];
        add_product(c, g->matrices + (size_t)node * nonzeros, changing, x);
        for (int k = 0; k < n && integrand != NULL; k++)
            x[k] += h * BY_NODES[node] * integral_moving * integrand[node * n + k];
        for (int k = 0; k < n; k++) rates[node * n + k] += changing[k];
    }
}

/* Bars of rates at the nodes give those of parameters, inputs and d. */
static void rates_back(Instance *c, double begin, double h, const double *rates) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    size_t n = (size_t)m->n_unknowns, inputs = (size_t)m->slot_results;
    const double *at_node[MOST_LANES];
    int lanes[MOST_LANES], count, first = 0;
    while (first < g->n_vectors) {
        for (count = 0; count < MOST_LANES && first < g->n_vectors; first++)
            if (!g->still[first]) lanes[count++] = first;
        memset(g->lanes, 0, inputs * (size_t)count * sizeof(double));
        for (int node = 0; node < N_NODES && count > 0; node++) {
            const Tape *ran =
                evaluate_on_tape(c, &m->tapes.rates, node_time(begin, h, node), g->points + (size_t)node * n, c->rhs);
            for (int v = 0; v < count; v++) at_node[v] = rates + ((size_t)lanes[v] * N_NODES + (size_t)node) * n;
            tape_adjoint_of(count, ran, c->slots, g->lanes, at_node);
        }
        for (int v = 0; v < count; v++) {
            for (size_t k = 0; k < inputs; k++) c->dots[k] = g->lanes[k * (size_t)count + (size_t)v];
            memset(c->dots + m->slot_x, 0, (size_t)m->n_x * sizeof(double));
            add_bars(c, vector_of(c, lanes[v]));
        }
    }
}

/* The error of a step, which its last stage estimates, beside the largest effects of states, parameters and inputs on
 * outputs that have come so far, also over this step (`after`). */
static double error_back(Instance *c, double h, const double *after) {
    const Gradient *g = c->gradient;
    const Model *m = c->model;
    size_t n = (size_t)m->n_unknowns, all = c->n_smooth;
    double *x = g->work, *sizes = g->sizes, error = 0;
    ptrdiff_t first = c->x - c->numbers;
    for (size_t k = 0; k < all; k++) sizes[k] = fabs(c->numbers[k]);
    for (int k = 0; k < m->n_x; k++) sizes[first + k] = fabs(g->points[k]) + m->nominals[k];
    memset(x, 0, n * sizeof(double));
    for (int v = 0; v < g->n_of; v++) {
        const double *vector = vector_of(c, v);
        double *largest = &g->largest[v];
        for (size_t k = 0; k < all; k++) *largest = max_of(*largest, fabs(vector[k]) * sizes[k]);
        for (int k = 0; k < m->n_x; k++)
            *largest = max_of(*largest, fabs(after[(size_t)v * n + (size_t)k]) * sizes[first + k]);
        for (int k = 0; k < m->n_x && *largest > 0; k++) x[k] += vector[first + k] / *largest;
    }
    step_back(c, h, x, g->work + n, 1, NULL);
    for (int k = 0; k < m->n_x; k++) error = max_of(error, fabs(x[k]) * sizes[first + k]);
    return error;
}

/* Goes back from one time of the present piece to another, without edges in between. */
static void smoothly_back(Instance *c, double begin, double end, int halvings) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    double h = end - begin, *after = g->behind; /* not needed on pieces */
    size_t n = (size_t)m->n_unknowns;
    if (!(h > SHORT * (c->piece->end - c->piece->begin))) return;
    if (!prepare_step(c, begin, h)) lose_back(c);
    double error = slopes_of_integrands(c, begin, h);
    for (int v = 0; v < g->n_vectors; v++) {
        double *x = after + (size_t)v * n;
        const double *states = vector_of(c, v) + (c->x - c->numbers);
        int integral = integrand_of(g, v) >= 0;
        memset(x, 0, n * sizeof(double));
        g->still[v] = !integral && largest_of(m->n_x, states) == 0;
        if (g->still[v]) continue;
        memcpy(x, states, (size_t)m->n_x * sizeof(double));
        step_back(c, h, x, g->node_bars + (size_t)v * N_NODES * n, 0,
            integral ? g->integrand_slopes + (size_t)v * N_NODES * n : NULL);
    }
    double most = MOST_ERROR * c->state.tolerance;
    if ((error > most && halvings > -OF_INTEGRANDS) || (halvings > 0 && error_back(c, h, after) > most)) {
        smoothly_back(c, begin + 0.5 * h, end, halvings - 1);
        smoothly_back(c, begin, begin + 0.5 * h, halvings - 1);
        return;
    }
    for (int v = 0; v < g->n_vectors; v++)
        memcpy(vector_of(c, v) + (c->x - c->numbers), after + (size_t)v * n, n * sizeof(double));
    rates_back(c, begin, h, g->node_bars);
    integrals_back(c, h);
    c->state.t = begin;
    memcpy(c->x, g->points, n * sizeof(double));
    c->state.z_valid = c->variables_valid = 0;
    if (m->n_z == 0) return;
    if (!factor_implicit(c)) lose_back(c);
    for (int v = 0; v < g->n_vectors; v++) {
        double *states = vector_of(c, v) + (c->x - c->numbers);
        memset(c->dots, 0, (size_t)m->slot_results * sizeof(double));
        memcpy(c->dots + m->slot_x, states, n * sizeof(double));
        memset(states, 0, n * sizeof(double));
        adjoint_of_implicit(c, 1);
        add_bars(c, vector_of(c, v));
    }
}

/* Slopes jump between two neighbouring times without an event, or have no bound there: nothing tells by how much that
 * moves. An edge moves in time by its slope beside its rate, also where both are flat; where it does not, by all. */
static void check_jump(Instance *c, double before, double behind) {
    const Model *m = c->model;
    Gradient *g = c->gradient;
    int n = m->tapes.edges.n_outputs;
    const double *here = c->edges_middle;
    int jump = integrands_jump(c, before, behind); /* the other one leaves edges */
    jump |= jumps_between(c, before, behind);
    if (!jump && !is_steep(c, before, behind)) return;
    c->state.t = behind;
    piece_at(m, c->piece, behind, c->x);
    c->variables_valid = c->state.z_valid = 0;
    if (!factor_implicit(c)) return;
    for (int k = 0; k < m->settings->n_kinks; k++) {
        if ((here[k] > 0) == (here[n + k] > 0)) continue;
        slope_of_output(c, &m->tapes.edges, k, c->edges_middle + 2 * n, g->slope);
        evaluate_now(c, &m->tapes.rates, c->rhs);
        double rate = g->slope[c->n_smooth] + dot(m->n_x, g->slope + (c->x - c->numbers), c->rhs);
        for (size_t i = 0; i < c->n_smooth; i++) g->slope[i] = rate == 0 ? 1 : g->slope[i] / (rate * span_of(c));
        add_doubt(c, jump ? FAILURE_LOST_AT_JUMP : FAILURE_LOST_AT_ROOT, g->slope);
    }
}

/* Runs along a part of a piece again, with steps that end at corners, and goes back along these. Returns 0 if they are
 * too many. */
static int along_corners(Instance *c, const Record *along) {
    Record *last = NULL;
    int count = 0, any = 1;
    c->state.step = along->end - along->begin;
    c->edges_valid = c->state.inputs_changed = 0;
    while (any && c->state.t < along->end - least_step(&c->state)) {
        double begin = c->state.t;
        Record *record = count++ < MOST_EDGES ? c->allocate(1, sizeof *record + piece_size(c->model)) : NULL;
        any = record != NULL && land_on_edges(c, along->end);
        if (record == NULL) break;
        *record = (Record){.previous = last, .frame = along->frame, .begin = begin, .end = c->state.t};
        record->own = memcpy(record + 1, c->piece, piece_size(c->model));
        last = record;
    }
    for (const Record *record = any ? last : NULL; record != NULL; record = record->previous) piece_back(c, record);
    for (Record *record; (record = last) != NULL; c->release(record)) last = record->previous;
    return any;
}

/* Goes back along a part of a piece. A step that went over a corner is right in its end, not on the way there. */
void piece_back(Instance *c, const Record *along) {
    Gradient *g = c->gradient;
    double begins[MOST_EDGES + 1], ends[MOST_EDGES + 1], behind = along->begin;
    int parts = 0;
    if (g->loaded != along->frame) state_copy_in(c, along->frame), g->looked_at = NAN;
    g->loaded = along->frame;
    memcpy(c->piece, along->own, piece_size(c->model));
    do {
        begins[parts] = behind;
        int any = parts < MOST_EDGES && !along->edgeless;
        ends[parts] = any ? min_of(edge_ahead(c, begins[parts], &behind), along->end) : along->end;
        if (!any) behind = INFINITY;
    } while (parts++ < MOST_EDGES && behind <= along->end && behind < INFINITY);
    if (!g->lands) find_touches(c, parts, begins, ends);
    int corners = 0;
    for (int k = 1; k < parts && !g->lands; k++) corners |= is_corner(c, ends[k - 1], begins[k], g->matrices);
    if (corners) {
        stand_at(c, along->frame, along->own, along->begin);
        g->lands = 1;
        int done = along_corners(c, along);
        g->lands = 0;
        if (done) return;
        stand_at(c, along->frame, along->own, along->begin);
    }
    while (parts-- > 0) {
        for (double t; (t = max_of(seed_behind(c, begins[parts], 0), touch_behind(g))) > begins[parts];) {
            smoothly_back(c, t, ends[parts], MOST_HALVINGS);
            ends[parts] = min_of(t, ends[parts]);
            judge_touches(c, along, t);
            if (seed_behind(c, begins[parts], 0) == t) seed_behind(c, t, 1);
        }
        smoothly_back(c, begins[parts], ends[parts], MOST_HALVINGS);
        if (parts > 0) check_jump(c, ends[parts - 1], begins[parts]);
    }
    while (seed_behind(c, along->begin, 1) > -INFINITY) continue;
    c->state.t = along->begin;
    piece_at(c->model, c->piece, along->begin, c->x);
    c->variables_valid = c->state.z_valid = 0;
    check_kinks(c);
}
