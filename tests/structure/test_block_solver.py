"""Blocks of random equations against linear algebra, and what is torn, by the rules in words."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like.errors import StructureError
from modelica_like.structure.blocks import SMALL, BlockSolver, Solved, cramer

MODE = ca.SX.sym("mode")
"""What changes during a run; a coefficient with it is no divisor. It is one in the numbers."""
A, B, P = (ca.SX.sym(name) for name in "abp")


def numbers(expressions: list[Any], symbols: list[Any], values: list[float]) -> list[float]:
    found = ca.Function("numbers", [ca.vertcat(*symbols)], [ca.vertcat(ca.SX(0, 1), *expressions)])(values)
    return [float(one) for one in found.full().ravel()]


def values(solved: Solved, unknowns: list[Any], given: list[Any], numbers_given: list[float]) -> list[float]:
    """All unknowns: z from its linear residuals, and the others one after the other, as they are ordered."""
    z = [unknowns[k] for k in solved.z]
    expressions = [expression for _, expression in solved.order]
    outputs = [*solved.alg, *z]
    if expressions:
        symbols = [unknowns[k] for k, _ in solved.order]
        for k, one in enumerate(expressions):
            assert not ca.depends_on(one, ca.vertcat(*symbols[k:])), "only earlier ones"
        expressions, outputs = ca.substitute_inplace(symbols, expressions, outputs, False)
    residual = ca.vertcat(ca.SX(0, 1), *outputs[: len(z)])
    function = ca.Function("all", [ca.vertcat(ca.SX(0, 1), *z), ca.vertcat(*given)],
                           [residual, ca.jacobian(residual, ca.vertcat(ca.SX(0, 1), *z)),
                            ca.vertcat(ca.SX(0, 1), *expressions)])  # fmt: skip
    at_zero, slopes, _ = function([0.0] * len(z), numbers_given)
    implicit = -np.linalg.solve(slopes.full(), at_zero.full()).ravel() if z else np.zeros(0)
    explicit = function(implicit, numbers_given)[2].full().ravel()
    found = dict(zip([*solved.z, *(k for k, _ in solved.order)], [*implicit, *explicit], strict=True))
    return [found[k] for k in range(len(unknowns))]


@st.composite
def matrices(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """A regular matrix with a pattern of its own, and which entries move."""
    size = draw(st.integers(1, 6))
    chance = np.random.default_rng(draw(st.integers(0, 2**32)))
    pattern = chance.random((size, size)) < draw(st.sampled_from([0.15, 0.3, 0.6, 1.0]))
    pattern[np.arange(size), chance.permutation(size)] = True
    matrix = np.where(pattern, chance.uniform(0.5, 2.0, (size, size)) * chance.choice([-1, 1], (size, size)), 0.0)
    matrix += 3 * np.sign(matrix) * np.eye(size)[chance.permutation(size)]
    return matrix, chance.random((size, size)) < draw(st.sampled_from([0.0, 0.5, 1.0]))


@given(matrices(), st.booleans())
@settings(deadline=None, max_examples=50)
def test_random_linear_equations_have_the_solution_of_linear_algebra(system: tuple[Any, Any], kept: bool) -> None:
    matrix, moving = system
    if np.linalg.cond(matrix) > 1e4:
        return
    size = len(matrix)
    x = [ca.SX.sym(f"x{k}") for k in range(size)]
    right = ca.SX.sym("right", size)
    weights = ca.if_else(MODE > 0, 1.0, 2.0) * ca.SX(ca.DM(matrix))
    entries = [[weights[r, c] if moving[r, c] else ca.SX(matrix[r, c]) for c in range(size)] for r in range(size)]
    rows = [sum((entries[r][c] * x[c] for c in range(size) if matrix[r, c]), -right[r]) for r in range(size)]
    solved = BlockSolver(ca.vertcat(*rows), ca.vertcat(*x), MODE, [], range(size) if kept else ()).run()
    bounds = np.random.default_rng(1).normal(size=size)
    found = values(solved, x, [MODE, right], [1.0, *bounds])
    assert found == pytest.approx(np.linalg.solve(matrix, bounds), rel=1e-9, abs=1e-9)
    assert sorted(k for one in solved.blocks for k in one.unknowns) == list(range(size))
    assert sorted(k for one in solved.blocks for k in one.equations) == list(range(size))
    for one in solved.blocks:
        small = len(one.tears) <= SMALL and not kept
        assert one.kind == ("explicit" if not one.tears else "linear" if small else "implicit")
        assert set(one.tears) <= set(one.unknowns)
        assert matrix[np.ix_(one.equations, one.unknowns)].any()
    assert [k for one in solved.blocks if one.kind == "implicit" for k in one.tears] == solved.z
    equations = {k for one in solved.blocks if one.kind == "implicit" for k in one.equations}
    assert len(solved.rows) == len(set(solved.rows)) == len(solved.z)
    assert set(solved.rows) <= equations
    # A block that depends on those before is behind them, not before.
    place = {k: number for number, one in enumerate(solved.blocks) for k in one.unknowns}
    for number, one in enumerate(solved.blocks):
        assert all(place[k] <= number for row in one.equations for k in range(size) if matrix[row, k])


@pytest.mark.parametrize("size", [1, 2, 3])
def test_cramers_rule_and_the_relative_determinant(size: int) -> None:
    """The determinant over Hadamard's bound, the product of the lengths of the rows."""
    matrix, right = ca.SX.sym("m", size, size), ca.SX.sym("r", size)
    solution, determinant = cramer(matrix, right)
    function = ca.Function("cramer", [matrix, right], [ca.vertcat(*solution), determinant])
    x = ca.SX.sym("x", size)
    solved = BlockSolver(ca.mtimes(matrix, x) - right, x, ca.vertcat(ca.vec(matrix), right), []).run()
    assert [(one.kind, one.tears) for one in solved.blocks] == [("linear", tuple(range(size)))]
    ((number, relative),) = solved.determinants
    assert number == 0
    told = ca.Function("told", [matrix, right], [relative, ca.vertcat(*(one for _, one in solved.order))])
    chance = np.random.default_rng(size)
    r = chance.normal(size=size)
    for _ in range(5):
        m = chance.normal(size=(size, size))
        exact = np.linalg.det(m)
        assert function(m, r)[0].full().ravel() == pytest.approx(np.linalg.solve(m, r), rel=1e-10)
        assert float(function(m, r)[1]) == pytest.approx(exact, rel=1e-10)
        assert float(told(m, r)[0]) == pytest.approx(exact / np.prod(np.linalg.norm(m, axis=1)), rel=1e-10)
        assert told(m, r)[1].full().ravel() == pytest.approx(np.linalg.solve(m, r), rel=1e-10)
    assert float(told(np.zeros((size, size)), r)[0]) == 0.0  # not 0 / 0


