/* Runs under AddressSanitizer and UBSan: a whole run, wrong calls of every kind, and many instances. Prints the log,
 * exits with 1 if a call was answered wrongly. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "core.h"
#include "fmi3Functions.h"

#define EXPECT(what, call)                                         \
    do {                                                           \
        int got = (int)(call);                                     \
        if (got != (what)) {                                       \
            printf("line %d: %s gave %d\n", __LINE__, #call, got); \
            surprises++;                                           \
        }                                                          \
    } while (0)
#define OK(call) EXPECT(fmi3OK, call)
#define REFUSED(call)                                              \
    do {                                                           \
        int before = told;                                         \
        EXPECT(fmi3Error, call);                                   \
        if (told == before) {                                      \
            printf("line %d: %s told nothing\n", __LINE__, #call); \
            surprises++;                                           \
        }                                                          \
    } while (0)

static int surprises, told;
static Model *model;

static void logger(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String message) {
    (void)e, (void)category;
    if (s == fmi3Error) {
        told++;
        printf("%s\n", message);
    }
}

static fmi3ValueReference first_of(Kind kind) {
    for (int k = 0; k < model->n_variables; k++)
        if (model->variables[k].kind == (int)kind) return model->variables[k].reference;
    return 0;
}

static fmi3ValueReference first_mode(void) {
    for (int k = 0; k < model->n_variables; k++)
        if (model->variables[k].kind == KIND_DISCRETE && model->variables[k].type == TYPE_ENUMERATION)
            return model->variables[k].reference;
    return 0;
}

static fmi3Instance made(int co_simulation, int events) {
    fmi3Instance c = co_simulation ? fmi3InstantiateCoSimulation("driver", model->token, NULL, 0, 0, events, events,
                                         NULL, 0, NULL, logger, NULL)
                                   : fmi3InstantiateModelExchange("driver", model->token, NULL, 0, 0, NULL, logger);
    if (c == NULL) exit(2);
    return c;
}

static fmi3Instance started(int co_simulation, int events) {
    fmi3Instance c = made(co_simulation, events);
    OK(fmi3EnterInitializationMode(c, 1, 1e-6, 0, 1, 1.0));
    OK(fmi3ExitInitializationMode(c));
    return c;
}

static fmi3Boolean flag, more, early;
static double time_reached;

static fmi3Status step(fmi3Instance c, double t, double h) {
    return fmi3DoStep(c, t, h, 1, &flag, &more, &early, &time_reached);
}

static fmi3Status update(fmi3Instance c) {
    fmi3Boolean a, b, d, e, f;
    return fmi3UpdateDiscreteStates(c, &a, &b, &d, &e, &f, &time_reached);
}

static void refuses_wrong_values(fmi3Instance c) {
    fmi3ValueReference unknown = 4000000000u, state = first_of(KIND_STATE), mode = first_mode();
    fmi3ValueReference parameter = first_of(KIND_PARAMETER), rate = first_of(KIND_DERIVATIVE);
    size_t count;
    double value = 0, nan_value = NAN, two[2];
    fmi3Int64 number = 99;
    REFUSED(fmi3GetFloat64(c, &unknown, 1, &value, 1));
    REFUSED(fmi3GetFloat64(c, &mode, 1, &value, 1));
    REFUSED(fmi3GetFloat64(c, NULL, 1, &value, 1));
    REFUSED(fmi3GetFloat64(c, &state, 1, NULL, 1));
    REFUSED(fmi3GetFloat64(c, &state, 1, two, 2));
    REFUSED(fmi3GetInt64(c, &state, 1, &number, 1));
    REFUSED(fmi3GetInt64(c, &mode, 1, &number, 0));
    REFUSED(fmi3GetBoolean(c, &state, 1, NULL, 1));
    REFUSED(fmi3GetString(c, &state, 1, NULL, 1));
    REFUSED(fmi3GetFloat32(c, &state, 1, NULL, 1));
    REFUSED(fmi3GetBinary(c, &state, 1, NULL, NULL, 1));
    REFUSED(fmi3GetClock(c, &state, 1, NULL));
    REFUSED(fmi3SetFloat64(c, &parameter, 1, &nan_value, 1));
    REFUSED(fmi3SetFloat64(c, &state, 1, &value, 1));
    REFUSED(fmi3SetInt64(c, &mode, 1, &number, 1));
    REFUSED(fmi3GetDirectionalDerivative(c, &mode, 1, &state, 1, &value, 1, &value, 1));
    REFUSED(fmi3GetDirectionalDerivative(c, &rate, 1, &state, 1, &value, 2, &value, 1));
    REFUSED(fmi3GetDirectionalDerivative(c, &rate, 1, &state, 1, &value, 1, &value, 2));
    REFUSED(fmi3GetDirectionalDerivative(c, &rate, 1, &unknown, 1, &value, 1, &value, 1));
    REFUSED(fmi3GetAdjointDerivative(c, &rate, 1, &state, 1, &value, 1, &value, 2));
    REFUSED(fmi3GetAdjointDerivative(c, &rate, 1, &state, 1, NULL, 1, &value, 1));
    OK(fmi3GetDirectionalDerivative(c, &rate, 1, &state, 1, &value, 1, &value, 1));
    OK(fmi3GetAdjointDerivative(c, &rate, 1, &state, 1, &value, 1, &value, 1));
    REFUSED(fmi3GetNumberOfVariableDependencies(c, rate, &count));
    REFUSED(fmi3GetVariableDependencies(c, rate, NULL, NULL, NULL, NULL, 0));
    OK(fmi3GetFloat64(c, NULL, 0, NULL, 0));
    REFUSED(fmi3ActivateModelPartition(c, 0, 0));
}

static void refuses_wrong_order(void) {
    fmi3Instance c = made(1, 0);
    fmi3ValueReference state = first_of(KIND_STATE);
    double value;
    REFUSED(step(c, 0, 0.1));
    REFUSED(fmi3GetFloat64(c, &state, 1, &value, 1));
    REFUSED(fmi3ExitInitializationMode(c));
    REFUSED(fmi3Terminate(c));
    REFUSED(fmi3EnterEventMode(c));
    REFUSED(fmi3EnterInitializationMode(c, 1, -1, 0, 0, 0));
    REFUSED(fmi3EnterInitializationMode(c, 0, 0, NAN, 0, 0));
    REFUSED(fmi3EnterInitializationMode(c, 0, 0, 1, 1, 0));
    OK(fmi3EnterConfigurationMode(c));
    REFUSED(fmi3EnterInitializationMode(c, 0, 0, 0, 1, 1));
    OK(fmi3ExitConfigurationMode(c));
    OK(fmi3EnterInitializationMode(c, 0, 0, 0, 1, 1));
    REFUSED(fmi3EnterInitializationMode(c, 0, 0, 0, 1, 1));
    OK(fmi3ExitInitializationMode(c));
    REFUSED(fmi3EnterEventMode(c));
    REFUSED(fmi3SetTime(c, 0.5));
    REFUSED(update(c));
    REFUSED(step(c, 0.5, 0.1));
    REFUSED(step(c, 0, -0.1));
    REFUSED(step(c, 0, NAN));
    REFUSED(step(c, 0, 2));
    REFUSED(fmi3DoStep(c, 0, 0.1, 1, NULL, &more, &early, &time_reached));
    OK(step(c, 0, 0.25));
    OK(fmi3Terminate(c));
    REFUSED(step(c, 0.25, 0.1));
    OK(fmi3Reset(c));
    fmi3FreeInstance(c);
    EXPECT(fmi3Error, step(NULL, 0, 1));
    fmi3FreeInstance(NULL);
    EXPECT(1, fmi3InstantiateModelExchange("driver", "{another}", NULL, 0, 0, NULL, logger) == NULL);
    EXPECT(1, fmi3InstantiateModelExchange(NULL, model->token, NULL, 0, 0, NULL, logger) == NULL);
    EXPECT(1, fmi3InstantiateModelExchange("driver", "{another}", NULL, 0, 0, NULL, NULL) == NULL);
    EXPECT(1,
        fmi3InstantiateScheduledExecution("driver", model->token, NULL, 0, 0, NULL, logger, NULL, NULL, NULL) == NULL);
}

static void refuses_wrong_sizes(void) {
    fmi3Instance c = started(0, 0);
    double x[4096] = {0};
    REFUSED(fmi3UpdateDiscreteStates(c, NULL, &flag, &flag, &flag, &flag, x));
    REFUSED(fmi3EnterStepMode(c));
    OK(update(c));
    OK(fmi3EnterContinuousTimeMode(c));
    REFUSED(fmi3GetContinuousStateDerivatives(c, x, model->n_x + 1));
    REFUSED(fmi3GetContinuousStateDerivatives(c, NULL, model->n_x));
    REFUSED(fmi3GetContinuousStates(c, x, 0));
    REFUSED(fmi3GetEventIndicators(c, x, model->n_guards + 1));
    REFUSED(fmi3GetNominalsOfContinuousStates(c, x, model->n_x + 1));
    REFUSED(fmi3SetTime(c, INFINITY));
    x[0] = NAN;
    REFUSED(fmi3SetContinuousStates(c, x, model->n_x));
    REFUSED(fmi3SetContinuousStates(c, x, model->n_x + 1));
    REFUSED(step(c, 0, 0.1));
    refuses_wrong_values(c);
    fmi3FreeInstance(c);
}

static void refuses_damaged_states(void) {
    fmi3Instance c = started(1, 0);
    fmi3FMUState state = NULL, copy = NULL;
    size_t size;
    fmi3Byte *bytes;
    REFUSED(fmi3GetFMUState(c, NULL));
    REFUSED(fmi3SetFMUState(c, NULL));
    OK(fmi3GetFMUState(c, &state));
    OK(fmi3SerializedFMUStateSize(c, state, &size));
    bytes = malloc(size);
    REFUSED(fmi3SerializeFMUState(c, state, bytes, size - 1));
    OK(fmi3SerializeFMUState(c, state, bytes, size));
    for (size_t cut = 0; cut < size; cut += 97) REFUSED(fmi3DeserializeFMUState(c, bytes, cut, &copy));
    for (size_t k = 0; k < size; k += 97) {
        bytes[k] ^= 1;
        REFUSED(fmi3DeserializeFMUState(c, bytes, size, &copy));
        bytes[k] ^= 1;
    }
    OK(fmi3DeserializeFMUState(c, bytes, size, &copy));
    OK(fmi3SetFMUState(c, copy));
    OK(fmi3FreeFMUState(c, &copy));
    OK(fmi3FreeFMUState(c, &state));
    free(bytes);
    fmi3FreeInstance(c);
}

static void runs(void) {
    fmi3Instance c = started(1, 1);
    double values[4096];
    OK(update(c));
    OK(fmi3EnterStepMode(c));
    time_reached = 0;
    while (time_reached < 1) {
        OK(step(c, time_reached, 1 - time_reached));
        for (int n = 0; n < model->n_variables; n++)
            if (model->variables[n].type == TYPE_FLOAT64)
                OK(fmi3GetFloat64(c, &model->variables[n].reference, 1, values + n, 1));
        if (!flag) continue;
        double reached = time_reached;
        OK(fmi3EnterEventMode(c));
        OK(update(c));
        OK(fmi3EnterStepMode(c));
        time_reached = reached;
    }
    fmi3FreeInstance(c);
}

/* With two tangents through all events, chosen twice. */
static void carries_derivatives(void) {
    fmi3Instance c = made(1, 0);
    fmi3ValueReference state = first_of(KIND_STATE), rate = first_of(KIND_DERIVATIVE);
    fmi3ValueReference by[2] = {first_of(KIND_PARAMETER), first_of(KIND_PARAMETER)};
    double found[2];
    for (int k = 0; k < model->n_variables; k++)
        if (model->variables[k].kind == KIND_STATE && model->variables[k].start >= 0)
            by[1] = model->variables[k].reference; /* a start value */
    EXPECT(1, modelica_like_gradient_start(NULL, by, 2));
    EXPECT(1, modelica_like_gradient_start(c, by, 2));
    OK(fmi3EnterInitializationMode(c, 1, 1e-6, 0, 1, 1.0));
    EXPECT(1, modelica_like_gradient_start(c, NULL, 2));
    EXPECT(1, modelica_like_gradient_start(c, &rate, 1));
    for (int k = 0; k < 2; k++) EXPECT(0, modelica_like_gradient_start(c, by, 2));
    OK(fmi3ExitInitializationMode(c));
    for (int k = 0; k < 10; k++) OK(step(c, 0.1 * k, 0.1));
    EXPECT(0, modelica_like_gradient(c, &state, 1, found));
    EXPECT(1, modelica_like_gradient(c, NULL, 1, found));
    OK(fmi3Reset(c));
    EXPECT(1, modelica_like_gradient(c, &state, 1, found));
    fmi3FreeInstance(c);
}

int main(int argc, char **argv) {
    int cycles = argc > 1 ? atoi(argv[1]) : 1;
    char message[MESSAGE_LENGTH];
    model = model_read((const unsigned char *)model_data, model_data_size, calloc, free, message);
    if (model == NULL) return 2;
    runs();
    refuses_wrong_order();
    refuses_wrong_sizes();
    refuses_damaged_states();
    carries_derivatives();
    for (int k = 0; k < cycles; k++) {
        fmi3Instance c = started(k % 2, 0);
        if (k % 2) OK(step(c, 0, 0.05));
        fmi3FreeInstance(c);
    }
    model_free(model);
    return surprises > 0;
}
