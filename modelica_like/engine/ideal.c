/* Ideal elements: equations that replace dependent ones, impulses, conditions on states. */
#include "core.h"

#define HEAD IDEAL_HEAD
#define DEPENDENT_ROW 1e-9
#define SLOW 1e3
#define IMPULSE 1e12
#define MET 1e-9
#define LOST 1e-6

/* Whether it is replaced, an impulse, whether by the norm or a derivative, the combination of equations. */
static double *row_of(Instance *c, int element) {
    return c->d + c->model->settings->ideal + (size_t)element * (HEAD + c->model->n_z);
}

static int element_of(const Model *m, int row) {
    int k = m->n_ideals - 1;
    while (k >= 0 && m->ideals[k].row != row) k--;
    return k;
}

/* The variable that is zero in the present mode. */
static int zero_of(const Instance *c, int element) {
    const Ideal *one = &c->model->ideals[element];
    return c->d[one->mode] == 0 ? one->zero : one->other;
}

/* By how much that variable is other than zero beyond a part of its size. */
static double excess(const Instance *c, int element, const double *values, double part) {
    int node = zero_of(c, element);
    return fabs(values[node]) - part * max_of(c->model->ideals[element].nominal, largest_like(c->model, values, node));
}

static int moved(Instance *c, int element) { return row_of(c, element)[0] != 0 && row_of(c, element)[HEAD - 1] == 0; }

/* Rows of the second pass: element by element, those that are replaced last. */
static int place_of(Instance *c, int row, int second) {
    int k = element_of(c->model, row);
    return row + (k < 0 ? 0 : second && *row_of(c, k) != 0 ? 2 : 1) * c->model->n_z;
}

/* Gaussian elimination, row by row; `turns` becomes the combinations of rows, and `dependent` marks what vanishes. */
static void eliminate_rows(Instance *c, int second, double *turns, double *sizes, unsigned char *dependent) {
    const Model *m = c->model;
    int n = m->n_z;
    double *a = c->dense_matrix;
    evaluate_special(c, &m->tapes.alg, c->state.t, c->x, c->vector);
    run_special(c, &m->tapes.alg_jacobian, a);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            if (fabs(a[i + n * j]) > sizes[i]) sizes[i] = fabs(a[i + n * j]);
            turns[i + n * j] = i == j;
        }
    for (int j = 0; j < n; j++) {
        double largest = 0;
        for (int i = 0; i < n; i++) largest = max_of(largest, fabs(a[i + n * j] /= sizes[i] > 0 ? sizes[i] : 1));
        for (int i = 0; i < n && largest > 0; i++) a[i + n * j] /= largest;
    }
    for (int place = 0; place < 3 * n; place++) {
        int row = place % n, pivot = 0;
        if (place_of(c, row, second) != place) continue;
        for (int j = 1; j < n; j++)
            if (fabs(a[row + n * j]) > fabs(a[row + n * pivot])) pivot = j;
        dependent[row] = !(fabs(a[row + n * pivot]) > DEPENDENT_ROW);
        for (int i = 0; i < n && !dependent[row]; i++) {
            double factor = a[i + n * pivot] / a[row + n * pivot];
            if (place_of(c, i, second) <= place || factor == 0) continue;
            for (int j = 0; j < n; j++) {
                a[i + n * j] -= factor * a[row + n * j];
                turns[i + n * j] -= factor * turns[row + n * j];
            }
        }
    }
    for (int i = 0; i < n * n; i++) {
        double size = sizes[i / n] > 0 ? sizes[i / n] : 1, own = sizes[i % n] > 0 ? sizes[i % n] : 1;
        turns[i] = fabs(turns[i]) > DEPENDENT_ROW ? turns[i] / size * own : 0;
    }
}

/* The combination of replaced rows that says nothing: what it leaves open gets the least norm. */
static void leave_open(Instance *c, int element, const double *turns) {
    const Model *m = c->model;
    double *total = memset(c->vector, 0, (size_t)m->n_z * sizeof(double));
    for (int k = 0; k < m->n_ideals; k++)
        for (int j = 0; j < m->n_z; j++)
            total[j] += turns[m->ideals[element].row + m->n_z * m->ideals[k].row] * row_of(c, k)[HEAD + j];
    row_of(c, element)[HEAD - 1] = 1;
    memcpy(row_of(c, element) + HEAD, total, (size_t)m->n_z * sizeof(double));
}

