"""Both solvers give the same run of every example: end values, mode changes and their times."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from some import some

from modelica_like import Solution, build, simulate

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLISTS = sorted(
    path.relative_to(EXAMPLES).with_suffix("").as_posix()
    for path in EXAMPLES.rglob("*.toml")
    if path.parent.name != "cosim"
    and {"parts", "simulate"} <= set(content := tomllib.loads(path.read_text()))
    and "until" in content["simulate"]
)
UNDECIDED = {
    "components/h_bridge": {"load.load"},
    "msl/rotational/LossyGearDemo2": {"bearingFriction.mode"},
    "msl/rotational/OneWayClutch": {"oneWayClutch.mode"},
    "msl/translational/PreLoad": {
        f"{one}.{mode}" for one in ("innerContactA", "outerContactA") for mode in ("contact", "surfaces")
    },
}
"""Mode changes that rounding decides; docs/native.md says why."""
RTOL = 1e-10


def ranges(run: Solution) -> np.ndarray:
    """Range of every variable over the run, at least a millionth of the largest one of its unit."""
    values = np.array([run[one.path] for one in run.model.flat_variables])
    found = np.maximum(np.ptp(values, axis=1), 1e-9 * np.abs(values).max(axis=1))
    units = np.array([str(one.unit) for one in run.model.flat_variables])
    largest = np.array([found[units == unit].max() for unit in units])
    return np.maximum(np.maximum(found, 1e-6 * largest), 1e-12)


def changes(run: Solution) -> dict[str, list[tuple[str, str, float]]]:
    """Changes of every mode with their times."""
    found: dict[str, list[tuple[str, str, float]]] = {}
    for event in run.events:
        found.setdefault(event.mode, []).append((event.before, event.after, event.time))
    return found


def ends(run: Solution) -> np.ndarray:
    return np.array([run.final[one.path] for one in run.model.flat_variables])


@pytest.mark.parametrize("name", some(NETLISTS))
def test_both_solvers_agree(name):
    model = build(EXAMPLES / f"{name}.toml")
    first, second = (simulate(model, rtol=RTOL, atol=RTOL / 100, solver=solver) for solver in ("idas", "native"))
    apart = np.abs(ends(first) - ends(second)) / ranges(first)
    assert apart.max() < 1e-6, model.flat_variables[int(apart.argmax())].path
    expected, found = changes(first), changes(second)
    for mode in (expected.keys() | found.keys()) - UNDECIDED.get(name, set()):
        ours, theirs = found.get(mode, []), expected.get(mode, [])
        assert [one[:2] for one in ours] == [one[:2] for one in theirs], mode
        times = np.array([one[2] for one in ours]), np.array([one[2] for one in theirs])
        assert np.abs(times[0] - times[1]).max(initial=0) < max(1e-6, 1e-10 * first.time[-1]), mode
    for one in second.segments:
        assert np.all(np.diff(one.times) > 0) or len(one.times) == 1
    assert first.time[-1] == second.time[-1]
