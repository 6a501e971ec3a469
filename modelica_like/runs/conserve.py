"""Runs whose stored energies do not follow their powers: an integrator has stepped over something."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

import casadi as ca
import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import EnergyDrift, SingularAtStart
from modelica_like.options import Options
from modelica_like.runs.powers import Powers, drifts_of_results, energy_terms, results
from modelica_like.runs.solution import Solution
from modelica_like.solve.dense import Dense
from modelica_like.solve.initialize import Point
from modelica_like.solve.initialize.slopes import slopes
from modelica_like.solve.recorder import Segment

_SUSPICIOUS = 10.0
"""Drift of a stored energy over a run, in relative tolerances of the energy that moves, that is looked at."""
_WRONG = 100.0
"""Drift between two results that no steps within their tolerances explain, in tolerances of the states: each step may
err by one of them, IDAS makes about ten between two results, and errors are estimates, ten times as large at worst."""
_STEPS = 10
"""Steps between two results up to which that holds; above, more may add up."""
_PIECES = 4
"""Smooth pieces of a run at which the tolerances are looked at."""
_SIGNS = 8
"""Combinations of signs along which changes of energies are looked at: their mean errs by a third."""
_SHORTER, _ATTEMPTS = 8.0, 3
"""Factor of step limits of repetitions, and the number of these: then steps are 512 times as short as what they had
stepped over."""


@dataclass(frozen=True)
class Astray:
    """Where a stored energy does not follow its rate.

    Attributes:
        component: path; empty for the model itself.
        energy: change of its stored energy minus the integral of its rate, in J.
        begin: of the time in s.
        end: of the time in s.
    """

    component: str
    energy: float
    begin: float
    end: float

    @property
    def told(self) -> str:
        """A sentence about it."""
        return (
            f"Between {self.begin:.9g} s and {self.end:.9g} s the stored energy of {self.component or 'the model'} "
            f"changes by {abs(self.energy):.4g} J {'more' if self.energy > 0 else 'less'} than its power explains"
        )


def conserving(run: Solution, repeat: Callable[[Options], Solution]) -> Solution:
    """Return a run whose stored energies follow their powers, repeated with shorter steps where they do not.

    Args:
        run: a finished run.
        repeat: runs the same again with other options.

    Raises:
        EnergyDrift: they do not follow with the shortest steps either.
    """
    first = find_astray(run) if run.options.on_energy_drift != "off" else None
    if first is None:
        return run
    astray = first
    if run.options.on_energy_drift == "note":
        return replace(run, notices=(*run.notices, f"{astray.told}."))
    step = min(run.options.max_step, astray.end - astray.begin)
    for _ in range(_ATTEMPTS):
        step /= _SHORTER
        run = repeat(replace(run.options, max_step=step))
        left = find_astray(run)
        if left is None:
            notice = f"{first.told}: the run was repeated with steps of at most {step:.3g} s."
            return replace(run, notices=(*run.notices, notice))
        astray = left
    error = EnergyDrift(
        f"{astray.told}, also with steps of at most {step:.3g} s.",
        why="The integrator steps over something, or the energy that the component declares jumps.",
        advice='Look there: simulate(…, options=Options(on_energy_drift="note")) returns the run as it is.',
    )
    error.run = run
    raise error


@np.errstate(over="ignore", invalid="ignore")  # what is not finite has its notice in the balance
def find_astray(run: Solution) -> Astray | None:
    """Find the results between which the integration of a run is wrong.

    First, results are looked at as they are, which costs little; where that is too coarse to judge, they are integrated
    again.
    """
    model, segments, options = run.model, run.segments, run.options
    if not model.states or not model.components:
        return None
    drifts, moved = drifts_of_results(model, segments)
    suspects = np.flatnonzero(np.abs(drifts) > _SUSPICIOUS * options.rtol * moved)
    # Where the tolerances allow it anyway, finer results could only be limited by them, too.
    if suspects.size:
        suspects = suspects[np.abs(drifts[suspects]) > _allowed(run, segments)[suspects]]
    if not suspects.size:
        return None
    drifts, powers = _drifts(model, segments, options, _dense(run))
    suspects = np.flatnonzero(np.abs(drifts) > _SUSPICIOUS * options.rtol * powers.moved)
    places = _Places(run)
    wrong = (places.wrong(k) for k in sorted(suspects.tolist(), key=lambda k: -abs(drifts[k])))
    return next((name for name in wrong if name is not None), None)


def _dense(run: Solution) -> Dense | None:
    return None if run.dense is None else run.dense()


@np.errstate(over="ignore", invalid="ignore")
def _drifts(
    model: CompiledDae, segments: Sequence[Segment], options: Options, dense: Dense | None
) -> tuple[Vector, Powers]:
    """Changes of stored energies minus integrals of their rates, in J, where these are known; shape (components,)."""
    powers = Powers(model, options, sum(len(segment.times) for segment in segments), dense)
    total = np.zeros(len(model.components))
    for some in results(model, segments):
        places = np.arange(len(some.times))
        total += some.terms[0][:, places == some.last].sum(axis=1) - some.terms[0][:, places == some.first].sum(axis=1)
        total -= powers.integrals(some)[-1]
    return np.where(np.abs(total) > powers.unknown, total, 0.0), powers


class _Places:
    """Looks for the results between which energies do not follow; what one component asks is kept for the others."""

    def __init__(self, run: Solution) -> None:
        self.run = run
        self._parts = dict[tuple[int, int], tuple[Vector, Powers]]()
        self._limits = dict[int, Vector]()

    def wrong(self, component: int) -> Astray | None:
        """Find two neighbouring results with the largest drift, by halves; None if the tolerances explain it."""
        low, high = 0, sum(len(segment.times) - 1 for segment in self.run.segments)
        while high - low > 1:
            middle = (low + high) // 2
            halves = (low, middle), (middle, high)
            low, high = max(halves, key=lambda half: abs(self._part(*half)[0][component]))
        drifts, powers = self._part(low, high)
        (piece,) = _between(self.run.segments, low, high)
        if low not in self._limits:
            self._limits[low] = _allowed(self.run, [piece]) + powers.precision
        drift = float(drifts[component])
        if abs(drift) <= self._limits[low][component]:
            return None
        return Astray(self.run.model.components[component], drift, float(piece.times[0]), float(piece.times[-1]))

    def _part(self, low: int, high: int) -> tuple[Vector, Powers]:
        if (low, high) not in self._parts:
            run = self.run
            between = [*_between(run.segments, low, high)]
            self._parts[low, high] = _drifts(run.model, between, run.options, _dense(run))
        return self._parts[low, high]


def _between(segments: Sequence[Segment], low: int, high: int) -> Iterator[Segment]:
    """Yield the part of a run from interval `low` to `high`, which is not included."""
    counts = [len(s.times) - 1 for s in segments]
    for segment, first, count in zip(segments, accumulate(counts, initial=0), counts, strict=False):
        begin, end = max(low - first, 0), min(high - first, count)
        if begin < end:
            part = slice(begin, end + 1)
            yield Segment(segment.times[part], segment.x[:, part], segment.z[:, part], segment.d)


def _allowed(run: Solution, segments: Sequence[Segment]) -> Vector:
    """Drifts between two results in J that steps within their tolerances explain, the largest at some of the results.

    Returns:
        Of every component, shape (components,).
    """
    intervals = max(sum(len(segment.times) - 1 for segment in run.segments), 1)
    some = segments[:: -(-len(segments) // _PIECES)]
    points = [(segment, k) for segment in some for k in {0, len(segment.times) // 2, len(segment.times) - 1}]
    worst = np.max([_tolerated(run, *point) for point in points], axis=0)
    return _WRONG * worst * max(1.0, run.statistics.steps / intervals / _STEPS)


def _tolerated(run: Solution, piece: Segment, k: int) -> Vector:
    """Changes of stored energies and of the integrals of their rates to the next result, if states err by tolerances.

    The second one is larger where the equations are stiff; infinite where slopes are not finite, so nothing is known.

    Returns:
        In J, of every component, shape (components,).
    """
    model, point, options = run.model, piece.point(k), run.options
    weights = options.rtol * np.abs(point.x) + options.atol * model.equations.nominals
    try:
        changes = _changes(model, point, weights)
    except SingularAtStart:
        return np.full(len(model.components), math.inf)
    stored, rate = changes.reshape(2, -1)
    # IDAS and RODAS5P judge the mean square of the errors of all states.
    width = float(piece.times[-1] - piece.times[0]) / max(len(piece.times) - 1, 1)
    return (stored + rate * width) * math.sqrt(len(weights))


def _changes(model: CompiledDae, point: Point, weights: Vector) -> Vector:
    """Mean changes of energies and their rates where states change by weights, each with its own sign.

    Where nothing is implicit, they are found along some combinations of signs: all slopes of a long chain would be
    many, because its last speed is the first one and all relative ones.
    """
    if model.implicit:
        return np.linalg.norm(
            slopes(model, point, Cached.ENERGIES, function=lambda: energy_terms(model, stored=True)).x * weights, axis=1
        )

    def make() -> ca.Function:
        energies, some = energy_terms(model, stored=True), ca.SX.sym("changes", len(weights), _SIGNS)
        arguments = list(model.arguments.values())
        changes = ca.jtimes(energies(*arguments), model.arguments["x"], some)
        return ca.Function("changes", [*arguments, some], [ca.densify(ca.sqrt(ca.sum2(changes**2) / _SIGNS))])

    signs = model.once(Cached.SIGNS, lambda: np.random.default_rng(0).choice([-1.0, 1.0], (len(weights), _SIGNS)))
    along = (weights[:, None] * signs).ravel("F")
    function = model.fast(Cached.ENERGY_CHANGES, make)
    (changes,) = function(point.t, point.x, point.z, model.p, model.u, point.d, along)
    return np.where(np.isfinite(changes), changes, math.inf)
