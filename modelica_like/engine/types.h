/* Types of the run-time: what an instance keeps, and what its functions hand to each other. Included by core.h. */
/* Zero is failure: results are asked for and joined like conditions. */
typedef enum { RESULT_ERROR, RESULT_OK, RESULT_DISCARD } Result;

typedef enum {
    PHASE_INSTANTIATED = 1,
    PHASE_INITIALIZATION = 2,
    PHASE_EVENT = 4,
    PHASE_CONTINUOUS = 8,
    PHASE_STEP = 16,
    PHASE_TERMINATED = 32,
    PHASE_CONFIGURATION = 64,
    PHASE_FAILED = 128
} Phase;

typedef struct { /* an accepted integrator step: its first and last point, and three for dense output */
    double begin, end, points[];
} Piece;

typedef struct { /* what changes; arrays of the model's sizes stand behind it, see `Instance` */
    double t, u_time;
    int phase, solved, z_valid, inputs_changed, piece_valid, event_pending, at_event;
    int looked;                                        /* the guards are known from the end of the last fixed step */
    int panel_valid;                                   /* the present point lies in the panel of another integrator */
    double tolerance, absolute, start_time, stop_time; /* absolute: in nominal values */
    double delayed_until;                              /* when series of delayed values end */
    int stop_time_defined, n_past, past_lost;          /* rows of the past; there were too many */
    int ended;                                         /* a component has ended the run */
    double step, longest;                              /* next step size, 0: choose one; largest one, 0: any */
    double instants[CROWD];                            /* of the last events, in a circle */
    double resting;                                    /* length of the last crowd: impacts end in contact; or 0 */
    int n_instants;
    double n_steps, n_rejected, n_evaluations, n_events;
} State;

typedef void (*AnyFunction)(void); /* a callback of the importer, cast back before it is called */

struct Instance;
typedef void (*LogFunction)(const struct Instance *c, int status, const char *category, const char *message);

typedef enum { LOG_ERROR = 1, LOG_WARNING = 2, LOG_EVENTS = 4, LOG_INTEGRATOR = 8, LOG_ALL = 15 } LogCategory;

typedef struct {
    double gain, forward, backward, restitution;
} Terms; /* of a motion that modes hold */

typedef struct { /* of another integrator: where its pieces end, and five knots of each, shared with the next one */
    double begin, longest, soon; /* longest: what pieces may have, as waves ask for; soon: until a guard may be zero */
    int64_t pieces, number;      /* number: of the present one */
    const double *ends, *knots;
} Panel;

typedef struct { /* results of another integrator from the present point, and the pieces that they become */
    const double *x, *z, *shares;           /* shares: of the span, at which they lie */
    double span, relative, absolute;        /* its tolerances; the last one in nominal values */
    int64_t results, precise;               /* precise: pieces as the integrator has laid them out */
    double *ends, *knots, *wishes, *errors; /* of each piece: how long it should have been, its error in tolerances */
} Looks;

/* Integrates from the present point up to a time at most; returns 0 where it cannot. */
typedef int (*Integrator)(double limit, Panel *panel);

typedef struct { /* a tape for a set of modes, see special.c */
    Tape tape;
    Run *runs;
    Operands *operands;
    int *outputs;
    int *wanted;              /* the outputs of the whole */
    int first_known, n_known; /* slots of what it knows */
    int uses;
} Special;
/* Of the first tapes of a model, from its rates to its edges, for so many sets of modes: runs come back to most
 * of theirs. There is room for whole tapes of one,
 * and of so many more, up to so many operations of large models. */
enum { N_SPECIALS = 7, N_SETS = 256, MORE_SETS = 36, MORE_KNOWN = 4, MORE_OPERATIONS = 1 << 16 };

/* Arrays with their sizes, for which lay_out has short names. */
#define FIELD(name, size) *name

/* An impact: of all motions that modes hold, and its jump of the states; `knocked` is let go in the impact itself. */
#define STRIKE_NUMBERS(A) \
    A(before, holds), A(approach, holds), A(impulse, holds), A(reaction, holds), A(jump, n), A(energy, holds)
#define STRIKE_MARKS(A) A(entering, holds), A(loose, holds), A(held, holds), A(knocked, holds)
typedef struct {
    double STRIKE_NUMBERS(FIELD);
    unsigned char STRIKE_MARKS(FIELD);
    int hard; /* what nothing limits stops more than what rounding leaves */
} Strike;

/* Those of single functions are named after them; a function that calls another one does not share with it. Tapes have
 * `slots` (values) and `dots` (derivatives in either direction, or three Taylor coefficients), the integrator 8 stages
 * and a point, and where the step begins (`first`); motions that may be held have `begun`, where the search for a
 * steady state began; `impact_x` and `impact_d` are states before the first impact at an instant, `trials` points
 * without and with it, whose powers differ by what sources give in its duration. */
