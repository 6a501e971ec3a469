"""Start from rest: what nothing moves stands still, whatever the order of parts and lines."""

import itertools
from math import cos, sin, sqrt

import pytest

from components import (
    Clutch,
    Damper,
    IdealGear,
    IdealPlanetary,
    Inertia,
    Spring,
    SpringDamper,
)
from modelica_like.errors import ContradictingStart
from modelica_like.language import Component, Equations, Parameter, Variable, connect, der, guess, param, series, var
from modelica_like.netlist import loads

ENGINE = {
    "a": 'a = { is = "Inertia", J = 1.58, w = -7.7 }',
    "b": 'b = { is = "Inertia", J = 0.3 }',
    "e": 'e = { is = "SpringDamper", c = 200, d = 0.025 }',
}
CAR = {
    "engine": 'engine = { is = "Inertia", J = 0.2, w = "900 rpm" }',
    "clutch": 'clutch = { is = "Clutch", capacity = 300 }',
    "gear": 'gear = { is = "IdealGear", ratio = 12 }',
    "wheel": 'wheel = { is = "Inertia", J = 0.8 }',
}


def started(start, lines, series):
    text = "\n".join(["[parts]", *lines, "[series]", f"shaft = {list(series)}".replace("'", '"')])
    return start(loads(text), "rest")


@pytest.mark.parametrize("order", list(itertools.permutations(ENGINE)))
@pytest.mark.parametrize("series", [("a", "e", "b"), ("b", "e", "a")])
def test_behind_a_spring_a_part_turns_along(start, order, series):
    found = started(start, [ENGINE[name] for name in order], series)
    assert (found["a.w"], found["b.w"], found["e.w_rel"]) == (-7.7, -7.7, 0.0)
    assert found["e.phi_rel"] == 0.0


@pytest.mark.parametrize("order", list(itertools.permutations(CAR)))
def test_behind_an_open_clutch_the_car_stands(start, order):
    found = started(start, [CAR[name] for name in order], ["engine", "clutch", "gear", "wheel"])
    assert found["wheel.w"] == 0.0
    assert found["engine.w"] == pytest.approx(94.24777960769379, rel=1e-15)
    assert found["clutch.mode"] == "backward"


def test_a_relative_speed_that_is_given_takes_the_other_side_along(start):
    class Drive(Component):
        a, e, b = Inertia(J=1.0, w=3.0), SpringDamper(c=100.0, d=1.0, w_rel=-1.0), Inertia(J=2.0)

        def equations(self) -> Equations:
            yield from series(self.a, self.e, self.b)

    assert start(Drive(), "rest")["b.w"] == 2.0


def test_a_spring_is_without_load_before_angles_are_zero(start):
    class Drive(Component):
        a, e, b = Inertia(J=1.0, phi=2.0), Spring(c=100.0), Inertia(J=2.0)

        def equations(self) -> Equations:
            yield from series(self.a, self.e, self.b)

    found = start(Drive(), "rest")
    assert (found["e.tau"], found["b.phi"]) == (0.0, 2.0)


def test_the_shafts_of_a_planetary_gear_stand_as_far_as_one_may_turn(start):
    """Of ring and carrier one must turn; the first by name stands."""

    class Gear(Component):
        box = IdealPlanetary(ratio=2.0)
        sun, ring, carrier = Inertia(J=1.0, w=6.0), Inertia(J=1.0), Inertia(J=1.0)

        def equations(self) -> Equations:
            yield connect(self.sun.flange_b, self.box.sun)
            yield connect(self.ring.flange_b, self.box.ring)
            yield connect(self.carrier.flange_b, self.box.carrier)

    found = start(Gear(), "rest")
    assert (found["carrier.w"], found["ring.w"]) == (0.0, -3.0)


class Parallel(Component):
    a, b = Inertia(J=1.0, w=1.0), Inertia(J=1.0, w=0.0)
    c, d = Clutch(capacity=1.0), Clutch(capacity=1.0, creep=1e-9)

    def equations(self) -> Equations:
        yield from series(self.a, self.c, self.b)
        yield from series(self.a, self.d, self.b)


def test_two_clutches_in_parallel_need_no_angle(start):
    found = start(Parallel(), "rest")
    assert (found["a.w"], found["b.w"], found["c.phi_rel"], found["d.phi_rel"]) == (1.0, 0.0, 0.0, 0.0)


def test_of_two_clutches_in_parallel_one_may_have_an_angle(start):
    """The default of the other gives way."""
    found = start(Parallel(), "rest", d__phi_rel=0.25)
    assert (found["c.phi_rel"], found["d.phi_rel"]) == (0.25, 0.25)


