"""Arithmetic of resolved expressions: numbers are computed, arrays taken apart."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from typing import Any

from modelica_like.netlist.modelica.calls import JUMPING, Unfit
from modelica_like.netlist.modelica.tree import Empty, Expr, joined, with_operands

_BINARY: dict[str, Callable[[float, float], float]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "^": operator.pow,
}  # fmt: skip
ARITHMETIC = (*_BINARY, "neg")
_RELATIONS: dict[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "<>": operator.ne,
}  # fmt: skip
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(math, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh")},
    **{name: getattr(math, name) for name in ("tanh", "exp", "log", "log10", "sqrt", "floor", "ceil")},
    "abs": abs, "sign": lambda x: float((x > 0) - (x < 0)), "integer": math.floor, "min": min, "max": max,
    "mod": lambda x, y: x - math.floor(x / y) * y, "div": lambda x, y: float(math.trunc(x / y)), "rem": math.fmod,
}  # fmt: skip
OUTSIDE = "outside"
"""A value that is taken where a demand does not hold: the value, the demand and its words."""
ARGUMENT, SILENT, CREEP = "argument", "silent", "#creep"
"""Calls round an argument of a function, whose relations make events, and round a relation or a jump of the function
itself, which makes none."""
_SAME_TYPE = ("pre", "noEvent", "previous", "hold", ARGUMENT, SILENT)
"""Calls that have the type of their argument."""
_ANSWERS = ("initial", "terminal", "edge", "change", "sample", "Clock")
"""Calls that are conditions."""
KNOWN = ("number", "boolean", "literal", "string")
_KINDS = {"number": "a number", "boolean": "a truth value", "literal": "a value of an enumeration", "string": "a text"}


_LARGEST_POWER = 100
LONGEST = 100_000
"""Elements of an array, and steps of an algorithm."""


def known(expression: Expr) -> Expr:
    """Return the value of an expression without names."""
    args = tuple(known(argument) if isinstance(argument, Expr) else argument for argument in expression.args)
    if expression.kind == "if":
        taken = (value for condition, value in zip(args[:-1:2], args[1::2], strict=True) if condition.args[0])
        return next(taken, args[-1])
    return expression if expression.kind in KNOWN else operation(expression.kind, args, expression.line)


def jumps(expression: Expr) -> bool:
    """Tell whether an expression has relations, or functions that jump."""
    inner = expression.args[1] if expression.kind == "call" else expression.args
    return _jumps_itself(expression) or any(isinstance(argument, Expr) and jumps(argument) for argument in inner)


def _jumps_itself(expression: Expr) -> bool:
    return expression.kind in _RELATIONS or (expression.kind == "call" and expression.args[0] in JUMPING)


def quiet(result: Expr) -> Expr:
    """Return the result of a function: its relations make no events, those of its arguments do."""
    if result.kind == "call" and result.args[0] == ARGUMENT:
        return result.args[1][0]
    if result.kind == "call" and result.args[0] == SILENT:  # of another function, which this one calls
        return with_operands(result, lambda inner: with_operands(inner, quiet))
    changed = with_operands(result, quiet)
    return call(SILENT, (changed,), result.line) if _jumps_itself(result) else changed


def number(value: float, line: int = 0) -> Expr:
    """Return a number as an expression."""
    return Expr("number", (float(value),), line)


def filled(value: Expr, sizes: Sequence[int], line: int = 0) -> Expr:
    """Return an array of one value."""
    for size in reversed(sizes):
        value = Expr("array", (value,) * size, line) if size else Empty("array", (), line, further=shape(value) or ())
    return value


def shape(value: Expr) -> tuple[int, ...] | None:
    """Return the size of an array in each dimension, nothing of what is none; None if its rows differ."""
    if value.kind != "array":
        return ()
    if isinstance(value, Empty):
        return (0, *value.further)
    inner = {shape(item) for item in value.args}
    row = inner.pop() if inner else ()
    return None if inner or row is None else (len(value.args), *row)


def count(number: float) -> int:
    """Return the size of an array.

    Raises:
        Unfit: it is no whole number, negative, or too large.
    """
    if not (0 <= number <= LONGEST and number == int(number)):
        raise Unfit(f"An array cannot have {number:g} elements: it has 0 to {LONGEST}")
    return int(number)


def row(start: float, step: float, stop: float, line: int) -> Expr:
    """Return the numbers of a range.

    Raises:
        Unfit: the step is zero, or there are too many.
    """
    if step == 0:
        raise Unfit(f"The range {start:g}:0:{stop:g} has a step of 0")
    length = count(max(0.0, math.floor((stop - start) / step + 1e-9) + 1.0))  # rounding of a stop that is met
    return Expr("array", tuple(number(start + k * step, line) for k in range(length)), line)


def operation(kind: str, args: tuple[Expr, ...], line: int) -> Expr:
    """Return an operation; known values are computed, arrays element by element.

    Raises:
        Unfit: sizes of arrays differ, or numbers have no result.
    """
    if kind == "array":
        return Expr("array", args, line)
    if kind == "matrix":
        return _matrix(args, line)
    if any(argument.kind == "array" for argument in args):
        return _of_arrays(kind, args, line)
    kind = kind.removeprefix(".")
    if kind in ("neg", *_BINARY) and any(map(is_condition, args)):
        raise Unfit("A condition is no number: write `if … then 1 else 0`")
    if kind in ("not", "and", "or") and not all(map(is_condition, args)):
        raise Unfit(f"'{kind}' joins conditions, and a number is none")
    if kind == "neg":
        return number(-args[0].args[0], line) if args[0].kind == "number" else Expr("neg", args, line)
    if kind == "not":
        return Expr("boolean", (not args[0].args[0],), line) if args[0].kind == "boolean" else Expr("not", args, line)
    if kind in ("and", "or"):
        decides = kind == "or"
        if any(argument.kind == "boolean" and argument.args[0] is decides for argument in args):
            return Expr("boolean", (decides,), line)
        left = [argument for argument in args if argument.kind != "boolean"]
        if not left:
            return Expr("boolean", (not decides,), line)
        return left[0] if len(left) == 1 else Expr(kind, args, line)
    if kind in _RELATIONS and not all(argument.kind in KNOWN for argument in args):
        args = tuple(map(numbered, args))
        if is_condition(args[0]) is not is_condition(args[1]):
            raise Unfit(f"A condition and a number cannot be compared by {kind}")
    if kind in _RELATIONS and all(argument.kind in KNOWN for argument in args):
        return Expr("boolean", (_related(kind, *args),), line)
    if kind in _BINARY and all(argument.kind == "number" for argument in args):
        return _computed(_BINARY[kind], args, line)
    if kind == "+" and all(argument.kind == "string" for argument in args):
        return Expr("string", (args[0].args[0] + args[1].args[0],), line)
    return Expr(kind, args, line)


def numbered(expression: Expr) -> Expr:
    """Return an expression with numbers in place of literals, 1 for the first: variables of enumerations have them."""
    if expression.kind == "literal" and len(expression.args) > 1:
        return number(expression.args[1], expression.line)
    if expression.kind not in ("if", "array"):
        return expression
    return Expr(expression.kind, tuple(map(numbered, expression.args)), expression.line)


def is_condition(expression: Expr) -> bool:
    """Whether a resolved expression is Boolean; all others are numbers, texts, arrays or choices."""
    if expression.kind == "if":
        return is_condition(expression.args[1])
    if expression.kind == "shared":
        return is_condition(expression.args[0].result)
    if expression.kind == OUTSIDE:
        return is_condition(expression.args[0])
    if expression.kind == "call":
        name, args, _ = expression.args
        same = name in _SAME_TYPE or (name == "sample" and len(args) == 1)
        return is_condition(args[-1]) if same else name in _ANSWERS
    return expression.kind in ("boolean", "condition", "not", "and", "or", *_RELATIONS)


def _of_arrays(kind: str, args: tuple[Expr, ...], line: int) -> Expr:
    arrays = [argument for argument in args if argument.kind == "array"]
    if kind == "*" and len(arrays) == 2:
        return _product(args[0], args[1], line)
    if kind == "^":
        return _power(args[0], args[1], line)
    if (kind in ("+", "-") and len(arrays) < len(args)) or (kind == "/" and args[1].kind == "array"):
        raise Unfit(f"An array and a number: .{kind} is element by element")
    if any(len(argument.args) != len(arrays[0].args) for argument in arrays):
        raise Unfit("The sizes of two arrays differ")
    rows = (
        tuple(argument.args[k] if argument.kind == "array" else argument for argument in args)
        for k in range(len(arrays[0].args))
    )
    return Expr("array", tuple(operation(kind, row, line) for row in rows), line)


def identity(size: int, line: int) -> Expr:
    """Return the unit matrix."""
    rows = (tuple(number(row == column, line) for column in range(size)) for row in range(size))
    return Expr("array", tuple(Expr("array", row, line) for row in rows), line)


def _power(base: Expr, exponent: Expr, line: int) -> Expr:
    """Return the power of a square matrix, by repeated products."""
    times, size = exponent.args[0] if exponent.kind == "number" else -1.0, len(base.args)
    square = base.kind == "array" and all(row.kind == "array" and len(row.args) == size for row in base.args)
    if not square or not 0 <= times <= _LARGEST_POWER or times != int(times):
        raise Unfit(f"Only a square matrix has powers, from 0 to {_LARGEST_POWER}: .^ is element by element")
    result = identity(size, line)
    for _ in range(int(times)):
        result = _product(result, base, line)
    return result


def _matrix(rows: tuple[Expr, ...], line: int) -> Expr:
    """Join matrices, columns and numbers: those of a row side by side, the rows one below the other."""
    lines: list[tuple[Expr, ...]] = []
    for row in rows:
        blocks = [_promoted(item) for item in row.args]
        if len({len(block) for block in blocks}) > 1:
            raise Unfit("The parts of a matrix that stand side by side have different numbers of rows")
        lines += [tuple(item for part in parts for item in part) for parts in zip(*blocks, strict=True)]
    if len({len(row) for row in lines}) > 1:
        raise Unfit("The rows of a matrix have different lengths")
    return Expr("array", tuple(Expr("array", row, line) for row in lines), line)


def _promoted(item: Expr) -> list[tuple[Expr, ...]]:
    """Return the rows of a matrix; a vector is a column."""
    if item.kind != "array":
        return [(item,)]
    return [row.args if row.kind == "array" else (row,) for row in item.args]


def choice(kept: list[Expr], otherwise: Expr, line: int) -> Expr:
    """Return a choice by conditions, each followed by its value; of arrays element by element.

    Raises:
        Unfit: the values have different sizes.
    """
    values = [*kept[1::2], otherwise]
    sizes = {len(value.args) if value.kind == "array" else None for value in values}
    if len(sizes) > 1:
        raise Unfit("The values of an 'if' have different sizes")
    if otherwise.kind != "array":
        return Expr("if", (*kept, otherwise), line)
    rows = (
        [part for condition, value in zip(kept[::2], kept[1::2], strict=True) for part in (condition, value.args[k])]
        for k in range(len(otherwise.args))
    )
    return Expr("array", tuple(choice(row, otherwise.args[k], line) for k, row in enumerate(rows)), line)


def elements(items: Expr) -> list[Expr]:
    """Return the elements of an array of any dimensions, row by row."""
    return [element for item in items.args for element in elements(item)] if items.kind == "array" else [items]


def _related(kind: str, left: Expr, right: Expr) -> bool:
    if left.kind != right.kind:
        raise Unfit(f"{_KINDS[left.kind].capitalize()} and {_KINDS[right.kind]} cannot be compared")
    if left.kind == "literal" and kind not in ("==", "<>"):
        kinds = {str(one.args[0]).rpartition(".")[0] for one in (left, right)}
        places = numbered(left), numbered(right)
        if len(kinds) == 1 and places[0].kind == "number":
            return _RELATIONS[kind](places[0].args[0], places[1].args[0])
        raise Unfit(f"{left.args[0]} and {right.args[0]} have no order here: compare them by == or <>")
    return _RELATIONS[kind](left.args[0], right.args[0])


def _computed(function: Callable[..., float], args: tuple[Expr, ...], line: int) -> Expr:
    values = [argument.args[0] for argument in args]
    try:
        result = function(*values)
    except (ArithmeticError, ValueError):
        result = math.nan
    if isinstance(result, complex) or not math.isfinite(result):
        raise Unfit(f"A formula of {', '.join(f'{value:g}' for value in values)} has no value")
    return number(result, line)


def _product(left: Expr, right: Expr, line: int) -> Expr:
    if left.args and left.args[0].kind == "array":
        return Expr("array", tuple(_product(row, right, line) for row in left.args), line)
    if right.args and right.args[0].kind == "array":
        columns = (Expr("array", column, line) for column in zip(*(row.args for row in right.args), strict=True))
        return Expr("array", tuple(_product(left, column, line) for column in columns), line)
    if len(left.args) != len(right.args):
        raise Unfit("The sizes of two arrays differ")
    return total([operation("*", pair, line) for pair in zip(left.args, right.args, strict=True)], line)


def total(items: list[Expr], line: int) -> Expr:
    """Return the sum of expressions."""
    return joined(lambda left, other: operation("+", (left, other), line), items) if items else number(0, line)


def function(name: str, args: tuple[Expr, ...], line: int) -> Expr:
    """Return an elementary function; of an array element by element, but `min` and `max` of all.

    Raises:
        Unfit: it has no value, or the number of arguments is wrong.
    """
    if name in ("min", "max") and len(args) == 1 and args[0].kind == "array":
        if not elements(args[0]):
            raise Unfit(f"{name} of an array without elements has no value")
        if all(map(is_condition, elements(args[0]))):
            word = "and" if name == "min" else "or"
            return joined(lambda left, other: operation(word, (left, other), line), elements(args[0]))
        return joined(lambda left, other: function(name, (left, other), line), elements(args[0]))
    wanted = 2 if name in ("atan2", "mod", "rem", "div", "min", "max") else 1
    if len(args) != wanted:
        raise Unfit(f"{name} has {wanted} argument{'s' if wanted > 1 else ''}, not {len(args)}")
    if name in ("mod", "rem", "div") and args[-1].kind == "number" and args[-1].args[0] == 0:
        raise Unfit(f"{name} by 0 has no value")
    of_numbers = _FUNCTIONS[name]

    def make(items: tuple[Expr, ...]) -> Expr:
        if name in ("min", "max") and all(map(is_condition, items)):  # false is less than true
            return operation("and" if name == "min" else "or", items, line)
        if any(map(is_condition, items)):
            raise Unfit(f"{name} needs numbers, and a condition is none")
        return _computed(of_numbers, items, line) if _all_known(items) else call(name, items, line)

    return each(name, args, line, make)


def kept(name: str, args: tuple[Expr, ...], line: int) -> Expr:
    """Return the call of a function that only a run evaluates; of arrays element by element. What is known stays.

    Raises:
        Unfit: arrays differ in size.
    """
    return each(name, args, line, lambda items: items[0] if _all_known(items) else call(name, items, line))


def each(name: str, args: tuple[Expr, ...], line: int, make: Callable[[tuple[Expr, ...]], Expr]) -> Expr:
    """Return what is made of arguments; of arrays what is made of their elements.

    Raises:
        Unfit: arrays differ in size.
    """
    lengths = {len(arg.args) for arg in args if arg.kind == "array"}
    if not lengths:
        return make(args)
    if len(lengths) > 1:
        raise Unfit(f"{name} has arrays of {' and '.join(map(str, sorted(lengths)))} elements")
    rows = (tuple(arg.args[k] if arg.kind == "array" else arg for arg in args) for k in range(lengths.pop()))
    return Expr("array", tuple(each(name, row, line, make) for row in rows), line)


def _all_known(args: tuple[Expr, ...]) -> bool:
    return all(arg.kind == "number" for arg in args)


def native(compute: Callable[..., Any], args: tuple[Expr, ...], line: int) -> Expr:
    """Return what a function of Python makes of numbers: a number, or an expression that a run computes."""
    if _all_known(args):
        return number(float(compute(*(argument.args[0] for argument in args))), line)
    return Expr("native", (compute, *args), line)


def call(name: str, args: tuple[Expr, ...], line: int) -> Expr:
    """Return the call of a function."""
    return Expr("call", (name, args, ()), line)
