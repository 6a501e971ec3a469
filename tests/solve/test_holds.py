"""Held motions: how elements share reactions, and impacts; against least squares and bookkeeping by hand."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import null_space

from modelica_like.compile.compiled import Circuit
from modelica_like.compile.functions import ROUNDING
from modelica_like.initialize import holds as module
from modelica_like.initialize.holds import (
    INSTANT,
    Impact,
    Strike,
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
from modelica_like.initialize.point import Point
from modelica_like.language.holding import UNLIMITED


class Fake:
    """Stands for the functions of a model, whose values at a point are given; tells how often they are called."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **values: Any) -> None:
        self.calls: list[str] = []
        self.model: Any = SimpleNamespace(**{name: name for name in values})

        def call(model: Any, function: str, point: Any) -> Any:
            assert model is self.model
            self.calls.append(function)
            return np.array(values[function](point), float)

        monkeypatch.setattr(module, "call", call)


def at(*d: float, x: tuple[float, ...] = ()) -> Point:
    return Point(2.0, np.array(x, float), np.zeros(0), np.array(d, float))


def held(k: int, **given: Any) -> Any:
    """Motion k: variable 10 + k, reaction 20 + k, mode k, which holds it with number 1 and lets it go with 2."""
    known = {"component": f"c{k}", "mode": k, "number": 1, "loose": 2, "motion": 10 + k, "reaction": 20 + k}
    return SimpleNamespace(**{**known, "approach": 30 + k, "state": None, **given})


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


# -- sharing ----------------------------------------------------------------------------------------------------------


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


# -- impacts ----------------------------------------------------------------------------------------------------------


def strike(model: Any, point: Any, entering: Any = (), loose: Any = (), kind: type[Strike] = Strike) -> Any:
    """A strike as it is before it has begun."""
    one = kind.__new__(kind)
    one.model, one.point, one.entering, one.loose, one.impacts = model, point, set(entering), list(loose), []
    return one


def variables_in_units(motions: list[float], nominal: float = 1.0) -> Any:
    """Variables 10 … are the motions; variable 0, in their unit, is 1e3 times the nominal value; 1 has another unit."""
    units = ["rad/s", "N.m"] + ["s"] * 8 + ["rad/s"] * len(motions)
    table = [SimpleNamespace(unit=one, nominal=nominal) for one in units]
    return table, [-1e3 * nominal, 1e9 * nominal, *[0.0] * 8, *motions]


@pytest.mark.parametrize("resting", [False, True])
@pytest.mark.parametrize(
    ("motions", "limits", "hard"),
    [
        ([1.0, 9.0], [(UNLIMITED, 5.0), (5.0, 5.0)], True),
        ([-1.0, 9.0], [(0.0, UNLIMITED), (5.0, 5.0)], True),
        ([1.0, 9.0], [(0.0, UNLIMITED / 2), (5.0, 5.0)], False),
        ([0.0, 9.0], [(UNLIMITED, 5.0), (5.0, 5.0)], False),
        ([1e3 * ROUNDING * 1.01, 9.0], [(UNLIMITED, 5.0), (5.0, 5.0)], True),
        ([-1e3 * ROUNDING * 1.01, 9.0], [(UNLIMITED, 5.0), (5.0, 5.0)], True),
        ([1e3 * ROUNDING * 0.99, 9.0], [(UNLIMITED, 5.0), (5.0, 5.0)], False),
        ([-1e3 * ROUNDING * 0.99, 9.0], [(UNLIMITED, 5.0), (5.0, 5.0)], False),
        ([0.0, 1.0], [(UNLIMITED, 5.0), (5.0, UNLIMITED)], True),
        ([1e-9, 1.0], [(UNLIMITED, 5.0), (5.0, UNLIMITED)], True),
    ],
)
@pytest.mark.parametrize("nominal", [1.0, 1e-4])
def test_hard_is_what_unlimited_reactions_stop_beyond_rounding(
    monkeypatch: pytest.MonkeyPatch, motions: Any, limits: Any, hard: bool, resting: bool, nominal: float
) -> None:
    """The largest speed is a thousand times the nominal one; what does not enter does not count."""
    table, values = variables_in_units([*(one * nominal for one in motions), 500.0 * nominal], nominal)
    rows = [[1.0, *one, 0.5] for one in [*limits, (UNLIMITED, UNLIMITED)]]
    fake = Fake(monkeypatch, variables=lambda _: values, hold_terms=lambda _: np.ravel(rows))
    fake.model.holds, fake.model.flat_variables = [held(k) for k in range(3)], table
    found = Strike(fake.model, at(), [0, 1], **({"resting": True} if resting else {}))
    assert (found.hard, found._rebound) == (hard, 1.0 if hard and not resting else 0.0)
    assert (found.entering, found.loose, found.knocked, found.impacts) == ({0, 1}, [], [], [])


