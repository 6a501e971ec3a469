"""The equations between start values and states, kept as sparse as the model."""

from __future__ import annotations

from typing import Any

import casadi as ca

from modelica_like.structure.reduce import ReducedDae


def start_system(reduced: ReducedDae) -> ca.Function:
    """Build the start system.

    A variable such as the speed of the last mass of a chain is the sum of all relative speeds. Written out, N such
    variables are N^2 terms; with the
    variables in between as unknowns y of their own, the system stays as sparse as the chain.

    Returns:
        Function of (t, x, y, z, p, u, d) with the results y, the Jacobian of the values by (x, y, z), and the values of
        [y - expression, alg, variables with start values].
    """
    flat, system = reduced.flat, reduced.system
    nodes = list(dict.fromkeys(s.node for s in flat.starts))
    needed = _needed(reduced, nodes)
    y = ca.vertcat(*(system.symbols[level] for level, _ in needed)) if needed else ca.SX(0, 1)
    explicit = ca.vertcat(*(system.symbols[level] - expression for level, expression in needed))
    wanted = ca.vertcat(*(_node_value(reduced, node) for node in nodes))
    values = ca.densify(ca.vertcat(explicit, reduced.alg, wanted))
    unknowns = ca.vertcat(reduced.x, y, reduced.z)
    arguments = [flat.time, reduced.x, y, reduced.z, flat.p, reduced.u, flat.d]
    results = [y, ca.jacobian(values, unknowns), values]
    return ca.Function(
        "start_system", arguments, results, ["t", "x", "y", "z", "p", "u", "d"], ["variables", "jacobian", "values"]
    )


def _node_value(reduced: ReducedDae, node: int) -> Any:
    return reduced.system.node_values[node]


def _needed(reduced: ReducedDae, nodes: list[int]) -> list[tuple[int, Any]]:
    """The explicit unknowns that the start nodes need, directly or by others."""
    system = reduced.system
    pending = {placed[0] for node in nodes if (placed := system.node_level[node]) is not None}
    position = {level: k for k, (level, _) in enumerate(reduced.explicit)}
    if not pending & set(position):
        return []
    uses = _uses(reduced)
    needed: set[int] = set()
    stack = [level for level in pending if level in position]
    while stack:
        level = stack.pop()
        if level in needed:
            continue
        needed.add(level)
        stack += [other for other in uses[position[level]] if other in position]
    return [pair for pair in reduced.explicit if pair[0] in needed]


def _uses(reduced: ReducedDae) -> list[list[int]]:
    """Levels that occur in the expression of each explicit unknown."""
    flat, system = reduced.flat, reduced.system
    symbols = ca.vertcat(*system.symbols)
    expressions = ca.vertcat(*(expression for _, expression in reduced.explicit))
    function = ca.Function("explicit", [symbols, flat.p, flat.d, flat.time], [expressions])
    uses: list[list[int]] = [[] for _ in reduced.explicit]
    for row, column in zip(*function.jac_sparsity(0, 0).get_triplet(), strict=True):
        uses[row].append(column)
    return uses
