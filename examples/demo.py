"""The drives of two published start-ups, computed against the published numbers: `modelica-like demo` prints them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table

from modelica_like.cli.shared import Page
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import NetlistError
from modelica_like.netlist import load
from modelica_like.runs.solution import Solution
from modelica_like.show.plot import plot, save_plot
from modelica_like.show.report.run import closure_line, energy_table, events_table, statistics_line
from modelica_like.show.report.tables import Shown, table
from modelica_like.simulation import build, simulate

EXAMPLES = Path(__file__).parent


class Runs:
    """The runs of one model that the numbers are taken from; each is made when it is asked for."""

    def __init__(self, model: CompiledDae) -> None:
        self.model = model

    @cached_property
    def whole(self) -> Solution:
        """The run of the netlist, with points so close that no peak between two of them is missed."""
        return simulate(self.model, points=4000)

    @cached_property
    def start(self) -> Solution:
        """The run until the clutch locks."""
        return simulate(self.model, lock_up(self.whole))

    @cached_property
    def settled(self) -> Solution:
        """A run long enough for all oscillations to decay."""
        return simulate(self.model, "5 s")


@dataclass(frozen=True)
class Number:
    """One number of a start-up.

    Attributes:
        name: what it is.
        unit: its unit.
        expected: exact value, by a formula or by an independent calculation in full precision.
        computed: how it follows from the runs.
        published: as printed in the document, or None.
    """

    name: str
    unit: str
    expected: float
    computed: Callable[[Runs], float]
    published: float | None = None


@dataclass(frozen=True)
class Case:
    """A netlist with values to set, and known results of its run.

    Attributes:
        netlist: file in the folder of examples.
        title: heading.
        source: where the expected values come from.
        settings: values to set before the run.
    """

    netlist: str
    title: str
    source: str
    numbers: tuple[Number, ...]
    settings: tuple[tuple[str, str], ...] = ()


def lock_up(run: Solution) -> float:
    """Return the time in s when the clutch locks for the first time.

    Raises:
        NetlistError: it never does.
    """
    for event in run.events:
        if event.mode == "clutch.mode" and event.after == "stuck":
            return event.time
    raise NetlistError(f"The clutch of {run.model.name} does not lock.")


def _peak(name: str) -> Callable[[Runs], float]:
    return lambda runs: float(abs(runs.whole[name]).max())


def _table_numbers(
    capacity: float, load: float, slip: float, kinetic: float, printed: tuple[float, float]
) -> tuple[Number, ...]:
    return (
        Number("lock-up time", "s", 0.2, lambda runs: lock_up(runs.whole), 0.2),
        Number(
            "clutch torque, slipping", "N.m", capacity, lambda runs: -float(runs.whole["clutch.tau"][0]), printed[0]
        ),
        Number("clutch torque, locked", "N.m", load, lambda runs: -runs.whole.final["clutch.tau"], load),
        Number("slip energy", "J", slip, lambda runs: runs.whole.energy()["clutch"].lost, printed[1]),
        Number("motor work until lock-up", "J", 2 * slip, lambda runs: runs.start.energy()["motor"].source),
        Number("kinetic energy at lock-up", "J", kinetic, lambda runs: runs.start.energy().stored),
        Number("table travel at lock-up", "m", 0.15, lambda runs: runs.start.final["table.s"]),
        Number("table speed", "m/s", 1.5, lambda runs: runs.whole.final["table.v"], 1.5),
    )


def _tool_numbers(lock: float, shaft1: float, shaft2: float, clutch: float, slip: float) -> tuple[Number, ...]:
    return (
        Number("lock-up time", "s", lock, lambda runs: lock_up(runs.whole)),
        Number("peak torque, motor shaft", "N.m", shaft1, _peak("shaft1.tau")),
        Number("peak torque, driven shaft", "N.m", shaft2, _peak("shaft2.tau")),
        Number("peak torque, clutch", "N.m", clutch, _peak("clutch.tau")),
        Number("slip energy", "J", slip, lambda runs: runs.whole.energy()["clutch"].lost),
        Number("speed, settled", "rad/s", 32.3528, lambda runs: runs.settled.final["J4.w"]),
    )


def cases() -> tuple[Case, ...]:
    """Return the start-ups of the demo."""
    formula = "clutch sizing by momentum and energy balance, evaluated in full precision"
    other = "independent calculation (Radau, regularised friction and event location)"
    return (
        Case(
            "machine_table_direct.toml", "Machine table, motor drives the spindle directly", formula,
            _table_numbers(86.784324, 15.0, 5452.8196, 4510.342, (86.63, 5443)),
        ),
        Case(
            "machine_table_geared.toml", "Machine table, motor drives through a gear", formula,
            _table_numbers(414.442934, 62.5, 6249.6519, 5307.174, (414.62, 6252)),
        ),
        Case(
            "machine_tool_startup.toml", "Machine tool, multi-plate clutch, h1 = 10 N.m.s/rad", other,
            _tool_numbers(0.2655, 494.83, 552.81, 604.89, 537.7),
        ),
        Case(
            "machine_tool_startup.toml", "Machine tool, multi-plate clutch, h1 = 1.2 N.m.s/rad", other,
            _tool_numbers(0.26529, 512.22, 549.10, 604.7, 537.5), (("h1", "1.2 N.m.s/rad"),),
        ),
    )  # fmt: skip


def run_case(case: Case, examples: Path) -> tuple[Runs, float]:
    """Simulate a case.

    Args:
        case: what to run.
        examples: folder of the netlists.

    Returns:
        The runs, and the seconds for everything from reading the netlist to the last point.
    """
    begin = time.perf_counter()
    assembly = load(examples / case.netlist)
    for path, value in case.settings:
        assembly.set(path, value)
    runs = Runs(build(assembly))
    _ = runs.whole
    return runs, time.perf_counter() - begin


def comparison(case: Case, runs: Runs) -> Table:
    """Return computed values beside expected and published ones."""
    rows: list[tuple[Any, ...]] = []
    for number in case.numbers:
        value = number.computed(runs)
        published = Shown("", None) if number.published is None else number.published
        rows.append((number.name, value, number.expected, value / number.expected - 1, published, number.unit))
    heads = "quantity", "computed>.7g", "expected>.7g", "deviation>+.1e", "published>g", "unit"
    return table(case.title, *heads, rows=rows)


def pages(examples: Path, pictures: Path) -> Iterator[RenderableType]:
    """Run all cases, write their pictures, and yield one page each."""
    for k, case in enumerate(cases(), 1):
        runs, seconds = run_case(case, examples)
        run = runs.whole
        picture = pictures / f"{k}_{run.model.name}.png"
        save_plot(plot(run, title=case.title), picture)
        source = f"[dim]expected: {case.source}[/]"
        taken = f"[dim]{statistics_line(run)}; {seconds:.2f} s with reading and compiling\npicture: {picture}[/]"
        energy = (energy_table(run), f"[dim]{closure_line(run)}[/]")
        yield Group(comparison(case, runs), source, "", events_table(run), "", *energy, "", taken, "")


def run_demo(output: Page, pictures: Path) -> None:
    """Print all pages."""
    begin = time.perf_counter()
    for page in pages(EXAMPLES, pictures):
        output.print(page)
    output.print(f"All in {time.perf_counter() - begin:.1f} s.")
