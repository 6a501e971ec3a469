"""One smooth segment: SUNDIALS IDAS through CasADi, in scaled time."""

from __future__ import annotations

import io
import math
import re
import sys
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import BufferedFunction
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import StepFailed
from modelica_like.options import Options
from modelica_like.solve.initialize import Point, call, polished
from modelica_like.solve.interrupts import Interrupts

_FLAGS = {
    "IDA_TOO_MUCH_WORK": "it took too many steps",
    "IDA_TOO_MUCH_ACC": "the tolerance is too small for the arithmetic",
    "IDA_ERR_FAIL": "its error test failed repeatedly, or the step became too small",
    "IDA_CONV_FAIL": "the nonlinear equations of a step did not converge",
    "IDA_LSETUP_FAIL": "the Jacobian could not be factorized",
    "IDA_LSOLVE_FAIL": "the linear system of a step could not be solved",
    "IDA_RES_FAIL": "the equations could not be evaluated",
    "IDA_REP_RES_ERR": "the equations gave values that are not finite",
    "IDA_NO_RECOVERY": "no consistent start of the segment was found",
    "IDA_CONSTR_FAIL": "a constraint was violated",
    "IDA_ILL_INPUT": "an input was invalid",
}

_FIRST_STEP = 1e-5
"""In scaled time. The first steps have a low order: longer ones cause errors of several tolerances at every event."""
_STRICTER, _NOISY = 0.3, 1e-11
"""What IDAS is asked for, in tolerances: its errors of steps add up to several of them. It takes a fifth more steps and
is three to ten times as precise; below the second number rounding makes more steps than tolerances do."""
_SHORTENED = 1e-6
"""Largest factor by which IDAS shortens its first step before it gives up."""
_ENDLESS = 1e100
"""Largest way of a state in tolerances: IDAS takes their squares, and searches for ever where these are not finite."""
_SPARSE_FROM = 50
"""Number of unknowns from which CSparse is faster, if their order is good."""
_FILLS = 1.5
"""Entries of the factor in the order of the unknowns, over those in the best order, from which on QR is faster."""
_RELAXATION = 10.0
_PANEL_STEPS = 300
"""Largest number of steps between two results of a panel; with more, it has probably passed an event, and ends."""


@dataclass(frozen=True)
class Grid:
    """Where results of a call lie: at equal distances in each piece of it.

    Attributes:
        pieces: their number.
        looks: results of each piece.
        power: 1 for pieces of equal length; with more, the first ones are shorter, as what begins asks for.
    """

    pieces: int = 1
    looks: int = 1
    power: int = 1

    @cached_property
    def ends(self) -> Vector:
        """Ends of the pieces, as shares of the whole."""
        return (np.arange(1, self.pieces + 1) / self.pieces) ** self.power

    @cached_property
    def shares(self) -> Vector:
        """Places of the results, as shares of the whole."""
        ends = np.append(0.0, self.ends)
        inner = np.arange(1, self.looks + 1) / self.looks
        return (ends[:-1, None] + np.diff(ends)[:, None] * inner).ravel()


_END = Grid()


def scaled_problem(model: CompiledDae, *, gentle: bool, scaled: bool) -> tuple[dict[str, Any], ca.Function]:
    """Return the equations in scaled time s in [0, 1] for `casadi.integrator`, and a function for its parameters.

    This function of (t0, span, p, u, d) also evaluates what depends on nothing else: once, not in every step.

    Args:
        model: the compiled model.
        gentle: t = t0 + s²·span instead of t = t0 + s·span. Then dt/ds is zero at s = 0, so slopes of zero are exact
            there, and first steps are short for any span.
        scaled: if false, t = t0 + s: rates need no factor, which saves an eighth of the work in some models.
    """
    return model.once((Cached.SCALED, gentle, scaled), lambda: _scaled_problem(model, gentle, scaled))


