"""Where guards become positive, against brute force: roots by companion matrices, samples, steps, flat guards."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

from modelica_like.solve.guards import (
    Candidate,
    Ends,
    Located,
    _cubic,
    _event,
    _nearly,
    _newton,
    _positive_top,
    candidates,
    locate,
)
from modelica_like.solve.initialize import Point

NOTHING = np.zeros(0)
Guard = Callable[[float], tuple[float, float]]
"""Value and rate at a time."""


def hermite(g0: float, g1: float, r0: float, r1: float) -> np.poly1d:
    """The cubic with these values and slopes at 0 and 1, by four linear equations."""
    rows = [[0, 0, 0, 1], [1, 1, 1, 1], [0, 0, 1, 0], [3, 2, 1, 0]]
    return np.poly1d(np.linalg.solve(np.array(rows, float), [g0, g1, r0, r1]))


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(11)


class Watched:
    """Guards that are known functions of time, and at which times they were asked for."""

    def __init__(self, *guards: Guard) -> None:
        self.guards, self.asked = guards, list[float]()

    def __call__(self, t: float) -> tuple[Point, list[np.ndarray]]:
        self.asked.append(t)
        values, rates = np.array([one(t) for one in self.guards]).T
        return Point(t, NOTHING, NOTHING, NOTHING), [values, rates, values + 1e-10 * rates]

    def located(self, span: float, inside: Iterable[int] = (), t: float = 0.0) -> Located | None:
        """Locate, in (0, span], the first of all guards; some of them are humps."""
        ends: Ends = {}
        for k, one in enumerate(self.guards):
            (g0, r0), (g1, r1) = one(0.0), one(span)
            ends[k] = g0, g1, r0 * span, r1 * span
        return locate(self, span, ends, [Candidate(k, 0, k in inside) for k in ends], t)


def smooth(value: np.poly1d) -> Guard:
    return lambda t: (float(value(t)), float(value.deriv()(t)))


def stepping(at: float) -> Guard:
    """It jumps from -1 to 1, and has no rate that tells."""
    return lambda t: (1.0 if t >= at else -1.0, 0.0)


@pytest.mark.parametrize(("t", "size"), [(0.0, 1.0), (0.5, 1.0), (1e4, 1e4), (-1e4, 1e4)])
def test_a_guard_that_jumps_is_halved_down_to_a_part_of_the_time(t: float, size: float) -> None:
    """The interval of 1 s has been halved n times when 2⁻ⁿ ≤ 1e-13 of the time, or of 1 s."""
    guard = Watched(stepping(0.3))
    found = guard.located(1.0, t=t)
    assert found is not None
    assert guard.asked[:3] == [0.5, 0.25, 0.375]
    assert 0.3 <= found.point.t <= 0.3 + 1e-13 * size
    assert found.guards == [0]
    assert found.soon.tolist() == [1.0]
    halves = int(np.ceil(np.log2(1 / (1e-13 * size))))
    assert len(guard.asked) == halves + 1  # and once more at the end
    late = Watched(stepping(1.0))  # at the end of the interval only
    found = late.located(1.0)
    assert found is not None
    assert found.point.t == 1.0
    assert found.guards == [0]


def test_a_guard_that_rests_at_zero_has_not_become_positive() -> None:
    """It leaves zero at 0.8 s."""
    guard = Watched(lambda t: (max(t - 0.8, 0.0), float(t >= 0.8)))
    found = guard.located(1.0)
    assert found is not None
    assert found.point.t == pytest.approx(0.8, abs=1e-12)
    falling = Watched(lambda t: (0.0, -1.0) if t < 0.8 else (t - 0.8, 1.0))
    found = falling.located(1.0)
    assert found is not None
    assert found.point.t == pytest.approx(0.8, abs=1e-12)


@pytest.mark.parametrize("span", [0.01, 1.0, 30.0])
def test_the_first_of_several_zeros_in_a_few_trials(random: np.random.Generator, span: float) -> None:
    """Random quintics: their earliest zero is found by a few steps of Newton's method from that of a cubic."""
    for _ in range(30):
        roots = random.uniform(0.1, 0.9, 3)
        guards = [np.poly1d([1.0, -root]) * np.poly1d([1.0, *random.uniform(0.5, 1.5, 2)]) ** 2 for root in roots]
        guard = Watched(*(smooth(np.poly1d(one.coef / span ** np.arange(5, -1, -1))) for one in guards))
        found = guard.located(span)
        assert found is not None
        assert found.point.t == pytest.approx(span * min(roots), abs=2e-13 * max(1.0, span))
        assert found.guards == [int(np.argmin(roots))]
        assert max(guard.asked) <= span
        assert len(guard.asked) < 9


