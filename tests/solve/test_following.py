"""States that follow the motion: mechanisms in coordinates, against their angles and independent solvers."""

import inspect
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from components import Brake, ConstantTorque, IdealGear, Inertia, Step
from components.translational.linkages import TwoFlanges
from modelica_like import Assembly, linearize, load, sensitivities, simulate
from modelica_like.fmi.cosimulation.split import split
from modelica_like.language import Component, Equations, Parameter, Variable, cos, der, guess, param, sin, var
from modelica_like.language.expr import TIME
from modelica_like.netlist.registry import find_type
from modelica_like.show.report.run import statistics_line

PARTS = Path(__file__).parents[2] / "examples" / "elements"
L, G = 1.5, 9.81
CRANK, ROD, M_PIN, M_SLIDER = 0.1, 0.3, 0.5, 0.8
BARS = {"crank": 0.1, "coupler": 0.25, "rocker": 0.2, "ground": 0.28}
J, J_COUPLER, J_ROCKER = 0.01, 0.002, 0.02


def part(name, **values):
    return find_type(f"full_turns:{name}", PARTS)(**values)


def pendulum(speed=9.5, **values):
    """Hanging, with a speed; from 2·sqrt(g·L) = 7.67 m/s on it turns over."""
    return part("Pendulum", **{"m": 2.0, "L": L, "g": G, "x": 0.0, "vx": speed, "y": guess(-L), **values})


def swing(speed, until, g=G):
    """The angle of the pendulum by an explicit solver of order eight, from the lowest point on."""
    return solve_ivp(
        lambda _, y: [y[1], -g / L * np.sin(y[0])], (0, until), [0, speed / L],
        method="DOP853", rtol=1e-13, atol=1e-13, dense_output=True,
    ).sol  # fmt: skip


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("speed", [9.5, 7.0])
def test_the_pendulum_turns_over_as_its_angle_says(solver, speed):
    run = simulate(pendulum(speed), 3.0, solver=solver, rtol=1e-12, atol=1e-13)
    angle, rate = swing(speed, 3.0)(run.time)
    assert run["x"] == pytest.approx(L * np.sin(angle), abs=1e-8)
    assert run["y"] == pytest.approx(-L * np.cos(angle), abs=1e-8)
    assert run["vx"] == pytest.approx(L * rate * np.cos(angle), abs=1e-7)
    assert len(run.events) >= 5


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_the_pendulum_does_not_drift_in_a_hundred_seconds(solver):
    run = simulate(pendulum(), 100.0, points=1000, solver=solver, rtol=1e-9, atol=1e-10)
    turns = np.sum(np.diff(np.sign(run["x"])) != 0) / 2
    assert turns > 60
    assert np.max(np.abs(run["x"] ** 2 + run["y"] ** 2 - L**2)) < 1e-10
    assert np.max(np.abs(run["x"] * run["vx"] + run["y"] * run["vy"])) < 1e-10
    energy = run.energy()
    assert energy.power_closure < 1e-10 * energy.throughput
    assert np.ptp((run["vx"] ** 2 + run["vy"] ** 2) / 2 + G * run["y"]) < 5e-6 * 9.5**2 / 2


def test_it_starts_where_each_coordinate_alone_would_be_singular():
    """Horizontal with y given; hanging with x given, as in the other tests."""
    horizontal = simulate(pendulum(0.0, x=guess(L), y=0.0, vx=guess(0.0), vy=0.0), 1.0, rtol=1e-10, atol=1e-12)
    speed = np.hypot(horizontal["vx"], horizontal["vy"])
    assert speed == pytest.approx(np.sqrt(np.maximum(-2 * G * horizontal["y"], 0)), abs=1e-7)
    # It stores nothing in all; its energies are judged by their sizes.
    energy = horizontal.energy()
    assert energy.throughput > 0.1 * 2.0 * G * L
    assert energy.power_closure < 1e-9
    assert energy.drift < 1e-6


def test_each_choice_is_told_with_its_reason():
    run = simulate(pendulum(), 1.0)
    assert {event.mode for event in run.events} == {"state[1].choice"}
    because = run.model.events.transitions[run.events[0].transition].because
    assert because == "the states of x and y would become singular"
    assert f"{len(run.events)} mode changes ({len(run.events)} of them choices of states)" in statistics_line(run)


