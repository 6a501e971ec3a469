"""Vehicles in one dimension, and their resistances."""

from __future__ import annotations

from typing import Literal

from components import icons
from components.interfaces import Flange, LinearFlange, LinearOneFlange, Supported
from components.mechanics.speed_laws import sign_law
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Expr,
    Input,
    Parameter,
    Variable,
    absolute,
    der,
    param,
    signal_in,
    sqrt,
    var,
)


class RollingResistance(Lossy, LinearOneFlange):
    """Resistance of rolling wheels, Cr·weight·cos(slope), against the motion; it does not hold at standstill.

    The inclination is the tangent of the slope. Modelica Standard Library, Translational.RollingResistance.
    """

    icon = icons.LOAD
    weight: Parameter = param("N", "weight on the wheels", min=0)
    Cr: Input = signal_in("1", "rolling resistance coefficient", default=0.015)
    inclination: Input = signal_in("1", "rise of the road over its run", default=0.0)
    v0: Parameter = param("m/s", "velocity above which the sign is ±1", default=0.1, min=1e-12)
    reg: Literal["exp", "sine", "linear", "cosine"] = "exp"
    """Between -v0 and v0: tanh(50·v/v0) (`exp`), a quarter of a sine, a straight line, or one minus a cosine."""
    v: Variable = var("m/s", "velocity of the wheels")
    f: Variable = var("N", "force against forward motion")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s) == self.v
        yield self.f == self.Cr * self.weight / sqrt(1 + self.inclination**2) * sign_law(self.v / self.v0, self.reg)
        yield self.flange.f == self.f

    def dissipation(self) -> Expr:
        return self.f * self.v


class RoadLoad(Lossy, LinearOneFlange):
    """Driving resistance F_0 + F_1·v + F_2·v², as a coast-down gives it; it does not hold at standstill."""

    icon = icons.LOAD
    F_0: Parameter = param("N", "resistance at standstill", min=0)
    F_1: Parameter = param("N.s/m", "part that grows with the velocity", default=0.0, min=0)
    F_2: Parameter = param("N.s2/m2", "part that grows with its square", default=0.0, min=0)
    v0: Parameter = param("m/s", "velocity above which the sign is ±1", default=0.1, min=1e-12)
    reg: Literal["exp", "sine", "linear", "cosine"] = "exp"
    """Between -v0 and v0: tanh(50·v/v0) (`exp`), a quarter of a sine, a straight line, or one minus a cosine."""
    v: Variable = var("m/s", "velocity")
    f: Variable = var("N", "force against forward motion")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s) == self.v
        growing = self.F_1 * self.v + self.F_2 * self.v * absolute(self.v)
        yield self.f == self.F_0 * sign_law(self.v / self.v0, self.reg) + growing
        yield self.flange.f == self.f

    def dissipation(self) -> Expr:
        return self.f * self.v


class Vehicle(Supported):
    """Vehicle with drag, rolling resistance and slope, driven by a wheel, and coupled to others at flange_t.

    Against the motion act the drag Cd·A·rho·u·|u|/2, with the velocity u relative to the wind, the weight on the slope,
    m·g·sin(slope), and the rolling resistance Cr·m·g·cos(slope), which does not hold at standstill. The torque that
    drives it is carried by the housing of the drive. Modelica Standard Library, Translational.Vehicle.
    """

    icon = icons.VEHICLE
    flange_r = Flange("drive shaft", free=True)
    flange_t = LinearFlange("coupling to other vehicles", free=True)
    inlet, outlet = "flange_r", "flange_t"
    m: Parameter = param("kg", "mass", min=0)
    J: Parameter = param("kg.m2", "moment of inertia of wheels and drive", default=0.0, min=0)
    R: Parameter = param("m", "wheel radius", min=1e-12)
    A: Parameter = param("m2", "front area", default=1.0, min=0)
    Cd: Parameter = param("1", "drag coefficient", default=0.5, min=0)
    rho: Parameter = param("kg/m3", "density of the air", default=1.2, min=0)
    g: Parameter = param("m/s2", "gravity", default=9.80665)
    v0: Parameter = param("m/s", "velocity above which the rolling resistance is full", default=1e-3, min=1e-12)
    Cr: Input = signal_in("1", "rolling resistance coefficient", default=0.015)
    inclination: Input = signal_in("1", "rise of the road over its run", default=0.0)
    v_wind: Input = signal_in("m/s", "velocity of the wind, positive from behind", default=0.0)
    reg: Literal["exp", "sine", "linear", "cosine"] = "exp"
    """Between -v0 and v0: tanh(50·v/v0) (`exp`), a quarter of a sine, a straight line, or one minus a cosine."""
    s: Variable = var("m", "position")
    v: Variable = var("m/s", "velocity")
    f_drag: Variable = var("N", "drag of the air against forward motion")
    f_roll: Variable = var("N", "rolling resistance against forward motion")
    f_slope: Variable = var("N", "part of the weight against forward motion")

    def equations(self) -> Equations:
        wind, slant = self.v - self.v_wind, sqrt(1 + self.inclination**2)
        yield self.flange_t.s == self.s
        yield self.R * (self.flange_r.phi - self.phi_support) == self.s
        yield der(self.s) == self.v
        yield self.f_drag == 0.5 * self.Cd * self.A * self.rho * wind * absolute(wind)
        yield self.f_roll == self.Cr * self.m * self.g / slant * sign_law(self.v / self.v0, self.reg)
        yield self.f_slope == self.m * self.g * self.inclination / slant
        drive = self.flange_r.tau - self.J * der(self.spin)
        against = self.f_drag + self.f_roll + self.f_slope
        yield self.m * der(self.v) == drive / self.R + self.flange_t.f - against
        yield from self.support_torque(drive)

    @property
    def spin(self) -> Expr:
        """Speed of the wheels, which a housing that turns carries along."""
        return der(self.flange_r.phi) if self.support.used else self.v / self.R

    def stored_energy(self) -> Expr:
        return 0.5 * (self.m * self.v**2 + self.J * self.spin**2)

    def loss_power(self) -> Expr:
        return self.f_drag * (self.v - self.v_wind) + self.f_roll * self.v

    def source_power(self) -> Expr:
        return -self.f_drag * self.v_wind - self.f_slope * self.v
