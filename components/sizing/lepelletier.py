"""Lepelletier gearboxes: a planetary set in front of a Ravigneaux set; speeds, ratios, torques and efficiency."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from components.sizing.maths import absolute, require, where
from components.sizing.ravigneaux_shafts import (
    CARRIER,
    LARGE_SUN,
    MEMBERS,
    NO_EFFICIENCY,
    RING,
    SMALL_SUN,
    ShaftSpeeds,
    ShaftTorques,
    lossy_ratios,
    powers_in_meshes,
    rolling_in_meshes,
    rolling_powers,
    settle_directions,
    shaft_speeds,
    shaft_torques,
    sign_of,
)
from modelica_like.language.quantities import Power, Ratio, Speed, Torque
from modelica_like.language.results import Result, line


@dataclass(frozen=True)
class ShiftPattern:
    """Connections in one gear.

    Attributes:
        front: shafts of the Ravigneaux set that the front set drives.
        direct: the shaft that the input drives directly, if any.
        brake: the shaft that is held, if any.
    """

    front: tuple[str, ...] = ()
    direct: str = ""
    brake: str = ""

    @property
    def idle(self) -> str:
        """The shaft that idles."""
        return next(member for member in MEMBERS if member not in (*self.front, self.direct, self.brake, RING))


GEARS = {
    "1": ShiftPattern(front=(SMALL_SUN,), brake=CARRIER),
    "2": ShiftPattern(front=(SMALL_SUN,), brake=LARGE_SUN),
    "3": ShiftPattern(front=(SMALL_SUN, LARGE_SUN)),
    "4": ShiftPattern(front=(SMALL_SUN,), direct=CARRIER),
    "5": ShiftPattern(front=(LARGE_SUN,), direct=CARRIER),
    "6": ShiftPattern(direct=CARRIER, brake=LARGE_SUN),
    "R": ShiftPattern(front=(LARGE_SUN,), brake=CARRIER),
}
"""Shift pattern of the six-speed gearbox of document 001 (ZF 6HP26).

