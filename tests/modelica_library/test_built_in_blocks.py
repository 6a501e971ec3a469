"""The blocks that are written here are those of the library: the same runs with its own text."""

from pathlib import Path
from typing import Any

import pytest
from library_references import LIBRARY

from modelica_like import load, simulate
from modelica_like.netlist.modelica.classes import with_libraries

pytestmark = pytest.mark.skipif(not LIBRARY.is_dir(), reason="the standard library's text is not here")
SINGLE = {
    "Math.Abs": "", "Math.Sign": "", "Math.Sin": "", "Math.Cos": "", "Math.Tan": "", "Math.Tanh": "", "Math.Exp": "",
    "Math.Sum": "nin = 1, k = {3}", "Math.Power": "base = 2", "Math.RealToBoolean": "threshold = 0.2",
    "Math.UnitConversions.To_deg": "", "Math.UnitConversions.From_deg": "", "Math.UnitConversions.To_kmh": "",
    "Math.UnitConversions.From_kmh": "", "Math.UnitConversions.To_rpm": "", "Math.UnitConversions.From_rpm": "",
    "Math.UnitConversions.To_degC": "", "Math.UnitConversions.From_degC": "", "Math.UnitConversions.To_kWh": "",
    "Logical.GreaterThreshold": "threshold = 0.3", "Logical.LessThreshold": "threshold = 0.3",
    "Logical.GreaterEqualThreshold": "threshold = 0.3", "Logical.LessEqualThreshold": "threshold = 0.3",
    "Logical.Hysteresis": "uLow = -0.4, uHigh = 0.6", "Nonlinear.FixedDelay": "delayTime = 0.3",
    "Continuous.PI": "T = 0.5, k = 2, initType = Modelica.Blocks.Types.Init.InitialState, x_start = 1",
    "Continuous.Der": "", "Routing.RealPassThrough": "", "Tables.CombiTable1Ds": "table = [-1, 3; 0, 1; 2, 7]",
    "Tables.CombiTable1Dv": "table = [-1, 3; 0, 1; 0.5, 7], smoothness = Modelica.Blocks.Types.Smoothness."
    "ContinuousDerivative, extrapolation = Modelica.Blocks.Types.Extrapolation.HoldLastPoint",
}  # fmt: skip
DOUBLE = {
    "Math.Add": "k1 = 2, k2 = -3", "Math.Division": "", "Math.Max": "", "Math.Min": "", "Logical.Greater": "",
    "Logical.GreaterEqual": "", "Logical.Less": "", "Logical.LessEqual": "",
    "Tables.CombiTable2Ds": "table = [0, 0, 1; -1, 2, 3; 1, 7, 9]",
}  # fmt: skip
SOURCES = {
    "RealExpression": "y = 3*time", "BooleanExpression": "y = time > 0.7", "IntegerExpression": "y = 4",
    "BooleanConstant": "k = true", "BooleanStep": "startTime = 0.4", "ContinuousClock": "offset = 1, startTime = 0.5",
    "CombiTimeTable": "table = [0, 1, 2; 1, 3, 7], columns = {2, 3}, offset = {1}, startTime = 0.25, timeScale = 2",
}  # fmt: skip
MODEL = """
model A
  Modelica.Blocks.Sources.Sine sine(f = 0.5);
  Modelica.Blocks.Sources.Ramp ramp(height = 2, duration = 2, offset = 0.5);
  Modelica.Blocks.{path} b({values});
equation
  {equations}
end A;
"""


def _results(folder: Path, path: str, values: str, equations: str) -> Any:
    (folder / "a.mo").write_text(MODEL.format(path=path, values=values, equations=equations))
    result = simulate(load(folder / "a.mo"), 1.9, points=100, rtol=1e-9, atol=1e-11)
    return {name: result.final[name] for name in result.final if name.startswith("b.y")}


def _compare(folder: Path, path: str, values: str, equations: str) -> None:
    here = _results(folder, path, values, equations)
    with with_libraries([LIBRARY]):
        there = _results(folder, path, values, equations)
    assert here
    for name, value in here.items():
        assert value == pytest.approx(there[name], rel=1e-7, abs=1e-9), name  # a hundred times the tolerance


@pytest.mark.parametrize("name", SINGLE)
def test_blocks_with_one_input(name: str, tmp_path: Path) -> None:
    index = "[1]" if name in ("Math.Sum", "Tables.CombiTable1Dv") else ""
    _compare(tmp_path, name, SINGLE[name], f"connect(sine.y, b.u{index});")


@pytest.mark.parametrize("name", DOUBLE)
def test_blocks_with_two_inputs(name: str, tmp_path: Path) -> None:
    _compare(tmp_path, name, DOUBLE[name], "connect(sine.y, b.u1); connect(ramp.y, b.u2);")


@pytest.mark.parametrize("name", SOURCES)
def test_sources(name: str, tmp_path: Path) -> None:
    _compare(tmp_path, f"Sources.{name}", SOURCES[name], "")
