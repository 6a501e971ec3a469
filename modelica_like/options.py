"""Options of a simulation."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from functools import cache
from typing import Literal, get_args

from modelica_like.arguments import fits, wrong_kind
from modelica_like.errors import UnknownName, ValueOutOfRange, did_you_mean

SMALLEST_ATOL = 1e-20
OnChattering = Literal["stop", "slide", "rest"]
OnEnergyDrift = Literal["stop", "note", "off"]

_NUMBER = 2 * 8
"""Bytes of a number, which is copied once when results are put together."""


@cache
def memory() -> float:
    """Return the memory of this machine in bytes; infinite where the system does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):  # Windows has no sysconf
        return math.inf


_RANGES = (
    ("rtol", 1e-14, 0.1), ("atol", SMALLEST_ATOL, 1.0), ("points", 1, 10_000_000), ("max_steps", 1, 10**9),
    ("max_events", 1, 10**9), ("iterations", 1, 10**6),
)  # fmt: skip
"""Of the numbers of options: least and largest, whole ones where these are."""


@dataclass(frozen=True)
class Options:
    """Tolerances and limits of a simulation.

    Attributes:
        rtol: relative tolerance of a run. The compiled run-time keeps it in each step, IDAS three tenths of it, because
            the errors of its steps add up.
        atol: absolute tolerance, in units of each variable's nominal value.
        points: number of equal intervals of the results.
        max_steps: largest number of steps of the run-time, or of pieces of IDAS, in a hundredth of the run (or between
            two of fewer results).
        max_events: largest number of events in a run.
        iterations: largest number of event rounds at one instant.
        on_chattering: what happens where events follow each other without end: `stop` with an error; `slide`: two modes
            that lead back to their border are mixed such that the run stays on it; `rest`: impacts that follow each
            other ever faster end in contact.
        max_step: largest step of the integrator in s.
        on_energy_drift: what happens where the stored energy of a component does not follow its power, so that the
            integrator has stepped over something, even with shorter steps: `stop` with an error, or `note` it without
            repetition; with `off` no energy is looked at.
        compiled: whether the equations of runs by the compiled run-time become machine code, with the same results. A
            model takes a C compiler about a second, once; without one the run says so, and interprets its tapes.
    """

    rtol: float = 1e-7
    atol: float = 1e-9
    points: int = 500
    max_steps: int = 100_000
    max_events: int = 100_000
    iterations: int = 20
    on_chattering: OnChattering = "stop"
    max_step: float = math.inf
    on_energy_drift: OnEnergyDrift = "stop"
    compiled: bool = False

    def __post_init__(self) -> None:
        for name, low, high in _RANGES:
            value = getattr(self, name)
            if not fits(value, type(low)):
                raise wrong_kind(name, value, type(low))
            if not low <= value <= high:
                given, least, most = (f"{x:,}" if isinstance(x, int) else f"{x:g}" for x in (value, low, high))
                raise ValueOutOfRange(f"{name} = {given} is out of range: it must be between {least} and {most}.")
        if not fits(self.max_step, float):
            raise wrong_kind("max_step", self.max_step, float)
        if not self.max_step > 0:
            raise ValueOutOfRange(f"max_step = {self.max_step:g} s is out of range: it must be positive.")
        for name, kinds in (("on_chattering", get_args(OnChattering)), ("on_energy_drift", get_args(OnEnergyDrift))):
            value = getattr(self, name)
            if value not in kinds:
                what = f"There is no {name} '{value}'{did_you_mean(value, kinds) or '.'}"
                raise UnknownName(what, advice=f"There are {', '.join(kinds)}.")

    def check_memory(self, numbers: int) -> None:
        """Check before a run that its results fit.

        Args:
            numbers: how many there are at a time: states and implicit unknowns.

        Raises:
            ValueOutOfRange: they do not.
        """
        needed, there = float(_NUMBER) * self.points * numbers, memory()
        if needed > there:
            raise ValueOutOfRange(
                f"{self.points:,} results of {numbers:,} states and implicit unknowns take {needed / 1e9:.3g} GB, and "
                f"this machine has {there / 1e9:.3g} GB.",
                advice="Take fewer points; `readings` are read off every step, whatever is written.",
            )
