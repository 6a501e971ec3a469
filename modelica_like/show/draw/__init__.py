"""Schematics of drives.

A layered drawing, with power from west to east: columns by a linear programme, orders by crossings, heights by another
linear programme, and lines along both. Symbols are declared by the components.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, cast

from modelica_like.arguments import checked
from modelica_like.errors import LanguageError, NetlistError, missing_extra
from modelica_like.language.component import Component
from modelica_like.runs.energy import EnergyBalance
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.draw.diagram import Notes, diagram
from modelica_like.show.draw.running import energy_notes, running
from modelica_like.show.draw.shapes import shapes
from modelica_like.show.draw.sheet import Sheet, sheet
from modelica_like.show.draw.svg import svg
from modelica_like.writing import check_writable, write_bytes

if TYPE_CHECKING:
    from reportlab.graphics.shapes import Drawing

    from modelica_like.analyse.linear.model import Modes

_PACKAGES = {".pdf": "svglib", ".png": "resvg_py"}
FORMATS = (".pdf", ".png", ".svg")
_SHAPES = 4
_SHARP = 2
"""Pixels of a PNG file per unit of the drawing."""


def layout(component: Component, *, depth: int = 1, notes: Notes | None = None) -> Sheet:
    """Place the parts and connections of a drive on a sheet.

    Args:
        component: the drive.
        depth: number of levels of open assemblies.
        notes: returns texts below the name of a part.
    """
    return sheet(diagram(component, depth, notes))


@checked
def schematic(
    component: Component | str | Path, *, depth: int = 1, background: bool = True, run: Trajectories | None = None,
    at: float | None = None, flow: bool = False, moving: bool = False, balance: EnergyBalance | None = None,
    modes: Modes | None = None,
) -> str:  # fmt: skip
    """Draw a drive as SVG: power from left to right, a symbol for each machine element.

    Args:
        component: the drive, or its netlist.
        depth: number of levels of open assemblies.
        background: fill the paper; a page has one already.
        run: a run of the drive, whose modes are shown by colours: held, sliding, open.
        at: time in s whose modes and powers are shown; by default modes at the end and mean powers.
        flow: show power as the width of lines, and in numbers.
        moving: animate the modes of the whole run.
        balance: of the run: energies, also as shares of what came in, are shown instead of powers.
        modes: small motions of the drive, drawn below: the shapes of the first four oscillations.

    Raises:
        LanguageError: the drive is compiled already.
        NetlistError: the netlist cannot be read.
        ValueOutOfRange: the run has no such time.
    """
    if isinstance(component, str | Path):
        from modelica_like.netlist import load

        component = load(component)
    if not isinstance(component, Component):
        raise LanguageError("A compiled drive has no parts to draw.", advice="Give the component or the netlist.")
    drawn = layout(component, depth=depth, notes=energy_notes(balance) if balance else None)
    added = running(drawn, run, at=at, flow=flow, moving=moving, balance=balance) if run is not None else None
    below = shapes(drawn, modes, _SHAPES) if modes is not None else ()
    return svg(drawn, component.label, background=background, run=added, shapes=below)


def icon(component: Component) -> tuple[str, bytes | None]:
    """Draw a drive as its icon, with closed assemblies: as SVG, and as PNG if the extra `pictures` is installed.

    The same drive gives the same bytes on every machine.

    Args:
        component: the drive.
    """
    text = schematic(component, depth=0)
    return text, _png(text, alike=True) if find_spec(_PACKAGES[".png"]) else None


def check_format(path: Path, *, moving: bool = False) -> None:
    """Raise an error if a schematic cannot be written there.

    Args:
        path: the file.
        moving: it is animated.

    Raises:
        NetlistError: the ending is none of `FORMATS`, or the format does not move.
        MissingExtra: the format needs a package that is not installed.
        OSError: it cannot be written there.
    """
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise NetlistError(f"'{path.name}': a schematic can be {', '.join(suffix[1:] for suffix in FORMATS)}.")
    if moving and ending != ".svg":
        raise NetlistError(f"'{path.name}': only SVG moves.", advice="Write a file that ends with .svg.")
    package = _PACKAGES.get(ending)
    if package and find_spec(package) is None:
        raise missing_extra(package, "pictures")
    check_writable(path)


@checked
def save_schematic(
    component: Component | str | Path, path: str | Path, *, depth: int = 1, run: Trajectories | None = None,
    at: float | None = None, flow: bool = False, moving: bool = False, modes: Modes | None = None,
) -> None:  # fmt: skip
    """Write the schematic of a drive as SVG, PNG or PDF, by the ending of the file.

    Args:
        component: the drive, or its netlist.
        path: the file.
        depth: number of levels of open assemblies.
        run: a run of the drive, as of `schematic`.
        at: time in s, as of `schematic`.
        flow: show power.
        moving: animate the modes; SVG only.
        modes: small motions, as of `schematic`.

    Raises:
        NetlistError: the ending is none of these, or the format does not move.
        ValueOutOfRange: the run has no such time.
        MissingExtra: PNG and PDF need the extra `pictures`.
        OSError: the file cannot be written.
    """
    path = Path(path)
    check_format(path, moving=moving)
    text = schematic(component, depth=depth, run=run, at=at, flow=flow, moving=moving, modes=modes)
    convert = {".svg": str.encode, ".png": _png, ".pdf": _pdf}[path.suffix.lower()]
    write_bytes(path, convert(text))


def _png(text: str, *, alike: bool = False) -> bytes:
    """Return an SVG as PNG, with the fonts of the machine, or `alike` on all machines."""
    import resvg_py

    # A machine without fonts has those of matplotlib.
    package = find_spec("matplotlib")
    fonts = [str(Path(str(package and package.origin)).parent / "mpl-data" / "fonts" / "ttf")]
    return bytes(
        resvg_py.svg_to_bytes(
            svg_string=text, zoom=1 if alike else _SHARP, skip_system_fonts=alike, font_dirs=fonts,
            sans_serif_family="DejaVu Sans",
        )
    )  # fmt: skip


def _pdf(text: str) -> bytes:
    from io import StringIO

    from reportlab.graphics import renderPDF
    from svglib.svglib import svg2rlg

    return cast("bytes", renderPDF.drawToString(cast("Drawing", svg2rlg(StringIO(text)))))
