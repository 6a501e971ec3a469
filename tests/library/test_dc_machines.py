"""Circuits and DC machines against closed forms."""

from itertools import pairwise
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    Capacitor,
    ConstantCurrent,
    ConstantSpeed,
    ConstantTorque,
    ConstantVoltage,
    CurrentSensor,
    CurrentSink,
    Fixed,
    Ground,
    Inductor,
    Inertia,
    PermanentMagnetDCMachine,
    Ramp,
    Resistor,
    SeparatelyExcitedDCMachine,
    SeriesDCMachine,
    ShuntDCMachine,
    SpringDamper,
    Step,
    Switch,
    ThermalMass,
    VariableResistor,
    VoltageSensor,
)
from modelica_like import Assembly, Component, simulate
from modelica_like.errors import LimitPassed

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def circuit(*chain: str, **parts: Component) -> Assembly:
    """One loop of two-terminal parts, grounded at its end."""
    ends = {"minus": [f"{chain[-1]}.n", f"{chain[0]}.n", "ground.p"]}
    wires = {f"{a}_{b}": [f"{a}.{'p' if a == chain[0] else 'n'}", f"{b}.p"] for a, b in pairwise(chain)}
    return Assembly("circuit", parts={**parts, "ground": Ground()}, connect=wires | ends)


# -- circuits ----------------------------------------------------------------------------------------------------------


def test_series_resonance() -> None:
    """Source, resistor, inductor and capacitor, switched on: the damped oscillation of the current."""
    R, L, C, V = 2.0, 0.1, 1e-3, 12.0
    parts: dict[str, Component] = {
        "source": ConstantVoltage(V=V), "R": Resistor(R=R), "L": Inductor(L=L, i=0.0), "C": Capacitor(C=C, v=0.0)
    }  # fmt: skip
    run = simulate(circuit("source", "R", "L", "C", **parts), "0.3 s", **TIGHT)
    decay, w = R / (2 * L), sqrt(1 / (L * C) - (R / (2 * L)) ** 2)
    np.testing.assert_allclose(run["L.i"], V / (w * L) * np.exp(-decay * run.time) * np.sin(w * run.time), atol=1e-8)
    balance = run.energy()
    assert balance.power_closure <= 1e-8
    assert balance["source"].source == pytest.approx(
        balance["R"].lost + balance["C"].stored + balance["L"].stored, rel=1e-8
    )


def test_divider_and_sensors() -> None:
    parts: dict[str, Component] = {
        "source": ConstantVoltage(V=10.0), "meter": CurrentSensor(), "upper": VariableResistor(R=3.0),
        "lower": Resistor(R=2.0)
    }  # fmt: skip
    divider = circuit("source", "meter", "upper", "lower", **parts)
    divider.volt = VoltageSensor()
    drive = Assembly(
        "circuit", parts={**parts, "ground": Ground(), "volt": VoltageSensor()},
        connect={**divider.wires, "middle": ["volt.p", "lower.p"], "zero": ["volt.n", "ground.p"]},
    )  # fmt: skip
    run = simulate(drive, "1 s", points=2)
    assert run.final["meter.i"] == pytest.approx(2.0, rel=1e-12)
    assert run.final["volt.v"] == pytest.approx(4.0, rel=1e-12)


def test_resistance_rises_with_its_temperature() -> None:
    parts: dict[str, Component] = {
        "source": ConstantVoltage(V=20.0), "wire": Resistor(R=4.0, alpha=0.004),
        "copper": ThermalMass(C=100.0, T=293.15)
    }  # fmt: skip
    drive = circuit("source", "wire", **parts)
    heated = Assembly(
        "circuit",
        parts={**parts, "ground": Ground()},
        connect={**drive.wires, "heat": ["wire.heat_port", "copper.port"]},
    )
    run = simulate(heated, "100 s", **TIGHT)
    # C·der(theta) = V²/(R·(1 + alpha·theta)): theta + alpha·theta²/2 = V²/(R·C)·t
    rise = run["copper.T"] - 293.15
    np.testing.assert_allclose(rise + 0.002 * rise**2, 400.0 / 400.0 * run.time, rtol=1e-7, atol=1e-7)
    assert run.energy().power_closure <= 1e-8


