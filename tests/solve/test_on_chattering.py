"""After chattering: sliding along the border between two modes, and rest after impacts without end."""

import math
from typing import Any

import numpy as np
import pytest

from modelica_like import Solution, build, run_fmu, sensitivities, simulate, sweep
from modelica_like.errors import Chattering, UnknownName
from modelica_like.fmi.export import export_fmu
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Hold,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    all_of,
    boolean,
    clock,
    connect,
    delay,
    der,
    discrete,
    if_,
    param,
    signal_in,
    signal_out,
    sin,
    var,
    when,
)

SOLVERS = pytest.mark.parametrize("solver", ["idas", "native"])


def changes(run: Solution) -> list[tuple[float, str, str]]:
    return [(event.time, event.before, event.after) for event in run.events]


# -- sliding ---------------------------------------------------------------------------------------------------------


class Relay(Component):
    """x follows r with the speed ±speed."""

    x: Variable = var("1", "what follows")
    r: Variable = var("1", "reference")
    u: Variable = var("1/s", "speed")
    speed: Parameter = param("1/s", "largest speed", default=1.0)
    slope: Parameter = param("1/s", "of the reference", default=0.5)
    state = Mode("up", "down")

    def equations(self) -> Equations:
        yield self.r == 0.3 + self.slope * self.time
        yield self.u == self.state.choose(up=self.speed, down=-self.speed)
        yield der(self.x) == self.u

    def events(self) -> Events:
        yield self.state.go("up", "down", when=self.x > self.r)
        yield self.state.go("down", "up", when=self.x < self.r)


@SOLVERS
def test_a_relay_tracks_a_ramp(solver):
    """It meets 0.3 + 0.5 t after 0.6 s; then x = r exactly, and u is the mean (1 - a) - a = r' of both modes."""
    run = simulate(Relay(x=0.0), 2.0, on_chattering="slide", solver=solver)
    assert changes(run) == [(pytest.approx(0.6, abs=1e-12), "up", "up ⇄ down")]
    after = run.time > 0.6 + 1e-9
    np.testing.assert_allclose(run["x"][after], run["r"][after], rtol=1e-14)
    np.testing.assert_allclose(run["u"][after], 0.5, rtol=1e-12)
    assert "so it slides" in run.model.events.transitions[run.events[0].transition].because


def test_a_start_on_the_border_slides_at_once():
    run = simulate(Relay(x=0.3), 1.0, on_chattering="slide")
    assert run.events[-1].after == "up ⇄ down"
    assert {event.time for event in run.events} == {0.0}
    assert run.final["x"] == pytest.approx(0.8, rel=1e-12)


def test_a_reference_that_is_too_fast_is_not_followed():
    run = simulate(Relay(x=1.0, slope=2.0), 2.0, on_chattering="slide")
    assert not any("⇄" in after for _, _, after in changes(run))
    run = simulate(Relay(x=1.0, slope=2.0), 2.0, parameters={"speed": 3.0}, on_chattering="slide")
    assert changes(run)[-1][1:] == ("down", "up ⇄ down")


def test_the_slope_of_what_slides():
    """x = 0.3 + slope t."""
    model = build(Relay(x=0.0), on_chattering="slide")
    assert sensitivities(model, of="x", to="slope", until=2.0).derivatives[0, 0] == pytest.approx(2.0, rel=1e-9)


class Sweep(Component):
    """The reference is a sine, with a jump at 2 s."""

    x: Variable = var("1", "what follows")
    r: Variable = var("1", "reference")
    T: Parameter = param("s", "time", default=1.0)
    size: Parameter = param("1", "of the sine", default=0.8)
    jump: Parameter = param("1", "height of the jump", default=0.0)

    def equations(self) -> Equations:
        yield self.r == self.size * sin(2 * self.time / self.T) + if_(self.time > 2 * self.T, self.jump, 0)
        yield self.T * der(self.x) == if_(self.x > self.r, -1, 1)


@SOLVERS
def test_it_leaves_the_border_where_one_mode_leads_away(solver):
    """1.6 cos(2 t) exceeds ±1 at t = pi ± arccos(1 / 1.6) / 2 and so on."""
    run = simulate(Sweep(x=-0.3), 5.0, on_chattering="slide", solver=solver, rtol=1e-9)
    left = [time for time, before, _ in changes(run) if "⇄" in before]
    angle = math.acos(1 / 1.6) / 2
    expected = [math.pi / 2 - angle, math.pi - angle, 3 * math.pi / 2 - angle]
    np.testing.assert_allclose(left, expected, rtol=1e-8)


