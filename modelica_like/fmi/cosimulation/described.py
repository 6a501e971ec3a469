"""The description of an FMU, read without running it: variables, units, kinds."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy

from modelica_like.errors import FmuRefused, ModelicaLikeError, NetlistError, Source, raise_together_or_one
from modelica_like.fmi.cosimulation.system import Port, System
from modelica_like.fmi.unpack import printable, unpack

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class UnitDefinition:
    """A unit as the FMI and SSP standards define it: the value in SI units is factor · value + offset.

    Attributes:
        exponents: of the SI base units, without those that are zero.
    """

    name: str
    exponents: tuple[tuple[str, int], ...] = ()
    factor: float = 1.0
    offset: float = 0.0

    def same_scale(self, other: UnitDefinition) -> bool:
        """Return whether a number means the same in both."""
        return (self.factor, self.offset) == (other.factor, other.offset)

    def same_dimension(self, other: UnitDefinition) -> bool:
        """Return whether both measure the same kind of quantity; the radian is a number."""
        first, second = ({name: power for name, power in unit.exponents if name != "rad"} for unit in (self, other))
        return first == second

    def convert(self, value: float, to: UnitDefinition) -> float:
        """Return a value in another unit."""
        if self.same_scale(to):
            return value
        return (self.factor * value + self.offset - to.offset) / to.factor


@dataclass(frozen=True)
class FmuVariable:
    """A scalar variable of an FMU: type and causality as the standard calls them, name of the unit or an empty text."""

    name: str
    kind: str
    causality: str
    unit: str = ""

    @property
    def varies(self) -> bool:
        """Whether it is a number and not a parameter."""
        number = self.kind not in ("String", "Binary", "Clock")
        return number and "arameter" not in self.causality and self.causality != "independent"


@dataclass(frozen=True)
class DescribedFmu:
    """An FMU's description: FMI version, whether it has a Co-Simulation part, variables and units by name."""

    version: str
    cosimulation: bool
    variables: Mapping[str, FmuVariable]
    units: Mapping[str, UnitDefinition]

    def unit_of(self, name: str) -> UnitDefinition | None:
        """Return the unit of a variable, if the FMU defines one."""
        return self.units.get(self.variables[name].unit) if name in self.variables else None


def described(path: Path) -> DescribedFmu:
    """Read the description of an FMU; nothing of it is run.

    Raises:
        FmuRefused: the file is no FMU, is unsafe to unpack, or its description cannot be read.
        OSError: the file cannot be read.
    """
    with tempfile.TemporaryDirectory(prefix="modelica_like_") as work:
        unpack(path, Path(work))
        try:
            read: Any = fmpy.read_model_description(work, validate=False)
        except Exception as error:  # FMPy has no errors of its own
            reason = printable(str(error)).rstrip(".")
            raise FmuRefused(f"The description of {path.name} cannot be read: {reason}.") from error
    scalars = [variable for variable in read.modelVariables if not variable.shape]
    variables = {
        scalar.name: FmuVariable(
            scalar.name,
            scalar.type,
            scalar.causality or "local",
            scalar.unit or getattr(scalar.declaredType, "unit", None) or "",
        )
        for scalar in scalars
    }
    # A unit without a definition is only a word: nothing is known of it.
    units = {unit.name: _definition(unit) for unit in read.unitDefinitions or () if unit.baseUnit is not None}
    return DescribedFmu(read.fmiVersion, read.coSimulation is not None, variables, units)


def _definition(unit: Any) -> UnitDefinition:
    base = unit.baseUnit
    exponents = tuple((name, int(getattr(base, name))) for name in BASE_UNITS if getattr(base, name))
    factor = 1.0 if base.factor is None else float(base.factor)
    return UnitDefinition(unit.name, exponents, factor, float(base.offset or 0.0))


def refuse_other_unit(target: str, source: str, units: Iterable[UnitDefinition | None], where: Source) -> None:
    """Refuse a connection whose known units differ: numbers pass it as they are.

    Args:
        target: input, for messages.
        source: output, likewise.
        units: from the input to the output, None where nothing is known.
        where: place of the connection.

    Raises:
        NetlistError: they differ in scale or dimension.
    """
    first, *others = [unit for unit in units if unit is not None] or [UnitDefinition("1")]
    other = next((unit for unit in others if not (first.same_scale(unit) and first.same_dimension(unit))), None)
    if other is None:
        return
    if first.same_dimension(other):
        raise NetlistError(
            f"{target} and {source} have different units, {first.name} and {other.name}, "
            "and conversion is not supported.",
            where=where, advice="Do the conversion in one of the FMUs.",
        )  # fmt: skip
    raise NetlistError(
        f"{target} and {source} are different quantities: their units are {first.name} and {other.name}.",
        where=where, advice="Connect an input with an output of the same quantity.",
    )  # fmt: skip


def check_units(system: System, place: Callable[[str], Source], named: Callable[[Port], str] = str) -> None:
    """Check the units of all connections, as far as the FMUs define them; all errors are reported together.

    Args:
        system: FMUs and connections. What is wrong with an FMU is told where it is run.
        place: of a connection, by its name.
        named: name of a variable in messages.

    Raises:
        NetlistError: two connected variables have different units.
    """
    about: dict[str, DescribedFmu] = {}
    for unit in system.units:
        with suppress(FmuRefused, OSError):
            about[unit.name] = described(unit.file)
    errors: list[ModelicaLikeError] = []
    for link in system.links:
        for target in link.targets:
            ends = (target, link.source)
            units = [about[end.unit].unit_of(end.variable) if end.unit in about else None for end in ends]
            try:
                refuse_other_unit(named(target), named(link.source), units, place(link.name))
            except NetlistError as error:
                errors.append(error)
    if errors:
        raise raise_together_or_one(errors)
