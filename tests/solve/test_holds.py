"""How elements that hold motions share reactions, against least squares."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from held_motions import Fake, at, held
from scipy.linalg import null_space

from modelica_like.compile.compiled import Circuit
from modelica_like.language.holding import UNLIMITED
from modelica_like.solve.initialize import holds as module
from modelica_like.solve.initialize.holds import (
    _may_contradict,
    _share_circuits,
    _use,
    _yield_to_contradiction,
    capacities,
    holding,
    share,
    sharing,
    terms,
)
from modelica_like.solve.initialize.point import Point


def test_held_is_what_its_mode_holds_with_a_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [[1, 5, 6, 0.1], [0, 7, 8, 0.2], [-0.5, 9, 10, 0.3]]
    fake = Fake(monkeypatch, hold_terms=lambda _: np.ravel(rows))
    fake.model.holds = [held(0), held(1), held(2)]
    assert terms(fake.model, at()).tolist() == rows
    assert capacities(fake.model, at()).tolist() == [one[1:3] for one in rows]
    assert holding(fake.model, at(1, 1, 1)) == [0, 2]
    assert holding(fake.model, at(2, 1, 1)) == [2]
    fake.calls.clear()
    assert holding(fake.model, at(2, 0, 2)) == []
    assert not fake.calls


def test_shared_reactions_are_the_least_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where w weights the squares of the reactions r, and slopes' r is given by the other equations."""
    r = np.random.default_rng(3)
    for _ in range(60):
        count, silent_member = int(r.integers(2, 7)), bool(r.integers(0, 2))
        slopes = r.integers(-2, 3, (count, int(r.integers(1, count + 1)))).astype(float)
        slopes *= 10.0 ** r.integers(-1, 2, (count, 1))
        weights = np.concatenate([[np.nan] * 2, 10.0 ** r.uniform(-2, 2, count + 1)])
        motions, model = {10 + k: slopes[k - 2] for k in range(2, 2 + count)}, SimpleNamespace()
        model: Any = SimpleNamespace(holds=[held(k) for k in range(count + 3)])
        members = r.permutation(range(2, 2 + count)).tolist() + [count + 2] * silent_member
        model.circuits = (Circuit(tuple(members), 1), Circuit((0, 1), 1 + len(members) * (1 + len(members))))
        point = at(*[9.0] * (model.circuits[1].entries.stop + 1))

        def variable_slopes(*given: Any, model: Any = model, point: Any = point, motions: Any = motions) -> np.ndarray:
            assert given[:2] == (model, point)
            return np.array([motions[one] for one in given[2]])

        monkeypatch.setattr(module, "variable_slopes", variable_slopes)
        monkeypatch.setattr(module, "_may_contradict", lambda *_: False)
        active = {0, *members[:count]}
        shared = _share_circuits(model, point, active, weights)
        assert point.d[[0, -1]].tolist() == [9.0, 9.0]
        assert not point.d[model.circuits[1].entries].any()
        size = len(members)
        switches, shares = point.d[1 : 1 + size], point.d[1 + size : 1 + size * (1 + size)].reshape(size, size)
        rank = int(np.linalg.matrix_rank(slopes))
        assert shared == (rank < count)
        assert sorted(switches) == [0.0] * (size - count + rank) + [1.0] * (count - rank)
        assert not shares[switches == 0].any()
        assert not shares[:, count:].any()
        rows, own = shares[switches == 1][:, :count], slopes[np.array(members[:count]) - 2]
        assert np.abs(rows).max(axis=1) == pytest.approx(1.0)
        assert (shares.diagonal()[switches == 1] > 0).all()
        if rank == count - 1:  # the motion that depends most on the others gives its equation away
            least_sure = np.abs(null_space(own.T)[:, 0])
            assert least_sure[np.argmax(switches)] == pytest.approx(least_sure.max())
        others = own[switches[:count] == 0]
        assert rank == (np.linalg.matrix_rank(others) if len(others) else 0)
        soft = own / weights[members[:count], None]
        least = soft @ np.linalg.pinv(own.T @ soft) @ own.T @ r.normal(size=count)
        np.testing.assert_allclose(rows @ least, 0, atol=1e-9 * max(np.abs(least)))


