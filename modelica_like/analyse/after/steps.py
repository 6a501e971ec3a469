"""Step responses in numbers: rise, overshoot, settling."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from modelica_like.arguments import checked
from modelica_like.errors import ValueOutOfRange
from modelica_like.runs.results import along
from modelica_like.runs.trajectories import Trajectories

_ROUNDING = 1e-9


@dataclass(frozen=True)
class StepMetrics:
    """How a variable gets from one value to another; times count from the step.

    Attributes:
        name: path of the variable.
        begin: value at the step.
        end: value that it settles at.
        rise_time: from 10 % to 90 % of the way, in s.
        overshoot: how far it goes beyond its end, over the way.
        peak_time: when it is farthest on its way, in s.
        settling_time: after which it keeps within the band around its end, in s.
        band: half of the band over the way.
    """

    name: str
    begin: float
    end: float
    rise_time: float
    overshoot: float
    peak_time: float
    settling_time: float
    band: float

    def __str__(self) -> str:
        over = f"overshoot {100 * self.overshoot:.3g} % at {self.peak_time:.4g} s" if self.overshoot else "no overshoot"
        settled = f"within {100 * self.band:g} % after {self.settling_time:.4g} s"
        return f"{self.name}: {self.begin:.5g} to {self.end:.5g}, rise {self.rise_time:.4g} s, {over}, {settled}"


@checked
def step_metrics(
    run: Trajectories, variable: str, *, start: float = 0.0, until: float = np.inf, end: float | None = None,
    band: float = 0.02,
) -> StepMetrics:  # fmt: skip
    """Measure a step response; the results have no influence. A measured table is straight lines between its rows.

    Args:
        run: a run.
        variable: path of what responds.
        start: time of the step in s.
        until: time after which the run does not count.
        end: value that it settles at; by default its last one.
        band: half of the band in which it has settled, over the way from begin to end.

    Raises:
        ValueOutOfRange: it goes nowhere, does not get there, or does not settle.
        UnknownName: there is no such variable.
        MissingValue: the run has not kept what happens between its results.
    """
    curve = along(run, run.path(variable))[0].within(start, until)
    if not len(curve.begins):
        raise ValueOutOfRange(f"The run has no results between {start:g} s and {until:g} s.")
    values = curve.values[0]
    begin = float(values[0, 0])
    way = (float(values[-1, -1]) if end is None else end) - begin
    if not way:
        raise ValueOutOfRange(f"{variable} ends where it begins, at {begin:g}: this is no step response.")
    share = (values - begin) / way
    above = replace(curve, values=np.array([share - 0.1, share - 0.9, share - 1 - band, 1 - band - share]))
    outside = np.nanmax([above.last(2), above.last(3), start])
    if outside >= curve.ends[-1]:
        raise ValueOutOfRange(f"{variable} does not settle within {100 * band:g} % of its way.")
    reached = [above.first(0), above.first(1)]
    for level, moment in zip((0.1, 0.9), reached, strict=True):
        if np.isnan(moment):
            raise ValueOutOfRange(f"{variable} does not get {100 * level:g} % of its way to {begin + way:g}.")
    over, peak = replace(curve, values=share[None] - 1).largest(0)
    return StepMetrics(
        run.path(variable), begin, begin + way, reached[1] - reached[0], over if over > _ROUNDING else 0.0,
        peak - start, float(outside) - start, band,
    )  # fmt: skip
