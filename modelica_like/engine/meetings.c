/* Events that happen together for different reasons, those at which a run is read, and starts that a small change makes
 * others: what moves them apart has two derivatives. */
#include "adjoint.h"

#define SAME_TIME 1e-9 /* of the run: rounding */
#define FELT_JUMP 1e-9 /* of outputs and their rates */
#define LESS 0.1       /* what bends is less than this part of it, CLOSER */
#define SOON 100       /* of how far a number is moved: what follows from that at once, by the clock */

/* An output and its rate, on a side of an event. */
static void read_on_side(Instance *c, const void *side, uint32_t of, double result[2]) {
    double *vector = c->gradient->slope, *rates = c->gradient->rates, one = 1;
    state_copy_in(c, side);
    c->variables_valid = 0;
    if (!factor_implicit(c) || !get_value(c, find_variable(c->model, of), &result[0])) return;
    evaluate_now(c, &c->model->tapes.rates, rates);
    memset(vector, 0, (c->n_smooth + 1) * sizeof(double));
    seed_unknowns(c, &of, 1, &one);
    add_bars(c, vector);
    result[1] = vector[c->n_smooth] + dot(c->model->n_x, vector + (c->x - c->numbers), rates);
}

/* By how much, beside times of the run, the event comes later by numbers of the state at most; `other` and `speed`:
 * than another one, which changes `other` to the difference over that time. */
static double comes_later(const Instance *c, double *other, double speed) {
    const Gradient *g = c->gradient;
    const double *cause = g->moment;
    double time = max_of(fabs(c->state.t), c->state.t - c->state.start_time), most = 0;
    for (int k = 0; k < c->model->n_x; k++) {
        ptrdiff_t n = c->x - c->numbers + k;
        time = max_of(time, fabs(other[n] / speed) * (fabs(c->x[k]) + c->model->nominals[k]));
    }
    for (size_t n = 0; n < c->n_smooth; n++) {
        ptrdiff_t state = (ptrdiff_t)n - (c->x - c->numbers);
        int is_state = state >= 0 && state < c->model->n_x;
        double size = is_state ? fabs(c->x[state]) + c->model->nominals[state] : max_of(1, fabs(c->numbers[n]));
        other[n] = (other[n] / speed - (other == cause ? 0 : cause[n] / g->cause_speed)) / time;
        most = max_of(most, fabs(other[n]) * size);
    }
    return most;
}

static int begins_hold(const Model *m, const Transition *to) {
    int any = 0;
    for (int k = 0; k < m->n_holds; k++) any |= m->holds[k].mode == to->mode && m->holds[k].number == to->target;
    return any;
}

/* Do outputs feel what an event changes, or when it is? */
static int feels(const Instance *c, const Record *at) {
    const Gradient *g = c->gradient;
    const Model *m = c->model;
    const double *before = copied(c, at->before, c->numbers), *behind = copied(c, at->behind, c->numbers);
    const double *rates = g->rates, *later = rates + m->n_unknowns;
    ptrdiff_t x = c->x - c->numbers, d = c->d - c->numbers;
    for (int v = 0; v < g->n_of; v++) {
        const double *by = g->behind + (size_t)v * (c->n_smooth + 1);
        double jump = 0, change = 0, size = 0, speed = 0;
        for (int k = 0; k < m->n_x; k++) {
            jump += by[x + k] * (behind[x + k] - before[x + k]);
            size += fabs(by[x + k]) * (fabs(behind[x + k]) + m->nominals[k]);
            change += by[x + k] * (later[k] - rates[k]);
            speed += fabs(by[x + k]) * (fabs(later[k]) + fabs(rates[k]));
        }
        if (g->later[v] != 0 || fabs(jump) > FELT_JUMP * size || fabs(change) > FELT_JUMP * speed) return 1;
        for (int k = 0; k < m->n_d; k++)
            if (before[d + k] != behind[d + k] && by[d + k] != 0 && !(k < m->n_modes && m->modes[k].n_names > 0))
                return 1;
    }
    return 0;
}

/* What else happens in the first round must move as the cause does; but what begins to hold may do so in any order, and
 * parts that share a load give way together. Just at the start what the clock moves would come a moment later. */
void check_meeting(Instance *c, const Record *at, const unsigned char *fired) {
    Gradient *g = c->gradient;
    const Model *m = c->model;
    const Transition *cause = g->cause;
    int shared = anything_shared(c), is_felt = feels(c, at);
    for (int k = 0; k < m->n_transitions && is_felt; k++) {
        const Transition *to = &m->transitions[k];
        double speed = 1;
        if (!fired[k] || (g->early ? !to->timed : to == cause || (shared && !to->timed && !cause->timed))) continue;
        if (!g->early && begins_hold(m, to) && begins_hold(m, cause)) continue;
        const Tape *tape = to->timed ? &m->tapes.moments : &m->tapes.guards;
        evaluate_now(c, tape, c->outputs);
        if (!to->timed) speed = -c->outputs[m->n_guards + to->index];
        slope_of_output(c, tape, to->index, c->outputs, g->slope);
        for (int n = 0; n < m->n_d && g->early; n++) g->slope[c->d - c->numbers + n] = 0; /* a clock counts what is */
        if (g->early) add_doubt(c, FAILURE_LOST_AT_OTHER_MODES, g->slope);
        else if (speed == 0) add_small_doubt(c, FAILURE_LOST_AT_TOUCH, g->slope);
        else if (comes_later(c, g->slope, speed) > SAME_TIME) add_doubt(c, FAILURE_LOST_AT_MEETING, g->slope);
    }
}

