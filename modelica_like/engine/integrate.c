/* Co-Simulation: steps that run as far as accuracy allows, events located inside them, results interpolated. A step
 * does not end where a communication step ends: the importer's points are read from the dense output. Only where inputs
 * move does a step end there, so that their jumps fall between steps. */
#include "core.h"
#include "rodas.h"

#define MAX_REJECTIONS 60
#define LEAST_OVER_EDGE 10 /* of the least step: no error is asked of shorter ones at an edge */
#define MAX_LANDINGS 8     /* on edges: what switches without end is integrated as it is written */
#define SHRINKS 0.1        /* a piece of another integrator in which guards do not behave */
#define OWN_STEPS 8        /* where a guard is within the tolerances of another integrator: it asks again soon */
#define SAME_POINT 1e-9    /* rounding of the importer's communication points */
#define SAME_PART 1e-6     /* of a fixed step */
#define LEAST_STEPS 50     /* per run, where time itself is in the equations: a pulse could hide between longer ones */

/* The right hand side, its partial derivatives by time, with inputs on their straight lines, and its Jacobian. */
static void linearize(Instance *c, double t, const double *y, double *slope) {
    const Model *m = c->model;
    int moving = m->settings->rates_depend_on_time;
    for (int k = 0; k < m->n_u; k++) moving |= c->u_rate[k] != 0;
    memset(slope, 0, (size_t)m->n_unknowns * sizeof(double));
    if (moving) {
        load(c, t, y);
        memset(c->dots, 0, m->slot_results * sizeof(double));
        c->dots[0] = 1;
        for (int k = 0; k < m->n_u; k++) c->dots[m->slot_u + k] = c->u_rate[k];
        run_slopes(c, c->first_rates, slope);
    } else evaluate_special(c, &m->tapes.rates, t, y, c->first_rates);
    run_special(c, &m->tapes.jacobian, c->jacobian);
}

/* M * diagonal - J, factorised; compiled code keeps its factors as it wants them. */
int factor_step(Instance *c, double diagonal) { return factor_by_code(c, diagonal) || factor_by_pattern(c, diagonal); }

int factor_by_pattern(Instance *c, double diagonal) {
    const Model *m = c->model;
    memset(c->matrix, 0, (size_t)m->step.n_nonzeros * sizeof(double));
    for (int k = 0; k < m->n_jacobian; k++) c->matrix[m->jacobian_to_step[k]] = -c->jacobian[k];
    for (int k = 0; k < m->n_x; k++) c->matrix[m->step_diagonal[k]] += diagonal;
    return factor_matrix(c);
}

/* As a step of length h from a point would. */
int factor_at(Instance *c, double t, const double *first, double h) {
    linearize(c, t, first, c->stages);
    return factor_step(c, step_diagonal(h));
}

double error_norm(const Instance *c, const double *first, const double *last, const double *error) {
    double sum = 0, rtol = c->state.tolerance, atol = c->state.absolute;
    if (c->model->n_x == 0) return 0;
    for (int k = 0; k < c->model->n_x; k++) {
        double weight = rtol * max_of(fabs(first[k]), fabs(last[k])) + atol * c->model->nominals[k];
        sum += (error[k] / weight) * (error[k] / weight);
    }
    return sqrt(sum / c->model->n_x);
}

/* The stages of a step, and what its piece has of them; returns 0 if the equations gave values that are not finite.
 * straight_step.py writes the same. */
