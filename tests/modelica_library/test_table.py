"""Each class of the table against its own text: the component is what the class says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from library_references import LIBRARY
from table_drives import Drive, drive_text, drives

from modelica_like import simulate
from modelica_like.netlist.modelica.classes import with_libraries
from modelica_like.netlist.modelica.library import known_classes
from modelica_like.netlist.modelica.read import read_modelica
from modelica_like.netlist.modelica.written import Written

pytestmark = pytest.mark.skipif(not LIBRARY.is_dir(), reason="the standard library's text is not here")
SAME = 1e-6
"""Of a column's largest value: the runs have a tolerance of 1e-10, which a second of such drives multiplies by less."""
POINTS = 488
BESIDE = 2e-6
"""Time around an instant in s in which a row does not count: both runs locate it to their own tolerance."""
OTHERWISE = {
    r"ElastoBacklash2?\(; ends|Gearbox\(.*ends": (
        r"(dut|at)[._]heatPort\.|dut\.internalHeatPort\.|dut\.lossyGear\.mode",
        "What a fast separation leaves in the spring is lost here, and does not go to the heat port there.",
    ),
    r"Sources\.Position\(exact": (r"dut\.[wv]$", "It is a dummy there: zero, though the end moves."),
    r".*": (r"dut\.mode$", "A component numbers its modes in its own way; no text may name it."),
}  # fmt: skip
"""Columns that are meant to differ, by the drive, and why."""
NOT_COMPARED = {
    r"Vehicle\(; ends": "A wind that changes goes through a filter of 50 Hz there, which the component does not have.",
    r"LossyGear\(\)|Gearbox\(b = 0; ends": "The text's friction does not settle here.",
    r"DCMachines\.": "The text does not start here: the block of its armature is singular.",
}
"""Drives whose text does not run here, or is another law."""


FROM_THE_TEXT = r"Gearbox\(; ends|Integrator\(; ends|VariableResistor\(; ends"
"""Drives whose component cannot be what they say: both runs are of the text, which tells that it may be read so."""


def _is_compared(drive: Drive) -> bool:
    return not any(re.search(pattern, str(drive)) for pattern in NOT_COMPARED)


def _rows(time: np.ndarray) -> dict[int, int]:
    """Return the rows of the equidistant times at which nothing happens, by their number."""
    rows: dict[int, int] = {}
    for k, moment in enumerate(np.linspace(0, 1, POINTS + 1)[1:]):
        near = np.flatnonzero(np.abs(time - moment) < BESIDE)
        if len(near) == 1:
            rows[k] = int(near[0])
    return rows


def distances(drive: Drive, folder: Path) -> dict[str, float]:
    """Return how far a run with the table is from one of the class's own text, in parts of each column's size."""
    file = folder / "drive.mo"
    file.write_text(drive_text(drive), encoding="utf-8")
    runs: list[Any] = []
    for table in (True, False):
        with with_libraries([LIBRARY]):
            model, _ = read_modelica(file, table=table)
        from_text = not table or re.search(FROM_THE_TEXT, str(drive)) is not None
        assert isinstance(model.find("dut"), Written) == from_text
        runs.append(simulate(model, 1.0, points=POINTS, rtol=1e-10))
    ours, text = runs
    rows = [_rows(run.time) for run in runs]
    both = sorted(rows[0].keys() & rows[1].keys())
    assert len(both) > 0.9 * POINTS
    known, result = known_classes()[drive.path], dict[str, float]()
    for name in text.names:
        here = f"dut.{known.here(name[4:])}" if name.startswith("dut.") else name
        if here in ours.names:
            values = np.asarray(text[name], float)[[rows[1][k] for k in both]]
            other = np.asarray(ours[here], float)[[rows[0][k] for k in both]]
            result[name] = float(np.abs(values - other).max() / max(np.abs(values).max(), 1e-3))
    return result


@pytest.mark.slow  # 250 drives: half a minute
@pytest.mark.parametrize("drive", [drive for drive in drives() if _is_compared(drive)], ids=str)
def test_a_class_and_its_component_are_the_same(drive: Drive, tmp_path: Path) -> None:
    apart = distances(drive, tmp_path)
    assert any(name.startswith("dut.") for name in apart) or len(apart) > 7
    for pattern, (columns, _) in OTHERWISE.items():
        if re.search(pattern, str(drive)):
            apart = {name: distance for name, distance in apart.items() if not re.match(columns, name)}
    assert {name: distance for name, distance in apart.items() if distance > SAME} == {}


def test_every_class_has_a_drive_that_compares_its_component() -> None:
    names = {d.path for d in drives() if _is_compared(d) and not re.search(FROM_THE_TEXT, str(d))}
    assert {path.rpartition(".")[2] for path in known_classes().keys() - names} == {
        "DC_PermanentMagnet", "DC_ElectricalExcited",
    }  # fmt: skip


def test_what_is_not_compared_is_there() -> None:
    for pattern in (*NOT_COMPARED, *OTHERWISE):
        assert any(re.search(pattern, str(drive)) for drive in drives()), pattern
