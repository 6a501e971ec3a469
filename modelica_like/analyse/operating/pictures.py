"""Pictures of characteristic curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import matplotlib as mpl

from modelica_like.solve.style import COLOURS, STYLE, headline, panels, with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.analyse.operating.curves import Curves


def draw_curves(curves: Curves, paths: Sequence[str], over: str) -> Figure:
    """Draw columns of operating points over one of them, one panel each."""
    with mpl.rc_context(STYLE):
        figure, rows = panels(max(len(paths), 1), 0.8 + 1.9 * max(len(paths), 1))
        for k, (axes, path) in enumerate(zip(rows, paths, strict=False)):
            axes.plot(curves[over], curves[path], color=COLOURS[k % len(COLOURS)])
            axes.set_ylabel(with_unit(path, curves.unit(path)))
        rows[-1].set_xlabel(with_unit(over, curves.unit(over)))
        headline(figure, curves.points[0].model.name)
    return figure
