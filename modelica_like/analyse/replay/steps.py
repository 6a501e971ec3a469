"""One step of the replay: Radau collocation, solved and differentiated by compiled functions.

Source: E. Hairer, G. Wanner: Solving Ordinary Differential Equations II, sections IV.5 and IV.8 (RADAU5).
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.tableau import radau
from modelica_like.compile.buffers import Vector, buffered
from modelica_like.compile.compiled import CompiledDae
from modelica_like.initialize import Point

STAGES = 7
_DENSE = 60
"""Largest linear system of a step that is solved as a dense one; beyond it LAPACK would start threads."""


class StepFunctions:
    """Compiled functions of a step; kept with the model.

    The unknowns of a step are the states and implicit unknowns at all stages, W = (x1, z1, …, xs, zs).

    Args:
        model: the compiled model.
        quadratures: integrands, an SX column in the model's `arguments`; its name makes it known to the cache.
    """

    def __init__(self, model: CompiledDae, quadratures: Any, name: str, stages: int = STAGES) -> None:
        self.model = model
        self.name = name
        self.quadratures = quadratures
        self.tableau = radau(stages)
        self.nx, self.nz = len(model.states), len(model.implicit)
        self.nt = len(model.p) + len(model.u) + model.discrete_size
        self.nq = int(quadratures.numel())
        self.size = stages * (self.nx + self.nz)

    def _cached(self, key: Any, make: Any) -> Any:
        return buffered(self.model._cache, ("replay", self.name, self.tableau.nodes.size, key), make)

    @cached_property
    def _names(self) -> list[Any]:
        """MX arguments of all step functions: t, h, x, W, p, u, d."""
        model = self.model
        sizes = (1, 1, self.nx, self.size, len(model.p), len(model.u), model.discrete_size)
        return [ca.MX.sym(name, size) for name, size in zip("thxWpud", sizes, strict=True)]

    @cached_property
    def _symbols(self) -> tuple[list[Any], list[Any], list[Any]]:
        """SX arguments of a step, its stages, and the arguments of the model's functions at each stage."""
        t, h = ca.SX.sym("t"), ca.SX.sym("h")
        x, p, u, d = (ca.SX.sym(name, self.model.arguments[name].numel()) for name in "xpud")
        stages = [ca.SX.sym(f"w{k}", self.nx + self.nz) for k in range(len(self.tableau.nodes))]
        inner = [
            [t + c * h, w[: self.nx], w[self.nx :], p, u, d] for c, w in zip(self.tableau.nodes, stages, strict=True)
        ]
        return [t, h, x, ca.vertcat(*stages), p, u, d], stages, inner

    def _at_stages(self, function: ca.Function) -> list[Any]:
        """Results of a function at each stage: one, or several as a tuple."""
        return [function(*given) for given in self._symbols[2]]

    def _weighted(self, weights: Vector, values: list[Any]) -> Any:
        """Sum over the stages, times the length of the step."""
        h = self._symbols[0][1]
        return sum((h * w * one for w, one in zip(weights[1:], values[1:], strict=True)), h * weights[0] * values[0])

    @cached_property
    def _residual(self) -> ca.Function:
        """Residual of the stages; unless the stages come apart, its Jacobian by W."""
        arguments, stages, _ = self._symbols
        x = arguments[2]
        values = self._at_stages(self._equations)
        residuals: list[Any] = []
        rows: list[Any] = []
        for i, w in enumerate(stages):
            residuals += [w[: self.nx] - x - self._weighted(self.tableau.matrix[i], [one[0] for one in values])]
            residuals += [values[i][1]]
            rows += [] if self._constant else [self._row(i, arguments[1], values)]
        return ca.Function("residual", arguments, [ca.densify(ca.vertcat(*residuals)), ca.vertcat(*rows)])

    def _row(self, i: int, h: Any, values: list[Any]) -> Any:
        """Block row of the Jacobian of stage i."""
        blocks: list[Any] = []
        for j, (_, _, ode_x, ode_z, alg_x, alg_z) in enumerate(values):
            a = h * self.tableau.matrix[i, j]
            own = ca.SX.eye(self.nx) if i == j else ca.SX(self.nx, self.nx)
            implicit = [alg_x, alg_z] if i == j else [ca.SX(self.nz, self.nx), ca.SX(self.nz, self.nz)]
            blocks.append(ca.vertcat(ca.horzcat(own - a * ode_x, -a * ode_z), ca.horzcat(*implicit)))
        return ca.horzcat(*blocks)

    @cached_property
    def _sources(self) -> ca.Function:
        """Jacobians of ode and alg at the stages by (p, u, d); of the quadratures by W and by (p, u, d)."""
        values = self._at_stages(self._parameters)
        by_theta = [part for one in values for part in one[:2]]
        h, weights = self._symbols[0][1], self.tableau.weights
        by_w = ca.horzcat(*(h * b * one[2] for b, one in zip(weights, values, strict=True)))
        outputs = [ca.vertcat(*by_theta), by_w, self._weighted(weights, [one[3] for one in values])]
        return ca.Function("sources", self._symbols[0], outputs)

    @cached_property
    def _ending(self) -> ca.Function:
        """Weighted rates of the error estimate, and quadratures."""
        rates = [one[0] for one in self._at_stages(self._equations)]
        powers = self._at_stages(self._integrands)
        outputs = [self._weighted(self.tableau.estimate, rates), self._weighted(self.tableau.weights, powers)]
        return ca.Function("ending", self._symbols[0], outputs)

    @cached_property
    def _node_order(self) -> list[int]:
        """Order of (x, z) that keeps the factors of a sparse system sparse."""
        _, _, *blocks = (self._equations.sparsity_out(k) for k in range(6))
        pattern = ca.vertcat(ca.horzcat(*blocks[:2]), ca.horzcat(*blocks[2:])) + ca.Sparsity.diag(self.nx + self.nz)
        return list((pattern + pattern.T).amd())

    @cached_property
    def _order(self) -> list[int]:
        """The same order of W: all stages of an unknown together."""
        return [k * (self.nx + self.nz) + node for node in self._node_order for k in range(len(self.tableau.nodes))]

    def _function(self, name: str, *outputs: Any) -> ca.Function:
        return ca.Function(name, list(self.model.arguments.values()), list(outputs))

    @cached_property
    def _equations(self) -> ca.Function:
        """ode, alg, and their Jacobians by x and z."""
        model, given = self.model, self.model.arguments
        ode, alg = model.ode(*given.values()), model.alg(*given.values())
        by = [ca.jacobian(one, given[name]) for one in (ode, alg) for name in "xz"]
        return self._function("equations", ode, alg, *by)

    @cached_property
    def _integrands(self) -> ca.Function:
        return self._function("integrands", ca.densify(self.quadratures))

    @cached_property
    def _parameters(self) -> ca.Function:
        """Jacobians of ode and alg by (p, u, d), of the quadratures by (x, z) and (p, u, d)."""
        model, given = self.model, self.model.arguments
        theta = ca.vertcat(given["p"], given["u"], given["d"])
        by = [ca.jacobian(one(*given.values()), theta) for one in (model.ode, model.alg)]
        w = ca.vertcat(given["x"], given["z"])
        return self._function("parameters", *by, *(ca.jacobian(self.quadratures, one) for one in (w, theta)))

    @property
    def linear(self) -> bool:
        """Whether the equations are linear in x and z: then one iteration solves a step."""
        return not self._dependence[0]

    @property
    def _constant(self) -> bool:
        """Whether they are linear with coefficients that do not change during a segment."""
        return not any(self._dependence)

    @property
    def _dependence(self) -> tuple[bool, bool]:
        """Whether the Jacobians depend on x and z, and on time."""
        known = self.model._cache
        if "replay dependence" not in known:
            given = self.model.arguments
            _, _, *jacobians = self._equations(*given.values())
            entries = ca.veccat(*(one.nz[:] for one in jacobians))
            states = ca.vertcat(given["x"], given["z"])
            known["replay dependence"] = ca.depends_on(entries, states), ca.depends_on(entries, given["t"])
        return known["replay dependence"]

    def integrands(self, point: Point) -> Vector:
        """Return the integrands of the quadratures at a point."""
        fast = self._cached("integrands", lambda: self._integrands)
        return fast(point.t, point.x, point.z, self.model.p, self.model.u, point.d)[0]

    @property
    def newton(self) -> Any:
        """Function of (t, h, x, W, p, u, d): the Newton correction of W."""
        return self._cached("newton", lambda: ca.Function("newton", self._names, [self._correction()]))

    def _correction(self) -> Any:
        return self._solve_stages(-self._residual(*self._names)[0])

    @property
    def finish(self) -> Any:
        """Function of (t, h, x, W, p, u, d, z) of the beginning and the solved W: error estimate and quadratures."""
        return self._cached("finish", self._make_finish)

    def _make_finish(self) -> ca.Function:
        z = ca.MX.sym("z", self.nz)
        return ca.Function("finish", [*self._names, z], self._end(self._names[3], z))

    @property
    def whole(self) -> Any:
        """The same of any W, for linear equations: the solved W, error estimate and quadratures."""
        return self._cached("whole", self._make_whole)

    def _make_whole(self) -> ca.Function:
        z = ca.MX.sym("z", self.nz)
        W = self._names[3] + self._correction()
        return ca.Function("whole", [*self._names, z], [W, *self._end(W, z)])

    def _end(self, W: Any, z: Any) -> list[Any]:
        """Error estimate and quadratures of a step with the stages W that begins with z."""
        t, h, x, _, p, u, d = self._names
        rates, quadratures = self._ending(t, h, x, W, p, u, d)
        ode = self._equations(t, x, z, p, u, d)[0]
        matrix = self._shifted("estimate", np.array([[self.tableau.gamma]]))(t, h, x, z, p, u, d)
        right = ca.vertcat(rates + self.tableau.gamma * h * ode, ca.MX(self.nz, 1))
        return [_solve(matrix, right, self._node_order)[: self.nx], ca.densify(quadratures)]

    def _shifted(self, name: str, *blocks: Vector) -> ca.Function:
        """I ⊗ E - h B ⊗ F for each block, of the linearised equations E y' = F y at the beginning of the step."""
        arguments = self._symbols[0]
        t, h, x, _, p, u, d = arguments
        z = ca.SX.sym("z", self.nz)
        _, _, ode_x, ode_z, alg_x, alg_z = self._equations(t, x, z, p, u, d)
        own = ca.blockcat([[ca.SX.eye(self.nx), ca.SX(self.nx, self.nz)], [alg_x, alg_z]])
        rate = ca.blockcat([[ode_x, ode_z], [ca.SX(self.nz, self.nx), ca.SX(self.nz, self.nz)]])
        shifted = [ca.kron(ca.SX.eye(len(one)), own) - h * ca.kron(ca.SX(ca.DM(one)), rate) for one in blocks]
        return ca.Function(name, [t, h, x, z, p, u, d], shifted)

    def _residuals(self, values: Any, *, transposed: bool = False) -> Any:
        """What changes of ode and alg at the stages make of the residual, or the transpose of that."""
        stages, h = len(self.tableau.nodes), self._names[1]
        rows = [ca.diag(ca.DM([a] * self.nx + [b] * self.nz)) for a, b in ((1.0, 0.0), (0.0, 1.0))]
        matrix = self.tableau.matrix.T if transposed else self.tableau.matrix
        ode = ca.mtimes(ca.kron(ca.DM(matrix), ca.sparsify(rows[0])), values)
        return ca.mtimes(ca.kron(ca.DM.eye(stages), ca.sparsify(rows[1])), values) - h * ode

    def _solve_stages(self, right: Any, *, transposed: bool = False) -> Any:
        """Solve with the Jacobian of the residual by W, or its transpose.

        Where it is the same at all stages they come apart, by the eigenvalues of the tableau (Hairer, Wanner, IV.8).
        """
        if not self._constant:
            by_w = self._residual(*self._names)[1]
            return _solve(by_w.T if transposed else by_w, right, self._order)
        own = self.nx + self.nz
        basis, blocks = self.tableau.real_form
        back, there = (np.linalg.inv(basis).T, basis.T) if transposed else (basis, np.linalg.inv(basis))
        mixed = ca.mtimes(ca.kron(ca.DM(there), ca.DM.eye(own)), ca.densify(right))
        t, h, x, _, p, u, d = self._names
        shifted = self._shifted("shifted", *blocks)(t, h, x, ca.MX(self.nz, 1), p, u, d)
        solved, begin = [], 0
        for block, matrix in zip(blocks, shifted, strict=True):
            end = begin + own * len(block)
            order = [k * own + node for node in self._node_order for k in range(len(block))]
            solved.append(_solve(matrix.T if transposed else matrix, mixed[begin:end, :], order))
            begin = end
        return ca.mtimes(ca.kron(ca.DM(back), ca.DM.eye(own)), ca.vertcat(*solved))

    def forward(self, columns: int) -> Any:
        """Return the function of (t, h, x, W, p, u, d, S, P): S at the end, change of the quadratures.

        S are derivatives of x and P of (p, u, d) by `columns` directions; shapes (nx, columns), (nt, columns).
        """
        return self._cached(("forward", columns), lambda: self._make_forward(columns))

    def _make_forward(self, columns: int) -> ca.Function:
        S, P = ca.MX.sym("S", self.nx, columns), ca.MX.sym("P", self.nt, columns)
        by_theta, q_w, q_theta = self._sources(*self._names)
        begin = ca.repmat(ca.vertcat(S, ca.MX(self.nz, columns)), len(self.tableau.nodes), 1)
        change = self._solve_stages(begin - self._residuals(ca.mtimes(by_theta, P)))
        last = change[self.size - self.nx - self.nz : self.size - self.nz, :]
        quadratures = ca.mtimes(q_w, change) + ca.mtimes(q_theta, P)
        return ca.Function("forward", [*self._names, S, P], [last, ca.densify(quadratures)])

    def adjoint(self, columns: int) -> Any:
        """Return the function of (t, h, x, W, p, u, d, L, Q): L at the beginning, change of the gradient by (p, u, d).

        L are derivatives of `columns` results by x at the end, Q by the quadratures; shapes (nx, columns) and
        (nq, columns).
        """
        return self._cached(("adjoint", columns), lambda: self._make_adjoint(columns))

    def _make_adjoint(self, columns: int) -> ca.Function:
        L, Q = ca.MX.sym("L", self.nx, columns), ca.MX.sym("Q", self.nq, columns)
        by_theta, q_w, q_theta = self._sources(*self._names)
        before = self.size - self.nx - self.nz
        seed = ca.vertcat(ca.MX(before, columns), L, ca.MX(self.nz, columns)) + ca.mtimes(q_w.T, Q)
        multiplier = self._solve_stages(seed, transposed=True)
        own = self.nx + self.nz
        begin = sum((multiplier[k * own : k * own + self.nx, :] for k in range(1, len(self.tableau.nodes))),
                    multiplier[: self.nx, :])  # fmt: skip
        gradient = ca.mtimes(q_theta.T, Q) - ca.mtimes(by_theta.T, self._residuals(multiplier, transposed=True))
        return ca.Function("adjoint", [*self._names, L, Q], [ca.densify(begin), ca.densify(gradient)])


def _solve(matrix: Any, right: Any, order: list[int]) -> Any:
    """Solve a linear system: a small one as dense, a large one in an order that keeps it sparse."""
    if matrix.size1() <= _DENSE:
        return ca.solve(matrix, ca.densify(right), "lapacklu")
    back = np.argsort(order).tolist()
    return ca.solve(matrix[order, order], ca.densify(right)[order, :], "csparse")[back, :]
