"""Pictures of trajectories."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.errors import NetlistError
from modelica_like.runs.display import QUANTITIES, Display
from modelica_like.runs.signals import Signal, evaluated, named, read_signals
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.bands import bands_of, listed, marks_of
from modelica_like.show.panels import Panel, draw_panels
from modelica_like.style import COLOURS
from modelica_like.writing import check_writable, write_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_USUAL = ("rad/s", "m/s", "m", "N.m", "N", "V", "A", "W", "K", "1")
"""Units of the curves that nobody has asked for, in the order of their panels."""
_ON_PAGES = ("rad/s", "N.m", "m/s", "N"), ("V", "A", "K"), ("1",)
"""Those on a page: of a drive, of a circuit, of signals alone. A picture adds `_BESIDE`."""
_BESIDE = ("m", "A", "W")
_MOST = 6
_MOST_PANELS = 2, 24
"""Panels of one quantity that nobody has asked for, and panels of a picture."""


def plot(
    solution: Trajectories, patterns: Sequence[str] = (), *, title: str = "", display: Mapping[str, str] | None = None
) -> Figure:
    """Draw trajectories over time: a panel per quantity, relative ones apart, modes as bands, events as numbers.

    Torques and forces between two ends that drive where they are negative are drawn with the other sign; the legend
    says `\u2212clutch.tau`. Text below the picture lists the events, and what is not drawn.

    Args:
        solution: the run.
        patterns: names, patterns (`*.w`) or formulas (`2*pi*motor.w`) of the curves; modes become bands. By default
            speeds, positions, torques, forces, currents and powers of the parts, coinciding ones once.
        title: heading; by default the name of the model.
        display: units by path, pattern or quantity, in addition to those of the netlist, such as {"speed": "rpm"}.

    Raises:
        UnknownName: nothing matches a pattern.
        UnitError: a variable cannot be shown in a unit, or the units in a formula do not fit together.
    """
    shown = Display(solution.model, display)
    modes = {discrete.path for discrete in solution.model.flat_discretes if discrete.names}
    chosen = read_signals(solution.model, patterns)
    units = [kind for kind in _USUAL if kind in (*_on_page(solution), *_BESIDE)]
    curves = [signal for signal in chosen if signal.name not in modes] if chosen else usual(solution, units)
    values = evaluated(solution, curves)
    groups: dict[tuple[str, str], list[Signal]] = {}
    for signal in curves:
        groups.setdefault((quantity_of(signal), signal.shown_in(shown)), []).append(signal)
    panels, left = _panels(groups, 0 if chosen else _MOST_PANELS[0])
    bands, unbanded = bands_of(solution, [signal.name for signal in chosen if signal.name in modes])
    marks, unmarked = marks_of(solution, [band.mode for band in bands])
    left += [] if chosen else _quantities_left(solution, units)
    notes = [f"Not drawn: {', '.join(left)}; name them to draw them."] if left else []

    def draw(axes: Any, signals: Sequence[Signal]) -> None:
        for k, signal in enumerate(signals):
            curve = signal.driving * shown.converted(values[signal.name], signal.unit, signal.shown_in(shown))
            style = {"linestyle": "-" if k < len(COLOURS) else "--", "color": COLOURS[k % len(COLOURS)]}
            axes.plot(solution.time, curve, label=signal.label, **style)

    drawn = [Panel(name, unit, [signal.label for signal in some], lambda axes, some=some: draw(axes, some))
            for (name, unit), some in panels]  # fmt: skip
    return draw_panels(title or solution.model.name, solution.time, drawn, bands, marks, [*notes, *unbanded, *unmarked])


def _panels(
    groups: Mapping[tuple[str, str], Sequence[Signal]], most: int
) -> tuple[list[tuple[tuple[str, str], Sequence[Signal]]], list[str]]:
    """Divide groups among panels of a few curves each; also tell which have no room."""
    panels: list[tuple[tuple[str, str], Sequence[Signal]]] = []
    left: list[str] = []
    for key, signals in groups.items():
        room = min(_MOST_PANELS[1] - len(panels), most or _MOST_PANELS[1])
        count = -(-len(signals) // _MOST)
        each = _MOST if count > room else -(-len(signals) // max(count, 1))
        panels += [(key, signals[k * each : (k + 1) * each]) for k in range(min(count, room))]
        rest = signals[each * room :]
        if rest:
            left.append(f"{len(rest)} more of {key[0]} ({listed([signal.name for signal in rest])})")
    return panels, left


def check_picture(path: Path) -> None:
    """Raise an error before a run if a picture cannot be written.

    Raises:
        NetlistError: matplotlib does not support the format.
        OSError: it cannot be written there.
    """
    from matplotlib.backend_bases import FigureCanvasBase

    formats = FigureCanvasBase.get_supported_filetypes()
    if path.suffix.lower().lstrip(".") not in formats:
        raise NetlistError(f"'{path.name}': a picture can be {', '.join(sorted(formats))}.")
    check_writable(path)


def save_plot(figure: Figure, path: Path, **options: Any) -> None:
    """Write a picture; the ending of the file chooses the format.

    Args:
        figure: the picture.
        path: the file.
        options: of matplotlib's `savefig`.

    Raises:
        NetlistError: matplotlib does not support the format.
        OSError: the file cannot be written.
    """
    check_picture(path)
    # In memory first: not every format reports a full disk.
    write_bytes(path, picture_bytes(figure, path.suffix[1:].lower(), **options))


def picture_bytes(figure: Figure, kind: str, **options: Any) -> bytes:
    """Return a picture in a format of matplotlib, such as `png`.

    Args:
        figure: the picture.
        kind: the format.
        options: of matplotlib's `savefig`.
    """
    content = io.BytesIO()
    figure.savefig(content, format=kind, **options)
    return content.getvalue()


def for_page(solution: Trajectories, words: Sequence[str] = ()) -> tuple[list[Signal], str]:
    """Return the curves of a page without modes, which are bands there, and a sentence about those it leaves out.

    Args:
        solution: the run.
        words: names, patterns or formulas; by default speeds, torques and forces of the parts, six of each. A circuit
            has voltages, currents and temperatures.

    Raises:
        UnknownName: nothing matches a pattern.
        UnitError: the units in a formula do not fit together.
    """
    if words:
        modes = {discrete.path for discrete in solution.model.flat_discretes if discrete.names}
        return [signal for signal in read_signals(solution.model, words) if signal.name not in modes], ""
    units = _on_page(solution)
    signals = {unit: usual(solution, [unit], slips=True) for unit in units}
    left = [
        f"{len(some) - _MOST} of {len(some)} {_plural(quantity(unit))} ({listed([s.name for s in some[_MOST:]])})"
        for unit, some in signals.items()
        if len(some) > _MOST
    ]
    left += _quantities_left(solution, units)
    note = f"Not drawn: {', '.join(left)}; --show draws them." if left else ""
    return [signal for some in signals.values() for signal in some[:_MOST]], note


def _on_page(solution: Trajectories) -> tuple[str, ...]:
    part_units = {str(part.unit) for part in _of_parts(solution)}
    return next((units for units in _ON_PAGES if part_units.intersection(units)), ())


def usual(solution: Trajectories, units: Sequence[str], *, slips: bool = False) -> list[Signal]:
    """Return what one usually wants to see: variables of parts that are not zero, coinciding ones once.

    Args:
        solution: the run.
        units: coherent SI units.
        slips: also relative positions and angles.
    """
    model, signals = solution.model, dict[bytes, str]()
    wanted = getattr(model, "settings", {}).get("display", {})
    for unit in units:
        some = [part.path for part in _of_parts(solution) if str(part.unit) == unit]
        signs = {signal.name: signal.driving for signal in named(model, some)}
        for path, values in solution.together(*some).items():
            if np.any(values) and (slips or unit != "m" or not path.endswith("_rel")):
                scale = float(np.abs(values).max())
                curve = np.round(signs[path] * values / scale, 6) + 0.0
                key = curve.tobytes() + f"{unit}{scale:.6g}".encode()
                signals[key] = path if key not in signals or path in wanted else signals[key]
    return named(model, list(signals.values()))


def quantity_of(signal: Signal) -> str:
    """Return the quantity of a signal for titles; that of a difference between two ends is another one."""
    name = quantity(signal.unit)
    if not (signal.plain and signal.name.endswith("_rel")):
        return name
    return "slip speed" if name == "speed" else f"relative {name}"


def quantity(unit: str) -> str:
    """Return the quantity of a unit, for titles."""
    return QUANTITIES.get(unit, "value")


def _of_parts(solution: Trajectories) -> list[Any]:
    """Return the variables of parts without their connectors and inputs."""
    return [v for v in solution.model.flat_variables if v.kind in ("local", "output") and not v.hidden]


def _quantities_left(solution: Trajectories, drawn: Sequence[str]) -> list[str]:
    """Count the variables of parts with a unit that is not drawn."""
    units = [str(part.unit) for part in _of_parts(solution)]
    names = [QUANTITIES.get(unit, "signal") for unit in units if unit not in drawn]
    counts = {name: names.count(name) for name in names}
    return [f"{count} {name if count == 1 else _plural(name)}" for name, count in counts.items()]


def _plural(name: str) -> str:
    return f"{name[:-1]}ies" if name.endswith("y") else f"{name}s"
