"""Global sensitivity: which parameters an output depends on over their whole ranges."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
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
_LEAST_SHARE = 0.5
"""Of the runs: with fewer, what is left is another question than the one asked."""
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
        if not isinstance(key, tuple) or len(key) != 3:
            raise UnknownName(
                f"This result has three names, of a measure, an output and a parameter, not {key!r}.",
                advice='Write result["S1", "…", "…"].',
            )
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
        ValueOutOfRange: there are no parameters or too few samples, or so many runs gave no number that the measures
            are not defined.
        MissingExtra: SALib is not installed.
    """
    if not ranges:
        raise ValueOutOfRange(
            "There is no parameter to rank.", advice='Give bounds by path: importance(…, {"shaft.c": (300, 500)}, …).'
        )
    if method not in get_args(Kind):
        raise UnknownName(f"There is no method '{method}'. There are sobol and morris.")
    if samples < _FEWEST:
        raise ValueOutOfRange(f"samples = {samples} must be at least {_FEWEST}: one sample has no scatter.")
    notices: list[str] = []
    failures: list[str] = []

    def runs(cube: Any) -> Any:
        results = sweep(drive, ranges, outputs, sampling=Samples(cube), **settings)
        notices.append(results.attrs["notice"])
        failures.extend(str(text) for text in results["failure"].to_numpy())
        return np.column_stack([results[name].to_numpy() for name in outputs])

    measures, count, notes = ranked(method, [*ranges], runs, outputs, seed, samples, failures)
    notice = "\n".join(filter(None, [*notices, *notes]))
    return Importance(method, tuple(ranges), tuple(outputs), measures, count, notice)


def ranked(
    method: Kind, names: Sequence[str], runs: Callable[[Any], Any], outputs: Sequence[str], seed: int,
    samples: int = 256, failures: Sequence[str] = (),
) -> tuple[dict[str, Any], int, list[str]]:  # fmt: skip
    """Return the measures of a method, the number of runs, and notes.

    Args:
        method: `sobol` or `morris`.
        names: of the parameters.
        runs: from points in [0, 1], shape (runs, parameters), to outputs, shape (runs, outputs).
        outputs: their names.
        seed: of the samples.
        samples: blocks of runs.
        failures: messages of runs, filled by `runs`.

    Raises:
        ValueOutOfRange: too many blocks have a run without a value.
    """
    sample, analyse = _salib(method)
    problem = {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
    settings = {"calc_second_order": False} if method == "sobol" else {"num_levels": _LEVELS}
    cube = sample.sample(problem, samples, **settings, seed=seed)
    values, measures, notes = runs(cube), dict[str, list[Any]](), list[str]()
    block = len(names) + (2 if method == "sobol" else 1)
    for name, column in zip(outputs, values.T, strict=True):
        kept = np.repeat(np.isfinite(column).reshape(-1, block).all(axis=1), block)
        notes += _without(name, column, kept, failures)
        for key, row in _measures(method, analyse, problem, cube[kept], column[kept], seed).items():
            measures.setdefault(key, []).append(row)
    return {key: np.array(rows) for key, rows in measures.items()}, len(cube), notes


def _without(name: str, column: Any, kept: Any, failures: Sequence[str]) -> Iterator[str]:
    """Tell what is left out: a run without a value takes those along with which it is compared."""
    bad = int(np.sum(~np.isfinite(column)))
    if not bad:
        return
    why = next((failure.splitlines()[0] for failure in failures if failure), "it does not happen there")
    if np.mean(kept) < _LEAST_SHARE:
        raise ValueOutOfRange(
            f"{name} has no value in {bad} of {len(column)} runs: {why}",
            advice="Narrow the ranges until most runs succeed.",
        )
    yield f"{name} has no value in {bad} of {len(column)} runs ({why}): {int(np.sum(~kept))} runs were left out."


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
    sample, analyse = (extra_module(f"SALib.{part}.{method}", "analyse") for part in ("sample", "analyze"))
    return sample, analyse
