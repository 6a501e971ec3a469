"""Load spectra, duty, orders and step responses: closed forms, the example of the standard, and runs."""

from math import exp, log, pi, sqrt
from typing import Any

import numpy as np
import pytest

from components import (
    Brake,
    CombustionEngine,
    Constant,
    ConstantSpeed,
    ConstantTorque,
    FirstOrder,
    Inertia,
    Ramp,
    SecondOrder,
    Sine,
    SpringDamper,
    Step,
    StepTable,
    Sum,
    Table,
    Torque,
)
from modelica_like import (
    Assembly,
    ModelicaLikeError,
    Solution,
    WoehlerLine,
    duty,
    linearize,
    load_spectrum,
    order_map,
    order_response,
    simulate,
    step_metrics,
)
from modelica_like.runs.recorded import RecordedModel, RecordedSolution, RecordedVariable

TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-11}


# -- load spectra ------------------------------------------------------------------------------------------------------


def test_a_woehler_line() -> None:
    amplitudes = [200.0, 100.0, 50.0]
    for below, last in (("elementary", 1e6 * 2**5), ("haibach", 1e6 * 2**9), ("original", np.inf)):
        line = WoehlerLine(100.0, 1e6, 5.0, below)  # type: ignore[arg-type]
        assert list(line.life(amplitudes)) == pytest.approx([1e6 / 32, 1e6, last])
    assert line.damage([200.0, 50.0], [1e4, 1e9]) == pytest.approx(1e4 / (1e6 / 32))
    assert line.life([0.0])[0] == np.inf
    with pytest.raises(ModelicaLikeError, match="must be above zero"):
        WoehlerLine(0.0, 1e6, 5.0)


def signal_of(values: list[float]) -> Solution:
    table = tuple((float(k), value) for k, value in enumerate(values))
    return simulate(Assembly("d", parts={"s": Table(table=table, scale="1 N.m")}), len(values) - 1.0)


def test_the_example_of_astm_e1049() -> None:
    """Figure 6 of the standard: ranges 3 (0.5), 4 (1.5), 6 (0.5), 8 (1), 9 (0.5)."""
    found = load_spectrum(signal_of([-2, 1, -3, 5, -1, 3, -4, 4, -2]), "s.y")
    counts: dict[float, float] = {}
    for size, count in zip(2 * found.amplitudes, found.counts, strict=True):
        counts[round(float(size), 9)] = counts.get(round(float(size), 9), 0.0) + count
    assert counts == {9.0: 0.5, 8.0: 1.0, 6.0: 0.5, 4.0: 1.5, 3.0: 0.5}
    assert found.unit == "N.m"
    assert str(found) == "Load spectrum of s.y: 4 cycles, amplitudes up to 4.5 N.m"
    (line,) = found.plot().axes[0].lines
    assert (line.get_xdata()[-1], line.get_ydata()[0]) == (4.0, 4.5)


def test_the_damage_of_a_steady_vibration() -> None:
    """20 cycles of ±100 N.m about 40 N.m; a mean counts as 0.3 of its size."""
    drive = Assembly("d", parts={"s": Sine(amplitude="100 N.m", offset="40 N.m", f=10.0, phase=pi / 2)})
    spectrum = load_spectrum(simulate(drive, 2.0, points=2000), "s.y")
    line = WoehlerLine(100.0, 2e6, 6.0)
    assert spectrum.damage(line) == pytest.approx(20 / 2e6, rel=1e-6)
    assert (spectrum * 1e4).damage(line, 0.3) == pytest.approx(20e4 / 2e6 * 1.12**6, rel=1e-6)
    assert spectrum.equivalent(6.0, 1000.0) == pytest.approx(100 * (20 / 1000) ** (1 / 6), rel=1e-6)


def test_rounding_makes_no_cycles() -> None:
    """A brake of 20 N.m stops a wheel and lets go: half a cycle, and with its mean (20 + 0) / 2 the damage by hand."""
    parts = {"wheel": Inertia(J=2.0, phi=0.0, w=50.0), "brake": Brake(capacity=20.0)}
    run = simulate(Assembly("stop", parts=parts, series={"shaft": list(parts)}), 40.0)
    spectrum = load_spectrum(run, "brake.tau")
    assert spectrum.counts.tolist() == [0.5]
    assert spectrum.amplitudes == pytest.approx([10.0], rel=1e-9)
    line = WoehlerLine(amplitude=5.0, cycles=2e6, slope=5.0)
    assert spectrum.damage(line, mean_sensitivity=0.3) == pytest.approx(0.5 * (13.0 / 5.0) ** 5 / 2e6, rel=1e-8)
    constant = load_spectrum(signal_of([20.0, 20.0 + 4e-15, 20.0, 20.0 - 4e-15]), "s.y")
    assert str(constant) == "Load spectrum of s.y: 0 cycles"


