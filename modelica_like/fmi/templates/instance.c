/* Instances: memory, logging, copies of their state. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "core.h"

#define MESSAGE_LENGTH 512

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

static size_t larger(size_t a, size_t b) { return a > b ? a : b; }

/* Lays all work arrays out in one block; with memory == NULL only measures it. */
static size_t lay_out(Work *w, double *memory) {
    size_t used = 0, small = larger(larger(N_GUARDS, N_MOMENTS), larger(larger(N_START_MODES, N_D), N_DERIVED));
    size_t qr_v = larger((size_t)pattern_step.n_v, (size_t)pattern_start.n_v),
           qr_r = larger((size_t)pattern_step.n_r, (size_t)pattern_start.n_r);
    size_t rows = larger((size_t)pattern_step.size, (size_t)pattern_start.size);
    size_t square = larger(START_STEADY ? 2 * (size_t)(N_STEADY + N_Z) * (N_STEADY + N_Z) : 0, (size_t)N_RESETS * N_X);
    size_t sharing = (size_t)MOST_MEMBERS * (N_X + 3 * MOST_MEMBERS);
    struct {
        double **array;
        size_t size;
    } arrays[] = {
        {&w->slots, N_SLOTS},
        {&w->dots, 3 * (size_t)N_SLOTS},
        {&w->jacobian, larger(N_JACOBIAN, N_START_JACOBIAN)},
        {&w->matrix, (size_t)pattern_step.n_nonzeros},
        {&w->qr_v, qr_v},
        {&w->qr_r, qr_r},
        {&w->qr_beta, rows},
        {&w->qr_work, rows},
        {&w->stages, 9 * (size_t)AT_LEAST_ONE(N_UNKNOWNS)},
        {&w->point, N_UNKNOWNS},
        {&w->variables, N_NODES},
        {&w->guards, small},
        {&w->guards_before, 9 * (size_t)N_GUARDS},
        {&w->rhs, larger(N_UNKNOWNS, N_DETERMINANTS)},
        {&w->dense_matrix, (size_t)N_Z * N_Z},
        {&w->square, larger(square, sharing)},
        {&w->vector, N_UNKNOWNS + (size_t)N_Z},
        {&w->start_unknowns, N_START_UNKNOWNS},
        {&w->start_values, N_STARTS},
        {&w->start_residual, larger(N_START_VALUES, N_RESETS)},
    };
    for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) {
        if (memory != NULL) *arrays[k].array = memory + used;
        used += arrays[k].size + 1;
    }
    return used;
}

void instance_reset(Instance *c) {
    State *s = &c->state;
    memset(s, 0, sizeof *s);
    s->phase = PHASE_INSTANTIATED;
    s->tolerance = DEFAULT_TOLERANCE;
    c->variables_valid = 0;
    start_defaults(c);
}

Instance *instance_new(const char *name, const char *token, void *(*allocate)(size_t, size_t), void (*release)(void *),
    LogFunction log, AnyFunction logger, void *environment, int logging) {
    Instance bare = {0}, *c;
    size_t length = name == NULL ? 0 : strlen(name);
    bare.log = log;
    bare.logger = logger;
    bare.environment = environment;
    bare.name = (char *)(length ? name : "?");
    if (length == 0) {
        report(&bare, LOG_ERROR, RESULT_ERROR, "The instance needs a name.");
        return NULL;
    }
    if (token == NULL || strcmp(token, model_token) != 0) {
        report(&bare, LOG_ERROR, RESULT_ERROR, "The instantiation token is that of another export of the model.");
        return NULL;
    }
    c = allocate(1, sizeof *c);
    if (c == NULL) return NULL;
    *c = bare;
    c->memory = allocate(lay_out(&c->work, NULL), sizeof(double));
    c->name = allocate(length + 1, 1);
    if (c->memory == NULL || c->name == NULL) {
        if (c->memory != NULL) release(c->memory);
        if (c->name != NULL) release(c->name);
        release(c);
        report(&bare, LOG_ERROR, RESULT_ERROR, "There is not enough memory.");
        return NULL;
    }
    memcpy(c->name, name, length + 1);
    lay_out(&c->work, c->memory);
    memcpy(c->work.slots + SLOT_CONSTANTS, model_constants, N_CONSTANTS * sizeof(double));
    c->log_enabled = logging ? LOG_ERROR | LOG_WARNING | LOG_EVENTS : LOG_ERROR;
    c->allocate = allocate;
    c->release = release;
    instance_reset(c);
    return c;
}

void instance_free(Instance *c) {
    void (*release)(void *) = c->release;
    release(c->memory);
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

static Header header_of(const State *s) {
    Header h = {"MLSTATE", sizeof(State), 0, 0};
    h.model = hash((const unsigned char *)model_token, strlen(model_token));
    h.check = hash((const unsigned char *)s, sizeof *s);
    return h;
}

Result state_copy_out(Instance *c, void **copy) {
    if (*copy == NULL) *copy = c->allocate(1, sizeof(State));
    if (*copy == NULL) return report(c, LOG_ERROR, RESULT_ERROR, "There is not enough memory for a copy of the state.");
    memcpy(*copy, &c->state, sizeof(State));
    return RESULT_OK;
}

Result state_copy_in(Instance *c, const void *copy) {
    memcpy(&c->state, copy, sizeof(State));
    c->variables_valid = 0;
    return RESULT_OK;
}

void state_release(Instance *c, void **copy) {
    if (*copy != NULL) c->release(*copy);
    *copy = NULL;
}

size_t state_size(void) { return sizeof(Header) + sizeof(State); }

Result state_write(Instance *c, const void *copy, unsigned char *bytes, size_t size) {
    Header h = header_of(copy);
    if (size < state_size())
        return report(c, LOG_ERROR, RESULT_ERROR, "The state needs %zu bytes, not %zu.", state_size(), size);
    memcpy(bytes, &h, sizeof h);
    memcpy(bytes + sizeof h, copy, sizeof(State));
    return RESULT_OK;
}

Result state_read(Instance *c, const unsigned char *bytes, size_t size, void **copy) {
    Header h, expected;
    State s;
    if (size != state_size())
        return report(c, LOG_ERROR, RESULT_ERROR, "A state of this model has %zu bytes, not %zu.", state_size(), size);
    memcpy(&h, bytes, sizeof h);
    memcpy(&s, bytes + sizeof h, sizeof s);
    expected = header_of(&s);
    if (memcmp(&h, &expected, sizeof h) != 0)
        return report(c, LOG_ERROR, RESULT_ERROR,
            "These bytes are no state of this model: it is another model's, or they are damaged.");
    *copy = c->allocate(1, sizeof(State));
    if (*copy == NULL) return report(c, LOG_ERROR, RESULT_ERROR, "There is not enough memory for a copy of the state.");
    memcpy(*copy, &s, sizeof s);
    return RESULT_OK;
}
