"""Flat models of a few linear equations, by hand and at random."""

from dataclasses import replace

import casadi as ca
from hypothesis import strategies as st

from modelica_like.errors import Source
from modelica_like.flatten.model import FlatModel, FlatVariable, LinearEquation, Origin
from modelica_like.language import Assembly
from modelica_like.language.units import ONE

ORIGIN = Origin("", "test", Source(""))


def model(orders: list[int], rows: list[dict[int, float]], constants: list[float] | None = None) -> FlatModel:
    """Flat model of variables of which some are differentiated, with linear equations over the nodes."""
    variables = [FlatVariable(f"x{k}", ONE, "", "local", "default", 0.0, 1.0, None, None) for k in range(len(orders))]
    nodes = [(k, 0) for k in range(len(orders))]
    derivative: dict[int, int] = {}
    for k, order in enumerate(orders):
        node = k
        for level in range(1, order + 1):
            derivative[node] = len(nodes)
            nodes.append((k, level))
            node = derivative[node]
    given = constants or [0.0] * len(rows)
    linear = [LinearEquation(tuple(row.items()), c, ORIGIN) for row, c in zip(rows, given, strict=True)]
    none = ca.SX(0, 1)
    return FlatModel(
        name="test", variables=variables, nodes=nodes, derivative=derivative, parameters=[], p=none, q=none, derived=[],
        formulas=none, discretes=[], d=none, time=ca.SX.sym("t"), instances=[], linear=linear, general=[], starts=[],
        inputs=[], components={}, asked=(Assembly(), False, ""),
    )  # fmt: skip


coefficients = st.sampled_from([1.0, -1.0, 2.0, -0.5, 3.0, 0.1])


@st.composite
def chains(draw: st.DrawFn) -> tuple[FlatModel, list[dict[int, float]], list[float]]:
    """Equations between variables and their derivatives, with inputs and given values."""
    orders = draw(st.lists(st.integers(0, 2), min_size=2, max_size=5))
    size = len(orders) + sum(orders)
    rows: list[dict[int, float]] = []
    constants: list[float] = []
    for _ in range(draw(st.integers(1, 7))):
        count = draw(st.sampled_from([1, 2, 2, 2, 2, 3]))
        chosen = draw(st.lists(st.integers(0, size - 1), min_size=1, max_size=count, unique=True))
        rows.append({k: draw(coefficients) for k in chosen})
        constants.append(draw(st.sampled_from([0.0, 0.0, 0.0, 1.0, -2.0])))
    inputs = [k for k, order in enumerate(orders) if not order and draw(st.integers(0, 3)) == 0]
    made = model(orders, rows, constants)
    wishes = st.sampled_from(["avoid", "default", "prefer", "always"])
    variables = [replace(one, state=draw(wishes)) for one in made.variables]
    return replace(made, inputs=inputs, variables=variables), rows, constants
