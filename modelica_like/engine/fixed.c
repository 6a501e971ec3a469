/* Co-Simulation in fixed steps with a bound on the work of every step, for hardware in the loop. The method is that of
 * integrate.c: eight stages, one factorisation, order five; a step from one point to the next is a piece. Every
 * further piece of a step, every round of events, every impact and every try at a zero that misses it takes one from
 * BUDGET; when one is left, no more is begun, and what is still to do comes at the beginning of the next step. So modes
 * change at no more than two places inside of a step, and a step costs at most that of BUDGET + 2 pieces or rounds.
 * Where `bounded` is set, iterations that would ask for accuracy end early: the implicit equations are solved by one
 * Newton iteration where they are linear, by three else (tape.c), and what holds the same motion shares it by
 * capacities, without a second trial (holds.c). Nothing is allocated, and nothing outside of the run-time is called but
 * arithmetic and copies, unless logging is on or the step fails. */
#include "core.h"

#define BUDGET 4
#define BEHIND 1e-4 /* of the piece: so far behind the zero of its cubic a guard is taken for positive */
#define QUIET 2

/* The part of the piece at which the first guard becomes positive, by the cubic through values and rates at both ends,
 * or a parabola where no rates are known at the begin. */
static double first_zero(const Instance *c, const double *first, int rates_known) {
    int n = c->model->n_guards;
    const double *last = c->looks;
    double part = 1, h = c->piece->end - c->piece->begin;
    for (int g = 0; g < n; g++) {
        double g0, r0, r1 = isfinite(last[n + g]) ? h * last[n + g] : 0;
        if (!guard_active(c, g) || !(number_or_false(c, g, last[g]) > 0)) continue;
        g0 = min_of(number_or_false(c, g, first[g]), 0);
        r0 = rates_known ? h * first[n + g] : 2 * (last[g] - g0) - r1;
        part = min_of(part, cubic_guess(g0, isfinite(r0) ? r0 : 0, last[g], r1) + BEHIND);
    }
    memcpy(c->looks + 2 * n, first, (size_t)n * sizeof(double));
    return part;
}

/* The same after a try at `part`, where none has been positive: by the parabola through the try before, this one and
 * the end. */
static double next_zero(Instance *c, double before, double part, double behind) {
    int n = c->model->n_guards;
    double *last = c->looks, *first = last + 2 * n, *now = c->guards, next = 1;
    for (int g = 0; g < n; g++) {
        double v0 = min_of(number_or_false(c, g, first[g]), 0), v1 = min_of(number_or_false(c, g, now[g]), 0), slope,
               bend, zero;
        if (!guard_active(c, g) || !(number_or_false(c, g, last[g]) > 0)) continue;
        slope = (v1 - v0) / (part - before);
        bend = ((last[g] - v1) / (1 - part) - slope) / (1 - before);
        slope += bend * (part - before);
        zero = -2 * v1 / (slope + sqrt(max_of(slope * slope - 4 * bend * v1, 0)));
        if (zero > 0) next = min_of(next, part + zero + behind);
    }
    memcpy(first, now, (size_t)n * sizeof(double));
    return next;
}

/* The same for the whole piece, at whose end guards are evaluated; QUIET where none is positive there. */
static double first_crossing(Instance *c, int behind_event) {
    Piece *piece = c->piece;
    int n = c->model->n_guards, any = 0;
    double *last = c->looks;
    evaluate(c, &c->model->tapes.guards, piece->end, last_of(c->model, piece), last);
    for (int g = 0; g < n; g++) any |= guard_active(c, g) && number_or_false(c, g, last[g]) > 0;
    if (any && behind_event) return first_zero(c, c->guards, 0); /* as the last round has left them */
    if (any && !c->state.looked) evaluate(c, &c->model->tapes.guards, piece->begin, piece->points, c->end_look);
    if (any) return first_zero(c, c->end_look, 1);
    memcpy(c->end_look, last, 2 * (size_t)n * sizeof(double));
    c->state.looked = 1;
    return QUIET;
}

/* Fires what wants to fire at the present point; tells whether anything did. */
static Result fire_here(Instance *c, int *fired) {
    unsigned char *wanting = nothing_wanting(c);
    c->state.at_event = c->state.looked = 0;
    *fired = find_wanting(c, wanting, 1);
    return !*fired || iterate_events(c, wanting, 1);
}

/* Goes from the present point to `limit`, or to an event before it while the budget allows for one. */
static Result go_on(Instance *c, double limit, int *fired) {
    double *first = c->first, begin = c->state.t, part = QUIET;
    int behind_event = *fired;
    *fired = 0;
    memcpy(first, c->x, c->model->n_unknowns * sizeof(double));
    if (rosenbrock_step(c, begin, first, limit - begin, 0, c->piece) < 0) return fail(c, FIXED_STEP_FAILED, begin);
    c->piece->end = limit;
    if (c->budget < 2) c->state.looked = !(c->state.at_event = 1);
    else if (c->model->n_guards > 0) part = first_crossing(c, behind_event);
    for (double before = 0, behind = 10 * BEHIND; part < 1 && c->budget > 1; c->budget--, behind *= 10) {
        double here = part;
        if (!move_to(c, begin + part * (limit - begin)) || !fire_here(c, fired)) return RESULT_ERROR;
        if (*fired) {
            c->budget--;
            return RESULT_OK;
        }
        part = next_zero(c, before, here, behind);
        before = here;
    }
    /* What is not met is taken at the end. */
    if (!move_to(c, limit)) return RESULT_ERROR;
    return part == QUIET ? RESULT_OK : fire_here(c, fired);
}

static Result one_step(Instance *c, double end) {
    State *s = &c->state;
    int fired = 0;
    c->budget = BUDGET;
    if (!take_changes(c) || (s->at_event && !fire_here(c, &fired))) return RESULT_ERROR;
    while (s->t < end && !s->ended) {
        double moment = c->budget >= 2 ? next_moment(c, 1) : INFINITY;
        if (!go_on(c, min_of(end, moment), &fired)) return RESULT_ERROR;
        if (fired || s->at_event || !is_due(c)) continue;
        if (!fire_here(c, &fired)) return RESULT_ERROR;
        c->budget -= s->t < end;
    }
    s->n_steps++;
    return RESULT_OK;
}

/* Goes to `target`, a whole number of fixed steps away (see check_step), or to where the importer wants to stop. */
Arrival step_fixed(Instance *c, double target) {
    double begin = c->state.t, h = c->model->settings->fixed_step, until = target;
    int n = (int)(0.5 + (target - begin) / h), done = 1;
    c->bounded = 1;
    for (int k = 1; k <= n && done && c->state.t < until && !c->state.ended; k++) {
        done = one_step(c, k < n ? begin + k * h : target);
        if (done && c->step_finished != NULL) until = min_of(until, c->step_finished(c));
    }
    c->bounded = 0;
    return done ? REACHED : FAILED;
}
