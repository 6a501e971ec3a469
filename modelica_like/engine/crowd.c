/* Instants that follow each other ever faster: impacts that come to rest, relations that are rounding, or an error. */
#include "core.h"

#define CONVERGES 0.9 /* length of a crowd over the one before: rebounds come to their end, chattering does not */
#define OFTEN 4       /* changes of a relation in a crowd, of which it is a cause */
#define ROUNDED 1e-13 /* of values of about a hundred: what a relation that crowds may be by rounding */
#define CROWDED 1e-6  /* of the run: in less time, CROWD further instants follow each other ever faster */

/* A guard that is not a number is false; what is nothing but rounding is zero. */
double number_or_false(const Instance *c, int guard, double value) {
    if (isnan(value)) return -1;
    if (fabs(value) < c->noise[guard]) return 0;
    return fabs(value) < NOISE && fabs(value) > JUST_TRUE ? 0 : value;
}

/* Counts how often a state event has fired in a crowd. */
void count_in_crowd(Instance *c, int transition) {
    const Transition *all = c->model->transitions;
    if (transition < 0 || all[transition].timed) return;
    c->noisy[all[transition].index] += c->noisy[all[transition].index] < OFTEN;
}

/* Forgets a crowd of instants that has ended. */
void leave_crowd(Instance *c) {
    State *s = &c->state;
    double span = s->stop_time_defined ? s->stop_time - s->start_time : 1;
    double last = s->n_instants > 0 ? s->instants[(s->n_instants - 1) % CROWD] : s->t;
    if (s->t - last < CROWDED * span) return;
    s->resting = 0;
    memset(c->noisy, 0, (size_t)c->model->n_guards);
}

/* Relations that make a crowd though they do not leave zero by more than rounding wait from now on until they do: the
   slip of a clutch that is stuck, or what nothing drives. Tells whether there are any. */
static int drop_noise(Instance *c) {
    const Model *m = c->model;
    int any = 0;
    values_now(c, &m->tapes.guards, c->guards);
    for (int g = 0; g < m->n_guards; g++) {
        if (c->noisy[g] != OFTEN || !m->modes[m->transitions[m->guard_transition[g]].mode].hidden) continue;
        if (fabs(c->guards[g]) < ROUNDED && c->noise[g] < ROUNDED) c->noise[g] = ROUNDED, any = 1;
    }
    return any;
}

/* Notes an instant at which modes have changed. Where the last ones came ever faster, impacts end in contact if the
   model asks for it, and what is not held goes on as long as it converges; an error otherwise. */
Result crowded(Instance *c) {
    State *s = &c->state;
    double span = s->stop_time_defined ? s->stop_time - s->start_time : 1;
    double first = s->instants[s->n_instants % CROWD]; /* CROWD instants ago, once there were so many */
    s->instants[s->n_instants % CROWD] = s->t;
    if (++s->n_instants <= CROWD || s->t - first >= CROWDED * span) return RESULT_OK;
    if (c->model->settings->rests && (s->resting == 0 || s->t - first < CONVERGES * s->resting)) {
        s->resting = max_of(s->t - first, DBL_MIN);
        s->n_instants = 0;
        return RESULT_OK;
    }
    if (drop_noise(c)) {
        s->n_instants = 0;
        return RESULT_OK;
    }
    return fail(c, EVER_FASTER, s->t);
}
