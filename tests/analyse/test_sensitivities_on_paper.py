"""Sensitivities against closed forms: outputs of every kind, events, resets, breakpoints and starts."""

from collections.abc import Callable
from math import pi
from pathlib import Path

import numpy as np
import pytest

from components import BearingFriction, Clutch, ConstantTorque, Fixed, Inertia, SpeedDependentLoad, SpringDamper
from modelica_like import Assembly, Component, build, load, sensitivities, simulate
from modelica_like.analyse.sensitivity.derivatives import Sensitivities
from modelica_like.language import Equations, Events, Mode, Parameter, Variable, der, guess, param, series, var, where

EXAMPLES = Path(__file__).parents[2] / "examples"


def relative_error(result: Sensitivities, expected: np.ndarray) -> float:
    """Largest error of normalised derivatives, relative to the largest of each output."""
    weights = np.array([one.value for one in result.parameters])
    scale = np.max(np.abs(expected * weights), axis=1, keepdims=True)
    return float(np.max(np.abs((result.derivatives - expected) * weights) / scale))


def carried(model: Component, of: list[str], by: list[str], until: float, **how: str) -> np.ndarray:
    """Derivatives that a handle carries along its run in C."""
    handle = build(model).native(outputs=of, by=by, rtol=1e-9, **how)
    handle.reset(until=until)
    handle.step(until)
    return handle.gradient()


def complex_step(function: Callable[[np.ndarray], np.ndarray], values: np.ndarray) -> np.ndarray:
    """Exact derivatives of an analytic formula."""
    columns = []
    for k in range(len(values)):
        shifted = values.astype(complex)
        shifted[k] += 1e-30j
        columns.append(function(shifted).imag / 1e-30)
    return np.array(columns).T


# -- document 000, all on paper --------------------------------------------------------------------------------------


def direct_table() -> Assembly:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    drive.set("clutch_torque", "86.78431862071496 N.m")
    return drive


def geared_table() -> Assembly:
    drive = load(EXAMPLES / "machine_table_geared.toml")
    drive.set("clutch_torque", "414.4428869 N.m")
    return drive


PARAMETERS = ("clutch_torque", "motor_speed", "load_torque", "table_mass", "lead", "spindle_inertia")


def on_paper(v: np.ndarray, geared: bool) -> np.ndarray:
    """Lock-up time, friction work, motor work and way of the table after 0.4 s, from the document's formulas."""
    M_K, w, M_L, m, p, J_S = v
    i = w / (6000 * pi / 30) if geared else 1.0
    spindle_side = (0.007 if geared else 0.0) + J_S + m * (p / (2 * pi)) ** 2
    J = 0.004 + (0.014 if geared else 0.0) + spindle_side / i**2
    load = M_L / i
    t = J * w / (M_K - load)
    way = p / (2 * pi) * (w * t / 2 + w * (0.4 - t)) / i
    return np.array([t, M_K * w * t / 2, M_K * w * t + load * w * (0.4 - t), way])


@pytest.mark.parametrize("method", ["forward", "adjoint"])
@pytest.mark.parametrize("geared", [False, True])
def test_document_000_is_met_on_paper(geared: bool, method: str) -> None:
    drive = geared_table() if geared else direct_table()
    outputs = ["clutch.lock_time", "clutch.loss_energy", "motor.source_energy", "table.s"]
    result = sensitivities(drive, outputs, PARAMETERS, method=method)  # pyright: ignore[reportArgumentType]
    values = np.array([one.value for one in result.parameters])
    paper = on_paper(values, geared)
    assert [one.value for one in result.outputs] == pytest.approx(paper, rel=1e-9)
    assert relative_error(result, complex_step(lambda v: on_paper(v, geared), values)) < 1e-9


def test_a_published_derivative_in_numbers() -> None:
    result = sensitivities(direct_table(), ["clutch.lock_time"], ["clutch_torque"])
    # t = J w/(M_K - M_L), so dt/dM_K = -t/(M_K - M_L)
    assert result["clutch.lock_time", "clutch_torque"] == pytest.approx(-0.2 / 71.78431829, rel=1e-8)
    assert result.normalised[0, 0] == pytest.approx(-86.78431829 / 71.78431829, rel=1e-8)


