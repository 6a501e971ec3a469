"""Terminals: what belongs together at an open end of a drive that is exported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Terminal:
    """How an adaptor appears outside: its signals together form one terminal.

    Attributes:
        kind: kind of the terminal; ends of one kind fit together.
        takes: quantity from outside: the `flow` (torque, force, current, heat flow) or the `potential` (angle,
            position, voltage, temperature).
        rates: pairs of an input and the input that is its time derivative.
        power: the flow and the signal whose product is the power through it, such as torque and speed.
    """

    kind: str
    takes: Literal["flow", "potential"]
    rates: tuple[tuple[str, str], ...] = ()
    power: tuple[str, str] | None = None
