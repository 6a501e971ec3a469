"""Motions that the present modes hold, who shares them, and what impacts have cost."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.flatten.holds import TERMS
from modelica_like.solve.initialize.point import Point, call

INSTANT = 1e-9
"""Duration of an impact in s, of the approach; finite forces cancel for any value."""


@dataclass(frozen=True)
class Impact:
    """Energy that an impact has dissipated.

    Attributes:
        time: in s.
        component: path of the component that stopped a motion.
        energy: in J.
        trials: points whose powers differ by what sources give in the impact, over its duration `INSTANT`; of one of
            the impacts that are solved together.
    """

    time: float
    component: str
    energy: float
    trials: tuple[Point, Point] | None = field(default=None, repr=False, compare=False)


def terms(model: CompiledDae, point: Point) -> Any:
    """Gain, capacities and restitution of every held motion; shape (holds, TERMS)."""
    return call(model, model.held.terms, point).reshape(len(model.held.motions), TERMS)


def capacities(model: CompiledDae, point: Point) -> Any:
    """Return the forward and backward capacity of every held motion; shape (holds, 2)."""
    return terms(model, point)[:, 1:3]


def holding(model: CompiledDae, point: Point) -> list[int]:
    """Positions of the held motions at a point."""
    holds = [k for k, hold in enumerate(model.held.motions) if point.d[hold.mode] == hold.number]
    if not holds:
        return []
    gains = terms(model, point)[:, 0]
    return [k for k in holds if gains[k] != 0.0]


def sharing(model: CompiledDae, point: Point) -> list[tuple[str, ...]]:
    """Components that share a held motion at a point, circuit by circuit."""
    groups: list[tuple[str, ...]] = []
    for circuit in model.held.circuits:
        shares = circuit.shares.of(point.d)
        for row in shares[np.any(shares != 0.0, axis=1)]:
            parts = (model.held.motions[k].component for k, part in zip(circuit.members, row, strict=True) if part)
            groups.append(tuple(dict.fromkeys(parts)))
    return groups
