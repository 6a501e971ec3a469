"""From rotation to translation: rolling wheels, racks, pulleys and ropes."""

from __future__ import annotations

from components import icons
from components.interfaces import Flange, LinearFlange
from modelica_like.language import Component, Equations, Expr, Parameter, param


class RotationToTranslation(Component, partial=True):
    """Element that turns the angle of a shaft into the travel of a slide: s = travel·phi, without loss.

    Angle and position count from the housings of the shaft and of the slide; which are at rest unless something is
    connected to them.
    """

    flange_r = Flange("shaft end")
    flange_t = LinearFlange("slide end")
    support_r = Flange("housing of the shaft", optional=True)
    support_t = LinearFlange("housing of the slide", optional=True)
    inlet, outlet = "flange_r", "flange_t"

    def travel(self) -> Expr:
        """Return the travel per angle in m/rad."""
        raise NotImplementedError

    def pull(self) -> Expr:
        """Return the force that its slide end takes from the shaft, against forward motion if negative."""
        return self.flange_t.f

    def equations(self) -> Equations:
        shaft, slide = self.flange_r, self.flange_t
        phi = shaft.phi - self.support_r.phi if self.support_r.used else shaft.phi
        s = slide.s - self.support_t.s if self.support_t.used else slide.s
        yield s == self.travel() * phi
        yield shaft.tau == -self.travel() * self.pull()
        if self.support_r.used:
            yield self.support_r.tau == -shaft.tau
        if self.support_t.used:
            yield self.support_t.f == -slide.f


class IdealRollingWheel(RotationToTranslation):
    """Wheel that rolls without slip, also rack and pinion or pulley and rope: s = radius·phi."""

    icon = icons.WHEEL
    radius: Parameter = param("m", "rolling radius")

    def travel(self) -> Expr:
        return self.radius


class IdealGearR2T(RotationToTranslation):
    """Gear from rotation to translation with the ratio phi/s; a spindle of the lead h has the ratio 2·pi/h."""

    icon = icons.RACK
    ratio: Parameter = param("rad/m", "angle of the shaft over travel of the slide")

    def travel(self) -> Expr:
        return 1 / self.ratio
