"""Linkages: motions that are given functions of an angle, and the forces that belong to them."""

from __future__ import annotations

from math import pi

from components import icons
from components.feasible import Feasible
from components.interfaces import Flange, LinearFlange, Supported, TwoFlanges
from modelica_like.language import (
    Equations,
    Expr,
    Parameter,
    absolute,
    all_of,
    atan2,
    cos,
    floor,
    param,
    sin,
    sqrt,
    where,
)

_ROUNDING = 1e-12


class AngleToWay(Feasible, Supported, partial=True):
    """Linkage from a shaft to a slide, without mass and loss: s = way(phi), and the torque is -slope(phi)·f."""

    flange_r = Flange("shaft end")
    flange_t = LinearFlange("slide end")
    inlet, outlet = "flange_r", "flange_t"

    def way(self, phi: Expr) -> Expr:
        """Return the position of the slide."""
        raise NotImplementedError

    def slope(self, phi: Expr) -> Expr:
        """Return the derivative of the position by the angle."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield from super().equations()
        phi = self.flange_r.phi - self.phi_support
        yield self.flange_t.s == self.way(phi)
        yield self.flange_r.tau == -self.slope(phi) * self.flange_t.f
        yield from self.support_torque(self.flange_r.tau)


class SliderCrank(AngleToWay):
    """Slider-crank: s = r·cos(phi) + sqrt(l² - (r·sin(phi) - e)²), the far dead centre at phi = 0 without offset.

    It drives presses, pistons and pumps. Masses of crank, rod and slide stand beside it; the rod's may be split between
    both ends. VDI 2156.
    """

    icon = icons.SLIDER_CRANK
    r: Parameter = param("m", "crank radius", min=1e-12)
    l: Parameter = param("m", "length of the rod; above r + |e|", min=1e-12)  # noqa: E741
    e: Parameter = param("m", "offset of the slide from the axis of the crank", default=0.0)
    misfit = "cannot turn: its rod l is shorter than the crank r and the offset e together"

    def fits(self) -> Expr:
        return self.l > self.r + absolute(self.e)

    def rod(self, phi: Expr) -> Expr:
        """Return the part of the rod along the slide."""
        return sqrt(self.l**2 - (self.r * sin(phi) - self.e) ** 2)

    def way(self, phi: Expr) -> Expr:
        return self.r * cos(phi) + self.rod(phi)

    def slope(self, phi: Expr) -> Expr:
        return -self.r * sin(phi) - self.r * cos(phi) * (self.r * sin(phi) - self.e) / self.rod(phi)


class Cam(AngleToWay):
    """Cam with a form-closed follower: it rises, rests, falls, and rests for what is left of the turn.

    Rise and fall are inclined sine curves, x - sin(2·pi·x)/(2·pi) of the stroke, which begin and end without
    acceleration. VDI 2143.
    """

    icon = icons.CAM
    h: Parameter = param("m", "stroke")
    rise: Parameter = param("rad", "angle in which it rises", min=1e-6)
    dwell: Parameter = param("rad", "angle for which it rests up there", default=0.0, min=0)
    fall: Parameter = param("rad", "angle in which it falls", min=1e-6)
    misfit = "needs more than a turn: rise, dwell and fall are more than 360° together"

    def fits(self) -> Expr:
        return self.rise + self.dwell + self.fall <= (2 + _ROUNDING) * pi

    def stage(self, phi: Expr) -> tuple[Expr, Expr, Expr]:
        """Return the angle in the turn, and the shares of rise and fall that have passed."""
        angle = phi - 2 * pi * floor(phi / (2 * pi))
        return angle, angle / self.rise, (angle - self.rise - self.dwell) / self.fall

    def way(self, phi: Expr) -> Expr:
        angle, up, down = self.stage(phi)
        rising, falling = up - sin(2 * pi * up) / (2 * pi), 1 - down + sin(2 * pi * down) / (2 * pi)
        above = where(angle < self.rise + self.dwell, 1, where(down < 1, falling, 0))
        return self.h * where(up < 1, rising, above)

    def slope(self, phi: Expr) -> Expr:
        angle, up, down = self.stage(phi)
        rising, falling = (1 - cos(2 * pi * up)) / self.rise, (cos(2 * pi * down) - 1) / self.fall
        above = where(angle < self.rise + self.dwell, 0, where(down < 1, falling, 0))
        return self.h * where(up < 1, rising, above)


class FourBar(Feasible, TwoFlanges):
    """Four-bar linkage: a crank at flange_a moves a rocker at flange_b through a coupler, without mass and loss.

    Both angles count from the line from the axis of the crank to that of the rocker; the linkage is not crossed. It
    turns all around: crank and ground are shorter together than coupler and rocker, and in both stretched positions the
    coupler reaches (F. Grashof). VDI 2127.
    """

    icon = icons.FOUR_BAR
    crank: Parameter = param("m", "length of the crank; below that of the ground", min=1e-12)
    coupler: Parameter = param("m", "length of the coupler", min=1e-12)
    rocker: Parameter = param("m", "length of the rocker", min=1e-12)
    ground: Parameter = param("m", "distance of both axes", min=1e-12)
    misfit = (
        "cannot turn all around: coupler and rocker must be longer together than ground and crank, "
        "and differ by less than ground and crank do"
    )

    def fits(self) -> Expr:
        longest = self.ground + self.crank < self.coupler + self.rocker
        return all_of(longest, absolute(self.coupler - self.rocker) < self.ground - self.crank)

    def pin(self, phi: Expr) -> tuple[Expr, Expr]:
        """Return the way from the pin of the crank to the axis of the rocker."""
        return self.ground - self.crank * cos(phi), -self.crank * sin(phi)

    def swing(self, phi: Expr) -> Expr:
        """Return the angle of the rocker."""
        x, y = self.pin(phi)
        distance = sqrt(x**2 + y**2)
        bend = (distance**2 + self.rocker**2 - self.coupler**2) / (2 * distance * self.rocker)
        return pi + atan2(y, x) - atan2(sqrt(1 - bend**2), bend)

    def slope(self, phi: Expr) -> Expr:
        """Return the speed of the rocker over that of the crank: the coupler keeps its length."""
        x, y = self.pin(phi)
        psi = self.swing(phi)
        along_x, along_y = x + self.rocker * cos(psi), y + self.rocker * sin(psi)
        crank = self.crank * (along_y * cos(phi) - along_x * sin(phi))
        return crank / (self.rocker * (along_y * cos(psi) - along_x * sin(psi)))

    def equations(self) -> Equations:
        yield from super().equations()
        a, b = self.flange_a, self.flange_b
        phi = a.phi - self.phi_support
        yield b.phi - self.phi_support == self.swing(phi)
        yield a.tau + self.slope(phi) * b.tau == 0
