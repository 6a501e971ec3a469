"""Parameters at a kink or a bound: refused with both one-sided derivatives, or right on both sides."""

import math
import os
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from components import Brake, Constant, FirstOrder, Gain, Inertia, Integrator, Ramp, Step
from modelica_like import Assembly, build, sensitivities, simulate
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ModelicaLikeError, NoGradient, StepFailed

ROOT = Path(__file__).parents[2] / "examples"
GEARS = ROOT / "lepelletier_gears.toml"
STEP = 1e-5


def test_the_pressure_of_an_open_brake() -> None:
    """Its capacity is 2000 N.m per pressure above zero; it slides backward."""
    with pytest.raises(NoGradient) as caught:
        sensitivities(GEARS, "box.brake_c.tau", "box.pressure_c")
    assert str(caught.value) == (
        "No gradient of box.brake_c.tau by box.pressure_c: 0 is at a kink.\n"
        "In SI units the derivative above that value is -2000, below it is 0.\n"
        "Leave out box.pressure_c, or move it away from there."
    )
    all_others = sensitivities(GEARS, "box.brake_c.tau")
    assert "box.pressure_c" in all_others.left_out
    assert "box.pressure_a" not in all_others.left_out


def test_a_command_at_its_limit() -> None:
    """With k = 2 the smaller one of k t and 2 t follows k below and not above; J moves neither."""
    parts = {"command": Constant(k=2.0), "sum": Integrator(k=1.0, y=0.0)}
    drive = build(Assembly("limited", parts=parts, connect={"a": ["command.y", "sum.u"]}))
    with pytest.raises(NoGradient, match="the derivative above that value is 0, below it is 3"):
        sensitivities(drive, "min(sum.y, 2*time/(1 s))", "command.k", until=3.0)
    assert sensitivities(drive, "sum.y", "command.k", until=3.0)["sum.y", "command.k"] == pytest.approx(3.0)


def test_a_state_that_rests_at_a_kink_only_moves_one_way() -> None:
    """|x| of a first-order lag that rests at zero: its input moves it to both sides."""
    parts = {"command": Constant(k=0.0), "lag": FirstOrder(T=0.1, y=0.0)}
    drive = build(Assembly("resting", parts=parts, connect={"a": ["command.y", "lag.u"]}))
    change = 1 - math.exp(-10.0)
    with pytest.raises(NoGradient) as caught:
        sensitivities(drive, "abs(lag.y)", "command.k", until=1.0)
    assert f"above that value is {change:.6g}, below it is {-change:.6g}" in str(caught.value)


def test_where_the_run_that_tells_fails_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = {"command": Constant(k=0.0), "lag": FirstOrder(T=0.1, y=0.0)}
    drive = build(Assembly("resting", parts=parts, connect={"a": ["command.y", "lag.u"]}))

    def fail(*_: Any, **__: Any) -> None:
        raise StepFailed("IDAS gave up.")

    monkeypatch.setattr("modelica_like.analyse.sensitivity.at_kinks.quick_run", fail)
    assert sensitivities(drive, "abs(lag.y)", "command.k", until=1.0).notes() == [
        "Whether command.k is at a kink is not known: a run with rtol = 1e-10, which would tell, did not succeed."
    ]


