"""Constructs of libraries, in own texts: against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import load, simulate
from modelica_like.errors import ModelicaTextError

TABLES = """
class Object1D
  extends ExternalObject;
  function constructor
    input String tableName; input String fileName; input Real table[:, :]; input Integer columns[:];
    input Integer smoothness; input Integer extrapolation; input String delimiter = ","; input Integer nHeaderLines = 0;
    output Object1D object;
    external "C" object = ModelicaStandardTables_CombiTable1D_init3(fileName);
  end constructor;
end Object1D;
function valueOf
  input Object1D tableID; input Integer icol; input Real u; output Real y;
  external "C" y = ModelicaStandardTables_CombiTable1D_getValue(tableID, icol, u);
end valueOf;
"""


def run(folder: Path, text: str, until: float = 1.0) -> Any:
    (folder / "a.mo").write_text(text)
    return simulate(load(folder / "a.mo"), until, rtol=1e-10, atol=1e-12)


def curve(
    folder: Path, table: str, smoothness: int, extrapolation: int, until: float, file: str = "", name: str = "tab"
) -> Any:
    """Return a run whose y is a table's value at the time."""
    names = f'"{name}", "{file}"' if file else '"NoName", "NoName"'
    columns = f"{{2}}, {smoothness}, {extrapolation}"
    text = f"model A\n  parameter Object1D t = Object1D({names}, {table}, {columns});\n  Real y = valueOf(t, 1, time);"
    return run(folder, f"{TABLES}\n{text}\nend A;\n", until)


def test_an_equation_in_a_modification_stands_where_its_names_are(tmp_path: Path) -> None:
    result = run(tmp_path, """
model Inside
  Real x(start = 1, fixed = true);
  Real rate;
equation
  der(x) = rate;
end Inside;
model Middle
  Inside inside;
end Middle;
model A
  Real k = -2 - 0*time;
  Middle middle(inside(rate = k*middle.inside.x));
end A;
""")  # fmt: skip
    assert result["middle.inside.x"] == pytest.approx(np.exp(-2 * result.time), rel=1e-8)


def test_outer_is_the_nearest_inner(tmp_path: Path) -> None:
    result = run(tmp_path, """
model World
  parameter Real g = 9.81;
  Boolean on = time > 0.5;
end World;
model Mass
  outer World world;
  Real v(start = 0, fixed = true);
  Boolean fast = world.on;
equation
  der(v) = -world.g;
end Mass;
model Planet
  inner World world(g = 1);
  Mass mass;
end Planet;
model A
  inner World world;
  Mass mass;
  Planet planet;
end A;
""")  # fmt: skip
    assert result.final["mass.v"] == pytest.approx(-9.81)
    assert result.final["planet.mass.v"] == pytest.approx(-1)
    assert result["mass.fast"][result.time < 0.49].max() == 0
    assert result["planet.mass.fast"][result.time > 0.51].min() == 1


def test_algorithms_of_models_are_equations(tmp_path: Path) -> None:
    result = run(tmp_path, """
model A
  parameter Real p[2](each fixed = false);
  Real y[2];
  Real total;
  Integer n(start = 0, fixed = true);
  Real taken;
initial algorithm
  n := 3;
initial equation
  (p[:], ) = split(4);
algorithm
  total := 0;
  for i in 1:2 loop
    y[i] := i*time;
    if y[i] > 1 then
      total := total + 10;
    else
      total := total + y[i];
    end if;
  end for;
  when time > 0.25 then
    n := pre(n) + 1;
    taken := n*y[2];
  end when;
end A;
function split
  input Real u;
  output Real both[2];
  output Real rest;
algorithm
  both := {u, 2*u};
  rest := 0;
end split;
""".replace("  (p[:], ) = split(4);", "  (p, ) = split(4);"))  # fmt: skip
    steep = np.where(2 * result.time > 1, 10, 2 * result.time)
    apart = abs(result.time - 0.5) > 1e-6
    assert result["total"][apart] == pytest.approx((result.time + steep)[apart])
    assert result.final["n"] == 4
    assert result.final["taken"] == pytest.approx(4 * 0.5)


def test_a_function_may_return_early_and_have_several_results(tmp_path: Path) -> None:
    result = run(tmp_path, """
function firstAbove
  input Real u[:];
  input Real limit;
  output Integer place;
  output Real value;
algorithm
  place := 0;
  value := 0;
  for i in 1:size(u, 1) loop
    if u[i] > limit then
      place := i;
      value := u[i];
      return;
    end if;
  end for;
end firstAbove;
model A
  Real place;
  Real value;
equation
  (place, value) = firstAbove({time, 2*time, 4*time}, 1);
end A;
""", 2.0)  # fmt: skip
    t = result.time
    place = np.select([t > 1, 2 * t > 1, 4 * t > 1], [1, 2, 3], 0)
    apart = np.min([abs(t - jump) for jump in (0.25, 0.5, 1)], axis=0) > 1e-3
    assert result["place"][apart] == pytest.approx(place[apart])
    value = np.select([place == 1, place == 2, place == 3], [t, 2 * t, 4 * t], 0)
    assert result["value"][apart] == pytest.approx(value[apart])


