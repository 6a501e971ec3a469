/* Guards that only touch zero: where a run comes up to an event within its accuracy and turns back, and where it barely
 * has one. A small change makes an event of it, or none. The derivatives of both sides are the same only where the
 * event would change less than the square of the time that it lasts, as a spring does that begins without a force. */
#include "adjoint.h"

#define ACCURACY 10             /* tolerances of its states by which a guard may be wrong */
#define ROUNDING_OF_TERMS 1e-13 /* of its terms */
#define FLAT 1e-9               /* of a guard: a smaller change over a step is none */
#define SHORT 1e-9              /* of a piece: no more than an edge between two looks */
#define BACK 1e-2               /* of a piece: how far before the touch its event is tried, and a tenth of it */
#define NEARER 0.1
#define BESIDE 1e-3        /* of the run: a guard that is farther from zero by its rate is not looked at */
#define NOTHING_FELT 1e-12 /* of what outputs feel of states: rounding */
#define MOST_FELT 1e6      /* times the change of a guard: without a bound */
#define BY_SQUARE                                                                                                 \
    300            /* between the squares and the cubes of ten: what lasts for so long as the root of the change, \
                    */
#define BY_TIME 30 /* or in proportion to it */
#define BISECTIONS 50

/* Guards and their rates at a time of the present piece. */
static void look(Instance *c, double t, double *guards) {
    double *point = c->vector + c->model->n_z;
    piece_at(c->model, c->piece, t, point);
    solve_implicit(c, t, point, 1);
    evaluate_special(c, &c->model->tapes.guards, t, point, guards);
}

/* Finds how large guards are in the run, where they are active. */
static void measure_guards(Instance *c) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    const void *frame = NULL;
    memset(g->guard_sizes, 0, (size_t)m->n_guards * sizeof(double));
    for (const Record *record = g->last; record != NULL; record = record->previous) {
        if (record->pass != NULL) continue;
        if (frame != record->frame) state_copy_in(c, record->frame);
        frame = record->frame;
        memcpy(c->piece, record->own, piece_size(m));
        look(c, record->begin, c->edge_guards);
        for (int k = 0; k < m->n_guards; k++)
            if (guard_active(c, k)) g->guard_sizes[k] = max_of(g->guard_sizes[k], fabs(c->edge_guards[k]));
    }
    g->measured = 1;
}

/* By how much a guard may be wrong at the present point, by its slope. */
static double uncertainty(const Instance *c, int guard, const double *slope) {
    double terms = fabs(slope[c->n_smooth]) * max_of(1, fabs(c->state.t));
    for (size_t n = 0; n < c->n_smooth; n++) terms += fabs(slope[n] * c->numbers[n]);
    return ACCURACY * c->state.tolerance * c->gradient->guard_sizes[guard] + ROUNDING_OF_TERMS * terms;
}

/* Is what was seen of a guard beside a touch the rounding of its terms? As small values are not looked at then. */
static int is_rounding(Instance *c, const Touch *touch, double terms) {
    c->gradient->guard_rests[touch->guard] = AT_EDGE * terms;
    return touch->size <= AT_EDGE * terms;
}

/* Goes to a time of a piece, in the modes of a copy. */
int stand_at(Instance *c, const void *frame, const double *own, double t) {
    state_copy_in(c, frame);
    c->gradient->loaded = NULL;
    memcpy(c->piece, own, piece_size(c->model));
    c->state.t = t;
    piece_at(c->model, c->piece, t, c->x);
    c->state.at_event = c->state.event_pending = c->variables_valid = c->state.z_valid = 0;
    return settle(c);
}

/* What a row integrates, or what it reads there. */
static double value_read(Instance *c, int row, int reads) {
    double value = 0;
    if (integrand_of(c->gradient, row) >= 0) return variables_now(c)[integrand_of(c->gradient, row)];
    if (reads) get_value(c, find_variable(c->model, c->gradient->of[row]), &value);
    return value;
}

/* Moves states so that a guard is zero at the present point, and by as little as this takes. Returns what it was. */
static double make_zero(Instance *c, int guard) {
    const Model *m = c->model;
    const double *slope = c->gradient->slope + (c->x - c->numbers);
    double value, sum = 0;
    if (!factor_implicit(c)) return NAN;
    value = slope_of_output(c, &m->tapes.guards, guard, c->edge_guards, c->gradient->slope);
    for (int k = 0; k < m->n_x; k++) sum += slope[k] * slope[k] * m->nominals[k] * m->nominals[k];
    for (int k = 0; k < m->n_x && sum > 0; k++) c->x[k] -= value * slope[k] * m->nominals[k] * m->nominals[k] / sum;
    c->variables_valid = c->state.z_valid = 0;
    return settle(c) ? value : NAN;
}

