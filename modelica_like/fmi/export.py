"""Export of a drive as an FMU: description, C sources, binaries, terminals and documentation, checked before use."""

from __future__ import annotations

import hashlib
import tempfile
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import get_args

from modelica_like import upper
from modelica_like.arguments import checked
from modelica_like.compile import compile
from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.sliding import as_asked
from modelica_like.errors import ExportError, UnknownName
from modelica_like.flatten import flatten
from modelica_like.fmi.build import PLATFORMS, build, chosen_platforms, native_platform
from modelica_like.fmi.check import Check, communication_step, compare_with_idas, problems
from modelica_like.fmi.description import About, Kind, Version, build_description, identifier, model_description
from modelica_like.fmi.documentation import Listing, index_page
from modelica_like.fmi.interface import Interface, ModesAs, interface
from modelica_like.fmi.model_file import MODEL, as_c, model_file, with_token
from modelica_like.fmi.package import known_version, target_file, write_archive
from modelica_like.fmi.runtime import runtime_library
from modelica_like.fmi.sources import LOG_CATEGORIES, licenses, runtime_sources, source_files
from modelica_like.fmi.straight import straight
from modelica_like.fmi.tables import make_tables
from modelica_like.fmi.terminals import Takes, icon_name, terminals_and_icons, with_open_ends
from modelica_like.garbage import without_garbage_search
from modelica_like.language import Assembly, Component
from modelica_like.language.inside import inside
from modelica_like.language.tunable import with_tunable_tables
from modelica_like.options import Options
from modelica_like.simulation import Model, loaded, positive_step, seconds
from modelica_like.structure import reduce
from modelica_like.writing import replacing

_PICTURES = Path(__file__).parent / "pictures"
_LEGIBLE = 100
"""Largest number of parts of a drive that is drawn as an icon."""
_TOKEN = "{00000000-0000-0000-0000-000000000000}"
_CODE, _CODE_HEAD = "code_model.c", "#define CODE_ONLY\n#define CODES const Codes codes =\n"
"""Compiled equations: a source of their own, for the run-time alone."""

Report = Callable[[str], None]


@dataclass(frozen=True)
class Export:
    """What was exported.

    Attributes:
        path: the FMU.
        version: FMI version.
        kinds: `me`, `cs` or both.
        platforms: names of the platforms it has binaries for.
        size: of the file in bytes.
        seconds: wall time.
        check: how it compares with IDAS.
    """

    path: Path
    version: Version
    kinds: tuple[Kind, ...]
    platforms: tuple[str, ...]
    size: int
    seconds: float
    check: Check

    def __str__(self) -> str:
        kinds = " and ".join({"me": "Model Exchange", "cs": "Co-Simulation"}[kind] for kind in self.kinds)
        where = ", ".join(self.platforms) or "sources only"
        line = f"{self.path}: FMI {self.version}, {kinds}, {self.size / 1000:.0f} kB, {where}, {self.seconds:.1f} s"
        picture = f"See {self.check.picture}." if self.check.picture else ""
        return " ".join(filter(None, (f"{line}\n{self.check.sentence}".rstrip(), picture)))


@without_garbage_search()
@checked
def export_fmu(
    drive: Model, path: str | Path, version: Version | str = "2.0", kind: Collection[Kind | str] | str = ("me", "cs"),
    platforms: Sequence[str] | str = "native", *, outputs: Sequence[str] = (), ends: Sequence[str] = (),
    takes: Takes = "flow", embed: bool = False, compiled: bool = False, modes: ModesAs | str = "output",
    fixed_step: float | str | None = None, tables: Sequence[str] = (), check: bool = True, strict: bool = False,
    report: Report | None = None,
) -> Export:  # fmt: skip
    """Export a drive as an FMU: a model and a compiled run-time that need no Python.

    Open connectors (a netlist's `expose`), adaptors that nothing drives and inputs without value are its inputs and
    outputs, in FMI 3 also terminals.

    Args:
        drive: a component, a netlist file, or a compiled model.
        path: the FMU to write.
        version: FMI version, `2.0` or `3.0`.
        kind: `me` (Model Exchange), `cs` (Co-Simulation) or both.
        platforms: `native`, `all`, names such as `x86_64-windows`, or none for sources only.
        outputs: patterns of additional outputs, such as `*.w`.
        ends: free connectors of parts to open, such as `load.flange_b`.
        takes: what open ends take from outside: the `flow` (torque, force, current, heat flow) or the `potential`.
        embed: compile the model into the binaries, for importers that do not pass the location of resources.
        compiled: compile the equations, too: the same results, faster. The model is then in the binaries.
        modes: `output` (enumerations), `local` (enumerations without output), or `integer` (outputs).
        fixed_step: step size of Co-Simulation in s, or such as "1 ms", for hardware in the loop: the work of a step is
            bounded, and a communication step is a whole number of them. By default accuracy chooses the steps.
        tables: patterns of tables with tunable numbers, such as `*.mu_pos`: arrays in FMI 3, scalars in FMI 2.
        check: run the FMU, if it has a binary for this machine, against IDAS; a picture shows where they differ.
        strict: do not write an FMU that differs from IDAS.
        report: called with the present activity.

    Raises:
        ExportError: it cannot be exported or compiled, or fails a check; nothing is written then.
        UnknownName: there is no such version, kind, platform, connector, variable or `modes`.
        MissingExtra: binaries for other platforms need zig.
        ModelicaLikeError: the model has an error.
    """
    begin, tell, target = time.perf_counter(), report or silent, target_file(path, ".fmu", "An FMU")
    chosen, kinds, names = known_version(version, Version, "FMI"), _kinds(kind), chosen_platforms(platforms)
    fixed, form = _fixed_step(fixed_step, kinds), _modes(modes)
    tell("compiling the model")
    model, description, equations = compiled_open(drive := loaded(drive), ends, takes, tables)
    _check_letters(model)
    tell("writing the model")
    about = _about(model, chosen, kinds, description, fixed, compiled=compiled)
    files = _contents(model, interface(model, outputs, form), about, equations, embed, _pictures(drive))
    files |= _binaries(files, identifier(model.name), chosen, names, embed or compiled, tell)
    tell("checking")
    checked = _written(files, target, model, about, check and native_platform() in names, strict)
    return Export(target, chosen, kinds, names, target.stat().st_size, time.perf_counter() - begin, checked)


