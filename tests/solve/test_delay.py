"""Delays against closed forms: method of steps, jumps and kinks that come again, loops, derivatives, several delays."""

from collections.abc import Callable
from math import factorial
from typing import Any

import numpy as np
import pytest

from modelica_like import Solution, simulate
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Input,
    Output,
    Parameter,
    Variable,
    clock,
    connect,
    delay,
    der,
    discrete,
    if_,
    integer,
    maximum,
    minimum,
    mod,
    param,
    pre,
    signal_in,
    signal_out,
    sin,
    var,
    when,
)

Run = Callable[..., Solution]


@pytest.fixture(params=["idas", "native"])
def run(request: pytest.FixtureRequest) -> Run:
    def run(drive: Component, until: float, rtol: float = 1e-9) -> Solution:
        return simulate(drive, until, rtol=rtol, atol=rtol * 1e-2, solver=request.param)

    return run


class Feedback(Component):
    """y' = -y(t - 1), with y = 1 up to the start."""

    T: Parameter = param("s", "delay", default=1.0)
    tau: Parameter = param("s", "time constant", default=1.0)
    y: Variable = var("1", "value")

    def equations(self) -> Equations:
        yield self.tau * der(self.y) == -delay(self.y, self.T)


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-9])
def test_polynomials_of_the_method_of_steps(run: Run, rtol: float):
    found = run(Feedback(y=1.0), 10.0, rtol)
    terms = [(-1) ** k * np.maximum(found.time - (k - 1), 0) ** k / factorial(k) for k in range(12)]
    assert found["y"] == pytest.approx(np.sum(terms, axis=0), abs=3 * rtol)
    assert sum(len(one.times) > 1 for one in found.segments) == 10  # one for each delay
    assert found.at(3.5)["y"] == pytest.approx(np.interp(3.5, found.time, found["y"]), abs=1e-4)


class Fast(Component):
    """The past has sixteen periods in one delay."""

    T: Parameter = param("s", "delay", default=1.0)
    f: Parameter = param("rad/s", "frequency", default=100.0)
    y: Variable = var("1", "delayed sine")
    x: Variable = var("rad", "its integral", default=0.0)

    def equations(self) -> Equations:
        yield self.y == delay(sin(self.f * self.time), self.T)
        yield der(self.x) == self.f * self.y


def test_pieces_are_shorter_where_the_past_moves_fast(run: Run):
    found = run(Fast(), 1.7)
    late = np.maximum(found.time - 1.0, 0.0)
    assert found["y"] == pytest.approx(np.sin(100 * late), abs=1e-8)
    assert found["x"] == pytest.approx(1 - np.cos(100 * late), abs=1e-6)  # without a delay IDAS is off by 2e-7


class Uneven(Component):
    """A decay is delayed, while the kinks of another rate make some steps very short."""

    T: Parameter = param("s", "delay", default=0.2)
    tau: Parameter = param("s", "time constant", default=1.0)
    x: Variable = var("1", "decays", default=1.0)
    q: Variable = var("1", "integral of a rate with kinks", default=0.0)
    late: Variable = var("1", "x, later")

    def equations(self) -> Equations:
        t = self.time / self.tau
        yield self.late == delay(self.x, self.T)
        yield self.tau * der(self.x) == -self.x
        yield self.tau * der(self.q) == minimum(sin(0.5 * t), maximum(self.x, sin(4 * t)))


@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8, 1e-9])
def test_short_steps_beside_long_ones_leave_the_past_as_it_was(run: Run, rtol: float):
    """The past has the errors of the run, up to about ten tolerances with IDAS, and no more."""
    found = run(Uneven(), 4.0, rtol)
    late = found.time > 0.2
    assert found["late"][late] == pytest.approx(np.exp(0.2 - found.time[late]), abs=20 * rtol)


class Relay(Component):
    """Runs back where it was on the other side one second ago: a triangle of period 4 s."""

    T: Parameter = param("s", "delay", default=1.0)
    y: Variable = var("s", "value")
    late: Variable = var("s", "the same later")

    def equations(self) -> Equations:
        yield self.late == delay(self.y, self.T)
        yield der(self.y) == if_(self.late < 0, 1, -1)


def test_guards_of_delayed_values_are_located(run: Run):
    found = run(Relay(y=0.5), 20.0)
    corners = [0.0, *(1.5 + 2 * k for k in range(11))]
    heights = [0.5, *((-1.0) ** (k + 1) for k in range(11))]
    assert [event.time for event in found.events] == pytest.approx(corners[1:11], abs=1e-9)
    assert found["y"] == pytest.approx(np.interp(found.time, corners, heights), abs=1e-8)


class Square(Component):
    """Delays what jumps: a square wave, a held number, and a loop without states."""

    T: Parameter = param("s", "delay", default=0.3)
    period: Parameter = param("s", "of the square wave", default=1.0)
    share: Parameter = param("1", "what comes back", default=0.5)
    u: Variable = var("1", "square wave")
    y: Variable = var("1", "later")
    z: Variable = var("1", "with all that comes back")
    late: Variable = var("1", "the held number later")
    x: Variable = var("1", "lag of y", default=1.0)
    held: Discrete = discrete("1", "number of ticks")
    beyond: Discrete = integer("how often the delayed number has passed 3.5")

    def equations(self) -> Equations:
        yield self.u == if_(mod(self.time, self.period, events=True) < 0.5 * self.period, 1, 0)
        yield self.y == delay(self.u, self.T)
        yield self.z == self.u + self.share * delay(self.z, self.T)
        yield self.late == delay(self.held, self.T)
        yield self.T * der(self.x) == self.y - self.x

    def events(self) -> Events:
        yield when(clock(self.period / 4), {self.held: pre(self.held) + 1})
        yield when(self.late > 3.5, {self.beyond: pre(self.beyond) + 1})


