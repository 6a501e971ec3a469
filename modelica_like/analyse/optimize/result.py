"""Results of optimisations: the design, what limits it, and what a limit costs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.written import with_values
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import LanguageError, UnknownName, did_you_mean
from modelica_like.language import Assembly, Component
from modelica_like.language.units import Unit
from modelica_like.style import COLOURS, picture
from modelica_like.upper import Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.runs.solution import Solution

_DIGITS = 10
"""Of values in a netlist: searches know less."""
_WITHIN = 1e-6
"""Excess of a limit over its size that counts as none."""
_AT_BOUND = 1e-6
"""Distance from a bound, relative to that of both: at it."""
_ROUNDED = 1e-8
"""Likewise: so near to a bound, the netlist has the bound; searches come no nearer."""


class _InUnit:
    unit: Unit

    @property
    def unit_text(self) -> str:
        """The unit as text; empty for plain numbers."""
        return "" if (shown := str(self.unit)) in ("1", "*") else shown


@dataclass(frozen=True)
class Chosen(_InUnit):
    """A free parameter with its bounds, its value before and the best one, in SI units."""

    name: str
    unit: Unit
    low: float
    high: float
    before: float
    value: float

    @property
    def written(self) -> float | str:
        """Its best value as in a netlist: with its unit, or as a number in a cell of a table."""
        ends = [end for end in (self.low, self.high) if abs(self.value - end) <= _ROUNDED * (self.high - self.low)]
        number = f"{[*ends, self.value][0]:.{_DIGITS}g}"
        return float(number) if self.name.endswith("]") or not self.unit_text else f"{number} {self.unit_text}"

    @property
    def at_bound(self) -> str:
        """Which bound it stopped at: `lower`, `upper` or nothing."""
        near = _AT_BOUND * (self.high - self.low)
        return "lower" if self.value - self.low <= near else "upper" if self.high - self.value <= near else ""


@dataclass(frozen=True)
class Measured(_InUnit):
    """An objective or a limited output in a load case, in SI units.

    Attributes:
        text: as written.
        name: of the output.
        unit: its unit.
        case: load case.
        before: value of the drive as it was.
        value: of the best design.
        limit: nan of an objective.
        excess: by how much the limit is exceeded; negative below it.
        broken: whether it is exceeded by more than rounding.
        price: derivative of the objective by the limit; 0 where it does not matter.
    """

    text: str
    name: str
    unit: Unit
    case: str
    before: float
    value: float
    limit: float = np.nan
    excess: float = 0.0
    broken: bool = False
    price: float = 0.0

    @property
    def within(self) -> str:
        """Its load case, for sentences."""
        return f" in the load case '{self.case}'" if self.case else ""


@dataclass(frozen=True, eq=False)
class Optimum(Shown):
    """The best design.

    Attributes:
        model: compiled, with the best values.
        parameters: what is free.
        chosen: what was chosen, by path.
        objectives: in each load case.
        limits: in each load case.
        feasible: whether all limits hold; if not, the design breaks them least.
        optimal: whether the conditions of an optimum hold there.
        runs: number of simulations.
        history: objective and largest relative excess of a limit of all designs tried, shape (designs, 2).
        combinations: objective of each combination of choices; nan where limits cannot be met.
        notes: sentences about the search.
        drive: the drive as it was, with what was chosen.
        run: arguments of its runs, in the load case that is worst.
    """

    model: CompiledDae
    parameters: tuple[Chosen, ...]
    chosen: Mapping[str, Any]
    objectives: tuple[Measured, ...]
    limits: tuple[Measured, ...]
    feasible: bool
    optimal: bool
    runs: int
    history: Vector = field(repr=False)
    combinations: tuple[tuple[Mapping[str, Any], float], ...] = field(default=(), repr=False)
    notes: tuple[str, ...] = ()
    drive: Component | None = field(default=None, repr=False)
    run: Mapping[str, Any] = field(default_factory=dict[str, Any], repr=False)

    def __getitem__(self, name: str) -> float:
        """Return a value of the best design: a free parameter, or the worst of an objective or limited output.

        Raises:
            UnknownName: it is none of these.
        """
        values = {parameter.name: parameter.value for parameter in self.parameters}
        for measured in (*self.objectives, *sorted(self.limits, key=lambda limit: -limit.excess)):
            values.setdefault(measured.name, measured.value)
        if name not in values:
            raise UnknownName(f"The optimum has no '{name}'{did_you_mean(name, values) or '.'}")
        return values[name]

    @property
    def values(self) -> dict[str, float]:
        """Best values in SI units by path, as `parameters` of a run."""
        return {parameter.name: parameter.value for parameter in self.parameters}

    def simulate(self, *, before: bool = False) -> Solution:
        """Run the best design, or the drive as it was, in the load case that is worst.

        Raises:
            ModelicaLikeError: a run fails.
        """
        from modelica_like.simulation import simulate

        given = {parameter.name: parameter.before for parameter in self.parameters} if before else self.values
        return simulate(self.model, **{**self.run, "parameters": {**self.run.get("parameters", {}), **given}})

    def save(self, path: str | Path) -> None:
        """Write the drive with the best values as a netlist.

        Raises:
            LanguageError: the drive is no netlist.
        """
        from modelica_like.netlist import save

        save(self.best_drive(), path)

    def best_drive(self) -> Assembly:
        """Return the drive with the best values.

        Raises:
            LanguageError: the drive is no netlist.
        """
        if not isinstance(self.drive, Assembly):
            raise LanguageError(
                "Only a drive of a netlist can be saved as one.",
                advice="The values are in `values`, the model in `model`.",
            )
        return with_values(self.drive, {parameter.name: parameter.written for parameter in self.parameters})

    def sentences(self) -> list[str]:
        """Return what holds the design back, what that costs, and notes."""
        objective = self.objectives[0]
        sentences: list[str] = []
        active = [limit for limit in self.limits if limit.price and not limit.broken]
        for text in dict.fromkeys(limit.text for limit in active):
            # Who moves a limit moves it in all load cases.
            same = [limit for limit in active if limit.text == text]
            price = sum(limit.price for limit in same)
            more, change = same[0].unit_text or "unit", f"{price:+.4g} {objective.unit_text}".rstrip()
            cases = ", ".join(f"'{limit.case}'" for limit in same if limit.case)
            within = f" in the load case{'s' * (len(same) > 1)} {cases}" if cases else ""
            sentences.append(f"'{text}' is active{within}: with 1 {more} more, {objective.name} changes by {change}.")
        ends = {end: [p.name for p in self.parameters if p.at_bound == end] for end in ("lower", "upper")}
        sentences += [f"At the {end} bound: {', '.join(names)}." for end, names in ends.items() if names]
        return [*sentences, *self.notes]

    def plot(self) -> Figure:
        """Draw the objective of all designs tried, those that exceed a limit apart."""
        objective = self.objectives[0]
        values, within = self.history[:, 0], self.history[:, 1] <= _WITHIN
        with picture(f"{self.model.name}: {objective.name}", 1, 3.2) as (figure, (axes,)):
            tried = np.arange(1, len(values) + 1)
            axes.plot(tried, values, color="#bbbbbb", linewidth=0.8)
            axes.plot(tried[within], values[within], "o", markersize=4, color=COLOURS[0], label="within all limits")
            axes.plot(tried[~within], values[~within], "x", markersize=5, color=COLOURS[1], label="exceeds a limit")
            axes.set_xlabel("design")
            axes.set_ylabel(" ".join(filter(None, [objective.name, f"in {objective.unit_text}"])))
            axes.legend(loc="best")
        return figure

    def __str__(self) -> str:
        width = max(len(row.name) for row in (*self.parameters, *self.objectives, *self.limits))
        lines = [f"{self.model.name}: {self.runs} runs"]
        lines += [f"  {path:{width}}  {label}" for path, label in self.chosen.items()]
        for parameter in self.parameters:
            change = f"{parameter.before:12.6g} → {parameter.value:12.6g}"
            lines.append(f"  {parameter.name:{width}}  {change} {parameter.unit_text}".rstrip())
        for row in (*self.objectives, *self.limits):
            limit = "" if np.isnan(row.limit) else f"  ({row.text})"
            case = f"  [{row.case}]" if row.case else ""
            lines.append(f"  {row.name:{width}}  {row.before:12.6g} → {row.value:12.6g} {row.unit_text}{limit}{case}")
        return "\n".join([*lines, *self.sentences()])


@dataclass(frozen=True, eq=False)
class Front(Shown):
    """Designs of which none is better in both objectives.

    Attributes:
        points: from the best in the first objective to the best in the second one.
        runs: number of simulations of all.
        notes: sentences about the search.
    """

    points: tuple[Optimum, ...]
    runs: int
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objectives."""
        return tuple(dict.fromkeys(row.name for row in self.points[0].objectives))

    @property
    def values(self) -> Vector:
        """Objectives, the worst of all load cases, in SI units, shape (points, 2)."""
        return np.array([[point[name] for name in self.names] for point in self.points])

    def plot(self) -> Figure:
        """Draw the front."""
        units = {row.name: row.unit_text for row in self.points[0].objectives}
        title = f"{self.points[0].model.name}: front of {len(self.points)} designs"
        with picture(title, 1, 4.2) as (figure, (axes,)):
            axes.plot(*self.values.T, "o-", markersize=4, color=COLOURS[0])
            for name, label in zip(self.names, (axes.set_xlabel, axes.set_ylabel), strict=True):
                label(f"{name} in {units[name]}" if units[name] else name)
        return figure

    def __str__(self) -> str:
        free = [parameter.name for parameter in self.points[0].parameters]
        head = "  ".join(f"{name:>16}" for name in (*self.names, *free))
        rows = [
            "  ".join(f"{value:16.6g}" for value in (*values, *point.values.values()))
            for values, point in zip(self.values, self.points, strict=True)
        ]
        return "\n".join([f"Front of {len(rows)} designs, {self.runs} runs", head, *rows, *self.notes])