#define WORK_NUMBERS(A)                                                                                               \
    A(slots, slots + left), A(dots, 3 * slots + left), A(jacobian, jacobian), A(matrix, m->step.n_nonzeros),          \
        A(qr_v, larger(m->step.n_v, m->start.n_v)), A(qr_r, larger(m->step.n_r, m->start.n_r)), A(qr_beta, system),   \
        A(qr_work, 2 * system), A(lu, m->lu.n_rows), A(lu_pivots, n), A(lu_sizes, n), A(lu_last, last *last),         \
        A(dense_matrix, dense), A(implicit_matrix, dense), A(implicit_lu, dense), A(square, square),                  \
        A(vector, n + n_z), A(residual, n_z), A(rhs, larger(n, m->n_determinants)), A(stages, 9 * n), A(point, n),    \
        A(first, n), A(first_rates, n), A(variables, m->n_nodes), A(guards, small), A(guards_before, 2 * guards),     \
        A(guards_begun, 2 * guards), A(looks, 3 * guards * MOST_LOOKS), A(seen_rates, n), A(seen_indicators, guards), \
        A(seen_derived, m->n_derived), A(outputs, outputs), A(start_unknowns, system), A(start_errors, system),       \
        A(start_sizes, system), A(start_kept, system), A(start_next, system),                                         \
        A(kept_starts, N_KEPT_STARTS *(n + 2 * n_d)), A(start_values, starts),                                        \
        A(start_residual, larger(m->n_start_values, resets)), A(delayed, 2 * delays),                                 \
        A(series, 2 * delays * DELAY_TERMS), A(begun, holds), A(motions, holds), A(d_before, n_d), A(d_begun, n_d),   \
        A(d_earlier, n_d), A(d_fired, n_d), A(reset_values, resets), A(target_values, resets),                        \
        A(target_missing, resets), A(respond_d, n_d), A(respond_z, n_z), A(rates, n), A(x_kept, n_x),                 \
        A(impact_x, n_x), A(impact_d, n_d), A(weights, holds), A(base_weights, holds), A(use, holds), A(best, n_d),   \
        A(kept_z, n_z), A(damped_z, n_z), A(damped_step, n_z), A(reactions, members), A(sizes, members),              \
        A(edges, 3 * edges), A(edges_middle, 4 * edges), A(edge_slopes, n), A(edge_change, n), A(edge_moved, n),      \
        A(changes, n), A(step_error, n), A(edge_guards, 2 * guards), A(trials, 2 * (n + n_d)),                        \
        A(known_values, m->n_known), A(set_keys, (N_SETS + 1) * (n_d + 1))
/* order: pivots of the implicit equations; open_rows: those that depend on others; asked: variables that somebody
 * reads; tuned: parameters that have changed in a run; entered: what has begun to hold at an instant; jolted: what new
 * values of states let go; idle:
 * time events that changed nothing of d that is felt by what moves when they came last */
#define WORK_INDICES(A)                                                                                 \
    A(order, n_z), A(implicit_order, n_z), A(last_order, last), A(targets, resets), A(standing, holds), \
        A(places, members + m->n_ideals), A(member, members), A(pivots, members), A(same, slots),       \
        A(places_of_slots, slots), A(steady_places, n), A(active_guard, guards)
#define WORK_MARKS(A)                                                                                               \
    A(known, n_x), A(decided, n_d), A(wishes, m->n_transitions), A(changed, n_d), A(kinds, guards), A(held, holds), \
        A(other, members), A(known_slots, slots), A(needed_slots, slots), A(open_rows, n_z), A(asked, m->n_nodes),  \
        A(tuned, m->n_p), A(entered, holds), A(jolted, holds), A(renewed, m->n_x), A(keeps, resets),                \
        A(positive, guards), A(active, guards), A(every, guards), A(idle, m->n_transitions),                        \
        A(ticking, m->n_transitions), A(felt, n_d)

typedef struct Gradient Gradient; /* see adjoint.h */

#define FAILURE(name, sentence) FAILURE_##name,
typedef enum {
#include "codes.h"
    N_FAILURES
} FailureCode;
#undef FAILURE

typedef struct { /* see codes.h; place -1: none */
    FailureCode code;
    double place, numbers[2];
} Failure;

typedef struct { /* of something for which there may be another way */
    FailureCode code;
    double values[3];
} Refusal;

