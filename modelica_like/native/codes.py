"""The errors of the run-time in C: the names of codes.h in the same order, and classes of those that C words best."""

from __future__ import annotations

from enum import IntEnum, auto

from modelica_like.errors import (
    ModelicaLikeError,
    NoGradient,
    NotEnoughMemory,
    SingularAtStart,
    StepFailed,
    UnknownName,
    ValueOutOfRange,
)


class Code(IntEnum):
    """What can go wrong; codes.h has the sentences, with place and numbers, that importers of FMUs are told."""

    MISUSED = 0
    STARTS_CONTRADICT = auto()
    START_NOT_MET = auto()
    START_NOT_FOUND = auto()
    START_NOT_SETTLED = auto()
    NOT_STEADY = auto()
    MODE_NOT_STEADY = auto()
    MEMORY_NOT_STEADY = auto()
    START_SINGULAR = auto()
    UNKNOWN_SINGULAR = auto()
    BLOCK_SINGULAR = auto()
    IMPLICIT_SINGULAR = auto()
    NOT_SOLVED = auto()
    RATE_NOT_FINITE = auto()
    STEP_TOO_SMALL = auto()
    FIXED_STEP_FAILED = auto()
    LIMIT_PASSED = auto()
    EVER_FASTER = auto()
    NOT_SETTLED = auto()
    STILL_SWITCHING = auto()
    STAYS_TRUE = auto()
    TWO_NEW_VALUES = auto()
    NEW_VALUE_CONTRADICTS = auto()
    NO_VALID_MODES = auto()
    CONTRADICTS = auto()
    DELAY_NOT_POSITIVE = auto()
    PAST_TOO_LONG = auto()
    BELOW_LEAST = auto()
    ABOVE_MOST = auto()
    COLUMN_FALLS = auto()
    NO_SUCH_MODE = auto()
    NOT_FINITE = auto()
    STATE_NOT_FINITE = auto()
    PARAMETER_FIXED = auto()
    TUNED_OUTSIDE_EVENTS = auto()
    START_TOO_LATE = auto()
    FOLLOWS = auto()
    NO_INPUT = auto()
    INPUT_RATE_NOT_FINITE = auto()
    SPAN = auto()
    TOLERANCE = auto()
    NOT_WHOLE_STEPS = auto()
    NO_MEMORY = auto()
    BY_NOTHING = auto()
    BY_NO_START = auto()
    OF_DISCRETE = auto()
    NO_VARIABLE = auto()
    OF_ARRAY = auto()
    NOT_REAL = auto()
    NOT_ENUMERATION = auto()
    FIXED_STEPS_HAVE_NONE = auto()
    NOT_ASKED = auto()
    LOST_BY_STATES = auto()
    LOST_BY_COPY = auto()
    LOST_AT_END = auto()
    LOST_AT_SINGULAR = auto()
    LOST_AT_KINK = auto()
    LOST_AT_JUMP = auto()
    LOST_AT_ROOT = auto()
    LOST_AT_TOUCH = auto()
    LOST_AT_MEETING = auto()
    LOST_AT_READING = auto()
    LOST_IN_ROUNDS = auto()
    LOST_AT_OTHER_MODES = auto()
    LOST_BY_DELAY = auto()
    LOST_BY_MEMORY = auto()


_OF_VALUES = (
    Code.DELAY_NOT_POSITIVE, Code.COLUMN_FALLS, Code.NO_SUCH_MODE, Code.NOT_FINITE, Code.STATE_NOT_FINITE,
    Code.PARAMETER_FIXED, Code.TUNED_OUTSIDE_EVENTS, Code.START_TOO_LATE, Code.FOLLOWS, Code.NO_INPUT,
    Code.INPUT_RATE_NOT_FINITE, Code.SPAN, Code.TOLERANCE, Code.NOT_WHOLE_STEPS,
)  # fmt: skip
_OF_GRADIENTS = (
    Code.BY_NOTHING, Code.BY_NO_START, Code.OF_DISCRETE, Code.FIXED_STEPS_HAVE_NONE,
    *(code for code in Code if code.name.startswith("LOST_")),
)  # fmt: skip
WORDED: dict[Code, type[ModelicaLikeError]] = {
    Code.MISUSED: ModelicaLikeError,
    Code.START_SINGULAR: SingularAtStart,
    Code.FIXED_STEP_FAILED: StepFailed,
    Code.PAST_TOO_LONG: StepFailed,
    Code.NO_MEMORY: NotEnoughMemory,
    Code.NO_VARIABLE: UnknownName,
    Code.NOT_ENUMERATION: UnknownName,
    **dict.fromkeys(_OF_VALUES, ValueOutOfRange),
    **dict.fromkeys(_OF_GRADIENTS, NoGradient),
}
"""Classes of errors that no other part of this package has: they are told by the sentence of C, and its advice."""
