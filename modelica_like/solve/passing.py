"""Edges that IDAS has stepped over, found by the slopes between them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.solve.idas import Integrator
from modelica_like.solve.looks import Looks

_INNER = 16
"""Parts of an interval between two looks in which edges are located."""
_ROUNDS, _LEAST, _LOCATED = 40, 1e-3, 1e-11
"""Rounds in which edges are located; least share of an interval, and precision over the distance of looks: a jump of
the slopes changes a window by that share of it."""
_MOST = 200
"""Edges between two looks above which they are not located more precisely: rounding changes a sign without end."""
_NODES = 8, 4
"""Looks of two polynomials through states: their difference tells what is not known between the looks."""
_ERROR = 10.0
"""Error of a window between two edges, in tolerances: IDAS keeps each step within one, and a look has several."""
_DOUBT = 3.0
"""Factor of estimates of what is not known."""
_ROUNDING = 1e-13
"""Of an argument of a kink, relative to its largest value between two looks."""
_STEPS = 8
"""Fixed steps of order four in a window."""
_NEAR = 0.1
"""An extremum between two looks is checked if it is this close to zero, relative to the values at both."""
_GAUSS = np.polynomial.legendre.leggauss(5)


class Passing:
    """Judges the looks of a panel by the edges between them.

    A window is the time between two edges. IDAS has seen it if the slopes in it explain how the states change there;
    where they do not, the panel has to end at the edge before it.

    Args:
        model: the compiled model.
        integrator: for tolerances and implicit unknowns.
    """

    def __init__(self, model: CompiledDae, integrator: Integrator) -> None:
        self.model, self.integrator = model, integrator
        self.count, self.phases = model.edges.count, model.edges.phases

    def advance(self, looks: Looks, in_sight: Callable[[Looks], int]) -> float:
        """Return the largest advance of a phase between two looks, over the advance that is allowed.

        Args:
            looks: integrated points.
            in_sight: returns the last look that counts, asked for where the advance is too large.
        """
        if not self.phases:
            return 0.0
        advances = np.abs(np.diff(self._values(looks, looks.times, looks.x, looks.z)[self.count :]))
        if advances.shape[1] > 1:  # a phase may jump, but not between all looks
            beside = np.pad(advances, ((0, 0), (1, 1)))
            advances = np.minimum(advances, np.maximum(beside[:, :-2], beside[:, 2:]))
        if advances.max() > 1:
            advances = advances[:, : in_sight(looks.every(1))]
        return float(advances.max())

    def first(self, looks: Looks, last: int, after: float) -> float | None:
        """Return the time at which the panel has to end: the first edge behind which IDAS has seen no window.

        Or where a guard is positive that is not at the looks around; None if there is no such time up to a look.

        Args:
            looks: integrated points.
            last: the last look to judge.
            after: time in s up to which nothing is resolved.
        """
        if not self.count:
            return None
        values = self._values(looks, looks.times, looks.x, looks.z)[: self.count, : last + 1]
        flagged = _crossed(values) | _touched(values)
        for k in np.flatnonzero(flagged.any(axis=0)).tolist():
            edges = self._edges(looks, k)
            edges = edges[edges > after]
            windows = np.array([looks.times[k], *edges, looks.times[k + 1]])
            windows = windows[np.append(True, np.diff(windows) > 0)]
            if not len(edges):
                continue
            if (rise := self._rise(looks, k, windows)) is not None:
                return rise
            if not flagged[: self.model.edges.slopes, k].any():
                continue
            if self._unseen(looks, k, windows) and not self._confirmed(looks, k, windows):
                return float(edges[0])
        return None

    def _values(self, looks: Looks, times: Vector, x: Vector, z: Vector) -> Vector:
        return self._along("edges", self.model.edges.function, looks, times, x, z)

    def _along(self, key: str, function: Any, looks: Looks, times: Vector, x: Vector, z: Vector) -> Vector:
        d = np.broadcast_to(looks.d[:, None], (len(looks.d), len(times)))
        return self.model.along(key, lambda: function)(times, x, z, self.model.p, self.model.u, d)[0]

    def _edges(self, looks: Looks, k: int) -> Vector:
        """Return the times of the edges between two looks, sorted, each just behind the edge.

        What was located becomes another point at which all edges are evaluated: the argument of a kink may have kinks.
        """
        times = np.linspace(looks.times[k], looks.times[k + 1], _INNER + 1)
        values = self._inside(looks, k, times)
        # Where an argument is zero but for the tolerances, its sign says nothing: the edge is not yet, or just passed.
        begin = looks.x[:, k, None]
        shaken = self._values(looks, times[:1], begin + self.integrator.weights(begin), looks.z[:, k, None])
        doubt = np.abs(shaken[: self.count, 0] - values[:, 0])
        # An argument may be flat before its edge, as one of |w| + w is: it is known there, and its rounding is no edge.
        rounding = _ROUNDING * np.abs(values).max(axis=1)
        unsure = (np.abs(values[:, 0]) <= doubt) & (doubt > rounding)
        values[unsure, 0] = values[unsure, 1]
        telling = np.abs(values).max(axis=1) > doubt  # the sign of others is rounding, and changes ever more often
        values[~telling] = 1.0
        values -= rounding[:, None]
        for number in range(_ROUNDS):
            before = _crossed(values).any(axis=0).nonzero()[0]
            open = before[times[before + 1] - times[before] > _LOCATED * looks.width]
            if not len(open) or len(open) > _MOST:
                break
            edge = np.argmax(_crossed(values)[:, open], axis=0)
            g0, g1 = values[edge, open], values[edge, open + 1]
            share = np.clip(g0 / (g0 - g1), _LEAST, 1 - _LEAST) if number % 3 else 0.5
            new = times[open] + share * (times[open + 1] - times[open])
            order = np.argsort(all := np.append(times, new), kind="stable")
            inside = np.where(telling[:, None], self._inside(looks, k, new) - rounding[:, None], 1.0)
            times, values = all[order], np.append(values, inside, axis=1)[:, order]
        return times[1:][_crossed(values).any(axis=0)]

    def _inside(self, looks: Looks, k: int, times: Vector) -> Vector:
        x = _between(looks, k, times, _NODES[0])
        return self._values(looks, times, x, self._implicit(looks, k, times, x))[: self.count]

    def _implicit(self, looks: Looks, k: int, times: Vector, x: Vector) -> Vector:
        share = (times - looks.times[k]) / looks.width
        guess = looks.z[:, k, None] + share * (looks.z[:, k + 1] - looks.z[:, k])[:, None]
        return self.integrator.polished(times, x, guess, looks.d)

    def _rise(self, looks: Looks, k: int, windows: Vector) -> float | None:
        """Return the first of edges and middles of windows at which a guard is positive that is not at the looks."""
        active = looks.guards.active(looks.d)
        below = active[(looks.seen[0][active, k : k + 2] <= 0).all(axis=1)]
        if not len(below):
            return None
        times = np.sort(np.append(windows[1:-1], 0.5 * (windows[1:] + windows[:-1])))
        x = _between(looks, k, times, _NODES[0])
        guards = self._along("guards", self.model.guards, looks, times, x, self._implicit(looks, k, times, x))
        positive = (guards[below] > 0).any(axis=0)
        return float(times[np.argmax(positive)]) if positive.any() else None

    def _unseen(self, looks: Looks, k: int, windows: Vector) -> bool:
        """Whether states change otherwise than by the slopes in one of the windows between two looks."""
        widths = np.diff(windows)
        times = (windows[:-1, None] + widths[:, None] * (0.5 + 0.5 * _GAUSS[0])).ravel()
        changes, moved = list[Vector](), np.zeros(0)
        for nodes in reversed(_NODES):
            x = _between(looks, k, times, nodes)
            moved = np.diff(_between(looks, k, windows, nodes), axis=1)
            changes.append(moved - self._integral(looks, k, times, x, widths))
        shaken = _between(looks, k, times, _NODES[0])
        shaken = shaken + self.integrator.weights(shaken)
        doubts = [changes[0] - changes[1], moved - self._integral(looks, k, times, shaken, widths) - changes[1]]
        error = np.abs(changes[1]) - _DOUBT * sum(np.abs(one) for one in doubts)
        return bool((error > _ERROR * self.integrator.weights(looks.x[:, k])[:, None]).any())

    def _confirmed(self, looks: Looks, k: int, windows: Vector) -> bool:
        """Whether fixed steps from edge to edge lead to the same states: polynomials across a kink are less precise."""
        x = looks.x[:, k]
        with np.errstate(over="ignore", invalid="ignore"):  # what runs away is not confirmed
            for begin, end in pairwise(windows):
                h = (end - begin) / _STEPS
                for t in begin + h * np.arange(_STEPS):
                    x = self._fixed_step(looks, k, t, x, h)
            return bool((np.abs(x - looks.x[:, k + 1]) <= _ERROR * self.integrator.weights(x)).all())

    def _fixed_step(self, looks: Looks, k: int, t: float, x: Vector, h: float) -> Vector:
        slopes = [np.zeros_like(x)]
        for share in (0.0, 0.5, 0.5, 1.0):
            now = x + share * h * slopes[-1]
            slopes.append(self._slopes(looks, k, np.array([t + share * h]), now[:, None])[:, 0])
        return x + h / 6 * (slopes[1] + 2 * slopes[2] + 2 * slopes[3] + slopes[4])

    def _integral(self, looks: Looks, k: int, times: Vector, x: Vector, widths: Vector) -> Vector:
        """Integrate slopes over windows, shape (nx, windows)."""
        slopes = self._slopes(looks, k, times, x)
        return (slopes.reshape(len(x), len(widths), -1) @ _GAUSS[1]) * 0.5 * widths

    def _slopes(self, looks: Looks, k: int, times: Vector, x: Vector) -> Vector:
        return self._along("slopes", self.model.ode, looks, times, x, self._implicit(looks, k, times, x))


def _crossed(values: Vector) -> Any:
    above = values > 0
    return above[:, 1:] != above[:, :-1]


def _touched(values: Vector) -> Any:
    """Tell where cubics between looks come near zero without a change of sign; shape (edges, looks - 1)."""
    if values.shape[1] < 3:
        return np.zeros((len(values), max(values.shape[1] - 1, 0)), bool)
    slopes = np.gradient(values, axis=1)
    sign = np.sign(values)[:, :-1]
    g0, g1, r0, r1 = (sign * one for one in (values[:, :-1], values[:, 1:], slopes[:, :-1], slopes[:, 1:]))
    lowest = np.minimum.reduce([
        g0 * (1 + 2 * s) * (1 - s) ** 2 + r0 * s * (1 - s) ** 2 + g1 * s * s * (3 - 2 * s) + r1 * s * s * (s - 1)
        for s in (0.25, 0.5, 0.75)
    ])  # fmt: skip
    return (r0 < 0) & (r1 > 0) & (lowest < _NEAR * (g0 + g1))


def _between(looks: Looks, k: int, times: Vector, nodes: int) -> Vector:
    """Interpolate states near look k by a polynomial through the states at some looks; shape (nx, times)."""
    nodes = min(nodes, looks.count + 1)
    first = min(max(k - (nodes // 2 - 1), 0), looks.count + 1 - nodes)
    powers = np.arange(nodes)
    basis = np.linalg.inv((powers[:, None] - float(k - first)) ** powers)
    share = (times - looks.times[k]) / looks.width
    base = looks.x[:, k, None]
    return base + (looks.x[:, first : first + nodes] - base) @ (share[:, None] ** powers @ basis).T
