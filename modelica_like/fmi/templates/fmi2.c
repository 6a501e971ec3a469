/* FMI 2.0, life of an instance and its steps: checks every call, then leaves the work to the run-time. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2.h"

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
    fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions, fmi2Boolean visible,
    fmi2Boolean loggingOn) {
    Instance *c;
    int own_memory;
    (void)visible;
    if (functions == NULL || (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation)) return NULL;
    own_memory = functions->allocateMemory == NULL || functions->freeMemory == NULL;
    c = instance_open(fmuResourceLocation, instanceName, fmuGUID, own_memory ? calloc : functions->allocateMemory,
        own_memory ? free : functions->freeMemory, functions->logger ? log_fmi2 : NULL, (AnyFunction)functions->logger,
        functions->componentEnvironment, loggingOn);
    if (c != NULL) c->co_simulation = fmuType == fmi2CoSimulation;
    return c;
}

void fmi2FreeInstance(fmi2Component component) {
    if (component != NULL) instance_free(component);
}

fmi2Status fmi2SetDebugLogging(
    fmi2Component component, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[]) {
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
    fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
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

/* ---- Model Exchange --------------------------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component component) {
    ENTER(fmi2EnterEventMode, PHASE_CONTINUOUS | PHASE_EVENT);
    c->state.phase = PHASE_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *eventInfo) {
    double next;
    int restart;
    ENTER(fmi2NewDiscreteStates, PHASE_EVENT);
    NEED(eventInfo, 1);
    if (update_discrete(c, &restart, &next) != RESULT_OK) return failed(c);
    eventInfo->newDiscreteStatesNeeded = fmi2False;
    eventInfo->terminateSimulation = fmi2False;
    eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    eventInfo->valuesOfContinuousStatesChanged = restart;
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
    fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation) {
    ENTER(fmi2CompletedIntegratorStep, PHASE_CONTINUOUS);
    (void)noSetFMUStatePriorToCurrentPoint;
    NEED(enterEventMode, 1);
    NEED(terminateSimulation, 1);
    if (settle(c) != RESULT_OK) return fmi2Error;
    *enterEventMode = find_wanting(c, nothing_wanting(c), 1);
    *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component component, fmi2Real time) {
    ENTER(fmi2SetTime, PHASE_EVENT | PHASE_CONTINUOUS);
    return status(set_time(c, time));
}

fmi2Status fmi2SetContinuousStates(fmi2Component component, const fmi2Real x[], size_t nx) {
    ENTER(fmi2SetContinuousStates, PHASE_EVENT | PHASE_CONTINUOUS);
    NEED_SIZE(nx, c->model->n_x, "continuous states");
    NEED(x, nx);
    return status(set_states(c, x));
}

fmi2Status fmi2GetDerivatives(fmi2Component component, fmi2Real derivatives[], size_t nx) {
    ENTER(fmi2GetDerivatives, READABLE);
    NEED_SIZE(nx, c->model->n_x, "continuous states");
    NEED(derivatives, nx);
    if (make_consistent(c) != RESULT_OK) return fmi2Error;
    get_derivatives(c, derivatives);
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component component, fmi2Real eventIndicators[], size_t ni) {
    ENTER(fmi2GetEventIndicators, READABLE);
    NEED_SIZE(ni, c->model->n_guards, "event indicators");
    NEED(eventIndicators, ni);
    if (make_consistent(c) != RESULT_OK) return fmi2Error;
    get_indicators(c, eventIndicators);
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component component, fmi2Real x[], size_t nx) {
    ENTER(fmi2GetContinuousStates, READABLE);
    NEED_SIZE(nx, c->model->n_x, "continuous states");
    NEED(x, nx);
    if (make_consistent(c) != RESULT_OK) return fmi2Error;
    memcpy(x, c->x, nx * sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component component, fmi2Real x_nominal[], size_t nx) {
    ENTER(fmi2GetNominalsOfContinuousStates, ANY_PHASE);
    NEED_SIZE(nx, c->model->n_x, "continuous states");
    NEED(x_nominal, nx);
    memcpy(x_nominal, c->model->nominals, nx * sizeof(double));
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

fmi2Status fmi2GetRealOutputDerivatives(
    fmi2Component component, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[], fmi2Real value[]) {
    ENTER(fmi2GetRealOutputDerivatives, PHASE_STEP | PHASE_TERMINATED);
    NEED(vr, nvr);
    NEED(order, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++) {
        if (output_rate(c, vr[k], order[k], &value[k]) != RESULT_OK) return fmi2Error;
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
static fmi2Status no_status(Instance *c) {
    return status(report(c, LOG_WARNING, RESULT_DISCARD, "The last step was neither pending nor discarded."));
}

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
