"""Steady state: all derivatives zero, except of states that nothing depends on."""

from __future__ import annotations

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import InitializationError
from modelica_like.initialize.point import Point, call

_MAX_NEWTON = 50
_STEADY = 1e-6


def solve_steady(model: CompiledDae, point: Point) -> None:
    """Find states with zero derivatives near `point`.

    States that nothing depends on (absolute angles) keep their value.

    Raises:
        InitializationError: there is no steady state near it.
    """
    arguments = list(model.arguments.values())
    x, z = model.arguments["x"], model.arguments["z"]
    equations = ca.vertcat(model.ode(*arguments), model.alg(*arguments))
    moving = moving_states(model)
    rows = [*moving, *range(len(model.states), len(model.states) + len(model.implicit))]
    unknowns = ca.vertcat(*(x[k] for k in moving), z)
    function = ca.Function("steady", arguments, [equations[rows], ca.jacobian(equations[rows], unknowns)])
    for _ in range(_MAX_NEWTON):
        value, jacobian = function(point.t, point.x, point.z, model.p, model.u, point.d)
        # Least squares: an undetermined split (several equilibria) takes the one nearest to the guess.
        step = np.linalg.lstsq(np.asarray(jacobian.full()), -np.asarray(value.full()).ravel(), rcond=1e-12)[0]
        point.x[moving] += step[: len(moving)]
        point.z += step[len(moving) :]
        if step.size == 0 or np.max(np.abs(step) / (1.0 + np.abs(step))) < 1e-13:
            break
    residual = np.asarray(function(point.t, point.x, point.z, model.p, model.u, point.d)[0].full()).ravel()
    if residual.size and not np.max(np.abs(residual)) <= _STEADY:
        worst = int(np.argmax(np.abs(residual)))
        name = model.states[moving[worst]] if worst < len(moving) else model.implicit[worst - len(moving)]
        raise InitializationError(
            f"No steady state was found at t = {point.t:g} s: {name} keeps changing.",
            advice="Check that the drive can be in equilibrium there, or give start values instead.",
        )


def moving_states(model: CompiledDae) -> list[int]:
    """Positions of the states that something depends on; the others, absolute angles, never settle."""
    arguments = list(model.arguments.values())
    equations = ca.vertcat(model.ode(*arguments), model.alg(*arguments))
    return [k for k, depends in enumerate(ca.which_depends(equations, model.arguments["x"], 1, False)) if depends]


def check_modes_hold(model: CompiledDae, point: Point) -> None:
    """Check that no mode changes at once: surfaces that stick against too large a torque are not in equilibrium.

    Raises:
        InitializationError: one does.
    """
    guards = call(model, model.guards, point)
    for one in model.transitions:
        mode, present = model.flat_discretes[one.mode], int(point.d[one.mode])
        if not one.timed and present in one.sources and guards[one.index] > 0:
            raise InitializationError(
                f"No steady state was found at t = {point.t:g} s: {mode.path} does not stay {mode.names[present]}.",
                where=one.source,
                advice="Give guesses near the motion that is steady, such as guess(100) for a speed.",
            )
