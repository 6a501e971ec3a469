/* Derivatives of a whole run by parameters, inputs and start values: tangents that go along with it.
 *
 * Between instants they follow the linear equations of the derivatives over the dense output of every step, whose
 * coefficients are exact (ESDIRK4(3)6L of C. Kennedy, M. Carpenter: NASA TM 2001-211038, order 4, L-stable). Instants,
 * the start and events, are passed twice more, a little to both sides along every tangent, with the transitions that
 * have fired: central differences. Along a tangent an event moves so that its guard stays zero, and states move on at
 * the rates before and behind it (the saltation of M. A. Aizerman, F. R. Gantmakher, 1958). What cannot be differenced
 * is lost: the run goes on, and whoever asks for derivatives is told. */
#include "core.h"

#define NEARBY 3e-6      /* of the sizes of states and parameters: how far instants are moved */
#define FELT_CHANGE 1e-9 /* of states and rates, relative to their sizes */
#define FELT_KINK 1e-3   /* of a slope: curvature changes it by about NEARBY */
#define CLOSER 0.01      /* the part of that where a kink differs as much */
#define RESTS 1e-3       /* of a run: a step from which on what is zero at both its ends rests */
#define MOST_ROUNDS 32
#define MOST_TANGENTS 100000
#define STEPS 4        /* per step of the run */
#define MOST_EDGES 100 /* in a step: more are noise */
enum { N_STAGES = 6 };

static const double NODES[N_STAGES] = {0, 0.5, 0.332, 0.62, 0.85, 1};
static const double WEIGHTS[N_STAGES][N_STAGES - 1] = {
    {0}, /* in each row 1/4 follows, the factor of the stage itself */
    {0.25},
    {0.137776, -0.055776},
    {0.14463686602698217, -0.22393190761334475, 0.4492950415863626},
    {0.09825878328356477, -0.5915442428196704, 0.8101210538282996, 0.283164405707806},
    {0.15791629516167136, 0, 0.18675894052400077, 0.6805652953093346, -0.27524053099500667},
};

typedef struct { /* derivatives of a run by one of its values */
    const Variable *by;
    ptrdiff_t place;             /* of its value among the numbers of the state */
    double shift;                /* by how much the present instant comes later */
    double *now, *next, *stages; /* derivatives of these numbers; rates of a step's stages */
} Tangent;

struct Gradient {
    int n, n_rounds;
    Tangent *tangents;
    void *before, *behind; /* copies of the state at an instant */
    double *rates;         /* before it */
    unsigned char *rounds; /* transitions that have fired there, by rounds */
    FailureCode lost;      /* why there are no derivatives, or 0 */
    uint32_t lost_by;      /* value reference, or the largest number: anything */
    double lost_at;
};

void gradient_lose(Instance *c, FailureCode why, const Variable *by) {
    Gradient *g = c->gradient;
    if (g == NULL || c->passing || g->lost != 0) return;
    g->lost = why;
    g->lost_by = by == NULL ? UINT32_MAX : by->reference;
    g->lost_at = c->state.t;
}

/* The part of a tangent of the state's numbers from `values` on. */
static double *part_of(const Instance *c, const Tangent *one, const double *values) {
    return one->now + (values - c->numbers);
}

/* Where numbers of the state lie in a copy. */
static const double *copied(const Instance *c, const void *copy, const double *values) {
    return (const double *)(const void *)((const char *)copy + sizeof(State)) + (values - c->numbers);
}

/* Parameters, inputs and discrete values move along a tangent; if `moving` (at the present point, where factor_implicit
 * has been called) also states, with the implicit unknowns. */
static void load_tangent(Instance *c, const Tangent *one, int moving) {
    const Model *m = c->model;
    double *dots = memset(c->dots, 0, m->slot_results * sizeof(double));
    memcpy(dots + m->slot_p, part_of(c, one, c->p), m->n_p * sizeof(double));
    memcpy(dots + m->slot_u, part_of(c, one, c->u), m->n_u * sizeof(double));
    memcpy(dots + m->slot_d, part_of(c, one, c->d), m->n_d * sizeof(double));
    if (moving) memcpy(dots + m->slot_x, part_of(c, one, c->x), m->n_x * sizeof(double));
    if (moving) tangent_of_implicit(c);
}

