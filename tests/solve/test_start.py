"""From start values to states, step by step."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from modelica_like.compile.buffers import BufferedFunction
from modelica_like.compile.compiled import StartEntry
from modelica_like.compile.start_system import StartSystem
from modelica_like.errors import ContradictingStart, InitializationError
from modelica_like.flatten.model import INITIAL_EQUATION
from modelica_like.solve.initialize import start as module
from modelica_like.solve.initialize.contradictions import _coupled
from modelica_like.solve.initialize.plan import StartPlan
from modelica_like.solve.initialize.point import Point
from modelica_like.solve.initialize.start import StartProblem, _Evaluation, _is_free_of_modes, _sizes, _solve, _Sorted

FUNCTION = ["t", "x", "y", "z", "p", "u", "d"]


def variable(path: str, **given: Any) -> Any:
    return SimpleNamespace(**{"path": path, "guess": 0.0, "description": "", **given})


ENTRIES = (
    StartEntry(0, (2, 2.0), "guess"),
    StartEntry(1, (0, -4.0), "fixed"),
    StartEntry(2, (0, 2.0), "fixed"),
    StartEntry(3, (1, 5.0), "default"),
    StartEntry(4, None, "guess"),
    StartEntry(5, None, "fixed"),
    StartEntry(6, None, "default"),
    StartEntry(7, None, "default"),
    StartEntry(8, None, "guess"),
    StartEntry(9, (1, 1.0), "fixed"),
)
"""Starts of a: states 0 to 2, with factors; of z5, z4 and others, of which z6 has a guess."""


def problem(monkeypatch: pytest.MonkeyPatch, given: list[float], point: Point, entries: Any = ENTRIES) -> StartProblem:
    names = ["a", "b", "c", "e", "z4", "z5", "z6", "z7", "f", "g"]
    table = [variable(one, guess=1.0 if one == "z6" else 0.0) for one in names]
    model: Any = SimpleNamespace(
        starts=entries, implicit=("z7", "z5", "z4", "z6"), flat_variables=table, start_values="start_values",
        once=lambda key, make: make(), differentiated=(), variables="variables",
    )  # fmt: skip

    def call(*asked: Any) -> np.ndarray:
        assert asked == (model, "start_values", point)
        return np.array(given)

    monkeypatch.setattr(module, "call", call)
    return StartProblem(model, point)


def blank() -> Point:
    return Point(2.0, np.full(3, 99.0), np.full(4, 77.0), np.array([17.0]))


GIVEN = [6.0, 8.0, -4.0, 50.0, 1.0, 2.0, 3.0, 4.0, 5.0, 7.0]


def test_start_values_of_states_and_first_guesses(monkeypatch: pytest.MonkeyPatch) -> None:
    point = blank()
    found = problem(monkeypatch, GIVEN, point)
    assert (point.x.tolist(), point.z.tolist()) == ([99.0, 99.0, 3.0], [4.0, 2.0, 1.0, 77.0])
    found.fix(point)
    assert point.x.tolist() == [-2.0, 7.0, 3.0]
    point = blank()
    found.apply(point)
    assert point.x.tolist() == [-2.0, 7.0, 99.0]
    point = blank()
    found = problem(monkeypatch, GIVEN[:9], point, ENTRIES[:9])
    found.apply(point)
    assert point.x.tolist() == [-2.0, 10.0, 3.0]
    sorts = _Sorted(found.model)
    assert (sorts.again, sorts.factors) == ([(2, 1)], {1: -4.0, 2: 2.0})


@pytest.mark.parametrize(("first", "second", "same"), [
    (-12.0, 6.0 + 7.9e-8, True), (-12.0, 6.0 - 7.9e-8, True), (-12.0, 6.0 + 8.1e-8, False),
    (-12.0, 6.0 - 8.1e-8, False), (12.0, -6.0 + 7.9e-8, True), (12.0, -6.0 + 8.1e-8, False),
    (0.0, 1.9e-8, True), (0.0, 2.1e-8, False),
])  # fmt: skip
def test_two_start_values_of_one_state_agree(
    monkeypatch: pytest.MonkeyPatch, first: float, second: float, same: bool
) -> None:
    """They are -4 and 2 times the state: 3 and 3, within 1e-8 (1 + 3)."""
    given = [6.0, first, second, *GIVEN[3:]]
    if same:
        problem(monkeypatch, given, blank())
    else:
        with pytest.raises(ContradictingStart, match=f"^b = {first:g} and c = {second:g} contradict each other"):
            problem(monkeypatch, given, blank())


# -- Newton's method --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1, 4])
def test_linear_equations_dense_and_sparse(size: int) -> None:
    r = np.random.default_rng(size)
    matrix, right = r.normal(size=(size, size)), r.normal(size=size)
    for one in (matrix, ca.DM(matrix)):
        np.testing.assert_allclose(_solve(one, right), np.linalg.solve(matrix, right))
        np.testing.assert_allclose(_sizes(one, right), np.abs(matrix) @ np.abs(right))
    matrix[:] = 0
    for one in (matrix, ca.DM(matrix), ca.sparsify(ca.DM(matrix))):
        found = _solve(one, right)
        assert (found.shape, np.isfinite(found).any()) == ((size,), False)


@pytest.mark.parametrize("dense", [True, False])
def test_rows_and_columns_of_a_plan(monkeypatch: pytest.MonkeyPatch, dense: bool) -> None:
    t, x, y, z, p, u, d = symbols = [ca.SX.sym(name) for name in FUNCTION]
    values = ca.densify(ca.vertcat(x * y, ca.SX(1, 1), t * z - p, u + y * y))
    function = ca.Function("start", symbols, [y, ca.jacobian(values, ca.vertcat(x, y, z)), values])
    plan = StartPlan("rest", StartSystem(function, ()), (), columns=(2, 1), wanted=(2, 0))
    model: Any = SimpleNamespace(fast=lambda _, make, results: BufferedFunction(make(), results))
    monkeypatch.setattr(module, "_DENSE", 2 if dense else 1)
    matrix, found = _Evaluation(model, plan)(2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0)
    assert isinstance(matrix, np.ndarray) == dense
    assert np.array(ca.DM(matrix).full()).tolist() == [[2.0, 0.0], [0.0, 3.0]]
    assert found.tolist() == [3.0, 15.0]


def test_what_modes_have_no_part_in() -> None:
    t, x, y, z, p, u, d = symbols = [ca.SX.sym(name) for name in FUNCTION]
    for value, free in ((x * y + t, True), (x * d, False)):
        results = [y * d, ca.jacobian(value, x), value]
        function = ca.Function("start", symbols, results, FUNCTION, ["variables", "jacobian", "values"])
        plan = StartPlan("rest", StartSystem(function, ()), ())
        model: Any = SimpleNamespace(once=lambda _, make: make())
        assert _is_free_of_modes(model, plan) == free


class Newton:
    """Newton's method with given errors of two equations, by x[1] and z[0]; x[2] is zero at rest, y is one unknown."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, errors: Any, size: float = 1.0, target: Any = (0, 0)) -> None:
        self.seen: list[Any] = []
        y = ca.SX.sym("y")
        function = ca.Function("start", [y], [y])
        self.model: Any = SimpleNamespace(states=("a", "b", "c"), p=[3.0], u=[5.0])
        plan = StartPlan("rest", StartSystem(function, ()), (), (1, 0), (), (), (2,), (1, 4), (0, 8, 7))
        self.point = Point(2.0, np.array([10.0, 20.0, 30.0]), np.array([40.0]), np.array([17.0]))
        matrix = size * np.array([[1.0, 0.0], [0.0, -1.0]])

        def evaluation(*given: Any) -> Any:
            assert given == (self.model, plan)

            def values(t: float, x: Any, y: Any, z: Any, p: Any, u: Any, d: Any) -> Any:
                assert (t, *p, *u, *d) == (2.0, 3.0, 5.0, 17.0)
                self.seen.append([*x, *y, *z])
                return matrix, np.array(target) + size * np.array(errors[min(len(self.seen), len(errors)) - 1])

            return values

        found = StartProblem.__new__(StartProblem)
        found.model, found.given = self.model, np.array(target)
        monkeypatch.setattr(StartPlan, "targets", lambda _, given: given)
        monkeypatch.setattr(module, "_Evaluation", evaluation)
        monkeypatch.setattr(found, "_not_found", lambda *given: InitializationError(str(given == (plan, self.point))))
        found._solve(plan, self.point)


