"""Events of functions, of branches in a `when`, and of assertions in branches: against closed forms."""

import math
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from modelica_like import export_fmu, load, simulate
from modelica_like.errors import LimitPassed


def run(folder: Path, text: str, until: float = 1.0) -> Any:
    (folder / "a.mo").write_text(text)
    return simulate(load(folder / "a.mo"), until)


FUNCTION = """
model A
  function f
    input Real u;
    input Real v;
    output Real y;
  algorithm
    y := if u > 0.5 then v else 2*v;
  end f;
  function g
    input Boolean b[:];
    output Boolean y = f(sum(if b[i] then 1 else 0 for i in 1:size(b, 1)), 1) < 1.5 and max(b) and not min(b);
  algorithm
  end g;
  Real x(start = 0, fixed = true), y(start = 0, fixed = true);
  Boolean some;
equation
  der(x) = f(if time > 0.3 then 1 else 0, if time > 0.71 then 1 else 3);
  some = g({time >= 0.1*k and time < 0.1*k + 0.05 for k in 1:3});
  der(y) = if some then 1 else 0;
end A;
"""


def test_relations_in_arguments_of_functions_make_events(tmp_path):
    """6 until 0.3 s, 3 until 0.71 s, then 1; and three pulses of 0.05 s."""
    result = run(tmp_path, FUNCTION)
    assert result["x"][-1] == pytest.approx(0.3 * 6 + 0.41 * 3 + 0.29, abs=1e-12)
    assert result["y"][-1] == pytest.approx(0.15, abs=1e-12)


def test_relations_of_functions_make_none(tmp_path):
    text = FUNCTION.replace("if time > 0.3 then 1 else 0, if time > 0.71 then 1 else 3", "time, 1")
    result = run(tmp_path, text.replace("der(y) = if some then 1 else 0", "der(y) = 0"))
    assert {event.source.line for event in result.events} == {19}  # those of `some`
    assert result["x"][-1] == pytest.approx(1.5, rel=1e-6)


BRANCHES = """
model A
  Real low(start = 0, fixed = true), high(start = 0, fixed = true), tl(start = -1, fixed = true);
  Real th(start = -1, fixed = true), u = sin(10*time);
  Boolean up(start = false, fixed = true);
equation
  when sample(0.1, 0.1) then
    low = min(u, pre(low));
    high = max(u, pre(high));
    if low < pre(low) then
      tl = time; th = pre(th); up = false;
    elseif high > pre(high) then
      th = time; up = true;
      tl = pre(tl);
    else
      tl = pre(tl); th = pre(th);
    end if;
  end when;
end A;
"""


def test_an_if_in_a_when(tmp_path):
    """Samples of sin at 1, 2, … 10: the largest is sin 8, the smallest sin 5."""
    result = run(tmp_path, BRANCHES, 1.05)
    assert [result[name][-1] for name in ("tl", "th", "up")] == pytest.approx([0.5, 0.8, 1.0])


DEMANDS = """
model A
  parameter Real begin = 0.5;
  Real x(start = begin, fixed = true);
equation
  der(x) = 1;
  if begin < 0 or begin > 1 then
    Modelica.Utilities.Streams.error("begin is not in [0, 1]");
  end if;
  if x > 0.9 then
    assert(time < 0.6, "late");
  else
    assert(time < 0.5, "too late");
  end if;
end A;
"""


def test_assertions_in_branches(tmp_path):
    assert run(tmp_path, DEMANDS, 0.55)["x"][-1] == pytest.approx(1.05)
    with pytest.raises(LimitPassed, match=r"At 0\.6 s A late\."):
        run(tmp_path, DEMANDS)
    with pytest.raises(LimitPassed, match=r"At 0 s A begin is not in \[0, 1\]\."):
        run(tmp_path, DEMANDS.replace("begin = 0.5", "begin = 1.5"))


