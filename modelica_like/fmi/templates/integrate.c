/* Co-Simulation: steps that run as far as accuracy allows, events located inside them, results interpolated.
 *
 * A step does not end where a communication step ends: the importer's points are read from the dense output. Only where
 * inputs move does a step end there, so that their jumps fall between steps.
 */
#include <math.h>
#include <string.h>
#include "core.h"

#define MIDDLE 0.45 /* of a step: where guards are looked at besides its end; not where a period might */
#define DEPTH 6     /* divisions of a step in which guards do not behave */
#define BEHAVES 0.05
#define LOCATED 1e-13
#define MAX_TRIALS 60
#define MAX_REJECTIONS 60
#define NEAR 0.1
#define SAME_POINT 1e-9 /* rounding of the importer's communication points */
#define SAME_PART 1e-6  /* of a fixed step */
#define LEAST_STEPS 50  /* per run, where time itself is in the equations: a pulse could hide between longer ones */

typedef struct { /* guards and their rates at a time within a step */
    double t, *values, *rates;
} Look;

static void clear_pending(Instance *c) {
    c->state.event_pending = 0;
    memset(c->wanting, 0, (size_t)c->model->n_transitions);
}

void leave_piece(Instance *c) {
    c->state.piece_valid = c->state.looked = c->look_valid = 0;
    clear_pending(c);
}

static int look_at(Instance *c, double t, double *point, Look *look) {
    const Model *m = c->model;
    if (solve_implicit(c, t, point, 1) != RESULT_OK) return 0;
    evaluate_special(c, SPECIAL_GUARDS, t, point, look->values);
    look->t = t;
    look->rates = look->values + m->n_guards;
    for (int g = 0; g < m->n_guards; g++) {
        look->values[g] = number_or_false(look->values[g]);
        if (!isfinite(look->rates[g])) look->rates[g] = 0;
    }
    return 1;
}

static inline double cubic(double s, double g0, double r0, double g1, double r1) {
    double r = 1 - s;
    return g0 * (1 + 2 * s) * r * r + r0 * s * r * r + g1 * s * s * (3 - 2 * s) + r1 * s * s * (s - 1);
}

/* Does the cubic through both ends come near zero from below in between? */
static int is_hump(double g0, double r0, double g1, double r1) {
    double top = -INFINITY;
    if (!(g0 <= 0 && g1 <= 0 && r0 > NOISE && r1 < -NOISE)) return 0;
    for (int k = 1; k < 20; k++) top = fmax(top, cubic(k / 20.0, g0, r0, g1, r1));
    return top > -NEAR * (fabs(g0) + fabs(g1));
}

/* First zero of the cubic, or its top. */
double cubic_guess(double g0, double r0, double g1, double r1) {
    double best = -INFINITY, place = 0.5;
    for (int k = 1; k <= 40; k++) {
        double value = cubic(k / 40.0, g0, r0, g1, r1);
        if (value > best) {
            best = value;
            place = k / 40.0;
        }
        if (value > 0) {
            double low = (k - 1) / 40.0, high = k / 40.0;
            for (int n = 0; n < 30; n++) {
                double middle = 0.5 * (low + high);
                if (cubic(middle, g0, r0, g1, r1) > 0) high = middle;
                else low = middle;
            }
            return high;
        }
    }
    return place;
}

/* Kinds of candidates per guard. */
enum { QUIET, CROSSING, HUMP };

static int find_candidates(const Instance *c, const Look *before, const Look *after, unsigned char *kinds) {
    double h = after->t - before->t;
    int any = 0;
    for (int g = 0; g < c->model->n_guards; g++) {
        double g0 = before->values[g], g1 = after->values[g];
        kinds[g] = QUIET;
        if (!guard_active(c, g) || g0 > 0) continue;
        if (g1 > 0) kinds[g] = CROSSING;
        else if (is_hump(g0, before->rates[g] * h, g1, after->rates[g] * h)) kinds[g] = HUMP;
        any |= kinds[g] != QUIET;
    }
    return any;
}

/* To t: roughly by the dense output, or by a step again from the beginning of the piece. */
static int trial(Instance *c, const Piece *whole, double t, int rough, Piece *piece, Look *look) {
    const Model *m = c->model;
    double ignored, *point = c->work.vector + m->n_z;
    if (rough) {
        piece_at(m, whole, t, point);
        return look_at(c, t, point, look);
    }
    if (t <= whole->begin) {
        memcpy(piece, whole, piece_size(m));
        memcpy(last_of(m, piece), whole->points, (size_t)m->n_unknowns * sizeof(double));
    } else if (!rosenbrock_step(c, whole->begin, whole->points, t - whole->begin, 1, piece, &ignored)) return 0;
    piece->end = t;
    return look_at(c, t, last_of(m, piece), look);
}

