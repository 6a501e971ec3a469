"""Conditions as guards: numbers that are positive where the condition holds."""

from __future__ import annotations

from typing import Any

import casadi as ca

from modelica_like.errors import LanguageError, Source
from modelica_like.language.discrete import moves
from modelica_like.language.expr import operands

JUST_TRUE = 1e-300
"""Guard of a relation with equality, where both sides are equal."""


def guard_of(condition: Any, source: Source, *, negated: bool = False) -> Any:
    """Turn a condition into an expression that is positive where the condition holds, to locate an event.

    Args:
        condition: a relation, or several that are joined.
        source: the transition's place, for messages.
        negated: turn the opposite; a negation moves inwards, so that equality stays correct.

    Raises:
        LanguageError: the condition is not made of relations.
    """
    operation = condition.op() if isinstance(condition, ca.SX) else None
    if operation == ca.OP_NOT:
        return guard_of(*operands(condition), source=source, negated=not negated)
    if operation in (ca.OP_AND, ca.OP_OR):
        join = ca.fmin if (operation == ca.OP_AND) != negated else ca.fmax
        return join(*(guard_of(operand, source, negated=negated) for operand in operands(condition)))
    if operation in (ca.OP_LT, ca.OP_LE):
        first, second = operands(condition)
        difference = first - second if negated else second - first
        if (operation == ca.OP_LT) != negated:
            return difference
        # A sum, so that its rate is that of the difference: a relation that stops being true now does not count.
        return difference + ca.if_else(difference == 0, JUST_TRUE, 0)
    if operation in (ca.OP_EQ, ca.OP_NE, ca.OP_CONST) or (operation == ca.OP_PARAMETER and not moves(condition)):
        # Between events a mode or a parameter is constant: such a condition is plainly on or off.
        on = -1.0 if negated else 1.0
        return ca.if_else(condition, on, -on)
    raise LanguageError(
        "The condition of a transition is not a relation.",
        where=source,
        advice="Write a comparison such as `self.w_rel > 0`, or several joined with all_of, any_of, negate.",
    )
