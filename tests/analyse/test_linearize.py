"""Linear models against closed forms and the eigenvalues published for document 003."""

import math
from pathlib import Path

import numpy as np
import pytest

from components import (
    Brake,
    Clutch,
    Constant,
    ConstantSpeed,
    ConstantTorque,
    EddyCurrentTorque,
    Fixed,
    IdealPlanetary,
    Inertia,
    Spring,
    SpringDamper,
)
from modelica_like import Assembly, build, simulate
from modelica_like.analyse.linear.campbell import Campbell, campbell
from modelica_like.analyse.linear.linearize import linearize
from modelica_like.language import Component, Equations, connect, series
from modelica_like.solve.initialize import variable_slopes

STARTUP = Path(__file__).parents[2] / "examples" / "machine_tool_startup.toml"

# Document 003, recomputed from its equations with the signs put right: clutch open (driving side) and locked.
OPEN = {10.0: [-41.60 + 68.63j, -22.84 + 128.29j], 1.2: [-42.57 + 69.64j, -11.42 + 127.62j]}
LOCKED = {
    10.0: [-22.67 + 47.75j, -33.69 + 101.04j, -10.61 + 210.60j],
    1.2: [-22.69 + 49.40j, -30.23 + 98.86j, -4.23 + 211.23j],
}


@pytest.fixture(scope="module", params=[10.0, 1.2])
def startup(request):
    return request.param, simulate(STARTUP, parameters={"h1": request.param})


def oscillating(linear) -> list[complex]:
    return sorted((v for v in linear.eigenvalues() if v.imag > 0), key=lambda v: v.imag)


def open_side(h1: float) -> list[complex]:
    """Eigenvalues of the driving side from its hand-written equations: J1, J2, and the slip damper in series."""
    h0, k0, k1, j1, j2 = 156.0, 16400.0, 6120.0, 1.61, 0.57
    a = np.array(
        [  # twist of shaft 0, twist of shaft 1, w1, w2
            [-k0 / h0, 0, 1, 0],
            [0, 0, -1, 1],
            [-k0 / j1, k1 / j1, -h1 / j1, h1 / j1],
            [0, -k1 / j2, h1 / j2, -h1 / j2],
        ]
    )
    return sorted((v for v in np.linalg.eigvals(a) if v.imag > 0), key=lambda v: v.imag)


def test_open_clutch(startup):
    h1, run = startup
    linear = linearize(run, 0.01)
    found = oscillating(linear)[:2]
    np.testing.assert_allclose(found, open_side(h1), rtol=1e-9)
    np.testing.assert_allclose(np.round(found, 2), OPEN[h1], atol=0.011)
    assert set(linear.held) == {"J4.phi", "load.w"}


def locked_side(h1: float) -> list[complex]:
    """Eigenvalues with J2 and J3 as one."""
    h0, h2, k0, k1, k2 = 156.0, 2.5, 16400.0, 6120.0, 14300.0
    j1, j23, j4 = 1.61, 0.57 + 0.05, 1.02
    slope = 0.1 * 2 / 3 * 32.3528 ** (-1 / 3)
    a = np.array(
        [  # twists of the shafts 0, 1 and 2, then w1, w23, w4
            [-k0 / h0, 0, 0, 1, 0, 0],
            [0, 0, 0, -1, 1, 0],
            [0, 0, 0, 0, -1, 1],
            [-k0 / j1, k1 / j1, 0, -h1 / j1, h1 / j1, 0],
            [0, -k1 / j23, k2 / j23, h1 / j23, -(h1 + h2) / j23, h2 / j23],
            [0, 0, -k2 / j4, 0, h2 / j4, -(h2 + slope) / j4],
        ]
    )
    return sorted((v for v in np.linalg.eigvals(a) if v.imag > 0), key=lambda v: v.imag)


def test_locked_clutch_moves_as_one(startup):
    h1, run = startup
    linear = linearize(run, 1.0)
    found = oscillating(linear)
    np.testing.assert_allclose(found, locked_side(h1), rtol=1e-6)
    np.testing.assert_allclose(found, LOCKED[h1], atol=0.011)
    assert set(linear.held) == {"clutch.phi_rel", "clutch.w_rel"}


class Pair(Component):
    """Two inertias and a clutch, nothing else: stuck, they are one free inertia."""

    def build(self) -> None:
        self.left = Inertia(J=2.0, w=10.0, phi=0.0)
        self.right = Inertia(J=3.0, w=10.0, phi=0.0)
        self.clutch = Clutch(fn_max=100.0, cgeo=1.0, mu_pos=[[0.0, 0.3]])
        self.engage = Constant(k=1.0)

    def equations(self) -> Equations:
        yield from series(self.left, self.clutch, self.right)
        yield connect(self.engage.y, self.clutch.f_normalized)


def test_free_pair_keeps_its_common_motion():
    linear = linearize(simulate(Pair(), 0.1))
    assert len(linear.states) == 2
    slopes = variable_slopes(linear.model, linear.point, [linear.model.position[n] for n in ("left.w", "right.w")])
    np.testing.assert_array_equal(*(slopes @ linear.shape))


