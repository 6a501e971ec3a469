"""A component written in Modelica: equations and events from resolved expressions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

from modelica_like.errors import LanguageError, ModelicaLikeError, ModelicaTextError, Source
from modelica_like.language import (
    TIME,
    Assembly,
    Connector,
    Equations,
    Events,
    Expr,
    Icon,
    assert_,
    change,
    clock,
    delay,
    der,
    edge,
    floor,
    hold,
    homotopy,
    initial,
    mod,
    pre,
    previous,
    sample,
    sign,
    terminal,
    when,
    where,
)
from modelica_like.language.discrete import Ending, before, is_a, silent
from modelica_like.language.equation import Equation, Lock
from modelica_like.language.expr import Symbol, symbol_of
from modelica_like.language.fields import Discrete, Field, Variable
from modelica_like.language.formula import Formula
from modelica_like.language.functions import above_zero, power
from modelica_like.language.inside import InsideAssembly, inside
from modelica_like.netlist.modelica.calls import JUMPING
from modelica_like.netlist.modelica.fold import CREEP, OUTSIDE, SILENT
from modelica_like.netlist.modelica.laws import SLOT
from modelica_like.netlist.modelica.stiction import STIFF, creep, falls, locking
from modelica_like.netlist.modelica.tree import Expr as Node

MEMORY = "_condition"
"""Behind the name of a signal that changes at events: the value itself, which has one before events."""


@dataclass
class Happening:
    """A `when` with its branches, or an assertion.

    Attributes:
        branches: conditions and new values by name; of an assertion one condition without values.
        source: place in the text.
        text: of an assertion.
    """

    branches: tuple[tuple[tuple[Node, ...], Mapping[str, Node]], ...]
    source: Source
    text: str = ""


@contextmanager
def _told_at(source: Source) -> Iterator[None]:
    """Give errors the place in the text: that of the caller is within this package."""
    try:
        yield
    except ModelicaLikeError as error:
        error.where = (source,)
        raise


TERMINATE, ASSERT = "terminate()", "assert()"
"""Among the new values of a `when`: it ends the run, with this text; and, followed by a number, where a condition is
false then."""


@dataclass(eq=False)
class InsideWritten(InsideAssembly):
    """Of a component whose class is Modelica text.

    Attributes:
        text: path of its class in the text.
        statements: left and right sides of its equations, with their places.
        initial: likewise, of its initial equations.
        happenings: its whens and assertions.
        instants: Boolean signals that are true for instants only.
        slots: arguments, in symbols, of the laws of functions that are being written.
        icon: its symbol, of the annotations of its class.
        late: values of discrete variables before the start that only a run knows, of parts, too.
    """

    text: str = ""
    statements: tuple[tuple[Node, Node, Source], ...] = ()
    initial: tuple[tuple[Node, Node, Source], ...] = ()
    happenings: tuple[Happening, ...] = ()
    instants: frozenset[str] = frozenset()
    slots: list[list[Any]] = field(default_factory=list[list[Any]])
    icon: Icon | None = None
    late: dict[str, Node] = field(default_factory=dict[str, Node])


class Written(Assembly):
    """A component whose class is Modelica text.

    Its numbers have no checked units, as in Modelica. What enters at its connectors counts as given to the outside: the
    text does not say what is stored and what is lost.
    """

    units_checked = False
    parts_are_attributes = False  # one may have the name of a method, such as `start`
    _kept = InsideWritten
    _inside: InsideWritten  # pyright: ignore[reportIncompatibleVariableOverride]

    def __reduce__(self) -> Any:
        # The class is made for one text; another process makes it again.
        return _revived, (type(self).__name__,), self.__getstate__()

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    @property
    def fields(self) -> dict[str, Field]:
        """Declared fields; a copy, because the text of a class decides its equations, and not the class here."""
        return dict(self._inside.own_fields)

    @property
    def icon(self) -> Icon | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The symbol that its class draws."""
        return self._inside.icon

    def equations(self) -> Equations:
        """Yield the connections and the equations, each with its place in the text."""
        yield from super().equations()
        yield from self._equations(self._inside.statements)

    def initial_equations(self) -> Equations:
        """Yield the equations of the start."""
        yield from self._equations(self._inside.initial)

    def _equations(self, statements: Iterable[tuple[Node, Node, Source]]) -> Equations:
        for left, right, source in statements:
            with _told_at(source):
                sides = self.symbolic(left), self.symbolic(right)
            choice = locking(right)
            yield Equation(*sides, source) if choice is None else self._lock(*sides, source, choice)

    def _lock(self, left: Any, right: Any, source: Source, choice: Node) -> Equation:
        condition, (_, *limits) = choice.args[0], choice.args[1].args[1]
        locked = self._symbol(condition.args[0][0])
        # While it is locked, its terms are of the size of the others' by this weight.
        weight = where(locked, STIFF, 1.0, events=False) if self._inside.creeps else 1.0
        fall = falls([self.symbolic(limit) for limit in limits])
        return Equation(weight * left, weight * right, source, Lock(locked.name, fall, self._inside.creeps))

    def events(self) -> Events:
        """Yield the whens and the assertions."""
        for happening in self._inside.happenings:
            with _told_at(happening.source):
                event = self._event(happening)
            if event is not None:
                yield replace(event, source=happening.source)

    def _event(self, happening: Happening) -> Any:
        if happening.text:
            return assert_(self.symbolic(happening.branches[0][0][0]), happening.text)
        event = None
        for conditions, values in happening.branches:
            active = tuple(self.symbolic(condition) for condition in conditions)
            new = dict[Any, Any](self._changed(path, value) for path, value in values.items())
            event = when(active, new) if event is None else event.elsewhen(active, new)
        return event

    def _changed(self, path: str, value: Node) -> tuple[Any, Any]:
        """Return what a `when` changes, and its new value."""
        if path == TERMINATE:
            return Ending(f"says: {value.args[0]}"), 1.0
        if path.startswith(ASSERT):
            holds, words = value.args
            return Ending(words.args[0], fails=True), where(self.symbolic(holds, events=None), 0.0, 1.0, events=None)
        return self._remembered(path), self.symbolic(value, events=None)

    def source_power(self) -> Expr | float:
        """Return minus the power that enters at own connectors, unless parts take it on."""
        joined = {end for ends in self.wires.values() for end in ends}
        total: Any = 0.0
        for name, connector in self.connectors.items():
            total = total if name in joined else total - connector.power()
        return total

    def symbolic(self, node: Node, events: bool | None = True) -> Any:
        """Return a resolved expression in symbols.

        Args:
            node: the expression.
            events: whether its steps make events, as of `where`; None in what changes at events only.
        """
        kind, args = node.kind, node.args
        if kind == "number":
            return ca.SX(args[0])
        if kind == "boolean":
            return ca.SX(1.0 if args[0] else 0.0)
        if kind in ("name", "condition") and args[0][0].startswith(SLOT):
            return self._inside.slots[-1][int(args[0][0].removeprefix(SLOT))]
        if kind == OUTSIDE:
            return self.symbolic(args[0], events)
        if kind == "shared":
            self._inside.slots.append([self.symbolic(argument, events) for argument in args[1:]])
            result = self.symbolic(args[0].result, events)
            self._inside.slots.pop()
            return result
        if kind == "name":
            return self._symbol(args[0][0])
        if kind == "condition":
            symbol = self._remembered(args[0][0])
            discrete = isinstance(symbol.owner.fields[symbol.name], Discrete)
            return symbol if discrete else ca.SX(symbol) > 0.5
        if kind == "native":
            return args[0](*(self.symbolic(argument, events) for argument in args[1:]))
        if kind == "if":
            result = self.symbolic(args[-1], events)
            for condition, value in reversed(list(zip(args[:-1:2], args[1::2], strict=True))):
                result = where(self.symbolic(condition, events), self.symbolic(value, events), result, events=events)
            return result
        if kind == "call":
            if args[0] in ("pre", "edge", "change", "previous") and args[1][0].kind == "name":
                return self._called(args[0], [self._remembered(args[1][0].args[0][0])], events)
            if args[0] == CREEP:
                return creep([self.symbolic(value, events) for value in args[1]]) if self._inside.creeps else ca.SX(0)
            if args[0] == SILENT:
                return self._operation(args[1][0], events, quiet=True)
            events = False if args[0] == "noEvent" and events else events
        return self._operation(node, events, quiet=events is False)

    def _operation(self, node: Node, events: bool | None, *, quiet: bool) -> Any:
        """Return a call or an operation in symbols; `quiet` is its own, `events` what its operands have."""
        operands = node.args[1] if node.kind == "call" else node.args
        values = [self.symbolic(operand, events) for operand in operands]
        if node.kind == "call":
            return self._called(node.args[0], values, False if quiet else events)
        result = _OPERATIONS[node.kind](*values)
        return silent(result) if quiet and node.kind in _RELATIONS else result

    def _remembered(self, path: str) -> Any:
        """Return the symbol of a variable; of a signal that changes at events that of its value itself."""
        symbol = self._symbol(path)
        kept = f"{symbol.name}{MEMORY}"
        return symbol_of(symbol.owner, kept) if symbol.owner and kept in symbol.owner.fields else symbol

    def _called(self, name: str, values: list[Any], events: bool | None) -> Any:
        if name == "pre" and not (isinstance(values[0], Symbol) and is_a(values[0], Discrete)):
            if not isinstance(values[0], Symbol) or not (values[0] is TIME or is_a(values[0], Variable)):
                return values[0]
            if events is None and values[0] is not TIME:
                return before(values[0])
            what = f"pre({values[0]}): only what changes at events has a value before them."
            raise LanguageError(what, advice="In a 'when', name a variable.")
        return _STEPPED[name](*values, events) if name in JUMPING else FUNCTIONS[name](*values)

    def _symbol(self, path: str) -> Any:
        if path == "time":
            return TIME
        owner: Any = self
        *steps, last = path.split(".")
        for step in steps:
            inside = {} if isinstance(owner, Connector) else {**owner.parts, **owner.connectors}
            if step not in inside:
                raise LanguageError(f"{self.label} uses {path}, but there is no '{step}'.")
            owner = inside[step]
        if last not in owner.fields:
            raise LanguageError(f"{self.label} uses {path}, but {owner.label} has no variable '{last}'.")
        return symbol_of(owner, last)


