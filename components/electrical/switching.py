"""Switching of drives: contactors, diodes."""

from __future__ import annotations

from components import icons
from components.electrical.analog import Pin, TwoPins
from components.feasible import Feasible
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Parameter,
    Variable,
    all_of,
    der,
    param,
    signal_in,
    var,
)


class Diode(Lossy, TwoPins):
    """Diode: it conducts from p to n above the forward voltage, and a small conductance is left when it blocks.

    The current has no jump at the forward voltage: G·V_f flows there in both states (Modelica Standard Library,
    Electrical.Analog.Ideal.IdealDiode).
    """

    icon = icons.DIODE
    V_f: Parameter = param("V", "forward voltage without current", default=0.0, min=0)
    R: Parameter = param("Ohm", "resistance while it conducts", default=1e-5, min=0)
    G: Parameter = param("S", "conductance while it blocks", default=1e-5, min=0)
    state = Mode("blocking", "conducting", description="state of the diode")

    def equations(self) -> Equations:
        yield from super().equations()
        conducting = self.v - self.V_f - self.R * (self.i - self.G * self.V_f)
        yield self.state.choose(blocking=self.i - self.G * self.v, conducting=conducting) == 0

    def events(self) -> Events:
        yield self.state.initially("conducting", when=self.v > self.V_f)
        yield self.state.go("blocking", "conducting", when=self.v > self.V_f)
        yield self.state.go("conducting", "blocking", when=self.i < self.G * self.V_f)

    def dissipation(self) -> Expr:
        return self.v * self.i


class Ideal(TwoPins, partial=True):
    """Element without resistance and leakage: nothing flows while it blocks, and conducting it takes no voltage.

    Of several ideal elements the combination of modes is found that is possible with the present currents of inductors
    and voltages of capacitors, which cannot jump.
    """

    v_0: Parameter = param("V", "voltage that counts as rounding", default=1e-9, min=0)
    i_0: Parameter = param("A", "current that counts as rounding", default=1e-9, min=0)
    state = Mode("off", "on", description="state of the element", ideal={"off": "i", "on": "v"})

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.state.choose(off=self.i, on=self.v) == 0


class IdealDiode(Ideal):
    """Ideal diode: no voltage while it conducts from p to n, and no current while it blocks."""

    icon = icons.DIODE

    def events(self) -> Events:
        yield self.state.go("off", "on", when=self.v > self.v_0, because="the voltage turns forward")
        yield self.state.go("on", "off", when=self.i < -self.i_0, because="the current would reverse")


class IdealThyristor(Ideal):
    """Ideal thyristor: fired at forward voltage, it conducts from p to n until its current reaches zero."""

    icon = icons.THYRISTOR
    fire: Input = signal_in("1", "the thyristor is fired above 0.5")

    def events(self) -> Events:
        forward = all_of(self.fire > 0.5, self.v > self.v_0)
        yield self.state.go("off", "on", when=forward, because="it is fired at forward voltage")
        yield self.state.go("on", "off", when=self.i < -self.i_0, because="the current would reverse")


class IdealSwitch(Ideal):
    """Ideal switch, closed while its signal is above one half."""

    icon = icons.SWITCH
    closed: Input = signal_in("1", "the switch is closed above 0.5")

    def events(self) -> Events:
        yield self.state.initially("on", when=self.closed > 0.5)
        yield self.state.go("off", "on", when=self.closed > 0.5)
        yield self.state.go("on", "off", when=self.closed < 0.5)


class Contactor(Feasible, Lossy, TwoPins):
    """Contactor: its main contact closes when the current of its coil has risen to i_on, and opens below i_off."""

    icon = icons.CONTACTOR
    cp = Pin("positive terminal of the coil")
    cn = Pin("negative terminal of the coil")
    R_coil: Parameter = param("Ohm", "resistance of the coil", min=1e-12)
    L_coil: Parameter = param("H", "inductance of the coil", min=1e-12)
    i_on: Parameter = param("A", "current at which the contact closes", min=0)
    i_off: Parameter = param("A", "current at which the contact opens; below i_on", min=0)
    R_closed: Parameter = param("Ohm", "resistance of the closed contact", default=1e-5, min=0)
    G_open: Parameter = param("S", "conductance of the open contact", default=1e-5, min=0)
    i_coil: Variable = var("A", "current of the coil", default=0)
    misfit = "cannot hold: its i_off is not below its i_on"
    contacts = Mode("open", "closed", description="state of the main contact")

    def fits(self) -> Expr:
        return self.i_off < self.i_on

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.cp.i == self.i_coil
        yield self.cn.i == -self.i_coil
        yield self.L_coil * der(self.i_coil) == self.cp.v - self.cn.v - self.R_coil * self.i_coil
        yield self.contacts.choose(open=self.i - self.G_open * self.v, closed=self.v - self.R_closed * self.i) == 0

    def events(self) -> Events:
        yield from super().events()
        contacts, i = self.contacts, self.i_coil
        yield contacts.initially("closed", when=i > self.i_on)
        yield contacts.go("open", "closed", when=i > self.i_on, because="the coil pulls in")
        yield contacts.go("closed", "open", when=i < self.i_off, because="the coil drops out")

    def stored_energy(self) -> Expr:
        return 0.5 * self.L_coil * self.i_coil**2

    def dissipation(self) -> Expr:
        return self.v * self.i + self.R_coil * self.i_coil**2
