"""Smooth functions of a state as narrow forces: what a mass has left behind them is the difference of two energies."""

import math
from collections.abc import Callable
from random import Random
from typing import Any

import casadi as ca
import numpy as np
import pytest

from modelica_like import build, export_fmu, run_fmu, sensitivities, simulate
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import NoGradient
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Parameter,
    Variable,
    cos,
    der,
    exp,
    param,
    sqrt,
    tanh,
    var,
)
from modelica_like.simulation import Solver

SEEDS = 6
"""Forces of each shape."""
SOLVERS = pytest.mark.parametrize("solver", ["idas", "native"])
_ROOT = math.sqrt(math.pi)


def gaussian(u: Expr) -> Expr:
    return exp(-(u**2)) / _ROOT


def expanded(u: Expr) -> Expr:
    return exp(-(u * u * 3 - 6 * u + 3) / 3) / _ROOT


def power_of_two(u: Expr) -> Expr:
    return 2 ** (-(u**2)) * math.sqrt(math.log(2)) / _ROOT


def rational(u: Expr) -> Expr:
    return 1 / (1 + u**2) / math.pi


def rational_square(u: Expr) -> Expr:
    return 2 / math.pi * (1 + u**2) ** -2


def rational_root(u: Expr) -> Expr:
    return 0.5 * (1 + u**2) ** -1.5


def flat_top(u: Expr) -> Expr:
    return exp(-(u**6)) / (2 * math.gamma(7 / 6))


def two_steps(u: Expr) -> Expr:
    return (tanh(5 * (u + 1)) - tanh(5 * (u - 1))) / 4


def two_rational_steps(u: Expr) -> Expr:
    left, right = u + 1, u - 1
    return (left / sqrt(0.04 + left**2) - right / sqrt(0.04 + right**2)) / 4


def tent(u: Expr) -> Expr:
    return (sqrt((u + 1) ** 2 + 1e-4) - 2 * sqrt(u**2 + 1e-4) + sqrt((u - 1) ** 2 + 1e-4)) / 2


def _atan(a: float, b: float) -> float:
    return (math.atan(b) - math.atan(a)) / math.pi


def _square(a: float, b: float) -> float:
    return sum(sign * (u / (1 + u * u) + math.atan(u)) for sign, u in ((-1, a), (1, b))) / math.pi


def _root(a: float, b: float) -> float:
    return 0.5 * (b / math.hypot(1, b) - a / math.hypot(1, a))


def _steps(a: float, b: float) -> float:
    def below(u: float) -> float:
        return math.hypot(0.2, u + 1) - math.hypot(0.2, u - 1)

    return (below(b) - below(a)) / 4


def _whole(_a: float, _b: float) -> float:
    return 1.0


Shape = Callable[[Any], Any]
SHAPES: tuple[tuple[Shape, Callable[[float, float], float]], ...] = (
    (gaussian, _whole), (expanded, _whole), (power_of_two, _whole), (flat_top, _whole), (two_steps, _whole),
    (rational, _atan), (rational_square, _square), (rational_root, _root), (two_rational_steps, _steps), (tent, _whole),
)  # fmt: skip
"""Forces whose work over all u is one, and their work from u = a to b."""


class Flight(Component):
    """A mass of 1 kg that meets a force over a part of its way."""

    units_checked = False
    x: Variable = var("m", "way", default=0.0)
    v: Variable = var("m/s", "speed")
    shape: int = 0
    a: Parameter = param("1", "place of the force")
    w: Parameter = param("1", "its width")
    energy: Parameter = param("J", "work of the force")

    def equations(self) -> Equations:
        force = SHAPES[self.shape][0]
        yield der(self.x) == self.v
        yield der(self.v) == -self.energy / self.w * force((self.x - self.a) / self.w)


def flight(seed: int, shape: int) -> tuple[Flight, float, float]:
    """Return a flight, its end in s and its speed in m/s; speeds over six decades, widths over five."""
    random = Random(100 * seed + shape)
    speed, w, a = 10 ** random.uniform(-3, 3), 10 ** random.uniform(-6, -1.5), random.uniform(0.3, 0.9)
    energy = random.uniform(-1.5, 0.9) * speed**2 / 2
    one = Flight(v=speed, shape=shape, a=a, w=w, energy=energy)
    return one, 3.0 / speed, speed


