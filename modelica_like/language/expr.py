"""Expressions and symbols: a typed interface to `casadi.SX`."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, cast
from weakref import WeakValueDictionary

import casadi as ca

from modelica_like.language.inside import inside

if TYPE_CHECKING:

    class Expr:
        """Scalar symbolic expression (at run time a `casadi.SX`)."""

        def __add__(self, other: Scalar) -> Expr: ...
        def __radd__(self, other: Scalar) -> Expr: ...
        def __sub__(self, other: Scalar) -> Expr: ...
        def __rsub__(self, other: Scalar) -> Expr: ...
        def __mul__(self, other: Scalar) -> Expr: ...
        def __rmul__(self, other: Scalar) -> Expr: ...
        def __truediv__(self, other: Scalar) -> Expr: ...
        def __rtruediv__(self, other: Scalar) -> Expr: ...
        def __pow__(self, other: Scalar) -> Expr: ...
        def __rpow__(self, other: Scalar) -> Expr: ...
        def __neg__(self) -> Expr: ...
        def __pos__(self) -> Expr: ...
        def __abs__(self) -> Expr: ...
        def __lt__(self, other: Scalar) -> Expr: ...
        def __le__(self, other: Scalar) -> Expr: ...
        def __gt__(self, other: Scalar) -> Expr: ...
        def __ge__(self, other: Scalar) -> Expr: ...
        def __eq__(self, other: Scalar) -> Expr: ...  # type: ignore[override]
        def __ne__(self, other: Scalar) -> Expr: ...  # type: ignore[override]
        def __hash__(self) -> int: ...

    Scalar = Expr | float
else:
    Expr = ca.SX
    Scalar = object


class Symbol(Expr):
    """A named leaf of expressions for a field of a component.

    Attributes:
        owner: the component or connector that declares the field; None for time.
        name: name of the field.
        order: order of the time derivative (0: the variable itself).
    """

    owner: Any
    name: str
    order: int
    before: Symbol | None = None
    """Its value before an event; made by `pre`."""

    def __init__(self, owner: Any, name: str, order: int = 0) -> None:
        label = f"{'der(' * order}{name}{')' * order}"
        super().__init__(ca.SX.sym(label))  # pyright: ignore[reportCallIssue] -- Expr is casadi.SX at run time
        self.owner = owner
        self.name = name
        self.order = order
        _symbols[leaf_id(self)] = self

    def derivative(self) -> Symbol:
        """Return the symbol of the time derivative, one order higher."""
        return symbol_of(self.owner, self.name, self.order + 1)


# CasADi's leaves carry no payload; this identity map (entries live as long as their component) finds the symbol of a
# leaf.
_symbols: WeakValueDictionary[int, Symbol] = WeakValueDictionary()


def leaf_id(leaf: Expr) -> int:
    """Return the identity of a leaf of an expression."""
    return int(cast(Any, leaf).element_hash())


def symbol_of(owner: Any, name: str, order: int = 0) -> Symbol:
    """Return the symbol for a field, always the same one.

    Args:
        owner: the component or connector.
        name: of the field.
        order: order of the time derivative.
    """
    cache: dict[tuple[str, int], Symbol] = inside(owner).symbols
    if (name, order) not in cache:
        cache[name, order] = Symbol(owner, name, order)
    return cache[name, order]


def symbols_in(expression: Expr) -> list[Symbol]:
    """Return the symbols that occur in an expression."""
    whole: Any = expression if isinstance(expression, ca.SX) else ca.SX(cast(Any, expression))
    return [_symbols[leaf_id(leaf)] for leaf in ca.symvar(whole)]


def operands(node: Any) -> list[Any]:
    """Return what the outermost operation of an expression is applied to."""
    return [node.dep(k) for k in range(node.n_dep())]


_FLAG = re.compile(r"prescribed\((\w+)\)")


def flag_name(name: str) -> str:
    """Return the name of the symbol for "the motion is prescribed"."""
    return f"prescribed({name})"


def flagged_motion(name: str) -> str:
    """Return the name of the motion of such a symbol, or an empty text for other symbols."""
    match = _FLAG.fullmatch(name)
    return match.group(1) if match else ""


TIME = Symbol(None, "time")
"""Time in seconds, the independent variable of every model."""


def is_expression(value: object) -> bool:
    """Return whether `value` is symbolic rather than a number."""
    return isinstance(value, ca.SX)
