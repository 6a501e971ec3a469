/* Reads a model from the bytes of its file (model_file.py), and checks everything that the run-time relies on: whatever
 * stands in a file, nothing is read or written outside of the tables. */
#include "model.h"

#define FORMAT 11
#define UNKNOWN (-1)
#define LONGEST 0x10000000 /* slots, so that their sums stay integers */

typedef struct {
    char magic[8];
    int version, n_sections;
    uint32_t check, size; /* CRC-32 of all that follows; bytes of the file */
} FileHeader;
typedef struct {
    int id, record, offset, count;
} Section;

/* Sections in the order of SECTIONS in model_file.py. Tables that share a count have as many records. */
#define TABLE(table, count) {#table, sizeof *((Model *)0)->table, offsetof(Model, table), offsetof(Model, count)}
#define QR(matrix)                                                                                                    \
    TABLE(matrix.colind, matrix.n_ends), TABLE(matrix.row, matrix.n_nonzeros), TABLE(matrix.v_colind, matrix.n_ends), \
        TABLE(matrix.v_row, matrix.n_v), TABLE(matrix.r_colind, matrix.n_ends), TABLE(matrix.r_row, matrix.n_r),      \
        TABLE(matrix.row_place, matrix.size), TABLE(matrix.column_order, matrix.size)
#define TAPE(tape)                                                                                  \
    TABLE(tapes.tape.runs, tapes.tape.n_runs), TABLE(tapes.tape.operands, tapes.tape.n_operations), \
        TABLE(tapes.tape.outputs, tapes.tape.n_outputs)

static const struct {
    const char *name;
    unsigned record, table, count;
} tables[] = {TABLE(settings, n_settings), TABLE(text, n_text), TABLE(token, n_token), TABLE(constants, n_constants),
    TABLE(parameters, n_p), TABLE(parameter_min, n_p), TABLE(parameter_max, n_p), TABLE(inputs, n_u),
    TABLE(guesses, n_guesses), TABLE(nominals, n_x), TABLE(state_names, n_x), TABLE(implicit_names, n_z),
    TABLE(singular_names, n_determinants), TABLE(variables, n_variables), TABLE(rising, n_rising),
    TABLE(transitions, n_transitions), TABLE(guard_transition, n_guards), TABLE(resets, n_resets),
    TABLE(reset_nodes, n_reset_nodes), TABLE(updates, n_updates), TABLE(modes, n_modes),
    TABLE(mode_names, n_mode_names), TABLE(holds, n_holds), TABLE(circuits, n_circuits), TABLE(members, n_members),
    TABLE(ideals, n_ideals), TABLE(units, n_units), TABLE(delays, n_delays), TABLE(start_modes, n_start_modes),
    TABLE(start_direct, n_start_direct), TABLE(start_default, n_start_default), TABLE(start_guess, n_start_guess),
    TABLE(start_rows, n_start_unknowns), TABLE(start_dependent, n_start_dependent), TABLE(start_zero, n_start_zero),
    TABLE(start_columns, n_start_unknowns), TABLE(steady, n_steady), TABLE(jacobian_to_step, n_jacobian),
    TABLE(step_diagonal, n_x), QR(step), QR(start), TABLE(lu.ends, lu.n_ends), TABLE(lu.rows, lu.n_rows),
    TABLE(lu.row_place, step.size), TABLE(lu.column_order, step.size), TAPE(rates), TAPE(jacobian), TAPE(alg),
    TAPE(alg_jacobian), TAPE(variables), TAPE(guards), TAPE(edges), TAPE(guards_soon), TAPE(moments), TAPE(resets),
    TAPE(updates), TAPE(start_conditions), TAPE(start_values), TAPE(discrete_starts), TAPE(hold_terms),
    TAPE(determinants), TAPE(start_system), TAPE(start_jacobian), TAPE(derived), TAPE(delays)};
enum { N_TABLES = sizeof tables / sizeof tables[0] };

/* Tells that a file is no model; returns 0. */
static int damaged(char *message, const char *what) {
    return REFUSE("The model file is damaged (%s). Export the model again.", what) != NULL;
}

/* As zlib has it, by four bits at a time. */
uint32_t crc32_of(const unsigned char *bytes, size_t size) {
    static const uint32_t table[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
        0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278,
        0xbdbdf21c};
    uint32_t value = 0xffffffff;
    for (size_t k = 0; k < size; k++) {
        value ^= bytes[k];
        value = (value >> 4) ^ table[value & 15];
        value = (value >> 4) ^ table[value & 15];
    }
    return ~value;
}

