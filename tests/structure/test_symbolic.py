"""A compiled model as named symbols, and as formulas of SymPy."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import sympy

from modelica_like import build, simulate
from modelica_like.errors import LanguageError, UnknownName
from modelica_like.netlist import loads

EXAMPLES = Path(__file__).parents[2] / "examples"
LAW = """
[parts]
motor = { is = "ConstantTorque", tau_constant = "10 N.m" }
wheel = { is = "Inertia", J = "2 kg.m2", phi = 0, w = 0 }
load = { is = "SpeedDependentLoad", a = "1 N.m", b = "0.1 N.m", p = 1.5, w_ref = "1 rad/s" }
[connect]
a = ["motor.flange", "wheel.flange_a"]
b = ["load.flange", "wheel.flange_b"]
[simulate]
until = "1 s"
"""


def test_rates_and_variables_are_those_of_a_run() -> None:
    model = build(EXAMPLES / "machine_tool_startup.toml")
    equations, run = model.symbolic(), simulate(model)
    for segment in (run.segments[0], run.segments[-1]):
        phase = equations.function({"rates": equations.rates, "v": "J4.w", "zero": equations.residuals}, d=segment.d)
        point = segment.point(-1)
        _, speed, zero = phase(point.t, point.x, point.z, [])
        assert float(speed) == pytest.approx(run["J4.w"][np.searchsorted(run.time, point.t)], rel=1e-9)
        assert np.abs(np.array(zero)).max(initial=0.0) < 1e-9


def test_guards_have_names() -> None:
    """While the clutch slips backwards, what stops it is not there yet."""
    model = build(EXAMPLES / "machine_table_direct.toml")
    equations, run = model.symbolic(), simulate(model)
    place = equations.events.index("clutch.mode: backward → stuck")
    guards = ca.Function("guards", [*equations.arguments.values()], [equations.guards])
    point = run.segments[0].point(0)
    assert float(guards(point.t, point.x, point.z, model.p, [], point.d)[place]) < 0.0


def test_formulas_have_the_values_of_the_expressions() -> None:
    model = build(loads(LAW))
    equations = model.symbolic()
    formula = equations.sympy(equations.rates)
    numbers = {"J.w": 3.0} | dict(zip(equations.parameters, map(float, model.p), strict=True))
    x = [0.5, 3.0]
    given = {**numbers, **dict(zip(equations.states, x, strict=True))}
    values = formula.subs({symbol: given[symbol.name] for symbol in formula.free_symbols if symbol.name in given})
    rates = equations.function({"rates": equations.rates}, d=simulate(model).segments[0].d)(0, x, [], [])
    modes = {symbol: float(simulate(model).segments[0].d[0]) for symbol in values.free_symbols}
    np.testing.assert_allclose(np.array(values.subs(modes), float).ravel(), np.array(rates).ravel(), rtol=1e-12)


@pytest.mark.parametrize(
    "make",
    [
        lambda x, y: ca.fmin(x, y) + ca.fmax(x, 2 * y), lambda x, y: ca.if_else(x < y, x**3, ca.sin(y)),
        lambda x, y: ca.fabs(x - y) * ca.sign(y) + ca.atan2(x, y), lambda x, y: ca.tanh(x) / ca.sqrt(1 + y**2),
        lambda x, y: ca.logic_and(x > 0, y > 0) + ca.logic_or(x > 2, y > 2) + ca.logic_not(x > y),
    ],
)  # fmt: skip
def test_functions_in_sympy(make) -> None:
    model = build(loads(LAW))
    equations = model.symbolic()
    expression = make(equations["wheel.J"], equations["motor.tau_constant"])
    formula = equations.sympy(expression)[0]
    function = ca.Function("f", [equations.p], [expression])
    for J, tau in ((0.5, 1.5), (1.7, -0.4), (3.0, 2.5)):
        p = model.with_parameters({"wheel.J": J, "motor.tau_constant": tau}).p
        given = {"wheel.J": J, "motor.tau_constant": tau}
        value = formula.subs({symbol: given[symbol.name] for symbol in formula.free_symbols})
        assert float(value) == pytest.approx(float(function(p)), rel=1e-12)


def test_a_name_that_there_is_not() -> None:
    equations = build(loads(LAW)).symbolic()
    with pytest.raises(UnknownName, match=r"has no variable or parameter 'wheel\.ww'; did you mean 'wheel\.w'\?"):
        _ = equations["wheel.ww"]


def test_an_operation_that_sympy_does_not_have() -> None:
    equations = build(loads(LAW)).symbolic()
    with pytest.raises(LanguageError, match="There is no formula of the function fmod in SymPy"):
        equations.sympy(ca.fmod(equations["wheel.J"], 2))


def test_matrices_keep_their_shape() -> None:
    """A wheel alone: the angle's rate is its speed, which nothing changes."""
    text = '[parts]\nwheel = { is = "Inertia", J = 2, phi = 0, w = 0 }'
    equations = build(loads(text)).symbolic()
    assert equations.sympy(ca.jacobian(equations.rates, equations.x)) == sympy.Matrix([[0, 1], [0, 0]])
