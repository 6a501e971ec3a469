"""Integrals of powers, part by part: exact polynomials, plain loops, integrators that are told what to do."""

import math
from collections.abc import Sequence
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from modelica_like.errors import StepFailed
from modelica_like.options import Options
from modelica_like.runs import powers
from modelica_like.runs.powers import _BESIDE, Powers, Results, _mixing, _moving, _together
from modelica_like.solve.idas import Grid
from modelica_like.solve.initialize import Point
from modelica_like.solve.recorder import Segment


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(17)


def bare(**parts: Any) -> Powers:
    """Powers of which only the parts are there that a test needs."""
    made = Powers.__new__(Powers)
    vars(made).update({"_dense": None, "_left": 100, **parts})
    return made


def piece(times: Sequence[float], terms: Any = None, shaken: Any = None) -> Results:
    count = len(times)
    x, z, d = 10.0 + np.arange(2 * count).reshape(2, -1), 50.0 + np.arange(count)[None], 90.0 + np.zeros((1, count))
    first, last = np.zeros(count, int), np.full(count, count - 1)
    nothing = np.zeros((6, 1, count))
    return Results(np.array(times), x, z, d, first, last, nothing if terms is None else terms, shaken)


def test_results_of_several_pieces_with_their_energies() -> None:
    """At the first, the middle and the last result, all unknowns are also changed in their last digits."""
    sizes, seen = [3, 1, 5], list[Any]()
    count = sum(sizes)
    segments = [
        Segment(100.0 * k + 1.0 + np.arange(n), np.full((2, n), 2.0 + k) + np.arange(n), np.full((2, n), -3.0 - k),
                np.array([1.0 + k, 7.0]))
        for k, n in enumerate(sizes)
    ]  # fmt: skip

    def energies(t: Any, x: Any, z: Any, p: Any, u: Any, d: Any) -> list[Any]:
        seen.append(np.concatenate([t[None], x, z, d]))
        assert (p, u) == ("p", "u")
        return [np.concatenate([(k + 1) * (t + x[:1] * z[:1] + d[:1]) for k in range(12)])]

    model: Any = SimpleNamespace(components=["a", "b"], p="p", u="u", along=lambda *_: energies)
    found = _together(model, segments, stored=False)
    t, x, z = (np.concatenate([getattr(one, name) for one in segments], axis=-1) for name in ("times", "x", "z"))
    d = np.concatenate([np.tile(one.d[:, None], n) for one, n in zip(segments, sizes, strict=True)], axis=1)
    for mine, theirs in ((found.times, t), (found.x, x), (found.z, z), (found.d, d)):
        np.testing.assert_array_equal(mine, theirs)
    assert found.first.tolist() == [0, 0, 0, 3, 4, 4, 4, 4, 4]
    assert found.last.tolist() == [2, 2, 2, 3, 8, 8, 8, 8, 8]
    terms = (1.0 + np.arange(12).reshape(6, 2, 1)) * (t + x[0] * z[0] + d[0])
    np.testing.assert_allclose(found.terms, terms, rtol=1e-14)
    (all_,) = seen
    assert all_.shape == (7, count + 3)
    whole = np.concatenate([t[None], x, z, d])
    np.testing.assert_array_equal(all_[:, :count], whole)
    changed = all_[:, count:] / whole[:, [0, 4, 8]] - 1.0
    assert ((np.abs(changed) > 2e-16) == np.array([0, 1, 1, 1, 1, 0, 0])[:, None]).all()
    assert np.sign(changed[1:5]).tolist() == [[-1, 1, -1], [1, -1, 1], [-1, 1, -1], [1, -1, 1]]
    assert np.abs(changed).max() < 9e-16
    moved = (1.0 + np.arange(12).reshape(6, 2, 1)) * (all_[0] + all_[1] * all_[3] + all_[5])
    np.testing.assert_array_equal(found.shaken, np.abs(moved[..., count:] - found.terms[..., [0, 4, 8]]))
    point = found.point(5)
    assert (point.t, point.x.tolist(), point.z.tolist()) == (202.0, [5.0, 5.0], [-5.0, -5.0])
    assert point.d.tolist() == [3.0, 7.0]


