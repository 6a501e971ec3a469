"""Nothing is stepped over: narrow forces and pulses against energy and momentum, fast carriers against small steps."""

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from modelica_like import build, export_fmu, run_fmu, simulate
from modelica_like.compile.edges import find_edges
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Parameter,
    Variable,
    absolute,
    der,
    exp,
    if_,
    interpolate,
    maximum,
    mod,
    param,
    sin,
    var,
    where,
)
from modelica_like.netlist import loads
from modelica_like.simulation import Solver

BLOCKS = int(os.environ.get("NARROW_FORCES", "2"))
"""Blocks of 50 narrow forces, twice as many as of fast carriers."""
SOLVERS = pytest.mark.parametrize("solver", ["idas", "native"])
Force = Callable[[Expr, Expr, Expr, Any], Expr]
"""Force of where (or when) something is, the begin and the width of a window, and the force in it."""


def rectangle(x: Expr, a: Expr, w: Expr, force: Any) -> Expr:
    return where(x > a, where(x < a + w, force, 0.0), 0.0)


def triangle(x: Expr, a: Expr, w: Expr, force: Any) -> Expr:
    return 2 * force * maximum(0, 1 - absolute(x - a - w / 2) / (w / 2))


def table(x: Expr, a: Expr, w: Expr, force: Any) -> Expr:
    rows: Any = [a, a + w / 2, a + w]
    return interpolate(x, rows, [0.0, 2 * force, 0.0], extrapolate="hold")


def trapezium(x: Expr, a: Expr, w: Expr, force: Any) -> Expr:
    rows: Any = [a, a + w / 4, a + 3 * w / 4, a + w]
    return interpolate(x, rows, [0.0, 4 / 3 * force, 4 / 3 * force, 0.0], extrapolate="hold")


SHAPES: tuple[Force, ...] = (rectangle, triangle, table, trapezium)
"""Each with the mean `force` in its window."""


class Flight(Component):
    """A mass of 1 kg that meets a force over a part of its way, or of time."""

    units_checked = False
    x: Variable = var("m", "way", default=0.0)
    v: Variable = var("m/s", "speed")
    shape: int = 0
    over_time: bool = False
    a: Parameter = param("1", "begin of the window")
    w: Parameter = param("1", "its width")
    force: Parameter = param("N", "mean force in it")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -SHAPES[self.shape](self.time if self.over_time else self.x, self.a, self.w, self.force)


@dataclass
class Case:
    """A random flight, its end in s, its speed at the end in m/s, and how precise that is."""

    flight: Flight
    end: float
    speed: float
    error: float


def case(seed: int) -> Case:
    """Speeds over six decades, windows over five; the force takes up to 1.8 times the energy, or momentum."""
    random = Random(seed)
    shape, over_time = random.randrange(len(SHAPES)), random.random() < 0.4
    speed, w, a = 10 ** random.uniform(-3, 3), 10 ** random.uniform(-6, -1), random.uniform(0.1, 0.9)
    share, end = random.uniform(0.05, 1.8), random.uniform(2.0, 4.0) / speed
    if over_time:
        flight = Flight(v=speed, shape=shape, over_time=True, a=a / speed, w=w / speed, force=share * speed**2 / w)
        return Case(flight, end, speed * (1 - share), 1e-5 * speed)
    flight = Flight(v=speed, shape=shape, over_time=False, a=a, w=w, force=share * speed**2 / (2 * w))
    final = speed * math.sqrt(1 - share) if share < 1 else -speed
    # The place is known to 1e-9 of the way so far: the error of the energy is that of the window's ends.
    return Case(flight, end, final, speed * (1e-5 + 1e-8 * a / w * share * speed / abs(final)))


def check(seed: int, solver: Solver) -> None:
    one = case(seed)
    run = simulate(one.flight, one.end, solver=solver, rtol=1e-9, points=20 + seed % 500)
    assert run.final["v"] == pytest.approx(one.speed, rel=0, abs=one.error), (seed, solver)


@SOLVERS
@pytest.mark.parametrize("seed", range(12))
def test_narrow_forces_and_pulses_are_met(seed: int, solver: Solver) -> None:
    check(seed, solver)


@pytest.mark.slow
@SOLVERS
@pytest.mark.parametrize("block", range(BLOCKS))
def test_no_narrow_force_is_missed(block: int, solver: Solver) -> None:
    for seed in range(1000 + 50 * block, 1000 + 50 * block + 50):
        check(seed, solver)


@pytest.mark.parametrize("seed", [3, 8])
def test_an_fmu_meets_them_too(seed: int, tmp_path: Path) -> None:
    one = case(seed)
    fmu = tmp_path / "flight.fmu"
    export_fmu(one.flight, fmu, check=False)
    run = run_fmu(fmu, stop=one.end, kind="cs", tolerance=1e-9)
    assert run.final["v"] == pytest.approx(one.speed, rel=0, abs=one.error)


