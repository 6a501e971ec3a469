/* The run-time of all models: types and functions behind the FMI functions.
 *
 * A model is data: tables and tapes, read from a file (model.c). All that changes lives in `State` and in the numbers
 * behind it, none of which are pointers, so that a copy of these bytes is a copy of the instance's state. Work memory
 * holds only what can be computed again. Nothing is static and mutable, so instances are independent of each other.
 *
 * The files are compiled one by one or all as one: names of static functions are not used twice.
 */
#ifndef CORE_H
#define CORE_H

#include <stddef.h>
#include <stdint.h>

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

typedef enum { RESULT_OK, RESULT_DISCARD, RESULT_ERROR } Result;

/* ---- tables of the model ---------------------------------------------------------------------------------------- */

/* clang-format off */
/* The order is that of OPERATIONS in tape.py. */
typedef enum {
    OPERATION_ADD, OPERATION_SUB, OPERATION_MUL, OPERATION_DIV, OPERATION_NEG, OPERATION_EXP, OPERATION_LOG,
    OPERATION_POW, OPERATION_CONSTPOW, OPERATION_SQRT, OPERATION_SQ, OPERATION_TWICE, OPERATION_SIN, OPERATION_COS,
    OPERATION_TAN, OPERATION_ASIN, OPERATION_ACOS, OPERATION_ATAN, OPERATION_LT, OPERATION_LE, OPERATION_EQ,
    OPERATION_NE, OPERATION_NOT, OPERATION_AND, OPERATION_OR, OPERATION_FLOOR, OPERATION_CEIL, OPERATION_FMOD,
    OPERATION_REMAINDER, OPERATION_FABS, OPERATION_SIGN, OPERATION_COPYSIGN, OPERATION_IF_ELSE_ZERO, OPERATION_ERF,
    OPERATION_FMIN, OPERATION_FMAX, OPERATION_INV, OPERATION_SINH, OPERATION_COSH, OPERATION_TANH, OPERATION_ASINH,
    OPERATION_ACOSH, OPERATION_ATANH, OPERATION_ATAN2, OPERATION_HYPOT, OPERATION_LOG1P, OPERATION_EXPM1,
    N_OPERATION_CODES
} OperationCode;
/* clang-format on */

/* Records lie in the file as they lie in memory: numbers of 4 and 8 bytes, without gaps. */
typedef struct {
    int operation, count;
} Run;
typedef struct {
    int left, right;
} Operands; /* slots */

typedef struct { /* see tape.py */
    int n_operations, n_runs, n_outputs, first_result;
    const Run *runs;          /* equal operations that follow each other */
    const Operands *operands; /* of all operations; operation k writes slot first_result + k */
    const int *outputs;       /* slots */
} Tape;

typedef struct { /* pattern of a square matrix and of its QR factors, see sparse.py */
    int size, n_ends, n_nonzeros, n_v, n_r;
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
    KIND_GUARD,
    N_KINDS
} Kind;
typedef enum { TYPE_FLOAT64, TYPE_ENUMERATION, N_TYPES } ValueType;

typedef struct {
    uint32_t reference;
    int type, kind, index;
    int start;   /* start value that determines it, or -1 */
    int tunable; /* a parameter that may change during a run */
    int name;
} Variable; /* sorted by reference */

