"""Symbols of the annotations of classes: `Icon(graphics = {…})`, and where connectors have their place."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

from modelica_like.errors import ModelicaLikeError
from modelica_like.language.icon import Figure, Icon, Side
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.instance import Instance
from modelica_like.netlist.modelica.parse import parse_tokens
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tokens import Token
from modelica_like.netlist.modelica.tree import ClassText, Declaration, Expr, calls_in, names_in

_LARGE = 56.0
"""Length of the longer side of a symbol, in 1/96 inch: about that of the symbols of components."""
_THICK = 4.0
"""Width of a line in 1/96 inch by its thickness in mm: that of 0.25 mm is one."""
_DASHES = {"Dash": "5 3", "Dot": "1.5 2", "DashDot": "5 2 1.5 2", "DashDotDot": "5 2 1.5 2 1.5 2"}
_SHADES: dict[str, Any] = {"HorizontalCylinder": "across", "VerticalCylinder": "along", "Sphere": "round"}
_VALUE = re.compile(r"%(?!name\b|class\b)(\w+)|%\{(\w+)\}")
_MIDDLE = 0.3
"""A connector within this part of the size stands in the middle: its line leaves where one of its name does."""
_LEAST = 12.0
"""Half the size of the smallest symbol."""
_BESIDE = 0.75
"""Texts beyond this part of the height stand beside a symbol, where names and values have a place of their own."""
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Sheet:
    """Coordinates of a class: their middle, half the sizes, 1/96 inch per unit, and the places that were drawn."""

    middle: Point
    half: Point
    scale: float
    drawn: list[Point] = field(default_factory=list[Point])

    def at(self, point: Point) -> Point:
        """Return a place around the middle, with y downwards."""
        place = (point[0] - self.middle[0]) * self.scale, (self.middle[1] - point[1]) * self.scale
        self.drawn.append(place)
        return place


@dataclass(frozen=True, slots=True)
class _Drawn:
    """What classes draw, whatever their parameters are: the shapes with their conditions and whose text has these."""

    icon: Icon
    shapes: list[tuple[Any, tuple[Figure, ...], ClassText]]


def icon_of(instance: Instance) -> Icon | None:
    """Return the symbol of an instance: the shapes of its bases, then those of its class; None if there are none.

    What cannot be read of an annotation is left out: a picture changes no result.

    Args:
        instance: its parameters decide which shapes are visible.
    """
    if instance.text.kind in ("record", "connector") or not any(text.icon for text in instance.lineage):
        return None
    key = tuple(map(id, instance.lineage))
    if key not in instance.classes.drawn:
        instance.classes.drawn[key] = _drawn(instance)
    drawn: _Drawn = instance.classes.drawn[key]
    if all(visible is True for visible, _, _ in drawn.shapes):
        return drawn.icon if drawn.shapes else None
    shown = [figures for visible, figures, text in drawn.shapes if _is_visible(visible, instance, text)]
    figures = tuple(figure for each in shown for figure in each)
    return replace(drawn.icon, figures=figures) if figures else None


def _is_visible(visible: Any, instance: Instance, text: ClassText) -> bool:
    if not isinstance(visible, Expr):
        return visible is not False
    with suppress(ModelicaLikeError):
        return Resolver(instance, text, numeric=True)(visible).args != (False,)
    return True


def _drawn(instance: Instance) -> _Drawn:
    layers = [(text, _annotation(text.icon)) for text in instance.lineage if text.icon]
    boxes = [box for _, layer in layers if (box := _box(_dict(layer.get("coordinateSystem")).get("extent")))]
    (west, low), (east, high) = boxes[-1] if boxes else ((-100.0, -100.0), (100.0, 100.0))
    half = max(abs(east - west) / 2, 1.0), max(abs(high - low) / 2, 1.0)  # one unit where there is no extent
    sheet = _Sheet(((west + east) / 2, (low + high) / 2), half, _LARGE / (2 * max(half)))
    shapes: list[tuple[Any, tuple[Figure, ...], ClassText]] = []
    keys: list[str] = []
    for text, layer in layers:
        for given in _tuple(layer.get("graphics")):
            shape = _dict(given)
            if shape.get("") == "Text" and _is_beside(shape, sheet):
                keys += [one or other for one, other in _VALUE.findall(str(shape.get("textString", "")))]
            elif figures := _figures(shape, sheet):
                shapes.append((shape.get("visible", True), figures, text))
    figures = tuple(figure for _, each, _ in shapes for figure in each)
    ports = [*_ports(instance, sheet)]
    places, tips = {name: place for name, place, _ in ports if place}, {name: tip for name, _, tip in ports}
    wide, high = (2 * max([_LEAST, *(abs(place[k]) for place in sheet.drawn)]) for k in (0, 1))
    icon = Icon(wide, high, ports=places, tips=tips, key=tuple(dict.fromkeys(keys)), figures=figures)
    return _Drawn(icon, shapes)


def _ports(instance: Instance, sheet: _Sheet) -> Iterator[tuple[str, tuple[Side, float] | None, Point]]:
    """Yield connectors: the place at the nearest side, none for those in the middle, and where lines end inside."""
    placed = [e for text in instance.lineage for e in text.elements if isinstance(e, Declaration) and e.placement]
    for declaration in placed:
        if "protected" in declaration.prefixes:
            continue
        values = _annotation(declaration.placement)
        transformation = {**_dict(values.get("transformation")), **_dict(values.get("iconTransformation"))}
        box = _box(transformation.get("extent"))
        if box is None:
            continue
        (x1, y1), (x2, y2) = (_turned(corner, transformation) for corner in box)
        x, y, size = (x1 + x2) / 2 - sheet.middle[0], (y1 + y2) / 2 - sheet.middle[1], abs(x1 - x2) / 2
        away = abs(x) / sheet.half[0], abs(y) / sheet.half[1]
        if max(away) < _MIDDLE:
            yield declaration.name, None, (x * sheet.scale, -y * sheet.scale)
            continue
        # The picture of the connector itself is not drawn: its line goes on to the edge inside.
        flat, short = away[0] > away[1], max(*away) - size / (sheet.half[0] if away[0] > away[1] else sheet.half[1])
        x, y = (math.copysign(short * sheet.half[0], x), y) if flat else (x, math.copysign(short * sheet.half[1], y))
        side: Side = ("E" if x > 0 else "W") if flat else "N" if y > 0 else "S"
        tip = x * sheet.scale, -y * sheet.scale
        yield declaration.name, (side, tip[1] if flat else tip[0]), tip


# -- values of annotations ---------------------------------------------------------------------------------------------


def _annotation(tokens: list[Token]) -> dict[str, Any]:
    with suppress(ModelicaLikeError):
        return _dict(_plain(parse_tokens(tokens)))
    return {}


def _plain(node: Expr) -> Any:
    """Return what an annotation says: a call as its arguments by name, its own name by ""; else the expression."""
    kind, args = node.kind, node.args
    if kind in ("number", "string", "boolean"):
        return args[0]
    if kind == "array":
        return tuple(map(_plain, args))
    if kind == "name" and "." in node.path:  # of an enumeration
        return node.path.rpartition(".")[2]
    if kind == "call" and args[0] == "DynamicSelect":  # the picture of a run differs; this is that of the text
        return _plain(args[1][0]) if args[1] else None
    if kind == "call":
        inner = {each.args[0]: _plain(each) for each in args[1] if each.kind == "call"}
        return {"": args[0], **inner, **{name: _plain(value) for name, value in args[2]}}
    if next(names_in(node), None) is None and next(calls_in(node), None) is None:
        with suppress(fold.Unfit, ModelicaLikeError, ArithmeticError):
            value = fold.known(node)
            return value.args[0] if value.kind in fold.KNOWN else node
    return node


def _dict(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _tuple(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else ()


def _number(value: Any, default: float = 0.0) -> float:
    return value if isinstance(value, float) and math.isfinite(value) else default


def _points(value: Any) -> list[Point]:
    pairs = [pair for pair in _tuple(value) if len(_tuple(pair)) == 2]
    return [(_number(x), _number(y)) for x, y in pairs]


def _box(value: Any) -> tuple[Point, Point] | None:
    points = _points(value)
    return (points[0], points[1]) if len(points) == 2 and points[0] != points[1] else None


def _colour(value: Any, default: str = "#000000") -> str:
    parts = [min(max(int(_number(part)), 0), 255) for part in _tuple(value)]
    return f"#{parts[0]:02x}{parts[1]:02x}{parts[2]:02x}" if len(parts) == 3 else default


# -- shapes ------------------------------------------------------------------------------------------------------------


def _turned(point: Point, shape: dict[str, Any]) -> Point:
    """Return a place after the shape's rotation, counter-clockwise in degrees, and from its origin."""
    (x, y), angle = point, math.radians(_number(shape.get("rotation")))
    origin = (_points((shape.get("origin"),)) or [(0.0, 0.0)])[0]
    cosine, sine = math.cos(angle), math.sin(angle)
    return origin[0] + cosine * x - sine * y, origin[1] + sine * x + cosine * y


