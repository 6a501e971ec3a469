"""What holds for every drive: energy, and what a run does not depend on.

`PROPERTIES=500 pytest tests/properties --hypothesis-profile=default` looks at more drives, and at other ones each time.
"""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, note, settings
from hypothesis import strategies as st
from trees import RIGID, Tree, assembly, trees

from modelica_like import Assembly, Solution, simulate
from modelica_like.fmi.export import export_fmu
from modelica_like.fmi.run import run_fmu
from modelica_like.netlist import dumps, loads

END = 1.0
RTOL = 1e-9
SAME = 2e-6
"""Largest difference of two runs, relative to the largest speed."""
EXAMPLES = int(os.environ.get("PROPERTIES", "25"))
every_drive = settings(deadline=None, max_examples=EXAMPLES)


def run(tree: Tree, **how: object) -> Solution:
    drive = assembly(tree, start="rest", until=END, **how)  # type: ignore[arg-type]
    note(dumps(drive))
    return simulate(drive, rtol=RTOL, atol=RTOL / 1000, points=40)


def speeds(solution: Solution, tree: Tree, rename: Callable[[str], str] = str) -> np.ndarray:
    """Speeds at the end."""
    return np.array([solution.final[f"{rename(f'J{k}')}.w"] for k in range(len(tree.J))])


