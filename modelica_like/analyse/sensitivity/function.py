"""A simulation as a differentiable CasADi function, for optimization problems."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from modelica_like.analyse.sensitivity.by_run_time import differentiated_run, mode_sequence, tightened
from modelica_like.analyse.sensitivity.callback import NamedCallback
from modelica_like.analyse.sensitivity.derivatives import Sensitivities, chosen_parameters, replayed
from modelica_like.analyse.sensitivity.formulas import free_formulas
from modelica_like.analyse.sensitivity.result import Quantity
from modelica_like.analyse.sensitivity.second import SecondDerivatives
from modelica_like.arguments import checked
from modelica_like.compile.buffers import Vector
from modelica_like.errors import LanguageError, ModelicaLikeError, NoGradient, ValueOutOfRange
from modelica_like.options import Options
from modelica_like.runs.readings import does_not_happen, is_series, listed, read_output
from modelica_like.runs.solution import Solution
from modelica_like.simulation import Model, plan, quick_run
from modelica_like.solve.initialize import StartKind
from modelica_like.solve.recorder import Event

Found = TypeVar("Found")


class SimulationFunction(NamedCallback):
    """y = f(p): simulates with all events; its Jacobian is exact through the events.

    Both come from one run where the adjoint of the run-time has all of it, elsewhere the Jacobian from a replay. Second
    derivatives are extrapolated differences of the exact Jacobian. The object must live as long as anything built from
    it. CasADi rewrites an error of the simulation; `refusal` has the original.

    Attributes:
        inputs: paths of the parameters p.
        outputs: names of the outputs y, as in `sensitivities`.
        start_values: values of the parameters in the model, a starting point.
        precision: relative, of the derivatives.
        runs: number of simulations so far.
        refusal: why the last evaluation failed, if it did.
        second_error: bound of the error of the last second derivatives, over the largest one.
    """

    def __init__(
        self, drive: Model, inputs: Sequence[str], outputs: Sequence[str], run: Mapping[str, Any], *,
        precision: float, any_sequence: bool, nan_where_refused: bool = False,
    ) -> None:  # fmt: skip
        super().__init__()
        self.inputs = tuple(inputs)
        self.outputs = tuple(outputs)
        self.runs = 0
        self.refusal: ModelicaLikeError | None = None
        self.second_error = 0.0
        freed = free_formulas(drive, inputs, run["parameters"])
        self._model = freed.model
        self._run = {**run, "parameters": freed.values}
        self.precision = precision
        self._nan_where_refused = nan_where_refused
        self._simulated: tuple[bytes, Solution] | None = None
        self._sequence: list[tuple[str, str, str]] | None = None
        self._read = [read_output(self._model, name) for name in outputs]
        end, chosen = plan(self._model, run["until"], options=run["options"])
        self._options = tightened(chosen, precision)
        self._tight = {"until": end, "rtol": self._options.rtol, "atol": self._options.atol}
        self._chosen = chosen_parameters(self._model.with_parameters(dict(freed.values)), inputs)
        self.start_values = np.array([parameter.value for _, parameter in self._chosen])
        result, events = self._by_run_time(self.start_values)
        if result is None:
            solution = self._simulate(self.start_values)
            result, events = self._replayed(solution), solution.events
        self._sequence = None if any_sequence else mode_sequence(events)
        self._last = self.start_values.tobytes(), result
        self.runs = 0
        self._second = SecondDerivatives(self, (len(self.outputs), len(self.inputs)))
        self._jacobian = _Jacobian(self, self._second)
        dense = ca.Sparsity.dense
        self.declare("simulation", {"p": dense(len(self.inputs))}, {"y": dense(len(self.outputs))})

    def _replayed(self, solution: Solution) -> Sensitivities:
        kind = self._run["start"] or solution.start
        chosen = chosen_parameters(solution.model, self.inputs)
        return replayed(solution, self._read, chosen, start=kind, precision=self.precision, named=True)

    def _by_run_time(self, values: Vector) -> tuple[Sensitivities | None, Sequence[Event]]:
        """Simulate at parameter values with derivatives by the run-time; None where the replay has to tell."""
        model = self._model.with_parameters(self._given(values))
        kind = self._run["start"] or model.settings.get("start", "given")
        names = [parameter.name for _, parameter in self._chosen]
        result = differentiated_run(model, self._tight["until"], self._options, kind, self._read, names)
        if result is None or np.isnan(result.derivatives).any():
            return None, ()
        events = result.solution.events
        if self._sequence not in (None, mode_sequence(events)):
            return None, events
        numbers = result.values
        if self._simulated is not None and self._simulated[0] == values.tobytes():
            numbers = self._simulated[1].read(*self.outputs)  # the same name has the same number everywhere
        else:
            self.runs += 1
        fixed = np.concatenate([model.p, model.u])
        differentiated = Sensitivities(
            model.name,
            tuple(Quantity(read.name, float(v), read.unit) for read, v in zip(self._read, numbers, strict=True)),
            tuple(replace(parameter, value=float(fixed[k])) for k, parameter in self._chosen),
            result.derivatives, "adjoint",
        )  # fmt: skip
        return differentiated, events

    def _given(self, values: Vector) -> dict[str, Any]:
        return {**self._run["parameters"], **dict(zip(self.inputs, map(float, values), strict=True))}

    def at(self, p: Vector | Sequence[float]) -> Sensitivities:
        """Simulate at parameter values and return outputs with derivatives; kept until the next values.

        Raises:
            NoGradient: the mode sequence is not the one of the start values, or a derivative does not exist.
            ModelicaLikeError: the simulation fails.
        """
        values = np.asarray(p, float).ravel()
        if self._last[0] != values.tobytes():
            result, _ = self._by_run_time(values)
            self._last = values.tobytes(), result or self._replayed(self._simulate(values))
        return self._last[1]

    def values_at(self, p: Vector | Sequence[float]) -> list[float]:
        """Return only the outputs.

        Raises:
            NoGradient: as in `at`.
            UnknownName: a mode change does not happen.
            ModelicaLikeError: the simulation fails.
        """
        key = np.asarray(p, float).ravel()
        if self._last[0] == key.tobytes():
            return [output.value for output in self._last[1].outputs]
        values = self._simulate(key).read(*self.outputs)
        for name, value in zip(self.outputs, values, strict=True):
            if np.isnan(value):
                raise does_not_happen(name)
        return values

    def _simulate(self, values: Vector) -> Solution:
        """Simulate at parameter values; kept until the next ones."""
        key = values.tobytes()
        if self._simulated is None or self._simulated[0] != key:
            self.runs += 1
            run = {**self._run, **self._tight, "parameters": self._given(values)}
            solution = quick_run(self._model, **run, readings=self.outputs)
            sequence = mode_sequence(solution.events)
            if self._sequence not in (None, sequence):
                raise _changed(self._sequence or [], sequence, solution)
            self._simulated = key, solution
        return self._simulated[1]

    def hessian_products(self, p: Vector | Sequence[float], direction: Vector | Sequence[float]) -> Vector:
        """Return the second derivatives of each output times a direction: four gradients for any number of parameters.

        Args:
            p: values of the parameters.
            direction: in which they change, shape (parameters,).

        Returns:
            Shape (outputs, parameters); `second_error` bounds their error.

        Raises:
            ValueOutOfRange: the direction has another number of entries, or is zero.
            NoGradient: they are not certain, as where the mode sequence changes nearby.
            ModelicaLikeError: the simulation fails.
        """
        along = np.asarray(direction, float).ravel()
        if len(along) != len(self.inputs) or not np.any(along):
            raise ValueOutOfRange(
                f"The direction needs a number for each parameter, {len(self.inputs)} in all, of which one is not zero."
            )
        return self._second.products(np.asarray(p, float).ravel(), along)

    def attempt(self, what: Callable[[Vector], Found], p: Any) -> Found | None:
        """Simulate for CasADi; an error is kept in `refusal`, and raised unless nan is wanted."""
        self.refusal = None
        try:
            return what(np.array(p))
        except ModelicaLikeError as error:
            self.refusal = error
            if self._nan_where_refused:
                return None
            raise

    def eval(self, arg: Any) -> list[Any]:
        """Simulate."""
        values = self.attempt(self.values_at, arg[0])
        return [ca.DM([np.nan] * len(self.outputs) if values is None else values)]

    def has_jacobian(self) -> bool:
        """Tell CasADi that the derivatives are known."""
        return True

    def get_jacobian(self, name: str, inames: Any, onames: Any, opts: Any) -> Any:
        """Return the function of the derivatives."""
        return self._jacobian


class _Jacobian(NamedCallback):
    """dy/dp of a simulation."""

    def __init__(self, simulation: SimulationFunction, second: SecondDerivatives) -> None:
        super().__init__()
        self._simulation, self._second = simulation, second
        self._size = len(simulation.outputs), len(simulation.inputs)
        arguments = {"p": ca.Sparsity.dense(self._size[1]), "out_y": ca.Sparsity(self._size[0], 1)}
        self.declare("jacobian", arguments, {"jac_y_p": ca.Sparsity.dense(*self._size)})

    def has_jacobian(self) -> bool:
        """Tell CasADi that there are second derivatives."""
        return True

    def get_jacobian(self, name: str, inames: Any, onames: Any, opts: Any) -> Any:
        """Return the function of the second derivatives."""
        return self._second

    def eval(self, arg: Any) -> list[Any]:
        values = self._simulation.attempt(self._simulation.at, arg[0])
        return [ca.DM(np.full(self._size, np.nan) if values is None else values.derivatives)]


@checked
def simulation_function(
    drive: Model, inputs: str | Sequence[str], outputs: str | Sequence[str], *, until: float | str | None = None,
    parameters: Mapping[str, Any] | None = None, start: StartKind | None = None, options: Options | None = None,
    precision: float = 1e-8, any_sequence: bool = False, nan_where_refused: bool = False,
) -> SimulationFunction:  # fmt: skip
    """Return a simulation as a CasADi function of parameters.

    Args:
        drive: a component, a netlist file, or a compiled model.
        inputs: parameters and inputs of the model, in SI units.
        outputs: as in `sensitivities`, without series.
        until: end time, as in `simulate`.
        parameters: other values of parameters, as in `simulate`.
        start: kind of start, as in `simulate`.
        options: as in `simulate`.
        precision: as in `sensitivities`.
        any_sequence: accept other mode sequences than that of the start values. Outputs are then differentiable
            almost everywhere, but not at the change of the sequence.
        nan_where_refused: return nan instead of raising if the simulation fails or has another mode sequence: an
            optimizer then tries a shorter step. `refusal` has the reason.

    Raises:
        NoGradient: a derivative does not exist at the start values.
        LanguageError: an output is a series.
        ValueOutOfRange: there is no input or no output.
        ModelicaLikeError: the model or a name is wrong, or the simulation is not possible.
    """
    inputs, outputs = listed(inputs, "parameter as input"), listed(outputs, "output")
    series = [name for name in outputs if is_series(name)]
    if series:
        raise LanguageError(
            f"{series[0]} is a trajectory; the outputs of a simulation function are numbers.",
            advice="Ask for single times: at(table.s, 0.3 s).",
        )
    run = {"until": until, "parameters": parameters, "start": start, "options": options}
    return SimulationFunction(
        drive, inputs, outputs, run, precision=precision, any_sequence=any_sequence, nan_where_refused=nan_where_refused
    )


def first_difference(expected: Sequence[Any], results: Sequence[Any]) -> tuple[int, str]:
    """Return which mode change of two sequences differs first, counted from 1, and how."""
    pairs = zip_longest(expected, results)
    place, (before, now) = next((k, pair) for k, pair in enumerate(pairs, 1) if pair[0] != pair[1])
    before, now = (f"'{result[0]}: {result[1]} → {result[2]}'" if result else "" for result in (before, now))
    if now and before:
        return place, f"{now} happens instead of {before}"
    return place, f"{now} happens additionally" if now else f"{before} is missing"


def _changed(expected: Sequence[Any], results: Sequence[Any], solution: Solution) -> NoGradient:
    place, what = first_difference(expected, results)
    return NoGradient(
        f"{solution.model.name} has another mode sequence at these parameter values: as mode change {place}, {what}.",
        why="A function with a fixed mode sequence has derivatives only as long as the sequence stays.",
        advice="Bound the parameters, start elsewhere, or allow it with any_sequence=True.",
    )