def test_a_printed_result_names_units_and_values() -> None:
    text = str(sensitivities(direct_table(), ["clutch.lock_time"], ["clutch_torque", "load_torque"]))
    assert text.splitlines()[0] == "clutch.lock_time = 0.2 s"
    assert text.splitlines()[2].split() == ["clutch_torque", "86.7843", "N.m", "-0.00278612", "-1.2090"]
    assert text.splitlines()[3].split() == ["load_torque", "15", "N.m", "0.00278612", "0.2090"]


# -- what outputs there are ------------------------------------------------------------------------------------------


class Bench(Component):
    """A mass on a spring and damper; everything is known on paper."""

    wall = Fixed()
    spring = SpringDamper(c="100 N.m/rad", d="1 N.m.s/rad")
    mass = Inertia(J="1 kg.m2", phi=0.0, w=1.0)

    def equations(self) -> Equations:
        yield from series(self.wall, self.spring, self.mass)


def damped(v: np.ndarray, t: float) -> np.ndarray:
    """phi and w at a time, and the energy lost until then, for w(0) = 1."""
    c, d, J = v
    s, o = d / (2 * J), np.sqrt(c / J - (d / (2 * J)) ** 2)
    decay = np.exp(-s * t)
    phi, w = decay * np.sin(o * t) / o, decay * (np.cos(o * t) - s / o * np.sin(o * t))
    return np.array([phi, w, J / 2 - c * phi**2 / 2 - J * w**2 / 2])


def test_final_values_times_and_integrals_of_an_oscillator() -> None:
    outputs = ["mass.phi", "mass.w", "spring.loss_energy", "at(mass.phi, 0.31 s)", "integral(spring.loss_power)"]
    result = sensitivities(Bench(), outputs, ["spring.c", "spring.d", "mass.J"], until="1.3 s")
    values = np.array([100.0, 1.0, 1.0])
    end = complex_step(lambda v: damped(v, 1.3), values)
    inside = complex_step(lambda v: damped(v, 0.31), values)
    found = carried(Bench(), ["mass.phi", "mass.w"], ["spring.c", "spring.d", "mass.J"], 1.3)
    np.testing.assert_allclose(found, end[:2], rtol=1e-6)
    assert relative_error(result, np.vstack([end, inside[:1], end[2:]])) < 1e-8


@pytest.mark.parametrize("precision", [1e-4, 1e-6, 1e-8])
def test_derivatives_keep_the_precision(precision: float) -> None:
    run = simulate(Bench(), "1.3 s", rtol=1e-10, atol=1e-12)
    result = sensitivities(run, ["mass.phi", "mass.w"], ["spring.c", "spring.d", "mass.J"], precision=precision)
    paper = complex_step(lambda v: damped(v, 1.3)[:2], np.array([100.0, 1.0, 1.0]))
    assert relative_error(result, paper) < 10 * precision


def test_a_peak_follows_the_envelope_theorem() -> None:
    result = sensitivities(
        Bench(), ["max(mass.phi)", "min(mass.phi)"], ["spring.c", "spring.d", "mass.J"], until="1.3 s"
    )

    def peak(v: np.ndarray, number: int) -> np.ndarray:
        c, d, J = v
        s, o = d / (2 * J), np.sqrt(c / J - (d / (2 * J)) ** 2)
        return damped(v, (np.arctan(o / s) + number * np.pi) / o)[0]

    values = np.array([100.0, 1.0, 1.0])
    paper = complex_step(lambda v: np.array([peak(v, 0), peak(v, 1)]), values)
    assert relative_error(result, paper) < 1e-8


def test_a_series_has_the_derivatives_at_all_times() -> None:
    run = simulate(Bench(), "1.3 s", points=50)
    result = sensitivities(run, ["series(mass.phi)"], ["spring.c", "mass.J"])
    table = result.series["series(mass.phi)"]
    assert set(np.round(run.time, 9)) <= set(np.round(result.time, 9))
    values = np.array([100.0, 1.0, 1.0])
    paper = np.array([complex_step(lambda v, t=t: damped(v, t), values)[0, [0, 2]] for t in result.time])
    assert np.max(np.abs(table - paper)) < 1e-8 * np.max(np.abs(paper))


