"""Document 002: the bench of DC motor, electromagnetic clutch, flywheel and generator.

Expected are the numbers of the project's TARGETS, the closed forms of a rigid drive, and an independent run of the laws
of motion written out by hand. The clutch torque rises as 1 - exp(-t/tau) with 90 % after t12; with the linear rise of
the actuator lock-up and 98 % of the voltage come 1 ms later. Both are run here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import log, log10, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from modelica_like import CompiledDae, Solution, build, load, simulate
from modelica_like.runs.trajectories import Values
from modelica_like.show.report.run import notices

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLIST, MOTOR = EXAMPLES / "dc_bench.toml", EXAMPLES / "dc_bench_motor.toml"
RPM = 30 / pi
U, RATIO, CAPACITY, PULLEY, DISC = 24.0, 3.0, 0.6, 3e-5, 1182.6e-6
T11, T12 = 5e-3, 15e-3
TAU = T12 / log(10)
CALIBRATED = 5.4e-5
N0, SLOPE, I0 = 4736.5, 3480.0, 1.06  # 1/min, 1/(min.N.m), A: the measured line and current

# Set A: the machine that has this line and this current exactly.
_drop = SLOPE / RPM * I0
K = (sqrt((N0 / RPM) ** 2 + 4 * _drop * U) - N0 / RPM) / (2 * _drop)
R, FRICTION = SLOPE / RPM * K**2, K * I0


# -- the laws of motion, written out -----------------------------------------------------------------------------------


def linear(t: float) -> float:
    return min(max((t - T11) / T12, 0.0), 1.0)


def exponential(t: float) -> float:
    return 1 - np.exp(-max(t - T11, 0.0) / TAU)


RISES: dict[str, Callable[[float], float]] = {"linear": linear, "exponential": exponential}


@dataclass(frozen=True)
class Expected:
    """Lock-up and what follows; w is the speed of the clutch shaft."""

    lock: float
    slip_energy: float
    w_lock: float
    w_end: float
    decay: float

    def reaches(self, part: float) -> float:
        """Return when the generator has this part of its final voltage, after the lock-up."""
        return self.lock + self.decay * log((1 - self.w_lock / self.w_end) / (1 - part))


@cache
def expected(rise: str, rotor: float = CALIBRATED, capacity: float = CAPACITY, disc: float = DISC) -> Expected:
    """Integrate motor shaft and flywheel, both at the clutch, until they turn alike."""
    driving = PULLEY + RATIO**2 * rotor
    driven = driving + disc
    drag = RATIO * FRICTION

    def torque(t: float) -> float:
        return capacity * RISES[rise](t)

    def rates(t: float, y: Any) -> list[float]:
        current = (U - K * RATIO * y[0]) / R
        moves = max(torque(t) - drag, 0.0)
        return [(RATIO * K * current - drag - torque(t)) / driving, moves / driven, torque(t) * (y[0] - y[1])]

    def slip(t: float, y: Any) -> float:
        return y[0] - y[1]

    slip.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    moved = brentq(lambda t: torque(t) - drag, T11, T11 + T12)
    t, y = 0.0, np.array([N0 / RPM / RATIO, 0.0, 0.0])
    for end in (T11, moved, T11 + T12, 2.0):
        piece = solve_ivp(rates, (t, end), y, "DOP853", rtol=1e-11, atol=1e-12, events=slip)
        t, y = piece.t[-1], piece.y[:, -1]
    w_end = (N0 - SLOPE * FRICTION) / RPM / RATIO
    return Expected(t, y[2], y[0], w_end, (driving + driven) * R / (RATIO * K) ** 2)


# -- the netlist -------------------------------------------------------------------------------------------------------


@cache
def bench(rise: str) -> CompiledDae:
    drive = load(NETLIST)
    drive.set("coil.exponential", rise == "exponential")
    return build(drive)


@cache
def switch_on(rise: str) -> Solution:
    return simulate(bench(rise), points=20_000)


def locks(run: Solution) -> float:
    return next(event.time for event in run.events if event.mode == "clutch.mode" and event.after == "stuck")


def reaches(run: Solution, part: float) -> float:
    voltage = run["generator.v"]
    return float(np.interp(part * voltage[-1], voltage, run.time))


def delivers(run: Solution, path: str) -> float:
    """Largest value."""
    return float(run[path].max())


BOTH = pytest.mark.parametrize("rise", RISES)


def test_no_load() -> None:
    """All printed digits."""
    before = switch_on("exponential").at(0.0)
    assert before["motor.w"] * RPM == pytest.approx(N0, abs=5e-5)
    assert before["motor.ia"] == pytest.approx(I0, abs=5e-7)


@BOTH
def test_switch_on_is_the_motion_written_out(rise: str) -> None:
    run, reference = switch_on(rise), expected(rise)
    assert locks(run) == pytest.approx(reference.lock, rel=1e-6)
    assert run.energy()["clutch"].lost == pytest.approx(reference.slip_energy, rel=2e-6)
    assert reaches(run, 0.98) == pytest.approx(reference.reaches(0.98), rel=3e-5)
    assert run.final["flywheel.w"] == pytest.approx(reference.w_end, rel=1e-6)
    assert run.energy().power_closure < 1e-8


def test_switch_on_with_exponential_rise() -> None:
    """TARGETS: 0.544 s, 0.700 s, 22.90 J, to the last digit but for 0.7 ms and 0.1 %.

    The motion written out agrees with the netlist: 98 % at 0.7006 s, 22.92 J.
    """
    run = switch_on("exponential")
    assert locks(run) == pytest.approx(0.544, abs=5e-4)
    assert reaches(run, 0.95) == pytest.approx(0.618, abs=1e-3)
    assert reaches(run, 0.98) == pytest.approx(0.700, abs=1e-3)
    assert reaches(run, 0.99) == pytest.approx(0.760, abs=3e-3)
    assert run.energy()["clutch"].lost == pytest.approx(22.90, rel=1e-3)


def test_switch_on_with_linear_rise() -> None:
    """The generator starts when the clutch carries x = 3·M_f of 0.6 N.m; the linear rise costs (1 + x)/2·t12 = 9.36 ms.

    The exponential rise costs (1 - ln(1 - x))·tau = 8.37 ms: the lock-up comes 1.0 ms later.
    """
    run = switch_on("linear")
    assert locks(run) == pytest.approx(0.5449, abs=5e-5)
    assert locks(run) - locks(switch_on("exponential")) == pytest.approx(1.0e-3, abs=5e-5)
    assert reaches(run, 0.98) == pytest.approx(0.700, abs=2e-3)
    assert run.energy()["clutch"].lost == pytest.approx(22.90, rel=1e-3)


@BOTH
def test_currents_and_energies(rise: str) -> None:
    """Printed digits, but for the dip of the speed: 4040.5 on the measured line, 4040.6 in TARGETS (see below)."""
    run = switch_on(rise)
    assert delivers(run, "motor.ia") == pytest.approx(5.344, abs=5e-4)
    assert run["motor.w"].min() * RPM == pytest.approx(N0 - SLOPE * CAPACITY / RATIO, abs=1e-3)
    assert run["motor.w"].min() * RPM == pytest.approx(4040.6, abs=0.15)
    kinetic = sum(0.5 * J * run.final[w] ** 2 for J, w in ((PULLEY + DISC, "flywheel.w"), (CALIBRATED, "generator.w")))
    assert kinetic == pytest.approx(21.56, abs=5e-3)
    lock = locks(run)
    assert -run.at(lock - 1e-6)["clutch.tau"] == pytest.approx(0.6, abs=5e-4)
    assert -run.at(lock + 1e-6)["clutch.tau"] == pytest.approx(0.495, abs=5e-4)


@BOTH
def test_end(rise: str) -> None:
    """TARGETS has 4564.37/min; the line it starts from gives 4736.5 - 3.48·49.490 = 4564.27."""
    final = switch_on(rise).final
    assert final["motor.w"] * RPM == pytest.approx(N0 - SLOPE * FRICTION, abs=1e-3)
    assert final["motor.w"] * RPM == pytest.approx(4564.37, abs=0.11)
    assert final["motor.ia"] == pytest.approx(2.120, abs=5e-4)
    assert final["generator.v"] == pytest.approx(22.316, abs=5e-4)
    assert final["clutch.w_rel"] == pytest.approx(0.0, abs=1e-12)


def test_end_with_a_constant_cut_to_five_digits() -> None:
    """k = 0.046688 instead of 0.0466889 explains the 0.1/min: speed at the end and in the dip."""
    run = simulate(bench("exponential"), parameters={"k": 0.046688, "R": 0.79439, "friction": 0.04949})
    assert run.final["motor.w"] * RPM == pytest.approx(4564.37, abs=0.015)
    assert run["motor.w"].min() * RPM == pytest.approx(4040.6, abs=0.05)


SWEEP = [
    (0.0, 0.3924, 0.480), (2e-5, 0.4484, 0.560), (4e-5, 0.5046, 0.642), (6e-5, 0.5608, 0.723),
    (8e-5, 0.6170, 0.806), (10e-5, 0.6733, 0.887),
]  # fmt: skip


@pytest.mark.parametrize(("rotor", "lock", "almost"), SWEEP)
def test_other_rotors(rotor: float, lock: float, almost: float) -> None:
    """TARGETS within 0.3 ms and, for 98 %, 2.5 ms, always early; the motion written out within 3e-5."""
    run = simulate(bench("exponential"), parameters={"rotor": rotor}, points=10_000)
    reference = expected("exponential", rotor)
    assert locks(run) == pytest.approx(lock, abs=3e-4)
    assert reaches(run, 0.98) == pytest.approx(almost, abs=2.5e-3)
    assert locks(run) == pytest.approx(reference.lock, rel=1e-5)
    assert reaches(run, 0.98) == pytest.approx(reference.reaches(0.98), rel=3e-5)


@pytest.mark.parametrize(("capacity", "disc", "lock"), [(0.5, DISC, 0.700), (0.7, DISC, 0.426), (0.6, 0.0, 0.163)])
def test_other_clutches_and_no_flywheel(capacity: float, disc: float, lock: float) -> None:
    values = {"rotor": 5e-5, "capacity": capacity, "disc": disc}
    run = simulate(bench("exponential"), parameters=values)
    assert locks(run) == pytest.approx(lock, abs=6e-4)
    assert locks(run) == pytest.approx(expected("exponential", **values).lock, rel=1e-5)


def test_rated_speed_at_a_lower_voltage() -> None:
    """The document has its 4000/min at 21.5 V."""
    final = simulate(bench("exponential"), "5 s", parameters={"supply": 21.5}).final
    assert final["motor.w"] * RPM == pytest.approx(4053, abs=0.5)
    assert final["motor.w"] * RPM == pytest.approx((21.5 - 2 * R * I0) / K * RPM, rel=1e-6)


@pytest.mark.parametrize("current", [0.0, 1.0, 2.0, 3.0])
def test_operating_points(current: float) -> None:
    """Closed forms: the motor drives the generator's friction and its current, M = M_f + k·I_G, the clutch 3·M."""
    values = {"overload": current, "overload_start": 1.0, "overload_time": 1.0, "k": K, "R": R, "friction": FRICTION}
    final = simulate(bench("exponential"), "6 s", parameters=values).final
    torque = FRICTION + K * current
    w = (N0 - SLOPE * torque) / RPM
    assert final["motor.w"] == pytest.approx(w, rel=1e-6)
    assert final["motor.ia"] == pytest.approx(I0 + torque / K, rel=1e-6)
    assert -final["clutch.tau"] == pytest.approx(RATIO * torque, rel=1e-6)
    assert final["generator.v"] == pytest.approx(K * w - R * current, rel=1e-6)
    assert final["generator.w"] == pytest.approx(w, rel=1e-6)


