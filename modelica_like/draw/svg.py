"""A schematic as SVG: plain attributes for every renderer, and dark colours for browsers in dark mode."""

from __future__ import annotations

from collections.abc import Iterator
from xml.sax.saxutils import escape

from modelica_like.draw.labels import NAME, VALUE, Text
from modelica_like.draw.sheet import TITLE, Line, Placed, Point, Sheet, texts
from modelica_like.language.icon import Icon, Stroke

_INK, _PAPER, _STEEL, _GREY, _FRAME = "#1f2937", "#ffffff", "#cbd5e1", "#6b7280", "#f5f7fa"
_DARK = {"ink": "#d7dde6", "paper": "#151a21", "steel": "#475569", "grey": "#9aa5b4", "frame": "#1d232c"}
_MARGIN = 16.0
_FONT = "Helvetica, Arial, 'Liberation Sans', sans-serif"


def svg(drawn: Sheet, title: str, *, background: bool = True) -> str:
    """Return a sheet as SVG text; the same sheet gives the same bytes.

    Args:
        drawn: what to draw.
        title: for screen readers.
        background: whether to fill the paper.
    """
    width, height = drawn.width + 2 * _MARGIN, drawn.height + 2 * _MARGIN
    strokes = {item.stroke.name: item.stroke for _, item in drawn.everything() if isinstance(item, Line)}
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_n(width)}" height="{_n(height)}" '
        f'viewBox="0 0 {_n(width)} {_n(height)}" font-family="{_FONT}">',
        f"<title>{escape(title)}</title>",
        _dark(strokes),
    ]
    if background:
        parts.append(f'<rect class="paper" width="{_n(width)}" height="{_n(height)}" fill="{_PAPER}"/>')
    everything = [((x + _MARGIN, y + _MARGIN), item) for (x, y), item in drawn.everything()]
    parts += [_frame(at, item) for at, item in everything if isinstance(item, Placed) and item.sheet]
    for at, item in everything:
        if isinstance(item, Line):
            parts += _line(at, item)
    for at, item in everything:
        if isinstance(item, Placed) and not item.node.border:
            parts += _part(at, item)
    return "\n".join([*parts, "</svg>", ""])


def _n(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}"


def _dark(strokes: dict[str, Stroke]) -> str:
    rules = [f".{key}{{fill:{colour}}}.{key}-line{{stroke:{colour}}}" for key, colour in _DARK.items()]
    rules += [f".{_css(one)}{{stroke:{one.dark}}}.{_css(one)}-dot{{fill:{one.dark}}}" for one in strokes.values()]
    return f"<style>@media (prefers-color-scheme: dark){{{''.join(rules)}}}</style>"


def _css(stroke: Stroke) -> str:
    return f"on-{stroke.name.replace(' ', '-')}"


def _frame(at: Point, part: Placed) -> str:
    x, y = at[0] + part.at[0] - part.half[0], at[1] + part.at[1] - part.half[1]
    title = Text(part.node.name, (x + 10.0, y + TITLE - 8.0), NAME, "start")
    return (
        f'<rect class="frame grey-line" x="{_n(x)}" y="{_n(y)}" width="{_n(2 * part.half[0])}" '
        f'height="{_n(2 * part.half[1])}" rx="8" fill="{_FRAME}" stroke="{_GREY}" stroke-dasharray="6 4"/>'
        + _text(title)
    )


