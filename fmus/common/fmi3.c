/* FMI 3.0 of a reference model: Co-Simulation, and Model Exchange where it has states. */
#include "fmi3Functions.h"
#include "instance.h"

#define EXPORT FMI3_Export
#define STATUS(done) ((done) ? fmi3OK : fmi3Error)
typedef fmi3ValueReference Ref;

EXPORT const char *fmi3GetVersion(void) { return fmi3Version; }

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    UNUSED(on), UNUSED(n), UNUSED(categories);
    return STATUS(c);
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    UNUSED(resources), UNUSED(visible), UNUSED(logging), UNUSED(environment), UNUSED(log);
    return STATES ? new_model(name, token) : NULL;
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
    const Ref intermediate[], size_t n, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update) {
    UNUSED(resources), UNUSED(visible), UNUSED(logging), UNUSED(eventModeUsed), UNUSED(earlyReturnAllowed);
    UNUSED(intermediate), UNUSED(n), UNUSED(environment), UNUSED(log), UNUSED(update);
    return new_model(name, token);
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    UNUSED(name), UNUSED(token), UNUSED(resources), UNUSED(visible), UNUSED(logging), UNUSED(environment);
    UNUSED(log), UNUSED(clock), UNUSED(lock), UNUSED(unlock);
    return NULL;
}

EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
    fmi3Float64 start, fmi3Boolean stopDefined, fmi3Float64 stop) {
    UNUSED(toleranceDefined), UNUSED(tolerance), UNUSED(stopDefined), UNUSED(stop);
    return STATUS(initialize(c, start));
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return STATUS(begin_running(c)); }
EXPORT fmi3Status fmi3Terminate(fmi3Instance c) { return STATUS(c); }
EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c) { return STATUS(c); }

EXPORT fmi3Status fmi3Reset(fmi3Instance c) {
    if (c) set_defaults(c);
    return STATUS(c);
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const Ref vr[], size_t n, fmi3Float64 value[], size_t m) {
    return STATUS(n == m && get_reals(c, vr, n, value));
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const Ref vr[], size_t n, const fmi3Float64 value[], size_t m) {
    return STATUS(n == m && set_reals(c, vr, n, value));
}

EXPORT fmi3Status fmi3GetInt64(fmi3Instance c, const Ref vr[], size_t n, fmi3Int64 value[], size_t m) {
    return STATUS(n == m && get_integers(c, vr, n, value));
}

/* Types that no reference model has: only empty lists make sense. */
#define ABSENT(name, value_type)                                                                     \
    EXPORT fmi3Status name(fmi3Instance c, const Ref vr[], size_t n, value_type value[], size_t m) { \
        UNUSED(vr), UNUSED(value);                                                                   \
        return STATUS(c && !n && !m);                                                                \
    }
#define ABSENT_TYPE(type) ABSENT(fmi3Get##type, fmi3##type) ABSENT(fmi3Set##type, const fmi3##type)
ABSENT_TYPE(Float32)
ABSENT_TYPE(Int8)
ABSENT_TYPE(UInt8)
ABSENT_TYPE(Int16)
ABSENT_TYPE(UInt16)
ABSENT_TYPE(Int32)
ABSENT_TYPE(UInt32)
ABSENT_TYPE(UInt64)
ABSENT_TYPE(Boolean)
ABSENT_TYPE(String)
ABSENT(fmi3SetInt64, const fmi3Int64)

EXPORT fmi3Status fmi3GetBinary(
    fmi3Instance c, const Ref vr[], size_t n, size_t sizes[], fmi3Binary value[], size_t m) {
    UNUSED(vr), UNUSED(sizes), UNUSED(value);
    return STATUS(c && !n && !m);
}

EXPORT fmi3Status fmi3SetBinary(
    fmi3Instance c, const Ref vr[], size_t n, const size_t sizes[], const fmi3Binary value[], size_t m) {
    UNUSED(vr), UNUSED(sizes), UNUSED(value);
    return STATUS(c && !n && !m);
}

/* Clocks, and what else no reference model has. */
#define REFUSED(name, ...)                                \
    EXPORT fmi3Status name(fmi3Instance c, __VA_ARGS__) { \
        UNUSED(c);                                        \
        return fmi3Error;                                 \
    }
