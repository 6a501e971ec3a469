"""FMUs of drives with loops against the exact solver."""

import pytest
from exact_drives import run_exactly
from random_drives import assembly, random_drive
from test_small_drives import SMALL

from modelica_like.fmi.export import export_fmu
from modelica_like.fmi.run import run_fmu

LOOPS = {name: SMALL[name] for name in ("parallel clutches", "ring of three clutches", "clutch beside a freewheel")}
# Of 23 the start leaves out a row that depends on the others; all of 59 is held, and its speeds are rounding.
DRIVES = LOOPS | {str(number): random_drive(number) for number in (23, 59)}
STILL = 1e-9
"""Speed in rad/s of a drive that stands still."""


@pytest.mark.parametrize("name", DRIVES)
def test_both_kinds_end_at_the_exact_speeds(name, tmp_path):
    drive = DRIVES[name]
    exact, product = run_exactly(drive), assembly(drive)
    product.simulate.update(start="rest", until=drive.until)
    fmu = export_fmu(product, tmp_path / "drive.fmu", "3.0", check=False).path
    largest = max(exact.largest)
    for kind in ("cs", "me"):
        run = run_fmu(fmu, kind=kind, tolerance=1e-9)
        final = [run.final[f"J{k}.w"] for k in range(len(drive.J))]
        assert final == pytest.approx(exact.final, rel=0.0, abs=1e-6 * largest + STILL), kind
