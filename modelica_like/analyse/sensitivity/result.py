"""Results of sensitivities: derivatives with names, values and units, as numbers, tables and tornado plots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.errors import UnknownName, did_you_mean, extra_module
from modelica_like.language.units import Unit
from modelica_like.style import COLOURS, picture
from modelica_like.upper import Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 20
"""Largest number of parameters in a table."""
COLUMNS = ("parameter", "value>", "unit", "derivative>", "relative>")
"""Columns of a table; those with an arrow are numbers."""


@dataclass(frozen=True)
class Quantity:
    """A number with its name and unit, in SI."""

    name: str
    value: float
    unit: Unit

    @property
    def unit_text(self) -> str:
        """The unit as text; empty for plain numbers."""
        return "" if (shown := str(self.unit)) in ("1", "*") else shown


@dataclass(frozen=True, eq=False)
class Sensitivities(Shown):
    """Derivatives of outputs by parameters, in SI units.

    Attributes:
        model: name of the model.
        outputs: differentiated outputs with their values.
        parameters: parameters and inputs with their values.
        derivatives: shape (outputs, parameters).
        method: `forward` or `adjoint`.
        time: times of the series in s, both sides of events included; empty without series.
        series: derivatives of each series over time, shape (times, parameters).
        left_out: parameters without a derivative that were not asked for by name, with the reasons.
        remarks: sentences about outputs.
    """

    model: str
    outputs: tuple[Quantity, ...]
    parameters: tuple[Quantity, ...]
    derivatives: Vector
    method: str
    time: Vector = field(default_factory=lambda: np.zeros(0))
    series: Mapping[str, Vector] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def __getitem__(self, key: tuple[str, str]) -> float:
        """Derivative of an output by a parameter.

        Raises:
            UnknownName: there is no such output or parameter.
        """
        if not isinstance(key, tuple) or len(key) != 2:
            raise UnknownName(
                f"A derivative has two names, of an output and of a parameter, not {key!r}.",
                advice='Write result["…", "…"].',
            )
        output, parameter = key
        row, column = _position(self.outputs, output, "output"), _position(self.parameters, parameter, "parameter")
        return float(self.derivatives[row, column])

    @property
    def normalised(self) -> Vector:
        """Relative change of each output per relative change of each parameter; nan where the output is zero."""
        values, weights = (np.array([quantity.value for quantity in side]) for side in (self.outputs, self.parameters))
        nothing = np.full(self.derivatives.shape, np.nan)
        return np.divide(self.derivatives * weights, values[:, None], out=nothing, where=values[:, None] != 0)

    def ranking(self, output: str) -> tuple[tuple[Quantity, float, float], ...]:
        """Parameters with derivative and normalised derivative of an output, the most important first.

        Of those that matter as much up to rounding, such as two factors of a product, the first one declared is first.
        """
        row = _position(self.outputs, output, "output")
        rows = zip(self.parameters, map(float, self.derivatives[row]), map(float, self.normalised[row]), strict=True)
        return tuple(sorted(rows, key=lambda item: -float(f"{abs(item[0].value * item[1]):.9e}")))

    def table(self, output: str) -> tuple[str, list[tuple[str, ...]]]:
        """Return title and rows of the ranking of an output as text, in the order of `COLUMNS`."""
        rows = [
            (parameter.name, f"{parameter.value:.6g}", parameter.unit_text, f"{derivative:.6g}",
             "–" if np.isnan(relative) else f"{relative + 0.0:.4f}")
            for parameter, derivative, relative in self.ranking(output)
        ]  # fmt: skip
        quantity = self.outputs[_position(self.outputs, output, "output")]
        return f"{output} = {quantity.value:.9g} {quantity.unit_text}".rstrip(), rows

    def notes(self) -> list[str]:
        """Return remarks, and a sentence about each parameter that was left out."""
        return [*self.remarks, *(f"{name} is left out. {reason}" for name, reason in self.left_out.items())]

    def tornado(self, output: str, *, change: float = 0.1, most: int = 12) -> Figure:
        """Draw the first-order change of an output for a relative change of each parameter.

        Args:
            output: which.
            change: relative change of the parameters.
            most: largest number of parameters.
        """
        quantity = self.outputs[_position(self.outputs, output, "output")]
        ranking = [(p, derivative) for p, derivative, _ in self.ranking(output) if p.value * derivative]
        rest = f"Not drawn: {len(ranking) - most} parameters with less effect." if len(ranking) > most else ""
        ranking = ranking[:most]
        places, unit = np.arange(len(ranking))[::-1], quantity.unit_text
        title = f"{output} = {quantity.value:.6g} {unit}".rstrip()
        with picture(title, 1, 1.5 + 0.32 * len(ranking), below=[[rest]] if rest else []) as (figure, (axes,)):
            for sign, mark, colour in ((1, "+", COLOURS[0]), (-1, "−", COLOURS[4])):
                widths = [sign * change * abs(p.value) * d for p, d in ranking]
                axes.barh(places, widths, height=0.66, color=colour, label=f"parameter {mark}{change:.0%}")
            axes.set_yticks(places, [f"{p.name} = {p.value:.5g} {p.unit_text}".rstrip() for p, _ in ranking])
            axes.axvline(0.0, color="#666666", linewidth=0.8)
            axes.grid(visible=False, axis="y")
            axes.spines["left"].set_visible(False)
            axes.tick_params(axis="y", length=0)
            axes.set_xlabel(f"change of {output}{f' in {unit}' if unit else ''}")
            if ranking:
                axes.legend(loc="best")
        return figure

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame with outputs as rows and parameters as columns.

        Raises:
            MissingExtra: pandas is not installed.
        """
        rows, columns = ([quantity.name for quantity in side] for side in (self.outputs, self.parameters))
        return extra_module("pandas", "data").DataFrame(self.derivatives, index=rows, columns=columns)

    def __str__(self) -> str:
        width = max([len("parameter"), *(len(parameter.name) for parameter in self.parameters)])
        blocks: list[str] = []
        for output in self.outputs:
            title, rows = self.table(output.name)
            shown = [tuple(name.rstrip(">") for name in COLUMNS), *rows[:SHOWN]]
            lines = [f"  {a:{width}}  {b:>12}  {c:12}  {d:>13}  {e:>9}" for a, b, c, d, e in shown]
            more = [f"  … {len(rows) - SHOWN} more"] if len(rows) > SHOWN else []
            blocks.append("\n".join([title, *lines, *more]))
        for name, table in self.series.items():
            blocks.append(f"{name}: derivatives at {table.shape[0]} times by {table.shape[1]} parameters")
        return "\n\n".join([*blocks, *self.notes()])


def _position(quantities: tuple[Quantity, ...], name: str, what: str) -> int:
    names = [quantity.name for quantity in quantities]
    if name not in names:
        raise UnknownName(f"There is no {what} '{name}' in these sensitivities{did_you_mean(name, names) or '.'}")
    return names.index(name)