static double newton(const Model *m, const Look *look, const unsigned char *kinds) {
    double step = INFINITY;
    for (int g = 0; g < m->n_guards; g++)
        if (kinds[g] != QUIET && look->rates[g] > 0) step = fmin(step, -look->values[g] / look->rates[g]);
    return step;
}

static int any_positive(const Model *m, const Look *look, const unsigned char *kinds) {
    for (int g = 0; g < m->n_guards; g++)
        if (kinds[g] != QUIET && look->values[g] > 0) return 1;
    return 0;
}

/* A time at which a guard that rises and falls again is positive. */
static int positive_top(Instance *c, const Piece *whole, const Look *before, const Look *after, unsigned char *kinds,
    Piece *piece, Look *look, double *time) {
    const Model *m = c->model;
    for (int g = 0; g < m->n_guards; g++) {
        double low = before->t, high = after->t, h = high - low, t;
        if (kinds[g] != HUMP) continue;
        t = low + h * cubic_guess(before->values[g], before->rates[g] * h, after->values[g], after->rates[g] * h);
        for (int n = 0; n < MAX_TRIALS; n++) {
            if (!trial(c, whole, t, 1, piece, look)) return 0;
            if (look->values[g] > 0) {
                *time = t;
                return 1;
            }
            if (look->rates[g] > 0) low = t;
            else high = t;
            if (look->values[g] + fabs(look->rates[g]) * (high - low) < 0 || high - low < 1e-12) break;
            t = 0.5 * (low + high);
        }
        kinds[g] = QUIET;
    }
    return 0;
}

/* Finds the earliest zero of a candidate between two looks, first roughly; `piece` then ends there, `look` tells the
 * guards there. */
static int locate(Instance *c, const Piece *whole, const Look *before, const Look *after, unsigned char *kinds,
    Piece *piece, Look *look) {
    const Model *m = c->model;
    double high = after->t, h = high - before->t, t = high, tolerance = LOCATED * fmax(1, fabs(before->t)), last;
    if (!any_positive(m, after, kinds)) {
        if (!positive_top(c, whole, before, after, kinds, piece, look, &high)) return 0;
    }
    for (int g = 0; g < m->n_guards; g++)
        if (kinds[g] != QUIET)
            t = fmin(t, before->t + h * cubic_guess(before->values[g], before->rates[g] * h, after->values[g],
                                            after->rates[g] * h));
    t = fmin(t, high);
    last = high;
    for (int rough = 1; rough >= 0; rough--) {
        double low = before->t;
        high = last;
        for (int n = 0; n < MAX_TRIALS; n++) {
            double step;
            if (!trial(c, whole, t, rough, piece, look)) return 0;
            if (any_positive(m, look, kinds)) high = t;
            else low = t;
            step = newton(m, look, kinds);
            if (fabs(step) <= tolerance) {
                if (rough) break;
                return 1;
            }
            if (high - low <= tolerance) break;
            t = t + step > low && t + step < high ? t + step : 0.5 * (low + high);
        }
    }
    return trial(c, whole, high, 0, piece, look);
}

/* Which of the located guards want to fire. */
static int mark_wanting(Instance *c, Piece *piece, const Look *look, const unsigned char *kinds, double tolerance) {
    const Model *m = c->model;
    double *soon = look->values + 2 * (size_t)m->n_guards, *last = last_of(m, piece);
    int any = 0;
    evaluate(c, &m->tapes.guards_soon, piece->end, last, soon);
    for (int g = 0; g < m->n_guards; g++) {
        int near = look->values[g] > 0 || (look->rates[g] > 0 && -look->values[g] <= 10 * tolerance * look->rates[g]);
        if (kinds[g] != QUIET && near && number_or_false(soon[g]) > 0) any = c->wanting[m->guard_transition[g]] = 1;
    }
    return any;
}

/* Go on by the time resolution; what crossed and is still positive there wants to fire, else the search begins anew. */
static int look_behind(
    Instance *c, const Piece *whole, double end, const unsigned char *kinds, Piece *piece, Look *look) {
    const Model *m = c->model;
    double behind = fmin(piece->end + TIME_RESOLUTION * fmax(1, fabs(piece->end)), end);
    if (!trial(c, whole, behind, 0, piece, look)) return 0;
    for (int g = 0; g < m->n_guards; g++)
        if (kinds[g] == CROSSING && look->values[g] > 0)
            c->state.event_pending = c->wanting[m->guard_transition[g]] = 1;
    return 1;
}

typedef enum { NOTHING, ENDED, TOO_LONG } Found;

