"""What follows within an instant: values before events, and what discrete values alone decide."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, cast

import casadi as ca

from modelica_like.language.discrete import Marker, Pre, change, is_a, is_fixed, moves
from modelica_like.language.equation import Equation
from modelica_like.language.expr import TIME, is_expression, symbols_in
from modelica_like.language.fields import Discrete


def between_events(expression: Any) -> Any:
    """Return an expression as it is between events, where the `pre` of a discrete variable is the variable."""
    pres = [symbol for symbol in symbols_in(expression) if isinstance(symbol, Pre)]
    if not pres:
        return expression
    return ca.substitute(ca.SX(expression), ca.vertcat(*pres), ca.vertcat(*(pre.of for pre in pres)))


def following(expression: Any, determined: Sequence[Equation]) -> Any:
    """Return an expression of a variable's equation, with what `pre(…)` and discrete values alone decide written out.

    So it is there as soon as these have changed, before relations are judged: a clutch that has become `stuck` is
    locked at once, and whether it breaks loose is judged by the torque that it bears, not by the one of sliding.

    Args:
        expression: of the equation, in which `pre(v)` is v.
        determined: equations of discrete variables.
    """
    rules = {id(symbols_in(e.left)[0]): (symbols_in(e.left)[0], between_events(e.right)) for e in determined}
    follows = {
        key: rule for key, rule in rules.items()
        if any(isinstance(s, Pre) for e in determined if symbols_in(e.left)[0] is rule[0] for s in symbols_in(e.right))
        and all(s.owner is not None and s is not rule[0] and not moves(ca.SX(s)) for s in symbols_in(rule[1]))
    }  # fmt: skip
    if not follows or not is_expression(expression):
        return expression
    symbols, values = zip(*follows.values(), strict=True)
    return ca.substitute(ca.SX(expression), ca.vertcat(*symbols), ca.vertcat(*values))


def at_once(expression: Any) -> Any:
    """Return a new value in which relations of time and discrete variables follow these where they have just changed.

    A relation has its value of the round before, which is that of the discrete variables before.
    """
    pairs: list[tuple[Any, Any]] = []
    for symbol in symbols_in(expression) if is_expression(expression) else ():
        inner = symbols_in(symbol.of) if isinstance(symbol, Marker) and symbol.kind == "relation" else ()
        changing = [s for s in inner if is_a(s, Discrete)]
        if changing and all(s is TIME or (s.owner is not None and (is_a(s, Discrete) or is_fixed(s))) for s in inner):
            changed = functools.reduce(ca.logic_or, (ca.SX(change(s)) for s in changing))
            pairs.append((symbol, ca.if_else(changed, cast(Any, symbol).of, symbol)))
    if not pairs:
        return expression
    return ca.substitute(ca.SX(expression), ca.vertcat(*(p[0] for p in pairs)), ca.vertcat(*(p[1] for p in pairs)))
