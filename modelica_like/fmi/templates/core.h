/* The run-time of all models: types and functions behind the FMI functions.
 *
 * A model is data: sizes in model.h, tables and tapes in model.c. All that changes lives in `State`, which holds no
 * pointers, so that a copy of its bytes is a copy of the instance's state. Work memory holds only what can be computed
 * again. Nothing is static and mutable, so instances are independent of each other.
 *
 * The files are compiled one by one or all as one: names of static functions are not used twice.
 */
#ifndef CORE_H
#define CORE_H

#include <stddef.h>
#include <stdint.h>
#include "model.h"

/* Compiled on a new Linux, the FMU is to run on an old one: these functions have got new versions since glibc 2.17.
   Versions can only be told to a linker that is given libm. */
#if defined(OLD_GLIBC) && defined(__GLIBC__) && defined(__x86_64__)
#define OLD(f) __asm__(".symver " #f "," #f "@GLIBC_2.2.5")
#elif defined(OLD_GLIBC) && defined(__GLIBC__) && defined(__aarch64__)
#define OLD(f) __asm__(".symver " #f "," #f "@GLIBC_2.17")
#endif
#ifdef OLD
OLD(exp);
OLD(log);
OLD(pow);
OLD(hypot);
OLD(fmod);
#endif

#define TIME_RESOLUTION 1e-10 /* as in guards_soon */
#define JUST_TRUE 1e-300      /* as in conditions.py */
#define NOISE 1e-30           /* a decaying signal ends by swinging around zero with such values; that is no event */
#define CROWD 24              /* further instants in a short time follow each other ever faster */
#define AT_LEAST_ONE(n) ((n) > 0 ? (n) : 1)
#define N_UNKNOWNS (N_X + N_Z)
#define SLOT_T 0
#define SLOT_X 1
#define SLOT_Z (SLOT_X + N_X)
#define SLOT_P (SLOT_Z + N_Z)
#define SLOT_U (SLOT_P + N_P)
#define SLOT_D (SLOT_U + N_U)
#define SLOT_Y (SLOT_D + N_D)
#define SLOT_CONSTANTS (SLOT_Y + N_Y)
#define SLOT_RESULTS (SLOT_CONSTANTS + N_CONSTANTS)
#define N_SLOTS (SLOT_RESULTS + N_OPERATIONS)

typedef enum { RESULT_OK, RESULT_DISCARD, RESULT_ERROR } Result;

/* ---- tables of the model (model.c) ------------------------------------------------------------------------------ */

/* clang-format off */
/* The order is that of OPERATIONS in tape.py. */
typedef enum {
    OPERATION_ADD, OPERATION_SUB, OPERATION_MUL, OPERATION_DIV, OPERATION_NEG, OPERATION_EXP, OPERATION_LOG,
    OPERATION_POW, OPERATION_CONSTPOW, OPERATION_SQRT, OPERATION_SQ, OPERATION_TWICE, OPERATION_SIN, OPERATION_COS,
    OPERATION_TAN, OPERATION_ASIN, OPERATION_ACOS, OPERATION_ATAN, OPERATION_LT, OPERATION_LE, OPERATION_EQ,
    OPERATION_NE, OPERATION_NOT, OPERATION_AND, OPERATION_OR, OPERATION_FLOOR, OPERATION_CEIL, OPERATION_FMOD,
    OPERATION_REMAINDER, OPERATION_FABS, OPERATION_SIGN, OPERATION_COPYSIGN, OPERATION_IF_ELSE_ZERO, OPERATION_ERF,
    OPERATION_FMIN, OPERATION_FMAX, OPERATION_INV, OPERATION_SINH, OPERATION_COSH, OPERATION_TANH, OPERATION_ASINH,
    OPERATION_ACOSH, OPERATION_ATANH, OPERATION_ATAN2, OPERATION_HYPOT, OPERATION_LOG1P, OPERATION_EXPM1
} OperationCode;
/* clang-format on */

