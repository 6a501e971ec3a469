"""System files: TOML in and out."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast, get_args

import tomlkit

from modelica_like.cosimulation.system import (
    Bond,
    Inputs,
    Link,
    Master,
    Port,
    Settings,
    System,
    Unit,
    check_system,
    find_bonds,
)
from modelica_like.errors import (
    ModelicaLikeError,
    NetlistError,
    UnknownName,
    did_you_mean,
    raise_together_or_one,
)
from modelica_like.netlist.document import parse_toml, read_text
from modelica_like.netlist.locate import Lines, locate
from modelica_like.units import parse_unit, to_si
from modelica_like.writing import write_text

_SECTIONS = ("name", "own_names", "fmus", "connect", "bonds", "simulate")
_OPTIONS = ("until", "step", "master", "inputs", "tolerance")


def read_toml(path: Path) -> tuple[dict[str, Any], Lines]:
    """Read a TOML file, and where its entries stand.

    Raises:
        NetlistError: it is not TOML, or does not exist.
        DuplicateName: a name is used twice.
    """
    text = read_text(path)
    lines = locate(text, str(path))
    return parse_toml(text, lines), lines


def read_system(data: Mapping[str, Any], lines: Lines, path: Path) -> System:
    """Return the system that a TOML file describes.

    Args:
        data: its content, from `read_toml`.
        lines: where its entries stand.
        path: the file.

    Raises:
        NetlistError, UnknownName: something in it is wrong.
    """
    return _Reader(lines, path).system(data)


class _Reader:
    """Reads the sections of a system file, and collects what is wrong."""

    def __init__(self, lines: Lines, path: Path) -> None:
        self.lines, self.path = lines, path
        self.errors: list[ModelicaLikeError] = []

    def system(self, data: Mapping[str, Any]) -> System:
        for key in data:
            self.known(key, _SECTIONS, "A system has no entry", key)
        units = tuple(self.each(data, "fmus", self.unit))
        links = tuple(self.each(data, "connect", self.link))
        given = tuple(self.each(data, "bonds", self.bond))
        settings = self.settings(data.get("simulate", {}))
        if self.errors:
            raise raise_together_or_one(self.errors)
        name, own = str(data.get("name", self.path.stem)), data.get("own_names", False) is True
        system = System(name, units, links, given or find_bonds(links), settings, own)
        check_system(system)
        return system

    def known(self, name: str, names: tuple[str, ...], what: str, *place: str) -> None:
        if name not in names:
            self.wrong(
                UnknownName(f"{what} '{name}'{did_you_mean(name, names) or '.'} It has {', '.join(names)}."), *place
            )

    def wrong(self, error: ModelicaLikeError, *place: str) -> None:
        error.where = error.where or (self.lines.source(*place),)
        self.errors.append(error)

    def each(self, data: Mapping[str, Any], section: str, read: Any) -> list[Any]:
        table, found = data.get(section, {}), []
        if not isinstance(table, dict):
            self.wrong(NetlistError(f"{section} must be a table: [{section}]."), section)
            return []
        for name, entry in table.items():
            try:
                found.append(read(name, entry))
            except ModelicaLikeError as error:
                self.wrong(error, section, name)
        return found

    def unit(self, name: str, entry: Any) -> Unit:
        table = {"file": entry} if isinstance(entry, str) else entry
        if not isinstance(table, dict) or not isinstance(table.get("file"), str) or set(table) - {"file", "parameters"}:
            raise NetlistError(
                f'fmus.{name} must be a table: {{ file = "{name}.fmu" }}, with `parameters` if there are any.'
            )
        if not name.isidentifier():
            raise NetlistError(f"fmus.{name}: the name of an FMU is a word: letters, digits and _.")
        parameters = table.get("parameters", {})
        if not isinstance(parameters, dict) or not all(isinstance(v, int | float) for v in parameters.values()):
            raise NetlistError(f"fmus.{name}.parameters must be a table of numbers, in the FMU's units.")
        return Unit(name, self.path.parent / table["file"], {key: float(value) for key, value in parameters.items()})

    def link(self, name: str, entry: Any) -> Link:
        if (
            not isinstance(entry, list)
            or len(entry) < 2
            or not all(isinstance(end, str) and "." in end for end in entry)
        ):
            raise NetlistError(
                f"connect.{name} must be a list of an output and the inputs that take it.",
                advice='Each is the name of an FMU and of its variable: ["motor.flange.tau", "load.tau"].',
            )
        source, *targets = (Port(*end.split(".", 1)) for end in entry)
        return Link(name, source, tuple(targets))

    def bond(self, name: str, entry: Any) -> Bond:
        if not isinstance(entry, list) or len(entry) != 2 or not all(isinstance(one, str) for one in entry):
            raise NetlistError(
                f"bonds.{name} must be a list of two connections, whose product is a power.",
                advice="First that of the torque, force or current, then that of the speed, velocity or potential.",
            )
        return Bond(name, *entry)

    def settings(self, table: Any) -> Settings:
        if not isinstance(table, dict):
            self.wrong(NetlistError("simulate must be a table: [simulate]."), "simulate")
            return Settings()
        for key in table:
            self.known(key, _OPTIONS, "[simulate] has no", "simulate", key)
        values: dict[str, Any] = {}
        for key, value in table.items():
            try:
                values[key] = _option(key, value)
            except ModelicaLikeError as error:
                self.wrong(error, "simulate", key)
        return Settings(**values) if not self.errors else Settings()


def _option(key: str, value: Any) -> Any:
    if key in ("until", "step"):
        seconds = to_si(value, parse_unit("s"), f"simulate.{key}")
        if seconds <= 0:
            raise NetlistError(f"simulate.{key} = {value} must be positive.")
        return seconds
    known = {"master": get_args(Master), "inputs": get_args(Inputs)}.get(key)
    if known and value not in known:
        raise UnknownName(f"simulate.{key} = {value!r} must be {' or '.join(known)}.")
    if key == "tolerance" and not (isinstance(value, float) and 1e-12 <= value <= 0.1):
        raise NetlistError(f"simulate.tolerance = {value} must be a number from 1e-12 to 0.1.")
    return value


def write_system(system: System, path: Path) -> None:
    """Write a system as TOML; the FMUs are named relative to it."""
    document = tomlkit.document()
    document.add("name", tomlkit.item(system.name))
    if system.own_names:
        document.add(tomlkit.comment("results keep the names that variables have in their FMUs"))
        document.add("own_names", tomlkit.item(True))
    units: dict[str, Any] = {unit.name: _unit_table(unit, path.parent) for unit in system.units}
    ends = {link.name: [str(port) for port in (link.source, *link.targets)] for link in system.links}
    simulate = {key: value for key, value in vars(system.settings).items() if value is not None}
    sections = {
        "fmus": units, "connect": ends, "bonds": {bond.name: [bond.flow, bond.rate] for bond in system.bonds},
        "simulate": {key: f"{value!r} s" if key in ("until", "step") else value for key, value in simulate.items()},
    }  # fmt: skip
    for name, entries in sections.items():
        if entries:
            document.add(name, _table(entries))
    write_text(path, tomlkit.dumps(document))


def _unit_table(unit: Unit, folder: Path) -> Any:
    table = tomlkit.inline_table()
    table.append("file", Path(os.path.relpath(unit.file, folder)).as_posix())
    if unit.parameters:
        inner = tomlkit.inline_table()
        inner.update(cast("dict[str, Any]", dict(unit.parameters)))
        table.append("parameters", inner)
    return table


def _table(entries: Mapping[str, Any]) -> Any:
    table = tomlkit.table()
    for name, entry in entries.items():
        table.add(name, entry)
    return table
