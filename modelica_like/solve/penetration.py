"""States that a `when` turns back at a border, but not in time: they pass it without a word."""

from __future__ import annotations

from collections.abc import Sequence

from modelica_like.compile.compiled import CompiledDae, CompiledTransition
from modelica_like.compile.soon import time_resolution
from modelica_like.errors import Chattering
from modelica_like.solve.initialize import Point, call

_LATER = 1e3
"""Time for the difference of a rate, in time resolutions; what turns round in less time is at rest."""
_LET_IT_REST = (
    "Let it rest: a mode that holds the motion, with a restitution (docs/language.md, what a mode holds), or a "
    "smallest speed below which `when` sets zero and a mode keeps it."
)


def check_turned_back(model: CompiledDae, fired: Sequence[CompiledTransition], before: Point, now: Point) -> None:
    """Check that relations which became true become false again, where a `when` sets states that have come to rest.

    A ball rebounds ever more slowly, until the acceleration a of the guard turns it back within few time resolutions.
    With value g and rate r < 0 after that, g - r² / 2a is the least value that comes: above zero the relation stays
    true, fires no more, and the ball falls through the floor.

    Args:
        model: the compiled model.
        fired: transitions of the instant that were located.
        before: point before the instant.
        now: point after it.

    Raises:
        Chattering: one stays true.
    """
    # A mode that somebody has declared has changed with its condition, and may keep it.
    hidden = [one for one in fired if model.flat_discretes[one.mode].hidden]
    turned = [one for one in hidden if not one.timed and not one.resets and now.d[one.mode] == one.target]
    if not turned or (before.x == now.x).all():
        return
    step = _LATER * time_resolution(now.t)
    later = now.copy()
    later.t, later.x = now.t + step, now.x + step * call(model, model.ode, now)
    rates = [call(model, model.guard_rates, one) for one in (before, now, later)]
    values = call(model, model.guards, now)
    ends = values + 0.5 * step * (rates[1] + rates[2])
    if any(ends[one.index] > 0 and now.d[one.mode] in one.sources for one in model.transitions if not one.timed):
        return  # another event comes
    for one in turned:
        r0, r, r1 = (float(rate[one.index]) for rate in rates)
        acceleration, value = (r1 - r) / step, float(values[one.index])
        slow = max(abs(r0), abs(r)) < acceleration * step
        if slow and (r > -acceleration * step / _LATER or value > r * r / (2 * acceleration)):
            raise stays_true(model, now, one)


def stays_true(model: CompiledDae, now: Point, transition: CompiledTransition) -> Chattering:
    """Return the error of a relation that stays true."""
    return Chattering(
        f"At {now.t:.9g} s the condition of {model.flat_discretes[transition.mode].path} stays true: what is set there "
        "is at rest, and would pass without another event.",
        where=[transition.source],
        advice=_LET_IT_REST,
    )
