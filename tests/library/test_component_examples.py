"""The small netlists of examples/components: each runs, keeps its energy, and gives the numbers of its closed forms."""

from collections.abc import Callable
from functools import lru_cache
from math import asin, atan, cos, exp, log, pi, sin, sqrt, tan, tanh
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.special import sici

from modelica_like import simulate
from modelica_like.solve.solution import Solution

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples" / "components"
PAGE = ROOT / "docs" / "examples" / "components.md"
NUMBERS: dict[str, Callable[[Solution], None]] = {}


def numbers(check: Callable[[Solution], None]) -> Callable[[Solution], None]:
    NUMBERS[check.__name__] = check
    return check


@lru_cache
def run_of(name: str) -> Solution:
    return simulate(FOLDER / f"{name}.toml", rtol=1e-9)


def close(value: object) -> object:
    return pytest.approx(value, rel=1e-6, abs=1e-9)


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


@numbers
def limited_control(run: Solution) -> None:
    assert run.at(0.2)["ramp.y"] == close(50 * 0.2)
    assert run.at(0.39)["rotor.w"] - run.at(0.3)["rotor.w"] == close(0.09 * (4 - 2) / 0.1)
    assert run.at(0.42)["rotor.w"] - run.at(0.4)["rotor.w"] == close(0.02 * (10 - 2) / 0.1)
    assert [run.final["rotor.w"], run.final["allowed.y"]] == close([20, 2])


@numbers
def filters(run: Solution) -> None:
    def delayed(t: float) -> float:
        return 3 * (1 - exp(-t / 0.3) * (1 + t / 0.3))

    def oscillating(t: float) -> float:
        w = 10 * sqrt(1 - 0.2**2)
        return 3 * (1 - exp(-2 * t) * (cos(w * t) + 2 / w * sin(w * t)))

    begin = asin(0.5) / (pi / 2)
    beyond = quad(lambda t: 2 * sin(pi / 2 * t) - 1, begin, 2 - begin)[0]
    assert [2 * run.final[f"rotor[{k}].w"] for k in (1, 2, 3, 4)] == close(
        [quad(delayed, 0, 4)[0], quad(oscillating, 0, 4)[0], 0.5 * 8, 0]
    )
    assert 2 * run.at(2)["rotor[4].w"] == close(beyond)
    # 3·8/((s + 2)·(s + 4)) is 3·(1 - 2·exp(-2 t) + exp(-4 t)) after a step.
    assert 2 * run.final["rotor[5].w"] == close(3 * (4 - (1 - exp(-8)) + (1 - exp(-16)) / 4))
    assert run.at(1)["rate.y"] == close(0.5 * 4 * (1 - exp(-10)))


@numbers
def sampled_control(run: Solution) -> None:
    assert [run.at(0.1 * n + 1e-6)["rotor.w"] for n in (1, 2, 5)] == pytest.approx(
        [40 * (1 - 0.5**n) for n in (1, 2, 5)], abs=3e-4
    )
    assert [run.final[name] for name in ("rotor.w", "fast.y")] == close([40, 1])
    assert run.final["encoder.y"] == 0.25 * round(run.final["rotor.phi"] / 0.25)
    # 20 rad in half a second are 12.7 pulses of a quarter of a turn.
    assert round(run.final["meter.y"] / pi, 9) in (12, 13)
    numbers, state = [], 42
    for _ in range(12):
        state = 48271 * state % (2**31 - 1)
        numbers.append(state / (2**31 - 1))
    assert run.final["wheel[1].w"] == close(2 * 0.5 * sum(numbers[:6]))
    pairs = zip(numbers[1::2], [*numbers[2::2], 48271 * state % (2**31 - 1) / (2**31 - 1)], strict=True)
    assert run.final["wheel[2].w"] == close(0.5 * sum(2 * sqrt(-2 * log(u)) * cos(2 * pi * v) for u, v in pairs))


@numbers
def battery(run: Solution) -> None:
    assert [run.final["battery.soc"], run.final["battery.v_cell"]] == close([0.75, 3.85])
    assert run.final["meter.power"] == close(10 * (3.85 - 2 * (0.02 + 0.01)) * 4)
    # After 45 time constants of the RC element, nearly all loss is (R_i + R_1)·i² in 20 cells.
    warm = 298.15 + (5 + 20 * 0.03 * 4) / 2
    assert run.final["cells.T"] == pytest.approx(warm + (298.15 - warm) * exp(-900 / 400), abs=0.05)


@numbers
def servo(run: Solution) -> None:
    assert run.at(0.01)["table.w"] - run.at(0.006)["table.w"] == pytest.approx(0.004 * 0.5 * 30 / 3e-3, rel=0.01)
    assert [run.final["table.phi"], run.final["spindle.motor.w"]] == close([3, 100])
    assert run.final["spindle.motor.ia"] == close(6 / 0.5)
    assert run.final["spindle.inverter.v"] == close(0.8 * 12 + 0.5 * 100)


