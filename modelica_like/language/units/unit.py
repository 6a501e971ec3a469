"""Units: products that keep their declared names; dimensions and text forms."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from modelica_like.errors import UnitError, question
from modelica_like.language.units.atoms import ATOMS, BASE, Exponent, find_atom, simplify

_MAX_LENGTH = 200
_MAX_EXPONENT = 20
Powers = tuple[tuple[str, Exponent], ...]


@dataclass(frozen=True, slots=True)
class Unit:
    """A product of unit names with exponents.

    Attributes:
        atoms: pairs of name and exponent, in the order of first mention; no name twice, no exponent zero.
    """

    atoms: Powers = ()

    def __mul__(self, other: Unit) -> Unit:
        return _product(self, other, 1)

    def __truediv__(self, other: Unit) -> Unit:
        return _product(self, other, -1)

    def __pow__(self, exponent: float | Fraction) -> Unit:
        power = Fraction(exponent).limit_denominator(100)
        if not math.isclose(power, exponent, rel_tol=1e-12):
            raise UnitError(
                f"A unit cannot have the exponent {exponent}; whole numbers and simple fractions can be used."
            )
        return self if self == ANY else Unit(_collect((name, old * power) for name, old in self.atoms))

    def __str__(self) -> str:
        above = [_spell(name, power) for name, power in self.atoms if power > 0]
        below = [_spell(name, -power) for name, power in self.atoms if power < 0]
        numerator = ".".join(above) or "1"
        if not below:
            return numerator
        return f"{numerator}/{below[0]}" if len(below) == 1 else f"{numerator}/({'.'.join(below)})"

    @property
    def dimension(self) -> tuple[Exponent, ...]:
        """Exponents of kg, m, s, A, K, mol, cd; the radian is dimensionless. All zero for `ANY`."""
        return _resolve(self)[0][:-1]

    @property
    def exponents(self) -> dict[str, Exponent]:
        """Exponents of FMI's BaseUnit: kg, m, s, A, K, mol, cd, rad."""
        return dict(zip(BASE, _resolve(self)[0], strict=True))

    @property
    def factor(self) -> float:
        """Size of this unit in coherent SI units."""
        return _resolve(self)[1]

    @property
    def offset(self) -> float:
        """SI value of zero; it differs from zero only for a temperature scale alone."""
        return _resolve(self)[2]


ONE = Unit()
"""The unit of a plain number, printed as `1`."""

ANY = Unit((("*", 1),))
"""The wildcard, printed as `*`: a declaration takes the unit of its value."""


def same_dimension(first: Unit, second: Unit) -> bool:
    """Return whether both units have the same dimension; `ANY` fits everything, and rad is a number."""
    return first == second or ANY in (first, second) or first.dimension == second.dimension


def _spell(name: str, power: Exponent) -> str:
    if isinstance(power, Fraction):
        return f"{name}^({power})"
    return name if power == 1 else f"{name}{power}"


def _collect(powers: Iterable[tuple[str, Exponent]]) -> Powers:
    total: dict[str, Fraction] = {}
    for name, power in powers:
        total[name] = total.get(name, Fraction(0)) + power
    return tuple((name, simplify(power)) for name, power in total.items() if power)


@lru_cache(maxsize=4096)
def _product(first: Unit, second: Unit, sign: int) -> Unit:
    if ANY in (first, second):
        return ANY
    return Unit(_collect((*first.atoms, *((name, sign * power) for name, power in second.atoms))))


@lru_cache(maxsize=4096)
def _resolve(unit: Unit) -> tuple[tuple[Exponent, ...], float, float]:
    if unit == ANY:
        return (0,) * len(BASE), 1.0, 0.0
    exponents, factor = [Fraction(0)] * len(BASE), 1.0
    for name, power in unit.atoms:
        atom = find_atom(name)
        exponents = [old + power * new for old, new in zip(exponents, atom.exponents, strict=True)]
        factor *= atom.factor ** (power if isinstance(power, int) else float(power))
    alone = len(unit.atoms) == 1 and unit.atoms[0][1] == 1
    offset = find_atom(unit.atoms[0][0]).offset if alone else 0.0
    return tuple(simplify(exponent) for exponent in exponents), factor, offset


@lru_cache(maxsize=4096)
def coherent(unit: Unit) -> Unit:
    """Return the unit with its names replaced by SI ones of the same dimension: `N.m` for `kN.m`, `rad/s` for `rpm`."""
    if unit == ANY:
        return unit
    return Unit(_collect((base, power) for name, old in unit.atoms for base, power in _base_powers(name, old)))