class Rounds(Strike):
    """Rounds of an impact with given verdicts on what is unbearable and what approaches again."""

    def __init__(self, verdicts: list[tuple[list[int], list[int]]]) -> None:
        self.verdicts, self.asked, self.told, self.hard, self._rebound = verdicts, [], [], True, 0.5

    def _motions(self) -> Any:
        return np.array([2.0, 0.0, -3.0, 7.0])

    def _response(self, approaches: dict[int, float]) -> Any:
        self.asked.append((dict(approaches), list(self.loose)))
        return np.array([float(len(self.asked))]), {0: 4.0}, {0: 6.0}

    def _unbearable(self, limits: Any, impulses: Any, reactions: Any) -> list[int]:
        assert (limits.tolist(), impulses, reactions) == ([[2.0, 3.0]] * 4, {0: 4.0}, {0: 6.0})
        return self.verdicts[len(self.asked) - 1][0]

    def _approaching(self, limits: Any, jump: Any) -> list[int]:
        assert (limits.tolist(), jump.tolist()) == ([[2.0, 3.0]] * 4, [float(len(self.asked))])
        return self.verdicts[len(self.asked) - 1][1]

    def _stop(self, before: Any, restitution: Any) -> None:
        assert before.tolist() == [2.0, 0.0, -3.0, 7.0]
        assert restitution.tolist() == [0.5 * self._rebound, 0.2 * self._rebound, 0.0, 0.4 * self._rebound]
        self.told.append(f"stop at {self.point.x[0]:g}")

    def _book(self, before: Any, impulses: Any, approaches: Any) -> None:
        assert (before.tolist(), impulses, approaches) == ([2.0, 0.0, -3.0, 7.0], {0: 4.0}, self.asked[-1][0])
        self.told.append("book")


def run(monkeypatch: pytest.MonkeyPatch, verdicts: Any, **given: Any) -> Rounds:
    rows = [[1.0, 2.0, 3.0, one] for one in (0.5, 0.2, 0.0, 0.4)]
    fake = Fake(monkeypatch, hold_terms=lambda _: np.ravel(rows))
    fake.model.holds = [held(k) for k in range(4)]
    found = strike(fake.model, at(x=(100.0,)), [2, 0, 1], kind=Rounds)
    Rounds.__init__(found, verdicts)
    found.__dict__.update(given)

    def solve(*given: Any) -> None:
        assert given == (fake.model, found.point)
        found.told.append("solve")

    monkeypatch.setattr(module, "solve_implicit", solve)
    found.run()
    return found


def test_what_breaks_away_in_an_impact_may_be_hit_again(monkeypatch: pytest.MonkeyPatch) -> None:
    found = run(monkeypatch, [([0], [2]), ([], [0]), ([2], []), ([], [])])
    first, last = -1.25 * 2.0 / INSTANT, 3.0 / INSTANT
    assert found.asked == [
        ({0: pytest.approx(first), 2: last}, []), ({2: last}, [0]), ({0: pytest.approx(first), 2: last}, []),
        ({0: pytest.approx(first)}, [2]),
    ]  # fmt: skip
    assert found.loose == found.knocked == [2]
    assert found.told == ["stop at 104", "solve", "book"]


