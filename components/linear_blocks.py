"""Linear blocks: transfer functions, filters, derivatives."""

from __future__ import annotations

from components import icons
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Input,
    LanguageError,
    Output,
    Parameter,
    Variable,
    column,
    connect,
    der,
    param,
    rows,
    signal_in,
    signal_out,
    var,
)

Flat = tuple[float, ...]


class Derivative(Component):
    """Smoothed derivative: y = k·s/(1 + T·s)·u. Modelica Standard Library, Blocks.Continuous.Derivative."""

    icon = icons.DERIVATIVE
    u: Input = signal_in("*", "signal")
    k: Parameter = param("*", "factor", default=1.0)
    T: Parameter = param("s", "time constant of the smoothing", default=0.01, min=1e-12)
    x: Variable = var("*", "smoothed signal")
    y: Output = signal_out("*", "smoothed derivative times k")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.u - self.x
        yield self.T * self.y == self.k * (self.u - self.x)


class SecondOrder(Component):
    """Signal that follows another as an oscillator does: der(der(y))/w² + 2·D/w·der(y) + y = k·u."""

    icon = icons.DECAY
    u: Input = signal_in("*", "signal")
    k: Parameter = param("*", "output over signal at rest", default=1.0)
    w: Parameter = param("rad/s", "angular frequency without damping", min=1e-12)
    D: Parameter = param("1", "damping ratio", default=1.0, min=0)
    yd: Variable = var("*", "rate of the output")
    y: Output = signal_out("*", "delayed signal")

    def equations(self) -> Equations:
        yield der(self.y) == self.yd
        yield der(self.yd) == self.w * (self.w * (self.k * self.u - self.y) - 2 * self.D * self.yd)


class Chained(Component):
    """One integrator of a transfer function; it starts at zero."""

    icon = icons.INTEGRATOR
    u: Input = signal_in("*", "rate")
    T: Parameter = param("s", "time that counts as 1", default=1.0, min=1e-12)
    x: Variable = var("*", "state", default=0.0)
    y: Output = signal_out("*", "state")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.u
        yield self.y == self.x


class TransferFunction(Component):
    """Transfer function y/u = k·num(s)/den(s); coefficients belong to falling powers of s·time_scale.

    Its states are those of a chain of integrators (controllable canonical form); at the start they are zero if nothing
    is said. Modelica Standard Library, Blocks.Continuous.TransferFunction.
    """

    icon = icons.TRANSFER
    u: Input = signal_in("*", "signal")
    num: Flat = rows(column("coefficient of the numerator"), flat=True, default=(1.0,))
    den: Flat = rows(column("coefficient of the denominator"), flat=True)
    k: Parameter = param("*", "factor", default=1.0)
    time_scale: Parameter = param("s", "time that counts as 1", default=1.0, min=1e-12)
    first: Output = signal_out("*", "input of the chain of integrators")
    y: Output = signal_out("*", "output")

    def build(self) -> None:
        order = len(self.den) - 1
        if self.den[0] == 0 or len(self.num) > len(self.den):
            raise LanguageError(
                f"{self.label}: the numerator {list(self.num)} over the denominator {list(self.den)} is no transfer "
                "function that can be computed.",
                advice="The first coefficient of the denominator must not be zero, and the numerator not be longer.",
            )
        self.chain = [Chained(T="time_scale")] * order

    def equations(self) -> Equations:
        ahead = self.first
        states: list[Expr] = [ahead]
        for one in self.chain:
            yield connect(ahead, one.u)
            ahead = one.y
            states.append(ahead)
        yield self.u == sum((a * x for a, x in zip(self.den, states, strict=True)), 0)
        used = states[len(states) - len(self.num) :]
        yield self.y == self.k * sum((b * x for b, x in zip(self.num, used, strict=True)), 0)
