"""Every expression of every component type, read back from its LaTeX, is worth what Python makes of it."""

import ast
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from math import pi
from textwrap import dedent
from types import FunctionType
from typing import Any

import numpy as np
import pytest

from modelica_like.language import Component
from modelica_like.language.inside import declarations
from modelica_like.netlist import library_types
from modelica_like.show.report.component_pages import latex_names
from modelica_like.show.report.component_pages.latex import Path, Unwritable, Writer

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


def tokens_of(latex: str) -> list[str]:
    plain = re.sub(r"\\(begin|end){gathered}", "", latex).replace(r", \cr", ",").replace(r"\frac{d}{dt}", r"\rate")
    return TOKEN.findall(plain)


@dataclass
class Formulas:
    """Formulas whose names have numbers that follow from them; some modes are active."""

    modes: Mapping[str, str]

    def worth(self, latex: str) -> Any:
        reader = Reader(self, tokens_of(latex))
        result = reader.disjunction()
        assert reader.at == len(reader.tokens), (latex, reader.tokens[reader.at :])
        return result


@dataclass
class Reader:
    formulas: Formulas
    tokens: list[str]
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
        while self.token in (r"\cdot", r"\bmod"):
            value = value * self.power() if self.take() == r"\cdot" else value % self.power()
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
        return called(name, *(self.bracketed() if self.token == r"\left" else []))

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


# -- Python with the same numbers --------------------------------------------------------------------------------------


def called(name: str, *arguments: Any) -> float:
    """Return a number for a name, or for a function of its arguments."""
    if name in (r"\text{false}", r"\text{true}"):
        return float(name == r"\text{true}")
    number = 0.2 + int.from_bytes(sha256(name.encode()).digest()[:4]) / 2**33
    return number * (1 + sum(0.1 * k * float(one) for k, one in enumerate(arguments, 1)))


class Number(float):
    """The number of a path; what lies below it is a number again, and it can be called."""

    path: str
    modes: Mapping[str, str]

    def __new__(cls, path: str, modes: Mapping[str, str], dots: int = 0) -> "Number":
        made = super().__new__(cls, called("".join(tokens_of(latex_names.name(path.lstrip("_"), dots)))))
        made.path, made.modes, made.dots = path, modes, dots
        return made

    def __getattr__(self, name: str) -> Any:
        path = f"{self.path}.{name}".removeprefix(".")
        if name == "used":
            return called(rf"\text{{{self.path.replace('_', ' ')} is connected}}")
        return called("t") if path == "time" else Number(path, self.modes)

    def __call__(self, *arguments: float, **options: float) -> float:
        return called("".join(tokens_of(latex_names.name(self.path.lstrip("_")))), *arguments, *options.values())

    def given(self, name: str) -> float:
        return called(rf"\text{{{name.replace('_', ' ')} is given}}")

    def is_(self, *names: str) -> bool:
        return self.modes[self.path] in names

    def choose(self, otherwise: float | None = None, **values: float) -> float:
        found = values.get(self.modes[self.path], otherwise)
        if found is None:  # a subclass has more modes, and equations of its own for them
            raise KeyError(self.modes[self.path])
        return found


def rate(what: Number) -> Number:
    return Number(what.path, what.modes, what.dots + 1)


KNOWN: dict[str, Any] = {
    "der": rate, "where": lambda holds, then, other, events=None: then if holds else other,
    "negate": lambda holds: not holds,
    "all_of": lambda *conditions: all(conditions), "any_of": lambda *conditions: any(conditions),
    "prescribed": lambda what: called("".join(tokens_of(latex_names.name(f"prescribed({what.path})")))),
    "maximum": max, "minimum": min, "absolute": abs, "sign": np.sign, "float": float, "exp": np.exp, "log": np.log,
    "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos, "tan": np.tan, "tanh": np.tanh, "atan2": np.arctan2,
    "floor": np.floor,
}  # fmt: skip
STRUCTURES = (
    ast.Lambda, ast.Starred, ast.Tuple, ast.List, ast.Subscript, ast.JoinedStr, ast.Dict, ast.ListComp, ast.In,
    ast.GeneratorExp, ast.NotIn,
)  # fmt: skip


