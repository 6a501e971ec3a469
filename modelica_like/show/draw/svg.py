"""A schematic as SVG: plain attributes for every renderer, and dark colours for browsers in dark mode."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from xml.sax import saxutils

from modelica_like.language.component import Component
from modelica_like.language.icon import Icon, Stroke
from modelica_like.show.draw.diagram import Port, find_entry
from modelica_like.show.draw.figures import DARK, figures
from modelica_like.show.draw.handles import end_handles, line_handle, part_attributes
from modelica_like.show.draw.labels import NAME, VALUE, Text, meet
from modelica_like.show.draw.running import HELD, OPEN, SLIDES, Running
from modelica_like.show.draw.shapes import Shape
from modelica_like.show.draw.sheet import TITLE, Line, Placed, Point, Sheet, texts

_INK, _PAPER, _STEEL, _GREY, _FRAME = "#1f2937", "#ffffff", "#cbd5e1", "#6b7280", "#f5f7fa"
_DARK = {"ink": "#d7dde6", "paper": "#151a21", "steel": "#475569", "grey": "#9aa5b4", "frame": "#1d232c"}
_LOOKS = {HELD: ("#15803d", "#4ade80"), OPEN: ("#94a3b8", "#64748b"), SLIDES: ("#c2410c", "#fb923c")}
"""Colours of modes: in light, in dark."""
_CYCLE = 'dur="8s" repeatCount="indefinite"'
_MARGIN = 16.0
_STRIP, _SWING = 96.0, 24.0
"""Height of a mode shape with its heading, and largest deviation."""
_FONT = "Helvetica, Arial, 'Liberation Sans', sans-serif"


def _escaped(text: str) -> str:
    """Return text for XML, which has no control characters: a name or a value may have some."""
    return saxutils.escape("".join(character if character.isprintable() else " " for character in text))


def svg(
    drawn: Sheet, title: str, *, background: bool = True, run: Running | None = None, shapes: Sequence[Shape] = (),
    handles: bool = False,
) -> str:  # fmt: skip
    """Return a sheet as SVG text; the same sheet gives the same bytes.

    Args:
        drawn: what to draw.
        title: for screen readers.
        background: whether to fill the paper.
        run: what a run adds.
        shapes: of modes, drawn below.
        handles: name parts, ends and lines in data attributes, for a page in which they are edited.
    """
    run = run or Running()
    width, below = drawn.width + 2 * _MARGIN, drawn.height + 2 * _MARGIN
    height = below + _STRIP * len(shapes)
    strokes = {item.stroke.name: item.stroke for _, item in drawn.everything() if isinstance(item, Line)}
    dark = _DARK | {name: colour for name, (_, colour) in _LOOKS.items() if run.modes}
    rules = [f".{key}{{fill:{colour}}}.{key}-line{{stroke:{colour}}}" for key, colour in dark.items()]
    icons = [item.node.icon for _, item in drawn.everything() if isinstance(item, Placed)]
    rules += [DARK] if any(icon and icon.figures for icon in icons) else []
    rules += [f".{_css(s)}{{stroke:{s.dark}}}.{_css(s)}-dot{{fill:{s.dark}}}" for s in strokes.values()]
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_n(width)}" height="{_n(height)}" '
        f'viewBox="0 0 {_n(width)} {_n(height)}" font-family="{_FONT}">',
        f"<title>{_escaped(title)}</title>",
        f"<style>@media (prefers-color-scheme: dark){{{''.join(rules)}}}</style>",
    ]
    if background:
        parts.append(f'<rect class="paper" width="{_n(width)}" height="{_n(height)}" fill="{_PAPER}"/>')
    everything = [((x + _MARGIN, y + _MARGIN), item) for (x, y), item in drawn.everything()]
    parts += [_frame(at, item) for at, item in everything if isinstance(item, Placed) and item.sheet]
    for at, item in everything:
        if isinstance(item, Line):
            parts += [*_line(at, item, run), *([line_handle(at, item)] if handles else [])]
    joined = {port for _, item in everything if isinstance(item, Line) for port in item.ports}
    for at, item in everything:
        if isinstance(item, Placed) and not item.node.border:
            parts += _part(at, item, run, joined if handles else None)
    for k, shape in enumerate(shapes):
        parts += _shape(shape, below + _STRIP * k, width)
    parts += _clock(width, height, run) if run.moving else []
    return "\n".join([*parts, "</svg>", ""])


def _n(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}"


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


def _line(at: Point, line: Line, run: Running) -> Iterator[str]:
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
    for (x1, y1), (x2, y2), power in run.powers.get(line, ()):
        yield (
            f'<path class="{_css(stroke)}" d="M{_n(at[0] + x1)} {_n(at[1] + y1)} L{_n(at[0] + x2)} {_n(at[1] + y2)}" '
            f'stroke="{stroke.colour}" stroke-width="{_n(run.width(line, power))}" stroke-linecap="round"/>'
        )
    for x, y in line.dots:
        yield (
            f'<circle class="{_css(stroke)}-dot" cx="{_n(at[0] + x)}" cy="{_n(at[1] + y)}" '
            f'r="{_n(stroke.width + 1.0)}" fill="{stroke.colour}"/>'
        )
    for text in run.said.get(line, ()):
        yield _text(replace(text, at=(at[0] + text.at[0], at[1] + text.at[1])))
    for (x, y), way in line.arrows:
        turn = {"E": 0, "S": 90, "W": 180, "N": 270}[way]
        yield (
            f'<path class="{_css(stroke)}-dot" d="M0 0 L-8 -4 L-8 4 Z" fill="{stroke.colour}" '
            f'transform="translate({_n(at[0] + x)} {_n(at[1] + y)}) rotate({turn})"/>'
        )


def _part(at: Point, part: Placed, run: Running, joined: Collection[Port] | None) -> Iterator[str]:
    node, (x, y), (half_x, half_y) = part.node, (at[0] + part.at[0], at[1] + part.at[1]), part.half
    about = f"{node.name}: {type(node.component).__name__}"
    taken = part_attributes(node, about) if joined is not None else ""
    yield f'<g{taken} transform="translate({_n(x)} {_n(y)})"><title>{_escaped(about)}</title>'
    if joined is not None:
        yield (
            f'<rect class="hold" x="{_n(part.room[0])}" y="{_n(part.room[1])}" rx="8" fill="transparent" '
            f'width="{_n(part.room[2] - part.room[0])}" height="{_n(part.room[3] - part.room[1])}"/>'
        )
    if node.icon and (looks := run.modes.get(node)):
        yield from _looks(node.icon, looks, run, half_y, turned=node.turned)
    elif node.icon:
        yield from icon_shapes(node.icon, turned=node.turned, component=node.component)
    elif not part.sheet:
        yield (
            f'<rect class="paper ink-line" x="{_n(-half_x)}" y="{_n(-half_y)}" width="{_n(2 * half_x)}" '
            f'height="{_n(2 * half_y)}" rx="4" fill="{_PAPER}" stroke="{_INK}" stroke-width="1.5"/>'
        )
    for port in node.ports.values():
        yield from _inwards(part, port)
        if port.mark:
            yield from _mark(part, port.side, port.along, port.mark, port.stroke)
    for text in texts(part):
        yield _text(text)
    yield from end_handles(part, joined) if joined is not None else ()
    yield "</g>"


def _inwards(part: Placed, port: Port) -> Iterator[str]:
    """The line of a port from the side of its symbol to where it ends inside."""
    node = part.node
    tip = find_entry(node.icon.tips, port.name) if node.icon else None
    if tip is None or (node.turned and port.signal):
        return
    (half_x, half_y), x, y = part.half, -tip[0] if node.turned else tip[0], tip[1]
    begin = {
        "W": (-half_x, port.along),
        "E": (half_x, port.along),
        "N": (port.along, -half_y),
        "S": (port.along, half_y),
    }
    (x0, y0), stroke = begin[port.side], port.stroke
    corner = (x, y0) if port.side in ("W", "E") else (x0, y)
    if (x0, y0) != (x, y):
        yield (
            f'<path class="{_css(stroke)}" d="M{_n(x0)} {_n(y0)} L{_n(corner[0])} {_n(corner[1])} L{_n(x)} {_n(y)}" '
            f'fill="none" stroke="{stroke.colour}" stroke-width="{_n(stroke.width)}"/>'
        )


def _shape(shape: Shape, top: float, width: float) -> Iterator[str]:
    """A mode over the places of the sheet: thick where a shaft is rigid, thin across what lies between."""
    zero = top + _STRIP - _SWING - 20.0
    yield _text(Text(shape.title, (_MARGIN, top + 10.0), NAME, "start"))
    yield (
        f'<path class="grey-line" d="M{_n(_MARGIN)} {_n(zero)} H{_n(width - _MARGIN)}" stroke="{_GREY}" '
        f'stroke-width="0.75" stroke-dasharray="2 3"/>'
    )
    written = list[Text]()
    for stretch in shape.stretches:
        (x1, y1), (x2, y2) = ((_MARGIN + x, zero - _SWING * y) for x, y in (stretch.begin, stretch.end))
        yield (
            f'<path class="{_css(stretch.stroke)}" d="M{_n(x1)} {_n(y1)} L{_n(x2)} {_n(y2)}" '
            f'stroke="{stretch.stroke.colour}" stroke-width="{_n(3.5 if stretch.rigid else 1.25)}" '
            'stroke-linecap="round"/>'
        )
        said = Text(stretch.said, ((x1 + x2) / 2, y1 + (14.0 if y1 > zero else -5.0)), VALUE)
        # Branches lie above one another: the first number stays.
        if stretch.said and not any(meet(said.box, other.box) for other in written):
            written.append(said)
            yield _text(said)


def _text(text: Text, look: str = "") -> str:
    kind = look or ("grey" if text.size == VALUE else "ink")
    fill = _LOOKS[look][0] if look else _GREY if text.size == VALUE else _INK
    bold = "" if text.size == VALUE else ' font-weight="bold"'
    return (
        f'<text class="{kind}" x="{_n(text.at[0])}" y="{_n(text.at[1])}" fill="{fill}" '
        f'font-size="{_n(text.size)}" text-anchor="{text.anchor}"{bold}>{_escaped(text.text)}</text>'
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


def _looks(
    icon: Icon, looks: Sequence[tuple[float, str, str]], run: Running, half: float, *, turned: bool
) -> Iterator[str]:
    """A symbol in the colour of its mode, with the mode's name; of a whole run one after the other."""
    for look, name in dict.fromkeys((look, name) for _, look, name in looks):
        if run.moving:
            times = [0.0, *(min(time / run.end, 1.0) for time, *_ in looks[1:])]
            shown = ["visible" if x[1:] == (look, name) else "hidden" for x in looks]
            yield (
                f'<g visibility="{shown[0]}"><animate attributeName="visibility" calcMode="discrete" '
                f'values="{";".join(shown)}" keyTimes="{";".join(_n(time) for time in times)}" {_CYCLE}/>'
            )
        yield from icon_shapes(icon, turned=turned, ink=look)
        yield _text(Text(name, (9.0, -half - 4.0), VALUE, "start"), look)
        yield "</g>" if run.moving else ""