# -- events of other kinds -------------------------------------------------------------------------------------------


class Ball(Component):
    """A body that falls and jumps off the floor with a part of its speed."""

    height: Parameter = param("m", "height of the fall", default=2.0)
    e: Parameter = param("1", "speed after the impact over speed before", default=0.7)
    g: Parameter = param("m/s2", "gravity", default=9.81)
    s: Variable = var("m", "height", state="always")
    v: Variable = var("m/s", "speed", state="always")
    mode = Mode("flying", "bouncing")

    def equations(self) -> Equations:
        yield der(self.s) == self.v
        yield der(self.v) == -self.g

    def events(self) -> Events:
        change = {self.v: -self.e * self.v, self.s: 0.0}
        yield self.mode.go("flying", "bouncing", when=self.s < 0, reset=change)
        yield self.mode.go("bouncing", "flying", when=self.v < 0)


def test_a_bouncing_ball_with_resets() -> None:
    result = sensitivities(Ball(s=2.0, v=0.0), ["time(mode -> bouncing, 2)", "s", "v"], ["e", "g"], until="1.9 s")

    def paper(values: np.ndarray) -> np.ndarray:
        e, g = values
        first = np.sqrt(4.0 / g)
        second = first + 2 * e * first
        speed = e * e * g * first
        rest = 1.9 - second
        return np.array([second, speed * rest - g * rest**2 / 2, speed - g * rest])

    assert relative_error(result, complex_step(paper, np.array([0.7, 9.81]))) < 1e-9
    expected = complex_step(paper, np.array([0.7, 9.81]))[1:]
    np.testing.assert_allclose(carried(Ball(s=2.0, v=0.0), ["s", "v"], ["e", "g"], 1.9), expected, rtol=1e-8)


def test_a_handle_differentiates_by_start_values() -> None:
    # By the height h and the speed v0 from which a ball falls that jumps off the floor once.
    def paper(values: np.ndarray) -> np.ndarray:
        h, v0 = values
        first = (v0 + np.sqrt(v0**2 + 2 * 9.81 * h)) / 9.81
        speed, rest = 0.7 * np.sqrt(v0**2 + 2 * 9.81 * h), 1.2 - first
        return np.array([speed * rest - 9.81 * rest**2 / 2, speed - 9.81 * rest])

    found = carried(Ball(s=2.0, v=0.5), ["s", "v"], ["s", "v"], 1.2)
    np.testing.assert_allclose(found, complex_step(paper, np.array([2.0, 0.5])), rtol=1e-8)


class Bent(Component):
    """A stiffness that changes at a breakpoint, without an event."""

    J: Parameter = param("1", "inertia", default=1.0)
    c: Parameter = param("1", "stiffness before the breakpoint", default=2.0)
    edge: Parameter = param("m", "breakpoint", default=0.3)
    unit: Parameter = param("m/s2", "unit", default=1.0)
    s: Variable = var("m", "way", state="always")
    v: Variable = var("m/s", "speed", state="always")

    def equations(self) -> Equations:
        x = (self.s - self.edge) / self.edge
        yield der(self.s) == self.v
        yield self.J * der(self.v) == -self.unit * self.c * where(x < 0, x + 1, 1 + 5 * x)


def test_a_breakpoint_within_a_segment_does_not_spoil_derivatives() -> None:
    # c·s/edge up to the edge, steeper by 5 behind it: two sine waves, joined where s = edge.
    result = sensitivities(Bent(s=0.0, v=1.0), ["s", "v"], ["J", "c"], until="0.6 s")

    def paper(values: np.ndarray) -> np.ndarray:
        J, c = values
        edge, T = 0.3, 0.6
        o1, o2 = np.sqrt(c / (edge * J)), np.sqrt(5 * c / (edge * J))
        t = np.arcsin(edge * o1) / o1
        v = np.cos(o1 * t)
        middle = edge - edge / 5
        a, b = edge - middle, v / o2
        r = T - t
        return np.array(
            [middle + a * np.cos(o2 * r) + b * np.sin(o2 * r), -a * o2 * np.sin(o2 * r) + b * o2 * np.cos(o2 * r)]
        )

    assert relative_error(result, complex_step(paper, np.array([1.0, 2.0]))) < 1e-9


