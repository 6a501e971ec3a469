"""Heat and wear of friction clutches and brakes."""

from __future__ import annotations

import math

from components.sizing.maths import exp, log, require
from modelica_like.language.quantities import (
    Conductance,
    Energy,
    Frequency,
    HeatCapacity,
    Power,
    Ratio,
    Temperature,
)
from modelica_like.language.results import Result, line


class ClutchHeat(Result):
    """Heat and wear of a clutch, with their limits."""

    work: Energy = line("friction work of one engagement", at_most="permissible_work")
    permissible_work: Energy = line("permissible friction work of one engagement at this frequency")
    frequency: Frequency = line("engagements per hour", at_most="permissible_frequency")
    permissible_frequency: Frequency = line("permissible engagements per hour with this work")
    power: Power = line("mean heat flow")
    rise: Temperature = line("rise of the temperature in one engagement, without cooling")
    temperature: Temperature = line("highest temperature, in the steady state", at_most="hottest")
    hottest: Temperature = line("permissible temperature")
    engagements: Ratio = line("engagements until the linings are worn")


def clutch_heat(
    work: Energy, frequency: Frequency, single_limit: Energy, transition_frequency: Frequency,
    heat_capacity: HeatCapacity, conductance: Conductance, air: Temperature = 293.15, hottest: Temperature = math.inf,
    wear_work: Energy = math.inf,
) -> ClutchHeat:  # fmt: skip
    """Compute heat and wear of a clutch with repeated engagements (VDI 2241).

    The limits are Q = Q_E·(1 - exp(-S_hü/S_h)) per engagement, and so S_h = S_hü/ln(Q_E/(Q_E - W)) per hour. With
    equal engagements the temperature after each is T_air + rise/(1 - exp(-G/(C·S_h))) with the rise W/C: one body of
    the heat capacity C, which gives its heat to the air through G.

    Args:
        work: friction work W of one engagement in J, below single_limit.
        frequency: engagements per time S_h in 1/s.
        single_limit: permissible friction work Q_E of a single engagement in J.
        transition_frequency: S_hü of the catalogue in 1/s.
        heat_capacity: C of the plates in J/K.
        conductance: G to the air in W/K.
        air: temperature of the air in K.
        hottest: permissible temperature in K.
        wear_work: friction work in J that wears the linings down, from the catalogue.

    Raises:
        ValueError: one engagement exceeds the limit of a single engagement.
    """
    require(
        "The friction work of one engagement is not below single_limit: no frequency permits it.", work < single_limit
    )
    rise = work / heat_capacity
    kept = exp(-conductance / (heat_capacity * frequency))
    return ClutchHeat(
        work=work, permissible_work=single_limit * (1 - exp(-transition_frequency / frequency)),
        frequency=frequency, permissible_frequency=transition_frequency / log(single_limit / (single_limit - work)),
        power=work * frequency, rise=rise, temperature=air + rise / (1 - kept), hottest=hottest,
        engagements=wear_work / work,
    )  # fmt: skip
