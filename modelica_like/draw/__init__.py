"""Schematics of drives.

A layered drawing, with power from west to east: columns by a linear programme, orders by crossings, heights by another
linear programme, and lines along both. Symbols are declared by the components.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, cast

from modelica_like.draw.diagram import diagram
from modelica_like.draw.sheet import Sheet, sheet
from modelica_like.draw.svg import svg
from modelica_like.errors import NetlistError, missing_extra
from modelica_like.language.component import Component
from modelica_like.writing import check_writable, write_bytes

if TYPE_CHECKING:
    from reportlab.graphics.shapes import Drawing

_PACKAGES = {".pdf": "svglib", ".png": "resvg_py"}
FORMATS = (".pdf", ".png", ".svg")
_SHARP = 2
"""Pixels of a PNG file per unit of the drawing."""


def layout(component: Component, *, depth: int = 1) -> Sheet:
    """Place the parts and connections of a drive on a sheet.

    Args:
        component: the drive.
        depth: number of levels of open assemblies.
    """
    return sheet(diagram(component, depth))


def schematic(component: Component, *, depth: int = 1, background: bool = True) -> str:
    """Draw a drive as SVG: power from west to east, a symbol for each machine element.

    Args:
        component: the drive.
        depth: number of levels of open assemblies.
        background: fill the paper; a page has one already.
    """
    return svg(layout(component, depth=depth), component.label, background=background)


def check_format(path: Path) -> None:
    """Raise an error if a schematic cannot be written there.

    Raises:
        NetlistError: the ending is not in `FORMATS`.
        MissingExtra: the format needs a package that is not installed.
        OSError: it cannot be written there.
    """
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise NetlistError(f"'{path.name}': a schematic can be {', '.join(one[1:] for one in FORMATS)}.")
    package = _PACKAGES.get(ending)
    if package and find_spec(package) is None:
        raise missing_extra(package, "pictures")
    check_writable(path)


def save_schematic(component: Component, path: str | Path, *, depth: int = 1) -> None:
    """Write the schematic of a drive as SVG, PNG or PDF, by the ending of the file.

    Args:
        component: the drive.
        path: the file.
        depth: number of levels of open assemblies.

    Raises:
        NetlistError: the file name has another ending.
        MissingExtra: PNG and PDF need the extra `pictures`.
        OSError: the file cannot be written.
    """
    path = Path(path)
    check_format(path)
    text = schematic(component, depth=depth)
    convert = {".svg": str.encode, ".png": _png, ".pdf": _pdf}[path.suffix.lower()]
    write_bytes(path, convert(text))


def _png(text: str) -> bytes:
    import matplotlib
    import resvg_py

    # A machine without fonts has those of matplotlib.
    fonts = [str(Path(matplotlib.get_data_path()) / "fonts" / "ttf")]
    return bytes(resvg_py.svg_to_bytes(svg_string=text, zoom=_SHARP, font_dirs=fonts, sans_serif_family="DejaVu Sans"))


def _pdf(text: str) -> bytes:
    from io import StringIO

    from reportlab.graphics import renderPDF
    from svglib.svglib import svg2rlg

    return cast("bytes", renderPDF.drawToString(cast("Drawing", svg2rlg(StringIO(text)))))
