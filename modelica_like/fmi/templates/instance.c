/* Instances: memory, logging, copies of their state. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "core.h"

static const struct {
    LogCategory category;
    const char *name;
} categories[] = {
    {LOG_ERROR, "logStatusError"},
    {LOG_WARNING, "logStatusWarning"},
    {LOG_EVENTS, "logEvents"},
    {LOG_INTEGRATOR, "logIntegrator"},
};
enum { N_CATEGORIES = sizeof categories / sizeof categories[0] };

/* ---- logging ---------------------------------------------------------------------------------------------------- */

/* Errors are always told, the rest if its category is on. Returns `result`. */
Result report(Instance *c, LogCategory category, Result result, const char *format, ...) {
    char message[MESSAGE_LENGTH];
    const char *name = "";
    va_list arguments;
    if (c->log == NULL || (category != LOG_ERROR && !(c->log_enabled & category))) return result;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    for (int k = 0; k < N_CATEGORIES; k++)
        if (categories[k].category == category) name = categories[k].name;
    c->log(c, (int)result, name, message);
    return result;
}

Result set_log_category(Instance *c, const char *category, int on) {
    unsigned chosen = 0;
    if (category == NULL || strcmp(category, "logAll") == 0) chosen = LOG_ALL;
    else
        for (int k = 0; k < N_CATEGORIES; k++)
            if (strcmp(category, categories[k].name) == 0) chosen = categories[k].category;
    if (chosen == 0) return report(c, LOG_ERROR, RESULT_ERROR, "There is no log category '%.100s'.", category);
    c->log_enabled = on ? c->log_enabled | chosen : c->log_enabled & ~chosen;
    return RESULT_OK;
}

static const char *phase_name(int phase) {
    switch (phase) {
        case PHASE_INSTANTIATED: return "the instance is not initialized";
        case PHASE_CONFIGURATION: return "the instance is in configuration mode";
        case PHASE_INITIALIZATION: return "the instance is in initialization mode";
        case PHASE_EVENT: return "the instance is in event mode";
        case PHASE_CONTINUOUS: return "the instance is in continuous-time mode";
        case PHASE_STEP: return "the instance is between communication steps";
        case PHASE_TERMINATED: return "the run has been terminated";
        default: return "an earlier call failed: reset or free the instance";
    }
}

Result allowed(Instance *c, const char *function, int phases) {
    if (c->state.phase & phases) return RESULT_OK;
    return report(c, LOG_ERROR, RESULT_ERROR, "%s is not allowed now: %s.", function, phase_name(c->state.phase));
}

/* ---- memory ----------------------------------------------------------------------------------------------------- */

static uint64_t larger(uint64_t a, uint64_t b) { return a > b ? a : b; }

#define DOUBLES(array, n) {&(array), (uint64_t)(n)}
#define INTEGERS(array, n) {&(array), ((uint64_t)(n) + 1) / 2}
#define BYTES(array, n) {&(array), ((uint64_t)(n) + 7) / 8}

