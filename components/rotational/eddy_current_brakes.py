"""Brakes by eddy currents, on shafts and on slides."""

from __future__ import annotations

from components import icons
from components.interfaces import LinearOneFlange, OneFlange
from components.thermal import Conducting
from modelica_like.language import Equations, Expr, Input, Parameter, Variable, der, param, signal_in, var


class EddyCurrentDisc(Conducting, partial=True):
    """Conductor in which eddy currents brake: 2·peak·excitation²·x/(1 + x²), x = speed / speed of the peak (M. Kloss).

    The braking grows with the square of the excitation current. The conductor gets hot, its resistance rises, and with
    it the speed of the peak. Without a heat port it keeps the temperature T. Modelica Standard Library,
    Rotational.EddyCurrentTorque.
    """

    icon = icons.EDDY
    renamed = {"alpha": "alpha20, with the same value"}
    excitation: Input = signal_in("1", "excitation current over its nominal value", default=1.0)

    def braking(self, relative_speed: Expr) -> Expr:
        """Return the braking over its peak, at a speed over that of the peak at T_ref."""
        x = relative_speed / self.warmth(self.temperature)
        return 2 * self.excitation**2 * x / (1 + x**2)


class EddyCurrentTorque(EddyCurrentDisc, OneFlange):
    """Eddy current brake on a shaft."""

    tau_nominal: Parameter = param("N.m", "largest braking torque at full excitation", min=0)
    w_nominal: Parameter = param("rad/s", "speed of the largest torque at T_ref", min=1e-12)
    w: Variable = var("rad/s", "speed of the shaft relative to the housing")
    tau: Variable = var("N.m", "braking torque against forward rotation")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi) == self.w
        yield self.tau == self.tau_nominal * self.braking(self.w / self.w_nominal)
        yield self.flange.tau == self.tau

    def dissipation(self) -> Expr:
        return self.tau * self.w


class EddyCurrentForce(EddyCurrentDisc, LinearOneFlange):
    """Eddy current brake on a slide, e.g. a rail of copper between magnets."""

    f_nominal: Parameter = param("N", "largest braking force at full excitation", min=0)
    v_nominal: Parameter = param("m/s", "velocity of the largest force at T_ref", min=1e-12)
    v: Variable = var("m/s", "velocity of the slide relative to the housing")
    f: Variable = var("N", "braking force against forward motion")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s) == self.v
        yield self.f == self.f_nominal * self.braking(self.v / self.v_nominal)
        yield self.flange.f == self.f

    def dissipation(self) -> Expr:
        return self.f * self.v
