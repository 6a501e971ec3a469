"""Equations of ideal elements that are replaced, and what states then meet; against ranks."""

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
from modelica_like.native.holds import share
from modelica_like.native.start import initialize
from modelica_like.solve.initialize import Point, call, solve_implicit
from modelica_like.structure.ideal import HEAD


@pytest.mark.parametrize("seed", [3, 48, 100, 248, 7, 11])
def test_dependent_equations_are_replaced_by_as_many_others(seed: int) -> None:
    """In random modes and states of a random network."""
    r, model = np.random.default_rng(seed), build(network(seed))
    ideal, start = model.held.ideal, initialize(model)
    assert ideal is not None
    for turn in range(20):
        point = start.copy()
        point.t = float(r.uniform(0, 0.05))
        point.x[:] = r.normal(size=len(point.x)) * 10.0 ** r.integers(-3, 3) if turn % 3 else 0.0
        point.z[:] = r.normal(size=len(point.z))
        modes = [one.mode for one in ideal.elements]
        point.d[modes] = r.integers(0, 2, len(modes))
        share(model, point)
        rows = ideal.rows.of(point.d).copy()
        replaced, derivative = rows[:, 0] == 1, (rows[:, 0] == 1) & (rows[:, HEAD - 1] == 0)
        assert set(rows[:, [0, HEAD - 1]].ravel()) <= {0.0, 1.0}

        def matrix(chosen: Any, rows: np.ndarray = rows, point: Point = point) -> np.ndarray:
            point.d[ideal.rows.entries] = (chosen[:, None] * rows * (np.arange(ideal.rows.columns) != 1)).ravel()
            return model.equations.alg_jacobian(point.t, point.x, point.z, model.p, model.u, point.d).full()

        def rank(full: np.ndarray) -> int:
            for axis in (1, 0):
                sizes = np.abs(full).max(axis=axis, keepdims=True)
                full = full / np.where(sizes > 0, sizes, 1)
            return int(np.linalg.matrix_rank(full, 1e-10))

        own = matrix(np.zeros(len(rows), bool))
        assert replaced.sum() == len(own) - rank(own)
        left = call(model, model.equations.alg, Point(point.t, point.x, np.zeros(len(point.z)), point.d))
        assert (replaced & ~derivative).sum() == len(own) - rank(matrix(derivative))
        assert rank(matrix(replaced)) == len(own)
        for k in np.flatnonzero(replaced):
            weights, one = rows[k, HEAD:], ideal.elements[k]
            np.testing.assert_allclose(weights @ own, 0, atol=1e-9 * (np.abs(weights) @ np.abs(own)).max())
            if derivative[k]:
                assert weights[one.row] == pytest.approx(1.0)
        solve_implicit(model, point)
        values = np.abs(call(model, model.equations.variables, point))
        largest = {unit: max(values[k] for k, one in enumerate(model.flat_variables) if one.unit == unit)
                   for unit in {one.unit for one in model.flat_variables}}  # fmt: skip
        for k, one in enumerate(ideal.elements):
            node = one.zeros[int(point.d[one.mode])]
            scale = max(model.flat_variables[node].nominal, largest[model.flat_variables[node].unit])
            missed = derivative[k] and values[node] > 1e-9 * scale
            assert rows[k, 1] == (pytest.approx(1e12 * rows[k, HEAD:] @ left, rel=1e-6) if missed else 0.0)


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
    point, ideal = initialize(model), model.held.ideal
    assert ideal is not None
    point.d[[one.mode for one in ideal.elements]] = 0.0
    share(model, point)
    (row,) = [one for one in ideal.rows.of(point.d) if one[0]]
    assert bool(row[1]) == kept
