"""Friction where a source prescribes the motion: nothing is free to stick there."""

from math import pi
from typing import Any

import numpy as np
import pytest

from components import (
    Accelerate,
    BearingFriction,
    Brake,
    Clutch,
    Constant,
    ConstantSpeed,
    Fixed,
    Freewheel,
    Inertia,
    LossyGear,
    MachineTable,
    MassWithStopAndFriction,
    Position,
    Ramp,
    Sine,
    Speed,
    SpeedDependentLoad,
    SupportFriction,
    TorqueLimiter,
    TranslationalSpeed,
    Trapezoid,
)
from modelica_like import Assembly, Component, Solution, simulate
from modelica_like.errors import SingularAtStart
from modelica_like.flatten import flatten
from modelica_like.structure import reduce


def driven(source: Component, entry: str, signal: Component, *elements: Component, until: float = 1.0) -> Solution:
    parts = {"signal": signal, "source": source} | {f"element{k}": one for k, one in enumerate(elements)}
    if isinstance(elements[-1], LossyGear):
        parts["load"] = Inertia(J=0.5)
    return simulate(
        Assembly(
            "drive", parts=parts, series={"shaft": list(parts)[1:]}, connect={"s": ["signal.y", f"source.{entry}"]}
        ),
        until, rtol=1e-8,
    )  # fmt: skip


FRICTION: dict[str, tuple[Any, str]] = {
    "bearing": (lambda: BearingFriction(tau_pos=((0, 2), (1, 5)), peak=1.5, extrapolate="linear"), "tau"),
    "brake": (lambda: Brake(fn_max=4.0, mu_pos=((0, 0.5), (1, 1.25)), extrapolate="linear"), "tau"),
    "load": (lambda: SpeedDependentLoad(a=2.0, b=3.0), "tau"),
    "gear": (
        lambda: LossyGear(ratio=2.0, loss_table=((0, 1, 1, 2, 2), (1, 1, 1, 5, 5)), extrapolate="linear"),
        "tau_loss",
    ),
}
"""Each with the friction 2 N.m + 3 N.m.s/rad·|w|, and the name of it."""

MOTIONS: dict[str, tuple[Any, Any, list[float]]] = {
    "through zero": (lambda: Ramp(height="4 rad/s", offset="-2 rad/s", duration="1 s"), lambda t: -2 + 4 * t, [0.5]),
    "from zero": (
        lambda: Sine(amplitude="5 rad/s", f=1.0), lambda t: 5 * np.sin(2 * pi * t), [0.0, 0.5, 1.0],
    ),
    "from a turning point": (
        lambda: Sine(amplitude="5 rad/s", f=1.0, phase=pi / 2), lambda t: 5 * np.cos(2 * pi * t), [0.25, 0.75],
    ),
    "constant": (lambda: Constant(k="3 rad/s"), lambda t: 3 + 0 * t, []),
}  # fmt: skip


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_slow_start_breaks_away_where_it_will_exceed_what_counts_as_rest(direction: float) -> None:
    """0.5 rad/s² reach 1 mrad/s at 2 ms, which is seen `creep_time` = 1 ms before."""
    signal = Ramp(height=f"{0.5 * direction} rad/s", offset="0 rad/s", duration="1 s")
    run = driven(Speed(), "w_ref", signal, BearingFriction(tau_pos=((0, 2), (1, 5)), rest=1e-3, creep_time=1e-3))
    assert run.events[0].time == pytest.approx(1e-3, rel=1e-6)
    assert run.final["element0.tau"] == pytest.approx(direction * 3.5, rel=1e-6)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("name", FRICTION)
