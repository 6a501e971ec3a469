"""State selection: dummy derivatives, chosen by preference and by the numbers."""

from __future__ import annotations

from modelica_like.errors import Overdetermined
from modelica_like.structure.diagnose import doubly_fixed
from modelica_like.structure.matching import Elimination
from modelica_like.structure.system import System


def select_states(system: System, counts: list[int], slopes: list[dict[int, float]]) -> list[int]:
    """Choose the levels that become states.

    Args:
        system: with all levels that the differentiated equations need.
        counts: number of differentiations of each equation.
        slopes: for every equation the derivative of its highest differentiation by the highest level of each chain,
            as numbers at a generic point.

    Returns:
        Level numbers, in the order of declaration.

    Raises:
        Overdetermined: the constraints are dependent.

    Source: Mattsson and Söderlind, SIAM J. Sci. Comput. 14 (1993) 677-692.
    """
    known = set(system.inputs)
    dummies: set[int] = set()
    stage = 1
    candidates = everything = [c for c, chain in enumerate(system.chains) if chain[0] not in known]
    while rows := [e for e, count in enumerate(counts) if count >= stage]:
        # As a rule a position is a state if its speed is one. A relative angle between two shafts with friction, whose
        # speeds are wanted more than the relative one, is a state all the same: absolute angles grow without bound.
        choices = [_least(system, rows, some, stage, slopes) for some in (candidates, everything)]
        chosen = min(choices, key=lambda one: (-len(one), sum(_preference(system, c, stage) for c in one)))
        if len(chosen) < len(rows):
            raise _dependent(system, [e for e in rows if e not in chosen.values()])
        dummies.update(system.chains[c][-1 - stage] for c in chosen)
        candidates = list(chosen)
        stage += 1
    highest = {chain[-1] for chain in system.chains}
    return [n for n in range(len(system.levels)) if n not in dummies and n not in highest and n not in known]


def _least(
    system: System, rows: list[int], chains: list[int], stage: int, slopes: list[dict[int, float]]
) -> dict[int, int]:
    """Choose the chains that least want to be states; return chain -> row that determines it."""
    columns = [c for c in chains if len(system.chains[c]) > stage]
    columns.sort(key=lambda c: (_preference(system, c, stage), -c))
    return _independent(rows, columns, slopes)


def _preference(system: System, chain: int, stage: int) -> int:
    return system.levels[system.chains[chain][-1 - stage]].preference


def _independent(rows: list[int], columns: list[int], slopes: list[dict[int, float]]) -> dict[int, int]:
    """Choose columns in their order as long as they are linearly independent; return column -> pivot row."""
    entries: dict[int, dict[int, float]] = {c: {} for c in columns}
    for row in rows:
        for column, slope in slopes[row].items():
            if column in entries:
                entries[column][row] = slope
    found, chosen = Elimination(len(rows)), dict[int, int]()
    for column in columns:
        if found.add(entries[column]):
            chosen[column] = found.pivot
    return chosen


def _dependent(system: System, equations: list[int]) -> Overdetermined:
    origins = [system.origins[e] for e in equations]
    places = ", ".join(dict.fromkeys(o.path or o.kind for o in origins))
    what = f"The motion is constrained twice: the constraint of {places} follows from others."
    return doubly_fixed(system.model, origins, what, "Rigid parts form a loop, or two parts fix the same {potential}.")
