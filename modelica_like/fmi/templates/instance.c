/* Instances: memory, logging, copies of their state. */
#include <stdarg.h>
#include "core.h"

static const char *const categories[] = {
    "logStatusError", "logStatusWarning", "logEvents", "logIntegrator"}; /* by the bits of LogCategory */
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
        if ((int)category == 1 << k) name = categories[k];
    c->log(c, (int)result, name, message);
    return result;
}

Result set_log_category(Instance *c, const char *category, int on) {
    unsigned chosen = category == NULL || strcmp(category, "logAll") == 0 ? LOG_ALL : 0;
    for (int k = 0; k < N_CATEGORIES && chosen == 0; k++)
        if (strcmp(category, categories[k]) == 0) chosen = 1u << k;
    if (chosen == 0) return fail(c, "There is no log category '%.100s'.", category);
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
    return fail(c, "%s is not allowed now: %s.", function, names[phase]);
}

/* ---- memory ----------------------------------------------------------------------------------------------------- */

static uint64_t larger(uint64_t a, uint64_t b) { return a > b ? a : b; }

typedef struct { /* arrays of one size: number and size of their elements */
    uint64_t size, bytes;
    void *arrays[8];
} Room;

/* Lays arrays out one behind the other; with memory == NULL only measures them. Returns their size in doubles. */
static uint64_t place(const Room *rooms, size_t count, double *memory) {
    uint64_t used = 0;
    for (size_t k = 0; k < count; k++)
        for (void *const *array = rooms[k].arrays; *array != NULL; array++) {
            double *first = memory == NULL ? NULL : memory + used;
            memcpy(*array, &first, sizeof first);
            used += (rooms[k].size * rooms[k].bytes + 7) / 8 + 1;
        }
    return used;
}
#define PLACE(rooms, memory) place(rooms, sizeof rooms / sizeof rooms[0], memory)

static uint64_t place_state(Instance *c, double *memory) {
    const Model *m = c->model;
    uint64_t n = m->n_unknowns, n_d = m->n_d, n_starts = m->n_starts, n_delays = m->n_delays;
    const Room smooth[] = {{n, 8, {&c->x}}, {m->n_p, 8, {&c->p}}, {m->n_u, 8, {&c->u, &c->u_rate}}, {n_d, 8, {&c->d}},
        {n_starts, 8, {&c->start_value}}};
    const Room rest[] = {{2 + 5 * n, 8, {&c->piece}}, {n_d, 1, {&c->mode_given}}, {n_starts, 1, {&c->start_given}},
        {m->settings->fixed_step > 0 ? 2 * (uint64_t)m->n_guards : 0, 8, {&c->end_look}},
        {m->n_transitions, 1, {&c->wanting}}, {n_delays > 0 ? MOST_PAST * (2 + n_delays) : 0, 8, {&c->past}},
        {n_delays, 8, {&c->past_sizes}}};
    c->n_smooth = (size_t)PLACE(smooth, memory);
    return c->n_smooth + PLACE(rest, memory == NULL ? NULL : memory + c->n_smooth);
}

/* Operations, or outputs, of the first tapes that are specialised. */
static uint64_t special_size(const Model *m, int count, int outputs) {
    uint64_t size = 0;
    for (int k = 0; k < count; k++)
        size += (uint64_t)(outputs ? full_tape(m, k)->n_outputs : full_tape(m, k)->n_operations);
    return size;
}

static void share_out_specials(Instance *c) {
    for (int k = 0; k < N_SPECIALS; k++) {
        Special *s = &c->work.special[k];
        uint64_t before = special_size(c->model, k, 0);
        s->runs = c->work.special_runs + before;
        s->operands = c->work.special_operands + before;
        s->outputs = c->work.special_outputs + special_size(c->model, k, 1);
        s->first_known = c->model->n_slots + (int)before;
        s->tape =
            (Tape){0, 0, full_tape(c->model, k)->n_outputs, c->model->slot_results, s->runs, s->operands, s->outputs};
    }
}