@pytest.mark.parametrize(
    ("rtol", "count", "finer", "share"),
    [(1e-6, 100, 1e-7, 0.1), (1e-6, 1000, 1e-7, 0.05), (5e-12, 500, 1e-12, 0.1), (1e-13, 501, 1e-13, 50 / 501)],
)
def test_runs_between_results_are_more_precise(
    monkeypatch: pytest.MonkeyPatch, rtol: float, count: int, finer: float, share: float
) -> None:
    """Ten times as precise, but not below 1e-12; absolute tolerances go with it."""
    given: list[Any] = []
    monkeypatch.setattr(powers, "Integrator", lambda *args, **how: given.append((args, how)))
    model: Any = SimpleNamespace(components=())
    made = Powers(model, Options(rtol=rtol, atol=1e-9), count)
    (((same, options), how),) = given
    assert same is model
    assert how == {"counted": False}
    assert options.rtol == pytest.approx(finer)
    assert options.atol == pytest.approx(1e-9 * finer / rtol)
    assert made._share == pytest.approx(share)
    assert made.stored == made.cancelled == 0.0
    assert 0.0 < made.moved < 1e-14


@pytest.mark.parametrize(("intervals", "count"), [(1, 16), (4, 16), (5, 32), (8, 32), (9, 64)])
def test_four_or_more_finer_results_for_each_interval(intervals: int, count: int) -> None:
    """The next power of two, so that few instances of IDAS are needed; they lie from result to result."""
    asked: list[Any] = []

    def run(start: Point, span: float, grid: Grid) -> tuple[Any, Any]:
        number = grid.looks
        asked.append((start.t, span, number))
        return np.arange(2.0 * number).reshape(2, -1), np.arange(1.0 * number)[None]

    every = piece([3.0, 4.0, 6.0, 10.0])
    found = bare(_integrator=SimpleNamespace(run=run))._finer(every, 1, 3, intervals)
    assert asked == [(4.0, 6.0, count)]
    assert found is not None
    np.testing.assert_allclose(found.times, np.linspace(4.0, 10.0, count + 1), rtol=1e-15)
    assert found.x[:, :3].tolist() == [[11.0, 0.0, 1.0], [15.0, count, count + 1]]
    assert found.z[0, :3].tolist() == [51.0, 0.0, 1.0]
    assert found.d.tolist() == [90.0]


@pytest.mark.parametrize("end", [10.0, *np.random.default_rng(4).uniform(6.0, 10.0, 40)])
def test_finer_results_are_those_of_the_run_where_it_has_kept_them(end: float) -> None:
    """Both ends are the results: an event may stand there, behind which rounded times are."""
    every = piece([3.0, 4.0, 5.9, end])

    def at(times: Any) -> tuple[Any, Any]:
        assert times[-1] < end
        return np.stack([times, 2.0 * times]), -times[None]

    found = bare(_dense=SimpleNamespace(at=at))._finer(every, 1, 3, 2)
    assert found is not None
    times = np.linspace(4.0, end, 17)
    assert (found.times[0], found.times[-1]) == (4.0, end)
    np.testing.assert_allclose(found.x[:, 1:-1], np.stack([times, 2.0 * times])[:, 1:-1], rtol=1e-15)
    np.testing.assert_allclose(found.z[0, 1:-1], -times[1:-1], rtol=1e-15)
    for here, there in ((0, 1), (-1, 3)):
        assert found.x[:, here].tolist() == every.x[:, there].tolist()
        assert found.z[:, here].tolist() == every.z[:, there].tolist()
    assert bare(_dense=SimpleNamespace(at=at), _left=15)._finer(every, 1, 3, 2) is None


@pytest.mark.parametrize(("bad", "calls"), [([], 2), ([5], 8), ([5, 6], 10), (list(range(12)), 20)])
def test_a_stretch_that_fails_is_halved(bad: list[int], calls: int) -> None:
    """Of 0 to 7 and 8 to 11, until only the bad ones are left; after 20 failures the rest stays as it is."""
    asked: list[Any] = []

    def run(start: Point, span: float, grid: Grid) -> tuple[Any, Any]:
        number = grid.looks
        asked.append((start.t, span))
        if any(start.t <= one < start.t + span for one in bad):
            raise StepFailed("it gave up")
        return np.zeros((2, number)), np.zeros((1, number))

    integrator = SimpleNamespace(run=run, interrupts=SimpleNamespace(watched=nullcontext))
    every, ends = piece(np.arange(13.0).tolist()), np.array([np.arange(12), np.arange(1, 13)])
    again, finer = bare(_integrator=integrator)._again(every, ends, [np.arange(8), np.arange(8, 12)])
    assert len(asked) == calls
    assert np.flatnonzero(~again).tolist() == bad
    covered = sorted(t for one in finer for t in np.arange(one.times[0], one.times[-1]).tolist())
    assert covered == np.flatnonzero(again).tolist()
    nothing = bare()._again(every, ends, [])
    assert (nothing[0].any(), nothing[1]) == (False, [])