class Touching(Component):
    """A body thrown up that just touches a spring at the top."""

    edge: Parameter = param("m", "where the spring begins", default=0.0499)
    k: Parameter = param("1/s2", "stiffness over mass", default=2e4)
    g: Parameter = param("m/s2", "gravity", default=10.0)
    s: Variable = var("m", "height", state="always")
    v: Variable = var("m/s", "speed", state="always")

    def equations(self) -> Equations:
        yield der(self.s) == self.v
        yield der(self.v) == -self.g - self.k * where(self.s > self.edge, self.s - self.edge, 0 * self.s)


def test_a_breakpoint_passed_there_and_back_within_one_step() -> None:
    # Parabolas before and behind: one step would take them all.
    result = sensitivities(Touching(s=0.0, v=1.0), ["s", "v"], ["edge", "k", "g"], until="0.19 s")

    def paper(values: np.ndarray) -> np.ndarray:
        edge, k, g = values
        v = np.sqrt(1.0 - 2 * g * edge)
        contact = 2 / np.sqrt(k) * np.arctan(v * np.sqrt(k) / g)
        rest = 0.19 - (1.0 - v) / g - contact
        return np.array([edge - v * rest - g * rest**2 / 2, -v - g * rest])

    assert relative_error(result, complex_step(paper, np.array([0.0499, 2e4, 10.0]))) < 1e-8


# -- starts, and resets of what follows ------------------------------------------------------------------------------


class Leaning(Component):
    """A spring that a force holds bent, and that comes back when the force ends."""

    c: Parameter = param("N/m", "stiffness", default=50.0)
    d: Parameter = param("N.s/m", "damping", default=4.0)
    m: Parameter = param("kg", "mass", default=2.0)
    force: Parameter = param("N", "force at the beginning", default=3.0)
    end: Parameter = param("s", "time at which it ends", default=0.2)
    s: Variable = var("m", "way", state="always")
    v: Variable = var("m/s", "speed", state="always")
    mode = Mode("pushed", "free")

    def equations(self) -> Equations:
        yield der(self.s) == self.v
        push = self.mode.choose(pushed=self.force, free=0)
        yield self.m * der(self.v) == push - self.c * self.s - self.d * self.v

    def events(self) -> Events:
        yield self.mode.go("pushed", "free", at=self.end)


def test_a_steady_start_and_a_moving_moment() -> None:
    result = sensitivities(Leaning(), ["s", "v"], ["force", "c", "m", "end"], until="1 s", start="steady")

    def paper(values: np.ndarray) -> np.ndarray:
        force, c, m, end = values
        s, o, r = 4.0 / (2 * m), np.sqrt(c / m - (4.0 / (2 * m)) ** 2), 1.0 - end
        way = force / c * np.exp(-s * r)
        return np.array([way * (np.cos(o * r) + s / o * np.sin(o * r)), -way * c / (m * o) * np.sin(o * r)])

    assert relative_error(result, complex_step(paper, np.array([3.0, 50.0, 2.0, 0.2]))) < 1e-8
    found = carried(Leaning(), ["s", "v"], ["force", "c", "m", "end"], 1.0, start="steady")
    np.testing.assert_allclose(found, complex_step(paper, np.array([3.0, 50.0, 2.0, 0.2])), rtol=1e-7)


