/* Impacts, as in initialize/holds.py: motions that modes begin to hold are stopped by an impulse. */
#include <math.h>
#include <string.h>
#include "core.h"

#define INSTANT 1e-9 /* duration of an impact; finite forces cancel whatever it is */
#define WEIGHS_NOTHING 1e-12
#define TRIALS 50
#define FELT 1e-9 /* change of a motion, relative to the largest one, from which on it is no rounding */

typedef struct { /* of all motions that modes hold */
    double before[AT_LEAST_ONE(N_HOLDS)], approach[AT_LEAST_ONE(N_HOLDS)];
    double impulse[AT_LEAST_ONE(N_HOLDS)], reaction[AT_LEAST_ONE(N_HOLDS)];
    unsigned char entering[AT_LEAST_ONE(N_HOLDS)], loose[AT_LEAST_ONE(N_HOLDS)], held[AT_LEAST_ONE(N_HOLDS)];
    unsigned char knocked[AT_LEAST_ONE(N_HOLDS)]; /* let go in the impact itself */
    double jump[AT_LEAST_ONE(N_X)];
    int hard; /* what nothing limits stops more than what rounding leaves */
} Strike;

static const double *motions(Instance *c) {
    State *s = &c->state;
    evaluate(c, &tape_variables, s->t, s->x, s->z, c->work.variables);
    return c->work.variables;
}

/* Rates and reactions at the present point, with or without the approaches. */
static Result ask(Instance *c, const Strike *strike, int approaching, double *rates, double *reactions) {
    State *s = &c->state;
    const double *values;
    for (int k = 0; k < N_HOLDS; k++) s->d[model_holds[k].approach] = approaching ? strike->approach[k] : 0;
    if (solve_implicit(c, s->t, s->x, s->z, 0) != RESULT_OK) return RESULT_ERROR;
    evaluate(c, &tape_rates, s->t, s->x, s->z, c->work.rhs);
    memcpy(rates, c->work.rhs, N_X * sizeof(double));
    values = motions(c);
    for (int k = 0; k < N_HOLDS; k++) reactions[k] = strike->held[k] ? values[model_holds[k].reaction] : 0;
    return RESULT_OK;
}

/* Jump of the states, impulses and finite reactions of all that holds, with what is loose let go. */
static Result respond(Instance *c, Strike *strike) {
    State *s = &c->state;
    Terms terms[AT_LEAST_ONE(N_HOLDS)];
    double d[AT_LEAST_ONE(N_D)], z[AT_LEAST_ONE(N_Z)], rates[AT_LEAST_ONE(N_X)];
    Result result;
    memcpy(d, s->d, sizeof d);
    memcpy(z, s->z, sizeof z);
    for (int k = 0; k < N_HOLDS; k++)
        if (strike->loose[k]) s->d[model_holds[k].mode] = model_holds[k].loose;
    share(c);
    hold_terms(c, terms);
    mark_held(c, terms, strike->held);
    for (int k = 0; k < N_HOLDS; k++) strike->held[k] &= !strike->loose[k] && model_holds[k].reaction >= 0;
    result = ask(c, strike, 0, rates, strike->reaction);
    if (result == RESULT_OK) result = ask(c, strike, 1, strike->jump, strike->impulse);
    for (int k = 0; k < N_X; k++) strike->jump[k] = INSTANT * (strike->jump[k] - rates[k]);
    for (int k = 0; k < N_HOLDS; k++) strike->impulse[k] = INSTANT * (strike->impulse[k] - strike->reaction[k]);
    memcpy(s->d, d, sizeof d);
    memcpy(s->z, z, sizeof z);
    return result;
}

