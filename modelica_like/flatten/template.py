"""Templates: the equations of a component class, made once for all its instances."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, cast

import casadi as ca

from modelica_like.errors import Source
from modelica_like.flatten.at_once import between_events, following
from modelica_like.flatten.checks import check_balance, check_units, unit_of_field
from modelica_like.flatten.conditions import guard_of
from modelica_like.flatten.discrete import DiscreteEquations, Hidden, UpdateForm, is_discrete
from modelica_like.flatten.holds import (
    HoldForm,
    IdealForm,
    LockForm,
    hold_forms,
    ideal_forms,
    lock_forms,
    starts_at_rest,
)
from modelica_like.flatten.names import InitialResidual, Names, Slot, column, path_of
from modelica_like.flatten.reasons import reason
from modelica_like.flatten.steps import honest, with_events
from modelica_like.flatten.wiring import taken
from modelica_like.language.component import Component
from modelica_like.language.delay import parts
from modelica_like.language.equation import Connection, Equation, FreeEnd, as_equation, as_statement
from modelica_like.language.expr import TIME, Symbol, symbol_of, symbols_in
from modelica_like.language.fields import Variable
from modelica_like.language.functions import der
from modelica_like.language.inside import declarations
from modelica_like.language.mode import StartMode, Transition
from modelica_like.language.places import NOWHERE, located
from modelica_like.language.transition import as_event
from modelica_like.language.tunable import symbols_in_tables
from modelica_like.language.units import ANY, Unit


@dataclass(frozen=True)
class LinearForm:
    """sum(coefficients * slots) + constant = 0; coefficients are functions of parameters.

    Attributes:
        slots: numbers of the slots.
        coefficients: a number, or the position in `Template.coefficients`.
        constant: likewise.
    """

    slots: tuple[int, ...]
    coefficients: tuple[float | str, ...]
    constant: float | str


ModeT = TypeVar("ModeT")
ResetT = TypeVar("ResetT")


@dataclass(frozen=True)
class TransitionForm(Generic[ModeT, ResetT]):
    """A transition without its expressions.

    Attributes:
        mode: in a template the path of the mode from the component, in a compiled model its position in d.
        sources: numbers of the modes it leaves.
        target: number of the mode it enters.
        timed: whether it is a time event.
        index: position in the guards, or in the moments.
        resets: what else changes; in a template pairs of what is reset (slot path) and the position in the resets.
        notice: message for the user.
        because: why it happens, in words; names of parameters in braces stand for name and value.
        fails: whether the run ends there, with an error.
        ends: whether the run ends there regularly, with the notice as the reason.
    """

    mode: ModeT
    sources: tuple[int, ...]
    target: int
    timed: bool
    index: int
    resets: tuple[ResetT, ...]
    source: Source
    notice: str
    because: str
    fails: bool
    ends: bool = False


ClassTransition = TransitionForm[str, tuple[str, int]]
"""A transition of a template."""


@dataclass(frozen=True, eq=False)
class Template:
    """The equations of a component, as CasADi functions of (v, p, d, t).

    v are the slots, p the parameters, d modes and discrete values, t time. `updates` has two rows per update: whether
    its target gets a new value, and the value. `delays` has two rows per delay: the value, and the time of the delay.
    """

    component: str
    slots: tuple[Slot, ...]
    parameters: tuple[str, ...]
    discretes: tuple[str, ...]
    residual: ca.Function
    sources: tuple[Source, ...]
    initial: tuple[tuple[str, str], ...]
    incidence: tuple[tuple[int, ...], ...]
    linear: tuple[LinearForm | None, ...]
    coefficients: ca.Function
    transitions: tuple[ClassTransition, ...]
    guards: ca.Function
    moments: ca.Function
    resets: ca.Function
    start_modes: tuple[tuple[str, int, Source], ...]
    start_conditions: ca.Function
    started: tuple[str, ...]
    discrete_starts: ca.Function
    hidden: tuple[Hidden, ...]
    updates: ca.Function
    update_forms: tuple[UpdateForm, ...]
    delays: ca.Function
    delay_parts: tuple[tuple[str, ...], ...]
    holds: tuple[HoldForm, ...]
    hold_terms: ca.Function
    ideals: tuple[IdealForm, ...]
    locks: tuple[LockForm, ...]
    lock_terms: ca.Function
    energy_slots: tuple[Slot, ...]
    energy: ca.Function
    connections: tuple[Connection | FreeEnd, ...]
    inferred: dict[str, Unit]


def template_of(component: Component) -> Template:
    """Return the template of a component; leaf components of one class and structure share theirs.

    Raises:
        LanguageError, UnitMismatch, ComponentUnbalanced: the class is declared wrongly.
    """
    declared = declarations(component)
    if component.parts or component.fields is not declared.fields:
        with symbols_in_tables(component):
            return _build(component)
    structural = tuple(getattr(component, name) for name in declared.structural)
    used = tuple(name for name, connector in component.connectors.items() if connector.used)
    given = tuple(name for name, field in component.fields.items() if field.default is None and component.given(name))
    units = tuple(str(unit_of_field(component, name)) for name, f in component.fields.items() if f.unit == ANY)
    key = structural, used, given, units
    if key not in declared.templates:
        declared.templates[key] = _build(component)
    return declared.templates[key]


def _build(component: Component) -> Template:
    kind = type(component).__name__
    equations, determined, at_start, wiring = _statements(component)
    initial = [e for e in at_start if not is_discrete(e)]
    events = [as_event(item, source, kind) for item, source in located(component.events(), f"{kind}.events()")]
    starts = [InitialResidual(component, f"initial[{k}]") for k in range(1, len(initial) + 1)]
    residuals = [with_events(following(between_events(e.left - e.right), determined)) for e in equations]
    sources = tuple(e.source for e in (*equations, *initial))
    residuals += [honest(start - (e.left - e.right)) for start, e in zip(starts, initial, strict=True)]
    (holds, hold_terms), (locks, lock_terms) = hold_forms(component, residuals), lock_forms(equations)
    energy, energy_terms = Names(component), _energy_terms(component, wiring)
    others = [*zip(residuals, sources, strict=True), *((term, NOWHERE) for term in energy_terms)]
    discrete = DiscreteEquations(component, determined, events, others, [e for e in at_start if is_discrete(e)])
    checked = [*equations, *initial], discrete.events, discrete.updates, discrete.delays
    inferred = check_units(component, *checked) if component.units_checked else {}
    changes, names = _Changes(component, discrete), Names(component)
    held = (ca.SX(symbol_of(component, name)) for hold in holds for name in (hold.motion, hold.reaction) if name)
    names.add([*residuals, *hold_terms, *lock_terms, *changes.expressions(), *held])
    discrete.check_determined(names.discretes)
    energy.parameters, energy.discretes = names.parameters, names.discretes
    energy.add(energy_terms)
    residual, (linear, coefficients) = names.function("residual", residuals), _linear_forms(names, residuals)
    return Template(
        component=kind,
        slots=tuple(names.variables),
        parameters=tuple(names.parameters),
        discretes=tuple(names.discretes),
        residual=residual,
        sources=sources,
        initial=tuple((s.name, e.source.text.removeprefix("yield ")) for s, e in zip(starts, initial, strict=True)),
        incidence=_rows(residual.jac_sparsity(0, 0)),
        linear=linear,
        coefficients=coefficients,
        **changes.functions(names),
        transitions=changes.transition_forms(),
        start_modes=changes.start_modes(),
        started=tuple(path_of(symbol, component) for symbol, _ in discrete.starts),
        hidden=tuple(discrete.hidden),
        update_forms=discrete.forms(lambda symbol: path_of(symbol, component)),
        delay_parts=tuple(tuple(part.name for part in parts(delay)) for delay, _ in discrete.delays),
        holds=holds,
        hold_terms=names.function("hold_terms", hold_terms),
        ideals=ideal_forms(component, residuals),
        locks=locks,
        lock_terms=names.function("lock_terms", lock_terms),
        energy_slots=tuple(energy.variables),
        energy=energy.function("energy", energy_terms),
        connections=wiring,
        inferred=inferred,
    )


def _statements(
    component: Component,
) -> tuple[list[Equation], list[Equation], list[Equation], tuple[Connection | FreeEnd, ...]]:
    """Return equations, those of discrete variables, those at the start, and connections, with their number checked."""
    kind, written = type(component).__name__, located(component.equations(), f"{type(component).__name__}.equations()")
    statements = [as_statement(item, source, kind) for item, source in written]
    every = [s for s in statements if isinstance(s, Equation)]
    # Parameters that initial equations determine do not change.
    kept = (name for name, field in component.fields.items() if isinstance(field, Variable) and field.constant)
    equations = [s for s in every if not is_discrete(s)] + [
        Equation(der(symbol_of(component, name)), ca.SX(0)) for name in kept
    ]
    at_start = located(component.initial_equations(), f"{kind}.initial_equations()")
    initial = [as_equation(item, source, kind) for item, source in at_start]
    wiring = tuple(s for s in statements if isinstance(s, Connection | FreeEnd))
    joined = {name for joint in wiring if isinstance(joint, Connection) for name in taken(component, joint)}
    check_balance(component, equations, joined)
    return equations, [s for s in every if is_discrete(s)], initial, wiring


class _Changes:
    """Events of a component: conditions and changes."""

    def __init__(self, component: Component, discrete: DiscreteEquations) -> None:
        self.component, self.begun = component, [value for _, value in discrete.starts]
        self.transitions = [e for e in discrete.events if isinstance(e, Transition)]
        self.starts = list(starts_at_rest(component, (e for e in discrete.events if isinstance(e, StartMode))))
        self.updates = [part for update in discrete.updates for part in (update.active, update.value)]
        self.targets = [update.target for update in discrete.updates]
        self.guards = [ca.SX(0) if t.when is None else guard_of(t.when, t.source) for t in self.transitions]
        self.moments = [ca.SX(0) if t.at is None else t.at for t in self.transitions]
        self.delays = [part for delay, _ in discrete.delays for part in (delay.of, delay.offset)]
        self.resets = [pair for t in self.transitions for pair in t.reset.items()]

    def expressions(self) -> Iterator[Any]:
        """Yield all expressions, and the symbols of the modes."""
        yield from (
            *self.guards, *self.moments, *self.updates, *self.delays, *self.begun,
            *(ca.SX(target) for target in self.targets),
        )  # fmt: skip
        for pair in self.resets:
            yield from pair
        yield from (s.when for s in self.starts)
        yield from (ca.SX(s.mode.symbol) for s in (*self.transitions, *self.starts))

    def functions(self, names: Names) -> dict[str, ca.Function]:
        """Return their functions by name."""
        outputs = {
            "guards": self.guards,
            "moments": self.moments,
            "resets": [value for _, value in self.resets],
            "start_conditions": [s.when for s in self.starts],
            "discrete_starts": self.begun,
            "updates": self.updates,
            "delays": self.delays,
        }
        return {name: names.function(name, output) for name, output in outputs.items()}

    def start_modes(self) -> tuple[tuple[str, int, Source], ...]:
        """Return path and number of the modes at the start."""
        return tuple((self._mode(s), s.mode.mode.number(s.target), s.source) for s in self.starts)

    def transition_forms(self) -> tuple[ClassTransition, ...]:
        """Return the transitions without their expressions."""
        forms: list[ClassTransition] = []
        position = 0
        for index, t in enumerate(self.transitions):
            paths = [self._path(symbols_in(target)[0]) for target in t.reset]
            resets = tuple((path, position + k) for k, path in enumerate(paths))
            position += len(paths)
            numbers, target = tuple(t.mode.mode.number(name) for name in t.sources), t.mode.mode.number(t.target)
            words = t.source, t.notice, reason(t, self._path), t.fails, t.ends
            forms.append(TransitionForm(self._mode(t), numbers, target, t.at is not None, index, resets, *words))
        return tuple(forms)

    def _mode(self, statement: Transition | StartMode) -> str:
        return self._path(statement.mode.symbol)

    def _path(self, symbol: Symbol) -> str:
        return path_of(symbol, self.component)


def _energy_terms(component: Component, wiring: Iterable[Connection | FreeEnd]) -> list[Any]:
    """Stored energy, loss, source power, then the power into each connector, without those of parts."""
    passed_on = {id(end) for joint in wiring if isinstance(joint, Connection) for end in joint.ends}
    terms: list[Any] = [component.stored_energy(), component.loss_power(), component.source_power()]
    terms += [c.power() for c in component.connectors.values() if c.used and id(c) not in passed_on]
    return [between_events(ca.SX(cast(Any, term))) for term in terms]


def _rows(sparsity: ca.Sparsity) -> tuple[tuple[int, ...], ...]:
    rows: list[list[int]] = [[] for _ in range(sparsity.size1())]
    for row, slot in zip(*sparsity.get_triplet(), strict=True):
        rows[row].append(slot)
    return tuple(tuple(sorted(row)) for row in rows)


def _linear_forms(names: Names, residuals: list[Any]) -> tuple[tuple[LinearForm | None, ...], ca.Function]:
    """Find the equations that are linear in all their slots, with coefficients that only parameters determine."""
    v, p = column(names.variables.values()), column(names.parameters.values())
    others = ca.vertcat(v, *names.discretes.values(), TIME)
    values: list[Any] = []

    def entry(expression: Any) -> float | str:
        if expression.is_constant():
            return float(expression)
        values.append(expression)
        return str(len(values) - 1)

    forms: list[LinearForm | None] = []
    for residual in residuals:
        jacobian = ca.jacobian(residual, v)
        constant = ca.substitute(residual, v, ca.SX.zeros(v.shape))
        if ca.depends_on(ca.vertcat(*jacobian.nonzeros(), constant), others):
            forms.append(None)
            continue
        columns = jacobian.sparsity().get_triplet()[1]
        entries = tuple(entry(ca.SX(e)) for e in jacobian.nonzeros())
        forms.append(LinearForm(tuple(columns), entries, entry(constant)))
    return tuple(forms), ca.Function("coefficients", [p], [ca.vertcat(*values)])
