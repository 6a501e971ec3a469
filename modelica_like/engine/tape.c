/* Runs tapes: values, derivatives in one direction (tangent), derivatives of one combination of results (adjoint). */
#include "core.h"

#define WORTH_IT 6 /* runs of a tape in the same modes from which on it is worth it */
#define MAX_NEWTON 50
#define BOUNDED_NEWTON 3 /* iterations where the work is bounded; the next step takes up what they leave */
#define SOLVED 1e-8      /* of the residual before an iteration: they are piecewise linear, and solved */

/* Partial derivatives of a value f = operation(a, b). A unary operation has its operand on both sides. */
void slopes(int operation, double a, double b, double f, double *by_left, double *by_right) {
#define OPERATION(name, value, by_a, by_b) \
    case OPERATION_##name:                 \
        *by_left = by_a;                   \
        *by_right = by_b;                  \
        break;
    switch (operation) {
#include "operations.h"
        default: *by_left = *by_right = 0;
    }
#undef OPERATION
}

static void run_operations(const Tape *tape, double *slots) {
#define OPERATION(name, value, by_a, by_b)                                  \
    case OPERATION_##name:                                                  \
        for (int k = 0; k < count; k++) {                                   \
            double a = slots[operand[k].left], b = slots[operand[k].right]; \
            (void)b;                                                        \
            result[k] = value;                                              \
        }                                                                   \
        break;
    double *result = slots + tape->first_result;
    const Operands *operand = tape->operands;
    for (int r = 0; r < tape->n_runs; r++) {
        int count = tape->runs[r].count;
        switch (tape->runs[r].operation) {
#include "operations.h"
        }
        operand += count;
        result += count;
    }
#undef OPERATION
}

void tape_run(const Tape *tape, double *slots, double *outputs) {
    run_operations(tape, slots);
    for (int k = 0; k < tape->n_outputs; k++) outputs[k] = slots[tape->outputs[k]];
}

/* Of outputs that are not wanted, values stay as they are. */
static void run_wanted(const Special *s, double *slots, double *outputs) {
    run_operations(&s->tape, slots);
    for (int k = 0; k < s->tape.n_outputs; k++) outputs[s->wanted[k]] = slots[s->outputs[k]];
}

void tape_tangent(const Tape *tape, const double *slots, double *dots, double *output_dots) {
#define OPERATION(name, value, by_a, by_b)                                                         \
    case OPERATION_##name:                                                                         \
        for (; k < end; k++) {                                                                     \
            int left = tape->operands[k].left, right = tape->operands[k].right;                    \
            double a = slots[left], b = slots[right], f = slots[tape->first_result + k];           \
            (void)a, (void)b, (void)f;                                                             \
            dots[tape->first_result + k] = product(by_a, dots[left]) + product(by_b, dots[right]); \
        }                                                                                          \
        break;
    int k = 0;
    for (int r = 0; r < tape->n_runs; r++) {
        int end = k + tape->runs[r].count;
        switch (tape->runs[r].operation) {
#include "operations.h"
        }
    }
#undef OPERATION
    for (int n = 0; n < tape->n_outputs; n++) output_dots[n] = dots[tape->outputs[n]];
}

/* Adds to the bars of the arguments. */
void tape_adjoint(const Tape *tape, const double *slots, double *bars, const double *output_bars) {
    int k = tape->n_operations;
    memset(bars + tape->first_result, 0, (size_t)tape->n_operations * sizeof(double));
    for (int n = 0; n < tape->n_outputs; n++) bars[tape->outputs[n]] += output_bars[n];
    for (int r = tape->n_runs - 1; r >= 0; r--)
        for (int first = k - tape->runs[r].count; k > first;) {
            const Operands *one = &tape->operands[--k];
            double by_a, by_b, f = slots[tape->first_result + k], bar = bars[tape->first_result + k];
            if (bar == 0) continue;
            slopes(tape->runs[r].operation, slots[one->left], slots[one->right], f, &by_a, &by_b);
            bars[one->left] += product(by_a, bar);
            bars[one->right] += product(by_b, bar);
        }
}

