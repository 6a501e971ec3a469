"""Every error as its reader sees it: what, where, why, and what to do.

Lines of this file are written as {marker}, the line that ends in `# marker`.
"""

import pickle
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import modelica_like.errors as errors
from components import (
    Clutch,
    ClutchActuator,
    ConstantSpeed,
    ConstantTorque,
    Fixed,
    Freewheel,
    IdealGear,
    IdealPlanetary,
    Inertia,
    Mass,
    Speed,
    SpringDamper,
    TimeFormula,
    Torque,
    TorqueSensor,
)
from modelica_like import Solution, build, simulate, simulation_function
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
from modelica_like.report.run import notices
from modelica_like.structure import reduce

HERE = Path(__file__)
LIBRARY = HERE.parents[2] / "components"


class Twist(Component, partial=True):
    flange_a = Clutch.flange_a
    flange_b = Clutch.flange_b
    phi_rel: Variable = var("rad", "relative angle")
    tau: Variable = var("N.m", "torque")

    def equations(self) -> Equations:
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi  # twist
        yield self.flange_a.tau == -self.tau
        yield self.flange_b.tau == self.tau


class Forgetful(Twist):
    def equations(self) -> Equations:
        yield self.tau == 0  # forgetful


class Grip(Twist):
    plates = Mode("stuck", "open")
    w_rel: Variable = var("rad/s", "slip speed")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi_rel) == self.w_rel
        yield self.plates.choose(stuck=der(self.w_rel), open=self.tau) == 0  # grip


class WrongUnits(Inertia):
    def equations(self) -> Equations:
        yield self.flange_a.phi == self.phi
        yield self.flange_b.phi == self.phi
        yield der(self.phi) == self.w
        yield self.J * der(self.w) == 2 * self.w  # units


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


class Turning(Component):
    x: Variable = var("1", "height")
    T: Parameter = param("s", "time", default=1.0)
    turn: Parameter = param("1", "height at which it turns", default=0.5)
    mode = Mode("rising", "falling")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.mode.choose(rising=1, falling=-1)

    def events(self) -> Events:
        yield self.mode.go("rising", "falling", when=self.x > self.turn)


class Relay(Component):
    x: Variable = var("1", "error")
    T: Parameter = param("s", "time", default=1.0)
    state = Mode("up", "down")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.state.choose(up=1, down=-1)

    def events(self) -> Events:
        yield self.state.go("up", "down", when=self.x > 0)  # relay up
        yield self.state.go("down", "up", when=self.x < 0)  # relay down


class Alarm(Component):
    x: Variable = var("1", "rises", default=0.0)
    x_max: Parameter = param("1", "limit", default=1.5)
    T: Parameter = param("s", "time", default=1.0)
    bell: str = "x_max"
    alarm = Mode("quiet", "ringing")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1

    def events(self) -> Events:
        notice = f"exceeds {{{self.bell}}}"
        yield self.alarm.go("quiet", "ringing", when=self.x > self.x_max, notice=notice)  # alarm


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


def in_parallel() -> Assembly:
    parts = {
        "rotor": Inertia(J=1.0, phi=0.0, w=0.0),
        "one": Grip(phi_rel=0.0, w_rel=0.0),
        "two": Grip(),
        "load": Inertia(J=1.0),
    }
    return Assembly("drive", parts=parts, series={"a": ["rotor", "one", "load"], "b": ["rotor", "two", "load"]})


def drive_by(signal: Component) -> Assembly:
    """A torque that follows a signal."""
    parts: dict[str, Component] = {"signal": signal, "torque": Torque(), "rotor": Inertia(J=1.0)}
    return Assembly(
        "drive", parts=parts, series={"shaft": ["torque", "rotor"]}, connect={"drive": ["signal.y", "torque.tau"]}
    )