/* What the states miss of the conditions that the modes put on them becomes impulses. */
static void push(Instance *c) {
    const Model *m = c->model;
    size_t size = (size_t)m->n_ideals * (HEAD + m->n_z) * sizeof(double);
    double *rows = row_of(c, 0), *kept = c->best, *z = c->kept_z, *left = c->residual;
    memcpy(z, c->z, (size_t)m->n_z * sizeof(double));
    solve_now(c, 1);
    const double *values = variables_now(c);
    memcpy(kept, rows, size);
    memset(rows, 0, size);
    evaluate_now(c, &m->tapes.alg, left);
    memcpy(rows, kept, size);
    for (int k = 0; k < m->n_ideals; k++)
        if (moved(c, k) && excess(c, k, values, MET) > 0)
            row_of(c, k)[1] = IMPULSE * dot(m->n_z, row_of(c, k) + HEAD, left);
    memcpy(c->z, z, (size_t)m->n_z * sizeof(double));
}

void replace_dependent(Instance *c) {
    const Model *m = c->model;
    int n = m->n_z, any = 0;
    double *turns = c->square, *sizes = turns + (size_t)n * n, *least = sizes + n;
    unsigned char *dependent = c->open_rows;
    if (m->n_ideals == 0) return;
    memset(row_of(c, 0), 0, (size_t)m->n_ideals * (HEAD + n) * sizeof(double));
    memset(sizes, 0, (size_t)n * sizeof(double));
    eliminate_rows(c, 0, turns, sizes, dependent);
    memcpy(least, sizes, (size_t)n * sizeof(double));
    for (int i = 0; i < n; i++)
        if (dependent[i] && element_of(m, i) < 0) return; /* nothing to do with these elements */
    for (int i = 0; i < n; i++) {
        double *row = dependent[i] ? row_of(c, element_of(m, i)) : NULL;
        if (row != NULL) least[i] = any = row[0] = 1;
        for (int j = 0; j < n && row != NULL; j++) row[HEAD + j] = turns[i + n * j];
        for (int j = 0; j < n && row != NULL; j++)
            least[i] = max_of(j > 0 ? least[i] : 0, SLOW * fabs(row[HEAD + j]) * sizes[j]);
    }
    if (!any) return;
    eliminate_rows(c, 1, turns, least, dependent);
    for (int i = 0; i < n; i++)
        if (dependent[i] && element_of(m, i) >= 0 && *row_of(c, element_of(m, i)) != 0)
            leave_open(c, element_of(m, i), turns);
    push(c);
}

int pushed(Instance *c) {
    int any = 0;
    for (int k = 0; k < c->model->n_ideals; k++) any |= row_of(c, k)[1] != 0;
    return any;
}

/* Move the states so that they meet the conditions of the modes, and end impulses. What is missed by more than `keep`
 * keeps its impulse; if that is negative, it is an error. */
Result meet(Instance *c, double keep, int *any) {
    const Model *m = c->model;
    const double *values = variables_now(c);
    *any = 0;
    for (int k = 0; k < m->n_ideals; k++) {
        int met = row_of(c, k)[1] == 0 || excess(c, k, values, keep < 0 ? LOST : keep) <= 0;
        if (!moved(c, k)) continue;
        if (!met && keep < 0) return fail(c, NO_VALID_MODES, c->state.t, k, fabs(values[zero_of(c, k)]));
        if (!met) continue;
        c->places[(*any)++] = zero_of(c, k);
        row_of(c, k)[1] = 0;
    }
    if (*any == 0) return RESULT_OK;
    move_states(c, c->places, NULL, *any);
    c->variables_valid = 0;
    return solve_now(c, 0);
}

/* Refuses modes in which an element and the rest of the circuit ask for different voltages or currents. */
Result refuse_contradiction(Instance *c) {
    for (int k = 0; k < c->model->n_ideals; k++) {
        if (row_of(c, k)[HEAD - 1] == 0) continue;
        const double *values = variables_now(c);
        if (excess(c, k, values, LOST) > 0) return fail(c, CONTRADICTS, c->state.t, k, values[zero_of(c, k)]);
    }
    return RESULT_OK;
}

/* Inputs or parameters have changed, and the conditions with them. */
Result renew(Instance *c) {
    int any;
    if (c->model->n_ideals == 0) return RESULT_OK;
    replace_dependent(c);
    return meet(c, GIVEN_BACK, &any);
}
