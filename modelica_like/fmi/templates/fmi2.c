/* FMI 2.0: checks every call, then leaves the work to the run-time. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "core.h"
#include "fmi2Functions.h"

#define READABLE (PHASE_INITIALIZATION | PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_TERMINATED)
#define SETTABLE (PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP)
#define ANY_PHASE (~0)

/* Refuses calls without an instance, or in a state in which the standard does not allow them. */
#define ENTER(name, phases)      \
    Instance *c = component;     \
    if (c == NULL || allowed(c, #name, phases) != RESULT_OK) return fmi2Error

#define NEED(pointer, n) \
    if ((n) > 0 && (pointer) == NULL) return refuse(c, "The argument " #pointer " is a null pointer.")

static fmi2Status status(Result result) {
    if (result == RESULT_OK) return fmi2OK;
    return result == RESULT_DISCARD ? fmi2Discard : fmi2Error;
}

static fmi2Status refuse(Instance *c, const char *why) {
    return status(report(c, LOG_ERROR, RESULT_ERROR, "%s", why));
}

static fmi2Status failed(Instance *c) {
    c->state.phase = PHASE_FAILED;
    return fmi2Error;
}

static void log_fmi2(const Instance *c, int result, const char *category, const char *message) {
    fmi2CallbackLogger logger = (fmi2CallbackLogger)c->logger;
    char plain[1024];
    size_t length = 0;
    /* The importer takes the message as a format. */
    for (const char *from = message; *from && length + 2 < sizeof plain; from++) {
        if (*from == '%') plain[length++] = '%';
        plain[length++] = *from;
    }
    plain[length] = 0;
    logger(c->environment, c->name, status((Result)result), category, plain);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
    fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn) {
    Instance *c;
    int own_memory;
    (void)fmuResourceLocation, (void)visible;
    if (functions == NULL || (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation)) return NULL;
    own_memory = functions->allocateMemory == NULL || functions->freeMemory == NULL;
    c = instance_new(instanceName, fmuGUID, own_memory ? calloc : functions->allocateMemory,
                     own_memory ? free : functions->freeMemory, functions->logger ? log_fmi2 : NULL,
                     (AnyFunction)functions->logger, functions->componentEnvironment, loggingOn);
    if (c != NULL) c->co_simulation = fmuType == fmi2CoSimulation;
    return c;
}

void fmi2FreeInstance(fmi2Component component) {
    if (component != NULL) instance_free(component);
}

fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean loggingOn, size_t nCategories,
    const fmi2String categories[]) {
    Result result = RESULT_OK;
    ENTER(fmi2SetDebugLogging, ANY_PHASE);
    NEED(categories, nCategories);
    if (nCategories == 0) result = set_log_category(c, NULL, loggingOn);
    for (size_t k = 0; k < nCategories; k++)
        if (set_log_category(c, categories[k], loggingOn) != RESULT_OK) result = RESULT_ERROR;
    return status(result);
}

/* ---- life of an instance ---------------------------------------------------------------------------------------- */

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean toleranceDefined, fmi2Real tolerance,
    fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    ENTER(fmi2SetupExperiment, PHASE_INSTANTIATED);
    return status(set_experiment(c, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
    ENTER(fmi2EnterInitializationMode, PHASE_INSTANTIATED);
    c->state.phase = PHASE_INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
    ENTER(fmi2ExitInitializationMode, PHASE_INITIALIZATION);
    if (!c->state.solved && start_solve(c) != RESULT_OK) return failed(c);
    c->state.phase = c->co_simulation ? PHASE_STEP : PHASE_EVENT;
    c->state.inputs_changed = 0;
    if (c->co_simulation && handle_event(c) != RESULT_OK) return failed(c);
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component component) {
    ENTER(fmi2Terminate, PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_FAILED);
    c->state.phase = PHASE_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component component) {
    ENTER(fmi2Reset, ANY_PHASE);
    instance_reset(c);
    return fmi2OK;
}

/* ---- values ----------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    ENTER(fmi2GetReal, READABLE);
    NEED(vr, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++) if (get_float(c, vr[k], &value[k]) != RESULT_OK) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component component, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    ENTER(fmi2GetInteger, READABLE);
    NEED(vr, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++) if (get_mode(c, vr[k], &value[k]) != RESULT_OK) return fmi2Error;
    return fmi2OK;
}

static fmi2Status no_such_type(Instance *c, size_t nvr, const char *type) {
    return nvr == 0 ? fmi2OK : status(report(c, LOG_ERROR, RESULT_ERROR, "This model has no variables of type %s.",
        type));
}

fmi2Status fmi2GetBoolean(fmi2Component component, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    ENTER(fmi2GetBoolean, READABLE);
    (void)vr, (void)value;
    return no_such_type(c, nvr, "Boolean");
}

fmi2Status fmi2GetString(fmi2Component component, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    ENTER(fmi2GetString, READABLE);
    (void)vr, (void)value;
    return no_such_type(c, nvr, "String");
}

fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    ENTER(fmi2SetReal, SETTABLE);
    NEED(vr, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++) if (set_float(c, vr[k], value[k]) != RESULT_OK) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component component, const fmi2ValueReference vr[], size_t nvr,
    const fmi2Integer value[]) {
    ENTER(fmi2SetInteger, SETTABLE);
    NEED(vr, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++) if (set_mode(c, vr[k], value[k]) != RESULT_OK) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component component, const fmi2ValueReference vr[], size_t nvr,
    const fmi2Boolean value[]) {
    ENTER(fmi2SetBoolean, SETTABLE);
    (void)vr, (void)value;
    return no_such_type(c, nvr, "Boolean");
}

fmi2Status fmi2SetString(fmi2Component component, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    ENTER(fmi2SetString, SETTABLE);
    (void)vr, (void)value;
    return no_such_type(c, nvr, "String");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference vUnknown_ref[],
    size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                            const fmi2Real dvKnown[], fmi2Real dvUnknown[]) {
    ENTER(fmi2GetDirectionalDerivative, PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_TERMINATED);
    NEED(vUnknown_ref, nUnknown);
    NEED(dvUnknown, nUnknown);
    NEED(vKnown_ref, nKnown);
    NEED(dvKnown, nKnown);
    return status(directional(c, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown));
}

/* ---- copies of the state ---------------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *FMUstate) {
    ENTER(fmi2GetFMUstate, ANY_PHASE);
    NEED(FMUstate, 1);
    return status(state_copy_out(c, FMUstate));
}

fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate FMUstate) {
    ENTER(fmi2SetFMUstate, ANY_PHASE);
    NEED(FMUstate, 1);
    return status(state_copy_in(c, FMUstate));
}

fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *FMUstate) {
    ENTER(fmi2FreeFMUstate, ANY_PHASE);
    if (FMUstate != NULL) state_release(c, FMUstate);
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate FMUstate, size_t *size) {
    ENTER(fmi2SerializedFMUstateSize, ANY_PHASE);
    NEED(FMUstate, 1);
    NEED(size, 1);
    *size = state_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate FMUstate, fmi2Byte serializedState[],
    size_t size) {
    ENTER(fmi2SerializeFMUstate, ANY_PHASE);
    NEED(FMUstate, 1);
    NEED(serializedState, 1);
    return status(state_write(c, FMUstate, (unsigned char *)serializedState, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte serializedState[], size_t size,
    fmi2FMUstate *FMUstate) {
    ENTER(fmi2DeSerializeFMUstate, ANY_PHASE);
    NEED(FMUstate, 1);
    NEED(serializedState, 1);
    return status(state_read(c, (const unsigned char *)serializedState, size, FMUstate));
}

/* ---- Model Exchange --------------------------------------------------------------------------------------------- */

static fmi2Status wrong_size(Instance *c, size_t given, size_t wanted, const char *what) {
    return status(report(c, LOG_ERROR, RESULT_ERROR, "This model has %zu %s, not %zu.", wanted, what, given));
}

fmi2Status fmi2EnterEventMode(fmi2Component component) {
    ENTER(fmi2EnterEventMode, PHASE_CONTINUOUS | PHASE_EVENT);
    c->state.phase = PHASE_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *eventInfo) {
    double before[AT_LEAST_ONE(N_X)], next;
    ENTER(fmi2NewDiscreteStates, PHASE_EVENT);
    NEED(eventInfo, 1);
    memcpy(before, c->state.x, sizeof before);
    if (handle_event(c) != RESULT_OK) return failed(c);
    next = next_moment(c);
    eventInfo->newDiscreteStatesNeeded = fmi2False;
    eventInfo->terminateSimulation = fmi2False;
    eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    eventInfo->valuesOfContinuousStatesChanged = memcmp(before, c->state.x, sizeof before) != 0;
    eventInfo->nextEventTimeDefined = isfinite(next);
    eventInfo->nextEventTime = isfinite(next) ? next : 0;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component component) {
    ENTER(fmi2EnterContinuousTimeMode, PHASE_EVENT);
    if (c->co_simulation) return refuse(c, "fmi2EnterContinuousTimeMode belongs to Model Exchange.");
    c->state.phase = PHASE_CONTINUOUS;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component component, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
    fmi2Boolean *enterEventMode,
                                       fmi2Boolean *terminateSimulation) {
    unsigned char wanting[AT_LEAST_ONE(N_TRANSITIONS)] = {0};
    ENTER(fmi2CompletedIntegratorStep, PHASE_CONTINUOUS);
    (void)noSetFMUStatePriorToCurrentPoint;
    NEED(enterEventMode, 1);
    NEED(terminateSimulation, 1);
    if (settle(c) != RESULT_OK) return fmi2Error;
    *enterEventMode = find_wanting(c, wanting, 1);
    *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component component, fmi2Real time) {
    ENTER(fmi2SetTime, PHASE_EVENT | PHASE_CONTINUOUS);
    return status(set_time(c, time));
}

fmi2Status fmi2SetContinuousStates(fmi2Component component, const fmi2Real x[], size_t nx) {
    ENTER(fmi2SetContinuousStates, PHASE_EVENT | PHASE_CONTINUOUS);
    if (nx != N_X) return wrong_size(c, nx, N_X, "continuous states");
    NEED(x, nx);
    return status(set_states(c, x));
}

fmi2Status fmi2GetDerivatives(fmi2Component component, fmi2Real derivatives[], size_t nx) {
    ENTER(fmi2GetDerivatives, READABLE);
    if (nx != N_X) return wrong_size(c, nx, N_X, "continuous states");
    NEED(derivatives, nx);
    if (make_consistent(c) != RESULT_OK) return fmi2Error;
    get_derivatives(c, derivatives);
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component component, fmi2Real eventIndicators[], size_t ni) {
    ENTER(fmi2GetEventIndicators, READABLE);
    if (ni != N_GUARDS) return wrong_size(c, ni, N_GUARDS, "event indicators");
    NEED(eventIndicators, ni);
    if (make_consistent(c) != RESULT_OK) return fmi2Error;
    get_indicators(c, eventIndicators);
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component component, fmi2Real x[], size_t nx) {
    ENTER(fmi2GetContinuousStates, READABLE);
    if (nx != N_X) return wrong_size(c, nx, N_X, "continuous states");
    NEED(x, nx);
    if (make_consistent(c) != RESULT_OK) return fmi2Error;
    memcpy(x, c->state.x, nx * sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component component, fmi2Real x_nominal[], size_t nx) {
    ENTER(fmi2GetNominalsOfContinuousStates, ANY_PHASE);
    if (nx != N_X) return wrong_size(c, nx, N_X, "continuous states");
    NEED(x_nominal, nx);
    memcpy(x_nominal, model_nominals, nx * sizeof(double));
    return fmi2OK;
}

/* ---- Co-Simulation ---------------------------------------------------------------------------------------------- */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference vr[], size_t nvr,
    const fmi2Integer order[], const fmi2Real value[]) {
    ENTER(fmi2SetRealInputDerivatives, PHASE_INITIALIZATION | PHASE_STEP);
    NEED(vr, nvr);
    NEED(order, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++) {
        if (order[k] != 1) return refuse(c, "Inputs have derivatives of order 1 only.");
        if (set_input_rate(c, vr[k], value[k]) != RESULT_OK) return fmi2Error;
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference vr[], size_t nvr,
    const fmi2Integer order[], fmi2Real value[]) {
    ENTER(fmi2GetRealOutputDerivatives, PHASE_STEP | PHASE_TERMINATED);
    NEED(vr, nvr);
    NEED(order, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++) {
        if (order[k] != 1) return refuse(c, "Outputs have derivatives of order 1 only.");
        if (output_rate(c, vr[k], &value[k]) != RESULT_OK) return fmi2Error;
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
    fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    double target;
    ENTER(fmi2DoStep, PHASE_STEP);
    (void)noSetFMUStatePriorToCurrentPoint;
    if (check_step(c, currentCommunicationPoint, communicationStepSize, &target) != RESULT_OK) return fmi2Error;
    return integrate_to(c, target, 0) == FAILED ? failed(c) : fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component component) {
    ENTER(fmi2CancelStep, ANY_PHASE);
    return refuse(c, "fmi2CancelStep: there is no step to cancel, as fmi2DoStep returns when its step is done.");
}

/* fmi2DoStep is never pending or discarded. */
static fmi2Status no_status(Instance *c) { return status(report(c, LOG_WARNING, RESULT_DISCARD,
    "The last step was neither pending nor discarded.")); }

fmi2Status fmi2GetStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Status *value) {
    ENTER(fmi2GetStatus, PHASE_STEP | PHASE_TERMINATED | PHASE_FAILED);
    (void)kind;
    NEED(value, 1);
    *value = fmi2OK;
    return no_status(c);
}

fmi2Status fmi2GetRealStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Real *value) {
    ENTER(fmi2GetRealStatus, PHASE_STEP | PHASE_TERMINATED | PHASE_FAILED);
    NEED(value, 1);
    if (kind != fmi2LastSuccessfulTime) return no_status(c);
    *value = c->state.t;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Integer *value) {
    ENTER(fmi2GetIntegerStatus, PHASE_STEP | PHASE_TERMINATED | PHASE_FAILED);
    (void)kind, (void)value;
    return no_status(c);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Boolean *value) {
    ENTER(fmi2GetBooleanStatus, PHASE_STEP | PHASE_TERMINATED | PHASE_FAILED);
    NEED(value, 1);
    if (kind != fmi2Terminated) return no_status(c);
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component component, const fmi2StatusKind kind, fmi2String *value) {
    ENTER(fmi2GetStringStatus, PHASE_STEP | PHASE_TERMINATED | PHASE_FAILED);
    (void)kind, (void)value;
    return no_status(c);
}
