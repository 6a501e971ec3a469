"""Write validation.md from the tests: python docs/validation.py.

A row is one line of ROWS. Numbers in braces are constants of the row's test file, as it has them now: `{DRIVES}` the value,
`{len(SMALL)}` the number of entries.
"""
# ruff: noqa: E501 -- a row is one line, as on the page

from __future__ import annotations

import ast
import csv
import os
import re
from pathlib import Path
from typing import Any, NamedTuple

from modelica_like.writing import write_text

ROOT = Path(__file__).parents[1]
PAGE = Path(__file__).with_suffix(".md")


class Run(NamedTuple):
    """A longer run by hand: a variable of the environment, and what it counted, nothing before it was run.

    Attributes:
        value: of the variable. RANDOM_LAWS counts laws in blocks of 50, beside 12 of its own; NARROW_FORCES counts
            blocks: of n, 24 + 50·n forces and 12 + 25·n carriers; LIBRARY_DRIVES counts drives.
        counted: cases that ran, by kind.
    """

    value: int
    counted: dict[str, int | None]


BY_HAND = {
    "RANDOM_LAWS": Run(5000, {"": 5012}),
    "NARROW_FORCES": Run(20, {"forces": 1024, "carriers": 512}),
    "LIBRARY_DRIVES": Run(500, {"": 500}),
    "RANDOM_DRIVES": Run(2000, {"": 2000}),
}
"""`RANDOM_LAWS=5000 pytest tests/properties/test_random_laws.py`, `NARROW_FORCES=20 pytest tests/solve/test_edges.py`,
`LIBRARY_DRIVES=500 pytest tests/properties/test_library_drives.py -m slow`, `RANDOM_DRIVES=2000 pytest tests/exact -m
slow`: after a run write its counts here."""


def by_hand(variable: str, kind: str = "") -> str:
    """Return what follows the count of a test run: the count by hand and its command, or the command only."""
    value, counts = BY_HAND[variable]
    command, count = f"`{variable}={value}`", counts[kind]
    return f" in each test run{f' (more by {command})' if count is None else f'; {count:,} by hand ({command})'}"


class Row(NamedTuple):
    """What is compared with what.

    Attributes:
        what: the subject.
        against: what is independent of the product.
        cases: how many; with constants of the test in braces.
        near: what the test demands, likewise.
        test: its file or folder below tests/.
        constants: the file that has the constants, if it is another one.
    """

    what: str
    against: str
    cases: str
    near: str
    test: str
    constants: str = ""


