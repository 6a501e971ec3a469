"""Ravigneaux sets: torque, speed and power of every mesh, efficiency, conditions of assembly."""

from __future__ import annotations

import math
from dataclasses import dataclass

from components.sizing.maths import absolute, floor, require, where
from components.sizing.ravigneaux_shafts import (
    CARRIER,
    LARGE_SUN,
    MEMBERS,
    NO_EFFICIENCY,
    RING,
    SMALL_SUN,
    ShaftTorques,
    known_shaft,
    lossy_ratios,
    powers_in_meshes,
    rolling_in_meshes,
    rolling_powers,
    settle_directions,
    shaft_speeds,
    shaft_torques,
)
from modelica_like.language.quantities import Power, Ratio, Speed, Teeth, Torque
from modelica_like.language.results import Result, line


@dataclass(frozen=True)
class RavigneauxTeeth:
    """Numbers of teeth.

    Attributes:
        small_sun: sun of the positive-ratio set, in mesh with the short planets.
        large_sun: sun of the negative-ratio set, in mesh with the long planets.
        short_planet: between small sun and long planet.
        long_planet: in mesh with the ring.
        ring: internal gear, positive number.
        planets: number of planets of each kind.
    """

    small_sun: Teeth
    large_sun: Teeth
    short_planet: Teeth
    long_planet: Teeth
    ring: Teeth
    planets: Teeth = 3.0

    @property
    def ratios(self) -> tuple[Ratio, Ratio]:
        """Fixed-carrier ratios of the small and the large sun."""
        return self.ring / self.small_sun, -self.ring / self.large_sun


class Mesh(Result):
    """One mesh of a planetary set: its pinion's torque, speed and power, relative to the carrier."""

    mesh: str = line("pair of gears")
    pinion: str = line("the smaller one")
    torque: Torque = line("torque of the pinion")
    speed: Speed = line("speed of the pinion relative to the carrier")
    power: Power = line("rolling power of the mesh")


class RavigneauxGear(Result):
    """A Ravigneaux set in one gear."""

    ratio: Ratio = line("speed of the input over speed of the output")
    input_power: Power = line("power of the input")
    small_sun_speed: Speed = line("speed of the small sun")
    large_sun_speed: Speed = line("speed of the large sun")
    carrier_speed: Speed = line("speed of the carrier")
    ring_speed: Speed = line("speed of the ring gear")
    short_planet_speed: Speed = line("speed of the short planets relative to the carrier")
    long_planet_speed: Speed = line("speed of the long planets relative to the carrier")
    small_sun_torque: Torque = line("torque on the small sun")
    large_sun_torque: Torque = line("torque on the large sun")
    carrier_torque: Torque = line("torque on the carrier")
    ring_torque: Torque = line("torque on the ring gear")
    inner_ring_torque: Torque = line("part of the ring torque from the small sun")
    outer_ring_torque: Torque = line("part of the ring torque from the large sun")
    inner_carrier_torque: Torque = line("part of the carrier torque from the small sun")
    outer_carrier_torque: Torque = line("part of the carrier torque from the large sun")
    inner_rolling_power: Power = line("rolling power of the small sun")
    outer_rolling_power: Power = line("rolling power of the large sun")
    efficiency: Ratio = line("efficiency with the torques that the losses leave; nan if power can flow in no way")
    first_order_efficiency: Ratio = line("efficiency with losses of the loss-free rolling powers")
    meshes: tuple[Mesh, ...] = line("meshes")


def ravigneaux_gear(
    teeth: RavigneauxTeeth, input_speed: Speed, input_torque: Torque, input: str = SMALL_SUN,
    brake: str = LARGE_SUN, output: str = RING, mesh_efficiency: Ratio = 1.0, load_sharing: Ratio = 1.0,
) -> RavigneauxGear:  # fmt: skip
    """Work out one gear of a Ravigneaux set: speeds, torques and powers of shafts and meshes.

    The shaft that is neither input, brake nor output idles. Rolling power P = T·(w - w_c); torque and power of a mesh
    are those of its pinion, shared by the planets (document 001, after HEXAGON; Willis). Without a brake it is the
    direct gear: both suns are driven, everything turns as one and no mesh rolls.

    Args:
        teeth: numbers of teeth.
        input_speed: in rad/s.
        input_torque: in N.m.
        input: the driving shaft: small_sun, large_sun, carrier or ring.
        brake: the fixed shaft; empty for the direct gear.
        output: the driven shaft.
        mesh_efficiency: of each mesh, for the efficiencies; torques and powers of the table have no losses.
        load_sharing: factor K_gamma of uneven loads of the planets.

    Raises:
        ValueError: the shafts are not three different ones, or the efficiency is none.
    """
    require(NO_EFFICIENCY, mesh_efficiency > 0, mesh_efficiency <= 1)
    idle = _idle(input, brake, output) if brake else CARRIER
    small, large = teeth.ratios
    held = (brake, 0.0 * input_speed) if brake else (CARRIER, input_speed)
    loaded = ((input, input_torque) if brake else (output, -input_torque), (idle, 0.0 * input_torque))
    speeds = shaft_speeds(small, large, (input, input_speed), held)
    torques = shaft_torques(small, large, *loaded)
    rolling = rolling_powers(speeds, torques)
    lossy, settled = settle_directions(
        lambda ratios: shaft_torques(*ratios, *loaded),
        lambda found: lossy_ratios(small, large, powers_in_meshes(speeds, found), mesh_efficiency), (small, large),
    )  # fmt: skip
    power = input_torque * input_speed
    lost = (1 - mesh_efficiency) * rolling_in_meshes(rolling)
    short = -(speeds.small_sun - speeds.carrier) * teeth.small_sun / teeth.short_planet
    long = -short * teeth.short_planet / teeth.long_planet
    return RavigneauxGear(
        input_speed / speeds[output], power, speeds.small_sun, speeds.large_sun, speeds.carrier, speeds.ring, short,
        long, torques.small_sun, torques.large_sun, torques.carrier, torques.ring, -small * torques.small_sun,
        -large * torques.large_sun, (small - 1) * torques.small_sun, (large - 1) * torques.large_sun, *rolling,
        where(settled, -lossy[output] * speeds[output] / power, math.nan), 1 - lost / power,
        ravigneaux_meshes(teeth, torques, rolling, (short, long), load_sharing),
    )  # fmt: skip


