"""Planetary gear sets."""

from __future__ import annotations

from components import icons
from components.interfaces import Flange, Supported
from components.thermal import Lossy
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Parameter,
    Variable,
    absolute,
    der,
    param,
    tanh,
    var,
    where,
)


class IdealPlanetary(Component):
    """Planetary gear set of sun, ring and carrier without inertia and loss.

    Seen from the carrier, sun and ring turn as in a gear with the fixed-carrier ratio -ratio (R. Willis, Principles of
    Mechanism, 1841). With equal torque arms it is a differential.
    """

    icon = icons.PLANETARY
    sun = Flange("sun gear shaft")
    carrier = Flange("planet carrier shaft")
    ring = Flange("ring gear shaft")
    inlet, outlet = "sun", "carrier"
    ratio: Parameter = param("1", "number of ring teeth over number of sun teeth")

    def equations(self) -> Equations:
        sun, carrier, ring = self.sun, self.carrier, self.ring
        yield (1 + self.ratio) * carrier.phi == sun.phi + self.ratio * ring.phi
        yield ring.tau == self.ratio * sun.tau
        yield carrier.tau == -(1 + self.ratio) * sun.tau


class PlanetarySet(Component):
    """Planetary gear set of sun, ring and carrier after R. Willis (Principles of Mechanism, 1841), without inertia.

    w_sun - w_carrier = i0·(w_ring - w_carrier). The fixed-carrier ratio i0 is -z_ring/z_sun if each planet is in
    mesh with sun and ring (minus set), +z_ring/z_sun with planets in pairs between them (plus set). The teeth
    transmit the rolling power tau_sun·(w_sun - w_carrier), from the sun to the ring if it is positive; the rest of the
    power passes with the carrier, as in a coupling.
    """

    icon = icons.PLANETARY
    sun = Flange("sun gear shaft")
    carrier = Flange("planet carrier shaft")
    ring = Flange("ring gear shaft")
    inlet, outlet = "sun", "carrier"
    i0: Parameter = param("1", "fixed-carrier ratio, speed of the sun over speed of the ring seen from the carrier")
    w_rel: Variable = var("rad/s", "speed of the sun relative to the carrier")
    rolling_power: Variable = var("W", "rolling power of the sun")

    @property
    def lost_torque(self) -> Expr | float:
        """Torque at the sun that does not reach the ring."""
        return 0.0

    def equations(self) -> Equations:
        yield from super().equations()
        sun, carrier, ring = self.sun, self.carrier, self.ring
        yield sun.phi - carrier.phi == self.i0 * (ring.phi - carrier.phi)
        yield ring.tau == -self.i0 * (sun.tau - self.lost_torque)
        yield carrier.tau == -(sun.tau + ring.tau)
        yield self.w_rel == der(sun.phi) - der(carrier.phi)
        yield self.rolling_power == sun.tau * self.w_rel


class LossyPlanetarySet(Lossy, PlanetarySet):
    """Planetary gear set whose teeth lose a share of the rolling power, in either direction.

    If rolling power enters at the sun, tau_ring = -i0·efficiency·tau_sun; if it enters at the ring, tau_ring =
    -i0·tau_sun/efficiency (VDI 2157). A set that turns as one block has no loss. Below a few w_smooth the friction of
    the teeth goes through zero smoothly: the set does not stick.
    """

    efficiency: Parameter = param(
        "1", "rolling power that leaves over rolling power that enters; of all meshes in a row", min=1e-3, max=1
    )
    w_smooth: Parameter = param("rad/s", "relative speed at which 76 % of the loss are reached", default=0.1, min=1e-12)
    tau_loss: Variable = var("N.m", "lost torque at the sun")

    @property
    def lost_torque(self) -> Expr | float:
        return self.tau_loss

    def equations(self) -> Equations:
        yield from super().equations()
        rolling = tanh(self.w_rel / self.w_smooth)
        share = where(rolling * self.sun.tau > 0, 1 - self.efficiency, 1 / self.efficiency - 1)
        yield self.tau_loss == rolling * share * absolute(self.sun.tau)

    def dissipation(self) -> Expr:
        return self.tau_loss * self.w_rel


class Differential(Supported):
    """Bevel gear differential: both wheels get half the torque, the cage turns with the mean of their speeds.

    An `IdealPlanetary` with equal torque arms, behind the final drive of the given ratio. All angles count from the
    housing, which carries what the final drive changes of the torque.
    """

    icon = icons.DIFFERENTIAL
    flange = Flange("drive shaft")
    left = Flange("left wheel shaft")
    right = Flange("right wheel shaft")
    inlet, outlet = "flange", "left"
    ratio: Parameter = param("1", "speed of the drive shaft over speed of the cage", default=1.0)

    def equations(self) -> Equations:
        drive, left, right = self.flange, self.left, self.right
        housing = self.phi_support
        yield 2 * (drive.phi - housing) == self.ratio * (left.phi + right.phi - 2 * housing)
        yield left.tau == right.tau
        yield 2 * left.tau == -self.ratio * drive.tau
        yield from self.support_torque(drive.tau + left.tau + right.tau)
