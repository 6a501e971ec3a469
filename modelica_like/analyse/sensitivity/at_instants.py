"""Events exactly at the start, at the end, or when something is read: on one side they are not part of what is read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.analyse.replay.chain import Reading, Replay
from modelica_like.analyse.replay.edges import Edge
from modelica_like.analyse.replay.jumps import Jump
from modelica_like.analyse.sensitivity.moving_kinks import kinks_at
from modelica_like.analyse.sensitivity.values import slopes_of
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledTransition
from modelica_like.compile.soon import time_resolution
from modelica_like.errors import ModelicaLikeError, NoGradient
from modelica_like.native.holds import share
from modelica_like.runs.readings import Output
from modelica_like.simulation import quick_run
from modelica_like.solve.initialize import Point, call, solve_implicit
from modelica_like.solve.initialize.slopes import Slopes, slopes

_NEAR = 1e-9
"""Time between an event and an instant, relative to the run, up to which it may be rounding of parameters."""
_ROUNDING = 1e-9


def at_instants(chain: Replay, readings: Sequence[Reading], outputs: Sequence[Output]) -> list[Edge]:
    """Find the events whose time is that of the start, of the end, or of a reading.

    Args:
        chain: the run.
        readings: what is asked for.
        outputs: their names.
    """
    return [*_at_start(chain, readings), *_read_there(chain, readings, outputs)]


@dataclass(frozen=True)
class _Change:
    """What an event changes at an instant.

    Attributes:
        states: by how much the states jump, shape (nx,).
        rates: by how much their derivatives do, shape (nx,).
        integrands: by how much the integrands do, shape (nq,).
        sizes: of states, of rates and of integrands, beside which there is rounding.
    """

    states: Vector
    rates: Vector
    integrands: Vector
    sizes: tuple[Vector, Vector, Vector]

    @classmethod
    def between(cls, chain: Replay, before: Point, after: Point) -> _Change:
        """Compare the points before and after."""
        rates = [slopes(chain.model, point, "ode").value for point in (before, after)]
        integrands = [chain.functions.integrands(point).copy() for point in (before, after)]
        x = np.abs(before.x) + chain.model.equations.nominals
        sizes = x, np.sum(np.abs(rates), axis=0), np.sum(np.abs(integrands), axis=0)
        return cls(after.x - before.x, rates[1] - rates[0], integrands[1] - integrands[0], sizes)

    def felt(self, row: Vector, quadratures: Vector) -> bool:
        """Whether what has these derivatives by the states and the quadratures changes with it."""
        by = row[: len(self.states)]
        rows = by, by, quadratures if quadratures.size else np.zeros(len(self.integrands))
        changes = zip(rows, (self.states, self.rates, self.integrands), self.sizes, strict=True)
        return any(bool(abs(by @ change) > _ROUNDING * (np.abs(by) @ size)) for by, change, size in changes)


def _at_start(chain: Replay, readings: Sequence[Reading]) -> Iterator[Edge]:
    """Timed events that would come a moment after the start; the start has passed over them."""
    start = chain.nodes[0]
    for transition, part in [*chain.ticks, *_passed_over(chain)]:
        ticks = transition.target in transition.sources

        def matters(passed: CompiledTransition = transition, part: Slopes = part, ticks: bool = ticks) -> bool:
            sides = [part.point.d] if ticks else _modes_before(chain, passed, part)
            return _begins_otherwise(chain, readings, sides)

        # A clock has counted its tick at the start, so its time there is that before.
        by = part.by[0] * (np.arange(part.by.shape[1]) < part.by.shape[1] - len(start.d)) if ticks else part.by[0]
        mode = chain.model.flat_discretes[transition.mode]
        what = "ticks" if ticks else f"becomes {mode.names[transition.target]}"
        error = _error(start.t, f"{mode.path} {what}", "at the start of the run", transition.source)
        yield Edge(Reading(float(part.value[0]) - start.t, ((start, by),)), 0.0, error, matters)


def _begins_otherwise(chain: Replay, readings: Sequence[Reading], sides: Iterable[Vector]) -> bool:
    """Whether readings feel that a run begins with other discrete variables, shape (nd,), for a moment."""
    model, start, multipliers = chain.model, chain.nodes[0], {0: np.zeros(0)}
    chain.adjoint(readings, multipliers)
    for modes in sides:
        before = start.copy()
        before.d[:] = modes
        share(model, before)
        solve_implicit(model, before)
        change = _Change.between(chain, before, start)
        if any(change.felt(multipliers[0][:, k], reading.quadratures) for k, reading in enumerate(readings)):
            return True
    return False


def _modes_before(chain: Replay, passed: CompiledTransition, moment: Slopes) -> Iterator[Vector]:
    """Yield discrete variables that there are at the start if an event comes a moment later.

    A parameter that moves it tells what follows from it, as switches that a signal opens. Where there is no such start,
    nothing is known to follow.
    """
    model, start = chain.model, chain.nodes[0]
    for source in passed.sources:
        modes = start.d.copy()
        modes[passed.mode] = source
        yield modes
    by, small = moment.by[0][len(start.x) : len(start.x) + len(model.p)], time_resolution(start.t)
    if not np.any(by):
        return
    k = int(np.argmax(np.abs(by)))
    with suppress(ModelicaLikeError):
        later = model.with_parameters({model.flat_parameters[k].path: float(model.p[k] + 4 * small / by[k])})
        yield quick_run(later, start.t + 2 * small, t0=start.t).segments[-1].d


def _passed_over(chain: Replay) -> Iterator[tuple[CompiledTransition, Slopes]]:
    """Timed transitions at the start that lead to its modes, also by others there, and their moments."""
    model, start = chain.model, chain.nodes[0]
    moments = call(model, model.events.moments, start)
    timed = [transition for transition in model.events.transitions if transition.timed]
    there = [transition for transition in timed if _same(chain, float(moments[transition.index]), start.t)]
    reached = {(transition.mode, start.d[transition.mode]) for transition in there}
    while ready := [transition for transition in there if (transition.mode, transition.target) in reached]:
        there = [transition for transition in there if transition not in ready]
        reached |= {(transition.mode, source) for transition in ready for source in transition.sources}
        yield from ((transition, slopes(model, start, "moments", [transition.index])) for transition in ready)


def _read_there(chain: Replay, readings: Sequence[Reading], outputs: Sequence[Output]) -> Iterator[Edge]:
    end = chain.nodes[-1].t
    for reading, output in zip(readings, outputs, strict=True):
        instants = [node.t for node, _ in reading.parts] if output.kind in ("end", "at") else []
        instants += [end] * bool(reading.quadratures.size)
        for instant in instants:
            for jump in (jump for _, jump in chain.jumps if jump.trigger and _same(chain, jump.before.t, instant)):
                yield _edge(chain, jump, instant, reading, output)
        if output.kind in ("end", "at"):
            node = reading.parts[0][0]
            for late, by in kinks_at(chain.model, output.path, node):
                yield Edge(Reading(late, ((node, by),)), _ROUNDING * _NEAR, _bent(node.t, output.name))


def _edge(chain: Replay, jump: Jump, instant: float, reading: Reading, output: Output) -> Edge:
    trigger, event = jump.time(), jump.events[0]

    def matters() -> bool:
        points = [_moved(chain, point, trigger.shift) for point in (jump.before, jump.after)]
        row = reading.parts[0][1] if reading.parts else np.zeros(len(points[0].x))
        if _Change.between(chain, points[0], points[1]).felt(row, reading.quadratures):
            return True
        if not reading.parts:
            return False
        return _differ(chain, *(slopes_of(chain.model, output.path, point) for point in points))

    where = "at the end of the run" if instant == chain.nodes[-1].t else f"when {output.name} is read"
    late = jump.before.t + trigger.shift - instant
    error = _error(instant, f"{event.mode} becomes {event.after}", where, event.source)
    return Edge(Reading(late, ((jump.before, trigger.by),)), _ROUNDING * _NEAR, error, matters)


def _differ(chain: Replay, before: Slopes, after: Slopes) -> bool:
    """Whether a value or its rate jumps: with a kink in time it has on both sides another part of what moves that."""
    values, rates = ([float(getattr(side, name)[0]) for side in (before, after)] for name in ("value", "rate"))
    # A motion that is held has rates of rounding, which would not change the value in the whole run.
    size, span = sum(map(abs, values)), chain.nodes[-1].t - chain.nodes[0].t
    jumps = abs(values[1] - values[0]), abs(rates[1] - rates[0])
    return jumps[0] > _ROUNDING * size or jumps[1] > _ROUNDING * (sum(map(abs, rates)) + size / span)


def _moved(chain: Replay, point: Point, by: float) -> Point:
    """A point beside an event, at the event's own time."""
    moved = point.copy()
    moved.x = point.x + by * slopes(chain.model, point, "ode").value
    solve_implicit(chain.model, moved)
    return moved


def _same(chain: Replay, time: float, instant: float) -> bool:
    return abs(time - instant) <= _NEAR * max(chain.nodes[-1].t - chain.nodes[0].t, abs(instant))


def _bent(time: float, name: str) -> NoGradient:
    return NoGradient(
        f"No gradient at t = {time:.9g} s: {name} is read exactly at a kink or jump of its value.",
        why="A small change of a parameter moves that to either side, so the derivatives on both sides differ.",
        advice="Read it at another time.",
    )


def _error(time: float, what: str, instant: str, source: Any) -> NoGradient:
    return NoGradient(
        f"No gradient at t = {time:.9g} s: {what} exactly {instant}.",
        where=source,
        why="A small change of a parameter moves it to either side, so the derivatives on both sides differ.",
        advice="Move the parameters away from this limit.",
    )
