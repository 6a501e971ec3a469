"""Loads of working machines: cutting, forming, pumps, compressors, conveyors."""

from __future__ import annotations

from math import inf, pi

from components import icons
from components.clutches.friction import ShaftFriction
from components.interfaces import LinearOneFlange, OneFlange
from components.tabulated import Tabulated
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Input,
    Output,
    Parameter,
    Variable,
    column,
    cos,
    der,
    maximum,
    param,
    rows,
    signal_in,
    signal_out,
    sin,
    sqrt,
    tanh,
    var,
)

Rows = tuple[tuple[float, float], ...]
_STILL = 1e-9
"""Share of the nominal speed below which a pump stands still."""


class ShaftLoad(ShaftFriction, OneFlange, partial=True):
    """Torque against the rotation of a shaft, which holds it at standstill, too; a subclass says how large it is."""

    icon = icons.LOAD
    w: Variable = var("rad/s", "speed of the shaft relative to the housing", state="always")
    tau: Variable = var("N.m", "load torque against forward rotation")

    @property
    def slip(self) -> Expr:
        return self.w

    @property
    def friction(self) -> Expr:
        return self.tau

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi) == self.w
        yield self.flange.tau == self.tau + self.other_torque()

    def other_torque(self) -> Expr | float:
        """Return the torque against forward rotation that is no friction."""
        return 0.0


class CuttingLoad(ShaftLoad):
    """Turning on a lathe: the cutting force after O. Kienzle, on the diameter of the workpiece.

    F_c = k_c11·b·h·(h/1 mm)^-m_c with the width b = depth/sin(kappa) and the thickness h = feed·sin(kappa) of the chip
    (O. Kienzle: Die Bestimmung von Kräften und Leistungen an spanenden Werkzeugen, VDI-Z 94, 1952).
    """

    icon = icons.CUTTING
    depth: Input = signal_in("m", "depth of the cut; 0 while the tool is out")
    feed: Parameter = param("m", "feed per turn", min=1e-12)
    diameter: Parameter = param("m", "diameter of the workpiece", min=0)
    k_c11: Parameter = param("Pa", "specific cutting force of a chip of 1 mm by 1 mm", min=0)
    m_c: Parameter = param("1", "exponent of the chip's thickness", default=0.25, min=0, max=1)
    kappa: Parameter = param("rad", "setting angle of the edge", default=pi / 2, min=1e-3, max=pi / 2)
    wear: Parameter = param("1", "factor for wear of the edge and others", default=1.0, min=0)
    mm: Parameter = param("m", "thickness to which k_c11 belongs", default=1e-3, min=1e-12)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        thickness, width = self.feed * sin(self.kappa), self.depth / sin(self.kappa)
        force = self.wear * self.k_c11 * width * thickness * (thickness / self.mm) ** -self.m_c
        return force * 0.5 * self.diameter


class DisplacementLoad(ShaftLoad):
    """Displacement pump or piston compressor behind a check valve: mean torque V·w/(2·pi·efficiency).

    The work w per displaced volume is p_out - p_in for a liquid, and with an exponent n of the polytrope
    p_in·n/(n - 1)·((p_out/p_in)^((n-1)/n) - 1) for a gas. What the fluid gets counts as lost.
    """

    p_out: Input = signal_in("Pa", "absolute pressure behind it")
    V: Parameter = param("m3", "displaced volume per turn", min=0)
    p_in: Parameter = param("Pa", "absolute pressure before it", default=1e5, min=1e-12)
    n: Parameter = param("1", "exponent of the polytrope; without a value it is a liquid", default=None, min=1.001)
    efficiency: Parameter = param("1", "mechanical efficiency", default=1.0, min=1e-3, max=1)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        rise = maximum(self.p_out, self.p_in) / self.p_in
        work = rise - 1
        if self.given("n"):
            work = self.n / (self.n - 1) * (rise ** ((self.n - 1) / self.n) - 1)
        return self.V * self.p_in * work / (2 * pi * self.efficiency)


