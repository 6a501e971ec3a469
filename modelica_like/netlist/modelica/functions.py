"""Functions of Modelica text: the user's are inlined, those of arrays computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.instance import Given, Instance, refused
from modelica_like.netlist.modelica.tree import ClassText, Expr, Statement
from modelica_like.netlist.modelica.types import basic_type, misfit

if TYPE_CHECKING:
    from modelica_like.netlist.modelica.resolve import Resolver

_DEEPEST = 30


def _filled(value: Expr, shape: tuple[Expr, ...], line: int) -> Expr:
    for size in reversed(shape):
        if size.kind != "number":
            raise fold.Unfit("The size of an array must be known")
        value = Expr("array", (value,) * fold.count(size.args[0]), line)
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


def _product(args: tuple[Expr, ...], line: int) -> Expr:
    product = fold.number(1, line)
    for argument in fold.elements(args[0]):
        product = fold.operation("*", (product, argument), line)
    return product


def _identity(args: tuple[Expr, ...], line: int) -> Expr:
    if args[0].kind != "number":
        raise fold.Unfit("The size of an array must be known")
    size = fold.count(args[0].args[0])
    fold.count(size * size)
    return fold.identity(size, line)


def _scalar(args: tuple[Expr, ...], _: int) -> Expr:
    inside = fold.elements(args[0])
    if len(inside) != 1:
        raise fold.Unfit(f"scalar(…) needs an array of one element, not of {len(inside)}")
    return inside[0]


def _transposed(args: tuple[Expr, ...], line: int) -> Expr:
    rows = args[0].args
    if any(row.kind != "array" or len(row.args) != len(rows[0].args) for row in rows):
        raise fold.Unfit("transpose(…) needs a matrix: rows of the same length")
    return Expr("array", tuple(Expr("array", c, line) for c in zip(*(row.args for row in rows), strict=True)), line)


OF_ARRAYS: dict[str, tuple[int, Callable[[tuple[Expr, ...], int], Expr]]] = {
    "sum": (1, lambda args, line: fold.total(fold.elements(args[0]), line)),
    "product": (1, _product),
    "fill": (-2, lambda args, line: _filled(args[0], args[1:], line)),
    "zeros": (-1, lambda args, line: _filled(fold.number(0, line), args, line)),
    "ones": (-1, lambda args, line: _filled(fold.number(1, line), args, line)),
    "identity": (1, _identity),
    "linspace": (3, _line),
    "vector": (1, lambda args, line: Expr("array", tuple(fold.elements(args[0])), line)),
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


def size(items: Expr, dimension: float | None, line: int) -> Expr:
    """Return the size of an array in one dimension, or in all as an array.

    Raises:
        Unfit: there is no such dimension.
    """
    numbers: list[Expr] = []
    while items.kind == "array":
        numbers.append(fold.number(len(items.args), line))
        items = items.args[0] if items.args else fold.number(0)
    if dimension is None:
        return Expr("array", tuple(numbers), line)
    if not 1 <= dimension <= len(numbers) or dimension != int(dimension):
        raise fold.Unfit(f"size(…) has no dimension {dimension:g}: the array has {len(numbers)}")
    return numbers[int(dimension) - 1]


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
        return fold.numbered(given[0])
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
        self.inside = Instance(resolver.classes, text, Given())
        self.declared = {name: member.declaration for name, member in self.inside.members.items()}
        self.local: dict[str, Expr] = {}

    def result(self, given: tuple[Expr, ...], named: Mapping[str, Expr], line: int) -> Expr:
        inputs = [name for name, d in self.declared.items() if "input" in d.prefixes]
        outputs = [name for name, d in self.declared.items() if "output" in d.prefixes]
        if len(outputs) != 1:
            raise refused(f"{self.text.name}, a function with {len(outputs)} results,", self.text, self.text.line)
        positional = dict(zip(inputs, given, strict=False))
        if len(given) > len(inputs) or any(name not in inputs or name in positional for name in named):
            raise refused(f"these arguments of {self.text.name}", self.resolver.text, line)
        taken = {**positional, **named}
        # A function of numbers is applied to each element of an array.
        scalar = [name for name in taken if not self.declared[name].dimensions and taken[name].kind == "array"]
        if not scalar:
            return self._one(taken, outputs[0], line)

        def of(values: tuple[Expr, ...]) -> Expr:
            return _Call(self.resolver, self.text)._one(
                {**taken, **dict(zip(scalar, values, strict=True))}, outputs[0], line
            )

        return fold.each(self.text.name, tuple(taken[name] for name in scalar), line, of)

    def _one(self, taken: dict[str, Expr], output: str, line: int) -> Expr:
        self.local.update(taken)
        for name in taken:
            self._check(name)
        for name in self.declared:
            if name not in self.local:
                self.local[name] = self._start(name, line)
        outer_text = self.text
        for statement, text in self.inside.algorithm:
            self.text = text
            self.run([statement])
        self.text = outer_text
        self._check(output)
        return self.local[output]

    def _check(self, name: str) -> None:
        """Refuse a value whose sizes or type are not those declared, as far as they are known."""
        value, declared = self.local[name], self.declared[name]
        label = f"{name} of {self.text.name}"
        for dimension in declared.dimensions:
            size = self.here()(dimension) if dimension.kind != "all" else dimension
            if value.kind != "array":
                raise fold.Unfit(f"{label} is an array")
            if size.kind == "number" and size.args[0] != len(value.args):
                raise fold.Unfit(f"{label} has {size.args[0]:g} elements, not {len(value.args)}")
            value = value.args[0] if value.args else fold.number(0)
        basic = basic_type(self.inside, self.inside.members[name])
        wrong = misfit(self.local[name], basic) if basic is not None else ""
        if wrong:
            raise fold.Unfit(f"{label} {wrong}")

    def _start(self, name: str, line: int) -> Expr:
        declaration, member = self.declared[name], self.inside.members[name]
        entry = member.given
        if entry.value is not None:
            return self.here(entry.scope[1] if entry.scope else member.text)(entry.value)
        if "input" in declaration.prefixes:
            raise refused(f"{self.text.name} without its argument {name}", self.resolver.text, line)
        shape = tuple(self.here()(dimension) for dimension in declaration.dimensions if dimension.kind != "all")
        return _filled(fold.number(0, line), shape, line)

    def here(self, text: ClassText | None = None) -> Resolver:
        kind = type(self.resolver)
        return kind(None, text or self.text, self.local, classes=self.resolver.classes, depth=self.resolver.depth + 1)

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
                while self.known_to_hold(statement):
                    self.resolver.classes.spend(5, self.text, statement.line)
                    self.run(statement.parts[1])
            elif statement.kind == "call" and statement.parts[0].args[0] == "assert":
                self.insist(statement)
            elif statement.kind != "call" or statement.parts[0].args[0] != "Modelica.Utilities.Streams.print":
                raise refused(f"'{statement.kind}' in a function", self.text, statement.line)

    def known_to_hold(self, loop: Statement) -> bool:
        """Whether a loop goes on; that must be known when the text is read."""
        holds = self.here()(loop.parts[0])
        if holds.kind != "boolean":
            raise refused("a 'while' whose end only a run knows", self.text, loop.line)
        return holds.args[0]

    def insist(self, statement: Statement) -> None:
        """Refuse what an assertion excludes; what only a run knows is not checked."""
        given = statement.parts[0].args[1]
        holds = self.here()(given[0]) if given else None
        if holds is not None and holds.kind == "boolean" and not holds.args[0]:
            said = given[1].args[0] if len(given) > 1 and given[1].kind == "string" else "no reason is given"
            raise fold.Unfit(f"{self.text.name} refuses its arguments: {said}")

    def assign(self, target: Expr, value: Expr) -> None:
        if target.kind != "name" or len(target.args) != 1 or target.args[0][0] not in self.declared:
            raise refused("this target of an assignment", self.text, target.line)
        name, subscripts = target.args[0]
        if "input" in self.declared[name].prefixes:
            raise ModelicaTextError(f"{name} is an input and cannot be assigned.", where=self.text.place(target.line))
        places, whole = list[int](), self.local[name]
        for dimension, subscript in enumerate(subscripts):
            open_size = [size.kind for size in self.declared[name].dimensions[dimension : dimension + 1]] == ["all"]
            places.append(self.place(whole, subscript, open_size=open_size))
            whole = whole.args[places[-1]] if places[-1] < len(whole.args) else fold.number(0)
        self.local[name] = _replaced(self.local[name], places, value)

    def place(self, whole: Expr, subscript: Expr, *, open_size: bool) -> int:
        """Return the place of an element, from 0; an array of open size may grow."""
        if subscript.kind in ("all", "range", "array"):
            raise refused("an assignment to several elements of an array", self.text, subscript.line)
        if whole.kind != "array":
            raise ModelicaTextError("What is no array has no subscript.", where=self.text.place(subscript.line))
        position, size = self.here().number(subscript), len(whole.args)
        if position != int(position) or position < 1 or (position > size and not open_size):
            raise ModelicaTextError(
                f"The index {position:g} is not one of 1 to {size}.", where=self.text.place(subscript.line)
            )
        return int(position) - 1

    def branch(self, branches: list[tuple[Expr | None, list[Statement]]], line: int) -> None:
        """Run the branch that is taken; where that is not known, all of them."""
        if not branches:
            return
        condition, statements = branches[0]
        holds = Expr("boolean", (True,)) if condition is None else self.here().condition(condition, "if", line)
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
                self.local[name] = fold.choice([holds, taken[name]], other, line)

    def loop(self, iterators: list[tuple[str, Expr | None]], statements: list[Statement]) -> None:
        (name, over), rest = iterators[0], iterators[1:]
        if over is None:
            raise refused("an iterator without a range", self.text, self.text.line)
        hidden = self.local.get(name)
        for value in self.here().array(over):
            self.local[name] = value
            if rest:
                self.loop(rest, statements)
            else:
                self.run(statements)
        self.local.pop(name, None)
        if hidden is not None:  # a variable of the same name
            self.local[name] = hidden


def _replaced(whole: Expr, places: list[int], value: Expr) -> Expr:
    if not places:
        return value
    items = list(whole.args)
    while len(items) <= places[0]:  # an output of open size grows
        items.append(fold.number(0))
    items[places[0]] = _replaced(items[places[0]], places[1:], value)
    return Expr("array", tuple(items), whole.line)
