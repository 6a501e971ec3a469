"""Guards a moment later: the direction in which a guard leaves zero."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from modelica_like.language.expr import operands

TIME_RESOLUTION = 1e-10
"""Time resolution of events relative to max(1 s, |t|).

Guards are evaluated this much later, so that for a guard that just left zero the direction decides.
"""

_JOINS: dict[int, Callable[[Any, Any], Any]] = {ca.OP_FMIN: ca.fmin, ca.OP_FMAX: ca.fmax}


def time_resolution(t: float) -> float:
    """Return the time resolution of events at a time, in s."""
    return TIME_RESOLUTION * max(1.0, abs(t))


def ahead(t: Any) -> Any:
    """Return the time resolution at a time, both expressions in s."""
    return TIME_RESOLUTION * ca.fmax(1.0, ca.fabs(t))


def guards_soon(t: Any, rate: Callable[[Any], Any], guards: Any) -> Any:
    """Follow guards for one time resolution.

    Joined relations are followed one by one: a relation that stays at zero never counts as true.

    Args:
        t: time.
        rate: returns time derivatives of expressions.
        guards: a column.
    """
    if not guards.numel():
        return guards
    relations: list[Any] = []
    joined(guards, lambda relation: relations.append(relation) or relation)
    stacked = ca.vertcat(*relations)
    later = iter(ca.vertsplit(stacked + ahead(t) * rate(stacked)))
    return joined(guards, lambda _: next(later))


def joined(guards: Any, relation: Callable[[Any], Any]) -> Any:
    """Rebuild a column of guards with another expression for every relation."""

    def rebuilt(guard: Any) -> Any:
        join = _JOINS.get(guard.op())
        return join(*map(rebuilt, operands(guard))) if join else relation(guard)

    return ca.vertcat(*(rebuilt(guard) for guard in ca.vertsplit(guards)))
