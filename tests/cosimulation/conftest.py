"""A two-mass oscillator, cut behind its shaft once for all tests."""

import sys
from pathlib import Path

import pytest

from modelica_like.fmi.cosimulation.split import Split, split

sys.path.insert(0, str(Path(__file__).parent))
EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="session")
def oscillator(tmp_path_factory: pytest.TempPathFactory) -> Split:
    """examples/two_mass.toml: `motor` has the torque, J1 and the shaft, `wheel` has J2."""
    folder = tmp_path_factory.mktemp("oscillator")
    return split(EXAMPLES / "two_mass.toml", "shaft", folder, names=("motor", "wheel"), check=False)
