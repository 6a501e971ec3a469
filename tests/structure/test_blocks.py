"""Blocks of equations: torn to few unknowns, solved by symbols, or explicit."""

import casadi as ca
import numpy as np
import pytest

from components import Damper, Fixed, Inertia, Table
from modelica_like import build, simulate
from modelica_like.flatten import flatten
from modelica_like.language import Assembly, Component, Equations, Input, Parameter, param, signal_in, sin
from modelica_like.structure import reduce
from modelica_like.structure.blocks import BlockSolver


class Coupled(Component):
    """n nonlinear equations in a ring: x_k + a sin(x_(k+1)) = b_k."""

    n: int = 4
    a: Parameter = param("1", "coupling", default=0.5)

    def build(self) -> None:
        self.cells = [Cell(a=0.5, b=0.1 * (k + 1)) for k in range(self.n)]

    def equations(self) -> Equations:
        from modelica_like.language import connect

        for k in range(self.n):
            yield connect(self.cells[k - 1].x, self.cells[k].u)


class Cell(Component):
    a: Parameter = param("1", "coupling")
    b: Parameter = param("1", "constant")
    u: Input = signal_in("1", "neighbour")

    def equations(self) -> Equations:
        yield self.x + self.a * sin(self.u) == self.b

    from modelica_like.language import Output, signal_out

    x: Output = signal_out("1", "own")


@pytest.mark.parametrize("n", [2, 5, 12])
def test_a_nonlinear_ring_is_torn_to_one_unknown(n):
    model = build(Coupled(n=n))
    assert len(model.implicit) == 1
    run = simulate(Coupled(n=n), 1.0, points=1)
    x = np.array([run.final[f"cells[{k}].x"] for k in range(1, n + 1)])
    residual = x + 0.5 * np.sin(np.roll(x, 1)) - 0.1 * np.arange(1, n + 1)
    assert np.max(np.abs(residual)) < 1e-13


def test_small_linear_blocks_are_solved_by_symbols_large_ones_stay_implicit():
    class Full(Component):
        n: int = 3
        T: Parameter = param("s", "time", default=1.0)

        def build(self) -> None:
            self.rows = [Row(number=k, n=self.n) for k in range(self.n)]

        def equations(self) -> Equations:
            from modelica_like.language import connect

            for k in range(self.n):
                for j in range(self.n - 1):
                    yield connect(self.rows[(k + j + 1) % self.n].y, getattr(self.rows[k], f"u{j}"))

    class Row(Component):
        number: int = 0
        n: int = 3
        c: Parameter = param("1", "coefficient", default=0.25)
        u0: Input = signal_in("1", "other", default=0.0)
        u1: Input = signal_in("1", "other", default=0.0)
        u2: Input = signal_in("1", "other", default=0.0)
        u3: Input = signal_in("1", "other", default=0.0)

        def equations(self) -> Equations:
            # The coefficient of the own unknown depends on time: no equation can be solved for it before the run.
            weight = 2 + sin(self.time / self.second)
            yield weight * self.y + weight * self.c * (self.u0 + 2 * self.u1 - self.u2 + self.u3) == 1.0 + self.number

        second: Parameter = param("s", "unit", default=1.0)
        from modelica_like.language import Output, signal_out

        y: Output = signal_out("1", "own")

    for n, implicit in ((2, 0), (3, 0), (5, 5)):
        model = build(Full(n=n))
        assert len(model.implicit) <= implicit
        run = simulate(Full(n=n), 1.0, points=3)
        matrix = np.eye(n)
        for k in range(n):
            for j, c in zip(range(n - 1), (1, 2, -1, 1), strict=False):
                matrix[k, (k + j + 1) % n] += 0.25 * c
        for moment in (0, -1):
            weight = 2 + np.sin(run.time[moment])
            expected = np.linalg.solve(weight * matrix, 1.0 + np.arange(n))
            found = [run[f"rows[{k}].y"][moment] for k in range(1, n + 1)]
            assert found == pytest.approx(expected, rel=1e-12)


def test_a_damper_to_ground_and_a_table_are_explicit():
    parts = {"wave": Table(table=((0, 0), (1, 2))), "rotor": Inertia(J=1.0), "damper": Damper(d=1.0), "ground": Fixed()}
    drive = Assembly("drive", parts=parts, series={"shaft": ["rotor", "damper", "ground"]})
    reduced = reduce(flatten(drive))
    assert all(block.kind == "explicit" for block in reduced.blocks)
    assert len(reduced.states) == 2


def test_an_unknown_that_cancels_is_none():
    """The current of a loop that hangs at one node enters and leaves it; its equation cannot give the current."""
    b, c, mode, p = (ca.SX.sym(name) for name in ("b", "c", "mode", "p"))
    residual = ca.vertcat((b + c) - p - c, ca.if_else(mode == 0, c - 2 * b, c - 3 * b))
    solved = BlockSolver(residual, ca.vertcat(b, c), mode, []).run()
    assert [block.kind for block in solved.blocks] == ["explicit", "linear"]
    _, values = ca.substitute_inplace([b, c][:1], [solved.order[0][1]], [solved.order[1][1]], False)
    assert [float(ca.substitute(v, ca.vertcat(mode, p), ca.DM([k, 5.0]))) for k in (0, 1) for v in values] == [10, 15]


def test_an_unknown_in_a_condition_does_not_cancel():
    """The slope by what only decides is zero, and yet it is needed first (the turbine that is faster than its pump)."""
    a, b, p = (ca.SX.sym(name) for name in ("a", "b", "p"))
    residual = ca.vertcat(a - ca.if_else(b > 1, p, -p), b - 2 * p)
    (first, b_value), (second, a_value) = BlockSolver(residual, ca.vertcat(a, b), ca.SX(0, 1), []).run().order
    assert (first, second) == (1, 0)
    value = ca.substitute(a_value, b, b_value)
    assert [float(ca.substitute(value, p, ca.DM(k))) for k in (0.4, 0.6)] == [-0.4, 0.6]
