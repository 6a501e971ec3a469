"""Document 001: the Ravigneaux set in second gear, mesh by mesh, and its other gears.

Expected are the recomputed values of the project's TARGETS, where all of the document's numbers are checked.
"""

from functools import cache
from math import pi
from pathlib import Path

import pytest

from components.sizing import RavigneauxTeeth, ravigneaux_meshes
from components.sizing.ravigneaux_shafts import ShaftTorques
from modelica_like import CompiledDae, Solution, build, simulate
from modelica_like.netlist import load

NETLIST = Path(__file__).parents[2] / "examples" / "ravigneaux.toml"
TEETH = RavigneauxTeeth(21, 39, 13, 10, 60)
SHAFTS = ("small_sun", "large_sun", "carrier", "ring")
ELEMENTS = ("clutch_small", "clutch_large", "clutch_carrier", "brake_large", "brake_carrier")
GEARS = {
    "1": ("clutch_small", "brake_carrier"), "2": ("clutch_small", "brake_large"), "3": ("clutch_small", "clutch_large"),
    "overdrive": ("clutch_carrier", "brake_large"), "R": ("clutch_large", "brake_carrier"),
}  # fmt: skip
RPM = pi / 30


@cache
def model(mesh_efficiency: float = 1.0) -> CompiledDae:
    drive = load(NETLIST)
    if mesh_efficiency < 1:
        drive.set("planets.losses", True)
        drive.set("planets.mesh_efficiency", mesh_efficiency)
    return build(drive)


@cache
def in_gear(gear: str, mesh_efficiency: float = 1.0) -> Solution:
    closed = {f"{name}.f_normalized": float(name in GEARS[gear]) for name in ELEMENTS}
    return simulate(model(mesh_efficiency), parameters=closed)


# -- second gear: the table of TARGETS, 1 ------------------------------------------------------------------------------

SPEEDS = [("small_sun.w", 1000.0), ("large_sun.w", 0.0), ("carrier.w", 350.0), ("machine.w", 577.5)]


@pytest.mark.parametrize(("path", "expected"), SPEEDS)
def test_speeds_in_second_gear(path: str, expected: float) -> None:
    assert in_gear("2").final[path] / RPM == pytest.approx(expected, rel=1e-9, abs=1e-9)


TORQUES = [
    ("planets.small.sun", 100.0), ("planets.small.ring", -285.7143), ("planets.small.carrier", 185.7143),
    ("planets.large.carrier", -185.7143), ("planets.large.sun", 73.16017), ("planets.large.ring", 112.5541),
    ("planets.ring", -173.1602), ("planets.small_sun", 100.0), ("planets.large_sun", 73.16017),
]  # fmt: skip


@pytest.mark.parametrize(("path", "expected"), TORQUES)
def test_torques_in_second_gear(path: str, expected: float) -> None:
    assert in_gear("2").final[f"{path}.tau"] == pytest.approx(expected, rel=1e-6)


def test_carrier_idles_in_second_gear() -> None:
    assert in_gear("2").final["planets.carrier.tau"] == pytest.approx(0.0, abs=1e-9)


POWERS = [("small", 6.806784e3), ("large", -2.68146e3), ("long_planet", 3 * 1.375108e3)]


@pytest.mark.parametrize(("part", "expected"), POWERS)
def test_rolling_powers_in_second_gear(part: str, expected: float) -> None:
    assert in_gear("2").final[f"planets.{part}.rolling_power"] == pytest.approx(expected, rel=1e-6)


def test_power_flow_and_ratio_in_second_gear() -> None:
    run = in_gear("2").final
    assert -run["motor.flange.tau"] * run["motor.w"] == pytest.approx(10.47198e3, rel=1e-6)
    assert run["planets.ring.tau"] * run["machine.w"] == pytest.approx(-10.47198e3, rel=1e-6)
    assert run["motor.w"] / run["machine.w"] == pytest.approx(1.731602, rel=1e-6)


