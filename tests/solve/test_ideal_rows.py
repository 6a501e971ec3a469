"""Equations of ideal elements that are replaced, and what states then meet; against ranks."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from ideal_networks import circuit, network

from components import (
    ConstantVoltage,
    IdealDiode,
    IdealSwitch,
    Inductor,
    Pulse,
    Resistor,
)
from modelica_like import build
from modelica_like.native.start import initialize
from modelica_like.solve.initialize import Point, call, solve_implicit
from modelica_like.solve.initialize import ideal as module
from modelica_like.solve.initialize.ideal import _dependences, replace_dependent
from modelica_like.structure.ideal import HEAD, IdealElement, IdealNetwork


def test_dependences_are_found_in_the_order_of_rows_whatever_their_units() -> None:
    """A row depends on earlier ones if it does not raise their rank; its combination with them vanishes."""
    r = np.random.default_rng(1)
    for _ in range(100):
        size = int(r.integers(1, 8))
        rank = int(r.integers(0, size + 1))
        plain = r.integers(-3, 4, (size, rank)) @ r.integers(-3, 4, (rank, size))
        plain[r.random(size) < 0.1] = 0
        rows, columns = 10.0 ** r.integers(-12, 13, size), 10.0 ** r.integers(-1, 2, size)
        order = r.permutation(size).tolist()
        ranks = [0, *(int(np.linalg.matrix_rank(plain[order[: k + 1]])) for k in range(size))]
        wanted = [row for k, row in enumerate(order) if ranks[k + 1] == ranks[k]]
        matrix = rows[:, None] * plain * columns
        found = _dependences(matrix, order, np.abs(matrix).max(axis=1))
        assert [row for row, _ in found] == wanted
        for row, weights in found:
            assert weights[row] == pytest.approx(1.0)
            assert set(np.flatnonzero(weights)) <= set(order[: order.index(row) + 1])
            weighted = weights * rows / rows[row]
            np.testing.assert_allclose(weighted @ plain, 0, atol=1e-9 * np.abs(weighted).max())


def test_what_is_small_beside_the_size_of_a_row_is_rounding() -> None:
    for small in (1e-11, -1e-11):  # columns, too, have units of their own
        matrix = np.array([[1.0, 0.0], [1.0, small]])
        assert not _dependences(matrix, [0, 1], np.array([1.0, 1.0]))
        assert not _dependences(matrix, [0, 1], np.array([1.0, 1e3]))
    matrix = np.array([[1.0, 1.0], [1.0, 1.001]])
    assert not _dependences(matrix, [0, 1], np.array([1.0, 0.9e6]))
    ((row, weights),) = _dependences(matrix, [0, 1], np.array([1.0, 1.1e6]))
    assert (row, weights.tolist()) == (1, pytest.approx([-1.0, 1.0]))
    ((_, weights),) = _dependences(np.array([[1.0, 0.0], [1e-10, 0.0]]), [0, 1], np.array([1.0, 1.0]))
    assert weights.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("seed", [3, 48, 100, 248, 7, 11])
def test_dependent_equations_are_replaced_by_as_many_others(seed: int) -> None:
    """In random modes and states of a random network."""
    r, model = np.random.default_rng(seed), build(network(seed))
    ideal, start = model.ideal, initialize(model)
    assert ideal is not None
    for turn in range(20):
        point = start.copy()
        point.t = float(r.uniform(0, 0.05))
        point.x[:] = r.normal(size=len(point.x)) * 10.0 ** r.integers(-3, 3) if turn % 3 else 0.0
        point.z[:] = r.normal(size=len(point.z))
        modes = [one.mode for one in ideal.elements]
        point.d[modes] = r.integers(0, 2, len(modes))
        replace_dependent(model, point)
        rows = point.d[ideal.entries].reshape(-1, ideal.width).copy()
        replaced, derivative = rows[:, 0] == 1, (rows[:, 0] == 1) & (rows[:, HEAD - 1] == 0)
        assert set(rows[:, [0, HEAD - 1]].ravel()) <= {0.0, 1.0}

        def matrix(chosen: Any, rows: np.ndarray = rows, point: Point = point) -> np.ndarray:
            point.d[ideal.entries] = np.where(chosen[:, None], rows * (np.arange(ideal.width) != 1), 0.0).ravel()
            return model.alg_jacobian(point.t, point.x, point.z, model.p, model.u, point.d).full()

        def rank(full: np.ndarray) -> int:
            for axis in (1, 0):
                sizes = np.abs(full).max(axis=axis, keepdims=True)
                full = full / np.where(sizes > 0, sizes, 1)
            return int(np.linalg.matrix_rank(full, 1e-10))

        own = matrix(np.zeros(len(rows), bool))
        assert replaced.sum() == len(own) - rank(own)
        left = call(model, model.alg, Point(point.t, point.x, np.zeros(len(point.z)), point.d))
        assert (replaced & ~derivative).sum() == len(own) - rank(matrix(derivative))
        assert rank(matrix(replaced)) == len(own)
        for k in np.flatnonzero(replaced):
            weights, one = rows[k, HEAD:], ideal.elements[k]
            np.testing.assert_allclose(weights @ own, 0, atol=1e-9 * (np.abs(weights) @ np.abs(own)).max())
            if derivative[k]:
                assert weights[one.row] == pytest.approx(1.0)
        solve_implicit(model, point)
        values = np.abs(call(model, model.variables, point))
        largest = {unit: max(values[k] for k, one in enumerate(model.flat_variables) if one.unit == unit)
                   for unit in {one.unit for one in model.flat_variables}}  # fmt: skip
        for k, one in enumerate(ideal.elements):
            node = one.zeros[int(point.d[one.mode])]
            scale = max(model.flat_variables[node].nominal, largest[model.flat_variables[node].unit])
            missed = derivative[k] and values[node] > 1e-9 * scale
            assert rows[k, 1] == (pytest.approx(1e12 * rows[k, HEAD:] @ left, rel=1e-6) if missed else 0.0)


def elements(*rows: int) -> tuple[Any, IdealNetwork]:
    """A model with ideal elements in the given rows of five equations; d begins with their modes."""
    parts = tuple(IdealElement(f"e{k}", k, (10 + k, 20 + k), row) for k, row in enumerate(rows))
    ideal = IdealNetwork(parts, len(rows), HEAD + 5)
    return SimpleNamespace(ideal=ideal, implicit=(*"vwxyz",), variables=SimpleNamespace()), ideal


def test_rows_are_looked_at_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """First as they are, then with the derivatives in place of the dependent ones."""
    model, ideal = elements(4, 1, 3)
    point = Point(0.0, np.zeros(0), np.zeros(5), np.zeros(3 + 3 * ideal.width))
    first, second = np.diag([1.0, -2.0, 3.0, -4.0, 5.0]), np.diag([1.0, -20.0, 3.0, 400.0, 500.0])
    one, other, more = np.array([0.5, -1e3, 0, 1, 0]), np.array([0, 0, 2.0, 0, 1]), np.array([0, 7.0, 0, 3, 1])
    seen: list[tuple[list[int], list[float]]] = []
    jacobians, founds = iter([first, second]), iter([[(3, one), (4, other)], [(1, one), (4, more)]])

    def dependences(matrix: np.ndarray, order: list[int], sizes: np.ndarray) -> Any:
        seen.append((order, sizes.tolist()))
        if len(seen) == 2:  # the first answer stands in d
            table = point.d[ideal.entries].reshape(3, -1)
            assert table.tolist() == [[1, 0, 0, *other], [0] * 8, [1, 0, 0, *one]]
        return next(founds)

    monkeypatch.setattr(module, "_jacobian", lambda *given: next(jacobians) if given == (model, point) else None)
    monkeypatch.setattr(module, "_dependences", dependences)
    rows = np.zeros((3, ideal.width))
    module._write(model, point, ideal, rows)
    assert seen == [
        ([0, 2, 4, 1, 3], [1.0, 2.0, 3.0, 4.0, 5.0]),
        ([0, 2, 1, 3, 4], [1.0, 20.0, 3.0, pytest.approx(1e3 * 1e3 * 2), pytest.approx(1e3 * 6)]),
    ]
    assert rows.tolist() == [[1, 0, 1, *(3 * one + other)], [0] * 8, [1, 0, 0, *one]]
    assert point.d[ideal.entries].tolist() == rows.ravel().tolist()


@pytest.mark.parametrize("found", [[], [(0, np.ones(5))], [(4, np.ones(5)), (0, np.ones(5))]])
def test_equations_of_other_elements_are_not_replaced(monkeypatch: pytest.MonkeyPatch, found: Any) -> None:
    model, ideal = elements(4, 1, 3)
    point = Point(0.0, np.zeros(0), np.zeros(5), np.zeros(3 + 3 * ideal.width))
    asked: list[int] = []
    monkeypatch.setattr(module, "_jacobian", lambda *_: asked.append(1) or np.eye(5))
    monkeypatch.setattr(module, "_dependences", lambda *_: found)
    replace_dependent(model, point)
    assert not point.d.any()
    assert len(asked) == 1


@pytest.mark.parametrize("missed", [True, False])
def test_impulses_are_those_of_the_solution(monkeypatch: pytest.MonkeyPatch, missed: bool) -> None:
    """What is left of the equations of e1, 2 * 3 + 5 * (-7), acts if the variable is not zero once z is found."""
    model, ideal = elements(0, 1)
    model.flat_variables, model.alg = [SimpleNamespace(unit="V", nominal=1.0)] * 30, SimpleNamespace()
    point = Point(0.0, np.zeros(0), np.zeros(5), np.array([0.0, 1.0, *[9.0] * (2 * ideal.width)]))
    table = np.zeros((2, ideal.width))
    table[1, [0, HEAD, HEAD + 1]] = 1.0, 2.0, 5.0

    def write(owner: Any, at: Point, network: IdealNetwork, rows: np.ndarray) -> None:
        assert (owner, at, network) == (model, point, ideal)
        assert not point.d[ideal.entries].any()
        rows[:] = table
        point.d[ideal.entries] = table.ravel()

    def solve(owner: Any, trial: Point) -> None:
        assert owner is model
        assert trial.d.tolist() == point.d.tolist()
        trial.z = np.ones(5)

    def call(owner: Any, function: Any, trial: Point) -> np.ndarray:
        assert owner is model
        assert not trial.d[ideal.entries].any()
        if function is model.alg:
            return np.array([3.0, -7.0, 1e9, 1e9, 1e9])
        assert function is model.variables
        values = np.full(30, -4.0)
        values[21] = 0.0 if trial.z.all() != missed else -2.0
        return values

    for name, one in (("_write", write), ("solve_implicit", solve), ("call", call)):
        monkeypatch.setattr(module, name, one)
    replace_dependent(model, point)
    table[1, 1] = -29e12 if missed else 0.0
    assert point.d[ideal.entries].tolist() == table.ravel().tolist()
    assert not point.z.any()


@pytest.mark.parametrize(("i", "kept"), [(1.01e-3, True), (0.99e-3, False)])
def test_a_current_that_is_rounding_of_another_one_gets_no_impulse(i: float, kept: bool) -> None:
    """24 V over 24 µΩ are 1e6 A; the choke's current has no path."""
    connect = {
        "x": ["S.n", "D.n", "L.p"], "in": ["U.p", "S.p", "M.p"], "l": ["L.n", "R.p"], "g": ["gate.y", "S.closed"],
        "minus": ["U.n", "D.p", "R.n", "M.n", "earth.p"],
    }  # fmt: skip
    parts = {"S": IdealSwitch(), "D": IdealDiode(), "L": Inductor(L=1e-3, i=i), "R": Resistor(R=5.0)}
    more = {"U": ConstantVoltage(V=24.0), "M": Resistor(R=24e-6), "gate": Pulse(period=1.0, start_time=0.5)}
    model = build(circuit(connect, **parts, **more))
    point, ideal = initialize(model), model.ideal
    assert ideal is not None
    point.d[[one.mode for one in ideal.elements]] = 0.0
    replace_dependent(model, point)
    (row,) = [one for one in point.d[ideal.entries].reshape(-1, ideal.width) if one[0]]
    assert bool(row[1]) == kept
