/* Derivatives of a whole run by parameters, inputs and start values: a run keeps its steps and instants; asked for a
 * gradient, adjoint vectors go back along them, so that it costs the same for any number of parameters. Over a step
 * adjoint.c takes them, over an instant instants.c. What has no derivative begins a doubt, an adjoint vector of its own
 * that tells at the end which parameters it concerns. */
#include "adjoint.h"

#define MOST_ROUNDS 32
#define MOST_VALUES 100000
#define MOST_MEMORY 1e9 /* bytes */

void gradient_lose(Instance *c, FailureCode why) {
    Gradient *g = c->gradient;
    if (g == NULL || c->passing || g->lost != 0) return;
    g->lost = why;
    g->lost_at = c->state.t;
}

/* The equations are singular on the way back. */
void lose_back(Instance *c) {
    c->gradient->singular = 1;
    c->gradient->singular_at = c->state.t;
}

/* Those that follow each other for the same reason are one, as what rests at a kink for many steps; the factors keep
 * them from cancelling each other. */
void add_doubt(Instance *c, FailureCode why, const double *slope) {
    Gradient *g = c->gradient;
    int same = g->n_doubts > 0 && (g->doubts[g->n_doubts - 1].why == why || g->n_doubts == MOST_DOUBTFUL);
    Doubt *doubt = &g->doubts[same ? g->n_doubts - 1 : g->n_doubts++];
    double *vector = vector_of(c, g->n_of + g->n_doubts - 1), factor = 1 + fmod(0.6180339887498949 * doubt->n, 1);
    g->n_vectors = g->n_of + g->n_doubts;
    *doubt = (Doubt){why, doubt->n + 1, c->state.t, -1};
    for (size_t n = 0; n < c->n_smooth; n++) vector[n] += factor * slope[n];
}

/* How large the terms are of what has this slope, by the present numbers or nominally; 1 if they are larger, whose
 * rounding is as good as that of 1. */
double small_terms(const Instance *c, const double *slope) {
    double terms = fabs(slope[c->n_smooth]) * max_of(1, fabs(c->state.t));
    for (size_t n = 0; n < c->n_smooth; n++) {
        ptrdiff_t state = (ptrdiff_t)n - (c->x - c->numbers);
        double nominal = state >= 0 && state < c->model->n_x ? c->model->nominals[state] : 0;
        terms += fabs(slope[n]) * max_of(fabs(c->numbers[n]), nominal);
    }
    return min_of(1, max_of(terms, DBL_MIN));
}

/* Adds a doubt by what is small itself, as a guard of picometres: by how much it changes beside its terms. */
void add_small_doubt(Instance *c, FailureCode why, double *slope) {
    double terms = small_terms(c, slope);
    for (size_t n = 0; n <= c->n_smooth; n++) slope[n] /= terms;
    add_doubt(c, why, slope);
}

/* Notes which transitions fire in a round, or says it; tells whether any do. */
int gradient_round(Instance *c, int round, unsigned char *wanting, int any) {
    Gradient *g = c->gradient;
    size_t n = (size_t)c->model->n_transitions;
    if (g == NULL || g->lost != 0) return any;
    if (c->passing && round < g->n_rounds) memcpy(wanting, g->rounds + n * (size_t)round, n);
    else if (c->passing) memset(wanting, 0, n);
    if (c->passing) return round < g->n_rounds;
    g->n_rounds = any ? round + 1 : round;
    if (any && round >= MOST_ROUNDS) gradient_lose(c, FAILURE_LOST_IN_ROUNDS);
    else if (any) memcpy(g->rounds + n * (size_t)round, wanting, n);
    return any;
}

static void drop_records(Instance *c, Gradient *g) {
    while (g->last != NULL) {
        Record *record = g->last;
        g->last = record->previous;
        state_release(c, &record->before);
        state_release(c, &record->behind);
        c->release(record);
    }
    g->bytes = 0;
    g->frame = NULL;
}

/* A new record with so many bytes of its own; NULL, and derivatives are lost, if there is no room. */
static Record *add_record(Instance *c, size_t bytes, int copies) {
    Gradient *g = c->gradient;
    g->bytes += (double)(sizeof(Record) + bytes) + copies * (double)state_size(c);
    Record *record = g->bytes > MOST_MEMORY ? NULL : c->allocate(1, sizeof *record + bytes);
    if (record == NULL) return drop_records(c, g), gradient_lose(c, FAILURE_LOST_BY_MEMORY), NULL;
    record->previous = g->last;
    record->own = (double *)(void *)(record + 1);
    return g->last = record;
}