def test_records_are_values(tmp_path: Path) -> None:
    result = run(tmp_path, """
record Law
  parameter Real a = 1;
  parameter Real b = 2;
end Law;
function of
  input Law law;
  input Real x;
  output Real y;
algorithm
  y := law.a + law.b*x;
end of;
model A
  parameter Law mine(b = 3);
  Real y = of(mine, time);
  Real z = of(Law(b = 5), time);
end A;
""")  # fmt: skip
    assert result["y"] == pytest.approx(1 + 3 * result.time)
    assert result["z"] == pytest.approx(1 + 5 * result.time)


ROWS = "{{0, 0}, {1, 2}, {2, 0}}"


def test_tables_are_straight_constant_or_periodic(tmp_path: Path) -> None:
    result = curve(tmp_path, ROWS, 1, 2, 3.0)
    assert result["y"] == pytest.approx(np.where(result.time < 1, 2 * result.time, 4 - 2 * result.time), abs=1e-9)
    result = curve(tmp_path, ROWS, 1, 1, 3.0)
    assert result["y"] == pytest.approx(np.interp(result.time, [0, 1, 2], [0, 2, 0]), abs=1e-9)
    result = curve(tmp_path, ROWS, 1, 3, 6.0)
    assert result["y"] == pytest.approx(np.interp(result.time % 2, [0, 1, 2], [0, 2, 0]), abs=1e-6)
    result = curve(tmp_path, ROWS, 3, 1, 3.0)
    inside = np.min([abs(result.time - jump) for jump in (0, 1, 2)], axis=0) > 1e-6
    assert result["y"][inside] == pytest.approx(np.where((result.time > 1) & (result.time < 2), 2, 0)[inside])


@pytest.mark.parametrize("smoothness", [2, 4, 5, 6])
def test_smooth_tables_go_through_their_points_and_along_straight_lines(smoothness: int, tmp_path: Path) -> None:
    result = curve(tmp_path, "{{0, 1}, {1, 3}, {2.5, 6}, {4, 9}}", smoothness, 2, 5.0)
    assert result["y"] == pytest.approx(1 + 2 * result.time)
    result = curve(tmp_path, "{{0, 0}, {1, 1}, {2, 1}, {4, 5}}", smoothness, 1, 4.0)
    assert np.interp([1, 2, 4], result.time, result["y"]) == pytest.approx([1, 1, 5], abs=1e-4)
    slopes = np.diff(result["y"]) / np.diff(result.time)
    assert np.max(np.abs(np.diff(slopes))) < 0.2  # no kink: one of the linear table is 1


def test_a_table_may_stand_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "t.txt").write_text("#1\ndouble tab(3, 2) # a comment\n0 0\n1 2 # another\n2 0\n")
    result = curve(tmp_path, "zeros(0, 2)", 1, 1, 3.0, "t.txt")
    assert result["y"] == pytest.approx(np.interp(result.time, [0, 1, 2], [0, 2, 0]), abs=1e-9)
    (tmp_path / "t.csv").write_text("0,0\n1,2\n2,0\n")
    result = curve(tmp_path, "zeros(0, 2)", 1, 1, 3.0, "t.csv")
    assert result["y"] == pytest.approx(np.interp(result.time, [0, 1, 2], [0, 2, 0]), abs=1e-9)


def test_a_table_may_stand_in_structures_of_a_file(tmp_path: Path) -> None:
    rows = np.array([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]])
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(tmp_path / "t.mat", {"s": {"r": {"tab": rows}, "tab": 3 * rows}})
    for name, factor in (("s.r.tab", 1), ("s.tab", 3)):
        result = curve(tmp_path, "zeros(0, 2)", 1, 1, 2.0, "t.mat", name)
        assert result["y"] == pytest.approx(factor * np.interp(result.time, factor * rows[:, 0], rows[:, 1]), abs=1e-9)
    for name in ("s.no", "s.tab.no", "no.tab"):
        with pytest.raises(ModelicaTextError, match=f"'t.mat' has no table {name} that can be read."):
            curve(tmp_path, "zeros(0, 2)", 1, 1, 2.0, "t.mat", name)


REFUSED = {
    ("zeros(0, 2)", 1, 1, ""): "A table needs rows and columns.",
    ("{{0, 0}, {0, 1}}", 1, 1, ""): "The abscissae of a table rise.",
    (ROWS, 1, 4, ""): "A table without extrapolation is not supported: choose what holds beyond its ends.",
    ("{{0}}", 1, 1, ""): "The table has 1 columns, and another one is asked for.",
    (ROWS, 1, 1, "no.txt"): "There is no file 'no.txt' for the table tab.",
    (ROWS, 1, 1, "a.mo"): "'a.mo' has no table tab that can be read.",
}


