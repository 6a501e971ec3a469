"""Elastic gear meshes against scipy, bearing friction under axial load by hand, and housings that carry reactions."""

from math import cos, exp, pi, radians, sin, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    BallScrew,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    DeepGrooveBearing,
    Differential,
    Fixed,
    GearMesh,
    Inertia,
    Mass,
    SpringDamper,
    TranslationalFixed,
    TranslationalSpringDamper,
    Vehicle,
)
from modelica_like import Assembly, Component, simulate

TIGHT = {"rtol": 1e-10, "atol": 1e-13}


@pytest.mark.slow
def test_waves_of_stiffness_and_error_as_scipy_has_them() -> None:
    """Lagrange's equations of V = c·(1 + ripple·cos(z·phi_a))·x²/2, with backlash and flanks that never pull."""
    z, r_a, r_b, c, d, ripple, b, e = 20, 0.03, 0.05, 1e7, 300.0, 0.3, 1e-5, 3e-6
    J_a, J_b, M_a, M_b = 2e-3, 6e-3, 10.0, -15.0

    def rates(t: float, y: Any) -> list[float]:
        phi_a, phi_b, w_a, w_b = y
        x = r_a * phi_a + r_b * phi_b - e * sin(z * phi_a)
        v = r_a * w_a + r_b * w_b - e * z * w_a * cos(z * phi_a)
        press = max(x - b / 2, 0) + min(x + b / 2, 0)
        elastic = c * (1 + ripple * cos(z * phi_a)) * press
        f = 0.0 if press == 0 else max(elastic + d * v, 0) if press > 0 else min(elastic + d * v, 0)
        wave = -0.5 * c * ripple * z * sin(z * phi_a) * press**2
        return [w_a, w_b, (M_a - f * (r_a - e * z * cos(z * phi_a)) - wave) / J_a, (M_b - f * r_b) / J_b]

    mesh = GearMesh(z_a=z, r_a=r_a, r_b=r_b, c=c, d=d, ripple=ripple, b=b, e=e)
    parts: dict[str, Component] = {
        "drive": ConstantTorque(tau_constant=M_a), "pinion": Inertia(J=J_a, phi=0.0, w=100.0), "mesh": mesh,
        "wheel": Inertia(J=J_b, phi=0.0, w=-60.0), "load": ConstantTorque(tau_constant=M_b),
    }  # fmt: skip
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 0.03, **TIGHT)
    reference = solve_ivp(
        rates, (0, 0.03), [0, 0, 100, -60], rtol=1e-10, atol=1e-13, max_step=2e-5, dense_output=True, method="DOP853"
    )
    for t in (0.005, 0.015, 0.03):
        found = [run.at(t)[name] for name in ("pinion.phi", "wheel.phi", "pinion.w", "wheel.w")]
        assert found == pytest.approx(list(reference.sol(t)), rel=1e-5)
    assert run.energy().power_closure < 1e-9
    assert np.min(run["mesh.loss_power"]) > -1e-9


def test_bearing_under_axial_load() -> None:
    bearing = DeepGrooveBearing(d=0.04, D=0.08, F_r=2000.0, F_a=500.0, C_0=19000.0, nu=20e-6, tau_seal=0.02)
    parts: dict[str, Component] = {"motor": ConstantSpeed(w_fixed=1000 * pi / 30), "bearing": bearing}
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 0.1, **TIGHT)
    slope = sin(radians(24.6 * (500 / 19000) ** 0.24))
    heating = 1 / (1 + 1.84e-9 * (1000 * 60) ** 1.28 * 20**0.64)
    starved = exp(-3e-8 * 20 * 1000 * 120 * sqrt(3.1 / 80))
    rolling = heating * starved * 3.9e-7 * 60**1.96 * (2000 + 1.7 * 500 / slope) ** 0.54 * 20000**0.6
    mixed = exp(-2.6e-8 * 20000**1.4 * 60)
    loads = (2000**5 + 36.5 * 60**1.5 * 500**4 / slope) ** (1 / 3)
    sliding = (0.15 * mixed + 0.05 * (1 - mixed)) * 3.23e-3 * 60**-0.145 * loads
    assert run.final["bearing.tau"] == pytest.approx(1e-3 * (rolling + sliding) + 0.02, rel=1e-9)


def mounted(part: Component, support: str, connect: dict[str, Any], parts: dict[str, Component]) -> Assembly:
    """A part whose housing turns on an elastic mount."""
    housing: dict[str, Component] = {
        "wall": Fixed(), "mount": SpringDamper(c=500.0, d=5.0), "housing": Inertia(J=0.5, phi=0.0, w=0.0),
    }  # fmt: skip
    return Assembly(
        "drive", parts={"part": part} | parts | housing, series={"mounting": list(housing)},
        connect=connect | {"carried": [f"part.{support}", "housing.flange_b"]},
    )  # fmt: skip


def test_housing_of_a_differential_carries_the_reaction_of_the_final_drive() -> None:
    drive = mounted(
        Differential(ratio=4.0), "support",
        {"d": ["motor.flange", "part.flange"], "l": ["part.left", "left.flange_a"],
         "r": ["part.right", "right.flange_a"]},
        {"motor": ConstantTorque(tau_constant=10.0), "left": Inertia(J=40.0, w=0.0, phi=0.0),
         "right": Inertia(J=40.0, w=0.0, phi=0.0)},
    )  # fmt: skip
    run = simulate(drive, 3.0, **TIGHT)
    # 10 N.m go in, 40 N.m come out: 30 N.m turn the housing back.
    assert run.final["mount.tau"] == pytest.approx(-30.0, rel=1e-5)
    assert run.energy().power_closure < 1e-10


def test_vehicle_and_screw_on_their_housings() -> None:
    car = Vehicle(m=1000.0, J=2.0, R=0.3, A=0.0, Cr=0.0, s=0.0, v=0.0)
    run = simulate(
        mounted(car, "support", {"d": ["motor.flange", "part.flange_r"]}, {"motor": ConstantTorque(tau_constant=90.0)}),
        15.0, **TIGHT,
    )  # fmt: skip
    assert run.final["mount.tau"] == pytest.approx(90 * 1000 / (1000 + 2 / 0.09), rel=1e-4)
    assert run.energy().power_closure < 1e-10
    parts: dict[str, Component] = {
        "push": ConstantForce(f_constant=-400.0), "table": Mass(m=20.0, s=0.0, v=0.0),
        "guide": TranslationalSpringDamper(c=1e6, d=1e4), "bed": TranslationalFixed(),
        "rail": Mass(m=5.0, s=0.0, v=0.0), "hand": ConstantTorque(tau_constant=0.8),
    }  # fmt: skip
    connect = {
        "n": ["part.flange_t", "table.flange_a"], "f": ["table.flange_b", "push.flange"],
        "s": ["part.flange_r", "hand.flange"], "g": ["part.support_t", "rail.flange_a"],
        "r": ["rail.flange_b", "guide.flange_b"], "b": ["guide.flange_a", "bed.flange"],
    }  # fmt: skip
    run = simulate(mounted(BallScrew(lead=0.01), "support_r", connect, parts), 1.0, **TIGHT)
    assert run.energy().power_closure < 1e-9
    force = 0.8 * 2 * pi / 0.01
    # The nut pushes the table forwards, so its guide is pushed backwards.
    assert run.final["guide.f"] == pytest.approx(-force, rel=1e-6)
