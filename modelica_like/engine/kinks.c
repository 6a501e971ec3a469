/* What leads off to two sides with two derivatives: kinks at which a run stays, or stands when it is read (operations
 * of its equations whose slope changes or jumps there, guards that are zero). */
#include "adjoint.h"

#define RESTS 1e-3         /* of a run: for how long what is zero has to be so that it rests, and is looked at */
#define NEAR_LIMIT 5e-7    /* a guard that may be zero: surfaces do not break away for a faint excess */
#define AT_LIMIT 2e-10     /* of its terms: it is so, as a torque that is all friction */
#define SELDOM 0.02        /* of a run: when it is looked at again, if modes stay */
#define NEARBY_KINK 3e-6   /* of sizes: how far slopes beside a kink are looked at */
#define FELT_SLOPE 1e-9    /* of slopes, by which states change in the time of a run */
#define FELT_KINK 1e-3     /* of a slope: curvature changes it by about NEARBY_KINK */
#define FELT_TOGETHER 2e-5 /* the same, on a way over many kinks, whose slopes add up */

/* Slopes along a direction at the present point. */
static void slopes_along(Instance *c, const double *direction, double *slopes) {
    const Model *m = c->model;
    double *dots = c->dots;
    memset(slopes, 0, (size_t)m->n_x * sizeof(double));
    if (!factor_implicit(c)) return;
    memset(dots, 0, (size_t)m->slot_results * sizeof(double));
    memcpy(dots + m->slot_x, direction + (c->x - c->numbers), (size_t)m->n_x * sizeof(double));
    memcpy(dots + m->slot_p, direction + (c->p - c->numbers), (size_t)m->n_p * sizeof(double));
    memcpy(dots + m->slot_u, direction + (c->u - c->numbers), (size_t)m->n_u * sizeof(double));
    memcpy(dots + m->slot_d, direction + (c->d - c->numbers), (size_t)m->n_d * sizeof(double));
    tangent_of_implicit(c);
    tangent_now(c, &m->tapes.rates, slopes);
}

/* By how much slopes along a direction differ that can be felt in the time of a run, by more than a part of them. */
static double felt(const Instance *c, const double *direction, double part, const double *some, const double *others) {
    const double *x = direction + (c->x - c->numbers), *nominals = c->model->nominals;
    double largest = 0, most = 0, span = span_of(c);
    for (int k = 0; k < c->model->n_x; k++) largest = max_of(largest, fabs(x[k]) / nominals[k]);
    for (int k = 0; k < c->model->n_x; k++) {
        double change = fabs(some[k] - others[k]), least = FELT_SLOPE * largest * nominals[k] / span;
        int any = change > least && change > part * max_of(fabs(some[k]), fabs(others[k]));
        if (any) most = max_of(most, change / nominals[k]);
    }
    return most;
}

/* By how much slopes along a direction differ a little to its two sides, or in a mode (-1: none) and another one; at
 * the present point, which has been settled. */
static double felt_beside(Instance *c, const double *direction, double way, double part, int mode, int target) {
    Gradient *g = c->gradient;
    size_t size = c->n_smooth * sizeof(double);
    double *kept = g->sides, *slopes = g->rates;
    memcpy(kept, c->numbers, size);
    for (int side = 0; side < 2; side++) {
        for (size_t k = 0; k < c->n_smooth && mode < 0; k++) c->numbers[k] += (side ? way : -way) * direction[k];
        if (mode >= 0 && side) c->d[mode] = target;
        c->variables_valid = 0;
        c->state.z_valid = mode >= 0 && !side;
        c->trying += mode >= 0 && side;
        slopes_along(c, direction, slopes + side * c->model->n_unknowns);
        c->trying -= mode >= 0 && side;
        memcpy(c->numbers, kept, size);
    }
    c->variables_valid = 0;
    c->state.z_valid = 1;
    return felt(c, direction, part, slopes, slopes + c->model->n_unknowns);
}

/* A direction that leads off a kink or guard of which `slope` is the derivative: along it numbers change by up to
 * their sizes. Of parameters and inputs, only those asked for. */
