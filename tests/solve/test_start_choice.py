"""Which start values count, against ranks of chosen rows, and how they are used."""

import re
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from fakes import fake_model
from scipy.linalg import null_space

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import StartEntry
from modelica_like.compile.start_system import StartSystem
from modelica_like.errors import MissingStart
from modelica_like.solve.initialize import plan as module
from modelica_like.solve.initialize.plan import (
    StartPlan,
    _Choice,
    _is_regular,
    _to_give,
    direct_starts,
    is_near,
    near_states,
    start_plan,
)
from modelica_like.solve.initialize.point import Point

FUNCTION = ["t", "x", "y", "z", "p", "u", "d"]


class Rows:
    """Rows that are taken if they raise the rank."""

    def __init__(self, columns: int) -> None:
        self.taken = np.zeros((0, columns))

    def add(self, row: np.ndarray) -> bool:
        more = np.vstack([self.taken, row])
        if np.linalg.matrix_rank(more, 1e-9) == len(self.taken):
            return False
        self.taken = more
        return True


class Drawn:
    """A random start system, with start values of any kind; numbers are those of its Jacobian."""

    def __init__(self, seed: int) -> None:
        r = self.r = np.random.default_rng(seed)
        self.nx, self.ny, self.nz = (int(r.integers(*one)) for one in ((1, 5), (0, 4), (0, 4)))
        nodes = r.permutation(range(20, 20 + int(r.integers(0, 8)))).tolist()
        self.size = self.nx + self.ny + self.nz
        own = self.ny + self.nz
        self.numbers = r.integers(-2, 3, (own + len(nodes), self.size)) * (r.random((own + len(nodes), 1)) < 0.9)
        self.numbers[own:] *= r.random((len(nodes), self.size)) < 0.4
        sizes = {"t": 1, "x": self.nx, "y": self.ny, "z": self.nz, "p": 1, "u": 1, "d": 1}
        symbols = [ca.SX.sym(name, size) for name, size in sizes.items()]
        pattern = ca.sparsify(ca.DM(self.numbers.astype(float)))
        values = ca.SX.zeros(len(self.numbers))
        function = ca.Function("start", symbols, [symbols[2], ca.SX(pattern), values], FUNCTION, ["v", "j", "values"])
        rest = [(node, None) for node in nodes if r.random() < 0.4] + [
            (9, k) for k in range(self.nx) if r.random() < 0.5
        ]
        self.system = StartSystem(function, tuple(nodes), tuple(rest[k] for k in r.permutation(len(rest))))
        self.matrix = pattern
        starts = [StartEntry(node, None, str(r.choice(["fixed", "guess", "default"]))) for node in nodes]
        states = r.integers(0, self.nx, int(r.integers(0, 4)))
        starts += [StartEntry(9, (int(k), 2.0), str(r.choice(["fixed", "guess", "default"]))) for k in states]
        self.starts = [starts[k] for k in r.permutation(len(starts))]
        names = r.permutation(30)
        variables = [SimpleNamespace(path=f"v{names[k]:02}") for k in range(30)]
        self.model: Any = fake_model(
            entries=self.starts, states=[f"s{k}" for k in range(self.nx)], implicit=["z"] * self.nz, places={},
            flat_variables=variables, following={}, rest_system=self.system, start_system=None,
        )  # fmt: skip

    def choose(self, kind: str, structural: bool) -> tuple[Rows, list[int], dict[str, Any]]:
        """What the rows that raise the rank say, one after the other."""
        r, nx, own = self.r, self.nx, self.ny + self.nz
        direct: dict[int, int] = {}
        for k, one in enumerate(self.starts):
            if one.strength == "fixed" and one.state is not None and one.state[0] not in direct:
                direct[one.state[0]] = k
        free = [k for k in range(nx) if k not in direct]
        columns = [*free, *range(nx, self.size)]
        rows, unit = Rows(len(columns)), np.eye(self.size)

        def add(k: int) -> bool:
            """Structure is what is so for any numbers, even if a row comes twice; each equation has its own unknown."""
            own_one = (np.arange(self.size) == nx + k) & (k < own)
            number = np.where((self.numbers[k] != 0) | own_one, r.uniform(1, 2, self.size), 0)
            return rows.add((number if structural else self.numbers[k])[columns])

        taken = [add(k) for k in range(own)]
        begin = [k for k in range(own) if taken[k]]
        assert len(begin) == own or not structural
        kept = [k for k in range(self.size - self.nz, self.size) if len(begin) < own and rows.add(unit[k, columns])]
        row_of = {node: own + k for k, node in enumerate(self.system.nodes)}
        general = [k for k, one in enumerate(self.starts) if one.strength == "fixed" and one.state is None]
        chosen = [k for k in general if add(row_of[self.starts[k].node])]
        dependent = [k for k in general if k not in chosen]
        name = lambda k: self.model.flat_variables[self.starts[k].node].path  # noqa: E731
        defaults = [k for k, one in enumerate(self.starts) if one.strength == "default" and one.node in row_of]
        chosen += [k for k in sorted(defaults, key=name) if add(row_of[self.starts[k].node])]
        resting, zero = [], []
        for node, state in self.system.rest:
            if state is None:
                resting += [node] if add(row_of[node]) else []
            elif state in free:
                zero += [state] if rows.add(unit[state, columns]) else []
        wanted = [*begin, *(row_of[self.starts[k].node] for k in chosen), *(row_of[node] for node in resting)]
        unknown = [k for k in columns if k not in {*zero, *kept}]
        found = {"rows": chosen, "dependent": dependent, "resting": resting, "zero": zero, "columns": unknown}
        return rows, columns, {**found, "wanted": wanted, "direct": list(direct.items())}