def test_the_duty_of_each_gear() -> None:
    """40 N.m for 1 s and 80 N.m for 2 s in gear 1, 20 N.m for 3 s in gear 2, at 10 revolutions per second."""
    parts = {
        "motor": ConstantSpeed(w_fixed=20 * pi), "load": Torque(), "gear": StepTable(table=((0, 1), (3, 2))),
        "torque": StepTable(table=((0, -40), (1, 80), (3, -20)), scale="1 N.m"), "shaft": Inertia(J=1.0),
    }  # fmt: skip
    drive = Assembly(
        "d", parts=parts, series={"s": ["motor", "shaft", "load"]}, connect={"t": ["torque.y", "load.tau"]}
    )
    found = duty(simulate(drive, 6.0), "load.tau", "shaft.w", "gear.y", classes=4)
    assert found.gears == ("gear 1", "gear 2")
    assert list(found.torques) == pytest.approx([20, 40, 60, 80])
    np.testing.assert_allclose(found.revolutions, [[0, 0, 10, 20], [0, 30, 0, 0]], atol=1e-6)
    np.testing.assert_allclose(found.times, found.revolutions / 10, atol=1e-7)
    assert found.work.sum(axis=1) == pytest.approx([20 * pi * (-40 + 160), 20 * pi * -60], rel=1e-7)
    assert found.damage(WoehlerLine(60.0, 1e6, 3.0))["gear 1"] == pytest.approx(
        (10 + 20 * (4 / 3) ** 3) / 1e6, rel=1e-6
    )
    assert found.equivalent(3.0)["gear 2"] == pytest.approx(40.0)
    assert str(found).splitlines()[1] == "  gear 1: 3 s, 30 revolutions, 7.5398 kJ, up to 80 N.m"
    assert duty(simulate(drive, 6.0), "load.tau", "shaft.w").gears == ("all",)


def test_the_duty_of_a_ramp() -> None:
    """1.6 N.m/s·t on 1 kg.m²: w = 0.8 t², the angle is 0.8 t³/3, the work 1.6·0.8 t⁴/4; backwards as well."""
    limits = np.linspace(0.0, 10.0, 17)
    for sign in (1.0, -1.0):
        parts = {"torque": Ramp(height=16.0 * sign, duration=10.0), "load": Torque(), "J": Inertia(J=1.0, phi=0, w=0)}
        drive = Assembly("d", parts=parts, series={"s": ["load", "J"]}, connect={"t": ["torque.y", "load.tau"]})
        found = duty(simulate(drive, 10.0), "load.tau", "J.w")
        np.testing.assert_allclose(found.times, [np.full(16, 0.625)], rtol=1e-7)
        np.testing.assert_allclose(found.revolutions, [np.diff(0.8 * limits**3 / 3 / (2 * pi))], rtol=1e-7)
        np.testing.assert_allclose(found.work, [np.diff(1.6 * 0.8 * limits**4 / 4)], rtol=1e-7)


def test_the_duty_of_a_torque_that_turns_a_shaft_back() -> None:
    """A torque of 4 N.m·sin t on 1 kg.m² from -4 rad/s: w = -4 cos t; less than half of it acts for 4·π/6 s.

    A period has 16 rad to and fro, one half of them under less than half of the torque: 4·4·sin(π/6).
    """
    parts = {"torque": Sine(amplitude=4.0, f=1 / (2 * pi)), "load": Torque(), "J": Inertia(J=1.0, phi=0.0, w=-4.0)}
    drive = Assembly("d", parts=parts, series={"s": ["load", "J"]}, connect={"t": ["torque.y", "load.tau"]})
    found = duty(simulate(drive, 2 * pi), "load.tau", "J.w", classes=2)
    np.testing.assert_allclose(found.times, [[4 * pi / 6, 8 * pi / 6]], rtol=1e-6)
    np.testing.assert_allclose(found.revolutions, [[16 / 2 / (2 * pi)] * 2], rtol=1e-6)


# -- orders ------------------------------------------------------------------------------------------------------------