@SOLVERS
@pytest.mark.parametrize("jump", [1.0, -1.0])
def test_a_jump_of_the_reference_ends_sliding_for_a_while(solver, jump):
    run = simulate(Sweep(x=-0.3, size=0.4, jump=jump), 6.0, on_chattering="slide", solver=solver, rtol=1e-9)
    names = [after for _, _, after in changes(run)]
    away = "false" if jump > 0 else "true"
    assert names == ["false ⇄ true", "true", away, "false ⇄ true"]
    assert run.final["x"] == pytest.approx(run.final["r"], abs=1e-8)


class SlidingMode(Component):
    """A mass under sliding-mode control with the surface v + rate x."""

    x: Variable = var("m", "distance")
    v: Variable = var("m/s", "speed")
    push: Variable = var("N", "force")
    m: Parameter = param("kg", "mass", default=1.5)
    rate: Parameter = param("1/s", "of the decay", default=2.0)
    largest: Parameter = param("N", "force", default=5.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield self.m * der(self.v) == self.push
        yield self.push == if_(self.v + self.rate * self.x > 0, -self.largest, self.largest)


@SOLVERS
def test_sliding_mode_control_of_a_mass(solver):
    """On the surface x decays as exp(-2 t), and the mean force is m rate² x."""
    run = simulate(SlidingMode(x=1.0, v=0.0), 4.0, on_chattering="slide", solver=solver, rtol=1e-10)
    ((begin, _, _),) = changes(run)
    # Before: x = 1 - (F/m) t²/2 and v = -(F/m) t, with 2 x + v = 0.
    assert begin == pytest.approx((-1 + math.sqrt(1 + 4 * 2 / (5 / 1.5))) / 2, rel=1e-8)
    met = 1 - 5 / 1.5 * begin**2 / 2
    assert run.final["x"] == pytest.approx(met * math.exp(-2 * (4 - begin)), rel=1e-6)
    assert run.final["push"] == pytest.approx(1.5 * 4 * run.final["x"], rel=1e-6)


class Blocks(Component):
    """Two blocks with dry friction, which has no mode of sticking, and a damper between them."""

    v: Variable = var("m/s", "speed of the first")
    w: Variable = var("m/s", "speed of the second")
    f: Variable = var("N", "friction of the first")
    g: Variable = var("N", "friction of the second")
    m: Parameter = param("kg", "mass", default=1.0)
    F: Parameter = param("N", "friction", default=1.0)
    c: Parameter = param("N.s/m", "damping", default=2.0)

    def equations(self) -> Equations:
        yield self.f == if_(self.v > 0, self.F, -self.F)
        yield self.g == if_(self.w > 0, self.F, -self.F)
        yield self.m * der(self.v) == -self.f + self.c * (self.w - self.v) + 0.5 * self.F
        yield self.m * der(self.w) == -self.g - self.c * (self.w - self.v) + 0.3 * self.F


@SOLVERS
def test_two_borders_at_once(solver):
    """Both blocks stick: the mean friction is what pushes them."""
    run = simulate(Blocks(v=1.0, w=2.0), 5.0, on_chattering="slide", solver=solver)
    assert [event.after for event in run.events] == 2 * ["false ⇄ true"]
    final = [run.final[name] for name in "vwfg"]
    np.testing.assert_allclose(final, [0, 0, 0.5, 0.3], atol=1e-12)


class Pushed(Component):
    """Dry friction in three branches, with two relations of one border, under a force that swings."""

    v: Variable = var("m/s", "speed")
    f: Variable = var("N", "friction")
    m: Parameter = param("kg", "mass", default=1.0)
    F: Parameter = param("N", "friction", default=1.0)
    D: Parameter = param("N", "amplitude of the force", default=1.7)
    w: Parameter = param("rad/s", "its frequency", default=1.0)

    def equations(self) -> Equations:
        yield self.f == if_(self.v > 0, self.F, if_(self.v < 0, -self.F, 0))
        yield self.m * der(self.v) == self.D * sin(self.w * self.time) - self.f


@SOLVERS
@pytest.mark.parametrize("v", [0.5, 0.0, -0.5])
def test_friction_in_three_branches_sticks(solver, v):
    """It breaks away where 1.7 sin(t) = 1: not before."""
    stuck = simulate(Pushed(v=v, D=0.6), 6.0, on_chattering="slide", solver=solver)
    assert [stuck.final["v"], stuck.final["f"]] == pytest.approx([0.0, 0.6 * math.sin(6.0)], abs=1e-9)
    run = simulate(Pushed(v=v), 6.0, on_chattering="slide", solver=solver)
    left = [time for time, before, after in changes(run) if "⇄" in before]
    away = math.asin(1 / 1.7)
    assert left[-1] == pytest.approx(math.pi + away, rel=1e-7)
    # From there on: v' = 1.7 sin(t) + 1.
    speed = 1.7 * (math.cos(left[-1]) - math.cos(6.0)) + 6.0 - left[-1]
    assert [run.final["v"], run.final["f"]] == pytest.approx([speed, -1.0], abs=1e-6)


class Room(Component):
    """A thermostat without hysteresis, by a Boolean variable; it counts starts, and a meter reads its power."""

    C: Parameter = param("J/K", "heat capacity", default=1e3)
    G: Parameter = param("W/K", "loss", default=10.0)
    P: Parameter = param("W", "power of the heater", default=500.0)
    wish: Parameter = param("K", "wished temperature", default=300.0)
    outside: Parameter = param("K", "temperature outside", default=280.0)
    period: Parameter = param("s", "of the meter", default=40.0)
    inside: Variable = var("K", "temperature")
    power: Variable = var("W", "power")
    heating: Discrete = boolean("whether the heater is on")
    read: Discrete = discrete("W", "power that was read")

    def equations(self) -> Equations:
        yield self.heating == (self.inside < self.wish)
        yield self.power == if_(self.heating, self.P, 0)
        yield self.C * der(self.inside) == self.power - self.G * (self.inside - self.outside)

    def events(self) -> Events:
        yield when(clock(self.period), {self.read: self.power})


@SOLVERS
@pytest.mark.parametrize("start", [285.0, 310.0, 300.0])
def test_a_boolean_variable_slides_with_its_relation(solver, start):
    """On the border the mean power is the loss, 10·20 W, also where it is sampled."""
    run = simulate(Room(inside=start), 600.0, on_chattering="slide", solver=solver)
    final = [run.final[name] for name in ("inside", "power", "read", "heating")]
    assert final == pytest.approx([300.0, 200.0, 200.0, 0.0], rel=1e-9)


class Late(Component):
    """What slides, seen later."""

    x: Variable = var("1", "what follows")
    u: Variable = var("1/s", "speed")
    seen: Variable = var("1/s", "speed before")
    T: Parameter = param("s", "time", default=1.0)
    lag: Parameter = param("s", "delay", default=0.3)

    def equations(self) -> Equations:
        yield self.u == if_(self.x > 0.5 * sin(self.time / self.T), -1, 1) / self.T
        yield der(self.x) == self.u
        yield self.seen == delay(self.u, self.lag)


def test_a_delay_sees_the_mean():
    """x = sin(t) / 2 from the meeting on, and u = cos(t) / 2."""
    run = simulate(Late(x=-0.1), 3.0, on_chattering="slide", rtol=1e-9)
    assert [run.final["u"], run.final["seen"]] == pytest.approx([math.cos(3.0) / 2, math.cos(2.7) / 2], abs=1e-7)


class Part(Component):
    """One of several that switch together."""

    x: Input = signal_in("1", "what they share")
    y: Output = signal_out("1", "direction")

    def equations(self) -> Equations:
        yield self.y == if_(self.x > 0, -1, 1)


class Together(Component):
    a, b = Part(), Part()
    x: Output = signal_out("1", "value")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield connect(self.x, self.a.x, self.b.x)
        yield self.T * der(self.x) == self.a.y + self.b.y + 0.5


@SOLVERS
def test_parts_with_the_same_border_slide_together(solver):
    run = simulate(Together(x=1.0), 2.0, on_chattering="slide", solver=solver)
    assert [event.time for event in run.events] == pytest.approx([1 / 1.5, 1 / 1.5])
    final = [run.final[name] for name in ("x", "a.y", "b.y")]
    np.testing.assert_allclose(final, [0, -0.25, -0.25], atol=1e-12)


class Steps(Component):
    """Three values, and two borders of one mode."""

    x: Variable = var("1", "value")
    T: Parameter = param("s", "time", default=1.0)
    drift: Parameter = param("1", "drift", default=-0.3)
    out = Mode("low", "middle", "high", start="middle")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.out.choose(low=1, middle=0, high=-1) + self.drift

    def events(self) -> Events:
        yield self.out.go("low", "middle", when=self.x > -0.1)
        yield self.out.go("middle", "low", when=self.x < -0.1)
        yield self.out.go("middle", "high", when=self.x > 0.1)
        yield self.out.go("high", "middle", when=self.x < 0.1)


@pytest.mark.parametrize(("drift", "name"), [(-0.3, "low ⇄ middle"), (0.3, "middle ⇄ high")])
def test_three_values(drift, name):
    run = simulate(Steps(x=0.0, drift=drift), 2.0, on_chattering="slide")
    assert changes(run) == [(pytest.approx(1 / 3), "middle", name)]
    assert abs(run.final["x"]) == pytest.approx(0.1, rel=1e-12)


class Implicit(Component):
    """The relay acts through equations that stay implicit: (3 + ones)·y = (u, 0, …), so y[0] = 8 u / 27."""

    x: Variable = var("1", "value")
    a: Variable = var("1/s", "first")
    b: Variable = var("1/s", "second")
    c: Variable = var("1/s", "third")
    e: Variable = var("1/s", "fourth")
    f: Variable = var("1/s", "fifth")
    g: Variable = var("1/s", "sixth")
    rate: Parameter = param("1/s", "rate", default=1.0)
    state = Mode("up", "down")

    def equations(self) -> Equations:
        first, *others = self.a, self.b, self.c, self.e, self.f, self.g
        total = first + sum(others)
        yield der(self.x) == first - 0.1 * self.rate
        yield 3 * first + total == self.rate * self.state.choose(up=1, down=-1)
        for one in others:
            yield 3 * one + total == 0

    def events(self) -> Events:
        yield self.state.go("up", "down", when=self.x > 0)
        yield self.state.go("down", "up", when=self.x < 0)


@SOLVERS
def test_implicit_equations_follow_the_mix(solver):
    model = build(Implicit(x=0.5))
    assert model.implicit
    run = simulate(model, 3.0, on_chattering="slide", solver=solver)
    assert changes(run)[-1][2] == "up ⇄ down"
    final = [run.final[name] for name in "xabcefg"]
    np.testing.assert_allclose(final, [0, 0.1, *(5 * [-0.1 / 8])], atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["me", "cs"])
@pytest.mark.parametrize("asked", ["slide", "rest"])
def test_an_fmu_does_the_same(kind: Any, asked: Any, tmp_path):
    part: Component = Sweep(x=-0.3, size=0.4, jump=1.0) if asked == "slide" else Ball(h=1.0, v=0.0)
    model = build(part, on_chattering=asked)
    export_fmu(model, tmp_path / "a.fmu", kind=(kind,), check=False)
    names = [*model.states]
    run, expected = run_fmu(tmp_path / "a.fmu", stop=6.0, kind=kind, outputs=names), simulate(model, 6.0)
    np.testing.assert_allclose([run.final[n] for n in names], [expected.final[n] for n in names], atol=1e-5)


def test_a_sweep_does_the_same():
    """x = 0.3 + 2·slope."""
    for solver in ("native", "idas"):
        found = sweep(
            Relay(x=0.0), {"slope": [0.1, 0.5]}, ["x"], until=2.0, solver=solver, on_chattering="slide", processes=1
        )
        np.testing.assert_allclose(found["x"], [0.5, 1.3], rtol=1e-8)
        assert not found["failure"].values.any()


# -- rest ------------------------------------------------------------------------------------------------------------


class Ball(Component):
    """It falls from 1 m, bounces, and lies on the floor until it is lifted at the time T."""

    h: Variable = var("m", "height")
    v: Variable = var("m/s", "velocity", state="always")
    N: Variable = var("N", "force of the floor")
    against: Variable = var("N", "the same, against upward motion")
    m: Parameter = param("kg", "mass", default=2.0)
    g: Parameter = param("m/s2", "gravity", default=9.81)
    e: Parameter = param("1", "restitution", default=0.7)
    lift: Parameter = param("N", "lift", default=30.0)
    T: Parameter = param("s", "time of lifting", default=5.0)
    end: Parameter = param("s", "when it is let go again", default=1e9)
    floor = Mode("air", "contact", holds={"contact": Hold("v", reaction="against", capacity="limits", restitution="e")})

    def limits(self) -> tuple[float, None]:
        return 0.0, None

    def equations(self) -> Equations:
        yield der(self.h) == self.v
        yield self.against == -self.N
        lifted = all_of(self.time > self.T, self.time < self.end)
        yield self.m * der(self.v) == self.N - self.m * self.g + if_(lifted, self.lift, 0)
        yield self.floor.choose(air=self.N, contact=der(self.v)) == 0

    def events(self) -> Events:
        yield self.floor.initially("air", when=self.v > 0)
        yield self.floor.go("air", "contact", when=all_of(self.h < 0, self.v < 0), reset={self.h: 0})
        yield self.floor.go("contact", "air", when=self.N < 0)


@SOLVERS
@pytest.mark.parametrize("e", [0.5, 0.7])
def test_a_ball_lies_still_and_rises_again(solver, e):
    run = simulate(Ball(h=1.0, v=0.0, e=e), 6.0, on_chattering="rest", solver=solver)
    limit = math.sqrt(2 / 9.81) * (1 + 2 * e / (1 - e))
    rests = [time for time, _, after in changes(run) if after == "contact"][-1]
    assert rests == pytest.approx(limit, rel=3e-6)
    assert run.at(4.9)["N"] == pytest.approx(2.0 * 9.81, rel=1e-12)
    assert (run.at(4.9)["h"], run.at(4.9)["v"]) == (0.0, 0.0)
    assert run.final["h"] == pytest.approx(0.5 * (30 / 2 - 9.81), rel=1e-8)
    assert sum(impact.energy for impact in run.impacts) == pytest.approx(2.0 * 9.81, rel=1e-6)
    # With 0.5, impacts become rounding before there are too many.
    told = "rests in contact: impacts followed each other ever faster."
    assert [notice.partition("model ")[2] for notice in run.notices] == ([told] if e == 0.7 else [])


@SOLVERS
@pytest.mark.parametrize("unit", [1.0, 1e-4, 1e3])
def test_a_ball_that_has_been_lifted_bounces_again(solver, unit):
    """In any unit of time: it falls from 1 m, lies still, is lifted for 0.5 units, and comes down."""
    lifted, g = 4.0, 9.81 / unit**2
    ball = Ball(h=1.0, v=0.0, g=g, lift=30.0 / unit**2, T=lifted * unit, end=(lifted + 0.5) * unit)
    run = simulate(ball, 8 * unit, on_chattering="rest", solver=solver)
    speed, height = (30 / 2 - 9.81) * 0.5, 0.5 * (30 / 2 - 9.81) * 0.25
    comes = lifted + 0.5 + (speed + math.sqrt(speed**2 + 2 * 9.81 * height)) / 9.81
    hits = [time / unit for time, _, after in changes(run) if after == "contact"]
    second = [time for time in hits if time > lifted]
    assert second[0] == pytest.approx(comes, rel=1e-8)
    assert second[1] - second[0] == pytest.approx(2 * 0.7 * math.sqrt(speed**2 + 2 * 9.81 * height) / 9.81, rel=1e-6)
    assert len(second) > 20
    assert run.final["h"] == 0.0


@SOLVERS
def test_without_being_asked_both_end_with_a_sentence(solver):
    for part in (Ball(h=1.0, v=0.0), Relay(x=0.0)):
        with pytest.raises(Chattering, match="Or go on: on_chattering"):
            simulate(part, 6.0, solver=solver)


@SOLVERS
def test_the_other_way_does_not_help(solver):
    with pytest.raises(Chattering, match="Nothing comes to rest"):
        simulate(Relay(x=0.0), 2.0, on_chattering="rest", solver=solver)
    with pytest.raises(Chattering, match="It cannot slide"):
        simulate(Ball(h=1.0, v=0.0), 6.0, on_chattering="slide", solver=solver)


def test_a_word_that_is_unknown():
    with pytest.raises(UnknownName, match="did you mean 'slide'"):
        simulate(Relay(x=0.0), 2.0, on_chattering="slid")  # pyright: ignore[reportArgumentType]
