"""States that follow the motion, in FMUs: the importer is told that they change, and no variable of the user does."""

from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from scipy.integrate import solve_ivp

from modelica_like.fmi.export import export_fmu
from modelica_like.language import guess
from modelica_like.netlist import loads
from modelica_like.netlist.registry import find_type

PARTS = Path(__file__).parents[2] / "examples" / "elements"
L, G, SPEED = 1.5, 9.81, 9.5


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    drive = find_type("full_turns:Pendulum", PARTS)(m=2.0, L=L, g=G, x=0.0, vx=SPEED, y=guess(-L))
    path = tmp_path_factory.mktemp("fmu") / "pendulum.fmu"
    export_fmu(drive, path, version=request.param, strict=True)
    return path


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
@pytest.mark.parametrize("changed", [{}, {"vx": 8.0}])
def test_the_pendulum_turns_over(fmu: Path, kind: str, changed: dict[str, float]) -> None:
    run = simulate_fmu(
        str(fmu), stop_time=4.0, output_interval=0.01, fmi_type=kind, relative_tolerance=1e-10, start_values=changed,
        output=["x", "y", "vx", "vy"],
    )  # fmt: skip
    start = changed.get("vx", SPEED) / L
    angle = solve_ivp(
        lambda _, y: [y[1], -G / L * np.sin(y[0])], (0, 4), [0, start], method="DOP853", rtol=1e-12, atol=1e-12,
        dense_output=True,
    ).sol(run["time"])[0]  # fmt: skip
    assert angle[-1] > 3 * np.pi
    assert run["x"] == pytest.approx(L * np.sin(angle), abs=2e-6)
    assert run["y"] == pytest.approx(-L * np.cos(angle), abs=2e-6)
    assert np.max(np.abs(run["x"] ** 2 + run["y"] ** 2 - L**2)) < 1e-10
    assert np.max(np.abs(run["x"] * run["vx"] + run["y"] * run["vy"])) < 1e-10


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_the_pendulum_starts_elsewhere(fmu: Path, kind: str) -> None:
    """Where the first weights would be singular without a reserve: at the height of the pivot, upwards."""
    run = simulate_fmu(
        str(fmu), stop_time=1.0, fmi_type=kind, relative_tolerance=1e-9, output=["x", "y", "vx", "vy"],
        start_values={"x": 1.4999, "vx": 0.1, "y": -0.01},
    )  # fmt: skip
    energy = (run["vx"] ** 2 + run["vy"] ** 2) / 2 + G * run["y"]
    assert run["x"][0] == pytest.approx(1.4999, rel=1e-12)
    assert np.ptp(energy) < 1e-6 * np.max(np.abs(energy) + run["vx"] ** 2 + run["vy"] ** 2)


def test_a_steady_start_may_need_other_weights(tmp_path: Path) -> None:
    text = """
    [parts]
    p = { is = "full_turns:Pendulum", m = "2 kg", L = "1.5 m" }
    [guess]
    "p.x" = "1.45 m"
    "p.y" = "-0.3 m"
    "p.vx" = "0 m/s"
    [simulate]
    until = "1 s"
    start = "steady"
    """
    path = tmp_path / "hanging.fmu"
    export_fmu(loads(text, str(PARTS / "hanging.toml")), path, strict=True)
    run = simulate_fmu(str(path), stop_time=1.0, fmi_type="ModelExchange", output=["p.x", "p.y"])
    assert run["p.x"] == pytest.approx(0.0, abs=1e-9)
    assert run["p.y"] == pytest.approx(-L, rel=1e-9)