def test_newton_moves_the_unknowns_of_the_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    newton = Newton(monkeypatch, [(4.0, 8.0), (1.0, -2.0), (0.0, 0.0)], 1.0, (100.0, -200.0))
    assert newton.seen == [[10, 20, 0, 0, 40], [10, 16, 0, 0, 48], [10, 15, 0, 0, 46]]
    assert (newton.point.x.tolist(), newton.point.z.tolist()) == ([10.0, 15.0, 0.0], [46.0])


@pytest.mark.parametrize(
    ("last", "more"),
    [
        ((1.6e-12, 0.0), False),  # 1e-13 of 1 + 16
        ((-1.6e-12, 0.0), False),
        ((1.8e-12, 0.0), True),
        ((-1.8e-12, 0.0), True),
        ((0.0, 4.8e-12), False),  # of 1 + 48
        ((0.0, -5.0e-12), True),
    ],
)
def test_newton_ends_when_a_step_is_rounding(monkeypatch: pytest.MonkeyPatch, last: Any, more: bool) -> None:
    newton = Newton(monkeypatch, [(4.0, 8.0), last, (1e-20, 0.0), (9.0, 9.0)])
    assert len(newton.seen) == 2 + more


@pytest.mark.parametrize(
    ("last", "more"),
    [((3.5e-15, 0.0), False), ((-3.5e-15, 1e-14), False), ((3.6e-15, 0.0), True), ((0, -1.1e-14), True)],
)  # fmt: skip
@pytest.mark.parametrize("size", [1.0, 1e6])
def test_newton_ends_when_errors_are_rounding_of_their_terms(
    monkeypatch: pytest.MonkeyPatch, last: Any, more: bool, size: float
) -> None:
    """The terms have the sizes 16 and 48 of the unknowns; what is left then is not subtracted."""
    eps = np.finfo(float).eps
    assert (16 * eps, 48 * eps) == pytest.approx((3.553e-15, 1.066e-14), rel=1e-3)
    newton = Newton(monkeypatch, [(4.0, 8.0), last, (9.0, 9.0)], size)
    assert len(newton.seen) == 2
    assert (newton.point.x[1] == 16.0 and newton.point.z[0] == 48.0) == (not more)


