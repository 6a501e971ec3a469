"""Items that `equations()` yields: equations, connections, free ends."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Protocol, cast

import casadi as ca

from modelica_like.errors import LanguageError, Source, WrongConnection
from modelica_like.language.declared import Connector
from modelica_like.language.expr import Expr, Symbol
from modelica_like.language.places import NOWHERE


@dataclass(frozen=True, eq=False)
class Connection:
    """Connectors of one kind, or an output and inputs, that are joined."""

    ends: tuple[Connector | Symbol, ...]
    source: Source = NOWHERE


@dataclass(frozen=True, eq=False)
class FreeEnd:
    """A connector that stays unconnected on purpose."""

    connector: Connector
    source: Source = NOWHERE


@dataclass(frozen=True, eq=False)
class Lock:
    """That an equation says in one mode that something stands, which others may say, too.

    Attributes:
        discrete: the discrete variable that makes it say so.
        falls: whether the limit of what holds it is smaller once it slides.
        creeps: whether tiny terms of the equation determine what all that say so would leave open.
    """

    discrete: str
    falls: Any
    creeps: bool


@dataclass(frozen=True, eq=False)
class Equation:
    """An equation `left == right`, at its place, and what it may lock."""

    left: Expr
    right: Expr
    source: Source = NOWHERE
    lock: Lock | None = None


Statement = Equation | Connection | FreeEnd
Equations = Iterator["Expr | Connection | FreeEnd | Equation"]
"""Return type of `equations()`."""


def connect(first: Connector | Expr, *others: Connector | Expr) -> Connection:
    """Join connectors of one kind, or one output with inputs.

    Args:
        first: a connector or signal.
        others: at least one more.

    Raises:
        LanguageError: fewer than two ends, or an end that is neither a connector nor a signal.
    """
    ends = (first, *others)
    for end in ends:
        if not isinstance(end, Connector | Symbol):
            raise LanguageError(
                f"connect() was given {end!r}, which is neither a connector nor a signal.",
                advice="Connect flanges with flanges, an output with inputs.",
            )
    if not others:
        raise LanguageError("connect() was given only one end.", advice="Name at least two.")
    return Connection(cast(Any, ends))


class InLine(Protocol):
    """What has a place in a line: a component with two ends."""

    def inlet_connector(self) -> Connector:
        """Return the end that the part before is connected with."""
        ...

    def outlet_connector(self) -> Connector:
        """Return the end that the next part is connected with."""
        ...


def series(*parts: InLine) -> Equations:
    """Connect the outlet of each part with the inlet of the next.

    Args:
        parts: at least two components, in order.

    Raises:
        WrongConnection: a part follows itself.
    """
    for left, right in pairwise(parts):
        if left is right:
            raise WrongConnection(
                f"{getattr(left, 'label', 'A part')} follows itself in a series.",
                why="Its outlet would be joined to its own inlet.",
                advice="Name it once. Several equal parts are an array: count = 2.",
            )
        yield connect(left.outlet_connector(), right.inlet_connector())


def free(connector: Any) -> FreeEnd:
    """Declare that a connector stays unconnected on purpose.

    Args:
        connector: of this component or of a part.

    Raises:
        LanguageError: it is not a connector.
    """
    if not isinstance(connector, Connector):
        raise LanguageError(
            f"free() was given {connector!r}, which is not a connector.",
            advice="Name a flange, as in free(self.gear.ring).",
        )
    return FreeEnd(connector)


def as_equation(item: Any, source: Source, component: str) -> Equation:
    """Split `left == right`.

    Args:
        item: yielded by `equations()`.
        source: its place.
        component: name of the class, for messages.

    Raises:
        LanguageError: the item is not an equation, or both sides are the same.
    """
    if isinstance(item, Equation):
        return item
    if isinstance(item, ca.SX) and item.is_scalar():
        if item.op() == ca.OP_EQ:
            sides = cast(Expr, item.dep(0)), cast(Expr, item.dep(1))
            return Equation(*(reversed(sides) if _is_turned(*sides, source.text) else sides), source=source)
        if item.is_constant():
            raise LanguageError(
                f"{component} has an equation whose two sides are the same, or have only numbers.",
                where=source, advice="An equation relates unknowns: left == right.",
            )  # fmt: skip
    if isinstance(item, bool):
        raise LanguageError(
            f"{component} has an equation that Python evaluated to {item}.",
            where=source, advice="Write a symbol on the left: `self.tau == 0`, not `0 == self.tau`.",
        )  # fmt: skip
    raise LanguageError(
        f"{component}.equations() yields {type(item).__name__} instead of an equation.",
        where=source, advice="Yield `left == right`, `connect(…)` or `free(…)`, or `yield from series(…)`.",
    )  # fmt: skip


def _is_turned(left: Any, right: Any, text: str) -> bool:
    """Return whether Python exchanged the sides.

    Python asks a symbol on the right side first, because the class of symbols is derived from that of expressions.
    """
    written = [side.strip() for side in text.removeprefix("yield").split("==")]
    plain = [re.fullmatch(r"[\w.\[\]]+", side) is not None for side in written]
    return left.is_symbolic() and not right.is_symbolic() and plain == [False, True]


def as_statement(item: Any, source: Source, component: str) -> Statement:
    """Read an item yielded by `equations()`; the arguments are those of `as_equation`."""
    if isinstance(item, Connection | FreeEnd):
        return item if item.source is not NOWHERE else replace(item, source=source)
    return as_equation(item, source, component)
