/* The functions of FMI 2.0 and 3.0: checks of every call, and those functions that both versions have. A version says
 * what it is called (VERSION: fmi2 or fmi3) and where its names differ from the other's, and includes this once. */
#ifndef FMI_H
#define FMI_H

#include <string.h>
#include "core.h"

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define TEXT_(name) #name
#define TEXT(name) TEXT_(name)
#define FMI(name) JOIN(VERSION, name)

#define READABLE (PHASE_INITIALIZATION | PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_TERMINATED)
#define SETTABLE \
    (PHASE_INSTANTIATED | PHASE_CONFIGURATION | PHASE_INITIALIZATION | PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP)
#define ANY_PHASE (~0)

/* Refuses calls without an instance, or in a state in which the standard does not allow them. */
#define ENTER(name, phases) \
    Instance *c = instance; \
    if (c == NULL || allowed(c, TEXT(FMI(name)), phases) != RESULT_OK) return FMI(Error)

/* Refuses arguments: null pointers where n > 0, wrong sizes. */
#define NEED(n, ...)                                                                                    \
    do {                                                                                                \
        const void *const given[] = {__VA_ARGS__};                                                      \
        if ((n) > 0 && refuse_null(c, given, sizeof given / sizeof given[0], TEXT((__VA_ARGS__))) != 0) \
            return FMI(Error);                                                                          \
    } while (0)
#define NEED_SIZE(n, wanted, what) \
    if ((n) != (size_t)(wanted))   \
    return status(fail(c, "There must be %zu %s, not %zu.", (size_t)(wanted), what, (size_t)(n)))

typedef FMI(Status) Status;

static inline Status status(Result result) {
    if (result == RESULT_OK) return FMI(OK);
    return result == RESULT_DISCARD ? FMI(Discard) : FMI(Error);
}

static inline Status refuse(Instance *c, const char *why) { return status(fail(c, "%s", why)); }

/* Names which of the arguments is a null pointer; `names`: (a, b, c). */
static inline int refuse_null(Instance *c, const void *const *given, size_t count, const char *names) {
    for (size_t k = 0; k < count; k++) {
        size_t length = strcspn(++names, ",)");
        if (given[k] == NULL)
            return fail(c, "The argument %.*s is a null pointer.", (int)length, names) == RESULT_ERROR;
        names += length + strspn(names + length, ", ") - 1;
    }
    return 0;
}

static inline Status failed(Instance *c) {
    c->state.phase = PHASE_FAILED;
    return FMI(Error);
}

static inline int get_mode(Instance *c, uint32_t reference, INTEGER *value) {
    double number;
    if (get_value(c, known_variable(c, reference, TYPE_ENUMERATION), &number) != RESULT_OK) return 0;
    *value = (INTEGER)number;
    return 1;
}

/* ---- life of an instance ---------------------------------------------------------------------------------------- */

void FMI(FreeInstance)(void *instance) {
    if (instance != NULL) instance_free(instance);
}

Status FMI(SetDebugLogging)(
    void *instance, FMI(Boolean) loggingOn, size_t nCategories, const FMI(String) categories[]) {
    Result result = RESULT_OK;
    ENTER(SetDebugLogging, ANY_PHASE);
    NEED(nCategories, categories);
    if (nCategories == 0) result = set_log_category(c, NULL, loggingOn);
    for (size_t k = 0; k < nCategories; k++)
        if (set_log_category(c, categories[k], loggingOn) != RESULT_OK) result = RESULT_ERROR;
    return status(result);
}

Status FMI(ExitInitializationMode)(void *instance) {
    ENTER(ExitInitializationMode, PHASE_INITIALIZATION);
    if (!c->state.solved && start_solve(c) != RESULT_OK) return failed(c);
    c->state.inputs_changed = 0;
    c->state.phase = c->co_simulation && !c->event_mode_used ? PHASE_STEP : PHASE_EVENT;
    if (c->state.phase == PHASE_STEP && handle_event(c) != RESULT_OK) return failed(c);
    return FMI(OK);
}

Status FMI(Terminate)(void *instance) {
    ENTER(Terminate, PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_FAILED);
    c->state.phase = PHASE_TERMINATED;
    return FMI(OK);
}

Status FMI(Reset)(void *instance) {
    ENTER(Reset, ANY_PHASE);
    instance_reset(c);
    return FMI(OK);
}

/* ---- Model Exchange --------------------------------------------------------------------------------------------- */