@pytest.mark.parametrize("input_scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("output_scale", [1e-6, 1.0, 1e6])
def test_units_of_what_moves_and_of_what_is_read_do_not_matter(input_scale: float, output_scale: float) -> None:
    parts = {"command": Constant(k=0.0), "unit": Gain(k=input_scale), "lag": FirstOrder(T=0.1, y=0.0)}
    connect = {"a": ["command.y", "unit.u"], "b": ["unit.y", "lag.u"]}
    drive = build(Assembly("resting", parts=parts, connect=connect))
    with pytest.raises(NoGradient) as caught:
        sensitivities(drive, f"abs({output_scale}*lag.y)", "command.k", until=1.0)
    change = (1 - math.exp(-10.0)) * input_scale * output_scale
    assert f"above that value is {change:.6g}, below it is {-change:.6g}" in str(caught.value)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_drive_and_the_same_with_other_torques(scale: float) -> None:
    """A brake of 100 N.m per command on 2 kg.m2 at 10 rad/s: it takes 1 J per command and millisecond, or nothing."""
    parts = {
        "brake": Brake(capacity=100.0 * scale, f_normalized=0.0),
        "rotor": Inertia(J=2.0 * scale, phi=0.0, w=10.0),
    }
    drive = build(Assembly("braked", parts=parts, connect={"a": ["brake.flange_b", "rotor.flange_a"]}))
    for output, above in (("brake.tau", 100.0), ("integral(brake.loss_power)", 100.0)):
        with pytest.raises(NoGradient, match=re.escape(f"above that value is {above * scale:.6g}, below it is 0.")):
            sensitivities(drive, output, "brake.f_normalized", until=0.1)
    # Without command the capacity does nothing.
    assert sensitivities(drive, "rotor.w", "brake.capacity", until=0.1)["rotor.w", "brake.capacity"] == 0.0


@pytest.mark.parametrize("start", [0.0, 1.0 - 1e-14, 1.0, 1.0 + 1e-14])
@pytest.mark.parametrize(("read", "until"), [("sum.y", 1.0), ("at(sum.y, 1 s)", 3.0), ("integral(sum.y)", 1.0)])
def test_a_step_at_the_start_or_where_it_is_read(start: float, read: str, until: float) -> None:
    """The sum of a step of 2 is 2 (1 s - start) for starts between 0 and 1 s, else 2 and 0."""
    parts = {"command": Step(height=2.0, start_time=start), "sum": Integrator(k=1.0, y=0.0)}
    drive = build(Assembly("stepped", parts=parts, connect={"a": ["command.y", "sum.u"]}))
    if read.startswith("integral") and start > 0.5:
        # (1 s - start)² has the slope 0 on both sides.
        assert sensitivities(drive, read, "command.start_time", until=until).derivatives == pytest.approx(0.0, abs=1e-9)
        return
    where = "the start of the run" if start < 0.5 else "the end of the run" if until == 1.0 else f"when {read} is read"
    with pytest.raises(NoGradient, match=re.escape(where)):
        sensitivities(drive, read, "command.start_time", until=until)
    assert sensitivities(drive, read, "command.height", until=until).derivatives >= 0.0


def test_what_does_not_jump_may_begin_with_the_run() -> None:
    """The sum of a ramp of 3 in 2 s that begins at s is 3 (1 - s)²/4 after 1 s on both sides of s = 0."""
    parts = {"command": Ramp(height=3.0, duration=2.0), "sum": Integrator(k=1.0, y=0.0)}
    drive = build(Assembly("rising", parts=parts, connect={"a": ["command.y", "sum.u"]}))
    result = sensitivities(drive, "sum.y", "command.start_time", until=1.0)
    assert result["sum.y", "command.start_time"] == pytest.approx(-1.5)


def test_what_follows_from_an_event_at_the_start() -> None:
    """A pulse that begins with the run closes switches: later, they are open at first; earlier, they open earlier."""
    drive = build(ROOT / "elements" / "h_bridge_machine.toml")
    with pytest.raises(NoGradient, match=r"forward\.stage becomes high exactly at the start of the run"):
        sensitivities(drive, "machine.w", "forward.start_time")
    low, high = (ends(drive, "forward.width", step, ["machine.w"]) for step in (-1e-6, 1e-6))
    assert low is not None
    assert high is not None
    assert sensitivities(drive, "machine.w", "forward.width").derivatives[0] == pytest.approx(
        (high - low) / 2e-6, rel=1e-4
    )


QUICK = ("filters", "lepelletier_gears", "two_mass")
OFTEN = ("winch", "gears_and_losses", "planetary_sets", "servo_axis", "CoupledClutches", "Backlash", "LossyGearDemo1")
"""Examples of continuous integration; the others by hand, with EVERY_EXAMPLE in the environment."""
STEPS = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
"""Relative changes, of parameters that are zero in SI units: backlash of 1e-5 rad is far in gears at rest."""
UNITS = ("N.m", "N", "rad/s", "m/s")


def at_a_bound(model: CompiledDae) -> list[str]:
    """Independent parameters that are zero, or at their smallest or largest value."""
    rows = ((one, float(model.p[k])) for k, one in enumerate(model.flat_parameters) if one.tunable)
    return [one.path for one, value in rows if value in (0.0, one.min, one.max)]


def outputs_of(model: CompiledDae) -> list[str]:
    found = [one.path for one in model.flat_variables if str(one.unit) in UNITS and not one.hidden]
    return found[:: max(len(found) // 4, 1)][:4]


def examples() -> list[Any]:
    """Examples with a run to an end and parameters at a bound."""
    found: list[Any] = []
    for path in sorted(ROOT.rglob("*.toml")):
        content = tomllib.loads(path.read_text())
        if path.stem not in (*QUICK, *OFTEN) and not os.environ.get("EVERY_EXAMPLE"):
            continue
        if path.parent.name != "cosim" and "parts" in content and "until" in content.get("simulate", {}):
            marks = [] if path.stem in QUICK else [pytest.mark.slow]
            found.append(pytest.param(path, id=path.stem, marks=marks))
    return found


def ends(model: CompiledDae, name: str, change: float, outputs: list[str]) -> np.ndarray | None:
    """Final values of a run with another parameter; None if it is refused."""
    value = float(model.p[model.parameter_position[name]])
    try:
        run = simulate(model, parameters={name: value + change}, rtol=1e-10, atol=1e-12, solver="native")
    except ModelicaLikeError:
        return None
    return np.array([run.final[one] for one in outputs])


def agrees(model: CompiledDae, name: str, side: float, outputs: list[str], row: np.ndarray) -> bool:
    """Whether one-sided differences come to the derivatives with smaller steps, or there are no runs on this side."""
    size = abs(float(model.p[model.parameter_position[name]])) or 1.0
    here = ends(model, name, 0.0, outputs)
    assert here is not None
    names = [f"peak({one})" for one in outputs]
    peaks = np.array(simulate(model, solver="native", readings=names).read(*names), float)
    left, first, last = np.ones(len(row), bool), np.zeros(len(row)), np.zeros(len(row))
    for step in (side * size * one for one in STEPS):
        there, other = (ends(model, name, one, outputs) for one in (step, 1.1 * step))
        if there is None or other is None:
            return True
        slope = (there - here) / step
        # Both runs have errors of their relative tolerance, which count against the values, or 1e-3 SI units at rest,
        # and rounding of what has been larger; more than that shows in slopes that scatter. At a kink they do not.
        scatter = np.abs(slope - (other - here) / (1.1 * step))
        noise = (1e-9 * (np.abs(here) + 1e-3) + 1e-12 * np.abs(peaks)) / abs(step) + scatter
        apart = np.abs(slope - row)
        first = np.where(first == 0.0, apart, first)
        known = (noise <= 0.1 * first) | (abs(step) == STEPS[0] * size)
        left &= ~(known & (apart <= 1e-2 * np.maximum(np.abs(row), np.abs(slope)) + noise))
        # Much less at a tenth of the step, and not by chance: the slopes come to the derivative.
        left &= ~((apart <= 0.3 * last) & (scatter <= 0.3 * last))
        last = np.where(scatter <= 0.3 * apart, apart, 0.0)
        if not left.any():
            return True
    return False


@pytest.mark.parametrize("path", examples())
def test_parameters_at_a_bound_against_one_sided_differences(path: Path) -> None:
    model = build(path)
    outputs, names = outputs_of(model), at_a_bound(model)[:6]
    if model.events.delay_parts:
        with pytest.raises(NoGradient, match="delay"):
            sensitivities(model, [*outputs, model.flat_variables[0].path][:1])
        return
    for name in names if outputs else []:
        try:
            row = sensitivities(model, outputs, [name]).derivatives[:, 0]
        except NoGradient:
            continue
        for side in (1.0, -1.0):
            assert agrees(model, name, side, outputs, row), (name, side, row)
