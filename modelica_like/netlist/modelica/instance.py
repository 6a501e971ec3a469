"""Instances: the members of a class with its bases, and the modifications that reach them."""

from __future__ import annotations

from dataclasses import dataclass, field

from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.modelica.classes import Classes, Found
from modelica_like.netlist.modelica.library import Known
from modelica_like.netlist.modelica.tree import (
    ClassText,
    Declaration,
    Expr,
    Extends,
    Import,
    Modification,
    Statement,
)

_DEEPEST = 40


@dataclass(slots=True)
class Given:
    """A modification, and where its names mean something.

    Attributes:
        value: behind the equals sign.
        scope: instance and class text in which the value's names are looked up.
        inner: modifications of members.
        redeclared: the new declaration or class.
    """

    value: Expr | None = None
    scope: tuple[Instance, ClassText] | None = None
    inner: dict[str, Given] = field(default_factory=dict[str, "Given"])
    redeclared: Declaration | ClassText | None = None
    line: int = 0
    each: bool = False

    def over(self, weaker: Given) -> Given:
        """Return both; this one wins."""
        inner = dict(weaker.inner)
        for name, entry in self.inner.items():
            inner[name] = entry.over(inner[name]) if name in inner else entry
        mine = self.value is not None
        return Given(
            self.value if mine else weaker.value, self.scope if mine else weaker.scope, inner,
            self.redeclared or weaker.redeclared, self.line or weaker.line, self.each if mine else weaker.each,
        )  # fmt: skip


def given(modification: Modification, scope: tuple[Instance, ClassText], line: int) -> Given:
    """Return a modification with its scope."""
    entry = Given(modification.value, scope if modification.value is not None else None, {}, None, line)
    for argument in modification.arguments:
        inner = given(argument.modification, scope, argument.line)
        inner.each = argument.each
        if argument.redeclared is not None:
            inner.redeclared = argument.redeclared
            inner.scope = scope
        for name in reversed(argument.name.split(".")[1:]):
            inner = Given(inner={name: inner}, line=argument.line)
        name = argument.name.split(".")[0]
        entry.inner[name] = inner.over(entry.inner[name]) if name in entry.inner else inner
    return entry


@dataclass(slots=True)
class Member:
    """A declared component of an instance.

    Attributes:
        text: class whose names the declaration uses.
        given: its modifications, all levels merged.
    """

    declaration: Declaration
    text: ClassText
    given: Given
    part: Instance | list[Instance] | None = None


class Instance:
    """One use of a class.

    Args:
        classes: finds classes.
        text: the class.
        given: modifications from outside.
        owner: instance it is a part of.
        name: in its owner.
    """

    def __init__(
        self, classes: Classes, text: ClassText, given: Given, owner: Instance | None = None, name: str = ""
    ) -> None:
        self.classes, self.text, self.given, self.owner, self.name = classes, text, given, owner, name
        self.members: dict[str, Member] = {}
        self.equations: list[tuple[Statement, ClassText]] = []
        self.initial_equations: list[tuple[Statement, ClassText]] = []
        self.algorithm: list[tuple[Statement, ClassText]] = []
        self.folded: set[str] = set()
        self._replaced = {name: entry for name, entry in given.inner.items() if isinstance(entry.redeclared, ClassText)}
        self._collect(text, given, 0)

    @property
    def path(self) -> str:
        """Dotted name from the outermost instance."""
        before = self.owner.path if self.owner else ""
        return f"{before}.{self.name}" if before else self.name

    def find(self, name: str, text: ClassText) -> Found | None:
        """Return the class that a name means, with classes that were redeclared."""
        head, _, rest = name.partition(".")
        replaced = self._replaced.get(head)
        if replaced is not None and isinstance(replaced.redeclared, ClassText) and not rest:
            new, scope = replaced.redeclared, replaced.scope
            assert scope is not None
            new.owner = new.owner or scope[1]
            return new
        return self.classes.find(name, text)

    def _collect(self, text: ClassText, outer: Given, depth: int) -> None:
        if depth > _DEEPEST:
            raise ModelicaTextError(f"{text.path} extends itself.", where=text.place(text.line))
        for what, line in text.unsupported:
            raise refused(what, text, line)
        if text.short is not None:
            self._extend(text.short, text.owner or text, outer, depth)
        declared: dict[str, Declaration] = {}
        for element in text.elements:
            if isinstance(element, Declaration) and declared.setdefault(element.name, element) is not element:
                places = [text.place(line) for line in (declared[element.name].line, element.line)]
                raise ModelicaTextError(f"{element.name} is declared twice in {text.name}.", where=places)
            if isinstance(element, Extends):
                self._extend(element, text, outer, depth)
            elif not isinstance(element, Import):
                self._declare(element, text, outer)
        self.equations += [(equation, text) for equation in text.equations]
        self.initial_equations += [(equation, text) for equation in text.initial_equations]
        self.algorithm += [(statement, text) for statement in text.algorithm]

    def _extend(self, one: Extends, text: ClassText, outer: Given, depth: int) -> None:
        base = self.find(one.base, text)
        if isinstance(base, ClassText):
            inner = given(one.modification, (self, text), one.line)
            self._replaced |= {k: v for k, v in inner.inner.items() if isinstance(v.redeclared, ClassText)}
            self._collect(base, outer.over(inner), depth + 1)
        elif isinstance(base, Known):
            what = f"{text.name} extends {base.path}, for which a component of its own stands here"
            raise refused(what, text, one.line, "Write it as a part, and connect its ends.")
        elif ".Icons." not in f".{one.base}" and not one.base.endswith(".Icon"):
            raise unknown_class(one.base, text, one.line)

    def _declare(self, declaration: Declaration, text: ClassText, outer: Given) -> None:
        for word in ("inner", "outer", "stream"):
            if word in declaration.prefixes:
                raise refused(f"'{word}' before {declaration.name}", text, declaration.line)
        entry = given(declaration.modification, (self, text), declaration.line)
        from_outside = outer.inner.get(declaration.name)
        if from_outside is not None:
            entry = from_outside.over(entry)
        if isinstance(entry.redeclared, Declaration):
            new = entry.redeclared
            scope = from_outside.scope if from_outside and from_outside.scope else (self, text)
            entry = given(new.modification, scope, new.line).over(entry)
            entry.redeclared = None
            prefixes = declaration.prefixes | new.prefixes
            declaration = Declaration(
                prefixes,
                new.type,
                declaration.name,
                declaration.dimensions,
                declaration.modification,
                declaration.condition,
                declaration.description,
                new.line,
            )
            text = scope[1]
        self.members.setdefault(declaration.name, Member(declaration, text, entry))


def refused(what: str, text: ClassText, line: int, advice: str = "") -> ModelicaTextError:
    """Return the error about a construct that is not supported."""
    # A name at the beginning stays as it is.
    words = ("a", "an", "the", "this", "these", "external", "overloaded")
    sentence = f"{what[0].upper()}{what[1:]}" if what.split()[0] in words else what
    return ModelicaTextError(f"{sentence}: that is not supported here.", where=text.place(line), advice=advice)


def unknown_class(name: str, text: ClassText, line: int) -> ModelicaTextError:
    """Return the error about a class that is nowhere."""
    library = name.lstrip(".").startswith("Modelica.") or text.within.startswith("Modelica")
    why = "No component here stands for this class of the standard library." if library else ""
    return ModelicaTextError(f"There is no class '{name}'.", where=text.place(line), why=why)