def test_what_is_stored_and_moved() -> None:
    """The largest sum of stored energies; of each power the smaller end of each interval, for its time."""
    stored = np.array([[1.0, -3.0, 2.0], [0.5, 1.0, -1.5]])
    steps = np.array([2.0, 4.0])
    assert _moving(stored, np.zeros((3, 3)), steps) == (4.0, 0.0)
    powers = np.array([[1.0, -2.0, 3.0], [1.5, 0.0, 9.0]])
    assert _moving(0.1 * stored, powers, steps) == (0.4, 1.0 * 2 + 2.0 * 4)
    # Where one of both ends is always zero, the power behind each interval has to do.
    assert _moving(stored, np.array([[9.0, 0.0, -5.0], [0.0, 7.0, 0.0]]), steps) == (4.0, 20.0)
    assert _moving(1e-6 * stored, 1e-6 * powers[:1], steps)[1] == pytest.approx(1e-6 * (1.0 * 2 + 2.0 * 4))
    assert _moving(stored[:, :1], np.ones((3, 1)), steps[:0]) == (1.5, 0.0)
    assert _moving(stored[:, :1], np.array([[0.0, -3.0, 0.0, 5.0]]), np.array([4.0, 4.0, 2.0]))[1] == 3.0 * 4 + 5.0 * 2


def test_the_largest_rounding_counts() -> None:
    """Ten changes: of energies at one result all together, of powers all of all components; the largest so far."""
    work = bare(_noise=np.array([3.0, 50.0]))
    shaken = np.zeros((6, 2, 3))
    shaken[0] = [[0.1, 0.2, 0.0], [0.3, 0.25, 0.0]]
    shaken[1:, 0, 1], shaken[5, 1, 1], shaken[3, 0, 2] = 1.0, 4.0, 8.0
    work._hear(piece([0.0, 1.0, 2.0], shaken=shaken))
    assert work._noise == pytest.approx([4.5, 90.0])
    work._hear(piece([0.0, 1.0, 2.0], shaken=0.5 * shaken))
    assert work._noise == pytest.approx([4.5, 90.0])
    assert work.cancelled == pytest.approx(0.1 * 4.5 / (10 * 4e-16))


def test_slopes_at_both_ends_make_a_rule_of_order_four() -> None:
    """And a slope at the first end makes one of order three, of any polynomials of these degrees."""
    times = np.array([1.0, 1.5, 4.0])
    ends = np.array([[0, 1], [1, 2]])
    cubic, parabola = np.poly1d([2.0, -3.0, 5.0, 1.0]), np.poly1d([-3.0, 5.0, 1.0])
    slopes: list[Any] = []

    def along(t: Any, *_: Any) -> list[Any]:
        slopes.append(t)
        return [np.array([cubic.deriv()(t), parabola.deriv()(t), 0 * t, 0 * t])]

    model = SimpleNamespace(along=lambda *_: along, p=None, u=None)
    bends = bare(model=model)._bends(piece(times.tolist()), ends)
    assert bends.shape == (2, 4, 2)
    for k, power, rules in ((0, cubic, [0]), (1, parabola, [0, 1])):
        exact = np.diff(power.integ()(times))
        for rule in rules:
            found = np.diff(times) * (_BESIDE[rule] @ power(times[ends])) + bends[rule, k]
            np.testing.assert_allclose(found, exact, rtol=1e-12)
    line = np.poly1d([2.0, 1.0])
    np.testing.assert_allclose(np.diff(times) * (_BESIDE[2] @ line(times[ends])), np.diff(line.integ()(times)))


