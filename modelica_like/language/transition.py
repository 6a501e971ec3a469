"""Items that `events()` yields: transitions of modes, and choices of the mode at the start."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from modelica_like.errors import LanguageError, Source, did_you_mean
from modelica_like.language.expr import TIME, Expr, Symbol, symbols_in
from modelica_like.language.fields import Discrete, Input, Parameter, Variable
from modelica_like.language.places import NOWHERE

if TYPE_CHECKING:
    from modelica_like.language.mode import BoundMode

NAME_IN_NOTICE = re.compile(r"\{(\w+)\}")
"""A parameter in the notice of a transition."""


@dataclass(frozen=True, eq=False)
class Transition:
    """Change of a mode at an event.

    Attributes:
        mode: the mode that changes.
        sources: names of the modes to leave.
        target: name of the mode to enter.
        when: condition of a state event, or None.
        at: time of a time event in s, or None.
        reset: new values of states and discrete values.
        notice: message for the user, without the name of the component.
        because: reason in a few words.
        fails: whether the run ends there, with an error.
    """

    mode: BoundMode
    sources: tuple[str, ...]
    target: str
    when: Expr | None
    at: Expr | None
    reset: Mapping[Expr, Any]
    source: Source = NOWHERE
    notice: str = ""
    because: str = ""
    fails: bool = False

    def reason(self) -> str:
        """Return the reason in words: as declared, or the condition as written."""
        if self.because or self.at is not None:
            return self.because or "its time is reached"
        try:
            call: Any = ast.parse(self.source.text.removeprefix("yield ").strip(), mode="eval").body
            written = next(one.value for one in call.keywords if one.arg == "when")
        except (SyntaxError, AttributeError, StopIteration):  # not written as one call
            return ""
        return ast.unparse(written).replace("self.", "")


@dataclass(frozen=True, eq=False)
class StartMode:
    """Choice of a mode at the start."""

    mode: BoundMode
    target: str
    when: Expr
    source: Source = NOWHERE


EventStatement = Transition | StartMode
Events = Iterator[EventStatement]
"""Return type of `events()`."""


def as_event(item: Any, source: Source, component: str) -> EventStatement:
    """Read an item yielded by `events()`.

    Args:
        item: the item.
        source: its place.
        component: name of the class, for messages.

    Raises:
        LanguageError: it is neither a transition nor a choice of the start mode.
    """
    if isinstance(item, Transition):
        _check_transition(item, source, component)
        _check_notice(item, source, component)
    if isinstance(item, Transition | StartMode):
        return replace(item, source=source)
    raise LanguageError(
        f"{component}.events() yields {type(item).__name__} instead of a transition.",
        where=source, advice="Yield `mode.go(…)` or `mode.initially(…)`.",
    )  # fmt: skip


def _check_transition(transition: Transition, source: Source, component: str) -> None:
    """Check that a time event is known in advance, and that only variables and discrete values are reset."""
    asked = () if transition.at is None else symbols_in(transition.at)
    moving = [s for s in asked if s is TIME or isinstance(_field(s), Variable)]
    if moving:
        raise LanguageError(
            f"{component}: the time of an event depends on {moving[0].name}, so it is not known in advance.",
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


def _check_notice(transition: Transition, source: Source, component: str) -> None:
    """Check that the names in a notice are parameters."""
    fields = transition.mode.symbol.owner.fields
    parameters = [name for name, field in fields.items() if isinstance(field, Parameter)]
    for name in NAME_IN_NOTICE.findall(transition.notice):
        if name not in parameters:
            raise LanguageError(
                f"{component}: the notice of an event names {name}, "
                f"which is not a parameter{did_you_mean(name, parameters) or '.'}",
                where=source,
            )


def _field(symbol: Symbol) -> Any:
    return symbol.owner.fields.get(symbol.name)
