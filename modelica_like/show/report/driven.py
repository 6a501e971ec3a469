"""Notes about what drives: weights that fall, and loads that push."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from modelica_like.language.component import Component
from modelica_like.runs.energy import EnergyRow
from modelica_like.runs.solution import Solution
from modelica_like.show.draw.diagram import Diagram, Node, Port
from modelica_like.show.draw.running import path_of, power_into, used_connector

_MATTERS = 0.01
"""Share of the supply above which an energy counts."""
_LINEAR = 1e-6
"""Share of the stored energy's range by which it may differ from that of a weight."""


def driven_notes(drawn: Diagram, run: Solution) -> Iterator[str]:
    """Yield notes about weights that bring in more than all sources, and about drives that are pushed from both ends.

    Args:
        drawn: the drive with closed assemblies.
        run: its run.
    """
    balance = run.energy()
    least, sources = _MATTERS * balance.supply, sum(max(row.source, 0.0) for row in balance)
    gave = {row.component for row in balance if -row.stored > max(sources, least)}
    for node in drawn.nodes:
        fallen = _fall(node.component, run) if node.component and node.name in gave else None
        if fallen and fallen[1] > max(sources, least):
            yield (
                f"The weight of {node.name} ({fallen[0]:.4g} N) falls and brings in {fallen[1]:.4g} J, all sources "
                f"together {sources:.4g} J: gravity drives. If it should be lifted, look at the signs."
            )
    for group in _chains(drawn):
        givers = _givers(group, run, balance.rows, least)
        if len(givers) > 1:
            names = " and ".join(node.name for node in givers)
            yield (
                f"{names} bring energy into one chain of shafts, and nothing takes it out: is the sign of one of them "
                f"wrong?"
            )


def _moves(port: Port) -> bool:
    """Whether it is the end of a shaft or slide."""
    connector = port.node.component and used_connector(port.node.component, port.name)
    return bool(connector) and any(str(field.unit) in ("rad", "m") for field in connector.fields.values())


def _fall(part: Component, run: Solution) -> tuple[float, float] | None:
    """Return weight in N and energy in J brought in by a part that has fallen.

    Its stored energy is a force times its way, plus half a mass times its speed squared, and nothing else.
    """
    ends = [(name, field.name) for name, connector in part.connectors.items() if connector.used
            for field in connector.fields.values() if str(field.unit) == "m"]  # fmt: skip
    path = path_of(part)
    if not ends or part.parts:
        return None
    way, stored = run[f"{path}.{'.'.join(ends[0])}"], run[f"{path}.stored_energy"]
    if np.ptp(stored) == 0.0 or np.ptp(way) == 0.0:
        return None
    speeds = [variable.path for variable in run.model.flat_variables
              if variable.path.rpartition(".")[0] == path and str(variable.unit) == "m/s"]  # fmt: skip
    terms = [np.ones_like(way), way - way[0], *(run[speed] ** 2 for speed in speeds[:1])]
    columns = np.column_stack([term / (np.max(np.abs(term)) or 1.0) for term in terms])
    factors, *_ = np.linalg.lstsq(columns, stored, rcond=None)
    if np.max(np.abs(columns @ factors - stored)) > _LINEAR * np.ptp(stored):
        return None
    weight = factors[1] / np.max(np.abs(terms[1]))
    return abs(float(weight)), float(-weight * (way[-1] - way[0]))


def _chains(drawn: Diagram) -> list[list[Node]]:
    """Return parts that shafts and slides join."""
    chains: dict[int, dict[Node, None]] = {}
    chain_of: dict[Node, dict[Node, None]] = {}
    for net in drawn.nets:
        new = dict.fromkeys(port.node for port in net.ports if _moves(port))
        chain, *others = [*{id(one): one for node in new if (one := chain_of.get(node))}.values()] or [{}]
        for part in (*others, new):
            chain |= part
            chain_of |= dict.fromkeys(part, chain)
        for one in (*others, chain):
            chains.pop(id(one), None)
        chains |= {id(chain): chain} if chain else {}
    return [list(chain) for chain in chains.values()]


def _givers(group: list[Node], run: Solution, rows: tuple[EnergyRow, ...], least: float) -> list[Node]:
    """Return the parts at the ends of a chain that push it; none if something there takes energy out."""
    span, nodes = float(run.time[-1] - run.time[0]), list[Node]()
    for node in group:
        ports = [port for port in node.ports.values() if _moves(port)]
        if len(ports) != 1 or node.component is None:
            continue
        powers = [row for row in rows if f"{row.component}.".startswith(f"{path_of(node.component)}.")]
        into = (power_into(ports[0], run) or 0.0) * span
        if (into > least and sum(row.lost for row in powers) > least) or sum(row.source for row in powers) < -least:
            return []
        if -into - max(0.0, -sum(row.stored for row in powers)) > least:
            nodes.append(node)
    return nodes
