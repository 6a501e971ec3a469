"""Why a block of equations has no unique solution, in sentences."""

from __future__ import annotations

from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import SingularAtStart


def singular_block(model: CompiledDae, t: float, d: Vector, number: int, *, implicit: bool = False) -> SingularAtStart:
    """Return the error for one block.

    Args:
        model: the compiled model.
        t: time in s.
        d: modes and discrete values.
        number: of the block, from 0, among those with a determinant or among those that are implicit.
        implicit: which of the two.
    """
    names, origins = (model.implicit_blocks if implicit else model.singular)[number]
    owners = dict.fromkeys(origin.path for origin in origins)
    holding = [path for path in owners if _holds(model, d, path)]
    held = [name for name in names if name.rpartition(".")[0] in holding]
    told = held if len(holding) > 1 and held else [name for name in names if name in model.implicit] or names
    why, advice = _reason(model, holding, held, alone=len(origins) == 1)
    shown = ", ".join(told[:6]) + (", …" if len(told) > 6 else "")
    return SingularAtStart(
        f"The Jacobian is singular at t = {t:.9g} s in block {number + 1} ({shown}).",
        where=tuple(dict.fromkeys(origin.source for origin in origins)),
        why=why,
        advice=advice,
    )


def implicit_singular(model: CompiledDae, t: float, d: Vector, jacobian: Any) -> SingularAtStart:
    """Return the error for the first of the implicit blocks that is singular."""
    begin = 0
    for number, (names, _) in enumerate(model.implicit_blocks):
        end = begin + sum(name in names for name in model.implicit[begin:])
        inner = jacobian[begin:end, begin:end]
        if not np.all(np.isfinite(inner)) or not is_regular(inner):
            return singular_block(model, t, d, number, implicit=True)
        begin = end
    return SingularAtStart(
        f"The equations for {', '.join(model.implicit)} have no finite value at t = {t:.9g} s.",
        advice="Look for a mass, inertia or ratio of zero, or a function outside its domain.",
    )


def is_regular(matrix: Any) -> bool:
    """Tell whether a finite square matrix is regular, whatever the units of its rows and columns are."""
    for axis in (1, 0):
        sizes = np.abs(matrix).max(axis=axis, keepdims=True, initial=0.0)
        matrix = matrix / np.where(sizes > 0.0, sizes, 1.0)
    return int(np.linalg.matrix_rank(matrix)) == len(matrix)


def _holds(model: CompiledDae, d: Vector, path: str) -> bool:
    return any(one.component == path and d[one.mode] == one.number for one in model.holds)


def _reason(model: CompiledDae, holding: list[str], held: list[str], *, alone: bool) -> tuple[str, str]:
    kind = "force" if held and str(model.flat_variables[model.position[held[0]]].unit) == "N" else "torque"
    if len(holding) > 1:
        return (
            f"{_and(holding)} stick: where they hold the same motion, their {kind} split is undetermined.",
            "Give one of them a small creep, put a spring between them, or let one start open.",
        )
    if holding and alone:
        by = f" by {_and(model.motion_sources)}" if 0 < len(model.motion_sources) <= 3 else ""
        return (
            f"{holding[0]} holds a motion that is prescribed{by}: no {kind} can stop it.",
            f"Let a {kind} drive it instead, or put a spring or clutch between.",
        )
    return (
        "Its equations do not determine all of its unknowns there.",
        'Start elsewhere, or let other variables be states (state="always").',
    )


def _and(names: Any) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
