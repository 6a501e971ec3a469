"""State selection: dummy derivatives, chosen by preference and by the numbers."""

from __future__ import annotations

from modelica_like.structure.alias import PREFERRED
from modelica_like.structure.diagnose import doubly_fixed
from modelica_like.structure.matching import Elimination
from modelica_like.structure.system import System

_ABSOLUTE = 2.5
"""Rank of an absolute speed among those of springs: behind one from the ground, before one between two others."""


def select_states(
    system: System, counts: list[int], slopes: list[dict[int, float]], incidence: list[list[int]]
) -> list[int]:
    """Choose the levels that become states.

    Args:
        system: with all levels that the differentiated equations need.
        counts: number of differentiations of each equation.
        slopes: for every equation the derivative of its highest differentiation by the highest level of each chain,
            as numbers at a generic point.
        incidence: level numbers in each equation.

    Returns:
        Level numbers, in the order of declaration.

    Raises:
        Overdetermined: the constraints are dependent.

    Source: Mattsson and Söderlind, SIAM J. Sci. Comput. 14 (1993) 677-692.
    """
    inputs = set(system.inputs)
    dummies: set[int] = set()
    stage = 1
    candidates = {c for c, chain in enumerate(system.chains) if chain[0] not in inputs}
    while rows := [e for e, count in enumerate(counts) if count >= stage]:
        # As a rule a position is a state if its speed is one. A relative angle between two shafts with friction, whose
        # speeds are wanted more than the relative one, is a state all the same: absolute angles grow without bound.
        ranked = [c for c in _ranked(system, counts, slopes, incidence, stage) if system.chains[c][0] not in inputs]
        choices = [_independent(rows, some, slopes) for some in ([c for c in ranked if c in candidates], ranked)]
        chosen = min(
            choices,
            key=lambda choice: (
                -len(choice),
                sum(system.levels[system.chains[c][-1 - stage]].preference for c in choice),
            ),
        )
        if len(chosen) < len(rows):
            equations = [e for e in rows if e not in chosen.values()]
            origins = [system.origins[row] for row in equations]
            places = ", ".join(dict.fromkeys(o.path or o.kind for o in origins))
            what = f"The motion is constrained twice: the constraint of {places} follows from others."
            raise doubly_fixed(
                system.model, origins, what, "Rigid parts form a loop, or two parts fix the same {potential}."
            )
        dummies.update(system.chains[c][-1 - stage] for c in chosen)
        candidates = set(chosen)
        stage += 1
    highest = {chain[-1] for chain in system.chains}
    return [n for n in range(len(system.levels)) if n not in dummies and n not in highest and n not in inputs]


def _ranked(
    system: System, counts: list[int], slopes: list[dict[int, float]], incidence: list[list[int]], stage: int
) -> list[int]:
    """Return the chains that can lose a state; the one that least wants it comes first.

    Of relative motions, one whose position only constraints read, such as a damper's, comes before that of a spring,
    whose digits are those of its force. One from the ground, in a constraint of two, comes before a difference of two
    others: it is not small, and as a sum of others it is as precise. Of other motions, those of connectors come first:
    users know components by their own variables. The speed of a spring between two others, which is small, is wanted
    more than theirs even without a name.
    """
    read = {level for row, count in enumerate(counts) if count < stage for level in incidence[row]}
    shortest: dict[int, int] = {}
    for row, count in enumerate(counts):
        for chain in slopes[row] if count >= stage else ():
            shortest[chain] = min(len(slopes[row]), shortest.get(chain, len(slopes[row])))

    def rank(chain: int) -> tuple[float, ...]:
        base, level = (system.levels[system.chains[chain][k]] for k in (0, -1 - stage))
        wanted, relative = (number.preference >= PREFERRED for number in (level, base))
        length = shortest.get(chain, 0) if wanted or relative else _ABSOLUTE
        return level.preference, system.chains[chain][0] in read if wanted else level.own, length, -chain

    return sorted((c for c, chain in enumerate(system.chains) if len(chain) > stage), key=rank)


def _independent(rows: list[int], columns: list[int], slopes: list[dict[int, float]]) -> dict[int, int]:
    """Choose columns in their order as long as they are linearly independent; return column -> pivot row."""
    entries: dict[int, dict[int, float]] = {c: {} for c in columns}
    for row in rows:
        for column, slope in slopes[row].items():
            if column in entries:
                entries[column][row] = slope
    elimination, chosen = Elimination(len(rows)), dict[int, int]()
    for column in columns:
        if elimination.add(entries[column]):
            chosen[column] = elimination.pivot
    return chosen
