"""Losses that may be none: which currents are states depends on a parameter."""

from pathlib import Path

import numpy as np
import pytest

from modelica_like import load, simulate

COILS = """
model Coils "of 1 H and 2 H in series with 3 Ohm at 6 V; losses G between them and ground"
  parameter Real G = 0;
  Real i1(start = 0, fixed = true), i2, i, v, Gc;
equation
  if G <= 0 then
    Gc = 0;
    i = 0;
  else
    Gc = G;
    i = Gc*v;
  end if;
  i1 = i2 + i;
  der(i1) = 6 - v;
  2*der(i2) = v - 3*i2;
end Coils;
"""


@pytest.fixture
def coils(tmp_path: Path) -> Path:
    path = tmp_path / "coils.mo"
    path.write_text(COILS)
    return path


def test_coils_without_losses_are_one(coils: Path) -> None:
    run = simulate(load(coils), 3.0, rtol=1e-10)
    assert run["i1"] == pytest.approx(2 * (1 - np.exp(-run.time)), abs=1e-8)
    assert run["i2"] == pytest.approx(run["i1"], abs=1e-12)
    assert run["v"] == pytest.approx(3 * run["i1"] + 2 * 2 * np.exp(-run.time), abs=1e-7)


def test_coils_with_losses_have_two_currents(coils: Path) -> None:
    """With G = 0.5 S: di1/dt = 6 - 2·(i1 - i2), di2/dt = (i1 - i2) - 1.5·i2; i2 begins at 0, too."""
    model = load(coils)
    model.set("G", 0.5)
    model.give("i2", 0.0)
    run = simulate(model, 3.0, rtol=1e-10)
    matrix = np.array([[-2.0, 2.0], [1.0, -2.5]])
    steady = np.linalg.solve(matrix, [-6.0, 0.0])
    rates, modes = np.linalg.eig(matrix)
    parts = modes * np.linalg.solve(modes, -steady)
    for k in (0, 1):
        expected = steady[k] + np.exp(np.outer(run.time, rates)) @ parts[k]
        assert run[f"i{k + 1}"] == pytest.approx(expected, abs=1e-7)