def _idle(driving: str, brake: str, output: str) -> str:
    left = [
        member for member in MEMBERS if member not in (known_shaft(driving), known_shaft(brake), known_shaft(output))
    ]
    if len(left) != 1:
        raise ValueError(f"Input, brake and output are three different shafts, not {driving}, {brake} and {output}.")
    return left[0]


def ravigneaux_meshes(
    teeth: RavigneauxTeeth, torques: ShaftTorques, rolling: tuple[Power, Power], planets: tuple[Speed, Speed],
    load_sharing: Ratio = 1.0,
) -> tuple[Mesh, ...]:  # fmt: skip
    """Return torque, speed and power of the pinion of each mesh.

    The tangential force of a mesh is that of the shaft's torque at its pitch circle; the pinion is the gear with fewer
    teeth (document 001, after HEXAGON).

    Args:
        teeth: numbers of teeth, plain numbers.
        torques: of the shafts.
        rolling: rolling powers of the small and the large sun.
        planets: speeds of short and long planets relative to the carrier.
        load_sharing: factor K_gamma.

    Raises:
        ValueError: the ring has fewer teeth than the long planet.
    """
    if teeth.ring <= teeth.long_planet:
        raise ValueError(f"A ring of {teeth.ring:g} teeth cannot hold planets of {teeth.long_planet:g}.")
    share = load_sharing / teeth.planets
    short, long = absolute(planets[0]), absolute(planets[1])
    force_small = absolute(torques.small_sun) * share / teeth.small_sun
    force_large = absolute(torques.large_sun) * share / teeth.large_sun
    speeds = {
        "small sun": short * teeth.short_planet / teeth.small_sun, "short planet": short, "long planet": long,
        "large sun": long * teeth.long_planet / teeth.large_sun,
    }  # fmt: skip
    pairs = [
        (("small sun", teeth.small_sun), ("short planet", teeth.short_planet), force_small, rolling[0]),
        (("short planet", teeth.short_planet), ("long planet", teeth.long_planet), force_small, rolling[0]),
        (("long planet", teeth.long_planet), ("ring", teeth.ring), absolute(torques.ring) * share / teeth.ring,
         rolling[0] + rolling[1]),
        (("large sun", teeth.large_sun), ("long planet", teeth.long_planet), force_large, rolling[1]),
    ]  # fmt: skip
    meshes = []
    for first, second, force, power in pairs:
        name, count = min(second, first, key=lambda gear: gear[1])
        mesh = f"{first[0]} – {second[0]}"
        meshes.append(Mesh(mesh, name, force * count, speeds[name], absolute(power) * share))
    return tuple(meshes)


class RavigneauxAssembly(Result):
    """Whether a Ravigneaux set can be assembled."""

    outer_step: Ratio = line("(z_ring + z_large_sun)/planets, a whole number")
    outer_fits: bool = line("long planets can be spaced evenly", required=True)
    inner_step: Ratio = line("(z_ring - z_small_sun)/planets, a whole number")
    inner_fits: bool = line("short planets can be spaced evenly", required=True)
    ring_distance: Ratio = line("centre distance of ring and long planet in modules")
    sun_distance: Ratio = line("centre distance of large sun and long planet in modules")
    profile_shift: Ratio = line("difference that profile shift has to bridge, in modules")


def ravigneaux_assembly(teeth: RavigneauxTeeth) -> RavigneauxAssembly:
    """Check the conditions of assembly of a Ravigneaux set with evenly spaced planets (Willis; VDI 2157).

    (z_h + z_se)/q and (z_h - z_si)/q are whole numbers. The centre distances of the long planet's two meshes differ by
    (z_h - z_se - 2·z_pe)/2 modules, to be bridged by profile shift.

    Args:
        teeth: numbers of teeth.
    """
    outer = (teeth.ring + teeth.large_sun) / teeth.planets
    inner = (teeth.ring - teeth.small_sun) / teeth.planets
    ring, sun = (teeth.ring - teeth.long_planet) / 2, (teeth.large_sun + teeth.long_planet) / 2
    return RavigneauxAssembly(outer, outer == floor(outer), inner, inner == floor(inner), ring, sun, ring - sun)
