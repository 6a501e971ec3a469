"""Small texts as users write them, against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import export_fmu, load, simulate
from modelica_like.errors import ModelicaLikeError, ModelicaTextError, WrongConnection
from modelica_like.netlist import loads
from modelica_like.netlist.modelica.netlist_form import netlist_text
from modelica_like.netlist.modelica.read import read_modelica
from modelica_like.netlist.modelica.write import modelica_text

ROTATIONAL = "Modelica.Mechanics.Rotational.Components"
TRANSLATIONAL = "Modelica.Mechanics.Translational"


@pytest.fixture
def text_file(tmp_path: Path) -> Any:
    """Return a function that writes a text to a file."""

    def write(text: str) -> Path:
        (tmp_path / "a.mo").write_text(text)
        return tmp_path / "a.mo"

    return write


def run(path: Path, **options: Any) -> Any:
    return simulate(load(path), rtol=1e-10, atol=1e-12, **options)


BRAKED = f"""
model Braked
  {ROTATIONAL}.Inertia J(J = 1, phi(fixed = true), w(start = 3));
  {ROTATIONAL}.Damper d(d = 1);
  {ROTATIONAL}.Fixed f;
equation
  connect(J.flange_b, d.flange_a);
  connect(d.flange_b, f.flange);
  annotation(experiment(StopTime = 1));
end Braked;
"""


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_start_that_is_not_fixed_holds_where_nothing_else_determines_it(text_file: Any, solver: Any) -> None:
    result = run(text_file(BRAKED), solver=solver)
    assert result["J.w"] == pytest.approx(3 * np.exp(-result.time), rel=1e-8)


def test_the_netlist_and_the_fmu_of_a_text_start_like_it(text_file: Any, tmp_path: Path) -> None:
    model, notes = read_modelica(text_file(BRAKED))
    drive = loads(netlist_text(model, tmp_path, notes), str(tmp_path / "a.toml"))
    assert simulate(drive, rtol=1e-10)["J.w"][0] == 3.0
    assert not export_fmu(drive, tmp_path / "braked.fmu", "2.0", ("me",)).check.differs


def test_what_is_fixed_wins_over_what_is_not(text_file: Any) -> None:
    coupled = BRAKED.replace(
        "equation",
        f"  {ROTATIONAL}.Inertia K(J = 2, w(fixed = true, start = 6));\nequation\n  connect(K.flange_b, J.flange_a);",
    )
    result = run(text_file(coupled))
    assert result["J.w"] == pytest.approx(6 * np.exp(-result.time / 3), rel=1e-8)


def test_starts_of_a_source_and_of_a_free_mass(text_file: Any) -> None:
    text = f"""
    model A
      {TRANSLATIONAL}.Sources.Speed speed(exact = true, s(start = 1));
      {TRANSLATIONAL}.Components.Mass mass(m = 1);
      Modelica.Blocks.Sources.Constant c(k = 2);
      {TRANSLATIONAL}.Components.Mass free(m = 1, s(start = 3), v(start = 1));
    equation
      connect(c.y, speed.v_ref);
      connect(speed.flange, mass.flange_a);
      annotation(experiment(StopTime = 1));
    end A;
    """
    final = run(text_file(text)).final
    assert final["mass.s"] == pytest.approx(1 + 2)
    assert final["free.s"] == pytest.approx(3 + 1)


TICKING = """
model Ticking
  partial block Base
    parameter Real period = 0.1;
    Modelica.Blocks.Interfaces.RealInput u;
    {visibility} output Boolean tick;
  equation
    tick = sample(0, period);
  end Base;
  block Hold
    extends Base;
    Modelica.Blocks.Interfaces.RealOutput y;
    Real h(start = 0, fixed = true);
  equation
    when tick then
      h = u;
    end when;
    y = h;
  end Hold;
  Modelica.Blocks.Sources.Ramp ramp(height = 1, duration = 1);
  Hold a(period = 0.1);
  Integer n(start = 0, fixed = true);
