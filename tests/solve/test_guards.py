"""Guards: which may fire in which mode, and where they are looked for."""

from typing import Any, Literal

import numpy as np
import pytest

from modelica_like import build, simulate
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    guess,
    param,
    sqrt,
    var,
)
from modelica_like.solve.guards import (
    Candidate,
    Guards,
    _cubic,
    _hermite,
    _nearly,
    _newton,
    _positive_top,
    candidates,
    locate,
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
    assert _newton([(-1.0, -1.0)]) == np.inf
    assert _newton([(-1.0, 2.0), (1.0, -1.0)]) == np.inf  # it has risen before
    assert _newton([(-1.0, 2.0), (1.0, 0.0)]) == np.inf


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


class Two(Component):
    """Two states, an implicit unknown, and guards on all of them."""

    a: Variable = var("1", "state", default=1.0)
    b: Variable = var("1", "state of another size", default=1.0, nominal=1e3)
    y: Variable = var("1", "implicit", default=guess(1.0))
    side = Mode("below", "above")
    cubic: Parameter = param("1", "factor of y³", default=1.0)
    unit: Parameter = param("s", "unit", default=1.0)

    def equations(self) -> Equations:
        yield self.unit * der(self.a) == 1
        yield self.unit * der(self.b) == self.a
        yield self.y + self.cubic * self.y**3 == self.a

    def events(self) -> Events:
        yield self.side.go("below", "above", when=self.a * self.b > 7.0)
        yield self.side.go("above", "below", when=self.y < 0.3)


@pytest.mark.parametrize("cubic", [0.0, 1.0])
def test_what_two_interpolations_of_the_states_make_of_guards(cubic: float) -> None:
    """The first is base + 0.5·data[0], the second base + 0.5·data[1]; then y of y + cubic·y³ = a."""
    model = build(Two(cubic=cubic))
    assert model.implicit
    base, tolerances = np.array([2.0, 4.0]), (1e-3, np.array([1e-6, 1e-3]))
    data, two = np.zeros((8, 2)), np.zeros((2, 8))
    data[:2], two[[0, 1], [0, 1]] = [[0.4, 0.0], [0.41, 0.004]], 0.5

    def near(data: np.ndarray) -> tuple[float, list[float], list[float]]:
        return Guards(model).near(0.0, base, data, two, tolerances, np.array([y(2.2)]), np.zeros(model.discrete_size))

    def y(a: float) -> float:
        return next(float(np.real(one)) for one in np.roots([cubic, 0.0, 1.0, -a]) if abs(np.imag(one)) < 1e-9)

    doubt, rough, moved = near(data)
    assert doubt == pytest.approx(0.005 / (2.2e-3 + 1e-6), rel=1e-9)
    assert rough == pytest.approx([2.205 * 4.002 - 2.2 * 4.0, y(2.205) - y(2.2)], rel=1e-6)
    changed = 2.2 + 2.2e-3 + 1e-6, 4.0 + 4e-3 + 1e-3
    assert moved == pytest.approx([changed[0] * changed[1] - 2.2 * 4.0, y(changed[0]) - y(2.2)], rel=1e-6)
    data[1, 1] = np.nan
    assert near(data)[0] == np.inf


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


@pytest.mark.parametrize(
    ("a", "b", "values", "rates"),
    [
        (4.0, 0.5, [1.0, 2.0, 0.0, 2.0], [0.25, 0.0, 1e-31, 1.0]),
        (2.0, -0.5, [2**0.5 - 1, -2.0, 0.0, 1e-300], [8**-0.5, 0.0, 1e-31, 1.0]),
        (0.0, 0.0, [-1.0, 1e300, 0.0, -2.0], [0.0, 0.0, 1e-31, 1.0]),
        (-1.0, -1e-305, [-1.0, -1.0, 0.0, -3.0], [0.0, 0.0, 1e-31, 1.0]),
        (-20.0, 1e-3, [-1.0, 1e3, -2e-30, -22.0], [0.0, 0.0, 1e-31, 1.0]),
        (20.0, -1e299, [20**0.5 - 1, 0.0, 2e-30, 18.0], [80**-0.5, 0.0, 1e-31, 1.0]),
    ],
)
def test_guards_are_numbers(a: float, b: float, values: list[float], rates: list[float]) -> None:
    """What is no number is false, and rounding is zero; but a relation that is just true stays true."""
    model = build(Odd(a=a, b=b))
    guards = Guards(model)
    x = np.array([{"a": a, "b": b}[one] for one in model.states])
    for side in (0.0, 1.0):
        d = np.zeros(model.discrete_size)
        d[[one.path in ("side", "other") for one in model.flat_discretes]] = side
        point = Point(7.0, x, np.zeros(0), d)
        here, speed, soon = (one.copy() for one in guards.at(point))
        asleep = [1 - int(side), 3 - int(side)]
        awake = [int(side), 2 + int(side)]
        assert guards.active(d).tolist() == awake
        np.testing.assert_allclose(here[awake], np.array(values)[awake], rtol=1e-12)
        np.testing.assert_allclose(speed, rates, rtol=1e-12)
        assert here[asleep].tolist() == soon[asleep].tolist() == [-1.0, -1.0]
        # An infinite rate is no number to go by; its sign tells the direction.
        finite = np.where((a == 0) & (np.arange(4) == 0), 1.0, rates)
        later = np.array(values) + 7e-10 * finite
        np.testing.assert_allclose(soon[awake], np.where(np.abs(later) < 1e-30, 0.0, later)[awake], rtol=1e-9)
        wanting = [guards.positions[id(one)] for one in guards.wanting(point)]
        assert wanting == [k for k in awake if soon[k] > 0]


def test_guards_at_many_times_at_once() -> None:
    """Of a·b > 7 and y < 0.3 with y + y³ = a, a' = 1, b' = a: y' = 1/(1 + 3·y²)."""
    model = build(Two())
    guards, random = Guards(model), np.random.default_rng(5)
    y = random.uniform(0.1, 2.0, 5)
    a, b = y + y**3, random.uniform(-3.0, 3.0, 5)
    d, times = np.zeros(model.discrete_size), np.arange(5.0)
    x = np.array([{"a": a, "b": b}[one] for one in model.states])
    values, rates, slopes = guards.along(times, x, y[None], d)
    np.testing.assert_allclose(values, [a * b - 7.0, 0.3 - y], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(rates, [b + a * a, -1 / (1 + 3 * y * y)], rtol=1e-12)
    np.testing.assert_allclose(slopes, [{"a": 0 * a + 1, "b": a}[one] for one in model.states], rtol=1e-12)
    for k in range(5):
        point = Point(times[k], x[:, k], y[None, k] + 1e-4, d)
        values, rates, soon, before = (one.copy() for one in guards.follow(point))
        assert point.z == pytest.approx([y[k]], abs=1e-13)
        assert before == pytest.approx([y[k]], abs=1e-7)
        assert values == pytest.approx([a[k] * b[k] - 7.0, -1.0])
        assert rates == pytest.approx([b[k] + a[k] ** 2, -1 / (1 + 3 * y[k] ** 2)])
        assert (soon[0] > values[0]) == (rates[0] > 0)


def test_doubt_about_states_is_relative_to_their_sizes() -> None:
    """Negative states, and a difference below one tolerance; without a difference there is no doubt."""
    model = build(Two())
    base, z, d = np.array([-2.0, -4.0]), np.array([-1.0]), np.zeros(model.discrete_size)
    data, two = np.zeros((8, 2)), np.zeros((2, 8))
    two[1, 3] = 0.5
    for apart in (0.0, 1e-4, -1e-4):
        data[3] = [2 * apart, 0.0]
        doubt, rough, moved = Guards(model).near(0.0, base, data, two, (1e-3, np.array([1e-6, 1e-3])), z, d)
        assert doubt == pytest.approx(abs(apart) / (2e-3 + 1e-6), rel=1e-9)
        assert rough == pytest.approx([4 * abs(apart), abs(apart) / 4], rel=1e-3, abs=1e-12)
        assert moved[0] == pytest.approx(8 - (2 - 2e-3 - 1e-6) * (4 - 5e-3), rel=1e-9)


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
