"""The flat model: every variable by its path, every equation with its origin, no hierarchy left."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import casadi as ca

from modelica_like import upper
from modelica_like.errors import Source
from modelica_like.flatten.template import Template
from modelica_like.language.component import Component
from modelica_like.language.fields import StatePreference, in_range
from modelica_like.language.units import Unit

INITIAL_EQUATION = "the initial equation"
"""Begins the description of what is left of an initial equation, which is zero at the start."""


@dataclass(frozen=True, slots=True)
class FlatVariable:
    """A continuous variable; no user has declared a hidden one.

    `kind` is local, output, input, potential or flow; `driving` and `difference` are those of `Variable`.
    """

    path: str
    unit: Unit
    description: str
    kind: str
    state: StatePreference
    guess: float
    nominal: float
    min: float | None
    max: float | None
    driving: int = 1
    difference: bool = False
    hidden: bool = False


@dataclass(frozen=True, slots=True)
class FlatParameter:
    """A parameter with its value in SI units; it must exceed the one `above` places before it, if any.

    `written` is the unit in which its value was given, where no unit is declared.
    """

    path: str
    unit: Unit
    description: str
    value: float
    min: float | None
    max: float | None
    tunable: bool
    above: int = 0
    written: Unit | None = None

    def checked(self, number: float, given: object) -> float:
        """Return the number if it is finite and within min and max.

        Raises:
            ValueOutOfRange: it is not.
        """
        return in_range(number, given, self.path, str(self.unit), (self.min, self.max))


@dataclass(frozen=True, slots=True)
class FlatDiscrete:
    """A mode (with `names`) or a discrete value (without); `start` is a number or an expression of parameters.

    `hysteresis` is that of its `Mode`.
    `kind` is number, boolean or integer; a hidden one belongs to a relation or an edge, and no user has declared it.
    """

    path: str
    unit: Unit
    description: str
    start: Any
    names: tuple[str, ...] = ()
    kind: str = "number"
    hidden: bool = False
    hysteresis: str = ""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where an equation comes from: path and type of the component, and the source line."""

    path: str
    kind: str
    source: Source

    def __str__(self) -> str:
        return f"{self.path or self.kind}: {self.source}" if self.source.file else (self.path or self.kind)


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A coefficient that parameters determine.

    `FlatModel.coefficient` builds its expression, which is rarely needed.

    Attributes:
        instance: number of the instance.
        position: position in the template's coefficients.
    """

    instance: int
    position: int


@dataclass(frozen=True, slots=True)
class LinearEquation:
    """sum(coefficient * node) + constant = 0, with coefficients of parameters only.

    Attributes:
        terms: pairs of a node and its coefficient, a number or a `Coefficient`.
        constant: a number, a `Coefficient`, or an expression of parameters.
        row: (instance, row) if it is also a row of a template's residual.
    """

    terms: tuple[tuple[int, float | Coefficient], ...]
    constant: Any
    origin: Origin
    row: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class Instance:
    """A component in the flat model: where its template's slots, parameters and discretes are."""

    path: str
    template: Template
    nodes: tuple[int, ...]
    parameters: tuple[int, ...]
    discretes: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class StartValue:
    """A start value: a number or an expression of parameters.

    Attributes:
        strength: `fixed` (must hold), `default` (holds where nothing else determines the variable), `guess`.
    """

    node: int
    value: Any
    strength: Literal["fixed", "default", "guess"]


@dataclass(frozen=True, eq=False, repr=False)
class FlatModel:
    """Flat equations over nodes; node k < len(variables) is variable k, later nodes are derivatives.

    Attributes:
        nodes: (variable, order) of every node.
        derivative: node -> node of its time derivative.
        p: symbols of the independent parameters.
        derived: parameters that follow from others, and `formulas`: their expressions in p.
        q: expressions of all parameters that instances use (positions in `Instance.parameters`).
        d: symbols of modes and discrete values.
        linear: connection equations, bindings and the components' own linear equations.
        general: (instance, row) of the remaining equations.
        inputs: variables given from outside.
        components: the tree of the model.
        pres: discrete value -> the one that it is the `pre` of; and `initial()` -> itself.
        lefts: discrete value -> the variable (node) whose value before an event it stands for in new values.
        asked: what it was made of: the root, whether open inputs are inputs, and the disturbed signal.
        flags: symbols in q for "the motion is prescribed", with the variable; none once the structure is
            known.
    """

    name: str
    variables: list[FlatVariable]
    nodes: list[tuple[int, int]]
    derivative: dict[int, int]
    parameters: list[FlatParameter]
    p: Any
    q: Any
    derived: list[FlatParameter]
    formulas: Any
    discretes: list[FlatDiscrete]
    d: Any
    time: Any
    instances: list[Instance]
    linear: list[LinearEquation]
    general: list[tuple[int, int]]
    starts: list[StartValue]
    inputs: list[int]
    components: dict[str, Component]
    asked: tuple[Component, bool, str]
    flags: tuple[tuple[Any, int], ...] = ()
    pres: dict[int, int] = field(default_factory=dict[int, int])
    lefts: dict[int, int] = field(default_factory=dict[int, int])

    def node_name(self, node: int) -> str:
        """Return the name of a node: `motor.phi`, `der(motor.phi)`."""
        variable, order = self.nodes[node]
        return f"{'der(' * order}{self.variables[variable].path}{')' * order}"

    def coefficient(self, value: Any) -> Any:
        """Return a coefficient as a number or an expression of parameters."""
        if not isinstance(value, Coefficient):
            return value
        instance = self.instances[value.instance]
        return instance.template.coefficients(self.q[list(instance.parameters)])[value.position]

    def origin(self, instance: int, row: int) -> Origin:
        """Return where an equation of an instance comes from."""
        owner = self.instances[instance]
        return Origin(owner.path, owner.template.component, owner.template.sources[row])

    def __repr__(self) -> str:
        return f"<{self}>"

    def _repr_markdown_(self) -> str:
        return upper.mathematics(self)

    def __str__(self) -> str:
        unknowns = len(self.variables) - len(self.inputs)
        return (
            f"FlatModel {self.name}: {len(self.linear) + len(self.general)} equations, {unknowns} unknowns, "
            f"{len(self.parameters)} parameters, {len(self.discretes)} discrete values"
        )


def evaluate(model: FlatModel, function: str, values: Any) -> dict[int, Any]:
    """Evaluate one function of every instance's template.

    Args:
        model: the flat model.
        function: name of the function in `Template`.
        values: symbolic vector with one entry per node.

    Returns:
        For every instance the column of results.
    """
    groups: dict[int, list[int]] = {}
    for number, instance in enumerate(model.instances):
        groups.setdefault(id(instance.template), []).append(number)
    results: dict[int, Any] = {}
    for members in groups.values():
        call: ca.Function = getattr(model.instances[members[0]].template, function)
        if call.numel_out(0) == 0:
            continue
        v = _gather(values, [model.instances[k].nodes for k in members])
        p = _gather(model.q, [model.instances[k].parameters for k in members])
        d = _gather(model.d, [model.instances[k].discretes for k in members])
        t = ca.repmat(model.time, 1, len(members))
        columns = ca.horzsplit(call.map(len(members))(v, p, d, t))
        results.update(zip(members, columns, strict=True))
    return results


def _gather(vector: Any, rows: list[tuple[int, ...]]) -> Any:
    return ca.reshape(vector[[k for row in rows for k in row]], len(rows[0]), len(rows))
