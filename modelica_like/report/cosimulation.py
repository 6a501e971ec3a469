"""What a co-simulation was: mode changes, energies at the couplings and communication steps as tables."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

from modelica_like.cosimulation.solution import CosimSolution
from modelica_like.report.run import events_table
from modelica_like.report.types import table


def cosimulation_report(solution: CosimSolution) -> RenderableType:
    """Return mode changes, energies at the couplings and communication steps of a run."""
    span = f"{solution.time[0]:g} s to {solution.time[-1]:g} s"
    parts: list[RenderableType] = [f"[bold]{escape(solution.model.name)}[/]  {span}"]
    if solution.events:
        parts += ["", events_table(solution)]
    parts += [f"[bold]{escape(notice)}[/]" for notice in solution.notices]
    if solution.couplings:
        parts += ["", couplings_table(solution)]
    parts += ["", f"[dim]{steps_line(solution)}[/]"]
    return Group(*parts)


def couplings_table(solution: CosimSolution) -> Table:
    """Return the energies at the couplings: what one FMU has sent and the other has not got, the coupling has lost."""
    rows = [
        (one.name, f"{one.throughput:.6g}", f"{one.residual:.3g}",
         f"{one.residual / one.throughput:.1e}" if one.throughput else "", f"{one.mismatch:.3g}")
        for one in solution.couplings
    ]  # fmt: skip
    return table(
        "energy at the couplings in J", "coupling", "through>", "made by it>", "share>", "mismatch>", rows=rows
    )


def steps_line(solution: CosimSolution) -> str:
    """Return how many communication steps it took."""
    sizes = f"{solution.shortest:.3g} s"
    if solution.longest > solution.shortest * (1 + 1e-6):
        sizes += f" to {solution.longest:.3g} s"
    back = f", {solution.rejected} taken back" if solution.rejected else ""
    return f"{solution.steps} communication steps of {sizes}{back}, {solution.statistics.seconds:.2f} s"