@pytest.mark.parametrize("structural", [True, False])
@pytest.mark.parametrize("first", range(0, 60, 12))
def test_start_values_count_as_long_as_they_raise_the_rank(structural: bool, first: int) -> None:
    missing = found = 0
    for seed in range(first, first + 12):
        drawn = Drawn(seed)
        model = drawn.model
        # A default of a state counts where a start system has its row.
        drawn.starts = model.starts.entries = [
            one for one in drawn.starts if one.state is None or one.strength != "default"
        ]
        rows, columns, wanted = drawn.choose("rest", structural)
        if not [k for k in columns if k < drawn.nx] and not (wanted["rows"] or wanted["dependent"]):
            wanted = {**{key: [] for key in wanted}, "direct": wanted["direct"]}
        elif (lacks := len(columns) - len(rows.taken)) > 0:
            missing += 1
            with pytest.raises(MissingStart) as caught:
                _Choice(model, "rest").plan(None if structural else drawn.matrix)
            what = "one equation: give " if lacks == 1 else f"{lacks} equations: give "
            assert caught.value.what.startswith(f"Initialization (not the model) lacks {what}")
            told = set(re.findall(r"s\d", caught.value.what))
            ways = null_space(rows.taken) if len(rows.taken) else np.eye(len(columns))
            needed = {
                f"s{k}" for k, way in zip(columns, ways, strict=True) if np.abs(way).max() > 1e-9 and k < drawn.nx
            }
            assert told == needed if structural else told >= needed
            assert (f"give {lacks} of" in caught.value.what) == (1 < lacks != len(told))
            continue
        plan = _Choice(model, "rest").plan(None if structural else drawn.matrix)
        assert {key: list(getattr(plan, key)) for key in wanted} == wanted
        assert (plan.kind, plan.system) == ("rest", drawn.system)
        if plan.columns:
            found += 1
            assert len(plan.columns) == len(plan.wanted)
            assert plan.own == len(plan.wanted) - len(wanted["rows"]) - len(wanted["resting"])
    assert min(missing, found) > 0


def test_a_plan_takes_its_part_of_the_system() -> None:
    r = np.random.default_rng(1)
    numbers = r.integers(-2, 3, (6, 5)).astype(float)
    pattern = ca.sparsify(ca.DM(numbers))
    symbols = [ca.SX.sym(name) for name in FUNCTION]
    function = ca.Function("start", symbols, [symbols[2], ca.SX(pattern), ca.SX.zeros(6)])
    system = StartSystem(function, ())
    plan = StartPlan("given", system, (), rows=(2, 0), resting=(7,), columns=(3, 0, 4), wanted=(1, 5, 2, 0))
    assert plan.own == 1
    entries = plan.entries(np.array(pattern.nonzeros()))
    assert (plan.matrix(entries).full() == numbers[[1, 5, 2, 0]][:, [3, 0, 4]]).all()
    assert plan.targets(np.array([5.0, 6.0, 7.0])).tolist() == [0.0, 7.0, 5.0, 0.0]
    assert plan.targets(np.array([[5.0, 1.0], [6.0, 2.0], [7.0, 3.0]])).tolist() == [[0, 0], [7, 3], [5, 1], [0, 0]]


def test_a_steady_start_solves_nothing_and_the_order_of_lines_does_not_count() -> None:
    drawn = Drawn(3)
    drawn.model.start_system = drawn.system
    drawn.model.rest_system = None
    plan = _Choice(drawn.model, "steady").plan(None)
    assert plan == StartPlan("steady", drawn.system, tuple(direct_starts(drawn.model).items()))


