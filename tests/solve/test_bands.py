"""Bands of modes under curves."""

import pytest

from components import BearingFriction, Inertia
from modelica_like import Assembly, simulate
from modelica_like.language import Component, Equations, Events, Mode, Parameter, Variable, der, param, var
from modelica_like.show.bands import bands_of


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


@pytest.mark.parametrize(("others", "shown"), [(7, 8), (8, 1)])
def test_of_many_modes_those_that_hold_a_motion_have_bands(others: int, shown: int) -> None:
    """Up to eight modes all have; the brake stops 1 kg m² with 2 N m from 1 rad/s at 0.5 s."""
    parts = {
        "brake": BearingFriction(tau_pos=[[0, 2]]), "wheel": Inertia(J=1.0, phi=0.0, w=1.0),
        **{f"lamp{k}": Blink(long=0.05) for k in range(others)},
    }  # fmt: skip
    run = simulate(Assembly("d", parts=parts, series={"s": ["brake", "wheel"]}), 1.0)
    found, left = bands_of(run)
    assert len(found) == shown
    assert found[0].mode == "brake.mode"
    assert found[0].held == {"stuck"}
    assert found[0].spans == ((0.0, pytest.approx(0.5), "forward"), (pytest.approx(0.5), 1.0, "stuck"))
    assert not left


def test_what_is_short_is_measured_by_the_length_of_the_run() -> None:
    """It begins at 10 s: 0.1 ms of its second can be seen."""
    (band,), _ = bands_of(simulate(Blink(first=10.8, long=1e-4, second=10.9), 11.0, t0=10.0, points=2))
    assert [name for *_, name in band.spans] == ["low", "high", "again", "last"]


def test_a_mode_that_lasts_too_short_to_be_seen_has_no_band() -> None:
    for long, seen in ((5e-6, ["low", "again", "last"]), (0.05, ["low", "high", "again", "last"])):
        (band,), left = bands_of(simulate(Blink(long=long), 1.0, points=2))
        assert [name for *_, name in band.spans] == seen
        assert not left
