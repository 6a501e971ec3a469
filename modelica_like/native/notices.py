"""What a run tells about itself: ever faster impacts that ended in contact, and reactions that elements share."""

from __future__ import annotations

import math

from modelica_like.compile.compiled import CompiledDae
from modelica_like.options import Options
from modelica_like.solve.initialize import Point, sharing
from modelica_like.solve.recorder import Recorder

_CHATTER_INSTANTS = 25
_CHATTER_WINDOW = 1e-6
"""Of a run: so many instants in a shorter time follow each other ever faster, as in events.c."""


def note_rest(record: Recorder, options: Options, span: float) -> None:
    """Add a notice for every time from which on impacts that followed each other ever faster ended in contact."""
    if options.on_chattering != "rest":
        return
    times = list(dict.fromkeys(event.time for event in record.events))
    rested = -math.inf
    for first, last in zip(times, times[_CHATTER_INSTANTS - 1 :], strict=False):
        if last - first < _CHATTER_WINDOW * span and first > rested + _CHATTER_WINDOW * span:
            rested = last
            parts = dict.fromkeys(impact.component for impact in record.impacts if first <= impact.time <= last)
            place = f"{last:.9g} s on, {', '.join(parts) or 'the model'}"
            record.notices.append(f"From {place} rests in contact: impacts followed each other ever faster.")


def note_sharing(record: Recorder, model: CompiledDae, now: Point) -> None:
    """Add one notice about elements that share an undetermined reaction."""
    for parts in sharing(model, now):
        text = (
            f"{', '.join(parts[:-1])} and {parts[-1]} hold the same motion: they share the reaction in proportion "
            "to what they can bear, because nothing else determines the split."
        )
        if text not in record.notices:
            record.notices.append(text)
