"""The systems of the documents at default tolerances: within 1e-6 of the other integrator at tight ones."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import build, simulate

EXAMPLES = Path(__file__).parents[2] / "examples"
SYSTEMS = ("machine_table_direct", "machine_table_geared", "machine_tool_startup", "machine_tool_backlash",
           "machine_tool_magnet", "dc_bench", "winch", "lepelletier")  # fmt: skip
ALLOWED = 1e-6


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in SYSTEMS[3:] else []) for n in SYSTEMS]
)
def test_readings_at_default_tolerances(name: str, solver: Any) -> None:
    """A step of a Rosenbrock method of order five and a backward differentiation formula share nothing."""
    model = build(EXAMPLES / f"{name}.toml")
    loads = [one.path for one in model.flat_variables if str(one.unit) in ("N.m", "N") and not one.hidden][:6]
    asked = [f"{kind}({load})" for load in loads for kind in ("peak", "rms")] + ["loss_energy", "source_energy"]
    other: Any = "native" if solver == "idas" else "idas"
    tight = np.array(simulate(model, solver=other, rtol=1e-11, atol=1e-13, readings=asked).read(*asked), float)
    usual = np.array(simulate(model, solver=solver, readings=asked).read(*asked), float)
    sizes = np.maximum(np.abs(tight), ALLOWED * np.abs(tight).max())
    np.testing.assert_array_less(np.abs(usual - tight) / sizes, ALLOWED)
