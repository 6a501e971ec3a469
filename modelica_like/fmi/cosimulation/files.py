"""System files: reading and writing TOML; systems from files of any kind."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from modelica_like.errors import ModelicaLikeError, NetlistError, UnknownName, raise_together_or_one
from modelica_like.fmi.cosimulation import system as kinds
from modelica_like.fmi.cosimulation.described import check_units
from modelica_like.fmi.cosimulation.system import Bond, Link, Port, Settings, System, Unit, check_system, find_bonds
from modelica_like.language.units import ONE, parse_unit, to_si
from modelica_like.netlist import document as toml
from modelica_like.netlist import sections as form
from modelica_like.netlist import spell
from modelica_like.netlist.locate import Lines, locate
from modelica_like.netlist.read import FMU_PART
from modelica_like.writing import write_text

_OWN_NAMES = "# With own_names, results keep the names that variables have in their FMUs.\n"


def load_system(path: Path, work: Path) -> System:
    """Read a system: a TOML file, an SSP, or a netlist with FMUs; unpacked or exported files go to `work`."""
    if path.suffix.lower() == ".ssp":
        from modelica_like.fmi.cosimulation.ssp import load_ssp

        return load_ssp(path, work)
    data, lines = _read_toml(path)
    if "fmus" not in data and "parts" in data:
        from modelica_like.fmi.cosimulation.fmu_parts import system_of_netlist

        return system_of_netlist(path, work)
    errors: list[ModelicaLikeError] = []
    read = form.read_sections(data, "A system", _READERS, lines, errors)
    if errors:
        raise raise_together_or_one(errors)
    fmus, links, bonds = (tuple(read.get(name, {}).values()) for name in ("fmus", "connect", "bonds"))
    units = tuple(replace(unit, file=path.parent / unit.file) for unit in fmus)
    settings = Settings(**read.get("simulate", {}))
    own_names = read.get("own_names", False)
    system = System(read.get("name", path.stem), units, links, bonds or find_bonds(links), settings, own_names)
    check_system(system)
    check_units(system, lambda name: lines.source("connect", name))
    return system


def describes_system(path: Path) -> bool:
    """Return whether a file describes FMUs that run together rather than a netlist to simulate."""
    if path.suffix.lower() == ".ssp":
        return True
    data, _ = _read_toml(path)
    parts = data.get("parts")
    parts = parts.values() if isinstance(parts, dict) else ()
    return "fmus" in data or any(isinstance(part, dict) and part.get("is") == FMU_PART for part in parts)


@contextmanager
def opened(path: Path) -> Iterator[System]:
    """Open a system, and keep its unpacked files as long as needed; see `load_system`."""
    with tempfile.TemporaryDirectory(prefix="modelica_like_", ignore_cleanup_errors=True) as work:
        yield load_system(path, Path(work))


def _read_toml(path: Path) -> tuple[dict[str, Any], Lines]:
    text = toml.read_text(path)
    lines = locate(text, str(path))
    return toml.parse_toml(text, lines), lines


def _unit(key: str, entry: Any) -> Unit:
    table, name = {"file": entry} if isinstance(entry, str) else entry, _name(key)
    is_file = isinstance(table, dict) and isinstance(table.get("file"), str) and "\0" not in table["file"]
    if not is_file or set(table) - {"file", "parameters"}:
        raise NetlistError(f'{key} must be a table: {{ file = "{name}.fmu" }}, optionally with `parameters`.')
    if not name.isidentifier():
        raise NetlistError(f"{key}: the name of an FMU must be a word: letters, digits and _.")
    parameters = table.get("parameters", {})
    if not isinstance(parameters, dict) or not all(isinstance(v, int | float) for v in parameters.values()):
        raise NetlistError(f"{key}.parameters must be a table of numbers, in the FMU's units.")
    values = {p: to_si(value + 0, ONE, f"{key}.{p}") for p, value in parameters.items()}
    return Unit(name, Path(table["file"]), values)


def _link(key: str, entry: Any) -> Link:
    ends = entry if isinstance(entry, list) and all(isinstance(end, str) and "." in end for end in entry) else []
    if len(ends) < 2:
        raise NetlistError(
            f"{key} must be a list of an output and the inputs that take it.",
            advice='Write the FMU and its variable: ["motor.flange.tau", "load.tau"].',
        )
    source, *targets = (Port(*end.split(".", 1)) for end in ends)
    return Link(_name(key), source, tuple(targets))


def _bond(key: str, entry: Any) -> Bond:
    if not isinstance(entry, list) or len(entry) != 2 or not all(isinstance(name, str) for name in entry):
        raise NetlistError(
            f"{key} must be a list of two connections, whose product is a power.",
            advice="First that of the torque, force or current, then that of the speed, velocity or potential.",
        )
    return Bond(_name(key), *entry)


def _name(key: str) -> str:
    return key.partition(".")[2]


def _yes_or_no(key: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise NetlistError(f"{key} must be true or false.")
    return value


def _time(key: str, value: Any) -> float:
    return to_si(form.duration(key, value), parse_unit("s"), key)


def _word(words: Sequence[str]) -> form.Check:
    def check(key: str, value: Any) -> Any:
        if value not in words:
            raise UnknownName(f"{key} = {value!r} must be {' or '.join(words)}.")
        return value

    return check


def _tolerance(key: str, value: Any) -> float:
    if not (isinstance(value, float) and 1e-12 <= value <= 0.1):
        raise NetlistError(f"{key} = {value} must be a number from 1e-12 to 0.1.")
    return value


_OPTIONS: Mapping[str, form.Check] = {
    "until": _time, "step": _time, "master": _word(get_args(kinds.Master)), "inputs": _word(get_args(kinds.Inputs)),
    "tolerance": _tolerance,
}  # fmt: skip
_READERS: Mapping[str, form.Reader] = {
    "name": form.whole(form.as_text), "own_names": form.whole(_yes_or_no), "fmus": form.each(_unit),
    "connect": form.each(_link), "bonds": form.each(_bond), "simulate": form.options(_OPTIONS),
}  # fmt: skip


def write_system(system: System, path: Path) -> None:
    """Write a system as TOML; the FMUs are named relative to it."""
    simulate = {key: value for key, value in vars(system.settings).items() if value is not None}
    head: dict[str, Any] = {"name": system.name, "own_names": system.own_names}
    text = spell.document({
        "": {key: value for key, value in head.items() if value},
        "fmus": {unit.name: _unit_table(unit, path.parent) for unit in system.units},
        "connect": {link.name: [str(port) for port in (link.source, *link.targets)] for link in system.links},
        "bonds": {bond.name: [bond.flow, bond.rate] for bond in system.bonds},
        "simulate": {key: f"{value!r} s" if key in ("until", "step") else value for key, value in simulate.items()},
    })  # fmt: skip
    write_text(path, f"{_OWN_NAMES}{text}" if system.own_names else text)


def _unit_table(unit: Unit, folder: Path) -> dict[str, Any]:
    table: dict[str, Any] = {"file": Path(os.path.relpath(unit.file, folder)).as_posix()}
    return table | ({"parameters": dict(unit.parameters)} if unit.parameters else {})