def assert_same(found: np.ndarray, expected: np.ndarray, solution: Solution, tree: Tree) -> None:
    largest = max(float(np.max(np.abs(solution[f"J{k}.w"]))) for k in range(len(tree.J)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=SAME * largest + 1e-12)


@given(trees())
@every_drive
def test_energy_closes_at_all_times(tree: Tree) -> None:
    """By the product's own audit, and by hand: the work of constant torques less what masses and springs hold."""
    solution = run(tree)
    balance = solution.energy()
    # Errors of the integrator's steps may add up. Nothing else may be told.
    assert not [one for one in balance.notices if "drifts" not in one]
    assert balance.imbalance == 0.0, [(one.component, one.imbalance) for one in balance]
    assert balance.power_closure < 1e-9
    assert balance.drift < 1e-6
    held = sum(0.5 * J * solution[f"J{k}.w"] ** 2 for k, J in enumerate(tree.J))
    held = held + sum(_stored(solution, tree, number) for number in range(len(tree.joints)))
    before = 0.5 * np.dot(tree.J, tree.start() ** 2)  # of impacts at the start the results are those after it
    angles = {shaft: solution[f"J{shaft}.phi"] for shaft, _ in tree.torques}
    work = sum((tau * (angles[shaft] - angles[shaft][0]) for shaft, tau in tree.torques), np.zeros_like(held))
    lost = work - (held - before)
    size = max(float(np.max(np.abs(work))), float(np.max(held)), 1e-12)
    assert np.all(np.diff([0.0, *lost]) >= -1e-6 * size), "energy came from nowhere"
    assert lost[-1] == pytest.approx(balance.lost, abs=1e-6 * size)


def _stored(solution: Solution, tree: Tree, number: int) -> np.ndarray:
    """Energy of a spring, from its stiffness and the angle by which it is wound up."""
    one = tree.joints[number]
    if one.kind not in ("spring", "elastic", "backlash"):
        return np.zeros(len(solution.time))
    a, b = one.ends
    c = min(tree.J[a], tree.J[b]) * one.number**2
    angle = solution[f"{one.name}.phi_rel"]
    if one.kind == "backlash":
        angle = np.maximum(np.abs(angle) - 0.5 * one.more, 0.0)
    return 0.5 * c * angle**2


@pytest.mark.slow
@given(trees(), st.integers(1, 1000))
@every_drive
def test_order_and_names_count_nowhere(tree: Tree, seed: int) -> None:
    def other(name: str) -> str:
        return f"x{hash_of(name, seed)}_{name}"

    plain = run(tree)
    moved = run(tree, shuffle=seed, rename=other)
    assert_same(speeds(moved, tree, other), speeds(plain, tree), plain, tree)
    assert len(moved.events) == len(plain.events)


def hash_of(name: str, seed: int) -> int:
    """A number that puts names into another order; `hash` is another one in each process."""
    return sum(ord(letter) * (seed + k) for k, letter in enumerate(name)) % 97


@pytest.mark.slow
@given(trees())
@every_drive
def test_the_other_way_round(tree: Tree) -> None:
    """Flanges swapped, ratios inverted: the same. Torques, starts and freewheels turned: all signs turn."""
    plain = run(tree)
    assert_same(speeds(run(tree.swapped), tree), speeds(plain, tree), plain, tree)
    assert_same(speeds(run(tree.mirrored), tree), -speeds(plain, tree), plain, tree)


@pytest.mark.slow
@given(trees(), st.floats(0.05, 0.95))
@every_drive
def test_an_inertia_in_two_and_a_shaft_in_series(tree: Tree, part: float) -> None:
    plain = run(tree)
    assert_same(speeds(run(replace(tree, parts=part)), tree), speeds(plain, tree), plain, tree)
    assert_same(speeds(run(replace(tree, in_series=part)), tree), speeds(plain, tree), plain, tree)


@given(trees(kinds=("gear",), most=8))
@every_drive
def test_a_rigid_train_is_its_referred_inertia(tree: Tree) -> None:
    """w_k = (w_0 + t·Σ T_k/r_k / Σ J_k/r_k²)/r_k with r_k = w_0/w_k, the product of the ratios on the way."""
    ratios = {0: 1.0}
    for one in tree.joints:
        a, b = one.ends
        if a in ratios:
            ratios[b] = ratios[a] * one.number
        else:
            ratios[a] = ratios[b] / one.number
    r = np.array([ratios[k] for k in range(len(tree.J))])
    inertia = sum(J / r[k] ** 2 for k, J in enumerate(tree.J))
    torque = sum(tau / r[shaft] for shaft, tau in tree.torques)
    solution = run(tree)
    expected = (tree.w[0] + torque / inertia * END) / r
    np.testing.assert_allclose(speeds(solution, tree), expected, rtol=1e-9, atol=1e-9 * max(abs(tree.w[0] / r)))


@given(trees(kinds=RIGID, most=4))
@every_drive
def test_planetary_sets_and_gears_keep_their_momenta(tree: Tree) -> None:
    """Lagrange: with w = S·q, SᵀJS·dq = Sᵀτ·t; the columns of S are the free motions."""
    S = tree.motions()
    tau = np.zeros(len(tree.J))
    for shaft, torque in tree.torques:
        tau[shaft] += torque
    start = np.array([tree.w[k] for k in sorted(tree.free())])
    q = start + np.linalg.solve(S.T @ (np.array(tree.J)[:, None] * S), S.T @ tau) * END
    solution = run(tree)
    found, expected = speeds(solution, tree), S @ q
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * np.max(np.abs(expected)))


@pytest.mark.slow
@given(trees())
@every_drive
def test_what_is_written_is_the_same_drive(tree: Tree) -> None:
    drive = assembly(tree, start="rest", until=END)
    text = dumps(drive)
    again = loads(text)
    assert isinstance(again, Assembly)
    assert dumps(again) == text
    first, second = (simulate(one, rtol=RTOL, points=2) for one in (drive, again))
    assert np.array_equal(speeds(first, tree), speeds(second, tree))


@pytest.mark.slow
@given(trees(most=4))
@settings(deadline=None, max_examples=max(EXAMPLES // 5, 1))
def test_an_fmu_runs_as_the_drive(tmp_path_factory: pytest.TempPathFactory, tree: Tree) -> None:
    folder: Path = tmp_path_factory.mktemp("tree")
    plain = run(tree)
    drive = assembly(tree, start="rest", until=END)
    fmu = export_fmu(drive, folder / "tree.fmu", "3.0", check=False).path
    found = run_fmu(fmu, kind="cs", tolerance=1e-9, step=0.025)
    values = np.array([found.final[f"J{k}.w"] for k in range(len(tree.J))])
    assert_same(values, speeds(plain, tree), plain, tree)
