"""Rules over results: exact for polynomials of their order, wherever the interval is and however results are spaced."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from modelica_like.runs.powers import Results, _apart, _mixed, _ratio, _stretches, results
from modelica_like.runs.quadrature import composite, rules
from modelica_like.solve.recorder import Segment

RANDOM = np.random.default_rng(3)


def spaced(kind: str, size: int) -> np.ndarray:
    """Times of a piece; `one longer step` is at its end or its beginning."""
    steps = np.full(size - 1, 0.25)
    if kind == "uneven":
        steps = RANDOM.uniform(0.1, 0.4, size - 1)
    elif kind == "longer":
        steps[-1:] *= 1.5
    return np.cumsum([0.0, *steps])


@pytest.mark.parametrize("kind", ["even", "uneven", "longer"])
@pytest.mark.parametrize("sizes", [[1], [2], [3, 5], [8], [1, 9, 4], [12, 7]])
def test_each_rule_integrates_polynomials_of_its_order(kind: str, sizes: list[int]) -> None:
    """Of n results, at most 8: degree n-1; then two and four less; the results are those nearest to the interval."""
    pieces = [spaced(kind, size) for size in sizes]
    begins = np.cumsum([0, *sizes])
    times = np.concatenate([piece - piece[0] + 10.0 * k for k, piece in enumerate(pieces)])
    first, last = np.repeat(begins[:-1], sizes), np.repeat(begins[1:] - 1, sizes)
    intervals, places, weights = rules(times, first, last)
    assert intervals.tolist() == [k for k in range(len(times)) if k < last[k]]
    for k, those, orders in zip(intervals, places, weights, strict=True):
        size = min(last[k] - first[k] + 1, 8)
        begin = min(max(k - (size - 1) // 2, first[k]), last[k] + 1 - size)
        assert those[:size].tolist() == list(range(begin, begin + size))
        assert those.min() >= first[k]
        assert those.max() <= last[k]
        step = times[k + 1] - times[k]
        at = (times[those] - times[k]) / step
        for reduced, row in zip((0, 2, 4), orders, strict=True):
            used = max(size - reduced, 1)
            assert np.count_nonzero(row) <= used
            for degree in range(used):
                assert row @ at**degree == pytest.approx(step / (degree + 1), rel=1e-9)
            if used < 8 and (kind != "longer" or used % 2):
                assert row @ at**used != pytest.approx(step / (used + 1), rel=1e-6)


@pytest.mark.parametrize("kind", ["even", "uneven", "longer"])
@pytest.mark.parametrize("sizes", [[1], [2], [3, 5], [8], [1, 9, 4], [12, 40]])
def test_the_composite_rule_integrates_polynomials_over_all_pieces(kind: str, sizes: list[int]) -> None:
    """Of the order of the widest rule of each piece."""
    begins, pieces = np.cumsum([0, *sizes]), [spaced(kind, size) for size in sizes]
    first, last = np.repeat(begins[:-1], sizes), np.repeat(begins[1:] - 1, sizes)
    weights = composite(np.concatenate(pieces), first, last)
    for begin, piece in zip(begins, pieces, strict=False):
        those, span = weights[begin : begin + len(piece)], piece[-1]
        for degree in range(min(len(piece), 8) if span else 0):
            assert those @ piece**degree == pytest.approx(span ** (degree + 1) / (degree + 1), rel=1e-9)
    assert not weights[begins[:-1][np.array(sizes) == 1]].any()


def test_intervals_without_length_have_no_rule() -> None:
    times = np.array([0.0, 1.0, 1.0, 1.0, 2.0, 2.0])
    intervals, _, weights = rules(times, np.array([0, 0, 2, 3, 3, 5]), np.array([1, 1, 2, 4, 4, 5]))
    assert intervals.tolist() == [0, 3]
    assert weights[:, 0].sum(axis=1) == pytest.approx(1.0)
    assert rules(times[1:3], np.array([0, 0]), np.array([1, 1]))[0].size == 0


def given(times: list[float], sizes: list[int]) -> Results:
    ends = np.cumsum(sizes)
    nothing = np.zeros((0, len(times)))
    first, last = np.repeat(ends - sizes, sizes), np.repeat(ends - 1, sizes)
    return Results(np.array(times), nothing, nothing, nothing, first, last, nothing, nothing)


def test_results_close_to_a_neighbour_are_left_out_but_not_ends() -> None:
    """One result is within a tenth of the other distance; ends of pieces stay."""

    def apart(every: Results) -> Any:
        return _apart(every, np.diff(every.times))

    times = [0.0, 0.09, 1.09, 2.09, 2.2, 3.19, 3.19, 4.0, 4.07, 4.08]
    assert apart(given(times, [6, 4])).tolist() == [0, 2, 3, 4, 5, 6, 8, 9]
    assert apart(given([0.0, 0.05, 1.0], [3])).tolist() == [0, 2]
    assert apart(given([0.0, 0.95, 1.0], [3])).tolist() == [0, 2]
    assert apart(given([0.0, 1.0], [2])).tolist() == [0, 1]


def test_coarse_intervals_near_each_other_are_joined_within_a_piece() -> None:
    coarse, piece = np.zeros(40, bool), np.where(np.arange(40) < 20, 0, 20)
    assert _stretches(coarse, piece) == []
    coarse[[1, 2, 10, 19, 20, 28, 37, 39]] = True
    found = [(int(one[0]), int(one[-1]), len(one)) for one in _stretches(coarse, piece)]
    assert found == [(1, 10, 10), (19, 19, 1), (20, 28, 9), (37, 39, 3)]


def test_a_gain_is_at_most_one() -> None:
    assert _ratio(np.array([1.0, 2.0, 3.0, 0.0]), np.array([4.0, 2.0, 1.0, 0.0])).tolist() == [0.25, 1, 1, 1]


def test_sums_have_two_weights_between_one_and_two() -> None:
    """So no two powers cancel in both; of rates of energies the same."""
    flat = _mixed(np.eye(8).reshape(4, 2, 8))
    assert flat.shape == (4, 8)
    assert ((flat[0] >= 1.0) & (flat[0] < 2.0)).all()
    assert ((flat[1] > -1.0) & (flat[1] <= 2.0)).all()
    assert flat[2:, :6].tolist() == np.zeros((2, 6)).tolist()
    assert np.array_equal(flat[2:, 6:], flat[:2, :2])
    for one in range(8):
        for other in range(one):
            assert abs(flat[0, one] * flat[1, other] - flat[0, other] * flat[1, one]) > 1e-3


@pytest.mark.parametrize(
    ("components", "sizes", "told"),
    [
        (1, [3, 4], [[3, 4]]),
        (1, [20_000, 5], [[20_000, 5]]),
        (1, [20_001, 5], [[20_001], [5]]),
        (1, [20_001, 20_000, 5], [[20_001], [20_000, 5]]),
        (1, [20_002], [[20_001], [2]]),
        (1, [30_000, 15_000, 9], [[20_001], [10_000, 15_000], [9]]),
        (1, [1, 1], [[1, 1]]),
        (1000, [1700, 300], [[1667], [34, 300]]),
        (10**6, [150], [[101], [50]]),
    ],
)
def test_pieces_have_a_bounded_size(
    monkeypatch: pytest.MonkeyPatch, components: int, sizes: list[int], told: list[list[int]]
) -> None:
    """20000 results, or 10 million numbers in the six energies of all components; a cut segment shares a result."""
    monkeypatch.setattr("modelica_like.runs.powers._together", lambda _, held, **_kind: [one.times for one in held])
    model: Any = SimpleNamespace(components=range(components))
    segments = [
        Segment(10 * k + np.linspace(0, 1, size), np.zeros((1, size)), np.zeros((0, size)), np.zeros(0))
        for k, size in enumerate(sizes)
    ]
    found: Any = list(results(model, segments))
    assert [[len(one) for one in held] for held in found] == told
    flat = [t for held in found for one in held for t in one]
    assert flat == sorted(flat)
    assert sorted({*flat}) == [t for one in segments for t in one.times]
