"""Laws that jump without an event: their jump moves with parameters, so its derivative is refused, never left out."""

from typing import Any, Literal

import numpy as np
import pytest

from modelica_like import build, sensitivities, simulate
from modelica_like.errors import NoGradient
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Parameter,
    Variable,
    absolute,
    atan2,
    cos,
    der,
    floor,
    maximum,
    minimum,
    mod,
    param,
    sign,
    sin,
    sqrt,
    var,
    where,
)

Kind = Literal["where", "cubic", "sign", "floor", "mod", "meets", "steep", "time", "clock"]


class Way(Component):
    """x = a t up to b, where its rate changes; y is not part of the equations of states."""

    units_checked = False
    x: Variable = var("1", "way", default=0.0)
    y: Variable = var("1", "sign of what is left")
    a: Parameter = param("1", "rate before", default=2.0)
    b: Parameter = param("1", "where it changes", default=1.0)
    kind: Kind = "where"
    told: bool = False

    def law(self) -> Expr:
        x, a, b, events = self.x, self.a, self.b, self.told
        match self.kind:
            case "where":
                return where(x < b, a, 1.0, events=events)
            case "cubic":
                return where((x - b) ** 3 < 0, a, 1.0, events=events)
            case "sign":
                return (a + 1) / 2 - (a - 1) / 2 * sign(x - b, events=events)
            case "floor":
                return a + (1 - a) * floor(x / b, events=events)
            case "mod":
                return a + (1 - a) * (x - mod(x, b, events=events)) / b
            case "meets":
                return a + where(x < b, 0.0, x - b, events=events) + absolute(x - b) - absolute(x - b)
            case "steep":
                return minimum(a, maximum(1.0, a - 1e6 * (x - b)))
            case "time":
                return where(self.time < 0.5, a, 1.0, events=events)
            case "clock":
                return where(self.time < b, a, 1.0, events=events)

    def equations(self) -> Equations:
        yield der(self.x) == self.law()
        yield self.y == sign(self.x - self.b, events=self.told)


JUMPS: tuple[Kind, ...] = ("where", "sign", "floor", "mod")
FLAT: Kind = "cubic"
"""Its condition is flat where the rate jumps: no event tells when that is, either."""
END = 0.9


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("kind", JUMPS)
def test_a_jump_without_an_event_has_no_derivative(kind: Kind, solver: Any) -> None:
    """With an event: x = b + (t - b/a) behind it, so its derivatives are b/a² and 1 - 1/a."""
    told = sensitivities(simulate(Way(kind=kind, told=True), END, solver=solver), "x", ["a", "b"])
    np.testing.assert_allclose(told.derivatives, [[0.25, 0.5]], rtol=1e-7)
    silent = simulate(Way(kind=kind), END, solver=solver)
    assert silent.final["x"] == pytest.approx(1.4, abs=1e-5)
    with pytest.raises(NoGradient, match=r"the rate of x jumps without an event") as refused:
        sensitivities(silent, "x", ["a", "b"])
    assert "noEvent" in str(refused.value)


class Charge(Component):
    """q = s a t up to s/2, where the rate of y changes; sizes of s are those of q."""

    units_checked = False
    q: Variable = var("1", "charge", default=0.0)
    y: Variable = var("1", "what follows", default=0.0)
    a: Parameter = param("1", "rate", default=2.0)
    size: float = 1.0

    def equations(self) -> Equations:
        yield der(self.q) == self.size * self.a
        yield der(self.y) == where(self.q < 0.5 * self.size, 1.0, 3.0, events=False)


class SmallCharge(Charge):
    size: float = 1e-12
    q: Variable = var("1", "charge of some picocoulombs", default=0.0, nominal=1e-12)


@pytest.mark.parametrize("kind", [Charge, SmallCharge])
@pytest.mark.parametrize("method", ["auto", "forward", "adjoint"])
def test_a_jump_has_no_derivative_in_any_unit(kind: Any, method: Any) -> None:
    """It is at 1/(2 a): y = 3 t - 1/a, which nothing but an event would tell."""
    run = simulate(kind(), END, solver="native")
    assert run.final["y"] == pytest.approx(3 * END - 0.5, abs=1e-5)
    with pytest.raises(NoGradient, match=r"the rate of y jumps without an event"):
        sensitivities(run, "y", ["a"], method=method)


