"""Losses that may be none: which currents are states depends on a parameter."""

from pathlib import Path

import numpy as np
import pytest

from modelica_like import build, load, simulate
from modelica_like.errors import SingularAtStart

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


STORES = """
model Stores "of C and of k*v^2, which C makes zero, too, behind 2 Ohm at sin(t)"
  parameter Real C = 0, R = 2, rate = C;
  Real v(start = 1), i, q, k;
equation
  k = rate*(1 + v^2);
  i = C*der(v);
  sin(time) - v = R*(i + q);
  q = k*der(v);
end Stores;
"""


def test_what_is_not_stored_is_no_state(tmp_path: Path) -> None:
    (tmp_path / "a.mo").write_text(STORES)
    result = simulate(load(tmp_path / "a.mo"), 1.0)
    assert result["v"] == pytest.approx(np.sin(result.time), abs=1e-9)
    assert result["k"] == pytest.approx(0.0, abs=1e-12)
    model = load(tmp_path / "a.mo")
    model.set("C", 0.5)
    stored = simulate(model, 1.0, rtol=1e-10, atol=1e-12)
    # der(v)*(1 + (1 + v^2))*C*R = sin(t) - v, by central differences
    t, v = stored.time, stored["v"]
    rate = np.gradient(v, t)[5:-5]
    assert rate * (2 + v[5:-5] ** 2) == pytest.approx((np.sin(t) - v)[5:-5], abs=2e-3)


def test_a_model_that_was_built_without_what_is_stored_refuses_it(tmp_path: Path) -> None:
    (tmp_path / "a.mo").write_text(STORES)
    built = build(load(tmp_path / "a.mo"))
    assert simulate(built.with_parameters({"R": 3.0}), 1.0).final["v"] == pytest.approx(np.sin(1.0))
    with pytest.raises(SingularAtStart, match="was built for other parameters"):
        simulate(built.with_parameters({"C": 0.5}), 1.0)
