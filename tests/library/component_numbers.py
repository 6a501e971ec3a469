"""Closed forms of the netlists of examples/components."""

from math import atan, cos, exp, log, pi, sin, sqrt, tan, tanh

import closed_forms
import numpy as np
import pytest
from closed_forms import close
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.special import sici

from modelica_like.runs.solution import Solution

numbers = closed_forms.numbers("components")


@numbers
def belt_slip(run: Solution) -> None:
    force = 2 * 200 * tanh(0.3 * 170 / 180 * pi / 2)
    assert run.at(0.3)["belt.f"] == close(force)
    assert run.at(0.5)["flywheel.w"] - run.at(0.1)["flywheel.w"] == close(0.4 * 0.1 * force / 0.5)
    assert run.at(0.3)["belt.F_1"] / run.at(0.3)["belt.F_2"] == close(exp(0.3 * 170 / 180 * pi))


@numbers
def dogs(run: Solution) -> None:
    engaged = run.impacts[0]
    assert (engaged.component, engaged.time) == ("dogs", close(2.0))
    assert engaged.energy == close(0.5 * 1 * 0.25 / 1.25 * 25)
    # From there the shaft and its sleeve turn with 5/1.25 rad/s, braked by 2/1.25 rad/s²: 0.1 rad later the claws meet.
    meeting = (4 - sqrt(16 - 2 * 1.6 * 0.1)) / 1.6
    assert run.impacts[1].time == close(2 + meeting)
    speed = 4 - 1.6 * meeting
    assert run.impacts[1].energy == close(0.5 * 1.25 * 3 / 4.25 * speed**2 * (1 - 0.5**2))


@numbers
def torque_map(run: Solution) -> None:
    assert run.final["throttle.y"] == close(0.6)
    lag = 0.5 * 200 / (0.6 * 100)
    assert run.at(1.0)["flywheel.w"] == close(200 * (1 - exp(-1.0 / lag)))
    assert run.final["flywheel.w"] == close(200 * (1 - exp(-5.0 / lag)))


@numbers
def screw_lift(run: Solution) -> None:
    ideal = 2000 * 0.01 / (2 * pi)
    assert -run.at(0.3)["motor.flange.tau"] == close(ideal / 0.9)
    assert -run.at(0.9)["motor.flange.tau"] == close(ideal * (2 - 1 / 0.9))


@numbers
def self_locking_worm(run: Solution) -> None:
    inertia, opposing = 0.01 + 0.2 / 40**2 / 0.4, 20 / 40 / 0.4
    speed = 0.5 * (2 - opposing) / inertia
    stopped = 0.5 + speed * inertia / opposing
    assert run.events[-1].time == close(stopped)
    assert run.final["rotor.phi"] == close(0.5 * speed * stopped)
    assert run.final["rotor.w"] == 0
    assert run.final["worm.self_locking"] == 1


@numbers
def gearbox_efficiency(run: Solution) -> None:
    assert run.final["output.power"] == close(2000)
    assert run.final["input.power"] == close(2000 / 0.96)


@numbers
def differential(run: Solution) -> None:
    assert run.final["car.w"] == close(60 * 4 / 2 / 40 * 0.5)
    assert run.final["ice.w"] == close(60 * 4 / 2 / 1 * 0.5)
    assert run.energy()["engine"].source == close(0.5 * 40 * 1.5**2 + 0.5 * 1 * 60**2)


@numbers
def planetary_sets(run: Solution) -> None:
    assert [run.final[f"output[{k}].w"] for k in (1, 2, 3)] == close([25] * 3)
    assert [run.final[f"shaft[{k}].tau"] for k in (1, 2, 3)] == close([10, 10, 10 / (1 + 3 * 0.97) * 4])


