"""Models with expressions among their variables, which the run-time then reads like any other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.edges import find_edges
from modelica_like.language.units import ONE
from modelica_like.runs.readings import Part


def key_of(part: Part) -> str:
    """Return the path that the value of a part has among the variables."""
    return f"{part.text} ({part.form} {part.change[1]})"


def with_expressions(model: CompiledDae, parts: Sequence[Part], *, edges: bool = False) -> CompiledDae:
    """Return the model with the values of parts among its variables.

    Args:
        model: the compiled model.
        parts: what to read.
        edges: whether steps end where the slope of such a value changes, as they do for the equations.
    """
    more = {key_of(part): part for part in parts if part.kind not in ("change", "impact")}
    if not more:
        return model
    extended = model.once((Cached.EXPRESSIONS, edges, *more), lambda: _with(model, more, edges))
    return extended.twin(p=model.p, u=model.u, settings=model.settings)


def _with(model: CompiledDae, more: Mapping[str, Part], edges: bool) -> CompiledDae:
    given, values = [*model.arguments.values()], [part.expression(model) for part in more.values()]
    column = ca.densify(ca.vertcat(model.equations.variables(*given), *values))
    variables = ca.Function("variables", given, [column], model.equations.variables.name_in(), ["variables"])
    equations = replace(model.equations, variables=variables)
    like = model.flat_variables[0]
    further = [replace(like, path=path, unit=ONE, kind="local") for path in more]
    extended = replace(
        model, equations=equations, flat_variables=(*model.flat_variables, *further), _cache={},
        _make_energy=lambda: model.energy,
        _make_start=lambda rest: model.rest_system if rest else model.start_system,
    )  # fmt: skip
    if edges:
        functions = model.equations.ode, model.equations.alg, model.events.guards
        extended.once(Cached.EDGES, lambda: find_edges(model.arguments, *functions, ca.vertcat(*values)))
    return extended
