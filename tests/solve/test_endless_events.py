"""Very many events, events without end, and runs that find no way on."""

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from components import BearingFriction, Inertia, Pulse, Torque
from modelica_like import Assembly, Options, Solution, simulate
from modelica_like.errors import Chattering, Source, StepFailed
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    all_of,
    der,
    discrete,
    param,
    pre,
    var,
)
from modelica_like.native.endless import chattering
from modelica_like.native.notices import note_rest
from modelica_like.solve.initialize import Impact
from modelica_like.solve.recorder import Event, Recorder

TIGHT = {"rtol": 1e-11, "atol": 1e-13}


def times(run: Solution) -> np.ndarray:
    return np.array([event.time for event in run.events])


# -- many events, and without end ------------------------------------------------------------------------------------


class Saw(Component):
    x: Variable = var("s", "since the last tooth")
    teeth: Discrete = discrete("1", "count")
    width: Parameter = param("s", "of a tooth", default=1e-3)
    tooth = Mode("one")

    def equations(self) -> Equations:
        yield der(self.x) == 1

    def events(self) -> Events:
        yield self.tooth.go("one", "one", when=self.x > self.width, reset={self.x: 0, self.teeth: self.teeth + 1})


@pytest.mark.parametrize("width", [1e-3, 1e-2])
def test_a_thousand_events(width):
    run = simulate(Saw(x=0.0, width=width), 1000.5 * width, points=100)
    np.testing.assert_allclose(times(run), width * np.arange(1, 1001), rtol=0, atol=1e-10)
    assert run.final["teeth"] == 1000


class ShortSaw(Saw):
    """It has so many teeth, and a discrete variable that is there from the start."""

    most: Parameter = param("1", "number of teeth", default=24.0)
    half: Discrete = discrete("1", "half the count")

    def equations(self) -> Equations:
        yield der(self.x) == 1
        yield self.half == pre(self.teeth) / 2

    def events(self) -> Events:
        more = all_of(self.x > self.width, self.teeth < self.most)
        yield self.tooth.go("one", "one", when=more, reset={self.x: 0, self.teeth: self.teeth + 1})


def test_25_instants_in_a_millionth_of_the_run_are_too_many():
    assert len(simulate(ShortSaw(x=0.0, width=1e-8), 1.0).events) == 24
    with pytest.raises(Chattering, match="Events follow each other ever faster"):
        simulate(ShortSaw(x=0.0, width=1e-8, most=25), 1.0)
    # Somewhat wider, the last instant lies a whole window behind the first.
    assert len(simulate(ShortSaw(x=0.0, width=1.001e-6 / 24, most=40), 1.0).events) == 40


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_burst_of_pulses_in_a_long_run_is_no_chattering(solver: Any) -> None:
    """200 pulses of 2 N.m · 0.05 ms at 1 kg.m2, each of which was to come."""
    parts = {"pulse": Pulse(amplitude=2.0, period=1e-4, periods=200, start_time=5.0), "torque": Torque(),
             "mass": Inertia(J=1.0, phi=0.0, w=0.0)}  # fmt: skip
    drive = Assembly("d", parts=parts, series={"s": ["torque", "mass"]}, connect={"c": ["pulse.y", "torque.tau"]})
    run = simulate(drive, 1e4, solver=solver)
    assert len(run.events) == 400
    assert run.final["mass.w"] == pytest.approx(200 * 2 * 0.5e-4, rel=1e-6)


class Hurried(Component):
    """Each half of its time takes half as long as the one before: all ends at 1 s."""

    x: Variable = var("s", default=0.0)
    end: Parameter = param("s", "where it ends", default=1.0)
    following: Discrete = discrete("s", "time of the next event", start=0.5)
    turn = Mode("up", "down")

    def equations(self) -> Equations:
        yield der(self.x) == self.turn.choose(up=1, down=-1)

    def events(self) -> Events:
        sooner = {self.following: 0.5 * (self.following + self.end)}
        for before, after in (("up", "down"), ("down", "up")):
            yield self.turn.go(before, after, at=self.following, reset=sooner)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_time_events_without_end_are_told(solver: Any) -> None:
    with pytest.raises(Chattering, match="turn switched"):
        simulate(Hurried(), 2.0, solver=solver)


