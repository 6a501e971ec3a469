"""The formulas of every page, read back from LaTeX, are worth what the equations, events and energy terms are worth."""

import random
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from math import pi
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from modelica_like.errors import LanguageError
from modelica_like.language import Component
from modelica_like.language.equation import Equation, as_statement
from modelica_like.language.expr import Symbol, symbols_in
from modelica_like.language.places import located
from modelica_like.language.transition import as_event
from modelica_like.netlist import library_types
from modelica_like.report.component_pages import latex_names
from modelica_like.report.component_pages.library import examples_by_type
from modelica_like.report.component_pages.named_calls import any_table
from modelica_like.report.component_pages.page import structure_of
from modelica_like.report.component_pages.statements import Statements, statements

# -- a reader of LaTeX -------------------------------------------------------------------------------------------------

TOKEN = re.compile(r"\\text\{[^}]*\}|\\[a-zA-Z]+|\d+(?:\.\d+)?|[a-zA-Z]|\S")
RELATIONS: dict[str, Callable[[Any, Any], bool]] = {
    r"\lt": lambda a, b: a < b, r"\le": lambda a, b: a <= b, r"\gt": lambda a, b: a > b, r"\ge": lambda a, b: a >= b,
    "=": lambda a, b: a == b, r"\ne": lambda a, b: a != b,
}  # fmt: skip
FUNCTIONS: dict[str, Callable[..., Any]] = {
    r"\sin": np.sin, r"\cos": np.cos, r"\tan": np.tan, r"\exp": np.exp, r"\ln": np.log, r"\tanh": np.tanh,
    r"\text{sgn}": np.sign, r"\text{atan2}": np.arctan2, r"\max": max, r"\min": min, r"\text{floor}": np.floor,
}  # fmt: skip
NAMED = re.compile(
    r"[a-zA-Z]|\\text.*|\\(varphi|omega|dot|ddot|rate|pi|infty|frac|tfrac|sqrt|left|begin|max|min|sin|cos|tan|exp|ln|tanh|"
    + "|".join(latex_names.GREEK) + ")"
)  # fmt: skip
"""What a factor can begin with."""


def tokens_of(latex: str) -> list[str]:
    plain = re.sub(r"\\(begin|end){gathered}", "", latex).replace(r", \cr", ",").replace(r"\frac{d}{dt}", r"\rate")
    return TOKEN.findall(plain)


@dataclass
class Formulas:
    """Numbers of the names, active modes, and what is defined: formal arguments and right side, or a table."""

    values: Mapping[str, float]
    modes: Mapping[str, str]
    definitions: Mapping[str, tuple[list[str], str]]
    tables: Mapping[str, Callable[[float], float]]

    def worth(self, latex: str, arguments: Mapping[str, float] | None = None) -> Any:
        reader = Reader(self, tokens_of(latex), {**self.values, **(arguments or {})})
        result = reader.disjunction()
        assert reader.at == len(reader.tokens), (latex, reader.tokens[reader.at :])
        return result