def _scaled_problem(model: CompiledDae, gentle: bool, scaled: bool) -> tuple[dict[str, Any], ca.Function]:
    s, t0, span = ca.SX.sym("s"), ca.SX.sym("t0"), ca.SX.sym("span")
    x, z, p, u, d = (model.arguments[name] for name in ("x", "z", "p", "u", "d"))
    passed, speed = (s * s * span, 2 * s * span) if gentle else (s * span, span) if scaled else (s, 1.0)
    inner = [t0 + passed, x, z, p, u, d]
    ode, alg = ca.cse([speed * model.equations.ode(*inner), model.equations.alg(*inner)])
    parameters = ca.vertcat(t0, span, p, u, d)
    (ode, alg), symbols, fixed = ca.extract_parametric([ode, alg], parameters)
    of_parameters = ca.Function("known", [parameters], [ca.densify(ca.vertcat(parameters, *fixed))])
    return {"t": s, "x": x, "z": z, "p": ca.vertcat(parameters, *symbols), "ode": ode, "alg": alg}, of_parameters


def linear_solver(pattern: ca.Sparsity) -> str:
    """Return the linear solver for the Jacobian of a step.

    CasADi's QR is fast for few unknowns, and chooses their order. The LU of CSparse does less work for a chain, but
    takes the unknowns as they come: where the drive has branches it fills up, and takes ten times as long as QR.
    """
    if pattern.size1() < _SPARSE_FROM:
        return "qr"
    given, best = (pattern.qr_sparse(ordered)[1].nnz() for ordered in (False, True))
    return "csparse" if given < _FILLS * best else "qr"


def _pattern(model: CompiledDae) -> ca.Sparsity:
    """Return the pattern of the Jacobian of a step by states and implicit unknowns."""
    blocks = [[function.jac_sparsity(0, k) for k in (1, 2)] for function in (model.equations.ode, model.equations.alg)]
    pattern = ca.vertcat(*(ca.horzcat(*row) for row in blocks))
    return pattern + ca.Sparsity.diag(pattern.size1())


