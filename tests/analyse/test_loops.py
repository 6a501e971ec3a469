"""Loops opened at signals: their responses in closed form, their margins by python-control."""

from pathlib import Path

import control
import numpy as np
import pytest

from components import (
    PI,
    Constant,
    Damper,
    Fixed,
    Inertia,
    LinearSpeedDependentTorque,
    P,
    SpeedSensor,
    Torque,
    ZeroOrderHold,
)
from modelica_like import Assembly, build, linearize, open_loop, simulate
from modelica_like.errors import LanguageError, UnknownName
from modelica_like.language import Component, Equations, connect, series
from modelica_like.netlist import loads

EXAMPLE = Path(__file__).parents[2] / "examples" / "components" / "cascade_control.toml"
K, TI, J, D = 4.0, 0.2, 0.5, 0.3


class Controlled(Component):
    """A PI controller turns an inertia in a damper to 10 rad/s."""

    def build(self) -> None:
        self.wanted = Constant(k="10 rad/s")
        self.controller = PI(k=f"{K} N.m.s/rad", Ti=TI, integral=0.0)
        self.torque = Torque()
        self.mass = Inertia(J=J, phi=0.0, w=0.0)
        self.damper = Damper(d=D)
        self.wall = Fixed()
        self.sensor = SpeedSensor()

    def equations(self) -> Equations:
        yield from series(self.torque, self.mass, self.damper, self.wall)
        yield connect(self.mass.flange_b, self.sensor.flange)
        yield connect(self.wanted.y, self.controller.u_s)
        yield connect(self.sensor.w, self.controller.u_m)
        yield connect(self.controller.y, self.torque.tau)


def closed_form(f: np.ndarray) -> np.ndarray:
    s = 2j * np.pi * f
    return K * (1 + 1 / (TI * s)) / (J * s + D)


@pytest.mark.parametrize("signal", ["controller.y", "torque.tau", "sensor.w", "controller.u_m"])
def test_the_response_is_that_of_the_loop_wherever_it_is_opened(signal: str) -> None:
    loop = open_loop(Controlled(), signal)
    f = np.geomspace(0.01, 100, 9)
    np.testing.assert_allclose(loop.response(f)[0, 0], closed_form(f), rtol=1e-10)
    assert loop.margins().stable


def test_what_does_not_come_back_is_no_loop() -> None:
    loop = open_loop(Controlled(), "controller.u_s")
    assert np.abs(loop.response([0.1, 1.0])).max() == 0.0
    assert (loop.margins().gain, loop.margins().phase, loop.margins().distance[1]) == ((), (), 1.0)


def test_margins_are_those_of_the_closed_form_and_of_python_control() -> None:
    loop = open_loop(Controlled(), "controller.y")
    ((frequency, lag),) = loop.margins().phase
    assert abs(closed_form(np.array([frequency]))[0]) == pytest.approx(1, rel=1e-9)
    assert lag == pytest.approx(180 + np.degrees(np.angle(closed_form(np.array([frequency]))[0])), rel=1e-9)
    assert loop.margins().gain == ()

    cascade = open_loop(EXAMPLE, "speed_loop.y")
    found = cascade.margins()
    gains, phases, distances, *at = control.stability_margins(cascade.to_control(), returnall=True)
    assert [factor for _, factor in found.gain] == pytest.approx(gains, rel=1e-6)
    assert [f * 2 * np.pi for f, _ in found.gain] == pytest.approx(at[0], rel=1e-6)
    assert [lag for _, lag in found.phase] == pytest.approx(phases, rel=1e-6)
    assert found.distance[1] == pytest.approx(distances[0], rel=1e-4)
    assert found.stable


def test_a_loop_beyond_its_gain_margin_is_not_stable() -> None:
    # A small step, so that no controller is at its limit.
    text = EXAMPLE.read_text(encoding="utf-8").replace('"4 mrad"', '"0.1 mrad"')
    gain = open_loop(EXAMPLE, "speed_loop.y").margins().gain[-1][1]
    for factor, stable in ((0.99 * gain, True), (1.01 * gain, False)):
        drive = loads(text.replace('"J/(4*T)/k_phi"', f'"{factor!r}*J/(4*T)/k_phi"'))
        assert open_loop(drive, "speed_loop.y").margins().stable is stable