static int direction_off(Instance *c, double *slope, double *direction) {
    const Gradient *g = c->gradient;
    double largest = 0;
    memset(direction, 0, c->n_smooth * sizeof(double));
    for (size_t k = 0; k < c->n_smooth; k++) {
        ptrdiff_t state = (ptrdiff_t)k - (c->x - c->numbers), entry = (ptrdiff_t)k - (c->d - c->numbers);
        int is_state = state >= 0 && state < c->model->n_x, is_entry = entry >= 0 && entry < c->model->n_d;
        is_entry = is_entry && (entry >= c->model->n_modes || c->model->modes[entry].n_names == 0);
        double size = fabs(c->numbers[k]) + (is_state ? c->model->nominals[state] : 1);
        direction[k] = is_state || is_entry || g->asked[k] ? slope[k] * size : 0;
        largest = max_of(largest, fabs(direction[k]));
        direction[k] *= size;
    }
    for (size_t k = 0; k < c->n_smooth && largest > 0; k++) direction[k] /= largest;
    return largest > 0;
}

/* What is zero at the kink of an operation, and its slopes by both operands; infinity if it has no kink. */
static double kink_of(int operation, double a, double b, double by[2]) {
    double ratio = operation == OPERATION_FMOD || operation == OPERATION_REMAINDER ? a / b : a;
    by[0] = 1, by[1] = 0;
    switch (operation) {
        case OPERATION_LT:
        case OPERATION_LE:
        case OPERATION_FMIN:
        case OPERATION_FMAX: by[1] = -1; return a - b;
        case OPERATION_FABS:
        case OPERATION_SIGN: return a;
        case OPERATION_COPYSIGN: by[0] = 0, by[1] = 1; return b;
        case OPERATION_FMOD:
        case OPERATION_REMAINDER: by[0] = 1 / b, by[1] = -ratio / b; /* fall through */
        case OPERATION_FLOOR:
        case OPERATION_CEIL: return ratio - floor(ratio + 0.5);
        case OPERATION_ATAN2: return b < 0 ? a : INFINITY;
        default: return INFINITY;
    }
}

/* Lists the operations that have kinks. */
void find_kinked(Instance *c) {
    Gradient *g = c->gradient;
    const Tape *tape = &c->model->tapes.rates;
    double by[2];
    g->n_kinked = 0;
    g->kinks_by = 0;
    for (int r = 0, k = 0; r < tape->n_runs; k += tape->runs[r++].count)
        for (int n = 0; n < tape->runs[r].count && isfinite(kink_of(tape->runs[r].operation, 1, -2, by)); n++)
            g->kinked[g->n_kinked++] = (Kink){tape->runs[r].operation, k + n, 0, 0};
    for (int k = 0; k < tape->n_operations + c->model->n_guards; k++) g->rests[k] = NAN;
}

/* Is an operation at its kink, where the tape has been run last? */
static int at_kink(const Instance *c, const Kink *kink) {
    const Operands *of = &c->model->tapes.rates.operands[kink->place];
    double by[2];
    return fabs(kink_of(kink->operation, c->slots[of->left], c->slots[of->right], by)) <= AT_EDGE;
}

/* Behind an event, where the tape has been run last: what is at its kink may matter in the modes before it. */
void note_kinks(Instance *c) {
    Gradient *g = c->gradient;
    double *rests = g->rests;
    for (int k = 0; k < g->n_kinked; k++) rests[g->kinked[k].place] = at_kink(c, &g->kinked[k]) ? INFINITY : NAN;
    rests += c->model->tapes.rates.n_operations;
    for (int k = 0; k < c->model->n_guards; k++)
        if (!isnan(rests[k])) rests[k] = INFINITY;
}

