"""Systems of FMUs: what is coupled with what."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple, get_args

from modelica_like.errors import ModelicaLikeError, NetlistError, raise_together_or_one, unknown_name

Master = Literal["jacobi", "gauss-seidel"]
Inputs = Literal["hold", "linear"]


def powers() -> tuple[tuple[str, str], ...]:
    """Return the names of flow and rate (or potential) whose product is a power, as declared by adaptors."""
    from modelica_like.netlist.registry import library_types  # the process of the FMUs needs no library

    terminals = (kind.terminal for kind in library_types().values())
    return tuple(dict.fromkeys(terminal.power for terminal in terminals if terminal and terminal.power))


class Port(NamedTuple):
    """A variable of an FMU in a system."""

    unit: str
    variable: str

    def __str__(self) -> str:
        return f"{self.unit}.{self.variable}"


@dataclass(frozen=True)
class Unit:
    """An FMU in a system, by its name there; the parameters are start values in the FMU's units."""

    name: str
    file: Path
    parameters: Mapping[str, float] = field(default_factory=dict)


class Link(NamedTuple):
    """An output and the inputs that take its value at every communication point."""

    name: str
    source: Port
    targets: tuple[Port, ...]

    def __str__(self) -> str:
        return f"{self.source} → {', '.join(map(str, self.targets))}"


class Bond(NamedTuple):
    """A shaft, slide or wire between two FMUs, through which power flows.

    Attributes:
        flow: link of the torque, force or current into the second FMU.
        rate: link of the speed, velocity or potential back to the first.
    """

    name: str
    flow: str
    rate: str


@dataclass(kw_only=True)
class Energies:
    """Energy at a bond.

    The first FMU delivers the integral of the flow it sends times the rate it receives; the second one receives the
    integral of the flow it receives times the rate it sends. In one model both are equal: the difference is energy
    created by the coupling.

    Attributes:
        delivered: by the FMU that gives the torque, force or current, in J.
        received: by the FMU that takes it, in J.
        throughput: integral of the magnitude of the power, in J.
        mismatch: integral of the magnitude of the difference of both powers, in J.
    """

    delivered: float = 0.0
    received: float = 0.0
    throughput: float = 0.0
    mismatch: float = 0.0

    @property
    def residual(self) -> float:
        """Energy created by the coupling, in J; negative if energy was lost."""
        return self.received - self.delivered


@dataclass(frozen=True)
class Settings:
    """How a system is run.

    Attributes:
        until: end time in s.
        step: communication step in s; the first one if `tolerance` is given.
        master: `jacobi` (all FMUs step at once) or `gauss-seidel` (one after the other, each with the results of those
            before).
        inputs: `linear` (linear interpolation if an FMU supports it) or `hold`.
        tolerance: relative tolerance of the coupling, for a variable step.

    Raises:
        UnknownName: there is no such master, or no such kind of inputs.
    """

    until: float | None = None
    step: float | None = None
    master: Master | str = "jacobi"
    inputs: Inputs | str = "linear"
    tolerance: float | None = None

    def __post_init__(self) -> None:
        _check_word("master", self.master, get_args(Master))
        _check_word("way to give inputs", self.inputs, get_args(Inputs))


def _check_word(what: str, name: str, words: Sequence[str]) -> None:
    if name not in words:
        raise unknown_name(f"There is no {what} '{name}'", name, words, advice=f"There are {' and '.join(words)}.")


@dataclass(frozen=True)
class System:
    """FMUs and their connections.

    Attributes:
        units: in the order in which a Gauss-Seidel master steps them.
        own_names: results have the names of the variables in their FMUs, without the FMU's name before it.
    """

    name: str
    units: tuple[Unit, ...]
    links: tuple[Link, ...]
    bonds: tuple[Bond, ...] = ()
    settings: Settings = field(default_factory=Settings)
    own_names: bool = False

    def __str__(self) -> str:
        lines = [f"System {self.name}: {', '.join(unit.name for unit in self.units)}"]
        return "\n".join([*lines, *(f"  {link}" for link in self.links)])


def check_system(system: System) -> None:
    """Check that names are known, and that no input is driven twice; all errors are reported together."""
    errors: list[ModelicaLikeError] = []
    if not system.units:
        errors.append(NetlistError(f"{system.name} has no FMU.", advice="Declare them in [fmus]."))
    unit_names = [unit.name for unit in system.units]
    for port in (port for link in system.links for port in (link.source, *link.targets)):
        if port.unit not in unit_names:
            errors.append(unknown_name(f"{system.name} has no FMU '{port.unit}'", port.unit, unit_names))
    driven: dict[Port, str] = {}
    for name, target in ((link.name, target) for link in system.links for target in link.targets):
        if target in driven:
            errors.append(NetlistError(f"{system.name}: {target} is driven twice, by {driven[target]} and {name}."))
        driven[target] = name
    names = [link.name for link in system.links]
    for bond in system.bonds:
        for name in {bond.flow, bond.rate} - set(names):
            errors.append(unknown_name(f"{system.name}: bond {bond.name} names no connection '{name}'", name, names))
    if errors:
        raise raise_together_or_one(errors)


def find_bonds(links: Iterable[Link]) -> tuple[Bond, ...]:
    """Return the bonds that follow from names: `a.x.tau` to `b.y.tau`, and `b.y.w` back to `a.x.w`."""
    pairs = powers()
    by_ends = {(link.source, target): link for link in links for target in link.targets}
    bonds: list[Bond] = []
    for (source, target), link in by_ends.items():
        for flow, rate in pairs:
            stem, _, last = source.variable.rpartition(".")
            other, _, its_last = target.variable.rpartition(".")
            if last != flow or its_last != flow:
                continue
            back = by_ends.get((Port(target.unit, _joined(other, rate)), Port(source.unit, _joined(stem, rate))))
            if back is not None:
                bonds.append(Bond(stem.replace(".", "_") or link.name, link.name, back.name))
    return tuple(bonds)


def _joined(stem: str, last: str) -> str:
    return f"{stem}.{last}" if stem else last
