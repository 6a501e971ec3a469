/* The run-time of all models: types and functions behind the FMI functions.
 *
 * A model is data: tables and tapes, read from a file (model.h). All that changes lives in `State` and in the numbers
 * behind it, none of which are pointers, so that a copy of these bytes is a copy of the instance's state. Work memory
 * holds only what can be computed again. Nothing is static and mutable, so instances are independent of each other.
 *
 * The files are compiled one by one or all as one: names of static functions are not used twice. */
#ifndef CORE_H
#define CORE_H

#include "model.h"
#include "modelica_like.h" /* EXPORTED: what programs see that load this library */

/* Much of the standard is for what no model here has. */
#pragma GCC diagnostic ignored "-Wunused-parameter"

#define TIME_RESOLUTION 1e-10 /* as in guards_soon */
#define JUST_TRUE 1e-300      /* as in conditions.py */
#define AT_EDGE 1e-12         /* an edge or guard so close to zero rests there: rounding of values of about one */
#define MOST_DOUBTS 200 /* between two events, each of which makes a step shorter: a signal has decayed with fewer */
#define NOISE 1e-30     /* a decaying signal ends by swinging around zero with such values; that is no event */
#define ROUNDING_OF_STATES 1e-14
#define INSTANT 1e-9        /* duration of an impact; finite forces cancel whatever it is */
#define IDEAL_HEAD 3        /* numbers of an ideal element before its combination of equations, see row_of */
#define MAX_DAMPED 200      /* short steps follow a bend */
#define LEAST_PART 1e-6     /* of a step of Newton's method: shorter ones mean that nothing leads nearer */
#define SOLVED_DAMPED 1e-12 /* next step of such, in the unknowns: rounding of a condition of 1e3 */
#define CROWD 24            /* further instants in a short time follow each other ever faster */

#include "types.h"