@dataclass
class Reader:
    formulas: Formulas
    tokens: list[str]
    values: Mapping[str, float]
    at: int = 0

    @property
    def token(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self, *expected: str) -> str:
        token = self.token
        assert not expected or token in expected, (token, expected, " ".join(self.tokens))
        self.at += 1
        return token

    def disjunction(self) -> Any:
        value = self.conjunction()
        while self.token == r"\lor" and self.take():
            value = bool(self.conjunction()) | bool(value)
        return value

    def conjunction(self) -> Any:
        value = self.relation()
        while self.token == r"\land" and self.take():
            value = bool(self.relation()) & bool(value)
        return value

    def relation(self) -> Any:
        if self.token == r"\lnot" and self.take():
            return not self.relation()
        mode = self.token.removeprefix(r"\text{").removesuffix("}")
        if mode in self.formulas.modes and self.tokens[self.at + 1] == "=":
            self.at += 2
            return self.is_mode(mode, self.take())
        value = self.sum()
        while self.token in RELATIONS:
            value = RELATIONS[self.take()](value, self.sum())
        return value

    def sum(self) -> Any:
        value = -self.product() if self.token == "-" and self.take() else self.product()
        while self.token in ("+", "-"):
            value = value + self.product() if self.take() == "+" else value - self.product()
        return value

    def product(self) -> Any:
        value = self.power()
        while self.token == r"\cdot" or NAMED.fullmatch(self.token):
            if self.token == r"\cdot":
                self.take()
            value = value * self.power()
        return value

    def power(self) -> Any:
        base = self.factor()
        return np.float64(base) ** self.group() if self.token == "^" and self.take() else base

    def group(self) -> Any:
        self.take("{")
        value = self.disjunction()
        self.take("}")
        return value

    def factor(self) -> Any:
        token = self.token
        if token[0].isdigit():
            return float(self.take())
        if token in (r"\pi", r"\infty") and self.take():
            return pi if token == r"\pi" else 1e30  # as the library's `never`
        if token in (r"\frac", r"\tfrac") and self.take():
            return np.float64(self.group()) / self.group()
        if token == r"\sqrt" and self.take():
            return np.sqrt(self.group())
        if token == r"\left":
            return self.bracketed()[0]
        if token == r"\begin":
            return self.cases()
        if token in FUNCTIONS and self.take():
            return FUNCTIONS[token](*self.bracketed())
        return self.named()

    def bracketed(self) -> list[Any]:
        self.take(r"\left")
        opening = self.take("(", r"\lvert")
        values = [self.disjunction()]
        while self.token == "," and self.take():
            values.append(self.disjunction())
        self.take(r"\right")
        self.take(")", r"\rvert")
        return values if opening == "(" else [abs(values[0])]

    def cases(self) -> Any:
        self.at += len(tokens_of(r"\begin{cases}"))
        chosen: list[Any] = []
        while True:
            value = self.disjunction()
            self.take("&")
            asked = self.token == r"\text{if }" and self.take()
            holds = self.disjunction() if asked else self.holds(self.take())
            chosen += [value] if holds else []
            if self.take(r"\cr", r"\end") == r"\end":
                self.at += len(tokens_of("{cases}"))
                return chosen[0]

    def holds(self, words: str) -> bool:
        mode, colon, names = words.removeprefix(r"\text{").rpartition(": ")
        return words == r"\text{otherwise}" or self.is_mode(mode if colon else next(iter(self.formulas.modes)), names)

    def is_mode(self, mode: str, words: str) -> bool:
        names = re.split(", | or ", words.removeprefix(r"\text{").removesuffix("}"))
        return self.formulas.modes[mode].replace("_", " ") in names

    def named(self) -> Any:
        name = self.name()
        if name in self.values:
            return self.values[name]
        arguments = self.bracketed() if self.token == r"\left" else []
        if name in self.formulas.tables:
            return self.formulas.tables[name](*arguments)
        formal, right = self.formulas.definitions[name]
        return self.formulas.worth(right, dict(zip(formal, arguments, strict=True)))

    def name(self) -> str:
        begin = self.at
        if self.take() in (r"\dot", r"\ddot"):
            self.at += 3
        elif self.tokens[begin] == r"\rate":
            self.at += 1
        if self.token == "_":
            while self.take() != "}":
                pass
        if self.tokens[begin] == r"\text{prescribed}":
            while self.take() != ")":
                pass
        return "".join(self.tokens[begin : self.at])


# -- a component with numbers ------------------------------------------------------------------------------------------


@lru_cache
def examples() -> Any:
    return examples_by_type(Path(__file__).parents[2] / "examples")


def path_of(symbol: Symbol, root: Component) -> str:
    names, owner = [symbol.name], symbol.owner
    while owner is not root:
        names.append(owner._name)
        owner = owner._owner
    return ".".join(reversed(names))


