"""Runs against closed forms: long grids, inputs, tolerances, time derivatives."""

from itertools import pairwise, permutations

import numpy as np
import pytest

from components import (
    BearingFriction,
    ConstantTorque,
    Damper,
    Fixed,
    IdealGear,
    Inertia,
    Mass,
    SpeedDependentLoad,
    Spring,
    SpringDamper,
    TranslationalFixed,
    TranslationalSpring,
)
from modelica_like import Assembly, build, simulate
from modelica_like.language import Component, Equations, Input, Parameter, Variable, der, param, series, signal_in, var


def test_the_grid_is_exact_for_long_runs_with_odd_numbers():
    class Idle(Component):
        rotor = Inertia(J=1.0, phi=0.0, w=1.0)

    found = simulate(Idle(), 1234.567, t0=17.3, points=977)
    np.testing.assert_allclose(found.time, np.linspace(17.3, 1234.567, 978), rtol=1e-15, atol=1e-12)
    assert found.time[-1] == 1234.567
    np.testing.assert_allclose(found["rotor.phi"], found.time - 17.3, rtol=1e-12)


def test_inputs_are_values_of_a_run():
    class Open(Component):
        u: Input = signal_in("1/s", "rate", default=2.0)
        x: Variable = var("1", "integral")

        def equations(self) -> Equations:
            yield der(self.x) == self.u

    model = build(Open(x=0.0))
    assert simulate(model, 3.0, points=1).final["x"] == pytest.approx(6.0, rel=1e-12)
    assert simulate(model, 3.0, points=1, parameters={"u": -1.0}).final["x"] == pytest.approx(-3.0, rel=1e-12)


def test_tighter_tolerances_come_nearer():
    """Damped oscillator against its closed form."""

    class Swing(Component):
        ground, spring, rotor = Fixed(), SpringDamper(c=100.0, d=0.4), Inertia(J=1.0, phi=0.1, w=0.0)
        gear, load = IdealGear(ratio=1.0), Inertia(J=0.0)
        push = ConstantTorque(tau_constant=0.0)

        def equations(self) -> Equations:
            yield from series(self.ground, self.spring, self.rotor, self.gear, self.load, self.push)

    model = build(Swing())
    damping, frequency = 0.2, np.sqrt(100.0 - 0.04)
    errors = []
    for rtol in (1e-4, 1e-6, 1e-8, 1e-10):
        found = simulate(model, 5.0, points=50, rtol=rtol, atol=rtol * 1e-2)
        t = found.time
        exact = 0.1 * np.exp(-damping * t) * (np.cos(frequency * t) + damping / frequency * np.sin(frequency * t))
        errors.append(np.max(np.abs(found["rotor.phi"] - exact)))
    assert errors[-1] < 1e-8
    assert all(later < 0.3 * earlier for earlier, later in pairwise(errors))


def test_a_shaft_between_bearings_twists_as_precisely_after_an_hour() -> None:
    """The speeds of both bearings are states. Their angles grow to 360,000 rad, and the errors of angles with them."""
    parts = {
        "motor": ConstantTorque(tau_constant=20.0), "bearing": BearingFriction(tau_pos=[(0, 1.0)]),
        "rotor": Inertia(J=0.1), "shaft": SpringDamper(c=1e5, d=10.0), "table": Inertia(J=0.8),
        "slide": BearingFriction(tau_pos=[(0, 1.0)]), "load": SpeedDependentLoad(a=0.0, b=18.0, w_ref=100.0, p=1.0),
    }  # fmt: skip
    model = build(Assembly("drive", parts=parts, series={"line": tuple(parts)}))
    assert "shaft.phi_rel" in model.states
    run = simulate(model, 3600.0, start="rest")
    late = run.time > 100.0
    np.testing.assert_allclose(run["shaft.tau"][late], -19.0, rtol=1e-7)
    assert run.final["rotor.w"] == pytest.approx(100.0, rel=1e-7)


