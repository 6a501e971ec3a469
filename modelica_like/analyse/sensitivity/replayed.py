"""Numbers read off a replay with their derivatives: values, peaks, integrals, times of mode changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from modelica_like.analyse.replay.chain import Reading, Replay
from modelica_like.analyse.replay.jumps import Jump
from modelica_like.analyse.replay.step import shortened
from modelica_like.analyse.sensitivity.extremes import STILL, extreme
from modelica_like.analyse.sensitivity.values import along, slopes_of, value_at
from modelica_like.errors import NoGradient, UnknownName, ValueOutOfRange
from modelica_like.runs.readings import CONDITIONS, INTEGRATED, Output, met
from modelica_like.runs.solution import Solution
from modelica_like.solve.initialize import Point


def read_off(solution: Solution, replay: Replay, outputs: Sequence[Output]) -> list[Reading]:
    """Return the readings of outputs other than series and formulas, one each.

    Raises:
        UnknownName: a mode change does not happen.
        NoGradient: it has no derivative.
    """
    _check_impacts(solution, outputs)
    span, integrals = replay.nodes[-1].t - replay.nodes[0].t, 0
    readings: list[Reading] = []
    for output in outputs:
        if output.kind in INTEGRATED:
            readings.append(_integrated(replay, output, integrals, span))
            integrals += 1
        elif output.kind == "time":
            readings.append(_event_time(solution, replay, output))
        elif output.kind in CONDITIONS:
            readings.append(_first(replay, output))
        elif output.kind in ("max", "min", "peak"):
            signs = {"max": (1.0,), "min": (-1.0,), "peak": (1.0, -1.0)}[output.kind]
            largest = max(
                (_scaled(extreme(replay, output.path, sign), sign) for sign in signs), key=lambda peak: peak.value
            )
            readings.append(_scaled(largest, -1.0 if output.kind == "min" else 1.0))
        else:
            readings.append(value_at(replay, output.path, _node_of(replay, output)))
    return readings


def _scaled(reading: Reading, by: float) -> Reading:
    return Reading(
        by * reading.value, tuple((node, by * part) for node, part in reading.parts), by * reading.quadratures
    )


def _integrated(replay: Replay, output: Output, number: int, span: float) -> Reading:
    """Read an integral, a mean or a root mean square."""
    integral = Reading(float(replay.quadratures[number]), quadratures=np.eye(replay.functions.nq)[number])
    if output.kind not in ("mean", "rms"):
        return integral
    mean = _scaled(integral, 1.0 / span)
    if output.kind == "mean":
        return mean
    root = mean.value**0.5
    return Reading(root, quadratures=mean.quadratures / (2.0 * root) if root else mean.quadratures)


def _first(replay: Replay, output: Output) -> Reading:
    """Read when a condition is true for the first time: in a step, or at a jump."""
    value: Callable[[Point], float] = lambda point: float(along(replay, output.path, [point])[0])  # noqa: E731
    if met(output.kind, value(replay.nodes[0])):
        return Reading(replay.nodes[0].t)
    for k, move in enumerate(replay.moves):
        if isinstance(move, Jump):
            if met(output.kind, value(replay.nodes[k + 1])):
                return _at_jump(move)
            continue
        points = [move.before, *move.inside(), move.after]
        values = [(point.t - move.before.t, value(point)) for point in points]
        for low, high in pairwise(values):
            if met(output.kind, high[1]) and not met(output.kind, low[1]):
                step = shortened(move, value, low, high, STILL)
                # Without a length it is where the step begins, as where another condition has split it.
                node = replay.at(move.before.t + low[0]) if step is None else replay.split(k, step)
                part = slopes_of(replay.model, output.path, node)
                return Reading(node.t, ((node, -part.by[0] / float(part.rate[0])),))
    raise UnknownName(f"'{output.name}' does not happen in this run.")


def _at_jump(jump: Jump) -> Reading:
    trigger = jump.time()
    return Reading(jump.before.t + trigger.shift, ((jump.before, trigger.by),))


def _check_impacts(solution: Solution, outputs: Sequence[Output]) -> None:
    """Refuse energies with a part from an impact, which an integral does not contain."""
    for output in outputs:
        owner = output.path.rpartition(".")[0]
        impacts = [impact for impact in solution.impacts if owner in ("", impact.component)] if output.struck else []
        if impacts:
            raise NoGradient(
                f"No gradient of {output.name}: {impacts[0].component} loses {impacts[0].energy:.6g} J in an impact at "
                f"t = {impacts[0].time:.9g} s.",
                why="Only losses over time are differentiated, not the energy of an impact.",
                advice=f"Ask for integral({output.path}), which leaves impacts out, or for speeds after the impact.",
            )


def _event_time(solution: Solution, replay: Replay, output: Output) -> Reading:
    jumps = [jump for _, jump in replay.jumps for event in jump.events if output.is_change(event)]
    # The run counts changes at its start, too, of which some belong to the start itself.
    begin = replay.nodes[0].t
    at_start = sum(output.is_change(event) and event.time <= begin for event in solution.events)
    number = output.number - at_start + sum(jump.before.t <= begin for jump in jumps)
    if not 1 <= number <= len(jumps):
        changes = [f"{e.before} → {e.after} at {e.time:.6g} s" for e in solution.events if e.mode == output.path]
        listed = f"{', '.join(changes[:6])}{', …' if len(changes) > 6 else ''}"
        raise UnknownName(
            f"'{output.name}' does not happen after the start of the run.",
            why=f"{output.path} changes: {listed}." if changes else f"{output.path} does not change in this run.",
        )
    return _at_jump(jumps[number - 1])


def _node_of(replay: Replay, output: Output) -> Point:
    first, last = replay.nodes[0].t, replay.nodes[-1].t
    if output.kind == "end":
        return replay.nodes[-1]
    if not first <= output.moment <= last:
        raise ValueOutOfRange(f"{output.name}: the run goes from {first:g} s to {last:g} s.")
    return replay.at(output.moment)
