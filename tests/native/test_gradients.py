"""Derivatives that runs in C carry along: against the replay, against differences of runs, and where there are none."""

from pathlib import Path

import numpy as np
import pytest

from components import Clutch, Constant, FirstOrder, Inertia, Integrator, Limiter, Pulse, Sine
from modelica_like import Assembly, build, sensitivities, simulate
from modelica_like.errors import NoGradient
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Input,
    Output,
    Parameter,
    Variable,
    clock,
    der,
    discrete,
    maximum,
    param,
    signal_in,
    signal_out,
    var,
    when,
)

ROOT = Path(__file__).parents[2]
STARTUP = ROOT / "examples" / "machine_tool_startup.toml"
CLUTCHES = ROOT / "examples" / "msl" / "rotational" / "CoupledClutches.toml"
WINCH = ROOT / "tests" / "system" / "new_drives" / "winch.toml"
DRIVES = {
    ROOT / "examples" / "two_mass.toml": (
        0.5, ["J1.w", "shaft.phi_rel", "shaft.tau"], ["J1.J", "J2.J", "shaft.c", "shaft.d", "motor.tau"],
    ),
    CLUTCHES: (1.5, ["J1.w", "J3.w", "J4.phi"], ["J1.J", "f", "sin1.amplitude", "clutch1.fn_max", "T2", "J4.J"]),
    STARTUP: (
        1.0, ["load.w", "J1.phi", "shaft1.tau"], ["J1.J", "k1", "h1", "force", "drag", "coil.start_time", "load.a"],
    ),
}  # fmt: skip


def handle_at(drive, until, of, by, **how):
    handle = build(drive).native(outputs=of, by=by, **how)
    handle.reset(until=until)
    handle.step(until)
    return handle


def error_of(found, exact, values):
    """Largest error of every output, relative to its largest derivative, all by relative changes."""
    return np.max(np.abs(found - exact) * np.abs(values), axis=1) / np.max(np.abs(exact) * np.abs(values), axis=1)


@pytest.mark.parametrize("drive", DRIVES, ids=lambda path: path.stem)
def test_derivatives_are_those_of_the_replay(drive):
    until, of, by = DRIVES[drive]
    values = build(drive).native(outputs=by).outputs
    found = handle_at(drive, until, of, by).gradient()
    exact = sensitivities(simulate(drive, until=until, solver="native", rtol=1e-9), of, by).derivatives
    assert np.all(error_of(found, exact, values) < 1e-6)


def test_derivatives_are_differences_of_runs():
    """Of the winch, whose brake and gear share the load, by central differences of order four."""
    of, by = ["load.s", "rope.f"], ["motor.Ra", "winding.radius", "rope.c"]
    found = handle_at(WINCH, 4.0, of, by, rtol=1e-9).gradient()
    handle = build(WINCH).native(outputs=of, rtol=1e-11)
    values, exact = handle.get(*by), np.zeros_like(found)
    for column, (name, value) in enumerate(zip(by, values, strict=True)):
        step, sides = 3e-5 * value, []
        for side in (-2, -1, 1, 2):
            handle.reset({name: value + side * step}, until=4.0)
            sides.append(handle.step(4.0).copy())
        exact[:, column] = (8 * (sides[2] - sides[1]) - (sides[3] - sides[0])) / (12 * step)
    assert np.all(error_of(found, exact, values) < 1e-6)


@pytest.mark.parametrize("drive", [CLUTCHES, WINCH], ids=lambda path: path.stem)
def test_they_do_not_change_the_run(drive):
    """Not by a bit, with communication points inside of steps."""
    of = ["J1.w", "J4.phi"] if drive == CLUTCHES else ["load.s", "gear.mode"]
    by = ["J1.J"] if drive == CLUTCHES else ["load.m"]
    runs = []
    for chosen in ([], by):
        handle = build(drive).native(outputs=of, by=chosen)
        handle.reset(until=4.0)
        runs.append([handle.step(0.01 * k).copy() for k in range(1, 121)])
    assert np.array_equal(*runs)


def test_points_on_the_way_change_nothing_but_the_error():
    until, of, by = 0.9, ["J3.w"], ["J1.J", "clutch1.fn_max"]
    whole = handle_at(CLUTCHES, until, of, by).gradient()
    handle = build(CLUTCHES).native(outputs=of, by=by)
    handle.reset(until=until)
    for k in range(1, 91):
        handle.step(until * k / 90)
        handle.gradient()
    np.testing.assert_allclose(handle.gradient(), whole, rtol=1e-6)