/* Notes since when, on the way back, operations are at their kinks and guards are zero. */
static void note_rests(Instance *c, double t, const double *point) {
    const Model *m = c->model;
    const Gradient *g = c->gradient;
    double *rests = g->rests;
    if (g->n_kinks > 0) evaluate(c, &m->tapes.rates, t, point, c->rhs);
    for (int k = 0; k < g->n_kinks; k++) {
        double *since = &rests[g->kinks[k]->place];
        *since = !at_kink(c, g->kinks[k]) ? NAN : isnan(*since) ? t : *since;
    }
    rests += m->tapes.rates.n_operations;
    if (m->n_guards > 0) evaluate_special(c, &m->tapes.guards, t, point, c->edge_guards);
    for (int k = 0; k < m->n_guards; k++) {
        double size = fabs(c->edge_guards[k]), change = fabs(c->edge_guards[m->n_guards + k]) * span_of(c);
        int rest = guard_active(c, k) && (size <= AT_EDGE || (size <= NEAR_LIMIT && change <= size));
        rests[k] = !rest ? NAN : isnan(rests[k]) ? t : rests[k];
    }
}

/* Lists the kinks that matter in the present modes, and notes those at the end of the piece; at the ends of those
 * before it the next one begins. */
static void list_kinks(Instance *c) {
    Gradient *g = c->gradient;
    const Tape *tape = &c->model->tapes.rates;
    load_decided(c);
    if (g->kinks_by == c->decided_by + 1) return;
    g->kinks_by = c->decided_by + 1;
    g->n_kinks = 0;
    piece_at(c->model, c->piece, c->piece->end, g->points);
    if (!solve_implicit(c, c->piece->end, g->points, 1)) return;
    evaluate(c, tape, c->piece->end, g->points, c->rhs);
    mark_mattering(c, tape);
    for (int k = 0; k < g->n_kinked; k++)
        if (c->needed_slots[tape->first_result + g->kinked[k].place]) g->kinks[g->n_kinks++] = &g->kinked[k];
    note_rests(c, c->piece->end, g->points);
}

/* The slope of what is zero at the kink of an operation of a tape; 0 if it is not zero at the present point. */
static int slope_of_kink(Instance *c, const Tape *tape, const Kink *kink, double *slope) {
    const int operands[] = {tape->operands[kink->place].left, tape->operands[kink->place].right};
    double values[2], by[2];
    Tape part = *tape;
    if (!isfinite(kink_of(kink->operation, 1, -2, by))) return 0;
    part.n_outputs = 2;
    part.outputs = operands;
    evaluate_now(c, &part, values);
    if (!(fabs(kink_of(kink->operation, values[0], values[1], by)) <= AT_EDGE)) return 0;
    memset(slope, 0, (c->n_smooth + 1) * sizeof(double));
    memset(c->dots, 0, (size_t)c->model->slot_results * sizeof(double));
    tape_adjoint(&part, c->slots, c->dots, by);
    adjoint_of_implicit(c, 1);
    add_bars(c, slope);
    return 1;
}

/* Has it rested for long? */
static int rests_long(const Instance *c, double *since) {
    if (!(*since - c->state.t >= RESTS * span_of(c))) return 0;
    *since = c->state.t - (SELDOM - RESTS) * span_of(c);
    return 1;
}

static void check_guards(Instance *c, double *rests) {
    const Model *m = c->model;
    double *slope = c->gradient->slope, *direction = c->gradient->work;
    for (int k = 0; k < m->n_guards; k++) {
        const Transition *to = &m->transitions[m->guard_transition[k]];
        if (!rests_long(c, &rests[k]) || !factor_implicit(c)) continue;
        double size = fabs(slope_of_output(c, &m->tapes.guards, k, c->edge_guards, slope)), terms = 0;
        for (size_t n = 0; n < c->n_smooth; n++) terms += fabs(slope[n] * c->numbers[n]);
        if (size <= max_of(AT_EDGE, AT_LIMIT * terms) && direction_off(c, slope, direction) &&
            felt_beside(c, direction, NEARBY_KINK, FELT_KINK, to->mode, to->target) > 0)
            add_small_doubt(c, FAILURE_LOST_AT_KINK, slope);
    }
}

/* Marks kinks that are due. Tells whether anything changes by more than curvature on a way over them all, but those
 * that are known to be felt. */
