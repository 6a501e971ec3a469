"""Exact sensitivities of a run, through its events."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np

from modelica_like.analyse.replay.chain import Reading, Replay
from modelica_like.analyse.replay.edges import Edge, edges
from modelica_like.analyse.replay.make import replay
from modelica_like.analyse.replay.tolerances import Tolerances
from modelica_like.analyse.sensitivity.at_instants import at_instants
from modelica_like.analyse.sensitivity.at_kinks import Candidate, Sides, kinks, natural_size
from modelica_like.analyse.sensitivity.by_run_time import differentiated_run, mode_sequence, tightened
from modelica_like.analyse.sensitivity.formulas import Freed, bound_by_formula, equal_to, free_formulas
from modelica_like.analyse.sensitivity.of_formulas import formula_kinks, formulas
from modelica_like.analyse.sensitivity.replayed import read_off
from modelica_like.analyse.sensitivity.result import Quantity
from modelica_like.analyse.sensitivity.result import Sensitivities as Sensitivities
from modelica_like.analyse.sensitivity.values import value_at
from modelica_like.arguments import checked
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import LanguageError, NoGradient, UnknownName, did_you_mean
from modelica_like.options import Options
from modelica_like.runs.readings import Output, is_series, leaves, listed, quadratures, read_output
from modelica_like.runs.solution import Solution
from modelica_like.simulation import Model, quick_run
from modelica_like.solve.initialize import StartKind

Method = Literal["auto", "forward", "adjoint"]
_NOTHING = 1e-9
"""Share of the largest amount below which an extreme is zero up to rounding."""
_NAMED = 3
"""Largest number of parameters in an error message."""


@checked
def sensitivities(
    drive: Model | Solution, of: str | Sequence[str], to: str | Sequence[str] = (), *, until: float | str | None = None,
    parameters: Mapping[str, Any] | None = None, method: Method = "auto", start: StartKind | None = None,
    options: Options | None = None, precision: float = 1e-8,
) -> Sensitivities:  # fmt: skip
    """Differentiate outputs of a run by parameters and inputs; exact through mode changes and resets.

    Args:
        drive: a component, a netlist file, a compiled model, or a run.
        of: final values (`table.s`), `max(shaft.tau)`, `min(…)`, `at(table.s, 0.3 s)`, `integral(…)`, `series(…)`; of
            components `clutch.loss_energy`, `source_energy`, `lock_time`, `unlock_time`; times of mode changes
            `time(clutch.mode: forward -> stuck)`, the second one with `, 2`.
        to: parameters and inputs; by default all that can change and have a derivative (`left_out` has the others).
            Parameters with a formula are decoupled from it, but still follow it where other parameters change.
        until: end time, as in `simulate`.
        parameters: other values of parameters, as in `simulate`.
        method: `auto`: back along a native run, and a replay where that does not tell. `forward` (cost grows with the
            parameters) and `adjoint` (with the outputs) are those of the replay.
        start: kind of start, as in `simulate`; by default, that of the run or of the netlist.
        options: as in `simulate`.
        precision: relative tolerance of the steps of the replay.

    Raises:
        NoGradient: a derivative does not exist; the message says at which event, and by what.
        UnknownName: an output, a parameter or the method does not exist.
        ValueOutOfRange: there is no output, or the precision is out of range.
        LanguageError: a parameter follows from others, and the drive is already compiled.
        ModelicaLikeError: the simulation is not possible.
    """
    of, to = listed(of, "output to differentiate"), listed(to, "parameter") if to else []
    _check(method, precision)
    if isinstance(drive, Solution):
        freed, solution = Freed(drive.model, {}), drive
    else:
        freed = free_formulas(drive, to, parameters)
        settings = {"parameters": freed.values, "start": start, "options": options}
        solution = quick_run(freed.model, until, **settings, readings=[name for name in of if not is_series(name)])
    start = start or solution.start
    outputs = [read_output(solution.model, name) for name in of]
    chosen = chosen_parameters(solution.model, to)
    result = None
    if method == "auto" and not any(output.kind == "series" for output in outputs):
        result = _along_the_run(solution, outputs, chosen, freed, start, precision)
    certain = [] if result is None else np.flatnonzero(np.isfinite(result.derivatives).all(axis=0)).tolist()
    others = [pair for k, pair in enumerate(chosen) if k not in certain]
    tell = partial(replayed, solution, outputs, start=start, precision=precision, named=bool(to))
    if result is None or not certain:
        return tell(chosen, method, freed)
    return _joined(result, certain, tell(others, method, alone=False)) if others else result


def _check(method: str, precision: float) -> None:
    if method not in get_args(Method):
        raise UnknownName(
            f"There is no method '{method}'{did_you_mean(method, get_args(Method)) or '.'}",
            advice="The methods are forward, adjoint and auto (the cheaper of both).",
        )
    Tolerances(precision)  # refuses what is out of range


def replayed(
    solution: Solution, outputs: list[Output], chosen: list[tuple[int, Quantity]], method: Method = "auto",
    freed: Freed | None = None, *, start: StartKind | None, precision: float, named: bool, alone: bool = True,
) -> Sensitivities:  # fmt: skip
    """Differentiate by a replay, for which see `sensitivities`.

    Args:
        solution: the run.
        outputs: what is differentiated.
        chosen: by what, as `chosen_parameters` returns it.
        method: as in `sensitivities`.
        freed: slopes of formulas.
        start: kind of start; by default that of the run.
        precision: relative tolerance of the steps.
        named: parameters without a derivative are refused, and not left out.
        alone: there are no derivatives by anything else.

    Raises:
        NoGradient: a derivative does not exist.
    """
    column, name = quadratures(solution.model, outputs)
    moments = [output.moment for output in outputs if output.kind == "at"]
    stops = [*moments, *solution.time] if any(output.kind == "series" for output in outputs) else moments
    chain = replay(solution, column, name, start=start, stops=stops, tolerances=Tolerances(precision))
    freed = freed or Freed(solution.model, {})
    return _differentiate(solution, chain, outputs, chosen, method, freed, named=named, alone=alone)


def _joined(result: Sensitivities, certain: list[int], others: Sensitivities) -> Sensitivities:
    """Put the replay's derivatives and reasons in the places of those that the run-time does not have."""
    told = {quantity.name: k for k, quantity in enumerate(others.parameters)}
    columns, kept = list[Vector](), list[Quantity]()
    for k, quantity in enumerate(result.parameters):
        if k in certain or quantity.name in told:
            kept.append(quantity)
            columns.append(result.derivatives[:, k] if k in certain else others.derivatives[:, told[quantity.name]])
    remarks = tuple(dict.fromkeys((*result.remarks, *others.remarks)))
    return replace(
        result, parameters=tuple(kept), derivatives=np.array(columns).T, left_out=others.left_out, remarks=remarks
    )


