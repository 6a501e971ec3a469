/* Consistent start values and modes: tables say which start values determine what, Newton's method does the rest. */
#include "core.h"

#define MAX_NEWTON 50
#define CONSISTENT 1e-8           /* relative distance of start values that are the same */
#define SHARE (1.0 / 16)          /* by which actual expressions grow at once: powers of 2 end at 1 exactly */
#define LEAST_SHARE (1 / 16384.0) /* smaller ones mean that the solution turns back or ends */
#define AT_REST (-1)              /* in place of a start value: the variable is zero */

/* Start values as the model says, or as they were given. */
void start_values(Instance *c) {
    evaluate_now(c, &c->model->tapes.start_values, c->start_values);
    for (int k = 0; k < c->model->n_starts; k++)
        if (c->start_given[k]) c->start_values[k] = c->start_value[k];
}

/* The same of modes and discrete values, as work that the next evaluation of guards overwrites. */
const double *discrete_starts(Instance *c) {
    evaluate_now(c, &c->model->tapes.discrete_starts, c->guards);
    for (int k = 0; k < c->model->n_d; k++)
        if (c->mode_given[k]) c->guards[k] = c->mode_value[k];
    return c->guards;
}

Result apply_fixed(Instance *c) {
    const Model *m = c->model;
    unsigned char *known = memset(c->known, 0, (size_t)m->n_x);
    double *x = c->x;
    for (int k = 0; k < m->n_start_direct; k++) {
        const StartOf *one = &m->start_direct[k];
        double value = c->start_values[one->start] / one->factor;
        if (known[one->position] && fabs(value - x[one->position]) > CONSISTENT * (1 + fabs(x[one->position])))
            return fail(c, STARTS_CONTRADICT, one->start, x[one->position], value);
        if (!known[one->position]) x[one->position] = value;
        known[one->position] = 1;
    }
    return RESULT_OK;
}

/* Keeps the present point: states and implicit unknowns, d, d before; or goes back to the kept one. Returns that. */
const double *keep_start(Instance *c, KeptStart which, int back) {
    size_t n = (size_t)c->model->n_unknowns, n_d = (size_t)c->model->n_d, sizes[] = {n, n_d, n_d};
    double *kept = c->kept_starts + which * (n + 2 * n_d), *next = kept, *parts[] = {c->x, c->d, c->d_before};
    for (int k = 0; k < 3; next += sizes[k++])
        memcpy(back ? parts[k] : next, back ? next : parts[k], sizes[k] * sizeof(double));
    return kept;
}

/* Guesses, or defaults: they contradict nothing. */
static void apply(Instance *c, const StartOf *starts, int count) {
    for (int k = 0; k < count; k++) c->x[starts[k].position] = c->start_values[starts[k].start] / starts[k].factor;
}

void apply_defaults(Instance *c) { apply(c, c->model->start_default, c->model->n_start_default); }

/* An unknown of the start system: a state, an implicit unknown, or a variable that follows. */
static double *start_unknown(Instance *c, int k) {
    int column = c->model->start_columns[k], follows = column - c->model->n_unknowns;
    return follows < 0 ? c->x + column : c->slots + c->model->slot_y + follows;
}

/* Sizes of the terms of every row of the start system: the scale of rounding. */
static void measure_rows(Instance *c, double *sizes) {
    const QrPattern *a = &c->model->start;
    memset(sizes, 0, (size_t)a->size * sizeof(double));
    for (int j = 0; j < a->size; j++)
        for (int k = a->colind[j]; k < a->colind[j + 1]; k++)
            sizes[a->row[k]] += fabs(c->jacobian[k] * *start_unknown(c, j));
}

/* How far the start system is from its requested values. */
static void start_errors(Instance *c, double *errors) {
    evaluate_now(c, &c->model->tapes.start_system, c->start_residual);
    for (int k = 0; k < c->model->n_start_unknowns; k++) {
        int given = c->model->start_rows[k].start;
        errors[k] = c->start_residual[c->model->start_rows[k].row] - (given == AT_REST ? 0 : c->start_values[given]);
    }
}