/* Tapes, equations and the integrator. */
static uint64_t place_work(const Model *m, Work *w, double *memory) {
    uint64_t n = m->n_unknowns, n_z = m->n_z, steady = m->n_steady;
    uint64_t members = m->most_members, n_guards = m->n_guards, n_x = m->n_x;
    uint64_t resets = larger(larger(m->n_resets, m->n_reset_values), larger(m->n_updates, m->n_holds + m->n_ideals));
    uint64_t small = larger(larger(n_guards, m->n_moments), larger(larger(m->n_start_modes, m->n_d), m->n_derived));
    uint64_t left = special_size(m, N_SPECIALS, 0);
    uint64_t square =
        larger(larger(m->settings->steady ? 2 * steady * steady : 0, resets * n_x), members * (n_x + 3 * members));
    square = larger(square, m->n_ideals > 0 ? n_z * (n_z + 2) : 0);
    const Room rooms[] = {{m->n_slots + left, 8, {&w->slots}}, {3 * (uint64_t)m->n_slots, 8, {&w->dots}},
        {larger(m->n_jacobian, m->n_start_jacobian), 8, {&w->jacobian}}, {m->step.n_nonzeros, 8, {&w->matrix}},
        {larger(m->step.n_v, m->start.n_v), 8, {&w->qr_v}}, {larger(m->step.n_r, m->start.n_r), 8, {&w->qr_r}},
        {larger(n, m->start.size), 8, {&w->qr_beta, &w->qr_work, &w->start_unknowns}}, {9 * n, 8, {&w->stages}},
        {2 + 5 * n, 8, {&w->whole}}, {n, 8, {&w->point, &w->first}}, {n + n_z, 8, {&w->vector}},
        {larger(n, m->n_determinants), 8, {&w->rhs}}, {m->n_nodes, 8, {&w->variables}}, {small, 8, {&w->guards}},
        {2 * n_guards, 8, {&w->guards_before}}, {3 * n_guards * MOST_LOOKS, 8, {&w->looks}}, {n_guards, 1, {&w->kinds}},
        {n_z * n_z, 8, {&w->dense_matrix}}, {n_z, 8, {&w->residual, &w->kept_z, &w->respond_z}},
        {n_z, sizeof(int), {&w->order}}, {n_z, 1, {&w->open_rows}}, {square, 8, {&w->square}},
        {2 * (uint64_t)m->n_delays, 8, {&w->delayed}}, {2 * DELAY_TERMS * (uint64_t)m->n_delays, 8, {&w->series}},
        {m->n_starts, 8, {&w->start_values}}, {larger(m->n_start_values, resets), 8, {&w->start_residual}},
        {resets, 8, {&w->reset_values, &w->target_values}}, {resets, sizeof(int), {&w->targets}},
        {n, 8, {&w->seen_rates, &w->first_rates}}, {n_guards, 8, {&w->seen_indicators}},
        {m->n_derived, 8, {&w->seen_derived}}, {m->n_slots, sizeof(int), {&w->same, &w->places_of_slots}},
        {m->n_slots, 1, {&w->known_slots, &w->needed_slots}}, {m->n_nodes, 1, {&w->asked}}, {m->n_p, 1, {&w->tuned}},
        {left, sizeof(Run), {&w->special_runs}}, {left, sizeof(Operands), {&w->special_operands}},
        {special_size(m, N_SPECIALS, 1), sizeof(int), {&w->special_outputs}}};
    return PLACE(rooms, memory);
}

