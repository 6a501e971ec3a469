"""Worm gears."""

from __future__ import annotations

from components import icons
from components.feasible import Feasible
from components.gears.lossy_gears import MeshWithFriction
from components.mechanics.sources import AT_ONCE
from modelica_like.language import (
    Discrete,
    Equations,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    absolute,
    cos,
    discrete,
    exp,
    maximum,
    param,
    signal_out,
    tan,
    where,
)


class WormGear(Feasible, MeshWithFriction):
    """Worm gear with the friction of its flanks: the worm is at flange_a, the wheel at flange_b.

    With the lead angle gamma and the friction angle rho, tan(rho) = mu/cos(alpha_n), the worm drives with the
    efficiency tan(gamma)/tan(gamma + rho) and the wheel with tan(gamma - rho)/tan(gamma) (G. Niemann, H. Winter:
    Maschinenelemente III). Where gamma is not above rho the gear is self-locking: no torque turns the worm through the
    wheel. At standstill rho follows from mu_static, and falls to that of mu beyond the speed w_mu of the worm; so a
    gear may hold at rest and yet not brake a load that is moving, which the report of a run tells.
    """

    icon = icons.WORM
    z_1: Parameter = param("1", "number of threads of the worm", default=1.0, min=1)
    z_2: Parameter = param("1", "number of teeth of the wheel", min=1)
    ratio: Parameter = param("1", "speed of the worm over speed of the wheel", default="z_2 / z_1")
    gamma: Parameter = param("rad", "lead angle of the worm", min=1e-3, max=1.2)
    alpha_n: Parameter = param("rad", "pressure angle in the normal section", default=0.3490658503988659, min=0, max=1)
    mu: Parameter = param("1", "coefficient of friction at speed", min=0)
    mu_static: Parameter = param("1", "coefficient of friction at standstill", default="mu", min=0)
    w_mu: Parameter = param(
        "rad/s", "speed of the worm at which mu_static has fallen to mu by 1/e", default=1.0, min=1e-12
    )
    tau_friction: Parameter = param("N.m", "friction torque of the bearings at the worm", default=0.0, min=0)
    efficiency: Output = signal_out("1", "efficiency at this speed, if the worm drives")
    self_locking: Output = signal_out("1", "1 where the wheel cannot start the worm, otherwise 0")
    misfit = "cannot turn: its worm cannot drive, because lead angle and friction angle are 90° together"
    t_told: Discrete = discrete("s", "time at which the report tells that it holds: at the start", start=AT_ONCE)
    lock = Mode("open", "starting", "locking", "told", description="whether the report has to tell that it holds")

    def fits(self) -> Expr:
        return tan(self.gamma) * maximum(self.mu, self.mu_static) < cos(self.alpha_n)

    def rubbing(self, speed: Expr | float) -> Expr:
        """Return the tangent of the friction angle."""
        mu = self.mu + (self.mu_static - self.mu) * exp(-absolute(speed) / self.w_mu)
        return mu / cos(self.alpha_n)

    def efficiencies(self, speed: Expr | float) -> tuple[Expr | float, Expr | float]:
        rise, rho = tan(self.gamma), self.rubbing(speed)
        return rise * (1 - rise * rho) / (rise + rho), (rise - rho) / (rise * (1 + rise * rho))

    def bearing_losses(self, speed: Expr | float) -> tuple[Expr | float, Expr | float]:
        return self.tau_friction, self.tau_friction

    def equations(self) -> Equations:
        yield from super().equations()
        efficiency, _ = self.efficiencies(self.w_a)
        yield self.efficiency == efficiency
        yield self.self_locking == where(tan(self.gamma) > self.mu_static / cos(self.alpha_n), 0, 1)

    def events(self) -> Events:
        yield from super().events()
        lock, rise, bent = self.lock, tan(self.gamma), cos(self.alpha_n)
        yield lock.initially("locking", when=self.mu > rise * bent)
        yield lock.initially("starting", when=self.mu_static > rise * bent)
        locking = "is self-locking: no torque turns it through its wheel"
        starting = "holds at rest only: what moves its wheel is not stopped by the friction of the flanks"
        yield lock.go("locking", "told", at=self.t_told, notice=locking, because="mu above the lead angle")
        yield lock.go("starting", "told", at=self.t_told, notice=starting, because="mu_static above the lead angle")
