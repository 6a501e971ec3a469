"""Small wrong changes of a source text: signs, factors, comparisons, dropped terms, swapped names.

A change replaces a piece of text, so that line numbers, comments and messages stay as they are. Messages, annotations
and what prints are left alone.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_OPERATORS: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*"),
    ast.MatMult: ("@", "*"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"),
}  # fmt: skip
_COMPARISONS: dict[type[ast.cmpop], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", ("<=", ">")), ast.LtE: ("<=", ("<", ">=")), ast.Gt: (">", (">=", "<")),
    ast.GtE: (">=", (">", "<=")), ast.Eq: ("==", ("!=",)), ast.NotEq: ("!=", ("==",)),
    ast.In: ("in", ("not in",)), ast.NotIn: ("not in", ("in",)), ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
}  # fmt: skip
_CALLS = {
    "min": "max", "max": "min", "fmin": "fmax", "fmax": "fmin", "any": "all", "all": "any", "ceil": "floor",
    "floor": "ceil", "logic_or": "logic_and", "logic_and": "logic_or", "setdefault": "__setitem__",
    "minimum": "maximum", "maximum": "minimum", "argmax": "argmin", "argmin": "argmax", "sin": "cos", "cos": "sin",
}  # fmt: skip
_SYMMETRIC = (
    "min", "max", "fmin", "fmax", "minimum", "maximum", "all_of", "any_of", "logic_and", "logic_or", "hypot",
    "same_dimension", "allclose",
)  # fmt: skip
"""Functions whose arguments have no order."""
_TOLERANCE = 1e-6
"""What is smaller is one, or a limit beside zero; how small it is no test can tell."""
_PRINTS = ("__str__", "__repr__", "_repr_html_")


@dataclass(frozen=True)
class Change:
    """One wrong change of a file.

    Attributes:
        file: path from the root of the repository.
        line: where it is.
        place: the function it is in.
        start, end: the piece of text, in characters.
        before, after: the text as it is, and what takes its place.
    """

    file: str
    line: int
    place: str
    start: int
    end: int
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.place}: {self.before} → {self.after}"

    def applied(self, text: str) -> str:
        """Return the source with the change, or as it is if that would be no Python."""
        changed = text[: self.start] + self.after + text[self.end :]
        try:
            ast.parse(changed)
        except SyntaxError:
            return text
        return changed


def changes(root: Path, file: str) -> list[Change]:
    """Return all changes of a file, in the order of its text."""
    text = (root / file).read_text(encoding="utf-8")
    found = {(one.start, one.end, one.after): one for one in _Finder(file, text).module()}
    return sorted(found.values(), key=lambda one: (one.start, one.end, one.after))


class _Finder:
    def __init__(self, file: str, text: str) -> None:
        self.file, self.text = file, text
        self.starts = [0]
        for line in text.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))
        self.lines = text.splitlines()

    def _at(self, line: int, column: int) -> int:
        """Position in characters; `ast` counts columns in bytes."""
        prefix = self.lines[line - 1].encode()[:column].decode()
        return self.starts[line - 1] + len(prefix)

    def _span(self, node: ast.expr | ast.stmt | ast.keyword) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self._at(node.lineno, node.col_offset), self._at(node.end_lineno, node.end_col_offset)

    def _source(self, node: ast.expr | ast.stmt) -> str:
        start, end = self._span(node)
        return self.text[start:end]

    def module(self) -> Iterator[Change]:
        yield from self._walk(ast.parse(self.text), "module")

    def _walk(self, node: ast.AST, place: str) -> Iterator[Change]:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            if node.name in _PRINTS:
                return
            place = node.name if place == "module" else f"{place}.{node.name}"
        elif _is_left_alone(node):
            return
        for start, end, after, at in self._of(node):
            before = self.text[start:end]
            yield Change(self.file, at, place, start, end, before, after)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "bases", "type_params"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from self._walk(child, place)

    def _of(self, node: ast.AST) -> Iterator[tuple[int, int, str, int]]:
        """Yield (start, end, new text, line) of the changes of one node."""
        match node:
            case ast.BinOp():
                yield from self._operation(node)
            case ast.Compare(ops=[op], comparators=[right]):
                old, new = _COMPARISONS[type(op)]
                for one in new:
                    yield from self._between(node.left, right, old, one)
            case ast.BoolOp(op=op, values=[*values]):
                old, new = ("and", "or") if isinstance(op, ast.And) else ("or", "and")
                yield from self._between(values[0], values[1], old, new)
                for one in values if len(values) == 2 else ():
                    yield *self._span(node), self._source(one), node.lineno
            case ast.UnaryOp(op=ast.USub() | ast.Not()):
                yield *self._span(node), self._source(node.operand), node.lineno
            case ast.Constant(value=value) if isinstance(value, bool | int | float) and not 0 < abs(value) < _TOLERANCE:
                yield *self._span(node), _other(value), node.lineno
            case ast.Call():
                yield from self._call(node)
            case ast.Subscript(slice=ast.Slice() as cut):
                for bound in filter(None, (cut.lower, cut.upper)):
                    yield *self._span(bound), "", bound.lineno
            case ast.Expr(value=ast.Call()):
                yield *self._span(node), "pass", node.lineno
            case ast.Continue():
                yield *self._span(node), "break", node.lineno
            case ast.If(test=ast.Name() | ast.Attribute() | ast.Call() as test):
                yield *self._span(test), f"not {self._source(test)}", node.lineno
            case _:
                pass

    def _operation(self, node: ast.BinOp) -> Iterator[tuple[int, int, str, int]]:
        if type(node.op) not in _OPERATORS or any(isinstance(one, ast.Constant) and isinstance(one.value, str)
                                                  for one in (node.left, node.right)):  # fmt: skip
            return
        yield from self._between(node.left, node.right, *_OPERATORS[type(node.op)])
        if isinstance(node.op, ast.Add | ast.Sub):
            for one in (node.left, node.right):
                yield *self._span(node), self._source(one), node.lineno

    def _between(self, left: ast.expr, right: ast.expr, old: str, new: str) -> Iterator[tuple[int, int, str, int]]:
        start, end = self._span(left)[1], self._span(right)[0]
        place = self.text.find(old, start, end)
        if place >= 0:
            yield place, place + len(old), new, self.text.count("\n", 0, place) + 1

    def _call(self, node: ast.Call) -> Iterator[tuple[int, int, str, int]]:
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if name in ("param", "structural", "state", "variable", "connect"):  # a connection has no direction
            return
        _, end = self._span(node.func)
        if name in _CALLS:
            yield end - len(name), end, _CALLS[name], node.lineno
        if name in ("abs", "fabs", "sqrt", "sign", "not_"):
            yield *self._span(node), f"({self._source(node.args[0])})", node.lineno
        plain = [one for one in node.args if isinstance(one, ast.Name | ast.Attribute)]
        if len(node.args) >= 2 and plain[:2] == node.args[:2] and name not in _SYMMETRIC:
            (first, _), (_, last) = self._span(node.args[0]), self._span(node.args[1])
            yield first, last, f"{self._source(node.args[1])}, {self._source(node.args[0])}", node.lineno


def _is_left_alone(node: ast.AST) -> bool:
    """Messages, imports, assertions (`strict` of `zip` is one), and the seeds of random numbers."""
    match node:
        case ast.Raise() | ast.JoinedStr() | ast.Import() | ast.ImportFrom() | ast.Assert():
            return True
        case ast.keyword(arg="strict") | ast.Call(func=ast.Attribute(attr="default_rng")):
            return True
        case _:
            return False


def _other(value: float) -> str:
    if isinstance(value, bool):
        return str(not value)
    if isinstance(value, int):
        return str(value + 1)
    return repr(2 * value) if value else "1.0"