@pytest.mark.parametrize("prescribed", [False, True])
def test_a_motion_that_nothing_moves_has_no_reaction(monkeypatch: pytest.MonkeyPatch, prescribed: bool) -> None:
    model: Any = SimpleNamespace(holds=[held(k) for k in range(3)], circuits=(Circuit((0, 1, 2), 0),))
    monkeypatch.setattr(module, "variable_slopes", lambda *_: np.array([[2.0, 0.0], [0.0, 0.0], [2.0, 0.0]]))
    point, yields = at(*[9.0] * 12), list[Any]()
    monkeypatch.setattr(module, "_may_contradict", lambda *given: prescribed and given == (model, [0, 1, 2]))
    monkeypatch.setattr(module, "_yield_to_contradiction", lambda *given: yields.append(given))
    assert _share_circuits(model, point, {0, 1, 2}, np.array([1.0, 7.0, 4.0]))
    shares = point.d[3:].reshape(3, 3)
    assert shares[1].tolist() == [0.0, 1.0, 0.0]
    (row,) = (shares[k] for k in (0, 2) if shares[k].any())
    assert row / row[0] == pytest.approx([1.0, 0.0, -4.0])
    if prescribed:
        (given,) = yields
        assert given[:3] == (model, point, model.circuits[0])
        assert np.concatenate([given[3], given[4].ravel()]).tolist() == point.d.tolist()
    else:
        assert not yields


class Split:
    """Splits of a shared reaction with given uses of the capacities, one after the other."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, uses: list[list[float]], **given: Any) -> None:
        self.weights: list[np.ndarray] = []
        shared, members = given.get("shared", True), given.get("members", (0, 2))
        limits = np.array([[2.0, 5.0], [1.0, 1.0], [10.0, 0.0], [UNLIMITED, 1.0]])
        fake = Fake(monkeypatch, hold_terms=lambda _: np.hstack([np.ones((4, 1)), limits, np.ones((4, 1))]).ravel())
        fake.model.holds, fake.model.circuits = [held(k) for k in range(4)], (Circuit((1,), 9), Circuit(members, 9))
        self.fake, self.point, self.replaced = fake, at(*given.get("modes", (1, 0, 1, 1)), 0.0), 0

        def replace(*given: Any) -> None:
            assert given == (fake.model, self.point)
            self.replaced += 1

        def share_circuits(model: Any, point: Point, active: set[int], weights: np.ndarray) -> bool:
            assert (model, point) == (fake.model, self.point)
            assert active == {k for k in range(4) if point.d[k] == 1}
            self.weights.append(weights)
            point.d[-1] = len(self.weights)
            return shared

        def use(model: Any, point: Point, given: np.ndarray) -> np.ndarray:
            assert (model, point) == (fake.model, self.point)
            np.testing.assert_array_equal(given, limits)
            return np.array(uses[len(self.weights) - 1])

        for name, one in (("replace_dependent", replace), ("_share_circuits", share_circuits), ("_use", use)):
            monkeypatch.setattr(module, name, one)
        share(fake.model, self.point)
        assert self.replaced == 1

    @property
    def chosen(self) -> int:
        return int(self.point.d[-1])


BASE = np.array([1 / 5, 1.0, 1 / 10, 1e-4])
"""Weights of the first split: over the capacities; the unlimited one bears a thousand times the largest."""


def test_a_split_goes_on_until_all_can_bear_it(monkeypatch: pytest.MonkeyPatch) -> None:
    uses = [[2.0, 0.0, 0.5, 0.0], [1.5, 0.0, 0.7, 0.0], [0.98, 0.0, 0.9, 0.0]]
    split = Split(monkeypatch, uses)
    assert split.chosen == 3
    one = np.where([True, False, True, False], BASE * uses[0], BASE)
    two = np.where([True, False, True, False], one * uses[1], BASE)
    np.testing.assert_allclose(split.weights, [BASE, one, two])


def test_the_best_split_counts_if_none_can_be_borne(monkeypatch: pytest.MonkeyPatch) -> None:
    uses = [[3.0, 0.0, 2.0, 0.0]] * 7 + [[1.5, 0.0, 2.5, 0.0]] + [[1e3, 0.0, 1e-9, 0.0]] * 3 + [[2.5, 0, 0, 0]] * 20
    split = Split(monkeypatch, uses)
    assert (split.chosen, len(split.weights)) == (8, 20)
    assert np.max(split.weights / BASE) == pytest.approx(100.0)
    assert np.min(split.weights / BASE) == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("use", "count"),
    [([0.991, 0, 0, 0], 20), ([0.989, 0, 0, 0], 1), ([np.nan, 0, 0, 0], 1), ([np.inf, 0, 0, 0], 1), ([0] * 4, 1)],
)
def test_when_a_split_is_left_as_it_is(monkeypatch: pytest.MonkeyPatch, use: list[float], count: int) -> None:
    split = Split(monkeypatch, [use] * 20)
    assert (split.chosen, len(split.weights)) == (1, count)


def test_where_nothing_is_shared_capacities_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    for given in ({"modes": (1, 1, 0, 0)}, {"modes": (0, 0, 0, 0)}, {"members": ()}):
        alone = Split(monkeypatch, [], **given)
        assert [one.tolist() for one in alone.weights] == [[]]
        assert alone.fake.calls.count("hold_terms") == any(given.get("modes", (1,)))
    again = Split(monkeypatch, [], shared=False)
    assert (again.chosen, len(again.weights)) == (1, 1)


def test_use_of_capacities(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forward where a reaction is positive, backward where it is not; only of elements with a share."""
    limits = np.array([[4.0, 8.0], [4.0, 8.0], [0.0, 8.0], [UNLIMITED, 8.0], [4.0, 8.0], [0.5, 0.0]])
    reactions = [2.0, -2.0, 2.0, 2.0, 2.0, 0.25]
    circuits = Circuit((4, 0, 1), 40), Circuit((2, 3, 5), 52)
    point = at(*[0.0] * 64)
    point.d[circuits[0].first + 3 + np.array([4, 5])] = 1.0, -1.0
    point.d[circuits[1].first + 3 + np.arange(3)] = 0.5

    def variables(trial: Point) -> list[float]:
        assert trial.x.tolist() == [7.0]
        return [np.nan] * 20 + reactions

    fake = Fake(monkeypatch, variables=variables)
    fake.model.holds, fake.model.circuits = [held(k) for k in range(6)], circuits

    def solve(model: Any, trial: Point) -> None:
        assert model is fake.model
        assert trial is not point
        trial.x = np.array([7.0])

    monkeypatch.setattr(module, "solve_implicit", solve)
    assert _use(fake.model, point, limits).tolist() == [0.5, 0.25, 0.0, 0.0, 0.0, 0.5]
    assert not point.x.size


