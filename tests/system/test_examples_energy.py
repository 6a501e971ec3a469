"""The energy balance of every example closes to 1e-8 of its throughput, component by component."""

from pathlib import Path

import numpy as np
import pytest
from some import some

from modelica_like import load, simulate

ROOT = Path(__file__).parents[2] / "examples"
# Not drives: design checks, and systems of FMUs.
NETLISTS = sorted(path for path in ROOT.rglob("*.toml") if not {"sizing", "cosim"} & set(path.parts))


@pytest.mark.parametrize("path", some(NETLISTS, lambda path: str(path.relative_to(ROOT).with_suffix(""))))
def test_energy_closes(path: Path) -> None:
    drive = load(path)
    run = simulate(drive, None if "until" in drive.simulate else 2.0)
    balance = run.energy()
    assert balance.power_closure <= 1e-8
    for row in balance:
        assert abs(row.residual) <= 1e-8 * balance.throughput, row
        losses = run[f"{row.component}.loss_power"]
        assert np.min(losses) >= -1e-8 * max(1.0, np.max(losses)), row.component