def test_the_number_of_a_block_with_a_determinant() -> None:
    x, y = A, B
    solved = BlockSolver(ca.vertcat(x - P, MODE * y - x), ca.vertcat(x, y), MODE, []).run()
    assert [(one.kind, one.unknowns, one.equations) for one in solved.blocks] == [("explicit", (0,), (0,)),
                                                                                ("linear", (1,), (1,))]  # fmt: skip
    assert [number for number, _ in solved.determinants] == [1]


def test_unknowns_that_nothing_determines_are_named() -> None:
    x = ca.SX.sym("x", 8)
    with pytest.raises(StructureError, match=r"do not determine x_0, x_1, x_2, x_3, x_4, x_5\."):
        BlockSolver(ca.sum1(x), x, MODE, []).run()


def test_an_equation_is_solved_in_the_authors_arithmetic_or_by_its_slope() -> None:
    """Undone step by step the result is that of the same steps in numbers, to the last bit."""
    c, p = 0.1, 0.7
    order = BlockSolver(ca.vertcat((A + P) * MODE - c), ca.vertcat(A), ca.SX(0, 1), []).run().order
    assert numbers([order[0][1]], [MODE, P], [3.0, p]) == [(0.0 + c) / 3.0 - p]
    assert (c - p * 3.0) / 3.0 != c / 3.0 - p
    twice = BlockSolver(ca.vertcat(A * P + A * B - MODE), ca.vertcat(A), ca.SX(0, 1), []).run()
    assert [one.kind for one in twice.blocks] == ["explicit"]
    assert numbers([twice.order[0][1]], [P, B, MODE], [2.0, 6.0, 4.0]) == [0.5]


