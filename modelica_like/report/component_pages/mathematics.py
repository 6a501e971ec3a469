"""Expressions as mathematics (LaTeX)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isclose
from typing import Any, NamedTuple

import casadi as ca

from modelica_like.language.expr import Symbol, symbols_in
from modelica_like.report.component_pages import latex_names as names

CASES, OR, AND, RELATION, SUM, PRODUCT, POWER, ATOM = range(8)
"""How tightly an expression binds."""

_FUNCTIONS = {
    ca.OP_SIN: r"\sin", ca.OP_COS: r"\cos", ca.OP_TAN: r"\tan", ca.OP_EXP: r"\exp", ca.OP_LOG: r"\ln",
    ca.OP_TANH: r"\tanh", ca.OP_SIGN: names.text("sgn"), ca.OP_FMIN: r"\min", ca.OP_FMAX: r"\max",
    ca.OP_ATAN2: names.text("atan2"), ca.OP_FLOOR: names.text("floor"),
}  # fmt: skip
_RELATIONS = {ca.OP_LT: r"\lt", ca.OP_LE: r"\le", ca.OP_EQ: "=", ca.OP_NE: r"\ne"}
_TURNED = {ca.OP_LT: r"\gt", ca.OP_LE: r"\ge", ca.OP_EQ: "=", ca.OP_NE: r"\ne"}
_NEGATED = {ca.OP_LT: r"\ge", ca.OP_LE: r"\gt", ca.OP_EQ: r"\ne", ca.OP_NE: "="}
_NEGATED_TURNED = {ca.OP_LT: r"\le", ca.OP_LE: r"\lt", ca.OP_EQ: r"\ne", ca.OP_NE: "="}
CONDITIONS = (*_RELATIONS, ca.OP_AND, ca.OP_OR, ca.OP_NOT)
"""Operations whose result is true or false."""
_SUMS = (ca.OP_ADD, ca.OP_SUB, ca.OP_NEG)
_PRODUCTS = (ca.OP_MUL, ca.OP_DIV, ca.OP_INV, ca.OP_TWICE, ca.OP_SQ, ca.OP_POW, ca.OP_CONSTPOW)
_WIDE = 200
"""Characters of LaTeX beyond which arguments of a function stand below each other."""
_OTHERWISE = r"\text{otherwise}"


class Written(NamedTuple):
    """LaTeX, and how tightly it binds."""

    latex: str
    binds: int

    def inside(self, binds: int) -> str:
        """Return it in parentheses where it binds less tightly than what stands around."""
        return self.latex if self.binds >= binds else rf"\left({self.latex}\right)"


class Branch(NamedTuple):
    """One line of a case distinction."""

    value: Any
    condition: Any


class Signed(NamedTuple):
    """A term of a sum: an expression, or the branches of a case distinction."""

    sign: int
    what: Any


@dataclass(frozen=True)
class Writer:
    """Writes expressions of one component.

    Attributes:
        symbol: returns the LaTeX of a symbol.
        mode: returns the names of the modes of a symbol, or () if it is none.
        special: returns the LaTeX of an expression that has a notation of its own, or an empty text.
    """

    symbol: Callable[[Symbol], str]
    mode: Callable[[Symbol], tuple[str, ...]]
    special: Callable[[Any, Writer], str]

    def latex(self, expression: Any) -> str:
        """Return the LaTeX of an expression or a number."""
        return self.write(ca.SX(expression)).latex

    def write(self, e: Any) -> Written:
        """Return the LaTeX of an expression, and how tightly it binds."""
        special = self.special(e, self)
        if special:
            return Written(special, ATOM)
        if e.is_symbolic():
            return Written(self.symbol(symbols_in(e)[0]), ATOM)
        if e.is_constant():
            return self._number(float(e))
        operation = e.op()
        if operation in (*_SUMS, ca.OP_IF_ELSE_ZERO):
            return self._sum(e)
        if operation in _PRODUCTS:
            return self._product(e)
        if operation in CONDITIONS:
            return self._condition(e)
        return self._function(e)

    # -- sums and case distinctions ------------------------------------------------------------------------------------

    def _number(self, value: float) -> Written:
        latex = names.number(value)
        return Written(latex, SUM if value < 0 else ATOM if latex.replace(".", "").isdigit() else PRODUCT)

    def _sum(self, e: Any) -> Written:
        terms = self._grouped(self._terms(e, 1))
        parts: list[str] = []
        for sign, what in terms:
            written = self._cases(what) if isinstance(what, list) else self.write(what)
            if not isinstance(what, list) and what.op() in _PRODUCTS and written.latex.startswith("-"):
                sign, written = -sign, Written(written.latex[1:], PRODUCT)
            text = written.inside(PRODUCT) if len(terms) > 1 or sign < 0 else written.latex
            parts.append(("-" if sign < 0 else "+" if parts else "") + text)
        lone = len(terms) == 1 and terms[0].sign > 0
        return Written(" ".join(parts), CASES if lone and isinstance(terms[0].what, list) else SUM)

    def _terms(self, e: Any, sign: int) -> list[Signed]:
        """Take a sum apart; what has a notation of its own stays whole."""
        operation = e.op()
        if operation == ca.OP_NEG:
            return self._terms(e.dep(0), -sign)
        if e.is_constant() and float(e) < 0:
            return [Signed(-sign, -e)]
        if operation in (ca.OP_ADD, ca.OP_SUB) and not self.special(e, self):
            other = -sign if operation == ca.OP_SUB else sign
            return self._terms(e.dep(0), sign) + self._terms(e.dep(1), other)
        return [Signed(sign, e)]

    def _grouped(self, terms: list[Signed]) -> list[Signed]:
        """Join the terms that are the branches of one case distinction."""
        grouped: list[Signed] = []
        open_groups: dict[tuple[int, Any], list[Branch]] = {}
        for sign, what in terms:
            if what.op() != ca.OP_IF_ELSE_ZERO:
                grouped.append(Signed(sign, what))
                continue
            key = sign, self._selector(what.dep(0))
            branch = Branch(what.dep(1), what.dep(0))
            known = open_groups.get(key)
            if known is None or any(_key(branch.condition) == _key(other.condition) for other in known):
                known = open_groups[key] = []
                grouped.append(Signed(sign, known))
            known.append(branch)
        return grouped

    def _selector(self, condition: Any) -> Any:
        """Return what decides between branches: a mode, or a condition."""
        mode = self._mode_of(condition)
        if mode is not None:
            return id(mode)
        return _key(condition.dep(0) if condition.op() == ca.OP_NOT else condition)

    def _mode_of(self, condition: Any) -> Symbol | None:
        leaves = symbols_in(condition)
        alone = len(leaves) == 1 and bool(self.mode(leaves[0]))
        return leaves[0] if alone and condition.op() in (ca.OP_EQ, ca.OP_OR, ca.OP_NOT) else None

    def _cases(self, branches: list[Branch]) -> Written:
        branched = self._rows(branches)
        if len(branched) == 1:  # all branches are the same
            return Written(branched[0][0], SUM)
        rows = [rf"{value} & {condition}" for value, condition in branched]
        return Written(r"\begin{cases} " + r" \cr ".join(rows) + r" \end{cases}", PRODUCT)

    def _rows(self, branches: list[Branch]) -> list[tuple[str, str]]:
        mode = self._mode_of(branches[0].condition)
        if mode is not None:
            return self._mode_rows(mode, branches)
        values = {branch.condition.op() == ca.OP_NOT: branch.value for branch in branches}
        condition = branches[0].condition.dep(0) if True in values and len(values) == 1 else branches[0].condition
        value, otherwise = values.get(False, ca.SX(0)), values.get(True, ca.SX(0))
        first = self.latex(value), r"\text{if } " + self._condition(condition).latex
        terms = self._grouped(self._terms(otherwise, 1))
        goes_on = len(terms) == 1 and terms[0].sign > 0 and isinstance(terms[0].what, list)
        rows = self._rows(terms[0].what) if goes_on else [(self.latex(otherwise), _OTHERWISE)]
        return rows if rows[0] == (first[0], _OTHERWISE) else [first, *rows]

    def _mode_rows(self, mode: Symbol, branches: list[Branch]) -> list[tuple[str, str]]:
        all_names = self.mode(mode)
        rows: list[tuple[str, str]] = []
        told: set[str] = set()
        for value, condition in branches:
            numbers = _numbers(condition, len(all_names))
            here = [all_names[k] for k in numbers if all_names[k] not in told]
            told.update(here)
            rows.append((self.latex(value), self._of_mode(mode, here)))
        rest = [one for one in all_names if one not in told]
        return [*rows, *([("0", self._of_mode(mode, rest))] if rest else [])]

    def _of_mode(self, mode: Symbol, wanted: list[str]) -> str:
        several = sum(bool(self.mode(symbol)) for symbol in vars(mode.owner)["_symbols"].values()) > 1
        return names.text((f"{mode.name}: " if several else "") + ", ".join(wanted))

    # -- products ------------------------------------------------------------------------------------------------------

    def _product(self, e: Any) -> Written:
        number, factors = _factors(e)
        above = [self._power(base, exponent) for base, exponent in factors if exponent > 0]
        below = [self._power(base, -exponent) for base, exponent in factors if exponent < 0]
        sign, number = ("-", -number) if number < 0 else ("", number)
        half = isclose(number, 0.5) and not below
        if below and number < 1 and isclose(1 / number, round(1 / number)):
            below.insert(0, self._number(round(1 / number)))
            number = 1.0
        if half:
            number = 1.0
        if number != 1 or not above:
            above.insert(0, self._number(number))
        if below:
            # A case distinction in a fraction would be small print.
            beside = [one for one in above if r"\begin{cases}" in one.latex]
            above = [one for one in above if one not in beside] or [Written("1", ATOM)]
            latex = _joined([Written(rf"\frac{{{_joined(above)}}}{{{_joined(below)}}}", PRODUCT), *beside])
        elif half or sign:
            latex = (r"\tfrac{1}{2} " if half else "") + r" \cdot ".join(one.inside(PRODUCT) for one in above)
        else:
            latex = _joined(above)
        lone = not sign and not half and not below and len(above) == 1
        return Written(sign + latex, above[0].binds if lone else SUM if sign else PRODUCT)

    def _power(self, base: Any, exponent: float) -> Written:
        if base.op() == ca.OP_POW and exponent == 1:
            return Written(rf"{self.write(base.dep(0)).inside(ATOM)}^{{{self.latex(base.dep(1))}}}", POWER)
        if exponent == 1:
            return self.write(base)
        return Written(rf"{self.write(base).inside(ATOM)}^{{{names.number(exponent)}}}", POWER)

    # -- conditions and functions --------------------------------------------------------------------------------------

    def _condition(self, e: Any) -> Written:
        operation = e.op()
        mode = self._mode_of(e)
        if mode is not None:
            all_names = self.mode(mode)
            chosen = [all_names[k] for k in _numbers(e, len(all_names))]
            return Written(rf"\text{{{mode.name}}} = {names.text(' or '.join(chosen))}", RELATION)
        if operation in (ca.OP_AND, ca.OP_OR):
            binds, sign = (AND, r"\land") if operation == ca.OP_AND else (OR, r"\lor")
            left, right = (self._condition(e.dep(k)).inside(binds) for k in (0, 1))
            return Written(rf"{left} {sign} {right}", binds)
        if operation == ca.OP_NOT:
            inner = e.dep(0)
            if inner.op() in _RELATIONS:
                return self._relation(inner, _NEGATED, _NEGATED_TURNED)
            return Written(rf"\lnot {self._condition(inner).inside(ATOM)}", AND)
        return self._relation(e, _RELATIONS, _TURNED) if operation in _RELATIONS else self.write(e)

    def _relation(self, e: Any, signs: dict[int, str], turned: dict[int, str]) -> Written:
        """Write a relation with what varies on the left, as it was meant: CasADi knows only < and ≤."""
        left, right, sign = e.dep(0), e.dep(1), signs[e.op()]
        if _fixed(left) > _fixed(right):
            left, right, sign = right, left, turned[e.op()]
        return Written(f"{self.write(left).inside(SUM)} {sign} {self.write(right).inside(SUM)}", RELATION)

    def _function(self, e: Any) -> Written:
        if e.op() == ca.OP_FABS:
            return Written(rf"\left\lvert {self.latex(e.dep(0))} \right\rvert", ATOM)
        if e.op() == ca.OP_SQRT:
            return Written(rf"\sqrt{{{self.latex(e.dep(0))}}}", ATOM)
        arguments = [self.latex(e.dep(k)) for k in range(e.n_dep())]
        inside = ", ".join(arguments)
        if len(inside) > _WIDE:
            inside = r"\begin{gathered} " + r", \cr ".join(arguments) + r" \end{gathered}"
        return Written(rf"{_FUNCTIONS[e.op()]}\left({inside}\right)", ATOM)


def _joined(factors: list[Written]) -> str:
    """Write factors one after the other, powers of ten and signs in parentheses."""
    if len(factors) == 1:
        return factors[0].latex
    return r" \cdot ".join(factor.inside(PRODUCT) for factor in factors)


def _factors(e: Any) -> tuple[float, list[tuple[Any, float]]]:
    """Take a product apart: a number, and bases with their exponents; equal bases come together."""
    number = 1.0
    bases: dict[Any, tuple[Any, float]] = {}
    pending: list[tuple[Any, float]] = [(e, 1.0)]
    while pending:
        one, exponent = pending.pop()
        operation = None if one.is_symbolic() else one.op()
        if one.is_constant():
            number *= float(one) ** exponent
        elif operation == ca.OP_MUL:
            pending += [(one.dep(1), exponent), (one.dep(0), exponent)]
        elif operation == ca.OP_DIV:
            pending += [(one.dep(1), -exponent), (one.dep(0), exponent)]
        elif operation in (ca.OP_INV, ca.OP_SQ):
            pending.append((one.dep(0), -exponent if operation == ca.OP_INV else 2 * exponent))
        elif operation == ca.OP_TWICE:
            number *= 2.0**exponent
            pending.append((one.dep(0), exponent))
        elif operation in (ca.OP_CONSTPOW, ca.OP_POW) and one.dep(1).is_constant():
            pending.append((one.dep(0), exponent * float(one.dep(1))))
        elif operation == ca.OP_NEG and abs(exponent) == 1:
            number = -number
            pending.append((one.dep(0), exponent))
        else:
            base, before = bases.get(_key(one), (one, 0.0))
            bases[_key(one)] = base, before + exponent
    return number, list(bases.values())


def _numbers(condition: Any, count: int) -> list[int]:
    """Return the numbers of the modes on which a condition holds."""
    function = ca.Function("holds", ca.symvar(condition), [condition])
    return [k for k in range(count) if float(function(k))]


def _fixed(e: Any) -> int:
    """Tell how little an expression varies: variables are 0, calls of methods 1, parameters 2, numbers 3."""
    if e.is_constant():
        return 3
    return min(_fixed_symbol(symbol) for symbol in symbols_in(e))


def _fixed_symbol(symbol: Symbol) -> int:
    if symbol.owner is None:
        return 0
    return 2 if symbol.owner.is_constant(symbol.name) else int(getattr(symbol.owner, "is_call", False))


def _key(e: Any) -> Any:
    """Return what two expressions have in common that are written the same way."""
    if e.is_symbolic():
        return int(e.element_hash())
    if e.is_constant():
        return float(e)
    return (e.op(), *(_key(e.dep(k)) for k in range(e.n_dep())))
