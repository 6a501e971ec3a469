"""Solve one equation for one unknown by undoing operations from the outside inwards."""

from __future__ import annotations

from typing import Any

import casadi as ca

from modelica_like.language.expr import leaf_id

_MAX_NODES = 60
_ZERO = ca.SX(0)

# The operators `+ - * /` of casadi.SX try other types first, which takes four times as long as the operation itself.
_binary = ca.SX.binary


def isolate(residual: Any, unknown: Any) -> Any | None:
    """Return the expression of `unknown` that makes `residual` zero.

    Only an unknown that occurs once, under sums, signs and products with expressions of other symbols, is isolated; it
    keeps the author's arithmetic. None if that is not possible.
    """
    trail = _find(residual, leaf_id(unknown))
    return None if trail is None or any(_inverts(*step) for step in trail) else _undone(trail)


def _undone(trail: list[tuple[Any, int]]) -> Any | None:
    """Return the expression of what stands at the end of a way, where its begin is zero."""
    result: Any = _ZERO
    for node, position in trail:
        result = _undo(node, position, result)
        if result is None:
            return None
    return result


def isolate_inverse(residual: Any, unknown: Any) -> Any | None:
    """Return the expression of an unknown that occurs once, in a denominator under sums and signs only.

    So `R == 1/G` gives G = 1/R from no guess; where R is zero, it has no solution. None for all other equations.
    """
    trail = _find(residual, leaf_id(unknown))
    if trail is None or not any(_inverts(*step) for step in trail):
        return None
    plain = (ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_TWICE)
    return _undone(trail) if all(step[0].op() in plain or _inverts(*step) for step in trail) else None


def _inverts(node: Any, position: int) -> bool:
    return node.op() == ca.OP_INV or (node.op() == ca.OP_DIV and position == 1)


def _find(root: Any, target: int) -> list[tuple[Any, int]] | None:
    """Return the way from the root to the only occurrence: pairs of a node and the operand to go to."""
    path: list[tuple[Any, int]] | None = None
    pending: list[tuple[Any, list[tuple[Any, int]]]] = [(root, [])]
    for _ in range(_MAX_NODES):
        if not pending:
            return path
        node, trail = pending.pop()
        if node.element_hash() == target:
            if path is not None:
                return None
            path = trail
            continue
        for position in range(node.n_dep()):
            pending.append((node.dep(position), [*trail, (node, position)]))
    return None


def _undo(node: Any, position: int, value: Any) -> Any | None:
    """Solve `node == value` for the operand at `position`."""
    operation = node.op()
    if operation == ca.OP_NEG:
        return -value
    if operation == ca.OP_TWICE:
        return value / 2
    if operation == ca.OP_INV:
        return 1 / value
    other = node.dep(1 - position) if node.n_dep() == 2 else None
    if operation == ca.OP_ADD:
        return _binary(ca.OP_SUB, value, other)
    if operation == ca.OP_SUB:
        return _binary(ca.OP_ADD, value, other) if position == 0 else _binary(ca.OP_SUB, other, value)
    if operation == ca.OP_MUL:
        return _binary(ca.OP_DIV, value, other)
    if operation == ca.OP_DIV:
        return _binary(ca.OP_MUL, value, other) if position == 0 else _binary(ca.OP_DIV, other, value)
    return None
