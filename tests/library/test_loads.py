"""Loads against closed forms: a machine table on its slideway, torques that depend on the speed."""

from math import atan, log, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import ConstantForce, ConstantSpeed, ConstantTorque, Inertia, MachineTable, SpeedDependentLoad
from modelica_like import Assembly, Component, simulate

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def shaft(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def still(w: float = 0.0, J: float = 1.0) -> Inertia:
    return Inertia(J=J, phi=0.0, w=w)


@pytest.mark.parametrize("force", [150.0, 60.0, -150.0])
def test_machine_table_on_its_slideway(force: float) -> None:
    table = MachineTable(m=20.0, f_friction=50.0, f_load=30.0, s=0.0, v=0.0)
    run = simulate(shaft(push=ConstantForce(f_constant=force), table=table), "0.5 s", **TIGHT)
    net = force - 30.0
    acceleration = 0.0 if abs(net) <= 50.0 else (net - np.sign(net) * 50.0) / 20.0
    np.testing.assert_allclose(run["table.v"], acceleration * run.time, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(run["table.s"], acceleration * run.time**2 / 2, atol=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_load_with_exponent_one_and_two(sign: int) -> None:
    """Coasting: J w' = -(a + b·w), and J w' = -(a + b·w²)."""
    linear = simulate(shaft(mass=still(sign * 4.0), load=SpeedDependentLoad(a=1.0, b=2.0)), "3 s", **TIGHT)
    assert linear.events[-1].time == pytest.approx(log(9.0) / 2, abs=1e-8)
    square = simulate(shaft(mass=still(sign * 4.0), load=SpeedDependentLoad(a=1.0, b=2.0, p=2)), "3 s", **TIGHT)
    assert square.events[-1].time == pytest.approx(atan(4.0 * sqrt(2.0)) / sqrt(2.0), abs=1e-8)
    for run in (linear, square):
        assert run.final["mass.w"] == 0.0
        assert np.all(run["load.loss_power"] >= -1e-12)


@pytest.mark.parametrize("p", [2 / 3, 0.5, 1.5])
def test_load_with_any_exponent(p: float) -> None:
    run = simulate(
        shaft(
            torque=ConstantTorque(tau_constant=20.0),
            mass=still(),
            load=SpeedDependentLoad(a=9.0, b=2.0, p=p, w_ref=2.0),
        ),
        "3 s",
        **TIGHT,
    )

    def rates(t: float, w: Any) -> list[float]:
        return [20.0 - 9.0 - 2.0 * (max(w[0], 0.0) / 2.0) ** p]

    reference = solve_ivp(rates, (0, 3), [0.0], "DOP853", rtol=1e-11, atol=1e-12, t_eval=[0.1, 1.0, 3.0])
    for t, w in zip(reference.t, reference.y[0], strict=True):
        assert run.at(t)["mass.w"] == pytest.approx(w, rel=1e-7)


@pytest.mark.parametrize("p", [0.0, 1e-3, 0.1, 2 / 3])
@pytest.mark.parametrize("speed", [1.0, 0.5, 1e-6, -1.0])
def test_load_of_a_small_exponent(p: float, speed: float) -> None:
    """1 N.m + 5 N.m·|w|^p, also where p is so small that the law is nearly a step."""
    load = SpeedDependentLoad(a=1.0, b=5.0, p=p)
    run = simulate(shaft(motor=ConstantSpeed(w_fixed=speed), load=load), "0.1 s")
    assert run.final["load.tau"] == pytest.approx(np.sign(speed) * (1 + 5 * abs(speed) ** p), rel=1e-12)


@pytest.mark.parametrize(("p", "torque", "moves"), [(0.0, 5.9, False), (0.0, 6.1, True), (0.5, 1.1, True)])
def test_load_holds_with_what_it_has_at_standstill(p: float, torque: float, moves: bool) -> None:
    run = simulate(
        shaft(push=ConstantTorque(tau_constant=torque), mass=still(), load=SpeedDependentLoad(a=1.0, b=5.0, p=p)), 0.1
    )
    assert bool(run.final["mass.w"] > 0) is moves


def test_load_holds_at_standstill_and_is_free_without_a_constant_part() -> None:
    held = simulate(shaft(torque=ConstantTorque(tau_constant=8.9), mass=still(), load=SpeedDependentLoad(a=9.0)), "1 s")
    assert np.all(held["mass.w"] == 0.0)
    free = simulate(
        shaft(torque=ConstantTorque(tau_constant=1.0), mass=still(), load=SpeedDependentLoad(b=2.0)), "1 s", **TIGHT
    )
    assert free.final["mass.w"] == pytest.approx(0.5 * (1 - np.exp(-2.0)), rel=1e-8)
