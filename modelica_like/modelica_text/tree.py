"""The syntax tree of Modelica text; every node knows its line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from modelica_like.errors import Source


@dataclass(frozen=True, slots=True)
class Expr:
    """An expression.

    Attributes:
        kind: an operator (`+`, `neg`, `<`, `and` …), or `number`, `string`, `boolean`, `name`, `call`, `if`, `array`,
            `range`, `all` (a colon), `for` (an array built by iterators).
        args: operands. A `name` has pairs of a name and its subscripts; a `call` the function's dotted name, the
            positional arguments and the pairs of named ones; an `if` conditions and values in turn, then a value.
        line: where it begins.
    """

    kind: str
    args: tuple[Any, ...]
    line: int = 0

    @property
    def path(self) -> str:
        """Dotted name without subscripts, empty if it is not a name."""
        return ".".join(part[0] for part in self.args) if self.kind == "name" else ""


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
    """

    prefixes: frozenset[str]
    type: str
    name: str
    dimensions: tuple[Expr, ...]
    modification: Modification
    condition: Expr | None
    description: str
    line: int


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
        experiment: numbers of the annotation `experiment`, such as `StopTime`.
        file: it was read from.
        owner: enclosing class; at the outermost level None.
        within: name of the package around the outermost class.
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
    elements: list[Import | Extends | Declaration] = field(default_factory=list)
    classes: dict[str, ClassText] = field(default_factory=dict)
    equations: list[Statement] = field(default_factory=list)
    initial_equations: list[Statement] = field(default_factory=list)
    algorithm: list[Statement] = field(default_factory=list)
    experiment: dict[str, float] = field(default_factory=dict)
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
        parts = tuple((name, tuple(substituted(one, values) for one in subs)) for name, subs in expression.args)
        return Expr("name", parts, expression.line)
    if expression.kind == "call":
        name, given, named = expression.args
        named = tuple((key, substituted(one, values)) for key, one in named)
        return Expr("call", (name, tuple(substituted(one, values) for one in given), named), expression.line)
    args = tuple(substituted(one, values) if isinstance(one, Expr) else one for one in expression.args)
    return Expr(expression.kind, args, expression.line)


def names_in(expression: Expr) -> Iterator[Expr]:
    """Yield the names in an expression."""
    if expression.kind == "name":
        yield expression
    for one in _children(expression):
        yield from names_in(one)


def calls_in(expression: Expr) -> Iterator[Expr]:
    """Yield the calls in an expression."""
    if expression.kind == "call":
        yield expression
    for one in _children(expression):
        yield from calls_in(one)


def _children(expression: Expr) -> Iterator[Expr]:
    if expression.kind == "name":
        for _, subscripts in expression.args:
            yield from subscripts
    elif expression.kind == "call":
        yield from expression.args[1]
        yield from (one for _, one in expression.args[2])
    else:
        yield from (one for one in expression.args if isinstance(one, Expr))
