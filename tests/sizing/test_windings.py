"""Document 002, equations 1 to 6 and 15, sections 2.1.2 and 2.2: conductor, winding, ripple, generator."""

import math

import numpy as np
import pytest

from components.sizing import (
    DcMotor,
    commutated,
    commutation_ripple,
    conductor_force,
    conductor_voltage,
    generator_point,
    machine_constant,
)


def test_the_constant_is_that_of_the_conductors() -> None:
    """Torque and voltage of 200 conductors in two branches, each in the mean field of a pole, by equations 1 and 2."""
    conductors, pairs, radius, length, field = 200, 2, 0.02, 0.05, 0.3
    flux = field * 2 * math.pi * radius * length / (2 * pairs)
    made = machine_constant(conductors, pairs, flux)
    assert made.constant == pytest.approx(conductors * conductor_force(0.5, length, field) * radius)
    branch = conductors / 2 * conductor_voltage(100.0 * radius, length, field)
    assert made.constant * 100.0 == pytest.approx(branch)
    assert made.speed_factor * flux * 100.0 / (2 * math.pi) == pytest.approx(branch)
    assert machine_constant(conductors, pairs, flux, pairs).constant == pytest.approx(made.constant / 2)
    assert (made.torque_factor, made.speed_factor) == pytest.approx((conductors * pairs / (2 * math.pi), 400.0))


def test_a_conductor_along_the_field_feels_nothing() -> None:
    assert conductor_force(5.0, 0.1, 0.5, 0.0) == 0
    assert conductor_force(5.0, 0.1, 0.5, math.pi / 6) == pytest.approx(0.125)
    assert conductor_voltage(3.0, 0.1, 0.5, math.pi / 6) == pytest.approx(0.075)


def test_figure_3_of_the_document() -> None:
    """Two loops at a right angle, the better one connected: the crest of two rectified sines, from 0.707 to 1."""
    angle = np.linspace(0, 2 * math.pi, 7201)
    crest = np.maximum(abs(np.sin(angle)), abs(np.cos(angle)))
    assert commutated(angle, 2) == pytest.approx(crest)
    made = commutation_ripple(2)
    assert (made.pulses, made.smallest) == pytest.approx((4, math.sqrt(0.5)))
    assert made.mean == pytest.approx(np.mean(crest[:-1]), rel=1e-6)
    assert made.ripple == pytest.approx((1 - math.sqrt(0.5)) / (2 * math.sqrt(2) / math.pi))


@pytest.mark.parametrize("loops", [1, 2, 3, 8])
def test_loops_in_series_have_the_same_crest(loops: int) -> None:
    angle = np.linspace(0, math.pi, 3601)
    series = np.sum([abs(np.cos(angle - k * math.pi / loops)) for k in range(loops)], axis=0)
    shift = 0.0 if loops % 2 else math.pi / (2 * loops)
    assert series / np.max(series) == pytest.approx(commutated(angle + shift, loops), abs=1e-6)
    made = commutation_ripple(loops)
    assert np.min(series) / np.max(series) == pytest.approx(made.smallest, abs=1e-9)
    assert (np.max(series) - np.min(series)) / np.mean(series[:-1]) == pytest.approx(made.ripple, rel=1e-6, abs=1e-9)


def test_more_loops_make_it_even() -> None:
    assert commutation_ripple(1).ripple == pytest.approx(math.pi / 2)
    assert commutation_ripple(16, pole_pairs=2).pulses == 64
    assert commutation_ripple(16).ripple == pytest.approx((math.pi / 32) ** 2 / 2, rel=2e-3)
    with pytest.raises(ValueError, match="at least one loop"):
        commutation_ripple(0)


def test_generator_delivers_what_friction_and_resistance_leave() -> None:
    generator = DcMotor(0.05, 0.8, 0.04, 1e-4)
    point = generator_point(generator, 480.0, 2.0)
    assert point.voltage == pytest.approx(22.4)
    assert point.torque == pytest.approx(0.1 + 0.04 + 0.048)
    assert point.input_power - point.output_power == pytest.approx(0.8 * 4 + (0.04 + 0.048) * 480)
    assert point.efficiency == pytest.approx(44.8 / 90.24)
