/* Linear algebra: sparse LU and QR with patterns known ahead, dense LU, dense least squares. */
#include "core.h"

#define SAYS_NOTHING 1e-24 /* square of the relative size of an equation that is none */

static inline void reflect(const QrPattern *a, const Instance *c, int column, double *x) {
    double dot = 0;
    if (c->qr_beta[column] == 0) return;
    for (int k = a->v_colind[column]; k < a->v_colind[column + 1]; k++) dot += c->qr_v[k] * x[a->v_row[k]];
    dot *= c->qr_beta[column];
    for (int k = a->v_colind[column]; k < a->v_colind[column + 1]; k++) x[a->v_row[k]] -= dot * c->qr_v[k];
}

/* Left-looking Householder QR (T. Davis, Direct Methods for Sparse Linear Systems, ch. 5). Returns 0 if singular. */
int qr_factor(const QrPattern *a, const double *values, Instance *c) {
    double *x = c->qr_work;
    memset(x, 0, (size_t)a->size * sizeof(double));
    for (int column = 0; column < a->size; column++) {
        int source = a->column_order[column], r = a->r_colind[column];
        int first = a->v_colind[column], end = a->v_colind[column + 1];
        double *v = c->qr_v + first, tail = 0, norm;
        for (int k = a->colind[source]; k < a->colind[source + 1]; k++) x[a->row_place[a->row[k]]] = values[k];
        for (; a->r_row[r] < column; r++) {
            reflect(a, c, a->r_row[r], x);
            c->qr_r[r] = x[a->r_row[r]];
            x[a->r_row[r]] = 0;
        }
        for (int k = first; k < end; k++) {
            c->qr_v[k] = x[a->v_row[k]];
            x[a->v_row[k]] = 0;
        }
        for (int k = 1; k < end - first; k++) tail += v[k] * v[k];
        norm = sqrt(v[0] * v[0] + tail);
        if (!isfinite(norm) || norm == 0) return 0;
        if (tail == 0) {
            c->qr_r[r] = v[0];
            c->qr_beta[column] = 0;
        } else {
            double head = v[0] > 0 ? v[0] + norm : v[0] - norm;
            c->qr_r[r] = v[0] > 0 ? -norm : norm;
            c->qr_beta[column] = 2 / (head * head + tail);
            v[0] = head;
        }
    }
    return 1;
}

void qr_solve(const QrPattern *a, const Instance *c, double *x) {
    double *y = c->qr_work;
    for (int k = 0; k < a->size; k++) y[a->row_place[k]] = x[k];
    for (int column = 0; column < a->size; column++) reflect(a, c, column, y);
    for (int column = a->size - 1; column >= 0; column--) {
        int last = a->r_colind[column + 1] - 1;
        y[column] /= c->qr_r[last];
        for (int k = a->r_colind[column]; k < last; k++) y[a->r_row[k]] -= c->qr_r[k] * y[column];
    }
    for (int k = 0; k < a->size; k++) x[a->column_order[k]] = y[k];
}

void qr_solve_transposed(const QrPattern *a, const Instance *c, double *x) {
    double *y = c->qr_work;
    for (int column = 0; column < a->size; column++) {
        int last = a->r_colind[column + 1] - 1;
        double rest = x[a->column_order[column]];
        for (int k = a->r_colind[column]; k < last; k++) rest -= c->qr_r[k] * y[a->r_row[k]];
        y[column] = rest / c->qr_r[last];
    }
    for (int column = a->size - 1; column >= 0; column--) reflect(a, c, column, y);
    for (int k = 0; k < a->size; k++) x[k] = y[a->row_place[k]];
}

typedef double Pair __attribute__((vector_size(2 * sizeof(double)), aligned(sizeof(double)), may_alias));

/* to = from + the sum of weights * rows, in this order, for n columns of rows of length `row`: four at a
 * time, as sums wait for each other. */
void combine(int n, const double *from, int count, const double *weights, const double *rows, int row, double *to) {
    int k = 0;
    for (; k + 4 <= n; k += 4) {
        const Pair *given = (const Pair *)(const void *)(from + k);
        Pair low = given[0], high = given[1], *result = (Pair *)(void *)(to + k);
        for (int j = 0; j < count; j++) {
            const Pair *more = (const Pair *)(const void *)(rows + (size_t)j * (size_t)row + k);
            low += weights[j] * more[0];
            high += weights[j] * more[1];
        }
        result[0] = low;
        result[1] = high;
    }
    for (; k < n; k++) {
        double sum = from[k];
        for (int j = 0; j < count; j++) sum += weights[j] * rows[(size_t)j * (size_t)row + k];
        to[k] = sum;
    }
}

