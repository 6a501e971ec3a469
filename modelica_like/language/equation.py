"""What `equations()` and `events()` yield, each with the place it comes from."""

from __future__ import annotations

import linecache
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from pathlib import Path
from tokenize import COMMENT, TokenError, generate_tokens
from types import CodeType, GeneratorType
from typing import TYPE_CHECKING, Any, cast

import casadi as ca

from modelica_like.errors import LanguageError, Source
from modelica_like.language.expr import TIME, Expr, Symbol, symbols_in
from modelica_like.language.fields import Discrete, Input, Variable

if TYPE_CHECKING:
    from modelica_like.language.component import Component, Connector
    from modelica_like.language.mode import BoundMode

_HERE = str(Path(__file__).parent)
NOWHERE = Source("")


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
class Equation:
    """An equation `left == right`."""

    left: Expr
    right: Expr
    source: Source = NOWHERE


@dataclass(frozen=True, eq=False)
class Transition:
    """Change of a mode at an event.

    Attributes:
        mode: the mode that changes.
        sources: names of the modes it may leave.
        target: name of the mode it enters.
        when: condition of a state event, or None.
        at: time of a time event in s, or None.
        reset: new values of states and discrete values.
    """

    mode: BoundMode
    sources: tuple[str, ...]
    target: str
    when: Expr | None
    at: Expr | None
    reset: Mapping[Expr, Any]
    source: Source = NOWHERE


@dataclass(frozen=True, eq=False)
class StartMode:
    """Choice of a mode at the start."""

    mode: BoundMode
    target: str
    when: Expr
    source: Source = NOWHERE


Statement = Equation | Connection | FreeEnd
EventStatement = Transition | StartMode
Equations = Iterator["Expr | Connection | FreeEnd"]
"""What `equations()` returns."""
Events = Iterator["Transition | StartMode"]
"""What `events()` returns."""


def connect(first: Connector | Expr, *others: Connector | Expr) -> Connection:
    """Join connectors of one kind, or one output with inputs.

    Raises:
        LanguageError: fewer than two ends, or an end that is neither a connector nor a signal.
    """
    from modelica_like.language.component import Connector

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


def series(*parts: Component) -> Equations:
    """Connect the outlet of each part with the inlet of the next."""
    for left, right in pairwise(parts):
        yield connect(left.outlet_connector(), right.inlet_connector())


def free(connector: Any) -> FreeEnd:
    """Say that a connector stays unconnected on purpose.

    Raises:
        LanguageError: it is not a connector.
    """
    from modelica_like.language.component import Connector

    if not isinstance(connector, Connector):
        raise LanguageError(
            f"free() was given {connector!r}, which is not a connector.",
            advice="Name a flange, as in free(self.gear.ring).",
        )
    return FreeEnd(connector)


def located(generator: Any, label: str = "equations()") -> Iterator[tuple[Any, Source]]:
    """Run a generator and pair what it yields with the place of the `yield` in the user's file.

    Args:
        generator: what `equations()` or `events()` returned.
        label: name of that method, for messages.

    Raises:
        LanguageError: it is not iterable.
    """
    if not isinstance(generator, Iterable) or isinstance(generator, ca.SX):
        raise LanguageError(
            f"{label} returns {type(generator).__name__} instead of yielding equations or events.",
            advice="Is a `yield` missing?",
        )
    items: Iterator[Any] = iter(cast("Iterable[Any]", generator))
    for item in items:
        yield item, _place(items)


def _place(items: object) -> Source:
    """Return where a generator stands now: its own line, or that of the generator it delegates to."""
    frame = None
    while isinstance(items, GeneratorType) and not items.gi_code.co_filename.startswith(_HERE):
        frame = items.gi_frame
        items = cast(object, items.gi_yieldfrom)
    return NOWHERE if frame is None else source_of(frame.f_code, frame.f_lasti)


