"""Document 003: other readings of its formulas, whose brackets and exponents are lost in print.

Expected are the numbers of the project's TARGETS, from an independent program; those with two decimals are from the
equations written out in test_machine_tool_startup.py, with the force of the reading.
"""

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import pytest

from components import ConstantSpeed, ConstantTorque, Fixed, Inertia, MultiPlateClutch
from modelica_like import Assembly, Solution, load, simulate

NETLIST = Path(__file__).parents[2] / "examples" / "machine_tool_startup.toml"
JUMP = {"coil.start_current": 1 - 1 / 72.51}


@dataclass(frozen=True)
class Reading:
    """Values to set, and what follows.

    Attributes:
        static: torques of the fully pressed clutch at a slip of 32.417 rad/s, just above 0, and at rest, in N.m.
        moves: when the load begins to move, in s; None: never.
        locks: when the clutch locks, in s; None: never.
        peaks: largest torques of shaft 1, shaft 2 and clutch in N.m, as far as known.
    """

    values: dict[str, float]
    static: tuple[float | None, float | None, float | None]
    moves: float | None
    locks: float | None
    peaks: tuple[float | None, float | None, float | None]
    end: str = "2 s"
    light: dict[str, float] = field(default_factory=dict)
    """What is known for h1 = 1.2: locks, T1, T2, M."""


NONE = (None, None, None)
READINGS = {
    "S": Reading(
        {}, (297, 686, 911), 0.0812, 0.2655, (494.8, 552.8, 604.9),
        light={"locks": 0.2653, "T1": 512.2, "T2": 549.1, "M": 604.7},
    ),
    "literal": Reading(
        {"force": 72.51**2, **JUMP}, (297, 686, 911), 0.0703, 0.1655, (549.97, 648.69, 681.47),
        light={"locks": 0.1665, "T1": 558.74, "T2": 643.21, "M": 681.535},
    ),
    "A": Reading({"force": 72.5}, (6.56, 11.9, 15.0), None, None, (6.6, 6.6, 6.6)),
    "B": Reading(
        {"force": 725.0}, (43.1, 96.8, 128), 0.1057, 1.16756, (94.9, 93.0, 96.8),
        light={"locks": 1.16746, "T1": 96.1, "T2": 93.0},
    ),
    "S, R = 0.13": Reading({"radius": 0.13}, (32, 71, 93), 0.1144, 1.670, (69.8, 68.1, 70.9)),
    "E": Reading({"force": 72.51, "coil.polarised": True, **JUMP}, (6.6, 11.9, 15), 0.0743, None, NONE),
    "mu = 0.133": Reading(
        {"clutch.mu_min": 0.133, "clutch.curvature": 0.0, "clutch.slope": 0.0}, (911, 911, 911), 0.0770, 0.1815,
        (578.9, 553.4, 579.3),
    ),
    "B, w²": Reading({"force": 725.0, "load_exponent": 2.0}, NONE, 0.1057, None, (None, None, 41.6), end="20 s"),
}  # fmt: skip


@cache
def run(name: str, h1: float = 10.0) -> Solution:
    drive = load(NETLIST)
    for path, value in {**READINGS[name].values, "h1": h1}.items():
        drive.set(path, value)
    return simulate(drive, READINGS[name].end, points=10_000)


def first(solution: Solution, mode: str, after: str) -> float | None:
    return next((event.time for event in solution.events if (event.mode, event.after) == (mode, after)), None)


def peaks(solution: Solution) -> dict[str, float]:
    names = {"T1": "shaft1.tau", "T2": "shaft2.tau", "M": "clutch.tau"}
    return {name: float((-solution[path]).max()) for name, path in names.items()}


@pytest.mark.parametrize("name", READINGS)
def test_moves_and_locks(name: str) -> None:
    reading, solution = READINGS[name], run(name)
    for expected, mode, after in (
        (reading.moves, "load.mode", "forward"),
        (reading.locks, "clutch.mode", "stuck"),
    ):
        found = first(solution, mode, after)
        assert found == (None if expected is None else pytest.approx(expected, abs=6e-5 if expected < 1 else 2e-4))


@pytest.mark.parametrize("name", READINGS)
def test_largest_torques(name: str) -> None:
    found = peaks(run(name))
    for torque, expected in zip(found, READINGS[name].peaks, strict=True):
        if expected is not None:
            assert found[torque] == pytest.approx(expected, rel=1e-3, abs=0.06), torque


@pytest.mark.parametrize("name", [name for name, reading in READINGS.items() if reading.light])
def test_light_damping(name: str) -> None:
    solution = run(name, 1.2)
    found = {**peaks(solution), "locks": first(solution, "clutch.mode", "stuck")}
    for key, expected in READINGS[name].light.items():
        assert found[key] == pytest.approx(expected, rel=1e-3), key


def test_force_of_the_literal_reading_jumps() -> None:
    """From 0 to 5114 N at 0.07 s: implausible for a coil."""
    solution = run("literal")
    assert solution.at(0.07 - 1e-9)["coil.y"] == 0.0
    assert solution.at(0.07 + 1e-9)["coil.y"] * 72.51**2 == pytest.approx(5114, abs=0.5)


def test_weak_readings_stall() -> None:
    """Less than 9 N.m: the load never moves for long."""
    assert run("A").final["J4.w"] == pytest.approx(0.0, abs=1e-9)
    assert run("E").final["J4.w"] == pytest.approx(0.0, abs=1e-9)
    assert run("E")["J4.w"].max() < 0.02


def test_load_with_the_square_of_the_speed_never_comes_to_speed() -> None:
    final = run("B, w²").final
    assert final["J3.w"] == pytest.approx(17.7, abs=0.05)
    assert final["clutch.w_rel"] < -14


# -- the clutch alone --------------------------------------------------------------------------------------------------


def pressed(reading: Reading) -> MultiPlateClutch:
    """The clutch of the netlist with its final force."""
    values = reading.values
    return MultiPlateClutch(
        fn_max=values.get("force", 5256.25), cgeo=values.get("radius", 1.3), mu_min=values.get("clutch.mu_min", 0.04),
        w_min=12.57, curvature=values.get("clutch.curvature", 3.023e-5), slope=values.get("clutch.slope", 1.55e-4),
        mu_static=0.133, tau_drag=2.5,
    )  # fmt: skip


KNOWN = [name for name, reading in READINGS.items() if reading.static != NONE]


@pytest.mark.parametrize("name", KNOWN)
def test_friction_of_the_pressed_clutch(name: str) -> None:
    clutch, (fast, slow, static) = pressed(READINGS[name]), READINGS[name].static
    assert fast is not None
    assert slow is not None
    assert static is not None
    for slip, expected in ((32.417, fast), (1e-9, slow)):
        parts = {"motor": ConstantSpeed(w_fixed=slip), "clutch": clutch, "wall": Fixed()}
        slipping = simulate(Assembly("slips", parts=parts, series={"shaft": list(parts)}), "1 ms", points=1)
        assert -slipping.final["clutch.tau"] == pytest.approx(
            expected, abs=0.5 if float(expected).is_integer() else 0.05
        )
    for torque, mode in ((0.99 * static, "stuck"), (1.01 * static, "forward")):
        parts = {
            "wall": Fixed(),
            "clutch": clutch,
            "load": Inertia(J=1.0),
            "motor": ConstantTorque(tau_constant=torque),
        }
        held = simulate(Assembly("held", parts=parts, series={"shaft": list(parts)}), "1 ms", points=1, start="rest")
        assert (held.final["load.w"] > 0) == (mode == "forward")
