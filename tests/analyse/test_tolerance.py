"""What tolerances do, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from modelica_like import build, importance, tolerance
from modelica_like.netlist import load as load_netlist
from modelica_like.netlist import loads, save

DIRECT = Path(__file__).parents[2] / "examples" / "machine_table_direct.toml"
W, LOAD = 200.0 * math.pi, 15.0
J = 0.004 + 0.016 + 500.0 * (0.015 / (2.0 * math.pi)) ** 2
M = J * W / 0.2 + LOAD
"""Document 000: the clutch of M locks after J W / (M - LOAD) = 0.2 s."""
# The speed after 1 s is the sum of both torques.
TWO = """
[parts]
first = { is = "ConstantTorque", tau_constant = "10 N.m" }
second = { is = "ConstantTorque", tau_constant = "5 N.m" }
wheel = { is = "Inertia", J = "1 kg.m2", phi = 0, w = 0 }
[connect]
a = ["first.flange", "wheel.flange_a"]
b = ["second.flange", "wheel.flange_b"]
[simulate]
until = "1 s"
"""
BOTH = {"first.tau_constant": "normal(1 N.m)", "second.tau_constant": "normal(20 %)"}


def test_a_clutch_with_a_tolerance() -> None:
    """M is anywhere within 10 %: mean, probability and corners of J W / (M - LOAD)."""
    result = tolerance(
        DIRECT,
        "clutch.lock_time",
        {"clutch.capacity": "±10 %"},
        subject_to="clutch.lock_time <= 0.22 s",
        precision=0.005,
    )
    low, high = 0.9 * M, 1.1 * M
    spread = result["clutch.lock_time"]
    assert spread.mean == pytest.approx(J * W / (high - low) * math.log((high - LOAD) / (low - LOAD)), rel=1e-4)
    assert (spread.low, spread.high) == pytest.approx((J * W / (high - LOAD), J * W / (low - LOAD)), rel=1e-6)
    assert spread.quantiles[2] == pytest.approx(0.2, rel=1e-3)
    assert spread.linear_sigma == pytest.approx(J * W / (M - LOAD) ** 2 * 0.2 * M / math.sqrt(12.0), rel=1e-6)
    (limit,) = result.limits
    exact = (J * W / 0.22 + LOAD - low) / (high - low)
    assert limit.value == pytest.approx(exact, abs=0.005)
    assert limit.low <= exact <= limit.high


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_a_sum_of_two(rho: float) -> None:
    correlated = [{"of": list(BOTH), "rho": rho}] if rho else []
    result = tolerance(loads(TWO), ["wheel.w"], BOTH, correlated=correlated)
    spread = result["wheel.w"]
    sigma = math.sqrt(1.0 + 1.0 + 2.0 * rho)
    assert (spread.nominal, spread.linear_sigma) == pytest.approx((15.0, sigma), rel=1e-6)
    assert (spread.mean, spread.sigma) == pytest.approx((15.0, sigma), rel=0.02)
    np.testing.assert_allclose(spread.shares, [0.5, 0.5], rtol=1e-6)
    assert spread.quantiles[3] == pytest.approx(15.0 + 1.6449 * sigma, rel=0.01)
    assert result.notes == ()


def test_tolerances_that_are_given_do_without_the_correlations_that_are_written() -> None:
    text = TWO + '[tolerances]\n"first.tau_constant" = "normal(1 N.m)"\n"second.tau_constant" = "normal(20 %)"\n'
    text += 'correlated = [{ of = ["first.tau_constant", "second.tau_constant"], rho = 0.6 }]\n'
    written = tolerance(loads(text), "wheel.w")["wheel.w"]
    given = tolerance(loads(text), "wheel.w", {"first.tau_constant": "normal(1 N.m)"})["wheel.w"]
    assert (written.linear_sigma, given.linear_sigma) == pytest.approx((math.sqrt(3.2), 1.0), rel=1e-6)


def test_shares_of_the_variance_of_a_sum() -> None:
    given = {"first.tau_constant": "normal(2 N.m)", "second.tau_constant": "uniform(3 N.m, 7 N.m)"}
    result = tolerance(loads(TWO), "wheel.w", given, shares=True)
    exact = np.array([4.0, 16.0 / 12.0]) / (4.0 + 16.0 / 12.0)
    np.testing.assert_allclose(result["wheel.w"].shares, exact, rtol=1e-6)
    np.testing.assert_allclose(result.variances["S1"][0], exact, atol=0.05)
    np.testing.assert_allclose(result.variances["ST"][0], exact, atol=0.05)


def test_measured_values(tmp_path: Path) -> None:
    """Half of the torques are 9, half are 12 N.m: nearly all runs lie in between, and none outside."""
    (tmp_path / "torques.csv").write_text("torque,N.cm\n900\n1200\n")
    (tmp_path / "two.toml").write_text(TWO + '[tolerances]\n"first.tau_constant" = "torques.csv"\n')
    result = tolerance(tmp_path / "two.toml", "wheel.w")
    spread = result["wheel.w"]
    assert (result.samples.min(), result.samples.max()) == pytest.approx((14.0, 17.0), abs=0.01)
    assert spread.nominal == pytest.approx(15.5)
    save(load_netlist(tmp_path / "two.toml"), tmp_path / "again.toml")
    assert tolerance(tmp_path / "again.toml", "wheel.w")["wheel.w"].mean == spread.mean


def test_runs_without_an_event_break_its_limit() -> None:
    """Within 0.205 s, the clutch does not lock where J W / (M - LOAD) is longer."""
    result = tolerance(
        DIRECT, (), {"clutch.capacity": "±10 %"}, subject_to="clutch.lock_time <= 0.204 s", until="0.205 s"
    )
    exact = (J * W / 0.204 + LOAD - 0.9 * M) / (0.2 * M)
    assert result.limits[0].value == pytest.approx(exact, abs=0.01)
    assert any("clutch.lock_time has no value in" in note for note in result.notes)


def test_a_limit_that_no_run_breaks() -> None:
    """Of n runs without one, the probability is at most 1 - 0.025^(1/n)."""
    result = tolerance(loads(TWO), (), BOTH, subject_to="wheel.w <= 100 rad/s")
    (limit,) = result.limits
    assert limit.value == limit.low == 0.0
    assert limit.high == pytest.approx(1.0 - 0.025 ** (1.0 / result.runs), rel=1e-6)


def test_another_sequence_of_modes_is_told() -> None:
    """A weak clutch slips until the end of the run."""
    result = tolerance(DIRECT, "table.s", {"clutch.capacity": "uniform(20 N.m, 140 N.m)"})
    assert any("has another sequence of modes." in note for note in result.notes)
    (other,) = result.sequences
    exact = (J * W / 0.4 + LOAD - 20.0) / 120.0
    assert other.what == "as mode change 1, 'clutch.mode: backward → stuck' is missing"
    assert other.low < exact < other.high
    assert other.share == pytest.approx(exact, abs=0.01)
    assert result.notes[-1].startswith("The mode sequence is another one than at the means in 25.8 % of runs: as mode")


def test_importance_without_some_runs() -> None:
    """The time until it locks is left out where the run ends before."""
    ranges = {"clutch.capacity": (0.94 * M, 1.1 * M), "load_torque": (14.0, 16.0)}
    model = build(DIRECT, free=["clutch.capacity"])
    found = importance(model, ranges, ["clutch.lock_time"], samples=128, until=0.21)
    assert "runs were left out" in found.notice
    assert found["ST", "clutch.lock_time", "clutch.capacity"] > 0.8