class Oscillator(Component):
    """An inertia on a spring-damper at a wall, turned by a torque."""

    def build(self) -> None:
        self.wall = Fixed()
        self.spring = SpringDamper(c=900.0, d=2.0)
        self.mass = Inertia(J=4.0, phi=0.0, w=0.0)
        self.torque = ConstantTorque(tau_constant=0.0)

    def equations(self) -> Equations:
        yield from series(self.wall, self.spring, self.mass)
        yield connect(self.torque.flange, self.mass.flange_b)


C, D, J = 900.0, 2.0, 4.0


@pytest.fixture(scope="module")
def oscillator():
    return linearize(build(Oscillator()), inputs=["torque.tau_constant"], outputs=["mass.w", "spring.tau"])


def test_frequency_response_is_that_of_the_transfer_function(oscillator):
    frequencies = np.array([0.1, 15 / (2 * np.pi), 7.0])
    s = 2j * np.pi * frequencies
    expected = [s / (J * s**2 + D * s + C), (D * s + C) / (J * s**2 + D * s + C)]
    gains = oscillator.response(frequencies)[:, 0, :]
    np.testing.assert_allclose(np.abs(gains), np.abs(expected), rtol=1e-12)
    np.testing.assert_allclose(gains[0], expected[0], rtol=1e-12)


def test_mode_of_an_oscillator(oscillator):
    (mode,) = oscillator.modes()
    decay = D / (2 * J)
    assert mode.eigenvalue == pytest.approx(complex(-decay, math.sqrt(C / J - decay**2)), rel=1e-12)
    assert mode.natural_frequency == pytest.approx(math.sqrt(C / J) / (2 * math.pi), rel=1e-12)
    assert mode.damping == pytest.approx(D / (2 * math.sqrt(C * J)), rel=1e-12)
    assert mode.time_constant == pytest.approx(1 / decay, rel=1e-12)
    # Along an eigenvector c |phi|² = J |w|²: |w|² = |s|² |phi|² = c / J |phi|².
    assert mode.stored == pytest.approx({"mass": 0.5, "spring": 0.5}, rel=1e-9)
    assert mode.lost == pytest.approx({"spring": 1.0})
    assert sum(mode.participation.values()) == pytest.approx(1.0)


def test_other_packages_get_the_same_system(oscillator):
    ours = np.sort_complex(oscillator.eigenvalues())
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(oscillator.to_scipy().A)), ours)
    control = oscillator.to_control()
    np.testing.assert_allclose(np.sort_complex(control.poles()), ours)
    assert control.input_labels == ["torque_tau_constant"]
    assert control.output_labels == ["mass_w", "spring_tau"]


def test_slopes_agree_with_differences():
    """Every entry of A and B against central differences of the rates, at a point where the friction slips."""
    run = simulate(STARTUP)
    linear = linearize(run, 0.2, inputs=["force", "h1"])
    model, point = linear.model, linear.point

    def rates(x, p):
        return np.asarray(model.equations.ode(point.t, x, point.z, p, model.u, point.d)).ravel()

    for k in range(len(model.states)):
        step = np.zeros(len(model.states))
        step[k] = 1e-6 * max(1.0, abs(point.x[k]))
        difference = (rates(point.x + step, model.p) - rates(point.x - step, model.p)) / (2 * step[k])
        np.testing.assert_allclose(linear.A[:, k], difference, rtol=1e-5, atol=1e-4)
    for k, name in enumerate(linear.inputs):
        step = np.zeros(len(model.p))
        step[model.parameter_position[name]] = 1e-6 * abs(model.p[model.parameter_position[name]])
        difference = (rates(point.x, model.p + step) - rates(point.x, model.p - step)) / (2 * step.max())
        np.testing.assert_allclose(linear.B[:, k], difference, rtol=1e-5, atol=1e-6)


def test_stuck_brake_of_a_planetary_gear():
    """The held ring leaves one motion: sun and carrier turn at 1 + ratio, their inertias add."""
    gear = PlanetaryWithBrake()
    linear = linearize(simulate(gear, 0.1))
    values = linear.eigenvalues()
    # J_sun (1 + i)² + J_carrier on the spring at the carrier, i = 2.
    expected = math.sqrt(500.0 / (0.1 * 9 + 0.6))
    assert max(abs(values.imag)) == pytest.approx(expected, rel=1e-9)
    assert sum(v.imag > 0 for v in values) == 1


class PlanetaryWithBrake(Component):
    def build(self) -> None:
        self.gear = IdealPlanetary(ratio=2.0)
        self.sun = Inertia(J=0.1)
        self.ring = Inertia(J=0.3, w=0.0, phi=0.0)
        self.carrier = Inertia(J=0.6, w=0.01, phi=0.0)
        self.brake = Brake(fn_max=1000.0, cgeo=1.0, mu_pos=[[0.0, 0.5]])
        self.press = Constant(k=1.0)
        self.spring = Spring(c=500.0)
        self.wall = Fixed()

    def equations(self) -> Equations:
        gear = self.gear
        yield connect(gear.sun, self.sun.flange_a)
        yield connect(gear.ring, self.ring.flange_a)
        yield connect(self.ring.flange_b, self.brake.flange_a)
        yield connect(gear.carrier, self.carrier.flange_a)
        yield connect(self.press.y, self.brake.f_normalized)
        yield from series(self.carrier, self.spring, self.wall)


