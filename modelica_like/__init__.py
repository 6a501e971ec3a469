"""Acausal component models of drive-trains.

One description of a drive is simulated, differentiated and exported.
"""

from __future__ import annotations

from importlib import import_module

from modelica_like.former import moved

TYPE_CHECKING = False  # as type checkers know it; the module typing takes half the time of this import
if TYPE_CHECKING:
    from typing import Any

    from modelica_like.analyse.after.orders import order_map as order_map
    from modelica_like.analyse.after.orders import order_response as order_response
    from modelica_like.analyse.after.spectra import WoehlerLine as WoehlerLine
    from modelica_like.analyse.after.spectra import duty as duty
    from modelica_like.analyse.after.spectra import load_spectrum as load_spectrum
    from modelica_like.analyse.after.steps import step_metrics as step_metrics
    from modelica_like.analyse.calibration.calibrate import calibrate as calibrate
    from modelica_like.analyse.linear.campbell import campbell as campbell
    from modelica_like.analyse.linear.linearize import linearize as linearize
    from modelica_like.analyse.linear.loop import open_loop as open_loop
    from modelica_like.analyse.operating.curves import characteristic as characteristic
    from modelica_like.analyse.operating.steady import steady as steady
    from modelica_like.analyse.optimize.optimize import optimize as optimize
    from modelica_like.analyse.sensitivity.derivatives import sensitivities as sensitivities
    from modelica_like.analyse.sensitivity.function import simulation_function as simulation_function
    from modelica_like.analyse.sweeps.importance import importance as importance
    from modelica_like.analyse.sweeps.pictures import plot_sweep as plot_sweep
    from modelica_like.analyse.sweeps.sweep import sweep as sweep
    from modelica_like.analyse.tolerance.tolerance import tolerance as tolerance
    from modelica_like.compile.compiled import CompiledDae as CompiledDae
    from modelica_like.errors import ModelicaLikeError as ModelicaLikeError
    from modelica_like.fmi.cosimulation.run import cosim as cosim
    from modelica_like.fmi.cosimulation.split import split as split
    from modelica_like.fmi.export import export_fmu as export_fmu
    from modelica_like.fmi.run import run_fmu as run_fmu
    from modelica_like.fmi.validate import validate_fmu as validate_fmu
    from modelica_like.language import Assembly as Assembly
    from modelica_like.language import Component as Component
    from modelica_like.native.handle import Native as Native
    from modelica_like.netlist import load as load
    from modelica_like.options import Options as Options
    from modelica_like.page import explore as explore
    from modelica_like.runs.solution import Solution as Solution
    from modelica_like.runs.trajectories import Trajectories as Trajectories
    from modelica_like.show.browser.page import export_html as export_html
    from modelica_like.show.draw import save_schematic as save_schematic
    from modelica_like.show.draw import schematic as schematic
    from modelica_like.show.report.compare import compare as compare
    from modelica_like.show.report.overlay import overlay as overlay
    from modelica_like.show.report.page import save_report as save_report
    from modelica_like.show.report.progress import Bar as Bar
    from modelica_like.simulation import build as build
    from modelica_like.simulation import simulate as simulate

__version__ = "0.1.0"

_HOME = {
    "Assembly": "modelica_like.language",
    "Bar": "modelica_like.show.report.progress",
    "CompiledDae": "modelica_like.compile.compiled",
    "Component": "modelica_like.language",
    "ModelicaLikeError": "modelica_like.errors",
    "Native": "modelica_like.native.handle",
    "Options": "modelica_like.options",
    "Solution": "modelica_like.runs.solution",
    "Trajectories": "modelica_like.runs.trajectories",
    "WoehlerLine": "modelica_like.analyse.after.spectra",
    "build": "modelica_like.simulation",
    "calibrate": "modelica_like.analyse.calibration.calibrate",
    "campbell": "modelica_like.analyse.linear.campbell",
    "characteristic": "modelica_like.analyse.operating.curves",
    "compare": "modelica_like.show.report.compare",
    "cosim": "modelica_like.fmi.cosimulation.run",
    "duty": "modelica_like.analyse.after.spectra",
    "explore": "modelica_like.page",
    "export_fmu": "modelica_like.fmi.export",
    "export_html": "modelica_like.show.browser.page",
    "importance": "modelica_like.analyse.sweeps.importance",
    "linearize": "modelica_like.analyse.linear.linearize",
    "load": "modelica_like.netlist",
    "load_spectrum": "modelica_like.analyse.after.spectra",
    "open_loop": "modelica_like.analyse.linear.loop",
    "optimize": "modelica_like.analyse.optimize.optimize",
    "order_map": "modelica_like.analyse.after.orders",
    "order_response": "modelica_like.analyse.after.orders",
    "overlay": "modelica_like.show.report.overlay",
    "plot_sweep": "modelica_like.analyse.sweeps.pictures",
    "run_fmu": "modelica_like.fmi.run",
    "save_report": "modelica_like.show.report.page",
    "save_schematic": "modelica_like.show.draw",
    "schematic": "modelica_like.show.draw",
    "sensitivities": "modelica_like.analyse.sensitivity.derivatives",
    "simulate": "modelica_like.simulation",
    "simulation_function": "modelica_like.analyse.sensitivity.function",
    "split": "modelica_like.fmi.cosimulation.split",
    "steady": "modelica_like.analyse.operating.steady",
    "step_metrics": "modelica_like.analyse.after.steps",
    "sweep": "modelica_like.analyse.sweeps.sweep",
    "tolerance": "modelica_like.analyse.tolerance.tolerance",
    "validate_fmu": "modelica_like.fmi.validate",
}

__all__ = [*_HOME]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    # Loaded on first use: the command line and tools that only read netlists start faster.
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'modelica_like' has no attribute '{name}'")


# Documented names of modules from before there were fewer folders.
moved(
    {
        f"{__name__}.{former}": f"{__name__}.{now}"
        for former, now in {
            "cosimulation": "fmi.cosimulation",
            "explorer": "page",
            "report": "show.report",
            "show.explorer": "page",
            "sizing": "analyse.sizing",
            "solve.plot": "show.plot",
            "solve.solution": "runs.solution",
            "units": "language.units",
        }.items()
    }
)
