"""Elements whose parameters must fit each other."""

from __future__ import annotations

from components.mechanics.sources import AT_ONCE
from modelica_like.language import Component, Discrete, Events, Expr, Mode, discrete, negate


class Feasible(Component, partial=True):
    """Element whose parameters must fit each other: where they do not, the run ends at its start with a sentence.

    A subclass gives the condition, and says in `misfit` what is wrong.
    """

    misfit = "is impossible"
    t_refused: Discrete = discrete("s", "time at which it is refused: at the start", start=AT_ONCE)
    parts_fit = Mode("fitting", "impossible", "refused", description="whether its parameters fit each other")

    def fits(self) -> Expr:
        """Return the condition on which its parameters fit each other."""
        raise NotImplementedError

    def events(self) -> Events:
        yield from super().events()
        yield self.parts_fit.initially("impossible", when=negate(self.fits()))
        yield self.parts_fit.go("impossible", "refused", at=self.t_refused, fails=True, notice=self.misfit)