/* Stage i of a step: (M/(h gamma) - J) s = M/(h gamma) begin + b; the matrix is factorised, the rates' tape has run. */
static void take_stage(Instance *c, Tangent *one, int i, double h) {
    const Model *m = c->model;
    int n_x = m->n_x;
    double *solved = c->vector, *begin = c->point, *x = part_of(c, one, c->x);
    load_tangent(c, one, 0);
    tape_tangent(&m->tapes.rates, c->slots, c->dots, solved);
    for (int k = 0; k < n_x; k++) {
        begin[k] = x[k];
        for (int j = 0; j < i; j++) begin[k] += h * WEIGHTS[i][j] * one->stages[j * n_x + k];
        solved[k] += 4 / h * begin[k];
    }
    solve_step(c, solved);
    for (int k = 0; k < n_x; k++) one->stages[i * n_x + k] = 4 / h * (solved[k] - begin[k]);
    if (i == N_STAGES - 1) memcpy(x, solved, n_x * sizeof(double));
}

/* A part of the piece without edges, from the present point on. */
static void move_smoothly(Instance *c, double end) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    double begin = c->state.t, h = (end - begin) / STEPS, *rates = c->rhs;
    if (h <= 0) return;
    if (!factor_implicit(c)) gradient_lose(c, FAILURE_LOST_AT_SINGULAR, NULL);
    for (int j = 0; j < g->n; j++) {
        load_tangent(c, &g->tangents[j], 1);
        tangent_now(c, &m->tapes.rates, g->tangents[j].stages);
    }
    for (int i = 1; i <= STEPS * (N_STAGES - 1); i++) {
        int stage = (i - 1) % (N_STAGES - 1) + 1;
        double t = begin + h * ((i - 1) / (N_STAGES - 1) + NODES[stage]);
        piece_at(m, c->piece, t, c->point);
        evaluate(c, &m->tapes.jacobian, t, c->point, c->jacobian);
        if (!factor_step(c, 4 / h)) gradient_lose(c, FAILURE_LOST_AT_SINGULAR, NULL);
        evaluate(c, &m->tapes.rates, t, c->point, rates);
        for (int j = 0; j < g->n; j++) {
            double *stages = g->tangents[j].stages;
            if (stage == 1 && i > 1) memcpy(stages, stages + (N_STAGES - 1) * m->n_x, m->n_x * sizeof(double));
            take_stage(c, &g->tangents[j], stage, h);
        }
    }
}

static double span_of(const Instance *c) {
    return c->state.stop_time_defined ? c->state.stop_time - c->state.start_time : 1;
}

/* A part of a tangent along which everything changes but little. */
static double small_part(const Instance *c, const Tangent *one) {
    const double *x = part_of(c, one, c->x), *d = part_of(c, one, c->d);
    double value = c->numbers[one->place], largest = value == 0 ? 1 : fabs(1 / value);
    for (int k = 0; k < c->model->n_x; k++)
        largest = fmax(largest, fabs(x[k]) / (fabs(c->x[k]) + c->model->nominals[k]));
    for (int k = 0; k < c->model->n_d; k++) largest = fmax(largest, fabs(d[k]) / (1 + fabs(c->d[k])));
    return NEARBY / fmax(largest, fabs(one->shift) / fmax(1, fabs(c->state.t)));
}

/* Slopes along a tangent at the present point. */
static void slopes_along(Instance *c, const Tangent *one, double *slopes) {
    c->variables_valid = c->state.z_valid = 0;
    memset(slopes, 0, (size_t)c->model->n_x * sizeof(double));
    if (!factor_implicit(c)) return;
    load_tangent(c, one, 1);
    tangent_now(c, &c->model->tapes.rates, slopes);
}

/* By how much slopes differ that can be felt in the time of a run, beside what has moved so far. */
static double felt(const Instance *c, const Tangent *one, const double *some, const double *others) {
    const double *x = part_of(c, one, c->x), *nominals = c->model->nominals;
    double largest = 0, most = 0;
    for (int k = 0; k < c->model->n_x; k++) largest = fmax(largest, fabs(x[k]) / nominals[k]);
    for (int k = 0; k < c->model->n_x; k++) {
        double change = fabs(some[k] - others[k]), least = FELT_CHANGE * largest * nominals[k] / span_of(c);
        int any = change > least && change > FELT_KINK * fmax(fabs(some[k]), fabs(others[k]));
        if (any) most = fmax(most, change / nominals[k]);
    }
    return most;
}