def test_a_pendulum_in_modelica_text_turns_over(tmp_path):
    """The start value of y is not fixed: it is a guess."""
    (tmp_path / "pendulum.mo").write_text("""
model Pendulum
  parameter Real L = 1.5;
  Real x(start = 0, fixed = true);
  Real y(start = -1.5);
  Real vx(start = 9.5, fixed = true);
  Real vy;
  Real pull;
equation
  der(x) = vx;
  der(y) = vy;
  der(vx) = -pull*x;
  der(vy) = -pull*y - 9.81;
  x^2 + y^2 = L^2;
end Pendulum;
""")
    run = simulate(tmp_path / "pendulum.mo", 2.0, rtol=1e-11, atol=1e-12)
    assert run["x"] == pytest.approx(L * np.sin(swing(9.5, 2.0)(run.time)[0]), abs=1e-8)


def test_no_variable_jumps_at_a_choice():
    run = simulate(pendulum(), 2.0, rtol=1e-10, atol=1e-12)
    for event in run.events:
        sides = np.flatnonzero(np.isclose(run.time, event.time, rtol=0, atol=1e-13))
        assert len(sides) == 2
        for name in ("x", "y", "vx", "vy", "pull"):
            assert np.ptp(run[name][sides]) < 1e-9


def test_sensitivities_go_through_choices():
    run = simulate(pendulum(), 2.0, rtol=1e-10, atol=1e-12)
    assert len(run.events) > 5
    found = sensitivities(run, ["x", "y"], ["g"]).derivatives[:, 0]
    step = 1e-4
    after, before = (swing(9.5, 2.0, G + side)(2.0)[0] for side in (step, -step))
    slope = (after - before) / (2 * step)
    angle = swing(9.5, 2.0)(2.0)[0]
    assert found == pytest.approx([L * np.cos(angle) * slope, L * np.sin(angle) * slope], rel=1e-5)


def test_it_linearizes():
    hanging = linearize(pendulum(0.0), "given")
    assert hanging.states == ("state[1]", "der(state[1])")
    assert np.linalg.eigvals(hanging.A).imag.max() == pytest.approx(np.sqrt(G / L), rel=1e-9)


@pytest.mark.parametrize("near", [(0.3, -1.4), (1.45, -0.3)])
def test_it_finds_its_rest(near):
    """From the second guess on, the first weights do not fit the rest: they are chosen again at the start."""
    drive = pendulum(0.0, x=guess(near[0]), vx=guess(0.0), y=guess(near[1]))
    rest = simulate(drive, 1.0, start="steady")
    assert len(rest.events) == (near[0] > 1)
    assert rest["x"] == pytest.approx(0.0, abs=1e-9)
    assert rest["y"] == pytest.approx(-L, rel=1e-12)


class DoublePendulum(Component):
    """Two equal masses on two equal rods: two constraints that share variables, four states."""

    m: Parameter = param("kg", "masses", default=1)
    g: Parameter = param("m/s2", "gravity", default=G)
    L: Parameter = param("m", "lengths of the rods", default=1)
    x: Variable = var("m", "first mass")
    y: Variable = var("m", "first mass")
    vx: Variable = var("m/s", "first mass")
    vy: Variable = var("m/s", "first mass")
    pull: Variable = var("N/m", "force of the first rod over its length")
    u: Variable = var("m", "second mass")
    v: Variable = var("m", "second mass")
    vu: Variable = var("m/s", "second mass")
    vv: Variable = var("m/s", "second mass")
    hold: Variable = var("N/m", "force of the second rod over its length")

    def equations(self) -> Equations:
        x, y, u, v = self.x, self.y, self.u, self.v
        for place, speed in ((x, self.vx), (y, self.vy), (u, self.vu), (v, self.vv)):
            yield der(place) == speed
        yield self.m * der(self.vx) == self.hold * (u - x) - self.pull * x
        yield self.m * der(self.vy) == self.hold * (v - y) - self.pull * y - self.m * self.g
        yield self.m * der(self.vu) == -self.hold * (u - x)
        yield self.m * der(self.vv) == -self.hold * (v - y) - self.m * self.g
        yield x**2 + y**2 == self.L**2
        yield (u - x) ** 2 + (v - y) ** 2 == self.L**2


