"""Actuators of clutches and brakes: a part between two stops, moved by a magnet, oil or air against a spring."""

from __future__ import annotations

from typing import Literal

from components import icons
from components.electrical.analog import Pin
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Hold,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    absolute,
    all_of,
    any_of,
    der,
    log,
    maximum,
    minimum,
    param,
    signal_in,
    signal_out,
    sqrt,
    var,
    where,
)

_ROUNDING = 1e-6
"""Part of the travel up to which what leaves a stop may be a rounding behind it."""
_VACUUM = 1e-6
"""Part of the pressure of the surroundings that counts as none."""
_AWAY = 1e-3
"""Part of the travel from which on it has left the stop."""


class Actuator(Component, partial=True):
    """Armature or piston between two rigid stops; a spring pushes it back to its rest position.

    It presses on the far stop, to which it is driven (a clutch that closes when switched on), or on the stop at which
    it rests (a brake that closes when power is lost). It meets both without rebound.

    A subclass defines the driving force.
    """

    presses: Literal["driven", "resting"] = "driven"
    """It presses while it is driven to the far stop, or while it rests."""
    m: Parameter = param("kg", "moved mass", min=1e-12)
    travel: Parameter = param("m", "distance between the stops", min=1e-12)
    f_spring: Parameter = param("N", "spring force at rest", min=0)
    c: Parameter = param("N/m", "stiffness of the spring", default=0.0, min=0)
    f_nominal: Parameter = param("N", "pressing force that counts as 1 in y", default=1.0, min=1e-12)
    faint: Parameter = param("N", "force up to which what parts it from a stop may be rounding", default=1e-9, min=0)
    s: Variable = var("m", "way from where it rests", state="always", default=0)
    v: Variable = var("m/s", "velocity", state="always", default=0)
    f_stop: Variable = var("N", "force of the stops against forward motion")
    y: Output = signal_out("1", "pressing force over f_nominal, e.g. for f_normalized of a clutch")
    stop = Mode(
        "resting", "leaving", "moving", "driven", description="stop at which it is",
        holds={
            "resting": Hold("v", reaction="f_stop", capacity="at_rest"),
            "driven": Hold("v", reaction="f_stop", capacity="at_end"),
        },
    )  # fmt: skip

    def at_rest(self) -> tuple[float, None]:
        """Return the capacities of the rest stop: any force against backward motion, none against forward motion."""
        return 0.0, None

    def at_end(self) -> tuple[None, float]:
        """Return the capacities of the far stop."""
        return None, 0.0

    def drive(self) -> Expr:
        """Return the force that drives it to the far stop."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s) == self.v
        yield self.m * der(self.v) == self.drive() - self.f_spring - self.c * self.s - self.f_stop
        yield self.stop.choose(resting=der(self.v), driven=der(self.v), otherwise=self.f_stop) == 0
        # Where it rests, this is the force of the stop; but the blow with which it meets a stop presses nothing.
        push = self.drive() - self.f_spring - self.c * self.s
        pressing = self.stop.choose(
            resting=-push if self.presses == "resting" else 0, driven=push if self.presses == "driven" else 0,
            otherwise=0,
        )  # fmt: skip
        yield self.y == pressing / self.f_nominal

    def events(self) -> Events:
        stop, pull, s, v, travel = self.stop, self.f_stop, self.s, self.v, self.travel
        # It leaves a stop exactly there, at rest and without force: rounding must not make it meet the stop again.
        rest, end = {self.s: 0.0, self.v: 0.0}, {self.s: self.travel, self.v: 0.0}
        yield stop.initially("driven", when=self.s >= self.travel)
        yield stop.initially("moving", when=any_of(self.s > 0, self.v > 0, self.v < 0))
        yield stop.go("resting", "leaving", when=pull > self.faint, reset=rest, because="the drive exceeds the spring")
        yield stop.go("driven", "leaving", when=pull < -self.faint, reset=end, because="the spring exceeds the drive")
        away = all_of(s > _AWAY * travel, s < (1 - _AWAY) * travel)
        yield stop.go("leaving", "moving", when=away, because="away from the stop")
        beyond, behind = s > (1 + _ROUNDING) * travel, s < -_ROUNDING * travel
        yield stop.go("leaving", "driven", when=all_of(beyond, v > 0), reset={self.s: self.travel})
        yield stop.go("leaving", "resting", when=all_of(behind, v < 0), reset={self.s: 0.0})
        yield stop.go("moving", "driven", when=all_of(s > travel, v > 0), reset={self.s: self.travel})
        yield stop.go("moving", "resting", when=all_of(s < 0, v < 0), reset={self.s: 0.0})

    def moving_energy(self) -> Expr:
        """Return the energy of mass and spring."""
        return 0.5 * self.m * self.v**2 + self.f_spring * self.s + 0.5 * self.c * self.s**2


class ElectromagneticActuator(Actuator):
    """Electromagnet with coil, air gap, armature and return spring, e.g. of a clutch or of a brake.

    With the gap x = travel - s the inductance is L_s + L_m/(1 + x/gap), so the force on the armature is i²/2 times
    its slope. For a pot magnet with N turns and two air gaps of the area A, gap is the one that the iron amounts to,
    and L_m = µ0·N²·A/(2·gap). Remanence acts like the current i_rem: an armature may then stick after switching
    off. The iron does not saturate.
    """

    icon = icons.MAGNET
    p = Pin("positive terminal of the coil")
    n = Pin("negative terminal of the coil")
    R: Parameter = param("Ohm", "resistance of the coil", min=1e-12)
    L_m: Parameter = param("H", "inductance through the armature without a gap", min=1e-12)
    L_s: Parameter = param("H", "leakage inductance", default=0.0, min=0)
    gap: Parameter = param("m", "gap at which the inductance through the armature is L_m/2", min=1e-12)
    i_rem: Parameter = param("A", "current to which the remanence amounts", default=0.0, min=0)
    i: Variable = var("A", "current", default=0)
    f: Variable = var("N", "force on the armature")

    @property
    def main(self) -> Expr:
        """Inductance through the armature."""
        return self.L_m / (1 + (self.travel - self.s) / self.gap)

    def drive(self) -> Expr:
        return self.f

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.p.i == self.i
        yield self.n.i == -self.i
        linkage = self.L_s * self.i + self.main * (self.i + self.i_rem)
        yield self.p.v - self.n.v == self.R * self.i + der(linkage)
        yield self.f == 0.5 * (self.i + self.i_rem) ** 2 * self.main**2 / (self.L_m * self.gap)

    def stored_energy(self) -> Expr:
        # The magnetised iron gives i_rem times its linkage.
        return self.moving_energy() + 0.5 * self.L_s * self.i**2 + 0.5 * self.main * (self.i**2 - self.i_rem**2)

    def loss_power(self) -> Expr:
        return self.R * self.i**2


class HydraulicActuator(Actuator):
    """Piston of a clutch or brake, filled with oil through an orifice, with a return spring.

    The flow through valve and line grows with the root of the pressure drop, and is laminar below p_laminar; line, oil
    and seals have the compliance C. First the piston travels at the pressure of the spring, then the pressure
    rises. A supply of zero empties it.
    """

    icon = icons.PISTON
    p_in: Input = signal_in("Pa", "pressure behind the valve, above the surroundings")
    A: Parameter = param("m2", "area of the piston", min=1e-12)
    Q_nominal: Parameter = param("m3/s", "flow through valve and line at the pressure drop dp_nominal", min=1e-30)
    dp_nominal: Parameter = param("Pa", "pressure drop to which Q_nominal belongs", default=1e5, min=1e-12)
    C: Parameter = param("m3/Pa", "compliance of oil, line and seals", min=1e-30)
    p_laminar: Parameter = param("Pa", "pressure drop below which the flow is about laminar", default=1e4, min=1e-12)
    p: Variable = var("Pa", "pressure in the cylinder", nominal=1e5, default=0)
    Q: Variable = var("m3/s", "flow into the cylinder", nominal=1e-5)

    def drive(self) -> Expr:
        return self.A * self.p

    def equations(self) -> Equations:
        yield from super().equations()
        drop = self.p_in - self.p
        yield self.Q_nominal * drop / sqrt(self.dp_nominal * (absolute(drop) + self.p_laminar)) == self.Q
        yield self.C * der(self.p) == self.Q - self.A * self.v

    def stored_energy(self) -> Expr:
        return self.moving_energy() + 0.5 * self.C * self.p**2

    def loss_power(self) -> Expr:
        return self.Q * (self.p_in - self.p)

    def source_power(self) -> Expr:
        return self.Q * self.p_in


class PneumaticActuator(Actuator):
    """Piston of a clutch or brake, filled with air through a valve, with a return spring.

    The valve has the sonic conductance C and the critical pressure ratio b of ISO 6358; where the pressures are nearly
    equal its flow is proportional to their difference. The air keeps its temperature; its stored energy is its
    exergy relative to the surroundings, p·V·ln(p/p_0) - (p - p_0)·V.
    """

    icon = icons.PISTON
    p_in: Input = signal_in("Pa", "absolute pressure behind the valve", default=1e5)
    A: Parameter = param("m2", "area of the piston", min=1e-12)
    V_0: Parameter = param("m3", "volume of line and cylinder at rest", min=1e-15)
    C: Parameter = param("m3/(s.Pa)", "sonic conductance of the valve", min=1e-30)
    b: Parameter = param("1", "critical pressure ratio of the valve", default=0.3, min=0, max=0.9)
    p_0: Parameter = param("Pa", "pressure of the surroundings", default=1e5, min=1e-12)
    p_N: Parameter = param("Pa", "reference pressure to which C belongs", default=1e5, min=1e-12)
    laminar: Parameter = param(
        "1", "pressure ratio above which the flow is laminar", default=0.999, min=0.9, max=0.9999
    )
    p: Variable = var("Pa", "absolute pressure in the cylinder", nominal=1e5, default="p_0", guess=1e5)
    flow: Variable = var("W", "rate of pressure times volume, by what flows in")

    @property
    def supply(self) -> Expr:
        """Pressure behind the valve; that of a vacuum has a logarithm."""
        return maximum(self.p_in, _VACUUM * self.p_0)

    @property
    def volume(self) -> Expr:
        """Volume of the air."""
        return self.V_0 + self.A * self.s

    def drive(self) -> Expr:
        return self.A * (self.p - self.p_0)

    def equations(self) -> Equations:
        yield from super().equations()
        high, low = maximum(self.supply, self.p), minimum(self.supply, self.p)
        ratio = low / high
        subsonic = sqrt(1 - (maximum(minimum(ratio, self.laminar) - self.b, 0) / (1 - self.b)) ** 2)
        share = subsonic * where(ratio > self.laminar, (1 - ratio) / (1 - self.laminar), 1)
        yield self.flow == where(self.supply > self.p, 1, -1, events=False) * self.p_N * self.C * high * share
        yield der(self.p * self.volume) == self.flow

    def stored_energy(self) -> Expr:
        air = self.p * self.volume * log(self.p / self.p_0) - (self.p - self.p_0) * self.volume
        return self.moving_energy() + air

    def loss_power(self) -> Expr:
        return self.flow * log(self.supply / self.p)

    def source_power(self) -> Expr:
        return self.flow * log(self.supply / self.p_0)
