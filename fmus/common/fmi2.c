/* FMI 2.0 of a reference model: Co-Simulation, and Model Exchange where it has states. */
#include "fmi2Functions.h"
#include "instance.h"

#define EXPORT FMI2_Export
#define STATUS(done) ((done) ? fmi2OK : fmi2Error)
typedef fmi2ValueReference Ref;

EXPORT const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
EXPORT const char *fmi2GetVersion(void) { return fmi2Version; }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    UNUSED(on), UNUSED(n), UNUSED(categories);
    return STATUS(c);
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
    const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    UNUSED(resources), UNUSED(functions), UNUSED(visible), UNUSED(logging);
    return type == fmi2ModelExchange && !STATES ? NULL : new_model(name, token);
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real start,
    fmi2Boolean stopDefined, fmi2Real stop) {
    UNUSED(toleranceDefined), UNUSED(tolerance), UNUSED(stopDefined), UNUSED(stop);
    return STATUS(set_time(c, start));
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return STATUS(c && initialize(c, ((Model *)c)->time));
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return STATUS(begin_running(c)); }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { return STATUS(c); }

EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    if (c) set_defaults(c);
    return STATUS(c);
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const Ref vr[], size_t n, fmi2Real value[]) {
    return STATUS(get_reals(c, vr, n, value));
}

EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const Ref vr[], size_t n, fmi2Integer value[]) {
    for (size_t k = 0; k < n; k++) {
        int64_t wide;
        if (!value || !vr || !get_integers(c, vr + k, 1, &wide)) return fmi2Error;
        value[k] = (fmi2Integer)wide;
    }
    return STATUS(c);
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const Ref vr[], size_t n, const fmi2Real value[]) {
    return STATUS(set_reals(c, vr, n, value));
}

/* Types that no reference model has: only empty lists make sense. */
#define ABSENT(name, value_type)                                                            \
    EXPORT fmi2Status name(fmi2Component c, const Ref vr[], size_t n, value_type value[]) { \
        UNUSED(vr), UNUSED(value);                                                          \
        return STATUS(c && !n);                                                             \
    }
ABSENT(fmi2GetBoolean, fmi2Boolean)
ABSENT(fmi2GetString, fmi2String)
ABSENT(fmi2SetInteger, const fmi2Integer)
ABSENT(fmi2SetBoolean, const fmi2Boolean)
ABSENT(fmi2SetString, const fmi2String)

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return STATUS(save(c, state)); }
EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return STATUS(restore(c, state)); }
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { return STATUS(c && drop(state)); }

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    if (size) *size = sizeof(Model);
    return STATUS(c && state && size);
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    return STATUS(c && size == sizeof(Model) && restore(bytes, state));
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    return STATUS(c && size == sizeof(Model) && save(bytes, state));
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const Ref z[], size_t nz, const Ref v[], size_t nv, const fmi2Real dv[], fmi2Real dz[]) {
    UNUSED(c), UNUSED(z), UNUSED(nz), UNUSED(v), UNUSED(nv), UNUSED(dv), UNUSED(dz);
    return fmi2Error;
}

/* Co-Simulation */

#define NO_DERIVATIVES(name, value_type)                                                                               \
    EXPORT fmi2Status name(fmi2Component c, const Ref vr[], size_t n, const fmi2Integer order[], value_type value[]) { \
        UNUSED(vr), UNUSED(order), UNUSED(value);                                                                      \
        return STATUS(c && !n);                                                                                        \
    }
NO_DERIVATIVES(fmi2SetRealInputDerivatives, const fmi2Real)
NO_DERIVATIVES(fmi2GetRealOutputDerivatives, fmi2Real)

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real from, fmi2Real step, fmi2Boolean noRollback) {
    UNUSED(noRollback);
    return STATUS(advance(c, from, step));
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
    UNUSED(c);
    return fmi2Error;
}

#define NO_STATUS(name, type)                                                         \
    EXPORT fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value) { \
        UNUSED(c), UNUSED(kind), UNUSED(value);                                       \
        return fmi2Discard;                                                           \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetRealStatus, fmi2Real)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)

/* Model Exchange */

EXPORT fmi2Status fmi2EnterEventMode(fmi2Component c) { return STATUS(c); }
EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return STATUS(c); }

EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    if (!c || !info) return fmi2Error;
    memset(info, 0, sizeof *info);
    if (STATES) info->valuesOfContinuousStatesChanged = model_update(c) ? fmi2True : fmi2False;
    return fmi2OK;
}

EXPORT fmi2Status fmi2CompletedIntegratorStep(
    fmi2Component c, fmi2Boolean noRollback, fmi2Boolean *enterEventMode, fmi2Boolean *terminate) {
    UNUSED(noRollback);
    if (!c || !enterEventMode || !terminate) return fmi2Error;
    *enterEventMode = *terminate = fmi2False;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { return STATUS(set_time(c, time)); }

EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    return STATUS(set_states(c, x, n));
}

EXPORT fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    return STATUS(get_block(c, dx, n, STATES, FIRST_DERIVATIVE));
}

EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    return STATUS(get_block(c, z, n, INDICATORS, FIRST_INDICATOR));
}

EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    return STATUS(get_block(c, x, n, STATES, FIRST_STATE));
}

EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominal[], size_t n) {
    return STATUS(get_nominals(c, nominal, n));
}
