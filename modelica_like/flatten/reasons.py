"""Reasons of transitions in words: as declared in the class, or from the condition."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import casadi as ca

from modelica_like.language.expr import Symbol, operands, symbols_in
from modelica_like.language.fields import Parameter
from modelica_like.language.mode import Mode, Transition

_LONGEST, _TERM = 100, 40
"""Characters of a reason, and of one side of a relation, that a reader takes in at a glance."""
_WORDS = 3
"""Words of a description that fit before a name."""


def reason(transition: Transition, path: Callable[[Symbol], str]) -> str:
    """Return why a transition happens.

    Args:
        transition: of a component.
        path: names a symbol as the component would.

    Returns:
        A few words; names of parameters in braces are replaced by name and value.
    """
    if transition.because or transition.when is None:
        return transition.because or "its time is reached"
    text = _condition(transition.when, path)
    if len(text) <= _LONGEST and "…" not in text:
        return text
    named = dict.fromkeys(path(s) for s in symbols_in(transition.when) if not isinstance(_field(s), Parameter))
    return f"its condition on {', '.join(named)} holds"


def _condition(condition: Any, path: Callable[[Symbol], str], *, turned: bool = False) -> str:
    """Say a condition, or (`turned`) its opposite."""
    operation, sides = condition.op(), operands(condition)
    if operation == ca.OP_NOT:
        return _condition(sides[0], path, turned=not turned)
    if operation in (ca.OP_AND, ca.OP_OR):
        both = (operation == ca.OP_AND) != turned
        parts = [_condition(side, path, turned=turned) for side in sides]
        return (" and " if both else " or ").join(dict.fromkeys(parts))
    if operation in (ca.OP_LT, ca.OP_LE):
        low, high = reversed(sides) if turned else sides
        if {low.op(), high.op()} <= {ca.OP_NEG, ca.OP_CONST}:
            low, high = -high, -low
        fixed = all(isinstance(_field(symbol), Parameter) for symbol in symbols_in(low))
        first, passes, second = (high, "rose above", low) if fixed else (low, "fell below", high)
        return f"{_side(first, path)} {passes} {_side(second, path)}"
    if operation in (ca.OP_EQ, ca.OP_NE):
        verb = "is" if (operation == ca.OP_EQ) != turned else "is not"
        mode = _field(symbols_in(sides[0])[0]) if sides[0].is_symbolic() else None
        if isinstance(mode, Mode):
            return f"{path(symbols_in(sides[0])[0])} {verb} {mode.names[int(sides[1])]}"
        return f"{_side(sides[0], path)} {verb} {_side(sides[1], path)}"
    return "…"


def _side(expression: Any, path: Callable[[Symbol], str]) -> str:
    """Say one side of a relation, a lone variable with its description; `…` if that would be long."""
    if expression.is_constant():
        return f"{float(expression):g}" if float(expression) else "zero"
    symbols = symbols_in(expression)
    named = [ca.SX.sym(path(symbol) if not symbol.order else f"der({path(symbol)})") for symbol in symbols]
    (plain,) = ca.substitute([expression], [ca.vertcat(*symbols)], [ca.vertcat(*named)])
    text = re.sub(r"(?<![\w.])\d[\d.]*(e[+-]?\d+)?", lambda number: f"{float(number[0]):g}", str(plain))
    text = re.sub(r"\(([\w.]+[*/][\w.]+)\)", r"\1", re.sub(r"fabs\(([^()]*)\)", r"|\1|", text))
    text = re.sub(r"^\((.*)\)$", r"\1", text)
    field = _field(symbols[0])
    if plain.is_symbolic() and isinstance(field, Parameter):
        return f"{{{text}}}"
    lone = len(symbols) == 1 and not symbols[0].order and text.strip("|") == path(symbols[0])
    words = re.split(r"[,;:(]", getattr(field, "description", ""))[0].split() if lone else []
    text = " ".join([*words, text]) if len(words) <= _WORDS else text
    return text if len(text) <= _TERM and not set(text) & set("@?") else "…"


def _field(symbol: Symbol) -> Any:
    """Return what a symbol was declared as."""
    declared: dict[str, Any] = (
        {} if symbol.owner is None else {**symbol.owner.fields, **getattr(symbol.owner, "modes", {})}
    )
    return declared.get(symbol.name)