def overrun() -> Assembly:
    """A freewheel between a shaft that a source holds still and the housing."""
    parts: dict[str, Component] = {"engine": ConstantSpeed(w_fixed=0.0), "wheel": Freewheel(), "wall": Fixed()}
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def spoiled() -> Solution:
    """A run with states that are no numbers."""
    run = simulate(Geared(), 1.0, start="rest")
    segment = replace(run.segments[0], x=run.segments[0].x * float("nan"))
    return replace(run, segments=(segment,))


CASES: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {}


def case(kind: type[ModelicaLikeError], name: str, make: Callable[[], object], text: str) -> None:
    CASES[name] = kind, make, text


def expand(text: str) -> str:
    """Replace {marker} by the number of the line that ends in it, and {file:marker} likewise in the library."""

    def number(match: re.Match[str]) -> str:
        name, _, marker = match.group(1).rpartition(":")
        lines = (LIBRARY / name if name else HERE).read_text().splitlines()
        end = marker if name else f"# {marker}"
        return str(
            1 + next(k for k, line in enumerate(lines) if line.strip().endswith(end) or (name and line.strip() == end))
        )

    return re.sub(r"\{([a-z ]+|[a-z_]+\.py:[^{}]+)\}", number, text)


# -- wiring ----------------------------------------------------------------------------------------------------------

