"""Every error as its reader sees it: what, where, why, and what to do.

Lines of this file are written as {marker}, the line that ends in `# marker`.
"""

import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import modelica_like.errors as errors
from components import (
    Clutch,
    ConstantSpeed,
    ConstantTorque,
    Fixed,
    IdealGear,
    IdealPlanetary,
    Inertia,
    Mass,
    Speed,
    SpringDamper,
    TorqueSensor,
)
from modelica_like import build, simulate
from modelica_like.errors import ModelicaLikeError
from modelica_like.flatten import flatten
from modelica_like.initialize import initialize
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Events,
    Input,
    Mode,
    Parameter,
    Variable,
    connect,
    der,
    param,
    series,
    signal_in,
    var,
)
from modelica_like.language.formula import parse_formula
from modelica_like.structure import reduce

HERE = Path(__file__)
LIBRARY = HERE.parents[2] / "components"


class Twist(Component, partial=True):
    flange_a = Clutch.flange_a
    flange_b = Clutch.flange_b
    phi_rel: Variable = var("rad", "relative angle")
    tau: Variable = var("N.m", "torque")

    def equations(self) -> Equations:
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi
        yield self.flange_a.tau == -self.tau
        yield self.flange_b.tau == self.tau


class Forgetful(Twist):
    def equations(self) -> Equations:
        yield self.tau == 0  # forgetful


class WrongUnits(Inertia):
    def equations(self) -> Equations:
        yield self.flange_a.phi == self.phi
        yield self.flange_b.phi == self.phi
        yield der(self.phi) == self.w
        yield self.J * der(self.w) == self.flange_a.tau + self.phi  # units


class Numbers(Component):
    x: Variable = var("1", "x")

    def equations(self) -> Equations:
        yield self.x == self.x  # numbers


class Typo(Component):
    x: Variable = var("1", "x")
    y: Variable = var("1", "y")

    def equations(self) -> Equations:
        yield self.x + self.x**3 == 1  # typo one
        yield self.x + self.x**5 == 2  # typo two


class Relay(Component):
    x: Variable = var("1", "error")
    T: Parameter = param("s", "time", default=1.0)
    state = Mode("up", "down")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.state.choose(up=1, down=-1)

    def events(self) -> Events:
        yield self.state.go("up", "down", when=self.x > 0)  # relay up
        yield self.state.go("down", "up", when=self.x < 0)  # relay down


class Blow(Component):
    x: Variable = var("1", "grows")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.x**2


class Circle(Component):
    a: Parameter = param("1", "one", default="b")
    b: Parameter = param("1", "two", default="2*a")


class Follower(Component):
    w_ref: Input = signal_in("rad/s", "speed")
    drive, rotor = Speed(), Inertia(J=1.0)

    def equations(self) -> Equations:
        yield connect(self.w_ref, self.drive.w_ref)
        yield connect(self.drive.flange, self.rotor.flange_a)


class Geared(Component):
    a, gear, b = Inertia(J=1.0), IdealGear(ratio=2.0), Inertia(J=2.0)

    def equations(self) -> Equations:
        yield from series(self.a, self.gear, self.b)


class Wires(Component):
    """Whatever is to be connected."""

    rotor, slide, sensor, gear = Inertia(J=1.0), Mass(m=1.0), TorqueSensor(), IdealPlanetary(ratio=2.0)


def drive(**wires: str) -> Assembly:
    parts = {
        "rotor": Inertia(J=1.0, phi=0.0, w=5.0), "load": Inertia(J=1.0, w=0.0), "motor": ConstantSpeed(w_fixed=1.0),
        "second": ConstantSpeed(w_fixed=2.0), "one": Clutch(capacity=1.0), "two": Clutch(capacity=2.0), "gear": IdealGear(ratio=2.0),
        "twin": IdealGear(ratio=2.0), "wall": Fixed(), "other": Fixed(), "push": ConstantTorque(tau_constant=1.0),
        "spring": SpringDamper(c=1.0, d=1.0), "set": IdealPlanetary(ratio=2.0),
    }  # fmt: skip
    ends = {key: text.split() for key, text in wires.items()}
    used = {end.split(".")[0] for group in ends.values() for end in group}
    return Assembly("drive", parts={name: part for name, part in parts.items() if name in used}, connect=ends)


def with_wire(wire: Callable[[Wires], object]) -> Component:
    class Wired(Wires):
        def equations(self) -> Equations:
            yield wire(self)  # type: ignore[misc]  # wire

    return Wired()


def start(component: Component, **values: float) -> None:
    for key, value in values.items():
        component.set(key.replace("__", "."), value)
    initialize(build(component))


def short_by_one() -> None:
    flat = flatten(Geared())
    reduce(replace(flat, linear=flat.linear[:-1]))


def without(package: str) -> None:
    run = simulate(Relay(x=-1.0), 0.5, points=1)
    present = sys.modules.get(package)
    sys.modules[package] = None  # type: ignore[assignment]
    try:
        run.to_pandas() if package == "pandas" else run.to_xarray()
    finally:
        sys.modules.pop(package)
        if present is not None:
            sys.modules[package] = present


def in_parallel(number: int) -> Assembly:
    ends = ("one.flange_a", "two.flange_a")[:number], ("one.flange_b", "two.flange_b")[:number]
    made = drive(left=" ".join(("rotor.flange_b", *ends[0])), right=" ".join((*ends[1], "load.flange_a")))
    made.set("one.phi_rel", 0.0)
    return made


CASES: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {}


def case(kind: type[ModelicaLikeError], name: str, make: Callable[[], object], text: str) -> None:
    CASES[name] = kind, make, text


def expand(text: str) -> str:
    """Replace {marker} by the number of the line that ends in it, and {file:marker} likewise in the library."""

    def number(match: re.Match[str]) -> str:
        name, _, marker = match.group(1).rpartition(":")
        lines = (LIBRARY / name if name else HERE).read_text().splitlines()
        end = marker if name else f"# {marker}"
        return str(1 + next(k for k, line in enumerate(lines) if line.strip().endswith(end) or (name and line.strip() == end)))

    return re.sub(r"\{([^{}]+)\}", number, text)


# @@CASES@@


@pytest.mark.parametrize("name", CASES)
def test_message(name):
    kind, make, text = CASES[name]
    with pytest.raises(ModelicaLikeError) as caught:
        make()
    assert str(caught.value) == expand(text)
    assert type(caught.value) is kind
