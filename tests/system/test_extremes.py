"""Drives far from ordinary: ratios of inertia, stiffness, end times and angles; against closed forms."""

from math import cos, exp, pi, sin, sqrt

import pytest

from components import Clutch, ConstantTorque, Inertia, Spring, SpringDamper
from modelica_like import Assembly, Component, Solution, simulate

LONG = ("1 h", "24 h")


def chain(until: float | str, rtol: float = 1e-8, /, **parts: Component) -> Solution:
    """Run parts in a row; the first one may be a source."""
    drive = Assembly("drive", parts=parts, series={"row": tuple(parts)})
    return simulate(drive, until, start="rest", rtol=rtol)


@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e6, 1e9, 1e12])
def test_a_clutch_between_very_different_inertias(ratio):
    """J·dw = capacity·dt with J = J1·J2/(J1 + J2) brings the slip to zero; momentum is kept."""
    small, large = 1.0 / sqrt(ratio), sqrt(ratio)
    together = 1 / (1 / small + 1 / large)
    run = chain(
        2 * together * 10, a=Inertia(J=small, w=10.0), c=Clutch(capacity=1.0), b=Inertia(J=large, w=0.0)
    )  # fmt: skip
    locked = [event.time for event in run.events if event.after == "stuck"]
    assert locked[-1] == pytest.approx(10 * together, rel=1e-9)
    assert run.final["a.w"] == pytest.approx(10 * small / (small + large), rel=1e-9)
    assert run.final["a.w"] == run.final["b.w"]
    assert run.energy().power_closure < 1e-12


@pytest.mark.parametrize("stiffness", [1.0, 1e4, 1e8, 1e12])
def test_an_undamped_spring_of_any_stiffness(stiffness):
    """Equal inertias, 1 rad/s apart: slip cos(omega·t), omega² = 2·c/J; five periods."""
    omega = sqrt(2 * stiffness)
    until = 10.25 * pi / omega
    run = chain(until, 1e-9, a=Inertia(J=1.0, w=1.0), e=Spring(c=stiffness, phi_rel=0.0), b=Inertia(J=1.0, w=0.0))
    assert run.final["a.w"] - run.final["b.w"] == pytest.approx(cos(omega * until), abs=1e-5)
    assert run.final["e.phi_rel"] * omega == pytest.approx(-sin(omega * until), abs=1e-5)


@pytest.mark.parametrize("stiffness", [1.0, 1e4, 1e8, 1e12])
def test_a_stiff_damped_coupling_is_as_good_as_rigid(stiffness):
    """A torque on two equal inertias, for 10 s: the slower one lags by the twist that accelerates it."""
    run = chain(
        10.0, push=ConstantTorque(tau_constant=4.0), a=Inertia(J=1.0, w=0.0),
        e=SpringDamper(c=stiffness, d=10 * sqrt(stiffness), phi_rel=0.0), b=Inertia(J=1.0, w=0.0),
    )  # fmt: skip
    assert run.final["a.w"] + run.final["b.w"] == pytest.approx(40.0, rel=1e-9)
    if stiffness > 1e3:
        assert run.final["b.w"] == pytest.approx(20.0, rel=1e-5)
        assert run.final["e.phi_rel"] * stiffness == pytest.approx(-2.0, rel=1e-5)


@pytest.mark.parametrize(
    "until", ["1 ms", "1 s", "1000 s", *(pytest.param(one, marks=pytest.mark.slow) for one in LONG)]
)
def test_the_end_time_does_not_matter(until):
    """The coupling starts with 0.1 rad/s of slip, which decays; momentum is kept whatever the time."""
    run = chain(
        until, 1e-7, a=Inertia(J=1.0, phi=0.0, w=1.0), e=SpringDamper(c=1e5, d=10.0, phi_rel=0.0, w_rel=0.1),
        b=Inertia(J=1.0),
    )  # fmt: skip
    assert run.final["a.w"] + run.final["b.w"] == pytest.approx(2.1, rel=1e-6)
    time = float(run.time[-1])
    decay, omega = 10.0, sqrt(2e5 - 10.0**2)
    twist = 0.1 * exp(-decay * time) * sin(omega * time) / omega if time < 10 else 0.0
    assert run.final["e.phi_rel"] == pytest.approx(twist, abs=1e-8)


@pytest.mark.parametrize("turned", [0.0, 1e3, 1e6, 1e9])
def test_angles_without_bound_cost_no_precision(turned):
    """The twist of a coupling that has turned by so many radians is as precise as that of a new one."""
    run = chain(
        2.0, 1e-9, push=ConstantTorque(tau_constant=2.0), a=Inertia(J=1.0, phi=turned, w=500.0),
        e=SpringDamper(c=1e4, d=200.0, phi_rel=0.0), b=Inertia(J=1.0, w=500.0),
    )  # fmt: skip
    assert run.final["e.phi_rel"] == pytest.approx(-1e-4, rel=1e-7)
    assert run.final["b.w"] == pytest.approx(502.0, rel=1e-9)


def test_a_day_of_turning_ends_at_a_large_angle():
    """12,000 rad/s for 24 h: 1.04e9 rad, and the coupling still carries just the torque that accelerates."""
    run = chain(
        "24 h", 1e-8, push=ConstantTorque(tau_constant=2e-3), a=Inertia(J=1.0, phi=0.0, w=12000.0),
        e=SpringDamper(c=1e3, d=50.0, phi_rel=0.0), b=Inertia(J=1.0, w=12000.0),
    )  # fmt: skip
    day = 86400.0
    assert run.final["a.phi"] == pytest.approx(12000.0 * day + 0.5 * 1e-3 * day**2, rel=1e-8)
    assert run.final["e.phi_rel"] == pytest.approx(-1e-6, rel=1e-4)
