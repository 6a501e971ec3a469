"""Hoists: drums, ropes, brakes that hold without power."""

from __future__ import annotations

from components import icons
from components.clutches.actuators import ElectromagneticActuator
from components.clutches.friction import Brake
from components.electrical.analog import Pin
from components.interfaces import Flange, LinearCompliantWithRelativeStates
from components.tabulated import ROUNDING
from components.thermal import Lossy
from components.translational.wheels import RotationToTranslation
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    Variable,
    all_of,
    connect,
    der,
    maximum,
    param,
    signal_out,
    var,
)


class WinchDrum(RotationToTranslation):
    """Drum of a winch with a rope that hangs down; positive turns haul it up: s = radius·phi.

    The rope's length on the drum and below it moves at one velocity, so it counts with its whole mass rho·length, while
    only what hangs, hanging - s, weighs. The report of a run tells where that is below zero or more than there is. The
    rope is inextensible; a `Rope` below makes it elastic and slack.
    """

    icon = icons.DRUM
    radius: Parameter = param("m", "radius of the drum up to the middle of the rope", min=1e-12)
    rho: Parameter = param("kg/m", "mass of the rope over its length", default=0.0, min=0)
    length: Parameter = param("m", "whole length of the rope", default=0.0, min=0)
    hanging: Parameter = param("m", "length that hangs down at s = 0", default=0.0, min=0)
    g: Parameter = param("m/s2", "gravity", default=9.80665)
    s: Variable = var("m", "way of the rope's end, upwards")
    v: Variable = var("m/s", "velocity of the rope")
    rope = Mode(
        "hanging", "hauled", "gone", description="whether the end of a rope with mass always hung from the drum"
    )

    @property
    def below(self) -> Expr:
        """Length that hangs below the drum."""
        return maximum(self.hanging - self.s, 0)

    def travel(self) -> Expr:
        return self.radius

    def pull(self) -> Expr:
        weight = self.rho * self.g * self.below
        return self.flange_t.f - weight - self.rho * self.length * der(self.v)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.s == self.flange_t.s - (self.support_t.s if self.support_t.used else 0.0)
        yield der(self.s) == self.v

    def stored_energy(self) -> Expr:
        rope = 0.5 * self.rho * self.length * self.v**2
        return rope - 0.5 * self.rho * self.g * self.below**2

    def events(self) -> Events:
        yield from super().events()
        heavy, slack = self.rho > 0, ROUNDING * self.length
        hauled, gone = self.s > self.hanging + slack, self.hanging - self.s > self.length + slack
        yield self.rope.go("hanging", "hauled", when=all_of(heavy, hauled), notice="has hauled in all of its rope")
        yield self.rope.go("hanging", "gone", when=all_of(heavy, gone), notice="has let out more rope than it has")


class Rope(Lossy, LinearCompliantWithRelativeStates):
    """Rope by which flange_a hauls flange_b in positive direction: elastic, damped, and it never pushes.

    The tension is c·x + d·der(x) with the stretch x = s_a - s_b - slack, and zero where the rope is slack or shortens
    faster than it can, which the report of a run tells.
    """

    icon = icons.ROPE
    c: Parameter = param("N/m", "stiffness, modulus times section over length", min=1e-12)
    d: Parameter = param("N.s/m", "damping coefficient", default=0.0, min=0)
    slack: Parameter = param("m", "way of flange_a from s_a = s_b until it is taut", default=0.0)
    tension: Output = signal_out("N", "tension")
    rope = Mode("slack", "taut", description="whether it is taut")

    @property
    def stretch(self) -> Expr:
        """Stretch; negative where the rope is slack."""
        return -self.s_rel - self.slack

    @property
    def spring(self) -> Expr:
        """Elastic part of the tension."""
        return self.c * maximum(self.stretch, 0)

    def equations(self) -> Equations:
        yield from super().equations()
        taut = maximum(self.c * self.stretch - self.d * self.v_rel, 0)
        yield self.tension == self.rope.choose(slack=0, taut=taut)
        yield self.f == -self.tension

    def events(self) -> Events:
        yield self.rope.initially("taut", when=self.stretch > 0)
        yield self.rope.go("slack", "taut", when=self.stretch > 0)
        yield self.rope.go("taut", "slack", when=self.stretch < 0, notice="gets slack")

    def stored_energy(self) -> Expr:
        return 0.5 * self.spring**2 / self.c

    def dissipation(self) -> Expr:
        return (self.spring - self.tension) * self.v_rel


class HoldingBrake(Component):
    """Brake that springs close and a magnet opens: it holds as long as there is no voltage.

    `capacity` is the sliding torque without current; the coil is an `ElectromagneticActuator`.
    """

    icon = icons.HOLDING_BRAKE
    p = Pin("positive terminal of the coil")
    n = Pin("negative terminal of the coil")
    flange_a = Flange("left end", free=True)
    flange_b = Flange("right end", free=True)
    support = Flange("housing", optional=True)
    inlet, outlet = "flange_a", "flange_b"
    capacity: Parameter = param("N.m", "sliding torque of the closed brake", min=0)
    peak: Parameter = param("1", "static friction over sliding friction at standstill", default=1.0, min=1)
    R: Parameter = param("Ohm", "resistance of the coil", min=1e-12)
    L_m: Parameter = param("H", "inductance through the armature without a gap", min=1e-12)
    gap: Parameter = param("m", "gap at which the inductance through the armature is L_m/2", min=1e-12)
    travel: Parameter = param("m", "way of the armature", min=1e-12)
    m: Parameter = param("kg", "mass of the armature", min=1e-12)
    f_spring: Parameter = param("N", "spring force of the closed brake", min=1e-12)
    c: Parameter = param("N/m", "stiffness of the springs", default=0.0, min=0)
    coil = ElectromagneticActuator(
        presses="resting", R="R", L_m="L_m", gap="gap", travel="travel", m="m", f_spring="f_spring", c="c",
        f_nominal="f_spring",
    )  # fmt: skip
    brake = Brake(capacity="capacity", peak="peak")

    def equations(self) -> Equations:
        yield connect(self.p, self.coil.p)
        yield connect(self.n, self.coil.n)
        yield connect(self.coil.y, self.brake.f_normalized)
        yield connect(self.flange_a, self.brake.flange_a)
        yield connect(self.flange_b, self.brake.flange_b)
        if self.support.used:
            yield connect(self.support, self.brake.support)
