"""The winch: the numbers of its page by hand, its gradients, and its time."""

from functools import lru_cache
from math import atan, cos, log, radians, sqrt, tan
from pathlib import Path

import pytest

from modelica_like import Solution, cosim, load, sensitivities, simulate, split

WINCH = Path(__file__).parents[2] / "examples" / "winch.toml"
G = 9.80665
RISE, RHO = radians(5), atan(0.05 / cos(radians(20)))
DRIVING, DRIVEN = tan(RISE) / tan(RISE + RHO), tan(RISE - RHO) / tan(RISE)
CONSTANT = (24 - 0.045 * 55) / (900 * 0.10471975511965977)


@lru_cache
def run() -> Solution:
    return simulate(WINCH, rtol=1e-9)


def moment(mode: str, after: str, begin: float = 0.0) -> float:
    return next(e.time for e in run().events if (e.mode, e.after) == (mode, after) and e.time >= begin)


def test_lifting_by_hand() -> None:
    """Torque at the drum, through the worm, current, speed; rope that hangs less than 8 m."""
    at = run().at(4.0)
    drum = 0.08 * G * (300 + 0.35 * (8 - at["drum.s"]))
    motor = drum / 40 / DRIVING + 0.3
    current = motor / CONSTANT
    # The cable carries both coils, too: 16 and 48 Ohm, and the spark resistor of 100 Ohm.
    control = 1 / (1 / 16 + 1 / 48 + 1 / 100)
    behind = 24 - 0.02 * (current + (24 - 0.02 * current) / (control + 0.02))
    speed = (behind - 0.045 * current) / CONSTANT
    found = [at[name] for name in ("drum.flange_r.tau", "worm.flange_a.tau", "motor.ia", "motor.w")]
    assert found == pytest.approx([drum, motor, current, speed], rel=1e-4)
    assert at["load.v"] == pytest.approx(speed / 40 * 0.08, rel=1e-4)
    energy = run().energy(1.0, 3.9)
    wanted = 300 * G * (run().at(3.9)["load.s"] - run().at(1.0)["load.s"])
    assert energy["load"].stored == pytest.approx(wanted, rel=1e-6)
    assert energy["load"].stored / energy["battery"].source == pytest.approx(0.499, abs=5e-4)


def test_brake_by_hand() -> None:
    """The armature leaves its seat at the current whose force is the spring's, on an exponential with L/R."""
    lifting = sqrt(2 * 180 * 0.5e-3 / 0.4) * (1 + 0.4 / 0.5)
    control = 1 / (1 / 16 + 1 / 100)
    settled = 24 / (16 * (1 + 0.02 / control))
    at_gap = 0.4 / (1 + 0.4 / 0.5)
    opens = moment("brake.coil.stop", "leaving") - 0.1
    # The coil of the contactor takes its current from the same cable: some 1e-4 less voltage.
    assert opens == pytest.approx(at_gap / 16 * log(settled / (settled - lifting)), rel=1e-3)
    pulls_in = moment("contactor.contacts", "closed") - 0.1
    assert pulls_in == pytest.approx(1.2 / 48 * log(0.5 / 0.1), rel=1e-2)
    held = run().final
    assert held["motor.w"] == pytest.approx(0, abs=1e-9)
    drum = 0.08 * (held["rope.tension"] + G * 0.35 * (8 - held["drum.s"]))
    leak = CONSTANT * held["motor.ia"]  # what flows through the open contacts
    assert held["brake.brake.tau"] == pytest.approx(leak - drum / 40, rel=1e-6)
    # The brake alone holds at rest; with it open the load would run down, because the worm does not lock.
    assert DRIVEN > 0
    assert held["worm.self_locking"] == 0


def test_stop_by_hand() -> None:
    """The brake and at most what lifting takes, against the inertia at the motor: the rope lets the load go on."""
    closed, still = moment("brake.brake.mode", "forward", 4.0), moment("brake.brake.mode", "stuck", 4.0)
    inertia = 0.008 + (0.15 + 0.35 * 20 * 0.08**2) / 40**2
    rate = run().at(closed)["motor.w"] / (still - closed)
    assert 25 / inertia < rate < (25 + run().at(4.0)["worm.flange_a.tau"]) / inertia
    assert still - 4.1 < 0.03


def test_energy_closes() -> None:
    assert run().energy().power_closure < 1e-10


@pytest.mark.slow
def test_cut_below_the_rope(tmp_path: Path) -> None:
    parts = split(WINCH, "rope", tmp_path, names=("winch", "hook"))
    cut = cosim(parts.path, until=0.5, step=5e-4, master="gauss-seidel")
    whole = run().at(0.5)
    assert [cut.final[name] for name in ("load.s", "load.v", "rope.tension")] == pytest.approx(
        [whole[name] for name in ("load.s", "load.v", "rope.tension")], rel=1e-4
    )


@pytest.mark.slow
def test_gradient_is_the_slope_of_runs() -> None:
    found = sensitivities(WINCH, of=["load.s", "max(rope.tension)"], to=["mass", "drum.radius"])
    for name, value, step in (("mass", 300.0, 0.3), ("drum.radius", 0.08, 8e-5)):
        ends = []
        for way in (1, -1):
            drive = load(WINCH)
            drive.set(name, value + way * step)
            ends.append(simulate(drive, rtol=1e-10).final["load.s"])
        assert found["load.s", name] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-4)
