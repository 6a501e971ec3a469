/* Times every fixed step of an FMU whose sources are compiled with this file: see fixed_step.py.
 *
 * Arguments: step size, end time, steps in all, repeats. Runs differ in the step size (up to 10 % less), so that events
 * fall at other places within a step. All runs are repeated one after the other; of a step the shortest time counts, as
 * the machine interrupts here and there, but a run does the same each time. Prints median, 99.99 % and longest in s.
 */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "core.h"
#include "fmi2Functions.h"

static void tell(void *environment, const char *name, fmi2Status status, const char *category, const char *text, ...) {
    (void)environment, (void)name, (void)status, (void)category;
    fprintf(stderr, "%s\n", text);
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_size(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static void must(int good, const char *what) {
    if (good) return;
    fprintf(stderr, "%s failed\n", what);
    exit(1);
}

/* Runs n steps of size h; the times of steps that were shorter than before are kept. */
static void run(double h, size_t n, double *shortest) {
    static const fmi2CallbackFunctions callbacks = {tell, calloc, free, NULL, NULL};
    Instance *c = fmi2Instantiate("timed", fmi2CoSimulation, TOKEN, "", &callbacks, fmi2False, fmi2False);
    Settings settings;
    must(c != NULL, "fmi2Instantiate");
    settings = *c->model->settings;
    settings.fixed_step = h;
    c->own_model->settings = &settings;
    must(fmi2SetupExperiment(c, fmi2False, 0, 0, fmi2False, 0) == fmi2OK, "fmi2SetupExperiment");
    must(fmi2EnterInitializationMode(c) == fmi2OK, "fmi2EnterInitializationMode");
    must(fmi2ExitInitializationMode(c) == fmi2OK, "fmi2ExitInitializationMode");
    for (size_t k = 0; k < n; k++) {
        double begin = now(), time;
        fmi2Status status = fmi2DoStep(c, c->state.t, h, fmi2True);
        time = now() - begin;
        must(status == fmi2OK, "fmi2DoStep");
        if (time < shortest[k]) shortest[k] = time;
    }
    fmi2FreeInstance(c);
}

int main(int count, char **given) {
    double step = count == 5 ? atof(given[1]) : 0, end = count == 5 ? atof(given[2]) : 0, *times;
    size_t wanted = count == 5 ? (size_t)atof(given[3]) : 0, least = (size_t)(end / step), size, done = 0;
    must(count == 5 && wanted > 0 && least > 0, "reading arguments");
    size = wanted + 2 * least;
    times = malloc(size * sizeof *times);
    must(times != NULL, "malloc");
    for (size_t k = 0; k < size; k++) times[k] = 1e30;
    for (int repeat = 0; repeat < atoi(given[4]); repeat++) {
        srand(1);
        for (done = 0; done < wanted;) {
            double h = step * (1 - 0.1 * rand() / RAND_MAX);
            size_t n = (size_t)(end / h);
            run(h, n, times + done);
            done += n;
        }
    }
    qsort(times, done, sizeof *times, by_size);
    printf("%zu %g %g %g\n", done, times[done / 2], times[(size_t)(0.9999 * (double)done)], times[done - 1]);
    free(times);
    return 0;
}