def test_two_angles_of_clutches_in_parallel_must_agree(start):
    found = start(Parallel(), "rest", c__phi_rel=0.25, d__phi_rel=0.25)
    assert found["b.phi"] - found["a.phi"] == pytest.approx(0.25, rel=1e-15)
    with pytest.raises(ContradictingStart, match=r"d\.phi_rel = 0\.5 .*: d\.phi_rel would be 0\.25\."):
        start(Parallel(), "rest", c__phi_rel=0.25, d__phi_rel=0.5)


def test_two_gears_with_the_same_ratio_around_a_loop_may_turn(start):
    """By structure two gears between the same shafts stop them; only numbers say that they do not."""

    class Loop(Component):
        a, b = Inertia(J=1.0, w=7.0), Inertia(J=1.0)
        first, second = IdealGear(ratio=3.0), IdealGear(ratio=3.0)
        soft, damper = SpringDamper(c=10.0, d=0.0), Damper(d=1.0)

        def equations(self) -> Equations:
            yield from series(self.a, self.first, self.soft, self.b)
            yield from series(self.a, self.second, self.damper, self.b)

    found = start(Loop(), "rest")
    assert (found["b.w"], found["soft.phi_rel"]) == (pytest.approx(7.0 / 3.0, rel=1e-12), 0.0)  # along by the spring
    assert found["damper.w_rel"] == pytest.approx(0.0, abs=1e-15)


class Pendulum(Component):
    """Point mass on a rod, in Cartesian coordinates."""

    m: Parameter = param("kg", "mass", default=2.0)
    L: Parameter = param("m", "length", default=1.0)
    g: Parameter = param("m/s2", "gravity", default=9.81)
    x: Variable = var("m", "x")
    y: Variable = var("m", "y")
    u: Variable = var("m/s", "velocity along x")
    v: Variable = var("m/s", "velocity along y")
    F: Variable = var("N", "force of the rod")

    def equations(self) -> Equations:
        yield der(self.x) == self.u
        yield der(self.y) == self.v
        yield self.m * der(self.u) == -self.F * self.x / self.L
        yield self.m * der(self.v) == -self.F * self.y / self.L - self.m * self.g
        yield self.x**2 + self.y**2 == self.L**2


@pytest.mark.parametrize("side", [1, -1])
def test_a_pendulum_starts_where_its_height_says(start, side):
    """x² = 1 - y², x u = -y v, F / L = m (u² + v² - g y) / L²."""
    found = start(Pendulum(y=-0.6, v=0.1, x=guess(0.8 * side)))
    assert found["x"] == pytest.approx(0.8 * side, rel=1e-14)
    assert found["u"] == pytest.approx(0.075 * side, rel=1e-14)
    assert found["F"] == pytest.approx(2.0 * (0.075**2 + 0.1**2 + 9.81 * 0.6), rel=1e-13)


def test_a_pendulum_at_rest_hangs_still(start):
    found = start(Pendulum(x=0.6, y=guess(-1.0)), "rest")
    assert (found["u"], found["v"]) == (0.0, 0.0)
    assert found["y"] == pytest.approx(-0.8, rel=1e-14)


@pytest.mark.parametrize(
    "joint",
    [
        'is = "UniversalJoint", beta = "20 deg"',
        'is = "FourBar", crank = 0.03, coupler = 0.09, rocker = 0.07, ground = 0.1',
    ],
)
@pytest.mark.parametrize("speed", [None, 3.0])
def test_speeds_at_rest_determine_no_angle(start, joint, speed):
    """A speed ratio that depends on the angle is none where nothing turns: the angle is free, and zero."""
    w = "" if speed is None else f", w = {speed}"
    parts = [f'a = {{ is = "Inertia", J = 0.1{w} }}', f"joint = {{ {joint} }}", 'b = { is = "Inertia", J = 0.2 }']
    point = started(start, parts, ("a", "joint", "b"))
    assert point["a.phi"] == 0.0
    assert (point["b.w"] == 0.0) == (point["a.w"] == 0.0) == (speed is None)


def test_a_position_that_no_angle_leads_to_is_not_zero(start):
    """The slide of a crank in a housing that may turn is 150 to 250 mm away: the housing's angle is zero."""
    crank = loads("""
        [parts]
        wheel = { is = "Inertia", J = 0.1, phi = 1 }
        crank = { is = "SliderCrank", r = 0.05, l = 0.2 }
        slide = { is = "Mass", m = 1 }
        housing = { is = "Inertia", J = 5 }
        [series]
        drive = ["wheel", "crank", "slide"]
        [connect]
        carried = ["crank.support", "housing.flange_a"]
    """)
    point = start(crank, "rest")
    assert point["housing.phi"] == 0.0
    assert point["slide.s"] == pytest.approx(0.05 * cos(1) + sqrt(0.2**2 - (0.05 * sin(1)) ** 2), rel=1e-12)