def test_a_guard_that_rises_at_once_is_met_within_the_tolerance() -> None:
    guard = Watched(smooth(np.poly1d([1.0, 2.0, 0.0])))
    found = guard.located(1.0)
    assert found is not None
    assert (found.point.t, found.guards, len(guard.asked)) == (1e-13, [0], 1)
    found = Watched(smooth(np.poly1d([1.0, 2.0, 0.0]))).located(1.0, t=-1e3)
    assert found is not None
    assert found.point.t == 1e-10


def test_humps_and_rises_of_one_interval() -> None:
    """A hump is above zero from 0.3 to 0.4, a guard rises at 0.6; a hump below zero counts as nothing."""
    hump, rise = -np.poly1d([1.0, -0.3]) * np.poly1d([1.0, -0.4]), np.poly1d([1.0, -0.6])
    low = hump - 0.1
    found = Watched(*map(smooth, (rise, hump, low))).located(1.0, [1, 2])
    assert found is not None
    assert found.point.t == pytest.approx(0.3, abs=1e-12)
    assert found.guards == [1]
    found = Watched(*map(smooth, (low, hump))).located(1.0, [0, 1])
    assert found is not None
    assert found.point.t == pytest.approx(0.3, abs=1e-12)
    assert Watched(*map(smooth, (low, low))).located(1.0, [0, 1]) is None
    found = Watched(*map(smooth, (low, rise))).located(1.0, [0])
    assert found is not None
    assert found.point.t == pytest.approx(0.6, abs=1e-12)


@pytest.mark.parametrize("span", [0.01, 1.0, 30.0])
def test_narrow_humps_are_found_in_a_few_trials(random: np.random.Generator, span: float) -> None:
    """Quartics with a top of 1e-7 at random places, in intervals of different lengths; and the same below zero."""
    for _ in range(40):
        top = random.uniform(0.05, 0.95)
        lean = np.poly1d([random.uniform(-0.5, 0.5), 1.0])
        shape = -((np.poly1d([1.0, -top]) * lean) ** 2)
        for height in (1e-7, -1e-7):
            guard = Watched(smooth(np.poly1d((shape + height).coef / span ** np.arange(4, -1, -1))))
            slope = shape.deriv()
            ends: Ends = {0: (shape(0.0) + height, shape(1.0) + height, slope(0.0), slope(1.0))}
            found = _positive_top(guard, span, ends, [Candidate(0, 0, inside=True)])
            assert (found is None) == (height < 0)
            assert found is None or shape(found / span) + height > 0
            assert len(guard.asked) <= 9, (top, height)


def test_a_top_is_sought_by_slopes_of_both_sides() -> None:
    """Of a parabola with a first guess far from its top: the first half misses it, too, then slopes give it exactly."""
    for top, guess in ((0.1, 0.9), (0.9, 0.1)):
        guard = Watched(smooth(1e-9 - np.poly1d([1.0, -2 * top]) ** 2))
        tried: dict[int, Any] = {0: (*_ends_with_top(guess), 8 * top, 8 * (top - 1))}
        found = _positive_top(guard, 2.0, tried, [Candidate(0, 0, inside=True)])
        assert guard.asked[0] == pytest.approx(2 * guess, abs=1e-9)
        assert guard.asked[1] == pytest.approx(guess if guess > 0.5 else guess + 1, abs=1e-9)
        assert guard.asked[2:] == pytest.approx([2 * top], abs=1e-9)
        assert found == guard.asked[2]


