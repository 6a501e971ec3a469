/* What can go wrong in a model, and how an importer is told: FAILURE(name, sentence). The numbers of these codes are
 * those of native/codes.py. In a sentence %g stands for a number, another letter for a place and its name:
 * A above and C (of the same place) below in a table's column, B a block, D a delay, E a start value, I an ideal
 * element, N the notice of a transition, R a value reference, S a state, T the mode of a transition, V the variable of
 * a value reference, X a variable by its number, Z an implicit unknown. */
#define CANNOT_SET(why) "%V cannot be set: " why
#define NO_DERIVATIVES(why) "There are no derivatives with respect to %V after t = %g s: " why "."
#define STUCK_TWICE "Where two frictions stick on the same motion, make one compliant, or let one start open."

FAILURE(MISUSED, "") /* a call that the interface does not allow: it has its own sentence, see `refuse` */
/* Starts */
FAILURE(STARTS_CONTRADICT, "The start value of %E contradicts another one of the same motion: it must be %g, not %g.")
FAILURE(START_NOT_MET, "The start value %g of %E cannot be met: it would be %g.")
FAILURE(START_NOT_FOUND, "No start was found that meets all start values. Give others, or start values of states.")
FAILURE(START_NOT_SETTLED, "The modes at the start do not settle: they and the start values keep changing each other.")
FAILURE(NOT_STEADY, "No steady state was found at t = %g s.")
FAILURE(MODE_NOT_STEADY, "No steady state was found at t = %g s: %T does not stay in its mode.")
FAILURE(MEMORY_NOT_STEADY, "No steady state was found at t = %g s: what clocks set does not stay as it is.")
FAILURE(START_SINGULAR, "The start equations are singular at t = %g s.")
/* Equations */
FAILURE(UNKNOWN_SINGULAR, "The Jacobian is singular at t = %g s in the equations for %Z. " STUCK_TWICE)
FAILURE(BLOCK_SINGULAR, "The Jacobian is singular at t = %g s in the equations for %B. " STUCK_TWICE)
FAILURE(IMPLICIT_SINGULAR, "The implicit equations are singular at t = %g s.")
FAILURE(NOT_SOLVED, "The equations for %Z were not solved at t = %g s.")
FAILURE(RATE_NOT_FINITE, "The derivative of %S is not finite at t = %g s. Look for a mass, inertia or ratio of zero.")
FAILURE(STEP_TOO_SMALL,
    "The integrator gave up at t = %g s: the step became too small. Look for a stiff spring, a vanishing mass or a "
    "speed without bound.")
FAILURE(FIXED_STEP_FAILED,
    "The step from t = %g s gives values that are not finite, or singular equations. Take smaller steps.")
/* Events */
FAILURE(LIMIT_PASSED, "t = %g s: %N")
FAILURE(EVER_FASTER, "Events follow each other ever faster at t = %g s. Give the switching a hysteresis, or smooth it.")
FAILURE(NOT_SETTLED, "Discrete variables do not settle at t = %g s: they still change after %g rounds.")
FAILURE(STILL_SWITCHING,
    "Modes still switch after %g rounds at t = %g s: %T. Give the switching a hysteresis, or smooth what drives it.")
FAILURE(STAYS_TRUE,
    "At %g s the condition of %T stays true: what is set there is at rest, and would pass without another event. Let "
    "it rest: a mode that holds the motion, with a restitution.")
FAILURE(TWO_NEW_VALUES, "At t = %g s %S gets two new values. Give one to each motion only.")
FAILURE(NEW_VALUE_CONTRADICTS,
    "At t = %g s %X cannot become %g: something else determines it. Give new values to what is free to take them only.")
FAILURE(NO_VALID_MODES,
    "At t = %g s no combination of modes is valid: %I would take %g at once. Give the current another path (a "
    "freewheeling diode), or put a resistance in series with a capacitor.")
FAILURE(CONTRADICTS,
    "At t = %g s %I contradicts the rest of the circuit: it is ideal and makes zero what the rest makes %g. Put a "
    "resistance in series or in parallel with it.")
FAILURE(DELAY_NOT_POSITIVE, "The time of %D is %g s: it must be positive.")
FAILURE(PAST_TOO_LONG,
    "Delays reach back over more than %g points of the past. Shorten them, or ask for less precise results.")
