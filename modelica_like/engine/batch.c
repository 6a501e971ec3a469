/* Many runs of one model that leave nothing but numbers behind: sweeps. Every run has its own parameters and inputs,
 * begins where these start it, and is read by `Reading`s off the dense output of its steps. */
#include "core.h"

/* native.c */
Instance *instance_for(const Model *m, void *environment);
Result instance_prepare(Instance *c, double start, double stop, double rtol, double atol);
Result instance_begin(Instance *c);

typedef enum {
    READ_END,
    READ_AT,
    READ_MAX,
    READ_INTEGRAL,
    READ_FIRST,  /* when it is above zero for the first time; nan: never */
    READ_REACH,  /* when it is not below zero for the first time; nan: never */
    READ_CHANGE, /* time of a mode change; nan: it does not happen */
    READ_IMPACT  /* energy that impacts on a motion that is held take */
} ReadingKind;

typedef struct {
    int kind, place;           /* variable, mode, or motion that is held */
    int before, after, number; /* of a mode change: modes (-1: any), and which of several such ones */
    int unused;
    double moment;
} Reading;

typedef struct {
    double start, end, rtol, atol;
    int64_t most_events, n_runs, n_readings;
    const Reading *readings;
    const double *parameters, *inputs; /* by run */
    double *values;                    /* by run */
    unsigned char *failed;             /* by run */
    const volatile int *stop;          /* not zero: somebody has lost patience */
} NativeBatch;

typedef struct {
    Instance *c;
    const NativeBatch *asked;
    double *values, *kept; /* of the present run; the count, or the energy of former instants */
    double *sizes, *nodes; /* largest amounts so far; values at the nodes of a stretch, by node */
    int64_t events;
    int failed;
} Batch;

/* All variables that are asked for, now or at a time within the step that has just been taken. */
static const double *variables_at(Batch *b, double t, int now) {
    Instance *c = b->c;
    double *point = c->vector + c->model->n_z;
    if (now) memcpy(point, c->x, (size_t)c->model->n_unknowns * sizeof(double));
    else piece_at(c->model, c->piece, t, point);
    if (!solve_implicit(c, t, point, 1)) b->failed = 1;
    c->variables_valid = 0;
    evaluate_special(c, &c->model->tapes.variables, t, point, c->variables);
    return c->variables;
}

/* Lobatto's rule of order eight, and the quartic through its nodes: the dense output is of degree four. */
#define SAME_END 1e-6 /* of a run: events are located within its tolerances, so a moment so near is its end */
#define READ_NODES 5
static const double NODE_PLACES[READ_NODES] = {0, 0.17267316464601143, 0.5, 0.8273268353539886, 1},
                    SHARES[READ_NODES] = {9. / 180, 49. / 180, 64. / 180, 49. / 180, 9. / 180};
#define BENT 3e-5    /* of the largest amount: difference to Simpson's rule; the error is its square, at most 1e-9 */
#define TWISTED 0.03 /* of the largest amount: part of third degree, which both rules do not see */
#define SHORTEST_PART 1e-4 /* part of a step; kinks are less precise only within */
#define MOST_EDGES 200     /* of a step: more are rounding beside an edge on which it stays */
#define QUARTIC_LOOKS 16   /* at the quartic, for its extremes */
#define BESIDE 1e-3
#define GOLDEN 0.6180339887498949
#define GOLDEN_TRIALS 40 /* golden section: the time is as precise as the value allows */

static int is_condition(const Reading *one) { return one->kind == READ_FIRST || one->kind == READ_REACH; }

static int is_met(const Reading *one, double value) { return one->kind == READ_REACH ? value >= 0 : value > 0; }

static int reads_along(const Reading *one) {
    return one->kind == READ_MAX || one->kind == READ_INTEGRAL || is_condition(one);
}

static void take_reading(Batch *b, int64_t k, double t, double value) {
    const Reading *one = &b->asked->readings[k];
    double *found = &b->values[k];
    b->sizes[k] = max_of(b->sizes[k], fabs(value));
    if (one->kind == READ_MAX && !(value <= *found)) *found = value;
    if (is_condition(one) && isnan(*found) && is_met(one, value)) *found = t;
}