/* Do parameters, inputs and d differ from those of a copy? */
static int has_changed(const Instance *c, const void *copy) {
    size_t size = (size_t)(c->d + c->model->n_d - c->p) * sizeof(double);
    return copy == NULL || memcmp(c->p, copied(c, copy, c->p), size) != 0 ||
           ((const State *)copy)->u_time != c->state.u_time;
}

/* The run is about to move along its present piece. */
void gradient_move(Instance *c, double end) {
    Gradient *g = c->gradient;
    const Record *last = g == NULL ? NULL : g->last;
    if (g == NULL || c->passing || g->lost != 0 || !(c->state.t < end)) return;
    int changed = has_changed(c, g->frame);
    const Piece *piece = last == NULL || last->pass != NULL ? NULL : (const Piece *)(const void *)last->own;
    if (!changed && piece != NULL && piece->begin == c->piece->begin && piece->end == c->piece->end) {
        g->last->end = end;
        return;
    }
    Record *record = add_record(c, piece_size(c->model), changed);
    if (record == NULL) return;
    memcpy(record->own, c->piece, piece_size(c->model));
    record->begin = c->state.t;
    record->end = end;
    record->edgeless = c->edgeless;
    if (changed && !state_copy_out(c, &record->before)) gradient_lose(c, FAILURE_LOST_BY_MEMORY);
    if (changed) g->frame = record->before;
    record->frame = g->frame;
}

Result gradient_through(Instance *c, Result (*pass)(Instance *c), int start) {
    Gradient *g = c->gradient;
    if (g == NULL || c->passing) return pass(c);
    if (start) {
        drop_records(c, g);
        g->lost = 0;
    }
    g->n_rounds = 0;
    void *before = NULL;
    if (g->lost == 0 && !state_copy_out(c, &before)) return RESULT_ERROR;
    Result result = pass(c);
    size_t bytes = (size_t)g->n_rounds * (size_t)c->model->n_transitions;
    Record *record = result && g->lost == 0 ? add_record(c, bytes, 2) : NULL;
    if (record == NULL) return state_release(c, &before), result;
    record->pass = pass;
    record->start = start;
    record->before = before;
    record->n_rounds = g->n_rounds;
    record->rounds = memcpy(record->own, g->rounds, bytes);
    if (!state_copy_out(c, &record->behind)) return RESULT_ERROR;
    g->frame = record->behind;
    return RESULT_OK;
}

void gradient_end(Instance *c) {
    Gradient *g = c->gradient;
    if (g == NULL) return;
    drop_records(c, g);
    c->release(g);
    c->gradient = NULL;
}

/* Room for what goes back, behind each other in one block; returns NULL if there is no memory. */
static double *take_room(const Instance *c, size_t n_of) {
    Gradient *g = c->gradient;
    size_t n = c->n_smooth + 1, vectors = n_of + MOST_DOUBTFUL, n_y = (size_t)c->model->n_unknowns;
    size_t nonzeros = (size_t)c->model->step.n_nonzeros, integrals = g->along != NULL ? n_of * N_NODES : 0;
    size_t operations = (size_t)c->model->tapes.rates.n_operations, rests = operations + (size_t)c->model->n_guards;
    const struct {
        double **array;
        size_t size;
    } parts[] = {{&g->vectors, vectors * n}, {&g->behind, vectors * n}, {&g->sides, 2 * n}, {&g->slope, n},
        {&g->way, n}, {&g->moment, n}, {&g->work, n + (N_NODES + 1) * n_y}, {&g->largest, n_of}, {&g->sizes, n},
        {&g->motions, n}, {&g->rates, 2 * n_y}, {&g->points, N_NODES * n_y}, {&g->matrices, N_NODES * nonzeros},
        {&g->stages, (STAGES + 3) * n_y}, {&g->node_bars, vectors * N_NODES * n_y},
        {&g->integrand_slopes, integrals * n_y}, {&g->integrand_bars, integrals * n}, {&g->later, n_of},
        {&g->rests, rests}, {&g->guard_sizes, (size_t)c->model->n_guards},
        {&g->guard_rests, (size_t)c->model->n_guards}, {&g->edges, 3 * (size_t)c->model->tapes.edges.n_outputs},
        {&g->lanes, (vectors < MOST_LANES ? vectors : MOST_LANES) * c->n_bars}};
    size_t total = 0, touches = MOST_TOUCHES * (size_t)c->model->n_guards * (sizeof(Touch) / sizeof(double));
    for (size_t k = 0; k < sizeof parts / sizeof parts[0]; k++) total += parts[k].size;
    double *room = c->allocate(total + 2 * n + vectors + 3 * operations + touches, sizeof(double));
    double *next = room;
    for (size_t k = 0; k < sizeof parts / sizeof parts[0] && room != NULL; next += parts[k++].size)
        *parts[k].array = next;
    g->listed = (ptrdiff_t *)(void *)next;
    g->marks = (unsigned char *)(void *)(next + n);
    g->still = (unsigned char *)(void *)(next + 2 * n);
    g->kinked = (Kink *)(void *)(next + 2 * n + vectors);
    g->kinks = (Kink **)(void *)(g->kinked + operations);
    g->touches = (Touch *)(void *)(next + 2 * n + vectors + 3 * operations);
    return room;
}