/* LU with partial pivoting of a matrix stored by columns. Returns 0 if it is singular to working precision. */
int lu_factor(int n, double *m, int *order) {
    double largest = 0, smallest = DBL_MAX;
    for (int j = 0; j < n; j++) {
        int pivot = j;
        for (int i = j + 1; i < n; i++)
            if (fabs(m[i + n * j]) > fabs(m[pivot + n * j])) pivot = i;
        double size = fabs(m[pivot + n * j]);
        if (!isfinite(size) || size == 0) return 0;
        if (size > largest) largest = size;
        if (size < smallest) smallest = size;
        order[j] = pivot;
        for (int k = 0; k < n && pivot != j; k++) swap(&m[j + n * k], &m[pivot + n * k]);
        for (int i = j + 1; i < n; i++) m[i + n * j] /= m[j + n * j];
        for (int k = j + 1; k < n; k++)
            for (int i = j + 1; i < n; i++) m[i + n * k] -= m[i + n * j] * m[j + n * k];
    }
    return n == 0 || smallest > largest * n * DBL_EPSILON;
}

void lu_solve_transposed(int n, const double *m, const int *order, double *x) {
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < j; i++) x[j] -= m[i + n * j] * x[i];
        x[j] /= m[j + n * j];
    }
    for (int j = n - 1; j >= 0; j--)
        for (int i = j + 1; i < n; i++) x[j] -= m[i + n * j] * x[i];
    for (int j = n - 1; j >= 0; j--) swap(&x[j], &x[order[j]]);
}

/* LU of the step matrix: equations have been matched with unknowns, and ordered, when the model was written; the last
 * ones are eliminated with exchanges. Where a pivot vanishes, or so much is subtracted that rounding counts, QR. What
 * is subtracted is measured beside the matrix with its rows, and then its columns, made one. Returns 0 if it is
 * singular. */
int factor_matrix(Instance *c) {
    const QrPattern *a = &c->model->step;
    const LuPattern *lu = &c->model->lu;
    int first = lu->n_ends - 1 - a->size, last = a->size - first;
    const int *l_end = lu->ends, *u_end = l_end + first;
    double *x = c->qr_work, *weights = x + a->size, size, subtracted, largest, inverse;
    c->by_lu = 0;
    memset(x, 0, 2 * (size_t)a->size * sizeof(double));
    for (int k = 0; k < a->n_nonzeros; k++) raise_to(&weights[lu->row_place[a->row[k]]], fabs(c->matrix[k]));
    for (int k = 0; k < a->size; k++) weights[k] = 1 / weights[k];
    for (int column = 0; column < a->size; column++) {
        int source = lu->column_order[column];
        size = subtracted = largest = 0;
        for (int k = a->colind[source]; k < a->colind[source + 1]; k++) {
            int row = lu->row_place[a->row[k]];
            x[row] = c->matrix[k];
            raise_to(&size, weights[row] * fabs(x[row]));
        }
        for (int k = u_end[column]; k < u_end[column + 1]; k++) {
            int row = lu->rows[k];
            double factor = c->lu[k] = x[row];
            x[row] = 0;
            raise_to(&subtracted, fabs(factor) * c->lu_sizes[row]);
            for (int r = l_end[row]; r < l_end[row + 1]; r++) x[lu->rows[r]] -= c->lu[r] * factor;
        }
        if (!(subtracted <= MOST_GROWTH * size)) return qr_factor(a, c->matrix, c);
        if (column >= first) {
            memcpy(c->lu_last + (size_t)(column - first) * (size_t)last, x + first, (size_t)last * sizeof(double));
            memset(x + first, 0, (size_t)last * sizeof(double));
            continue;
        }
        inverse = c->lu_pivots[column] = 1 / x[column];
        x[column] = 0;
        if (!isfinite(inverse) || inverse == 0) return qr_factor(a, c->matrix, c);
        for (int r = l_end[column]; r < l_end[column + 1]; r++) {
            int row = lu->rows[r];
            c->lu[r] = x[row] * inverse;
            x[row] = 0;
            raise_to(&largest, weights[row] * fabs(c->lu[r]));
        }
        c->lu_sizes[column] = largest;
    }
    c->by_lu = lu_factor(last, c->lu_last, c->last_order);
    return c->by_lu || qr_factor(a, c->matrix, c);
}

void solve_step(const Instance *c, double *x) {
    const LuPattern *lu = &c->model->lu;
    double *y = c->qr_work;
    int n = c->model->step.size, first = lu->n_ends - 1 - n;
    const int *l_end = lu->ends, *u_end = l_end + first;
    const Codes *codes = c->model->codes;
    if (!c->by_lu) {
        qr_solve(&c->model->step, c, x);
        return;
    }
    if (codes != NULL && codes->factor != NULL) {
        codes->solve(c->lu, c->lu_pivots, c->lu_last, c->last_order, x);
        return;
    }
    for (int k = 0; k < n; k++) y[lu->row_place[k]] = x[k];
    for (int k = 0; k < first; k++)
        for (int r = l_end[k]; r < l_end[k + 1]; r++) y[lu->rows[r]] -= c->lu[r] * y[k];
    lu_solve(n - first, c->lu_last, c->last_order, y + first);
    for (int k = n - 1; k >= 0; k--) {
        double solved = x[lu->column_order[k]] = k < first ? y[k] * c->lu_pivots[k] : y[k];
        for (int r = u_end[k]; r < u_end[k + 1]; r++) y[lu->rows[r]] -= c->lu[r] * solved;
    }
}

