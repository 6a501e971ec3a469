"""Held motions that depend on each other, against all sets of rows."""

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like.structure.holds import Circuit, HeldMotion, find_circuits
from modelica_like.structure.system import Level, System


def held(motion: int, *, reaction: int = 0, rigid: bool = True) -> HeldMotion:
    return HeldMotion("clutch", 0, 1, -1, motion, reaction, 0, rigid, 0)


def circuits(motions: np.ndarray, holds: list[HeldMotion], explicit: bool = False) -> list[Circuit]:
    """Motions are sums of states; if `explicit`, of unknowns that are twice the states."""
    size = motions.shape[1]
    states, unknowns = ca.SX.sym("x", size), ca.SX.sym("y", size)
    mode = ca.SX.sym("d", 3)
    model: Any = SimpleNamespace(p=ca.SX(0, 1), parameters=[], d=mode, discretes=[], time=ca.SX.sym("t"), flags=())
    values = ca.mtimes(ca.SX(ca.DM(motions)), unknowns if explicit else states)
    levels = [Level(k, 0, f"x_{k}", 1, 1.0, 0.0) for k in range(size)]
    chains = [[k] for k in range(size)]
    made = System(model, levels, chains, [*ca.vertsplit(states)], ca.SX(0, 1), [], [], values)
    order = [(y, 2 * x) for x, y in zip(ca.vertsplit(states), ca.vertsplit(unknowns), strict=True)] if explicit else []
    return find_circuits(made, tuple(holds), order, list(range(size)))


def minimal_sets(motions: np.ndarray) -> list[set[int]]:
    """Sets of rows that depend on each other, while no smaller ones among them do; rows of zeros are left out."""
    rows = [k for k, row in enumerate(motions) if row.any()]
    found: list[set[int]] = []
    for size in range(2, len(rows) + 1):
        for one in combinations(rows, size):
            if not any(less <= {*one} for less in found) and np.linalg.matrix_rank(motions[list(one)]) < size:
                found.append({*one})
    return found


def joined(sets: list[set[int]]) -> list[list[int]]:
    groups: list[set[int]] = []
    for one in sets:
        near = [group for group in groups if group & one]
        groups = [group for group in groups if not group & one] + [one.union(*near)]
    return sorted(sorted(group) for group in groups)


@st.composite
def loops(draw: st.DrawFn) -> np.ndarray:
    """Differences of speeds, as those of clutches between shafts; also small ones, and none."""
    shafts = draw(st.integers(1, 4))
    rows: list[np.ndarray] = []
    for _ in range(draw(st.integers(2, 5))):
        ends = [draw(st.integers(-1, shafts - 1)) for _ in range(2)]
        row = np.zeros(shafts)
        for end, sign in zip(ends, (1.0, -1.0), strict=True):
            row[end] += sign if end >= 0 else 0.0
        rows.append(row * draw(st.sampled_from([1.0, -3.0, 1e-6])))
    return np.array(rows)


@given(loops(), st.booleans())
@settings(deadline=None, max_examples=80)
def test_circuits_are_the_joined_minimal_sets_of_dependent_motions(motions: np.ndarray, explicit: bool) -> None:
    found = circuits(motions, [held(k) for k in range(len(motions))], explicit)
    assert [[*one.members] for one in found] == joined(minimal_sets(motions))
    first = 3
    for one in found:
        assert one.first == first
        count = len(one.members)
        assert (one.entries.start, one.entries.stop) == (first, first + count + count**2)
        first = one.entries.stop


def test_only_rigid_motions_with_a_reaction_are_shared() -> None:
    twice = np.array([[1.0], [2.0], [1.0]])
    for other in (held(1, rigid=False), held(1, reaction=-1)):
        assert [one.members for one in circuits(twice, [held(0), other, held(2)])] == [(0, 2)]
        assert circuits(twice[:2], [held(0), other]) == []
    assert [one.members for one in circuits(twice, [held(0), held(1, reaction=0)])] == [(0, 1)]
    assert circuits(np.zeros((2, 1)), [held(0), held(1)]) == []


def test_shares_are_behind_the_switches() -> None:
    d = np.arange(100.0)
    circuit = Circuit((4, 5, 7), 10)
    assert circuit.shares.of(d).tolist() == [[13.0, 14.0, 15.0], [16.0, 17.0, 18.0], [19.0, 20.0, 21.0]]
