"""Derivatives along a replay: forward with the run, or adjoint against it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from modelica_like.analyse.replay.chain import Replay
from modelica_like.analyse.slopes import Sizes
from modelica_like.compile.buffers import Vector
from modelica_like.initialize import Point

_NONE = np.zeros(0)


@dataclass(frozen=True)
class Reading:
    """A number read off a replay, and how it depends on what is there.

    Attributes:
        value: the number.
        parts: nodes, and its derivatives by (x, theta) there, shape (nx + ntheta,).
        quadratures: derivative by the quadratures over the run, shape (nq,); empty: none.
    """

    value: float
    parts: tuple[tuple[Point, Vector], ...] = ()
    quadratures: Vector = field(default_factory=lambda: _NONE)


def forward(replay: Replay, readings: Sequence[Reading], directions: Vector) -> Vector:
    """Derivatives of readings along directions of (p, u).

    Args:
        replay: the chain.
        readings: what to differentiate.
        directions: shape (np + nu, m).

    Returns:
        Shape (readings, m).
    """
    result = np.zeros((len(readings), directions.shape[1]))
    total = np.zeros((replay.functions.nq, directions.shape[1]))
    whole = np.vstack([replay.start_x @ directions, directions, replay.start_d @ directions])
    at_node = _by_node(readings)
    for k, node in enumerate(replay.nodes):
        for number, row in at_node.get(id(node), ()):
            result[number] += row @ whole
        if k < len(replay.moves):
            whole, gained = replay.moves[k].forward(whole)
            total += gained
    for number, reading in enumerate(readings):
        if reading.quadratures.size:
            result[number] += reading.quadratures @ total
    return result


def adjoint(replay: Replay, readings: Sequence[Reading]) -> Vector:
    """Derivatives of readings by all parameters and inputs.

    Returns:
        Shape (readings, np + nu).
    """
    size = Sizes.of(replay.model)
    whole = np.zeros((size.x + size.theta, len(readings)))
    none = np.zeros(replay.functions.nq)
    Q = np.array([one.quadratures if one.quadratures.size else none for one in readings]).T
    at_node = _by_node(readings)
    for k in range(len(replay.nodes) - 1, -1, -1):
        if k < len(replay.moves):
            whole = replay.moves[k].adjoint(whole, Q)
        for number, row in at_node.get(id(replay.nodes[k]), ()):
            whole[:, number] += row
    x, fixed, d = np.split(whole, [size.x, size.x + size.fixed])
    return x.T @ replay.start_x + fixed.T + d.T @ replay.start_d


def _by_node(readings: Sequence[Reading]) -> dict[int, list[tuple[int, Vector]]]:
    """Numbers of the readings at each node, by its identity, and their derivatives there."""
    found: dict[int, list[tuple[int, Vector]]] = {}
    for number, reading in enumerate(readings):
        for node, row in reading.parts:
            found.setdefault(id(node), []).append((number, row))
    return found