/* By how much slopes along a tangent differ a little to its two sides. */
static double felt_beside(Instance *c, const Tangent *one, double part) {
    const Model *m = c->model;
    double *sides = one->stages, *z = sides + 2 * m->n_x;
    memcpy(one->next, c->numbers, c->n_smooth * sizeof(double));
    memcpy(z, c->z, (size_t)m->n_z * sizeof(double));
    for (int side = 0; side < 2; side++) {
        double way = side == 0 ? -part : part;
        for (size_t k = 0; k < c->n_smooth; k++) c->numbers[k] = one->next[k] + way * one->now[k];
        slopes_along(c, one, sides + side * m->n_x);
        memcpy(c->numbers, one->next, c->n_smooth * sizeof(double));
        memcpy(c->z, z, (size_t)m->n_z * sizeof(double));
    }
    return felt(c, one, sides, sides + m->n_x);
}

/* Whether slopes along a tangent that leads off an edge are other ones on its two sides: what is only curved differs
 * less when closer. */
static int has_kink(Instance *c, const Tangent *one) {
    double part = small_part(c, one), here;
    load_tangent(c, one, 1);
    if (!leads_off_edge(c, AT_EDGE * NEARBY / part, 0)) return 0;
    here = felt_beside(c, one, part);
    return here > 0 && felt_beside(c, one, CLOSER * part) > 0.5 * here;
}

/* Whether a tangent leads to a mode with other slopes: its guard is zero. */
static int has_other_mode(Instance *c, const Tangent *one, int guard) {
    const Model *m = c->model;
    const Transition *to = &m->transitions[m->guard_transition[guard]];
    double *sides = one->stages, *z = sides + 2 * m->n_x, mode = c->d[to->mode];
    slopes_along(c, one, sides);
    tangent_now(c, &m->tapes.guards, c->edge_guards);
    if (fabs(c->edge_guards[guard]) * small_part(c, one) <= AT_EDGE * NEARBY) return 0;
    memcpy(z, c->z, (size_t)m->n_z * sizeof(double));
    c->d[to->mode] = to->target;
    slopes_along(c, one, sides + m->n_x);
    c->d[to->mode] = mode;
    memcpy(c->z, z, (size_t)m->n_z * sizeof(double));
    return felt(c, one, sides, sides + m->n_x) > 0;
}

/* What rests at a limit, an end of play or a row of a table has two derivatives by what leads off it. Behind an event
 * something may be zero for a short step because it begins there. */
static void check_kinks(Instance *c) {
    Gradient *g = c->gradient;
    if (c->piece->end - c->piece->begin < RESTS * span_of(c)) return;
    if (!stands_on_edge(c, c->positive) || !factor_implicit(c)) return;
    for (int j = 0; j < g->n; j++) {
        int kink = has_kink(c, &g->tangents[j]);
        for (int k = 0; k < c->model->n_guards; k++)
            if (c->positive[k]) kink |= has_other_mode(c, &g->tangents[j], k);
        if (kink) gradient_lose(c, FAILURE_LOST_AT_KINK, g->tangents[j].by);
    }
    c->variables_valid = c->state.z_valid = 0;
}

/* Slopes jump at the present point without an event: nothing tells by how much that moves along a tangent. */
static void check_jump(Instance *c) {
    if (!factor_implicit(c)) return;
    for (int j = 0; j < c->gradient->n; j++) {
        const Tangent *one = &c->gradient->tangents[j];
        load_tangent(c, one, 1);
        if (leads_off_edge(c, AT_EDGE * NEARBY / small_part(c, one), 1))
            gradient_lose(c, FAILURE_LOST_AT_JUMP, one->by);
    }
    c->variables_valid = c->state.z_valid = 0;
}

/* States are smooth enough at edges within a step, slopes of tangents are not. */
void gradient_move(Instance *c, double end) {
    if (c->gradient != NULL && c->gradient->lost == 0 && c->state.t < end) check_kinks(c);
    for (int k = 0; c->gradient != NULL && c->gradient->lost == 0 && c->state.t < end; k++) {
        double behind = INFINITY, before = k < MOST_EDGES ? edge_ahead(c, c->state.t, &behind) : INFINITY;
        move_smoothly(c, fmin(before, end));
        if (!(behind <= end)) return;
        piece_at(c->model, c->piece, behind, c->x);
        c->state.t = behind;
        c->variables_valid = c->state.z_valid = 0;
        if (jumps_between(c, before, behind)) check_jump(c);
    }
}

