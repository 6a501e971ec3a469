"""Errors of discrete equations.

Lines of this file are written as {marker}, the line that ends in `# marker`.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from modelica_like import build, export_fmu, run_fmu, simulate
from modelica_like.errors import Chattering, FmuFailed, LanguageError, ModelicaLikeError, StructureError, UnitMismatch
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    boolean,
    clock,
    der,
    discrete,
    edge,
    hold,
    integer,
    negate,
    param,
    pre,
    previous,
    sample,
    terminate,
    var,
    when,
)


class Basis(Component, partial=True):
    x: Variable = var("1", "moves", default=0)
    T: Parameter = param("s", "time", default=0.1)
    n: Discrete = integer("count")
    on: Discrete = boolean("switch")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1 - self.x

    def events(self) -> Events:
        yield when(self.x > 0.5, {self.n: pre(self.n) + 1})  # basis


class Rebound(Component):
    units_checked = False
    h: Variable = var("m", "height", default=1.0)
    v: Variable = var("m/s", "velocity", state="always", default=0.0)
    e: Parameter = param("1", "restitution", default=0.5)

    def equations(self) -> Equations:
        yield der(self.h) == self.v
        yield der(self.v) == -9.81

    def events(self) -> Events:
        yield when(self.h < 0, {self.v: -self.e * self.v})  # rebound


UNKNOWN = "is at {top}"


class EndsByUnknown(Basis):
    def events(self) -> Events:
        yield when(self.x > 0.5, {self.n: 1, **terminate(UNKNOWN)})  # ending


class Undetermined(Basis):
    pass


class Twice(Basis):
    def equations(self) -> Equations:
        yield from super().equations()
        yield self.on == (self.x > 0.5)
        yield self.n == 3  # twice


class Reset(Basis):
    gate = Mode("open")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.on == (self.x > 0.5)

    def events(self) -> Events:
        yield from super().events()
        yield self.gate.go("open", "open", when=self.x > 0.2, reset={self.n: 0})  # reset


class Loop(Basis):
    off: Discrete = boolean("opposite")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.on == negate(self.off)  # loop on
        yield self.off == negate(self.on)  # loop off


class Itself(Basis):
    def equations(self) -> Equations:
        yield from super().equations()
        yield self.on == negate(self.on)  # itself


class Endless(Basis):
    def equations(self) -> Equations:
        yield from super().equations()
        yield self.on == negate(pre(self.on))  # endless


class Follows(Basis):
    twin: Discrete = integer("twin")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.on == (self.x > 0.5)
        yield self.twin == 2 * self.x  # follows


class Constant(Basis):
    def events(self) -> Events:
        yield when(self.T > 0, {self.n: 1})  # constant


class NoCondition(Basis):
    def events(self) -> Events:
        yield when(self.x, {self.n: 1})  # no condition


class Equal(Basis):
    def events(self) -> Events:
        yield when(self.x == 0.5, {self.n: 1})  # equal


class Parameters(Basis):
    def events(self) -> Events:
        yield when(self.x > 0.5, {self.T: 1})  # parameters


class Units(Basis):
    def events(self) -> Events:
        yield when(self.x > 0.5, {self.n: self.T})  # units


class Outside(Basis):
    gate = Mode("open")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.on == (self.x > 0.5)

    def events(self) -> Events:
        yield from super().events()
        yield self.gate.go("open", "open", when=edge(self.on))  # outside


class Varying(Basis):
    def events(self) -> Events:
        yield when(clock(self.T * self.x), {self.n: 1})  # varying


class Written(Basis):
    def events(self) -> Events:
        yield when(clock("0.2 s"), {self.n: 1})  # written


class Backwards(Basis):
    def equations(self) -> Equations:
        yield from super().equations()
        yield self.on == (self.x > 0.5)

    def events(self) -> Events:
        yield when(clock(-self.T), {self.n: pre(self.n) + 1})  # backwards


class PreOfVariable(Basis):
    def events(self) -> Events:
        yield when(self.x > 0.5, {self.n: pre(self.x)})  # pre


class Held(Basis):
    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1 - hold(self.x)  # held
        yield self.on == (self.x > 0.5)


class SampledOutside(Basis):
    def events(self) -> Events:
        yield when(self.x > 0.5, {self.n: sample(self.x)})  # sampled


class PreviousOutside(Basis):
    def equations(self) -> Equations:
        yield self.T * der(self.x) == previous(self.n) - self.x  # previous
        yield self.on == (self.x > 0.5)


HERE = "test_discrete_messages.py"
BASIS = "`when(self.x > 0.5, {self.n: pre(self.n) + 1})`"
CASES: dict[type[Component], tuple[type[ModelicaLikeError], str]] = {
    Undetermined: (
        LanguageError,
        "Undetermined: nothing determines the discrete variable on.\n"
        "Yield self.on == …, or set it in a `when` or a reset.",
    ),
    EndsByUnknown: (
        LanguageError,
        "EndsByUnknown: the text of terminate(…) names top, which is not declared.\n"
        f"  in {HERE}:{{ending}} `yield when(self.x > 0.5, {{self.n: 1, **terminate(UNKNOWN)}})`",
    ),
    Twice: (
        LanguageError,
        "Twice: n is determined twice.\n"
        f"  in {HERE}:{{twice}} `yield self.n == 3`\n"
        f"  in {HERE}:{{basis}} `yield {BASIS[1:]}\n"
        "Join them: when(…).elsewhen(…), or one equation.",
    ),
    Reset: (
        LanguageError,
        "Reset: n is set by a transition and determined by an equation or a `when`.\n"
        f"  in {HERE}:{{basis}} `yield {BASIS[1:]}\n"
        f'  in {HERE}:{{reset}} `yield self.gate.go("open", "open", when=self.x > 0.2, reset={{self.n: 0}})`\n'
        "Keep one of the two.",
    ),
    Loop: (
        StructureError,
        "Discrete variables determine each other in a loop: on → off → on.\n"
        f"  in {HERE}:{{loop on}} `yield self.on == negate(self.off)`\n"
        f"  in {HERE}:{{loop off}} `yield self.off == negate(self.on)`\n"
        "Use a value from before the event, pre(…), at one place of the loop.",
    ),
    Itself: (
        StructureError,
        "on determines itself at an event.\n"
        f"  in {HERE}:{{itself}} `yield self.on == negate(self.on)`\n"
        "Use a value from before the event, pre(…), at one place of the loop.",
    ),
    Endless: (
        Chattering,
        "Discrete variables do not settle at t = 0 s: on still changes after 20 rounds.\n"
        f"  in {HERE}:{{endless}} `yield self.on == negate(pre(self.on))`\n"
        "An equation like n == pre(n) + 1 never equals its pre(…): count in a `when`.",
    ),
    Follows: (
        LanguageError,
        "Follows: twin changes at events only, but its equation follows x all the time.\n"
        f"  in {HERE}:{{follows}} `yield self.twin == 2 * self.x`\n"
        "Take the value in a `when`, or choose with if_(…): its relations make events.",
    ),
    Constant: (
        LanguageError,
        "when((0<T), …) has no edge: its condition is the same during the whole run.\n"
        f"  in {HERE}:{{constant}} `when(self.T > 0, {{self.n: 1}})`\n"
        "Compare what changes, such as a variable or time.",
    ),
    NoCondition: (
        LanguageError,
        "x is not a condition: it changes continuously.\n"
        f"  in {HERE}:{{no condition}} `when(self.x, {{self.n: 1}})`\n"
        "Write a relation, as in `self.w > 0`, or a Boolean variable.",
    ),
    Equal: (
        LanguageError,
        "(x==0.5) compares values that change continuously: they are equal at single instants only.\n"
        f"  in {HERE}:{{equal}} `when(self.x == 0.5, {{self.n: 1}})`\n"
        "Write a relation with < or >.",
    ),
    Parameters: (
        LanguageError,
        "Parameters: a `when` gives T a value, which is neither a variable nor discrete.\n"
        f"  in {HERE}:{{parameters}} `yield when(self.x > 0.5, {{self.T: 1}})`\n"
        "Name variables, as in {self.n: pre(self.n)}.",
    ),
    Units: (
        UnitMismatch,
        f"Units, {HERE}:{{units}} `yield when(self.x > 0.5, {{self.n: self.T}})`: left 1, right s.",
    ),
    Outside: (
        LanguageError,
        "Outside: pre(on) is in a transition, where it never differs from on.\n"
        f'  in {HERE}:{{outside}} `yield self.gate.go("open", "open", when=edge(self.on))`\n'
        "Write on: in a reset it is the value before. For an edge, write once=True.",
    ),
    Varying: (
        LanguageError,
        "The ticks of clock((T*x)) are not known in advance, because they move between events.\n"
        f"  in {HERE}:{{varying}} `clock(self.T * self.x)`\n"
        "Use parameters or discrete variables.",
    ),
    Written: (
        LanguageError,
        "A time of a clock is an expression of parameters, not the text '0.2 s'.\n"
        f'  in {HERE}:{{written}} `clock("0.2 s")`\n'
        'Declare it, T = param("s", "period", default="0.2 s"), and use self.T.',
    ),
    Backwards: (
        Chattering,
        "clock[1] switched 20 times at t = 0 s (counting).\n"
        f"  in {HERE}:{{backwards}} `yield when(clock(-self.T), {{self.n: pre(self.n) + 1}})`\n"
        "Modes still switch after 20 rounds at one instant.\n"
        "Give the switching a hysteresis (a peak above 1 in friction), or smooth what drives it. "
        'Or go on: on_chattering = "slide" along the border of two modes, "rest" in contact after ever faster impacts.',
    ),
    PreOfVariable: (
        LanguageError,
        "pre(x): only a discrete, Boolean or integer variable has a value before an event.\n"
        f"  in {HERE}:{{pre}} `pre(self.x)`\n"
        "For a mode, declare boolean(…) and set it by an equation.",
    ),
    Held: (
        LanguageError,
        "hold(x): this changes between ticks, so it is not held.\n"
        f"  in {HERE}:{{held}} `hold(self.x)`\n"
        "Take it at the ticks: when(clock(…), {self.held: sample(…)}).",
    ),
    SampledOutside: (
        LanguageError,
        "SampledOutside: sample(x) is outside of the new values of a when(clock(…), …).\n"
        f"  in {HERE}:{{sampled}} `yield when(self.x > 0.5, {{self.n: sample(self.x)}})`\n"
        "Elsewhere write x itself.",
    ),
    PreviousOutside: (
        LanguageError,
        "PreviousOutside: previous(n) is outside of the new values of a when(clock(…), …).\n"
        f"  in {HERE}:{{previous}} `yield self.T * der(self.x) == previous(self.n) - self.x`\n"
        "Elsewhere write pre(n), the value before an event.",
    ),
}


@pytest.mark.parametrize("kind", CASES, ids=lambda kind: kind.__name__)
def test_messages_of_discrete_equations(
    kind: type[Component], check_message: Callable[[type[ModelicaLikeError], Callable[[], object], str], None]
) -> None:
    check_message(CASES[kind][0], lambda: simulate(build(kind()), 1.0), CASES[kind][1])


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_ball_that_comes_to_rest_does_not_fall_through_the_floor(
    solver: Any,
    check_message: Callable[[type[ModelicaLikeError], Callable[[], object], str], None],
) -> None:
    """It rebounds until (1 + e) / (1 - e) times its first fall, sqrt(2 m / 9.81 m/s2), is over: 0.5518622279 s."""
    text = (
        "At 0.551862228 s the condition of relation[1] stays true: what is set there is at rest, and would pass "
        "without another event.\n"
        f"  in {HERE}:{{rebound}} `yield when(self.h < 0, {{self.v: -self.e * self.v}})`\n"
        "Let it rest: a mode that holds the motion, with a restitution (docs/language.md, what a mode holds), or a "
        "smallest speed below which `when` sets zero and a mode keeps it. What stops once and goes on from there is a "
        "transition of a mode with a reset."
    )
    check_message(Chattering, lambda: simulate(build(Rebound(e=0.1)), 3.0, solver=solver), text)


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("e", [0.0, 1e-12, 1e-9, 1e-8, 1e-6, 1e-4])
@pytest.mark.parametrize("h", [0.3, 1.0])
def test_a_ball_that_hardly_rebounds_does_not_fall_through_either(solver: Any, e: float, h: float) -> None:
    """It is fast before the one impact, and at rest after it."""
    with pytest.raises(Chattering):
        simulate(build(Rebound(e=e, h=h)), 3.0, solver=solver)


class Once(Rebound):
    """Stops at h = 0.5 m, and falls on from there, as its message says one has to write it."""

    place = Mode("above", "below", start="above")

    def events(self) -> Events:
        yield self.place.go("above", "below", when=self.h < 0.5, reset={self.v: 0})


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_what_stops_once_goes_on_by_a_mode(solver: Any) -> None:
    """It reaches 0.5 m after sqrt(2 * 0.5 m / g), and falls 0.3 m more in sqrt(2 * 0.3 m / g)."""
    time = (2 * 0.5 / 9.81) ** 0.5 + (2 * 0.3 / 9.81) ** 0.5
    assert simulate(build(Once()), time, solver=solver).final["h"] == pytest.approx(0.2, abs=1e-6)


def test_no_fmu_lets_a_ball_fall_through_the_floor(tmp_path: Path) -> None:
    with pytest.raises(FmuFailed, match=r"the condition of relation\[1\] stays true: what is set there is at rest"):
        run_fmu(export_fmu(Rebound(e=0.1), tmp_path / "ball.fmu", kind=("cs",), check=False).path, stop=3.0)


class Early(Basis):
    T: Parameter = param("s", "time", default=0.1)
    n: Discrete = discrete("1")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.n

    def initial_equations(self) -> Equations:
        yield self.n == self.x  # early


class Double(Early):
    def initial_equations(self) -> Equations:
        yield self.n == 1
        yield self.n == 2


EARLY = """\
Early: the initial equation of n has x; what is discrete starts before states and other variables do.
  in test_discrete_messages.py:{early} `yield self.n == self.x`
Use parameters and time only."""


@pytest.mark.parametrize(
    ("kind", "message"), [(Early, EARLY), (Double, "Double: n has more than one initial equation.\nKeep one of them.")]
)
def test_initial_equations_of_what_is_discrete(kind: type[Component], message: str, check_message: Any) -> None:
    check_message(LanguageError, lambda: build(kind()), message)
