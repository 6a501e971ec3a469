"""The energy flow of a run as a Sankey diagram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from modelica_like.runs.energy import EnergyBalance
from modelica_like.style import picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BROUGHT, _STORED, _HEAT, _TAKEN = "#0072b2", "#009e73", "#d55e00", "#56b4e9"
_GAP = 0.035
_SMALL = 0.004
"""Share of the total below which streams are drawn together as `others`."""
_LEFT, _MIDDLE, _RIGHT, _WIDTH = 0.0, 0.5, 1.0, 0.02


@dataclass(frozen=True)
class Stream:
    """An amount of energy in J, with its kind."""

    name: str
    amount: float
    colour: str


def streams(balance: EnergyBalance) -> tuple[list[Stream], list[Stream]]:
    """Return the streams in (sources, stored before) and out (loads, stores, heat)."""
    brought = [Stream(r.component, r.source, _BROUGHT) for r in balance if r.source > 0]
    brought += [Stream(f"{r.component} (stored)", -r.stored, _STORED) for r in balance if r.stored < 0]
    went = [Stream(r.component, -r.source, _TAKEN) for r in balance if r.source < 0]
    went += [Stream(f"{r.component} (stored)", r.stored, _STORED) for r in balance if r.stored > 0]
    went += [Stream(f"{r.component} (heat)", r.lost, _HEAT) for r in balance if r.lost > 0]
    return brought, went


def sankey(balance: EnergyBalance, title: str = "") -> Figure:
    """Draw sources on the left, and loads, stores and heat on the right.

    Args:
        balance: of a run.
        title: heading.
    """
    brought, went = (_together(side) for side in streams(balance))
    total = max(sum(flow.amount for flow in brought), sum(flow.amount for flow in went), 1e-300)
    rows = max(len(brought), len(went), 3)
    with picture(f"{title or 'energy'}: {total:.4g} J", 1, 1.0 + 0.45 * rows) as (figure, (axes,)):
        axes.set_axis_off()
        _side(axes, brought, total, _LEFT)
        _side(axes, went, total, _RIGHT)
        _box(axes, _MIDDLE, 0.0, -1.0, "#444444")
        axes.set(xlim=(-0.45, 1.45), ylim=(-1.0 - _GAP * rows, 0.06 + _GAP * rows))
    return figure


def _together(side: Sequence[Stream]) -> list[Stream]:
    """Sort streams by size within a colour, and merge small ones."""
    total = sum(flow.amount for flow in side) or 1.0
    shown = [flow for flow in side if flow.amount >= _SMALL * total]
    rest = sum(flow.amount for flow in side if flow.amount < _SMALL * total)
    colours = list(dict.fromkeys(flow.colour for flow in side))
    shown.sort(key=lambda flow: (colours.index(flow.colour), -flow.amount))
    return [*shown, Stream("others", rest, "#999999")] if rest > 1e-9 * total else shown


def _side(axes: Axes, side: Sequence[Stream], total: float, x: float) -> None:
    """Draw the streams of one side, spread by gaps, to or from the bar in the middle."""
    spread = _GAP * (len(side) - 1) / 2
    outer, inner = spread, 0.0
    for flow in side:
        height = flow.amount / total
        _ribbon(axes, (x, outer), (_MIDDLE, inner), height, flow.colour)
        _box(axes, x, outer, outer - height, flow.colour)
        where = (x - 0.03, "right") if x < _MIDDLE else (x + 0.03, "left")
        axes.text(
            where[0], outer - height / 2, f"{flow.name}  {flow.amount:.4g} J", ha=where[1], va="center", fontsize=8
        )
        outer -= height + _GAP
        inner -= height


def _ribbon(axes: Axes, end: tuple[float, float], middle: tuple[float, float], height: float, colour: str) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    (x0, y0), (x1, y1) = end, middle
    bend = (x0 + x1) / 2
    points = [(x0, y0), (bend, y0), (bend, y1), (x1, y1), (x1, y1 - height), (bend, y1 - height), (bend, y0 - height)]
    points += [(x0, y0 - height), (x0, y0)]
    curve = [Path.MOVETO, *[Path.CURVE4] * 3, Path.LINETO, *[Path.CURVE4] * 3, Path.CLOSEPOLY]
    axes.add_patch(PathPatch(Path(points, curve), facecolor=colour, alpha=0.45, linewidth=0))


def _box(axes: Axes, x: float, top: float, bottom: float, colour: str) -> None:
    from matplotlib.patches import Rectangle

    axes.add_patch(Rectangle((x - _WIDTH / 2, bottom), _WIDTH, top - bottom, facecolor=colour, linewidth=0))
