/* Looking for events in an accepted step: guards are looked at inside of it, closer where they do not behave as looks
 * tell, and what rises above zero is located on the dense output, then by steps again up to the trial time. */
#include "core.h"

#define MIDDLE 0.45 /* of a step: where guards are looked at besides its end; not where a period might */
#define DEPTH 6     /* divisions of a step in which guards do not behave */
#define BEHAVES 0.05
#define LOCATED 1e-13
#define MAX_TRIALS 60
#define NEAR 0.1

typedef struct { /* guards and their rates at a time within a step; behind them room for one more number per guard */
    double t, *values, *rates;
} Look;

enum { QUIET, CROSSING, HUMP }; /* guards that are not quiet are candidates */

/* Guards that present modes can fire, as they were at the last look. */
#define EACH_ACTIVE(g) for (int place = 0, g; place < c->n_active && (g = c->active_guard[place], 1); place++)

static Look room_for_look(const Instance *c, int number) {
    double *values = c->looks + 3 * (size_t)c->model->n_guards * (size_t)number;
    return (Look){0, values, values + c->model->n_guards};
}

static void take_guards(Instance *c, double t, const double *point, int candidates, double *values) {
    if (candidates) evaluate_part(c, t, point, values);
    else evaluate_special(c, &c->model->tapes.guards, t, point, values);
}

/* At all guards, or at candidates only. */
static int look_at(Instance *c, double t, double *point, int candidates, Look *look) {
    if (!solve_implicit(c, t, point, 1)) return 0;
    take_guards(c, t, point, candidates, look->values);
    look->t = t;
    active_guards(c);
    EACH_ACTIVE (g) {
        if (candidates && c->kinds[g] == QUIET) continue;
        look->values[g] = number_or_false(c, g, look->values[g]);
        if (!isfinite(look->rates[g])) look->rates[g] = 0;
    }
    return 1;
}

/* By the dense output of the whole step. */
static int look_inside(Instance *c, double t, int candidates, Look *look) {
    double *point = c->vector + c->model->n_z;
    piece_at(c->model, c->whole, t, point);
    return look_at(c, t, point, candidates, look);
}

/* At candidates, by a step again from the beginning of the whole one, which becomes the piece; that of another
 * integrator is cut. */
static int step_to(Instance *c, double t, Look *look) {
    const Piece *whole = c->whole;
    if (t <= whole->begin) {
        memcpy(c->piece, whole, piece_size(c->model));
        memcpy(last_of(c->model, c->piece), whole->points, (size_t)c->model->n_unknowns * sizeof(double));
    } else if (takes_panels(c)) piece_between(c, whole, whole->begin, t, c->piece);
    else if (rosenbrock_step(c, whole->begin, whole->points, t - whole->begin, 1, c->piece) < 0) return 0;
    c->piece->end = t;
    return look_at(c, t, last_of(c->model, c->piece), 1, look);
}

static inline double cubic(double s, double g0, double r0, double g1, double r1) {
    double r = 1 - s;
    return g0 * (1 + 2 * s) * r * r + r0 * s * r * r + g1 * s * s * (3 - 2 * s) + r1 * s * s * (s - 1);
}

/* Does the cubic through both ends come near zero from below in between? */
int is_hump(double g0, double r0, double g1, double r1) {
    double top = -INFINITY;
    if (!(g0 <= 0 && g1 <= 0 && r0 > NOISE && r1 < -NOISE)) return 0;
    for (int k = 1; k < 20; k++) top = max_of(top, cubic(k / 20.0, g0, r0, g1, r1));
    return top > -NEAR * (fabs(g0) + fabs(g1));
}

/* First zero of the cubic, or its top. */
double cubic_guess(double g0, double r0, double g1, double r1) {
    double best = -INFINITY, low = 0, high = 0.5;
    for (int k = 1; k <= 40 && !(best > 0); k++) {
        double value = cubic(k / 40.0, g0, r0, g1, r1);
        if (!(value > best)) continue;
        best = value;
        low = (k - 1) / 40.0;
        high = k / 40.0;
    }
    for (int n = 0; n < 30 && best > 0; n++) {
        double middle = 0.5 * (low + high);
        *(cubic(middle, g0, r0, g1, r1) > 0 ? &high : &low) = middle;
    }
    return high;
}