class CentrifugalPump(Lossy, OneFlange):
    """Centrifugal pump in its plant: both characteristics are parabolas, and the flow is where they meet.

    Pump H = H_0·(w/w_nominal)² - K·Q², plant H = H_static + R·Q². Below the speed at which it reaches H_static a check
    valve keeps the flow at zero. The shaft gives rho·g·H·Q/efficiency, and the power tau_0·(w/w_nominal)²·w of the
    wheel in the water; what lifts the water counts as delivered.
    """

    icon = icons.PUMP
    w_nominal: Parameter = param("rad/s", "nominal speed", min=1e-12)
    H_0: Parameter = param("m", "head without flow at nominal speed", min=1e-12)
    K: Parameter = param("s2/m5", "fall of the pump's head over the square of the flow", min=0)
    R: Parameter = param("s2/m5", "resistance of the plant, head over the square of the flow", min=1e-12)
    H_static: Parameter = param("m", "static head of the plant", default=0.0, min=0)
    efficiency: Parameter = param("1", "hydraulic efficiency", default=0.8, min=1e-3, max=1)
    tau_0: Parameter = param("N.m", "torque without flow at nominal speed", default=0.0, min=0)
    rho: Parameter = param("kg/m3", "density", default=1000.0, min=0)
    g: Parameter = param("m/s2", "gravity", default=9.80665)
    smooth: Parameter = param("1", "share of H_0 from which on the flow is the full one", default=1e-6, min=1e-12)
    w: Variable = var("rad/s", "speed")
    Q: Output = signal_out("m3/s", "flow")
    H: Output = signal_out("m", "head")
    tau_lift: Variable = var("N.m", "torque that moves the water")
    tau: Variable = var("N.m", "torque against the rotation")

    def equations(self) -> Equations:
        yield from super().equations()
        x = maximum(self.w / self.w_nominal, 0)
        excess = maximum(self.H_0 * x**2 - self.H_static, 0)
        yield der(self.phi) == self.w
        yield excess / sqrt((excess + self.smooth * self.H_0) * (self.K + self.R)) == self.Q
        yield self.H_static + self.R * self.Q**2 == self.H
        slow = maximum(self.w, _STILL * self.w_nominal)
        yield self.tau_lift == self.rho * self.g * self.H * self.Q / (self.efficiency * slow)
        yield self.tau == self.tau_lift + self.tau_0 * x**2
        yield self.flange.tau == self.tau

    def source_power(self) -> Expr:
        return -self.efficiency * self.tau_lift * self.w

    def dissipation(self) -> Expr:
        return (self.tau - self.efficiency * self.tau_lift) * self.w


class FormingForce(Tabulated, Lossy, LinearOneFlange):
    """Resistance of a workpiece against the slide of a press: a force over the way, in forward motion only.

    Beyond the last row the last force holds, so a table begins and ends with zero.
    """

    icon = icons.LOAD
    table: Rows = rows(column("position", scale="s_scale", rising=True), column("force", scale="f_scale", min=0))
    s_scale: Parameter = param("m", "position that counts as 1 in table", default=1.0)
    f_scale: Parameter = param("N", "force that counts as 1 in table", default=1.0)
    v_smooth: Parameter = param("m/s", "velocity at which 76 % of the force are reached", default=1e-3, min=1e-12)
    v: Variable = var("m/s", "velocity of the slide")
    f: Variable = var("N", "force against forward motion")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s) == self.v
        force = self.f_scale * self.look_up(self.s / self.s_scale, self.table)
        yield self.f == force * tanh(maximum(self.v, 0) / self.v_smooth)
        yield self.flange.f == self.f

    def events(self) -> Events:
        yield from super().events()
        if self.table[0][1] or self.table[-1][1]:  # else there is no force beyond
            yield from self.leaving("table", self.s / self.s_scale, self.table, self.f > 0, least=-inf)

    def dissipation(self) -> Expr:
        return self.f * self.v


class Conveyor(ShaftLoad):
    """Belt conveyor at its driving drum: friction of rollers and belt, lift, and the masses that move (DIN 22101).

    The resistance is C·f·L·g·(m_R + (2·m_B + m_L)·cos(slope)) with masses per length of rollers, belt and load, and the
    load's weight L·g·m_L·sin(slope). It holds a slope by its friction only.
    """

    icon = icons.CONVEYOR
    R: Parameter = param("m", "radius of the drum", min=1e-12)
    L: Parameter = param("m", "length", min=0)
    m_L: Parameter = param("kg/m", "mass of the load per length", default=0.0, min=0)
    m_B: Parameter = param("kg/m", "mass of the belt per length", default=0.0, min=0)
    m_R: Parameter = param("kg/m", "mass of the rollers per length, at their circumference", default=0.0, min=0)
    f: Parameter = param("1", "coefficient of friction", default=0.02, min=0)
    C: Parameter = param("1", "factor for the other resistances", default=1.0, min=0)
    slope: Parameter = param("rad", "slope upwards", default=0.0, min=-1.6, max=1.6)
    g: Parameter = param("m/s2", "gravity", default=9.80665)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        pressing = self.m_R + (2 * self.m_B + self.m_L) * cos(self.slope)
        return self.C * self.f * self.L * self.g * pressing * self.R

    def lifting(self) -> Expr:
        """Return the torque of the load's weight."""
        return self.L * self.g * self.m_L * sin(self.slope) * self.R

    def moved(self) -> Expr:
        """Return the moment of inertia of what moves."""
        return self.L * (2 * self.m_B + self.m_R + self.m_L) * self.R**2

    def other_torque(self) -> Expr | float:
        return self.lifting() + self.moved() * der(self.w)

    def stored_energy(self) -> Expr:
        return 0.5 * self.moved() * self.w**2

    def source_power(self) -> Expr:
        return -self.lifting() * self.w
