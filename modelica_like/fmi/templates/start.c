/* Consistent start values and modes: tables say which start values determine what, Newton's method does the rest. */
#include <math.h>
#include <string.h>
#include "core.h"

#define MODE_ROUNDS 5
#define MAX_NEWTON 50
#define CONSISTENT 1e-8
#define AT_REST (-1) /* in place of a start value: the variable is zero */

void start_defaults(Instance *c) {
    State *s = &c->state;
    memcpy(s->p, model_parameters, N_P * sizeof(double));
    memcpy(s->u, model_inputs, N_U * sizeof(double));
    memcpy(s->x, model_guesses, N_X * sizeof(double));
    memcpy(s->z, model_z_guesses, N_Z * sizeof(double));
}

/* Start values as the model says, or as they were given. */
static const double *start_values(Instance *c) {
    const State *s = &c->state;
    evaluate(c, &tape_start_values, s->t, s->x, s->z, c->work.start_values);
    for (int k = 0; k < N_STARTS; k++)
        if (s->start_given[k]) c->work.start_values[k] = s->start_value[k];
    return c->work.start_values;
}

static Result apply_direct(Instance *c, const double *values) {
    unsigned char known[AT_LEAST_ONE(N_X)] = {0};
    double *x = c->state.x;
    for (int k = 0; k < N_START_DIRECT; k++) {
        const StartOf *one = &model_start_direct[k];
        double value = values[one->start] / one->factor;
        if (known[one->position] && fabs(value - x[one->position]) > CONSISTENT * (1 + fabs(x[one->position])))
            return report(c, LOG_ERROR, RESULT_ERROR, "Two start values of %s contradict each other: %.9g and %.9g.",
                model_state_names[one->position], x[one->position], value);
        if (!known[one->position]) x[one->position] = value;
        known[one->position] = 1;
    }
    return RESULT_OK;
}

static void apply_guesses(Instance *c, const double *values) {
    State *s = &c->state;
    for (int k = 0; k < N_START_X_GUESS; k++)
        s->x[model_start_x_guess[k].position] = values[model_start_x_guess[k].start] / model_start_x_guess[k].factor;
    for (int k = 0; k < N_START_Z_GUESS; k++)
        s->z[model_start_z_guess[k].position] = values[model_start_z_guess[k].start];
}

static double *start_unknown(Instance *c, int column) {
    if (column < N_X) return &c->state.x[column];
    if (column < N_X + N_Y) return &c->work.slots[SLOT_Y + column - N_X];
    return &c->state.z[column - N_X - N_Y];
}

/* Newton's method on the equations between free states, the variables that follow from them, and start values. */
static Result solve_start_system(Instance *c, const double *values) {
    State *s = &c->state;
    double *residual = c->work.start_residual, *step = c->work.start_unknowns, error = 0;
    memset(c->work.slots + SLOT_Y, 0, N_Y * sizeof(double));
    for (int k = 0; k < N_START_ZERO; k++) s->x[model_start_zero[k]] = 0;
    for (int round = 0; round < MAX_NEWTON; round++) {
        double change = 0;
        evaluate(c, &tape_start_system, s->t, s->x, s->z, residual);
        tape_run(&tape_start_jacobian, c->work.slots, c->work.jacobian);
        error = 0;
        for (int k = 0; k < N_START_UNKNOWNS; k++) {
            int given = model_start_rows[k].start;
            double target = given == AT_REST ? 0 : values[given];
            step[k] = residual[model_start_rows[k].row] - target;
            error = fmax(error, isfinite(step[k]) ? fabs(step[k]) / (1 + fabs(target)) : INFINITY);
        }
        if (!isfinite(error) || !qr_factor(&pattern_start, c->work.jacobian, &c->work)) {
            error = INFINITY;
            break;
        }
        qr_solve(&pattern_start, &c->work, step);
        for (int k = 0; k < N_START_UNKNOWNS; k++) {
            double *unknown = start_unknown(c, model_start_columns[k]);
            *unknown -= step[k];
            change = fmax(change, fabs(step[k]) / (1 + fabs(*unknown)));
        }
        if (change < 1e-13) break;
    }
    if (error <= CONSISTENT) return RESULT_OK;
    return report(c, LOG_ERROR, RESULT_ERROR,
        "No start was found that meets all start values. Give others, or start values of states.");
}