def test_a_winding_of_copper_at_any_temperature() -> None:
    """Copper by its coefficient at 20 °C: 0.5 Ohm at 80 °C are 0.5·(1 + 80·3.92e-3)/(1 + 60·3.92e-3) Ohm at 100 °C."""
    motor = PermanentMagnetDCMachine(Ra=0.5, alpha20=3.92e-3, T_ref="80 degC", T="100 degC", k=1.0, quasi_static=True)
    parts: dict[str, Component] = {
        "source": ConstantVoltage(V=20.0),
        "motor": motor,
        "wall": Fixed(),
        "ground": Ground(),
    }
    connect = {"p": ["source.p", "motor.ap"], "n": ["source.n", "motor.an", "ground.p"]}
    connect["shaft"] = ["motor.flange", "wall.flange"]
    run = simulate(Assembly("stalled", parts=parts, connect=connect), 0.1)
    assert run.final["motor.ia"] == pytest.approx(20.0 / (0.5 * (1 + 80 * 3.92e-3) / (1 + 60 * 3.92e-3)), rel=1e-12)


def test_switch_and_current_sources() -> None:
    parts: dict[str, Component] = {
        "source": ConstantCurrent(I=-2.0), "R": Resistor(R=5.0), "signal": Step(start_time=0.5), "switch": Switch(),
        "sink": CurrentSink(i_ref=0.5)
    }  # fmt: skip
    drive = Assembly(
        "circuit", parts={**parts, "ground": Ground()},
        connect={
            "plus": ["source.p", "R.p", "switch.p", "sink.p"],
            "minus": ["source.n", "R.n", "switch.n", "sink.n", "ground.p"],
            "on": ["signal.y", "switch.closed"],
        },
    )  # fmt: skip
    run = simulate(drive, "1 s", points=10)
    assert run.at(0.25)["R.v"] == pytest.approx(1.5 * 5.0, rel=1e-4)
    assert run.at(0.75)["R.v"] == pytest.approx(0.0, abs=1e-4)
    assert run.energy().power_closure <= 1e-8


def test_a_switch_is_closed_above_one_half() -> None:
    """A ramp of 1/s from 0.75 falls below one half after 0.25 s; one from 0.25 rises above it."""
    for start, slope, closed in ((0.75, -1.0, True), (0.25, 1.0, False)):
        parts: dict[str, Component] = {
            "source": ConstantCurrent(I=-2.0), "R": Resistor(R=5.0), "switch": Switch(),
            "signal": Ramp(height=slope, duration=1.0, offset=start),
        }  # fmt: skip
        drive = Assembly(
            "circuit", parts={**parts, "ground": Ground()},
            connect={
                "plus": ["source.p", "R.p", "switch.p"], "minus": ["source.n", "R.n", "switch.n", "ground.p"],
                "on": ["signal.y", "switch.closed"],
            },
        )  # fmt: skip
        run = simulate(drive, 0.5)
        assert run["switch.contacts"][0] == closed
        assert [one.time for one in run.events] == [pytest.approx(0.25, abs=1e-9)]


# -- machines ----------------------------------------------------------------------------------------------------------

MACHINES: dict[str, Any] = {
    "magnet": PermanentMagnetDCMachine, "separate": SeparatelyExcitedDCMachine, "shunt": ShuntDCMachine,
    "series": SeriesDCMachine,
}  # fmt: skip


def bench(machine: Component, load: Component, voltage: float = 100.0, **more: Component) -> Assembly:
    """A machine on a stiff supply; separate excitation with 100 V."""
    parts: dict[str, Component] = {
        "supply": ConstantVoltage(V=voltage),
        "ground": Ground(),
        "machine": machine,
        "load": load,
        **more,
    }
    wires = {
        "plus": ["supply.p", "machine.ap"],
        "minus": ["supply.n", "machine.an", "ground.p"],
        "shaft": ["machine.flange", "load.flange"],
    }
    if isinstance(machine, SeparatelyExcitedDCMachine):
        parts["field"] = ConstantVoltage(V=100.0)
        wires |= {"field_plus": ["field.p", "machine.ep"], "minus": [*wires["minus"], "field.n", "machine.en"]}
    return Assembly("bench", parts=parts, connect=wires)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("quasi_static", [False, True])
