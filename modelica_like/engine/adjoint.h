/* Gradients of runs: what is kept of a run, and the adjoint vectors that go back along it. */
#ifndef ADJOINT_H
#define ADJOINT_H

#include "core.h"
#include "rodas.h"

enum { N_NODES = LAST_POINTS }; /* of stages: the last ones have one */
#define MOST_DOUBTFUL 8         /* reasons that are told apart */

typedef struct Record { /* a part of a piece along which the run has moved, or an instant */
    struct Record *previous;
    Result (*pass)(Instance *c); /* an instant, or NULL */
    int start, n_rounds;
    void *before, *behind;       /* copies of the state; of a move: where parameters, inputs or d have changed */
    const void *frame;           /* of a move: a copy with its parameters, inputs and d */
    double begin, end, *own;     /* of a move: its piece */
    const unsigned char *rounds; /* transitions that have fired at an instant, by rounds */
} Record;

typedef struct {
    FailureCode why;
    int n; /* of them */
    double t;
} Doubt;

typedef struct {
    ptrdiff_t place; /* among the numbers of the state */
    uint32_t by;     /* value reference */
} Value;

struct Gradient {
    size_t n; /* by how many values */
    Value *values;
    unsigned char *asked; /* marks them among the numbers of the state */
    Record *last;
    const void *frame; /* the copy with the present parameters, inputs and d */
    double bytes;
    int n_rounds;
    unsigned char *rounds; /* of the present instant */
    FailureCode lost;      /* why there are no derivatives, or 0 */
    double lost_at;
    /* While it goes back: */
    const void *loaded; /* the copy that is in place */
    int n_of, n_vectors, n_kept, n_doubts, n_listed, n_marked, singular;
    double singular_at, speed; /* how fast the guard of an event comes to zero, where it matters; or 0 */
    Doubt doubts[MOST_DOUBTFUL];
    double *vectors, *behind; /* of outputs, then of doubts: derivatives by numbers of the state, and by the time */
    double *sides, *slope, *moment, *rates, *work, *sizes, *motions, *largest;
    double *points, *matrices, *stages, *node_bars; /* of a step */
    ptrdiff_t *listed;
    unsigned char *marks; /* numbers that the last instant has felt */
};

/* Where numbers of the state lie in a copy. */
static inline const double *copied(const Instance *c, const void *copy, const double *values) {
    return (const double *)(const void *)((const char *)copy + sizeof(State)) + (values - c->numbers);
}
static inline double *vector_of(const Instance *c, int k) {
    return c->gradient->vectors + (size_t)k * (c->n_smooth + 1);
}
/* gradient.c */
void add_doubt(Instance *c, FailureCode why, const double *slope);
void lose_back(Instance *c);
/* adjoint.c */
void add_bars(Instance *c, double *vector);
void slope_of_output(Instance *c, const Tape *tape, int output, double *bars, double *slope);
void piece_back(Instance *c, const Record *along);
/* instants.c */
void event_back(Instance *c, const Record *at);
void start_back(Instance *c, const Record *at);

#endif
