"""Declarations of a component type as tables of text, for pages in Markdown and for a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from modelica_like.language import Component, Connector, Discrete, Input, Output, Parameter, Variable
from modelica_like.language.fields import Field
from modelica_like.language.inside import declarations
from modelica_like.language.places import texts_of_fields

_SORTS = {
    "parameters": Parameter, "inputs": Input, "outputs": Output, "variables": Variable, "discrete values": Discrete,
}  # fmt: skip


class Listing(NamedTuple):
    """A table of text."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


class Notation(NamedTuple):
    """Formats of the cells of listings.

    Attributes:
        code: a name or a value as in netlists.
        text: a text.
        symbol: a variable as mathematics, by its path.
        flow: a variable of a connector, by its path, with its unit.
        missing: in place of a missing default.
    """

    code: Callable[[str], str]
    text: Callable[[str], str]
    symbol: Callable[[str], str]
    flow: Callable[[str, str], str]
    missing: Callable[[str], str]


def filled(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> Listing:
    """Return a listing without empty columns."""
    rows = list(rows)
    kept = [k for k in range(len(head)) if any(row[k] for row in rows)]
    return Listing(title, [head[k] for k in kept], [[row[k] for k in kept] for row in rows])


def declared(kind: type[Component], notation: Notation) -> list[Listing]:
    """Return listings of connectors, fields, structural fields and modes, without empty ones."""
    code, text = notation.code, notation.text
    listings = [
        filled(
            "connectors", ("name", "type", "potential, flow", "may be", "description"),
            (_connector_row(name, connector, notation) for name, connector in declarations(kind).connectors.items()),
        )
    ]  # fmt: skip
    for title, sort in _SORTS.items():
        fields = [field for field in declarations(kind).fields.values() if sort is _sort_of(field)]
        head = ("name", "symbol", "unit", "default", "range", "description")
        listings.append(filled(title, head, (_field_row(field, notation) for field in fields)))
    described = {name: table.description for name, table in declarations(kind).tables.items()}
    described |= {name: words for name, words in texts_of_fields(kind).items() if words}
    structure = (
        (
            code(name),
            code(str(default)) if isinstance(default, bool | int | float | str | tuple | None) else "required",
            text(described.get(name, "")),
        )
        for name, default in declarations(kind).structural.items()
    )
    listings.append(filled("structure", ("name", "default", "description"), structure))
    modes = (
        (code(name), ", ".join(f"{n} ({k})" for k, n in enumerate(mode.names)), mode.start, text(mode.description))
        for name, mode in declarations(kind).modes.items()
    )
    listings.append(filled("modes", ("name", "one of (number)", "start", "description"), modes))
    return [listing for listing in listings if listing.rows]


def _sort_of(field: Field) -> type[Field]:
    return next(sort for sort in _SORTS.values() if isinstance(field, sort))


def _connector_row(name: str, connector: Connector, notation: Notation) -> tuple[str, ...]:
    free = "optional" if connector.optional else "free" if connector.may_be_free else ""
    flows = ", ".join(notation.flow(f"{name}.{field.name}", field.unit_text) for field in connector.fields.values())
    return notation.code(name), type(connector).__name__, flows, free, notation.text(connector.description)


def _field_row(field: Field, notation: Notation) -> tuple[str, ...]:
    low, high = ("" if bound is None else f"{bound:g}" for bound in (field.min, field.max))
    if field.default is not None:
        default = f"{field.default:.9g}" if isinstance(field.default, float) else str(field.default)
    else:
        default = notation.missing(field.name) if isinstance(field, Parameter | Input) else ""
    return (
        notation.code(field.name), notation.symbol(field.name), notation.text(field.unit_text), notation.text(default),
        f"{low} … {high}".strip() if low or high else "", notation.text(field.description),
    )  # fmt: skip
