"""Tyres with slip, and the loads of axles."""

from __future__ import annotations

from typing import Literal

from components import icons
from components.interfaces import Flange, LinearFlange
from components.thermal import Lossy
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    absolute,
    atan2,
    der,
    maximum,
    minimum,
    param,
    signal_in,
    signal_out,
    sin,
    sqrt,
    var,
)


class Tyre(Lossy):
    """Tyre between hub and vehicle, whose force follows from its slip (R·w - v)/|v|.

    `pacejka`: F = mu·F_z·sin(C·atan(x - E·(x - atan(x)))), x = B·slip, the magic formula of E. Bakker, L. Nyborg and
    H. B. Pacejka (SAE 870421). `linear`: F = mu·F_z·slip/slip_max, and no more than mu·F_z. Below v_min the slip
    is computed with v_min. With a relaxation length sigma the slip is delayed, sigma·der(slip) = R·w - v -
    |v|·slip: the tyre is a spring at standstill. Its stored energy is zero at the start.
    """

    icon = icons.TYRE
    flange_r = Flange("hub")
    flange_t = LinearFlange("vehicle")
    inlet, outlet = "flange_r", "flange_t"
    law: Literal["pacejka", "linear"] = "pacejka"
    """Magic formula, or a straight line up to the limit."""
    F_z: Input = signal_in("N", "normal load")
    R: Parameter = param("m", "rolling radius", min=1e-12)
    mu: Parameter = param("1", "largest friction coefficient", default=1.0, min=0)
    B: Parameter = param("1", "stiffness factor", default=10.0, min=1e-12)
    C: Parameter = param("1", "shape factor", default=1.65, min=1e-12, max=2)
    E: Parameter = param("1", "curvature factor", default=0.97, max=1)
    slip_max: Parameter = param("1", "slip at the limit of the straight line", default=0.1, min=1e-12)
    v_min: Parameter = param("m/s", "velocity below which the slip is a smaller one", default=0.1, min=1e-12)
    sigma: Parameter = param("m", "relaxation length; without a value there is no delay", default=None, min=1e-12)
    w: Variable = var("rad/s", "speed of the wheel")
    v: Variable = var("m/s", "velocity of the vehicle")
    slip: Variable = var("1", "slip, positive while the tyre drives", default=0.0)
    f: Variable = var("N", "force that drives the vehicle")
    E_tyre: Variable = var("J", "energy that the tyre stores", default=0.0)

    @property
    def reference(self) -> Expr:
        """Reference velocity of the slip."""
        return maximum(absolute(self.v), self.v_min)

    def friction(self) -> Expr:
        """Return the force over the normal load."""
        if self.law == "linear":
            return self.mu * minimum(maximum(self.slip / self.slip_max, -1), 1)
        x = self.B * self.slip
        return self.mu * sin(self.C * atan2(x - self.E * (x - atan2(x, 1)), 1))

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.w == der(self.flange_r.phi)
        yield self.v == der(self.flange_t.s)
        sliding = self.R * self.w - self.v
        if self.given("sigma"):
            yield self.sigma * der(self.slip) == sliding - self.reference * self.slip
            yield der(self.E_tyre) == self.f * (sliding - self.reference * self.slip)
        else:
            yield self.reference * self.slip == sliding
            yield self.E_tyre == 0
        yield self.f == self.F_z * self.friction()
        yield self.flange_r.tau == self.R * self.f
        yield self.flange_t.f == -self.f

    def stored_energy(self) -> Expr:
        return self.E_tyre

    def dissipation(self) -> Expr:
        return self.f * self.reference * self.slip


class AxleLoads(Component):
    """Normal loads of both axles of a vehicle, shifted to the rear by acceleration and slope.

    The vehicle does not pitch: the loads follow from the balance of moments, with the time constant T if given. An axle
    that lifts off carries nothing, and the other one everything.
    """

    icon = icons.AXLES
    flange = LinearFlange("vehicle")
    m: Parameter = param("kg", "mass", min=0)
    g: Parameter = param("m/s2", "gravity", default=9.80665)
    wheelbase: Parameter = param("m", "distance of the axles", min=1e-12)
    l_front: Parameter = param("m", "from the front axle to the centre of gravity", min=0)
    h: Parameter = param("m", "height of the centre of gravity", min=0)
    T: Parameter = param("s", "time constant of the loads; without a value there is none", default=None, min=1e-12)
    inclination: Input = signal_in("1", "rise of the road over its run", default=0.0)
    v: Variable = var("m/s", "velocity")
    F_rear: Output = signal_out("N", "load of the rear axle")
    F_front: Output = signal_out("N", "load of the front axle")
    axles = Mode("loaded", "lifted", description="whether both axles were always on the road")

    @property
    def weight(self) -> Expr:
        """Load of both axles."""
        return self.m * self.g / sqrt(1 + self.inclination**2)

    def shifted(self) -> Expr:
        """Return the balance of moments about the front axle."""
        backwards = self.m * der(self.v) + self.weight * self.inclination
        return (self.weight * self.l_front + backwards * self.h) / self.wheelbase

    def equations(self) -> Equations:
        yield self.flange.f == 0
        yield self.v == der(self.flange.s)
        wanted = minimum(maximum(self.shifted(), 0), self.weight)
        if self.given("T"):
            yield self.T * der(self.F_rear) == wanted - self.F_rear
        else:
            yield self.F_rear == wanted
        yield self.F_front == self.weight - self.F_rear

    def events(self) -> Events:
        yield self.axles.go("loaded", "lifted", when=self.shifted() > self.weight, notice="lifts its front axle")
        yield self.axles.go("loaded", "lifted", when=self.shifted() < 0, notice="lifts its rear axle")