def _clock(width: float, height: float, run: Running) -> Iterator[str]:
    """A bar that grows with time."""
    y, long = height - 6.0, width - 2 * _MARGIN - 70.0
    yield (
        f'<rect class="grey" x="{_n(_MARGIN)}" y="{_n(y - 4.0)}" width="0" height="3" fill="{_GREY}">'
        f'<animate attributeName="width" from="0" to="{_n(long)}" {_CYCLE}/></rect>'
    )
    yield _text(Text(f"{run.end:.4g} s", (width - _MARGIN, y), VALUE, "end"))


def icon_shapes(
    icon: Icon, *, turned: bool = False, ink: str = "ink", component: Component | None = None
) -> Iterator[str]:
    """Yield the shapes of an icon around (0, 0).

    Args:
        icon: the icon.
        turned: whether west and east are exchanged.
        ink: `ink`, or how a mode looks.
        component: whose values the texts of its figures show.
    """
    colour = _LOOKS.get(ink, (_INK, ""))[0]
    turn = ' transform="scale(-1 1)"' if turned else ""
    for data, classes, fill, width in (
        (icon.paper, f"paper {ink}-line", _PAPER, 1.75),
        (icon.solid, f"steel {ink}-line", _STEEL, 1.75),
        (icon.lines, f"{ink}-line", "none", 1.75),
        (icon.heavy, f"{ink}-line", "none", 3.5),
    ):
        if data:
            yield (
                f'<path class="{classes}" d="{data}" fill="{fill}" stroke="{colour}" stroke-width="{width}" '
                f'stroke-linecap="round" stroke-linejoin="round"{turn}/>'
            )
    if icon.figures:
        yield from figures(icon.figures, component, turned=turned)
    if icon.text:
        yield _text(Text(icon.text, (0.0, 5.0), 14.0))
