"""Power electronics between a DC supply and a motor."""

from __future__ import annotations

from components import icons
from components.electrical.analog import Pin
from components.thermal import Lossy
from modelica_like.language import (
    Discrete,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Parameter,
    Variable,
    absolute,
    discrete,
    maximum,
    minimum,
    param,
    sign,
    signal_in,
    var,
)


class HBridge(Lossy):
    """H-bridge that chops the voltage of a supply: its mean over a period is u times the supply voltage.

    The value of u at the beginning of a period sets the on-time in this period; switching is a time event. A bipolar
    bridge is on with the supply voltage and off with the reversed one. A unipolar one is off without voltage, and u
    gives the direction: it is a chopper. Without switching the voltage is the mean voltage. The switches have a
    resistance and no other loss. Both terminals of the motor are symmetrical to those of the supply.
    """

    icon = icons.BRIDGE
    p = Pin("positive terminal of the supply")
    n = Pin("negative terminal of the supply")
    p_out = Pin("positive terminal of the motor")
    n_out = Pin("negative terminal of the motor")
    inlet, outlet = "p", "p_out"
    switching: bool = True
    """Chop the voltage; otherwise its mean."""
    unipolar: bool = False
    """No voltage instead of the reversed one while the bridge is off."""
    f: Parameter = param("Hz", "switching frequency", default=2000.0, min=1e-9)
    R: Parameter = param("Ohm", "resistance of the switches that carry the current", default=0.0, min=0)
    u: Input = signal_in("1", "mean voltage of the motor over that of the supply, -1 to 1")
    v: Variable = var("V", "voltage of the motor")
    i: Variable = var("A", "current of the motor")
    following: Discrete = discrete("s", "beginning of the next period")
    off_at: Discrete = discrete("s", "end of the time in which the bridge is on")
    direction: Discrete = discrete("1", "voltage over that of the supply while the bridge is on", start=1.0)
    switches = Mode("off", "on", description="state of the bridge")

    @property
    def mean(self) -> Expr:
        """Mean voltage of the motor over that of the supply."""
        return maximum(minimum(self.u, 1), -1)

    def level(self) -> Expr:
        """Return the voltage at the switches over that of the supply."""
        if not self.switching:
            return self.mean
        return self.switches.choose(on=self.direction, off=0 if self.unipolar else -self.direction)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v == self.p_out.v - self.n_out.v
        yield self.p_out.v + self.n_out.v == self.p.v + self.n.v
        yield self.i == (self.n_out.i - self.p_out.i) / 2
        yield self.v == self.level() * (self.p.v - self.n.v) - self.R * self.i
        leakage = (self.p_out.i + self.n_out.i) / 2
        yield self.p.i == self.level() * self.i - leakage
        yield self.n.i == -self.level() * self.i - leakage

    def events(self) -> Events:
        if not self.switching:
            return
        period = 1 / self.f
        share = absolute(self.mean) if self.unipolar else (1 + self.mean) / 2
        begin = {self.off_at: self.following + share * period, self.following: self.following + period}
        if self.unipolar:
            begin[self.direction] = sign(self.u)
        yield self.switches.go("off", "on", at=self.following, reset=begin)
        yield self.switches.go("on", "off", at=self.off_at)

    def dissipation(self) -> Expr:
        return self.R * self.i**2
