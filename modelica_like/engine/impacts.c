/* Impacts: motions that modes begin to hold are stopped by an impulse. */
#include "core.h"

#define WEIGHS_NOTHING 1e-12
#define TRIALS 50
#define FELT 1e-9 /* change of a motion, relative to the largest one, from which on it is no rounding */

/* Rates, and reactions where they matter, at the present point, with or without the approaches. */
static Result ask(Instance *c, const Strike *strike, int approaching, int unsolved, double *rates, double *reactions) {
    const Model *m = c->model;
    for (int k = 0; k < m->n_holds; k++) c->d[m->holds[k].approach] = approaching ? strike->approach[k] : 0;
    if (unsolved && !solve_now(c, 0)) return RESULT_ERROR;
    values_now(c, &m->tapes.rates, rates);
    if (!strike->hard) return RESULT_OK;
    double *trial = c->trials + (size_t)approaching * (size_t)(m->n_unknowns + m->n_d);
    memcpy(trial, c->x, (size_t)m->n_unknowns * sizeof(double));
    memcpy(trial + m->n_unknowns, c->d, (size_t)m->n_d * sizeof(double));
    const double *values = variables_now(c);
    for (int k = 0; k < m->n_holds; k++) reactions[k] = strike->held[k] ? values[m->holds[k].reaction] : 0;
    return RESULT_OK;
}

/* Jump of the states, impulses and finite reactions of all that holds, with what is loose let go. */
static Result respond(Instance *c, Strike *strike) {
    const Model *m = c->model;
    double *d = c->respond_d, *z = c->respond_z, *rates = c->rates;
    int any = any_of(strike->loose, m->n_holds);
    memcpy(d, c->d, (size_t)m->n_d * sizeof(double));
    memcpy(z, c->z, (size_t)m->n_z * sizeof(double));
    for (int k = 0; k < m->n_holds; k++)
        if (strike->loose[k]) c->d[m->holds[k].mode] = m->holds[k].loose;
    if (any || !c->bounded) share(c); /* else it has just been done, with the implicit equations solved */
    if (strike->hard) find_held(c, c->terms, strike->held);
    for (int k = 0; k < m->n_holds; k++) strike->held[k] &= !strike->loose[k] && m->holds[k].reaction >= 0;
    Result result = ask(c, strike, 0, any || !c->bounded, rates, strike->reaction) &&
                    ask(c, strike, 1, 1, strike->jump, strike->impulse);
    for (int k = 0; k < m->n_x; k++) strike->jump[k] = INSTANT * (strike->jump[k] - rates[k]);
    for (int k = 0; k < m->n_holds; k++) strike->impulse[k] = INSTANT * (strike->impulse[k] - strike->reaction[k]);
    memcpy(c->d, d, (size_t)m->n_d * sizeof(double));
    memcpy(c->z, z, (size_t)m->n_z * sizeof(double));
    return result;
}

/* Lets go what cannot bear its impulse for an instant; tells whether anything is. */
static int let_go_unbearable(const Instance *c, Strike *strike, const Terms *terms) {
    double instant = 10 * TIME_RESOLUTION * max_of(1, fabs(c->state.t)), scale = 0;
    int any = 0;
    for (int k = 0; k < c->model->n_holds; k++)
        if (strike->held[k]) scale = max_of(scale, fabs(strike->impulse[k]));
    for (int k = 0; k < c->model->n_holds; k++) {
        double sign = strike->impulse[k] > 0 ? 1 : -1, margin;
        double capacity = sign > 0 ? terms[k].forward : terms[k].backward;
        if (!strike->held[k] || capacity >= UNLIMITED || c->model->holds[k].loose < 0) continue;
        margin = max_of(capacity - sign * strike->reaction[k], 0) * instant;
        if (fabs(strike->impulse[k]) > margin + WEIGHS_NOTHING * scale) any = strike->loose[k] = 1;
    }
    return any;
}

/* Puts back what was let go and would now move on against what nothing limits; tells whether anything would. */
static int put_back_approaching(Instance *c, Strike *strike, const Terms *terms) {
    const Model *m = c->model;
    int any = 0;
    if (!any_of(strike->loose, m->n_holds)) return 0;
    memcpy(c->x_kept, c->x, (size_t)m->n_x * sizeof(double));
    for (int k = 0; k < m->n_x; k++) c->x[k] += strike->jump[k];
    const double *after = variables_now(c);
    for (int k = 0; k < m->n_holds; k++) {
        double motion = after[m->holds[k].motion];
        double against = motion > 0 ? terms[k].forward : terms[k].backward;
        if (!strike->loose[k] || !strike->entering[k] || against < UNLIMITED) continue;
        if (fabs(motion) <= ROUNDING * m->holds[k].nominal) continue;
        strike->loose[k] = 0;
        any = 1;
    }
    memcpy(c->x, c->x_kept, (size_t)m->n_x * sizeof(double));
    return any;
}