/* points to come back to */
typedef enum { KEPT_FAILED, KEPT_LED, KEPT_SETTLING, KEPT_TICK, N_KEPT_STARTS } KeptStart;

/* Inputs are u + u_rate * (t - u_time); x is a point: states and implicit unknowns; `wanting` transitions fire at the
 * end of the piece; `noisy`: how often a guard has fired in a crowd. */
#define SMOOTH_NUMBERS(A) \
    A(x, n), A(p, m->n_p), A(u, m->n_u), A(u_rate, m->n_u), A(d, n_d), A(mode_value, n_d), A(start_value, starts)
#define STATE_MARKS(A) A(mode_given, n_d), A(start_given, starts), A(wanting, m->n_transitions), A(noisy, guards)

typedef struct Instance {
    const Model *model;
    Model *own_model; /* to be freed with the instance, or NULL */
    State state;
    double *numbers;            /* the rest of the state: the arrays that follow */
    size_t n_numbers, n_smooth; /* how many; the first ones, of which the rest of the run is a function */
    double SMOOTH_NUMBERS(FIELD);
    unsigned char STATE_MARKS(FIELD);
    Piece *piece;
    double *past, *past_sizes;     /* what delayed values were, see delay.c; their sizes */
    double *end_look;              /* guards and their rates at the end of the last fixed step */
    double *noise;                 /* of each guard: less counts as zero */
    double *z;                     /* in x: together they are a point */
    const double *values[N_KINDS]; /* of variables by kind; of inputs only at u_time */

    double WORK_NUMBERS(FIELD);
    int WORK_INDICES(FIELD);
    unsigned char WORK_MARKS(FIELD);
    Piece *whole;
    Integrator integrator; /* gives the panels; NULL: steps of the run-time */
    Panel panel;
    int own_steps;        /* left, in spite of an integrator */
    int doubts, doubtful; /* about the sign of a guard: of steps since the last event; of the present piece */
    Terms *terms, *strike_terms;
    Strike strike;
    int stopped;                       /* something has been stopped at the present instant */
    Special *special, part;            /* by set and tape; see `make_part` */
    size_t n_bars;                     /* slots, and those of what tapes know */
    size_t most_room, room_used;       /* most: to have room for a set behind it */
    int *room, most_known, known_used; /* for what these consist of, and what they know */
    int set;                           /* the present one; how many there have been */
    uint64_t n_sets;
    uint64_t chosen_by;         /* behind which count of `decided_by` the set was chosen */
    uint64_t decided_by;        /* counts changes of what decides about tapes: modes and parameters */
    uint64_t altered;           /* counts all changes of these, those of tuned parameters, too */
    uint64_t known_by[N_CODES]; /* at which of the latter what compiled tapes know was worked out */
    uint64_t active_by;         /* behind which of the former guards were marked `active` */
    int fixed_moments;          /* parameters and modes alone decide when time events come */
    double next_moment;         /* of these, behind the time when it was looked up */
    uint64_t next_by;           /* at which count of `altered` that was */
    int n_active;               /* of `active_guard` */

    const char *name;
    void *environment;
    AnyFunction logger, intermediate_update;
    LogFunction log;
    double (*step_finished)(struct Instance *c); /* tells until when to go on; or NULL */
    /* Told of mode changes (transition -1: an impact's) and of impacts (held -1: forget what was told); or NULL. */
    void (*noted)(struct Instance *c, int transition, int mode, int target);
    void (*struck)(struct Instance *c, int held, double energy, int first);
    int round; /* of the events at the present instant */
    unsigned log_enabled;
    int co_simulation, event_mode_used, early_return_allowed, inputs_move;
    Allocate allocate;
    Release release;
    Failure failure; /* the last one */
    int trying;      /* what fails is noted in `tried` only */
    Refusal tried;
    int passing;         /* a gradient passes an instant again, of which nobody is told */
    int bounded;         /* the work of a step is bounded: iterations end early */
    int budget;          /* rounds of events and further pieces that are left of a bounded step */
    int variables_valid; /* which values belong to the present point, see values.c */
    int look_valid;      /* the last look at the guards was at the present point */
    int implicit_kept;   /* there are factors of `implicit_matrix` */
    int by_lu;           /* what the step matrix was factorised by; otherwise by QR */
    int edgeless;        /* the piece is out of reach of edges */
    int edges_valid;     /* the first third of `edges` belongs to the present point */
    double edge_top;     /* a time at which an edge of the piece has another sign than at its ends, or infinity */
    double edges_kept;   /* the last third to the beginning of a step of this length, which ended there; or 0 */
    Gradient *gradient;  /* or NULL */
    int lands;           /* steps end where slopes may change: derivatives along them are as good as they are then */
} Instance;
