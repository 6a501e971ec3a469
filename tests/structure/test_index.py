"""Differentiations and states against Pryce's offsets and against all choices."""

from collections.abc import Iterable
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from modelica_like.errors import Overdetermined, Source, StructureError
from modelica_like.flatten.model import Origin
from modelica_like.structure.index import Pantelides, prefer_relative_states
from modelica_like.structure.states import select_states
from modelica_like.structure.system import Level, System

ABSENT = -10_000


def system(lengths: list[int], preferences: list[int] | None = None) -> System:
    """Chains with so many levels each, one behind the other."""
    made = System(SimpleNamespace(), [], [], [], ca.SX(0, 1), [], [], ca.SX(0, 1))  # pyright: ignore[reportArgumentType]
    for chain, length in enumerate(lengths):
        made.chains.append([len(made.levels)])
        made.levels.append(Level(chain, 0, f"x{chain}", preferences[chain] if preferences else 1, 2.0 + chain, 7.0))
        made.symbols.append(ca.SX.sym(f"x{chain}"))
        for _ in range(length - 1):
            made.add_level(chain)
    return made


def test_a_level_that_is_added_is_the_derivative_of_the_last_one() -> None:
    made = system([2, 1])
    assert made.column([0, 1, 2]).numel() == 3
    assert made.add_level(0) == 3
    assert made.levels[3] == Level(0, 2, "der(der(x0))", 1, 2.0, 0.0)
    assert str(made.symbols[3]) == "der(der(x0))"
    assert made.chains == [[0, 1, 3], [2]]
    assert [made.derivative(level) for level in range(4)] == [1, 3, None, None]
    assert [str(one) for one in ca.vertsplit(made.column([3, 0]))] == ["der(der(x0))", "x0"]
    assert made.column([1]).shape == (1, 1)
    assert made.column([]).shape == (0, 1)


@st.composite
def orders(draw: st.DrawFn) -> np.ndarray:
    """Highest derivative of each unknown in each equation; some unknowns do not occur in it."""
    size = draw(st.integers(1, 5))
    chance = np.random.default_rng(draw(st.integers(0, 2**32)))
    found = np.where(chance.random((size, size)) < draw(st.sampled_from([0.3, 0.5, 0.8])),
                     chance.integers(0, 3, (size, size)), ABSENT)  # fmt: skip
    rows, columns = linear_sum_assignment(found, maximize=True)
    assume(found[rows, columns].sum() >= 0)
    return found


def offsets(highest: np.ndarray) -> tuple[list[int], list[int]]:
    """The smallest numbers of differentiations and orders of unknowns: Pryce, BIT 41 (2001) 364-394, section 3."""
    rows, columns = linear_sum_assignment(highest, maximize=True)
    counts = np.zeros(len(highest), int)
    while True:
        order = (highest + counts[:, None]).max(axis=0)
        new = order[columns] - highest[rows, columns]
        if (new == counts).all():
            return counts.tolist(), order.tolist()
        counts = new


@given(orders(), st.booleans())
@settings(deadline=None, max_examples=80)
def test_equations_are_differentiated_as_often_as_pryce_says(highest: np.ndarray, lower: bool) -> None:
    """Lower derivatives in the same equations change nothing."""
    counts, order = offsets(highest)
    made = system([int(one) + 1 for one in highest.max(axis=0)])
    incidence = [
        [made.chains[k][n] for k, one in enumerate(row) if one >= 0 for n in range(0 if lower else one, one + 1)]
        for row in highest
    ]
    assert Pantelides(made, incidence).counts == counts
    assert [len(chain) - 1 for chain in made.chains] == order


def test_an_input_gives_no_derivative() -> None:
    """x0 = u and der(x0) = x1 over u, x0, x1: x1 would need der(u), which is another input."""
    made = system([2, 2, 1])
    made.inputs = [0, 1]
    assert Pantelides(made, [[0, 2], [3, 4]]).counts == [1, 0]
    assert [len(chain) for chain in made.chains] == [2, 2, 1]


@pytest.mark.parametrize(("times", "found"), [(7, [7, 0]), (8, [8, 0]), (9, None)])
def test_more_than_eight_differentiations_are_refused(times: int, found: list[int] | None) -> None:
    made = system([times + 1, 1])
    made.origins = [Origin("here", "test", Source("file.py", 3)), Origin("there", "test", Source(""))]
    incidence = [[0], [times, times + 1]]
    if found:
        assert Pantelides(made, incidence).counts == found
    else:
        with pytest.raises(StructureError, match="more than 8 times") as caught:
            Pantelides(made, incidence)
        assert [one.file for one in caught.value.where] == ["file.py"]


AVOID, DEFAULT, PREFER = 0, 1, 2


@pytest.mark.parametrize(
    ("lengths", "preference", "relations", "expected"),
    [
        ([1, 3, 3], PREFER, [[0, 1, 2]], [3, 3, 3]),
        ([1, 3, 3], DEFAULT, [[0, 1, 2]], [1, 3, 3]),
        ([1, 3, 2], PREFER, [[0, 1, 2]], [2, 3, 2]),  # as far as the others
        ([1, 3], PREFER, [[0]], [1, 3]),
        ([2, 1, 3, 3], PREFER, [[0, 1, 2], [1, 2, 3]], [3, 1, 3, 3]),  # the second has no derivative itself
        ([2, 1, 3, 1, 3], PREFER, [[0, 1, 2], [1, 3], [3, 4]], [3, 1, 3, 1, 3]),
        ([3, 1, 1], PREFER, [[0, 1, 2]], [3, 1, 1]),
    ],
)
def test_preferred_unknowns_get_the_derivatives_that_relations_allow(
    lengths: list[int], preference: int, relations: list[list[int]], expected: list[int]
) -> None:
    """Relations name chains; only the first chain wants to be a state."""
    made = system(lengths, [preference] + [DEFAULT] * (len(lengths) - 1))
    made.linear_rows = [[made.chains[chain][0] for chain in relation] for relation in relations]
    prefer_relative_states(made)
    assert [len(chain) for chain in made.chains] == expected


