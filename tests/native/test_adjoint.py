"""Gradients of handles by many values at once: against closed forms, the replay, and what a run must not notice."""

from pathlib import Path

import numpy as np
import pytest

from components import Clutch, Inertia, SpringDamper
from modelica_like import Assembly, build, sensitivities, simulate
from modelica_like.language import (
    TIME,
    Component,
    Discrete,
    Equations,
    Events,
    Parameter,
    Variable,
    clock,
    der,
    discrete,
    param,
    var,
    when,
)

EXAMPLES = Path(__file__).parents[2] / "examples"


def slopes_of(law, values):
    """Derivatives of a closed form by complex steps, shape (outputs, values); exact but for rounding."""
    step, columns = 1e-30, []
    for k in range(len(values)):
        moved = np.array(values, complex)
        moved[k] += 1j * step
        columns.append(np.imag(law(*moved)) / step)
    return np.transpose(columns)


def gradient_at(drive, until, of, values, rtol=1e-9):
    handle = build(drive).native(outputs=of, by=list(values), rtol=rtol)
    handle.reset(values, until=until)
    handle.step(until)
    return handle.gradient()


def test_a_clutch_that_locks():
    """By inertias, capacity and start values, through an event whose time they move."""

    def law(first, second, capacity, w, phi):
        locked = w / (capacity * (1 / first + 1 / second))
        common = first * w / (first + second)
        turned = phi + w * locked - capacity / first * locked**2 / 2
        return common, turned + common * (1.0 - locked)

    parts = {"J1": Inertia(J=1.0, phi=0.0, w=10.0), "clutch": Clutch(capacity=30.0), "J2": Inertia(J=2.0, w=0.0)}
    drive = Assembly("locking", parts=parts, series={"shaft": [*parts]})
    values = {"J1.J": 1.0, "J2.J": 2.0, "clutch.capacity": 30.0, "J1.w": 10.0, "J1.phi": 0.0}
    found = gradient_at(drive, 1.0, ["J1.w", "J1.phi"], values)
    np.testing.assert_allclose(found, slopes_of(law, [*values.values()]), rtol=1e-8, atol=1e-8)


class Ball(Component):
    """It falls, and rebounds with a part of its speed."""

    units_checked = False
    h: Variable = var("1", "height")
    v: Variable = var("1", "speed", default=0.0)
    g: Parameter = param("1", "gravity", default=9.81)
    e: Parameter = param("1", "restitution", default=0.5)

    def equations(self) -> Equations:
        yield der(self.h) == self.v
        yield der(self.v) == -self.g

    def events(self) -> Events:
        yield when(self.h < 0, {self.v: -self.e * self.v})


def test_a_ball_that_rebounds():
    """A state gets a new value, which depends on parameters, when it depends on them."""

    def law(h, g, e):
        falls = (2 * h / g) ** 0.5
        speed, rest = e * g * falls, 1.0 - falls
        return speed * rest - g * rest**2 / 2, speed - g * rest

    values = {"h": 3.0, "g": 9.81, "e": 0.5}
    found = gradient_at(Ball(h=3.0), 1.0, ["h", "v"], values)
    np.testing.assert_allclose(found, slopes_of(law, [*values.values()]), rtol=1e-7)


class Sampled(Component):
    """A state follows its sample, which a clock takes; an event also notes its time."""

    units_checked = False
    x: Variable = var("1", "state")
    a: Parameter = param("1", "growth", default=0.7)
    level: Parameter = param("1", "at which the time is noted", default=2.0)
    period: Parameter = param("s", "of the clock", default=0.25)
    sample: Discrete = discrete("1", "sample")
    noted: Discrete = discrete("1", "time")

    def equations(self) -> Equations:
        yield der(self.x) == self.a * self.sample + self.noted

    def events(self) -> Events:
        yield when(clock(self.period), {self.sample: self.x})
        yield when(self.x > self.level, {self.noted: TIME})


def test_samples_and_noted_times():
    def law(x, a, level, period):
        x *= (1 + a * period) ** 2
        noted = 2 * period + (level - x) / (a * x)
        last = level + (3 * period - noted) * (a * x + noted)
        return (last + (0.95 - 3 * period) * (a * last + noted),)

    values = {"x": 1.5, "a": 0.7, "level": 2.3, "period": 0.25}
    found = gradient_at(Sampled(x=1.5), 0.95, ["x"], values)
    np.testing.assert_allclose(found, slopes_of(law, [*values.values()]), rtol=1e-8)


