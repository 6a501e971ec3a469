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

_LARGE = 1e300
_STEEP = frozenset({
    ca.OP_SQRT, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_LOG, ca.OP_LOG1P, ca.OP_ASIN, ca.OP_ACOS, ca.OP_ACOSH, ca.OP_ATANH,
})  # fmt: skip
"""Operations whose derivative may be infinite where they are not."""
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
    rates = rate(stacked)
    if _may_be_steep(stacked):
        rates = ca.if_else(ca.fabs(rates) <= _LARGE, rates, ca.sign(rates))
    later = iter(ca.vertsplit(stacked + ahead(t) * rates))
    return joined(guards, lambda _: next(later))


def _may_be_steep(relations: Any) -> bool:
    """Tell whether a rate may be infinite, as of a root at zero: it tells the direction only, not how far."""
    function = ca.Function("relations", ca.symvar(relations), [relations])
    return any(function.instruction_id(k) in _STEEP for k in range(function.n_instructions()))


def joined(guards: Any, relation: Callable[[Any], Any]) -> Any:
    """Rebuild a column of guards with another expression for every relation."""

    def rebuilt(guard: Any) -> Any:
        join = _JOINS.get(guard.op())
        return join(*map(rebuilt, operands(guard))) if join else relation(guard)

    return ca.vertcat(*(rebuilt(guard) for guard in ca.vertsplit(guards)))
