"""Sampled signals for digital controllers, and noise."""

from __future__ import annotations

from math import pi

from components import icons
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Expr,
    Input,
    Output,
    Parameter,
    clock,
    cos,
    discrete,
    integer,
    log,
    param,
    pre,
    random,
    signal_in,
    signal_out,
    sqrt,
    when,
    where,
)


class Sampled(Component, partial=True):
    """Signal that changes at sample times only; before the first one it is zero."""

    period: Parameter = param("s", "time between two samples", min=1e-12)
    start_time: Parameter = param("s", "time of the first sample", default=0.0)
    y: Output = signal_out("*", "signal")
    number: Discrete = integer("number of samples so far")

    def held(self) -> Expr:
        """Return the value since the last sample."""
        raise NotImplementedError

    def sample(self) -> dict[Expr, Expr]:
        """Return the changes at a sample."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield self.y == where(self.number > 0, self.held(), 0)

    def events(self) -> Events:
        yield when(clock(self.period, self.start_time), {self.number: pre(self.number) + 1, **self.sample()})


class ZeroOrderHold(Sampled):
    """Sample and hold: keeps the value of the signal at the last sample time.

    Modelica Standard Library, Blocks.Discrete.ZeroOrderHold.
    """

    icon = icons.SCHEDULE
    u: Input = signal_in("*", "signal")
    last: Discrete = discrete("*", "signal at the last sample")

    def held(self) -> Expr:
        return self.last

    def sample(self) -> dict[Expr, Expr]:
        return {self.last: self.u}


class FrequencyMeter(ZeroOrderHold):
    """Counts per time over the last period, e.g. the speed from the pulses of a `PulseCounter`."""

    icon = icons.SENSOR
    k: Parameter = param("*", "signal for one count per second, such as an angle per pulse", default=1.0)
    before: Discrete = discrete("*", "signal at the sample before")

    def held(self) -> Expr:
        return self.k * (self.last - self.before) / self.period

    def sample(self) -> dict[Expr, Expr]:
        return {self.last: self.u, self.before: pre(self.last)}


class Noise(Sampled, partial=True):
    """Random numbers that are the same in every run with the same seed.

    They come from the generator x = 48271·x mod (2^31 - 1) of S. K. Park, K. W. Miller and P. K. Stockmeyer
    (Communications of the ACM 36, 1993), `minstd_rand` of C++.
    """

    icon = icons.NOISE
    seed: Parameter = param("1", "whole number that begins the sequence", default=1.0, min=1, max=2147483646.0)
    uniform: Discrete = discrete("1", "random number between 0 and 1", start="seed / 2147483647")


class UniformNoise(Noise):
    """Random signal between two limits, each value as probable as the others."""

    y_max: Parameter = param("*", "upper limit", default=1.0)
    y_min: Parameter = param("*", "lower limit", default=0.0)

    def held(self) -> Expr:
        return self.y_min + (self.y_max - self.y_min) * self.uniform

    def sample(self) -> dict[Expr, Expr]:
        return {self.uniform: random(pre(self.uniform))}


class NormalNoise(Noise):
    """Random signal of normal distribution, by the transformation of G. E. P. Box and M. E. Muller."""

    sigma: Parameter = param("*", "standard deviation", default=1.0)
    mu: Parameter = param("*", "mean", default=0.0)

    def held(self) -> Expr:
        radius = sqrt(-2 * log(self.uniform))
        return self.mu + self.sigma * radius * cos(2 * pi * random(self.uniform))

    def sample(self) -> dict[Expr, Expr]:
        return {self.uniform: random(random(pre(self.uniform)))}
