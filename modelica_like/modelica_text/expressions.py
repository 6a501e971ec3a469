"""Expressions of Modelica text."""

from __future__ import annotations

from modelica_like.modelica_text.tokens import Tokens
from modelica_like.modelica_text.tree import Expr

_RELATIONS = {"<", "<=", ">", ">=", "==", "<>"}
_ELEMENTWISE = {".+": "+", ".-": "-", ".*": "*", "./": "/", ".^": "^"}
_DEEPEST = 100


class Expressions(Tokens):
    """Reads expressions, by one method for every level of precedence."""

    def expression(self) -> Expr:
        """Read an expression."""
        line = self.line
        self.depth += 1
        if self.depth > _DEEPEST:
            self.refuse("An expression is nested too deeply.", line)
        if not self.take("if"):
            made = self.simple()
        else:
            parts = [self.expression()]
            self.need("then")
            parts.append(self.expression())
            while self.take("elseif"):
                parts.append(self.expression())
                self.need("then")
                parts.append(self.expression())
            self.need("else")
            made = Expr("if", (*parts, self.expression()), line)
        self.depth -= 1
        return made

    def simple(self) -> Expr:
        """Read an expression that is not an `if`, possibly a range."""
        line = self.line
        first = self._or()
        if not self.take(":"):
            return first
        second = self._or()
        third = self._or() if self.take(":") else None
        return Expr("range", (first, second) if third is None else (first, second, third), line)

    def _or(self) -> Expr:
        made = self._and()
        while self.take("or"):
            made = Expr("or", (made, self._and()), made.line)
        return made

    def _and(self) -> Expr:
        made = self._not()
        while self.take("and"):
            made = Expr("and", (made, self._not()), made.line)
        return made

    def _not(self) -> Expr:
        line = self.line
        return Expr("not", (self._relation(),), line) if self.take("not") else self._relation()

    def _relation(self) -> Expr:
        made = self._sum()
        if self.kind in _RELATIONS:
            return Expr(self.take(self.kind), (made, self._sum()), made.line)
        return made

    def _sum(self) -> Expr:
        line, sign = self.line, self.take("+", "-", ".+", ".-")
        made = self._product()
        if sign in ("-", ".-"):
            made = Expr("neg", (made,), line)
        while sign := self.take("+", "-", ".+", ".-"):
            made = Expr(_ELEMENTWISE.get(sign, sign), (made, self._product()), line)
        return made

    def _product(self) -> Expr:
        made = self._power()
        while sign := self.take("*", "/", ".*", "./"):
            made = Expr(_ELEMENTWISE.get(sign, sign), (made, self._power()), made.line)
        return made

    def _power(self) -> Expr:
        made = self._primary()
        if self.take("^", ".^"):
            return Expr("^", (made, self._primary()), made.line)
        return made

    def _primary(self) -> Expr:
        kind, text, line = self.tokens[self.at]
        if kind == "number":
            self.at += 1
            return Expr("number", (float(text),), line)
        if kind == "string":
            self.at += 1
            return Expr("string", (text[1:-1],), line)
        if kind == "name" and text in ("true", "false"):
            self.at += 1
            return Expr("boolean", (text == "true",), line)
        if kind in ("name", "initial", "."):
            return self._named(line)
        if self.take("("):
            made = self.expression()
            if self.kind == ",":
                self.refuse("Functions with several results are not supported.", line)
            self.need(")")
            return made
        if self.take("{"):
            return self._array(line)
        if self.take("["):
            return self._matrix(line)
        raise self.error(
            f"Expected an expression before '{text}'." if text else "The file ends in an expression.", line
        )

    def _array(self, line: int) -> Expr:
        items = [] if self.kind == "}" else [self.expression()]
        if items and self.take("for"):
            made = Expr("for", (items[0], self.iterators()), line)
        else:
            while self.take(","):
                items.append(self.expression())
            made = Expr("array", tuple(items), line)
        self.need("}")
        return made

    def _matrix(self, line: int) -> Expr:
        rows: list[Expr] = []
        while True:
            items = [self.expression()]
            while self.take(","):
                items.append(self.expression())
            rows.append(Expr("array", tuple(items), line))
            if not self.take(";"):
                self.need("]")
                return Expr("array", tuple(rows), line)

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
        made = []
        while not self.take("]"):
            line = self.line
            made.append(Expr("all", (), line) if self.take(":") else self.expression())
            if self.kind != "]":
                self.need(",")
        return tuple(made)

    def iterators(self) -> tuple[tuple[str, Expr | None], ...]:
        """Read the iterators of a loop with their ranges."""
        made = []
        while True:
            name = self.need("name")
            made.append((name, self.expression() if self.take("in") else None))
            if not self.take(","):
                return tuple(made)
