"""Instances: the members of a class with its bases, and the modifications that reach them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from modelica_like.errors import ModelicaTextError, Source, UnknownName, did_you_mean
from modelica_like.language.inside import declarations
from modelica_like.netlist.modelica.classes import Classes, Found
from modelica_like.netlist.modelica.library import Known, table
from modelica_like.netlist.modelica.stiction import yielding
from modelica_like.netlist.modelica.tree import (
    ClassText,
    Declaration,
    Expr,
    Extends,
    Import,
    Modification,
    Statement,
)

GIVE = "Give the library's own text by --library."
DEEPEST = 40
_NO_DECLARATION = Declaration(frozenset(), "", "", (), Modification(), None, "", 0)


@dataclass(slots=True)
class Given:
    """A modification, and where its names mean something.

    Attributes:
        value: behind the equals sign.
        scope: instance and class text in which the value's names are looked up.
        inner: modifications of members.
        redeclared: the new declaration or class.
        final: nothing further outside may change it.
        text: class in whose text it stands.
    """

    value: Expr | None = None
    scope: tuple[Instance, ClassText] | None = None
    inner: dict[str, Given] = field(default_factory=dict[str, "Given"])
    redeclared: Declaration | ClassText | None = None
    line: int = 0
    each: bool = False
    final: bool = False
    text: ClassText | None = None

    def over(self, weaker: Given, name: str = "") -> Given:
        """Return both; this one wins.

        Args:
            weaker: the modification that stands further inside.
            name: of what both modify, for messages.

        Raises:
            ModelicaTextError: the weaker one is final.
        """
        if weaker.final and (self.value is not None or self.inner or self.redeclared):
            places = [modifier.text.place(modifier.line) for modifier in (self, weaker) if modifier.text is not None]
            raise ModelicaTextError(f"{name} is final: it cannot be changed from outside.", where=places)
        inner = dict(weaker.inner)
        for key, entry in self.inner.items():
            inner[key] = entry.over(inner[key], f"{name}.{key}".lstrip(".")) if key in inner else entry
        mine = self.value is not None or self.redeclared is not None
        return Given(
            self.value or weaker.value, self.scope if mine else weaker.scope, inner,
            self.redeclared or weaker.redeclared, self.line or weaker.line, self.each if mine else weaker.each,
            self.final or weaker.final, self.text or weaker.text,
        )  # fmt: skip

    def clash(self, other: Given, name: str) -> str:
        """Return the name that both of two entries of one modification give a value, empty if there is none."""
        if (self.value and other.value) or (self.redeclared and other.redeclared):
            return name
        common = (self.inner[key].clash(other.inner[key], f"{name}.{key}") for key in self.inner if key in other.inner)
        return next(filter(None, common), "")


def given(modification: Modification, scope: tuple[Instance, ClassText], line: int) -> Given:
    """Return a modification with its scope."""
    entry = Given(modification.value, scope if modification.value is not None else None, {}, None, line, text=scope[1])
    for argument in modification.arguments:
        inner = given(argument.modification, scope, argument.line)
        inner.each, inner.final = argument.each, argument.final
        if argument.redeclared is not None:
            inner.redeclared = argument.redeclared
            inner.scope = scope
        for name in reversed(argument.name.split(".")[1:]):
            inner = Given(inner={name: inner}, line=argument.line, text=scope[1])
        name = argument.name.split(".")[0]
        before = entry.inner.get(name)
        twice = inner.clash(before, name) if before is not None else ""
        if twice:
            where = scope[1].place(argument.line)
            raise ModelicaTextError(
                f"One modification gives {twice} two values.", where=where, advice="Remove one of them."
            )
        entry.inner[name] = replace(inner.over(replace(before, final=False)), final=before.final) if before else inner
    return entry


def of_version_4(entry: Given, lineage: Iterable[ClassText | Known]) -> Given:
    """Return a modification of a class of the standard library with the names of parameters that version 4 has.

    Args:
        entry: the modification.
        lineage: the class and its bases.
    """
    renamed = table()["renamed_parameters"]
    if not renamed.keys() & entry.inner.keys():
        return entry
    names: set[str] = set()
    standard = False
    for kind in lineage:
        standard = standard or kind.path.startswith("Modelica.")
        if isinstance(kind, ClassText):
            names |= {element.name for element in kind.elements if isinstance(element, Declaration)}
        else:
            names |= {*declarations(kind.type).fields, *kind.names.values(), *kind.only}
    new = {old: renamed.get(old, old) if standard and old not in names else old for old in entry.inner}
    return replace(entry, inner={new[old]: value for old, value in entry.inner.items() if new[old]})


@dataclass(slots=True)
class Member:
    """A declared component of an instance.

    Attributes:
        text: class whose names the declaration uses.
        given: its modifications, all levels merged.
        parts: its instances, by their places in an array; made on first use.
        constraint: modification of a constraining class is among them.
    """

    declaration: Declaration
    text: ClassText
    given: Given
    parts: dict[tuple[int, ...], Instance] | None = None
    constraint: bool = False


class Instance:
    """One use of a class.

    Args:
        classes: finds classes.
        text: the class.
        given: modifications from outside.
        owner: instance it is a part of.
        name: in its owner.

    Attributes:
        members: by name, those of bases first.
        adopted: equations of parts that use what is in this instance.
        own_pairs: ends that its equations connect, once they are known.
        pairs: likewise, without those of `outer` parts, with those of parts with its `inner` ones.
        frozen: parameters whose values are in what was read, of components of the table in it, too, by their names.
        lent: own discrete variables whose equations stand in an instance above.
        driving: protected signals that drive parts.
        late: values of discrete variables before the start that only a run knows.
        bus_wires: connections of variables of buses that go no further up.
        bus_equations: own signals that are equal to variables of buses.
        balance: equations of continuous variables that are lent, less those that are adopted.
        lineage: its class and the bases, these first.
    """

    def __init__(
        self, classes: Classes, text: ClassText, given: Given, owner: Instance | None = None, name: str = ""
    ) -> None:
        given = of_version_4(given, classes.lineage(text))
        self.classes, self.text, self.given, self.owner, self.name = classes, text, given, owner, name
        self.members: dict[str, Member] = {}
        self.equations: list[tuple[Statement, ClassText]] = []
        self.initial_equations: list[tuple[Statement, ClassText]] = []
        self.algorithm: list[tuple[Statement, ClassText]] = []
        self.folded: set[str] = set()
        self.free: dict[str, str] = {}
        self.values: dict[str, Expr] = {}
        self.formulas: dict[str, Expr | None] = {}
        self.seen_from: dict[tuple[str, str], Expr] = {}
        self.frozen: dict[str, set[str]] = {}
        self.adopted: list[tuple[Expr, Expr, Source]] = []
        self.own_pairs: list[tuple[str, str, Source]] | None = None
        self.pairs: list[tuple[str, str, Source]] | None = None
        self.lent: set[str] = set()
        self.balance = 0
        self.lineage: list[ClassText] = []
        self.driving: set[str] = set()
        self.late: dict[str, Expr] = {}
        self.bus_wires: list[tuple[tuple[str, ...], Source]] = []
        self.bus_equations: list[tuple[str, str, Source]] = []
        self._replaced = {name: entry for name, entry in given.inner.items() if isinstance(entry.redeclared, ClassText)}
        self._demand(given, self._collect(text, given, 0), text)

    @property
    def path(self) -> str:
        """Dotted name from the outermost instance."""
        before = self.owner.path if self.owner else ""
        return f"{before}.{self.name}" if before else self.name

    def frozen_in(self, part: str = "") -> set[str]:
        """Return the parameters whose values are in what was read: its own, or those of a component in it."""
        return self.frozen.setdefault(part, set())

    def freeze(self, name: str, part: str = "") -> None:
        """Note that what was read has the value of a parameter: it cannot change afterwards."""
        if not self.classes.only_said:
            self.frozen_in(part).add(name)

    @property
    def full_name(self) -> str:
        """Name of the model, and the path of the instance in it."""
        return f"{self.owner.full_name}.{self.name}" if self.owner else self.text.name

    def find(self, name: str, text: ClassText) -> Found | None:
        """Return the class that a name means, with classes that were redeclared."""
        head, _, rest = name.partition(".")
        replaced = self._replaced.get(head)
        if replaced is not None and isinstance(replaced.redeclared, ClassText):
            new, scope = replaced.redeclared, replaced.scope
            if scope is not None and scope[0] is not self and new.short and new.kind in ("package", "function"):
                base = new.short.base
                if base.partition(".")[0] in scope[0]._replaced:  # `redeclare package M = M`: what it is there
                    if new.short.modification.arguments:
                        what = f"{new.kind} {new.name} = {base}(…), which is handed on with a modification,"
                        raise refused(what, new, new.line, "Give the modification where it is replaced first.")
                    return scope[0].find(f"{base}.{rest}".rstrip("."), new.owner or text)
            return self.classes.inside(new, rest) if rest else new
        return self.classes.find(name, text)

    def inner(self, name: str) -> Instance | None:
        """Return the instance above whose part an `outer` declaration means; None, and remembered, if there is none."""
        level = self.owner
        while (
            level is not None
            and "inner" not in getattr(level.members.get(name), "declaration", _NO_DECLARATION).prefixes
        ):
            level = level.owner
        if level is None and name in self.members:
            self.classes.missing.setdefault(name, self.members[name])
        return level

    def scope_of(self, text: ClassText) -> Instance:
        """Return the instance whose names a short class uses: that of the redeclaration, or this one."""
        scopes = (entry.scope for entry in self._replaced.values() if entry.redeclared is text)
        scope = next(scopes, None)
        return self if scope is None else scope[0]

    def constraint(self, name: str, text: ClassText) -> Given:
        """Return the modification behind the `constrainedby` of a class, which a class in its place takes, too."""
        declared = self.classes.find(name, text)
        if not isinstance(declared, ClassText) or declared.constrained is None:
            return Given()
        return given(declared.constrained, (self, declared.owner or declared), declared.line)

    def _demand(self, entries: Given, names: set[str], text: ClassText) -> None:
        """Refuse modifications of what a class does not have."""
        for name, entry in entries.inner.items():
            if name not in names:
                what = f"{text.name} has no '{name}'{did_you_mean(name, names) or '.'}"
                raise UnknownName(what, where=(entry.text or text).place(entry.line))

    def _collect(self, text: ClassText, outer: Given, depth: int) -> set[str]:
        """Collect the members of a class and its bases; return the names it has for modifications."""
        if depth > DEEPEST:
            raise ModelicaTextError(f"{text.path} extends itself.", where=text.place(text.line))
        for what, line in text.unsupported:
            raise refused(what, text, line)
        names = set(text.classes)
        if text.short is not None:
            names |= self._extend(text.short, text.owner or text, outer, depth)
        declared: dict[str, Declaration] = {}
        for element in text.elements:
            if isinstance(element, Declaration) and declared.setdefault(element.name, element) is not element:
                places = [text.place(line) for line in (declared[element.name].line, element.line)]
                raise ModelicaTextError(f"{element.name} is declared twice in {text.name}.", where=places)
            if isinstance(element, Extends):
                names |= self._extend(element, text, outer, depth)
            elif not isinstance(element, Import) and "redeclare" not in element.prefixes:
                self._declare(element, text, outer)
        self.lineage.append(text)
        self.equations += [(equation, text) for equation in yielding(text.equations)]
        self.initial_equations += [(equation, text) for equation in text.initial_equations]
        self.algorithm += [(statement, text) for statement in text.algorithm]
        return names | declared.keys()

    def _extend(self, clause: Extends, text: ClassText, outer: Given, depth: int) -> set[str]:
        base = self.find(clause.base, text)
        if isinstance(base, Known):
            base = self.classes.text_of(base.path) or base
        if isinstance(base, ClassText):
            inner = of_version_4(given(clause.modification, (self, text), clause.line), self.classes.lineage(base))
            inner.inner |= self._redeclaring(text)
            redeclared = {k: v for k, v in inner.inner.items() if isinstance(v.redeclared, ClassText)}
            self._replaced = redeclared | self._replaced
            names = self._collect(base, outer.over(inner), depth + 1)
            self._demand(inner, names, base)
            return names
        if isinstance(base, Known):
            what = f"{text.name} extends {base.path}, for which a component of its own stands here"
            raise refused(what, text, clause.line, f"Write it as a part, and connect its ends. {GIVE}")
        if ".Icons." not in f".{clause.base}" and not clause.base.endswith((".Icon", "ExternalObject")):
            raise unknown_class(clause.base, text, clause.line)
        return set()

    def _with_dimensions(self, declaration: Declaration, text: ClassText) -> Declaration:
        """Return a declaration with the dimensions of its type, `type Axis = Real[3]`."""
        dimensions, found = declaration.dimensions, self.find(declaration.type, text)
        steps = 0
        while isinstance(found, ClassText) and found.short is not None:
            dimensions, steps = dimensions + found.dimensions, steps + 1
            if steps > DEEPEST:
                raise ModelicaTextError(f"{found.path} extends itself.", where=found.place(found.line))
            found = self.classes.find(found.short.base, found.owner or found)
        return declaration if dimensions == declaration.dimensions else replace(declaration, dimensions=dimensions)

    def _redeclaring(self, text: ClassText) -> dict[str, Given]:
        """Return what a class says anew of its bases, by elements with `redeclare`."""
        parts = [e for e in text.elements if isinstance(e, Declaration) and "redeclare" in e.prefixes]
        classes = [inner for inner in text.classes.values() if inner.redeclares]
        return {
            new.name: Given(redeclared=new, scope=(self, text), line=new.line, text=text) for new in (*parts, *classes)
        }

    def _declare(self, declaration: Declaration, text: ClassText, outer: Given) -> None:
        if "stream" in declaration.prefixes:
            raise refused(f"'stream' before {declaration.name}", text, declaration.line)
        declaration = self._with_dimensions(declaration, text)
        entered = given(declaration.modification, (self, text), declaration.line)
        entered.final = "final" in declaration.prefixes
        bound = declaration.constrained
        constraint = Given() if bound is None else given(bound, (self, text), declaration.line)
        outside = outer.inner.get(declaration.name, Given())
        entry = outside.over(entered.over(constraint, declaration.name), declaration.name)
        new = outside.redeclared
        if isinstance(new, Declaration):
            # Modifications of the declaration hold for what takes its place, unless `constrainedby` has others.
            kept = entered if bound is None else constraint
            scope = outside.scope or (self, text)
            rest = replace(outside, redeclared=None, final=False)
            entry = given(new.modification, scope, new.line).over(rest.over(kept), declaration.name)
            prefixes = declaration.prefixes | new.prefixes
            declaration = replace(declaration, prefixes=prefixes, type=new.type, line=new.line)
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
    advice = GIVE if library else ""
    return ModelicaTextError(f"There is no class '{name}'.", where=text.place(line), why=why, advice=advice)
