"""Comparison of two trajectories: figures by hand, from tables that are given."""

from dataclasses import replace

import numpy as np
import pytest

from modelica_like.errors import Source, UnknownName, ValueOutOfRange
from modelica_like.runs.curves import compare_solutions, ranges
from modelica_like.runs.recorded import RecordedModel, RecordedSolution, RecordedVariable
from modelica_like.solve.recorder import Event

UNITS = {"w": "rad/s", "slip": "rad/s", "tau": "N.m"}
TIMES = np.arange(5.0)
INNER = np.array([0, 1, 1, 1, 0])


def table(times: np.ndarray, mode: list[tuple[float, str]] | None = None, **columns: object) -> RecordedSolution:
    """Trajectories with mode changes of `brake.mode`."""
    variables = tuple(RecordedVariable(name, UNITS.get(name, "1")) for name in columns)
    model = RecordedModel("drive", variables, (RecordedVariable("brake.mode"),), {})
    values = np.array([np.broadcast_to(np.asarray(one, float), len(times)) for one in columns.values()])
    run = RecordedSolution(model, times, values, np.zeros((1, len(times))), 0.0)
    run.events = tuple(Event(time, "brake.mode", "", after, Source("")) for time, after in mode or ())
    return run


def test_a_range_is_at_least_a_share_of_the_largest_value_of_the_unit() -> None:
    run = table(TIMES, w=[-0.4, 0.1, 0, 0, 0.2], slip=[1e-9, 2e-9, 0, 0, 0], tau=[0.0] * 5)
    assert ranges(run, ["w", "slip", "tau"]) == pytest.approx({"w": 0.6, "slip": 4e-7, "tau": 1.0})
    assert ranges(run, ["slip"]) == pytest.approx({"slip": 2e-9})
    assert ranges(run, ["slip", "w"], 0.5) == pytest.approx({"slip": 0.2, "w": 0.6})


def test_the_largest_difference_of_each_signal_over_the_range_of_the_first() -> None:
    first = table(TIMES, w=TIMES, tau=[0.0, 10.0, 0.0, 0.0, 0.0], slip=0.5)
    second = table(TIMES, w=TIMES + np.array([0, 0, -0.4, 0.2, 0]), tau=[0.0, 11.5, 0.0, 1.4, 0.0], slip=0.5)
    found = compare_solutions(first, second, [], ("a", "b"))
    assert not found.interpolated
    told = [(one.signal, one.unit, one.largest, one.relative, one.time) for one in found.deviations]
    assert told == [
        ("tau", "N.m", 1.5, 0.15, 1.0),
        ("w", "rad/s", pytest.approx(0.4), pytest.approx(0.1), 2.0),
        ("slip", "rad/s", 0.0, 0.0, 0.0),
    ]
    assert found.largest == 0.15
    assert found["w"] is found.deviations[1]
    times, difference = found.difference("tau")
    assert (times.tolist(), difference.tolist()) == (TIMES.tolist(), [0, 1.5, 0, 1.4, 0])
    assert [one.signal for one in compare_solutions(first, second, ["s*"], ("a", "b")).deviations] == ["slip"]
    assert replace(found, deviations=()).largest == 0.0
    second = table(TIMES, w=[0, 1, np.nan, 3, 4])
    assert compare_solutions(first, second, [], ("a", "b"))["w"].largest == np.inf
    other = table(TIMES, w=TIMES)
    other.model = RecordedModel("other", (RecordedVariable("w"),), (), {})
    assert compare_solutions(first, other, [], ("a", "b"))["w"].unit == "rad/s"
    pair = table(TIMES, tau=0, w=0, slip=0), table(TIMES, slip=0, w=0, tau=0)
    assert [one.signal for one in compare_solutions(*pair, [], ("a", "b")).deviations] == ["tau", "w", "slip"]
    # What is a mode in one of them and a column of numbers in the other is not compared.
    columns = table(TIMES, None, **{"w": TIMES, "brake.mode": 0.0})
    columns.model = RecordedModel("columns", columns.model.flat_variables, (), {})
    for pair in ((first, columns), (columns, first)):
        assert [one.signal for one in compare_solutions(*pair, [], ("a", "b")).deviations] == ["w"]
    with pytest.raises(UnknownName, match=r"^a and b have no signal in common\."):
        compare_solutions(first, table(TIMES, v=0.0), [], ("a", "b"))