case(
    errors.FreeFlange,
    "a flange is free",
    lambda: flatten(drive(a="rotor.flange_a planet.sun", b="planet.carrier load.flange_a")),
    """\
planet.ring is free, so planet (IdealPlanetary) carries no torque.
  in test_messages.py:{wired} `parts.planet`
Connect it, or say free(planet.ring).""",
)
case(
    errors.WiringErrors,
    "several errors of the wiring",
    lambda: flatten(with_wire(lambda c: connect(c.rotor.flange_b, c.slide.flange_a, c.gear.sun))),
    """\
connect(rotor.flange_b, slide.flange_a): a Flange (rad, N.m) cannot join a LinearFlange (m, N). \
A spindle or rack goes between.
  in test_messages.py:{wire} `yield wire(self)`

sensor.flange_a is free, so sensor (TorqueSensor) carries no torque.
Connect it, or say free(sensor.flange_a).

sensor.flange_b is free, so sensor (TorqueSensor) carries no torque.
Connect it, or say free(sensor.flange_b).

gear.carrier is free, so gear (IdealPlanetary) carries no torque.
Connect it, or say free(gear.carrier).

gear.ring is free, so gear (IdealPlanetary) carries no torque.
Connect it, or say free(gear.ring).""",
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
Connect one output with any number of inputs; a sensor makes a signal of a variable.""",
)
case(
    errors.UnknownName,
    "an unknown flange",
    lambda: flatten(drive(a="planet.sum rotor.flange_a")),
    """\
planet (IdealPlanetary) has no connector 'sum'; did you mean 'sun'? It has sun, carrier, ring.
  in test_messages.py:{wired} `connect.a = ['planet.sum', 'rotor.flange_a']`""",
)
case(
    errors.WrongConnection,
    "a connector in a series",
    lambda: flatten(Assembly(parts={"j": Inertia(J=1.0)}, series={"s": ["j.flange_a", "j"]})),  # connector in series
    """\
j.flange_a is a connector, and a series joins parts.
  in test_messages.py:{connector in series} `series.s = ['j.flange_a', 'j']`
Write j in the series, or join j.flange_a in a connection of its own.""",
)
case(
    errors.UnknownName,
    "an unknown parameter",
    lambda: Inertia(j=1.0),  # unknown parameter
    """\
Inertia has no parameter or variable 'j'. It has J, phi, w.
  in test_messages.py:{unknown parameter} `Inertia(j=1.0)`""",
)
case(
    errors.DuplicateName,
    "a name twice",
    lambda: Assembly("drive", parts={"m": Inertia()}, parameters={"m": 1.0}),  # twice
    """\
drive: 'm' is already the name of something else.
  in test_messages.py:{twice} `Assembly("drive", parts={"m": Inertia()}, parameters={"m": 1.0})`""",
)
case(
    errors.MissingValue,
    "a parameter without a value",
    lambda: flatten(Assembly("drive", parts={"rotor": Inertia()})),  # no value
    """\
rotor.J (Inertia) has no value.
  in test_messages.py:{no value} `parts.rotor`
Give it one: J = …""",
)
case(
    errors.MissingValue,
    "an input without a value",
    lambda: flatten(Assembly(parts={"motor": Speed(), "j": Inertia(J=1.0)}, series={"s": ["motor", "j"]})),  # no signal
    """\
motor.w_ref is an input without a value.
  in test_messages.py:{no signal} `parts.motor`
Connect it or give it a value.""",
)

# -- language --------------------------------------------------------------------------------------------------------

case(
    errors.ComponentUnbalanced,
    "a component is not balanced",
    lambda: flatten(Forgetful()),
    """\
Forgetful declares 1 equation for 4 unknowns (phi_rel, tau, flange_a.tau, flange_b.tau).
  in test_messages.py:{forgetful} `yield self.tau == 0`
Its base Twist has equations of its own: is `yield from super().equations()` missing?""",
)
case(
    errors.LanguageError,
    "an equation that says nothing",
    lambda: flatten(Numbers()),
    """\
Numbers has an equation whose two sides are the same, or only numbers.
  in test_messages.py:{numbers} `yield self.x == self.x`
An equation relates unknowns: left == right.""",
)
case(
    errors.UnitMismatch,
    "an equation of different units",
    lambda: flatten(WrongUnits(J=1.0)),
    "WrongUnits, test_messages.py:{units} `yield self.J * der(self.w) == 2 * self.w`: left kg.m2.rad/s2, right rad/s.",
)
case(
    errors.UnitError,
    "a value in the wrong unit",
    lambda: Inertia(J="8.5 kg.cm"),  # unit
    """\
Inertia.J expects kg.m2; '8.5 kg.cm' is kg.m.
  in test_messages.py:{unit} `Inertia(J="8.5 kg.cm")`""",
)
case(
    errors.ValueOutOfRange,
    "a value out of range",
    lambda: Inertia(J=-1.0),  # range
    """\
Inertia.J = -1.0 is out of range: it must be at least 0 kg.m2.
  in test_messages.py:{range} `Inertia(J=-1.0)`""",
)
case(
    errors.CyclicAssembly,
    "parameters in a circle",
    lambda: flatten(Circle()),
    "Parameters depend on each other in a circle: a → b → a.\nGive one a number.",
)
case(
    errors.NetlistError,
    "no formula",
    lambda: parse_formula("2*squrt(J)"),
    """\
'2*squrt(J)' is neither a quantity nor a formula; there is no function 'squrt'; did you mean 'sqrt'.
A quantity is a number with a unit ("8.5 kg.cm2"), a formula is arithmetic of parameters ("2*J").""",
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
  in gears.py:{gears.py:yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)} \
`yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)`
  in gears.py:{gears.py:yield self.ratio * a.tau + b.tau == 0} `yield self.ratio * a.tau + b.tau == 0`
1 more equation is needed: connect what is open, or fix it.""",
)
case(
    errors.Overdetermined,
    "two speeds on one shaft",
    lambda: reduce(flatten(drive(a="motor.flange rotor.flange_a", b="second.flange rotor.flange_b"))),
    """\
2 equations determine only 1 unknown (rotor.phi): second, motor.
  in sources.py:{sources.py:yield self.w == self.speed()} `yield self.w == self.speed()`
Two rigid parts fix the same speed or torque.
Remove one, or put a spring or clutch between.""",
)
case(
    errors.Overdetermined,
    "a shaft fixed twice",
    lambda: reduce(flatten(drive(a="wall.flange rotor.flange_a", b="other.flange rotor.flange_b"))),
    """\
other, wall fix the same angle, speed or torque more than once.
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
  in gears.py:{gears.py:yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)} \
`yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)`
Rigid parts form a loop, or two parts fix the same speed.
Remove one, or put a spring or clutch between.""",
)
case(
    errors.Overdetermined,
    "another variable was meant",
    lambda: reduce(flatten(Typo())),
    """\
2 equations determine only 1 unknown (x): Typo.
  in test_messages.py:{typo two} `yield self.x + self.x**5 == 2`
  in test_messages.py:{typo one} `yield self.x + self.x**3 == 1`
On the other hand y lacks an equation.
Look at the equations of Typo: is another variable meant in one of them?""",
)
case(
    errors.StructureError,
    "the derivative of an input",
    lambda: reduce(flatten(Follower())),
    """\
der(rotor.w) is the derivative of the input w_ref, which is not known.
Give the derivative as an input of its own, or filter the input before it prescribes a motion.""",
)