@pytest.mark.parametrize("method", ["forward", "adjoint"])
def test_an_integral_of_what_jumps_has_none_either(method: Any) -> None:
    """That of y is t - 2 b/a, and the rate of x does not jump."""
    with pytest.raises(NoGradient, match=r"what is integrated jumps without an event"):
        sensitivities(simulate(Way(kind="meets"), END), "integral(y)", ["a", "b"], method=method)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_branches_that_meet_and_fixed_times_have_derivatives(solver: Any) -> None:
    """Behind the kink x = b - a + a exp(t - b/a); before a fixed time x = 0.5 a, then its rate is one."""
    meets = sensitivities(simulate(Way(kind="meets"), END, solver=solver), "x", ["a", "b"])
    grown = np.exp(END - 0.5)
    np.testing.assert_allclose(meets.derivatives, [[grown - 1.0 + 0.5 * grown, 1.0 - grown]], rtol=1e-6)
    fixed = sensitivities(simulate(Way(kind="time"), END, solver=solver), "x", ["a", "b"])
    np.testing.assert_allclose(fixed.derivatives, [[0.5, 0.0]], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_what_is_merely_steep_has_derivatives(solver: Any) -> None:
    """Where the rate falls within a way of 1e-6: nearly those of the jump with an event."""
    found = sensitivities(simulate(Way(kind="steep"), END, solver=solver), "x", ["a", "b"])
    np.testing.assert_allclose(found.derivatives, [[0.25, 0.5]], rtol=1e-5)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_jump_where_its_condition_is_flat_has_none_either(solver: Any) -> None:
    run = simulate(Way(kind=FLAT), END, solver=solver)
    assert run.final["x"] == pytest.approx(1.4, abs=1e-5)
    with pytest.raises(NoGradient, match=r"the rate of x jumps without an event"):
        sensitivities(run, "x", ["a", "b"])


def test_only_parameters_that_move_the_jump_have_none() -> None:
    """x = a b + t - b; b is when the rate jumps."""
    run = simulate(Way(kind="clock", b=0.5), END)
    np.testing.assert_allclose(sensitivities(run, "x", ["a"]).derivatives, [[0.5]], rtol=1e-6)
    with pytest.raises(NoGradient, match="the rate of x jumps without an event"):
        sensitivities(run, "x", ["b"])
    whole = sensitivities(run, "x")
    assert [*whole.left_out] == ["b"]
    assert whole["x", "a"] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize("kind", [*JUMPS, FLAT, "clock"])
def test_the_engine_refuses_them_too(kind: Kind) -> None:
    """By both parameters, or b alone if it is when the rate jumps."""
    native = build(Way(kind=kind, b=0.5)).native(outputs=["x"], by=["b"])
    native.run(END)
    with pytest.raises(NoGradient, match="a rate jumps without an event there"):
        native.gradient()


class Angle(Component):
    """x = a t, and y integrates its angle, from -π to π, by the coordinates of its point on a circle."""

    units_checked = False
    x: Variable = var("1", "way", default=0.0)
    y: Variable = var("1", "integral", default=0.0)
    angle: Variable = var("1", "angle")
    a: Parameter = param("1", "rate", default=2.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.a
        yield self.angle == atan2(sin(self.x), cos(self.x))
        yield der(self.y) == self.angle


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_an_angle_jumps_at_a_half_turn(solver: Any) -> None:
    """Before it y = a t²/2, and behind it 2π (t - π/a) less: the angle's slope, which is one, tells nothing of that."""
    for end in (1.5, 2.0):
        run = simulate(Angle(), end, solver=solver)
        assert run.final["y"] == pytest.approx(end**2 - (end > 1.6) * 2 * np.pi * (end - np.pi / 2), abs=1e-5)
        np.testing.assert_allclose(run["angle"], np.angle(np.exp(2j * run.time)), atol=1e-7)
        handle = build(Angle()).native([], ["y"], by=["a"])
        handle.reset(until=end)
        handle.step(end)
        if end > 1.6:
            with pytest.raises(NoGradient, match="the rate of y jumps without an event"):
                sensitivities(run, "y", ["a"])
            with pytest.raises(NoGradient, match="a rate jumps without an event"):
                handle.gradient()
        else:
            np.testing.assert_allclose(sensitivities(run, "y", ["a"]).derivatives, [[end**2 / 2]], rtol=1e-7)
            np.testing.assert_allclose(handle.gradient(), [[end**2 / 2]], rtol=1e-6)


def test_an_angle_that_rests_at_zero_has_derivatives() -> None:
    """y = 0, and a t²/2 is its slope."""
    found = sensitivities(simulate(Angle(a=0.0), 1.0), "y", ["a"])
    np.testing.assert_allclose(found.derivatives, [[0.5]], rtol=1e-7)


class Orifice(Component):
    """x = a t, and y integrates the root of its distance from b, or its square."""

    units_checked = False
    x: Variable = var("1", "way", default=0.0)
    y: Variable = var("1", "integral", default=0.0)
    a: Parameter = param("1", "rate", default=2.0)
    b: Parameter = param("1", "where the flow turns", default=1.0)
    rounded: bool = False

    def equations(self) -> Equations:
        away = absolute(self.x - self.b)
        yield der(self.x) == self.a
        yield der(self.y) == (away**2 if self.rounded else sqrt(away))


def test_a_slope_without_bound_is_told() -> None:
    """Steps of any length err by its derivative, of one in a thousand here; with squares y = (b³ + (a t - b)³)/3a."""
    with pytest.raises(NoGradient, match=r"No gradient at t = 0\.5 s: the slope of the rate of y has no bound there"):
        sensitivities(simulate(Orifice(), END), "y", ["a", "b"])
    found = sensitivities(simulate(Orifice(rounded=True), END), "y", ["a", "b"])
    way = 2 * END - 1
    by_a, by_b = (3 * END * way**2 - (1 + way**3) / 2) / 6, (1 - way**2) / 2
    np.testing.assert_allclose(found.derivatives, [[by_a, by_b]], rtol=1e-7)
    handle = build(Orifice()).native(outputs=["y"], by=["a", "b"])
    handle.run(END)
    with pytest.raises(NoGradient, match=r"to a after t = 0\.5 s: the slope of a rate has no bound there"):
        handle.gradient()


@pytest.mark.parametrize("told", [False, True])
def test_the_engine_differentiates_what_is_merely_steep(told: bool) -> None:
    """Corners that one step goes over: b/a^2 and 1 - 1/a, but for the way of 1e-6 between them."""
    handle = build(Way(kind="steep", told=told)).native(outputs=["x"], by=["a", "b"])
    handle.run(END)
    np.testing.assert_allclose(handle.gradient(), [[0.25, 0.5]], rtol=1e-5)