/* Tapes for the present modes and parameters: what these decide is worked out once, and what nothing asks for is left
 * out. A model is one set of equations for all modes, of which few matter at a time, so little is left of a tape. The
 * operations that are left are the same, in the same order, so values are the same; only x + 0 and x * 1 are x. */
static Special *special_of(Instance *c, const Tape *tape) { return &c->special[tape - tapes_of(c->model)]; }

/* Is the output asked for? Of guards, those of the present modes. */
static int is_wanted(const Instance *c, const Tape *tape, int output) {
    if (tape == &c->model->tapes.variables) return c->asked[output];
    return tape != &c->model->tapes.guards || guard_active(c, output % c->model->n_guards);
}

/* The operand that the result of an operation is, -1 where it is known to be `*value`, or -2: it must be computed. */
static int result_of(int operation, Operands one, const double *slots, const unsigned char *known, double *value) {
    int a = known[one.left], b = known[one.right];
    double left = slots[one.left], right = slots[one.right];
    if (a && b) return -1;
    switch (operation) {
        case OPERATION_IF_ELSE_ZERO:
            if (a && left == 0) *value = 0;
            return !a ? -2 : left == 0 ? -1 : one.right;
        case OPERATION_AND: *value = 0; return (a && left == 0) || (b && right == 0) ? -1 : -2;
        case OPERATION_OR: *value = 1; return (a && left != 0) || (b && right != 0) ? -1 : -2;
        case OPERATION_ADD: return a && left == 0 ? one.right : b && right == 0 ? one.left : -2;
        case OPERATION_SUB: return b && right == 0 ? one.left : -2;
        case OPERATION_MUL: return a && left == 1 ? one.right : b && right == 1 ? one.left : -2;
        case OPERATION_DIV: return b && right == 1 ? one.left : -2;
        default: return -2;
    }
}

/* Finds for every slot which other one has its value (`same`), and whether it is known. The tape has just been run. */
static void work_out(Instance *c, const Tape *tape) {
    const Model *m = c->model;
    double *slots = c->slots;
    unsigned char *known = c->known_slots;
    const Operands *operand = tape->operands;
    int slot = tape->first_result;
    memset(known, 0, (size_t)m->n_slots);
    for (int k = 0; k < m->n_p; k++) known[m->slot_p + k] = !c->tuned[k];
    for (int k = 0; k < m->n_d; k++) /* a gradient goes back to discrete values, and to shares where there are any */
        known[m->slot_d + k] = !c->passing || (k < m->n_modes ? m->modes[k].n_names > 0 : c->d[k] == 0);
    memset(known + m->slot_constants, 1, (size_t)m->n_constants);
    for (int k = 0; k < slot; k++) c->same[k] = k;
    for (int r = 0; r < tape->n_runs; r++)
        for (int k = 0; k < tape->runs[r].count; k++, operand++, slot++) {
            Operands one = {c->same[operand->left], c->same[operand->right]};
            double value = slots[slot];
            int found = result_of(tape->runs[r].operation, one, slots, known, &value);
            c->same[slot] = found >= 0 ? found : slot;
            known[slot] = found == -1;
            if (found == -1) slots[slot] = value;
        }
}

static void mark_needed(Instance *c, const Tape *tape) {
    const int *same = c->same;
    unsigned char *needed = memset(c->needed_slots, 0, (size_t)c->model->n_slots);
    for (int k = 0; k < tape->n_outputs; k++)
        if (is_wanted(c, tape, k)) needed[same[tape->outputs[k]]] = 1;
    for (int k = tape->n_operations - 1; k >= 0; k--) {
        int slot = tape->first_result + k;
        if (!needed[slot] || c->known_slots[slot]) continue;
        needed[same[tape->operands[k].left]] = 1;
        needed[same[tape->operands[k].right]] = 1;
    }
}