/* Looks for an event between two looks; shortens the piece to it. */
static Found check_between(Instance *c, const Piece *whole, const Look *before, const Look *after) {
    const Model *m = c->model;
    Piece *piece = c->piece;
    unsigned char *kinds = c->work.kinds;
    double tolerance = LOCATED * fmax(1, fabs(after->t));
    Look found = {0, c->work.looks + 3 * (size_t)m->n_guards * (DEPTH + 2), NULL};
    int late = 0;
    if (!find_candidates(c, before, after, kinds)) return NOTHING;
    if (locate(c, whole, before, after, kinds, piece, &found)) {
        if (mark_wanting(c, piece, &found, kinds, tolerance)) {
            c->state.event_pending = 1;
            return ENDED;
        }
        /* Positive for less than the time resolution: what the last event left is on its way down. */
        for (int g = 0; g < m->n_guards; g++) late |= kinds[g] == CROSSING;
        if (late) return look_behind(c, whole, after->t, kinds, piece, &found) ? ENDED : TOO_LONG;
    } else if (any_positive(m, after, kinds)) return TOO_LONG;
    memcpy(piece, whole, piece_size(m));
    return NOTHING;
}

/* Are the guards between two looks what these tell of them? */
static int behave(const Instance *c, const Look *before, const Look *middle, const Look *after) {
    double h = after->t - before->t;
    for (int g = 0; g < c->model->n_guards; g++) {
        double g0 = before->values[g], g1 = after->values[g], value = middle->values[g];
        double size = fmax(fabs(value), fmax(fabs(g0), fabs(g1)));
        if (!guard_active(c, g)) continue;
        if (fabs(value - cubic(MIDDLE, g0, before->rates[g] * h, g1, after->rates[g] * h)) > BEHAVES * size) return 0;
    }
    return 1;
}

static Found look_into(Instance *c, const Piece *whole, const Look *before, const Look *after, int depth) {
    const Model *m = c->model;
    Look middle = {0, c->work.looks + 3 * (size_t)m->n_guards * (size_t)(depth + 1), NULL};
    double *point = c->work.vector + m->n_z, t = before->t + MIDDLE * (after->t - before->t);
    int deeper;
    Found found;
    piece_at(m, whole, t, point);
    if (!look_at(c, t, point, &middle)) return TOO_LONG;
    deeper = depth > 1 && !behave(c, before, &middle, after);
    found = deeper ? look_into(c, whole, before, &middle, depth - 1) : check_between(c, whole, before, &middle);
    if (found != NOTHING) return found;
    return deeper ? look_into(c, whole, &middle, after, depth - 1) : check_between(c, whole, &middle, after);
}

/* Looks for events in an accepted step; shortens it to the first. Returns 0 if the step must be shorter. */
static int search_events(Instance *c) {
    const Model *m = c->model;
    double *point = c->work.vector + m->n_z;
    size_t size = 2 * (size_t)m->n_guards;
    Look before = {0, c->work.looks, NULL}, after = {0, c->work.looks + 3 * (size_t)m->n_guards, NULL};
    Piece *whole = memcpy(c->work.whole, c->piece, piece_size(m));
    Found found;
    if (!c->look_valid) {
        memcpy(point, whole->points, sizeof(double) * (size_t)m->n_unknowns);
        if (!look_at(c, whole->begin, point, &before)) return 0;
    }
    c->look_valid = 1;
    before.t = whole->begin;
    before.rates = before.values + m->n_guards;
    /* What the last event left positive did not want to fire: it is on its way down. */
    for (int g = 0; g < m->n_guards; g++) before.values[g] = fmin(before.values[g], 0);
    memcpy(point, last_of(m, whole), sizeof(double) * (size_t)m->n_unknowns);
    if (!look_at(c, whole->end, point, &after)) return 0;
    found = look_into(c, whole, &before, &after, DEPTH);
    if (found == NOTHING) memcpy(before.values, after.values, size * sizeof(double));
    else if (found == ENDED) c->look_valid = 0;
    return found != TOO_LONG;
}

static double largest_step(const Instance *c) {
    const Model *m = c->model;
    const State *s = &c->state;
    double span = s->stop_time - s->start_time;
    if (m->n_x > 0 && !m->settings->rates_depend_on_time) return INFINITY;
    if (!s->stop_time_defined || !(span > 0)) return m->n_x == 0 ? 1e-3 : INFINITY;
    return span / LEAST_STEPS;
}

/* Below this, two times are the same. */
static double least_step(const State *s) { return 1e-15 * fmax(1, fabs(s->t)); }

