/* Instances: memory, logging, copies of their state. */
#include <stdarg.h>
#include "core.h"

#define FAILURE(name, sentence) sentence "\0"
static const char sentences[] = /* one after the other: no table of addresses */
#include "codes.h"
    ;
#undef FAILURE

static const char *const categories[] = {
    "logStatusError", "logStatusWarning", "logEvents", "logIntegrator"}; /* by the bits of LogCategory */
enum { N_CATEGORIES = sizeof categories / sizeof categories[0] };

/* Errors are always told, the rest if its category is on. Returns `result`. */
Result report(Instance *c, LogCategory category, Result result, const char *format, ...) {
    char message[MESSAGE_LENGTH];
    int bit = 0;
    va_list arguments;
    if (c->log == NULL || c->passing || (category != LOG_ERROR && !(c->log_enabled & category))) return result;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    while ((int)category != 1 << bit) bit++;
    c->log(c, (int)result, categories[bit], message);
    return result;
}

static const char *name_of(const Model *m, char kind, double place) {
    int k = place < INT32_MAX ? (int)place : 0;
    const Variable *v = kind == 'V' ? find_variable(m, (uint32_t)place) : NULL;
    switch (kind) {
        case 'A': return text_of(m, m->rising[k].above_name);
        case 'B': return text_of(m, m->singular_names[k]);
        case 'C': return text_of(m, m->rising[k].below_name);
        case 'D': return text_of(m, m->delays[k].name);
        case 'I': return text_of(m, m->ideals[k].name);
        case 'N': return text_of(m, m->transitions[k].notice);
        case 'S': return text_of(m, m->state_names[k]);
        case 'T': return text_of(m, m->transitions[k].name);
        case 'Z': return text_of(m, m->implicit_names[k]);
        case 'X':
            for (const Variable *one = m->variables; one < m->variables + m->n_variables; one++)
                if (one->kind == KIND_VARIABLE && one->index == k) v = one;
            break;
        case 'E':
            for (const Variable *one = m->variables; one < m->variables + m->n_variables; one++)
                if (one->kind <= KIND_VARIABLE && one->start == k) v = one;
    }
    return v == NULL ? "anything" : text_of(m, v->name);
}

/* Fails, with values in the order of the sentence; keeps what it is about, for native.c. */
Result fail_with(Instance *c, FailureCode code, double v0, double v1, double v2) {
    const double all[] = {v0, v1, v2}, *value = all;
    char message[MESSAGE_LENGTH + 1];
    Failure failure = {.code = code, .place = -1};
    double *number = failure.numbers;
    size_t used = 0;
    const char *s = sentences;
    if (c->trying) return c->tried = (Refusal){code, {v0, v1, v2}}, RESULT_ERROR;
    for (int k = 0; k < (int)code; k++) s += strlen(s) + 1;
    for (; *s != 0 && used < MESSAGE_LENGTH; s++) {
        if (*s != '%') {
            message[used++] = *s;
            continue;
        }
        char *here = message + used;
        size_t room = MESSAGE_LENGTH - used;
        if (*++s == 'g') *number++ = *value;
        else if (*s != 'C') failure.place = *value;
        if (*s == 'g' || *s == 'R') used += (size_t)snprintf(here, room, "%.10g", *value);
        else used += (size_t)snprintf(here, room, "%s", name_of(c->model, *s, failure.place));
        value += *s != 'C';
    }
    message[used < MESSAGE_LENGTH ? used : MESSAGE_LENGTH] = 0;
    report(c, LOG_ERROR, RESULT_ERROR, "%s", message);
    if (!c->passing) c->failure = failure;
    return RESULT_ERROR;
}

Result set_log_category(Instance *c, const char *category, int on) {
    unsigned chosen = category == NULL || strcmp(category, "logAll") == 0 ? LOG_ALL : 0;
    for (int k = 0; k < N_CATEGORIES && chosen == 0; k++)
        if (strcmp(category, categories[k]) == 0) chosen = 1u << k;
    if (chosen == 0) return refuse(c, "There is no log category '%.100s'.", category);
    c->log_enabled = on ? c->log_enabled | chosen : c->log_enabled & ~chosen;
    return RESULT_OK;
}

