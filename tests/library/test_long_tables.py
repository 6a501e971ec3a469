"""Tables over time of many rows: the row is looked up, and each costs the same however many there are."""

import pickle
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from modelica_like import build, export_fmu, run_fmu, sensitivities, simulate
from modelica_like.language import (
    Assembly,
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    discrete,
    element,
    param,
    var,
)
from modelica_like.netlist import loads

TIMES = np.linspace(0.0, 1.0, 1001)
VALUES = np.sin(40 * TIMES) + np.round(5 * TIMES)
NETLIST = """name = "pushed"
[parts]
{part}
push = {{ is = "Force" }}
mass = {{ is = "Mass", m = 2, s = 0, v = 0 }}
[connect]
end = ["push.flange", "mass.flange_a"]
"""


def velocity(until: float, begin: float = 0.0) -> float:
    """The integral of straight lines is that of the trapezoids: v = impulse / m."""
    times = np.unique(np.concatenate([[begin, until], TIMES[(begin < TIMES) & (until > TIMES)]]))
    return float(np.trapezoid(np.interp(times, TIMES, VALUES), times) / 2)


def pushed() -> Any:
    return loads(NETLIST.format(part=""))


def tabled(extrapolate: str) -> Any:
    rows = [[float(t), float(y)] for t, y in zip(TIMES, VALUES, strict=True)]
    part = f'cmd = {{ is = "Table", table = {rows}, extrapolate = "{extrapolate}" }}'
    return loads(NETLIST.format(part=part) + 'f = ["cmd.y", "push.f"]\n')


@pytest.mark.parametrize(("solver", "compiled"), [("idas", None), ("native", None), ("native", True)])
def test_a_mass_follows_a_measured_force(solver: Literal["idas", "native"], compiled: bool | None) -> None:
    given = {"push.f": np.c_[TIMES, VALUES]}
    run = simulate(pushed(), 1.5, inputs=given, solver=solver, compiled=compiled)
    assert run["mass.v"][-1] == pytest.approx(velocity(1.5), rel=1e-6)
    late = simulate(pushed(), 0.9, t0=0.30049, inputs=given, solver=solver, compiled=compiled)
    assert late["mass.v"][-1] == pytest.approx(velocity(0.9, 0.30049), rel=1e-6)


@pytest.mark.parametrize("extrapolate", ["hold", "linear"])
def test_a_table_goes_on_beyond_its_ends(extrapolate: str) -> None:
    run = simulate(tabled(extrapolate), 1.2, t0=-0.5)
    (a, b), (c, d) = VALUES[:2], VALUES[-2:]
    before, after = (0.0, 0.0) if extrapolate == "hold" else ((b - a) / TIMES[1], (d - c) / TIMES[1])
    impulse = 0.5 * (a - 0.25 * before) + 2 * velocity(1.0) + 0.2 * (d + 0.1 * after)
    assert run["mass.v"][-1] == pytest.approx(impulse / 2, rel=1e-6)


@pytest.mark.parametrize("kind", ["cs", "me"])
def test_fmus_have_the_list(tmp_path: Path, kind: Any) -> None:
    export_fmu(tabled("hold"), tmp_path / "pushed.fmu")
    run = run_fmu(tmp_path / "pushed.fmu", stop=1.0, kind=kind, outputs=["mass.v"])
    assert run["mass.v"][-1] == pytest.approx(velocity(1.0), rel=1e-5)


def test_a_stored_model_keeps_it() -> None:
    model = pickle.loads(pickle.dumps(build(tabled("hold"))))
    from modelica_like.language import elements

    elements._LISTS.clear()  # pyright: ignore[reportPrivateUsage] -- as in another process
    for solver in ("idas", "native"):
        assert simulate(model, 1.0, solver=solver)["mass.v"][-1] == pytest.approx(velocity(1.0), rel=1e-6)
    by_mass = sensitivities(model, "mass.v", "mass.m", until=1.0)
    assert by_mass["mass.v", "mass.m"] == pytest.approx(-velocity(1.0) / 2, rel=1e-6)


class Stairs(Component):
    """x follows steps whose heights are in a list."""

    x: Variable = var("1", "sum of the heights")
    second: Parameter = param("s", "time of a step", default=1.0)
    step: Discrete = discrete("1", "number of the step", start=-3.0)
    climb = Mode("on")

    def equations(self) -> Equations:
        yield self.second * der(self.x) == element([1.0, -2.0, 4.5], self.step)

    def events(self) -> Events:
        yield self.climb.go("on", "on", at=self.second * (self.step + 4.0), reset={self.step: self.step + 1})


class Moving(Component):
    """x follows steps at whole numbers of time."""

    x: Variable = var("1", "sum of the heights")
    second: Parameter = param("s", "time of a step", default=1.0)

    def equations(self) -> Equations:
        yield self.second * der(self.x) == element([1.0, -2.0, 4.5], self.time / self.second - 0.5)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_an_index_that_moves_makes_events(solver: Literal["idas", "native"]) -> None:
    run = simulate(Assembly(parts={"s": Moving(x=0.0)}), 4.0, solver=solver)  # steps at 1.5 and 2.5 s
    assert run["s.x"][-1] == pytest.approx(1.5 - 2.0 + 1.5 * 4.5, rel=1e-9)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_beyond_a_list_its_ends_count(solver: Literal["idas", "native"]) -> None:
    # Steps -3 to 5, one second each: four times the first, the second, four times the last.
    run = simulate(Assembly(parts={"s": Stairs(x=0.0)}), 9.0, solver=solver)
    assert run["s.x"][-1] == pytest.approx(4 * 1.0 - 2.0 + 4 * 4.5, rel=1e-9)