/* Outputs may be read just at an event at which they, or their rates, jump. */
void check_reading(Instance *c, const Record *at) {
    Gradient *g = c->gradient;
    double span = span_of(c), sides[2][2] = {{0}}, t = ((const State *)at->before)->t;
    int any = 0;
    if (g->along != NULL || g->present - t > SAME_TIME * max_of(fabs(t), span)) return;
    for (int v = 0; v < g->n_of; v++) {
        read_on_side(c, at->behind, g->of[v], sides[1]);
        read_on_side(c, at->before, g->of[v], sides[0]);
        double value = fabs(sides[0][0]) + fabs(sides[1][0]), rate = fabs(sides[0][1]) + fabs(sides[1][1]);
        any |= fabs(sides[1][0] - sides[0][0]) > FELT_JUMP * value;
        any |= fabs(sides[1][1] - sides[0][1]) > FELT_JUMP * (rate + value / span);
    }
    if (any && comes_later(c, g->moment, g->cause_speed) > 0) add_doubt(c, FAILURE_LOST_AT_READING, g->moment);
}

/* Do the modes at a start lead soon, by the clock, to those from which it was moved? */
static int come_back(Instance *c, const double *d, double soon) {
    const Model *m = c->model;
    evaluate_now(c, &m->tapes.moments, c->outputs);
    for (int mode = 0; mode < m->n_modes; mode++) {
        int back = m->modes[mode].n_names == 0 || c->d[mode] == d[mode];
        for (int k = 0; k < m->n_transitions && !back; k++) {
            const Transition *to = &m->transitions[k];
            back = to->timed && to->mode == mode && to->target == d[mode] && is_source(c, to) &&
                   c->outputs[to->index] <= c->state.t + soon;
        }
        if (!back) return 0;
    }
    return 1;
}

/* The largest jump of states, rates, values of d and integrands from those behind a start, relative to their sizes. */
static double start_change(Instance *c, const Record *at, const double *rates, const double *integrands) {
    const Gradient *g = c->gradient;
    const Model *m = c->model;
    const double *x = copied(c, at->behind, c->x), *d = copied(c, at->behind, c->d), *now = variables_now(c);
    double most = 0;
    for (int row = 0; row < g->n_of; row++) {
        int variable = integrand_of(g, row);
        double size = variable < 0 ? 1 : fabs(now[variable]) + fabs(integrands[row]) + DBL_MIN;
        if (variable >= 0) most = max_of(most, fabs(now[variable] - integrands[row]) / size);
    }
    evaluate_now(c, &m->tapes.rates, c->rhs);
    for (int k = 0; k < m->n_x; k++) {
        double size = fabs(rates[k]) + fabs(c->rhs[k]) + m->nominals[k] / span_of(c);
        most = max_of(most, fabs(c->rhs[k] - rates[k]) / size);
        most = max_of(most, fabs(c->x[k] - x[k]) / (fabs(x[k]) + m->nominals[k]));
    }
    for (int k = 0; k < m->n_d; k++)
        if (k >= m->n_modes || m->modes[k].n_names == 0)
            most = max_of(most, fabs(c->d[k] - d[k]) / max_of(1, fabs(d[k])));
    return most;
}

/* Does a run begin alike where a number moves what happens by the clock just at its start to later? The nearer it is,
 * the less differs there. */
int begins_alike(Instance *c, const Record *at, int listed) {
    Gradient *g = c->gradient;
    double *rates = g->rates, changes[2] = {0};
    int alike = 1;
    state_copy_in(c, at->behind);
    evaluate_now(c, &c->model->tapes.rates, rates);
    for (int row = 0; row < g->n_of; row++)
        if (integrand_of(g, row) >= 0) g->later[row] = variables_now(c)[integrand_of(g, row)];
    for (int nearer = 0; nearer < 2; nearer++)
        for (int side = -1; side <= 1 && alike; side += 2) {
            double motion = fabs(g->motions[listed]) * (nearer ? CLOSER : 1);
            state_copy_in(c, at->before);
            c->numbers[g->listed[listed]] += side * motion;
            alike = at->pass(c) && come_back(c, copied(c, at->behind, c->d), SOON * motion);
            if (alike) changes[nearer] = max_of(changes[nearer], start_change(c, at, rates, g->later));
        }
    return alike && changes[1] <= max_of(LESS * changes[0], FELT_JUMP);
}
