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
    "input Real u": 0.0,
    "input Real u(start = 0.5)": 0.5,
    "input Boolean u(start = true)": 1.0,
    "input Integer u(start = 3)": 3.0,
}
G = "block G input Real u; output Real y; parameter Real k = 3; equation y = k*u; end G"
EQUATIONS: dict[str, tuple[str, dict[str, float]]] = {
    "of a block": (f"{G}; G g | g.u = time;", {"g.y": 6}),
    "the other way round": (f"{G}; G g | time = g.u;", {"g.y": 6}),
    "of a model with equations": (
        "model B input Real u; Real x(start = 0, fixed = true); equation der(x) = u; end B; B b | b.u = time;",
        {"b.x": 2},
    ),
    "of an array of parts, in a loop": (f"{G}; G g[2] | for i in 1:2 loop g[i].u = i*time; end for;", {"g[2].y": 12}),
    "one from another": (f"{G}; G g, h; G e | connect(g.y, h.u); g.u = e.u; e.u = 2*time;", {"h.y": 36, "e.y": 12}),
    "an array": ("block A input Real u[2]; output Real y = u[1]*u[2]; end A; A a | a.u = {time, 3};", {"a.y": 6}),
    "of the standard library": (
        "Modelica.Mechanics.Rotational.Sources.Torque t; "
        "Modelica.Mechanics.Rotational.Components.Inertia J(J = 2, phi(fixed = true), w(fixed = true)) | "
        "t.tau = 4*time; connect(t.flange, J.flange_a);",
        {"J.w": 4},
    ),
    "of a variable": (f"{G}; G g; Real z(start = 0, fixed = true) | g.u = z; der(z) = 1;", {"g.y": 6}),
    "by an equation that is to be solved": (
        f"{G}; G g[2] | 2*g[1].u = time + g[1].u; g[2].u = g[1].y;",
        {"g[2].y": 18},
    ),
    "the other one reads it": (f"{G}; G g; Real z; Boolean b | z = 2*g.u; b = g.u > 1; g.u = time;", {"z": 4, "b": 1}),
    "an own input with an equation is none": (
        "input Real u = time; Real x(start = 0, fixed = true) | der(x) = u;",
        {"x": 2},
    ),
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


@pytest.mark.parametrize("case", EQUATIONS)
def test_an_equation_gives_the_input_of_a_part(case: str, tmp_path: Path) -> None:
    text, wanted = EQUATIONS[case]
    result = simulate(load(written(tmp_path, text)), 2.0)
    assert {name: result.final[name] for name in wanted} == pytest.approx(wanted, abs=1e-8)


def test_a_plain_input_is_one_of_the_fmu(tmp_path: Path) -> None:
    path = written(tmp_path, "input Real u(start = 0.5); Real x(start = 0, fixed = true) | der(x) = u;")
    export_fmu(load(path), tmp_path / "m.fmu")
    assert run_fmu(tmp_path / "m.fmu", stop=1.0, outputs=["x"]).final["x"] == pytest.approx(0.5, abs=1e-9)
    given = run_fmu(tmp_path / "m.fmu", inputs={"u": [(0, 0), (1, 1)]}, stop=1.0, outputs=["x"])
    assert given.final["x"] == pytest.approx(0.5, abs=1e-6)


def test_a_start_of_an_input_that_follows_from_a_parameter_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, "parameter Real k = 2; RealInput u(start = k/4) | ")
    _, notes = read_modelica(path)
    assert notes == ["u.start is a number now: parameters that it depends on do not change it."]
    assert build(load(path)).u.tolist() == [0.5]
