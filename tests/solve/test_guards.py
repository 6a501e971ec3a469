"""Guards: which may fire in which mode, and where they are looked for."""

from typing import Literal

import numpy as np
import pytest

from modelica_like import build, simulate
from modelica_like.analyse.replay.guards import Guards
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    param,
    sqrt,
    var,
)
from modelica_like.solve.initialize import Point


class Steps(Component):
    """x rises by one per second; from `first` or `second` it goes on at once when x has passed the threshold."""

    mode = Mode("begin", "first", "second", "done")
    x: Variable = var("s", "time passed")
    unit: Parameter = param("s", "unit", default=1.0)
    threshold: Parameter = param("s", "where `done` begins", default=0.25)
    way: str = "first"

    def equations(self) -> Equations:
        yield der(self.x) == 1

    def events(self) -> Events:
        yield self.mode.go("begin", self.way, when=self.x > 0.5 * self.unit)
        yield self.mode.go(("first", "second"), "done", when=self.x > self.threshold)


@pytest.mark.parametrize("way", ["first", "second"])
@pytest.mark.parametrize("threshold", [0.25, 0.75])
def test_a_transition_from_two_modes_fires_in_either(way: str, threshold: float) -> None:
    run = simulate(Steps(way=way, x=0.0, threshold=threshold), 1.0)
    assert [event.after for event in run.events] == [way, "done"]
    assert [event.time for event in run.events] == pytest.approx([0.5, max(0.5, threshold)], abs=1e-12)


class Odd(Component):
    """Guards that are rounding, hardly true, infinite or no numbers, and one without an end."""

    a: Variable = var("s", "passed")
    b: Variable = var("1", "constant")
    unit: Parameter = param("s", "unit", default=1.0)
    side = Mode("left", "right")
    other = Mode("left", "right")

    def equations(self) -> Equations:
        yield der(self.a) == 1
        yield self.unit * der(self.b) == 0

    def events(self) -> Events:
        yield self.side.go("left", "right", when=sqrt(self.a / self.unit) > 1)
        yield self.side.go("right", "left", when=1 / self.b > 0)
        yield self.other.go("left", "right", when=1e-31 * self.a > 0 * self.unit)
        yield self.other.go("right", "left", when=self.a >= 2 * self.unit)


class Still(Component):
    """Nothing happens."""

    x: Variable = var("1", "constant", default=1.0)
    unit: Parameter = param("s", "unit", default=1.0)

    def equations(self) -> Equations:
        yield self.unit * der(self.x) == 0


def test_a_model_without_events_has_no_guards() -> None:
    guards = Guards(build(Still()))
    point = Point(0.0, np.ones(1), np.zeros(0), np.zeros(0))
    assert guards.wanting(point) == []
    assert [len(one) for one in guards.at(point)] == [0, 0, 0]


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_guard_with_an_infinite_rate_waits_until_it_is_true(solver: Literal["idas", "native"]) -> None:
    """The root of a leaves zero infinitely fast; it passes one when a does, at 1 s."""
    run = simulate(build(Odd(a=0.0, b=-1.0)), 3.0, solver=solver)
    assert [(one.mode, one.time) for one in run.events] == [("side", pytest.approx(1.0, abs=1e-9))]
