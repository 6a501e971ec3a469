"""Laws of torques and forces of loads over the relative speed x = speed / nominal speed."""

from __future__ import annotations

from math import pi
from typing import Literal

from modelica_like.language import Expr, absolute, cos, maximum, minimum, sign, sin, tanh, where


def linear_law(x: Expr, reverses: bool) -> Expr:
    """Return x, or |x| if the direction does not depend on that of the speed."""
    return x if reverses else absolute(x)


def quadratic_law(x: Expr, reverses: bool) -> Expr:
    """Return x·|x|, or x²."""
    return x * absolute(x) if reverses else x**2


def inverse_law(x: Expr, x0: Expr, reverses: bool) -> Expr:
    """Return 1/x, or 1/|x|; below x0 it falls linearly to zero, or stays constant."""
    reach = maximum(absolute(x), x0)
    return where(absolute(x) < x0, x / x0**2, 1 / x) if reverses else 1 / reach


Regularization = Literal["exp", "sine", "linear", "cosine"]
"""Regularization of a sign at zero, as in the Modelica Standard Library, Blocks.Types.Regularization."""


def sign_law(x: Expr, reg: Regularization) -> Expr:
    """Return the sign of x, smoothed between -1 and 1; `exp` is narrower: 0.99 at x = 0.053."""
    inside = maximum(minimum(x, 1), -1)
    match reg:
        case "exp":
            return tanh(50 * x)
        case "sine":
            return sin(0.5 * pi * inside)
        case "linear":
            return inside
        case "cosine":
            return sign(x) * (1 - cos(0.5 * pi * inside))