def source_of(code: CodeType, instruction: int) -> Source:
    """Return the source place of a byte-code instruction."""
    line, end_line, column, end_column = next(islice(code.co_positions(), instruction // 2, None))
    if line is None:
        return Source(code.co_filename, code.co_firstlineno)
    lines = [linecache.getline(code.co_filename, n).rstrip("\n") for n in range(line, (end_line or line) + 1)]
    if lines and end_column is not None and column is not None:
        lines[-1] = lines[-1].encode()[:end_column].decode(errors="ignore")
        lines[0] = lines[0].encode()[column:].decode(errors="ignore")
    text = lines[0] if len(lines) == 1 else _without_comments(lines)
    return Source(code.co_filename, line, " ".join(text.split()))


def _without_comments(lines: list[str]) -> str:
    """Join the lines of a statement; a comment would swallow the lines after it."""
    kept = list(lines)
    try:
        for token in generate_tokens(iter([f"{line}\n" for line in lines]).__next__):
            if token.type == COMMENT:
                row, column = token.start
                kept[row - 1] = kept[row - 1][:column]
    except (TokenError, SyntaxError):
        pass
    return " ".join(kept)


def as_equation(item: Any, source: Source, component: str) -> Equation:
    """Take `left == right` apart.

    Raises:
        LanguageError: the item is not an equation, or both sides are the same.
    """
    if isinstance(item, ca.SX) and item.is_scalar():
        if item.op() == ca.OP_EQ:
            sides = cast(Expr, item.dep(0)), cast(Expr, item.dep(1))
            return Equation(*(reversed(sides) if _is_turned(*sides, source.text) else sides), source=source)
        if item.is_constant():
            raise LanguageError(
                f"{component} has an equation whose two sides are the same, or only numbers.",
                where=source, advice="An equation relates unknowns: left == right.",
            )  # fmt: skip
    if isinstance(item, bool):
        raise LanguageError(
            f"{component} has an equation that Python evaluated to {item}.",
            where=source, advice="Keep a symbol on the left: `self.tau == 0`, not `0 == self.tau`.",
        )  # fmt: skip
    raise LanguageError(
        f"{component}.equations() yields {type(item).__name__} instead of an equation.",
        where=source, advice="Yield `left == right`, `connect(…)` or `free(…)`, or `yield from series(…)`.",
    )  # fmt: skip


def _is_turned(left: Any, right: Any, text: str) -> bool:
    """Tell whether Python exchanged the sides.

    It asks a symbol on the right side first, as the class of symbols is derived from that of expressions.
    """
    written = [side.strip() for side in text.removeprefix("yield").split("==")]
    plain = [re.fullmatch(r"[\w.\[\]]+", side) is not None for side in written]
    return left.is_symbolic() and not right.is_symbolic() and plain == [False, True]


def as_statement(item: Any, source: Source, component: str) -> Statement:
    """Read what `equations()` yielded."""
    if isinstance(item, Connection | FreeEnd):
        return item if item.source is not NOWHERE else replace(item, source=source)
    return as_equation(item, source, component)


def as_event(item: Any, source: Source, component: str) -> EventStatement:
    """Read what `events()` yielded.

    Raises:
        LanguageError: it is neither a transition nor a choice of the start mode.
    """
    if isinstance(item, Transition):
        _check_transition(item, source, component)
    if isinstance(item, Transition | StartMode):
        return replace(item, source=source)
    raise LanguageError(
        f"{component}.events() yields {type(item).__name__} instead of a transition.",
        where=source, advice="Yield `mode.go(…)` or `mode.initially(…)`.",
    )  # fmt: skip


def _check_transition(transition: Transition, source: Source, component: str) -> None:
    """Check that the time of a time event is known ahead, and that only variables and discrete values are reset."""
    moving = (
        []
        if transition.at is None
        else [s for s in symbols_in(transition.at) if s is TIME or isinstance(_field(s), Variable)]
    )
    if moving:
        raise LanguageError(
            f"{component}: the time of an event depends on {moving[0].name}, so it is not known ahead.",
            where=source, advice="Write it as a state event, `when=…`.",
        )  # fmt: skip
    for target in transition.reset:
        field = _field(target) if isinstance(target, Symbol) and target is not TIME and target.order == 0 else None
        if not isinstance(field, Variable | Discrete) or isinstance(field, Input):
            raise LanguageError(
                f"{component}: a reset gives {target} a value, which is neither a variable nor a discrete value.",
                where=source,
                advice="Reset variables of this component, as in reset={self.w: 0}; `go` itself changes the mode.",
            )


def _field(symbol: Symbol) -> Any:
    return symbol.owner.fields.get(symbol.name)
