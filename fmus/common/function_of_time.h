/* A model all of whose variables are functions of the time since its start; the model defines `evaluate`. */
#ifndef FUNCTION_OF_TIME_H
#define FUNCTION_OF_TIME_H

#include "model.h"

enum { START }; /* memory: time at which the run began */

static void evaluate(Model *m);

static double since_start(const Model *m) { return m->time - m->memory[START]; }

void model_start(Model *m) {
    m->memory[START] = m->time;
    evaluate(m);
}

void model_advance(Model *m, double end) {
    m->time = end;
    evaluate(m);
}

#endif