/* By how much the instant comes later, per tangent: a guard, or moment, tells when it is, or its time is given. */
static void find_shifts(Instance *c, Gradient *g) {
    const Model *m = c->model;
    const unsigned char *wanting = c->state.event_pending ? c->wanting : nothing_wanting(c);
    double *values = c->outputs, speed = -1;
    int k = 0;
    if (!c->state.event_pending) find_wanting(c, c->wishes, 0);
    while (k < m->n_transitions && !wanting[k]) k++;
    for (int j = 0; j < g->n; j++) g->tangents[j].shift = 0;
    if (k == m->n_transitions || c->state.n_steps == 0 || !factor_implicit(c)) return;
    const Transition *cause = &m->transitions[k];
    const Tape *tape = cause->timed ? &m->tapes.moments : &m->tapes.guards;
    evaluate_now(c, &m->tapes.rates, g->rates);
    evaluate_now(c, tape, values);
    if (!cause->timed) speed = values[m->n_guards + cause->index];
    for (int j = 0; j < g->n; j++) {
        load_tangent(c, &g->tangents[j], 1);
        tangent_now(c, tape, values);
        g->tangents[j].shift = -values[cause->index] / speed;
    }
}

/* Leaves the instant where it is if it makes no difference when it is: rounding may decide that, and no guard. */
static void check_shifts(Instance *c, Gradient *g) {
    const Model *m = c->model;
    const double *x = copied(c, g->before, c->x), *d = copied(c, g->before, c->d), *rates = c->rhs;
    int matters = 0;
    evaluate_now(c, &m->tapes.rates, c->rhs);
    for (int k = 0; k < m->n_x; k++) {
        double change = fmax(fabs(c->x[k] - x[k]), fabs(rates[k] - g->rates[k]));
        matters |= !(change <= FELT_CHANGE * (fabs(x[k]) + fabs(rates[k]) + m->nominals[k]));
    }
    for (int k = 0; k < m->n_modes; k++) matters |= d[k] != c->d[k] && m->modes[k].n_names == 0;
    for (int j = 0; j < g->n; j++) {
        if (!matters) g->tangents[j].shift = 0;
        else if (!isfinite(g->tangents[j].shift)) gradient_lose(c, FAILURE_LOST_AT_TOUCH, g->tangents[j].by);
    }
}

/* Writes down which transitions fire in a round, or says it; tells whether any do. */
int gradient_round(Instance *c, int round, unsigned char *wanting, int any) {
    Gradient *g = c->gradient;
    size_t n = (size_t)c->model->n_transitions;
    if (g == NULL || g->lost != 0) return any;
    if (c->passing && round < g->n_rounds) memcpy(wanting, g->rounds + n * (size_t)round, n);
    if (c->passing) return round < g->n_rounds;
    g->n_rounds = any ? round + 1 : round;
    if (any && round >= MOST_ROUNDS) gradient_lose(c, FAILURE_LOST_IN_ROUNDS, NULL);
    else if (any) memcpy(g->rounds + n * (size_t)round, wanting, n);
    return any;
}

/* Passes the instant on both sides of the run; returns 0 if other modes follow. */
static int difference(Instance *c, const Gradient *g, Tangent *one, Result (*pass)(Instance *c)) {
    const double *modes = copied(c, g->behind, c->d);
    double *next = memset(one->next, 0, c->n_smooth * sizeof(double)), part = small_part(c, one);
    int same = 1;
    for (int side = -1; side <= 1; side += 2) {
        state_copy_in(c, g->before);
        for (size_t k = 0; k < c->n_smooth; k++) c->numbers[k] += side * part * one->now[k];
        c->state.t += side * part * one->shift;
        same &= pass(c);
        for (int k = 0; k < c->model->n_modes; k++) same &= c->model->modes[k].n_names == 0 || c->d[k] == modes[k];
        for (size_t k = 0; k < c->n_smooth; k++) next[k] += side * c->numbers[k] / (2 * part);
    }
    one->next = one->now;
    one->now = next;
    return same;
}