/* What outputs feel of an event of a guard at a time of a piece, in the time that it lasts, beside what they feel of
 * all states; `reads`: they are read there. */
static double effect(
    Instance *c, const void *frame, const double *own, int guard, double t, double lasts, int reads, double *was) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    double *before = g->sides, *rates = g->node_bars, *values = rates + m->n_unknowns, most = 0;
    if (!stand_at(c, frame, own, t) || isnan(*was = make_zero(c, guard))) return INFINITY;
    evaluate_now(c, &m->tapes.rates, rates);
    for (int v = 0; v < g->n_of; v++) values[v] = value_read(c, v, reads);
    memcpy(before, c->numbers, c->n_smooth * sizeof(double));
    g->n_rounds = 1;
    memset(g->rounds, 0, (size_t)m->n_transitions);
    g->rounds[m->guard_transition[guard]] = 1;
    c->trying++;
    Result passed = handle_event(c);
    c->trying--;
    if (!passed) return INFINITY;
    evaluate_now(c, &m->tapes.rates, c->rhs);
    ptrdiff_t x = c->x - c->numbers, d = c->d - c->numbers;
    for (int v = 0; v < g->n_of; v++) {
        const double *by = vector_of(c, v);
        double integrates = integrand_of(g, v) >= 0, now = value_read(c, v, reads);
        double change = fabs(now - values[v]) * (integrates ? lasts : 1);
        double size = integrates ? g->along->integrands[v].size : fabs(now) + fabs(values[v]) + DBL_MIN;
        for (int k = 0; k < m->n_x; k++) {
            change += fabs(by[x + k]) * (fabs(c->x[k] - before[x + k]) + lasts * fabs(c->rhs[k] - rates[k]));
            size += fabs(by[x + k]) * (fabs(c->x[k]) + m->nominals[k]);
        }
        for (int k = 0; k < m->n_d; k++)
            if (k >= m->n_modes || m->modes[k].n_names == 0) change += fabs(by[d + k] * (c->d[k] - before[d + k]));
        most = max_of(most, change / size);
    }
    return most;
}

/* Is a guard as good as zero at a time of a piece, and would an event there be felt? If so, returns by how much, beside
 * the change of the guard that makes it; else 0. */
static double felt_touch(Instance *c, const void *frame, const double *own, const Touch *touch, int reads) {
    const Piece *piece = (const Piece *)(const void *)own;
    double back = BACK * (piece->end - piece->begin), effects[2], before[2], *guards = c->edge_guards;
    if (!c->gradient->measured) measure_guards(c);
    if (!stand_at(c, frame, own, touch->t) || !factor_implicit(c)) return 0;
    double value = slope_of_output(c, &c->model->tapes.guards, touch->guard, guards, c->gradient->slope);
    double terms = small_terms(c, c->gradient->slope), wrong = uncertainty(c, touch->guard, c->gradient->slope);
    if (is_rounding(c, touch, terms)) return 0;
    if (!(fabs(value) <= wrong)) return 0;
    for (int k = 0; k < 2; k++)
        effects[k] = effect(c, frame, own, touch->guard, touch->t - back, back, reads, &before[k]), back *= NEARER;
    double way = value - before[0];
    if (effects[0] <= NOTHING_FELT || effects[1] * (touch->corner ? BY_TIME : BY_SQUARE) <= effects[0]) return 0;
    return way > 0 ? min_of(effects[0] / way, MOST_FELT / terms) : MOST_FELT / terms;
}

/* Adds a doubt at the present point: by what moves a guard, which itself moves by `rate` with the event there. */
static void add_touch(Instance *c, const Touch *touch, FailureCode why, double rate) {
    Gradient *g = c->gradient;
    if (!factor_implicit(c)) return;
    slope_of_output(c, &c->model->tapes.guards, touch->guard, c->edge_guards, g->slope);
    double scale = touch->felt * DOUBTFUL / (ACCURACY * c->state.tolerance);
    for (size_t n = 0; n < c->n_smooth; n++) g->slope[n] = scale * (g->slope[n] + rate * g->moment[n]);
    add_doubt(c, why, g->slope);
    g->doubts[g->n_doubts - 1].place = c->model->guard_transition[touch->guard];
}