/* Room for derivatives by n values; NULL if there is no memory. */
static Gradient *gradient_new(const Instance *c, size_t n) {
    size_t own = sizeof(Gradient) / 8 + 1, marks = MOST_ROUNDS * (size_t)c->model->n_transitions / 8 + 1;
    double *memory = n > MOST_VALUES ? NULL : c->allocate(own + marks + c->n_smooth / 8 + 1 + 2 * n, 8);
    Gradient *g = (Gradient *)(void *)memory;
    if (g == NULL) return NULL;
    g->n = n;
    g->rounds = (unsigned char *)(memory + own);
    g->asked = (unsigned char *)(memory + own + marks);
    g->values = (Value *)(void *)(memory + own + marks + c->n_smooth / 8 + 1);
    return g;
}

/* The value of a parameter, an input or a start value, which is then given, among the numbers of the state. */
static double *value_of(Instance *c, const Variable *v) {
    if (v->kind == KIND_INPUT) return &c->u[v->index];
    if (v->kind == KIND_PARAMETER) return mark_tuned(c, v->index), &c->p[v->index];
    start_values(c);
    c->start_value[v->start] = c->start_values[v->start];
    c->start_given[v->start] = 1;
    return &c->start_value[v->start];
}

int modelica_like_gradient_start(void *instance, const uint32_t by[], size_t n) {
    Instance *c = instance;
    if (c == NULL || !allowed(c, "modelica_like_gradient_start", PHASE_INITIALIZATION)) return 1;
    if (!c->co_simulation || c->model->settings->fixed_step > 0) return !fail(c, FIXED_STEPS_HAVE_NONE, 0);
    if (by == NULL && n > 0) return !refuse(c, "The argument by is a null pointer.");
    if (!check_knowns(c, by, n)) return 1;
    gradient_end(c);
    if (n > 0 && (c->gradient = gradient_new(c, n)) == NULL) return !fail(c, NO_MEMORY, 0);
    for (size_t j = 0; j < n; j++) {
        ptrdiff_t place = value_of(c, find_variable(c->model, by[j])) - c->numbers;
        c->gradient->values[j] = (Value){place, by[j]};
        c->gradient->asked[place] = 1;
    }
    c->state.solved = 0;
    return 0;
}

void add_seed(Instance *c, const Seed *seed) {
    const Model *m = c->model;
    double *vector = vector_of(c, (int)seed->of);
    const double *by = seed->by, *const parts[] = {c->x, c->p, c->u, c->d};
    const int sizes[] = {m->n_x, m->n_p, m->n_u, m->n_d};
    for (int part = 0; part < 4; by += sizes[part++])
        for (int k = 0; k < sizes[part]; k++) vector[parts[part] - c->numbers + k] += by[k];
}

/* The time of the next seed on the way back, if it is not before t; it is added then, if that is asked for. */
double seed_behind(Instance *c, double t, int add) {
    Gradient *g = c->gradient;
    if (g->along == NULL || g->next_seed == g->along->n_seeds) return -INFINITY;
    const Seed *seed = &g->along->seeds[g->next_seed];
    if (seed->instant >= 0 || seed->t < t) return -INFINITY;
    if (add) add_seed(c, seed), g->next_seed++;
    return seed->t;
}

