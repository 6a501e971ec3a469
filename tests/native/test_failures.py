"""Errors of the run-time in C: a code each, with the class and the sentences of the same error of the other solver."""

import itertools
import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from components import (
    BearingFriction,
    Capacitor,
    Clutch,
    ConstantTorque,
    ConstantVoltage,
    Ground,
    IdealDiode,
    IdealGear,
    IdealSwitch,
    Inductor,
    Inertia,
    Pulse,
    Resistor,
)
from modelica_like import Assembly, build, simulate
from modelica_like.errors import ModelicaLikeError, NotEnoughMemory
from modelica_like.language import (
    TIME,
    Component,
    Equations,
    Events,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    delay,
    der,
    discrete,
    integer,
    maximum,
    param,
    pre,
    signal_in,
    signal_out,
    sqrt,
    terminate,
    var,
    when,
)
from modelica_like.native import model as native_model
from modelica_like.native.codes import WORDED, Code

HEADER = Path(__file__).parents[2] / "modelica_like" / "fmi" / "templates" / "codes.h"
IMPORTERS = {
    Code.MISUSED, Code.START_SINGULAR, Code.TUNED_OUTSIDE_EVENTS, Code.NO_INPUT, Code.INPUT_RATE_NOT_FINITE,
    Code.NO_VARIABLE, Code.NOT_ENUMERATION,
}  # fmt: skip
"""Errors that only importers of FMUs can make: tests/fmi."""


class Basis(Component):
    units_checked = False
    x: Variable = var("1", "state")
    a: Parameter = param("1", "factor", default=1.0, min=0.0, max=10.0)


class Square(Basis):
    """y is the square of the state."""

    y: Variable = var("1", "square")

    def equations(self) -> Equations:
        yield der(self.x) == -self.x
        yield self.y == self.x**2


class Root(Basis):
    """z is a root of a cubic, whose only real one Newton's method does not reach from zero."""

    z: Variable = var("1", "root")

    def equations(self) -> Equations:
        yield der(self.x) == -self.x + 0 * self.z
        yield self.z**3 - 2 * self.z + 2 == self.x


class Divided(Basis):
    """The block of y and z is singular without a; the rate of x is infinite without it."""

    y: Variable = var("1", "one")
    z: Variable = var("1", "other")

    def equations(self) -> Equations:
        yield der(self.x) == self.y
        yield self.y + self.z == self.x
        yield self.y + (1 - self.a) * self.z == 1


class Inverse(Basis):
    def equations(self) -> Equations:
        yield der(self.x) == 1 / self.a


class Falling(Basis):
    """x = (1 - t/2)^2 until it is zero."""

    def equations(self) -> Equations:
        yield der(self.x) == -sqrt(self.x - TIME)


class Exploding(Basis):
    """x = 1 / (1 - t)."""

    def equations(self) -> Equations:
        yield der(self.x) == self.x**2


class Chasing(Basis):
    """x follows from y by the mode, and the mode from x."""

    y: Variable = var("1", "given")
    mode = Mode("a", "b")

    def equations(self) -> Equations:
        yield der(self.x) == -self.x
        yield self.y == self.mode.choose(a=self.x - 1, b=self.x + 3)

    def events(self) -> Events:
        yield self.mode.initially("b", when=self.x > 0)
        yield self.mode.initially("a", when=self.x < 0)


class Trembling(Basis):
    side = Mode("above", "below")

    def equations(self) -> Equations:
        yield der(self.x) == self.side.choose(above=-1, below=1)

    def events(self) -> Events:
        yield self.side.go("above", "below", when=self.x < 0)
        yield self.side.go("below", "above", when=self.x > 0)


class Converging(Basis):
    """A gap that halves at every instant."""

    v: Variable = var("1", "rate", state="always")
    side = Mode("up", "down")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -1

    def events(self) -> Events:
        yield self.side.go("up", "down", when=self.x < 0, reset={self.v: -0.5 * self.v})
        yield self.side.go("down", "up", when=self.x > 0)


class Rebound(Basis):
    v: Variable = var("1", "rate", state="always")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -9.81

    def events(self) -> Events:
        yield when(self.x < 0, {self.v: -0.1 * self.v})


class Counting(Basis):
    n = integer("number")

    def equations(self) -> Equations:
        yield der(self.x) == 1
        yield self.n == pre(self.n) + 1


