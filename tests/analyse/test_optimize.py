"""Best designs against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from modelica_like import build, load, optimize, simulation_function
from modelica_like.analyse.optimize.result import Front, Optimum
from modelica_like.netlist import loads

EXAMPLES = Path(__file__).parents[2] / "examples"
DIRECT = EXAMPLES / "machine_table_direct.toml"
W, LOAD = 200.0 * math.pi, 15.0
J = 0.004 + 0.016 + 500.0 * (0.015 / (2.0 * math.pi)) ** 2
"""Speed, load and inertia of document 000: the clutch locks after J W / (M - LOAD)."""
CAPACITY = {"clutch.capacity": ["40 N.m", "300 N.m"]}
# A mass of 1 kg is moved by 1 m in 2 s, from rest to rest.
MOVED = """
[parts]
profile = { is = "Table", table = [[0, 0], [2, 0]] }
drive = { is = "Force" }
mass = { is = "Mass", m = "1 kg", s = 0, v = 0 }
[series]
a = ["drive", "mass"]
[connect]
f = ["profile.y", "drive.f"]
[simulate]
until = "2 s"
"""
# The share of two signals that peak at different times.
SHARED = """
[parameters]
share = 0.2
[parts]
early = { is = "Table", table = [[0, 0], [0.2, 1], [0.4, 0], [1, 0]], scale = "share" }
late = { is = "Table", table = [[0, 0], [0.5, 0], [0.6, 2], [0.7, 0], [1, 0]], scale = "1 - share" }
drive = { is = "Torque" }
wheel = { is = "Inertia", J = 1, phi = 0, w = 0 }
[series]
a = ["drive", "wheel"]
[connect]
e = ["early.y", "drive.tau"]
[simulate]
until = "1 s"
"""


def optimum(*arguments: object, **more: object) -> Optimum:
    result = optimize(*arguments, **more)  # type: ignore[arg-type]
    assert isinstance(result, Optimum)
    return result


def capacity(time: float, load: float = LOAD) -> float:
    """Return the torque that locks the clutch of document 000 in a time."""
    return J * W / time + load


def test_the_least_clutch_that_locks_in_time() -> None:
    """M = J W / t + LOAD; a longer time t lowers it by J W / t²."""
    best = optimum(DIRECT, minimize="clutch.capacity", free=CAPACITY, subject_to="clutch.lock_time <= 0.25 s")
    assert best.feasible
    assert best.optimal
    assert best["clutch.capacity"] == pytest.approx(capacity(0.25), rel=1e-6)
    (limit,) = best.limits
    assert limit.value == pytest.approx(0.25, rel=1e-6)
    assert limit.price == pytest.approx(-J * W / 0.25**2, rel=1e-4)
    assert "with 1 s more, clutch.capacity changes by" in str(best)
    assert best.history[0, 0] == pytest.approx(capacity(0.2), rel=1e-6)


def test_the_worst_load_case_counts() -> None:
    cases = [{"name": "light", "load_torque": 5.0}, {"name": "heavy", "load_torque": "25 N.m"}]
    best = optimum(
        DIRECT, minimize="clutch.capacity", free=CAPACITY, subject_to="clutch.lock_time <= 0.25 s", cases=cases
    )
    assert best["clutch.capacity"] == pytest.approx(capacity(0.25, 25.0), rel=1e-6)
    assert [limit.price != 0.0 for limit in best.limits] == [False, True]
    assert best["clutch.lock_time"] == max(limit.value for limit in best.limits)


def test_a_limit_that_is_active_in_several_load_cases_has_one_price() -> None:
    """Two cases that are the same: who allows 1 s more does so in both, and the torque falls by J W/t²."""
    cases = [{"name": "first", "load_torque": LOAD}, {"name": "second", "load_torque": LOAD}]
    best = optimum(
        DIRECT, minimize="clutch.capacity", free=CAPACITY, subject_to="clutch.lock_time <= 0.25 s", cases=cases
    )
    assert sum(limit.price for limit in best.limits) == pytest.approx(-J * W / 0.25**2, rel=1e-4)
    price = f"{-J * W / 0.25**2:+.4g} N.m"
    assert f"in the load cases 'first', 'second': with 1 s more, clutch.capacity changes by {price}." in str(best)


def test_what_changes_nothing_stays_as_it_is() -> None:
    """The motor begins as fast as it does, whatever the clutch."""
    best = optimum(DIRECT, maximize="at(motor.w, 0 s)", free=CAPACITY)
    assert best["clutch.capacity"] == best.parameters[0].before
    assert "No design that was tried is better than the drive as it is." in str(best)


def test_a_bound_is_written_as_it_is(tmp_path: Path) -> None:
    best = optimum(loads(STOP), minimize="brake.lock_time", free={"brake.capacity": [5, 150]})
    best.save(tmp_path / "best.toml")
    assert 'capacity = "150 N.m"' in (tmp_path / "best.toml").read_text()


def test_the_worst_of_an_objective_is_its_value() -> None:
    """The heavy load locks later, J W / (M - 25)."""
    cases = [{"name": "heavy", "load_torque": 25.0}, {"name": "light", "load_torque": 5.0}]
    best = optimum(DIRECT, minimize="clutch.lock_time", free={"clutch.capacity": [60, 200]}, cases=cases)
    assert best["clutch.lock_time"] == pytest.approx(J * W / (200.0 - 25.0), rel=1e-6)


def test_the_largest_load() -> None:
    """With a clutch of 100 N.m, it is what J W / 0.3 s leaves."""
    drive = load(DIRECT)
    drive.set("clutch_torque", "100 N.m")
    best = optimum(drive, maximize="load_torque", free={"load_torque": [1, 80]}, subject_to="clutch.lock_time <= 0.3 s")
    assert best["load_torque"] == pytest.approx(100.0 - J * W / 0.3, rel=1e-6)


def test_the_least_energy_of_a_motion() -> None:
    """The force falls linearly, F = 3/2 (1 - t), and the integral of its square is 12/8."""
    free = {"profile.table": {"points": 5, "from": -5, "to": 5}}
    best = optimum(
        loads(MOVED),
        minimize="integral(profile.y*profile.y)",
        free=free,
        subject_to=["mass.s == 1 m", "mass.v == 0 m/s"],
    )
    assert best.objectives[0].value == pytest.approx(1.5, rel=1e-6)
    np.testing.assert_allclose(list(best.values.values()), [1.5, 0.75, 0.0, -0.75, -1.5], atol=1e-3)


def test_a_peak_that_jumps_from_one_time_to_another() -> None:
    """The peaks are `share` and 2 (1 - share): their largest is least where both are 2/3."""
    best = optimum(loads(SHARED), minimize="peak(early.y + late.y)", free={"share": [0.05, 0.95]})
    assert best["share"] == pytest.approx(2.0 / 3.0, abs=1e-5)


@pytest.mark.slow
def test_a_limit_has_no_price_where_there_are_no_derivatives() -> None:
    """The largest share that is allowed, beside the corner of both peaks."""
    best = optimum(
        loads(SHARED), minimize="peak(early.y + late.y)", free={"share": [0.05, 0.95]}, subject_to="share <= 0.9"
    )
    assert best["share"] == pytest.approx(2.0 / 3.0, abs=1e-5)
    assert best.limits[0].price == 0.0


def test_limits_that_cannot_be_met_are_exceeded_least() -> None:
    """The excesses of both limits are the same, each relative to the size of its output."""
    limits = ["clutch.lock_time <= 0.1 s", "clutch.capacity <= 100 N.m"]
    best = optimum(DIRECT, minimize="clutch.loss_energy", free=CAPACITY, subject_to=limits)
    assert not best.feasible
    assert [limit.broken for limit in best.limits] == [True, True]
    time, torque = (limit.value for limit in best.limits)
    first = J * W / (capacity(0.2) - LOAD)
    assert (time - 0.1) / first == pytest.approx((torque - 100.0) / 100.0, rel=1e-3)
    assert "cannot all be met" in str(best)


def test_a_front_of_two_objectives() -> None:
    """The friction work is M W t / 2 with M = J W / t + LOAD, so it grows with the time."""
    front = optimize(
        DIRECT, minimize=["clutch.lock_time", "clutch.capacity"], free={"clutch.capacity": [60, 200]}, points=6
    )
    assert isinstance(front, Front)
    time, torque = front.values.T
    np.testing.assert_allclose(torque, J * W / time + LOAD, rtol=1e-6)
    assert len(time) == 6
    assert np.all(np.diff(time) > 0)
    np.testing.assert_allclose(np.diff(torque), -28.0, rtol=1e-3)


@pytest.mark.slow  # a hundred runs with gradients: ten seconds
def test_a_front_ends_at_the_best_of_each_objective() -> None:
    """The less a clutch slips, the less it heats: its largest force at once is best, though a search may end before.

    No design is as good as another one in both objectives.
    """
    torque = "max(peak(shaft1.tau), peak(shaft2.tau))"
    front = optimize(
        EXAMPLES / "design/engagement_profile.toml", minimize=[torque, "clutch.loss_energy"],
        subject_to="clutch.lock_time <= 0.4 s", points=4,
    )  # fmt: skip
    assert isinstance(front, Front)
    assert [p.value for p in front.points[-1].parameters] == pytest.approx([1.2, 1.2, 1.2], rel=1e-5)
    assert np.all(np.diff(front.values, axis=0) * [1, -1] > 0)


def test_what_is_chosen_is_tried() -> None:
    drive = load(DIRECT)
    drive.set("clutch_torque", "100 N.m")
    best = optimum(
        drive, minimize="clutch.lock_time", free={"load_torque": ["15 N.m", "16 N.m"]},
        choose={"spindle_inertia": [0.016, 0.02, 0.008]},
    )  # fmt: skip
    assert best.chosen == {"spindle_inertia": 0.008}
    assert len(best.combinations) == 3


STOP = """
[parts]
wheel = { is = "Inertia", J = "2 kg.m2", phi = 0, w = "20 rad/s" }
brake = { is = "Brake", capacity = "20 N.m" }
[series]
drive = ["wheel", "brake"]
[simulate]
until = "50 s"
"""
CHOSEN = {"wheel.J": range(1, 26), "brake.capacity": range(1, 26)}
BRAKED = {"minimize": "brake.capacity", "subject_to": ["brake.loss_energy >= 500 J", "brake.lock_time <= 4.01 s"]}


def test_nothing_need_be_free_where_something_is_chosen() -> None:
    """500 J at 20 rad/s need 2.5 kg.m2, so 3, which stop within 4 s by 15 N.m."""
    best = optimum(loads(STOP), choose={"wheel.J": [2, 3, 4], "brake.capacity": [14, 15, 16]}, **BRAKED)
    assert best.chosen == {"wheel.J": 3, "brake.capacity": 15}
    assert best.feasible
    assert best["brake.lock_time"] == pytest.approx(4.0, rel=1e-6)
    assert len(best.combinations) == 9


def test_what_cannot_be_met_by_any_choice_is_told() -> None:
    best = optimum(loads(STOP), choose={"wheel.J": [1, 2], "brake.capacity": [14, 15]}, **BRAKED)
    assert not best.feasible
    assert "The limits cannot all be met" in str(best)


def test_of_many_combinations_some_are_tried() -> None:
    best = optimum(loads(STOP), choose={path: [*values] for path, values in CHOSEN.items()}, **BRAKED)
    assert best.chosen == {"wheel.J": 3, "brake.capacity": 15}
    assert best.runs < 625
    assert "Of 625 combinations Optuna tried" in str(best)


@pytest.mark.slow
def test_many_combinations_with_something_free() -> None:
    """M = J w/4 s is least for 3 kg.m2 at 19 rad/s, of all whole numbers with J w² of at least 1000 J."""
    choose = {"wheel.J": [*range(1, 26)], "wheel.w": [*range(1, 21)]}
    limits = ["brake.loss_energy >= 500 J", "brake.lock_time <= 4 s"]
    best = optimum(
        loads(STOP), minimize="brake.capacity", free={"brake.capacity": [1, 30]}, choose=choose, subject_to=limits
    )
    assert best.chosen == {"wheel.J": 3, "wheel.w": 19}
    assert best["brake.capacity"] == pytest.approx(3 * 19 / 4.0, rel=1e-6)


def test_rows_of_a_table_and_the_netlist_of_the_best(tmp_path: Path) -> None:
    (tmp_path / "hubs.csv").write_text("name,J\nlarge,0.01\nsmall,0.001\n")
    text = DIRECT.read_text().replace('sizing = "sizing/machine_table.toml"\n', "")
    section = """
