"""Values of a parameter on the command line."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np

from modelica_like.errors import DuplicateName, ValueOutOfRange

Given = TypeVar("Given")

MOST_RUNS = 10_000_000
_DIGITS = len(str(MOST_RUNS))


def read_assignment(text: str) -> tuple[str, str]:
    """Read `motor.w=4000 rpm`.

    Raises:
        ValueOutOfRange: there is no equals sign.
    """
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise ValueOutOfRange(f"'{text}' is not NAME=VALUE.", advice="Write for example 'motor.w=4000 rpm'.")
    return name.strip(), value.strip()


def by_name(pairs: Iterable[tuple[str, Given]], option: str) -> dict[str, Given]:
    """Return what the repeated option of a command gives, by name.

    Raises:
        DuplicateName: it gives the same name twice, of which one would count.
    """
    given: dict[str, Given] = {}
    for name, value in pairs:
        if name in given:
            lists = f"Give all its values at once: {option} {name}=0.1,0.2."
            raise DuplicateName(
                f"{option} gives {name} twice.", advice=lists if isinstance(value, list) else "Leave out one of them."
            )
        given[name] = value
    return given


def too_many(what: str) -> ValueOutOfRange:
    """Return the error about more runs than a sweep can have."""
    return ValueOutOfRange(f"{what}: a sweep has at most {MOST_RUNS} runs.", advice="Give fewer values.")


def read_range(text: str) -> tuple[str, list[Any]]:
    """Read `load=0:0.25:26 N.m` (first, last, count) or `load=0,0.1,0.2 N.m`; the unit counts for all.

    Raises:
        ValueOutOfRange: it is neither, or there are too many values.
    """
    name, values = read_assignment(text)
    numbers, _, unit = values.partition(" ")
    try:
        if numbers.count(":") == 2:
            first, last, count = numbers.split(":")
            if len(count) > _DIGITS or int(count) > MOST_RUNS:
                raise too_many(name)
            given = np.linspace(float(first), float(last), int(count)).tolist()
        else:
            given = [float(word) for word in numbers.split(",")]
    except ValueError:
        raise ValueOutOfRange(
            f"'{text}': '{values}' is neither FIRST:LAST:COUNT nor a list of numbers.",
            advice="Write for example 'load=0:0.25:26 N.m' or 'load=0,0.1,0.2 N.m'.",
        ) from None
    return name, [f"{value!r} {unit}" if unit.strip() else value for value in given]


def read_bounds(text: str) -> tuple[str, list[Any]]:
    """Read `clutch.capacity=20:120 N.m`; the unit counts for both.

    Raises:
        ValueOutOfRange: it is no pair of numbers.
    """
    name, values = read_assignment(text)
    numbers, _, unit = values.partition(" ")
    try:
        low, high = map(float, numbers.split(":"))
    except ValueError:
        raise ValueOutOfRange(
            f"'{text}': '{values}' is not LOW:HIGH.", advice="Write for example 'clutch.capacity=20:120 N.m'."
        ) from None
    return name, [f"{bound!r} {unit}" if unit.strip() else bound for bound in (low, high)]
