"""`terminal()` at the end of a run, against closed forms."""

from pathlib import Path

import pytest

from modelica_like import load, simulate
from modelica_like.simulation import Solver

TEXT = """model M
  Real x(start = 0, fixed = true);
  discrete Real last(start = -1, fixed = true), first;
  Integer n(start = 0, fixed = true);
  Boolean over;
equation
  der(x) = time;
  over = terminal();
  when terminal() then
    last = x;
    n = pre(n) + 1;
  end when;
  when initial() then
    first = 7 + x;
  end when;
  when x > 2 then
    terminate("far enough");
  end when;
end M;
"""


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("until", [1.0, 5.0])
def test_the_end_of_a_run_is_terminal(until: float, solver: Solver, tmp_path: Path) -> None:
    (tmp_path / "m.mo").write_text(TEXT)
    result = simulate(load(tmp_path / "m.mo"), until, solver=solver)
    end = min(until, 2.0)  # x = t^2/2 is 2 then
    assert result.time[-1] == pytest.approx(end, abs=1e-7)
    assert result.final["last"] == pytest.approx(end**2 / 2, abs=1e-7)
    assert (result.final["n"], result.final["over"], result.final["first"]) == (1, 1, 7)
    assert set(result["over"][result.time < end - 1e-6]) == {0}