REFUSED(fmi3GetClock, const Ref vr[], size_t n, fmi3Clock value[])
REFUSED(fmi3SetClock, const Ref vr[], size_t n, const fmi3Clock value[])
REFUSED(fmi3GetNumberOfVariableDependencies, Ref vr, size_t *n)
REFUSED(fmi3GetVariableDependencies, Ref vr, size_t elements[], Ref independents[], size_t others[],
    fmi3DependencyKind kinds[], size_t n)
REFUSED(fmi3GetDirectionalDerivative, const Ref z[], size_t nz, const Ref v[], size_t nv, const fmi3Float64 seed[],
    size_t ns, fmi3Float64 result[], size_t nr)
REFUSED(fmi3GetAdjointDerivative, const Ref z[], size_t nz, const Ref v[], size_t nv, const fmi3Float64 seed[],
    size_t ns, fmi3Float64 result[], size_t nr)
REFUSED(fmi3GetIntervalDecimal, const Ref vr[], size_t n, fmi3Float64 value[], fmi3IntervalQualifier qualifiers[])
REFUSED(fmi3GetIntervalFraction, const Ref vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
    fmi3IntervalQualifier qualifiers[])
REFUSED(fmi3GetShiftDecimal, const Ref vr[], size_t n, fmi3Float64 value[])
REFUSED(fmi3GetShiftFraction, const Ref vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
REFUSED(fmi3SetIntervalDecimal, const Ref vr[], size_t n, const fmi3Float64 value[])
REFUSED(fmi3SetIntervalFraction, const Ref vr[], size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSED(fmi3SetShiftDecimal, const Ref vr[], size_t n, const fmi3Float64 value[])
REFUSED(fmi3SetShiftFraction, const Ref vr[], size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSED(fmi3ActivateModelPartition, Ref clock, fmi3Float64 time)

EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return STATUS(c); }
EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { return STATUS(c); }
EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) { return STATUS(c); }

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) { return STATUS(save(c, state)); }
EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { return STATUS(restore(c, state)); }
EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) { return STATUS(c && drop(state)); }

EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    if (size) *size = sizeof(Model);
    return STATUS(c && state && size);
}

EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    return STATUS(c && size == sizeof(Model) && restore(bytes, state));
}

EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    return STATUS(c && size == sizeof(Model) && save(bytes, state));
}

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
    fmi3Boolean *nominals, fmi3Boolean *states, fmi3Boolean *timeDefined, fmi3Float64 *time) {
    if (!c || !again || !terminate || !nominals || !states || !timeDefined || !time) return fmi3Error;
    *again = *terminate = *nominals = *timeDefined = fmi3False;
    *time = 0;
    *states = STATES && model_update(c);
    return fmi3OK;
}

/* Model Exchange */

EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return STATUS(c); }

EXPORT fmi3Status fmi3CompletedIntegratorStep(
    fmi3Instance c, fmi3Boolean noRollback, fmi3Boolean *enterEventMode, fmi3Boolean *terminate) {
    UNUSED(noRollback);
    if (!c || !enterEventMode || !terminate) return fmi3Error;
    *enterEventMode = *terminate = fmi3False;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) { return STATUS(set_time(c, time)); }

EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    return STATUS(set_states(c, x, n));
}

EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
    return STATUS(get_block(c, dx, n, STATES, FIRST_DERIVATIVE));
}

EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) {
    return STATUS(get_block(c, z, n, INDICATORS, FIRST_INDICATOR));
}

EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    return STATUS(get_block(c, x, n, STATES, FIRST_STATE));
}

EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominal[], size_t n) {
    return STATUS(get_nominals(c, nominal, n));
}

EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
    if (n) *n = INDICATORS;
    return STATUS(c && n);
}

EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
    if (n) *n = STATES;
    return STATUS(c && n);
}

/* Co-Simulation */

EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c) { return STATUS(c); }

EXPORT fmi3Status fmi3GetOutputDerivatives(
    fmi3Instance c, const Ref vr[], size_t n, const fmi3Int32 orders[], fmi3Float64 value[], size_t m) {
    UNUSED(vr), UNUSED(orders), UNUSED(value);
    return STATUS(c && !n && !m);
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 from, fmi3Float64 step, fmi3Boolean noRollback,
    fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    UNUSED(noRollback);
    if (!event || !terminate || !early || !reached || !advance(c, from, step)) return fmi3Error;
    *event = *terminate = *early = fmi3False;
    *reached = ((Model *)c)->time;
    return fmi3OK;
}
