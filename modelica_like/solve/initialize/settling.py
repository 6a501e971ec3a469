"""Where a drive settles: it runs from its guesses in steps of time that grow without bound, while its inputs stay."""

from __future__ import annotations

from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import InitializationError
from modelica_like.solve.initialize.holds import holding, share
from modelica_like.solve.initialize.point import Point, call, solve_implicit
from modelica_like.solve.initialize.slopes import variable_slopes
from modelica_like.solve.initialize.steady import moving_states, rates_and_slopes

_FIRST, _LAST, _LEAST = 1e-4, 1e6, 1e-12
"""Lengths of steps in s: the first one, one that only a settled drive bears, and one that nothing bears."""
_AFTER_EVENT = 1e-3
_GROWTH, _LEAST_GROWTH, _CAUTION, _SHRINKAGE = 3.0, 1.2, 0.8, 10.0
_STEPS, _ITERATIONS, _ROUNDS = 1000, 8, 10
_LARGEST = 200
"""Number of unknowns from which the steps, with dense matrices, would take minutes."""
_SETTLED = 1e-9


def settle(model: CompiledDae, point: Point) -> bool:
    """Let a drive run until nothing changes, by Euler's implicit method; transitions fire at the ends of steps.

    It is no simulation: only the end counts, as a guess. States on which no rate depends stay.

    Args:
        model: the compiled model.
        point: where it begins; it becomes the end.

    Returns:
        Whether it has settled; false also for large drives, for which this would take too long.
    """
    if len(point.x) + len(point.z) > _LARGEST:
        return False
    moving, step, growth = moving_states(model), _FIRST, _GROWTH
    try:
        solve_implicit(model, point)
    except InitializationError:
        return False
    for _ in range(_STEPS):
        try:
            trial = _after(model, point, moving, step)
            fired = trial is not None and _fire(model, trial)
        except (InitializationError, np.linalg.LinAlgError):
            trial, fired = None, False
        if trial is None:
            step /= _SHRINKAGE
            if step < _LEAST:
                return False
            continue
        point.x, point.z, point.d = trial.x, trial.z, trial.d
        if step >= _LAST and not fired:
            return True
        if fired:
            # Coarse steps overshoot, and switch for ever.
            step, growth = min(step, _AFTER_EVENT), max(growth * _CAUTION, _LEAST_GROWTH)
        else:
            step *= growth
    return False


def _after(model: CompiledDae, point: Point, moving: list[int], step: float) -> Point | None:
    """Return the point after one step; None if Newton's method does not find it."""
    now, count = point.copy(), len(moving)
    for _ in range(_ITERATIONS):
        value, slopes = rates_and_slopes(model, now)
        value[:count] = now.x[moving] - point.x[moving] - step * value[:count]
        slopes[:count] = np.eye(*slopes[:count].shape) - step * slopes[:count]
        if not (np.isfinite(value).all() and np.isfinite(slopes).all()):
            return None
        change: Any = np.linalg.solve(slopes, -value)
        now.x[moving] += change[:count]
        now.z += change[count:]
        if _relative(change, np.concatenate([now.x[moving], now.z])) < _SETTLED:
            return now
    return None


def _relative(change: Vector, of: Vector) -> float:
    return float(np.max(np.abs(change) / (1.0 + np.abs(of)), initial=0.0))


def _fire(model: CompiledDae, point: Point) -> bool:
    """Fire transitions until none is left, with the states they reset; what is then held stands still."""
    before = point.d
    for _ in range(_ROUNDS):
        guards, chosen = call(model, model.guards, point), dict[int, int]()
        resets = call(model, model.resets, point) if any(one.resets for one in model.transitions) else ()
        x = point.x.copy()
        for one in model.transitions:
            present = int(point.d[one.mode])
            if one.timed or one.mode in chosen or present not in one.sources or not guards[one.index] > 0:
                continue
            chosen[one.mode] = one.target
            for reset in one.resets:
                if reset.kind == "state":
                    x[reset.index] = resets[reset.value] / reset.factor
        if all(point.d[mode] == target for mode, target in chosen.items()):
            break
        point.x, point.d = x, point.d.copy()
        point.d[list(chosen)] = list(chosen.values())
        share(model, point)
        _stand_still(model, point)
        solve_implicit(model, point)
    return not np.array_equal(before, point.d)


def _stand_still(model: CompiledDae, point: Point) -> None:
    """Stop what modes hold, with the least change of the states."""
    nodes = [model.holds[k].motion for k in holding(model, point)]
    if nodes:
        motions = call(model, model.variables, point)[nodes]
        if motions.any():
            point.x = point.x - np.linalg.lstsq(variable_slopes(model, point, nodes), motions, rcond=None)[0]