def test_an_unknown_that_cancels_leaves_no_rounding() -> None:
    tiny = 1e-20
    residual = ca.vertcat((B + A) * P - MODE - B * P, B - P)
    order = BlockSolver(residual, ca.vertcat(A, B), ca.SX(0, 1), []).run().order
    assert sorted(k for k, _ in order) == [0, 1]
    assert numbers([dict(order)[0]], [P, MODE], [2.0, tiny]) == [tiny / 2.0]


def test_equations_that_depend_on_each_other_have_the_determinant_zero() -> None:
    solved = BlockSolver(ca.vertcat(A + B - P, A + B - MODE), ca.vertcat(A, B), MODE, []).run()
    assert [one.kind for one in solved.blocks] == ["linear"]
    assert numbers([one for _, one in solved.determinants], [P, MODE], [1.0, 2.0]) == [0.0]


@pytest.mark.parametrize(
    ("step", "decides"),
    [
        (ca.floor(A * P), True),
        (ca.ceil(P) + ca.sign(ca.sin(A)), True),
        (ca.if_else(A > P, 1, 2), True),
        (ca.if_else(P <= A, 1, 2), True),
        (ca.if_else(A == P, 1, 2), True),
        (ca.if_else(ca.logic_not(A), 1, 2), True),
        (ca.if_else(ca.logic_and(P > 1, ca.sin(A)), 1, 2), True),
        ((A + ca.floor(P)) - P - A, False),
        ((ca.exp(A) + ca.floor(ca.sin(P) + 3)) - B - ca.exp(A), False),
        (((A + P) - B - A) * ca.floor(P * B), False),
    ],
    ids=str,
)
def test_an_unknown_with_slope_zero_counts_if_it_decides(step: Any, decides: bool) -> None:
    """If it does, both equations are one block, because it depends on the other unknown."""
    x = ca.SX.sym("x")
    solved = BlockSolver(ca.vertcat(x - step, A - 2 * x), ca.vertcat(x, A), MODE, []).run()
    assert len(solved.blocks) == (1 if decides else 2)


def pattern(text: list[str], rates: list[int]) -> tuple[int, ...]:
    """Torn unknowns of one block: a row of text each equation, `s` for a safe coefficient, `m` for one that moves."""
    x = ca.SX.sym("x", len(text))
    factors = {"s": 1.0, "m": MODE, ".": 0.0}
    slopes = ca.vertcat(*(ca.horzcat(*((2.0 + r + 3 * c) * factors[one] for c, one in enumerate(line)))
                          for r, line in enumerate(text)))  # fmt: skip
    (block,) = BlockSolver(ca.mtimes(ca.sparsify(slopes), x), x, MODE, rates).run().blocks
    return block.tears


@pytest.mark.parametrize(
    ("text", "rates", "tears"),
    [
        (["ss.", ".ss", "s.s"], [], (0,)),  # of equals the first
        (["ss.", ".ss", "s.s"], [2], (2,)),  # the rate of a state that nothing holds
        (["ss.", ".sm", "s.s"], [2], (0,)),  # something does
        (["ss.", ".ss", "s.s"], [1, 2], (1,)),
        (["sss", "sss", ".ss"], [], (1,)),  # of the shortest equations
        (["s.s.", ".s.s", "sss.", ".sss"], [], (1,)),  # … the one that is most used
        (["mm", "mm"], [], (0, 1)),
        (["m..m", ".mmm", "mmm.", "mm.m"], [], (0, 1, 3, 2)),  # what waits for one unknown says nothing
        (["m..m", ".mmm", "mmm.", "mm.m"], [3], (0, 3, 1, 2)),  # … unless it is a rate
    ],
)
def test_what_is_torn(text: list[str], rates: list[int], tears: tuple[int, ...]) -> None:
    assert pattern(text, rates) == tears
