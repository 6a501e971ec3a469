"""Functions of upper layers for methods of lower ones, such as `run.plot()`: loaded when they are called.

Only this module may name what stands above it (`ignore_imports` in pyproject.toml), and type checkers see all of it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from modelica_like.analyse.operating.steady import unstable as unstable
    from modelica_like.analyse.sensitivity.function import simulation_function as simulation_function
    from modelica_like.edit.saving import rewritten as rewritten
    from modelica_like.native.handle import Native as Native
    from modelica_like.native.run import EngineLoop as EngineLoop
    from modelica_like.native.start import initialize as initialize
    from modelica_like.show.draw import icon as icon
    from modelica_like.show.draw import schematic as schematic
    from modelica_like.show.plot import plot as plot
    from modelica_like.show.plot import save_plot as save_plot
    from modelica_like.show.report.mathematics import mathematics as mathematics
    from modelica_like.show.report.notebook import html as html
    from modelica_like.show.report.sizing import sizing_report as sizing_report
    from modelica_like.show.sankey import sankey as sankey

_HOME = {
    "Native": "native.handle",
    "EngineLoop": "native.run",
    "initialize": "native.start",
    "html": "show.report.notebook",
    "icon": "show.draw",
    "mathematics": "show.report.mathematics",
    "plot": "show.plot",
    "rewritten": "edit.saving",
    "sankey": "show.sankey",
    "save_plot": "show.plot",
    "schematic": "show.draw",
    "simulation_function": "analyse.sensitivity.function",
    "sizing_report": "show.report.sizing",
    "unstable": "analyse.operating.steady",
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"modelica_like.{_HOME[name]}"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


class Shown:
    """A result that a notebook shows as its tables."""

    def _repr_html_(self) -> str:
        return __getattr__("html")(self)
