"""Rams that rub: friction comes to rest at dead centres, where nothing holds the crank."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import BearingFriction, ConstantTorque, Inertia, Mass, SliderCrank, SupportFriction
from modelica_like import Assembly, sensitivities, simulate

CRANK, ROD, J, RAM, TORQUE, RUBBING = 0.08, 0.6, 15.0, 420.0, 50.0, 350.0
START = np.radians(10.0)
PARTS = ("motor", "crank", "linkage", "ram", "guide", "bearing")


def press(rubbing=RUBBING, order=PARTS, start=START, bearing=0.0, torque=TORQUE):
    made = {
        "motor": ConstantTorque(tau_constant=torque), "crank": Inertia(J=J, phi=start, w=0),
        "linkage": SliderCrank(r=CRANK, l=ROD), "ram": Mass(m=RAM), "guide": SupportFriction(f_pos=[[0, rubbing]]),
        "bearing": BearingFriction(tau_pos=[[0, bearing]]),
    }  # fmt: skip
    drive = ["motor", "bearing", "crank", "linkage", "ram", "guide"]
    return Assembly("press", parts={name: made[name] for name in order}, series={"drive": drive})


def slope(phi):
    return -CRANK * np.sin(phi) * (1 + CRANK * np.cos(phi) / np.sqrt(ROD**2 - (CRANK * np.sin(phi)) ** 2))


def passes(until, rubbing=RUBBING, start=START, bearing=0.0):
    """Times of the dead centres and the speed at the end: the crank alone, from one dead centre to the next."""

    def rates(_, y):
        phi, w = y
        s, step = slope(phi), 1e-6
        bend = (slope(phi + step) - slope(phi - step)) / (2 * step)
        return [w, (TORQUE - bearing - rubbing * abs(s) - RAM * s * bend * w**2) / (J + RAM * s**2)]

    times, t, y, number = [], 0.0, [start, 0.0], 1
    while t < until:
        dead = lambda _, y, number=number: y[0] - number * np.pi  # noqa: E731
        dead.terminal, dead.direction = True, 1
        part = solve_ivp(rates, (t, until), y, method="DOP853", rtol=1e-12, atol=1e-13, events=dead)
        t, y, number = float(part.t[-1]), part.y[:, -1], number + 1
        times += part.t_events[0].tolist()
    return times, float(y[1])


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("order", [PARTS, PARTS[::-1], ("guide", "bearing", "motor", "ram", "linkage", "crank")])
@pytest.mark.parametrize(("bearing", "degrees"), [(0.0, 10.0), (2.0, 140.0)])
def test_a_guide_with_friction_passes_dead_centres(solver, order, bearing, degrees):
    run = simulate(press(order=order, bearing=bearing, start=np.radians(degrees)), 6.0, solver=solver, rtol=1e-9)
    expected, w = passes(6.0, bearing=bearing, start=np.radians(degrees))
    dead = [event.time for event in run.events if event.mode == "guide.mode" and event.after == "stuck"]
    assert dead == pytest.approx(expected, abs=1e-7)
    assert run["crank.w"][-1] == pytest.approx(w, rel=1e-7)


def test_the_linkage_may_begin_at_its_dead_centre():
    # At rest there, no force on the ram reaches the crank: it starts with the torque alone.
    run = simulate(press(start=0.0), 1e-3)
    assert run["crank.w"][-1] == pytest.approx(TORQUE / J * 1e-3, rel=1e-4)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_guide_that_holds_the_drive_holds_it(solver):
    run = simulate(press(rubbing=1e5, start=1.0), 100.0, solver=solver)
    assert [event for event in run.events if event.time > 0] == []
    assert np.ptp(run["ram.s"]) < 1e-12
    assert run["guide.f"][-1] * -slope(1.0) == pytest.approx(-TORQUE, rel=1e-6)


def test_sensitivities_go_through_dead_centres():
    result = sensitivities(press(), "crank.w", "guide.f_scale", until=3.2, precision=1e-10)
    higher, lower = (passes(3.2, rubbing=RUBBING * scale)[1] for scale in (1 + 1e-4, 1 - 1e-4))
    assert result.derivatives[0, 0] == pytest.approx((higher - lower) / 2e-4, rel=1e-5)