def test_an_oscillation_that_the_run_does_not_show():
    """All is at rest, and steps are long; the free angle of the spring would make it swing."""
    parts = {
        "J1": Inertia(J=1.0, phi=0.0, w=0.0),
        "spring": SpringDamper(c=4e4, d=0.0, phi_rel=0.0),
        "J2": Inertia(J=1.0, w=0.0),
    }
    drive = Assembly("resting", parts=parts, series={"shaft": [*parts]})
    found = gradient_at(drive, 0.1, ["J2.w"], {"spring.phi_rel0": 0.0}, rtol=1e-7)
    speed = (2 * 4e4) ** 0.5
    assert found[0, 0] == pytest.approx(0.5 * speed * np.sin(0.1 * speed), abs=1e-4 * speed)


ZERO = {"start_time", "offset", "tau_drag"}
"""What is zero may have no derivative: another sign would let a clutch slide, or a wave begin within the run."""


@pytest.mark.parametrize(
    ("drive", "until", "of"),
    [
        ("lepelletier", 35.0, ["car.w"]),
        ("dc_bench", 1.0, ["clutch.phi_rel"]),
        ("msl/rotational/CoupledClutches", 1.5, ["J1.w", "J4.phi"]),
        ("machine_tool_startup", 1.0, ["load.w", "J1.phi"]),
    ],
)
def test_all_parameters_as_by_the_replay(drive, until, of):
    """Impacts, resets, friction that holds, times that are noted."""
    path = EXAMPLES / f"{drive}.toml"
    exact = sensitivities(simulate(path, until=until, solver="native", rtol=1e-9), of)
    by = [parameter.name for parameter in exact.parameters]
    handle = build(path).native(outputs=of, by=by, rtol=1e-8)
    handle.reset(until=until)
    handle.step(until)
    found = handle.gradient()
    values = np.abs(build(path).native(outputs=by).outputs)
    values[values == 0] = 1
    without = np.isnan(found).all(axis=0)
    assert {name.rsplit(".")[-1] for name, none in zip(by, without, strict=True) if none} <= ZERO
    error = np.nanmax(np.abs(found - exact.derivatives) * values, axis=1)
    assert np.all(error < 1e-6 * np.max(np.abs(exact.derivatives) * values, axis=1))


def test_one_without_a_derivative_refuses_no_others():
    """At equal speeds a clutch sticks, at all others it slides; inertias do not matter."""
    parts = {"J1": Inertia(J=1.0, w=1.0, phi=0.0), "clutch": Clutch(capacity=5.0), "J2": Inertia(J=2.0, w=1.0)}
    drive = Assembly("equal", parts=parts, series={"shaft": [*parts]})
    found = gradient_at(drive, 0.1, ["J1.w", "J1.phi"], {"J1.w": 1.0, "J1.J": 1.0, "J1.phi": 0.0, "J2.J": 2.0})
    assert np.isnan(found[:, 0]).all()
    np.testing.assert_allclose(found[:, 1:], [[0, 0, 0], [0, 1, 0]], atol=1e-12)


def test_a_gradient_on_the_way_does_not_change_the_run():
    runs = []
    for asks in (False, True):
        handle = build(EXAMPLES / "machine_tool_startup.toml").native(
            outputs=["load.w", "J1.phi"], by=["J1.J", "force"]
        )
        handle.reset(until=1.0)
        rows = []
        for k in range(1, 41):
            rows.append(handle.step(0.025 * k).copy())
            if asks:
                handle.gradient()
        runs.append(rows)
    assert np.array_equal(*runs)


class Pushed(Component):
    """A state that grows as a step of a control loop says."""

    units_checked = False
    x: Variable = var("1", "state")
    a: Parameter = param("1", "factor", default=0.5)
    p: Parameter = param("1", "push", default=1.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.a * self.p


def test_what_steps_set():
    """By what is set before every step the derivative is that by a shift of all these values."""
    handle = build(Pushed(x=0.0)).native(["p"], ["x"], by=["a", "p", "x"])
    handle.reset(until=1.0)
    pushes = [1.0, 3.0, -2.0, 0.5]
    for k, push in enumerate(pushes):
        handle.inputs[0] = push
        handle.step(0.25 * (k + 1))
    np.testing.assert_allclose(handle.gradient(), [[0.25 * sum(pushes), 0.5, 1.0]], rtol=1e-12)
