"""Laws without a slope, in closed forms: friction brakes, stairs climb, with both solvers, with events and without."""

from collections.abc import Callable
from typing import Any

import pytest

from modelica_like import simulate
from modelica_like.errors import Chattering
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Parameter,
    Variable,
    delay,
    der,
    floor,
    mod,
    param,
    sign,
    var,
    where,
)

SOLVERS = pytest.mark.parametrize("solver", ["idas", "native"])
ASKED = pytest.mark.parametrize("events", [None, True, False])
Law = Callable[..., Expr]
LAWS: list[tuple[Law, float]] = [
    (floor, 8.0),  # 0 + 1 + 2 + 3 + 4/2
    (lambda x, events: mod(x, 1.5, events=events), 3.375),  # 3 teeth of 1.5^2 / 2
    (lambda x, events: where(x < 3, 2, 1, events=events), 7.5),
]
"""Laws of time, and their integrals from 0 to 4.5."""


def integral(law: Law, events: bool | None) -> Component:
    class Integral(Component):
        rate: Parameter = param("1/s", "rate of time", default=1.0)
        x: Variable = var("1", "time", default=0.0)
        y: Variable = var("1/s", "its law")
        s: Variable = var("1", "the integral", default=0.0)

        def equations(self) -> Equations:
            yield der(self.x) == self.rate
            yield self.y == self.rate * law(self.x, events=events)
            yield der(self.s) == self.y

    return Integral()


class Late(Component):
    units_checked = False
    x: Variable = var("1", "time", default=0.0)
    s: Variable = var("1", "integral", default=0.0)
    T: Parameter = param("s", "delay", default=1.0)

    def equations(self) -> Equations:
        yield der(self.x) == 1
        yield der(self.s) == delay(sign(self.x - 0.5), self.T)


def sliding(speed: float, events: bool | None, push: float = 0.0) -> Component:
    class Sliding(Component):
        m: Parameter = param("kg", "mass", default=1.0)
        F_c: Parameter = param("N", "friction", default=2.0)
        push: Parameter = param("N", "force", default=0.0)
        v: Variable = var("m/s", "speed", default=speed)
        F: Variable = var("N", "friction")

        def equations(self) -> Equations:
            yield self.F - self.F_c * sign(self.v, events=events) == 0
            yield self.m * der(self.v) == self.push - self.F

    return Sliding(push=push)


@SOLVERS
@ASKED
@pytest.mark.parametrize(("law", "value"), LAWS)
def test_the_integral_of_what_jumps(law: Law, value: float, events: bool | None, solver: Any) -> None:
    run = simulate(integral(law, events), 4.5, solver=solver, rtol=1e-9)
    # Without an event, steps go over the jump: its error is that of the steps.
    assert run["s"][-1] == pytest.approx(value, rel=1e-6 if events is False else 1e-9)
    assert bool(run.events) == (events is not False)


@SOLVERS
@ASKED
@pytest.mark.parametrize("speed", [10.0, -10.0])
def test_friction_brakes(speed: float, events: bool | None, solver: Any) -> None:
    run = simulate(sliding(speed, events), 2.0, solver=solver)
    assert run["v"][-1] == pytest.approx(speed * 0.6, rel=1e-9)


@SOLVERS
def test_what_is_delayed_jumps_where_it_does(solver: Any) -> None:
    run = simulate(Late(), 2.5, solver=solver, rtol=1e-9)
    assert run["s"][-1] == pytest.approx(-0.5, abs=1e-9)  # -1 until 0.5 + 1, then 1


@SOLVERS
def test_an_ideal_friction_that_chatters_names_the_classes_that_stick(solver: Any) -> None:
    # Without the push it may also come to rest: there is no friction where the speed is exactly zero.
    with pytest.raises(Chattering, match="BearingFriction, Brake, Clutch or SupportFriction"):
        simulate(sliding(10.0, None, push=1.0), 20.0, solver=solver)
