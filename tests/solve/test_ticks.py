"""Ticks that change nothing that moves cost no restart of IDAS; those that do are found in order, at their times."""

import numpy as np
import pytest

from modelica_like import Solution, simulate
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Parameter,
    Variable,
    all_of,
    any_of,
    boolean,
    clock,
    der,
    discrete,
    if_,
    integer,
    param,
    pre,
    var,
    when,
)


def run(drive: Component, until: float | str) -> Solution:
    return simulate(drive, until, rtol=1e-10, atol=1e-12)


class Meter(Component):
    """Samples an oscillation, and counts its passages through zero."""

    period: Parameter = param("s", "time between two samples", default="5 ms")
    k: Parameter = param("1/s2", "square of the frequency", default=400.0)
    x: Variable = var("m", "position", state="always")
    v: Variable = var("m/s", "speed", state="always")
    n: Discrete = integer("ticks")
    last: Discrete = discrete("m", "latest sample")
    total: Discrete = discrete("m", "sum of the samples")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -self.k * self.x

    def events(self) -> Events:
        tick = clock(self.period)
        yield when(tick, {self.n: pre(self.n) + 1, self.last: self.x, self.total: pre(self.total) + self.last})


def test_a_meter_costs_no_restarts():
    found = run(Meter(x=1.0, v=0.0), 1.5)
    exact = np.cos(20 * 0.005 * np.arange(301))
    assert (found.final["n"], len(found.events)) == (301, 301)
    assert found.final["total"] == pytest.approx(exact.sum(), abs=1e-7)
    # Both sides of a tick are in the results: the sample is that of the time of its tick, from there on.
    begins = [one.times[0] for one in found.segments]
    assert begins == pytest.approx([0.005 * k for k in range(301)], abs=1e-12)
    samples = [one.d[found.model.discrete_position["last"]] for one in found.segments]
    assert samples == pytest.approx(exact, abs=1e-8)
    assert found["x"] == pytest.approx(np.cos(20 * found.time), abs=1e-8)
    without = run(Meter(x=1.0, v=0.0, period=10.0), 1.5)
    assert found.statistics.integrations <= 12
    assert found.statistics.steps <= 2 * without.statistics.steps


class Watched(Meter):
    """The same; each passage through zero notes the latest number of ticks."""

    passages: Discrete = integer("passages")
    ticks: Discrete = integer("ticks before the latest passage")

    def events(self) -> Events:
        yield from super().events()
        yield when(self.x < 0, {self.passages: pre(self.passages) + 1, self.ticks: self.n})


def test_ticks_before_a_state_event_come_before_it():
    found = run(Watched(x=1.0, v=0.0), 1.5)
    passages = np.pi / 2 / 20 + 2 * np.pi / 20 * np.arange(5)
    times = [one.time for one in found.events if one.after == "true"]
    assert times == pytest.approx(passages, abs=1e-9)
    seen = {float(t): found.at(t + 1e-4)["ticks"] for t in passages}
    assert list(seen.values()) == [np.floor(t / 0.005) + 1 for t in seen]
    assert [one.time for one in found.events] == sorted(one.time for one in found.events)


class Room(Component):
    """Heated room whose thermostat looks every half minute."""

    tau: Parameter = param("s", "time constant", default=5000.0)
    hot: Parameter = param("K", "temperature above the outside that the heater reaches", default=30.0)
    low: Parameter = param("K", "switches on below", default=14.0)
    high: Parameter = param("K", "switches off above", default=16.0)
    period: Parameter = param("s", "time between two looks", default=30.0)
    theta: Variable = var("K", "temperature above the outside")
    on: Discrete = boolean("whether it heats")
    looks: Discrete = integer("looks")

    def equations(self) -> Equations:
        yield self.tau * der(self.theta) == if_(self.on, self.hot, 0) - self.theta

    def events(self) -> Events:
        new = any_of(self.theta < self.low, all_of(pre(self.on), self.theta < self.high))
        yield when(clock(self.period), {self.on: new, self.looks: pre(self.looks) + 1})


