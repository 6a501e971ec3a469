"""Pantelides' algorithm: the equations to differentiate, and how often."""

from __future__ import annotations

from modelica_like.errors import StructureError
from modelica_like.structure.alias import PREFERRED
from modelica_like.structure.system import System

_MAX_INDEX = 8


def prefer_relative_states(system: System) -> None:
    """Give preferred variables as many derivatives as their linear relations allow.

    A relative angle `phi_rel = phi_b - phi_a` is then differentiated along with the angles of the inertias and can
    become a state in their place: absolute angles grow without bound, and with them the error that a relative
    tolerance allows. Behind a gear the shaft's angle is not differentiated itself, but its linear relation to the
    motor's angle is enough. A relation to an input gives no derivative: the state would need the input's derivatives.
    """
    inputs = set(system.inputs)
    reach = [len(chain) for chain in system.chains]
    relations = [
        [system.levels[level].chain for level in levels]
        for levels in system.linear_rows
        if len(levels) > 1 and not any(system.levels[level].order or level in inputs for level in levels)
    ]
    changed = True
    while changed:
        changed = False
        for chains in relations:
            shortest = min(chains, key=lambda chain: reach[chain])
            possible = min(reach[chain] for chain in chains if chain != shortest)
            if reach[shortest] < possible:
                reach[shortest] = possible
                changed = True
    for chain, length in enumerate(reach):
        if max(system.levels[level].preference for level in system.chains[chain]) >= PREFERRED:
            while len(system.chains[chain]) < length:
                system.add_level(chain)


class Pantelides:
    """Finds how often each equation is differentiated; extends the chains of the system where needed.

    Args:
        system: structurally nonsingular (over chains).
        incidence: level numbers in each equation.

    Attributes:
        counts: number of differentiations of each equation.

    Source: Pantelides, SIAM J. Sci. Stat. Comput. 9 (1988) 213-231.
    """

    def __init__(self, system: System, incidence: list[list[int]]) -> None:
        self.system = system
        self.counts = [0] * len(incidence)
        self._levels = [list(row) for row in incidence]
        self._root = list(range(len(incidence)))
        self._derived: dict[int, int] = {}
        self._equation_of: dict[int, int] = {}
        self._level_of: dict[int, int] = {}
        self._known = set(system.inputs)
        for equation in range(len(incidence)):
            self._match(equation)

    def _match(self, equation: int) -> None:
        while True:
            equations, levels, complete = self._augment(equation)
            if complete:
                return
            above = {level: self.system.add_level(self.system.levels[level].chain) for level in levels}
            for row in equations:
                self._differentiate(row)
            for level in levels:
                self._assign(above[level], self._derived[self._equation_of[level]])
            equation = self._derived[equation]

    def _augment(self, start: int) -> tuple[list[int], dict[int, int], bool]:
        """Search an augmenting path for an equation among the highest derivatives; return the reached nodes."""
        equations = [start]
        came_from: dict[int, int] = {}
        for equation in equations:
            for level in self._levels[equation]:
                if level in came_from or level in self._known or self.system.derivative(level) is not None:
                    continue
                came_from[level] = equation
                if level not in self._equation_of:
                    self._flip(came_from, level)
                    return equations, came_from, True
                equations.append(self._equation_of[level])
        return equations, came_from, False

    def _flip(self, came_from: dict[int, int], level: int | None) -> None:
        while level is not None:
            equation = came_from[level]
            released = self._level_of.get(equation)
            self._assign(level, equation)
            level = released

    def _assign(self, level: int, equation: int) -> None:
        self._equation_of[level] = equation
        self._level_of[equation] = level

    def _differentiate(self, equation: int) -> None:
        root = self._root[equation]
        self.counts[root] += 1
        if self.counts[root] > _MAX_INDEX:
            raise StructureError(
                f"An equation would have to be differentiated more than {_MAX_INDEX} times.",
                where=self.system.origins[root].source,
                advice="Look for a motion that is prescribed twice, or a derivative that nothing determines.",
            )
        lifted = (self.system.derivative(level) for level in self._levels[equation])
        self._derived[equation] = len(self._levels)
        self._levels.append(sorted({*self._levels[equation], *(level for level in lifted if level is not None)}))
        self._root.append(root)
