"""Modes of a drive as a table."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.markup import escape

from modelica_like.analyse.linear.modes import Mode, Modes
from modelica_like.report.types import table

_LEAST = 0.005
_MOST = 4


def modes_report(modes: Modes) -> RenderableType:
    """Return eigenvalues, damping, and the components that hold and lose the energy of each mode."""
    linear = modes.linear
    head = f"[bold]{escape(linear.model.name)}[/]  {len(linear.states)} states at t = {linear.time:g} s"
    made = table(
        "modes", ">", "eigenvalue in rad/s>", "frequency in Hz>", "damping>", "time constant in s>", "energy in",
        "lost in",
        rows=[(str(k), *_numbers(mode), _shares(mode.stored), _shares(mode.lost)) for k, mode in enumerate(modes, 1)],
    )  # fmt: skip
    parts: list[RenderableType] = [head, "", made]
    if linear.held:
        parts.append(f"[dim]Held by modes that are active there: {escape(', '.join(linear.held))}.[/]")
    return Group(*parts)


def _numbers(mode: Mode) -> tuple[str, str, str, str]:
    value = mode.eigenvalue
    if mode.oscillates:
        text = f"{value.real:.5g} ± {value.imag:.5g}j"
        return text, f"{mode.frequency:.4g}", f"{mode.damping:.3g}", f"{mode.time_constant:.3g}"
    return f"{value.real:.5g}", "", "", f"{mode.time_constant:.3g}" if value else ""


def _shares(shares: dict[str, float]) -> str:
    shown = [(path, share) for path, share in shares.items() if abs(share) >= _LEAST][:_MOST]
    return ", ".join(f"{path} {100 * share:.0f} %" for path, share in shown)
