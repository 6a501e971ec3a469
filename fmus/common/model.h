/* What a reference model hands to the shared FMI functions, and what it gets from them.
 *
 * `variables.h` is written by build.py from the model's model.toml: value references (NAME_OF_VARIABLE), VARIABLES,
 * STATES, INDICATORS, FIRST_STATE, FIRST_DERIVATIVE, the tables start_value and is_integer, MODEL_TOKEN. States, their
 * derivatives and the event indicators stand one after the other in the values. */
#ifndef MODEL_H
#define MODEL_H

#include "variables.h"

typedef struct {
    double time;
    double v[VARIABLES]; /* all values by value reference, integers too */
    double memory[8];    /* what a model keeps besides its variables */
    int phase;           /* of the FMI functions */
} Model;

/* Take up parameters and start values at m->time; called when initialization ends. */
void model_start(Model *m);

/* Bring all variables from m->time to `end`, through the events in between. */
void model_advance(Model *m, double end);

/* Compute outputs, derivatives and indicators from time, states, inputs and modes. */
void model_evaluate(Model *m);

/* Change modes and states where an indicator says so; return whether anything changed. */
int model_update(Model *m);

#endif
