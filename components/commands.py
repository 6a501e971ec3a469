"""Normalised commands: pressures, pedals and fillings, of which 1 is all there is."""

from __future__ import annotations

from modelica_like.language import Component, Events, Mode

_ROUNDING = 1e-6
"""Excess over 1 that a controller or the end of an exponential may have."""


class Commanded(Component, partial=True):
    """Element with a command from 0 to 1.

    A larger one may be meant (a test above the nominal pressure), so it counts, but the run says so.
    """

    command = Mode("kept", "exceeded", description="whether its command was always at most 1")

    def above_one(self, name: str) -> Events:
        """Yield the event at which a command exceeds 1.

        Args:
            name: of the input.
        """
        notice = f"gets a command above 1: {name} reaches {{{name}}}"
        yield self.command.go("kept", "exceeded", when=getattr(self, name) > 1 + _ROUNDING, notice=notice)
