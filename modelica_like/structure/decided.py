"""Parameters that change the structure: losses that may be none, and then leave a variable out.

`i == if_(P > 0, G * v, 0)` is an equation for v where there are losses. Where there are none, v is determined
elsewhere, or two currents are one: then the branch is taken while the model is built, and the built model holds for
parameters that leave it as it is. So it is with parameters that are zero, as C in `i == C * der(v)`, and with what is
zero by these.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from modelica_like.flatten.generic import spread
from modelica_like.flatten.steps import is_trace
from modelica_like.language.elements import rebuilt
from modelica_like.language.expr import operands
from modelica_like.structure.system import System

_POINTS = 32
"""At which parameters of either sign are looked at: a condition on one or two is false at some of them."""

Place = tuple[int, int]


def vanishing(jacobian: Any) -> set[Place]:
    """Return the places of entries that a condition may make zero."""
    function = ca.Function("slopes", [], [jacobian.nz[:]], {"allow_free": True})
    if all(function.instruction_id(k) != ca.OP_IF_ELSE_ZERO for k in range(function.n_instructions())):
        return set()
    symbols = ca.vertcat(*ca.symvar(jacobian))
    points = spread(-1.0, 1.0, (symbols.numel(), _POINTS))
    values = ca.Function("slopes", [symbols], [jacobian.nz[:]]).map(_POINTS)(points).full()
    places = zip(*jacobian.sparsity().get_triplet(), strict=True)
    return {place for place, row in zip(places, values, strict=True) if (row == 0).any()}


def needs_decision(system: System, residual: Any, unknowns: list[int]) -> bool:
    """Return whether equations determine unknowns for other parameters only: what they need is zero for these."""
    jacobian = ca.jacobian(residual, system.column(unknowns))
    lost = _lost(system, jacobian)
    rates = any(system.levels[unknowns[column]].order for _, column in lost)
    if rates and (left_out := _left_out(system, unknowns)) and _rank(jacobian, lost | left_out) < len(unknowns):
        return True
    lost &= vanishing(jacobian) if lost else lost
    return bool(lost) and _rank(jacobian, lost) < len(unknowns)


def _rank(jacobian: Any, lost: set[Place]) -> int:
    """Return how many unknowns equations can determine without some entries."""
    kept = [place for place in zip(*jacobian.sparsity().get_triplet(), strict=True) if place not in lost]
    pattern = ca.Sparsity.triplet(*jacobian.shape, [row for row, _ in kept], [column for _, column in kept])
    return ca.sprank(ca.DM(pattern, 1))


def _left_out(system: System, unknowns: list[int]) -> set[Place]:
    """Return the places of unknowns that zeros leave out of equations, unless one says nothing then."""
    before, after = (_entries(r, system.everything) for r in (system.residual, _without_zeros(system)[0]))
    column = {level: k for k, level in enumerate(unknowns)}
    pairs = enumerate(zip(before, after, strict=True)) if all(after) else ()
    return {(row, column[k]) for row, (old, new) in pairs for k in {*old} - {*new} if k in column}


def decide(system: System) -> list[tuple[int, Any]]:
    """Take the branches of present parameters in the equations that lose a variable by them.

    Returns:
        Number of the equation, and what is 1 where parameters take the same branch, else 0.
    """
    system.residual, checks = _without_zeros(system)
    rows = ca.vertsplit(system.residual)
    jacobian = ca.jacobian(system.residual, system.everything)
    places = vanishing(jacobian)
    for row in sorted({row for row, _ in places and places & _lost(system, jacobian)}):
        branches = _Branches(system)
        rows[row] = branches.write(rows[row])
        checks += [(row, condition) for condition in branches.conditions]
    system.residual = ca.vertcat(*rows)
    return checks


def _without_zeros(system: System) -> tuple[Any, list[tuple[int, Any]]]:
    """Return the equations without the variables that parameters leave out which are zero, and what keeps them so."""
    p, levels = system.model.p, system.everything
    zeros = ca.vertcat(*(p[k] for k, parameter in enumerate(system.model.parameters) if parameter.value == 0))
    if not zeros.numel():
        return system.residual, []
    before = _entries(system.residual, levels)
    causes = [set(columns) for columns in _entries(system.residual, zeros)]
    residual, known = ca.substitute(system.residual, zeros, ca.SX.zeros(zeros.numel())), dict[int, int]()
    while new := _zero_by(residual, levels, causes, known):
        uses = _entries(residual, levels)
        own = {row: levels[k] for k, row in {**known, **new}.items()}
        residual = ca.substitute(residual, ca.vertcat(*(levels[k] for k in new)), ca.SX.zeros(len(new)))
        for row, columns in enumerate(uses):
            causes[row] |= {cause for k in new.keys() & {*columns} for cause in causes[new[k]]}
        for row, value in own.items():
            residual[row] = value
        known |= new
    changed = [row for row, columns in enumerate(_entries(residual, levels)) if columns != before[row]]
    rows = ca.vertsplit(system.residual)
    for row in changed:
        rows[row] = residual[row]
    return ca.vertcat(*rows), [(row, zeros[k] == 0) for row in changed for k in sorted(causes[row])]


def _zero_by(residual: Any, levels: Any, causes: list[set[int]], known: dict[int, int]) -> dict[int, int]:
    """Return variables that their equation alone says to be zero, by such parameters, with the number of that."""
    plain = ca.vertcat(*(_Plain().write(row) if causes[k] else row for k, row in enumerate(ca.vertsplit(residual))))
    alone = {columns[0]: row for row, columns in enumerate(_entries(plain, levels)) if len(columns) == 1}
    return {
        k: row
        for k, row in alone.items()
        if causes[row] and k not in known
        and ca.substitute(plain[row], levels[k], ca.SX(0)).is_zero()
        and ca.jacobian(plain[row], levels[k]).is_constant()
    }  # fmt: skip


def _entries(expressions: Any, symbols: Any) -> list[list[int]]:
    """Return the numbers of the symbols in each expression."""
    columns: list[list[int]] = [[] for _ in range(expressions.numel())]
    for row, column in zip(*ca.jacobian_sparsity(expressions, symbols).get_triplet(), strict=True):
        columns[row].append(column)
    return columns


def _lost(system: System, jacobian: Any) -> set[Place]:
    """Return the places of entries that parameters alone decide, and that are zero."""
    zero = np.array(system.generic(jacobian.nz[:])).ravel() == 0
    if not any(zero):
        return set()
    moving = ca.which_depends(jacobian.nz[:], system.volatile, 1, True)
    every = zip(*jacobian.sparsity().get_triplet(), moving, zero, strict=True)
    return {(row, column) for row, column, moves, nothing in every if nothing and not moves}


class _Plain:
    """Writes an expression anew, without what only shows that it depends on something."""

    def __init__(self) -> None:
        self._known = dict[int, tuple[Any, Any]]()

    def write(self, root: Any) -> Any:
        """Return the expression."""
        pending = [root]
        while pending:
            node = pending.pop()
            if node.element_hash() in self._known:
                continue
            parts = operands(node)
            if missing := [part for part in parts if part.element_hash() not in self._known]:
                pending += [node, *missing]
            else:  # with the node, so that no other one can get its identity
                new = self._written(node, [self._known[part.element_hash()][1] for part in parts])
                self._known[node.element_hash()] = node, new
        return self._known[root.element_hash()][1]

    def _written(self, node: Any, parts: list[Any]) -> Any:
        if is_trace(node):
            return ca.SX(0)
        if not parts:
            return node
        return ca.SX.unary(node.op(), *parts) if len(parts) == 1 else ca.SX.binary(node.op(), *parts)


class _Branches(_Plain):
    """Writes an expression anew, with the branches that parameters choose."""

    def __init__(self, system: System) -> None:
        super().__init__()
        self._system = system
        self.conditions: list[Any] = []

    def _written(self, node: Any, parts: list[Any]) -> Any:
        if not parts:
            return node
        if node.op() == ca.OP_IF_ELSE_ZERO and not ca.depends_on(parts[0], self._system.volatile):
            if parts[0].is_constant():
                return parts[1] if float(parts[0]) else ca.SX(0)
            holds = bool(float(self._system.generic(parts[0])))
            self.conditions.append(parts[0] if holds else ca.logic_not(parts[0]))
            return parts[1] if holds else ca.SX(0)
        return rebuilt(node, parts)
