"""Steps in equations: what jumps becomes an event; what is asked to make none keeps a slope that the graph shows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.flatten.generic import Matrix, meets, pairs
from modelica_like.language.discrete import CONTINUOUS, is_a, is_fixed, marker, moves, silence
from modelica_like.language.elements import rebuilt
from modelica_like.language.expr import TIME, Symbol, operands, symbols_in
from modelica_like.language.fields import Variable

_Key = tuple[int, int]
"""Identity of a node of a graph, and which of its steps."""
_EVENTS = {ca.OP_LT, ca.OP_LE, ca.OP_FLOOR}
_SILENT = {ca.OP_EQ, ca.OP_NE, ca.OP_CEIL, ca.OP_FMOD, ca.OP_REMAINDER, ca.OP_COPYSIGN}
"""Steps without an event: equality holds at single instants, a ceiling stands for `floor(…, events=False)`."""

_SOME = 3
STEPS = _EVENTS | _SILENT | {ca.OP_SIGN, ca.OP_AND, ca.OP_OR, ca.OP_NOT}
"""Operations whose slope is zero wherever it is defined, though their value is not constant."""


def with_events(residual: Any) -> Any:
    """Return a residual in which every step of a variable or of time at which it jumps is an event.

    A step at whose border the branches meet stays, because the slope shows it. For one that makes no event by its name,
    a zero is added whose slope has the same symbols: else what depends on a variable would look constant.
    """
    whole = ca.SX(residual)
    if not _has_steps(whole):
        return whole
    merged = ca.cse(whole)  # a step written twice is one
    jumps = _jumps(merged)
    if not any(jumps.values()):
        return _Written(lambda _key, _plain, new: new).honest(whole)

    def decided(key: _Key, _: Any, new: Any) -> Any | None:
        if not jumps.get(key):
            return new if key in jumps else None
        return marker("floor", new.dep(0)) if new.op() == ca.OP_FLOOR else marker("relation", new)

    return _Written(decided).honest(merged)


def event_steps(residual: Any) -> set[int]:
    """Return the identities of the steps of a residual that become events; a step written twice is one node."""
    return {identity for (identity, _), jump in _jumps(ca.SX(residual)).items() if jump}


def _jumps(whole: Any) -> dict[_Key, bool]:
    """Return the steps of an expression that may be events, and whether it jumps with them."""
    steps: dict[_Key, Any] = {}

    def seen(key: _Key, plain: Any, new: Any) -> Any:
        steps[key] = plain
        return new

    _Written(seen).write(whole)
    points = _Points(whole) if steps else None
    return {key: points.jumps(key, plain) for key, plain in steps.items()} if points else {}


def honest(expression: Any) -> Any:
    """Return an expression whose steps make no event, but show in its slopes."""
    whole = ca.SX(expression)
    return _Written(lambda *_: None).honest(whole) if _has_steps(whole) else whole


def _has_steps(whole: Any) -> bool:
    function = ca.Function("steps", [], [whole], {"allow_free": True})
    return any(function.instruction_id(k) in STEPS | {ca.OP_ATAN2} for k in range(function.n_instructions()))


def _is_wrapped(angle: Any) -> bool:
    """Whether an angle has a slope that is constant, as that of `atan2(sin(x), cos(x))`, though it jumps by turns."""
    single = ca.cse(angle)
    return any(not ca.depends_on(ca.jacobian(single, symbol), symbol) for symbol in symbols_in(single))


class _Written:
    """Writes an expression anew, from its leaves.

    Args:
        choose: what a step becomes, from its key, the step as it was and with new operands; None: it makes no event.
    """

    def __init__(self, choose: Callable[[_Key, Any, Any], Any | None]) -> None:
        self._choose = choose
        self._hidden: dict[int, Any] = {}
        self._known: dict[int, tuple[Any, Any]] = {}  # with the node, so that no other one can get its identity

    def honest(self, root: Any) -> Any:
        """Return the expression with zeros that have a slope by every variable that decides a step without event."""
        result = self.write(root)
        for step in self._hidden.values():
            result = result + ca.fmin(ca.tanh(step) + 2.0, 0.0)
        return result

    def write(self, root: Any) -> Any:
        """Return the expression."""
        pending = [root]
        while pending:
            node = pending.pop()
            key = node.element_hash()
            if key in self._known:
                continue
            mark = silence(node)
            if mark and (mark != CONTINUOUS or node.dep(0).op() not in _EVENTS):
                if mark != CONTINUOUS:
                    self._hide(node.dep(0))
                self._known[key] = node, node.dep(0)
                continue
            # Branches that meet are chosen by the argument that they have: steps in it are those of its value.
            parts = operands(node.dep(0) if mark else node)
            if missing := [part for part in parts if part.element_hash() not in self._known]:
                pending += [node, *missing]
            else:
                self._known[key] = node, self._with(node.dep(0), parts) if mark else self._of_node(node, parts)
        return self._known[root.element_hash()][1]

    def _with(self, node: Any, parts: list[Any]) -> Any:
        """Return a node with its operands as they are written."""
        olds = [part.element_hash() for part in parts]
        news = [self._known[x][1] for x in olds]
        if olds == [new.element_hash() for new in news]:
            return node
        return rebuilt(node, news)

    def _of_node(self, node: Any, parts: list[Any]) -> Any:
        operation = node.op()
        if operation == ca.OP_SIGN and moves(node):
            key, (old,), (new,) = node.element_hash(), parts, [self._known[part.element_hash()][1] for part in parts]
            return self._step((key, 0), old > 0, new > 0) - self._step((key, 1), old < 0, new < 0)
        whole = self._with(node, parts)
        if operation in _EVENTS:
            return self._step((node.element_hash(), 0), node, whole)
        if operation in _SILENT or (operation == ca.OP_ATAN2 and _is_wrapped(whole)):
            self._hide(whole)
        return whole

    def _step(self, key: _Key, plain: Any, new: Any) -> Any:
        chosen = self._choose(key, plain, new) if moves(new) else new
        if chosen is None:
            self._hide(new)
            return new
        return chosen

    def _hide(self, step: Any) -> None:
        for symbol in symbols_in(step):
            if is_a(symbol, Variable):
                self._hidden[id(symbol)] = symbol


class _Points:
    """An expression at generic points."""

    def __init__(self, whole: Any) -> None:
        symbols = symbols_in(whole)
        moving = [s for s in symbols if s is TIME or is_a(s, Variable)]
        others = [symbol for symbol in symbols if not any(symbol is other for other in moving)]
        fixed = [symbol for symbol in others if symbol.owner is not None and is_fixed(symbol)]
        whole_numbers = [symbol for symbol in others if not any(symbol is other for other in fixed)]
        self._whole, self._symbols = whole, ca.vertcat(*moving, *fixed, *whole_numbers)
        self._between = pairs(len(moving), len(fixed), [_numbers(number) for number in whole_numbers])

    def jumps(self, key: _Key, step: Any) -> bool:
        """Return whether the expression jumps with a step, while other steps follow."""
        chosen = Symbol(None, "step")

        def replaced(other: _Key, _: Any, new: Any) -> Any:
            if other[0] != key[0]:
                return new
            return chosen if other == key else 1 - chosen  # a sign is at zero only: both of its steps change there

        opened = _Written(replaced).write(self._whole)
        taken_of = step.dep(0) if step.op() == ca.OP_FLOOR else step.dep(0) - step.dep(1)
        values = ca.Function("step", [self._symbols], [step, taken_of])
        result = ca.Function("result", [self._symbols, chosen], [opened])

        def at(points: Matrix) -> tuple[Matrix, Matrix]:
            value, of = values.map(points.shape[1])(points)
            return value.full()[0], of.full()[0]

        def gap(points: Matrix, first: Matrix, second: Matrix) -> tuple[Matrix, Matrix]:
            low, other = (result.map(points.shape[1])(points, value[None]).full()[0] for value in (first, second))
            with np.errstate(invalid="ignore"):
                return abs(low - other), abs(low)

        return not meets(at, gap, self._between)


def _numbers(symbol: Symbol) -> int:
    """Return how many values a mode has, or some for another discrete value."""
    mode = None if symbol.owner is None else getattr(symbol.owner, "modes", {}).get(symbol.name)
    return _SOME if mode is None else len(mode.names)


def is_trace(node: Any) -> bool:
    """Tell whether a term is always zero, and shows what an expression depends on only."""
    parts = operands(node) if node.op() == ca.OP_FMIN else []
    return bool(parts) and parts[1].is_zero() and ca.OP_TANH in [inner.op() for inner in operands(parts[0])]
