"""From flat equations to states: index reduction and state selection."""

import dataclasses
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from components import ConstantSpeed, ConstantTorque, IdealGear, Inertia, SpringDamper
from modelica_like import build, load, simulate
from modelica_like.errors import SingularAtStart, StructureError, Underdetermined
from modelica_like.flatten import flatten
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Input,
    Parameter,
    Variable,
    cos,
    der,
    guess,
    param,
    series,
    signal_in,
    sin,
    var,
)
from modelica_like.structure import reduce

EXAMPLES = Path(__file__).parents[2] / "examples" / "msl" / "rotational"


class RigidTrain(Component):
    """Inertias joined by gears without compliance, driven at the first."""

    n: int = 3
    ratio: float = 1.1

    def build(self) -> None:
        self.push = ConstantTorque(tau_constant=10.0)
        self.inertias = [Inertia(J=1.0 + k % 3) for k in range(self.n)]
        self.gears = [IdealGear(ratio=self.ratio) for _ in range(self.n - 1)]

    def equations(self) -> Equations:
        yield from series(self.push, self.inertias[0])
        for k in range(self.n - 1):
            yield from series(self.inertias[k], self.gears[k], self.inertias[k + 1])


@pytest.mark.parametrize("n", [2, 3, 10, 50, 200])
def test_a_rigid_train_has_two_states_and_one_torn_unknown(n):
    reduced = reduce(flatten(RigidTrain(n=n)))
    assert len(reduced.states) == 2
    assert reduced.implicit == ()
    assert reduced.index == 3
    coupled = [block for block in reduced.blocks if len(block.unknowns) > 1]
    assert [(len(block.tears), block.kind) for block in coupled] == [(1, "linear")]


@pytest.mark.parametrize("n", [2, 10, 200])
def test_a_rigid_train_accelerates_by_its_reduced_inertia(n):
    train = RigidTrain(n=n, ratio=1.01)
    train.set("inertias[1].phi", 0.0)
    train.set("inertias[1].w", 0.0)
    run = simulate(train, 1.0, points=2)
    total = sum((1.0 + k % 3) / 1.01 ** (2 * k) for k in range(n))
    assert run.final["inertias[1].w"] == pytest.approx(10.0 / total, rel=1e-12)
    assert run.final[f"inertias[{n}].w"] == pytest.approx(10.0 / total / 1.01 ** (n - 1), rel=1e-11)
    assert run.final[f"inertias[{n}].flange_a.tau"] == pytest.approx(
        (1.0 + (n - 1) % 3) * 10.0 / total / 1.01 ** (n - 1), rel=1e-10
    )


def test_rigid_constraints_do_not_drift_in_a_hundred_seconds():
    train = RigidTrain(n=4, ratio=-1.7)
    train.set("inertias[1].phi", 0.5)
    train.set("inertias[1].w", -3.0)
    run = simulate(train, 100.0, points=200)
    for k in range(1, 4):
        for name in ("phi", "w"):
            before, after = run[f"inertias[{k}].{name}"], run[f"inertias[{k + 1}].{name}"]
            np.testing.assert_allclose(before, -1.7 * after, rtol=1e-14, atol=1e-10)


def test_a_missing_equation_is_told():
    flat = flatten(RigidTrain(n=2))
    with pytest.raises(Underdetermined, match="1 more equation is needed"):
        reduce(dataclasses.replace(flat, linear=flat.linear[:-1]))


@pytest.mark.parametrize(("name", "count"), [("First", 4), ("CoupledClutches", 8)])
def test_state_counts_of_the_standard_library_examples(name, count):
    reduced = reduce(flatten(load(EXAMPLES / f"{name}.toml")))
    assert len(reduced.states) == count


