"""Discrete equations of a whole model, in an order in which each uses the new values of the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledUpdate, Reset
from modelica_like.errors import Source, StructureError
from modelica_like.flatten.model import FlatModel, evaluate
from modelica_like.language.elements import inserted
from modelica_like.structure.reduce import ReducedDae

_ALWAYS: Any = ca.SX(1)


@dataclass(eq=False)
class _Row:
    """A new value: what gets it, whether it does, the value, what it keeps otherwise, and the entry in d, if any."""

    update: CompiledUpdate
    path: str
    active: Any
    value: Any
    kept: Any
    entry: int | None


def updates(
    reduced: ReducedDae,
    resets: Callable[[str, int], list[Reset]],
    keeping: Callable[[str], list[Any]],
    delayed: Sequence[int] = (),
) -> tuple[Any, tuple[CompiledUpdate, ...]]:
    """Return what discrete variables, and variables set by a `when`, become in one iteration of an event.

    Discrete variables in it are the new ones, except in `pre(…)`. What is not set keeps its value; for variables that
    are not discrete, infinity says so.

    Args:
        reduced: the reduced system.
        resets: gives what is set, for its path and the number of the update, and what keeps its value then.
        keeping: gives the values of the latter.
        delayed: entries of d that are delayed values at the start.

    Raises:
        StructureError: discrete variables depend on each other in a loop.
    """
    flat = reduced.flat
    rows = _rows(reduced, resets, keeping)
    discrete = [row for row in rows if row.entry is not None]
    old = {row.entry: row.kept for row in discrete}
    before = [(flat.d[k], old[of if of in old else k]) for k, of in flat.pres.items()]
    lefts = _replaced([reduced.values[node] for node in flat.lefts.values()], _begun(flat, old))
    before += [(flat.d[k], value) for k, value in zip(flat.lefts, lefts, strict=True)]
    values = _replaced([ca.if_else(row.active, row.value, row.kept) for row in (*discrete, *rows)], before)
    values, results = values[: len(discrete)], values[len(discrete) :]
    symbols = [flat.d[row.entry] for row in discrete]
    _solve_delays([k for k, row in enumerate(discrete) if row.entry in delayed], symbols, values)
    order = _order(flat, discrete, symbols, values)
    if order:
        results = inserted([symbols[k] for k in order], [values[k] for k in order], results)
    results = _replaced(results, [(symbol, flat.d[entry]) for entry, symbol in old.items()])
    return ca.vertcat(*results), tuple(row.update for row in rows)


def _begun(flat: FlatModel, old: dict[int | None, Any]) -> list[tuple[Any, Any]]:
    """Return discrete values and modes with what they were before: where a run begins, modes are what they are."""
    if not flat.lefts:
        return []
    starts = next(old[k] for k, of in flat.pres.items() if k == of)
    begun = {of: old[of] if of in old else ca.if_else(starts, flat.d[of], old[k]) for k, of in flat.pres.items()}
    return [(flat.d[of], value) for of, value in begun.items()]


def _solve_delays(those: list[int], symbols: list[Any], values: list[Any]) -> None:
    """Solve for delayed values at the start that depend on each other linearly, as in z == u + a * delay(z, T)."""
    unknowns, new = ca.vertcat(*(symbols[k] for k in those)), ca.vertcat(*(values[k] for k in those))
    if not those or not ca.depends_on(new, unknowns) or any(ca.which_depends(new, unknowns, 2, True)):
        return
    others = ca.substitute(new, unknowns, ca.SX.zeros(unknowns.shape))
    solved = ca.solve(ca.SX.eye(len(those)) - ca.jacobian(new, unknowns), others)
    for k, solution in zip(those, ca.vertsplit(solved), strict=True):
        values[k] = solution


def _rows(
    reduced: ReducedDae, resets: Callable[[str, int], list[Reset]], keeping: Callable[[str], list[Any]]
) -> list[_Row]:
    """All updates, those of `pre` without an equation and of `initial()` last."""
    flat = reduced.flat
    columns = evaluate(flat, "updates", reduced.values)
    rows: list[_Row] = []

    def add(path: str, active: Any, value: Any, source: Source, at_start: bool) -> None:
        for target, new in zip(resets(path, len(rows)), [value, *keeping(path)], strict=True):
            entry = target.index if target.kind == "discrete" else None
            kept = ca.SX(np.inf) if entry is None else ca.SX.sym("old")
            rows.append(_Row(CompiledUpdate(target, at_start, source), path, active, new, kept, entry))

    for number, instance in enumerate(flat.instances):
        prefix = f"{instance.path}." if instance.path else ""
        for row, form in enumerate(instance.template.update_forms):
            parts = columns[number][2 * row : 2 * row + 2]
            add(prefix + form.target, parts[0], parts[1], form.source, form.at_start)
    determined = {row.entry for row in rows}
    for k, of in flat.pres.items():
        if k == of or of not in determined:
            add(flat.discretes[k].path, _ALWAYS, ca.SX(0) if k == of else flat.d[of], Source(""), False)
    return rows


def _replaced(expressions: Sequence[Any], pairs: Sequence[tuple[Any, Any]]) -> list[Any]:
    if not expressions or not pairs:
        return [*expressions]
    olds, news = zip(*pairs, strict=True)
    return ca.vertsplit(ca.substitute(ca.vertcat(*expressions), ca.vertcat(*olds), ca.vertcat(*news)))


def _order(flat: FlatModel, rows: list[_Row], symbols: list[Any], values: list[Any]) -> list[int]:
    """Return an order in which every row comes after those that it depends on.

    Raises:
        StructureError: there is none.
    """
    if not rows:
        return []
    needs: list[set[int]] = [set() for _ in rows]
    for row, column in zip(*ca.jacobian_sparsity(ca.vertcat(*values), ca.vertcat(*symbols)).get_triplet(), strict=True):
        needs[row].add(column)
    order: list[int] = []
    left = set(range(len(rows)))
    while left:
        ready = sorted(k for k in left if not needs[k] & left)
        if not ready:
            raise _loop(flat, rows, needs, left)
        order += ready
        left -= {*ready}
    return order


def _loop(flat: FlatModel, rows: list[_Row], needs: list[set[int]], left: set[int]) -> StructureError:
    """Return the error of discrete variables that depend on each other."""
    way = [min(left)]
    while way[-1] not in way[:-1]:
        way.append(min(needs[way[-1]] & left))
    way = way[way.index(way[-1]) :]
    where = [*dict.fromkeys(rows[k].update.source for k in way if rows[k].update.source.file)]
    if any("delay[" in rows[k].path for k in way):
        what = "Before the start, a delayed value is the one at the start, which depends on itself here."
        advice = "Delay a state, or what follows from the delayed value linearly."
        return StructureError(what, where=where, advice=advice)
    loop = [rows[k].path for k in reversed(way[1:]) if not flat.discretes[cast(int, rows[k].entry)].hidden]
    return StructureError(
        f"{loop[0]} determines itself at an event." if len(loop) == 1
        else f"Discrete variables determine each other in a loop: {' → '.join([*loop, loop[0]])}.",
        where=where,
        advice="Use a value from before the event, pre(…), at one place of the loop.",
    )  # fmt: skip
