"""FMUs as parts of netlists: what runs together is what closed forms and momentum say."""

import re
import shutil
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from modelica_like import cosim, simulate
from modelica_like.errors import NetlistError

Built = Mapping[tuple[str, str], Path]
EXAMPLE = Path(__file__).parents[2] / "examples" / "cosim" / "speed_control.toml"
PAGE = Path(__file__).parents[2] / "docs" / "cosimulation.md"
J1, J2, C, D = 0.02, 0.08, 400.0, 0.2


def controlled(time: np.ndarray, j2: float) -> np.ndarray:
    """Speeds of both masses under tau = 5 - 0.5 J1.w, shape (times, 2): the exponential of the system's matrix."""
    a = np.array([[-(0.5 + D) / J1, D / J1, C / J1], [D / j2, -D / j2, -C / j2], [-1.0, 1.0, 0.0]])
    rest = -np.linalg.solve(a, [5.0 / J1, 0.0, 0.0])
    return np.array([(rest - expm(a * t) @ rest)[:2] for t in time])


def netlist(folder: Path, text: str) -> Path:
    path = folder / "bench.toml"
    path.write_text(text)
    return path


def test_the_example_runs_where_make_fmus_has_built_its_fmu(reference_fmus: Built, tmp_path: Path) -> None:
    home, built = tmp_path / "examples" / "cosim", tmp_path / "build" / "fmus"
    home.mkdir(parents=True)
    built.mkdir(parents=True)
    shutil.copy(EXAMPLE, home)
    shutil.copy(reference_fmus["two_mass", "2.0"], built)
    run = cosim(home / EXAMPLE.name, tolerance=1e-5)
    truth = controlled(run.time[::50], J2)
    assert run.time[-1] == pytest.approx(0.2)
    for k, name in enumerate(("drive.J1.w", "drive.J2.w")):
        assert run[name][::50] == pytest.approx(truth[:, k], abs=2e-3 * np.ptp(truth[:, k]))
    assert run["controller.braking.u"][-1] == pytest.approx(run["drive.J1.w"][-1], rel=1e-3)


@pytest.mark.parametrize(("version", "value"), [("2.0", '"1600 kg.cm2"'), ("3.0", "0.16")])
def test_values_are_given_to_the_fmu(version: str, value: str, reference_fmus: Built, tmp_path: Path) -> None:
    """A quantity is converted to the FMU's unit; dotted keys are names, with or without quotes."""
    shutil.copy(reference_fmus["two_mass", version], tmp_path / "drive.fmu")
    path = netlist(
        tmp_path,
        f"""
        [parts]
        drive = {{ is = "FMU", file = "drive.fmu", J2.J = {value} }}
        braking = {{ is = "Gain", k = "0.5 N.m.s/rad" }}
        wanted = {{ is = "Constant", k = "5 N.m" }}
        difference = {{ is = "Feedback" }}
        [connect]
        wanted = ["wanted.y", "difference.u1"]
        braked = ["braking.y", "difference.u2"]
        speed = ["drive.J1.w", "braking.u"]
        torque = ["drive.motor.tau", "difference.y"]
        """,
    )
    run = cosim(path, until=0.1, step=1e-4, master="gauss-seidel")
    truth = controlled(run.time[::100], 0.16)
    assert run["drive.J2.w"][::100] == pytest.approx(truth[:, 1], abs=2e-3 * np.ptp(truth[:, 1]))


def test_an_fmu_turns_a_shaft_through_an_adaptor(reference_fmus: Built, tmp_path: Path) -> None:
    """The torque that brakes the far mass of the FMU drives an inertia: equal momenta, opposite signs."""
    shutil.copy(reference_fmus["two_mass", "2.0"], tmp_path / "drive.fmu")
    path = netlist(
        tmp_path,
        """
        [parts]
        drive = { is = "FMU", file = "drive.fmu" }
        input = { is = "TorqueToAngleAdaptor" }
        wheel = { is = "Inertia", J = "0.5 kg.m2" }
        [connect]
        torque = ["drive.shaft.tau", "input.tau"]
        shaft = ["input.flange", "wheel.flange_a"]
        [start]
        "wheel.phi" = 0
        "wheel.w" = 0
        """,
    )
    run = cosim(path, until="0.1 s", step=1e-4)
    momentum, expected = 0.5 * run["bench.wheel.w"], -J2 * run["drive.J2.w"]
    assert np.abs(momentum - expected).max() < 3e-3 * np.ptp(expected)


def test_a_netlist_of_fmus_alone(reference_fmus: Built, tmp_path: Path) -> None:
    """One drives the other; the momentum of the second is the integral of its torque."""
    shutil.copy(reference_fmus["two_mass", "2.0"], tmp_path / "drive.fmu")
    part = '{ is = "FMU", file = "drive.fmu" }'
    path = netlist(tmp_path, f'[parts]\na = {part}\nb = {part}\n[connect]\nx = ["a.shaft.tau", "b.motor.tau"]')
    run = cosim(path, until=0.1, step=1e-4)
    momentum, expected = J1 * run["b.J1.w"] + J2 * run["b.J2.w"], -J2 * run["a.J2.w"]
    assert np.abs(momentum - expected).max() < 3e-3 * np.ptp(expected)


def test_such_a_netlist_is_not_simulated(reference_fmus: Built, tmp_path: Path) -> None:
    path = netlist(tmp_path, '[parts]\ndrive = { is = "FMU", file = "drive.fmu" }')
    with pytest.raises(NetlistError, match="drive is an FMU, which cannot be part of a system of equations"):
        simulate(path)


def test_the_page_shows_the_example() -> None:
    _, block = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    example = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
    del example["description"]
    assert tomllib.loads(block) == example