def _along_the_run(
    solution: Solution, outputs: list[Output], chosen: list[tuple[int, Quantity]], freed: Freed,
    start: StartKind | None, precision: float,
) -> Sensitivities | None:  # fmt: skip
    """Differentiate by the adjoint of the run-time; None where the replay has to tell."""
    model, names = solution.model, [quantity.name for _, quantity in chosen]
    if solution.time[0] or solution.ended is not None or not names:
        return None
    options = tightened(solution.options, precision)
    kind = start or solution.start
    result = differentiated_run(model, float(solution.time[-1]), options, kind, outputs, names)
    if result is None or mode_sequence(result.solution.events) != mode_sequence(solution.events):
        return None
    values = _finite(solution, outputs)
    derivatives = result.derivatives
    if freed.slopes:
        if not np.all(np.isfinite(derivatives)):
            return None
        derivatives = derivatives @ freed.taken_along(names)
    named = zip(outputs, values, strict=True)
    return Sensitivities(
        model.name, tuple(Quantity(output.name, float(value), output.unit) for output, value in named),
        tuple(quantity for _, quantity in chosen), derivatives, "adjoint",
        remarks=tuple(_of_rounding(solution, outputs, values)),
    )  # fmt: skip


def chosen_parameters(model: CompiledDae, names: Sequence[str]) -> list[tuple[int, Quantity]]:
    """Return positions in (p, u) of parameters and inputs, and what they are.

    Raises:
        UnknownName: there is no such parameter.
        LanguageError: it follows from others, or cannot change.
    """
    values = np.concatenate([model.p, model.u])
    position = model.fixed_position
    fixed = {parameter.path for parameter in model.flat_parameters if not parameter.tunable}
    quantities: list[tuple[int, Quantity]] = []
    for name in names or [name for name in position if name not in fixed]:
        if name in model.derived_position:
            equal = equal_to(model, name)
            if equal is None:
                raise bound_by_formula(model, name)
            name = equal
        if name not in position:
            near = did_you_mean(name, [*position, *model.derived_position])
            raise UnknownName(f"{model.name} has no parameter '{name}'{near or '.'}")
        if name in fixed:
            raise LanguageError(
                f"{name} cannot change after compilation, so there are no derivatives with respect to it.",
                advice="Compare runs of models that were built with other values.",
            )
        k = position[name]
        quantities.append((k, Quantity(name, float(values[k]), model.units[name])))
    return quantities