typedef struct {
    int operation, count;
} Run;
typedef struct {
    int left, right;
} Operands; /* slots */

typedef struct { /* see tape.py */
    int n_operations, n_runs, n_outputs;
    const Run *runs;          /* equal operations that follow each other */
    const Operands *operands; /* of all operations; operation k writes slot SLOT_RESULTS + k */
    const int *outputs;       /* slots */
} Tape;

typedef struct { /* pattern of a square matrix and of its QR factors, see sparse.py */
    int size, n_nonzeros, n_v, n_r;
    const int *colind, *row, *v_colind, *v_row, *r_colind, *r_row, *row_place, *column_order;
} QrPattern;

typedef enum {
    KIND_TIME,
    KIND_STATE,
    KIND_DERIVATIVE,
    KIND_VARIABLE,
    KIND_PARAMETER,
    KIND_DERIVED,
    KIND_INPUT,
    KIND_DISCRETE,
    KIND_GUARD
} Kind;
typedef enum { TYPE_FLOAT64, TYPE_ENUMERATION } ValueType;

typedef struct {
    uint32_t reference;
    ValueType type;
    Kind kind;
    int index;
    int start;   /* start value that determines it, or -1 */
    int tunable; /* a parameter that may change during a run */
    const char *name;
} Variable; /* sorted by reference */

typedef enum { RESET_STATE, RESET_DISCRETE, RESET_VALUE } ResetKind;
typedef struct {
    ResetKind kind;
    int index;
    double factor;
    int value, target;
} Reset;
typedef struct {
    int mode;
    uint64_t sources;
    int target, timed, index, first_reset, n_resets;
    const char *name, *notice;
} Transition;
typedef struct {
    int mode, target;
} StartMode;
typedef struct {
    int mode, number, loose, motion, state;
    double factor;
    int reaction, approach, moved;
    double nominal;
    const char *name;
} Held; /* see CompiledHold in compiled.py; state -1: the motion is none; moved: something but states moves it */
typedef struct {
    int first_member, n_members, first;
} Circuit;
typedef struct {
    int position, start;
    double factor;
} StartOf;
typedef struct {
    int start, node, row;
} StartRow;

extern const char *const model_token;
extern const double model_constants[], model_parameters[], model_inputs[], model_guesses[], model_z_guesses[],
    model_nominals[];
extern const double model_parameter_min[], model_parameter_max[];
extern const Variable model_variables[];
extern const Transition model_transitions[]; /* in the order in which they are declared */
extern const int model_guard_transition[];   /* transition of every guard */
extern const Reset model_resets[];
extern const int model_reset_nodes[];
extern const char *const *const model_mode_names[]; /* by position in d; NULL for discrete values */
extern const int model_mode_counts[];
extern const char *const model_state_names[], *const model_implicit_names[], *const model_singular_names[];

extern const Held model_holds[];
extern const Circuit model_circuits[]; /* those that depend on each other; in d from `first`: switches, then shares */
extern const int model_members[];
extern const int model_units[]; /* by node: which have the same unit; empty where nothing is held */

extern const StartMode model_start_modes[];
extern const StartOf model_start_direct[], model_start_x_guess[], model_start_z_guess[], model_start_default[];
extern const StartRow model_start_rows[], model_start_dependent[];
extern const int model_start_zero[], model_start_columns[], model_steady_states[];

extern const Tape tape_rates, tape_jacobian, tape_alg, tape_alg_jacobian, tape_variables, tape_guards, tape_guards_soon;
extern const Tape tape_moments, tape_resets, tape_start_conditions, tape_start_values, tape_discrete_starts;
extern const Tape tape_hold_terms, tape_determinants, tape_start_system, tape_start_jacobian, tape_derived;
extern const QrPattern pattern_step, pattern_start;
extern const int jacobian_to_step[]; /* nonzero of the Jacobian -> nonzero of the step matrix */
extern const int step_diagonal[];    /* nonzero of the step matrix on the diagonal of state k */

/* ---- state and instance ----------------------------------------------------------------------------------------- */

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

