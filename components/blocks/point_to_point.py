"""Fastest motion from one point to another: reference signals of positioning drives."""

from __future__ import annotations

from components import icons
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    absolute,
    der,
    maximum,
    minimum,
    param,
    sign,
    signal_out,
    sqrt,
)


class KinematicPTP2(Component):
    """Position, speed and acceleration of the fastest motion from q_begin to q_end within limits of the latter two.

    It accelerates, keeps the largest speed, and brakes; over a short distance it brakes before it reaches that speed.
    Modelica Standard Library, Blocks.Sources.KinematicPTP2; its KinematicPTP is the output qdd.
    """

    icon = icons.PATH
    q_begin: Parameter = param("*", "position at the start", default=0.0)
    q_end: Parameter = param("*", "position at the end")
    qd_max: Parameter = param("*", "largest speed", min=1e-30)
    qdd_max: Parameter = param("*", "largest acceleration", min=1e-30)
    start_time: Parameter = param("s", "start of the motion", default=0.0)
    q: Output = signal_out("*", "position")
    qd: Output = signal_out("*", "speed")
    qdd: Output = signal_out("*", "acceleration")
    stage = Mode("waiting", "accelerating", "cruising", "braking", "arrived", description="part of the motion")

    @property
    def way(self) -> Expr:
        """Distance, with its sign."""
        return self.q_end - self.q_begin

    @property
    def rise(self) -> Expr:
        """Duration of the acceleration, and of the braking."""
        return minimum(sqrt(absolute(self.way) / self.qdd_max), self.qd_max / self.qdd_max)

    @property
    def duration(self) -> Expr:
        """Duration of the motion."""
        way = absolute(self.way)
        return self.rise + maximum(sqrt(way / self.qdd_max), way / self.qd_max)

    def equations(self) -> Equations:
        gone = self.time - self.start_time
        left, peak = self.duration - gone, self.qdd_max * self.rise
        up, down = 0.5 * self.qdd_max * gone**2, 0.5 * self.qdd_max * left**2
        travelled = self.stage.choose(
            waiting=0, accelerating=up, cruising=peak * (gone - 0.5 * self.rise),
            braking=absolute(self.way) - down, arrived=absolute(self.way),
        )  # fmt: skip
        yield self.q == self.q_begin + sign(self.way) * travelled
        yield self.qd == der(self.q)
        yield self.qdd == der(self.qd)

    def events(self) -> Events:
        begin = self.start_time
        ends = begin, begin + self.rise, begin + self.duration - self.rise, begin + self.duration
        stages = ("waiting", "accelerating", "cruising", "braking", "arrived")
        for stage, end in zip(reversed(stages), reversed(ends), strict=False):
            yield self.stage.initially(stage, when=self.time >= end)
        for before, after, end in zip(stages, stages[1:], ends, strict=False):
            yield self.stage.go(before, after, at=end)