/* tape.c */
void run_operations(const Tape *tape, double *slots);
void tape_run(const Tape *tape, double *slots, double *outputs);
void tape_tangent(const Tape *tape, const double *slots, double *dots, double *output_dots);
void tape_adjoint(const Tape *tape, const double *slots, double *bars, const double *output_bars);
void tape_adjoint_of(int count, const Tape *tape, const double *slots, double *bars, const double *const *output_bars);
void slopes(int operation, double a, double b, double f, double *by_left, double *by_right);
/* special.c */
const Tape *run_on_tape(Instance *c, const Tape *tape, double *outputs);
void run_special(Instance *c, const Tape *tape, double *outputs);
int output_place(const Tape *tape, const Tape *ran, int output);
void adjoint_of_ran(Instance *c, const Tape *tape, const Tape *ran, const double *bars);
void make_part(Instance *c, const Tape *tape, const unsigned char *wanted, int period);
void evaluate_part(Instance *c, double t, const double *point, double *outputs);
void ask_for(Instance *c, int node);
void mark_mattering(Instance *c, const Tape *tape);
void forget_sets(Instance *c);
/* linear.c */
int qr_factor(const QrPattern *pattern, const double *values, Instance *c);
void qr_solve(const QrPattern *pattern, const Instance *c, double *x);
void qr_solve_transposed(const QrPattern *pattern, const Instance *c, double *x);
int factor_matrix(Instance *c);
void combine(int n, const double *from, int count, const double *weights, const double *rows, int row, double *to);
void solve_step(const Instance *c, double *x);
void solve_step_transposed(const Instance *c, double *x);
int lu_factor(int n, double *matrix, int *order);
void lu_solve_transposed(int n, const double *matrix, const int *order, double *x);
double dot(int n, const double *p, const double *q);
double make_orthogonal(int rows, int columns, double *a, double *turns, double *b);
void least_squares(int rows, int columns, double *a, double *b, double *x);
void keeping_least_squares(int n, int states, double *a, double *turns, double *b, double *x);
void evaluate_special(Instance *c, const Tape *tape, double t, const double *point, double *outputs);
const Tape *evaluate_on_tape(Instance *c, const Tape *tape, double t, const double *point, double *outputs);
void load(Instance *c, double t, const double *point);
void load_decided(Instance *c);
void load_point(Instance *c, double t, const double *point);
void evaluate(Instance *c, const Tape *tape, double t, const double *point, double *outputs);
void evaluate_now(Instance *c, const Tape *tape, double *outputs); /* at the present point */
const double *variables_now(Instance *c);
double largest_of(int n, const double *values);
int any_of(const unsigned char *marks, int n);
Result solve_implicit(Instance *c, double t, double *point, int quiet);
Result solve_now(Instance *c, int quiet);
Result check_singular(Instance *c);
Result settle(Instance *c);
double input_at(const Instance *c, int k, double t);
/* code.c */
void values_at(Instance *c, const Tape *tape, double t, const double *point, double *outputs);
void values_now(Instance *c, const Tape *tape, double *outputs);
const unsigned char *active_guards(Instance *c);
int run_code(Instance *c, const Tape *tape, const unsigned char *wanted, double *outputs);
void run_slopes(Instance *c, double *rates, double *slopes);
int factor_by_code(Instance *c, double diagonal);
int take_stages_by_code(Instance *c, const Step *step);
/* start.c */
void start_values(Instance *c);
Result start_solve(Instance *c);
void choose_loose(Instance *c, const unsigned char *loose);
#define MODE_ROUNDS 5 /* in which modes and start values settle */
void begin_start(Instance *c);
const double *discrete_starts(Instance *c);
Result apply_fixed(Instance *c);
void apply_defaults(Instance *c);
int choose_start_modes(Instance *c, const double *begun, int declared);
Result complete_start(Instance *c);
const double *keep_start(Instance *c, KeptStart which, int back);
/* steady.c */
Result start_steady(Instance *c);
Result find_steady(Instance *c, int fixed, int defaults);
Result steady_near(Instance *c);
Result check_ticks(Instance *c);
/* holds.c */
#define UNLIMITED 1e30
#define ROUNDING 1e-10 /* relative size of a motion that is nothing but rounding */
void mark_held(const Instance *c, const Terms *terms, unsigned char *held);
void find_held(Instance *c, Terms *terms, unsigned char *held);
double largest_like(const Model *m, const double *values, int node);
int anything_shared(const Instance *c);
void share(Instance *c);
Result share_and_solve(Instance *c);
void rest(Instance *c);
void rest_rates(Instance *c, double *rates);
void replace_dependent(Instance *c);
int pushed(Instance *c);
#define GIVEN_BACK 1e-3 /* of the largest current: none where modes return, as it ends within the time resolution */
Result meet(Instance *c, double keep, int *any);
Result refuse_contradiction(Instance *c);
Result renew(Instance *c);
/* impacts.c */
void keep_motions(Instance *c);
Result stop_motions(Instance *c, const double *before, int jolts);
Result strike_here(Instance *c, const unsigned char *entering, unsigned char *knocked, int *hard);
/* delay.c */
#define MOST_PAST 16384 /* rows */
void keep_past(Instance *c, double t, const double *point, double order);
void keep_piece(Instance *c, double end);
void keep_before_change(Instance *c);
int delays_due(const Instance *c);
Result reach_instant(Instance *c);
Result leave_instant(Instance *c, int happened);
/* crowd.c */
double number_or_false(const Instance *c, int guard, double value);
void count_in_crowd(Instance *c, int transition);
void leave_crowd(Instance *c);
Result crowded(Instance *c);
/* events.c */
double just_after(const State *s);
int at_located_event(const State *s);
int is_source(const Instance *c, const Transition *one);
int guard_active(const Instance *c, int guard);
int has_fixed_moments(const Model *m);
double next_moment(Instance *c, int idle_too);
int is_due(Instance *c);
int find_wanting(Instance *c, unsigned char *wanting, int guards_too);
void drop_balanced(Instance *c, double *soon);
void drop_returning(Instance *c, const double *modes, double *soon);
Result iterate_events(Instance *c, unsigned char *wanting, int located);
int count_clocks(const Instance *c);
Result tick(Instance *c, double *step);
Result update_discrete(Instance *c, int *restart, double *next);
Result check_turned_back(Instance *c);
void note_change(Instance *c, int name, int transition, int mode, int target);
unsigned char *nothing_wanting(Instance *c);
/* resets.c */
void move_states(Instance *c, const int *nodes, const double *values, int count);
Result move_targets(Instance *c, int count);
int take_resets(Instance *c, const unsigned char *firing, double *d);
int take_updates(Instance *c, int *changes);
int may_jolt(const Model *m);
/* integrate.c */
double rosenbrock_step(Instance *c, double t, const double *first, double h, int keep_jacobian, Piece *piece);
double *last_of(const Model *m, Piece *piece);
double error_norm(const Instance *c, const double *first, const double *last, const double *error);
double least_step(const State *s);
double step_diagonal(double h);
int factor_step(Instance *c, double diagonal);
int factor_by_pattern(Instance *c, double diagonal);
int factor_at(Instance *c, double t, const double *first, double h);
size_t piece_size(const Model *m);
void piece_at(const Model *m, const Piece *piece, double t, double *point);
typedef enum { REACHED, AT_EVENT, FAILED } Arrival;
Arrival integrate_to(Instance *c, double target, int stop_at_events);
Result pass_instant(Instance *c, unsigned char *wanting, int located);
Result land_on_edges(Instance *c, double end);
Result handle_event(Instance *c);
Result finish(Instance *c);
Result check_whole(Instance *c, double size);
Result check_step(Instance *c, double point, double size, double *target);
Result move_to(Instance *c, double t);
Result take_changes(Instance *c);
/* panels.c */
static inline int takes_panels(const Instance *c) { return c->integrator != NULL && c->own_steps == 0; }
void piece_between(Instance *c, const Piece *whole, double begin, double end, Piece *piece);
int next_piece(Instance *c, double limit, double far);
void take_looks(Instance *c, Looks *looks);
/* locate.c */
#define MOST_LOOKS 11 /* at guards, that there is room for */
double cubic_guess(double g0, double r0, double g1, double r1);
int is_hump(double g0, double r0, double g1, double r1);
int search_events(Instance *c);
double soonest_zero(Instance *c);
const double *rounding_of_guards(Instance *c, const Piece *piece, double t);
/* edges.c */
double seen_length(Instance *c, double least, double *most);
void keep_edges(Instance *c);
int is_over_edge(Instance *c);
int is_steep(Instance *c, double before, double behind);
int is_corner(Instance *c, double before, double behind, double *room);
int jumps_between(Instance *c, double before, double behind);
double edge_ahead(Instance *c, double t, double *behind);
/* fixed.c */
Arrival step_fixed(Instance *c, double target);
/* values.c */
const Variable *find_variable(const Model *m, uint32_t reference);
const Variable *known_variable(Instance *c, uint32_t reference, ValueType type);
#define ANY_TYPE N_TYPES
Result get_value(Instance *c, const Variable *v, double *value);
Result find_all(Instance *c, int64_t count, const uint32_t *references, const Variable **found);
Result get_all(Instance *c, int64_t count, const Variable *const *found, double *values);
Result set_value(Instance *c, const Variable *v, double value);
Result set_input_rate(Instance *c, uint32_t reference, int order, double rate);
Result set_time(Instance *c, double time);
Result set_states(Instance *c, const double *x);
Result make_consistent(Instance *c);
Result check_tables(Instance *c);
void mark_tuned(Instance *c, int parameter);
void get_derivatives(Instance *c, double *derivatives);
void get_indicators(Instance *c, double *indicators);
/* derivatives.c */
Result directional(Instance *c, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns, size_t n_knowns,
    const double *seed, double *result);