def functions(kind: type[Component]) -> Iterator[FunctionType]:
    for base in kind.__mro__:
        if issubclass(base, Component) and base not in Component.__mro__:
            members = (one.fget if isinstance(one, property) else one for one in vars(base).values())
            yield from (one for one in members if isinstance(one, FunctionType) and one.__name__ != "build")


def is_formula(node: ast.expr) -> bool:
    """Tell whether an expression is one of numbers only."""
    for one in ast.walk(node):
        text = isinstance(one, ast.Constant) and isinstance(one.value, str)
        if isinstance(one, STRUCTURES) or (text and not isinstance(node, ast.Call)):
            return False
        if isinstance(one, ast.Call) and ast.unparse(one.func) in ("interpolate", "connect", "super", "zip", "series"):
            return False
        if isinstance(one, ast.Call) and ast.unparse(one.func) == "der" and not is_path(one.args[0]):
            return False
    return True


def is_path(node: ast.expr) -> bool:
    inner = isinstance(node, ast.Call) and ast.unparse(node.func) == "der"
    return is_path(node.args[0]) if inner else isinstance(node, ast.Name | ast.Attribute)  # type: ignore[attr-defined]


def expressions(code: ast.FunctionDef) -> Iterator[ast.expr]:
    """Yield what is returned, assigned, on both sides of equations, and when events happen."""
    for one in ast.walk(code):
        match one:
            case ast.Return(value=ast.expr() as value) | ast.Assign(targets=[ast.Name()], value=value):
                yield value
            case ast.Yield(value=ast.Compare(left=left, comparators=[right])):
                yield from (left, right)
            case ast.keyword(arg="when" | "at", value=value):
                yield value
            case _:
                pass


def compare(function: FunctionType, modes: Mapping[str, str]) -> int:
    """Compare all formulas of a function; return how many there are."""
    (code,) = ast.parse(dedent(inspect.getsource(function))).body
    assert isinstance(code, ast.FunctionDef)
    local = {one.arg for one in code.args.args} | {
        one.id for one in ast.walk(code) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)
    }
    aliases = {name: Path(name, own=False) for name in local - {"self"}}
    numbers = {name: Number("" if name == "self" else name, modes) for name in local}
    library = {name: Number(name, modes) for name, one in function.__globals__.items() if isinstance(one, FunctionType)}
    count = 0
    for node in filter(is_formula, expressions(code)):
        try:
            latex = Writer(function.__globals__, dict(aliases)).latex(node)
            worth = eval(  # the library's own source text
                compile(ast.Expression(node), "formula", "eval"),
                {**function.__globals__, **library, **KNOWN, **numbers},
            )
        except (Unwritable, KeyError):  # a mode that an alias means
            continue
        if not isinstance(worth, int | float | np.number | np.bool_):  # a part, a mode
            continue
        read = Formulas(modes).worth(latex)
        assert read == pytest.approx(float(worth), rel=1e-5, abs=1e-9, nan_ok=True), (ast.unparse(node), latex)
        count += 1
    return count


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # a branch that is not taken may divide by zero
def test_formulas_are_worth_what_the_class_says() -> None:
    seen: set[tuple[FunctionType, tuple[tuple[str, str], ...]]] = set()
    count = 0
    for kind in library_types().values():
        for active in range(max((len(mode.names) for mode in declarations(kind).modes.values()), default=1)):
            modes = {name: mode.names[active % len(mode.names)] for name, mode in declarations(kind).modes.items()}
            for function in functions(kind):
                key = function, tuple(modes.items())
                if key not in seen:
                    seen.add(key)
                    count += compare(function, modes)
    assert count > 1500
