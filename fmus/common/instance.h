/* What both versions of the standard ask of an instance. Every function returns whether the call made sense. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

enum { INSTANTIATED, INITIALIZING, RUNNING };

#define UNUSED(x) (void)(x)

static void set_defaults(Model *m) {
    memset(m, 0, sizeof *m);
    memcpy(m->v, start_value, sizeof m->v);
}

static Model *new_model(const char *name, const char *token) {
    if (!name || !token || strcmp(token, MODEL_TOKEN)) return NULL;
    Model *m = malloc(sizeof *m);
    if (m) set_defaults(m);
    return m;
}

static int initialize(Model *m, double time) {
    if (!m || m->phase != INSTANTIATED || !isfinite(time)) return 0;
    m->time = time;
    m->phase = INITIALIZING;
    return 1;
}

static int begin_running(Model *m) {
    if (!m || m->phase != INITIALIZING) return 0;
    model_start(m);
    m->phase = RUNNING;
    return 1;
}

static int set_time(Model *m, double time) {
    if (!m || !isfinite(time)) return 0;
    m->time = time;
    return 1;
}

static int advance(Model *m, double from, double step) {
    if (!m || m->phase != RUNNING || !isfinite(from) || !isfinite(step) || step <= 0) return 0;
    if (fabs(from - m->time) > 1e-9 * (1 + fabs(from))) return 0;
    model_advance(m, from + step);
    return 1;
}

/* Outputs of the start are known during initialization, too, without leaving it. */
static void refresh(Model *m) {
    if (m->phase == INITIALIZING) {
        Model copy = *m;
        model_start(&copy);
        memcpy(m->v, copy.v, sizeof m->v);
    }
    if (STATES && m->phase == RUNNING) model_evaluate(m);
    m->v[run_time] = m->time;
}

static int known(const Model *m, const uint32_t vr[], size_t n, const void *value, int integer) {
    if (!m || (n && (!vr || !value))) return 0;
    for (size_t k = 0; k < n; k++)
        if (vr[k] >= VARIABLES || is_integer[vr[k]] != integer) return 0;
    return 1;
}

static int get_reals(Model *m, const uint32_t vr[], size_t n, double value[]) {
    if (!known(m, vr, n, value, 0)) return 0;
    refresh(m);
    for (size_t k = 0; k < n; k++) value[k] = m->v[vr[k]];
    return 1;
}

static int get_integers(Model *m, const uint32_t vr[], size_t n, int64_t value[]) {
    if (!known(m, vr, n, value, 1)) return 0;
    refresh(m);
    for (size_t k = 0; k < n; k++) value[k] = (int64_t)m->v[vr[k]];
    return 1;
}

static int set_reals(Model *m, const uint32_t vr[], size_t n, const double value[]) {
    if (!known(m, vr, n, value, 0)) return 0;
    for (size_t k = 0; k < n; k++) {
        if (!isfinite(value[k])) return 0;
        m->v[vr[k]] = value[k];
    }
    return 1;
}

static int get_block(Model *m, double target[], size_t n, size_t expected, size_t first) {
    if (!m || n != expected || (n && !target)) return 0;
    refresh(m);
    if (n) memcpy(target, m->v + first, n * sizeof *target);
    return 1;
}

static int set_states(Model *m, const double x[], size_t n) {
    if (!m || n != STATES || (n && !x)) return 0;
    if (n) memcpy(m->v + FIRST_STATE, x, n * sizeof *x);
    return 1;
}

static int get_nominals(const Model *m, double nominal[], size_t n) {
    if (!m || n != STATES || (n && !nominal)) return 0;
    for (size_t k = 0; k < n; k++) nominal[k] = 1;
    return 1;
}

static int save(const void *source, void **target) {
    if (!source || !target) return 0;
    if (!*target) *target = malloc(sizeof(Model));
    if (!*target) return 0;
    memcpy(*target, source, sizeof(Model));
    return 1;
}

static int restore(void *target, const void *source) {
    if (!target || !source) return 0;
    memcpy(target, source, sizeof(Model));
    return 1;
}

static int drop(void **state) {
    if (!state) return 0;
    free(*state);
    *state = NULL;
    return 1;
}

#endif