@numbers
def simultaneous_events(run: Solution) -> None:
    entered = {"freewheel.mode": "locked", "slide.stop": "right", "clutch.mode": "backward"}
    at_once = {event.mode: event.after for event in run.events if event.time == close(0.5)}
    assert entered.items() <= at_once.items()
    assert -run.at(0.7)["freewheel.tau"] == close(20 + 50)
    assert run.events[-1].time == close(0.5 + 2 * 10 / 50)
    assert run.final["slide.s"] == 1
    assert run.final["slide.v"] == 0


@numbers
def torque_limiter(run: Solution) -> None:
    assert run.at(0.1)["shaft.tau"] == close(0)
    assert run.final["shaft.tau"] == close(30)
    assert run.final["slip.w_rel"] == close(-50)
    assert run.energy()["limiter"].lost == close(30 * 50 * (0.5 * 0.1 + 0.7))


@numbers
def flexible_shaft(run: Solution) -> None:
    assert run.final["twist.phi_rel"] == close(-10 / (2 * 2000))
    middle = 0.5 * (run.final["near.phi"] + run.final["far.phi"])
    assert middle == pytest.approx(0.5 * 10 / 0.5, rel=1e-4)


@numbers
def stribeck(run: Solution) -> None:
    left = {event.mode: event.time for event in reversed(run.events) if event.before == "stuck"}
    assert left == close({"bearing.mode": 0.5, "slideway.mode": 0.3})
    assert run.final["table.v"] == close((100 - 20) / 50)


@numbers
def linear_brake(run: Solution) -> None:
    friction = 2 * 0.25 * 100
    assert run.events[-1].time == close(3 * 10 / friction)
    assert run.final["slide.s"] == close(0.5 * 10 * 3**2 / friction)
    assert [run.at(0.2)[f"cut.{name}"] for name in ("v", "f", "power")] == close([2, friction, 2 * friction])
    assert run.at(0.2)["tacho.v"] == close(2)


@numbers
def shaft_sensors(run: Solution) -> None:
    read = {"angle.phi": 4, "speed.w": 4, "acceleration.a": 2, "torque.tau": 4, "turned.phi": 4 + pi / 2}
    relative = {"relative_angle.phi_rel": 6, "relative_speed.w_rel": 6, "relative_acceleration.a_rel": 3}
    assert {name: run.final[name] for name in read | relative} == close(read | relative)


@numbers
def slide_sensors(run: Solution) -> None:
    read = {"position.s": 4, "velocity.v": 4, "acceleration.a": 2, "force.f": 6, "power.power": 24}
    relative = {"relative_position.s_rel": 6, "relative_velocity.v_rel": 6, "relative_acceleration.a_rel": 3}
    assert {name: run.final[name] for name in read | relative} == close(read | relative)


@numbers
def shaft_sources(run: Solution) -> None:
    assert run.final["winder.w"] == close(sqrt(1 + 2 * 50 * 2 / 0.2))
    assert run.final["wheel.w"] == close(20 - 3 / 0.5 * 2)
    assert [run.final[name] for name in ("left.w", "right.w", "spindle.w")] == close([-8, 2, 6])
    assert run.at(0.25)["crank.flange.tau"] == close(2 * 0.5 * (2 * pi) ** 2)


@numbers
def slide_sources(run: Solution) -> None:
    assert run.final["boat.v"] == close(5 * exp(-4))
    assert run.final["train.v"] == close(sqrt(1 + 2 * 20 * 2 / 5))
    assert [run.final[name] for name in ("sledge.v", "left.v", "right.v", "block.v")] == close([4, -8, 4, 3])
    assert run.at(0.125)["shaker.flange.f"] == close(0.02 * (4 * pi) ** 2)
    assert run.final["spring.f"] == close(-50 * 0.1 * 2)


@numbers
def speed_control(run: Solution) -> None:
    assert run.at(0.5 - 1e-9)["motor.w"] == pytest.approx(200, rel=1e-4)
    assert run.final["motor.w"] == close(200)
    assert run.final["motor.ia"] == close(0.5 / 0.08)
    assert run.final["controller.y"] == close(0.4 * 0.5 / 0.08 + 0.08 * 200)


