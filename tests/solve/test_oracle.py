"""Hybrid drives against independent solvers with root finding of their own: scikit-sundae's IDA, SciPy's DOP853."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    BearingFriction,
    Clutch,
    ConstantSpeed,
    ElastoBacklash,
    Fixed,
    Inertia,
    Sine,
    SpringDamper,
    Torque,
)
from modelica_like import simulate
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    connect,
    der,
    param,
    series,
    var,
)

TIGHT = {"rtol": 1e-11, "atol": 1e-13}


class StickSlip(Component):
    """Mass dragged by a spring over dry friction, in rotation: static 2 N.m, sliding 1 N.m, driven at 0.5 rad/s."""

    motor, spring, rotor = ConstantSpeed(w_fixed=0.5), SpringDamper(c=5.0, d=0.0, phi_rel=0.0), Inertia(J=1.0, w=0.0)
    bearing = BearingFriction(tau_pos=((0.0, 1.0),), peak=2.0)

    def equations(self) -> Equations:
        yield from series(self.motor, self.spring, self.rotor, self.bearing)


def stick_slip_by_hand(end: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Times of breaking away and of sticking again, and the angle at the end, by DOP853 from phase to phase."""
    t, phi, away, stick = 0.0, 0.0, [], []
    while True:
        # Sticking: the spring winds up until it reaches the static friction, 5 (0.5 t - phi) = 2.
        t = (2.0 / 5.0 + phi) / 0.5
        if t > end:
            return np.array(away), np.array(stick), phi
        away.append(t)

        def stops(_: float, y: np.ndarray) -> float:
            return y[1]

        stops.terminal, stops.direction = True, -1  # type: ignore[attr-defined]
        slide = solve_ivp(
            lambda s, y: [y[1], 5.0 * (0.5 * s - y[0]) - 1.0],
            (t, end),
            [phi, 0.0],
            "DOP853",
            events=stops,
            rtol=1e-13,
            atol=1e-15,
        )
        phi = slide.y[0, -1]
        if not slide.t_events[0].size:
            return np.array(away), np.array(stick), phi
        t = slide.t_events[0][0]
        stick.append(t)


def test_stick_slip_against_dop853():
    run = simulate(StickSlip(), 20.0, points=50, **TIGHT)
    away, stick, angle = stick_slip_by_hand(20.0)
    assert len(away) >= 5
    found = {
        name: np.array([e.time for e in run.events if e.after == name])
        for name in ("start_forward", "forward", "stuck")
    }
    np.testing.assert_allclose(found["start_forward"], away, rtol=0, atol=1e-8)
    np.testing.assert_allclose(found["stuck"], stick, rtol=0, atol=1e-8)
    np.testing.assert_allclose(found["forward"], away, rtol=0, atol=1e-8)
    assert run.final["rotor.phi"] == pytest.approx(angle, abs=1e-8)


class Rattle(Component):
    """Inertia in backlash between two springs, shaken by a sine torque."""

    ground, play, rotor = Fixed(), ElastoBacklash(c=50.0, b=0.1, d=0.0, phi_rel=0.0, w_rel=0.0), Inertia(J=0.5)
    shaker, wave = Torque(), Sine(amplitude="2 N.m", f="0.7 Hz")

    def equations(self) -> Equations:
        yield from series(self.ground, self.play, self.rotor, self.shaker)
        yield connect(self.wave.y, self.shaker.tau)


def contact(phi: float) -> float:
    """Torque of a spring of 50 N.m/rad beyond 0.05 rad on either side."""
    return 50.0 * (max(phi - 0.05, 0.0) + min(phi + 0.05, 0.0))


def test_backlash_against_dop853():
    """One integration over all edges, with small steps, that looks for both edges itself."""

    def rhs(t: float, y: np.ndarray) -> list[float]:
        return [y[1], (2.0 * np.sin(2 * np.pi * 0.7 * t) - contact(y[0])) / 0.5]

    def upper(_: float, y: np.ndarray) -> float:
        return y[0] - 0.05

    def lower(_: float, y: np.ndarray) -> float:
        return y[0] + 0.05

    reference = solve_ivp(
        rhs,
        (0.0, 5.0),
        [0.0, 0.0],
        "DOP853",
        events=[upper, lower],
        rtol=1e-12,
        atol=1e-14,
        max_step=5e-3,
        dense_output=True,
    )
    run = simulate(Rattle(), 5.0, points=10, **TIGHT)
    found = np.array([e.time for e in run.events if e.mode == "play.contact"])
    assert len(found) >= 10
    np.testing.assert_allclose(found, np.sort(np.concatenate(reference.t_events)), rtol=0, atol=1e-7)
    np.testing.assert_allclose(run["rotor.phi"], reference.sol(run.time)[0], rtol=0, atol=1e-7)


