"""Levels and their names."""

from components import Constant, FirstOrder, Inertia, Torque
from modelica_like import Assembly, build
from modelica_like.flatten import flatten
from modelica_like.language import Component, Equations, Parameter, Variable, der, param, var
from modelica_like.structure import reduce


def test_a_state_is_what_its_name_says() -> None:
    """A torque source turns the sign of its signal; the state keeps that of the signal after which it is named."""
    parts = {"step": Constant(k=1), "lag": FirstOrder(T=0.1), "torque": Torque(), "J": Inertia(J=1.0, phi=0, w=0)}
    wires = {"a": ("step.y", "lag.u"), "b": ("lag.y", "torque.tau")}
    model = build(Assembly("drive", parts=parts, series={"s": ("torque", "J")}, connect=wires))
    at = {name: k for k, name in enumerate(model.states)}
    values = model.variables(0.0, range(1, len(model.states) + 1), [], model.p, model.u, [0.0] * model.discrete_size)
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
