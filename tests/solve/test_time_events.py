"""Events at times known beforehand, and in models that have nothing but the time."""

import math

import numpy as np
import pytest

from modelica_like import Assembly, Solution, build, simulate
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    discrete,
    param,
    var,
)


def times(run: Solution) -> np.ndarray:
    return np.array([event.time for event in run.events])


class Metronome(Component):
    x: Variable = var("s", "time on")
    next: Discrete = discrete("s", "next beat", start="first")
    beats: Discrete = discrete("1", "count")
    first: Parameter = param("s", "first beat", default=0.0)
    period: Parameter = param("s", "between beats", default=0.1)
    hand = Mode("left", "right")

    def equations(self) -> Equations:
        yield der(self.x) == self.hand.choose(left=0, right=1)

    def events(self) -> Events:
        after = {self.next: self.next + self.period, self.beats: self.beats + 1}
        yield self.hand.go("left", "right", at=self.next, reset=after)
        yield self.hand.go("right", "left", at=self.next, reset=after)


@pytest.mark.parametrize("period", [0.1, 1 / 3, 0.07, math.pi / 20])
def test_time_events_are_hit_exactly(period):
    end = 2.04
    run = simulate(Metronome(x=0.0, period=period, first=period), end, points=13)
    beats = np.cumsum(np.full(int(end / period), period))
    assert np.array_equal(times(run), beats)  # to the last bit: the times are sums of the period
    assert run.final["beats"] == len(beats)
    switches = np.append(beats, end) if len(beats) % 2 else beats
    assert run.final["x"] == pytest.approx(np.sum(switches[1::2] - switches[::2]), abs=1e-12)


def test_clocks_beside_each_other_are_each_in_time():
    """Of several moments ahead the next one counts, and what both ask for at one time is done at it."""
    periods = {"fast": 0.07, "slow": 0.1, "idle": 5.0}
    parts = {name: Metronome(x=0.0, period=period, first=period) for name, period in periods.items()}
    run = simulate(Assembly("clocks", parts=parts), 1.02, points=3)
    for name, period in periods.items():
        beats = [event.time for event in run.events if event.mode == f"{name}.hand"]
        assert beats == pytest.approx(period * np.arange(1, int(1.02 / period) + 1), rel=1e-14)
    assert np.all(np.diff(times(run)) >= 0)


def test_a_time_event_at_or_before_the_start_fires_at_the_start():
    for first in (0.0, -1.0):
        run = simulate(Metronome(x=0.0, period=0.4, first=first), 0.05)
        assert times(run)[0] == 0.0
    assert simulate(Metronome(x=0.0, period=0.4, first=-1.0), 0.05).final["beats"] == 3  # -1.0, -0.6, -0.2, all late


def test_a_time_event_at_the_end_fires():
    run = simulate(Metronome(x=0.0, period=5.0, first=1.0), 1.0, points=3)
    assert list(times(run)) == [1.0]


def test_time_events_after_a_start_that_is_not_zero():
    run = simulate(Metronome(x=0.0, period=0.25, first=100.25), 101.0, t0=100.0, points=4)
    assert list(times(run)) == [100.25, 100.5, 100.75, 101.0]


# -- models without states -------------------------------------------------------------------------------------------


def test_a_model_without_states_has_time_events():
    class Blink(Component):
        y: Variable = var("1", "light")
        lamp = Mode("dark", "bright")
        at: Parameter = param("s", "when", default=0.25)

        def equations(self) -> Equations:
            yield self.y == self.lamp.choose(dark=0, bright=1)

        def events(self) -> Events:
            yield self.lamp.go("dark", "bright", at=self.at)

    run = simulate(Blink(), 1.0, points=2)
    assert list(run.time) == [0.0, 0.25, 0.25, 0.5, 1.0]
    assert list(run["y"]) == [0, 0, 1, 1, 1]


def test_a_guard_on_time_alone_in_a_model_without_states():
    class Blink(Component):
        y: Variable = var("1", "light")
        lamp = Mode("dark", "bright")
        at: Parameter = param("s", "when", default=1 / 3)

        def equations(self) -> Equations:
            yield self.y == self.lamp.choose(dark=0, bright=1)

        def events(self) -> Events:
            yield self.lamp.go("dark", "bright", when=self.time > self.at)

    run = simulate(Blink(), 1.0, points=4)
    np.testing.assert_allclose(times(run), [1 / 3], rtol=0, atol=1e-10)
    assert build(Blink()).states == ()
