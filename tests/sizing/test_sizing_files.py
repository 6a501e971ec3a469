"""Sizing files: all examples with their published numbers, loads from simulations, verdicts and exit codes."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from components.sizing import shaft_stress
from modelica_like.analyse.sizing import Sizing, load_of, size
from modelica_like.errors import UnknownName
from modelica_like.simulation import simulate

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples" / "sizing").glob("*.toml"))
EXCEEDED = {"test_bench": 2, "test_bench_motor": 2}
# Where the document errs by more than rounding: check, line, deviation in per cent.
ERRORS = {
    ("test_bench", "flywheel_aluminium", "inertia"): 49.765,
    ("test_bench", "flywheel_aluminium", "width"): 49.787,
    ("test_bench", "flywheel_steel", "inertia"): 54.336,
    ("test_bench", "flywheel_steel", "width"): 54.558,
    ("test_bench", "flywheel_built", "mass"): 6.183,
    ("test_bench_motor", "contradiction", "friction"): -3.636,
}


@pytest.fixture(scope="module", params=EXAMPLES, ids=lambda path: path.stem)
def sizing(request: pytest.FixtureRequest) -> Sizing:
    return size(request.param)


def test_published_numbers(sizing: Sizing) -> None:
    for check in sizing.checks:
        for line in check.published:
            expected = ERRORS.get((sizing.name, check.name, line))
            deviation = 100 * check.deviation(line)
            if expected is None:
                assert abs(deviation) < 2.0, (check.name, line)
            else:
                assert deviation == pytest.approx(expected, abs=1e-3)


def test_limits(sizing: Sizing) -> None:
    assert sizing.exceeded == EXCEEDED.get(sizing.name, 0)


def run(*arguments: str, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "modelica_like", "size", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=60)


def test_command_tells_verdicts_and_exit_code() -> None:
    fine = run("examples/sizing/machine_table.toml")
    assert (fine.returncode, fine.stderr) == (0, "")
    assert "clutch_torque           86.7843  N.m         86.63   +0.178 %" in fine.stdout
    assert "direct and geared drive" in fine.stdout
    assert fine.stdout.rstrip().endswith("4 checks, no limit is exceeded.")
    not_fine = run("examples/sizing/test_bench_motor.toml")
    assert not_fine.returncode == 1
    assert "above the limit 1500 rpm by 16.67 rpm (1.11 %)" in not_fine.stdout
    assert not_fine.stdout.rstrip().endswith("2 limits are exceeded.")


def test_command_lists_and_describes_checks() -> None:
    listed = run()
    assert listed.returncode == 0
    assert "bearing_life" in listed.stdout
    described = run("bearing_life")
    assert "dynamic_rating" in described.stdout
    assert "dynamic load rating C in N." in described.stdout
    unknown = run("bearing_live")
    assert unknown.returncode == 2
    assert unknown.stderr.startswith("There is no design check 'bearing_live'; did you mean 'bearing_life'?")


SHAFT = """
[parameters]
drive = "6000 rpm"
half = "torque/2"
torque = { from = "drive.toml", peak = "clutch.tau" }
[checks.shaft]
is = "shaft_stress"
bending = "0.5*torque"
torque = "torque"
diameter = "20 mm"
yield_strength = "275 N/mm2"
limits = { safety = { min = 1.5 }, torsional_stress = { max = "60 N/mm2" } }
[checks.work]
is = "flywheel"
width = "shaft.diameter"
radius = "shaft.diameter*2 + 5*shaft.diameter/5"
density = 7850
torque = { from = "drive.toml", rms = "clutch.tau", until = "0.1 s" }
speed = "drive"
"""


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    text = (ROOT / "examples" / "machine_table_direct.toml").read_text()
    (tmp_path / "drive.toml").write_text(text)
    return tmp_path


def test_load_from_a_simulation(drive: Path) -> None:
    (drive / "shaft.toml").write_text(SHAFT)
    made = size(drive / "shaft.toml")
    assert made["shaft"].torque == pytest.approx(86.78432, rel=1e-6)
    assert made["shaft"].bending == pytest.approx(86.78432 / 2, rel=1e-6)
    assert made["work"].radius == pytest.approx(0.06)
    inertia = made["work"].inertia
    assert made["work"].switching_time == pytest.approx(inertia * 200 * math.pi / 86.78432, rel=1e-6)
    assert made.exceeded == 0


def test_variant_of_a_simulation(drive: Path) -> None:
    table = '{ from = "drive.toml", peak = "clutch.tau", set = { acceleration_time = "0.4 s" } }'
    text = SHAFT.replace('{ from = "drive.toml", peak = "clutch.tau" }', table)
    (drive / "shaft.toml").write_text(text)
    assert size(drive / "shaft.toml")["shaft"].torque == pytest.approx(71.78432 / 2 + 15, rel=1e-6)


def trapezoids(values: np.ndarray, times: np.ndarray) -> float:
    return float(np.sum(np.diff(times) * (values[1:] + values[:-1]) / 2))


def test_load_from_a_solution() -> None:
    """In Python: the peak torque of a run loads a shaft, the integral of its loss is the friction work."""
    solution = simulate(ROOT / "examples" / "machine_table_direct.toml")
    torque = load_of(solution, "clutch.tau")
    assert torque == pytest.approx(86.78432, rel=1e-6)
    stress = shaft_stress(0.0, torque, 0.032, 275e6)
    assert stress.safety == pytest.approx(275e6 / (math.sqrt(3) * 16 * 86.78432 / (math.pi * 0.032**3)), rel=1e-6)
    assert load_of(solution, "clutch.loss_power", "integral") == pytest.approx(5452.82, rel=1e-3)
    assert load_of(solution, "clutch.tau", "final") == pytest.approx(-15.0, rel=1e-4)
    assert load_of(solution, "spindle.w", "smallest") == pytest.approx(0.0, abs=1e-9)
    assert load_of(solution, "spindle.w", "largest") == pytest.approx(200 * math.pi, rel=1e-6)
    times, speeds = solution.time, solution["spindle.w"]
    assert load_of(solution, "spindle.w", "mean") == pytest.approx(trapezoids(speeds, times) / 0.4)
    assert load_of(solution, "spindle.w", "rms") == pytest.approx(math.sqrt(trapezoids(speeds**2, times) / 0.4))
    with pytest.raises(UnknownName, match="cannot be the 'peek' of a trajectory; did you mean 'peak'"):
        load_of(solution, "clutch.tau", "peek")