def test_an_impact_ends_after_fifty_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    found = run(monkeypatch, [([0], []), ([], [0])] * 40)
    assert (len(found.asked), found.told) == (50, ["stop at 150", "solve", "book"])


def test_what_is_not_hard_is_not_booked_and_breaks_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    found = run(monkeypatch, [([0], [])] * 9, hard=False, _rebound=0.0)
    assert found.asked == [({0: -2.0 / INSTANT, 2: 3.0 / INSTANT}, [])]
    assert found.told == ["stop at 101", "solve"]


def test_response_to_an_impact_is_what_differs_from_finite_forces(monkeypatch: pytest.MonkeyPatch) -> None:
    """c3 is loose, c2 has no reaction, c1 does not enter; variable 0 is the reaction of c0."""
    fake = Fake(
        monkeypatch,
        ode=lambda trial: [1.0 + 10 * trial.z[0] + trial.z[1], 2.0 - trial.z[1]],
        variables=lambda trial: [5.0 + 3 * trial.z[0], *[0.0] * 20, 4.0 - trial.z[0] - trial.z[3]],
    )
    fake.model.holds = [held(0, reaction=0), held(1), held(2, reaction=-1), held(3)]
    point, told = at(*[1.0] * 4, *[0.0] * 26, 0.0, 9e9, 8e9, 7e9, x=(3.0, 4.0)), []

    def sharing(model: Any, trial: Point) -> None:
        assert model is fake.model
        told.append(trial.d[:4].tolist())

    def solve(model: Any, trial: Point) -> None:
        assert model is fake.model
        trial.z = np.array([*trial.d[[30, 32]], 0.0, 1e-3])

    monkeypatch.setattr(module, "share", sharing)
    monkeypatch.setattr(module, "solve_implicit", solve)
    monkeypatch.setattr(module, "holding", lambda model, trial: [0, 1, 2, 3] if trial.d[3] == 2 else [])
    found = strike(fake.model, point, [0, 2], [3])
    jump, impulses, reactions = found._response({0: 2.0, 2: -1.0})
    assert told == [[1.0, 1.0, 1.0, 2.0]]
    assert jump == pytest.approx(INSTANT * np.array([19.0, 1.0]), abs=0)
    assert impulses == pytest.approx({0: 6.0 * INSTANT, 1: -2.0 * INSTANT}, abs=0)
    assert reactions == pytest.approx({0: 5.0, 1: 3.999})
    assert [one.d[[30, 32]].tolist() for one in found.trials] == [[0.0, 0.0], [2.0, -1.0]]
    assert point.d[:4].tolist() == [1.0] * 4
    assert point.x.tolist() == [3.0, 4.0]


@pytest.mark.parametrize("speed", [1.0, 1e-12])
def test_losses_of_an_impact_and_what_moves_on(monkeypatch: pytest.MonkeyPatch, speed: float) -> None:
    """Half of the sum of the speeds before and after, times the impulse; felt is a billionth of the largest change."""
    before = speed * np.array([2.0, -3.0, 4.0, 0.5, 1.0, 6.0, 1.0, 0.0])
    change = speed * np.array([-2.0, 4.0, -4.0, 0.0, 3.9e-9, -6.0, 6.1e-9, 0.0])
    model: Any = SimpleNamespace(holds=[held(k) for k in range(8)])
    found = strike(model, at(), loose=[5, 7])
    found.trials, found._motions = (at(), at()), lambda: before + change

    def holds(*given: Any) -> list[int]:
        assert given == (model, found.point)
        return [0, 1, 3, 5]

    monkeypatch.setattr(module, "holding", holds)
    found._book(before, {0: 3.0, 1: 5.0, 3: 0.0, 2: 7.0, 4: 11.0}, {0: 1.0, 1: 1.0, 2: 1.0, 3: 1.0})
    losses = [(one.component, one.energy, one.time) for one in found.impacts]
    energies = [("c0", 3.0 * speed, 2.0), ("c1", -5.0 * speed, 2.0), ("c2", 14.0 * speed, 2.0)]
    assert losses == [(name, pytest.approx(energy), time) for name, energy, time in energies]
    assert [one.trials for one in found.impacts] == [found.trials, None, None]
    # c0 rests, c1 bounces, c2 rests but no mode holds it, c3 moves as before, c4 and c7 feel nothing.
    assert found.loose == [5, 7, 1, 3, 2, 6]
    assert found.impacts[0] == Impact(2.0, "c0", 3.0 * speed)  # trials are no part of what is told
    assert "trials" not in repr(found.impacts[0])


