"""Actuators of clutches and brakes, and clutches that get hot, against closed forms and scipy."""

from math import exp, sqrt
from typing import Any

import pytest
from scipy.integrate import solve_ivp

from components import (
    BooleanPulse,
    Clutch,
    Constant,
    ConstantSpeed,
    ConstantVoltage,
    Contactor,
    ElectromagneticActuator,
    Fixed,
    Ground,
    HydraulicActuator,
    PneumaticActuator,
    Resistor,
    Step,
    Switch,
    ThermalClutch,
)
from modelica_like import Assembly, Component, Solution, simulate
from modelica_like.errors import LimitPassed
from modelica_like.show.report.run import notices

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def coil(**values: Any) -> Solution:
    """A coil of 12 Ohm that 24 V drive from 0 to 0.1 s; then its current flows through 100 Ohm."""
    magnet = {"R": 12.0, "L_m": 0.3, "gap": 0.2e-3, "travel": 0.1e-3, "m": 0.02, "f_spring": 5.0, "c": 1e4} | values
    parts: dict[str, Component] = {
        "battery": ConstantVoltage(V=24.0), "contact": Switch(R_closed=0.0, G_open=0.0), "earth": Ground(),
        "spark": Resistor(R=100.0), "coil": ElectromagneticActuator(**magnet),
        "on": BooleanPulse(period=0.2, width=0.5),
    }  # fmt: skip
    connect = {
        "plus": ("battery.p", "contact.p"), "switched": ("contact.n", "coil.p", "spark.p"),
        "minus": ("battery.n", "coil.n", "spark.n", "earth.p"), "switch": ("on.y", "contact.closed"),
    }  # fmt: skip
    return simulate(Assembly("drive", parts=parts, connect=connect), "0.15 s", **TIGHT)


def test_magnet_moves_as_scipy_says() -> None:
    """From the release of the armature to its impact: m·v' = F - f_spring - c·s, and the circuit with its back-EMF."""
    run = coil(L_s=0.05)
    events = [event.time for event in run.events if event.mode == "coil.stop" and event.after != "moving"]

    def rates(t: float, y: list[float]) -> list[float]:
        s, v, i = y
        x = 1 + (0.1e-3 - s) / 0.2e-3
        inductance, slope = 0.05 + 0.3 / x, 0.3 / x**2 / 0.2e-3
        return [v, (0.5 * i**2 * slope - 5 - 1e4 * s) / 0.02, (24 - 12 * i - i * slope * v) / inductance]

    start = sqrt(2 * 5 * 0.2e-3 / 0.3) * 1.5
    landing: Any = lambda t, y: y[0] - 0.1e-3  # noqa: E731
    landing.terminal = True
    reference = solve_ivp(rates, (0, 1), [0, 0, start], rtol=1e-11, atol=1e-13, events=landing, method="DOP853")
    assert events[1] - events[0] == pytest.approx(reference.t[-1], rel=1e-6)
    assert run.impacts[0].energy == pytest.approx(0.5 * 0.02 * reference.y[1, -1] ** 2, rel=1e-6)
    assert run.energy().power_closure < 1e-10


def test_remanence_holds_the_armature_after_switching_off() -> None:
    """What the iron keeps draws with i_rem²/2·L_m/gap: more than the spring's 6 N at the far stop."""
    run = coil(i_rem=0.1)
    assert [event.after for event in run.events if event.mode == "coil.stop"] == ["leaving", "moving", "driven"]
    left = 0.1 + 2 * exp(-0.05 * 112 / 0.3)
    assert run.final["coil.y"] == pytest.approx(0.5 * left**2 * 0.3 / 0.2e-3 - 6, rel=1e-6)
    assert coil(i_rem=0.08).final["coil.s"] == pytest.approx(0, abs=1e-12)


def test_resting_armature_presses_with_its_spring() -> None:
    run = coil(presses="resting")
    assert run.at(0)["coil.y"] == pytest.approx(5)
    assert run.at(0.09)["coil.y"] == 0


@pytest.mark.parametrize("pressure", [8e5, 3e5])
def test_piston_of_constant_flow(pressure: float) -> None:
    """A strong spring without stiffness: the piston travels at the speed Q(p_in - p_spring)/A."""
    piston = HydraulicActuator(
        A=1e-3, Q_nominal=1e-4, p_laminar=1.0, C=1e-14, travel=0.01, m=1e-4, f_spring=100.0, p=1e5
    )
    parts: dict[str, Component] = {"valve": Constant(k=f"{pressure} Pa"), "piston": piston}
    run = simulate(Assembly("drive", parts=parts, connect={"oil": ["valve.y", "piston.p_in"]}), 0.1, rtol=1e-8)
    arrived = next(event.time for event in run.events if event.after == "driven")
    assert arrived == pytest.approx(0.01 * 1e-3 / (1e-4 * sqrt((pressure - 1e5) / 1e5)), rel=2e-4)
    assert run.final["piston.y"] == pytest.approx(1e-3 * pressure - 100, rel=1e-6)


