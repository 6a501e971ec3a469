"""Runs whose numbers lose energy."""

import pytest

from components import Flange, Inertia
from modelica_like import Options, simulate
from modelica_like.errors import EnergyDrift
from modelica_like.language import Component, Equations, Expr, Parameter, Variable, param, series, var, where


class Jumping(Component):
    """A spring whose declared energy jumps, although its torque does not."""

    flange_a = Flange("left end")
    flange_b = Flange("right end")
    c: Parameter = param("N.m/rad", "stiffness", min=0)
    offset: Parameter = param("J", "jump of the energy")
    twist: Variable = var("rad", "twist")

    def equations(self) -> Equations:
        yield self.twist == self.flange_b.phi - self.flange_a.phi
        yield self.flange_b.tau == self.c * self.twist
        yield self.flange_a.tau == -self.c * self.twist

    def stored_energy(self) -> Expr:
        return self.c * self.twist**2 / 2 + where(self.twist > 0.05, self.offset, 0.0)


class Swing(Component):
    left = Inertia(J=1, phi=0, w=0)
    spring = Jumping(c=100, offset=1)
    right = Inertia(J=1, phi=0.1, w=0)

    def equations(self) -> Equations:
        yield from series(self.left, self.spring, self.right)


def test_what_stays_open_is_refused_with_part_and_time():
    # 0.1·cos(√200·t) = 0.05 at t = π/(3·√200) = 0.0740480 s
    with pytest.raises(EnergyDrift) as caught:
        simulate(Swing(), 0.1)
    assert str(caught.value) == (
        "Between 0.074 s and 0.0742 s the stored energy of spring changes by 1 J less than its power explains, also "
        "with steps of at most 3.91e-07 s.\n"
        "The integrator steps over something, or the energy that the component declares jumps.\n"
        'Look there: simulate(…, options=Options(on_energy_drift="note")) returns the run as it is.'
    )
    assert caught.value.run.time[-1] == pytest.approx(0.1)


def test_an_option_shows_the_run():
    run = simulate(Swing(), 0.1, options=Options(on_energy_drift="note"))
    assert run.notices == (
        "Between 0.074 s and 0.0742 s the stored energy of spring changes by 1 J less than its power explains.",
    )
    assert simulate(Swing(), 0.1, options=Options(on_energy_drift="off")).notices == ()
