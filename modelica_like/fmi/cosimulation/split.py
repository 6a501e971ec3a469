"""Cut a drive at a shaft into FMUs that are simulated together."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from modelica_like import upper
from modelica_like.arguments import checked
from modelica_like.errors import DuplicateName, LanguageError, NetlistError, ValueOutOfRange
from modelica_like.fmi.cosimulation.cut import Cut, CutNetlist, cut_netlist
from modelica_like.fmi.cosimulation.files import write_system
from modelica_like.fmi.cosimulation.parts import Maker, Takes, ends_of, orient
from modelica_like.fmi.cosimulation.ssp import write_ssp
from modelica_like.fmi.cosimulation.ssp_document import Version
from modelica_like.fmi.cosimulation.system import Bond, Link, Port, Settings, System, Unit
from modelica_like.fmi.export import export_fmu
from modelica_like.fmi.package import known_version, target_file
from modelica_like.language import Assembly, Component
from modelica_like.language.inside import inside
from modelica_like.netlist import load, save
from modelica_like.netlist.convert import as_assembly
from modelica_like.simulation import build, seconds
from modelica_like.writing import check_writable

Report = Callable[[str], None]
_SYSTEM = "system.toml"


@dataclass(frozen=True)
class Split:
    """A drive in parts.

    Attributes:
        system: the FMUs and their connections.
        path: its TOML file.
        ends: what each end of a cut takes from the other side: `flow` (torque) or `potential` (angle and speed).
        notes: results of the comparisons with IDAS.
    """

    system: System
    path: Path
    ends: Mapping[str, Takes]
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        words = {
            "flow": "receives the load and returns the motion",
            "potential": "receives the motion and returns the load",
        }
        lines = [f"{self.path}: {', '.join(unit.file.name for unit in self.system.units)}"]
        return "\n".join([*lines, *(f"  {path} {words[takes]}" for path, takes in self.ends.items()), *self.notes])


@checked
def split(
    drive: Component | str | Path, at: Sequence[str] | str, folder: str | Path, *, names: Sequence[str] = (),
    version: str = "2.0", step: float | str | None = None, master: str | None = None, check: bool = True,
    report: Report | None = None,
) -> Split:  # fmt: skip
    """Cut a drive at shafts into FMUs, and write the system that `cosim` runs.

    The start values are those of the whole drive: a state keeps its given start value, other variables start with the
    number from the start of the drive.

    Args:
        drive: a netlist file, or a component that has only parts and connections.
        at: names of parts (the cut is behind them), of their ends (`shaft.flange_a`), or of entries of `[connect]`;
            signals can also be cut.
        folder: for the files; it is created if it does not exist.
        names: of the FMUs, in the order of the netlist; by default the name of the first part of each.
        version: FMI version; only 2.0 interpolates inputs linearly.
        step: communication step to write into the system, in s.
        master: `jacobi` or `gauss-seidel`, to write into the system.
        check: whether to compare each FMU with IDAS.
        report: called with the present activity.

    Raises:
        UnknownName, NetlistError: there is no such shaft, or the drive cannot be cut there.
        LanguageError: the drive is compiled already.
        ModelicaLikeError: something is wrong with the drive, or a part cannot be exported.
        OSError: nothing can be written into the folder.
    """
    tell, target = report or (lambda _: None), Path(folder)
    check_writable(target / _SYSTEM)
    tell("compiling the drive")
    assembly = _assembly(drive)
    cut = cut_netlist(assembly, [at] if isinstance(at, str) else at)
    titles = _titles(cut, names)
    settings = _settings(inside(assembly).simulate.get("until"), step, master)
    maker = Maker(assembly, cut)
    tell("choosing the causality")
    chosen, values = orient(maker), _start_values(assembly)
    target.mkdir(parents=True, exist_ok=True)
    units, notes = list[Unit](), list[str]()
    for k, title in enumerate(titles):
        tell(f"exporting {title}")
        ends, file = maker.open_ends(k, chosen), target / f"{title}.fmu"
        note = _export(maker.started(k, ends, values), title, file, version, check=check)
        notes += [f"{title}: {note}"] if note else []
        units.append(Unit(title, file, maker.not_passed_on(ends)))
    system = System(inside(assembly).name, tuple(units), *_couplings(maker, chosen, titles), settings, own_names=True)
    write_system(system, target / _SYSTEM)
    taken: dict[str, Takes] = {end.path: end.takes for cut, takes in chosen.items() for end in ends_of(cut, takes)}
    return Split(system, target / _SYSTEM, taken, tuple(notes))


def split_to_ssp(
    drive: Component | str | Path, at: Sequence[str] | str, path: str | Path, ssp_version: Version | str = "1.0",
    **options: Any,
) -> Split:  # fmt: skip
    """Cut a drive at shafts, and write the parts as an SSP.

    Args:
        drive: a netlist file, or a component that has only parts and connections.
        at: where to cut; see `split`.
        path: the file to write, `….ssp`.
        ssp_version: of the SSP standard.
        options: of `split`.

    Raises:
        ModelicaLikeError: see `split` and `cosimulation.ssp.write_ssp`.
    """
    target, chosen = target_file(path, ".ssp", "An SSP"), known_version(ssp_version, Version, "SSP")
    with tempfile.TemporaryDirectory(prefix="modelica_like_") as folder:
        done = split(drive, at, folder, **options)
        return replace(done, path=write_ssp(done.system, target, chosen))


def _export(part: Assembly, title: str, file: Path, version: str, *, check: bool) -> str:
    """Write a part as a netlist and as an FMU, and return the result of its check."""
    inside(part).name = title
    save(part, file.with_suffix(".toml"))
    return export_fmu(part, file, version, {"cs"}, check=check).check.sentence


def _settings(until: float | str | None, step: float | str | None, master: str | None) -> Settings:
    end, size = (None if value is None else seconds(value, name) for name, value in (("until", until), ("step", step)))
    return Settings(end, size, master or "jacobi")


def _assembly(drive: Component | str | Path) -> Assembly:
    if isinstance(drive, str | Path):
        return load(drive)
    if not isinstance(drive, Component):
        raise LanguageError("A compiled drive cannot be cut.", advice="Give the component or the netlist.")
    return drive if isinstance(drive, Assembly) else as_assembly(drive)


def _titles(cut: CutNetlist, names: Sequence[str]) -> list[str]:
    if not names:
        return [group[0] for group in cut.groups]
    if len(names) != len(cut.groups):
        groups = "; ".join(_some(group) for group in cut.groups)
        raise NetlistError(
            f"There are {len(cut.groups)} FMUs, but {len(names)} name{'s' if len(names) > 1 else ''}.",
            why=f"They are: {groups}.",
        )
    for name in names:
        if not name.isidentifier():
            raise NetlistError(f"'{name}' is not a name for an FMU: use letters, digits and _.")
    if len(set(names)) < len(names):
        raise DuplicateName(f"Two FMUs cannot have the same name: {', '.join(names)}.")
    return list(names)


def _some(group: Sequence[str]) -> str:
    return ", ".join(group) if len(group) < 4 else f"{group[0]}, {group[1]} … {group[-1]}"


def _start_values(assembly: Assembly) -> dict[str, float]:
    """Return all variables of the whole drive at its start, in SI units."""
    whole = build(assembly)
    whole.demand_begin_at_zero(ValueOutOfRange, "A co-simulation")
    point = upper.initialize(whole, 0.0, whole.settings.get("start", "given"))
    column = whole.equations.variables(point.t, point.x, point.z, whole.p, whole.u, point.d).full().ravel()
    return {variable.path: float(value) for variable, value in zip(whole.flat_variables, column, strict=True)}


def _couplings(
    maker: Maker, chosen: Mapping[Cut, Takes], titles: Sequence[str]
) -> tuple[tuple[Link, ...], tuple[Bond, ...]]:
    """Return the connections between the FMUs, and the bonds they make."""
    links: list[Link] = []
    bonds: list[Bond] = []
    for cut in maker.found.cuts:
        if cut.signal:
            links.append(_signal(maker.found, cut, titles))
            continue
        near, far = ends_of(cut, chosen[cut])
        moved, moving = (near, far) if near.takes == "potential" else (far, near)
        flow, *motions = maker.members(moved)
        for name in (flow, *motions):
            giver, taker = (moved, moving) if name == flow else (moving, moved)
            ends = [Port(titles[maker.found.group_of(end.path)], f"{end.adaptor}.{name}") for end in (giver, taker)]
            links.append(Link(f"{cut.name}_{name}", ends[0], (ends[1],)))
        terminal = maker.adaptor(moved)[0].terminal
        if terminal and terminal.power:
            bonds.append(Bond(cut.name, *(f"{cut.name}_{name}" for name in terminal.power)))
    return tuple(links), tuple(bonds)


def _signal(netlist: CutNetlist, cut: Cut, titles: Sequence[str]) -> Link:
    source, home = cut.near, netlist.group_of(cut.near)
    ends = (source, *(end for end in cut.far if netlist.group_of(end) != home))
    ports = [Port(titles[netlist.group_of(end)], end) for end in ends]
    return Link(cut.name, ports[0], tuple(ports[1:]))