/* Lets go what cannot bear its impulse for an instant; tells whether anything is. */
static int let_go_unbearable(const Instance *c, Strike *strike, const Terms *terms) {
    double instant = 10 * TIME_RESOLUTION * fmax(1, fabs(c->state.t)), scale = 0;
    int any = 0;
    for (int k = 0; k < N_HOLDS; k++)
        if (strike->held[k]) scale = fmax(scale, fabs(strike->impulse[k]));
    for (int k = 0; k < N_HOLDS; k++) {
        double sign = strike->impulse[k] > 0 ? 1 : -1, margin;
        double capacity = sign > 0 ? terms[k].forward : terms[k].backward;
        if (!strike->held[k] || capacity >= UNLIMITED || model_holds[k].loose < 0) continue;
        margin = fmax(capacity - sign * strike->reaction[k], 0) * instant;
        if (fabs(strike->impulse[k]) > margin + WEIGHS_NOTHING * scale) any = strike->loose[k] = 1;
    }
    return any;
}

/* Puts back what was let go and would now move on against what nothing limits; tells whether anything would. */
static int put_back_approaching(Instance *c, Strike *strike, const Terms *terms) {
    State *s = &c->state;
    double x[AT_LEAST_ONE(N_X)];
    const double *after;
    int any = 0;
    memcpy(x, s->x, sizeof x);
    for (int k = 0; k < N_X; k++) s->x[k] += strike->jump[k];
    after = motions(c);
    for (int k = 0; k < N_HOLDS; k++) {
        double motion = after[model_holds[k].motion];
        double against = motion > 0 ? terms[k].forward : terms[k].backward;
        if (!strike->loose[k] || !strike->entering[k] || against < UNLIMITED) continue;
        if (fabs(motion) <= ROUNDING * model_holds[k].nominal) continue;
        strike->loose[k] = 0;
        any = 1;
    }
    memcpy(s->x, x, sizeof x);
    return any;
}

/* Marks as loose also what bounces, or was moved in passing. */
static void mark_moved(Instance *c, Strike *strike, const Terms *terms) {
    unsigned char held[AT_LEAST_ONE(N_HOLDS)];
    const double *after = motions(c);
    double largest = 0;
    mark_held(c, terms, held);
    for (int k = 0; k < N_HOLDS; k++) largest = fmax(largest, fabs(after[model_holds[k].motion] - strike->before[k]));
    for (int k = 0; k < N_HOLDS; k++) {
        double now = after[model_holds[k].motion];
        int stays = held[k] && !strike->loose[k] && now == 0;
        if (stays) continue;
        if (fabs(now - strike->before[k]) > FELT * largest || (strike->approach[k] != 0 && now != 0))
            strike->loose[k] = 1;
    }
}

/* Carries out the impact; `loose` then tells what was knocked loose, bounces, or was moved in passing. */
static Result carry_out(Instance *c, Strike *strike) {
    State *s = &c->state;
    Terms terms[AT_LEAST_ONE(N_HOLDS)];
    hold_terms(c, terms);
    for (int trial = 0; trial < TRIALS; trial++) {
        for (int k = 0; k < N_HOLDS; k++)
            strike->approach[k] = strike->entering[k] && !strike->loose[k]
                                      ? -(1 + terms[k].restitution) * strike->before[k] / INSTANT
                                      : 0;
        if (respond(c, strike) != RESULT_OK) return RESULT_ERROR;
        if (strike->hard && let_go_unbearable(c, strike, terms)) continue;
        if (!put_back_approaching(c, strike, terms)) break;
    }
    memcpy(strike->knocked, strike->loose, sizeof strike->knocked);
    for (int k = 0; k < N_X; k++) s->x[k] += strike->jump[k];
    for (int k = 0; k < N_HOLDS; k++) {
        const Held *one = &model_holds[k];
        if (strike->entering[k] && !strike->loose[k] && one->state >= 0)
            s->x[one->state] = -terms[k].restitution * strike->before[k] / one->factor;
    }
    if (solve_implicit(c, s->t, s->x, s->z, 0) != RESULT_OK) return RESULT_ERROR;
    if (strike->hard) mark_moved(c, strike, terms);
    return RESULT_OK;
}