class Pendulum(Component):
    """Point mass on a rod, in Cartesian coordinates: the textbook system of index three, with states of the user's."""

    m: Parameter = param("kg", "mass", default=2.0)
    L: Parameter = param("m", "length", default=1.5)
    g: Parameter = param("m/s2", "gravity", default=9.81)
    x: Variable = var("m", "x", state="always")
    y: Variable = var("m", "y")
    vx: Variable = var("m/s", "velocity", state="always")
    vy: Variable = var("m/s", "velocity")
    T: Variable = var("N/m", "rod force over length")

    def equations(self) -> Equations:
        yield der(self.x) == self.vx
        yield der(self.y) == self.vy
        yield self.m * der(self.vx) == -self.T * self.x
        yield self.m * der(self.vy) == -self.T * self.y - self.m * self.g
        yield self.x**2 + self.y**2 == self.L**2


def test_the_pendulum_has_index_three_and_two_states():
    reduced = reduce(flatten(Pendulum()))
    assert reduced.index == 3
    assert set(reduced.states) == {"x", "vx"}
    assert reduced.implicit == ("y",)
    assert reduced.notices == ("Index 3: Pendulum couples motions. 1 constraint differentiated; states kept: x, vx.",)


def casadi_pendulum(x: float, vx: float, length: float, gravity: float, mass: float) -> tuple[float, float, float]:
    """Accelerations and rod force by CasADi's own index reduction, at a consistent point below the pivot."""
    px, py, qx, qy, dx, dy, ax, ay, force = (
        ca.MX.sym(n) for n in ("x", "y", "vx", "vy", "dx", "dy", "dvx", "dvy", "T")
    )
    dynamics = [dx - qx, dy - qy, mass * ax + force * px, mass * (ay + gravity) + force * py]
    dae = {
        "x_impl": ca.vertcat(px, py, qx, qy),
        "dx_impl": ca.vertcat(dx, dy, ax, ay),
        "z": force,
        "alg": ca.vertcat(*dynamics, px**2 + py**2 - length**2),
    }
    reduced, statistics = ca.dae_reduce_index(dae, {})
    assert statistics["index"] == 3
    explicit = ca.dae_map_semi_expl(dae, reduced)[0]
    solve = ca.Function(
        "g", [explicit["x"], explicit["z"]], [explicit["alg"], ca.jacobian(explicit["alg"], explicit["z"])]
    )
    y = -np.sqrt(length**2 - x**2)
    vy = -x * vx / y
    point = {"x": x, "y": y, "vx": vx, "vy": vy, "dx": vx, "dy": vy}
    values = [point[s.name()] for s in ca.symvar(explicit["x"])]
    order = [s.name() for s in ca.symvar(explicit["z"])]
    z = np.zeros(len(order))
    residual, jacobian = solve(values, z)
    z = -np.linalg.solve(jacobian.full(), residual.full()).ravel()  # linear in accelerations and force
    found = dict(zip(order, z, strict=True))
    return found["dvx"], found["dvy"], found["T"]


@pytest.mark.parametrize(("x", "vx"), [(0.3, 0.0), (-0.9, 1.3), (0.0, -2.0)])
def test_the_pendulum_accelerates_as_casadi_says(x, vx):
    model = build(Pendulum())
    y = -np.sqrt(1.5**2 - x**2)
    run = simulate(Pendulum(x=x, vx=vx, y=guess(-1.0)), 1e-6, points=1)
    first = {name: run[name][0] for name in run.names}
    assert first["y"] == pytest.approx(y, rel=1e-14)
    expected = casadi_pendulum(x, vx, 1.5, 9.81, 2.0)
    assert first["T"] == pytest.approx(expected[2], rel=1e-12)
    position = {name: k for k, name in enumerate(model.states)}
    ode = np.array(model.equations.ode(0, [{"x": x, "vx": vx}[n] for n in model.states], [y], model.p, [], [])).ravel()
    assert ode[position["vx"]] == pytest.approx(expected[0], rel=1e-12, abs=1e-12)


