"""The command calibrate: a table, the netlist with what was found, a picture, mistakes."""

import json
import tomllib
from math import exp, pi
from pathlib import Path

import pytest
from calls import called

NETLIST = """
[parts]
wall = { is = "Fixed" }
oil = { is = "Damper", d = "0.5 N.m.s/rad" }
wheel = { is = "Inertia", J = "2 kg.m2", phi = 0, w = "50 rad/s" }
brake = { is = "Brake", capacity = "10 N.m" }  # what is to be found

[series]
drive = ["wall", "oil", "wheel", "brake"]

[simulate]
until = "4 s"
"""
FREE = ["--free", "brake.capacity=5:30 N.m", "--free", "oil.d=0.05:1"]
TORQUE, DAMPING, INERTIA, BEGIN = 14.0, 0.3, 2.0, 50.0


@pytest.fixture
def drive(tmp_path: Path) -> list[str]:
    """A netlist and its measurement: w = (w0 + M/d)·exp(-d·t/J) - M/d, exactly."""
    (tmp_path / "rundown.toml").write_text(NETLIST)
    end = TORQUE / DAMPING
    rows = [f"{t / 4},{((BEGIN + end) * exp(-DAMPING * t / 4 / INERTIA) - end) * 30 / pi!r}" for t in range(1, 13)]
    (tmp_path / "measured.csv").write_text("\n".join(["time,wheel.w [rpm]", *rows]) + "\n")
    return [str(tmp_path / "rundown.toml"), "--data", str(tmp_path / "measured.csv")]


def test_what_was_measured_is_found(drive: list[str], tmp_path: Path) -> None:
    fitted, picture = tmp_path / "fitted.toml", tmp_path / "ellipses.png"
    result = called(["calibrate", *drive, *FREE, "-o", str(fitted), "--plot", str(picture)])
    assert result.exit_code == 0, result.stderr
    parts = tomllib.loads(fitted.read_text())["parts"]
    assert parts["brake"]["capacity"] == pytest.approx(TORQUE, rel=1e-4)
    assert parts["oil"]["d"] == pytest.approx(DAMPING, rel=1e-4)
    assert "# what is to be found" in fitted.read_text()
    assert picture.read_bytes().startswith(b"\x89PNG")
    tables = json.loads(called(["calibrate", *drive, *FREE, "--json"]).stdout)["tables"]
    assert [row["unit"] for row in tables["calibrated"]] == ["N.m", "N.m.s/rad"]


MISTAKES = {
    "no data": (
        FREE,
        """A calibration needs data, at least one parameter, and at least one start.
Write calibrate(drive, [Trajectories("meas.csv")], {"clutch.mu": (0.1, 0.5)}), or on the command line --data meas.csv --free clutch.mu=0.1:0.5.
""",  # noqa: E501 as it is told
    ),
    "one parameter has no ellipse": (
        ["--data", "measured.csv", "--free", "oil.d=0.05:1", "--plot", "ellipse.png"],
        """The data determine 1 of 1 parameters: there is no pair to draw.
print() of the result has the intervals.
""",
    ),
    "no bounds": (
        ["--data", "measured.csv", "--free", "oil.d=1"],
        """'oil.d=1': '1' is not LOW:HIGH.
Write for example 'clutch.capacity=20:120 N.m'.
""",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes(drive: list[str], tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words, message = MISTAKES[name]
    result = called(["calibrate", "rundown.toml", *words])
    assert result.exit_code == 2
    assert result.stderr == message
    assert drive