class Integrator:
    """Integrates a model over one interval with fixed modes; its IDAS instances are kept with the model.

    Time is scaled, so that one instance serves all intervals.

    Args:
        model: the compiled model.
        options: tolerances.
        whole: whether intervals are whole runs: then large models get an instance for each length, which is faster.
        counted: whether to count steps and evaluations, which costs as much as five steps.
        first: first step in scaled time.

    Attributes:
        rtol: present relative tolerance.
        atol: present absolute one, in nominal values.
        reached: time in s at which IDAS gave up last.
    """

    def __init__(
        self,
        model: CompiledDae,
        options: Options,
        *,
        whole: bool = False,
        counted: bool = True,
        first: float = _FIRST_STEP,
    ) -> None:
        self.model = model
        self.options = options
        self.counted, self.first = counted, first
        self.calls = 0
        self.steps = 0
        self.evaluations = 0
        self.gave_up: StepFailed
        self.reached = -np.inf
        self.interrupts = Interrupts()
        self._relax(1.0)
        self._gentle_from = np.inf
        self._whole = whole and len(model.states) >= _SPARSE_FROM
        self._seconds: float | None = None
        self._tail = np.concatenate([model.p, model.u])

    def weights(self, x: Vector) -> Vector:
        """Error weights of states from relative and absolute tolerance; shape as x, (nx,) or (nx, n)."""
        absolute = self.atol * self.model.equations.nominals
        return self.rtol * np.abs(x) + (absolute if x.ndim == 1 else absolute[:, None])

    def relax(self) -> bool:
        """Relax the tolerances by ten, once; False if they are already."""
        first = self._relaxed == 1.0
        self._relax(_RELAXATION)
        return first

    def _relax(self, factor: float) -> None:
        self._relaxed = factor
        self.rtol, self.atol = self.options.rtol * factor, self.options.atol * factor

    def _instance(self, grid: Grid, steps: int, gentle: bool, first: float, longest: float) -> BufferedFunction:
        key = Cached.IDAS, grid, self.rtol, self.options.atol, steps, gentle, first, self._seconds, longest
        return self.model.fast(key, lambda: self._make(grid, steps, gentle, first, longest), results=(0, 1))

    def _longest(self, span: float, gentle: bool) -> float:
        """Return the largest step in scaled time, a power of two so that intervals share instances; 0 for none."""
        if self.options.max_step >= span:
            return 0.0
        # dt/ds is at most 2·span with `gentle`.
        return 2.0 ** math.floor(math.log2(self.options.max_step / (2 * span if gentle else span)))

    def _first_step(self, start: Point, span: float) -> float:
        """Return a first step in scaled time that moves states by about their tolerances.

        With `gentle`, a step s moves them by s² times rates times the span.
        """
        fastest = float(np.max(self._rates(start))) * span
        step = _FIRST_STEP
        while np.isfinite(fastest) and (step * _SHORTENED) ** 2 * fastest > 1.0:
            step *= _FIRST_STEP
        return step

    def _rates(self, point: Point) -> np.ndarray:
        """Return the rates of the states in their tolerances, 1/s; infinite beyond the largest number."""
        with np.errstate(over="ignore"):
            return np.abs(call(self.model, self.model.equations.ode, point)) / self.weights(point.x)

    def _make(self, grid: Grid, steps: int, gentle: bool, first: float, longest: float) -> ca.Function:
        length = self._seconds or 1.0
        problem, _ = scaled_problem(self.model, gentle=gentle, scaled=self._seconds is None)
        places = (np.sqrt(grid.shares) if gentle else grid.shares * length).tolist()
        return ca.integrator(
            "segment", "idas", problem, 0, places, self._settings(steps, gentle, first * length, longest * length)
        )

    def _settings(self, steps: int, gentle: bool, first: float, longest: float) -> dict[str, Any]:
        nominal = self.model.equations.nominals
        return {
            "reltol": max(_STRICTER * self.rtol, min(self.rtol, _NOISY)),
            "abstol": _STRICTER * self.options.atol * self._relaxed * (float(np.min(nominal)) if nominal.size else 1.0),
            "max_num_steps": steps,
            # The implicit unknowns follow from the states and are polished; their part of the error test costs
            # steps, and fails at tight tolerances.
            "suppress_algebraic": True,
            # By default, IDAS starts with a step of 1e-10 and needs thirty more to reach its usual step, after every
            # event.
            "step0": min(first, longest or first),
            "max_step_size": longest,
            "calc_ic": not gentle,
            "linear_solver": self.model.once(Cached.LINEAR_SOLVER, lambda: linear_solver(_pattern(self.model))),
        }

    def run(
        self, start: Point, span: float, grid: Grid = _END, *, patient: bool = True, partial: bool = False,
        polish: bool = True,
    ) -> tuple[Vector, Vector]:  # fmt: skip
        """Integrate from `start` over `span` seconds.

        Args:
            start: consistent start.
            span: length of the interval in s.
            grid: of the results.
            patient: allow all steps between two results, not only the usual number.
            partial: fewer results are valid, too: those before IDAS gave up.
            polish: whether to solve for the implicit unknowns precisely.

        Returns:
            States and implicit unknowns, shapes (nx, results), (nz, results).

        Raises:
            StepFailed: IDAS gave up.
        """
        self.calls += 1
        if not self.model.states:
            return self._algebraic(start, span, grid)
        p = np.concatenate([[start.t, span], self._tail, start.d])
        steps = self.options.max_steps if patient else min(self.options.max_steps, _PANEL_STEPS)
        gentle = span >= self._gentle_from
        if not gentle and np.max(self._rates(start)) * span > _ENDLESS:
            self.gave_up = self.too_fast(start)
            raise self.gave_up
        x, z, why = self._call(start, p, grid, steps, gentle)
        if why and not gentle and _at_the_start(why):
            # IDAS searches for consistent slopes at the start, and may not find them; with `gentle` they are known.
            self._gentle_from = min(span, self._gentle_from)
            gentle = True
            x, z, why = self._call(start, p, grid, steps, gentle)
        if why or not np.isfinite(x[:, -1]).all():
            finite = np.isfinite(x).all(axis=0)
            done = int(np.argmin(finite)) if partial else 0
            self.gave_up = self._failed(start, span, why or "IDA_REP_RES_ERR", gentle)
            if not done:
                raise self.gave_up
            x, z = x[:, :done], z[:, :done]
        if polish and self.model.implicit:
            times = start.t + span * grid.shares[: x.shape[1]]
            z = polished(self.model, times, x, z, start.d)
        return x, z

    def _call(self, start: Point, p: Vector, grid: Grid, steps: int, gentle: bool) -> tuple[Vector, Vector, str]:
        """Return the results of IDAS and its output if it gives up, which goes into the error and not to the screen.

        Raises:
            KeyboardInterrupt: the run was interrupted; IDAS treats this as an error in the equations.
        """
        self._seconds = float(p[1]) if self._whole and not gentle else None
        first = self._first_step(start, p[1]) if gentle else self.first
        longest = self._longest(p[1], gentle)
        instance, scaled = self._instance(grid, steps, gentle, first, longest), self._seconds is None
        parameters = self.model.fast(
            (Cached.SCALED_PARAMETERS, gentle, scaled),
            lambda: scaled_problem(self.model, gentle=gentle, scaled=scaled)[1],
        )
        instance.forget()
        screen, sys.stderr = sys.stderr, io.StringIO()
        why = ""
        try:
            with self.interrupts:
                x, z = instance(start.x, start.z, parameters(p)[0])
        except RuntimeError as error:
            why = f"{sys.stderr.getvalue()} {error}"
            x, z = instance.latest()
        finally:
            sys.stderr = screen
        if self.counted and not why:
            self._count(instance.statistics())
        count = len(grid.shares)
        return x.reshape(count, -1).T, z.reshape(count, -1).T, why

    def _count(self, statistics: dict[str, Any]) -> None:
        self.steps += int(statistics["nsteps"])
        self.evaluations += int(statistics["nfevals"])

    def _algebraic(self, start: Point, span: float, grid: Grid) -> tuple[Vector, Vector]:
        """Without states: solve the implicit equations at each output."""
        from modelica_like.solve.initialize import solve_implicit

        columns: list[Vector] = []
        point = start.copy()
        for share in grid.shares:
            point.t = start.t + span * float(share)
            solve_implicit(self.model, point)
            columns.append(point.z)
        z = np.array(columns).T if self.model.implicit else np.zeros((0, len(columns)))
        return np.zeros((0, len(columns))), z

    def _failed(self, start: Point, span: float, text: str, gentle: bool) -> StepFailed:
        flag = next((name for name in _FLAGS if name in text), "")
        reason = _FLAGS.get(flag, "it stopped without a known reason")
        reached = _reached(text) ** 2 if gentle else _reached(text) / (self._seconds or 1.0)
        self.reached = moment = start.t + span * reached
        return self.failure(f"IDAS gave up at about t = {moment:.6g} s: {reason}{f' ({flag})' if flag else ''}.", start)

    def too_fast(self, point: Point) -> StepFailed:
        """Return the error of states that change by more than their tolerances in any time that can be told."""
        return self.failure(f"IDAS gave up at about t = {point.t:.6g} s: {_FLAGS['IDA_ERR_FAIL']}.", point)

    def failure(self, what: str, point: Point) -> StepFailed:
        """Return an error that names the state which changes fastest at a point."""
        fastest = self.model.states[int(np.argmax(np.nan_to_num(self._rates(point))))]
        return StepFailed(
            what,
            why=f"{fastest} changes fastest relative to its tolerance.",
            advice="Look for a stiff spring, a vanishing mass or a speed without bound; then try other tolerances.",
        )


def _reached(text: str) -> float:
    """Scaled time at which IDAS gave up, from its output."""
    at = re.search(r"At t = ([0-9.]+(?:[eE][+-]?[0-9]+)?)", text)
    return float(at.group(1)) if at else 0.0


def _at_the_start(text: str) -> bool:
    return _reached(text) == 0.0 and "IDA_TOO_MUCH_WORK" not in text