def test_overload_makes_the_locked_clutch_slip() -> None:
    """The slow ramp of 4 mA/s leaves 0.3 mA: falling speed gives inertia torque, which relieves the clutch."""
    run = simulate(bench("exponential"), "1002 s", parameters={"overload": 4.0})
    slip = next(event.time for event in run.events if event.mode == "clutch.mode" and event.before == "stuck")
    at = run.at(slip)
    assert at["sink.i"] == pytest.approx(3.224, abs=5e-4)
    assert at["sink.i"] == pytest.approx((CAPACITY / RATIO - FRICTION) / K + 0.28e-3, abs=5e-5)
    assert at["motor.w"] * RPM == pytest.approx(4040.6, abs=0.15)
    assert at["motor.ia"] == pytest.approx(5.344, abs=5e-4)
    assert run.final["clutch.w_rel"] < -100.0


def test_direct_switch_on() -> None:
    """Without inductance all of the voltage lies across the resistance: I = U/R."""
    run = simulate(bench("exponential"), "1 s", parameters={"motor_start": 0, "switch_on": 10.0})
    start = run.at(0.0)
    assert start["motor.ia"] == pytest.approx(30.21, abs=5e-3)
    assert delivers(run, "motor.ia") == pytest.approx(start["motor.ia"])
    assert start["motor.tau_electrical"] - FRICTION == pytest.approx(1.361, abs=5e-4)
    assert run.final["motor.w"] * RPM == pytest.approx(N0, abs=0.01)