Result allowed(Instance *c, const char *function, int phases) {
    static const char *const names[] = {"the instance is not initialized", "the instance is in initialization mode",
        "the instance is in event mode", "the instance is in continuous-time mode",
        "the instance is between communication steps", "the run has been terminated",
        "the instance is in configuration mode", "an earlier call failed: reset or free the instance"}; /* as Phase */
    int phase = 0;
    if (c->state.phase & phases) return RESULT_OK;
    while (!(c->state.phase >> phase & 1)) phase++;
    return refuse(c, "%s is not allowed now: %s.", function, names[phase]);
}

static uint64_t larger(uint64_t a, uint64_t b) { return a > b ? a : b; }

/* The next part of the memory, for an array; without memory it is only measured. Cold: small for many arrays. */
__attribute__((cold)) static void *take(double *memory, uint64_t *used, uint64_t size, uint64_t bytes) {
    uint64_t first = *used;
    *used += (size * bytes + 7) / 8 + 1;
    return memory == NULL ? NULL : memory + first;
}
#define TAKE(array, size) array = take(memory, &used, size, sizeof *(array))

/* Lays out everything in one block, the state first; returns its size in doubles. */
static uint64_t lay_out(Instance *c, double *memory) {
    const Model *m = c->model;
    Strike *strike = &c->strike;
    uint64_t n = m->n_unknowns, n_x = m->n_x, n_z = m->n_z, n_d = m->n_d, holds = m->n_holds, guards = m->n_guards;
    uint64_t starts = m->n_starts, slots = m->n_slots, delays = m->n_delays, used = 0, left = 0, room = 0;
    uint64_t members = m->most_members + 1, ideal = m->n_ideals > 0 ? n_z : 0, dense = n_z * n_z;
    uint64_t jacobian = larger(m->n_jacobian, m->start.n_nonzeros), system = larger(n, m->start.size);
    uint64_t last = 2 * n + 1 - (uint64_t)m->lu.n_ends;
    uint64_t steady = m->settings->steady ? m->n_steady : 0, edges = m->tapes.edges.n_outputs;
    uint64_t resets = larger(larger(m->n_resets, m->n_reset_values), larger(m->n_updates, holds + m->n_ideals));
    uint64_t small = larger(larger(guards, m->n_moments), larger(larger(m->n_start_modes, n_d), m->n_derived));
    uint64_t outputs = larger(larger(n, m->n_nodes), larger(larger(m->n_derived, m->n_moments), 2 * guards));
    uint64_t square = larger(larger(2 * steady * steady, resets * n_x), members * (n_x + 3 * members));
    square = larger(square, ideal * (ideal + 2));
#define OF_INSTANCE(name, size) TAKE(c->name, size)
#define OF_STRIKE(name, size) TAKE(strike->name, size)
    SMOOTH_NUMBERS(OF_INSTANCE);
    c->n_smooth = (size_t)used;
    TAKE(c->end_look, m->settings->fixed_step > 0 ? 2 * guards : 0);
    TAKE(c->noise, guards);
    TAKE(c->past, delays > 0 ? MOST_PAST * (2 + delays) : 0);
    TAKE(c->past_sizes, delays);
    STATE_MARKS(OF_INSTANCE);
    c->piece = take(memory, &used, piece_size(m), 1);
    c->n_numbers = (size_t)used;
    for (int k = 0; k < N_SPECIALS; k++) {
        const Tape *tape = tapes_of(m) + k;
        left += tape->n_operations; /* among the slots, behind all others */
        room += 4 * (uint64_t)tape->n_operations + 2 * (uint64_t)tape->n_outputs;
    }
    c->most_known = (int)(left * MORE_KNOWN < MORE_OPERATIONS ? left * MORE_KNOWN : MORE_OPERATIONS);
    c->most_room = (size_t)(room * MORE_SETS < 16 * MORE_OPERATIONS ? room * MORE_SETS : 16 * MORE_OPERATIONS);
    left += (uint64_t)c->most_known;
    c->n_bars = (size_t)m->n_slots + (size_t)left;
    TAKE(c->room, room + c->most_room);
    TAKE(c->special, N_SETS * N_SPECIALS);
    Special *part = &c->part; /* of guards */
    TAKE(part->runs, m->tapes.guards.n_operations);
    TAKE(part->operands, m->tapes.guards.n_operations);
    TAKE(part->outputs, 2 * guards);
    TAKE(part->wanted, 2 * guards);
    c->whole = take(memory, &used, piece_size(m), 1);
    TAKE(c->terms, holds);
    TAKE(c->strike_terms, holds);
    STRIKE_NUMBERS(OF_STRIKE), STRIKE_MARKS(OF_STRIKE);
    WORK_NUMBERS(OF_INSTANCE), WORK_INDICES(OF_INSTANCE), WORK_MARKS(OF_INSTANCE);
    return used;
}