def _ends_with_top(guess: float) -> tuple[float, float]:
    """Values so that the cubic with the slopes 8·top and 8·(top - 1), top = 1 - guess, has its top at a guess.

    Its slope is a parabola through these slopes and zero; the integral of it is the difference of the values.
    """
    slope = np.poly1d(np.polyfit([0.0, guess, 1.0], [8 * (1 - guess), 0.0, -8 * guess], 2))
    rise = float(slope.integ()(1.0))
    return -10.0 - max(rise, 0.0), -10.0 - max(rise, 0.0) + rise


def test_a_top_that_only_touches_zero_is_given_up_at_once() -> None:
    """Every guess is exact there: the value is zero, and so is the rate."""
    guard = Watched(lambda t: (-((t - 0.5) ** 2), 1.0 - 2 * t))
    assert guard.located(1.0, [0]) is None
    assert guard.asked == [0.5]


def test_a_zero_counts_as_reached_within_ten_tolerances() -> None:
    """By the rate with which it rises; a guard that is positive counts anyway, unless it is not watched."""
    values = np.array([-9.0, -10.5, 1e-3, 1e-3, 0.0, 0.0, 0.0, -1e-9, -0.0, 5.0, -90.0, -105.0])
    rates = np.array([1.0, 1.0, -1e9, 0.0, 1.0, 0.0, -1.0, 0.0, 2.0, 1.0, 10.0, 10.0])
    scale = 1e-3  # the tolerance
    values[[0, 1, 10, 11]] *= scale
    watched: Ends = {k: (0.0, 0.0, 0.0, 0.0) for k in range(len(values)) if k != 9}
    found = _event(Point(1.0, NOTHING, NOTHING, NOTHING), [values, rates, -values], watched, scale)
    assert found.guards == [0, 2, 3, 4, 8, 10]
    assert found.point.t == 1.0
    assert found.soon.tolist() == (-values).tolist()


def test_steps_to_zeros_of_slow_and_flat_guards() -> None:
    assert _newton([(-1.0, 0.5), (-1.0, 0.0)]) == 2.0
    assert _newton([(0.5, 0.5), (-1.0, 1.0)]) == -1.0
    assert _newton([(0.0, 0.0), (0.0, -1.0), (-1.0, 0.25)]) == 4.0
    assert _newton([(0.5, 0.0), (-1.0, 1.0)]) == np.inf
    assert _newton([(-1.0, 0.0)]) == _newton([]) == np.inf


def test_rising_zeros_of_random_cubics(random: np.random.Generator) -> None:
    """Against the eigenvalues of the companion matrix; where a cubic rises three times, one of the zeros is found."""
    for scale, steep in ((1e-6, 3), (1.0, 3), (1e6, 3), (1.0, 12)):
        for _ in range(150):
            g0, g1 = -random.uniform(0.05, 1), random.uniform(0.05, 1)
            value = hermite(g0, g1, *random.uniform(-steep, steep, 2))
            zeros = [one.real for one in value.roots if abs(one.imag) < 1e-9 and 0 < one.real < 1]
            ends = (scale * value(0), scale * value(1), scale * value.deriv()(0), scale * value.deriv()(1))
            found = _cubic(*ends, inside=False)
            assert min(abs(found - one) for one in zeros) < 2e-4
            if min(abs(value.deriv()(one)) for one in zeros) > 0.5:
                assert min(abs(found - one) for one in zeros) < 1e-9


