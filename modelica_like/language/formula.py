"""Formulas: parameters that follow from other parameters, as text (`"2*J"`) or in a class body (`2 * J`)."""

from __future__ import annotations

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, cast

import casadi as ca

from modelica_like.errors import NetlistError, UnitError, nearest, question
from modelica_like.language.units import (
    ANY,
    ONE,
    Unit,
    coherent,
    parse_unit,
    plain_digits,
    read_quantity,
    same_dimension,
)
from modelica_like.parsing import parse

_MAX_LENGTH = 2000
_MAX_DEPTH = 150
_SHOWN = 80
_BINARY: dict[type[ast.operator], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**",
}  # fmt: skip
_Operation = Callable[..., Any]
_OPERATIONS: dict[str, _Operation] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "neg": operator.neg,
    "/": cast(_Operation, operator.truediv), "**": cast(_Operation, operator.pow),
    "sqrt": ca.sqrt, "abs": ca.fabs, "sin": ca.sin, "cos": ca.cos, "tan": ca.tan, "exp": ca.exp, "log": ca.log,
    "tanh": ca.tanh, "min": ca.fmin, "max": ca.fmax, "asin": ca.asin, "acos": ca.acos, "atan": ca.atan,
}  # fmt: skip
_FUNCTIONS = ("sqrt", "abs", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "tanh", "min", "max")
CONSTANTS = {"pi": math.pi}
"""Names in formulas that are no parameters."""
_QUANTITY = re.compile(
    r"(?<![\w.])((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?[ \t]+)((?:[^\W\d_]|[%°])[^\s+*,()-]*(?:\([\w.]+\)[\w.]*)?)"
)
_NAME = re.compile(r"(?<![\w.])[^\W\d]\w*(?:\[\d+\])?(?:\.[^\W\d]\w*(?:\[\d+\])?)*")
_NO_SYNTAX = (SyntaxError, ValueError, MemoryError, RecursionError)
_PLACEHOLDER = "_quantity_{}_"
_SAME, _ALIKE = ("neg", "abs"), ("+", "-", "min", "max")
_PRECEDENCE = {"+": 1, "-": 1, "*": 2, "/": 2, "neg": 3, "**": 4}


def _product(left: Unit, right: Unit, *, plain: bool) -> Unit:
    # A plain number in it has whatever unit the place of the formula asks for: `mass*g` is a force.
    return ANY if plain and ANY in (left, right) else left * right


def _operator(sign: str, *, turned: bool = False) -> Callable[[Any, Any], Formula]:
    def apply(part: Any, other: Any) -> Formula:
        return Formula(sign, tuple(as_formula(side) for side in ((other, part) if turned else (part, other))))

    return apply


class Arithmetic:
    """Operators that build formulas in a class body: `2 * J`, `z_ring / z_sun - 1`."""

    __add__, __radd__ = _operator("+"), _operator("+", turned=True)
    __sub__, __rsub__ = _operator("-"), _operator("-", turned=True)
    __mul__, __rmul__ = _operator("*"), _operator("*", turned=True)
    __truediv__, __rtruediv__ = _operator("/"), _operator("/", turned=True)
    __pow__ = _operator("**")

    def __neg__(self) -> Formula:
        return Formula("neg", (as_formula(self),))


