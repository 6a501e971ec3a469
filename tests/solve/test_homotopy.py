"""Starts that Newton's method misses from the guesses, led there from a simplified law: closed forms."""

from math import cbrt, sqrt
from pathlib import Path
from typing import Any

import pytest
from fmpy import simulate_fmu

from modelica_like import build, export_fmu, load, simulate
from modelica_like.errors import InitializationError
from modelica_like.language import Component, Equations, Parameter, Variable, der, guess, homotopy, param, var
from modelica_like.native.start import initialize

ROOT = -(cbrt(1 + sqrt(19 / 27)) + cbrt(1 - sqrt(19 / 27)))
"""The real root of x^3 - 2x + 2 (Cardano), from which Newton's method keeps away between 0 and 1 for ever."""


class Cubic(Component):
    """0 = x^3 - 2x + 2 with a rate that shows x; `led` from x + 2."""

    T: Parameter = param("s", "time", default=1.0)
    x: Variable = var("1", "root")
    y: Variable = var("1", "integral", default=0.0)
    led = True

    def law(self) -> Any:
        actual = self.x**3 - 2 * self.x + 2
        return homotopy(actual, self.x + 2) if self.led else actual

    def equations(self) -> Equations:
        yield self.law() == 0
        yield self.T * der(self.y) == self.x


class Straight(Cubic):
    led = False


class Square(Cubic):
    """x^2 = 4: the guess leads to -2, the simplified law x = 3 to +2."""

    def law(self) -> Any:
        actual = self.x**2 - 4
        return homotopy(actual, self.x - 3) if self.led else actual


class StraightSquare(Square):
    led = False


class State(Component):
    """A state y by the start value of x = y^3 - 2y + 2; steady where x = 0."""

    T: Parameter = param("s", "time", default=1.0)
    x: Variable = var("1", "what is given")
    y: Variable = var("1", "state")

    def equations(self) -> Equations:
        yield self.x == homotopy(self.y**3 - 2 * self.y + 2, self.y + 2)
        yield self.T * der(self.y) == -self.x


@pytest.mark.parametrize("solver", ["native", "idas"])
def test_the_start_is_led_to_the_actual_law(solver: Any) -> None:
    run = simulate(Cubic(y=0.0), 1.0, solver=solver)
    assert run["x"][[0, -1]] == pytest.approx([ROOT, ROOT], rel=1e-12)
    assert run.final["y"] == pytest.approx(ROOT, rel=1e-7)
    with pytest.raises(InitializationError, match="were not solved"):
        simulate(Straight(y=0.0), 1.0, solver=solver)


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_an_fmu_begins_at_the_solution(tmp_path: Path, kind: Any) -> None:
    export_fmu(Cubic(y=0.0), tmp_path / "cubic.fmu")
    table = simulate_fmu(str(tmp_path / "cubic.fmu"), stop_time=1.0, fmi_type=kind, output=["x", "y"])
    assert table["x"][[0, -1]] == pytest.approx([ROOT, ROOT], rel=1e-10)
    assert table["y"][-1] == pytest.approx(ROOT, rel=1e-5)


def test_of_two_roots_the_simplified_law_chooses() -> None:
    for kind, root in ((Square, 2.0), (StraightSquare, -2.0)):
        assert simulate(kind(y=0.0, x=guess(-1.0)), 1.0)["x"][0] == pytest.approx(root, rel=1e-12)


def test_start_values_are_met_by_the_actual_law() -> None:
    run = simulate(State(x=0.0), 1.0)
    assert (run["y"][0], run.final["y"]) == pytest.approx((ROOT, ROOT), rel=1e-9)


def test_a_steady_start_is_led() -> None:
    assert initialize(build(State()), start="steady").x == pytest.approx([ROOT], rel=1e-9)


@pytest.mark.parametrize(
    "call", ["actual = x^3 - 2*x + 2, simplified = x + 2", "x^3 - 2*x + 2, x + 2", "simplified = x + 2, actual = {}"]
)
def test_in_modelica_text(tmp_path: Path, call: str) -> None:
    path = tmp_path / "Root.mo"
    path.write_text(
        "model Root\n  Real x;\n  Real y(start = 0, fixed = true);\n  parameter Real a = homotopy(3, 4);\nequation\n"
        f"  0 = homotopy({call.format('x^3 - 2*x + 2')});\n  der(y) = a*x;\nend Root;\n"
    )
    run = simulate(load(path), 1.0)
    assert run["x"][0] == pytest.approx(ROOT, rel=1e-12)
    assert run.final["y"] == pytest.approx(3 * ROOT, rel=1e-7)
