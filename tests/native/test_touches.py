"""Runs that touch a limit and turn back: derivatives are refused where both sides differ, else right."""

from pathlib import Path

import numpy as np
import pytest

from components import Clutch, Inertia, Sine, Torque
from modelica_like import Assembly, build, sensitivities, simulate
from modelica_like.analyse.sensitivity.by_run_time import differentiated_run
from modelica_like.errors import NoGradient
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    cos,
    der,
    param,
    var,
    when,
    where,
)
from modelica_like.runs.readings import read_output
from modelica_like.simulation import plan

EXAMPLES = Path(__file__).parents[2] / "examples"
TOLERANCES = pytest.mark.parametrize("rtol", [1e-6, 1e-9])


def gradient_of(drive, until, of, by, rtol):
    handle = build(drive).native(outputs=of, by=by, rtol=rtol)
    handle.reset(until=until)
    handle.step(until)
    return handle.gradient()


class Rolling(Component):
    """A ball that rolls uphill from 2 m/s, with -2 m/s2: it turns back at 1 m, where a stop may be."""

    units_checked = False
    x: Variable = var("1", "way", default=0.0)
    v: Variable = var("1", "speed", default=2.0)
    a: Parameter = param("1", "deceleration", default=2.0)
    stop: Parameter = param("1", "place of the stop", default=1.0)
    e: Parameter = param("1", "restitution", default=0.5)
    free: Parameter = param("1", "another one", default=3.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -self.a + 0 * self.free

    def events(self) -> Events:
        yield when(self.x > self.stop, {self.v: -self.e * self.v})


@TOLERANCES
def test_a_ball_that_just_reaches_a_stop(rtol):
    """A stop nearer by d is hit at a speed of the root of 4 d: the derivative by d has no bound."""
    found = gradient_of(Rolling(), 3.0, ["x", "v"], ["v", "a", "stop", "free"], rtol)
    assert np.isnan(found[:, :3]).all()
    assert not found[:, 3].any()
    sentence = r"no derivatives with respect to stop after t = (1|0\.9999999\d*) s: the guard of .* only touches zero"
    with pytest.raises(NoGradient, match=sentence):
        gradient_of(Rolling(), 3.0, ["v"], ["stop"], 1e-6)


@TOLERANCES
def test_a_ball_beside_its_stop(rtol):
    """It misses a stop behind its way, or hits it at u = (4 - 4 stop)^0.5 and rolls back from there."""
    free = gradient_of(Rolling(stop=1.001), 3.0, ["x", "v"], ["v", "stop"], rtol)
    np.testing.assert_allclose(free, [[3, 0], [1, 0]], atol=1e-9)
    stop, e = 0.99, 0.5
    u = (4 - 4 * stop) ** 0.5
    hit, u_by_stop, hit_by_stop = (2 - u) / 2, -2 / u, 1 / u
    v_by_stop = -e * u_by_stop + 2 * hit_by_stop
    x_by_stop = 1 - e * u_by_stop * (3 - hit) + (e * u + 2 * (3 - hit)) * hit_by_stop
    near = gradient_of(Rolling(stop=stop), 3.0, ["x", "v"], ["stop"], rtol)
    np.testing.assert_allclose(near, [[x_by_stop], [v_by_stop]], rtol=1e-6)


class Sprung(Component):
    """The same way, with a spring at its end: its force begins at zero."""

    units_checked = False
    x: Variable = var("1", "way", default=0.0)
    v: Variable = var("1", "speed", default=2.0)
    c: Parameter = param("1", "stiffness", default=500.0)
    d: Parameter = param("1", "a force that begins at once", default=0.0)
    edge: Parameter = param("1", "its begin", default=1.0)
    mode = Mode("free", "touching")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -2 - self.mode.choose(free=0, touching=self.c * (self.x - self.edge) + self.d)

    def events(self) -> Events:
        yield self.mode.go("free", "touching", when=self.x > self.edge)
        yield self.mode.go("touching", "free", when=self.x < self.edge)


@TOLERANCES
def test_a_spring_that_is_just_reached_has_derivatives(rtol):
    """What it does in a time goes with the cube of this time, the change of the way that it takes with its square.

    Steps add up to the edge but for rounding. So far over it, at u = (2 g over)^0.5, the spring takes 2/3 c u^3 / g^2
    from the speed at the end, and for the 2 s from there on from the way; by v, u changes with v / u.
    """
    found = gradient_of(Sprung(), 3.0, ["x", "v"], ["v", "edge", "c"], rtol)
    v, g, c, over = 2.0, 2.0, 500.0, 1e-13
    bound = 2 * (2 * g * over) ** 0.5 * v * c / g**2
    np.testing.assert_allclose(found, [[3, 0, 0], [1, 0, 0]], atol=2.0 * bound)
    assert np.isnan(gradient_of(Sprung(d=1.0), 3.0, ["x", "c"], ["v", "edge", "c"], rtol)[:, :2]).all()


class Thrown(Component):
    """The same way, with a spring at its end that makes no event."""

    units_checked = False
    x: Variable = var("1", "way", default=0.0)
    v: Variable = var("1", "speed", default=2.0)
    c: Parameter = param("1", "stiffness", default=1e3)
    g: Parameter = param("1", "deceleration", default=2.0)
    edge: Parameter = param("1", "its begin", default=1.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -self.g - self.c * where(self.x > self.edge, self.x - self.edge, 0 * self.x)


@TOLERANCES
@pytest.mark.parametrize("way", [1e-2, 1e-3, 1e-4])
def test_a_spring_that_is_touched_for_less_than_a_step(way, rtol):
    """It is in touch for 2 / c^0.5 atan(u c^0.5 / g), at the speed u, with which it falls back."""

    def law(c, edge, v, g):
        u = (v * v - 2 * g * edge) ** 0.5
        rest = 3.0 - (v - u) / g - 2 / c**0.5 * np.arctan(u * c**0.5 / g)
        return edge - u * rest - g * rest**2 / 2, -u - g * rest

    values, step = {"c": 1e3, "edge": 1 - way, "v": 2.0, "g": 2.0}, 1e-30
    moved = [[value + 1j * step * (k == other) for other, value in enumerate(values.values())] for k in range(4)]
    exact = np.transpose([np.imag(law(*those)) / step for those in moved])
    found = gradient_of(Thrown(edge=1 - way), 3.0, ["x", "v"], [*values], rtol)
    assert np.all(np.abs(found - exact) <= 20 * rtol * np.abs(exact).max(axis=0))


def shaken(capacity, peak=1.0):
    parts = {
        "wave": Sine(amplitude=12.0, f=0.25), "torque": Torque(), "J1": Inertia(J=1.0, phi=0.0, w=0.0),
        "clutch": Clutch(capacity=capacity, peak=peak), "J2": Inertia(J=2.0, w=0.0),
    }  # fmt: skip
    connect = {"wave": ["wave.y", "torque.tau"]}
    return Assembly("shaken", parts=parts, series={"shaft": ["torque", "J1", "clutch", "J2"]}, connect=connect)


@TOLERANCES
def test_a_clutch_whose_torque_just_reaches_its_limit(rtol):
    """It carries 12 N.m 2/3 at most; if that is not more, w = 12 (1 - cos(omega t)) / (3 omega).

    Where it slides with less than what it holds, it would slip from there on; else it slips for a moment, and not by
    the first order.
    """
    by = ["clutch.capacity", "wave.amplitude", "J1.phi"]
    found = gradient_of(shaken(6.4, 1.25), 1.6, ["J1.w", "J1.phi"], by, rtol)
    assert np.isnan(found[:, :2]).all()
    np.testing.assert_allclose(found[:, 2], [0, 1], atol=1e-9)
    omega = np.pi / 2
    for capacity in (8.0, 8.1):
        found = gradient_of(shaken(capacity), 1.6, ["J1.w"], by, rtol)
        np.testing.assert_allclose(found, [[0, (1 - np.cos(1.6 * omega)) / (3 * omega), 0]], rtol=1e-5, atol=1e-9)


@TOLERANCES
def test_a_freewheel_that_just_closes(rtol):
    """At 1.5 s, after whole periods of its torque, its slip is zero; an offset of the torque closes it or not."""
    path = EXAMPLES / "msl" / "rotational" / "OneWayClutch.toml"
    by = ["signalTorque.offset", "oneWayClutch.tau_drag", "inertiaIn.J"]
    found = gradient_of(path, 2.0, ["inertiaIn.w"], by, rtol)
    assert np.isnan(found[0, :2]).all()
    assert np.isfinite(found[0, 2])


def test_what_the_run_time_refuses_is_not_certain_for_optimize():
    model = build(Rolling())
    end, options = plan(model, 3.0, rtol=1e-8, atol=1e-10)
    outputs = [read_output(model, name) for name in ("v", "max(x)", "integral(v)")]
    assert differentiated_run(model, end, options, "given", outputs, ["stop"]) is None
    assert differentiated_run(model, end, options, "given", outputs, ["free"]) is not None


def test_a_guard_that_is_highest_just_at_another_event():
    """Its signal rises to the limit until a clock turns it round: earlier or later, and with another limit."""
    found = gradient_of(Turning(x=0.0), 1.6, ["y"], ["limit", "turn", "gain"], 1e-6)
    assert np.isnan(found).all(axis=0).tolist() == [True, True, False]
    assert found[0, 2] == pytest.approx(1.6, rel=1e-9)


class Turning(Component):
    units_checked = False
    x: Variable = var("1", "signal")
    y: Variable = var("1", "what follows", default=0.0)
    limit: Parameter = param("1", "at which y turns round", default=1 + 1e-9)
    turn: Parameter = param("s", "when the signal turns round", default=1.0)
    gain: Parameter = param("1", "rate of y", default=1.0)
    way = Mode("up", "down")
    level = Mode("below", "above")

    def equations(self) -> Equations:
        yield der(self.x) == self.way.choose(up=1, down=-1)
        yield der(self.y) == self.gain * self.level.choose(below=1, above=-1)

    def events(self) -> Events:
        yield self.way.go("up", "down", at=self.turn)
        yield self.level.go("below", "above", when=self.x > self.limit)


class Swinging(Component):
    """q = s a/3 sin(3 t), and what follows while q > s/3; sizes of s are those of q."""

    units_checked = False
    q: Variable = var("1", "swings", default=0.0)
    y: Variable = var("1", "follows", default=0.0)
    a: Parameter = param("1", "amplitude", default=1.0)
    size: float = 1.0
    mode = Mode("below", "above")

    def equations(self) -> Equations:
        yield der(self.q) == self.size * self.a * cos(3 * self.time)
        yield der(self.y) == self.mode.choose(below=-0.2, above=1.0)

    def events(self) -> Events:
        yield self.mode.go("below", "above", when=self.q > self.size / 3)
        yield self.mode.go("above", "below", when=self.q < self.size / 3)


class Tiny(Swinging):
    size: float = 1e-9
    q: Variable = var("1", "swings", default=0.0, nominal=1e-9)


class Tinier(Swinging):
    size: float = 1e-13
    q: Variable = var("1", "swings", default=0.0, nominal=1e-13)


@pytest.mark.parametrize("kind", [Swinging, Tiny, Tinier])
def test_a_touch_has_no_derivative_in_any_unit(kind):
    """Above for 2/3 (pi - 2 asin(1/a)) until 3 s; from a = 1 on its derivative has no bound."""
    run = simulate(kind(), 3.0, solver="native")
    with pytest.raises(NoGradient, match="No gradient of y by a: 1 is at a kink"):
        sensitivities(run, "y", ["a"])
    a = 1.5
    run = simulate(kind(a=a), 3.0, solver="native")
    found = sensitivities(run, "y", ["a"])
    expected = 1.2 * 4 / 3 / (a * (a**2 - 1) ** 0.5)
    assert found["y", "a"] == pytest.approx(expected, rel=1e-6)
