"""A component written in Modelica: equations and events from resolved expressions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

from modelica_like.errors import LanguageError, Source
from modelica_like.language import TIME, Assembly, Connector, Equations, Events, Expr, Mode, der, where
from modelica_like.language.equation import Equation
from modelica_like.language.expr import symbol_of
from modelica_like.language.fields import Field
from modelica_like.language.formula import Formula
from modelica_like.modelica_text.tree import Expr as Node

YES, NO = "yes", "no"


@dataclass
class Happening:
    """A `when`, an `assert` or a relation, as transitions of one mode.

    Attributes:
        mode: name of the mode; it is `yes` while the condition holds.
        condition: of a state event.
        moments: start and period of a time event; the discrete value `mode_next` has its next time.
        resets: new values by name.
        notice: text of a run that ends here; empty: it goes on.
        source: place in the text.
    """

    mode: str
    condition: Node | None
    source: Source
    moments: tuple[Node, Node] | None = None
    resets: Mapping[str, Node] = field(default_factory=dict[str, Node])
    notice: str = ""


class Written(Assembly):
    """A component whose class is Modelica text.

    Its numbers have no checked units, as in Modelica. What enters at its connectors counts as given to the outside: the
    text does not say what is stored and what is lost.
    """

    units_checked = False
    _statements: tuple[tuple[Node, Node, Source], ...] = ()
    _happenings: tuple[Happening, ...] = ()

    def __reduce__(self) -> Any:
        # The class is made for one text; another process makes it again.
        return _revived, (type(self).__name__, dict(self._class_modes)), self.__getstate__()

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    @property
    def fields(self) -> dict[str, Field]:
        """Declared fields; a copy, because the text of a class decides its equations, and not the class here."""
        return dict(self._own_fields)

    def equations(self) -> Equations:
        """Yield the connections and the equations, each with its place in the text."""
        yield from super().equations()
        for left, right, source in self._statements:
            yield Equation(self.symbolic(left), self.symbolic(right), source)  # type: ignore[misc]

    def events(self) -> Events:
        """Yield the transitions of relations, whens and assertions."""
        for one in self._happenings:
            yield from (replace(event, source=one.source) for event in self._transitions(one))

    def _transitions(self, one: Happening) -> Events:
        mode = getattr(self, one.mode)
        resets = {
            symbol_of(self._owner_of(path), path.rpartition(".")[2]): self.symbolic(new)
            for path, new in one.resets.items()
        }
        if one.moments is not None:
            following = symbol_of(self, f"{one.mode}_next")
            resets[following] = following + self.symbolic(one.moments[1])
            yield mode.go(NO, NO, at=following, reset=resets)
            return
        assert one.condition is not None
        condition = self.symbolic(one.condition)
        yield mode.initially(YES, when=condition)
        if one.notice:
            yield mode.go(NO, YES, when=condition, notice=one.notice, fails=True)
            return
        yield mode.go(NO, YES, when=condition, reset=resets)
        yield mode.go(YES, NO, when=ca.logic_not(condition))

    def source_power(self) -> Expr | float:
        """Return minus the power that enters at own connectors, unless parts take it on."""
        if self._parts:
            return 0.0
        total: Any = 0.0
        for one in self.connectors.values():
            total = total - one.power()
        return total

    def symbolic(self, node: Node) -> Any:
        """Return a resolved expression in symbols."""
        kind, args = node.kind, node.args
        if kind == "number":
            return ca.SX(args[0])
        if kind == "boolean":
            return ca.SX(1.0 if args[0] else 0.0)
        if kind == "name":
            return self._symbol(args[0][0])
        if kind == "condition":
            return ca.SX(self._symbol(args[0][0])) > 0.5
        if kind == "mode":
            return getattr(self, args[0]).is_(YES)
        if kind == "if":
            made = self.symbolic(args[-1])
            for condition, value in reversed(list(zip(args[:-1:2], args[1::2], strict=True))):
                made = where(self.symbolic(condition), self.symbolic(value), made)
            return made
        if kind == "call":
            return self._called(args[0], [self.symbolic(one) for one in args[1]])
        return _OPERATIONS[kind](*(self.symbolic(one) for one in args))

    def _called(self, name: str, values: list[Any]) -> Any:
        if name == "der":
            return der(values[0])
        return values[0] if name in ("noEvent", "pre") else FUNCTIONS[name](*values)

    def _symbol(self, path: str) -> Any:
        return TIME if path == "time" else symbol_of(self._owner_of(path), path.rpartition(".")[2])

    def _owner_of(self, path: str) -> Any:
        owner: Any = self
        *steps, last = path.split(".")
        for step in steps:
            following = owner.connectors.get(step) if not isinstance(owner, Connector) else None
            if following is None and not isinstance(owner, Connector):
                following = owner.parts.get(step)
            if following is None:
                raise LanguageError(f"{self.label} uses {path}, but there is no '{step}'.")
            owner = following
        if last not in owner.fields:
            raise LanguageError(f"{self.label} uses {path}, but {owner.label} has no variable '{last}'.")
        return owner


class WrittenConnector(Connector):
    """A connector whose class is Modelica text; its fields are its own."""

    kind = ""


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
    "^": lambda a, b: a**b, "neg": lambda a: -a,
    "<": lambda a, b: a < b, "<=": lambda a, b: a <= b, ">": lambda a, b: a > b, ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b, "<>": lambda a, b: a != b,
    "and": ca.logic_and, "or": ca.logic_or, "not": ca.logic_not,
}  # fmt: skip
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(ca, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh")},
    **{name: getattr(ca, name) for name in ("tanh", "exp", "log", "log10", "sqrt", "floor", "ceil", "sign")},
    "abs": ca.fabs, "min": ca.fmin, "max": ca.fmax, "integer": ca.floor,
    "mod": lambda x, y: x - ca.floor(x / y) * y,
    "div": lambda x, y: ca.sign(x / y) * ca.floor(ca.fabs(x / y)),
    "rem": lambda x, y: x - y * ca.sign(x / y) * ca.floor(ca.fabs(x / y)),
}  # fmt: skip
_IN_FORMULAS = {"sqrt", "abs", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "tanh", "min", "max"}


_classes: dict[tuple[str, tuple[str, ...]], type[Written]] = {}


def written_class(name: str, modes: Mapping[str, Mode]) -> type[Written]:
    """Return the class for a name and modes, always the same one."""
    key = name, tuple(modes)
    if key not in _classes:
        _classes[key] = type(name, (Written,), dict(modes))
    return _classes[key]


def _revived(name: str, modes: Mapping[str, Mode]) -> Written:
    kind = written_class(name, modes)
    return kind.__new__(kind)


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
    if kind == "name" and args[0][0] != "time":
        return Formula("name", (prefix + args[0][0],))
    if kind == "call" and args[0] == "noEvent":
        return _formula(args[1][0], prefix)
    operation = {"^": "**"}.get(kind, kind) if kind in ("+", "-", "*", "/", "^", "neg") else ""
    operands = args
    if kind == "call" and args[0] in _IN_FORMULAS:
        operation, operands = args[0], args[1]
    inner = [_formula(one, prefix) for one in operands] if operation else [None]
    return None if any(one is None for one in inner) else Formula(operation, tuple(inner))
