/* Checks the tables of a model: every index is one of the table that it points into. */
#include "model.h"

/* Tells that a file is no model; returns 0. */
int damaged(char *message, const char *what) {
    return REFUSE("The model file is damaged (%s). Export the model again.", what) != NULL;
}

/* ---- ranges ----------------------------------------------------------------------------------------------------- */

typedef struct { /* integers of records, not below `low` and below `end` */
    const char *name;
    const void *first;
    size_t stride;
    int count, low, end;
} Range;
#define COLUMN(table, field, n, low, end) {#table "." #field, &m->table[0].field, sizeof m->table[0], n, low, end}
#define INDEX(table, field, end) COLUMN(table, field, m->n_##table, 0, end)
#define ARRAY(table, n, end) {#table, m->table, sizeof(int), n, 0, end}

/* Every index is one of the table that it points into. */
static int check_indices(const Model *m, char *message) {
    const Range ranges[] = {ARRAY(state_names, m->n_x, m->n_text), ARRAY(implicit_names, m->n_z, m->n_text),
        ARRAY(singular_names, m->n_determinants, m->n_text), INDEX(variables, kind, N_KINDS),
        INDEX(variables, type, N_TYPES), INDEX(variables, name, m->n_text),
        COLUMN(variables, count, m->n_variables, 1, m->n_p + 2), INDEX(rising, below, m->n_p),
        INDEX(rising, above, m->n_p), INDEX(rising, below_name, m->n_text), INDEX(rising, above_name, m->n_text),
        ARRAY(mode_names, m->n_mode_names, m->n_text), INDEX(modes, first_name, m->n_mode_names + 1),
        INDEX(modes, n_names, m->n_mode_names + 1), INDEX(transitions, mode, m->n_modes),
        INDEX(transitions, name, m->n_text), INDEX(transitions, notice, m->n_text),
        ARRAY(guard_transition, m->n_guards, m->n_transitions), ARRAY(reset_nodes, m->n_reset_nodes, m->n_nodes),
        INDEX(resets, kind, N_RESET_KINDS), INDEX(updates, kind, N_RESET_KINDS),
        INDEX(resets, value, m->n_reset_values), INDEX(holds, mode, m->n_modes), INDEX(holds, motion, m->n_nodes),
        COLUMN(holds, state, m->n_holds, -1, m->n_x), COLUMN(holds, reaction, m->n_holds, -1, m->n_nodes),
        INDEX(holds, approach, m->n_d), INDEX(holds, name, m->n_text), ARRAY(members, m->n_members, m->n_holds),
        INDEX(ideals, row, m->n_z), INDEX(ideals, mode, m->n_modes), INDEX(ideals, zero, m->n_nodes),
        INDEX(ideals, other, m->n_nodes), INDEX(ideals, name, m->n_text),
        INDEX(circuits, first_member, m->n_members + 1), INDEX(circuits, n_members, m->n_members + 1),
        INDEX(circuits, first, m->n_d + 1), INDEX(start_modes, mode, m->n_modes), INDEX(start_direct, position, m->n_x),
        INDEX(start_direct, start, m->n_starts), INDEX(start_default, position, m->n_x),
        INDEX(start_default, start, m->n_starts), INDEX(start_guess, position, m->n_unknowns),
        INDEX(start_guess, start, m->n_starts), COLUMN(start_rows, start, m->n_start_unknowns, -1, m->n_starts),
        COLUMN(start_rows, row, m->n_start_unknowns, 0, m->n_start_values), INDEX(start_dependent, start, m->n_starts),
        INDEX(start_dependent, node, m->n_nodes), ARRAY(start_zero, m->n_start_zero, m->n_x),
        ARRAY(start_columns, m->n_start_unknowns, m->n_unknowns + m->n_y), ARRAY(steady, m->n_steady, m->n_unknowns),
        ARRAY(jacobian_to_step, m->n_jacobian, m->step.n_nonzeros), ARRAY(step_diagonal, m->n_x, m->step.n_nonzeros)};
    for (size_t k = 0; k < sizeof ranges / sizeof ranges[0]; k++)
        for (int i = 0; i < ranges[k].count; i++) {
            int value;
            memcpy(&value, (const char *)ranges[k].first + (size_t)i * ranges[k].stride, sizeof value);
            if (value < ranges[k].low || value >= ranges[k].end) return damaged(message, ranges[k].name);
        }
    return 1;
}

/* What gets a new value at events exists. */
static int check_target(const Model *m, int kind, int index, int target) {
    int place = kind == RESET_VALUE ? target : index;
    return place >= 0 && place < (kind == RESET_VALUE ? m->n_reset_nodes : kind == RESET_STATE ? m->n_x : m->n_d);
}

