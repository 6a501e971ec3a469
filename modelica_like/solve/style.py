"""How pictures look."""

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


def panels(count: int, height: float) -> tuple[Figure, list[Any]]:
    """Return a figure with panels one above the other that share the horizontal axis; height in inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, height), layout="constrained", dpi=150)
    return figure, list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])


@contextmanager
def picture(title: str, count: int, height: float) -> Iterator[tuple[Figure, list[Any]]]:
    """Give a figure in the house's style, and its panels as `panels` makes them, to be drawn within the context."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        figure, rows = panels(count, height)
        headline(figure, title)
        yield figure, rows


def headline(figure: Figure, text: str) -> None:
    """Write the heading of a picture."""
    figure.suptitle(text, x=0.01, ha="left", fontsize=11, fontweight="bold")


def with_unit(name: str, unit: str) -> str:
    """Return the label of an axis."""
    spelled = unit.replace(".", "\u00b7")
    return name if unit == "1" else f"{name} in {spelled}"