@pytest.mark.parametrize("order", [("shaft", "front", "back"), ("front", "shaft", "back"), ("front", "back", "shaft")])
def test_a_shaft_between_dampers_twists_precisely_wherever_it_is_declared(order: tuple[str, ...]) -> None:
    """Two of three relative angles are states; those of the dampers are angles from the ground, and give no torque."""
    between = {
        "shaft": SpringDamper(c=1e5, d=10.0), "front": Damper(d=0.1), "back": Damper(d=0.2),
    }  # fmt: skip
    parts = {
        "motor": ConstantTorque(tau_constant=30.0), "rotor": Inertia(J=0.1), "table": Inertia(J=0.8),
        "ground": Fixed(), **{name: between[name] for name in order},
    }  # fmt: skip
    connections = {
        "drive": ("motor.flange", "rotor.flange_a"), "ground": ("ground.flange", "front.flange_b", "back.flange_b"),
        "left": ("rotor.flange_b", "shaft.flange_a", "front.flange_a"),
        "right": ("shaft.flange_b", "table.flange_a", "back.flange_a"),
    }  # fmt: skip
    model = build(Assembly("drive", parts=parts, connect=connections))
    assert {"shaft.phi_rel", "shaft.w_rel"} < {*model.states}
    run = simulate(model, 3600.0, start="rest")
    late = run.time > 200.0
    np.testing.assert_allclose(run["shaft.tau"][late], -20.0, rtol=1e-7)


@pytest.mark.parametrize("order", [*permutations(["shaft", "rotor", "table"])])
def test_the_twist_of_a_spring_and_its_rate_are_states_wherever_it_is_declared(order: tuple[str, ...]) -> None:
    """Two inertias on a spring without damper swing around their common turn: tau = c·Δw/ω·sin(ω·t)."""
    made = {"shaft": Spring(c=100.0), "rotor": Inertia(J=0.1), "table": Inertia(J=0.8)}
    drive = Assembly("pair", parts={name: made[name] for name in order}, connect={
        "left": ("rotor.flange_b", "shaft.flange_a"), "right": ("shaft.flange_b", "table.flange_a"),
    })  # fmt: skip
    drive.set("rotor.phi", 0.0)
    drive.set("rotor.w", 1000.0)
    drive.set("table.w", 1000.01)
    drive.set("shaft.phi_rel", 0.0)
    model = build(drive)
    assert {"shaft.phi_rel", "der(shaft.phi_rel)"} < {*model.states}
    assert "rotor.w" in model.states or "table.w" in model.states
    run = simulate(model, 10.0, rtol=1e-6)
    omega = np.sqrt(100.0 * (1 / 0.1 + 1 / 0.8))
    np.testing.assert_allclose(run["shaft.tau"], 100.0 * 0.01 / omega * np.sin(omega * run.time), atol=1e-3 / omega)


@pytest.mark.parametrize("order", [*permutations(["spring", "mass", "wall"])])
def test_the_speed_of_a_spring_at_the_ground_is_that_of_its_mass(order: tuple[str, ...]) -> None:
    made = {"spring": TranslationalSpring(c=100.0, s_rel0=0.0), "mass": Mass(m=2.0), "wall": TranslationalFixed()}
    drive = Assembly("mass on a spring", parts={name: made[name] for name in order}, connect={
        "left": ("wall.flange", "spring.flange_a"), "right": ("spring.flange_b", "mass.flange_a"),
    })  # fmt: skip
    assert {*build(drive).states} == {"spring.s_rel", "mass.v"}


def test_a_relative_tolerance_alone_is_enough_for_small_values() -> None:
    """A spring that swings by 1 µm: x = 1e-6·cos(10·t); the absolute tolerance by default is 1e-9 m."""
    drive = Assembly("small", parts={
        "wall": TranslationalFixed(), "spring": TranslationalSpring(c=200.0, s_rel0=0.0), "mass": Mass(m=2.0),
    }, connect={"left": ("wall.flange", "spring.flange_a"), "right": ("spring.flange_b", "mass.flange_a")})  # fmt: skip
    drive.set("mass.s", 1e-6)
    drive.set("mass.v", 0.0)

    def error(**tolerances: float) -> float:
        run = simulate(drive, 2.0, **tolerances)
        return float(np.max(np.abs(run["spring.s_rel"] / 1e-6 - np.cos(10.0 * run.time))))

    assert error(rtol=1e-10) < 1e-4
    assert error(rtol=1e-10, atol=1e-9) > 1e-4
    assert error(rtol=1e-4) == error(rtol=1e-4, atol=1e-9)


def test_time_derivative_of_an_implicit_unknown() -> None:
    """y + y³ = t: der(y) = 1/(1 + 3·y²)."""

    class Cubic(Component):
        y: Variable = var("1", "root")

        def equations(self) -> Equations:
            yield self.y + self.y**3 == self.time / self.second

        second: Parameter = param("s", "scale of the time", default=1.0)

    run = simulate(Cubic(), 2.0)
    np.testing.assert_allclose(run["der(y)"], 1 / (1 + 3 * run["y"] ** 2), rtol=1e-10)
    assert run.at(1.234)["der(y)"] == pytest.approx(1 / (1 + 3 * run.at(1.234)["y"] ** 2), rel=1e-10)
