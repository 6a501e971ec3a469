"""Between looks: interpolation is exact for polynomials, and tells where it is not precise."""

from typing import cast

import numpy as np
import pytest

from modelica_like.solve.between import Piece, interpolate
from modelica_like.solve.guards import Guards
from modelica_like.solve.idas import Integrator
from modelica_like.solve.looks import SCHEMES, Looks, Scheme

TIMES = np.linspace(2.0, 4.0, 9)
BETWEEN = np.array([2.01, 2.3, 2.9, 3.49, 3.99])


class Known:
    """Stands for an integrator and its guards: tolerances, and slopes that are known."""

    tolerances = 0.0, np.array([1e-9])

    def __init__(self, slopes: np.ndarray) -> None:
        self.slopes = slopes

    def weights(self, x: np.ndarray) -> np.ndarray:
        return np.full_like(x, 1e-9)

    def polished(self, times: np.ndarray, x: np.ndarray, z: np.ndarray, d: np.ndarray) -> np.ndarray:
        return z

    def along(self, times: np.ndarray, *_: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return np.zeros((0, len(times))), np.zeros((0, len(times))), self.slopes


def looks(values: np.ndarray, slopes: np.ndarray) -> Looks:
    known = Known(slopes[None, :])
    nothing = np.zeros((0, len(values)))
    return Looks(cast(Integrator, known), cast(Guards, known), TIMES, values[None, :], nothing, np.zeros(0))


def between(seen: Looks) -> tuple[np.ndarray, set[int]]:
    """States between looks, and the intervals in which they are not precise."""
    piece = Piece(seen, BETWEEN, seen.count, np.zeros((1, len(BETWEEN))), np.zeros((0, len(BETWEEN))))
    unknown = interpolate(seen.integrator, [piece])
    return piece.x, {interval for _, interval in unknown}


@pytest.mark.parametrize("scheme", SCHEMES, ids=["slopes", "values"])
@pytest.mark.parametrize("degree", range(8))
def test_in_every_interval_one_polynomial_is_of_degree_seven_and_one_of_five(scheme: Scheme, degree: int) -> None:
    nodes, shares = np.arange(float(scheme.nodes)), np.array([0.2, 0.5, 0.9])
    data = np.concatenate([nodes**degree, *([degree * nodes ** max(degree - 1, 0)] if scheme.slopes else [])])
    for cell in range(scheme.nodes - 1):
        exactly = (cell + shares) ** degree
        precise, coarse = (
            shares[:, None] ** np.arange(8) @ one[cell] @ data for one in (scheme.precise, scheme.coarse)
        )
        rounding = 1e-12 * nodes[-1] ** degree
        np.testing.assert_allclose(precise, exactly, rtol=0, atol=rounding)
        assert np.allclose(coarse, exactly, rtol=0, atol=rounding) == (degree <= 5)
        assert scheme.doubt[cell] @ data == pytest.approx(exactly[1] - coarse[1], abs=rounding)
    between, ends = np.random.default_rng(degree).normal(size=len(data)), np.array([0.0, 1.0])[:, None] ** np.arange(8)
    for cell in range(scheme.nodes - 1):  # both pass through the values at both ends
        for one in (scheme.precise, scheme.coarse):
            np.testing.assert_allclose(ends @ one[cell] @ between, between[cell : cell + 2], atol=1e-9)
    last = scheme.nodes + 4
    firsts = [int(scheme.first(k, last)) for k in range(last)]
    assert all(0 <= first <= k < first + scheme.nodes - 1 <= last for k, first in enumerate(firsts))
    assert firsts[scheme.nodes // 2] == 1  # as many looks before as behind


@pytest.mark.parametrize("degree", range(6))
def test_polynomials_up_to_degree_five_are_exact_and_precise(degree: int) -> None:
    x, unknown = between(looks(TIMES**degree, degree * TIMES ** max(degree - 1, 0)))
    np.testing.assert_allclose(x[0], BETWEEN**degree, rtol=1e-13)
    assert len(unknown) == 0


def test_degree_seven_is_exact_but_not_known_to_be() -> None:
    x, unknown = between(looks(TIMES**7, 7 * TIMES**6))
    np.testing.assert_allclose(x[0], BETWEEN**7, rtol=1e-12)
    assert unknown == {0, 1, 3, 5, 7}


def test_between_too_few_looks_states_are_straight_lines_that_are_not_precise() -> None:
    seen = looks(TIMES, np.ones(9))
    few = Looks(seen.integrator, seen.guards, TIMES[::4], np.array([[1.0, 3.0, -1.0]]), seen.z[:, ::4], seen.d)
    few.seen = np.zeros((0, 3)), np.zeros((0, 3)), np.full((1, 3), 7.0)
    x, unknown = between(few)
    np.testing.assert_allclose(x[0], np.interp(BETWEEN, TIMES[::4], few.x[0]))
    assert unknown == {0, 1}


def test_slopes_that_are_nothing_but_rounding_are_left_out() -> None:
    """A stiff state: its values are smooth, its slopes are errors times a large number."""
    noise = 1e3 * np.random.default_rng(1).normal(size=len(TIMES))
    x, unknown = between(looks(TIMES**5, noise))
    np.testing.assert_allclose(x[0], BETWEEN**5, rtol=1e-12)
    assert len(unknown) == 0


@pytest.mark.parametrize(
    ("rough", "moved", "sharp", "fresh"),
    [(0.9e-4, 0.9, True, True), (1.1e-4, 0.9, False, False), (0.9e-4, 1.1, False, True), (1.1e-4, 1.1, False, False)],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_what_a_guard_takes_of_states_is_judged_by_its_size(
    monkeypatch: pytest.MonkeyPatch, rough: float, moved: float, sharp: bool, fresh: bool, sign: int
) -> None:
    """Its difference by two degrees, and by a tolerance, over its values at both looks; guard 1 is of no interest."""
    seen = looks(TIMES**2, 2 * TIMES)
    size = 0.25 + 0.75
    near = [1.0, [rough * size, 9.0], [moved * size, 9.0]]
    times = list[float]()
    monkeypatch.setattr(Known, "near", lambda _self, t, *_: times.append(t) or near, raising=False)
    (cell, *_) = seen.cells(3, 8)
    ends = {0: (-0.25 * sign, 0.75 * sign, 1.0, 1.0)}
    assert seen.is_sharp(cell, ends, fresh=False) == sharp
    assert seen.is_sharp(cell, ends, fresh=True) == fresh
    near[0] = 1.001
    assert not seen.is_sharp(cell, ends, fresh=True)
    assert times == [0.5 * (TIMES[3] + TIMES[4])] * 3


def test_looks_may_be_left_out() -> None:
    seen = looks(TIMES**2, 2 * TIMES)
    assert seen.every(1) is seen
    half = seen.every(2)
    assert (half.count, half.width) == (4, 0.5)
    np.testing.assert_array_equal(half.x[0], TIMES[::2] ** 2)
    assert half.within(1) is None
    few = seen.every(4).within(1)
    assert few is not None
    np.testing.assert_array_equal(few.times, TIMES[4:])
    assert seen.intervals(np.array([2.0, 2.1, 2.26, 3.99, 4.0])).tolist() == [0, 0, 1, 7, 7]


def test_a_kink_between_looks_is_noticed() -> None:
    values, slopes = np.maximum(TIMES - 2.9, 0.0), np.where(TIMES > 2.9, 1.0, 0.0)
    _, unknown = between(looks(values, slopes))
    assert 3 in unknown


def test_what_rests_rests_exactly_and_beginnings_keep_their_relative_precision() -> None:
    rest = looks(np.full(9, 1 / 3), np.zeros(9))
    assert np.all(between(rest)[0] == 1 / 3)
    start = looks(1e-3 * (TIMES - 2) ** 3 + 5, 3e-3 * (TIMES - 2) ** 2)
    (cell, *_) = start.cells(0, 8)
    assert cell.states(2 + 1e-9)[0] - 5 == 0.0
    fall = looks(1e3 * (TIMES - 2) ** 2, 2e3 * (TIMES - 2))
    (cell, *_) = fall.cells(0, 8)
    assert cell.states(2 + 1e-6)[0] == pytest.approx(1e-9, rel=1e-6)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_doubt_is_what_the_next_power_tells(scheme: Scheme) -> None:
    """Both polynomials keep what the coarse one can have; the next power they tell apart by its error in the middle.

    The coarse one uses the looks around the cell, as far as there are any: its error is the product of the distances
    from its looks, squared where it has slopes.
    """
    fewer = scheme.nodes - (1 if scheme.slopes else 2)
    per = 2 if scheme.slopes else 1
    looks = np.arange(scheme.nodes, dtype=float)
    for cell in range(scheme.nodes - 1):
        first = min(max(cell - (fewer - 1) // 2, 0), scheme.nodes - fewer)
        for power in range(per * fewer + 1):
            u = looks - cell
            data = u**power if per == 1 else np.concatenate([u**power, power * u ** max(power - 1, 0)])
            error = 0.0 if power < per * fewer else np.prod((0.5 - u[first : first + fewer]) ** per)
            assert scheme.doubt[cell] @ data == pytest.approx(error, abs=1e-9 * 8.0**power)
            assert scheme.middle[cell, 0] @ data == pytest.approx(0.5**power, abs=1e-9 * 8.0**power)
