"""Finite life of gears under a load spectrum (ISO 6336-6; Palmgren, Miner)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from components.sizing.gear_strength import GearStrength
from components.sizing.maths import exp, log, maximum, minimum, require, where
from modelica_like.language.quantities import Ratio
from modelica_like.language.results import Result, line


@dataclass(frozen=True)
class LifeCurve:
    """Life factor of a material over load cycles: constant, then falling to 1, then falling slowly.

    Both falling parts are straight in logarithms, N·sigma^p = constant.

    Attributes:
        static_factor: up to static_cycles.
        static_cycles: where it begins to fall.
        knee_cycles: where it is 1.
        long_factor: at long_cycles, and behind that.
        long_cycles: where it ends.
    """

    static_factor: Ratio
    static_cycles: Ratio
    knee_cycles: Ratio
    long_factor: Ratio = 0.85
    long_cycles: Ratio = 1e10

    @property
    def exponents(self) -> tuple[Ratio, Ratio]:
        """Exponents p before and behind the knee."""
        return (
            log(self.knee_cycles / self.static_cycles) / log(self.static_factor),
            log(self.long_cycles / self.knee_cycles) / log(1 / self.long_factor),
        )


HARDENED_FLANK = LifeCurve(1.6, 1e5, 5e7)
"""Flanks of case-hardened steel, no pitting permitted (ISO 6336-2)."""
HARDENED_ROOT = LifeCurve(2.5, 1e3, 3e6)
"""Roots of case-hardened steel (ISO 6336-3)."""


def life_factor(cycles: Ratio, curve: LifeCurve) -> Ratio:
    """Return the life factor Z_NT or Y_NT for a number of load cycles (ISO 6336-2 and -3)."""
    first, second = curve.exponents
    early = exp(log(curve.knee_cycles / maximum(cycles, curve.static_cycles)) / first)
    late = exp(log(curve.knee_cycles / minimum(cycles, curve.long_cycles)) / second)
    return where(cycles < curve.knee_cycles, early, late)


def damage_per_cycle(utilisation: Ratio, curve: LifeCurve) -> Ratio:
    """Return one over the cycles to failure; none below the end of the curve, infinite above the static factor.

    Args:
        utilisation: stress over strength at the knee, one over the safety there.
        curve: of the material.
    """
    exponent = where(utilisation > 1, *curve.exponents)
    damage = exp(exponent * log(utilisation)) / curve.knee_cycles
    damage = where(utilisation < curve.long_factor, 0.0, damage)
    return where(utilisation > curve.static_factor, math.inf, damage)


@dataclass(frozen=True)
class LoadStage:
    """A step of a load spectrum.

    Attributes:
        load: torque over the torque for which the strength was worked out.
        cycles: load cycles of a tooth of the pinion.
    """

    load: Ratio
    cycles: Ratio


class StageDamage(Result):
    """Share of the life used by a step of a load spectrum."""

    load: Ratio = line("torque over nominal torque")
    cycles: Ratio = line("load cycles of a tooth of the pinion")
    pitting: Ratio = line("damage of the flanks")
    pinion_root: Ratio = line("damage of the pinion's roots")
    wheel_root: Ratio = line("damage of the wheel's roots")


class GearLife(Result):
    """Damage of a pair of gears by a load spectrum."""

    pitting: Ratio = line("damage of the flanks", at_most="allowed_damage")
    pinion_root: Ratio = line("damage of the pinion's roots", at_most="allowed_damage")
    wheel_root: Ratio = line("damage of the wheel's roots", at_most="allowed_damage")
    allowed_damage: Ratio = line("damage at which the gears count as worn out")
    pitting_application: Ratio = line("application factor to which the spectrum amounts for the flanks")
    root_application: Ratio = line("that for the roots")
    stages: tuple[StageDamage, ...] = line("damage step by step")


def gear_life(
    strength: GearStrength, spectrum: Sequence[LoadStage], wheel_cycles: Ratio = 1.0,
    flank: LifeCurve = HARDENED_FLANK, root: LifeCurve = HARDENED_ROOT, allowed_damage: Ratio = 1.0,
) -> GearLife:  # fmt: skip
    """Add up the damage of a load spectrum: D = sum n/N (Miner), N of the life curves (ISO 6336-6).

    Root stresses grow with the torque, contact stresses with its root. The application factor of a spectrum is
    (sum n·(T/T_n)^q/sum n)^(1/q) with q = p of the root and p/2 of the flanks (ISO 6336-6, annex A).

    Args:
        strength: of the pair at nominal torque, with life factors of 1; its own application factor counts as well.
        spectrum: steps of constant torque.
        wheel_cycles: load cycles of a tooth of the wheel over those of the pinion.
        flank: life curve of the flanks.
        root: life curve of the roots.
        allowed_damage: 1, or less for spectra that are not certain.

    Raises:
        ValueError: there is no step, or a step of the spectrum or the wheel has no load or no cycles.
    """
    require("A load spectrum has at least one step, and the wheel has cycles.", len(spectrum) > 0, wheel_cycles > 0)
    require("Every step of a load spectrum needs a load and cycles above zero.",
            *(value > 0 for stage in spectrum for value in (stage.load, stage.cycles)))  # fmt: skip
    stages = tuple(_damage(strength, stage, wheel_cycles, flank, root) for stage in spectrum)
    total = sum(stage.cycles for stage in spectrum)

    def amounts_to(exponent: Ratio) -> Ratio:
        return exp(log(sum(stage.cycles * stage.load**exponent for stage in spectrum) / total) / exponent)

    return GearLife(
        sum(stage.pitting for stage in stages), sum(stage.pinion_root for stage in stages),
        sum(stage.wheel_root for stage in stages), allowed_damage, amounts_to(flank.exponents[0] / 2),
        amounts_to(root.exponents[0]), stages,
    )  # fmt: skip


def _damage(
    strength: GearStrength, stage: LoadStage, wheel_cycles: Ratio, flank: LifeCurve, root: LifeCurve
) -> StageDamage:
    contact = stage.load**0.5 / strength.pitting_safety
    pinion, wheel = stage.load / strength.pinion_root_safety, stage.load / strength.wheel_root_safety
    return StageDamage(
        stage.load, stage.cycles, stage.cycles * maximum(1.0, wheel_cycles) * damage_per_cycle(contact, flank),
        stage.cycles * damage_per_cycle(pinion, root), stage.cycles * wheel_cycles * damage_per_cycle(wheel, root),
    )  # fmt: skip