static Result check_dependent(Instance *c, const double *values) {
    State *s = &c->state;
    if (N_START_DEPENDENT == 0) return RESULT_OK;
    evaluate(c, &tape_variables, s->t, s->x, s->z, c->work.variables);
    for (int k = 0; k < N_START_DEPENDENT; k++) {
        double value = values[model_start_dependent[k].start],
               actual = c->work.variables[model_start_dependent[k].node];
        if (!(fabs(actual - value) <= CONSISTENT * (1 + fabs(value))))
            return report(c, LOG_ERROR, RESULT_ERROR,
                "A start value of %.9g cannot be met: the variable follows to be %.9g.", value, actual);
    }
    return RESULT_OK;
}

static Result solve_states(Instance *c) {
    State *s = &c->state;
    const double *values = c->work.start_values;
    if (apply_direct(c, values) != RESULT_OK) return RESULT_ERROR;
    if (N_START_UNKNOWNS > 0 && solve_start_system(c, values) != RESULT_OK) return RESULT_ERROR;
    if (solve_implicit(c, s->t, s->x, s->z, 0) != RESULT_OK) return RESULT_ERROR;
    return check_dependent(c, values);
}

/* States with zero derivatives, the nearest to the guess; what nothing depends on and what is conserved stay. */
static Result solve_steady(Instance *c) {
    State *s = &c->state;
    int n = N_STEADY + N_Z;
    double *rates = c->work.rhs, *a = c->work.square, *step = c->work.point, residual = INFINITY;
    for (int round = 0; round < MAX_NEWTON && n > 0; round++) {
        double change = 0;
        evaluate(c, &tape_rates, s->t, s->x, s->z, rates);
        tape_run(&tape_jacobian, c->work.slots, c->work.jacobian);
        memset(c->work.matrix, 0, (size_t)pattern_step.n_nonzeros * sizeof(double));
        for (int k = 0; k < N_JACOBIAN; k++) c->work.matrix[jacobian_to_step[k]] = c->work.jacobian[k];
        memset(a, 0, (size_t)n * (size_t)n * sizeof(double));
        for (int j = 0; j < n; j++) {
            int column = j < N_STEADY ? model_steady_states[j] : N_X + j - N_STEADY;
            for (int k = pattern_step.colind[column]; k < pattern_step.colind[column + 1]; k++)
                for (int i = 0; i < n; i++)
                    if ((i < N_STEADY ? model_steady_states[i] : N_X + i - N_STEADY) == pattern_step.row[k])
                        a[i * n + j] = c->work.matrix[k];
        }
        residual = 0;
        for (int i = 0; i < n; i++) {
            c->work.vector[i] = rates[i < N_STEADY ? model_steady_states[i] : N_X + i - N_STEADY];
            residual = fmax(residual, isfinite(c->work.vector[i]) ? fabs(c->work.vector[i]) : INFINITY);
        }
        if (!isfinite(residual)) break;
        keeping_least_squares(n, N_STEADY, a, a + (size_t)n * (size_t)n, c->work.vector, step);
        for (int j = 0; j < n; j++) {
            *(j < N_STEADY ? &s->x[model_steady_states[j]] : &s->z[j - N_STEADY]) -= step[j];
            change = fmax(change, fabs(step[j]) / (1 + fabs(step[j])));
        }
        if (change < 1e-13) break;
    }
    if (n == 0 || residual <= 1e-6) return RESULT_OK;
    return report(c, LOG_ERROR, RESULT_ERROR, "No steady state was found at t = %.9g s.", s->t);
}

/* Choose modes that are not decided by their start conditions: the first that holds wins. */
void choose_modes(Instance *c, unsigned char *decided) {
    State *s = &c->state;
    double *holds = c->work.guards;
    evaluate(c, &tape_start_conditions, s->t, s->x, s->z, holds);
    for (int k = 0; k < N_START_MODES; k++) {
        const StartMode *one = &model_start_modes[k];
        if (holds[k] == 0 || decided[one->mode]) continue;
        decided[one->mode] = 1;
        s->d[one->mode] = one->target;
    }
}

/* What slides one way where it began the other way (`begun`, if there is a steady state before) is held: equilibrium
 * lies in between, where it stands still. Tells whether a mode changed. */