def _differentiate(
    solution: Solution, chain: Replay, outputs: list[Output], chosen: list[tuple[int, Quantity]], method: Method,
    freed: Freed, *, named: bool, alone: bool = True,
) -> Sensitivities:  # fmt: skip
    """Differentiate by a replay; `alone`: there are no derivatives by anything else."""
    plain = [output for output in outputs if output.kind != "series"]
    series = [output for output in outputs if output.kind == "series"]
    nodes = [*chain.nodes] if series else []
    parts = leaves(plain)
    of_parts = read_off(solution, chain, parts)
    readings = formulas(plain, of_parts)
    values = _finite(solution, plain)
    over_time = [value_at(chain, output.path, node) for output in series for node in nodes]
    on_edge = [*edges(chain, of_parts), *at_instants(chain, of_parts, parts), *formula_kinks(plain, of_parts)]
    at_kink = kinks(chain, outputs)
    total = [*readings, *over_time, *(edge.reading for edge in (*on_edge, *at_kink))]
    positions = [k for k, _ in chosen]
    # A column costs about the same in both directions.
    way = method if method != "auto" else "adjoint" if len(total) < len(chosen) else "forward"
    derivatives = _derivatives(chain, total, positions, way)
    # Without `to`, the other parameters still get their derivatives.
    if series:
        # Somewhere along the run everything is felt.
        on_edge = [replace(edge, matters=lambda: True) for edge in on_edge]
    of_outputs, of_edges, of_kinks = np.split(derivatives, np.cumsum([len(readings) + len(over_time), len(on_edge)]))
    kept, left_out = _by_existence(on_edge, of_edges, [quantity for _, quantity in chosen], named, alone)
    ends = [*range(len(plain)), *(len(plain) - 1 + len(nodes) * k for k in range(1, len(series) + 1))]
    sides = Sides(solution, [*plain, *series], [total[k] for k in ends])
    candidates = dict[Candidate, int]()
    for k in [k for k in kept if np.any(of_kinks[:, k])]:
        size = abs(chosen[k][1].value) or natural_size(chain, outputs, positions[k])
        if np.isfinite(size) and _at_a_kink(at_kink, of_kinks[:, k] * size):
            candidates[Candidate(chosen[k][1], size, of_outputs[ends, k])] = k
    kept, left_at_kinks = _by_sides(sides, candidates, kept, named, alone)
    derivatives, chosen = of_outputs[:, kept], [chosen[k] for k in kept]
    if freed.slopes:
        derivatives = derivatives @ freed.taken_along([quantity.name for _, quantity in chosen])
    rows = derivatives[len(plain) :].reshape(len(series), len(nodes), len(chosen))
    return Sensitivities(
        chain.model.name,
        tuple(Quantity(output.name, float(value), output.unit) for output, value in zip(plain, values, strict=True)),
        tuple(quantity for _, quantity in chosen),
        derivatives[: len(plain)],
        way,
        np.array([node.t for node in nodes]),
        {output.name: table for output, table in zip(series, rows, strict=True)},
        left_out | left_at_kinks,
        (*_of_rounding(solution, plain, values), *sides.remark([*candidates])),
    )


