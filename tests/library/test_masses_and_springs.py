"""Masses, springs and dampers against their closed forms."""

from math import exp, pi, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from components import (
    ConstantForce,
    ConstantTorque,
    Damper,
    ElastoBacklash,
    ElastoBacklash2,
    Fixed,
    Inertia,
    LinearSpeedDependentForce,
    Mass,
    QuadraticSpeedDependentForce,
    Spring,
    SpringDamper,
    TranslationalDamper,
    TranslationalFixed,
    TranslationalSpring,
    TranslationalSpringDamper,
)
from modelica_like import Assembly, Component, simulate

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def shaft(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def test_inertia_under_constant_torque() -> None:
    run = simulate(shaft(torque=ConstantTorque(tau_constant=3.0), mass=Inertia(J=2.0, phi=0.5, w=-1.0)), "2 s", **TIGHT)
    np.testing.assert_allclose(run["mass.w"], -1.0 + 1.5 * run.time, atol=1e-9)
    np.testing.assert_allclose(run["mass.phi"], 0.5 - run.time + 0.75 * run.time**2, atol=1e-9)


def test_mass_under_constant_force() -> None:
    run = simulate(shaft(force=ConstantForce(f_constant=-3.0), mass=Mass(m=2.0, s=0.5, v=1.0)), "2 s", **TIGHT)
    np.testing.assert_allclose(run["mass.v"], 1.0 - 1.5 * run.time, atol=1e-9)
    np.testing.assert_allclose(run["mass.s"], 0.5 + run.time - 0.75 * run.time**2, atol=1e-9)


@pytest.mark.parametrize(("law", "brakes"), [(LinearSpeedDependentForce, 1.5), (QuadraticSpeedDependentForce, 2.25)])
def test_a_drag_brakes_in_both_directions(law: Any, brakes: float) -> None:
    """10 N at 2 m/s on 4 kg at ±3 m/s: 1.5 or 1.5² times as much, against the motion."""
    for v in (-3.0, 3.0):
        run = simulate(shaft(drag=law(f_nominal=-10.0, v_nominal=2.0), mass=Mass(m=4.0, s=0.0, v=v)), 0.1)
        assert run["der(mass.v)"][0] == pytest.approx(-np.sign(v) * brakes * 10.0 / 4.0, rel=1e-12)


@pytest.mark.parametrize("at", [0.0, 0.7])
def test_fixed_is_where_it_is(at: float) -> None:
    rotation = simulate(shaft(fixed=Fixed(phi0=at), spring=Spring(c=2.0), mass=Inertia(J=1.0, phi=at, w=0.0)), "1 s")
    slide = simulate(
        shaft(fixed=TranslationalFixed(s0=at), spring=TranslationalSpring(c=2.0), mass=Mass(m=1.0, s=at, v=0.0)), "1 s"
    )
    assert np.all(rotation["fixed.flange.phi"] == at)
    np.testing.assert_allclose(rotation["mass.phi"], at, atol=1e-12)
    np.testing.assert_allclose(slide["mass.s"], at, atol=1e-12)


def oscillation(t: Any, c: float, d: float, J: float, x0: float) -> Any:
    """Free oscillation from rest: (deflection, speed)."""
    decay, w0 = d / (2 * J), sqrt(c / J)
    w = sqrt(w0**2 - decay**2)
    envelope = x0 * np.exp(-decay * t)
    return envelope * (np.cos(w * t) + decay / w * np.sin(w * t)), -envelope * w0**2 / w * np.sin(w * t)


@pytest.mark.parametrize(("d", "rest"), [(0.0, 0.0), (0.4, 0.0), (3.0, 0.2)])
def test_free_oscillation(d: float, rest: float) -> None:
    c, J, x0 = 40.0, 0.5, 0.3
    turning: dict[float, Component] = {0.0: Spring(c=c, phi_rel0=rest)}
    sliding: dict[float, Component] = {0.0: TranslationalSpring(c=c, s_rel0=rest)}
    drive = shaft(
        wall=Fixed(),
        spring=turning.get(d, SpringDamper(c=c, d=d, phi_rel0=rest)),
        mass=Inertia(J=J, phi=rest + x0, w=0.0),
    )
    slide = shaft(
        wall=TranslationalFixed(),
        spring=sliding.get(d, TranslationalSpringDamper(c=c, d=d, s_rel0=rest)),
        mass=Mass(m=J, s=rest + x0, v=0.0),
    )
    for run, angle, speed, torque in (
        (simulate(drive, "2 s", **TIGHT), "mass.phi", "mass.w", "spring.tau"),
        (simulate(slide, "2 s", **TIGHT), "mass.s", "mass.v", "spring.f"),
    ):
        x, v = oscillation(run.time, c, d, J, x0)
        np.testing.assert_allclose(run[angle], rest + x, atol=1e-8)
        np.testing.assert_allclose(run[speed], v, atol=1e-7)
        np.testing.assert_allclose(run[torque], c * x + d * v, atol=1e-6)


def test_damper_brings_the_speed_down_exponentially() -> None:
    drive = shaft(wall=Fixed(), damper=Damper(d=3.0), mass=Inertia(J=2.0, phi=0.0, w=10.0))
    slide = shaft(wall=TranslationalFixed(), damper=TranslationalDamper(d=3.0), mass=Mass(m=2.0, s=0.0, v=10.0))
    for run, speed in ((simulate(drive, "1 s", **TIGHT), "mass.w"), (simulate(slide, "1 s", **TIGHT), "mass.v")):
        np.testing.assert_allclose(run[speed], 10 * np.exp(-1.5 * run.time), rtol=1e-8)
        lost = 0.5 * 2.0 * 100 * (1 - exp(-3.0))
        assert run.energy()["damper"].lost == pytest.approx(lost, rel=1e-8)


@pytest.mark.parametrize("masses", [2, 3, 12])
def test_natural_frequencies_of_a_free_chain(masses: int) -> None:
    """A chain that starts in one of its modes stays in it; the mode k of a free-free chain is cos((j - 1/2)·k·pi/N)."""
    J, c, k = 0.2, 500.0, masses - 1
    shape = np.cos((np.arange(masses) + 0.5) * k * pi / masses)
    w = 2 * sqrt(c / J) * np.sin(k * pi / (2 * masses))
    parts: dict[str, Component] = {}
    for j in range(masses):
        parts[f"J{j}"] = Inertia(J=J, phi=shape[j], w=0.0)
        parts[f"c{j}"] = Spring(c=c)
    del parts[f"c{masses - 1}"]
    run = simulate(shaft(**parts), "0.2 s", **TIGHT)
    for j in range(masses):
        np.testing.assert_allclose(run[f"J{j}.phi"], shape[j] * np.cos(w * run.time), atol=1e-6)


# -- backlash ----------------------------------------------------------------------------------------------------------


def flank_torque(limited: bool, c: float, d: float, b: float, x: float, v: float) -> float:
    """The law of contact, written out by hand."""
    if abs(x) <= b / 2:
        return 0.0
    side = 1.0 if x > 0 else -1.0
    spring, damper = c * (abs(x) - b / 2), d * side * v
    if limited:
        damper = min(damper, spring)
    return side * max(0.0, spring + damper)


@pytest.mark.parametrize("kind", [ElastoBacklash, ElastoBacklash2])
@pytest.mark.parametrize("d", [0.0, 0.5, 8.0])
def test_backlash_against_scipy(kind: type[ElastoBacklash], d: float) -> None:
    c, b, J = 300.0, 0.4, 0.5
    drive = shaft(wall=Fixed(), gap=kind(c=c, d=d, b=b), mass=Inertia(J=J, phi=0.5, w=0.0))
    run = simulate(drive, "1 s", **TIGHT)

    def rates(t: float, y: Any) -> list[float]:
        return [y[1], -flank_torque(kind is ElastoBacklash, c, d, b, y[0], y[1]) / J]

    reference = solve_ivp(
        rates, (0, 1), [0.5, 0.0], "LSODA", rtol=1e-10, atol=1e-12, max_step=2e-4, t_eval=np.linspace(0, 1, 101)
    )
    for t, phi, w in zip(reference.t, *reference.y, strict=True):
        now = run.at(t)
        assert now["mass.phi"] == pytest.approx(phi, abs=2e-5)
        assert now["mass.w"] == pytest.approx(w, abs=2e-3)
    for x, v, tau in zip(run["gap.phi_rel"], run["gap.w_rel"], run["gap.tau"], strict=True):
        if abs(abs(x) - b / 2) < 1e-9:
            continue  # the damper of ElastoBacklash2 makes the torque jump where the flanks meet
        assert tau == pytest.approx(flank_torque(kind is ElastoBacklash, c, d, b, x, v), abs=1e-6 + 1e-8 * c)


@settings(max_examples=12, deadline=None)
@given(x=st.floats(-1, 1), v=st.floats(-30, 30), d=st.floats(0, 20), limited=st.booleans())
def test_flanks_never_pull_and_close_their_energy(x: float, v: float, d: float, limited: bool) -> None:
    kind = ElastoBacklash if limited else ElastoBacklash2
    drive = shaft(wall=Fixed(), gap=kind(c=300.0, d=d, b=0.4), mass=Inertia(J=0.5, phi=x, w=v))
    run = simulate(drive, "0.4 s", points=200)
    assert np.all(run["gap.tau"] * np.sign(run["gap.phi_rel"]) >= -1e-9)
    assert np.all(run["gap.loss_power"] >= -1e-6)
    assert run.energy().power_closure < 1e-8


def test_backlash_starts_on_the_flank_where_it_is() -> None:
    for angle, contact in ((0.5, "forward"), (0.0, "gap"), (-0.5, "backward")):
        run = simulate(
            shaft(wall=Fixed(), gap=ElastoBacklash(c=300.0, b=0.4), mass=Inertia(J=0.5, phi=angle, w=0.0)), "1 ms"
        )
        names = run.model.flat_discretes[run.model.discrete_position["gap.contact"]].names
        assert names[int(run["gap.contact"][0])] == contact


def test_a_hanging_mass_swings_about_its_weight() -> None:
    """2 kg on 50 N/m: it starts at the free length and swings by m·g/c about m·g/c below, with sqrt(c/m)."""
    parts = {
        "ceiling": TranslationalFixed(), "spring": TranslationalSpring(c=50.0),
        "mass": Mass(m=2.0, angle="-90 deg", g=9.81, s=0.0, v=0.0),
    }  # fmt: skip
    run = simulate(Assembly("hanging", parts=parts, series={"s": [*parts]}), 3.0, rtol=1e-10, atol=1e-12)
    deep = 2.0 * 9.81 / 50.0
    np.testing.assert_allclose(run["mass.s"], deep * (1 - np.cos(5.0 * run.time)), atol=1e-8)
    assert run.energy().imbalance == 0
    assert run.energy().stored == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("angle", [0.0, 5.0, -30.0])
def test_a_mass_rolls_down_its_slope(angle: float) -> None:
    run = simulate(Mass(m=3.0, angle=f"{angle} deg", s=0.0, v=0.0), 2.0, **TIGHT)
    assert run.final["v"] == pytest.approx(-2 * 9.80665 * np.sin(np.deg2rad(angle)), rel=1e-9)
    assert run.energy().stored == pytest.approx(0.0, abs=1e-6)