class LockUp(Component):
    """Motor torque rises with time, a clutch takes a load along: it slips, and locks when the speeds agree."""

    left, clutch, right = Inertia(J=0.3, phi=0.0, w=40.0), Clutch(capacity=6.0, phi_rel=0.0), Inertia(J=0.7, w=0.0)
    shaft, load = SpringDamper(c=200.0, d=0.5, phi_rel=0.0), Inertia(J=0.4, w=0.0)

    def equations(self) -> Equations:
        yield from series(self.left, self.clutch, self.right, self.shaft, self.load)


def test_a_lock_up_with_an_elastic_shaft_against_ida():
    """The slipping phase as a DAE with IDA and a root on the slip speed, the locked phase as an ODE with DOP853."""
    import sksundae as sundae

    def residual(t: float, y: np.ndarray, yp: np.ndarray, res: np.ndarray) -> None:
        w1, w2, w3, twist, tau = y
        res[0] = 0.3 * yp[0] + 6.0
        res[1] = 0.7 * yp[1] - 6.0 - tau
        res[2] = 0.4 * yp[2] + tau
        res[3] = yp[3] - (w3 - w2)
        res[4] = tau - 200.0 * twist - 0.5 * (w3 - w2)

    def slip(t: float, y: np.ndarray, yp: np.ndarray, events: np.ndarray) -> None:
        events[0] = y[0] - y[1]

    slip.terminal, slip.direction = [True], [0]  # type: ignore[attr-defined]
    solver = sundae.ida.IDA(residual, rtol=1e-11, atol=1e-13, algebraic_idx=[4], eventsfn=slip, num_events=1)
    first = solver.solve(
        np.array([0.0, 3.0]), np.array([40.0, 0.0, 0.0, 0.0, 0.0]), np.array([-20.0, 6.0 / 0.7, 0.0, 0.0, 0.0])
    )
    moment, (w1, w2, w3, twist, _) = first.t_events[0], first.y_events[0]
    assert w1 == pytest.approx(w2, abs=1e-9)

    def locked(t: float, y: np.ndarray) -> list[float]:
        tau = 200.0 * y[2] + 0.5 * (y[1] - y[0])
        return [tau / 1.0, -tau / 0.4, y[1] - y[0]]

    second = solve_ivp(locked, (moment, 3.0), [w2, w3, twist], "DOP853", rtol=1e-12, atol=1e-14)
    # The clutch holds: the torque through it stays below its capacity.
    through = np.abs(0.3 * np.array([locked(0, y)[0] for y in second.y.T]))
    assert np.max(through) < 6.0
    run = simulate(LockUp(), 3.0, points=30, **TIGHT)
    assert [event.after for event in run.events] == ["stuck"]
    assert run.events[0].time == pytest.approx(moment, abs=1e-8)
    assert run.final["left.w"] == pytest.approx(second.y[0, -1], abs=1e-8)
    assert run.final["load.w"] == pytest.approx(second.y[1, -1], abs=1e-8)
    assert run.final["shaft.phi_rel"] == pytest.approx(second.y[2, -1], abs=1e-9)


class Rod(Component):
    """Pendulum in Cartesian coordinates: y and the rod force follow from implicit equations."""

    L: Parameter = param("m", "length", default=1.5)
    g: Parameter = param("m/s2", "gravity", default=9.81)
    limit: Parameter = param("1/s2", "force over length and mass", default=8.0)
    x: Variable = var("m", "x")
    y: Variable = var("m", "y", guess=-1.0)
    vx: Variable = var("m/s", "velocity")
    vy: Variable = var("m/s", "velocity")
    T: Variable = var("1/s2", "rod force over length and mass")
    rod = Mode("slack", "tight")

    def equations(self) -> Equations:
        yield der(self.x) == self.vx
        yield der(self.y) == self.vy
        yield der(self.vx) == -self.T * self.x
        yield der(self.vy) == -self.T * self.y - self.g
        yield self.x**2 + self.y**2 == self.L**2

    def events(self) -> Events:
        yield self.rod.go("slack", "tight", when=self.limit < self.T)
        yield self.rod.go("tight", "slack", when=self.limit > self.T)


def test_an_event_on_an_implicit_unknown():
    """T = g (3 cos(angle) - 2 cos(first angle)) / L, so the cosine at the event is known."""
    angle = 0.9
    run = simulate(Rod(x=1.5 * np.sin(angle), vx=0.0), 3.0, points=20, **TIGHT)
    cosine = (8.0 * 1.5 / 9.81 + 2 * np.cos(angle)) / 3
    own = [event for event in run.events if event.mode == "rod"]
    assert len(own) >= 4
    for event in own:
        values = run.at(event.time)
        assert values["y"] == pytest.approx(-1.5 * cosine, abs=1e-9)
        assert values["T"] == pytest.approx(8.0, abs=1e-9)