void instance_reset(Instance *c) {
    const Model *m = c->model;
    State *s = &c->state;
    memset(s, 0, sizeof *s);
    memset(c->numbers, 0, c->n_numbers * sizeof(double));
    s->phase = PHASE_INSTANTIATED;
    s->tolerance = m->settings->default_tolerance;
    s->absolute = s->tolerance * m->settings->absolute_to_relative;
    c->variables_valid = c->look_valid = c->edges_valid = 0;
    c->next_by = 0;
    gradient_end(c);
    memcpy(c->p, m->parameters, m->n_p * sizeof(double));
    memcpy(c->u, m->inputs, m->n_u * sizeof(double));
    memcpy(c->x, m->guesses, m->n_unknowns * sizeof(double));
}

/* An instance of a model, which must outlive it; NULL, with a message in the log, if there is none. `bare` has the
 * model, a name, and what belongs to the caller; log_enabled tells whether there is to be logged more than errors. */
Instance *instance_new(Instance bare, const char *token) {
    const Model *m = bare.model;
    const char *name = bare.name;
    if (name == NULL || *name == 0) bare.name = "?";
    bare.log_enabled = bare.log_enabled ? LOG_ERROR | LOG_WARNING | LOG_EVENTS : LOG_ERROR;
    if (name != bare.name) return refuse(&bare, "The instance needs a name."), NULL;
    if (token == NULL || strcmp(token, m->token) != 0)
        return refuse(&bare, "The instantiation token is that of another export of the model."), NULL;
    Instance measured = bare;
    size_t length = strlen(name) + 1, head = (sizeof bare + length) / sizeof(double) + 1;
    uint64_t size = head + lay_out(&measured, NULL);
    Instance *c = size > SIZE_MAX / sizeof(double) ? NULL : bare.allocate((size_t)size, sizeof(double));
    if (c == NULL) return fail(&bare, NO_MEMORY, 0), NULL;
    *c = bare;
    c->name = memcpy(c + 1, name, length);
    c->numbers = (double *)(void *)c + head;
    lay_out(c, c->numbers);
    c->z = c->x + m->n_x;
    const double *values[N_KINDS] = {&c->state.t, c->x, c->seen_rates, c->variables, c->p, c->seen_derived, c->u, c->d,
        c->seen_indicators}; /* as Kind */
    memcpy(c->values, values, sizeof values);
    memset(c->every, 1, (size_t)m->n_guards);
    c->altered = 1;
    c->fixed_moments = has_fixed_moments(m);
    memcpy(c->slots + m->slot_constants, m->constants, (size_t)m->n_constants * sizeof(double));
    memset(c->known_slots + m->slot_constants, 1, (size_t)m->n_constants);
    for (int k = m->slot_constants; k < m->slot_results; k++) c->same[k] = c->places_of_slots[k] = k;
    instance_reset(c);
    return c;
}