/* Marks as loose also what bounces, or was moved in passing. */
static void mark_moved(Instance *c, Strike *strike, const Terms *terms) {
    const Model *m = c->model;
    const double *after = variables_now(c);
    double largest = 0;
    mark_held(c, terms, c->held);
    for (int k = 0; k < m->n_holds; k++) largest = max_of(largest, fabs(after[m->holds[k].motion] - strike->before[k]));
    for (int k = 0; k < m->n_holds; k++) {
        double now = after[m->holds[k].motion];
        if (c->held[k] && !strike->loose[k] && now == 0) continue; /* it stays */
        if (fabs(now - strike->before[k]) > FELT * largest || (strike->approach[k] != 0 && now != 0))
            strike->loose[k] = 1;
    }
}

/* Energy that each motion loses which is held. One that moved apart is hit by another first, and its own impulse begins
 * when it has stopped: what the mean of its speeds would give it comes off what the others lose. */
static void book(Instance *c, Strike *strike, int first) {
    const Model *m = c->model;
    const double *after = variables_now(c);
    double *energy = strike->energy, lost = 0, given = 0;
    for (int k = 0; k < m->n_holds; k++) {
        energy[k] = strike->held[k] && strike->approach[k] != 0
                        ? 0.5 * (strike->before[k] + after[m->holds[k].motion]) * strike->impulse[k]
                        : 0;
        lost += max_of(energy[k], 0);
        given += max_of(-energy[k], 0);
    }
    if (lost <= given) return;
    c->struck(c, -1, 0, first);
    for (int k = 0; k < m->n_holds; k++)
        if (energy[k] > 0) c->struck(c, k, energy[k] * ((lost - given) / lost), 0);
}

/* Carries out the impact; `loose` then tells what was knocked loose, bounces, or was moved in passing. */
static Result carry_out(Instance *c, Strike *strike, int first) {
    const Model *m = c->model;
    Terms *terms = c->strike_terms;
    if (strike->hard) find_held(c, terms, c->held);
    for (int k = 0; k < m->n_holds && !strike->hard; k++) terms[k].restitution = 0; /* rounding does not rebound */
    for (int trial = 0; trial < TRIALS && !(trial > 0 && c->bounded && c->budget < 1); trial++) {
        c->budget--;
        for (int k = 0; k < m->n_holds; k++)
            strike->approach[k] = strike->entering[k] && !strike->loose[k]
                                      ? -(1 + terms[k].restitution) * strike->before[k] / INSTANT
                                      : 0;
        if (!respond(c, strike)) return RESULT_ERROR;
        if (strike->hard && let_go_unbearable(c, strike, terms)) continue;
        if (!put_back_approaching(c, strike, terms)) break;
    }
    memcpy(strike->knocked, strike->loose, (size_t)m->n_holds);
    for (int k = 0; k < m->n_x; k++) c->x[k] += strike->jump[k];
    for (int k = 0; k < m->n_holds; k++) {
        const Held *one = &m->holds[k];
        if (strike->entering[k] && !strike->loose[k] && one->state >= 0)
            c->x[one->state] = -terms[k].restitution * strike->before[k] / one->factor;
    }
    if (!solve_now(c, 0)) return RESULT_ERROR;
    if (strike->hard && c->struck != NULL && !c->passing) book(c, strike, first);
    if (strike->hard) mark_moved(c, strike, terms);
    return RESULT_OK;
}

/* Speeds before an impact, and whether it is one. Friction stops nothing at once; where an importer lets it overrun
 * standstill, that is none. */
static void begin_strike(Instance *c, Strike *strike, const Terms *terms) {
    const double *values = variables_now(c);
    strike->hard = 0;
    for (int k = 0; k < c->model->n_holds; k++) {
        const Held *one = &c->model->holds[k];
        double size = fabs(strike->before[k] = values[one->motion]);
        int limited = max_of(terms[k].forward, terms[k].backward) < UNLIMITED;
        if (strike->entering[k] && !limited &&
            size > ROUNDING * max_of(largest_like(c->model, values, one->motion), one->nominal))
            strike->hard = 1;
    }
}

