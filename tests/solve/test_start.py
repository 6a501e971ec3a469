"""Start values that agree within rounding, and what is told of those that do not."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from fakes import fake_model

from modelica_like.compile.compiled import StartEntry
from modelica_like.errors import ContradictingStart
from modelica_like.flatten.model import INITIAL_EQUATION
from modelica_like.language import Component, Equations, Parameter, Variable, der, param, var
from modelica_like.solve.initialize.contradictions import _coupled, not_met, not_together


class Twice(Component):
    """y and v are the state x, but for a factor; u follows from it."""

    x: Variable = var("1", "state")
    y: Variable = var("1", "minus four times")
    v: Variable = var("1", "twice")
    u: Variable = var("1", "cubic")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == -self.x
        yield self.y == -4 * self.x
        yield self.v == 2 * self.x
        yield self.u == self.x**3 + self.x


@pytest.mark.parametrize(("first", "second", "same"), [
    (-12.0, 6.0 + 7.9e-8, True), (-12.0, 6.0 - 7.9e-8, True), (-12.0, 6.0 + 8.1e-8, False),
    (-12.0, 6.0 - 8.1e-8, False), (12.0, -6.0 + 7.9e-8, True), (12.0, -6.0 + 8.1e-8, False),
    (0.0, 1.9e-8, True), (0.0, 2.1e-8, False),
])  # fmt: skip
def test_two_start_values_of_one_state_agree(start: Any, first: float, second: float, same: bool) -> None:
    """They are -4 and 2 times the state: 3 and 3, within 1e-8 (1 + 3)."""
    if same:
        assert start(Twice(), y=first, v=second)["x"] == first / -4
    else:
        with pytest.raises(ContradictingStart, match=f"^y = {first:g} and v = {second:g} contradict each other"):
            start(Twice(), y=first, v=second)


@pytest.mark.parametrize(
    ("x", "given", "fine"),
    [
        (1.0, 2 + 2.9e-8, True), (1.0, 2 - 2.9e-8, True), (1.0, 2 + 3.1e-8, False), (1.0, 2 - 3.1e-8, False),
        (-1.0, -2 - 2.9e-8, True), (-1.0, -2 - 3.1e-8, False), (0.0, 0.9e-8, True), (0.0, 1.1e-8, False),
    ],
)  # fmt: skip
def test_a_start_value_that_follows_agrees(start: Any, x: float, given: float, fine: bool) -> None:
    if fine:
        assert start(Twice(), x=x, u=given)["x"] == x
    else:
        with pytest.raises(ContradictingStart, match=f"^x = {x:g} and u = {given:g} contradict each other: u would be"):
            start(Twice(), x=x, u=given)


@pytest.mark.parametrize(("u", "x"), [(10.0, 2.0), (1e9 + 1e3, 1e3), (1e-9, 1e-9), (-1e9 - 1e3, -1e3)])
def test_newton_reaches_rounding_of_the_terms(start: Any, u: float, x: float) -> None:
    assert start(Twice(), u=u)["x"] == pytest.approx(x, rel=1e-14)


# -- what is told -----------------------------------------------------------------------------------------------------


def variable(path: str, **given: Any) -> Any:
    return SimpleNamespace(**{"path": path, "guess": 0.0, "description": "", **given})


ENTRIES = (
    StartEntry(0, (2, 2.0), "guess"),
    StartEntry(1, (0, -4.0), "fixed"),
    StartEntry(2, (0, 2.0), "fixed"),
    StartEntry(3, (1, 5.0), "default"),
    StartEntry(4, None, "guess"),
    StartEntry(5, None, "fixed"),
    StartEntry(6, None, "default"),
    StartEntry(7, None, "default"),
    StartEntry(8, None, "guess"),
    StartEntry(9, (1, 1.0), "fixed"),
)
"""Starts of a: states 0 to 2, with factors; of z5, z4 and others, of which z6 has a guess."""


def table(entries: Any = ENTRIES) -> Any:
    names = ["a", "b", "c", "e", "z4", "z5", "z6", "z7", "f", "g"]
    return fake_model(entries=entries, flat_variables=[variable(one) for one in names], differentiated=())


@pytest.mark.parametrize(
    ("rows", "resting", "what"),
    [
        ((1,), (), "b has the requested value"),
        ((1, 0), (), "b, a have the requested value"),
        ((), (2,), "c is at rest"),
        ((), (3, 2, 10), "e, c are at rest"),
        ((1,), (2, 3), "b has the requested value and c, e are at rest"),
        ((), (), "the equations are met"),
        ((0, 1, 2, 3, 4, 5, 6), (), "a, b, c, e, z4, z5 have the requested value"),
    ],
)
def test_no_start_is_told(rows: Any, resting: Any, what: str) -> None:
    plan: Any = SimpleNamespace(rows=rows, resting=resting)
    assert not_together(table(), plan).what == f"No start was found at which {what}."


@pytest.mark.parametrize("equation", [False, True])
def test_a_start_value_that_others_determine_is_told_with_them(equation: bool) -> None:
    """Of z5: it depends on the states that a and b depend on, of which b has a fixed start, and not on those of g."""
    t, x, z, p, u, d = symbols = [ca.SX.sym(name, 3 if name == "x" else 1) for name in "txzpud"]
    rows = [x[0], x[0] + x[1], x[2], 0, 0, x[1], x[1], 0, 0, x[2]]
    model = table()
    model.equations.variables = ca.Function("variables", symbols, [ca.vertcat(*rows)], [*"txzpud"], ["v"])
    model.flat_variables[5].description = f"{INITIAL_EQUATION} x = y" if equation else "speed"
    present = np.array([1.0, 8.5, 3.0, 4.0, 5.0, 3.5, 7.0, 8.0, 9.0, 10.0])
    told = f"{INITIAL_EQUATION} x = y" if equation else "z5 = 3"
    would = "left minus right of the last one" if equation else "z5"
    assert not_met(model, present, 5, 3.0).what == f"b = 8.5 and {told} contradict each other: {would} would be 3.5."
    coupled = [k for k in range(10) if _coupled(model, ENTRIES[5], StartEntry(k, None, "fixed"))]
    assert coupled == [1, 5, 6]
    model.starts.entries = (*ENTRIES[:6], StartEntry(6, None, "fixed"), StartEntry(5, None, "fixed"))
    assert not_met(model, present, 5, 3.0).what.startswith("b = 8.5 and z6 = 7 and ")  # two of three are enough
    model.starts.entries = ENTRIES[3:7]
    would = "left minus right" if equation else "z5"
    assert not_met(model, present, 2, 3.0).what == f"{told} cannot be met: {would} would be 3.5."
