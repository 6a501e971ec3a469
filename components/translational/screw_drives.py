"""Ball screws with losses and backlash."""

from __future__ import annotations

from components import icons
from components.gears.lossy_gears import ConstantEfficiencyGear
from components.interfaces import Flange, LinearFlange
from components.mechanics.inertias import Inertia
from components.mechanics.springs import ElastoBacklash, SpringDamper
from components.translational.spindles import BallScrew
from modelica_like.language import Component, Equations, LanguageError, Parameter, connect, param, series


class BallScrewDrive(Component):
    """Ball screw with efficiency by direction of power, friction of the seals, an elastic nut, and backlash.

    The axial stiffness c of nut and spindle and the axial backlash act on the spindle's circumference: as the torsion
    c·(lead/2π)² and the angle 2π·backlash/lead.
    """

    icon = icons.BALL_SCREW
    flange_r = Flange("spindle")
    flange_t = LinearFlange("nut")
    inlet, outlet = "flange_r", "flange_t"
    has_backlash: bool = False
    """Whether the nut has backlash, which is then required."""
    lead: Parameter = param("m", "travel per turn")
    J: Parameter = param("kg.m2", "moment of inertia of the spindle", min=0)
    efficiency: Parameter = param("1", "efficiency while the spindle drives", default=0.9, min=1e-3, max=1)
    efficiency_back: Parameter = param("1", "efficiency while the nut drives", default="2 - 1/efficiency", max=1)
    tau_friction: Parameter = param("N.m", "friction torque of seals and preload", default=0.0, min=0)
    c: Parameter = param("N/m", "axial stiffness", min=0)
    d: Parameter = param("N.s/m", "axial damping", default=0.0, min=0)
    backlash: Parameter = param("m", "axial backlash", default=None, min=1e-12)
    spindle = Inertia(J="J")
    mesh = ConstantEfficiencyGear(
        ratio=1, efficiency="efficiency", efficiency_back="efficiency_back", tau_friction="tau_friction"
    )
    screw = BallScrew(lead="lead")

    def build(self) -> None:
        c, d = "c * (lead / (2*pi))**2", "d * (lead / (2*pi))**2"
        self.nut = ElastoBacklash(c=c, d=d, b="2*pi * backlash / lead") if self.has_backlash else SpringDamper(c=c, d=d)

    def equations(self) -> Equations:
        if self.given("backlash") and not self.has_backlash:
            raise LanguageError("BallScrewDrive: backlash has a value, but the nut has none.",
                                advice="Add has_backlash = true, or leave backlash out.")  # fmt: skip
        yield connect(self.flange_r, self.spindle.flange_a)
        yield from series(self.spindle, self.mesh, self.nut, self.screw)
        yield connect(self.flange_t, self.screw.flange_t)
