"""Places inside a smooth segment at which equations change their slope: breakpoints of tables, |x|, min, max, where.

States are smooth there, their sensitivities are not: a step must end there. It also must at tops and flanks of smooth
functions that may be narrow, because it would go over them. Where rates jump without an event, the place moves with
parameters and nothing tells by how much: there is no gradient by these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.when import SAME, Coincidence
from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.edges import kinks_of
from modelica_like.errors import NoGradient
from modelica_like.language.elements import applied
from modelica_like.solve.initialize import Point, call, solve_implicit
from modelica_like.solve.initialize.slopes import Slopes, slopes
from modelica_like.solve.recorder import Segment

_DIFFERENCES = (ca.OP_LT, ca.OP_LE, ca.OP_FMIN, ca.OP_FMAX)
_ZEROS = (ca.OP_FABS, ca.OP_SIGN)
_NOISE = 1e-12
"""Rounding of a kink's argument, relative to what it is made of, where that is less than one."""
_AWAY = 10.0 ** np.arange(-12, -2)
"""Distances from a kink, relative to the time; the first one on a side counts. Where rates jump, steps end roughly, and
the cube of a distance is as good as zero long before it."""
_BESIDE = 1e-15
"""Distance of two points on both sides of a kink, relative to the time: rounding."""
_JUMP = 1e-4
"""Change of a rate between these that is no slope."""
_AT_IT = 1e-9
_NEAR, _FAR = 1e-10, 1e-6
"""Distances from a kink, relative to the time, between which a slope without bound grows by `_GROWTH` or more."""
_GROWTH, _STEEP = 10.0, 1e3
"""Least change of a rate over a time, relative to its size, that is more than rounding."""