ROWS = {
    "Trajectories": [
        Row("examples of the Modelica Standard Library 4.1.0", "its reference results (Dymola 2020x)", "{references} examples, {signals} signals", "{TUBE} of the range (its own criterion), {MEDIAN} in the median; sequences of modes equal", "system/test_msl_examples.py"),
        Row("the same", "closed forms", "every signal that has one", "1e-6 for most, by signal", "system/test_msl_closed_forms.py"),
        Row("start-up of a machine tool (document 003)", "its equations by hand, integrated by SciPy (DOP853); its numbers", "two of its variants", "event times 1e-6 s, slip energy 1e-6, samples 1e-5, peaks 1e-4", "system/test_machine_tool_startup.py"),
        Row("random rotational drives with friction, freewheels, impacts", "a solver in fractions", f"{{DRIVES}} drives{by_hand('RANDOM_DRIVES')}", "speeds {SPEED}, losses {LOSS}, balance {CLOSURE}; the same events", "exact/test_random_drives_exactly.py", "exact/drive_runs.py"),
        Row("small drives that once were wrong", "the same solver", "{len(SMALL)} drives", "the same", "exact/test_small_drives.py"),
        Row("random laws over all functions of the language", "plain Python in small steps", "{MANY[-1][-1] + 1} laws{by_hand('RANDOM_LAWS')}", "{NEAR}, the reference's own error; by both solvers, through Modelica text and FMUs", "properties/test_random_laws.py"),
        Row("masses that meet narrow forces on their way or in time", "energy and momentum", "{24 + 50 * BLOCKS} forces{by_hand('NARROW_FORCES', 'forces')}: widths from 1 µm to 0.1 m, speeds over six decades", "1e-5 of the speed; by both solvers, two as FMU", "solve/test_edges.py"),
        Row("masses that meet narrow smooth forces (Gaussian, rational, two steps, …) on their way", "energy", "{SEEDS * len(SHAPES)} forces: widths from 1 µm to 30 mm, speeds over six decades", "1e-5 of the speed; by both solvers, one as FMU", "exact/test_narrow_pulses.py"),
        Row("states without inertia that a narrow pulse slows or stops", "closed forms", "{8 * len(NARROW)} pulses: widths from 1e-7 to 1e-3 of a way of 2", "a few tolerances, as often as the state is slower; by both solvers", "exact/test_narrow_pulses.py"),
        Row("relations with fast functions of time", "fixed small steps", "{12 + 25 * BLOCKS} carriers{by_hand('NARROW_FORCES', 'carriers')}", "2e-6 and 2e-5 of the duration; by both solvers", "solve/test_edges.py"),
        Row("rams with friction through their dead centres", "SciPy (DOP853), with its events", "one crank with two frictions, in three orders of lines", "1e-7, by both solvers", "solve/test_dead_centres.py"),
        Row("new speeds at events and at the start: friction, claws, freewheels, springs between bodies", "closed forms, momentum", "18 drives, {len(AT_STARTS)} of them with sources that set their speed", "1e-6 of speeds, positions and derivatives, most 1e-8; by both solvers, one as FMU", "solve/test_new_values.py"),
        Row("largest values, integrals and means of runs", "closed forms; document 003 in small steps", "runs of 1 to 300 s with 5 to 500 results", "1e-6, whatever is written of a run", "runs/test_readings.py"),
        Row("readings of pulses that no state feels, narrower than the steps; a press at a given speed", "closed forms", "{len(PULSES)} shapes at a place and in time, widths from 1e-6 to 1e-2 of the run; by both solvers, native sweeps, energies", "1e-7 of the integral, 1e-8 of the peak; 1e-5 in sweeps", "runs/test_windows.py"),
        Row("largest values, integrals and means of runs of FMUs and of co-simulations", "closed forms", "every kind of reading, with 7 to 500 results, fixed and variable steps", "1e-5 of the largest amount, 3e-5 of co-simulations, or a refusal in words", "fmus/test_fmu_readings.py"),
        Row("gradients of random drives", "differences of runs in fractions, steps of 2^-70", "{len(SMOOTH) + len(TIES) + len(EDGES)} drives", "{PRECISE}", "exact/test_gradients_exactly.py"),
        Row("derivatives by parameters that are zero or at a bound", "one-sided differences of runs at 1e-10, in smaller and smaller steps", "{len(QUICK) + len(OFTEN)} examples, all others by hand", "1e-2, which tells a kink; else both sides are told", "analyse/test_parameters_at_kinks.py"),
        Row("random trees of inertias, gears, planetary sets, springs, clutches", "laws: energy, order of lines, signs, inertias in two", "{EXAMPLES} drives for each law", "{SAME} of the largest speed", "properties/test_properties.py"),
    ],
    "Engines against each other": [
        Row("random drives of all types", "IDAS, compiled run-time, FMU by FMPy in both kinds", "{COUNT} drives{by_hand('LIBRARY_DRIVES')}, of nearly all {types} types", "{SAME} at once, or {CONVERGED} at a hundredth of the tolerance; else a refusal in words", "properties/test_library_drives.py"),
        Row("starts, events at one instant, impacts, sharing", "Python and C, call by call", "every example with a mode that holds", "1e-6 and less, by call", "fmi/test_pairs.py"),
        Row("every example as an FMU of FMI 2.0 and 3.0", "FMPy, ecos, libcosim: [importers](importers.md)", "{exports} exports", "marks in that table", "fmi/test_export.py"),
    ],
    "Formulas": [
        Row("components in small drives", "closed forms; the energy balance", "{drives} netlists", "by form; the balance to 1e-8", "library/test_examples.py"),
        Row("design checks", "the worked numbers of the documents", "{published} published values", "digits printed; errors of the documents are [listed](sizing.md)", "sizing"),
        Row("strength of gears", "printed tables; another program (din3990)", "{len(TABLE)} rows of a table, one pair", "8e-3 for rounded numbers, 1e-4", "sizing/test_gears.py"),
        Row("undercut of gears", "a rack moved past the flank in small steps", "four gears", "2e-4 of the roll angle", "sizing/test_gears.py"),
    ],
    "Input": [
        Row("mutated and crossed netlists, drives of all types, formulas, units, command lines, tables (CSV), Modelica text, sizing files, systems, FMUs, archives", "no raw error, no endless run", "{INPUTS} in each test run; 100,000 by hand", "none", "fuzz/test_fuzz.py"),
    ],
}  # fmt: skip