equation
  connect(ramp.y, a.u);
  when a.tick and time > 0.45 then
    n = pre(n) + 1;
  end when;
  annotation(experiment(StopTime = 0.95));
end Ticking;
"""


@pytest.mark.parametrize("visibility", ["public", "protected"])
def test_an_output_that_samples_ticks(text_file: Any, visibility: str) -> None:
    result = run(text_file(TICKING.format(visibility=visibility)))
    inside = np.abs(10 * result.time - np.round(10 * result.time)) > 1e-9
    assert result["a.y"][inside] == pytest.approx(np.floor(10 * result.time[inside]) / 10)
    assert result.final["n"] == 5  # at 0.5 to 0.9 s


def test_an_output_has_a_value_before_events(text_file: Any) -> None:
    """A switch with hysteresis: on where a sine rises above 0.5, off where it falls below -0.5."""
    text = """
    model A
      block Hysteresis
        Modelica.Blocks.Interfaces.RealInput u;
        Modelica.Blocks.Interfaces.BooleanOutput y(start = false);
      equation
        y = not pre(y) and u > 0.5 or pre(y) and u >= -0.5;
      end Hysteresis;
      Hysteresis a;
      Modelica.Blocks.Sources.Sine s(amplitude = 1, f = 1);
      Real on(start = 0, fixed = true);
    equation
      connect(s.y, a.u);
      der(on) = if a.y then 1 else 0;
      annotation(experiment(StopTime = 2));
    end A;
    """
    assert run(text_file(text)).final["on"] == pytest.approx(2 * (7 / 12 - 1 / 12))


def own(parts: str, equations: str, until: float = 1.0) -> str:
    """Return a model with parts and equations."""
    return f"model A\n{parts}\nequation\n{equations}\n  annotation(experiment(StopTime = {until}));\nend A;\n"


ROTOR = f"{ROTATIONAL}.Inertia J(J = 1, phi(fixed = true), w(fixed = true));"


def test_a_parameter_may_be_shown_in_another_unit(text_file: Any) -> None:
    parts = f'parameter Modelica.Units.SI.Torque limit(displayUnit = "kN.m") = 4; {ROTOR}'
    parts += 'Modelica.Mechanics.Rotational.Sources.ConstantTorque t(tau_constant(displayUnit = "kN.m") = limit);'
    assert run(text_file(own(parts, "connect(t.flange, J.flange_a);"))).final["J.w"] == pytest.approx(4)


def test_numbers_stay_as_they_are_in_other_units(text_file: Any) -> None:
    """Units are documentation in Modelica: nothing is converted."""
    parts = 'parameter Real a(unit = "deg") = 90; Real x(unit = "deg", displayUnit = "deg") = a;'
    parts += 'Real n(unit = "1/min", displayUnit = "rpm", start = 60, fixed = true);'
    result = run(text_file(own(parts, "der(n) = -n;")))
    assert result.final["x"] == 90
    assert result["n"] == pytest.approx(60 * np.exp(-result.time))


def test_bindings_of_a_connector_are_equations(text_file: Any) -> None:
    text = """
    model T
      parameter Boolean useSupport = false;
      Modelica.Mechanics.Rotational.Interfaces.Flange_b flange(tau = -t, phi = x);
      Modelica.Mechanics.Rotational.Interfaces.Support support(tau = -flange.tau) if useSupport;
      Real t, x;
    equation
      t = 2*time;
    end T;
    """
    result = run(text_file(text + own(f"T t; {ROTOR}", "connect(t.flange, J.flange_a);")))
    assert result["J.w"] == pytest.approx(result.time**2, abs=1e-8)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_class_with_equations_and_parts(text_file: Any, solver: Any) -> None:
    text = """
    model Source
      Modelica.Mechanics.Rotational.Interfaces.Flange_b flange;
      Modelica.Blocks.Sources.Sine sine(amplitude = 2, f = 1);
      Real t;
    equation
      t = sine.y;
      flange.tau = -t;
    end Source;
    """
    result = run(text_file(text + own(f"Source s; {ROTOR}", "connect(s.flange, J.flange_a);", 0.5)), solver=solver)
    speed = (1 - np.cos(2 * np.pi * result.time)) / np.pi
    assert result["J.w"] == pytest.approx(speed, abs=1e-7)
    assert result.energy().drift < 1e-6


def test_arrays_of_connectors(text_file: Any) -> None:
    """Two heat flows of 1 and 2 W into one capacity of 3 J/K."""
    heat = "Modelica.Thermal.HeatTransfer"
    text = f"""
    model Collector
      parameter Integer m = 3;
      {heat}.Interfaces.HeatPort_a port_a[m];
      {heat}.Interfaces.HeatPort_b port_b;
    equation
      port_b.Q_flow + sum(port_a.Q_flow) = 0;
      port_a.T = fill(port_b.T, m);
    end Collector;
    """
    parts = f"Collector c(m = 2); {heat}.Sources.FixedHeatFlow q[2](Q_flow = {{1, 2}});"
    parts += f"{heat}.Components.HeatCapacitor k(C = 3, T(fixed = true, start = 300));"
    result = run(text_file(text + own(parts, "connect(q.port, c.port_a); connect(c.port_b, k.port);")))
    assert result["k.T"] == pytest.approx(300 + result.time)


def test_end_is_the_size_of_an_array(text_file: Any) -> None:
    parts = "parameter Integer n = 3; Real T[n](each start = 1, each fixed = true); parameter Real p[2] = {5, 7};"
    parts += f"Real y = p[end] - p[end - 1]; {ROTATIONAL}.Inertia r[2](each J = 1); {ROTATIONAL}.Spring s(c = 1);"
    equations = """
    for i in 1:n - 1 loop der(T[i]) = T[i + 1] - T[i]; end for;
    der(T[end]) = -T[end];
    connect(r[end].flange_b, s.flange_a);
    connect(r[1].flange_b, s.flange_b);
    """
    result = run(text_file(own(parts, equations)))
    assert result.final["y"] == 2
    assert result["T[3]"] == pytest.approx(np.exp(-result.time))
    assert result["T[2]"] == pytest.approx((1 + result.time) * np.exp(-result.time))


def test_a_base_with_its_position(text_file: Any) -> None:
    text = f"""
    model Brake
      extends {TRANSLATIONAL}.Interfaces.PartialElementaryOneFlangeAndSupport2;
      parameter Real k = 2;
    equation
      flange.f = k*der(s);
    end Brake;
    """
    parts = f"Brake b; {TRANSLATIONAL}.Components.Mass m(m = 1, s(fixed = true), v(fixed = true, start = 1));"
    result = run(text_file(text + own(parts, "connect(b.flange, m.flange_b);")))
    assert result["m.v"] == pytest.approx(np.exp(-2 * result.time))


def test_units_of_version_3_of_the_standard_library(text_file: Any) -> None:
    parts = f"import SI = Modelica.SIunits; parameter SI.Inertia J = 2; {ROTATIONAL}.Inertia a(J = J);"
    parts += "parameter Modelica.SIunits.AngularVelocity w = Modelica.SIunits.Conversions.from_rpm(60); Real x = w*a.J;"
    assert run(text_file(own(parts, ""))).final["x"] == pytest.approx(2 * 2 * np.pi)


@pytest.mark.parametrize("count", [200, 30_000])
def test_long_sums_are_no_deep_trees(text_file: Any, count: int) -> None:
    parts = f"Real x = {' + '.join(['time'] * count)} - {' - '.join(['1'] * count)};"
    assert run(text_file(own(parts, ""))).final["x"] == pytest.approx(0, abs=1e-9)


LED = """
model Led
  Real x[2];
  Real A[2, 2];
  Real y(start = 0, fixed = true);
