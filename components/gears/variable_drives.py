"""Drives with a ratio that changes: continuously variable transmissions, chains on sprockets."""

from __future__ import annotations

from math import pi

from components import icons
from components.feasible import Feasible
from components.interfaces import TwoFlanges
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Expr,
    Input,
    Output,
    Parameter,
    Variable,
    absolute,
    cos,
    der,
    floor,
    maximum,
    minimum,
    param,
    signal_in,
    signal_out,
    sin,
    tanh,
    var,
    where,
)


class VariableGear(Feasible, Lossy, TwoFlanges):
    """Continuously variable transmission (CVT): its ratio follows a signal with a lag; it loses a share of the torque.

    Without loss ratio·tau_a + tau_b = 0; of what enters on the driving side efficiency arrives. It does not slip: for
    a chain or belt that does, put a `Clutch` of the torque that the clamping transmits in series.
    """

    icon = icons.VARIABLE_GEAR
    misfit = "has its smallest ratio ratio_min above its largest ratio ratio_max"
    u: Input = signal_in("1", "wanted ratio, speed of flange_a over speed of flange_b")
    T: Parameter = param("s", "time constant of the adjustment", min=1e-6)
    efficiency: Parameter = param("1", "power out over power in", default=1.0, min=1e-3, max=1)
    ratio_min: Parameter = param("1", "smallest ratio that it is set to", default=1e-3, min=1e-6)
    ratio_max: Parameter = param("1", "largest ratio that it is set to", default=1e3, min=1e-6)
    w_smooth: Parameter = param("rad/s", "speed at which 76 % of the loss are reached", default=0.1, min=1e-12)
    ratio: Variable = var(
        "1",
        "speed of flange_a over speed of flange_b",
        state="always",
        default="min(max(u, ratio_min), ratio_max)",
        guess=1.0,
    )
    w_a: Variable = var("rad/s", "speed of flange_a relative to the housing")
    w_b: Variable = var("rad/s", "speed of flange_b relative to the housing")
    tau_loss: Variable = var("N.m", "lost torque at flange_a")

    def fits(self) -> Expr:
        return self.ratio_min <= self.ratio_max

    def equations(self) -> Equations:
        yield from super().equations()
        a, b = self.flange_a, self.flange_b
        yield self.w_a == der(a.phi - self.phi_support)
        yield self.w_b == der(b.phi - self.phi_support)
        yield self.T * der(self.ratio) == minimum(maximum(self.u, self.ratio_min), self.ratio_max) - self.ratio
        yield self.w_a == self.ratio * self.w_b
        yield self.ratio * (a.tau - self.tau_loss) + b.tau == 0
        passed, forward = -b.tau / self.ratio, tanh(self.w_a / self.w_smooth)
        share = where(passed * forward > 0, 1 / self.efficiency - 1, 1 - self.efficiency)
        yield self.tau_loss == forward * share * absolute(passed)

    def dissipation(self) -> Expr:
        return self.tau_loss * self.w_a


class ChainDrive(Lossy, TwoFlanges):
    """Roller chain on two sprockets that turn the same way, with the polygon effect: strands that pull and never push.

    A sprocket of z teeth is a polygon: while it turns by one tooth, the chain moves by one pitch, with the speed
    r·w·cos(angle to the middle of the tooth), where r = pitch/(2·sin(pi/z)) (G. Niemann, H. Winter: Maschinenelemente
    III). Strands are elastic, without pre-tension; where a strand would have to push it sags.
    """

    icon = icons.CHAIN
    z_a: Parameter = param("1", "number of teeth of the sprocket at flange_a", min=3)
    z_b: Parameter = param("1", "number of teeth of the sprocket at flange_b", min=3)
    pitch: Parameter = param("m", "pitch of the chain", min=1e-12)
    c: Parameter = param("N/m", "stiffness of a strand", min=1e-12)
    d: Parameter = param("N.s/m", "damping coefficient of a strand", default=0.0, min=0)
    f: Output = signal_out("N", "force of the pulling strand; negative for the other one")
    x: Variable = var("m", "stretch of the strand that pulls while flange_a drives forward")
    v: Variable = var("m/s", "its rate")

    def polygon(self, phi: Expr, z: Expr) -> tuple[Expr, Expr]:
        """Return the way of the chain at an angle of a sprocket, and its derivative."""
        tooth = floor(phi * z / (2 * pi) + 0.5)
        aside, r = phi - 2 * pi / z * tooth, self.pitch / (2 * sin(pi / z))
        return self.pitch * tooth + r * sin(aside), r * cos(aside)

    def equations(self) -> Equations:
        yield from super().equations()
        way_a, arm_a = self.polygon(self.flange_a.phi - self.phi_support, self.z_a)
        way_b, arm_b = self.polygon(self.flange_b.phi - self.phi_support, self.z_b)
        w_a, w_b = der(self.flange_a.phi - self.phi_support), der(self.flange_b.phi - self.phi_support)
        yield self.x == way_a - way_b
        yield self.v == arm_a * w_a - arm_b * w_b
        pull = self.c * self.x + self.d * self.v
        yield self.f == where(self.x > 0, maximum(pull, 0), -maximum(-pull, 0), events=False)
        yield self.flange_a.tau == arm_a * self.f
        yield self.flange_b.tau == -arm_b * self.f

    def stored_energy(self) -> Expr:
        return 0.5 * self.c * self.x**2

    def dissipation(self) -> Expr:
        return (self.f - self.c * self.x) * self.v