typedef struct { /* an accepted integrator step with its dense output */
    double begin, end;
    double first[AT_LEAST_ONE(N_UNKNOWNS)], last[AT_LEAST_ONE(N_UNKNOWNS)];
    double dense[3][AT_LEAST_ONE(N_UNKNOWNS)];
} Piece;

typedef struct {
    double t, x[AT_LEAST_ONE(N_X)], z[AT_LEAST_ONE(N_Z)], p[AT_LEAST_ONE(N_P)], u[AT_LEAST_ONE(N_U)],
        d[AT_LEAST_ONE(N_D)];
    double u_rate[AT_LEAST_ONE(N_U)], u_time; /* inputs are u + u_rate * (t - u_time) */
    double start_value[AT_LEAST_ONE(N_STARTS)];
    unsigned char start_given[AT_LEAST_ONE(N_STARTS)], mode_given[AT_LEAST_ONE(N_D)];
    unsigned char wanting[AT_LEAST_ONE(N_TRANSITIONS)]; /* transitions that fire at the end of the piece */
    int phase, solved, z_valid, inputs_changed, piece_valid, event_pending, at_event;
    double tolerance, start_time, stop_time;
    int stop_time_defined;
    Piece piece;
    double step;            /* next step size, 0: choose one */
    double instants[CROWD]; /* of the last events, in a circle */
    int n_instants;
    double n_steps, n_rejected, n_events;
} State;

typedef void (*AnyFunction)(void); /* a callback of the importer, cast back before it is called */

struct Instance;
typedef void (*LogFunction)(const struct Instance *c, int status, const char *category, const char *message);

typedef enum { LOG_ERROR = 1, LOG_WARNING = 2, LOG_EVENTS = 4, LOG_INTEGRATOR = 8, LOG_ALL = 15 } LogCategory;

typedef struct {
    double *slots, *dots; /* values, and derivatives in either direction or three Taylor coefficients, of tape slots */
    double *jacobian, *matrix, *qr_v, *qr_r, *qr_beta, *qr_work;
    double *stages, *point; /* of the integrator: 8 stages, a point */
    double *variables, *guards, *guards_before, *rhs, *dense_matrix, *square, *vector;
    double *start_unknowns, *start_values, *start_residual;
} Work;

typedef struct Instance {
    State state;
    Work work;
    double *memory;
    char *name;
    void *environment;
    AnyFunction logger, intermediate_update;
    LogFunction log;
    double (*step_finished)(struct Instance *c); /* tells until when to go on; or NULL */
    unsigned log_enabled;
    int co_simulation, event_mode_used, early_return_allowed, inputs_move;
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    int variables_valid; /* work.variables belong to the present point */
} Instance;

/* tape.c */
void tape_run(const Tape *tape, double *slots, double *outputs);
void tape_tangent(const Tape *tape, const double *slots, double *dots, double *output_dots);
void tape_adjoint(const Tape *tape, const double *slots, double *bars, const double *output_bars);
void tape_reaches(const Tape *tape, double *marks, const double *output_marks);

/* linear.c */
int qr_factor(const QrPattern *pattern, const double *values, Work *work);
void qr_solve(const QrPattern *pattern, const Work *work, double *x);
int lu_factor(int n, double *matrix, int *order);
void lu_solve(int n, const double *matrix, const int *order, double *x);
void lu_solve_transposed(int n, const double *matrix, const int *order, double *x);
void make_orthogonal(int rows, int columns, double *a, double *turns, double *b);
void least_squares(int rows, int columns, double *a, double *b, double *x);
void keeping_least_squares(int n, int states, double *a, double *turns, double *b, double *x);

/* point.c */
void evaluate(Instance *c, const Tape *tape, double t, const double *x, const double *z, double *outputs);
Result solve_implicit(Instance *c, double t, const double *x, double *z, int quiet);
Result check_singular(Instance *c);
Result settle(Instance *c);
double input_at(const State *s, int k, double t);

