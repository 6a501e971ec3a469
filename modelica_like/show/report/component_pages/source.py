"""Content of a component class, read from its source text: equations, events, energy terms, definitions."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from textwrap import dedent
from types import FunctionType
from typing import Any, NamedTuple

from modelica_like.language import Component
from modelica_like.language.inside import declarations
from modelica_like.parsing import parse, source_lines
from modelica_like.show.report.component_pages import latex_names as names
from modelica_like.show.report.component_pages.latex import (
    OR,
    RELATION,
    Column,
    Meaning,
    Path,
    Unwritable,
    Writer,
    Written,
    otherwise,
)
from modelica_like.show.report.component_pages.markdown import markdown

_ENERGY = ("stored_energy", "loss_power", "source_power")
_LANGUAGE = "modelica_like.language"


class Term(NamedTuple):
    """An equation or a definition: both sides as LaTeX, the sign between them, and its condition."""

    left: str
    right: str
    sign: str = "="
    where: str = ""


class Event(NamedTuple):
    """A transition, or the choice of the mode at the start (`source` is then empty); mathematics as LaTeX."""

    mode: str
    source: str
    target: str
    when: str
    resets: str
    notice: str
    where: str = ""


Said = Term | Event | str
"""An equation, an event, or a paragraph in Markdown."""


class Function(NamedTuple):
    """A function of a class (`owner`), or of a module."""

    name: str
    code: ast.FunctionDef
    constants: Mapping[str, Any]
    owner: type | None = None


@dataclass
class Source:
    """Content of a class.

    Attributes:
        kind: the class.
        asked: optional parameters on which its equations depend.
        uses: conditions of each field that occurs: names of parameters, and whether they are given.
    """

    kind: type[Component]
    asked: dict[str, None] = field(default_factory=dict[str, None])
    uses: dict[str, list[dict[str, bool]]] = field(default_factory=dict[str, list[dict[str, bool]]])
    found: dict[str, Function] = field(default_factory=dict[str, Function])
    conditions: dict[str, bool] = field(default_factory=dict[str, bool])

    def says(self, name: str) -> list[Said]:
        """Return the items of `equations` or `events`."""
        function = self.method(name)
        return list(_reader(self, function, {}).body(function.code.body)) if function else []

    def energy(self) -> list[Said]:
        """Return the energy terms."""
        terms = (_reader(self, method).definition(method.name) for name in _ENERGY if (method := self.method(name)))
        return [said for term in terms for said in term]

    def definitions(self) -> Iterator[Said]:
        """Yield definitions of the methods, properties and functions that have occurred, recursively."""
        done: set[str] = set(_ENERGY)
        while missing := [name for name in self.found if name not in done]:
            for name in missing:
                done.add(name)
                reader = _reader(self, self.found[name])
                sentence = markdown(reader.sentence())
                yield sentence and f"{sentence}:"
                yield from reader.definition(name)

    def symbol(self, name: str, dots: int = 0) -> str:
        """Return the symbol of a method or property: words if a connector has the same symbol."""
        letter = names.name(name.lstrip("_"), dots)
        ends = (f"{end}.{q}" for end, connector in declarations(self.kind).connectors.items() for q in connector.fields)
        return names.text(name) if letter in map(names.name, ends) else letter

    def method(self, name: str, after: type | None = None) -> Function | None:
        """Return a method or property of the class from a library, or the next one after a base."""
        line = self.kind.__mro__[self.kind.__mro__.index(after) + 1 if after else 0 :]
        base = next((text for text in line if name in vars(text)), Component)
        return None if base in Component.__mro__ else in_class(base, name)


def in_class(base: type, name: str) -> Function | None:
    """Return a method or property that a class itself has."""
    member = vars(base).get(name)
    member = member.fget if isinstance(member, property) else member
    return Function(name, _parsed(member), member.__globals__, base) if isinstance(member, FunctionType) else None


def plain_function(name: str, function: FunctionType) -> Function:
    """Return a function of a module."""
    return Function(name, _parsed(function), function.__globals__)


@lru_cache(maxsize=1024)
def _parsed(function: FunctionType) -> ast.FunctionDef:
    (code,) = parse(dedent("".join(source_lines(function)[0]))).body
    assert isinstance(code, ast.FunctionDef)
    return code


@dataclass(frozen=True)
class _Reader(Writer):
    """Reads one function."""

    source: Source
    of: Function

    # -- what occurs ---------------------------------------------------------------------------------------------------

    def member(self, path: str, dots: int) -> str:
        if (method := self.source.method(path)) is not None:
            self.source.found.setdefault(path, method)
            return self.source.symbol(path, dots)
        if path in declarations(self.source.kind).fields:
            self.source.uses.setdefault(path, []).append(dict(self.source.conditions))
        return names.name(path, dots)

    def function(self, name: str) -> bool:
        member = self.of.constants.get(name)
        if not isinstance(member, FunctionType) or member.__module__.startswith(_LANGUAGE):
            return False
        self.source.found.setdefault(name, plain_function(name, member))
        return True

    def which_mode(self, path: str) -> str:
        return f"{path}: " if len(declarations(self.source.kind).modes) > 1 else ""

    def inherited(self, name: str) -> str:
        method = self.source.method(name, self.of.owner)
        if method is None or method.owner is None:
            raise Unwritable
        title = f"{name} of {method.owner.__name__}"
        self.source.found.setdefault(title, method)
        return title

    @contextmanager
    def under(self, test: ast.expr, *, holds: bool) -> Iterator[None]:
        before = dict(self.source.conditions)
        holds = holds != isinstance(test, ast.UnaryOp)
        for node in ast.walk(test):
            match node:
                case ast.Call(func=ast.Attribute(attr="given"), args=[ast.Constant(value=str() as name)]):
                    self.source.asked[name] = None
                    self.source.conditions |= {} if isinstance(test, ast.BoolOp) else {name: holds}
                case _:
                    pass
        yield
        self.source.conditions = before

    # -- equations and events ------------------------------------------------------------------------------------------

    def body(self, statements: Sequence[ast.stmt]) -> Iterator[Said]:
        """Yield the items of statements, one after the other; source text for items without notation."""
        for k, statement in enumerate(statements):
            match statement:
                case ast.If(test=test, body=[*before, ast.Return()], orelse=other):
                    yield from self.body([ast.If(test, before, [*other, *statements[k + 1 :]])])
                    return
                case _:
                    for name in _changed(statement):
                        self.local.pop(name, None)
            try:
                yield from list(self._statement(statement))
            except Unwritable:
                yield f"```python\n{ast.unparse(statement)}\n```"

    def _statement(self, statement: ast.stmt) -> Iterator[Said]:
        match statement:
            case ast.Raise() | ast.Return() | ast.Expr(value=ast.Constant()):
                pass
            case ast.Expr(value=ast.Yield(value=ast.expr() as value)):
                yield self._yielded(value)
            case ast.Expr(value=ast.YieldFrom(value=ast.Call() as call)):
                yield from self._from(call)
            case ast.Assign(targets=[target], value=value) | ast.AnnAssign(target=target, value=ast.expr() as value):
                yield from self._assigned(target, value)
            case ast.If(test=ast.UnaryOp(operand=test), body=then, orelse=other):
                yield from self._statement(ast.If(test, other, then))
            case ast.If(test=test, body=then, orelse=other):
                for word, branch in (("if", then), ("unless", other)):
                    where = rf"\text{{{word} }} {self.latex(test)}"
                    with self.under(test, holds=word == "if"):
                        yield from (_where(where, item) for item in self._again().body(branch))
            case _:
                raise Unwritable

    def _from(self, call: ast.Call) -> Iterator[Said]:
        """Yield the items of another method in the place of its call."""
        arguments = call.args
        match call.func:
            case ast.Attribute(value=ast.Call(), attr=name):
                function = self.source.method(name, self.of.owner)
            case ast.Attribute(value=ast.Name(id="self"), attr=name):
                function = self.source.method(name)
            case ast.Attribute(value=ast.Name(id=base), attr=name):
                function, arguments = in_class(self.constants[base], name), arguments[1:]
            case ast.Name(id=name) if name in self.constants and name != "series":
                function = plain_function(name, self.constants[name])
            case _:
                raise Unwritable
        if function is not None:
            formal = [argument.arg for argument in function.code.args.args if argument.arg != "self"]
            given = dict(zip(formal, arguments, strict=False)) | {k.arg or "": k.value for k in call.keywords}
            local: dict[str, Meaning] = {name: self.path(value) or self.write(value) for name, value in given.items()}
            yield from _reader(self.source, function, local).body(function.code.body)

    # -- what functions return -----------------------------------------------------------------------------------------

    def definition(self, name: str) -> list[Said]:
        """Return the definition of a function: terms of its local names and of itself, or its source text."""
        lines: list[Said] = []
        formal = list(self.local)
        try:
            value = self._returned(self.of.code.body, lines)
        except Unwritable:
            return [f"```python\n{ast.unparse(self.of.code)}\n```"]
        if value is not None:
            arguments = ", ".join(names.name(argument) for argument in formal)
            left = self.source.symbol(name) + (rf"\left({arguments}\right)" if formal else "")
            lines.append(Term(left, value.latex, r"\Leftrightarrow" if OR <= value.binds <= RELATION else "="))
        return lines

    def _again(self) -> _Reader:
        """Return a reader that may change the meaning of local names."""
        return replace(self, local=dict(self.local))

    def _returned(self, statements: Sequence[ast.stmt], lines: list[Said] | None = None) -> Written | None:
        """Return the value of statements, None if they raise; without lines, local names are replaced."""
        for k, statement in enumerate(statements):
            match statement:
                case ast.Raise():
                    return None
                case ast.Return(value=ast.expr() as value):
                    return self.write(value)
                case (
                    ast.Assign(targets=[target], value=value) | ast.AnnAssign(target=target, value=ast.expr() as value)
                ):
                    said = list(self._assigned(target, value))
                    if lines is not None:
                        lines += said
                    elif isinstance(target, ast.Name):
                        self.local[target.id] = self.path(value) or self.write(value)
                    elif said:
                        raise Unwritable
                case ast.If(test=test, body=then, orelse=other):
                    rest = statements[k + 1 :]
                    with self.under(test, holds=True):
                        first = self._again()._returned([*then, *rest])
                    with self.under(test, holds=False):
                        second = self._again()._returned([*other, *rest])
                    return otherwise(self.latex(test), first, second) if first and second else first or second
                case ast.Expr(value=ast.Constant()):
                    pass
                case _:
                    raise Unwritable
        return None

    def sentence(self) -> str:
        """Return the first sentence of the docstring, or of the overridden method's."""
        function: Function | None = self.of
        while function is not None:
            if text := ast.get_docstring(function.code):
                sentence = text.partition("\n")[0].removeprefix("Return ").removesuffix(".")
                return sentence[:1].upper() + sentence[1:]
            function = self.source.method(function.name, function.owner) if function.owner else None
        return ""

    def _assigned(self, target: ast.expr, value: ast.expr) -> Iterator[Said]:
        """Store a local name: its meaning if that is a path or a column of a table, otherwise a term."""
        match target, value:
            case ast.Tuple(elts=targets), ast.Tuple(elts=values):
                for part, other in zip(targets, values, strict=True):
                    yield from self._assigned(part, other)
            case ast.Tuple(elts=targets), ast.Call(func=ast.Name(id="zip"), args=[ast.Starred(value=table)]):
                path = self.path(table)
                if path is None or not all(isinstance(t, ast.Name) for t in targets):
                    raise Unwritable
                for k, part in enumerate(targets):
                    assert isinstance(part, ast.Name)
                    self.local[part.id] = Column(path.path, "" if len(targets) == 2 else str(k))
            case ast.Name(id=name), ast.Dict():
                self.local[name] = value
            case ast.Name(id=name), _ if (path := self.path(value)) is not None:
                self.local[name] = path
            case ast.Name(id=name), _:
                left, right = names.name(name), self.write(value)
                self.local[name] = right if right.latex == left else Path(name, own=False)
                yield from [] if right.latex == left else [Term(left, right.latex)]
            case ast.Tuple(elts=targets), _:
                right = self.latex(value)
                self.local.update({t.id: Path(t.id, own=False) for t in targets if isinstance(t, ast.Name)})
                yield Term(self.latex(target), right)
            case _:
                raise Unwritable

    def _yielded(self, value: ast.expr) -> Said:
        match value:
            case ast.Compare(left=left, ops=[ast.Eq()], comparators=[right]):
                return Term(self.latex(left), self.latex(right))
            case ast.Call(func=ast.Name(id="connect"), args=ends):
                paths = [self.path(end) for end in ends]
                if None not in paths:
                    return "- " + " = ".join(f"`{path.path}`" for path in paths if path)
            case ast.Call(func=ast.Attribute(value=owner, attr="go" | "initially"), args=arguments, keywords=options):
                mode = self.path(owner)
                if mode is not None:
                    return self._event(mode.path, arguments, {option.arg or "": option.value for option in options})
            case _:
                pass
        raise Unwritable

    def _event(self, mode: str, arguments: Sequence[ast.expr], options: Mapping[str, ast.expr]) -> Event:
        try:
            *sources, target = (ast.literal_eval(argument) for argument in arguments)
        except ValueError:  # not only words
            raise Unwritable from None
        source = ", ".join(sources[0]) if sources and isinstance(sources[0], tuple) else "".join(sources)
        when = self.latex(options["when"]) if "when" in options else f"t = {self.latex(options['at'])}"
        reset, notice = options.get("reset", ast.Dict([], [])), options.get("notice", ast.Constant(""))
        reset = self.local.get(reset.id) if isinstance(reset, ast.Name) else reset
        if not isinstance(reset, ast.Dict) or None in reset.keys:  # None stands for `**others`
            raise Unwritable
        pairs = zip(filter(None, reset.keys), reset.values, strict=True)
        resets = "; ".join(f"${self.latex(what)} := {self.latex(new)}$" for what, new in pairs)
        said = str(notice.value) if isinstance(notice, ast.Constant) else ast.unparse(notice)
        return Event(mode, "any" if source == "*" else source, target, when, resets, said)


def _reader(source: Source, of: Function, local: dict[str, Meaning] | None = None) -> _Reader:
    """Return a reader of a function; without meanings, its arguments are symbols."""
    formal = [argument.arg for argument in of.code.args.args if argument.arg != "self"]
    return _Reader(
        of.constants,
        {argument: Path(argument, own=False) for argument in formal} if local is None else local,
        source,
        of,
    )


def _changed(statement: ast.stmt) -> Iterator[str]:
    """Yield names whose values a statement changes."""
    for node in ast.walk(statement):
        match node:
            case ast.Subscript(value=ast.Name(id=name), ctx=ast.Store()) | ast.AugAssign(target=ast.Name(id=name)):
                yield name
            case _:
                pass


def _where(condition: str, said: Said) -> Said:
    """Return the items under a condition."""
    if isinstance(said, str):
        return f"${condition}$:\n\n{said}"
    return said._replace(where=rf"{condition} \text{{, }} {said.where}" if said.where else condition)
