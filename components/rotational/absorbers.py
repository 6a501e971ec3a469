"""Absorbers of torsional vibration: tuned inertias, pendulums in the centrifugal field."""

from __future__ import annotations

from math import pi

from components import icons
from components.interfaces import Flange
from modelica_like.language import Component, Equations, Expr, Parameter, Variable, cos, der, param, sin, var


class TunedAbsorber(Component):
    """Inertia on a spring and a damper, tuned to a frequency: without damping the shaft stands still at it.

    J. P. Den Hartog: Mechanical Vibrations, 3.2.
    """

    icon = icons.ABSORBER
    flange = Flange("shaft end")
    J: Parameter = param("kg.m2", "moment of inertia", min=1e-12)
    f: Parameter = param("Hz", "frequency of the inertia on its spring", min=1e-12)
    D: Parameter = param("1", "damping ratio", default=0.0, min=0)
    phi_rel: Variable = var("rad", "angle ahead of the shaft", state="prefer")
    w_rel: Variable = var("rad/s", "speed relative to the shaft", state="prefer")

    def equations(self) -> Equations:
        turns = 2 * pi * self.f
        yield der(self.phi_rel) == self.w_rel
        yield self.J * (der(self.w_rel) + der(der(self.flange.phi))) == self.flange.tau
        yield self.flange.tau == -self.J * turns * (turns * self.phi_rel + 2 * self.D * self.w_rel)

    def stored_energy(self) -> Expr:
        elastic = (2 * pi * self.f * self.phi_rel) ** 2
        return 0.5 * self.J * ((der(self.flange.phi) + self.w_rel) ** 2 + elastic)

    def loss_power(self) -> Expr:
        return 4 * pi * self.J * self.f * self.D * self.w_rel**2


class CentrifugalPendulum(Component):
    """Pendulum absorber: a mass on a circular path that oscillates in the centrifugal field of the shaft.

    Its frequency grows with the speed: at small amplitudes it is sqrt(R/l) times the speed, which is the order of the
    absorbed vibration; at large ones it is lower. If the mass rolls, as between two pins, l is the diameter of the play
    and m the mass of all pendulums (J. P. Den Hartog: Mechanical Vibrations, 5.8). Without gravity.
    """

    icon = icons.PENDULUM
    flange = Flange("shaft end")
    m: Parameter = param("kg", "mass", min=1e-12)
    R: Parameter = param("m", "distance of the pivot from the axis", min=1e-12)
    l: Parameter = param("m", "length of the pendulum", min=1e-12)  # noqa: E741
    d: Parameter = param("N.m.s/rad", "damping of the swing", default=0.0, min=0)
    theta: Variable = var("rad", "swing", state="prefer", default=0)
    w_theta: Variable = var("rad/s", "speed of the swing", state="prefer", default=0)
    w: Variable = var("rad/s", "speed of the shaft")

    @property
    def across(self) -> Expr:
        """Coupling of the path of the pivot and that of the mass around it."""
        return self.R * self.l * cos(self.theta)

    def equations(self) -> Equations:
        turning, w = self.w + self.w_theta, self.w
        yield der(self.flange.phi) == self.w
        yield der(self.theta) == self.w_theta
        yield self.flange.tau == self.m * der(self.R**2 * w + self.l**2 * turning + self.across * (w + turning))
        swing = -self.m * self.R * self.l * sin(self.theta) * w * turning - self.d * self.w_theta
        yield self.m * der(self.l**2 * turning + self.across * w) == swing

    def stored_energy(self) -> Expr:
        turning = self.w + self.w_theta
        return 0.5 * self.m * ((self.R * self.w) ** 2 + (self.l * turning) ** 2 + 2 * self.across * self.w * turning)

    def loss_power(self) -> Expr:
        return self.d * self.w_theta**2
