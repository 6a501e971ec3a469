"""Calibration against an independent solver, and against data that closed forms made."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from components import ConstantTorque, Damper, Fixed, HeatSource, Inertia, ThermalMass
from modelica_like import build, load
from modelica_like.analyse.calibration.calibrate import Numbers, OperatingPoints, Trajectories, calibrate
from modelica_like.analyse.calibration.measurements import read_table
from modelica_like.errors import CalibrationFailed, NetlistError, UnknownName, ValueOutOfRange
from modelica_like.language import Component, Equations, connect, series
from modelica_like.netlist import loads

EXAMPLES = Path(__file__).parents[2] / "examples"
TORQUES = np.linspace(0.0, 250.0, 26)


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("calibrate_bench", EXAMPLES / "calibration" / "dc_bench.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def identified(example):
    return example.identify()


def test_each_measured_line_alone_fits_a_machine(identified):
    """Closed forms: k_t and friction from the current line; k_e, R and friction from the speed line and I(0)."""
    current, speed = identified["current"], identified["speed"]
    assert current["k"] == pytest.approx(1 / 20, rel=1e-9)
    assert current["friction"] == pytest.approx(1.06 / 20, rel=1e-9)
    n0, slope = 4736.5 * np.pi / 30, 3.48e3 * np.pi / 30
    # n0 = (U - R I0) / k and dn/dM = R / k²: k² slope I0 + k n0 - U = 0.
    k = (-n0 + np.sqrt(n0**2 + 4 * slope * 1.06 * 24.0)) / (2 * slope * 1.06)
    assert speed["k"] == pytest.approx(k, rel=1e-8)
    assert speed["R"] == pytest.approx(slope * k**2, rel=1e-8)
    assert speed["friction"] == pytest.approx(1.06 * k, rel=1e-8)
    assert current["k"] / speed["k"] == pytest.approx(1.07, abs=0.005)


def test_what_the_data_do_not_tell_is_told(identified):
    current = identified["current"]
    assert not current.identifiable
    assert current.rank == 2
    assert set(current.undetermined[0]) == {"R"}
    assert "The data do not determine this combination: R" in str(current)


def test_both_lines_as_an_independent_solver_fits_them(identified):
    both = identified["both"]
    torque = TORQUES * 1e-3
    speeds, currents = (4736.5 - 3.48 * TORQUES) * np.pi / 30, 0.02 * TORQUES + 1.06

    def residuals(p):
        k, r, friction = p * np.array([0.05, 0.8, 0.05])
        found = (torque + friction) / k
        deviations = (
            ((24.0 - r * found) / k - speeds) / (0.01 * speeds.max()),
            (found - currents) / (0.01 * currents.max()),
        )
        return np.concatenate(deviations)

    fitted = least_squares(residuals, np.ones(3), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(both.values, fitted.x * [0.05, 0.8, 0.05], rtol=1e-6)
    slopes = fitted.jac / [0.05, 0.8, 0.05]
    covariance = np.linalg.inv(slopes.T @ slopes) * (2 * fitted.cost / (52 - 3))
    np.testing.assert_allclose(both.covariance, covariance, rtol=1e-4)
    np.testing.assert_allclose(both.fisher, slopes.T @ slopes, rtol=1e-4)
    assert both.identifiable


def test_rotor_inertia_from_the_time_to_the_final_voltage(example):
    """Document 002: 5.4e-5 kg.m2 where 98 % are reached after 0.7 s (0.7006 s in the exact solution)."""
    assert example.rotor_inertia()["rotor"] == pytest.approx(5.4e-5, rel=5e-3)


class Braked(Component):
    """w' = (tau - d w) / J: w = tau/d (1 - exp(-d t / J))."""

    def build(self) -> None:
        self.torque = ConstantTorque(tau_constant=2.0)
        self.mass = Inertia(J=1.0, w=0.0, phi=0.0)
        self.damper = Damper(d=1.0)
        self.wall = Fixed()

    def equations(self) -> Equations:
        yield connect(self.torque.flange, self.mass.flange_a)
        yield from series(self.mass, self.damper, self.wall)


TIMES = np.array([0.1, 0.3, 0.7, 1.5, 3.0])
SPEEDS = 2.0 / 0.5 * (1 - np.exp(-0.5 * TIMES / 0.8))
BOUNDS = {"mass.J": (0.1, 5.0), "damper.d": ("0.1 N.m.s/rad", 3.0)}


