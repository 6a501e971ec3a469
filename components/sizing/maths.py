"""Functions for floats, NumPy arrays and CasADi expressions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.language.quantities import Number, is_symbolic

_ROUNDING = 1e-12
_NO_SOLUTION = "The equations have no unique solution."


def _function(numeric: Callable[..., Any], symbolic: Callable[..., Any], text: str) -> Callable[..., Number]:
    def function(*values: Number) -> Number:
        return symbolic(*values) if is_symbolic(*values) else numeric(*values)

    function.__doc__ = text
    return function


def _choose(condition: Any, then: Any, otherwise: Any) -> Any:
    return np.where(condition, then, otherwise)[()]


sqrt = _function(np.sqrt, ca.sqrt, "Square root.")
exp = _function(np.exp, ca.exp, "Exponential function.")
log = _function(np.log, ca.log, "Natural logarithm.")
log10 = _function(np.log10, ca.log10, "Decimal logarithm.")
sin = _function(np.sin, ca.sin, "Sine of an angle in rad.")
cos = _function(np.cos, ca.cos, "Cosine of an angle in rad.")
tan = _function(np.tan, ca.tan, "Tangent of an angle in rad.")
acos = _function(np.arccos, ca.acos, "Angle in rad with a given cosine.")
asin = _function(np.arcsin, ca.asin, "Angle in rad with a given sine.")
floor = _function(np.floor, ca.floor, "Largest whole number not above a value.")
sign = _function(np.sign, ca.sign, "Sign: -1, 0 or 1.")
absolute = _function(np.abs, ca.fabs, "Absolute value.")
hypot = _function(np.hypot, lambda x, y: ca.sqrt(x * x + y * y), "Resultant of two values at a right angle.")
where = _function(_choose, ca.if_else, "Choose by a condition: where(condition, then, otherwise).")
_greater = _function(np.maximum, ca.fmax, "Larger of two values.")
_smaller = _function(np.minimum, ca.fmin, "Smaller of two values.")


def maximum(*values: Number) -> Number:
    """Return the largest of several values."""
    return reduce(_greater, values)


def minimum(*values: Number) -> Number:
    """Return the smallest of several values."""
    return reduce(_smaller, values)


def solve(rows: Sequence[Sequence[Number]], right: Sequence[Number]) -> list[Number]:
    """Solve a small linear system.

    Args:
        rows: coefficients of each equation.
        right: right-hand sides.

    Raises:
        ValueError: the equations have no unique solution.
    """
    entries = [*(entry for row in rows for entry in row), *right]
    if is_symbolic(*entries):
        matrix = ca.vertcat(*(ca.horzcat(*row) for row in rows))
        solution = ca.solve(matrix, ca.vertcat(*right))
        return [solution[k] for k in range(len(rows))]
    same_shape = np.broadcast_arrays(*(np.asarray(entry, dtype=float) for entry in entries))
    count = len(rows)
    matrix = np.stack(same_shape[: count * count], axis=-1).reshape(*same_shape[0].shape, count, count)
    vector = np.stack(same_shape[count * count :], axis=-1)[..., None]
    size = np.max(np.abs(matrix), axis=-1, keepdims=True)
    require(_NO_SOLUTION, np.isfinite(size), size > 0)
    # Equations in different units are none the worse for it.
    require(_NO_SOLUTION, np.linalg.cond(matrix / size) < 1 / _ROUNDING)
    solution = np.linalg.solve(matrix, vector)[..., 0]
    return [solution[..., k] if same_shape[0].ndim else float(solution[k]) for k in range(count)]


def settled(value: Number, scale: Number) -> Number:
    """Return a value, or zero if it is rounding in a difference of values of the size of `scale`."""
    if is_symbolic(value, scale):
        return value
    return where(np.abs(value) > _ROUNDING * np.abs(scale), value, 0.0 * np.abs(value))


def require(message: str, *conditions: Number) -> None:
    """Refuse invalid numbers; a symbolic condition cannot be decided, so it passes.

    Raises:
        ValueError: with the message.
    """
    for condition in conditions:
        if not is_symbolic(condition) and not np.all(condition):
            raise ValueError(message)
