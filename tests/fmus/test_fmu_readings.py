"""Readings of runs of FMUs and of tables: closed forms, whatever the step; what results cannot tell is refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from components import Clutch, Fixed, Inertia, SpringDamper
from modelica_like import Assembly, cosim, export_fmu, run_fmu
from modelica_like.errors import MissingValue
from modelica_like.runs.results import SETTLED
from modelica_like.show.report.sources import trajectories

AMPLITUDE, OMEGA, END = 0.3, 20.0, 1.7
LARGEST = 2e3 * AMPLITUDE
"""N.m: c A"""


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """phi = A cos(w t) without damping; a brake of 4 N.m stops 2 kg.m2 from 10 rad/s, after 5 s."""
    swing = {"wall": Fixed(), "spring": SpringDamper(c=2e3, d=0.0), "mass": Inertia(J=5.0, phi=AMPLITUDE, w=0.0)}
    brake = {"disk": Inertia(J=2.0, w=10.0, phi=0.0), "brake": Clutch(capacity=4.0), "housing": Fixed()}
    drive = Assembly("both", parts=swing | brake, series={"left": [*swing], "right": [*brake]})
    path = tmp_path_factory.mktemp("fmu") / "both.fmu"
    export_fmu(drive, path)
    return path


def closed_forms() -> dict[str, tuple[float, float]]:
    """Values and sizes, by the integrals of powers of cosines."""
    sine = math.sin(OMEGA * END) / OMEGA
    square = END / 2 + math.sin(2 * OMEGA * END) / (4 * OMEGA)
    return {
        "peak(spring.tau)": (LARGEST, LARGEST),
        "max(spring.tau)": (LARGEST, LARGEST),
        "min(mass.w)": (-AMPLITUDE * OMEGA, AMPLITUDE * OMEGA),
        "integral(spring.tau)": (LARGEST * sine, LARGEST * END),
        "mean(spring.tau)": (LARGEST * sine / END, LARGEST),
        "rms(spring.tau)": (LARGEST * math.sqrt(square / END), LARGEST),
        "at(spring.tau, 0.1 s)": (LARGEST * math.cos(0.1 * OMEGA), LARGEST),
        "first(spring.tau < -100 N.m)": (math.acos(-100 / LARGEST) / OMEGA, END),
        "max(abs(spring.tau) - 100 N.m)": (LARGEST - 100, LARGEST),
        "integral(spring.tau**2)": (LARGEST**2 * square, LARGEST**2 * END),
        "mass.phi": (AMPLITUDE * math.cos(OMEGA * END), AMPLITUDE),
    }


@pytest.mark.parametrize("points", [7, pytest.param(500, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["cs", "me"])
def test_closed_forms_of_an_oscillation(fmu: Path, kind: Any, points: int) -> None:
    expected = closed_forms()
    run = run_fmu(fmu, stop=END, kind=kind, points=points, tolerance=1e-9, readings=[*expected])
    assert len(run.time) == points + 1
    for name, (value, size) in expected.items():
        number = run.readings[name]
        assert number == pytest.approx(value, abs=SETTLED * size), name
        assert number.change <= SETTLED * size
    assert run.read("peak(spring.tau)")[0].unit == "N.m"
    with pytest.raises(MissingValue, match="between its results nothing is known"):
        run.read("peak(mass.w)")


@pytest.mark.parametrize("kind", ["cs", "me"])
def test_modes_of_an_fmu(fmu: Path, kind: Any) -> None:
    expected = {
        "time(brake.mode -> stuck)": 5.0,
        "duration(brake.mode: stuck)": 1.0,
        "mean(disk.w)": 25 / 6,
        "first(disk.w < 5 rad/s)": 2.5,
    }
    run = run_fmu(fmu, stop=6.0, kind=kind, points=9, readings=[*expected])
    for name, value in expected.items():
        assert run.readings[name] == pytest.approx(value, rel=SETTLED), name


def test_a_table_is_straight_lines_between_its_rows(tmp_path: Path) -> None:
    path = tmp_path / "measured.csv"
    path.write_text("time,x [N.m]\n0,0\n1,4\n1,-6\n3,0\n")
    names = ["max(x)", "peak(x)", "integral(x)", "rms(x)", "first(x < -3 N.m)", "at(x, 0.25 s)", "max(abs(x - 1 N.m))"]
    found = trajectories(path).read(*names)
    squares = 16 / 3 + 2 * 36 / 3
    np.testing.assert_allclose(found, [4, 6, -4, math.sqrt(squares / 3), 1, 1, 7], rtol=1e-9)
    assert (found[1].time, found[1].sign) == (1.0, -1)


@pytest.mark.slow
def test_a_system_of_fmus_reads_like_one(fmu: Path, tmp_path: Path) -> None:
    system = tmp_path / "system.toml"
    system.write_text(f'name = "alone"\n[fmus]\nboth = "{fmu.as_posix()}"\n[simulate]\nuntil = "{END} s"\n')
    expected = {f"{name[:-1].replace('(', '(both.', 1)})": value for name, value in (
        ("peak(spring.tau)", LARGEST), ("min(mass.w)", -AMPLITUDE * OMEGA),
    )}  # fmt: skip
    run = cosim(system, step=0.05, fmu_tolerance=1e-9, readings=[*expected])
    for name, value in expected.items():
        assert run.readings[name] == pytest.approx(value, abs=SETTLED * abs(value)), name
    with pytest.raises(MissingValue, match=r"Ask before the run: cosim\(…, readings=\[…\]\)"):
        run.read("peak(both.mass.w)")
    brake = {"first(both.disk.w < 5 rad/s)": 2.5, "mean(both.disk.w)": 25 / 6}
    run = cosim(system, 6.0, step=0.5, readings=[*brake])
    assert run.read(*brake) == pytest.approx([*brake.values()], rel=2 * SETTLED)