def test_which_intervals_are_coarse(random: np.random.Generator) -> None:
    """Against plain loops over random intervals whose rules differ by random powers of ten."""
    count, components, kinds = 400, 3, list[bool]()
    cases = (1e-4, 2.0, [0.0, 0.0], 0), (1e-6, 1e-9, [3e-4, 2e-3], 90), (1e-6, 1e-9, [0.0, 2e-2], 0)
    for rtol, moved, noise, few in cases:
        terms = random.normal(size=(6, components, count + 8))
        places = np.arange(count)[:, None] + np.arange(8)
        ends = np.array([places[:, 3], places[:, 4]])
        sizes = 10.0 ** random.uniform(-8, 0, (3, count, 1)) * random.normal(size=(3, count, 8))
        weights = np.stack([np.full((count, 8), -0.05) + sizes[0], sizes[1], sizes[2]], axis=1)
        weights[:, 1] += weights[:, 0]
        weights[:, 2] += weights[:, 1]
        bent = np.sort(random.choice(count, few, replace=False))
        bends = 1e-3 * random.normal(size=(2, 4 * components, few))
        work = bare(model=SimpleNamespace(states=["x"]), options=Options(rtol=rtol), moved=moved,
                    _noise=np.array(noise), _share=0.1)  # fmt: skip
        # Stored energies change as their rates tell, but for random errors.
        integrals = np.einsum("mj,cmj->cm", weights[:, 0], terms[4][:, places])
        integrals[:, bent] += bends[0].reshape(4, components, -1)[3]
        apart = integrals + 10.0 ** random.uniform(-7, 0, count) * random.normal(size=integrals.shape)
        stored = np.zeros_like(terms[0])
        for k in range(count):
            stored[:, k + 4] = stored[:, k + 3] + apart[:, k]
        terms[0] = stored
        expected = [
            _is_coarse(work, terms, weights[k], places[k], ends[:, k], bends[:, :, bent == k].sum(axis=2))
            for k in range(count)
        ]
        assert work._coarse(terms, ends, places, weights, bent, bends, 0).tolist() == expected
        kinds += expected
    assert 100 < sum(kinds) < 1100


def _is_coarse(work: Powers, terms: Any, weights: Any, places: Any, ends: Any, bends: Any) -> bool:
    """One interval: two sums of all powers, and two of the rates of stored energies."""
    every, rates = terms[1:5].reshape(-1, terms.shape[-1]), terms[4]
    noise = work._noise[0] + work._noise[1] * abs(sum(weights[0]))
    allowed = work.options.rtol * max(work.moved, work.cancelled)
    known, smooth, steps = 0.0, 0.0, list[tuple[float, float]]()
    for sums, share in zip(_mixing(len(every)), _mixing(len(rates)), strict=True):
        best, lower, lowest = (float(sums @ every[:, places] @ row) for row in weights)
        best, lower = best + sums @ bends[0], lower + sums @ bends[1]
        steps.append((abs(best - lower), abs(lower - lowest)))
        rate, less, _ = (float(share @ rates[:, places] @ row) for row in weights)
        rate, less = rate + share @ bends[0, -len(rates) :], less + share @ bends[1, -len(rates) :]
        change = float(share @ (terms[0][:, ends[1]] - terms[0][:, ends[0]]))
        known, smooth = max(known, abs(change - rate)), max(smooth, abs(rate - less))
    gain = known / smooth if known < smooth else 1.0
    error = min(known, smooth)
    for near, far in steps:
        error = max(error, near * max(gain, near / far if near < far else 1.0))
    return error > max(work._share * allowed, noise) or known > max(3.0 * allowed, noise)


def test_without_states_the_first_results_tell_nothing() -> None:
    """Then all intervals are coarse; finer ones are looked at as ever."""
    work = bare(model=SimpleNamespace(states=[]), options=Options(), moved=1.0, _noise=np.zeros(2), _share=0.1)
    terms, ends, places = np.zeros((6, 1, 9)), np.array([[3], [4]]), np.arange(8)[None]
    rest = ends, places, np.zeros((1, 3, 8)), np.zeros(0, int), np.zeros((2, 4, 0))
    assert work._coarse(terms, *rest, 0).tolist() == [True]
    assert work._coarse(terms, *rest, 1).tolist() == [False]
    assert math.isfinite(work.cancelled)