@pytest.mark.parametrize(
    ("columns", "regular", "generic", "plans"),
    [((), False, True, ["structure"]), ((0,), True, True, ["structure"]),
     ((0,), False, True, ["structure", "numbers"]), ((0,), False, False, ["structure"])],
)  # fmt: skip
def test_numbers_decide_where_structure_chose_dependent_rows(
    monkeypatch: pytest.MonkeyPatch, columns: Any, regular: bool, generic: bool, plans: list[str]
) -> None:
    made: list[str] = []
    model: Any = SimpleNamespace(once=lambda key, make: make() if key == (Cached.START_PLAN, "rest") else None)
    point: Any = SimpleNamespace()
    matrix, moving = object() if generic else None, object()

    class Choice:
        def __init__(self, *given: Any) -> None:
            assert given == (model, "rest", moving)[: 3 if made else 2]

        def plan(self, given: Any) -> Any:
            assert given in (None, matrix)
            made.append("structure" if not made else "numbers")
            return SimpleNamespace(columns=columns, system="system", name=made[-1])

    monkeypatch.setattr(module, "_Choice", Choice)
    monkeypatch.setattr(
        module, "_is_regular", lambda *given: regular and (given[0], given[1].name, given[2]) == (model, made[0], point)
    )

    def generic_matrix(*given: Any, **how: bool) -> Any:
        assert given == (model, "system", point)
        return moving if how == {"moving": True} else matrix

    monkeypatch.setattr(module, "_generic_matrix", generic_matrix)
    assert getattr(start_plan(model, "rest", point), "name") == plans[-1]  # noqa: B009
    assert made == plans


def test_a_matrix_found_regular_is_not_looked_at_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """The matrix is that of rest: rates among the states, here x[1], are zero; variables of start values, too."""
    t, x, y, z, p, u, d = symbols = [ca.SX.sym(name, 2 if name == "x" else 1) for name in FUNCTION]
    slopes = ca.vertcat(ca.horzcat(x[0] + x[1], 0, t), ca.horzcat(y + p, z, u + d))
    function = ca.Function("start", symbols, [y, slopes, ca.SX.zeros(2)])
    system = StartSystem(function, (), (), (1, 2))
    plan = StartPlan("given", system, (), columns=(0, 2), wanted=(0, 1))
    cache: dict[Any, Any] = {}

    def once(key: Any, make: Any) -> Any:
        return cache.setdefault(key, None) or cache.update({key: make()}) or cache[key]

    def fast(key: Any, make: Any, results: tuple[int, ...]) -> Any:
        return lambda *given: [np.array(make()(*given)[k].nonzeros()) for k in results]

    model: Any = SimpleNamespace(once=once, fast=fast, p=[3.0], u=[5.0])
    point = Point(2.0, np.array([7.0, 11.0]), np.array([13.0]), np.array([17.0]))
    looked: list[list[list[float]]] = []

    def regular(matrix: Any, entries: np.ndarray) -> bool:
        assert matrix.nonzeros() == entries.tolist()
        looked.append(matrix.full().tolist())
        return len(looked) != 2

    monkeypatch.setattr(module, "_regular", regular)
    assert _is_regular(model, plan, point)
    assert looked == [[[7.0, 2.0], [3.0, 22.0]]]
    point.x[1] = 0.0
    assert _is_regular(model, plan, point)
    assert len(looked) == 1
    point.x[0] = 8.0
    assert not _is_regular(model, plan, point)
    assert _is_regular(model, plan, point)
    assert len(looked) == 3


@pytest.mark.parametrize("strength", ["fixed", "guess", "default"])
@pytest.mark.parametrize("state", [None, (0, 1.0)])
@pytest.mark.parametrize("guess", [0.0, 2.0])
def test_where_the_search_for_a_variable_begins(strength: str, state: Any, guess: float) -> None:
    entry = StartEntry(1, state, strength)
    starts = SimpleNamespace(entries=[entry])
    model: Any = SimpleNamespace(flat_variables=[None, SimpleNamespace(guess=guess)], starts=starts)
    near = {"fixed": state is None, "guess": True, "default": not guess}[strength]
    assert is_near(model, entry) == near
    assert near_states(model) == ([(0, entry)] if near and state is not None else [])


def test_what_can_get_a_start_value() -> None:
    model: Any = SimpleNamespace(following={"way": ("a.s", "b.s")})
    assert [_to_give(model, one) for one in ("a.w", "der(a.w)", "way", "der(way)")] == [
        "a.w", "der(a.w)", "a.s or b.s", "a rate of a.s or b.s",
    ]  # fmt: skip
