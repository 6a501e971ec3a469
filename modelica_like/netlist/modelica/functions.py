"""Functions of Modelica text: the user's are inlined, those of arrays computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from modelica_like.errors import did_you_mean
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.algorithms import Algorithm
from modelica_like.netlist.modelica.instance import GIVE, Given, Instance, refused
from modelica_like.netlist.modelica.laws import closed, opened
from modelica_like.netlist.modelica.members import value_of
from modelica_like.netlist.modelica.natives import NATIVE
from modelica_like.netlist.modelica.tree import ClassText, Expr
from modelica_like.netlist.modelica.types import basic_type, is_external_object, misfit

if TYPE_CHECKING:
    from modelica_like.netlist.modelica.resolve import Resolver

_DEEPEST = 30
_LARGE = 1000
"""Numbers, names and operations of a result; a larger one is written once for all that use it."""


def _filled(value: Expr, shape: tuple[Expr, ...], line: int) -> Expr:
    if any(size.kind != "number" for size in shape):
        raise fold.Unfit("The size of an array must be known")
    return fold.filled(value, [fold.count(size.args[0]) for size in shape], line)


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


def _concatenated(args: tuple[Expr, ...], line: int) -> Expr:
    along, items = args[0], args[1:]
    if along.kind != "number" or along.args[0] not in (1, 2) or any(item.kind != "array" for item in items):
        raise fold.Unfit("cat(…) needs the dimension, 1 or 2, and arrays")
    if along.args[0] == 1:
        return Expr("array", tuple(part for item in items for part in item.args), line)
    return _transposed((_concatenated((fold.number(1), *(_transposed((item,), line) for item in items)), line),), line)


def _crossed(args: tuple[Expr, ...], line: int) -> Expr:
    if any(fold.shape(argument) != (3,) for argument in args):
        raise fold.Unfit("cross(…) needs two vectors of 3 elements")
    a, b = (argument.args for argument in args)
    pairs = ((1, 2), (2, 0), (0, 1))
    products = (tuple(fold.operation("*", (a[m], b[n]), line) for m, n in ((j, k), (k, j))) for j, k in pairs)
    return Expr("array", tuple(fold.operation("-", pair, line) for pair in products), line)


def _diagonal(args: tuple[Expr, ...], line: int) -> Expr:
    items = fold.elements(args[0])
    rows = ([item if j == k else fold.number(0, line) for k in range(len(items))] for j, item in enumerate(items))
    return Expr("array", tuple(Expr("array", tuple(row), line) for row in rows), line)


def _outer(args: tuple[Expr, ...], line: int) -> Expr:
    left, right = map(fold.elements, args)
    rows = (tuple(fold.operation("*", (a, b), line) for b in right) for a in left)
    return Expr("array", tuple(Expr("array", row, line) for row in rows), line)


def _semi_linear(args: tuple[Expr, ...], line: int) -> Expr:
    x, above, below = args
    sides = [fold.operation("*", (slope, x), line) for slope in (above, below)]
    return fold.choice([fold.operation(">=", (x, fold.number(0, line)), line), sides[0]], sides[1], line)


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
    "cat": (-2, _concatenated),
    "cross": (2, _crossed),
    "diagonal": (1, _diagonal),
    "outerProduct": (2, _outer),
    "semiLinear": (3, _semi_linear),
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
        Unfit: there is no such dimension, or the rows differ.
    """
    shape = fold.shape(items)
    if shape is None:
        raise fold.Unfit("size(…) needs an array whose rows are of one length")
    numbers = [fold.number(count, line) for count in shape]
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
    if isinstance(text, ClassText) and is_external_object(text) and "constructor" in text.classes:
        text = text.classes["constructor"]
    if not isinstance(text, ClassText) or text.kind not in ("function", "record"):
        advice = GIVE if name.startswith("Modelica.") else "Own functions with an algorithm are read."
        raise refused(f"the function {name}", resolver.text, line, advice)
    if text.kind == "record":
        return _record(resolver, text, given, named)
    if resolver.depth > _DEEPEST:
        raise refused(f"{name}, which calls itself,", resolver.text, line)
    result = fold.quiet(_Call(resolver, text).result(given, named, line))
    return result if result.size <= _LARGE else _shared(resolver, text, given, named, line)


def _shared(resolver: Resolver, text: ClassText, given: tuple[Expr, ...], named: Mapping[str, Expr], line: int) -> Expr:
    """Return the result of a function whose law is large: its arguments stand beside it, once each."""
    arguments: list[Expr] = []
    values = tuple(opened(value, arguments) for value in given)
    others = {key: opened(value, arguments) for key, value in named.items()}
    return closed(fold.quiet(_Call(resolver, text).result(values, others, line)), arguments, line)


