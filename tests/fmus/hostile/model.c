/* An FMU that prints noise, and does one thing wrong. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

enum { NOTHING, CRASH, HANG, LEAVE, RUN_BACK, CRASH_AT_START, NOT_A_NUMBER, CRASH_AT_END, EAT };

static void crash(void) {
    volatile int *volatile nowhere = NULL;
    *nowhere = 1;
}

void model_start(Model *m) {
    printf("noise %g\n", m->v[misdeed]);
    fprintf(stderr, "more noise\n");
    if (m->v[misdeed] == CRASH_AT_START) crash();
    m->v[x] = m->time;
}

void model_advance(Model *m, double end) {
    for (int k = 0; k < 100; k++) puts("{\"kind\": \"noise\"}");
    m->time = end;
    m->v[x] = end;
    if (end < 0.5) return;
    switch ((int)m->v[misdeed]) {
        case CRASH: crash(); break;
        case HANG:
            for (volatile int k = 0;; k++) {
            }
            break;
        case LEAVE: exit(0);
        case RUN_BACK: m->time = 0; break; /* the next step does not begin where this one has ended: an error */
        case NOT_A_NUMBER: m->v[x] = NAN; break;
        case CRASH_AT_END: atexit(crash); break; /* when the process has let go of it */
        case EAT:
            for (size_t size = 1 << 24;;) memset(malloc(size), 1, size);
        default: break;
    }
}