The document's third gear has the carrier at the speed of the front set, but no element can connect the two; driving
both suns gives the same speeds."""


class LepelletierGear(Result):
    """One gear of a Lepelletier gearbox."""

    gear: str = line("gear")
    ratio: Ratio = line("speed of the input over speed of the output")
    output_speed: Speed = line("speed of the ring gear, the output")
    small_sun_speed: Speed = line("speed of the small sun")
    large_sun_speed: Speed = line("speed of the large sun")
    carrier_speed: Speed = line("speed of the carrier")
    small_sun_torque: Torque = line("torque on the small sun")
    large_sun_torque: Torque = line("torque on the large sun")
    carrier_torque: Torque = line("torque on the carrier")
    output_torque: Torque = line("torque on the ring gear, from the output")
    inner_rolling_power: Power = line("rolling power of the small sun")
    outer_rolling_power: Power = line("rolling power of the large sun")
    front_rolling_power: Power = line("rolling power of the front set")
    efficiency: Ratio = line("efficiency with the torques that the losses leave; nan if power can flow in no way")
    first_order_efficiency: Ratio = line("efficiency with losses of the loss-free rolling powers")


class Lepelletier(Result):
    """All gears of a Lepelletier gearbox."""

    front_speed: Speed = line("speed of the front set's carrier")
    spread: Ratio = line("ratio of the lowest over ratio of the highest gear")
    steps: tuple[Ratio, ...] = line("steps between the ratios of the forward gears")
    gears: tuple[LepelletierGear, ...] = line("gears")


def front_speed(input_speed: Speed, front_ratio: Ratio) -> Speed:
    """Return the speed in rad/s of the front carrier, ring driven and sun held: w·i0/(i0 - 1) (Willis)."""
    return input_speed * front_ratio / (front_ratio - 1)


def lepelletier(
    input_speed: Speed, input_torque: Torque, front_ratio: Ratio, small_ratio: Ratio, large_ratio: Ratio,
    mesh_efficiency: Ratio = 1.0,
) -> Lepelletier:  # fmt: skip
    """Work out all gears of a Lepelletier gearbox (document 001, table of speeds; Willis).

    Args:
        input_speed: in rad/s.
        input_torque: in N.m.
        front_ratio: fixed-carrier ratio of the front set, -z_ring/z_sun.
        small_ratio: fixed-carrier ratio of the Ravigneaux set's small sun, z_ring/z_sun.
        large_ratio: that of its large sun, -z_ring/z_sun.
        mesh_efficiency: of each mesh; the torques of the table have no losses.
    """
    gears = tuple(
        lepelletier_gear(gear, input_speed, input_torque, front_ratio, small_ratio, large_ratio, mesh_efficiency)
        for gear in GEARS
    )
    forward = [gear.ratio for gear in gears if gear.gear != "R"]
    steps = tuple(low / high for low, high in itertools.pairwise(forward))
    return Lepelletier(front_speed(input_speed, front_ratio), forward[0] / forward[-1], steps, gears)


def lepelletier_gear(
    gear: str, input_speed: Speed, input_torque: Torque, front_ratio: Ratio, small_ratio: Ratio, large_ratio: Ratio,
    mesh_efficiency: Ratio = 1.0,
) -> LepelletierGear:  # fmt: skip
    """Work out one gear of a Lepelletier gearbox; see `lepelletier`.

    Raises:
        ValueError: there is no such gear, or the efficiency is none.
    """
    require(NO_EFFICIENCY, mesh_efficiency > 0, mesh_efficiency <= 1)
    if gear not in GEARS:
        raise ValueError(f"There is no gear '{gear}'; there are {', '.join(GEARS)}.")
    pattern, front = GEARS[gear], front_speed(input_speed, front_ratio)
    speeds = _speeds(pattern, input_speed, front, small_ratio, large_ratio)
    torques, ring = _torques(pattern, input_torque, 1 - 1 / front_ratio, (small_ratio, large_ratio))
    rolling, front_rolling = rolling_powers(speeds, torques), ring * (input_speed - front)
    total = rolling_in_meshes(rolling) + 2 * absolute(front_rolling)
    carrier_over_ring = 1 - mesh_efficiency ** (2 * sign_of(ring, input_torque)) / front_ratio
    lossy, settled = settle_directions(
        lambda ratios: _torques(pattern, input_torque, carrier_over_ring, ratios)[0],
        lambda found: lossy_ratios(small_ratio, large_ratio, powers_in_meshes(speeds, found), mesh_efficiency),
        (small_ratio, large_ratio),
    )
    power = input_torque * input_speed
    return LepelletierGear(
        gear, input_speed / speeds.ring, speeds.ring, speeds.small_sun, speeds.large_sun, speeds.carrier,
        torques.small_sun, torques.large_sun, torques.carrier, torques.ring, *rolling, front_rolling,
        where(settled, -lossy.ring * speeds.ring / power, math.nan), 1 - (1 - mesh_efficiency) * total / power,
    )  # fmt: skip


def _speeds(pattern: ShiftPattern, driving: Speed, front: Speed, small: Ratio, large: Ratio) -> ShaftSpeeds:
    speeds = [(member, front) for member in pattern.front]
    speeds += [(pattern.direct, driving)] if pattern.direct else []
    speeds += [(pattern.brake, 0.0 * driving)] if pattern.brake else []
    return shaft_speeds(small, large, speeds[0], speeds[1])


def _torques(
    pattern: ShiftPattern, driving: Torque, carrier_over_ring: Ratio, ratios: tuple[Ratio, Ratio]
) -> tuple[ShaftTorques, Torque]:
    """Return the torques of the Ravigneaux set, and that of the front set's ring.

    They are proportional to the output torque; the input supplies the front set's ring and the shaft driven directly.
    """
    unit = shaft_torques(*ratios, (RING, -1.0), (pattern.idle, 0.0))
    front = sum(unit[member] for member in pattern.front) / carrier_over_ring
    scale = driving / (front + (unit[pattern.direct] if pattern.direct else 0.0))
    return ShaftTorques(*(unit[member] * scale for member in MEMBERS)), front * scale