typedef enum { RESET_STATE, RESET_DISCRETE, RESET_VALUE, N_RESET_KINDS } ResetKind;
typedef struct {
    int kind, index, value, target;
    double factor;
} Reset;
typedef struct {
    int mode, target, timed, index, first_reset, n_resets, name, notice;
    uint64_t sources;
} Transition;
typedef struct {
    int first_name, n_names; /* none: a discrete value */
} Mode;
typedef struct {
    int mode, target;
} StartMode;
typedef struct {
    int mode, number, loose, motion, state, reaction, approach, moved, name, unused;
    double factor, nominal;
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
typedef struct {
    int n_d, n_y, steady, rates_depend_on_time;
    int implicit_linear, unused; /* the implicit equations are linear in z */
    double absolute_to_relative, default_tolerance;
    double fixed_step; /* 0: as accuracy asks for */
} Settings;

typedef struct Model { /* tables lie in the bytes of the file; texts are offsets in `text` */
    const Settings *settings;
    const char *text, *token;
    int n_settings, n_text, n_token, n_x, n_z, n_p, n_u, n_constants, n_variables;
    const double *constants, *parameters, *parameter_min, *parameter_max, *inputs, *guesses, *z_guesses, *nominals;
    const int *state_names, *implicit_names, *singular_names;
    const Variable *variables;

    int n_transitions, n_guards, n_resets, n_reset_nodes, n_modes, n_mode_names;
    const Transition *transitions; /* in the order in which they are declared */
    const int *guard_transition;   /* transition of every guard */
    const Reset *resets;
    const int *reset_nodes;
    const Mode *modes; /* by position in d */
    const int *mode_names;

    int n_holds, n_circuits, n_members, n_units;
    const Held *holds;
    const Circuit *circuits; /* those that depend on each other; in d from `first`: switches, then shares */
    const int *members;
    const int *units; /* by node: which have the same unit; empty where nothing is held */

    int n_start_modes, n_start_direct, n_start_default, n_start_x_guess, n_start_z_guess, n_start_dependent;
    int n_start_zero, n_start_unknowns, n_steady;
    const StartMode *start_modes;
    const StartOf *start_direct, *start_default, *start_x_guess, *start_z_guess;
    const StartRow *start_rows, *start_dependent;
    const int *start_zero, *start_columns, *steady_states;

    int n_jacobian;
    const int *jacobian_to_step; /* nonzero of the Jacobian -> nonzero of the step matrix */
    const int *step_diagonal;    /* nonzero of the step matrix on the diagonal of state k */
    QrPattern step, start;
    struct {
        Tape rates, jacobian, alg, alg_jacobian, variables, guards, guards_soon, moments, resets, start_conditions,
            start_values, discrete_starts, hold_terms, determinants, start_system, start_jacobian, derived;
    } tapes;

    /* What follows from the sizes of the tables. */
    int n_unknowns, n_d, n_y, n_nodes, n_derived, n_moments, n_determinants, n_starts, n_start_values;
    int n_start_jacobian, n_reset_values, most_members;
    int slot_x, slot_z, slot_p, slot_u, slot_d, slot_y, slot_constants, slot_results, n_slots;
    unsigned char *own; /* bytes that belong to the model, or NULL */
    void (*release)(void *memory);
} Model;
enum { N_TAPES = sizeof((Model *)0)->tapes / sizeof(Tape) };

/* model.c */
#define MESSAGE_LENGTH 512
typedef void *(*Allocate)(size_t count, size_t size);
typedef void (*Release)(void *memory);
Model *model_read(const unsigned char *bytes, size_t size, Allocate allocate, Release release, char *message);
void model_free(Model *m);
static inline const char *text_of(const Model *m, int place) { return m->text + place; }

/* model_check.c */
int damaged(char *message, const char *what);
int check_model(const Model *m, char *message);

/* model_file.c */
Model *model_open(const char *location, Allocate allocate, Release release, char *message);

/* model_data.c: the bytes of the file where they are compiled in, of size 0 where they are read */
extern const uint64_t model_data[];
extern const size_t model_data_size;

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

typedef struct { /* an accepted integrator step: its first and last point, and three for dense output */
    double begin, end, points[];
} Piece;

typedef struct { /* what changes; arrays of the model's sizes stand behind it, see `Instance` */
    double t, u_time;
    int phase, solved, z_valid, inputs_changed, piece_valid, event_pending, at_event;
    int looked; /* the guards are known from the end of the last fixed step */
    double tolerance, start_time, stop_time;
    int stop_time_defined;
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
    double gain, forward, backward, restitution;
} Terms; /* of a motion that modes hold */

typedef struct { /* an impact: of all motions that modes hold */
    double *before, *approach, *impulse, *reaction;
    unsigned char *entering, *loose, *held;
    unsigned char *knocked; /* let go in the impact itself */
    double *jump;           /* of the states */
    int hard;               /* what nothing limits stops more than what rounding leaves */
} Strike;

typedef struct { /* at one instant: what has been stopped, and the states before the first impact */
    int struck;
    double *x;
    unsigned char *entered;
} Impacts;

/* Arrays of the model's sizes. Those of single functions are named after them; a function that calls another one does
 * not share with it. */
typedef struct {
    double *slots, *dots; /* values, and derivatives in either direction, of tape slots */
    double *jacobian, *matrix, *qr_v, *qr_r, *qr_beta, *qr_work;
    double *stages, *point; /* of the integrator: 8 stages, a point */
    double *variables, *guards, *guards_before, *rhs, *dense_matrix, *square, *vector, *residual;
    double *start_unknowns, *start_values, *start_residual;
    int *order; /* pivots of the implicit equations */
    unsigned char *known, *decided, *wanting;
    double *d_before, *x_before, *d_fired, *reset_values, *target_values;
    int *targets;
    unsigned char *changed;
    double *first; /* point before a step */
    Piece *whole;
    unsigned char *kinds;
    Terms *terms, *strike_terms;
    unsigned char *held, *other;
    double *weights, *base_weights, *use, *best, *kept_z, *reactions, *sizes, *zeros;
    int *places, *member, *pivots;
    Strike strike;
    Impacts impacts;
    double *respond_d, *respond_z, *rates, *x_kept;
} Work;

typedef struct Instance {
    const Model *model;
    Model *own_model; /* to be freed with the instance, or NULL */
    State state;
    double *numbers; /* the rest of the state: the arrays that follow */
    size_t n_numbers;
    double *x, *z, *p, *u, *d;
    double *u_rate; /* inputs are u + u_rate * (t - u_time) */
    double *start_value;
    unsigned char *start_given, *mode_given;
    unsigned char *wanting; /* transitions that fire at the end of the piece */
    Piece *piece;
    double *looks; /* guards and their rates at the end of the last fixed step */
    Work work;
    char *name;
    void *environment;
    AnyFunction logger, intermediate_update;
    LogFunction log;
    double (*step_finished)(struct Instance *c); /* tells until when to go on; or NULL */
    unsigned log_enabled;
    int co_simulation, event_mode_used, early_return_allowed;
    Allocate allocate;
    Release release;
    int bounded;         /* the work of a step is bounded: iterations end early */
    int budget;          /* rounds of events and further pieces that are left of a bounded step */
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
double input_at(const Instance *c, int k, double t);

/* start.c */
void start_defaults(Instance *c);
Result start_solve(Instance *c);
int choose_modes(Instance *c, unsigned char *decided);

/* holds.c */
#define UNLIMITED 1e30
#define ROUNDING 1e-10 /* relative size of a motion that is nothing but rounding */
void hold_terms(Instance *c, Terms *terms);
void mark_held(Instance *c, const Terms *terms, unsigned char *held);
double largest_like(const Model *m, const double *values, int node);
int anything_shared(const Instance *c);
void share(Instance *c);
void rest(Instance *c);
void rest_rates(Instance *c, double *rates);

/* impacts.c */
Result stop_motions(Instance *c, const double *before, Impacts *impacts);

/* events.c */
int guard_active(const Instance *c, int guard);
double next_moment(Instance *c);
int find_wanting(Instance *c, unsigned char *wanting, int guards_too);
Result iterate_events(Instance *c, unsigned char *wanting, int located);
double number_or_false(double guard);
void note_change(Instance *c, int name, int mode, int target);
unsigned char *nothing_wanting(Instance *c);

/* rosenbrock.c */
int rosenbrock_step(Instance *c, double t, const double *first, double h, Piece *piece, double *error);
double *last_of(const Model *m, Piece *piece);
size_t piece_size(const Model *m);
void piece_at(const Model *m, const Piece *piece, double t, double *point);
double first_step(Instance *c);

/* integrate.c */
typedef enum { REACHED, AT_EVENT, FAILED } Arrival;
Arrival integrate_to(Instance *c, double target, int stop_at_events);
void leave_piece(Instance *c);
Result handle_event(Instance *c);
Result check_step(Instance *c, double point, double size, double *target);

double cubic_guess(double g0, double r0, double g1, double r1);
Result move_to(Instance *c, double t);
Result take_changes(Instance *c, int *event);
int is_due(Instance *c);

/* fixed.c */
Arrival step_fixed(Instance *c, double target);

/* values.c */
const Variable *find_variable(const Model *m, uint32_t reference);
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
void slope_of_node(Instance *c, int node, int again, double *by_state);
Result output_rate(Instance *c, uint32_t reference, double *value);
size_t dependencies(Instance *c, uint32_t unknown, uint32_t *knowns, size_t capacity, Result *result);

/* instance.c */
Instance *instance_new(const Model *model, const char *name, const char *token, Allocate allocate, Release release,
    LogFunction log, AnyFunction logger, void *environment, int logging);
Instance *instance_open(const char *location, const char *name, const char *token, Allocate allocate, Release release,
    LogFunction log, AnyFunction logger, void *environment, int logging);
void instance_free(Instance *c);
void instance_reset(Instance *c);
Result set_experiment(
    Instance *c, int tolerance_defined, double tolerance, double start, int stop_defined, double stop);
Result state_copy_out(Instance *c, void **copy);
Result state_copy_in(Instance *c, const void *copy);
void state_release(Instance *c, void **copy);
size_t state_size(const Instance *c);
Result state_write(Instance *c, const void *copy, unsigned char *bytes, size_t size);
Result state_read(Instance *c, const unsigned char *bytes, size_t size, void **copy);
Result report(Instance *c, LogCategory category, Result result, const char *format, ...);
Result set_log_category(Instance *c, const char *category, int on);
Result allowed(Instance *c, const char *function, int phases);

#endif
