"""Motions that the present modes hold: which they are, how elements share what they hold together, and impacts."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Circuit, CompiledDae, CompiledHold, Vector
from modelica_like.compile.functions import ROUNDING
from modelica_like.compile.soon import TIME_RESOLUTION
from modelica_like.flatten.holds import TERMS
from modelica_like.initialize.point import Point, call, solve_implicit, variable_slopes
from modelica_like.language.hold import UNLIMITED

_DEPENDENT = 1e-9
_INSTANT = 1e-9
"""Duration of an impact in s over which the approach is asked for; finite forces cancel whatever it is."""
_LARGE, _SMALL = 1e6, 1e-6
_SAYS_NOTHING = 1e-12


@dataclass(frozen=True)
class Impact:
    """Energy that an impact has dissipated.

    Attributes:
        time: in s.
        component: path of the component that stopped a motion.
        energy: in J.
    """

    time: float
    component: str
    energy: float


def terms(model: CompiledDae, point: Point) -> Any:
    """Gain, capacities and restitution of every held motion; shape (holds, TERMS)."""
    return call(model, model.hold_terms, point).reshape(-1, TERMS)


def rest(model: CompiledDae, point: Point) -> None:
    """Put held motions that are zero but for rounding at zero, where they are states."""
    held = [model.holds[k] for k in holding(model, point)]
    states = [one for one in held if one.state is not None]
    if not states:
        return
    variables = np.abs(call(model, model.variables, point))
    for one in states:
        unit = model.flat_variables[one.motion].unit
        same = [k for k, variable in enumerate(model.flat_variables) if variable.unit == unit]
        if one.state is not None and variables[one.motion] <= ROUNDING * variables[same].max():
            point.x[one.state[0]] = 0.0


def holding(model: CompiledDae, point: Point) -> list[int]:
    """Positions of the motions that are held at a point."""
    if not model.holds:
        return []
    gains = terms(model, point)[:, 0]
    return [k for k, one in enumerate(model.holds) if point.d[one.mode] == one.number and gains[k] != 0.0]


# -- sharing --------------------------------------------------------------------------------------------------------


def share(model: CompiledDae, point: Point) -> None:
    """Let elements that hold the same motion share its reaction in proportion to their capacities.

    Which reactions have the least norm, weighted by the inverse of the capacities, is decided anew for the present
    modes; everything but the split follows from the other equations.
    """
    active = set(holding(model, point)) if model.circuits else set()
    for circuit in model.circuits:
        count = len(circuit.members)
        switches, shares = np.zeros(count), np.zeros((count, count))
        places = [place for place, k in enumerate(circuit.members) if k in active]
        if len(places) > 1:
            _share(model, point, circuit, places, switches, shares)
        point.d[circuit.first : circuit.first + count * (1 + count)] = np.concatenate([switches, shares.ravel()])


def _share(
    model: CompiledDae, point: Point, circuit: Circuit, places: list[int], switches: Vector, shares: Vector
) -> None:
    members = [circuit.members[place] for place in places]
    slopes = variable_slopes(model, point, [model.holds[k].motion for k in members])
    sizes = np.linalg.norm(slopes, axis=1)
    sizes[sizes == 0.0] = 1.0
    left, values, _ = np.linalg.svd(slopes / sizes[:, None])
    silent = (left[:, np.sum(values > _DEPENDENT) :] / sizes[:, None]).T
    weighted = silent / _capacities(model, point, members)
    for row, pivot in enumerate(_eliminate(silent, weighted)):
        switches[places[pivot]] = 1.0
        shares[places[pivot], places] = weighted[row] / np.abs(weighted[row]).max()


def _capacities(model: CompiledDae, point: Point, members: list[int]) -> Vector:
    """Capacities that decide the split: what nothing limits takes nearly all, what bears nothing nearly nothing."""
    given = terms(model, point)[members, 1:3].max(axis=1)
    limited = given[np.isfinite(given) & (given < UNLIMITED) & (given > 0.0)]
    largest = float(limited.max(initial=0.0)) or 1.0
    return np.clip(np.nan_to_num(given), _SMALL * largest, _LARGE * largest)


def _eliminate(silent: Any, weighted: Any) -> list[int]:
    """Bring dependences to the form of an identity in one column each, the largest one left; return these columns."""
    pivots: list[int] = []
    for row in range(len(silent)):
        pivot = int(np.argmax(np.abs(silent[row])))
        for other in range(len(silent)):
            if other != row:
                factor = silent[other, pivot] / silent[row, pivot]
                silent[other] -= factor * silent[row]
                weighted[other] -= factor * weighted[row]
        pivots.append(pivot)
    return pivots


def sharing(model: CompiledDae, point: Point) -> list[tuple[str, ...]]:
    """Components that share what they hold together at a point, circuit by circuit."""
    found: list[tuple[str, ...]] = []
    for circuit in model.circuits:
        count = len(circuit.members)
        shares = point.d[circuit.first + count : circuit.first + count * (1 + count)].reshape(count, count)
        for row in shares[np.any(shares != 0.0, axis=1)]:
            parts = (model.holds[k].component for k, part in zip(circuit.members, row, strict=True) if part)
            found.append(tuple(dict.fromkeys(parts)))
    return found


# -- impacts --------------------------------------------------------------------------------------------------------


class Strike:
    """Stops motions that modes have begun to hold, by an impulse that all other components pass on.

    In the new modes the held motions are asked once for der(motion) = -(1 + e)·motion/τ, once for der(motion) = 0. The
    difference of the accelerations times τ is the jump of the speeds; finite forces are the same in both. What bears
    a limited reaction passes no impulse on, and is knocked loose.

    Args:
        model: the compiled model.
        point: the point with the new modes; it becomes the point after the impact.
        entering: positions of the held motions whose modes have just begun.
    """

    def __init__(self, model: CompiledDae, point: Point, entering: Collection[int]) -> None:
        self.model = model
        self.point = point
        self.entering = set(entering)
        self.impacts: list[Impact] = []
        self.loose: list[int] = []
        self.knocked: list[int] = []
        self.hard = False

    def run(self) -> None:
        """Carry out the impact; `loose` then tells what was knocked loose or bounces, `impacts` what was lost."""
        model, point = self.model, self.point
        before = self._motions()
        moving = [k for k in sorted(self.entering) if before[k] != 0.0]
        if not moving:
            return
        table = terms(model, point)
        restitution = table[:, 3]
        while True:
            approaches = {k: -(1.0 + restitution[k]) * before[k] / _INSTANT for k in moving if k not in self.loose}
            jump, impulses, reactions = self._response(approaches)
            worst = self._unbearable(table, impulses, reactions)
            if worst is None:
                break
            self.loose.append(worst)
        self.knocked = list(self.loose)
        self.point.x = point.x + jump
        self._stop(before, restitution)
        solve_implicit(model, point)
        after = self._motions()
        for k, impulse in impulses.items():
            energy = 0.5 * (before[k] + after[k]) * impulse
            if k in approaches and energy != 0.0:
                self.impacts.append(Impact(float(point.t), model.holds[k].component, float(energy)))
        self.loose += [k for k in approaches if restitution[k] > 0.0 and after[k] != 0.0]

    def _motions(self) -> Vector:
        return call(self.model, self.model.variables, self.point)[[one.motion for one in self.model.holds]]

    def _response(self, approaches: dict[int, float]) -> tuple[Vector, dict[int, float], dict[int, float]]:
        """Jump of the states, impulses and finite reactions of all that holds, with `loose` let go."""
        model, trial = self.model, self.point.copy()
        for k in self.loose:
            trial.d[model.holds[k].mode] = model.holds[k].loose
        share(model, trial)
        held = [k for k in holding(model, trial) if k not in self.loose and model.holds[k].reaction >= 0]
        nodes = [model.holds[k].reaction for k in held]
        results: list[tuple[Vector, Vector]] = []
        for asked in ({}, approaches):
            for k in approaches:
                trial.d[model.holds[k].approach] = asked.get(k, 0.0)
            solve_implicit(model, trial)
            results.append((call(model, model.ode, trial), call(model, model.variables, trial)[nodes]))
        (rest, finite), (rates, asked_for) = results
        impulses = dict(zip(held, _INSTANT * (asked_for - finite), strict=True))
        return _INSTANT * (rates - rest), impulses, dict(zip(held, finite, strict=True))

    def _unbearable(self, table: Any, impulses: dict[int, float], reactions: dict[int, float]) -> int | None:
        """The motion whose reaction exceeds most what its element can bear for an instant; None if there is none."""
        instant = 10.0 * TIME_RESOLUTION * max(1.0, abs(self.point.t))
        scale = max((abs(one) for one in impulses.values()), default=0.0)
        worst, most = None, 0.0
        for k, impulse in impulses.items():
            own = self.model.holds[k]
            forward, backward = table[k, 1:3]
            capacity = forward if impulse > 0.0 else backward
            if capacity >= UNLIMITED or own.loose < 0 or (k in self.entering and max(forward, backward) < UNLIMITED):
                continue
            sign = 1.0 if impulse > 0.0 else -1.0
            excess = abs(impulse) - max(capacity - sign * reactions[k], 0.0) * instant - _SAYS_NOTHING * scale
            if excess > most:
                worst, most = k, excess
        return worst

    def _stop(self, before: Vector, restitution: Vector) -> None:
        """Put states that are held exactly to where the impact left them."""
        for k in sorted(self.entering - set(self.loose)):
            one: CompiledHold = self.model.holds[k]
            if one.state is not None:
                self.point.x[one.state[0]] = -restitution[k] * before[k] / one.state[1]
