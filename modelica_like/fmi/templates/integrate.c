/* Co-Simulation: steps that run as far as accuracy allows, events located inside them, results interpolated. A step
 * does not end where a communication step ends: the importer's points are read from the dense output. Only where inputs
 * move does a step end there, so that their jumps fall between steps. */
#include "core.h"

#define MAX_REJECTIONS 60
#define SAME_POINT 1e-9 /* rounding of the importer's communication points */
#define SAME_PART 1e-6  /* of a fixed step */
#define LEAST_STEPS 50  /* per run, where time itself is in the equations: a pulse could hide between longer ones */

static void clear_pending(Instance *c) {
    c->state.event_pending = 0;
    memset(c->wanting, 0, (size_t)c->model->n_transitions);
}

static void leave_piece(Instance *c) {
    c->state.piece_valid = c->state.looked = c->look_valid = 0;
    clear_pending(c);
}

static double largest_step(const Instance *c) {
    double span = c->state.stop_time - c->state.start_time;
    if (c->model->n_x > 0 && !c->model->settings->rates_depend_on_time) return INFINITY;
    if (!c->state.stop_time_defined || !(span > 0)) return c->model->n_x == 0 ? 1e-3 : INFINITY;
    return span / LEAST_STEPS;
}

/* Below this, two times are the same. */
static double least_step(const State *s) { return 1e-15 * fmax(1, fabs(s->t)); }

/* Takes one step from the present point towards `limit`, shorter where accuracy or an event asks for it. */
static Result take_step(Instance *c, double limit) {
    State *s = &c->state;
    double *first = c->first, wished = s->step > 0 ? s->step : first_step(c);
    double least = least_step(s);
    int rejected = 0;
    memcpy(first, c->x, c->model->n_unknowns * sizeof(double));
    wished = fmin(wished, largest_step(c));
    for (int n = 0; n < MAX_REJECTIONS; n++) {
        double error, factor, h = wished;
        int cut = s->t + 1.0001 * h >= limit;
        if (cut) h = limit - s->t;
        clear_pending(c);
        if (h < least || !isfinite(h)) break;
        error = rosenbrock_step(c, s->t, first, h, rejected > 0, c->piece);
        if (!(error >= 0 && isfinite(error))) error = 1e30;
        if (cut) c->piece->end = limit;
        factor = 0.9 * pow(fmax(error, 1e-10), -0.2);
        if (error > 1 || !solve_implicit(c, c->piece->end, last_of(c->model, c->piece), 1) ||
            (c->model->n_guards > 0 && !search_events(c))) {
            rejected++;
            s->n_rejected++;
            wished = h * (error > 1 ? fmax(0.1, factor) : 0.25);
            continue;
        }
        s->n_steps++;
        factor = fmin(factor, rejected ? 1 : 6);
        s->step = cut ? fmax(wished, h * factor) : h * factor;
        s->piece_valid = 1;
        if (c->log_enabled & LOG_INTEGRATOR)
            report(c, LOG_INTEGRATOR, RESULT_OK, "t = %.12g s: step %.3e s, error %.2e of the tolerance, %d rejected",
                c->piece->end, c->piece->end - c->piece->begin, error, rejected);
        return RESULT_OK;
    }
    leave_piece(c);
    return fail(c,
        "The integrator gave up at t = %.12g s: the step became too small. Look for a stiff spring, a vanishing "
        "mass or a speed without bound.",
        s->t);
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

static Result pass_event(Instance *c) {
    State *s = &c->state;
    unsigned char *wanting = nothing_wanting(c);
    int located = s->event_pending, ticks = !located && (c->model->n_moments > 0 || delays_due(c));
    size_t size = (size_t)c->model->n_x * sizeof(double);
    double *x = c->first, *rates = c->first_rates, step = s->step, events = s->n_events;
    if (located) memcpy(wanting, c->wanting, c->model->n_transitions);
    leave_piece(c);
    s->at_event = 0;
    s->step = 0;
    s->z_valid = 0;
    if (!settle(c) || !reach_instant(c)) return RESULT_ERROR;
    if (ticks) evaluate_now(c, &c->model->tapes.rates, rates);
    memcpy(x, c->x, size);
    if (!iterate_events(c, wanting, located)) return RESULT_ERROR;
    s->z_valid = 1;
    if (!leave_instant(c, s->n_events != events)) return RESULT_ERROR;
    if (!ticks || memcmp(x, c->x, size) != 0) return RESULT_OK;
    evaluate_now(c, &c->model->tapes.rates, c->rhs);
    if (memcmp(rates, c->rhs, size) == 0) s->step = step; /* a tick without effect on what moves */
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

int is_due(Instance *c) { return delays_due(c) || (c->model->n_moments > 0 && find_wanting(c, nothing_wanting(c), 0)); }

/* Fixed steps go to whole numbers of them only. */
Result check_whole(Instance *c, double size) {
    double fixed = c->model->settings->fixed_step;
    if (!(fixed > 0) || (fabs(size / fixed - floor(size / fixed + 0.5)) <= SAME_PART && size > 0.5 * fixed))
        return RESULT_OK;
    return fail(c, "The step of %.9g s is not a whole number of fixed steps of %.9g s, for which the model was made.",
        size, fixed);
}

/* Checks what the importer asks for and says where the step ends. */
Result check_step(Instance *c, double point, double size, double *target) {
    State *s = &c->state;
    double slack = SAME_POINT * fmax(1, fabs(s->t));
    *target = point + size;
    if (!isfinite(point) || fabs(point - s->t) > slack)
        return fail(c, "The communication point is %.12g s, but the instance is at %.12g s.", point, s->t);
    if (!(size > 0) || !isfinite(*target)) return fail(c, "The communication step size %g s is not positive.", size);
    if (!check_whole(c, size)) return RESULT_ERROR;
    if (!s->stop_time_defined || *target <= s->stop_time) return RESULT_OK;
    if (*target > s->stop_time + slack)
        return fail(c, "The step to %.12g s goes beyond the stop time %.12g s.", *target, s->stop_time);
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
        if (s->at_event && stop_at_events) return AT_EVENT;
        if (s->at_event && !handle_event(c)) return FAILED;
        if (!(s->t < target)) return REACHED;
        if (!s->piece_valid && target - s->t < least_step(s)) {
            /* An event was located a rounding error before the target. */
            s->t = target;
            return REACHED;
        }
        if (!s->piece_valid) {
            double limit = s->stop_time_defined && s->stop_time >= target ? s->stop_time : INFINITY;
            limit = fmin(limit, next_moment(c));
            if (held) limit = fmin(limit, target);
            if (!take_step(c, limit)) return FAILED;
        }
        if (c->piece->end > target) return move_to(c, target) ? REACHED : FAILED;
        keep_piece(c, c->piece->end);
        if (!move_to(c, c->piece->end)) return FAILED;
        s->piece_valid = 0;
        s->at_event = s->event_pending || is_due(c);
        if (s->at_event && stop_at_events) return AT_EVENT;
        if (s->at_event && !handle_event(c)) return FAILED;
        if (c->step_finished != NULL) target = fmin(target, fmax(c->step_finished(c), s->t));
    }
}