/* Writes the operations that are left; known results that they need get slots behind all others. */
static void write_special(Instance *c, Special *s, const Tape *tape) {
    const unsigned char *needed = c->needed_slots;
    int *place = c->places_of_slots, written = 0, values = s->first_known, k = 0;
    for (int slot = 0; slot < tape->first_result; slot++) place[slot] = slot;
    s->tape.n_runs = 0;
    for (int r = 0; r < tape->n_runs; r++)
        for (int end = k + tape->runs[r].count; k < end; k++) {
            int slot = tape->first_result + k, same = c->same[slot], operation = tape->runs[r].operation;
            if (same != slot) place[slot] = place[same];
            if (same != slot || !needed[slot]) continue;
            if (c->known_slots[slot]) {
                c->slots[values] = c->slots[slot];
                place[slot] = values++;
                continue;
            }
            s->operands[written].left = place[c->same[tape->operands[k].left]];
            s->operands[written].right = place[c->same[tape->operands[k].right]];
            if (s->tape.n_runs == 0 || s->runs[s->tape.n_runs - 1].operation != operation) {
                s->runs[s->tape.n_runs].operation = operation;
                s->runs[s->tape.n_runs++].count = 0;
            }
            s->runs[s->tape.n_runs - 1].count++;
            place[slot] = tape->first_result + written++;
        }
    s->tape.n_operations = written;
    s->tape.n_outputs = 0;
    for (int n = 0; n < tape->n_outputs; n++) {
        if (!is_wanted(c, tape, n)) continue;
        s->wanted[s->tape.n_outputs] = n;
        s->outputs[s->tape.n_outputs++] = place[c->same[tape->outputs[n]]];
    }
}

/* Runs a tape with the slots as they are loaded. Of outputs that are not wanted, any value may come. Returns the tape
 * that has run, whose results stand in the slots. */
const Tape *run_on_tape(Instance *c, const Tape *tape, double *outputs) {
    Special *s = special_of(c, tape);
    if (s->belongs_to != c->decided_by) s->uses = 0;
    s->belongs_to = c->decided_by;
    int special = s->uses > WORTH_IT && !c->bounded; /* where the work is bounded: working out costs more than a step */
    if (special) return run_wanted(s, c->slots, outputs), &s->tape;
    tape_run(tape, c->slots, outputs);
    if (c->bounded || ++s->uses <= WORTH_IT) return tape;
    work_out(c, tape);
    mark_needed(c, tape);
    write_special(c, s, tape);
    return tape;
}

/* The same for outputs alone, by compiled code where there is some. */
void run_special(Instance *c, const Tape *tape, double *outputs) {
    if (!run_code(c, tape, active_guards(c), outputs)) run_on_tape(c, tape, outputs);
}

/* What is left of a tape for the present modes where of every `period` outputs only the marked ones are wanted: of many
 * guards few rise at a time, and these depend on few states. Made from what has run last at this point, and run by
 * `evaluate_part`, until it is made anew. */