class Late(Basis):
    y: Variable = var("1", "delayed")
    side = Mode("up", "down")

    def equations(self) -> Equations:
        yield der(self.x) == self.side.choose(up=1, down=-1)
        yield self.y == delay(self.x, self.a)

    def events(self) -> Events:
        yield self.side.go("up", "down", when=self.x > 1e-4)
        yield self.side.go("down", "up", when=self.x < 0)


def coasting(**bearing) -> Assembly:
    parts = {"J": Inertia(J=1.0, phi=0.0, w=10.0), "bearing": BearingFriction(**bearing)}
    return Assembly("coasting", parts=parts, series={"shaft": ["J", "bearing"]})


def shaft(*between, second=None) -> Assembly:
    parts = {"a": Inertia(J=1.0, phi=0.0, w=1.0), **dict(between), "b": Inertia(J=2.0, **(second or {}))}
    return Assembly("shaft", parts=parts, series={"shaft": [*parts]})


def across(part) -> Assembly:
    parts = {"source": ConstantVoltage(V=10.0), "part": part, "earth": Ground()}
    return Assembly("circuit", parts=parts, connect={"1": ["source.p", "part.p"],
                                                     "0": ["source.n", "part.n", "earth.p"]})  # fmt: skip


def interrupted() -> Assembly:
    parts = {"U": ConstantVoltage(V=24.0), "S": IdealSwitch(), "L": Inductor(L=1e-3, i=0.0), "R": Resistor(R=5.0),
             "earth": Ground(), "clock": Pulse(period=1.0, width=1e-3)}  # fmt: skip
    return Assembly("circuit", parts=parts, connect={
        "s": ["clock.y", "S.closed"], "1": ["U.p", "S.p"], "2": ["S.n", "L.p"], "3": ["L.n", "R.p"],
        "0": ["U.n", "earth.p", "R.n"],
    })  # fmt: skip


def restarted(drive, values, start=None, **how):
    handle = build(drive).native(start=start, **how)
    handle.reset(values, until=10.0)
    return handle


def native(drive, until=2.0, **how):
    return lambda: simulate(drive, until, solver="native", **how)


EXPLORE = {
    Code.STARTS_CONTRADICT: lambda: restarted(shaft(second={"w": 1.0}), {"b.w": 2.0}),
    Code.START_NOT_MET: lambda: restarted(shaft(("gear", IdealGear(ratio=2.0)), second={"w": 0.5}), {"b.w": 2.0}),
    Code.START_NOT_FOUND: lambda: restarted(Square(y=1.0), {"y": -1.0}),
    Code.START_NOT_SETTLED: lambda: restarted(Chasing(y=5.0), {"y": 1.0}),
    Code.NOT_STEADY: lambda: build(Inverse()).native(start="steady"),
    Code.MODE_NOT_STEADY: lambda: None,
    Code.UNKNOWN_SINGULAR: lambda: restarted(Root(x=0.0), {}),
    Code.BLOCK_SINGULAR: lambda: restarted(Divided(x=0.0, a=0.5), {"a": 0.0}),
    Code.NOT_SOLVED: lambda: restarted(Root(x=0.0), {}),
    Code.RATE_NOT_FINITE: lambda: restarted(Inverse(x=0.0), {"a": 0.0}),
    Code.STEP_TOO_SMALL: native(Exploding(x=1.0)),
    Code.FIXED_STEP_FAILED: lambda: restarted(Falling(x=1.0), {}, fixed_step=0.1).step(2.0),
    Code.LIMIT_PASSED: native(coasting(tau_pos=((0, 1), (2, 3)), extrapolate="error")),
    Code.EVER_FASTER: native(Converging(x=1.0, v=0.0), 20.0),
    Code.NOT_SETTLED: native(Counting(x=0.0)),
    Code.STILL_SWITCHING: native(Trembling(x=1.0)),
    Code.STAYS_TRUE: native(Rebound(x=1.0, v=0.0)),
    Code.NO_VALID_MODES: native(interrupted(), 0.01),
    Code.CONTRADICTS: native(across(IdealDiode()), 0.01),
    Code.DELAY_NOT_POSITIVE: lambda: restarted(Late(x=0.0), {"a": 0.0}),
    Code.PAST_TOO_LONG: native(Late(x=0.0, a=1.0), 1.5),
}
