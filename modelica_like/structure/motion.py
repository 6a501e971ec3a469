"""How expressions change along the solution while the implicit unknowns follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True)
class Motion:
    """What moves: expressions change with time and states, and with the implicit unknowns that follow from these.

    Attributes:
        t: symbol of time.
        x: states.
        z: implicit unknowns.
        ode: derivatives of the states.
        alg: residuals of the implicit equations.
    """

    t: Any
    x: Any
    z: Any
    ode: Any
    alg: Any

    def held(self, expressions: Any) -> Any:
        """Return time derivatives with the implicit unknowns (and inputs) held."""
        return ca.jtimes(expressions, self.x, self.ode) + ca.jtimes(expressions, self.t, ca.SX(1))

    def parts(self, expressions: Any) -> list[Any]:
        """Return what a time derivative is made of: held, the slopes by z, and the same two of the implicit equations.

        A model with many implicit unknowns is solved for their rates in numbers.
        """
        both = (expressions, self.alg)
        return [part for symbol in both for part in (self.held(symbol), ca.jacobian(symbol, self.z))]

    def rate(self, expressions: Any) -> Any:
        """Return time derivatives as expressions, with inputs held."""
        if not self.z.numel() or not ca.depends_on(expressions, self.z):
            return self.held(expressions)
        drift, jacobian = self.parts(self.alg)[:2]
        return self.held(expressions) + ca.jtimes(expressions, self.z, -ca.solve(ca.densify(jacobian), drift))
