"""Operating points: steady states, also at a given speed, torque or power."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from modelica_like.analyse.linear.linearize import held_by, slopes_at
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import InitializationError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.initialize import Point, call, holding, initialize
from modelica_like.initialize.kept import find_kept, solve_kept
from modelica_like.initialize.steady import check_modes_hold, moving_states, solve_steady
from modelica_like.simulation import Model, build
from modelica_like.solve.trajectories import Trajectories
from modelica_like.units import to_si

_MAX_NEWTON = 40
_HALVINGS = 20
_CLOSE = 1e-12
_ENERGY_LOSS, _ENERGY_SOURCE = 1, 2


@dataclass(frozen=True, eq=False)
class OperatingPoint(Mapping[str, float]):
    """A steady state: all variables, modes and parameters by path, in SI units.

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
        """Power of every component in W: what it brings in from outside (negative: takes away), and what it loses."""
        terms = call(self.model, self.model.energy, self.point).reshape(-1, len(self.model.components))
        rows = zip(self.model.components, terms[_ENERGY_SOURCE], terms[_ENERGY_LOSS], strict=True)
        return {path: (float(source), float(loss)) for path, source, loss in rows}

    @property
    def losses(self) -> dict[str, float]:
        """Lost power of every component that loses any, in W, the largest first."""
        found = {path: loss for path, (_, loss) in self.powers.items() if loss}
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    @property
    def efficiency(self) -> float:
        """Power that loads take away over the power that sources bring in; nan where nothing drives.

        A load that turns its power into heat itself, such as a brake, takes nothing away.
        """
        sources = [source for source, _ in self.powers.values()]
        brought = sum(one for one in sources if one > 0)
        return -sum(one for one in sources if one < 0) / brought if brought else float("nan")

    @property
    def stuck(self) -> tuple[str, ...]:
        """Components that hold a motion: friction that is not overcome, or a gear that locks itself."""
        held = (self.model.holds[k].component for k in holding(self.model, self.point))
        return tuple(dict.fromkeys(held))

    def __str__(self) -> str:
        lines = [f"Operating point of {self.model.name}"]
        lines += [f"  {path} brings in {s:.6g} W" for path, (s, _) in self.powers.items() if s > 0]
        lines += [f"  {path} takes away {-s:.6g} W" for path, (s, _) in self.powers.items() if s < 0]
        lines += [f"  {path} loses {loss:.6g} W" for path, loss in self.losses.items()]
        if np.isfinite(self.efficiency):
            lines.append(f"  efficiency {100 * self.efficiency:.4g} %")
        lines += [f"  {path} sticks" for path in self.stuck]
        return "\n".join(lines)


def steady(
    drive: Model, hold: Mapping[str, Any] | None = None, by: Sequence[str] | str = (), *,
    parameters: Mapping[str, Any] | None = None, near: OperatingPoint | Trajectories | None = None,
) -> OperatingPoint:  # fmt: skip
    """Find a steady state of a drive: all derivatives zero, except of states that nothing depends on.

    With `hold`, variables get given values, and as many parameters are found that do it: the load at which a motor
    turns at a given speed is `steady(bench, {"motor.w": "4000 rpm"}, by="load.tau_constant")`.

    Args:
        drive: a component, a netlist file or a compiled model.
        hold: values of variables, numbers in SI units or quantities.
        by: the parameters or inputs to find, as many as are held.
        parameters: other values of parameters and inputs.
        near: what to begin from: another operating point, or the end of a run with its modes (clutches that have
            locked); otherwise the guesses of the model.

    Raises:
        ValueOutOfRange: not as many parameters as held variables.
        UnknownName: a name is not known.
        InitializationError: there is no steady state near it, or the parameters do not determine it.
    """
    model = build(drive, free=[*(parameters or ()), *([by] if isinstance(by, str) else by)])
    if parameters:
        model = model.with_parameters(dict(parameters))
    free = [by] if isinstance(by, str) else list(by)
    targets = _targets(model, hold or {}, free)
    if isinstance(near, OperatingPoint) and free:
        model = model.with_parameters({name: near[name] for name in free})
    begin = near.point(float(near.time[-1])) if isinstance(near, Trajectories) else near.point if near else None
    point = _settle(model, begin)
    if free:
        model, point = _hold(model, point, targets, free)
    return _operating_point(model, point)


def _targets(model: CompiledDae, hold: Mapping[str, Any], free: Sequence[str]) -> dict[str, float]:
    if len(hold) != len(free):
        held, found = ", ".join(hold) or "nothing", ", ".join(free) or "nothing"
        raise ValueOutOfRange(
            f"{model.name}: {held} cannot be held by {found}: each held variable takes one parameter.",
            advice='Say for example steady(drive, {"motor.w": "3000 rpm"}, by="load.tau_constant").',
        )
    targets: dict[str, float] = {}
    for path, value in hold.items():
        if path not in model.position:
            raise UnknownName(f"{model.name} has no variable '{path}'{did_you_mean(path, model.position) or '.'}")
        targets[path] = to_si(value, model.flat_variables[model.position[path]].unit, path)
    return targets


