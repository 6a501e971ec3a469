"""Which choices of states are singular somewhere, by determinants in closed form, and how states follow on a circle."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from modelica_like.errors import Source
from modelica_like.flatten import flatten
from modelica_like.flatten.model import Origin
from modelica_like.language import Component, Equations, Parameter, Variable, der, param, var
from modelica_like.structure import reduce
from modelica_like.structure.following import Group, singular_groups
from modelica_like.structure.system import Level, System

AVOID, DEFAULT, ALWAYS = 0, 1, 3
T, MODE, WIDTH = ca.SX.sym("t"), ca.SX.sym("mode"), ca.SX.sym("width")
X, Y, U, V = (ca.SX.sym(name) for name in ("x", "y", "u", "v"))


def system(residual: list[Any], length: int = 3, nominal: float = 1.0, **preferences: int) -> System:
    """Constraints of x, y, u and v, each with so many levels; one parameter is 2, one mode is 3."""
    model: Any = SimpleNamespace(
        p=WIDTH, parameters=[SimpleNamespace(value=2.0)], d=ca.vertcat(MODE, ca.SX.sym("more", 2)), time=T,
        discretes=[SimpleNamespace(start=3), SimpleNamespace(start=ca.SX(1))], starts=[], flags=(),
    )  # fmt: skip
    origins = [Origin("", "test", Source("")) for _ in residual]
    made = System(model, [], [], [], ca.vertcat(*residual), origins, [], ca.SX(0, 1))
    for chain, symbol in enumerate((X, Y, U, V)):
        name = str(symbol)
        made.chains.append([len(made.levels)])
        made.levels.append(Level(chain, 0, name, preferences.get(name, DEFAULT), nominal, 0.0))
        made.symbols.append(symbol)
        for _ in range(length - 1):
            made.add_level(chain)
    return made


def groups(made: System, counts: list[int], *states: Any) -> tuple[Group, ...]:
    names = [str(symbol) for symbol in made.symbols]
    return singular_groups(made, counts, [names.index(str(one)) for one in states])


CIRCLE = X**2 + Y**2 - 1


def test_a_circle_has_no_regular_choice() -> None:
    for state in (X, Y):
        assert groups(system([CIRCLE]), [2], state) == (Group((0,), (0, 3), 2, ()),)


def test_it_has_one_if_the_user_says_so_or_if_another_highest_derivative_counts() -> None:
    assert groups(system([CIRCLE], x=ALWAYS), [2], X) == ()
    assert groups(system([CIRCLE], y=ALWAYS), [2], X) != ()
    assert groups(system([CIRCLE]), [1], X) == ()  # der(x) is not the highest one
    assert groups(system([CIRCLE], 2), [1], X) == (Group((0,), (0, 2), 1, ()),)


def test_without_a_choice_nothing_is_singular() -> None:
    assert groups(system([CIRCLE, X - Y * Y]), [2, 2]) == ()
    assert groups(system([CIRCLE]), [0], X) == ()
    made = system([CIRCLE])
    made.inputs = [3]  # y
    assert groups(made, [2], X) == ()


@pytest.mark.parametrize(
    ("slope", "singular"),
    [
        (Y**3 / 3, True),  # y², which comes near zero without a change of sign
        (2 * Y - ca.cos(Y), False),
        (ca.exp(Y), False),  # from 1/23 to 23
        (ca.exp(2 * Y), True),  # from 1/500 to 500
        (-ca.exp(Y), False),
        (ca.sqrt(Y), False),  # no number for half of the points
        (ca.sqrt(Y) - 0.4 * Y, True),
        (ca.sqrt(-1 - Y * Y), False),  # never a number
        (500 * ca.sin(Y / 500), False),  # within three nominal values it changes no sign
        (Y * ca.cos(T / 1000), True),
        (Y * (1.5 + ca.cos(T / 1000)), False),
        (Y * (2 + ca.cos(Y) * T), True),
        (WIDTH * Y - ca.cos(Y), False),  # the parameter is 2 …
        (WIDTH * Y / 4 - ca.cos(Y), True),
        (MODE * Y - 2 * ca.cos(Y), False),  # … and the mode 3
        (MODE * Y / 4 - 2 * ca.cos(Y), True),
    ],
    ids=str,
)
def test_where_the_slope_by_what_is_no_state_vanishes(slope: Any, singular: bool) -> None:
    assert (groups(system([X * 5 - slope]), [2], X) != ()) is singular


@pytest.mark.parametrize(("nominal", "singular"), [(1.0, False), (1000.0, True)])
def test_points_are_as_far_apart_as_nominal_values(nominal: float, singular: bool) -> None:
    assert (groups(system([X - ca.sin(Y / 1000)], nominal=nominal), [2], X) != ()) is singular


def test_two_circles_are_two_groups_unless_a_constraint_joins_them() -> None:
    two = [CIRCLE, U**2 + V**2 - 1]
    assert groups(system(two), [2, 2], X, U) == (Group((0,), (0, 3), 2, ()), Group((1,), (6, 9), 2, ()))
    assert groups(system(two, u=ALWAYS), [2, 2], X, U) == (Group((0,), (0, 3), 2, ()),)
    joined = [*two, ca.sin(Y) - U * Y]
    assert groups(system(joined), [2, 2, 2], X) == (Group((0, 1, 2), (0, 3, 6, 9), 2, ()),)
    chain = [CIRCLE, U**2 + V**2 - 1, ca.sin(Y) * ca.cos(V)]
    assert groups(system(chain), [2, 2, 2], X) == (Group((0, 1, 2), (0, 3, 6, 9), 2, ()),)


def test_of_a_group_those_that_are_differentiated_most_count() -> None:
    """The other one needs der(x) - y at the same level."""
    made = system([CIRCLE, X * 2 - ca.sin(U)])
    made.residual[1] = made.symbols[1] * 2 - ca.sin(U * made.symbols[7])
    assert groups(made, [2, 1], X) == (Group((0,), (0, 3), 2, ()),)


def test_a_variable_that_occurs_once_with_a_constant_slope_is_no_state() -> None:
    assert groups(system([X - ca.sin(Y)]), [2], Y) == ()
    assert groups(system([X - ca.sin(Y)]), [2], X) == (Group((), (), 2, (0,)),)
    both = [X - ca.sin(Y) + 2 * U]
    assert groups(system(both, u=AVOID), [2], X, U) == (Group((), (), 2, (6,)),)
    assert groups(system(both, x=AVOID), [2], X, U) == (Group((), (), 2, (0,)),)
    # Behind the constraint that goes, the other one has a variable of its own, too.
    assert groups(system([X - ca.sin(Y), Y - U * U]), [2, 2], X) == (Group((), (), 2, (0, 3)),)
    assert groups(system([X - ca.sin(Y), Y * Y - U * U - 1]), [2, 2], X) == (Group((1,), (3, 6), 2, (0,)),)
    assert groups(system([X * T - ca.sin(Y)]), [2], X) == (Group((0,), (0, 3), 2, ()),)


class Circle(Component):
    """A point on a circle: x² + y² = r², with the tangential acceleration a."""

    x: Variable = var("m", "x", nominal=2.0)
    y: Variable = var("m", "y", nominal=0.5)
    vx: Variable = var("m/s", "velocity")
    vy: Variable = var("m/s", "velocity")
    force: Variable = var("1/s2", "force over distance")
    r: Parameter = param("m", "radius", default=1.0)
    g: Parameter = param("m/s2", "gravity", default=9.81)

    def equations(self) -> Equations:
        yield der(self.x) == self.vx
        yield der(self.y) == self.vy
        yield der(self.vx) == -self.force * self.x
        yield der(self.vy) == -self.force * self.y - self.g
        yield self.x**2 + self.y**2 == self.r**2


UNITS = np.array([2.0, 0.5])
"""Nominal values of x and y."""


def tangent_at(angle: float) -> np.ndarray:
    """Of the circle in nominal values, made to length one."""
    tangent = np.array([-np.sin(angle), np.cos(angle)]) / UNITS
    return tangent / np.linalg.norm(tangent)


@pytest.mark.parametrize("angle", [0.3, 1.2, 3.0, -2.0])
def test_first_weights_lie_near_the_tangent_at_the_start(angle: float) -> None:
    """The normal is turned by at most 0.2 of its length in each direction, but by some of it."""
    started = Circle(x=float(np.cos(angle)), y=float(np.sin(angle)))
    weights = np.array([one.start for one in reduce(flatten(started)).flat.discretes[1:]])
    assert np.linalg.norm(weights) == pytest.approx(1.0, rel=1e-14)
    off = abs(weights @ np.array([[0.0, 1.0], [-1.0, 0.0]]) @ tangent_at(angle))
    assert 0.01 < off < 0.2 * np.sqrt(2)


@pytest.mark.parametrize("angle", [0.3, 1.2, -2.0])
@pytest.mark.parametrize("turned", [0.0, 0.5, -1.0, 2.5])
def test_a_choice_on_the_circle_is_the_tangent(angle: float, turned: float) -> None:
    """In nominal values q = (x / 2, 2 y), the tangent at q is (-y / 2, 2 x) made to length one; with weights that are
    turned by an angle from it, the determinant is the cosine squared."""
    reduced = reduce(flatten(Circle()))
    (choice,) = reduced.choices
    assert choice.moved == ("x", "y")
    flat = reduced.flat
    assert [one.path for one in flat.discretes] == ["state[1].choice", "state[1].x", "state[1].y"]
    assert [one.hidden for one in flat.discretes] == [True] * 3
    q, v = np.array([np.cos(angle), np.sin(angle)]), 0.7 * np.array([-np.sin(angle), np.cos(angle)])
    tangent = tangent_at(angle)
    normal = np.array([-tangent[1], tangent[0]])
    weights = np.cos(turned) * tangent + np.sin(turned) * normal
    at = {"x": q[0], "y": q[1], "der(x)": v[0], "der(y)": v[1], "vx": v[0], "vy": v[1],
          "state[1]": weights @ (q / UNITS), "der(state[1])": weights @ (v / UNITS), "force": 0.0}  # fmt: skip
    resets = [value for _, _, value in choice.resets]
    function = ca.Function("f", [reduced.x, reduced.z, flat.p, flat.d, flat.time], [choice.guard, ca.vertcat(*resets)])
    x, z = [at[name] for name in reduced.states], [at[name] for name in reduced.implicit]
    guard, found = function(x, z, [1.0, 9.81], [0.0, *weights], 0.0)
    assert float(guard) == pytest.approx(0.25 - np.cos(turned) ** 2, rel=1e-12)
    assert [(kind, place) for kind, place, _ in choice.resets] == [
        ("discrete", 1), ("discrete", 2), ("state", reduced.states.index("state[1]")),
        ("state", reduced.states.index("der(state[1])")),
    ]  # fmt: skip
    new = tangent * np.sign(np.cos(turned))
    assert found.full().ravel() == pytest.approx([*new, new @ (q / UNITS), new @ (v / UNITS)], rel=1e-12)