/* Takes one step from the present point towards `limit`, shorter where accuracy or an event asks for it. */
static Result take_step(Instance *c, double limit) {
    const Model *m = c->model;
    State *s = &c->state;
    double *first = c->work.first, wished = s->step > 0 ? s->step : first_step(c);
    double least = least_step(s);
    int rejected = 0;
    memcpy(first, c->x, m->n_unknowns * sizeof(double));
    wished = fmin(wished, largest_step(c));
    for (int n = 0; n < MAX_REJECTIONS; n++) {
        double error = 0, factor, h = wished;
        int cut = s->t + 1.0001 * h >= limit;
        if (cut) h = limit - s->t;
        clear_pending(c);
        if (h < least || !isfinite(h)) break;
        if (!rosenbrock_step(c, s->t, first, h, rejected > 0, c->piece, &error) || !isfinite(error)) error = 1e30;
        if (cut) c->piece->end = limit;
        factor = 0.9 * pow(fmax(error, 1e-10), -0.2);
        if (error > 1) {
            rejected++;
            s->n_rejected++;
            wished = h * fmax(0.1, factor);
            continue;
        }
        if (solve_implicit(c, c->piece->end, last_of(m, c->piece), 1) != RESULT_OK ||
            (m->n_guards > 0 && !search_events(c))) {
            rejected++;
            s->n_rejected++;
            wished = 0.25 * h;
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

/* Makes a point of the piece the present one. */
Result move_to(Instance *c, double t) {
    piece_at(c->model, c->piece, t, c->x);
    c->state.t = t;
    c->variables_valid = c->state.z_valid = 0;
    return settle(c);
}

/* Inputs, parameters or states moved from outside: go on from the present point. */
Result take_changes(Instance *c, int *event) {
    State *s = &c->state;
    *event = 0;
    if (!s->inputs_changed) return RESULT_OK;
    if (check_tables(c) != RESULT_OK) return RESULT_ERROR;
    s->inputs_changed = 0;
    leave_piece(c);
    s->z_valid = 0;
    c->variables_valid = 0;
    if (settle(c) != RESULT_OK) return RESULT_ERROR;
    *event = find_wanting(c, nothing_wanting(c), 1);
    return RESULT_OK;
}

/* Fires what was located at the present point, or what wants to fire. */
Result handle_event(Instance *c) {
    State *s = &c->state;
    unsigned char *wanting = nothing_wanting(c);
    int located = s->event_pending;
    if (located) memcpy(wanting, c->wanting, c->model->n_transitions);
    leave_piece(c);
    s->at_event = 0;
    s->step = 0;
    s->z_valid = 0;
    if (settle(c) != RESULT_OK || iterate_events(c, wanting, located) != RESULT_OK) return RESULT_ERROR;
    s->z_valid = 1;
    return RESULT_OK;
}

int is_due(Instance *c) { return c->model->n_moments > 0 && find_wanting(c, nothing_wanting(c), 0); }

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
        return fail(c, "The communication point is %.12g s, but the instance stands at %.12g s.", point, s->t);
    if (!(size > 0) || !isfinite(*target)) return fail(c, "The communication step size %g s is not positive.", size);
    if (check_whole(c, size) != RESULT_OK) return RESULT_ERROR;
    if (!s->stop_time_defined || *target <= s->stop_time) return RESULT_OK;
    if (*target > s->stop_time + slack)
        return fail(c, "The step to %.12g s goes beyond the stop time %.12g s.", *target, s->stop_time);
    *target = s->stop_time;
    return RESULT_OK;
}

/* Goes to `target`, or to the first event before it; inputs may also move where an internal step has ended. */
Arrival integrate_to(Instance *c, double target, int stop_at_events) {
    State *s = &c->state;
    int held = 0, event;
    if (c->model->settings->fixed_step > 0) return step_fixed(c, target);
    if (s->at_event && handle_event(c) != RESULT_OK) return FAILED;
    for (;;) {
        held |= s->inputs_changed;
        if (take_changes(c, &event) != RESULT_OK) return FAILED;
        if (event) {
            s->at_event = 1;
            if (stop_at_events) return AT_EVENT;
            if (handle_event(c) != RESULT_OK) return FAILED;
        }
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
            if (take_step(c, limit) != RESULT_OK) return FAILED;
        }
        if (c->piece->end > target) return move_to(c, target) == RESULT_OK ? REACHED : FAILED;
        if (move_to(c, c->piece->end) != RESULT_OK) return FAILED;
        s->piece_valid = 0;
        if (s->event_pending || is_due(c)) {
            s->at_event = 1;
            if (stop_at_events) return AT_EVENT;
            if (handle_event(c) != RESULT_OK) return FAILED;
        }
        if (c->step_finished != NULL) target = fmin(target, fmax(c->step_finished(c), s->t));
    }
}
