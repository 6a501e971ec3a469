"""Panels: how long they are and how many looks they have, by the rules of their class."""

import numpy as np
import pytest

from modelica_like.options import Options
from modelica_like.solve.pace import Pace

STEP = 0.1
"""Distance of two results, in s."""
STOP = 1000.0
"""No panel of these tests reaches it."""
ONE, OTHER = np.array([0.0]), np.array([1.0])
"""Modes."""


def pace(points: int, *, begin: float = -3.0, guarded: bool = True, timed: bool = False) -> Pace:
    return Pace(begin, begin + points * STEP, Options(points=points), guarded=guarded, timed=timed)


def test_without_events_the_looks_are_the_results() -> None:
    """10000 in three calls of at most 4096, as even as they can be; an odd beginning goes to the next one of these."""
    chosen = pace(10000, guarded=False)
    end = -3.0 + 1000.0
    assert chosen.panel(-3.0, end) == (pytest.approx(333.4), 3334)
    assert chosen.panel(-3.0 + 333.4, end) == (pytest.approx(333.4), 3334)
    assert chosen.panel(-3.0 + 666.8, end) == (pytest.approx(333.2), 3332)
    assert chosen.panel(0.25, end) == (pytest.approx(333.35), 3334)
    assert chosen.panel(0.25, 0.5) == (pytest.approx(0.25), 3)
    assert chosen.panel(0.25, 0.26) == (pytest.approx(0.01), 1)


def test_results_lie_on_a_grid_from_the_beginning_on() -> None:
    """After the first time up to the last one; both may be off by rounding, 1e-12 of the time or of 1 s."""
    chosen = pace(100)
    for first, last in ((-0.2, 0.1), (-0.2 + 1e-13, 0.1 - 1e-13), (-0.2 - 1e-13, 0.15), (-0.15, 0.15)):
        np.testing.assert_allclose(chosen.results(first, last), [-0.1, 0.0, 0.1], atol=1e-14)
    assert chosen.results(0.01, 0.09).size == 0
    for t, off in ((0.1, 1e-12), (1000.1, 1e-9)):
        later = t + STEP * np.arange(3)
        for sign in (1, -1):
            np.testing.assert_allclose(pace(20000).results(t + sign * 0.9 * off, t + 0.2 - 0.9 * off), later[1:])
        np.testing.assert_allclose(pace(20000).results(t - 1.2 * off, t + 0.2 - 1.2 * off), later[:2])
    assert 0.1 - 1e-6 * STEP < chosen.before(0.1) < 0.1 - 1e-7 * STEP


def test_the_first_panel_spans_32_results() -> None:
    assert pace(1000).panel(0.0, STOP) == (pytest.approx(32 * STEP), 32)
    assert pace(1000).panel(0.0, 3.5) == (pytest.approx(3.5), 64)
    assert pace(1000).panel(0.0, 3.6) == (pytest.approx(3.2), 32)


def test_a_panel_has_as_many_looks_as_steps_are_expected() -> None:
    """A panel had 10 steps for each of its 64 looks, 16 per s: the next one has twice 160 looks per s, at least."""
    chosen = pace(1000)
    assert chosen.stride(30 + 640, 64, 1 / 16) == 0
    # Cost: sqrt(100·3.2 s / (160 / s)).
    span = 2**0.5
    assert chosen.panel(0.0, STOP) == (pytest.approx(span), 512)
    chosen = pace(1000)
    chosen.stride(0, 8, 1e-5)
    assert chosen.panel(0.0, STOP) == (pytest.approx(32 * STEP), 32)  # no steps: one for each result
    chosen.stride(30 + 64 * 40, 64, 1e-3)
    # No more than 2048 looks: 25.6 ms of 40 per ms, of which half are spare.
    assert chosen.panel(0.0, STOP) == (pytest.approx(0.0256), 2048)


@pytest.mark.parametrize(
    ("steps", "looks", "width", "stride"),
    [
        (30 + 64, 64, 0.1, 2),  # a step per look: two looks for two steps
        (30 + 65, 64, 0.1, 1),
        (0, 64, 0.01, 8),  # at least eight looks are left
        (0, 127, 0.01, 8),
        (0, 64, 0.1, 4),  # at least one for four results
        (0, 64, 0.101, 2),
        (30 + 64 * 3, 64, 0.1, 1),
        (30 + 64 * 3 + 1, 64, 0.1, 0),  # more than three steps between two looks
    ],
)
def test_how_many_looks_are_left_out(steps: int, looks: int, width: float, stride: int) -> None:
    assert pace(1000).stride(steps, looks, width) == stride


def test_panels_grow_while_nothing_happens_and_shrink_where_told() -> None:
    chosen = pace(100000)
    chosen.longer(0.85 * 32 * STEP, 1e9)
    assert chosen.panel(0.0, STOP)[0] == pytest.approx(32 * STEP)  # it was not used in full
    chosen.longer(32 * STEP, 4.0)
    assert chosen.panel(0.0, STOP)[0] == pytest.approx(6.0)  # half as much again as is ahead
    chosen.longer(6.0, 1e9)
    assert chosen.panel(0.0, STOP)[0] == pytest.approx((100 * 48.0 / (0.5 / STEP)) ** 0.5)  # 8 times; but what it costs
    chosen.longer(48.0, 0.1)
    assert chosen.panel(0.0, STOP)[0] == pytest.approx(30 * STEP)  # less would cost little more than its beginning
    chosen.shorter(0.8)
    assert chosen.panel(0.0, STOP) == (pytest.approx(0.8), 8)
    chosen.shorter(0.8, denser=True)
    assert chosen.panel(0.0, STOP) == (pytest.approx(0.1), 8)


def test_a_run_without_events_gets_looks_between_results_where_told() -> None:
    chosen = pace(1000, guarded=False)
    chosen.shorter(8.0, denser=True)
    assert chosen.panel(0.0, STOP) == (pytest.approx(1.0), 128)


def test_a_segment_is_expected_to_last_as_long_as_the_last_one_with_its_modes() -> None:
    chosen = pace(1000)
    chosen.anew(ONE, 4.0, OTHER)
    assert chosen.panel(0.0, STOP)[0] == pytest.approx(6.0)  # nothing is known: as the one before
    chosen.anew(OTHER, 10.0, ONE)
    assert chosen.panel(0.0, STOP)[0] == pytest.approx(6.0)
    chosen.anew(ONE, 0.01, OTHER)
    assert chosen.panel(0.0, STOP)[0] == pytest.approx(15.0)
    chosen.anew(OTHER, 1.0, ONE)
    assert chosen.panel(0.0, STOP)[0] == pytest.approx(30 * STEP)
    free = pace(1000, guarded=False, timed=True)
    free.anew(ONE, 4.0, OTHER)
    assert free.panel(0.0, 50.0) == (pytest.approx(50.0), 512)