static int take_stages(Instance *c, const Step *a) {
    int n = c->model->n_unknowns;
    double *y = c->point, factors[STAGES], one = 1;
    for (int i = 0; i < STAGES; i++) {
        double *stage = a->stages + (size_t)i * n, by_time = a->h * RODAS_D_TIME[i];
        if (i < LAST_POINTS) combine(n, a->first, i, RODAS_A[i], a->stages, n, y);
        else combine(n, y, 1, &one, stage - n, n, y);
        if (i == 0) memcpy(stage, a->rates, (size_t)n * sizeof(double));
        else {
            load_point(c, a->t + RODAS_TIME[i] * a->h, y);
            run_special(c, &c->model->tapes.rates, stage);
        }
        for (int j = 0; j < i; j++) factors[j] = RODAS_C[i][j] / a->h;
        combine(c->model->n_x, stage, i, factors, a->stages, n, stage);
        combine(n, stage, 1, &by_time, a->slope, n, stage);
        if (!all_finite(n, stage)) return 0;
        solve_step(c, stage);
    }
    combine(n, y, 1, &one, a->stages + (size_t)(STAGES - 1) * n, n, a->last);
    memset(a->last + n, 0, 3 * (size_t)n * sizeof(double));
    for (size_t k = 0; k < 3; k++) {
        double *row = a->last + (k + 1) * (size_t)n;
        combine(n, row, STAGES, RODAS_DENSE[k], a->stages, n, row);
    }
    return all_finite(n, a->last);
}

/* Steps from `first` at t to t + h. With `keep_jacobian` that of the step before from the same point is used.
 * Returns the error in tolerances, or -1 if the equations gave values that are not finite, or a singular matrix. */
double rosenbrock_step(Instance *c, double t, const double *first, double h, int keep_jacobian, Piece *piece) {
    int n = c->model->n_unknowns;
    double *last = last_of(c->model, piece), *slope = c->stages + (size_t)STAGES * (size_t)n;
    Step step = {t, h, c->state.u_time, first, c->first_rates, slope, c->u, c->u_rate, c->lu, c->lu_pivots, c->lu_last,
        c->last_order, c->stages, last};
    piece->begin = t;
    piece->end = t + h;
    memcpy(piece->points, first, (size_t)n * sizeof(double));
    if (!keep_jacobian) linearize(c, t, first, slope);
    if (!factor_step(c, step_diagonal(h))) return -1;
    c->state.n_evaluations += STAGES - keep_jacobian;
    int finite = take_stages_by_code(c, &step);
    if (!(finite < 0 ? take_stages(c, &step) : finite)) return -1;
    return error_norm(c, first, last, c->stages + (STAGES - 1) * n);
}

/* Of the matrix of a step of length h. */
double step_diagonal(double h) { return 1 / (h * RODAS_GAMMA); }

/* A first step at which states change by a hundredth (Hairer, Norsett & Wanner I, II.4); states that are nothing but
 * rounding tell nothing about it. */
double first_step(Instance *c) {
    double size, speed, *rates = c->rhs;
    values_now(c, &c->model->tapes.rates, rates);
    size = error_norm(c, c->x, c->x, c->x);
    speed = error_norm(c, c->x, c->x, rates);
    if (!isfinite(speed) || c->model->n_x == 0) return 1e-3;
    if (size < 1e-5 || speed < 1e-5) return 1e-6;
    return max_of(0.01 * size / speed, TIME_RESOLUTION * max_of(1, fabs(c->state.t)));
}

static void clear_pending(Instance *c) {
    c->state.event_pending = 0;
    memset(c->wanting, 0, (size_t)c->model->n_transitions);
}

static void leave_piece(Instance *c) {
    c->state.piece_valid = c->state.panel_valid = c->state.looked = c->look_valid = c->edges_valid = 0;
    clear_pending(c);
}

static double largest_step(const Instance *c) {
    double span = c->state.stop_time - c->state.start_time,
           longest = c->state.longest > 0 ? c->state.longest : INFINITY;
    if (c->model->n_x > 0 && !c->model->settings->rates_depend_on_time) return longest;
    if (!c->state.stop_time_defined || !(span > 0)) return c->model->n_x == 0 ? min_of(longest, 1e-3) : longest;
    return min_of(longest, span / LEAST_STEPS);
}

/* Below this, two times are the same. */
double least_step(const State *s) { return 1e-15 * max_of(1, fabs(s->t)); }

static void take_piece(Instance *c) {
    c->state.n_steps++;
    c->state.piece_valid = 1;
    keep_edges(c);
}

