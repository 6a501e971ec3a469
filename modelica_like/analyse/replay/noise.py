"""Rounding of expressions: what they are wrong by if every operation and argument is rounded, to first order.

Source: N. J. Higham: Accuracy and Stability of Numerical Algorithms, 2nd edition, section 3.3 (running error analysis).
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from modelica_like.language.elements import applied

_SUMS = frozenset({ca.OP_ADD, ca.OP_SUB, ca.OP_FMIN, ca.OP_FMAX})
_SAME = frozenset({ca.OP_NEG, ca.OP_FABS, ca.OP_TWICE, ca.OP_COPYSIGN})


def rounding(arguments: list[Any], expressions: Any) -> Any:
    """Return the errors of expressions over the unit roundoff, an SX column.

    Args:
        arguments: SX symbols.
        expressions: an SX column in them.
    """
    function = ca.Function("rounded", arguments, [ca.densify(expressions)])
    symbols = [ca.vertsplit(argument) for argument in arguments]
    held, wrong, errors = dict[int, Any](), dict[int, Any](), [ca.SX(0)] * int(function.numel_out(0))
    for k in range(function.n_instructions()):
        code, reads, places = (
            function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        )  # fmt: skip
        if code == ca.OP_OUTPUT:
            errors[places[1]] = wrong[reads[0]]
            continue
        if code == ca.OP_CONST:
            value = ca.SX(function.instruction_constant(k))
        elif code == ca.OP_INPUT:
            value = symbols[reads[0]][reads[1]]
        else:
            value = applied(code, [held[read] for read in reads], function)
        leaf = code in (ca.OP_CONST, ca.OP_INPUT)
        error = 0 if leaf else _carried(code, [held[read] for read in reads], [wrong[read] for read in reads])
        held[places[0]], wrong[places[0]] = value, ca.fabs(value) + error
    return ca.vertcat(ca.SX(0, 1), *errors)


def _carried(code: int, values: list[Any], errors: list[Any]) -> Any:
    """What errors of operands do to a result; of functions that are not algebraic nothing is known."""
    if code in _SUMS or code in _SAME:
        return sum(errors[1:], errors[0]) if code in _SUMS else errors[0]
    if code == ca.OP_SQ:
        return 2 * ca.fabs(values[0]) * errors[0]
    if code == ca.OP_MUL:
        return ca.fabs(values[0]) * errors[1] + ca.fabs(values[1]) * errors[0]
    if code == ca.OP_DIV:
        return errors[0] / ca.fabs(values[1]) + ca.fabs(values[0]) * errors[1] / values[1] ** 2
    if code == ca.OP_IF_ELSE_ZERO:
        return ca.if_else(values[0], errors[1], 0)
    return 0
