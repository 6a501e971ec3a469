/* What all FMI 3.0 functions share. */
#ifndef FMI3_H
#define FMI3_H

#include "core.h"
#include "fmi3Functions.h"

#define READABLE (PHASE_INITIALIZATION | PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_TERMINATED)
#define SETTABLE \
    (PHASE_INSTANTIATED | PHASE_CONFIGURATION | PHASE_INITIALIZATION | PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP)
#define ANY_PHASE (~0)

/* Refuses calls without an instance, or in a state in which the standard does not allow them. */
#define ENTER(name, phases) \
    Instance *c = instance; \
    if (c == NULL || allowed(c, #name, phases) != RESULT_OK) return fmi3Error

/* Refuses arguments. */
#define NEED(pointer, n) \
    if ((n) > 0 && (pointer) == NULL) return refuse(c, "The argument " #pointer " is a null pointer.")
#define NEED_SIZE(n, wanted, what) \
    if ((n) != (size_t)(wanted)) return wrong_size(c, n, (size_t)(wanted), what)

static inline fmi3Status status(Result result) {
    if (result == RESULT_OK) return fmi3OK;
    return result == RESULT_DISCARD ? fmi3Discard : fmi3Error;
}

static inline fmi3Status refuse(Instance *c, const char *why) {
    return status(report(c, LOG_ERROR, RESULT_ERROR, "%s", why));
}

static inline fmi3Status wrong_size(Instance *c, size_t given, size_t wanted, const char *what) {
    return status(report(c, LOG_ERROR, RESULT_ERROR, "There must be %zu %s, not %zu.", wanted, what, given));
}

#endif
