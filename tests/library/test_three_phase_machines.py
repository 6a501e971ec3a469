"""Asynchronous and synchronous machines, against closed forms, phasors and an independent solver."""

from math import log, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    AsynchronousMachine,
    AsynchronousMachineDQ,
    Battery,
    ConstantSpeed,
    ConstantVoltage,
    Fixed,
    Ground,
    Inertia,
    MappedDrive,
    PMSynchronousDrive,
    PMSynchronousMachine,
)
from modelica_like import Assembly, Component, ModelicaLikeError, Solution, sensitivities, simulate

TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-10}


def turned(machine: Component, load: Component, until: float) -> Solution:
    end = "flange_a" if isinstance(load, Inertia) else "flange"
    parts = {"m": machine, "load": load}
    return simulate(Assembly("d", parts=parts, connect={"s": ["m.flange", f"load.{end}"]}), until, **TIGHT)


def speed(w: float) -> ConstantSpeed:
    return ConstantSpeed(w_fixed=w)


# -- asynchronous ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slip", [1.0, 0.2, 0.05, 0.0, -0.1])
def test_the_formula_of_kloss(slip: float) -> None:
    w_s = 2 * pi * 50 / 2
    machine = AsynchronousMachine(tau_k=200.0, s_k=0.2, Jr=0.1, v_rel=1 / sqrt(3))
    run = turned(machine, speed(w_s * (1 - slip)), 0.1)
    wanted = 2 * 200 / 3 / (slip / 0.2 + 0.2 / slip) if slip else 0.0
    assert run.final["m.tau"] == pytest.approx(wanted, rel=1e-9, abs=1e-9)
    assert run.final["m.loss_power"] == pytest.approx(wanted * slip * w_s, rel=1e-9, abs=1e-9)
    assert run.energy().power_closure < 1e-8


def test_the_time_of_a_start() -> None:
    """J·w_s/(2·tau_k)·((1 - s²)/(2·s_k) + s_k·ln(1/s)) from standstill to the slip s; as much heat as motion."""
    J, w_s = 0.6, 2 * pi * 50 / 2
    machine = AsynchronousMachine(tau_k=200.0, s_k=0.2, Jr=0.2)
    needed = J * w_s / 400 * ((1 - 0.05**2) / 0.4 + 0.2 * log(20))
    run = turned(machine, Inertia(J=0.4, phi=0.0, w=0.0), needed)
    assert run.final["load.w"] == pytest.approx(0.95 * w_s, rel=1e-7)
    assert run.energy()["m"].lost == pytest.approx(J * w_s**2 * (1 - 0.05**2) / 2, rel=1e-6)


def test_a_lower_frequency() -> None:
    """At 25 Hz the machine has its breakdown torque at the same difference of speeds, 0.2·157 rad/s below 78.5."""
    machine = AsynchronousMachine(tau_k=200.0, s_k=0.2, Jr=0.1, f="25 Hz")
    assert turned(machine, speed(2 * pi * 25 / 2 - 0.2 * 2 * pi * 50 / 2), 0.1).final["m.tau"] == pytest.approx(200.0)


DQ: dict[str, float] = {"Rs": 0.4, "Rr": 0.3, "Lm": 0.06, "L_s": 2e-3, "L_r": 3e-3, "v": 320.0}


@pytest.mark.parametrize("slip", [0.5, 0.03, -0.02])
def test_the_steady_state_is_that_of_the_equivalent_circuit(slip: float) -> None:
    machine = AsynchronousMachineDQ(**DQ, p=2, Jr=0.1)
    run = turned(machine, speed(2 * pi * 50 / 2 * (1 - slip)), 3.0)
    w = 2j * pi * 50
    rotor = 0.3 / slip + w * 3e-3
    current = 320 / (0.4 + w * 2e-3 + w * 0.06 * rotor / (w * 0.06 + rotor))
    induced = abs(current * w * 0.06 / (w * 0.06 + rotor))
    torque = 1.5 * induced**2 * 0.3 / slip / (2 * pi * 50 / 2)
    assert [run.final["m.i_ds"], run.final["m.i_qs"]] == pytest.approx([current.real, current.imag], rel=1e-6)
    assert run.final["m.tau"] == pytest.approx(torque, rel=1e-6)
    assert run.energy().power_closure < 1e-8