def test_release() -> None:
    """Closed form: the torque falls by ten in t2 = 6 ms; the clutch slips when it can no longer carry the drag 3·M_f.

    From there the drag brings the flywheel to rest, but for the impulse that the clutch still gives it, drag·t2/ln 10.
    """
    release, t2, drag = 5.0, 6e-3, RATIO * FRICTION
    run = simulate(bench("exponential"), "8 s", parameters={"on_time": release})
    slips = next(event.time for event in run.events if event.mode == "clutch.mode" and event.before == "stuck")
    assert slips == pytest.approx(release + t2 * log10(CAPACITY / drag), abs=1e-7)
    assert run.at(release + t2)["coil.y"] == pytest.approx(0.1, rel=1e-9)
    rests = next(event.time for event in run.events if event.after == "stuck" and event.time > slips)
    driven, w_end = PULLEY + DISC + RATIO**2 * CALIBRATED, (N0 - SLOPE * FRICTION) / RPM / RATIO
    assert rests == pytest.approx(slips + driven * w_end / drag + t2 / log(10), rel=1e-6)
    assert run.final["motor.w"] * RPM == pytest.approx(N0, abs=1e-3)
    assert run.final["generator.v"] == pytest.approx(0.0, abs=1e-9)


def test_clutch_turns_faster_than_it_may() -> None:
    """At 24 V the clutch has 1521/min, without load 1579/min; its data sheet permits 1500/min."""
    run = switch_on("exponential")
    assert run.at(0.0)["clutch_pulley.w"] * RPM == pytest.approx(N0 / RATIO, abs=1e-4)
    assert run.final["clutch_pulley.w"] * RPM == pytest.approx((N0 - SLOPE * FRICTION) / RATIO, abs=1e-3)
    assert notices(run) == ["At 0 s clutch_speed exceeds 157.08 rad/s: the data sheet of the clutch permits no more."]


