"""How precise the steps of a replay are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.errors import ValueOutOfRange

ABSOLUTE = 1e-2
_ORDERS = 0.75
_FINEST, _COARSEST = 1e-13, 1e-3
_LEFT = 1e-2
"""Part of the wanted error that Newton's method may leave in states and unknowns: integrands feel it as noise."""
_ROUNDING = 1e-13
"""Noise of states and unknowns beside their sizes, however small the wanted error is, and of what follows from them:
hundreds of roundings."""
_BESIDE = 1e-15
"""Errors of an integral beside the largest one that is asked for which are nothing in any units."""


@dataclass(frozen=True)
class Tolerances:
    """How precisely to integrate again: relative to the states, or to a hundredth of their nominal values.

    A step can estimate the error of order s of its s stages, but its end has the order 2 s - 1. Therefore the estimate
    may be larger than the wanted error: by the power `_ORDERS`, where the orders alone would allow
    (s + 1)/(2 s), because the end loses order for stiff motions.
    """

    rtol: float = 1e-8

    def __post_init__(self) -> None:
        if not _FINEST <= self.rtol <= _COARSEST:
            raise ValueOutOfRange(
                f"The precision of a replay, {self.rtol:g}, is out of range: "
                f"it must be between {_FINEST:g} and {_COARSEST:g}."
            )

    def norm(self, relative: Vector) -> float:
        """Estimated error of a step, relative to the states, over what is allowed."""
        return float(np.linalg.norm(relative)) / (len(relative) ** 0.5 * self.rtol**_ORDERS)

    def of_integrals(self, errors: Vector, amounts: Vector, terms: Vector, noise: Vector) -> float:
        """Return the largest estimated error of integrals in a step over what is allowed.

        Args:
            errors: estimated.
            amounts: integrals of the amounts so far, to which the errors are relative.
            terms: what they would be if all terms of the integrands had one sign: their noise is relative to it.
            noise: integrals of the rounding of the integrands, over the unit roundoff.
        """
        allowed = self.rtol**_ORDERS * amounts + max(_LEFT * self.rtol, _ROUNDING) * terms + _ROUNDING * noise
        # Losses of parts at rest are the noise of motions beside them, far below the last digit of what these lose.
        allowed += _BESIDE * np.max(amounts, axis=1, keepdims=True, initial=0.0)
        # Of what is nothing but rounding, derivatives are those of the motion, whose steps are short enough for them.
        allowed[1, amounts[0] <= _ROUNDING * noise[0]] = np.inf
        return float(np.max(np.divide(errors, allowed, out=np.zeros(errors.shape), where=allowed > 0.0), initial=0.0))
