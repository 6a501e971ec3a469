"""What is only read, and narrower than any step, since no state feels it: closed forms."""

import math
from collections.abc import Callable

import pytest

from modelica_like import simulate, sweep
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Parameter,
    Variable,
    absolute,
    der,
    exp,
    maximum,
    minimum,
    param,
    tanh,
    var,
    where,
)
from modelica_like.netlist import loads
from modelica_like.simulation import Solver

SOLVERS = pytest.mark.parametrize("solver", ["idas", "native"])
# A rack is driven at 1 m/s over a workpiece: 80 kN over 3 mm, and 1 mm before and behind it.
PRESS = """
[parts]
motor = { is = "ConstantSpeed", w_fixed = "1 rad/s" }
rack = { is = "IdealGearR2T", ratio = "1 rad/m" }
piece = { is = "FormingForce", table = [[0.3, 0], [0.301, 80], [0.304, 80], [0.305, 0]], f_scale = "1 kN" }
ground = { is = "TranslationalFixed" }
[connect]
a = ["motor.flange", "rack.flange_r"]
b = ["rack.flange_t", "piece.flange"]
c = ["piece.support", "ground.flange"]
[start]
"piece.s" = 0
"""


@SOLVERS
@pytest.mark.parametrize("points", [5, 500])
def test_a_press_at_a_given_speed_has_its_load(points: int, solver: Solver) -> None:
    read = ["peak(motor.flange.tau)", "piece.loss_energy", "first(piece.f > 40 kN)"]
    run = simulate(loads(PRESS), 1.0, solver=solver, points=points, readings=read)
    assert run.read(*read) == pytest.approx([80e3, 320.0, 0.3005], rel=1e-8)
    balance = run.energy()
    assert balance["piece"].lost == pytest.approx(320.0, rel=1e-6)
    assert balance["motor"].source == pytest.approx(320.0, rel=1e-6)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_sweep_reads_the_same(solver: Solver) -> None:
    of = ["peak(motor.flange.tau)", "piece.loss_energy"]
    runs = sweep(loads(PRESS), {"motor.w_fixed": [0.7, 0.9, 1.0]}, of, until=1.0, solver=solver, processes=1)
    assert runs[of[0]].values == pytest.approx([80e3] * 3, rel=1e-7)
    assert runs[of[1]].values == pytest.approx([320.0] * 3, rel=1e-6)


def bell(u: Expr) -> Expr:
    return exp(-(u**2))


def rational(u: Expr) -> Expr:
    return (1 + u**2) ** -2


def squared_step(u: Expr) -> Expr:
    return 1 - tanh(u) ** 2


def tent(u: Expr) -> Expr:
    return maximum(0, 1 - absolute(u))


def trough(u: Expr) -> Expr:
    return -minimum(0, absolute(u) - 1)


def cap(u: Expr) -> Expr:
    return maximum(0, 1 - u**2)


def box(u: Expr) -> Expr:
    return where(absolute(u) < 1, 1, 0, events=False)


def whole(area: float) -> Callable[[float, float], float]:
    return lambda first, last: area


def decaying(first: float, last: float) -> float:
    return sum(sign * (u / (1 + u * u) + math.atan(u)) / 2 for sign, u in ((-1, first), (1, last)))


PULSES: dict[str, tuple[Callable[[Expr], Expr], Callable[[float, float], float], float]] = {
    "bell": (bell, whole(math.sqrt(math.pi)), math.sqrt(math.log(2))),
    "rational": (rational, decaying, math.sqrt(math.sqrt(2) - 1)),
    "squared step": (squared_step, whole(2.0), math.atanh(math.sqrt(0.5))),
    "tent": (tent, whole(1.0), 0.5),
    "trough": (trough, whole(1.0), 0.5),
    "cap": (cap, whole(4 / 3), math.sqrt(0.5)),
    "box": (box, whole(2.0), 1.0),
}
"""Pulses of height one, their integrals from one place to another, and where they are one half."""


class Sensor(Component):
    """Reads a pulse at a place of a motion, and in time; nothing feels it."""

    units_checked = False
    x: Variable = var("1", "way", default=0.0)
    there: Variable = var("1", "pulse at a place")
    then: Variable = var("1", "pulse in time")
    s: Parameter = param("1", "speed", default=1.0)
    w: Parameter = param("1", "width")
    shape: str = "bell"

    def equations(self) -> Equations:
        pulse = PULSES[self.shape][0]
        clock = self.x / self.s  # what time is, of an expression without unit
        yield der(self.x) == self.s
        yield self.there == pulse((self.x - 0.7312) / self.w)
        yield self.then == -pulse((clock - 0.4) / self.w)


@SOLVERS
@pytest.mark.parametrize("w", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("shape", PULSES)
def test_what_is_only_read_is_not_missed(shape: str, w: float, solver: Solver) -> None:
    _, area, half = PULSES[shape]
    read = ["max(there)", "min(then)", "integral(there)", "integral(then)", "first(there > 0.4999999999)"]
    run = simulate(Sensor(shape=shape, w=w, s=1.25), 2.0, solver=solver, readings=read)
    highest, lowest, there, then, first = run.read(*read)
    assert [highest, lowest] == pytest.approx([1.0, -1.0], rel=1e-8)
    areas = [area(-0.7312 / w, (2.5 - 0.7312) / w) * w / 1.25, area(-0.4 / w, 1.6 / w) * w]
    assert [there, -then] == pytest.approx(areas, rel=1e-7)
    assert first == pytest.approx((0.7312 - half * w) / 1.25, abs=1e-12 + 1e-9 * w)


@pytest.mark.parametrize("shape", PULSES)
def test_a_native_sweep_does_not_miss_it(shape: str) -> None:
    area = PULSES[shape][1]
    widths = [1e-2, 1e-4]
    areas = [area(-0.7312 / w, (2 - 0.7312) / w) * w for w in widths]
    runs = sweep(Sensor(shape=shape, w=1.0), {"w": widths}, ["max(there)", "integral(there)"], until=2.0)
    assert runs["max(there)"].values == pytest.approx([1.0, 1.0], rel=1e-6)
    assert runs["integral(there)"].values == pytest.approx(areas, rel=1e-5)
