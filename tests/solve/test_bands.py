"""Bands of modes under curves."""

from modelica_like import simulate
from modelica_like.language import Component, Equations, Events, Mode, Parameter, Variable, der, param, var
from modelica_like.solve.bands import bands_of


class Blink(Component):
    """High for a moment from `first` on, and from `second` on to the end."""

    mode = Mode("low", "high", "again", "last")
    first: Parameter = param("s", "when it blinks", default=0.8)
    long: Parameter = param("s", "how long", default=1e-5)
    second: Parameter = param("s", "when it stays", default=0.9)
    x: Variable = var("s", "time", default=0.0)

    def equations(self) -> Equations:
        yield der(self.x) == 1

    def events(self) -> Events:
        yield self.mode.go("low", "high", when=self.time > self.first)
        yield self.mode.go("high", "again", when=self.time > self.first + self.long)
        yield self.mode.go("again", "last", when=self.time > self.second)


def test_a_mode_that_lasts_too_short_to_be_seen_has_no_band() -> None:
    for long, seen in ((5e-6, ["low", "again", "last"]), (0.05, ["low", "high", "again", "last"])):
        (band,), left = bands_of(simulate(Blink(long=long), 1.0, points=2))
        assert [name for *_, name in band.spans] == seen
        assert not left
