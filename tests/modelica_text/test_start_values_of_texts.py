"""Start values without `fixed`, with initial equations of several solutions, against those solutions."""

from pathlib import Path

import numpy as np
import pytest

from modelica_like import export_fmu, load, run_fmu, simulate
from modelica_like.simulation import Solver

UPPER = np.pi - np.arcsin(1 / 9.81)
CASES: dict[str, tuple[str, dict[str, float]]] = {
    "the upper of two angles at which a pendulum with a torque stands": (
        "Real phi(start = 3), w(start = 0); initial equation der(phi) = 0; der(w) = 0; "
        "equation der(phi) = w; der(w) = -9.81*sin(phi) + 1;",
        {"phi": UPPER, "w": 0},
    ),
    "the larger root of x^2 - 5*x + 4": (
        "Real x(start = 3.9); initial equation x^2 - 5*x + 4 = 0; equation der(x) = 0;",
        {"x": 4},
    ),
    "the same as a state of equilibrium": (
        "Real x(start = 3.9); initial equation der(x) = 0; equation der(x) = x^2 - 5*x + 4;",
        {"x": 4},
    ),
    "in parts, by a parameter of theirs and from outside": (
        "model B parameter Real x0 = 3.9; Real x(start = x0); equation der(x) = x^2 - 5*x + 4; end B; "
        "B a, b(x0 = 0.5), c(x(start = 3.9)); initial equation der(a.x) = 0; der(b.x) = 0; der(c.x) = 0;",
        {"a.x": 4, "b.x": 1, "c.x": 4},
    ),
    "a parameter that an initial equation determines": (
        "parameter Real p(fixed = false, start = 3.9); Real x(start = 0, fixed = true); "
        "initial equation p^2 - 5*p + 4 = 0; equation der(x) = p;",
        {"p": 4, "x": 0},
    ),
    "parameters of parts, from outside": (
        "model B parameter Real p(fixed = false); Real x(start = 0, fixed = true); "
        "initial equation p^2 - 5*p + 4 = 0; equation der(x) = p; end B; B a(p(start = 3.9)), b(p(start = 0.1));",
        {"a.p": 4, "b.p": 1},
    ),
    "a rate at the start, of 3 - x^2": (
        "Real x(start = 1); initial equation der(x) = -1; equation der(x) = 3 - x^2;",
        {"x": 2},
    ),
    "a root that a zero does not lead to": (
        "Real x(start = 1.9), y(start = 1, fixed = true); initial equation x^2 = 4*y; "
        "equation der(x) = -x; der(y) = -y;",
        {"x": 2, "y": 1},
    ),
    "a triple root of the slope": (
        "Real x(start = 1.9); initial equation x^3 = 8; equation der(x) = -x;",
        {"x": 2},
    ),
    "of a rate of another state": (
        "Real x(start = 1.9), y(start = 0, fixed = true); initial equation x^2 = 4; equation der(x) = -x; der(y) = x;",
        {"x": 2, "y": 0},
    ),
    "of a speed that is a parameter, and negative": (
        "parameter Real p(fixed = false, start = -1); Real x(start = 1, fixed = true); "
        "initial equation p^2 = 4; equation der(x) = p;",
        {"p": -2, "x": 1},
    ),
    "of a kinetic energy": (
        "Modelica.Mechanics.Rotational.Components.Inertia J(J = 0.5, w(start = -3), phi(start = 0, fixed = true)); "
        "initial equation 0.5*J.J*J.w^2 = 4;",
        {"J.w": -4, "J.phi": 0},
    ),
    "one that nothing else determines holds": (
        "Real x(start = 3.9), y(start = 2); initial equation y^2 = 9; equation der(x) = -x; der(y) = -y;",
        {"x": 3.9, "y": 3},
    ),
}


def written(folder: Path, text: str) -> Path:
    """Write a model, whose initial equations stand before its equations."""
    (folder / "m.mo").write_text(f"model M\n{text}\nend M;\n")
    return folder / "m.mo"


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("case", CASES)
def test_a_start_value_that_is_not_fixed_chooses_the_solution(case: str, solver: Solver, tmp_path: Path) -> None:
    text, wanted = CASES[case]
    result = simulate(load(written(tmp_path, text)), 0.1, solver=solver)
    assert {name: result[name][0] for name in wanted} == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("case", [name for name in CASES if name.startswith(("the upper", "of a speed", "in parts"))])
def test_it_does_so_in_an_fmu(case: str, tmp_path: Path) -> None:
    text, wanted = CASES[case]
    export_fmu(load(written(tmp_path, text)), tmp_path / "m.fmu")
    result = run_fmu(tmp_path / "m.fmu", stop=0.1, outputs=list(wanted))
    assert {name: result[name][0] for name in wanted} == pytest.approx(wanted, abs=1e-9)


def test_an_importer_may_give_the_guess_of_an_fmu(tmp_path: Path) -> None:
    text, _ = CASES["the larger root of x^2 - 5*x + 4"]
    export_fmu(load(written(tmp_path, text)), tmp_path / "m.fmu")
    near = run_fmu(tmp_path / "m.fmu", stop=0.1, parameters={"x": 0.2}, outputs=["x"])
    assert near.final["x"] == pytest.approx(1, abs=1e-9)
