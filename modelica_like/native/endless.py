"""Messages about events without end."""

from __future__ import annotations

from collections.abc import Sequence

from modelica_like.compile.compiled import CompiledDae, CompiledTransition
from modelica_like.errors import Chattering
from modelica_like.options import OnChattering
from modelica_like.solve.initialize import Point, call
from modelica_like.solve.recorder import Event

_CHATTER_EVENTS = 50
_HINT = "Give the switching a hysteresis (a peak above 1 in friction), or smooth what drives it."
_STICK = (
    "If this is friction, take a class that can stick, such as BearingFriction, Brake, Clutch or SupportFriction; "
    "otherwise give the switching a hysteresis, or smooth what drives it."
)
_GO_ON = (
    ' Or go on: on_chattering = "slide" along the border of two modes, "rest" in contact after ever faster impacts.'
)
_CANNOT = {
    "stop": "",
    "slide": (
        " It cannot slide: that takes two values of a mode that change into each other under opposite conditions, "
        "without resets, and that decide how what is compared changes."
    ),
    "rest": " Nothing comes to rest: that takes impacts of a mode that holds a motion, with a restitution.",
}
_LET_IT_REST = (
    "Let it rest: a mode that holds the motion, with a restitution (docs/language.md, what a mode holds), or a "
    "smallest speed below which `when` sets zero and a mode keeps it. What stops once and goes on from there is a "
    "transition of a mode with a reset."
)
SWITCHING = "Modes still switch after {} rounds at one instant"
"""Why modes are told to chatter."""


def chattering(model: CompiledDae, events: Sequence[Event], why: str, on_chattering: OnChattering) -> Chattering:
    """Return the error of a run whose last events switch without end, whatever `on_chattering` was to prevent that."""
    counts: dict[str, list[Event]] = {}
    for event in events[-_CHATTER_EVENTS:]:
        counts.setdefault(event.mode, []).append(event)
    mode, those = max(counts.items(), key=lambda item: len(item[1]))
    names = " ⇄ ".join(dict.fromkeys(name for event in those for name in (event.before, event.after)))
    first, last = f"{those[0].time:.9g}", f"{those[-1].time:.9g}"
    when = f"at t = {last} s" if first == last else f"in t = {first}…{last} s"
    owner, _, name = mode.rpartition(".")
    hint = _STICK if name.startswith("relation[") else _HINT
    if hysteresis := model.flat_discretes[model.discrete_position[mode]].hysteresis:
        hint = f"{owner or model.name}: set {hysteresis}, or smooth what drives it."
    return Chattering(
        f"{mode} switched {len(those)} times {when} ({names}).",
        where=list(dict.fromkeys(event.source for event in those))[:3],
        why=f"{why}.{_CANNOT[on_chattering]}",
        advice=hint + (_GO_ON if on_chattering == "stop" else ""),
    )  # fmt: skip


def not_settled(model: CompiledDae, now: Point, rounds: int) -> Chattering | None:
    """Return the error of discrete variables that change in every round, or None where they only follow the modes."""
    values = call(model, model.events.updates, now)
    rows = [row for row, value in zip(model.events.update_rows, values, strict=False)
            if row.reset.kind == "discrete" and value != now.d[row.reset.index]]  # fmt: skip
    if not rows:
        return None
    names = ", ".join(model.flat_discretes[row.reset.index].path for row in rows)
    change = "changes" if len(rows) == 1 else "change"
    return Chattering(
        f"Discrete variables do not settle at t = {now.t:.9g} s: {names} still {change} after {rounds} rounds.",
        where=[row.source for row in rows if row.source.file][:3],
        advice="An equation like n == pre(n) + 1 never equals its pre(…): count in a `when`.",
    )


def stays_true(model: CompiledDae, now: Point, transition: CompiledTransition) -> Chattering:
    """Return the error of a relation that stays true."""
    return Chattering(
        f"At {now.t:.9g} s the condition of {model.flat_discretes[transition.mode].path} stays true: what is set there "
        "is at rest, and would pass without another event.",
        where=[transition.source],
        advice=_LET_IT_REST,
    )
