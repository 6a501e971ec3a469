"""Where the energy went: power in = change of stored energy + losses, for every component."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import redirect_stderr
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import StepFailed
from modelica_like.initialize import Point
from modelica_like.solve.idas import scaled_problem
from modelica_like.solve.recorder import Segment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RTOL = 1e-9
_ATOL = 1e-11
_POWERS = 4
"""Columns of the energy terms that are integrated: loss, source, inflow, rate of the stored energy."""


@dataclass(frozen=True)
class EnergyRow:
    """Energies of one component over a run, in J.

    Attributes:
        component: path; empty for the model itself.
        inflow: through its connectors.
        source: brought in from outside the model.
        stored: change of its stored energy.
        lost: dissipated.
        at_events: part of `stored` that changed at once, in resets at events.
        residual: integral of power in + source power - loss - rate of the stored energy; zero if the component's
            equations keep the balance, whatever the precision of the integration.
        drift: what the stored energy changed in excess of the integral of its rate: the integration error.
    """

    component: str
    inflow: float
    source: float
    stored: float
    lost: float
    at_events: float
    residual: float
    drift: float


@dataclass(frozen=True)
class EnergyBalance:
    """Energy balance of a run, component by component.

    Attributes:
        rows: one per component.
        throughput: largest of: energy exchanged, brought in, dissipated, stored.
    """

    rows: tuple[EnergyRow, ...]
    throughput: float

    def __getitem__(self, component: str) -> EnergyRow:
        return next(row for row in self.rows if row.component == component)

    def __iter__(self) -> Iterator[EnergyRow]:
        return iter(self.rows)

    @property
    def source(self) -> float:
        """Energy brought in from outside, J."""
        return sum(row.source for row in self.rows)

    @property
    def stored(self) -> float:
        """Change of the stored energy, J."""
        return sum(row.stored for row in self.rows)

    @property
    def lost(self) -> float:
        """Dissipated energy, J."""
        return sum(row.lost for row in self.rows)

    @property
    def delivered(self) -> float:
        """Energy that loads took away, J."""
        return -sum(row.source for row in self.rows if row.source < 0)

    @property
    def efficiency(self) -> float:
        """Energy that loads took away over that which sources and stores gave; nan where nothing gave any."""
        given = sum(max(row.source, 0.0) for row in self.rows) + max(-self.stored, 0.0)
        return self.delivered / given if given else float("nan")

    def sankey(self, title: str = "") -> Figure:
        """Draw where the energy came from and where it went."""
        from modelica_like.solve.sankey import sankey

        return sankey(self, title)

    @property
    def closure(self) -> float:
        """Largest residual of a component, and of all connections together, relative to the throughput."""
        residuals = [abs(row.residual) for row in self.rows]
        exchanged = abs(sum(row.inflow for row in self.rows))
        return max([*residuals, exchanged], default=0.0) / (self.throughput or 1.0)

    @property
    def drift(self) -> float:
        """Largest integration error of a stored energy, relative to the throughput."""
        return max((abs(row.drift) for row in self.rows), default=0.0) / (self.throughput or 1.0)

    def __str__(self) -> str:
        width = max([len("component"), *(len(row.component) for row in self.rows)])
        head = f"{'component':{width}}  {'in / J':>12}  {'source / J':>12}  {'stored / J':>12}  {'lost / J':>12}"
        lines = [
            f"{row.component:{width}}  {row.inflow:12.6g}  {row.source:12.6g}  {row.stored:12.6g}  {row.lost:12.6g}"
            for row in self.rows
            if any((row.inflow, row.source, row.stored, row.lost))
        ]
        total = f"{'total':{width}}  {'':12}  {self.source:12.6g}  {self.stored:12.6g}  {self.lost:12.6g}"
        return "\n".join(
            [
                head,
                *lines,
                total,
                f"closes to {self.closure:.1e} of {self.throughput:.6g} J (integration error {self.drift:.1e})",
            ]
        )


def energy_balance(model: CompiledDae, segments: tuple[Segment, ...]) -> EnergyBalance:
    """Integrate the energy terms of every component along a run.

    Each segment is integrated again from its beginning, with the powers as quadratures.
    """
    count = len(model.components)
    lost, source, inflow, rate, moved, jumps = (np.zeros(count) for _ in range(6))
    largest, last = 0.0, None
    for segment in segments:
        before = _stored(model, segment.start)
        largest = max(largest, float(np.sum(np.abs(before))))
        if last is not None:
            jumps += before - last
        powers, end = _integrate(model, segment)
        for total, part in zip((lost, source, inflow, rate), powers, strict=True):
            total += part
        moved += _stored(model, end) - before
        # The next segment begins where the run went on, not where this integration ended.
        last = _stored(model, segment.point(-1))
    residual = inflow + source - lost - rate
    columns = inflow, source, moved + jumps, lost, jumps, residual, moved - rate
    rows = tuple(EnergyRow(path, *map(float, values)) for path, *values in zip(model.components, *columns, strict=True))
    throughput = max(largest, *(float(np.sum(np.abs(part))) for part in (inflow, source, lost)))
    return EnergyBalance(rows, throughput)


def _stored(model: CompiledDae, point: Point) -> Vector:
    return np.array(model.energy(point.t, point.x, point.z, model.p, model.u, point.d))[:, 0]


def _integrate(model: CompiledDae, segment: Segment) -> tuple[Vector, Point]:
    """Return the integrals of loss, source power, inflow and rate of all components, and the end.

    Raises:
        StepFailed: IDAS gave up.
    """
    span = float(segment.times[-1] - segment.times[0])
    start, end = segment.start, segment.point(-1)
    if span <= 0.0:
        return np.zeros((_POWERS, len(model.components))), end
    if not model.states:
        return _trapezoids(model, segment), end
    p = np.concatenate([[start.t, span], model.p, model.u, segment.d])
    try:
        # IDAS also prints what went wrong; the error says it.
        with redirect_stderr(io.StringIO()):
            integrator, kept = _integrator(model)
            result = integrator(x0=np.append(start.x, 0.0), z0=start.z, p=p)
    except RuntimeError:
        raise StepFailed(
            f"The powers cannot be integrated from t = {start.t:g} s to {start.t + span:g} s.",
            why="Energies ask for more precision than the run itself.",
            advice="Leave the energy balance out (--no-energy), or look at a shorter time.",
        ) from None
    end.x, end.z = np.array(result["xf"]).ravel()[:-1], np.array(result["zf"]).ravel()
    powers = np.zeros(_POWERS * len(model.components))
    powers[kept] = np.array(result["qf"]).ravel()
    return powers.reshape(_POWERS, -1), end


def _trapezoids(model: CompiledDae, segment: Segment) -> Vector:
    """A model without states: integrate over the results."""
    count = len(segment.times)
    terms = np.array(model.energy(segment.times[None, :], segment.x, segment.z, model.p, model.u, segment.d))
    terms = terms.reshape(len(model.components), count, 1 + _POWERS)
    return np.array([np.trapezoid(terms[:, :, 1 + k], segment.times, axis=1) for k in range(_POWERS)])


def _integrator(model: CompiledDae) -> tuple[ca.Function, list[int]]:
    """Return an integrator with the powers as quadratures, and which they are: those that are not zero anyway.

    IDAS chooses its order for the states alone: at constant acceleration it would integrate powers at order one, with
    a hundred thousand steps. So one more state follows all powers, with different weights lest they cancel.
    """
    if "energy" not in model._cache:
        problem = dict(scaled_problem(model))
        inner, span = problem.pop("inner"), problem.pop("span")
        terms = model.energy(*inner)
        every = ca.vertsplit(ca.vec(terms[:, 1:]))
        kept = [k for k, power in enumerate(every) if not power.is_zero()]
        powers = ca.vertcat(*(every[k] for k in kept)) if kept else ca.SX(0, 1)
        weights = 1.0 + np.modf(0.618 * np.arange(powers.numel()))[0]
        problem["x"] = ca.vertcat(problem["x"], ca.SX.sym("companion"))
        problem["ode"] = ca.vertcat(problem["ode"], span * ca.dot(powers, ca.DM(weights)))
        problem["quad"] = span * powers
        # Where an unknown without derivative begins to change, IDAS would give up its first step for it.
        settings = {
            "reltol": _RTOL,
            "abstol": _ATOL,
            "max_num_steps": 1_000_000,
            "quad_err_con": True,
            "suppress_algebraic": True,
            # The companion depends on everything: a QR factorisation would fill up.
            "linear_solver": "csparse",
        }
        model._cache["energy"] = ca.integrator("energy", "idas", problem, 0, 1, settings), kept
    return model._cache["energy"]
