/* FMI 3.0, life of an instance and its steps: checks every call, then leaves the work to the run-time. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi3.h"

static fmi3Status failed(Instance *c) {
    c->state.phase = PHASE_FAILED;
    return fmi3Error;
}

static void log_fmi3(const Instance *c, int result, const char *category, const char *message) {
    ((fmi3LogMessageCallback)c->logger)(c->environment, status((Result)result), category, message);
}

/* ---- life of an instance ---------------------------------------------------------------------------------------- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage) {
    (void)visible;
    return instance_open(resourcePath, instanceName, instantiationToken, calloc, free, logMessage ? log_fmi3 : NULL,
        (AnyFunction)logMessage, instanceEnvironment, loggingOn);
}

/* Tells the importer that an internal step is done; returns until when it wants to go on. */
static double step_finished(Instance *c) {
    fmi3Boolean early = fmi3False;
    fmi3Float64 time = c->state.t;
    ((fmi3IntermediateUpdateCallback)c->intermediate_update)(c->environment, c->state.t, c->inputs_move != 0, fmi3True,
        fmi3True, c->early_return_allowed != 0, &early, &time);
    return early && c->early_return_allowed && isfinite(time) ? time : INFINITY;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    Instance *c = fmi3InstantiateModelExchange(
        instanceName, instantiationToken, resourcePath, visible, loggingOn, instanceEnvironment, logMessage);
    if (c == NULL) return NULL;
    for (size_t k = 0; requiredIntermediateVariables != NULL && k < nRequiredIntermediateVariables; k++) {
        const Variable *v = find_variable(c->model, requiredIntermediateVariables[k]);
        c->inputs_move |= v != NULL && v->kind == KIND_INPUT;
    }
    c->co_simulation = 1;
    c->event_mode_used = eventModeUsed;
    c->early_return_allowed = earlyReturnAllowed;
    c->intermediate_update = (AnyFunction)intermediateUpdate;
    c->step_finished = intermediateUpdate ? step_finished : NULL;
    return c;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
    fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn, (void)clockUpdate,
        (void)lockPreemption, (void)unlockPreemption;
    (void)instanceName;
    if (logMessage != NULL)
        logMessage(instanceEnvironment, fmi3Error, "logStatusError", "This model has no scheduled execution.");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) {
    if (instance != NULL) instance_free(instance);
}

fmi3Status fmi3SetDebugLogging(
    fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[]) {
    Result result = RESULT_OK;
    ENTER(fmi3SetDebugLogging, ANY_PHASE);
    NEED(categories, nCategories);
    if (nCategories == 0) result = set_log_category(c, NULL, loggingOn);
    for (size_t k = 0; k < nCategories; k++)
        if (set_log_category(c, categories[k], loggingOn) != RESULT_OK) result = RESULT_ERROR;
    return status(result);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
    fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    ENTER(fmi3EnterInitializationMode, PHASE_INSTANTIATED);
    if (set_experiment(c, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime) != RESULT_OK)
        return fmi3Error;
    c->state.phase = PHASE_INITIALIZATION;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    ENTER(fmi3ExitInitializationMode, PHASE_INITIALIZATION);
    if (!c->state.solved && start_solve(c) != RESULT_OK) return failed(c);
    c->state.inputs_changed = 0;
    c->state.phase = c->co_simulation && !c->event_mode_used ? PHASE_STEP : PHASE_EVENT;
    if (c->state.phase == PHASE_STEP && handle_event(c) != RESULT_OK) return failed(c);
    return fmi3OK;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    ENTER(fmi3EnterConfigurationMode, PHASE_INSTANTIATED);
    c->state.phase = PHASE_CONFIGURATION;
    return fmi3OK;
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    ENTER(fmi3ExitConfigurationMode, PHASE_CONFIGURATION);
    c->state.phase = PHASE_INSTANTIATED;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    ENTER(fmi3Terminate, PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_FAILED);
    c->state.phase = PHASE_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    ENTER(fmi3Reset, ANY_PHASE);
    instance_reset(c);
    return fmi3OK;
}

