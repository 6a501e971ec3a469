/* A model as data: tables and tapes, as model_file.py writes them. */
#ifndef MODEL_H
#define MODEL_H

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include "code.h"

#define OPERATION(name, value, by_a, by_b) OPERATION_##name,
typedef enum {
#include "operations.h"
    N_OPERATION_CODES
} OperationCode;
#undef OPERATION

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

typedef struct { /* pattern of a square matrix and of its QR factors, see tables.py */
    int size, n_ends, n_nonzeros, n_v, n_r;
    const int *colind, *row, *v_colind, *v_row, *r_colind, *r_row, *row_place, *column_order;
} QrPattern;

typedef struct { /* of its LU factors, see elimination.py: columns of L, which the last ones have not, and then of U */
    int n_ends, n_rows;
    const int *ends, *rows, *row_place, *column_order;
} LuPattern;

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
typedef enum { TYPE_FLOAT64, TYPE_ENUMERATION, TYPE_ARRAY, N_TYPES } ValueType;

typedef struct {
    uint32_t reference;
    int type, kind, index;
    int start;   /* start value that determines it, or -1; of an array: reference of its first element */
    int tunable; /* a parameter that may change during a run */
    int name;
    int count; /* elements of an array, whose references follow each other */
} Variable;    /* sorted by reference */

typedef struct {
    int below, above, below_name, above_name;
} Rising; /* parameters of which the second must exceed the first */

typedef struct { /* of a transition, or an update: at events, and where at_start is an entry of d, also at the start */
    int place;   /* among states, entries of d, and nodes that are reset */
    int value, transition, at_start;
    double factor;
} Reset;
typedef struct {
    int mode, target;
    short timed, ends; /* 1: the run ends with an error, 2: regularly */
    int index, name, notice;
    uint64_t sources;
} Transition;
typedef struct {
    int first_name, n_names, hidden; /* no names: a discrete value; hidden: of a relation, nobody has declared it */
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
    int row, mode, zero, other, name, unused; /* variables that are zero in mode 0, and in the other one */
    double nominal;
} Ideal;
typedef struct {
    int name, first; /* entry of d where its numbers begin: terms of a series, its begin, 2 over its length */
} Delay;
#define DELAY_TERMS 16 /* as in delay.py */
typedef struct {
    int position, start;
    double factor;
} StartOf;
typedef struct {
    int start, node, row;
} StartRow;
typedef struct {
    int n_d, n_y, steady, rates_depend_on_time;
    int implicit_linear;        /* the implicit equations are linear in z */
    int terminal;               /* entry of d that becomes 1 at the end of a run, or -1 */
    int ideal;                  /* entry of d where the rows of ideal elements begin */
    int n_edges, n_slope_edges; /* the first results of their tape: of slopes, then of guards; phases follow */
    int n_kinks;                /* the first edges of slopes; behind them are those of smooth functions */
    int rests;                  /* where impacts follow each other ever faster, they end in contact */
    int homotopy;               /* entry of d: share of the actual expressions of homotopies, or -1 */
    double absolute_to_relative, default_tolerance;
    double fixed_step; /* 0: as accuracy asks for */
} Settings;

typedef struct Model { /* tables lie in the bytes of the file; texts are offsets in `text` */
    int n_settings, n_text, n_token, n_x, n_z, n_p, n_u, n_constants, n_variables, n_rising, n_transitions, n_guards;
    int n_resets, n_reset_nodes, n_updates, n_modes, n_mode_names, n_holds, n_circuits, n_members, n_ideals, n_units;
    int n_start_modes, n_start_direct, n_start_default, n_start_guess, n_start_dependent, n_guesses, n_start_zero;
    int n_start_unknowns, n_steady, n_jacobian, n_delays;
    const Settings *settings;
    const char *text, *token;
    const double *constants, *parameters, *parameter_min, *parameter_max, *inputs, *guesses, *nominals;
    const Variable *variables;
    const Rising *rising;
    const Transition *transitions; /* in the order in which they are declared */
    const Reset *resets, *updates; /* results of their tapes */
    const Mode *modes;             /* by position in d */
    const Held *holds;
    const Circuit *circuits; /* those that depend on each other; in d from `first`: switches, then shares */
    const Ideal *ideals;
    const Delay *delays; /* in the order of the tape's results, each with value and time */
    const StartMode *start_modes;
    const StartOf *start_direct, *start_default, *start_guess;
    const StartRow *start_rows, *start_dependent;
    const int *state_names, *implicit_names, *singular_names, *mode_names, *reset_nodes, *members;
    const int *guard_transition, *start_zero, *start_columns;
    const int *units;  /* by node: which have the same unit; empty where nothing is held */
    const int *steady; /* unknowns that follow from zero rates, those of states first; empty for another start */
    /* Nonzeros of the step matrix: for every nonzero of the Jacobian, and for the diagonal of state k. */
    const int *jacobian_to_step, *step_diagonal;
    QrPattern step, start;
    LuPattern lu; /* of the step matrix */
    struct {
        Tape rates, jacobian, alg, alg_jacobian, variables, guards, edges, guards_soon, moments, resets, updates,
            start_conditions, start_values, discrete_starts, hold_terms, determinants, start_system, start_jacobian,
            derived, delays;
    } tapes;

    /* What follows from the sizes of the tables. */
    int n_unknowns, n_d, n_y, n_nodes, n_derived, n_moments, n_determinants, n_starts, n_start_values;
    int n_reset_values, most_members;
    int slot_x, slot_z, slot_p, slot_u, slot_d, slot_y, slot_constants, slot_results, n_slots;
    const Codes *codes; /* compiled, or NULL */
    int n_known;        /* values that their parameters and modes decide */
    unsigned char *own; /* bytes that belong to the model, or NULL */
    void (*release)(void *memory);
} Model;
enum { N_TAPES = sizeof((Model *)0)->tapes / sizeof(Tape) };
static inline const Tape *tapes_of(const Model *m) { return (const Tape *)(const void *)&m->tapes; }

/* model.c */
#define MESSAGE_LENGTH 512
/* What is wrong, in place of a model. */
#define REFUSE(...) (snprintf(message, MESSAGE_LENGTH, __VA_ARGS__), (void *)0)
typedef void *(*Allocate)(size_t count, size_t size);
typedef void (*Release)(void *memory);
void use_codes(Model *m, const Codes *codes);
Model *model_read(const unsigned char *bytes, size_t size, Allocate allocate, Release release, char *message);
void model_free(Model *m);
uint32_t crc32_of(const unsigned char *bytes, size_t size);
static inline const char *text_of(const Model *m, int place) { return m->text + place; }
Model *model_open(const char *location, Allocate allocate, Release release, char *message);

/* model_data.c: the bytes of the file where they are compiled in, of size 0 where they are read */
extern const uint64_t model_data[];
extern const size_t model_data_size;
extern const Codes *const model_codes; /* of the same model, or NULL */

#endif
