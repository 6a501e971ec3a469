"""Steady states of drives with samplers: what these keep is unknown, too, and is the same after a tick as before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import InitializationError
from modelica_like.native.start import check_ticks, steady_near, ticked
from modelica_like.solve.initialize import Point, call
from modelica_like.solve.initialize.memory import clocks, depends, settling
from modelica_like.solve.initialize.slopes import Sizes, slopes
from modelica_like.solve.initialize.steady import steady_change

_MAX_NEWTON = 40
_CLOSE, _SETTLED = 1e-13, 1e-9


def with_samples(model: CompiledDae, point: Point) -> Point:
    """Return the steady state near one in which samplers keep something else.

    Args:
        model: the compiled model.
        point: a steady state as long as no clock ticks.

    Raises:
        InitializationError: there is none, or it is not found; the message names what keeps changing.
    """
    if not clocks(model):
        return point
    point = ticked(model, point)
    entries = [*settling(model)]
    for _ in range(_MAX_NEWTON):
        try:
            point = steady_near(model, point)
            step = _Tick.of(model, point).solve()
        except InitializationError:
            # Nothing is at rest with these samples: the check below tells which.
            break
        if np.max(np.abs(step) / (1.0 + np.abs(point.d[entries])), initial=0.0) < _CLOSE:
            break
        point.d[entries] += step
    check_ticks(model, point)
    return point


def unsettled(model: CompiledDae, point: Point) -> set[str]:
    """Return what has no steady value at a steady state, by path: what events change, and variables that read it.

    The motion does not depend on it: counts of the pulses of a turning shaft, noise that is only shown.
    """
    if not clocks(model):
        return set()
    change = np.abs(check_ticks(model, point).d - point.d) > _SETTLED * (1.0 + np.abs(point.d))
    numbers = [k for k, d in enumerate(model.flat_discretes) if d.kind == "number" and not d.hidden and not d.names]
    # Numbers of ticks grow everywhere, and hidden values are those of clocks; modes are those of the angle there.
    changed = [k for k in numbers if change[k]]
    reading = np.flatnonzero(depends(model.equations.variables, "d")[:, changed].any(axis=1))
    return {model.flat_discretes[k].path for k in changed} | {model.flat_variables[k].path for k in reading}


def change_with_samples(model: CompiledDae, point: Point, theta: Vector) -> tuple[Vector, Vector]:
    """Return how the states of a steady state, and what samplers keep, change: the implicit function theorem.

    Args:
        model: the compiled model.
        point: the steady state.
        theta: changes of (p, u, d) other than what samplers keep, shape (ntheta, columns).

    Returns:
        Changes of the states, shape (nx, columns), and of (p, u, d).
    """
    states = steady_change(model, point, theta)
    if not settling(model):
        return states, theta
    tick = _Tick.of(model, point)
    kept = tick.solve(tick.by_x @ states + tick.by_theta @ theta)
    return states + tick.states @ kept, theta + tick.places @ kept


@dataclass(frozen=True, eq=False)
class _Tick:
    """What a tick changes in the memory of samplers, and how that depends on it.

    Attributes:
        change: by the tick, shape (memory,).
        by_x: derivatives of the new memory by the states, shape (memory, nx).
        by_theta: by (p, u, d), shape (memory, ntheta).
        places: of the memory among (p, u, d), a matrix of ones, shape (ntheta, memory).
        states: changes of the steady states by the memory, shape (nx, memory).
    """

    change: Vector
    by_x: Vector
    by_theta: Vector
    places: Vector
    states: Vector

    @staticmethod
    def of(model: CompiledDae, point: Point) -> _Tick:
        """Differentiate the tick that comes next at a point."""
        size, entries, due = Sizes.of(model), [*settling(model)], point.copy()
        counts, resets = clocks(model), call(model, model.events.resets, point)
        due.d[[*counts]] = resets[[*counts.values()]]
        new = slopes(model, due, "updates", [*settling(model).values()])
        places = np.eye(size.theta)[:, [size.fixed + entry for entry in entries]]
        return _Tick(new.value - point.d[entries], new.x, new.theta, places, steady_change(model, point, places))

    def solve(self, change: Any = None) -> Any:
        """Return what to add to the memory so that a tick changes it no more, with `change` instead of its own."""
        left = np.eye(len(self.change)) - self.by_x @ self.states - self.by_theta @ self.places
        # What ticks leave as it is, whatever it is, stays.
        return np.linalg.lstsq(left, self.change if change is None else change, rcond=None)[0]
