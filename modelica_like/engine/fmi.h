/* The functions of FMI 2.0 and 3.0: checks of every call, and those functions that both versions have. A version says
 * what it is called (VERSION: fmi2 or fmi3) and where its names differ from the other's, and includes this once. */
#ifndef FMI_H
#define FMI_H

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
    if (c == NULL || !allowed(c, TEXT(FMI(name)), phases)) return FMI(Error)

/* Are arguments what they must be: no null pointers where n > 0, the right sizes? If not, it is told. */
#define GIVEN(n, ...) ((n) == 0 || all_given(c, (const void *const[]){__VA_ARGS__}, TEXT((__VA_ARGS__))))
#define SIZED(n, wanted, what) \
    ((n) == (size_t)(wanted) || refuse(c, "There must be %zu %s, not %zu.", (size_t)(wanted), what, n))
#define NEED(n, ...) \
    if (!GIVEN(n, __VA_ARGS__)) return FMI(Error)

typedef FMI(Status) Status;

static inline Status status(Result result) {
    return result == RESULT_OK ? FMI(OK) : result == RESULT_DISCARD ? FMI(Discard) : FMI(Error);
}

/* `names`: (a, b, c). */
static inline int all_given(Instance *c, const void *const *given, const char *names) {
    for (; *names != ')'; given++) {
        size_t length = strcspn(++names, ",)");
        if (*given == NULL) return refuse(c, "The argument %.*s is a null pointer.", (int)length, names);
        names += length + strspn(names + length, ", ") - (names[length] == ',');
    }
    return 1;
}

/* A function that does the same for everything that it is given, if arguments are what it needs. */
#define EACH(name, phases, n, needs, call, ...)     \
    Status FMI(name)(void *instance, __VA_ARGS__) { \
        ENTER(name, phases);                        \
        if (!(needs)) return FMI(Error);            \
        for (size_t k = 0; k < (n); k++)            \
            if (!(call)) return FMI(Error);         \
        return FMI(OK);                             \
    }
/* A function whose work is one call of the run-time. */
#define CALL(name, phases, needs, call, ...) EACH(name, phases, 1, needs, call, __VA_ARGS__)
/* One without arguments. */
#define DO(name, phases, call)         \
    Status FMI(name)(void *instance) { \
        ENTER(name, phases);           \
        return status(call);           \
    }
#define CHANGE_PHASE(name, from, to, forbidden, why) \
    DO(name, from, (forbidden) ? refuse(c, TEXT(FMI(name)) why) : (c->state.phase = (to), RESULT_OK))

static inline Status failed(Instance *c) {
    c->state.phase = PHASE_FAILED;
    return FMI(Error);
}

static inline Result get_mode(Instance *c, uint32_t reference, INTEGER *value) {
    double number = 0;
    Result result = get_value(c, known_variable(c, reference, TYPE_ENUMERATION), &number);
    if (result) *value = (INTEGER)number;
    return result;
}

void FMI(FreeInstance)(void *instance) {
    if (instance != NULL) instance_free(instance);
}

Status FMI(SetDebugLogging)(
    void *instance, FMI(Boolean) loggingOn, size_t nCategories, const FMI(String) categories[]) {
    Result result = RESULT_OK;
    ENTER(SetDebugLogging, ANY_PHASE);
    NEED(nCategories, categories);
    for (size_t k = 0; k < nCategories || k == 0; k++)
        if (!set_log_category(c, nCategories > 0 ? categories[k] : NULL, loggingOn)) result = RESULT_ERROR;
    return status(result);
}

Status FMI(ExitInitializationMode)(void *instance) {
    ENTER(ExitInitializationMode, PHASE_INITIALIZATION);
    if (!c->state.solved && !start_solve(c)) return failed(c);
    c->state.inputs_changed = 0;
    c->state.phase = c->co_simulation && !c->event_mode_used ? PHASE_STEP : PHASE_EVENT;
    if (c->state.phase == PHASE_STEP && !handle_event(c)) return failed(c);
    return FMI(OK);
}

CHANGE_PHASE(Terminate, PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_FAILED, PHASE_TERMINATED,
    c->state.phase != PHASE_FAILED && !finish(c), ": its last event failed.")

DO(Reset, ANY_PHASE, (instance_reset(c), RESULT_OK))

CHANGE_PHASE(EnterContinuousTimeMode, PHASE_EVENT, PHASE_CONTINUOUS, c->co_simulation, " belongs to Model Exchange.")

Status FMI(CompletedIntegratorStep)(void *instance, FMI(Boolean) noSetFMUStatePriorToCurrentPoint,
    FMI(Boolean) * enterEventMode, FMI(Boolean) * terminateSimulation) {
    ENTER(CompletedIntegratorStep, PHASE_CONTINUOUS);
    NEED(1, enterEventMode, terminateSimulation);
    if (!settle(c)) return FMI(Error);
    keep_past(c, c->state.t, c->x, -1);
    *enterEventMode = find_wanting(c, nothing_wanting(c), 1) != 0;
    *terminateSimulation = c->state.ended != 0;
    return FMI(OK);
}

CALL(SetTime, PHASE_EVENT | PHASE_CONTINUOUS, 1, set_time(c, time), double time)
CALL(SetContinuousStates, PHASE_EVENT | PHASE_CONTINUOUS, SIZED(n, c->model->n_x, "continuous states") && GIVEN(n, x),
    set_states(c, x), const double x[], size_t n)

#define GET_ALL(name, array, phases, count, what, action)                                                         \
    CALL(name, phases, SIZED(n, count, what) && GIVEN(n, array) && ((phases) == ANY_PHASE || make_consistent(c)), \
        (action, RESULT_OK), double array[], size_t n)
#define GET_STATES(name, array, phases, action) GET_ALL(name, array, phases, c->model->n_x, "continuous states", action)

GET_STATES(GetDerivatives, derivatives, READABLE, get_derivatives(c, derivatives))
GET_STATES(GetContinuousStates, x, READABLE, memcpy(x, c->x, n * sizeof(double)))
GET_STATES(GetNominals, x_nominal, ANY_PHASE, memcpy(x_nominal, c->model->nominals, n * sizeof(double)))
GET_ALL(GetEventIndicators, indicators, READABLE, c->model->n_guards, "event indicators", get_indicators(c, indicators))

CALL(JOIN(Get, FMUState), ANY_PHASE, GIVEN(1, FMUState), state_copy_out(c, FMUState), void **FMUState)
CALL(JOIN(Set, FMUState), ANY_PHASE, GIVEN(1, FMUState), state_copy_in(c, FMUState), void *FMUState)
CALL(JOIN(Free, FMUState), ANY_PHASE, 1, state_release(c, FMUState), void **FMUState)
CALL(SerializedSize, ANY_PHASE, GIVEN(1, FMUState, size), (*size = state_size(c), RESULT_OK), void *FMUState,
    size_t *size)
CALL(JOIN(Serialize, FMUState), ANY_PHASE, GIVEN(1, FMUState, serializedState),
    state_write(c, FMUState, (unsigned char *)serializedState, size), void *FMUState, FMI(Byte) serializedState[],
    size_t size)
CALL(JOIN(Deserialize, FMUState), ANY_PHASE, GIVEN(1, FMUState, serializedState),
    state_read(c, (const unsigned char *)serializedState, size, FMUState), const FMI(Byte) serializedState[],
    size_t size, void **FMUState)

#endif