def test_where_an_impact_changes_nothing_all_stays_held(monkeypatch: pytest.MonkeyPatch) -> None:
    found = strike(SimpleNamespace(holds=[held(0), held(1)]), at(), loose=[1])
    found._motions = lambda: np.array([0.0, 3.0])
    monkeypatch.setattr(module, "holding", lambda *_: [])
    found._book(np.array([0.0, 3.0]), {}, {})
    assert (found.loose, found.impacts) == ([1], [])


def test_what_cannot_be_knocked_loose_does_not_keep_the_others() -> None:
    found = strike(SimpleNamespace(holds=[held(0), held(1, loose=-1), held(2)]), at())
    finite = np.full((3, 2), 5.0)
    assert found._unbearable(finite, {1: 3.0, 2: -3.0, 0: 3.0}, dict.fromkeys(range(3), 0.0)) == [2, 0]


@pytest.mark.parametrize(
    ("motion", "limits", "entering", "again"),
    [
        (1.0, (UNLIMITED, 0.0), [0, 1], True),
        (-1.0, (UNLIMITED, 0.0), [0, 1], False),
        (-1.0, (0.0, UNLIMITED), [0, 1], True),
        (1.0, (0.0, UNLIMITED), [0, 1], False),
        (1.0, (UNLIMITED / 2, 0.0), [0, 1], False),
        (1.0, (UNLIMITED, 0.0), [1], False),
        (-1.01 * ROUNDING, (0.0, UNLIMITED), [0], True),
        (-0.99 * ROUNDING, (0.0, UNLIMITED), [0], False),
        (0.99 * ROUNDING, (UNLIMITED, UNLIMITED), [0], False),
    ],
)
@pytest.mark.parametrize("nominal", [1.0, 1e3])
def test_what_would_move_against_a_stop_is_hit_again(
    monkeypatch: pytest.MonkeyPatch, motion: float, limits: Any, entering: Any, again: bool, nominal: float
) -> None:
    table, values = variables_in_units([0.0, 5.0], nominal)

    def variables(point: Point) -> Any:
        return [*values[:10], *point.x]

    fake = Fake(monkeypatch, variables=variables)
    fake.model.holds, fake.model.flat_variables = [held(0), held(1)], table
    found = strike(fake.model, at(x=(7.0 * nominal, 0.0)), entering, [1, 0])
    jump = np.array([(motion - 7.0) * nominal, 0.0])
    if abs(motion) < 0.5:
        found.point.x[:], jump[:] = -jump * 0, [motion * nominal, 0.0]
    both = np.array([limits, (UNLIMITED, UNLIMITED)])
    assert found._approaching(both, jump) == [0] * again
    found.loose = []
    fake.calls.clear()
    assert found._approaching(both, jump) == []
    assert not fake.calls


def test_held_states_have_exactly_their_speeds_after_an_impact() -> None:
    """The motion of c0 is -2 times state 1, that of c2 half of state 0; c1 is loose, c3 no state, c4 does not enter."""
    states = [(1, -2.0), (2, 1.0), (0, 0.5), None, (3, 1.0)]
    model: Any = SimpleNamespace(holds=[held(k, state=one) for k, one in enumerate(states)])
    found = strike(model, at(x=(9.0, 9.0, 9.0, 9.0)), [0, 1, 2, 3], [1])
    found._stop(np.array([3.0, 5.0, 7.0, 1.0, 1.0]), np.array([0.1, 0.2, 0.3, 0.4, 0.5]))
    assert found.point.x == pytest.approx([-0.3 * 7 / 0.5, -0.1 * 3 / -2.0, 9.0, 9.0])