def silent(_: str) -> None:
    """Report nothing."""


# -- what is asked for -------------------------------------------------------------------------------------------------


def _modes(modes: str) -> ModesAs:
    for word in get_args(ModesAs):
        if modes == word:
            return word
    raise UnknownName(f"Modes cannot be exported as '{modes}'.", advice=f"There are {', '.join(get_args(ModesAs))}.")


def _kinds(kind: Collection[str]) -> tuple[Kind, ...]:
    kinds = {kind} if isinstance(kind, str) else set(kind)
    for unknown in sorted(kinds - set(get_args(Kind))):
        raise UnknownName(
            f"There is no kind of FMU '{unknown}'.", advice="There are me (Model Exchange) and cs (Co-Simulation)."
        )
    if not kinds:
        raise ExportError("An FMU needs a kind.", advice="Ask for me (Model Exchange), cs (Co-Simulation) or both.")
    return tuple(word for word in get_args(Kind) if word in kinds)


def _fixed_step(step: float | str | None, kinds: tuple[Kind, ...]) -> float:
    size = positive_step(step)
    if size and "cs" not in kinds:
        raise ExportError(
            "A fixed step is for Co-Simulation, but only Model Exchange is exported.",
            why="In Model Exchange the importer chooses the steps.", advice="Also export cs.",
        )  # fmt: skip
    return size


def _check_letters(model: CompiledDae) -> None:
    """Refuse names that structured names of the standard cannot have."""
    for name in model.units:
        if not name.isascii():
            raise ExportError(
                f"An FMU of {model.name} cannot have the name '{name}': the standard knows the letters a to z only.",
                advice="Rename the part or the variable.",
            )


# -- the model ---------------------------------------------------------------------------------------------------------


def compiled_open(
    drive: Model, ends: Sequence[str], takes: Takes, tables: Sequence[str] = ()
) -> tuple[CompiledDae, str, Listing]:
    """Return a compiled model with its ends open, its description and its equations."""
    drive = loaded(drive)
    if isinstance(drive, CompiledDae):
        if ends or tables:
            what = "ends that could be opened" if ends else "tables whose numbers could become parameters"
            raise ExportError(f"A compiled model has no {what}.", advice="Export its netlist instead.")
        return as_asked(drive), "", ()
    if tables:
        drive = with_tunable_tables(drive, tables)
    flat = flatten(with_open_ends(drive, ends, takes), open_inputs=True)
    lines = ((i, [source.text or str(source) for source in i.template.sources]) for i in flat.instances)
    equations = [(instance.path, instance.template.component, texts) for instance, texts in lines if texts]
    about = inside(drive).description if isinstance(drive, Assembly) else ""
    return as_asked(compile(reduce(flat))), about, equations


def _pictures(drive: CompiledDae | Component) -> tuple[bytes, bytes]:
    """Return the icon of a drive as SVG and PNG; where nothing can be drawn, the general one."""
    general = [(_PICTURES / f"icon.{suffix}").read_bytes() for suffix in ("svg", "png")]
    if isinstance(drive, CompiledDae) or len(drive.parts) > _LEGIBLE:
        return general[0], general[1]
    svg, png = upper.icon(drive if drive.parts else with_open_ends(drive))
    return svg.encode(), png or general[1]


