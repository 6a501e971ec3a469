"""Guards a moment later: the direction in which a guard leaves zero."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from modelica_like.structure.reduce import ReducedDae

TIME_RESOLUTION = 1e-10
"""Time resolution of events relative to max(1 s, |t|).

Guards are evaluated this much later, so that for a guard that just left zero the direction decides.
"""

_JOINS: dict[int, Callable[[Any, Any], Any]] = {ca.OP_FMIN: ca.fmin, ca.OP_FMAX: ca.fmax}


def time_resolution(t: float) -> float:
    """Return the time resolution of events at a time, in s."""
    return TIME_RESOLUTION * max(1.0, abs(t))


def guards_soon(reduced: ReducedDae, guards: Any) -> Any:
    """Follow guards for one time resolution.

    Joined relations are followed one by one: a relation that stays at zero never counts as true.
    """
    if not guards.numel():
        return guards
    relations: list[Any] = []
    _joined(guards, lambda relation: relations.append(relation) or relation)
    stacked = ca.vertcat(*relations)
    ahead = TIME_RESOLUTION * ca.fmax(1.0, ca.fabs(reduced.flat.time))
    later = iter(ca.vertsplit(stacked + ahead * reduced.total_derivative(stacked)))
    return _joined(guards, lambda _: next(later))


def _joined(guards: Any, relation: Callable[[Any], Any]) -> Any:
    """Rebuild guards with another expression for every relation."""

    def rebuilt(guard: Any) -> Any:
        join = _JOINS.get(guard.op())
        return join(rebuilt(guard.dep(0)), rebuilt(guard.dep(1))) if join else relation(guard)

    return ca.vertcat(*(rebuilt(guard) for guard in ca.vertsplit(guards)))
