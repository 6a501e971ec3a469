"""Events against closed forms: located, ordered, iterated, and never missed."""

import math

import numpy as np
import pytest

from modelica_like import Solution, simulate
from modelica_like.compile.soon import time_resolution
from modelica_like.errors import SolveError
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    all_of,
    any_of,
    der,
    discrete,
    negate,
    param,
    sin,
    var,
)

TIGHT = {"rtol": 1e-11, "atol": 1e-13}


class Clock(Component, partial=True):
    """One variable that runs with time, and two modes."""

    x: Variable = var("s", "time")
    a = Mode("off", "on", "gone")
    b = Mode("off", "on", "gone")
    at: Parameter = param("s", "when", default=0.5)
    rate: Parameter = param("1", "speed of the clock", default=1.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.rate


def story(run: Solution) -> list[tuple[str, str]]:
    return [(event.mode, event.after) for event in run.events]


def times(run: Solution) -> np.ndarray:
    return np.array([event.time for event in run.events])


def test_events_are_as_sharp_as_the_numbers_of_time() -> None:
    times = np.array([-1e6, -0.5, 0.0, 2.0])
    assert [time_resolution(t) for t in times] == pytest.approx([1e-4, 1e-10, 1e-10, 2e-10])


# -- location --------------------------------------------------------------------------------------------------------


class Oscillator(Component):
    x: Variable = var("1", "position")
    v: Variable = var("1/s", "velocity")
    w: Parameter = param("rad/s", "angular frequency", default=20.0)
    limit: Parameter = param("1", "threshold", default=0.9)
    side = Mode("below", "above")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -(self.w**2) * self.x

    def events(self) -> Events:
        yield self.side.go("below", "above", when=self.x > self.limit)
        yield self.side.go("above", "below", when=self.x < self.limit)


def crossings(end: float) -> np.ndarray:
    """Times at which sin(20 t) passes 0.9."""
    first = math.asin(0.9)
    both = [[first + 2 * math.pi * k, math.pi - first + 2 * math.pi * k] for k in range(int(20 * end))]
    found = np.sort(np.ravel(both)) / 20.0
    return found[found <= end]


def test_events_on_a_smooth_guard_are_located_to_a_tenth_of_a_nanosecond():
    run = simulate(Oscillator(x=0.0, v=20.0), 0.6, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(times(run), crossings(0.6), rtol=0, atol=1e-10)


@pytest.mark.parametrize("points", [1, 2, 7, 50, 500])
def test_no_event_is_missed_however_few_results_are_asked_for(points):
    run = simulate(Oscillator(x=0.0, v=20.0), 5.0, points=points, rtol=1e-9, atol=1e-11)
    expected = crossings(5.0)
    assert len(run.events) == len(expected)
    np.testing.assert_allclose(times(run), expected, rtol=0, atol=2e-7)


class Decay(Component):
    x: Variable = var("1", "amount")
    T: Parameter = param("s", "time constant", default=1.0)
    level: Parameter = param("1", "threshold", default=0.5)
    state = Mode("high", "low")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == -self.x

    def events(self) -> Events:
        yield self.state.go("high", "low", when=self.x < self.level)


@pytest.mark.parametrize("level", [0.9, 0.5, 0.1, 1e-2, 1e-3])
def test_a_logarithm_is_located(level):
    run = simulate(Decay(x=1.0, level=level), 20.0, points=20, rtol=1e-13, atol=1e-17)
    np.testing.assert_allclose(times(run), [-math.log(level)], rtol=0, atol=1e-10)


# -- two things at one instant ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("points", [1, 2, 3, 10, 500])
def test_two_guards_at_the_same_instant(points):
    class Twin(Clock):
        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x > self.at)
            yield self.b.go("off", "on", when=3 * self.x > 3 * self.at)

    run = simulate(Twin(x=0.0), 1.0, points=points)
    assert story(run) == [("a", "on"), ("b", "on")]
    np.testing.assert_allclose(times(run), 0.5, rtol=0, atol=1e-12)


def test_of_two_transitions_of_one_mode_the_first_declared_wins():
    class Contest(Clock):
        swap: bool = False

        def events(self) -> Events:
            first, second = ("gone", "on") if self.swap else ("on", "gone")
            yield self.a.go("off", first, when=self.x > self.at)
            yield self.a.go("off", second, when=2 * self.x > 2 * self.at)

    assert story(simulate(Contest(x=0.0), 1.0)) == [("a", "on")]
    assert story(simulate(Contest(x=0.0, swap=True), 1.0)) == [("a", "gone")]


def test_one_event_may_cause_the_next_at_the_same_instant():
    class Chain(Clock):
        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x > self.at)
            yield self.b.go("off", "on", when=self.a.is_("on"))
            yield self.a.go("on", "gone", when=self.b.is_("on"))

    run = simulate(Chain(x=0.0), 1.0)
    assert story(run) == [("a", "on"), ("b", "on"), ("a", "gone")]
    assert len(set(times(run))) == 1


