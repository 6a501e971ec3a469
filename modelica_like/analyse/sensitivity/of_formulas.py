"""Formulas of numbers of a run, such as `a.loss_energy + b.loss_energy`, with their derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.chain import Reading
from modelica_like.analyse.replay.edges import Edge
from modelica_like.analyse.replay.kinks import arguments_of_kinks
from modelica_like.compile.buffers import Vector
from modelica_like.errors import NoGradient
from modelica_like.runs.readings import Output, by_output

_ROUNDING = 1e-9


def formulas(outputs: Sequence[Output], parts: Sequence[Reading]) -> list[Reading]:
    """Return the readings of outputs from those of their leaves."""
    result: list[Reading] = []
    for output, of in zip(outputs, by_output(outputs, parts), strict=True):
        if output.operands:
            value, slopes = (result.full()[0] for result in output.formula()(_values(of)))
            result.append(_chained(float(value[0]), slopes, of))
        else:
            result.append(of[0])
    return result


def formula_kinks(outputs: Sequence[Output], parts: Sequence[Reading]) -> Iterator[Edge]:
    """Yield the arguments of operations with a kink in formulas: min(a.loss_energy, b.loss_energy) of equal ones."""
    for output, of in zip(outputs, by_output(outputs, parts), strict=True):
        column = ca.SX.sym("operands", len(of))
        kinks = arguments_of_kinks(output.formula(), [column]) if output.operands else []
        for kink in kinks:
            function = ca.Function("kink", [column], [kink, ca.densify(ca.jacobian(kink, column))])
            value, slopes = (result.full()[0] for result in function(_values(of)))
            error = NoGradient(
                f"No gradient of {output.name}: its formula is at a kink.",
                why="The derivatives on both sides differ.",
                advice="Move the parameters away from there.",
            )
            least = _ROUNDING * float(np.abs(slopes) @ np.abs(_values(of)))
            yield Edge(_chained(float(value[0]), slopes, of), least, error)


def _values(parts: Sequence[Reading]) -> Vector:
    return np.array([part.value for part in parts])


def _chained(value: float, slopes: Vector, parts: Sequence[Reading]) -> Reading:
    """Return a number by the chain rule, from its derivatives by readings."""
    pairs = [*zip(slopes.tolist(), parts, strict=True)]
    moved = tuple((node, slope * by) for slope, part in pairs for node, by in part.parts)
    integrals = [slope * part.quadratures for slope, part in pairs if part.quadratures.size]
    return Reading(value, moved, np.sum(integrals, axis=0)) if integrals else Reading(value, moved)
