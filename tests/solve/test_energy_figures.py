"""What an energy balance says, from rows that are given."""

import math
from dataclasses import replace

import pytest

from modelica_like.runs.energy import EnergyBalance, EnergyRow

NONE = EnergyRow("", *[0.0] * 7)
MOTOR = replace(NONE, component="motor", inflow=-100.0, source=100.0)
SPRING = replace(NONE, component="spring", inflow=-20.0, stored=-20.0, residual=3e-3, drift=-2e-3)
BRAKE = replace(NONE, component="brake", inflow=30.0, lost=30.0, residual=-6e-3, drift=1e-3)
LOAD = replace(NONE, component="load", inflow=90.0 - 12e-3, source=-90.0)
BALANCE = EnergyBalance((MOTOR, SPRING, BRAKE, LOAD), 120.0)


def test_totals() -> None:
    assert (BALANCE.source, BALANCE.stored, BALANCE.lost, BALANCE.delivered) == (10.0, -20.0, 30.0, 90.0)
    assert BALANCE["brake"] is BRAKE
    assert list(BALANCE) == [MOTOR, SPRING, BRAKE, LOAD]


def test_efficiency_is_what_loads_take_over_what_sources_and_stores_give() -> None:
    assert BALANCE.efficiency == 0.75
    charged = EnergyBalance((MOTOR, replace(SPRING, stored=25.0), LOAD), 120.0)
    assert charged.efficiency == 0.9
    assert math.isnan(EnergyBalance((LOAD, BRAKE), 120.0).efficiency)


def test_the_largest_error_counts() -> None:
    assert BALANCE.power_closure == pytest.approx(12e-3 / 120)  # at the connections
    assert EnergyBalance((SPRING, replace(BRAKE, inflow=20.0)), 120.0).power_closure == pytest.approx(6e-3 / 120)
    assert BALANCE.drift == pytest.approx(2e-3 / 120)
    assert EnergyBalance((SPRING,), 0.0).drift == 2e-3
    assert EnergyBalance((replace(SPRING, inflow=0.0),), 0.0).power_closure == 3e-3
    assert EnergyBalance((), 0.0).power_closure == EnergyBalance((), 0.0).drift == EnergyBalance((), 0.0).imbalance == 0
    one, other = replace(MOTOR, imbalance=0.1), replace(LOAD, imbalance=0.2)
    assert EnergyBalance((one, other), 120.0).imbalance == EnergyBalance((other, one), 120.0).imbalance == 0.2


def test_what_is_wrong_is_told() -> None:
    assert BALANCE.notices == ()
    assert replace(BALANCE, rows=(replace(SPRING, drift=1e6),)).notices == ()  # a run without a tolerance
    drifts = replace(BALANCE, tolerance=1e-9).notices
    assert len(drifts) == 1
    assert drifts[0].startswith("The stored energy of spring drifts by -0.002 J, 1.7e+04 times the run's")
    assert replace(BALANCE, tolerance=1e-4).notices == ()
    assert len(replace(BALANCE, at_events=1.0).notices) == 1
    assert len(replace(BALANCE, rows=(replace(MOTOR, imbalance=0.1), replace(NONE, gain=2.0))).notices) == 2