void make_part(Instance *c, const Tape *tape, const unsigned char *wanted, int period) {
    const Special *s = special_of(c, tape);
    if (c->model->codes != NULL) return;
    const Tape *whole = s->belongs_to == c->decided_by && s->uses > WORTH_IT ? &s->tape : tape;
    Special *part = &c->special[N_SPECIALS];
    unsigned char *needed = memset(c->needed_slots, 0, (size_t)(c->model->n_slots));
    int *place = c->places_of_slots, first = whole->first_result, end = first + whole->n_operations, written = 0, k = 0;
    part->tape = (Tape){0, 0, 0, first, part->runs, part->operands, part->outputs};
#define OUTPUT(n) (whole == tape ? (n) : s->wanted[n])
    for (int n = 0; n < whole->n_outputs; n++)
        if (wanted[OUTPUT(n) % period] && whole->outputs[n] < end) needed[whole->outputs[n]] = 1;
    for (int n = whole->n_operations - 1; n >= 0; n--)
        for (int side = 0; side < 2 && needed[first + n]; side++) {
            int slot = side == 0 ? whole->operands[n].left : whole->operands[n].right;
            if (slot < end) needed[slot] = 1;
        }
#define PLACE(slot) ((slot) >= first && (slot) < end ? place[slot] : (slot))
    for (int r = 0; r < whole->n_runs; r++) {
        int before = written;
        for (int last = k + whole->runs[r].count; k < last; k++) {
            if (!needed[first + k]) continue;
            part->operands[written] = (Operands){PLACE(whole->operands[k].left), PLACE(whole->operands[k].right)};
            place[first + k] = first + written++;
        }
        if (written > before) part->runs[part->tape.n_runs++] = (Run){whole->runs[r].operation, written - before};
    }
    for (int n = 0; n < whole->n_outputs; n++) {
        if (!wanted[OUTPUT(n) % period]) continue;
        part->wanted[part->tape.n_outputs] = OUTPUT(n);
        part->outputs[part->tape.n_outputs++] = PLACE(whole->outputs[n]);
    }
#undef PLACE
#undef OUTPUT
    part->tape.n_operations = written;
}

/* Of outputs that are not wanted, values may stay as they are. */
void evaluate_part(Instance *c, double t, const double *point, double *outputs) {
    load(c, t, point);
    if (run_code(c, &c->model->tapes.guards, active_guards(c), outputs)) return;
    run_wanted(&c->special[N_SPECIALS], c->slots, outputs);
}

void evaluate_special(Instance *c, const Tape *tape, double t, const double *point, double *outputs) {
    load(c, t, point);
    run_special(c, tape, outputs);
}

const Tape *evaluate_on_tape(Instance *c, const Tape *tape, double t, const double *point, double *outputs) {
    load(c, t, point);
    return run_on_tape(c, tape, outputs);
}

void ask_for(Instance *c, int node) {
    if (c->asked[node]) return;
    c->asked[node] = 1;
    special_of(c, &c->model->tapes.variables)->uses = 0;
    c->variables_valid = 0;
}

/* A point of the solution: evaluate tapes there, solve the implicit equations, check that all blocks are regular. */
double input_at(const Instance *c, int k, double t) { return c->u[k] + c->u_rate[k] * (t - c->state.u_time); }

/* With parameters and modes as they were loaded last. */
void load_point(Instance *c, double t, const double *point) {
    const Model *m = c->model;
    c->slots[0] = t;
    memcpy(c->slots + m->slot_x, point, m->n_unknowns * sizeof(double));
    for (int k = 0; k < m->n_u; k++) c->slots[m->slot_u + k] = input_at(c, k, t);
}

void load(Instance *c, double t, const double *point) {
    const Model *m = c->model;
    double *slots = c->slots;
    load_point(c, t, point);
    if (memcmp(slots + m->slot_p, c->p, (size_t)m->n_p * sizeof(double)) != 0) {
        c->altered++;
        for (int k = 0; k < m->n_p; k++) {
            if (slots[m->slot_p + k] != c->p[k] && !c->tuned[k]) c->decided_by++;
            slots[m->slot_p + k] = c->p[k];
        }
    }
    if (memcmp(slots + m->slot_d, c->d, (size_t)m->n_d * sizeof(double)) != 0) {
        memcpy(slots + m->slot_d, c->d, (size_t)m->n_d * sizeof(double));
        c->decided_by++;
        c->altered++;
    }
}

void evaluate(Instance *c, const Tape *tape, double t, const double *point, double *outputs) {
    load(c, t, point);
    tape_run(tape, c->slots, outputs);
}