static double guess(const Look *before, const Look *after, int g) {
    double h = after->t - before->t;
    return before->t + h * cubic_guess(before->values[g], before->rates[g] * h, after->values[g], after->rates[g] * h);
}

static int find_candidates(Instance *c, const Look *before, const Look *after) {
    double h = after->t - before->t;
    int any = 0;
    memset(c->kinds, QUIET, (size_t)c->model->n_guards);
    EACH_ACTIVE (g) {
        double g0 = before->values[g], g1 = after->values[g];
        if (g0 > 0) continue;
        if (g1 > 0) c->kinds[g] = CROSSING;
        else if (is_hump(g0, before->rates[g] * h, g1, after->rates[g] * h)) c->kinds[g] = HUMP;
        any |= c->kinds[g];
    }
    return any;
}

/* Newton's step to the earliest zero of a candidate; tells whether one is positive already. */
static int newton(const Instance *c, const Look *look, double *step) {
    int positive = 0;
    *step = INFINITY;
    EACH_ACTIVE (g) {
        if (c->kinds[g] == QUIET) continue;
        positive |= look->values[g] > 0;
        if (look->rates[g] > 0) *step = min_of(*step, -look->values[g] / look->rates[g]);
    }
    return positive;
}

/* The first time at which a guard that rises and falls again is positive; infinite if none is. */
static double positive_top(Instance *c, const Look *before, const Look *after, Look *look) {
    double first = INFINITY;
    EACH_ACTIVE (g) {
        double low = before->t, high = after->t, t = c->kinds[g] == HUMP ? guess(before, after, g) : low,
               top = INFINITY;
        for (int n = 0; n < MAX_TRIALS && c->kinds[g] == HUMP && isinf(top); n++) {
            if (!look_inside(c, t, 1, look)) return INFINITY;
            if (look->values[g] > 0) top = t;
            *(look->rates[g] > 0 ? &low : &high) = t;
            if (look->values[g] + fabs(look->rates[g]) * (high - low) < 0 || high - low < 1e-12) break;
            t = 0.5 * (low + high);
        }
        if (c->kinds[g] == HUMP && isinf(top)) c->kinds[g] = QUIET;
        first = min_of(first, top);
    }
    return first;
}

/* Finds the earliest zero of a candidate between two looks, first roughly; the piece then ends there, `look` tells the
 * guards there. */
static int locate(Instance *c, const Look *before, const Look *after, Look *look) {
    double step, t = after->t, last = t, tolerance = LOCATED * max_of(1, fabs(before->t));
    int positive = newton(c, after, &step);
    last = min_of(positive ? last : INFINITY, positive_top(c, before, after, look));
    if (!isfinite(last)) return 0;
    EACH_ACTIVE (g)
        if (c->kinds[g] != QUIET) t = min_of(t, guess(before, after, g));
    t = min_of(t, last);
    for (int rough = 1; rough >= 0; rough--) {
        double low = before->t, high = last;
        for (int n = 0; n < MAX_TRIALS; n++) {
            if (!(rough ? look_inside(c, t, 1, look) : step_to(c, t, look))) return 0;
            *(newton(c, look, &step) ? &high : &low) = t;
            if (fabs(step) <= tolerance && !rough) return 1;
            if (fabs(step) <= tolerance || high - low <= tolerance) break;
            t = t + step > low && t + step < high ? t + step : 0.5 * (low + high);
        }
        last = rough ? last : high;
    }
    return step_to(c, last, look);
}

static int mark_wanting(Instance *c, const Look *look, double tolerance) {
    const Model *m = c->model;
    double *soon = look->rates + m->n_guards;
    int any = 0;
    values_at(c, &m->tapes.guards_soon, c->piece->end, last_of(m, c->piece), soon);
    EACH_ACTIVE (g) {
        int near = look->values[g] > 0 || (look->rates[g] > 0 && -look->values[g] <= 10 * tolerance * look->rates[g]);
        if (c->kinds[g] != QUIET && near && number_or_false(c, g, soon[g]) > 0)
            any = c->wanting[m->guard_transition[g]] = 1;
    }
    return any;
}

