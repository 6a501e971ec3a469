"""Steady states: what has to settle, messages of what does not, and how they change with parameters."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, CompiledTransition, Vector
from modelica_like.errors import InitializationError
from modelica_like.solve.initialize.kept import find_kept, solve_kept
from modelica_like.solve.initialize.memory import driving, listed
from modelica_like.solve.initialize.point import Point, call
from modelica_like.solve.initialize.slopes import slopes

_NEAR = (
    "Give guesses near the steady motion, such as guess(100) for a speed; "
    "an operating point can also start from the end of a run."
)


def not_steady(model: CompiledDae, point: Point) -> InitializationError:
    """Return the error of a point that is not steady: it names what changes most."""
    moving = moving_states(model)
    rates = np.concatenate([call(model, model.equations.ode, point)[moving], call(model, model.equations.alg, point)])
    worst = int(np.argmax(np.abs(rates)))
    name = model.states[moving[worst]] if worst < len(moving) else model.implicit[worst - len(moving)]
    return InitializationError(
        f"No steady state was found at t = {point.t:g} s: {name} keeps changing.",
        advice=f"Check that the drive has an equilibrium. {_NEAR}",
    )


def unsettled(model: CompiledDae, old: Vector, modes: Vector) -> InitializationError:
    """Return the error of modes that keep changing."""
    changing = [discrete.path for discrete, a, b in zip(model.flat_discretes, old, modes, strict=False) if a != b]
    return InitializationError(
        f"The modes at the start do not settle: {', '.join(changing)} and the start values keep changing each other.",
        advice="Give start values of states, which no mode changes.",
    )


def _equations(model: CompiledDae) -> Any:
    arguments = model.arguments.values()
    return ca.vertcat(model.equations.ode(*arguments), model.equations.alg(*arguments))


def moving_states(model: CompiledDae) -> list[int]:
    """Positions of the states on which something depends; the others, absolute angles, never settle."""

    def make() -> list[int]:
        return np.flatnonzero(ca.which_depends(_equations(model), model.arguments["x"], 1, False)).tolist()

    return model.once(Cached.MOVING, make)


def mode_not_steady(model: CompiledDae, point: Point, transition: CompiledTransition) -> InitializationError:
    """Return the error of a mode that a transition would leave at once."""
    mode = model.flat_discretes[transition.mode]
    return InitializationError(
        f"No steady state was found at t = {point.t:g} s: {mode.path} does not stay "
        f"{mode.names[int(point.d[transition.mode])]}.",
        where=transition.source,
        advice=_NEAR,
    )


def memory_not_steady(model: CompiledDae, point: Point, before: Vector) -> InitializationError:
    """Return the error of a point at rest that does not stay so when clocks tick: it names what ticks change."""
    changed = [k for k, discrete in enumerate(model.flat_discretes) if point.d[k] != before[k] and not discrete.hidden]
    moving = [k for k in changed if k in driving(model)] or changed
    # A number of samples changes with them.
    kept = [k for k in moving if model.flat_discretes[k].kind == "number"] or moving
    names = [model.flat_discretes[k].path for k in kept]
    return InitializationError(
        f"No steady state was found at t = {point.t:g} s: {listed(names) or 'what clocks set'} "
        f"{'change' if len(names) > 1 else 'changes'} at the next tick, and the motion with it.",
        advice="A run of this drive starts as given or at rest. An operating point may be found from the end of a run: "
        'steady(drive, near=simulate(drive, "10 s")), --after 10s on the command line.',
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
