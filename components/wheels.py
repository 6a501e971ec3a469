"""From rotation to translation by rolling, and brakes by eddy currents."""

from __future__ import annotations

from components.interfaces import Flange, LinearFlange, OneFlange
from components.thermal import Lossy
from modelica_like.language import Component, Equations, Expr, Input, Parameter, Variable, der, param, signal_in, var


class IdealRollingWheel(Component):
    """Wheel that rolls without slip, also rack and pinion or pulley and rope: s = radius·phi."""

    flange_r = Flange("axle")
    flange_t = LinearFlange("what moves along")
    inlet, outlet = "flange_r", "flange_t"
    radius: Parameter = param("m", "rolling radius")

    def equations(self) -> Equations:
        yield self.flange_t.s == self.radius * self.flange_r.phi
        yield self.flange_r.tau == -self.radius * self.flange_t.f


class EddyCurrentTorque(Lossy, OneFlange):
    """Eddy current brake: braking torque 2·tau_nominal·excitation²·x/(1 + x²) with x = w/w_nominal (M. Kloss).

    The torque is largest at w_nominal, and grows with the square of the excitation current; the disc gets hot, its
    resistance rises, and w_nominal with it. Without a heat port the disc keeps the temperature T. Modelica Standard
    Library, Rotational.EddyCurrentTorque.
    """

    tau_nominal: Parameter = param("N.m", "largest braking torque at full excitation", min=0)
    excitation: Input = signal_in("1", "excitation current over its nominal value", default=1.0)
    w_nominal: Parameter = param("rad/s", "speed of the largest torque at T_ref", min=1e-12)
    T_ref: Parameter = param("K", "reference temperature", default=293.15)
    T: Parameter = param("K", "temperature of the disc without a heat port", default=293.15)
    alpha: Parameter = param("1/K", "temperature coefficient of the disc's resistance at 20 °C", default=0.0)
    T_20: Parameter = param("K", "temperature to which alpha belongs", default=293.15)
    w: Variable = var("rad/s", "speed of the shaft relative to the housing")
    tau: Variable = var("N.m", "braking torque against forward rotation")

    def equations(self) -> Equations:
        yield from super().equations()
        temperature = self.heat_port.T if self.heat_port.used else self.T
        at_ref = self.alpha / (1 + self.alpha * (self.T_ref - self.T_20))
        x = self.w / (self.w_nominal * (1 + at_ref * (temperature - self.T_ref)))
        yield der(self.phi) == self.w
        yield self.tau == 2 * self.tau_nominal * self.excitation**2 * x / (1 + x**2)
        yield self.flange.tau == self.tau

    def dissipation(self) -> Expr:
        return self.tau * self.w
