"""Diagnosis of systems without a unique solution, from the Dulmage-Mendelsohn blocks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from modelica_like.errors import Overdetermined, Source, Underdetermined
from modelica_like.flatten.model import FlatModel, Origin
from modelica_like.language.declared import Connector, Domain
from modelica_like.structure.system import System

_SHOWN = 6


def check_solvable(system: System, incidence: list[list[int]], contradictions: list[Origin]) -> None:
    """Check that the equations can determine every variable.

    Args:
        system: the equations.
        incidence: level numbers in each equation.
        contradictions: origins of the equations that the alias elimination found to be redundant.

    Raises:
        Underdetermined: some unknowns have too few equations.
        Overdetermined: some equations have too few unknowns.
    """
    inputs = {system.levels[n].chain for n in system.inputs}
    columns = {chain: k for k, chain in enumerate(c for c in range(len(system.chains)) if c not in inputs)}
    pairs = {
        (row, columns[c])
        for row, levels in enumerate(incidence)
        for n in levels
        if (c := system.levels[n].chain) in columns
    }
    chains = list(columns)
    sparsity = ca.Sparsity.triplet(len(incidence), len(chains), [r for r, _ in pairs], [c for _, c in pairs])
    _, rows, cols, _, _, coarse_rows, coarse_cols = sparsity.btf()
    # CasADi's coarse blocks: first the overdetermined, then the square, then the underdetermined part.
    over_rows, over_cols = rows[: coarse_rows[2]], cols[: coarse_cols[1]]
    under_rows, under_cols = rows[coarse_rows[3] :], cols[coarse_cols[2] :]
    if len(over_rows) > len(over_cols):
        over, under = ([_chain_name(system, chains[c]) for c in block] for block in (over_cols, under_cols))
        raise _overdetermined(system.model, [system.origins[r] for r in over_rows], over, under)
    if contradictions and len(under_cols) > len(under_rows) and all(o.kind == "free end" for o in contradictions):
        raise _without_potential(system, contradictions, [chains[c] for c in under_cols])
    if contradictions:
        parts = _parts(contradictions)
        what = (
            f"{_list(parts)} {'fixes' if len(parts) == 1 else 'fix'} the same {{potential}} or {{flow}} more than once."
        )
        raise doubly_fixed(system.model, contradictions, what, "Two parts prescribe it, or rigid parts form a loop.")
    if len(under_cols) > len(under_rows):
        raise _underdetermined(
            system,
            len(incidence),
            len(chains),
            [system.origins[r] for r in under_rows],
            [chains[c] for c in under_cols],
        )


def _chain_name(system: System, chain: int) -> str:
    return system.levels[system.chains[chain][0]].name


def _list(names: list[str]) -> str:
    shown = ", ".join(names[:_SHOWN])
    return f"{shown}, … ({len(names)} in all)" if len(names) > _SHOWN else shown


def _places(origins: Sequence[Origin]) -> list[Source]:
    return list(dict.fromkeys(o.source for o in origins if o.source.file))[:_SHOWN]


def _underdetermined(
    system: System, equations: int, unknowns: int, origins: list[Origin], chains: list[int]
) -> Underdetermined:
    names = [_chain_name(system, c) for c in chains]
    missing = len(chains) - len(origins)
    if origins:
        where = f"{_list(names)} occur only in the equations below, {len(origins)} for {len(chains)} unknowns."
    else:
        where = f"{_list(names)} occur{'s' if len(names) == 1 else ''} in no equation."
    return Underdetermined(
        f"{system.model.name}: {equations} equations, {unknowns} unknowns. {where}",
        where=_places(origins),
        advice=f"{missing} more equation{'s are' if missing > 1 else ' is'} needed: connect open ends, or fix them.",
    )


def _overdetermined(model: FlatModel, origins: list[Origin], over: list[str], under: list[str]) -> Overdetermined:
    parts = _parts(origins)
    unknowns = f"{len(over)} unknown{'s' if len(over) != 1 else ''} ({_list(over) or 'none'})"
    what = f"{len(origins)} equations determine only {unknowns}: {_list(parts)}."
    if len(parts) == 1 and under:
        why = f"In addition, {_list(under)} lack{'s' if len(under) == 1 else ''} an equation."
        advice = f"Check the equations of {parts[0]}: does one of them use the wrong variable?"
        return Overdetermined(what, where=_places(origins), why=why, advice=advice)
    return doubly_fixed(model, origins, what, "Two rigid parts fix the same {potential} or {flow}.")


def _without_potential(system: System, ends: list[Origin], chains: list[int]) -> Underdetermined:
    """Return the error about parts that only join free ends: their flows are zero twice, no potential is given."""
    domain, network = _domain(system.model, ends)
    where = [system.model.components[path].place_of() for path in network][:_SHOWN]
    return Underdetermined(
        f"Nothing determines {_list([_chain_name(system, c) for c in chains])}: {_list(_parts(ends))} are free, "
        f"so they carry no {domain.flow}, and no part gives the {domain.potential}.",
        where=where,
        advice=f"Connect a part that has or prescribes a {domain.potential} to one of them.",
    )


def doubly_fixed(model: FlatModel, origins: Sequence[Origin], what: str, why: str) -> Overdetermined:
    """Return the error about equations that fix the same quantity more than once.

    Args:
        model: the flat model.
        origins: of the equations.
        what: the error, with {potential} and {flow} for the domain's words.
        why: the usual reason, with the same fields.
    """
    domain, network = _domain(model, origins)
    words = {"potential": domain.potential, "flow": domain.flow}
    where = _places(origins)
    advice = f"Remove one, or put {domain.separator} between."
    if between := _separation(model, domain, _parts(origins)):
        where = [*(model.components[path].place_of() for path in _parts(origins)), *where]
    if _has_no_reference(model, domain, network):
        where = [model.components[path].place_of() for path in network][:_SHOWN]
        what = f"The network of {_list(network)} has no {domain.reference}."
        why = f"Every {domain.potential} in it is relative to another one; none is zero."
        advice = f'Connect a part that is = "{domain.reference}" to it.'
        between = None
    return Overdetermined(what.format(**words), where=where, why=why.format(**words), advice=advice, operation=between)


def _separation(model: FlatModel, domain: Domain, parts: Sequence[str]) -> dict[str, Any] | None:
    """Return the operation that puts a spring between two parts, None if its place is not clear.

    It is clear for two parts of a netlist, of which the first has one connection, to one other end.
    """
    components = [model.components[part] for part in parts if "." not in part and part in model.components]
    if not domain.spring or len(parts) != 2 or [bool(c.place_of().statement) for c in components] != [True, True]:
        return None
    connections = (equation.origin for equation in model.linear if equation.origin.kind == "connection")
    joined = {tuple(origin.path.split(" – ")) for origin in connections}
    ends = [ends for ends in joined if any(end.rpartition(".")[0] == parts[0] for end in ends)]
    if len(ends) != 1 or len(ends[0]) != 2:
        return None
    names = (f"spring_{k}" if k > 1 else "spring" for k in range(1, len(model.components) + 2))
    name = next(name for name in names if name not in model.components)
    return {"operation": "insert", "name": name, "kind": domain.spring, "between": [*ends[0]]}


def _parts(origins: Sequence[Origin]) -> list[str]:
    return list(dict.fromkeys(o.path or o.kind for o in origins))


def _kind(model: FlatModel, path: str) -> str:
    return type(model.components[path]).__name__


def _has_no_reference(model: FlatModel, domain: Domain, network: list[str]) -> bool:
    return bool(domain.reference and network and all(_kind(model, path) != domain.reference for path in network))


def _domain(model: FlatModel, origins: Sequence[Origin]) -> tuple[Domain, list[str]]:
    """Return the domain of the equations, and the parts that its connections join, in order.

    Of the domains of a part, that whose network lacks its reference is to blame, otherwise the first one.
    """
    ends = {f"{path}.{name}" if path else name: (path, connector)
            for path, part in model.components.items() for name, connector in part.connectors.items()}  # fmt: skip
    named = {path for origin in origins for path in origin.path.split(" – ")}
    connectors = [connector for end, connector in ends.items() if not named.isdisjoint((end, connector[0]))]
    if not connectors:
        return Domain(), []
    domains = {id(connector.domain): connector.domain for _, connector in connectors}.values()
    networks = [(domain, _network(model, ends, connectors, domain)) for domain in domains]
    return next((network for network in networks if _has_no_reference(model, *network)), networks[0])


def _network(
    model: FlatModel, ends: dict[str, tuple[str, Connector]], connectors: list[tuple[str, Connector]], domain: Domain
) -> list[str]:
    """Return the parts that the connections of a domain join with those found."""
    sets = [origin.path.split(" – ") for equation in model.linear if (origin := equation.origin).kind == "connection"]
    joined = [{ends[end][0] for end in n} for n in sets if n[0] in ends and ends[n[0]][1].domain is domain]
    network = {path for path, connector in connectors if connector.domain is domain}
    while larger := [nodes for nodes in joined if not (nodes <= network or nodes.isdisjoint(network))]:
        network = network.union(*larger)
    return [path for path in model.components if path in network]
