"""Every design check works alike on floats, numpy arrays and CasADi expressions."""

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import numpy as np
import pytest

from components import sizing
from components.sizing import (
    DcMotor,
    GearMaterial,
    GearPair,
    Load,
    LoadStage,
    MotorLines,
    RavigneauxTeeth,
    Section,
    ShaftMaterial,
)
from components.sizing.maths import settled

LINES = MotorLines(24.0, 496.0, 364.0, 1.06, 20.0)
TEETH = RavigneauxTeeth(21, 39, 13, 10, 60)
PAIR = GearPair(17, 43, 3e-3, 0.03, 0.3, 0.1, 0.2)
STRENGTH = sizing.gear_strength(PAIR, 150.0, GearMaterial(1500e6, 461e6))
LOADS = [Load(0.0, -40.5, -25.0, 0.6), Load(0.06, 1.0, 2.0, -0.6, 0.1, 0.2)]


def given(**arguments: Any) -> dict[str, Any]:
    return arguments


# check, arguments that become arrays or symbols, plain arguments
CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "machine_table_clutch": (
        given(motor_speed=150.8, acceleration_time=0.2, load_torque=15.0, table_mass=500.0, table_velocity=1.5,
             spindle_inertia=0.016, hub_inertia=0.004, spindle_speed=628.0, gear_input_inertia=0.014,
             gear_output_inertia=0.007), {}),
    "clutch_selection": (given(power=40.0, speed=139.6, rated_torque=0.6, service_factor=2.0), {}),
    "clutch_heat": (given(work=4000.0, frequency=0.02, single_limit=20e3, transition_frequency=0.01, heat_capacity=90.0,
                         conductance=3.0, air=293.15, hottest=450.0, wear_work=1e9), {}),
    "belt_geometry": (given(small_teeth=10.0, large_teeth=30.0, pitch=5.08e-3, belt_length=0.33), {}),
    "belt_forces": (given(pull=25.0, angle=2.85, friction=0.5, velocity=3.4, section=19e-6, density=1200.0), {}),
    "timing_belt_load": (given(pull=25.0, velocity=3.4, teeth_in_mesh=4.0, width=9.5e-3, tooth_height=1.27e-3,
                              power_limit=300.0, pressure_limit=1.5e6), {}),
    "machine_constant": (given(conductors=100.0, pole_pairs=2.0, flux=1.5e-3, parallel_pairs=1.0), {}),
    "commutation_ripple": (given(loops=2.0, pole_pairs=1.0), {}),
    "generator_point": (given(generator=DcMotor(0.05, 0.8, 0.04, 1e-4), speed=480.0, current=2.0), {}),
    "shaft_fatigue": (given(bending=1.05, torque=0.6, diameter=6e-3, material=ShaftMaterial(430e6, 275e6, 215e6, 125e6),
                            large_diameter=8e-3, fillet=2e-3, bending_factor=1.25, torsion_factor=1.3, alternating=0.5,
                            required_safety=2.5), {}),
    "belt_speed_limit": (given(speed=418.9, diameter=0.016, limit=523.0, velocity_limit=80.0), {}),
    "speed_limit": (given(speed=418.9, limit=157.0, ratio=3.0), {}),
    "shaft_statics": (given(loads=LOADS), given(bearings=[0.025, 0.037])),
    "shaft_stress": (given(bending=1.0, torque=-0.6, diameter=6e-3, yield_strength=275e6, bending_factor=1.25,
                          torsion_factor=1.14, axial_force=-100.0, required_safety=2.5, at=0.02), {}),
    "shaft_diameter": (given(bending=1.3, strength=275e6, safety=2.5, diameter=6e-3), {}),
    "stepped_shaft": (given(loads=LOADS, yield_strength=275e6, required_safety=2.5), given(
        bearings=[0.025, 0.037], sections=[Section(0.022, 6e-3, 2e-3), Section(0.06, 8e-3)])),
    "gear_strength": (given(pair=PAIR, torque=150.0, material=GearMaterial(1500e6, 461e6), application=1.25,
                            dynamic=1.1, face_load=1.2, transverse_load=1.1, flank_life=0.9, root_life=0.9,
                            flank_influence=0.95, root_influence=0.95, pinion_reversal=0.7), {}),
    "gear_teeth": (given(pair=PAIR, required_ratio=1.2, required_tip=0.3, required_clearance=0.15), {}),
    "gear_life": (given(strength=STRENGTH, wheel_cycles=0.4, spectrum=[LoadStage(4.0, 1e4), LoadStage(2.0, 1e6)]), {}),
    "bearing_life": (given(radial_load=150.0, speed=139.6, dynamic_rating=2600.0, static_rating=1060.0,
                          speed_limit=3351.0, exponent=3.0, axial_load=10.0, radial_factor=0.56, axial_factor=1.6), {}),
    "flywheel_for_time": (given(time=0.2, torque=0.6, speed=139.6, density=2700.0, radius=0.045, width_limit=0.1), {}),
    "flywheel": (given(width=0.068, radius=0.045, density=2700.0, torque=0.6, speed=139.6, width_limit=0.1), {}),
    "deflection": (given(mass=3.35, span=0.175, side=0.008, modulus=210e9), {}),
    "ravigneaux_gear": (given(input_speed=104.7, input_torque=100.0, mesh_efficiency=0.95, load_sharing=1.2),
                        given(teeth=TEETH)),
    "ravigneaux_assembly": (given(teeth=TEETH), {}),
    "lepelletier_gear": (given(input_speed=104.7, input_torque=1.0, front_ratio=-1.917, small_ratio=2.74,
                              large_ratio=-2.24, mesh_efficiency=0.95), given(gear="4")),
    "lepelletier": (given(input_speed=104.7, input_torque=1.0, front_ratio=-1.917, small_ratio=2.74, large_ratio=-2.24,
                         mesh_efficiency=0.95), {}),
    "measured_lines": (given(voltage=24.0, no_load_speed=496.0, speed_drop=364.0, no_load_current=1.06,
                             current_rise=20.0), {}),
    "motor_lines": (given(motor=DcMotor(0.05, 0.8, 0.04, 1e-4), voltage=24.0), {}),
    "motor_on_lines": (given(lines=LINES, torque=0.2), {}),
    "motor_point": (given(torque=0.2, speed=418.0, voltage=24.0, current=5.2), {}),
    "dc_motor_point": (given(motor=DcMotor(0.05, 0.8, 0.04, 1e-4), voltage=24.0, torque=0.2), {}),
    "motor_summary": (given(lines=LINES), {}),
    "drive_for_clutch": (given(clutch_torque=0.6, motor_speed=418.9, ratio=3.0, clutch_speed_limit=157.0), {}),
    "shunt_motor": (given(voltage=24.0, mutual=0.01, field_resistance=4.0, resistance=0.8, friction=0.01), {}),
    "line_consistency": (given(lines=LINES), {}),
    "fit_speed_line": (given(lines=LINES, largest_torque=0.25), {}),
    "fit_current_line": (given(lines=LINES, nominal_torque=0.21), {}),
    "fit_least_squares": (given(lines=LINES, largest_torque=0.25, speed_scale=400.0, current_scale=5.0),
                          given(viscous=True, points=6)),
}  # fmt: skip
WITHOUT_ROWS = ("stepped_shaft",)  # of numbers only the worse side of a cut is told


