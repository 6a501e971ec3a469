"""Calls through fixed memory: the same numbers as ordinary calls, at any number of points."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like.compile import buffers
from modelica_like.compile.buffers import Along, BufferedFunction


def function(sizes: dict[str, int], *, plain: bool = True) -> ca.Function:
    """Two results of (t, x, z, p, u, d) in which every entry of every argument counts differently."""
    kind = ca.SX if plain else ca.MX
    arguments = {name: kind.sym(name, size) for name, size in {"t": 1, **sizes}.items()}
    every = ca.vertcat(*arguments.values())
    weights = ca.DM(range(1, every.numel() + 1))
    results = [ca.vertcat(ca.dot(weights, ca.sin(every)), arguments["t"] ** 2), ca.sumsqr(every) * weights]
    return ca.Function("both", [*arguments.values()], results, [*arguments], ["one", "other"])


def points(sizes: dict[str, int], count: int, seed: int) -> dict[str, Any]:
    chance = np.random.default_rng(seed)
    shapes = {name: (size,) if name in "pu" else (size, count) for name, size in sizes.items()}
    return {"t": chance.uniform(size=count), **{name: chance.uniform(size=shape) for name, shape in shapes.items()}}


def one_by_one(called: ca.Function, given: dict[str, Any]) -> list[Any]:
    """The results of ordinary calls."""
    found = [
        called(*(one[k] if name == "t" else one if name in "pu" else one[:, k] for name, one in given.items()))
        for k in range(len(given["t"]))
    ]
    return [np.hstack([one[row].full() for one in found]) for row in range(2)]


SIZES = st.tuples(*5 * [st.integers(0, 2)]).map(lambda sizes: dict(zip("xzpud", sizes, strict=True)))


@given(SIZES, st.lists(st.integers(1, 70), min_size=1, max_size=3), st.booleans())
@settings(deadline=None, max_examples=25)
def test_many_points_are_as_one_by_one(sizes, counts, plain):
    called = function(sizes, plain=plain)
    along = Along(called)
    for seed, count in enumerate(counts):
        given = points(sizes, count, seed)
        for found, expected in zip(along(*given.values()), one_by_one(called, given), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_parameters_and_inputs_may_change_between_calls():
    """Each alone, and back again: what is kept from call to call must not be told from the one before."""
    sizes = dict.fromkeys("xzpud", 2)
    called, given = function(sizes), points(dict.fromkeys("xzpud", 2), 9, 3)
    along = Along(called)
    for changed in ((), ("p",), ("u",), (), ("p", "u"), ()):
        now = {name: one + 1.5 * (name in changed) for name, one in given.items()}
        for found, expected in zip(along(*now.values()), one_by_one(called, now), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-13)


@pytest.mark.parametrize(
    ("count", "sizes"),
    [
        (1, [8]),
        (8, [8]),
        (9, [8, 8]),
        (48, 6 * [8]),
        (49, [64]),
        (64, [64]),
        (120, [64, 64]),
        (3072 + 1, [4096]),
        (3072, 6 * [512]),
        (4096 + 512 + 64 + 3, [4096, 512, 64, 8]),
    ],
)
def test_blocks_are_as_large_as_three_quarters_of_what_is_left(count, sizes, monkeypatch):
    """A larger block is taken where so much of it is used; of the smallest ones there are as many as needed."""
    taken: list[int] = []

    class Counted(BufferedFunction):
        def along(self, points: list[Any], p: Any, u: Any) -> list[Any]:
            taken.append(self.function.size2_in(0))
            return super().along(points, p, u)

    monkeypatch.setattr(buffers, "BufferedFunction", Counted)
    given = points(dict.fromkeys("xzpud", 1), count, 0)
    Along(function(dict.fromkeys("xzpud", 1)))(*given.values())
    assert taken == sizes


@pytest.mark.parametrize(("plain", "group"), [(True, 8), (False, 1)])
def test_small_functions_are_unrolled(plain, group):
    """Points in groups, which share parameters and inputs; what is no plain expression is called point by point."""
    along = Along(function(dict.fromkeys("xzpud", 1), plain=plain))
    assert along._function.size2_in(0) == group
    assert along._function.size2_in(3) == 1


def test_one_call_and_what_it_left():
    called = function({"x": 2, "z": 0, "p": 1, "u": 0, "d": 1})
    buffered, second = BufferedFunction(called), BufferedFunction(called, (1,))
    arguments = [0.3, [1.0, 2.0], [], [0.7], [], [4.0]]
    expected = [one.full().ravel() for one in called(*arguments)]
    first = buffered(*arguments)
    for found in (first, buffered.latest()):
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-15)
    (other,) = second(*arguments)
    np.testing.assert_allclose(other, expected[1], rtol=1e-15)
    buffered(*(2 * np.asarray(one) for one in arguments))
    np.testing.assert_allclose(first[1], expected[1], rtol=1e-15)  # results are one's own
    buffered.forget()
    assert all(np.isnan(one).all() for one in buffered.latest())
