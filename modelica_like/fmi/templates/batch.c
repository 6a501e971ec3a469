/* Many runs of one model that leave nothing but numbers behind: sweeps. Every run has its own parameters and inputs,
 * begins where these start it, and is read by `Reading`s. Results are at equal distances and on both sides of every
 * event; what happens between them is read off the dense output of the steps. */
#include "core.h"

/* native.c */
Instance *instance_for(const Model *m, void *environment);
Result instance_prepare(Instance *c, double start, double stop, double rtol, double atol);
Result instance_begin(Instance *c);

typedef enum {
    READ_END,
    READ_AT,
    READ_MAX, /* of the results, like READ_MIN and READ_AREA (trapezoids) */
    READ_MIN,
    READ_AREA,
    READ_WORK,   /* integral over the steps */
    READ_CHANGE, /* time of a mode change; nan: it does not happen */
    READ_IMPACT, /* energy that impacts on a motion that is held take */
    N_READINGS
} ReadingKind;

typedef struct {
    int kind, place;           /* variable, mode, or motion that is held */
    int before, after, number; /* of a mode change: modes (-1: any), and which of several such ones */
    int unused;
    double moment;
} Reading;

typedef struct {
    double start, end, rtol, atol;
    int64_t results, most_events, n_runs, n_readings; /* results: number of intervals */
    const Reading *readings;
    const double *parameters, *inputs; /* by run */
    double *values;                    /* by run */
    unsigned char *failed;             /* by run */
    const volatile int *stop;          /* not zero: somebody has lost patience */
} NativeBatch;

typedef struct {
    Instance *c;
    const NativeBatch *asked;
    double *values, *kept; /* of the present run; the last value, or the count, or the energy of former instants */
    double last;           /* time of the last result */
    int64_t next, events;  /* number of the next result */
    int failed, sampled, in_steps;
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

static void take_result(Batch *b, double t, const double *variables) {
    for (int64_t k = 0; k < b->asked->n_readings; k++) {
        const Reading *one = &b->asked->readings[k];
        if (one->kind != READ_MAX && one->kind != READ_MIN && one->kind != READ_AREA) continue;
        double value = variables[one->place], *found = &b->values[k];
        if (one->kind == READ_AREA) *found += 0.5 * (t - b->last) * (value + b->kept[k]);
        else if (isnan(*found) || (one->kind == READ_MAX ? value > *found : value < *found)) *found = value;
        b->kept[k] = value;
    }
    b->last = t;
}

/* Gauss's rule of order six: the dense output has order four. */
static void add_work(Batch *b, double begin, double end) {
    static const double places[] = {-0.7745966692414834, 0, 0.7745966692414834}, weights[] = {5, 8, 5};
    for (int g = 0; g < 3; g++) {
        const double *variables = variables_at(b, 0.5 * (begin + end) + 0.5 * (end - begin) * places[g], 0);
        for (int64_t k = 0; k < b->asked->n_readings; k++)
            if (b->asked->readings[k].kind == READ_WORK)
                b->values[k] += weights[g] / 18 * (end - begin) * variables[b->asked->readings[k].place];
    }
}

static void read_piece(Batch *b) {
    const NativeBatch *a = b->asked;
    double begin = b->c->piece->begin, end = b->c->piece->end;
    for (; b->sampled && b->next < a->results; b->next++) {
        double t = a->start + (a->end - a->start) * ((double)b->next / (double)a->results);
        if (t >= end) break;
        if (t > begin) take_result(b, t, variables_at(b, t, 0));
    }
    for (int64_t k = 0; k < a->n_readings; k++) { /* a moment at the beginning is behind an event there */
        const Reading *one = &a->readings[k];
        if (one->kind == READ_AT && one->moment >= begin && one->moment < end)
            b->values[k] = variables_at(b, one->moment, 0)[one->place];
    }
    if (b->in_steps & 1 << READ_WORK) add_work(b, begin, end);
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
    b->last = a->start;
    b->next = 1;
    b->events = b->failed = 0;
    for (int64_t k = 0; k < a->n_readings; k++) {
        int kind = a->readings[k].kind;
        b->values[k] = kind == READ_AREA || kind == READ_WORK || kind == READ_IMPACT ? 0 : NAN;
        b->kept[k] = 0;
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
    while ((s->t < b->asked->end || s->at_event) && !b->failed && !*b->asked->stop) {
        int passed = s->at_event;
        if (passed && (!handle_event(c) || b->events > b->asked->most_events)) return 0;
        Arrival arrival = passed ? AT_EVENT : integrate_to(c, b->asked->end, 1);
        if (arrival == FAILED) return 0;
        if (arrival == AT_EVENT && !passed) read_piece(b);
        if (arrival == REACHED && s->t < b->asked->end) continue;
        if (b->sampled) take_result(b, s->t, variables_at(b, b->c->state.t, 1));
    }
    return !b->failed;
}

static void read_end(Batch *b) {
    const double *variables = variables_at(b, b->c->state.t, 1);
    for (int64_t k = 0; k < b->asked->n_readings; k++) {
        const Reading *one = &b->asked->readings[k];
        if (one->kind == READ_END || (one->kind == READ_AT && one->moment >= b->asked->end))
            b->values[k] = variables[one->place];
    }
}

static int begin_batch(Batch *b, const Model *m) {
    const NativeBatch *a = b->asked;
    b->kept = calloc((size_t)a->n_readings + 1, sizeof(double));
    b->c = instance_for(m, b);
    if (b->kept == NULL || b->c == NULL) return 0;
    b->c->noted = count_change;
    b->c->struck = add_impact;
    b->c->step_finished = after_step;
    for (int64_t k = 0; k < a->n_readings; k++) {
        int kind = a->readings[k].kind;
        b->in_steps |= 1 << kind;
        if (kind != READ_CHANGE && kind != READ_IMPACT) ask_for(b->c, a->readings[k].place);
    }
    b->sampled = (b->in_steps & (1 << READ_MAX | 1 << READ_MIN | 1 << READ_AREA)) != 0;
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