/* The same with the transposed matrix. */
void solve_step_transposed(const Instance *c, double *x) {
    const LuPattern *lu = &c->model->lu;
    double *y = c->qr_work;
    int n = c->model->step.size, first = lu->n_ends - 1 - n;
    const int *l_end = lu->ends, *u_end = l_end + first;
    if (!c->by_lu) {
        qr_solve_transposed(&c->model->step, c, x);
        return;
    }
    for (int k = 0; k < n; k++) {
        double rest = x[lu->column_order[k]];
        for (int r = u_end[k]; r < u_end[k + 1]; r++) rest -= c->lu[r] * y[lu->rows[r]];
        y[k] = k < first ? rest * c->lu_pivots[k] : rest;
    }
    lu_solve_transposed(n - first, c->lu_last, c->last_order, y + first);
    for (int k = first - 1; k >= 0; k--)
        for (int r = l_end[k]; r < l_end[k + 1]; r++) y[k] -= c->lu[r] * y[lu->rows[r]];
    for (int k = 0; k < n; k++) x[k] = y[lu->row_place[k]];
}

static void rotate(int n, double *p, double *q, double c, double s) {
    for (int k = 0; k < n; k++) {
        double turned = c * p[k] - s * q[k];
        q[k] = s * p[k] + c * q[k];
        p[k] = turned;
    }
}

double dot(int n, const double *p, const double *q) {
    double sum = 0;
    for (int k = 0; k < n; k++) sum += p[k] * q[k];
    return sum;
}

/* Turns the rows of A until they are orthogonal, by one-sided Jacobi rotations (Hestenes); b is rotated along, `turns`
 * becomes the combinations of rows of A that have come out, where they are not NULL. Returns the square of the largest
 * row. */
double make_orthogonal(int rows, int columns, double *a, double *turns, double *b) {
    double largest = 0;
    for (int k = 0; k < rows * rows && turns != NULL; k++) turns[k] = k % (rows + 1) == 0;
    for (int sweep = 0; sweep < 60; sweep++) {
        int rotated = 0;
        for (int i = 0; i < rows; i++)
            for (int j = i + 1; j < rows; j++) {
                double *p = a + (size_t)i * columns, *q = a + (size_t)j * columns;
                double pp = dot(columns, p, p), qq = dot(columns, q, q), pq = dot(columns, p, q), angle, t, c;
                if (pq == 0 || fabs(pq) <= DBL_EPSILON * sqrt(pp * qq)) continue;
                rotated = 1;
                angle = (qq - pp) / (2 * pq);
                t = (angle >= 0 ? 1 : -1) / (fabs(angle) + sqrt(1 + angle * angle));
                c = 1 / sqrt(1 + t * t);
                rotate(columns, p, q, c, c * t);
                if (turns != NULL) rotate(rows, turns + (size_t)i * rows, turns + (size_t)j * rows, c, c * t);
                if (b != NULL) rotate(1, b + i, b + j, c, c * t);
            }
        if (!rotated) break;
    }
    for (const double *p = a; p < a + (size_t)rows * columns; p += columns)
        largest = max_of(largest, dot(columns, p, p));
    return largest;
}

/* Shortest x that minimises |A x - b|. `a` holds the rows of A one after the other (and is destroyed), `b`, too. */
void least_squares(int rows, int columns, double *a, double *b, double *x) {
    double largest = make_orthogonal(rows, columns, a, NULL, b);
    memset(x, 0, (size_t)columns * sizeof(double));
    for (int i = 0; i < rows; i++) {
        const double *p = a + (size_t)i * columns;
        double size = dot(columns, p, p);
        if (size <= largest * SAYS_NOTHING) continue;
        for (int k = 0; k < columns; k++) x[k] += p[k] * b[i] / size;
    }
}

/* Steps of n unknowns, the first of them states, by equations for their rates. A combination of equations that says
 * nothing is one of rates that are zero by themselves: the same combination of states keeps its value, such as the slip
 * of a clutch that sticks. `turns` has room for n*n. */
void keeping_least_squares(int n, int states, double *a, double *turns, double *b, double *x) {
    double largest = make_orthogonal(n, n, a, turns, b);
    for (int i = 0; i < n; i++) {
        double *p = a + (size_t)i * n;
        if (dot(n, p, p) > largest * SAYS_NOTHING) continue;
        for (int k = 0; k < n; k++)
            p[k] = k < states ? (largest > 0 ? sqrt(largest) : 1) * turns[(size_t)i * n + k] : 0;
        b[i] = 0;
    }
    least_squares(n, n, a, b, x);
}
