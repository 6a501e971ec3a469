"""Coloured shapes of symbols as SVG."""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.sax import saxutils

from modelica_like.language.component import Component
from modelica_like.language.icon import Figure
from modelica_like.show.draw.labels import text_width, told

DARK = ".drawn{filter:invert(0.9) hue-rotate(180deg)}"
"""They are drawn for white paper: in dark mode bright and dark are exchanged, and hues stay."""
_AXES = {"across": ("0", "0", "0", "1"), "along": ("0", "0", "1", "0")}
_PARAMETER = re.compile(r"%(?:%|\{?(\w+)\}?)")


def figures(drawn: tuple[Figure, ...], component: Component | None, *, turned: bool) -> Iterator[str]:
    """Yield the shapes of a symbol around (0, 0).

    Args:
        drawn: the shapes.
        component: whose values texts show.
        turned: whether west and east are exchanged; texts stay as they can be read.
    """
    yield '<g class="drawn">'
    mirror = ' transform="scale(-1 1)"' if turned else ""
    for figure in drawn:
        if figure.text:
            yield _text(figure, component, -1.0 if turned else 1.0)
            continue
        fill = figure.fill or "none"
        if figure.shade:
            name = f"{figure.shade}-{figure.line[1:]}-{figure.fill[1:]}"
            yield _gradient(name, figure)
            fill = f"url(#{name})"
        outline = f'stroke="{figure.line}" stroke-width="{figure.width:g}"' if figure.line and figure.width else ""
        outline += f' stroke-dasharray="{figure.dashes}"' if outline and figure.dashes else ""
        yield f'<path d="{figure.data}" fill="{fill}" {outline} stroke-linejoin="round"{mirror}/>'
    yield "</g>"


def _gradient(name: str, figure: Figure) -> str:
    """Return how a cylinder or a ball is shaded; two of one name are alike."""
    edge, middle = (f'stop-color="{colour}"' for colour in (figure.line, figure.fill))
    if figure.shade == "round":
        stops = f'<stop offset="0" {middle}/><stop offset="1" {edge}/>'
        return f'<radialGradient id="{name}">{stops}</radialGradient>'
    ends = dict(zip(("x1", "y1", "x2", "y2"), _AXES[figure.shade], strict=True))
    axis = " ".join(f'{key}="{value}"' for key, value in ends.items())
    stops = f'<stop offset="0" {edge}/><stop offset="0.5" {middle}/><stop offset="1" {edge}/>'
    return f'<linearGradient id="{name}" {axis}>{stops}</linearGradient>'


def _text(figure: Figure, component: Component | None, side: float) -> str:
    """Return letters as large as their room allows."""
    words = _PARAMETER.sub(lambda match: _value(match[1], component), figure.text)
    words = "".join(letter if letter.isprintable() else " " for letter in words)
    wide, high = figure.size
    size = min(high, wide / max(text_width(words, 1.0), 1e-9))
    x, y = side * figure.at[0], figure.at[1]
    turn = f' transform="rotate({figure.turn:g} {x:.4g} {y:.4g})"' if figure.turn else ""
    # Letters stand 0.35 of their size below their middle.
    return (
        f'<text x="{x:.4g}" y="{y + 0.35 * size:.4g}" fill="{figure.line}" font-size="{size:.3g}" '
        f'text-anchor="middle"{turn}>{saxutils.escape(words)}</text>'
    )


def _value(name: str | None, component: Component | None) -> str:
    if name is None:
        return "%"
    if component is None or name not in component.fields:
        return name
    value = component.value(name)
    return name if value is None else told(value.given)