def _is_beside(shape: dict[str, Any], sheet: _Sheet) -> bool:
    """Tell whether a text is a name, or stands above or below the symbol."""
    box = _box(shape.get("extent"))
    if box is None or shape.get("textString") in ("%name", "%class"):
        return True
    _, y = _turned(((box[0][0] + box[1][0]) / 2, (box[0][1] + box[1][1]) / 2), shape)
    return abs(y - sheet.middle[1]) > _BESIDE * sheet.half[1]


def _figures(shape: dict[str, Any], sheet: _Sheet) -> tuple[Figure, ...]:
    kind = shape.get("", "").rpartition(".")[2]
    if kind == "Text":
        return _text(shape, sheet)
    if kind == "Line":
        data = _way(_points(shape.get("points")), shape, sheet, closed=False)
        colour = _colour(shape.get("color"))
        line = _outlined(shape, "thickness", colour)
        return (Figure(data, **line), *_arrows(shape, sheet, colour, line)) if data and line["line"] else ()
    paths = {"Polygon": _polygon, "Rectangle": _rectangle, "Ellipse": _ellipse}
    data = paths[kind](shape, sheet) if kind in paths else ""
    pattern = shape.get("fillPattern", "None")
    fill = "" if pattern == "None" else _colour(shape.get("fillColor"))
    outline = _outlined(shape, "lineThickness", _colour(shape.get("lineColor")))
    shade = _SHADES.get(pattern, "")
    if shade and not outline["line"]:  # a cylinder has the colour of its outline at its edges, also without one
        outline |= {"line": _colour(shape.get("lineColor")), "width": 0.0}
    return (Figure(data, fill=fill, shade=shade, **outline),) if data and (fill or outline["line"]) else ()