def test_a_prescribed_speed_meets_the_sliding_friction(name: str, motion: str) -> None:
    make, torque = FRICTION[name]
    signal, speed, reversals = MOTIONS[motion]
    run = driven(Speed(), "w_ref", signal(), make())
    w = speed(run.time)
    moving = np.abs(w) > 1e-6
    np.testing.assert_allclose(
        run[f"element0.{torque}"][moving], (np.sign(w) * (2 + 3 * np.abs(w)))[moving], rtol=1e-9, atol=1e-9
    )
    changes = sorted({round(event.time, 9) for event in run.events if event.mode == "element0.mode"})
    np.testing.assert_allclose(changes, reversals, atol=1e-9)
    loss = np.trapezoid((2 + 3 * np.abs(speed(fine := np.linspace(0, 1, 20001)))) * np.abs(speed(fine)), fine)
    assert run.energy()["element0"].lost == pytest.approx(loss, rel=1e-6)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("name", FRICTION)
def test_at_rest_it_takes_no_torque(name: str) -> None:
    """Anything up to the static friction would be possible; zero is the one that is not made up."""
    make, torque = FRICTION[name]
    run = driven(Speed(), "w_ref", Constant(k="0 rad/s"), make())
    assert np.all(run[f"element0.{torque}"] == 0.0)
    assert run.events == ()


@pytest.mark.parametrize("name", FRICTION)
@pytest.mark.parametrize("sign", [1, -1])
def test_stop_and_go(name: str, sign: int) -> None:
    """The speed rises, holds, and falls to a rest that it only just reaches."""
    make, torque = FRICTION[name]
    wave = Trapezoid(amplitude=f"{sign} rad/s", period="1 s", rising="0.2 s", width="0.3 s", falling="0.2 s")
    run = driven(Speed(), "w_ref", wave, make(), until=2.0)
    phase = run.time % 1.0
    rests = (phase > 0.7 + 1e-9) & (phase < 1.0 - 1e-9)
    goes = (phase > 1e-9) & (phase < 0.7 - 1e-9)
    assert np.all(run[f"element0.{torque}"][rests] == 0.0)
    assert np.all(sign * run[f"element0.{torque}"][goes] >= 2.0)
    stops = [event.time for event in run.events if event.mode == "element0.mode" and event.after == "stuck"]
    np.testing.assert_allclose(stops, [0.7, 1.7], atol=1e-9)


@pytest.mark.slow
def test_other_ways_to_prescribe() -> None:
    """An angle, exactly or filtered, and an acceleration."""
    for source, entry, signal in (
        (Position(), "phi_ref", Sine(amplitude="1 rad", f=1.0)),
        (Position(exact=False, phi=0.0, w=0.0, f_crit=200.0), "phi_ref", Sine(amplitude="1 rad", f=1.0)),
        (Accelerate(phi=0.0, w=2 * pi), "a_ref", Sine(amplitude=-4 * pi**2, f=1.0)),
    ):
        run = driven(source, entry, signal, Brake(capacity=3.0), Inertia(J=0.5))
        w = run["source.w"]
        moving = np.abs(w) > 1e-3
        np.testing.assert_allclose(run["element0.tau"][moving], 3 * np.sign(w[moving]), rtol=1e-9)
        assert len([event for event in run.events if event.after in ("forward", "backward")]) in (2, 3)
        assert run.energy().power_closure <= 1e-8


def test_a_clutch_between_two_prescribed_shafts() -> None:
    """Slip 1 - 2·sin(2·pi·t): its sign changes at 1/12 s and 5/12 s; the work is 3 N.m times the way."""
    parts: dict[str, Component] = {
        "slow": ConstantSpeed(w_fixed=1.0), "clutch": Clutch(capacity=3.0), "fast": Speed(),
        "signal": Sine(amplitude="2 rad/s", f=1.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["fast", "clutch", "slow"]}, connect={"s": ["signal.y", "fast.w_ref"]}
    )
    run = simulate(drive, "1 s")
    reversals = sorted({round(event.time, 9) for event in run.events})
    np.testing.assert_allclose(reversals, [1 / 12, 5 / 12], atol=1e-9)
    between = 1 / 3 - 2 * (np.cos(pi / 6) - np.cos(5 * pi / 6)) / (2 * pi)
    assert run.energy()["clutch"].lost == pytest.approx(3.0 * (1.0 - 2 * between), rel=1e-7)


