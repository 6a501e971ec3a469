"""Speed from pulses: what a Hall sensor with a frequency meter shows."""

from __future__ import annotations

from math import pi

from components import icons
from components.interfaces import Flange
from components.sources import AT_ONCE
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Output,
    Parameter,
    discrete,
    floor,
    param,
    signal_out,
)

_HYSTERESIS = 0.5
"""By how much of the distance between two magnets the shaft must turn back to make another pulse."""


class PulseSpeedSensor(Component):
    """Speed by counting pulses: magnets on a shaft, a Hall sensor, and a frequency meter with a gate time.

    Every magnet that passes makes one pulse, whatever the direction. At the end of each gate the meter shows the mean
    speed over it, in steps of 2·pi/(pulses·gate); in between it keeps what it has.
    """

    icon = icons.SENSOR
    flange = Flange("measured shaft end")
    pulses: Parameter = param("1", "pulses per turn", default=4.0, min=1)
    gate: Parameter = param("s", "gate time of the frequency meter", default=1.0, min=1e-9)
    w: Output = signal_out("rad/s", "speed that the meter shows, without sign")
    shown: Discrete = discrete("rad/s", "speed over the last gate")
    passed: Discrete = discrete("1", "magnets that have passed, backwards counted down")
    count: Discrete = discrete("1", "pulses since the gate was opened")
    begin: Discrete = discrete("s", "time of the start", start=AT_ONCE)
    gates: Discrete = discrete("1", "gates that are over")
    meter = Mode("off", "counting", description="frequency meter")

    def equations(self) -> Equations:
        yield self.flange.tau == 0
        yield self.w == self.shown

    def events(self) -> Events:
        meter, position, one_more = self.meter, self.pulses * self.flange.phi / (2 * pi), {self.count: self.count + 1}
        first = {self.passed: floor(position), self.gates: floor(self.time / self.gate)}
        yield meter.go("off", "counting", at=self.begin, reset=first)
        forward, backward = ({self.passed: self.passed + step, **one_more} for step in (1, -1))
        passes = "a magnet passes"
        yield meter.go("counting", "counting", when=position > self.passed + 1, reset=forward, because=passes)
        turned = position < self.passed - _HYSTERESIS
        yield meter.go("counting", "counting", when=turned, reset=backward, because=passes)
        mean = 2 * pi * self.count / (self.pulses * self.gate)
        closed = {self.shown: mean, self.count: 0, self.gates: self.gates + 1}
        end = (self.gates + 1) * self.gate
        yield meter.go("counting", "counting", at=end, reset=closed, because="the gate closes")