def test_the_pendulum_does_not_drift_and_has_the_right_period():
    angle = 0.4
    run = simulate(Pendulum(x=1.5 * np.sin(angle), vx=0.0, y=guess(-1.0)), 100.0, points=400, rtol=1e-9, atol=1e-11)
    constraint = run["x"] ** 2 + run["y"] ** 2 - 1.5**2
    hidden = run["x"] * run["vx"] + run["y"] * run["vy"]
    assert np.max(np.abs(constraint)) < 1e-10
    assert np.max(np.abs(hidden)) < 1e-10
    energy = 0.5 * (run["vx"] ** 2 + run["vy"] ** 2) + 9.81 * run["y"]
    assert np.ptp(energy) < 1e-5
    # Exact period by the arithmetic-geometric mean.
    a, b = 1.0, np.cos(angle / 2)
    for _ in range(8):
        a, b = (a + b) / 2, np.sqrt(a * b)
    period = 2 * np.pi * np.sqrt(1.5 / 9.81) / a
    assert run.at(10 * period)["x"] == pytest.approx(1.5 * np.sin(angle), abs=1e-6)
    assert run.at(20.25 * period)["x"] == pytest.approx(0.0, abs=1e-5)


def test_states_of_the_user_stay_and_the_point_where_they_fail_is_told():
    """With x as state the rod must not be horizontal."""
    with pytest.raises(SingularAtStart, match=r"singular at t = 0 s in block 1 \(y\)") as caught:
        simulate(Pendulum(x=1.5, vx=0.0, y=guess(0.0)), 1.0)
    assert 'let other variables be states (state="always")' in caught.value.advice


class Free(Pendulum):
    """The same without a choice by the user."""

    x: Variable = var("m", "x")
    vx: Variable = var("m/s", "velocity")


def test_always_steers_the_choice():
    class Turned(Free):
        y: Variable = var("m", "y", state="always")
        vy: Variable = var("m/s", "velocity", state="always")

    assert set(reduce(flatten(Turned())).states) == {"y", "vy"}
    run = simulate(Turned(y=0.0, vy=0.0, x=guess(1.0)), 0.2, points=4, rtol=1e-10, atol=1e-12)
    # From the horizontal: energy gives the speed, m v² / 2 = -m g y.
    speed = np.sqrt(run.final["vx"] ** 2 + run.final["vy"] ** 2)
    assert speed == pytest.approx(np.sqrt(-2 * 9.81 * run.final["y"]), rel=1e-8)


def test_states_follow_the_motion_where_any_choice_is_singular_somewhere():
    reduced = reduce(flatten(Free()))
    assert reduced.states == ("state[1]", "der(state[1])")
    assert reduced.notices == (
        "Index 3: Free couples motions. 1 constraint differentiated; states kept: state[1], der(state[1]).",
        "No fixed choice of states fits x and y everywhere: state[1].choice makes it anew at events.",
    )


class Scotch(Component):
    """A yoke that a crank moves: x = r·cos(phi) determines x anywhere, but phi nowhere near the dead centres."""

    r: Parameter = param("m", "length of the crank", default=0.1)
    J: Parameter = param("kg.m2", "moment of inertia of the crank", default=1.0)
    m: Parameter = param("kg", "mass of the yoke", default=1.0)
    phi: Variable = var("rad", "angle", state="avoid")
    w: Variable = var("rad/s", "speed", state="avoid")
    x: Variable = var("m", "position of the yoke")
    v: Variable = var("m/s", "velocity of the yoke")
    f: Variable = var("N", "force")

    def equations(self) -> Equations:
        yield der(self.phi) == self.w
        yield der(self.x) == self.v
        yield self.J * der(self.w) == -self.r * sin(self.phi) * self.f
        yield self.m * der(self.v) == -self.f
        yield self.x == self.r * cos(self.phi)


