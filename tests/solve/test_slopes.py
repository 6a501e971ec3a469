"""Slopes with the implicit unknowns following, against the implicit function theorem by hand."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from fakes import fake_model

from modelica_like import build
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import SingularAtStart, UnknownName
from modelica_like.language import TIME, Component, Equations, Input, Parameter, Variable, der, param, signal_in, var
from modelica_like.solve.initialize.point import Point, solve_implicit
from modelica_like.solve.initialize.slopes import columns_of, implicit_slopes, nodes_of, slopes, variable_slopes

NAMES = "t", "x", "z", "p", "u", "d"


class Curved(Component):
    x: Variable = var("1", "state", default=2.0)
    y: Variable = var("1", "state", default=3.0)
    v: Variable = var("1", "implicit")
    w: Variable = var("1", "implicit")
    f: Variable = var("1", "follows both")
    g: Variable = var("1", "follows none")
    T: Parameter = param("s", "time", default=1.0)
    k: Parameter = param("1", "factor", default=0.7)
    u: Input = signal_in("1", "input", default=0.4)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.v
        yield self.T * der(self.y) == self.x * self.w
        yield self.v**3 + self.v + self.w**3 == self.x * self.k + TIME / self.T
        yield self.w**3 + 2 * self.w - self.v**3 == self.y + self.u
        yield self.f == self.v * self.w + self.x**2
        yield self.g == self.x * self.y - self.u


@pytest.fixture
def curved() -> tuple[CompiledDae, Point, dict[str, Any]]:
    """The model at t = 0.5 s; there, by hand, the slopes of v, w, f and both rates by x, y, t and k, u."""
    model = build(Curved(u=0.4))
    assert sorted(model.implicit) == ["v", "w"]
    point = Point(0.5, np.zeros(2), np.ones(2), np.zeros(model.discrete_size))
    point.x[[model.states.index(name) for name in "xy"]] = x, y = 2.0, 3.0
    solve_implicit(model, point)
    v, w = (point.z[model.implicit.index(name)] for name in "vw")
    by = np.array([[0.7, 0, 1, 2.0, 0], [0, 1, 0, 0, 1]])
    z = np.linalg.solve([[3 * v**2 + 1, 3 * w**2], [-3 * v**2, 3 * w**2 + 2]], by)
    f = w * z[0] + v * z[1] + [2 * x, 0, 0, 0, 0]
    g = np.array([y, x, 0, 0, -1.0])
    rates = np.array([z[0], x * z[1] + [w, 0, 0, 0, 0]])
    return model, point, {"z": z, "f": f, "g": g, "rates": rates, "rate": np.array([v, x * w])}


def parts(model: CompiledDae, x: Any, t: Any, theta: Any) -> Any:
    """Bring slopes by x, y, t, k and u into one order."""
    columns = columns_of(model, ["k", "u"])
    states = [model.states.index(name) for name in "xy"]
    return np.hstack([x[:, states], np.reshape(t, (-1, 1)), theta[:, columns]])


def test_slopes_of_variables_follow_the_implicit_unknowns(curved: Any) -> None:
    model, point, wanted = curved
    nodes = nodes_of(model, ["f", "g"])
    found = slopes(model, point, "variables", nodes)
    np.testing.assert_allclose(parts(model, found.x, found.t, found.theta), [wanted["f"], wanted["g"]], atol=1e-12)
    np.testing.assert_allclose(found.by, np.hstack([found.x, found.theta]))
    values = dict(zip((one.path for one in model.flat_variables), slopes(model, point, "variables").value, strict=True))
    assert found.value == pytest.approx([values["f"], values["g"]])
    assert values["f"] == pytest.approx(values["v"] * values["w"] + 4)
    states = [model.states.index(name) for name in "xy"]
    np.testing.assert_allclose(variable_slopes(model, point, nodes)[:, states],
                               [wanted["f"][:2], wanted["g"][:2]], atol=1e-12)  # fmt: skip
    of_g = slopes(model, point, "variables", nodes[1:])
    np.testing.assert_allclose(parts(model, of_g.x, of_g.t, of_g.theta), [wanted["g"]], atol=1e-12)


def test_slopes_of_rates_and_their_change_along_the_motion(curved: Any) -> None:
    model, point, wanted = curved
    states = [model.states.index(name) for name in "xy"]
    found = slopes(model, point, "ode")
    np.testing.assert_allclose(parts(model, found.x, found.t, found.theta)[states], wanted["rates"], atol=1e-12)
    np.testing.assert_allclose(found.value[states], wanted["rate"])
    along = wanted["rates"][:, 2] + wanted["rates"][:, :2] @ wanted["rate"]
    np.testing.assert_allclose(found.rate[states], along, atol=1e-12)


@pytest.mark.parametrize("by", [("x", "t", "theta"), ("t",), ("theta", "x")])
def test_slopes_of_implicit_unknowns(curved: Any, by: tuple[str, ...]) -> None:
    model, point, wanted = curved
    known = {"x": wanted["z"][:, :2], "t": wanted["z"][:, 2:3], "theta": wanted["z"][:, 3:]}
    columns = {"x": [model.states.index(name) for name in "xy"], "t": [0], "theta": columns_of(model, ["k", "u"])}
    rows = [model.implicit.index(name) for name in "vw"]
    found = implicit_slopes(model, point, by)
    assert len(found) == len(by)
    for name, one in zip(by, found, strict=True):
        np.testing.assert_allclose(one[rows][:, columns[name]], known[name], atol=1e-12)


def test_functions_of_the_caller_and_their_constants(curved: Any) -> None:
    """Expressions (SX) of the model's symbols, or calls (MX) with constants, by which nothing is differentiated."""
    model, point, wanted = curved
    nodes = nodes_of(model, ["f", "g"])
    symbols = [ca.MX.sym(name, model.equations.ode.size1_in(k)) for k, name in enumerate(NAMES)]
    weights = ca.MX.sym("weights", 2)
    arguments = [*model.arguments.values()]
    plain = ca.Function("plain", arguments, [3 * model.equations.variables(*arguments)[nodes]])
    called = ca.Function("called", [*symbols, weights], [weights * model.equations.variables(*symbols)[nodes]])
    for name, function, constants in (
        ("plain", plain, ()),
        ("called", called, (np.array([2.0, -1.0]),)),
        ("called", called, (np.array([0.5, 4.0]),)),
    ):
        found = slopes(model, point, name, None, lambda function=function: function, *constants)
        expected = np.array([wanted["f"], wanted["g"]]) * np.reshape(constants or [3.0, 3.0], (2, 1))
        np.testing.assert_allclose(parts(model, found.x, found.t, found.theta), expected, atol=1e-12)
        assert found.theta.shape[1] == len(model.p) + len(model.u) + model.discrete_size
    second = slopes(model, point, "plain", [1], lambda: plain)
    np.testing.assert_allclose(parts(model, second.x, second.t, second.theta), [3 * wanted["g"]], atol=1e-12)