# mesh, torque, speed and power of its pinion: TARGETS' recomputed values of the document's table
MESHES = [
    ("small sun – short planet", 20.63492, 1050.0, 2.268928e3),
    ("short planet – long planet", 15.87302, 1365.0, 2.268928e3),
    ("long planet – ring", 9.62001, 1365.0, 1.375108e3), ("large sun – long planet", 6.253006, 1365.0, 0.8938201e3),
]  # fmt: skip


@pytest.mark.parametrize(("mesh", "torque", "speed", "power"), MESHES)
def test_meshes_in_second_gear(mesh: str, torque: float, speed: float, power: float) -> None:
    """The planets do not exist in the model: their speeds and torques follow from the run and the numbers of teeth."""
    run = in_gear("2").final
    short = -run["planets.small.w_rel"] * TEETH.small_sun / TEETH.short_planet
    long = -short * TEETH.short_planet / TEETH.long_planet
    assert -long == pytest.approx(run["planets.large.w_rel"] * TEETH.large_sun / TEETH.long_planet, rel=1e-9)
    rolling = run["planets.small.rolling_power"], run["planets.large.rolling_power"]
    torques = ShaftTorques(*(run[f"planets.{shaft}.tau"] for shaft in SHAFTS))
    rows = {row.mesh: row for row in ravigneaux_meshes(TEETH, torques, rolling, (short, long))}
    assert rows[mesh].torque == pytest.approx(torque, rel=1e-6)
    assert rows[mesh].speed / RPM == pytest.approx(speed, rel=1e-6)
    assert rows[mesh].power == pytest.approx(power, rel=1e-6)
    assert rows[mesh].torque * rows[mesh].speed == pytest.approx(rows[mesh].power, rel=1e-9)


# -- other gears -------------------------------------------------------------------------------------------------------

OUTPUT = [("1", 350.0), ("2", 577.5), ("3", 1000.0), ("overdrive", 1650.0), ("R", -650.0)]


@pytest.mark.parametrize(("gear", "speed"), OUTPUT)
def test_all_gears(gear: str, speed: float) -> None:
    run = in_gear(gear)
    assert run.final["machine.w"] / RPM == pytest.approx(speed, rel=1e-7)
    torques = [run.final[f"planets.{shaft}.tau"] for shaft in SHAFTS]
    assert sum(torques) == pytest.approx(0.0, abs=1e-9)
    small, large, carrier, ring = torques
    assert ring == pytest.approx(-(60 / 21 * small - 60 / 39 * large), rel=1e-9)
    assert ring * run.final["machine.w"] == pytest.approx(
        run.final["motor.flange.tau"] * run.final["motor.w"], rel=1e-7
    )
    assert run.energy().power_closure < 1e-9


def test_direct_gear_does_not_roll() -> None:
    run = in_gear("3").final
    for part in ("small", "large", "long_planet"):
        assert run[f"planets.{part}.rolling_power"] == pytest.approx(0.0, abs=1e-9)


# -- losses ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("mesh", "efficiency"), [(0.99, 0.98069), (0.985, 0.97119), (0.98, 0.96177)])
def test_efficiency_in_second_gear(mesh: float, efficiency: float) -> None:
    run = in_gear("2", mesh).final
    power_in, power_out = -run["motor.flange.tau"] * run["motor.w"], -run["planets.ring.tau"] * run["machine.w"]
    assert power_out / power_in == pytest.approx(efficiency, abs=5e-6)


def test_torques_with_losses() -> None:
    """Per 100 N·m at the small sun, mesh efficiency 0.99: TARGETS' torque-exact values."""
    run = in_gear("2", 0.99).final
    scale = 100.0 / run["planets.small_sun.tau"]
    assert run["planets.large_sun.tau"] * scale == pytest.approx(69.817, abs=5e-4)
    assert run["planets.ring.tau"] * scale == pytest.approx(-169.817, abs=5e-4)


def test_direct_gear_has_no_losses() -> None:
    run = in_gear("3", 0.98).final
    assert run["planets.ring.tau"] == pytest.approx(run["motor.flange.tau"], rel=1e-9)


def test_losses_close_the_energy_balance() -> None:
    balance = in_gear("2", 0.98).energy()
    assert balance.power_closure < 1e-9
    assert sum(balance[f"planets.{part}"].lost for part in ("small", "large", "long_planet")) > 0