@dataclass(frozen=True)
class Formula(Arithmetic):
    """Expression tree over named parameters.

    Attributes:
        operation: `number`, `quantity`, `name`, an operator, or a function name.
        operands: one float, one text with a unit, one dotted path (or the parameter's declaration), or the operand
            formulas.
    """

    operation: str
    operands: tuple[Any, ...]

    def names(self) -> Iterator[str]:
        """Yield the dotted paths of its parameters."""
        if self.operation == "name":
            yield self._name()
        for operand in self.operands:
            if isinstance(operand, Formula):
                yield from operand.names()

    def renamed(self, rename: Callable[[str], str]) -> Formula:
        """Return the formula with other paths of its parameters."""
        if self.operation == "name":
            return Formula("name", (rename(self._name()),))
        return Formula(
            self.operation,
            tuple(operand.renamed(rename) if isinstance(operand, Formula) else operand for operand in self.operands),
        )

    def evaluate(self, lookup: Callable[[str], Any], quantity: Callable[[str], Any] | None = None) -> Any:
        """Compute the value.

        Args:
            lookup: returns the value (a number or an expression) of a path.
            quantity: returns the value of a number with a unit.

        Raises:
            NetlistError: a number has a unit in a formula of plain numbers.
        """
        if self.operation == "number":
            # 1/0 and (-1)**0.5 are values in CasADi's arithmetic, which a check finds; in Python they are exceptions.
            return ca.SX(self.operands[0])
        if self.operation == "quantity":
            if quantity is None:
                raise NetlistError(f"'{self.operands[0]}' has a unit, but this formula takes plain numbers only.")
            return quantity(self.operands[0])
        if self.operation == "name":
            return lookup(self._name())
        return _OPERATIONS[self.operation](*(operand.evaluate(lookup, quantity) for operand in self.operands))

    def unit(self, lookup: Callable[[str], Unit], *, plain: bool = False) -> Unit:
        """Return its unit, by what is written: numbers that cancel take no unit away. Zero fits everything.

        Args:
            lookup: returns the unit of a path.
            plain: whether `ANY` is that of a plain number, which has the unit that its place asks for; otherwise it is
                an unknown one.

        Raises:
            UnitError: units do not fit together.
        """
        kind, operands = self.operation, self.operands
        if kind == "name":
            return lookup(self._name())
        if kind in ("number", "quantity"):
            given = read_quantity(operands[0]) if kind == "quantity" else None
            return coherent(given[1]) if given else ONE if operands[0] else ANY
        units = [operand.unit(lookup, plain=plain) for operand in operands]
        if kind in _ALIKE:
            if not same_dimension(units[0], units[1]):
                raise UnitError(f"'{self}' mixes {units[0]} and {units[1]}.", advice=self._with_unit(units))
            return units[1] if units[0] == ANY else units[0]
        if kind in ("*", "/"):
            return _product(units[0], units[1] if kind == "*" else units[1] ** -1, plain=plain)
        if kind == "**":
            return self._power(*units)
        if kind == "sqrt":
            return units[0] ** 0.5
        if kind not in _SAME and not same_dimension(units[0], ONE):
            raise UnitError(f"'{self}' takes a number; '{operands[0]}' is in {units[0]}.")
        return units[0] if kind in _SAME else ONE

    def _with_unit(self, units: list[Unit]) -> str:
        """Return what to write for an operand that is a plain number beside one with a unit."""
        for operand, other in zip(self.operands, reversed(units), strict=True):
            if operand._is_number():
                return f"Give the number its unit: {float(operand.evaluate(lookup=str)):g} {other}."
        return ""

    def _power(self, base: Unit, exponent: Unit) -> Unit:
        power = self.operands[1]
        if base == ANY or (same_dimension(base, ONE) and same_dimension(exponent, ONE)):
            return base if base == ANY else ONE
        if not power._is_number():
            raise UnitError(f"'{self}': the exponent of something with a unit must be a number.")
        return base ** float(power.evaluate(lookup=str))

    def _is_number(self) -> bool:
        """Return whether it consists of plain numbers only."""
        return self.operation == "number" or all(isinstance(o, Formula) and o._is_number() for o in self.operands)

    def _name(self) -> str:
        # In a class body a parameter is used before its class and name exist: resolve it later.
        named = self.operands[0]
        return named if isinstance(named, str) else named.name

    def __str__(self) -> str:
        return self._text(0)

    def _text(self, outer: int) -> str:
        if self.operation == "number":
            return repr(self.operands[0])
        if self.operation == "name":
            return self._name()
        if self.operation == "quantity":
            return self.operands[0] if outer <= 3 else f"({self.operands[0]})"
        if self.operation in _FUNCTIONS:
            return f"{self.operation}({', '.join(str(operand) for operand in self.operands)})"
        precedence = _PRECEDENCE[self.operation]
        if self.operation == "neg":
            text = f"-{self.operands[0]._text(precedence)}"
        elif self.operation == "**":
            text = f"{self.operands[0]._text(precedence + 1)}**{self.operands[1]._text(precedence)}"
        else:
            text = f"{self.operands[0]._text(precedence)} {self.operation} {self.operands[1]._text(precedence + 1)}"
        return f"({text})" if precedence < outer else text


def as_formula(value: Any) -> Formula:
    """Turn a number, a formula or a parameter declaration into a formula."""
    if isinstance(value, Formula):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return Formula("number", (float(value),))
    if hasattr(value, "unit_text"):
        return Formula("name", (value,))
    raise NetlistError(f"'{value!r}' cannot be used in a formula of parameters.")


def parse_formula(text: str) -> Formula:
    """Read a formula from text: arithmetic, names, quantities, `pi` and a few functions.

    Args:
        text: the formula; a quantity in it is a number, a blank and a unit: `2*J + 1182.6 kg.mm2`.

    Raises:
        NetlistError: the text is not a formula.
    """
    if len(text) > _MAX_LENGTH:
        raise NetlistError(f"A formula of {len(text)} characters is too long (at most {_MAX_LENGTH}).")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            replaced, quantities = _without_quantities(plain_digits(text.strip()))
            tree = parse(replaced, mode="eval")
    except _NO_SYNTAX:
        advice = in_brackets(text)
        raise _not_a_formula(text, "" if advice else _unknown_unit(text), advice) from None
    layer, depth = [tree], 0
    while layer:
        layer = [child for node in layer for child in ast.iter_child_nodes(node)]
        depth += 1
    if depth > _MAX_DEPTH:
        raise _not_a_formula(text, "it is nested too deeply")
    return _convert(tree.body, text, quantities)


