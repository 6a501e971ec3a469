"""What a component type says with one optional thing more: a connector, a parameter, a structural field."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from modelica_like.errors import LanguageError
from modelica_like.language import Component
from modelica_like.report.component_pages.statements import Statements, Term, statements


def variants(kind: type[Component], structure: Mapping[str, Any], base: Statements) -> dict[str, Statements]:
    """Return what a type says with one optional thing more, by what that is, as far as it differs.

    Args:
        kind: the type.
        structure: values of structural fields.
        base: what it says without.
    """
    found: dict[str, Statements] = {}
    for name, connector in kind._class_connectors.items():
        if connector.optional:
            _add(found, f"`{name}` connected", base, kind, structure, used=frozenset({name}))
    for name in base.asked:
        _add(found, value_for(name), base, kind, structure, given=frozenset({name}))
    for name, default in kind._structural.items():
        if isinstance(default, bool):
            value = "false" if default else "true"
            _add(found, f"`{name} = {value}`", base, kind, {**structure, name: not default})
    return found


def value_for(name: str) -> str:
    """Return how a variant is called in which an optional parameter has a value."""
    return f"a value for `{name}`"


def _add(
    found: dict[str, Statements], what: str, base: Statements, kind: type[Component], structure: Mapping[str, Any],
    **options: Any,
) -> None:  # fmt: skip
    try:
        other = statements(kind, structure, **options)
    except LanguageError:  # the class itself says that this alone means nothing
        return
    different = _difference(other, base)
    if any((different.equations, different.definitions, different.events, different.energy, different.parts)):
        found[what] = different


def _difference(other: Statements, base: Statements) -> Statements:
    """Return what one has and another has not."""
    energy = {name: term for name, term in other.energy.items() if base.energy.get(name) != term}
    energy |= {name: Term(term.left, "0") for name, term in base.energy.items() if name not in other.energy}
    rest = {
        name: tuple(one for one in getattr(other, name) if one not in getattr(base, name))
        for name in ("equations", "definitions", "events", "connections", "parts")
    }
    return replace(other, energy=energy, asked=(), **rest)
