"""Global sensitivity: which parameters an output depends on over their whole ranges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from modelica_like.analyse.sweeps.plan import Samples
from modelica_like.analyse.sweeps.sweep import sweep
from modelica_like.arguments import checked
from modelica_like.errors import UnknownName, ValueOutOfRange, extra_module
from modelica_like.simulation import Model

Kind = Literal["sobol", "morris"]
_LEVELS = 4
_CONSTANT = 1e-9
_FEWEST = 2
"""Samples from which there is a scatter."""


@dataclass(frozen=True, eq=False)
class Importance:
    """How much each parameter matters for each output.

    Attributes:
        method: `sobol` or `morris`.
        parameters: paths.
        outputs: names.
        measures: by name, shape (outputs, parameters): Sobol's first-order (`S1`) and total (`ST`) indices, shares of
            the variance; Morris's mean absolute (`mu_star`) and scatter (`sigma`) of elementary effects, in the unit
            of the output for the whole range of the parameter. Each with its 95 % half width (`S1_conf`, ...).
        runs: number of simulations.
        notice: that of the sweep: runs in which IDAS differs, or that were left to it.
    """

    method: Kind
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]
    measures: dict[str, Any] = field(repr=False)
    runs: int
    notice: str = ""

    def __getitem__(self, key: tuple[str, str, str]) -> float:
        """Return a measure: `importance["S1", "table.s", "gear.ratio"]`."""
        measure, output, parameter = key
        for name, labels in ((measure, self.measures), (output, self.outputs), (parameter, self.parameters)):
            if name not in labels:
                raise UnknownName(f"There is no '{name}' in this result: {', '.join(labels)}.")
        return float(self.measures[measure][self.outputs.index(output), self.parameters.index(parameter)])

    def __str__(self) -> str:
        first = next(iter(self.measures))
        lines = [f"{self.method.capitalize()} analysis of {self.runs} runs"]
        names = [name for name in self.measures if not name.endswith("_conf")]
        for row, output in enumerate(self.outputs):
            lines.append(f"  {output}")
            for column in np.argsort(-np.abs(self.measures[names[-1] if self.method == "sobol" else first][row])):
                shown = ", ".join(f"{name} {self.measures[name][row, column]:.4g}" for name in names)
                lines.append(f"    {self.parameters[column]}: {shown}")
        return "\n".join([*lines, *filter(None, [self.notice])])


@checked
def importance(
    drive: Model, ranges: Mapping[str, tuple[Any, Any]], outputs: Sequence[str], *, method: Kind = "sobol",
    samples: int = 256, seed: int = 0, **settings: Any,
) -> Importance:  # fmt: skip
    """Rank parameters by the variance they cause (Sobol) or by elementary effects (Morris).

    Args:
        drive: a component, a netlist file or a compiled model.
        ranges: path of each parameter with its lower and upper bound; equally likely in between.
        outputs: as in `sweep`.
        method: `sobol` (A. Saltelli et al., 2010) takes samples·(parameters + 2) runs, `morris` (M. D. Morris, 1991)
            samples·(parameters + 1).
        samples: at least 2; a power of two for Sobol.
        seed: of the random numbers.
        settings: further arguments of `sweep`: processes, scheduler, checkpoint, until, ...

    Raises:
        UnknownName: a name is not known.
        ValueOutOfRange: there are no parameters or too few samples, or runs failed or gave no number, so the measures
            are not defined.
        MissingExtra: SALib is not installed.
    """
    if not ranges:
        raise ValueOutOfRange(
            "There is no parameter to rank.", advice='Give bounds by path: importance(…, {"shaft.c": (300, 500)}, …).'
        )
    if samples < _FEWEST:
        raise ValueOutOfRange(f"samples = {samples} must be at least {_FEWEST}: one sample has no scatter.")
    sample, analyse = _salib(method)
    problem = {"num_vars": len(ranges), "names": list(ranges), "bounds": [[0.0, 1.0]] * len(ranges)}
    if method == "sobol":
        cube = sample.sample(problem, samples, calc_second_order=False, seed=seed)
    else:
        cube = sample.sample(problem, samples, num_levels=_LEVELS, seed=seed)
    results = sweep(drive, ranges, outputs, sampling=Samples(cube), **settings)
    columns = [results[name].to_numpy() for name in outputs]
    for name, column in zip(outputs, columns, strict=True):
        _check_numbers(name, column, [str(text) for text in results["failure"].to_numpy()])
    measures: dict[str, list[Any]] = {}
    for column in columns:
        for key, values in _measures(method, analyse, problem, cube, column, seed).items():
            measures.setdefault(key, []).append(values)
    arrays = {key: np.array(rows) for key, rows in measures.items()}
    return Importance(method, tuple(ranges), tuple(outputs), arrays, len(cube), results.attrs["notice"])


def _check_numbers(name: str, column: Any, failures: Sequence[str]) -> None:
    bad = int(np.sum(~np.isfinite(column)))
    if bad:
        why = next((failure.splitlines()[0] for failure in failures if failure), "it does not happen there")
        raise ValueOutOfRange(
            f"{name} has no value in {bad} of {len(column)} runs: {why}",
            advice="Narrow the ranges until all runs succeed.",
        )


def _measures(method: Kind, analyse: Any, problem: dict[str, Any], cube: Any, column: Any, seed: int) -> dict[str, Any]:
    wanted = ("S1", "ST", "S1_conf", "ST_conf") if method == "sobol" else ("mu_star", "sigma", "mu_star_conf")
    if np.ptp(column) <= _CONSTANT * np.abs(column).max():
        # The output depends on nothing: its variance is rounding.
        return {key: np.zeros(problem["num_vars"]) for key in wanted}
    if method == "sobol":
        measures = analyse.analyze(problem, column, calc_second_order=False, seed=seed)
    else:
        measures = analyse.analyze(problem, cube, column, num_levels=_LEVELS, seed=seed)
    return {key: np.asarray(measures[key], float) for key in wanted}


def _salib(method: str) -> tuple[Any, Any]:
    if method not in get_args(Kind):
        raise UnknownName(f"There is no method '{method}'. There are sobol and morris.")
    sample, analyse = (extra_module(f"SALib.{part}.{method}", "analyse") for part in ("sample", "analyze"))
    return sample, analyse
