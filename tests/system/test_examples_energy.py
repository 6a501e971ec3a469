"""The energy balance of every example closes to 1e-8 of its throughput."""

from pathlib import Path

import pytest

from modelica_like import load, simulate

ROOT = Path(__file__).parents[2] / "examples"
# Not drives: design checks, and systems of FMUs.
NETLISTS = sorted(path for path in ROOT.rglob("*.toml") if not {"sizing", "cosim"} & set(path.parts))


@pytest.mark.parametrize("path", NETLISTS, ids=lambda path: str(path.relative_to(ROOT).with_suffix("")))
def test_energy_closes(path: Path) -> None:
    drive = load(path)
    run = simulate(drive, None if "until" in drive.simulate else 2.0)
    assert run.energy().closure <= 1e-8
