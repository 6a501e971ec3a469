/* Tapes for the present modes and parameters: what these decide is worked out once, and what nothing asks for is left
 * out. A model is one set of equations for all modes, of which few matter at a time, so little is left of a tape. The
 * operations that are left are the same, in the same order, so values are the same; only x + 0 and x * 1 are x. */
#include "core.h"

#define WORTH_IT 6 /* runs of a tape in the same modes from which on it is worth it */

/* Of outputs that are not wanted, values stay as they are. */
static void run_wanted(const Special *s, double *slots, double *outputs) {
    run_operations(&s->tape, slots);
    for (int k = 0; k < s->tape.n_outputs; k++) outputs[s->wanted[k]] = slots[s->outputs[k]];
}

void forget_sets(Instance *c) {
    c->known_used = 0;
    c->n_sets = c->room_used = c->chosen_by = 0;
}

/* What of the d that was loaded last decides about tapes; of a gradient, what does not move, see work_out. */
static void take_key(const Instance *c, double *key) {
    const Model *m = c->model;
    const double *d = memcpy(key, c->slots + m->slot_d, (size_t)m->n_d * sizeof(double));
    for (int k = m->n_modes; k < m->n_d && c->passing; k++) key[k] = d[k] != 0;
    key[m->n_d] = c->passing;
}

/* Chooses the set of tapes for the modes that were loaded last, a new one where there is none. There is room for whole
 * tapes of the chosen set, and nobody uses those that are forgotten for it. */
static void choose_set(Instance *c) {
    size_t n = (size_t)c->model->n_d + 1;
    double *key = c->set_keys, *present = key + N_SETS * n;
    uint64_t set = 0;
    if (c->room_used > c->most_room || c->known_used > c->most_known) forget_sets(c);
    take_key(c, present);
    while (set < c->n_sets && set < N_SETS && memcmp(key, present, n * sizeof(double)) != 0) set++, key += n;
    if (set == c->n_sets || set == N_SETS) {
        set = c->n_sets++ % N_SETS;
        memcpy(c->set_keys + set * n, present, n * sizeof(double));
        for (int k = 0; k < N_SPECIALS; k++) c->special[set * N_SPECIALS + k].uses = 0;
    }
    c->set = (int)set;
    c->chosen_by = c->decided_by + 1;
}

static Special *special_of(Instance *c, const Tape *tape) {
    if (c->chosen_by != c->decided_by + 1) choose_set(c);
    return &c->special[c->set * N_SPECIALS + (tape - tapes_of(c->model))];
}

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
    memset(known, 0, (size_t)m->slot_constants); /* of constants, which may be many, `instance_new` */
    for (int k = 0; k < m->n_p; k++) known[m->slot_p + k] = !c->tuned[k];
    for (int k = 0; k < m->n_d; k++) /* a gradient goes back to discrete values, and to shares where there are any */
        known[m->slot_d + k] = !c->passing || (k < m->n_modes ? m->modes[k].n_names > 0 : c->d[k] == 0);
    for (int k = 0; k < m->slot_constants; k++) c->same[k] = k;
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

/* Marks slots that wanted outputs need. */
static void mark_needed(Instance *c, const Tape *tape) {
    const int *same = c->same;
    unsigned char *needed = c->needed_slots;
    memset(needed + tape->first_result, 0, (size_t)tape->n_operations);
    for (int k = 0; k < tape->n_outputs; k++)
        if (is_wanted(c, tape, k)) needed[same[tape->outputs[k]]] = 1;
    for (int k = tape->n_operations - 1; k >= 0; k--) {
        int slot = tape->first_result + k;
        if (!needed[slot] || c->known_slots[slot]) continue;
        needed[same[tape->operands[k].left]] = 1;
        needed[same[tape->operands[k].right]] = 1;
    }
}

