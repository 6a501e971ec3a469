"""Errors of the run-time in C: a code each, with the class and the sentences of the same error of the other solver."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from failing import (
    TABLE,
    Chasing,
    Converging,
    Counting,
    Divided,
    Ending,
    Exploding,
    Falling,
    Given,
    GivenTwice,
    Implicit,
    Inverse,
    Kinked,
    Late,
    Marked,
    Meeting,
    Rebound,
    Root,
    Rooted,
    Running,
    Sampling,
    Silent,
    Square,
    Touching,
    Trembling,
    across,
    clutched,
    coasting,
    gradient,
    interrupted,
    leaving,
    rubbing,
    shaft,
)

from components import IdealDiode
from modelica_like import build, simulate
from modelica_like.errors import (
    Chattering,
    ModelicaLikeError,
    NoGradient,
    NotEnoughMemory,
    SingularAtStart,
    StepFailed,
    ValueOutOfRange,
)
from modelica_like.native import model
from modelica_like.native.codes import WORDED, Code
from modelica_like.native.failures import WRITTEN, Failure, error_of

HEADER = Path(__file__).parents[2] / "modelica_like/engine/codes.h"
IMPORTERS = {
    Code.MISUSED, Code.START_SINGULAR, Code.TUNED_OUTSIDE_EVENTS, Code.NO_INPUT, Code.INPUT_RATE_NOT_FINITE,
    Code.NO_VARIABLE, Code.NOT_ENUMERATION,
}  # fmt: skip
"""Errors that only importers of FMUs can make: tests/fmi."""


LOST = r"There are no derivatives with respect to {} after t = {} s: {}\."


def restarted(drive, values, start=None, **how):
    handle = build(drive).native(start=start, **how)
    handle.reset(values, until=10.0)
    return handle


def native(drive, until=2.0, **how):
    return lambda: simulate(drive, until, solver="native", **how)


def by_idas(drive, parameters=None, **how):
    return lambda: simulate(build(drive).with_parameters(parameters or {}), 2.0, solver="idas", **how)


BOTH: dict[Code, tuple[Callable[[], object], Callable[[], object]]] = {
    Code.STARTS_CONTRADICT: (
        lambda: restarted(shaft(second={"w": 1.0}), {"b.w": 2.0}), by_idas(shaft(second={"w": 2.0})),
    ),
    Code.START_NOT_MET: (lambda: restarted(Square(x=1.0, y=1.0), {"x": 2.0}), by_idas(Square(x=2.0, y=1.0))),
    Code.START_NOT_FOUND: (lambda: restarted(Square(y=1.0), {"y": -1.0}), by_idas(Square(y=-1.0))),
    Code.START_NOT_SETTLED: (lambda: restarted(Chasing(y=5.0), {"y": 1.0}), by_idas(Chasing(y=1.0))),
    Code.NOT_STEADY: (lambda: build(Running()).native(start="steady"), by_idas(Running(), start="steady")),
    Code.MODE_NOT_STEADY: (
        lambda: restarted(rubbing(), {"torque.tau_constant": 5.0}, "steady"),
        by_idas(rubbing(), {"torque.tau_constant": 5.0}, start="steady"),
    ),
    Code.MEMORY_NOT_STEADY: (
        lambda: build(Sampling()).native(start="steady"), by_idas(Sampling(), start="steady"),
    ),
    Code.UNKNOWN_SINGULAR: (lambda: restarted(Implicit(x=0.0), {"a": 0.0}), by_idas(Implicit(x=0.0), {"a": 0.0})),
    Code.BLOCK_SINGULAR: (lambda: restarted(Divided(x=0.0), {"a": 0.0}), by_idas(Divided(x=0.0), {"a": 0.0})),
    Code.NOT_SOLVED: (lambda: restarted(Root(x=0.0), {}), by_idas(Root(x=0.0))),
    Code.RATE_NOT_FINITE: (lambda: restarted(Inverse(x=0.0), {"a": 0.0}), by_idas(Inverse(x=0.0), {"a": 0.0})),
    Code.LIMIT_PASSED: (native(leaving()), by_idas(leaving())),
    Code.NOT_SETTLED: (native(Counting(x=0.0)), by_idas(Counting(x=0.0))),
    Code.STILL_SWITCHING: (native(Trembling(x=1.0)), by_idas(Trembling(x=1.0))),
    Code.TWO_NEW_VALUES: (native(GivenTwice(x=1.0)), by_idas(GivenTwice(x=1.0))),
    Code.NEW_VALUE_CONTRADICTS: (native(Given(x=1.0)), by_idas(Given(x=1.0))),
    Code.NO_VALID_MODES: (native(interrupted()), by_idas(interrupted())),
    Code.CONTRADICTS: (native(across(IdealDiode())), by_idas(across(IdealDiode()))),
    Code.DELAY_NOT_POSITIVE: (lambda: restarted(Late(x=0.0), {"a": 0.0}), by_idas(Late(x=0.0), {"a": 0.0})),
    Code.BELOW_LEAST: (lambda: restarted(shaft(), {"a.J": -1.0}), by_idas(shaft(), {"a.J": -1})),
    Code.ABOVE_MOST: (lambda: restarted(Square(x=1.0), {"a": 11.0}), by_idas(Square(x=1.0), {"a": 11})),
}  # fmt: skip
"""What both solvers refuse, with the same sentences."""
SET = "cannot be set: "
ALONE: dict[Code, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    Code.STEP_TOO_SMALL: (
        StepFailed, native(Exploding(x=1.0)),
        r"The integrator gave up at t = 1\.00000\d* s: the step became too small\.\n"
        r"x changes fastest relative to its tolerance\.\nLook for a stiff spring, .*",
    ),
    Code.FIXED_STEP_FAILED: (
        StepFailed, lambda: restarted(Falling(x=1.0), {}, fixed_step=0.1).step(2.0),
        r"The step from t = 0\.6 s gives values that are not finite, or singular equations\.\nTake smaller steps\.",
    ),
    Code.EVER_FASTER: (
        Chattering, native(Converging(x=1.0, v=0.0), 20.0),
        r"side switched 50 times in t = 4\.2426\d*…4\.24264\d* s \(up ⇄ down\)\.\n  in (.*\n)*"
        r"Events follow each other ever faster\.\nGive the switching a hysteresis.*",
    ),
    Code.STAYS_TRUE: (
        Chattering, native(Rebound(x=1.0, v=0.0)),
        r"At 0\.55186\d* s the condition of relation\[1\] stays true: .*\n  in failing\.py:.*\nLet it rest: .*",
    ),
    Code.PAST_TOO_LONG: (
        StepFailed, native(Late(x=0.0, a=1.0)),
        r"Delays reach back over more than 16384 points of the past\.\nShorten them, or ask for less precise results\.",
    ),
    Code.COLUMN_FALLS: (
        ValueOutOfRange, lambda: restarted(build(coasting(tau_pos=TABLE), tables=["*"]), {"bearing.tau_pos[2,1]": 0.0}),
        r"bearing\.tau_pos\[2,1\] = 0 is not above bearing\.tau_pos\[1,1\] = 0: this column of the table must rise\.",
    ),
    Code.NO_SUCH_MODE: (
        ValueOutOfRange, lambda: restarted(Chasing(x=1.0), {"mode": 2.0}), r"mode has no mode 2: they are 0 to 1\.",
    ),
    Code.NOT_FINITE: (
        ValueOutOfRange, lambda: restarted(shaft(), {"a.w": math.nan}),
        rf"a\.w {SET}the value is not a finite number\.",
    ),
    Code.STATE_NOT_FINITE: (
        ValueOutOfRange, lambda: setattr(restarted(shaft(), {}), "states", [0.0, math.inf]),
        rf"a\.w {SET}the value is not a finite number\.",
    ),
    Code.PARAMETER_FIXED: (
        ValueOutOfRange, lambda: restarted(Late(x=0.0), {}).set({"a": 2.0}),
        rf"a {SET}it is a fixed parameter\.\nSet it before the end of the initialization\.",
    ),
    Code.START_TOO_LATE: (
        ValueOutOfRange, lambda: restarted(shaft(), {}).set({"a.w": 2.0}),
        rf"a\.w {SET}start values are settable before the end of the initialization only\.",
    ),
    Code.FOLLOWS: (
        ValueOutOfRange, lambda: restarted(shaft(), {"der(a.w)": 2.0}), rf"der\(a\.w\) {SET}it follows from other .*",
    ),
    Code.SPAN: (
        ValueOutOfRange, lambda: build(shaft()).native().reset(t0=1.0, until=0.5),
        r"The start time 1 s must be finite and not after the stop time 0\.5 s\.",
    ),
    Code.TOLERANCE: (
        ValueOutOfRange, lambda: build(shaft()).native(rtol=2.0), r"The tolerance must be between 0 and 1, not 2\.",
    ),
    Code.NOT_WHOLE_STEPS: (
        ValueOutOfRange, lambda: restarted(shaft(), {}, fixed_step=0.1).step(0.25),
        r"The step of 0\.25 s is not a whole number of fixed steps of 0\.1 s, for which the model was made\.",
    ),
    Code.BY_NOTHING: (
        NoGradient, lambda: build(shaft()).native(by=["der(a.w)"]),
        r"Derivatives with respect to der\(a\.w\) are not available: it is neither state, input nor parameter\.",
    ),
    Code.BY_NO_START: (
        NoGradient, lambda: build(Square(x=1.0)).native(by=["y"]),
        r"Derivatives with respect to y are not available: it is neither a start value, input nor parameter\.",
    ),
    Code.OF_DISCRETE: (
        NoGradient, lambda: gradient(Marked(x=1.0), "n", "x"), r"n changes at events only: it has no derivatives\.",
    ),
    Code.NOT_REAL: (
        NoGradient, lambda: gradient(Chasing(x=1.0), "mode", "x"), r"mode is no real number: it has no derivatives\.",
    ),
    Code.FIXED_STEPS_HAVE_NONE: (
        NoGradient, lambda: build(shaft()).native(by=["a.J"], fixed_step=0.1),
        r"Derivatives of a run need Co-Simulation with adaptive steps\.",
    ),
    Code.NOT_ASKED: (
        NoGradient, lambda: build(shaft()).native(outputs=["a.w"]).gradient(),
        r'No derivatives were asked for\.\nName parameters, inputs or start values: by=\["J\.J"\]\.',
    ),
    Code.LOST_BY_STATES: (
        NoGradient, lambda: gradient(shaft(), "a.w", "a.J", lambda one: setattr(one, "states", one.states)),
        LOST.format("anything", "0", "the states were set"),
    ),
    Code.LOST_BY_COPY: (
        NoGradient, lambda: gradient(shaft(), "a.w", "a.J", lambda one: one.restore(one.copy())),
        LOST.format("anything", "0", "the state was set"),
    ),
    Code.LOST_AT_END: (
        NoGradient, lambda: gradient(Ending(x=0.0), "x", "a", lambda one: one.step(2.0)),
        LOST.format("anything", "1", "a component ends the run there"),
    ),
    Code.LOST_AT_KINK: (
        NoGradient, lambda: gradient(Kinked(x=0.0), "x", "a", lambda one: one.step(1.0)),
        LOST.format("a", r"0\.\d+", "it is at a kink there"),
    ),
    Code.LOST_AT_JUMP: (
        NoGradient, lambda: gradient(Silent(x=0.0), "x", "a", lambda one: one.step(1.0)),
        LOST.format("a", r"0\.\d+", "a rate jumps without an event there"),
    ),
    Code.LOST_AT_ROOT: (
        NoGradient, lambda: gradient(Rooted(x=0.0), "y", "a", lambda one: one.step(1.0)),
        LOST.format("a", r"0\.5", "the slope of a rate has no bound there"),
    ),
    Code.LOST_AT_TOUCH: (
        NoGradient, lambda: gradient(Touching(x=0.0), "x", "a", lambda one: one.step(2.0)),
        LOST.format("a", "1", r"the guard of relation\[1\] only touches zero there"),
    ),
    Code.LOST_AT_MEETING: (
        NoGradient, lambda: gradient(Meeting(x=0.0), "x", "a", lambda one: one.step(1.5)),
        LOST.format("a", "1", "it moves apart events that happen together there"),
    ),
    Code.LOST_AT_READING: (
        NoGradient, lambda: gradient(Meeting(x=0.5, a=0.25), "x", "a", lambda one: one.step(1.2)),
        LOST.format("a", r"1\.2", "it moves the event at which the run is read"),
    ),
    Code.LOST_AT_OTHER_MODES: (
        NoGradient, lambda: gradient(clutched(), "a.w", "a.w", lambda one: one.step(0.1)),
        LOST.format(r"a\.w", "0", "a small change of it leads to other modes there"),
    ),
    Code.LOST_BY_DELAY: (
        NoGradient, lambda: gradient(Late(x=0.0), "x", "a", lambda one: one.step(0.1)),
        LOST.format("anything", "0", "a value is delayed"),
    ),
}  # fmt: skip
"""What only this solver refuses: class, and pattern of the message."""
HARD = {
    Code.IMPLICIT_SINGULAR: SingularAtStart, Code.NO_MEMORY: NotEnoughMemory, Code.OF_ARRAY: NoGradient,
    Code.LOST_AT_SINGULAR: NoGradient, Code.LOST_IN_ROUNDS: NoGradient, Code.LOST_BY_MEMORY: NoGradient,
}  # fmt: skip
"""What no small drive does."""


@pytest.fixture
def codes(monkeypatch) -> list[Code]:
    """The codes of errors that are raised."""
    used: list[Code] = []

    def note(one: Failure) -> ModelicaLikeError:
        used.append(one.code)
        return error_of(one)

    monkeypatch.setattr(model, "error_of", note)
    return used


@pytest.mark.parametrize("code", BOTH, ids=lambda code: code.name)
def test_both_solvers_tell_the_same(code, codes):
    make, other = BOTH[code]
    with pytest.raises(ModelicaLikeError) as expected:
        other()
    with pytest.raises(ModelicaLikeError) as found:
        make()
    assert set(codes) == {code}
    assert str(found.value) == str(expected.value)
    assert type(found.value) is type(expected.value)


@pytest.mark.parametrize("code", ALONE, ids=lambda code: code.name)
def test_what_only_this_solver_tells(code, codes):
    kind, make, text = ALONE[code]
    with pytest.raises(ModelicaLikeError) as found:
        make()
    assert set(codes) == {code}
    assert type(found.value) is kind
    assert re.fullmatch(text, str(found.value)), str(found.value)


@pytest.mark.parametrize("code", HARD, ids=lambda code: code.name)
def test_what_no_small_drive_does(code, monkeypatch):
    """The code is changed on its way."""
    told: list[Failure] = []
    monkeypatch.setattr(model, "error_of", lambda one: told.append(one) or error_of(replace(one, code=code)))
    with pytest.raises(HARD[code]):
        restarted(Implicit(x=0.0), {"a": 0.0})
    assert [one.code for one in told] == [Code.UNKNOWN_SINGULAR]


def test_every_code_has_a_test():
    assert sorted([*BOTH, *ALONE, *HARD, *IMPORTERS]) == list(Code)


def test_codes_are_those_of_the_run_time():
    assert re.findall(r"^FAILURE\(\s*(\w+),", HEADER.read_text(), re.MULTILINE) == [code.name for code in Code]


def test_every_code_is_told_by_one_of_two():
    assert sorted([*WORDED, *WRITTEN]) == list(Code)