/* Both sides of an event count. */
static void take_instant(Batch *b) {
    const double *variables = variables_at(b, b->c->state.t, 1);
    for (int64_t k = 0; k < b->asked->n_readings; k++)
        if (reads_along(&b->asked->readings[k]))
            take_reading(b, k, b->c->state.t, variables[b->asked->readings[k].place]);
}

static void look_along(Batch *b, double t, int node) {
    const double *variables = variables_at(b, t, 0);
    for (int64_t k = 0; k < b->asked->n_readings; k++)
        if (reads_along(&b->asked->readings[k]))
            b->nodes[k * READ_NODES + node] = variables[b->asked->readings[k].place];
}

/* Is something no polynomial of degree four there? Below the absolute tolerance all is noise. */
static int is_rough(const Batch *b) {
    for (int64_t k = 0; k < b->asked->n_readings; k++) {
        const double *v = b->nodes + k * READ_NODES;
        double sum = 0, size = b->sizes[k], simpson = (v[0] + 4 * v[2] + v[4]) / 6;
        if (!reads_along(&b->asked->readings[k])) continue;
        for (int i = 0; i < READ_NODES; i++) {
            sum += SHARES[i] * v[i];
            size = max_of(size, fabs(v[i]));
        }
        if (fabs(sum - simpson) > max_of(BENT * size, b->asked->atol)) return 1;
        if (fabs(v[3] - v[1] - (NODE_PLACES[3] - NODE_PLACES[1]) * (v[4] - v[0])) >
            max_of(TWISTED * size, b->asked->atol))
            return 1;
    }
    return 0;
}

static double quartic(const double *values, double s) {
    double sum = 0;
    for (int i = 0; i < READ_NODES; i++) {
        double weight = values[i];
        for (int j = 0; j < READ_NODES; j++)
            if (j != i) weight *= (s - NODE_PLACES[j]) / (NODE_PLACES[i] - NODE_PLACES[j]);
        sum += weight;
    }
    return sum;
}

static double value_at(Batch *b, int64_t k, double t) { return variables_at(b, t, 0)[b->asked->readings[k].place]; }

static void climb(Batch *b, int64_t k, double low, double high) {
    double first = high - GOLDEN * (high - low), second = low + GOLDEN * (high - low);
    double f = value_at(b, k, first), g = value_at(b, k, second);
    for (int n = 0; n < GOLDEN_TRIALS; n++) {
        if (f > g) {
            high = second;
            second = first;
            g = f;
            f = value_at(b, k, first = high - GOLDEN * (high - low));
        } else {
            low = first;
            first = second;
            f = g;
            g = value_at(b, k, second = low + GOLDEN * (high - low));
        }
        take_reading(b, k, first, max_of(f, g));
    }
}

/* The first time of a condition, between one at which it is not met and one at which it is. */
static void meet_zero(Batch *b, int64_t k, double low, double high) {
    const Reading *one = &b->asked->readings[k];
    if (!is_met(one, value_at(b, k, high))) return;
    for (double middle = 0.5 * (low + high); low < middle && middle < high; middle = 0.5 * (low + high)) {
        if (is_met(one, value_at(b, k, middle))) high = middle;
        else low = middle;
    }
    b->values[k] = high;
}

/* Is a place of the quartic a top: higher than its neighbours, or, at an end, than what is just within? */
static int is_top(const double *v, int i, double before, double now, double after) {
    if (i == 0) return quartic(v, BESIDE) > now && after <= quartic(v, BESIDE);
    if (i == QUARTIC_LOOKS) return quartic(v, 1 - BESIDE) > now && before <= quartic(v, 1 - BESIDE);
    return now >= before && now >= after;
}

/* May the quartic come near a value: by Lebesgue's constant of its nodes, which is 1.64? */
static int may_come_near(const double *v, double value) {
    double least = v[0], most = v[0];
    for (int i = 1; i < READ_NODES; i++) {
        least = min_of(least, v[i]);
        most = max_of(most, v[i]);
    }
    return !(most + 0.5 * (most - least) < value);
}