def test_a_double_pendulum_falls_as_its_angles_say():
    def rates(_, state):
        a, b, p, q = state
        mass = [[2, np.cos(a - b)], [np.cos(a - b), 1]]
        force = [-np.sin(a - b) * q**2 - 2 * G * np.sin(a), np.sin(a - b) * p**2 - G * np.sin(b)]
        return [p, q, *np.linalg.solve(mass, force)]

    drive = DoublePendulum(x=guess(1), y=0, vx=guess(0), vy=0, u=guess(2), v=0, vu=guess(0), vv=0)
    run = simulate(drive, 2.0, rtol=1e-11, atol=1e-13)
    expected = solve_ivp(
        rates, (0, 2), [np.pi / 2, np.pi / 2, 0, 0], "DOP853", rtol=1e-13, atol=1e-13, dense_output=True
    )
    a, b, *_ = expected.sol(run.time)
    assert len(run.events) >= 4
    assert run["x"] == pytest.approx(np.sin(a), abs=1e-8)
    assert run["u"] == pytest.approx(np.sin(a) + np.sin(b), abs=1e-8)
    assert np.max(np.abs((run["u"] - run["x"]) ** 2 + (run["v"] - run["y"]) ** 2 - 1)) < 1e-10


class Swung(Component):
    """A pendulum whose pivot moves to and fro: the constraint depends on time."""

    m: Parameter = param("kg", "mass", default=1)
    g: Parameter = param("m/s2", "gravity", default=G)
    L: Parameter = param("m", "length", default=L)
    A: Parameter = param("m", "amplitude of the pivot", default=0.3)
    W: Parameter = param("rad/s", "frequency of the pivot", default=7)
    x: Variable = var("m", "to the right")
    y: Variable = var("m", "upwards")
    vx: Variable = var("m/s", "to the right")
    vy: Variable = var("m/s", "upwards")
    pull: Variable = var("N/m", "force of the rod over its length")

    def equations(self) -> Equations:
        across = self.x - self.A * sin(self.W * TIME)
        yield der(self.x) == self.vx
        yield der(self.y) == self.vy
        yield self.m * der(self.vx) == -self.pull * across
        yield self.m * der(self.vy) == -self.pull * self.y - self.m * self.g
        yield across**2 + self.y**2 == self.L**2


def test_the_pivot_may_move():
    run = simulate(Swung(x=0, y=guess(-L), vx=9.0), 3.0, rtol=1e-12, atol=1e-13)

    def rates(t, state):
        pivot = 0.3 * 7**2 * np.sin(7 * t)
        return [state[1], (pivot * np.cos(state[0]) - G * np.sin(state[0])) / L]

    expected = solve_ivp(rates, (0, 3), [0, (9 - 0.3 * 7) / L], "DOP853", rtol=1e-13, atol=1e-13, dense_output=True)
    assert len(run.events) >= 4
    found = L * np.sin(expected.sol(run.time)[0]) + 0.3 * np.sin(7 * run.time)
    assert run["x"] == pytest.approx(found, abs=1e-8)


class Skate(Component):
    """A skate that turns evenly on a slope: its constraint is between speeds. S. A. Chaplygin."""

    m: Parameter = param("kg", "mass", default=1)
    g: Parameter = param("m/s2", "gravity along the slope", default=G)
    w: Parameter = param("rad/s", "speed of turning", default=2)
    x: Variable = var("m", "downwards")
    y: Variable = var("m", "across")
    vx: Variable = var("m/s", "downwards")
    vy: Variable = var("m/s", "across")
    side: Variable = var("N", "force across the blade")

    def equations(self) -> Equations:
        angle = self.w * TIME
        yield der(self.x) == self.vx
        yield der(self.y) == self.vy
        yield self.m * der(self.vx) == self.side * sin(angle) + self.m * self.g
        yield self.m * der(self.vy) == -self.side * cos(angle)
        yield self.vx * sin(angle) == self.vy * cos(angle)


@pytest.mark.parametrize(("w", "until"), [(2.0, 5.0), (0.2, 30.0)])
def test_a_constraint_may_be_between_speeds(w, until):
    run = simulate(Skate(w=w, x=0, y=0, vx=0), until, rtol=1e-10, atol=1e-12)
    assert run.model.states == ("x", "y", "state[1]")
    angle = w * run.time
    assert len(run.events) >= 4
    assert run["x"] == pytest.approx(G / (2 * w**2) * np.sin(angle) ** 2, abs=4e-7 / w**2)
    assert run["y"] == pytest.approx(G / (2 * w**2) * (angle - np.sin(angle) * np.cos(angle)), abs=4e-7 / w**2)


