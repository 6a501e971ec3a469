"""Events of functions, of branches in a `when`, and of assertions in branches: against closed forms."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import load, simulate
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