def _base_powers(name: str, power: Exponent) -> list[tuple[str, Exponent]]:
    atom = find_atom(name)
    plain = {"bar": "Pa", "degC": "K"}.get(name, name if atom.factor == 1.0 else name[1:])
    if plain in ATOMS and ATOMS[plain].factor == 1.0 and ATOMS[plain].exponents == atom.exponents:
        return [(plain, power)]
    return [(base, power * exponent) for base, exponent in zip(BASE, atom.exponents, strict=True)]


# --- text -----------------------------------------------------------------------------------------------------------

_TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-z_%]+)(?P<power>\^?[+-]?[0-9]+|\^\([+-]?[0-9]+(?:/[1-9][0-9]*)?\))?"
    r"|(?P<one>1)(?![0-9])|(?P<mark>[./()]))\s*"
)
_SPELLINGS = {"**": "^", "*": ".", "\u00b7": ".", "\u22c5": ".", "\u2212": "-", "\u00b0C": "degC", "\u00b0": "deg",
              "\u03bc": "u", "\u03a9": "Ohm"}  # fmt: skip
_SUPERSCRIPTS = re.compile("[\u207a\u207b]?[\u00b2\u00b3\u00b9\u2070\u2074-\u2079]+")


@lru_cache(maxsize=4096)
def parse_unit(text: str) -> Unit:
    """Read a unit in Modelica's notation: `kg.m2`, `N.m.s/rad`, `J/(kg.K)`, `s-1`, `1/min`.

    Also read are `N*m`, `kg*m^2`, `N m`, and the typographic forms of the dot, of exponents, of degrees and of ohms.

    Args:
        text: the unit; `1` or an empty text is the unit of a number, `*` the wildcard `ANY`.

    Raises:
        UnitError: the text is not a unit, or a name in it is unknown.
    """
    stripped = text.strip()
    if stripped == "*":
        return ANY
    if len(stripped) > _MAX_LENGTH:
        raise UnitError(f"'{stripped[:30]}...' is too long for a unit.")
    unit = _Parser(stripped).parse() if stripped else ONE
    for name, _ in unit.atoms:
        _check_name(name, stripped)
    return unit


def _check_name(name: str, text: str) -> None:
    try:
        find_atom(name)
    except UnitError as error:
        if name == text:
            raise
        near = text.replace(name, error.instead, 1) if error.instead else ""
        near = "rpm" if near == "rev/min" else near
        what = error.what.replace(f"'{name}'", f"'{name}' in '{text}'", 1)
        what = what.replace(question(error.instead), question(near)) if near else what
        raise UnitError(what, word=text, instead=near) from None


class _Parser:
    """Recursive descent over the tokens of one unit."""

    def __init__(self, text: str) -> None:
        self.text = text
        text = unicodedata.normalize("NFKC", _SUPERSCRIPTS.sub(lambda match: "^" + match.group(), text))
        for typographic, plain in _SPELLINGS.items():
            text = text.replace(typographic, plain)
        self.tokens = self._tokens(text)
        self.next = 0

    def parse(self) -> Unit:
        unit = self.quotient()
        if self.next < len(self.tokens):
            raise self.error()
        return unit

    def quotient(self) -> Unit:
        unit, divided = self.factor(), False
        while (mark := self.peek()) not in ("", ")"):
            if mark in ("/", "."):
                self.next += 1
            if mark == "/":
                unit, divided = unit / self.factor(), True
            elif divided:
                raise UnitError(
                    f"'{self.text}' is ambiguous: put everything after the '/' in parentheses, as in J/(kg.K)."
                )
            else:
                unit = unit * self.factor()
        return unit

    def factor(self) -> Unit:
        if self.peek() == "(":
            self.next += 1
            inner = self.quotient()
            if self.peek() != ")":
                raise self.error()
            self.next += 1
            return inner
        if self.next >= len(self.tokens) or self.tokens[self.next].group("mark"):
            raise self.error()
        token = self.tokens[self.next]
        self.next += 1
        return ONE if token.group("one") else Unit(_collect([(token.group("name"), self.power(token.group("power")))]))

    def power(self, text: str | None) -> Exponent:
        power = simplify(Fraction(text.strip("^()"))) if text else 1
        if abs(power) > _MAX_EXPONENT:
            raise self.error()
        return power

    def peek(self) -> str:
        return self.tokens[self.next].group().strip() if self.next < len(self.tokens) else ""

    def _tokens(self, text: str) -> list[re.Match[str]]:
        tokens: list[re.Match[str]] = []
        position = 0
        while position < len(text):
            match = _TOKEN.match(text, position)
            if match is None:
                raise self.error()
            tokens.append(match)
            position = match.end()
        return tokens

    def error(self) -> UnitError:
        return UnitError(
            f"'{self.text}' is not a unit.", advice="Write units as in kg.m2, N.m.s/rad, J/(kg.K) or 1/min."
        )
