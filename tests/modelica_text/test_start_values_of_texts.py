"""Start values without `fixed`, with initial equations of several solutions, against those solutions."""

from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from modelica_like import build, export_fmu, linearize, load, run_fmu, sensitivities, simulate, sweep
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
    "with coefficients that equations give: with zeros in their place no state has an influence": (
        "Real a, b, x, v; initial equation der(x) = 0; der(v) = 0; "
        "equation a = 3; b = a*a + 1; der(x) = v; der(v) = a^2*b*(0.5 - x) - 2*a*v;",
        {"x": 0.5, "v": 0},
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


def test_a_run_begins_at_its_start_time(tmp_path: Path) -> None:
    """Starts, memories, ticks, linear models, gradients, sweeps, handles and FMUs begin there, and the netlist, too."""
    (tmp_path / "a.mo").write_text("""
model A
  parameter Real k = 2;
  Real x(start = 1, fixed = true);
  discrete Real begin; discrete Real never; Integer n(start = 0, fixed = true);
initial equation
  pre(begin) = time;
  pre(never) = time + 4;
equation
  der(x) = k*time;
  when x > 1e9 then
    begin = time;
  end when;
  when false then
    never = time;
  end when;
  when sample(0.5, 1) then
    n = pre(n) + 1;
  end when;
  annotation(experiment(StartTime = -1, StopTime = 2));
end A;
""")
    drive = load(tmp_path / "a.mo")
    for solver in ("idas", "native"):
        run = simulate(drive, solver=solver, rtol=1e-10)
        assert (run.time[0], run.time[-1]) == (-1, 2)
        assert run["x"] == pytest.approx(run.time**2, rel=1e-8, abs=1e-8)
        assert (run.final["begin"], run.final["never"], run.final["n"]) == (-1, 3, 2)  # ticks at 0.5 and 1.5 s
    assert simulate(drive, t0=0.0).final["begin"] == 0
    model = build(drive)
    assert linearize(model).point.t == -1
    assert model.native().time == -1
    assert sensitivities(model, "x", "k").derivatives.ravel() == pytest.approx([1.5])
    assert sweep(model, {"k": [2.0, 4.0]}, ["x"])["x"].values == pytest.approx([4, 7])
    netlist = '[parts]\na = { is = "./a.mo:A" }\n[simulate]\nfrom = "-1 s"\nuntil = "2 s"\nstart = "rest"\n'
    (tmp_path / "a.toml").write_text(netlist)
    assert simulate(load(tmp_path / "a.toml")).time[0] == -1
    export_fmu(drive, tmp_path / "a.fmu", check=False)
    description = ZipFile(tmp_path / "a.fmu").read("modelDescription.xml").decode()
    assert 'startTime="-1.0"' in description


def test_values_before_the_start_that_only_a_run_knows(tmp_path: Path) -> None:
    """A hold whose last sample was the input of the start, a change that is none at the start, a chain of negations."""
    (tmp_path / "a.mo").write_text("""
model A
  Real x(start = 3, fixed = true); Real u = 2*x + 1;
  discrete Real held; discrete Real before; Boolean high; Boolean low; Boolean other;
  Integer n(start = 0, fixed = true);
  Real y = held - before;
initial equation
  pre(held) = u;
  pre(before) = u + 1;
  pre(high) = u > 0;
  pre(low) = not pre(other);
  pre(other) = true;
equation
  der(x) = 1;
  when sample(0.25, 0.25) then
    held = u;
    before = pre(held);
  end when;
  high = u > 0;
  low = pre(low);
  other = pre(low);
  when {initial(), time > 2} then
    n = if change(high) then 5 else 6;
  end when;
end A;
""")
    run = simulate(load(tmp_path / "a.mo"), 1.0)
    ticks = np.floor(4 * run.time)
    inside = np.abs(4 * run.time - np.round(4 * run.time)) > 1e-9
    inside[0] = True
    held = np.where(ticks > 0, 7 + ticks / 2, 7.0)
    assert run["held"][inside] == pytest.approx(held[inside])
    assert run["before"][inside] == pytest.approx(np.where(ticks > 0, 7 + (ticks - 1) / 2, 8.0)[inside])
    assert (run.final["low"], run.final["other"], run.final["n"]) == (0, 0, 6)


@pytest.mark.parametrize("begin", [0.0, 0.3])
def test_ticks_count_from_the_start_of_the_run(tmp_path: Path, begin: float) -> None:
    (tmp_path / "a.mo").write_text("""
model A
  parameter Real t0(fixed = false); parameter Real T(start = 0.25);
  Integer n(start = 0, fixed = true);
initial equation
  t0 = time;
equation
  when sample(t0 + T, T) then
    n = pre(n) + 1;
  end when;
end A;
""")
    run = simulate(load(tmp_path / "a.mo"), 1.2, t0=begin)
    passed = (run.time - begin) / 0.25
    inside = np.abs(passed - np.round(passed)) > 1e-9
    assert run["n"][inside] == pytest.approx(np.floor(passed[inside]))
    assert run.final["t0"] == begin


@pytest.mark.parametrize("solver", ["native", "idas"])
def test_branches_that_time_does_not_take_have_no_part_in_a_start(tmp_path: Path, solver: Solver) -> None:
    """At the start exp(7200) would be the value of the last branch, and nothing finite solves the equation of v."""
    (tmp_path / "a.mo").write_text("""
model A
  Real y = if time < 0.1 then 2 else if time < 3600 then 10 else exp(-2*(time - 3600));
  Real v(start = 0.5), x(start = 0, fixed = true);
equation
  v + v^3 = y;
  der(x) = v;
end A;
""")
    result = simulate(load(tmp_path / "a.mo"), 0.5, solver=solver)
    assert result["v"][0] == pytest.approx(1)
    assert result.final["x"] == pytest.approx(0.1 * 1 + 0.4 * 2)


@pytest.mark.parametrize("solver", ["native", "idas"])
def test_a_start_in_the_modes_of_the_guesses(tmp_path: Path, solver: Solver) -> None:
    """In the gap nothing holds the torque, so equilibrium is found only from flanks that touch: b/2 + 2/1000 apart."""
    (tmp_path / "a.mo").write_text("""
model A
  import Modelica.Mechanics.Rotational.*;
  Components.Inertia a(J = 0.1, phi(start = 0.1)), b(J = 0.3);
  Components.ElastoBacklash play(c = 1000, d = 0, b = 0.02, phi_rel(start = -0.1));
  Components.Spring spring(c = 50);
  Components.Fixed wall;
  Sources.ConstantTorque torque(tau_constant = 2);
initial equation
  a.w = 0;
  b.w = 0;
  a.a = 0;
  b.a = 0;
equation
  connect(torque.flange, a.flange_a);
  connect(a.flange_b, play.flange_a);
  connect(play.flange_b, b.flange_a);
  connect(b.flange_b, spring.flange_a);
  connect(spring.flange_b, wall.flange);
end A;
""")
    result = simulate(load(tmp_path / "a.mo"), 0.5, solver=solver)
    for point in (0, -1):
        assert result["b.phi"][point] == pytest.approx(2 / 50, abs=1e-9)
        assert result["a.phi"][point] == pytest.approx(2 / 50 + 0.01 + 2 / 1000, abs=1e-9)