/* Lays arrays out in one block, the numbers of the state first; with memory == NULL only measures it, in doubles. */
static uint64_t lay_out(Instance *c, double *memory) {
    const Model *m = c->model;
    Work *w = &c->work;
    uint64_t used = 0, n = (uint64_t)m->n_unknowns, n_x = (uint64_t)m->n_x, n_z = (uint64_t)m->n_z;
    uint64_t small = larger(larger((uint64_t)m->n_guards, (uint64_t)m->n_moments),
        larger(larger((uint64_t)m->n_start_modes, (uint64_t)m->n_d), (uint64_t)m->n_derived));
    uint64_t steady = (uint64_t)m->n_steady + n_z, members = (uint64_t)m->most_members;
    uint64_t resets = larger((uint64_t)m->n_resets, (uint64_t)m->n_reset_values);
    uint64_t square =
        larger(larger(m->settings->steady ? 2 * steady * steady : 0, resets * n_x), members * (n_x + 3 * members));
    struct {
        void *array;
        uint64_t size;
    } arrays[] = {
        DOUBLES(c->x, n_x),
        DOUBLES(c->z, n_z),
        DOUBLES(c->p, m->n_p),
        DOUBLES(c->u, m->n_u),
        DOUBLES(c->d, m->n_d),
        DOUBLES(c->u_rate, m->n_u),
        DOUBLES(c->start_value, m->n_starts),
        DOUBLES(c->piece, 2 + 5 * n),
        DOUBLES(c->looks, m->settings->fixed_step > 0 ? 2 * (uint64_t)m->n_guards : 0),
        BYTES(c->start_given, m->n_starts),
        BYTES(c->mode_given, m->n_d),
        BYTES(c->wanting, m->n_transitions),
        DOUBLES(w->slots, m->n_slots),
        DOUBLES(w->dots, m->n_slots),
        DOUBLES(w->jacobian, larger((uint64_t)m->n_jacobian, (uint64_t)m->n_start_jacobian)),
        DOUBLES(w->matrix, m->step.n_nonzeros),
        DOUBLES(w->qr_v, larger((uint64_t)m->step.n_v, (uint64_t)m->start.n_v)),
        DOUBLES(w->qr_r, larger((uint64_t)m->step.n_r, (uint64_t)m->start.n_r)),
        DOUBLES(w->qr_beta, larger(n, (uint64_t)m->start.size)),
        DOUBLES(w->qr_work, larger(n, (uint64_t)m->start.size)),
        DOUBLES(w->stages, 9 * n),
        DOUBLES(w->point, n),
        DOUBLES(w->variables, m->n_nodes),
        DOUBLES(w->guards, small),
        DOUBLES(w->guards_before, 9 * (uint64_t)m->n_guards),
        DOUBLES(w->rhs, larger(n, (uint64_t)m->n_determinants)),
        DOUBLES(w->dense_matrix, n_z * n_z),
        DOUBLES(w->square, square),
        DOUBLES(w->vector, n + n_z),
        DOUBLES(w->residual, n_z),
        DOUBLES(w->start_unknowns, m->n_start_unknowns),
        DOUBLES(w->start_values, m->n_starts),
        DOUBLES(w->start_residual, larger((uint64_t)m->n_start_values, resets)),
        INTEGERS(w->order, n_z),
        BYTES(w->known, n_x),
        BYTES(w->decided, m->n_d),
        BYTES(w->wanting, m->n_transitions),
        DOUBLES(w->d_before, m->n_d),
        DOUBLES(w->x_before, n_x),
        DOUBLES(w->d_fired, m->n_d),
        DOUBLES(w->reset_values, resets),
        DOUBLES(w->target_values, resets),
        INTEGERS(w->targets, resets),
        BYTES(w->changed, m->n_modes),
        DOUBLES(w->first, n),
        DOUBLES(w->whole, 2 + 5 * n),
        BYTES(w->kinds, m->n_guards),
        DOUBLES(w->terms, 4 * (uint64_t)m->n_holds),
        DOUBLES(w->strike_terms, 4 * (uint64_t)m->n_holds),
        BYTES(w->held, m->n_holds),
        BYTES(w->other, members),
        DOUBLES(w->weights, m->n_holds),
        DOUBLES(w->base_weights, m->n_holds),
        DOUBLES(w->use, m->n_holds),
        DOUBLES(w->best, m->n_d),
        DOUBLES(w->kept_z, n_z),
        DOUBLES(w->reactions, members),
        DOUBLES(w->sizes, members),
        DOUBLES(w->zeros, members),
        INTEGERS(w->places, members + 1),
        INTEGERS(w->member, members + 1),
        INTEGERS(w->pivots, members),
        DOUBLES(w->strike.before, m->n_holds),
        DOUBLES(w->strike.approach, m->n_holds),
        DOUBLES(w->strike.impulse, m->n_holds),
        DOUBLES(w->strike.reaction, m->n_holds),
        BYTES(w->strike.entering, m->n_holds),
        BYTES(w->strike.loose, m->n_holds),
        BYTES(w->strike.held, m->n_holds),
        BYTES(w->strike.knocked, m->n_holds),
        DOUBLES(w->strike.jump, n_x),
        DOUBLES(w->impacts.x, n_x),
        BYTES(w->impacts.entered, m->n_holds),
        DOUBLES(w->respond_d, m->n_d),
        DOUBLES(w->respond_z, n_z),
        DOUBLES(w->rates, n_x),
        DOUBLES(w->x_kept, n_x),
    };
    for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) {
        double *place = memory == NULL ? NULL : memory + used;
        memcpy(arrays[k].array, &place, sizeof place);
        used += arrays[k].size + 1;
        if (arrays[k].array == (void *)&c->wanting) c->n_numbers = (size_t)used;
    }
    return used;
}

