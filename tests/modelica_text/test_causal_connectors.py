"""Connectors with inputs and outputs in them, `cardinality`, `inner outer`: against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import load, simulate

PLUGS = """
connector Plug
  input Boolean b; input Real u; output Integer n; output Real x;
end Plug;
connector Socket
  output Boolean b; output Real u; input Integer n; input Real x;
end Socket;
"""


def run(folder: Path, text: str, until: float = 1.0) -> Any:
    (folder / "a.mo").write_text(text)
    return simulate(load(folder / "a.mo"), until, rtol=1e-10, atol=1e-12)


def between(result: Any, *instants: float) -> np.ndarray:
    """Return which points are no instants of events."""
    return np.min(np.abs(result.time[:, None] - np.array(instants)), axis=1) > 1e-9


def test_values_go_both_ways(tmp_path: Path) -> None:
    result = run(tmp_path, f"""{PLUGS}
model A
  block P
    Plug k[2];
    Real seen = k[1].u + k[2].u;
  equation
    for i in 1:2 loop
      k[i].n = if k[i].b then 7*i else 0;
      k[i].x = 3*i*time;
    end for;
  end P;
  block Q
    Socket k;
    parameter Real t = 0.5;
    Real y = k.n*k.x;
  equation
    k.b = time > t;
    k.u = t*time;
  end Q;
  P p; Q q[2](t = {{0.25, 0.5}});
equation
  connect(q.k, p.k);
end A;
""")  # fmt: skip
    t = result.time
    assert result["p.seen"] == pytest.approx(0.75 * t)
    inside = between(result, 0.25, 0.5)
    assert result["q[1].y"][inside] == pytest.approx((21 * t * (t > 0.25))[inside])
    assert result["q[2].y"][inside] == pytest.approx((14 * 6 * t * (t > 0.5))[inside])


def test_own_connectors_hand_on_and_cardinality_counts_both_sides(tmp_path: Path) -> None:
    result = run(tmp_path, f"""{PLUGS}
model A
  model Inner
    Plug k;
    Real count = cardinality(k);
  equation
    k.n = if k.b then 2 else 1;
    k.x = k.u;
  end Inner;
  model Outer
    Plug k;
    Plug unused;
    Real count = cardinality(k);
    Inner inside;
  equation
    if cardinality(unused) == 0 then
      unused.b = false;
      unused.u = 5;
    end if;
    unused.n = 0;
    unused.x = unused.u;
    connect(k, inside.k);
  end Outer;
  block Source
    Socket k;
  equation
    k.b = time > 0.5;
    k.u = 4;
  end Source;
  Outer o;
  Source s;
equation
  connect(s.k, o.k);
end A;
""")  # fmt: skip
    assert (result.final["o.count"], result.final["o.inside.count"]) == (2, 1)
    assert (result.final["s.k.x"], result.final["o.unused.x"]) == (4, 5)
    inside = between(result, 0.5)
    assert result["s.k.n"][inside] == pytest.approx(np.where(result.time > 0.5, 2, 1)[inside])


def test_parts_add_up_at_what_is_outer_and_inner_outer_stands_between(tmp_path: Path) -> None:
    result = run(tmp_path, """
connector Here
  input Boolean off; Real v; flow Real i;
end Here;
connector There
  output Boolean off; Real v; flow Real i;
end There;
model Root
  output Boolean off = time > 0.5;
  There port;
equation
  off = port.off;
  port.v = 2;
end Root;
model Leaf
  parameter Real g = 1;
  outer Root root;
  model Port Here k; Real g; equation k.i = if k.off then 0 else g*k.v; end Port;
  Port port(g = g);
equation
  connect(port.k, root.port);
end Leaf;
model Group
  inner outer Root root(off = k.k.off or time > 0.25);
  model Port Here k; equation k.i = 10; end Port;
  Port k;
  Leaf a(g = 3); Leaf b(g = 4);
  Real all = -inside.root.port.i;
  model Inside outer Root root; end Inside;
  Inside inside;
equation
  connect(k.k, root.port);
end Group;
model A
  inner Root root;
  Leaf a; Group g;
  Real all = -root.port.i;
end A;
""")  # fmt: skip
    inside = between(result, 0.25, 0.5)
    assert result["all"][inside] == pytest.approx(np.where(result.time > 0.5, 10, 12)[inside])
    assert result["g.all"][inside] == pytest.approx(np.where(result.time > 0.25, 0, 14)[inside])


def test_a_timer_that_a_state_sets_counts_from_there(tmp_path: Path) -> None:
    """A relation of time and of a discrete variable follows the latter in the same instant, not a round later."""
    result = run(tmp_path, """
model A
  Boolean odd(start = false, fixed = true); Boolean due; discrete Real begin; Integer n(start = 0, fixed = true);
initial equation
  pre(begin) = 0;
  pre(due) = false;
equation
  odd = if pre(due) then not pre(odd) else pre(odd);
  when change(odd) then
    begin = time;
  end when;
  due = time >= begin + 0.25;
  when change(odd) then
    n = pre(n) + 1;
  end when;
end A;
""", 1.1)  # fmt: skip
    inside = between(result, 0.25, 0.5, 0.75, 1.0)
    assert result["n"][inside] == pytest.approx(np.floor(4 * result.time[inside]))
    assert result["odd"][inside] == pytest.approx(np.floor(4 * result.time[inside]) % 2)


def test_what_is_true_for_an_instant_goes_along_a_connection(tmp_path: Path) -> None:
    result = run(tmp_path, """
model A
  connector U = input Boolean;
  connector Y = output Boolean;
  block Ticks Y y; equation y = sample(0.125, 0.25); end Ticks;
  block Through U u; Y y; Count count; equation connect(u, count.u); connect(u, y); end Through;
  block Count U u; Integer n(start = 0, fixed = true); equation when u then n = pre(n) + 1; end when; end Count;
  Ticks ticks; Through through; Count count;
equation
  connect(ticks.y, through.u);
  connect(through.y, count.u);
end A;
""")  # fmt: skip
    assert (result.final["count.n"], result.final["through.count.n"]) == (4, 4)


def test_initial_values_go_through_equal_variables(tmp_path: Path) -> None:
    result = run(tmp_path, """
model A
  Boolean active; Boolean mine; Boolean next; Boolean last; Integer n0(start = 5); Integer n(start = 0, fixed = true);
initial equation
  pre(next) = pre(mine);
  pre(last) = pre(mine);
  active = true;
equation
  active = mine;
  mine = pre(next);
  next = time < 0.5;
  when time > 2 then
    last = false;
  end when;
  when not active then
    n = if last then 3 else 4;
  end when;
  when 1 > 2 then
    n0 = 8;
  elsewhen false then
    n0 = 9;
  end when;
end A;
""")  # fmt: skip
    assert (result["active"][0], result.final["active"], result.final["n"], result.final["n0"]) == (1, 0, 3, 5)


def test_of_two_whens_of_an_algorithm_the_last_decides(tmp_path: Path) -> None:
    result = run(tmp_path, """
model A
  Boolean on(start = false); Real both(start = 0); Boolean start = time > 0.25;
algorithm
  when {time > 0.5, time > 0.75} then
    on := false;
    both := both + 1;
  end when;
  when {start, time > 0.75} then
    on := true;
  end when;
end A;
""")  # fmt: skip
    inside = between(result, 0.25, 0.5, 0.75)
    t = result.time[inside]
    assert result["on"][inside] == pytest.approx(np.where((t > 0.25) * (t < 0.5) + (t > 0.75), 1, 0))
    assert result.final["both"] == 2
