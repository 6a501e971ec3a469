"""Terminals: signals that belong together at an open end of an exported drive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Terminal:
    """The terminal formed by the signals of an adaptor.

    Attributes:
        kind: kind of the terminal; ends of one kind can be connected.
        takes: quantity from outside: the `flow` (torque, force, current, heat flow) or the `potential` (angle,
            position, voltage, temperature).
        rates: pairs of an input and the input that is its time derivative.
        power: the flow and the signal whose product is the power through it, such as torque and speed.
    """

    kind: str
    takes: Literal["flow", "potential"]
    rates: tuple[tuple[str, str], ...] = ()
    power: tuple[str, str] | None = None
