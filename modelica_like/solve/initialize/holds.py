"""Motions that the present modes hold: detection, sharing among elements, and impacts."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Circuit, CompiledDae, Vector
from modelica_like.compile.functions import ROUNDING
from modelica_like.compile.soon import time_resolution
from modelica_like.flatten.holds import TERMS
from modelica_like.language.holding import UNLIMITED
from modelica_like.solve.initialize.ideal import replace_dependent
from modelica_like.solve.initialize.point import Point, call, largest, solve_implicit
from modelica_like.solve.initialize.slopes import variable_slopes

_DEPENDENT = 1e-9
INSTANT = 1e-9
"""Duration of an impact in s, of the approach; finite forces cancel for any value."""
_STIFF = 1e5
"""Reaction per motion that contradicts its being held, over the held inertia."""
_LARGE, _SMALL = 1e3, 1e-3
_BEARABLE = 0.99
"""Part of its capacity that an element may bear in a split: slightly less than 1, against rounding."""
_SPLITS, _TURNED = 20, 100.0
"""Number of trials to find a split that all can bear, and total change of the weights."""
_SAYS_NOTHING = 1e-12
_TRIALS = 50
_FELT = 1e-9
"""Smallest change of a motion that is not rounding, relative to the largest one in an impact."""


@dataclass(frozen=True)
class Impact:
    """Energy that an impact has dissipated.

    Attributes:
        time: in s.
        component: path of the component that stopped a motion.
        energy: in J.
        trials: points whose powers differ by what sources give in the impact, over its duration `INSTANT`; of one of
            the impacts that are solved together.
    """

    time: float
    component: str
    energy: float
    trials: tuple[Point, Point] | None = field(default=None, repr=False, compare=False)


def terms(model: CompiledDae, point: Point) -> Any:
    """Gain, capacities and restitution of every held motion; shape (holds, TERMS)."""
    return call(model, model.hold_terms, point).reshape(len(model.holds), TERMS)


def capacities(model: CompiledDae, point: Point) -> Any:
    """Return the forward and backward capacity of every held motion; shape (holds, 2)."""
    return terms(model, point)[:, 1:3]


def rest(model: CompiledDae, point: Point) -> None:
    """Set held motions within rounding of zero to zero, if they are states."""
    held = [model.holds[k] for k in holding(model, point)]
    states = [(one.state[0], one.motion) for one in held if one.state is not None]
    if not states:
        return
    variables = np.abs(call(model, model.variables, point))
    for state, motion in states:
        if variables[motion] <= ROUNDING * largest(model, variables, motion):
            point.x[state] = 0.0


def holding(model: CompiledDae, point: Point) -> list[int]:
    """Positions of the held motions at a point."""
    asked = [k for k, one in enumerate(model.holds) if point.d[one.mode] == one.number]
    if not asked:
        return []
    gains = terms(model, point)[:, 0]
    return [k for k in asked if gains[k] != 0.0]


# -- sharing --------------------------------------------------------------------------------------------------------


def share(model: CompiledDae, point: Point) -> None:
    """Let elements that hold the same motion share its reaction in proportion to their capacities.

    The reactions have the least norm, weighted by the inverse of the capacities, for the present modes; everything
    but the split follows from the other equations. If one element exceeds its capacity, the others take more, as far as
    they can.
    """
    replace_dependent(model, point)
    if not model.circuits:
        return
    active = set(holding(model, point))
    if not any(len(active.intersection(circuit.members)) > 1 for circuit in model.circuits):
        _share_circuits(model, point, active, np.zeros(0))
        return
    limits = capacities(model, point)
    weights = base = 1.0 / _capacities(limits)
    best, least = point.d, np.inf
    for _ in range(_SPLITS):
        shared = _share_circuits(model, point, active, weights)
        use = _use(model, point, limits) if shared else 0.0
        worst = float(np.max(use, initial=0.0))
        if worst < least:
            best, least = point.d.copy(), worst
        if worst <= _BEARABLE or not np.isfinite(worst):
            break
        weights = np.where(use > 0.0, np.clip(weights * use, base / _TURNED, base * _TURNED), base)
    point.d = best


def _share_circuits(model: CompiledDae, point: Point, active: set[int], weights: Vector) -> bool:
    """Write switches and shares of all circuits; return whether anything is shared."""
    shared = False
    for circuit in model.circuits:
        count = len(circuit.members)
        switches, shares = np.zeros(count), np.zeros((count, count))
        places = [place for place, k in enumerate(circuit.members) if k in active]
        if len(places) > 1:
            _share(model, point, circuit, places, weights, switches, shares)
        point.d[circuit.entries] = np.concatenate([switches, shares.ravel()])
        shared |= bool(switches.any())
    return shared


def _share(
    model: CompiledDae, point: Point, circuit: Circuit, places: list[int], weights: Vector, switches: Vector,
    shares: Vector,
) -> None:  # fmt: skip
    members = [circuit.members[place] for place in places]
    slopes = variable_slopes(model, point, [model.holds[k].motion for k in members])
    sizes = np.linalg.norm(slopes, axis=1)
    sizes += sizes == 0.0
    left, values, _ = np.linalg.svd(slopes / sizes[:, None])
    silent = (left[:, np.sum(values > _DEPENDENT) :] / sizes[:, None]).T
    weighted = silent * weights[members]
    pivots = _eliminate(silent, weighted)
    for row, pivot in enumerate(pivots):
        switches[places[pivot]] = 1.0
        shares[places[pivot], places] = weighted[row] / np.copysign(np.abs(weighted[row]).max(), weighted[row, pivot])
    if _may_contradict(model, members):
        _yield_to_contradiction(model, point, circuit, switches, shares)


def _use(model: CompiledDae, point: Point, limits: Any) -> Vector:
    """Reactions of sharing elements over their capacities in that direction; zero for unlimited ones."""
    trial = point.copy()
    solve_implicit(model, trial)
    variables, use = call(model, model.variables, trial), np.zeros(len(model.holds))
    for circuit in model.circuits:
        shares = circuit.shares(point.d)
        for place, k in enumerate(circuit.members):
            reaction = variables[model.holds[k].reaction]
            limit = limits[k, 0 if reaction > 0.0 else 1]
            if shares[:, place].any() and 0.0 < limit < UNLIMITED:
                use[k] = abs(reaction) / limit
    return use


def _may_contradict(model: CompiledDae, members: list[int]) -> bool:
    """Whether a held motion depends on more than states, such as a source of motion."""
    at = [model.variables.name_in().index(name) for name in ("t", "u", "d")]
    rows = model.once("moved", lambda: {row for k in at for row in model.variables.jac_sparsity(0, k).row()})
    return not rows.isdisjoint(model.holds[k].motion for k in members)


def _yield_to_contradiction(
    model: CompiledDae, point: Point, circuit: Circuit, switches: Vector, shares: Vector
) -> None:
    """Let a prescribed motion that cannot be held raise the reactions until one breaks away.

    A switched equation says sum(share·reaction) = stiff·inertia·der(motion). If all hold, the right side is zero.
    """
    trial = point.copy()
    trial.d[circuit.entries] = np.concatenate([switches, shares.ravel()])
    others = [k for place, k in enumerate(circuit.members) if shares[:, place].any() and not switches[place]]
    nodes = [model.holds[k].reaction for k in others]
    reactions: list[Vector] = []
    for asked in (0.0, 1.0):
        trial.d[[model.holds[k].approach for k in others]] = asked
        solve_implicit(model, trial)
        reactions.append(call(model, model.variables, trial)[nodes])
    inertia = float(np.abs(reactions[1] - reactions[0]).max(initial=0.0))
    stiff = _STIFF * inertia if np.isfinite(inertia) else 0.0
    # The larger of the two sides has coefficients of about one.
    shares /= max(stiff, 1.0)
    switches[switches == 1.0] += min(stiff, 1.0)


def _capacities(limits: Any) -> Vector:
    """Capacities for the split: an unlimited element takes nearly all, one without capacity nearly nothing."""
    given = np.fmax(limits.max(axis=1), 0.0)
    limited = float(given[given < UNLIMITED].max(initial=0.0)) or 1.0
    return np.clip(given, _SMALL * limited, _LARGE * limited)


def _eliminate(silent: Any, weighted: Any) -> list[int]:
    """Reduce dependences to an identity in one column each, the largest one left; return these columns."""
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
    """Components that share a held motion at a point, circuit by circuit."""
    found: list[tuple[str, ...]] = []
    for circuit in model.circuits:
        shares = circuit.shares(point.d)
        for row in shares[np.any(shares != 0.0, axis=1)]:
            parts = (model.holds[k].component for k, part in zip(circuit.members, row, strict=True) if part)
            found.append(tuple(dict.fromkeys(parts)))
    return found


# -- impacts --------------------------------------------------------------------------------------------------------


class Strike:
    """Stops newly held motions by an impulse that all other components transmit.

    In the new modes the equations are solved with der(motion) = -(1 + e)·motion/τ and with der(motion) = 0. The
    difference of the accelerations times τ is the jump of the speeds; finite forces are the same in both. An element
    with a limited reaction transmits no impulse and breaks away.

    Several impacts at one instant are solved together, from the speeds before the first one: a contact can be hit
    again, and be released.

    Args:
        model: the compiled model.
        point: the point with the new modes and the speeds before; it becomes the point after the impact.
        entering: positions of the held motions whose modes have just begun.
        resting: whether nothing rebounds, whatever its restitution; nor does a motion that is rounding.
    """

    def __init__(self, model: CompiledDae, point: Point, entering: Collection[int], *, resting: bool = False) -> None:
        self.model = model
        self.point = point
        self.entering = set(entering)
        self.impacts: list[Impact] = []
        self.loose: list[int] = []
        before = self._motions()
        # Friction never stops a motion at once; if an importer lets it overrun standstill, that is not an impact.
        limits = capacities(model, point)
        moving = [k for k in self.entering if max(limits[k]) >= UNLIMITED]
        self.hard = self._stops(before, moving)
        self._rebound = 1.0 if self.hard and not resting else 0.0
        self.knocked: list[int] = []

    def run(self) -> None:
        """Carry out the impact.

        Then `loose` has the motions that break away, bounce, or were changed, and `impacts` the losses.
        """
        model, point = self.model, self.point
        before = self._motions()
        moving = [k for k in sorted(self.entering) if before[k] != 0.0]
        limits, restitution = capacities(model, point), self._rebound * terms(model, point)[:, -1]
        trials = 0
        while True:
            approaches = {k: -(1.0 + restitution[k]) * before[k] / INSTANT for k in moving if k not in self.loose}
            jump, impulses, reactions = self._response(approaches)
            unbearable = self._unbearable(limits, impulses, reactions) if self.hard else []
            again = [] if unbearable else self._approaching(limits, jump)
            trials += 1
            if trials == _TRIALS or not (unbearable or again):
                break
            self.loose = [k for k in (*self.loose, *unbearable) if k not in again]
        self.knocked = list(self.loose)
        point.x = point.x + jump
        self._stop(before, restitution)
        solve_implicit(model, point)
        if self.hard:
            self._book(before, impulses, approaches)

    def _stops(self, before: Vector, moving: list[int]) -> bool:
        """Whether the stopped motion exceeds rounding and the error of event location."""
        model, sizes = self.model, np.abs(call(self.model, self.model.variables, self.point))
        return any(abs(before[k]) > ROUNDING * largest(model, sizes, model.holds[k].motion) for k in moving)

    def _book(self, before: Vector, impulses: dict[int, float], approaches: dict[int, float]) -> None:
        """Record losses and changed motions."""
        after = self._motions()
        for k, impulse in impulses.items():
            energy = 0.5 * (before[k] + after[k]) * impulse
            if k in approaches and energy != 0.0:
                trials = None if self.impacts else self.trials
                self.impacts.append(Impact(float(self.point.t), self.model.holds[k].component, float(energy), trials))
        change = np.abs(after - before)
        held = {k for k in holding(self.model, self.point) if after[k] == 0.0}
        bouncing = [k for k in approaches if after[k] != 0.0]
        passing = [int(k) for k in np.flatnonzero(change > _FELT * change.max()) if k not in held]
        self.loose = list(dict.fromkeys([*self.loose, *bouncing, *passing]))

    def _motions(self) -> Vector:
        return call(self.model, self.model.variables, self.point)[[one.motion for one in self.model.holds]]

    def _response(self, approaches: dict[int, float]) -> tuple[Vector, dict[int, float], dict[int, float]]:
        """Jump of the states, impulses and finite reactions of all held motions, with `loose` released."""
        model, trial = self.model, self.point.copy()
        for k in self.loose:
            trial.d[model.holds[k].mode] = model.holds[k].loose
        share(model, trial)
        held = [k for k in holding(model, trial) if k not in self.loose and model.holds[k].reaction >= 0]
        nodes = [model.holds[k].reaction for k in held]
        results: list[tuple[Point, Vector, Vector]] = []
        for asked in ({}, approaches):
            for k in approaches:
                trial.d[model.holds[k].approach] = asked.get(k, 0.0)
            solve_implicit(model, trial)
            rates, variables = (call(model, function, trial) for function in (model.ode, model.variables))
            results.append((trial.copy(), rates, variables[nodes]))
        (without, rest, finite), (struck, rates, asked_for) = results
        self.trials = without, struck
        impulses = dict(zip(held, INSTANT * (asked_for - finite), strict=True))
        return INSTANT * (rates - rest), impulses, dict(zip(held, finite, strict=True))

    def _unbearable(self, limits: Any, impulses: dict[int, float], reactions: dict[int, float]) -> list[int]:
        """The motions whose reactions exceed the impulsive capacity of their elements."""
        instant = 10.0 * time_resolution(self.point.t)
        found: list[int] = []
        for k, impulse in impulses.items():
            own = self.model.holds[k]
            forward, backward = limits[k]
            capacity, sign = (forward, 1.0) if impulse > 0.0 else (backward, -1.0)
            if own.loose < 0:
                continue
            margin = max(capacity - sign * reactions[k], 0.0) * instant
            if abs(impulse) > margin + _SAYS_NOTHING * max(map(abs, impulses.values())):
                found.append(k)
        return found

    def _approaching(self, limits: Any, jump: Vector) -> list[int]:
        """Released motions that would now move against an unlimited stop."""
        if not self.loose:
            return []
        after = replace(self.point, x=self.point.x + jump)
        motions = call(self.model, self.model.variables, after)
        found: list[int] = []
        for k in self.loose:
            motion, (forward, backward) = motions[self.model.holds[k].motion], limits[k]
            nominal = self.model.flat_variables[self.model.holds[k].motion].nominal
            against = forward if motion > 0.0 else backward
            if against >= UNLIMITED and abs(motion) > ROUNDING * nominal and k in self.entering:
                found.append(k)
        return found

    def _stop(self, before: Vector, restitution: Vector) -> None:
        """Set held states exactly to their values after the impact."""
        for k in sorted(self.entering - set(self.loose)):
            one = self.model.holds[k]
            if one.state is not None:
                self.point.x[one.state[0]] = -restitution[k] * before[k] / one.state[1]
