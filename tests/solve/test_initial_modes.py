"""Start values of nonlinear equations, and the modes that follow from start values."""

import math

import pytest

from components import Clutch, ConstantTorque, Inertia
from modelica_like import simulate
from modelica_like.errors import InitializationError, SingularAtStart
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    discrete,
    guess,
    param,
    series,
    var,
)

# -- nonlinear -------------------------------------------------------------------------------------------------------


class Nonlinear(Component):
    """y² = x + 1 and u = x³ + x."""

    x: Variable = var("1", "state")
    y: Variable = var("1", "root", guess=1.0)
    u: Variable = var("1", "cubic")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == -self.x
        yield self.y**2 == self.x + 1
        yield self.u == self.x**3 + self.x


def test_a_nonlinear_variable_is_given(start):
    assert start(Nonlinear(), u=10.0)["x"] == pytest.approx(2.0, rel=1e-14)
    assert start(Nonlinear(), y=3.0)["x"] == pytest.approx(8.0, rel=1e-14)


def test_a_guess_chooses_the_branch(start):
    assert start(Nonlinear(), x=3.0)["y"] == pytest.approx(2.0, rel=1e-14)
    assert start(Nonlinear(), x=3.0, y=guess(-1.0))["y"] == pytest.approx(-2.0, rel=1e-14)
    assert start(Nonlinear(), x=guess(0.5), y=guess(-1.0), u=10.0)["y"] == pytest.approx(-math.sqrt(3.0), rel=1e-14)


def test_what_has_no_solution_is_told(start):
    with pytest.raises(InitializationError, match=r"The equations for y were not solved at t = 0 s\."):
        start(Nonlinear(), x=-3.0)


def test_a_point_where_a_derivative_is_infinite_is_told(start):
    class Zero(Component):
        rotor = Inertia(J=0.0, phi=0.0, w=1.0)
        push = ConstantTorque(tau_constant=1.0)

        def equations(self) -> Equations:
            yield from series(self.push, self.rotor)

    with pytest.raises(SingularAtStart, match=r"The derivative of .* is not finite at t = 0 s") as caught:
        start(Zero())
    assert "inertia or ratio of zero" in caught.value.advice


# -- modes -----------------------------------------------------------------------------------------------------------


class Coupled(Component):
    a, clutch, b = Inertia(J=1.0, phi=0.0), Clutch(capacity=5.0, phi_rel=0.0), Inertia(J=1.0, w=0.0)

    def equations(self) -> Equations:
        yield from series(self.a, self.clutch, self.b)


@pytest.mark.parametrize(("w", "mode"), [(10.0, "backward"), (0.0, "stuck"), (-10.0, "forward")])
def test_modes_follow_from_the_start_values(start, w, mode):
    """The slip speed is that of b over a."""
    assert start(Coupled(), a__w=w)["clutch.mode"] == mode


def test_the_first_condition_that_holds_wins_and_start_is_the_last_resort(start):
    class Choosy(Component):
        x: Variable = var("1", "x")
        T: Parameter = param("s", "time", default=1.0)
        mode = Mode("low", "middle", "high", "none", start="none")
        plain = Mode("first", "second", start="second")

        def equations(self) -> Equations:
            yield self.T * der(self.x) == 0

        def events(self) -> Events:
            yield self.mode.initially("high", when=self.x > 2)
            yield self.mode.initially("middle", when=self.x > 1)
            yield self.mode.initially("low", when=self.x < 0)
            yield self.plain.go("second", "first", when=self.x > 5)

    found = {x: start(Choosy(x=x))["mode"] for x in (-1.0, 0.5, 1.5, 3.0)}
    assert found == {-1.0: "low", 0.5: "none", 1.5: "middle", 3.0: "high"}
    assert start(Choosy(x=0.0))["plain"] == "second"
    assert start(Choosy(x=0.0, plain="first"))["plain"] == "first"


def test_modes_and_start_values_that_chase_each_other_are_told(start):
    """x follows from y by the mode, and the mode from x: y = 1 gives x = 2 in `a`, which asks for `b`, where x = -2."""

    class Chasing(Component):
        x: Variable = var("1", "state")
        y: Variable = var("1", "given")
        T: Parameter = param("s", "time", default=1.0)
        first, mode, last = Mode("on", "off"), Mode("a", "b"), Mode("on", "off")

        def equations(self) -> Equations:
            yield self.T * der(self.x) == -self.x
            yield self.y == self.mode.choose(a=self.x - 1, b=self.x + 3)

        def events(self) -> Events:
            yield self.mode.initially("b", when=self.x > 0)
            yield self.mode.initially("a", when=self.x < 0)

    with pytest.raises(InitializationError, match=r"^The modes at the start do not settle: mode and the start values"):
        start(Chasing(y=1.0))
    assert start(Chasing(x=1.0))["mode"] == "b"


def test_in_other_modes_a_steady_state_is_sought_from_the_start_values_again(start):
    """At x = 1 the mode is a, which rests at 10; there it is b, which rests at 2 and 6."""

    class Switching(Component):
        x: Variable = var("1", "state")
        T: Parameter = param("s", "time", default=1.0)
        mode = Mode("a", "b")

        def equations(self) -> Equations:
            yield self.T * der(self.x) == self.mode.choose(a=10 - self.x, b=-(self.x - 2) * (self.x - 6))

        def events(self) -> Events:
            yield self.mode.initially("b", when=self.x > 1.5)

    found = start(Switching(x=1.0), "steady")
    assert (found["x"], found["mode"]) == (pytest.approx(2.0), "b")


def test_discrete_values_start_from_numbers_quantities_and_formulas():
    class Counter(Component):
        x: Variable = var("1", "x")
        number: Discrete = discrete("1", "number", start=3)
        moment: Discrete = discrete("s", "quantity", start="20 ms")
        follows: Discrete = discrete("s", "formula", start="2*period")
        period: Parameter = param("s", "period", default=0.5)

        def equations(self) -> Equations:
            yield self.x == self.number

    run = simulate(Counter(), 1.0, points=1)
    assert [run.final[name] for name in ("number", "moment", "follows")] == [3.0, 0.02, 1.0]
    run = simulate(Counter(), 1.0, points=1, parameters={"period": "1 s"})
    assert run.final["follows"] == 2.0
    assert simulate(Counter(number=7), 1.0, points=1).final["x"] == 7.0


@pytest.mark.parametrize("speed", [-1000.0, 1000.0])
@pytest.mark.parametrize(("slip", "stuck"), [(0.9e-7, True), (1.2e-7, False)])
def test_a_slip_within_rounding_of_the_speeds_holds(start, speed: float, slip: float, stuck: bool) -> None:
    """1e-10 of 1000 rad/s are 1e-7 rad/s, whichever way the drive turns."""
    found = start(Coupled(), a__w=speed, b__w=speed + slip)
    assert (found["clutch.mode"] == "stuck") == stuck
