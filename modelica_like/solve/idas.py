"""One smooth segment: SUNDIALS IDAS through CasADi, in scaled time."""

from __future__ import annotations

import io
import re
from contextlib import redirect_stderr
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import BufferedFunction, buffered
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import StepFailed
from modelica_like.initialize import Point, call
from modelica_like.solve.options import Options

_FLAGS = {
    "IDA_TOO_MUCH_WORK": "it took too many steps",
    "IDA_TOO_MUCH_ACC": "the tolerance is too small for the arithmetic",
    "IDA_ERR_FAIL": "its error test failed again and again, or the step became too small",
    "IDA_CONV_FAIL": "the nonlinear equations of a step did not converge",
    "IDA_LSETUP_FAIL": "the Jacobian could not be factorised",
    "IDA_LSOLVE_FAIL": "the linear system of a step could not be solved",
    "IDA_RES_FAIL": "the equations could not be evaluated",
    "IDA_REP_RES_ERR": "the equations gave values that are not finite",
    "IDA_NO_RECOVERY": "no consistent start of the segment was found",
    "IDA_CONSTR_FAIL": "a constraint was violated",
    "IDA_ILL_INPUT": "an input was not acceptable to it",
}

_FIRST_STEP = 1e-4
_POLISHING = 2
_PANEL_STEPS = 5000
"""Steps between two results of a panel; a panel that needs more has probably run past an event, and is divided."""


def scaled_problem(model: CompiledDae) -> dict[str, Any]:
    """Return the equations in scaled time s in [0, 1], t = t0 + s*span, with parameters (t0, span, p, u, d).

    Besides what `casadi.integrator` takes: `inner`, the arguments of the model's functions, and `span`.
    """
    if "scaled" not in model._cache:
        arguments = model.arguments
        s, t0, span = ca.SX.sym("s"), ca.SX.sym("t0"), ca.SX.sym("span")
        x, z, p, u, d = (arguments[name] for name in ("x", "z", "p", "u", "d"))
        inner = [t0 + s * span, x, z, p, u, d]
        model._cache["scaled"] = {
            "t": s, "x": x, "z": z, "p": ca.vertcat(t0, span, p, u, d),
            "ode": span * model.ode(*inner), "alg": model.alg(*inner), "inner": inner, "span": span,
        }  # fmt: skip
    return model._cache["scaled"]


