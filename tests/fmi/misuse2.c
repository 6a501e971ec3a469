/* Runs under AddressSanitizer and UBSan: a whole run, wrong calls of every kind, and many instances. Prints the log,
 * exits with 1 if a call was answered wrongly. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "core.h"
#include "fmi2Functions.h"

#define EXPECT(what, call)                                         \
    do {                                                           \
        int got = (int)(call);                                     \
        if (got != (what)) {                                       \
            printf("line %d: %s gave %d\n", __LINE__, #call, got); \
            surprises++;                                           \
        }                                                          \
    } while (0)
#define OK(call) EXPECT(fmi2OK, call)
#define REFUSED(call)                                              \
    do {                                                           \
        int before = told;                                         \
        EXPECT(fmi2Error, call);                                   \
        if (told == before) {                                      \
            printf("line %d: %s told nothing\n", __LINE__, #call); \
            surprises++;                                           \
        }                                                          \
    } while (0)

static int surprises, told;
static Model *model;

static void logger(
    fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String message, ...) {
    (void)e, (void)name, (void)category;
    if (s == fmi2Error) {
        told++;
        printf("%s\n", message);
    }
}

static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};

static fmi2ValueReference first_of(Kind kind) {
    for (int k = 0; k < model->n_variables; k++)
        if (model->variables[k].kind == (int)kind) return model->variables[k].reference;
    return 0;
}

static fmi2Component started(fmi2Type type) {
    fmi2Component c = fmi2Instantiate("driver", type, model->token, NULL, &callbacks, 0, 0);
    if (c == NULL) exit(2);
    OK(fmi2SetupExperiment(c, 1, 1e-6, 0, 1, 1.0));
    OK(fmi2EnterInitializationMode(c));
    OK(fmi2ExitInitializationMode(c));
    return c;
}

static void refuses_wrong_values(fmi2Component c) {
    fmi2ValueReference unknown = 4000000000u, state = first_of(KIND_STATE), mode = first_of(KIND_DISCRETE),
                       parameter = first_of(KIND_PARAMETER);
    double value = 0, nan_value = NAN;
    int number = 99;
    REFUSED(fmi2GetReal(c, &unknown, 1, &value));
    REFUSED(fmi2GetReal(c, &mode, 1, &value));
    REFUSED(fmi2GetReal(c, NULL, 1, &value));
    REFUSED(fmi2GetReal(c, &state, 1, NULL));
    REFUSED(fmi2GetInteger(c, &state, 1, &number));
    REFUSED(fmi2GetBoolean(c, &state, 1, NULL));
    REFUSED(fmi2GetString(c, &state, 1, NULL));
    REFUSED(fmi2SetReal(c, &parameter, 1, &nan_value));
    REFUSED(fmi2SetReal(c, &state, 1, &value));
    REFUSED(fmi2SetInteger(c, &mode, 1, &number));
    REFUSED(fmi2SetString(c, &mode, 1, NULL));
    REFUSED(fmi2SetBoolean(c, &mode, 1, NULL));
    REFUSED(fmi2GetDirectionalDerivative(c, &mode, 1, &state, 1, &value, &value));
    REFUSED(fmi2GetDirectionalDerivative(c, &state, 1, &mode, 1, &value, &value));
    REFUSED(fmi2GetDirectionalDerivative(c, &state, 1, &unknown, 1, &value, &value));
    REFUSED(fmi2GetDirectionalDerivative(c, &state, 1, &state, 1, NULL, &value));
    OK(fmi2GetReal(c, NULL, 0, NULL));
}

static void refuses_wrong_order(void) {
    fmi2Component c = fmi2Instantiate("driver", fmi2CoSimulation, model->token, NULL, &callbacks, 0, 0);
    fmi2ValueReference state = first_of(KIND_STATE);
    fmi2EventInfo info;
    double value;
    fmi2Boolean flag;
    if (c == NULL) exit(2);
    REFUSED(fmi2DoStep(c, 0, 0.1, 1));
    REFUSED(fmi2GetReal(c, &state, 1, &value));
    REFUSED(fmi2ExitInitializationMode(c));
    REFUSED(fmi2Terminate(c));
    REFUSED(fmi2SetupExperiment(c, 1, -1, 0, 0, 0));
    REFUSED(fmi2SetupExperiment(c, 1, NAN, 0, 0, 0));
    REFUSED(fmi2SetupExperiment(c, 0, 0, NAN, 0, 0));
    REFUSED(fmi2SetupExperiment(c, 0, 0, 1, 1, 0));
    OK(fmi2SetupExperiment(c, 0, 0, 0, 1, 1));
    OK(fmi2EnterInitializationMode(c));
    REFUSED(fmi2EnterInitializationMode(c));
    REFUSED(fmi2SetupExperiment(c, 0, 0, 0, 0, 0));
    OK(fmi2ExitInitializationMode(c));
    REFUSED(fmi2SetTime(c, 0.5));
    REFUSED(fmi2NewDiscreteStates(c, &info));
    REFUSED(fmi2CompletedIntegratorStep(c, 1, &flag, &flag));
    REFUSED(fmi2DoStep(c, 0.5, 0.1, 1));
    REFUSED(fmi2DoStep(c, 0, -0.1, 1));
    REFUSED(fmi2DoStep(c, 0, NAN, 1));
    REFUSED(fmi2DoStep(c, NAN, 0.1, 1));
    REFUSED(fmi2DoStep(c, 0, 2, 1));
    REFUSED(fmi2CancelStep(c));
    OK(fmi2DoStep(c, 0, 0.25, 1));
    OK(fmi2Terminate(c));
    REFUSED(fmi2DoStep(c, 0.25, 0.1, 1));
    OK(fmi2Reset(c));
    fmi2FreeInstance(c);
    EXPECT(fmi2Error, fmi2DoStep(NULL, 0, 1, 1));
    EXPECT(fmi2Error, fmi2GetReal(NULL, &state, 1, &value));
    fmi2FreeInstance(NULL);
    EXPECT(1, fmi2Instantiate("driver", fmi2CoSimulation, "{another}", NULL, &callbacks, 0, 0) == NULL);
    EXPECT(1, fmi2Instantiate(NULL, fmi2CoSimulation, model->token, NULL, &callbacks, 0, 0) == NULL);
    EXPECT(1, fmi2Instantiate("driver", fmi2CoSimulation, NULL, NULL, &callbacks, 0, 0) == NULL);
    EXPECT(1, fmi2Instantiate("driver", fmi2CoSimulation, model->token, NULL, NULL, 0, 0) == NULL);
}

static void refuses_wrong_sizes(void) {
    fmi2Component c = started(fmi2ModelExchange);
    double x[4096] = {0};
    fmi2EventInfo info;
    REFUSED(fmi2NewDiscreteStates(c, NULL));
    OK(fmi2NewDiscreteStates(c, &info));
    OK(fmi2EnterContinuousTimeMode(c));
    REFUSED(fmi2GetDerivatives(c, x, model->n_x + 1));
    REFUSED(fmi2GetDerivatives(c, NULL, model->n_x));
    REFUSED(fmi2GetContinuousStates(c, x, 0));
    REFUSED(fmi2GetEventIndicators(c, x, model->n_guards + 1));
    REFUSED(fmi2GetNominalsOfContinuousStates(c, x, model->n_x + 1));
    REFUSED(fmi2SetTime(c, INFINITY));
    x[0] = NAN;
    REFUSED(fmi2SetContinuousStates(c, x, model->n_x));
    REFUSED(fmi2SetContinuousStates(c, x, model->n_x + 1));
    REFUSED(fmi2DoStep(c, 0, 0.1, 1));
    refuses_wrong_values(c);
    fmi2FreeInstance(c);
}

static void refuses_damaged_states(void) {
    fmi2Component c = started(fmi2CoSimulation);
    fmi2FMUstate state = NULL, copy = NULL;
    size_t size;
    fmi2Byte *bytes;
    REFUSED(fmi2GetFMUstate(c, NULL));
    REFUSED(fmi2SetFMUstate(c, NULL));
    OK(fmi2GetFMUstate(c, &state));
    OK(fmi2SerializedFMUstateSize(c, state, &size));
    bytes = malloc(size);
    REFUSED(fmi2SerializeFMUstate(c, state, bytes, size - 1));
    OK(fmi2SerializeFMUstate(c, state, bytes, size));
    REFUSED(fmi2DeSerializeFMUstate(c, bytes, size - 1, &copy));
    REFUSED(fmi2DeSerializeFMUstate(c, NULL, size, &copy));
    bytes[size / 2] ^= 1;
    REFUSED(fmi2DeSerializeFMUstate(c, bytes, size, &copy));
    bytes[size / 2] ^= 1;
    OK(fmi2DeSerializeFMUstate(c, bytes, size, &copy));
    OK(fmi2SetFMUstate(c, copy));
    OK(fmi2FreeFMUstate(c, &copy));
    OK(fmi2FreeFMUstate(c, &copy));
    OK(fmi2FreeFMUstate(c, &state));
    OK(fmi2FreeFMUstate(c, NULL));
    free(bytes);
    refuses_wrong_values(c);
    fmi2FreeInstance(c);
}

static void runs(void) {
    fmi2Component c = started(fmi2CoSimulation);
    double values[4096];
    for (int k = 0; k < 50; k++) {
        OK(fmi2DoStep(c, k / 50.0, 1 / 50.0, 1));
        for (int n = 0; n < model->n_variables; n++)
            if (model->variables[n].type == TYPE_FLOAT64)
                OK(fmi2GetReal(c, &model->variables[n].reference, 1, values + n));
    }
    fmi2FreeInstance(c);
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
    for (int k = 0; k < cycles; k++) {
        fmi2Component c = started(k % 2 ? fmi2CoSimulation : fmi2ModelExchange);
        if (k % 2) OK(fmi2DoStep(c, 0, 0.05, 1));
        fmi2FreeInstance(c);
    }
    model_free(model);
    return surprises > 0;
}