def test_nominal_operating_point(name: str, quasi_static: bool) -> None:
    """At nominal voltage and speed the current is the nominal one but for the core losses, which come on top."""
    machine = MACHINES[name](quasi_static=quasi_static, V_brush=1.0, P_friction=100.0, P_core=200.0, P_stray=50.0)
    speed = (1410 if name == "series" else 1425) * pi / 30
    run = simulate(bench(machine, ConstantSpeed(w_fixed=speed)), "5 s", start="steady", points=10)
    resistance, induced = (0.06, 93.0) if name == "series" else (0.05, 94.0)
    k = induced / speed
    conductance = 200.0 / induced**2
    current = run.final["machine.ia"]
    flux = current / 100.0 if name == "series" else 1.0
    core = 100.0 - 1.0 - resistance * current
    assert core == pytest.approx(run.final["machine.v_core"], rel=1e-9)
    assert core == pytest.approx(k * flux * speed, rel=1e-9)
    assert current - conductance * core == pytest.approx(run.final["machine.tau_electrical"] / (k * flux), rel=1e-9)
    excitation = {"shunt": 100.0, "separate": 100.0}.get(name, 0.0)
    lost = (
        resistance * current**2 + current + conductance * core**2 + 100.0 + 50.0 * (current / 100.0) ** 2 + excitation
    )
    assert run.final["machine.loss_power"] == pytest.approx(lost, rel=1e-9)
    assert current == pytest.approx(100.0, rel=3e-2)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("w", [300.0, 0.2, 0.075, 0.0, -0.03, -40.0])
def test_friction_follows_a_power_of_the_speed_and_is_linear_about_standstill(w: float) -> None:
    """0.5 N.m·(w/w_nominal)^1.5 down to a thousandth of the nominal speed, with no jump there."""
    machine = PermanentMagnetDCMachine(P_friction=75.0, p_friction=1.5, w_nominal=150.0)
    run = simulate(bench(machine, ConstantSpeed(w_fixed=w)), "1 s", start="steady", points=1)
    x = abs(w) / 150.0
    friction = np.sign(w) * 0.5 * (x**1.5 if x > 1e-3 else 1e-3**0.5 * x)
    assert run.final["machine.tau_electrical"] + run.final["machine.flange.tau"] == pytest.approx(friction, abs=1e-9)


@pytest.mark.parametrize("tau", [0.1, 20.0, 63.66, -40.0])
def test_speed_falls_linearly_with_the_torque(tau: float) -> None:
    """Magnet machine: w = (V - R·M/k)/k; a negative load makes it a generator that feeds the supply."""
    machine = PermanentMagnetDCMachine(k=0.636, Ra=0.05, La=0.0015, Jr=0.15, phi=0.0)
    run = simulate(bench(machine, ConstantTorque(tau_constant=-tau)), "1 s", start="steady", points=5)
    assert run.final["machine.w"] == pytest.approx((100.0 - 0.05 * tau / 0.636) / 0.636, rel=1e-9)
    assert run.final["machine.ia"] == pytest.approx(tau / 0.636, rel=1e-8)
    assert run.energy()["supply"].source == pytest.approx(100.0 * tau / 0.636, rel=1e-8)


def test_field_weakening_makes_the_separately_excited_machine_faster() -> None:
    machine = SeparatelyExcitedDCMachine(k=0.6, Re=200.0, phi=0.0)
    run = simulate(bench(machine, ConstantTorque(tau_constant=0.0)), "1 s", start="steady", points=5)
    assert run.final["machine.w"] == pytest.approx(100.0 / 0.6 / (100.0 / 200.0), rel=1e-9)


def test_shunt_machine_takes_its_excitation_from_the_armature_terminals() -> None:
    run = simulate(
        bench(ShuntDCMachine(k=0.6, phi=0.0), ConstantTorque(tau_constant=-30.0)), "1 s", start="steady", points=5
    )
    assert run.final["machine.ap.i"] == pytest.approx(50.0 + 1.0, rel=1e-9)


def test_series_machine_runs_away_without_load() -> None:
    """Its flux vanishes with the current: the speed passes ten times the nominal one and goes on rising."""
    machine = SeriesDCMachine(phi=0.0, w=0.0, ia=0.0)
    run = simulate(bench(machine, ConstantTorque(tau_constant=0.0)), "120 s")
    assert run.final["machine.w"] > 10 * 1410 * pi / 30
    assert np.all(np.diff(run["machine.w"]) > 0)
    loaded = simulate(bench(SeriesDCMachine(phi=0.0, w=0.0, ia=0.0), ConstantTorque(tau_constant=-63.66)), "20 s")
    assert loaded.final["machine.w"] == pytest.approx(1410 * pi / 30, rel=2e-3)


def test_series_torque_grows_with_the_square_of_the_current() -> None:
    torques = []
    for speed in (100.0, 200.0):
        run = simulate(bench(SeriesDCMachine(), ConstantSpeed(w_fixed=speed)), "1 s", start="steady", points=5)
        torques.append(run.final["machine.tau_electrical"] / run.final["machine.ia"] ** 2)
    assert torques[0] == pytest.approx(torques[1], rel=1e-9)


