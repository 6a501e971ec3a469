"""What notebooks show of results: the tables of the reports as HTML, and the curves."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterator
from typing import Any

from rich.console import Console
from rich.text import Text

from modelica_like.analyse.linear.model import Modes
from modelica_like.analyse.operating.curves import Curves
from modelica_like.analyse.operating.steady import OperatingPoint
from modelica_like.analyse.sensitivity.result import Sensitivities
from modelica_like.language import Component, Parameter
from modelica_like.language.inside import inside
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.draw import schematic
from modelica_like.show.draw.running import path_of
from modelica_like.show.plot import picture_bytes, plot
from modelica_like.show.report.analysis import curves_report, modes_report, point_report, sensitivity_report
from modelica_like.show.report.page.tables import details, table
from modelica_like.show.report.run import run_report

_WIDE = 110
_CODE = '<pre style="line-height:1.3;overflow-x:auto">{code}</pre>'


def html(shown: Any) -> str:
    """Return a result as HTML.

    Args:
        shown: a component, a run, or another result; those without a table of their own show their text.
    """
    if isinstance(shown, Component):
        return schematic(shown) + details(table(("parameter", "value", "description"), _given(shown)), "parameters")
    make: dict[type, Callable[[Any], Any]] = {
        Modes: modes_report, OperatingPoint: point_report, Sensitivities: sensitivity_report, Curves: curves_report,
        Trajectories: lambda run: run_report(run, energy=False),
        object: lambda other: other if hasattr(other, "__rich__") else Text(str(other)),
    }  # fmt: skip
    tell = next(tell for kind, tell in make.items() if isinstance(shown, kind))
    console = Console(record=True, file=io.StringIO(), width=_WIDE, highlight=False, emoji=False)
    console.print(tell(shown))
    text = console.export_html(inline_styles=True, code_format=_CODE)
    return _picture(shown) + text if isinstance(shown, Trajectories) else text


def _given(drive: Component) -> Iterator[tuple[str, str, str]]:
    """Yield path, value and description of each given parameter, and of the parameters of assemblies."""
    for part in drive.walk():
        record = inside(part)
        for name, field in part.fields.items():
            value = part.value(name) if name in record.values or name in record.own_fields else None
            if isinstance(field, Parameter) and value is not None:
                yield f"{path_of(part)}.{name}".removeprefix("."), str(value.given), field.description


def _picture(run: Trajectories) -> str:
    data = base64.b64encode(picture_bytes(plot(run, ()), "png", dpi=100)).decode()
    return f'<img alt="curves" style="max-width:100%" src="data:image/png;base64,{data}">'
