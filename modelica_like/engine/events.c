/* Events at one instant: which transitions want to fire, and firing them until nothing does. */
#include "core.h"

#define ROUNDS 20
#define TOGETHER 6 /* rounds in which all fire that want to */
#define ALONE 6    /* further rounds per motion that may be held, in which only one fires */
#define BALANCED 1e-3
#define SAME_TIME 1e-12
#define LATER 1e3      /* time resolutions, for the difference of a rate: what turns round in less is at rest */
#define CLEARS 0.5     /* least height of a rebound above zero, in its whole height: less of it is rounding */
#define STAYS_WITHIN 2 /* how far from zero a guard at rest may be: as it came in so many time resolutions */
#define NEVER 1e29     /* s: a moment that does not come */
#define JUMPED 1e-6    /* share of what a guard was before an update: a jump to less is one to zero */

int is_source(const Instance *c, const Transition *one) {
    double mode = c->d[one->mode];
    return mode >= 0 && mode < 64 && (one->sources >> (int)mode & 1);
}

int guard_active(const Instance *c, int guard) {
    return is_source(c, &c->model->transitions[c->model->guard_transition[guard]]);
}

/* Room for a mark per transition; none wants to fire yet. */
unsigned char *nothing_wanting(Instance *c) { return memset(c->wishes, 0, (size_t)c->model->n_transitions); }

double just_after(const State *s) { return s->t + SAME_TIME * max_of(1, fabs(s->t)); }

/* Do parameters and modes alone decide when time events come? */
int has_fixed_moments(const Model *m) {
    const Tape *tape = &m->tapes.moments;
    int fixed = 1;
#define FIXED(slot) ((slot) >= m->slot_p && ((slot) < m->slot_u || (slot) >= m->slot_d))
    for (int k = 0; k < tape->n_operations; k++)
        fixed &= FIXED(tape->operands[k].left) && FIXED(tape->operands[k].right);
    for (int k = 0; k < tape->n_outputs; k++) fixed &= FIXED(tape->outputs[k]);
#undef FIXED
    return fixed;
}

/* Are those that decide the same as when the next one was looked up? */
static int knows_next(Instance *c) {
    if (c->fixed_moments) load_decided(c);
    return c->fixed_moments && c->next_by == c->altered;
}

/* Of the time events that are not idle, or of all. */
double next_moment(Instance *c, int idle_too) {
    double *moments = c->guards, next = INFINITY, delayed = c->model->n_delays > 0 ? c->state.delayed_until : INFINITY;
    if (c->model->n_moments == 0) return delayed;
    if (idle_too && knows_next(c) && c->next_moment > just_after(&c->state)) return min_of(delayed, c->next_moment);
    evaluate_now(c, &c->model->tapes.moments, moments);
    for (int k = 0; k < c->model->n_transitions; k++) {
        const Transition *one = &c->model->transitions[k];
        if (one->timed && (idle_too || !c->idle[k]) && is_source(c, one) && moments[one->index] > just_after(&c->state))
            next = min_of(next, moments[one->index]);
    }
    if (idle_too) c->next_moment = next, c->next_by = c->altered;
    return min_of(delayed, next);
}

int is_due(Instance *c) {
    if (delays_due(c) || c->model->n_moments == 0) return delays_due(c);
    if (knows_next(c)) return c->next_moment <= just_after(&c->state);
    return find_wanting(c, nothing_wanting(c), 0);
}

/* Evaluates a tape at states moved by their rates. */
static void look_ahead(Instance *c, const Tape *tape, double step, double *values) {
    double *point = c->vector + c->model->n_z;
    values_now(c, &c->model->tapes.rates, c->rhs);
    for (int k = 0; k < c->model->n_unknowns; k++) point[k] = c->x[k] + (k < c->model->n_x ? step * c->rhs[k] : 0);
    values_at(c, tape, c->state.t + step, point, values);
}

/* Adds time events that are due and, unless they were found already, state events that are positive or about to be. */
int find_wanting(Instance *c, unsigned char *wanting, int guards_too) {
    const Model *m = c->model;
    double *values = c->guards;
    int any = 0;
    if (m->n_moments > 0) {
        evaluate_now(c, &m->tapes.moments, values);
        for (int k = 0; k < m->n_transitions; k++)
            if (m->transitions[k].timed && values[m->transitions[k].index] <= just_after(&c->state)) wanting[k] = 1;
    }
    if (m->n_guards > 0 && guards_too) {
        /* What has rebounded many times in less than the time resolution is judged where it turns round. */
        double later = TIME_RESOLUTION * max_of(1, fabs(c->state.t));
        if (c->state.resting > 0 && c->state.resting < later) look_ahead(c, &m->tapes.guards_soon, later, values);
        else values_now(c, &m->tapes.guards_soon, values);
        for (int k = 0; k < m->n_guards; k++)
            if (number_or_false(c, k, values[k]) > 0) wanting[m->guard_transition[k]] = 1;
    }
    for (int k = 0; k < m->n_transitions; k++) any |= wanting[k] = wanting[k] && is_source(c, &m->transitions[k]);
    return any;
}

