"""Style of pictures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE: Any = {
    "font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6, "axes.axisbelow": True, "axes.edgecolor": "#666666", "xtick.color": "#444444",
    "ytick.color": "#444444", "lines.linewidth": 1.5, "legend.frameon": False, "legend.fontsize": 8,
}  # fmt: skip
# Okabe and Ito's palette: distinct also for colour-blind readers.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")


@contextmanager
def picture(title: str, count: int, height: float, **grid: Any) -> Iterator[tuple[Figure, list[Any]]]:
    """Yield a figure in the package's style, to draw within the context, and its panels, one above the other.

    Args:
        title: heading.
        count: number of panels; they share the horizontal axis.
        height: in inches.
        grid: of matplotlib's `subplots`.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, height), layout="constrained", dpi=150)
        figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold")
        yield figure, list(figure.subplots(count, 1, sharex=True, squeeze=False, **grid)[:, 0])


def with_unit(name: str, unit: str) -> str:
    """Return the label of an axis."""
    spelled = unit.replace(".", "\u00b7")
    return name if unit == "1" else f"{name} in {spelled}"