/* Takes what is extreme between the nodes of a stretch. */
static void search_stretch(Batch *b, int64_t k, double begin, double h) {
    const double *v = b->nodes + k * READ_NODES, width = h / QUARTIC_LOOKS;
    double before = -INFINITY, now = v[0];
    const Reading *one = &b->asked->readings[k];
    int first = is_condition(one), last = QUARTIC_LOOKS;
    if (!first && !may_come_near(v, b->values[k] - BENT * b->sizes[k])) return;
    for (int i = 0; i <= last; i++) {
        double after = i < last ? quartic(v, (i + 1.) / last) : -INFINITY;
        if (first && i > 0 && isnan(b->values[k]) && is_met(one, now))
            meet_zero(b, k, begin + width * (i - 1), i < last ? begin + width * i : begin + h);
        if (!first && now >= b->values[k] - BENT * b->sizes[k] && is_top(v, i, before, now, after))
            climb(b, k, begin + width * max_of(i - 1, 0), i < last - 1 ? begin + width * (i + 1) : begin + h);
        before = now;
        now = after;
    }
}

static void take_stretch(Batch *b, double begin, double h) {
    for (int64_t k = 0; k < b->asked->n_readings; k++) {
        const Reading *one = &b->asked->readings[k];
        double *v = b->nodes + k * READ_NODES;
        if (!reads_along(one)) continue;
        if (one->kind != READ_INTEGRAL) search_stretch(b, k, begin, h);
        for (int i = 0; i < READ_NODES; i++) {
            if (one->kind == READ_INTEGRAL) b->values[k] += SHARES[i] * h * v[i];
            take_reading(b, k, begin + h * NODE_PLACES[i], v[i]);
        }
        v[0] = v[READ_NODES - 1];
    }
}

static void read_along(Batch *b, double t, double end) {
    /* Halves of what is less than a few last digits of the time are as long as the whole. */
    double least = max_of(SHORTEST_PART * (end - t), least_step(&b->c->state)), h = end - t;
    look_along(b, t, 0);
    while (t < end && !b->failed) {
        if (t + 1.0001 * h >= end) h = end - t;
        for (int i = 1; i < READ_NODES; i++) look_along(b, t + h * NODE_PLACES[i], i);
        if (h > least && is_rough(b)) {
            h /= 2;
            continue;
        }
        take_stretch(b, t, h);
        t = h < end - t ? t + h : end;
        h *= 2;
    }
}

/* From edge to edge: a polynomial has no kinks. The instants at an edge are looked at on both of its sides. */
static void read_windows(Batch *b, double begin, double end) {
    double t = begin;
    for (int windows = 0; windows < MOST_EDGES && t < end && !b->c->edgeless; windows++) {
        double behind, edge = edge_ahead(b->c, t, &behind);
        if (!(edge < end && behind > t)) break;
        read_along(b, t, edge);
        t = behind;
    }
    if (t < end) read_along(b, t, end);
}

static void read_piece(Batch *b) {
    const NativeBatch *a = b->asked;
    double begin = b->c->piece->begin, end = b->c->piece->end;
    for (int64_t k = 0; k < a->n_readings; k++) { /* a moment at the beginning is behind an event there */
        const Reading *one = &a->readings[k];
        if (one->kind == READ_AT && one->moment >= begin && one->moment < end)
            b->values[k] = variables_at(b, one->moment, 0)[one->place];
    }
    if (b->sizes != NULL) read_windows(b, begin, end);
}

static double after_step(Instance *c) {
    Batch *b = c->environment;
    read_piece(b);
    return *b->asked->stop || b->failed ? c->state.t : INFINITY;
}

static void count_change(Instance *c, int transition, int mode, int target) {
    Batch *b = c->environment;
    b->events++;
    for (int64_t k = 0; k < b->asked->n_readings; k++) {
        const Reading *one = &b->asked->readings[k];
        if (one->kind != READ_CHANGE || one->place != mode || (one->before >= 0 && one->before != (int)c->d[mode]) ||
            (one->after >= 0 && one->after != target))
            continue;
        if (++b->kept[k] == one->number) b->values[k] = c->state.t;
    }
}

/* Impacts at one instant are one: a later one (it begins with held -1) takes the place of those before. */
static void add_impact(Instance *c, int held, double energy, int first) {
    Batch *b = c->environment;
    for (int64_t k = 0; k < b->asked->n_readings; k++) {
        if (b->asked->readings[k].kind != READ_IMPACT) continue;
        if (first) b->kept[k] = b->values[k];
        if (held < 0) b->values[k] = b->kept[k];
        else if (held == b->asked->readings[k].place) b->values[k] += energy;
    }
}