@numbers
def position_cascade(run: Solution) -> None:
    assert run.final["axis.phi"] == close(1)
    assert run.final["speed_loop.integral"] == close(2 / 5)
    assert run.final["second_axis.phi"] == pytest.approx(1, rel=1e-4)
    # The integral of the error is what holds the load.
    assert run.final["total.y"] == pytest.approx(0.5 * 2 / 20, rel=1e-4)


@numbers
def circuits(run: Solution) -> None:
    settled = 1 - exp(-(10e-3 - 1e-3) / 2e-3)
    assert run.final["scope.v"] == close(12 * settled)
    assert run.final["L2.i"] == close(12 / 60 * settled)
    assert run.final["C3.v"] == close(5e-3 * 10e-3 / 10e-6)
    assert run.final["meter.i"] == close(12 / 100 * (1 - settled) + 12 / 60 * settled)


@numbers
def clutch_lining(run: Solution) -> None:
    locked, energy = 0.12 + 0.04 + 0.4 * 150 / 60, run.energy()
    assert run.events[-1].time == close(locked)
    assert energy["lining"].stored - energy["air"].source == close(0.5 * 0.4 * 150**2)
    warm, cold = run.at(5)["lining.T"] - 293.15, run.at(15)["lining.T"] - 293.15
    assert cold / warm == close(exp(-12 * 10 / 150))


@numbers
def heating(run: Solution) -> None:
    warm = 293.15 + 50 / 2 * (1 - exp(-300 * 2 / 400))
    assert [run.final["body.T"], run.final["thermometer.T"]] == close([warm, warm])


@numbers
def table_on_slideway(run: Solution) -> None:
    assert run.final["table.v"] == close((700 - 150 - 300) / 200 * 2)
    assert run.final["scale.s"] == close(0.5 * (700 - 150 - 300) / 200 * 2**2)


@numbers
def cut_boundaries(run: Solution) -> None:
    assert run.final["mass.s"] == close(0.1 * cos(10))
    assert run.final["rotor.phi"] == close(0.2 * cos(4))
    assert run.final["capacitor.v"] == close(10 * exp(-2))
    assert run.final["body.T"] == close(300 + 100 * exp(-2))


@numbers
def duty_cycle(run: Solution) -> None:
    areas = [2 * 8 * (0.05 + 0.4 + 0.15), 6 * (0.25 + 1 + 0.25), 4 * (2 - 0.5 * (1 - exp(-4)))]
    assert [run.final[f"rotor[{k}].w"] for k in (1, 2, 3)] == close([area / 2 for area in areas])


@numbers
def two_speed_gearbox(run: Solution) -> None:
    # Pressures change by 1500 N.m/s; the old clutch lets go when it can no longer brake what the new one drives.
    released = 0.2 + (300 + 30) / 3000
    locked = 0.2 + (330 + sqrt(330**2 - 4 * 1500 * 6.15)) / 3000
    times = {(event.mode, event.before): event.time for event in run.events}
    assert times["clutch_a.mode", "stuck"] == close(released)
    assert times["clutch_b.mode", "backward"] == close(locked)
    assert run.final["machine.w"] == close(120 / 2)


@numbers
def proportional_control(run: Solution) -> None:
    assert run.at(0.1)["rotor.w"] == close((10 - 2) / 0.05 * 0.1)
    assert run.final["rotor.w"] == close(30)


@numbers
def vehicle(run: Solution) -> None:
    weight, drag, mass = 0.012 * 1200 * 9.80665, 0.5 * 0.3 * 2.2 * 1.2, 1200
    left = atan(20 * sqrt(drag / weight)) - 10 * sqrt(weight * drag) / mass
    assert run.final["car.v"] == close(sqrt(weight / drag) * tan(left))
    against = 9.80665 / sqrt(1 + 0.05**2) * (1200 * (0.05 + 0.01) + 600 * (0.05 + 0.02))
    climbing = 1 + 10 * (600 / 0.3 - against) / (1800 + 18 / 0.3**2)
    assert [run.final["tractor.v"], run.final["trailer.v"]] == close([climbing, climbing])
    assert run.final["trolley.v"] == close(3 - 10 * 0.02 * 490 / 50)