class Stop(Component):
    """Two masses on one shaft with a ratio; the sum of their speeds is set to zero at a given time."""

    ratio: Parameter = param("1", "weight of the second speed", default=2.0)
    moment: Parameter = param("s", "time of the reset", default=0.5)
    a: Parameter = param("m/s2", "acceleration of the first", default=3.0)
    v: Variable = var("m/s", "first speed", state="always")
    w: Variable = var("m/s", "second speed", state="always")
    total: Variable = var("m/s", "weighted sum")
    mode = Mode("before", "after")

    def equations(self) -> Equations:
        yield der(self.v) == self.a
        yield der(self.w) == 0.5 * self.a
        yield self.total == self.v + self.ratio * self.w

    def events(self) -> Events:
        yield self.mode.go("before", "after", at=self.moment, reset={self.total: 0.0})


def test_a_reset_of_a_variable_that_follows_from_states() -> None:
    result = sensitivities(Stop(v=1.0, w=2.0), ["v", "w"], ["ratio", "moment", "a"], until="1.5 s")

    def paper(values: np.ndarray) -> np.ndarray:
        k, t, a = values
        v, w = 1.0 + a * t, 2.0 + 0.5 * a * t
        # the smallest change of (v, w) along (1, k)
        step = -(v + k * w) / (1 + k * k)
        return np.array([v + step + a * (1.5 - t), w + k * step + 0.5 * a * (1.5 - t)])

    assert relative_error(result, complex_step(paper, np.array([2.0, 0.5, 3.0]))) < 1e-9
    found = carried(Stop(v=1.0, w=2.0), ["v", "w"], ["ratio", "moment", "a"], 1.5)
    np.testing.assert_allclose(found, complex_step(paper, np.array([2.0, 0.5, 3.0])), rtol=1e-8)


class Coupled(Component):
    """5 N.m against 1 N.m + 1 N.m s/rad w, behind a clutch that sticks: w = T - tau_0."""

    push = ConstantTorque(tau_constant=5.0)
    rotor = Inertia(J=1.0, w=guess(1.0), phi=0.0)
    plates = Clutch(capacity=20.0)
    wheel = Inertia(J=3.0, w=guess(1.0))
    load = SpeedDependentLoad(a=1.0, b=1.0)

    def equations(self) -> Equations:
        yield from series(self.push, self.rotor, self.plates, self.wheel, self.load)


def test_a_steady_start_with_a_clutch_that_sticks() -> None:
    result = sensitivities(
        Coupled(), ["rotor.w", "wheel.w"], ["push.tau_constant", "load.a", "rotor.J"], until="1 s", start="steady"
    )
    np.testing.assert_allclose(result.derivatives, [[1.0, -1.0, 0.0]] * 2, atol=1e-9)
    found = carried(Coupled(), ["rotor.w", "wheel.w"], ["push.tau_constant", "load.a", "rotor.J"], 1.0, start="steady")
    np.testing.assert_allclose(found, [[1.0, -1.0, 0.0]] * 2, atol=1e-9)


class BeyondTheTable(Component):
    """Friction of 1 N.m + s·w up to 50 rad/s, and as much as there beyond."""

    push = ConstantTorque(tau_constant=35.0)
    rotor = Inertia(J=1.0, w=0.0, phi=0.0)
    bearing = BearingFriction(tau_pos=[[0.0, 1.0], [50.0, 1.75]])

    def equations(self) -> Equations:
        yield from series(self.push, self.rotor, self.bearing)


@pytest.mark.parametrize("until", [1.0, 1.6, 2.0])
def test_a_speed_that_leaves_its_table(until: float) -> None:
    """The event that says so follows the kink within rounding."""

    def paper(values: np.ndarray) -> np.ndarray:
        push, J = values
        slope, last, end = 0.015, 1.75, 50.0
        left = -J / slope * np.log(1.0 - slope * end / (push - 1.0))
        if until < left.real:
            return np.array([(push - 1.0) / slope * (1.0 - np.exp(-slope / J * until))])
        return np.array([end + (push - last) / J * (until - left)])

    names = ["push.tau_constant", "rotor.J"]
    result = sensitivities(BeyondTheTable(), ["rotor.w"], names, until=until)
    expected = complex_step(paper, np.array([35.0, 1.0]))
    assert relative_error(result, expected) < 1e-9
    np.testing.assert_allclose(carried(BeyondTheTable(), ["rotor.w"], names, until), expected, rtol=1e-7)
