/* Whole runs and single steps for programs that load this library: Python through ctypes, a page in a browser. Open a
 * model from the bytes of its file; make a handle of it for every thread, reset it, set what is to be other than in the
 * model, begin, then step, or run into buffers. Functions return NATIVE_OK or NATIVE_FAILED (native_message tells why),
 * runs also NATIVE_MORE or NATIVE_PAUSED. Variables go by value references. Handles share nothing that changes. */
#include "adjoint.h"

enum { NATIVE_OK, NATIVE_FAILED, NATIVE_MORE, NATIVE_PAUSED };
#define NEAR_EVENT 2e-7 /* of the distance of results: nearer to an event, its left side stands for the result */
#define SAME 1e-12

/* What a run writes, by rows; NULL: it is not wanted. Where room ends it returns NATIVE_MORE, where `steps` are done
 * (0: any number) NATIVE_PAUSED; called again, it goes on from there. Points are results and both sides of events. */
typedef struct {
    double *times, *states, *outputs; /* by point: time; states and implicit unknowns; outputs */
    double *modes, *firsts;           /* by segment: d (modes, discrete values, what holds need); its first point */
    double *events;             /* time, transition (-1: an impact's), mode, from, to, round, segment that follows */
    double *impacts;            /* time, motion that is held, energy in J, `trials` */
    double *steps_taken;        /* segment, begin, end, and `piece_at`'s points: states and implicit unknowns */
    const uint32_t *references; /* of the outputs */
    int64_t n_outputs, steps;
    int64_t room_points, room_segments, room_events, room_impacts, room_taken;
    int64_t n_points, n_segments, n_events, n_impacts, n_taken;
    int64_t next, first; /* number of the next result, first point of the open segment */
    double begin, last;  /* times of the run's begin and of the last point */
} NativeRun;

typedef struct {
    Instance *c;
    NativeRun *run;
    void *before;          /* state before an instant for whose events there may be no room */
    const Variable **read; /* the outputs of the run */
    int64_t strikes;       /* impacts before the present instant */
    double pause;          /* number of steps at which to pause */
    char message[MESSAGE_LENGTH];
} Native;

static void keep_message(const Instance *c, int status, const char *category, const char *message) {
    Native *n = c->environment;
    if (status) return;
    snprintf(n->message, sizeof n->message, "%s", message);
    if (n->c != NULL) n->c->failure.code = FAILURE_MISUSED; /* `fail` knows better */
}

static int code(Result result) { return result ? NATIVE_OK : NATIVE_FAILED; }

/* Returns NULL, and why in `message` (of 512 characters), if the bytes are no model. They are copied. */
EXPORTED Model *native_open(const unsigned char *bytes, size_t size, char *message) {
    unsigned char *own = calloc(size + 1, 1);
    Model *m = own == NULL ? NULL : model_read(memcpy(own, bytes, size), size, calloc, free, message);
    if (own == NULL) snprintf(message, MESSAGE_LENGTH, "There is not enough memory.");
    if (m == NULL) free(own);
    else m->own = own;
    return m;
}

EXPORTED void native_close(Model *m) { model_free(m); }

/* Compiled code, which must outlive it, for handles that are made from now on. */
EXPORTED void native_compiled(Model *m, const Codes *codes) { use_codes(m, codes); }

/* An instance for a program that has loaded this library. */
Instance *instance_for(const Model *m, void *environment) {
    Instance bare = {.model = m, .name = "native", .environment = environment, .allocate = calloc, .release = free};
    bare.co_simulation = 1;
    return instance_new(bare, m->token);
}

/* A handle of a model, which must outlive it; NULL if there is no memory. */
EXPORTED Native *native_new(const Model *m) {
    Native *n = calloc(1, sizeof *n);
    Instance *c = n == NULL ? NULL : instance_for(m, n);
    if (c == NULL) return free(n), NULL;
    c->log = keep_message;
    n->c = c;
    return n;
}

