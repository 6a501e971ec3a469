"""Inputs over time, against the integral of the force by hand."""

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from calls import called

from modelica_like import simulate
from modelica_like.netlist import loads
from modelica_like.show.report.run import notices
from modelica_like.simulation import Solver

PUSHED = """name = "pushed"
[parts]
push = { is = "Force" }
mass = { is = "Mass", m = 2, s = 0, v = 0 }
[connect]
end = ["push.flange", "mass.flange_a"]
"""
TIMES = [0.0, 1.0]
RAMP: dict[str, Any] = {
    "pairs": {"push.f": [(0, 0), (1, 6)]},
    "an array": {"push.f": np.array([[0.0, 0.0], [1.0, 6.0]])},
    "two arrays": {"push.f": (np.array([0.0, 1.0]), np.array([0.0, 6.0]))},
    "a unit": {"push.f [kN]": [(0, 0), (1, 0.006)]},
    "columns": {"time": TIMES, "push.f": [0, 6]},
    "milliseconds": {"time [ms]": [0, 1000], "push.f": [0, 6]},
    "a series": {"push.f": pd.Series([0.0, 6.0], index=TIMES)},
    "an array of xarray": {"push.f": xr.DataArray([0.0, 6.0], {"time": TIMES}, "time")},
    "its units": {
        "push.f": xr.DataArray([0, 6000], {"time": ("time", [0, 1000], {"units": "ms"})}, "time", attrs={"units": "mN"})
    },
    "a data set": xr.Dataset({"push.f": ("time", [0.0, 6.0])}, {"time": TIMES}),
    "a table": pd.DataFrame({"time": TIMES, "push.f [N]": [0.0, 6.0]}),
    "a table over time": pd.DataFrame({"push.f": [0.0, 6.0]}, index=TIMES),
}


@pytest.mark.parametrize("solver", get_args(Solver))
@pytest.mark.parametrize("form", RAMP)
def test_a_ramp_that_holds_its_last_value(form: str, solver: Solver) -> None:
    """6 N/s up to 1 s and 6 N from then on push 2 kg: v(1 s) = 1.5 m/s, v(2 s) = 4.5 m/s."""
    run = simulate(loads(PUSHED), "2 s", inputs=RAMP[form], solver=solver, points=4)
    assert run.at(1.0)["mass.v"] == pytest.approx(1.5, rel=1e-7)
    assert run.final["mass.v"] == pytest.approx(4.5, rel=1e-7)
    told = [notice.partition(" s ")[2] for notice in notices(run)]
    assert told == ["push_f_over_time has no more rows: its last value holds."]


def test_a_number_and_a_quantity_are_constant() -> None:
    for force in (3, "3 N", "0.003 kN"):
        assert simulate(loads(PUSHED), 2, inputs={"push.f": force}).final["mass.v"] == pytest.approx(3.0, rel=1e-9)


def test_an_exposed_input_is_driven_inside(tmp_path: Path) -> None:
    """Of a drive as it is exported; a value that was given for the input gives way."""
    text = PUSHED.replace('"Force" }', '"Force", f = 7 }') + '[expose]\nforce = "push.f"\n'
    assert simulate(loads(text), 2, inputs={"force": 3}).final["mass.v"] == pytest.approx(3.0, rel=1e-9)


def test_from_a_file_of_a_spreadsheet(tmp_path: Path) -> None:
    (tmp_path / "drive.toml").write_text(PUSHED)
    (tmp_path / "force.csv").write_bytes("time [ms];push.f [kN]\r\n0;0\r\n1000;0,006\r\n".encode("utf-16"))
    run = simulate(tmp_path / "drive.toml", 2, inputs=tmp_path / "force.csv")
    assert run.final["mass.v"] == pytest.approx(4.5, rel=1e-7)
    words = ["simulate", str(tmp_path / "drive.toml"), "--until", "2s", "--inputs", str(tmp_path / "force.csv")]
    result = called([*words, "--csv", str(tmp_path / "run.csv")])
    assert result.exit_code == 0
    assert "push_f_over_time has no more rows" in result.stdout + result.stderr
    names, *rows = (line.split(",") for line in (tmp_path / "run.csv").read_text().splitlines())
    assert float(rows[-1][names.index("mass.v")]) == pytest.approx(4.5, rel=1e-6)


def test_the_drive_itself_stays_as_it_is() -> None:
    drive = loads(PUSHED)
    simulate(drive, 1, inputs={"push.f": 3})
    assert [*drive.parts] == ["push", "mass"]
