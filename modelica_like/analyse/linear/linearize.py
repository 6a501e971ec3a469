"""Linearization at a point, with clutches open or locked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

from modelica_like.analyse.linear.held import free_motions
from modelica_like.analyse.linear.model import LinearModel
from modelica_like.arguments import checked
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import LanguageError
from modelica_like.language.units import ONE, parse_unit, to_si
from modelica_like.native.start import initialize
from modelica_like.runs.solution import Solution
from modelica_like.simulation import Model, build, simulate
from modelica_like.solve.initialize import Point, StartKind
from modelica_like.solve.initialize.memory import sampled
from modelica_like.solve.initialize.slopes import columns_of, nodes_of, slopes

Drive = Model | Solution
"""What can be analysed: a component, a netlist file, a compiled model, or a solution of one."""

At = float | str | None
"""A time in s, or a start: `given`, `rest` or `steady`."""


def point_of(drive: Drive, at: At = None) -> tuple[CompiledDae, Point]:
    """Return the model and the point that `at` describes.

    Args:
        drive: a component, a netlist file, a compiled model, or a solution.
        at: a time in s, or a kind of start; by default the end of a solution, otherwise the netlist's start.

    Raises:
        ValueOutOfRange: the time is not within the run.
        ModelicaLikeError: the drive cannot be built, started or simulated.
    """
    if isinstance(drive, Solution):
        if isinstance(at, str):
            return drive.model, initialize(drive.model, float(drive.time[0]), _kind(at))
        return drive.model, drive.point(float(drive.time[-1]) if at is None else float(at))
    model = build(drive)
    if at is None or isinstance(at, str) or at == model.begin:
        start = at if isinstance(at, str) else model.settings.get("start", "given")
        return model, initialize(model, start=_kind(start))
    run = simulate(model, float(at))
    return model, run.point(float(at))


def when(text: str) -> At:
    """Read a time with a unit, or a kind of start, as a command line gives it.

    Raises:
        UnitError: it is neither.
    """
    return text if text in get_args(StartKind) else to_si(text, parse_unit("s"), "at")


def _kind(name: str) -> StartKind:
    # initialize() raises the error with the known names.
    return next((kind for kind in get_args(StartKind) if kind == name), name)  # type: ignore[return-value]


@checked
def linearize(
    drive: Drive, at: At = None, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None,
) -> LinearModel:  # fmt: skip
    """Linearize a drive about a point of its motion, in the modes that are active there.

    Surfaces that stick move as one: a held motion is not a state. What clocks set is constant; `sampled` names it.

    Args:
        drive: a component, a netlist file, a compiled model, or a solution.
        at: a time in s (of the solution; other drives are simulated up to there), or a start: `given`, `rest`,
            `steady`. By default the end of a solution, otherwise the netlist's start.
        inputs: names of inputs and parameters; by default the inputs of the model.
        outputs: names of variables; by default the outputs of the model, or the variables among its states
            if it has none.

    Raises:
        UnknownName: a name is not known.
        LanguageError: a value is delayed.
        ModelicaLikeError: the drive cannot be built, started or simulated.
    """
    model, point = point_of(drive, at)
    model.refuse_delays(LanguageError, f"{model.name} cannot be linearized")
    u_names = tuple(model.flat_variables[k].path for k in model.inputs) if inputs is None else tuple(inputs)
    top = (variable.path for variable in model.flat_variables if variable.kind == "output" and "." not in variable.path)
    # A state such as der(spring.phi_rel) is the rate of a variable, and no variable itself.
    states = tuple(name for name in model.states if name in model.position)
    y_names = (tuple(top) or states) if outputs is None else tuple(outputs)
    columns, nodes = columns_of(model, u_names), nodes_of(model, y_names)
    different = list(dict.fromkeys(columns))
    rates = slopes(model, point, "ode", columns=different)
    of_outputs = slopes(model, point, "variables", nodes, columns=different)
    places = [different.index(column) for column in columns]
    a, b, c, d = rates.x, rates.theta[:, places], of_outputs.x, of_outputs.theta[:, places]
    motions = free_motions(model, point)
    keep, shape = motions.keep, motions.shape
    if len(keep) < len(a):
        a, b, c = a[keep] @ shape, b[keep], c @ shape
    kept = set(keep)
    names = tuple(model.states[k] for k in keep)
    held = tuple(name for k, name in enumerate(model.states) if k not in kept)
    units = {name: _unit(model, name) for name in (*model.states, *u_names, *y_names)}
    return LinearModel(model, point, a, b, c, d, names, held, u_names, y_names, units, shape, sampled(model, nodes))


def _unit(model: CompiledDae, name: str) -> str:
    """Return the unit of a variable, of a state that follows the motion, or of the derivative `der(x)` of one."""
    return f"{_unit(model, name[4:-1])}/s" if name.startswith("der(") else str(model.units.get(name, ONE))
