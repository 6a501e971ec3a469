"""The form of the sections [optimize] and [tolerances] of a netlist."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from modelica_like.errors import NetlistError

_MOST = 10_000


def _texts(key: str, value: Any) -> tuple[str, ...]:
    texts = [value] if isinstance(value, str) else value
    if not isinstance(texts, list) or not texts or not all(isinstance(text, str) for text in texts):
        raise NetlistError(f'{key} must be a text or a list of texts, such as "max(shaft.tau)".')
    return tuple(texts)


def _by_path(key: str, value: Any, before: str = "") -> dict[str, Any]:
    """Return entries by path: dotted keys are tables in tables, up to a list, a text, or the table of a profile."""
    if not isinstance(value, dict):
        raise NetlistError(f"{key} must be a table by parameter.")
    entries: dict[str, Any] = {}
    for name, entry in value.items():
        path = f"{before}{name}"
        inner = isinstance(entry, dict) and "from" not in entry and "to" not in entry
        entries |= _by_path(key, entry, f"{path}.") if inner else {path: entry}
    return entries


def _free(key: str, value: Any) -> dict[str, Any]:
    entries = _by_path(key, value)
    for path, entry in entries.items():
        if not isinstance(entry, dict) and not (isinstance(entry, list) and len(entry) == 2):
            raise NetlistError(
                f"{key}.{path} must be the lower and the upper bound.",
                advice='Write ["20 N.m", "120 N.m"], or of a table { points = 12, from = "0 N", to = "9 kN" }.',
            )
    return entries


def _choose(key: str, value: Any) -> dict[str, Any]:
    entries = _by_path(key, value)
    for path, entry in entries.items():
        if not isinstance(entry, str) and not (isinstance(entry, list) and entry):
            raise NetlistError(
                f"{key}.{path} must be a list of values, or the name of a table.",
                advice='Write [2, 4, 6], or "motors.csv" with a column for each parameter.',
            )
    return entries


def _cases(key: str, value: Any) -> tuple[dict[str, Any], ...]:
    if not isinstance(value, list) or not value or not all(isinstance(table, dict) for table in value):
        raise NetlistError(
            f"{key} must be a list of load cases.", advice='Write [{ name = "cold", "oil.T" = "-20 degC" }].'
        )
    return tuple(_by_path(key, table) for table in value)


def _count(key: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= _MOST:
        raise NetlistError(f"{key} = {value} must be a whole number from 1 to {_MOST}.")
    return value


OPTIMIZE: Mapping[str, Callable[[str, Any], Any]] = {
    "minimize": _texts, "maximize": _texts, "free": _free, "choose": _choose, "subject_to": _texts, "for": _cases,
    "starts": _count, "points": _count,
}  # fmt: skip
"""Checks of its entries."""


def tolerances(key: str, value: Any) -> dict[str, Any]:
    """Return [tolerances]: a text by path, and the list `correlated`.

    Raises:
        NetlistError: an entry is no text, or `correlated` no list of tables.
    """
    given = dict(value) if isinstance(value, dict) else value
    pairs = given.pop("correlated", []) if isinstance(given, dict) else []
    entries = _by_path(key, given)
    for path, entry in entries.items():
        if not isinstance(entry, str):
            raise NetlistError(
                f"{key}.{path} must be a text.", advice='Write "±10 %", "normal(20 N.m, 1 N.m)" or "uniform(1, 2)".'
            )
    if not isinstance(pairs, list) or not all(isinstance(table, dict) for table in pairs):
        raise NetlistError(
            f"{key}.correlated must be a list of tables.", advice='Write [{ of = ["a", "b"], rho = 0.8 }].'
        )
    return {**entries, **({"correlated": pairs} if pairs else {})}