void instance_reset(Instance *c) {
    State *s = &c->state;
    memset(s, 0, sizeof *s);
    memset(c->numbers, 0, c->n_numbers * sizeof(double));
    s->phase = PHASE_INSTANTIATED;
    s->tolerance = c->model->settings->default_tolerance;
    c->variables_valid = 0;
    start_defaults(c);
}

static Instance *instance_make(const Instance *bare) {
    const Model *m = bare->model;
    size_t length = strlen(bare->name);
    Instance measured = *bare, *c = bare->allocate(1, sizeof *c);
    uint64_t size = lay_out(&measured, NULL);
    if (c == NULL) return NULL;
    *c = *bare;
    c->numbers = size > SIZE_MAX / sizeof(double) ? NULL : bare->allocate((size_t)size, sizeof(double));
    c->name = bare->allocate(length + 1, 1);
    if (c->numbers == NULL || c->name == NULL) {
        if (c->numbers != NULL) bare->release(c->numbers);
        if (c->name != NULL) bare->release(c->name);
        bare->release(c);
        return NULL;
    }
    memcpy(c->name, bare->name, length + 1);
    lay_out(c, c->numbers);
    memcpy(c->work.slots + m->slot_constants, m->constants, (size_t)m->n_constants * sizeof(double));
    instance_reset(c);
    return c;
}

/* An instance of a model, which must outlive it; NULL, with a message in the log, if there is none. */
Instance *instance_new(const Model *model, const char *name, const char *token, Allocate allocate, Release release,
    LogFunction log, AnyFunction logger, void *environment, int logging) {
    Instance bare = {0}, *c;
    bare.model = model;
    bare.log = log;
    bare.logger = logger;
    bare.environment = environment;
    bare.name = (char *)(name == NULL || *name == 0 ? "?" : name);
    bare.allocate = allocate;
    bare.release = release;
    bare.log_enabled = logging ? LOG_ERROR | LOG_WARNING | LOG_EVENTS : LOG_ERROR;
    if (name == NULL || *name == 0) {
        report(&bare, LOG_ERROR, RESULT_ERROR, "The instance needs a name.");
        return NULL;
    }
    if (token == NULL || strcmp(token, model->token) != 0) {
        report(&bare, LOG_ERROR, RESULT_ERROR, "The instantiation token is that of another export of the model.");
        return NULL;
    }
    c = instance_make(&bare);
    if (c == NULL) report(&bare, LOG_ERROR, RESULT_ERROR, "There is not enough memory.");
    return c;
}

/* The same with a model of its own: the one that is compiled in, or else the one in the folder of resources. */
Instance *instance_open(const char *location, const char *name, const char *token, Allocate allocate, Release release,
    LogFunction log, AnyFunction logger, void *environment, int logging) {
    char message[MESSAGE_LENGTH];
    Instance bare = {0}, *c;
    Model *model = model_data_size > 0
                       ? model_read((const unsigned char *)model_data, model_data_size, allocate, release, message)
                       : model_open(location, allocate, release, message);
    bare.log = log;
    bare.logger = logger;
    bare.environment = environment;
    bare.name = (char *)(name == NULL || *name == 0 ? "?" : name);
    if (model == NULL) {
        report(&bare, LOG_ERROR, RESULT_ERROR, "%s", message);
        return NULL;
    }
    c = instance_new(model, name, token, allocate, release, log, logger, environment, logging);
    if (c == NULL) model_free(model);
    else c->own_model = model;
    return c;
}