/* What changes of the states make of candidates at a point of a piece: all together, and any two apart. */
static const double *guards_moved(Instance *c, const Piece *piece, double t, const double *changes) {
    const Model *m = c->model;
    double *here = room_for_look(c, DEPTH + 3).values, *shaken = room_for_look(c, DEPTH + 4).values,
           *moved = here + 2 * m->n_guards, *point = c->vector + m->n_z;
    memset(moved, 0, (size_t)m->n_guards * sizeof(double));
    piece_at(m, piece, t, point);
    evaluate_part(c, t, point, here);
    active_guards(c);
    for (int bit = 1; bit < 2 * m->n_x; bit *= 2) {
        piece_at(m, piece, t, point);
        for (int k = 0; k < m->n_x; k++) point[k] += k & (bit / 2) ? -changes[k] : changes[k];
        evaluate_part(c, t, point, shaken);
        EACH_ACTIVE (g)
            if (c->kinds[g] != QUIET) moved[g] = max_of(moved[g], fabs(shaken[g] - here[g]));
    }
    return moved;
}

static const double *moved_relatively(Instance *c, const Piece *piece, double t, double relative, double absolute) {
    const Model *m = c->model;
    double *point = c->vector + m->n_z;
    piece_at(m, piece, t, point);
    for (int k = 0; k < m->n_x; k++) c->changes[k] = relative * fabs(point[k]) + absolute * m->nominals[k];
    return guards_moved(c, piece, t, c->changes);
}

const double *rounding_of_guards(Instance *c, const Piece *piece, double t) {
    return moved_relatively(c, piece, t, ROUNDING_OF_STATES, 0);
}

/* Is a candidate no more than the tolerances of the states make of it? About what begins, or has decayed, the points of
 * another integrator swing by them: there own steps decide. */
static int is_within_tolerance(Instance *c, const Look *before, const Look *after) {
    const double *moved = moved_relatively(c, c->whole, after->t, c->state.tolerance, c->state.absolute);
    EACH_ACTIVE (g)
        if (c->kinds[g] != QUIET && max_of(fabs(before->values[g]), fabs(after->values[g])) <= moved[g]) return 1;
    return 0;
}

/* Is a guard positive by less than the error of the step, which is more than rounding? What decays does not change its
 * sign, but long steps swing about zero. */
static int is_within_error(Instance *c, const Look *after) {
    double begin = c->whole->begin, least = 4 * TIME_RESOLUTION * max_of(1, fabs(begin));
    if (c->doubts >= MOST_DOUBTS || c->whole->end - begin < least) return 0;
    const double *moved = guards_moved(c, c->whole, after->t, c->step_error);
    int any = 0;
    EACH_ACTIVE (g) any |= c->kinds[g] == CROSSING && after->values[g] <= moved[g];
    if (!any) return 0;
    double *errors = memcpy(room_for_look(c, DEPTH + 2).values, moved, (size_t)c->model->n_guards * sizeof(double));
    const double *rounding = rounding_of_guards(c, c->whole, after->t);
    EACH_ACTIVE (g)
        if (c->kinds[g] == CROSSING && after->values[g] <= errors[g] && errors[g] > rounding[g]) return 1;
    return 0;
}

typedef enum { NOTHING, ENDED, TOO_LONG } Found;

/* Go on by the time resolution; what crossed and is still positive then wants to fire, else the search begins anew. */
static Found look_behind(Instance *c, Look *look) {
    double due = c->piece->end + TIME_RESOLUTION * max_of(1, fabs(c->piece->end));
    if (!step_to(c, min_of(due, c->whole->end), look)) return TOO_LONG;
    EACH_ACTIVE (g)
        if (c->kinds[g] == CROSSING && min_of(look->values[g], look->values[g] + (due - look->t) * look->rates[g]) > 0)
            c->state.event_pending = c->wanting[c->model->guard_transition[g]] = 1;
    return ENDED;
}

