"""Tables of a compiled model: what they name."""

from typing import Any

import numpy as np
import pytest

from components import ConstantSpeed, ConstantTorque, Inertia
from modelica_like import build
from modelica_like.compile.sliding import _borders, sliding
from modelica_like.errors import LanguageError
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Events,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    connect,
    delay,
    der,
    param,
    signal_in,
    signal_out,
    sin,
    var,
)


@pytest.mark.parametrize(
    ("source", "found"), [(ConstantSpeed(w_fixed=2.0), ("from",)), (ConstantTorque(tau_constant=1.0), ())]
)
def test_components_that_prescribe_a_motion(source, found):
    """Their power from outside has their torque in it; that of a torque has the speed."""
    parts = {"from": source, "mass": Inertia(J=1.0)}
    model = build(Assembly("drive", parts=parts, connect={"a": ["from.flange", "mass.flange_a"]}))
    assert model.motion_sources == found


class Late(Component):
    u: Input = signal_in("1", "input", default=1.0)
    y: Output = signal_out("1", "output")
    T: Parameter = param("s", "delay", default=1.0)

    def equations(self) -> Equations:
        yield self.y == delay(self.u, self.T)


def test_a_part_with_a_delay_is_named():
    class Two(Component):
        one, other = Late(u=2.0), Late()

        def equations(self) -> Equations:
            yield connect(self.one.y, self.other.u)

    with pytest.raises(LanguageError, match=r"It fails: one has a delay"):
        build(Two()).refuse_delays(LanguageError, "It fails")
    with pytest.raises(LanguageError, match=r"It fails: it has a delay"):
        build(Late()).refuse_delays(LanguageError, "It fails")


class Ring(Component):
    """A mode acts through equations that stay implicit, which time and the state enter, too."""

    x: Variable = var("1", "value")
    a: Variable = var("1", "first")
    b: Variable = var("1", "second")
    c: Variable = var("1", "third")
    d: Variable = var("1", "fourth")
    e: Variable = var("1", "fifth")
    f: Variable = var("1", "sixth")
    T: Parameter = param("s", "time", default=1.0)
    state = Mode("up", "down")

    def equations(self) -> Equations:
        every = self.a, self.b, self.c, self.d, self.e, self.f
        total = sum(every[1:], start=every[0])
        drive = self.state.choose(up=1, down=-1) + 0.1 * self.x**2 + 0.3 * sin(self.time / self.T)
        yield self.T * der(self.x) == self.a
        for k, one in enumerate(every):
            yield 3 * one + total == (drive if k == 0 else 0)

    def events(self) -> Events:
        yield self.state.go("up", "down", when=self.x > 0)
        yield self.state.go("down", "up", when=self.x < 0)


def test_delays_of_parts_have_their_own_numbers():
    class Two(Component):
        one, other = Late(u=2.0), Late(u=5.0)

    model = build(Two())
    names = [model.flat_discretes[k].path for part in model.events.delay_parts for k in part]
    assert {name.partition(".")[0] for name in names} == {"one", "other"}
    assert len({*names}) == len(names)
    values = model.events.delays(0.0, [], [], model.p, model.u, np.zeros(model.discrete_size)).full().ravel()
    assert values.tolist() == [2.0, 1.0, 5.0, 1.0]


@pytest.mark.parametrize(("t", "x"), [(0.4, 0.02), (2.0, -0.7), (5.0, 1.5)])
def test_what_slides_through_implicit_equations_comes_back(t, x):
    """x' = -x / 0.1 s: the share follows from the implicit unknowns of both modes, at this time and place."""
    base = build(Ring(x=0.5))
    made, ((pair,),) = sliding(base), _borders(base)
    assert len(made.implicit) > 0
    z: Any = np.zeros(len(made.implicit))
    given = [made.p, made.u, [float(pair.number)]]
    z = z - np.linalg.solve(
        made.equations.alg_jacobian(t, x, z, *given).full(), made.equations.alg(t, x, z, *given).full().ravel()
    )
    assert float(made.equations.ode(t, x, z, *given)) == pytest.approx(-x / 0.1, rel=1e-9)
    variables = dict(zip(made.position, made.equations.variables(t, x, z, *given).full().ravel(), strict=True))
    assert variables["a"] == pytest.approx(-x / 0.1, rel=1e-9)
    assert [variables[name] for name in "bcdef"] == pytest.approx(5 * [x / 0.1 / 8], rel=1e-9)  # 3 y + 5 y = -a