def work(one: Flight, x: float) -> float:
    """Work of the force in J up to a place."""
    model = build(one)
    a, w, energy = (float(model.p[model.parameter_position[name]]) for name in ("a", "w", "energy"))
    return energy * SHAPES[one.shape][1](-a / w, (x - a) / w)


@SOLVERS
@pytest.mark.parametrize("shape", range(len(SHAPES)), ids=[one.__name__ for one, _ in SHAPES])
def test_a_narrow_smooth_force_does_its_work(shape: int, solver: Solver) -> None:
    for seed in range(SEEDS):
        one, end, speed = flight(seed, shape)
        run = simulate(one, end, solver=solver, rtol=1e-8, points=20 + 50 * seed)
        final = math.sqrt(speed**2 - 2 * work(one, float(run.final["x"])))
        # The absolute tolerance is 1e-10 m/s per step.
        assert run.final["v"] == pytest.approx(final, rel=1e-5, abs=3e-8), (seed, shape, solver)


def test_an_fmu_meets_it_too(tmp_path: Any) -> None:
    one, end, speed = flight(3, 0)
    export_fmu(one, tmp_path / "flight.fmu", check=False)
    run = run_fmu(tmp_path / "flight.fmu", stop=end, kind="cs", tolerance=1e-8)
    final = math.sqrt(speed**2 - 2 * work(one, float(run.final["x"])))
    assert run.final["v"] == pytest.approx(final, rel=1e-5)


class Swing(Component):
    """What an exponential collects while a state turns at its top, or while an angle turns past it."""

    units_checked = False
    x: Variable = var("1", "a state", default=0.0)
    v: Variable = var("1", "its rate", default=1.0)
    y: Variable = var("1", "collected", default=0.0)
    k: Parameter = param("1", "steepness", default=1e4)
    kind: int = 0

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == (-self.x if self.kind == 0 else 0)
        yield (
            der(self.y)
            == (exp(self.k * (self.x - 1)), exp(self.k * (cos(self.x - 1) - 1)), cos(self.x - 1) ** 2000)[self.kind]
        )


@SOLVERS
@pytest.mark.parametrize("kind", [0, 1, 2])
def test_what_turns_past_a_narrow_top_is_seen(kind: int, solver: Solver) -> None:
    """Tops at pi/2 or 1, and on; each collects 2 pi e^-k I0(k), or pi binomial(2000, 1000)/2^2000."""
    k = 1e4
    bessel = 2 * math.pi * (1 + 1 / (8 * k) + 9 / (128 * k * k)) / math.sqrt(2 * math.pi * k)
    binomial = math.exp(math.lgamma(2001) - 2 * math.lgamma(1001) - 2000 * math.log(2))
    tops = {0: 3 * bessel, 1: 3 * bessel, 2: 5 * math.pi * binomial}[kind]
    run = simulate(Swing(kind=kind, k=k), 16.0, solver=solver, rtol=1e-9)
    # Where the state turns, its error counts k times.
    assert run.final["y"] == pytest.approx(tops, rel=1e-5 if kind else k * 1e-7)


class Pair(Component):
    """A narrow force of an implicit unknown: z follows x by an equation that cannot be solved symbolically."""

    units_checked = False
    x: Variable = var("m", "way", default=0.0)
    v: Variable = var("m/s", "speed", default=1.0)
    z: Variable = var("1", "z + z^5/10 = x")

    def equations(self) -> Equations:
        yield self.z + 0.1 * self.z**5 == self.x
        yield der(self.x) == self.v
        yield der(self.v) == -0.3e4 * exp(-(((self.z - 1) / 1e-4) ** 2)) / _ROOT


@SOLVERS
def test_a_narrow_force_of_an_implicit_unknown_does_its_work(solver: Solver) -> None:
    """dx = (1 + z^4/2) dz, which is 1.5 at z = 1 but for 3 (w/2)^2."""
    run = simulate(Pair(), 3.0, solver=solver, rtol=1e-9)
    assert run.final["v"] == pytest.approx(math.sqrt(1 - 2 * 0.3 * 1.5), rel=1e-5)


