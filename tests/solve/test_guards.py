"""Guards: which may fire in which mode, and where they are looked for."""

from typing import Any

import numpy as np
import pytest

from modelica_like import simulate
from modelica_like.initialize import Point
from modelica_like.language import Component, Equations, Events, Mode, Parameter, Variable, der, param, var
from modelica_like.solve.guards import Candidate, _cubic, _hermite, _nearly, _newton, _positive_top, candidates, locate


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


class Known:
    """A guard that is a known function of time, and how often it was asked for."""

    def __init__(self, value: np.poly1d) -> None:
        self.value, self.asked = value, 0

    def __call__(self, time: float) -> tuple[Point, list[np.ndarray]]:
        self.asked += 1
        now = [np.array([one]) for one in (self.value(time), self.value.deriv()(time), self.value(time + 1e-10))]
        nothing = np.zeros(0)
        return Point(time, nothing, nothing, nothing), now

    def ends(self, span: float) -> dict[int, tuple[float, float, float, float]]:
        rate = self.value.deriv()
        return {0: (self.value(0.0), self.value(span), span * rate(0.0), span * rate(span))}


TOP = np.poly1d([-1.0, 0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("height", [1e-3, 1e-6])
def test_a_double_root_is_found_at_its_first_zero(height: float) -> None:
    """(t - 0.4)² = height has the zeros 0.4 ± √height."""
    guard = Known(np.poly1d([-1.0, 0.8, height - 0.16]))
    found = locate(guard, 1.0, guard.ends(1.0), [Candidate(0, 0, inside=True)], 0.0)
    assert found is not None
    assert found.guards == [0]
    assert found.point.t == pytest.approx(0.4 - np.sqrt(height), abs=1e-10)


def test_a_top_below_zero_is_given_up_soon() -> None:
    """1 - t⁴ moved down to -0.02, whose top is at 0.3: the cubic between the ends has it elsewhere."""
    guard = Known(np.polyval(TOP - 1.02, np.poly1d([1.0, -0.3])))
    assert locate(guard, 1.0, guard.ends(1.0), [Candidate(0, 0, inside=True)], 0.0) is None
    assert guard.asked < 20


def test_a_straight_guard_is_met_at_its_zero() -> None:
    """A guard that rises through zero in a straight line is met at its zero, to 1e-13 of the time."""
    guard = Known(np.poly1d([3.0, -1.0]))
    found = locate(guard, 1.0, guard.ends(1.0), [Candidate(0, 0, inside=False)], 0.0)
    assert found is not None
    assert found.point.t == pytest.approx(1 / 3, abs=2e-13)
    assert guard.asked < 5


def test_the_earliest_zero_of_straight_guards_that_rise() -> None:
    assert _newton([(-1.0, 2.0), (-1.0, 4.0), (-1.0, -9.0)]) == 0.25
    assert _newton([(1.0, 2.0)]) == -0.5
    assert _newton([(-1.0, -1.0)]) is None
    assert _newton([(-1.0, 2.0), (1.0, -1.0)]) is None  # it has risen before
    assert _newton([(-1.0, 2.0), (1.0, 0.0)]) is None


def ends(value: np.poly1d) -> tuple[float, float, float, float]:
    return value(0.0), value(1.0), value.deriv()(0.0), value.deriv()(1.0)


@pytest.mark.parametrize("root", [0.03, 0.3, 0.85])
@pytest.mark.parametrize("other", [(1.0, 1.0, 1.0), (-1.0, 0.5, 2.0), (0.0, -3.0, 7.0)])
def test_the_first_guess_is_the_zero_of_the_cubic(root: float, other: tuple[float, float, float]) -> None:
    value = np.poly1d([1.0, -root]) * np.poly1d(other)
    assert _cubic(*ends(value), inside=False) == pytest.approx(root, abs=1e-9)


@pytest.mark.parametrize(("top", "bottom"), [(0.1, 2.0), (0.35, 2.0), (0.9, 2.0), (0.7, -0.5)])
def test_the_first_guess_of_a_hump_is_the_top_of_the_cubic(top: float, bottom: float) -> None:
    """Its slope is ±(s - top)·(s - bottom)."""
    sign = 1.0 if bottom > top else -1.0
    value = sign * (np.poly1d([1.0, -top]) * np.poly1d([1.0, -bottom])).integ() - 5.0
    assert _cubic(*ends(value), inside=True) == pytest.approx(top, abs=1e-9)
    assert not _nearly(*ends(value))
    assert _nearly(*ends(value - value(top)))


@pytest.mark.parametrize("way", [np.poly1d([1.0, 0.0]), np.poly1d([-1.0, 1.0])], ids=["forward", "backward"])
@pytest.mark.parametrize(("top", "height"), [(0.37, 1e-4), (0.6, 1e-6), (0.8, 1e-8)])
def test_a_hump_is_found_where_the_cubic_through_its_ends_misses_it(top: float, height: float, way: np.poly1d) -> None:
    inner = np.polyval(np.poly1d([3.0, 0.0, 1.0]) * np.poly1d([1.0, -top]), way)
    value = height - inner * inner
    tried: list[float] = []

    def trial(t: float) -> Any:
        tried.append(t)
        return None, [np.array([value(t)]), np.array([value.deriv()(t)]), np.array([value(t)])]

    found = _positive_top(trial, 1.0, {0: ends(value)}, [Candidate(0, 0, True)])
    assert value(tried[0]) < 0
    assert found is not None
    assert value(found) > 0
    value = value - 2 * height
    assert _positive_top(trial, 1.0, {0: ends(value)}, [Candidate(0, 0, True)]) is None


@pytest.mark.parametrize("top", [0.25, 0.6])
@pytest.mark.parametrize("astray", [-0.4, 0.4])
def test_the_top_of_a_parabola_is_where_the_straight_line_of_slopes_is_zero(top: float, astray: float) -> None:
    """After a first guess that misses it."""
    value = 1e-9 - np.poly1d([1.0, -top]) ** 2
    tried: list[float] = []

    def trial(t: float) -> Any:
        tried.append(t)
        return None, [np.array([value(t)]), np.array([value.deriv()(t)]), np.array([value(t)])]

    slope, span = value.deriv(), 2.0
    seen = value(0.0) + astray, value(span), span * slope(0.0), span * slope(span)
    found = _positive_top(trial, span, {0: seen}, [Candidate(0, 0, True)])
    assert len(tried) == 3  # the second one halves what is left
    assert found == pytest.approx(top, abs=1e-5)


def test_a_cubic_is_known_by_its_ends() -> None:
    cubic, inside = np.poly1d([3.0, -2.0, 0.7, -0.1]), np.linspace(0.0, 1.0, 7)
    slope = cubic.deriv()
    assert _hermite(inside) @ [cubic(0), slope(0), cubic(1), slope(1)] == pytest.approx(cubic(inside), abs=1e-14)


class Ahead:
    """Guards at some times, their rates, and what is found in them."""

    def __init__(self, *values: np.poly1d) -> None:
        self.times = np.linspace(0.0, 1.0, 6)
        self.values = np.array([one(self.times) for one in values])
        self.rates = np.array([one.deriv()(self.times) for one in values])

    def found(self, active: list[int]) -> list[tuple[int, int, bool]]:
        groups = candidates(self.values, self.rates, np.array(active), 0.2)
        return [(one.guard, one.interval, one.inside) for group in groups for one in group]


def test_where_guards_may_become_positive() -> None:
    """One rises through zero at 0.5, one has a double root near 0.3, one touches nothing, one is positive all along."""
    rises, hump = np.poly1d([1.0, -0.5]), np.poly1d([-1.0, 0.6, 1e-4 - 0.09])
    ahead = Ahead(rises, hump, hump - 1.0, rises + 1.0, -rises)
    assert ahead.found([0, 1, 2, 3, 4]) == [(1, 1, True), (0, 2, False)]
    assert ahead.found([1, 2]) == [(1, 1, True)]
    assert ahead.found([2, 3]) == []