@pytest.mark.parametrize(
    ("error", "found"),
    [
        ((1.6e-7, 0.0), True), ((-1.6e-7, 0.0), True), ((1.8e-7, 0.0), False), ((-1.8e-7, 0.0), False),
        ((np.nan, 0.0), False), ((-np.inf, 0.0), False),
    ],
)  # fmt: skip
def test_what_is_left_after_fifty_steps_is_an_error(monkeypatch: pytest.MonkeyPatch, error: Any, found: bool) -> None:
    """A hundred-millionth of one and of the size of the terms, 16, is met."""
    errors = [(4.0, 8.0), *[(1.0, 1.0), (-1.0, -1.0)] * 24, error]
    if found:
        assert len(Newton(monkeypatch, errors).seen) == 50
    else:
        with pytest.raises(InitializationError, match="True"):
            Newton(monkeypatch, errors)


# -- what is told -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rows", "resting", "what"),
    [
        ((1,), (), "b has the requested value"),
        ((1, 0), (), "b, a have the requested value"),
        ((), (2,), "c is at rest"),
        ((), (3, 2, 10), "e, c are at rest"),
        ((1,), (2, 3), "b has the requested value and c, e are at rest"),
        ((), (), "the equations are met"),
        ((0, 1, 2, 3, 4, 5, 6), (), "a, b, c, e, z4, z5 have the requested value"),
    ],
)
def test_no_start_is_told(monkeypatch: pytest.MonkeyPatch, rows: Any, resting: Any, what: str) -> None:
    point, told = blank(), []
    found = problem(monkeypatch, GIVEN, point)
    monkeypatch.setattr(module, "solve_implicit", lambda *given: told.append(("solve", *given)))
    monkeypatch.setattr(module, "check_singular", lambda *given: told.append(("check", *given)))
    plan: Any = SimpleNamespace(rows=rows, resting=resting)
    assert found._not_found(plan, point).what == f"No start was found at which {what}."
    assert told == [("solve", found.model, point), ("check", found.model, point)]


