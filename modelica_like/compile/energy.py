"""Energy terms of all components, as one table."""

from __future__ import annotations

from typing import Any

import casadi as ca

from modelica_like.structure.reduce import ReducedDae


def energy_terms(reduced: ReducedDae) -> Any:
    """Write out the energy terms of every component.

    Returns:
        One row per component: stored energy, loss, source power, power in, rate of the stored energy, and the sum of
        the magnitudes of the powers through its connectors, the scale of rounding of the power in.
    """
    flat = reduced.flat
    variable = {one.path: k for k, one in enumerate(flat.variables)}
    alike: dict[int, list[int]] = {}
    for k, instance in enumerate(flat.instances):
        alike.setdefault(id(instance.template), []).append(k)
    parts: list[Any] = []
    for members in alike.values():
        # One call for all components of a class: calls cost more than their expressions.
        template, slots = flat.instances[members[0]].template, list[Any]()
        for instance in (flat.instances[k] for k in members):
            prefix = f"{instance.path}." if instance.path else ""
            nodes = ((variable[prefix + slot.path], slot.order) for slot in template.energy_slots)
            slots += [reduced.rate(node) if order else reduced.values[node] for node, order in nodes]
        p, d = (
            symbols[[place for k in members for place in getattr(flat.instances[k], name)]]
            for symbols, name in ((flat.q, "parameters"), (flat.d, "discretes"))
        )
        given = [ca.reshape(one, one.numel() // len(members), len(members)) for one in (ca.vertcat(*slots), p, d)]
        terms = template.energy(*given, ca.repmat(flat.time, 1, len(members)))
        powers = terms[3:, :]
        parts.append(ca.vertcat(terms[:3, :], ca.sum1(powers), ca.sum1(ca.fabs(powers))).T)
    order = sorted(range(len(flat.instances)), key=[k for members in alike.values() for k in members].__getitem__)
    stored, loss, source, inflow, passing = ca.horzsplit(ca.vertcat(*parts)[order, :])
    return ca.horzcat(stored, loss, source, inflow, reduced.total_derivative(stored), passing)