def test_air_flows_as_iso_6358_says() -> None:
    """A piston that a strong spring holds: first the pressure is a straight line, then it follows ISO 6358."""
    piston = PneumaticActuator(A=1e-3, V_0=1e-3, C=1e-8, b=0.3, travel=0.01, m=0.1, f_spring=1e6)
    parts: dict[str, Component] = {"valve": Step(offset="1 bar", height="5 bar"), "piston": piston}
    run = simulate(Assembly("drive", parts=parts, connect={"air": ["valve.y", "piston.p_in"]}), 0.9, **TIGHT)
    rate, choked = 1e5 * 1e-8 * 6e5 / 1e-3, (0.3 * 6e5 - 1e5) / (1e5 * 1e-8 * 6e5 / 1e-3)
    assert run.at(choked)["piston.p"] == pytest.approx(0.3 * 6e5, rel=1e-7)
    reference = solve_ivp(
        lambda t, p: rate * (1 - ((p / 6e5 - 0.3) / 0.7) ** 2) ** 0.5, (0, 0.5), [0.3 * 6e5], rtol=1e-10
    )
    assert run.at(choked + 0.5)["piston.p"] == pytest.approx(reference.y[0, -1], rel=1e-6)
    assert run.energy().power_closure < 1e-9


def slipping(clutch: Clutch, **parts: Component) -> Assembly:
    parts = {"motor": ConstantSpeed(w_fixed=100.0), "clutch": clutch, "wall": Fixed()} | parts
    return Assembly("drive", parts=parts, series={"shaft": ["motor", "clutch", "wall"]})


def test_fading_clutch_settles_where_the_straight_line_says() -> None:
    """C·T' = P·(1 - k·(T - T_1)) - G·(T - T_0): an exponential towards (P·(1 + k·T_1) + G·T_0)/(P·k + G)."""
    clutch = ThermalClutch(
        capacity=20.0, C=200.0, G=8.0, mu_T=((293.15, 1.0), (693.15, 0.2)), A=0.01, wear_rate=2e-15, tau_drag=0.0
    )
    run = simulate(slipping(clutch), 60.0, **TIGHT)
    P, k = 20 * 100, 0.8 / 400
    settled = 293.15 + P / (P * k + 8)
    assert run.final["clutch.T"] == pytest.approx(settled - (settled - 293.15) * exp(-(P * k + 8) * 60 / 200), rel=1e-8)
    assert run.final["clutch.wear"] == pytest.approx(2e-13 * run.energy()["clutch"].lost, rel=1e-8)


def test_pressure_and_temperature_multiply_and_the_end_of_a_table_is_told() -> None:
    pressed = ThermalClutch(
        capacity=20.0, C=50.0, p_max=2e6, mu_p=((0.0, 1.2), (4e6, 0.8)), mu_T=((293.15, 1.0), (343.15, 0.5)),
        tau_drag=1.0,
    )  # fmt: skip
    run = simulate(slipping(pressed), 5.0, **TIGHT)
    assert run.at(0)["clutch.tau"] == pytest.approx(-(20 * 1.0 + 1))
    assert run.final["clutch.tau"] == pytest.approx(-(20 * 0.5 + 1))
    assert any("leaves the rows of mu_T" in notice for notice in notices(run))


def test_wind_cools_a_clutch_that_turns() -> None:
    clutch = ThermalClutch(capacity=20.0, C=10.0, G=2.0, w_G=50.0)
    run = simulate(slipping(clutch), 60.0, **TIGHT)
    assert run.final["clutch.T"] == pytest.approx(293.15 + 20 * 100 / (2 * (1 + 2**0.8)), rel=1e-9)


@pytest.mark.parametrize(("s", "v", "mode"), [
    (0.0, 0.0, "resting"), (1e-3, 0.0, "moving"), (0.0, 0.1, "moving"), (0.0, -0.1, "resting"), (2e-3, 0.0, "leaving"),
])  # fmt: skip
def test_a_piston_begins_at_a_stop_or_between(s: float, v: float, mode: str) -> None:
    """Without pressure the spring takes it from its other stop at once."""
    piston = PneumaticActuator(p_in=0.0, A=3e-3, V_0=1e-4, C=1e-8, travel=2e-3, m=0.8, f_spring=300.0, s=s, v=v)
    run = simulate(Assembly("d", parts={"piston": piston}), 1e-6)
    assert run.model.flat_discretes[0].names[int(run["piston.stop"][0])] == mode


def test_air_into_a_vacuum() -> None:
    """At the sonic conductance C the pressure falls as exp(-C·p_N·t/V_0)."""
    piston = PneumaticActuator(p_in=0.0, A=3e-3, V_0=1e-4, C=1e-8, travel=2e-3, m=0.8, f_spring=300.0)
    run = simulate(Assembly("d", parts={"piston": piston}), 0.5, **TIGHT)
    assert run.final["piston.p"] == pytest.approx(1e5 * exp(-5.0), rel=1e-6)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("i_off", [1.0, 1.5])
def test_a_contactor_that_opens_where_it_closes_is_refused(i_off: float) -> None:
    parts = {"battery": ConstantVoltage(V=24.0), "earth": Ground(), "lamp": Resistor(R=1.0),
             "main": Contactor(R_coil=10.0, L_coil=0.1, i_on=1.0, i_off=i_off)}  # fmt: skip
    connect = {"plus": ["battery.p", "main.cp", "main.p"], "lamp": ["main.n", "lamp.p"],
               "minus": ["battery.n", "earth.p", "main.cn", "lamp.n"]}  # fmt: skip
    with pytest.raises(LimitPassed, match=r"main cannot hold: its i_off is not below its i_on\."):
        simulate(Assembly("d", parts=parts, connect=connect), 0.1)
