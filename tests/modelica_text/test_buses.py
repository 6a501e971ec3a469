"""Expandable connectors: values against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import load, simulate
from modelica_like.errors import UnknownName

INTERFACES = """
connector RealInput = input Real;
connector RealOutput = output Real;
connector BooleanInput = input Boolean;
connector BooleanOutput = output Boolean;
connector IntegerOutput = output Integer;
block Gain
  parameter Real k = 1;
  RealInput u; RealOutput y;
equation
  y = k*u;
end Gain;
block Ramp
  parameter Real k = 1;
  RealOutput y = k*time;
end Ramp;
block After
  parameter Real t = 0.5;
  BooleanOutput y = time > t;
end After;
expandable connector Inner
  Real unused;
end Inner;
expandable connector Bus
  parameter Integer n = 2;
  Real speed(unit = "rad/s");
  Real never;
  Inner inner1;
end Bus;
"""


def read(folder: Path, text: str) -> Any:
    (folder / "a.mo").write_text(INTERFACES + text)
    return load(folder / "a.mo")


def run(folder: Path, text: str) -> Any:
    return simulate(read(folder, text), 1.0, rtol=1e-10, atol=1e-12)


def test_values_go_through_buses_of_parts_in_both_directions(tmp_path: Path) -> None:
    result = run(tmp_path, """
model Plant
  Bus bus;
  Ramp ramp(k = 3);
  Gain gain(k = 2);
  Real seen = bus.command + bus.speed;
equation
  connect(ramp.y, bus.speed);
  connect(bus.command, gain.u);
end Plant;
model Controller
  Bus bus;
  Gain gain(k = -5);
equation
  connect(gain.u, bus.speed);
  connect(gain.y, bus.command);
end Controller;
model Around
  Bus bus;
  Plant plant;
equation
  connect(plant.bus, bus);
end Around;
model A
  Around around;
  Controller controller;
  Gain last;
protected
  Bus bus;
equation
  connect(around.bus, bus);
  connect(bus, controller.bus);
  connect(bus.command, last.u);
end A;
""")  # fmt: skip
    assert result["around.plant.gain.y"] == pytest.approx(-30 * result.time)
    assert result["around.plant.seen"] == pytest.approx(-12 * result.time)
    assert result["last.y"] == pytest.approx(-15 * result.time)
    for path in ("bus.speed", "around.bus.speed", "around.plant.bus.speed", "controller.bus.speed"):
        assert result[path] == pytest.approx(3 * result.time)
    with pytest.raises(UnknownName):  # no connection names it
        result["bus.never"]


def test_buses_within_buses_conditions_and_counts(tmp_path: Path) -> None:
    result = run(tmp_path, """
model Part
  Inner bus;
  parameter Boolean spare = false;
  Ramp ramp; After after(t = 0.25); Ramp other if spare;
equation
  connect(ramp.y, bus.x);
  connect(after.y, bus.on);
  if spare then
    connect(other.y, bus.y);
  end if;
  connect(other.y, bus.z);
end Part;
block Counter
  input Boolean on;
  IntegerOutput y = if on then 3 else 1;
end Counter;
model Reader
  Bus b;
  BooleanOutput on; RealOutput x;
  Counter count(on = on);
  discrete Real at(start = 0, fixed = true);
equation
  connect(on, b.inner1.on);
  connect(b.inner1.x, x);
  connect(count.y, b.count);
  when on then
    at = time;
  end when;
end Reader;
model A
  Bus bus; Part part; Reader reader;
  Real n = bus.count;
  Real y = if bus.inner1.on then 7 else 2;
equation
  connect(part.bus, bus.inner1);
  connect(bus, reader.b);
end A;
""")  # fmt: skip
    late = result.time > 0.25
    far = np.abs(result.time - 0.25) > 1e-9
    assert result["reader.x"] == pytest.approx(result.time)
    assert result["n"][far] == pytest.approx(np.where(late, 3, 1)[far])
    assert result["y"][far] == pytest.approx(np.where(late, 7, 2)[far])
    assert result.final["reader.at"] == pytest.approx(0.25)


def test_inputs_of_classes_arrays_and_what_is_outer(tmp_path: Path) -> None:
    result = run(tmp_path, """
model Sender
  RealInput u; RealInput v[2]; Inner bus;
equation
  connect(u, bus.u);
  connect(v, bus.v);
end Sender;
model Listener
  outer Bus bus;
  Gain gain(k = 10);
  Ramp ramp(k = 4);
equation
  connect(bus.inner1.v[2], gain.u);
  connect(ramp.y, bus.fast);
end Listener;
model A
  inner Bus bus; Sender sender; Listener listener; Ramp ramp[2](k = {1, 2}); Ramp other(k = 7);
  Gain gain[2](k = {1, 1}); Gain fast;
  Real w = sum(bus.inner1.v);
equation
  connect(ramp.y, sender.v);
  connect(other.y, sender.u);
  connect(sender.bus, bus.inner1);
  connect(bus.inner1.v, gain.u);
  connect(bus.fast, fast.u);
end A;
""")  # fmt: skip
    t = result.time
    assert result["listener.gain.y"] == pytest.approx(20 * t)
    assert result["gain[2].y"] == pytest.approx(2 * t)
    assert result["w"] == pytest.approx(3 * t)
    assert result["bus.inner1.u"] == pytest.approx(7 * t)
    assert result["fast.y"] == pytest.approx(4 * t)


def test_a_truth_value_for_an_instant_goes_through(tmp_path: Path) -> None:
    result = run(tmp_path, """
block Tick
  BooleanOutput y = sample(0, 0.25);
end Tick;
block Count
  BooleanInput u; discrete Real n(start = 0, fixed = true);
equation
  when u then
    n = pre(n) + 1;
  end when;
end Count;
model Part
  Bus bus; Tick tick;
equation
  connect(tick.y, bus.tick);
end Part;
model A
  Bus bus; Part part; Count count;
equation
  connect(part.bus, bus);
  connect(bus.tick, count.u);
end A;
""")  # fmt: skip
    assert result.final["count.n"] == 4 + 1 * (result.time[-1] >= 1)


@pytest.mark.parametrize(
    "part",
    [
        "BooleanInput u; Tick unused; equation connect(u, bus.tick);",
        "BooleanInput u; protected BooleanOutput y = u; equation connect(y, bus.tick);",
        "BooleanInput u; protected BooleanOutput y = sample(0.125, 0.25); equation connect(y, bus.tick);",
    ],
)
def test_a_truth_value_for_an_instant_enters_through_a_signal_of_the_class(part: str, tmp_path: Path) -> None:
    """All that count see it in the same instant, in the bus and outside."""
    result = run(
        tmp_path,
        f"""
block Tick
  BooleanOutput y = sample(0.125, 0.25);
end Tick;
block Count
  BooleanInput u; discrete Real n(start = 0, fixed = true);
equation
  when u then
    n = pre(n) + 1;
  end when;
end Count;
model Part
  Bus bus; {part}
end Part;
model A
  Bus bus; Part part; Tick tick; Count count, direct;
  Integer n(start = 0, fixed = true), apart(start = 0, fixed = true);
equation
  connect(tick.y, part.u);
  connect(tick.y, direct.u);
  connect(part.bus, bus);
  connect(bus.tick, count.u);
  when bus.tick then
    n = pre(n) + 1;
  end when;
  when direct.n <> count.n then
    apart = pre(apart) + 1;
  end when;
end A;
""",
    )
    assert [result.final[name] for name in ("count.n", "n", "direct.n", "apart")] == [4, 4, 4, 0]
