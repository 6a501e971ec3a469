"""Expressions of Modelica text."""

from __future__ import annotations

import math

from modelica_like.netlist.modelica.tokens import Tokens
from modelica_like.netlist.modelica.tree import Expr, chain

_OR, _AND, _NOT, _RELATION, _SUM, _PRODUCT, _POWER = range(1, 8)
_LEVELS = {
    "or": _OR, "and": _AND, **dict.fromkeys(("<", "<=", ">", ">=", "==", "<>"), _RELATION),
    **dict.fromkeys(("+", "-", ".+", ".-"), _SUM), **dict.fromkeys(("*", "/", ".*", "./"), _PRODUCT),
    **dict.fromkeys(("^", ".^"), _POWER),
}  # fmt: skip
_SINGLE = (_RELATION, _POWER)
"""Levels whose operators do not follow each other."""


class Expressions(Tokens):
    """Reads expressions, by one method for every level of precedence."""

    def expression(self) -> Expr:
        """Read an expression."""
        line = self.line
        self.deeper()
        if not self.take("if"):
            result = self.simple()
        else:
            parts = [self.expression()]
            self.need("then")
            parts.append(self.expression())
            while self.take("elseif"):
                parts.append(self.expression())
                self.need("then")
                parts.append(self.expression())
            self.need("else")
            result = Expr("if", (*parts, self.expression()), line)
        self.depth -= 1
        return result

    def simple(self) -> Expr:
        """Read an expression that is not an `if`, possibly a range."""
        line = self.line
        first = self._operation(_OR)
        if not self.take(":"):
            return first
        second = self._operation(_OR)
        third = self._operation(_OR) if self.take(":") else None
        return Expr("range", (first, second) if third is None else (first, second, third), line)

    def _operation(self, level: int) -> Expr:
        """Read operators of this level and above, by precedence climbing."""
        line = self.line
        if level <= _NOT and self.take("not"):
            left = Expr("not", (self._operation(_RELATION),), line)
        elif level <= _SUM and (sign := self.take("+", "-", ".+", ".-")):
            left = self._operation(_PRODUCT)
            left = Expr("neg", (left,), line) if sign in ("-", ".-") else left
        else:
            left = self._primary()
        below = _POWER + 1
        while level <= (precedence := _LEVELS.get(self.kind, 0)) < below:
            signs, terms = list[str](), [left]
            while _LEVELS.get(self.kind) == precedence and not (precedence in _SINGLE and signs):
                signs.append(self.kind)
                self.at += 1
                terms.append(self._operation(precedence + 1))
            left, below = chain(signs, terms), precedence
        return left

    def _primary(self) -> Expr:
        kind, text, line = self.tokens[self.at]
        if kind == "number":
            self.at += 1
            if not math.isfinite(float(text)):
                self.refuse(f"{text} is too large for a number.", line)
            return Expr("number", (float(text),), line)
        if kind == "string":
            self.at += 1
            return Expr("string", (text[1:-1],), line)
        if kind == "name" and text in ("true", "false"):
            self.at += 1
            return Expr("boolean", (text == "true",), line)
        if kind in ("name", "initial", "."):
            return self._named(line)
        if kind == "end" and self.brackets:
            self.at += 1
            return Expr("name", (("end", ()),), line)
        if self.take("("):
            items = [self._result()]
            while self.take(","):
                items.append(self._result())
            self.need(")")
            return items[0] if len(items) == 1 and items[0].kind != "all" else Expr("tuple", tuple(items), line)
        if self.take("function"):  # partial application, an argument that is a function
            return Expr("function", (self._named(line),), line)
        if self.take("{"):
            return self._array(line)
        if self.take("["):
            return self._matrix(line)
        raise self.error(
            f"Expected an expression before '{text}'." if text else "The file ends in an expression.", line
        )

    def _result(self) -> Expr:
        """Read one of the results of a function; one that is left out is `all`."""
        return Expr("all", (), self.line) if self.kind in (",", ")") else self.expression()

    def _array(self, line: int) -> Expr:
        items = [] if self.kind == "}" else [self.expression()]
        if items and self.take("for"):
            array = Expr("for", (items[0], self.iterators()), line)
        else:
            while self.take(","):
                items.append(self.expression())
            array = Expr("array", tuple(items), line)
        self.need("}")
        return array

    def _matrix(self, line: int) -> Expr:
        rows: list[Expr] = []
        while True:
            items = [self.expression()]
            while self.take(","):
                items.append(self.expression())
            rows.append(Expr("array", tuple(items), line))
            if not self.take(";"):
                self.need("]")
                return Expr("matrix", tuple(rows), line)

    def _named(self, line: int) -> Expr:
        if self.take("initial"):
            parts: list[tuple[str, tuple[Expr, ...]]] = [("initial", ())]
        else:
            self.take(".")
            parts = [(self.need("name"), self.subscripts() if self.kind == "[" else ())]
        while self.take("."):
            parts.append((self.need("name"), self.subscripts() if self.kind == "[" else ()))
        if self.kind != "(":
            return Expr("name", tuple(parts), line)
        given, named = self._given()
        return Expr("call", (".".join(name for name, _ in parts), given, named), line)

    def _given(self) -> tuple[tuple[Expr, ...], tuple[tuple[str, Expr], ...]]:
        self.need("(")
        given: list[Expr] = []
        named: list[tuple[str, Expr]] = []
        while not self.take(")"):
            if self.kind == "name" and self.tokens[self.at + 1][0] == "=":
                name = self.need("name")
                self.need("=")
                named.append((name, self.expression()))
            else:
                given.append(self.expression())
                if self.take("for"):
                    given[-1] = Expr("for", (given[-1], self.iterators()), given[-1].line)
            if self.kind != ")":
                self.need(",")
        return tuple(given), tuple(named)

    def subscripts(self) -> tuple[Expr, ...]:
        """Read indices or dimensions in brackets."""
        self.need("[")
        self.brackets += 1
        indices = []
        while not self.take("]"):
            line = self.line
            indices.append(Expr("all", (), line) if self.take(":") else self.expression())
            if self.kind != "]":
                self.need(",")
        self.brackets -= 1
        return tuple(indices)

    def iterators(self) -> tuple[tuple[str, Expr | None], ...]:
        """Read the iterators of a loop with their ranges."""
        ranges = []
        while True:
            name = self.need("name")
            ranges.append((name, self.expression() if self.take("in") else None))
            if not self.take(","):
                return tuple(ranges)