def test_a_tick_that_switches_takes_the_run_back():
    found = run(Room(theta=12.0), "8 h")
    value, last, on, switched, decay = 12.0, 0.0, False, list[float](), np.exp(-30 / 5000)
    for k in range(961):
        new = value < 14.0 or (on and value < 16.0)
        switched += [30.0 * k] if new != on else []
        on, last = new, value
        target = 30.0 * on
        value = target + (value - target) * decay
    assert found.final["theta"] == pytest.approx(last, abs=1e-8)
    assert found.final["looks"] == 961
    heats = [one.d[found.model.discrete_position["on"]] for one in found.segments]
    changes = np.flatnonzero(np.diff(heats, prepend=0.0))
    assert [found.segments[k].times[0] for k in changes] == pytest.approx(switched, abs=1e-9)
    assert found.statistics.integrations < 200  # 961 ticks


class Emptied(Meter):
    """The hundredth tick moves the mass back."""

    back: Parameter = param("m", "where it goes", default=1.0)

    def events(self) -> Events:
        yield from super().events()
        yield when(self.n >= 100, {self.x: self.back, self.v: 0})


def test_a_tick_that_sets_a_state_takes_the_run_back():
    found = run(Emptied(x=1.0, v=0.0), 1.0)
    back = 99 * 0.005
    assert found.final["x"] == pytest.approx(np.cos(20 * (1.0 - back)), abs=1e-8)
    assert found.final["n"] == 201


class Near(Component):
    """A state event close to the sixth tick notes the number of ticks."""

    period: Parameter = param("s", "time between two ticks", default=0.1)
    gap: Parameter = param("s", "from the tick to the event", default=0.0)
    x: Variable = var("s", "time passed", default=0.0)
    n: Discrete = integer("ticks")
    seen: Discrete = integer("ticks at the event")

    def equations(self) -> Equations:
        yield der(self.x) == 1

    def events(self) -> Events:
        yield when(clock(self.period), {self.n: pre(self.n) + 1})
        yield when(self.x > 5 * self.period + self.gap, {self.seen: self.n})


@pytest.mark.parametrize(("gap", "seen"), [(5e-10, 6), (3e-9, 6), (-5e-10, 5), (-3e-9, 5)])
def test_the_order_of_a_tick_and_an_event_close_to_it(gap: float, seen: int):
    found = run(Near(gap=gap), 1.05)
    assert (found.final["seen"], found.final["n"]) == (seen, 11)


class Controlled(Component):
    """A controller ticks every 50 ms, and a counter every 10 ms."""

    period: Parameter = param("s", "time between two ticks of the controller", default=0.05)
    tau: Parameter = param("s", "time constant", default=0.2)
    x: Variable = var("1", "value")
    u: Discrete = discrete("1", "held input")
    n: Discrete = integer("ticks of the counter")

    def equations(self) -> Equations:
        yield self.tau * der(self.x) == self.u

    def events(self) -> Events:
        yield when(clock(self.period), {self.u: -self.x})
        yield when(clock(self.period / 5), {self.n: pre(self.n) + 1})


def test_quiet_ticks_between_those_of_a_controller_cost_nothing():
    found = run(Controlled(x=1.0), 2.0)
    assert found.final["n"] == 201
    assert found.final["x"] == pytest.approx(0.75**40, abs=1e-9)
    assert found.statistics.integrations <= 42  # 41 ticks of the controller


class Passages(Component):
    """Counts the passages of an oscillation through a height, which nothing that moves reads."""

    k: Parameter = param("1/s2", "square of the frequency", default=400.0)
    height: Parameter = param("m", "height", default=0.25)
    x: Variable = var("m", "position", state="always")
    v: Variable = var("m/s", "speed", state="always")
    n: Discrete = integer("passages")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -self.k * self.x

    def events(self) -> Events:
        yield when(self.x > self.height, {self.n: pre(self.n) + 1})


def test_what_is_only_counted_costs_no_restarts():
    found, without = run(Passages(x=0.0, v=20.0), 10.0), run(Passages(x=0.0, v=20.0, height=2.0), 10.0)
    rises = np.arcsin(0.25) / 20 + 2 * np.pi / 20 * np.arange(32)
    assert found.final["n"] == len(rises)
    assert [one.time for one in found.events if one.after == "true"] == pytest.approx(rises, abs=1e-8)
    assert found["x"] == pytest.approx(np.sin(20 * found.time), abs=1e-7)  # its phase drifts for 32 periods
    assert found.statistics.integrations <= without.statistics.integrations + 2
    assert found.statistics.steps <= 1.1 * without.statistics.steps