def sampled_drive(k: float, signal: str = "s.w", **parts: Component) -> Assembly:
    """A controller turns 1 kg.m² by k·(10 - what it samples every 0.1 s), of its speed or of another signal."""
    given = {
        "ref": Constant(k=10.0), "ctl": P(k=k), "hold": ZeroOrderHold(period=0.1), "drv": Torque(),
        "rotor": Inertia(J=1.0, phi=0.0, w=0.0), **(parts or {"s": SpeedSensor()}),
    }  # fmt: skip
    wires = {"r": ["ref.y", "ctl.u_s"], "q": [signal, "hold.u"], "h": ["hold.y", "ctl.u_m"], "y": ["ctl.y", "drv.tau"]}
    ends = ["load"] if "load" in parts else ["s"]
    return Assembly("sampled", parts=given, series={"drive": ["drv", "rotor", *ends]}, connect=wires)


def test_a_loop_that_passes_samples_is_not_told_to_be_stable() -> None:
    """A sample later the speed is 1 - k·0.1 times as far from the wanted one: -2 for k = 30, ever further."""
    drive = sampled_drive(30.0)
    w = simulate(drive, 1.0)["rotor.w"]
    assert w[-1] == pytest.approx(10 - 10 * (-2.0) ** 10, rel=1e-9)
    for signal in ("hold.y", "ctl.y"):
        found = open_loop(drive, signal, at=0.45).margins()
        assert (found.stable, found.sampled) == (None, ("hold.last",))
        assert found.lines()[-1] == (
            "Whether the closed loop is stable is not told: hold.last is held constant, but sampled. Simulate it."
        )
    notice = (
        "No clock ticks in these small motions: hold.last is held constant, and a loop that passes samples is open."
    )
    linear = linearize(drive, 0.45)
    assert linear.notices == (notice,)
    assert str(linear).endswith(notice)
    assert str(linear.modes()).endswith(notice)


def test_samples_that_follow_no_motion_leave_a_loop_as_it_is() -> None:
    """What is sampled is constant; the load closes a loop of its own, of time constant J/d = 1/2 s."""
    parts = {"other": Constant(k=3.0), "load": LinearSpeedDependentTorque(tau_nominal=-4.0, w_nominal=2.0)}
    drive = sampled_drive(30.0, "other.y", **parts)
    linear = linearize(drive, 0.45)
    assert (linear.sampled, linear.notices) == ((), ())
    assert min(linear.eigenvalues().real) == pytest.approx(-2.0, rel=1e-12)


def test_pictures_show_margins_and_modes() -> None:
    loop = open_loop(EXAMPLE, "speed_loop.y")
    figure = loop.bode()
    size, phase = figure.axes
    told = [text.get_text() for text in figure.texts]
    assert "phase margin 26.3\u00b0 at 87.12 Hz" in told
    assert any(line.startswith("1  159.2 Hz, damping 0.707: motor") for line in told)
    decibels = dict(zip(*size.lines[0].get_data(), strict=True))
    f = list(decibels)[100]
    assert decibels[f] == pytest.approx(20 * np.log10(abs(loop.response(f)[0, 0, 0])))
    assert phase.lines[0].get_ydata()[-1] == pytest.approx(-270, abs=10)  # three poles more than zeros
    (plane,) = loop.nyquist().axes
    x, y = plane.lines[0].get_data()
    assert np.hypot(x + 1, y).min() == pytest.approx(loop.margins().distance[1], rel=1e-3)


def test_what_has_no_loop_is_told() -> None:
    with pytest.raises(UnknownName, match=r"has no connected signal 'controler\.y'; did you mean 'controller\.y'\?"):
        open_loop(Controlled(), "controler.y")
    with pytest.raises(LanguageError, match="A compiled drive has no loop to open"):
        open_loop(build(Controlled()), "controller.y")  # type: ignore[arg-type]