@numbers
def h_bridge(run: Solution) -> None:
    settled, on, off, half = 24 / 2, exp(-0.0075 / 0.025), exp(-0.0025 / 0.025), exp(-0.005 / 0.025)
    assert run.at(0.4975)["L_1.i"] == close(settled * (1 - 2 * on + on * off) / (1 - on * off))
    assert run.at(0.495)["L_2.i"] == close(settled * (1 - half) / (1 - half**2))
    assert run.final["L_3.i"] == close(12 / (2 + 0.4))
    assert run.at(0.05)["capacitor.v"] == close(10 - 0.1 * 0.05 / 1e-3)
    assert [run.final["capacitor.v"], run.final["load.i"]] == pytest.approx([0, 0], abs=1e-7)


@numbers
def cascade_control(run: Solution) -> None:
    """All loops are linear as long as no limit is met: the step response is a matrix exponential."""
    Ra, La, k_phi, J, T, target, load = 0.05, 1.5e-3, 0.6366, 0.3, 0.5e-3, 4e-3, 20.0
    k_speed, k_current = J / (4 * T) / k_phi, La / (2 * T)
    # each row: weights of angle, speed, current, voltage, both integrals, and of target and load
    speed_error = np.array([-1 / (32 * T), -1, 0, 0, 0, 0, 1 / (32 * T), 0])
    current_error = k_speed * (speed_error + np.eye(8)[4]) - np.eye(8)[2]
    voltage = k_current * (current_error + np.eye(8)[5])
    rows = [
        np.eye(8)[1], (k_phi * np.eye(8)[2] - np.eye(8)[7]) / J,
        (np.eye(8)[3] - Ra * np.eye(8)[2] - k_phi * np.eye(8)[1]) / La, (voltage - np.eye(8)[3]) / T,
        speed_error / (8 * T), current_error * Ra / La, np.zeros(8), np.zeros(8),
    ]  # fmt: skip
    start = target * np.eye(8)[6]
    names = ("machine.phi", "machine.w", "motor.ia", "bridge.v", "speed_loop.integral", "current_loop.integral")
    for t in (0.002, 0.01, 0.05):
        assert [run.at(t)[name] for name in names] == pytest.approx(
            list((expm(np.array(rows) * t) @ start)[:6]), rel=1e-5
        )
    loaded = expm(np.array(rows) * 0.5) @ start + load * np.eye(8)[7]
    after = expm(np.array(rows) * 0.02) @ loaded
    assert [run.at(0.52)[name] for name in names] == pytest.approx(list(after[:6]), rel=1e-5, abs=1e-9)
    assert [run.final["machine.phi"], run.final["motor.ia"]] == close([target, load / k_phi])


@numbers
def move(run: Solution) -> None:
    arrived = {event.mode: event.time for event in run.events if event.after == "arrived"}
    assert arrived == close({"turn.stage": 2 / 2 + 2 / 5, "way.stage": 0.1 + 2 * sqrt(0.2 / 5)})
    assert [run.final[name] for name in ("disc.phi", "disc.w", "table.s")] == close([3, 0, -0.2])
    assert -run.at(0.2)["crank.flange.tau"] == pytest.approx(2 * 5, rel=1e-5)
    assert run.final["rotor.phi"] == close(0.3 * cos(4) + 0.5 * sin(4))
    assert run.final["mass.s"] == pytest.approx(0.01 * cos(20), rel=1e-5)
    assert [run.final["twist.phi_rel"], run.final["gap.s_rel"]] == close([0.1 * cos(6)] * 2)