SUPPLY = """
model A
  parameter Real V0 = 60, I0 = 50, P0 = 1200, Rcv = 0.01, Gcc = 0.01, C = 0.1, R = 1e-3;
  Real u(start = 0, fixed = true), v, i;
protected
  parameter Real v_limit(fixed = false), i_limit(fixed = false);
  parameter Boolean limited(fixed = false);
  Boolean cv(start = false), cc(start = true);
initial algorithm
  v_limit := (V0 - Rcv*I0)/(1 - Rcv*Gcc);
  i_limit := (I0 - Gcc*V0)/(1 - Gcc*Rcv);
  limited := false;
  if v_limit*i_limit > P0 then
    limited := true;
    v_limit := (I0 - sqrt(I0^2 - 4*Gcc*P0))/(2*Gcc);
    i_limit := (V0 - sqrt(V0^2 - 4*Rcv*P0))/(2*Rcv);
  end if;
equation
  cv = i <= i_limit;
  cc = v <= v_limit;
  if limited then
    if cv then
      v = V0 - Rcv*i;
    elseif cc then
      i = I0 - Gcc*v;
    else
      P0 = v*i;
    end if;
  else
    if cv then
      v = V0 - Rcv*i;
    else
      i = I0 - Gcc*v;
    end if;
  end if;
  C*der(u) = i;
  v = u + R*i;
end A;
"""


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("rtol", [1e-5, 1e-6, 1e-7, 3e-8, 1e-9])
def test_relations_of_what_they_decide_switch_once(tmp_path, solver, rtol):
    """The current and the voltage are solved anew on both sides of a limit, so they differ there by rounding.

    At 1200 W the voltage rises from v_limit to V0 - Rcv*i_limit: dt = C*du/i with u = v - R*P0/v and i = P0/v.
    """
    (tmp_path / "a.mo").write_text(SUPPLY)
    result = simulate(load(tmp_path / "a.mo"), 0.3, rtol=rtol, solver=solver)
    first, second = [event.time for event in result.events]
    low = (50 - (50**2 - 4 * 0.01 * 1200) ** 0.5) / 0.02
    high = 60 - 0.01 * (60 - (60**2 - 4 * 0.01 * 1200) ** 0.5) / 0.02
    power = 0.1 * ((high**2 - low**2) / 2400 + 1e-3 * math.log(high / low))
    assert second - first == pytest.approx(power, rel=30 * rtol)


def test_what_decides_equations_follows_from_an_initial_algorithm(tmp_path):
    """Without the limit of power: one switch, from the current's limit to the voltage's."""
    result = run(tmp_path, SUPPLY.replace("P0 = 1200", "P0 = 4000"), 0.3)
    assert result.events[0].time == pytest.approx(result.events[-1].time, abs=1e-9)


LIMITED = """
model A
  parameter Real k = 1;
  parameter Real most = 1;
  Real y(start = 0, fixed = true);
  Real u = k*cos(time);
equation
  der(y) = if y < -most and u < 0 or y > most and u > 0 then 0 else u;
end A;
"""


@pytest.mark.parametrize("solver", ["native", "idas"])
@pytest.mark.parametrize("size", [1.0, 7.3, 1e-3, 1e-8, 1e6])
def test_what_rests_at_a_limit_stays_there(tmp_path: Path, solver: Any, size: float) -> None:
    """A quarter of the period leads to the limit; where the speed turns, it goes back, and to the other limit."""
    (tmp_path / "a.mo").write_text(LIMITED)
    model = load(tmp_path / "a.mo")
    for part in (0.11, 0.37, 0.5, 0.701, 0.93):
        model.give("k", size)
        model.give("most", part * size)
        result = simulate(model, 2 * math.pi, rtol=1e-9, atol=1e-12 * size, solver=solver)
        for time, wanted in ((math.pi / 2, part), (math.pi, max(part - 1, -part)), (2 * math.pi, min(1 - part, part))):
            assert result.at(time)["y"] == pytest.approx(wanted * size, abs=1e-7 * size)


