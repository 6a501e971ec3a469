"""Steady state: all derivatives are zero, except those of states on which nothing depends."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae, CompiledTransition, Vector
from modelica_like.errors import InitializationError
from modelica_like.solve.initialize.kept import RANK, Matrix, find_kept, solve_kept
from modelica_like.solve.initialize.point import Point, call
from modelica_like.solve.initialize.slopes import slopes

_MAX_NEWTON = 50
_STEADY = 1e-6
_NEAR = (
    "Give guesses near the steady motion, such as guess(100) for a speed; "
    "an operating point can also start from the end of a run."
)


def solve_steady(model: CompiledDae, point: Point) -> None:
    """Find states with zero derivatives near `point`.

    States on which nothing depends (absolute angles) keep their values, and so do conserved quantities: the slip of
    a stuck clutch, the momentum of a shaft without load.

    Args:
        model: the compiled model.
        point: the first guess; it becomes the steady state.

    Raises:
        InitializationError: there is no steady state near it.
    """
    moving = moving_states(model)
    if not moving and not model.implicit:
        return
    for _ in range(_MAX_NEWTON):
        value, jacobian = rates_and_slopes(model, point)
        if not (np.isfinite(value).all() and np.isfinite(jacobian).all()):
            break
        step = _step(model, point, moving, -value, jacobian)
        point.x[moving] += step[: len(moving)]
        point.z += step[len(moving) :]
        if np.abs(step).max(initial=0.0) <= 1e-13:
            break
    if error := not_steady(model, point):
        raise error


def not_steady(model: CompiledDae, point: Point) -> InitializationError | None:
    """Return the error of a state that is not steady, or None if all are."""
    moving = moving_states(model)
    if not moving and not model.implicit:
        return None
    residual, _ = rates_and_slopes(model, point)
    if np.abs(residual).max(initial=0.0) <= _STEADY:
        return None
    worst = int(np.argmax(np.abs(residual)))
    name = model.states[moving[worst]] if worst < len(moving) else model.implicit[worst - len(moving)]
    return InitializationError(
        f"No steady state was found at t = {point.t:g} s: {name} keeps changing.",
        advice=f"Check that the drive has an equilibrium. {_NEAR}",
    )


def _step(model: CompiledDae, point: Point, moving: list[int], right: Vector, jacobian: Matrix) -> Any:
    step, _, rank, _ = np.linalg.lstsq(jacobian, right, rcond=RANK)
    if rank == len(right):
        return step
    kept = find_kept(model, point, moving, jacobian)
    return solve_kept(kept, jacobian, right, kept.missing)


def rates_and_slopes(model: CompiledDae, point: Point) -> tuple[Vector, Matrix]:
    """Return rates of the moving states and residuals, and their derivatives by these states and implicit unknowns."""
    found = _steady_function(model)(point.t, point.x, point.z, model.p, model.u, point.d)
    value, slopes = (np.asarray(part.full()) for part in found)
    return value.ravel(), slopes


def _steady_function(model: CompiledDae) -> ca.Function:
    """Return a function of a point: rates of the moving states, residuals, and their Jacobian."""

    def make() -> ca.Function:
        arguments, moving = list(model.arguments.values()), moving_states(model)
        rows = [*moving, *range(len(model.states), len(model.states) + len(model.implicit))]
        equations = _equations(model)[rows]
        unknowns = ca.vertcat(*(model.arguments["x"][k] for k in moving), model.arguments["z"])
        return ca.Function("steady", arguments, [equations, ca.jacobian(equations, unknowns)])

    return model.once("steady", make)


def _equations(model: CompiledDae) -> Any:
    arguments = model.arguments.values()
    return ca.vertcat(model.ode(*arguments), model.alg(*arguments))


def moving_states(model: CompiledDae) -> list[int]:
    """Positions of the states on which something depends; the others, absolute angles, never settle."""
    return model.once(
        "moving", lambda: np.flatnonzero(ca.which_depends(_equations(model), model.arguments["x"], 1, False)).tolist()
    )


def modes_between(model: CompiledDae, before: Point, point: Point, modes: Vector) -> Vector:
    """Hold a motion that starts sliding one way and ends sliding the other way: it rests at the equilibrium between.

    Args:
        model: the compiled model.
        before: start of the search.
        point: its end with the modes of `before`.
        modes: modes chosen for `point`.
    """
    chosen = modes.copy()
    nodes = [one.motion for one in model.holds]
    turned = call(model, model.variables, before)[nodes] * call(model, model.variables, point)[nodes] < 0.0
    for one, turns in zip(model.holds, turned, strict=True):
        if turns and modes[one.mode] not in (point.d[one.mode], one.number):
            chosen[one.mode] = one.number
    return chosen


def check_modes_hold(model: CompiledDae, point: Point) -> None:
    """Check that no mode changes immediately: surfaces stuck under too large a torque are not in equilibrium.

    Raises:
        InitializationError: one does.
    """
    guards = call(model, model.guards, point)
    for one in model.transitions:
        present = int(point.d[one.mode])
        if not one.timed and present in one.sources and one.target != present and guards[one.index] > 0:
            raise mode_not_steady(model, point, one)


def mode_not_steady(model: CompiledDae, point: Point, transition: CompiledTransition) -> InitializationError:
    """Return the error of a mode that a transition would leave at once."""
    mode = model.flat_discretes[transition.mode]
    return InitializationError(
        f"No steady state was found at t = {point.t:g} s: {mode.path} does not stay "
        f"{mode.names[int(point.d[transition.mode])]}.",
        where=transition.source,
        advice=_NEAR,
    )


def steady_change(model: CompiledDae, point: Point, theta: Vector, guess: Vector | None = None) -> Vector:
    """Return how the states of a steady state change: the implicit function theorem.

    Args:
        model: the compiled model.
        point: the steady state.
        theta: changes of (p, u, d), shape (ntheta, columns).
        guess: changes of the states that equilibrium does not determine, shape (nx, columns); none by default.
    """
    moving, rates = moving_states(model), slopes(model, point, "ode")
    change = np.zeros((len(rates.x), theta.shape[1])) if guess is None else guess.copy()
    inner = rates.x[np.ix_(moving, moving)]
    kept = find_kept(model, point, moving, inner)
    held = slopes(model, point, "variables", kept.held)
    right = rates.theta[moving] @ theta + inner @ change[moving]
    of_held = held.theta @ theta + held.x[:, moving] @ change[moving]
    change[moving] += solve_kept(kept, inner, -right, -of_held)
    return change