def _outlined(shape: dict[str, Any], thickness: str, colour: str) -> dict[str, Any]:
    pattern = shape.get("pattern", "Solid")
    width = _THICK * _number(shape.get(thickness), 0.25)
    return {"line": "" if pattern == "None" else colour, "width": width, "dashes": _DASHES.get(pattern, "")}


def _pair(point: Point) -> str:
    return f"{round(point[0], 2) + 0.0:g} {round(point[1], 2) + 0.0:g}"


def _way(points: list[Point], shape: dict[str, Any], sheet: _Sheet, *, closed: bool) -> str:
    """Return a line through points; a smooth one is a parabola from middle to middle, as Modelica defines it."""
    places = [sheet.at(_turned(point, shape)) for point in points]
    if len(places) < 2:
        return ""
    if closed and places[0] == places[-1]:
        places.pop()
    if shape.get("smooth") != "Bezier" or len(places) < 3:
        return f"M{' L'.join(map(_pair, places))}{' Z' if closed else ''}"
    around = [*places, places[0]] if closed else places
    middles = [((a[0] + b[0]) / 2, (a[1] + b[1]) / 2) for a, b in pairwise(around)]
    if closed:
        curves = zip([*places[1:], places[0]], [*middles[1:], middles[0]], strict=True)
        return f"M{_pair(middles[0])}" + "".join(f" Q{_pair(corner)} {_pair(to)}" for corner, to in curves) + " Z"
    curves = zip(places[1:-1], middles[1:], strict=True)
    middle = "".join(f" Q{_pair(corner)} {_pair(to)}" for corner, to in curves)
    return f"M{_pair(places[0])} L{_pair(middles[0])}{middle} L{_pair(places[-1])}"


def _polygon(shape: dict[str, Any], sheet: _Sheet) -> str:
    return _way(_points(shape.get("points")), shape, sheet, closed=True)


