"""One smooth step of the replay: solved, differentiated, and shortened to a change of sign."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from modelica_like.analyse.replay.steps import StepFunctions
from modelica_like.analyse.replay.tolerances import ABSOLUTE
from modelica_like.compile.buffers import Vector
from modelica_like.errors import StepFailed
from modelica_like.solve.initialize import Point

_ITERATIONS = 12
_CONVERGED = 1e-2
_TRIALS = 40
CLOSE = 2e-13
"""Distance of a step's end from the following event or kink, relative to the time."""


@dataclass(frozen=True)
class Tangent:
    """A derivative in one direction, carried over a step, and estimates of errors.

    Attributes:
        end: derivatives of (x, theta) at the end, shape (nx + ntheta,).
        error: of those of x, shape (nx,).
        errors: of the quadratures and of their derivatives, shape (2, nq).
        amounts: integrals of the amounts of both over the step, shape (2, nq).
        terms: what these would be if nothing cancelled out, shape (2, nq).
        noise: integrals of the rounding of both, over the unit roundoff, shape (2, nq).
    """

    end: Vector
    error: Vector
    errors: Vector
    amounts: Vector
    terms: Vector
    noise: Vector

    @property
    def sizes(self) -> Vector:
        """Amounts, terms and noise, shape (3, 2, nq)."""
        return np.stack([self.amounts, self.terms, self.noise])


@dataclass(frozen=True)
class Step:
    """A smooth step from `before` over `h` seconds with the solved stages W."""

    functions: StepFunctions
    before: Point
    after: Point
    h: float
    stages: Vector
    quadratures: Vector

    def inside(self) -> list[Point]:
        """Return the points at the stages but the last, which is the end."""
        nx, nodes = len(self.before.x), self.functions.tableau.nodes
        values = zip(nodes[:-1], self.stages.reshape(len(nodes), -1), strict=False)
        return [Point(self.before.t + c * self.h, w[:nx], w[nx:], self.before.d) for c, w in values]

    def forward(self, whole: Vector) -> tuple[Vector, Vector]:
        """Carry derivatives of (x, theta) to the end; shapes (nx + ntheta, columns) and (quadratures, columns)."""
        nx, columns = len(self.before.x), whole.shape[1]
        fast = self.functions.forward(columns)
        end, gained = fast(*self._arguments, whole[:nx].ravel("F"), whole[nx:].ravel("F"))
        return np.vstack([end.reshape(columns, -1).T, whole[nx:]]), gained.reshape(columns, -1).T

    def tangent(self, whole: Vector) -> Tangent:
        """Carry derivatives of (x, theta) in one direction, shape (nx + ntheta,), and estimate errors."""
        nx, nq = len(self.before.x), self.functions.nq
        end, error, *gains = self.functions.tangent(*self._arguments, self.before.z, whole[:nx], whole[nx:])
        # An integrand such as sqrt(abs(x)) has no slope at zero: there the estimate tells nothing.
        errors, amounts, terms, noise = (np.nan_to_num(gain.reshape(2, nq), posinf=0.0, neginf=0.0) for gain in gains)
        return Tangent(np.concatenate([end, whole[nx:]]), error.copy(), errors, amounts, terms, noise)

    def adjoint(self, whole: Vector, Q: Vector) -> Vector:
        """Carry derivatives by (x, theta) to the beginning; Q are those by the quadratures."""
        nx, columns = len(self.before.x), whole.shape[1]
        parts = self.functions.adjoint(columns)(*self._arguments, whole[:nx].ravel("F"), Q.ravel("F"))
        begin, more = (part.reshape(columns, -1).T for part in parts)
        return np.vstack([begin, whole[nx:] + more])

    @property
    def _arguments(self) -> tuple[object, ...]:
        model, here = self.functions.model, self.before
        return here.t, self.h, here.x, self.stages, model.p, model.u, here.d


