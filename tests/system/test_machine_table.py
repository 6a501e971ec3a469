"""Document 000: a clutch of constant torque brings a machine table to speed, directly and through a gear.

The closed form: motor speed w and clutch torque M are constant, so the driven side starts with constant acceleration,
locks at the acceleration time t_A, and the slip energy is M·w·t_A/2, one half of the motor's work.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
import pytest

from modelica_like import Solution, load, simulate

EXAMPLES = Path(__file__).parents[2] / "examples"
EXACT = 1e-6
PUBLISHED = 3e-3
"""The document calculates with truncated intermediate results, up to 0.22 % off."""

t_A, m, u, M_L = 0.2, 500.0, 1.5, 15.0
w_spindle = 6000 * pi / 30


@dataclass(frozen=True)
class Table:
    """One of the two drives, sized by the document's formulas; inertias are referred to the clutch shaft."""

    netlist: str
    motor_speed: float
    referred_inertia: float
    published_clutch_torque: float
    published_slip_energy: float
    lock_up_with_published_torque: float

    @property
    def load_torque(self) -> float:
        return M_L * w_spindle / self.motor_speed

    @property
    def clutch_torque(self) -> float:
        return self.referred_inertia * self.motor_speed / t_A + self.load_torque

    @property
    def slip_energy(self) -> float:
        return self.clutch_torque * self.motor_speed * t_A / 2

    @property
    def kinetic_energy(self) -> float:
        return self.referred_inertia * self.motor_speed**2 / 2


J_table = m * (u / w_spindle) ** 2
w_slow = 1440 * pi / 30
DIRECT = Table("machine_table_direct", w_spindle, 0.004 + 0.016 + J_table, 86.63, 5443.0, 0.200431)
GEARED = Table(
    "machine_table_geared",
    w_slow,
    0.004 + 0.014 + (0.007 + 0.016 + J_table) * (w_spindle / w_slow) ** 2,
    414.62,
    6252.0,
    0.199899,
)
BOTH = pytest.mark.parametrize("table", [DIRECT, GEARED], ids=["direct", "geared"])


@pytest.fixture(scope="module")
def run() -> Callable[[Table], Solution]:
    runs = {table: simulate(EXAMPLES / f"{table.netlist}.toml") for table in (DIRECT, GEARED)}
    return runs.__getitem__


def exactly(value: float) -> object:
    return pytest.approx(value, rel=EXACT)


def test_targets_in_numbers() -> None:
    assert (DIRECT.slip_energy, GEARED.slip_energy) == (exactly(5452.8196), exactly(6249.6519))
    assert (DIRECT.kinetic_energy, GEARED.kinetic_energy) == (exactly(4510.342), exactly(5307.174))
    assert (DIRECT.load_torque, GEARED.load_torque) == (exactly(15.0), exactly(62.5))


@BOTH
def test_locks_once_at_the_acceleration_time(table: Table, run: Callable[[Table], Solution]) -> None:
    (event,) = run(table).events
    assert (event.mode, event.before, event.after) == ("clutch.mode", "backward", "stuck")
    assert event.time == pytest.approx(t_A, abs=1e-10)


@BOTH
def test_energies(table: Table, run: Callable[[Table], Solution]) -> None:
    locked = simulate(run(table).model, t_A).energy()
    assert locked["clutch"].lost == exactly(table.slip_energy)
    assert locked["motor"].source == exactly(2 * table.slip_energy)
    assert locked.stored == exactly(table.kinetic_energy)
    assert -locked["load"].source == exactly(M_L * w_spindle * t_A / 2)
    assert locked.power_closure < 1e-8
    whole = run(table).energy()
    assert whole["clutch"].lost == exactly(table.slip_energy)
    assert whole.lost == exactly(table.slip_energy)
    assert whole.power_closure < 1e-8


@BOTH
def test_motion(table: Table, run: Callable[[Table], Solution]) -> None:
    result = run(table)
    speed = u * np.minimum(result.time / t_A, 1.0)
    np.testing.assert_allclose(result["table.v"], speed, rtol=0, atol=EXACT * u)
    assert result.at(t_A)["table.s"] == exactly(0.150)
    assert result.at(t_A)["clutch.phi_rel"] == exactly(-table.motor_speed * t_A / 2)
    assert result.final["table.v"] == exactly(u)


@BOTH
def test_clutch_torque_drops_to_the_load_after_lock_up(table: Table, run: Callable[[Table], Solution]) -> None:
    result = run(table)
    slipping = result["clutch.mode"] != result.final["clutch.mode"]
    np.testing.assert_allclose(result["clutch.tau"][slipping], -table.clutch_torque, rtol=EXACT)
    np.testing.assert_allclose(result["clutch.tau"][~slipping], -table.load_torque, rtol=EXACT)


@BOTH
def test_as_published(table: Table) -> None:
    assert table.clutch_torque == pytest.approx(table.published_clutch_torque, rel=PUBLISHED)
    assert table.slip_energy == pytest.approx(table.published_slip_energy, rel=PUBLISHED)
    drive = load(EXAMPLES / f"{table.netlist}.toml")
    drive.set("clutch.capacity", table.published_clutch_torque)
    result = simulate(drive)
    assert result.events[0].time == pytest.approx(table.lock_up_with_published_torque, abs=1e-6)
    assert result.energy()["clutch"].lost == pytest.approx(table.published_slip_energy, rel=PUBLISHED)
