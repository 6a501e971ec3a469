/* Gradients of runs: what is kept of a run, and the adjoint vectors that go back along it. */
#ifndef ADJOINT_H
#define ADJOINT_H

#include "core.h"
#include "rodas.h"

enum { N_NODES = LAST_POINTS }; /* of stages: the last ones have one */
#define DOUBTFUL 1e-9   /* effect of a parameter, by relative changes, on what has no derivative: less is rounding */
#define MOST_DOUBTFUL 8 /* reasons that are told apart */
#define CLOSER 0.01     /* the part of a way where a kink or jump is as large */
#define MOST_TOUCHES 3  /* of a guard in a piece: its polynomial has no more tops */
#define MOST_LANES 16   /* vectors that go over a tape together */

typedef struct Record { /* a part of a piece along which the run has moved, or an instant */
    struct Record *previous;
    Result (*pass)(Instance *c);   /* an instant, or NULL */
    int start, n_rounds, edgeless; /* edgeless: of a move; no edge is near its piece */
    void *before, *behind;         /* copies of the state; of a move: where parameters, inputs or d have changed */
    const void *frame;             /* of a move: a copy with its parameters, inputs and d */
    double begin, end, *own;       /* of a move: its piece */
    const unsigned char *rounds;   /* transitions that have fired at an instant, by rounds */
} Record;

typedef struct {
    FailureCode why;
    int n;           /* of them */
    double t, place; /* that of a guard: its transition */
} Doubt;

typedef struct { /* a guard that is highest there; felt: what an event would change, beside it; size: how large it is in
                  * between the looks beside it, if this may be rounding; corner: it turns at once */
    double t, felt, size;
    int guard, corner;
} Touch;

typedef struct {
    ptrdiff_t place; /* among the numbers of the state */
    uint32_t by;     /* value reference */
} Value;

typedef struct {      /* a part of what is differentiated; those at a time come first, the latest one first */
    int64_t of;       /* row */
    int64_t instant;  /* before this one, which moves: 0 is that at the start; -1: at a time, behind an instant there */
    double t, moving; /* that time; derivative by the time of the instant */
    const double *by; /* derivatives by states, parameters, inputs and d */
} Seed;

typedef struct {                      /* an operation of a tape that has one */
    int operation, place, due, alone; /* alone: it has been felt, and is looked at by itself */
} Kink;

typedef struct {
    int64_t variable; /* is integrated over the run; -1: nothing */
    double size;      /* of the integral, beside which errors are measured */
} Integrand;

typedef struct { /* what is read along a run */
    const Seed *seeds;
    const Integrand *integrands; /* by row */
    int64_t n_seeds, n_of;
} Along;

struct Gradient {
    const Transition *cause; /* of an event */
    size_t n;                /* by how many values */
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
    const void *loaded;                                                         /* the copy that is in place */
    int n_of, n_vectors, n_kept, n_doubts, n_listed, n_marked, singular, early; /* early: events at the start */
    double present, cause_speed; /* time from which it goes; of the guard of an event */
    double singular_at, speed;   /* how fast the guard of an event comes to zero, where it matters; or 0 */
    double looked_at;            /* begin of the piece behind, where guards have been looked at; or nan */
    Doubt doubts[MOST_DOUBTFUL];
    Touch *touches;                 /* of a piece, or an instant */
    int n_touches, measured, lands; /* lands: steps that end at edges, instead of a piece that went over them */
    double *edges;
    double *guard_sizes;      /* if `measured` */
    double *guard_rests;      /* up to which it rests at zero, where this has been asked */
    double *vectors, *behind; /* of outputs, then of doubts: derivatives by numbers of the state, and by the time */
    double *sides, *slope, *way, *moment, *rates, *work, *sizes, *motions, *largest;
    double *points, *matrices, *stages, *node_bars; /* of a step */
    double *integrand_slopes, *integrand_bars;      /* by states and implicit unknowns, and by the rest, at the nodes */
    double *later, *lanes;                          /* derivatives by the time of an instant; bars of several vectors */
    double *rests; /* of operations, then of guards: since when they are at their kinks, on the way back, or nan */
    Kink *kinked, **kinks; /* of the rates; those that matter in the present modes */
    int n_kinked, n_kinks;
    uint64_t kinks_by;    /* behind which count of `decided_by` these were found */
    unsigned char *still; /* vectors that a step leaves as they are */
    const Along *along;   /* or NULL; then outputs: */
    const uint32_t *of;
    int64_t next_seed, instant;
    ptrdiff_t *listed;
    unsigned char *marks; /* numbers that the last instant has felt */
};

