"""Derivatives along a replay: forward with the run, or adjoint against it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from modelica_like.analyse.replay.chain import Replay, Step
from modelica_like.analyse.replay.jumps import Jump
from modelica_like.analyse.slopes import Sizes
from modelica_like.compile.buffers import Vector

_NONE = np.zeros(0)


@dataclass(frozen=True)
class Reading:
    """A number read off a replay, and how it depends on what is there.

    Attributes:
        value: the number.
        node: node at which it is read, or from which a probe begins.
        x: derivative by the states there (after the probe), shape (nx,); empty: none.
        theta: derivative by (p, u, d), shape (ntheta,); empty: none.
        probe: step from the node to the place of the reading.
        jump: position of the jump whose time it depends on.
        rate: derivative by that time.
        quadratures: derivative by the quadratures over the run, shape (nq,); empty: none.
    """

    value: float
    node: int = 0
    x: Vector = field(default_factory=lambda: _NONE)
    theta: Vector = field(default_factory=lambda: _NONE)
    probe: Step | None = None
    jump: int | None = None
    rate: float = 0.0
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
    columns = directions.shape[1]
    S = replay.start_x @ directions
    P = np.vstack([directions, replay.start_d @ directions])
    result = np.zeros((len(readings), columns))
    quadratures = np.zeros((replay.functions.nq, columns))
    at_node, at_jump = _sorted(readings)
    for k in range(len(replay.nodes)):
        for number in at_node.get(k, ()):
            result[number] += _read(replay, readings[number], S, P)
        if k == len(replay.moves):
            break
        move = replay.moves[k]
        if isinstance(move, Step):
            S, gained = _forward_step(replay, move, S, P)
            quadratures += gained
            continue
        whole = np.vstack([S, P])
        S, d = move.x @ whole, move.d @ whole
        if move.trigger is not None:
            time = np.concatenate([move.trigger.x, move.trigger.theta]) @ whole
            quadratures += np.outer(move.gain, time)
            for number in at_jump.get(k, ()):
                result[number] += readings[number].rate * time
        P = np.vstack([directions, d])
    for number, reading in enumerate(readings):
        if reading.quadratures.size:
            result[number] += reading.quadratures @ quadratures
    return result


def _sorted(readings: Sequence[Reading]) -> tuple[dict[int, list[int]], dict[int, list[int]]]:
    """Numbers of the readings at each node and at each jump."""
    at_node: dict[int, list[int]] = {}
    at_jump: dict[int, list[int]] = {}
    for number, reading in enumerate(readings):
        at_node.setdefault(reading.node, []).append(number)
        if reading.jump is not None:
            at_jump.setdefault(reading.jump, []).append(number)
    return at_node, at_jump


def _forward_step(replay: Replay, step: Step, S: Vector, P: Vector) -> tuple[Vector, Vector]:
    functions, columns = replay.functions, S.shape[1]
    fast = functions.forward(columns)
    end, gained = fast(*_arguments(replay, step), S.ravel("F"), P.ravel("F"))
    return end.reshape(columns, -1).T, gained.reshape(columns, -1).T


def _arguments(replay: Replay, step: Step) -> tuple[object, ...]:
    model, here = replay.model, step.before
    return here.t, step.h, here.x, step.stages, model.p, model.u, here.d


def _read(replay: Replay, reading: Reading, S: Vector, P: Vector) -> Vector:
    if reading.probe is not None:
        S, _ = _forward_step(replay, reading.probe, S, P)
    total = np.zeros(P.shape[1])
    if reading.x.size:
        total += reading.x @ S
    if reading.theta.size:
        total += reading.theta @ P
    return total


def adjoint(replay: Replay, readings: Sequence[Reading]) -> Vector:
    """Derivatives of readings by all parameters and inputs.

    Returns:
        Shape (readings, np + nu).
    """
    size, count = Sizes.of(replay.model), len(readings)
    L, G = np.zeros((size.x, count)), np.zeros((size.theta, count))
    Q = np.zeros((replay.functions.nq, count))
    for number, reading in enumerate(readings):
        if reading.quadratures.size:
            Q[:, number] = reading.quadratures
    at_node, at_jump = _sorted(readings)
    for k in range(len(replay.nodes) - 1, -1, -1):
        if k < len(replay.moves):
            move = replay.moves[k]
            if isinstance(move, Step):
                L, more = _adjoint_step(replay, move, L, Q)
                G += more
            else:
                L, G = _adjoint_jump(size, move, L, G, Q, {n: readings[n].rate for n in at_jump.get(k, ())})
        for number in at_node.get(k, ()):
            _seed(replay, readings[number], number, L, G)
    return G[: size.fixed].T + L.T @ replay.start_x + G[size.fixed :].T @ replay.start_d


def _adjoint_step(replay: Replay, step: Step, L: Vector, Q: Vector) -> tuple[Vector, Vector]:
    columns = L.shape[1]
    begin, more = replay.functions.adjoint(columns)(*_arguments(replay, step), L.ravel("F"), Q.ravel("F"))
    return begin.reshape(columns, -1).T, more.reshape(columns, -1).T


def _adjoint_jump(
    size: Sizes, jump: Jump, L: Vector, G: Vector, Q: Vector, rates: dict[int, float]
) -> tuple[Vector, Vector]:
    back = jump.x.T @ L + jump.d.T @ G[size.fixed :]
    if jump.trigger is not None:
        weight = jump.gain @ Q
        for number, rate in rates.items():
            weight[number] += rate
        back += np.outer(np.concatenate([jump.trigger.x, jump.trigger.theta]), weight)
    G = np.vstack([G[: size.fixed], np.zeros((size.d, G.shape[1]))]) + back[size.x :]
    return back[: size.x], G


def _seed(replay: Replay, reading: Reading, number: int, L: Vector, G: Vector) -> None:
    """Add what a reading depends on at its node."""
    if reading.theta.size:
        G[:, number] += reading.theta
    if not reading.x.size:
        return
    seed = reading.x[:, None]
    if reading.probe is not None:
        none = np.zeros((replay.functions.nq, 1))
        seed, more = _adjoint_step(replay, reading.probe, seed, none)
        G[:, number] += more[:, 0]
    L[:, number] += seed[:, 0]