/* Guards as good as zero at the end of the time resolution: an importer that stops there has them balanced on that
   edge, and would see them switch back and forth. They come a little later: after a switch nobody wants them, and
   indicators have to agree. `soon` has the guards at that end, and gets those of now instead. */
void drop_balanced(Instance *c, double *soon) {
    double *now = c->guards_before;
    int any = 0;
    for (int k = 0; k < c->model->n_guards; k++) any |= number_or_false(c, k, soon[k]) > 0 && guard_active(c, k);
    if (!any) return;
    values_now(c, &c->model->tapes.guards, now);
    for (int k = 0; k < c->model->n_guards; k++)
        if (number_or_false(c, k, now[k]) < 0 && soon[k] > 0 && soon[k] <= BALANCED * fabs(now[k])) soon[k] = now[k];
}

/* What rounding of the states makes of a guard. */
static double rounding_of_guard(Instance *c, int guard) {
    double *point = c->vector + c->model->n_z;
    for (int k = 0; k < c->model->n_unknowns; k++)
        point[k] = c->x[k] * (k < c->model->n_x ? 1 + ROUNDING_OF_STATES : 1);
    values_at(c, &c->model->tapes.guards, c->state.t, point, c->looks);
    return fabs(c->looks[guard] - c->guards_begun[guard]);
}

/* Is a relation that changed in this instant still where its event was located, which is not quite at zero, and does
 * nothing move it any more? What comes to rest at a limit stays there: from now on so little counts as zero. */
static int rests_at_edge(Instance *c, int guard, double now, double rate) {
    double begun = c->guards_begun[guard], came = -c->guards_begun[c->model->n_guards + guard];
    if (rate != 0 || now != begun || !(now <= STAYS_WITHIN * TIME_RESOLUTION * max_of(1, fabs(c->state.t)) * came))
        return 0;
    c->noise[guard] = max_of(c->noise[guard], max_of(STAYS_WITHIN * now, rounding_of_guard(c, guard)));
    return 1;
}

/* At the same edge a mode that was left in this round is not wanted back where that soon is no longer so, and a
 * relation that changed in this instant neither, in later rounds, which updates ask for: what settles within few time
 * resolutions moves so much within one that both modes want the other. Without `modes`, at the begin of an instant and
 * for an importer, all relations count as changed. Modes of friction and of ideal elements do not: what drives them is
 * another. `soon` as above. */
void drop_returning(Instance *c, const double *modes, double *soon) {
    const Model *m = c->model;
    double *now = c->guards_before;
    int any = 0;
    for (int k = 0; k < m->n_guards; k++) any |= number_or_false(c, k, soon[k]) > 0 && guard_active(c, k);
    if (!any) return;
    values_now(c, &m->tapes.guards, now);
    for (int k = 0; k < m->n_guards; k++) {
        const Transition *one = &m->transitions[m->guard_transition[k]];
        int relation = m->modes[one->mode].hidden, begun = !modes || c->d_begun[one->mode] == one->target;
        int left = (modes && modes[one->mode] == one->target) || (relation && begun);
        int returns = guard_active(c, k) && left && now[k] > 0;
        if (!returns || !(soon[k] > 0)) continue;
        int rests = modes && relation && rests_at_edge(c, k, now[k], now[m->n_guards + k]);
        if (rests || now[k] < LATER * (now[k] - soon[k])) soon[k] = -now[k];
    }
}

/* Would a relation that changed in this instant return, though its guard is so near zero that it falls below it soon?
 */
static int at_its_edge(const Instance *c, int guard, double now, double soon) {
    const Transition *one = &c->model->transitions[c->model->guard_transition[guard]];
    int begun = c->model->modes[one->mode].hidden && c->d_begun[one->mode] == one->target;
    return begun && now < LATER * (now - soon);
}

