"""Blocks in which variables are read along a run."""

from dataclasses import replace

import numpy as np
import pytest

from components import Clutch, Inertia
from modelica_like import Assembly, build, simulate
from modelica_like.language import Component
from modelica_like.runs import reading, solution
from modelica_like.runs.reading import blocks, energy_term, variables
from modelica_like.solve.initialize import call
from modelica_like.solve.recorder import Segment

MOST = 65_536


def segment(number: int, size: int) -> Segment:
    times = np.linspace(number, number + 1, size)
    return Segment(times, np.array([times, -times]), np.array([2 * times]), np.array([float(number)]))


@pytest.mark.parametrize(
    ("sizes", "full"),
    [
        ([3], [3]),
        ([2, 2, 2], [6]),
        ([MOST], [MOST]),
        ([MOST + 1], [MOST, 1]),
        ([MOST - 1, 1, 1], [MOST, 1]),
        ([30_000] * 5, [60_000, 60_000, 30_000]),
        ([200_000, 5, 70_000], [MOST, MOST, MOST, 200_005 - 3 * MOST, MOST, 70_000 - MOST]),
        ([10, MOST, 10, 20], [10, MOST, 30]),
    ],
)
def test_blocks_are_full_and_lose_nothing(sizes: list[int], full: list[int]) -> None:
    segments = [segment(number, size) for number, size in enumerate(sizes)]
    found = list(blocks(segments))
    counts = [len(times) for times, *_ in found]
    assert counts == full
    assert [t for times, *_ in found for t in times] == [t for one in segments for t in one.times]
    for times, x, z, d in found:
        assert np.array_equal(x, [times, -times])
        assert np.array_equal(z, [2 * times])
        assert d.shape == (1, len(times))
    assert [int(one) for *_, d in found for one in d[0]] == [k for k, size in enumerate(sizes) for _ in range(size)]


def test_whatever_is_read_and_in_whatever_blocks_it_is_what_each_result_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    """All variables or one by one, energies: the functions of the model, called at each result alone."""
    parts: dict[str, Component] = {
        "left": Inertia(J=1.0, phi=0.0, w=10.0),
        "clutch": Clutch(capacity=5.0, phi_rel=0.0),
        "right": Inertia(J=1.0, w=0.0),
    }
    run = simulate(Assembly("launch", parts=parts, series={"shaft": ["left", "clutch", "right"]}), 2.0, points=20)
    model, segments = run.model, run.segments
    points = [one.point(k) for one in segments for k in range(len(one.times))]
    every = np.array([call(model, model.equations.variables, point) for point in points]).T
    energies = np.array([call(model, model.energy, point).reshape(-1, len(model.components)) for point in points])
    monkeypatch.setattr(reading, "_BLOCK", 8)
    assert len(list(blocks(segments))) > 2
    np.testing.assert_allclose(variables(model, segments, None), every, rtol=1e-12, atol=1e-12)
    rows = [7, 0, 3]
    np.testing.assert_allclose(variables(model, segments, rows), every[rows], rtol=1e-12, atol=1e-12)
    for component in range(len(model.components)):
        for column in range(3):
            found = energy_term(model, segments, component, column)
            np.testing.assert_allclose(found, energies[:, column, component], rtol=1e-12, atol=1e-12)
    # A large run is not read as a whole.
    names = list(model.position)[:3]
    for together in (0, len(points) * len(every) - 1, len(points) * len(every)):
        monkeypatch.setattr(solution, "TOGETHER", together)
        fresh = replace(run)
        found = fresh.together(*names, "clutch.mode", "time")
        assert list(found) == [*names, "clutch.mode", "time"]
        np.testing.assert_allclose([found[name] for name in names], every[:3], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(fresh["right.w"], every[model.position["right.w"]], rtol=1e-12, atol=1e-12)
        assert ("_all" in vars(fresh)) == (together == len(points) * len(every))


def test_twins_of_a_model_read_by_the_same_symbols() -> None:
    """What one of them has in the cache is read by the other."""
    parts: dict[str, Component] = {"left": Inertia(J=1.0, phi=0.0, w=3.0), "right": Inertia(J=2.0)}
    model = build(Assembly(parts=parts, series={"line": ["left", "right"]}))
    first, second = model.twin(), model.with_parameters({"left.J": 2.0})
    run = simulate(first, 1.0, points=2)
    for one, name, expected in ((first, "right.phi", [0.0, 1.5, 3.0]), (second, "right.w", [3.0, 3.0, 3.0])):
        assert variables(one, run.segments, [model.position[name]])[0] == pytest.approx(expected)


@pytest.mark.parametrize("page", [1, 21, 64, 10_000])
def test_variables_of_a_large_run_are_read_with_their_neighbours(page: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """One by one, again and in any order: what all together give; no more pages are kept than memory for all."""
    parts: dict[str, Component] = {"left": Inertia(J=1.0, phi=0.0, w=3.0), "right": Inertia(J=2.0)}
    run = simulate(Assembly(parts=parts, series={"line": ["left", "right"]}), 1.0, points=20)
    every = variables(run.model, run.segments, None)
    monkeypatch.setattr(solution, "TOGETHER", 100)
    monkeypatch.setattr(solution, "_PAGE", page)
    large = replace(run)
    for name, row in [*run.model.position.items()] * 2 + [*reversed(run.model.position.items())]:
        np.testing.assert_array_equal(large[name], every[row])
        assert len(large._pages) <= max(1, 100 // page)
