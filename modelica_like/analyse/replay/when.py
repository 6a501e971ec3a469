"""When events of a replay happen: what decides it, and what happens at the same instant for another reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modelica_like.analyse.replay.guards import Guards
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae, CompiledTransition
from modelica_like.errors import NoGradient
from modelica_like.native.holds import share
from modelica_like.solve.initialize import Point, call, holding, solve_implicit
from modelica_like.solve.initialize.slopes import slopes
from modelica_like.solve.recorder import Event

_GRAZING = 1e-6
_ROUNDING = 1e-12
SAME = 1e-9
"""Part of what a coincidence is measured by that may be rounding."""


@dataclass(frozen=True)
class Trigger:
    """When an event happens: its time is t_k + shift, and depends on x and theta before it.

    Attributes:
        shift: numerical difference to the recorded time; rounding of the location.
        by: derivative of the time by (x, theta) before the event, shape (nx + ntheta,).
    """

    shift: float
    by: Vector


@dataclass(frozen=True)
class Coincidence:
    """What is zero just at these parameters: the time between two events, or a motion that friction then holds.

    Attributes:
        by: its derivative by (x, theta) before the event, shape (nx + ntheta,).
        size: changes up to which it stays zero but for rounding.
        reason: what to say where it does not.
    """

    by: Vector
    size: float
    reason: NoGradient


@dataclass(frozen=True)
class When:
    """The cause of an event's time, why there is none, and other causes at the same time.

    There is no trigger at the start of the run, or if nothing depends on the time of the event.
    """

    trigger: Trigger | None = None
    reason: NoGradient | None = None
    apart: tuple[Coincidence, ...] = ()


def event_time(model: CompiledDae, before: Point, events: tuple[Event, ...], begin: Point) -> When:
    """Find the cause of the event's time: the transitions that fire in the first round."""
    if not events:
        # Elements that hold the same motion share it again, and nothing else happens.
        return When()
    # A step leaves the implicit unknowns as precise as its states need them; rates of guards need them better.
    solve_implicit(model, before)
    triggers: list[tuple[Event, Trigger]] = []
    for event in events:
        if event.round or event.transition < 0:
            continue
        transition = model.events.transitions[event.transition]
        trigger = (
            _moment(model, before, transition) if transition.timed else _crossing(model, before, transition, begin)
        )
        if trigger is None:
            return When(None, NoGradient(
                f"No gradient at t = {event.time:.9g} s: {event.mode} changes from {event.before} to {event.after} "
                "where its condition only grazes zero.",
                where=event.source,
                why="A small change of a parameter moves the event far, or removes it.",
                advice="Move the parameters away from this limit.",
            ))  # fmt: skip
        triggers.append((event, trigger))
    triggers = _give_way_together(model, before, triggers)
    first, trigger = triggers[0]
    theta = np.concatenate([model.p, model.u, before.d])
    weights = np.concatenate([np.maximum(np.abs(before.x), model.equations.nominals), np.maximum(np.abs(theta), 1.0)])
    nx = len(before.x)
    spans = [float(np.max(np.abs(t.by[:nx]) * weights[:nx])) for _, t in triggers]
    size = SAME * max(before.t - begin.t, abs(before.t), *spans)
    apart: list[Coincidence] = []
    for other, second in triggers[1:]:
        by = _difference(model, before, trigger.by - second.by)
        if np.any(np.abs(by) * weights > size):
            apart.append(Coincidence(by, size, _together(first, other)))
    return When(trigger, None, tuple(apart))


def _give_way_together(
    model: CompiledDae, before: Point, triggers: list[tuple[Event, Trigger]]
) -> list[tuple[Event, Trigger]]:
    """Give elements that share a reaction one time at which all of them give way: when no split can be borne.

    Each limit moves with the split, and what they bear together does not.
    """
    for circuit in model.held.circuits:
        modes = {
            model.held.motions[k].mode
            for k in circuit.members
            if before.d[model.held.motions[k].mode] == model.held.motions[k].number
        }
        fired = [model.events.transitions[event.transition] for event, _ in triggers]
        those = [k for k, transition in enumerate(fired) if not transition.timed and transition.mode in modes]
        shared = circuit.shares.of(before.d).any(axis=1)
        if len(those) < 2 or not shared.any():
            continue
        part = slopes(model, before, "guards", [fired[k].index for k in those])
        by_split = np.array([circuit.shares.of(column)[shared].ravel() for column in part.theta[:, -len(before.d) :]])
        left, sizes, _ = np.linalg.svd(by_split)
        weights, rank = left[:, -1], int(np.sum(sizes > SAME * sizes.max(initial=0.0)))
        if rank != len(those) - 1 or not (np.all(weights > 0.0) or np.all(weights < 0.0)):
            continue
        rate = float(weights @ part.rate)
        together = Trigger(-float(weights @ part.value) / rate, -(weights @ part.by) / rate)
        for k in those:
            triggers[k] = triggers[k][0], together
    return triggers


