/* FMI 2.0, values, derivatives and copies of the state: checks every call, then leaves the work to the run-time. */
#include "fmi2.h"

/* ---- values ----------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    ENTER(fmi2GetReal, READABLE);
    NEED(vr, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++)
        if (get_float(c, vr[k], &value[k]) != RESULT_OK) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component component, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    ENTER(fmi2GetInteger, READABLE);
    NEED(vr, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++)
        if (get_mode(c, vr[k], &value[k]) != RESULT_OK) return fmi2Error;
    return fmi2OK;
}

static fmi2Status no_such_type(Instance *c, size_t nvr, const char *type) {
    return nvr == 0 ? fmi2OK
                    : status(report(c, LOG_ERROR, RESULT_ERROR, "This model has no variables of type %s.", type));
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
    for (size_t k = 0; k < nvr; k++)
        if (set_float(c, vr[k], value[k]) != RESULT_OK) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2SetInteger(
    fmi2Component component, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    ENTER(fmi2SetInteger, SETTABLE);
    NEED(vr, nvr);
    NEED(value, nvr);
    for (size_t k = 0; k < nvr; k++)
        if (set_mode(c, vr[k], value[k]) != RESULT_OK) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(
    fmi2Component component, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
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
    size_t nUnknown, const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
    fmi2Real dvUnknown[]) {
    ENTER(fmi2GetDirectionalDerivative, READABLE);
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
    *size = state_size(c);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(
    fmi2Component component, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    ENTER(fmi2SerializeFMUstate, ANY_PHASE);
    NEED(FMUstate, 1);
    NEED(serializedState, 1);
    return status(state_write(c, FMUstate, (unsigned char *)serializedState, size));
}

fmi2Status fmi2DeSerializeFMUstate(
    fmi2Component component, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate) {
    ENTER(fmi2DeSerializeFMUstate, ANY_PHASE);
    NEED(FMUstate, 1);
    NEED(serializedState, 1);
    return status(state_read(c, (const unsigned char *)serializedState, size, FMUstate));
}