def squared_step(u: Expr) -> Expr:
    return 1 - tanh(u) ** 2


def whole_rational(u: Expr) -> Expr:
    return 1 / (1 + u**2)


def bell(u: Expr) -> Expr:
    return exp(-(u**2))


NARROW: dict[str, tuple[Shape, float, float]] = {
    "bell": (bell, _ROOT, math.sqrt(math.log(2))),
    "rational": (whole_rational, math.pi, 1.0),
    "squared step": (squared_step, 2.0, math.atanh(math.sqrt(0.5))),
}
"""Pulses, their integrals, and where they are one half."""


class Crossing(Component):
    """A state without inertia: where a pulse is, it becomes slower, or does not go on."""

    units_checked = False
    x: Variable = var("1", "way", default=0.0)
    shape: str = "bell"
    w: Parameter = param("1", "width of the pulse")
    slower: Parameter = param("1", "by how much it becomes slower", default=0.0)
    against: Parameter = param("1", "how much of its speed the pulse takes", default=0.0)

    def equations(self) -> Equations:
        pulse = NARROW[self.shape][0]((self.x - 0.5) / self.w)
        yield der(self.x) == (1 - self.against * pulse) / (1 + self.slower * pulse)


@SOLVERS
@pytest.mark.parametrize(("slower", "w"), [(10, 1e-4), (10, 1e-5), (100, 1e-4), (100, 1e-5), (100, 1e-6)])
@pytest.mark.parametrize("shape", NARROW)
def test_what_becomes_slow_in_a_narrow_pulse_loses_time(shape: str, slower: float, w: float, solver: Solver) -> None:
    """Time over way is one and `slower` pulses; a path that is as quick as before is there for a part of that."""
    run = simulate(Crossing(shape=shape, slower=slower, w=w), 2.0, solver=solver)
    # While it is slow, an error of the state counts `slower` times: of a few tolerances, which are 1e-7.
    assert run.final["x"] == pytest.approx(2.0 - slower * w * NARROW[shape][1], abs=slower * 3e-7)


@SOLVERS
@pytest.mark.parametrize("w", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("shape", NARROW)
def test_what_a_narrow_pulse_holds_does_not_pass_it(shape: str, w: float, solver: Solver) -> None:
    run = simulate(Crossing(shape=shape, against=2, w=w), 2.0, solver=solver)
    assert run.final["x"] == pytest.approx(0.5 - w * NARROW[shape][2], abs=1e-8)


def test_an_edge_of_a_smooth_function_is_no_kink() -> None:
    """At rest on the top of a force there is one derivative; two steps about zero are no pulse."""

    class Friction(Component):
        units_checked = False
        v: Variable = var("m/s", "speed", default=0.0)

        def equations(self) -> Equations:
            yield der(self.v) == -tanh(self.v / 1e-3) - 0.1 * tanh(self.v / 1e-2)

    assert build(Friction()).edges.count == 0
    edges = build(flight(0, 0)[0]).edges
    assert (edges.count, edges.slopes, edges.kinks) == (2, 2, 0)


@pytest.mark.parametrize("method", ["forward", "adjoint"])
def test_derivatives_of_what_a_narrow_force_leaves(method: Any) -> None:
    """v = sqrt(1 - 2 E) does not depend on the place; x = a + v (t - a) behind it, where t = 4."""
    one = Flight(v=1.0, shape=0, a=1.0, w=1e-4, energy=0.375)
    found = sensitivities(one, ["v", "x"], ["energy", "a"], until=4.0, method=method)
    assert found.derivatives == pytest.approx(np.array([[-2, 0], [-6, 0.5]]), rel=1e-4, abs=1e-5)


def test_derivatives_of_another_run_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A repetition that goes over the force ends elsewhere."""
    monkeypatch.setattr("modelica_like.analyse.replay.kinks._switches", no_switches)
    with pytest.raises(NoGradient, match=r"ends with x = 2\.50002, its repetition for the derivatives with 4\."):
        sensitivities(Flight(v=1.0, shape=0, a=1.0, w=1e-4, energy=0.375), "v", "energy", until=4.0, method="forward")


def no_switches(model: CompiledDae) -> ca.Function:
    return ca.Function("kinks", [*model.arguments.values()], [ca.SX(0, 1)])
