"""Output of `check --start-values`: the start values with their origin."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
from rich.console import RenderableType

from modelica_like import upper
from modelica_like.compile import CompiledDae
from modelica_like.errors import MissingStart
from modelica_like.language import Component
from modelica_like.native.start import initialize
from modelica_like.options import Options
from modelica_like.show.report.tables import table
from modelica_like.solve.initialize import Point, StartKind, StartPlan, call, start_plan
from modelica_like.solve.initialize.plan import matrix_and_values, start_name

_AT_ONCE = 64
_NOTHING = 1e-9
_SHOWN = 4


@dataclass(frozen=True)
class StartValueRow:
    """A start value in SI units, and its origin: `given in FILE:LINE`, `guess`, `default`, `rest`, `follows from …`."""

    path: str
    value: float
    unit: str
    origin: str


def start_report(drive: Component, model: CompiledDae) -> RenderableType:
    """Return the start values of a model as a table."""
    kind: StartKind = model.settings.get("start", "given")
    rows = ((row.path, float(row.value), row.unit, row.origin) for row in start_values(drive, model, kind))
    return table(
        f"start values ({kind})", "variable", "value>.9g", "unit", "where from", rows=rows, name="start values"
    )


def start_notes(model: CompiledDae) -> list[str]:
    """Return what a run would say about missing start values, in a list; of a drive with open inputs nothing.

    Raises:
        ModelicaLikeError: a run would not begin: start values contradict each other, or what happens at once ends it.
    """
    try:
        if not model.inputs:
            first = initialize(model, start=model.settings.get("start", "given"))
            upper.EngineLoop(model, Options(), first, first.t + 1.0).begin()
    except MissingStart as error:
        return [f"{error.what} {error.advice}"]
    return []


def start_values(drive: Component, model: CompiledDae, kind: StartKind = "given") -> list[StartValueRow]:
    """Return given, assumed and computed start values of the states, in this order, for a kind of start."""
    point = initialize(model, start=kind)
    plan = start_plan(model, kind, point)
    variables = call(model, model.equations.variables, point)
    origins: dict[str, str] = {}
    for k, entry in enumerate(model.starts.entries):
        path = start_name(model, entry)
        if entry.strength == "fixed":
            origins[path] = _given(drive, path)
        elif k in plan.rows or (entry.strength == "default" and kind == "steady"):
            origins.setdefault(path, entry.strength)
    for node in plan.resting:
        if node < len(model.flat_variables):
            origins.setdefault(model.flat_variables[node].path, "rest")
    for state in plan.zero:
        origins.setdefault(model.states[state], "rest")
    determined = {*origins, *(model.states[state] for state, _ in plan.direct)}
    follows = [k for k, name in enumerate(model.states) if name not in determined]
    origins |= dict(zip((model.states[k] for k in follows), _follows(model, plan, point, follows), strict=True))
    return [StartValueRow(path, *_value(model, point, variables, path), origin) for path, origin in origins.items()]


def other_values(drive: Component, model: CompiledDae, kind: StartKind = "given") -> list[StartValueRow]:
    """Return what all other variables are at the start, which follows from `start_values`."""
    named, point = {row.path for row in start_values(drive, model, kind)}, initialize(model, start=kind)
    values = zip(model.flat_variables, call(model, model.equations.variables, point), strict=True)
    others = ((variable, value) for variable, value in values if variable.path not in named)
    return [StartValueRow(v.path, float(value), str(v.unit), "follows from the others") for v, value in others]


def _value(model: CompiledDae, point: Point, variables: np.ndarray, path: str) -> tuple[float, str]:
    if path in model.position:
        node = model.position[path]
        return float(variables[node]), str(model.flat_variables[node].unit)
    inner = path.removeprefix("der(").removesuffix(")")
    unit = f"{model.flat_variables[model.position[inner]].unit}/s" if inner in model.position else ""
    return float(point.x[model.states.index(path)]), unit


def _given(drive: Component, path: str) -> str:
    """Return the place of a value, in the outermost netlist that gives it."""
    component, rest = drive, path
    while rest:
        first, _, inner = rest.partition(".")
        for key in (f"start.{rest}", f"parts.{first.partition('[')[0]}{'.' if inner else ''}{inner}"):
            source = component.source_of(key)
            if source.file.endswith((".toml", ".mo")):
                return f"given in {Path(source.file).name}:{source.line}"
        if not inner:
            break
        component, rest = component.find(first), inner
    return "given"


def _follows(model: CompiledDae, plan: StartPlan, point: Point, states: list[int]) -> Iterator[str]:
    """Return the variables from which states follow."""
    if not plan.columns:
        yield from ("steady state" for _ in states)
        return
    y = np.zeros(plan.system.function.size1_out(0))
    whole, _ = matrix_and_values(model, plan.system, point, y)
    wanted, columns = list(plan.wanted), list(plan.columns)
    given = [start_name(model, model.starts.entries[k]) for k in plan.rows]
    given += [model.flat_variables[k].path if k < len(model.flat_variables) else "" for k in plan.resting]
    given += [start_name(model, model.starts.entries[k]) for _, k in plan.direct]
    matrix = whole[wanted, columns].T
    direct = whole[wanted, [state for state, _ in plan.direct]]
    for begin in range(0, len(states), _AT_ONCE):
        some = states[begin : begin + _AT_ONCE]
        unit = ca.DM(len(columns), len(some))
        for k, state in enumerate(some):
            unit[columns.index(state), k] = 1.0
        by_rows = ca.solve(matrix, unit).T
        slopes = np.hstack([by_rows[:, plan.own :].full(), ca.mtimes(by_rows, direct).full()])
        for row in np.abs(slopes):
            names = [given[k] for k in np.flatnonzero(row > _NOTHING) if given[k]]
            more = " …" if len(names) > _SHOWN else ""
            yield f"follows from {', '.join(names[:_SHOWN])}{more}" if names else "follows"
