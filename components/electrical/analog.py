"""Electrical circuits of drives: sources, resistors, inductors, capacitors, switches, sensors."""

from __future__ import annotations

from components import icons
from components.thermal import Lossy
from modelica_like.language import (
    Component,
    Connector,
    Domain,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    all_of,
    der,
    flow,
    param,
    signal_in,
    signal_out,
    var,
)


class Pin(Connector):
    """Electrical terminal: potential, and the current into the component."""

    domain = Domain("current", "voltage", "a resistor", reference="Ground")
    stroke = icons.CIRCUIT
    v: Variable = var("V", "potential")
    i: Variable = flow("A", "current, positive into the component")

    def power(self) -> Expr:
        return self.v * self.i


class Ground(Component):
    """Potential zero; every circuit needs one."""

    icon = icons.GROUND
    p = Pin("grounded terminal")

    def equations(self) -> Equations:
        yield self.p.v == 0


class TwoPins(Component, partial=True):
    """Element with two terminals; the current flows from p to n through it."""

    p = Pin("positive terminal")
    n = Pin("negative terminal")
    inlet, outlet = "p", "n"
    v: Variable = var("V", "voltage, p.v - n.v")
    i: Variable = var("A", "current from p to n")

    def equations(self) -> Equations:
        yield self.v == self.p.v - self.n.v
        yield self.p.i == self.i
        yield self.n.i == -self.i


class Resistor(Lossy, TwoPins):
    """Ohmic resistance, which may rise with the temperature of its heat port."""

    icon = icons.RESISTOR
    R: Parameter = param("Ohm", "resistance at T_ref", min=0)
    alpha: Parameter = param("1/K", "temperature coefficient", default=0.0)
    T_ref: Parameter = param("K", "temperature to which R belongs", default=293.15)
    T: Parameter = param("K", "temperature without a heat port", default=293.15)

    def equations(self) -> Equations:
        yield from super().equations()
        temperature = self.heat_port.T if self.heat_port.used else self.T
        yield self.v == self.R * (1 + self.alpha * (temperature - self.T_ref)) * self.i

    def dissipation(self) -> Expr:
        return self.v * self.i


class VariableResistor(Lossy, TwoPins):
    """Resistance given by a signal, e.g. a starting resistor."""

    icon = icons.VARIABLE_RESISTOR
    R: Input = signal_in("Ohm", "resistance")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v == self.R * self.i

    def dissipation(self) -> Expr:
        return self.v * self.i


