"""Levels, their names, and their equations."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from linear_models import chains, model

from components import Constant, FirstOrder, Inertia, Torque, Vehicle
from modelica_like import Assembly, build
from modelica_like.flatten import FlatModel, flatten
from modelica_like.language import Component, Equations, Parameter, Variable, der, param, var
from modelica_like.structure import reduce
from modelica_like.structure.alias import find_aliases
from modelica_like.structure.system import Level, System, build_system


def test_a_state_is_what_its_name_says() -> None:
    """A torque source turns the sign of its signal; the state keeps that of the signal after which it is named."""
    parts = {"step": Constant(k=1), "lag": FirstOrder(T=0.1), "torque": Torque(), "J": Inertia(J=1.0, phi=0, w=0)}
    wires = {"a": ("step.y", "lag.u"), "b": ("lag.y", "torque.tau")}
    model = build(Assembly("drive", parts=parts, series={"s": ("torque", "J")}, connect=wires))
    at = {name: k for k, name in enumerate(model.states)}
    values = model.equations.variables(
        0.0, range(1, len(model.states) + 1), [], model.p, model.u, [0.0] * model.discrete_size
    )
    for name, k in at.items():
        assert float(values[model.position[name]]) == k + 1.0
    assert "lag.y" in at


def test_of_equal_names_the_one_that_wants_to_be_a_state_counts() -> None:
    class Twice(Component):
        first: Variable = var("1", "as the second")
        second: Variable = var("1", "as the first", state="prefer")
        T: Parameter = param("s", "time constant", default=1.0)

        def equations(self) -> Equations:
            yield self.first == self.second
            yield self.T * der(self.first) == -self.second

    assert reduce(flatten(Twice())).states == ("second",)


def built(made: FlatModel) -> System:
    return build_system(made, find_aliases(made))


@given(chains())
@settings(deadline=None, max_examples=60)
def test_nodes_are_what_linear_equations_and_derivatives_say(
    system: tuple[FlatModel, list[dict[int, float]], list[float]],
) -> None:
    """At any values of the levels: equations that are used up hold, the others are the residual."""
    made, rows, constants = system
    found, aliases = built(made), find_aliases(made)
    at = np.random.default_rng(1).normal(size=len(found.levels))
    function = ca.Function("values", [found.everything], [found.node_values, found.residual])
    values, residual = (one.full().ravel() for one in function(at))
    sums = [sum(c * values[node] for node, c in row.items()) + one for row, one in zip(rows, constants, strict=True)]
    assert residual == pytest.approx([sums[number] for number in aliases.remaining], rel=1e-12, abs=1e-12)
    if not aliases.contradictions:
        used = [one for number, one in enumerate(sums) if number not in aliases.remaining]
        assert used == pytest.approx([0.0] * len(used), abs=1e-12)
    for node, above in made.derivative.items():
        if placed := found.node_level[node]:
            level = found.derivative(placed[0])
            assert found.node_level[above] == (level, pytest.approx(placed[1], rel=1e-12))
        else:
            assert values[above] == 0.0
    names = {made.node_name(node): placed for node, placed in enumerate(found.node_level)}
    for chain, levels in enumerate(found.chains):
        assert names[found.levels[levels[0]].name] == (levels[0], 1.0)
        assert [(found.levels[k].chain, found.levels[k].order) for k in levels] == [
            (chain, n) for n in range(len(levels))
        ]
    assert sorted(k for levels in found.chains for k in levels) == list(range(len(found.levels)))
    assert [found.node_level[node] for node in made.inputs] == [(level, 1.0) for level in found.inputs]
    for number, levels in zip(aliases.remaining, found.linear_rows, strict=True):
        placed = (found.node_level[node] for node in rows[number])
        assert sorted(levels) == sorted({one[0] for one in placed if one})


def named(first: dict[str, Any], second: dict[str, Any], factor: float = 4.0) -> Level:
    """The level of x0 = factor x1."""
    made = model([1, 0], [{0: 1.0, 1: -factor}])
    variables = [replace(one, **more) for one, more in zip(made.variables, (first, second), strict=True)]
    found = built(replace(made, variables=variables))
    assert [one.preference for one in found.levels[1:]] == [0]
    return found.levels[0]


def test_a_level_has_the_guess_the_nominal_value_and_the_preference_of_its_variables_and_tells_whose_it_is() -> None:
    assert named({}, {"state": "prefer", "nominal": 3.0}) == Level(0, 0, "x1", 2, 3.0, 0.0, True)
    assert named({"guess": 6.0}, {"state": "prefer"}) == Level(0, 0, "x1", 2, 1.0, 1.5, True)
    assert named({"guess": 6.0}, {"state": "prefer", "guess": 7.0}) == Level(0, 0, "x1", 2, 1.0, 7.0, True)
    assert named({"guess": 6.0, "state": "prefer", "nominal": 5.0}, {}) == Level(0, 0, "x0", 2, 5.0, 6.0, True)
    assert named({"state": "prefer"}, {"guess": 6.0}) == Level(0, 0, "x0", 2, 1.0, 24.0, True)
    assert named({"kind": "potential"}, {"kind": "flow"}) == Level(0, 0, "x0", 1, 1.0, 0.0, False)
    assert named({"kind": "potential"}, {}) == Level(0, 0, "x1", 1, 1.0, 0.0, True)
    assert named({"state": "avoid"}, {"state": "avoid"}).preference == 0
    assert named({"kind": "potential"}, {"kind": "flow"}) == Level(0, 0, "x0", 1, 1.0, 0.0, False)
    assert named({"kind": "potential"}, {}) == Level(0, 0, "x1", 1, 1.0, 0.0, True)
    assert named({"state": "avoid"}, {}).preference == 1


def test_what_names_a_level() -> None:
    """No potential or flow, not turned, wanted as a state, near the top, first named."""
    assert named({}, {}, 1.0).name == "x0"
    assert named({"kind": "potential"}, {}, 1.0).name == "x1"
    assert named({"kind": "flow"}, {}, 1.0).name == "x1"
    assert named({"kind": "flow", "state": "always"}, {"kind": "potential"}, 1.0).name == "x0"
    assert named({"path": "a.b.x"}, {"path": "a.y"}, 1.0).name == "a.y"
    assert named({"path": "a.b.x", "state": "prefer"}, {"path": "a.y"}, 1.0).name == "a.b.x"
    assert named({"path": "a.x"}, {"path": "a.y"}, 1.0).name == "a.x"


def test_a_derivative_is_named_like_the_state_below_it() -> None:
    """Both flanges of a vehicle are one: a derivative with the name of the other could not be exported."""
    drive = Assembly("held", parts={"car": Vehicle(m=1.0, R=1.0)}, connect={"f": ["car.flange_r", "car.support"]})
    assert build(drive).states == ("car.support.phi", "der(car.support.phi)")


def test_a_generic_point_has_no_equal_values() -> None:
    found = built(model([0] * 40, [dict.fromkeys(range(40), 1.0)]))
    values = found.generic(found.everything).full().ravel()
    assert len({*values}) == 40
    assert np.ptp(values) < 1.0
    assert min(values) > 0.0