/* The derivative at the begin of a step of length 1 of the polynomial through values at its nodes. */
static const double BY_NODES[N_NODES] = {-8.369800827143091, 46.395023689295286, 445.56742342191916, -46.71499414177189,
    -475.38545395892027, 38.507801816620784};

static inline int node_of(int stage) { return stage < N_NODES ? stage : N_NODES - 1; }

/* When a node of a step is: not quite at the ends, where slopes may be those beyond an edge. */
static inline double node_time(double begin, double h, int node) {
    double inside = min_of(1e-3 * h, 1e-14 * max_of(1, fabs(begin)));
    return max_of(begin + inside, min_of(begin + RODAS_TIME[node] * h, begin + h - inside));
}
static inline double span_of(const Instance *c) {
    return c->state.stop_time_defined ? c->state.stop_time - c->state.start_time : 1;
}
/* The variable that a row integrates, or -1. */
static inline int integrand_of(const Gradient *g, int row) {
    return g->along == NULL || row >= g->n_of ? -1 : (int)g->along->integrands[row].variable;
}
/* Where numbers of the state lie in a copy. */
static inline const double *copied(const Instance *c, const void *copy, const double *values) {
    return (const double *)(const void *)((const char *)copy + sizeof(State)) + (values - c->numbers);
}
static inline double *vector_of(const Instance *c, int k) {
    return c->gradient->vectors + (size_t)k * (c->n_smooth + 1);
}
/* gradient.c */
Result differentiate(Instance *c, const uint32_t of[], size_t n_of, const Along *along, double *gradient);
void add_doubt(Instance *c, FailureCode why, const double *slope);
double small_terms(const Instance *c, const double *slope);
void add_small_doubt(Instance *c, FailureCode why, double *slope);
void lose_back(Instance *c);
void add_seed(Instance *c, const Seed *seed);
double seed_behind(Instance *c, double t, int add);
/* adjoint.c */
void add_bars(Instance *c, double *vector);
double slope_of_output(Instance *c, const Tape *tape, int output, double *bars, double *slope);
void piece_back(Instance *c, const Record *along);
/* kinks.c */
void find_kinked(Instance *c);
void note_kinks(Instance *c);
void check_kinks(Instance *c);
void check_outputs(Instance *c);
int begins_alike(Instance *c, const Record *at, int listed);
void check_meeting(Instance *c, const Record *at, const unsigned char *fired);
void check_reading(Instance *c, const Record *at);
/* graze.c */
int stand_at(Instance *c, const void *frame, const double *own, double t);
void find_touches(Instance *c, int parts, const double *begins, const double *ends);
double touch_behind(const Gradient *g);
void judge_touches(Instance *c, const Record *along, double t);
int find_touches_at(Instance *c, const Record *at, double rate);
void add_touches_at(Instance *c, double speed);
void check_end(Instance *c);
/* integrals.c */
double integral_back(int of_error, double *stages, double *weights);
double slopes_of_integrands(Instance *c, double begin, double h);
void integrals_back(Instance *c, double h);
int integrands_jump(Instance *c, double before, double behind);
/* instants.c */
void event_back(Instance *c, const Record *at);
void start_back(Instance *c, const Record *at);

#endif
