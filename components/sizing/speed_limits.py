"""Speed limits of clutches, belts and bearings."""

from __future__ import annotations

import math

from components.sizing.belts import belt_velocity
from modelica_like.language.quantities import Length, Ratio, Speed, Velocity
from modelica_like.language.results import Result, line


class SpeedLimit(Result):
    """Speed of a shaft against its limit."""

    speed: Speed = line("speed", at_most="limit", either_way=True)
    limit: Speed = line("limit of the manufacturer")
    margin: Ratio = line("limit over speed")


def speed_limit(speed: Speed, limit: Speed, ratio: Ratio = 1.0) -> SpeedLimit:
    """Compare a speed behind a gear with its limit: |w/i| ≤ w_max (document 002, section 5.2).

    Args:
        speed: of the driving shaft in rad/s.
        limit: of the driven element in rad/s.
        ratio: speed of the driving shaft over speed of the driven element; negative if it reverses.
    """
    return SpeedLimit(speed / ratio, limit, limit * abs(ratio / speed))


class BeltSpeedLimit(Result):
    """Speed and velocity of a belt against their limits."""

    speed: Speed = line("speed of the small pulley", at_most="limit", either_way=True)
    limit: Speed = line("speed limit of the belt")
    velocity: Velocity = line("velocity of the belt", at_most="velocity_limit", either_way=True)
    velocity_limit: Velocity = line("velocity limit of the belt")


def belt_speed_limit(
    speed: Speed, diameter: Length, limit: Speed = math.inf, velocity_limit: Velocity = math.inf
) -> BeltSpeedLimit:
    """Compare speed and velocity of a belt with their limits (document 002, equation 22).

    Args:
        speed: of the small pulley in rad/s.
        diameter: pitch diameter of the small pulley in m.
        limit: of the speed in rad/s.
        velocity_limit: in m/s.
    """
    return BeltSpeedLimit(speed, limit, belt_velocity(diameter, speed), velocity_limit)
