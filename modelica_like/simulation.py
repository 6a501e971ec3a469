"""The whole chain in one call."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args

from modelica_like import upper
from modelica_like.arguments import checked
from modelica_like.compile import compile
from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.sliding import as_asked
from modelica_like.errors import (
    ExportError,
    InitializationError,
    Interrupted,
    LanguageError,
    MissingExtra,
    SolveError,
    StepFailed,
    UnitError,
    UnknownName,
    ValueOutOfRange,
    did_you_mean,
)
from modelica_like.flatten import flatten
from modelica_like.garbage import without_garbage_search
from modelica_like.language import Component
from modelica_like.language.tunable import with_tunable_tables
from modelica_like.language.units import parse_unit, to_si
from modelica_like.options import OnChattering, Options
from modelica_like.runs.collect import collector
from modelica_like.runs.conserve import conserving
from modelica_like.runs.driven import driven
from modelica_like.runs.solution import Solution
from modelica_like.runs.trajectories import Statistics, Trajectories, needs_equations
from modelica_like.solve.initialize import StartKind
from modelica_like.solve.initialize.ideal import refuse_contradiction
from modelica_like.solve.panels import Progress
from modelica_like.structure import reduce

_SECOND = parse_unit("s")
_SHORTEST = 1e-12
_LONGEST = 1e100
"""Seconds of a run: error tests square them, and beyond 1e154 s they shorten their steps without an end."""

Solver = Literal["idas", "native"]
Model = Component | CompiledDae | str | Path


@checked
def build(
    drive: Model, free: Iterable[str] = (), *, tables: Iterable[str] = (), on_chattering: OnChattering | None = None
) -> CompiledDae:
    """Compile a component tree or a netlist file; a compiled model is returned unchanged.

    Args:
        drive: the model.
        free: parameters to decouple from their formulas: each keeps its formula's value, but can be varied on its own.
            Not possible in a compiled model.
        tables: patterns of tables whose numbers become parameters, such as `clutch.mu_pos`: see
            `with_tunable_tables`. Not possible in a compiled model.
        on_chattering: as of `simulate`, for runs, FMUs and compiled runs of the model; by default that of the netlist.

    Raises:
        LanguageError: `tables` is given for a compiled model.
        ModelicaLikeError: the model has an error; the message says what, where and what to do.
    """
    if on_chattering is not None:
        model = build(drive, free, tables=tables)
        return model.twin(settings={**model.settings, "on_chattering": on_chattering})
    drive = loaded(drive)
    if isinstance(drive, CompiledDae):
        if tables:
            raise LanguageError("Tables of a compiled model cannot change.", advice="Build it with `tables`.")
        return drive
    if tables:
        drive = with_tunable_tables(drive, tables)
    model = _compiled(drive)
    bound = [name for name in free if name in model.derived_position]
    if not bound:
        return model
    values = model.equations.derived(model.p).full().ravel()
    drive = copy.deepcopy(drive)
    for name in bound:
        drive.set(name, float(values[model.derived_position[name]]))
    return _compiled(drive)


def loaded(drive: Model) -> CompiledDae | Component:
    """Return what a drive is: a compiled model, or a component, also that of a netlist file.

    Raises:
        LanguageError: it is no drive.
        NetlistError: the file cannot be read.
    """
    if isinstance(drive, str | Path):
        from modelica_like.netlist import load

        return load(drive)
    if isinstance(drive, Trajectories):
        raise needs_equations(drive)
    if not isinstance(drive, CompiledDae | Component):
        raise _no_drive(drive)
    return drive


def _no_drive(given: Any) -> LanguageError:
    if isinstance(given, type) and issubclass(given, Component):
        return LanguageError(f"{given.__name__} is a class, not a drive.", advice=f"Create one: {given.__name__}(…).")
    return LanguageError(
        f"Something of type {type(given).__name__} is no drive: write a component, a built model, or a netlist's path.",
        advice='Parts become a drive as Assembly(parts={"motor": …, "load": …}, series={"shaft": ["motor", "load"]}).',
    )


@without_garbage_search()
def _compiled(drive: Component) -> CompiledDae:
    return compile(reduce(flatten(drive)))


@checked
def simulate(
    drive: Model, until: float | str | None = None, *, parameters: Mapping[str, Any] | None = None,
    start: StartKind | None = None, t0: float | None = None, rtol: float | None = None, atol: float | None = None,
    points: int | None = None, options: Options | None = None, progress: Progress | None = None,
    solver: Solver | None = None, on_chattering: OnChattering | None = None, readings: Sequence[str] = (),
    inputs: Any = None, compiled: bool | None = None,
) -> Solution:  # fmt: skip
    """Simulate a drive.

    Args:
        drive: a component, a netlist file, or a compiled model.
        until: end time, a number in s or a quantity; by default that of the netlist.
        parameters: other values of parameters and inputs by path, without compiling again.
        start: `given`, `rest` (variables without a start value are at rest) or `steady`.
        t0: start time in s; by default that of the netlist, or zero.
        rtol: relative tolerance.
        atol: absolute tolerance, in nominal values; if only `rtol` is given, at most a hundredth of it.
        points: number of equal intervals of the results.
        options: all options together, which win over those of a netlist; the arguments above override them.
        progress: called with the time reached.
        solver: `idas`, the reference, or `native`: the compiled run-time of FMUs, several times as fast. By default
            IDAS; if IDAS gives up, the run-time if there is one and it succeeds, with a notice.
        on_chattering: what to do where events follow each other without end, see `Options`: `stop`, `slide` or `rest`.
        readings: numbers to read off the run as it is integrated, `max(shaft.tau)`: `Solution.readings` has them. Of
            runs that are not too large `Solution.read` reads others afterwards.
        inputs: trajectories of open inputs by path, or a table with a column `time` (a dictionary, pandas, a CSV file):
            see `driven`. They are linear in between, hold their first and last value beyond, and the run says so.
        compiled: whether the compiled run-time has the equations as machine code, see `Options`.

    Raises:
        ModelicaLikeError: the model or a value is wrong, or the simulation cannot continue.
        Interrupted: the run was interrupted. `run` of this and of a `SolveError` is the solution up to then.
    """
    model = build(drive if inputs is None else driven(drive, inputs))
    if parameters:
        model = model.with_parameters(dict(parameters))
    given: dict[str, Any] = {"rtol": rtol, "atol": atol, "points": points, "on_chattering": on_chattering}
    t0 = model.begin if t0 is None else t0
    end, chosen = plan(model, until, t0=t0, options=options, compiled=compiled, **given)
    chosen.check_memory(len(model.states) + len(model.implicit))
    kind: StartKind = start or model.settings.get("start", "given")
    settings = {**model.settings, "start": kind, "on_chattering": chosen.on_chattering}
    model = as_asked(model if settings == model.settings else model.twin(settings=settings))
    run = _Run(model, _loop(solver or "idas"), t0, end, kind, tuple(readings), progress, time.perf_counter())
    try:
        return conserving(run(chosen), run)
    except StepFailed as error:
        if solver is None and (solution := run.by_run_time(chosen, error)) is not None:
            return solution
        raise


@dataclass(frozen=True)
class _Run:
    """A run that is repeated with other options; the arguments are those of `simulate`, `begin` is on the clock."""

    model: CompiledDae
    loop: Any
    t0: float
    end: float
    start: StartKind
    readings: tuple[str, ...]
    progress: Progress | None
    begin: float

    def __call__(self, options: Options) -> Solution:
        model = self.model
        point = upper.initialize(model, self.t0, self.start)
        loop = self.loop(model, options, point, self.end, self.progress)
        if self.start == "steady":
            loop.record.notices += upper.unstable("The steady state at the start", model, point)
        numbers = collector(model, self.readings, options.atol)
        if self.readings:
            loop.record.keeper.read = lambda steps: numbers.feed(loop.dense(steps))
        try:
            loop.run()
        except SolveError as error:
            error.run = self._solution(loop) if loop.record.segments else None
            raise
        except KeyboardInterrupt as interrupt:
            raise Interrupted.after(self._solution(loop) if loop.record.segments else None) from interrupt
        for segment in loop.record.segments if model.held.ideal else ():
            refuse_contradiction(model, segment.point(-1))
        solution = self._solution(loop)
        if not self.readings:
            return solution
        numbers.feed(loop.dense(loop.record.keeper.steps))
        return replace(solution, readings=dict(zip(self.readings, numbers.finish(solution), strict=True)))

    def by_run_time(self, options: Options, failure: StepFailed) -> Solution | None:
        """Return the run by the compiled run-time instead; None without one, or if it also fails."""
        with suppress(SolveError, ExportError, LanguageError, MissingExtra):
            again = replace(self, loop=_loop("native"), begin=time.perf_counter())
            run = conserving(again(options), again)
            notice = f"{failure.what} The whole run was done by the compiled run-time instead (solver native)."
            return replace(run, notices=(notice, *run.notices))
        return None

    def _solution(self, loop: Any) -> Solution:
        """Return the results of a loop so far."""
        record, elapsed = loop.record, time.perf_counter() - self.begin
        steps, evaluations, integrations = loop.counts
        statistics = Statistics(steps, evaluations, integrations, len(record.events), elapsed)
        return Solution(
            loop.model, loop.options, tuple(record.segments), tuple(record.events), statistics, tuple(record.impacts),
            tuple(record.notices), self.start, dense=record.keeper.dense(loop),
        )  # fmt: skip


def quick_run(model: Model, until: float | str | None = None, **run: Any) -> Solution:
    """Simulate with the compiled run-time, or with IDAS if there is none or it fails.

    Args:
        model: as of `simulate`.
        until: end time.
        run: further arguments of `simulate`.

    Raises:
        ModelicaLikeError: IDAS also fails; this is its error.
    """
    model = build(model)
    try:
        return simulate(model, until, **run, solver="native")
    except (ExportError, InitializationError, LanguageError, MissingExtra, SolveError):
        return simulate(model, until, **run, solver="idas")


def plan(
    model: CompiledDae, until: float | str | None = None, *, t0: float | None = None, options: Options | None = None,
    **given: Any,
) -> tuple[float, Options]:  # fmt: skip
    """Return the end time in s and the options of a run; the arguments are those of `simulate`.

    Raises:
        ValueOutOfRange, UnitError: there is no end time, it is not after the start, or an option is wrong.
    """
    end = seconds(until if until is not None else model.settings.get("until"))
    chosen = _options(options or Options(), model.settings, **given)
    t0 = model.begin if t0 is None else t0
    if end <= t0:
        raise ValueOutOfRange(f"The end time {end:g} s is not after the start time {t0:g} s.")
    if end - t0 < _SHORTEST * max(1.0, abs(t0)):
        raise ValueOutOfRange(f"A run of {end - t0:g} s is too short: its times cannot be distinguished.")
    if end - t0 > _LONGEST:
        raise ValueOutOfRange(f"A run of {end - t0:g} s is too long: solvers square such times, which are no numbers.")
    return end, chosen


def _loop(solver: str) -> Any:
    """Return the loop that runs a model."""
    if solver in get_args(Solver):
        return partial(upper.EngineLoop, idas=solver == "idas")
    raise UnknownName(
        f"There is no solver '{solver}'{did_you_mean(solver, get_args(Solver)) or '.'}",
        advice="There are idas (the reference) and native (the compiled run-time of FMUs).",
    )


def seconds(until: float | str | None, name: str = "until") -> float:
    """Return an end time or a step, a number in s or a quantity, in s; `name` is for messages."""
    if until is None:
        raise ValueOutOfRange(
            "There is no end time.",
            advice='Write simulate(…, until="2 s"), or put `until` under [simulate] in the netlist.',
        )
    try:
        return to_si(until, _SECOND, name)
    except UnitError as error:
        error.advice = error.advice or f'Give seconds or a time, e.g. {name}="2 s".'
        raise


def positive_step(fixed_step: float | str | None) -> float:
    """Return a fixed step in s, 0 for None.

    Raises:
        ValueOutOfRange: it is not positive and finite.
    """
    step = 0.0 if fixed_step is None else seconds(fixed_step, "fixed_step")
    if fixed_step is not None and not 0 < step < math.inf:
        raise ValueOutOfRange(f"The fixed step must be a positive time, not {step:g} s.")
    return step


def _options(base: Options, settings: Mapping[str, Any], **given: Any) -> Options:
    values = {name: getattr(base, name) for name in Options.__dataclass_fields__}
    asked = {name for name, value in values.items() if value != getattr(Options, name)}  # wins over the netlist
    names = {"rtol", "atol", "points", "on_chattering"} & settings.keys() - asked
    chosen = {name: settings[name] for name in names}
    chosen |= {name: value for name, value in given.items() if value is not None}
    if "rtol" in chosen and "atol" not in chosen:
        # Otherwise what is small compared with its nominal value would not become more precise.
        chosen["atol"] = min(values["atol"], replace(base, rtol=chosen["rtol"]).rtol / 100)
    return Options(**(values | chosen))
