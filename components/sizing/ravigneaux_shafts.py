"""Speeds, torques and rolling powers of the four shafts of a Ravigneaux set."""

from __future__ import annotations

from collections.abc import Callable

from components.sizing.maths import Number, absolute, settled, sign, where
from modelica_like.language.quantities import Power, Ratio, Speed, Torque
from modelica_like.language.results import Result, line

SMALL_SUN, LARGE_SUN, CARRIER, RING = "small_sun", "large_sun", "carrier", "ring"
MEMBERS = (SMALL_SUN, LARGE_SUN, CARRIER, RING)
Ratios = tuple[Ratio, Ratio]
NO_EFFICIENCY = "The efficiency of a mesh is above 0 and at most 1."
_ROUNDS = 8
"""Three meshes have eight combinations of directions."""


class Shafts(Result):
    """A value of each of the four shafts."""

    small_sun: Number = line("small sun, of the positive-ratio set")
    large_sun: Number = line("large sun, of the negative-ratio set")
    carrier: Number = line("carrier")
    ring: Number = line("ring gear")

    def __getitem__(self, member: str) -> Number:
        return getattr(self, known_shaft(member))


class ShaftSpeeds(Shafts):
    """Speeds of the four shafts."""

    small_sun: Speed = line("small sun")
    large_sun: Speed = line("large sun")
    carrier: Speed = line("carrier")
    ring: Speed = line("ring gear")


class ShaftTorques(Shafts):
    """Torques on the four shafts, from outside on the set."""

    small_sun: Torque = line("small sun")
    large_sun: Torque = line("large sun")
    carrier: Torque = line("carrier")
    ring: Torque = line("ring gear")


def known_shaft(member: str) -> str:
    """Return the name of a shaft.

    Raises:
        ValueError: there is no such shaft.
    """
    if member not in MEMBERS:
        raise ValueError(f"'{member}' is not a shaft of a Ravigneaux set; there are {', '.join(MEMBERS)}.")
    return member


def _two_by_two(first: tuple[Number, Number, Number], second: tuple[Number, Number, Number]) -> tuple[Number, Number]:
    """Solve a·x + b·y = c for two equations (a, b, c)."""
    (a, b, c), (d, e, f) = first, second
    determinant = a * e - b * d
    return (c * e - b * f) / determinant, (a * f - c * d) / determinant


def _willis(member: str, small: Ratio, large: Ratio) -> tuple[Number, Number]:
    """Return the coefficients of carrier and ring speed in the speed of a shaft (Willis)."""
    rows = {SMALL_SUN: (1 - small, small), LARGE_SUN: (1 - large, large), CARRIER: (1.0, 0.0), RING: (0.0, 1.0)}
    return rows[known_shaft(member)]


def shaft_speeds(small: Ratio, large: Ratio, first: tuple[str, Speed], second: tuple[str, Speed]) -> ShaftSpeeds:
    """Work out all speeds from two of them (Willis): n_s - n_c = i0·(n_h - n_c) for each sun.

    Args:
        small: fixed-carrier ratio of the small sun, speed of the sun over speed of the ring, z_h/z_s > 0.
        large: that of the large sun, -z_h/z_s < 0.
        first: a shaft and its speed in rad/s.
        second: another shaft and its speed.

    Raises:
        ValueError: there is no such shaft, or the two are one.
    """
    if first[0] == second[0]:
        raise ValueError(f"The speeds of two different shafts are needed, not twice that of the {first[0]}.")
    rows = [(*_willis(member, small, large), speed) for member, speed in (first, second)]
    carrier, ring = _two_by_two(rows[0], rows[1])
    shares = [_willis(member, small, large) for member in MEMBERS]
    return ShaftSpeeds(*(_sum(a * carrier, b * ring) for a, b in shares))


