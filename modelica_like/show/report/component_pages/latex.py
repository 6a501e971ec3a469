"""Expressions of component classes as LaTeX, from their source text."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from types import FunctionType
from typing import Any, NamedTuple

from modelica_like.show.report.component_pages import latex_names as names

CASES, OR, AND, RELATION, SUM, PRODUCT, POWER, ATOM = range(8)
"""Precedence of an expression."""
_FUNCTIONS = {
    "sin": r"\sin", "cos": r"\cos", "tan": r"\tan", "exp": r"\exp", "log": r"\ln", "tanh": r"\tanh",
    "sign": names.text("sgn"), "minimum": r"\min", "maximum": r"\max", "atan2": names.text("atan2"),
    "floor": names.text("floor"),
}  # fmt: skip
_JOINED = {"all_of": (AND, r" \land "), "any_of": (OR, r" \lor ")}
_RELATIONS: dict[type[ast.cmpop], str] = {
    ast.Lt: r"\lt", ast.LtE: r"\le", ast.Gt: r"\gt", ast.GtE: r"\ge", ast.Eq: "=", ast.NotEq: r"\ne", ast.Is: "=",
    ast.IsNot: r"\ne", ast.In: r"\in", ast.NotIn: r"\notin",
}  # fmt: skip
_OPERATORS: dict[type[ast.operator], tuple[int, int, str]] = {
    ast.Add: (SUM, SUM, " + "), ast.Sub: (SUM, PRODUCT, " - "), ast.Mult: (PRODUCT, PRODUCT, r" \cdot "),
    ast.Mod: (PRODUCT, POWER, r" \bmod "),
}  # fmt: skip
"""Precedence of an operator, required precedence of its right side, and its sign."""
_PAIR = 2


class Unwritable(Exception):
    """An expression without a mathematical notation; the page then shows the source text."""


class Written(NamedTuple):
    """LaTeX with its precedence."""

    latex: str
    binds: int = ATOM

    def inside(self, binds: int) -> str:
        """Return it, in parentheses if its precedence is lower than that of its surroundings."""
        return self.latex if self.binds >= binds else rf"\left({self.latex}\right)"


class Path(NamedTuple):
    """A field, connector or part of the component by its path, or another name."""

    path: str
    own: bool = True


class Column(NamedTuple):
    """A column of a table; `number` is empty if there is only one besides the abscissae."""

    table: str
    number: str


Meaning = Written | Path | Column | ast.Dict
"""Meaning of a local name."""


def cases(rows: Sequence[tuple[str, str]]) -> Written:
    """Return a case distinction of values and conditions."""
    lines = r" \cr ".join(f"{value} & {condition}" for value, condition in rows)
    return Written(rf"\begin{{cases}} {lines} \end{{cases}}", CASES)


def otherwise(condition: str, then: Written, other: Written) -> Written:
    """Return a choice of two values; the second may continue the case distinction."""
    begin, end = r"\begin{cases} ", r" \end{cases}"
    rest = other.latex.removeprefix(begin).removesuffix(end) if other.binds == CASES else ""
    if rest and begin not in rest and r"\text{otherwise}" in rest:
        first = rf"{then.latex} & \text{{if }} {condition} \cr "
        return Written(f"{begin}{first}{rest}{end}", CASES)
    return cases([(then.latex, rf"\text{{if }} {condition}"), (other.latex, r"\text{otherwise}")])


@dataclass(frozen=True)
class Writer:
    """Writes expressions of a function, with the meanings of its `local` names and the `constants` of its module."""

    constants: Mapping[str, Any]
    local: dict[str, Meaning]

    def member(self, path: str, dots: int) -> str:
        """Return the symbol of a field, method or property of the component."""
        return names.name(path.lstrip("_"), dots)

    def function(self, name: str) -> bool:
        """Return whether a name is a function of the module."""
        return isinstance(self.constants.get(name), FunctionType)

    def which_mode(self, path: str) -> str:
        """Return the prefix of a mode's name if there are several modes."""
        return f"{path}: "

    def inherited(self, name: str) -> str:
        """Return the name of a method reached by `super()`."""
        raise Unwritable

    def under(self, test: ast.expr, *, holds: bool) -> AbstractContextManager[None]:
        """Make everything written meanwhile depend on a condition."""
        return nullcontext()

    def write(self, node: ast.expr) -> Written:
        """Return the LaTeX of an expression with its precedence; Unwritable if there is no notation for it."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise Unwritable
        return method(node)

    def latex(self, node: ast.expr) -> str:
        """Return the LaTeX of an expression."""
        return self.write(node).latex

    def path(self, node: ast.expr) -> Path | None:
        """Return the path of a chain of names."""
        if isinstance(node, ast.Name):
            value = self.local.get(node.id)
            return Path("") if node.id == "self" else value if isinstance(value, Path) else None
        if not isinstance(node, ast.Attribute) or (owner := self.path(node.value)) is None:
            return None
        return Path(f"{owner.path}.{node.attr}".removeprefix("."), owner.own)

    # -- names and numbers ---------------------------------------------------------------------------------------------

    def _constant(self, node: ast.Constant) -> Written:
        if isinstance(node.value, bool) or not isinstance(node.value, int | float):
            return Written(names.text(str(node.value).lower()))
        return number(node.value)

    def _name(self, node: ast.Name) -> Written:
        path = self.local.get(node.id)
        if isinstance(path, Written):
            return path
        if isinstance(path, Path):
            return self._at(path)
        value = self.constants.get(node.id)
        return number(value) if isinstance(value, int | float) else Written(names.name(node.id.strip("_")))

    def _attribute(self, node: ast.Attribute) -> Written:
        path = self.path(node)
        if path is not None:
            return self._at(path)
        return Written(rf"{self.write(node.value).inside(ATOM)}.{names.name(node.attr)}")

    def _at(self, path: Path, dots: int = 0) -> Written:
        if path == Path("time"):
            return Written("t")
        owner, _, last = path.path.rpartition(".")
        if last == "used":
            return Written(names.text(f"{owner} is connected"), RELATION)
        return Written(self.member(path.path, dots) if path.own else names.name(path.path, dots))

    def _subscript(self, node: ast.Subscript) -> Written:
        indices = [self.latex(node.slice)]
        while isinstance(node.value, ast.Subscript):
            node = node.value
            indices.insert(0, self.latex(node.slice))
        return Written(rf"{self.write(node.value).inside(ATOM)}_{{{', '.join(indices)}}}")

    def _tuple(self, node: ast.Tuple | ast.List) -> Written:
        return Written(rf"\left({', '.join(map(self.latex, node.elts))}\right)")

    _list = _tuple

    def _starred(self, node: ast.Starred) -> Written:
        return self.write(node.value)

    def _lambda(self, node: ast.Lambda) -> Written:
        formal = [argument.arg for argument in node.args.args]
        inner = replace(self, local={**self.local, **{argument: Path(argument, own=False) for argument in formal}})
        return Written(rf"{', '.join(map(names.name, formal))} \mapsto {inner.latex(node.body)}", CASES)

    # -- operators -----------------------------------------------------------------------------------------------------

    def _binop(self, node: ast.BinOp) -> Written:
        if isinstance(node.op, ast.Mult | ast.Div) and isinstance(node.left, ast.UnaryOp):  # the sign comes first
            return self._unaryop(ast.UnaryOp(node.left.op, ast.BinOp(node.left.operand, node.op, node.right)))
        left, right = self.write(node.left), self.write(node.right)
        if isinstance(node.op, ast.Div):
            return Written(rf"\frac{{{left.latex}}}{{{right.latex}}}", PRODUCT)
        if isinstance(node.op, ast.Pow):
            return Written(rf"{left.inside(ATOM)}^{{{right.latex}}}", POWER)
        if type(node.op) not in _OPERATORS:
            raise Unwritable
        binds, needed, sign = _OPERATORS[type(node.op)]
        # A sign of the second part of a sum or product would follow the operator.
        shown = rf"\left({right.latex}\right)" if right.latex.startswith("-") else right.inside(needed)
        return Written(f"{left.inside(binds)}{sign}{shown}", binds)

    def _unaryop(self, node: ast.UnaryOp) -> Written:
        inner = self.write(node.operand)
        if isinstance(node.op, ast.Not):
            return Written(rf"\lnot {inner.inside(ATOM)}", AND)
        shown = rf"\left({inner.latex}\right)" if inner.latex.startswith("-") else inner.inside(PRODUCT)
        return Written(f"-{shown}", SUM)

    def _compare(self, node: ast.Compare) -> Written:
        sides = [self.write(side).inside(SUM) for side in (node.left, *node.comparators)]
        signs = [f" {_RELATIONS[type(operator)]} " for operator in node.ops]
        return Written(sides[0] + "".join(map("".join, zip(signs, sides[1:], strict=True))), RELATION)

    def _boolop(self, node: ast.BoolOp) -> Written:
        return self._all(*_JOINED["all_of" if isinstance(node.op, ast.And) else "any_of"], node.values)

    def _all(self, binds: int, sign: str, conditions: Sequence[ast.expr]) -> Written:
        return Written(sign.join(self.write(condition).inside(binds + 1) for condition in conditions), binds)

    def _ifexp(self, node: ast.IfExp) -> Written:
        with self.under(node.test, holds=True):
            then = self.write(node.body)
        with self.under(node.test, holds=False):
            return otherwise(self.latex(node.test), then, self.write(node.orelse))

    # -- calls ---------------------------------------------------------------------------------------------------------

    def _call(self, node: ast.Call) -> Written:
        if isinstance(node.func, ast.Attribute):
            return self._of_component(node, node.func)
        if not isinstance(node.func, ast.Name):
            raise Unwritable
        function, arguments = node.func.id, node.args
        written = getattr(self, f"_{function}_of", None)
        if written is not None:
            return written(*arguments)
        if function in _JOINED:
            return self._all(*_JOINED[function], arguments)
        if function not in _FUNCTIONS and not self.function(function):
            raise Unwritable
        return self._application(_FUNCTIONS.get(function) or names.name(function.strip("_")), node)

    def _application(self, called: str, node: ast.Call) -> Written:
        given = [*node.args, *(keyword.value for keyword in node.keywords if keyword.arg != "strict")]
        return Written(rf"{called}\left({', '.join(map(self.latex, given))}\right)" if given else called)

    def _of_component(self, node: ast.Call, called: ast.Attribute) -> Written:
        owner, name = called.value, called.attr
        if isinstance(owner, ast.Call) and isinstance(owner.func, ast.Name) and owner.func.id == "super":
            return self._application(names.name(self.inherited(name)), node)
        path = self.path(owner)
        if path is None:
            raise Unwritable
        if name == "is_":
            chosen = " or ".join(str(argument.value) for argument in node.args if isinstance(argument, ast.Constant))
            return Written(rf"{names.text(path.path)} = {names.text(chosen)}", RELATION)
        if name == "choose":
            mode = self.which_mode(path.path)
            rows = [(self.latex(k.value), "" if k.arg == "otherwise" else mode, k.arg) for k in node.keywords]
            return cases([(value, names.text(f"{which}{name}")) for value, which, name in rows])
        if name == "given":
            (parameter,) = (argument.value for argument in node.args if isinstance(argument, ast.Constant))
            return Written(names.text(f"{parameter} is given"), RELATION)
        full = f"{path.path}.{name}".removeprefix(".")
        return self._application(self.member(full, 0), node)

    def _der_of(self, what: ast.expr) -> Written:
        dots, inner = 1, what
        while isinstance(inner, ast.Call) and isinstance(inner.func, ast.Name) and inner.func.id == "der":
            dots, inner = dots + 1, inner.args[0]
        path = self.path(inner)
        if path is not None:
            return self._at(path, dots)
        power = f"^{dots}" if dots > 1 else ""
        return Written(rf"\frac{{d{power}}}{{dt{power}}} {self.write(inner).inside(ATOM)}", PRODUCT)

    def _absolute_of(self, what: ast.expr) -> Written:
        return Written(rf"\left\lvert {self.latex(what)} \right\rvert")

    def _sqrt_of(self, what: ast.expr) -> Written:
        return Written(rf"\sqrt{{{self.latex(what)}}}")

    def _float_of(self, what: ast.expr) -> Written:
        return self.write(what)

    def _negate_of(self, what: ast.expr) -> Written:
        return Written(rf"\lnot {self.write(what).inside(ATOM)}", AND)

    def _prescribed_of(self, motion: ast.expr) -> Written:
        return Written(rf"{names.text('prescribed')}\left({self.latex(motion)}\right)")

    def _where_of(self, condition: ast.expr, then: ast.expr, other: ast.expr) -> Written:
        return otherwise(self.latex(condition), self.write(then), self.write(other))

    def _interpolate_of(self, x: ast.expr, xs: ast.expr, ys: ast.expr, *how: ast.expr) -> Written:
        values = self._column_of(ys)
        if self._column_of(xs) is None or values is None:
            raise Unwritable
        index = f"_{{{values.number}}}" if values.number else ""
        return Written(rf"{names.name(values.table)}{index}\left({self.latex(x)}\right)")

    def _column_of(self, node: ast.expr) -> Column | None:
        """Return the column of a table for a name, or for `[row[0] for row in self.table]`."""
        column = self.local.get(node.id) if isinstance(node, ast.Name) else None
        if isinstance(node, ast.ListComp) and isinstance(node.elt, ast.Subscript):
            table = self.path(node.generators[0].iter)
            column = Column(table.path, self.latex(node.elt.slice)) if table is not None else None
        return column if isinstance(column, Column) else None


def number(value: float) -> Written:
    """Return a number."""
    latex = names.number(value)
    return Written(latex, SUM if value < 0 else ATOM if latex.replace(".", "").isdigit() else PRODUCT)
