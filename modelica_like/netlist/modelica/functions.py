"""Functions of Modelica text: the user's are inlined, those of arrays computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.instance import Given, Instance, refused
from modelica_like.netlist.modelica.tree import ClassText, Declaration, Expr, Statement

if TYPE_CHECKING:
    from modelica_like.netlist.modelica.resolve import Resolver

_DEEPEST = 30


def _filled(value: Expr, shape: tuple[Expr, ...], line: int) -> Expr:
    for one in reversed(shape):
        if one.kind != "number":
            raise fold.Unfit("The size of an array must be known")
        value = Expr("array", (value,) * fold.count(one.args[0]), line)
    return value


def _line(args: tuple[Expr, ...], line: int) -> Expr:
    if any(argument.kind != "number" for argument in args):
        raise fold.Unfit("linspace needs three known numbers")
    start, stop, count = (argument.args[0] for argument in args)
    return Expr(
        "array",
        tuple(fold.number(start + (stop - start) * k / max(count - 1, 1), line) for k in range(fold.count(count))),
        line,
    )


def elements(items: Expr) -> list[Expr]:
    """Return the elements of an array of any dimensions, row by row."""
    return [one for item in items.args for one in elements(item)] if items.kind == "array" else [items]


def _product(args: tuple[Expr, ...], line: int) -> Expr:
    product = fold.number(1, line)
    for argument in elements(args[0]):
        product = fold.operation("*", (product, argument), line)
    return product


def _identity(args: tuple[Expr, ...], line: int) -> Expr:
    if args[0].kind != "number":
        raise fold.Unfit("The size of an array must be known")
    size = fold.count(args[0].args[0])
    fold.count(size * size)
    rows = (tuple(fold.number(row == column, line) for column in range(size)) for row in range(size))
    return Expr("array", tuple(Expr("array", row, line) for row in rows), line)


def _scalar(args: tuple[Expr, ...], _: int) -> Expr:
    inside = elements(args[0])
    if len(inside) != 1:
        raise fold.Unfit(f"scalar(…) needs an array of one element, not of {len(inside)}")
    return inside[0]


def _transposed(args: tuple[Expr, ...], line: int) -> Expr:
    rows = args[0].args
    if any(row.kind != "array" or len(row.args) != len(rows[0].args) for row in rows):
        raise fold.Unfit("transpose(…) needs a matrix: rows of the same length")
    return Expr("array", tuple(Expr("array", c, line) for c in zip(*(row.args for row in rows), strict=True)), line)


OF_ARRAYS: dict[str, tuple[int, Callable[[tuple[Expr, ...], int], Expr]]] = {
    "sum": (1, lambda args, line: fold.total(elements(args[0]), line)),
    "product": (1, _product),
    "fill": (-2, lambda args, line: _filled(args[0], args[1:], line)),
    "zeros": (-1, lambda args, line: _filled(fold.number(0, line), args, line)),
    "ones": (-1, lambda args, line: _filled(fold.number(1, line), args, line)),
    "identity": (1, _identity),
    "linspace": (3, _line),
    "vector": (1, lambda args, line: Expr("array", tuple(elements(args[0])), line)),
    "scalar": (1, _scalar),
    "transpose": (1, _transposed),
}
"""Functions whose arguments or results are arrays, each with the number of its arguments; of -2 it has 2 or more."""


def of_arrays(name: str, args: tuple[Expr, ...], line: int) -> Expr:
    """Return the result of a function of `OF_ARRAYS`.

    Raises:
        Unfit: it has other arguments.
    """
    wanted, compute = OF_ARRAYS[name]
    if len(args) < -wanted or (wanted > 0 and len(args) != wanted):
        many = f"at least {-wanted}" if wanted < 0 else str(wanted)
        raise fold.Unfit(f"{name}(…) has {many} argument{'' if wanted in (-1, 1) else 's'}, not {len(args)}")
    if name in ("sum", "product", "scalar", "transpose") and args[0].kind != "array":
        raise fold.Unfit(f"{name}(…) needs an array")
    return compute(args, line)


def size(items: Expr, dimension: int, line: int) -> Expr:
    """Return the size of an array in one dimension, or in all as an array."""
    numbers: list[Expr] = []
    while items.kind == "array":
        numbers.append(fold.number(len(items.args), line))
        items = items.args[0] if items.args else fold.number(0)
    return numbers[dimension - 1] if 0 < dimension <= len(numbers) else Expr("array", tuple(numbers), line)


def called(resolver: Resolver, expression: Expr, given: tuple[Expr, ...], named: Mapping[str, Expr]) -> Expr:
    """Return the result of a user's function, with its algorithm inlined.

    Args:
        resolver: of the place of the call.
        expression: the call.
        given: arguments by position.
        named: arguments by name.

    Raises:
        ModelicaTextError: there is no such function, or it uses what is not supported.
    """
    name, line = expression.args[0], expression.line
    text = resolver.find(name)
    if name == "Integer":
        if len(given) != 1:
            raise fold.Unfit(f"Integer(…) has 1 argument, not {len(given)}")
        return given[0]
    if not isinstance(text, ClassText) or text.kind not in ("function", "record"):
        raise refused(f"the function {name}", resolver.text, line, "Own functions with an algorithm are read.")
    if text.kind == "record":
        raise refused(f"the record {name}(…) as a value", resolver.text, line)
    if resolver.depth > _DEEPEST:
        raise refused(f"{name}, which calls itself,", resolver.text, line)
    result = _Call(resolver, text).result(given, named, line)
    is_constant = result.kind in (*fold.KNOWN, "array")
    return result if is_constant else Expr("call", ("noEvent", (result,), ()), line)


class _Call:
    def __init__(self, resolver: Resolver, text: ClassText) -> None:
        self.resolver, self.text = resolver, text
        members = Instance(resolver.classes, text, Given()).members
        self.declared = {name: member.declaration for name, member in members.items()}
        self.local: dict[str, Expr] = {}

    def result(self, given: tuple[Expr, ...], named: Mapping[str, Expr], line: int) -> Expr:
        inputs = [name for name, d in self.declared.items() if "input" in d.prefixes]
        outputs = [name for name, d in self.declared.items() if "output" in d.prefixes]
        if len(outputs) != 1:
            raise refused(f"{self.text.name}, a function with {len(outputs)} results,", self.text, self.text.line)
        self.local.update(zip(inputs, given, strict=False))
        self.local.update(named)
        if len(given) > len(inputs) or any(name not in inputs for name in named):
            raise refused(f"these arguments of {self.text.name}", self.resolver.text, line)
        for name, variable in self.declared.items():
            if name not in self.local:
                self.local[name] = self._start(name, variable, line)
        self.run(self.text.algorithm)
        return self.local[outputs[0]]

    def _start(self, name: str, declaration: Declaration, line: int) -> Expr:
        value = declaration.modification.value
        if value is not None:
            return self.here()(value)
        if "input" in declaration.prefixes:
            raise refused(f"{self.text.name} without its argument {name}", self.resolver.text, line)
        shape = tuple(self.here()(dimension) for dimension in declaration.dimensions if dimension.kind != "all")
        return _filled(fold.number(0, line), shape, line)

    def here(self) -> Resolver:
        kind = type(self.resolver)
        return kind(None, self.text, self.local, classes=self.resolver.classes, depth=self.resolver.depth + 1)

    def run(self, statements: list[Statement]) -> None:
        for statement in statements:
            self.resolver.classes.spend(5, self.text, statement.line)
            if statement.kind == ":=":
                self.assign(statement.parts[0], self.here()(statement.parts[1]))
            elif statement.kind == "if":
                self.branch(list(statement.parts), statement.line)
            elif statement.kind == "for":
                self.loop(list(statement.parts[0]), statement.parts[1])
            elif statement.kind == "while":
                while self.here()(statement.parts[0]) == Expr("boolean", (True,), statement.parts[0].line):
                    self.resolver.classes.spend(5, self.text, statement.line)
                    self.run(statement.parts[1])
            elif statement.kind != "call" or statement.parts[0].args[0] not in (
                "assert",
                "Modelica.Utilities.Streams.print",
            ):
                raise refused(f"'{statement.kind}' in a function", self.text, statement.line)

    def assign(self, target: Expr, value: Expr) -> None:
        if target.kind != "name" or len(target.args) != 1 or target.args[0][0] not in self.local:
            raise refused("this target of an assignment", self.text, target.line)
        name, subscripts = target.args[0]
        places = [int(self.here().number(subscript)) - 1 for subscript in subscripts]
        self.local[name] = _replaced(self.local[name], places, value)

    def branch(self, branches: list[tuple[Expr | None, list[Statement]]], line: int) -> None:
        """Run the branch that is taken; where that is not known, all of them."""
        if not branches:
            return
        condition, statements = branches[0]
        holds = Expr("boolean", (True,)) if condition is None else self.here()(condition)
        if holds.kind == "boolean":
            if holds.args[0]:
                self.run(statements)
            else:
                self.branch(branches[1:], line)
            return
        before = dict(self.local)
        self.run(statements)
        taken, self.local = self.local, before
        self.branch(branches[1:], line)
        for name, other in self.local.items():
            if taken[name] != other:
                self.local[name] = _either(holds, taken[name], other, line)

    def loop(self, iterators: list[tuple[str, Expr | None]], statements: list[Statement]) -> None:
        (name, over), rest = iterators[0], iterators[1:]
        if over is None:
            raise refused("an iterator without a range", self.text, self.text.line)
        for value in self.here().array(over):
            self.local[name] = value
            if rest:
                self.loop(rest, statements)
            else:
                self.run(statements)
        self.local.pop(name, None)


def _replaced(whole: Expr, places: list[int], value: Expr) -> Expr:
    if not places:
        return value
    items = list(whole.args)
    while len(items) <= places[0]:  # an output of open size grows
        items.append(fold.number(0))
    items[places[0]] = _replaced(items[places[0]], places[1:], value)
    return Expr("array", tuple(items), whole.line)


def _either(condition: Expr, expression: Expr, other: Expr, line: int) -> Expr:
    if expression.kind == "array" and other.kind == "array":
        return Expr(
            "array",
            tuple(_either(condition, a, b, line) for a, b in zip(expression.args, other.args, strict=True)),
            line,
        )
    return Expr("if", (condition, expression, other), line)
