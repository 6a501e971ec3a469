/* Values of variables by their references. */
#include "core.h"

#define OFFSET 1e-12

const Variable *find_variable(const Model *m, uint32_t reference) {
    uint32_t place = m->n_variables > 0 ? reference - m->variables[0].reference : 0; /* where no number is left out */
    int low = 0, high = m->n_variables - 1, middle = place < (uint32_t)m->n_variables ? (int)place : high;
    for (; low <= high; middle = low + (high - low) / 2) {
        if (m->variables[middle].reference == reference) return &m->variables[middle];
        if (m->variables[middle].reference < reference) low = middle + 1;
        else high = middle - 1;
    }
    return NULL;
}

const Variable *known_variable(Instance *c, uint32_t reference, ValueType type) {
    const Variable *v = find_variable(c->model, reference);
    FailureCode why = FAILURE_MISUSED;
    if (v == NULL) why = FAILURE_NO_VARIABLE;
    else if (v->type != (int)type && type != ANY_TYPE)
        why = v->type == TYPE_ARRAY ? FAILURE_OF_ARRAY : FAILURE_NOT_REAL + (type != TYPE_FLOAT64);
    return why == FAILURE_MISUSED || fail_with(c, why, reference, 0, 0) ? v : NULL;
}

/* Values that a tape gives are computed once per point. */
static Result compute(Instance *c, const Variable *v) {
    if (v->kind == KIND_VARIABLE) ask_for(c, v->index);
    if (c->variables_valid & 1 << v->kind) return RESULT_OK;
    if (v->kind != KIND_DERIVED && !settle(c)) return RESULT_ERROR;
    switch (v->kind) {
        case KIND_DERIVED: evaluate_now(c, &c->model->tapes.derived, c->seen_derived); break;
        case KIND_DERIVATIVE: evaluate_special(c, &c->model->tapes.rates, c->state.t, c->x, c->seen_rates); break;
        case KIND_GUARD: get_indicators(c, c->seen_indicators); break;
        default: evaluate_special(c, &c->model->tapes.variables, c->state.t, c->x, c->variables);
    }
    c->variables_valid |= 1 << v->kind;
    return RESULT_OK;
}

/* In initialization mode, whatever was set since the last time must have its effect before anything is read. */
static Result make_ready(Instance *c) {
    return c->state.phase != PHASE_INITIALIZATION || c->state.solved || start_solve(c);
}

/* Of a variable that is known, or NULL: then its reference was wrong. */
Result get_value(Instance *c, const Variable *v, double *value) {
    const int known = 1 << KIND_PARAMETER | 1 << KIND_INPUT | 1 << KIND_TIME | 1 << KIND_DERIVED;
    const int computed = 1 << KIND_VARIABLE | 1 << KIND_DERIVATIVE | 1 << KIND_DERIVED | 1 << KIND_GUARD;
    if (v == NULL || (!(known & 1 << v->kind) && !make_ready(c))) return RESULT_ERROR;
    if (computed & 1 << v->kind && !compute(c, v)) return RESULT_ERROR;
    *value = v->kind == KIND_INPUT ? input_at(c, v->index, c->state.t) : c->values[v->kind][v->index];
    return RESULT_OK;
}

/* Looks up variables that are read many times. */
Result find_all(Instance *c, int64_t count, const uint32_t *references, const Variable **found) {
    for (int64_t k = 0; k < count; k++) {
        const Variable *v = found[k] = known_variable(c, references[k], ANY_TYPE);
        if (v == NULL) return RESULT_ERROR;
        if (v->kind == KIND_VARIABLE) ask_for(c, v->index);
    }
    return RESULT_OK;
}

/* Of each kind, the first one computes all, except for inputs. */
Result get_all(Instance *c, int64_t count, const Variable *const *found, double *values) {
    unsigned there = 0;
    for (int64_t k = 0; k < count; k++) {
        const Variable *v = found[k];
        if (there >> v->kind & 1) values[k] = c->values[v->kind][v->index];
        else if (!get_value(c, v, &values[k])) return RESULT_ERROR;
        if (v->kind != KIND_INPUT) there |= 1u << v->kind;
    }
    return RESULT_OK;
}

/* Solves what getting a value from the present point needs. */
Result make_consistent(Instance *c) { return make_ready(c) && settle(c); }

void get_derivatives(Instance *c, double *derivatives) {
    values_now(c, &c->model->tapes.rates, c->rhs);
    memcpy(derivatives, c->rhs, c->model->n_x * sizeof(double));
    rest_rates(c, derivatives);
}

/* Guards of active modes, as event iteration judges them: an indicator above zero is an event that wants to fire, so
 * that after every event all are below zero. The others are constant, so that nobody looks for their zeros. A root
 * finder would take an indicator of exactly zero for a root at its first instant: what wants to stay is below zero by
 * an offset. It shifts no event, as it is gone above zero; its size is that of rounding, and products of it do not
 * underflow, by whose sign root finders judge. */
void get_indicators(Instance *c, double *indicators) {
    values_now(c, &c->model->tapes.guards_soon, c->guards);
    drop_balanced(c, c->guards);
    drop_returning(c, NULL, c->guards);
    for (int k = 0; k < c->model->n_guards; k++) {
        double value = guard_active(c, k) ? number_or_false(c, k, c->guards[k]) : -1;
        indicators[k] = value > 0 ? value : value - OFFSET;
    }
}