/* Moves states on at their rates, by a part of what the instant comes later. */
static void move_on(const Instance *c, const Gradient *g, const double *rates, double part) {
    for (int j = 0; j < g->n; j++)
        for (int k = 0; k < c->model->n_x && g->tangents[j].shift != 0; k++)
            part_of(c, &g->tangents[j], c->x)[k] += part * g->tangents[j].shift * rates[k];
}

static void pass_tangents(Instance *c, Gradient *g, Result (*pass)(Instance *c)) {
    const Variable *other = NULL;
    move_on(c, g, g->rates, 1);
    c->passing = 1;
    for (int j = 0; j < g->n && other == NULL; j++) {
        state_copy_in(c, g->before);
        if (!difference(c, g, &g->tangents[j], pass)) other = g->tangents[j].by;
    }
    state_copy_in(c, g->behind);
    c->passing = 0;
    if (other != NULL) gradient_lose(c, FAILURE_LOST_AT_OTHER_MODES, other);
    evaluate_now(c, &c->model->tapes.rates, c->rhs);
    move_on(c, g, c->rhs, -1);
}

Result gradient_through(Instance *c, Result (*pass)(Instance *c), int start) {
    Gradient *g = c->gradient;
    if (g == NULL || c->passing) return pass(c);
    for (int j = 0; j < g->n && start; j++) {
        g->lost = 0;
        g->tangents[j].shift = 0;
        memset(g->tangents[j].now, 0, c->n_smooth * sizeof(double));
        g->tangents[j].now[g->tangents[j].place] = 1;
    }
    if (!start && g->lost == 0) find_shifts(c, g);
    g->n_rounds = 0;
    if (!state_copy_out(c, &g->before)) return RESULT_ERROR;
    Result result = pass(c);
    if (!result || g->lost != 0) return result;
    if (!state_copy_out(c, &g->behind)) return RESULT_ERROR;
    if (!start) check_shifts(c, g);
    if (g->lost == 0) pass_tangents(c, g, pass);
    return RESULT_OK;
}

void gradient_end(Instance *c) {
    Gradient *g = c->gradient;
    if (g == NULL) return;
    state_release(c, &g->before);
    state_release(c, &g->behind);
    c->release(g);
    c->gradient = NULL;
}

/* Room for derivatives by n values; NULL if there is no memory. */
static Gradient *gradient_new(const Instance *c, size_t n) {
    size_t own = sizeof(Gradient) / 8 + 1, n_y = (size_t)c->model->n_unknowns, list = n * sizeof(Tangent) / 8 + 1;
    size_t marks = MOST_ROUNDS * (size_t)c->model->n_transitions / 8 + 1, one = 2 * c->n_smooth + N_STAGES * n_y;
    double *memory = n > MOST_TANGENTS ? NULL : c->allocate(own + n_y + marks + list + n * one, 8);
    Gradient *g = (Gradient *)(void *)memory;
    if (g == NULL) return NULL;
    g->n = (int)n;
    g->rates = memory + own;
    g->rounds = (unsigned char *)(g->rates + n_y);
    g->tangents = (Tangent *)(void *)(g->rates + n_y + marks);
    for (size_t j = 0; j < n; j++) {
        double *now = g->rates + n_y + marks + list + j * one, *next = now + c->n_smooth;
        g->tangents[j] = (Tangent){.now = now, .next = next, .stages = next + c->n_smooth};
    }
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
        c->gradient->tangents[j].by = find_variable(c->model, by[j]);
        c->gradient->tangents[j].place = value_of(c, c->gradient->tangents[j].by) - c->numbers;
    }
    c->state.solved = 0;
    return 0;
}

int modelica_like_gradient(void *instance, const uint32_t of[], size_t n_of, double gradient[]) {
    Instance *c = instance;
    if (c == NULL || !allowed(c, "modelica_like_gradient", PHASE_EVENT | PHASE_STEP | PHASE_TERMINATED)) return 1;
    const Gradient *g = c->gradient;
    if (g == NULL || of == NULL || gradient == NULL) return !fail(c, NOT_ASKED, 0);
    if (g->lost != 0) return !fail_with(c, g->lost, g->lost_by, g->lost_at, 0);
    if (!check_unknowns(c, of, n_of) || !factor_implicit(c)) return 1;
    for (int j = 0; j < g->n; j++) {
        load_tangent(c, &g->tangents[j], 1);
        read_tangents(c, of, n_of, gradient + j, (size_t)g->n);
    }
    return 0;
}