void evaluate_now(Instance *c, const Tape *tape, double *outputs) { evaluate(c, tape, c->state.t, c->x, outputs); }

const double *variables_now(Instance *c) {
    evaluate_now(c, &c->model->tapes.variables, c->variables);
    return c->variables;
}

int any_of(const unsigned char *marks, int n) {
    int any = 0;
    for (int k = 0; k < n; k++) any |= marks[k];
    return any;
}

double largest_of(int n, const double *values) {
    double largest = 0;
    for (int k = 0; k < n; k++) largest = fmax(largest, fabs(values[k]));
    return largest;
}

/* Factorises the Jacobian of the implicit equations, which often is that of the point before. */
static int factor_again(Instance *c) {
    int n = c->model->n_z;
    size_t size = (size_t)n * (size_t)n * sizeof(double);
    if (c->implicit_kept && memcmp(c->implicit_matrix, c->dense_matrix, size) == 0) return 1;
    memcpy(c->implicit_matrix, c->dense_matrix, size);
    memcpy(c->implicit_lu, c->dense_matrix, size);
    return c->implicit_kept = lu_factor(n, c->implicit_lu, c->implicit_order);
}

Result solve_implicit(Instance *c, double t, double *point, int quiet) {
    const Model *m = c->model;
    double *z = point + m->n_x, *step = c->vector, change = INFINITY, residual = 0;
    int rounds = !c->bounded ? MAX_NEWTON : m->settings->implicit_linear ? 1 : BOUNDED_NEWTON;
    if (m->n_z == 0) return RESULT_OK;
    for (int round = 0; round < rounds; round++) {
        evaluate_special(c, &m->tapes.alg, t, point, step);
        if (c->bounded && round > 0 && largest_of(m->n_z, step) <= SOLVED * residual) return RESULT_OK;
        residual = largest_of(m->n_z, step);
        run_special(c, &m->tapes.alg_jacobian, c->dense_matrix);
        for (int k = 0; k < m->n_z; k++)
            if (!isfinite(step[k])) return !quiet && fail(c, UNKNOWN_SINGULAR, t, k);
        if (!factor_again(c)) return !quiet && fail(c, UNKNOWN_SINGULAR, t, 0);
        lu_solve(m->n_z, c->implicit_lu, c->implicit_order, step);
        change = 0;
        for (int k = 0; k < m->n_z; k++) {
            z[k] -= step[k];
            change = fmax(change, fabs(step[k]) / (1 + fabs(z[k])));
        }
        /* What the largest unknown leaves of a small one when it is rounded does not get smaller. */
        if (change < (c->bounded ? 1e-4 : 1e-13) || largest_of(m->n_z, step) <= 1e-14 * largest_of(m->n_z, z))
            return RESULT_OK;
    }
    if (change <= 1e-9 || c->bounded) return RESULT_OK;
    return !quiet && fail(c, NOT_SOLVED, 0, t);
}

Result solve_now(Instance *c, int quiet) { return solve_implicit(c, c->state.t, c->x, quiet); }

Result check_singular(Instance *c) {
    const Model *m = c->model;
    double t = c->state.t, *values = c->rhs;
    evaluate_now(c, &m->tapes.determinants, values);
    for (int k = 0; k < m->n_determinants; k++)
        if (!isfinite(values[k]) || fabs(values[k]) < 1e-12) return fail(c, BLOCK_SINGULAR, t, k);
    if (c->bounded) return RESULT_OK; /* the next step tells */
    values_now(c, &m->tapes.rates, values);
    for (int k = 0; k < m->n_x; k++)
        if (!isfinite(values[k])) return fail(c, RATE_NOT_FINITE, k, t);
    return RESULT_OK;
}

/* Bring the implicit unknowns up to date with time, states, parameters and inputs. */
Result settle(Instance *c) { return c->state.z_valid || (c->state.z_valid = solve_now(c, 0)); }