def test_relations_of_derivatives_and_inputs_give_no_derivatives() -> None:
    made = system([1, 3, 3], [PREFER, DEFAULT, DEFAULT])
    made.linear_rows = [[0, 1, 4]]
    made.inputs = [1]
    prefer_relative_states(made)
    assert len(made.chains[0]) == 1
    made.inputs = []
    made.linear_rows = [[0, 2, 4], [0, 5, 1]]
    prefer_relative_states(made)
    assert len(made.chains[0]) == 1


def test_a_chain_is_preferred_if_one_of_its_levels_is() -> None:
    made = system([2, 3], [DEFAULT, DEFAULT])
    made.levels[1].preference = PREFER
    made.linear_rows = [[0, 2]]
    prefer_relative_states(made)
    assert [len(chain) for chain in made.chains] == [3, 3]


@st.composite
def constraints(draw: st.DrawFn) -> tuple[list[list[int]], list[int], np.ndarray, list[int], list[int]]:
    """Preferences of all levels, numbers of differentiations, slopes of full rank, levels that are read or own."""
    size = draw(st.integers(1, 5))
    count = draw(st.integers(0, size))
    chance = np.random.default_rng(draw(st.integers(0, 2**32)))
    slopes = np.where(chance.random((count, size)) < 0.6, chance.normal(size=(count, size)), 0.0)
    assume(not count or np.linalg.matrix_rank(slopes) == count)
    preferences = chance.integers(0, 4, (size, 3)).tolist()
    read, own = (np.flatnonzero(chance.random(3 * size) < 0.4).tolist() for _ in range(2))
    return preferences, chance.integers(1, 3, count).tolist(), slopes, read, own


def first_basis(slopes: np.ndarray, columns: list[int]) -> list[int]:
    """The first columns in their order that are a basis."""
    bases = (one for one in combinations(columns, len(slopes)) if abs(np.linalg.det(slopes[:, one])) > 1e-12)
    return list(next(bases))


@given(constraints())
@settings(deadline=None, max_examples=60)
def test_states_are_what_the_first_regular_choice_of_the_least_wanted_leaves(given_: Any) -> None:
    """Of relative motions, one whose position is read has a state, then one in longer ones; of others one of its own.

    Of others with an own name, the speed of a relative position in a constraint of three or more is a state, one from
    the ground is none. Of equals, the first one that is declared is a state.

    A position may be a state though its speed is none, if that leaves states that are wanted more.
    """
    preferences, counts, slopes, read, own_levels = given_
    size, highest = len(preferences), 3
    made = system([highest] * size)
    for chain, own in zip(made.chains, preferences, strict=True):
        for level, preference in zip(chain, own, strict=True):
            made.levels[level].preference = preference
            made.levels[level].own = level in own_levels
    rows = [{k: float(one) for k, one in enumerate(row) if one} for row in slopes]
    second = slopes[[k for k, count in enumerate(counts) if count == 2]]

    def ranked(chains: Iterable[int], order: int, remaining: np.ndarray) -> list[int]:
        def rank(chain: int) -> tuple[int, ...]:
            length = min((int(np.count_nonzero(row)) for row in remaining if row[chain]), default=0)
            wanted, named = preferences[chain][order], made.levels[made.chains[chain][order]].own
            if wanted >= PREFER:
                return wanted, made.chains[chain][0] in read, length, -chain
            if preferences[chain][0] < PREFER:
                return wanted, named, 0, 0, -chain
            return wanted, named, *((1, length) if length > 2 else (-1, length)), -chain

        return sorted(chains, key=rank)

    once = first_basis(slopes, ranked(range(size), 1, slopes)) if counts else []
    nested, free = (first_basis(second, ranked(some, 0, second)) if len(second) else [] for some in (once, range(size)))
    twice = min(nested, free, key=lambda chosen: sum(preferences[k][0] for k in chosen))
    dummies = {*(made.chains[k][1] for k in once), *(made.chains[k][0] for k in twice)}
    expected = [level for k in range(size) for level in made.chains[k][:-1] if level not in dummies]
    assert select_states(made, [*counts, 0], [*rows, {}], [*([] for _ in counts), read]) == expected


def test_unknowns_without_derivatives_and_inputs_are_no_states() -> None:
    made = system([2, 2, 1, 2])
    made.inputs = [2]
    slopes = [{1: 1.0, 3: 0.5, 0: 0.0}]
    assert select_states(made, [1], slopes, [[]]) == [0]


def test_constraints_that_follow_from_others_are_told() -> None:
    """By the path of their component, or by their kind."""
    made = system([2, 2])
    made.model = SimpleNamespace(components={}, linear=[])  # pyright: ignore[reportAttributeAccessIssue]
    made.origins = [Origin(path, "Gear", Source("")) for path in ("train.gear", "", "")]
    slopes = [{0: 1.0, 1: 2.0}, {0: -2.0, 1: -4.0}, {0: 0.5, 1: 1.0}]
    with pytest.raises(Overdetermined, match=r"the constraint of train\.gear, Gear follows from others"):
        select_states(made, [1, 1, 1], slopes, [[]] * 3)