Result adjoint(Instance *c, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns, size_t n_knowns,
    const double *seed, double *result);
Result check_knowns(Instance *c, const uint32_t *knowns, size_t n);
Result check_unknowns(Instance *c, const uint32_t *unknowns, size_t n);
void tangent_now(Instance *c, const Tape *tape, double *results);
void tangent_of_implicit(Instance *c);
void adjoint_of_implicit(Instance *c, int regular);
void seed_unknowns(Instance *c, const uint32_t *unknowns, size_t n_unknowns, const double *seed);
Result start_adjoint(Instance *c, double *start_bars);
void slope_of_node(Instance *c, int node, int again, double *by_state);
Result factor_implicit(Instance *c);
/* gradient.c */
void gradient_move(Instance *c, double t);
int gradient_round(Instance *c, int round, unsigned char *wanting, int any);
Result gradient_through(Instance *c, Result (*pass)(Instance *c), int start);
void gradient_lose(Instance *c, FailureCode why);
void gradient_end(Instance *c);
Result output_rate(Instance *c, uint32_t reference, int order, double *value);
/* instance.c */
Instance *instance_new(Instance bare, const char *token);
Instance *instance_open(Instance bare, const char *token, const char *location);
void instance_free(Instance *c);
void instance_reset(Instance *c);
Result set_experiment(
    Instance *c, int tolerance_defined, double tolerance, double start, int stop_defined, double stop);
Result state_copy_out(Instance *c, void **copy);
Result state_copy_in(Instance *c, const void *copy);
Result state_release(Instance *c, void **copy);
size_t state_size(const Instance *c);
Result state_write(Instance *c, const void *copy, unsigned char *bytes, size_t size);
Result state_read(Instance *c, const unsigned char *bytes, size_t size, void **copy);
Result report(Instance *c, LogCategory category, Result result, const char *format, ...);
/* Fails, with numbers and places in the order of the sentence in codes.h. */
Result fail_with(Instance *c, FailureCode code, double v0, double v1, double v2);
#define fail(c, name, ...) FAIL(c, FAILURE_##name, __VA_ARGS__, 0, 0, 0)
#define FAIL(c, code, v0, v1, v2, ...) fail_with(c, code, v0, v1, v2)
/* For calls that the interface does not allow. */
#define refuse(c, ...) report(c, LOG_ERROR, RESULT_ERROR, __VA_ARGS__)
Result set_log_category(Instance *c, const char *category, int on);
Result allowed(Instance *c, const char *function, int phases);

#endif
