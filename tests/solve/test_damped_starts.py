"""Starts where whole steps of Newton's method go to and fro for ever."""

from typing import Any

import numpy as np
import pytest

from modelica_like import simulate
from modelica_like.language import (
    Component,
    Equations,
    Parameter,
    Variable,
    absolute,
    der,
    maximum,
    minimum,
    param,
    var,
)


class Amplifier(Component):
    """Limited, with the share 1/gain of its output fed back: y = V0·u/(1 + V0/gain) between the limits."""

    y: Variable = var("V", "output")
    gain: Parameter = param("1", default=3.0)
    V0: Parameter = param("1", default=15000.0)
    u: Parameter = param("V", default=1.0)
    limit: Parameter = param("V", default=15.0)

    def limited(self, y: Variable) -> Any:
        return maximum(minimum(self.V0 * (self.u - y / self.gain), self.limit), -self.limit)

    def equations(self) -> Equations:
        yield self.y == self.limited(self.y)


class Steady(Amplifier):
    """Its output follows in 2 s, and is at rest at the start: the start system has the same equation."""

    T: Parameter = param("s", default=2.0)

    def equations(self) -> Equations:
        yield self.T * der(self.y) == self.limited(self.y) - self.y

    def initial_equations(self) -> Equations:
        yield der(self.y) == 0


class Pair(Component):
    """Two amplifiers around each other; one of them has a kink at zero, too."""

    a: Variable = var("V")
    b: Variable = var("V")
    u: Parameter = param("V", default=2.0)
    limit: Parameter = param("V", default=10.0)

    def equations(self) -> Equations:
        first = 1e4 * (self.u - 0.5 * self.a - 0.25 * self.b)
        second = 1e4 * (self.a - self.b) + absolute(self.b)
        yield self.a == maximum(minimum(first, self.limit), -self.limit)
        yield self.b == maximum(minimum(second, self.limit), -self.limit)


@pytest.mark.parametrize("kind", [Amplifier, Steady])
@pytest.mark.parametrize("u", [-2.0, 1.0, 4.0])
def test_an_amplifier_with_limits_starts_from_zero(kind: type[Amplifier], u: float) -> None:
    run = simulate(kind(u=u), 1.0)
    linear = 15000 * u / (1 + 15000 / 3)
    assert run["y"] == pytest.approx(np.full(run.time.size, min(linear, 15.0)), rel=1e-9)


def test_two_amplifiers_start_from_zero() -> None:
    run = simulate(Pair(), 1.0)
    # 1e4 (a - b) + b = b, so a = b = 1e4·(2 - 0.75·a)
    assert [run.final["a"], run.final["b"]] == pytest.approx([2e4 / (1 + 7.5e3)] * 2, rel=1e-9)
