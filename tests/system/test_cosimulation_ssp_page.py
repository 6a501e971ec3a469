"""The code of docs/cosimulation_ssp.md runs, and its numbers are what comes out."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp

from modelica_like import cosim, simulate

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "cosimulation_ssp.md"


def test_the_numbers_of_the_page(page: tuple[str, dict[str, Any], Path]) -> None:
    """The energy through the shaft is what the wheel has got."""
    text, names, _ = page
    printed = re.search(r"```text\n(.*) rad/s, (.*) J through the shaft\n```", text)
    assert printed is not None
    speed, energy = map(float, printed.groups())
    assert names["run"]["J2.w"][-1] == pytest.approx(speed, abs=0.006)
    assert energy == pytest.approx(0.08 / 2 * speed**2, abs=0.02)
    assert names["run"].couplings[0].throughput == pytest.approx(energy, abs=0.006)


def test_the_table_of_importers(page: tuple[str, dict[str, Any], Path]) -> None:
    """The row of 0.1 ms; what ecos does is compared with FMPy in tests/cosimulation/test_ssp.py."""
    text, _, folder = page
    end, step, path = 0.2, 1e-4, folder / "two_mass.ssp"
    whole = simulate(ROOT / "examples" / "two_mass.toml", until=end, rtol=1e-10, points=20_000)
    runs = [
        simulate_ssp(str(path), stop_time=end - step / 2, step_size=step)["wheel.J2_flange_a.w"],
        *(cosim(path, end, step=step, inputs=inputs, outputs=["J2.w"])["J2.w"][1:] for inputs in ("linear", "hold")),
    ]
    truth = np.interp(step * np.arange(1, round(end / step) + 1), whole.time, whole["J2.w"])
    errors = [float(np.abs(run - truth).max() / np.ptp(whole["J2.w"])) for run in runs]
    row = re.search(r"\| 0.1 ms \| (.*) \| (.*) \| (.*) \| (.*) \|", text)
    assert row is not None
    fmpy, ecos, linear, held = map(float, row.groups())
    assert [fmpy, linear, held] == pytest.approx(errors, rel=0.05)
    assert ecos == fmpy