static int check_events(const Model *m, char *message) {
    if (m->settings->terminal < -1 || m->settings->terminal >= m->n_modes) return damaged(message, "settings.terminal");
    for (int k = 0; k < m->n_modes; k++)
        if (m->modes[k].n_names > m->n_mode_names - m->modes[k].first_name) return damaged(message, "modes.n_names");
    for (int k = 0; k < m->n_transitions; k++)
        if (m->transitions[k].index < 0 ||
            m->transitions[k].index >= (m->transitions[k].timed ? m->n_moments : m->n_guards))
            return damaged(message, "transitions.index");
    for (int k = 0; k < m->n_resets; k++)
        if (!check_target(m, m->resets[k].kind, m->resets[k].index, m->resets[k].target))
            return damaged(message, "resets.index");
    for (int k = 0; k < m->n_updates; k++)
        if (!check_target(m, m->updates[k].kind, m->updates[k].index, m->updates[k].target))
            return damaged(message, "updates.index");
    for (int k = 0; k < m->n_circuits; k++) {
        const Circuit *one = &m->circuits[k];
        int64_t n = one->n_members;
        if (n > m->n_members - one->first_member || n * (n + 1) > m->n_d - one->first)
            return damaged(message, "circuits.n_members");
        for (int i = 0; i < one->n_members; i++)
            if (m->holds[m->members[one->first_member + i]].reaction < 0) return damaged(message, "holds.reaction");
    }
    if (m->settings->ideal < 0 || (int64_t)m->n_ideals * (3 + (int64_t)m->n_z) > (int64_t)m->n_d - m->settings->ideal)
        return damaged(message, "settings.ideal");
    return 1;
}

static int check_variables(const Model *m, char *message) {
    const int ends[N_KINDS] = {
        1, m->n_x, m->n_x, m->n_nodes, m->n_p, m->n_derived, m->n_u, m->n_modes, m->n_guards}; /* as Kind */
    /* Texts end at the latest where their section ends. */
    if (m->n_text == 0 || m->text[m->n_text - 1] != 0) return damaged(message, "text");
    if (m->n_token == 0 || m->token[m->n_token - 1] != 0) return damaged(message, "token");
    for (int k = 0; k < m->n_variables; k++) {
        const Variable *v = &m->variables[k];
        if (v->index < 0 || v->index >= ends[v->kind]) return damaged(message, "variables.index");
        if (v->type == TYPE_ENUMERATION && v->kind != KIND_DISCRETE) return damaged(message, "variables.type");
        if (k > 0 && v->reference <= v[-1].reference) return damaged(message, "variables.reference");
    }
    return 1;
}

/* ---- tapes and patterns ----------------------------------------------------------------------------------------- */

/* Operations read what stands before them. */
static int check_tape(const Tape *tape) {
    int64_t total = 0;
    for (int k = 0; k < tape->n_runs; k++) {
        const Run *run = &tape->runs[k];
        if (run->operation < 0 || run->operation >= N_OPERATION_CODES || run->count < 0) return 0;
        total += run->count;
    }
    if (total != tape->n_operations) return 0;
    for (int k = 0; k < tape->n_operations; k++) {
        int left = tape->operands[k].left, right = tape->operands[k].right, end = tape->first_result + k;
        if (left < 0 || right < 0 || left >= end || right >= end) return 0;
    }
    for (int k = 0; k < tape->n_outputs; k++)
        if (tape->outputs[k] < 0 || tape->outputs[k] >= tape->first_result + tape->n_operations) return 0;
    return 1;
}

/* Columns of a sparse matrix; `least` entries in each. */
static int check_columns(int size, const int *colind, const int *row, int count, int least) {
    if (colind[0] != 0 || colind[size] != count) return 0;
    for (int k = 0; k < size; k++)
        if (colind[k + 1] > count || colind[k + 1] < colind[k] + least) return 0;
    for (int k = 0; k < count; k++)
        if (row[k] < 0 || row[k] >= size) return 0;
    return 1;
}

static int check_pattern(const QrPattern *a) {
    int n = a->size;
    if (a->n_ends != n + 1 || !check_columns(n, a->colind, a->row, a->n_nonzeros, 0) ||
        !check_columns(n, a->v_colind, a->v_row, a->n_v, 1) || !check_columns(n, a->r_colind, a->r_row, a->n_r, 1))
        return 0;
    for (int k = 0; k < n; k++) {
        if (a->row_place[k] < 0 || a->row_place[k] >= n || a->column_order[k] < 0 || a->column_order[k] >= n) return 0;
        /* The diagonal of R stands last in its column, and ends the search for it. */
        for (int r = a->r_colind[k]; r < a->r_colind[k + 1]; r++)
            if ((r < a->r_colind[k + 1] - 1) != (a->r_row[r] < k)) return 0;
        if (a->r_row[a->r_colind[k + 1] - 1] != k) return 0;
    }
    return 1;
}

int check_model(const Model *m, char *message) {
    for (int k = 0; k < N_TAPES; k++)
        if (!check_tape(tapes_of(m) + k)) return damaged(message, "tapes");
    return check_indices(m, message) && check_variables(m, message) && check_events(m, message) &&
           (check_pattern(&m->step) || damaged(message, "step")) &&
           (check_pattern(&m->start) || damaged(message, "start"));
}
