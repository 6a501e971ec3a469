"""What keeps its value where an event gives a variable a new one.

The states of a drive are chosen for the solver, often as differences of speeds. A new speed of one body is not to move
another one behind a spring, a damper or a clutch, although the state between them is the difference: no impulse passes
there. What is coupled rigidly follows.
"""

from __future__ import annotations

from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from modelica_like.flatten.generic import spread
from modelica_like.flatten.model import Instance
from modelica_like.structure.reduce import ReducedDae

Vector = NDArray[np.float64]

_POSITIONS = ("rad", "m")
_LARGEST = 1e300
"""A limit that stands for none may be the largest number there is."""
_ROUNDING = 1e-9
"""Relative size of a slope, or of what of it does not depend on others, that is rounding of few operations at a generic
point: 1e-16 times what cancels there, while slopes differ by ratios of gears and arms."""


class Keeping:
    """Finds the variables that keep their values, by slopes at one generic point."""

    def __init__(self, reduced: ReducedDae) -> None:
        self._reduced = reduced
        self._found: dict[int, tuple[int, ...]] = {}

    def beside(self, variable: int) -> tuple[int, ...]:
        """Return the variables that keep their values where one gets a new value.

        They are bodies (whatever joins a derivative with a force, a torque, a current, …), the neighbours first; and
        positions, if a speed gets the new value. There are none where a variable is neither a
        speed nor a position nor stored, where it does not depend on the states, and where no slope is finite.
        """
        if variable not in self._found:
            self._found[variable] = self._beside(variable)
        return self._found[variable]

    def same(self, variable: int) -> tuple[int, float]:
        """Return the variable that stands for all that are equal up to a factor, and the factor of this one."""
        placed = self._reduced.system.node_level[variable]
        if placed is None:
            return variable, 1.0
        other, factor = self._first[placed[0]]
        return other, placed[1] / factor

    @cached_property
    def _first(self) -> dict[int, tuple[int, float]]:
        """Of each level the variable with the shortest name, and its factor."""
        variables, levels = self._reduced.flat.variables, self._reduced.system.node_level
        ordered = sorted(range(len(variables)), key=lambda k: (len(variables[k].path), variables[k].path), reverse=True)
        return {placed[0]: (k, placed[1]) for k in ordered if (placed := levels[k])}

    def _beside(self, variable: int) -> tuple[int, ...]:
        rows, tried = self._slopes([variable]), set[int]()
        if not np.isfinite(rows).all() or not rows.any():
            return ()
        placed, position = self._reduced.system.node_level[variable], self._is_position(variable)
        speed = placed is not None and self._reduced.system.levels[placed[0]].order > 0
        if not (speed or position or variable in self._bodies):
            return ()  # such as a force, which follows from positions and speeds
        positions = self._positions if speed and not position else []
        candidates = [*positions, *self._bodies]
        slopes = self._slopes(candidates)
        lengths = np.maximum(np.linalg.norm(slopes, axis=1), _ROUNDING)
        kept: list[int] = []
        moves = _moves(rows, slopes, lengths)
        while moved := [k for k in np.flatnonzero(moves).tolist() if k not in tried]:
            # No position moves at once. The body that goes along most is the next neighbour: in a chain two are enough.
            first = [k for k in moved if k < len(positions)] or moved
            row = first[int(np.argmax(moves[first] > (1.0 - _ROUNDING) * moves[first].max()))]
            tried.add(row)
            left = slopes[row] - (slopes[row] @ np.linalg.pinv(rows)) @ rows
            if np.linalg.norm(left) <= _ROUNDING * lengths[row]:
                continue  # it follows
            more = np.vstack([rows, slopes[row]])
            others = _moves(more, slopes, lengths)
            # In a planetary set one of two must follow: nothing is won if it is the other one.
            if np.count_nonzero(others) < np.count_nonzero(moves):
                rows, moves = more, others
                kept.append(self.same(candidates[row])[0])
        return tuple(kept)

    def _is_position(self, variable: int) -> bool:
        """Tell whether the second derivative of a variable is one of the unknowns."""
        system, placed = self._reduced.system, self._reduced.system.node_level[variable]
        rate = system.derivative(placed[0]) if placed else None
        return rate is not None and system.derivative(rate) is not None

    @cached_property
    def _positions(self) -> list[int]:
        """Variables that are states and whose second derivatives are unknowns, one of each state."""
        first: dict[int, int] = {}
        for variable, state in enumerate(self._reduced.node_states[: len(self._reduced.flat.variables)]):
            if state is not None and self._is_position(variable):
                first.setdefault(state[0], variable)
        return [*first.values()]

    @cached_property
    def _bodies(self) -> list[int]:
        """What bodies store, and its integrals, by their names, whatever their order in the model."""
        flat = self._reduced.flat
        found = {node for instance in flat.instances for node in self._stored(instance)}
        return sorted(found, key=lambda node: flat.variables[node].path)

    def _stored(self, instance: Instance) -> set[int]:
        """Variables whose derivatives an equation of an instance joins with flows, and their integrals."""
        flat, system = self._reduced.flat, self._reduced.system
        placed = {node: system.node_level[node] for node in instance.nodes}
        rates = {
            level: node
            for node in instance.nodes
            if flat.nodes[node][1] == 0 and (at := placed[node]) and (level := system.derivative(at[0])) is not None
        }
        found: set[int] = set()
        for slots in instance.template.incidence:
            nodes = [instance.nodes[slot] for slot in slots]
            if any(flat.variables[flat.nodes[node][0]].kind == "flow" for node in nodes):
                found |= {flat.nodes[node][0] for node in nodes if flat.nodes[node][1] > 0}
                found |= {rates[at[0]] for node in nodes if (at := placed[node]) and at[0] in rates}
        found = {variable for variable in found if str(flat.variables[variable].unit) not in _POSITIONS}
        levels = {at[0] for variable in found if (at := system.node_level[variable])}
        return found | {node for level, node in rates.items() if level in levels}

    def _slopes(self, variables: list[int]) -> Vector:
        """Slopes of variables by the states, shape (variables, states), what is implicit following."""
        reduced = self._reduced
        chosen = ca.SX(reduced.values)[variables] if variables else ca.SX(0, 1)
        by = [ca.jacobian(chosen, symbols) for symbols in (reduced.x, reduced.z)]
        arguments = [reduced.flat.time, reduced.x, reduced.z, reduced.flat.p, reduced.u, reduced.flat.d]
        by_x, by_z = (np.array(part.full()) for part in ca.Function("slopes", arguments, by)(*self._point))
        return by_x - by_z @ self._implicit if by_z.any() else by_x

    @cached_property
    def _implicit(self) -> Vector:
        """Slopes of the implicit unknowns by the states, with the sign turned."""
        reduced = self._reduced
        by = [ca.jacobian(reduced.alg, symbols) for symbols in (reduced.z, reduced.x)]
        arguments = [reduced.flat.time, reduced.x, reduced.z, reduced.flat.p, reduced.u, reduced.flat.d]
        by_z, by_x = (np.array(part.full()) for part in ca.Function("implicit", arguments, by)(*self._point))
        return np.linalg.lstsq(by_z, by_x, rcond=None)[0]

    @cached_property
    def _point(self) -> list[Vector]:
        """A generic point: parameters near their values, the rest near one."""
        reduced, flat = self._reduced, self._reduced.flat
        given = np.array([parameter.value for parameter in flat.parameters], float)
        sizes = [1, reduced.x.numel(), reduced.z.numel(), given.size, reduced.u.numel()]
        time, x, z, p, u = np.split(spread(0.5, 1.5, sum(sizes)), np.cumsum(sizes)[:-1])
        starts = [one.start if isinstance(one.start, int | float) else 0.0 for one in flat.discretes]
        d = np.array([*starts, *[0.0] * (flat.d.numel() - len(starts))])
        return [time, x, z, np.clip(given, -_LARGEST, _LARGEST) * p + 1e-3 * (p - 1.0), u, d]


def _moves(rows: Vector, slopes: Vector, lengths: Vector) -> Vector:
    """Return how much variables go along with the first row, over their slopes, while the other rows stay."""
    change = np.linalg.pinv(rows)[:, 0]
    moves = np.abs(slopes @ change) / lengths
    return np.where(moves > _ROUNDING * np.linalg.norm(change), moves, 0.0)
