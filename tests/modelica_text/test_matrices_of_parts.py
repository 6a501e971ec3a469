"""Arrays of components with several dimensions: values against closed forms."""

from pathlib import Path
from typing import Any

import pytest

from modelica_like import load, simulate
from modelica_like.netlist.modelica.flat_text import flat_text
from modelica_like.netlist.modelica.write import modelica_text

R = "Modelica.Mechanics.Rotational"
BLOCKS = """
connector U = input Real;
connector Y = output Real;
model S
  parameter Real k = 1; parameter Real v[2] = {1, 1}; Real y = k*time + v[1];
end S;
block Sum
  U u[2,2]; Y y = u[1,1] + 10*u[1,2] + 100*u[2,1] + 1000*u[2,2];
end Sum;
block Four
  Y y[2,2] = {{1, 2}, {3, 4}}*time;
end Four;
record P
  Real a = 1; Real b = 2;
end P;
expandable connector Bus
end Bus;
"""


def run(folder: Path, text: str) -> Any:
    (folder / "a.mo").write_text(f"{BLOCKS}model A {text} end A;\n", encoding="utf-8")
    return simulate(load(folder / "a.mo"), 1.0, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("S s[2,3](k = {{1, 2, 3}, {4, 5, 6}}); Real z = s[2,3].y;", 7),
        ("S s[2,3](k = {{1, 2, 3}, {4, 5, 6}}); Real z = sum(s.y);", 27),
        ("S s[2,3](k = {{1, 2, 3}, {4, 5, 6}}); Real z = sum(s[2,:].k);", 15),
        ("S s[2,3](k = {{1, 2, 3}, {4, 5, 6}}); Real z = sum(s[:,end].y);", 11),
        ("S s[2,3](each k = 2, each v = {3, 4}); Real z = s[1,2].y;", 5),
        ("S s[2,2](v = {{{1, 2}, {3, 4}}, {{5, 6}, {7, 8}}}); Real z = s[2,1].v[2];", 6),
        ("S s[2,1,2](k = {{{1, 2}}, {{3, 4}}}); Real z = s[2,1,2].y + 10*sum(s.k);", 105),
        ("parameter Real k = 7; P p[2,2] = {{P(1, 2), P(a = k)}, {P(5), P(6)}}; Real z = p[1,2].a + sum(p.b);", 15),
        ("type E = enumeration(a, b); S s[E,2](k = {{1, 2}, {3, 4}}); Real z = s[E.b,1].y;", 4),
        ("S s[2,3]; Real z = size(s, 2);", 3),
        ("Real x[2,2](start = {{1, 2}, {3, 4}}, each fixed = true), z = x[2,1]; equation der(x) = zeros(2, 2);", 3),
        ("Sum s; Four f; Real z = s.y; equation connect(f.y, s.u);", 4321),
        ("Sum s; Four f; Real z = s.y; equation connect(f.y[1,:], s.u[2,:]); connect(f.y[2,:], s.u[1,:]);", 2143),
        ("Sum s; Four f; Bus b; Real z = s.y; equation connect(f.y, b.m); connect(b.m, s.u);", 4321),
    ],
)
def test_values_slices_and_connections(text: str, value: float, tmp_path: Path) -> None:
    assert run(tmp_path, text).final["z"] == pytest.approx(value)


def test_a_grid_of_components_of_the_table(tmp_path: Path) -> None:
    """Each inertia turns by its own torque, t/J; the springs between them bear nothing."""
    result = run(
        tmp_path,
        f"""
  {R}.Components.Inertia J[2,3](J = {{{{1, 2, 3}}, {{4, 5, 6}}}}, each phi(fixed = true), each w(fixed = true));
  {R}.Sources.ConstantTorque t[2,3](each tau_constant = 60); {R}.Components.SpringDamper s[2,2](each c = 0, each d = 0);
  Real total = sum(J.w); Real row[3] = J[1,:].w;
equation
  connect(t.flange, J.flange_a);
  for i in 1:2, j in 1:2 loop
    connect(J[i,j].flange_b, s[i,j].flange_a);
    connect(s[i,j].flange_b, J[i,j+1].flange_a);
  end for;
""",
    )
    assert [result.final[f"J[{i},{j}].w"] for i in (1, 2) for j in (1, 2, 3)] == pytest.approx([60, 30, 20, 15, 12, 10])
    assert (result.final["total"], result.final["row[2]"]) == pytest.approx((147, 30))


def test_they_are_written_as_they_were_read(tmp_path: Path) -> None:
    (tmp_path / "a.mo").write_text(
        f"model A parameter Real j = 2; {R}.Components.Inertia J[2,2](J = {{{{1, 2}}, {{j, 4}}}}, "
        f"each phi(fixed = true), each w(fixed = true)); {R}.Sources.ConstantTorque t[2,2](each tau_constant = 60); "
        "equation connect(t.flange, J.flange_a); annotation(experiment(StopTime = 1)); end A;\n",
        encoding="utf-8",
    )
    drive = load(tmp_path / "a.mo")
    for name, write in {"written": modelica_text, "flat": flat_text}.items():
        (tmp_path / f"{name}.mo").write_text(write(drive), encoding="utf-8")
        result = simulate(load(tmp_path / f"{name}.mo"))
        assert [result.final[f"J[{i},{j}].w"] for i in (1, 2) for j in (1, 2)] == pytest.approx([60, 30, 30, 15])