/* The same with a model of its own: the one that is compiled in, or else the one in the folder of resources. */
Instance *instance_open(Instance bare, const char *token, const char *location) {
    char message[MESSAGE_LENGTH];
    Model *own = model_data_size > 0 ? model_read((const unsigned char *)model_data, model_data_size, bare.allocate,
                                           bare.release, message)
                                     : model_open(location, bare.allocate, bare.release, message);
    if (own == NULL && bare.name == NULL) bare.name = "?";
    if (own == NULL) return refuse(&bare, "%s", message), NULL;
    if (model_data_size > 0 && model_codes != NULL) use_codes(own, model_codes);
    bare.model = own;
    Instance *c = instance_new(bare, token);
    if (c == NULL) model_free(own);
    else c->own_model = own;
    return c;
}

void instance_free(Instance *c) {
    gradient_end(c);
    if (c->own_model != NULL) model_free(c->own_model);
    c->release(c);
}

Result set_experiment(
    Instance *c, int tolerance_defined, double tolerance, double start, int stop_defined, double stop) {
    State *s = &c->state;
    if (!isfinite(start) || (stop_defined && !(stop >= start))) return fail(c, SPAN, start, stop);
    if (tolerance_defined && !(tolerance > 0 && tolerance < 1)) return fail(c, TOLERANCE, tolerance);
    if (tolerance_defined) s->tolerance = tolerance;
    if (tolerance_defined) s->absolute = tolerance * c->model->settings->absolute_to_relative;
    s->t = s->start_time = s->u_time = start;
    s->stop_time_defined = stop_defined && isfinite(stop);
    s->stop_time = s->stop_time_defined ? stop : 0;
    return RESULT_OK;
}

typedef struct {
    char magic[8];
    uint64_t size, model, check;
} Header;

static size_t copy_size(const Instance *c) { return sizeof(State) + c->n_numbers * sizeof(double); }

static Header header_of(const Instance *c, const void *copy) {
    const unsigned char *token = (const unsigned char *)c->model->token;
    return (Header){"MLSTAT3", copy_size(c), crc32_of(token, (size_t)c->model->n_token), crc32_of(copy, copy_size(c))};
}

Result state_copy_out(Instance *c, void **copy) {
    if (*copy == NULL) *copy = c->allocate(1, copy_size(c));
    if (*copy == NULL) return fail(c, NO_MEMORY, 0);
    memcpy(*copy, &c->state, sizeof(State));
    memcpy((char *)*copy + sizeof(State), c->numbers, c->n_numbers * sizeof(double));
    return RESULT_OK;
}

Result state_copy_in(Instance *c, const void *copy) {
    memcpy(&c->state, copy, sizeof(State));
    memcpy(c->numbers, (const char *)copy + sizeof(State), c->n_numbers * sizeof(double));
    c->variables_valid = c->look_valid = c->edges_valid = 0;
    c->next_by = 0;
    gradient_lose(c, FAILURE_LOST_BY_COPY);
    return RESULT_OK;
}

Result state_release(Instance *c, void **copy) {
    if (copy != NULL && *copy != NULL) c->release(*copy);
    if (copy != NULL) *copy = NULL;
    return RESULT_OK;
}

size_t state_size(const Instance *c) { return sizeof(Header) + copy_size(c); }

Result state_write(Instance *c, const void *copy, unsigned char *bytes, size_t size) {
    Header h = header_of(c, copy);
    if (size < state_size(c)) return refuse(c, "The state needs %zu bytes, not %zu.", state_size(c), size);
    memcpy(bytes, &h, sizeof h);
    memcpy(bytes + sizeof h, copy, copy_size(c));
    return RESULT_OK;
}

Result state_read(Instance *c, const unsigned char *bytes, size_t size, void **copy) {
    if (size != state_size(c)) return refuse(c, "A state of this model has %zu bytes, not %zu.", state_size(c), size);
    Header h = header_of(c, bytes + sizeof h);
    if (memcmp(&h, bytes, sizeof h) != 0)
        return refuse(c, "These bytes are not a state of this model: it is another model's, or they are damaged.");
    *copy = NULL;
    if (!state_copy_out(c, copy)) return RESULT_ERROR;
    memcpy(*copy, bytes + sizeof h, copy_size(c));
    return RESULT_OK;
}
