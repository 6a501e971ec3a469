"""Adaptors between connectors and signals, for drives cut into parts that exchange signals, e.g. FMUs.

One side provides the potential (angle, position, voltage, temperature), the other the flow (torque, force, current,
heat flow); this choice decides the states of the parts. A flow signal is positive from the other part into this one.
"""

from __future__ import annotations

from components import icons
from components.electrical.analog import Pin
from components.interfaces import Flange, LinearFlange
from components.thermal import HeatPort
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Input,
    Output,
    Terminal,
    Variable,
    der,
    signal_in,
    signal_out,
    var,
)

ROTATIONAL = "org.modelica.mechanics.rotational.flange"
TRANSLATIONAL = "org.modelica.mechanics.translational.flange"
ELECTRICAL = "org.modelica.electrical.analog.pin"
THERMAL = "org.modelica.thermal.heat_transfer.port"


class TorqueToAngleAdaptor(Component):
    """Shaft end of a part that receives a torque and returns its motion: it keeps its inertia and its states."""

    icon = icons.BOUNDARY
    terminal = Terminal(ROTATIONAL, takes="flow")
    flange = Flange("shaft end")
    use_w: bool = True
    """Also output the speed."""
    use_a: bool = True
    """Also output the acceleration."""
    tau: Input = signal_in("N.m", "torque on the shaft")
    phi: Output = signal_out("rad", "angle of the shaft")
    w: Output = signal_out("rad/s", "speed of the shaft; 0 unless use_w")
    a: Output = signal_out("rad/s2", "acceleration of the shaft; 0 unless use_a")
    speed: Variable = var("rad/s", "speed")

    def terminal_members(self) -> tuple[str, ...]:
        return _told(use_w=self.use_w, use_a=self.use_a, names=("phi", "w", "a", "tau"))

    def equations(self) -> Equations:
        yield self.phi == self.flange.phi
        yield self.speed == der(self.flange.phi)
        yield self.w == (self.speed if self.use_w else 0)
        if self.use_a:
            yield self.a == der(self.speed)
        else:
            yield self.a == 0
        yield self.flange.tau == -self.tau

    def source_power(self) -> Expr:
        return self.tau * der(self.flange.phi)


class AngleToTorqueAdaptor(Component):
    """Shaft end of a part that receives a motion and returns a torque: the end has no states.

    A spring needs only the angle, a damper also the speed, an inertia also the acceleration. The source of the
    signals must make sure that they are derivatives of each other.
    """

    icon = icons.BOUNDARY
    terminal = Terminal(ROTATIONAL, takes="potential", rates=(("phi", "w"), ("w", "a")), power=("tau", "w"))
    flange = Flange("shaft end")
    phi: Input = signal_in("rad", "angle of the shaft")
    w: Input = signal_in("rad/s", "speed of the shaft", default=0.0)
    a: Input = signal_in("rad/s2", "acceleration of the shaft", default=0.0)
    tau: Output = signal_out("N.m", "torque on the other part")

    def equations(self) -> Equations:
        yield self.flange.phi == self.phi
        yield self.tau == self.flange.tau

    def source_power(self) -> Expr:
        return -self.flange.tau * der(self.flange.phi)


class ForceToPositionAdaptor(Component):
    """Slide end of a part that receives a force and returns its motion: it keeps its mass and its states."""

    icon = icons.BOUNDARY
    terminal = Terminal(TRANSLATIONAL, takes="flow")
    flange = LinearFlange("slide end")
    use_v: bool = True
    """Also output the velocity."""
    use_a: bool = True
    """Also output the acceleration."""
    f: Input = signal_in("N", "force on the slide")
    s: Output = signal_out("m", "position of the slide")
    v: Output = signal_out("m/s", "velocity of the slide; 0 unless use_v")
    a: Output = signal_out("m/s2", "acceleration of the slide; 0 unless use_a")
    velocity: Variable = var("m/s", "velocity")

    def terminal_members(self) -> tuple[str, ...]:
        return _told(use_w=self.use_v, use_a=self.use_a, names=("s", "v", "a", "f"))

    def equations(self) -> Equations:
        yield self.s == self.flange.s
        yield self.velocity == der(self.flange.s)
        yield self.v == (self.velocity if self.use_v else 0)
        if self.use_a:
            yield self.a == der(self.velocity)
        else:
            yield self.a == 0
        yield self.flange.f == -self.f

    def source_power(self) -> Expr:
        return self.f * der(self.flange.s)


