"""The equations between start values and states: what they say, their slopes, and in which order motions may rest."""

from typing import Any

import numpy as np
import pytest

from components import ConstantTorque, Damper, Fixed, IdealGear, Inertia, SpringDamper
from modelica_like import build
from modelica_like.compile import CompiledDae
from modelica_like.compile.start_system import StartSystem, rest_order
from modelica_like.flatten import flatten
from modelica_like.language import Assembly
from modelica_like.structure import reduce


def chain(**starts: Any) -> Assembly:
    """Two inertias with a spring between them, and a third behind a gear."""
    return Assembly("drive", parts={
        "push": ConstantTorque(tau_constant=1.5), "left": Inertia(J=1.0), "spring": SpringDamper(c=10.0, d=0.5),
        "right": Inertia(J=2.0, **starts), "gear": IdealGear(ratio=3.0), "last": Inertia(J=0.5),
    }, connect={
        "a": ["push.flange", "left.flange_a"], "b": ["left.flange_b", "spring.flange_a"],
        "c": ["spring.flange_b", "right.flange_a"], "d": ["right.flange_b", "gear.flange_a"],
        "e": ["gear.flange_b", "last.flange_a"],
    })  # fmt: skip


def held() -> Assembly:
    """An inertia between a wall and the end of a spring."""
    parts = {"wall": Fixed(), "spring": SpringDamper(c=10.0, d=0.5), "mass": Inertia(J=1.0)}
    wires = {"a": ["wall.flange", "spring.flange_a"], "b": ["spring.flange_b", "mass.flange_a"]}
    return Assembly("held", parts=parts, connect=wires)


def resting(drive: Assembly) -> list[str]:
    flat = flatten(drive)
    return [one.name for one in rest_order(reduce(flat))]


def test_springs_rest_before_what_stores_energy():
    """Relative speeds of springs, then speeds of inertias, then twists, then positions."""
    assert resting(chain()) == [
        "der(spring.phi_rel)", "der(last.phi)", "der(left.phi)", "der(right.phi)", "spring.phi_rel",
        "left.flange_a.phi", "gear.flange_a.phi", "gear.flange_b.phi",  # the first one is a state
    ]  # fmt: skip


def test_relative_places_rest_before_others():
    parts = {"left": Inertia(J=1.0), "slip": Damper(d=0.5), "right": Inertia(J=2.0)}
    wires = {"a": ["left.flange_b", "slip.flange_a"], "b": ["slip.flange_b", "right.flange_a"]}
    names = resting(Assembly("drive", parts=parts, connect=wires))
    assert names[:3] == ["der(left.phi)", "der(right.phi)", "der(slip.phi_rel)"]
    assert names[3] == "slip.phi_rel"


class Numbers:
    """A start system at random states, with its unknowns solved."""

    def __init__(self, model: CompiledDae, system: StartSystem) -> None:
        self.model, self.function = model, system.function
        chance = np.random.default_rng(3)
        self.x, self.y = chance.normal(size=len(model.states)), chance.normal(size=system.function.size1_in("y"))
        self.d = np.zeros(model.discrete_size)
        for _ in range(len(self.y) + 1):  # y occurs linearly, one after the other
            _, jacobian, values = self.at(self.x, self.y)
            own = slice(len(self.x), len(self.x) + len(self.y))
            self.y = self.y - np.linalg.solve(jacobian[: len(self.y), own], values[: len(self.y)])

    def at(self, x: Any, y: Any) -> list[Any]:
        found = self.function(0.0, x, y, [], self.model.p, self.model.u, self.d)
        return [found[0].full().ravel(), found[1].full(), found[2].full().ravel()]


@pytest.mark.parametrize("rest", [False, True])
def test_values_are_those_of_the_variables(rest):
    model = build(chain(phi=1.0, w=2.0))
    system = model.rest_system if rest else model.start_system
    one = Numbers(model, system)
    y, _, values = one.at(one.x, one.y)
    variables = model.equations.variables(0.0, one.x, [], model.p, model.u, one.d).full().ravel()
    np.testing.assert_allclose(y, one.y)
    np.testing.assert_allclose(values[: len(y)], 0.0, atol=1e-13)
    paths = list(model.position)
    seen = {paths[node]: value for node, value in zip(system.nodes, values[len(y) :], strict=True) if node < len(paths)}
    assert {"right.phi", "right.w"} <= seen.keys()
    assert seen == pytest.approx({path: variables[model.position[path]] for path in seen}, rel=1e-12)


def test_slopes_are_differences():
    """Everything is linear here: one step of any size."""
    model = build(chain(phi=1.0, w=2.0))
    one = Numbers(model, model.rest_system)
    _, jacobian, values = one.at(one.x, one.y)
    size = len(one.x)
    for column in range(jacobian.shape[1]):
        step = np.eye(jacobian.shape[1])[column]
        moved = one.at(one.x + step[:size], one.y + step[size:])[2]
        np.testing.assert_allclose(jacobian[:, column], moved - values, atol=1e-12)


def test_rates_are_the_speeds():
    model = build(chain(phi=1.0, w=2.0))
    system = model.rest_system
    one = Numbers(model, system)
    variables = dict(
        zip(model.position, model.equations.variables(0.0, one.x, [], model.p, [], one.d).full().ravel(), strict=True)
    )
    found = sorted(np.concatenate([one.x, one.y])[[*system.rates]])
    speeds = {variables[path] for path in ("left.w", "right.w", "last.w", "spring.w_rel")}
    assert all(any(np.isclose(value, speed) for speed in speeds) for value in found)
    states = [name for name in model.states if name.endswith((".w", ".w_rel"))]
    assert {model.states[k] for k in system.rates if k < len(model.states)} == {*states}
    assert max(system.rates) < len(one.x) + len(one.y)
    assert model.start_system.rates == model.start_system.rest == ()


def test_states_that_rest_are_known_by_their_number():
    model = build(held())
    flat = flatten(held())
    states = {model.states[state] for _, state in model.rest_system.rest if state is not None}
    assert states == {*model.states}
    names = [flat.node_name(node) for node, _ in model.rest_system.rest]
    assert names == ["der(spring.phi_rel)", "der(mass.phi)", "spring.phi_rel", "mass.flange_a.phi"]
