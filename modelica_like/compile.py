"""Compile a reduced system to CasADi functions and tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.errors import LanguageError, Source, UnknownName, did_you_mean
from modelica_like.flatten.model import FlatDiscrete, FlatModel, FlatParameter, FlatVariable, Origin, evaluate
from modelica_like.flatten.template import TransitionForm
from modelica_like.start_system import start_system
from modelica_like.structure.reduce import ReducedDae
from modelica_like.units import to_si

Vector = np.ndarray[Any, np.dtype[np.float64]]

TIME_RESOLUTION = 1e-10
"""Time resolution of events relative to max(1 s, |t|): guards are judged that much later, so that one that just left zero counts by its direction."""

_JOINS: dict[int, Callable[[Any, Any], Any]] = {ca.OP_FMIN: ca.fmin, ca.OP_FMAX: ca.fmax}


@dataclass(frozen=True)
class Reset:
    """A value that changes at an event: entry of x (`state`), of d (`discrete`), or of the reset nodes (`value`)."""

    kind: str
    index: int
    factor: float
    value: int
    target: int


@dataclass(frozen=True)
class CompiledTransition:
    """A transition as numbers.

    Attributes:
        mode: position of the mode in d.
        sources: numbers of the modes it leaves.
        target: number of the mode it enters.
        timed: whether `index` is a position in the moments rather than in the guards.
        resets: what else changes.
    """

    mode: int
    sources: tuple[int, ...]
    target: int
    timed: bool
    index: int
    resets: tuple[Reset, ...]
    source: Source


@dataclass(frozen=True)
class StartEntry:
    """A start value: node, the state it is (if it is one), strength, position in the start values."""

    node: int
    state: tuple[int, float] | None
    strength: str


@dataclass(eq=False)
class CompiledDae:
    """Functions of the reduced system; all take (t, x, z, p, u, d).

    Attributes:
        ode: derivatives of x.
        alg: residuals for z.
        variables: all flat variables, in the order of `names`.
        guards: one per state event, positive where it wants to fire.
        guard_rates: their time derivatives along the solution.
        guards_soon: guards as they will be one time resolution later.
        moments: times of the time events.
        resets: new values at events.
        reset_nodes: variables that are reset but are neither states nor discrete.
        start_conditions: one per choice of a start mode.
        start_values: as many as `starts`.
        start_system: of (t, x, y, z, p, u, d) with y the variables that start values need: y itself, the Jacobian by (x, y, z) and the values
            of [explicit equations for y, implicit equations, variables with start values].
        start_nodes: variables at the end of the start system.
        discrete_starts: start of d.
        derived: parameters that follow from others, of p only.
        determinants: relative determinants; zero where a block is singular.
        p: parameter values.
        components: paths of the components of the energy balance.
    """

    name: str
    states: tuple[str, ...]
    implicit: tuple[str, ...]
    flat_variables: tuple[FlatVariable, ...]
    flat_parameters: tuple[FlatParameter, ...]
    flat_derived: tuple[FlatParameter, ...]
    flat_discretes: tuple[FlatDiscrete, ...]
    inputs: tuple[int, ...]
    ode: ca.Function
    alg: ca.Function
    alg_jacobian: ca.Function
    variables: ca.Function
    guards: ca.Function
    guard_rates: ca.Function
    guards_soon: ca.Function
    moments: ca.Function
    resets: ca.Function
    reset_nodes: tuple[int, ...]
    start_conditions: ca.Function
    start_values: ca.Function
    start_system: ca.Function
    start_nodes: tuple[int, ...]
    discrete_starts: ca.Function
    derived: ca.Function
    determinants: ca.Function
    transitions: tuple[CompiledTransition, ...]
    start_modes: tuple[tuple[int, int, Source], ...]
    starts: tuple[StartEntry, ...]
    singular: tuple[tuple[tuple[str, ...], tuple[Origin, ...]], ...]
    differentiated: tuple[Origin, ...]
    guesses: Vector
    nominals: Vector
    z_guesses: Vector
    p: Vector
    u: Vector
    components: tuple[str, ...]
    summary: str
    settings: dict[str, Any] = field(default_factory=dict)
    _reduced: ReducedDae | None = field(default=None, repr=False)
    _cache: dict[Any, Any] = field(default_factory=dict, repr=False)

    def __str__(self) -> str:
        return self.summary.replace("ReducedDae", "CompiledDae", 1)

    def __repr__(self) -> str:
        return f"<{self}>"

    @cached_property
    def position(self) -> dict[str, int]:
        """Position of every variable by its path."""
        return {variable.path: k for k, variable in enumerate(self.flat_variables)}

    @cached_property
    def parameter_position(self) -> dict[str, int]:
        """Position of every independent parameter by its path."""
        return {parameter.path: k for k, parameter in enumerate(self.flat_parameters)}

    @cached_property
    def derived_position(self) -> dict[str, int]:
        """Position of every parameter that follows from others by its path."""
        return {parameter.path: k for k, parameter in enumerate(self.flat_derived)}

    @cached_property
    def discrete_position(self) -> dict[str, int]:
        """Position of every mode and discrete value by its path."""
        return {discrete.path: k for k, discrete in enumerate(self.flat_discretes)}

    @cached_property
    def energy(self) -> ca.Function:
        """Energy terms: stored energy, loss, source power and power in, one column each, one row per component."""
        if self._reduced is None:
            raise LanguageError("The energy terms of this model were not kept.")
        return _energy(self._reduced)

    @cached_property
    def arguments(self) -> dict[str, Any]:
        """Fresh symbols for the arguments of the functions."""
        return {name: ca.SX.sym(name, self.ode.size1_in(k)) for k, name in enumerate(self.ode.name_in())}

    def guards_along(self, count: int) -> ca.Function:
        """Guards and guard rates at `count` times, as one function."""
        both = ca.Function("guards_and_rates", (a := list(self.arguments.values())), [self.guards(*a), self.guard_rates(*a)])
        return both.map(count)

    def with_parameters(self, values: dict[str, Any]) -> CompiledDae:
        """Return the same model with other parameter values; nothing is compiled again.

        Args:
            values: by path, numbers in SI units or quantities with a unit.

        Raises:
            UnknownName: there is no such parameter.
            LanguageError: it follows from others, or is not tunable.
            UnitError, ValueOutOfRange: the value does not fit.
        """
        p, u = self.p.copy(), self.u.copy()
        inputs = {self.flat_variables[k].path: n for n, k in enumerate(self.inputs)}
        for path, value in values.items():
            if path in self.parameter_position:
                one = self.flat_parameters[self.parameter_position[path]]
                if not one.tunable:
                    raise LanguageError(f"{path} cannot change after compilation.", advice="Set it in the model and build that again.")
                p[self.parameter_position[path]] = one.checked(to_si(value, one.unit, path), value)
            elif path in inputs:
                u[inputs[path]] = to_si(value, self.flat_variables[self.inputs[inputs[path]]].unit, path)
            elif path in self.derived_position:
                raise LanguageError(f"{path} follows from other parameters.", advice="Set those.")
            else:
                known = [*self.parameter_position, *inputs]
                raise UnknownName(f"{self.name} has no parameter '{path}'{did_you_mean(path, known) or '.'}")
        for one, number in zip(self.flat_derived, self.derived(p).full().ravel(), strict=True):
            one.checked(float(number), f"{number:g}")
        twin = replace(self, p=p, u=u)
        twin.__dict__.update({k: v for k, v in self.__dict__.items() if k not in twin.__dict__})
        return twin

    def __getstate__(self) -> dict[str, Any]:
        if self._reduced is not None:
            _ = self.energy  # symbols do not pickle, functions do
        state = {key: value for key, value in self.__dict__.items() if key != "arguments"}
        return {**state, "_reduced": None, "_cache": {}}


def compile(reduced: ReducedDae) -> CompiledDae:
    """Build the functions of a reduced system."""
    flat = reduced.flat
    build = _Builder(reduced)
    guards, moments, transitions, resets, targets = build.transitions()
    conditions, start_modes = build.start_modes()
    determinants = ca.vertcat(*(expression for _, _, expression in reduced.determinants))
    return CompiledDae(
        name=flat.name,
        states=reduced.states,
        implicit=reduced.implicit,
        flat_variables=tuple(flat.variables),
        flat_parameters=tuple(flat.parameters),
        flat_derived=tuple(flat.derived),
        flat_discretes=tuple(_plain(one) for one in flat.discretes),
        inputs=tuple(flat.inputs),
        ode=build.function("ode", reduced.ode),
        alg=build.function("alg", reduced.alg),
        alg_jacobian=build.function("alg_jacobian", ca.jacobian(reduced.alg, reduced.z)),
        variables=build.function("variables", reduced.values[: len(flat.variables)]),
        guards=build.function("guards", guards),
        guard_rates=build.function("guard_rates", reduced.total_derivative(guards)),
        guards_soon=build.function("guards_soon", _soon(reduced, guards)),
        moments=build.function("moments", moments),
        resets=build.function("resets", resets),
        reset_nodes=tuple(targets),
        start_conditions=build.function("start_conditions", conditions),
        start_values=build.function("start_values", ca.vertcat(*(ca.SX(s.value) for s in flat.starts))),
        start_system=start_system(reduced),
        start_nodes=tuple(dict.fromkeys(s.node for s in flat.starts)),
        discrete_starts=build.function("discrete_starts", ca.vertcat(*(ca.SX(one.start) for one in flat.discretes))),
        derived=ca.Function("derived", [flat.p], [ca.densify(ca.SX(flat.formulas))], ["p"], ["derived"]),
        determinants=build.function("determinants", determinants),
        transitions=transitions,
        start_modes=start_modes,
        starts=tuple(StartEntry(s.node, reduced.node_states[s.node], s.strength) for s in flat.starts),
        singular=tuple((names, origins) for names, origins, _ in reduced.determinants),
        differentiated=reduced.differentiated,
        guesses=np.array(reduced.guesses, float),
        nominals=np.array(reduced.nominals, float),
        z_guesses=np.array(reduced.z_guesses, float),
        p=np.array([one.value for one in flat.parameters], float),
        u=_input_values(flat),
        components=tuple(flat.components),
        summary=str(reduced),
        settings=dict(getattr(flat.components.get(""), "simulate", {})),
        _reduced=reduced,
    )


def _soon(reduced: ReducedDae, guards: Any) -> Any:
    """Follow guards for one time resolution. Relations that are joined go each their own way: one that stays at zero never counts as true."""
    if not guards.numel():
        return guards
    relations: list[Any] = []
    _joined(guards, lambda relation: relations.append(relation) or relation)
    stacked = ca.vertcat(*relations)
    ahead = TIME_RESOLUTION * ca.fmax(1.0, ca.fabs(reduced.flat.time))
    later = iter(ca.vertsplit(stacked + ahead * reduced.total_derivative(stacked)))
    return _joined(guards, lambda _: next(later))


def _joined(guards: Any, relation: Callable[[Any], Any]) -> Any:
    """Rebuild guards with something else in the place of every relation."""

    def rebuilt(guard: Any) -> Any:
        join = _JOINS.get(guard.op())
        return join(rebuilt(guard.dep(0)), rebuilt(guard.dep(1))) if join else relation(guard)

    return ca.vertcat(*(rebuilt(guard) for guard in ca.vertsplit(guards)))


def _plain(discrete: FlatDiscrete) -> FlatDiscrete:
    """Drop a symbolic start: the function `discrete_starts` has it."""
    return discrete if isinstance(discrete.start, int | float) else replace(discrete, start=0.0)


def _input_values(flat: FlatModel) -> Vector:
    root = flat.components[""]
    given = [root.value(flat.variables[k].path) for k in flat.inputs]
    return np.array([0.0 if value is None or value.number is None else value.number for value in given], float)


class _Builder:
    def __init__(self, reduced: ReducedDae) -> None:
        self.reduced = reduced
        flat = reduced.flat
        self.arguments = [flat.time, reduced.x, reduced.z, flat.p, reduced.u, flat.d]
        self.place = {one.path: k for k, one in enumerate(flat.discretes)}
        self.variable = {one.path: k for k, one in enumerate(flat.variables)}

    def function(self, name: str, expression: Any) -> ca.Function:
        return ca.Function(name, self.arguments, [ca.densify(ca.SX(expression))] if name != "alg_jacobian" else [expression],
                           ["t", "x", "z", "p", "u", "d"], [name])  # fmt: skip

    def transitions(self) -> tuple[Any, Any, tuple[CompiledTransition, ...], Any, list[int]]:
        """Return guards, moments, transitions, reset values and reset nodes of all instances."""
        reduced, flat = self.reduced, self.reduced.flat
        columns = {name: evaluate(flat, name, reduced.values) for name in ("guards", "moments", "resets")}
        guards: list[Any] = []
        moments: list[Any] = []
        resets: list[Any] = []
        targets: list[int] = []
        found: list[CompiledTransition] = []
        for number, instance in enumerate(flat.instances):
            prefix = f"{instance.path}." if instance.path else ""
            for form in instance.template.transitions:
                own, store = (columns["moments"], moments) if form.timed else (columns["guards"], guards)
                store.append(own[number][form.index])
                changes: list[Reset] = []
                for path, position in form.resets:
                    changes.append(self._reset(prefix + path, len(resets), targets))
                    resets.append(columns["resets"][number][position])
                found.append(self._transition(prefix, form, len(store) - 1, tuple(changes)))
        return ca.vertcat(*guards), ca.vertcat(*moments), tuple(found), ca.vertcat(*resets), targets

    def _transition(self, prefix: str, form: TransitionForm, index: int, resets: tuple[Reset, ...]) -> CompiledTransition:
        return CompiledTransition(
            self.place[prefix + form.mode], form.sources, form.target, form.timed, index, resets, form.source
        )

    def _reset(self, path: str, value: int, targets: list[int]) -> Reset:
        if path in self.place:
            return Reset("discrete", self.place[path], 1.0, value, 0)
        node = self.variable[path]
        state = self.reduced.node_states[node]
        if state is not None:
            return Reset("state", state[0], state[1], value, 0)
        targets.append(node)
        return Reset("value", -1, 1.0, value, len(targets) - 1)

    def start_modes(self) -> tuple[Any, tuple[tuple[int, int, Source], ...]]:
        flat = self.reduced.flat
        columns = evaluate(flat, "start_conditions", self.reduced.values)
        conditions: list[Any] = []
        modes: list[tuple[int, int, Source]] = []
        for number, instance in enumerate(flat.instances):
            prefix = f"{instance.path}." if instance.path else ""
            for row, (mode, target, source) in enumerate(instance.template.start_modes):
                conditions.append(columns[number][row])
                modes.append((self.place[prefix + mode], target, source))
        return ca.vertcat(*conditions), tuple(modes)


def _energy(reduced: ReducedDae) -> ca.Function:
    """Evaluate the energy terms of every component."""
    flat = reduced.flat
    variable = {one.path: k for k, one in enumerate(flat.variables)}
    rows: list[Any] = []
    for instance in flat.instances:
        template = instance.template
        prefix = f"{instance.path}." if instance.path else ""
        slots: list[Any] = []
        for slot in template.energy_slots:
            node = variable[prefix + slot.path]
            value = reduced.values[node] if slot.order == 0 else reduced.rate(node)
            slots.append(value)
        v = ca.vertcat(*slots) if slots else ca.SX(0, 1)
        p = flat.q[list(instance.parameters)] if instance.parameters else ca.SX(0, 1)
        d = flat.d[list(instance.discretes)] if instance.discretes else ca.SX(0, 1)
        terms = template.energy(v, p, d, flat.time)
        powers = terms[3:]
        inflow = ca.sum1(powers) if powers.numel() else ca.SX(0)
        rows.append(ca.horzcat(terms[0], terms[1], terms[2], inflow))
    build = _Builder(reduced)
    return build.function("energy", ca.vertcat(*rows))
