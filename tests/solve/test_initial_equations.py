"""Equations that hold at the start only, and parameters that they determine: closed forms, derivatives, FMUs."""

from typing import cast

import numpy as np
import pytest

from modelica_like import Assembly, build, export_fmu, sensitivities, simulate
from modelica_like.errors import ContradictingStart, MissingStart
from modelica_like.fmi.run import run_fmu
from modelica_like.language import Component, Equations, Parameter, Variable, der, param, var
from modelica_like.simulation import Solver

both = pytest.mark.parametrize("solver", ["idas", "native"])


class Hanging(Component):
    """A mass on a preloaded spring."""

    x: Variable = var("m", "way down")
    v: Variable = var("m/s", "speed")
    F: Variable = var("N", "force of the spring")
    m: Parameter = param("kg", "mass", default=2.0)
    c: Parameter = param("N/m", "stiffness", default=100.0)
    g: Parameter = param("m/s2", "gravity", default=9.81)
    F0: Parameter = param("N", "wanted force at the start", default=5.0)
    P: Variable = param("N", "preload", fixed=False)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield self.c * self.x + self.P == self.F
        yield self.m * der(self.v) == self.m * self.g - self.F


class Wanted(Hanging):
    def initial_equations(self) -> Equations:
        yield self.F == self.F0


class Balanced(Hanging):
    def initial_equations(self) -> Equations:
        yield der(self.x) == 0
        yield der(self.v) == 0


class Nonlinear(Component):
    """A rate and a product are given at the start."""

    x: Variable = var("1", "one", guess=1.0)
    y: Variable = var("1", "two")
    T: Parameter = param("s", "time", default=1.0)
    a: Parameter = param("1", "rate of the first one at the start, downwards", default=3.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.y - self.x**3
        yield self.T * der(self.y) == -self.y

    def initial_equations(self) -> Equations:
        yield self.T * der(self.x) == -self.a
        yield self.x * self.y == 2


@both
def test_a_preload_follows_from_a_wanted_force(solver: Solver):
    found = simulate(Wanted(x=0.1, v=0.0), 1.0, solver=solver, rtol=1e-10, atol=1e-12)
    assert found["P"] == pytest.approx(np.full(len(found.time), -5.0), abs=1e-12)
    around = 0.1 + (2 * 9.81 - 5) / 100  # it swings around its equilibrium
    assert found.final["x"] == pytest.approx(around - (around - 0.1) * np.cos(np.sqrt(50)), abs=1e-8)


@both
def test_equilibrium_of_one_part(solver: Solver):
    drive = Assembly("two", parts={"still": Balanced(x=0.05), "moves": Wanted(x=0.1, v=0.0)})
    found = simulate(drive, 1.0, solver=solver)
    assert found["still.x"] == pytest.approx(np.full(len(found.time), 0.05), abs=1e-9)
    assert found.final["still.P"] == pytest.approx(2 * 9.81 - 5, abs=1e-9)


@both
def test_nonlinear_initial_equations(solver: Solver):
    found = simulate(Nonlinear(), 1.0, solver=solver)
    x, y = found["x"][0], found["y"][0]
    assert (x, y) == pytest.approx(((1 + np.sqrt(5)) / 2, np.sqrt(5) - 1), abs=1e-12)  # y = x^3 - 3 and xy = 2


def test_their_derivatives():
    model = build(Nonlinear())
    x = cast(float, (1 + np.sqrt(5)) / 2)
    found = sensitivities(model, ["at(x, 0)"], ["a"], until=1.0)
    assert found["at(x, 0)", "a"] == pytest.approx(1 / (3 * x**2 + 2 / x**2), rel=1e-9)


def test_an_fmu_solves_them(tmp_path):
    drive = Assembly("hanging", parts={"mass": Wanted(x=0.1, v=0.0)})
    drive.simulate.update(until=1.0)
    run = run_fmu(export_fmu(drive, tmp_path / "hanging.fmu", "3.0", check=False).path, tolerance=1e-9)
    assert run.final["mass.P"] == pytest.approx(-5.0, abs=1e-9)
    assert not [name for name in run.names if "initial[" in name]


def test_too_many_and_too_few_are_told():
    told = (
        r"^x = 1 and P = 2 and the initial equation `self\.F == self\.F0` contradict each other: left minus right of "
    )
    with pytest.raises(ContradictingStart, match=rf"{told}the last one would be 97\."):
        simulate(Wanted(x=1.0, P=2.0, v=0.0), 1.0)
    with pytest.raises(MissingStart, match=r"Initialization .* lacks one equation: give v a start value"):
        simulate(Wanted(x=0.1), 1.0)
