/* FMI 3.0, values, derivatives and copies of the state: checks every call, then leaves the work to the run-time. */
#include "fmi3.h"

/* ---- values ----------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Float64 values[], size_t nValues) {
    ENTER(fmi3GetFloat64, READABLE);
    NEED_SIZE(nValues, nValueReferences, "values");
    NEED(valueReferences, nValues);
    NEED(values, nValues);
    for (size_t k = 0; k < nValues; k++)
        if (get_float(c, valueReferences[k], &values[k]) != RESULT_OK) return fmi3Error;
    return fmi3OK;
}

fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Int64 values[], size_t nValues) {
    ENTER(fmi3GetInt64, READABLE);
    NEED_SIZE(nValues, nValueReferences, "values");
    NEED(valueReferences, nValues);
    NEED(values, nValues);
    for (size_t k = 0; k < nValues; k++) {
        int mode;
        if (get_mode(c, valueReferences[k], &mode) != RESULT_OK) return fmi3Error;
        values[k] = mode;
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Float64 values[], size_t nValues) {
    ENTER(fmi3SetFloat64, SETTABLE);
    NEED_SIZE(nValues, nValueReferences, "values");
    NEED(valueReferences, nValues);
    NEED(values, nValues);
    for (size_t k = 0; k < nValues; k++)
        if (set_float(c, valueReferences[k], values[k]) != RESULT_OK) return fmi3Error;
    return fmi3OK;
}

fmi3Status fmi3SetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Int64 values[], size_t nValues) {
    ENTER(fmi3SetInt64, SETTABLE);
    NEED_SIZE(nValues, nValueReferences, "values");
    NEED(valueReferences, nValues);
    NEED(values, nValues);
    for (size_t k = 0; k < nValues; k++)
        if (set_mode(c, valueReferences[k], values[k]) != RESULT_OK) return fmi3Error;
    return fmi3OK;
}

/* ---- dependencies and derivatives ------------------------------------------------------------------------------- */

fmi3Status fmi3GetNumberOfVariableDependencies(
    fmi3Instance instance, fmi3ValueReference valueReference, size_t *nDependencies) {
    Result result;
    ENTER(fmi3GetNumberOfVariableDependencies, ANY_PHASE);
    NEED(nDependencies, 1);
    *nDependencies = dependencies(c, valueReference, NULL, 0, &result);
    return status(result);
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
    size_t elementIndicesOfDependent[], fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
    fmi3DependencyKind dependencyKinds[], size_t nDependencies) {
    Result result;
    size_t count;
    ENTER(fmi3GetVariableDependencies, ANY_PHASE);
    NEED(elementIndicesOfDependent, nDependencies);
    NEED(independents, nDependencies);
    NEED(elementIndicesOfIndependents, nDependencies);
    NEED(dependencyKinds, nDependencies);
    count = dependencies(c, dependent, independents, nDependencies, &result);
    if (result != RESULT_OK) return fmi3Error;
    NEED_SIZE(nDependencies, count, "dependencies");
    for (size_t k = 0; k < count; k++) {
        elementIndicesOfDependent[k] = elementIndicesOfIndependents[k] = 0; /* 0: the whole variable */
        dependencyKinds[k] = fmi3Dependent;
    }
    return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
    fmi3Float64 sensitivity[], size_t nSensitivity) {
    ENTER(fmi3GetDirectionalDerivative, READABLE);
    NEED_SIZE(nSeed, nKnowns, "seeds, one per known");
    NEED_SIZE(nSensitivity, nUnknowns, "sensitivities, one per unknown");
    NEED(unknowns, nUnknowns);
    NEED(knowns, nKnowns);
    NEED(seed, nSeed);
    NEED(sensitivity, nSensitivity);
    return status(directional(c, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity));
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
    fmi3Float64 sensitivity[], size_t nSensitivity) {
    ENTER(fmi3GetAdjointDerivative, PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP | PHASE_TERMINATED);
    NEED_SIZE(nSeed, nUnknowns, "seeds, one per unknown");
    NEED_SIZE(nSensitivity, nKnowns, "sensitivities, one per known");
    NEED(unknowns, nUnknowns);
    NEED(knowns, nKnowns);
    NEED(seed, nSeed);
    NEED(sensitivity, nSensitivity);
    return status(adjoint(c, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity));
}

/* ---- copies of the state ---------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    ENTER(fmi3GetFMUState, ANY_PHASE);
    NEED(FMUState, 1);
    return status(state_copy_out(c, FMUState));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    ENTER(fmi3SetFMUState, ANY_PHASE);
    NEED(FMUState, 1);
    return status(state_copy_in(c, FMUState));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    ENTER(fmi3FreeFMUState, ANY_PHASE);
    if (FMUState != NULL) state_release(c, FMUState);
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    ENTER(fmi3SerializedFMUStateSize, ANY_PHASE);
    NEED(FMUState, 1);
    NEED(size, 1);
    *size = state_size(c);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(
    fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size) {
    ENTER(fmi3SerializeFMUState, ANY_PHASE);
    NEED(FMUState, 1);
    NEED(serializedState, 1);
    return status(state_write(c, FMUState, serializedState, size));
}

fmi3Status fmi3DeserializeFMUState(
    fmi3Instance instance, const fmi3Byte serializedState[], size_t size, fmi3FMUState *FMUState) {
    ENTER(fmi3DeserializeFMUState, ANY_PHASE);
    NEED(FMUState, 1);
    NEED(serializedState, 1);
    return status(state_read(c, serializedState, size, FMUState));
}
