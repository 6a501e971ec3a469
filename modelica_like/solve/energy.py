"""Where the energy went: power in = change of stored energy + losses, for every component."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from modelica_like.compile import CompiledDae, Vector
from modelica_like.initialize import Point
from modelica_like.solve.idas import scaled_problem
from modelica_like.solve.recorder import Segment

_RTOL = 1e-11
_ATOL = 1e-12


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
        residual: inflow + source - lost - (stored - at_events); zero but for the integration error.
    """

    component: str
    inflow: float
    source: float
    stored: float
    lost: float
    at_events: float
    residual: float


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
    def closure(self) -> float:
        """Largest residual, of a component or of the whole, relative to the throughput."""
        residuals = [abs(row.residual) for row in self.rows]
        total = abs(sum(row.source - row.lost - (row.stored - row.at_events) for row in self.rows))
        return max([*residuals, total], default=0.0) / (self.throughput or 1.0)

    def __str__(self) -> str:
        width = max([len("component"), *(len(row.component) for row in self.rows)])
        head = f"{'component':{width}}  {'in / J':>12}  {'source / J':>12}  {'stored / J':>12}  {'lost / J':>12}"
        lines = [
            f"{row.component:{width}}  {row.inflow:12.6g}  {row.source:12.6g}  {row.stored:12.6g}  {row.lost:12.6g}"
            for row in self.rows
            if any((row.inflow, row.source, row.stored, row.lost))
        ]
        total = f"{'total':{width}}  {'':12}  {self.source:12.6g}  {self.stored:12.6g}  {self.lost:12.6g}"
        return "\n".join([head, *lines, total, f"closes to {self.closure:.1e} of {self.throughput:.6g} J"])


def energy_balance(model: CompiledDae, segments: tuple[Segment, ...]) -> EnergyBalance:
    """Integrate the energy terms of every component along a run.

    Each segment is integrated again from its beginning, with the powers as quadratures and a tight tolerance.
    """
    count = len(model.components)
    inflow, source, lost, moved, jumps = (np.zeros(count) for _ in range(5))
    largest, last = 0.0, None
    for segment in segments:
        before = _stored(model, segment.start)
        largest = max(largest, float(np.sum(np.abs(before))))
        if last is not None:
            jumps += before - last
        powers, end = _integrate(model, segment)
        after = _stored(model, end)
        moved += after - before
        lost += powers[:count]
        source += powers[count : 2 * count]
        inflow += powers[2 * count :]
        # The next segment begins where the run went on, not where this more precise integration ended.
        last = _stored(model, segment.point(-1))
    residual = inflow + source - lost - moved
    rows = tuple(
        EnergyRow(path, *map(float, values))
        for path, *values in zip(model.components, inflow, source, moved + jumps, lost, jumps, residual, strict=True)
    )
    throughput = max(largest, *(float(np.sum(np.abs(part))) for part in (inflow, source, lost)))
    return EnergyBalance(rows, throughput)


def _stored(model: CompiledDae, point: Point) -> Vector:
    return np.array(model.energy(point.t, point.x, point.z, model.p, model.u, point.d))[:, 0]


def _integrate(model: CompiledDae, segment: Segment) -> tuple[Vector, Point]:
    """Return the integrals of loss, source power and inflow of all components, and the end point."""
    span = float(segment.times[-1] - segment.times[0])
    start, end = segment.start, segment.point(-1)
    if span <= 0.0:
        return np.zeros(3 * len(model.components)), end
    if not model.states:
        return _trapezoids(model, segment), end
    p = np.concatenate([[start.t, span], model.p, model.u, segment.d])
    integrator, present = _integrator(model)
    result = integrator(x0=np.concatenate([start.x, np.zeros(len(present))]), z0=start.z, p=p)
    end.x, energies = np.split(np.array(result["xf"]).ravel(), [len(start.x)])
    end.z = np.array(result["zf"]).ravel()
    powers = np.zeros(3 * len(model.components))
    powers[present] = energies
    return powers, end


def _trapezoids(model: CompiledDae, segment: Segment) -> Vector:
    """A model without states: integrate over the results."""
    count = len(segment.times)
    terms = np.array(model.energy(segment.times[None, :], segment.x, segment.z, model.p, model.u, segment.d))
    terms = terms.reshape(len(model.components), count, 4)
    return np.concatenate([np.trapezoid(terms[:, :, k], segment.times, axis=1) for k in (1, 2, 3)])


def _integrator(model: CompiledDae) -> tuple[ca.Function, list[int]]:
    """Return an integrator whose last states are energies, and which of the powers these are (the others are zero).

    Not as quadratures: IDAS chooses its order for the states alone, and integrates the power of a constant acceleration at order one.
    """
    if "energy" not in model._cache:
        problem = dict(scaled_problem(model))
        inner, span = problem.pop("inner"), problem.pop("span")
        terms = model.energy(*inner)
        powers = ca.vertcat(terms[:, 1], terms[:, 2], terms[:, 3])
        present = [k for k in range(powers.numel()) if not powers[k].is_zero()]
        energies = ca.SX.sym("energies", len(present))
        problem |= {"x": ca.vertcat(problem["x"], energies), "ode": ca.vertcat(problem["ode"], span * powers[present])}
        settings = {"reltol": _RTOL, "abstol": _ATOL, "max_num_steps": 1_000_000}
        model._cache["energy"] = ca.integrator("energy", "idas", problem, 0, 1, settings), present
    return model._cache["energy"]
