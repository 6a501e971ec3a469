"""Write the table of importers.md: python docs/importers.py [DRIVE ...].

Builds the reference FMUs, exports the drives of examples/ as FMUs of both versions of the standard, and runs all checks
of `modelica-like validate` on each. With names, only these drives are done again.
"""

from __future__ import annotations

import importlib.util
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from modelica_like.fmi.export import export_fmu
from modelica_like.fmi.validate import FAILED, PASSED, Validation, validate_fmu
from modelica_like.writing import write_text

HERE = Path(__file__).parent
PAGE = HERE / "importers.md"
EXAMPLES = HERE.parent / "examples"
VERSIONS = ("2.0", "3.0")

HEADS = ("", "FMI", "schemas", "FMPy checks", "FMPy ME, CVode", "FMPy ME, Euler", "FMPy CS", "ecos CS", "libcosim CS")
COLUMNS = ("fmpy validate_fmu", "FMPy ME CVode", "FMPy ME Euler", "FMPy CS", "ecos CS", "libcosim CS")
SECTIONS = {"reference": "<!-- reference FMUs -->", "exports": "<!-- exports -->"}


def drives() -> list[str]:
    """Return the netlists of examples/, by name, but for those that are made of FMUs themselves."""
    netlists = (path.relative_to(EXAMPLES) for path in EXAMPLES.rglob("*.toml") if _is_netlist(path))
    return sorted(path.with_suffix("").as_posix() for path in netlists if path.parts[0] != "cosim")


def _is_netlist(path: Path) -> bool:
    return "parts" in tomllib.loads(path.read_text(encoding="utf-8"))


def mark(validation: Validation, name: str) -> str:
    """Return what the table says about one check."""
    check = validation[name]
    if "the importer is at fault" in check.sentence:
        return "crashes¹"
    return {PASSED: "✓", FAILED: "**fails**"}.get(check.verdict, "–")


def row(label: str, version: str, validation: Validation) -> str:
    """Return one line of the table."""
    schemas = [check for check in validation.checks if check.name.startswith(("archive", "schema"))]
    sound = "✓" if all(check.verdict != FAILED for check in schemas) else "**fails**"
    known = {check.name for check in validation.checks}
    cells = (mark(validation, name) if name in known else "**fails**" for name in COLUMNS)
    return f"| {' | '.join((label, version, sound, *cells))} |"


def reference_rows(folder: Path) -> list[str]:
    """Build and check the reference FMUs."""
    spec = importlib.util.spec_from_file_location("build_reference_fmus", HERE.parent / "fmus" / "build.py")
    assert spec is not None
    assert spec.loader is not None
    builder: Any = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = builder
    spec.loader.exec_module(builder)
    return [
        row(path.stem.rpartition("_fmi")[0], f"{path.stem[-1]}.0", validate_fmu(path))
        for path in builder.build(target=folder)
    ]


def export(drive: str, version: str, folder: Path) -> Path:
    """Export one drive."""
    path = folder / f"{Path(drive).name}_fmi{version[0]}.fmu"
    export_fmu(EXAMPLES / f"{drive}.toml", path, version, check=False)
    return path


def drive_rows(drive: str, folder: Path) -> list[str]:
    """Export and check one drive, in both versions of the standard."""
    return [row(drive, version, validate_fmu(export(drive, version, folder))) for version in VERSIONS]


def rows(section: str) -> list[str]:
    """Return the lines of one table of the page."""
    text = PAGE.read_text(encoding="utf-8").partition(SECTIONS[section])[2]
    lines = text.strip().split("\n\n")[0].splitlines()
    return lines[2:]


def replace(section: str, lines: list[str]) -> None:
    """Write one table of the page."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(SECTIONS[section])
    after = rest.strip().partition("\n\n")[2]
    head = [f"| {' | '.join(HEADS)} |", f"|{'---|' * len(HEADS)}"]
    write_text(PAGE, "\n".join([f"{before}{SECTIONS[section]}", *head, *lines, "", after]))


def main(chosen: list[str]) -> None:
    """Write the tables."""
    with tempfile.TemporaryDirectory() as work:
        if not chosen:
            replace("reference", reference_rows(Path(work)))
        known = {line.split(" | ")[0].lstrip("| "): [] for line in rows("exports")} if chosen else {}
        for line in rows("exports") if chosen else ():
            known[line.split(" | ")[0].lstrip("| ")].append(line)
        for drive in chosen or drives():
            known[drive] = drive_rows(drive, Path(work))
            sys.stdout.write("\n".join([*known[drive], ""]))
            sys.stdout.flush()
        replace("exports", [line for drive in sorted(known) for line in known[drive]])


if __name__ == "__main__":
    main(sys.argv[1:])
