/* What all FMI 2.0 functions share. */
#ifndef FMI2_H
#define FMI2_H

#include "core.h"
#include "fmi2Functions.h"

#define READABLE (PHASE_INITIALIZATION | PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_TERMINATED)
#define SETTABLE (PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP)
#define ANY_PHASE (~0)

/* Refuses calls without an instance, or in a state in which the standard does not allow them. */
#define ENTER(name, phases)  \
    Instance *c = component; \
    if (c == NULL || allowed(c, #name, phases) != RESULT_OK) return fmi2Error

/* Refuses arguments. */
#define NEED(pointer, n) \
    if ((n) > 0 && (pointer) == NULL) return refuse(c, "The argument " #pointer " is a null pointer.")
#define NEED_SIZE(n, wanted, what) \
    if ((n) != (size_t)(wanted)) return wrong_size(c, n, (size_t)(wanted), what)

static inline fmi2Status status(Result result) {
    if (result == RESULT_OK) return fmi2OK;
    return result == RESULT_DISCARD ? fmi2Discard : fmi2Error;
}

static inline fmi2Status refuse(Instance *c, const char *why) {
    return status(report(c, LOG_ERROR, RESULT_ERROR, "%s", why));
}

static inline fmi2Status wrong_size(Instance *c, size_t given, size_t wanted, const char *what) {
    return status(report(c, LOG_ERROR, RESULT_ERROR, "This model has %zu %s, not %zu.", wanted, what, given));
}

#endif