def test_a_motion_may_be_prescribed_by_time_inputs_and_discrete_values() -> None:
    t, x, z, p, u, d = symbols = [ca.SX.sym(name) for name in "txzpud"]
    variables = ca.Function("v", symbols, [ca.vertcat(x, x + t, u * x, p * x + d, z * p)], [*"txzpud"], ["v"])
    model: Any = SimpleNamespace(variables=variables, once=lambda _, make: make())
    model.holds = [held(k, motion=k) for k in range(5)]
    assert [_may_contradict(model, [k]) for k in range(5)] == [False, True, True, True, False]
    assert not _may_contradict(model, [0, 4])
    assert _may_contradict(model, [4, 2])


@pytest.mark.parametrize("inertia", [3.0, 1e-7, 0.0, np.inf, np.nan])
def test_reactions_rise_where_a_prescribed_motion_cannot_be_held(
    monkeypatch: pytest.MonkeyPatch, inertia: float
) -> None:
    """Sums of reactions are 1e5 times the inertia times the acceleration; the larger coefficient is one."""
    switches, shares = np.array([0.0, 1.0, 0.0, 0.0]), np.zeros((4, 4))
    shares[1] = 0.5, 1.0, 0.0, -1.0
    circuit = Circuit((0, 1, 2, 3), 40)
    fake = Fake(monkeypatch, variables=lambda trial: trial.x)
    fake.model.holds = [held(k) for k in range(4)]
    point = at(*[0.0] * 60)

    def solve(model: Any, trial: Point) -> None:
        """Of c0 and c3, which share and hold, the reactions say what inertia is felt; the others do not count."""
        assert model is fake.model
        assert trial.d[40:44].tolist() == [0.0, 1.0, 0.0, 0.0]
        assert (trial.d[44:60].reshape(4, 4) == before).all()
        asked = trial.d[30:34]
        assert asked.tolist() in ([0.0] * 4, [1.0, 0.0, 0.0, 1.0])
        trial.x = np.full(24, 1e9 * asked[0])
        trial.x[[20, 23]] = [7.0 + 0.5 * asked[0], 5.0 - (inertia if asked[0] else 0.0)]
        if inertia < 1:
            trial.x[20] = 7.0

    before = shares.copy()
    monkeypatch.setattr(module, "solve_implicit", solve)
    _yield_to_contradiction(fake.model, point, circuit, switches, shares)
    stiff = 1e5 * inertia if np.isfinite(inertia) else 0.0
    assert switches == pytest.approx([0.0, 1.0 + min(stiff, 1.0), 0.0, 0.0])
    np.testing.assert_allclose(shares, before / max(stiff, 1.0))
    assert not point.d.any()


def test_who_shares_is_told() -> None:
    model: Any = SimpleNamespace(holds=[held(k) for k in range(4)], circuits=(Circuit((3, 1, 2), 1), Circuit((0,), 13)))
    model.holds[2].component = "c3"
    d = np.zeros(15)
    d[4:13] = np.ravel([[0, 0, 0], [-0.5, 1.0, 0.0], [1.0, 0.0, -1.0]])
    assert sharing(model, at(*d)) == [("c3", "c1"), ("c3",)]
