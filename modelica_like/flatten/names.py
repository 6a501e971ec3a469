"""Names of the symbols of a component, as they are seen from a component above it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from modelica_like.errors import LanguageError
from modelica_like.language.component import Component
from modelica_like.language.declared import Declared
from modelica_like.language.discrete import HOMOTOPY, INITIAL, TERMINAL, Marker, Pre
from modelica_like.language.expr import TIME, Symbol, flagged_motion, symbols_in
from modelica_like.language.fields import Parameter, Variable
from modelica_like.language.inside import inside


@dataclass(frozen=True)
class Slot:
    """A symbol of a template: path from the component, and order of differentiation."""

    path: str
    order: int


class InitialResidual(Symbol):
    """What is left of an initial equation: zero at the start."""


class Names:
    """Symbols of a component in a fixed order, by kind."""

    def __init__(self, root: Component) -> None:
        self.root = root
        self.variables: dict[Slot, Symbol] = {}
        self.parameters: dict[str, Symbol] = {}
        self.discretes: dict[str, Symbol] = {}

    def add(self, expressions: Iterable[Any]) -> None:
        """Add the symbols of expressions."""
        for expression in expressions:
            for symbol in symbols_in(expression):
                if symbol is not TIME:
                    self._add(symbol)

    def _add(self, symbol: Symbol) -> None:
        path = path_of(symbol, self.root)
        kind = None if symbol.owner is None else symbol.owner.fields.get(symbol.name)
        if isinstance(kind, Variable) or isinstance(symbol, InitialResidual):
            self.variables[Slot(path, symbol.order)] = symbol
        elif isinstance(kind, Parameter) or flagged_motion(symbol.name):
            self.parameters[path] = symbol
        else:
            self.discretes[path] = symbol

    def function(self, name: str, outputs: list[Any]) -> ca.Function:
        """Make a function of all names so far."""
        inputs = [column(group.values()) for group in (self.variables, self.parameters, self.discretes)]
        return ca.Function(name, [*inputs, TIME], [column(outputs)], ["v", "p", "d", "t"], [name])


def column(entries: Iterable[Any]) -> Any:
    """Return a column of expressions, which may have no rows."""
    return ca.SX(ca.vertcat(*entries))


def relative_path(owner: Declared, root: Component, name: str) -> str:
    """Return the dotted path of a field, seen from a component above it.

    Args:
        owner: declares the field.
        root: where the path begins.
        name: of the field.

    Raises:
        LanguageError: the owner is not below the root.
    """
    names = [name]
    node: Declared | None = owner
    while node is not root:
        if node is None:
            raise LanguageError(f"{root.label} uses '{name}' of a component that is not part of it.")
        names.append(inside(node).name)
        node = inside(node).owner
    return ".".join(reversed(names))


def path_of(symbol: Symbol, root: Component) -> str:
    """Return the path of a symbol, seen from a component: `n`, `clutch.n`, `pre(n)`, `relation[1]`, `time`."""
    if isinstance(symbol, Pre):
        return f"pre({path_of(symbol.of, root)})"
    global_one = isinstance(symbol, Marker) or any(symbol is x for x in (TIME, INITIAL, TERMINAL, HOMOTOPY))
    return symbol.name if global_one else relative_path(symbol.owner, root, symbol.name)
