"""Icons of FMUs and of their terminals, drawn the same in every run: boxes with round corners, as PNG and as SVG."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np

_INK = "#1f2937"
_STEEL = "#9aa5b4"
_LIGHT = "#e5e9ef"
_COLOURS = {"rotational": "#6b7280", "translational": "#2f7d4f", "electrical": "#1d4ed8", "thermal": "#c2410c"}
_PIXELS = 128
_LINE = 3.2


@dataclass(frozen=True)
class _Box:
    """A box with a frame of ink, in hundredths of the picture; with a radius of half its width it is a disc."""

    x: float
    y: float
    width: float
    height: float
    fill: str
    radius: float = 0.0


def icon_name(kind: str) -> str:
    """Return the file name, without suffix, of the icon for a kind of terminal."""
    return next((family for family in _COLOURS if family in kind), "terminal")


def terminal_icon(family: str, suffix: str) -> bytes:
    """Draw the icon of a terminal: a disc for shafts, a square for slides and pins, a flame's colour for heat.

    Args:
        family: as `icon_name` returns it.
        suffix: `png` or `svg`.
    """
    colour = _COLOURS.get(family, _STEEL)
    if family == "rotational":
        return _drawn([_Box(6, 6, 88, 88, colour, 44), _Box(34, 34, 32, 32, "#ffffff", 16)], suffix)
    return _drawn([_Box(8, 8, 84, 84, colour)], suffix)


def drive_icon(suffix: str) -> bytes:
    """Draw the icon of an FMU: two discs of a clutch on a shaft that leaves to the right."""
    parts = [(12, 44, 76, 12, _STEEL), (18, 26, 22, 48, _LIGHT), (48, 20, 7, 60, _STEEL), (58, 20, 7, 60, _STEEL)]
    return _drawn([_Box(4, 4, 92, 92, "#ffffff", 10), *(_Box(*part) for part in parts)], suffix)


def _drawn(boxes: list[_Box], suffix: str) -> bytes:
    return _svg(boxes) if suffix == "svg" else _png(boxes)


def _svg(boxes: list[_Box]) -> bytes:
    style = f'stroke="{_INK}" stroke-width="{_LINE}"'
    rows = (
        f'<rect x="{b.x}" y="{b.y}" width="{b.width}" height="{b.height}" rx="{b.radius}" fill="{b.fill}" {style}/>'
        for b in boxes
    )
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">'
    return "\n".join(("<?xml version='1.0' encoding='utf-8'?>", head, *rows, "</svg>\n")).encode()


def _png(boxes: list[_Box]) -> bytes:
    """Paint boxes over each other; how much of a pixel one covers follows from the distance to its edge."""
    picture = np.zeros((_PIXELS, _PIXELS, 4))
    along = (np.arange(_PIXELS) + 0.5) * 100 / _PIXELS
    for b in boxes:
        inside = b.width / 2 - b.radius, b.height / 2 - b.radius
        x, y = np.abs(along - b.x - b.width / 2) - inside[0], np.abs(along - b.y - b.height / 2) - inside[1]
        across, down = np.meshgrid(x, y)
        outside = np.hypot(np.maximum(across, 0), np.maximum(down, 0))
        distance = outside + np.minimum(np.maximum(across, down), 0) - b.radius
        for edge, colour in ((_LINE / 2, _INK), (-_LINE / 2, b.fill)):
            cover = np.clip(0.5 - (distance - edge) * _PIXELS / 100, 0, 1)[..., None]
            paint = np.array([*bytes.fromhex(colour[1:]), 255.0])
            picture += (paint - picture) * cover
    rows = np.round(picture).astype(np.uint8).reshape(_PIXELS, -1)
    data = b"".join(b"\0" + row.tobytes() for row in rows)
    head = struct.pack(">IIBBBBB", _PIXELS, _PIXELS, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(data, 9)), (b"IEND", b""))
    parts = (struct.pack(">I", len(c)) + kind + c + struct.pack(">I", zlib.crc32(kind + c)) for kind, c in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)