EXPORTED void native_free(Native *n) {
    state_release(n->c, &n->before);
    instance_free(n->c);
    free(n->read);
    free(n);
}

/* The instance as FMI functions know it, for modelica_like.h. */
EXPORTED void *native_instance(const Native *n) { return n->c; }

EXPORTED const char *native_message(const Native *n) { return n->message; }

/* What has failed, and where: states and implicit unknowns, d, d before the last change, parameters, inputs. */
EXPORTED const Failure *native_failure(const Native *n, const double *point[5]) {
    const Instance *c = n->c;
    point[0] = c->x;
    point[1] = c->d;
    point[2] = c->d_before;
    point[3] = c->p;
    point[4] = c->u;
    return &c->failure;
}

/* Back to the model's values; start and end (infinite: unknown) in s, relative tolerance, absolute one in nominals. */
Result instance_prepare(Instance *c, double start, double stop, double rtol, double atol) {
    instance_reset(c);
    Result result = set_experiment(c, 1, rtol, start, isfinite(stop), stop);
    c->state.absolute = atol;
    c->state.phase = PHASE_INITIALIZATION;
    return result;
}

EXPORTED int native_reset(Native *n, double start, double stop, double rtol, double atol) {
    return code(instance_prepare(n->c, start, stop, rtol, atol));
}

/* Panels come from another integrator from now on; `felt` marks entries of d that equations of motion read. */
EXPORTED void native_integrate_by(Native *n, Integrator integrator, const unsigned char *felt) {
    n->c->integrator = integrator;
    memcpy(n->c->felt, felt, (size_t)n->c->model->n_d);
}

/* Makes a panel of its results, up to a piece that is not precise; returns the number of pieces. */
EXPORTED int64_t native_take_looks(Native *n, Looks *looks) {
    take_looks(n->c, looks);
    return n->c->panel.pieces;
}

/* The largest step from now on, in s. */
EXPORTED void native_limit(Native *n, double longest) { n->c->state.longest = longest; }

/* Before the begin: parameters, inputs and start values; later: inputs, and parameters that are tunable. */
EXPORTED int native_set(Native *n, int64_t count, const uint32_t *references, const double *values) {
    for (int64_t k = 0; k < count; k++)
        if (!set_value(n->c, known_variable(n->c, references[k], ANY_TYPE), values[k])) return NATIVE_FAILED;
    return NATIVE_OK;
}

/* All parameters and inputs at once, in the order of the model's tables and unchecked. */
EXPORTED void native_set_all(Native *n, const double *parameters, const double *inputs) {
    memcpy(n->c->p, parameters, (size_t)n->c->model->n_p * sizeof(double));
    memcpy(n->c->u, inputs, (size_t)n->c->model->n_u * sizeof(double));
}

static int read_values(Instance *c, int64_t count, const uint32_t *references, double *values) {
    for (int64_t k = 0; k < count; k++)
        if (!get_value(c, known_variable(c, references[k], ANY_TYPE), &values[k])) return NATIVE_FAILED;
    return NATIVE_OK;
}

/* Has an event to be handled before anything else? What a fixed step has left is taken by the next one. */
static int event_first(const Instance *c) { return c->state.at_event && !(c->model->settings->fixed_step > 0); }

EXPORTED int native_get(Native *n, int64_t count, const uint32_t *references, double *values) {
    if (event_first(n->c) && !handle_event(n->c)) return NATIVE_FAILED;
    return read_values(n->c, count, references, values);
}

/* Events at the start come first, whatever is asked for next. */
Result instance_begin(Instance *c) {
    c->state.phase = PHASE_STEP;
    c->state.inputs_changed = 0;
    c->state.at_event = 1;
    return c->model->settings->fixed_step > 0 ? handle_event(c) : RESULT_OK;
}

/* Finds the start from the model's start values and from those that were set. */
EXPORTED int native_begin(Native *n) { return code(!start_solve(n->c) ? RESULT_ERROR : instance_begin(n->c)); }

