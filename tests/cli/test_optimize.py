"""The command optimize: tables, the netlist of the best, pictures, exit codes."""

import tomllib
from math import pi
from pathlib import Path

import pytest
from calls import called

DIRECT = str(Path(__file__).parents[2] / "examples" / "machine_table_direct.toml")
ASKED = ["--minimize", "clutch.capacity", "--free", "clutch.capacity=40:300 N.m"]
BEST = (0.02 + 500.0 * (0.015 / (2 * pi)) ** 2) * 200 * pi / 0.25 + 15.0
"""The torque that locks in 0.25 s: J w/t and the load."""


def test_the_best_as_a_table_and_a_netlist(tmp_path: Path) -> None:
    best, picture = tmp_path / "best.toml", tmp_path / "way.png"
    limit = ["--subject-to", "clutch.lock_time <= 0.25 s"]
    result = called(["optimize", DIRECT, *ASKED, *limit, "-o", str(best), "--plot", str(picture)])
    assert result.exit_code == 0, result.stderr
    assert "'clutch.lock_time <= 0.25 s' is active: with 1 s more" in result.stdout
    data = tomllib.loads(best.read_text())
    number, unit = data["parts"]["clutch"]["capacity"].split()
    assert (float(number), unit) == (pytest.approx(BEST, rel=1e-6), "N.m")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_front_is_drawn_and_is_no_netlist(tmp_path: Path) -> None:
    words = ["optimize", DIRECT, *ASKED, "--minimize", "clutch.lock_time", "--points", "3"]
    picture = tmp_path / "front.png"
    result = called([*words, "--plot", str(picture)])
    assert result.exit_code == 0, result.stderr
    assert "front of 3 designs" in result.stdout
    assert picture.read_bytes().startswith(b"\x89PNG")
    result = called([*words, "-o", str(tmp_path / "best.toml")])
    assert result.exit_code == 2
    assert result.stderr.startswith("A front is no single design to write.")


def test_one_design_may_be_the_best_in_both_objectives() -> None:
    words = ["--minimize", "clutch.lock_time", "--minimize", "clutch.loss_energy", "--points", "3"]
    result = called(["optimize", DIRECT, *words, "--free", "clutch.capacity=60:300 N.m"])
    assert "front of 1 designs" in result.stdout
    assert "This design is the best in both objectives." in result.stdout


def test_a_wrong_bound_is_told() -> None:
    result = called(["optimize", DIRECT, "--minimize", "clutch.tau", "--free", "clutch.capacity=40"])
    assert result.exit_code == 2
    assert result.stderr.startswith("'clutch.capacity=40': '40' is not LOW:HIGH.")


def test_limits_that_cannot_be_met_end_with_one() -> None:
    limits = ["--subject-to", "clutch.lock_time <= 0.05 s", "--subject-to", "clutch.capacity <= 100 N.m"]
    result = called(["optimize", DIRECT, *ASKED, *limits])
    assert result.exit_code == 1
    assert "The limits cannot all be met" in result.stdout
