"""Linearisation at a point: A, B, C, D with names and units, right through locked and open clutches."""

from __future__ import annotations

from collections.abc import Sequence

from modelica_like.analyse.linear.held import free_motions
from modelica_like.analyse.linear.model import LinearModel
from modelica_like.analyse.linear.points import At, Drive, point_of
from modelica_like.analyse.slopes import columns_of, nodes_of, slopes
from modelica_like.compile.compiled import CompiledDae


def linearize(
    drive: Drive, at: At = None, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None,
) -> LinearModel:  # fmt: skip
    """Linearise a drive about a point of its motion, in the modes that are active there.

    Surfaces that stick move as one: what a mode holds is no state of its own.

    Args:
        drive: a component, a netlist file, a compiled model, or a solution.
        at: a time in s (of the solution; other drives are simulated up to there), or a start: `given`, `rest`,
            `steady`. By default the end of a solution, otherwise the given start.
        inputs: names of inputs and parameters; by default the inputs of the model.
        outputs: names of variables; by default the outputs of the model, or its states if it has none.

    Raises:
        UnknownName: a name is not known.
        ModelicaLikeError: the drive cannot be built, started or simulated.
    """
    model, point = point_of(drive, at)
    u_names = tuple(model.flat_variables[k].path for k in model.inputs) if inputs is None else tuple(inputs)
    top = (one.path for one in model.flat_variables if one.kind == "output" and "." not in one.path)
    y_names = (tuple(top) or model.states) if outputs is None else tuple(outputs)
    columns, nodes = columns_of(model, u_names), nodes_of(model, y_names)
    rates, found = slopes(model, point, "ode"), slopes(model, point, "variables", nodes)
    a, b, c, d = rates.x, rates.theta[:, columns], found.x, found.theta[:, columns]
    motions = free_motions(model, point)
    keep, shape = motions.keep, motions.shape
    if len(keep) < len(a):
        a, b, c = a[keep] @ shape, b[keep], c @ shape
    kept = set(keep)
    names = tuple(model.states[k] for k in keep)
    held = tuple(name for k, name in enumerate(model.states) if k not in kept)
    units = {name: _unit(model, name) for name in (*model.states, *u_names, *y_names)}
    return LinearModel(model, point, a, b, c, d, names, held, u_names, y_names, units, shape)


def _unit(model: CompiledDae, name: str) -> str:
    """Return the unit of a variable, or of the derivative `der(x)` of one."""
    return str(model.units[name]) if name in model.units else f"{_unit(model, name[4:-1])}/s"
