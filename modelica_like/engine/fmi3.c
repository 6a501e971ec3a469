/* FMI 3.0: checks every call, then leaves the work to the run-time. What 2.0 has, too, stands in fmi.h. */
#include "fmi3Functions.h"

#define VERSION fmi3
#define SerializedSize SerializedFMUStateSize
#define GetDerivatives GetContinuousStateDerivatives
#define GetNominals GetNominalsOfContinuousStates
#define INTEGER fmi3Int64
#include "fmi.h"

static void log_fmi3(const Instance *c, int result, const char *category, const char *message) {
    ((fmi3LogMessageCallback)c->logger)(c->environment, status((Result)result), category, message);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage) {
    Instance bare = {.name = instanceName,
        .log_enabled = loggingOn,
        .allocate = calloc,
        .release = free,
        .environment = instanceEnvironment,
        .logger = (AnyFunction)logMessage,
        .log = logMessage ? log_fmi3 : NULL};
    return instance_open(bare, instantiationToken, resourcePath);
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
    if (logMessage != NULL)
        logMessage(instanceEnvironment, fmi3Error, "logStatusError", "This model has no scheduled execution.");
    return NULL;
}

CALL(EnterInitializationMode, PHASE_INSTANTIATED,
    set_experiment(c, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime),
    (c->state.phase = PHASE_INITIALIZATION, RESULT_OK), fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
    fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
CHANGE_PHASE(EnterConfigurationMode, PHASE_INSTANTIATED, PHASE_CONFIGURATION, 0, "")
CHANGE_PHASE(ExitConfigurationMode, PHASE_CONFIGURATION, PHASE_INSTANTIATED, 0, "")
CHANGE_PHASE(EnterEventMode, PHASE_CONTINUOUS | PHASE_STEP, PHASE_EVENT, c->co_simulation && !c->event_mode_used,
    ": this instance was made with eventModeUsed = false.")
CHANGE_PHASE(EnterStepMode, PHASE_EVENT, PHASE_STEP, !c->co_simulation, " belongs to Co-Simulation.")

/* Values of arrays lie one behind the other. */
static size_t elements(const Instance *c, fmi3ValueReference reference, fmi3ValueReference *first) {
    const Variable *v = find_variable(c->model, reference);
    int array = v != NULL && v->type == TYPE_ARRAY;
    *first = array ? (fmi3ValueReference)v->start : reference;
    return array ? (size_t)v->count : 1;
}

#define REFERENCES const fmi3ValueReference valueReferences[], size_t nValueReferences
#define VALUES(name, phases, type, done)                                                            \
    fmi3Status fmi3##name(fmi3Instance instance, REFERENCES, type values[], size_t nValues) {       \
        fmi3ValueReference r;                                                                       \
        size_t count = 0;                                                                           \
        ENTER(name, phases);                                                                        \
        NEED(nValueReferences, valueReferences);                                                    \
        for (size_t k = 0; k < nValueReferences; k++) count += elements(c, valueReferences[k], &r); \
        if (!SIZED(nValues, count, "values")) return fmi3Error;                                     \
        NEED(nValues, values);                                                                      \
        for (size_t k = 0; k < nValueReferences; k++)                                               \
            for (count = elements(c, valueReferences[k], &r); count > 0; count--, r++, values++)    \
                if (!(done)) return fmi3Error;                                                      \
        return fmi3OK;                                                                              \
    }

VALUES(GetFloat64, READABLE, fmi3Float64, get_value(c, known_variable(c, r, TYPE_FLOAT64), values))
VALUES(SetFloat64, SETTABLE, const fmi3Float64, set_value(c, known_variable(c, r, TYPE_FLOAT64), *values))
VALUES(GetInt64, READABLE, fmi3Int64, get_mode(c, r, values))
VALUES(SetInt64, SETTABLE, const fmi3Int64, set_value(c, known_variable(c, r, TYPE_ENUMERATION), (double)*values))

/* Functions for what no model has: other types, clocks, parts. They refuse every call that asks for something. */
#define NOTHING(name, phases, what, ...)                                                                            \
    CALL(name, phases, 1, nValueReferences == 0 ? RESULT_OK : refuse(c, "This model has no " what "."), REFERENCES, \
        __VA_ARGS__)
