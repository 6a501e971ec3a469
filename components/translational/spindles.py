"""Spindles and slides: from rotation to translation."""

from __future__ import annotations

from math import pi

from components import icons
from components.clutches.friction import DryFriction
from components.interfaces import Flange, LinearFlange
from components.mechanics.inertias import OnSlope
from components.translational.slides import SlideSticking
from components.translational.wheels import RotationToTranslation
from modelica_like.language import Equations, Expr, Parameter, Variable, der, param, var


class BallScrew(RotationToTranslation):
    """Ball screw without loss, elasticity and backlash: one turn moves the nut by the lead.

    A positive torque on the spindle pushes the nut in positive direction. Where a housing is given, its bearing takes
    the torque and its guide the force.
    """

    icon = icons.BALL_SCREW
    flange_r = Flange("spindle")
    flange_t = LinearFlange("nut")
    lead: Parameter = param("m", "travel per turn")

    def travel(self) -> Expr:
        return self.lead / (2 * pi)


class MachineTable(SlideSticking, DryFriction, OnSlope):
    """Machine table on a slideway: a mass with a constant process force, and dry friction with stiction."""

    icon = icons.TABLE
    flange_a = LinearFlange("drive side", free=True)
    flange_b = LinearFlange("far side", free=True)
    m: Parameter = param("kg", "mass of table and workpiece", min=0)
    f_load: Parameter = param("N", "process force against positive motion", default=0.0)
    f_friction: Parameter = param("N", "sliding friction of the slideway", default=0.0, min=0)
    s: Variable = var("m", "position")
    v: Variable = var("m/s", "velocity", state="always")
    f: Variable = var("N", "friction force against positive motion")

    @property
    def slip(self) -> Expr:
        return self.v

    @property
    def friction(self) -> Expr:
        return self.f

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return self.f_friction

    def equations(self) -> Equations:
        yield from super().equations()
        a, b = self.flange_a, self.flange_b
        yield a.s == self.s
        yield b.s == self.s
        yield der(self.s) == self.v
        yield self.m * der(self.v) == a.f + b.f - self.f_load - self.f - self.weight

    def source_power(self) -> Expr:
        return -self.f_load * self.v