def _rectangle(shape: dict[str, Any], sheet: _Sheet) -> str:
    box = _box(shape.get("extent"))
    if box is None:
        return ""
    (west, east), (low, high) = (sorted((box[0][k], box[1][k])) for k in (0, 1))
    radius = min(_number(shape.get("radius")), (east - west) / 2, (high - low) / 2)
    if radius <= 0.0:
        return _way([(west, high), (east, high), (east, low), (west, low)], shape, sheet, closed=True)
    corners = [  # clockwise, each as the end of a side and the begin of the next one
        ((east - radius, high), (east, high - radius)), ((east, low + radius), (east - radius, low)),
        ((west + radius, low), (west, low + radius)), ((west, high - radius), (west + radius, high)),
    ]  # fmt: skip
    places = [[sheet.at(_turned(point, shape)) for point in pair] for pair in corners]
    arc = f"A{_pair((radius * sheet.scale, radius * sheet.scale))} 0 0 1"
    return f"M{_pair(places[-1][1])}" + "".join(f" L{_pair(a)} {arc} {_pair(b)}" for a, b in places) + " Z"


def _ellipse(shape: dict[str, Any], sheet: _Sheet) -> str:
    box = _box(shape.get("extent"))
    if box is None:
        return ""
    (west, east), (low, high) = (sorted((box[0][k], box[1][k])) for k in (0, 1))
    begin, end = _number(shape.get("startAngle")), _number(shape.get("endAngle"), 360.0)
    x, y, across, up = (west + east) / 2, (low + high) / 2, (east - west) / 2, (high - low) / 2

    def place(angle: float) -> str:
        turned = math.radians(angle)
        return _pair(sheet.at(_turned((x + across * math.cos(turned), y + up * math.sin(turned)), shape)))

    _rectangle(shape | {"radius": 0.0}, sheet)  # its room
    whole = abs(end - begin) >= 360.0
    if whole:
        end = begin + 360.0
    # Two halves, because an arc of SVG with equal ends is none.
    middle, turn = (begin + end) / 2, -_number(shape.get("rotation"))
    arc = f"A{_pair((across * sheet.scale, up * sheet.scale))} {turn:g} 0 {0 if end > begin else 1}"
    data = f"M{place(begin)} {arc} {place(middle)} {arc} {place(end)}"
    closure = shape.get("closure", "Chord" if whole else "Radial")
    if closure == "Radial" and not whole:
        data += f" L{_pair(sheet.at(_turned((x, y), shape)))}"
    return data if closure == "None" else f"{data} Z"


def _arrows(shape: dict[str, Any], sheet: _Sheet, colour: str, line: dict[str, Any]) -> Iterator[Figure]:
    """Yield the tips at the ends of a line."""
    points = [sheet.at(_turned(point, shape)) for point in _points(shape.get("points"))]
    size = sheet.scale * _number(shape.get("arrowSize"), 3.0) * 4
    for kind, ends in zip(_tuple(shape.get("arrow")), (points[:2], points[:-3:-1]), strict=False):
        if kind not in ("Open", "Filled", "Half") or ends[0] == ends[1]:
            continue
        (x, y), (from_x, from_y) = ends
        long = math.hypot(x - from_x, y - from_y)
        along, aside = size * (from_x - x) / long, size * (from_y - y) / long
        sides = [(x + along + 0.4 * aside, y + aside - 0.4 * along), (x + along - 0.4 * aside, y + aside + 0.4 * along)]
        sides = sides[:1] if kind == "Half" else sides
        if kind == "Filled":
            yield Figure(f"M{_pair(sides[0])} L{_pair((x, y))} L{_pair(sides[-1])} Z", fill=colour)
        else:
            data = " ".join(f"M{_pair(side)} L{_pair((x, y))}" for side in sides)
            yield Figure(data, line=line["line"], width=line["width"])


def _text(shape: dict[str, Any], sheet: _Sheet) -> tuple[Figure, ...]:
    words, box = shape.get("textString", ""), _box(shape.get("extent"))
    if not isinstance(words, str) or not words.strip() or box is None:
        return ()
    colour = _colour(shape.get("textColor"), _colour(shape.get("lineColor")))
    at = sheet.at(_turned(((box[0][0] + box[1][0]) / 2, (box[0][1] + box[1][1]) / 2), shape))
    size = abs(box[1][0] - box[0][0]) * sheet.scale, abs(box[1][1] - box[0][1]) * sheet.scale
    turn = -_number(shape.get("rotation"))
    _rectangle(shape, sheet)  # its room
    return (Figure(line=colour, text=words, at=at, size=size, turn=turn),)
