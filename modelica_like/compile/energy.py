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
    variable = {entry.path: k for k, entry in enumerate(flat.variables)}
    rows: list[Any] = []
    for instance in flat.instances:
        template = instance.template
        prefix = f"{instance.path}." if instance.path else ""
        nodes = [(variable[prefix + slot.path], slot.order) for slot in template.energy_slots]
        slots = [reduced.rate(node) if order else reduced.values[node] for node, order in nodes]
        p, d = flat.q[list(instance.parameters)], flat.d[list(instance.discretes)]
        stored, loss, source, *powers = ca.vertsplit(template.energy(ca.vertcat(*slots), p, d, flat.time))
        rows.append((stored, loss, source, sum(powers), sum(map(ca.fabs, powers))))
    stored, loss, source, inflow, passing = (ca.vertcat(*terms) for terms in zip(*rows, strict=True))
    return ca.horzcat(stored, loss, source, inflow, reduced.total_derivative(stored), passing)
