"""Inputs of a model and of its parts, against closed forms."""

from pathlib import Path

import pytest

from modelica_like import build, export_fmu, load, run_fmu, simulate
from modelica_like.netlist.modelica.read import read_modelica
from modelica_like.simulation import Solver

STARTS = {
    "RealInput u(start = 0.5)": 0.5,
    "parameter Real k = 2; RealInput u(start = k/4)": 0.5,
    "BooleanInput u(start = true)": 1.0,
    "IntegerInput u(start = 3)": 3.0,
    "RealInput u": 0.0,
}


def written(folder: Path, text: str) -> Path:
    """Write a model of declarations, and equations behind a bar."""
    declarations, _, equations = text.partition("|")
    path = folder / "m.mo"
    path.write_text(f"model M\nimport Modelica.Blocks.Interfaces.*;\n{declarations};\nequation\n{equations}\nend M;\n")
    return path


@pytest.mark.parametrize("declared", STARTS)
def test_the_start_of_an_input_is_its_value(declared: str, tmp_path: Path) -> None:
    value = "if u then 1 else 0" if "Boolean" in declared else "u"
    path = written(tmp_path, f"{declared}; Real x(start = 0, fixed = true) | der(x) = 2*({value});")
    assert simulate(load(path), 1.5).final["x"] == pytest.approx(3 * STARTS[declared], abs=1e-9)
    assert simulate(load(path), 1.5, inputs={"u": [(0, 1), (2, 1)]})["x"][-1] == pytest.approx(3, abs=1e-9)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_an_own_input_follows_a_trajectory(solver: Solver, tmp_path: Path) -> None:
    path = written(tmp_path, "RealInput u(start = 7); Real x(start = 0, fixed = true) | der(x) = 2*u;")
    drive = load(path)
    result = simulate(drive, 1.5, inputs={"u": [(0, 0), (2, 2)]}, solver=solver)
    assert result.final["x"] == pytest.approx(1.5**2, abs=1e-8)
    assert result.final["u"] == pytest.approx(1.5)
    assert simulate(drive, 0.1).final["u"] == 7  # it is open as before


def test_the_start_of_an_input_is_that_of_the_fmu(tmp_path: Path) -> None:
    path = written(tmp_path, "RealInput u(start = 0.5); Real x(start = 0, fixed = true) | der(x) = u;")
    export_fmu(load(path), tmp_path / "m.fmu")
    assert run_fmu(tmp_path / "m.fmu", stop=1.0, outputs=["x"]).final["x"] == pytest.approx(0.5, abs=1e-9)
    given = run_fmu(tmp_path / "m.fmu", inputs={"u": 2.0}, stop=1.0, outputs=["x"])
    assert given.final["x"] == pytest.approx(2, abs=1e-9)


def test_a_start_of_an_input_that_follows_from_a_parameter_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, "parameter Real k = 2; RealInput u(start = k/4) | ")
    _, notes = read_modelica(path)
    assert notes == ["u.start is a number now: parameters that it depends on do not change it."]
    assert build(load(path)).u.tolist() == [0.5]