def test_jumps_come_again_exactly_later(run: Run):
    found = run(Square(), 5.0)
    # Between jumps: those of u every half second, of the number every quarter, both again every 0.3 s.
    jumps = np.unique(np.round([0.25 * k + 0.3 * n for k in range(21) for n in range(18)], 9))
    clear = np.abs(found.time[:, None] - jumps).min(axis=1) > 1e-6
    time = found.time[clear]

    def wave(t: Any) -> Any:
        return np.where(t < 0, 1.0, (np.mod(t, 1.0) < 0.5) * 1.0)

    assert found["y"][clear] == pytest.approx(wave(time - 0.3), abs=1e-12)
    assert found["late"][clear] == pytest.approx(np.where(time < 0.3, 1, np.floor((time - 0.3) / 0.25) + 1), abs=1e-12)
    count = np.floor(time / 0.3) + 1  # how often it has come back; before the start z = 1 + z / 2
    echoes = sum(0.5**k * wave(time - 0.3 * k) * (k < count) for k in range(18))
    assert found["z"][clear] == pytest.approx(echoes + 0.5**count * 2.0, abs=1e-12)
    assert found.final["beyond"] == 1
    assert min(abs(event.time - 1.05) for event in found.events if event.after == "true") < 1e-12
    # The lag passes the jumps of its input at 0.8 s and 1.3 s.
    assert found.at(0.9)["x"] == pytest.approx(np.exp(-0.1 / 0.3), abs=1e-8)
    assert found.at(1.4)["x"] == pytest.approx(1 - (1 - np.exp(-0.5 / 0.3)) * np.exp(-0.1 / 0.3), abs=1e-8)


class Line(Component):
    """A dead time."""

    T: Parameter = param("s", "delay", default=0.2)
    u: Input = signal_in("1", "given")
    y: Output = signal_out("1", "later")

    def equations(self) -> Equations:
        yield self.y == delay(self.u, self.T)


class Source(Component):
    """A sine, and what has the delayed sine as its position: its speed is the delayed cosine."""

    f: Parameter = param("rad/s", "frequency", default=3.0)
    y: Output = signal_out("1", "sine")
    back: Input = signal_in("1", "delayed")
    speed: Variable = var("1/s", "rate of the delayed sine")

    def equations(self) -> Equations:
        yield self.y == sin(self.f * self.time)
        yield self.speed == der(self.back)


class Chain(Component):
    source = Source()
    first = Line()
    second = Line(T=0.45)

    def equations(self) -> Equations:
        yield connect(self.source.y, self.first.u)
        yield connect(self.first.y, self.second.u)
        yield connect(self.second.y, self.source.back)


def test_a_chain_of_delays_and_the_rate_of_its_end(run: Run):
    found = run(Chain(), 3.0)
    late = np.maximum(found.time - 0.65, 0.0)
    assert found["second.y"] == pytest.approx(np.sin(3.0 * late), abs=1e-8)
    clear = np.abs(found.time - 0.65) > 1e-9
    rate = np.where(found.time > 0.65, 3.0 * np.cos(3.0 * late), 0.0)
    assert found["source.speed"][clear] == pytest.approx(rate[clear], abs=1e-6)


class Rod(Component):
    """A rod without losses, by the waves in both directions: one end is moved from 0.25 s on, the other is free."""

    T: Parameter = param("s", "time of a wave from end to end", default=1.0)
    Z: Parameter = param("N.s/m", "impedance", default=2.0)
    speed: Parameter = param("m/s", "of the moved end", default=1.0)
    begin: Parameter = param("s", "when it moves", default=0.25)
    v_a: Variable = var("m/s", "speed of the moved end")
    v_b: Variable = var("m/s", "speed of the free end")
    F_a: Variable = var("N", "force at the moved end")
    F_b: Variable = var("N", "force at the free end")

    def equations(self) -> Equations:
        yield self.v_a == if_(self.time > self.begin, self.speed, 0)
        yield self.F_b == 0
        yield self.F_b + self.Z * self.v_b == delay(self.F_a + self.Z * self.v_a, self.T)
        yield self.F_a - self.Z * self.v_a == delay(self.F_b - self.Z * self.v_b, self.T)


def test_waves_run_to_and_fro_in_a_rod(run: Run):
    found = run(Rod(), 9.0)
    clear = np.abs(np.mod(found.time + 0.25, 1.0) - 0.5) > 1e-6
    time = found.time[clear]
    moves = (time > 1.25) & (np.mod(time - 1.25, 4.0) < 2.0)
    assert found["v_b"][clear] == pytest.approx(2.0 * moves, abs=1e-12)


class Neutral(Component):
    """y' = -y'(t - 1) / 2 - y: the rate itself is delayed, and at the start it depends on itself."""

    T: Parameter = param("s", "delay", default=1.0)
    tau: Parameter = param("s", "time constant", default=1.0)
    y: Variable = var("1", "value")

    def equations(self) -> Equations:
        yield der(self.y) == -0.5 * delay(der(self.y), self.T) - self.y / self.tau


def test_a_delayed_rate(run: Run):
    found = run(Neutral(y=1.0), 2.0)
    early, late = found.time <= 1.0, found.time - 1.0
    first = 1 / 3 + 2 / 3 * np.exp(-1.0)
    exact = np.where(early, (1 + 2 * np.exp(-found.time)) / 3, np.exp(-late) * (first + late / 3))
    assert found["y"] == pytest.approx(exact, abs=1e-8)