/* The time between two looks at which a guard of the present piece is highest. */
static double top_between(Instance *c, int guard, double low, double high) {
    for (int n = 0; n < BISECTIONS; n++) {
        double middle = 0.5 * (low + high);
        look(c, middle, c->edge_guards);
        *(c->edge_guards[c->model->n_guards + guard] > 0 ? &low : &high) = middle;
    }
    return high;
}

/* Notes where guards may touch zero between two looks of the present piece; not at its begin, which is the end of the
 * one before, or an instant. */
static void note_touches(Instance *c, double begin, const double *before, double end, const double *after) {
    Gradient *g = c->gradient;
    double brief = SHORT * (c->piece->end - c->piece->begin);
    int n = c->model->n_guards, corner = end - begin <= brief;
    for (int k = 0; k < n && g->n_touches < MOST_TOUCHES * n; k++) {
        double first = before[k], last = after[k], size = max_of(fabs(first), fabs(last));
        double rise = (end - begin) * before[n + k], fall = (end - begin) * after[n + k];
        if (!guard_active(c, k) || size <= g->guard_rests[k]) continue;
        int turns = rise > -FLAT * size && fall < FLAT * size && rise - fall > FLAT * size;
        turns = turns && is_hump(min_of(first, 0), max_of(rise, 2 * NOISE), min_of(last, 0), min_of(fall, -2 * NOISE));
        if (!(corner ? rise > 0 && fall <= 0 : turns)) continue;
        double t = corner ? end : top_between(c, k, begin, end);
        if (t - c->piece->begin <= brief) continue;
        int place = g->n_touches++;
        for (; place > 0 && g->touches[place - 1].t > t; place--) g->touches[place] = g->touches[place - 1];
        g->touches[place] = (Touch){t, 0, size, k, corner};
    }
}

/* Looks for touches in the parts of the present piece. Where it ends, the one behind it begins, which was looked at. */
void find_touches(Instance *c, int parts, const double *begins, const double *ends) {
    Gradient *g = c->gradient;
    size_t n = 3 * (size_t)c->model->n_guards, size = n * sizeof(double);
    double *before = c->looks + 2 * n, *after = before + n, last = -INFINITY; /* the first two are those of the run */
    double *behind = c->looks + 4 * n, *first = behind + n;
    g->n_touches = 0;
    for (int k = 0; k < 3 * parts && n > 0; k++) {
        double t = k % 3 == 2 ? ends[k / 3] : begins[k / 3] + 0.5 * (k % 3) * (ends[k / 3] - begins[k / 3]);
        double *kept = before;
        if (k == 3 * parts - 1 && t == g->looked_at) memcpy(after, behind, size);
        else look(c, t, after);
        if (k == 0) memcpy(first, after, size);
        else note_touches(c, last, before, t, after);
        last = t;
        before = after;
        after = kept;
    }
    memcpy(behind, first, size);
    g->looked_at = begins[0];
}

/* The latest touch that is left, or minus infinity. */
double touch_behind(const Gradient *g) { return g->n_touches > 0 ? g->touches[g->n_touches - 1].t : -INFINITY; }

/* Takes those at a time; the run is at it. */
void judge_touches(Instance *c, const Record *along, double t) {
    Gradient *g = c->gradient;
    int any = 0;
    for (; touch_behind(g) == t; any = 1) {
        Touch *touch = &g->touches[--g->n_touches];
        touch->felt = felt_touch(c, along->frame, along->own, touch, 0);
        if (touch->felt > 0 && stand_at(c, along->frame, along->own, t)) add_touch(c, touch, FAILURE_LOST_AT_TOUCH, 0);
    }
    if (any) stand_at(c, along->frame, along->own, t);
}

/* The way that leads to an instant, or NULL. */
static const Record *way_to(const Record *at) {
    return at->previous != NULL && at->previous->pass == NULL ? at->previous : NULL;
}

/* Has the guard of an event come to it, at this rate, as one that turns back within its accuracy: its rate falls so
 * fast?
 */
