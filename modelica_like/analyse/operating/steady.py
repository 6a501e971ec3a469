"""Operating points: steady states, also at a given speed, torque or power."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from modelica_like.analyse.linear.held import Motions, free_motions
from modelica_like.analyse.operating.sampling import change_with_samples, unsettled, with_samples
from modelica_like.arguments import checked
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import InitializationError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.language.units import to_si
from modelica_like.native.start import steady_between_ticks, steady_near
from modelica_like.runs.trajectories import Trajectories
from modelica_like.simulation import Model, build
from modelica_like.solve.initialize import Point, call, holding, solve_implicit
from modelica_like.solve.initialize.memory import sampled
from modelica_like.solve.initialize.slopes import Sizes, columns_of, nodes_of, slopes
from modelica_like.upper import Shown

_MAX_NEWTON = 40
_HALVINGS = 20
_CLOSE, _CLOSE_ENOUGH = 1e-12, 1e-9
_ENERGY_LOSS, _ENERGY_SOURCE = 1, 2
_NO_GROWTH = 1e-6
"""Share of the fastest motion: two zeros of a free rotation are known to the root of the rounding, 1e-8."""
_ON_A_KINK, _ASIDE, _ALIKE = 1e-9, 1e-6, 1e-3
"""How near a kink counts as being on it; how far beside it slopes are taken, relative to states of at least 1; and
relative difference of slopes that are the same: those of smooth laws change less on that way."""
_MOST_STATES = 500
"""Eigenvalues of more states take longer than a second."""


@dataclass(frozen=True, eq=False)
class OperatingPoint(Shown, Mapping[str, float]):
    """A steady state: all variables, modes and parameters by path, in SI units.

    What events keep changing without moving anything is not a number: noise that is shown, pulses that are counted.

    Attributes:
        model: the compiled model with the values of the parameters there.
        point: time, states, implicit unknowns and modes.
    """

    model: CompiledDae = field(repr=False)
    point: Point = field(repr=False)
    _values: dict[str, float] = field(repr=False)

    def __getitem__(self, path: str) -> float:
        if path not in self._values:
            raise UnknownName(f"{self.model.name} has no variable '{path}'{did_you_mean(path, self._values) or '.'}")
        return self._values[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    @property
    def powers(self) -> dict[str, tuple[float, float]]:
        """Power of every component in W: supplied from outside (negative: taken away), and lost."""
        terms = call(self.model, self.model.energy, self.point).reshape(-1, len(self.model.components))
        rows = zip(self.model.components, terms[_ENERGY_SOURCE], terms[_ENERGY_LOSS], strict=True)
        return {path: (float(source), float(loss)) for path, source, loss in rows}

    @property
    def losses(self) -> dict[str, float]:
        """Lost power of every component that loses any, in W, the largest first."""
        losses = {path: loss for path, (_, loss) in self.powers.items() if loss}
        return dict(sorted(losses.items(), key=lambda item: -item[1]))

    @property
    def efficiency(self) -> float:
        """Power that loads take away over the power that sources supply; nan without a source.

        A load that turns its power into heat, such as a brake, takes nothing away.
        """
        sources = [source for source, _ in self.powers.values()]
        brought = sum(source for source in sources if source > 0)
        return -sum(source for source in sources if source < 0) / brought if brought else float("nan")

    @property
    def stuck(self) -> tuple[str, ...]:
        """Components that hold a motion: friction that is not overcome, or a gear that locks itself."""
        held = (self.model.held.motions[k].component for k in holding(self.model, self.point))
        return tuple(dict.fromkeys(held))

    @property
    def growth(self) -> float:
        """Rate in 1/s at which what departs from it grows: 0 if nothing does, nan where samples or delays decide that.

        Less than 1e-6 of the fastest small motion counts as 0. Where it lies on a kink, such as that of |x|, what goes
        straight away to one side counts, too.
        """
        return growth(self.model, self.point)

    @property
    def notices(self) -> tuple[str, ...]:
        """What a reader of its numbers should know; of drives with up to 500 states whether it is stable."""
        return unstable("It", self.model, self.point)

    def __str__(self) -> str:
        lines = [f"Operating point of {self.model.name}"]
        lines += [f"  {path} supplies {s:.6g} W" for path, (s, _) in self.powers.items() if s > 0]
        lines += [f"  {path} takes {-s:.6g} W" for path, (s, _) in self.powers.items() if s < 0]
        lines += [f"  {path} loses {loss:.6g} W" for path, loss in self.losses.items()]
        if np.isfinite(self.efficiency):
            lines.append(f"  efficiency {100 * self.efficiency:.4g} %")
        lines += [f"  {path} sticks" for path in self.stuck]
        lines += [f"  {notice}" for notice in self.notices]
        return "\n".join(lines)


def growth(model: CompiledDae, point: Point) -> float:
    """Return the rate in 1/s at which what departs from a steady state grows, as `OperatingPoint.growth`."""
    if model.events.delay_parts or sampled(model, ()):
        return float("nan")
    motions = free_motions(model, point)
    rates = _small_motions(model, point, motions)
    values = np.linalg.eigvals(rates)
    fastest = max(float(np.max(values.real, initial=0.0)), *_beside_kinks(model, point, motions, rates))
    return fastest if fastest > _NO_GROWTH * np.max(np.abs(values), initial=0.0) else 0.0


def _small_motions(model: CompiledDae, point: Point, motions: Motions) -> Any:
    """Return the rates of the motions that are left free by themselves, shape (kept, kept)."""
    return slopes(model, point, "ode", columns=[]).x[motions.keep] @ motions.shape


def _beside_kinks(model: CompiledDae, point: Point, motions: Motions, rates: Any) -> Iterator[float]:
    """Yield at which rates something departs to one side, where the state lies on a kink: there slopes are others.

    Only what goes straight away and stays on its side is looked at: what swings crosses the kink.
    """
    yield 0.0
    if not np.any(np.abs(call(model, model.edges.function, point)[: model.edges.kinks]) < _ON_A_KINK):
        return
    scale = _ASIDE * np.maximum(np.abs(point.x), 1.0)

    def beside(way: Any) -> Any:
        """Return the small motions a little away; those of the point where there is no solution."""
        moved = point.copy()
        moved.x = point.x + scale * (motions.shape @ way)
        with suppress(InitializationError):
            solve_implicit(model, moved)
            return _small_motions(model, moved, motions)
        return rates

    def alike(one: Any, other: Any) -> bool:
        return np.allclose(one, other, rtol=_ALIKE, atol=_ALIKE * np.max(np.abs(rates), initial=0.0))

    for way in (sign * row for row in np.eye(len(rates)) for sign in (1, -1)):
        if alike(side := beside(way), rates):
            continue
        values, vectors = np.linalg.eig(side)
        for value, vector in zip(values, vectors.T, strict=True):
            along = vector.real / np.max(np.abs(vector.real), initial=1e-300)
            if value.imag == 0 and value.real > 0 and any(alike(beside(sign * along), side) for sign in (1, -1)):
                yield float(value.real)


def unstable(what: str, model: CompiledDae, point: Point) -> tuple[str, ...]:
    """Return the notice about a steady state, called `what`, that is not stable: none if it is, or is too large."""
    rate = growth(model, point) if len(model.states) <= _MOST_STATES else 0.0
    return (f"{what} is not stable: what departs from it grows to e times in {1 / rate:.3g} s.",) if rate > 0 else ()


@checked
def steady(
    drive: Model, hold: Mapping[str, Any] | None = None, by: Sequence[str] | str = (), *,
    parameters: Mapping[str, Any] | None = None, near: OperatingPoint | Trajectories | None = None,
) -> OperatingPoint:  # fmt: skip
    """Find a steady state of a drive: all derivatives are zero, except those of states on which nothing depends.

    With `hold`, variables take given values, and as many parameters are adjusted: the load at which a motor
    turns at a given speed is `steady(bench, {"motor.w": "4000 rpm"}, by="load.tau_constant")`.

    Args:
        drive: a component, a netlist file or a compiled model.
        hold: values of variables, numbers in SI units or quantities.
        by: the parameters or inputs to find, as many as are held.
        parameters: other values of parameters and inputs.
        near: start from another operating point, or from the end of a run with its modes (locked clutches);
            otherwise from the guesses of the model.

    Raises:
        ValueOutOfRange: not as many parameters as held variables.
        UnknownName: a name is not known.
        InitializationError: there is no steady state near it, or the parameters do not determine it.
    """
    model = build(drive, free=[*(parameters or ()), *([by] if isinstance(by, str) else by)])
    if parameters:
        model = model.with_parameters(dict(parameters))
    free = [by] if isinstance(by, str) else list(by)
    target = _Target(model, hold or {}, free)
    if isinstance(near, OperatingPoint) and free:
        model = model.with_parameters({name: near[name] for name in free})
    begin = near.point(float(near.time[-1])) if isinstance(near, Trajectories) else near.point if near else None
    point = _settle(model, begin)
    if free:
        model, point = target.reach(model, point)
    values = dict(zip(model.position, map(float, call(model, model.equations.variables, point)), strict=True))
    values.update(zip(model.discrete_position, map(float, point.d), strict=False))
    values.update(zip(model.parameter_position, map(float, model.p), strict=True))
    values.update(zip(model.derived_position, map(float, model.equations.derived(model.p).full().ravel()), strict=True))
    values.update(dict.fromkeys(unsettled(model, point), float("nan")))
    return OperatingPoint(model, point, values)


def _settle(model: CompiledDae, near: Point | None) -> Point:
    if near is not None:
        try:
            return with_samples(model, steady_near(model, near))
        except InitializationError:
            # The modes of the neighbour are not valid here.
            pass
    return with_samples(model, steady_between_ticks(model))


class _Target:
    """Variables with given values, and the parameters to adjust.

    Raises:
        ValueOutOfRange: not as many parameters as variables.
        UnknownName: there is no such variable.
    """

    def __init__(self, model: CompiledDae, hold: Mapping[str, Any], free: Sequence[str]) -> None:
        if len(hold) != len(free):
            held, freed = ", ".join(hold) or "nothing", ", ".join(free) or "nothing"
            raise ValueOutOfRange(
                f"{model.name}: {held} cannot be held by {freed}: each held variable needs one parameter.",
                advice='Write for example steady(drive, {"motor.w": "3000 rpm"}, by="load.tau_constant").',
            )
        self.paths, self.free = list(hold), list(free)
        self.rows = nodes_of(model, self.paths)
        self.wanted = np.array([to_si(value, model.units[path], path) for path, value in hold.items()])
        self.sizes = np.array([model.flat_variables[row].nominal for row in self.rows]) + np.abs(self.wanted)

    def reach(self, model: CompiledDae, point: Point) -> tuple[CompiledDae, Point]:
        """Newton's method on the parameters, each step to a steady state, halved while it gets worse."""
        miss = self._miss(model, point)
        for _ in range(_MAX_NEWTON):
            if np.max(np.abs(miss)) < _CLOSE:
                return model, point
            by = steady_slopes(model, point, self.paths, self.free) / self.sizes[:, None]
            if np.linalg.matrix_rank(by) < len(self.free):
                raise self._undetermined(model)
            better = self._closer(model, point, np.linalg.solve(by, -miss), float(np.max(np.abs(miss))))
            if better is None:
                break
            model, point, miss = better
        if np.max(np.abs(miss)) < _CLOSE_ENOUGH:
            return model, point
        worst = int(np.argmax(np.abs(miss)))
        raise InitializationError(
            f"{model.name}: no {' and '.join(self.free)} was found that holds {self.paths[worst]} at "
            f"{self.wanted[worst]:.6g}.",
            advice="Give the parameters values near the solution, or hold something that they can reach.",
        )

    def _miss(self, model: CompiledDae, point: Point) -> Vector:
        """Distances of variables from their values, over their sizes."""
        return (call(model, model.equations.variables, point)[self.rows] - self.wanted) / self.sizes

    def _closer(
        self, model: CompiledDae, point: Point, step: Any, before: float
    ) -> tuple[CompiledDae, Point, Vector] | None:
        now = np.concatenate([model.p, model.u])[[model.fixed_position[name] for name in self.free]]
        for _ in range(_HALVINGS):
            try:
                other = model.with_parameters(dict(zip(self.free, now + step, strict=True)))
                there = _settle(other, point)
                if np.max(np.abs(miss := self._miss(other, there))) < before:
                    return other, there, miss
            except (InitializationError, ValueOutOfRange):
                # No steady state that far away: a shorter step may find one.
                pass
            step = step / 2
        return None

    def _undetermined(self, model: CompiledDae) -> InitializationError:
        many = len(self.free) > 1
        return InitializationError(
            f"{model.name}: {', '.join(self.paths)} cannot be held by {', '.join(self.free)}: in steady state "
            f"{'they do' if many else 'it does'} not depend on {'those' if many else 'it'}.",
            advice="Choose a parameter that changes it, such as the torque of a load.",
        )


def steady_slopes(model: CompiledDae, point: Point, paths: Sequence[str], free: Sequence[str]) -> Vector:
    """Total derivative of variables of steady states by parameters, shape (variables, parameters)."""
    variables = slopes(model, point, "variables", nodes_of(model, paths))
    theta = np.eye(Sizes.of(model).theta)[:, columns_of(model, free)]
    states, theta = change_with_samples(model, point, theta)
    return variables.x @ states + variables.theta @ theta