class PositionToForceAdaptor(Component):
    """Slide end of a part that receives a motion and returns a force; see `AngleToTorqueAdaptor`."""

    icon = icons.BOUNDARY
    terminal = Terminal(TRANSLATIONAL, takes="potential", rates=(("s", "v"), ("v", "a")), power=("f", "v"))
    flange = LinearFlange("slide end")
    s: Input = signal_in("m", "position of the slide")
    v: Input = signal_in("m/s", "velocity of the slide", default=0.0)
    a: Input = signal_in("m/s2", "acceleration of the slide", default=0.0)
    f: Output = signal_out("N", "force on the other part")

    def equations(self) -> Equations:
        yield self.flange.s == self.s
        yield self.f == self.flange.f

    def source_power(self) -> Expr:
        return -self.flange.f * der(self.flange.s)


class CurrentToVoltageAdaptor(Component):
    """Pin of a circuit that receives a current and returns its potential."""

    icon = icons.BOUNDARY
    terminal = Terminal(ELECTRICAL, takes="flow")
    pin = Pin("open end of the circuit")
    i: Input = signal_in("A", "current into the circuit")
    v: Output = signal_out("V", "potential of the pin")

    def equations(self) -> Equations:
        yield self.v == self.pin.v
        yield self.pin.i == -self.i

    def source_power(self) -> Expr:
        return self.i * self.pin.v


class VoltageToCurrentAdaptor(Component):
    """Pin of a circuit that receives a potential and returns a current."""

    icon = icons.BOUNDARY
    terminal = Terminal(ELECTRICAL, takes="potential", power=("i", "v"))
    pin = Pin("open end of the circuit")
    v: Input = signal_in("V", "potential of the pin")
    i: Output = signal_out("A", "current into the other part")

    def equations(self) -> Equations:
        yield self.pin.v == self.v
        yield self.i == self.pin.i

    def source_power(self) -> Expr:
        return -self.pin.i * self.pin.v


class HeatFlowToTemperatureAdaptor(Component):
    """Heat port of a part that receives a heat flow and returns its temperature."""

    icon = icons.BOUNDARY
    terminal = Terminal(THERMAL, takes="flow")
    port = HeatPort("open heat port")
    Q_flow: Input = signal_in("W", "heat flow into the part")
    T: Output = signal_out("K", "temperature of the port", nominal=300.0)

    def equations(self) -> Equations:
        yield self.T == self.port.T
        yield self.port.Q_flow == -self.Q_flow

    def source_power(self) -> Expr:
        return self.Q_flow


class TemperatureToHeatFlowAdaptor(Component):
    """Heat port of a part that receives a temperature and returns a heat flow."""

    icon = icons.BOUNDARY
    terminal = Terminal(THERMAL, takes="potential")
    port = HeatPort("open heat port")
    T: Input = signal_in("K", "temperature of the port")
    Q_flow: Output = signal_out("W", "heat flow into the other part")

    def equations(self) -> Equations:
        yield self.port.T == self.T
        yield self.Q_flow == self.port.Q_flow

    def source_power(self) -> Expr:
        return -self.port.Q_flow


def _told(names: tuple[str, str, str, str], *, use_w: bool, use_a: bool) -> tuple[str, ...]:
    """Leave out the speed and the acceleration if an adaptor does not output them."""
    position, speed, acceleration, effort = names
    return (position, *([speed] if use_w else []), *([acceleration] if use_a else []), effort)