def test_what_one_equation_determines_anywhere_is_no_state():
    """Even if it is preferred: the other variable is a state everywhere."""
    reduced = reduce(flatten(Scotch()))
    assert set(reduced.states) == {"phi", "w"}
    assert reduced.choices == ()
    run = simulate(Scotch(phi=0.0, w=5.0), 4.0, rtol=1e-10, atol=1e-12)
    assert run["x"] == pytest.approx(0.1 * np.cos(run["phi"]), abs=1e-12)
    energy = (1 + (0.1 * np.sin(run["phi"])) ** 2) * run["w"] ** 2
    assert energy == pytest.approx(25.0, rel=1e-8)


class PrescribedLoop(Component):
    """A four-bar linkage at a constant speed of the crank: its loop is closed twice, its speed given once."""

    speed: Parameter = param("rad/s", "speed of the crank", default=3.0)
    phi: Variable = var("rad", "crank")
    beta: Variable = var("rad", "coupler")
    psi: Variable = var("rad", "rocker")
    w_psi: Variable = var("rad/s", "speed of the rocker")
    a_psi: Variable = var("rad/s2", "acceleration of the rocker")

    def equations(self) -> Equations:
        yield der(self.phi) == self.speed
        yield der(self.psi) == self.w_psi
        yield der(self.w_psi) == self.a_psi
        yield 0.1 * cos(self.phi) + 0.25 * cos(self.beta) - 0.2 * cos(self.psi) == 0.28
        yield 0.1 * sin(self.phi) + 0.25 * sin(self.beta) - 0.2 * sin(self.psi) == 0


def test_a_loop_whose_speed_is_given_has_one_state():
    reduced = reduce(flatten(PrescribedLoop()))
    assert len(reduced.states) == 1
    run = simulate(PrescribedLoop(phi=0.0, beta=guess(1.0), psi=guess(1.5)), 4.0, rtol=1e-10, atol=1e-12)
    assert run["phi"] == pytest.approx(3.0 * run.time, rel=1e-8, abs=1e-12)
    slope = 0.1 * np.sin(run["beta"] - run["phi"]) / (0.2 * np.sin(run["beta"] - run["psi"]))
    assert run["w_psi"] == pytest.approx(3.0 * slope, abs=1e-9)


@pytest.mark.parametrize("example", ["components/universal_joint", "elements/variable_drives", "elements/linkages"])
def test_drives_with_regular_choices_keep_them(example):
    assert reduce(flatten(load(EXAMPLES.parents[1] / f"{example}.toml"))).choices == ()


def test_relative_angles_become_states():
    """Absolute angles grow without bound, their small differences would be lost."""
    drive = Assembly(
        "drive",
        parts={"a": Inertia(J=1.0), "spring": SpringDamper(c=100.0, d=1.0), "b": Inertia(J=1.0)},
        series={"shaft": ["a", "spring", "b"]},
    )
    states = reduce(flatten(drive)).states
    assert {"spring.phi_rel", "spring.w_rel"} <= set(states)
    assert len(states) == 4


def test_a_constraint_on_the_speed_keeps_the_angle():
    """Prescribed speed: index two; the angle is the integral and stays a state."""
    drive = Assembly(
        "drive",
        parts={"motor": ConstantSpeed(w_fixed=5.0), "rotor": Inertia(J=2.0)},
        series={"shaft": ["motor", "rotor"]},
        parameters={},
    )
    reduced = reduce(flatten(drive))
    assert len(reduced.states) == 1
    drive.set("motor.phi", 0.25)
    assert simulate(drive, 2.0, points=1).final["rotor.phi"] == pytest.approx(10.25, rel=1e-14)
    assert simulate(drive, 2.0, points=1).final["rotor.flange_a.tau"] == 0.0