void note_change(Instance *c, int name, int transition, int mode, int target) {
    const Model *m = c->model;
    const Mode *one = &m->modes[mode];
    const int *names = m->mode_names + one->first_name;
    double before = c->d[mode];
    c->state.n_events++;
    count_in_crowd(c, transition);
    if (c->noted != NULL && !c->passing) c->noted(c, transition, mode, target);
    if (before >= 0 && before < one->n_names && target >= 0 && target < one->n_names)
        report(c, LOG_EVENTS, RESULT_OK, "t = %.12g s: %s: %s -> %s", c->state.t, text_of(m, name),
            text_of(m, names[(int)before]), text_of(m, names[target]));
}

/* Fire transitions together; of one mode only the one declared first. An error if one of them ends the run. */
static Result fire(Instance *c, unsigned char *wanting) {
    const Model *m = c->model;
    double *d = c->d_fired;
    unsigned char *changed = memset(c->changed, 0, (size_t)m->n_modes);
    evaluate_now(c, &m->tapes.resets, c->reset_values);
    memcpy(d, c->d, (size_t)m->n_d * sizeof(double));
    for (int k = 0; k < m->n_transitions; k++) {
        const Transition *one = &m->transitions[k];
        const char *notice = text_of(m, one->notice);
        wanting[k] &= !changed[one->mode];
        if (!wanting[k]) continue;
        changed[one->mode] = 1;
        note_change(c, one->name, k, one->mode, one->target);
        if (one->ends == 1) return fail(c, LIMIT_PASSED, c->state.t, k);
        if (one->ends) gradient_lose(c, FAILURE_LOST_AT_END);
        c->state.ended |= one->ends;
        if (*notice) report(c, LOG_WARNING, RESULT_OK, "t = %.9g s: %s", c->state.t, notice);
        d[one->mode] = one->target;
    }
    int count = take_resets(c, wanting, d);
    memcpy(c->d, d, (size_t)m->n_d * sizeof(double));
    return move_targets(c, count);
}

/* Evaluate the discrete equations once; tells whether something changes. */
static Result update_once(Instance *c, int *changes) {
    *changes = 0;
    if (c->model->n_updates == 0) return RESULT_OK;
    int count = take_updates(c, changes);
    if (!*changes) return RESULT_OK;
    c->state.n_events++;
    return move_targets(c, count) && share_and_solve(c) && check_singular(c);
}

static int ticks(const Instance *c, const Transition *one) {
    return one->timed && is_source(c, one) && c->d[one->mode] == one->target;
}

/* How many clocks there are in the present modes: what happens at moments again and again leads back to its mode. */
int count_clocks(const Instance *c) {
    int count = 0;
    for (int k = 0; k < c->model->n_transitions; k++) count += ticks(c, &c->model->transitions[k]);
    return count;
}

/* Marks what happens when all clocks tick, at whatever time: they, and state events that are due, but no end of a
 * run. */
static void find_ticking(Instance *c, const double *moments, unsigned char *wanting) {
    const Model *m = c->model;
    unsigned char *changed = memset(c->changed, 0, (size_t)m->n_modes);
    if (m->n_guards > 0) values_now(c, &m->tapes.guards, c->guards);
    for (int k = 0; k < m->n_transitions; k++) {
        const Transition *one = &m->transitions[k];
        int due = !one->timed && !one->ends && is_source(c, one) && c->guards[one->index] > 0;
        wanting[k] = !changed[one->mode] && (due || (ticks(c, one) && moments[one->index] < NEVER));
        changed[one->mode] |= wanting[k];
    }
}

/* Lets every clock tick once. `step` gets the shortest time to another tick. */
Result tick(Instance *c, double *step) {
    const Model *m = c->model;
    double *before = c->outputs, *after = c->guards, events = c->state.n_events;
    unsigned char *wanting = nothing_wanting(c);
    int changes = 1;
    evaluate_now(c, &m->tapes.moments, before);
    find_ticking(c, before, wanting);
    evaluate_now(c, &m->tapes.resets, c->reset_values);
    for (int k = 0; k < m->n_transitions; k++)
        if (wanting[k]) c->d[m->transitions[k].mode] = m->transitions[k].target;
    if (!move_targets(c, take_resets(c, wanting, c->d))) return RESULT_ERROR;
    for (int round = 0; round < ROUNDS && changes; round++)
        if (!update_once(c, &changes)) return RESULT_ERROR;
    c->state.n_events = events; /* none of a run */
    evaluate_now(c, &m->tapes.moments, after);
    *step = INFINITY;
    for (int k = 0; k < m->n_transitions; k++) {
        const Transition *one = &m->transitions[k];
        double next = one->timed ? after[one->index] : INFINITY;
        if (ticks(c, one) && next < NEVER) *step = min_of(*step, next - max_of(before[one->index], c->state.t));
    }
    return changes ? fail(c, NOT_SETTLED, c->state.t, ROUNDS) : share_and_solve(c);
}