@pytest.mark.parametrize("swapped", [False, True])
def test_they_need_a_time_in_common(swapped: bool) -> None:
    for begin, common in ((4.0, False), (4.5, False), (3.0, True)):
        pair = table(TIMES, w=0.0), table(TIMES + begin, w=0.0)
        first, second = reversed(pair) if swapped else pair
        if common:
            assert compare_solutions(first, second, [], ("a", "b")).difference("w")[0].tolist() == [3.0, 4.0]
        else:
            with pytest.raises(ValueOutOfRange, match=r"^a and b have no time in common\."):
                compare_solutions(first, second, [], ("a", "b"))


@pytest.mark.parametrize(
    ("others", "times", "interpolated"),
    [
        (TIMES + 0.9e-9 * INNER, TIMES, False),
        (TIMES - 0.9e-9 * INNER, TIMES, False),
        (TIMES + 1.1e-9 * INNER, TIMES, True),
        (TIMES - 1.1e-9 * INNER, TIMES, True),
        (np.array([0.0, 0.1, 1.0, 1.1, 3.9, 4.0]), [0.0, 1.0, 4.0], False),  # three of five are common
        (np.array([0.0, 1.0, 3.9, 4.0]), [0.0, 1.0, 4.0], False),
        (np.array([0.0, 0.9, 1.1, 2.5, 4.0]), [0.0, 1.0, 2.0, 3.0, 4.0], True),  # two of five
        (np.array([0.0, 0.9, 1.1, 4.0]), [0.0, 4.0], False),  # half of four
        (np.array([0.5, 1.5, 2.5, 3.5]), [1.0, 2.0, 3.0], True),
    ],
)
def test_common_times_are_compared_and_where_they_are_few_the_second_is_interpolated(
    others: np.ndarray, times: list[float], interpolated: bool
) -> None:
    found = compare_solutions(table(TIMES, w=2 * TIMES), table(others, w=2 * others + 1), [], ("a", "b"))
    assert found.interpolated == interpolated
    grid, difference = found.difference("w")
    assert grid.tolist() == list(times)
    np.testing.assert_allclose(difference, 1.0, atol=1e-8)
    assert found["w"].relative == pytest.approx(1 / 8)