/* Motions that modes may hold, before states get new values. */
void keep_motions(Instance *c) {
    const double *values = variables_now(c);
    for (int k = 0; k < c->model->n_holds; k++) c->motions[k] = values[c->model->holds[k].motion];
}

/* What new values of states have moved although it is held: friction lets go, as it stops nothing at once, and what
 * nothing limits is struck. Tells whether friction lets go. */
static int find_jolted(Instance *c, const Terms *terms, const double *before, unsigned char *entering) {
    const Model *m = c->model;
    const double *values = variables_now(c);
    int any = 0;
    memset(c->jolted, 0, (size_t)m->n_holds);
    for (int k = 0; k < m->n_holds; k++) {
        const Held *one = &m->holds[k];
        double limit = ROUNDING * max_of(largest_like(m, values, one->motion), one->nominal);
        int limited = max_of(terms[k].forward, terms[k].backward) < UNLIMITED;
        if (!entering[k] || before[one->mode] != one->number) continue;
        entering[k] = fabs(values[one->motion]) > limit && fabs(values[one->motion] - c->motions[k]) > limit;
        if (!entering[k] || !limited || one->loose < 0) continue;
        entering[k] = 0;
        any = c->jolted[k] = 1;
    }
    return any;
}

/* Stop what modes have begun to hold since `before`, by an impulse that all other components pass on; and what is held
 * and got a new speed since keep_motions, if `jolts`. All impacts at an instant are one, from the speeds before the
 * first. */
Result stop_motions(Instance *c, const double *before, int jolts) {
    const Model *m = c->model;
    Strike *strike = &c->strike;
    Terms *terms = c->strike_terms;
    unsigned char *entered = c->entered;
    int first = !c->stopped;
    if (m->n_holds == 0) return RESULT_OK;
    memset(strike->loose, 0, (size_t)m->n_holds);
    find_held(c, terms, strike->entering);
    if (jolts && find_jolted(c, terms, before, strike->entering)) {
        choose_loose(c, c->jolted);
        if (!share_and_solve(c)) return RESULT_ERROR;
    }
    for (int k = 0; k < m->n_holds && !jolts; k++)
        strike->entering[k] &= before[m->holds[k].mode] != m->holds[k].number;
    if (!any_of(strike->entering, m->n_holds)) return RESULT_OK;
    begin_strike(c, strike, terms);
    if (strike->hard) {
        if (first) memcpy(c->impact_x, c->x, (size_t)m->n_x * sizeof(double));
        if (first) memcpy(c->impact_d, c->d, (size_t)m->n_d * sizeof(double));
        for (int k = 0; k < m->n_holds; k++) {
            const Held *one = &m->holds[k];
            int mode = (int)c->d[one->mode];
            strike->entering[k] = entered[k] |= strike->entering[k];
            /* Finite forces have released it since the first impact at this instant: they act after it. Or it has come
             * to rest by an impact that is now solved anew. */
            if (entered[k]) mode = one->number;
            else if (mode == one->number) mode = (int)c->impact_d[one->mode];
            if (mode == c->d[one->mode]) continue;
            note_change(c, one->name, -1, one->mode, mode);
            c->d[one->mode] = mode;
        }
        c->stopped = 1;
        memcpy(c->x, c->impact_x, (size_t)m->n_x * sizeof(double));
        if (!share_and_solve(c)) return RESULT_ERROR;
        begin_strike(c, strike, terms);
    }
    if (!carry_out(c, strike, first)) return RESULT_ERROR;
    for (int k = 0; k < m->n_holds; k++) entered[k] &= !strike->knocked[k];
    if (!any_of(strike->loose, m->n_holds)) return RESULT_OK;
    choose_loose(c, strike->loose);
    return share_and_solve(c);
}

/* The same for motions that have begun to be held at the present point, for derivatives: tells whether it is `hard`,
 * and carries it out where it is asked what is `knocked` loose. */
Result strike_here(Instance *c, const unsigned char *entering, unsigned char *knocked, int *hard) {
    Strike *strike = &c->strike;
    size_t size = (size_t)c->model->n_holds;
    memset(strike->loose, 0, size);
    memcpy(strike->entering, entering, size);
    find_held(c, c->strike_terms, c->held);
    begin_strike(c, strike, c->strike_terms);
    *hard = strike->hard;
    if (knocked == NULL) return RESULT_OK;
    Result result = carry_out(c, strike, 0);
    memcpy(knocked, strike->knocked, size);
    return result;
}