static void begin_readings(Batch *b, int64_t run) {
    const NativeBatch *a = b->asked;
    b->values = a->values + run * a->n_readings;
    b->events = b->failed = 0;
    for (int64_t k = 0; k < a->n_readings; k++) {
        int kind = a->readings[k].kind;
        b->values[k] = kind == READ_INTEGRAL || kind == READ_IMPACT ? 0 : NAN;
        b->kept[k] = 0;
        if (b->sizes != NULL) b->sizes[k] = 0;
    }
}

/* What a parameter that differs from run to run decides is not worked out: tapes then stay as they are. */
static int start_run(Batch *b, int64_t run) {
    const NativeBatch *a = b->asked;
    Instance *c = b->c;
    size_t n_p = (size_t)c->model->n_p, n_u = (size_t)c->model->n_u;
    const double *p = a->parameters + (size_t)run * n_p;
    if (!instance_prepare(c, a->start, a->end, a->rtol, a->atol)) return 0;
    for (size_t k = 0; k < n_p && run > 0; k++)
        if (p[k] != p[k - n_p]) mark_tuned(c, (int)k);
    memcpy(c->p, p, n_p * sizeof(double));
    memcpy(c->u, a->inputs + (size_t)run * n_u, n_u * sizeof(double));
    return start_solve(c) && instance_begin(c);
}

/* Returns 0 if the run cannot go on. */
static int run_to_end(Batch *b) {
    Instance *c = b->c;
    State *s = &c->state;
    while (((s->t < b->asked->end && !s->ended) || s->at_event) && !b->failed && !*b->asked->stop) {
        int passed = s->at_event;
        if (passed && (!handle_event(c) || b->events > b->asked->most_events)) return 0;
        Arrival arrival = passed ? AT_EVENT : integrate_to(c, b->asked->end, 1);
        if (arrival == FAILED) return 0;
        if (arrival == AT_EVENT && !passed) read_piece(b);
        if (passed && b->sizes != NULL) take_instant(b);
    }
    return !b->failed;
}

static void read_end(Batch *b) {
    double end = b->c->state.t, latest = end + SAME_END * (end - b->asked->start);
    const double *variables = variables_at(b, end, 1);
    for (int64_t k = 0; k < b->asked->n_readings; k++) {
        const Reading *one = &b->asked->readings[k];
        if (one->kind == READ_END || (one->kind == READ_AT && one->moment >= end && one->moment <= latest))
            b->values[k] = variables[one->place];
    }
}

static int begin_batch(Batch *b, const Model *m) {
    const NativeBatch *a = b->asked;
    int along = 0;
    for (int64_t k = 0; k < a->n_readings; k++) along |= reads_along(&a->readings[k]);
    b->kept = calloc((size_t)a->n_readings * (2 + READ_NODES) + 1, sizeof(double));
    b->c = instance_for(m, b);
    if (b->kept == NULL || b->c == NULL) return 0;
    if (along) b->sizes = b->kept + a->n_readings;
    b->nodes = b->kept + 2 * a->n_readings;
    b->c->noted = count_change;
    b->c->struck = add_impact;
    b->c->step_finished = after_step;
    for (int64_t k = 0; k < a->n_readings; k++) {
        int kind = a->readings[k].kind;
        if (kind != READ_CHANGE && kind != READ_IMPACT) ask_for(b->c, a->readings[k].place);
    }
    return 1;
}

/* Does the runs one after the other; returns how many are done, fewer than asked for if it was stopped, or -1 without
 * memory. */
EXPORTED int64_t native_batch(const Model *m, const NativeBatch *asked) {
    Batch b = {.asked = asked};
    int64_t run = begin_batch(&b, m) ? 0 : -1;
    for (; run >= 0 && run < asked->n_runs && !*asked->stop; run++) {
        begin_readings(&b, run);
        asked->failed[run] = !start_run(&b, run) || !run_to_end(&b) || !finish(b.c);
        if (*asked->stop) break;
        if (!asked->failed[run]) read_end(&b);
    }
    if (b.c != NULL) instance_free(b.c);
    free(b.kept);
    return run;
}