/* Goes back over all records, from derivatives of outputs at the present point, and comes back to it. */
static Result go_back(Instance *c) {
    Gradient *g = c->gradient;
    void *present = NULL;
    int edges_valid = c->edges_valid, doubts = c->doubts;
    size_t size = 3 * (size_t)c->model->tapes.edges.n_outputs * sizeof(double);
    double one = 1, edges_kept = c->edges_kept;
    if (!state_copy_out(c, &present)) return RESULT_ERROR;
    memcpy(g->edges, c->edges, size);
    g->next_seed = g->instant = 0;
    g->present = c->state.t;
    find_kinked(c);
    while (seed_behind(c, c->state.t, 1) > -INFINITY) continue;
    for (const Record *record = g->last; record != NULL; record = record->previous)
        g->instant += record->pass != NULL && !record->start;
    for (int k = 0; k < g->n_of && g->along == NULL; k++) {
        seed_unknowns(c, &g->of[k], 1, &one);
        add_bars(c, vector_of(c, k));
    }
    if (g->along == NULL) check_outputs(c);
    c->passing = 1;
    check_end(c);
    state_copy_in(c, present);
    c->decided_by++; /* tapes know less now, see work_out */
    for (const Record *record = g->last; record != NULL; record = record->previous) {
        if (record->pass == NULL) {
            piece_back(c, record);
            continue;
        }
        g->n_rounds = record->n_rounds;
        memcpy(g->rounds, record->rounds, (size_t)record->n_rounds * (size_t)c->model->n_transitions);
        g->instant -= !record->start;
        (record->start ? start_back : event_back)(c, record);
        g->loaded = NULL;
    }
    state_copy_in(c, present);
    c->passing = 0;
    c->decided_by++;
    c->edges_valid = edges_valid;
    c->edges_kept = edges_kept;
    memcpy(c->edges, g->edges, size);
    c->doubts = doubts;
    return state_release(c, &present);
}

/* Writes derivatives, nan where there are none. Where there are none at all it fails, for the earliest reason. */
static Result write_gradient(Instance *c, double *gradient) {
    const Gradient *g = c->gradient;
    const Doubt *first = NULL;
    uint32_t by = 0;
    int any = 0;
    for (size_t j = 0; j < g->n; j++) {
        ptrdiff_t place = g->values[j].place;
        double size = c->numbers[place] == 0 ? 1 : fabs(c->numbers[place]);
        const Doubt *doubt = NULL;
        for (int k = 0; k < g->n_doubts; k++)
            if (!(fabs(vector_of(c, g->n_of + k)[place]) * size <= DOUBTFUL)) doubt = &g->doubts[k];
        for (int of = 0; of < g->n_of; of++) gradient[of * g->n + j] = doubt ? NAN : vector_of(c, of)[place];
        any |= doubt == NULL;
        if (doubt == NULL || (first != NULL && first->t <= doubt->t)) continue;
        first = doubt;
        by = g->values[j].by;
    }
    return any || fail_with(c, first->why, by, first->t, first->place);
}

/* By rows: of variables at the present point, or of what is read along the run, whose places are unchecked. */
Result differentiate(Instance *c, const uint32_t of[], size_t n_of, const Along *along, double *gradient) {
    Gradient *g = c->gradient;
    if (g->lost != 0) return fail_with(c, g->lost, UINT32_MAX, g->lost_at, 0);
    if (!factor_implicit(c)) return RESULT_ERROR;
    g->along = along;
    g->of = of;
    for (size_t row = 0; along != NULL && row < n_of; row++)
        if (along->integrands[row].variable >= 0) ask_for(c, (int)along->integrands[row].variable);
    double *room = n_of > MOST_VALUES ? NULL : take_room(c, n_of);
    if (room == NULL) return fail(c, NO_MEMORY, 0);
    g->n_of = g->n_vectors = (int)n_of;
    g->n_doubts = g->singular = g->early = g->measured = g->lands = 0;
    memset(g->doubts, 0, sizeof g->doubts);
    memset(g->guard_rests, 0, (size_t)c->model->n_guards * sizeof(double));
    g->loaded = NULL;
    Result result = go_back(c);
    if (result && g->singular) result = fail_with(c, FAILURE_LOST_AT_SINGULAR, UINT32_MAX, g->singular_at, 0);
    else if (result) result = write_gradient(c, gradient);
    c->release(room);
    return result;
}

int modelica_like_gradient(void *instance, const uint32_t of[], size_t n_of, double gradient[]) {
    Instance *c = instance;
    if (c == NULL || !allowed(c, "modelica_like_gradient", PHASE_EVENT | PHASE_STEP | PHASE_TERMINATED)) return 1;
    if (c->gradient == NULL || of == NULL || gradient == NULL) return !fail(c, NOT_ASKED, 0);
    return !check_unknowns(c, of, n_of) || !differentiate(c, of, n_of, NULL, gradient);
}