# -- start -----------------------------------------------------------------------------------------------------------

case(
    errors.MissingStart,
    "a start value is missing",
    lambda: start(Geared(), a__w=1.0),
    """\
Initialisation (not the model) lacks one equation: give a.phi a start value.
Or start from rest (start = "rest") or in the steady state (start = "steady").""",
)
case(
    errors.ContradictingStart,
    "start values contradict each other",
    lambda: start(Geared(), a__phi=0.0, a__w=1.0, b__w=1.0),
    """\
a.w = 1 and b.w = 1 contradict each other: b.w follows to be 0.5.
  in gears.py:{gears.py:yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)} \
`yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)`
Remove one of the start values, or make one a guess.""",
)
case(
    errors.InitializationError,
    "no steady state",
    lambda: initialize(build(drive(a="push.flange load.flange_a")), start="steady"),
    """\
No steady state was found at t = 0 s: load.w keeps changing.
Check that the drive can be in equilibrium there, or give start values instead.""",
)
case(
    errors.SingularAtStart,
    "two clutches stick in parallel",
    lambda: initialize(build(in_parallel())),
    """\
The Jacobian is singular at t = 0 s in block 1 (one.tau, two.tau).
  in test_messages.py:{grip} `yield self.plates.choose(stuck=der(self.w_rel), open=self.tau) == 0`
  in inertias.py:{inertias.py:yield self.J * der(self.w) == a.tau + b.tau} `yield self.J * der(self.w) == a.tau + b.tau`
  in test_messages.py:{twist} `yield self.phi_rel == self.flange_b.phi - self.flange_a.phi`
one and two stick: where they hold the same motion, their torque split is undetermined.
Give one of them a small creep, put a spring between them, or let one start open.""",
)
case(
    errors.SingularAtStart,
    "a freewheel holds what a source prescribes",
    lambda: initialize(build(overrun())),
    """\
The Jacobian is singular at t = 0 s in block 1 (wheel.tau).
  in one_way.py:{one_way.py:yield self.mode.choose(overrunning=self.tau, locked=der(self.w_rel)) == 0} \
`yield self.mode.choose(overrunning=self.tau, locked=der(self.w_rel)) == 0`
wheel holds a motion that is prescribed by engine: no torque can stop it.
Let a torque drive it instead, or put a spring or clutch between.""",
)

case(
    errors.NetlistError,
    "a structural field has another type",
    lambda: ClutchActuator(t12=0.1, t2=0.1).set("exponential", "yes"),
    "ClutchActuator.exponential = 'yes' must be true or false.",
)
case(
    errors.NetlistError,
    "a unit in a formula of time",
    lambda: flatten(drive_by(TimeFormula(formula="72.5 N.m * time"))),
    "'72.5 N.m' has a unit, but this formula takes plain numbers only.",
)
case(
    errors.LanguageError,
    "a notice names what is no parameter",
    lambda: flatten(Alarm(bell="xmax")),
    """\
Alarm: the notice of an event names xmax, which is no parameter; did you mean 'x_max'?
  in test_messages.py:{alarm} `yield self.alarm.go("quiet", "ringing", when=self.x > self.x_max, notice=notice)`""",
)

# -- run -------------------------------------------------------------------------------------------------------------