class Inductor(TwoPins):
    """Ideal inductance: v = L·der(i)."""

    icon = icons.INDUCTOR
    L: Parameter = param("H", "inductance", min=0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.L * der(self.i) == self.v

    def stored_energy(self) -> Expr:
        return 0.5 * self.L * self.i**2


class Capacitor(TwoPins):
    """Ideal capacitance: i = C·der(v)."""

    icon = icons.CAPACITOR
    C: Parameter = param("F", "capacitance", min=0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.C * der(self.v) == self.i

    def stored_energy(self) -> Expr:
        return 0.5 * self.C * self.v**2


class ElectricalSource(TwoPins, partial=True):
    """Supply from outside the model."""

    def source_power(self) -> Expr:
        return -self.v * self.i


class ConstantVoltage(ElectricalSource):
    """Constant voltage between p and n."""

    icon = icons.BATTERY
    V: Parameter = param("V", "voltage")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v == self.V


class SignalVoltage(ElectricalSource):
    """Voltage between p and n given by a signal."""

    icon = icons.VOLTAGE
    v_ref: Input = signal_in("V", "voltage")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v == self.v_ref


class ConstantCurrent(ElectricalSource):
    """Constant current from p to n."""

    icon = icons.CURRENT
    I: Parameter = param("A", "current")  # noqa: E741

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.i == self.I


class SignalCurrent(ElectricalSource):
    """Current from p to n given by a signal."""

    icon = icons.CURRENT
    i_ref: Input = signal_in("A", "current")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.i == self.i_ref


class CurrentSink(ElectricalSource):
    """Electronic load: draws at p, and returns at n, the current of a signal, but drives none itself.

    It has a smallest resistance: if the voltage does not suffice for the current, e.g. because a generator comes to
    rest, the load is this resistance; at a reversed voltage it draws nothing. In series with an inductance, whose
    current cannot jump, it needs a capacitor in parallel, like real loads.
    """

    icon = icons.CURRENT
    i_ref: Input = signal_in("A", "current drawn at p")
    R_min: Parameter = param("Ohm", "smallest resistance", default=1e-3, min=1e-12)
    load = Mode("sinking", "empty", "reversed", description="whether the voltage suffices for the current")

    def equations(self) -> Equations:
        yield from super().equations()
        sinking, empty = self.i - self.i_ref, self.v - self.R_min * self.i
        yield self.load.choose(sinking=sinking, empty=empty, reversed=self.i) == 0

    def events(self) -> Events:
        # Without a current to draw, no voltage is too low.
        load, drawn = self.load, self.i_ref > 0
        fails = all_of(drawn, self.v < self.R_min * self.i_ref)
        yield load.initially("reversed", when=all_of(drawn, self.v < 0))
        yield load.initially("empty", when=fails)
        yield load.go("sinking", "empty", when=fails)
        yield load.go("empty", "sinking", when=self.i > self.i_ref)
        yield load.go("empty", "reversed", when=self.v < 0)
        yield load.go("reversed", "empty", when=self.v > 0)


class Switch(Lossy, TwoPins):
    """Switch, closed while its signal is above one half; a small resistance closed, a small conductance open."""

    icon = icons.SWITCH
    closed: Input = signal_in("1", "the switch is closed above 0.5")
    R_closed: Parameter = param("Ohm", "resistance of the closed switch", default=1e-5, min=0)
    G_open: Parameter = param("S", "conductance of the open switch", default=1e-5, min=0)
    contacts = Mode("open", "closed", description="state of the switch")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.contacts.choose(open=self.i - self.G_open * self.v, closed=self.v - self.R_closed * self.i) == 0

    def events(self) -> Events:
        yield self.contacts.initially("closed", when=self.closed > 0.5)
        yield self.contacts.go("open", "closed", when=self.closed > 0.5)
        yield self.contacts.go("closed", "open", when=self.closed < 0.5)

    def dissipation(self) -> Expr:
        return self.v * self.i


class VoltageSensor(Component):
    """Voltage between two terminals."""

    icon = icons.VOLTMETER
    p = Pin("positive terminal")
    n = Pin("negative terminal")
    v: Output = signal_out("V", "voltage, p.v - n.v")

    def equations(self) -> Equations:
        yield self.p.i == 0
        yield self.n.i == 0
        yield self.v == self.p.v - self.n.v


class CurrentSensor(Component):
    """Current through a wire, from p to n."""

    icon = icons.AMMETER
    p = Pin("positive terminal")
    n = Pin("negative terminal")
    inlet, outlet = "p", "n"
    i: Output = signal_out("A", "current")

    def equations(self) -> Equations:
        yield self.p.v == self.n.v
        yield self.p.i + self.n.i == 0
        yield self.i == self.p.i


class ElectricalPowerSensor(Component):
    """Power: the current from pc to nc times the voltage between pv and nv, as a wattmeter measures it."""

    icon = icons.WATTMETER
    pc = Pin("current in")
    nc = Pin("current out")
    pv = Pin("positive terminal of the voltage")
    nv = Pin("negative terminal of the voltage")
    inlet, outlet = "pc", "nc"
    power: Output = signal_out("W", "power")

    def equations(self) -> Equations:
        yield self.pc.v == self.nc.v
        yield self.pc.i + self.nc.i == 0
        yield self.pv.i == 0
        yield self.nv.i == 0
        yield self.power == self.pc.i * (self.pv.v - self.nv.v)
