"""Reading a variable evaluates that variable, in blocks of bounded size."""

import time
import tracemalloc

import numpy as np
import pytest

from components import Damper, Inertia, Spring, TorqueStep
from modelica_like import Assembly, Solution, simulate
from modelica_like.compile.compiled import CompiledDae
from modelica_like.solve import reading, solution


def drive() -> Assembly:
    parts = {
        "push": TorqueStep(step_torque=2.0, start_time=0.3), "J1": Inertia(J=0.5, phi=0.0, w=1.0),
        "spring": Spring(c=40.0), "J2": Inertia(J=0.2, phi=0.0, w=0.0), "oil": Damper(d=0.3),
        "J3": Inertia(J=0.4, w=0.0),
    }  # fmt: skip
    return Assembly("drive", parts=parts, series={"s": list(parts)})


@pytest.fixture(scope="module")
def run() -> Solution:
    return simulate(drive(), 1.0, points=1000, start="rest")


NAMES = ["J1.w", "spring.tau", "J3.flange_a.tau", "der(J1.w)", "oil.loss_power", "spring.stored_energy", "push.mode"]


@pytest.mark.parametrize("block", [7, 64, 5000])
def test_blocks_and_single_variables_give_what_the_whole_table_gives(
    run: Solution, monkeypatch: pytest.MonkeyPatch, block: int
) -> None:
    names = [name for name in NAMES if name in run or name.endswith(("power", "energy"))]
    whole = {name: run[name] for name in names}
    monkeypatch.setattr(reading, "_BLOCK", block)
    monkeypatch.setattr(solution, "TOGETHER", 0)
    single = Solution(run.model, run.options, run.segments, run.events, run.statistics)
    for name in names:
        np.testing.assert_allclose(single[name], whole[name], rtol=1e-13, atol=1e-13)
    together = single.together(*run.names, "oil.loss_power")
    assert list(together) == [*run.names, "oil.loss_power"]
    for name, values in together.items():
        np.testing.assert_allclose(values, run[name], rtol=1e-13, atol=1e-13)


def test_one_variable_of_a_long_run_needs_little_memory_and_time() -> None:
    """A million results: 8 MB for the values, a few more for a block; all variables would be 300 MB."""
    short = simulate(drive(), 1.0, points=1000, start="rest")
    segment = short.segments[-1]
    count = 1_000_000
    columns = np.arange(count) % len(segment.times)
    long = type(segment)(np.linspace(0.3, 1.0, count), segment.x[:, columns], segment.z[:, columns], segment.d)
    run = Solution(short.model, short.options, (long,), (), short.statistics)
    expected = short["spring.tau"][-len(segment.times) :][columns]
    run["spring.tau"]
    tracemalloc.start()
    values = run["spring.tau"]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    np.testing.assert_allclose(values, expected, rtol=1e-13, atol=1e-13)
    assert peak < 20e6
    taken: list[float] = []
    for _ in range(3):
        begun = time.process_time()
        run["spring.tau"]
        taken.append(time.process_time() - begun)
    assert min(taken) < 0.5


def test_another_parameter_counts_in_what_is_read_afterwards(run: Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    """Functions are kept with the model; parameter values are not."""
    monkeypatch.setattr(solution, "TOGETHER", 0)
    stiff: CompiledDae = run.model.with_parameters({"spring.c": 80.0})
    other = Solution(stiff, run.options, run.segments, run.events, run.statistics)
    assert np.any(run["spring.tau"])
    np.testing.assert_allclose(other["spring.tau"], 2 * run["spring.tau"], rtol=1e-12)
    np.testing.assert_allclose(other["spring.stored_energy"], 2 * run["spring.stored_energy"], rtol=1e-12)
