"""Gear meshes that are elastic: stiffness that changes with the teeth in contact, errors of the teeth, backlash."""

from __future__ import annotations

from components import icons
from components.interfaces import TwoFlanges
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    Variable,
    cos,
    der,
    maximum,
    param,
    signal_out,
    sin,
    var,
)


class GearMesh(Lossy, TwoFlanges):
    """Elastic mesh of two spur gears on parallel shafts, with backlash; they turn against each other.

    Along the line of action the teeth overlap by x = r_a·phi_a + r_b·phi_b - e·sin(z_a·phi_a + phase), with the base
    radii and an error e of one wave per tooth. Beyond half the backlash they press with c·x, where the stiffness
    c·(1 + ripple·cos(z_a·phi_a)) is that of one and two pairs of teeth in turn. The torques are the slopes of the
    elastic energy, so that waves of stiffness and error take no energy and give none; flanks never pull.
    """

    icon = icons.GEAR_MESH
    z_a: Parameter = param("1", "number of teeth of the gear at flange_a", min=1)
    r_a: Parameter = param("m", "base radius of the gear at flange_a", min=1e-12)
    r_b: Parameter = param("m", "base radius of the gear at flange_b", min=1e-12)
    c: Parameter = param("N/m", "mean stiffness of the mesh", min=1e-12)
    d: Parameter = param("N.s/m", "damping coefficient of the mesh", default=0.0, min=0)
    ripple: Parameter = param("1", "amplitude of the stiffness over its mean", default=0.0, min=0, max=0.99)
    b: Parameter = param("m", "backlash on the line of action", default=0.0, min=0)
    e: Parameter = param("m", "amplitude of the error of the teeth", default=0.0)
    phase: Parameter = param("rad", "phase of the error against the stiffness", default=0.0)
    x: Variable = var("m", "overlap on the line of action", state="avoid")
    v: Variable = var("m/s", "its rate")
    press: Variable = var("m", "how far the flanks are pressed together; negative for the backward flanks")
    f: Output = signal_out("N", "force on the line of action; negative on the backward flanks")
    contact = Mode("gap", "forward", "backward", description="flanks in contact")

    @property
    def stiffness(self) -> Expr:
        """Stiffness of the teeth in contact."""
        return self.c * (1 + self.ripple * cos(self.z_a * self.phi_a))

    @property
    def phi_a(self) -> Expr:
        """Angle of the gear at flange_a."""
        return self.flange_a.phi - self.phi_support

    def equations(self) -> Equations:
        yield from super().equations()
        angle, phi_b = self.z_a * self.phi_a, self.flange_b.phi - self.phi_support
        yield self.x == self.r_a * self.phi_a + self.r_b * phi_b - self.e * sin(angle + self.phase)
        yield self.v == der(self.x)
        half = 0.5 * self.b
        # Flanks that are about to part do not pull: the event is located to rounding only.
        yield self.press == self.contact.choose(
            gap=0, forward=maximum(self.x - half, 0), backward=-maximum(-self.x - half, 0)
        )
        pressed, rate = self.stiffness * self.press, self.d * self.v
        forward, backward = maximum(pressed + rate, 0), -maximum(-pressed - rate, 0)
        yield self.f == self.contact.choose(gap=0, forward=forward, backward=backward)
        ahead = self.r_a - self.e * self.z_a * cos(angle + self.phase)
        wave = 0.5 * self.c * self.ripple * self.z_a * sin(angle) * self.press**2
        yield self.flange_a.tau == self.f * ahead - wave
        yield self.flange_b.tau == self.f * self.r_b

    def events(self) -> Events:
        contact, half = self.contact, 0.5 * self.b
        yield contact.initially("forward", when=self.x > half)
        yield contact.initially("backward", when=self.x < -half)
        yield contact.go("gap", "forward", when=self.x > half)
        yield contact.go("gap", "backward", when=self.x < -half)
        yield contact.go("forward", "gap", when=self.x < half)
        yield contact.go("backward", "gap", when=self.x > -half)

    def stored_energy(self) -> Expr:
        return 0.5 * self.stiffness * self.press**2

    def dissipation(self) -> Expr:
        return (self.f - self.stiffness * self.press) * self.v