def _without_quantities(text: str) -> tuple[str, dict[str, str]]:
    """Replace numbers with a unit by names; also return the quantity of each name."""
    quantities: dict[str, str] = {}

    def name(match: re.Match[str]) -> str:
        if not _is_unit(match.group(2)):
            return match.group()
        placeholder = _PLACEHOLDER.format(len(quantities))
        quantities[placeholder] = match.group()
        return placeholder

    return _QUANTITY.sub(name, text), quantities


def name_places(text: str) -> list[tuple[int, int]]:
    """Return where the paths of parameters stand in the text of a formula."""
    quantities = [match.span() for match in _QUANTITY.finditer(text) if _is_unit(match.group(2))]
    return [
        match.span()
        for match in _NAME.finditer(text)
        if match.group() not in CONSTANTS
        and not text[match.end() :].lstrip().startswith("(")
        and not any(start <= match.start() < end for start, end in quantities)
    ]


def _is_unit(text: str) -> bool:
    try:
        return text not in CONSTANTS and bool(parse_unit(text).factor)
    except UnitError:
        return False


def in_brackets(text: str) -> str:
    """Return the advice to write a formula with its quantities in brackets; empty if that does not help.

    In `10 N.m/z`, the unit goes on to the end: only brackets tell that z is a parameter.
    """

    def put(match: re.Match[str]) -> str:
        number, unit = match.groups()
        if text[match.start() - 1 : match.start()] == "(" and text[match.end() : match.end() + 1] == ")":
            return match.group()
        ends = (end for end in range(len(unit), 0, -1) if unit[end : end + 1] in ("", "/"))
        end = next((end for end in ends if _is_unit(unit[:end])), 0)
        return f"({number}{unit[:end]}){unit[end:]}" if end else match.group()

    if len(text) > _SHOWN:
        return ""
    changed = _QUANTITY.sub(put, text)
    try:
        parse(_without_quantities(changed)[0], mode="eval")
    except _NO_SYNTAX:
        return ""
    told = f'In a formula, a quantity that goes on with / or * is in brackets: "{changed}".'
    return told if changed != text else ""


def _unknown_unit(text: str) -> str:
    """Return that the unit of a quantity in a formula is unknown, or an empty text."""
    for match in _QUANTITY.finditer(text):
        try:
            parse_unit(match.group(2))
        except UnitError as error:
            if error.what.startswith("Unknown") and len(error.what) < _SHOWN:
                return f"u{error.what[1:].rstrip('?.')}"
    return ""


def _not_a_formula(text: str, why: str = "", advice: str = "") -> NetlistError:
    shown = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"
    usual = 'A quantity is a number with a unit ("8.5 kg.cm2"), a formula is arithmetic of parameters ("2*J").'
    if "^" in text:
        usual = 'A power is written with two asterisks: "w**2".'
    what = f"'{shown}' is neither a quantity nor a formula{'; ' + why if why else ''}."
    return NetlistError(what, advice=advice or usual)


def _convert(node: ast.expr, text: str, quantities: dict[str, str]) -> Formula:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        try:
            number = float(node.value)
        except OverflowError:
            number = math.inf
        if math.isinf(number):
            raise _not_a_formula(text, "a number in it is too large")
        return Formula("number", (number,))
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return Formula(
            _BINARY[type(node.op)], (_convert(node.left, text, quantities), _convert(node.right, text, quantities))
        )
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return Formula("neg", (_convert(node.operand, text, quantities),))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.UAdd):
        return _convert(node.operand, text, quantities)
    if isinstance(node, ast.Name | ast.Attribute | ast.Subscript):
        path = _path(node, text)
        if path in quantities:
            return Formula("quantity", (quantities[path],))
        return Formula("number", (CONSTANTS[path],)) if path in CONSTANTS else Formula("name", (path,))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        return _call(node, node.func.id, text, quantities)
    raise _not_a_formula(text)


def _call(node: ast.Call, name: str, text: str, quantities: dict[str, str]) -> Formula:
    if name not in _FUNCTIONS:
        near = nearest(name, _FUNCTIONS)
        error = _not_a_formula(text, f"there is no function '{name}'{question(near).rstrip('?')}")
        error.word, error.instead = name, near
        raise error
    wanted = 2 if name in ("min", "max") else 1
    if len(node.args) != wanted:
        raise _not_a_formula(text, f"{name} takes {wanted} argument{'s' if wanted > 1 else ''}")
    return Formula(name, tuple(_convert(argument, text, quantities) for argument in node.args))


def _path(node: ast.expr, text: str) -> str:
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return f"{_path(node.value, text)}.{node.attr}"
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, int):
        return f"{_path(node.value, text)}[{node.slice.value}]"
    raise _not_a_formula(text)
