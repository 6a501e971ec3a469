"""Modes at the start and events depend on no rounding: BLAS kernels, orders of lines, start values in the 13th digit.

As a script it prints the modes and events of all examples as JSON.
"""

import json
import os
import random
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import simulate, steady
from modelica_like.compile import CompiledDae, compile
from modelica_like.flatten import flatten
from modelica_like.native.start import initialize
from modelica_like.netlist.document import parse, read_text
from modelica_like.netlist.read import assemble
from modelica_like.solve.recorder import Event
from modelica_like.structure import reduce

EXAMPLES = Path(__file__).parents[2] / "examples"
NEEDS = {"Prescott": "pni", "Haswell": "avx2", "Zen": "avx2", "SkylakeX": "avx512f"}
SECTIONS = ("parts", "series", "connect", "start", "guess")
# PreLoad begins with four contacts that just touch; how they tremble is below the tolerance of a run (72, 46, 40 events
# at rtol = 1e-6, 1e-8, 1e-10). The speed of the clutch in OneWayClutch touches zero at 1.5 s: whether it sticks for the
# last 50 µs before is less than the tolerance, too (docs/native.md).
TREMBLES = ("PreLoad.toml", "OneWayClutch.toml")
Told = dict[str, Any]


def netlists() -> list[Path]:
    """All examples that are models, in their order."""
    folders = [EXAMPLES, *(EXAMPLES / name for name in ("components", "dc_machines", "msl"))]
    found = {path for folder in folders for path in folder.glob("*.toml" if folder == EXAMPLES else "**/*.toml")}
    return sorted(path for path in found if path.name not in TREMBLES)


def built(path: Path, seed: int = 0, moved: float = 0.0, **values: Any) -> CompiledDae:
    """Compile a netlist with its lines shuffled (unless the seed is 0), and start values moved by a relative amount."""
    chance, document = random.Random(seed), parse(read_text(path), str(path))
    for section in SECTIONS if seed else ():
        entries = list(getattr(document, section).items())
        chance.shuffle(entries)
        setattr(document, section, dict(entries))
    drive = assemble(document, path)
    for name, value in values.items():
        drive.set(name.replace("__", "."), value)
    flat = flatten(drive)
    flat.starts[:] = [replace(one, value=one.value * (1.0 + moved * chance.uniform(-1, 1))) for one in flat.starts]
    return compile(reduce(flat))


def told(model: CompiledDae) -> Told:
    """Modes at the start, and mode changes of a run."""
    point = initialize(model, start=model.settings.get("start", "given"))
    pairs = zip(model.flat_discretes, point.d, strict=False)
    modes = {one.path: one.names[int(number)] for one, number in pairs if one.names}
    run = simulate(model, model.settings.get("until", 1.0), points=2)
    return {"modes": dict(sorted(modes.items())), "events": changes(run.events)}


def changes(events: Sequence[Event]) -> list[tuple[float, dict[str, list[str]]]]:
    """Mode changes instant by instant: what was before, what is after.

    What breaks away has a speed of rounding errors; whether it sticks once more at the same instant says nothing.
    """
    instants: list[tuple[float, dict[str, list[str]]]] = []
    for event in events:
        if not instants or event.time - instants[-1][0] > 1e-6 * (1.0 + event.time):
            instants.append((event.time, {}))
        modes = instants[-1][1]
        modes[event.mode] = [modes.get(event.mode, [event.before])[0], event.after]
    found = [(time, {mode: pair for mode, pair in modes.items() if pair[0] != pair[1]}) for time, modes in instants]
    return [(time, modes) for time, modes in found if modes]


def everything(**changes: Any) -> dict[str, Told]:
    """Return what is told of every example, of losses in the meshes of a gearbox, and of its steady state."""
    results = {str(path.relative_to(EXAMPLES)): told(built(path, **changes)) for path in netlists()}
    losses = built(EXAMPLES / "lepelletier.toml", box__losses=True, box__mesh_efficiency=0.99, **changes)
    results["losses in the meshes"] = told(losses)
    point = steady(built(EXAMPLES / "lepelletier_gears.toml", **changes))
    results["steady"] = {"modes": list(point.stuck), "events": [(point["motor.w"] / point["load.w"], {})]}
    return results


def assert_same(found: dict[str, Told], expected: dict[str, Told]) -> None:
    """Compare modes and events; times may differ by the tolerance of the runs."""
    assert found.keys() == expected.keys()
    for name, one in expected.items():
        assert found[name]["modes"] == one["modes"], name
        assert [modes for _, modes in found[name]["events"]] == [modes for _, modes in one["events"]], name
        times = [[time for time, _ in some["events"]] for some in (found[name], one)]
        np.testing.assert_allclose(*times, rtol=1e-5, atol=1e-8, err_msg=name)


@pytest.fixture(scope="module")
def plain() -> dict[str, Told]:
    return json.loads(json.dumps(everything()))


@pytest.mark.slow
def test_the_examples_have_modes_and_events(plain: dict[str, Told]) -> None:
    assert len(plain) > 80
    assert sum(len(one["modes"]) for one in plain.values()) > 100
    assert sum(len(one["events"]) for one in plain.values()) > 300
    assert plain["steady"]["modes"] == ["box.clutch_a", "box.brake_d"]


@pytest.mark.slow
@pytest.mark.parametrize("kernel", NEEDS)
def test_every_blas_kernel_gives_the_same_modes_and_events(plain: dict[str, Told], kernel: str) -> None:
    flags = Path("/proc/cpuinfo")
    if not flags.exists() or NEEDS[kernel] not in flags.read_text().split():
        pytest.skip(f"this processor cannot run {kernel}")
    environment = {**os.environ, "OPENBLAS_CORETYPE": kernel}
    run = subprocess.run([sys.executable, __file__], env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert_same(json.loads(run.stdout), plain)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "moved"), [(1, 1e-13), (2, 0.0), (0, 1e-13)])
def test_neither_the_order_of_lines_nor_the_thirteenth_digit_counts(
    plain: dict[str, Told], seed: int, moved: float
) -> None:
    assert_same(json.loads(json.dumps(everything(seed=seed, moved=moved))), plain)


if __name__ == "__main__":
    json.dump(everything(), sys.stdout)
