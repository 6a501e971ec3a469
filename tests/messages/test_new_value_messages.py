"""Events that give variables values which something else determines."""

import pytest

from components import ConstantSpeed, IdealGear, Inertia
from modelica_like import simulate
from modelica_like.errors import ContradictingValue
from modelica_like.language import Component, Equations, Events, Mode, Parameter, connect, free, param, series, when


class Prescribed(Component):
    A = Inertia(J=1.0, phi=0.0)
    s = ConstantSpeed(w_fixed=2.0)
    tr: Parameter = param("s", default=0.2)
    w1: Parameter = param("rad/s", default=1.0)

    def equations(self) -> Equations:
        yield connect(self.s.flange, self.A.flange_a)

    def events(self) -> Events:
        yield when(self.time > self.tr, {self.A.w: self.w1})  # prescribed


class Geared(Component):
    A = Inertia(J=1.0, phi=0.0, w=1.0)
    s = IdealGear(ratio=2.0)
    B = Inertia(J=1.0)
    tr: Parameter = param("s", default=0.2)
    w_A: Parameter = param("rad/s", default=3.0)
    w_B: Parameter = param("rad/s", default=3.0)

    def equations(self) -> Equations:
        yield from series(self.A, self.s, self.B)

    def events(self) -> Events:
        yield when(self.time > self.tr, {self.A.w: self.w_A, self.B.w: self.w_B})  # geared


class Twice(Component):
    A = Inertia(J=1.0, phi=0.0, w=5.0)
    m = Mode("a", "b")
    k = Mode("a", "b")
    tr: Parameter = param("s", default=0.2)
    w1: Parameter = param("rad/s", default=1.0)

    def equations(self) -> Equations:
        yield free(self.A.flange_a)

    def events(self) -> Events:
        yield self.m.go("a", "b", at=self.tr, reset={self.A.w: self.w1})  # first
        yield self.k.go("a", "b", at=self.tr, reset={self.A.w: 2 * self.A.w})  # second


ADVICE = "Give a new value to what is free to take it only, and to one of those that follow from each other."
WHY = "something else determines it, what prescribes its motion or another new value."
CASES = {
    "a prescribed speed": (
        ContradictingValue,
        Prescribed(),
        f"At 0.2 s A.w cannot become 1 rad/s: {WHY}\n"
        "  in test_new_value_messages.py:{prescribed} `yield when(self.time > self.tr, {self.A.w: self.w1})`\n"
        + ADVICE,
    ),
    "two speeds of a gear": (
        ContradictingValue,
        Geared(),
        f"At 0.2 s A.w cannot become 3 rad/s: {WHY}\n"
        "  in test_new_value_messages.py:{geared} "
        "`yield when(self.time > self.tr, {self.A.w: self.w_A, self.B.w: self.w_B})`\n" + ADVICE,
    ),
    "two values of a speed": (
        ContradictingValue,
        Twice(),
        "At 0.2 s A.w gets two new values.\n"
        '  in test_new_value_messages.py:{first} `yield self.m.go("a", "b", at=self.tr, reset={self.A.w: self.w1})`\n'
        "  in test_new_value_messages.py:{second} "
        '`yield self.k.go("a", "b", at=self.tr, reset={self.A.w: 2 * self.A.w})`\n'
        "Give one to each motion only: what is coupled rigidly follows.",
    ),
}


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("case", CASES)
def test_values_that_contradict_are_refused(case, solver, check_message):
    kind, drive, message = CASES[case]
    check_message(kind, lambda: simulate(drive, 0.4, solver=solver), message)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_values_that_agree_are_taken(solver):
    run = simulate(Geared(w_A=6.0), 0.4, solver=solver)
    assert [run[name][-1] for name in ("A.w", "B.w")] == pytest.approx([6.0, 3.0], rel=1e-12)