@pytest.fixture(scope="module")
def braked():
    return build(Braked())


def test_trajectory(braked):
    found = calibrate(braked, Trajectories({"time": TIMES, "mass.w": SPEEDS}), BOUNDS)
    assert found["mass.J"] == pytest.approx(0.8, rel=1e-5)
    assert found["damper.d"] == pytest.approx(0.5, rel=1e-5)
    assert found.cost < 1e-9


def test_trajectory_from_a_file_with_units(braked, tmp_path):
    file = tmp_path / "measured.csv"
    rows = "\n".join(f"{t * 1000},{w * 30 / np.pi}" for t, w in zip(TIMES, SPEEDS, strict=True))
    file.write_text(f"# measured\ntime [ms],mass.w [rpm]\n{rows}\n")
    found = calibrate(braked, Trajectories(file), BOUNDS)
    assert found["mass.J"] == pytest.approx(0.8, rel=1e-5)


def test_tables_of_other_packages():
    import pandas
    import xarray

    frame = pandas.DataFrame({"time": TIMES, "mass.w [rpm]": SPEEDS})
    columns = read_table(frame)
    assert columns["mass.w"][1] == "rpm"
    data = xarray.Dataset({"mass.w": ("time", SPEEDS, {"units": "rad/s"})}, coords={"time": TIMES})
    columns = read_table(data)
    np.testing.assert_array_equal(columns["mass.w"][0], SPEEDS)
    assert columns["mass.w"][1] == "rad/s"


def test_many_starts_find_the_same(braked):
    found = calibrate(
        braked, Numbers({"at(mass.w, 0.7 s)": SPEEDS[2], "mass.w": SPEEDS[4]}, until=3.0), BOUNDS, starts=4
    )
    assert found["mass.J"] == pytest.approx(0.8, rel=1e-5)
    assert len(found.starts) == 4


def test_a_bound_that_stops_it_is_told(braked):
    found = calibrate(braked, Numbers({"mass.w": SPEEDS[4]}, until=3.0), {"damper.d": (1.0, 3.0)})
    assert found.at_bounds == ("damper.d",)


def test_a_parameter_that_is_zero_is_determined(braked):
    """Without damping w = 2 t/J: data tell that d is zero, though no relative change of it changes anything."""
    data = Trajectories({"time": TIMES, "mass.w": 2.0 * TIMES / 0.8})
    found = calibrate(braked, data, {"mass.J": (0.1, 5.0), "damper.d": (0.0, 3.0)})
    assert found.identifiable
    assert found["damper.d"] == pytest.approx(0.0, abs=1e-6)
    assert np.all(found.confidence < 1e-4)


def test_as_many_numbers_as_parameters_have_the_interval_of_their_uncertainty(braked):
    """There is no scatter: w = 4 (1 - exp(-t d/J)) with d = 0.5 known; J is off by 1.96 sigma / |dw/dJ|."""
    time, sigma = 0.7, 0.01
    measured = Numbers({"mass.w": 4 * (1 - np.exp(-0.5 * time / 0.8))}, {"mass.w": sigma}, time, {"damper.d": 0.5})
    found = calibrate(braked, measured, {"mass.J": (0.1, 5.0)})
    slope = 4 * np.exp(-0.5 * time / 0.8) * 0.5 * time / 0.8**2
    assert found.confidence == pytest.approx(1.959964 * sigma / slope, rel=1e-5)


def test_a_value_that_cannot_be_run_shortens_the_step():
    """Document 000: the clutch locks after J W/(M - 15 N.m). The first step from 250 N.m leads too far."""
    W = 200.0 * np.pi
    J = 0.004 + 0.016 + 500.0 * (0.015 / (2.0 * np.pi)) ** 2
    drive = load(EXAMPLES / "machine_table_direct.toml")
    guess = {"clutch.capacity": "250 N.m"}
    found = calibrate(drive, Numbers({"clutch.lock_time": 0.39}), {"clutch.capacity": (5, 300)}, guess=guess)
    assert found["clutch.capacity"] == pytest.approx(J * W / 0.39 + 15.0, rel=1e-6)
    assert "1 design was left out: 'clutch.lock_time' does not happen" in str(found)


FORCED = """
[parts]
profile = { is = "Table", table = [[0, 1], [2, 1]] }
drive = { is = "Force" }
mass = { is = "Mass", m = "1 kg", s = 0, v = 0 }
[series]
a = ["drive", "mass"]
[connect]
f = ["profile.y", "drive.f"]
[simulate]
until = "2 s"
"""


