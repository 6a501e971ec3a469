"""Closed forms of examples/components with controls, batteries, engines, vehicles and electrical machines."""

from math import asin, cos, exp, log, pi, sin, sqrt

import closed_forms
import numpy as np
import pytest
from closed_forms import close
from scipy.integrate import quad

from modelica_like.runs.solution import Solution

numbers = closed_forms.numbers("components")


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
    assert run.at(3.0)["wheel[1].w"] == close(2 * 0.5 * sum(numbers[:6]))
    pairs = zip(numbers[1::2], [*numbers[2::2], 48271 * state % (2**31 - 1) / (2**31 - 1)], strict=True)
    assert run.at(3.0)["wheel[2].w"] == close(0.5 * sum(2 * sqrt(-2 * log(u)) * cos(2 * pi * v) for u, v in pairs))


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
