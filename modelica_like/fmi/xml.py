"""XML texts for people and validators: one variable per line, always the same bytes."""

from __future__ import annotations

import re
from functools import cache

from modelica_like.language.units import ANY, ONE, Unit

INLINE = ("ScalarVariable", "Float64", "Unit")
"""Elements that are written on one line with their content."""
_ESCAPED = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"}
_PLAIN = re.compile(r"[ !#-%'-;=?-~]*")


class Element:
    """An element: its tag with attributes as text, and its content."""

    __slots__ = ("head", "inner", "tag")

    def __init__(self, tag: str, attributes: dict[str, object]) -> None:
        texts = [f' {name}="{_text(value)}"' for name, value in attributes.items() if value is not None]
        self.tag, self.head = tag, f"<{tag}{''.join(texts)}"
        self.inner: list[Element] | None = None  # most are empty: no list needed


def element(parent: Element, tag: str, /, **attributes: object) -> Element:
    """Append an element; attributes that are None are left out, numbers are written so that they read back exactly."""
    child = Element(tag, attributes)
    if parent.inner is None:
        parent.inner = []
    parent.inner.append(child)
    return child


def document(top: Element) -> str:
    """Write a document, with one line per element; variables and units are on one line each."""
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + "".join(_lines(top, "", "\n"))


def _lines(element: Element, indent: str, end: str) -> list[str]:
    if not element.inner:
        return [f"{indent}{element.head}/>{end}"]
    inside = ("", "") if not end or element.tag in INLINE else (f"{indent}  ", end)
    inner = [line for child in element.inner for line in _lines(child, *inside)]
    return [f"{indent}{element.head}>{inside[1]}", *inner, f"{indent if inside[1] else ''}</{element.tag}>{end}"]


def _text(value: object) -> str:
    if isinstance(value, str):
        return value if _PLAIN.fullmatch(value) else "".join(map(_character, value))
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value + 0.0)  # no negative zero
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def _character(character: str) -> str:
    """Control characters are not valid in XML."""
    return _ESCAPED.get(character, character) if character.isprintable() else " "


@cache
def unit_name(unit: Unit) -> str | None:
    """Return the name of a unit in a description, or None for a plain number."""
    return None if unit in (ONE, ANY) else str(unit)