def test_values_of_a_table_are_found(tmp_path):
    """v = f0 t + (f1 - f0) t²/4 and s = f0 t²/2 + (f1 - f0) t³/12, with 3 N at first and 0.6 N after 2 s."""
    f0, f1 = 3.0, 0.6
    data = Numbers({"mass.v": 2 * f0 + f1 - f0, "mass.s": 2 * f0 + (f1 - f0) * 2 / 3})
    tried = []
    found = calibrate(
        loads(FORCED), data, {"profile.table": {"rows": [1, 2], "from": 0, "to": 5}},
        progress=lambda designs, most: tried.append(designs),
    )  # fmt: skip
    np.testing.assert_allclose(found.values, [f0, f1], rtol=1e-6)
    assert tried == list(range(1, len(tried) + 1))
    found.save(tmp_path / "fitted.toml")
    again = load(tmp_path / "fitted.toml")
    np.testing.assert_allclose(np.array(again.profile.table)[:, 1], [f0, f1], rtol=1e-6)


class Warm(Component):
    """A body without losses: T = 300 K + Q t / C."""

    def build(self) -> None:
        self.source = HeatSource(Q_flow=100.0)
        self.body = ThermalMass(C=50.0, T=300.0)

    def equations(self) -> Equations:
        yield connect(self.source.port, self.body.port)


def test_an_uncertainty_of_a_temperature_is_a_difference():
    """Two readings that contradict each other by 10 K: the more certain one counts four times as much."""
    temperature, wanted = 300.0 + 100.0 * 2.0 / 40.0, {"body.T": 300.0 + 100.0 * 2.0 / 40.0}
    data = [
        Numbers(wanted, {"body.T": "1 degC"}, 2.0),
        Numbers({"body.T": f"{temperature - 273.15 + 10.0} degC"}, {"body.T": "2 K"}, 2.0),
    ]
    found = calibrate(build(Warm()), data, {"body.C": (10.0, 100.0)})
    assert 200.0 / found["body.C"] == pytest.approx(200.0 / 40.0 + 10.0 / 5.0, rel=1e-6)


@pytest.mark.parametrize(
    ("data", "parameters", "error"),
    [
        ([], BOUNDS, ValueOutOfRange),
        (Numbers({"mass.w": 1.0}, until=1.0), {}, ValueOutOfRange),
        (Numbers({"mass.w": 1.0}, until=1.0), {"mass.J": (2.0, 1.0)}, ValueOutOfRange),
        (Numbers({"mass.w": 1.0}, until=1.0), {"mass.j": (1.0, 2.0)}, UnknownName),
        (Numbers({"mass.v": 1.0}, until=1.0), {"mass.J": (1.0, 2.0)}, UnknownName),
        (Numbers({"mass.w": 0.0}, until=1.0), {"mass.J": (1.0, 2.0)}, ValueOutOfRange),
        (Trajectories({"mass.w": [1.0]}), {"mass.J": (1.0, 2.0)}, UnknownName),
        (Trajectories({"time": [1.0], "mass.w": [1.0, 2.0]}), {"mass.J": (1.0, 2.0)}, ValueOutOfRange),
    ],
)
def test_wrong_calls(braked, data, parameters, error):
    with pytest.raises(error):
        calibrate(braked, data, parameters)


def test_a_model_that_cannot_be_computed():
    """Without friction, a torque has no steady state."""
    free = build(Accelerated())
    table = {"torque.tau_constant": [1.0], "mass.w": [1.0]}
    with pytest.raises(CalibrationFailed, match="could not be calibrated: No steady state"):
        calibrate(free, OperatingPoints(table, given=["torque.tau_constant"]), {"mass.J": (1.0, 2.0)})


class Accelerated(Component):
    def build(self) -> None:
        self.torque = ConstantTorque(tau_constant=2.0)
        self.mass = Inertia(J=1.0, w=0.0, phi=0.0)

    def equations(self) -> Equations:
        yield from series(self.torque, self.mass)


def test_a_broken_table(tmp_path):
    file = tmp_path / "broken.csv"
    file.write_text("time,mass.w\n0,abc\n")
    with pytest.raises(NetlistError, match=r"broken\.csv:\d: '.*' is not a number"):
        read_table(file)