static int check_header(const unsigned char *bytes, size_t size, char *message) {
    FileHeader h;
    size_t first = sizeof h + N_TABLES * sizeof(Section);
    if (size < sizeof h) return damaged(message, "it is truncated");
    memcpy(&h, bytes, sizeof h);
    if (memcmp(h.magic, "MLMODEL", 8) != 0) return damaged(message, "it is another kind of file");
    if (h.version != FORMAT || h.n_sections != N_TABLES)
        return REFUSE("The model file has format %d with %d tables, but this library reads format %d with %d. Export "
                      "the model again.",
                   h.version, h.n_sections, FORMAT, (int)N_TABLES) != NULL;
    if (h.size != size || size < first) return damaged(message, "it is truncated");
    if (h.check != crc32_of(bytes + sizeof h, size - sizeof h)) return damaged(message, "its checksum is wrong");
    return (uintptr_t)bytes % sizeof(double) == 0 || damaged(message, "it is not aligned");
}

static int find_tables(Model *m, const unsigned char *bytes, size_t size, char *message) {
    size_t first = sizeof(FileHeader) + N_TABLES * sizeof(Section);
    for (int k = 0; k < N_TABLES; k++) *(int *)(void *)((char *)m + tables[k].count) = UNKNOWN;
    for (int k = 0; k < N_TABLES; k++) {
        Section s;
        int *count = (int *)(void *)((char *)m + tables[k].count);
        memcpy(&s, bytes + sizeof(FileHeader) + (size_t)k * sizeof s, sizeof s);
        if (s.id != k || s.record != (int)tables[k].record || s.count < 0 || s.offset < 0 || s.offset % 8 != 0 ||
            (uint64_t)s.offset < first || (uint64_t)s.offset + (uint64_t)s.count * tables[k].record > size ||
            (*count != UNKNOWN && *count != s.count))
            return damaged(message, tables[k].name);
        const void *table = bytes + s.offset;
        memcpy((char *)m + tables[k].table, &table, sizeof table);
        *count = s.count;
    }
    return 1;
}

static int lay_out_slots(Model *m, size_t size) {
    Tape *tapes = (Tape *)(void *)&m->tapes;
    int *const places[] = {
        &m->slot_x, &m->slot_z, &m->slot_p, &m->slot_u, &m->slot_d, &m->slot_y, &m->slot_constants, &m->slot_results};
    const int sizes[] = {1, m->n_x, m->n_z, m->n_p, m->n_u, m->n_d, m->n_y, m->n_constants};
    int operations = 0;
    int64_t used = 0;
    for (int k = 0; k < N_TAPES; k++)
        if (tapes[k].n_operations > operations) operations = tapes[k].n_operations;
    if ((size_t)m->n_y > size) return 0;
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        used += sizes[k];
        if (sizes[k] < 0 || used + operations > LONGEST) return 0;
        *places[k] = (int)used;
    }
    m->n_slots = (int)used + operations;
    for (int k = 0; k < N_TAPES; k++) tapes[k].first_result = m->slot_results;
    return 1;
}

static int find_sizes(Model *m, size_t size, char *message) {
    if (m->n_settings != 1) return damaged(message, "settings");
    m->n_d = m->settings->n_d;
    m->n_y = m->settings->n_y;
    m->n_unknowns = m->n_x + m->n_z;
    m->n_nodes = m->tapes.variables.n_outputs;
    m->n_derived = m->tapes.derived.n_outputs;
    m->n_moments = m->tapes.moments.n_outputs;
    m->n_starts = m->tapes.start_values.n_outputs;
    m->n_start_values = m->tapes.start_system.n_outputs;
    m->n_reset_values = m->tapes.resets.n_outputs;
    for (int k = 0; k < m->n_circuits; k++)
        if (m->circuits[k].n_members > m->most_members) m->most_members = m->circuits[k].n_members;
    return lay_out_slots(m, size) || damaged(message, "its sizes");
}