static Instance *go_to(const Native *n, const double *x, const double *z, const double *d) {
    Instance *c = n->c;
    memcpy(c->x, x, (size_t)c->model->n_x * sizeof(double));
    memcpy(c->z, z, (size_t)c->model->n_z * sizeof(double));
    memcpy(c->d, d, (size_t)c->model->n_d * sizeof(double));
    c->state.solved = 1;
    c->state.z_valid = c->variables_valid = 0;
    return c;
}

/* Finds the start alone, or a steady state of given modes near a point; `native_failure` tells where that is. */
EXPORTED int native_start(Native *n) { return code(start_solve(n->c)); }

EXPORTED int native_steady_near(Native *n, const double *x, const double *z, const double *d) {
    return code(steady_near(go_to(n, x, z, d)));
}

/* Lets every clock tick once at a steady state, or tells whether it stays one when they do. */
EXPORTED int native_tick(Native *n, const double *x, const double *z, const double *d) {
    double step;
    return code(tick(go_to(n, x, z, d), &step));
}

EXPORTED int native_check_ticks(Native *n, const double *x, const double *z, const double *d) {
    return code(check_ticks(go_to(n, x, z, d)));
}

/* What is shared at a point in its modes, and what stops that has begun to be held, as strike_here says. */
EXPORTED void native_share(Native *n, const double *x, const double *z, const double *d) { share(go_to(n, x, z, d)); }

EXPORTED int native_strike(Native *n, const double *x, const double *z, const double *d, const unsigned char *entering,
    unsigned char *knocked, int *hard) {
    return code(strike_here(go_to(n, x, z, d), entering, knocked, hard));
}

/* Begins at states, implicit unknowns and d that are given; events there have not happened yet. */
EXPORTED int native_begin_at(Native *n, const double *x, const double *z, const double *d) {
    return code(instance_begin(go_to(n, x, z, d)));
}

/* The states after the events that come first; with other ones, if these are `given`. Those may move what modes hold:
 * it is stopped as if they began to hold it now. */
EXPORTED int native_states(Native *n, const double *given, double *x) {
    Instance *c = n->c;
    if (event_first(c) && !handle_event(c)) return NATIVE_FAILED;
    if (given != NULL) {
        if (!set_states(c, given)) return NATIVE_FAILED;
        gradient_lose(c, FAILURE_LOST_BY_STATES);
        for (int k = 0; k < c->model->n_d; k++) c->d_before[k] = -1;
        memset(c->entered, 0, (size_t)c->model->n_holds);
        c->stopped = c->state.piece_valid = c->state.event_pending = 0;
        if (!share_and_solve(c) || !stop_motions(c, c->d_before, 0) || !instance_begin(c)) return NATIVE_FAILED;
    }
    memcpy(x, c->x, (size_t)c->model->n_x * sizeof(double));
    return NATIVE_OK;
}

/* A control loop's step: sets, goes to a time through all events, gets. */
EXPORTED int native_step(Native *n, double time, int64_t n_set, const uint32_t *set, const double *given, int64_t n_get,
    const uint32_t *get, double *values) {
    if (native_set(n, n_set, set, given) != NATIVE_OK || !check_whole(n->c, time - n->c->state.t) ||
        integrate_to(n->c, time, 0) == FAILED)
        return NATIVE_FAILED;
    return native_get(n, n_get, get, values);
}

EXPORTED double native_time(const Native *n) { return n->c->state.t; }

/* Copies of the state, to come back to; *copy is NULL, or a copy to be written over. */
EXPORTED int native_copy(Native *n, void **copy) { return code(state_copy_out(n->c, copy)); }
EXPORTED int native_restore(Native *n, const void *copy) { return code(state_copy_in(n->c, copy)); }
EXPORTED void native_drop(Native *n, void **copy) { state_release(n->c, copy); }

