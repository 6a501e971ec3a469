"""Rolling bearings: static safety and rating life."""

from __future__ import annotations

import math

import numpy as np

from modelica_like.language.quantities import Force, Life, Ratio, Revolutions, Speed
from modelica_like.language.results import Result, line


class BearingLife(Result):
    """Static safety and life of a rolling bearing."""

    equivalent_load: Force = line("equivalent load X·F_r + Y·F_a")
    static_safety: Ratio = line("static load rating over equivalent load", at_least="required_safety")
    required_safety: Ratio = line("required static safety")
    life_revolutions: Revolutions = line("rating life L10")
    life: Life = line("rating life L10h")
    speed: Speed = line("speed", at_most="speed_limit", either_way=True)
    speed_limit: Speed = line("speed limit of the bearing")


def bearing_life(
    radial_load: Force, speed: Speed, dynamic_rating: Force, static_rating: Force, speed_limit: Speed = math.inf,
    exponent: Ratio = 3.0, axial_load: Force = 0.0, radial_factor: Ratio = 1.0, axial_factor: Ratio = 0.0,
    required_safety: Ratio = 1.0,
) -> BearingLife:  # fmt: skip
    """Work out static safety and life (ISO 281, Roloff/Matek; document 002, equations 37 to 39).

    S0 = C0/P, L10 = 1e6·(C/P)^p revolutions, L10h = L10/n. P is also the static equivalent load.

    Args:
        radial_load: in N.
        speed: in rad/s.
        dynamic_rating: dynamic load rating C in N.
        static_rating: static load rating C0 in N.
        speed_limit: in rad/s.
        exponent: 3 for ball bearings, 10/3 for roller bearings.
        axial_load: in N.
        radial_factor: X.
        axial_factor: Y.
        required_safety: smallest static safety.
    """
    load = radial_factor * abs(radial_load) + axial_factor * abs(axial_load)
    # What carries nothing, or does not turn, lasts for ever.
    with np.errstate(divide="ignore"):
        safety, turns = np.divide(static_rating, load), 1e6 * np.divide(dynamic_rating, load) ** exponent
        life = 2 * math.pi * np.divide(turns, abs(speed))
    return BearingLife(
        equivalent_load=load, static_safety=safety, required_safety=required_safety, life_revolutions=turns, life=life,
        speed=speed, speed_limit=speed_limit,
    )  # fmt: skip
