"""Messages about blocks of equations without a unique solution."""

from __future__ import annotations

from collections.abc import Callable, Container
from typing import Any, Protocol

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import SingularAtStart
from modelica_like.flatten.model import Origin

VANISHES = 1e-12
"""Relative determinants below which a block is singular."""
_ANOTHER = 0.7


class Place(Protocol):
    """Point where a block is singular: time, states, implicit unknowns, modes and discrete values."""

    t: float
    x: Vector
    z: Vector
    d: Vector


def singular_block(model: CompiledDae, point: Place, number: int) -> SingularAtStart:
    """Return the error for a block.

    Args:
        model: the compiled model.
        point: where it is singular.
        number: of the block among those with a determinant, from 0.
    """

    def regular(p: Vector) -> bool:
        value = model.equations.determinants(point.t, point.x, point.z, p, model.u, point.d).full()[number, 0]
        return bool(abs(value) >= VANISHES)

    return _singular(model, point, number, model.equations.singular[number], regular)


def implicit_singular(model: CompiledDae, point: Place) -> SingularAtStart:
    """Return the error for the first of the implicit blocks that is singular."""

    def jacobian(p: Vector) -> Any:
        return model.equations.alg_jacobian(point.t, point.x, point.z, p, model.u, point.d).full()

    begin, whole = 0, jacobian(model.p)
    for number, block in enumerate(model.equations.implicit_blocks):
        part = slice(begin, begin + sum(name in block[0] for name in model.implicit))
        if not is_regular(whole[part, part]):
            return _singular(model, point, number, block, lambda p, part=part: is_regular(jacobian(p)[part, part]))
        begin = part.stop
    return SingularAtStart(
        f"The equations for {', '.join(model.implicit)} have no finite value at t = {point.t:.9g} s.",
        advice="Look for a mass, inertia or ratio of zero, or a function outside its domain.",
    )


def _open(point: Place, origins: tuple[Origin, ...]) -> SingularAtStart:
    """Return the error for frictions of which nothing tells which one slides first."""
    return SingularAtStart(
        f"Which of {_and([origin.path for origin in origins])} slides first at t = {point.t:.9g} s is open.",
        where=tuple(dict.fromkeys(origin.source for origin in origins)),
        why="They stick on shafts that turn at different speeds, and the limit of each falls once it slides.",
        advice="Let the limit of one stay (peak = 1), or put a spring between them.",
    )


def _singular(
    model: CompiledDae, point: Place, number: int, block: tuple[tuple[str, ...], tuple[Origin, ...]],
    regular: Callable[[Vector], bool],
) -> SingularAtStart:  # fmt: skip
    """Return the error for a block of unknowns and origins; `regular` checks it for other parameters."""
    names, origins = block
    if not names and origins[1:]:
        return _open(point, origins)
    if not names:
        return SingularAtStart(
            f"{origins[0].path or model.name} was built for other parameters, for which other equations hold.",
            where=origins[0].source, advice="Build it with these parameters.",
        )  # fmt: skip
    owners = dict.fromkeys(origin.path for origin in origins)
    holding = [path for path in owners if _holds(model, point.d, path)]
    held = [name for name in names if name.rpartition(".")[0] in holding]
    unknowns = held if len(holding) > 1 and held else [name for name in names if name in model.implicit] or names
    why, advice = _reason(model, holding, held, alone=len(origins) == 1)
    if zeros := [] if len(holding) > 1 else _zeros(model, owners, regular):
        why = f"{_and(zeros)} {'is' if len(zeros) == 1 else 'are'} zero, so these unknowns are undetermined."
        advice = f"Give {'it' if len(zeros) == 1 else 'one of them'} another value."
    elif moved := [name for some in model.following.values() for name in some if name in unknowns]:
        advice = (
            f"At the start, give guesses of {_and(dict.fromkeys(moved))} near the motion, and start values to what "
            "moves there. On the way, the mechanism can go on in two ways from here."
        )
    shown = ", ".join(unknowns[:6]) + (", …" if len(unknowns) > 6 else "")
    return SingularAtStart(
        f"The Jacobian is singular at t = {point.t:.9g} s in block {number + 1} ({shown}).",
        where=tuple(dict.fromkeys(origin.source for origin in origins)),
        why=why,
        advice=advice,
    )


def _zeros(model: CompiledDae, owners: Container[str], regular: Callable[[Vector], bool]) -> list[str]:
    """Parameters of the components that are zero, if another value makes the block regular."""
    zeros: list[str] = []
    for k, parameter in enumerate(model.flat_parameters):
        if model.p[k] == 0.0 and parameter.path.rpartition(".")[0] in owners:
            p = model.p.copy()
            p[k] = _ANOTHER
            zeros += [parameter.path] if regular(p) else []
    return zeros


def is_regular(matrix: Any) -> bool:
    """Return whether a square matrix is finite and regular, in any units of its rows and columns."""
    if not np.isfinite(matrix).all():
        return False
    for axis in (1, 0):
        sizes = np.abs(matrix).max(axis=axis, keepdims=True, initial=0.0)
        if not sizes.all():
            return False
        matrix = matrix / sizes
    return int(np.linalg.matrix_rank(matrix)) == len(matrix)


def _holds(model: CompiledDae, d: Vector, path: str) -> bool:
    return any(hold.component == path and d[hold.mode] == hold.number for hold in model.held.motions)


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
