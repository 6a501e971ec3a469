/* Damages model files in many ways, with the checksum made right again, and uses what is accepted: under
 * AddressSanitizer and UBSan nothing may be read or written outside of the tables. Prints how many were refused. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "core.h"

enum { HEAD = 24, ENTRY = 16, MOST = 1 << 22 };
static uint64_t words[MOST / 8];
static unsigned char *const bytes = (unsigned char *)words;
static unsigned char original[MOST];
static uint64_t state;

static uint32_t next(void) { /* xorshift */
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32);
}

static void put(size_t at, int32_t value) { memcpy(bytes + at, &value, sizeof value); }

static int32_t strange(int32_t old) {
    const int32_t special[] = {0, -1, 1, 2, 7, 64, 1000, INT32_MAX, INT32_MIN, 1 << 20, -(1 << 20), 8};
    switch (next() % 4) {
        case 0: return (int32_t)((uint32_t)old + next() % 5 - 2);
        case 1: return (int32_t)((uint32_t)old ^ (1u << next() % 32));
        default: return special[next() % (sizeof special / sizeof special[0])];
    }
}

/* Changes a few integers, anywhere or in the table of sections; or cuts the file. Returns its size. */
static size_t damage(size_t size, int sections) {
    size_t tables = (size_t)(HEAD + sections * ENTRY);
    memcpy(bytes, original, size);
    if (next() % 20 == 0) size = next() % (size + 1);
    for (uint32_t n = next() % 4; n + 1 > 0 && size > 8; n--) {
        int32_t old;
        size_t section = next() % (uint32_t)sections, at;
        int32_t entry[4];
        memcpy(entry, original + HEAD + section * ENTRY, sizeof entry);
        if (next() % 4 == 0) at = 8 + 4 * (next() % (tables / 4 - 2));
        else if (entry[3] == 0) continue;
        else at = (size_t)entry[2] + 4 * (next() % (uint32_t)((entry[1] * entry[3] + 3) / 4));
        if (at + 4 > size) continue;
        memcpy(&old, bytes + at, sizeof old);
        put(at, strange(old));
        if (n == 0) break;
    }
    return size;
}

static void make_right(size_t size) {
    uint32_t check = 0xffffffff;
    if (size < HEAD) return;
    for (size_t k = HEAD; k < size; k++) {
        check ^= bytes[k];
        for (int bit = 0; bit < 8; bit++) check = (check >> 1) ^ (check & 1 ? 0xedb88320u : 0);
    }
    put(16, (int32_t)~check);
    put(20, (int32_t)size);
}

/* Everything but integration over time, which garbage can make as long as it likes. */
static void use(const Model *m) {
    Instance *c = instance_new((Instance){.model = m, .name = "fuzz", .allocate = calloc, .release = free}, m->token);
    double *rates, *indicators, value;
    void *copy = NULL;
    if (c == NULL) return;
    rates = calloc((size_t)m->n_x + 1, sizeof(double));
    indicators = calloc((size_t)m->n_guards + 1, sizeof(double));
    state_copy_out(c, &copy);
    c->state.phase = PHASE_INITIALIZATION;
    start_solve(c);
    c->state.phase = PHASE_EVENT;
    c->state.solved = 1;
    handle_event(c);
    if (make_consistent(c) == RESULT_OK) {
        get_derivatives(c, rates);
        get_indicators(c, indicators);
    }
    for (int k = 0; k < m->n_variables; k++) {
        const Variable *v = &m->variables[k];
        double one = 1;
        if (v->type != TYPE_ARRAY) get_value(c, v, &value);
        if (k % 7 == 0) directional(c, &v->reference, 1, &v->reference, 1, &one, &value);
        if (k % 7 == 1) adjoint(c, &v->reference, 1, &v->reference, 1, &one, &value);
        if (k % 7 == 2) output_rate(c, v->reference, 1 + k % 3, &value);
    }
    rosenbrock_step(c, 0, c->x, 1e-3, 0, c->piece);
    next_moment(c, 1);
    state_copy_in(c, copy);
    state_release(c, &copy);
    free(rates);
    free(indicators);
    instance_free(c);
}

int main(int argc, char **argv) {
    FILE *file = argc > 3 ? fopen(argv[1], "rb") : NULL;
    char message[MESSAGE_LENGTH] = "";
    int count, refused = 0, sections;
    size_t whole;
    if (file == NULL) return 2;
    whole = fread(original, 1, MOST, file);
    fclose(file);
    count = atoi(argv[2]);
    state = (uint64_t)atoi(argv[3]) * 2654435761u + 88172645463325252u;
    memcpy(&sections, original + 12, sizeof sections);
    for (int k = 0; k < count; k++) {
        size_t size = k == 0 ? whole : damage(whole, sections);
        unsigned char *exact; /* so that the sanitizer sees where the file ends */
        Model *m;
        if (k == 0) memcpy(bytes, original, whole);
        make_right(size);
        exact = malloc(size + (size == 0));
        memcpy(exact, bytes, size);
        *message = 0;
        m = model_read(exact, size, calloc, free, message);
        if (m == NULL) {
            refused++;
            if (strstr(message, "model file") == NULL) return 3;
        } else {
            use(m);
            model_free(m);
        }
        if (k == 0 && refused) return 4;
        free(exact);
    }
    printf("%d %d\n", count, refused);
    return 0;
}
