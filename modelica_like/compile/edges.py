"""Edges: where the slope of the equations changes or jumps without an event, and phases, which repeat."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca

from modelica_like.compile.narrow import NARROW, Narrow
from modelica_like.language.elements import applied

PHASE_STEP = math.pi / 6
"""Largest advance of a phase in rad that an integrator may pass unseen: twelve looks show all humps of a wave."""

_DIFFERENCES = frozenset({ca.OP_LT, ca.OP_LE, ca.OP_FMIN, ca.OP_FMAX})
"""Their edge is left minus right operand; of `<` the other way round, so that its sign is positive where it is true."""
_OPERANDS = frozenset({ca.OP_FABS, ca.OP_SIGN, ca.OP_COPYSIGN})
_COUNTS = frozenset({ca.OP_FLOOR, ca.OP_CEIL})
_RATIOS = frozenset({ca.OP_FMOD, ca.OP_REMAINDER})
_EDGES = _DIFFERENCES | _OPERANDS | _COUNTS | _RATIOS | {ca.OP_ATAN2}
_FLAT = 3.0
"""Slope of the second line on which the edge of an angle is zero: one that few angles reach, and where none rests."""
_WAVES = frozenset({ca.OP_SIN, ca.OP_COS, ca.OP_TAN})


@dataclass(frozen=True)
class Edges:
    """What an integrator must not step over.

    Attributes:
        function: of (t, x, z, p, u, d); edges, which are zero where a slope of the equations or guards may change or
            jump, then phases, over `PHASE_STEP`.
        count: number of edges.
        slopes: how many of them, the first ones, are edges of the equations; the others are of guards.
        kinks: how many of these, the first ones, are not of smooth functions.
        phases: number of phases.
        in_time: kinks of the equations depend on time.
    """

    function: ca.Function
    count: int
    slopes: int
    kinks: int
    phases: int
    in_time: bool


def find_edges(
    arguments: dict[str, Any], ode: ca.Function, alg: ca.Function, guards: ca.Function, integrands: Any = None
) -> Edges:
    """Collect edges of equations and guards, and phases of edges and guards, from the expression graph.

    Args:
        arguments: symbols t, x, z, p, u, d.
        ode: derivatives of the states.
        alg: residuals of the implicit equations.
        guards: of the state events.
        integrands: what a run integrates besides, an SX column, whose edges are found as those of the equations.
    """
    given = list(arguments.values())
    rates = ode(*given)
    equations = ca.vertcat(rates, alg(*given), ca.SX(0, 1) if integrands is None else integrands)
    kinks, of_guards = (kinks_of(arguments, expressions) for expressions in (equations, guards(*given)))
    edges = kinks + _of_smooth(arguments, rates, equations) + of_guards
    slopes = len(edges) - len(of_guards)
    waves = _operations(arguments, ca.vertcat(*edges, guards(*given)), _WAVES)
    phases = _different([phase for _, (phase, *_) in waves])
    result = ca.densify(ca.vertcat(ca.SX(0, 1), *edges, *(phase / PHASE_STEP for phase in phases)))
    function = ca.Function("edges", list(arguments.values()), [result], list(arguments), ["edges"])
    in_time = ca.depends_on(ca.vertcat(ca.SX(0, 1), *kinks), arguments["t"])
    return Edges(function, len(edges), slopes, len(kinks), len(phases), in_time)


def edges_of(arguments: dict[str, Any], rates: Any, expressions: Any) -> list[Any]:
    """Return what is zero where expressions change their slope, or do so within a narrow space.

    Args:
        arguments: symbols t, x, z, p, u, d.
        rates: of the states, column (nx).
        expressions: an SX column.
    """
    return kinks_of(arguments, expressions) + _of_smooth(arguments, rates, expressions)


def _of_smooth(arguments: dict[str, Any], rates: Any, expressions: Any) -> list[Any]:
    return _different([*Narrow(arguments, rates).edges(_operations(arguments, expressions, NARROW))])


def kinks_of(arguments: dict[str, Any], expressions: Any) -> list[Any]:
    """Return what is zero where the slope of expressions may change or jump while time, states and unknowns move."""
    return _different([_edge(*pair) for pair in _operations(arguments, expressions, _EDGES) if not _never_turns(*pair)])


def _never_turns(code: int, operands: list[Any]) -> bool:
    """Whether this is an angle, of less than a quarter turn."""
    return code == ca.OP_ATAN2 and operands[1].is_constant() and float(operands[1]) > 0.0


def _edge(code: int, operands: list[Any]) -> Any:
    if code in _DIFFERENCES:
        left, right = operands
        return right - left if code == ca.OP_LT else left - right
    if code in _OPERANDS:
        return operands[-1]
    if code == ca.OP_ATAN2:
        # An angle jumps by a turn where the ordinate passes zero with a negative abscissa. Every edge is zero on one
        # more line, because a turn crosses it an even number of times: not where the angle is zero, at which many rest.
        ordinate, abscissa = operands
        return ordinate + _FLAT * ca.fmax(abscissa, 0.0)
    return ca.sin(math.pi * (operands[0] / operands[1] if code in _RATIOS else operands[0]))


def _different(expressions: list[Any]) -> list[Any]:
    if not expressions:
        return []
    column = ca.cse(ca.vertcat(*expressions))
    return list({expression.element_hash(): expression for expression in ca.vertsplit(column)}.values())


def _operations(arguments: dict[str, Any], expressions: Any, codes: frozenset[int]) -> Iterator[tuple[int, list[Any]]]:
    """Yield operations whose operands move with time, states or implicit unknowns."""
    function = ca.Function("all", list(arguments.values()), [ca.densify(expressions)])
    count, code = function.n_instructions(), function.instruction_id
    if not any(code(k) in codes for k in range(count)):
        return
    held, moves, symbols = dict[int, Any](), dict[int, bool](), [ca.vertsplit(symbol) for symbol in arguments.values()]
    for k in range(count):
        if (kind := code(k)) == ca.OP_OUTPUT:
            continue
        (place,), reads = function.instruction_output(k), function.instruction_input(k)
        if kind == ca.OP_CONST:
            held[place], moves[place] = ca.SX(function.instruction_constant(k)), False
        elif kind == ca.OP_INPUT:
            held[place], moves[place] = symbols[reads[0]][reads[1]], reads[0] < _FIXED
        else:
            operands = [held[read] for read in reads]
            moving = any(moves[read] for read in reads)
            if moving and kind in codes:
                yield kind, operands
            held[place] = applied(kind, operands, function)
            moves[place] = moving


_FIXED = 3
"""Number of arguments that move: t, x, z."""
