"""Alias elimination against linear algebra."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linear_models import ORIGIN, chains, coefficients, model

from modelica_like.flatten.model import Coefficient, FlatModel, LinearEquation
from modelica_like.structure.alias import Aliases, find_aliases


@st.composite
def systems(draw: st.DrawFn) -> tuple[int, list[dict[int, float]]]:
    """Equations with one to three unknowns; some follow from others."""
    size = draw(st.integers(2, 8))
    rows: list[dict[int, float]] = []
    for _ in range(draw(st.integers(1, 10))):
        chosen = draw(
            st.lists(st.integers(0, size - 1), min_size=1, max_size=draw(st.sampled_from([1, 2, 2, 2, 3])), unique=True)
        )
        rows.append({k: draw(coefficients | st.just(0.0)) for k in chosen})
    if len(rows) > 1 and draw(st.booleans()):
        first, second = rows[0], rows[1]
        rows.append({k: first.get(k, 0.0) - 0.1 * second.get(k, 0.0) for k in {**first, **second}})
    return size, rows


def null_space(matrix: np.ndarray) -> np.ndarray:
    _, values, vectors = np.linalg.svd(matrix)
    rank = int(np.sum(values > 1e-9))
    return vectors[rank:].T


@given(systems())
@settings(deadline=None, max_examples=300)
def test_every_solution_of_the_equations_fulfils_the_aliases_and_none_is_lost(system):
    size, rows = system
    matrix = np.array([[row.get(k, 0.0) for k in range(size)] for row in rows])
    found = find_aliases(model([0] * size, rows))
    free = sorted({root for root in found.root if root not in found.known})
    # What the elimination says: x = embedding @ (free roots).
    embedding = np.zeros((size, len(free)))
    for k, (root, factor) in enumerate(zip(found.root, found.factor, strict=True)):
        if root in free:
            embedding[k, free.index(root)] = factor
    solutions = null_space(matrix)
    assert np.linalg.norm(solutions - embedding @ np.linalg.lstsq(embedding, solutions, rcond=None)[0]) < 1e-9
    left = matrix[found.remaining] @ embedding
    assert np.linalg.matrix_rank(left, tol=1e-9) == len(free) - solutions.shape[1]
    # Equations without unknowns are redundant here, as all constants are zero.
    for number, *_ in found.contradictions:
        assert np.linalg.norm(matrix[number] @ embedding) < 1e-9
    # Nothing with one or two unknowns is left over.
    assert all(np.count_nonzero(np.abs(row) > 1e-12) > 2 for row in left)


DERIVATIVES = 8


def jets(made: FlatModel, rows: list[dict[int, float]], constants: list[float]) -> tuple[np.ndarray, list[int]]:
    """All equations and their derivatives, over all derivatives and a column of ones; and the column of every node."""
    width = 3 + DERIVATIVES
    columns = [variable * width + order for variable, order in made.nodes]
    matrix = np.zeros((len(rows) * DERIVATIVES, len(made.variables) * width + 1))
    for number, (row, constant) in enumerate(zip(rows, constants, strict=True)):
        for times in range(DERIVATIVES):
            for node, value in row.items():
                matrix[number * DERIVATIVES + times, columns[node] + times] += value
        matrix[number * DERIVATIVES, -1] = constant
    return matrix, columns


def follows(relation: np.ndarray, matrix: np.ndarray) -> bool:
    """Is a relation a sum of equations?"""
    shares = np.linalg.lstsq(matrix.T, relation, rcond=None)[0]
    return bool(np.linalg.norm(matrix.T @ shares - relation) < 1e-9 * (1 + np.linalg.norm(relation)))


@given(chains())
@settings(deadline=None, max_examples=80)
def test_what_is_said_of_derivatives_follows_from_the_equations(system: tuple[FlatModel, Any, Any]) -> None:
    made, rows, constants = system
    found = find_aliases(made)
    matrix, columns = jets(made, rows, constants)
    for node, (root, factor) in enumerate(zip(found.root, found.factor, strict=True)):
        relation = np.zeros(matrix.shape[1])
        relation[columns[node]] += 1.0
        if root in found.known:
            relation[-1] = -factor * found.known[root]
        else:
            relation[columns[root]] -= factor
        assert follows(relation, matrix)
    for node, above in made.derivative.items():
        root = found.root[node]
        if root not in found.known:  # der(factor * root) is the node above
            target, times = found.derivative[root]
            assert target == found.root[above]
            assert found.factor[node] * times == pytest.approx(found.factor[above], rel=1e-12)
        else:
            assert found.known[found.root[above]] == 0.0
    assert all(found.root[node] == node and found.factor[node] == 1.0 for node in made.inputs)
    assert not found.known.keys() & {*made.inputs}
    assert_chains_are_lines(found)
    assert_nothing_simple_is_left(found, made, rows, constants)


def above(found: Aliases, root: int) -> list[int]:
    """The derivatives of a class."""
    reached = [root]
    while reached[-1] in found.derivative:
        reached.append(found.derivative[reached[-1]][0])
        assert len(reached) <= len(found.root), "a class is not its own derivative"
    return reached[1:]


def assert_chains_are_lines(found: Aliases) -> None:
    unknown = {root for root in found.root if root not in found.known}
    targets = [found.derivative[root][0] for root in unknown & found.derivative.keys()]
    assert len(targets) == len(set(targets)), "a class is the derivative of one class"
    for root in unknown:
        above(found, root)


def assert_nothing_simple_is_left(
    found: Aliases, made: FlatModel, rows: list[dict[int, float]], constants: list[float]
) -> None:
    """An equation is used, redundant, or of many unknowns, or what it says would break a chain or give an input."""
    derivatives = {found.derivative[root][0] for root in found.derivative}
    for number in found.remaining:
        terms: dict[int, float] = {}
        constant = constants[number]
        for node, value in rows[number].items():
            root = found.root[node]
            if root in found.known:
                constant += value * found.factor[node] * found.known[root]
            else:
                terms[root] = terms.get(root, 0.0) + value * found.factor[node]
        roots = [root for root, value in terms.items() if abs(value) > 1e-12]
        assert roots
        if len(roots) == 1:
            assert roots[0] in derivatives or roots[0] in made.inputs
        if len(roots) == 2 and constant == 0.0:
            own = roots[0] in above(found, roots[1]) or roots[1] in above(found, roots[0])
            assert own or {*roots} <= {*made.inputs} or {*roots} <= derivatives


@given(st.integers(2, 8), st.data())
@settings(deadline=None, max_examples=100)
def test_derivatives_of_aliases_are_aliases(size, data):
    """x_k = r_k x_0 by a random tree; then each derivative is the same multiple of that of x_0."""
    ratio = {0: 1.0}
    rows: list[dict[int, float]] = []
    for k in range(1, size):
        other = data.draw(st.integers(0, k - 1))
        factor = data.draw(coefficients)
        rows.append({k: 1.0, other: -factor})
        ratio[k] = factor * ratio[other]
    orders = [data.draw(st.integers(0, 2)) for _ in range(size)]
    made = model(orders, data.draw(st.permutations(rows)))
    found = find_aliases(made)
    assert not found.remaining
    assert not found.contradictions
    roots = [next(n for n, (v, o) in enumerate(made.nodes) if o == order) for order in range(max(orders) + 1)]
    for node, (variable, order) in enumerate(made.nodes):
        first = roots[order]
        assert found.root[node] == found.root[first]
        expected = ratio[variable] / ratio[made.nodes[first][0]]
        assert np.isclose(found.factor[node] / found.factor[first], expected, rtol=1e-12)
    assert len({found.root[node] for node in range(len(made.nodes))}) == max(orders) + 1


def test_a_constant_makes_its_derivatives_zero():
    found = find_aliases(model([2, 0], [{0: 2.0}, {0: 1.0, 1: -3.0}], [-8.0, 0.0]))  # 2 x0 = 8, x0 = 3 x1
    assert found.known[found.root[0]] * found.factor[0] == 4.0
    assert np.isclose(found.known[found.root[1]] * found.factor[1], 4.0 / 3.0)
    assert [found.known[found.root[node]] for node in (2, 3)] == [0.0, 0.0]


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_a_contradiction_is_found_and_what_gives_the_values(order):
    rows, constants = [{0: 1.0}, {1: 1.0}, {0: 1.0, 1: 1.0}], [-1.0, -1.0, 0.0]
    found = find_aliases(model([0, 0], [rows[k] for k in order], [constants[k] for k in order]))
    assert [{order[k] for k in causes} for causes in found.contradictions] == [{0, 1}]


@pytest.mark.parametrize("unit", [1e-15, 1.0, 1e9])
def test_terms_that_cancel_but_for_rounding_leave_no_unknown(unit: float) -> None:
    """0.1 + 0.2 - 0.3 is not zero in floating point: taken as a coefficient, it would make x2 = 0."""
    rows = [{0: 1.0, 1: -3.0}, {0: 0.1 * unit, 1: -0.3 * unit}, {0: 0.7 * unit, 1: -2.1 * unit}]
    found = find_aliases(model([0, 0, 0, 0], [*rows, {2: 2.0 * unit, 3: -unit}]))
    assert not found.known
    assert [one[0] for one in found.contradictions] == [1, 2]
    assert found.root[2] == found.root[3]
    assert found.factor[3] / found.factor[2] == 2.0


def test_rounding_is_measured_by_all_terms() -> None:
    """The last ones may be small."""
    equal = [{0: 1.0, k: -1.0} for k in range(1, 5)]
    found = find_aliases(model([0] * 5, [*equal, {0: 0.1, 1: 0.2, 2: -0.3, 3: 1e-5, 4: -1e-5}]))
    assert not found.known
    assert [one[0] for one in found.contradictions] == [4]


def test_a_coefficient_that_parameters_determine_may_be_zero() -> None:
    """p x0 + 2 x1 + x2 = 0 with x0 = x1 says nothing without the parameter; nor does p x0 + 2 x1 = 0."""
    made = model([0] * 3, [{0: 1.0, 1: -1.0}])
    terms = (0, Coefficient(0, 0)), (1, 2.0), (2, 1.0)
    more = [LinearEquation(terms[:count], 0.0, ORIGIN) for count in (2, 3)]
    for order in (1, -1):
        found = find_aliases(replace(made, linear=[*made.linear, *more][::order]))
        assert len(found.remaining) == 2
        assert found.root[0] == found.root[1] != found.root[2]
        assert not found.known
        assert not found.contradictions


def test_an_equation_between_two_derivatives_is_no_alias_of_one_node():
    """der(x0) = der(x1) does not make x0 = x1: the integrals differ by a constant."""
    made = model([1, 1], [{2: 1.0, 3: -1.0}])
    found = find_aliases(made)
    assert found.root[0] != found.root[1]
    assert found.remaining == [0]


@pytest.mark.parametrize("order", [1, 2])
def test_an_unknown_is_not_its_own_derivative(order):
    """der(x0) = -x0 is an equation, not an alias; nor is der(der(x0)) = -x0, nor with x1 = x0 in between."""
    made = model([order, 0], [{0: 1.0, 1: -1.0}, {1: 1.0, 1 + order: 1.0}])
    found = find_aliases(made)
    assert found.root[0] == found.root[1]
    assert found.root[1 + order] != found.root[0]
    assert found.remaining == [1]


def test_an_input_is_not_the_derivative_of_an_unknown():
    """der(x0) = u and der(x1) = -2 u stay equations: the input keeps its own sign and factor."""
    made = replace(model([1, 1, 0], [{3: 1.0, 2: -1.0}, {4: 1.0, 2: 2.0}]), inputs=[2])
    found = find_aliases(made)
    assert found.root == [0, 1, 2, 3, 4]
    assert found.remaining == [0, 1]


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("factor", [1.0, -1.0, 2.0])
def test_an_input_may_be_the_derivative_of_another_one(order, factor):
    """x0 = u1, x1 = der(x0), and x1 = factor u2, in any order: der(u1) = factor u2."""
    rows = [{0: 1.0, 2: -1.0}, {1: 1.0, 4: -1.0}, {1: 1.0, 3: -factor}]
    found = find_aliases(replace(model([1, 0, 0, 0], [rows[k] for k in order]), inputs=[2, 3]))
    assert found.root[0] == 2
    if factor == 1.0:
        assert found.root[1] == found.root[4] == 3
        assert found.derivative[2] == (3, 1.0)
        assert not found.remaining
    else:
        assert found.root[4] != 3
        assert [order[k] for k in found.remaining] in ([1], [2])


def test_what_represents_a_class():
    """An input before a derivative, a derivative before what wants to be a state, of equals the first one named."""
    plain = model([0, 0], [{1: 2.0, 0: -1.0}])
    assert find_aliases(plain).root == [1, 1]
    assert find_aliases(plain).factor == [2.0, 1.0]
    wanted = replace(plain, variables=[replace(plain.variables[0], state="prefer"), plain.variables[1]])
    assert find_aliases(wanted).root == [0, 0]
    assert find_aliases(wanted).factor == [1.0, 0.5]
    assert find_aliases(replace(wanted, inputs=[1])).root == [1, 1]
    derivative = model([1, 0], [{1: 1.0, 2: -1.0}])
    derivative = replace(derivative, variables=[derivative.variables[0], replace(plain.variables[1], state="always")])
    assert find_aliases(derivative).root == [0, 2, 2]