/* Size of a step in the unknowns that are kept. */
static double start_step_size(const Instance *c, const double *step) {
    double size = 0;
    for (int k = 0; k < c->model->n_start_unknowns; k++)
        size = isfinite(step[k]) ? max_of(size, fabs(step[k]) / (1 + fabs(c->start_kept[k]))) : INFINITY;
    return size;
}

/* The same as solve_damped, of the start system. Tells whether it came to rest. */
static int damp_start(Instance *c) {
    const Model *m = c->model;
    double *step = c->start_unknowns, *next = c->start_next, part = 1;
    for (int round = 0; round < MAX_DAMPED && part >= LEAST_PART; round++) {
        start_errors(c, step);
        memcpy(c->start_errors, step, (size_t)m->n_start_unknowns * sizeof(double));
        tape_run(&m->tapes.start_jacobian, c->slots, c->jacobian);
        measure_rows(c, c->start_sizes);
        if (!qr_factor(&m->start, c->jacobian, c)) return 0;
        qr_solve(&m->start, c, step);
        for (int k = 0; k < m->n_start_unknowns; k++) c->start_kept[k] = *start_unknown(c, k);
        double size = start_step_size(c, step);
        if (size <= SOLVED_DAMPED || !(size < INFINITY)) return size < INFINITY;
        for (part = 1; part >= LEAST_PART; part /= 2) {
            for (int k = 0; k < m->n_start_unknowns; k++) *start_unknown(c, k) = c->start_kept[k] - part * step[k];
            start_errors(c, next);
            qr_solve(&m->start, c, next);
            if (start_step_size(c, next) <= (1 - part / 4) * size) break;
        }
    }
    return 0;
}

static int start_is_met(const Instance *c) {
    for (int k = 0; k < c->model->n_start_unknowns; k++)
        if (!(fabs(c->start_errors[k]) < CONSISTENT * (1 + c->start_sizes[k]))) return 0;
    return 1;
}

/* Where the search begins: free states, and zeros for the variables that follow from them, or what follows. Each pass
 * gives the next of these its value. */
static void place_start(Instance *c, int follow) {
    const Model *m = c->model;
    double *y = c->slots + m->slot_y;
    memcpy(c->x, c->first, (size_t)m->n_unknowns * sizeof(double));
    memset(y, 0, m->n_y * sizeof(double));
    for (int pass = 0, changed = follow; pass <= m->n_y && changed; pass++) {
        evaluate_now(c, &m->tapes.start_system, c->start_residual);
        changed = 0;
        for (int k = 0; k < m->n_y; k++)
            if (isfinite(c->start_residual[k]) && c->start_residual[k] != 0) y[k] -= c->start_residual[k], changed = 1;
    }
}

/* Newton's method on the equations between free states, the variables that follow from them, and start values. Tells
 * whether it came to rest. */
static int newton_start(Instance *c) {
    const Model *m = c->model;
    int n = m->n_start_unknowns, met = 1;
    double *step = c->start_unknowns, *error = c->start_errors, *sizes = c->start_sizes;
    memset(sizes, 0, (size_t)n * sizeof(double));
    for (int round = 0; round < MAX_NEWTON; round++) {
        double change = 0;
        int rounding = 1;
        start_errors(c, error);
        tape_run(&m->tapes.start_jacobian, c->slots, c->jacobian);
        for (int k = 0; k < n; k++) {
            step[k] = error[k];
            rounding &= fabs(error[k]) <= DBL_EPSILON * sizes[k];
        }
        if (rounding) break;
        met = qr_factor(&m->start, c->jacobian, c);
        if (!met) break;
        qr_solve(&m->start, c, step);
        for (int k = 0; k < n; k++) {
            double *unknown = start_unknown(c, k);
            *unknown -= step[k];
            change = max_of(change, fabs(step[k]) / (1 + fabs(*unknown)));
        }
        measure_rows(c, sizes);
        if (change <= 1e-13) break;
    }
    return met;
}

