"""Derivatives of what is read along a run, by the adjoint of the run-time."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.native.library import INTEGRAND, SEED, Along
from modelica_like.native.model import Instance


@dataclass(frozen=True)
class Seed:
    """A place at which a row reads the run.

    Attributes:
        by: derivatives by states, parameters, inputs and d there, shape (nx + np + nu + nd,).
        t: time in s; behind an instant that is then.
        instant: before this one, that of the segment which follows it; -1: at the time.
        moving: derivative by the time of the instant.
    """

    by: Vector
    t: float = 0.0
    instant: int = -1
    moving: float = 0.0


@dataclass(frozen=True)
class Row:
    """What is differentiated: the sum of seeds, and the integral of a variable.

    Attributes:
        seeds: see `Seed`.
        variable: its position; -1: none.
        size: of the integral, beside which errors are measured.
    """

    seeds: tuple[Seed, ...] = ()
    variable: int = -1
    size: float = 1.0


def gradient_along(instance: Instance, rows: Sequence[Row], columns: int) -> Vector:
    """Return derivatives of rows by what the instance was begun for, so many columns; nan where there are none.

    Raises:
        NoGradient: by nothing there are any.
    """
    pairs = [(number, seed) for number, row in enumerate(rows) for seed in row.seeds]
    pairs.sort(key=lambda pair: (pair[1].instant >= 0, -pair[1].t))
    kept = [np.ascontiguousarray(seed.by, float) for _, seed in pairs]
    places = [
        (number, seed.instant, seed.t, seed.moving, by.ctypes.data)
        for (number, seed), by in zip(pairs, kept, strict=True)
    ]
    seeds = np.array(places, SEED)
    integrands = np.array([(row.variable, row.size) for row in rows], INTEGRAND)
    along = Along(seeds.ctypes.data, integrands.ctypes.data, len(seeds), len(rows))
    slopes = np.zeros((len(rows), columns))
    instance.check(instance.library.gradient_along(instance.address, ctypes.byref(along), slopes.ctypes.data))
    return slopes
