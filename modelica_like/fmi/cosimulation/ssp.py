"""System structure packages (SSP): systems of FMUs that other tools open."""

from __future__ import annotations

from pathlib import Path

from modelica_like.errors import NetlistError, UnknownName, did_you_mean
from modelica_like.fmi.cosimulation.described import described
from modelica_like.fmi.cosimulation.ssp_document import Version, ssd
from modelica_like.fmi.cosimulation.ssp_reader import read_structure
from modelica_like.fmi.cosimulation.system import System, check_system
from modelica_like.fmi.package import known_version, target_file, write_archive
from modelica_like.fmi.unpack import SSP, printable, unpack


def write_ssp(system: System, path: str | Path, version: Version | str = "1.0") -> Path:
    """Write a system and its FMUs as an SSP.

    The same system gives the same bytes. Settings outside the standard (master, step, tolerance, bonds) are in an
    annotation, which other tools ignore.

    Args:
        system: the system.
        path: the file to write, `….ssp`; it is replaced.
        version: of the SSP standard, `1.0` or `2.0` (with the types of FMI 3.0).

    Returns:
        The file.

    Raises:
        UnknownName: there is no such version, or an FMU lacks a variable of the system.
        ExportError: the file has another ending, or its folder does not exist.
        NetlistError: the system is not valid.
        FmuRefused: a file is not an FMU.
        OSError: a file cannot be read or written.
    """
    target, chosen = target_file(path, ".ssp", "An SSP"), known_version(version, Version, "SSP")
    check_system(system)
    for name in (system.name, *(named.name for named in (*system.links, *system.bonds))):
        if not name.isprintable():
            raise NetlistError(f"The name '{printable(name)}' has characters that XML does not allow.")
    fmus = {unit.name: described(unit.file) for unit in system.units}
    ports = [(port.unit, port.variable) for link in system.links for port in (link.source, *link.targets)]
    ports += [(user.name, variable) for user in system.units for variable in user.parameters]
    file_of = {user.name: user.file.name for user in system.units}
    for user, variable in ports:
        variables = fmus[user].variables
        if variable not in variables:
            raise UnknownName(
                f"{user} ({file_of[user]}) has no variable '{variable}'{did_you_mean(variable, variables) or '.'}"
            )
    homes: dict[Path, str] = {}
    for unit in system.units:
        homes.setdefault(unit.file.resolve(), f"resources/{unit.name}.fmu")
    sources = {unit.name: homes[unit.file.resolve()] for unit in system.units}
    files = {home: file.read_bytes() for file, home in homes.items()}
    write_archive(target, files | {SSP.description: ssd(system, fmus, sources, chosen)})
    return target


def load_ssp(path: Path, work: Path) -> System:
    """Read an SSP: the system of its SystemStructure.ssd, flat.

    Nested systems are flattened; the names of their FMUs are joined with `_`. The SSP is unpacked into an empty folder,
    which contains the FMUs of the system.

    Raises:
        FmuRefused: the file is not an SSP, or is unsafe to unpack.
        NetlistError, UnknownName: the system cannot be run, or contradicts itself.
        OSError: the file cannot be read.
    """
    return read_structure(path.name, unpack(path, work, kind=SSP))
