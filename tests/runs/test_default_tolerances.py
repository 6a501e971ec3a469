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


@pytest.mark.slow
def test_variants_of_a_start_up() -> None:
    """Fourteen of document 003, with other parameters. One has an event where a step of the run-time just begins."""
    model = build(EXAMPLES / "machine_tool_startup.toml")
    source, asked = np.random.default_rng(3), ["peak(shaft1.tau)", "rms(shaft2.tau)", "loss_energy"]
    numbers = {one.path: value for one, value in zip(model.flat_parameters, model.p, strict=True)
               if value and str(one.unit) not in ("s", "1")}  # fmt: skip
    for _ in range(14):
        variant = model.with_parameters({name: x * source.uniform(0.7, 1.3) for name, x in numbers.items()})
        tight: Any = {"native": 1e-12, "idas": 1e-11}
        found = [simulate(variant, solver=one, rtol=rtol, readings=asked).read(*asked) for one, rtol in tight.items()]
        assert found[0] == pytest.approx(found[1], rel=1e-8)