/* Steps end at edges from now on, for derivatives; of what is read along the run since the begin, which
 * modelica_like_gradient_start has been told of. */
EXPORTED void native_land(Native *n) { n->c->lands = 1; }
EXPORTED int native_gradient_along(Native *n, const Along *along, double *gradient) {
    return code(differentiate(n->c, NULL, (size_t)along->n_of, along, gradient));
}

/* Since the reset: steps, rejected steps, evaluations of the equations, mode changes. */
EXPORTED void native_counts(const Native *n, double *counts) {
    const State *s = &n->c->state;
    const double found[] = {s->n_steps, s->n_rejected, s->n_evaluations, s->n_events};
    memcpy(counts, found, sizeof found);
}

static void note_event(Instance *c, int transition, int mode, int target) {
    NativeRun *r = ((Native *)c->environment)->run;
    if (r == NULL || r->events == NULL) return;
    if (r->n_events < r->room_events) {
        double row[] = {c->state.t, transition, mode, c->d[mode], target, c->round, (double)r->n_segments};
        memcpy(r->events + 7 * r->n_events, row, sizeof row);
    }
    r->n_events++;
}

/* Impacts at one instant are one: a later one (it begins with held -1) takes the place of those before. */
static void note_impact(Instance *c, int held, double energy, int first) {
    Native *n = c->environment;
    NativeRun *r = n->run;
    if (r == NULL || r->impacts == NULL) return;
    if (first) n->strikes = r->n_impacts;
    if (held >= 0 && r->n_impacts < r->room_impacts) {
        size_t size = 2 * (size_t)(c->model->n_unknowns + c->model->n_d);
        double *row = r->impacts + (3 + size) * (size_t)r->n_impacts;
        row[0] = c->state.t;
        row[1] = held;
        row[2] = energy;
        memcpy(row + 3, c->trials, size * sizeof(double));
    }
    r->n_impacts = held < 0 ? n->strikes : r->n_impacts + 1;
}

/* Looks up the outputs of a run. */
static int find_outputs(Native *n, const NativeRun *r) {
    free(n->read);
    n->read = r->outputs == NULL ? NULL : calloc((size_t)r->n_outputs + 1, sizeof *n->read);
    if (r->outputs != NULL && n->read == NULL) return code(fail(n->c, NO_MEMORY, 0));
    return code(r->outputs == NULL || find_all(n->c, r->n_outputs, r->references, n->read));
}

static int write_point(Native *n, NativeRun *r) {
    const Instance *c = n->c;
    int64_t k = r->n_points++;
    r->last = c->state.t;
    if (r->times != NULL) r->times[k] = c->state.t;
    if (r->states != NULL)
        memcpy(r->states + k * c->model->n_unknowns, c->x, (size_t)c->model->n_unknowns * sizeof(double));
    if (r->outputs == NULL) return NATIVE_OK;
    return code(get_all(n->c, r->n_outputs, n->read, r->outputs + k * r->n_outputs));
}

/* The left side of an event, the event, its right side, which begins a segment. */
static int instant(Native *n, NativeRun *r, double width) {
    Instance *c = n->c;
    int64_t events = r->n_events, impacts = n->strikes = r->n_impacts;
    int segments = r->modes != NULL || r->firsts != NULL;
    if (r->n_points + 2 > r->room_points || (segments && r->n_segments == r->room_segments)) return NATIVE_MORE;
    if (r->n_segments > 0 && r->last != c->state.t) {
        if (c->state.t - r->last <= NEAR_EVENT * width && r->n_points > r->first + 1) r->n_points--;
        if (write_point(n, r) != NATIVE_OK) return NATIVE_FAILED;
    }
    if (!state_copy_out(c, &n->before) || !handle_event(c)) return NATIVE_FAILED;
    if (r->n_events > r->room_events || r->n_impacts > r->room_impacts) {
        r->n_events = events;
        r->n_impacts = impacts;
        state_copy_in(c, n->before);
        return NATIVE_MORE;
    }
    if (r->modes != NULL)
        memcpy(r->modes + r->n_segments * c->model->n_d, c->d, (size_t)c->model->n_d * sizeof(double));
    if (r->firsts != NULL) r->firsts[r->n_segments] = (double)r->n_points;
    r->first = r->n_points;
    r->n_segments++;
    return write_point(n, r);
}