/* Of state events that want to fire, keep those whose guards are positive. */
static void keep_wanting(Instance *c, const double *soon, unsigned char *wanting) {
    for (int k = 0; k < c->model->n_guards; k++)
        if (!(number_or_false(c, k, soon[k]) > 0)) wanting[c->model->guard_transition[k]] = 0;
}

/* Before one of several that hold a motion gives way, let the others take more. */
static Result share_anew(Instance *c, unsigned char *wanting) {
    if (!anything_shared(c)) return RESULT_OK;
    size_t size = (size_t)c->model->n_d * sizeof(double);
    memcpy(c->d_earlier, c->d, size);
    if (!share_and_solve(c)) return RESULT_ERROR;
    if (memcmp(c->d_earlier, c->d, size) == 0) return RESULT_OK; /* only rounding could say that nothing gives way */
    values_now(c, &c->model->tapes.guards_soon, c->guards);
    keep_wanting(c, c->guards, wanting);
    return RESULT_OK;
}

/* Adds guards that an update has made positive, however soon they will fall again: a rebound may be that short. One
   that jumps to zero, up to rounding and the location of the event, is judged by where it goes, as others are, also
   where it was no further from it: a relation that changed in this instant does not return for that. So is one that
   will not be positive once the relations and whole numbers have followed of which it is made. */
static void want_jumped(Instance *c, const double *before, unsigned char *wanting) {
    double *now = c->guards_before, *rates = now + c->model->n_guards, *soon = c->guards;
    double step = TIME_RESOLUTION * fmax(1, fabs(c->state.t));
    values_now(c, &c->model->tapes.guards, now);
    values_now(c, &c->model->tapes.guards_soon, soon);
    for (int g = 0; g < c->model->n_guards; g++)
        if (before[g] < 0 && now[g] > -JUMPED * before[g] && guard_active(c, g) &&
            !at_its_edge(c, g, now[g], soon[g]) &&
            (number_or_false(c, g, soon[g]) > 0 || !(now[g] + step * rates[g] > 0)))
            wanting[c->model->guard_transition[g]] = 1;
}

/* Fire what wants to fire until nothing does. `wanting` holds the state events that were located, if `located`. */
Result iterate_events(Instance *c, unsigned char *wanting, int located) {
    const Model *m = c->model;
    double *before = c->d_before, *jumped = c->edge_guards;
    int changes = m->n_updates > 0, rounds = ROUNDS + ALONE * (m->n_holds + m->n_ideals), met, jolts = may_jolt(m);
    int due = 0; /* time events are no crowd: they were to come, and those that come ever faster meet in one instant */
    double events = c->state.n_events;
    c->stopped = 0;
    memset(c->entered, 0, (size_t)m->n_holds);
    leave_crowd(c);
    if (m->n_guards > 0) values_now(c, &m->tapes.guards, c->guards_begun);
    if (find_wanting(c, wanting, !located)) {
        if (!located && !c->bounded && m->n_guards > 0) {
            drop_returning(c, NULL, c->guards);
            keep_wanting(c, c->guards, wanting);
        }
        if (m->n_ideals > 0 && !pushed(c) && !meet(c, -1, &met)) return RESULT_ERROR;
        if (!share_anew(c, wanting)) return RESULT_ERROR;
    }
    for (int k = 0; k < m->n_transitions; k++) due |= wanting[k] && m->transitions[k].timed;
    for (int round = 0; round < rounds; round++) {
        int any = 0;
        if (c->passing) gradient_round(c, round, wanting, 0);
        if (!changes && (round > 0 || pushed(c)) && !any_of(wanting, m->n_transitions)) {
            if (!meet(c, -1, &met)) return RESULT_ERROR;
            if (met) find_wanting(c, wanting, 1);
        }
        for (int k = 0; k < m->n_transitions; k++) any |= wanting[k] = wanting[k] && (!any || round < TOGETHER);
        if (!gradient_round(c, round, wanting, any | changes))
            return refuse_contradiction(c) && (c->state.n_events == events || due || crowded(c));
        any = any_of(wanting, m->n_transitions); /* it may have told others to fire */
        if (c->bounded && --c->budget < 1) {
            c->state.at_event = 1; /* the rest comes at the beginning of the next step */
            return RESULT_OK;
        }
        c->round = round;
        memcpy(c->d_earlier, before, (size_t)m->n_d * sizeof(double));
        memcpy(before, c->d, (size_t)m->n_d * sizeof(double));
        if (jolts) keep_motions(c);
        if (any && !fire(c, wanting)) return RESULT_ERROR;
        if (any && (!share_and_solve(c) || !check_singular(c)))
            return RESULT_ERROR; /* nothing stops what is prescribed */
        if (any && (!stop_motions(c, before, jolts) || !check_singular(c))) return RESULT_ERROR;
        if (any && m->n_ideals > 0) {
            int same = round > 0; /* modes return */
            for (int k = 0; k < m->n_ideals; k++) same &= c->d[m->ideals[k].mode] == c->d_earlier[m->ideals[k].mode];
            if (!meet(c, same ? GIVEN_BACK : 0, &met)) return RESULT_ERROR;
        }
        if (m->n_updates > 0 && m->n_guards > 0) values_now(c, &m->tapes.guards, jumped);
        if (jolts) keep_motions(c);
        if (!update_once(c, &changes)) return RESULT_ERROR;
        memcpy(c->d_fired, c->d, (size_t)m->n_d * sizeof(double));
        if (changes && jolts && (!stop_motions(c, c->d_fired, 1) || !check_singular(c))) return RESULT_ERROR;
        memset(wanting, 0, m->n_transitions);
        if (find_wanting(c, wanting, 1) && !c->bounded) {
            drop_balanced(c, c->guards);
            drop_returning(c, before, c->guards);
            keep_wanting(c, c->guards, wanting);
        }
        if (changes && m->n_guards > 0) want_jumped(c, jumped, wanting);
    }
    if (changes) return fail(c, NOT_SETTLED, c->state.t, rounds);
    int last = 0;
    while (last < m->n_transitions - 1 && !wanting[last]) last++;
    return fail(c, STILL_SWITCHING, rounds, c->state.t, last);
}

