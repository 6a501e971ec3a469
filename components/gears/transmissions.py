"""Compound planetary sets and automatic gearboxes."""

from __future__ import annotations

from components import icons
from components.clutches.friction import Brake, Clutch
from components.gears.planetary import LossyPlanetarySet, PlanetarySet
from components.interfaces import Flange
from components.mechanics.fixed import Fixed
from components.mechanics.inertias import Inertia
from modelica_like.language import Component, Equations, Input, LanguageError, Parameter, connect, param, signal_in


class WithPlanetarySets(Component, partial=True):
    """Assembly of planetary sets, with or without losses in the teeth."""

    losses: bool = False
    """The meshes lose power."""
    mesh_efficiency: Parameter = param("1", "efficiency of one mesh, with `losses`", min=1e-3, max=1)

    def planetary_set(self, i0: str, meshes: int) -> PlanetarySet:
        """Return a set in which rolling power passes some meshes, one after the other."""
        if self.losses:
            return LossyPlanetarySet(i0=i0, efficiency=f"mesh_efficiency ** {meshes}")
        return PlanetarySet(i0=i0)

    def equations(self) -> Equations:
        yield from super().equations()
        if self.given("mesh_efficiency") and not self.losses:
            raise LanguageError(
                f"{self.label} has a mesh_efficiency, but no losses.",
                advice="Set `losses = true`, or remove the efficiency.",
            )


class Ravigneaux(WithPlanetarySets):
    """Ravigneaux set: two suns, long and short planets on one carrier, one ring.

    The small sun drives the long planets through the short ones, the large sun directly; the long planets mesh with the
    ring. So it consists of a plus set and a minus set that share carrier and ring (document 001, after HEXAGON: two
    Willis equations). Here the meshes of each sun end at the long planets, treated as a separate ring; the mesh of long
    planet and ring is a third set with i0 = 1, because it transmits only the sum of both rolling powers.
    """

    icon = icons.RAVIGNEAUX
    small_sun = Flange("small sun, in mesh with the short planets")
    large_sun = Flange("large sun, in mesh with the long planets")
    carrier = Flange("common carrier")
    ring = Flange("common ring gear")
    inlet, outlet = "small_sun", "ring"
    small_ratio: Parameter = param("1", "fixed-carrier ratio of the small sun, number of teeth ring/sun", min=1e-12)
    large_ratio: Parameter = param("1", "fixed-carrier ratio of the large sun, number of teeth -ring/sun", max=-1e-12)

    def build(self) -> None:
        self.small = self.planetary_set("small_ratio", meshes=2)
        self.large = self.planetary_set("large_ratio", meshes=1)
        self.long_planet = self.planetary_set("1", meshes=1)

    def equations(self) -> Equations:
        yield from super().equations()
        small, large, planet = self.small, self.large, self.long_planet
        yield connect(self.small_sun, small.sun)
        yield connect(self.large_sun, large.sun)
        yield connect(small.ring, large.ring, planet.sun)
        yield connect(self.ring, planet.ring)
        yield connect(self.carrier, small.carrier, large.carrier, planet.carrier)


class Lepelletier(WithPlanetarySets):
    """Six-speed automatic gearbox after P. Lepelletier, as the ZF 6HP26: a planetary set before a Ravigneaux set.

    The input drives the ring of the front set, whose sun is fixed; its carrier turns more slowly. Clutch A joins that
    carrier with the small sun of the Ravigneaux set, clutch B with the large sun; clutch E joins the input with the
    common carrier. Brake C holds the large sun, brake D the common carrier. The ring is the output. Each gear has
    two of the five closed: 1 AD, 2 AC, 3 AB, 4 AE, 5 BE, 6 CE, R BD (document 001). Torques of brakes and clutches
    follow `pressure`: 0 open, 1 capacity.
    """

    flange_a = Flange("input shaft")
    flange_b = Flange("output shaft")
    front_ratio: Parameter = param("1", "fixed-carrier ratio of the front set, number of teeth -ring/sun")
    small_ratio: Parameter = param("1", "fixed-carrier ratio of the small sun, number of teeth ring/sun", min=1e-12)
    large_ratio: Parameter = param("1", "fixed-carrier ratio of the large sun, number of teeth -ring/sun", max=-1e-12)
    J_small_sun: Parameter = param("kg.m2", "moment of inertia of the small sun and what turns with it", min=0)
    J_large_sun: Parameter = param("kg.m2", "moment of inertia of the large sun and what turns with it", min=0)
    J_carrier: Parameter = param("kg.m2", "moment of inertia of the common carrier", min=0)
    pressure_a: Input = signal_in("1", "pressure of clutch A", default=0.0)
    pressure_b: Input = signal_in("1", "pressure of clutch B", default=0.0)
    pressure_c: Input = signal_in("1", "pressure of brake C", default=0.0)
    pressure_d: Input = signal_in("1", "pressure of brake D", default=0.0)
    pressure_e: Input = signal_in("1", "pressure of clutch E", default=0.0)
    clutch_a: Clutch = Clutch()
    clutch_b: Clutch = Clutch()
    brake_c: Brake = Brake()
    brake_d: Brake = Brake()
    clutch_e: Clutch = Clutch()
    small_sun = Inertia(J="J_small_sun")
    large_sun = Inertia(J="J_large_sun")
    carrier = Inertia(J="J_carrier")

    def build(self) -> None:
        self.front = self.planetary_set("front_ratio", meshes=2)
        self.housing = Fixed()
        inherited = {"mesh_efficiency": "mesh_efficiency"} if self.losses else {}
        self.ravigneaux = Ravigneaux(
            losses=self.losses, small_ratio="small_ratio", large_ratio="large_ratio", **inherited
        )

    def equations(self) -> Equations:
        yield from super().equations()
        front, set_ = self.front, self.ravigneaux
        yield connect(self.flange_a, front.ring, self.clutch_e.flange_a)
        yield connect(front.sun, self.housing.flange)
        yield connect(front.carrier, self.clutch_a.flange_a, self.clutch_b.flange_a)
        yield connect(self.clutch_a.flange_b, self.small_sun.flange_a)
        yield connect(self.small_sun.flange_b, set_.small_sun)
        yield connect(self.clutch_b.flange_b, self.large_sun.flange_a, self.brake_c.flange_a)
        yield connect(self.large_sun.flange_b, set_.large_sun)
        yield connect(self.clutch_e.flange_b, self.carrier.flange_a, self.brake_d.flange_a)
        yield connect(self.carrier.flange_b, set_.carrier)
        yield connect(set_.ring, self.flange_b)
        pressures = (self.pressure_a, self.pressure_b, self.pressure_c, self.pressure_d, self.pressure_e)
        elements = (self.clutch_a, self.clutch_b, self.brake_c, self.brake_d, self.clutch_e)
        for pressure, element in zip(pressures, elements, strict=True):
            yield connect(pressure, element.f_normalized)
