/* Events at one instant: which transitions want to fire, and firing them until nothing does. */
#include <math.h>
#include <string.h>
#include "core.h"

#define ROUNDS 20
#define TOGETHER 6 /* rounds in which all fire that want to */
#define ALONE 6    /* further rounds per motion that may be held, in which only one fires */
#define BALANCED 1e-3
#define SAME_TIME 1e-12
#define CROWDED 1e-6 /* of the run: in less time, CROWD further instants follow each other ever faster */

/* A guard that is not a number is false; what is nothing but rounding is zero. */
double number_or_false(double guard) {
    if (isnan(guard)) return -1;
    return fabs(guard) < NOISE && fabs(guard) > JUST_TRUE ? 0 : guard;
}

static int is_source(const State *s, const Transition *one) {
    double mode = s->d[one->mode];
    return mode >= 0 && mode < 64 && (one->sources >> (int)mode & 1);
}

int guard_active(const State *s, int guard) { return is_source(s, &model_transitions[model_guard_transition[guard]]); }

static double just_after(const State *s) { return s->t + SAME_TIME * fmax(1, fabs(s->t)); }

double next_moment(Instance *c) {
    State *s = &c->state;
    double *moments = c->work.guards, next = INFINITY;
    if (N_MOMENTS == 0) return next;
    evaluate(c, &tape_moments, s->t, s->x, s->z, moments);
    for (int k = 0; k < N_TRANSITIONS; k++) {
        const Transition *one = &model_transitions[k];
        if (one->timed && is_source(s, one) && moments[one->index] > just_after(s))
            next = fmin(next, moments[one->index]);
    }
    return next;
}

/* Adds time events that are due and, unless they were found already, state events that are positive or about to be. */
int find_wanting(Instance *c, unsigned char *wanting, int guards_too) {
    State *s = &c->state;
    double *values = c->work.guards;
    int any = 0;
    if (N_MOMENTS > 0) {
        evaluate(c, &tape_moments, s->t, s->x, s->z, values);
        for (int k = 0; k < N_TRANSITIONS; k++)
            if (model_transitions[k].timed && values[model_transitions[k].index] <= just_after(s)) wanting[k] = 1;
    }
    if (N_GUARDS > 0 && guards_too) {
        evaluate(c, &tape_guards_soon, s->t, s->x, s->z, values);
        for (int k = 0; k < N_GUARDS; k++)
            if (number_or_false(values[k]) > 0) wanting[model_guard_transition[k]] = 1;
    }
    for (int k = 0; k < N_TRANSITIONS; k++) {
        wanting[k] = wanting[k] && is_source(s, &model_transitions[k]);
        any |= wanting[k];
    }
    return any;
}

/* After a switch, drop state events whose guard is as good as zero at the end of the time resolution: an importer that
   stops there has them balanced on that edge, and would see them switch back and forth. They come a little later. */
static void drop_balanced(Instance *c, unsigned char *wanting) {
    State *s = &c->state;
    double *soon = c->work.guards, *now = c->work.guards_before;
    if (N_GUARDS == 0) return;
    evaluate(c, &tape_guards_soon, s->t, s->x, s->z, soon);
    evaluate(c, &tape_guards, s->t, s->x, s->z, now);
    for (int k = 0; k < N_GUARDS; k++)
        if (number_or_false(now[k]) < 0 && number_or_false(soon[k]) <= BALANCED * fabs(now[k]))
            wanting[model_guard_transition[k]] = 0;
}

/* Move the states as little as possible, so that variables that follow from them take new values. */
void move_states(Instance *c, const int *nodes, const double *values, int count) {
    State *s = &c->state;
    double *slopes = c->work.square, *change = c->work.start_residual, *step = c->work.point;
    evaluate(c, &tape_variables, s->t, s->x, s->z, c->work.variables);
    for (int k = 0; k < count; k++) change[k] = values[k] - c->work.variables[nodes[k]];
    for (int k = 0; k < count; k++) adjoint_of_node(c, nodes[k], slopes + (size_t)k * N_X);
    least_squares(count, N_X, slopes, change, step);
    for (int k = 0; k < N_X; k++) s->x[k] += step[k];
}

/* Tells that a mode changes. */
void note_change(Instance *c, const char *name, int mode, int target) {
    const char *const *names = model_mode_names[mode];
    int before = (int)c->state.d[mode];
    c->state.n_events++;
    if (names != NULL && before >= 0 && before < model_mode_counts[mode])
        report(c, LOG_EVENTS, RESULT_OK, "t = %.12g s: %s: %s -> %s", c->state.t, name, names[before], names[target]);
}

