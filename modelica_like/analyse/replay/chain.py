"""A run repeated as a chain of smooth steps and jumps with exact derivatives, forward and adjoint.

The mode sequence of a solution is given. Each smooth segment is integrated again by collocation over its known
interval, without looking for events; each event is a jump at its known time. If the guard or the moment moves the
event a little, the states are carried there and back at the rates before and after (the saltation of
M. A. Aizerman, F. R. Gantmakher, 1958), so the chain has the first derivatives of the run with moving events.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.jumps import Jump
from modelica_like.analyse.replay.start import product
from modelica_like.analyse.replay.step import Step, stuck, try_step
from modelica_like.analyse.replay.steps import StepFunctions
from modelica_like.analyse.replay.when import Coincidence
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae, CompiledTransition
from modelica_like.solve.initialize import Point
from modelica_like.solve.initialize.slopes import Sizes, Slopes

_NONE = np.zeros(0)
Move = Step | Jump


@dataclass(frozen=True)
class Reading:
    """A number read off a replay, with its derivatives.

    Attributes:
        value: the number.
        parts: nodes, and its derivatives by (x, theta) there, shape (nx + ntheta,).
        quadratures: derivative by the quadratures over the run, shape (nq,); empty: none.
    """

    value: float
    parts: tuple[tuple[Point, Vector], ...] = ()
    quadratures: Vector = field(default_factory=lambda: _NONE)


@dataclass(eq=False)
class Replay:
    """The chain: start, then moves from node to node.

    Attributes:
        functions: of its steps.
        nodes: the points between the moves; the first is the start after its events.
        moves: steps and jumps; move k leads from node k to node k + 1.
        start_x: derivatives of the first node's states by (p, u), shape (nx, np + nu), sparse.
        start_d: derivatives of its discrete values, shape (nd, np + nu), likewise.
        chances: motions of zero that modes hold from the start, by (x, theta) there.
        silent: nodes at which rates or integrands jump without an event, and how the time of that moves.
        ticks: of clocks at the start, and their moments as they are before.
    """

    functions: StepFunctions
    nodes: list[Point] = field(default_factory=list)
    moves: list[Move] = field(default_factory=list)
    start_x: ca.DM = field(default_factory=lambda: ca.DM(0, 0))
    start_d: ca.DM = field(default_factory=lambda: ca.DM(0, 0))
    chances: list[Coincidence] = field(default_factory=list)
    silent: list[tuple[Point, Coincidence]] = field(default_factory=list)
    ticks: list[tuple[CompiledTransition, Slopes]] = field(default_factory=list)

    @property
    def model(self) -> CompiledDae:
        """The compiled model."""
        return self.functions.model

    @property
    def quadratures(self) -> Vector:
        """Integrals over the run of the integrands it was made with."""
        return sum((move.quadratures for move in self.moves), np.zeros(self.functions.nq))

    def append(self, move: Move) -> None:
        """Add a move with the node that it leads to."""
        self.moves.append(move)
        self.nodes.append(move.after)

    @property
    def jumps(self) -> Iterator[tuple[int, Jump]]:
        """Positions and jumps."""
        return ((k, move) for k, move in enumerate(self.moves) if isinstance(move, Jump))

    def at(self, t: float) -> Point:
        """Return the node at a time within the run; it splits the step that contains the time.

        Raises:
            StepFailed: one of them did not converge.
        """
        k = max(k for k, node in enumerate(self.nodes) if node.t <= t)
        if self.nodes[k].t == t:
            return self.nodes[k]
        step, _ = try_step(self.functions, self.nodes[k], t - self.nodes[k].t, None)
        if step is None:
            raise stuck(self.nodes[k])
        return self.split(k, step)

    def split(self, k: int, first: Step) -> Point:
        """Split step k, with a given first part; return the node between the parts.

        Raises:
            StepFailed: the second one did not converge.
        """
        end = self.nodes[k + 1]
        second, _ = try_step(self.functions, first.after, end.t - first.after.t, None)
        if second is None:
            raise stuck(first.after)
        self.moves[k : k + 1] = [first, replace(second, after=end)]
        self.nodes.insert(k + 1, first.after)
        return first.after

    def forward(self, readings: Sequence[Reading], directions: Vector) -> Vector:
        """Derivatives of readings along directions of (p, u).

        Args:
            replay: the chain.
            readings: what to differentiate.
            directions: shape (np + nu, m).

        Returns:
            Shape (readings, m).
        """
        begin = np.vstack([product(self.start_x, directions), directions, product(self.start_d, directions)])
        return self.carried(readings, begin, 0, len(self.moves))[0]

    def carried(self, readings: Sequence[Reading], whole: Vector, first: int, last: int) -> tuple[Vector, Vector]:
        """Carry derivatives from one node to another; return what is read on the way, and them at the end.

        Args:
            readings: what to differentiate.
            whole: derivatives of (x, theta) at the node `first`, shape (nx + ntheta, m).
            first: position of the first node.
            last: position of the last one.

        Returns:
            Shapes (readings, m) and (nx + ntheta, m).
        """
        result = np.zeros((len(readings), whole.shape[1]))
        total = np.zeros((self.functions.nq, whole.shape[1]))
        at_node = _by_node(readings)
        for k in range(first, last + 1):
            for number, row in at_node.get(id(self.nodes[k]), ()):
                result[number] += row @ whole
            if k < last:
                whole, gained = self.moves[k].forward(whole)
                total += gained
        for number, reading in enumerate(readings):
            if reading.quadratures.size:
                result[number] += reading.quadratures @ total
        return result, whole

    def adjoint(self, readings: Sequence[Reading], kept: dict[int, Vector] | None = None) -> Vector:
        """Derivatives of readings by all parameters and inputs.

        Args:
            readings: what to differentiate.
            kept: positions of nodes; gets the derivatives by (x, theta) there, shape (nx + ntheta, readings).

        Returns:
            Shape (readings, np + nu).
        """
        size = Sizes.of(self.model)
        whole = np.zeros((size.x + size.theta, len(readings)))
        none = np.zeros(self.functions.nq)
        Q = np.array([reading.quadratures if reading.quadratures.size else none for reading in readings]).T
        at_node = _by_node(readings)
        for k in range(len(self.nodes) - 1, -1, -1):
            if k < len(self.moves):
                whole = self.moves[k].adjoint(whole, Q)
            for number, row in at_node.get(id(self.nodes[k]), ()):
                whole[:, number] += row
            if kept is not None and k in kept:
                kept[k] = whole.copy()
        x, fixed, d = np.split(whole, [size.x, size.x + size.fixed])
        return product(x.T, self.start_x) + fixed.T + product(d.T, self.start_d)


def _by_node(readings: Sequence[Reading]) -> dict[int, list[tuple[int, Vector]]]:
    """Numbers of the readings at each node, by its identity, and their derivatives there."""
    seeds: dict[int, list[tuple[int, Vector]]] = {}
    for number, reading in enumerate(readings):
        for node, row in reading.parts:
            seeds.setdefault(id(node), []).append((number, row))
    return seeds
