"""Motions: prescribed with their derivatives, started from signals, and relative motions as states."""

from __future__ import annotations

from math import pi

from components import icons
from components.interfaces import (
    CompliantWithRelativeStates,
    Flange,
    LinearCompliantWithRelativeStates,
    LinearFlange,
)
from components.mechanics.sources import AT_ONCE
from components.rotational.shaft_sources import ShaftMotionSource
from components.translational.translational_sources import MotionSource
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Input,
    Mode,
    Parameter,
    Variable,
    der,
    discrete,
    param,
    signal_in,
    var,
)


class Move(ShaftMotionSource):
    """Motion of a shaft given by signals of angle, speed and acceleration, which are derivatives of each other.

    No signal is differentiated: the shaft starts with the angle and the speed and follows the acceleration; deviations
    from angle and speed decay critically damped, with f_crit.
    """

    icon = icons.ANGLE
    phi_ref: Input = signal_in("rad", "angle")
    w_ref: Input = signal_in("rad/s", "speed")
    a_ref: Input = signal_in("rad/s2", "angular acceleration")
    f_crit: Parameter = param("Hz", "critical frequency of the decay of deviations", default=5.0, min=0)
    phi: Variable = var("rad", "angle of the shaft relative to the housing", state="always", default=0)
    w: Variable = var("rad/s", "speed of the shaft relative to the housing", state="always", default=0)
    stage = Mode("before", "moving", description="before or after the start")
    begin: Discrete = discrete("s", "time of the start", start=AT_ONCE)

    def equations(self) -> Equations:
        yield from super().equations()
        pull = 2 * pi * self.f_crit
        deviation = 2 * (self.w_ref - self.w) + pull * (self.phi_ref - self.phi)
        yield der(self.w) == self.a_ref + pull * deviation

    def events(self) -> Events:
        start = {self.begin: self.time, self.phi: self.phi_ref, self.w: self.w_ref}
        yield self.stage.go("before", "moving", at=self.begin, reset=start)


class TranslationalMove(MotionSource):
    """Motion of a slide given by signals of position, velocity and acceleration; see `Move`."""

    icon = icons.POSITION
    s_ref: Input = signal_in("m", "position")
    v_ref: Input = signal_in("m/s", "velocity")
    a_ref: Input = signal_in("m/s2", "acceleration")
    f_crit: Parameter = param("Hz", "critical frequency of the decay of deviations", default=5.0, min=0)
    s: Variable = var("m", "position of the slide relative to the housing", state="always", default=0)
    v: Variable = var("m/s", "velocity of the slide relative to the housing", state="always", default=0)
    stage = Mode("before", "moving", description="before or after the start")
    begin: Discrete = discrete("s", "time of the start", start=AT_ONCE)

    def equations(self) -> Equations:
        yield from super().equations()
        pull = 2 * pi * self.f_crit
        deviation = 2 * (self.v_ref - self.v) + pull * (self.s_ref - self.s)
        yield der(self.v) == self.a_ref + pull * deviation

    def events(self) -> Events:
        start = {self.begin: self.time, self.s: self.s_ref, self.v: self.v_ref}
        yield self.stage.go("before", "moving", at=self.begin, reset=start)


class InitializeFlange(Component):
    """Start of a shaft from signals: at the start of a run it gets their angle and speed; later it is free.

    The acceleration follows from the torques; it can be given as the start value of `a`, which then determines, e.g.,
    the twist of a spring. In the Modelica Standard Library it is also a signal.
    """

    icon = icons.START
    flange = Flange("shaft end")
    use_phi: bool = True
    """Give the angle."""
    use_w: bool = True
    """Give the speed."""
    phi_start: Input = signal_in("rad", "angle at the start", default=0.0)
    w_start: Input = signal_in("rad/s", "speed at the start", default=0.0)
    phi: Variable = var("rad", "angle of the shaft", state="always", default=0)
    w: Variable = var("rad/s", "speed of the shaft", state="always", default=0)
    a: Variable = var("rad/s2", "angular acceleration of the shaft")
    stage = Mode("before", "free", description="before or after the start")
    begin: Discrete = discrete("s", "time of the start", start=AT_ONCE)

    def equations(self) -> Equations:
        yield self.flange.phi == self.phi
        yield der(self.phi) == self.w
        yield der(self.w) == self.a
        yield self.flange.tau == 0

    def events(self) -> Events:
        start = {self.begin: self.time}
        start |= {self.phi: self.phi_start} if self.use_phi else {}
        start |= {self.w: self.w_start} if self.use_w else {}
        yield self.stage.go("before", "free", at=self.begin, reset=start)


class TranslationalInitializeFlange(Component):
    """Start of a slide from signals of position and velocity; see `InitializeFlange`."""

    icon = icons.START
    flange = LinearFlange("slide end")
    use_s: bool = True
    """Give the position."""
    use_v: bool = True
    """Give the velocity."""
    s_start: Input = signal_in("m", "position at the start", default=0.0)
    v_start: Input = signal_in("m/s", "velocity at the start", default=0.0)
    s: Variable = var("m", "position of the slide", state="always", default=0)
    v: Variable = var("m/s", "velocity of the slide", state="always", default=0)
    a: Variable = var("m/s2", "acceleration of the slide")
    stage = Mode("before", "free", description="before or after the start")
    begin: Discrete = discrete("s", "time of the start", start=AT_ONCE)

    def equations(self) -> Equations:
        yield self.flange.s == self.s
        yield der(self.s) == self.v
        yield der(self.v) == self.a
        yield self.flange.f == 0

    def events(self) -> Events:
        start = {self.begin: self.time}
        start |= {self.s: self.s_start} if self.use_s else {}
        start |= {self.v: self.v_start} if self.use_v else {}
        yield self.stage.go("before", "free", at=self.begin, reset=start)


class RelativeStates(CompliantWithRelativeStates):
    """Makes the relative angle and speed of two shafts the states of the model; it carries no torque.

    Then the states stay small while both shafts keep turning.
    """

    icon = icons.STATES
    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="always")
    w_rel: Variable = var("rad/s", "relative speed", state="always")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == 0


class TranslationalRelativeStates(LinearCompliantWithRelativeStates):
    """Makes the relative position and velocity of two slides the states of the model; it carries no force."""

    icon = icons.STATES
    s_rel: Variable = var("m", "relative position, flange_b.s - flange_a.s", state="always")
    v_rel: Variable = var("m/s", "relative velocity", state="always")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.f == 0