#define NO_VALUES(type)                                                                \
    NOTHING(Get##type, READABLE, "variables of type " #type, fmi3##type a[], size_t n) \
    NOTHING(Set##type, SETTABLE, "variables of type " #type, const fmi3##type a[], size_t n)
#define NO_CLOCK(name, ...) NOTHING(name, ANY_PHASE, "clocks", __VA_ARGS__)

NO_VALUES(Float32)
NO_VALUES(Int8)
NO_VALUES(UInt8)
NO_VALUES(Int16)
NO_VALUES(UInt16)
NO_VALUES(Int32)
NO_VALUES(UInt32)
NO_VALUES(UInt64)
NO_VALUES(Boolean)
NO_VALUES(String)
NOTHING(GetBinary, READABLE, "variables of type Binary", size_t s[], fmi3Binary a[], size_t n)
NOTHING(SetBinary, SETTABLE, "variables of type Binary", const size_t s[], const fmi3Binary a[], size_t n)
NO_CLOCK(GetClock, fmi3Clock a[])
NO_CLOCK(SetClock, const fmi3Clock a[])
NO_CLOCK(GetShiftDecimal, fmi3Float64 a[])
NO_CLOCK(SetShiftDecimal, const fmi3Float64 a[])
NO_CLOCK(SetIntervalDecimal, const fmi3Float64 a[])
NO_CLOCK(GetIntervalDecimal, fmi3Float64 a[], fmi3IntervalQualifier q[])
NO_CLOCK(GetShiftFraction, fmi3UInt64 a[], fmi3UInt64 b[])
NO_CLOCK(SetShiftFraction, const fmi3UInt64 a[], const fmi3UInt64 b[])
NO_CLOCK(SetIntervalFraction, const fmi3UInt64 a[], const fmi3UInt64 b[])
NO_CLOCK(GetIntervalFraction, fmi3UInt64 a[], fmi3UInt64 b[], fmi3IntervalQualifier q[])

/* Dependencies stand in the description, which does not announce these (providesPerElementDependencies). */
#define REFUSED(name, why, ...) CALL(name, ANY_PHASE, 1, refuse(c, why), __VA_ARGS__)
REFUSED(ActivateModelPartition, "This model has no scheduled execution.", fmi3ValueReference r, fmi3Float64 t)
#define SEE_DESCRIPTION "The model description lists the dependencies of variables."
REFUSED(GetNumberOfVariableDependencies, SEE_DESCRIPTION, fmi3ValueReference v, size_t *n)
REFUSED(GetVariableDependencies, SEE_DESCRIPTION, fmi3ValueReference v, size_t a[], fmi3ValueReference r[], size_t b[],
    fmi3DependencyKind d[], size_t n)

#define DERIVATIVES                                                                                           \
    const fmi3ValueReference unknowns[], size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns, \
        const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity
CALL(GetDirectionalDerivative, READABLE,
    SIZED(nSeed, nKnowns, "seeds, one per known") && GIVEN(nKnowns, knowns, seed) &&
        SIZED(nSensitivity, nUnknowns, "sensitivities, one per unknown") && GIVEN(nUnknowns, unknowns, sensitivity),
    directional(c, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity), DERIVATIVES)
CALL(GetAdjointDerivative, PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_TERMINATED,
    SIZED(nSeed, nUnknowns, "seeds, one per unknown") && GIVEN(nUnknowns, unknowns, seed) &&
        SIZED(nSensitivity, nKnowns, "sensitivities, one per known") && GIVEN(nKnowns, knowns, sensitivity),
    adjoint(c, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity), DERIVATIVES)

DO(EvaluateDiscreteStates, PHASE_INITIALIZATION | PHASE_EVENT, make_consistent(c))

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    double next;
    int restart;
    ENTER(UpdateDiscreteStates, PHASE_EVENT);
    NEED(1, discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
        valuesOfContinuousStatesChanged, nextEventTimeDefined, nextEventTime);
    if (!update_discrete(c, &restart, &next)) return failed(c);
    *discreteStatesNeedUpdate = *nominalsOfContinuousStatesChanged = fmi3False;
    *terminateSimulation = c->state.ended != 0;
    *valuesOfContinuousStatesChanged = restart != 0;
    *nextEventTimeDefined = isfinite(next);
    *nextEventTime = isfinite(next) ? next : 0;
    return fmi3OK;
}

#define COUNT(name, count) CALL(name, ANY_PHASE, GIVEN(1, n), (*n = (size_t)(count), RESULT_OK), size_t *n)
COUNT(GetNumberOfEventIndicators, c->model->n_guards)
COUNT(GetNumberOfContinuousStates, c->model->n_x)

EACH(GetOutputDerivatives, PHASE_STEP | PHASE_TERMINATED, n, SIZED(n, nVr, "values") && GIVEN(n, vr, orders, values),
    output_rate(c, vr[k], orders[k], &values[k]), const fmi3ValueReference vr[], size_t nVr, const fmi3Int32 orders[],
    fmi3Float64 values[], size_t n)

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
    fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
    fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    double target;
    ENTER(DoStep, PHASE_STEP);
    NEED(1, eventHandlingNeeded, terminateSimulation, earlyReturn, lastSuccessfulTime);
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = c->state.t;
    if (!check_step(c, currentCommunicationPoint, communicationStepSize, &target)) return fmi3Error;
    Arrival arrival = integrate_to(c, target, c->event_mode_used && c->early_return_allowed);
    *lastSuccessfulTime = c->state.t;
    *eventHandlingNeeded = arrival == AT_EVENT;
    *terminateSimulation = c->state.ended != 0;
    *earlyReturn = c->state.t < target && c->early_return_allowed; /* where it is not, the end of the run is told */
    return arrival == FAILED ? failed(c) : fmi3OK;
}
