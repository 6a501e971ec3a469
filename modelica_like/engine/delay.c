/* Delayed values: Chebyshev series of time in d, through what a run has been before. The past is rows of a time and the
 * values that are delayed: four or more for an own step, one for an importer's. A row behind a jump or kink begins
 * anew; what was there comes again exactly one delay later, where a series ends at the latest. */
#include "core.h"

#define LAST 3 /* terms that must be below the tolerance */
#define SHORTEST 1e-6
#define NOISE_OF_RUN 100  /* last terms in tolerances that are errors of the run, if half the length */
#define NOISE_OF_PIECES 2 /* of another integrator, in tolerances */
#define SMOOTHER 0.6      /* leaves more than this part of them */
#define SMOOTH 7          /* a kink that has come again so often is smooth */
#define DEGREE 5          /* of the polynomial through rows */
#define SPREAD 0.5        /* least distance of rows in a polynomial, in the step around the time */
#define APART 1e-12       /* relative: nearer rows tell nothing but rounding */
#define FEWEST 4          /* rows of a step */
#define MOST 256

typedef struct { /* order: how often a jump or kink has been integrated that is at its begin, or -1 */
    double t, order, values[];
} Row;

static Row *row_at(const Instance *c, int k) {
    return (Row *)(void *)(c->past + (size_t)k * (size_t)(2 + c->model->n_delays));
}

static Row *last_row(const Instance *c) { return row_at(c, c->state.n_past - 1); }

/* Rows that no delay reaches any more make room. */
static void forget(Instance *c, const double *delayed) {
    double longest = 0;
    int n = c->state.n_past, first = 0;
    for (int k = 0; k < c->model->n_delays; k++) longest = max_of(longest, delayed[2 * k + 1]);
    while (first + DEGREE + 1 < n && row_at(c, first + DEGREE + 1)->t <= last_row(c)->t - longest) first++;
    c->state.n_past = n - first;
    memmove(c->past, row_at(c, first), (size_t)((char *)row_at(c, n) - (char *)row_at(c, first)));
}

/* Notes what is delayed, as a new row behind a jump or kink of an order, or -1. */
void keep_past(Instance *c, double t, const double *point, double order) {
    State *s = &c->state;
    double *delayed = c->delayed;
    Row *row;
    if (c->model->n_delays == 0 || (s->n_past == 0 && order < 0)) return;
    while (s->n_past > 1 && last_row(c)->t > t) s->n_past--;
    if (order < 0 && last_row(c)->t + APART * max_of(1, fabs(t)) >= t) return;
    evaluate(c, &c->model->tapes.delays, t, point, delayed);
    c->variables_valid = 0;
    if (s->n_past == MOST_PAST) forget(c, delayed);
    if (s->n_past == MOST_PAST) s->past_lost = 1;
    if (s->past_lost) return;
    s->n_past++;
    row = last_row(c);
    row->t = t;
    row->order = order;
    for (int k = 0; k < c->model->n_delays; k++) {
        row->values[k] = delayed[2 * k];
        c->past_sizes[k] = max_of(c->past_sizes[k], fabs(delayed[2 * k]));
    }
}

/* The next row on one side that is at least so far away, or -1 at an end of the past, a jump or a kink. */
static int row_beside(const Instance *c, int from, int way, double apart) {
    int k = from;
    do {
        if (way < 0 ? k == 0 || row_at(c, k)->order >= 0 : k + 1 == c->state.n_past || row_at(c, k + 1)->order >= 0)
            return -1;
        k += way;
    } while (fabs(row_at(c, k)->t - row_at(c, from)->t) < apart);
    return k;
}

/* The polynomial through the rows around a time (Neville). Beside a long step rows of short ones are passed over: they
   have the same noise, which a polynomial through a crowd of them makes the larger the farther away it is. */
static double past_value(const Instance *c, int which, double t) {
    int low = 0, high = c->state.n_past, first, last, n = 0;
    double times[DEGREE + 1], values[DEGREE + 1];
    while (high - low > 1) {
        int middle = (low + high) / 2;
        *(row_at(c, middle)->t <= t ? &low : &high) = middle;
    }
    if (t <= row_at(c, 0)->t) return row_at(c, 0)->values[which];
    double apart = low + 1 < c->state.n_past ? SPREAD * (row_at(c, low + 1)->t - row_at(c, low)->t) : 0;
    for (int row = first = last = low; row >= 0 && n <= DEGREE;) {
        times[n] = row_at(c, row)->t;
        values[n++] = row_at(c, row)->values[which];
        int before = row_beside(c, first, -1, apart), behind = row_beside(c, last, 1, apart);
        int later = behind >= 0 && (last == low || before < 0 || row_at(c, behind)->t - t < t - row_at(c, before)->t);
        row = later ? (last = behind) : before >= 0 ? (first = before) : -1;
    }
    for (int step = 1; step < n; step++)
        for (int k = 0; k + step < n; k++)
            values[k] += (t - times[k]) * (values[k + 1] - values[k]) / (times[k + step] - times[k]);
    return values[0];
}

static double allowed_of(const Instance *c, int which) {
    return c->state.tolerance * c->past_sizes[which] + c->state.absolute;
}

/* Do rows tell what is delayed along the present piece, in the middle of two of its n parts? */
static int is_told(Instance *c, double begin, double end, int n) {
    double *point = c->vector + c->model->n_z, *delayed = c->delayed;
    double noise = c->integrator != NULL ? NOISE_OF_PIECES : 1;
    for (int part = 0; part < n; part += n / 2) {
        double t = begin + (end - begin) * (part + 0.5) / n;
        piece_at(c->model, c->piece, t, point);
        evaluate(c, &c->model->tapes.delays, t, point, delayed);
        for (int k = 0; k < c->model->n_delays; k++)
            if (fabs(past_value(c, k, t) - delayed[2 * k]) > noise * allowed_of(c, k)) return 0;
    }
    return 1;
}