/* Marks in `needed_slots` which results of a tape that has just been run matter in the present modes. */
void mark_mattering(Instance *c, const Tape *tape) {
    work_out(c, tape);
    mark_needed(c, tape);
    for (int slot = tape->first_result; slot < tape->first_result + tape->n_operations; slot++)
        c->needed_slots[slot] = c->needed_slots[slot] && !c->known_slots[slot];
}

/* Writes the operations that are left; known results that they need get slots behind all others. */
static void write_special(Instance *c, Special *s, const Tape *tape) {
    const unsigned char *needed = c->needed_slots;
    int *place = c->places_of_slots, written = 0, first = c->model->n_slots, values = first + c->known_used, k = 0;
    for (int slot = 0; slot < c->model->slot_constants; slot++) place[slot] = slot;
    s->tape.n_runs = s->tape.n_outputs = 0;
    s->tape.first_result = tape->first_result;
    s->operands = (Operands *)(void *)(c->room + c->room_used);
    s->runs = (Run *)(void *)(s->operands + tape->n_operations);
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
    s->first_known = first + c->known_used;
    s->n_known = values - s->first_known;
    c->known_used = values - first;
    s->tape.n_operations = written;
    s->tape.operands = s->operands;
    s->tape.runs = s->runs = memmove(s->operands + written, s->runs, (size_t)s->tape.n_runs * sizeof(Run));
    s->tape.outputs = s->outputs = (int *)(void *)(s->runs + s->tape.n_runs);
    for (int n = 0; n < tape->n_outputs; n++) s->tape.n_outputs += is_wanted(c, tape, n);
    s->wanted = s->outputs + s->tape.n_outputs;
    c->room_used = (size_t)(s->wanted + s->tape.n_outputs - c->room);
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
    /* Where the work is bounded, working out costs more than a step; modes that a gradient tries come once. */
    Special *s = c->bounded || (c->passing && c->trying) ? NULL : special_of(c, tape);
    if (s != NULL && s->uses > WORTH_IT) return run_wanted(s, c->slots, outputs), &s->tape;
    tape_run(tape, c->slots, outputs);
    if (s == NULL || ++s->uses <= WORTH_IT) return tape;
    work_out(c, tape);
    mark_needed(c, tape);
    write_special(c, s, tape);
    return tape;
}

/* Which output of the tape that has run is a wanted output of a tape. */
int output_place(const Tape *tape, const Tape *ran, int output) {
    int k = 0;
    while (ran != tape && ((const Special *)(const void *)ran)->wanted[k] != output) k++;
    return ran == tape ? output : k;
}

/* tape_adjoint in `dots`, by a tape that has run. What it knows does not move. */
void adjoint_of_ran(Instance *c, const Tape *tape, const Tape *ran, const double *bars) {
    const Special *s = (const Special *)(const void *)ran;
    tape_adjoint(ran, c->slots, c->dots, bars);
    if (ran != tape) memset(c->dots + s->first_known, 0, (size_t)s->n_known * sizeof(double));
}

/* The same for outputs alone, by compiled code where there is some. */
void run_special(Instance *c, const Tape *tape, double *outputs) {
    if (!run_code(c, tape, active_guards(c), outputs)) run_on_tape(c, tape, outputs);
}

/* What is left of a tape for the present modes where of every `period` outputs only the marked ones are wanted: of many
 * guards few rise at a time, and these depend on few states. Made from what has run last at this point, and run by
 * `evaluate_part`, until it is made anew. */
void make_part(Instance *c, const Tape *tape, const unsigned char *wanted, int period) {
    if (c->model->codes != NULL) return;
    const Special *s = special_of(c, tape);
    const Tape *whole = s->uses > WORTH_IT ? &s->tape : tape;
    Special *part = &c->part;
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
    run_wanted(&c->part, c->slots, outputs);
}

void ask_for(Instance *c, int node) {
    if (c->asked[node]) return;
    c->asked[node] = 1;
    forget_sets(c);
    c->variables_valid = 0;
}