LEFT = """## What is not covered

- No measurement of a real drive: all references are documents, formulas or other programs.
- Random drives join parts with values near those of the examples; orders of magnitude that no example has are tried only in the random rotational drives.
- Types that fix a start or choose states (`InitializeFlange`, `RelativeStates` and their translational ones), `Lepelletier` and those that only parts of assemblies use are not in random drives.
- Where engines agree, they may be wrong together: what the first table does not compare is only as good as the laws of its components.
- The official examples of ISO 6336 (ISO/TR 6336-30) and DIN 743 are not public. Assembly of internal pairs (radial insertion) is not checked.
- The run-time for ARM runs in an emulator of the processor, to the bit as here, that for Windows in one of the system, within 1e-9 (`fmi/test_elsewhere.py`); that for macOS is compiled, and only its exports are read.
"""


def constants(path: Path) -> dict[str, Any]:
    """Return the constants of a file whose values need nothing but numbers, or stand-ins with as many entries."""
    known: dict[str, Any] = {"os": os, "int": int, "range": range, "len": len}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
            if not isinstance(target, ast.Name):
                continue
            try:
                known[target.id] = eval(compile(ast.Expression(node.value), str(path), "eval"), known)  # noqa: S307
            except (NameError, AttributeError, TypeError):
                entries = getattr(node.value, "keys", None) or getattr(node.value, "elts", [])
                known[target.id] = [None] * len(entries)
    return known


def counted() -> dict[str, Any]:
    """Return the numbers that are counted in folders and pages."""
    tables = sorted((ROOT / "tests" / "data" / "msl").glob("*.csv"))
    heads = [next(csv.reader(path.read_text(encoding="utf-8").splitlines())) for path in tables]
    sizing = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "examples" / "sizing").glob("*.toml"))
    tables_of = re.findall(r"^published = \{([^}]*)\}|^\[checks\.\w+\.published\]\n((?:\w.*\n)*)", sizing, re.MULTILINE)
    rows = re.findall(
        r"^\| [\w/]+ \| [23]\.0 \|", (ROOT / "docs" / "importers.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    declared = (ROOT / "tests" / "library" / "declarations.txt").read_text(encoding="utf-8")
    return {
        "references": len(tables), "exports": len(rows), "published": sum((a + b).count("=") for a, b in tables_of),
        "signals": sum(name != "time" and not name.endswith(".mode") for head in heads for name in head),
        "drives": len([one for name in ("components", "elements") for one in (ROOT / "examples" / name).glob("*.toml")]),
        "types": len(re.findall(r"^\w+", declared, re.MULTILINE)),
    }  # fmt: skip


def _filled(text: str, values: dict[str, Any]) -> str:
    def number(found: re.Match[str]) -> str:
        value = eval(found[1], {"by_hand": by_hand}, values)  # noqa: S307 -- written above
        return value if isinstance(value, str) else format(value, "g" if isinstance(value, float) else ",")

    return re.sub(r"\{([^}]+)\}", number, text)


def page() -> str:
    """Return the page."""
    lines = [
        "# Validation",
        "",
        "Against what the product is compared, how many cases, and how near they must be. `python docs/validation.py` writes this page from the tests; numbers are theirs.",
    ]
    known = counted()
    for head, rows in ROWS.items():
        lines += ["", f"## {head}", "", "| what | against | how many | how near | test |", "|---|---|---|---|---|"]
        for row in rows:
            path = ROOT / "tests" / (row.constants or row.test)
            values = known | (constants(path) if path.is_file() else {})
            cases, near = (_filled(text, values) for text in (row.cases, row.near))
            lines.append(f"| {row.what} | {row.against} | {cases} | {near} | [{row.test}](../tests/{row.test}) |")
    return "\n".join([*lines, "", LEFT])


if __name__ == "__main__":
    write_text(PAGE, page())
