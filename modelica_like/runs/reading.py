"""Reads requested variables along a run, in blocks of bounded size."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from threading import get_ident
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Along
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.solve.recorder import Segment

_BLOCK = 65_536
"""Results in a block."""
TOGETHER = 2**20
"""Largest count of numbers for which all variables of a run are read together."""

Block = tuple[Vector, Vector, Vector, Vector]
"""Times (n,), states (nx, n), implicit unknowns (nz, n), modes and discrete values (nd, n)."""


def blocks(segments: Sequence[Segment]) -> Iterator[Block]:
    """Yield the results of a run in blocks."""
    held: list[tuple[Segment, slice]] = []
    count = 0
    for segment in segments:
        for first in range(0, len(segment.times), _BLOCK):
            part = slice(first, min(first + _BLOCK, len(segment.times)))
            if count + part.stop - first > _BLOCK:
                yield _merged(held)
                held, count = [], 0
            held.append((segment, part))
            count += part.stop - first
    yield _merged(held)


def _merged(held: list[tuple[Segment, slice]]) -> Block:
    if len(held) == 1:
        segment, part = held[0]
        d = np.broadcast_to(segment.d[:, None], (len(segment.d), part.stop - part.start))
        return segment.times[part], segment.x[:, part], segment.z[:, part], d
    sizes = [part.stop - part.start for _, part in held]
    return (
        np.concatenate([segment.times[part] for segment, part in held]),
        np.concatenate([segment.x[:, part] for segment, part in held], axis=1),
        np.concatenate([segment.z[:, part] for segment, part in held], axis=1),
        np.repeat(np.array([segment.d for segment, _ in held]).T, sizes, axis=1),
    )


def variables(model: CompiledDae, segments: Sequence[Segment], rows: Sequence[int] | None) -> Vector:
    """Evaluate variables at all results, shape (rows, n).

    Args:
        model: the compiled model.
        segments: of a run.
        rows: positions of the variables; all if None.
    """
    if rows is None:
        function = model.along(Cached.VARIABLES, lambda: model.equations.variables)
        parts = [function(t, x, z, model.p, model.u, d)[0] for t, x, z, d in blocks(segments)]
        return np.concatenate(parts, axis=1)
    return _Expressions.of(model, Cached.VARIABLES, model.equations.variables, tuple(rows)).read(model, segments)


def rate_along(model: CompiledDae, segments: Sequence[Segment], row: int) -> Vector:
    """Return the time derivative of one variable at all results, with the inputs held.

    Args:
        model: the compiled model.
        segments: of a run.
        row: position of the variable.

    Returns:
        Shape (n,), in the variable's unit per second.
    """
    whole = _Expressions.whole(model, Cached.VARIABLES, model.equations.variables)
    motion, size = model.once(Cached.MOTION, lambda: model.motion), len(model.implicit)

    def make() -> _Expressions:
        return _Expressions(model, ca.vertcat(*(ca.vec(ca.densify(part)) for part in motion.parts(whole[row]))))

    values = model.once((Cached.RATE, get_ident(), row), make).read(model, segments)
    if not size:
        return values[0]
    direct, by_z, drift, jacobian = np.split(values, np.cumsum([1, size, size]))
    slopes = jacobian.T.reshape(-1, size, size).transpose(0, 2, 1)
    z_rates = -np.linalg.solve(slopes, drift.T[:, :, None])[:, :, 0]
    return direct[0] + np.sum(by_z.T * z_rates, axis=1)


def energy_term(model: CompiledDae, segments: Sequence[Segment], component: int, column: int) -> Vector:
    """Evaluate one energy term of one component at all results, shape (n,)."""
    row = component + column * len(model.components)
    return _Expressions.of(model, Cached.ENERGY, model.energy, (row,)).read(model, segments)[0]


class _Expressions:
    """Some results of a function of the model, as a function of their arguments only."""

    def __init__(self, model: CompiledDae, results: Any) -> None:
        self._needed: list[list[int]] = [[] for _ in model.arguments]
        for number, row in sorted(model.symbol_places[symbol.element_hash()] for symbol in ca.symvar(results)):
            self._needed[number].append(row)
        given = zip(model.arguments.values(), self._needed, strict=True)
        arguments = [argument[rows] if rows else ca.SX(0, 1) for argument, rows in given]
        self._function = Along(ca.Function("read", arguments, [ca.densify(results)], {"cse": True}))

    @staticmethod
    def of(model: CompiledDae, which: Cached, function: ca.Function, rows: tuple[int, ...]) -> _Expressions:
        whole = _Expressions.whole(model, which, function)
        return model.once((Cached.ROWS, get_ident(), which, rows), lambda: _Expressions(model, whole[list(rows)]))

    @staticmethod
    def whole(model: CompiledDae, which: Cached, function: ca.Function) -> Any:
        """Return all results of a function."""
        return model.once((Cached.COLUMN, which), lambda: ca.vec(function(*model.arguments.values())))

    def read(self, model: CompiledDae, segments: Sequence[Segment]) -> Vector:
        t, x, z, p, u, d = self._needed
        values = np.empty((self._function.rows[0], sum(len(segment.times) for segment in segments)))
        first = 0
        for times, states, unknowns, discretes in blocks(segments):
            last = first + len(times)
            now = times if t else times[:0]
            self._function.into(
                [values[:, first:last]], now, states[x], unknowns[z], model.p[p], model.u[u], discretes[d]
            )
            first = last
        return values
