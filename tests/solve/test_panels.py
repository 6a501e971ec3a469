"""Panels of IDAS: where their pieces lie, how precise polynomials between results are, what a segment costs."""

import numpy as np
import pytest

from modelica_like import simulate
from modelica_like.language import Component, Equations, Events, Mode, Parameter, Variable, cos, der, param, sqrt, var
from modelica_like.solve.idas import Grid


def test_places_of_a_grid() -> None:
    assert Grid(pieces=2, looks=4).shares == pytest.approx(np.arange(1, 9) / 8)
    graded = Grid(pieces=2, looks=2, power=3)
    assert graded.ends == pytest.approx([1 / 8, 1])
    assert graded.shares == pytest.approx([1 / 16, 1 / 8, 9 / 16, 1])


class Oscillator(Component):
    x: Variable = var("m", "position", state="always")
    v: Variable = var("m/s", "speed", state="always")
    w: Parameter = param("rad/s", "frequency", default=20.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -(self.w**2) * self.x


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_polynomials_are_as_precise_as_results(rtol: float) -> None:
    run = simulate(Oscillator(x=1.0, v=0.0), 1.0, points=10, rtol=rtol, atol=rtol / 100)
    assert run.dense is not None
    dense = run.dense()

    def error(times: np.ndarray) -> float:
        x = dense.points(np.arange(len(times)), times)[0][run.model.states.index("x")]
        return float(np.abs(x - np.cos(20 * times)).max())

    assert error(0.37 * dense.begins + 0.63 * dense.ends) <= error(dense.ends) + 3 * rtol


class Relay(Component):
    """x runs to and fro between 0 and 1, in one second each way."""

    x: Variable = var("1", "position")
    s: Variable = var("1", "its way, rounded at its ends")
    T: Parameter = param("s", "of a way", default=1.0)
    way = Mode("up", "down")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.way.choose(up=1, down=-1)
        yield self.T * der(self.s) == sqrt(self.x**2 + 1e-6)

    def events(self) -> Events:
        yield self.way.go("up", "down", when=self.x > 1)
        yield self.way.go("down", "up", when=self.x < 0)


def test_segments_that_come_again_cost_few_calls() -> None:
    run = simulate(Relay(x=0.0, s=0.0), 50.5)
    assert [event.time for event in run.events] == pytest.approx(np.arange(1, 51), abs=1e-6)
    assert run.statistics.integrations <= 4 * 51


class Stiff(Component):
    """Follows cos(t) within a nanosecond, from elsewhere: (x - cos)' = -(x - cos)/T, but for the slope of cos."""

    units_checked = False
    x: Variable = var("1", "follows", state="always")
    T: Parameter = param("s", "time constant", default=1e-9)
    v: Variable = var("1", "its integral", state="always", default=0.0)
    side = Mode("above", "below")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == cos(self.time) - self.x
        yield der(self.v) == self.x

    def events(self) -> Events:
        yield self.side.go("above", "below", when=self.x < 0)


def test_a_transient_of_a_nanosecond_is_followed_by_long_pieces() -> None:
    run = simulate(Stiff(x=3.0), 2.0, rtol=1e-9)
    assert [event.time for event in run.events] == pytest.approx([np.pi / 2], abs=1e-6)
    assert run.final["v"] == pytest.approx(np.sin(2.0) + 2e-9, abs=1e-6)
    assert run.statistics.integrations < 50