static Result solve_start_system(Instance *c) {
    const Model *m = c->model;
    if (m->n_start_unknowns == 0) return RESULT_OK;
    for (int k = 0; k < m->n_start_zero; k++) c->x[m->start_zero[k]] = 0;
    memcpy(c->first, c->x, (size_t)m->n_unknowns * sizeof(double));
    for (int follow = 0; follow < 2; follow++) {
        place_start(c, follow);
        if (newton_start(c) && start_is_met(c)) return RESULT_OK;
        place_start(c, follow);
        if (damp_start(c) && start_is_met(c)) return RESULT_OK;
    }
    place_start(c, 0); /* for the message */
    return fail(c, START_NOT_FOUND, 0);
}

static Result check_dependent(Instance *c) {
    const Model *m = c->model;
    if (m->n_start_dependent == 0) return RESULT_OK;
    variables_now(c);
    for (int k = 0; k < m->n_start_dependent; k++) {
        double value = c->start_values[m->start_dependent[k].start], actual = c->variables[m->start_dependent[k].node];
        if (!(fabs(actual - value) <= CONSISTENT * (1 + fabs(value))))
            return fail(c, START_NOT_MET, value, m->start_dependent[k].start, actual);
    }
    return RESULT_OK;
}

/* Equations of discrete variables, whose values before the start are their start values. */
static void start_equations(Instance *c) {
    const Model *m = c->model;
    double *values = c->reset_values;
    if (m->n_updates == 0) return;
    const double *starts = discrete_starts(c);
    for (int k = 0; k < m->n_updates; k++)
        if (m->updates[k].at_start >= 0) c->d[m->updates[k].at_start] = starts[m->updates[k].at_start];
    evaluate_now(c, &m->tapes.updates, values);
    for (int k = 0; k < m->n_updates; k++)
        if (m->updates[k].at_start >= 0) c->d[m->updates[k].at_start] = values[k];
}

/* Choose modes that are not decided by their start conditions: the first that holds wins. */
static void choose_modes(Instance *c) {
    evaluate_now(c, &c->model->tapes.start_conditions, c->guards);
    for (int k = 0; k < c->model->n_start_modes; k++) {
        const StartMode *one = &c->model->start_modes[k];
        if (c->guards[k] == 0 || c->decided[one->mode]) continue;
        c->decided[one->mode] = 1;
        c->d[one->mode] = one->target;
    }
}

/* What an impact knocks loose takes the mode that its start would take. */
void choose_loose(Instance *c, const unsigned char *loose) {
    const Model *m = c->model;
    double *d = c->respond_d;
    memcpy(d, c->d, (size_t)m->n_d * sizeof(double));
    memset(c->decided, 1, (size_t)m->n_d);
    const double *starts = discrete_starts(c);
    for (int k = 0; k < m->n_holds; k++) {
        int mode = m->holds[k].mode;
        if (!loose[k]) continue;
        c->d[mode] = starts[mode];
        c->decided[mode] = 0;
    }
    choose_modes(c);
    for (int k = 0; k < m->n_holds; k++) {
        int mode = m->holds[k].mode, chosen = (int)c->d[mode];
        if (chosen == (int)d[mode]) continue;
        c->d[mode] = d[mode];
        note_change(c, m->holds[k].name, -1, mode, chosen);
        c->d[mode] = d[mode] = chosen;
    }
}

/* What slides one way where it began the other way (`begun`, if there is a steady state before) is held: equilibrium
 * lies in between, where it stands still. Others may be asked to be as `declared`. Tells whether a mode changed. */