@pytest.mark.parametrize("solver", ["native", "idas"])
def test_delays_in_a_row_and_a_step_at_the_same_instant(tmp_path: Path, solver: Any) -> None:
    """Each takes what was before: of the one before it, and of what jumps just then."""
    (tmp_path / "a.mo").write_text("""
model A
  connector In = input Real;
  connector Out = output Real;
  block Delay
    In u; Out y;
  initial equation
    y = 0;
  equation
    when sample(0, 0.25) then
      y = pre(u);
    end when;
  end Delay;
  block Step
    Out y = if time < 0.5 then 1 else 3;
  end Step;
  Delay a, b, c;
  Step step;
equation
  a.u = time + 1;
  connect(a.y, b.u);
  connect(step.y, c.u);
end A;
""")
    result = simulate(load(tmp_path / "a.mo"), 1.1, solver=solver)
    for time, values in ((0.1, (1, 0, 1)), (0.3, (1.25, 1, 1)), (0.6, (1.5, 1.25, 1)), (0.8, (1.75, 1.5, 3))):
        assert [result.at(time)[f"{name}.y"] for name in "abc"] == pytest.approx(values, abs=1e-9)


def test_what_changes_all_the_time_has_a_value_before_an_event(tmp_path: Path) -> None:
    """A slope begins anew from where the one before has come to, also where that was not at its end."""
    result = run(tmp_path, """
model A
  parameter Real rate = 2;
  discrete Real begun(start = 0, fixed = true), from(start = 1, fixed = true), to(start = 1, fixed = true);
  Real size = if time < begun + 0.5 then from + (to - from)*(time - begun)*rate else to;
  Real y = 3*size + x;
  Real x(start = 0, fixed = true);
equation
  der(x) = 1;
  when {time > 0.25, time > 0.5, time > 1.5} then
    from = pre(size);
    to = pre(y);
    begun = time;
  end when;
end A;
""", 3.0)  # fmt: skip
    first = 1.0, 3.25  # at 0.25 s: size is 1, y is 3 + 0.25
    second = first[0] + (first[1] - first[0]) * 0.25 * 2
    third = 3 * second + 0.5  # what it has come to until 1.5 s
    assert result.at(1.5)["size"] == pytest.approx(third, abs=1e-9)
    assert (result.final["from"], result.final["to"]) == pytest.approx((third, 3 * third + 1.5), abs=1e-9)


def test_other_classes_see_what_a_part_has_before_the_start(tmp_path: Path) -> None:
    """It is 3*u, which only a run knows, with u = 2 + x = 3 at the start."""
    result = run(tmp_path, """
model A
  block B
    input Real u;
    discrete Real n;
  initial equation
    pre(n) = 3*u;
  equation
    when time > 0.5 then
      n = pre(n) + 1;
    end when;
  end B;
  model Around
    B b(u = 2 + x);
    Real x(start = 1, fixed = true);
  equation
    der(x) = 1;
  end Around;
  Around around;
  discrete Real first(start = 0), last(start = 0);
  Boolean large = pre(around.b.n) > 8 and pre(around.b.n) < 9.5;
equation
  when initial() then
    first = pre(around.b.n);
  end when;
  when time > 0.5 then
    last = pre(around.b.n);
  end when;
end A;
""")  # fmt: skip
    assert (result["first"][0], result.final["last"], result.final["around.b.n"]) == pytest.approx((9, 9, 10))
    assert result.at(0.25)["large"] == 1


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_what_rests_at_a_limit_stays_there_in_an_fmu(tmp_path: Path, kind: str) -> None:
    """An importer stops a time resolution before the limit."""
    (tmp_path / "a.mo").write_text(LIMITED.replace("most = 1", "most = 0.37"))
    export_fmu(load(tmp_path / "a.mo"), tmp_path / "a.fmu", check=False)
    run = fmpy.simulate_fmu(str(tmp_path / "a.fmu"), stop_time=6.0, fmi_type=kind, relative_tolerance=1e-8)
    at = [float(np.interp(time, run["time"], run["y"])) for time in (1.5, 4.5, 6.0)]
    assert at == pytest.approx([0.37, -0.37, math.sin(6.0) + 1 - 0.37], abs=1e-5)


