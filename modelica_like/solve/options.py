"""Options of a simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from modelica_like.errors import UnknownName, ValueOutOfRange, did_you_mean

OnChattering = Literal["stop", "slide", "rest"]


@dataclass(frozen=True)
class Options:
    """Tolerances and limits of a simulation.

    Attributes:
        rtol: relative tolerance of the integrator, per step.
        atol: absolute tolerance, in units of each variable's nominal value.
        points: number of equal intervals of the results.
        max_steps: largest number of integrator steps between two results.
        max_events: largest number of events in a run.
        iterations: largest number of event rounds at one instant.
        on_chattering: what happens where events follow each other without end: `stop` with an error; `slide`: two modes
            that lead back to their border are mixed such that the run stays on it; `rest`: impacts that follow each
            other ever faster end in contact.
    """

    rtol: float = 1e-7
    atol: float = 1e-9
    points: int = 500
    max_steps: int = 100_000
    max_events: int = 100_000
    iterations: int = 20
    on_chattering: OnChattering = "stop"

    def __post_init__(self) -> None:
        for name, low, high in (("rtol", 1e-14, 0.1), ("atol", 1e-20, 1.0), ("points", 1, 10_000_000)):
            value = getattr(self, name)
            if not low <= value <= high:
                told, least, most = (f"{one:,}" if isinstance(one, int) else f"{one:g}" for one in (value, low, high))
                raise ValueOutOfRange(f"{name} = {told} is out of range: it must be between {least} and {most}.")
        kinds = get_args(OnChattering)
        if self.on_chattering not in kinds:
            what = f"There is no on_chattering '{self.on_chattering}'{did_you_mean(self.on_chattering, kinds) or '.'}"
            raise UnknownName(what, advice=f"There are {', '.join(kinds)}.")