def _line(at: Point, line: Line) -> Iterator[str]:
    stroke = line.stroke
    data = " ".join(
        "M" + " L".join(f"{_n(at[0] + x)} {_n(at[1] + y)}" for x, y in path) for path in line.paths if len({*path}) > 1
    )
    dashes = ' stroke-dasharray="5 3"' if stroke.dashed else ""
    yield (
        f'<path class="{_css(stroke)}" d="{data}" fill="none" stroke="{stroke.colour}" '
        f'stroke-width="{_n(stroke.width)}" stroke-linecap="{"butt" if stroke.dashed else "round"}" '
        f'stroke-linejoin="round"{dashes}/>'
    )
    for x, y in line.dots:
        yield (
            f'<circle class="{_css(stroke)}-dot" cx="{_n(at[0] + x)}" cy="{_n(at[1] + y)}" '
            f'r="{_n(stroke.width + 1.0)}" fill="{stroke.colour}"/>'
        )
    for (x, y), way in line.arrows:
        turn = {"E": 0, "S": 90, "W": 180, "N": 270}[way]
        yield (
            f'<path class="{_css(stroke)}-dot" d="M0 0 L-8 -4 L-8 4 Z" fill="{stroke.colour}" '
            f'transform="translate({_n(at[0] + x)} {_n(at[1] + y)}) rotate({turn})"/>'
        )


def _part(at: Point, part: Placed) -> Iterator[str]:
    node, (x, y), (half_x, half_y) = part.node, (at[0] + part.at[0], at[1] + part.at[1]), part.half
    yield f'<g transform="translate({_n(x)} {_n(y)})">'
    kind = type(node.component).__name__
    yield f"<title>{escape(f'{node.name}: {kind}')}</title>"
    if node.icon:
        yield from icon_shapes(node.icon, turned=node.turned)
    elif not part.sheet:
        yield (
            f'<rect class="paper ink-line" x="{_n(-half_x)}" y="{_n(-half_y)}" width="{_n(2 * half_x)}" '
            f'height="{_n(2 * half_y)}" rx="4" fill="{_PAPER}" stroke="{_INK}" stroke-width="1.5"/>'
        )
    for port in node.ports.values():
        if port.mark:
            yield from _mark(part, port.side, port.along, port.mark, port.stroke)
    for one in texts(part):
        yield _text(one)
    yield "</g>"


def _text(one: Text) -> str:
    fill = _GREY if one.size == VALUE else _INK
    bold = "" if one.size == VALUE else ' font-weight="bold"'
    return (
        f'<text class="{"grey" if one.size == VALUE else "ink"}" x="{_n(one.at[0])}" y="{_n(one.at[1])}" fill="{fill}" '
        f'font-size="{_n(one.size)}" text-anchor="{one.anchor}"{bold}>{escape(one.text)}</text>'
    )


def _mark(part: Placed, side: str, along: float, icon: Icon, stroke: Stroke) -> Iterator[str]:
    half_x, half_y = part.half
    x, y = (along, half_y) if side != "N" else (along, -half_y)
    if side in ("W", "E"):
        sign = 1 if side == "E" else -1
        x, y = sign * (half_x + 9.0), along
        yield (
            f'<path class="{_css(stroke)}" d="M{_n(sign * half_x)} {_n(y)} L{_n(x)} {_n(y)}" fill="none" '
            f'stroke="{stroke.colour}" stroke-width="{_n(stroke.width)}"/>'
        )
    yield f'<g transform="translate({_n(x)} {_n(y)})">'
    yield from icon_shapes(icon)
    yield "</g>"


def icon_shapes(icon: Icon, *, turned: bool = False) -> Iterator[str]:
    """Yield the shapes of an icon around (0, 0)."""
    turn = ' transform="scale(-1 1)"' if turned else ""
    for data, classes, fill, width in (
        (icon.paper, "paper ink-line", _PAPER, 1.75),
        (icon.solid, "steel ink-line", _STEEL, 1.75),
        (icon.lines, "ink-line", "none", 1.75),
        (icon.heavy, "ink-line", "none", 3.5),
    ):
        if data:
            yield (
                f'<path class="{classes}" d="{data}" fill="{fill}" stroke="{_INK}" stroke-width="{width}" '
                f'stroke-linecap="round" stroke-linejoin="round"{turn}/>'
            )
    if icon.text:
        yield _text(Text(icon.text, (0.0, 5.0), 14.0))
