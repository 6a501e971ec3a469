"""Systems without a unique solution: what is told of equations that are too many, and where."""

from dataclasses import replace
from pathlib import Path

import pytest

from components import (
    Capacitor,
    ConstantSpeed,
    ConstantTorque,
    ConstantVoltage,
    Fixed,
    Ground,
    IdealGear,
    Inductor,
    Inertia,
    Resistor,
    Speed,
)
from modelica_like import simulate
from modelica_like.errors import Overdetermined, Underdetermined
from modelica_like.flatten import flatten
from modelica_like.flatten.model import FlatModel
from modelica_like.language import Assembly, Component, Equations, Parameter, Variable, exp, param, sin, var
from modelica_like.structure import reduce


def two(first: Component, second: Component) -> Assembly:
    parts = {"first": first, "second": second, "rotor": Inertia(J=1.0)}
    return Assembly(
        "drive",
        parts=parts,
        connect={"a": ["first.flange", "rotor.flange_a"], "b": ["second.flange", "rotor.flange_b"]},
    )


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (ConstantSpeed(w_fixed=1.0), ConstantSpeed(w_fixed=1.0)),
        (ConstantSpeed(w_fixed=1.0), Speed(w_ref=2.0)),
        (ConstantSpeed(w_fixed=1.0), Fixed()),
        (Fixed(), Fixed()),
    ],
)
def test_two_parts_that_fix_one_motion(first, second):
    with pytest.raises(Overdetermined) as caught:
        reduce(flatten(two(first, second)))
    assert "first" in str(caught.value)
    assert "second" in str(caught.value)
    assert caught.value.advice == "Remove one, or put a spring or clutch between."


@pytest.mark.parametrize("ratio", [2.0, -0.5])
def test_parallel_gears_of_one_ratio_are_told(ratio):
    parts = {"a": Inertia(J=1.0), "b": Inertia(J=1.0), "g": IdealGear(ratio=ratio), "h": IdealGear(ratio=ratio)}
    drive = Assembly("drive", parts=parts, series={"one": ["a", "g", "b"], "two": ["a", "h", "b"]})
    with pytest.raises(Overdetermined, match="The motion is constrained twice") as caught:
        reduce(flatten(drive))
    assert "gears.py" in str(caught.value)


def test_parallel_gears_of_different_ratios_lock():
    parts = {
        "a": Inertia(J=1.0),
        "b": Inertia(J=1.0),
        "g": IdealGear(ratio=2.0),
        "h": IdealGear(ratio=3.0),
        "push": ConstantTorque(tau_constant=6.0),
    }
    drive = Assembly("drive", parts=parts, series={"one": ["push", "a", "g", "b"], "two": ["a", "h", "b"]})
    reduced = reduce(flatten(drive))
    assert reduced.states == ()
    run = simulate(drive, 1.0, points=1)
    # No motion: both torques on a sum to -6, both on b to 0, so tau_g + tau_h = 6 and 2 tau_g + 3 tau_h = 0.
    assert run.final["g.flange_a.tau"] == pytest.approx(18.0)
    assert run.final["h.flange_a.tau"] == pytest.approx(-12.0)
    assert run.final["a.phi"] == 0.0


def test_torques_that_meet_without_a_mass_are_told():
    parts = {"one": ConstantTorque(tau_constant=1.0), "two": ConstantTorque(tau_constant=2.0)}
    with pytest.raises(Overdetermined):
        reduce(flatten(Assembly("drive", parts=parts, connect={"w": ["one.flange", "two.flange"]})))


def test_too_many_equations_here_and_too_few_there():
    """Two equations for x, none for y: probably one of them means y."""

    class Mistaken(Component):
        x: Variable = var("1", "x")
        y: Variable = var("1", "y")
        T: Parameter = param("s", "time constant", default=1.0)

        def equations(self) -> Equations:
            yield self.x == sin(self.time / self.T)
            yield 2 * self.x == exp(self.time / self.T)

    with pytest.raises(Overdetermined, match=r"2 equations determine only 1 unknown \(x\): Mistaken\.") as caught:
        reduce(flatten(Mistaken()))
    assert caught.value.why == "In addition, y lacks an equation."
    assert {one.line for one in caught.value.where} == {line_of("self.x == sin"), line_of("2 * self.x == exp")}


class Term(Component):
    x: Variable = var("1", "a part of a sum")

    def equations(self) -> Equations:
        yield exp(self.x) == 2


class Sum(Component):
    count: int = 2
    total: Variable = var("1", "sum")

    def build(self) -> None:
        self.terms = [Term() for _ in range(self.count)]

    def equations(self) -> Equations:
        yield sin(self.total) == sum(sin(term.x) for term in self.terms)


def without_terms(component: Component) -> FlatModel:
    """The equations of a component without those of its terms."""
    flat = flatten(component)
    return replace(flat, general=[one for one in flat.general if flat.origin(*one).kind != "Term"])


def test_too_few_equations_are_told_with_the_one_that_there_is() -> None:
    with pytest.raises(Underdetermined) as caught:
        reduce(without_terms(Sum()))
    assert caught.value.what == (
        "Sum: 1 equations, 3 unknowns. total, terms[1].x, terms[2].x occur only in the equations below, "
        "1 for 3 unknowns."
    )
    assert [(Path(one.file).name, one.line) for one in caught.value.where] == [
        (Path(__file__).name, line_of("sin(term.x)"))
    ]
    assert caught.value.advice == "2 more equations are needed: connect open ends, or fix them."


def test_of_many_unknowns_the_first_are_named() -> None:
    with pytest.raises(Underdetermined, match=r"terms\[5\]\.x, … \(9 in all\) occur only .* 1 for 9") as caught:
        reduce(without_terms(Sum(count=8)))
    assert caught.value.advice == "8 more equations are needed: connect open ends, or fix them."


def test_an_unknown_without_any_equation() -> None:
    with pytest.raises(Underdetermined) as caught:
        reduce(without_terms(Term()))
    assert caught.value.what == "Term: 0 equations, 1 unknowns. x occurs in no equation."
    assert caught.value.where == ()


def test_of_two_networks_the_one_without_a_reference_is_told_alone() -> None:
    """All parts that connections join are in it, one behind the other; those of the other network are not."""
    parts = {
        "u": ConstantVoltage(V=1.0), "r": Resistor(R=1.0), "l": Inductor(L=1.0), "c": Capacitor(C=1.0),
        "v": ConstantVoltage(V=2.0), "s": Resistor(R=1.0), "ground": Ground(),
    }  # fmt: skip
    wires = {
        "a": ["u.p", "r.p"], "b": ["r.n", "l.p"], "d": ["l.n", "c.p"], "e": ["c.n", "u.n"],
        "f": ["v.p", "s.p"], "g": ["v.n", "s.n", "ground.p"],
    }  # fmt: skip
    with pytest.raises(Overdetermined) as caught:
        reduce(flatten(Assembly("drive", parts=parts, connect=wires)))
    assert caught.value.what == "The network of u, r, l, c has no Ground."


def line_of(text: str) -> int:
    """The first line of this file with a text."""
    return next(n for n, line in enumerate(Path(__file__).read_text().splitlines(), 1) if text in line)