void instance_free(Instance *c) {
    Release release = c->release;
    if (c->own_model != NULL) model_free(c->own_model);
    release(c->numbers);
    release(c->name);
    release(c);
}

Result set_experiment(
    Instance *c, int tolerance_defined, double tolerance, double start, int stop_defined, double stop) {
    State *s = &c->state;
    if (!isfinite(start) || (stop_defined && !(stop >= start)))
        return report(c, LOG_ERROR, RESULT_ERROR,
            "The start time %g s must be finite and not after the stop time %g s.", start, stop);
    if (tolerance_defined && !(tolerance > 0 && tolerance < 1))
        return report(c, LOG_ERROR, RESULT_ERROR, "The tolerance must be between 0 and 1, not %g.", tolerance);
    if (tolerance_defined) s->tolerance = tolerance;
    s->t = s->start_time = s->u_time = start;
    s->stop_time_defined = stop_defined && isfinite(stop);
    s->stop_time = s->stop_time_defined ? stop : 0;
    return RESULT_OK;
}

/* ---- copies of the state ---------------------------------------------------------------------------------------- */

typedef struct {
    char magic[8];
    uint64_t size, model, check;
} Header;

static uint64_t hash(const unsigned char *bytes, size_t size) { /* FNV-1a */
    uint64_t value = 14695981039346656037u;
    for (size_t k = 0; k < size; k++) value = (value ^ bytes[k]) * 1099511628211u;
    return value;
}

/* A copy is the state, and then its numbers. */
static size_t copy_size(const Instance *c) { return sizeof(State) + c->n_numbers * sizeof(double); }

static Header header_of(const Instance *c, const void *copy) {
    Header h = {"MLSTATE", copy_size(c), 0, 0};
    h.model = hash((const unsigned char *)c->model->token, strlen(c->model->token));
    h.check = hash(copy, copy_size(c));
    return h;
}

Result state_copy_out(Instance *c, void **copy) {
    if (*copy == NULL) *copy = c->allocate(1, copy_size(c));
    if (*copy == NULL) return report(c, LOG_ERROR, RESULT_ERROR, "There is not enough memory for a copy of the state.");
    memcpy(*copy, &c->state, sizeof(State));
    memcpy((char *)*copy + sizeof(State), c->numbers, c->n_numbers * sizeof(double));
    return RESULT_OK;
}

Result state_copy_in(Instance *c, const void *copy) {
    memcpy(&c->state, copy, sizeof(State));
    memcpy(c->numbers, (const char *)copy + sizeof(State), c->n_numbers * sizeof(double));
    c->variables_valid = 0;
    return RESULT_OK;
}

void state_release(Instance *c, void **copy) {
    if (*copy != NULL) c->release(*copy);
    *copy = NULL;
}

size_t state_size(const Instance *c) { return sizeof(Header) + copy_size(c); }

Result state_write(Instance *c, const void *copy, unsigned char *bytes, size_t size) {
    Header h = header_of(c, copy);
    if (size < state_size(c))
        return report(c, LOG_ERROR, RESULT_ERROR, "The state needs %zu bytes, not %zu.", state_size(c), size);
    memcpy(bytes, &h, sizeof h);
    memcpy(bytes + sizeof h, copy, copy_size(c));
    return RESULT_OK;
}

Result state_read(Instance *c, const unsigned char *bytes, size_t size, void **copy) {
    Header h, expected;
    if (size != state_size(c))
        return report(c, LOG_ERROR, RESULT_ERROR, "A state of this model has %zu bytes, not %zu.", state_size(c), size);
    memcpy(&h, bytes, sizeof h);
    expected = header_of(c, bytes + sizeof h);
    if (memcmp(&h, &expected, sizeof h) != 0)
        return report(c, LOG_ERROR, RESULT_ERROR,
            "These bytes are no state of this model: it is another model's, or they are damaged.");
    *copy = c->allocate(1, copy_size(c));
    if (*copy == NULL) return report(c, LOG_ERROR, RESULT_ERROR, "There is not enough memory for a copy of the state.");
    memcpy(*copy, bytes + sizeof h, copy_size(c));
    return RESULT_OK;
}
