"""Impacts that stop motions, against bookkeeping by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from held_motions import Fake, at, held

from modelica_like.compile.functions import ROUNDING
from modelica_like.language.holding import UNLIMITED
from modelica_like.solve.initialize import holds as module
from modelica_like.solve.initialize.holds import (
    INSTANT,
    Impact,
    Strike,
)
from modelica_like.solve.initialize.point import Point


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