case(
    errors.Chattering,
    "modes switch without end",
    lambda: simulate(Relay(x=-0.5), 1.0),
    """\
state switched 20 times at t = 0.5 s (up ⇄ down).
  in test_messages.py:{relay up} `yield self.state.go("up", "down", when=self.x > 0)`
  in test_messages.py:{relay down} `yield self.state.go("down", "up", when=self.x < 0)`
Modes still switch after 20 rounds at one instant.
Give the switching a hysteresis (a peak above 1 in friction), or smooth what drives it.""",
)
case(
    errors.StepFailed,
    "the integrator gave up",
    lambda: simulate(Blow(x=1.0), 2.0),
    """\
IDAS gave up at about t = 0.999998 s: it took too many steps (IDA_TOO_MUCH_WORK).
x changes fastest relative to its tolerance.
Look for a stiff spring, a vanishing mass or a speed without bound; then try other tolerances.""",
)
case(
    errors.StepFailed,
    "energies cannot be integrated",
    lambda: spoiled().energy(),
    """\
The powers cannot be integrated from t = 0 s to 1 s.
Energies ask for more precision than the run itself.
Leave the energy balance out (--no-energy), or look at a shorter time.""",
)
case(
    errors.NoGradient,
    "another mode sequence than that of a simulation function",
    lambda: simulation_function(Turning(x=0.0), ["turn"], ["x"], until=1.0).at([2.0]),
    """\
Turning has another mode sequence at these parameter values: as mode change 1, 'mode: rising → falling' is missing.
A function with a fixed mode sequence has derivatives only as long as the sequence stays.
Bound the parameters, begin elsewhere, or allow it with any_sequence=True.""",
)
case(
    errors.MissingExtra,
    "an optional package is not installed",
    lambda: without("pandas"),
    'pandas is not installed.\nInstall it with: pip install "modelica-like[data]"',
)


def test_a_high_index_is_a_notice():
    assert [notice.text for notice in reduce(flatten(Geared())).notices] == [
        "Index 3: gear couples motions. 1 constraint differentiated; states kept: a.phi, a.w."
    ]


def test_what_an_event_has_to_say():
    run = simulate(Alarm(), 2.0)
    assert notices(run) == ["At 1.5 s Alarm exceeds 1.5."]


def test_every_error_has_a_snapshot():
    """Here, or in a neighbouring file, which names the error in a test and not only where it imports it."""
    bases = {errors.ModelicaLikeError, errors.SolveError}  # never raised themselves
    every = {kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, ModelicaLikeError)}
    elsewhere = "".join(file.read_text() for file in HERE.parent.glob("test_*.py") if file != HERE)
    told = {kind for kind, _, _ in CASES.values()}
    told |= {kind for kind in every if re.search(rf"(\(|raises\(|\(errors\.)\s*{kind.__name__}\b", elsewhere)}
    assert every - told - bases == set()


@pytest.mark.parametrize("name", CASES)
def test_errors_pickle(name):
    """A worker process hands its error on."""
    with pytest.raises(ModelicaLikeError) as caught:
        CASES[name][1]()
    twin = pickle.loads(pickle.dumps(caught.value))
    assert str(twin) == str(caught.value)
    assert type(twin) is type(caught.value)


def test_a_source_is_told_shortly():
    assert str(errors.Source("/home/me/gears.py", 31, "yield a == b")) == "gears.py:31 `yield a == b`"
    assert str(errors.Source("drive.toml", 3)) == "drive.toml:3"
    assert str(errors.Source("drive.toml")) == "drive.toml"
    long = str(errors.Source("x.py", 1, "yield " + "a + " * 100))
    assert len(long) == len("x.py:1 ``") + 160
    assert long.endswith("…`")


@pytest.mark.parametrize("name", CASES)
def test_message(name):
    kind, make, text = CASES[name]
    with pytest.raises(ModelicaLikeError) as caught:
        make()
    assert str(caught.value) == expand(text)
    assert type(caught.value) is kind