def test_a_cubic_that_begins_at_zero() -> None:
    """The one with a zero at 0.4 is s·(s - 0.4)."""
    assert _cubic(0.0, 1.0, 1.0, 1.0, inside=False) == 0.0
    assert _cubic(0.0, 1.0, 0.25, 1.0, inside=False) == 0.0
    assert _cubic(0.0, 1.0, 0.0, 2.0, inside=False) == 0.0
    assert _cubic(0.0, 0.6, -0.4, 1.6, inside=False) == pytest.approx(0.4, abs=1e-9)
    assert _cubic(-1.0, 1.0, 2.0, 2.0, inside=False) == 0.5
    assert _cubic(-1e-3, 1.0, 0.0, 2.0, inside=False) == pytest.approx(0.001**0.5, rel=1e-2)


def test_a_top_at_the_end_and_a_cubic_that_is_too_large_for_its_squares() -> None:
    """The first one's slope is (1 - s)² but for rounding; the top of the others may be anywhere inside."""
    assert _cubic(-1.0, -2.0 / 3.0, 1.0, -1e-17, inside=True) == pytest.approx(1.0, abs=1e-6)
    for g1 in (-1e200, -1e199, -5e200):
        assert 0.0 <= _cubic(-1e200, g1, 1e200, -1e200, inside=True) <= 1.0


def test_humps_that_come_near_zero_by_samples(random: np.random.Generator) -> None:
    """The largest of 19 values, and a tenth of the values at both ends."""
    inside = np.arange(1, 20) / 20
    seen = set[bool]()
    for scale in (1e-20, 1.0, 1e20):
        for _ in range(150):
            g0, g1 = -(random.uniform(0, 1, 2) ** 4)
            r0, r1 = random.uniform(0, 2), -random.uniform(0, 2)
            top, near = np.max(hermite(g0, g1, r0, r1)(inside)), -0.1 * (abs(g0) + abs(g1))
            if abs(top - near) > 1e-9:
                assert _nearly(*(scale * np.array([g0, g1, r0, r1])).tolist()) == (top > near)
                seen.add(bool(top > near))
    assert seen == {True, False}


def found(values: Any, rates: Any, step: float, active: Any = None) -> list[list[tuple[int, int, bool]]]:
    groups = candidates(np.array(values), np.array(rates), np.arange(len(values)) if active is None else active, step)
    return [[(one.guard, one.interval, one.inside) for one in group] for group in groups]


def test_candidates_among_random_guards(random: np.random.Generator) -> None:
    """Against a plain loop: a guard that is not positive becomes it, or rises, comes near zero and falls."""
    for step in (0.02, 5.0):
        for _ in range(60):
            values = random.choice([-1.0, -0.3, -0.01, 0.0, 0.5], (5, 6))
            rates = random.choice([-2.0, -1.0, 0.0, 1.0, 2.0], (5, 6)) / step
            active = np.flatnonzero(random.uniform(size=5) < 0.7)
            told = []
            for k in range(5):
                rises = [(int(g), k, False) for g in active if values[g, k] <= 0 < values[g, k + 1]]
                humps = [
                    (int(g), k, True)
                    for g in active
                    if max(values[g, k : k + 2]) <= 0
                    and rates[g, k] > 0 > rates[g, k + 1]
                    and _nearly(*values[g, k : k + 2], *(step * rates[g, k : k + 2]))
                ]
                told += [rises + humps] if rises or humps else []
            assert found(values, rates, step, active) == told


def test_a_decay_is_no_hump() -> None:
    """What changes by less than 1e-30 from look to look."""
    for step in (1e-3, 1e3):
        for g, r0, r1, is_one in (
            (0.0, 2e-30, -2e-30, True),
            (0.0, 0.5e-30, -2e-30, False),
            (0.0, 2e-30, -0.5e-30, False),
            (0.0, 2e-30, 0.0, False),
            (0.0, 1.0, 0.0, False),
            (-1e-3, 1e-2, 0.5e-30, False),
        ):
            assert bool(found([[g, g]], [[r0 / step, r1 / step]], step)) == is_one
    # Which rises to its limit and rests there; which comes from above; which falls faster and faster.
    assert found([[-1.0, 0.0, 0.0, -0.01, -1.0]], [[1.0, 0.0, -0.1, -0.5, -1.0]], 1.0) == []
