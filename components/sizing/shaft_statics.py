"""Bearing reactions and section forces of shafts, in two planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from components.sizing.maths import Number, hypot, is_symbolic, maximum, settled, solve, where
from modelica_like.language.quantities import Force, Length, SmallTorque, Torque
from modelica_like.language.results import Result, line

Positions = tuple[Length, ...]


@dataclass(frozen=True)
class Load:
    """The load on a shaft at one place.

    Attributes:
        at: position along the shaft in m.
        y: force in the y direction in N.
        z: force in the z direction in N.
        torque: about the axis in N.m.
        bend_y: couple in the x-y plane in N.m, positive where it adds to `bending_y`; of a helical gear's axial force.
        bend_z: couple in the x-z plane in N.m.
    """

    at: Length
    y: Force = 0.0
    z: Force = 0.0
    torque: Torque = 0.0
    bend_y: Torque = 0.0
    bend_z: Torque = 0.0


class BearingReaction(Result):
    """Force of a bearing on the shaft."""

    at: Length = line("position")
    y: Force = line("force on the shaft in y")
    z: Force = line("force on the shaft in z")
    radial: Force = line("radial load of the bearing")


class SectionForces(Result):
    """Section forces on one side of a cut."""

    at: Length = line("position")
    side: str = line("left or right of the load")
    shear_y: Force = line("shear force in y")
    shear_z: Force = line("shear force in z")
    bending_y: SmallTorque = line("bending moment in the x-y plane")
    bending_z: SmallTorque = line("bending moment in the x-z plane")
    bending: SmallTorque = line("resultant bending moment")
    torque: SmallTorque = line("torsional moment")


class ShaftStatics(Result):
    """Bearing reactions and section forces of a shaft."""

    reactions: tuple[BearingReaction, ...] = line("bearings")
    diagram: tuple[SectionForces, ...] = line("section forces")
    largest_radial: Force = line("largest radial load of a bearing")
    largest_bending: SmallTorque = line("largest resultant bending moment")
    place: Length = line("its position")
    largest_torque: SmallTorque = line("largest torsional moment")
    unbalanced_torque: SmallTorque = line("sum of all torques, zero in steady state")


def bearing_reactions(
    loads: Sequence[Load], bearings: Sequence[Length], hinges: Sequence[Length] = ()
) -> tuple[BearingReaction, ...]:
    """Work out the bearing forces of a statically determinate shaft from the equilibrium in both planes.

    Sum of forces, sum of moments about the first bearing, and no bending moment in each hinge.

    Args:
        loads: on the shaft.
        bearings: positions of the bearings in m, two more than hinges.
        hinges: positions in m of joints that transmit shear forces and no bending moment.

    Raises:
        ValueError: the shaft is statically indeterminate, or it can move.
    """
    if len(bearings) != 2 + len(hinges):
        raise ValueError(
            f"A shaft with {len(hinges)} hinges is statically determinate with {2 + len(hinges)} bearings, "
            f"not with {len(bearings)}."
        )
    origin = bearings[0]
    rows = [[1.0 for _ in bearings], [at - origin for at in bearings]]
    rows += [[maximum(hinge - at, 0.0) for at in bearings] for hinge in hinges]
    planes = []
    for force, couple in (("y", "bend_y"), ("z", "bend_z")):
        right = [
            -sum(getattr(load, force) for load in loads),
            -sum(getattr(load, force) * (load.at - origin) - getattr(load, couple) for load in loads),
        ]
        right += [-_bending(hinge, loads, force, couple, False) for hinge in hinges]
        planes.append(_solved(rows, right))
    return tuple(BearingReaction(at, y, z, hypot(y, z)) for at, y, z in zip(bearings, *planes, strict=True))


def _solved(rows: Sequence[Sequence[Number]], right: Sequence[Number]) -> list[Number]:
    try:
        return solve(rows, right)
    except ValueError:
        raise ValueError("The bearings and hinges do not hold the shaft: it can move without deforming.") from None


def shaft_statics(
    loads: Sequence[Load], bearings: Sequence[Length], hinges: Sequence[Length] = (), at: Sequence[Length] = ()
) -> ShaftStatics:
    """Work out bearing reactions and section forces (Roloff/Matek; document 002, section 5.4).

    The moments are linear between the places of loads and bearings, so the largest resultant is at such a place.

    Args:
        loads: on the shaft.
        bearings: positions in m.
        hinges: positions in m of joints without bending moment.
        at: further positions in m for section forces.

    Raises:
        ValueError: the shaft is not statically determinate.
    """
    reactions = bearing_reactions(loads, bearings, hinges)
    everything = [*loads, *(Load(reaction.at, reaction.y, reaction.z) for reaction in reactions)]
    places = _sorted([*(load.at for load in everything), *hinges, *at])
    diagram = tuple(cut for place in places for cut in section_forces(everything, place))
    largest, place = diagram[0].bending, diagram[0].at
    for cut in diagram[1:]:
        place = where(cut.bending > largest, cut.at, place)
        largest = maximum(largest, cut.bending)
    return ShaftStatics(
        reactions, diagram, maximum(*(reaction.radial for reaction in reactions)), largest, place,
        maximum(*(abs(cut.torque) for cut in diagram)), _sum([load.torque for load in loads]),
    )  # fmt: skip


def _sorted(places: list[Length]) -> list[Length]:
    plain = not any(is_symbolic(place) or getattr(place, "ndim", 0) for place in places)
    return sorted({float(place) for place in places}) if plain else places


def section_forces(loads: Sequence[Load], place: Length) -> tuple[SectionForces, SectionForces]:
    """Return the section forces just left and just right of a place.

    A moment is the sum over everything to the left: of force times distance, and of the torques. A positive force to
    the left makes a positive moment.

    Args:
        loads: on the shaft, including the forces of the bearings.
        place: position in m.
    """
    return _cut(loads, place, False), _cut(loads, place, True)


def _cut(loads: Sequence[Load], place: Length, right: bool) -> SectionForces:
    y, z = _bending(place, loads, "y", "bend_y", right), _bending(place, loads, "z", "bend_z", right)
    shear_y, shear_z, torque = (_sum([getattr(load, name) * _passed(place, load.at, right) for load in loads])
                                for name in ("y", "z", "torque"))  # fmt: skip
    return SectionForces(place, "right" if right else "left", shear_y, shear_z, y, z, hypot(y, z), torque)


def _bending(place: Length, loads: Sequence[Load], force: str, couple: str, right: bool) -> Number:
    return _sum(
        [getattr(load, force) * maximum(place - load.at, 0.0) for load in loads]
        + [getattr(load, couple) * _passed(place, load.at, right) for load in loads]
    )


def _sum(terms: Sequence[Number]) -> Number:
    """Add terms that may cancel: exactly zero instead of a rounding error."""
    return settled(sum(terms), sum(abs(term) for term in terms))


def _passed(place: Length, at: Length, right: bool) -> Number:
    return 1.0 * (place >= at if right else place > at)