static int choose_start_modes(Instance *c, const double *begun) {
    State *s = &c->state;
    unsigned char decided[AT_LEAST_ONE(N_D)];
    double d[AT_LEAST_ONE(N_D)];
    memcpy(decided, s->mode_given, sizeof decided);
    memcpy(d, s->d, sizeof d);
    choose_modes(c, decided);
    if (begun) evaluate(c, &tape_variables, s->t, s->x, s->z, c->work.variables);
    for (int k = 0; k < N_HOLDS && begun; k++) {
        const Held *one = &model_holds[k];
        if (begun[k] * c->work.variables[one->motion] < 0 && s->d[one->mode] != d[one->mode])
            s->d[one->mode] = one->number;
    }
    return memcmp(d, s->d, sizeof d) != 0;
}

static void start_discretes(Instance *c) {
    State *s = &c->state;
    double *values = c->work.guards;
    evaluate(c, &tape_discrete_starts, s->t, s->x, s->z, values);
    for (int k = 0; k < N_D; k++)
        if (!s->mode_given[k]) s->d[k] = values[k];
}

static void apply_defaults(Instance *c, const double *values) {
    for (int k = 0; k < N_START_DEFAULT; k++) {
        const StartOf *one = &model_start_default[k];
        c->state.x[one->position] = values[one->start] / one->factor;
    }
}

/* The steady state of the present modes, in which what they hold stands still; held motions become what they were. */
static Result find_steady(Instance *c, double *begun) {
    State *s = &c->state;
    Terms terms[AT_LEAST_ONE(N_HOLDS)];
    unsigned char held[AT_LEAST_ONE(N_HOLDS)];
    double zero[AT_LEAST_ONE(N_HOLDS)] = {0};
    int nodes[AT_LEAST_ONE(N_HOLDS)], count = 0;
    apply_defaults(c, c->work.start_values);
    if (apply_direct(c, c->work.start_values) != RESULT_OK) return RESULT_ERROR;
    if (N_HOLDS > 0) hold_terms(c, terms);
    mark_held(c, terms, held);
    evaluate(c, &tape_variables, s->t, s->x, s->z, c->work.variables);
    for (int k = 0; k < N_HOLDS; k++) {
        begun[k] = c->work.variables[model_holds[k].motion];
        if (held[k]) nodes[count++] = model_holds[k].motion;
    }
    if (count > 0) move_states(c, nodes, zero, count);
    return solve_steady(c);
}

/* Surfaces that stick against too large a torque are not in equilibrium. */
static Result check_modes_hold(Instance *c) {
    const State *s = &c->state;
    double *guards = c->work.guards;
    if (N_GUARDS == 0) return RESULT_OK;
    evaluate(c, &tape_guards, s->t, s->x, s->z, guards);
    for (int k = 0; k < N_GUARDS; k++) {
        const Transition *one = &model_transitions[model_guard_transition[k]];
        if (guard_active(s, k) && guards[k] > 0)
            return report(c, LOG_ERROR, RESULT_ERROR,
                "No steady state was found at t = %.9g s: %s does not stay in its mode.", s->t, one->name);
    }
    return RESULT_OK;
}

/* States from parameters and start values; events at the start have not happened yet. */
Result start_solve(Instance *c) {
    State *s = &c->state;
    double begun[AT_LEAST_ONE(N_HOLDS)];
    int round;
    memcpy(s->x, model_guesses, N_X * sizeof(double));
    memcpy(s->z, model_z_guesses, N_Z * sizeof(double));
    memset(s->d, 0, N_D * sizeof(double));
    start_discretes(c);
    share(c);
    start_values(c);
    apply_guesses(c, c->work.start_values);
    if (START_STEADY) {
        apply_defaults(c, c->work.start_values);
        if (apply_direct(c, c->work.start_values) != RESULT_OK) return RESULT_ERROR;
        choose_start_modes(c, NULL);
        share(c);
    }
    for (round = 0; round < MODE_ROUNDS; round++) {
        if ((START_STEADY ? find_steady(c, begun) : solve_states(c)) != RESULT_OK) return RESULT_ERROR;
        if (!choose_start_modes(c, START_STEADY ? begun : NULL)) break;
        share(c);
    }
    if (round == MODE_ROUNDS)
        return report(c, LOG_ERROR, RESULT_ERROR,
            "The modes at the start do not settle: they and the start values change each other in a circle.");
    rest(c);
    if (solve_implicit(c, s->t, s->x, s->z, 0) != RESULT_OK || check_singular(c) != RESULT_OK) return RESULT_ERROR;
    if (START_STEADY && check_modes_hold(c) != RESULT_OK) return RESULT_ERROR;
    s->z_valid = s->solved = 1;
    s->piece_valid = s->event_pending = 0;
    c->variables_valid = 0;
    return RESULT_OK;
}