def test_a_start_against_complex_vectors_at_rest() -> None:
    """The same machine in coordinates of the stator, with one complex flux each."""
    Ls, Lr, Lm = 0.062, 0.063, 0.06
    inverse = np.linalg.inv([[Ls, Lm], [Lm, Lr]])

    def rates(t: float, y: Any) -> list[complex]:
        i_s, i_r = inverse @ y[:2]
        v = 320 * np.exp(2j * pi * 50 * t)
        torque = 1.5 * 2 * (np.conj(y[0]) * i_s).imag
        return [v - 0.4 * i_s, -0.3 * i_r + 2j * y[2] * y[1], torque / 0.25]

    run = turned(AsynchronousMachineDQ(**DQ, p=2, Jr=0.1), Inertia(J=0.15, phi=0.0, w=0.0), 0.6)
    oracle = solve_ivp(rates, (0, 0.6), [0j, 0j, 0j], rtol=1e-10, atol=1e-11, dense_output=True)
    for t in (0.02, 0.1, 0.3, 0.6):
        assert run.at(t)["load.w"] == pytest.approx(oracle.sol(t)[2].real, rel=1e-5)
    assert run.energy().power_closure < 1e-8


# -- synchronous -------------------------------------------------------------------------------------------------------

PM: dict[str, float] = {"p": 4, "psi": 0.08, "R": 0.05, "L_d": 0.3e-3, "Jr": 0.02}


def test_a_blocked_synchronous_machine_is_an_inductor() -> None:
    run = turned(PMSynchronousMachine(**PM, L_q=0.6e-3, v_q=2.0), Fixed(), 0.05)
    current = 40 * (1 - np.exp(-run.time * 0.05 / 0.6e-3))
    np.testing.assert_allclose(run["m.i_q"], current, atol=1e-6)
    np.testing.assert_allclose(run["m.tau"], 1.5 * 4 * 0.08 * current, atol=1e-6)


def test_a_synchronous_machine_in_the_steady_state() -> None:
    """R·i + j·w·p·(flux) = v solved for both currents, saliency included."""
    w = 4 * 50.0
    run = turned(PMSynchronousMachine(**PM, L_q=0.6e-3, v_d=-3.0, v_q=25.0), speed(50.0), 0.5)
    i_d, i_q = np.linalg.solve([[0.05, -w * 0.6e-3], [w * 0.3e-3, 0.05]], [-3.0, 25.0 - w * 0.08])
    assert [run.final["m.i_d"], run.final["m.i_q"]] == pytest.approx([i_d, i_q], rel=1e-6)
    assert run.final["m.tau"] == pytest.approx(1.5 * 4 * (0.08 + (0.3e-3 - 0.6e-3) * i_d) * i_q, rel=1e-6)
    assert run.energy().power_closure < 1e-8


def supplied(drive: Component, load: Component, until: float, supply: Component | None = None) -> Solution:
    parts = {"supply": supply or ConstantVoltage(V=400.0), "earth": Ground(), "m": drive, "load": load}
    end = "flange_a" if isinstance(load, Inertia) else "flange"
    connect = {"p": ["supply.p", "m.p_dc"], "n": ["supply.n", "m.n_dc", "earth.p"], "s": ["m.flange", f"load.{end}"]}
    return simulate(Assembly("d", parts=parts, connect=connect), until, **TIGHT)


@pytest.mark.parametrize("psi", [0.08, 0.05])
@pytest.mark.parametrize("w", [100.0, 800.0, 1500.0, 3000.0])
def test_the_largest_torque_is_the_largest_there_is(w: float, psi: float) -> None:
    """All currents within the limits of current and voltage, tried on a grid."""
    values = PM | {"psi": psi, "R": 0.0}
    run = supplied(PMSynchronousDrive(**values, I_max=250.0, tau_ref=1e3, modulation=0.9), speed(w), 0.05)
    most = 0.9 * 400 / sqrt(3)
    i_d, i_q = np.meshgrid(np.linspace(-250, 0, 1001), np.linspace(0, 250, 1001))
    voltage = 4 * w * np.hypot(psi + 0.3e-3 * i_d, 0.3e-3 * i_q)
    possible = (np.hypot(i_d, i_q) <= 250 * (1 + 1e-12)) & (voltage <= most * (1 + 1e-12))
    best = 1.5 * 4 * psi * np.max(np.where(possible, i_q, 0))
    assert run.final["m.tau"] == pytest.approx(best, rel=0.01, abs=0.5)
    assert np.hypot(run.final["m.i_d"], run.final["m.i_q"]) <= 250 * (1 + 1e-9)
    across = 4 * w * (psi + 0.3e-3 * run.final["m.i_d"])
    if best:
        assert np.hypot(across, 4 * w * 0.3e-3 * run.final["m.i_q"]) <= most * (1 + 1e-6)


