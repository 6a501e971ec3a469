"""Time derivatives of variables along a run."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import UnknownName, did_you_mean


def differentiated(path: str) -> str:
    """Return the variable in `der(variable)`, or an empty text for other paths."""
    return path[4:-1].strip() if path.startswith("der(") and path.endswith(")") else ""


def rate_along(model: CompiledDae, name: str, times: Any, x: Vector, z: Vector, d: Vector) -> Vector:
    """Return the time derivative of one variable, with the inputs held.

    Args:
        model: the compiled model.
        name: path of the variable.
        times: shape (n,), in s.
        x: states, shape (nx, n).
        z: implicit unknowns, shape (nz, n).
        d: modes and discrete values, shape (nd, n).

    Returns:
        Shape (n,), in the variable's unit per second.

    Raises:
        UnknownName: there is no such variable, or it changes only at events.
    """
    if name not in model.position:
        near = did_you_mean(name, list(model.position)) or "."
        raise UnknownName(f"{model.name} has no continuous variable '{name}'{near}")
    row, arguments = model.position[name], list(model.arguments.values())

    def make() -> ca.Function:
        parts = model.motion.parts(model.variables(*arguments)[row])
        return ca.Function("rate", arguments, [ca.densify(part) for part in parts])

    parts = model.once(("rate", name), make)(np.reshape(times, (1, -1)), x, z, model.p, model.u, d)
    direct, by_z, drift, jacobian = (np.asarray(part.full()) for part in parts)
    if not model.implicit:
        return direct.ravel()
    count, size = len(times), len(model.implicit)
    slopes = jacobian.reshape(size, count, size).transpose(1, 0, 2)
    z_rates = -np.linalg.solve(slopes, drift.T[:, :, None])[:, :, 0]
    return direct.ravel() + np.sum(by_z.reshape(count, size) * z_rates, axis=1)