@pytest.mark.parametrize(("table", "smoothness", "extrapolation", "file"), REFUSED)
def test_tables_that_are_refused(table: str, smoothness: int, extrapolation: int, file: str, tmp_path: Path) -> None:
    with pytest.raises(ModelicaTextError) as caught:
        curve(tmp_path, table, smoothness, extrapolation, 1.0, file)
    assert caught.value.what == REFUSED[table, smoothness, extrapolation, file]


PLUGS = """
connector Pin
  Real v;
  flow Real i;
end Pin;
connector Plug
  parameter Integer m = 2;
  Pin pin[m];
end Plug;
model Conductors
  parameter Real g = 1;
  Plug p;
  Plug n;
equation
  for k in 1:2 loop
    p.pin[k].i = k*g*(p.pin[k].v - n.pin[k].v);
    n.pin[k].i = -p.pin[k].i;
  end for;
end Conductors;
model Two
  Plug p;
  Plug n;
  Conductors a;
  Conductors b(g = 3);
equation
  connect(p, a.p);
  connect(a.n, b.p);
  connect(b.n, n);
end Two;
model Pole
  parameter Real v = 0;
  Plug plug;
equation
  for k in 1:2 loop
    plug.pin[k].v = v;
  end for;
end Pole;
model A
  Pole high(v = 4);
  Pole low;
  Two two;
equation
  connect(high.plug, two.p);
  connect(two.n, low.plug);
end A;
"""


def test_connectors_within_connectors_are_joined_one_by_one(tmp_path: Path) -> None:
    final = run(tmp_path, PLUGS).final
    for k in (1, 2):  # two conductances, k and 3 k, in series at 4 V
        assert final[f"two.p.pin[{k}].i"] == pytest.approx(4 * k * 3 / 4)
        assert final[f"two.a.n.pin[{k}].v"] == pytest.approx(4 - 3)
        assert final[f"low.plug.pin[{k}].i"] == pytest.approx(4 * k * 3 / 4)


def test_connectors_within_connectors_of_arrays_are_joined_in_their_order(tmp_path: Path) -> None:
    """Poles of 4 V and 8 V over two conductors each: 3 and 6 S, then 5 and 10 S."""
    head, _, _ = PLUGS.partition("model A")
    final = run(tmp_path, head + """model A
  Pole high[2](v = {4, 8});
  Pole low[2];
  Conductors c[2](g = {3, 5});
equation
  connect(high.plug, c.p);
  connect(c.n, low.plug);
end A;
""").final  # fmt: skip
    for place, volts, siemens in ((1, 4, 3), (2, 8, 5)):
        for k in (1, 2):
            assert final[f"low[{place}].plug.pin[{k}].i"] == pytest.approx(volts * siemens * k)


def test_a_record_may_be_of_a_class_that_extends_the_declared_one(tmp_path: Path) -> None:
    result = run(tmp_path, """
record Base
  parameter Real a = 1;
  parameter Real b = 2;
end Base;
record Steel
  extends Base(a = 10);
end Steel;
model A
  parameter Base law = Steel(b = 3);
  Real y = law.a + law.b*time;
end A;
""")  # fmt: skip
    assert result["y"] == pytest.approx(10 + 3 * result.time)


RECORDS = """
record RC
  parameter Real R, C;
end RC;
record Cell
  parameter Integer n = 1;
  parameter Real Ri = 2;
  parameter RC rc[n] = {RC(R = 0, C = 0)};
  parameter Real R0 = Ri - sum(rc.R);
end Cell;
model Element
  parameter Real T = 1;
  Real x(start = 0, fixed = true);
equation
  T*der(x) = 1 - x;
end Element;
model Stack
  parameter Integer Ns = 1;
  parameter Cell cell;
  Element e[cell.n](final T = Ns*cell.rc.R .* cell.rc.C);
end Stack;
model A
  parameter Cell two(n = 2, rc = {RC(R = 0.2*two.Ri, C = 1/(0.2*two.Ri)), RC(R = 0.1*two.Ri, C = 10)});
  Stack s(Ns = 3, cell = two);
  Real left = two.R0;
end A;
"""


def test_arrays_of_records_are_given_with_names(tmp_path):
    result = run(tmp_path, RECORDS, 6.0)
    assert [result[f"s.e[{k}].x"][-1] for k in (1, 2)] == pytest.approx([1 - np.exp(-2), 1 - np.exp(-1)])
    assert result["left"][-1] == pytest.approx(2 - 0.4 - 0.2)


@pytest.mark.parametrize(
    "annotation", ["experiment", "experiment StopTime = 1", "experiment, Icon", "Icon, experiment(3)"]
)
def test_annotations_that_say_nothing_are_skipped(annotation: str, tmp_path: Path) -> None:
    text = (
        f"model A\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -x;\n  annotation({annotation});\nend A;\n"
    )
    assert run(tmp_path, text)["x"][-1] == pytest.approx(np.exp(-1), rel=1e-6)