/* Whether a step has moved a state against a rate by which it would go a hundred times as far as it is large: a step
 * that is long beside the growth or the swing of a state ends where these are balanced, and its errors look small. */
static int is_against_rate(const Instance *c, double h, const double *first, const double *last) {
    for (int k = 0; k < c->model->n_x; k++) {
        double moved = last[k] - first[k], asked = h * c->first_rates[k], size = max_of(fabs(first[k]), fabs(last[k]));
        if (asked * moved < 0 && fabs(asked) > 100 * size &&
            fabs(moved) > c->state.tolerance * size + c->state.absolute * c->model->nominals[k])
            return 1;
    }
    return 0;
}

/* Takes one step from the present point towards `limit`, shorter where accuracy or an event asks for it. */
static Result take_step(Instance *c, double limit) {
    State *s = &c->state;
    double *first = c->first, wished = s->step > 0 ? s->step : first_step(c);
    double least = least_step(s), most = INFINITY;
    int rejected = 0, landings = 0;
    memcpy(first, c->x, c->model->n_unknowns * sizeof(double));
    wished = min_of(wished, largest_step(c));
    for (int n = 0; n < MAX_REJECTIONS; n++) {
        double error, factor, h = wished;
        int cut = s->t + 1.0001 * h >= limit;
        if (cut) h = limit - s->t;
        clear_pending(c);
        if (h < least || !isfinite(h)) break;
        error = rosenbrock_step(c, s->t, first, h, rejected > 0, c->piece);
        memcpy(c->step_error, c->stages + (size_t)(STAGES - 1) * c->model->n_unknowns, c->model->n_x * sizeof(double));
        if (!(error >= 0 && isfinite(error)) || is_against_rate(c, h, first, last_of(c->model, c->piece))) error = 1e30;
        else if (error > 1 && h < LEAST_OVER_EDGE * least && is_over_edge(c)) error = 1;
        if (cut) c->piece->end = limit;
        factor = 0.9 * pow(max_of(error, 1e-10), -0.2);
        int solved = error <= 1 && solve_implicit(c, c->piece->end, last_of(c->model, c->piece), 1);
        double seen = solved && c->model->tapes.edges.n_outputs > 0 ? seen_length(c, least, &most) : INFINITY;
        if (seen < h && landings++ < MAX_LANDINGS) {
            rejected++;
            wished = seen;
            continue;
        }
        if (!solved || (c->model->n_guards > 0 && !c->passing && !search_events(c))) {
            rejected++;
            s->n_rejected++;
            wished = h * (error > 1 ? max_of(0.1, factor) : 0.25);
            continue;
        }
        factor = min_of(factor, rejected ? 1 : 6);
        s->step = min_of(cut ? max_of(wished, h * factor) : h * factor, most);
        take_piece(c);
        if (c->log_enabled & LOG_INTEGRATOR)
            report(c, LOG_INTEGRATOR, RESULT_OK, "t = %.12g s: step %.3e s, error %.2e of the tolerance, %d rejected",
                c->piece->end, c->piece->end - c->piece->begin, error, rejected);
        return RESULT_OK;
    }
    leave_piece(c);
    return fail(c, STEP_TOO_SMALL, s->t);
}

/* Goes on by a step towards a time, for derivatives, which ends at an edge in between. */
Result land_on_edges(Instance *c, double end) {
    int landed = c->lands;
    c->lands = 1;
    Result result = take_step(c, end);
    c->lands = landed;
    if (!result) return result;
    c->state.t = c->piece->end;
    memcpy(c->x, last_of(c->model, c->piece), (size_t)c->model->n_unknowns * sizeof(double));
    c->variables_valid = c->state.z_valid = c->state.piece_valid = 0;
    return settle(c);
}

static Result take_own(Instance *c, double limit) {
    Result result = take_step(c, limit);
    c->own_steps--;
    return result;
}

/* Takes the next piece of another integrator, shorter where an event asks for it; where only own steps can tell
 * whether there is one, the first of these. */