static void touch(Instance *c) {
    c->state.z_valid = c->state.solved = 0;
    c->state.inputs_changed = 1;
    c->variables_valid = 0;
}

/* Their lines begin anew at the present time. */
static void touch_inputs(Instance *c) {
    keep_before_change(c);
    for (int k = 0; k < c->model->n_u; k++) c->u[k] = input_at(c, k, c->state.t);
    c->state.u_time = c->state.t;
    touch(c);
}

static int before_start(const State *s) {
    return s->phase == PHASE_INSTANTIATED || s->phase == PHASE_INITIALIZATION || s->phase == PHASE_CONFIGURATION;
}

/* From now on tapes are not specialised for the value of a parameter. */
void mark_tuned(Instance *c, int parameter) {
    if (c->tuned[parameter]) return;
    c->tuned[parameter] = 1;
    c->decided_by++;
    forget_sets(c);
}

static Result set_parameter(Instance *c, const Variable *v, double value) {
    double low = c->model->parameter_min[v->index], high = c->model->parameter_max[v->index];
    if (!v->tunable && !before_start(&c->state)) return fail(c, PARAMETER_FIXED, v->reference);
    if (v->tunable && c->state.phase == PHASE_CONTINUOUS) return fail(c, TUNED_OUTSIDE_EVENTS, v->reference);
    if (value < low || value > high)
        return fail_with(c, FAILURE_BELOW_LEAST + (value > high), v->reference, value, value < low ? low : high);
    if (c->p[v->index] == value) return RESULT_OK;
    if (!before_start(&c->state)) mark_tuned(c, v->index);
    keep_before_change(c);
    c->p[v->index] = value;
    touch(c);
    return RESULT_OK;
}

/* Columns of tables must rise; they are set number by number, so this is asked where they are needed. */
Result check_tables(Instance *c) {
    const Model *m = c->model;
    for (int k = 0; k < m->n_rising; k++) {
        const Rising *one = &m->rising[k];
        if (!(c->p[one->below] < c->p[one->above])) return fail(c, COLUMN_FALLS, k, c->p[one->above], c->p[one->below]);
    }
    return RESULT_OK;
}

static Result set_start(Instance *c, const Variable *v, double value) {
    if (!before_start(&c->state)) return fail(c, START_TOO_LATE, v->reference);
    if (v->kind == KIND_DISCRETE) {
        c->d[v->index] = c->mode_value[v->index] = value; /* read before the start; used by every start */
        c->mode_given[v->index] = 1;
    } else if (v->start >= 0 && v->start < c->model->n_starts) {
        c->start_value[v->start] = value;
        c->start_given[v->start] = 1;
    } else return fail(c, FOLLOWS, v->reference);
    touch(c);
    return RESULT_OK;
}

/* As get_value; modes by their numbers. */
Result set_value(Instance *c, const Variable *v, double value) {
    const Model *m = c->model;
    if (v == NULL) return RESULT_ERROR;
    if (!isfinite(value)) return fail(c, NOT_FINITE, v->reference);
    if (v->type == TYPE_ENUMERATION && (value < 0 || value >= m->modes[v->index].n_names))
        return fail(c, NO_SUCH_MODE, v->reference, value, m->modes[v->index].n_names - 1);
    if (v->kind == KIND_PARAMETER) return set_parameter(c, v, value);
    if (v->kind != KIND_INPUT) return set_start(c, v, v->type == TYPE_ENUMERATION ? floor(value) : value);
    if (input_at(c, v->index, c->state.t) == value) return RESULT_OK;
    touch_inputs(c);
    c->u[v->index] = value; /* its rate stays, in whatever order an importer gives the two */
    return RESULT_OK;
}

/* From now on the input moves with this rate. */
Result set_input_rate(Instance *c, uint32_t reference, int order, double rate) {
    const Variable *v = known_variable(c, reference, TYPE_FLOAT64);
    if (order != 1) return refuse(c, "Inputs have derivatives of order 1 only.");
    if (v == NULL) return RESULT_ERROR;
    if (v->kind != KIND_INPUT) return fail(c, NO_INPUT, v->reference);
    if (!isfinite(rate)) return fail(c, INPUT_RATE_NOT_FINITE, v->reference);
    if (c->u_rate[v->index] == rate) return RESULT_OK;
    touch_inputs(c);
    c->u_rate[v->index] = rate;
    return RESULT_OK;
}

Result set_time(Instance *c, double time) {
    if (!isfinite(time)) return refuse(c, "The time is not a finite number.");
    c->state.t = time;
    c->state.z_valid = c->variables_valid = 0;
    c->next_by = 0;
    return RESULT_OK;
}

Result set_states(Instance *c, const double *x) {
    const Model *m = c->model;
    for (int k = 0; k < m->n_x; k++)
        if (!isfinite(x[k])) return fail(c, STATE_NOT_FINITE, k);
    memcpy(c->x, x, m->n_x * sizeof(double));
    c->state.z_valid = c->variables_valid = 0;
    return RESULT_OK;
}
