"""Files of a page: the netlist, what another editor writes into it meanwhile, and exports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from modelica_like.errors import DuplicateName, NetlistError
from modelica_like.fmi.export import export_fmu
from modelica_like.language import Assembly
from modelica_like.netlist import save as save_netlist
from modelica_like.netlist.modelica.write import modelica_text
from modelica_like.page.desk import Desk, read
from modelica_like.page.runs import Runs
from modelica_like.show.draw import save_schematic
from modelica_like.show.report.page import save_report
from modelica_like.simulation import simulate
from modelica_like.writing import write_text

FILES = {"netlist": ".toml", "FMU": ".fmu", "report": ".html", "Modelica text": ".mo", "picture": ".svg"}
"""What can be written, with the endings."""


def beside(path: Path, name: str) -> Path:
    """Return a file in the folder of a netlist.

    Raises:
        NetlistError: the name leads out of the folder, or is none of a netlist.
    """
    other = path.parent / name
    inside = name == Path(name).name and other.resolve().parent == path.resolve().parent
    if not inside or other.suffix != ".toml":
        raise NetlistError(
            f"'{name}' is no netlist of the folder '{path.resolve().parent}'.",
            advice="The page opens and writes files of this folder only, with names that end with .toml.",
        )
    return other


def save(desk: Desk, name: str | None = None) -> None:
    """Write a netlist, and those that `group` has made.

    Args:
        desk: the netlist.
        name: of another file in the folder; it must not exist.

    Raises:
        NetlistError: the name leads elsewhere, or another editor has written the file meanwhile.
        DuplicateName: there is such a file.
        OSError: it cannot be written.
    """
    target = beside(desk.path, name) if name else desk.path
    with desk.lock:
        if target.resolve() != desk.path.resolve() and target.exists():
            raise DuplicateName(f"'{target.name}' exists already.", advice="Choose another name.")
        if target.resolve() == desk.path.resolve() and read(target) != desk.on_disk:
            raise NetlistError(
                f"'{target.name}' has been changed by another program.", advice="Choose which of the two texts stays."
            )
        desk.document.save(target)
        desk.on_disk = desk.document.text


def look(desk: Desk) -> str | None:
    """Take over what another editor has written, if the page has no changes of its own.

    Returns:
        The text of the file, if both have changed.
    """
    with desk.lock:
        text = read(desk.path)
        if text is None or text == desk.on_disk:
            return None
        if not desk.is_saved and text != desk.document.text:
            return text
        desk.on_disk = text
        if text != desk.document.text:
            desk.change(lambda document: document.write(text))
        return None


def settle(desk: Desk, *, theirs: bool) -> None:
    """Let the text of the file, or that of the page, be the right one; the other can be had again by undo."""
    with desk.lock:
        desk.on_disk = read(desk.path)
        text = desk.on_disk
        if theirs and text is not None:
            desk.change(lambda document: document.write(text))


def _report(drive: Assembly, until: float, path: Path) -> None:
    save_report(drive, simulate(drive, until), path)


def _fmu(drive: Assembly, until: float, path: Path) -> None:
    export_fmu(drive, path)


def _modelica(drive: Assembly, until: float, path: Path) -> None:
    write_text(path, modelica_text(drive))


_WRITERS: dict[str, Callable[[Assembly, float, Path], None]] = {
    "netlist": lambda drive, until, path: save_netlist(drive, path), "FMU": _fmu, "report": _report,
    "Modelica text": _modelica, "picture": lambda drive, until, path: save_schematic(drive, path),
}  # fmt: skip


def export(runs: Runs, what: str, values: Sequence[tuple[int, float]], folder: Path, name: str) -> Path:
    """Write a drive as another kind of file, without overwriting any.

    Args:
        runs: the drive.
        what: one of `FILES`.
        values: of parameters that sliders have changed.
        folder: for the file.
        name: of the file, without ending; a copy of the netlist is called otherwise.

    Returns:
        The file.

    Raises:
        KeyError: there is no such kind.
        ModelicaLikeError: the values are wrong, or it cannot be run or exported.
        OSError: it cannot be written.
    """
    ending, stem = FILES[what], f"{name}_copy" if what == "netlist" else name
    drive = runs.changed(values)
    path = next(
        path for number in range(10_000)
        if not (path := folder / f"{stem}{f'_{number}' if number else ''}{ending}").exists()
    )  # fmt: skip
    _WRITERS[what](drive, runs.until, path)
    return path