[optimize]
minimize = "clutch.loss_energy"
free = { "clutch.capacity" = ["40 N.m", "300 N.m"] }
choose = { hub = "hubs.csv" }
subject_to = ["clutch.tau <= 15.1 N.m", "clutch.lock_time >= 0.1 s"]
"""
    path = tmp_path / "table.toml"
    path.write_text(text + section)
    best = optimum(path)
    assert best.chosen == {"hub": "small"}
    inertia = J - 0.004 + 0.001
    assert best["clutch.capacity"] == pytest.approx(inertia * W / 0.1 + LOAD, rel=1e-6)
    best.save(tmp_path / "best.toml")
    assert f'capacity = "{best["clutch.capacity"]:.10g} N.m"' in (tmp_path / "best.toml").read_text()
    again = build(load(tmp_path / "best.toml"))
    assert again.p[again.parameter_position["clutch.capacity"]] == pytest.approx(best["clutch.capacity"])
    assert again.p[again.parameter_position["hub.J"]] == pytest.approx(0.001)


def test_what_happens_at_the_end_of_a_run_is_a_limit() -> None:
    """The least clutch locks as the run ends, after 0.4 s: weaker ones do not in it."""
    best = optimum(DIRECT, minimize="clutch.capacity", free=CAPACITY, subject_to="clutch.lock_time >= 0.1 s")
    assert best["clutch.capacity"] == pytest.approx(capacity(0.4), rel=2e-5)
    assert best.optimal
    assert best.runs < 20
    assert "clutch.lock_time is at the end of the run: a longer run may have a better design." in str(best)


TABLE = f"""
[parts]
table = {{ is = "{DIRECT.as_posix()}" }}
[simulate]
until = "0.4 s"
[optimize]
minimize = "table.clutch.capacity"
free = {{ "table.clutch.capacity" = ["40 N.m", "300 N.m"] }}
subject_to = ["table.clutch.lock_time <= 0.25 s"]
"""


def test_the_design_of_document_000_from_its_netlist() -> None:
    best = optimum(loads(TABLE))
    assert best["table.clutch.capacity"] == pytest.approx(capacity(0.25), rel=1e-6)


@pytest.mark.parametrize("name", ["000", "engagement_profile", "gear_and_flywheel"])
def test_designs_of_the_documents_take_few_lines(name: str) -> None:
    """What a design takes beside the netlist of its drive; they were 107 and 70 lines of CasADi."""
    text = TABLE if name == "000" else (EXAMPLES / "design" / f"{name}.toml").read_text()
    whole = name == "engagement_profile"  # its drive stands in the same file
    text = text[text.index("[optimize]") :] if whole else text
    assert len([line for line in text.splitlines() if line.strip() and not line.startswith("#")]) <= 15


@pytest.mark.slow
def test_engagement_profile() -> None:
    best = optimum(EXAMPLES / "design" / "engagement_profile.toml")
    peak, *_ = best.objectives
    work, time = best.limits
    assert work.value <= 600.0 * (1 + 1e-6)
    assert time.value <= 0.4 * (1 + 1e-6)
    assert peak.value < 0.6 * peak.before
    # A force that never falls is best constant: its peak is the friction torque at standstill, with which it locks.
    assert np.ptp([*best.values.values()]) < 1e-4


def test_gear_and_flywheel() -> None:
    best = optimum(EXAMPLES / "design" / "gear_and_flywheel.toml")
    # Energy at the largest speed of the clutch: J w²/2 with the pulley of 3e-5 kg.m2.
    assert best["bench.disc"] == pytest.approx(2 * 20.0 / (50 * math.pi) ** 2 - 3e-5, rel=1e-5)
    assert best["bench.flywheel.w"] == pytest.approx(50 * math.pi, rel=1e-6)
    # No neighbour that keeps the limits needs less.
    inputs = ["bench.ratio", "bench.disc"]
    outputs = [best.objectives[0].name, *(limit.name for limit in best.limits)]
    function = simulation_function(EXAMPLES / "design" / "gear_and_flywheel.toml", inputs, outputs, any_sequence=True)
    for ratio, disc in ((0.97, 1.0), (1.03, 1.0), (1.0, 0.97), (1.0, 1.03), (1.03, 1.05)):
        x = [ratio * best["bench.ratio"], disc * best["bench.disc"]]
        supply, stored, lock_time, speed = np.array(function(x)).ravel()
        assert supply > best.objectives[0].value or stored < 20.0 or lock_time > 0.8 or speed > 50 * math.pi


def test_a_limit_that_must_hold_with_a_probability() -> None:
    """The torque is anywhere within 10 % of M: 1 % of all undercut what locks in time if that is (0.9 + 0.002) M."""
    limit = "P(clutch.lock_time <= 0.25 s) >= 99 %"
    best = optimum(
        DIRECT, minimize="clutch.capacity", free=CAPACITY, subject_to=limit, tolerances={"clutch.capacity": "±10 %"}
    )
    assert best["clutch.capacity"] == pytest.approx(capacity(0.25) / 0.902, rel=1e-3)
    assert "is broken in" in str(best)


def test_measured_tolerances_stand_beside_the_netlist(tmp_path: Path) -> None:
    """The load is anywhere between two values, straight between them: 95 % of all are below 10 + 0.95 * 10."""
    (tmp_path / "loads.csv").write_text("load,N.m\n10\n20\n")
    text = DIRECT.read_text().replace('sizing = "sizing/machine_table.toml"\n', "")
    (tmp_path / "table.toml").write_text(text + '[tolerances]\nload_torque = "loads.csv"\n')
    limit = "P(clutch.lock_time <= 0.25 s) >= 95 %"
    best = optimum(tmp_path / "table.toml", minimize="clutch.capacity", free=CAPACITY, subject_to=limit)
    assert best["clutch.capacity"] == pytest.approx(capacity(0.25, 19.5), rel=2e-3)


@pytest.mark.slow
def test_a_probability_of_a_normal_distribution() -> None:
    """The load scatters by 1 N.m: the torque is larger by 3.0902 of these."""
    limit = "P(clutch.lock_time <= 0.25 s) >= 99.9 %"
    best = optimum(
        DIRECT, minimize="clutch.capacity", free=CAPACITY, subject_to=limit,
        tolerances={"load_torque": "normal(1 N.m)"},
    )  # fmt: skip
    assert best["clutch.capacity"] == pytest.approx(capacity(0.25) + 3.0902, rel=2e-3)


TWO_MASSES = """
[parts]
J1 = { is = "Inertia", J = "0.5 kg.m2", phi = 0, w = 0 }
shaft = { is = "SpringDamper", c = "2000 N.m/rad", d = 0 }
J2 = { is = "Inertia", J = "0.2 kg.m2", phi = 0, w = 0 }
[series]
a = ["J1", "shaft", "J2"]
"""


def test_the_softest_shaft_above_a_frequency() -> None:
    """f = √(c (1/J1 + 1/J2))/2π without damping."""
    limit, free = "mode(1).frequency >= 12 Hz", {"shaft.c": [100, 1e5]}
    best = optimum(loads(TWO_MASSES), minimize="shaft.c", free=free, subject_to=limit, until=0.1)
    assert best["shaft.c"] == pytest.approx((2 * math.pi * 12.0) ** 2 / (1 / 0.5 + 1 / 0.2), rel=1e-6)
    assert best.limits[0].price == pytest.approx(2.0 * best["shaft.c"] / 12.0, rel=1e-4)


def test_a_mode_alone_needs_no_run() -> None:
    """The stiffest shaft, and the lightest masses, vibrate fastest."""
    free = {"shaft.c": [100, 3000], "J2.J": [0.1, 0.3]}
    best = optimum(loads(TWO_MASSES), maximize="mode(1).frequency", free=free)
    assert best.values == pytest.approx({"shaft.c": 3000.0, "J2.J": 0.1}, rel=1e-9)
    assert best.objectives[0].value == pytest.approx(math.sqrt(3000.0 * (1 / 0.5 + 1 / 0.1)) / (2 * math.pi), rel=1e-9)


def test_an_interrupted_search_tells_the_best_design() -> None:
    def stop(designs: int, most: int) -> None:
        assert designs <= most
        if designs == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        optimize(DIRECT, minimize="clutch.lock_time", free=CAPACITY, progress=stop)
    assert caught.value.__notes__[-1].startswith("The best of 3 designs, within all limits: clutch.capacity = ")
