"""An optimisation as one problem: the drive built so that what is free can change, its rows, and its load cases."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.analyse.optimize.modal import is_modal, modal_unit
from modelica_like.analyse.optimize.sized import Sized
from modelica_like.analyse.optimize.terms import (
    Aim,
    Bounded,
    Case,
    Free,
    Limit,
    Row,
    read_aims,
    read_cases,
    read_free,
    read_limits,
)
from modelica_like.analyse.tolerance.scatter import read_population
from modelica_like.analyse.written import placed
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import LanguageError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.language import Component
from modelica_like.language.inside import declarations
from modelica_like.language.units import Unit, parse_unit, to_si
from modelica_like.runs.readings import CONDITIONS, Output, leaves, read_number, read_output
from modelica_like.simulation import Model, build, loaded, plan, quick_run

_NAME = re.compile(r"[A-Za-z_][\w.]*(?:\[[^\]]*\][\w.]*)*")
_BEFORE_END = 1e-5
"""Of the time of a run: how much before its end an event may be; ten times what counts as no excess of a limit."""
_PROFILE = {"points", "rows", "from", "to", "rising", "falling"}


@dataclass(frozen=True)
class Question:
    """What is asked, as written.

    Attributes:
        minimize: outputs that are to be small.
        maximize: outputs that are to be large.
        free: bounds by parameter, or `points` or `rows`, `from`, `to`, `rising`, `falling` of a table.
        subject_to: limits.
        cases: load cases, tables of parameter values with a `name`.
        parameters: other values of parameters, in all cases.
        until: end time.
        start: kind of start.
        tolerances: how parameters scatter, for limits with a probability.
        correlated: which scatter together.
        folder: of files with measured values.
        chosen: whether something is chosen, so that nothing need be free.
        written: what of this stands in [optimize] of the netlist.
    """

    minimize: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()
    free: Mapping[str, Any] | None = None
    subject_to: tuple[str, ...] = ()
    cases: tuple[Mapping[str, Any], ...] = ()
    parameters: Mapping[str, Any] | None = None
    until: float | str | None = None
    start: Any = None
    tolerances: Mapping[str, Any] | None = None
    correlated: tuple[Mapping[str, Any], ...] = ()
    folder: Path = Path()
    chosen: bool = False
    written: frozenset[str] = frozenset()

    def at(self, drive: Model, key: str) -> AbstractContextManager[None]:
        """Give errors the place of an entry of [optimize], if it stands there."""
        if key in self.written and isinstance(drive, Component | CompiledDae):
            return placed(drive, f"optimize.{key}")
        return nullcontext()


@dataclass(frozen=True, eq=False)
class Problem(Bounded):
    """A question about a compiled model.

    Attributes:
        model: with the values of `parameters`.
        free: what may change.
        aims: objectives.
        limits: of outputs.
        cases: load cases; all limits hold in each, and the worst counts.
        ordered: pairs (k, l) of what is free: value k is at most value l.
        outputs: names of all numbers of a design.
        within: times of events without an upper limit, which are in the run.
        sized: the design checks of the drive's sizing file.
    """

    question: Question
    model: CompiledDae
    free: tuple[Free, ...]
    aims: tuple[Aim, ...]
    limits: tuple[Limit, ...]
    cases: tuple[Case, ...]
    ordered: tuple[tuple[int, int], ...]
    outputs: tuple[str, ...]
    within: tuple[Row, ...]
    sized: Sized

    def numbers(self, rows: Sequence[Row]) -> tuple[list[int], Vector, Vector]:
        """Return positions of the outputs of rows, their signs and limits."""
        places = [self.outputs.index(row.output) for row in rows]
        return places, np.array([row.sign for row in rows]), np.array([row.most for row in rows])


def make_problem(drive: Model, question: Question) -> Problem:
    """Build a drive for a question.

    Args:
        drive: the drive.
        question: what is asked.

    Raises:
        UnknownName, ValueOutOfRange, UnitError: something in the question does not fit the drive.
        LanguageError: a table of a compiled model is to be free.
        ModelicaLikeError: the drive has an error.
    """
    with question.at(drive, "free"):
        scattering = [*(question.tolerances or {})]
        model, free, ordered = build_free(
            drive, question.free or {}, question.parameters or {}, scattering, none=question.chosen
        )
    with question.at(drive, "minimize" if question.minimize else "maximize"):
        sized = Sized(drive, model, partial(quick_run, model, question.until, start=question.start))
        unit_of = _units(model, sized)
        aims = read_aims(unit_of, question.minimize, question.maximize)
        if free and not question.chosen:
            _check_changes(model, {f"objective '{aim.text}'": aim.rows for aim in aims}, free)
    with question.at(drive, "subject_to"):
        limits = read_limits(unit_of, question.subject_to)
        if free and not question.chosen:
            plain = {f"limit '{limit.text}'": limit.rows() for limit in limits if limit.probability == 1.0}
            _check_changes(model, plain, free)
    with question.at(drive, "for"):
        cases = read_cases(model, question.cases, free)
    names = [parameter.name for parameter in free]
    rows = [*(row for aim in aims for row in aim.rows), *(row for limit in limits for row in limit.rows())]
    outputs = tuple(dict.fromkeys([*(row.output for row in rows), *(limit.name for limit in limits)]))
    order = tuple((names.index(low), names.index(high)) for low, high in ordered)
    with question.at(drive, "subject_to"):
        _check_chances(model, question, limits)
    read = [name for name in outputs if not is_modal(name) and not sized.has(name)]
    within = _within_the_run(model, question, read, limits)
    return Problem(question, model, free, aims, limits, cases, order, outputs, within, sized)


def build_free(
    drive: Model, given: Mapping[str, Any], parameters: Mapping[str, Any], others: Sequence[str] = (), *,
    none: bool = False, moved: bool = False,
) -> tuple[CompiledDae, tuple[Free, ...], list[tuple[str, str]]]:  # fmt: skip
    """Build a drive so that what is free can change.

    Args:
        drive: the drive.
        given: bounds by path, or `points`, `rows`, … of a table.
        parameters: other values of parameters.
        others: parameters that are to change besides.
        none: whether nothing need be free.
        moved: whether a value of the drive that is not between its bounds moves to the next one.

    Returns:
        The model, what is free, and pairs of names: the first one's value is at most that of the second one.

    Raises:
        UnknownName, ValueOutOfRange, UnitError: bounds do not fit the drive.
        LanguageError: a table of a compiled model is to be free.
        ModelicaLikeError: the drive has an error.
    """
    profiles = {path: bounds for path, bounds in given.items() if isinstance(bounds, Mapping)}
    plain = {path: bounds for path, bounds in given.items() if path not in profiles}
    drive, cells, ordered = _with_profiles(loaded(drive), profiles)
    model = build(drive, free=[*plain, *others], tables=[path.replace("[", "[[]") for path in profiles])
    model = model.with_parameters(dict(parameters))
    return model, () if none and not given else read_free(model, plain | cells, moved=moved), ordered


def _within_the_run(
    model: CompiledDae, question: Question, names: Sequence[str], limits: Sequence[Limit]
) -> tuple[Row, ...]:
    """Return rows that keep times of events, if no limit does, before the end of the run: later ones do not happen."""
    times = [name for name in names if read_output(model, name).kind in ("time", *CONDITIONS)]
    end = plan(model, question.until)[0] if times else 0.0
    early = {row.output for limit in limits for row in limit.rows() if row.sign > 0 and row.most < end}
    return tuple(Row(name, 1.0, end * (1.0 - _BEFORE_END)) for name in times if name not in early)


def _units(model: CompiledDae, sized: Sized) -> Callable[[str], Unit]:
    """Return what knows the units of outputs: of the linearized drive, of a design check, of a run."""

    def unit_of(name: str) -> Unit:
        if is_modal(name):
            return modal_unit(model, name)
        return sized.unit(name) if sized.has(name) else _smooth(model, name).unit

    return unit_of


def _smooth(model: CompiledDae, name: str) -> Output:
    """Read the name of a number of a run that a design changes little by little.

    Raises:
        UnknownName: the model has no such output.
        ValueOutOfRange: it is a trajectory, or has the number of a mode.
    """
    output = read_number(model, name)
    read = {word for leaf in leaves([output]) if not leaf.changes for word in _NAME.findall(leaf.path)}
    for mode in (mode for mode in model.flat_discretes if mode.names and mode.path in read):
        raise ValueOutOfRange(
            f"'{name}': {mode.path} is a mode, which is no quantity: its numbers stand for names.",
            advice=f"Ask how long it has one of them, duration({mode.path}: {mode.names[0]}), or when it changes, "
            f"time({mode.path}: {mode.names[0]} -> {mode.names[1]}).",
        )
    return output


def _check_changes(model: CompiledDae, numbers: Mapping[str, Sequence[Row]], free: Sequence[Free]) -> None:
    """Refuse objectives and limits that are parameters which are not free, by what they are called."""
    fixed = model.fixed_position.keys() - {parameter.name for parameter in free}
    for what, rows in numbers.items():
        if all(row.output in fixed for row in rows):
            raise ValueOutOfRange(
                f"Nothing changes the {what}: it is a parameter that is not free.",
                advice="Ask for an output of the run, or free it.",
            )


def _check_chances(model: CompiledDae, question: Question, limits: Sequence[Limit]) -> None:
    """Refuse limits with a probability where nothing scatters."""
    chances = [limit for limit in limits if limit.probability < 1.0]
    for limit in chances:
        if is_modal(limit.name):
            raise ValueOutOfRange(
                f"'{limit.text}': a mode has no probability, as it needs no run.",
                advice="Ask for a probability of outputs of the run or of lines of design checks.",
            )
    if chances and not question.tolerances:
        raise ValueOutOfRange(
            f"'{chances[0].text}' asks for a probability, but nothing scatters.",
            advice='Say how parameters scatter: [tolerances] in the netlist, or tolerances={"clutch.mu": "±10 %"}.',
        )
    if chances:
        read_population(model, question.tolerances or {}, question.correlated, question.folder)


def _with_profiles(
    drive: Component | CompiledDae, profiles: Mapping[str, Mapping[str, Any]]
) -> tuple[Component | CompiledDae, dict[str, Any], list[tuple[str, str]]]:
    """Return a drive with the tables as they are to be, bounds by path of their cells, and which follow each other."""
    cells: dict[str, Any] = {}
    ordered: list[tuple[str, str]] = []
    if not profiles:
        return drive, cells, ordered
    if not isinstance(drive, Component):
        raise LanguageError(
            "Tables of a compiled model cannot be free.", advice="Give the netlist or the component itself."
        )
    drive = copy.deepcopy(drive)
    for path, given in profiles.items():
        bounds, order = _profile(drive, path, given)
        cells |= bounds
        ordered += order
    return drive, cells, ordered


def _profile(drive: Component, path: str, given: Mapping[str, Any]) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Make the values of a table free; return bounds by path of the cells, and which follow each other.

    The first column stays as it is, or is divided evenly for `points`.
    """
    owner, name = _table(drive, path)
    unknown = given.keys() - _PROFILE
    if unknown or "from" not in given or "to" not in given:
        what = f"has no '{sorted(unknown)[0]}'" if unknown else "needs `from` and `to`"
        raise ValueOutOfRange(
            f"free: {path} {what}.", advice='Write { points = 12, from = "0 N", to = "9 kN", rising = true }.'
        )
    rows, columns = np.array(getattr(owner, name), float), declarations(owner).tables[name].columns
    if rows.ndim != 2 or rows.shape[1] != 2:
        raise ValueOutOfRange(f"free: {path} must be a table of two columns.", advice="Free single parameters instead.")
    if "points" in given:
        points = given["points"]
        if isinstance(points, bool) or not isinstance(points, int) or not 2 <= points <= 100:
            raise ValueOutOfRange(f"free: {path}: points = {points!r} must be a whole number from 2 to 100.")
        at = np.linspace(rows[0, 0], rows[-1, 0], points)
        rows = np.column_stack([at, np.interp(at, rows[:, 0], rows[:, 1])])
        drive.set(path, rows.tolist())
    column = columns[min(1, len(columns) - 1)]
    unit = parse_unit("1" if column.scale else column.unit)
    bounds = tuple(to_si(given[key], unit, f"free: {path}") for key in ("from", "to"))
    cells = [f"{path}[{row},2]" for row in _chosen_rows(path, given.get("rows"), len(rows))]
    pairs = list(pairwise(cells))
    order = pairs if given.get("rising") else [(b, a) for a, b in pairs] if given.get("falling") else []
    return dict.fromkeys(cells, bounds), order


def _table(drive: Component, path: str) -> tuple[Component, str]:
    tables = {
        f"{part.path}.{name}".lstrip("."): (part, name) for part in drive.walk() for name in declarations(part).tables
    }
    if path not in tables:
        raise UnknownName(f"{drive.label} has no table '{path}'{did_you_mean(path, tables) or '.'}")
    return tables[path]


def _chosen_rows(path: str, given: Any, count: int) -> list[int]:
    """Return the rows of a table that are free, counted from 1; all if none are named."""
    if given is None:
        return [*range(1, count + 1)]
    rows = given if isinstance(given, list | tuple) else []
    if not rows or not all(type(row) is int and 1 <= row <= count for row in rows) or len({*rows}) < len(rows):
        raise ValueOutOfRange(f"free: {path}: rows = {given!r} must be a list of row numbers from 1 to {count}.")
    return sorted(rows)
