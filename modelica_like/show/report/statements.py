"""Equations, events and energies of a component type as lines of text, read from its source: nothing is left out.

Methods of the base classes stand in the place of their calls, conditions and loops keep their form, and the methods
that occur in formulas are defined below them. Names that are private to a class or a module lose their underscore.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator, Mapping, Sequence
from types import FunctionType
from typing import Any, TypeGuard

from modelica_like.language import Component
from modelica_like.show.report.component_pages.source import Function, Source, in_class, plain_function

_ENERGY = ("stored_energy", "loss_power", "source_power")
_LANGUAGE = "modelica_like.language"
Names = Mapping[str, ast.expr]


def statements(kind: type[Component]) -> dict[str, list[str]]:
    """Return lines by title: equations, events, energy, and the definitions of what occurs in them."""
    reader = _Reader(kind)
    said = {
        name: of
        for name in ("equations", "initial_equations", "events", *_ENERGY)
        if (of := reader.source.method(name))
    }
    by_method = {name: list(reader.body(of, of.code.body, {})) for name, of in said.items() if name not in _ENERGY}
    by_method["energy"] = [line for name, of in said.items() if name in _ENERGY for line in reader.defined(of)]
    done: set[str] = set(_ENERGY)
    where: list[str] = []
    while missing := [name for name in reader.found if name not in done]:
        for name in missing:
            done.add(name)
            where += reader.defined(reader.found[name], name)
    where += [f"{shown(name)} = {value}" for name, value in reader.constants.items()]
    return {title.replace("_", " "): lines for title, lines in {**by_method, "where": where}.items() if lines}


def shown(name: str) -> str:
    """Return a name, or the last one of a path, without the underscore that makes it private."""
    owner, dot, last = name.rpartition(".")
    return f"{owner}{dot}{last.lstrip('_') or last}"


class _Reader:
    """Reads the methods of a class; `found` are methods and functions in formulas, `constants` those of modules."""

    def __init__(self, kind: type[Component]) -> None:
        self.source = Source(kind)
        self.found: dict[str, Function] = {}
        self.constants: dict[str, str] = {}

    def defined(self, of: Function, name: str = "") -> list[str]:
        """Return the definition of a method or a function."""
        arguments = ", ".join(argument.arg for argument in of.code.args.args if argument.arg != "self")
        head = shown(name or of.name)
        head += "" if isinstance(vars(of.owner or object).get(of.name), property) else f"({arguments})"
        lines = list(self.body(of, of.code.body, {}))
        if len(lines) == 1 and lines[0].startswith("return "):
            return [f"{head} = {lines[0].removeprefix('return ')}"]
        return [f"{head}:", *(f"  {line}" for line in lines)]

    def body(self, of: Function, code: Sequence[ast.stmt], names: Names) -> Iterator[str]:
        """Yield the lines of statements, in which local names have a meaning."""
        names = dict(names)
        for k, statement in enumerate(code):
            match statement:
                case ast.Expr(value=ast.Constant()) | ast.Return(value=None) | ast.Raise():
                    pass
                case ast.Return(value=ast.Call(func=ast.Name(id="iter"))):  # nothing is yielded
                    pass
                case ast.Expr(value=ast.Yield(value=ast.expr() as value)):
                    yield self.text(of, value, names)
                case ast.Expr(value=ast.YieldFrom(value=ast.Call() as call)):
                    yield from self._inlined(of, call, names)
                case ast.If(test=test, body=[*before, ast.Return(value=None)], orelse=[]) if code[k + 1 :]:
                    yield from self._either(of, test, before, code[k + 1 :], names)
                    return
                case ast.If(test=test, body=[ast.Raise()], orelse=[]):
                    pass
                case ast.If(test=test, body=then, orelse=other):
                    yield from self._either(of, test, then, other, names)
                case ast.For(target=target, iter=over, body=inner):
                    yield f"for {ast.unparse(target)} in {self.text(of, over, names)}:"
                    yield from (f"  {line}" for line in self.body(of, inner, names))
                case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)):
                    pairs = [ast.Assign([a], b) for a, b in zip(targets, values, strict=True)]
                    yield from self._assigned(of, pairs, names)
                case ast.Assign():
                    yield from self._assigned(of, [statement], names)
                case _:
                    yield self.text(of, statement, names)

    def _either(
        self, of: Function, test: ast.expr, then: Sequence[ast.stmt], other: Sequence[ast.stmt], names: Names
    ) -> Iterator[str]:
        first, second = (list(self.body(of, code, names)) for code in (then, other))
        for word, lines in ((f"if {self.text(of, test, names)}:", first), ("else:", second)):
            if lines and not first:
                word = f"unless {self.text(of, test, names)}:"
            yield from [word, *(f"  {line}" for line in lines)] if lines else []

    def _assigned(self, of: Function, pairs: Sequence[ast.Assign], names: dict[str, ast.expr]) -> Iterator[str]:
        """Give local names to paths; others are lines."""
        for pair in pairs:
            match pair:
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Attribute() as value) if _is_path(value):
                    names[name] = self._replaced(of, value, names)
                case _:
                    for target in pair.targets:
                        names.pop(ast.unparse(target), None)
                    targets = " = ".join(self.text(of, target, names) for target in pair.targets)
                    yield f"{targets} = {self.text(of, pair.value, names)}"

    def _inlined(self, of: Function, call: ast.Call, names: Names) -> Iterator[str]:
        """Yield what another method yields, in the place of its call."""
        arguments = call.args
        match call.func:
            case ast.Attribute(value=ast.Call(func=ast.Name(id="super")), attr=name):
                function = self.source.method(name, of.owner)
            case ast.Attribute(value=ast.Name(id="self"), attr=name):
                function = self.source.method(name)
            case ast.Attribute(value=ast.Name(id=base), attr=name) if isinstance(of.constants.get(base), type):
                function, arguments = in_class(of.constants[base], name), arguments[1:]
            case ast.Name(id=name) if _is_own(of.constants.get(name)):
                function = plain_function(name, of.constants[name])
            case ast.Attribute(value=ast.Call(), attr="equations" | "events"):
                return  # of the language's own class
            case _:
                yield self.text(of, call, names)
                return
        if function is not None:
            formal = [argument.arg for argument in function.code.args.args if argument.arg != "self"]
            given = dict(zip(formal, arguments, strict=False)) | {k.arg or "": k.value for k in call.keywords}
            meant = {name: self._replaced(of, value, names) for name, value in given.items()}
            yield from self.body(function, function.code.body, meant)

    def text(self, of: Function, code: ast.AST, names: Names) -> str:
        """Return code as in formulas: without `self`, local names by what they mean."""
        return ast.unparse(self._replaced(of, code, names)).replace("yield from ", "").replace("yield ", "")

    def _replaced(self, of: Function, code: Any, names: Names) -> Any:
        return ast.fix_missing_locations(_Replace(self, of, names).visit(copy.deepcopy(code)))


class _Replace(ast.NodeTransformer):
    """Drops `self`, replaces local names, and notes the methods and functions that occur."""

    def __init__(self, reader: _Reader, of: Function, names: Names) -> None:
        self._reader, self._of, self._names = reader, of, names

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        match self.generic_visit(node):
            case ast.UnaryOp(op=ast.USub(), operand=ast.UnaryOp(op=ast.USub(), operand=twice)):
                return twice
            case found:
                return found

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in self._names:
            return copy.deepcopy(self._names[node.id])
        meant = self._of.constants.get(node.id)
        if _is_own(meant):
            self._reader.found.setdefault(node.id, plain_function(node.id, meant))
        elif isinstance(meant, float):
            self._reader.constants[node.id] = f"{meant:g}"
        elif node.id.startswith("_") and isinstance(meant, int | str | tuple):
            self._reader.constants[node.id] = repr(meant)
        return ast.Name(shown(node.id)) if node.id in self._of.constants else node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        match node:
            case ast.Call(func=ast.Name(id="getattr"), args=[ast.Name(id="self"), ast.Constant(value=str(name))]):
                return ast.Name(name)
            case _:
                return self.generic_visit(node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        match node.value:
            case ast.Name(id="self"):
                if (method := self._reader.source.method(node.attr)) is not None:
                    self._reader.found.setdefault(node.attr, method)
                return ast.Name(shown(node.attr))
            case ast.Call(func=ast.Name(id="super")):
                method = self._reader.source.method(node.attr, self._of.owner)
                name = f"{method.owner.__name__}.{node.attr}" if method and method.owner else node.attr
                if method is not None:
                    self._reader.found.setdefault(name, method)
                return ast.Name(shown(name))
            case _:
                return self.generic_visit(node)  # type: ignore[return-value]


def _is_path(value: ast.expr) -> bool:
    while isinstance(value, ast.Attribute):
        value = value.value
    return isinstance(value, ast.Name)


def _is_own(value: Any) -> TypeGuard[FunctionType]:
    """Return whether this is a function of a library, not of the language."""
    return isinstance(value, FunctionType) and not value.__module__.startswith(_LANGUAGE)