PRESS = """
[parts]
m = { is = "Mass", m = "1 kg", s = -0.3, v = "1 m/s" }
k = { is = "FormingForce", table = [["0 mm", "0 N"], ["1 mm", "80 kN"], ["4 mm", "80 kN"], ["5 mm", "0 N"]] }
f = { is = "TranslationalFixed" }
[connect]
a = ["m.flange_b", "k.flange"]
b = ["k.support", "f.flange"]
"""


@SOLVERS
@pytest.mark.parametrize("points", [5, 500, 5000])
def test_a_forming_force_stops_a_slow_mass(solver: Solver, points: int) -> None:
    """0.5 J are spent after sqrt(2 * 0.5 J / 80 MN/m) = 0.11 mm."""
    run = simulate(loads(PRESS), "1 s", solver=solver, points=points)
    assert run.final["m.v"] == pytest.approx(0, abs=1e-6)
    assert run.final["m.s"] == pytest.approx(math.sqrt(1 / 80e6), rel=1e-4)


def test_edges_change_their_sign_where_the_relation_changes() -> None:
    model = build(case(0).flight)
    edges = find_edges(model.arguments, model.equations.ode, model.equations.alg, model.events.guards)
    assert (edges.count > 0, edges.phases) == (True, 0)


class Modulator(Component):
    """A voltage between two values, by comparison with a carrier, behind a low pass."""

    units_checked = False
    x: Variable = var("1", "output", default=0.0)
    T: Parameter = param("s", "time constant", default=1.0)
    kind: int = 0
    f: Parameter = param("Hz", "frequency")
    g: Parameter = param("Hz", "second frequency of a product")
    a: Parameter = param("1", "command")
    b: Parameter = param("1", "feedback")

    def carrier(self) -> Expr:
        phase, turn = 2 * math.pi * self.f * self.time, mod(self.f * self.time, 1)
        return (
            sin(phase),
            4 * absolute(turn - 0.5) - 1,
            2 * turn - 1,
            sin(phase) * sin(2 * math.pi * self.g * self.time),
        )[self.kind]

    def equations(self) -> Equations:
        yield self.T * der(self.x) == if_(self.a + self.b * self.x > self.carrier(), 1, -1) - self.x


def by_small_steps(one: Modulator, end: float, share: int = 400) -> float:
    """The same by exact steps of so small a share of a period, in which one switch is interpolated."""
    f, g, a, b, T = (float(build(one).p[build(one).parameter_position[name]]) for name in ("f", "g", "a", "b", "T"))
    n = math.ceil(share * max(f, g) * end)
    t = end * np.arange(n + 1) / n
    wave = np.sin(2 * np.pi * f * t)
    carriers = (
        wave,
        4 * np.abs(np.mod(f * t, 1) - 0.5) - 1,
        2 * np.mod(f * t, 1) - 1,
        wave * np.sin(2 * np.pi * g * t),
    )
    x, decay, h = 0.0, math.exp(-end / n / T), end / n
    carrier = carriers[one.kind].tolist()
    before = a + b * x - carrier[0]
    for k in range(n):
        u = 1.0 if before > 0 else -1.0
        new = u + (x - u) * decay
        after = a + b * new - carrier[k + 1]
        if (after > 0) != (before > 0):
            jumps = abs(carrier[k + 1] - carrier[k]) > 1
            part = (math.ceil(f * t[k]) / f - t[k]) / h if jumps else before / (before - after)
            middle = u + (x - u) * math.exp(-part * h / T)
            new = -u + (middle + u) * math.exp(-(1 - part) * h / T)
            after = a + b * new - carrier[k + 1]
        x, before = new, after
    return x


def modulator(seed: int) -> tuple[Modulator, float]:
    random = Random(seed)
    f = 10 ** random.uniform(1, 2.5)
    values = {"a": random.uniform(-0.8, 0.8), "b": random.uniform(-0.15, 0.15)}
    one = Modulator(kind=seed % 4, f=f, g=f * random.uniform(0.1, 1.0), **values)
    return one, random.uniform(20, 60) / f


def check_modulator(seed: int, solver: Solver) -> None:
    one, end = modulator(seed)
    x, room, share = simulate(one, end, solver=solver).final["x"], 2e-6 + 2e-5 * end, 400
    expected = by_small_steps(one, end)
    while x != pytest.approx(expected, abs=room) and share < 20_000:
        # Two switches in one step, where a carrier is grazed, are missed there: finer steps decide.
        share *= 4
        expected = by_small_steps(one, end, share)
    assert x == pytest.approx(expected, abs=room), (seed, solver)


@SOLVERS
@pytest.mark.parametrize("seed", range(12))
def test_fast_carriers_are_resolved(seed: int, solver: Solver) -> None:
    check_modulator(seed, solver)


