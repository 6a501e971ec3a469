"""Units of the arguments and results of design checks: all numbers are in SI units, tables show practical units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import casadi as ca

Number = Any
"""A float, a NumPy array (all arrays of one call broadcast) or a CasADi SX, MX or DM."""


def is_symbolic(*values: Number) -> bool:
    """Return whether any of the values is a CasADi type."""
    return any(isinstance(value, ca.SX | ca.MX | ca.DM) for value in values)


@dataclass(frozen=True, slots=True)
class Quantity:
    """Unit of a number.

    Attributes:
        unit: unit of the number, coherent SI.
        shown: unit in tables; empty for a plain number.
        factor: size of the shown unit in the SI unit.
    """

    unit: str
    shown: str
    factor: float = 1.0


Ratio = Annotated[Number, Quantity("1", "")]
Teeth = Annotated[Number, Quantity("1", "teeth")]
Revolutions = Annotated[Number, Quantity("1", "1e6 rev", 1e6)]
Length = Annotated[Number, Quantity("m", "mm", 1e-3)]
Sag = Annotated[Number, Quantity("m", "um", 1e-6)]
Area = Annotated[Number, Quantity("m2", "mm2", 1e-6)]
Angle = Annotated[Number, Quantity("rad", "deg", math.pi / 180)]
Time = Annotated[Number, Quantity("s", "s")]
Life = Annotated[Number, Quantity("s", "h", 3600.0)]
Speed = Annotated[Number, Quantity("rad/s", "rpm", math.pi / 30)]
Acceleration = Annotated[Number, Quantity("rad/s2", "rad/s2")]
Velocity = Annotated[Number, Quantity("m/s", "m/s")]
Mass = Annotated[Number, Quantity("kg", "kg")]
Density = Annotated[Number, Quantity("kg/m3", "kg/m3")]
Inertia = Annotated[Number, Quantity("kg.m2", "kg.m2")]
SmallInertia = Annotated[Number, Quantity("kg.m2", "kg.mm2", 1e-6)]
Force = Annotated[Number, Quantity("N", "N")]
Torque = Annotated[Number, Quantity("N.m", "N.m")]
SmallTorque = Annotated[Number, Quantity("N.m", "N.mm", 1e-3)]
Stress = Annotated[Number, Quantity("Pa", "N/mm2", 1e6)]
Energy = Annotated[Number, Quantity("J", "J")]
Frequency = Annotated[Number, Quantity("1/s", "1/h", 1 / 3600)]
Temperature = Annotated[Number, Quantity("K", "K")]
HeatCapacity = Annotated[Number, Quantity("J/K", "J/K")]
Conductance = Annotated[Number, Quantity("W/K", "W/K")]
Power = Annotated[Number, Quantity("W", "W")]
Voltage = Annotated[Number, Quantity("V", "V")]
Current = Annotated[Number, Quantity("A", "A")]
Resistance = Annotated[Number, Quantity("Ohm", "Ohm")]
MotorConstant = Annotated[Number, Quantity("N.m/A", "N.m/A")]
Damping = Annotated[Number, Quantity("N.m.s/rad", "N.m.s/rad")]
Compliance = Annotated[Number, Quantity("rad/(N.m.s)", "rpm/(N.mm)", math.pi / 30 * 1e3)]
Flux = Annotated[Number, Quantity("Wb", "mWb", 1e-3)]
Field = Annotated[Number, Quantity("T", "T")]
CurrentSlope = Annotated[Number, Quantity("A/(N.m)", "A/(N.mm)", 1e3)]