def _difference(model: CompiledDae, before: Point, by: Vector) -> Vector:
    """The difference of two triggers, without motions that modes hold, which cannot move."""
    nodes = [model.held.motions[k].motion for k in holding(model, before)]
    if not nodes or not np.any(by[: len(before.x)]):
        return by
    held = slopes(model, before, "variables", nodes)
    return by - held.by.T @ np.linalg.lstsq(held.x.T, by[: len(before.x)], rcond=None)[0]


def either_first(model: CompiledDae, before: Point, events: tuple[Event, ...], after: Point) -> bool:
    """Whether two events may come in either order with the same result: both begin to hold motions, and go on to.

    What the later one does in between is undone by what it then holds. The one that comes first must hold alone, and
    the other one must still come.
    """
    pair = [model.events.transitions[event.transition] for event in events if not event.round and event.transition >= 0]
    held = {(model.held.motions[k].mode, model.held.motions[k].number) for k in holding(model, after)}
    if len(pair) != 2 or any(t.timed or (t.mode, t.target) not in held for t in pair):
        return False
    for first, second in (pair, pair[::-1]):
        alone = before.copy()
        alone.d[first.mode] = first.target
        share(model, alone)
        solve_implicit(model, alone)
        rates = [float(slopes(model, at, "guards", [second.index]).rate[0]) for at in (before, alone)]
        leaves = any(transition.mode == first.mode for transition in Guards(model).wanting(alone))
        if leaves or not rates[1] > _GRAZING * rates[0]:
            return False
    return True


def _moment(model: CompiledDae, before: Point, transition: CompiledTransition) -> Trigger:
    part = slopes(model, before, "moments", [transition.index])
    return Trigger(float(part.value[0]) - before.t, part.by[0])


def _crossing(model: CompiledDae, before: Point, transition: CompiledTransition, begin: Point) -> Trigger | None:
    """Event time of a guard: it moves by minus its change over its rate; None if it only grazes zero."""
    part = slopes(model, before, "guards", [transition.index])
    rate = float(part.rate[0])
    change = abs(float(call(model, model.events.guards, begin)[transition.index]))
    terms = float(np.abs(part.x[0]) @ (np.abs(before.x) + model.equations.nominals))
    if not rate * (before.t - begin.t) > _GRAZING * change + _ROUNDING * terms:
        return None
    return Trigger(-float(part.value[0]) / rate, -part.by[0] / rate)


def _together(event: Event, other: Event) -> NoGradient:
    return NoGradient(
        f"No gradient at t = {event.time:.9g} s: '{event.mode}: {event.before} → {event.after}' and "
        f"'{other.mode}: {other.before} → {other.after}' happen at the same instant but for different reasons.",
        where=[event.source, other.source],
        why="A small change of a parameter decides which comes first, so the derivatives on both sides differ.",
        advice="Choose parameter values that separate the two events.",
    )


def at_rest(model: CompiledDae, point: Point, hold: int, by: Vector) -> Coincidence:
    """Return that a motion which a mode holds is just zero: friction would stop it, but not the same from both sides.

    Args:
        model: the compiled model.
        point: where it is zero.
        hold: position of the held motion.
        by: derivative of the motion by (x, theta) before the event.
    """
    held_motion = model.held.motions[hold]
    mode, motion = model.flat_discretes[held_motion.mode], model.flat_variables[held_motion.motion].path
    held = f"{mode.path} becomes {mode.names[held_motion.number]}"
    speed = slopes(model, point, "variables", [held_motion.motion])
    size = SAME * float(np.abs(speed.x[0]) @ (np.abs(point.x) + model.equations.nominals))
    error = NoGradient(
        f"No gradient at t = {point.t:.9g} s: {held}, because {motion} is zero.",
        why="A small change of a parameter decides which way it moves first, so the derivatives on both sides differ.",
        advice="Move the parameters away from this limit.",
    )
    return Coincidence(by, size, error)
