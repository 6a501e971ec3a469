"""Exported FMUs against the reference FMUs: 1e-6 of each signal's range, 1e-6 s for the events."""

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import pytest

from modelica_like import Solution
from modelica_like.fmi.export import export_fmu
from modelica_like.fmi.run import run_fmu
from modelica_like.show.report.compare import compare

EXAMPLES = Path(__file__).parents[2] / "examples"
WITHIN = 1e-6
POINTS = 500
# CVode controls the error of a step, not of a run; over nine events of stick-slip it adds up.
TOLERANCE = {"me": 1e-11, "cs": 1e-9}

Built = Mapping[tuple[str, str], Path]
PAIRS = {
    "machine_table": "machine_table_direct",
    "torsional_startup": "machine_tool_startup",
    "dc_bench": "dc_bench",
    "ravigneaux": "ravigneaux",
    "two_mass": "two_mass",
    "stick_slip": "stick_slip",
}


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Path]:
    folder = tmp_path_factory.mktemp("exports")

    @cache
    def export(netlist: str, version: str) -> Path:
        path = folder / f"{netlist}_{version[0]}.fmu"
        return export_fmu(EXAMPLES / f"{netlist}.toml", path, version, check=False).path

    return export


@pytest.fixture(scope="module")
def truth(reference_fmus: Built) -> Callable[[str], Solution]:
    @cache
    def run(name: str) -> Solution:
        return run_fmu(reference_fmus[name, "2.0"], points=POINTS)

    return run


@pytest.mark.parametrize("kind", ["me", "cs"])
@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("name", PAIRS)
def test_agrees_with_the_reference_fmu(
    name: str, version: str, kind: str, exported: Callable[[str, str], Path], truth: Callable[[str], Solution]
) -> None:
    ours = run_fmu(exported(PAIRS[name], version), kind=kind, points=POINTS, tolerance=TOLERANCE[kind])
    comparison = compare(truth(name), ours)
    assert not comparison.interpolated
    assert len(comparison.deviations) >= 5
    assert comparison.largest <= WITHIN, comparison.deviations[0]
    assert comparison.largest_event_difference <= WITHIN, comparison.events
