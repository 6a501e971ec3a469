/* New values at an instant: of states, of variables that follow from them, of discrete values. */
#include "core.h"

#define REACHED 1e-9 /* of the largest value of its unit, and of what moves: what a new value may be missed by */

/* Move the states as little as possible, so that variables that follow from them take new values, or vanish. */
void move_states(Instance *c, const int *nodes, const double *values, int count) {
    double *slopes = c->square, *change = c->start_residual, *step = c->point;
    variables_now(c);
    for (int k = 0; k < count; k++) change[k] = (values ? values[k] : 0) - c->variables[nodes[k]];
    for (int k = 0; k < count; k++) slope_of_node(c, nodes[k], k > 0, slopes + (size_t)k * c->model->n_x);
    least_squares(count, c->model->n_x, slopes, change, step);
    for (int k = 0; k < c->model->n_x; k++) c->x[k] += step[k];
}

/* What is to keep its value need not where it follows from new values: of a planetary set two are enough. Returns how
 * many variables are left. */
static int drop_dependent(Instance *c, int count) {
    int n = c->model->n_x, n_rows = 0, left = 0;
    for (int k = 0; k < count; k++) {
        double *row = c->square + (size_t)n_rows * (size_t)n, size;
        slope_of_node(c, c->targets[k], k > 0, row);
        size = dot(n, row, row);
        for (const double *other = c->square; other < row; other += n) {
            double part = dot(n, row, other) / dot(n, other, other);
            for (int j = 0; j < n; j++) row[j] -= part * other[j];
        }
        int follows = !(dot(n, row, row) > REACHED * REACHED * size);
        n_rows += !follows;
        if (follows && c->keeps[k]) continue;
        c->targets[left] = c->targets[k];
        c->target_values[left++] = c->target_values[k];
    }
    return left;
}

/* Gives variables their new values. An error if something else determines one of them: others, or what is given. */
Result move_targets(Instance *c, int count) {
    const Model *m = c->model;
    double *missing = c->target_missing;
    if (count < 0) return fail(c, TWO_NEW_VALUES, c->state.t, -1 - count);
    if (count == 0) return RESULT_OK;
    count = drop_dependent(c, count);
    variables_now(c);
    for (int k = 0; k < count; k++) missing[k] = c->target_values[k] - c->variables[c->targets[k]];
    move_states(c, c->targets, c->target_values, count);
    for (int k = 0; k < count; k++) {
        double *slope = c->square,
               size = max_of(largest_like(m, c->variables, c->targets[k]), fabs(c->target_values[k]));
        slope_of_node(c, c->targets[k], 0, slope);
        size += sqrt(dot(m->n_x, slope, slope) * dot(m->n_x, c->point, c->point));
        if (fabs(missing[k] - dot(m->n_x, slope, c->point)) <= REACHED * size) continue;
        return fail(c, NEW_VALUE_CONTRADICTS, c->state.t, c->targets[k], c->target_values[k]);
    }
    return RESULT_OK;
}

/* Gives a state or a discrete value its new value, or notes a variable for move_targets; tells whether it changes. What
 * is to keep its value is noted where it gets no other one. A state that gets two values makes `count` negative. */
static int take_value(Instance *c, const Reset *one, double value, double *d, int *count) {
    int entry = one->place - c->model->n_x, node = entry - c->model->n_d, discrete = entry >= 0 && node < 0;
    if (!discrete && isinf(value) && d == c->d) return 0; /* an update that sets nothing now */
    if (!discrete) c->stopped = 0;
    if (node >= 0 && *count < 0) return 1;
    if (node >= 0) {
        int target = c->model->reset_nodes[node];
        for (int k = 0; k < *count && one->factor == 0; k++)
            if (c->targets[k] == target) return 0;
        c->targets[*count] = target;
        c->keeps[*count] = one->factor == 0;
        c->target_values[(*count)++] = one->factor == 0 ? value : value / one->factor;
        return 1;
    }
    double *place = discrete ? &d[entry] : &c->x[one->place], before = *place;
    *place = value / one->factor;
    if (!discrete && c->renewed[one->place] && fabs(*place - before) > REACHED * fabs(before)) *count = -1 - one->place;
    if (!discrete) c->renewed[one->place] = 1;
    return before != *place;
}

/* Whether what gets a new value at this event is one that keeps its value, which is noted last. */
static int comes(const Reset *one, int keeping) { return (one->factor == 0) == keeping; }

/* Carries out the resets of transitions, whose values have been evaluated; returns how many variables have been noted
 * for move_targets. */
int take_resets(Instance *c, const unsigned char *firing, double *d) {
    const Model *m = c->model;
    int count = 0;
    memset(c->renewed, 0, (size_t)m->n_x);
    for (int keeping = 0; keeping < 2; keeping++)
        for (const Reset *one = m->resets; one < m->resets + m->n_resets; one++)
            if (firing[one->transition] && comes(one, keeping))
                take_value(c, one, c->reset_values[one->value], d, &count);
    return count;
}

/* The same of discrete equations and of what a `when` sets; tells whether something changes. */
int take_updates(Instance *c, int *changes) {
    const Model *m = c->model;
    int count = 0;
    evaluate_now(c, &m->tapes.updates, c->reset_values);
    memset(c->renewed, 0, (size_t)m->n_x);
    for (int keeping = 0; keeping < 2; keeping++)
        for (const Reset *one = m->updates; one < m->updates + m->n_updates; one++)
            if (comes(one, keeping)) *changes |= take_value(c, one, c->reset_values[one->value], c->d, &count);
    return count;
}

/* Whether what is held may get a new speed. */
int may_jolt(const Model *m) {
    int any = 0;
    for (int k = 0; k < m->n_resets; k++) any |= m->resets[k].place < m->n_x || m->resets[k].place >= m->n_x + m->n_d;
    for (int k = 0; k < m->n_updates; k++)
        any |= m->updates[k].place < m->n_x || m->updates[k].place >= m->n_x + m->n_d;
    return any && m->n_holds > 0;
}