/* Notes what is delayed along the present piece, in as many parts as it takes. */
void keep_piece(Instance *c, double end) {
    double *point = c->vector + c->model->n_z, begin;
    if (c->model->n_delays == 0 || c->state.n_past == 0) return;
    begin = last_row(c)->t;
    if (!(begin + APART * max_of(1, fabs(end)) < end)) return;
    for (int n = c->integrator != NULL ? FEWEST / 2 : FEWEST; n <= MOST; n *= 2) {
        for (int k = 1; k <= n; k++) {
            double t = k < n ? begin + (end - begin) * k / n : end;
            piece_at(c->model, c->piece, t, point);
            keep_past(c, t, point, -1);
        }
        if (is_told(c, begin, end, n)) return;
    }
}

/* Inputs or parameters are about to change, at a point that belongs to what was before. */
void keep_before_change(Instance *c) {
    if (c->state.n_past == 0) return;
    if (c->state.piece_valid) keep_piece(c, c->state.t);
    else if (c->state.phase == PHASE_EVENT && settle(c)) keep_past(c, c->state.t, c->x, -1);
}

/* The series of all delays for a time ahead; returns its last terms in tolerances. */
static double series(Instance *c, double half, const double *delayed, double *terms) {
    double rough = 0;
    for (int which = 0; which < c->model->n_delays; which++, terms += DELAY_TERMS) {
        memset(terms, 0, DELAY_TERMS * sizeof(double));
        for (int node = 0; node < DELAY_TERMS; node++) {
            double angle = acos(-1) * (1 - (node + 0.5) / DELAY_TERMS);
            double value = past_value(c, which, c->state.t + half * (1 + cos(angle)) - delayed[2 * which + 1]);
            for (int k = 0; k < DELAY_TERMS; k++) terms[k] += value * cos(k * angle) * (k ? 2 : 1) / DELAY_TERMS;
        }
        rough = max_of(rough, largest_of(LAST, terms + DELAY_TERMS - LAST) / allowed_of(c, which));
    }
    return rough;
}

/* Shortens the time ahead until series are within the tolerances; returns half of it. */
static double resolved(Instance *c, double half, const double *delayed, double *terms) {
    size_t size = (size_t)(c->model->n_delays * DELAY_TERMS);
    double *shorter = terms + size, least = half * SHORTEST, rough = series(c, half, delayed, terms), next;
    while (rough > 1 && half > least) {
        next = series(c, 0.5 * half, delayed, shorter);
        if (rough < NOISE_OF_RUN && next > SMOOTHER * rough) break;
        half *= 0.5;
        rough = next;
        memcpy(terms, shorter, size * sizeof(double));
    }
    return half;
}

/* New series from the present time on. Jumps and kinks that come again now come again later, too. */
static Result renew_delays(Instance *c) {
    const Model *m = c->model;
    State *s = &c->state;
    double *delayed = c->delayed, *terms = c->series, end = INFINITY, half, order = INFINITY;
    double resolution = just_after(s) - s->t;
    evaluate_now(c, &m->tapes.delays, delayed);
    for (int k = 0; k < m->n_delays; k++) {
        double time = delayed[2 * k + 1];
        if (!(time > 0) || isinf(time)) return fail(c, DELAY_NOT_POSITIVE, k, time);
        end = min_of(end, s->t + time);
        for (int i = 0; i < s->n_past; i++) {
            const Row *row = row_at(c, i);
            if (row->order < 0 || row->t + time < s->t - resolution) continue;
            if (row->t + time <= s->t + resolution) order = min_of(order, row->order);
            else end = min_of(end, row->t + time);
        }
    }
    if (s->past_lost) return fail(c, PAST_TOO_LONG, MOST_PAST);
    half = resolved(c, 0.5 * (end - s->t), delayed, terms);
    for (int k = 0; k < m->n_delays; k++) {
        double *d = c->d + m->delays[k].first;
        memcpy(d, terms + k * DELAY_TERMS, DELAY_TERMS * sizeof(double));
        d[DELAY_TERMS] = s->t;
        d[DELAY_TERMS + 1] = 1 / half;
    }
    s->delayed_until = s->t + 2 * half;
    c->variables_valid = 0;
    if (!solve_now(c, 0)) return RESULT_ERROR;
    if (isinf(order)) return RESULT_OK;
    evaluate_now(c, &m->tapes.delays, delayed);
    for (int k = 0; k < m->n_delays; k++)
        if (fabs(delayed[2 * k] - last_row(c)->values[k]) > allowed_of(c, k)) order = -1;
    if (order < SMOOTH) keep_past(c, s->t, c->x, order + 1);
    return RESULT_OK;
}

int delays_due(const Instance *c) {
    return c->model->n_delays > 0 && (c->state.n_past == 0 || c->state.delayed_until <= just_after(&c->state));
}

/* The left side of an instant, and what comes again there. */
Result reach_instant(Instance *c) {
    if (c->model->n_delays == 0 || c->state.n_past == 0) return RESULT_OK;
    if (last_row(c)->t < c->state.t) keep_past(c, c->state.t, c->x, -1);
    return delays_due(c) ? renew_delays(c) : RESULT_OK;
}

/* The right side, if something has happened there; the past begins with the start. */
Result leave_instant(Instance *c, int happened) {
    int begins = c->state.n_past == 0;
    if (c->model->n_delays == 0 || !(begins || happened)) return RESULT_OK;
    if (begins) gradient_lose(c, FAILURE_LOST_BY_DELAY);
    keep_past(c, c->state.t, c->x, 0);
    return begins ? renew_delays(c) : RESULT_OK;
}
