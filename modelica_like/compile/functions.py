"""Compile a reduced system to CasADi functions and tables."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae, CompiledTerminal, Vector
from modelica_like.compile.energy import energy_terms
from modelica_like.compile.fresh import judged_afresh
from modelica_like.compile.groups import (
    CompiledTransition,
    Equations,
    EventTables,
    Held,
    Reset,
    StartEntry,
    Starts,
)
from modelica_like.compile.keeping import Keeping
from modelica_like.compile.soon import guards_soon
from modelica_like.compile.start_system import start_system
from modelica_like.compile.updates import updates
from modelica_like.errors import Source
from modelica_like.flatten.model import FlatDiscrete, FlatModel, evaluate
from modelica_like.language.assembly import Assembly
from modelica_like.language.fields import Input
from modelica_like.language.inside import inside
from modelica_like.structure.holds import hold_terms
from modelica_like.structure.reduce import ReducedDae

ROUNDING = 1e-10
"""Size of a held motion that counts as rounding, relative to the largest one of the same unit."""
_SMALLEST = 1e-20
"""Absolute limit of rounding, for drives at rest; the solution of a start has zeros far below it."""
_SOURCE_POWER = 2
_EFFORTS = ("N", "N.m")
StartModes = tuple[tuple[int, int, Source], ...]


def compile(reduced: ReducedDae) -> CompiledDae:
    """Build the functions of a reduced system."""
    flat = reduced.flat
    build = _Builder(reduced)
    terms = ca.vec(hold_terms(flat, reduced.values).T)
    return CompiledDae(
        name=flat.name,
        states=reduced.states,
        implicit=reduced.implicit,
        flat_variables=tuple(flat.variables),
        flat_parameters=tuple(flat.parameters),
        flat_derived=tuple(flat.derived),
        flat_discretes=tuple(_plain(discrete) for discrete in flat.discretes),
        inputs=tuple(flat.inputs),
        equations=build.equations(),
        events=build.events(),
        held=Held(reduced.holds, build.function("hold_terms", terms), reduced.circuits, reduced.ideal),
        starts=build.starts(),
        p=np.array([parameter.value for parameter in flat.parameters], float),
        u=_input_values(flat),
        components=tuple(flat.components),
        places=_places(flat),
        renamed={f"{path}.{name}": to for path, c in flat.components.items() for name, to in c.renamed.items()},
        terminals=_terminals(flat),
        motion_sources=_motion_sources(flat),
        summary=str(reduced),
        settings=_settings(flat.components.get("")),
        _make_energy=lambda: build.function("energy", energy_terms(reduced)),
        _make_start=lambda rest: start_system(reduced, rest),
    )


def _settings(root: Any) -> dict[str, Any]:
    if not isinstance(root, Assembly):
        return {}
    record = inside(root)
    return {**record.simulate, **({"display": record.display} if record.display else {})}


def _discrete_starts(flat: FlatModel, conditions: Any, modes: StartModes, moving: Any) -> Any:
    starts = [ca.SX(discrete.start) for discrete in flat.discretes]
    places = {discrete.path: k for k, discrete in enumerate(flat.discretes)}
    # Initial equations of discrete variables have no variables; a start value that is given takes their place.
    for number, column in evaluate(flat, "discrete_starts", ca.SX.zeros(len(flat.nodes))).items():
        instance = flat.instances[number]
        for name, value in zip(instance.template.started, ca.vertsplit(column), strict=True):
            full = f"{instance.path}.{name}".lstrip(".")
            owner, _, own = full.rpartition(".")
            if own not in inside(flat.components[owner]).starts:
                starts[places[full]] = value
    # What time and parameters alone decide is known where the search begins: a branch not taken may be infinite.
    for (mode, target, _), condition in zip(modes, ca.vertsplit(conditions) if modes else (), strict=True):
        if flat.discretes[mode].hidden and not ca.depends_on(condition, moving):
            starts[mode] = ca.if_else(condition, target, starts[mode])
    return ca.vertcat(*starts, ca.SX.zeros(flat.d.numel() - len(starts)))


def _places(flat: FlatModel) -> dict[str, Source]:
    """Source places of the parts of netlists, and of their start values."""
    places = {path: component.place_of() for path, component in flat.components.items()}
    for path, component in flat.components.items():
        # The outermost netlist comes first, and counts.
        for key, source in inside(component).places.items() if isinstance(component, Assembly) else ():
            kind, _, name = key.partition(".")
            if kind in ("start", "guess"):
                places.setdefault(f"{path}.{name}".lstrip("."), source)
    return {path: source for path, source in places.items() if source.file}


def _terminals(flat: FlatModel) -> tuple[CompiledTerminal, ...]:
    """Adaptors that are not driven inside, with the variables of their terminals."""
    inputs = {flat.variables[k].path for k in flat.inputs}
    terminals: list[CompiledTerminal] = []
    for path, component in flat.components.items():
        if component.terminal is not None and path:
            members = tuple((name, f"{path}.{name}") for name in component.terminal_members())
            if all(full in inputs for name, full in members if isinstance(component.fields[name], Input)):
                terminals.append(CompiledTerminal(path, component.terminal.kind, members))
    return tuple(terminals)


def _motion_sources(flat: FlatModel) -> tuple[str, ...]:
    """Components whose power from outside depends on the torque or force at their connectors."""
    kinds = {variable.path: variable for variable in flat.variables}
    sources: list[str] = []
    for instance in flat.instances:
        prefix = f"{instance.path}." if instance.path else ""
        slots = [kinds[prefix + slot.path] for slot in instance.template.energy_slots]
        rows = zip(*instance.template.energy.sparsity_jac(0, 0).get_triplet(), strict=True) if slots else ()
        if any(row == _SOURCE_POWER and slots[k].kind == "flow" and str(slots[k].unit) in _EFFORTS for row, k in rows):
            sources.append(instance.path)
    return tuple(sources)


def _plain(discrete: FlatDiscrete) -> FlatDiscrete:
    """Drop a symbolic start, which the function `discrete_starts` contains."""
    return discrete if isinstance(discrete.start, int | float) else replace(discrete, start=math.nan)


def _input_values(flat: FlatModel) -> Vector:
    places = [flat.variables[k].path.rpartition(".") for k in flat.inputs]
    # An input that is added to a signal belongs to no component.
    given = [flat.components[path].value(name) if path in flat.components else None for path, _, name in places]
    return np.array([0.0 if value is None or value.number is None else value.number for value in given], float)


class _Builder:
    def __init__(self, reduced: ReducedDae) -> None:
        self.reduced = reduced
        flat = reduced.flat
        self.arguments = [flat.time, reduced.x, reduced.z, flat.p, reduced.u, flat.d]
        self.place = {discrete.path: k for k, discrete in enumerate(flat.discretes)}
        self.variable = {variable.path: k for k, variable in enumerate(flat.variables)}
        self.keeping = Keeping(reduced)

    def function(self, name: str, expression: Any) -> ca.Function:
        result = expression if name == "alg_jacobian" else ca.densify(ca.SX(expression))
        return ca.Function(name, self.arguments, [result], ["t", "x", "z", "p", "u", "d"], [name])

    def equations(self) -> Equations:
        """Return what holds at every moment."""
        reduced, flat = self.reduced, self.reduced.flat
        return Equations(
            ode=self.function("ode", reduced.ode),
            alg=self.function("alg", reduced.alg),
            alg_jacobian=self.function("alg_jacobian", ca.jacobian(reduced.alg, reduced.z)),
            variables=self.function("variables", reduced.values[: len(flat.variables)]),
            derived=ca.Function("derived", [flat.p], [ca.densify(ca.SX(flat.formulas))], ["p"], ["derived"]),
            determinants=self.function("determinants", ca.vertcat(*(value for *_, value in reduced.determinants))),
            singular=tuple((names, origins) for names, origins, _ in reduced.determinants),
            implicit_blocks=reduced.implicit_blocks,
            differentiated=reduced.differentiated,
            nominals=np.array(reduced.nominals, float),
        )

    def events(self) -> EventTables:
        """Return what may happen at an instant."""
        reduced, flat = self.reduced, self.reduced.flat
        guards, moments, transitions, resets, targets = self.transitions()
        soon = guards_soon(flat.time, reduced.total_derivative, guards)
        delays, delay_parts = self.delays()
        news, update_rows = updates(
            reduced, partial(self._resets, targets=targets), self._kept, [part[0] for part in delay_parts]
        )
        return EventTables(
            guards=self.function("guards", guards),
            guard_rates=self.function("guard_rates", reduced.total_derivative(guards)),
            guards_soon=self.function("guards_soon", judged_afresh(flat, transitions, soon)),
            moments=self.function("moments", moments),
            transitions=transitions,
            resets=self.function("resets", resets),
            reset_nodes=tuple(targets),
            updates=self.function("updates", news),
            update_rows=update_rows,
            delays=self.function("delays", delays),
            delay_parts=delay_parts,
        )

    def starts(self) -> Starts:
        """Return what is known at the start."""
        reduced, flat = self.reduced, self.reduced.flat
        conditions, modes = self.start_modes()
        moving = ca.vertcat(reduced.x, reduced.z, reduced.u, flat.d)
        return Starts(
            conditions=self.function("start_conditions", conditions),
            modes=modes,
            entries=tuple(StartEntry(s.node, reduced.node_states[s.node], s.strength) for s in flat.starts),
            values=self.function("start_values", ca.vertcat(*(ca.SX(s.value) for s in flat.starts))),
            discretes=self.function("discrete_starts", _discrete_starts(flat, conditions, modes, moving)),
            guesses=np.array(reduced.guesses, float),
            z_guesses=np.array(reduced.z_guesses, float),
        )

    def transitions(self) -> tuple[Any, Any, tuple[CompiledTransition, ...], Any, list[int]]:
        """Return guards, moments, transitions, reset values and reset nodes of all instances."""
        reduced, flat = self.reduced, self.reduced.flat
        columns = {name: evaluate(flat, name, reduced.values) for name in ("guards", "moments", "resets")}
        guards: list[Any] = []
        moments: list[Any] = []
        resets: list[Any] = []
        targets: list[int] = []
        transitions: list[CompiledTransition] = []
        for number, instance in enumerate(flat.instances):
            prefix = f"{instance.path}." if instance.path else ""
            for form in instance.template.transitions:
                values, store = (columns["moments"], moments) if form.timed else (columns["guards"], guards)
                store.append(values[number][form.index])
                changes: list[Reset] = []
                for path, position in form.resets:
                    news = columns["resets"][number][position], *self._kept(prefix + path)
                    changes += self._resets(prefix + path, len(resets), targets)
                    resets += news
                numbers = {"mode": self.place[prefix + form.mode], "index": len(store) - 1, "resets": tuple(changes)}
                transitions.append(CompiledTransition(**{**vars(form), **numbers}))
        for choice in reduced.choices:
            changes = [Reset(kind, place, 1.0, k, 0) for k, (kind, place, _) in enumerate(choice.resets, len(resets))]
            resets += [value for *_, value in choice.resets]
            why, source = f"the states of {choice.told} would become singular", choice.origin.source
            transitions.append(
                CompiledTransition(choice.mode, (0,), 0, False, len(guards), (*changes,), source, "", why, fails=False)
            )
            guards.append(choice.guard)
        return ca.vertcat(*guards), ca.vertcat(*moments), tuple(transitions), ca.vertcat(*resets), targets

    def delays(self) -> tuple[Any, tuple[tuple[int, ...], ...]]:
        """Return values and times of the delays of all instances, and the places of their numbers in d."""
        flat = self.reduced.flat
        columns = evaluate(flat, "delays", self.reduced.values)
        places: list[tuple[int, ...]] = []
        for instance in flat.instances:
            prefix = f"{instance.path}." if instance.path else ""
            places += [tuple(self.place[prefix + name] for name in names) for names in instance.template.delay_parts]
        return ca.vertcat(*(columns[k] for k in sorted(columns))), tuple(places)

    def _kept(self, path: str) -> list[Any]:
        """Return the values of what keeps its value where a variable gets a new one."""
        return [] if path in self.place else [self.reduced.values[k] for k in self.keeping.beside(self.variable[path])]

    def _resets(self, path: str, value: int, targets: list[int]) -> list[Reset]:
        """Return what gets the new values from number `value` on: a variable, and what keeps its value then."""
        if path in self.place:
            return [Reset("discrete", self.place[path], 1.0, value, 0)]
        node = self.variable[path]
        state = self.reduced.node_states[node]
        if self.sets_states and state is not None:
            return [Reset("state", state[0], state[1], value, 0)]
        first, (same, factor) = len(targets), self.keeping.same(node)
        kept = self.keeping.beside(node)
        targets += [same, *kept]
        return [Reset("value", -1, 0.0 if k else factor, value + k, first + k) for k in range(1 + len(kept))]

    @cached_property
    def sets_states(self) -> bool:
        """Whether events give new values to states only, and others have nothing to keep then."""
        paths: set[str] = set()
        for instance in self.reduced.flat.instances:
            prefix, template = f"{instance.path}." if instance.path else "", instance.template
            paths |= {prefix + path for form in template.transitions for path, _ in form.resets}
            paths |= {prefix + form.target for form in template.update_forms}
        nodes = [self.variable[path] for path in paths - self.place.keys()]
        return all(self.reduced.node_states[k] is not None and not self.keeping.beside(k) for k in nodes)

    def start_modes(self) -> tuple[Any, StartModes]:
        flat = self.reduced.flat
        columns = evaluate(flat, "start_conditions", self._without_rounding())
        conditions: list[Any] = []
        modes: list[tuple[int, int, Source]] = []
        for number, instance in enumerate(flat.instances):
            prefix = f"{instance.path}." if instance.path else ""
            for row, (mode, target, source) in enumerate(instance.template.start_modes):
                conditions.append(columns[number][row])
                modes.append((self.place[prefix + mode], target, source))
        return ca.vertcat(*conditions), tuple(modes)

    def _without_rounding(self) -> Any:
        """Values of all nodes, with held motions below rounding set to zero.

        A slip within rounding of the largest speed of the drive has no direction; neither has rounding in a drive at
        rest.
        """
        flat, values = self.reduced.flat, ca.SX(self.reduced.values)
        largest: dict[str, Any] = {}
        for hold in self.reduced.holds:
            unit = str(flat.variables[hold.motion].unit)
            if unit not in largest:
                nominal = flat.variables[hold.motion].nominal
                same = [k for k, variable in enumerate(flat.variables) if str(variable.unit) == unit]
                largest[unit] = ca.fmax(nominal, ca.mmax(ca.fabs(self.reduced.values[same])))
            motion = self.reduced.values[hold.motion]
            values[hold.motion] = ca.if_else(ca.fabs(motion) > ROUNDING * ca.fmax(largest[unit], _SMALLEST), motion, 0)
        return values