@pytest.mark.parametrize("at", [0.5, 0.3, 1 / 3, 0.1, 0.7])
@pytest.mark.parametrize("points", [7, 10])
def test_a_time_event_and_a_state_event_at_the_same_instant(at, points):
    class Both(Clock):
        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x > self.at)
            yield self.b.go("off", "on", at=self.at)

    run = simulate(Both(x=0.0, at=at), 1.0, points=points)
    assert sorted(story(run)) == [("a", "on"), ("b", "on")]
    np.testing.assert_allclose(times(run), at, rtol=0, atol=1e-12)


@pytest.mark.parametrize("points", [4, 8, 16])
def test_an_event_just_beside_the_grid_of_results_moves_no_later_one(points):
    class Beside(Clock):
        first: Parameter = param("s", "when the other one is")

        def events(self) -> Events:
            yield self.b.go("off", "on", at=self.first)
            yield self.a.go("off", "on", when=self.x > self.at)

    first = 0.5 - 9e-8 / points
    run = simulate(Beside(x=0.0, first=first, at=0.76), 1.0, points=points)
    np.testing.assert_allclose(times(run), [first, 0.76], rtol=0, atol=1e-12)


# -- guards at zero --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rate", "fires"), [(1.0, True), (-1.0, False), (0.0, False)])
def test_a_guard_that_is_zero_at_the_start_counts_by_its_direction(rate, fires):
    class Zero(Clock):
        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x > self.at)

    run = simulate(Zero(x=0.5, rate=rate), 1.0)
    assert list(times(run)) == ([0.0] if fires else [])


@pytest.mark.parametrize("rate", [1.0, 0.0])
def test_a_relation_with_equality_holds_at_zero(rate):
    class Zero(Clock):
        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x >= self.at)

    assert list(times(simulate(Zero(x=0.5, rate=rate), 1.0))) == [0.0]


@pytest.mark.parametrize("at", [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9])
def test_a_guard_that_is_zero_at_an_output_point_fires_once(at):
    class Grid(Clock):
        def events(self) -> Events:
            yield self.a.go("*", "on", when=all_of(self.x > self.at, negate(self.a.is_("on"))))

    run = simulate(Grid(x=0.0, at=at), 1.0, points=10)
    assert story(run) == [("a", "on")]
    np.testing.assert_allclose(times(run), at, rtol=0, atol=1e-12)


@pytest.mark.parametrize("back", [True, False])
def test_a_guard_that_is_zero_right_after_a_reset(back):
    """x is set to the threshold exactly; it fires if x then rises, and not if it falls."""

    class Reset(Clock):
        rising: bool = True

        def equations(self) -> Equations:
            yield der(self.x) == self.a.choose(off=1, on=-1 if self.rising is False else 1, gone=1)

        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x > self.at, reset={self.x: 2 * self.at})
            yield self.b.go("off", "on", when=all_of(self.a.is_("on"), self.x > 2 * self.at))

    run = simulate(Reset(x=0.0, rising=back), 0.8)
    assert story(run) == ([("a", "on"), ("b", "on")] if back else [("a", "on")])


class Parabola(Component):
    """The guard width² - (t - 1 s)² rises above zero for 2 width."""

    x: Variable = var("s", "time")
    width: Parameter = param("s", "half the distance of the roots", default=0.005)
    shift: Parameter = param("s2", "lifts the guard", default=0.0)
    inside = Mode("no", "yes")

    def equations(self) -> Equations:
        yield der(self.x) == 1

    def events(self) -> Events:
        guard = self.width**2 + self.shift - (self.x - self.one) ** 2
        yield self.inside.go("no", "yes", when=guard > 0)
        yield self.inside.go("yes", "no", when=guard < 0)

    one: Parameter = param("s", "middle", default=1.0)


@pytest.mark.parametrize("points", [1, 3, 10, 500])
@pytest.mark.parametrize("width", [5e-3, 5e-4, 5e-5])
def test_two_roots_close_together_are_both_found(width, points):
    run = simulate(Parabola(x=0.0, width=width), 3.0, points=points, **TIGHT)
    np.testing.assert_allclose(times(run), [1 - width, 1 + width], rtol=0, atol=1e-10)


@pytest.mark.parametrize("points", [1, 3, 7, 10, 500])
@pytest.mark.parametrize("shift", [0.0, -1e-12, -1e-9, -1e-6])
def test_a_guard_that_only_touches_zero_does_not_fire(shift, points):
    assert not simulate(Parabola(x=0.0, width=0.0, shift=shift), 3.0, points=points, **TIGHT).events


def test_a_sine_that_touches_zero_at_its_top_does_not_fire():
    class Wave(Clock):
        w: Parameter = param("rad/s", "frequency", default=1.0)

        def events(self) -> Events:
            yield self.a.go("off", "on", when=sin(self.w * self.x) > 1)

    assert not simulate(Wave(x=0.0), 7.0, **TIGHT).events


def test_conditions_joined_by_and_or_not():
    class Joined(Clock):
        def events(self) -> Events:
            early, late = self.x > self.at, self.x > 1.5 * self.at
            yield self.a.go("off", "on", when=all_of(early, late))
            yield self.b.go("off", "on", when=any_of(early, late))
            yield self.b.go("on", "gone", when=negate(any_of(negate(early), negate(late))))

    run = simulate(Joined(x=0.0), 1.0)
    assert story(run) == [("b", "on"), ("a", "on"), ("b", "gone")]
    np.testing.assert_allclose(times(run), [0.5, 0.75, 0.75], rtol=0, atol=1e-12)


