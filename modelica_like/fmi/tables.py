"""The data of a model for C code: tapes, sparsity patterns, start values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.fmi.elimination import SURE, doubts_of, lu_pattern
from modelica_like.fmi.start_tables import StartTables, start_tables
from modelica_like.fmi.tape import ARGUMENTS, Slots, Tape, write_tapes
from modelica_like.solve.initialize import Point
from modelica_like.solve.initialize.singular import implicit_singular

Pattern = dict[str, tuple[int, ...]]
"""A square matrix by columns, with orderings and patterns of a QR factorization, by their names in model.h.

`colind`, `row`: its columns; `v_colind`, `v_row`: columns of the Householder vectors, in permuted rows; `r_colind`,
`r_row`: columns of R, the diagonal last; `row_place`: permuted position of every row; `column_order`: the matrix's
column at each permuted position.
"""


@dataclass(frozen=True)
class Tables:
    """The data of model.c.

    Attributes:
        step: pattern of M/(h gamma) - J.
        to_step: its positions of the nonzeros of the Jacobian; `diagonal`: of the diagonal of every state.
        lu: what `lu_pattern` says of it.
    """

    model: CompiledDae
    start: StartTables
    slots: Slots
    tapes: dict[str, Tape]
    step: Pattern
    to_step: tuple[int, ...]
    diagonal: tuple[int, ...]
    lu: Pattern
    start_pattern: Pattern

    @property
    def implicit_linear(self) -> bool:
        """Whether the implicit equations are linear in z."""
        return (
            self.model.equations.alg_jacobian.jac_sparsity(
                0, self.model.equations.alg_jacobian.name_in().index("z")
            ).nnz()
            == 0
        )

    @property
    def rates_depend_on_time(self) -> bool:
        """Whether time occurs in the right hand side itself."""
        return any(0 in operation[1:] for operation in self.tapes["rates"].operations)


def make_tables(model: CompiledDae, start: StartTables | None = None) -> Tables:
    """Write the functions of a model as tapes and analyse its sparsity.

    Args:
        model: the compiled model.
        start: its start tables, if known.

    Raises:
        MissingStart, ContradictingStart: the start values do not determine all states.
        LanguageError: a function has no counterpart in C.
        SingularAtStart: some implicit equations have no unique solution anywhere.
    """
    start = start or start_tables(model)
    functions, jacobian, start_pattern = _functions(model, start)
    states = len(model.states)
    diagonal = ca.Sparsity.triplet(*jacobian.shape, range(states), range(states))
    step = jacobian + diagonal
    if ca.sprank(ca.DM(step)) < step.size1():  # whatever the point
        raise implicit_singular(model, Point(0.0, *map(np.zeros, (states, len(model.implicit), model.discrete_size))))
    sizes = {name: model.equations.ode.size1_in(name) for name in ARGUMENTS[:-1]} | {
        "y": start.plan.system.function.size1_out(0)
    }
    slots, written = write_tapes(functions, sizes)
    tapes, to_step = {tape.name: tape for tape in written}, _places(jacobian, step)
    doubts = [SURE] * step.nnz()
    for place, doubt in zip(to_step, doubts_of(tapes["jacobian"], slots), strict=True):
        doubts[place] = doubt
    entries = list(zip(*step.get_triplet(), strict=True))
    return Tables(
        model, start, slots, tapes, qr_pattern(step), to_step, _places(diagonal, step),
        lu_pattern(entries, doubts, states), qr_pattern(start_pattern),
    )  # fmt: skip


def qr_pattern(pattern: Any) -> Pattern:
    """Analyse a square, structurally regular `casadi.Sparsity` (approximate minimum degree, then elimination tree)."""
    v, r, rows, columns = pattern.qr_sparse(True) if pattern.size1() else (pattern, pattern, (), ())
    tables: Pattern = {"row_place": tuple(rows), "column_order": tuple(columns)}
    for prefix, sparsity in (("", pattern), ("v_", v), ("r_", r)):
        tables |= {f"{prefix}colind": tuple(sparsity.colind()), f"{prefix}row": tuple(sparsity.row())}
    return tables


def _places(inner: Any, outer: Any) -> tuple[int, ...]:
    """Positions of the nonzeros of one pattern among those of a larger one."""
    place = {pair: k for k, pair in enumerate(zip(*outer.get_triplet(), strict=True))}
    return tuple(place[pair] for pair in zip(*inner.get_triplet(), strict=True))


def _functions(model: CompiledDae, start: StartTables) -> tuple[dict[str, Any], Any, Any]:
    """Return all functions by the names of their tapes, and the patterns of the Jacobians of rates and start system."""
    arguments = model.arguments
    symbols = list(arguments.values())
    rates = ca.vertcat(model.equations.ode(*symbols), model.equations.alg(*symbols))
    jacobian = ca.jacobian(rates, ca.vertcat(arguments["x"], arguments["z"]))
    alg_jacobian = ca.densify(model.equations.alg_jacobian(*symbols))
    guards = ca.vertcat(model.events.guards(*symbols), model.events.guard_rates(*symbols))
    written = {"rates": rates, "jacobian": _nonzeros(jacobian), "alg_jacobian": ca.vec(alg_jacobian), "guards": guards}
    functions: dict[str, Any] = {
        name: ca.Function(name, symbols, [ca.densify(ca.SX(expression))], list(arguments), [name])
        for name, expression in written.items()
    }
    plain = (
        "alg", "variables", "guards_soon", "moments", "resets", "updates", "start_conditions", "start_values",
        "discrete_starts", "determinants", "hold_terms", "derived", "delays",
    )  # fmt: skip
    functions |= {name: model.functions[name] for name in plain} | {"edges": model.edges.function}
    plan, system = start.plan, start.plan.system.function
    y = ca.SX.sym("y", system.size1_out(0))
    order = [y if name == "y" else arguments[name] for name in system.name_in()]
    _, start_jacobian, start_values = system(*order)
    chosen = start_jacobian[list(plan.wanted), list(plan.columns)] if plan.columns else ca.SX(0, 0)
    for name, expression in (("start_system", start_values), ("start_jacobian", _nonzeros(chosen))):
        functions[name] = ca.Function(name, [*symbols, y], [ca.densify(ca.SX(expression))], [*arguments, "y"], [name])
    return functions, jacobian.sparsity(), chosen.sparsity()


def _nonzeros(matrix: Any) -> Any:
    return ca.vertcat(*matrix.nonzeros()) if matrix.nnz() else ca.SX(0, 1)
