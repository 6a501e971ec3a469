"""What is told about equations without a unique solution, and what counts as one."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from fakes import fake_model

from modelica_like import build
from modelica_like.errors import SingularAtStart, Source
from modelica_like.flatten.model import Origin
from modelica_like.language import Component, Equations, Parameter, Variable, der, param, sin, sqrt, var
from modelica_like.native.start import initialize
from modelica_like.solve.initialize.plan import _generic_matrix
from modelica_like.solve.initialize.singular import _ANOTHER, _singular, implicit_singular, is_regular, singular_block
from modelica_like.solve.initialize.slopes import Sizes, implicit_slopes, variable_slopes

SQUARE = np.array([[2.0, 1.0], [1.0, 2.0]])
POINT: Any = SimpleNamespace(t=0.0, x=np.zeros(1), z=np.zeros(1), d=np.array([1.0, 1.0, 0.0]))
A, B, C = (Origin(path, "Part", Source("")) for path in "abc")
HOLDS = [SimpleNamespace(component=one, mode=k, number=1) for k, one in enumerate("abc")]


def model(**given: Any) -> Any:
    """All that messages read of a model; parameters are a.k = 0, a.m = 2, b.k = 0 and c.k = 0."""
    empty = {"motions": [], "implicit": (), "following": {}, "motion_sources": ()}
    paths = [SimpleNamespace(path=path) for path in ("a.k", "a.m", "b.k", "c.k")]
    units = [SimpleNamespace(unit="N.m"), SimpleNamespace(unit="N")]
    fixed = {"flat_parameters": paths, "p": np.array([0.0, 2.0, 0.0, 0.0]), "u": np.zeros(0)}
    position = {"a.tau": 0, "a.f": 1, "b.tau": 0, "a.w": 0}
    return fake_model(**{**empty, **fixed, "flat_variables": units, "position": position, **given})


def told(names: Any, origins: Any = (A, B), helps: Any = (), **given: Any) -> SingularAtStart:
    """The error, where another value of the parameters at positions `helps` makes the block regular."""
    regular = lambda p: any(p[k] == _ANOTHER for k in helps)  # noqa: E731
    return _singular(model(**given), POINT, 4, (tuple(names), tuple(origins)), regular)


@pytest.mark.parametrize(
    ("names", "given", "shown"),
    [
        ("uvwxyz", {}, "u, v, w, x, y, z"),
        ("tuvwxyz", {}, "t, u, v, w, x, y, …"),
        ("uvw", {"implicit": ("v", "w")}, "v, w"),
        (["a.tau", "x"], {"motions": HOLDS[:1]}, "a.tau, x"),  # only where several hold do others matter less
        (["a.tau", "b.tau", "x"], {"motions": HOLDS}, "a.tau, b.tau"),
        (["x", "y"], {"motions": HOLDS}, "x, y"),
        (["c.tau", "a.tau"], {"motions": [*HOLDS[2:], HOLDS[0]]}, "c.tau, a.tau"),  # the mode of c holds nothing
    ],
)
def test_unknowns_of_a_singular_block(names: Any, given: Any, shown: str) -> None:
    assert told(names, (A, B, C), **given).what == f"The Jacobian is singular at t = 0 s in block 5 ({shown})."


@pytest.mark.parametrize(
    ("helps", "given", "why", "advice"),
    [
        ((0,), {}, "a.k is zero, so these", "Give it another"),
        ((0, 1, 2, 3), {}, "a.k and b.k are zero, so these", "Give one of them"),  # a.m is not zero, c not in the block
        ((1, 3), {}, "Its equations do not", "Start elsewhere"),
        ((0,), {"motions": HOLDS[:1]}, "a.k is zero", "Give it another"),
        ((0,), {"motions": HOLDS[:2]}, "a and b stick: where they hold the same motion, their torque", "Give one of"),
        ((), {"following": {"s": ("x", "y"), "r": ("q",)}}, "Its equations", "At the start, give guesses of x near"),
    ],
)
def test_why_a_block_is_singular(helps: Any, given: Any, why: str, advice: str) -> None:
    error = told(["x", "a.tau"], helps=helps, **given)
    assert error.why.startswith(why)
    assert error.advice.startswith(advice)


def test_what_is_held_among_other_equations_may_be_undetermined_for_another_reason() -> None:
    assert told(["a.tau"], (A, B), holds=HOLDS[:1]).why.startswith("Its equations do not")


@pytest.mark.parametrize(
    ("sources", "name", "why"),
    [
        ("", "a.tau", "prescribed: no torque can"),
        ("p", "a.f", "prescribed by p: no force can"),
        ("pqr", "a.tau", "prescribed by p, q and r: no torque can"),
        ("pqrs", "a.tau", "prescribed: no torque can"),
    ],
)
def test_who_prescribes_what_is_held(sources: str, name: str, why: str) -> None:
    error = told([name], (A,), motions=HOLDS[:1], motion_sources=tuple(sources))
    assert error.why == f"a holds a motion that is {why} stop it."


@pytest.mark.parametrize(("slope", "named"), [(-1.0, True), (1.0, True), (1e-13, False), (-1e-13, False)])
def test_a_determinant_of_any_sign_is_regular(slope: float, named: bool) -> None:
    determinants = lambda t, x, z, p, u, d: ca.DM([0, (t == 0.0) * len(x) * slope * p[0]])  # noqa: E731
    error = singular_block(model(determinants=determinants, singular=[None, (("x",), (A,))]), POINT, 1)
    assert error.why.startswith("a.k is zero") == named


def test_the_first_implicit_block_that_is_singular_is_told() -> None:
    def of(*diagonal: float) -> SingularAtStart:
        blocks = [((name,), (A,)) for name in "xyz"]
        jacobian = lambda t, x, *_: (t == 0.0) * len(x) * ca.diag(ca.DM(diagonal))  # noqa: E731
        return implicit_singular(model(alg_jacobian=jacobian, implicit=(*"xyz",), implicit_blocks=blocks), POINT)

    assert "in block 1 (x)." in of(0, 1, 1).what
    assert "in block 2 (y)." in of(1, 0, 0).what
    assert "in block 3 (z)." in of(1, 1, np.nan).what
    assert of(1, 1, 1).what == "The equations for x, y, z have no finite value at t = 0 s."


def test_units_of_rows_and_columns_do_not_matter() -> None:
    rows, columns = np.array([1.0, 1e20])[:, None], np.array([1e-20, 1e15])
    for matrix in (SQUARE, rows * SQUARE, SQUARE * columns, rows * SQUARE * columns):
        assert is_regular(matrix)
        assert is_regular(-matrix)
    for flaw in (np.diag([0, np.nan]), np.diag([0, np.inf]), -np.diag([0, 1.5]), -np.outer([0, 1], [1, 2])):
        assert not is_regular(SQUARE + flaw)


def test_generic_points_are_moved_but_rates_are_not() -> None:
    t, d = ca.SX.sym("t"), ca.SX.sym("d", 0)
    x, y, z = (ca.SX.sym(name, 2) for name in "xyz")

    def at(extra: float, rates: tuple[int, ...]) -> Any:
        entries = ca.vertcat(x, y, z, extra)
        function = ca.Function("start", [t, x, y, z, d, d, d], [y, ca.diag(entries), entries])
        system: Any = SimpleNamespace(function=function, rates=rates)
        values = {name: np.array([3.0, -1.0]) for name in "xz"}
        point: Any = SimpleNamespace(t=0.0, d=[], **values)
        point.copy = lambda: SimpleNamespace(t=0.0, d=[], **{key: one.copy() for key, one in values.items()})
        found = _generic_matrix(model(p=[], u=[]), system, point)
        assert all((one == [3.0, -1.0]).all() for one in values.values())
        return found

    assert at(np.inf, ()) is None
    found = np.diag(at(1.0, (1, 2)).full())
    assert found[[1, 2]] == pytest.approx(0)
    size = 1 + np.array([3.0, 1.0, 3.0, 1.0])
    moved = (found[[0, 1, 4, 5]] - [3, -1, 3, -1]) / size
    assert ((moved[[0, 2, 3]] >= 0.05) & (moved[[0, 2, 3]] <= 0.1)).all()
    free = np.diag(at(1.0, ()).full())
    parts = [*(free[[0, 1, 4, 5]] - [3, -1, 3, -1]) / size / 0.1, *free[2:4]]
    assert (min(parts) >= 0.5, max(parts) <= 1.0, len({*np.round(parts, 6)})) == (True, True, 6)


class Root(Component):
    """Slopes of y and z by x are not finite at x = 0; z is implicit."""

    x: Variable = var("1", "state")
    y: Variable = var("1", "its root")
    z: Variable = var("1", "z + sin(z)/2 = sqrt(x)")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1
        yield self.y == sqrt(self.x)
        yield self.z + 0.5 * sin(self.z) == self.y


def test_slopes_that_are_not_finite_are_told() -> None:
    root = build(Root(x=0.0))
    point = initialize(root)
    with pytest.raises(SingularAtStart, match=r"The slopes of x, y are not finite at t = 0 s\."):
        variable_slopes(root, point, [root.position["x"], root.position["y"]])
    with pytest.raises(SingularAtStart, match=r"The slopes of z are not finite at t = 0 s\."):
        implicit_slopes(root, point, ("x",))
    point.x[:] = 4.0
    assert variable_slopes(root, point, [root.position["x"], root.position["y"]]) == pytest.approx(
        np.array([[1.0], [0.25]])
    )
    assert implicit_slopes(root, point, ("x",))[0] == pytest.approx(0.25 / (1 + 0.5 * np.cos(point.z[0])))


def test_sizes_of_slopes() -> None:
    sizes = Sizes(x=1, z=2, p=3, u=5, d=7)
    assert (sizes.fixed, sizes.theta) == (8, 15)
