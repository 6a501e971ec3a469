"""Conditions on parameters that change the structure: losses that may be none, and then leave a variable out.

`i == if_(P > 0, G * v, 0)` is an equation for v where there are losses. Where there are none, v is determined
elsewhere, or two currents are one: then the branch is taken while the model is built, and the built model holds for
parameters that leave it as it is.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from modelica_like.flatten.generic import spread
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
    if not lost:
        return False
    kept = [place for place in zip(*jacobian.sparsity().get_triplet(), strict=True) if place not in lost]
    pattern = ca.Sparsity.triplet(*jacobian.shape, *map(list, zip(*kept, strict=True)))
    return ca.sprank(ca.DM(pattern, 1)) < len(unknowns)


def decide(system: System) -> list[tuple[int, Any]]:
    """Take the branches of present parameters in the equations that lose a variable by them.

    Returns:
        Number of the equation, and what is 1 where parameters take the same branch, else 0.
    """
    rows, checks = ca.vertsplit(system.residual), list[tuple[int, Any]]()
    for row in sorted({row for row, _ in _lost(system, ca.jacobian(system.residual, system.everything))}):
        rows[row], conditions = _Branches(system).write(rows[row])
        checks += [(row, condition) for condition in conditions]
    system.residual = ca.vertcat(*rows)
    return checks


def _lost(system: System, jacobian: Any) -> set[Place]:
    """Return the places of entries that parameters alone decide, and that are zero."""
    places = vanishing(jacobian)
    if not places:
        return set()
    moving = ca.which_depends(jacobian.nz[:], system.volatile, 1, True)
    zero = np.array(system.generic(jacobian.nz[:])).ravel() == 0
    every = zip(*jacobian.sparsity().get_triplet(), moving, zero, strict=True)
    return {(row, column) for row, column, moves, nothing in every if nothing and not moves} & places


class _Branches:
    """Writes an expression anew, with the branches that parameters choose."""

    def __init__(self, system: System) -> None:
        self._system, self._known, self._conditions = system, dict[int, tuple[Any, Any]](), list[Any]()

    def write(self, root: Any) -> tuple[Any, list[Any]]:
        """Return the expression, and the conditions that must stay true."""
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
        return self._known[root.element_hash()][1], self._conditions

    def _written(self, node: Any, parts: list[Any]) -> Any:
        if not parts:
            return node
        if node.op() == ca.OP_IF_ELSE_ZERO and not ca.depends_on(parts[0], self._system.volatile):
            if parts[0].is_constant():
                return parts[1] if float(parts[0]) else ca.SX(0)
            holds = bool(float(self._system.generic(parts[0])))
            self._conditions.append(parts[0] if holds else ca.logic_not(parts[0]))
            return parts[1] if holds else ca.SX(0)
        return rebuilt(node, parts)