/* An error if a relation became true and stays true, because what it sets is at rest and is turned back too late: a
   ball rebounds ever more slowly, or not at all, until the acceleration a of the guard turns it back within few time
   resolutions. With value g and rate r < 0 after that, g - r^2 / 2a is the least value that comes; above zero the
   relation fires no more, and the ball falls through the floor. Its modes before the instant are in d_begun. */
Result check_turned_back(Instance *c) {
    const Model *m = c->model;
    const double *before = c->guards_begun;
    double step = LATER * TIME_RESOLUTION * max_of(1, fabs(c->state.t)), *now = c->guards_before;
    double *rates = now + m->n_guards, *later = c->edge_guards + m->n_guards;
    values_now(c, &m->tapes.guards, now);
    look_ahead(c, &m->tapes.guards, step, c->edge_guards);
    for (int g = 0; g < m->n_guards; g++)
        if (guard_active(c, g) && now[g] + 0.5 * step * (rates[g] + later[g]) > 0) return RESULT_OK; /* it comes */
    for (int g = 0; g < m->n_guards; g++) {
        const Transition *one = &m->transitions[m->guard_transition[g]];
        double rate = rates[g], turn = later[g] - rate;
        double came = fabs(before[m->n_guards + g]); /* a guard that was fast is found within the time resolution */
        int slow = fabs(rate) < turn && fabs(before[g]) < (turn + came / LATER) * step;
        if (!slow || c->d_begun[one->mode] == one->target || c->d[one->mode] != one->target) continue;
        if (!m->modes[one->mode].hidden) continue; /* a declared mode may keep its condition */
        if (rate > -turn / LATER || now[g] > CLEARS * rate * rate * step / (2 * turn))
            return fail(c, STAYS_TRUE, c->state.t, m->guard_transition[g]);
    }
    return RESULT_OK;
}

/* One event iteration for an importer's event mode. Where anything fired or was set, its solver must begin anew even if
   no state jumped: rates do, and importers restart only when told that states have changed. */
Result update_discrete(Instance *c, int *restart, double *next) {
    double before = c->state.n_events;
    int changed = c->state.inputs_changed;
    *restart = changed | delays_due(c);
    if (changed && (!check_tables(c) || !renew(c))) return RESULT_ERROR;
    c->state.inputs_changed = 0;
    if (!handle_event(c) || (changed && !leave_instant(c, 1))) return RESULT_ERROR;
    *restart |= c->state.n_events != before;
    *next = next_moment(c, 1);
    return RESULT_OK;
}