equation
  homotopy(actual = {x[1]^2 - 4, x[2]^2 - 9}, simplified = {x[1] - 3, -1 - x[2]}) = zeros(2);
  homotopy({{A[1, 1]^2, A[1, 2]^2}, {A[2, 1]^2, A[2, 2]^2}}, A) = {{1, 4}, {9, 16}};
  der(y) = x[1];
end Led;
"""


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_homotopy_of_arrays_leads_each_element(text_file: Any, solver: Any) -> None:
    """x^2 = 4 from x = 3, x^2 = 9 falling through x = -1, roots of a matrix from the squares; from x = 0 none."""
    result = run(text_file(LED), until=1, solver=solver)
    assert [result.final[f"x[{k}]"] for k in (1, 2)] == pytest.approx([2, -3], rel=1e-9)
    assert [result.final[f"A[{k},{j}]"] for k in (1, 2) for j in (1, 2)] == pytest.approx([1, 2, 3, 4], rel=1e-9)
    assert result.final["y"] == pytest.approx(2, rel=1e-9)


def test_no_event_of_an_array_makes_none(text_file: Any) -> None:
    text = """
    model Quiet
      Real x[2];
      Real y[2](each start = 0, each fixed = true);
    equation
      x = noEvent({if time > 0.5 then 1 else 2, abs(time - 0.3)});
      der(y) = x;
    end Quiet;
    """
    result = run(text_file(text), until=1)
    assert not result.events
    assert [result.final[f"y[{k}]"] for k in (1, 2)] == pytest.approx([1.5, (0.3**2 + 0.7**2) / 2], abs=1e-6)


def test_arrays_of_other_sizes_are_refused(text_file: Any) -> None:
    for call in ("atan2({1, 2}, {1, 2, 3})", "homotopy({x[1], x[2]}, {1, 2, 3})"):
        with pytest.raises(ModelicaTextError, match="has arrays of 2 and 3 elements"):
            load(text_file(f"model A\n  Real x[2];\nequation\n  x = {call};\nend A;"))


CONTROLLED = """
package P
  type Law = enumeration(linear, quadratic);
  model Brake
    parameter Law law = Law.linear;
    parameter Real k = 1;
    Modelica.Blocks.Interfaces.RealInput w;
    Modelica.Blocks.Interfaces.RealOutput tau;
  equation
    tau = -k*(if law == Law.linear then w else w*abs(w));
  end Brake;
  model Squared extends Brake(law = Law.quadratic); end Squared;
  model Drive
    Modelica.Mechanics.Rotational.Components.Inertia J(J = 2, phi(fixed = true), w(fixed = true, start = 3));
    Modelica.Mechanics.Rotational.Sensors.SpeedSensor sensor;
    Modelica.Mechanics.Rotational.Sources.Torque torque;
    replaceable Brake brake(k = 4);
  equation
    connect(J.flange_b, sensor.flange);
    connect(J.flange_b, torque.flange);
    connect(sensor.w, brake.w);
    connect(brake.tau, torque.tau);
    annotation(experiment(StopTime = 1));
  end Drive;
  model Other
    extends Drive(brake(law = Law.quadratic));
  end Other;
  model Named
    extends Drive(redeclare Squared brake(k = 4));
  end Named;