J_1, J_2, C, D = 0.5, 2.0, 3e4, 8.0


def two_masses(torque: object) -> Assembly:
    parts = {"torque": torque, "first": Inertia(J=J_1, w=0.0), "shaft": SpringDamper(c=C, d=D, phi_rel=0.0),
             "second": Inertia(J=J_2, phi=0.0, w=0.0)}  # fmt: skip
    return Assembly("d", parts=parts, series={"s": list(parts)})  # type: ignore[arg-type]


def test_the_orders_of_a_two_mass_drive() -> None:
    """Torque in the shaft by one at the first mass: J_2/(J_1 + J_2)·(c + s·d)/(J_r·s² + d·s + c)."""
    linear = linearize(two_masses(ConstantTorque(tau_constant=0.0)), "given",
                       inputs=["torque.tau_constant"], outputs=["shaft.tau"])  # fmt: skip
    speeds = np.linspace(20.0, 200.0, 37)
    found = order_response(linear, {2.0: 100.0, 4.0: 20.0j}, speeds)
    reduced = J_1 * J_2 / (J_1 + J_2)
    for k, (order, size) in enumerate(((2, 100), (4, 20))):
        s = 1j * order * speeds
        wanted = size * J_2 / (J_1 + J_2) * np.abs((C + s * D) / (reduced * s**2 + D * s + C))
        np.testing.assert_allclose(found.amplitudes("shaft.tau")[k], wanted, rtol=1e-9)
    damped = sqrt(C / reduced - (D / (2 * reduced)) ** 2)
    assert found.resonances() == {2.0: pytest.approx([damped / 2]), 4.0: pytest.approx([damped / 4])}
    both = order_response(linear, {2.0: 100.0}, np.linspace(-200.0, 200.0, 40))
    assert both.resonances() == {2.0: pytest.approx([-damped / 2, damped / 2])}
    np.testing.assert_allclose(both.amplitudes("shaft.tau")[0], both.amplitudes("shaft.tau")[0][::-1], rtol=1e-9)
    assert str(both).count(f"meets {damped / (2 * np.pi):.4g} Hz") == 2
    assert f"order 2 meets {damped / 2 / pi:.4g} Hz at {damped / 2 * 30 / pi:.5g} rpm" in str(found)
    assert len(found.plot("shaft.tau").axes[0].lines) == 4
    with pytest.raises(ModelicaLikeError, match="is not one of the speeds"):
        found.over_angle("shaft.tau", 21.0, [0.0])
    with pytest.raises(ModelicaLikeError, match="must be above zero"):
        order_response(linear, {}, speeds)


def test_the_steady_vibration_is_that_of_a_run() -> None:
    """Orders 1 and 3 at 60 rad/s, after the start has died away."""
    parts = {
        "one": Sine(amplitude="100 N.m", f=60 / (2 * pi), phase=pi / 2),
        "three": Sine(amplitude="40 N.m", f=180 / (2 * pi)),
        "both": Sum(), "torque": Torque(), "first": Inertia(J=J_1, w=0.0), "shaft": SpringDamper(c=C, d=D, phi_rel=0.0),
        "second": Inertia(J=J_2, phi=0.0, w=0.0),
    }  # fmt: skip
    connect = {"a": ["one.y", "both.u1"], "b": ["three.y", "both.u2"], "c": ["both.y", "torque.tau"]}
    drive = Assembly("d", parts=parts, connect=connect, series={"s": ["torque", "first", "shaft", "second"]})
    run = simulate(drive, 2.0, points=20001, **TIGHT)
    linear = linearize(two_masses(ConstantTorque(tau_constant=0.0)), "given",
                       inputs=["torque.tau_constant"], outputs=["shaft.tau"])  # fmt: skip
    # sin(x) is the real part of -j·exp(j·x).
    found = order_response(linear, {1.0: 100.0, 3.0: -40.0j}, [60.0])
    late = run.time > 1.8
    wanted = found.over_angle("shaft.tau", 60.0, 60 * run.time[late])
    np.testing.assert_allclose(run["shaft.tau"][late], wanted, atol=1e-3 * np.abs(wanted).max())


def run_up(points: int = 20001) -> Solution:
    """10 N.m on 1 kg.m2, times 1 + cos(2·phi) + 0.3·cos(3.5·phi + 0.2)."""
    engine = CombustionEngine(
        speeds=(0.0,),
        pedals=(0.0,),
        torque=((10.0,),),
        orders=((2.0, 1.0, 0.0), (3.5, 0.3, 0.2)),
        J=1.0,
        phi=0.0,
        w=20.0,
    )
    return simulate(Assembly("d", parts={"b": engine}), 10.0, points=points, **TIGHT)


