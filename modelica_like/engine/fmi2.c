/* FMI 2.0: checks every call, then leaves the work to the run-time. What 3.0 has, too, stands in fmi.h. */
#include "fmi2Functions.h"

#define VERSION fmi2
#define FMUState FMUstate
#define Deserialize DeSerialize
#define SerializedSize SerializedFMUstateSize
#define GetNominals GetNominalsOfContinuousStates
#define INTEGER fmi2Integer
#include "fmi.h"

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
    if (functions == NULL || (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation)) return NULL;
    int own = functions->allocateMemory == NULL || functions->freeMemory == NULL;
    Instance bare = {.name = instanceName,
        .log_enabled = loggingOn,
        .co_simulation = fmuType == fmi2CoSimulation,
        .environment = functions->componentEnvironment,
        .logger = (AnyFunction)functions->logger,
        .log = functions->logger ? log_fmi2 : NULL,
        .allocate = own ? calloc : functions->allocateMemory,
        .release = own ? free : functions->freeMemory};
    return instance_open(bare, fmuGUID, fmuResourceLocation);
}

CALL(SetupExperiment, PHASE_INSTANTIATED, 1,
    set_experiment(c, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime), fmi2Boolean toleranceDefined,
    fmi2Real tolerance, fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime)
CHANGE_PHASE(EnterInitializationMode, PHASE_INSTANTIATED, PHASE_INITIALIZATION, 0, "")
CHANGE_PHASE(EnterEventMode, PHASE_CONTINUOUS | PHASE_EVENT, PHASE_EVENT, 0, "")

#define REFERENCES const fmi2ValueReference vr[], size_t nvr
#define VALUES(name, phases, type, call) EACH(name, phases, nvr, GIVEN(nvr, vr, value), call, REFERENCES, type value[])
#define NO_VALUES(name, phases, type, kind)                                                                  \
    CALL(name, phases, 1, nvr == 0 ? RESULT_OK : refuse(c, "This model has no variables of type " kind "."), \
        REFERENCES, type value[])

VALUES(GetReal, READABLE, fmi2Real, get_value(c, known_variable(c, vr[k], TYPE_FLOAT64), &value[k]))
VALUES(SetReal, SETTABLE, const fmi2Real, set_value(c, known_variable(c, vr[k], TYPE_FLOAT64), value[k]))
VALUES(GetInteger, READABLE, fmi2Integer, get_mode(c, vr[k], &value[k]))
VALUES(SetInteger, SETTABLE, const fmi2Integer, set_value(c, known_variable(c, vr[k], TYPE_ENUMERATION), value[k]))
NO_VALUES(GetBoolean, READABLE, fmi2Boolean, "Boolean")
NO_VALUES(SetBoolean, SETTABLE, const fmi2Boolean, "Boolean")
NO_VALUES(GetString, READABLE, fmi2String, "String")
NO_VALUES(SetString, SETTABLE, const fmi2String, "String")

CALL(GetDirectionalDerivative, READABLE, GIVEN(nUnknown, vUnknown_ref, dvUnknown) && GIVEN(nKnown, vKnown_ref, dvKnown),
    directional(c, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown),
    const fmi2ValueReference vUnknown_ref[], size_t nUnknown, const fmi2ValueReference vKnown_ref[], size_t nKnown,
    const fmi2Real dvKnown[], fmi2Real dvUnknown[])

fmi2Status fmi2NewDiscreteStates(fmi2Component instance, fmi2EventInfo *eventInfo) {
    double next;
    int restart;
    ENTER(NewDiscreteStates, PHASE_EVENT);
    NEED(1, eventInfo);
    if (!update_discrete(c, &restart, &next)) return failed(c);
    eventInfo->newDiscreteStatesNeeded = fmi2False;
    eventInfo->terminateSimulation = c->state.ended != 0;
    eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    eventInfo->valuesOfContinuousStatesChanged = restart;
    eventInfo->nextEventTimeDefined = isfinite(next);
    eventInfo->nextEventTime = isfinite(next) ? next : 0;
    return fmi2OK;
}

EACH(SetRealInputDerivatives, PHASE_INITIALIZATION | PHASE_STEP, nvr, GIVEN(nvr, vr, order, value),
    set_input_rate(c, vr[k], order[k], value[k]), REFERENCES, const fmi2Integer order[], const fmi2Real value[])
EACH(GetRealOutputDerivatives, PHASE_STEP | PHASE_TERMINATED, nvr, GIVEN(nvr, vr, order, value),
    output_rate(c, vr[k], order[k], &value[k]), REFERENCES, const fmi2Integer order[], fmi2Real value[])

fmi2Status fmi2DoStep(fmi2Component instance, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
    fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    double target;
    ENTER(DoStep, PHASE_STEP);
    if (!check_step(c, currentCommunicationPoint, communicationStepSize, &target)) return fmi2Error;
    if (integrate_to(c, target, 0) == FAILED) return failed(c);
    return c->state.ended ? fmi2Discard : fmi2OK;
}

DO(CancelStep, ANY_PHASE,
    refuse(c, "fmi2CancelStep: there is no step to cancel, as fmi2DoStep returns when its step is done."))

/* fmi2DoStep is never pending, and discarded only where a component has ended the run. */
#define GET_STATUS(name, type, told, answer)                                                                       \
    fmi2Status fmi2##name(fmi2Component instance, const fmi2StatusKind kind, type *value) {                        \
        ENTER(name, PHASE_STEP | PHASE_TERMINATED | PHASE_FAILED);                                                 \
        NEED(1, value);                                                                                            \
        *value = answer;                                                                                           \
        if (kind == (told)) return fmi2OK;                                                                         \
        return status(report(c, LOG_WARNING, RESULT_DISCARD, "The last step was neither pending nor discarded.")); \
    }
#define NEVER ((fmi2StatusKind)(-1))

GET_STATUS(GetStatus, fmi2Status, NEVER, fmi2OK)
GET_STATUS(GetRealStatus, fmi2Real, fmi2LastSuccessfulTime, c->state.t)
GET_STATUS(GetIntegerStatus, fmi2Integer, NEVER, 0)
GET_STATUS(GetBooleanStatus, fmi2Boolean, fmi2Terminated, c->state.ended != 0)
GET_STATUS(GetStringStatus, fmi2String, NEVER, "")
