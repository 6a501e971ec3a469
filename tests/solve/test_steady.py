"""Steady states: Newton's method, conserved quantities, derivatives; against closed forms."""

from typing import Any

import numpy as np
import pytest

from modelica_like import build
from modelica_like.errors import InitializationError
from modelica_like.language import Component, Equations, Parameter, Variable, der, guess, param, sqrt, tanh, var
from modelica_like.native.start import initialize
from modelica_like.solve.initialize import steady
from modelica_like.solve.initialize.kept import Kept
from modelica_like.solve.initialize.point import Point
from modelica_like.solve.initialize.steady import moving_states, steady_change


class Levels(Component):
    """a settles at 2 or r, b and c exchange what they have until b = k·c, nothing depends on s; z + z³ = a + b."""

    a: Variable = var("1", "level")
    b: Variable = var("1", "level")
    c: Variable = var("1", "level")
    s: Variable = var("s", "integral")
    h: Variable = var("1", "sum of b and c beyond r")
    z: Variable = var("1", "implicit")
    T: Parameter = param("s", "time", default=1.0)
    k: Parameter = param("1", "ratio", default=3.0)
    r: Parameter = param("1", "root", default=6.0)

    def equations(self) -> Equations:
        yield self.T * der(self.a) == -(self.a - 2) * (self.a - self.r)
        yield self.T * der(self.b) == self.k * self.c - self.b
        yield self.T * der(self.c) == self.b - self.k * self.c
        yield der(self.s) == self.z
        yield self.h == self.b + self.c - self.r
        yield self.z + self.z**3 == self.a + self.b


def levels(a: float) -> tuple[Any, Point]:
    model = build(Levels(a=guess(a), b=5.0, c=1.0, s=11.0))
    return model, initialize(model, 0.0, "steady")


@pytest.mark.parametrize(("begins", "root"), [(9.0, 6.0), (4.5, 6.0), (3.5, 2.0), (-7.0, 2.0)])
def test_newton_finds_the_next_root_and_keeps_what_is_conserved(begins: float, root: float) -> None:
    model, point = levels(begins)
    found = dict(zip(model.states, point.x, strict=True))
    wanted = {"a": root, "b": 4.5, "c": 1.5, "s": 11.0}
    assert found == pytest.approx(wanted, rel=1e-13)
    (z,) = [one.real for one in np.roots([1, 0, 1, -root - 4.5]) if abs(one.imag) < 1e-9]
    assert point.z == pytest.approx([z], rel=1e-13)
    assert [model.states[k] for k in moving_states(model)] == ["a", "b", "c"]


def told(model: Component) -> str:
    with pytest.raises(InitializationError) as caught:
        initialize(build(model), 0.0, "steady")
    return caught.value.what.removeprefix("No steady state was found at t = 0 s: ")


def test_what_changes_most_is_told() -> None:
    class Pushed(Component):
        """Least squares of both rates are at y = 3.4: they are -2.4/s and 1.2/s."""

        x: Variable = var("1", "state", default=0.0)
        y: Variable = var("1", "state", default=0.0)
        v: Variable = var("1", "depends on x")
        T: Parameter = param("s", "time", default=1.0)

        def equations(self) -> Equations:
            yield self.T * der(self.y) == 8 - 2 * self.y
            yield self.T * der(self.x) == 1 - self.y + 0 * self.v
            yield self.v + self.v**3 == self.x

    class Rootless(Component):
        x: Variable = var("1", "state", default=0.0)
        y: Variable = var("1", "implicit", default=guess(0.4))
        z: Variable = var("1", "implicit", default=guess(0.4))
        T: Parameter = param("s", "time", default=1.0)
        a: Parameter = param("1", "of y", default=1.0)
        b: Parameter = param("1", "of z", default=1.0)

        def equations(self) -> Equations:
            yield self.T * der(self.x) == self.y - self.x
            yield self.y**2 + self.y == self.a
            yield self.z**2 + self.z == self.b

    class Falling(Component):
        x: Variable = var("1", "state", default=0.4)
        T: Parameter = param("s", "time", default=1.0)

        def equations(self) -> Equations:
            yield self.T * der(self.x) == -3 - self.x**2

    assert told(Pushed()) == "x keeps changing."
    assert told(Rootless(a=-3.0)) == "y keeps changing."
    assert told(Rootless(b=-3.0)) == "z keeps changing."
    assert told(Falling()) == "x keeps changing."