class Numbers:
    """A component whose symbols all have a number, and its pages' formulas with the same numbers."""

    def __init__(self, kind: type[Component], structure: Mapping[str, Any], active: int, option: str = "") -> None:
        self.random = random.Random(f"{kind.__name__} {active}")
        self.tables = {
            name: tuple((x, *(self.random.uniform(0.2, 0.9) for _ in values)) for x, *values in rows)
            for name, rows in any_table(kind).items()
        }
        self.component = component = kind(**{**self.tables, **structure})
        component.__dict__["given"] = lambda name: name == option or Component.given(component, name)
        if option in component.connectors:
            component.connectors[option]._used = True
        self.active = {name: active % len(mode.names) for name, mode in kind._class_modes.items()}
        self.known: dict[str, float] = {}

    def of(self, expression: Any) -> float:
        """Return what an expression of the component is worth."""
        expression = ca.SX(expression)
        leaves = symbols_in(expression)  # type: ignore[arg-type]
        if not leaves:
            return float(expression)
        function = ca.Function("worth", [ca.SX(leaf) for leaf in leaves], [expression])
        return float(function(*(self.number(leaf) for leaf in leaves)))

    def number(self, symbol: Symbol) -> float:
        path = "t" if symbol.owner is None else path_of(symbol, self.component)
        if path in self.active:
            return float(self.active[path])
        latex = "".join(tokens_of(latex_names.name(path, symbol.order)))
        return self.known.setdefault(latex, self.random.uniform(0.2, 0.9))

    def formulas(self, definitions: Any) -> Formulas:
        defined: dict[str, tuple[list[str], str]] = {}
        for term in definitions:
            name, _, arguments = term.left.partition(r"\left(")
            formal = ["".join(tokens_of(one)) for one in arguments.removesuffix(r"\right)").split(", ") if one]
            defined["".join(tokens_of(name))] = formal, term.right
        return Formulas(self.known, self.modes(), defined, self.lookups())

    def modes(self) -> dict[str, str]:
        return {name: mode.names[self.active[name]] for name, mode in self.component.modes.items()}

    def lookups(self) -> dict[str, Callable[[float], float]]:
        found: dict[str, Callable[[float], float]] = {}
        holds = getattr(self.component, "extrapolate", "linear") == "hold"
        for name, (first, second) in self.tables.items():
            latex = "".join(tokens_of(latex_names.name(name)))
            for column in range(1, len(first)):
                number = f"_{{{column + 1}}}" if len(first) > 2 else ""
                found[latex + number] = partial(value_between, first, second, column, holds)
            for end, row in (("first", first), ("last", second)):
                self.known["".join(tokens_of(latex_names.text(f"{end} of {name}")))] = row[0]
        return found


def value_between(first: Any, second: Any, column: int, holds: bool, x: float) -> float:
    if holds:
        x = min(max(x, first[0]), second[0])
    return first[column] + (second[column] - first[column]) * (x - first[0]) / (second[0] - first[0])


def same(ours: Any, theirs: Any) -> bool:
    return ours == pytest.approx(theirs, rel=2e-5, abs=1e-9, nan_ok=True)


def compare(page: Statements, numbers: Numbers) -> None:
    component, name = numbers.component, type(numbers.component).__name__
    said = [as_statement(one, source, name) for one, source in located(component.equations())]
    residuals = [numbers.of(ca.SX(one.left) - ca.SX(one.right)) for one in said if isinstance(one, Equation)]
    energies = {term: numbers.of(getattr(component, term)()) for term in page.energy}
    events = [as_event(one, source, name) for one, source in located(component.events())]
    moments = [numbers.of(one.when if getattr(one, "at", None) is None else one.at) for one in events]
    resets = [numbers.of(value) for one in events for value in getattr(one, "reset", {}).values()]
    formulas = numbers.formulas(page.definitions)
    for term, residual in zip(page.equations, residuals, strict=True):
        written = formulas.worth(term.left) - formulas.worth(term.right)
        assert same(abs(written), abs(residual)), (term, numbers.active)
    for term, energy in energies.items():
        assert same(formulas.worth(page.energy[term].right), energy), page.energy[term]
    for event, moment in zip(page.events, moments, strict=True):
        assert same(formulas.worth(event.when.removeprefix("t = ")), moment), event
    for latex, value in zip((reset for event in page.events for reset in event.resets), resets, strict=True):
        assert same(formulas.worth(latex.partition(" := ")[2]), value), latex


@pytest.mark.parametrize("name", sorted(library_types()))
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # a branch that is not taken may divide by zero
def test_formulas_are_worth_what_the_class_says(name: str) -> None:
    kind = library_types()[name]
    structure = structure_of(kind, examples()[name])
    page = statements(kind, structure)
    for active in range(max((len(mode.names) for mode in kind._class_modes.values()), default=1)):
        compare(page, Numbers(kind, structure, active))
    for option in (*page.asked, *(one for one, end in kind._class_connectors.items() if end.optional)):
        try:
            other = statements(kind, structure, given=frozenset({option}), used=frozenset({option}) - set(page.asked))
        except LanguageError:
            assert option == "mesh_efficiency"  # an efficiency needs losses
            continue
        compare(other, Numbers(kind, structure, 1, option))