static int any_felt(Instance *c) {
    Gradient *g = c->gradient;
    double *slope = g->slope, *direction = g->work, *way = g->way;
    int any = 0;
    memset(way, 0, c->n_smooth * sizeof(double));
    for (int k = 0; k < g->n_kinks; k++) {
        Kink *kink = g->kinks[k];
        kink->due = rests_long(c, &g->rests[kink->place]);
        if (!kink->due || kink->alone || (!any && !factor_implicit(c))) continue;
        kink->due = slope_of_kink(c, &c->model->tapes.rates, kink, slope) && direction_off(c, slope, direction);
        double random = 0.5 + 0.5 * fmod(0.6180339887498949 * k, 1);
        for (size_t n = 0; n < c->n_smooth && kink->due; n++) way[n] += random * direction[n];
        any |= kink->due;
    }
    return any && felt_beside(c, way, CLOSER * NEARBY_KINK, FELT_TOGETHER, -1, 0) > 0;
}

/* At the begin of a piece, where something may be zero for a short step because it begins there. */
void check_kinks(Instance *c) {
    Gradient *g = c->gradient;
    const Tape *tape = &c->model->tapes.rates;
    double *slope = g->slope, *direction = g->work;
    list_kinks(c);
    if (!settle(c)) return;
    note_rests(c, c->state.t, c->x);
    int any = any_felt(c);
    for (int k = 0; k < g->n_kinks; k++) {
        Kink *kink = g->kinks[k];
        if (!kink->due || !(any || kink->alone) || !factor_implicit(c)) continue;
        if (!slope_of_kink(c, tape, kink, slope) || !direction_off(c, slope, direction)) continue;
        double most = felt_beside(c, direction, NEARBY_KINK, FELT_KINK, -1, 0);
        kink->alone = most > 0 && felt_beside(c, direction, CLOSER * NEARBY_KINK, FELT_KINK, -1, 0) > 0.5 * most;
        if (kink->alone) add_small_doubt(c, FAILURE_LOST_AT_KINK, slope);
    }
    check_guards(c, g->rests + tape->n_operations);
}

/* What an output changes by along a direction, at the present point. */
static double slope_along(Instance *c, uint32_t of, const double *direction) {
    double *vector = c->gradient->moment, one = 1;
    c->variables_valid = c->state.z_valid = 0;
    if (!factor_implicit(c)) return NAN;
    memset(vector, 0, (c->n_smooth + 1) * sizeof(double));
    seed_unknowns(c, &of, 1, &one);
    add_bars(c, vector);
    return dot((int)c->n_smooth, vector, direction);
}

/* Does an output change otherwise to one side along a direction than to the other, also nearer to the present point? */
static int bends(Instance *c, uint32_t of, const double *direction) {
    double *kept = c->gradient->sides, sides[2];
    size_t size = c->n_smooth * sizeof(double);
    int any = 1;
    memcpy(kept, c->numbers, size);
    for (int nearer = 0; nearer < 2 && any; nearer++) {
        for (int side = 0; side < 2; side++) {
            double part = (side ? 1 : -1) * (nearer ? CLOSER : 1) * NEARBY_KINK;
            for (size_t k = 0; k < c->n_smooth; k++) c->numbers[k] += part * direction[k];
            sides[side] = slope_along(c, of, direction);
            memcpy(c->numbers, kept, size);
        }
        any = fabs(sides[1] - sides[0]) > FELT_KINK * max_of(fabs(sides[0]), fabs(sides[1]));
    }
    c->variables_valid = c->state.z_valid = 0;
    return any && factor_implicit(c);
}

/* Where outputs are read: at kinks of their own. */
void check_outputs(Instance *c) {
    Gradient *g = c->gradient;
    const Tape *tape = &c->model->tapes.variables;
    for (int r = 0, k = 0; r < tape->n_runs; r++)
        for (int end = k + tape->runs[r].count; k < end; k++) {
            if (!slope_of_kink(c, tape, &(Kink){tape->runs[r].operation, k, 0, 0}, g->slope)) continue;
            if (!direction_off(c, g->slope, g->work)) continue;
            int any = 0;
            for (int v = 0; v < g->n_of && !any; v++) any = bends(c, g->of[v], g->work);
            if (any) add_small_doubt(c, FAILURE_LOST_AT_KINK, g->slope);
        }
}