/* ---- events ----------------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    ENTER(fmi3EnterEventMode, PHASE_CONTINUOUS | PHASE_STEP);
    if (c->co_simulation && !c->event_mode_used)
        return refuse(c, "fmi3EnterEventMode: this instance was made with eventModeUsed = false.");
    c->state.phase = PHASE_EVENT;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    ENTER(fmi3EvaluateDiscreteStates, PHASE_INITIALIZATION | PHASE_EVENT);
    return status(make_consistent(c));
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    double next;
    int restart;
    ENTER(fmi3UpdateDiscreteStates, PHASE_EVENT);
    NEED(discreteStatesNeedUpdate, 1);
    NEED(terminateSimulation, 1);
    NEED(nominalsOfContinuousStatesChanged, 1);
    NEED(valuesOfContinuousStatesChanged, 1);
    NEED(nextEventTimeDefined, 1);
    NEED(nextEventTime, 1);
    if (update_discrete(c, &restart, &next) != RESULT_OK) return failed(c);
    *discreteStatesNeedUpdate = *terminateSimulation = *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = restart != 0;
    *nextEventTimeDefined = isfinite(next);
    *nextEventTime = isfinite(next) ? next : 0;
    return fmi3OK;
}

/* ---- Model Exchange --------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    ENTER(fmi3EnterContinuousTimeMode, PHASE_EVENT);
    if (c->co_simulation) return refuse(c, "fmi3EnterContinuousTimeMode belongs to Model Exchange.");
    c->state.phase = PHASE_CONTINUOUS;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
    fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    ENTER(fmi3CompletedIntegratorStep, PHASE_CONTINUOUS);
    (void)noSetFMUStatePriorToCurrentPoint;
    NEED(enterEventMode, 1);
    NEED(terminateSimulation, 1);
    if (settle(c) != RESULT_OK) return fmi3Error;
    *enterEventMode = find_wanting(c, nothing_wanting(c), 1) != 0;
    *terminateSimulation = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    ENTER(fmi3SetTime, PHASE_EVENT | PHASE_CONTINUOUS);
    return status(set_time(c, time));
}

fmi3Status fmi3SetContinuousStates(
    fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates) {
    ENTER(fmi3SetContinuousStates, PHASE_EVENT | PHASE_CONTINUOUS);
    NEED_SIZE(nContinuousStates, c->model->n_x, "continuous states");
    NEED(continuousStates, nContinuousStates);
    return status(set_states(c, continuousStates));
}

#define GET_ALL(name, phases, count, what, action)                           \
    fmi3Status name(fmi3Instance instance, fmi3Float64 values[], size_t n) { \
        ENTER(name, phases);                                                 \
        NEED_SIZE(n, count, what);                                           \
        NEED(values, n);                                                     \
        if (make_consistent(c) != RESULT_OK) return fmi3Error;               \
        action;                                                              \
        return fmi3OK;                                                       \
    }

GET_ALL(fmi3GetContinuousStateDerivatives, READABLE, c->model->n_x, "continuous states", get_derivatives(c, values))
GET_ALL(fmi3GetEventIndicators, READABLE, c->model->n_guards, "event indicators", get_indicators(c, values))
GET_ALL(fmi3GetContinuousStates, READABLE, c->model->n_x, "continuous states",
    memcpy(values, c->x, c->model->n_x * sizeof(double)))
GET_ALL(fmi3GetNominalsOfContinuousStates, READABLE, c->model->n_x, "continuous states",
    memcpy(values, c->model->nominals, c->model->n_x * sizeof(double)))

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    ENTER(fmi3GetNumberOfEventIndicators, ANY_PHASE);
    NEED(nEventIndicators, 1);
    *nEventIndicators = c->model->n_guards;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    ENTER(fmi3GetNumberOfContinuousStates, ANY_PHASE);
    NEED(nContinuousStates, 1);
    *nContinuousStates = c->model->n_x;
    return fmi3OK;
}

/* ---- Co-Simulation ---------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    ENTER(fmi3EnterStepMode, PHASE_EVENT);
    if (!c->co_simulation) return refuse(c, "fmi3EnterStepMode belongs to Co-Simulation.");
    c->state.phase = PHASE_STEP;
    return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues) {
    ENTER(fmi3GetOutputDerivatives, PHASE_STEP | PHASE_TERMINATED);
    NEED_SIZE(nValues, nValueReferences, "values");
    NEED(valueReferences, nValues);
    NEED(orders, nValues);
    NEED(values, nValues);
    for (size_t k = 0; k < nValues; k++) {
        if (output_rate(c, valueReferences[k], orders[k], &values[k]) != RESULT_OK) return fmi3Error;
    }
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
    fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
    fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    double target;
    Arrival arrival;
    ENTER(fmi3DoStep, PHASE_STEP);
    (void)noSetFMUStatePriorToCurrentPoint;
    NEED(eventHandlingNeeded, 1);
    NEED(terminateSimulation, 1);
    NEED(earlyReturn, 1);
    NEED(lastSuccessfulTime, 1);
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = c->state.t;
    if (check_step(c, currentCommunicationPoint, communicationStepSize, &target) != RESULT_OK) return fmi3Error;
    arrival = integrate_to(c, target, c->event_mode_used && c->early_return_allowed);
    *lastSuccessfulTime = c->state.t;
    *eventHandlingNeeded = arrival == AT_EVENT;
    *earlyReturn = c->state.t < target;
    return arrival == FAILED ? failed(c) : fmi3OK;
}
