"""Conditions as guards: numbers that are positive where the condition holds."""

from __future__ import annotations

from typing import Any

import casadi as ca

from modelica_like.errors import LanguageError, Source

JUST_TRUE = 1e-300
"""Guard of a relation that includes equality, where both sides are equal."""


def guard_of(condition: Any, source: Source) -> Any:
    """Turn a condition into an expression that is positive where it holds, so that an event can be located.

    Raises:
        LanguageError: the condition is not made of relations.
    """
    operation = condition.op() if isinstance(condition, ca.SX) else None
    if operation is not None and condition.is_constant():
        return ca.SX(1.0 if float(condition) else -1.0)
    if operation == ca.OP_LT:
        return condition.dep(1) - condition.dep(0)
    if operation == ca.OP_LE:
        difference = condition.dep(1) - condition.dep(0)
        # A sum, so that its rate is that of the difference: a relation that ceases to hold right now does not count.
        return difference + ca.if_else(difference == 0, JUST_TRUE, 0)
    if operation == ca.OP_AND:
        return ca.fmin(guard_of(condition.dep(0), source), guard_of(condition.dep(1), source))
    if operation == ca.OP_OR:
        return ca.fmax(guard_of(condition.dep(0), source), guard_of(condition.dep(1), source))
    if operation == ca.OP_NOT:
        return guard_of(_opposite(condition.dep(0)), source)
    if operation in (ca.OP_EQ, ca.OP_NE):
        # Between events a mode is constant: its conditions are plainly on or off.
        return ca.if_else(condition, 1.0, -1.0)
    raise LanguageError(
        "The condition of a transition is not a relation.",
        where=source,
        advice="Write a comparison such as `self.w_rel > 0`, or several joined with all_of, any_of, negate.",
    )


def _opposite(condition: Any) -> Any:
    """Move a negation inwards, so that equality ends up on the right side."""
    operation = condition.op()
    if operation == ca.OP_LT:
        return condition.dep(1) <= condition.dep(0)
    if operation == ca.OP_LE:
        return condition.dep(1) < condition.dep(0)
    if operation == ca.OP_AND:
        return ca.logic_or(_opposite(condition.dep(0)), _opposite(condition.dep(1)))
    if operation == ca.OP_OR:
        return ca.logic_and(_opposite(condition.dep(0)), _opposite(condition.dep(1)))
    if operation == ca.OP_NOT:
        return condition.dep(0)
    return ca.logic_not(condition) if operation not in (ca.OP_EQ, ca.OP_NE) else condition == 0
