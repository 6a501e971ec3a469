"""The syntax tree of Modelica text; every node knows its line."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica.tokens import Token

_DEEPEST = 300
"""Levels of an expression: all that reads it goes down in it by a few calls a level, of 1,000 that Python allows."""
_LARGEST = 500_000
CHAIN = 50


@dataclass(frozen=True, slots=True)
class Expr:
    """An expression.

    Attributes:
        kind: an operator (`+`, `neg`, `<`, `and` …), or `number`, `string`, `boolean`, `name`, `call`, `if`, `array`,
            `range`, `all` (a colon), `for` (an array built by iterators).
        args: operands. A `name` has pairs of a name and its subscripts; a `call` the function's dotted name, the
            positional arguments and the pairs of named ones; an `if` conditions and values in turn, then a value.
        line: where it begins.
        depth: levels below it.
        size: numbers, names and operations in it.

    Raises:
        ModelicaTextError: it is too deep, or too large; the place is added where it is known.
    """

    kind: str
    args: tuple[Any, ...]
    line: int = 0
    depth: int = field(default=0, init=False, compare=False, repr=False)
    size: int = field(default=1, init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        inner = [*_children(self)]
        if not inner:
            return
        depth, size = (
            1 + max(expression.depth for expression in inner),
            1 + sum(expression.size for expression in inner),
        )
        if depth > _DEEPEST:
            raise ModelicaTextError(f"A formula has more than {_DEEPEST} levels.")
        if size > _LARGEST:
            advice = (
                "The loops of a function are written out, and so is what it gives on: take shorter loops and arrays."
            )
            what = f"A formula has more than {_LARGEST} numbers, names and operations."
            raise ModelicaTextError(what, advice=advice)
        object.__setattr__(self, "depth", depth)
        object.__setattr__(self, "size", size)

    @property
    def path(self) -> str:
        """Dotted name without subscripts, empty if it is not a name."""
        return ".".join(part[0] for part in self.args) if self.kind == "name" else ""


@dataclass(frozen=True, slots=True)
class Empty(Expr):
    """An array without elements, whose further dimensions are known.

    Attributes:
        further: sizes of these.
    """

    further: tuple[int, ...] = field(default=(), kw_only=True)


@dataclass(slots=True)
class Modification:
    """What stands behind a name: `(arguments) = value`."""

    arguments: list[Argument] = field(default_factory=list)
    value: Expr | None = None


@dataclass(slots=True)
class Argument:
    """One entry of a modification; a redeclaration has the new declaration or class."""

    name: str
    modification: Modification
    line: int
    each: bool = False
    redeclared: Declaration | ClassText | None = None
    final: bool = False


@dataclass(slots=True)
class Import:
    """An import; `names` are the last names if several are listed, `*` if all."""

    path: str
    alias: str
    names: tuple[str, ...]


@dataclass(slots=True)
class Extends:
    """A base class with its modification."""

    base: str
    modification: Modification
    line: int


@dataclass(slots=True)
class Declaration:
    """A component declaration.

    Attributes:
        prefixes: `parameter`, `flow`, `input`, `replaceable`, `protected` and so on.
        type: dotted name of its class.
        dimensions: of an array; empty for a scalar.
        condition: whether it exists.
        constrained: modification behind `constrainedby`; it holds for what is redeclared, too.
        placement: tokens of its annotation `Placement(…)`.
    """

    prefixes: frozenset[str]
    type: str
    name: str
    dimensions: tuple[Expr, ...]
    modification: Modification
    condition: Expr | None
    description: str
    line: int
    constrained: Modification | None = None
    placement: list[Token] = field(default_factory=list[Token])

    @property
    def is_outer(self) -> bool:
        """Whether it only names what is declared further out; `inner outer` declares a part for what is inside."""
        return "outer" in self.prefixes and "inner" not in self.prefixes


@dataclass(slots=True)
class Statement:
    """An equation or a statement of an algorithm.

    Attributes:
        kind: `=`, `:=`, `connect`, `call`, `if`, `for`, `when`, `while`, `return` or `break`.
        parts: of `=`, `:=` and `connect` two expressions; of `call` one; of `if` and `when` pairs of a condition (None
            for `else`) and statements; of `for` the pairs of an iterator and its range, then the statements.
    """

    kind: str
    parts: tuple[Any, ...]
    line: int


@dataclass(slots=True)
class ClassText:
    """A class definition.

    Attributes:
        kind: `model`, `block`, `connector`, `record`, `function`, `package`, `type`, `class`.
        literals: of an enumeration.
        prefixes: of a short definition, `connector In = input Real`.
        short: base and modification of a short definition, `model A = B(k = 1)`.
        constrained: modification behind `constrainedby`.
        external: name of the function of another language that does the work.
        dimensions: of a short definition of an array, `type Axis = Real[3]`.
        icon: tokens of the annotation `Icon(…)`.
        experiment: numbers of the annotation `experiment`, such as `StopTime`.
        file: it was read from.
        owner: enclosing class; at the outermost level None.
        within: name of the package around the outermost class.
        expandable: of a connector, connections decide which of its variables there are.
        redeclares: it takes the place of an inherited class.
        inherits: it extends the inherited class of its name, `redeclare model extends Law`.
        heir: package that inherits it; its constants and classes come before those around it.
        unsupported: constructs that are refused when the class is used, with their lines.
    """

    name: str
    kind: str
    line: int
    file: str
    owner: ClassText | None = None
    within: str = ""
    partial: bool = False
    description: str = ""
    literals: tuple[str, ...] = ()
    prefixes: frozenset[str] = frozenset()
    short: Extends | None = None
    constrained: Modification | None = None
    elements: list[Import | Extends | Declaration] = field(default_factory=list)
    classes: dict[str, ClassText] = field(default_factory=dict)
    equations: list[Statement] = field(default_factory=list)
    initial_equations: list[Statement] = field(default_factory=list)
    algorithm: list[Statement] = field(default_factory=list)
    experiment: dict[str, float] = field(default_factory=dict)
    icon: list[Token] = field(default_factory=list)
    external: str = ""
    dimensions: tuple[Expr, ...] = ()
    expandable: bool = False
    redeclares: bool = False
    inherits: bool = False
    heir: ClassText | None = None
    unsupported: list[tuple[str, int]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    @property
    def path(self) -> str:
        """Full dotted name."""
        before = self.owner.path if self.owner else self.within
        return f"{before}.{self.name}" if before else self.name

    def place(self, line: int) -> Source:
        """Return a line of its file."""
        text = self.lines[line - 1] if 0 < line <= len(self.lines) else ""
        return Source(self.file, line, " ".join(text.split()))

    def walk(self) -> Iterator[ClassText]:
        """Yield this class and those in it."""
        yield self
        for inner in self.classes.values():
            yield from inner.walk()


def substituted(expression: Expr, values: dict[str, Expr]) -> Expr:
    """Return an expression with simple names replaced."""
    if expression.kind == "name":
        if len(expression.args) == 1 and not expression.args[0][1]:
            return values.get(expression.args[0][0], expression)
        parts = tuple((name, tuple(substituted(index, values) for index in subs)) for name, subs in expression.args)
        return Expr("name", parts, expression.line)
    if expression.kind == "call":
        name, given, named = expression.args
        named = tuple((key, substituted(value, values)) for key, value in named)
        return Expr("call", (name, tuple(substituted(argument, values) for argument in given), named), expression.line)
    args = tuple(substituted(a, values) if isinstance(a, Expr) else a for a in expression.args)
    return Expr(expression.kind, args, expression.line)


def with_operands(expression: Expr, change: Callable[[Expr], Expr]) -> Expr:
    """Return an expression with changed operands or arguments."""
    if expression.kind == "call":
        name, given, named = expression.args
        return Expr("call", (name, tuple(map(change, given)), named), expression.line)
    args = tuple(change(operand) if isinstance(operand, Expr) else operand for operand in expression.args)
    return Expr(expression.kind, args, expression.line)


def nodes(expression: Expr) -> Iterator[Expr]:
    """Yield an expression and all that it is made of."""
    yield expression
    for child in _children(expression):
        yield from nodes(child)


def names_in(expression: Expr) -> Iterator[Expr]:
    """Yield the names in an expression."""
    return (node for node in nodes(expression) if node.kind == "name")


def calls_in(expression: Expr) -> Iterator[Expr]:
    """Yield the calls in an expression."""
    return (node for node in nodes(expression) if node.kind == "call")


def chain(signs: list[str], terms: list[Expr]) -> Expr:
    """Return `a + b - c` of terms and the signs between them.

    The tree of a long chain of products is as deep as it is long; sums, `and` and `or` are joined two by two.
    """
    result = terms[0]
    if len(terms) <= CHAIN or not (set(signs) <= {"+", "-"} or signs[0] in ("or", "and")):
        for sign, term in zip(signs, terms[1:], strict=True):
            result = Expr(sign, (result, term), result.line)
        return result
    pairs = zip(signs, terms[1:], strict=True)
    items = [result, *(Expr("neg", (term,), term.line) if sign == "-" else term for sign, term in pairs)]
    kind = "+" if signs[0] == "-" else signs[0]
    return joined(lambda left, other: Expr(kind, (left, other), left.line), items)


def joined(join: Callable[[Expr, Expr], Expr], items: list[Expr]) -> Expr:
    """Return what joins expressions two by two; many are halved again and again, so that they are not as deep."""
    while len(items) > CHAIN:
        halves = [join(item, other) for item, other in zip(items[::2], items[1::2], strict=False)]
        items = [*halves, *items[2 * len(halves) :]]
    return functools.reduce(join, items)


def _children(expression: Expr) -> Iterator[Expr]:
    if expression.kind == "name":
        for _, subscripts in expression.args:
            yield from subscripts
    elif expression.kind == "call":
        yield from expression.args[1]
        yield from (value for _, value in expression.args[2])
    else:
        yield from (argument for argument in expression.args if isinstance(argument, Expr))