class Loop(TwoFlanges):
    """A four-bar linkage without masses between two shafts; a linkage of the library has a closed form instead."""

    beta: Variable = var("rad", "angle of the coupler")
    fx: Variable = var("N", "force of the coupler")
    fy: Variable = var("N", "force of the coupler")
    crank: Parameter = param("m", "length", default=0.1)
    coupler: Parameter = param("m", "length", default=0.25)
    rocker: Parameter = param("m", "length", default=0.2)
    ground: Parameter = param("m", "length", default=0.28)

    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield self.crank * cos(a.phi) + self.coupler * cos(self.beta) == self.ground + self.rocker * cos(b.phi)
        yield self.crank * sin(a.phi) + self.coupler * sin(self.beta) == self.rocker * sin(b.phi)
        yield self.fy * cos(self.beta) == self.fx * sin(self.beta)
        yield a.tau + self.crank * (self.fy * cos(a.phi) - self.fx * sin(a.phi)) == 0
        yield b.tau == self.rocker * (self.fy * cos(b.phi) - self.fx * sin(b.phi))


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("order", [("brake", "loop", "rocker"), ("loop", "rocker", "brake")])
def test_a_brake_holds_a_linkage_in_a_drive(solver, order):
    """Behind a gear; the brake's speed is no state, and it stays stuck all the same."""
    parts = {
        "motor": ConstantTorque(tau_constant=0.05), "rotor": Inertia(J=1e-3, phi=0.0, w=100.0),
        "loop": Loop(beta=guess(1.0)), "rocker": Inertia(J=0.02, phi=guess(1.5)), "brake": Brake(fn_max=50.0),
        "step": Step(height=1.0, start_time=0.5), "gear": IdealGear(ratio=5),
    }  # fmt: skip
    series = {"shaft": ["motor", "rotor", "gear", *order]}
    drive = Assembly("drive", parts=parts, series=series, connect={"acts": ["step.y", "brake.f_normalized"]})
    run = simulate(drive, 2.0, solver=solver, rtol=1e-9)
    assert "loop.state[1]" in run.model.states
    assert run.events[-1].after == "stuck"
    held = run.time > run.events[-1].time + 1e-9
    assert np.ptp(run["rotor.phi"][held]) < 1e-12
    closes = 0.1 * np.exp(1j * run["gear.flange_b.phi"]) + 0.25 * np.exp(1j * run["loop.beta"])
    assert closes == pytest.approx(0.28 + 0.2 * np.exp(1j * run["rocker.phi"]), abs=1e-10)
    assert run.energy().power_closure < 1e-9 * run.energy().throughput


def engine():
    return part(
        "SliderCrank", crank=CRANK, rod=ROD, m_pin=M_PIN, m_slider=M_SLIDER,
        x=guess(CRANK), y=0.0, s=guess(CRANK + ROD), vy=2.0,
    )  # fmt: skip


def engine_inertia(phi):
    """Moment of inertia of the whole at the crank."""
    slope = -CRANK * np.sin(phi) * (1 + CRANK * np.cos(phi) / np.sqrt(ROD**2 - (CRANK * np.sin(phi)) ** 2))
    return M_PIN * CRANK**2 + M_SLIDER * slope**2


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_the_slider_crank_passes_its_dead_centres(solver):
    run = simulate(engine(), 3.0, points=1000, solver=solver, rtol=1e-10, atol=1e-12)
    x, y, s = run["x"], run["y"], run["s"]
    phi = np.unwrap(np.arctan2(y, x))
    assert phi[-1] > 12 * np.pi
    assert np.max(np.abs(x**2 + y**2 - CRANK**2)) < 1e-10
    assert np.max(np.abs((s - x) ** 2 + y**2 - ROD**2)) < 1e-10
    assert s == pytest.approx(CRANK * np.cos(phi) + np.sqrt(ROD**2 - (CRANK * np.sin(phi)) ** 2), abs=1e-10)
    # Without forces from outside, the inertia times the square of the speed stays: time is an integral over the angle.
    speed = (x * run["vy"] - y * run["vx"]) / CRANK**2
    start = engine_inertia(0.0) * (2.0 / CRANK) ** 2
    assert engine_inertia(phi) * speed**2 == pytest.approx(start, rel=1e-6)
    needed = quad(lambda a: np.sqrt(engine_inertia(a) / start), 0, phi[-1], limit=500, epsabs=1e-11)[0]
    assert needed == pytest.approx(3.0, abs=1e-6)