def test_a_decaying_signal_is_no_event_any_more() -> None:
    """exp(-t/T) is 1e-30 long before the end, and then nothing but rounding."""

    class Decaying(Component):
        """x' = -x/T, and a mode that asks for its sign."""

        x: Variable = var("1", "what decays")
        T: Parameter = param("s", "time constant", default=0.02)
        sign = Mode("positive", "negative")

        def equations(self) -> Equations:
            yield self.T * der(self.x) == -self.x

        def events(self) -> Events:
            yield self.sign.go("positive", "negative", when=self.x < 0)
            yield self.sign.go("negative", "positive", when=self.x > 0)

    short, long = simulate(Decaying(x=1.0), 20.0, points=500), simulate(Decaying(x=1.0), 200.0, points=5000)
    assert short.events == long.events == ()
    # What rests costs no more searches, however long it rests: only the panels of the longer run are added.
    assert long.statistics.integrations < short.statistics.integrations + 5000 / 8


# -- resets ----------------------------------------------------------------------------------------------------------


def test_resets_are_computed_from_the_values_before_the_event():
    class Swap(Clock):
        u: Discrete = discrete("1", "one", start=1.0)
        w: Discrete = discrete("1", "two", start=2.0)

        def events(self) -> Events:
            yield self.a.go(
                "off", "on", when=self.x > self.at, reset={self.u: self.w, self.w: self.u, self.x: 10 * self.x}
            )

    run = simulate(Swap(x=0.0), 1.0, points=4)
    assert (run.final["u"], run.final["w"]) == (2.0, 1.0)
    assert run.final["x"] == pytest.approx(5.5, rel=1e-12)


def test_two_variables_that_are_no_states_are_reset_together():
    """Sum and difference of two states get values that only one pair of states has, each its own."""

    class Pair(Clock):
        p: Variable = var("1", "one", state="always")
        q: Variable = var("1", "two", state="always")
        total: Variable = var("1", "sum", state="avoid")
        left: Variable = var("1", "difference", state="avoid")

        def equations(self) -> Equations:
            yield from super().equations()
            yield der(self.p) == 0 * self.p
            yield der(self.q) == 0 * self.q
            yield self.total == self.p + self.q
            yield self.left == self.p - self.q

        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x > self.at, reset={self.total: 7.0, self.left: 3.0})

    run = simulate(Pair(x=0.0, p=1.0, q=1.0), 1.0, points=4)
    assert [run.final["p"], run.final["q"]] == pytest.approx([5.0, 2.0], rel=1e-12)


def test_a_variable_that_is_no_state_is_reset_through_the_states():
    """The momentum m v is reset; v, the state, follows."""

    class Hit(Clock):
        v: Variable = var("m/s", "velocity", state="always")
        p: Variable = var("kg.m/s", "momentum", state="avoid")
        m: Parameter = param("kg", "mass", default=4.0)

        def equations(self) -> Equations:
            yield from super().equations()
            yield self.p == self.m * self.v
            yield self.m * der(self.v) == self.force

        force: Parameter = param("N", "force", default=2.0)

        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x > self.at, reset={self.p: -self.p})

    run = simulate(Hit(x=0.0, v=1.0), 1.0, points=2)
    assert set(run.model.states) == {"x", "v"}
    # 1 + 0.25 m/s before, -1.25 after, then 0.25 more.
    assert run.final["v"] == pytest.approx(-1.0, rel=1e-10)
    assert run.final["p"] == pytest.approx(-4.0, rel=1e-10)


# -- an event that is not reached ------------------------------------------------------------------------------------


def test_a_blow_up_before_an_event_that_never_comes():
    class Blow(Clock):
        y: Variable = var("1", "grows")
        T: Parameter = param("s", "time", default=1.0)

        def equations(self) -> Equations:
            yield from super().equations()
            yield self.T * der(self.y) == self.y**2

        def events(self) -> Events:
            yield self.a.go("off", "on", when=self.x > 5 * self.at)

    with pytest.raises(SolveError):
        simulate(Blow(x=0.0, y=1.0), 2.0)


class Thrown(Component):
    """A throw of 1.1 m/s under 2 m/s²: 0.3025 m high after 0.55 s."""

    x: Variable = var("m", "height")
    v: Variable = var("m/s", "speed")
    g: Parameter = param("m/s2", "fall", default=2.0)
    level: Parameter = param("m", "level", default=0.3025 - 1e-6)
    state = Mode("below", "above")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -self.g

    def events(self) -> Events:
        yield self.state.go("below", "above", when=self.x > self.level)


def test_a_top_above_a_level_for_two_thousandths_is_met() -> None:
    thrown = Thrown(x=0.0, v=1.1)
    assert times(simulate(thrown, 1.0, points=1, **TIGHT)) == pytest.approx([0.549], abs=1e-8)