def test_a_synchronous_drive_takes_its_power_from_the_supply() -> None:
    """A steady 60 N·m at 300 rad/s need no field weakening: copper loss 3/2·R·i², inverter 97 %."""
    drive = PMSynchronousDrive(**PM, I_max=250.0, tau_ref=60.0, eta=0.97)
    run = supplied(drive, speed(300.0), 0.1)
    current = 60 / (1.5 * 4 * 0.08)
    assert run.final["m.i_dc"] == pytest.approx((60 * 300 + 1.5 * 0.05 * current**2) / 0.97 / 400, rel=1e-8)
    assert run.energy().power_closure < 1e-8
    braking = supplied(PMSynchronousDrive(**PM, I_max=250.0, tau_ref=-60.0, eta=0.97), speed(300.0), 0.1)
    assert braking.final["m.i_dc"] == pytest.approx((1.5 * 0.05 * current**2 - 60 * 300) * 0.97 / 400, rel=1e-8)


MAP: dict[str, Any] = {
    "limit": ((0.0, 200.0), (300.0, 200.0), (600.0, 100.0)), "speeds": (0.0, 600.0), "torques": (0.0, 200.0),
    "eta": ((0.7, 0.9), (0.9, 0.95)), "Jr": 0.05,
}  # fmt: skip


@pytest.mark.parametrize(("wanted", "tau"), [(80.0, 80.0), (500.0, 150.0), (-60.0, -60.0)])
def test_a_drive_by_its_map(wanted: float, tau: float) -> None:
    run = supplied(MappedDrive(**MAP, tau_ref=wanted), speed(450.0), 0.5)
    share = abs(tau) / 200
    eta = 0.25 * (0.7 + 0.2 * share) + 0.75 * (0.9 + 0.05 * share)
    assert run.final["m.tau"] == pytest.approx(tau, rel=1e-8)
    power = tau * 450 / eta if tau > 0 else tau * 450 * eta
    assert run.final["m.i_dc"] == pytest.approx(power / 400, rel=1e-7)
    assert run.energy().power_closure < 1e-8
    assert np.min(run["m.loss_power"]) >= 0


def test_only_the_voltage_between_its_terminals_counts() -> None:
    """Two sources of 200 V, with earth between them, are one of 400 V."""
    parts = {
        "upper": ConstantVoltage(V=200.0), "lower": ConstantVoltage(V=200.0), "earth": Ground(),
        "m": MappedDrive(**MAP, tau_ref=80.0), "load": speed(450.0),
    }  # fmt: skip
    connect = {"p": ["upper.p", "m.p_dc"], "middle": ["upper.n", "earth.p", "lower.p"], "n": ["lower.n", "m.n_dc"],
               "s": ["m.flange", "load.flange"]}  # fmt: skip
    run = simulate(Assembly("d", parts=parts, connect=connect), 0.1, **TIGHT)
    whole = supplied(MappedDrive(**MAP, tau_ref=80.0), speed(450.0), 0.1)
    assert run.final["m.v_dc"] == pytest.approx(400.0, rel=1e-12)
    assert run.final["m.i_dc"] == pytest.approx(whole.final["m.i_dc"], rel=1e-9)


def test_a_drive_on_a_battery() -> None:
    """v = E - R·i and v·i = P: the smaller of both currents."""
    cells = Battery(ocv=((0.0, 400.0), (1.0, 400.0)), Q="50 A.h", R_i=0.2)
    run = supplied(MappedDrive(**MAP, tau_ref=80.0), speed(450.0), 0.5, cells)
    power = 80 * 450 / run.final["m.efficiency"]
    assert run.final["m.i_dc"] == pytest.approx((400 - sqrt(400**2 - 4 * 0.2 * power)) / 0.4, rel=1e-6)
    assert run.energy().power_closure < 1e-8


def test_a_drive_whose_battery_cannot_give_the_power() -> None:
    """400 V behind 2 Ohm give 20 kW at most: the run ends where the torque asks for more."""
    cells = Battery(ocv=((0.0, 400.0), (1.0, 400.0)), Q="50 A.h", R_i=2.0)
    with pytest.raises(ModelicaLikeError, match="gave up"):
        supplied(MappedDrive(**MAP, tau_ref=100.0), speed(450.0), 0.5, cells)


def test_gradients_come_through_the_load_step_of_a_weakened_field() -> None:
    """0.5 kg.m2 under 200 N.m with the lag T: dw/dT = -400 rad/s²·(1 - exp(-t/T)·(1 + t/T))."""
    netlist = Path(__file__).parents[2] / "examples" / "components" / "electric_drives.toml"
    found = sensitivities(netlist, ["at(axle.w, 1.5 s)"], ["motor.T"])
    assert found["at(axle.w, 1.5 s)", "motor.T"] == pytest.approx(-400.0, rel=1e-5)