class WrittenConnector(Connector):
    """A connector whose class is Modelica text; its fields are its own."""

    kind = ""


_RELATIONS: dict[str, Callable[..., Any]] = {
    "<": lambda a, b: a < b, "<=": lambda a, b: a <= b, ">": lambda a, b: a > b, ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b, "<>": lambda a, b: a != b,
}  # fmt: skip
_OPERATIONS: dict[str, Callable[..., Any]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
    "^": power, "neg": lambda a: -a,
    **_RELATIONS, "and": ca.logic_and, "or": ca.logic_or, "not": ca.logic_not,
}  # fmt: skip
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(ca, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh")},
    **{name: getattr(ca, name) for name in ("tanh", "exp", "log", "log10")},
    "sqrt": lambda x: above_zero(ca.sqrt, x),
    "abs": ca.fabs, "min": ca.fmin, "max": ca.fmax, "noEvent": lambda x: x,
    "der": der, "pre": pre, "edge": edge, "change": change, "initial": initial, "terminal": terminal,
    "delay": lambda value, time, most=None: delay(value, time),
    "sample": lambda value, period=None: sample(value) if period is None else clock(period, value),
    "Clock": lambda period, parts=1: clock(period / parts), "previous": previous, "hold": hold, "homotopy": homotopy,
}  # fmt: skip