static int turns_back(Instance *c, const Record *way, double rate) {
    const Piece *piece = (const Piece *)(const void *)way->own;
    const Model *m = c->model;
    double *point = c->vector + m->n_z, wrong = uncertainty(c, c->gradient->cause->index, c->gradient->moment) / rate;
    double back = min_of(wrong, c->state.t - piece->begin), t = c->state.t - back;
    piece_at(m, piece, t, point);
    if (!(back > 0) || !solve_implicit(c, t, point, 1)) return 0;
    evaluate_special(c, &m->tapes.guards, t, point, c->edge_guards);
    return (c->edge_guards[m->n_guards + c->gradient->cause->index] - rate) * wrong > rate * back;
}

/* Notes guards that are highest just at an event which leaves their modes as they are. Tells whether the event itself
 * only touches, at this rate of its guard (or 0), and is felt: 1, or not felt: -1. */
int find_touches_at(Instance *c, const Record *at, double rate) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    const Record *way = way_to(at);
    const double *d = copied(c, at->behind, c->d);
    double *before = c->looks + 6 * (size_t)m->n_guards, *behind = before + 3 * (size_t)m->n_guards;
    int touches = 0;
    g->n_touches = 0;
    if (way == NULL || m->n_guards == 0 || m->n_unknowns == 0) return 0;
    if (rate > 0 && !g->cause->timed && !g->measured) {
        measure_guards(c);
        state_copy_in(c, at->before);
    }
    if (rate > 0 && !g->cause->timed && turns_back(c, way, rate)) {
        Touch touch = {c->state.t, 0, INFINITY, g->cause->index, 0};
        touches = felt_touch(c, at->before, way->own, &touch, 0) > 0 ? 1 : -1;
    }
    state_copy_in(c, at->behind);
    evaluate_now(c, &m->tapes.guards, behind);
    state_copy_in(c, at->before);
    evaluate_now(c, &m->tapes.guards, before);
    for (int k = 0; k < m->n_guards; k++) {
        int mode = m->transitions[m->guard_transition[k]].mode, n = m->n_guards + k, fires = 0;
        for (int round = 0; round < at->n_rounds; round++)
            fires |= at->rounds[round * m->n_transitions + m->guard_transition[k]];
        if (fires || d[mode] != c->d[mode] || !guard_active(c, k) ||
            fabs(before[k]) > BESIDE * fabs(before[n]) * span_of(c))
            continue;
        if (!(before[n] >= 0 && behind[n] <= 0 && before[n] > behind[n])) continue;
        Touch *touch = &g->touches[g->n_touches];
        *touch = (Touch){c->state.t, 0, INFINITY, k, 1};
        touch->felt = felt_touch(c, at->before, way->own, touch, 0);
        g->n_touches += touch->felt > 0;
        state_copy_in(c, at->before);
    }
    g->n_rounds = at->n_rounds;
    memcpy(g->rounds, at->rounds, (size_t)at->n_rounds * (size_t)m->n_transitions);
    return touches;
}

/* Adds those that were noted, before the event; its guard comes to zero at this speed. */
void add_touches_at(Instance *c, double speed) {
    Gradient *g = c->gradient;
    while (g->n_touches > 0) {
        const Touch *touch = &g->touches[--g->n_touches];
        evaluate_now(c, &c->model->tapes.guards, c->edge_guards);
        double rate = c->edge_guards[c->model->n_guards + touch->guard];
        add_touch(c, touch, FAILURE_LOST_AT_TOUCH, speed != 0 ? rate / speed : 0);
    }
}

/* At the end of the run: what is about to happen. */
void check_end(Instance *c) {
    Gradient *g = c->gradient;
    const Record *way = g->last;
    int n = c->model->n_guards;
    double t = c->state.t, *guards = c->looks + 6 * (size_t)n;
    if (way == NULL || way->pass != NULL || n == 0) return;
    evaluate_now(c, &c->model->tapes.guards, guards);
    for (int k = 0; k < n; k++) {
        Touch touch = {t, 0, INFINITY, k, 1};
        if (!guard_active(c, k) || !(guards[n + k] > 0) || fabs(guards[k]) > BESIDE * guards[n + k] * span_of(c))
            continue;
        touch.felt = felt_touch(c, way->frame, way->own, &touch, g->along == NULL);
        if (touch.felt > 0 && stand_at(c, way->frame, way->own, t)) add_touch(c, &touch, FAILURE_LOST_AT_READING, 0);
    }
}