class Rotor(Component):
    """A rotor at constant speed, and an oscillator beside it."""

    def build(self) -> None:
        self.turn = ConstantSpeed(w_fixed=10.0)
        self.rotor = Inertia(J=J, phi=0.0)
        self.wall = Fixed()
        self.spring = Spring(c=C)
        self.mass = Inertia(J=J, phi=0.0, w=0.0)

    def equations(self) -> Equations:
        yield connect(self.turn.flange, self.rotor.flange_a)
        yield from series(self.wall, self.spring, self.mass)


def test_campbell_diagram_finds_critical_speeds():
    """The natural frequency of 15 rad/s is excited once per revolution at 15 rad/s, twice at 7.5 rad/s."""
    speeds = [4.0, 9.0, 20.0]
    diagram = campbell(Rotor(), {"turn.w_fixed": speeds}, "rotor.w", at="given", orders=(1, 2))
    np.testing.assert_allclose(diagram.speeds, speeds)
    np.testing.assert_allclose(diagram.frequencies, np.full((1, 3), 15 / (2 * np.pi)), rtol=1e-12)
    assert [one.speed for one in diagram.crossings()] == pytest.approx([15.0, 7.5], rel=1e-12)
    first_met = str(diagram.crossings()[0])
    assert first_met == "order 1 meets mode 1 (spring, mass) at 2.387 Hz, 143.24 rpm"
    figure = diagram.plot()
    assert [text.get_text() for text in figure.axes[0].texts][-2:] == ["1", "2"]
    (axes,) = figure.axes
    mode, first, second, *points = axes.lines
    np.testing.assert_allclose(mode.get_ydata(), diagram.frequencies[0])
    np.testing.assert_allclose(second.get_ydata(), 2 * first.get_ydata())
    assert [(one.get_xdata()[0], one.get_ydata()[0]) for one in points] == [
        pytest.approx((speed * 30 / np.pi, 15 / (2 * np.pi))) for speed in (7.5, 15.0)
    ]


def test_campbell_diagram_follows_a_mode_that_begins_later():
    """An eddy current brake damps by its slope, 2·tau_n/w_n·(1 - x²)/(1 + x²)² with x = w/w_n: overdamped at first."""
    peak, at, c, J = 400.0, 20.0, 2000.0, 0.1
    parts = {
        "motor": ConstantSpeed(w_fixed="w0"), "shaft": SpringDamper(c=c, d=0.0), "disc": Inertia(J=J),
        "brake": EddyCurrentTorque(tau_nominal=peak, w_nominal=at),
    }  # fmt: skip
    drive = Assembly("d", parameters={"w0": "1 rad/s"}, parts=parts, series={"s": list(parts)})
    speeds = np.array([1.0, 2.0, 10.0, 16.0, 20.0, 120.0, 150.0, 300.0])
    x = speeds / at
    damping = 2 * peak / at * (1 - x**2) / (1 + x**2) ** 2 / (2 * J)
    square = c / J - damping**2
    expected = np.where(square > 0, np.sqrt(np.maximum(square, 0)) / (2 * np.pi), np.nan)
    assert 0 < np.isnan(expected).sum() < len(speeds)
    diagram = campbell(drive, {"w0": speeds}, "disc.w")
    np.testing.assert_allclose(diagram.frequencies, [expected], rtol=1e-9)
    assert diagram.modes == ("disc, shaft",)
    (crossing,) = diagram.crossings()
    assert 120.0 < crossing.speed < 150.0
    assert diagram.plot().axes[0].lines


def test_campbell_diagram_of_a_shaft_that_turns_backwards():
    speeds = [-20.0, -9.0, 4.0, 20.0]
    diagram = campbell(Rotor(), {"turn.w_fixed": speeds}, "rotor.w", at="given", orders=(1, 2))
    found = sorted(one.speed for one in diagram.crossings())
    assert found == pytest.approx([-15.0, -7.5, 7.5, 15.0], rel=1e-12)
    assert all(one.frequency == pytest.approx(15 / (2 * np.pi)) for one in diagram.crossings())
    line = diagram.plot().axes[0].lines[1]
    np.testing.assert_allclose(line.get_ydata(), np.abs(line.get_xdata()) / 60)


def test_a_crossing_at_a_point_counts_once():
    """A curve that meets a line of an order at a point, goes through it or turns back there."""
    for before, after in ((-1, 1), (-1, -1), (1, 1), (1, -1)):
        line = np.array([1.0, 2.0, 3.0])
        curve = 1j * np.array([1.0 + before * 0.5, 2.0, 3.0 + after * 0.5])
        crossings = Campbell("d", "w", line, curve[None]).crossings()
        assert [one.speed for one in crossings] == [2.0]
    assert [one.speed for one in Campbell("d", "w", line, 1j * np.array([[1.0, 1.0, 1.0]])).crossings()] == [1.0]