def test_direct_switch_on_against_scipy() -> None:
    k, R, L, J = 0.6, 0.05, 0.0015, 0.15
    run = simulate(
        bench(PermanentMagnetDCMachine(k=k, phi=0.0, w=0.0, ia=0.0), ConstantTorque(tau_constant=-20.0)),
        "0.3 s",
        **TIGHT,
    )

    def rates(t: float, y: Any) -> list[float]:
        return [(100.0 - R * y[0] - k * y[1]) / L, (k * y[0] - 20.0) / J]

    reference = solve_ivp(rates, (0, 0.3), [0, 0], rtol=1e-10, atol=1e-11, t_eval=np.linspace(0, 0.3, 31))
    for t, i, w in zip(reference.t, *reference.y, strict=True):
        assert run.at(t)["machine.ia"] == pytest.approx(i, abs=1e-3)
        assert run.at(t)["machine.w"] == pytest.approx(w, abs=1e-4)


def test_generator_into_a_resistor() -> None:
    parts: dict[str, Component] = {
        "turbine": ConstantSpeed(w_fixed=100.0),
        "machine": PermanentMagnetDCMachine(k=0.5, Ra=0.5, quasi_static=True), "load": Resistor(R=4.5),
        "ground": Ground(),
    }  # fmt: skip
    drive = Assembly(
        "plant", parts=parts,
        connect={"shaft": ["turbine.flange", "machine.flange"], "plus": ["machine.ap", "load.p"],
        "minus": ["machine.an", "load.n", "ground.p"]},
    )  # fmt: skip
    run = simulate(drive, "1 s", points=5)
    assert run.final["load.v"] == pytest.approx(50.0 * 4.5 / 5.0, rel=1e-12)
    assert run.energy()["turbine"].source == pytest.approx(50.0**2 / 5.0, rel=1e-8)


def test_friction_follows_its_exponent_and_brakes_both_ways() -> None:
    machine = PermanentMagnetDCMachine(k=0.5, P_friction=300.0, p_friction=2.0, quasi_static=True)
    for speed in (80.0, -80.0):
        run = simulate(bench(machine, ConstantSpeed(w_fixed=speed), voltage=0.0), "1 s", points=5)
        wanted = 300.0 * (80.0 / (1425 * pi / 30)) ** 3
        electrical = (0.5 * 80.0) ** 2 / 0.05
        assert run.final["machine.loss_power"] == pytest.approx(wanted + electrical, rel=1e-9)


def test_machine_on_a_moving_stand() -> None:
    """The stand feels the torque of the air gap, backward."""
    parts: dict[str, Component] = {
        "supply": ConstantVoltage(V=20.0), "ground": Ground(),
        "machine": PermanentMagnetDCMachine(k=0.5, phi=0.0, w_rotor=0.0, ia=0.0),
        "load": Inertia(J=0.2), "stand": Inertia(J=0.4),
        "mount": SpringDamper(c=500.0, d=3.0, phi_rel=0.0, w_rel=0.0), "floor": ConstantSpeed(w_fixed=0.0),
    }  # fmt: skip
    drive = Assembly(
        "bench", parts=parts, series={"shaft": ["machine", "load"], "stand": ["floor", "mount", "stand"]},
        connect={"plus": ["supply.p", "machine.ap"], "minus": ["supply.n", "machine.an", "ground.p"],
        "housing": ["stand.flange_b", "machine.support"]},
    )  # fmt: skip
    run = simulate(drive, "0.5 s", rtol=1e-9)
    np.testing.assert_allclose(run["machine.support.tau"], run["machine.tau_electrical"], atol=1e-8)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize(("voltage", "fits"), [(4.9, False), (5.0, False), (5.1, True)])
def test_a_nominal_point_needs_an_induced_voltage(voltage: float, fits: bool) -> None:
    """100 A drop 5 V at 0.05 Ohm: with less there is no constant, and the machine would turn backwards."""
    drive = bench(PermanentMagnetDCMachine(V_nominal=voltage), ConstantSpeed(w_fixed=10.0), 5.0)
    if fits:
        induced = (voltage - 5.0) * 10.0 / (1425 * pi / 30)
        assert simulate(drive, 0.1, start="steady").final["machine.v_induced"] == pytest.approx(induced)
        return
    with pytest.raises(LimitPassed, match="machine has no induced voltage at its nominal point"):
        simulate(drive, 0.1, start="steady")
    # A constant that is given needs no nominal point.
    simulate(
        bench(PermanentMagnetDCMachine(V_nominal=voltage, k=-0.5), ConstantSpeed(w_fixed=10.0), 5.0),
        0.1,
        start="steady",
    )