/* What the impact knocks loose takes the mode that its start would take. */
static void choose_again(Instance *c, const Strike *strike) {
    State *s = &c->state;
    double d[AT_LEAST_ONE(N_D)];
    unsigned char decided[AT_LEAST_ONE(N_D)];
    memcpy(d, s->d, sizeof d);
    memset(decided, 1, sizeof decided);
    evaluate(c, &tape_discrete_starts, s->t, s->x, s->z, c->work.guards);
    for (int k = 0; k < N_HOLDS; k++) {
        int mode = model_holds[k].mode;
        if (!strike->loose[k]) continue;
        s->d[mode] = c->work.guards[mode];
        decided[mode] = 0;
    }
    choose_modes(c, decided);
    for (int k = 0; k < N_HOLDS; k++) {
        int mode = model_holds[k].mode, chosen = (int)s->d[mode];
        if (chosen == (int)d[mode]) continue;
        s->d[mode] = d[mode];
        note_change(c, model_holds[k].name, mode, chosen);
        s->d[mode] = d[mode] = chosen;
    }
}

/* Close what finite forces have opened since the first impact at this instant: they come after it. */
static Result hold_again(Instance *c, const unsigned char *entered) {
    State *s = &c->state;
    for (int k = 0; k < N_HOLDS; k++) {
        const Held *one = &model_holds[k];
        if (!entered[k] || s->d[one->mode] == one->number) continue;
        note_change(c, one->name, one->mode, one->number);
        s->d[one->mode] = one->number;
    }
    share(c);
    return solve_implicit(c, s->t, s->x, s->z, 0);
}

/* Speeds before an impact, and whether it is one. Friction stops nothing at once; where an importer lets it overrun
 * standstill, that is none. */
static void begin_strike(Instance *c, Strike *strike, const Terms *terms) {
    const double *values = motions(c);
    strike->hard = 0;
    for (int k = 0; k < N_HOLDS; k++) {
        const Held *one = &model_holds[k];
        double size = fabs(strike->before[k] = values[one->motion]);
        int limited = fmax(terms[k].forward, terms[k].backward) < UNLIMITED;
        if (strike->entering[k] && !limited && size > ROUNDING * fmax(largest_like(values, one->motion), one->nominal))
            strike->hard = 1;
    }
}

/* Stop what modes have begun to hold since `before`, by an impulse that all other components pass on. All impacts at an
 * instant are one, from the speeds before the first. */
Result stop_motions(Instance *c, const double *before, Impacts *impacts) {
    State *s = &c->state;
    Strike strike;
    Terms terms[AT_LEAST_ONE(N_HOLDS)];
    int any = 0;
    if (N_HOLDS == 0) return RESULT_OK;
    memset(&strike, 0, sizeof strike);
    hold_terms(c, terms);
    mark_held(c, terms, strike.entering);
    for (int k = 0; k < N_HOLDS; k++) {
        if (before[model_holds[k].mode] == model_holds[k].number) strike.entering[k] = 0;
        any |= strike.entering[k];
    }
    if (!any) return RESULT_OK;
    begin_strike(c, &strike, terms);
    if (strike.hard) {
        for (int k = 0; k < N_HOLDS; k++) strike.entering[k] = impacts->entered[k] |= strike.entering[k];
        if (!impacts->struck) memcpy(impacts->x, s->x, sizeof impacts->x);
        impacts->struck = 1;
        memcpy(s->x, impacts->x, sizeof impacts->x);
        if (hold_again(c, impacts->entered) != RESULT_OK) return RESULT_ERROR;
        begin_strike(c, &strike, terms);
    }
    if (carry_out(c, &strike) != RESULT_OK) return RESULT_ERROR;
    for (int k = 0; k < N_HOLDS; k++) impacts->entered[k] &= !strike.knocked[k];
    any = 0;
    for (int k = 0; k < N_HOLDS; k++) any |= strike.loose[k];
    if (!any) return RESULT_OK;
    choose_again(c, &strike);
    share(c);
    return solve_implicit(c, s->t, s->x, s->z, 0);
}