def test_a_prescribed_motion_is_differentiated():
    """Angle given by a formula of time: no states, the torque follows from its second derivative."""

    class Prescribed(Component):
        flange = Inertia.flange_b
        rate: Parameter = param("rad/s", "rate", default=3.0)

        def equations(self) -> Equations:
            yield self.flange.phi == sin(self.rate * self.time)

    drive = Assembly("drive", parts={"crank": Prescribed(), "rotor": Inertia(J=2.0)},
                     connect={"shaft": ["crank.flange", "rotor.flange_a"]})  # fmt: skip
    assert reduce(flatten(drive)).states == ()
    run = simulate(drive, 1.0, points=50)
    np.testing.assert_allclose(run["rotor.phi"], np.sin(3 * run.time), atol=1e-14)
    np.testing.assert_allclose(run["rotor.w"], 3 * np.cos(3 * run.time), atol=1e-14)
    np.testing.assert_allclose(run["rotor.flange_a.tau"], -2 * 9 * np.sin(3 * run.time), atol=1e-13)


def test_the_derivative_of_an_input_is_told():
    class Follower(Component):
        flange = Inertia.flange_b
        ref: Input = signal_in("rad", "angle")

        def equations(self) -> Equations:
            yield self.flange.phi == self.ref

    class Drive(Component):
        ref: Input = signal_in("rad", "angle")
        follower, rotor = Follower(), Inertia(J=1.0)

        def equations(self) -> Equations:
            from modelica_like.language import connect

            yield connect(self.ref, self.follower.ref)
            yield connect(self.follower.flange, self.rotor.flange_a)

    with pytest.raises(StructureError, match=r"^rotor\.w is the derivative of the input ref, which is not known\."):
        reduce(flatten(Drive()))


def test_the_rate_of_an_implicit_unknown_follows_from_its_equation():
    """y + y³ = x, der(x) = -2 x: der(y) = -2 x / (1 + 3 y²) by the implicit function theorem."""

    class Cubic(Component):
        x: Variable = var("1", "state")
        y: Variable = var("1", "implicit")
        T: Parameter = param("s", "time constant", default=0.5)

        def equations(self) -> Equations:
            yield self.T * der(self.x) == -self.x
            yield self.y + self.y**3 == self.x

    reduced = reduce(flatten(Cubic()))
    assert (reduced.states, reduced.implicit) == (("x",), ("y",))
    flat = reduced.flat
    place = next(k for k, one in enumerate(flat.variables) if one.path == "y")
    rate = ca.Function("rate", [reduced.x, reduced.z, flat.p], [reduced.rate(place)])
    y = 1.5
    x = y + y**3
    assert float(rate(x, y, [one.value for one in flat.parameters])) == pytest.approx(
        -2 * x / (1 + 3 * y**2), rel=1e-14
    )


def test_an_input_keeps_its_sign_as_a_derivative() -> None:
    """der(x) = -2 u with u = 3: x falls by 6 in one second."""

    class Falling(Component):
        u: Input = signal_in("1/s", "speed", default=3.0)
        x: Variable = var("1", "place")

        def equations(self) -> Equations:
            yield der(self.x) == -2 * self.u

    run = simulate(Falling(x=1.0), 1.0, points=1)
    assert run.final["x"] == pytest.approx(-5.0, rel=1e-9)
    assert run.final["u"] == 3.0


@pytest.mark.parametrize("factor", [2.0, -0.5])
def test_a_chain_of_derivatives_keeps_its_factors(factor: float) -> None:
    """der(x) = k v and der(v) = 3 from rest: v = 3 t, x = 1 + 1.5 k t²."""

    class Moving(Component):
        x: Variable = var("m", "place", default=1.0)
        v: Variable = var("m/s", "speed, in other units", default=0.0)
        a: Parameter = param("m/s2", "acceleration, in other units", default=3.0)

        def equations(self) -> Equations:
            yield der(self.x) == factor * self.v
            yield der(self.v) == self.a

    run = simulate(Moving(), 2.0, points=4)
    np.testing.assert_allclose(run["v"], 3.0 * run.time, rtol=1e-9)
    np.testing.assert_allclose(run["x"], 1.0 + 1.5 * factor * run.time**2, rtol=1e-7)