def _towards_zero(x: Any, events: bool | None) -> Any:
    return sign(x, events=None if events else events) * floor(ca.fabs(x), events=events)


_STEPPED: dict[str, Callable[..., Any]] = {
    "sign": lambda x, events: sign(x, events=events),
    "floor": lambda x, events: floor(x, events=events), "integer": lambda x, events: floor(x, events=events),
    "ceil": lambda x, events: -floor(-x, events=events),
    "mod": lambda x, y, events: mod(x, y, events=events),
    "div": lambda x, y, events: _towards_zero(x / y, events),
    "rem": lambda x, y, events: x - y * _towards_zero(x / y, events),
}  # fmt: skip
"""Functions that jump, by their arguments and whether the jumps are events."""
_IN_FORMULAS = {"sqrt", "abs", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "tanh", "min", "max"}


_classes: dict[str, type[Written]] = {}


def written_class(name: str) -> type[Written]:
    """Return the class for a name, always the same one."""
    if name not in _classes:
        _classes[name] = type(name, (Written,), {})
    return _classes[name]


def _revived(name: str) -> Written:
    kind = written_class(name)
    return kind.__new__(kind)


def check_determined(component: Written) -> None:
    """Refuse discrete variables of connectors that no class and no connection gives a value.

    Raises:
        ModelicaTextError: there is one.
    """
    owners = [
        (part.path if part is not component else "", part) for part in component.walk() if isinstance(part, Written)
    ]
    given: set[str] = set()
    for path, part in owners:
        sides = [left for left, _, _ in inside(part).statements if left.kind in ("name", "condition")]
        names = [left.args[0][0] for left in sides] + [
            name for event in inside(part).happenings for _, new in event.branches for name in new
        ]
        given.update(f"{path}.{name}" if path else name for name in names)
    for path, part in owners:
        for name in sorted(inside(part).elsewhere):
            variable = f"{path}.{name}" if path else name
            if variable not in given:
                raise ModelicaTextError(
                    f"Nothing gives {variable} a value.",
                    where=part.place_of(),
                    advice="Connect it, or write an equation for it where its connector is.",
                )


def as_formula(node: Node, prefix: str = "") -> Formula | float | None:
    """Return a resolved expression as a formula of parameters, or a number; None if formulas cannot have it.

    Args:
        node: the expression.
        prefix: path of the component whose names it uses, with a dot, seen from where the formula is read.
    """
    if node.kind == "number":
        return node.args[0]
    return _formula(node, prefix)


def _formula(node: Node, prefix: str) -> Formula | None:
    kind, args = node.kind, node.args
    if kind == "number":
        return Formula("number", (args[0],))
    if kind == "name" and args[0][0] != "time" and not args[0][0].startswith("^"):
        return Formula("name", (prefix + args[0][0],))
    if kind == "call" and args[0] in ("noEvent", "homotopy", SILENT):
        return _formula(args[1][0], prefix)
    operation = {"^": "**"}.get(kind, kind) if kind in ("+", "-", "*", "/", "^", "neg") else ""
    operands = args
    if kind == "call" and args[0] in _IN_FORMULAS:
        operation, operands = args[0], args[1]
    inner = [_formula(operand, prefix) for operand in operands] if operation else [None]
    return None if any(operand is None for operand in inner) else Formula(operation, tuple(inner))
