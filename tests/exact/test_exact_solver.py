"""The exact solver against closed forms, and against the principles it rests on."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from exact_drives import Drive, Element, ExactDrive, boxed, run_exactly
from random_drives import random_drive

F = Fraction


def constant(value: float) -> tuple[tuple[float, float], ...]:
    return ((0.0, value),)


def clutch(a: int, b: int, capacity: float, ratio: float = 1.0, name: str = "c") -> Element:
    return Element(name, "clutch", a, b, ratio, constant(capacity))


def brake(b: int, capacity: float, name: str = "b") -> Element:
    return Element(name, "brake", None, b, 1.0, constant(capacity))


def freewheel(a: int | None, b: int, ratio: float = 1.0, name: str = "f") -> Element:
    return Element(name, "freewheel", a, b, ratio)


def test_a_clutch_locks_at_the_common_speed():
    """J1 = 1, J2 = 3, 8 rad/s apart, 2 N·m: locked after 8/(2 + 2/3) = 3 s at 2 rad/s; lost ½·(3/4)·8²."""
    run = run_exactly(Drive((1, 3), (8, 0), (clutch(0, 1, 2),), (), 5))
    assert run.times == [0, 3, 5]
    assert run.speeds[-1] == [2, 2]
    assert (run.friction, run.impact, run.residual) == (24, 0, 0)


def test_parallel_clutches_act_as_one():
    one = run_exactly(Drive((1, 3), (8, 0), (clutch(0, 1, 2),), (), 5))
    two = run_exactly(Drive((1, 3), (8, 0), (clutch(0, 1, 0.5, name="c"), clutch(1, 0, 1.5, name="d")), (), 5))
    assert (one.times, one.speeds, one.friction) == (two.times, two.speeds, two.friction)


def test_a_clutch_breaks_away_where_its_torque_exceeds_the_capacity():
    """Locked, the clutch bears J2/(J1 + J2)·tau: 3 N·m of 4 N·m, limited to 2: then 2 and 2/3 rad/s²."""
    run = run_exactly(Drive((1, 3), (0, 0), (clutch(0, 1, 2),), ((0, ((0, 2), (1, 4))),), 3))
    assert run.times == [0, 1, 3]
    assert run.speeds[-1] == [F(1, 2) + 2 * 2, F(1, 2) + F(2, 3) * 2]
    assert run.residual == 0


def test_a_geared_brake_stops_the_drive():
    """w1 = 2·w2, 1 + 2/2² kg·m² at shaft 1; the brake of 1.5 N·m on shaft 2 brakes with 0.75 N·m."""
    gear = Element("g", "gear", 0, 1, 2.0)
    run = run_exactly(Drive((1, 2), (3, 99), (gear, brake(1, 1.5)), (), 10))
    assert run.times == [0, F(3, 1) / (F(3, 4) / F(3, 2)), 10]
    assert run.speeds[0] == [3, F(3, 2)]
    assert run.speeds[-1] == [0, 0]
    assert run.friction == F(27, 4)


def test_a_negative_ratio_in_a_loop_brings_both_to_rest():
    """Through a clutch w2 = w1, through another one w2 = -w1: rest is the only common motion."""
    run = run_exactly(Drive((1, 1), (4, 0), (clutch(0, 1, 1), clutch(0, 1, 2, ratio=-1, name="d")), (), 50))
    assert run.speeds[-1] == [0, 0]
    assert run.friction == 8


def test_a_lagging_freewheel_conserves_momentum():
    """5 and 0 rad/s, equal inertias: 2.5 rad/s after the impact, half of the energy is lost."""
    run = run_exactly(Drive((1, 1), (5, 0), (freewheel(0, 1),), (), 1))
    assert run.speeds == [[F(5, 2), F(5, 2)]] * 2
    assert run.impact == F(25, 4)
    geared = run_exactly(Drive((1, 1), (6, 1), (freewheel(0, 1, ratio=2),), (), 1))
    # Impulse p against 1, 2p with 2: 6 - p = 2·(1 + 2p).
    assert geared.speeds[0] == [F(26, 5), F(13, 5)]


def test_an_impact_goes_through_a_locked_freewheel_and_not_through_a_clutch():
    run = run_exactly(Drive((1, 1, 2), (8, 0, 0), (freewheel(0, 1), freewheel(1, 2, name="g")), (), 1))
    assert run.speeds[0] == [2, 2, 2]
    run = run_exactly(Drive((1, 1, 2), (8, 0, 0), (freewheel(0, 1), clutch(1, 2, 100)), (), F(1, 1000)))
    assert run.speeds[0] == [4, 4, 0]


def test_a_freewheel_overruns_and_locks_again():
    """Overrunning at 2 rad/s, driven with 1 N·m: meets after 2 s, then both together with 1/2 rad/s²."""
    run = run_exactly(Drive((1, 1), (0, 2), (freewheel(0, 1),), ((0, constant(1)),), 4))
    assert run.times == [0, 2, 4]
    assert run.speeds[-1] == [3, 3]
    assert (run.impact, run.friction, run.residual) == (0, 0, 0)


def test_a_backstop_holds_a_load():
    run = run_exactly(Drive((2,), (3,), (freewheel(None, 0),), ((0, constant(-1)),), 10))
    assert (run.times, run.speeds[-1]) == ([0, 6, 10], [0])


def enumerated(H, r, low, high):
    """All y = r - Hλ that fulfil the conditions, by trying every set of free elements that determines one."""
    found = set()
    for states in product((-1, 0, 1), repeat=len(r)):
        lam = [low[k] if s < 0 else high[k] if s > 0 else F(0) for k, s in enumerate(states)]
        free = [k for k, s in enumerate(states) if not s]
        if None in lam:
            continue
        part = np.array([[float(H[i][j]) for j in free] for i in free]).reshape(len(free), len(free))
        if free and np.linalg.matrix_rank(part) < len(free):
            continue
        y = [r[k] - sum(h * x for h, x in zip(H[k], lam, strict=True)) for k in range(len(r))]
        if free:
            right = np.linalg.solve(part, [float(y[k]) for k in free])
            for k, x in zip(free, right, strict=True):
                lam[k] = F(float(x))
        lam = [float(x) for x in lam]
        y = [float(r[k]) - sum(float(h) * x for h, x in zip(H[k], lam, strict=True)) for k in range(len(r))]
        inside = all((low[k] is None or lam[k] >= low[k] - 1e-9) and lam[k] <= high[k] + 1e-9 for k in free)
        right_way = all(s * y[k] >= -1e-9 for k, s in enumerate(states))
        if inside and right_way:
            found.add(tuple(round(x, 7) + 0.0 for x in y))
    return found


@pytest.mark.parametrize("seed", range(40))
def test_the_least_of_the_box_is_the_only_one(seed):
    """Small numbers, more elements than free speeds: redundant and degenerate."""
    r = np.random.default_rng(seed)
    n, m = int(r.integers(1, 4)), int(r.integers(1, 6))
    G = [[F(int(x)) for x in r.integers(-1, 3, n)] for _ in range(m)]
    mass = [F(int(x)) for x in r.integers(1, 4, n)]
    H = [[sum((a * b / j for a, b, j in zip(g, h, mass, strict=True)), F(0)) for h in G] for g in G]
    force = [F(int(x)) for x in r.integers(-3, 4, n)]
    right = [sum((a * b / j for a, b, j in zip(g, force, mass, strict=True)), F(0)) for g in G]
    wheels = r.integers(0, 2, m)
    high = [F(0) if wheel else F(int(r.integers(1, 4))) for wheel in wheels]
    low = [None if wheel else -bound for wheel, bound in zip(wheels, high, strict=True)]
    _, y = boxed(H, right, low, high)
    assert enumerated(H, right, low, high) == {tuple(round(float(x), 7) + 0.0 for x in y)}


@pytest.mark.parametrize("number", range(30))
def test_no_other_accelerations_are_better(number):
    """½aᵀMa - aᵀf + Σ capacity·|g·a| grows in every direction that the freewheels allow, at every start."""
    drive = random_drive(number)
    model = ExactDrive(drive)
    q = model.impact([F(drive.w[k]) for k in model.free])
    slips = model.slips(q)
    assert all(s >= 0 for e, s in zip(model.elements, slips, strict=True) if e.kind == "freewheel")
    a = model.accelerations(F(0), slips)
    M = np.array(model.M, float)
    G = np.array(model.G, float).reshape(-1, len(a))
    capacity = np.array([e.capacity[0][1] if e.capacity else 0.0 for e in model.elements])
    slip = np.array([float(s) for s in slips])
    wheel = np.array([e.kind == "freewheel" for e in model.elements], bool) & (slip == 0)
    force = np.array([float(x) for x in model.torque(F(0))]) - (capacity * np.sign(slip)) @ G
    capacity = np.where(slip == 0, capacity, 0.0)
    best = np.array([float(x) for x in a])

    def cost(a):
        return 0.5 * a @ M @ a - a @ force + capacity @ np.abs(G @ a)

    r = np.random.default_rng(number)
    size = np.sqrt(np.diag(np.linalg.inv(M)))
    scale = 1.0 + np.max(np.abs(best / size))
    for _ in range(200):
        other = best + size * scale * r.normal(size=len(best)) * 10.0 ** r.uniform(-3, 0)
        if np.all(G[wheel] @ other >= 0):
            assert cost(other) >= cost(best) - 1e-12 * (abs(cost(best)) + cost(other) - cost(best))


@pytest.mark.parametrize("number", range(60))
def test_energy_is_kept_without_rounding(number):
    run = run_exactly(random_drive(number))
    assert run.residual == 0
    assert run.friction >= 0
    assert run.impact >= 0


@pytest.mark.parametrize("number", range(20))
def test_two_starts_never_come_apart(number):
    """Friction, freewheels and impacts bring motions together, in the measure of the kinetic energy."""
    drive = random_drive(number)
    other = Drive(drive.J, tuple(w + 0.5 for w in drive.w), drive.elements, drive.torques, drive.until)
    model = ExactDrive(drive)
    apart = []
    for which in (0, -1):
        ends = [run_exactly(d).speeds[which] for d in (drive, other)]
        q = [a - b for k, (a, b) in enumerate(zip(*ends, strict=True)) if k in model.free]
        apart.append(model.energy(q))
    start = model.energy(
        [F(a) - F(b) for k, (a, b) in enumerate(zip(drive.w, other.w, strict=True)) if k in model.free]
    )
    assert start >= apart[0] >= apart[1]
