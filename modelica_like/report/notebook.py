"""What notebooks show of results: the tables of the reports as HTML, and the curves."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.text import Text

from modelica_like.analyse.linear.model import Modes
from modelica_like.analyse.operating.curves import Curves
from modelica_like.analyse.operating.steady import OperatingPoint
from modelica_like.analyse.sensitivity.result import Sensitivities
from modelica_like.report.analysis import curves_report, modes_report, point_report, sensitivity_report
from modelica_like.report.run import run_report
from modelica_like.solve.plot import picture_bytes, plot
from modelica_like.solve.trajectories import Trajectories

_WIDE = 110
_CODE = '<pre style="line-height:1.3;overflow-x:auto">{code}</pre>'


def html(shown: Any) -> str:
    """Return a result as HTML.

    Args:
        shown: a run, or another result; those without a table of their own show their text.
    """
    make: dict[type, Callable[[Any], Any]] = {
        Modes: modes_report, OperatingPoint: point_report, Sensitivities: sensitivity_report, Curves: curves_report,
        Trajectories: lambda run: run_report(run, energy=False),
        object: lambda other: other if hasattr(other, "__rich__") else Text(str(other)),
    }  # fmt: skip
    tell = next(tell for kind, tell in make.items() if isinstance(shown, kind))
    console = Console(record=True, file=io.StringIO(), width=_WIDE, highlight=False, emoji=False)
    console.print(tell(shown))
    told = console.export_html(inline_styles=True, code_format=_CODE)
    return _picture(shown) + told if isinstance(shown, Trajectories) else told


def _picture(run: Trajectories) -> str:
    data = base64.b64encode(picture_bytes(plot(run, ()), "png")).decode()
    return f'<img alt="curves" style="max-width:100%" src="data:image/png;base64,{data}">'