def test_both_sides_of_an_event_and_what_is_between_its_two_times_are_left_out() -> None:
    times = np.array([0.0, 1.0, 2.0, 2.0, 2.5, 3.0, 4.0])
    later = np.array([0.0, 1.0, 2.0, 2.5, 3.0, 3.0, 4.0])
    first = table(times, [(2.0, "stuck")], w=np.where(np.arange(7) > 2, 1.0, 0.0))
    second = table(later, [(3.0, "stuck")], w=np.where(np.arange(7) > 4, 1.0, 0.0))
    for pair in ((first, second), (second, first)):
        found = compare_solutions(*pair, [], ("a", "b"))
        assert found.difference("w")[0].tolist() == [0.0, 1.0, 4.0]
        assert found.largest == 0.0
        assert found.largest_event_difference == 1.0
    for begin, end, left in (
        (1 - 0.9e-9, 2 + 0.9e-9, [0, 3, 4]),
        (1 + 0.9e-9, 2 - 0.9e-9, [0, 3, 4]),
        (1.1, 1.9, TIMES),
    ):
        found = compare_solutions(table(TIMES, [(begin, "a")], w=0), table(TIMES, [(end, "a")], w=0), [], ("a", "b"))
        assert found.difference("w")[0].tolist() == list(left)
    starting = np.array([0.0, 0.0, 1.0, 2.0])
    found = compare_solutions(table(starting, w=[9, 0, 1, 2]), table(starting, w=[0, 8, 1, 2]), [], ("a", "b"))
    assert (found.difference("w")[0].tolist(), found.largest) == ([1.0, 2.0], 0.0)
    found = compare_solutions(table(starting, w=0.0), table(starting[1:], w=0.0), [], ("a", "b"))
    assert found.difference("w")[0].tolist() == [1.0, 2.0]
    # An event of only one of them leaves nothing out but its own time.
    found = compare_solutions(first, table(later, w=0.0), [], ("a", "b"))
    assert found.difference("w")[0].tolist() == [0.0, 1.0, 2.5, 4.0]
    assert (found["w"].largest, found["w"].time) == (1.0, 2.5)


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        ([], [], []),
        ([(1.0, "a"), (3.0, "b")], [(1.5, "a"), (2.5, "b")], [("a", 1.0, 1.5), ("b", 3.0, 2.5)]),
        ([(2.0, "a")], [], [("a", 2.0, None)]),
        ([(2.0, "a")], [(1.0, "b"), (3.0, "a")], [("b", None, 1.0), ("a", 2.0, 3.0)]),
        ([(1.0, "b"), (3.0, "a")], [(2.0, "a")], [("b", 1.0, None), ("a", 3.0, 2.0)]),
        ([(1.0, "a")], [(1.0, "b")], [("a", 1.0, None), ("b", None, 1.0)]),
        # At one instant only the last change counts, and what was chosen at the start is none.
        ([(1.0, "a"), (1.0 + 0.9e-8, "b")], [(1.0, "b")], [("b", 1.0 + 0.9e-8, 1.0)]),
        ([(1.0, "a"), (1.0 + 1.1e-8, "b")], [], [("a", 1.0, None), ("b", 1.0 + 1.1e-8, None)]),
        ([(0.0, "a")], [], []),
        ([(0.9e-8, "a")], [], []),
        ([(1.1e-8, "b")], [], [("b", 1.1e-8, None)]),
        ([(1.0, "a"), (2.0, "b")], [(3.0, "a")], [("a", 1.0, 3.0), ("b", 2.0, None)]),
    ],
)
def test_changes_of_a_mode_are_paired_in_their_order(
    first: list[tuple[float, str]], second: list[tuple[float, str]], told: list[tuple[str, float | None, float | None]]
) -> None:
    found = compare_solutions(table(TIMES, first, w=0.0), table(TIMES, second, w=0.0), [], ("a", "b"))
    before, after = (table(TIMES + 7, [(7 + t, name) for t, name in one], w=0.0) for one in (first, second))
    told_later = [one.after for one in compare_solutions(before, after, [], ("a", "b")).events]
    assert told_later == [one.after for one in found.events]
    assert [(one.mode, one.after, one.first, one.second) for one in found.events] == [
        ("brake.mode", *one) for one in told
    ]
    alone = any(None in one for one in told)
    differences = [None if None in one else one[2] - one[1] for one in told]  # type: ignore[operator]
    assert [one.difference for one in found.events] == differences
    assert found.largest_event_difference == (
        np.inf if alone else max([abs(one or 0) for one in differences], default=0)
    )


def test_events_of_a_mode_that_only_one_has_are_no_difference() -> None:
    first, second = table(TIMES, [(1.0, "a")], w=0.0), table(TIMES, w=0.0)
    second.model = RecordedModel("drive", second.model.flat_variables, (), {})
    assert compare_solutions(first, second, [], ("a", "b")).events == ()
    assert compare_solutions(second, first, [], ("a", "b")).events == ()


def test_the_worst_signals_are_drawn_over_their_ranges() -> None:
    first = table(TIMES, None, **{f"s{k}": TIMES for k in range(6)})
    second = table(TIMES, None, **{f"s{k}": TIMES + 0.2 * k * (TIMES == 3) for k in range(6)})
    found = compare_solutions(first, second, [], ("one", "other"))
    figure = found.plot()
    axes = figure.axes
    assert [one.get_ylabel() for one in axes[::2]] == ["s5", "s4", "s3", "s2"]
    assert [line.get_label() for line in axes[0].lines] == ["one", "other"]
    np.testing.assert_allclose(axes[1].lines[0].get_ydata(), 0.25 * (TIMES == 3), atol=1e-15)
    assert axes[0].get_legend() is not None
    assert [one.get_xlabel() for one in axes] == [*[""] * 7, "time in s"]
    assert {one.get_ylabel() for one in axes[1::2]} == {"difference\nover range"}
    assert axes[0].get_gridspec().get_height_ratios() == [2.0, 1.0] * 4
    assert "Not drawn: 2 signals that deviate less." in {text.get_text() for text in figure.texts}
    few = found.plot("s0", "s1")
    assert found.plot("s*").get_figheight() - few.get_figheight() == pytest.approx(4 * 2.4)  # inches
    np.testing.assert_allclose(few.axes[1].lines[0].get_ydata(), 0.0)
    assert [one.get_ylabel() for one in few.axes[::2]] == ["s0", "s1"]
    assert not any("Not drawn" in text.get_text() for text in few.texts)
    with pytest.raises(UnknownName, match=r"^Neither has a signal 'x'"):
        found.plot("x")