/* Notes the step that has just been taken. One of no length, with an event at once, has no polynomial. */
static void note_step(Native *n, NativeRun *r) {
    size_t size = 5 * (size_t)n->c->model->n_unknowns;
    const Piece *piece = n->c->piece;
    if (r->steps_taken == NULL || !(piece->end > piece->begin)) return;
    double *row = r->steps_taken + (size_t)r->n_taken++ * (3 + size);
    row[0] = (double)(r->n_segments - 1);
    row[1] = piece->begin;
    row[2] = piece->end;
    memcpy(row + 3, piece->points, size * sizeof(double));
}

static int steps_full(const NativeRun *r) { return r->steps_taken != NULL && r->n_taken == r->room_taken; }

static double pause_after(Instance *c) {
    Native *n = c->environment;
    note_step(n, n->run);
    return c->state.n_steps >= n->pause || steps_full(n->run) ? c->state.t : INFINITY;
}

static int last_instant(Native *n, NativeRun *r, double width) {
    int terminal = n->c->model->settings->terminal, result;
    if (terminal < 0 || n->c->d[terminal] != 0) return NATIVE_OK;
    n->c->d[terminal] = 1;
    result = instant(n, r, width);
    if (result == NATIVE_MORE) n->c->d[terminal] = 0;
    return result;
}

static int run_on(Native *n, double end, int64_t results, NativeRun *r) {
    State *s = &n->c->state;
    double width = (end - r->begin) / (double)results;
    while ((s->t < end && !s->ended) || event_first(n->c) || r->n_segments == 0) {
        double t = r->begin + (end - r->begin) * ((double)r->next / (double)results);
        if (event_first(n->c) || r->n_segments == 0) {
            int result = instant(n, r, width);
            if (result != NATIVE_OK) return result;
            continue;
        }
        if (s->n_steps >= n->pause) return NATIVE_PAUSED;
        if (r->n_points == r->room_points || steps_full(r)) return NATIVE_MORE;
        if (r->next++ < results && t <= s->t + min_of(0.5 * NEAR_EVENT * width, SAME * max_of(1, fabs(s->t)))) continue;
        t = r->next <= results ? t : end;
        Arrival arrival = integrate_to(n->c, t, 1);
        if (arrival == FAILED) return NATIVE_FAILED;
        if (arrival == AT_EVENT) note_step(n, r);
        if (arrival == AT_EVENT || s->t < t) r->next--;
        if (arrival == AT_EVENT) continue;
        if (s->t < t) return NATIVE_PAUSED;
        if (write_point(n, r) != NATIVE_OK) return NATIVE_FAILED;
    }
    return last_instant(n, r, width);
}

/* Runs to `end`, with results at `results` equal distances. All counts of `run` are zero at first. */
EXPORTED int native_run(Native *n, double end, int64_t results, NativeRun *run) {
    if (run->n_segments == 0) {
        run->begin = n->c->state.t;
        run->next = 1;
    }
    if (!check_whole(n->c, (end - run->begin) / (double)results) || find_outputs(n, run) != NATIVE_OK)
        return NATIVE_FAILED;
    n->run = run;
    n->pause = run->steps > 0 ? n->c->state.n_steps + (double)run->steps : INFINITY;
    n->c->noted = note_event;
    n->c->struck = note_impact;
    n->c->step_finished = pause_after;
    int result = run_on(n, end, results, run);
    n->run = NULL;
    n->c->step_finished = NULL;
    return result;
}
