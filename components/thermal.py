"""Heat: ports through which losses leave, thermal masses, conduction, fixed temperatures."""

from __future__ import annotations

from components import icons
from modelica_like.language import (
    Component,
    Connector,
    Domain,
    Equations,
    Expr,
    Input,
    Output,
    Parameter,
    Variable,
    der,
    flow,
    param,
    signal_in,
    signal_out,
    var,
)

_ROOM = 293.15


class HeatPort(Connector):
    """Heat port: temperature, and the heat flow into the component."""

    domain = Domain("heat flow", "temperature", "a thermal conductor")
    stroke = icons.HEAT
    T: Variable = var("K", "temperature", guess=_ROOM, nominal=300.0)
    Q_flow: Variable = flow("W", "heat flow, positive into the component")

    def power(self) -> Expr:
        return self.Q_flow


class Lossy(Component, partial=True):
    """Element that turns work into heat.

    If its heat port is connected, the loss flows out there into the thermal part of the model; otherwise it leaves the
    model. A subclass defines the loss.
    """

    heat_port = HeatPort("where the loss goes as heat", optional=True)

    def dissipation(self) -> Expr:
        """Return the power in W that becomes heat."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield from super().equations()
        if self.heat_port.used:
            yield self.heat_port.Q_flow == -self.heat()

    def heat(self) -> Expr:
        """Return the heat flow in W that leaves at the heat port."""
        return self.dissipation()

    def loss_power(self) -> Expr | float:
        return 0.0 if self.heat_port.used else self.dissipation()


class Conducting(Lossy, partial=True):
    """Element with conductors whose resistance rises with temperature: by alpha20 of its value at 20 °C per kelvin.

    Copper: 3.92e-3/K.
    """

    alpha20: Parameter = param("1/K", "temperature coefficient of the conductors' resistance at 20 °C", default=0.0)
    T_20: Parameter = param("K", "temperature to which alpha20 belongs", default=_ROOM)
    T_ref: Parameter = param("K", "temperature to which the other values belong", default=_ROOM)
    T: Parameter = param("K", "temperature of the conductors without a heat port", default=_ROOM)

    @property
    def temperature(self) -> Expr:
        """Temperature of the conductors."""
        return self.heat_port.T if self.heat_port.used else self.T

    def warmth(self, temperature: Expr) -> Expr:
        """Return the resistance at a temperature over that at T_ref."""
        at_ref = self.alpha20 / (1 + self.alpha20 * (self.T_ref - self.T_20))
        return 1 + at_ref * (temperature - self.T_ref)


class ThermalMass(Component):
    """Body of one temperature that stores heat, e.g. the lining of a clutch: C·der(T) is the heat flow into it.

    Its stored energy is zero at 20 °C.
    """

    icon = icons.THERMAL_MASS
    port = HeatPort("surface")
    C: Parameter = param("J/K", "heat capacity", min=0)
    T: Variable = var("K", "temperature", nominal=300.0, guess=_ROOM)
    T_zero: Parameter = param("K", "temperature of no stored energy", default=_ROOM)

    def equations(self) -> Equations:
        yield self.port.T == self.T
        yield self.C * der(self.T) == self.port.Q_flow

    def stored_energy(self) -> Expr:
        return self.C * (self.T - self.T_zero)


class FixedTemperature(Component):
    """Surroundings that keep their temperature, whatever heat they take."""

    icon = icons.TEMPERATURE
    port = HeatPort("surface")
    T: Parameter = param("K", "temperature", default=_ROOM, min=0)

    def equations(self) -> Equations:
        yield self.port.T == self.T

    def source_power(self) -> Expr:
        return -self.port.Q_flow


class HeatSource(Component):
    """Prescribed heat flow into the connected body."""

    icon = icons.HEAT_SOURCE
    port = HeatPort("surface")
    Q_flow: Parameter = param("W", "heat flow into the connected body")

    def equations(self) -> Equations:
        yield self.port.Q_flow == -self.Q_flow

    def source_power(self) -> Expr:
        return self.Q_flow


class PrescribedHeatFlow(Component):
    """Heat flow into the connected body, given by a signal."""

    icon = icons.HEAT_SOURCE
    port = HeatPort("surface")
    Q_flow: Input = signal_in("W", "heat flow into the connected body")

    def equations(self) -> Equations:
        yield self.port.Q_flow == -self.Q_flow

    def source_power(self) -> Expr:
        return self.Q_flow


class PrescribedTemperature(Component):
    """Surroundings whose temperature is a signal, whatever heat they take."""

    icon = icons.TEMPERATURE
    port = HeatPort("surface")
    T: Input = signal_in("K", "temperature")

    def equations(self) -> Equations:
        yield self.port.T == self.T

    def source_power(self) -> Expr:
        return -self.port.Q_flow


class ThermalConductor(Component):
    """Heat conduction or convection without storage: the heat flow is proportional to the difference in temperature."""

    icon = icons.CONDUCTOR
    port_a = HeatPort("one side")
    port_b = HeatPort("other side")
    inlet, outlet = "port_a", "port_b"
    G: Parameter = param("W/K", "thermal conductance; for convection the coefficient times the area", min=0)

    def equations(self) -> Equations:
        a, b = self.port_a, self.port_b
        yield a.Q_flow == self.G * (a.T - b.T)
        yield a.Q_flow + b.Q_flow == 0


class TemperatureSensor(Component):
    """Temperature of a body, e.g. for a control that protects a motor's winding."""

    icon = icons.SENSOR
    port = HeatPort("measured surface")
    T: Output = signal_out("K", "temperature")

    def equations(self) -> Equations:
        yield self.port.Q_flow == 0
        yield self.T == self.port.T