@numbers
def engine(run: Solution) -> None:
    # One turn of the idling engine has no net torque; its firing orders make the speed swing around the idle speed.
    idle = [run.at(t)["engine.w"] for t in np.linspace(4.9, 4.9 + 2 * pi / 80, 200)]
    assert np.mean(idle) == pytest.approx(80, rel=1e-3)
    assert run.at(4.999)["engine.throttle"] == pytest.approx(12 / 120, rel=0.02)
    cut = [event.time for event in run.events if event.after == "cut"]
    # 100 % of 120 N·m against 12 N·m; it falls by 20 rad/s with 60 rad/s² and rises again with 540 rad/s².
    assert np.mean(np.diff(cut)) == pytest.approx(20 / 60 + 20 / 540, rel=0.01)
    assert np.max(run["engine.w"]) <= 300 * (1 + 1e-9)


@numbers
def traction(run: Solution) -> None:
    a = 0.9 * 9.80665 * 1.2 / (2.6 - 0.9 * 0.6)
    assert run.at(1.9)["car.v"] - run.at(1)["car.v"] == close(0.9 * a)
    assert run.at(1.9)["axles.F_rear"] == close(1200 * a / 0.9)
    assert run.at(1.9)["wheels.w"] - run.at(1)["wheels.w"] == close(0.9 * (2500 - 0.3 * 1200 * a) / 2)
    assert run.final["tyre.slip"] == pytest.approx(0, abs=1e-6)
    momentum = 2 * 2500 / 0.3
    assert 1200 * run.final["car.v"] + 2 / 0.3 * run.final["wheels.w"] == close(momentum)


@numbers
def driving_cycle(run: Solution) -> None:
    assert run.at(33)["car.v"] == pytest.approx(15, rel=1e-4)
    assert run.at(33)["engine.y"] == pytest.approx(120 + 2 * 15 + 0.4 * 15**2, rel=1e-3)
    assert np.max(np.abs(run["driver.v_ref"] - run["car.v"])) < 0.4
    assert np.max(run["driver.brake"]) == pytest.approx(1200 * 15 / 8 / 8000, rel=0.1)


@numbers
def asynchronous_machines(run: Solution) -> None:
    w_s = 2 * pi * 50 / 2
    # Torque over slip is nearly a straight line there: 20 N·m = 2·tau_k·s·s_k/(s² + s_k²).
    slip = 0.2 * (200 - sqrt(200**2 - 20**2)) / 20
    assert run.final["fan.w"] == pytest.approx(w_s * (1 - slip), rel=1e-6)
    impedance = (0.4 + 2j * pi * 50 * 2e-3, 2j * pi * 50 * 0.06, 2j * pi * 50 * 3e-3)

    def torque(s: float) -> float:
        rotor = impedance[2] + 0.3 / s
        both = rotor * impedance[1] / (rotor + impedance[1])
        return 1.5 * abs(320 / (impedance[0] + both) * both / rotor) ** 2 * 0.3 / s / w_s

    assert torque(1 - run.final["pump.w"] / w_s) == pytest.approx(20, rel=1e-4)


@numbers
def electric_drives(run: Solution) -> None:
    assert run.final["axle.w"] == close(200 + 200 / 0.5 * (2 - 0.02 * (1 - exp(-2 / 0.02))))
    assert -run.final["axle.w"] * 200 / 0.94 + run.final["pack.v"] * run.final["motor.i_dc"] == pytest.approx(
        0, abs=1e-3
    )
    # Short-circuited at 100 rad/s: currents by Ohm's law, and a braking torque.
    i_d, i_q = np.linalg.solve([[0.05, -400 * 3e-4], [400 * 3e-4, 0.05]], [0.0, -400 * 0.08])
    assert [run.final["shorted.i_d"], run.final["shorted.i_q"]] == close([i_d, i_q])
    assert run.final["spindle.w"] == pytest.approx(1200, rel=1e-6)
    assert run.final["servo.i_d"] < -50


def test_every_netlist_has_numbers_and_a_line_on_the_page() -> None:
    names = {path.stem for path in FOLDER.glob("*.toml")}
    assert names == NUMBERS.keys()
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in sorted(names) if f"../../examples/components/{name}.toml" not in text] == []


@pytest.mark.parametrize("name", NUMBERS)
def test_closed_form(name: str) -> None:
    NUMBERS[name](run_of(name))


@pytest.mark.parametrize("name", NUMBERS)
def test_energy_closes(name: str) -> None:
    energy = run_of(name).energy()
    assert energy.throughput > 0
    assert energy.closure < 1e-8
