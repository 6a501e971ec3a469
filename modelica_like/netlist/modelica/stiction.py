"""Sticking friction as the standard library writes it, shared where several parts stick on one shaft.

Such a friction says `a = if locked then 0 else sa - limit`, and its torque is `sa` while it is locked: what holds it,
to be found. Two of them on one shaft both say that it stands, and leave open how they share the load. Here a locked one
yields by a tiny acceleration per load, `a = creep*sa`: they share it evenly, the one that reaches its limit slides as
slowly with the others, and these take what is left, until they slide, too. So a shaft breaks away at the sum of limits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import reduce
from typing import Any

import casadi as ca

from modelica_like.language import where
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.fold import CREEP
from modelica_like.netlist.modelica.tree import Expr, Statement, calls_in, nodes, with_operands

_CREEP = 1e-13
"""Acceleration of a locked friction by what holds it, in units of the SI: a thousand times what rounding leaves of it.
It makes no way that counts: 5e-6 in 100 s by a load of 10,000. Where the limit is known, it is by part of the limit."""
STIFF = 1 / _CREEP
"""Weight of an equation whose terms are as small."""
_STEADY, _FALLING = 1e1, 1e4
"""How much more one yields whose limit is known, and one whose limit falls once it slides. So what keeps its limit, or
has none that is known beforehand, slides first, also behind a gear of 1:100, and a shaft has the whole of all limits
until it moves; two whose limits fall are refused, unless they turn at the same speed."""
_LEAST, _STANDS, _FALLS = 1e-6, 1e-9, 0.995
"""The limit that those below it count as, a speed that what yields does not reach, and the part of a limit that it
falls to; the library makes it larger by 0.1 % for other reasons."""


def creep(values: Sequence[Any]) -> Any:
    """Return the acceleration of a locked friction by its load and its limits; without them a speed that is none.

    The limits are that of what stands and, if there is one, that of what slides; none if they are not known beforehand.
    """
    if not values:
        return ca.SX(_STANDS)
    load, *limits = values
    if not limits:
        return _CREEP * load
    limit = where(limits[0] > _LEAST, limits[0], _LEAST, events=False)
    return _CREEP * where(falls(limits), _FALLING, _STEADY, events=False) * load / limit


def falls(limits: Sequence[Any]) -> Any:
    """Tell whether a limit is smaller once something slides, of the limits as above."""
    return limits[-1] < _FALLS * limits[0] if limits else ca.SX(0)


def yielding(equations: Iterable[Statement]) -> list[Statement]:
    """Return equations in which locked frictions may yield."""
    equations = list(equations)
    limits: dict[str, dict[tuple[object, ...], list[Expr]]] = {">": {}, "<": {}}
    for statement in equations:
        for node in nodes(statement.parts[1]) if statement.kind == "=" else ():
            if node.kind in limits and node.args[0].kind == "name":
                limits[node.kind].setdefault(node.args[0].args, []).append(node.args[1])
    above, below = limits.values()
    known = {
        load: values[:2] if load not in below or _same(fold.operation("neg", (values[0],), 0), below[load][0]) else []
        for load, values in above.items()
    }
    turned = [_yielding(statement, known) if statement.kind == "=" else statement for statement in equations]
    pairs = [(s.parts[0], s.parts[1]) for s in turned if s.kind == "="]
    loads = {call.args[1][0].args for _, right in pairs for call in calls_in(right) if call.args[0] == CREEP}
    starting = {
        left.args
        for left, right in pairs
        if any(node.kind in limits and node.args[0].args in loads for node in nodes(right))
    }
    return [_standing(s, starting) if loads and s.kind == "=" else s for s in turned]


def locking(value: Expr) -> Expr | None:
    """Return the choice of a side of an equation between what yields while it is locked, and the rest."""
    choices = (node for node in nodes(value) if node.kind == "if" and node.args[1].kind == "call")
    return next((node for node in choices if node.args[1].args[0] == CREEP), None)


def _yielding(statement: Statement, limits: dict[tuple[object, ...], list[Expr]]) -> Statement:
    def turned(node: Expr) -> Expr:
        if node.kind == "if" and node.args[0].kind == "name" and _is_zero(node.args[1]):
            load = next((name for value in _values(node) if (name := _leading(value)).args in limits), None)
            if load is not None:
                creep = fold.call(CREEP, (load, *limits[load.args]), node.line)
                return Expr("if", (node.args[0], creep, *node.args[2:]), node.line)
        return with_operands(node, turned)

    left, right = statement.parts
    return Statement("=", (left, turned(right)), statement.line)


def _standing(statement: Statement, starting: set[tuple[object, ...]]) -> Statement:
    """Let a speed as small as that of what yields be none, where it is asked whether what stood moves.

    What moved stops where all others on its shaft do, at zero.
    """

    def turned(node: Expr) -> Expr:
        if node.kind == "and" and node.args[1].kind in (">", "<") and _is_zero(node.args[1].args[1]):
            left, right = node.args
            moves = Expr(right.kind, (right.args[0], _speed(right)), right.line)
            if left.args[:1] == ("initial",):
                return Expr("and", (left, moves), node.line)
            starts = [leaf for leaf in _leaves(left) if leaf.args in starting]
            if starts:
                others = [leaf for leaf in _leaves(left) if leaf not in starts]
                pairs = [(leaf, right) for leaf in others] + [(leaf, moves) for leaf in starts]
                parts = [Expr("and", pair, node.line) for pair in pairs]
                return reduce(lambda one, other: Expr("or", (one, other), node.line), parts)
        return with_operands(node, turned)

    left, right = statement.parts
    return Statement("=", (left, turned(right)), statement.line)


def _speed(relation: Expr) -> Expr:
    speed = fold.call(CREEP, (), relation.line)
    return speed if relation.kind == ">" else Expr("neg", (speed,), relation.line)


def _leaves(condition: Expr) -> list[Expr]:
    """Return what an `or` is made of."""
    return [leaf for part in condition.args for leaf in _leaves(part)] if condition.kind == "or" else [condition]


def _is_zero(node: Expr) -> bool:
    return node.kind == "number" and node.args[0] == 0


def _values(choice: Expr) -> Iterator[Expr]:
    """Yield the values of an `if` behind its first one, and those of an `if` among them."""
    for value in (*choice.args[3::2], choice.args[-1]):
        if value.kind == "if":
            yield value.args[1]
            yield from _values(value)
        else:
            yield value


def _leading(value: Expr) -> Expr:
    """Return `sa` of `sa - limit`."""
    return value.args[0] if value.kind in ("+", "-") else value


def _same(one: Expr, other: Expr) -> bool:
    """Tell whether two expressions are the same, but for the lines where they stand and where a sign does."""
    if one.kind == "neg" and other.kind in ("*", "/"):  # -(a/b) is (-a)/b
        one = Expr(one.args[0].kind, (fold.operation("neg", one.args[0].args[:1], 0), *one.args[0].args[1:]))
    pairs = zip(one.args, other.args, strict=False)
    return (one.kind, len(one.args)) == (other.kind, len(other.args)) and all(
        _same(a, b) if isinstance(a, Expr) and isinstance(b, Expr) else a == b for a, b in pairs
    )