int choose_start_modes(Instance *c, const double *begun, int declared) {
    const Model *m = c->model;
    memcpy(c->decided, c->mode_given, (size_t)m->n_d);
    memcpy(c->d_before, c->d, (size_t)m->n_d * sizeof(double));
    choose_modes(c);
    if (declared) memcpy(c->decided, c->mode_given, (size_t)m->n_d);
    for (int k = 0; k < m->n_holds && declared; k++) c->decided[m->holds[k].mode] = 1;
    const double *starts = discrete_starts(c);
    for (int k = 0; k < m->n_start_modes; k++)
        if (!c->decided[m->start_modes[k].mode]) c->d[m->start_modes[k].mode] = starts[m->start_modes[k].mode];
    if (begun) variables_now(c);
    for (int k = 0; k < m->n_holds && begun; k++) {
        const Held *one = &m->holds[k];
        if (begun[k] * c->variables[one->motion] < 0 && c->d[one->mode] != c->d_before[one->mode])
            c->d[one->mode] = one->number;
    }
    start_equations(c);
    return memcmp(c->d_before, c->d, (size_t)m->n_d * sizeof(double)) != 0;
}

/* Held motions within rounding rest; the rest follows. */
Result complete_start(Instance *c) {
    rest(c);
    replace_dependent(c);
    return solve_now(c, 0) && check_singular(c);
}

/* States from start values, which may depend on modes, and modes, which depend on states. */
static Result find_start(Instance *c) {
    for (int round = 0; round < MODE_ROUNDS; round++) {
        Result found = apply_fixed(c) && solve_start_system(c) && solve_now(c, 0) && check_dependent(c);
        /* What is not found may be found in the modes that belong to the guesses. */
        if (!choose_start_modes(c, NULL, 0)) return found && complete_start(c);
        share(c);
    }
    return fail(c, START_NOT_SETTLED, 0);
}

/* Guesses and declared modes, from which all begins; homotopies begin with what is simplified. */
void begin_start(Instance *c) {
    const Model *m = c->model;
    memcpy(c->x, m->guesses, m->n_unknowns * sizeof(double));
    memset(c->d, 0, m->n_d * sizeof(double));
    memcpy(c->d, discrete_starts(c), m->n_d * sizeof(double));
    if (m->settings->homotopy >= 0) c->d[m->settings->homotopy] = 0;
    share(c);
    start_values(c);
    apply(c, m->start_guess, m->n_start_guess);
}

/* The solution of what is simplified is led to that of the actual expressions. */
static Result lead(Instance *c) {
    int place = c->model->settings->homotopy, steady = c->model->settings->steady;
    double step = SHARE, led = 0; /* of its own: a damaged model may have the place of a mode */
    begin_start(c);
    if (!(steady ? start_steady(c) : find_start(c))) return RESULT_ERROR;
    while (place >= 0 && led < 1) {
        double next = min_of(led + step, 1);
        keep_start(c, KEPT_LED, 0);
        c->d[place] = next;
        share(c);
        if (steady ? find_steady(c, 0, 0) : find_start(c)) {
            led = next;
            continue;
        }
        step /= 2;
        if (step < LEAST_SHARE) return RESULT_ERROR;
        keep_start(c, KEPT_LED, 1);
    }
    if (!steady) return RESULT_OK;
    keep_start(c, KEPT_LED, 0);
    if (!check_ticks(c)) return RESULT_ERROR;
    keep_start(c, KEPT_LED, 1);
    return RESULT_OK;
}

static Result pass_start(Instance *c) {
    if (!check_tables(c)) return RESULT_ERROR;
    c->trying = 1; /* what fails may be found in another way */
    Result result = lead(c);
    c->trying = 0;
    if (!result) return fail_with(c, c->tried.code, c->tried.values[0], c->tried.values[1], c->tried.values[2]);
    c->state.z_valid = c->state.solved = 1;
    c->state.piece_valid = c->state.event_pending = c->variables_valid = 0;
    return RESULT_OK;
}

/* States from parameters and start values; events at the start have not happened yet. */
Result start_solve(Instance *c) { return gradient_through(c, pass_start, 1); }