end P;
"""


def _as_netlist(path: Path, name: str) -> Any:
    model, notes = read_modelica(path, name)
    return loads(netlist_text(model, path.parent, notes), str(path.parent / "a.toml"))


def test_signals_without_units_of_an_own_class_take_any_in_a_netlist(text_file: Any) -> None:
    # 2·dw/dt = -4·w, and -4·w² for the class that has a name of its own
    result = simulate(_as_netlist(text_file(CONTROLLED), "P.Drive"), 1.0, rtol=1e-10)
    assert result["J.w"] == pytest.approx(3 * np.exp(-2 * result.time), rel=1e-8)
    result = simulate(_as_netlist(text_file(CONTROLLED), "P.Named"), 1.0, rtol=1e-10)
    assert result["J.w"] == pytest.approx(3 / (1 + 6 * result.time), rel=1e-8)


def test_a_signal_with_a_unit_of_an_own_class_is_checked_in_a_netlist(text_file: Any) -> None:
    model, notes = read_modelica(text_file(CONTROLLED), "P.Drive")
    netlist = netlist_text(model, text_file(CONTROLLED).parent, notes)
    file = text_file(CONTROLLED.replace("RealInput w;", 'RealInput w(unit = "m/s");'))
    with pytest.raises(WrongConnection, match=r"sensor\.w is in rad/s, brake\.w expects m/s\."):
        simulate(loads(netlist, str(file.parent / "a.toml")))


def test_what_a_netlist_cannot_say_of_an_own_class_is_refused(text_file: Any) -> None:
    with pytest.raises(ModelicaTextError) as caught:
        _as_netlist(text_file(CONTROLLED), "P.Other")
    assert str(caught.value).replace(str(text_file(CONTROLLED)), "a.mo") == (
        "brake has other equations than its class P.Brake: it is given what a netlist cannot say, such as a Boolean, "
        "an Integer, an enumeration, a table, another class or the variables of a bus.\n"
        "  in a.mo:17 `replaceable Brake brake(k = 4);`\n"
        "Give what it is a name of its own in the text and use that: `model Mine extends P.Brake(…); end Mine;`."
    )


def test_a_class_with_equations_is_not_written_without_them(text_file: Any) -> None:
    with pytest.raises(ModelicaTextError) as caught:
        modelica_text(_as_netlist(text_file(CONTROLLED), "P.Drive"))
    assert str(caught.value).startswith("brake is P.Brake, a class of Modelica text with equations of its own.\n")


MEANT = """
model Meant
  parameter Real q = 2;
  parameter Integer n = 2;
  parameter Boolean on = true;
  parameter Real k[2] = {1, 2};
  Modelica.Mechanics.Rotational.Components.Inertia J(J = 2, phi(fixed = true), w(fixed = true, start = 3));
  Real y;