@pytest.mark.slow
@SOLVERS
@pytest.mark.parametrize("block", range(BLOCKS // 2))
def test_many_fast_carriers_are_resolved(block: int, solver: Solver) -> None:
    for seed in range(100 + 50 * block, 150 + 50 * block):
        check_modulator(seed, solver)


@SOLVERS
def test_a_carrier_far_above_the_time_constant_is_resolved(solver: Solver) -> None:
    """200 Hz beside 1 s: 800 changes in 2 s."""
    one = Modulator(kind=0, f=200.0, g=1.0, a=0.3, b=0.1)
    run = simulate(one, 2.0, solver=solver)
    assert len(run.events) == 800
    assert run.final["x"] == pytest.approx(by_small_steps(one, 2.0), abs=1e-5)


class Sawtooth(Component):
    """A speed that falls along a ramp of 0.84, which begins anew at multiples of 1.38."""

    units_checked = False
    y: Variable = var("1", "a state", default=1.3)

    def equations(self) -> Equations:
        yield der(self.y) == 0.57 - 0.1 * mod(mod(self.y, 1.38, events=False), 0.84, events=False)


@SOLVERS
def test_a_phase_that_jumps_is_no_wave(solver: Solver) -> None:
    """Three pieces y' = c - y/10, with ends of their own."""
    t, y = 0.0, 1.3
    for c, end in ((0.654, 1.38), (0.708, 2.22), (0.792, math.inf)):
        duration = 10 * math.log((10 * c - y) / (10 * c - end)) if end < math.inf else math.inf
        y = 10 * c - (10 * c - y) * math.exp(-min(duration, 2 - t) / 10)
        t += duration
    assert simulate(Sawtooth(), 2.0, solver=solver, rtol=1e-9).final["y"] == pytest.approx(y, abs=1e-7)


class GaussianPulse(Component):
    """A pulse of the integral one at 1 s, by an exponential of time without any comparison; x decays with 1/s."""

    units_checked = False
    x: Variable = var("1", "answer", state="always", default=0.0)
    width: Parameter = param("1", "width", default=1e-5)

    def equations(self) -> Equations:
        height = 1 / (self.width * math.sqrt(math.pi))
        yield der(self.x) == -self.x + height * exp(-(((self.time - 1) / self.width) ** 2))


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-5])
def test_a_narrow_pulse_of_time_is_not_stepped_over(solver: Any, width: float) -> None:
    """x(3 s) is e^-2, but for the width's square."""
    run = simulate(GaussianPulse(width=width), 3.0, solver=solver)
    assert run.final["x"] == pytest.approx(math.exp(-2 + width**2 / 4), rel=2e-6)


@SOLVERS
def test_an_argument_that_is_flat_before_its_edge_is_no_edge(solver: Solver) -> None:
    """|w| + w of a speed that falls to zero: the panel was cut a hundred million times."""
    drive = loads("""
    [parts]
    J0 = { is = "Inertia", J = 0.12 }
    J1 = { is = "Inertia", J = 2.8 }
    clutch = { is = "Clutch", capacity = 1e-9 }
    pull = { is = "ConstantTorque", tau_constant = -6000.0 }
    brake = { is = "Brake", capacity = 10000.0 }
    bearing = { is = "BearingFriction", tau_pos = [[0, 1000.0], [100, 2000.0]] }
    [connect]
    a = ["J0.flange_b", "clutch.flange_a", "bearing.flange_a"]
    b = ["J1.flange_b", "clutch.flange_b", "pull.flange", "brake.flange_a"]
    [start]
    "J0.w" = -1.0
    "J1.w" = 1.75
    """)
    run = simulate(drive, 0.1, start="rest", rtol=1e-9, solver=solver)
    stops = {one.mode: one.time for one in run.events if one.after == "stuck" and one.mode != "clutch.mode"}
    # 1000 N.m + 10 N.m s/rad |w| against 0.12 kg.m2; 16 kN.m against 2.8 kg.m2.
    assert stops["bearing.mode"] == pytest.approx(0.12 / 10 * math.log(1.01), rel=1e-6)
    assert stops["brake.mode"] == pytest.approx(2.8 * 1.75 / 16000, rel=1e-6)


class Thrown(Component):
    """A body thrown up at 2 m/s, at whose top of 1 m is a spring."""

    units_checked = False
    s: Variable = var("1", "height", default=0.0)
    v: Variable = var("1", "speed", default=2.0)
    edge: Parameter = param("1", "where the spring begins")
    k: Parameter = param("1", "its stiffness over the mass", default=1e3)

    def equations(self) -> Equations:
        yield der(self.s) == self.v
        yield der(self.v) == -2.0 - self.k * where(self.s > self.edge, self.s - self.edge, 0 * self.s)


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
@pytest.mark.parametrize("way", [1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_touch_at_the_top_of_a_flight_is_not_stepped_over(solver: Solver, way: float, rtol: float) -> None:
    """It is in touch for as little as a hundredth of the step; then it falls with as much as it had before."""
    up = 2.0 * math.sqrt(way)
    contact = 2 / math.sqrt(1e3) * math.atan(up * math.sqrt(1e3) / 2.0)
    rest = 3.0 - (2.0 - up) / 2.0 - contact
    run = simulate(Thrown(edge=1 - way), 3.0, solver=solver, rtol=rtol, atol=rtol / 100)
    assert run.final["v"] == pytest.approx(-up - 2 * rest, rel=20 * rtol)
    assert run.final["s"] == pytest.approx(1 - way - up * rest - rest**2, rel=20 * rtol)
