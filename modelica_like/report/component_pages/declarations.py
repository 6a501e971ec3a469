"""Tables of what a component type declares."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Mapping, Sequence
from textwrap import dedent
from typing import Any

from modelica_like.language import Component, Connector, Discrete, Input, Output, Parameter, Variable
from modelica_like.language.fields import Field
from modelica_like.report.component_pages import latex_names as names
from modelica_like.report.component_pages.markdown import cell, table
from modelica_like.report.types import freedom, sort_of, value_range

_SECTIONS = (
    ("Parameters", Parameter), ("Inputs", Input), ("Outputs", Output), ("Variables", Variable),
    ("Discrete values", Discrete),
)  # fmt: skip


def declarations(kind: type[Component], optional: Mapping[str, str]) -> list[str]:
    """Return tables of connectors, fields, structural fields and modes.

    Args:
        kind: the type.
        optional: what to say of parameters that are not always required.
    """
    connectors = (_connector_row(name, connector) for name, connector in kind._class_connectors.items())
    fields = list(kind._class_fields.values())
    modes = kind._class_modes.items()
    texts = _structure_descriptions(kind)
    described = dict.fromkeys(kind._structural, "") | {name: one.description for name, one in kind._tables.items()}
    described |= {name: text for name, text in texts.items() if text}
    structure = (
        (f"`{name}`", f"`{default}`" if has_default(default) else "required", cell(described[name]))
        for name, default in kind._structural.items()
    )
    return [
        table("Connectors", ("name", "type", "potential, flow", "", "description"), connectors),
        *(_field_table(title, [f for f in fields if sort_of(f) is sort], optional) for title, sort in _SECTIONS),
        table("Structure", ("name", "default", "description"), structure),
        table(
            "Modes",
            ("name", "one of", "start", "description"),
            ((f"`{n}`", ", ".join(mode.names), mode.start, cell(mode.description)) for n, mode in modes),
        ),
    ]


def has_default(default: Any) -> bool:
    """Tell whether a structural field has a default."""
    return isinstance(default, bool | int | float | str | tuple | None)


def _connector_row(name: str, connector: Connector) -> tuple[str, ...]:
    fields = ", ".join(
        f"${names.name(f'{name}.{field.name}')}$ in {field.unit_text}" for field in connector.fields.values()
    )
    return f"`{name}`", type(connector).__name__, fields, freedom(connector), cell(connector.description)


def _field_table(title: str, fields: Sequence[Field], optional: Mapping[str, str]) -> str:
    rows = (
        (
            f"`{field.name}`",
            f"${names.name(field.name)}$",
            cell(field.unit_text),
            _default(field, optional),
            value_range(field),
            cell(field.description),
        )
        for field in fields
    )
    return table(title, ("name", "symbol", "unit", "default", "range", "description"), rows)


def _default(field: Field, optional: Mapping[str, str]) -> str:
    if field.default is not None:
        return cell(f"{field.default:.9g}" if isinstance(field.default, float) else str(field.default))
    return optional.get(field.name, "required") if isinstance(field, Parameter | Input) else ""


def _structure_descriptions(kind: type[Component]) -> dict[str, str]:
    """Return the texts below the structural fields in the class bodies."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if issubclass(base, Component) and base is not Component:
            body = ast.parse(dedent(inspect.getsource(base))).body[0]
            assert isinstance(body, ast.ClassDef)
            for declared, below in zip(body.body, body.body[1:], strict=False):
                if isinstance(declared, ast.AnnAssign) and isinstance(declared.target, ast.Name):
                    found[declared.target.id] = _text_of(below)
    return found


def _text_of(statement: ast.stmt) -> str:
    """Return the text that a statement consists of, or nothing."""
    value = statement.value if isinstance(statement, ast.Expr) else None
    words = value.value if isinstance(value, ast.Constant) else ""
    return inspect.cleandoc(words) if isinstance(words, str) else ""
