"""Best designs that textbooks derive: bang-bang control, motion profiles, absorbers, safety of a shaft."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from modelica_like import linearize, load, optimize, save_report, tolerance
from modelica_like.analyse.optimize.result import Optimum
from modelica_like.netlist import loads

FORCES = """
[parts]
first = { is = "ForceStep", step_force = "high * 1 N" }
second = { is = "ForceStep", step_force = "(low - high) * 1 N", start_time = "turn" }
third = { is = "ForceStep", step_force = "-low * 1 N", start_time = "end" }
mass = { is = "Mass", m = "1 kg", s = 0, v = 0 }
[connect]
all = ["first.flange", "second.flange", "third.flange", "mass.flange_a"]
[simulate]
until = "4 s"
[parameters]
high = 0.7
low = -0.9
turn = "1.2 s"
end = "2.5 s"
"""
TRAPEZOID = """
[parameters]
f = "5 N"
ramp = "0.3 s"
[parts]
first = { is = "ForceStep", step_force = "f" }
second = { is = "ForceStep", step_force = "-f", start_time = "ramp" }
third = { is = "ForceStep", step_force = "-f", start_time = "2 s - ramp" }
fourth = { is = "ForceStep", step_force = "f", start_time = "2 s" }
mass = { is = "Mass", m = "1 kg", s = 0, v = 0 }
[connect]
all = ["first.flange", "second.flange", "third.flange", "fourth.flange", "mass.flange_a"]
[simulate]
until = "2.5 s"
"""
ABSORBER = """
[parts]
torque = { is = "ConstantTorque", tau_constant = "0 N.m" }
wall = { is = "Fixed" }
spring = { is = "Spring", c = "4000 N.m/rad" }
shaft = { is = "Inertia", J = "0.1 kg.m2", phi = 0, w = 0 }
absorber = { is = "TunedAbsorber", J = "0.02 kg.m2", f = "20 Hz", D = 0.1, phi_rel = 0, w_rel = 0 }
[series]
shaken = ["wall", "spring", "shaft", "absorber"]
[connect]
drive = ["torque.flange", "shaft.flange_b"]
"""
BRAKE = """
sizing = "checks.toml"
[parts]
wheel = { is = "Inertia", J = "2 kg.m2", phi = 0, w = "50 rad/s" }
brake = { is = "Brake", capacity = "20 N.m" }
[series]
drive = ["wheel", "brake"]
[simulate]
until = "20 s"
[optimize]
minimize = "brake.lock_time"
free = { "brake.capacity" = ["5 N.m", "100 N.m"] }
"""
CHECKS = """
[checks.shaft]
is = "shaft_stress"
bending = "0 N.m"
torque = { from = "brake.toml", peak = "brake.tau" }
diameter = "10 mm"
yield_strength = "275 N/mm2"
required_safety = 2.5
"""
GAIN = "resonance(torque.tau_constant, shaft.phi, {})"


def optimum(*arguments: object, **more: object) -> Optimum:
    result = optimize(*arguments, **more)  # type: ignore[arg-type]
    assert isinstance(result, Optimum)
    return result


def test_the_fastest_motion_is_bang_bang() -> None:
    """A mass moves by s with at most ±F from rest to rest in 2·√(m·s/F), with full force each half of the way."""
    best = optimum(
        loads(FORCES), minimize="end", subject_to=["mass.s == 1 m", "mass.v == 0 m/s"],
        free={"high": [-1, 1], "low": [-1, 1], "turn": ["0.1 s", "1.9 s"], "end": ["1.91 s", "3.9 s"]},
    )  # fmt: skip
    assert best.values == pytest.approx({"high": 1.0, "low": -1.0, "turn": 1.0, "end": 2.0}, abs=1e-7)
    assert best.limits[0].price == pytest.approx(1.0, rel=1e-5)
    assert "*" not in str(best).split()


def test_the_trapezoid_of_least_loss_has_equal_thirds() -> None:
    """The loss 2·F²·t falls while the way F·t·(T - t)/m is kept: t = T/3, whence F = 4.5·m·s/T²."""
    forces = " + ".join(f"{name}.flange.f" for name in ("first", "second", "third", "fourth"))
    free = {"f": ["0.1 N", "50 N"], "ramp": ["0.1 s", "0.9 s"]}
    best = optimum(loads(TRAPEZOID), minimize=f"integral(({forces})**2)", free=free, subject_to="mass.s == 1 m")
    assert best.values == pytest.approx({"f": 4.5 / 4.0, "ramp": 2.0 / 3.0}, rel=1e-6)
    assert best.objectives[0].value == pytest.approx(2.0 * 1.125**2 * 2.0 / 3.0, rel=1e-6)


def test_the_best_absorber() -> None:
    """Exact optimum after O. Nishihara and T. Asami (2002); the fixed points of J. P. Den Hartog come near it.

    Both peaks of the shaft's vibration are as low as they can be together.
    """
    drive, mu = loads(ABSORBER), 0.2
    root, own = math.sqrt(4.0 + 3.0 * mu), math.sqrt(4000.0 / 0.1) / (2.0 * math.pi)
    inside = (
        2.0 * (16.0 + 23.0 * mu + 9.0 * mu**2 + 2.0 * (2.0 + mu) * root) / (3.0 * (64.0 + 80.0 * mu + 27.0 * mu**2))
    )
    tuned = {
        "absorber.f": 2.0 / (1.0 + mu) * math.sqrt(inside) * own,
        "absorber.D": 0.25 * math.sqrt((8.0 + 9.0 * mu - 4.0 * root) / (1.0 + mu)),
    }
    free = {"absorber.f": ["15 Hz", "40 Hz"], "absorber.D": [0.02, 0.5]}
    best = optimum(drive, minimize=f"max({GAIN.format(1)}, {GAIN.format(2)})", free=free)
    assert best.values == pytest.approx(tuned, rel=1e-6)
    hartog = {"absorber.f": own / (1.0 + mu), "absorber.D": math.sqrt(3.0 * mu / (8.0 * (1.0 + mu)))}
    assert best.values == pytest.approx(hartog, rel=1e-2)


def test_the_fixed_points_of_an_absorber() -> None:
    """With f = f0/(1 + µ) the response at two frequencies has the same height √(1 + 2/µ)/c whatever the damping."""
    mu, own = 0.2, math.sqrt(4000.0 / 0.1) / (2.0 * math.pi)
    roots = [math.sqrt((1.0 + sign * math.sqrt(mu / (2.0 + mu))) / (1.0 + mu)) for sign in (-1.0, 1.0)]
    gains = [f"gain(torque.tau_constant, shaft.phi, {own * root!r} Hz)" for root in roots]
    best = optimum(loads(ABSORBER), minimize=f"max({gains[0]}, {gains[1]})", free={"absorber.f": ["15 Hz", "40 Hz"]})
    assert best["absorber.f"] == pytest.approx(own / (1.0 + mu), rel=1e-6)
    assert best.objectives[0].value == pytest.approx(math.sqrt(1.0 + 2.0 / mu) / 4000.0, rel=1e-6)


def test_a_resonance_that_is_not_numbered_is_the_highest() -> None:
    """A single mass: the peak is 1/(2·D·√(1 - D²)) of the static displacement."""
    text = ABSORBER.replace('"Spring", c = "4000 N.m/rad"', '"SpringDamper", c = "4000 N.m/rad", d = "4 N.m.s/rad"')
    text = text.replace('"shaft", "absorber"', '"shaft"')
    drive = loads("\n".join(line for line in text.splitlines() if not line.startswith("absorber")))
    name = "resonance(torque.tau_constant, shaft.phi)"
    best = optimum(drive, minimize="spring.d", free={"spring.d": ["1 N.m.s/rad", "20 N.m.s/rad"]},
                   subject_to=f"{name} <= 0.001 rad/(N.m)", until=0.1)  # fmt: skip
    damping = best["spring.d"] / (2.0 * math.sqrt(4000.0 * 0.1))
    assert 1.0 / (2.0 * damping * math.sqrt(1.0 - damping**2)) == pytest.approx(4.0, rel=1e-6)
    heights = abs(linearize(best.model, inputs=["torque.tau_constant"], outputs=["shaft.phi"]).response([20, 30, 40]))
    assert heights.max() <= 0.001


def test_a_design_check_limits_a_design(tmp_path: Path) -> None:
    """Torsion √3·16·M/(π·d³) of at most 275/2.5 N/mm²; the wheel stops after J·w/M."""
    (tmp_path / "checks.toml").write_text(CHECKS)
    (tmp_path / "brake.toml").write_text(BRAKE + 'subject_to = ["shaft.safety >= 2.5"]\n')
    most = 275e6 / 2.5 / math.sqrt(3.0) * math.pi * 0.01**3 / 16.0
    best = optimum(load(tmp_path / "brake.toml"))
    assert best["brake.capacity"] == pytest.approx(most, rel=1e-6)
    assert best.objectives[0].value == pytest.approx(100.0 / most, rel=1e-6)
    # The time is 100 s·N·m/M and the safety M1/M, so that 1 more of the safety takes 100/M1 s more.
    assert best.limits[0].price == pytest.approx(100.0 / (2.5 * most), rel=1e-5)
    least = optimum(load(tmp_path / "brake.toml"), maximize="shaft.safety", subject_to="brake.lock_time <= 10 s")
    assert least["brake.capacity"] == pytest.approx(10.0, rel=1e-6)
    assert least["shaft.safety"] == pytest.approx(2.5 * most / 10.0, rel=1e-6)


def test_a_design_check_scatters(tmp_path: Path) -> None:
    """The safety is K/M, and M anywhere within 10 %: its mean is K/M ln(1.1/0.9)/0.2, 1 % of all are above 1.098 M."""
    (tmp_path / "checks.toml").write_text(CHECKS)
    (tmp_path / "brake.toml").write_text(BRAKE)
    drive, scatter = load(tmp_path / "brake.toml"), {"brake.capacity": "±10 %"}
    yields = 275e6 / math.sqrt(3.0) * math.pi * 0.01**3 / 16.0
    result = tolerance(drive, "shaft.safety", scatter, subject_to="shaft.safety >= 1.5", precision=0.005)
    spread, (limit,) = result["shaft.safety"], result.limits
    assert spread.linear_sigma == pytest.approx(yields / 20.0 * 0.2 / math.sqrt(12.0), rel=1e-6)
    assert spread.mean == pytest.approx(yields / 20.0 * math.log(1.1 / 0.9) / 0.2, rel=1e-4)
    assert (spread.low, spread.high) == pytest.approx((yields / 22.0, yields / 18.0), rel=1e-6)
    assert limit.value == pytest.approx((22.0 - yields / 1.5) / 4.0, abs=0.005)
    best = optimum(drive, subject_to="P(shaft.safety >= 2.5) >= 99 %", tolerances=scatter)
    assert best["brake.capacity"] == pytest.approx(yields / 2.5 / 1.098, rel=1e-3)


def test_checks_that_nobody_asks_for_do_not_count(tmp_path: Path) -> None:
    """Neither one whose load has a run of its own, nor a file with an error: the wheel stops after J·w/M = 4 s."""
    (tmp_path / "brake.toml").write_text(BRAKE + 'subject_to = ["brake.lock_time <= 4 s"]\n')
    own = CHECKS.replace('peak = "brake.tau"', 'peak = "brake.tau", until = "1 s"').replace(
        "checks.shaft", "checks.short"
    )
    for text in (CHECKS + own, "this is no table"):
        (tmp_path / "checks.toml").write_text(text)
        best = optimum(load(tmp_path / "brake.toml"), minimize="brake.capacity")
        assert best["brake.capacity"] == pytest.approx(25.0, rel=1e-6)


def test_only_loads_that_a_line_takes_are_differentiated(tmp_path: Path) -> None:
    """A load that stands at a kink of another check has no derivative, and needs none."""
    kink = CHECKS.replace("checks.shaft", "checks.other").replace(
        'peak = "brake.tau"', 'reading = "at(brake.tau, 5 s)"'
    )
    (tmp_path / "checks.toml").write_text(kink + CHECKS)  # at 5 s the wheel of the drive as it is stops
    (tmp_path / "brake.toml").write_text(BRAKE + 'subject_to = ["shaft.safety >= 2.5"]\n')
    most = 275e6 / 2.5 / math.sqrt(3.0) * math.pi * 0.01**3 / 16.0
    assert optimum(load(tmp_path / "brake.toml"))["brake.capacity"] == pytest.approx(most, rel=1e-6)


def test_a_page_about_the_best_design(tmp_path: Path) -> None:
    """It has the values, the limits, the sentences and the runs before and after."""
    (tmp_path / "checks.toml").write_text(CHECKS)
    (tmp_path / "brake.toml").write_text(BRAKE + 'subject_to = ["shaft.safety >= 2.5", "max(brake.tau) <= 90 N.m"]\n')
    best = optimum(load(tmp_path / "brake.toml"))
    assert best.simulate(before=True)["brake.capacity"][-1] == pytest.approx(20.0)
    save_report(best.best_drive(), best.simulate(), tmp_path / "best.html", optimum=best)
    page = (tmp_path / "best.html").read_text(encoding="utf-8")
    section = page.split("<h2>Best design</h2>")[1].split("</section>")[0]
    for text in (
        "brake.capacity",
        "12.4699",
        "shaft.safety &gt;= 2.5",
        "is active",
        "Before and after",
        f"{best.runs} runs",
    ):
        assert text in section, text
    assert section.count("data:image/svg+xml;base64,") == 2
