"""XML texts that people and validators can read: one variable per line, always the same bytes."""

from __future__ import annotations

from functools import cache
from typing import Any

import lxml.etree as etree

from modelica_like.units import ANY, ONE, Unit

INLINE = ("ScalarVariable", "Float64", "Unit")
"""Elements that stand in one line with all that is in them."""


def element(parent: Any, tag: str, /, **attributes: object) -> Any:
    """Append an element; attributes that are None are left out, numbers are written so that they read back exactly."""
    texts = {name: _text(value) for name, value in attributes.items() if value is not None}
    return etree.SubElement(parent, tag, texts)


def root(tag: str, /, **attributes: object) -> Any:
    """Begin a document."""
    return etree.Element(tag, {name: _text(value) for name, value in attributes.items() if value is not None})


def document(top: Any) -> str:
    """Write a document, with one line per element; variables and units stand in one line."""
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + "".join(_lines(top, ""))


def _lines(one: Any, indent: str) -> list[str]:
    if len(one) == 0 or one.tag in INLINE:
        return [f"{indent}{etree.tostring(one, encoding='unicode')}\n"]
    empty = etree.Element(one.tag, dict(one.attrib))
    opening = etree.tostring(empty, encoding="unicode").removesuffix("/>") + ">"
    inner = [line for child in one for line in _lines(child, indent + "  ")]
    return [f"{indent}{opening}\n", *inner, f"{indent}</{one.tag}>\n"]


def _text(value: object) -> str:
    if isinstance(value, str):  # control characters are no XML
        return value if value.isprintable() else "".join(c if c.isprintable() else " " for c in value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value + 0.0)  # no negative zero
    if isinstance(value, list | tuple):
        return " ".join(map(_text, value))
    return str(value)


@cache
def unit_name(unit: Unit) -> str | None:
    """Return the name of a unit in a description, or None for a plain number."""
    return None if unit in (ONE, ANY) else str(unit)


def number(value: float | None, *, whole: bool = False) -> int | float | None:
    """Return a number for an attribute, as a whole one for integers."""
    return None if value is None else int(value) if whole else float(value)