def test_where_a_split_is_undetermined_the_least_one_follows() -> None:
    """Two reactions bear 2 x + 3 p together, twice said; a third unknown is t·x."""
    t, x, z, p, u, d = given = [ca.SX.sym(name, 3 if name == "z" else 1) for name in NAMES]
    both = z[0] + z[1] - 2 * x - 3 * p
    alg = ca.Function("alg", given, [ca.vertcat(both, z[2] - t * x, both)])
    model: Any = fake_model(alg=alg, arguments=dict(zip(NAMES, given, strict=True)), implicit=(*"abc",))
    model.once, model.p, model.u = lambda _, make: make(), [5.0], [0.0]
    by_x, by_t, by_theta = implicit_slopes(model, Point(7.0, np.array([4.0]), np.zeros(3), np.zeros(1)))
    np.testing.assert_allclose(by_x, [[1.0], [1.0], [7.0]], atol=1e-12)
    np.testing.assert_allclose(by_t, [[0.0], [0.0], [4.0]], atol=1e-12)
    np.testing.assert_allclose(by_theta, [[1.5, 0, 0], [1.5, 0, 0], [0, 0, 0]], atol=1e-12)


def test_names_of_variables_parameters_and_inputs(curved: Any) -> None:
    model = curved[0]
    assert nodes_of(model, []) == []
    assert [model.flat_variables[k].path for k in nodes_of(model, ["g", "x"])] == ["g", "x"]
    assert columns_of(model, ["u", "k"]) == [len(model.p), model.parameter_position["k"]]
    with pytest.raises(UnknownName, match=r"^Curved has no variable 'k'\."):
        nodes_of(model, ["f", "k"])
    with pytest.raises(UnknownName, match=r"^Curved has no input or parameter 'kk'; did you mean 'k'"):
        columns_of(model, ["u", "kk"])


def test_slopes_that_are_not_finite(curved: Any) -> None:
    model, point, _ = curved
    point.z[model.implicit.index("v")] = np.nan
    with pytest.raises(SingularAtStart, match=r"The slopes of v, w are not finite at t = 0\.5 s\."):
        implicit_slopes(model, point)