/* Carry out transitions together; of one mode only the one declared first. */
static void fire(Instance *c, const unsigned char *wanting, Impacts *impacts) {
    State *s = &c->state;
    double values[AT_LEAST_ONE(N_RESETS)], node_value[AT_LEAST_ONE(N_RESETS)], d[AT_LEAST_ONE(N_D)];
    int nodes[AT_LEAST_ONE(N_RESETS)], count = 0;
    unsigned char changed[AT_LEAST_ONE(N_D)] = {0};
    evaluate(c, &tape_resets, s->t, s->x, s->z, values);
    memcpy(d, s->d, sizeof d);
    for (int k = 0; k < N_TRANSITIONS; k++) {
        const Transition *one = &model_transitions[k];
        if (!wanting[k] || changed[one->mode]) continue;
        changed[one->mode] = 1;
        note_change(c, one->name, one->mode, one->target);
        if (*one->notice) report(c, LOG_WARNING, RESULT_OK, "t = %.9g s: %s", s->t, one->notice);
        d[one->mode] = one->target;
        for (int r = one->first_reset; r < one->first_reset + one->n_resets; r++) {
            const Reset *reset = &model_resets[r];
            if (reset->kind == RESET_STATE) {
                impacts->struck = 0;
                s->x[reset->index] = values[reset->value] / reset->factor;
            } else if (reset->kind == RESET_DISCRETE) d[reset->index] = values[reset->value];
            else {
                nodes[count] = model_reset_nodes[reset->target];
                node_value[count++] = values[reset->value];
            }
        }
    }
    memcpy(s->d, d, sizeof d);
    if (count > 0) move_states(c, nodes, node_value, count);
}

/* Notes an instant; an error where the last ones came ever faster. */
static Result crowded(Instance *c) {
    State *s = &c->state;
    double span = s->stop_time_defined ? s->stop_time - s->start_time : 1;
    double first = s->instants[s->n_instants % CROWD]; /* CROWD instants ago, once there were so many */
    s->instants[s->n_instants % CROWD] = s->t;
    if (++s->n_instants <= CROWD || s->t - first >= CROWDED * span) return RESULT_OK;
    return report(c, LOG_ERROR, RESULT_ERROR,
        "Events follow each other ever faster at t = %.12g s. Give the switching a hysteresis, or smooth it.", s->t);
}

/* Before one of several that hold a motion gives way, let the others take more. */
static Result share_anew(Instance *c, unsigned char *wanting) {
    State *s = &c->state;
    double *soon = c->work.guards;
    if (N_CIRCUITS == 0) return RESULT_OK;
    share(c);
    c->variables_valid = 0;
    if (solve_implicit(c, s->t, s->x, s->z, 0) != RESULT_OK) return RESULT_ERROR;
    evaluate(c, &tape_guards_soon, s->t, s->x, s->z, soon);
    for (int k = 0; k < N_GUARDS; k++)
        if (!(number_or_false(soon[k]) > 0)) wanting[model_guard_transition[k]] = 0;
    return RESULT_OK;
}

/* Fire what wants to fire until nothing does. `wanting` holds the state events that were located, if `located`. */
Result iterate_events(Instance *c, unsigned char *wanting, int located) {
    State *s = &c->state;
    Impacts impacts = {0, {0}, {0}};
    if (find_wanting(c, wanting, !located)) {
        if (crowded(c) != RESULT_OK || share_anew(c, wanting) != RESULT_OK) return RESULT_ERROR;
    }
    for (int round = 0; round < ROUNDS + ALONE * N_HOLDS; round++) {
        double before[AT_LEAST_ONE(N_D)];
        int any = 0;
        for (int k = 0; k < N_TRANSITIONS; k++) {
            if (any && round >= TOGETHER) wanting[k] = 0;
            any |= wanting[k];
        }
        if (!any) return RESULT_OK;
        memcpy(before, s->d, sizeof before);
        fire(c, wanting, &impacts);
        share(c);
        c->variables_valid = 0;
        if (solve_implicit(c, s->t, s->x, s->z, 0) != RESULT_OK || stop_motions(c, before, &impacts) != RESULT_OK ||
            check_singular(c) != RESULT_OK)
            return RESULT_ERROR;
        memset(wanting, 0, N_TRANSITIONS);
        find_wanting(c, wanting, 1);
        drop_balanced(c, wanting);
    }
    return report(c, LOG_ERROR, RESULT_ERROR,
        "Modes still switch after %d rounds at t = %.12g s. Give the switching a hysteresis, or smooth what drives it.",
        ROUNDS + ALONE * N_HOLDS, s->t);
}