equation
  y = if on then q*n*k[1]*J.w + der(q) + der(J.J) else 0;
  annotation(experiment(StopTime = 1));
end Meant;
"""


def test_the_derivative_of_a_parameter_is_zero(text_file: Any) -> None:
    assert run(text_file(MEANT))["y"] == pytest.approx(12.0)


@pytest.mark.parametrize(
    ("meant", "written", "message"),
    [
        ("n = 2", "n = 2.5", "n is an Integer, and 2.5 is none.\n  in a.mo:4 `parameter Integer n = 2.5;`"),
        ("on = true", "on = 1", "on is a Boolean, and 1 is none.\n  in a.mo:5 `parameter Boolean on = 1;`"),
        ("k[2]", "k[3]", "k has the size 3, and its value the size 2.\n  in a.mo:6 `parameter Real k[3] = {1, 2};`"),
        (
            "Real y;", "Real y; Real q;",
            "q is declared twice in Meant.\n  in a.mo:3 `parameter Real q = 2;`\n  in a.mo:8 `Real y; Real q;`",
        ),
        (
            "der(J.J)", "J.speed",
            "Meant uses J.speed, but J has no variable 'speed'.\n"
            "  in a.mo:10 `y = if on then q*n*k[1]*J.w + der(q) + J.speed else 0;`",
        ),
        (
            "der(J.J)", "delay(J.w, -1)",
            "delay(w, -1): the delay must be positive.\n"
            "  in a.mo:10 `y = if on then q*n*k[1]*J.w + der(q) + delay(J.w, -1) else 0;`\n"
            "Write the value itself where nothing is delayed.",
        ),
        (
            "Real y;", "Real y; Real z;",
            "Meant declares 1 equation for 2 unknowns (y, z).\n"
            "  in a.mo:10 `y = if on then q*n*k[1]*J.w + der(q) + der(J.J) else 0;`\n"
            "Each own variable, output and flow needs one: add an equation, or take the unknown away.",
        ),
    ],
)  # fmt: skip
def test_mistakes_are_told_in_words_of_the_text(text_file: Any, meant: str, written: str, message: str) -> None:
    with pytest.raises(ModelicaLikeError) as caught:
        run(text_file(MEANT.replace(meant, written)))
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("formula", "value"),
    [("sum({{1, 2}, {3, 4}})", 10), ("product({{1, 2}, {3, 4}})", 24), ("sum(identity(3))", 3),
     ("sum(vector({{1, 2}, {3, 4}}))", 10), ("scalar({{7}})", 7), ("sum(transpose({{1, 2}, {3, 4}})*{1, 0})", 3)],
)  # fmt: skip
def test_functions_of_arrays_see_all_elements(formula: str, value: float, tmp_path: Path) -> None:
    file = tmp_path / "a.mo"
    file.write_text(f"model A\n  Real x(start = 0, fixed = true);\nequation\n  der(x) = {formula};\nend A;\n", "utf-8")
    assert simulate(load(file), 1.0).final["x"] == pytest.approx(value, rel=1e-9)


OWN = """
model C parameter Real k = 1; output Real y = k; end C;
model B parameter Real k = 3; output Real y = 2*k; end B;
model E extends C; end E;
model R parameter Real v[3] = {1, 1, 1}; output Real y = sum(v); end R;
"""


def final_x(text_file: Any, declarations: str, slope: str, classes: str = "") -> float:
    """Return x(1) of a model with der(x) = slope."""
    body = f"{declarations}\n  Real x(start = 0, fixed = true);\nequation\n  der(x) = {slope};"
    file = text_file(f"{OWN}{classes}\nmodel A\n{body}\nend A;\n")
    return simulate(load(file), 1.0, rtol=1e-9).final["x"]


@pytest.mark.parametrize(
    ("held", "outside", "value"),
    [
        ("replaceable C c constrainedby C(k = 9);", "", 9), ("replaceable C c(k = 5) constrainedby C(k = 9);", "", 5),
        ("replaceable C c constrainedby C(k = 9);", "redeclare B c", 18),
        ("replaceable C c constrainedby C(k = 9);", "redeclare B c(k = 4)", 8),
        ("replaceable C c(k = 5) constrainedby C(k = 9);", "redeclare B c", 18),
        ("replaceable C c(k = 5);", "redeclare B c", 10), ("replaceable C c(k = 5);", "redeclare final B c(k = 4)", 8),
        ("replaceable model X = C constrainedby C(k = 9); X c;", "", 9),
        ("replaceable model X = C constrainedby C(k = 9); X c;", "redeclare model X = B", 18),
        ("replaceable model X = C constrainedby C(k = 9); X c;", "redeclare model X = B(k = 7)", 14),
        ("replaceable model X = C constrainedby C(k = 9); X c(k = 2);", "redeclare model X = B", 4),
    ],
)  # fmt: skip
def test_what_takes_a_place_has_the_modifications_of_its_constraint(
    text_file: Any, held: str, outside: str, value: float
) -> None:
    classes = f"model H\n{held}\nend H;"
    assert final_x(text_file, f"H h({outside});", "h.c.y", classes) == pytest.approx(value, rel=1e-8)


def test_a_redeclaration_outside_wins_over_one_of_a_base(text_file: Any) -> None:
    classes = "model H replaceable model X = C; X c; end H; model G extends H(redeclare model X = C(k = 4)); end G;"
    assert final_x(text_file, "G g(redeclare model X = B(k = 7));", "g.c.y", classes) == pytest.approx(14, rel=1e-8)


@pytest.mark.parametrize(
    ("declared", "value"),
    [("each v = {1, 2, 3}", 12), ("v = {{1, 2, 3}, {4, 5, 6}}", 21)],
)
def test_arrays_in_arrays_of_parts_are_taken_apart_by_the_outer_one(
    text_file: Any, declared: str, value: float
) -> None:
    assert final_x(text_file, f"R r[2]({declared});", "r[1].y + r[2].y") == pytest.approx(value, rel=1e-8)


@pytest.mark.parametrize(
    "declarations",
    [
        "C c(kk = 3);", "E e(kk = 3);", "C c(k = 1, k = 2);", "R r[2](v = {{1, 2, 3}});",
        "C c[2](k = {1, 2, 3});", "Real z[2](start = {1, 2, 3}) = {1, 1};", "H h(final c.k = 3); F f(h.c.k = 4);",
    ],
)  # fmt: skip
def test_modifications_that_mean_nothing_are_refused(text_file: Any, declarations: str) -> None:
    classes = "model H C c; end H; model F H h(final c.k = 3); end F;"
    with pytest.raises(ModelicaLikeError) as caught:
        final_x(text_file, declarations, "1", classes)
    assert "a.mo:8" in str(caught.value)


@pytest.mark.parametrize(
    ("declarations", "slope", "value"),
    [
        ("parameter Integer n = 4/2;", "n", 2), ("parameter Integer n = integer(2.5);", "n", 2),
        ("parameter Real r = 2; parameter Integer n(min = 1) = 2*integer(r);", "n", 4),
        ("parameter M m = M.b;", "if m == M.b then 5 else 1", 5),
        ("parameter Integer n(min = 0, max = 3) = 3;", "n", 3),
        ("parameter Real v[:, 2] = {{1, 2}, {3, 4}};", "sum(v)", 10),
        ("parameter Real v[0, 2] = fill(1, 0, 2);", "1", 1),
        ("parameter Real v[2](min = {0, -2}) = {1, -1};", "v[1] - v[2]", 2),
        ("parameter Boolean on[2] = {true, false};", "if on[1] and not on[2] then 3 else 0", 3),
        ("P p = P(2, 3);", "p.u*p.v", 6), ("P p = P(2, v = 5);", "p.u*p.v", 10),
    ],
)  # fmt: skip
def test_values_that_fit_their_types_are_read(text_file: Any, declarations: str, slope: str, value: float) -> None:
    classes = "type M = enumeration(a, b); record P parameter Real u; parameter Real v; end P;"
    assert final_x(text_file, declarations, slope, classes) == pytest.approx(value, rel=1e-8)


@pytest.mark.parametrize(
    ("classes", "declarations", "slope", "value"),
    [
        ("", "constant Real k = 3; model I Real y = 2*k; end I; I a;", "a.y", 6),
        ("", "constant Real k = 3; function f input Real u; output Real y; algorithm y := u*k; end f;", "f(2)", 6),
        ("package P constant Real k = 2; model I Real y = k + P.k; end I; end P;", "P.I a;", "a.y", 4),
        ("package P parameter Real k = 2; model I Real y = k; end I; end P;", "P.I a;", "a.y", 2),
        ("", "parameter Real p = 2; model D = C(k = p); D d;", "d.y", 2),
        ("model H parameter Real p = 7; replaceable model X = C; X c; end H;",
         "parameter Real p = 2; H h(redeclare model X = B(k = p));", "h.c.y", 4),
    ],
)  # fmt: skip
def test_what_classes_see_of_the_classes_around_them(
    text_file: Any, classes: str, declarations: str, slope: str, value: float
) -> None:
    assert final_x(text_file, declarations, slope, classes) == pytest.approx(value, rel=1e-8)


@pytest.mark.parametrize(
    ("declarations", "initial", "slope", "value"),
    [
        ("parameter Real q = 2*p;", "p = 2;", "q", 4), ("parameter Real q = 2*p;", "q = 8;", "p", 4),
        ("parameter Real r = 3*q; parameter Real q = 2*p;", "p = 2;", "r", 12),
        ("parameter Real r = q + q; parameter Real q = p + p;", "2*r = 16;", "p", 2),
        ("C c(k(fixed = false)); parameter Real q = 2*p;", "p = 2; c.k = q;", "c.y", 4),
    ],
)  # fmt: skip
def test_what_depends_on_a_parameter_of_the_initial_equations(
    text_file: Any, declarations: str, initial: str, slope: str, value: float
) -> None:
    declarations = f"parameter Real p(fixed = false, start = 1); {declarations}"
    body = f"Real x(start = 0, fixed = true);\ninitial equation\n  {initial}\nequation\n  der(x) = {slope};"
    result = run(text_file(f"{OWN}\nmodel A\n{declarations}\n{body}\nend A;\n"), until=1.0)
    assert result.final["x"] == pytest.approx(value, rel=1e-8)
