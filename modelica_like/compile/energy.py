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
    rows: list[Any] = []
    for instance in flat.instances:
        template = instance.template
        prefix = f"{instance.path}." if instance.path else ""
        slots: list[Any] = []
        for slot in template.energy_slots:
            node = variable[prefix + slot.path]
            value = reduced.values[node] if slot.order == 0 else reduced.rate(node)
            slots.append(value)
        v = ca.vertcat(*slots) if slots else ca.SX(0, 1)
        p = flat.q[list(instance.parameters)] if instance.parameters else ca.SX(0, 1)
        d = flat.d[list(instance.discretes)] if instance.discretes else ca.SX(0, 1)
        terms = template.energy(v, p, d, flat.time)
        powers = terms[3:]
        inflow = ca.sum1(powers) if powers.numel() else ca.SX(0)
        passing = ca.sum1(ca.fabs(powers)) if powers.numel() else ca.SX(0)
        rows.append(ca.horzcat(terms[0], terms[1], terms[2], inflow, passing))
    table = ca.vertcat(*rows)
    return ca.horzcat(table[:, :4], reduced.total_derivative(table[:, 0]), table[:, 4])