def _finite(solution: Solution, outputs: Sequence[Output]) -> list[float]:
    """Return the values: the same name has the same number everywhere, though the replay is more precise."""
    values = solution.read(*(output.name for output in outputs))
    for output, value in zip(outputs, values, strict=True):
        if not np.isfinite(value):
            raise NoGradient(f"{output.name} is {value:g}: what is not finite has no derivative.")
    return values


def _derivatives(chain: Replay, readings: Sequence[Reading], positions: Sequence[int], way: Method) -> Vector:
    """Return the derivatives of readings by parameters at positions in (p, u)."""
    if way == "adjoint":
        return chain.adjoint(readings)[:, positions]
    directions = np.zeros((len(chain.model.fixed_position), len(positions)))
    directions[positions, np.arange(len(positions))] = 1.0
    return chain.forward(readings, directions)


def _by_sides(
    sides: Sides, candidates: dict[Candidate, int], kept: list[int], named: bool, alone: bool
) -> tuple[list[int], dict[str, str]]:
    """Positions of the parameters whose derivatives are the same on both sides; names and reasons of the others."""
    left_out: dict[str, str] = {}
    for candidate in sides.suspects([*candidates]):
        error = sides.error(candidate)
        if error is not None and (named or (alone and len(kept) == 1)):
            raise error
        if error is not None:
            kept = [k for k in kept if k != candidates[candidate]]
            left_out[candidate.by.name] = f"{error.what} {error.why}"
    return kept, left_out


def _of_rounding(solution: Solution, outputs: Sequence[Output], values: Sequence[float]) -> Iterator[str]:
    """Tell which extremes are rounding beside those of the other sign, and so are their derivatives."""
    for output, value in zip(outputs, values, strict=True):
        if output.kind in ("max", "min") and solution.dense is not None:
            (largest,) = solution.read(f"peak({output.path})")
            if abs(value) <= _NOTHING * largest:
                yield (
                    f"{output.name} is zero up to rounding, and so are its derivatives: {output.path} has the other "
                    f"sign, up to {largest * largest.sign:.6g} {largest.unit}. Ask for peak({output.path}), the "
                    "largest amount."
                )


def _at_a_kink(at_kink: list[Edge], changes: Vector) -> bool:
    """Whether changes of what is zero lead off a kink."""
    return any(edge.moved_by(np.abs(change)) for edge, change in zip(at_kink, changes, strict=True))


def _by_existence(
    on_edge: list[Edge], derivatives: Vector, chosen: list[Quantity], named: bool, alone: bool
) -> tuple[list[int], dict[str, str]]:
    """Positions of the parameters with derivatives; names and reasons of the others."""
    weights = [abs(quantity.value) or 1.0 for quantity in chosen]
    reasons: dict[str, str] = {}
    for edge, row in zip(on_edge, derivatives, strict=True):
        moving = [chosen[k].name for k in np.flatnonzero(edge.moved_by(np.abs(row) * weights))]
        error = edge.error
        if not moving or not edge.matters():
            continue
        if named or (alone and len(reasons.keys() | moving) == len(chosen)):
            raise NoGradient(
                error.what, where=error.where, why=error.why,
                advice=f"Leave out {' and '.join(moving[:_NAMED])}, or {error.advice[0].lower()}{error.advice[1:]}",
            )  # fmt: skip
        reasons |= dict.fromkeys(moving, error.what)
    return [k for k, quantity in enumerate(chosen) if quantity.name not in reasons], reasons
