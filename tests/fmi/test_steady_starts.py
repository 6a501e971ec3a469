"""Steady starts of FMUs."""

from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from components import (
    PI,
    BearingFriction,
    Clutch,
    Constant,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    ElastoBacklash,
    Fixed,
    Inertia,
    LossyGear,
    P,
    QuadraticSpeedDependentTorque,
    SpeedSensor,
    Torque,
    ZeroOrderHold,
)
from modelica_like import simulate
from modelica_like.language import Assembly, guess
from modelica_like.native.start import initialize
from modelica_like.netlist import load

EXAMPLES = Path(__file__).parents[2] / "examples"


def rubbing(tau_pos=((0, 1), (1, 2)), w=1.0):
    """5 N.m against a bearing with 1 N.m + 1 N.m s/rad w; sliding, it is steady at 4 rad/s."""
    parts = {
        "push": ConstantTorque(tau_constant=5.0),
        "rotor": Inertia(J=1.0),
        "bearing": BearingFriction(tau_pos=tau_pos, extrapolate="linear", w=guess(w)),
    }
    joints = {"a": ["push.flange", "rotor.flange_a"], "b": ["rotor.flange_b", "bearing.flange_a"]}
    drive = Assembly("rubbing", parts=parts, connect=joints)
    drive.simulate.update(start="steady", until=1.0)
    return drive


def test_a_steady_start_follows_the_guess_and_the_parameters(exported):
    case = exported(rubbing())
    fmu = case.started("me")
    assert fmu.getReal([case.ref("rotor.w")]) == pytest.approx([4.0], rel=1e-12)
    faster = case.started("me", **{"push.tau_constant": 7.0})
    assert faster.getReal([case.ref("rotor.w")]) == pytest.approx([6.0], rel=1e-12)


def clutched():
    """The same behind a clutch that sticks."""
    parts = {
        "push": ConstantTorque(tau_constant=5.0),
        "rotor": Inertia(J=1.0, w=guess(1.0)),
        "clutch": Clutch(capacity=20.0),
        "wheel": Inertia(J=3.0, w=guess(1.0)),
        "bearing": BearingFriction(tau_pos=((0, 1), (1, 2)), extrapolate="linear"),
    }
    drive = Assembly("clutched", parts=parts, series={"shaft": [*parts]})
    drive.simulate.update(start="steady", until=1.0)
    return drive


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_clutch_that_sticks_turns_as_one_in_a_steady_start(exported, version):
    case = exported(clutched(), version)
    fmu = case.started("me", **{"push.tau_constant": 7.0})
    read = fmu.getReal if version == "2.0" else fmu.getFloat64
    assert read([case.ref("rotor.w"), case.ref("wheel.w")]) == pytest.approx([6.0, 6.0], rel=1e-12)
    assert read([case.ref("clutch.w_rel")]) == pytest.approx([0.0], abs=1e-14)
    mode = fmu.getInteger if version == "2.0" else fmu.getInt64
    assert case.model.flat_discretes[0].names[mode([case.ref("clutch.mode")])[0]] == "stuck"


def test_a_gearbox_starts_in_the_steady_state_of_python(exported):
    """Meshes slide one way where the search begins and the other way where it ends: they are held in between."""
    drive = load(EXAMPLES / "lepelletier_gears.toml")
    drive.simulate.update(start="steady")
    case = exported(drive)
    point = initialize(case.model, start="steady")
    fmu = case.started("me")
    modes = [one for one in case.face.variables if one.modes]
    assert fmu.getInteger([one.reference for one in modes]) == [int(point.d[one.slot[1]]) for one in modes]
    named = [x for name, x in zip(case.model.states, point.x, strict=True) if name in case.face.by_name]
    assert case.states(fmu) == pytest.approx(named, rel=1e-9, abs=1e-9)


def controlled(d):
    """A rotor with damping d whose speed is controlled: 10 rad/s, or what 6 N.m reach."""
    parts = {
        "wish": Constant(k=10.0), "control": PI(k=1.0, Ti=0.1, y_max=6.0), "torque": Torque(), "rotor": Inertia(J=1.0),
        "oil": Damper(d=d), "wall": Fixed(), "tacho": SpeedSensor(),
    }  # fmt: skip
    wires = {"wish": ["wish.y", "control.u_s"], "speed": ["tacho.w", "control.u_m"], "u": ["control.y", "torque.tau"],
             "end": ["rotor.flange_b", "tacho.flange"]}  # fmt: skip
    drive = Assembly("controlled", parts=parts, series={"shaft": ["torque", "rotor", "oil", "wall"]}, connect=wires)
    drive.simulate.update(start="steady", until=1.0)
    return drive


@pytest.mark.parametrize(("d", "speed"), [(0.06, 10.0), (0.2, 10.0), (1.0, 6.0)])
def test_a_controller_begins_where_it_settles(exported, d, speed):
    """At rest it is at its limit; from there each limit leads to the other one."""
    run = simulate(controlled(d))
    assert run["rotor.w"] == pytest.approx(np.full(len(run.time), speed), rel=1e-6)
    assert run.final["control.y"] == pytest.approx(d * speed, rel=1e-6)
    assert run.events == ()
    case = exported(controlled(d))
    fmu = case.started("me")
    assert fmu.getReal([case.ref("rotor.w"), case.ref("control.y")]) == pytest.approx([speed, d * speed], rel=1e-9)


def test_a_cascade_of_controllers_begins_where_it_settles(exported):
    drive = load(EXAMPLES / "components" / "servo.toml")
    drive.simulate.update(start="steady")
    case = exported(drive)
    names, settled = ["spindle.motor.w", "spindle.motor.ia", "axis.motor.w", "table.phi"], [100.0, 0.0, 0.0, 3.0]
    final = simulate(drive, 0.1).final
    assert [final[one] for one in names] == pytest.approx(settled, abs=1e-9)
    assert case.started("me").getReal([case.ref(one) for one in names]) == pytest.approx(settled, abs=1e-9)


