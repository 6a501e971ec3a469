"""Least sums of squares, by Gauss and Newton within a trust region (M. A. Branch, T. F. Coleman, Y. Li, 1999).

Their Hessian is the product of the Jacobian with itself, so that no quasi-Newton method has to learn it. What data do
not determine stays where it is: the barriers of `solve.py` would move it between its bounds. A design that is refused
shortens the step.
"""

from __future__ import annotations

import numpy as np

from modelica_like.analyse.optimize.designs import Designs, Outcome
from modelica_like.compile.buffers import Vector
from modelica_like.errors import extra_module

MOST = 100
"""Designs per free parameter: what converges does so within ten."""
_EXACT = {"ftol": 1e-14, "xtol": 1e-12, "gtol": 1e-12}
"""Gradients are exact: the search ends where rounding does."""


def least_squares(designs: Designs, x: Vector) -> Outcome:
    """Return where the sum of squares of all values is least, from a design that is known.

    Args:
        designs: their values are the residuals, shape (cases, outputs).
        x: values of what is free, in SI units.

    Raises:
        MissingExtra: scipy is not installed.
    """
    solver = extra_module("scipy.optimize", "analyse").least_squares
    start = designs.at(x)
    assert start is not None
    size = start.values.size

    def residuals(q: Vector) -> Vector:
        design = designs.at(designs.low + designs.span * q)
        return design.values.ravel() if design is not None else np.full(size, np.nan)

    def slopes(q: Vector) -> Vector:
        design = designs.at(designs.low + designs.span * q)
        assert design is not None  # the solver only asks where it has gone
        return design.slopes.reshape(size, -1) * designs.span

    with designs.interruptible(lambda values: (float(np.sum(values**2)), 0.0)):
        begin = (x - designs.low) / designs.span
        fit = solver(residuals, begin, slopes, bounds=(0.0, 1.0), x_scale="jac", max_nfev=MOST * len(x), **_EXACT)
    end = designs.low + designs.span * fit.x
    return Outcome(end, 2.0 * float(fit.cost), 0.0, np.zeros((0, 0)), bool(fit.success), str(fit.message))