/* Events, and what modes hold. */
static uint64_t place_events(const Model *m, Work *w, double *memory) {
    uint64_t n_x = m->n_x, n_d = m->n_d, n_holds = m->n_holds, members = m->most_members + 1;
    const Room rooms[] = {{n_x, 8, {&w->strike.jump, &w->impacts.x, &w->rates, &w->x_kept}}, {n_x, 1, {&w->known}},
        {n_d, 8, {&w->d_before, &w->d_earlier, &w->d_fired, &w->best, &w->respond_d}},
        {n_d, 1, {&w->decided, &w->changed}}, {m->n_transitions, 1, {&w->wanting}},
        {n_holds, sizeof(Terms), {&w->terms, &w->strike_terms}},
        {n_holds, 8, {&w->weights, &w->base_weights, &w->use, &w->strike.before, &w->strike.approach}},
        {n_holds, 8, {&w->strike.impulse, &w->strike.reaction, &w->begun}}, {n_holds, sizeof(int), {&w->standing}},
        {n_holds, 1, {&w->held, &w->impacts.entered}},
        {n_holds, 1, {&w->strike.entering, &w->strike.loose, &w->strike.held, &w->strike.knocked}},
        {members, 8, {&w->reactions, &w->sizes, &w->zeros}},
        {members + m->n_ideals, sizeof(int), {&w->places, &w->member, &w->pivots}}, {members, 1, {&w->other}}};
    return PLACE(rooms, memory);
}

/* Lays out everything in one block, the state first; with memory == NULL only measures it. */
static uint64_t lay_out(Instance *c, double *memory) {
    uint64_t used = place_state(c, memory);
    c->n_numbers = (size_t)used;
    used += place_work(c->model, &c->work, memory == NULL ? NULL : memory + used);
    return used + place_events(c->model, &c->work, memory == NULL ? NULL : memory + used);
}

static void set_tolerance(State *s, const Model *m, double relative) {
    s->tolerance = relative;
    s->absolute = relative * m->settings->absolute_to_relative;
}

void instance_reset(Instance *c) {
    State *s = &c->state;
    memset(s, 0, sizeof *s);
    memset(c->numbers, 0, c->n_numbers * sizeof(double));
    s->phase = PHASE_INSTANTIATED;
    set_tolerance(s, c->model, c->model->settings->default_tolerance);
    c->variables_valid = c->look_valid = 0;
    gradient_end(c);
    start_defaults(c);
}

static Instance *instance_make(const Instance *bare) {
    const Model *m = bare->model;
    Instance measured = *bare, *c;
    size_t length = strlen(bare->name) + 1, head = (sizeof *c + length) / sizeof(double) + 1;
    uint64_t size = head + lay_out(&measured, NULL);
    c = size > SIZE_MAX / sizeof(double) ? NULL : bare->allocate((size_t)size, sizeof(double));
    if (c == NULL) return NULL;
    *c = *bare;
    c->name = memcpy(c + 1, bare->name, length);
    c->numbers = (double *)(void *)c + head;
    lay_out(c, c->numbers);
    c->z = c->x + m->n_x;
    share_out_specials(c);
    memcpy(c->work.slots + m->slot_constants, m->constants, (size_t)m->n_constants * sizeof(double));
    instance_reset(c);
    return c;
}

/* An instance of a model, which must outlive it; NULL, with a message in the log, if there is none. `bare` has the
 * model, a name, and what belongs to the caller; log_enabled tells whether there is to be logged more than errors. */
Instance *instance_new(Instance bare, const char *token) {
    Instance *c = NULL;
    const char *name = bare.name;
    if (name == NULL || *name == 0) bare.name = "?";
    bare.log_enabled = bare.log_enabled ? LOG_ERROR | LOG_WARNING | LOG_EVENTS : LOG_ERROR;
    if (name != bare.name) fail(&bare, "The instance needs a name.");
    else if (token == NULL || strcmp(token, bare.model->token) != 0)
        fail(&bare, "The instantiation token is that of another export of the model.");
    else if ((c = instance_make(&bare)) == NULL) fail(&bare, "There is not enough memory.");
    return c;
}

/* The same for a program that has loaded this library. */
Instance *instance_for(const Model *m, void *environment) {
    Instance bare = {.model = m, .name = "native", .environment = environment, .allocate = calloc, .release = free};
    bare.co_simulation = 1;
    return instance_new(bare, m->token);
}

