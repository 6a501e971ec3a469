r"""Names and numbers as mathematics: `phi_rel` becomes an angle with a subscript, 6.2831853 becomes 2π.

Only commands that Markdown does not change are used: it removes the backslash from punctuation such as `\,` and `\_`.
"""

from __future__ import annotations

import re
from fractions import Fraction
from math import isclose, pi

GREEK = ("alpha", "beta", "gamma", "delta", "eta", "mu", "psi", "rho", "sigma", "tau", "zeta")
_LETTERS = {"phi": r"\varphi", "w": r"\omega", **{name: f"\\{name}" for name in GREEK}}
_INDEXED = re.compile(r"([A-Zivwt])([a-z]|\d+)")
_LONGEST_SYMBOL = 2
"""Longer names are words."""
_INFINITE = 1e29


def text(words: str) -> str:
    """Return words in upright type."""
    return rf"\text{{{words.replace('_', ' ')}}}"


def name(path: str, dots: int = 0) -> str:
    """Return the symbol of a field: `flange_a.phi` is an angle with the connector as its subscript.

    Args:
        path: dotted path of the field.
        dots: order of the time derivative.
    """
    if path.endswith(")"):  # a property of a field, such as prescribed(w)
        said, _, about = path.removesuffix(")").partition("(")
        return rf"{text(said)}\left({name(about)}\right)"
    owner, _, field = path.rpartition(".")
    head, _, rest = field.partition("_")
    if len(head) > _LONGEST_SYMBOL and head not in _LETTERS:
        head, rest = field, ""
    indexed = _INDEXED.fullmatch(head)
    base, index = indexed.groups() if indexed and head not in _LETTERS else (head, "")
    letter = _LETTERS.get(base, base if len(base) == 1 else text(base))
    dotted = _differentiated(letter, dots)
    indices = [part for part in (index, rest.replace("_", " "), owner.replace("_", " ")) if part]
    short = all(len(part) == 1 or part.isdigit() for part in indices)
    joined = ", ".join(indices)
    return dotted if not indices else rf"{dotted}_{{{joined if short else text(joined)}}}"


def _differentiated(letter: str, times: int) -> str:
    if letter.startswith(r"\text") and times:
        power = f"^{times}" if times > 1 else ""
        return rf"\frac{{d{power}}}{{dt{power}}} {letter}"
    return [letter, rf"\dot{{{letter}}}", rf"\ddot{{{letter}}}"][times]


def function(called: str, arguments: list[str], number: int = 0) -> str:
    """Return a function of the component with its arguments, with a subscript if several have the same name."""
    written = name(called) + (f"_{{{number}}}" if number else "")
    return rf"{written}\left({', '.join(arguments)}\right)" if arguments else written


def number(value: float) -> str:
    """Return a number: fractions and multiples of π if they match, otherwise six digits."""
    if abs(value) > _INFINITE:
        return r"\infty" if value > 0 else r"-\infty"
    of_pi = Fraction(value / pi).limit_denominator(12)
    if of_pi and isclose(of_pi * pi, value, rel_tol=1e-14):
        top = r"\pi" if abs(of_pi.numerator) == 1 else rf"{abs(of_pi.numerator)} \pi"
        sign = "-" if value < 0 else ""
        return sign + (top if of_pi.denominator == 1 else rf"\frac{{{top}}}{{{of_pi.denominator}}}")
    mantissa, _, exponent = f"{value:.6g}".partition("e")
    if not exponent:
        return mantissa
    power = f"10^{{{int(exponent)}}}"
    return {"1": power, "-1": f"-{power}"}.get(mantissa, rf"{mantissa} \cdot {power}")
