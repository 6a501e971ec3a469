"""Consistent start values and modes, found by the compiled run-time."""

from __future__ import annotations

from math import inf
from typing import get_args

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import InitializationError, UnknownName, did_you_mean
from modelica_like.native.codes import Code
from modelica_like.native.library import OK
from modelica_like.native.model import Instance
from modelica_like.options import Options
from modelica_like.solve.initialize import Point, StartKind, StartPlan, start_plan

_PLANS = 5
"""Most uses of start values that are tried: numbers of some parameters or modes ask for another one than others, and
the start that it gives may have other modes."""
_BY_PLAN = Code.START_NOT_FOUND, Code.START_NOT_MET
"""What may have failed because start values were used in a wrong way."""


def initialize(model: CompiledDae, t0: float | None = None, start: StartKind = "given") -> Point:
    """Find consistent start values.

    Args:
        model: the compiled model.
        t0: start time in s; by default that of the netlist, or zero.
        start: `given`: the start values of the model determine everything; `rest`: variables without a start value
            are at rest, absolute speeds before relative ones; `steady`: all derivatives are zero, except those of
            states on which nothing depends.

    Returns:
        The start, before events at t0.

    Raises:
        MissingStart: start values are missing.
        ContradictingStart: start values contradict each other.
        InitializationError: the solver did not find a solution.
        UnknownName: there is no such kind of start.
        SingularAtStart: the equations have no unique solution.
    """
    if start not in get_args(StartKind):
        raise UnknownName(
            f"There is no start '{start}'{did_you_mean(start, get_args(StartKind)) or '.'}",
            advice="A run can start as given, at rest or in the steady state: given, rest, steady.",
        )
    if start == "steady":
        model.refuse_delays(InitializationError, f"{model.name} cannot start in the steady state")
    instance, code = _found(model, model.begin if t0 is None else t0, start)
    instance.check(code)
    return instance.present()


def steady_between_ticks(model: CompiledDae) -> Point:
    """Find a steady state as `initialize` does, for what samplers keep at the start or after some ticks.

    Raises:
        InitializationError: there is none.
    """
    model.refuse_delays(InitializationError, f"{model.name} cannot start in the steady state")
    instance, code = _found(model, 0.0, "steady")
    instance.check(OK if instance.failed == Code.MEMORY_NOT_STEADY else code)
    return instance.present()


def steady_near(model: CompiledDae, near: Point) -> Point:
    """Find the steady state near a point, in its modes and with what samplers keep there.

    Raises:
        InitializationError: there is none.
    """
    return _after(model, "steady_near", near)


def ticked(model: CompiledDae, point: Point) -> Point:
    """Return a steady state after every clock has ticked once.

    Raises:
        ModelicaLikeError: what clocks set does not settle.
    """
    return _after(model, "tick", point)


def check_ticks(model: CompiledDae, point: Point) -> Point:
    """Refuse a steady state that does not stay one when clocks tick; return where all is after some ticks.

    Raises:
        InitializationError: it does not; the message names what changes.
    """
    return _after(model, "check_ticks", point)


def _after(model: CompiledDae, function: str, point: Point) -> Point:
    """Return where a function of the run-time ends that goes to a point."""
    instance = _instance(model, point.t, "steady")
    instance.check(instance.at(getattr(instance.library, function), point))
    return instance.present()


def _found(model: CompiledDae, t0: float, start: StartKind) -> tuple[Instance, int]:
    """Start by one plan after the other, until one is that of the start that it gives."""
    instance, code = _started(model, t0, start, None)
    for _ in range(_PLANS):
        if code != OK and instance.failed not in _BY_PLAN:
            break
        plan = start_plan(model, start, instance.present())
        if plan.choice == instance.native.plan.choice:
            break
        instance, code = _started(model, t0, start, plan)
    return instance, code


def _started(model: CompiledDae, t0: float, start: StartKind, plan: StartPlan | None) -> tuple[Instance, int]:
    instance = _instance(model, t0, start, plan)
    return instance, instance.library.start(instance.address)


def _instance(model: CompiledDae, t0: float, start: StartKind, plan: StartPlan | None = None) -> Instance:
    instance = Instance(model, start, plan=plan)
    instance.reset(t0, inf, Options.rtol, Options.atol)
    return instance
