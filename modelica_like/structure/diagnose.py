"""Diagnosis of systems without a unique solution: the Dulmage-Mendelsohn blocks, in sentences."""

from __future__ import annotations

import casadi as ca

from modelica_like.errors import Overdetermined, Source, Underdetermined
from modelica_like.flatten.model import Origin
from modelica_like.structure.system import System

_SHOWN = 6


def check_solvable(system: System, incidence: list[list[int]], contradictions: list[Origin]) -> None:
    """Check that the equations can determine every variable, derivatives aside.

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
    # CasADi's coarse blocks: first what has too many equations, then the square part, then what has too few.
    over_rows, over_cols = rows[: coarse_rows[2]], cols[: coarse_cols[1]]
    under_rows, under_cols = rows[coarse_rows[3] :], cols[coarse_cols[2] :]
    if len(over_rows) > len(over_cols):
        over, under = ([_chain_name(system, chains[c]) for c in block] for block in (over_cols, under_cols))
        raise _overdetermined([system.origins[r] for r in over_rows], over, under)
    if contradictions:
        raise _contradiction(contradictions)
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


def _places(origins: list[Origin]) -> list[Source]:
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
        advice=f"{missing} more equation{'s are' if missing > 1 else ' is'} needed: connect what is open, or fix it.",
    )


def _overdetermined(origins: list[Origin], over: list[str], under: list[str]) -> Overdetermined:
    parts = list(dict.fromkeys(o.path or o.kind for o in origins))
    unknowns = f"{len(over)} unknown{'s' if len(over) != 1 else ''} ({_list(over) or 'none'})"
    what = f"{len(origins)} equations determine only {unknowns}: {_list(parts)}."
    where = _places(origins)
    if len(parts) > 1 or not under:
        why, advice = "Two rigid parts fix the same speed or torque.", "Remove one, or put a spring or clutch between."
    else:
        why = f"On the other hand {_list(under)} lack{'s' if len(under) == 1 else ''} an equation."
        advice = f"Look at the equations of {parts[0]}: is another variable meant in one of them?"
    return Overdetermined(what, where=where, why=why, advice=advice)


def _contradiction(origins: list[Origin]) -> Overdetermined:
    parts = list(dict.fromkeys(o.path or o.kind for o in origins))
    fix = "fixes" if len(parts) == 1 else "fix"
    return Overdetermined(
        f"{_list(parts)} {fix} the same angle, speed or torque more than once.",
        where=_places(origins),
        why="Two parts prescribe it, or rigid parts form a loop.",
        advice="Remove one, or put a spring or clutch between.",
    )