/* Looks for an event between two looks; shortens the piece to it. */
static Found check_between(Instance *c, const Look *before, const Look *after) {
    Look found = room_for_look(c, DEPTH + 2);
    double step;
    if (!find_candidates(c, before, after)) return NOTHING;
    make_part(c, &c->model->tapes.guards, c->kinds, c->model->n_guards);
    int panels = takes_panels(c);
    if (panels ? is_within_tolerance(c, before, after) : is_within_error(c, after)) {
        if (panels) c->doubtful++;
        else c->doubts++;
        return TOO_LONG;
    }
    if (locate(c, before, after, &found)) {
        c->state.event_pending = mark_wanting(c, &found, LOCATED * max_of(1, fabs(after->t)));
        if (c->state.event_pending) return ENDED;
        /* Positive for less than the time resolution: what the last event left is on its way down. */
        if (memchr(c->kinds, CROSSING, (size_t)c->model->n_guards) != NULL) return look_behind(c, &found);
    } else if (newton(c, after, &step)) return TOO_LONG;
    memcpy(c->piece, c->whole, piece_size(c->model));
    return NOTHING;
}

/* Are the guards between two looks what these tell of them? */
static int behave(const Instance *c, const Look *before, const Look *middle, const Look *after) {
    double h = after->t - before->t;
    EACH_ACTIVE (g) {
        double g0 = before->values[g], g1 = after->values[g], value = middle->values[g];
        double size = max_of(fabs(value), max_of(fabs(g0), fabs(g1)));
        if (fabs(value - cubic(MIDDLE, g0, before->rates[g] * h, g1, after->rates[g] * h)) > BEHAVES * size) return 0;
    }
    return 1;
}

static Found look_into(Instance *c, const Look *before, const Look *after, int depth) {
    Look middle = room_for_look(c, depth + 1);
    if (!look_inside(c, before->t + MIDDLE * (after->t - before->t), 0, &middle)) return TOO_LONG;
    int deeper = depth > 1 && !behave(c, before, &middle, after);
    Found found = deeper ? look_into(c, before, &middle, depth - 1) : check_between(c, before, &middle);
    if (found != NOTHING) return found;
    return deeper ? look_into(c, &middle, after, depth - 1) : check_between(c, &middle, after);
}

/* How long it takes until a guard is zero, by its value and rate at the present point. */
double soonest_zero(Instance *c) {
    double soon = INFINITY, *point = c->vector + c->model->n_z;
    Look now = room_for_look(c, DEPTH + 2);
    memcpy(point, c->x, (size_t)c->model->n_unknowns * sizeof(double));
    if (c->model->n_guards == 0 || !look_at(c, c->state.t, point, 0, &now)) return soon;
    EACH_ACTIVE (g)
        if (now.values[g] < 0 && now.rates[g] > 0) soon = min_of(soon, -now.values[g] / now.rates[g]);
    return soon;
}

/* Looks for events in an accepted step; shortens it to the first. Returns 0 if the step must be shorter. */
int search_events(Instance *c) {
    Look before = room_for_look(c, 0), after = room_for_look(c, 1);
    const Piece *whole = memcpy(c->whole, c->piece, piece_size(c->model));
    if (!c->look_valid && !look_inside(c, whole->begin, 0, &before)) return 0;
    c->look_valid = 1;
    before.t = whole->begin;
    /* What the last event left positive did not want to fire: it is on its way down. */
    EACH_ACTIVE (g) before.values[g] = min_of(before.values[g], 0);
    if (!look_inside(c, whole->end, 0, &after)) return 0;
    Found found = look_into(c, &before, &after, DEPTH);
    if (found == NOTHING) memcpy(before.values, after.values, 2 * (size_t)c->model->n_guards * sizeof(double));
    else if (found == ENDED) c->look_valid = 0;
    return found != TOO_LONG && (c->piece->end > c->piece->begin || c->state.event_pending);
}
