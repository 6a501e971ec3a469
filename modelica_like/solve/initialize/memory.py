"""The memory of samplers: discrete values that clocks set from the motion, and motions that depend on them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae

_NAMED = 3


def clocks(model: CompiledDae) -> dict[int, int]:
    """Return the entries of d that count the ticks of clocks, and the numbers of their new values among the resets."""
    ticks = (t.resets for t in model.events.transitions if t.timed and t.target in t.sources)
    return {reset.index: reset.value for resets in ticks for reset in resets if reset.kind == "discrete"}


def settling(model: CompiledDae) -> dict[int, int]:
    """Return the entries of d that ticks set from anything but themselves, and the rows of the updates for them.

    Numbers of ticks and random numbers never settle.
    """
    return model.once(Cached.SETTLING, lambda: _set_by_ticks(model, "xzpu"))


def memory(model: CompiledDae) -> dict[int, int]:
    """Return those entries of d that ticks set from the motion."""
    return model.once(Cached.MEMORY, lambda: _set_by_ticks(model, "xz"))


def _set_by_ticks(model: CompiledDae, arguments: str) -> dict[int, int]:
    """Return what ticks set from some arguments of the model, or from what they set from these."""
    if not (ticks := clocks(model)):
        return {}
    updates = model.events.updates
    of_d = depends(updates, "d")
    moving = np.any([depends(updates, name).any(axis=1) for name in arguments], axis=0)
    # The `pre` of a memory is that memory, before.
    rows = {
        row.reset.index: k
        for k, row in enumerate(model.events.update_rows)
        if row.reset.kind == "discrete" and of_d[k, [*ticks]].any() and not model.flat_discretes[row.reset.index].hidden
    }
    entries: dict[int, int] = {}
    while more := {e: k for e, k in rows.items() if e not in entries and (moving[k] or of_d[k, [*entries]].any())}:
        entries |= more
    return dict(sorted(entries.items()))


def depends(function: ca.Function, name: str) -> Any:
    """Return which results of a function of the model depend on which entries of an argument, as booleans."""
    pattern = function.jac_sparsity(0, function.index_in(name))
    table = np.zeros(pattern.shape, bool)
    table[pattern.row(), pattern.get_col()] = True
    return table


def driving(model: CompiledDae) -> set[int]:
    """Return the entries of d on which derivatives or implicit equations depend."""
    functions = model.equations.ode, model.equations.alg
    make = lambda: {k for function in functions for k in np.flatnonzero(depends(function, "d").any(axis=0)).tolist()}  # noqa: E731
    return model.once(Cached.DRIVING, make)


def sampled(model: CompiledDae, nodes: Iterable[int]) -> tuple[str, ...]:
    """Return the memory on which the motion, or one of some variables, depends, by path."""
    read = {*np.flatnonzero(depends(model.equations.variables, "d")[[*nodes]].any(axis=0)).tolist()}
    return tuple(model.flat_discretes[k].path for k in memory(model) if k in read | driving(model))


def listed(names: Iterable[str]) -> str:
    """Return the first names as words."""
    first = [*names]
    return " and ".join(first[:_NAMED]) + (" …" if len(first) > _NAMED else "")
