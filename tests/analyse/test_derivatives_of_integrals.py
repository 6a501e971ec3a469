"""Derivatives of integrals along motions that say nothing of how fast the integrands are."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from components import ConstantSpeed, Inertia
from modelica_like import Assembly, load, sensitivities, simulation_function
from modelica_like.analyse.replay.make import replay
from modelica_like.runs.readings import quadratures, read_output
from modelica_like.simulation import quick_run

EXAMPLES = Path(__file__).parents[2] / "examples"
LINKAGES, CIRCUITS = EXAMPLES / "elements/linkages.toml", EXAMPLES / "components/circuits.toml"
END = 2.0
OF = ["integral(sin(J.phi/(1 rad))**4)", "mean(sin(J.phi/(1 rad))**4)", "rms(sin(J.phi/(1 rad)))"]


def turning() -> Assembly:
    """The angle is linear in time: one step of any length has it exactly."""
    parts = {"motor": ConstantSpeed(w_fixed=100.0, phi=0.0), "J": Inertia(J=1.0)}
    return Assembly("turning", parts=parts, series={"shaft": [*parts]})


def by_speed(w: float) -> np.ndarray[Any, Any]:
    """Derivatives of `OF` by the speed: sin⁴ = 3/8 - cos(2wt)/2 + cos(4wt)/8, and sin² = 1/2 - cos(2wt)/2."""

    def slope(n: float) -> float:
        """d/dw of the integral of cos(n w t)."""
        return float(END * np.cos(n * w * END) / w - np.sin(n * w * END) / (n * w**2))

    fourth = -slope(2) / 2 + slope(4) / 8
    rms = np.sqrt(0.5 - np.sin(2 * w * END) / (4 * w * END))
    return np.array([fourth, fourth / END, -slope(2) / (4 * END * rms)])


@pytest.mark.parametrize("method", ["forward", "adjoint"])
@pytest.mark.parametrize("speed", [100.0, 1000.0])
def test_waves_along_a_steady_turn(speed: float, method: Any) -> None:
    """Relative to the integral by the angle, END times that by one wave: a derivative of 1e-3 is its last digits."""
    found = sensitivities(turning(), OF, "motor.w_fixed", until=END, parameters={"motor.w_fixed": speed}, method=method)
    np.testing.assert_allclose(found.derivatives[:, 0], by_speed(speed), rtol=1e-6)


def test_precision_is_that_of_the_integral() -> None:
    errors: list[float] = []
    for one in (1e-4, 1e-6, 1e-10):
        found = sensitivities(turning(), OF[0], "motor.w_fixed", until=END, precision=one)
        errors.append(abs(found.derivatives[0, 0] - by_speed(100.0)[0]))
    # Beside END/2, by which the waves move the integral.
    assert errors[0] < 1e-4
    assert errors[1] < 1e-6
    assert errors[2] < 1e-10


def test_a_function_for_optimizers_has_the_same_slope() -> None:
    function = simulation_function(turning(), ["motor.w_fixed"], OF, until=END)
    slope = np.asarray(function.jacobian()(100.0, np.zeros(len(OF))))
    np.testing.assert_allclose(slope[:, 0], by_speed(100.0), rtol=1e-6)


def test_a_torque_that_is_a_mass_times_something() -> None:
    """The cam moves the follower as it is told, so the torque is proportional to its mass."""
    of = "rms(cam_shaft.flange.tau)"
    found = sensitivities(str(LINKAGES), of, "follower.m")
    assert found[of, "follower.m"] == pytest.approx(found.outputs[0].value / found.parameters[0].value, rel=1e-6)


def test_the_loss_of_an_ideal_switch_is_rounding_that_asks_for_no_steps() -> None:
    """A capacitor is charged by C V²/2 (1 - exp(-2 t/(R C))) lost in the resistor, from 1 ms on."""
    run = quick_run(load(str(CIRCUITS)))
    column, name = quadratures(run.model, [read_output(run.model, "switch.loss_energy")])
    assert len(replay(run, column, name).moves) < 30
    found = sensitivities(run, ["switch.loss_energy", "R1.loss_energy"], "battery.V")
    lost = 20e-6 * 12.0 * (1 - np.exp(-2 * 9e-3 / (100.0 * 20e-6)))
    np.testing.assert_allclose(found.derivatives[:, 0], [0.0, lost], rtol=1e-7, atol=1e-12)


def test_a_part_without_losses_has_none() -> None:
    found = sensitivities(turning(), "J.loss_energy", "motor.w_fixed", until=END)
    assert found.outputs[0].value == found.derivatives[0, 0] == 0.0
