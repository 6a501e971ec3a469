"""Guards judged with the relations and counts that hold then, not with those that still wait for their turn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from modelica_like.compile.groups import CompiledTransition
from modelica_like.flatten.model import FlatModel


def judged_afresh(flat: FlatModel, transitions: Sequence[CompiledTransition], soon: Any) -> Any:
    """Return guards a moment later, in which relations and whole numbers are those of that moment.

    An update may move what a relation or a `floor` depends on. These follow one round later; what depends on them would
    be judged by their former values meanwhile, and change to and fro.

    Args:
        flat: the flat model.
        transitions: of all guards.
        soon: the guards, a column.
    """
    guards, values, own = ca.vertsplit(soon) if soon.numel() else [], dict[int, Any](), dict[int, int]()
    for one in transitions:
        kind = flat.discretes[one.mode].path.rpartition(".")[2].partition("[")[0]
        if one.timed or not flat.discretes[one.mode].hidden or kind not in ("relation", "floor"):
            continue
        entry, guard = one.mode if kind == "relation" else one.resets[0].index, guards[one.index]
        whole = flat.d[entry]
        # The guards of a whole number are what is above the next one, and what is missing to the present one.
        counted = whole + ca.floor(-guard) if entry in values else whole + 1 + ca.floor(guard)
        new = float(one.target) if kind == "relation" else counted
        values[entry], own[one.index] = ca.if_else(guard > 0, new, values.get(entry, whole)), entry
    needs = _needs(flat, guards, [*values], own)
    if not any(needs):
        return soon
    of_marker = {entry: set[int]().union(*(needs[k] for k, mine in own.items() if mine == entry)) for entry in values}
    done: dict[int, Any] = {}
    while ready := [entry for entry in values.keys() - done.keys() if of_marker[entry] <= done.keys()]:
        for entry in sorted(ready):  # what depends on each other in a circle stays as it is
            done[entry] = _replaced(flat, values[entry], {k: done[k] for k in of_marker[entry]})
    return ca.vertcat(
        *(
            _replaced(flat, guard, {entry: done[entry] for entry in of_guard & done.keys()})
            for guard, of_guard in zip(guards, needs, strict=True)
        )
    )


def _needs(flat: FlatModel, guards: list[Any], entries: list[int], own: dict[int, int]) -> list[set[int]]:
    """Return of which relations and whole numbers, but itself, each guard depends."""
    needs: list[set[int]] = [set() for _ in guards]
    if entries:
        sparsity = ca.jacobian_sparsity(ca.vertcat(*guards), flat.d[entries])
        for row, column in zip(*sparsity.get_triplet(), strict=True):
            needs[row] |= {entries[column]} - {own.get(row, -1)}
    return needs


def _replaced(flat: FlatModel, expression: Any, values: dict[int, Any]) -> Any:
    if not values:
        return expression
    return ca.substitute(expression, flat.d[list(values)], ca.vertcat(*values.values()))