@pytest.mark.parametrize("count", [1, 3])
def test_rounds_at_one_instant_are_limited_by_what_may_hold(count: int) -> None:
    """A relay between two values without hysteresis beside brakes, each of which may hold a motion."""
    wheels = {f"wheel{k}": Inertia(J=1.0, phi=0.0, w=1.0) for k in range(count)}
    brakes = {f"brake{k}": BearingFriction(tau_pos=[[0, 2]]) for k in range(count)}
    series = {f"s{k}": [f"brake{k}", f"wheel{k}"] for k in range(count)}
    drive = Assembly("d", parts={"relay": Relay(x=0.0), **wheels, **brakes}, series=series)
    with pytest.raises(Chattering) as caught:
        simulate(drive, 1.0)
    assert f"Modes still switch after {20 + 6 * count} rounds at one instant." in str(caught.value)


def test_a_limit_of_events_is_kept():
    assert len(simulate(Saw(x=0.0, width=0.1), 1.05, options=Options(max_events=10)).events) == 10
    with pytest.raises(Chattering, match="more than 10 events"):
        simulate(Saw(x=0.0, width=0.1), 1.15, options=Options(max_events=10))


class Ball(Component):
    """Bouncing ball: an infinite number of bounces in a finite time (Zeno)."""

    h: Variable = var("m", "height")
    v: Variable = var("m/s", "velocity")
    g: Parameter = param("m/s2", "gravity", default=9.81)
    e: Parameter = param("1", "restitution", default=0.7)
    air = Mode("flying")

    def equations(self) -> Equations:
        yield der(self.h) == self.v
        yield der(self.v) == -self.g

    def events(self) -> Events:
        yield self.air.go("flying", "flying", when=self.h < 0, reset={self.v: -self.e * self.v})


def bounces(e: float, count: int) -> np.ndarray:
    """Bounce n of a ball dropped from 1 m: T (1 + 2 (e + e² + … + e^(n-1))), T = sqrt(2 h / g)."""
    powers = np.concatenate([[0.0], np.cumsum(e ** np.arange(1, count))])
    return math.sqrt(2 / 9.81) * (1 + 2 * powers)


def test_a_bouncing_ball_follows_its_closed_form():
    run = simulate(Ball(h=1.0, v=0.0), 2.4, points=100, **TIGHT)
    expected = bounces(0.7, 20)
    expected = expected[expected < 2.4]
    np.testing.assert_allclose(times(run), expected, rtol=0, atol=1e-9)
    for before, after in pairwise(expected):
        middle = run.at(0.5 * (before + after))
        flight = after - before
        assert middle["h"] == pytest.approx(9.81 * flight**2 / 8, rel=1e-7)  # the top of its parabola
        assert middle["v"] == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("e", [0.7, 0.9, 0.5])
def test_the_zeno_limit_ends_with_a_sentence(e):
    limit = math.sqrt(2 / 9.81) * (1 + 2 * e / (1 - e))
    with pytest.raises(Chattering) as caught:
        simulate(Ball(h=1.0, v=0.0, e=e), 1.2 * limit, points=100)
    assert "air switched" in caught.value.what
    last = float(caught.value.what.split("…")[1].split(" s")[0])
    assert last == pytest.approx(limit, rel=1e-4)
    assert "test_endless_events.py" in str(caught.value)


def test_a_ball_at_rest_on_the_floor_ends_with_a_sentence():
    for e in (0.0, 0.7):
        with pytest.raises(Chattering):
            simulate(Ball(h=0.0, v=0.0, e=e), 1.0)


def test_a_ball_thrown_from_the_floor_flies():
    run = simulate(Ball(h=0.0, v=1.0), 0.3, **TIGHT)
    np.testing.assert_allclose(times(run), [2 / 9.81], rtol=0, atol=1e-10)


class Relay(Component):
    """Each mode drives the other on: sliding mode, which needs a law of its own."""

    x: Variable = var("1", "error")
    T: Parameter = param("s", "time", default=1.0)
    state = Mode("up", "down")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.state.choose(up=1, down=-1)

    def events(self) -> Events:
        yield self.state.go("up", "down", when=self.x > 0)
        yield self.state.go("down", "up", when=self.x < 0)


@pytest.mark.parametrize("x", [-0.5, 0.0])
def test_two_modes_that_drive_each_other_on_end_with_a_sentence(x):
    with pytest.raises(Chattering) as caught:
        simulate(Relay(x=x), 1.0)
    text = str(caught.value)
    assert f"state switched 20 times at t = {abs(x):g} s (up ⇄ down)." in text
    assert "self.state.go" in text
    assert "Modes still switch after 20 rounds at one instant." in text


def test_a_relay_with_hysteresis_is_no_chattering():
    class Hysteresis(Relay):
        width: Parameter = param("1", "half the hysteresis", default=0.01)

        def events(self) -> Events:
            yield self.state.go("up", "down", when=self.x > self.width)
            yield self.state.go("down", "up", when=self.x < -self.width)

    run = simulate(Hysteresis(x=0.0), 1.0)
    np.testing.assert_allclose(times(run), 0.01 + 0.02 * np.arange(len(run.events)), rtol=0, atol=1e-9)
    assert len(run.events) == 50


