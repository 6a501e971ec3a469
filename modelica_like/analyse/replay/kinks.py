"""Places inside a smooth segment at which equations change their slope: breakpoints of tables, |x|, min, max, where.

States are smooth there, their sensitivities are not: a step must end there. It also must at tops and flanks of smooth
functions that may be narrow, because it would go over them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.solve.initialize import Point
from modelica_like.solve.recorder import Segment

_DIFFERENCES = (ca.OP_LT, ca.OP_LE, ca.OP_FMIN, ca.OP_FMAX)
_ZEROS = (ca.OP_FABS, ca.OP_SIGN)
_NOISE = 1e-12
_AT_IT = 1e-9


class Kinks:
    """Functions of the state whose zeros are kinks of a model's equations.

    Args:
        model: the compiled model.
        segments: the run; the size of the functions in it sets the scale of rounding.
    """

    def __init__(self, model: CompiledDae, segments: Sequence[Segment] = ()) -> None:
        self.model = model
        self._function: ca.Function = model.once("kinks", lambda: _switches(model))
        self.count = int(self._function.size1_out(0))
        self._along = [(segment.times, self._over(segment)) for segment in segments if self.count]
        largest = [np.abs(values).max(axis=1) for _, values in self._along]
        self._zero = np.maximum(_AT_IT * np.max(largest, axis=0), _NOISE) if largest else np.full(self.count, _NOISE)

    def at(self, point: Point) -> Vector:
        """Values at a point."""
        model = self.model
        if not self.count:
            return np.zeros(0)
        fast = model.fast("kinks along", lambda: self._function)
        return fast(point.t, point.x, point.z, model.p, model.u, point.d)[0]

    def passed(self, before: Vector, after: Vector) -> Any:
        """Which kinks lie between two points (or rows of points), but not at the first of them.

        An event may follow so closely that its point is at the kink but for rounding: slopes there are those behind it.
        """
        zero = self._zero if before.ndim == 1 else self._zero[:, None]
        return (before * after < 0.0) & (np.abs(before) > zero)

    def seen(self) -> Vector:
        """Times of the first results of the run behind each kink, in s."""
        times = [times[1:][self.passed(values[:, :-1], values[:, 1:]).any(axis=0)] for times, values in self._along]
        return np.concatenate([np.zeros(0), *times])

    def _over(self, segment: Segment) -> Vector:
        """Values at the results of a segment, shape (count, n)."""
        model, times = self.model, segment.times
        fixed = (np.repeat(values[:, None], len(times), axis=1) for values in (model.p, model.u, segment.d))
        return np.asarray(self._function(times[None, :], segment.x, segment.z, *fixed).full())


def _switches(model: CompiledDae) -> ca.Function:
    """Arguments of operations with a kink, if they change during a segment, and edges of smooth functions."""
    given = list(model.arguments.values())
    equations = ca.Function("equations", given, [model.ode(*given), model.alg(*given)])
    places: dict[str, Any] = {}
    if any(equations.instruction_id(k) in (*_DIFFERENCES, *_ZEROS) for k in range(equations.n_instructions())):
        moving = ca.vertcat(*(model.arguments[name] for name in "txz"))
        for one in arguments_of_kinks(equations, given):
            if ca.depends_on(one, moving):
                places.setdefault(str(one), one)
    edges = model.edges
    smooth = edges.function(*given)[edges.kinks : edges.slopes] if edges.kinks < edges.slopes else ca.SX(0, 1)
    return ca.Function("kinks", given, [ca.densify(ca.vertcat(ca.SX(0, 1), *places.values(), smooth))])


def arguments_of_kinks(function: ca.Function, given: list[Any]) -> list[Any]:
    """Return the arguments of the operations with a kink in a function: it is evaluated by its instructions."""
    work: dict[int, Any] = {}
    arguments: list[Any] = []
    for k in range(function.n_instructions()):
        operation, inputs = function.instruction_id(k), function.instruction_input(k)
        if operation == ca.OP_OUTPUT:
            continue
        if operation == ca.OP_INPUT:
            value = given[inputs[0]].nz[inputs[1]]
        elif operation == ca.OP_CONST:
            value = ca.SX(function.instruction_constant(k))
        elif len(inputs) == 1:
            value = ca.SX.unary(operation, work[inputs[0]])
            arguments += [work[inputs[0]]] if operation in _ZEROS else []
        else:
            value = ca.SX.binary(operation, work[inputs[0]], work[inputs[1]])
            arguments += [work[inputs[0]] - work[inputs[1]]] if operation in _DIFFERENCES else []
        work[function.instruction_output(k)[0]] = value
    return arguments