class Integrator:
    """Integrates a model over one interval with fixed modes; its IDAS instances are kept with the model.

    Time is scaled, so that one instance serves intervals of any place and length.
    """

    def __init__(self, model: CompiledDae, options: Options) -> None:
        self.model = model
        self.options = options
        self.calls = 0
        self.steps = 0
        self.evaluations = 0
        self._tail = np.concatenate([model.p, model.u])

    def _instance(self, outputs: int, steps: int) -> BufferedFunction:
        key = "idas", outputs, self.options.rtol, self.options.atol, steps
        return buffered(self.model._cache, key, lambda: self._make(outputs, steps), results=(0, 1))

    def _make(self, outputs: int, steps: int) -> ca.Function:
        problem = {name: value for name, value in scaled_problem(self.model).items() if name not in ("inner", "span")}
        grid = [k / outputs for k in range(1, outputs + 1)]
        return ca.integrator("segment", "idas", problem, 0, grid, self._settings(steps))

    def _settings(self, steps: int) -> dict[str, Any]:
        nominal = self.model.nominals
        return {
            "reltol": self.options.rtol,
            "abstol": self.options.atol * (float(np.min(nominal)) if nominal.size else 1.0),
            "max_num_steps": steps,
            # The implicit unknowns follow from the states and are polished; their part of the error test only costs
            # steps, and fails at tight tolerances.
            "suppress_algebraic": True,
            # Left alone, IDAS begins with a step of 1e-10 and takes thirty more to reach its stride, at every event
            # anew.
            "step0": _FIRST_STEP,
        }

    def run(self, start: Point, span: float, outputs: int = 1, *, patient: bool = True) -> tuple[Vector, Vector]:
        """Integrate from `start` over `span` seconds.

        Args:
            start: consistent start.
            span: length of the interval in s.
            outputs: number of equidistant results.
            patient: allow all steps between two results, not only as many as usual: False where a shorter piece can be
                tried instead.

        Returns:
            States and implicit unknowns at `outputs` equidistant times, the last at the end; shapes (nx, outputs),
            (nz, outputs).

        Raises:
            StepFailed: IDAS gave up.
        """
        self.calls += 1
        if not self.model.states:
            return self._algebraic(start, span, outputs)
        p = np.concatenate([[start.t, span], self._tail, start.d])
        steps = self.options.max_steps if patient else min(self.options.max_steps, _PANEL_STEPS)
        instance = self._instance(outputs, steps)
        # IDAS tells what went wrong on stderr; it belongs into the error, not onto the screen.
        said = io.StringIO()
        try:
            with redirect_stderr(said):
                x, z = instance(start.x, start.z, p)
        except RuntimeError as error:
            raise self._failed(start, span, f"{said.getvalue()} {error}") from None
        self._count(instance.statistics())
        x, z = x.reshape(outputs, -1).T, z.reshape(outputs, -1).T
        if not np.all(np.isfinite(x[:, -1])):
            raise self._failed(start, span, "IDA_REP_RES_ERR")
        return x, self._polish(start, span, x, z)

    def _polish(self, start: Point, span: float, x: Vector, z: Vector) -> Vector:
        """Solve for the implicit unknowns by Newton's method: IDAS gives them within its tolerance only.

        Guards on them would be located no better, and constraints would be met no better.
        """
        if not self.model.implicit:
            return z
        model, outputs = self.model, x.shape[1]
        times = start.t + span * np.arange(1, outputs + 1) / outputs
        p, u, d = (np.tile(vector, outputs) for vector in (model.p, model.u, start.d))
        fast = buffered(model._cache, ("residual", outputs), lambda: _residual_along(model, outputs))
        for _ in range(_POLISHING):
            residual, jacobian = (
                v.reshape(outputs, len(z), -1) for v in fast(times, x.ravel("F"), z.ravel("F"), p, u, d)
            )
            try:
                z = z - np.linalg.solve(jacobian.transpose(0, 2, 1), residual)[:, :, 0].T
            except np.linalg.LinAlgError:
                return z
        return z

    def _count(self, statistics: dict[str, Any]) -> None:
        self.steps += int(statistics["nsteps"])
        self.evaluations += int(statistics["nfevals"])

    def _algebraic(self, start: Point, span: float, outputs: int) -> tuple[Vector, Vector]:
        """Only implicit equations and time: solve them at each output."""
        from modelica_like.initialize import solve_implicit

        columns: list[Vector] = []
        point = start.copy()
        for k in range(1, outputs + 1):
            point.t = start.t + span * k / outputs
            solve_implicit(self.model, point)
            columns.append(point.z)
        z = np.array(columns).T if self.model.implicit else np.zeros((0, outputs))
        return np.zeros((0, outputs)), z

    def _failed(self, start: Point, span: float, text: str) -> StepFailed:
        flag = next((name for name in _FLAGS if name in text), "")
        reason = _FLAGS.get(flag, "it stopped without a known reason")
        at = re.search(r"At t = ([0-9.eE+-]+)", text)
        moment = start.t + span * float(at.group(1)) if at else start.t
        rates = call(self.model, self.model.ode, start)
        weights = self.options.rtol * np.abs(start.x) + self.options.atol * self.model.nominals
        speed = np.abs(rates) / weights
        worst = self.model.states[int(np.nanargmax(speed))] if np.any(np.isfinite(speed)) else self.model.states[0]
        return StepFailed(
            f"IDAS gave up at about t = {moment:.9g} s: {reason}{f' ({flag})' if flag else ''}.",
            why=f"{worst} changes fastest relative to its tolerance.",
            advice="Look for a stiff spring, a vanishing mass or a speed without bound; then try other tolerances.",
        )


def _residual_along(model: CompiledDae, count: int) -> ca.Function:
    """Return residuals of the implicit equations and their Jacobian at `count` times, as one function."""
    arguments = list(model.arguments.values())
    both = [model.alg(*arguments), ca.densify(model.alg_jacobian(*arguments))]
    return ca.Function("residual", arguments, both).map(count)
