"""Style of pictures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLE: Any = {
    "font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6, "axes.axisbelow": True, "axes.edgecolor": "#666666", "xtick.color": "#444444",
    "ytick.color": "#444444", "lines.linewidth": 1.5, "legend.frameon": False, "legend.fontsize": 8,
    "axes.formatter.useoffset": False,
}  # fmt: skip
DPI = 200
# Okabe and Ito's palette: distinct also for colour-blind readers.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_FOOTER, _LINE, _GAP = 7.5, 0.15, 0.3
"""Size of the text below the panels in points, its line and the gap between its columns in inches."""


@contextmanager
def picture(
    title: str,
    count: int,
    height: float,
    *,
    width: float = 8.0,
    below: Sequence[Sequence[str]] = (),
    sharex: bool = True,
    **grid: Any,
) -> Iterator[tuple[Figure, list[Any]]]:
    """Yield a figure in the package's style, to draw within the context, and its panels, one above the other.

    Args:
        title: heading.
        count: number of panels.
        height: in inches, without the text below.
        width: in inches.
        below: blocks of lines below the panels, each in as many columns as fit side by side.
        sharex: whether they share the horizontal axis.
        grid: of matplotlib's `subplots`.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        blocks = [_columns(block, width - 0.2) for block in below if block]
        foot = sum(_LINE * rows + 0.05 for rows, _ in blocks) + 0.05 * bool(blocks)
        whole = height + foot
        figure = Figure(figsize=(width, whole), layout="constrained", dpi=DPI)
        figure.get_layout_engine().set(rect=(0.0, foot / whole, 1.0, height / whole))  # type: ignore[union-attr]
        figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold")
        for rows, places in blocks:
            for line, x, row in places:
                y = foot - 0.05 - _LINE * row
                figure.text((0.1 + x) / width, y / whole, line, fontsize=_FOOTER, color="#444444", va="top",
                            parse_math=False)  # fmt: skip
            foot -= _LINE * rows + 0.05
        yield figure, list(figure.subplots(count, 1, sharex=sharex, squeeze=False, **grid)[:, 0])


def _columns(block: Sequence[str], width: float) -> tuple[int, list[tuple[str, float, int]]]:
    """Return the number of rows, and for each line its place across in inches and its row."""
    wide = max(map(text_width, block)) + _GAP
    columns = min(max(int((width + _GAP) / wide), 1), len(block))
    rows = -(-len(block) // columns)
    return rows, [(line, wide * (k // rows), k % rows) for k, line in enumerate(block)]


def text_width(text: str, size: float = _FOOTER) -> float:
    """Return the width of a line of text in inches; `size` is in points."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    # At a large size: hinting rounds the widths of small letters up to whole pixels.
    return TextToPath().get_text_width_height_descent(text, FontProperties(size=100), False)[0] * size / 7200


def numbered(axes: Axes, shares: Sequence[float], width: float, size: float = 7.0) -> None:
    """Write the numbers 1, 2, ... above a panel; those without room share `3-5`.

    Args:
        axes: the upper panel.
        shares: places in parts of the panel's width, in rising order.
        width: of the panel in inches.
        size: of the numbers in points.
    """

    def text(group: Sequence[int]) -> str:
        return f"{group[0] + 1}" if len(group) == 1 else f"{group[0] + 1}\u2013{group[-1] + 1}"

    def middle(group: Sequence[int]) -> float:
        return (shares[group[0]] + shares[group[-1]]) / 2

    groups, k = [[n] for n in range(len(shares))], 0
    while k < len(groups) - 1:
        room = (middle(groups[k + 1]) - middle(groups[k])) * width
        if room < sum(text_width(text(label), size) for label in groups[k : k + 2]) / 2 + 0.05:
            groups[k : k + 2] = [[*groups[k], *groups[k + 1]]]
            k = max(k - 1, 0)
        else:
            k += 1
    for group in groups:
        axes.annotate(
            text(group), (middle(group), 1.0), xycoords="axes fraction", xytext=(0, 2), textcoords="offset points",
            ha="center", va="bottom", fontsize=size, color="#666666", annotation_clip=False,
        )  # fmt: skip


def with_unit(name: str, unit: str) -> str:
    """Return the label of an axis."""
    spelled = {"degC": "\u00b0C", "deg": "\u00b0"}.get(unit, unit.replace(".", "\u00b7"))
    return name if unit in ("1", "*") else f"{name} in {spelled}"
