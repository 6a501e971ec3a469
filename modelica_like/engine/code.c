/* Tapes and the LU of the step matrix as compiled code, where the model has some (straight.py); what they need. */
#include "core.h"

void use_codes(Model *m, const Codes *codes) {
    m->codes = codes;
    m->n_known = 0;
    for (int k = 0; k < N_CODES; k++) m->n_known += codes->tapes[k].n_known;
}

/* Lists and marks the guards of the modes at the point that was loaded last. */
const unsigned char *active_guards(Instance *c) {
    if (c->active_by == c->decided_by + 1) return c->active;
    c->active_by = c->decided_by + 1;
    c->n_active = 0;
    for (int g = 0; g < c->model->n_guards; g++)
        if ((c->active[g] = (unsigned char)guard_active(c, g))) c->active_guard[c->n_active++] = g;
    return c->active;
}

/* The compiled code of a tape, or NULL. What parameters and modes decide of it is then known. */
static const Code *code_of(Instance *c, const Tape *tape, const double **known) {
    int k = (int)(tape - tapes_of(c->model));
    if (c->model->codes == NULL || k >= N_CODES || c->model->codes->tapes[k].run == NULL) return NULL;
    const Code *code = &c->model->codes->tapes[k];
    double *values = c->known_values + code->first_known;
    if (c->known_by[k] != c->altered) code->known(c->slots, values);
    c->known_by[k] = c->altered;
    *known = values;
    return code;
}

int run_code(Instance *c, const Tape *tape, const unsigned char *wanted, double *outputs) {
    const double *known;
    const Code *code = code_of(c, tape, &known);
    if (code != NULL) code->run(c->slots, known, wanted, outputs);
    return code != NULL;
}

/* The rates, and their slopes along the dots of their arguments. */
void run_slopes(Instance *c, double *rates, double *slopes) {
    const Tape *tape = &c->model->tapes.rates;
    const double *known;
    const Code *code = code_of(c, tape, &known);
    if (code != NULL) code->slopes(c->slots, known, c->dots, rates, slopes);
    else tape_tangent(run_on_tape(c, tape, rates), c->slots, c->dots, slopes);
}

/* As `evaluate`, for values alone: slots of operations may keep other values. */
void values_at(Instance *c, const Tape *tape, double t, const double *point, double *outputs) {
    load(c, t, point);
    if (!run_code(c, tape, c->every, outputs)) tape_run(tape, c->slots, outputs);
}

void values_now(Instance *c, const Tape *tape, double *outputs) { values_at(c, tape, c->state.t, c->x, outputs); }

/* As compiled code does it; returns 0 where there is none, or it is not by LU without exchanges. */
int factor_by_code(Instance *c, double diagonal) {
    const Codes *codes = c->model->codes;
    int last = 2 * c->model->step.size + 1 - c->model->lu.n_ends;
    c->by_lu = codes != NULL && codes->factor != NULL &&
               codes->factor(c->jacobian, diagonal, c->lu, c->lu_pivots, c->lu_last) &&
               lu_factor(last, c->lu_last, c->last_order);
    return c->by_lu;
}

/* The stages after it; returns -1 where there is no code for them. */
int take_stages_by_code(Instance *c, const Step *step) {
    const double *known;
    if (!c->by_lu || code_of(c, &c->model->tapes.rates, &known) == NULL || c->model->codes->stages == NULL) return -1;
    return c->model->codes->stages(c->slots, known, step);
}
