"""A component ends the run regularly: against closed forms, by both solvers, in sweeps."""

from math import sqrt
from typing import Literal

import casadi as ca
import numpy as np
import pytest

from modelica_like import Assembly, build, simulate, sweep
from modelica_like.errors import NoGradient
from modelica_like.language import (
    TIME,
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    clock,
    der,
    discrete,
    initial,
    integer,
    param,
    pre,
    terminal,
    terminate,
    var,
    when,
)
from modelica_like.runs.solution import Solution

Solver = Literal["idas", "native"]
both = pytest.mark.parametrize("solver", ["idas", "native"])
CLOSE = 1e-6
"""Relative; a hundred times the relative tolerance of events, and one of IDAS's default tolerance of states."""


class Moved(Component, partial=True):
    """Reaches x after sqrt(2 x / a)."""

    a: Parameter = param("m/s2", "acceleration", default=2.0)
    x_top: Parameter = param("m", "height", default=1.0)
    x: Variable = var("m", "position", state="always", default=0.0)
    v: Variable = var("m/s", "speed", state="always", default=0.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == self.a


class Lift(Moved):
    n: Discrete = integer("arrivals")
    v_top: Discrete = discrete("m/s", "speed at the end")

    def events(self) -> Events:
        yield when(self.x > self.x_top, {self.n: pre(self.n) + 1, **terminate("is at the top, {x_top} m")})
        yield when(terminal(), {self.v_top: self.v})


def run_of(drive: Component, solver: Solver, until: float = 10.0) -> Solution:
    return simulate(drive, until, solver=solver, rtol=1e-8)


@both
def test_the_run_ends_at_the_event(solver: Solver) -> None:
    run = run_of(Assembly(parts={"lift": Lift(a=3.0)}), solver)
    end = sqrt(2 / 3)
    assert run.time[-1] == pytest.approx(end, rel=CLOSE)
    assert run.final["lift.v"] == pytest.approx(3 * end, rel=CLOSE)
    ended = run.ended
    assert ended is not None
    assert ended.time == run.time[-1]
    assert (ended.component, ended.reason) == ("lift", "is at the top, 1 m")
    assert str(ended) == f"The run ended at {ended.time:.9g} s: lift is at the top, 1 m."


@both
def test_what_else_happens_at_that_instant_happens(solver: Solver) -> None:
    run = run_of(Lift(), solver)
    assert not run["n"][run.time < run.time[-1]].any()
    assert run.final["n"] == 1
    assert run.final["v_top"] == pytest.approx(2.0, rel=CLOSE)  # the end is one: terminal() is true there


def test_a_handle_stays_at_the_end() -> None:
    handle = build(Lift()).native(outputs=["x"])
    for time in (0.5, 2.0, 3.0):
        handle.step(time)
    assert handle.time == pytest.approx(1.0, rel=CLOSE)
    handle.reset()
    times, x = handle.run(5.0, points=10)
    assert times[-1] == pytest.approx(1.0, rel=CLOSE)
    assert x[-1, 0] == pytest.approx(1.0, rel=CLOSE)


def test_derivatives_of_a_handle_are_refused_behind_the_end() -> None:
    handle = build(Lift()).native(outputs=["x"], by=["a"])
    handle.step(0.5)
    assert handle.gradient()[0, 0] == pytest.approx(0.5**2 / 2, rel=CLOSE)
    handle.step(2.0)
    with pytest.raises(NoGradient, match="a component ends the run there"):
        handle.gradient()


@both
def test_a_run_that_ends_before_is_not_ended(solver: Solver) -> None:
    run = run_of(Lift(), solver, until=0.9)
    assert run.ended is None
    assert run.time[-1] == 0.9


class ByMode(Moved):
    units_checked = False
    drive = Mode("up", "braked")

    def events(self) -> Events:
        yield self.drive.go("up", "braked", when=self.x > 0.25, reset={self.v: 0.5})
        yield when(self.drive.is_("braked"), terminate("is braked"))


class ByClock(Moved):
    units_checked = False
    n: Discrete = integer("count")

    def events(self) -> Events:
        yield when(clock(ca.SX(0.25)), {self.n: pre(self.n) + 1})
        yield when(self.n >= 4, terminate("has counted {n} ticks, at {x} m"))


class ByTime(Moved):
    units_checked = False
    n: Discrete = integer("count")

    def events(self) -> Events:
        yield when(TIME > 0.3, {self.n: 1}).elsewhen(self.x > 0.04, terminate("is past 0.04 m"))


class AtTheStart(Moved):
    def events(self) -> Events:
        yield when(initial(), terminate("need not begin"))


class FirstOfTwo(Moved):
    units_checked = False

    def events(self) -> Events:
        yield when(self.x > 1.0, terminate("is high"))
        yield when(self.v > 1.0, terminate("is fast"))


@both
@pytest.mark.parametrize(
    ("kind", "end", "reason"),
    [
        (ByMode, 0.5, "is braked"),
        (ByClock, 0.75, "has counted 4 ticks, at 0.5625 m"),
        (ByTime, 0.2, "is past 0.04 m"),
        (AtTheStart, 0.0, "need not begin"),
        (FirstOfTwo, 0.5, "is fast"),
    ],
)
def test_whens_of_every_kind(kind: type[Moved], end: float, reason: str, solver: Solver) -> None:
    run = run_of(kind(), solver)
    assert run.time[-1] == pytest.approx(end, rel=CLOSE, abs=0.0)
    assert run.ended is not None
    assert run.ended.reason == reason


@both
def test_rows_of_a_sweep_end_by_themselves(solver: Solver) -> None:
    a = np.array([0.005, 0.5, 2.0, 8.0])
    names = ["x", "v", "mean(v)", "max(v)", "at(x, 0.5)", "at(x, 2.5)", "integral(v)"]
    found = sweep(build(Lift()), {"a": a}, names, until=10.0, solver=solver, rtol=1e-8)
    end = np.minimum(np.sqrt(2 / a), 10.0)
    for name, value in {
        "x": a * end**2 / 2, "v": a * end, "mean(v)": a * end / 2, "max(v)": a * end, "integral(v)": a * end**2 / 2,
        "at(x, 0.5)": a / 8, "at(x, 2.5)": np.where(end > 2.5, a * 2.5**2 / 2, np.nan),
    }.items():  # fmt: skip
        np.testing.assert_allclose(found[name], value, rtol=CLOSE, err_msg=name)
    assert not found.attrs["notice"]