@numbers
def rack_drive(run: Solution) -> None:
    def motion(x: float) -> float:
        """Time from rest to the speed x·v_nominal: 15·x' = (30 - 100·x/(1 + x²))/2·5."""
        return quad(lambda u: 3 * 2 / (30 - 100 * u / (1 + u**2)), 0, x)[0]

    assert motion(run.at(0.5)["slide.v"] / 3) == close(0.5)
    assert [run.final["carriage.v"], run.final["sledge.v"]] == close([2 / 0.1 / 2 * 2, -2 / 0.1 / 4 * 2])


@numbers
def universal_joint(run: Solution) -> None:
    start, quarter = run.at(0), run.at(pi / 20)
    assert [start["shaft.w"], quarter["shaft.w"]] == close([10 / cos(pi / 6), 10 * cos(pi / 6)])
    assert run["machine.w"] == close(10)
    assert [quarter[f"first.flange_{end}.tau"] for end in "ab"] == close([5, -5 / cos(pi / 6)])


@numbers
def torque_converter(run: Solution) -> None:
    assert [run.final[f"converter.flange_{end}.tau"] for end in "ab"] == close([2e-3 * 200**2, -2 * 2e-3 * 200**2])
    assert run.at(1)["flywheel.w"] == close(100 * (1 - exp(-2e-3 * 100 / 0.5)))


@numbers
def bristle_friction(run: Solution) -> None:
    assert run.final["bearing.tau"] == close(1 + 0.5 * exp(-1) + 2 * 0.02)
    # Loaded slowly, the bristles follow dz/dphi = 1 - z/z_sliding.
    assert [run.final["seal.z"], run.final["rotor.phi"]] == pytest.approx([0.8e-4, -1e-4 * log(1 - 0.8)], rel=1e-4)


@numbers
def waves(run: Solution) -> None:
    growth, heated = log(8) / 2, 1 - exp(-2.5)
    torques = [
        2 * sin(1.2 * pi) / (0.6 * pi),
        quad(lambda t: 2 * exp(-1.5 * t) * sin(4 * pi * t), 0, 1.5)[0],
        2 * float(sici(8 * pi)[0]) / (4 * pi),
        2 * (1 - 0.4 * heated + 0.3 * heated * (1 - exp(-0.75 / 0.3))),
        2 * (4 * 0.2 + 0.2 * 0.25),
        quad(lambda t: 2 * sin(pi * (exp(growth * t) - 1) / growth), 0, 2)[0],
        1 * 0.5 + 3 * 0.75 - 2 * 0.75,
    ]
    assert [2 * run.final[f"rotor[{k}].w"] for k in range(1, 8)] == close(torques)
    assert [2 * run.final[f"wheel[{k}].w"] for k in range(1, 6)] == close([0.5, 4 * 0.1, 0.25 + 1.25, 2, 1 + 2])


@numbers
def hall_sensor(run: Solution) -> None:
    """3950/60·t² magnets have come while the speed grows; whole pulses of every half second are shown after it."""
    passed = [int(3950 / 60 * moment**2) for moment in (0, 0.5, 1, 1.5, 2)]
    shown = [2 * pi * (passed[k + 1] - passed[k]) / (4 * 0.5) for k in range(4)]
    assert [run.at(moment)["meter.y"] for moment in (0.3, 0.7, 1.3, 1.8, 2.1)] == close([0, *shown])


@numbers
def commutation(run: Solution) -> None:
    half, voltage = pi / 4, 0.0467 * 4000 * pi / 30
    square = (half / sin(half)) ** 2 * (0.5 + sin(2 * half) / (4 * half))
    assert run.energy()["motor"].source == close(voltage**2 / 8 * square * 0.06)
    induced = run["generator.v_induced"]
    assert [np.max(induced), np.min(induced)] == close([voltage * half / sin(half), voltage * half / tan(half)])
