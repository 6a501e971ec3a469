"""How torques and forces of loads depend on the relative speed x = speed / nominal speed."""

from __future__ import annotations

from modelica_like.language import Expr, absolute, maximum, tanh, where


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


def sign_law(x: Expr) -> Expr:
    """Return the sign of x, smoothed: 0.99 at x = 1."""
    return tanh(2.6467 * x)
