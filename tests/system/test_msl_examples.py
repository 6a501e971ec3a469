"""Examples of the Modelica Standard Library against its own reference results.

The references were computed with Dymola's DASSL at a tolerance of 1e-6, so they carry errors of that order; a run of
ours with rtol = 1e-10 tells, for each signal, which of the two is off.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from modelica_like import CompiledDae, Solution, build, simulate

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples" / "msl" / "rotational"
REFERENCES = ROOT / "tests" / "data" / "msl"

TUBE = 2e-3
"""Half width of the MSL's tube around a reference, relative to the signal's range and to the length of the run."""
MEDIAN = TUBE / 10
EVENT_TIME = 1e-4
MODE_NUMBER = {"backward": -1, "stuck": 0, "start_forward": 0, "start_backward": 0, "forward": 1, "free": 2}
STATES = {"First": 4, "FirstGrounded": 4, "Friction": 6, "CoupledClutches": 8, "ElasticBearing": 6, "Backlash": 6}

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """Samples of a reference: evenly spaced, and both sides of every change of a mode."""

    time: Vector
    signals: dict[str, Vector]

    @property
    def trajectories(self) -> list[str]:
        return [name for name in self.signals if not name.endswith(".mode")]

    @property
    def modes(self) -> list[str]:
        return [name for name in self.signals if name.endswith(".mode")]

    def sequence(self, mode: str) -> tuple[list[float], list[int]]:
        """Times of the changes of a mode, and all its values."""
        return changes(self.time, self.signals[mode].astype(int).tolist())


def changes(times: Sequence[float] | Vector, values: Sequence[int]) -> tuple[list[float], list[int]]:
    at = [k for k in range(1, len(values)) if values[k] != values[k - 1]]
    return [float(times[k]) for k in at], [values[0], *(values[k] for k in at)]


def read(example: str) -> Reference:
    with (REFERENCES / f"{example}.csv").open(encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    columns = np.array(rows, float).T
    return Reference(columns[0], dict(zip(names[1:], columns[1:], strict=True)))


REFERENCE = {example: read(example) for example in STATES}
SIGNALS = [(example, name) for example, reference in REFERENCE.items() for name in reference.trajectories]
MODES = [(example, name) for example, reference in REFERENCE.items() for name in reference.modes]

_models: dict[str, CompiledDae] = {}
_runs: dict[tuple[str, float], Solution] = {}


def run(example: str, rtol: float = 1e-7) -> Solution:
    if example not in _models:
        _models[example] = build(EXAMPLES / f"{example}.toml")
    if (example, rtol) not in _runs:
        _runs[example, rtol] = simulate(_models[example], rtol=rtol, atol=0.01 * rtol, points=2000)
    return _runs[example, rtol]


def deviation(example: str, name: str, rtol: float = 1e-7) -> Vector:
    """Deviation from the reference at its times, relative to the signal's range."""
    result, reference = run(example, rtol), REFERENCE[example]
    return np.abs(np.interp(reference.time, result.time, result[name]) - reference.signals[name]) / np.ptp(
        reference.signals[name]
    )


@pytest.mark.parametrize(("example", "states"), STATES.items())
def test_number_of_states(example: str, states: int) -> None:
    assert len(run(example).model.states) == states


@pytest.mark.parametrize(("example", "name"), SIGNALS)
def test_inside_the_tube(example: str, name: str) -> None:
    result, reference = run(example), REFERENCE[example]
    height, width = TUBE * np.ptp(reference.signals[name]), TUBE * np.ptp(reference.time)
    for t, value in zip(reference.time, reference.signals[name], strict=True):
        near = np.abs(result.time - t) <= width
        assert np.min(np.abs(result[name][near] - value)) <= height, f"{name} leaves the tube at {t} s"


@pytest.mark.parametrize(("example", "name"), SIGNALS)
def test_ten_times_tighter_in_the_median(example: str, name: str) -> None:
    assert np.median(deviation(example, name)) <= MEDIAN


@pytest.mark.parametrize(("example", "name"), SIGNALS)
def test_no_deviation_is_ours(example: str, name: str) -> None:
    """With three more digits of tolerance the distance to the reference stays: it is the reference's error."""
    ordinary, precise = run(example), run(example, 1e-10)
    own_error = np.abs(np.interp(precise.time, ordinary.time, ordinary[name]) - precise[name])
    assert np.max(own_error) / np.ptp(precise[name]) <= 5e-4
    assert np.max(deviation(example, name, 1e-10)) <= 3.2e-4


@pytest.mark.parametrize(("example", "name"), MODES)
def test_sequence_of_modes(example: str, name: str) -> None:
    result = run(example)
    names = result.model.flat_discretes[result.model.discrete_position[name]].names
    ours = changes(result.time, [MODE_NUMBER[names[int(d)]] for d in result[name]])
    theirs = REFERENCE[example].sequence(name)
    assert ours[1] == theirs[1]
    assert ours[0] == pytest.approx(theirs[0], abs=EVENT_TIME)


@pytest.mark.parametrize("example", STATES)
def test_energy_closes(example: str) -> None:
    assert run(example).energy().closure <= 1e-8


@pytest.mark.parametrize("element", ["elastoBacklash", "elastoBacklash2"])
def test_flanks_never_pull(element: str) -> None:
    result = run("Backlash")
    names = result.model.flat_discretes[result.model.discrete_position[f"{element}.contact"]].names
    side = np.array([{"gap": 0, "forward": 1, "backward": -1}[names[int(d)]] for d in result[f"{element}.contact"]])
    pressure = side * result[f"{element}.tau"]
    assert np.min(pressure) >= -1e-9 * np.max(pressure)
    assert np.all(result[f"{element}.tau"][side == 0] == 0.0)