static Result take_given(Instance *c, double limit, double far) {
    State *s = &c->state;
    double end = limit;
    if (c->own_steps > 0) return take_own(c, limit);
    for (int n = 0; n < MAX_REJECTIONS && end - s->t >= least_step(s); n++) {
        clear_pending(c);
        c->doubtful = 0;
        if (!next_piece(c, end, far)) break;
        if (c->model->n_guards == 0 || search_events(c)) return take_piece(c), RESULT_OK;
        leave_piece(c);
        if (c->doubtful) {
            c->own_steps = OWN_STEPS;
            return take_own(c, limit);
        }
        far = end = s->t + (c->whole->begin > c->panel.begin ? 1 : SHRINKS) * (c->whole->end - s->t);
    }
    leave_piece(c);
    return fail(c, STEP_TOO_SMALL, s->t);
}

Result move_to(Instance *c, double t) {
    gradient_move(c, t);
    piece_at(c->model, c->piece, t, c->x);
    c->state.t = t;
    c->variables_valid = c->state.z_valid = 0;
    return settle(c);
}

/* Inputs, parameters or states moved from outside: go on from the present point. */
Result take_changes(Instance *c) {
    if (!c->state.inputs_changed) return RESULT_OK;
    if (!check_tables(c)) return RESULT_ERROR;
    leave_piece(c);
    c->state.inputs_changed = c->state.z_valid = c->variables_valid = 0;
    if (!renew(c) || !settle(c)) return RESULT_ERROR;
    c->state.at_event |= find_wanting(c, nothing_wanting(c), 1) || pushed(c);
    return leave_instant(c, 1);
}

/* Fires what wants to fire at this instant, and what follows; its states before are left in `first`. */
Result pass_instant(Instance *c, unsigned char *wanting, int located) {
    int whens = c->model->n_updates > 0 && c->model->n_guards > 0;
    size_t size = (size_t)c->model->n_x * sizeof(double);
    memcpy(c->first, c->x, size);
    memcpy(c->d_begun, c->d, (size_t)c->model->n_d * sizeof(double));
    if (!iterate_events(c, wanting, located)) return RESULT_ERROR;
    return whens && memcmp(c->first, c->x, size) != 0 ? check_turned_back(c) : RESULT_OK;
}

/* Has this instant changed nothing that equations of motion read? Of ticks that fall together, those have that did
 * before. */
static int was_idle(Instance *c, int ticks) {
    int idle = memcmp(c->first, c->x, (size_t)c->model->n_x * sizeof(double)) == 0, known = 0;
    for (int k = 0; k < c->model->n_d && idle; k++) idle = !c->felt[k] || c->d[k] == c->d_begun[k];
    for (int k = 0; k < c->model->n_transitions; k++) known |= c->ticking[k] && !c->idle[k];
    for (int k = 0; k < c->model->n_transitions && ticks; k++)
        if (c->ticking[k] && (idle || !known)) c->idle[k] = (unsigned char)idle;
    return idle;
}

/* Is this the instant of an event that was located? The present piece may also end at one that is still to come. */
int at_located_event(const State *s) { return s->event_pending && s->at_event; }

static Result pass_event(Instance *c) {
    State *s = &c->state;
    unsigned char *wanting = nothing_wanting(c);
    int located = at_located_event(s), ticks = !located && (c->model->n_moments > 0 || delays_due(c));
    size_t size = (size_t)c->model->n_x * sizeof(double);
    double *rates = c->first_rates, step = s->step, events = s->n_events;
    int panel_valid = s->panel_valid;
    if (located) memcpy(wanting, c->wanting, c->model->n_transitions);
    leave_piece(c);
    s->at_event = c->doubts = 0;
    s->step = 0;
    s->z_valid = 0;
    if (!settle(c) || !reach_instant(c)) return RESULT_ERROR;
    if (ticks) values_now(c, &c->model->tapes.rates, rates);
    if (ticks && find_wanting(c, wanting, 0)) memcpy(c->ticking, wanting, c->model->n_transitions);
    if (!pass_instant(c, wanting, located)) return RESULT_ERROR;
    s->z_valid = 1;
    if (!leave_instant(c, s->n_events != events)) return RESULT_ERROR;
    if (c->integrator != NULL && was_idle(c, ticks)) s->panel_valid = panel_valid;
    if (!ticks || memcmp(c->first, c->x, size) != 0) return RESULT_OK;
    values_now(c, &c->model->tapes.rates, c->rhs);
    if (memcmp(rates, c->rhs, size) == 0) s->step = step; /* a tick without effect on what moves now */
    return RESULT_OK;
}

