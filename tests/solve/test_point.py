"""Newton's method for the implicit equations, step by step, and what counts as singular."""

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from fakes import fake_model

from modelica_like.compile.buffers import BufferedFunction
from modelica_like.errors import InitializationError, SingularAtStart
from modelica_like.solve.initialize import point as module
from modelica_like.solve.initialize.point import (
    Point,
    call,
    check_singular,
    implicit_at,
    is_linear,
    newton_at,
    solve_implicit,
)

NAMES = "t", "x", "z", "p", "u", "d"


class Checked(Exception):
    """Whether the Jacobian is regular was looked at once more."""


def at(*z: float) -> Point:
    return Point(0.5, np.array([2.0]), np.array(z), np.array([7.0]))


def solved(z: list[float], steps: Iterable[list[float]], condition: float = 1.0) -> tuple[list[float], int]:
    """Let Newton's method go given ways from z; return where it ends, and the number of steps it took."""
    path, taken, point = iter(steps), [0], at(*z)

    def newton(t: float, x: Any, z: Any, p: Any, u: Any, d: Any) -> Any:
        assert (t, *x, *p, *u, *d) == (0.5, 2.0, 3.0, 5.0, 7.0)
        taken[0] += 1
        return np.array(next(path)), np.array([condition])

    model: Any = SimpleNamespace(implicit=tuple("abc"[: len(z)]), fast=lambda *_: newton, p=[3.0], u=[5.0])
    solve_implicit(model, point)
    return point.z.tolist(), taken[0]


@pytest.mark.parametrize(
    ("last", "end"),
    [
        ([3 + 3.8e-13, -4.0], True),  # 1e-13 of 1 + |z|
        ([3 - 3.8e-13, -4.0], True),
        ([3 + 4.2e-13, -4.0], False),
        ([3.0, -4 + 4.7e-13], True),
        ([3.0, -4 - 5.3e-13], False),
    ],
)
def test_newton_ends_when_no_unknown_moves_beyond_rounding(last: list[float], end: bool) -> None:
    begin, path = [9.0, 9.0], [[3.0, -4.0], last, last]
    assert solved(begin, path) == (last, 2 if end else 3)
    assert solved(begin[:1], [one[:1] for one in path])[0] == last[:1]


@pytest.mark.parametrize(("last", "steps"), [(1 + 9e-9, 2), (1 - 9e-9, 2), (1 + 1.1e-8, 3)])
@pytest.mark.parametrize("large", [1e6, -1e6])
def test_a_small_unknown_has_the_rounding_of_the_largest_one(large: float, last: float, steps: int) -> None:
    assert solved([0.0, 0.0], [[large, 1.0], [large, last], [large, last]]) == ([large, last], steps)


@pytest.mark.parametrize("step", [0.9e-9, 1.1e-9])
def test_newton_may_tremble_by_a_billionth(step: float) -> None:
    path = [[0.0], [step * (-1 - step)]] * 25
    if step < 1e-9:
        assert solved([5.0], path) == ([step * (-1 - step)], 50)
    else:
        with pytest.raises(InitializationError, match=r"^The equations for a were not solved at t = 0\.5 s\."):
            solved([5.0], path)


@pytest.mark.parametrize(
    ("z", "condition", "looks"),
    [
        ([1.0, 2.0], 0.99e10, False),
        ([1.0, 2.0], 1.01e10, True),
        ([1.0, 2.0], np.nan, True),
        ([1.0, 2.0], np.inf, True),
        ([1.0, np.inf], 1.0, True),
        ([np.nan, 2.0], 1.0, True),
        ([-np.inf, 2.0], 1e11, True),
    ],
)
def test_a_step_that_may_come_from_a_singular_matrix_is_looked_at(
    monkeypatch: pytest.MonkeyPatch, z: list[float], condition: float, looks: bool
) -> None:
    def check(model: Any, point: Point) -> None:
        assert point.z.tolist() == [0.0, 0.0]
        raise Checked

    monkeypatch.setattr(module, "_check_regular", check)
    if looks:
        with pytest.raises(Checked):
            solved([0.0, 0.0], [z, z], condition)
    else:
        assert solved([0.0, 0.0], [z, z], condition) == (z, 2)


def equations(residual: Any, symbols: list[Any], **more: Any) -> Any:
    """A model with given residuals of its implicit unknowns."""
    z = symbols[2]
    functions = {
        "alg": ca.Function("alg", symbols, [residual], [*NAMES], ["alg"]),
        "alg_jacobian": ca.Function("slopes", symbols, [ca.jacobian(residual, z)], [*NAMES], ["slopes"]),
    }
    numbers = {"p": np.array([3.0]), "u": np.array([5.0]), "implicit": tuple("abcdefgh"[: z.numel()])}
    fast = lambda _, make: BufferedFunction(make())  # noqa: E731
    cache = {"fast": fast, "once": lambda _, make: make(), "arguments": dict(zip(NAMES, symbols, strict=True))}
    return fake_model(**functions, **numbers, **cache, **more)


def symbols(size: int) -> list[Any]:
    return [ca.SX.sym(name, size if name == "z" else 1) for name in NAMES]


