"""One step of the replay: Radau collocation, solved and differentiated by compiled functions.

Source: E. Hairer, G. Wanner: Solving Ordinary Differential Equations II, sections IV.5 and IV.8 (RADAU5).
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.noise import rounding
from modelica_like.analyse.replay.tableau import radau
from modelica_like.analyse.replay.tolerances import ABSOLUTE, Tolerances
from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae
from modelica_like.solve.initialize import Point

STAGES = 7


class StepFunctions:
    """Compiled functions of a step; kept with the model.

    The unknowns of a step are the states and implicit unknowns at all stages, W = (x1, z1, …, xs, zs).

    Args:
        model: the compiled model.
        quadratures: integrands, an SX column in the model's `arguments`; its name identifies it in the cache.
        tolerances: of the steps.
    """

    def __init__(self, model: CompiledDae, quadratures: Any, name: str, tolerances: Tolerances) -> None:
        self.tolerances = tolerances
        self.model = model
        self.name = name
        self.quadratures = quadratures
        self.tableau = radau(STAGES)
        self.nx, self.nz = len(model.states), len(model.implicit)
        self.nt = len(model.p) + len(model.u) + model.discrete_size
        self.nq = int(quadratures.numel())
        self.size = STAGES * (self.nx + self.nz)

    def _cached(self, key: Hashable, make: Any) -> Any:
        return self.model.fast((Cached.REPLAY, self.name, self.tableau.nodes.size, key), make)

    @cached_property
    def _names(self) -> list[Any]:
        """MX arguments of all step functions: t, h, x, W, p, u, d."""
        model = self.model
        sizes = (1, 1, self.nx, self.size, len(model.p), len(model.u), model.discrete_size)
        return [ca.MX.sym(name, size) for name, size in zip("thxWpud", sizes, strict=True)]

    @cached_property
    def _symbols(self) -> list[Any]:
        """The same as SX."""
        return [ca.SX.sym(name, symbol.shape[0]) for name, symbol in zip("thxWpud", self._names, strict=True)]

    def _at_stages(self, function: ca.Function) -> list[Any]:
        """Results of a function at all stages, one list for each."""
        (t, h, _, W, p, u, d), size = self._symbols, self.nx + self.nz
        begins = zip(self.tableau.nodes, range(0, self.size, size), strict=True)
        given = ([t + c * h, W[k : k + self.nx], W[k + self.nx : k + size], p, u, d] for c, k in begins)
        return list(zip(*(function.call(value) for value in given), strict=True))

    def _weighted(self, weights: Vector, values: Sequence[Any]) -> Any:
        """Sum over the stages, times the length of the step."""
        h = self._symbols[1]
        return sum(
            (h * w * value for w, value in zip(weights[1:], values[1:], strict=True)), h * weights[0] * values[0]
        )

    @cached_property
    def _of_states(self) -> ca.DM:
        """Picks the states out of (x, z), shape (nx + nz, nx + nz)."""
        return ca.sparsify(ca.diag(ca.DM([1.0] * self.nx + [0.0] * self.nz)))

    def _collocated(self, values: Any) -> Any:
        """Contribution of (ode, alg) at the stages, or of their derivatives, to the residual."""
        count, of_z = len(self.tableau.nodes), ca.sparsify(ca.DM.eye(self.nx + self.nz) - self._of_states)
        integrals = ca.kron(self._symbols[1] * ca.SX(ca.DM(self.tableau.matrix)), ca.SX(self._of_states))
        return ca.mtimes(ca.kron(ca.DM.eye(count), of_z) - integrals, values)

    @cached_property
    def _residual(self) -> ca.Function:
        """Residual of the stages and, unless the stages decouple, its Jacobian by W."""
        count, (_, _, x, W, *_) = len(self.tableau.nodes), self._symbols
        equations, slopes, *_ = self._at_stages(self._equations)
        states = ca.kron(ca.DM.eye(count), self._of_states)
        begin = ca.repmat(ca.vertcat(x, ca.SX(self.nz, 1)), count, 1)
        residual = ca.mtimes(states, W - begin) + self._collocated(ca.vertcat(*equations))
        by_w = ca.SX(self.size, 0) if self._constant else states + self._collocated(ca.diagcat(*slopes))
        return ca.Function("residual", self._symbols, [ca.densify(residual), by_w])

    @cached_property
    def _sources(self) -> ca.Function:
        """Jacobians of the residual by (p, u, d); of the quadratures by W and by (p, u, d)."""
        by_theta, q_w, q_theta = self._at_stages(self._parameters)
        h, weights = self._symbols[1], self.tableau.weights
        by_w = ca.horzcat(*(h * b * quadrature for b, quadrature in zip(weights, q_w, strict=True)))
        outputs = [self._collocated(ca.vertcat(*by_theta)), by_w, self._weighted(weights, q_theta)]
        return ca.Function("sources", self._symbols, outputs)

    @cached_property
    def _ending(self) -> ca.Function:
        """Weighted rates of the error estimate, and quadratures."""
        rates, powers = (self._at_stages(function)[0] for function in (self._equations, self._integrands))
        outputs = [
            self._weighted(self.tableau.estimate, rates)[: self.nx],
            self._weighted(self.tableau.weights, powers),
        ]
        return ca.Function("ending", self._symbols, outputs)

    @cached_property
    def _node_order(self) -> list[int]:
        """Order of (x, z) that keeps the factors of a sparse system sparse."""
        pattern = self._equations.sparsity_out(1) + ca.Sparsity.diag(self.nx + self.nz)
        return list((pattern + pattern.T).amd())

    @cached_property
    def _order(self) -> list[int]:
        """The same order of W: all stages of an unknown together."""
        return [k * (self.nx + self.nz) + node for node in self._node_order for k in range(len(self.tableau.nodes))]

    def _function(self, name: str, *outputs: Any) -> ca.Function:
        return ca.Function(name, list(self.model.arguments.values()), list(outputs))

    @cached_property
    def _equations(self) -> ca.Function:
        """(ode, alg) and its Jacobian by (x, z)."""
        value, (w, _) = self._values, self._unknowns
        return self._function("equations", value, ca.jacobian(value, w))

    @cached_property
    def _values(self) -> Any:
        given = self.model.arguments.values()
        return ca.vertcat(self.model.equations.ode(*given), self.model.equations.alg(*given))

    @cached_property
    def _unknowns(self) -> tuple[Any, Any]:
        """(x, z), and (p, u, d)."""
        given = self.model.arguments
        return ca.vertcat(given["x"], given["z"]), ca.vertcat(given["p"], given["u"], given["d"])

    @cached_property
    def _integrands(self) -> ca.Function:
        return self._function("integrands", ca.densify(self.quadratures))

    @cached_property
    def _parameters(self) -> ca.Function:
        """Jacobians of (ode, alg) by (p, u, d), of the quadratures by (x, z) and (p, u, d)."""
        w, theta = self._unknowns
        by = ((self._values, theta), (self.quadratures, w), (self.quadratures, theta))
        return self._function("parameters", *(ca.jacobian(value, unknown) for value, unknown in by))

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
        """Whether the Jacobian depends on x and z, and on time."""

        def find() -> tuple[bool, bool]:
            given = self.model.arguments
            entries = self._equations(*given.values())[1].nz[:]
            return ca.depends_on(entries, self._unknowns[0]), ca.depends_on(entries, given["t"])

        return self.model.once(Cached.REPLAY_DEPENDENCE, find)

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
        z = ca.MX.sym("z", self.nz)
        return self._cached("finish", lambda: ca.Function("finish", [*self._names, z], self._end(self._names[3], z)))

    @property
    def whole(self) -> Any:
        """The same of any W, for linear equations: the solved W, error estimate and quadratures."""

        def make() -> ca.Function:
            z, W = ca.MX.sym("z", self.nz), self._names[3] + self._correction()
            return ca.Function("whole", [*self._names, z], [W, *self._end(W, z)])

        return self._cached("whole", make)

    def _end(self, W: Any, z: Any) -> list[Any]:
        """Error estimate and quadratures of a step with the stages W that begins with z."""
        t, h, x, _, p, u, d = self._names
        return [self._estimated(W, z)[: self.nx], ca.densify(self._ending(t, h, x, W, p, u, d)[1])]

    def _estimated(self, W: Any, z: Any) -> Any:
        """Error estimate of (x, z) of a step with the stages W that begins with z."""
        t, h, x, _, p, u, d = self._names
        ode = self._equations(t, x, z, p, u, d)[0][: self.nx]
        matrix = self._shifted("estimate", np.array([[self.tableau.gamma]]))(t, h, x, z, p, u, d)
        right = self._ending(t, h, x, W, p, u, d)[0] + self.tableau.gamma * h * ode
        return _solve(matrix, ca.vertcat(right, ca.MX(self.nz, 1)), self._node_order)

    def _shifted(self, name: str, *blocks: Vector) -> ca.Function:
        """I ⊗ E - h B ⊗ F for each block, of the linearised equations E y' = F y at the beginning of the step."""
        t, h, x, _, p, u, d = self._symbols
        z, of_x = ca.SX.sym("z", self.nz), ca.SX(self._of_states)
        slopes = self._equations(t, x, z, p, u, d)[1]
        rate = ca.mtimes(of_x, slopes)
        shifted = [
            ca.kron(ca.SX.eye(len(b)), of_x + slopes - rate) - h * ca.kron(ca.SX(ca.DM(b)), rate) for b in blocks
        ]
        return ca.Function(name, [t, h, x, z, p, u, d], shifted)

    def _solve_stages(self, right: Any, *, transposed: bool = False) -> Any:
        """Solve with the Jacobian of the residual by W, or its transpose.

        If it is the same at all stages, they decouple by the eigenvalues of the tableau (Hairer, Wanner, IV.8).
        """
        if not self._constant:
            by_w = self._residual(*self._names)[1]
            return _solve(by_w, right, self._order, transposed=transposed)
        size = self.nx + self.nz
        basis, blocks = self.tableau.real_form
        back, there = (np.linalg.inv(basis).T, basis.T) if transposed else (basis, np.linalg.inv(basis))
        mixed = ca.mtimes(ca.kron(ca.DM(there), ca.DM.eye(size)), ca.densify(right))
        t, h, x, _, p, u, d = self._names
        shifted = self._shifted("shifted", *blocks)(t, h, x, ca.MX(self.nz, 1), p, u, d)
        solved, begin = [], 0
        for block, matrix in zip(blocks, shifted, strict=True):
            end = begin + size * len(block)
            order = [k * size + node for node in self._node_order for k in range(len(block))]
            solved.append(_solve(matrix, mixed[begin:end, :], order, transposed=transposed))
            begin = end
        return ca.mtimes(ca.kron(ca.DM(back), ca.DM.eye(size)), ca.vertcat(*solved))

    def forward(self, columns: int) -> Any:
        """Return the function of (t, h, x, W, p, u, d, S, P): S at the end, change of the quadratures.

        S are derivatives of x and P of (p, u, d) by `columns` directions; shapes (nx, columns), (nt, columns).
        """
        return self._cached(("forward", columns), lambda: self._make_forward(columns))

    def _make_forward(self, columns: int) -> ca.Function:
        S, P = ca.MX.sym("S", self.nx, columns), ca.MX.sym("P", self.nt, columns)
        by_theta, q_w, q_theta = self._sources(*self._names)
        begin = ca.repmat(ca.vertcat(S, ca.MX(self.nz, columns)), len(self.tableau.nodes), 1)
        change = self._solve_stages(begin - ca.mtimes(by_theta, P))
        last = change[self.size - self.nx - self.nz : self.size - self.nz, :]
        quadratures = ca.mtimes(q_w, change) + ca.mtimes(q_theta, P)
        return ca.Function("forward", [*self._names, S, P], [last, ca.densify(quadratures)])

    @property
    def tangent(self) -> Any:
        """Function of (t, h, x, W, p, u, d, z, S, P) of the beginning: S at the end, and estimates of errors.

        S are derivatives of x and P of (p, u, d) in one direction. The estimates are that of S, and for the quadratures
        and their derivatives those, their amounts, terms and noise (`_gains`), each of shape (nq, 2).
        """
        return self._cached("tangent", self._make_tangent)

    def _make_tangent(self) -> ca.Function:
        t, h, x, _, p, u, d = self._names
        z, S, P = (ca.MX.sym(name, size) for name, size in (("z", self.nz), ("S", self.nx), ("P", self.nt)))
        by_theta = self._sources(*self._names)[0]
        change = self._solve_stages(ca.repmat(ca.vertcat(S, ca.MX(self.nz, 1)), STAGES, 1) - ca.mtimes(by_theta, P))
        slopes, theta = self._equations(t, x, z, p, u, d)[1], ca.mtimes(self._parameters(t, x, z, p, u, d)[0], P)
        at_once, matrix = self._shifted("both", np.zeros((1, 1)), np.array([[self.tableau.gamma]]))(t, h, x, z, p, u, d)
        begin = _solve(at_once, ca.vertcat(S, -theta[self.nx :, :]), self._node_order)
        first = (ca.mtimes(slopes, begin) + theta)[: self.nx, :]
        rates = self._tangent_rates(*self._names, change, P) + self.tableau.gamma * h * first
        error = _solve(matrix, ca.vertcat(rates, ca.MX(self.nz, 1)), self._node_order)
        last = change[self.size - self.nx - self.nz : self.size - self.nz, :]
        gains = self._estimated_gains(z, change, P, begin, error) if self.nq else [ca.MX(0, 2)] * 4
        return ca.Function("tangent", [*self._names, z, S, P], [last, error[: self.nx, :], *gains])

    def _estimated_gains(self, z: Any, change: Any, P: Any, begin: Any, error: Any) -> list[Any]:
        """Errors, amounts, terms and noise of the quadratures and their derivatives: quadratures are states as others.

        Args:
            z: implicit unknowns at the beginning.
            change: derivatives of (x, z) at the stages.
            P: those of (p, u, d).
            begin: those of (x, z) at the beginning.
            error: their estimated error.
        """
        t, h, x, W, p, u, d = self._names
        _, by_w, by_theta = self._parameters(t, x, z, p, u, d)
        first = ca.horzcat(self._integrands(t, x, z, p, u, d), ca.mtimes(by_w, begin) + ca.mtimes(by_theta, P))
        # What x and z are wrong by is taken along, or an integrand of a stiff motion would seem to be wrong.
        taken = ca.mtimes(by_w, ca.horzcat(self._estimated(W, z), error))
        weighted, *sizes = self._gains(*self._names, change, P)
        errors = ca.fabs(weighted + self.tableau.gamma * h * (first + taken))
        return [ca.densify(column) for column in (errors, *sizes)]

    @cached_property
    def _gains(self) -> ca.Function:
        """Sums over the stages for quadratures and their derivatives: weighted for the estimate, amounts, terms, noise.

        Arguments after those of a step are tangents (x, z) at the stages and P. Terms are what the amounts would be if
        nothing cancelled out: an integrand is wrong by what x and z are wrong by, times its slopes. Besides, it is
        rounded: the loss of an ideal switch is nothing else.
        """
        width, change, P = self.nx + self.nz, ca.SX.sym("change", self.size), ca.SX.sym("P", self.nt)
        (powers,), (_, q_w, q_theta) = self._at_stages(self._integrands), self._at_stages(self._parameters)
        given = list(self.model.arguments.values())
        rounded = self._function("rounding", ca.densify(rounding(given, self.quadratures)))
        least = ca.vertcat(ABSOLUTE * ca.DM(self.model.equations.nominals), ca.DM.ones(self.nz))
        values: list[Any] = []
        terms: list[Any] = []
        for k, (power, by_w, by_theta) in enumerate(zip(powers, q_w, q_theta, strict=True)):
            here = slice(k * width, (k + 1) * width)
            values.append(ca.horzcat(power, ca.mtimes(by_w, change[here]) + ca.mtimes(by_theta, P)))
            rounding_of_w = ca.mtimes(ca.fabs(by_w), ca.fabs(self._symbols[3][here]) + least)
            felt = ca.mtimes(ca.fabs(by_w), ca.fabs(change[here])) + ca.mtimes(ca.fabs(by_theta), ca.fabs(P))
            # Directions change parameters by about their sizes: what is noise beside a value is so beside its change.
            terms.append(ca.horzcat(rounding_of_w, rounding_of_w + felt))
        sums = (
            self._weighted(self.tableau.estimate, values),
            self._weighted(self.tableau.weights, [ca.fabs(value) for value in values]),
            self._weighted(self.tableau.weights, terms),
            self._weighted(self.tableau.weights, [ca.repmat(column, 1, 2) for column in self._at_stages(rounded)[0]]),
        )
        return ca.Function("gains", [*self._symbols, change, P], [ca.densify(column) for column in sums])

    @cached_property
    def _tangent_rates(self) -> ca.Function:
        """Weighted rates of the error estimate, of tangents (x, z) at the stages and P."""
        width, change, P = self.nx + self.nz, ca.SX.sym("change", self.size), ca.SX.sym("P", self.nt)
        slopes, by_theta = self._at_stages(self._equations)[1], self._at_stages(self._parameters)[0]
        rates = [
            ca.mtimes(slope, change[k * width : (k + 1) * width]) + ca.mtimes(by, P)
            for k, (slope, by) in enumerate(zip(slopes, by_theta, strict=True))
        ]
        estimate = ca.densify(self._weighted(self.tableau.estimate, rates)[: self.nx])
        return ca.Function("tangent_rates", [*self._symbols, change, P], [estimate])

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
        stages = ca.vertsplit(multiplier, self.nx + self.nz)
        begin = sum((stage[: self.nx, :] for stage in stages[1:]), stages[0][: self.nx, :])
        gradient = ca.mtimes(q_theta.T, Q) - ca.mtimes(by_theta.T, multiplier)
        return ca.Function("adjoint", [*self._names, L, Q], [ca.densify(begin), ca.densify(gradient)])


def _solve(matrix: Any, right: Any, order: list[int], *, transposed: bool = False) -> Any:
    """Solve a linear system or its transpose in an order that keeps it sparse, with pivots on the diagonal.

    A pivot in the row of an angle, which may be a billion radians, would let its rounding into slips that modes hold at
    zero. Both use the factors of the matrix itself: where nothing depends on an angle, its column has one entry, and
    the multiplier of the angle stays exactly zero.
    """
    back, ordered = np.argsort(order).tolist(), matrix[order, order]
    linsol = ca.Linsol("solver", "csparse", ordered.sparsity())
    return linsol.solve(ordered, ca.densify(right)[order, :], transposed)[back, :]
