"""What `events()` may yield: transitions of modes, choices of the mode at the start, and whens."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from modelica_like.errors import LanguageError, Source, did_you_mean
from modelica_like.language.discrete import Assertion, When
from modelica_like.language.expr import TIME, Symbol, symbols_in
from modelica_like.language.fields import Discrete, Input, Parameter, Variable
from modelica_like.language.mode import StartMode, Transition
from modelica_like.language.places import NOWHERE

NAME_IN_NOTICE = re.compile(r"\{([\w.]+)\}")
"""A parameter in the notice or the reason of a transition."""


EventStatement = Transition | StartMode | When | Assertion
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
    if isinstance(item, EventStatement):
        return item if item.source is not NOWHERE else replace(item, source=source)
    raise LanguageError(
        f"{component}.events() yields {type(item).__name__} instead of a transition.",
        where=source, advice="Yield `mode.go(…)`, `mode.initially(…)`, `when(…)` or `assert_(…)`.",
    )  # fmt: skip


def _check_transition(transition: Transition, source: Source, component: str) -> None:
    """Check that a time event is known in advance, and that only variables and discrete values are reset."""
    symbols = () if transition.at is None else symbols_in(transition.at)
    moving = [s for s in symbols if s is TIME or isinstance(_field(s), Variable)]
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
    """Check that the names in a reason are parameters, and those in a notice parameters or inputs."""
    fields = transition.mode.symbol.owner.fields
    kinds = {"notice": Parameter | Input, "reason": Parameter}
    texts = {"notice": transition.notice, "reason": transition.because}
    for kind, name in ((kind, name) for kind, text in texts.items() for name in NAME_IN_NOTICE.findall(text)):
        names = [name for name, field in fields.items() if isinstance(field, kinds[kind])]
        if name not in names:
            what = "parameter" if kind == "reason" else "parameter or input"
            raise LanguageError(
                f"{component}: the {kind} of an event names {name}, "
                f"which is not a {what}{did_you_mean(name, names) or '.'}",
                where=source,
            )


def _field(symbol: Symbol) -> Any:
    return symbol.owner.fields.get(symbol.name)