def try_step(functions: StepFunctions, point: Point, h: float, last: Step | None) -> tuple[Step | None, float]:
    """Make a step; return it and its error relative to the tolerances, or None if it did not converge.

    Args:
        functions: of the model.
        point: its beginning.
        h: its length in s.
        last: the step before, or one from the same beginning, as a first guess.
    """
    model, nx, nz = functions.model, functions.nx, functions.nz
    theta = model.p, model.u, point.d
    W = np.concatenate([point.x, point.z] * len(functions.tableau.nodes))
    if functions.linear:
        W, error, quadratures = functions.whole(point.t, h, point.x, W, *theta, point.z)
    else:
        if last is not None:
            begin = 0.0 if last.before is point else 1.0
            W = functions.tableau.continued(last.stages, begin, h / last.h)
        W = _solved(functions, point, h, W)
        if W is None:
            return None, np.inf
        error, quadratures = functions.finish(point.t, h, point.x, W, *theta, point.z)
    after = Point(point.t + h, W[-nx - nz : W.size - nz].copy(), W[W.size - nz :].copy(), point.d)
    scale = np.maximum(np.abs(point.x), np.abs(after.x)) + ABSOLUTE * model.equations.nominals
    norm = functions.tolerances.norm(error / scale)
    return (Step(functions, point, after, h, W, quadratures), norm) if norm < np.inf else (None, np.inf)


def _solved(functions: StepFunctions, point: Point, h: float, W: Vector) -> Vector | None:
    """The stages by Newton's method, or None if it does not converge."""
    model = functions.model
    scale = np.concatenate([np.abs(point.x) + ABSOLUTE * model.equations.nominals, 1.0 + np.abs(point.z)])
    weights = np.concatenate([functions.tolerances.rtol * scale] * len(functions.tableau.nodes))
    size = np.inf
    for _ in range(_ITERATIONS):
        try:
            correction = functions.newton(point.t, h, point.x, W, model.p, model.u, point.d)[0]
        except RuntimeError:  # CasADi's solvers refuse a matrix with nan: so far away the equations have no value
            return None
        W = W + correction
        before, size = size, float(np.abs(correction / weights).max(initial=0.0))
        if not np.isfinite(size):
            return None
        # Newton's method converges quadratically: the next correction is far below this one.
        if size <= _CONVERGED or size * size <= _CONVERGED * before < np.inf:
            return W
    return None


def stuck(point: Point) -> StepFailed:
    """Return the error about steps that do not converge."""
    return StepFailed(
        f"The replay of the run stalled at t = {point.t:.9g} s: its steps do not converge.",
        advice="Look for a function without a slope there, or for a mode that should have changed.",
    )


def shortened(
    step: Step, value: Callable[[Point], float], low: tuple[float, float], high: tuple[float, float], zero: float = 0.0
) -> Step | None:
    """Shorten a step so that it ends just before a function of its end changes its sign: regula falsi (Illinois).

    Args:
        step: the step.
        value: the function.
        low: a length and the function there, before the change.
        high: the same behind it.
        zero: tolerance of zero on either side, relative to the values at `low` and `high`.

    Returns:
        The step, or None if it would have no length or does not converge.
    """
    (a, f_a), (b, f_b) = low, high
    last: Step | None = None
    side: bool | None = None
    small, enough = CLOSE * max(1.0, abs(step.before.t)), zero * (abs(f_a) + abs(f_b))
    for _ in range(_TRIALS):
        if b - a <= small:
            break
        h = min(max(b - f_b * (b - a) / (f_b - f_a), a + 0.5 * small), b - 0.5 * small)
        candidate, _ = try_step(step.functions, step.before, h, step)
        if candidate is None:
            break
        f = value(candidate.after)
        if abs(f) < enough:
            return candidate
        # A bound that stays twice gets half the weight.
        if near := f * f_a > 0.0:
            a, f_a, last, f_b = h, f, candidate, f_b * (0.5 if side == near else 1.0)
        else:
            b, f_b, f_a = h, f, f_a * (0.5 if side == near else 1.0)
        side = near
    return last
