"""Parameters with a formula, decoupled from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import LanguageError
from modelica_like.simulation import Model, build


@dataclass(frozen=True)
class Freed:
    """A model in which parameters are decoupled from their formulas.

    Attributes:
        model: the compiled model.
        values: values for it by path: those given, and the results of the formulas.
        slopes: derivatives of the formulas, by (path of the formula's parameter, path of the independent one).
    """

    model: CompiledDae
    values: Mapping[str, Any]
    slopes: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def taken_along(self, names: Sequence[str]) -> Vector:
        """Return the derivatives of the parameters `names` by each other, shape (names, names)."""
        return np.array(
            [[float(row == column) + self.slopes.get((row, column), 0.0) for column in names] for row in names]
        )


def free_formulas(drive: Model, names: Sequence[str], values: Mapping[str, Any] | None = None) -> Freed:
    """Compile a drive so that the parameters `names` can change, including those with a formula.

    A parameter that equals another one is not decoupled, and a compiled model keeps all formulas.

    Args:
        drive: a component, a netlist file, or a compiled model.
        names: parameters and inputs by path.
        values: other values of parameters, as in `simulate`.
    """
    given = dict(values or {})
    if isinstance(drive, str | Path):
        from modelica_like.netlist import load

        drive = load(drive)
    model = build(drive)
    if isinstance(drive, CompiledDae):
        return Freed(model, given)
    bound = [name for name in names if name in model.derived_position and equal_to(model, name) is None]
    if not bound:
        return Freed(model, given)
    p = model.with_parameters(given).p
    rows = [model.derived_position[name] for name in bound]
    symbols = model.arguments["p"]
    formulas = ca.Function(
        "formulas", [symbols], [(f := model.equations.derived(symbols)[rows]), ca.jacobian(f, symbols)]
    )
    results, slopes = (np.asarray(formula.full()) for formula in formulas(p))
    return Freed(
        build(drive, free=bound),
        {**given, **{name: float(value) for name, value in zip(bound, results[:, 0], strict=True)}},
        {(bound[i], model.flat_parameters[j].path): float(slopes[i, j]) for i, j in np.argwhere(slopes)},
    )


def equal_to(model: CompiledDae, name: str) -> str | None:
    """Return the independent parameter that a derived one is equal to, if it is."""
    p = model.arguments["p"]
    formula, places = _formula(model, name)
    return model.flat_parameters[places[0]].path if len(places) == 1 and ca.is_equal(formula, p[places[0]]) else None


def bound_by_formula(model: CompiledDae, name: str) -> LanguageError:
    """Return the error about a parameter that cannot be decoupled from its formula."""
    names = ", ".join(model.flat_parameters[k].path for k in _formula(model, name)[1])
    return LanguageError(
        f"{name} follows from other parameters ({names})." if names else f"{name} is given by a formula of numbers.",
        advice=f"{'Ask for these, or p' if names else 'P'}ass the drive before it is compiled or run: "
        f"{name} is then decoupled from its formula.",
    )


def _formula(model: CompiledDae, name: str) -> tuple[Any, list[int]]:
    """The formula of a derived parameter, and positions of the independent ones in it."""
    p = model.arguments["p"]
    formula = model.equations.derived(p)[model.derived_position[name]]
    return formula, [k for k in range(len(model.p)) if ca.depends_on(formula, p[k])]