Status FMI(EnterContinuousTimeMode)(void *instance) {
    ENTER(EnterContinuousTimeMode, PHASE_EVENT);
    if (c->co_simulation) return refuse(c, TEXT(FMI(EnterContinuousTimeMode)) " belongs to Model Exchange.");
    c->state.phase = PHASE_CONTINUOUS;
    return FMI(OK);
}

Status FMI(CompletedIntegratorStep)(void *instance, FMI(Boolean) noSetFMUStatePriorToCurrentPoint,
    FMI(Boolean) * enterEventMode, FMI(Boolean) * terminateSimulation) {
    ENTER(CompletedIntegratorStep, PHASE_CONTINUOUS);
    (void)noSetFMUStatePriorToCurrentPoint;
    NEED(1, enterEventMode, terminateSimulation);
    if (settle(c) != RESULT_OK) return FMI(Error);
    *enterEventMode = find_wanting(c, nothing_wanting(c), 1) != 0;
    *terminateSimulation = 0;
    return FMI(OK);
}

Status FMI(SetTime)(void *instance, double time) {
    ENTER(SetTime, PHASE_EVENT | PHASE_CONTINUOUS);
    return status(set_time(c, time));
}

Status FMI(SetContinuousStates)(void *instance, const double x[], size_t nx) {
    ENTER(SetContinuousStates, PHASE_EVENT | PHASE_CONTINUOUS);
    NEED_SIZE(nx, c->model->n_x, "continuous states");
    NEED(nx, x);
    return status(set_states(c, x));
}

#define GET_ALL(name, array, phases, count, what, action)                                \
    Status FMI(name)(void *instance, double array[], size_t n) {                         \
        ENTER(name, phases);                                                             \
        NEED_SIZE(n, count, what);                                                       \
        NEED(n, array);                                                                  \
        if ((phases) != ANY_PHASE && make_consistent(c) != RESULT_OK) return FMI(Error); \
        action;                                                                          \
        return FMI(OK);                                                                  \
    }
#define GET_STATES(name, array, phases, action) GET_ALL(name, array, phases, c->model->n_x, "continuous states", action)

GET_STATES(GetDerivatives, derivatives, READABLE, get_derivatives(c, derivatives))
GET_STATES(GetContinuousStates, x, READABLE, memcpy(x, c->x, n * sizeof(double)))
GET_STATES(GetNominals, x_nominal, ANY_PHASE, memcpy(x_nominal, c->model->nominals, n * sizeof(double)))
GET_ALL(GetEventIndicators, indicators, READABLE, c->model->n_guards, "event indicators", get_indicators(c, indicators))

/* ---- copies of the state ---------------------------------------------------------------------------------------- */

Status FMI(JOIN(Get, FMUState))(void *instance, void **FMUState) {
    ENTER(JOIN(Get, FMUState), ANY_PHASE);
    NEED(1, FMUState);
    return status(state_copy_out(c, FMUState));
}

Status FMI(JOIN(Set, FMUState))(void *instance, void *FMUState) {
    ENTER(JOIN(Set, FMUState), ANY_PHASE);
    NEED(1, FMUState);
    return status(state_copy_in(c, FMUState));
}

Status FMI(JOIN(Free, FMUState))(void *instance, void **FMUState) {
    ENTER(JOIN(Free, FMUState), ANY_PHASE);
    if (FMUState != NULL) state_release(c, FMUState);
    return FMI(OK);
}

Status FMI(SerializedSize)(void *instance, void *FMUState, size_t *size) {
    ENTER(SerializedSize, ANY_PHASE);
    NEED(1, FMUState, size);
    *size = state_size(c);
    return FMI(OK);
}

Status FMI(JOIN(Serialize, FMUState))(void *instance, void *FMUState, FMI(Byte) serializedState[], size_t size) {
    ENTER(JOIN(Serialize, FMUState), ANY_PHASE);
    NEED(1, FMUState, serializedState);
    return status(state_write(c, FMUState, (unsigned char *)serializedState, size));
}

Status FMI(JOIN(Deserialize, FMUState))(
    void *instance, const FMI(Byte) serializedState[], size_t size, void **FMUState) {
    ENTER(JOIN(Deserialize, FMUState), ANY_PHASE);
    NEED(1, FMUState, serializedState);
    return status(state_read(c, (const unsigned char *)serializedState, size, FMUState));
}

#endif