@pytest.mark.parametrize("size", range(1, 7))
def test_a_step_is_that_of_the_inverse(size: int) -> None:
    """And few unknowns take no solver: it is written out."""
    r, given = np.random.default_rng(size), symbols(size)
    matrix, z = r.normal(size=(size, size)) - 5 * np.eye(size), given[2]
    residual = ca.mtimes(ca.DM(matrix), z + 0.1 * z**2) - given[1] * given[3] + ca.sparsify(ca.DM.eye(size)[:, 0])
    point, model = at(*r.normal(size=size)), equations(residual, given)
    slopes = matrix * (1 + 0.2 * point.z)
    value = matrix @ (point.z + 0.1 * point.z**2) - 6 + np.eye(size)[0]
    arguments = point.t, point.x, point.z, model.p, model.u, point.d
    for look in (True, False):
        function = newton_at(model, look=look)
        new, condition = (np.array(one).ravel() for one in function(*arguments))
        np.testing.assert_allclose(new, point.z - np.linalg.solve(slopes, value), rtol=1e-11)
        wanted = size * np.abs(slopes).max() * np.abs(np.linalg.inv(slopes)).max()
        assert condition == pytest.approx([wanted if look else 0.0])
        assert function.is_a("SXFunction" if size <= 3 else "MXFunction")
    found = [np.array(one).ravel(order="F") for one in implicit_at(model)(*arguments)]
    np.testing.assert_allclose(found[0], value)
    np.testing.assert_allclose(found[1], slopes.ravel(order="F"))
    solve_implicit(model, point)
    np.testing.assert_allclose(matrix @ (point.z + 0.1 * point.z**2) + np.eye(size)[0], 6, rtol=1e-12)


def test_linear_is_what_one_step_solves() -> None:
    t, x, z, p, u, d = given = symbols(2)
    assert is_linear(equations(ca.vertcat(x * z[0] + z[1], p**2 * z[1] - t * u * d), given))
    assert not is_linear(equations(ca.vertcat(x * z[0] + z[1], z[0] * z[1]), given))


@pytest.mark.parametrize(
    ("slope", "value", "error"),
    [(1.0, 0.0, False), (0.0, 0.0, True), (np.nan, 0.0, True), (1.0, np.inf, True), (1e-13, 1e-13, False)],
)
def test_what_is_looked_at_is_the_matrix_in_any_units(
    monkeypatch: pytest.MonkeyPatch, slope: float, value: float, error: bool
) -> None:
    """The second of two equations has a given slope and value."""
    _, x, z, p, *_ = given = symbols(2)
    model = equations(ca.vertcat(z[0] - 1, x * z[1] - p), given)
    model.p, point = np.array([value]), at(0.0, 0.0)
    point.x[:] = slope

    def singular(*given: Any) -> SingularAtStart:
        assert given == (model, point)
        return SingularAtStart("singular")

    monkeypatch.setattr(module, "implicit_singular", singular)
    if error:
        with pytest.raises(SingularAtStart):
            solve_implicit(model, point)
    else:
        solve_implicit(model, point)
        assert point.z == pytest.approx([1.0, value / slope])


def test_a_solution_of_equations_that_are_nearly_the_same_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    _, x, z, *_ = given = symbols(2)
    model = equations(ca.vertcat(z[0] + z[1] - 1, z[0] + (1 + x) * z[1] - 1), given)
    monkeypatch.setattr(module, "implicit_singular", lambda *_: SingularAtStart("singular"))
    for slope in (1e-9, 4 * np.finfo(float).eps):
        point = at(0.0, 0.0)
        point.x[:] = slope
        if slope == 1e-9:
            solve_implicit(model, point)
            assert point.z == pytest.approx([1.0, 0.0])
        else:
            with pytest.raises(SingularAtStart):
                solve_implicit(model, point)


FINE = [1.0, -1.0, 1.1e-12, -1.1e-12, 1e30]


@pytest.mark.parametrize("place", range(5))
@pytest.mark.parametrize("number", [0.0, 0.9e-12, -0.9e-12, np.inf, -np.inf, np.nan])
def test_a_block_is_singular_if_its_determinant_vanishes(
    monkeypatch: pytest.MonkeyPatch, place: int, number: float
) -> None:
    def block(*given: Any) -> SingularAtStart:
        assert given[:2] == (model, point)
        return SingularAtStart(f"block {given[2]}")

    monkeypatch.setattr(module, "singular_block", block)
    given = [ca.SX.sym("t"), ca.SX.sym("x"), *(ca.SX.sym(name, 5) for name in "zpud")]
    determinants = ca.Function("determinants", given, [given[2] + given[0]])
    rates = ca.Function("ode", given, [given[3] + 0 * given[1]])
    fast = lambda _, make: BufferedFunction(make())  # noqa: E731
    model: Any = fake_model(determinants=determinants, ode=rates, fast=fast, u=np.zeros(5), states=(*"vwxyz",))
    model.arguments = dict(zip(NAMES, given, strict=True))
    values, model.p = np.array(FINE), np.array([0.0, -5.0, 1e-300, 1e300, -1e300])
    point = Point(0.0, np.ones(1), values, np.zeros(5))
    check_singular(model, point)
    values[place] = number
    with pytest.raises(SingularAtStart, match=f"^block {place}$"):
        check_singular(model, point)
    values[place], model.p[place] = 1.0, number
    if abs(number) < 1:
        check_singular(model, point)
    else:
        with pytest.raises(SingularAtStart, match=rf"derivative of {'vwxyz'[place]} is not finite at t = 0 s\."):
            check_singular(model, point)


def test_functions_are_called_at_a_point() -> None:
    given = [ca.SX.sym(name) for name in NAMES]
    function = ca.Function("all", given, [ca.vertcat(*given).T])
    model: Any = SimpleNamespace(fast=lambda _, make: BufferedFunction(make()), p=[3.0], u=[5.0])
    assert call(model, function, at(11.0)).tolist() == [0.5, 2.0, 11.0, 3.0, 5.0, 7.0]
