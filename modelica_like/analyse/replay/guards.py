"""Guards at the points of a run that is differentiated."""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, CompiledTransition, Vector
from modelica_like.flatten.conditions import JUST_TRUE
from modelica_like.solve.initialize import Point

_NOISE = 1e-30
"""Values with which a decaying signal oscillates around zero; this is not an event."""
_LARGE = 1e300


class Guards:
    """Evaluates guards and their rates, with the active ones of each mode."""

    def __init__(self, model: CompiledDae) -> None:
        self.model = model
        self.state_events = [t for t in model.events.transitions if not t.timed]
        self.count = len(self.state_events)
        self.positions = {id(e): k for k, e in enumerate(self.state_events)}
        self._at = model.fast(Cached.GUARDS, lambda: _clean(model, self.state_events))

    def at(self, point: Point) -> list[Vector]:
        """Return guards, their rates, and guards one time resolution later; inactive ones are -1."""
        return self._at(point.t, point.x, point.z, self.model.p, self.model.u, point.d)

    def wanting(self, point: Point) -> list[CompiledTransition]:
        """State events that fire now: positive within the time resolution."""
        if not self.count:
            return []
        return [self.state_events[k] for k in (self.at(point)[2] > 0).nonzero()[0]]


def _clean(model: CompiledDae, events: list[CompiledTransition]) -> ca.Function:
    """Guards, rates and guards a moment later, with inactive ones set by the modes."""
    arguments, d = list(model.arguments.values()), model.arguments["d"]
    rates = model.events.guard_rates(*arguments)
    rates = ca.densify(ca.if_else(ca.fabs(rates) <= _LARGE, rates, 0))
    may = ca.vertcat(*(functools.reduce(ca.logic_or, [d[e.mode] == k for k in e.sources]) for e in events))
    guards, soon = (
        ca.if_else(may, _numbers(function(*arguments)), -1) if events else ca.SX(0, 1)
        for function in (model.events.guards, model.events.guards_soon)
    )
    return ca.Function("guards_at", arguments, [ca.densify(c) for c in ca.cse([guards, rates, soon])])


def _numbers(guards: Any) -> Any:
    """Set a guard that is not a number to false, and rounding to zero."""
    sizes = ca.fabs(guards)
    rounding = ca.logic_and(sizes < _NOISE, sizes > JUST_TRUE)
    numbers = ca.if_else(guards > _LARGE, _LARGE, ca.if_else(guards >= -_LARGE, guards, -1))
    return ca.densify(ca.if_else(rounding, 0, numbers))