def rocker_of(phi):
    """Angles of coupler and rocker of the linkage that is not crossed, and their speeds over that of the crank."""
    a, b, c, d = BARS.values()
    px, py = a * np.cos(phi), a * np.sin(phi)
    far = np.hypot(d - px, py)
    psi = np.pi + np.arctan2(-py, d - px) - np.arccos((far**2 + c**2 - b**2) / (2 * far * c))
    beta = np.arctan2(c * np.sin(psi) - py, d + c * np.cos(psi) - px)
    return (
        beta,
        psi,
        a * np.sin(psi - phi) / (b * np.sin(beta - psi)),
        a * np.sin(beta - phi) / (c * np.sin(beta - psi)),
    )


def linkage_inertia(phi):
    _, _, of_coupler, of_rocker = rocker_of(phi)
    return J + J_COUPLER * of_coupler**2 + J_ROCKER * of_rocker**2


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_the_four_bar_linkage_turns_round(solver):
    beta, psi, *_ = rocker_of(0.0)
    drive = part(
        "FourBar", **BARS, J=J, J_coupler=J_COUPLER, J_rocker=J_ROCKER,
        phi=0.0, w=20.0, beta=guess(beta + 0.1), psi=guess(psi - 0.1),
    )  # fmt: skip
    run = simulate(drive, 3.0, solver=solver, rtol=1e-10, atol=1e-12)
    phi, turned = run["phi"], (run["beta"], run["psi"])
    assert phi[-1] > 8 * np.pi
    a, b, c, d = BARS.values()
    closes = a * np.exp(1j * phi) + b * np.exp(1j * turned[0]) - c * np.exp(1j * turned[1]) - d
    assert np.max(np.abs(closes)) < 1e-10
    for angle, expected in zip(turned, rocker_of(phi), strict=False):
        assert np.exp(1j * angle) == pytest.approx(np.exp(1j * expected), abs=1e-9)
    start = linkage_inertia(0.0) * 20.0**2
    assert linkage_inertia(phi) * run["w"] ** 2 == pytest.approx(start, rel=1e-6)
    needed = quad(lambda angle: np.sqrt(linkage_inertia(angle) / start), 0, phi[-1], limit=500, epsabs=1e-11)[0]
    assert needed == pytest.approx(3.0, abs=1e-6)


def test_a_cut_drive_starts_like_the_whole(tmp_path):
    head = "from components.translational.linkages import TwoFlanges\nfrom modelica_like.language import *\n\n"
    (tmp_path / "loop_of_test.py").write_text(head + inspect.getsource(Loop))
    (tmp_path / "drive.toml").write_text("""
[parts]
rotor = { is = "Inertia", J = "0.05 kg.m2", phi = 0, w = 10 }
shaft = { is = "SpringDamper", c = "200 N.m/rad", d = "0.5 N.m.s/rad" }
crank = { is = "Inertia", J = "0.01 kg.m2", phi = 0, w = 8 }
loop = { is = "loop_of_test:Loop" }
rocker = { is = "Inertia", J = "0.02 kg.m2" }
[series]
drive = ["rotor", "shaft", "crank", "loop", "rocker"]
[guess]
"loop.beta" = "1 rad"
"rocker.phi" = "1.5 rad"
[simulate]
until = "1 s"
""")
    drive = load(tmp_path / "drive.toml", trust=True)
    split(drive, "shaft", tmp_path / "parts", names=("motor", "machine"), check=False)
    machine = load(tmp_path / "parts" / "machine.toml", trust=True)
    machine.set("crank_flange_a.tau", 0.0)
    whole, part = simulate(drive, 1e-3), simulate(machine, 1e-3)
    assert "loop.state[1]" in part.model.states
    for name in ("crank.phi", "crank.w", "loop.beta", "rocker.phi", "rocker.w"):
        assert part[name][0] == pytest.approx(whole[name][0], rel=1e-12, abs=1e-15)