# -- chapter 6.1: the motor alone --------------------------------------------------------------------------------------


@cache
def motor() -> CompiledDae:
    return build(MOTOR)


def loaded(torque: float, **values: float) -> Values:
    """Return the steady state under a load in N.m."""
    return simulate(motor(), "1 s", points=1, parameters={"first_load": torque, "last_load": torque, **values}).at(0.0)


SET_C = {"k": 0.04768, "R": 0.7291, "friction": 0.04457}


@pytest.mark.parametrize("values", [{}, SET_C], ids=["set A", "set C"])
def test_curves_of_the_motor(values: dict[str, float]) -> None:
    """Closed forms: I = (M + M_f)/k, n = (U - R·I)/k, eta = M·w/(U·I)."""
    k, resistance, friction = values.values() if values else (K, R, FRICTION)
    run = simulate(motor(), parameters=values)
    torque = run["shaft.tau"]
    assert torque[0] == pytest.approx(0.0, abs=1e-9)
    assert torque[-1] == pytest.approx(0.25, rel=1e-6)
    current = (torque + friction) / k
    w = (U - resistance * current) / k
    np.testing.assert_allclose(run["motor.ia"], current, rtol=1e-6)
    np.testing.assert_allclose(run["motor.w"], w, rtol=1e-6)
    power = run["battery.source_power"]
    np.testing.assert_allclose(run["shaft.power"] / power, torque * w / (U * current), rtol=1e-6, atol=1e-9)


# Torque in N.m; speed in 1/min and current in A on the printed lines: the document's eight weights and its rated point.
POINTS = [
    (0.0133, 4690, 1.326), (0.0255, 4648, 1.570), (0.0349, 4615, 1.758), (0.0484, 4568, 2.028), (0.0559, 4542, 2.178),
    (0.0647, 4511, 2.354), (0.0842, 4443, 2.744), (0.0986, 4393, 3.032), (0.21, 4005.7, 5.26),
]  # fmt: skip


@pytest.mark.parametrize(("torque", "speed", "current"), POINTS)
def test_loads_of_the_document(torque: float, speed: float, current: float) -> None:
    """Set A has the speeds of one printed line, and the currents of the other within 6 %: the two contradict."""
    at = loaded(torque, k=K, R=R, friction=FRICTION)
    assert at["motor.w"] * RPM == pytest.approx(speed, abs=0.6)
    assert at["motor.w"] * RPM == pytest.approx(N0 - SLOPE * torque, rel=1e-9)
    assert at["motor.ia"] == pytest.approx(I0 + torque / K, rel=1e-9)
    assert at["motor.ia"] == pytest.approx(current, rel=0.058)


def test_set_a_at_the_rated_torque() -> None:
    """The document has 5.2 A and 71 %: the speed of one line with the current of the other."""
    at = loaded(0.21)
    assert at["motor.w"] * RPM == pytest.approx(4005.7, abs=0.05)
    assert at["motor.ia"] == pytest.approx(5.558, abs=5e-4)
    assert at["shaft.power"] / at["battery.source_power"] == pytest.approx(0.660, abs=5e-4)


def test_set_c_is_near_both_lines() -> None:
    """The largest errors of TARGETS between 0 and 0.25 N.m: 66/min and 0.125 A; eta at the rated torque."""
    run = simulate(motor(), parameters=SET_C)
    torque = run["shaft.tau"]
    assert abs(run["motor.w"] * RPM - (N0 - SLOPE * torque)).max() == pytest.approx(66, abs=1.0)
    assert abs(run["motor.ia"] - (I0 + 20.0 * torque)).max() == pytest.approx(0.125, abs=1e-3)
    at = loaded(0.21, **SET_C)
    assert at["shaft.power"] / at["battery.source_power"] == pytest.approx(0.691, abs=5e-4)
