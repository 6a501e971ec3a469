"""Deflection of shafts under a force in the middle between two bearings."""

from __future__ import annotations

import math

from components.sizing.maths import Number, require
from modelica_like.language.quantities import Force, Length, Mass, Ratio, Sag, Stress
from modelica_like.language.results import Result, line

GRAVITY = 9.81
STEEL: Stress = 210e9


def square_second_moment(side: Length) -> Number:
    """Return the second moment of area in m4 of a square section: s⁴/12 (document 002, equation 46)."""
    return side**4 / 12


def round_second_moment(diameter: Length) -> Number:
    """Return the second moment of area in m4 of a round section: pi·d⁴/64."""
    return math.pi * diameter**4 / 64


def midspan_sag(force: Force, span: Length, second_moment: Number, modulus: Stress = STEEL) -> Sag:
    """Return the sag in m under a force in the middle: F·l³/(48·E·I) (document 002, equation 45).

    Args:
        force: in N.
        span: distance of the bearings in m.
        second_moment: of the section in m4.
        modulus: Young's modulus in Pa.
    """
    return force * span**3 / (48 * modulus * second_moment)


class Deflection(Result):
    """Sag of a shaft under a mass in the middle."""

    weight: Force = line("weight of the mass")
    span: Length = line("distance of the bearings")
    sag: Sag = line("sag in the middle")
    relative_sag: Ratio = line("sag over span")


def deflection(mass: Mass, span: Length, side: Length, modulus: Stress = STEEL) -> Deflection:
    """Work out the sag of a square shaft: m·g·l³/(4·E·s⁴) (document 002, equation 47).

    The span is the distance of the bearings, 175 mm; the document uses the length of the square piece, 105 mm.

    Args:
        mass: in kg.
        span: in m.
        side: of the square in m.
        modulus: Young's modulus in Pa.

    Raises:
        ValueError: something is not above zero.
    """
    require(
        "Mass, span, side and modulus of a shaft that sags are positive.", mass > 0, span > 0, side > 0, modulus > 0
    )
    weight = mass * GRAVITY
    sag = midspan_sag(weight, span, square_second_moment(side), modulus)
    return Deflection(weight, span, sag, sag / span)