def changed(value: Any, change: Callable[[float], Any]) -> Any:
    """Replace every number in the arguments."""
    if isinstance(value, int | float):
        return change(float(value))
    if isinstance(value, list):
        return [changed(item, change) for item in value]
    if isinstance(value, dict):
        return {key: changed(item, change) for key, item in value.items()}
    fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    places = {"at": fields.pop("at")} if "at" in fields else {}
    return type(value)(**places, **{name: changed(item, change) for name, item in fields.items()})


def numbers(result: Any, rows: bool) -> Iterator[Any]:
    """Yield every number of a result, those of its rows too."""
    for field in dataclasses.fields(result):
        value = getattr(result, field.name)
        if isinstance(value, tuple) and dataclasses.is_dataclass(value[0]):
            for row in value if rows else ():
                yield from numbers(row, rows)
        elif isinstance(value, tuple):
            yield from value
        elif not isinstance(value, str):
            yield 1.0 * value


def run(name: str, change: Callable[[float], Any]) -> list[Any]:
    variable, plain = CASES[name]
    result = getattr(sizing, name)(**changed(variable, change), **plain)
    return list(numbers(result, name not in WITHOUT_ROWS))


def test_every_check_is_here() -> None:
    checks = {name for name in sizing.__all__ if hasattr(getattr(sizing, name), "__code__")}
    returning = {name for name in checks if "Result" in str(_bases(getattr(sizing, name)))}
    assert returning == set(CASES)


def _bases(function: Any) -> Any:
    kind = getattr(sizing, str(function.__annotations__["return"]), None)
    return kind.__mro__ if isinstance(kind, type) else ()


@pytest.mark.parametrize("name", CASES)
def test_arrays(name: str) -> None:
    scales = np.array([1.0, 1.004, 0.997])
    together = run(name, lambda number: number * scales)
    for k, scale in enumerate(scales):
        single = run(name, lambda number, scale=scale: number * scale)
        picked = [np.broadcast_to(value, scales.shape)[k] for value in together]
        assert picked == pytest.approx(single, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_expressions(name: str, kind: Any) -> None:
    symbols, values = [], []

    def symbol(number: float) -> Any:
        symbols.append(kind.sym(f"p{len(symbols)}"))
        values.append(number)
        return symbols[-1]

    outputs = run(name, symbol)
    function = ca.Function("check", symbols, [kind(output) for output in outputs])
    evaluated = [float(value) for value in function.call(values)]
    assert evaluated == pytest.approx(run(name, float), rel=1e-9, abs=1e-9)


def test_derivative_of_a_safety() -> None:
    """A shaft can be optimised: d(safety)/d(diameter) = 3·safety/diameter for bending and torsion."""
    diameter = ca.SX.sym("diameter")
    safety = sizing.shaft_stress(1.0, 0.6, diameter, 275e6).safety
    rate = ca.Function("rate", [diameter], [safety, ca.jacobian(safety, diameter)])
    value, slope = (float(item) for item in rate(6e-3))
    assert slope == pytest.approx(3 * value / 6e-3)


def test_position_of_a_load_as_expression() -> None:
    """d(reaction)/d(position) of a load between two bearings is force over span."""
    at = ca.SX.sym("at")
    statics = sizing.shaft_statics([Load(at, y=-1000.0)], [0.0, 0.5])
    rate = ca.Function("rate", [at], [statics.reactions[1].y, ca.jacobian(statics.reactions[1].y, at),
                                      statics.largest_bending])  # fmt: skip
    force, slope, bending = (float(item) for item in rate(0.2))
    assert (force, slope, bending) == pytest.approx((400.0, 2000.0, 120.0))


def test_rounding_in_a_difference_is_zero_without_a_sign() -> None:
    """Values larger than rounding of their scale stay, whatever their sign."""
    assert [settled(one, -10.0) for one in (-5.0, 5.0)] == [-5.0, 5.0]
    assert [str(float(settled(one, -10.0))) for one in (-1e-20, 1e-20)] == ["0.0", "0.0"]