/* The same with a model of its own: the one that is compiled in, or else the one in the folder of resources. */
Instance *instance_open(Instance bare, const char *token, const char *location) {
    char message[MESSAGE_LENGTH];
    Instance *c;
    Model *own = model_data_size > 0 ? model_read((const unsigned char *)model_data, model_data_size, bare.allocate,
                                           bare.release, message)
                                     : model_open(location, bare.allocate, bare.release, message);
    if (own == NULL) {
        if (bare.name == NULL) bare.name = "?";
        fail(&bare, "%s", message);
        return NULL;
    }
    bare.model = own;
    c = instance_new(bare, token);
    if (c == NULL) model_free(own);
    else c->own_model = own;
    return c;
}

void instance_free(Instance *c) {
    Release release = c->release;
    gradient_end(c);
    if (c->own_model != NULL) model_free(c->own_model);
    release(c);
}

Result set_experiment(
    Instance *c, int tolerance_defined, double tolerance, double start, int stop_defined, double stop) {
    State *s = &c->state;
    if (!isfinite(start) || (stop_defined && !(stop >= start)))
        return fail(c, "The start time %g s must be finite and not after the stop time %g s.", start, stop);
    if (tolerance_defined && !(tolerance > 0 && tolerance < 1))
        return fail(c, "The tolerance must be between 0 and 1, not %g.", tolerance);
    if (tolerance_defined) set_tolerance(s, c->model, tolerance);
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

/* A copy is the state, and then its numbers. */
static size_t copy_size(const Instance *c) { return sizeof(State) + c->n_numbers * sizeof(double); }

static Header header_of(const Instance *c, const void *copy) {
    Header h = {"MLSTAT2", copy_size(c), 0, 0};
    h.model = crc32_of((const unsigned char *)c->model->token, strlen(c->model->token));
    h.check = crc32_of(copy, copy_size(c));
    return h;
}

static Result room_for_copy(Instance *c, void **copy) {
    if (*copy == NULL) *copy = c->allocate(1, copy_size(c));
    if (*copy != NULL) return RESULT_OK;
    return fail(c, "There is not enough memory for a copy of the state.");
}

Result state_copy_out(Instance *c, void **copy) {
    if (room_for_copy(c, copy) != RESULT_OK) return RESULT_ERROR;
    memcpy(*copy, &c->state, sizeof(State));
    memcpy((char *)*copy + sizeof(State), c->numbers, c->n_numbers * sizeof(double));
    return RESULT_OK;
}

/* Where numbers of the state lie in a copy. */
const double *copied(const Instance *c, const void *copy, const double *values) {
    return (const double *)(const void *)((const char *)copy + sizeof(State)) + (values - c->numbers);
}

Result state_copy_in(Instance *c, const void *copy) {
    memcpy(&c->state, copy, sizeof(State));
    memcpy(c->numbers, (const char *)copy + sizeof(State), c->n_numbers * sizeof(double));
    c->variables_valid = c->look_valid = 0;
    gradient_lose(c, "the state was set", NULL);
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
    if (size < state_size(c)) return fail(c, "The state needs %zu bytes, not %zu.", state_size(c), size);
    memcpy(bytes, &h, sizeof h);
    memcpy(bytes + sizeof h, copy, copy_size(c));
    return RESULT_OK;
}

Result state_read(Instance *c, const unsigned char *bytes, size_t size, void **copy) {
    Header h, expected;
    if (size != state_size(c)) return fail(c, "A state of this model has %zu bytes, not %zu.", state_size(c), size);
    memcpy(&h, bytes, sizeof h);
    expected = header_of(c, bytes + sizeof h);
    if (memcmp(&h, &expected, sizeof h) != 0)
        return fail(c, "These bytes are not a state of this model: it is another model's, or they are damaged.");
    *copy = NULL;
    if (room_for_copy(c, copy) != RESULT_OK) return RESULT_ERROR;
    memcpy(*copy, bytes + sizeof h, copy_size(c));
    return RESULT_OK;
}
