"""Errors of how a drive is put together: wiring, equations, start values.

Lines of this file are written as {marker}, the line that ends in `# marker`.
"""

from collections.abc import Callable
from dataclasses import replace

import pytest

import modelica_like.errors as errors
from components import (
    Clutch,
    Constant,
    ConstantSpeed,
    ConstantTorque,
    Fixed,
    IdealGear,
    IdealPlanetary,
    Inertia,
    Mass,
    Ravigneaux,
    Speed,
    SpringDamper,
    TorqueSensor,
)
from modelica_like import build
from modelica_like.errors import ModelicaLikeError
from modelica_like.flatten import flatten
from modelica_like.language import (
    Assembly,
    Component,
    Discrete,
    Equations,
    Events,
    Expr,
    Input,
    Parameter,
    Variable,
    clock,
    connect,
    der,
    discrete,
    param,
    series,
    signal_in,
    var,
    when,
)
from modelica_like.native.start import initialize
from modelica_like.structure import reduce


class Typo(Component):
    x: Variable = var("1", "x")
    y: Variable = var("1", "y")

    def equations(self) -> Equations:
        yield self.x + self.x**3 == 1  # typo one
        yield self.x + self.x**5 == 2  # typo two


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


class Parabola(Component):
    x: Variable = var("1", "x")
    y: Variable = var("1", "never below one")
    T: Parameter = param("s", "time", default=1.0)
    E: Parameter = param("J", "energy", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == -self.x
        yield self.y == self.x**2 + 1

    def stored_energy(self) -> Expr:
        return self.E * self.y**2


class Sampling(Component):
    """At rest at x = 1 while nothing is sampled, and nowhere near it after a tick."""

    x: Variable = var("1", "x")
    last: Discrete = discrete("1", "sample of x")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1 - self.x - 2 * self.last

    def events(self) -> Events:
        yield when(clock(self.T), {self.last: self.x})


class Wires(Component):
    """Whatever is to be connected."""

    rotor, slide, sensor, gear = Inertia(J=1.0), Mass(m=1.0), TorqueSensor(), IdealPlanetary(ratio=2.0)


def drive(**wires: str) -> Assembly:
    parts = {
        "rotor": Inertia(J=1.0, phi=0.0, w=5.0), "load": Inertia(J=1.0, w=0.0), "motor": ConstantSpeed(w_fixed=1.0),
        "second": ConstantSpeed(w_fixed=2.0), "one": Clutch(capacity=1.0), "two": Clutch(capacity=2.0),
        "gear": IdealGear(ratio=2.0),
        "twin": IdealGear(ratio=2.0), "wall": Fixed(), "other": Fixed(), "push": ConstantTorque(tau_constant=1.0),
        "spring": SpringDamper(c=1.0, d=1.0), "sensor": TorqueSensor(), "planet": IdealPlanetary(ratio=2.0),
    }  # fmt: skip
    ends = {key: text.split() for key, text in wires.items()}
    used = {end.split(".")[0] for group in ends.values() for end in group}
    chosen = {name: part for name, part in parts.items() if name in used}
    return Assembly("drive", parts=chosen, connect=ends)  # wired


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


def idling() -> Assembly:
    """A Ravigneaux set in its first gear: its large sun idles."""
    planets = Ravigneaux(small_ratio=3.0, large_ratio=-2.0)
    parts: dict[str, Component] = {"planets": planets, "wall": Fixed(), "J": Inertia(J=1.0)}
    wires = {"a": "wall.flange planets.carrier", "b": "J.flange_a planets.small_sun", "c": "J.flange_b planets.ring"}
    return Assembly("box", parts=parts, connect={name: wire.split() for name, wire in wires.items()})  # idling


CASES: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {}


def case(kind: type[ModelicaLikeError], name: str, make: Callable[[], object], text: str) -> None:
    CASES[name] = kind, make, text


# -- wiring ----------------------------------------------------------------------------------------------------------


case(
    errors.FreeFlange,
    "a flange is free",
    lambda: flatten(drive(a="rotor.flange_a planet.sun", b="planet.carrier load.flange_a")),
    """\
planet.ring is free, so planet (IdealPlanetary) carries no torque.
  in test_drive_messages.py:{wired} `parts.planet`
Connect it, or list it: free = ["planet.ring"].""",
)
case(
    errors.FreeFlange,
    "an idle shaft of four",
    lambda: flatten(idling()),
    """\
planets.large_sun is free, so it carries no torque.
  in test_drive_messages.py:{idling} `parts.planets`
Connect it, or list it: free = ["planets.large_sun"].""",
)
case(
    errors.WiringErrors,
    "several errors of the wiring",
    lambda: flatten(with_wire(lambda c: connect(c.rotor.flange_b, c.slide.flange_a, c.gear.sun))),
    """\
connect(rotor.flange_b, slide.flange_a): a Flange (rad, N.m) cannot join a LinearFlange (m, N). \
A spindle or rack goes between.
  in test_drive_messages.py:{wire} `yield wire(self)`

sensor.flange_a is free, so sensor (TorqueSensor) carries no torque.
Connect it, or yield free(self.sensor.flange_a).

sensor.flange_b is free, so sensor (TorqueSensor) carries no torque.
Connect it, or yield free(self.sensor.flange_b).

gear.carrier is free, so gear (IdealPlanetary) carries no torque.
Connect it, or yield free(self.gear.carrier).

gear.ring is free, so gear (IdealPlanetary) carries no torque.
Connect it, or yield free(self.gear.ring).""",
)
case(
    errors.WrongConnection,
    "a signal on a flange",
    lambda: flatten(
        drive(a="sensor.tau rotor.flange_b", b="sensor.flange_a rotor.flange_a", c="sensor.flange_b load.flange_a")
    ),
    """\
connect joins the signal sensor.tau with the connector rotor.flange_b.
Signals go to signals: use a sensor or a source between.""",
)
case(
    errors.WrongConnection,
    "a variable as a signal",
    lambda: flatten(
        drive(a="sensor.tau rotor.w", b="sensor.flange_a rotor.flange_a", c="sensor.flange_b load.flange_a")
    ),
    """\
connect joins rotor.w, which is neither an input nor an output.
Connect one output with any number of inputs; a sensor turns a variable into a signal.""",
)
case(
    errors.UnknownName,
    "an unknown flange",
    lambda: flatten(drive(a="planet.sum rotor.flange_a")),
    """\
planet (IdealPlanetary) has no connector 'sum'; did you mean 'sun'? It has sun, carrier, ring.
  in test_drive_messages.py:{wired} `connect.a = ['planet.sum', 'rotor.flange_a']`""",
)
case(
    errors.WrongConnection,
    "a connector in a series",
    lambda: flatten(Assembly(parts={"j": Inertia(J=1.0)}, series={"s": ["j.flange_a", "j"]})),  # connector in series
    """\
j.flange_a is a connector, but a series joins parts.
  in test_drive_messages.py:{connector in series} `series.s = ['j.flange_a', 'j']`
Write j in the series, or join j.flange_a in a connection of its own.""",
)
case(
    errors.UnknownName,
    "an unknown parameter",
    lambda: Inertia(j=1.0),  # unknown parameter
    """\
Inertia has no parameter or variable 'j'; did you mean 'J'? It has J, phi, w.
  in test_drive_messages.py:{unknown parameter} `Inertia(j=1.0)`""",
)
case(
    errors.DuplicateName,
    "a name twice",
    lambda: Assembly("drive", parts={"m": Inertia()}, parameters={"m": 1.0}),  # twice
    """\
drive: 'm' is already in use.
  in test_drive_messages.py:{twice} `Assembly("drive", parts={"m": Inertia()}, parameters={"m": 1.0})`""",
)
case(
    errors.MissingValue,
    "a parameter without a value",
    lambda: flatten(Assembly("drive", parts={"rotor": Inertia()})),  # no value
    """\
rotor.J (Inertia) has no value.
  in test_drive_messages.py:{no value} `parts.rotor`
Give it one: J = …""",
)
case(
    errors.MissingInput,
    "an input without a value",
    lambda: flatten(Assembly(parts={"motor": Speed(), "j": Inertia(J=1.0)}, series={"s": ["motor", "j"]})),  # no signal
    """\
motor.w_ref is an input without a value.
  in test_drive_messages.py:{no signal} `parts.motor`
Connect it or give it a value.""",
)

case(
    errors.WrongConnection,
    "an input with a value and a connection",
    lambda: flatten(
        Assembly(  # both
            parts={"motor": Speed(w_ref=2.0), "j": Inertia(J=1.0), "wanted": Constant(k=3.0)},
            series={"s": ["motor", "j"]},
            connect={"c": ["wanted.y", "motor.w_ref"]},
        )
    ),
    """\
motor.w_ref has a value and a connection: only one can count.
  in test_drive_messages.py:{both} `parts.motor`
Remove one of the two.""",
)


# -- structure -------------------------------------------------------------------------------------------------------


case(
    errors.Underdetermined,
    "too few equations",
    short_by_one,
    """\
Geared: 3 equations, 4 unknowns. a.phi, b.phi, a.flange_b.tau, gear.flange_b.tau occur only in the equations below, \
3 for 4 unknowns.
  in inertias.py:{inertias.py:yield self.J * der(self.w) == a.tau + b.tau} `yield self.J * der(self.w) == a.tau + b.tau`
  in ideal_gears.py:{ideal_gears.py:yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)} \
`yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)`
  in ideal_gears.py:{ideal_gears.py:yield self.ratio * a.tau + b.tau == 0} `yield self.ratio * a.tau + b.tau == 0`
1 more equation is needed: connect open ends, or fix them.""",
)
case(
    errors.Overdetermined,
    "two speeds on one shaft",
    lambda: reduce(flatten(drive(a="motor.flange rotor.flange_a", b="second.flange rotor.flange_b"))),
    """\
2 equations determine only 1 unknown (rotor.phi): second, motor.
  in sources.py:{sources.py:yield self.w == self.speed()} `yield self.w == self.speed()`
Two rigid parts fix the same motion or torque.
Remove one, or put a spring or clutch between.""",
)
case(
    errors.Overdetermined,
    "a shaft fixed twice",
    lambda: reduce(flatten(drive(a="wall.flange rotor.flange_a", b="other.flange rotor.flange_b"))),
    """\
other, wall fix the same motion or torque more than once.
  in fixed.py:{fixed.py:yield self.flange.phi == self.phi0} `yield self.flange.phi == self.phi0`
Two parts prescribe it, or rigid parts form a loop.
Remove one, or put a spring or clutch between.""",
)
case(
    errors.Overdetermined,
    "parallel gears",
    lambda: reduce(
        flatten(drive(a="rotor.flange_b gear.flange_a twin.flange_a", b="load.flange_a gear.flange_b twin.flange_b"))
    ),
    """\
The motion is constrained twice: the constraint of twin follows from others.
  in ideal_gears.py:{ideal_gears.py:yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)} \
`yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)`
Rigid parts form a loop, or two parts fix the same motion.
Remove one, or put a spring or clutch between.""",
)
case(
    errors.Overdetermined,
    "another variable was meant",
    lambda: reduce(flatten(Typo())),
    """\
2 equations determine only 1 unknown (x): Typo.
  in test_drive_messages.py:{typo two} `yield self.x + self.x**5 == 2`
  in test_drive_messages.py:{typo one} `yield self.x + self.x**3 == 1`
In addition, y lacks an equation.
Check the equations of Typo: does one of them use the wrong variable?""",
)
case(
    errors.StructureError,
    "the derivative of an input",
    lambda: reduce(flatten(Follower())),
    """\
drive: the derivative of an input (w_ref) would be needed.
  in sources.py:127 `yield self.w == self.w_ref if self.exact else der(self.w) == filtered`
Give the derivative as a separate input, or filter the input before it prescribes a motion.""",
)


# -- start -----------------------------------------------------------------------------------------------------------


case(
    errors.MissingStart,
    "a start value is missing",
    lambda: start(Geared(), a__w=1.0),
    """\
Initialization (not the model) lacks one equation: give a.phi a start value.
Or start from rest (start = "rest") or in the steady state (start = "steady").""",
)
case(
    errors.ContradictingStart,
    "start values contradict each other",
    lambda: start(Geared(), a__phi=0.0, a__w=1.0, b__w=1.0),
    """\
a.w = 1 and b.w = 1 contradict each other: b.w would be 0.5.
  in ideal_gears.py:{ideal_gears.py:yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)} \
`yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)`
Remove one of the start values, or make one a guess.""",
)
case(
    errors.InitializationError,
    "no start",
    lambda: start(Parabola(), y=0.5),
    """\
No start was found at which y has the requested value.
Give guesses near the solution, or start values of states.""",
)
case(
    errors.InitializationError,
    "nothing comes to rest",
    lambda: initialize(build(Parabola()), start="rest"),
    """\
No start was found at which y is at rest.
Give guesses near the solution, or start values of states.""",
)
case(
    errors.InitializationError,
    "no steady state",
    lambda: initialize(build(drive(a="push.flange load.flange_a")), start="steady"),
    """\
No steady state was found at t = 0 s: load.w keeps changing.
Check that the drive has an equilibrium. Give guesses near the steady motion, such as guess(100) for \
a speed; an operating point can also start from the end of a run.""",
)
case(
    errors.InitializationError,
    "samples that do not stay",
    lambda: initialize(build(Sampling()), start="steady"),
    """\
No steady state was found at t = 0 s: last changes at the next tick, and the motion with it.
A run of this drive starts as given or at rest. An operating point may be found from the end of a run: \
steady(drive, near=simulate(drive, "10 s")), --after 10s on the command line.""",
)


def test_a_high_index_is_a_notice():
    assert reduce(flatten(Geared())).notices == (
        "Index 3: gear couples motions. 1 constraint differentiated; states kept: a.phi, a.w.",
    )


@pytest.mark.parametrize("name", CASES)
def test_message(check_message, name):
    check_message(*CASES[name])