Result handle_event(Instance *c) { return gradient_through(c, pass_event, 0); }

/* The end of a run is an event where discrete equations ask for it. */
Result finish(Instance *c) {
    int terminal = c->model->settings->terminal;
    if (terminal < 0 || c->d[terminal] != 0) return RESULT_OK;
    c->d[terminal] = 1;
    return handle_event(c);
}

/* Fixed steps go to whole numbers of them only. */
Result check_whole(Instance *c, double size) {
    double fixed = c->model->settings->fixed_step;
    if (!(fixed > 0) || (fabs(size / fixed - floor(size / fixed + 0.5)) <= SAME_PART && size > 0.5 * fixed))
        return RESULT_OK;
    return fail(c, NOT_WHOLE_STEPS, size, fixed);
}

/* Checks what the importer asks for and says where the step ends. */
Result check_step(Instance *c, double point, double size, double *target) {
    State *s = &c->state;
    double slack = SAME_POINT * max_of(1, fabs(s->t));
    *target = point + size;
    if (!isfinite(point) || fabs(point - s->t) > slack)
        return refuse(c, "The communication point is %.12g s, but the instance is at %.12g s.", point, s->t);
    if (!(size > 0) || !isfinite(*target)) return refuse(c, "The communication step size %g s is not positive.", size);
    if (!check_whole(c, size)) return RESULT_ERROR;
    if (!s->stop_time_defined || *target <= s->stop_time) return RESULT_OK;
    if (*target > s->stop_time + slack)
        return refuse(c, "The step to %.12g s goes beyond the stop time %.12g s.", *target, s->stop_time);
    *target = s->stop_time;
    return RESULT_OK;
}

/* Goes to `target`, or to the first event before it; inputs may also move where an internal step has ended. */
Arrival integrate_to(Instance *c, double target, int stop_at_events) {
    State *s = &c->state;
    int held = 0;
    if (c->model->settings->fixed_step > 0) return step_fixed(c, target);
    if (s->at_event && !handle_event(c)) return FAILED;
    for (;;) {
        held |= s->inputs_changed;
        if (!take_changes(c)) return FAILED;
        if (s->at_event && (stop_at_events || !handle_event(c))) return stop_at_events ? AT_EVENT : FAILED;
        if (!(s->t < target) || s->ended) return REACHED;
        if (!s->piece_valid && target - s->t < least_step(s)) {
            /* An event was located a rounding error before the target. */
            s->t = target;
            return REACHED;
        }
        if (!s->piece_valid) {
            double far = s->stop_time_defined && s->stop_time >= target ? s->stop_time : INFINITY;
            if (held) far = min_of(far, target);
            double limit = min_of(far, next_moment(c, 1));
            if (c->integrator != NULL) far = min_of(far, next_moment(c, 0));
            if (!(c->integrator != NULL ? take_given(c, limit, far) : take_step(c, limit))) return FAILED;
        }
        if (c->piece->end > target) return move_to(c, target) ? REACHED : FAILED;
        keep_piece(c, c->piece->end);
        if (!move_to(c, c->piece->end)) return FAILED;
        s->piece_valid = 0;
        s->at_event = s->event_pending || is_due(c);
        if (s->at_event && (stop_at_events || !handle_event(c))) return stop_at_events ? AT_EVENT : FAILED;
        if (c->step_finished != NULL) target = min_of(target, max_of(c->step_finished(c), s->t));
    }
}
