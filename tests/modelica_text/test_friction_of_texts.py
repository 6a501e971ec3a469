"""Friction by equations of Booleans and Integers, as the standard library writes it, at several clutches."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from modelica_like import load, simulate

PLATES = """
package Plates
  model Plate "capacity tau_0 at standstill over peak while it slides; none before it is pressed"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliantWithRelativeStates;
    parameter Real tau_0 = 80;
    parameter Real peak = 1;
    parameter Real pressed_at = -1;
    Real capacity, sa;
    Boolean free, startForward(start=false, fixed=true), startBackward(start=false, fixed=true), locked(start=false);
    Integer mode(start=3, fixed=true);
  equation
    capacity = if time < pressed_at then 0 else tau_0;
    free = capacity <= 0;
    startForward = pre(mode) == 0 and (sa > peak*capacity or pre(startForward) and sa > capacity)
      or initial() and w_rel > 0;
    startBackward = pre(mode) == 0 and (sa < -peak*capacity or pre(startBackward) and sa < -capacity)
      or initial() and w_rel < 0;
    locked = not free and not (pre(mode) == 1 or startForward or pre(mode) == -1 or startBackward);
    a_rel = if locked then 0 else if free then sa
      else if startForward then sa - peak*capacity else if startBackward then sa + peak*capacity
      else if pre(mode) == 1 then sa - peak*capacity else if pre(mode) == -1 then sa + peak*capacity
      else sa - sign(w_rel)*peak*capacity;
    tau = if locked then sa else if free then 0
      else (if startForward or not startBackward and pre(mode) == 1 then 1 else -1)*capacity;
    mode = if free then 2 else if (pre(mode) == 1 or pre(mode) == 2 or startForward) and w_rel > 0 then 1
      else if (pre(mode) == -1 or pre(mode) == 2 or startBackward) and w_rel < 0 then -1 else 0;
  end Plate;

  model Two "one turns faster; later a torque is more than the plate bears at standstill"
    import Modelica.Mechanics.Rotational.Components.*;
    parameter Real peak = 1;
    Modelica.Blocks.Sources.Step torque(height = 200, startTime = 0.5);
    Modelica.Mechanics.Rotational.Sources.Torque motor;
    Inertia a(J = 1, phi(start = 0, fixed = true), w(start = 100, fixed = true));
    Inertia b(J = 0.5, phi(start = 0, fixed = true), w(start = 85, fixed = true));
    Plate plate(peak = peak);
  equation
    connect(torque.y, motor.tau);
    connect(motor.flange, a.flange_a);
    connect(a.flange_b, plate.flange_a);
    connect(plate.flange_b, b.flange_a);
  end Two;

  model Row "pressed one after the other"
    import Modelica.Mechanics.Rotational.Components.*;
    Inertia m[4](each J = 1, each phi(start = 0, fixed = true), w(start = {10, 0, 0, 0}, each fixed = true));
    Plate plate[3](each tau_0 = 10, pressed_at = {-1, 0.8, 1.6}, each peak = 1.1);
    Modelica.Blocks.Sources.Sine torque(amplitude = 5, f = 5);
    Modelica.Mechanics.Rotational.Sources.Torque motor;
  equation
    connect(torque.y, motor.tau);
    connect(motor.flange, m[1].flange_a);
    for k in 1:3 loop
      connect(m[k].flange_b, plate[k].flange_a);
      connect(plate[k].flange_b, m[k + 1].flange_a);
    end for;
  end Row;
end Plates;
"""


@pytest.fixture
def plates(tmp_path: Path) -> Path:
    path = tmp_path / "plates.mo"
    path.write_text(PLATES)
    return path


@pytest.mark.parametrize(("peak", "holds"), [(1.0, False), (2.0, True)])
def test_a_plate_sticks_and_breaks_loose(plates: Path, peak: float, holds: bool) -> None:
    """At 200 N.m the plate would have to bear a third, 66.7 N.m, with 0.5 kg.m2 behind it, of 160 N.m or of 25."""
    tau_0 = 80.0 if holds else 25.0
    model = load(f"{plates}:Plates.Two")
    model.set("plate.tau_0", tau_0)
    model.set("peak", peak)
    run = simulate(model, 1.0, rtol=1e-10)
    t = run.time
    locks = 15 / (tau_0 / 1 + tau_0 / 0.5)
    common = (100 + 0.5 * 85) / 1.5
    slip = np.where(t < locks, -15 + 3 * tau_0 * t, 0.0)
    slip -= 0 if holds else np.maximum(t - 0.5, 0) * (200 - 3 * tau_0)
    momentum = 142.5 + 200 * np.maximum(t - 0.5, 0)
    assert run["plate.w_rel"] == pytest.approx(slip, abs=1e-7)
    assert run["a.w"] + 0.5 * run["b.w"] == pytest.approx(momentum, abs=1e-7)
    assert run.at(0.4)["a.w"] == pytest.approx(common, abs=1e-8)
    assert run.at(0.9)["plate.mode"] == (0 if holds else -1)


def test_plates_in_a_row_lock_one_after_the_other(plates: Path) -> None:
    """What locks stays locked, because the sine is too weak. What nothing drives yet has slips of rounding."""
    run = simulate(load(f"{plates}:Plates.Row"), 3.0, rtol=1e-10)

    def momentum(t: float) -> float:
        return 10 + 5 * (1 - np.cos(10 * np.pi * t)) / (10 * np.pi)

    for k, pressed in ((1, 0.0), (2, 0.8), (3, 1.6)):  # k masses turn with each other, the next one is at rest

        def slip(t: float, k: int = k, pressed: float = pressed) -> float:
            return 10 * (t - pressed) - (momentum(t) - 10 * (t - pressed)) / k

        locks: Any = brentq(slip, pressed, pressed + 0.7, xtol=1e-12)
        assert run.at(locks - 1e-6)[f"plate[{k}].mode"] == -1
        assert run.at(locks + 1e-6)[f"plate[{k}].mode"] == 0
        later = locks + 0.05
        assert [run.at(later)[f"m[{n}].w"] for n in range(1, 5)] == pytest.approx(
            [momentum(later) / (k + 1) if n <= k + 1 else 0.0 for n in range(1, 5)], abs=1e-8
        )
