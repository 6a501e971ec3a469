"""Examples of the standard library, run from its own text."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from typing import Any

from library_references import HERE, LIBRARY, compare, read_reference, references

from modelica_like import simulate
from modelica_like.errors import ModelicaLikeError
from modelica_like.netlist.modelica.read import read_modelica

PACKAGES = (
    "Modelica.Mechanics.Rotational", "Modelica.Mechanics.Translational", "ModelicaTest.Rotational",
    "ModelicaTest.Translational", "Modelica.Thermal.HeatTransfer", "Modelica.Electrical.Analog",
    "Modelica.Electrical.Machines.Examples.DCMachines",
    "Modelica.Electrical.Machines.Examples.Transformers",
    "Modelica.Electrical.Polyphase",
    "Modelica.Magnetic.FluxTubes", "Modelica.Electrical.Batteries", "Modelica.Blocks",
    "Modelica.StateGraph", "ModelicaTest.Blocks", "ModelicaTest.Electrical.Analog", "ModelicaTest.Tables",
)  # fmt: skip
MISSING: dict[str, str] = tomllib.loads((HERE / "missing.toml").read_text(encoding="utf-8"))
SOLVERS = {
    "ModelicaTest.Blocks.PadeDelay2": ("native", 1e-6),
    "Modelica.Electrical.Analog.Examples.OpAmps.Multivibrator": ("native", 1e-7),
}
"""Solver and relative tolerance of what is not run by IDAS with 1e-7: states of 1e11 and 1e-3 in one system, of which
rounding leaves IDAS so little that it takes 300 s for 20 ms; and an amplifier without lag that feeds itself, whose
equations have a fold, where its output jumps: IDAS gives up there on some processors, and says so."""
POINTS = 10_001
"""Of a run: a tenth of the window of the tube is between two."""


def package_of(name: str) -> str:
    """Return the package of an example, empty if it is none of those that are read."""
    return next((package for package in PACKAGES if name.startswith(f"{package}.")), "")


def examples() -> list[str]:
    """Return the examples of these packages that have a reference."""
    return sorted(name for name in references() if package_of(name))


@dataclass
class Outcome:
    """What became of an example.

    Attributes:
        kind: `right`, `refused` (it says why) or `wrong`.
        words: the reason, or the columns that are wrong.
    """

    kind: str
    words: str = ""


def run_example(name: str) -> Outcome:
    """Read an example without the table of classes, run it, and compare it with its reference."""
    times, columns = read_reference(references()[name])
    try:
        model, _ = read_modelica(LIBRARY / name.partition(".")[0] / "package.mo", name, table=False)
        solver, rtol = SOLVERS.get(name, ("idas", 1e-7))
        run: Any = simulate(model, float(times[-1]), points=POINTS, rtol=rtol, solver=solver)
    except ModelicaLikeError as error:
        return Outcome("refused", str(error).splitlines()[0])
    comparison = compare(name, run, times, columns)
    if comparison.right or not columns:  # three surfaces have a reference with times only: they just have to run
        return Outcome("right")
    outside = {column: distance for column, distance in comparison.worst.items() if distance}
    return Outcome("wrong", f"{outside or ''} {comparison.missing or ''}".strip())