class Kinks:
    """Functions of the state whose zeros are kinks of a model's equations.

    Args:
        model: the compiled model.
        segments: the run; the size of the functions in it sets the scale of rounding.
        integrands: of its quadratures, an SX column in the model's `arguments`.
    """

    def __init__(self, model: CompiledDae, segments: Sequence[Segment] = (), integrands: Any = None) -> None:
        self.model = model
        column = ca.SX(0, 1) if integrands is None else ca.SX(integrands)
        self._key = Cached.KINKS, str(column)
        self._function: ca.Function = model.once(self._key, lambda: _with_integrands(model, column))
        sizes: ca.Function = model.once((*self._key, "sizes"), lambda: _sizes(model, self._function))
        self.count = int(self._function.size1_out(0))
        some = segments if self.count else ()
        self._along = [(segment.times, self._over(segment, self._function)) for segment in some]
        self._zero = np.full(self.count, _NOISE)
        if some:
            largest = np.max([np.abs(values).max(axis=1) for _, values in self._along], axis=0)
            made_of = np.median(np.concatenate([self._over(segment, sizes) for segment in some], axis=1), axis=1)
            self._zero = np.maximum(_AT_IT * largest, _NOISE * np.where(made_of > 0.0, np.fmin(made_of, 1.0), 1.0))

    def at(self, point: Point) -> Vector:
        """Values at a point."""
        model = self.model
        if not self.count:
            return np.zeros(0)
        fast = model.fast(self._key, lambda: self._function)
        return fast(point.t, point.x, point.z, model.p, model.u, point.d)[0]

    def slopes(self, at: Point, number: int) -> Slopes:
        """Value, derivatives and rate of one of the functions at a point."""
        return slopes(self.model, at, self._key, [number], lambda: self._function)

    def passed(self, before: Vector, after: Vector) -> Any:
        """Which kinks lie between two points (or rows of points) or at the second, but not at the first of them.

        An event may follow so closely that its point is at the kink but for rounding: slopes there are those behind it.
        At a kink itself slopes may be those behind it, too: the last stage of a step must not be there.
        """
        zero = self._zero if before.ndim == 1 else self._zero[:, None]
        return (before * after <= 0.0) & (np.abs(before) > zero)

    def seen(self) -> Vector:
        """Times of the first results of the run behind each kink, in s."""
        times = [times[1:][self.passed(values[:, :-1], values[:, 1:]).any(axis=0)] for times, values in self._along]
        return np.concatenate([np.zeros(0), *times])

    def reached(self, begin: Vector, end: Point, last: int) -> list[int]:
        """Which kinks a step that began beside them ends at: one that it was shortened to, and those that are zero."""
        if not self.count:
            return []
        zero = (np.abs(begin) > self._zero) & (np.abs(self.at(end)) <= self._zero)
        return sorted({*np.flatnonzero(zero).tolist(), last} - {-1})

    def jump(self, at: Point, number: int, begin: Vector, integrands: Callable[[Point], Vector]) -> Coincidence | None:
        """Return how the time of a kink moves if rates or integrands jump or their slopes have no bound there, or None.

        Args:
            at: point at the kink.
            number: of the kink.
            begin: kinks at the beginning of the step that leads there.
            integrands: gives those of the quadratures at a point.

        Raises:
            NoGradient: they do where nothing tells when that is.
        """
        model = self.model
        rates = call(model, model.equations.ode, at)

        def along(time: float) -> Point:
            point = Point(at.t + time, at.x + time * rates, at.z.copy(), at.d)
            solve_implicit(model, point)
            return point

        size = max(1.0, abs(at.t))
        crossed = self._crossed(along, number, begin, size)
        if crossed is None:
            return None  # it only touches the kink

        def both(time: float) -> Vector:
            return np.append(call(model, model.equations.ode, along(time)), integrands(along(time)))

        sides = [both(time) for time in crossed]
        sizes = np.ones(len(sides[0]))
        sizes[: len(rates)] = model.equations.nominals
        jumps = np.flatnonzero(np.abs(sides[1] - sides[0]) > _JUMP * (sizes + np.abs(sides[0]) + np.abs(sides[1])))
        roots = self._roots(both, crossed, sides, size, sizes)
        if not jumps.size and not roots.size:
            return None
        reason = self._jumps(at.t, int(jumps[0])) if jumps.size else self._has_no_slope(at.t, int(roots[0]))
        kink = self.slopes(at, number)
        if not kink.rate[0]:
            raise reason  # nothing tells which parameters move it
        return Coincidence(-kink.by[0] / kink.rate[0], SAME * size, reason)

    def _jumps(self, time: float, rate: int) -> NoGradient:
        return NoGradient(
            f"No gradient at t = {time:.9g} s: {self._named(rate)} jumps without an event.",
            why="The jump moves with the parameter, and only the time of an event has a derivative.",
            advice="Let it be an event: leave out events=False, or noEvent in Modelica text. An atan2, which jumps "
            "at a half turn, makes none: keep it off that.",
        )

    def _has_no_slope(self, time: float, rate: int) -> NoGradient:
        return NoGradient(
            f"No gradient at t = {time:.9g} s: the slope of {self._named(rate)} has no bound there.",
            why="No step is short enough for the derivative of what follows.",
            advice="Round the law there, as sqrt(x) by x/(x**2 + small**2)**0.25.",
        )

    def _named(self, k: int) -> str:
        states = self.model.states
        return f"the rate of {states[k]}" if k < len(states) else "what is integrated"

    @staticmethod
    def _roots(
        both: Callable[[float], Vector], crossed: tuple[float, float], sides: list[Vector], size: float, sizes: Vector
    ) -> Any:
        """Return which rates have a slope without bound at a kink: it grows the more, the nearer to it on one side."""
        steep = np.zeros(len(sizes), bool)
        for sign, begin, value in zip((-1.0, 1.0), crossed, sides, strict=True):
            near, far = (abs(both(begin + sign * away * size) - value) / away for away in (_NEAR, _FAR))
            steep |= (near > _GROWTH * far) & (near > _STEEP * (sizes + abs(value)))
        return np.flatnonzero(steep)

    def _crossed(
        self, along: Callable[[float], Point], number: int, begin: Vector, size: float
    ) -> tuple[float, float] | None:
        """Return neighbouring times on both sides of a kink, so that what differs there jumps and is not merely steep.

        Args:
            along: gives the point at a time from the kink on, or before it.
            number: of the kink.
            begin: kinks where the step there began.
            size: of times, in s.
        """
        behind = lambda time: float(self.at(along(time))[number] * begin[number]) < 0.0  # noqa: E731
        last = next((-away for away in _AWAY * size if not behind(-away)), None)
        first = next((away for away in _AWAY * size if behind(away)), None)
        if last is None or first is None:
            return None
        while first - last > _BESIDE * size:
            middle = (last + first) / 2.0
            last, first = (last, middle) if behind(middle) else (middle, first)
        return last, first

    def _over(self, segment: Segment, function: ca.Function) -> Vector:
        """Values of a function at the results of a segment, shape (count, n)."""
        model, times = self.model, segment.times
        fixed = (np.repeat(values[:, None], len(times), axis=1) for values in (model.p, model.u, segment.d))
        return np.asarray(function(times[None, :], segment.x, segment.z, *fixed).full())


def _switches(model: CompiledDae) -> ca.Function:
    """Edges of the equations, those of smooth functions included."""
    given = list(model.arguments.values())
    return ca.Function("kinks", given, [model.edges.function(*given)[: model.edges.slopes]])


def _with_integrands(model: CompiledDae, integrands: Any) -> ca.Function:
    given, kinks = list(model.arguments.values()), kinks_of(model.arguments, integrands)
    return ca.Function("kinks", given, [ca.densify(ca.vertcat(ca.SX(0, 1), _switches(model)(*given), *kinks))])


def _sizes(model: CompiledDae, function: ca.Function) -> ca.Function:
    """Sizes of what the arguments of kinks are made of: states, at least of their nominal value, parameters, time."""
    given = model.arguments
    kinks = function(*given.values())
    least = {"x": ca.DM(model.equations.nominals), "z": 1.0}
    sizes = sum(
        (
            ca.fabs(ca.jacobian(kinks, symbol)) @ ca.fmax(ca.fabs(symbol), least.get(name, 0.0))
            for name, symbol in given.items()
            if symbol.numel()
        ),
        ca.SX(kinks.numel(), 1),
    )
    return ca.Function("sizes", list(given.values()), [ca.densify(sizes)])


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
        else:
            operands = [work[place] for place in inputs]
            value = applied(operation, operands, function)
            arguments += operands[:1] if operation in _ZEROS else []
            arguments += [operands[0] - operands[1]] if operation in _DIFFERENCES else []
        work[function.instruction_output(k)[0]] = value
    return arguments