/* start.c */
void start_defaults(Instance *c);
Result start_solve(Instance *c);
int choose_modes(Instance *c, unsigned char *decided);

/* holds.c */
#define UNLIMITED 1e30
#define ROUNDING 1e-10 /* relative size of a motion that is nothing but rounding */
typedef struct {
    double gain, forward, backward, restitution;
} Terms;
void hold_terms(Instance *c, Terms *terms);
void mark_held(Instance *c, const Terms *terms, unsigned char *held);
double largest_like(const double *values, int node);
void share(Instance *c);
void rest(Instance *c);
void rest_rates(Instance *c, double *rates);

/* impacts.c */
typedef struct { /* at one instant: what has been stopped, and the states before the first impact */
    int struck;
    double x[AT_LEAST_ONE(N_X)];
    unsigned char entered[AT_LEAST_ONE(N_HOLDS)];
} Impacts;
Result stop_motions(Instance *c, const double *before, Impacts *impacts);

/* events.c */
int guard_active(const State *s, int guard);
double next_moment(Instance *c);
int find_wanting(Instance *c, unsigned char *wanting, int guards_too);
Result iterate_events(Instance *c, unsigned char *wanting, int located);
double number_or_false(double guard);
void note_change(Instance *c, const char *name, int mode, int target);

/* rosenbrock.c */
int rosenbrock_step(
    Instance *c, double t, const double *first, double h, int keep_jacobian, Piece *piece, double *error);
void piece_at(const Piece *piece, double t, double *point);
double first_step(Instance *c);

/* integrate.c */
typedef enum { REACHED, AT_EVENT, FAILED } Arrival;
Arrival integrate_to(Instance *c, double target, int stop_at_events);
void leave_piece(Instance *c);
Result handle_event(Instance *c);
Result update_discrete(Instance *c, int *restart, double *next);
Result check_step(Instance *c, double point, double size, double *target);

/* values.c */
const Variable *find_variable(uint32_t reference);
const Variable *known_variable(Instance *c, uint32_t reference, ValueType type);
Result get_float(Instance *c, uint32_t reference, double *value);
Result get_mode(Instance *c, uint32_t reference, int *value);
Result set_float(Instance *c, uint32_t reference, double value);
Result set_mode(Instance *c, uint32_t reference, int64_t value);
Result set_input_rate(Instance *c, uint32_t reference, double rate);
Result set_time(Instance *c, double time);
Result set_states(Instance *c, const double *x);
Result make_consistent(Instance *c);
void get_derivatives(Instance *c, double *derivatives);
void get_indicators(Instance *c, double *indicators);

/* derivatives.c */
Result directional(Instance *c, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns, size_t n_knowns,
    const double *seed, double *result);
Result adjoint(Instance *c, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns, size_t n_knowns,
    const double *seed, double *result);
void adjoint_of_node(Instance *c, int node, double *by_state);
Result factor_implicit(Instance *c, int *order);
size_t dependencies(Instance *c, uint32_t unknown, uint32_t *knowns, size_t capacity, Result *result);

/* taylor.c */
Result output_rate(Instance *c, uint32_t reference, int order, double *value);

/* instance.c */
Instance *instance_new(const char *name, const char *token, void *(*allocate)(size_t, size_t), void (*release)(void *),
    LogFunction log, AnyFunction logger, void *environment, int logging);
void instance_free(Instance *c);
void instance_reset(Instance *c);
Result set_experiment(
    Instance *c, int tolerance_defined, double tolerance, double start, int stop_defined, double stop);
Result state_copy_out(Instance *c, void **copy);
Result state_copy_in(Instance *c, const void *copy);
void state_release(Instance *c, void **copy);
size_t state_size(void);
Result state_write(Instance *c, const void *copy, unsigned char *bytes, size_t size);
Result state_read(Instance *c, const unsigned char *bytes, size_t size, void **copy);
Result report(Instance *c, LogCategory category, Result result, const char *format, ...);
Result set_log_category(Instance *c, const char *category, int on);
Result allowed(Instance *c, const char *function, int phases);

#endif