def test_a_start_that_samples_would_move_is_refused(exported):
    """Nothing is sampled at the start; then 5·(10 - w) = 0.2·w, which a start does not look for."""
    parts = {
        "wish": Constant(k=10.0), "control": P(k=5.0), "hold": ZeroOrderHold(period=0.1), "torque": Torque(),
        "rotor": Inertia(J=1.0), "oil": Damper(d=0.2), "wall": Fixed(), "tacho": SpeedSensor(),
    }  # fmt: skip
    wires = {"wish": ["wish.y", "control.u_s"], "speed": ["tacho.w", "hold.u"], "held": ["hold.y", "control.u_m"],
             "u": ["control.y", "torque.tau"], "end": ["rotor.flange_b", "tacho.flange"]}  # fmt: skip
    sampled = Assembly("sampled", parts=parts, series={"shaft": ["torque", "rotor", "oil", "wall"]}, connect=wires)
    sampled.simulate.update(start="steady", until=1.0)
    with pytest.raises(FMICallException):
        exported(sampled).started("me")


def driven(*parts, **wires):
    """5 N.m drive a shaft."""
    named = {f"part{k}": one for k, one in enumerate(parts)}
    drive = Assembly("driven", parts={"push": ConstantTorque(tau_constant=5.0), **named},
                     series={"shaft": ["push", *named]}, connect=wires)  # fmt: skip
    drive.simulate.update(start="steady", until=1.0)
    return drive


SETTLED = {
    # 5 = 1 + w: at rest the bearing sticks, and does not hold
    "bearing": (lambda: driven(Inertia(J=1.0), BearingFriction(tau_pos=((0, 1), (9, 10)))), {"part0.w": 4.0}),
    # 5 = 0.2·w²: at rest nothing depends on the speed
    "fan": (
        lambda: driven(Inertia(J=1.0), QuadraticSpeedDependentTorque(tau_nominal=-20.0, w_nominal=10.0)),
        {"part0.w": 5.0},
    ),
    # In the middle of its play nothing turns the second wheel; b/2 + 5/c
    "play": (
        lambda: driven(Inertia(J=1.0), ElastoBacklash(c=1e3, d=1.0, b=0.02), Inertia(J=2.0), Damper(d=0.5), Fixed()),
        {"part2.w": 10.0, "part1.phi_rel": -0.015},
    ),
    # Three times the torque, less a tenth, behind a clutch that first sticks
    "gear": (
        lambda: driven(
            Inertia(J=1.0), LossyGear(ratio=3.0, loss_table=((0, 0.9, 0.9, 0, 0),)), Clutch(capacity=100.0),
            Inertia(J=1.0), BearingFriction(tau_pos=((0, 3), (20, 23)))
        ),
        {"part3.w": 10.5, "part0.w": 31.5},
    ),
    # A clutch that cannot bear the torque slips: 5 - 2 on one side, 2 on the other
    "slip": (
        lambda: driven(
            Inertia(J=1.0), BearingFriction(tau_pos=((0, 0), (9, 9))), Clutch(capacity=2.0), Inertia(J=1.0),
            Damper(d=1.0), Fixed()
        ),
        {"part0.w": 3.0, "part3.w": 2.0},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SETTLED)
def test_a_drive_that_is_not_steady_near_rest_begins_where_it_settles(exported, name):
    make, wanted = SETTLED[name]
    run = simulate(make())
    for path, value in wanted.items():
        assert run[path] == pytest.approx(np.full(len(run.time), value), rel=1e-7), path
    assert run.events == ()
    case = exported(make())
    assert case.started("me").getReal([case.ref(path) for path in wanted]) == pytest.approx(
        [*wanted.values()], rel=1e-9
    )


def test_an_fmu_that_begins_where_the_drive_settles_follows_its_parameters(exported):
    case = exported(SETTLED["bearing"][0]())
    faster = case.started("me", **{"push.tau_constant": 7.0})
    assert faster.getReal([case.ref("part0.w")]) == pytest.approx([6.0], rel=1e-12)


def test_where_nothing_can_settle_the_start_is_as_given(exported):
    """A prescribed speed: only an angle moves, on which nothing depends."""
    drive = Assembly("turning", parts={"motor": ConstantSpeed(w_fixed=3.0, phi=0.5), "rotor": Inertia(J=1.0)},
                     series={"shaft": ["motor", "rotor"]})  # fmt: skip
    drive.simulate.update(start="steady", until=1.0)
    assert simulate(drive).final["rotor.phi"] == pytest.approx(3.5)
    case = exported(drive)
    assert case.started("me").getReal([case.ref("rotor.phi"), case.ref("rotor.w")]) == [0.5, 3.0]


def test_what_breaks_away_settles(exported):
    """At rest the bearing sticks, and 5 N.m break it away."""
    case = exported(rubbing())
    fmu = case.started("me", **{"bearing.w": 0.0})
    assert fmu.getReal([case.ref("rotor.w")]) == pytest.approx([4.0], rel=1e-12)


def test_a_steady_start_that_no_mode_allows_is_refused_with_one_message(exported):
    """1 N.m of friction do not hold 5 N.m, at no speed: of all that is tried the first is told."""
    case = exported(rubbing(tau_pos=((0, 1), (1, 1)), w=0.0), "3.0")
    told = []
    fmu = case.instance("me", logMessage=lambda _environment, _status, _category, text: told.append(text.decode()))
    with pytest.raises(FMICallException):
        case.initialize(fmu)
    assert told == ["No steady state was found at t = 0 s: bearing.mode does not stay in its mode."]