def test_where_there_are_none():
    parts = {"J1": Inertia(J=1.0, w=1.0, phi=0.0), "clutch": Clutch(capacity=5.0), "J2": Inertia(J=2.0, w=1.0)}
    handle = build(Assembly("equal", parts=parts, series={"shaft": [*parts]})).native(outputs=["J1.w"], by=["J1.w"])
    handle.reset(until=1.0)  # at equal speeds the clutch sticks, at all others it slides
    handle.step(0.1)
    with pytest.raises(NoGradient, match=r"to J1\.w after t = 0 s: a small change of it leads to other modes"):
        handle.gradient()
    handle = build(CLUTCHES).native(outputs=["J1.w"], by=["J1.J"])
    handle.reset(until=1.0)
    copy = handle.copy()
    handle.restore(copy)
    with pytest.raises(NoGradient, match="the state was set"):
        handle.gradient()
    handle.reset(until=1.0)
    assert handle.gradient()[0, 0] == 0.0
    with pytest.raises(NoGradient, match=r"^No derivatives were asked for\.\nName parameters"):
        build(CLUTCHES).native(outputs=["J1.w"]).gradient()
    with pytest.raises(NoGradient, match="need Co-Simulation with adaptive steps"):
        build(CLUTCHES).native(outputs=["J1.w"], by=["J1.J"], fixed_step=1e-3)
    with pytest.raises(NoGradient, match=r"Derivatives with respect to clutch1\.tau are not available"):
        build(CLUTCHES).native(by=["clutch1.tau"])


class Positive(Component):
    """A signal, or zero: a kink without a mode."""

    u: Input = signal_in("1", "signal")
    y: Output = signal_out("1", "what is positive of it")

    def equations(self) -> Equations:
        yield self.y == maximum(self.u, 0)


@pytest.mark.parametrize("limit", ["Limiter", "max"])
def test_a_state_that_rests_at_a_limit_has_two_derivatives(limit):
    """A lag rests at zero, where what follows is limited; its own derivative by the command is 1 - exp(-10)."""
    law = {"Limiter": Limiter(y_max=1.0, y_min=0.0), "max": Positive()}[limit]
    parts = {"command": Constant(k=0.0), "lag": FirstOrder(T=0.1, y=0.0), "limit": law, "sum": Integrator(k=1.0, y=0.0)}
    connect = {"a": ["command.y", "lag.u"], "b": ["lag.y", "limit.u"], "c": ["limit.y", "sum.u"]}
    drive = build(Assembly("resting", parts=parts, connect=connect))
    handle = drive.native(outputs=["sum.y", "lag.y"], by=["command.k"])
    handle.reset(until=1.0)
    handle.step(1.0)
    with pytest.raises(NoGradient, match=r"no derivatives with respect to command\.k .*: it is at a kink there"):
        handle.gradient()
    moved = build(Assembly("moved", parts=parts | {"command": Constant(k=0.5)}, connect=connect))
    handle = moved.native(outputs=["sum.y", "lag.y"], by=["command.k"], rtol=1e-9)
    handle.reset(until=1.0)
    handle.step(1.0)
    lag = 1 - np.exp(-10.0)
    np.testing.assert_allclose(handle.gradient().ravel(), [1 - 0.1 * lag, lag], rtol=1e-7)


