"""Reference FMUs against IDAS: two independent ways to the same trajectory.

The reference FMUs know nothing of the project. They are compared with the netlists of the same systems: 1e-6 of each
signal's range where both are smooth, 1e-6 s for the times of the events.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from math import pi
from pathlib import Path

import numpy as np
import pytest

from modelica_like import Solution, simulate
from modelica_like.fmi.run import run_fmu
from modelica_like.show.report.compare import compare

EXAMPLES = Path(__file__).parents[2] / "examples"
WITHIN = 1e-6
POINTS = 500

Built = Mapping[tuple[str, str], Path]

# Document 000: the geared drive, its clutch sized by the document's formula.
_spindle_side = 0.007 + 0.016 + 500 * (0.015 / (2 * pi)) ** 2
GEARED = {
    "motor.w_fixed": 48 * pi,
    "gear.ratio": 0.24,
    "gear_input.J": 0.014,
    "gear_output.J": 0.007,
    "clutch.capacity": (0.004 + 0.014 + _spindle_side / 0.24**2) * 48 * pi / 0.2 + 15 / 0.24,
}


@dataclass(frozen=True)
class Case:
    """A reference FMU, the netlist of the same system, and the number of mode changes after the start."""

    fmu: str
    netlist: str
    events: int
    kinds: tuple[str, ...] = ("cs",)
    parameters: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.netlist


CASES = [
    Case("machine_table", "machine_table_direct", 1),
    Case("machine_table", "machine_table_geared", 1, parameters=GEARED),
    Case("torsional_startup", "machine_tool_startup", 3),
    Case("dc_bench", "dc_bench", 3),
    Case("ravigneaux", "ravigneaux", 1),
    Case("two_mass", "two_mass", 0, ("cs", "me")),
    Case("stick_slip", "stick_slip", 9, ("cs", "me")),
]
RUNS = [(case, version, kind) for case in CASES for version in ("2.0", "3.0") for kind in case.kinds]


@cache
def by_idas(netlist: str) -> Solution:
    return simulate(EXAMPLES / f"{netlist}.toml", points=POINTS, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(("case", "version", "kind"), RUNS, ids=lambda value: str(value))
def test_agrees_with_idas(case: Case, version: str, kind: str, reference_fmus: Built) -> None:
    theirs = run_fmu(
        reference_fmus[case.fmu, version], parameters=case.parameters, kind=kind, points=POINTS, tolerance=1e-10,
    )  # fmt: skip
    comparison = compare(by_idas(case.netlist), theirs)
    assert not comparison.interpolated
    expected = set(theirs.model.position) - {"clutch.loss_power", "limit"}
    assert {row.signal for row in comparison.deviations} == {name for name in expected if not name.startswith("der(")}
    assert comparison.largest <= WITHIN
    assert len(comparison.events) == case.events
    assert comparison.largest_event_difference <= WITHIN


def test_machine_table_is_the_document(reference_fmus: Built) -> None:
    """Document 000 in full precision: lock-up after 0.2 s, 5452.8196 J of slip energy, 0.15 m of travel."""
    run = run_fmu(reference_fmus["machine_table", "2.0"])
    assert [event.time for event in run.events] == pytest.approx([0.2], abs=1e-9)
    assert run.energy()["clutch"].lost == pytest.approx(5452.8196, rel=1e-7)
    assert run.at(0.2)["table.s"] == pytest.approx(0.15, rel=1e-9)
    assert run.final["clutch.tau"] == -15.0


# Document 001 for 1000/min and 100 N.m: exact torques in N.m, speeds in 1/min, rolling powers in W.
EXACT = {
    "carrier.w": 350 * pi / 30,
    "machine.w": 577.5 * pi / 30,
    "planets.small_sun.tau": 100.0,
    "planets.large_sun.tau": 73.16017,
    "planets.ring.tau": -173.16017,
    "planets.small.rolling_power": 6806.784,
    "planets.large.rolling_power": -2681.460,
}


def test_ravigneaux_is_the_document(reference_fmus: Built) -> None:
    final = run_fmu(reference_fmus["ravigneaux", "3.0"]).final
    for name, value in EXACT.items():
        assert final[name] == pytest.approx(value, rel=1e-6), name


def test_torques_of_the_planetary_set_are_in_balance(reference_fmus: Built) -> None:
    run = run_fmu(reference_fmus["ravigneaux", "2.0"])
    total = sum(run[f"planets.{shaft}.tau"] for shaft in ("small_sun", "large_sun", "carrier", "ring"))
    np.testing.assert_allclose(total, 0.0, atol=1e-9)


def test_torsional_startup_meets_the_documents_targets(reference_fmus: Built) -> None:
    """Document 003 with its primary reading: lock-up at 0.2655 s; largest torques of the shafts and the clutch."""
    run = run_fmu(reference_fmus["torsional_startup", "2.0"], points=20_000)
    assert run.events[-1].time == pytest.approx(0.2655, rel=1e-3)
    for name, peak in {"shaft0": 437.0, "shaft1": 494.83, "shaft2": 552.81, "clutch": 604.89}.items():
        assert -run[f"{name}.tau"].min() == pytest.approx(peak, rel=1e-3), name


@pytest.mark.parametrize("step", [1e-6, 3.7e-4, 0.5])
def test_two_mass_does_not_depend_on_the_communication_step(step: float, reference_fmus: Built) -> None:
    """The closed form is exact for any step."""
    stop = min(0.5, 1000 * step)
    final = run_fmu(reference_fmus["two_mass", "3.0"], stop=stop, step=step).final
    whole = run_fmu(reference_fmus["two_mass", "3.0"], stop=stop, step=stop).final
    for name in ("J1.phi", "J1.w", "shaft.tau"):
        assert final[name] == pytest.approx(whole[name], rel=1e-9), name


def test_stick_slip_repeats_itself(reference_fmus: Built) -> None:
    """Closed form for Fs = 8 N, Fk = 5 N: it sticks for 2·(Fs - Fk)/(c·v), it slides for (2·pi - 2·atan(3))/omega."""
    run = run_fmu(reference_fmus["stick_slip", "2.0"])
    times = np.array([event.time for event in run.events])
    sticking, sliding = 2 * 3.0 / (100.0 * 0.1), (2 * pi - 2 * np.arctan(3.0)) / 10.0
    assert times[0] == pytest.approx(0.8, abs=1e-9)
    np.testing.assert_allclose(np.diff(times)[0::2], sliding, atol=1e-9)
    np.testing.assert_allclose(np.diff(times)[1::2], sticking, atol=1e-9)


def test_builds_from_the_command_line(tmp_path: Path) -> None:
    import subprocess
    import sys

    script = Path(__file__).parents[2] / "fmus" / "build.py"
    command = [sys.executable, str(script), "two_mass", "--output", str(tmp_path)]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    assert [Path(line).name for line in told] == ["two_mass_fmi2.fmu", "two_mass_fmi3.fmu"]
    assert all(Path(line).exists() for line in told)