def _settle(model: CompiledDae, near: Point | None) -> Point:
    if near is None:
        return initialize(model, 0.0, "steady")
    point = near.copy()
    try:
        solve_steady(model, point)
        check_modes_hold(model, point)
    except InitializationError:
        # The modes of the neighbour do not hold here.
        return initialize(model, 0.0, "steady")
    return point


def _hold(
    model: CompiledDae, point: Point, targets: Mapping[str, float], free: Sequence[str]
) -> tuple[CompiledDae, Point]:
    """Newton's method on the parameters, each step to a steady state, halved while it gets worse."""
    paths = list(targets)
    rows = [model.position[path] for path in paths]
    sizes = np.array(
        [model.flat_variables[row].nominal + abs(targets[path]) for row, path in zip(rows, paths, strict=True)]
    )
    wanted = np.array(list(targets.values()))
    for _ in range(_MAX_NEWTON):
        miss = call(model, model.variables, point)[rows] - wanted
        if np.max(np.abs(miss) / sizes) < _CLOSE:
            return model, point
        slopes = steady_slopes(model, point, paths, free)
        if np.linalg.matrix_rank(slopes) < len(free):
            raise _undetermined(model, paths, free)
        step = np.linalg.solve(slopes, -miss)
        better = _line_search(model, point, step, free, rows, wanted, sizes)
        if better is None:
            break
        model, point = better
    miss = call(model, model.variables, point)[rows] - wanted
    if np.max(np.abs(miss) / sizes) < 1e-9:
        return model, point
    worst = paths[int(np.argmax(np.abs(miss) / sizes))]
    raise InitializationError(
        f"{model.name}: no {' and '.join(free)} was found that holds {worst} at {targets[worst]:.6g}.",
        advice="Give the parameters values near the solution, or hold something that they can reach.",
    )


def _line_search(
    model: CompiledDae, point: Point, step: Any, free: Sequence[str], rows: Sequence[int], wanted: Any, sizes: Any
) -> tuple[CompiledDae, Point] | None:
    before = _distance(model, point, rows, wanted, sizes)
    now = np.array([_value(model, name) for name in free])
    for _ in range(_HALVINGS):
        try:
            other = model.with_parameters(dict(zip(free, now + step, strict=True)))
            there = _settle(other, point)
            if _distance(other, there, rows, wanted, sizes) < before:
                return other, there
        except (InitializationError, ValueOutOfRange):
            # No steady state that far away: a shorter step may have one.
            pass
        step = step / 2
    return None


def _distance(model: CompiledDae, point: Point, rows: Sequence[int], wanted: Any, sizes: Any) -> float:
    return float(np.max(np.abs(call(model, model.variables, point)[rows] - wanted) / sizes))


def steady_slopes(model: CompiledDae, point: Point, paths: Sequence[str], free: Sequence[str]) -> Any:
    """Total derivative of variables of steady states by parameters, shape (variables, parameters)."""
    a, b, c, d = slopes_at(model, point, free, paths)
    moving = moving_states(model)
    inner = a[np.ix_(moving, moving)]
    kept = find_kept(model, point, moving, inner)
    move = solve_kept(kept, inner, -b[moving], -held_by(model, point, kept, free))
    return c[:, moving] @ move + d


def _undetermined(model: CompiledDae, paths: Sequence[str], free: Sequence[str]) -> InitializationError:
    return InitializationError(
        f"{model.name}: {', '.join(paths)} cannot be held by {', '.join(free)}: in steady state "
        f"{'they do' if len(free) > 1 else 'it does'} not depend on {'those' if len(free) > 1 else 'it'}.",
        advice="Choose a parameter that changes it, such as the torque of a load.",
    )


def _value(model: CompiledDae, name: str) -> float:
    if name in model.parameter_position:
        return float(model.p[model.parameter_position[name]])
    return float(model.u[[model.flat_variables[k].path for k in model.inputs].index(name)])


def _operating_point(model: CompiledDae, point: Point) -> OperatingPoint:
    values = dict(zip(model.position, map(float, call(model, model.variables, point)), strict=True))
    values.update(zip(model.discrete_position, map(float, point.d), strict=False))
    values.update(zip(model.parameter_position, map(float, model.p), strict=True))
    values.update(zip(model.derived_position, map(float, model.derived(model.p).full().ravel()), strict=True))
    return OperatingPoint(model, point, values)