RESTING = {
    "a signal that never moves": ({}, ["command.y", "limit.u"], "sum.y"),
    "an output that is read there": ({}, ["command.y", "limit.u"], "limit.y"),
    "steps shorter than a thousandth of the run": (
        {"lag": FirstOrder(T=0.1, y=0.0), "fast": Sine(f=2000.0), "other": Integrator(k=1.0, y=0.0)},
        ["lag.y", "limit.u"], "sum.y",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", RESTING)
def test_what_rests_at_a_kink_has_two_derivatives(case):
    """The integral of max(command, 0) over 1 s: its derivative by the command is 1 above zero, and 0 below."""
    more, link, output = RESTING[case]
    parts = {"command": Constant(k=0.0), **more, "limit": Positive(), "sum": Integrator(k=1.0, y=0.0)}
    connect = {"link": link, "sum": ["limit.y", "sum.u"]}
    if more:
        connect |= {"lag": ["command.y", "lag.u"], "other": ["fast.y", "other.u"]}
    drive = Assembly("resting", parts=parts, connect=connect)
    with pytest.raises(NoGradient, match=r"no derivatives with respect to command\.k .*: it is at a kink there"):
        handle_at(drive, 1.0, [output], ["command.k"]).gradient()
    if not more:
        moved = Assembly("moved", parts=parts | {"command": Constant(k=0.5)}, connect=connect)
        assert handle_at(moved, 1.0, [output], ["command.k"]).gradient()[0, 0] == pytest.approx(1.0, rel=1e-12)


def test_switches_behind_which_another_pulse_would_begin():
    """A pulse more, by any more periods, changes nothing at the instants of this run; differences of runs have 0.

    The diodes of the bridge open after the last pulse: passed again with another number, they left their impulses.
    """
    drive = ROOT / "examples" / "elements" / "h_bridge_machine.toml"
    of, by = ["machine.w", "machine.ia"], ["forward.periods", "battery.V", "forward.period"]
    found = handle_at(drive, 0.0305, of, by, rtol=1e-9).gradient()
    np.testing.assert_array_equal(found[:, 0], 0.0)
    model, period, change = build(drive), 1e-3, 1e-8
    sides = [
        simulate(model, 0.0305, parameters={by[2]: period + side * change}, rtol=1e-12, solver="native").final[of[0]]
        for side in (-1, 1)
    ]
    assert found[0, 2] == pytest.approx((sides[1] - sides[0]) / (2 * change), rel=1e-5)


def test_a_run_that_stays_on_the_border_of_two_branches():
    """Both loss lines of the gear meet at 1 N.m, also with another size of them: it brakes 0.002 kg.m2 from 10 rad/s.

    The angle is 0.1 rad / size. What leads off the border, as one of the masses, has no derivative.
    """
    drive = ROOT / "examples" / "msl" / "rotational" / "LossyGearDemo3.toml"
    found = handle_at(drive, 0.4, ["torque1.phi"], ["gear.tau_scale"]).gradient()
    assert found[0, 0] == pytest.approx(-0.1, rel=1e-12)
    found = handle_at(drive, 0.4, ["torque1.phi"], ["gear.tau_scale", "Inertia1.J"]).gradient()
    assert found[0, 0] == pytest.approx(-0.1, rel=1e-12)
    assert np.isnan(found[0, 1])


def test_a_sample_at_the_instant_of_another_event():
    """Each sample takes half of the error; the second one is at 30 rad/s, at which a switch is thrown: w = 35 rad/s.

    Before that, w / k_set = 0.5 * 0.1 s / 0.1 kg.m2 = 1/2. Behind it, nobody knows which came first.
    """
    drive = ROOT / "examples" / "components" / "sampled_control.toml"
    before = handle_at(drive, 0.15, ["rotor.w"], ["wanted.k"]).gradient()
    assert before[0, 0] == pytest.approx(0.5 + 0.25 / 2, rel=1e-12)
    with pytest.raises(NoGradient, match=r"wanted\.k after t = 0\.2 s: it moves apart events that happen together"):
        handle_at(drive, 0.35, ["rotor.w"], ["wanted.k"]).gradient()
    free = handle_at(drive, 0.35, ["wheel[1].w"], ["wheel[1].J", "wanted.k"]).gradient()
    assert free[0, 1] == 0.0


def test_what_begins_just_at_the_start():
    """A wave may begin a little later: its integral loses what it has at the end. A pulse would be missed a moment."""
    connect = {"y": ["source.y", "sum.u"]}

    def integral_of(source):
        parts = {"source": source, "sum": Integrator(k=1.0, y=0.0)}
        return handle_at(Assembly("begins", parts=parts, connect=connect), 0.4, ["sum.y"], ["source.start_time"])

    found = integral_of(Sine(f=0.5)).gradient()
    assert found[0, 0] == pytest.approx(-np.sin(0.4 * np.pi), rel=1e-6)
    with pytest.raises(NoGradient, match="a small change of it leads to other modes there"):
        integral_of(Pulse(period=1.0)).gradient()


class Held(Component):
    """The rate of x is k from the first tick on, which is just at the start."""

    units_checked = False
    x: Variable = var("1", "state")
    k: Parameter = param("1", "rate", default=2.0)
    first: Parameter = param("s", "first tick", default=0.0)
    rate: Discrete = discrete("1", "rate that is held")

    def equations(self) -> Equations:
        yield der(self.x) == self.rate

    def events(self) -> Events:
        yield when(clock(1.0, self.first), {self.rate: self.k})


def test_a_clock_that_ticks_just_at_the_start():
    """x is k (t - first): a later tick has that derivative, an earlier one has none."""
    found = handle_at(Held(x=0.0), 0.5, ["x"], ["first", "k"]).gradient()
    assert np.isnan(found[0, 0])
    assert found[0, 1] == pytest.approx(0.5, rel=1e-12)