@pytest.mark.parametrize("solver", ["native", "idas"])
@pytest.mark.parametrize(("root", "exponent"), [
    ("sqrt(max(0, h))", 0.5), ("sqrt(max(h, 0))", 0.5), ("max(0, h)^0.5", 0.5), ("max(0, h)^0.6", 0.6),
])  # fmt: skip
def test_a_tank_runs_empty_and_stays_so(tmp_path: Path, solver: Any, root: str, exponent: float) -> None:
    """Torricelli's law, der(h) = -k*h^n: h^(1 - n) falls evenly, and is zero at 1/(k*(1 - n))."""
    (tmp_path / "a.mo").write_text(f"""
model A
  Real h(start = 1, fixed = true), filled(start = 0, fixed = true), out = 0.8*{root};
equation
  der(h) = -out;
  der(filled) = (if time > 0.5 then 1 else 0) - {root.replace("h", "filled")};
end A;
""")
    result = simulate(load(tmp_path / "a.mo"), 5.0, rtol=1e-8, solver=solver)
    rest = 1 - exponent
    wanted = [max(0.0, 1 - 0.8 * rest * time) ** (1 / rest) for time in result.time]
    assert np.max(np.abs(np.array(result["h"]) - wanted)) < 2e-8
    assert result.at(0.5)["filled"] == 0.0
    if exponent == 0.5:  # der(f) = 1 - sqrt(f) from zero
        speed = math.sqrt(result.final["filled"])
        assert -2 * speed - 2 * math.log(1 - speed) == pytest.approx(4.5, rel=1e-6)


def test_the_value_before_an_event_in_an_algorithm_is_not_that_of_the_assignment_above(tmp_path):
    """`pre`, `edge` and `change` ask for the variable before the event, whatever the algorithm has given it since."""
    result = run(tmp_path, """
model A
  Integer n[3](each start = 0, each fixed = true), m[3](each start = 0, each fixed = true);
  Boolean b, rises; Integer count(start = 0, fixed = true), changes(start = 0, fixed = true);
  Integer k(start = 2, fixed = true); Real picked(start = 0, fixed = true);
algorithm
  when sample(0.1, 0.2) then
    for i in 1:3 loop
      n[i] := pre(n[i]) + i;
      m[i] := pre(n[i]);
    end for;
    changes := if change(n[2]) then pre(changes) + 1 else pre(changes);
  end when;
  b := sin(20*time) > 0;
  rises := edge(b);
equation
  when rises then
    count = pre(count) + 1;
  end when;
  when time > 0.6 then
    k = 3;
    picked = pre(n[k]);
  end when;
end A;
""")  # fmt: skip
    assert [result.final[f"n[{i}]"] for i in (1, 2, 3)] == [5, 10, 15]
    assert [result.final[f"m[{i}]"] for i in (1, 2, 3)] == [4, 8, 12]
    assert (result.final["changes"], result.final["count"], result.final["picked"]) == (5, 4, 9)


@pytest.mark.parametrize(
    ("first", "second", "third", "told"), [(2, 0, 2, ""), (0, 0, 2, "one"), (2, 9, 2, "two"), (2, 0, 1, "three")]
)
def test_a_loop_and_assertions_in_a_when(first: float, second: float, third: float, told: str, tmp_path: Path) -> None:
    """All assertions count, wherever in the `when` they stand."""
    text = f"""
model A
  parameter Boolean all = true; Real v[3](each start = 0, each fixed = true);
equation
  when time > 0.5 then
    assert(time < {first}, "one");
    if all then
      assert(time > {second}, "two");
    end if;
    for i in 1:3 loop
      v[i] = i*time;
      assert(i*time < {third}, "three");
    end for;
  end when;
end A;
"""
    if told:
        with pytest.raises(LimitPassed, match=told):
            run(tmp_path, text)
    else:
        assert run(tmp_path, text).final["v[3]"] == pytest.approx(1.5)