# -- no way on -------------------------------------------------------------------------------------------------------


def test_a_panel_that_runs_past_an_event_into_nonsense_is_shortened():
    """The root of a negative number lies behind the event."""
    from modelica_like.language import sqrt

    class Drain(Component):
        level: Variable = var("1", "level")
        T: Parameter = param("s", "time", default=1.0)
        tank = Mode("full", "empty")

        def equations(self) -> Equations:
            yield self.T * der(self.level) == self.tank.choose(full=-sqrt(self.level + 1e-4), empty=0)

        def events(self) -> Events:
            yield self.tank.go("full", "empty", when=self.level < 0, reset={self.level: 0})

    run = simulate(Drain(level=1.0), 5.0, **TIGHT)
    # sqrt(level + d) = sqrt(1 + d) - t / 2, zero level at sqrt(d).
    np.testing.assert_allclose(times(run), [2 * (math.sqrt(1.0001) - 0.01)], rtol=0, atol=1e-9)
    assert run.final["level"] == 0.0


def test_a_run_that_failed_keeps_what_is_known_up_to_then() -> None:
    """1/(1 - t) ends at 1 s."""

    class BlowUp(Component):
        x: Variable = var("1", "grows without bound", default=1.0)
        T: Parameter = param("s", "time", default=1.0)
        mode = Mode("fine", "late")

        def equations(self) -> Equations:
            yield self.T * der(self.x) == self.x**2

        def events(self) -> Events:
            yield self.mode.go("fine", "late", when=self.x < 0)

    with pytest.raises(StepFailed, match=r"IDAS gave up at about t = 0\.99999") as caught:
        simulate(BlowUp(), 2.0, solver="idas", points=2000)
    run = caught.value.run
    assert run is not None
    known = np.concatenate([segment.times for segment in run.segments])
    assert 0.99 < known[-1] < 1.0
    x = np.concatenate([segment.x[0] for segment in run.segments])
    np.testing.assert_allclose(1 / x, 1 - known, rtol=0, atol=1e-5)


def test_what_switches_most_is_told_with_three_of_its_places():
    places = [Source("drive.py", line) for line in (7, 8, 9, 10)]
    often = [Event(0.1 * k, "relay.mode", *pair, place) for k, (pair, place) in enumerate(
        zip([("on", "off"), ("off", "on")] * 2, places, strict=True)
    )]  # fmt: skip
    model: Any = SimpleNamespace(
        discrete_position={"relay.mode": 0}, flat_discretes=[SimpleNamespace(hysteresis="")], name="drive"
    )
    told = chattering(
        model, [*often, Event(0.5, "clutch.mode", "free", "stuck", Source("other.py", 1))], "it does", "stop"
    )
    assert told.what == "relay.mode switched 4 times in t = 0…0.3 s (on ⇄ off)."
    assert told.where == tuple(places[:3])


SPAN = 1e6
"""Of a run in s: its 25 events within less than 1 s follow each other ever faster."""


@pytest.mark.parametrize(
    ("groups", "told"),
    [
        ([(3.0, 60, 0.01)], [3.24]),  # once, however many more there are
        ([(3.0, 24, 0.01)], []),
        ([(0.0, 25, 1 / 24)], []),  # as long as the window
        ([(3.0, 25, 0.01), (50.0, 25, 0.02)], [3.24, 50.48]),
        ([(2.0, 25, 1 / 32), (3.75, 25, 1 / 32)], [2.75]),  # not later than a window
        ([(2.0, 25, 1 / 32), (3.765625, 25, 1 / 32)], [2.75, 4.515625]),
    ],
)
def test_every_rest_is_told_once(groups: list[tuple[float, int, float]], told: list[float]) -> None:
    times = [first + step * k for first, count, step in groups for k in range(count)]
    record = Recorder(impacts=[Impact(time, part, 1.0) for time in times for part in ("stop", "gap")])
    place = Source("ball.py", 1)
    # Two parts hit at every instant.
    record.events = [Event(time, "floor", "air", "contact", place) for time in times for _ in range(2)]
    note_rest(record, Options(on_chattering="rest"), SPAN)
    ends = "s on, stop, gap rests in contact: impacts followed each other ever faster."
    assert record.notices == [f"From {time:.9g} {ends}" for time in told]
    note_rest(other := Recorder(events=record.events), Options(), SPAN)
    assert other.notices == []