def shaft_torques(small: Ratio, large: Ratio, first: tuple[str, Torque], second: tuple[str, Torque]) -> ShaftTorques:
    """Work out all torques from two of them, in steady state.

    T_h = -(i0·T_s + i0'·T_s') and T_s + T_s' + T_h + T_c = 0. With losses the ratios are those of the torques.

    Args:
        small: ratio of the torques of ring and small sun.
        large: ratio of the torques of ring and large sun.
        first: a shaft and its torque in N.m; of an idle shaft 0.
        second: another shaft and its torque.
    """
    rows = {
        SMALL_SUN: (1.0, 0.0), LARGE_SUN: (0.0, 1.0), CARRIER: (small - 1, large - 1), RING: (-small, -large)
    }  # fmt: skip
    equations = [(*rows[known_shaft(member)], torque) for member, torque in (first, second)]
    a, b = _two_by_two(equations[0], equations[1])
    return ShaftTorques(*(_sum(rows[member][0] * a, rows[member][1] * b) for member in MEMBERS))


def _sum(first: Number, second: Number) -> Number:
    return settled(first + second, absolute(first) + absolute(second))


def rolling_powers(speeds: ShaftSpeeds, torques: ShaftTorques) -> tuple[Power, Power]:
    """Return the rolling powers T·(w - w_c) in W of the small and the large sun."""
    small = torques.small_sun * _sum(speeds.small_sun, -speeds.carrier)
    return small, torques.large_sun * _sum(speeds.large_sun, -speeds.carrier)


def powers_in_meshes(speeds: ShaftSpeeds, torques: ShaftTorques) -> tuple[Power, Power, Power]:
    """Return the rolling powers in W of the small and the large sun, and that which leaves at the ring."""
    return *rolling_powers(speeds, torques), -torques.ring * _sum(speeds.ring, -speeds.carrier)


def lossy_ratios(small: Ratio, large: Ratio, powers: tuple[Power, Power, Power], mesh: Ratio) -> Ratios:
    """Return the ratios of the torques with losses in the meshes.

    Rolling power passes two meshes from the small sun to the long planet and one from the large sun; their sum
    passes one more to the ring. Each mesh loses 1 - eta of the power that enters it.

    Args:
        small: fixed-carrier ratio of the small sun.
        large: fixed-carrier ratio of the large sun.
        powers: `powers_in_meshes`, for their directions; `settle_directions` finds those with losses.
        mesh: efficiency of a mesh.
    """
    scale = absolute(powers[0]) + absolute(powers[1])
    first, second, total = (sign_of(power, scale) for power in powers)
    return small * mesh ** (2 * first + total), large * mesh ** (second + total)


def settle_directions(find: Callable[[Ratios], ShaftTorques], ratios_of: Callable[[ShaftTorques], Ratios],
                      lossless: Ratios) -> tuple[ShaftTorques, Number]:  # fmt: skip
    """Return the torques with losses, and whether power flows in every mesh as their losses assume.

    Losses may turn a direction: that of a small rolling power beside a large one.

    Args:
        find: torques of the shafts for ratios of the torques.
        ratios_of: ratios with losses for torques of the shafts.
        lossless: ratios without losses.
    """
    torques, used = find(lossless), lossless
    ratios = ratios_of(torques)
    for _ in range(_ROUNDS):
        torques, used = find(ratios), ratios
        ratios = ratios_of(torques)
    return torques, (ratios[0] == used[0]) * (ratios[1] == used[1])


def rolling_in_meshes(rolling: tuple[Power, Power]) -> Power:
    """Return the rolling power in W summed over all meshes: two of the small sun, one of the large one, the ring's."""
    return 2 * absolute(rolling[0]) + absolute(rolling[0] + rolling[1]) + absolute(rolling[1])


def sign_of(value: Number, scale: Number) -> Number:
    """Return the sign of a value; 0 for rounding in a difference, 1e-9 of the scale."""
    return where(absolute(value) > 1e-9 * absolute(scale), sign(value), 0.0)