def _record(resolver: Resolver, text: ClassText, given: tuple[Expr, ...], named: Mapping[str, Expr]) -> Expr:
    """Return a record with values; those that are left out have their defaults."""
    inside = Instance(resolver.classes, text, Given())
    values = {**dict(zip(inside.members, given, strict=False)), **named}
    unknown = [key for key in values if key not in inside.members]
    if unknown or len(given) > len(inside.members):
        raise fold.Unfit(f"{text.name} has no '{unknown[0]}'" if unknown else f"{text.name} has fewer values")
    every = (values[key] if key in values else value_of(inside, key, text, text.line) for key in inside.members)
    return Expr("record", (tuple(inside.members), *every), text.line)


def _eventful(argument: Expr) -> Expr:
    """Return an argument as it is inlined: its own relations make the events that they make outside."""
    if argument.kind == "array":
        return Expr("array", tuple(map(_eventful, argument.args)), argument.line)
    kept = argument.kind in ("record", "object", "native") or not fold.jumps(argument)
    return argument if kept else fold.call(fold.ARGUMENT, (argument,), argument.line)


class _Call(Algorithm):
    silences = True

    def __init__(self, resolver: Resolver, text: ClassText) -> None:
        super().__init__(resolver.classes, text)
        self.resolver = resolver
        self.inside = Instance(resolver.classes, text, Given())
        self.declared = {name: member.declaration for name, member in self.inside.members.items()}

    def result(self, given: tuple[Expr, ...], named: Mapping[str, Expr], line: int) -> Expr:
        inputs = [name for name, d in self.declared.items() if "input" in d.prefixes]
        outputs = [name for name, d in self.declared.items() if "output" in d.prefixes]
        native = NATIVE.get(self.text.external) or NATIVE.get(self.text.path)
        if self.text.external and native is None:
            what = f"{self.text.name}(…), a function of another language"
            raise refused(what, self.text, line, "Write its algorithm in Modelica.")
        positional = dict(zip(inputs, given, strict=False))
        if len(given) > len(inputs):
            plural = "s" * (len(inputs) != 1)
            raise fold.Unfit(f"{self.text.name} has {len(inputs)} input{plural}, not {len(given)}")
        for name in named:
            if name not in inputs:
                raise fold.Unfit(f"{self.text.name} has no input '{name}'{did_you_mean(name, inputs)}")
            if name in positional:
                raise fold.Unfit(f"{self.text.name} is given {name} twice")
        taken = {**positional, **named}
        if native is not None:
            self.local.update(taken)
            values = {name: taken[name] if name in taken else self._start(name, line) for name in inputs}
            return native(self.resolver.classes, values, line)
        # A function of numbers is applied to each element of an array.
        scalar = [name for name in taken if not self.declared[name].dimensions and taken[name].kind == "array"]
        if not scalar:
            return self._one(taken, outputs, line)

        def of(values: tuple[Expr, ...]) -> Expr:
            return _Call(self.resolver, self.text)._one(
                {**taken, **dict(zip(scalar, values, strict=True))}, outputs[:1], line
            )

        return fold.each(self.text.name, tuple(taken[name] for name in scalar), line, of)

    def _one(self, taken: dict[str, Expr], outputs: list[str], line: int) -> Expr:
        self.local.update((name, _eventful(value)) for name, value in taken.items())
        for name in taken:
            self._check(name)
        for name in self.declared:
            if name not in self.local:
                self.local[name] = self._start(name, line)
        outer_text = self.text
        texts = {id(text): text for _, text in self.inside.algorithm}
        for text in texts.values():
            self.text = text
            self.run([statement for statement, owner in self.inside.algorithm if owner is text])
        self.text = outer_text
        for output in outputs:
            self._check(output)
        results = tuple(self.local[output] for output in outputs)
        return results[0] if len(results) == 1 else Expr("tuple", results, line)

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
            if not value.args:
                break
            value = value.args[0]
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
            raise fold.Unfit(f"{self.text.name} needs a value for its input {name}")
        text = self.inside.find(declaration.type, member.text)
        if isinstance(text, ClassText) and text.kind == "record" and not declaration.dimensions:
            inner = Instance(self.classes, text, Given())
            values = (
                value_of(inner, key, text, line) if each.given.value is not None else fold.number(0, line)
                for key, each in inner.members.items()
            )
            return Expr("record", (tuple(inner.members), *values), line)
        shape = tuple(self.here()(dimension) for dimension in declaration.dimensions if dimension.kind != "all")
        return _filled(fold.number(0, line), shape, line)

    def here(self, text: ClassText | None = None) -> Resolver:
        kind = type(self.resolver)
        return kind(None, text or self.text, self.local, classes=self.resolver.classes, depth=self.resolver.depth + 1)
