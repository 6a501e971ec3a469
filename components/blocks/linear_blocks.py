"""Linear blocks: transfer functions, state spaces, filters, derivatives."""

from __future__ import annotations

from collections.abc import Sequence

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
    T: Parameter = param("s", "scale of the time", default=1.0, min=1e-12)
    x: Variable = var("*", "state", default=0.0)
    y: Output = signal_out("*", "state")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.u
        yield self.y == self.x


class TransferFunction(Component):
    """Transfer function y/u = k·num(s)/den(s); coefficients are in falling powers of s·time_scale.

    Its states are those of a chain of integrators (controllable canonical form); at the start they are zero by
    default. Modelica Standard Library, Blocks.Continuous.TransferFunction.
    """

    icon = icons.TRANSFER
    u: Input = signal_in("*", "signal")
    num: Flat = rows(column("coefficient of the numerator"), flat=True, default=(1.0,))
    den: Flat = rows(column("coefficient of the denominator"), flat=True)
    k: Parameter = param("*", "factor", default=1.0)
    time_scale: Parameter = param("s", "scale of the time", default=1.0, min=1e-12)
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
        for block in self.chain:
            yield connect(ahead, block.u)
            ahead = block.y
            states.append(ahead)
        yield self.u == sum((a * x for a, x in zip(self.den, states, strict=True)), 0)
        used = states[len(states) - len(self.num) :]
        yield self.y == self.k * sum((b * x for b, x in zip(self.num, used, strict=True)), 0)


class StateSpace(Component):
    """Linear system of several signals: time_scale·der(x) = A·x + B·u, y = C·x + D·u, from u[1] … to y[1] ….

    Its states x[1] … start at zero if nothing is said. Modelica Standard Library, Blocks.Continuous.StateSpace.
    """

    icon = icons.STATE_SPACE
    A: tuple[Flat, ...] = rows(column("rate by a state"), more=True)
    B: tuple[Flat, ...] = rows(column("rate by a signal"), more=True)
    C: tuple[Flat, ...] = rows(column("output by a state"), more=True)
    D: tuple[Flat, ...] = rows(column("output by a signal"), more=True, default=((0.0,),))
    time_scale: Parameter = param("s", "scale of the time", default=1.0, min=1e-12)

    @property
    def direct(self) -> tuple[Flat, ...]:
        """D; where nothing is said, zeros."""
        return ((0.0,) * len(self.B[0]),) * len(self.C) if self.D == ((0.0,),) else self.D

    def build(self) -> None:
        states, inputs, outputs = len(self.A), len(self.B[0]), len(self.C)
        shapes = [(len(matrix), len(matrix[0])) for matrix in (self.A, self.B, self.C, self.direct)]
        wanted = [(states, states), (states, inputs), (outputs, states), (outputs, inputs)]
        for name, shape, right in zip("ABCD", shapes, wanted, strict=True):
            if shape != right:
                raise LanguageError(
                    f"{self.label}.{name} has {shape[0]} rows of {shape[1]} numbers.",
                    advice=f"For {states} states, {inputs} signals, {outputs} outputs give {right[0]} of {right[1]}.",
                )
        self.declare_array("x", states, var("*", "state", default=0.0))
        self.declare_array("u", inputs, signal_in("*", "signal"))
        self.declare_array("y", outputs, signal_out("*", "output"))

    def equations(self) -> Equations:
        x, u = self.array("x"), self.array("u")
        for output, by_state, by_signal in zip(x, self.A, self.B, strict=True):
            yield self.time_scale * der(output) == _product(by_state, x) + _product(by_signal, u)
        for output, by_state, by_signal in zip(self.array("y"), self.C, self.direct, strict=True):
            yield output == _product(by_state, x) + _product(by_signal, u)


def _product(row: Flat, values: Sequence[Expr]) -> Expr | float:
    return sum(a * x for a, x in zip(row, values, strict=True) if not isinstance(a, float) or a)