@pytest.mark.parametrize(
    ("actual", "given", "fine"),
    [
        (3 + 3.9e-8, 3.0, True), (3 - 3.9e-8, 3.0, True), (3 + 4.1e-8, 3.0, False), (3 - 4.1e-8, 3.0, False),
        (-3 + 3.9e-8, -3.0, True), (-3 + 4.1e-8, -3.0, False), (0.9e-8, 0.0, True), (1.1e-8, 0.0, False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("equation", [False, True])
def test_a_start_value_that_others_determine_agrees(
    monkeypatch: pytest.MonkeyPatch, actual: float, given: float, fine: bool, equation: bool
) -> None:
    """Of z5: it depends on the states that a and b depend on, of which b has a fixed start, and not on those of g."""
    t, x, z, p, u, d = symbols = [ca.SX.sym(name, 3 if name == "x" else 1) for name in "txzpud"]
    table = [x[0], x[0] + x[1], x[2], 0, 0, x[1], x[1], 0, 0, x[2]]
    variables = ca.Function("variables", symbols, [ca.vertcat(*table)], [*"txzpud"], ["v"])
    point = blank()
    found = problem(monkeypatch, [*GIVEN[:5], given, *GIVEN[6:]], point)
    found.model.variables = variables
    z5: Any = found.model.flat_variables[5]
    z5.description = f"{INITIAL_EQUATION} x = y" if equation else "speed"

    def call(*asked: Any) -> np.ndarray:
        assert asked == (found.model, variables, point)
        return np.array([1.0, 8.5, 3.0, 4.0, 5.0, actual, 7.0, 8.0, 9.0, 10.0])

    monkeypatch.setattr(module, "call", call)
    if fine:
        found._check_dependent(point, 5)
        return
    with pytest.raises(ContradictingStart) as caught:
        found._check_dependent(point, 5)
    told = f"{INITIAL_EQUATION} x = y" if equation else f"z5 = {given:g}"
    would = "left minus right of the last one" if equation else "z5"
    assert caught.value.what == f"b = 8.5 and {told} contradict each other: {would} would be {actual:g}."
    coupled = [k for k in range(10) if _coupled(found.model, ENTRIES[5], StartEntry(k, None, "fixed"))]
    assert coupled == [1, 5, 6]
    found.model.starts = (*ENTRIES[:6], StartEntry(6, None, "fixed"), StartEntry(5, None, "fixed"))
    with pytest.raises(ContradictingStart, match=r"^b = 8\.5 and z6 = 7 and "):  # two of three are enough
        found._check_dependent(point, 5)
    found.model.starts = ENTRIES[3:7]
    found.given = found.given[3:]
    with pytest.raises(ContradictingStart, match=r" cannot be met: (left minus right|z5) would be"):
        found._check_dependent(point, 2)


# -- when it is solved ------------------------------------------------------------------------------------------------


def test_what_no_mode_changes_is_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    point, told = blank(), []
    found = problem(monkeypatch, GIVEN, point)
    plans = [SimpleNamespace(columns=(1,), dependent=(5, 4)), SimpleNamespace(columns=(), dependent=())]
    chosen, free = [0], [True]

    def plan(*given: Any) -> Any:
        assert given == (found.model, "rest", point)
        assert point.x.tolist() == [-2.0, 7.0, 3.0]
        return plans[chosen[0]]

    def solve(*given: Any) -> None:
        assert given == (plans[0], point)
        told.append("solve")

    monkeypatch.setattr(module, "start_plan", plan)
    monkeypatch.setattr(module, "_is_free_of_modes", lambda *given: free[0] and given == (found.model, plans[0]))
    monkeypatch.setattr(
        module, "solve_implicit", lambda *given: told.append("z" if given == (found.model, point) else "?")
    )
    monkeypatch.setattr(found, "_solve", solve)
    monkeypatch.setattr(found, "_check_dependent", lambda at, k: told.append(k if at is point else "?"))
    found.solve(point, "rest")
    found.solve(point, "rest")
    assert told == ["solve", "z", 5, 4, "z", 5, 4]
    told.clear()
    free[0] = False
    found.solve(point, "rest")
    chosen[0] = 1
    found.solve(point, "rest")
    assert told == ["solve", "z", 5, 4, "z"]