def test_equal_speeds_do_not_chatter() -> None:
    """Two sources with the same speed, one of them a turn late: the slip is nothing but rounding."""
    parts: dict[str, Component] = {
        "one": Speed(), "clutch": Clutch(capacity=3.0), "two": Speed(),
        "signal1": Sine(amplitude="5 rad/s", f=1.0), "signal2": Sine(amplitude="5 rad/s", f=1.0, phase=2 * pi),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["one", "clutch", "two"]},
        connect={"a": ["signal1.y", "one.w_ref"], "b": ["signal2.y", "two.w_ref"]},
    )  # fmt: skip
    run = simulate(drive, "3 s")
    assert np.max(np.abs(run["clutch.w_rel"])) < 1e-13
    assert len(run.events) <= 2


def test_several_on_one_prescribed_shaft() -> None:
    """Each of them is determined: they add up."""
    run = driven(
        Speed(), "w_ref", Sine(amplitude="5 rad/s", f=1.0),
        Brake(capacity=3.0), BearingFriction(), TorqueLimiter(tau_max=2.0), Fixed(),
    )  # fmt: skip
    w = run["source.w"]
    moving = np.abs(w) > 1e-3
    np.testing.assert_allclose(run["source.flange.tau"][moving], -6.0 * np.sign(w[moving]), rtol=1e-9)


@pytest.mark.parametrize(
    "element",
    [
        SupportFriction(f_pos=((0, 3),)), MachineTable(m=2.0, f_friction=3.0),
        MassWithStopAndFriction(m=2.0, F_Coulomb=3.0),
    ],
    ids=["slideway", "table", "mass"],
)  # fmt: skip
def test_slides(element: Component) -> None:
    run = driven(TranslationalSpeed(s=0.0), "v_ref", Sine(amplitude="2 m/s", f=1.0), element)
    v = run["element0.v"]
    moving = np.abs(v) > 1e-6
    np.testing.assert_allclose(run["element0.f"][moving], 3.0 * np.sign(v[moving]), rtol=1e-9)
    assert run.energy()["element0"].lost == pytest.approx(3.0 * 4 * 2.0 / (2 * pi), rel=1e-8)


def test_what_holds_a_prescribed_motion_says_who_prescribes_it() -> None:
    """A stop and a freewheel cannot give way."""
    with pytest.raises(SingularAtStart) as stopped:
        driven(
            TranslationalSpeed(s=0.0), "v_ref", Constant(k="1 m/s"), MassWithStopAndFriction(m=1.0, L=0.0, smax=0.25)
        )
    assert "t = 0.25 s" in stopped.value.what
    assert stopped.value.why == "element0 holds a motion that is prescribed by source: no force can stop it."
    with pytest.raises(SingularAtStart, match="prescribed by source: no torque can stop it"):
        driven(Speed(), "w_ref", Ramp(height="2 rad/s", offset="-1 rad/s", duration="1 s"), Freewheel(), Fixed())


def test_what_a_torque_moves_still_sticks() -> None:
    """The same brake on a shaft behind a clutch is free to stick; so are two shafts that only a gear couples."""
    parts: dict[str, Component] = {
        "source": ConstantSpeed(w_fixed=2.0), "clutch": Clutch(capacity=1.0), "shaft": Inertia(J=1.0, w=0.0),
        "brake": Brake(capacity=3.0),
    }  # fmt: skip
    drive = Assembly("drive", parts=parts, series={"shaft": list(parts)})
    run = simulate(drive, "1 s")
    assert np.all(run["shaft.w"] == 0.0)
    np.testing.assert_allclose(run["brake.tau"], 1.0, rtol=1e-12)
    assert reduce(flatten(drive)).flat.flags == ()
