"""The single unit names (kg, rpm, mm, ...) and their SI base units.

A small table has the usual names of drive-trains, so that runs do not wait for pint; other names are looked up in
pint's registry, which is created on first use.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from modelica_like.errors import UnitError, nearest, question

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""Names of the base units, in the order of all exponent tuples; they are FMI's."""

Exponent = int | Fraction


@dataclass(frozen=True, slots=True)
class Atom:
    """One unit name in SI: `value_si = value * factor + offset`.

    Attributes:
        factor: size of the unit in coherent SI units.
        exponents: exponents of `BASE`.
        offset: SI value of zero, for temperatures.
    """

    factor: float
    exponents: tuple[Exponent, ...]
    offset: float = 0.0


def _atom(factor: float = 1.0, offset: float = 0.0, **exponents: int) -> Atom:
    return Atom(factor, tuple(exponents.get(name, 0) for name in BASE), offset)


_COHERENT = {name: _atom(**{name: 1}) for name in BASE} | {
    "N": _atom(kg=1, m=1, s=-2),
    "J": _atom(kg=1, m=2, s=-2),
    "W": _atom(kg=1, m=2, s=-3),
    "Pa": _atom(kg=1, m=-1, s=-2),
    "Hz": _atom(s=-1),
    "C": _atom(A=1, s=1),
    "V": _atom(kg=1, m=2, s=-3, A=-1),
    "Ohm": _atom(kg=1, m=2, s=-3, A=-2),
    "F": _atom(kg=-1, m=-2, s=4, A=2),
    "H": _atom(kg=1, m=2, s=-2, A=-2),
    "Wb": _atom(kg=1, m=2, s=-2, A=-1),
    "T": _atom(kg=1, s=-2, A=-1),
}
_OTHERS = {
    "g": _atom(1e-3, kg=1),
    "t": _atom(1e3, kg=1),
    "deg": _atom(math.pi / 180, rad=1),
    "rev": _atom(2 * math.pi, rad=1),
    "rpm": _atom(2 * math.pi / 60, rad=1, s=-1),
    "min": _atom(60.0, s=1),
    "h": _atom(3600.0, s=1),
    "d": _atom(86400.0, s=1),
    "bar": _atom(1e5, kg=1, m=-1, s=-2),
    "degC": _atom(1.0, 273.15, K=1),
    "%": _atom(0.01),
}
_PREFIXES = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6, "G": 1e9}
_PREFIXED = {
    prefix + name: Atom(size * atom.factor, atom.exponents)
    for prefix, size in _PREFIXES.items()
    for name, atom in {**_COHERENT, "g": _OTHERS["g"], "bar": _OTHERS["bar"]}.items()
    if name not in ("kg", "K", "cd")
}
ATOMS: Mapping[str, Atom] = {**_PREFIXED, **_OTHERS, **_COHERENT}
"""The unit names known without pint."""

PINT_NAMES: Mapping[str, str] = {
    "%": "percent",
    "rev": "revolution",
    "Ohm": "ohm",
    **{f"{p}Ohm": f"{p}ohm" for p in _PREFIXES},
}
"""Names with another spelling in pint."""


@lru_cache(maxsize=4096)
def find_atom(name: str) -> Atom:
    """Return the meaning of one unit name.

    Raises:
        UnitError: neither the table nor pint knows the name, or it is a logarithmic unit.
    """
    if name in ATOMS:
        return ATOMS[name]
    if _meant(name):
        raise _unknown(name)
    with _ONE_AT_A_TIME:
        return _ask_pint(name)


_ONE_AT_A_TIME = threading.RLock()
"""pint creates its registry at the first unit; a second thread would find one that does not have all units yet."""


@lru_cache(maxsize=1)
def pint_registry() -> Any:
    """Return pint's registry of units; the first call creates it, in about half a second."""
    import pint

    with _ONE_AT_A_TIME:
        registry: Any = pint.get_application_registry
        registry().Unit("meter")
        return registry().get()


def _ask_pint(name: str) -> Atom:
    import pint

    registry = pint_registry()
    try:
        unit = registry.Unit(PINT_NAMES.get(name, name))
        zero, unity = (registry.Quantity(value, unit).to_root_units() for value in (0.0, 1.0))
    except (pint.PintError, AttributeError, ValueError, TypeError, ArithmeticError):
        raise _unknown(name) from None
    factor, offset = float(unity.magnitude - zero.magnitude), float(zero.magnitude)
    if registry.Quantity(2.0, unit).to_root_units().magnitude != 2 * factor + offset:
        raise UnitError(f"Unit '{name}' is logarithmic; give a plain number.")
    return _from_pint(dict(unity.unit_items()), factor, offset)


_PINT_BASE = {
    "kilogram": "kg", "gram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol",
    "candela": "cd", "radian": "rad",
}  # fmt: skip


def _from_pint(powers: dict[str, Any], factor: float, offset: float) -> Atom:
    exponents: dict[str, Fraction] = dict.fromkeys(BASE, Fraction(0))
    for name, power in powers.items():
        if name in _PINT_BASE:
            exponents[_PINT_BASE[name]] += Fraction(power).limit_denominator(100)
        if name == "gram":
            factor *= 1e-3**power
    return Atom(factor, tuple(simplify(exponents[name]) for name in BASE), offset)


def simplify(exponent: Fraction) -> Exponent:
    """Return a whole exponent as `int`, so that it prints and compares as such."""
    return int(exponent) if exponent.denominator == 1 else exponent


_MEANT = {
    "Nm": "N.m", "Nms": "N.m.s", "U": "rev", "r": "rev", "tr": "rev", "Upm": "rpm", "RPM": "rpm", "upm": "rpm",
}  # fmt: skip
"""What is meant by names that pint does not know, or takes for threads (Nm) and enzymes (U)."""
_WITH_PREFIX = ("Nm", "Nms")
"""Those that pint takes for something else with a prefix, too."""


def _meant(name: str) -> str:
    """Return what is meant by such a name, also with a prefix (kNm), or an empty text."""
    prefix = name[0] if name[0] in _PREFIXES and name[1:] in _WITH_PREFIX else ""
    meant = _MEANT.get(name.removeprefix(prefix), "")
    return f"{prefix}{meant}" if meant else ""


def _unknown(name: str) -> UnitError:
    parts = _meant(name) or _split(name)
    if name[:-1] in ATOMS and name.endswith("s"):
        parts = name[:-1]
    near = parts or nearest(name, ATOMS)
    return UnitError(f"Unknown unit '{name}'{question(near) or '.'}", word=name, instead=near)


def _split(name: str) -> str:
    """Return 'kg.m' for 'kgm': a product written without its dot."""
    plain = {**_COHERENT, **_OTHERS}
    for end in range(len(name) - 1, 0, -1):
        if name[:end] in plain:
            rest = name[end:] if name[end:] in plain else _split(name[end:])
            if rest:
                return f"{name[:end]}.{rest}"
    return ""
