"""Parameters at kinks: an absolute value, minimum, maximum, limit or row of a table that the run never leaves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from random import Random
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from modelica_like.analyse.replay.chain import Reading, Replay
from modelica_like.analyse.replay.edges import Edge
from modelica_like.analyse.replay.kinks import arguments_of_kinks
from modelica_like.analyse.sensitivity.result import Quantity
from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached, Key
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ModelicaLikeError, NoGradient
from modelica_like.options import Options
from modelica_like.runs.readings import Output, expression_of, leaves
from modelica_like.runs.solution import Solution
from modelica_like.simulation import quick_run
from modelica_like.solve.initialize import Point
from modelica_like.solve.initialize.slopes import slopes

_STILL = 1e-9
"""Size of an argument, relative to the largest one in the run, below which it is at its kink."""
_DIGITS = 1e-13
"""The same relative to the terms whose difference it is."""
_ROUNDING = 1e-9
_STEP, _TIGHT = 1e-6, 1e-10
"""Relative change of a parameter for a difference, and the tolerance of these runs."""
_ALIKE, _STAYS = 1e-3, 0.25
"""Differences of slopes that are errors of the difference, and change of a difference of slopes that does not stay if
the parameter changes half as much: that of a kink stays, of curvature it halves, of rounding it doubles."""
_TOGETHER, _SUM_ALIKE = 16, 1e-4
"""Parameters that are changed together, and what of the sum of their derivatives is an error of the difference: a
kink of one of them that is a thousandth of its derivative stands out among as many that matter about as much."""
_SAFE, _LOOSER = 10.0, 10.0
"""Errors of states at rest in absolute tolerances; tolerances larger by the second factor show the other errors."""
_DECADES = range(-15, 16)
"""Powers of ten in SI units among which the size of a parameter that is zero is looked for."""


def kink_arguments(model: CompiledDae, outputs: Sequence[Output]) -> tuple[Key, ca.Function]:
    """Return what is zero at kinks of the equations and of outputs, and the guards, as one function, and its key."""
    given, texts = [*model.arguments.values()], _texts(outputs)

    def make() -> ca.Function:
        values = [_equations(model, texts), model.events.guards(*given)]
        arguments = {str(kink): kink for kink in arguments_of_kinks(ca.Function("equations", given, values), given)}
        # A guard at zero decides about the modes on one side, which edges judge by accelerations only.
        return ca.Function("arguments", given, [ca.densify(ca.SX(ca.vertcat(*arguments.values(), values[1])))])

    key = Cached.KINK_ARGUMENTS, texts
    return key, model.once(key, make)


def kinks_of_outputs(model: CompiledDae, outputs: Sequence[Output]) -> tuple[Key, ca.Function]:
    """Return what is zero at kinks of outputs alone, as one function, and its key."""
    given, texts = [*model.arguments.values()], _texts(outputs)

    def make() -> ca.Function:
        values = ca.SX(ca.vertcat(ca.SX(0, 1), *(expression_of(model, text)[0]() for text in texts)))
        arguments = {str(kink): kink for kink in arguments_of_kinks(ca.Function("outputs", given, [values]), given)}
        return ca.Function("arguments", given, [ca.densify(ca.SX(ca.vertcat(ca.SX(0, 1), *arguments.values())))])

    key = Cached.KINK_ARGUMENTS, ("outputs", *texts)
    return key, model.once(key, make)


def kinks(chain: Replay, outputs: Sequence[Output]) -> list[Edge]:
    """Return the arguments of operations with a kink, and the guards, that are zero all along some segments."""
    model = chain.model
    key, function = kink_arguments(model, outputs)
    if not function.size1_out(0):
        return []
    fast = model.fast(key, lambda: function)
    values = np.array([fast(n.t, n.x, n.z, model.p, model.u, n.d)[0].copy() for n in chain.nodes])
    part = slopes(model, chain.nodes[-1], key, None, lambda: function)
    end = chain.nodes[-1]
    terms = np.abs(part.by) @ np.abs(np.concatenate([end.x, model.p, model.u, end.d])) + np.abs(part.t * end.t)
    still = np.abs(values) <= np.maximum(_STILL * np.abs(values).max(axis=0), _DIGITS * terms)
    ends = [*(k for k, _ in chain.jumps), len(chain.nodes) - 1]
    begins = [0, *(k + 1 for k in ends[:-1])]
    result: list[Edge] = []
    for row in np.flatnonzero(still.any(axis=0)):
        pairs = zip(begins, ends, strict=True)
        for at_kink, group in groupby(pairs, lambda pair, row=row: bool(still[pair[0] : pair[1] + 1, row].all())):
            *_, (_, last) = group
            if at_kink:
                node = chain.nodes[last]
                part = slopes(model, node, key, [int(row)], lambda: function)
                sizes = np.abs(np.concatenate([node.x, model.p, model.u, node.d]))
                least = _ROUNDING * float(np.abs(part.by[0]) @ sizes)
                reading = Reading(float(part.value[0]), ((node, part.by[0]),))
                result.append(Edge(reading, least, NoGradient(f"{model.name} is at a kink.")))
    return result


def natural_size(chain: Replay, outputs: Sequence[Output], position: int) -> float:
    """Return the size of a parameter that is zero: what changes as much by it as by the states; inf if nothing does.

    Args:
        chain: the run.
        outputs: what is asked for.
        position: of the parameter in (p, u).
    """
    model, texts = chain.model, _texts(outputs)
    given = [*model.arguments.values()]
    fast = model.fast((Cached.SIZES, texts), lambda: ca.Function("sizes", given, [_equations(model, texts)]))
    span = chain.nodes[-1].t - chain.nodes[0].t
    x = np.max([np.abs(node.x) for node in chain.nodes], axis=0) + model.equations.nominals
    z = np.max([np.abs(node.z) for node in chain.nodes], axis=0)
    values, least, seen = np.concatenate([model.p, model.u]), np.inf, False

    def at(point: Point, dx: Vector | float = 0.0, dz: Vector | float = 0.0) -> Vector:
        p, u = np.split(values, [len(model.p)])
        return fast(point.t, point.x + dx, point.z + dz, p, u, point.d)[0]

    for point in _in_other_modes(chain, position):
        values[position] = 0.0
        here = at(point)
        sizes = np.abs(at(point, x) - here) + np.abs(at(point, dz=z) - here)
        sizes[: len(x)] += np.abs(here[: len(x)]) + x / span
        for size in (sign * 10.0**decade for decade in _DECADES for sign in (1.0, -1.0)):
            values[position] = size
            change = np.abs(at(point) - here)
            share = float(np.max(np.divide(change, sizes, out=np.zeros_like(change), where=sizes > 0.0), initial=0.0))
            seen |= bool(np.any(change))
            if np.isfinite(share) and share >= _STEP:
                least = min(least, abs(size) / share)
                break
    # What depends on nothing else has no other size.
    return 1.0 if seen and not np.isfinite(least) else least


def _in_other_modes(chain: Replay, position: int) -> Iterator[Point]:
    """Yield both ends of a run, also in all modes that guards may choose by a parameter."""
    model = chain.model
    for node in (chain.nodes[0], chain.nodes[-1]):
        yield node
        by = slopes(model, node, "guards").theta[:, position]
        for mode in {t.mode for t in model.events.transitions if not t.timed and by[t.index]}:
            for number in range(len(model.flat_discretes[mode].names)):
                other = node.copy()
                other.d[mode] = number
                yield other


def _texts(outputs: Sequence[Output]) -> tuple[str, ...]:
    return tuple(output.path for output in leaves(outputs) if output.kind not in ("time", "duration"))


def _equations(model: CompiledDae, texts: Sequence[str]) -> Any:
    """Derivatives of the states, residuals and what is asked for, as a column."""
    given = [*model.arguments.values()]
    read = (expression_of(model, text)[0]() for text in texts)
    return ca.densify(ca.SX(ca.vertcat(model.equations.ode(*given), model.equations.alg(*given), *read)))


@dataclass(frozen=True, eq=False)
class Candidate:
    """A parameter that may be at a kink.

    Attributes:
        by: the parameter.
        size: its own, or the natural one if it is zero.
        derivatives: by it, shape (outputs,).
    """

    by: Quantity
    size: float
    derivatives: Vector


@dataclass(frozen=True)
class Sides:
    """Compares derivatives with differences to both sides.

    Attributes:
        solution: the run.
        outputs: what is differentiated; of series the end.
        readings: the same, with their derivatives by the states.
        known: what was read without a change, by the factor of the tolerances.
    """

    solution: Solution
    outputs: Sequence[Output]
    readings: Sequence[Reading]
    known: dict[float, Vector | None] = field(default_factory=dict)

    def suspects(self, candidates: Sequence[Candidate]) -> Iterator[Candidate]:
        """Yield the candidates that may be at a kink: those of groups whose common change shows one.

        At a kink the derivative along a random direction is another one to at least one side.
        """
        order = sorted(candidates, key=lambda candidate: float(np.max(np.abs(candidate.derivatives)) * candidate.size))
        both = [candidate for candidate in order if self._has_both_sides(candidate)]
        yield from (candidate for candidate in order if candidate not in both)
        for first in range(0, len(both), _TOGETHER):
            yield from self._among(both[first : first + _TOGETHER])

    def remark(self, candidates: Sequence[Candidate]) -> list[str]:
        """Say of which candidates nothing is known, because the run with tight tolerances that tells has failed."""
        if not candidates or self._here(1.0) is not None:
            return []
        names = ", ".join(candidate.by.name for candidate in candidates)
        return [f"Whether {names} {'is' if len(candidates) == 1 else 'are'} at a kink is not known: a run with rtol = "
                f"{self._options(1.0).rtol:g}, which would tell, did not succeed."]  # fmt: skip

    def _among(self, group: Sequence[Candidate]) -> Iterator[Candidate]:
        if len(group) == 1:
            yield group[0]
        elif self._shows_a_kink(group):
            middle = len(group) // 2
            yield from self._among(group[:middle])
            yield from self._among(group[middle:])

    def _has_both_sides(self, candidate: Candidate) -> bool:
        try:
            for change in (_STEP, -_STEP):
                self.solution.model.with_parameters({candidate.by.name: candidate.by.value + change * candidate.size})
        except ModelicaLikeError:
            return False
        return True

    def _shows_a_kink(self, group: Sequence[Candidate]) -> bool:
        if (here := self._here(1.0)) is None:
            return True
        chance = Random(len(group))
        ways = np.array([candidate.size * chance.choice((-1.0, 1.0)) * chance.uniform(0.5, 1.0) for candidate in group])
        parts = np.array([candidate.derivatives for candidate in group]).T * ways
        allowed = _SUM_ALIKE * np.abs(parts).sum(axis=1) + self._noise(here) / _STEP
        total = parts.sum(axis=1)

        def slope(step: float) -> Vector | None:
            there = self._read(
                {candidate.by.name: candidate.by.value + step * way for candidate, way in zip(group, ways, strict=True)}
            )
            return None if there is None else (there - here) / step

        for step in (_STEP, -_STEP):
            if (side := slope(step)) is None:
                return True
            if not np.any(other := np.abs(side - total) > allowed):
                continue
            half = slope(step / 2)
            if half is None or np.any(other & (np.abs(side - half) <= _STAYS * np.abs(side - total))):
                return True
        return False

    def _noise(self, here: Vector) -> Vector:
        """Errors of what is read."""
        looser = self._here(_LOOSER)
        tolerances = _SAFE * self._options(1.0).atol * self.solution.model.equations.nominals
        rest = [sum(float(np.abs(row[: len(tolerances)]) @ tolerances) for _, row in r.parts) for r in self.readings]
        return np.array(rest) + (np.abs(here) if looser is None else np.abs(looser - here))

    def error(self, candidate: Candidate) -> NoGradient | None:
        """Return the error if the derivatives by a parameter are other ones on a side; None if they are not."""
        by, derivatives, step = candidate.by, candidate.derivatives, _STEP * candidate.size
        if (here := self._here(1.0)) is None:
            return None
        sides = [self._slopes(by, change, here) for change in (step, -step)]
        others = [_differ(side, derivatives, 0.0) for side in sides]
        if not np.any(others):
            return None
        noise = self._noise(here)
        felt, halves = np.zeros(len(here), bool), [self._slopes(by, change / 2.0, here) for change in (step, -step)]
        for side, half, other in zip(sides, halves, others, strict=True):
            stays = np.abs(side - half) <= _STAYS * np.abs(side - derivatives)
            felt |= other & _differ(side, derivatives, noise / step) & stays
        limits = [2.0 * half - side for side, half in zip(sides, halves, strict=True)]
        for k in np.flatnonzero(felt).tolist():
            right, left = ("does not exist" if np.isnan(s[k]) else f"is {s[k] + 0.0:.6g}" for s in limits)
            value = f"{by.value:g} {by.unit_text}".rstrip()
            return NoGradient(
                f"No gradient of {self.outputs[k].name} by {by.name}: {value} is at a kink.",
                why=f"In SI units the derivative above that value {right}, below it {left}.",
                advice=f"Leave out {by.name}, or move it away from there.",
            )
        return None

    def _slopes(self, by: Quantity, change: float, here: Vector) -> Vector:
        """Slopes to a side, shape (outputs,); nan if there is no run."""
        there = self._read({by.name: by.value + change})
        return np.full(len(here), np.nan) if there is None else (there - here) / change

    def _options(self, looser: float) -> Options:
        options = self.solution.options
        rtol, atol = min(options.rtol, _TIGHT), min(options.atol, _TIGHT / 100)
        return replace(options, rtol=looser * rtol, atol=looser * atol, on_energy_drift="off")

    def _here(self, looser: float) -> Vector | None:
        if looser not in self.known:
            self.known[looser] = self._read({}, looser)
        return self.known[looser]

    def _read(self, parameters: dict[str, float], looser: float = 1.0) -> Vector | None:
        run, options = self.solution, self._options(looser)
        names = [output.path if output.kind == "series" else output.name for output in self.outputs]
        try:
            readings = quick_run(
                run.model, float(run.time[-1]), t0=float(run.time[0]), start=run.start, options=options,
                parameters=parameters, readings=names, rtol=options.rtol, atol=options.atol,
            )  # fmt: skip
        except ModelicaLikeError:
            return None
        return np.array(readings.read(*names), float)


def _differ(sides: Vector, derivatives: Vector, noise: Vector | float) -> NDArray[np.bool_]:
    """Which slopes are others than the derivatives; a side without a run has none."""
    alike = _ALIKE * np.maximum(np.abs(sides), np.abs(derivatives)) + noise
    return np.abs(sides - derivatives) > alike