def test_a_guess_where_a_rate_or_a_slope_is_not_finite_is_told() -> None:
    class Root(Component):
        x: Variable = var("1", "state")
        y: Variable = var("1", "state", default=0.0)
        T: Parameter = param("s", "time", default=1.0)

        def equations(self) -> Equations:
            yield self.T * der(self.y) == self.x - self.y
            yield self.T * der(self.x) == 1 - sqrt(self.x)

    for begins in (0.0, -1.0):
        assert told(Root(x=guess(begins))) == "x keeps changing."


def test_changes_of_a_steady_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """By r, k and T, and by changes of the states: b + c = S is conserved, and c = S/(1 + k)."""
    model, point = levels(9.0)
    position = [model.parameter_position[name] for name in ("r", "k", "T")]
    theta = np.zeros((len(model.p) + len(model.u) + model.discrete_size, 4))
    theta[position, range(3)] = 1.0
    theta[position, 3] = 0.25, 0.5, 2.0
    a, b, c, s = (model.states.index(name) for name in "abcs")

    def changed(moved: np.ndarray | None = None) -> np.ndarray:
        return steady_change(model, point, theta, moved)[[a, b, c, s]]

    np.testing.assert_allclose(changed(), [
        [1.0, 0.0, 0.0, 0.25], [0.0, 6 / 16, 0.0, 3 / 16], [0.0, -6 / 16, 0.0, -3 / 16], [0.0] * 4,
    ], atol=1e-13)  # fmt: skip
    moved = np.zeros((len(model.states), 4))
    moved[:, 1:] = np.array([5.0, 3.0, 1.0, -2.0])[np.argsort([a, b, c, s])][:, None]
    more = np.outer([0.0, 3.0, 1.0, -2.0], [0.0, 1.0, 1.0, 1.0])
    before = moved.copy()
    np.testing.assert_allclose(changed(moved), changed() + more, atol=1e-13)
    assert (moved == before).all()

    # If h is held, b + c follows r, whatever moves.
    free, rows = changed(), np.eye(4)[[b, c]].sum(axis=0)[None, moving_states(model)]
    kept = Kept((model.position["h"],), np.zeros(1), rows)
    monkeypatch.setattr(steady, "find_kept", lambda *_: kept)
    by_r = np.outer([0.0, 0.75, 0.25, 0.0], [1.0, 0.0, 0.0, 0.25])
    np.testing.assert_allclose(changed(), free + by_r, atol=1e-13)
    of_s = np.outer([0.0, 0.0, 0.0, -2.0], [0.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(changed(moved), free + by_r + of_s, atol=1e-13)


class Store(Component):
    """A store of heat whose losses saturate, so slowly that the rates of all temperatures are small numbers."""

    C: Parameter = param("J/K", "heat capacity", default=1e7)
    P: Parameter = param("W", "heating", default=0.5)
    most: Parameter = param("W", "largest loss", default=1.0)
    scale: Parameter = param("K", "temperature of 76 % of it", default=1.0)
    T: Variable = var("K", "temperature")

    def equations(self) -> Equations:
        yield self.C * der(self.T) == self.P - self.most * tanh(self.T / self.scale)


def test_small_rates_of_a_large_store_are_no_rest() -> None:
    found = initialize(build(Store(T=guess(0.2))), start="steady")
    assert found.x == pytest.approx([np.arctanh(0.5)], rel=1e-8)
    assert told(Store(T=guess(5.0))) == "T keeps changing."  # Newton's method goes to -2748 K from there
    assert told(Store(most=0.4)) == "T keeps changing."