/* Operations read what stands before them. */
static int check_tape(const Tape *tape) {
    int64_t total = 0;
    for (const Run *run = tape->runs; run < tape->runs + tape->n_runs; run++) {
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

/* Results of tapes are as many as the tables that they belong to have records. */
#define RESULTS(tape, wanted) {#tape, m->tapes.tape.n_outputs, wanted}
static int check_sizes(const Model *m, char *message) {
    const int64_t n_z = m->n_z;
    const struct {
        const char *name;
        int64_t found, wanted;
    } sizes[] = {RESULTS(rates, m->n_unknowns), RESULTS(jacobian, m->n_jacobian), RESULTS(alg, n_z),
        RESULTS(alg_jacobian, n_z * n_z), RESULTS(guards, 2 * (int64_t)m->n_guards), RESULTS(guards_soon, m->n_guards),
        RESULTS(updates, m->n_updates), RESULTS(start_conditions, m->n_start_modes), RESULTS(discrete_starts, m->n_d),
        RESULTS(hold_terms, 4 * (int64_t)m->n_holds), RESULTS(determinants, m->n_determinants),
        RESULTS(delays, 2 * (int64_t)m->n_delays), RESULTS(start_jacobian, m->start.n_nonzeros),
        {"step", m->step.size, m->n_unknowns}, {"start", m->start.size, m->n_start_unknowns},
        {"guesses", m->n_guesses, m->n_unknowns}, {"units", m->n_units, m->n_holds + m->n_ideals > 0 ? m->n_nodes : 0}};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
        if (sizes[k].found != sizes[k].wanted) return damaged(message, sizes[k].name);
    for (int k = 0; k < N_TAPES; k++)
        if (!check_tape(tapes_of(m) + k)) return damaged(message, "tapes");
    if (m->n_steady > m->n_unknowns) return damaged(message, "steady");
    return m->n_modes <= m->n_d || damaged(message, "modes");
}

typedef struct { /* integers of records, not below `low` and below `end` */
    const char *name;
    const void *first;
    size_t stride;
    int64_t count, low, end;
} Range;
#define COLUMN(table, field, n, low, end) {#table "." #field, &m->table[0].field, sizeof m->table[0], m->n, low, end}
#define INDEX(table, field, end) COLUMN(table, field, n_##table, 0, m->end)
#define TEXT(table, field) INDEX(table, field, n_text)
#define ARRAY(table, n, end) {#table, m->table, sizeof(int), m->n, 0, m->end}

/* Every index is one of the table that it points into. */
static int check_indices(const Model *m, char *message) {
    const Range ranges[] = {COLUMN(settings, terminal, n_settings, -1, m->n_modes),
        COLUMN(settings, homotopy, n_settings, -1, m->n_modes),
        COLUMN(settings, n_edges, n_settings, 0, m->tapes.edges.n_outputs + 1),
        COLUMN(settings, n_slope_edges, n_settings, 0, (int64_t)m->settings->n_edges + 1),
        COLUMN(settings, n_kinks, n_settings, 0, (int64_t)m->settings->n_slope_edges + 1),
        ARRAY(state_names, n_x, n_text), ARRAY(implicit_names, n_z, n_text),
        ARRAY(singular_names, n_determinants, n_text), COLUMN(variables, kind, n_variables, 0, N_KINDS),
        COLUMN(variables, type, n_variables, 0, N_TYPES), TEXT(variables, name),
        COLUMN(variables, count, n_variables, 1, m->n_p + 2), INDEX(rising, below, n_p), INDEX(rising, above, n_p),
        TEXT(rising, below_name), TEXT(rising, above_name), ARRAY(mode_names, n_mode_names, n_text),
        INDEX(modes, first_name, n_mode_names + 1), INDEX(modes, n_names, n_mode_names + 1),
        INDEX(transitions, mode, n_modes), TEXT(transitions, name), TEXT(transitions, notice),
        ARRAY(guard_transition, n_guards, n_transitions), ARRAY(reset_nodes, n_reset_nodes, n_nodes),
        INDEX(resets, place, n_x + m->n_d + m->n_reset_nodes), INDEX(updates, place, n_x + m->n_d + m->n_reset_nodes),
        COLUMN(updates, at_start, n_updates, -1, m->n_d), INDEX(resets, value, n_reset_values),
        INDEX(resets, transition, n_transitions), INDEX(updates, value, n_updates), INDEX(holds, mode, n_modes),
        INDEX(holds, motion, n_nodes), COLUMN(holds, state, n_holds, -1, m->n_x),
        COLUMN(holds, reaction, n_holds, -1, m->n_nodes), INDEX(holds, approach, n_d), TEXT(holds, name),
        ARRAY(members, n_members, n_holds), INDEX(ideals, row, n_z), INDEX(ideals, mode, n_modes),
        INDEX(ideals, zero, n_nodes), INDEX(ideals, other, n_nodes), TEXT(ideals, name), TEXT(delays, name),
        INDEX(delays, first, n_d - DELAY_TERMS - 1), INDEX(circuits, first_member, n_members + 1),
        INDEX(circuits, n_members, n_members + 1), INDEX(circuits, first, n_d + 1), INDEX(start_modes, mode, n_modes),
        INDEX(start_direct, position, n_x), INDEX(start_direct, start, n_starts), INDEX(start_default, position, n_x),
        INDEX(start_default, start, n_starts), INDEX(start_guess, position, n_unknowns),
        INDEX(start_guess, start, n_starts), COLUMN(start_rows, start, n_start_unknowns, -1, m->n_starts),
        COLUMN(start_rows, row, n_start_unknowns, 0, m->n_start_values), INDEX(start_dependent, start, n_starts),
        INDEX(start_dependent, node, n_nodes), ARRAY(start_zero, n_start_zero, n_x),
        ARRAY(start_columns, n_start_unknowns, n_unknowns + m->n_y), ARRAY(steady, n_steady, n_unknowns),
        ARRAY(jacobian_to_step, n_jacobian, step.n_nonzeros), ARRAY(step_diagonal, n_x, step.n_nonzeros),
        ARRAY(lu.row_place, step.size, step.size), ARRAY(lu.column_order, step.size, step.size)};
    for (size_t k = 0; k < sizeof ranges / sizeof ranges[0]; k++)
        for (int64_t i = 0; i < ranges[k].count; i++) {
            int value;
            memcpy(&value, (const char *)ranges[k].first + (size_t)i * ranges[k].stride, sizeof value);
            if (value < ranges[k].low || value >= ranges[k].end) return damaged(message, ranges[k].name);
        }
    return 1;
}

static int check_events(const Model *m, char *message) {
    for (int k = 0; k < m->n_modes; k++)
        if (m->modes[k].n_names > m->n_mode_names - m->modes[k].first_name) return damaged(message, "modes.n_names");
    for (const Transition *one = m->transitions; one < m->transitions + m->n_transitions; one++)
        if (one->index < 0 || one->index >= (one->timed ? m->n_moments : m->n_guards))
            return damaged(message, "transitions.index");
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

/* Columns of a sparse matrix; `least` entries in each. */
static int check_columns(int size, int rows, const int *colind, const int *row, int count, int least) {
    if (colind[0] != 0 || colind[size] != count) return 0;
    for (int k = 0; k < size; k++)
        if (colind[k + 1] > count || colind[k + 1] < colind[k] + least) return 0;
    for (int k = 0; k < count; k++)
        if (row[k] < 0 || row[k] >= rows) return 0;
    return 1;
}

static int check_pattern(const QrPattern *a) {
    int n = a->size;
    if (a->n_ends != n + 1 || !check_columns(n, n, a->colind, a->row, a->n_nonzeros, 0) ||
        !check_columns(n, n, a->v_colind, a->v_row, a->n_v, 1) ||
        !check_columns(n, n, a->r_colind, a->r_row, a->n_r, 1))
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

static int check_lu(const LuPattern *a, int n) {
    int eliminated = a->n_ends - 1 - n;
    if (eliminated < 0 || eliminated > n || !check_columns(a->n_ends - 1, n, a->ends, a->rows, a->n_rows, 0)) return 0;
    for (int k = a->ends[eliminated]; k < a->n_rows; k++)
        if (a->rows[k] >= eliminated) return 0;
    return 1;
}

/* Reads a model from bytes that are aligned as numbers and outlive it. Returns NULL and a message for `message`, which
 * has MESSAGE_LENGTH characters, if they are no model. */
Model *model_read(const unsigned char *bytes, size_t size, Allocate allocate, Release release, char *message) {
    if (!check_header(bytes, size, message)) return NULL;
    Model *m = allocate(1, sizeof *m);
    if (m == NULL) return REFUSE("There is not enough memory.");
    memset(m, 0, sizeof *m);
    m->release = release;
    if (find_tables(m, bytes, size, message) && find_sizes(m, size, message) && check_sizes(m, message) &&
        check_indices(m, message) && check_variables(m, message) && check_events(m, message) &&
        (check_pattern(&m->step) || damaged(message, "step")) &&
        (check_lu(&m->lu, m->step.size) || damaged(message, "lu")) &&
        (check_pattern(&m->start) || damaged(message, "start")))
        return m;
    release(m);
    return NULL;
}

void model_free(Model *m) {
    if (m->own != NULL) m->release(m->own);
    m->release(m);
}