def test_the_orders_of_a_run_up() -> None:
    found = order_map(run_up(), "b.tau_combustion", "b.phi", most=6.0)
    few = order_map(run_up(7), "b.tau_combustion", "b.phi", most=6.0)
    np.testing.assert_allclose(few.amplitudes, found.amplitudes, atol=1e-6)
    assert found.order(0.0) == pytest.approx(10.0, rel=2e-3)
    assert found.order(2.0) == pytest.approx(10.0, rel=2e-3)
    assert found.order(3.5) == pytest.approx(3.0, rel=5e-3)
    assert found.order(5.0) == pytest.approx(0.0, abs=2e-2)
    # The ripple moves the speed by at most 10 N.m/(2·w) about its mean.
    assert found.speeds == pytest.approx(20 + 10 * found.times, rel=0.02)
    assert len(found.plot().axes) == 2


def test_orders_that_cannot_be_seen() -> None:
    time = np.linspace(0, 10, 201)
    model = RecordedModel("seen", (RecordedVariable("b.tau", "N.m"), RecordedVariable("b.phi", "rad")), (), {})
    rows = RecordedSolution(model, time, np.array([np.sin(time), 20 * time]), np.zeros((0, len(time))), 0.0)
    with pytest.raises(ModelicaLikeError, match="between its results nothing is known"):
        order_map(rows, "b.tau", "b.phi", most=6.0)
    rows.measured = True
    with pytest.raises(ModelicaLikeError, match=r"rows are up to 0\.159 revolutions apart, and order 6 needs 0\.0833"):
        order_map(rows, "b.tau", "b.phi", most=6.0)
    with pytest.raises(ModelicaLikeError, match="does not turn 1000 times in one direction"):
        order_map(run_up(200), "b.tau_combustion", "b.phi", revolutions=1000.0)


# -- step responses ----------------------------------------------------------------------------------------------------


def test_an_oscillating_step_response() -> None:
    """Second order, D = 0.3, 5 rad/s, from 2 to 6."""
    parts = {"b": SecondOrder(w=5.0, D=0.3, y=2.0, yd=0.0), "s": Step(height=4.0, offset=2.0, start_time=1.0)}
    run = simulate(Assembly("d", parts=parts, connect={"u": ["s.y", "b.u"]}), 9.0, points=9, **TIGHT)
    found = step_metrics(run, "b.y", start=1.0, end=6.0)
    w = 5 * sqrt(1 - 0.09)
    assert found.overshoot == pytest.approx(exp(-0.3 * pi / sqrt(1 - 0.09)), rel=1e-6)
    assert found.peak_time == pytest.approx(pi / w, abs=1e-4)  # flat there: the root of the tolerance
    t = np.linspace(0, 8, 800001)
    wanted = 1 - np.exp(-1.5 * t) * (np.cos(w * t) + 1.5 / w * np.sin(w * t))
    assert found.settling_time == pytest.approx(t[np.flatnonzero(np.abs(wanted - 1) > 0.02)[-1]], abs=1e-4)
    rise = t[np.argmax(wanted > 0.9)] - t[np.argmax(wanted > 0.1)]
    assert found.rise_time == pytest.approx(rise, abs=1e-4)


def test_a_step_response_without_overshoot() -> None:
    parts = {"b": FirstOrder(T=0.5, y=0.0), "s": Constant(k=-3.0)}
    run = simulate(Assembly("d", parts=parts, connect={"u": ["s.y", "b.u"]}), 5.0, points=5, **TIGHT)
    found = step_metrics(run, "b.y", end=-3.0)
    assert (found.rise_time, found.settling_time) == pytest.approx((0.5 * log(9), 0.5 * log(50)), abs=1e-4)
    assert found.overshoot == 0.0
    assert str(found).startswith("b.y: 0 to -3, rise 1.099 s, no overshoot, within 2 %")
    for wrong, told in (
        ({"end": 0.0}, "ends where it begins"), ({"end": -9.0}, "does not settle within 2 %"),
        ({"start": 6.0}, "no results between"),
    ):  # fmt: skip
        with pytest.raises(ModelicaLikeError, match=told):
            step_metrics(run, "b.y", **wrong)