def _about(
    model: CompiledDae, version: Version, kinds: tuple[Kind, ...], description: str, fixed_step: float, *,
    compiled: bool,
) -> About:  # fmt: skip
    settings = model.settings
    end = seconds(settings["until"]) if "until" in settings else None
    points = int(settings.get("points", Options.points))
    step = (
        None
        if end is None
        else communication_step(end, fixed_step, points)
        if fixed_step
        else (end - model.begin) / points
    )
    return About(
        version=version, kinds=frozenset(kinds), token=_TOKEN, description=description, stop_time=end,
        tolerance=float(settings.get("rtol", Options.rtol)), step_size=step,
        sources=(*source_files(version), *([_CODE] if compiled else [])), log_categories=LOG_CATEGORIES, tool=tool(),
        fixed_step=fixed_step,
    )  # fmt: skip


def tool() -> str:
    """Return name and version of this package."""
    try:
        return f"modelica-like {version('modelica-like')}"
    except PackageNotFoundError:
        return "modelica-like"


# -- the files ---------------------------------------------------------------------------------------------------------


def _contents(
    model: CompiledDae, variables: Interface, about: About, equations: Listing, embed: bool, icon: tuple[bytes, bytes]
) -> dict[str, bytes]:  # fmt: skip
    """Return all files except the binaries, with a token from their content."""
    compiled = _CODE in about.sources
    texts = {"modelDescription.xml": model_description(model, variables, about)}
    texts |= {f"sources/{name}": text for name, text in runtime_sources((about.version,)).items()}
    texts["documentation/index.html"] = index_page(variables, about.description, about.tool, equations)
    texts["documentation/licenses/license.txt"] = licenses(about.version)
    pictures = {"model.png": icon[1]}
    if about.version == "3.0":
        texts["sources/buildDescription.xml"] = build_description(model.name, about.sources)
        texts["terminalsAndIcons/terminalsAndIcons.xml"] = terminals_and_icons(model.terminals, icon[1])
        kinds = dict.fromkeys(icon_name(terminal.kind) for terminal in model.terminals)
        shown = [_PICTURES / f"{kind}.{suffix}" for kind in kinds for suffix in ("png", "svg")]
        pictures = {f"terminalsAndIcons/{picture.name}": picture.read_bytes() for picture in shown}
        pictures |= {
            f"terminalsAndIcons/icon.{ending}": drawn for ending, drawn in zip(("svg", "png"), icon, strict=True)
        }
    seen = variables.variables + (variables.arrays if about.version == "3.0" else ())
    numbers = make_tables(model, variables.start)
    data = model_file(numbers, seen, _TOKEN, about.tolerance, about.fixed_step)
    if compiled:
        texts[f"sources/{_CODE}"] = _CODE_HEAD + straight(numbers)
    # A GUID that is a hash of the content.
    total = hashlib.sha256(data)
    for key in sorted(texts):
        total.update(f"{key}\0{texts[key]}\0".encode())
    digest = total.hexdigest()
    token = f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"
    data = with_token(data, _TOKEN, token)
    texts |= {name: text.replace(_TOKEN, token) for name, text in texts.items()}
    texts["sources/model_data.c"] = as_c(data, compiled=compiled)
    files: dict[str, bytes] = {name: text.encode() for name, text in texts.items()}
    files |= pictures
    return files if embed or compiled else files | {MODEL: data}


def _binaries(
    files: dict[str, bytes], name: str, version: Version, platforms: tuple[str, ...], embed: bool, tell: Report
) -> dict[str, bytes]:
    """Return the run-time for each platform, or one with the model compiled in, by path in the FMU."""
    home = "sources/"
    sources = {place.removeprefix(home): text.decode() for place, text in files.items() if place.startswith(home)}
    c_sources = {file: text for file, text in sources.items() if file.endswith((".c", ".h"))}
    binaries: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory(prefix="modelica_like_") as folder:
        for platform in platforms:
            if embed:
                tell(f"compiling for {platform}")
            library = build(c_sources, platform, Path(folder)) if embed else runtime_library(platform, tell)
            place = PLATFORMS[platform].fmi2 if version == "2.0" else platform
            binaries[f"binaries/{place}/{name}{library.suffix}"] = library.read_bytes()
    return binaries


def _written(
    files: dict[str, bytes], target: Path, model: CompiledDae, about: About, run: bool, strict: bool
) -> Check:  # fmt: skip
    """Write an FMU that passes its checks, after a comparison with IDAS; draw curves that differ next to it."""
    with replacing(target) as draft:
        write_archive(draft, files)
        faults = problems(draft)
        if faults:
            raise ExportError(
                f"The FMU does not pass its checks: {'; '.join(faults[:3])}.", why="This is an error of the exporter."
            )
        kind = "cs" if "cs" in about.kinds else "me"
        check = compare_with_idas(draft, model, kind, about.fixed_step) if run else Check()
        if strict and check.differs:
            raise ExportError(check.sentence, advice="Without `strict` it is still written, with a picture.")
    if not check.differs or check.curves is None:
        return check
    picture = target.with_name(f"{target.stem}_check.png")
    upper.save_plot(check.curves.plot(), picture)
    return replace(check, picture=picture)