/* Values */
FAILURE(BELOW_LEAST, "%V = %g is out of range: it must be at least %g.")
FAILURE(ABOVE_MOST, "%V = %g is out of range: it must be at most %g.")
FAILURE(COLUMN_FALLS, "%A = %g is not above %C = %g: this column of the table must rise.")
FAILURE(NO_SUCH_MODE, "%V has no mode %g: they are 0 to %g.")
FAILURE(NOT_FINITE, CANNOT_SET("the value is not a finite number."))
FAILURE(STATE_NOT_FINITE, "%S cannot be set: the value is not a finite number.")
FAILURE(PARAMETER_FIXED, CANNOT_SET("it is a fixed parameter. Set it before the end of the initialization."))
FAILURE(TUNED_OUTSIDE_EVENTS, CANNOT_SET("tunable parameters change in event mode only."))
FAILURE(START_TOO_LATE, CANNOT_SET("start values are settable before the end of the initialization only."))
FAILURE(FOLLOWS, CANNOT_SET("it follows from other variables."))
FAILURE(NO_INPUT, CANNOT_SET("it is not an input, so it has no input derivative."))
FAILURE(INPUT_RATE_NOT_FINITE, CANNOT_SET("the derivative is not a finite number."))
FAILURE(SPAN, "The start time %g s must be finite and not after the stop time %g s.")
FAILURE(TOLERANCE, "The tolerance must be between 0 and 1, not %g.")
FAILURE(NOT_WHOLE_STEPS, "The step of %g s is not a whole number of fixed steps of %g s, for which the model was made.")
FAILURE(NO_MEMORY, "There is not enough memory.")
/* Derivatives: what has none, and since when there are none of a run */
FAILURE(BY_NOTHING, "Derivatives with respect to %V are not available: it is neither state, input nor parameter.")
FAILURE(
    BY_NO_START, "Derivatives with respect to %V are not available: it is neither a start value, input nor parameter.")
FAILURE(OF_DISCRETE, "%V changes at events only: it has no derivatives.")
FAILURE(NO_VARIABLE, "There is no variable with value reference %R.")
FAILURE(OF_ARRAY, "The variable with value reference %R is an array: it has no derivatives.")
FAILURE(NOT_REAL, "The variable with value reference %R is not of type Real (Float64).")
FAILURE(NOT_ENUMERATION, "The variable with value reference %R is not of type Enumeration (Integer, Int64).")
FAILURE(FIXED_STEPS_HAVE_NONE, "Derivatives of a run need Co-Simulation with adaptive steps.")
FAILURE(NOT_ASKED, "An argument is a null pointer, or modelica_like_gradient_start has not been called.")
FAILURE(LOST_BY_STATES, NO_DERIVATIVES("the states were set"))
FAILURE(LOST_BY_COPY, NO_DERIVATIVES("the state was set"))
FAILURE(LOST_AT_END, NO_DERIVATIVES("a component ends the run there"))
FAILURE(LOST_AT_SINGULAR, NO_DERIVATIVES("its equations are singular there"))
FAILURE(LOST_AT_KINK, NO_DERIVATIVES("it is at a kink there"))
FAILURE(LOST_AT_JUMP, NO_DERIVATIVES("a rate jumps without an event there"))
FAILURE(LOST_AT_ROOT, NO_DERIVATIVES("the slope of a rate has no bound there"))
FAILURE(LOST_AT_TOUCH, NO_DERIVATIVES("the guard of %T only touches zero there"))
FAILURE(LOST_AT_MEETING, NO_DERIVATIVES("it moves apart events that happen together there"))
FAILURE(LOST_AT_READING, NO_DERIVATIVES("it moves the event at which the run is read"))
FAILURE(LOST_IN_ROUNDS, NO_DERIVATIVES("that event has too many rounds"))
FAILURE(LOST_AT_OTHER_MODES, NO_DERIVATIVES("a small change of it leads to other modes there"))
FAILURE(LOST_BY_DELAY, NO_DERIVATIVES("a value is delayed"))
FAILURE(LOST_BY_MEMORY, NO_DERIVATIVES("its steps take too much memory"))

#undef CANNOT_SET
#undef NO_DERIVATIVES
#undef STUCK_TWICE
