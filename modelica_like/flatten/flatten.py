"""From a component tree to flat equations."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import casadi as ca

from modelica_like.errors import (
    MissingInput,
    MissingValue,
    ModelicaLikeError,
    Source,
    UnknownName,
    WrongConnection,
    did_you_mean,
    raise_together_or_one,
)
from modelica_like.flatten.checks import unit_of_field
from modelica_like.flatten.discrete import Hidden
from modelica_like.flatten.model import (
    INITIAL_EQUATION,
    Coefficient,
    FlatDiscrete,
    FlatModel,
    FlatVariable,
    Instance,
    LinearEquation,
    Origin,
    StartValue,
)  # fmt: skip
from modelica_like.flatten.parameters import Parameters, give_operation
from modelica_like.flatten.template import Template, template_of
from modelica_like.flatten.wiring import Wiring
from modelica_like.language.component import Component
from modelica_like.language.declared import Connector, Declared
from modelica_like.language.discrete import HOMOTOPY, INITIAL, TERMINAL
from modelica_like.language.expr import TIME, flagged_motion
from modelica_like.language.fields import Discrete, Input, Output, Parameter, Variable
from modelica_like.language.inside import inside
from modelica_like.language.scopes import scopes_of
from modelica_like.language.units import ONE, coherent

_WIRE = Source("")


def flatten(root: Component, *, open_inputs: bool = False, disturbed: str = "") -> FlatModel:
    """Write out all equations of a component tree.

    Args:
        root: the model; its own inputs become inputs of the flat model.
        open_inputs: whether unconnected inputs of adaptors, and of parts without a value for them, also become inputs.
        disturbed: path of a connected signal: an input `….added` is added to what its output sends, or its input gets.

    Raises:
        UnknownName: no signal of this path is connected.
        WiringErrors, WrongConnection, FreeFlange, MissingValue: all errors of the wiring, reported together.
        LanguageError, UnitMismatch: a component class is declared wrongly.
        CyclicAssembly: parameters depend on each other cyclically.
    """
    return _Flattener(root, open_inputs, disturbed).run()


def flatten_again(model: FlatModel, yielding: Collection[str]) -> FlatModel:
    """Write out the equations of a model anew, with components whose locks yield, by their paths."""
    root, open_inputs, disturbed = model.asked
    parts = [inside(model.components[path]) for path in yielding]
    try:
        for part in parts:
            part.creeps = True
        return flatten(root, open_inputs=open_inputs, disturbed=disturbed)
    finally:
        for part in parts:
            part.creeps = False


_OF_ALL = {
    INITIAL.name: ("whether a run begins", 1.0),
    TERMINAL.name: ("whether a run ends", 0.0),
    HOMOTOPY.name: ("share of the actual expressions", 1.0),
}
"""Discrete values of the whole model: description and start."""


class _Flattener:
    def __init__(self, root: Component, open_inputs: bool, disturbed: str) -> None:
        self.root = root
        self.open_inputs = open_inputs
        self.disturbed = disturbed
        self.wiring = Wiring()
        self.parameters = Parameters(root)
        self.variables: list[FlatVariable] = []
        self.variable_of: dict[tuple[int, str], int] = {}
        self.nodes: list[tuple[int, int]] = []
        self.derivative: dict[int, int] = {}
        self.discretes: list[FlatDiscrete] = []
        self.discrete_of: dict[tuple[int, str], int] = {}
        self.linear: list[LinearEquation] = []
        self.starts: list[StartValue] = []
        self.inputs: list[int] = []
        self.flags: list[tuple[Any, int]] = []
        self.pres: dict[int, int] = {}
        self.lefts: dict[int, int] = {}
        self.errors: list[ModelicaLikeError] = []

    def run(self) -> FlatModel:
        templates = self._elaborate()
        used = {self._owner(c, _plain(name)) for c, template in templates for name in template.discretes}
        for component, template in templates:
            self._declare(component, used)
            for path, text in template.initial:
                # What is left of an initial equation is zero at the start.
                full_path, node = f"{component.path}.{path}".lstrip("."), len(self.variables)
                self.variable_of[id(component), path] = node
                description = f"{INITIAL_EQUATION} `{text}`"
                self.variables.append(
                    FlatVariable(full_path, ONE, description, "local", "avoid", 0.0, 1.0, None, None, hidden=True)
                )
                self.starts.append(StartValue(node, 0.0, "fixed"))
            for hidden in template.hidden:
                self._hide(id(component), hidden.path, f"{component.path}.{hidden.path}".lstrip("."), hidden)
        added = self._disturb() if self.disturbed else None
        self.nodes = [(k, 0) for k in range(len(self.variables))]
        instances = [self._instance(component, template) for component, template in templates]
        self._keep_before()
        self._connect(added)
        for component, _ in templates:
            self._bind_inputs(component)
            self._relate_inputs(component)
            self._read_starts(component)
            self.wiring.check_free(component)
        self.wiring.check_signal_units()
        errors = [*self.errors, *self.wiring.errors]
        if errors:
            raise raise_together_or_one(errors)
        self.parameters.check_derived()
        general = self._split_linear(instances)
        d = ca.vertcat(*(ca.SX.sym(discrete.path) for discrete in self.discretes))
        return FlatModel(
            name=self.root.label, variables=self.variables, nodes=self.nodes, derivative=self.derivative,
            parameters=self.parameters.flat, p=self.parameters.symbols(), q=self.parameters.expressions(),
            derived=self.parameters.derived, formulas=self.parameters.formulas(),
            discretes=self.discretes, d=d, time=ca.SX(TIME), instances=instances, linear=self.linear,
            general=general, starts=self.starts, inputs=self.inputs,
            components={component.path: component for component, _ in templates},
            asked=(self.root, self.open_inputs, self.disturbed), flags=tuple(self.flags),
            pres=self.pres, lefts=self.lefts,
        )  # fmt: skip

    def _elaborate(self) -> list[tuple[Component, Template]]:
        """Find all templates, owners first: an owner's connections decide which optional connectors its parts have."""
        elaborated: list[tuple[Component, Template]] = []
        for component in self.root.walk():
            for part in component.parts.values():
                for connector in part.connectors.values():
                    inside(connector).used = not connector.optional
            template = template_of(component)
            elaborated.append((component, template))
            for statement in template.connections:
                self.wiring.add(component, statement)
            for name, unit in template.inferred.items():
                self.wiring.inferred[id(component), name] = unit
        return elaborated

    # -- declarations ------------------------------------------------------------------------------------------------

    def _declare(self, component: Component, used: set[tuple[int, str]]) -> None:
        path = component.path
        prefix = f"{path}." if path else ""
        for name, field in component.fields.items():
            if isinstance(field, Variable):
                kind = "input" if isinstance(field, Input) else "output" if isinstance(field, Output) else "local"
                self._declare_variable(component, name, prefix + name, kind, field)
            elif isinstance(field, Discrete):
                self._declare_discrete(component, name, prefix + name, field)
            elif isinstance(field, Parameter):
                self.parameters.declare(component, name, prefix + name)
        # Parameters that are never used or changed (a table with one row) are not part of the model.
        for name, mode in ((n, m) for n, m in component.modes.items() if (id(component), n) in used):
            self.discrete_of[id(component), name] = len(self.discretes)
            start = mode.number(component.start_mode(name))
            discrete = FlatDiscrete(prefix + name, ONE, mode.description, start, mode.names, hysteresis=mode.hysteresis)
            self.discretes.append(discrete)
        for end, connector in component.connectors.items():
            if connector.used:
                for name, field in connector.quantities.items():
                    kind = "flow" if field.is_flow else "potential"
                    self._declare_variable(connector, name, f"{prefix}{end}.{name}", kind, field)

    def _disturb(self) -> int:
        """Declare the input that is added to a signal."""
        signals = {self.variable_of[id(end.owner), end.name] for pair in self.wiring.signals for end in pair[:2]}
        paths = {self.variables[k].path: self.variables[k] for k in sorted(signals)}
        if self.disturbed not in paths:
            near = did_you_mean(self.disturbed, paths)
            raise UnknownName(f"{self.root.label} has no connected signal '{self.disturbed}'{near or '.'}")
        path = f"{self.disturbed}.added"
        added = len(self.variables)
        self.variables.append(replace(paths[self.disturbed], path=path, kind="input", description="added"))
        self.inputs.append(added)
        return added

    def _declare_variable(self, owner: Declared, name: str, path: str, kind: str, field: Variable) -> None:
        self.variable_of[id(owner), name] = len(self.variables)
        unit = coherent(self.wiring.inferred.get((id(owner), name)) or unit_of_field(owner, name))
        limits = field.nominal, *field.bounds, field.driving, field.difference
        self.variables.append(FlatVariable(path, unit, field.description, kind, field.state, field.guess, *limits))

    def _declare_discrete(self, component: Component, name: str, path: str, field: Discrete) -> None:
        self.discrete_of[id(component), name] = len(self.discretes)
        start = self._start(component, name, path)
        self.discretes.append(FlatDiscrete(path, coherent(field.unit), field.description, start, (), field.kind))

    def _start(self, component: Component, name: str, path: str) -> Any:
        """Return a start value, which the owner gives in terms of its names, or the class by default."""
        given, field = inside(component).starts.get(name), component.fields[name]
        value = field.read(field.default) if given is None else given
        with component.at_its_place(name):
            return self.parameters.evaluate(value, scopes_of(component, value, given=given is not None), path)

    def _hide(self, owner: int, name: str, path: str, hidden: Hidden, start: Any = 0.0) -> int:
        """Declare a discrete value that no user has declared."""
        self.discrete_of[owner, name] = len(self.discretes)
        self.discretes.append(FlatDiscrete(path, ONE, hidden.description, start, hidden.names, hidden=True))
        return self.discrete_of[owner, name]

    def _discrete(self, component: Component, path: str) -> int:
        """Return the position of a mode, a discrete value, a `pre`, or one of the whole model."""
        key = (id(None), path) if path in _OF_ALL else self._owner(component, _plain(path))
        if path != _plain(path):
            of, node = self.discrete_of.get(key), self.variable_of.get(key)
            key = key[0], f"pre({key[1]})"
            if key not in self.discrete_of and of is None and node is not None:
                self.lefts[self._hide(*key, f"pre({self.variables[node].path})", Hidden("", ""))] = node
            elif key not in self.discrete_of and of is not None:
                flat = self.discretes[of]
                self.pres[self._hide(*key, f"pre({flat.path})", Hidden("", ""), flat.start)] = of
        elif key not in self.discrete_of:
            about, start = _OF_ALL[path]
            here = self._hide(*key, path, Hidden("", about), start)
            self.pres |= {here: here} if path == INITIAL.name else {}
        return self.discrete_of[key]

    def _keep_before(self) -> None:
        """Keep what all modes were before an event, if that is asked of variables: they follow from modes."""
        if self.lefts:
            self._discrete(self.root, INITIAL.name)
        kept = {*self.pres, *self.pres.values(), *self.lefts}
        for of in range(len(self.discretes) if self.lefts else 0):
            if of not in kept:
                path = f"pre({self.discretes[of].path})"
                self.pres[self._hide(id(None), path, path, Hidden("", ""), self.discretes[of].start)] = of

    # -- instances ---------------------------------------------------------------------------------------------------

    def _instance(self, component: Component, template: Template) -> Instance:
        nodes = [self._node(self.variable_of[self._owner(component, slot.path)], slot.order) for slot in template.slots]
        parameters = [self._parameter(component, name) for name in template.parameters]
        discretes = [self._discrete(component, name) for name in template.discretes]
        return Instance(component.path, template, tuple(nodes), tuple(parameters), tuple(discretes))

    def _owner(self, component: Component, path: str) -> tuple[int, str]:
        """Return identity and field name for a path relative to a component."""
        owner: Any = component
        *names, name = path.split(".")
        for step in names:
            owner = owner.connectors[step] if step in owner.connectors else owner.parts[step]
        return id(owner), name

    def _parameter(self, component: Component, path: str) -> int:
        *names, name = path.split(".")
        owner = component.find(".".join(names))
        if motion := flagged_motion(name):
            flag = ca.SX.sym(f"{owner.path}.{name}")
            self.flags.append((flag, self.variable_of[id(owner), motion]))
            return self.parameters.add(flag)
        try:
            return self.parameters.position(owner, name)
        except MissingValue as error:  # told with the others
            self.errors.append(error)
            return 0

    def _node(self, variable: int, order: int) -> int:
        node = variable
        for level in range(1, order + 1):
            if node not in self.derivative:
                self.derivative[node] = len(self.nodes)
                self.nodes.append((variable, level))
            node = self.derivative[node]
        return node

    # -- equations ---------------------------------------------------------------------------------------------------

    def _connect(self, added: int | None) -> None:
        for ends in self.wiring.sets():
            connectors = [self.wiring.connectors[end] for end in ends]
            first, *_ = ends
            source = self.wiring.sources[first]
            for name, field in self.wiring.connectors[first].quantities.items():
                node, *others = nodes = [self.variable_of[id(connector), name] for connector in connectors]
                origin = Origin(" – ".join(connector.path for connector in connectors), "connection", source)
                if field.is_flow:
                    signs = [1.0 if seen_outside else -1.0 for _, seen_outside in ends]
                    self.linear.append(LinearEquation(tuple(zip(nodes, signs, strict=True)), 0.0, origin))
                else:
                    for other in others:
                        self.linear.append(LinearEquation(((node, 1.0), (other, -1.0)), 0.0, origin))
        for component in self.root.walk():
            for connector in component.connectors.values():
                if connector.used and not self.wiring.is_connected(connector):
                    self._end_flows(connector)
        for driver, sink, source in self.wiring.signals:
            nodes = [self.variable_of[id(symbol.owner), symbol.name] for symbol in (driver, sink)]
            origin = Origin(self.variables[nodes[1]].path, "connection", source)
            terms = (nodes[0], 1.0), (nodes[1], -1.0)
            if added is not None and self.disturbed in (self.variables[node].path for node in nodes):
                terms = (*terms, (added, 1.0))
            self.linear.append(LinearEquation(terms, 0.0, origin))

    def _end_flows(self, connector: Connector) -> None:
        for name, field in connector.quantities.items():
            if field.is_flow:
                node = self.variable_of[id(connector), name]
                self.linear.append(LinearEquation(((node, 1.0),), 0.0, Origin(connector.path, "free end", _WIRE)))

    def _bind_inputs(self, component: Component) -> None:
        for name, field in component.fields.items():
            if not isinstance(field, Input):
                continue
            node = self.variable_of[id(component), name]
            path = self.variables[node].path
            if (id(component), name) in self.wiring.driven:
                if name in inside(component).values:
                    what, advice = f"{path} has a value and a connection: only one can count.", "Remove one of the two."
                    self.errors.append(WrongConnection(what, where=component.place_of(name), advice=advice))
                continue
            if component is self.root or (
                self.open_inputs and (component.terminal is not None or component.value(name) is None)
            ):
                self.inputs.append(node)
            elif component.value(name) is not None:
                value = self.parameters.q(self.parameters.position(component, name))
                self.linear.append(LinearEquation(((node, 1.0),), -value, Origin(path, "value", _WIRE)))
            else:
                what, advice = f"{path} is an input without a value.", "Connect it or give it a value."
                give = give_operation(component, name)
                self.errors.append(MissingInput(what, where=component.place_of(), advice=advice, operation=give))

    def _relate_inputs(self, component: Component) -> None:
        """Declare which open inputs of an adaptor are derivatives of each other."""
        if component.terminal is None:
            return
        for name, rate in component.terminal.rates:
            nodes = [self.variable_of[id(component), key] for key in (name, rate)]
            if all(node in self.inputs for node in nodes):
                terms = ((self._node(nodes[0], 1), 1.0), (nodes[1], -1.0))
                self.linear.append(LinearEquation(terms, 0.0, Origin(component.path, type(component).__name__, _WIRE)))

    def _read_starts(self, component: Component) -> None:
        for name, field in component.fields.items():
            if not isinstance(field, Variable) or isinstance(field, Input):
                continue
            given = inside(component).starts.get(name)
            if given is None and field.default is None:
                continue
            node = self.variable_of[id(component), name]
            start = self._start(component, name, self.variables[node].path)
            strength = "default" if given is None else "fixed" if given.fixed else "guess"
            self.starts.append(StartValue(node, start, strength))

    def _split_linear(self, instances: list[Instance]) -> list[tuple[int, int]]:
        """Move the components' linear equations to the linear ones; return the others."""
        general: list[tuple[int, int]] = []
        for number, instance in enumerate(instances):
            template = instance.template
            for row, form in enumerate(template.linear):
                if form is None:
                    general.append((number, row))
                    continue
                values = [
                    c if isinstance(c, float) else Coefficient(number, int(c))
                    for c in (*form.coefficients, form.constant)
                ]
                terms = tuple(zip((instance.nodes[slot] for slot in form.slots), values, strict=False))
                origin = Origin(instance.path, template.component, template.sources[row])
                self.linear.append(LinearEquation(terms, values[-1], origin, (number, row)))
        return general


def _plain(path: str) -> str:
    """Return the path of what a path is the `pre` of, or the path itself."""
    return path[4:-1] if path.startswith("pre(") else path
