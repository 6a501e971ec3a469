"""Errors of components and of their runs: equations, units, values, modes, the integrator.

Lines of this file are written as {marker}, the line that ends in `# marker`.
"""

import sys
from collections.abc import Callable

import pytest

import modelica_like.errors as errors
from components import (
    PI,
    Battery,
    BearingFriction,
    Clutch,
    ClutchActuator,
    CombustionEngine,
    ConstantSpeed,
    Fixed,
    Freewheel,
    Inertia,
    TimeFormula,
    Torque,
)
from components.mechanics.sources import TorqueSource
from modelica_like import build, simulate, simulation_function
from modelica_like.errors import ModelicaLikeError
from modelica_like.flatten import flatten
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    param,
    sign,
    var,
)
from modelica_like.language.formula import parse_formula
from modelica_like.native.start import initialize
from modelica_like.show.report.run import notices
from modelica_like.show.report.types import library_table


class Twist(Component, partial=True):
    flange_a = Clutch.flange_a
    flange_b = Clutch.flange_b
    phi_rel: Variable = var("rad", "relative angle")
    tau: Variable = var("N.m", "torque")

    def equations(self) -> Equations:
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi  # twist
        yield self.flange_a.tau == -self.tau
        yield self.flange_b.tau == self.tau


class Coupled(Component):
    clutch: Clutch = Clutch()

    def equations(self) -> Equations:
        yield self.clutch.f_normalized == 1.0  # pressed


def revving() -> CombustionEngine:
    """An engine that reaches its rev limit, below which its speed need not fall."""
    return CombustionEngine(
        speeds=(0, 400), pedals=(0, 1), torque=((0, 100), (0, 100)), drag=((0, 10),), J=0.5, pedal=1, w_max=190,
        w_band=0, phi=0, w=180,
    )  # fmt: skip


class Forgetful(Twist):
    def equations(self) -> Equations:
        yield self.tau == 0  # forgetful


class Grip(Twist):
    plates = Mode("stuck", "open", holds={"stuck": "w_rel"})
    w_rel: Variable = var("rad/s", "slip speed")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi_rel) == self.w_rel
        yield self.plates.choose(stuck=der(self.w_rel), open=self.tau) == 0  # grip


class Nothing(Grip):
    plates = Mode("stuck", "open", holds={"stuck": "w_slip"})


class Loosely(Twist):
    w_rel: Variable = var("rad/s", "slip speed")
    plates = Mode("stuck", "open", holds={"stuck": "w_rel"})

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi_rel) == self.w_rel
        yield self.plates.choose(stuck=self.phi_rel, open=self.phi_rel) == 0


class Unfinished(TorqueSource):  # unfinished
    pass


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


class Rubbing(Component):
    m: Parameter = param("kg", "mass", default=1.0)
    F_c: Parameter = param("N", "friction", default=2.0)
    push: Parameter = param("N", "force", default=1.0)
    v: Variable = var("m/s", "speed", default=10.0)

    def equations(self) -> Equations:
        yield self.m * der(self.v) == self.push - self.F_c * sign(self.v)  # rubbing


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


def coasting(bearing: Component) -> Assembly:
    """A flywheel at 5 rad/s in a bearing."""
    parts: dict[str, Component] = {"flywheel": Inertia(J=1.0, phi=0.0, w=5.0), "bearing": bearing}
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


CASES: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {}


def case(kind: type[ModelicaLikeError], name: str, make: Callable[[], object], text: str) -> None:
    CASES[name] = kind, make, text


# -- language --------------------------------------------------------------------------------------------------------


case(
    errors.ComponentUnbalanced,
    "a component is not balanced",
    lambda: flatten(Forgetful()),
    """\
Forgetful declares 1 equation for 4 unknowns (phi_rel, tau, flange_a.tau, flange_b.tau).
  in test_component_messages.py:{forgetful} `yield self.tau == 0`
Its base Twist has equations of its own: is `yield from super().equations()` missing?""",
)
case(
    errors.LanguageError,
    "a base leaves something open",
    lambda: flatten(Unfinished()),
    """\
Unfinished does not define torque, which its base TorqueSource leaves open.
  in test_component_messages.py:{unfinished} `class Unfinished(TorqueSource):  # unfinished`
TorqueSource.torque: Return the torque on the connected part.
Write it in Unfinished: def torque(self).""",
)
case(
    errors.DuplicateName,
    "a field named like a method",
    lambda: type("Named", (Component,), {"start": var("rad/s", "speed")}),  # named
    """\
Named declares 'start', which every component has already.
  in test_component_messages.py:{named} `type("Named", (Component,), {"start": var("rad/s", "speed")})`
Choose another name.""",
)
case(
    errors.ValueOutOfRange,
    "a nominal value that is not positive",
    lambda: type("Scaled", (Component,), {"w": var("rad/s", "speed", nominal=-1.0)}),  # scaled
    """\
The nominal value of Scaled.w must be a positive, finite number, not -1.
  in test_component_messages.py:{scaled} `type("Scaled", (Component,), {"w": var("rad/s", "speed", nominal=-1.0)})`
It is the order of magnitude of a variable, in SI units, which tells how exact a run must be.
Give a typical magnitude, or leave it out: it is 1 then.""",
)
case(
    errors.ValueOutOfRange,
    "a nominal value that is no number",
    lambda: Assembly("drive").declare_array("w", 2, var("rad/s", "speed", nominal="10 rpm")),  # scaled in rpm
    """\
The nominal value of Assembly.w[1] must be a positive, finite number, not '10 rpm'.
  in test_component_messages.py:{scaled in rpm} \
`Assembly("drive").declare_array("w", 2, var("rad/s", "speed", nominal="10 rpm"))`
It is the order of magnitude of a variable, in SI units, which tells how exact a run must be.
Give a typical magnitude, or leave it out: it is 1 then.""",
)
case(
    errors.LanguageError,
    "a mode holds what is no variable",
    lambda: flatten(Nothing()),
    """\
Nothing.plates holds the motion 'w_slip', which is not a variable of Nothing.
Name a variable, or a property that returns one.""",
)
case(
    errors.LanguageError,
    "no equation holds what a mode holds",
    lambda: flatten(Loosely()),
    """\
Loosely.plates holds w_rel in 'stuck', but no equation sets der(w_rel) is zero.
Write plates.choose(…, stuck=der(self.w_rel)) == 0.""",
)
case(
    errors.LanguageError,
    "an equation that says nothing",
    lambda: flatten(Numbers()),
    """\
Numbers has an equation whose two sides are the same, or have only numbers.
  in test_component_messages.py:{numbers} `yield self.x == self.x`
An equation relates unknowns: left == right.""",
)
case(
    errors.UnitMismatch,
    "an equation of different units",
    lambda: flatten(WrongUnits(J=1.0)),
    "WrongUnits, test_component_messages.py:{units} `yield self.J * der(self.w) == 2 * self.w`: "
    "left kg.m2.rad/s2, right rad/s.",
)
case(
    errors.UnitError,
    "a value in the wrong unit",
    lambda: Inertia(J="8.5 kg.cm"),  # unit
    """\
Inertia.J expects kg.m2; '8.5 kg.cm' is kg.m.
  in test_component_messages.py:{unit} `Inertia(J="8.5 kg.cm")`""",
)
case(
    errors.ValueOutOfRange,
    "a value out of range",
    lambda: Inertia(J=-1.0),  # range
    """\
Inertia.J = -1.0 is out of range: it must be at least 0 kg.m2.
  in test_component_messages.py:{range} `Inertia(J=-1.0)`""",
)
case(
    errors.CyclicAssembly,
    "parameters in a circle",
    lambda: flatten(Circle()),
    "Parameters depend on each other in a circle: a → b → a.\nGive one of them a number.",
)
case(
    errors.NetlistError,
    "no formula",
    lambda: parse_formula("2*squrt(J)"),
    """\
'2*squrt(J)' is neither a quantity nor a formula; there is no function 'squrt'; did you mean 'sqrt'.
A quantity is a number with a unit ("8.5 kg.cm2"), a formula is arithmetic of parameters ("2*J").""",
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
Alarm: the notice of an event names xmax, which is not a parameter or input; did you mean 'x_max'?
  in test_component_messages.py:{alarm} \
`yield self.alarm.go("quiet", "ringing", when=self.x > self.x_max, notice=notice)`""",
)


# -- start and run ---------------------------------------------------------------------------------------------------


case(
    errors.SingularAtStart,
    "two clutches stick in parallel",
    lambda: initialize(build(in_parallel())),
    """\
The Jacobian is singular at t = 0 s in block 1 (one.tau, two.tau).
  in test_component_messages.py:{grip} `yield self.plates.choose(stuck=der(self.w_rel), open=self.tau) == 0`
  in inertias.py:{inertias.py:yield self.J * der(self.w) == a.tau + b.tau} `yield self.J * der(self.w) == a.tau + b.tau`
  in test_component_messages.py:{twist} `yield self.phi_rel == self.flange_b.phi - self.flange_a.phi`
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
    errors.Chattering,
    "modes switch without end",
    lambda: simulate(Relay(x=-0.5), 1.0),
    """\
state switched 20 times at t = 0.5 s (up ⇄ down).
  in test_component_messages.py:{relay up} `yield self.state.go("up", "down", when=self.x > 0)`
  in test_component_messages.py:{relay down} `yield self.state.go("down", "up", when=self.x < 0)`
Modes still switch after 20 rounds at one instant.
Give the switching a hysteresis (a peak above 1 in friction), or smooth what drives it. \
Or go on: on_chattering = "slide" along the border of two modes, "rest" in contact after ever faster impacts.""",
)
case(
    errors.Chattering,
    "a rev limit without a band",
    lambda: simulate(Assembly("bed", parts={"engine": revving()}), 1.0),
    """\
engine.fuel switched 20 times at t = 0.0555555556 s (given ⇄ cut).
  in engines.py:{engines.py:because="the rev limit is reached")} \
`yield fuel.go("given", "cut", when=w > self.w_max, because="the rev limit is reached")`
  in engines.py:{engines.py:because="the speed is below the rev limit")} \
`yield fuel.go("cut", "given", when=w < self.w_max - self.w_band, because="the speed is below the rev limit")`
Modes still switch after 20 rounds at one instant.
engine: set w_start well above w_stall, and w_band well above zero, or smooth what drives it. \
Or go on: on_chattering = "slide" along the border of two modes, "rest" in contact after ever faster impacts.""",
)
case(
    errors.Chattering,
    "an ideal friction comes to rest",
    lambda: simulate(Rubbing(), 20.0),
    """\
relation[1] switched 20 times at t = 10 s (true ⇄ false).
  in test_component_messages.py:{rubbing} `yield self.m * der(self.v) == self.push - self.F_c * sign(self.v)`
Modes still switch after 20 rounds at one instant.
If this is friction, take a class that can stick, such as BearingFriction, Brake, Clutch or SupportFriction; \
otherwise give the switching a hysteresis, or smooth what drives it. \
Or go on: on_chattering = "slide" along the border of two modes, "rest" in contact after ever faster impacts.""",
)
case(
    errors.Chattering,
    "nothing that comes to rest",
    lambda: simulate(Relay(x=-0.5), 1.0, on_chattering="rest"),
    """\
state switched 20 times at t = 0.5 s (up ⇄ down).
  in test_component_messages.py:{relay up} `yield self.state.go("up", "down", when=self.x > 0)`
  in test_component_messages.py:{relay down} `yield self.state.go("down", "up", when=self.x < 0)`
Modes still switch after 20 rounds at one instant. Nothing comes to rest: that takes impacts of a mode that holds a \
motion, with a restitution.
Give the switching a hysteresis (a peak above 1 in friction), or smooth what drives it.""",
)
case(
    errors.LimitPassed,
    "a table is left that must not be",
    lambda: simulate(coasting(BearingFriction(tau_pos=((0, 1), (2, 3)), extrapolate="error")), 2.0),
    "At 0 s bearing leaves the rows of tau_pos.",
)
case(
    errors.StepFailed,
    "the integrator gave up",
    lambda: simulate(Blow(x=1.0), 2.0),
    """\
IDAS gave up at about t = 1 s: its error test failed repeatedly, or the step became too small.
x changes fastest relative to its tolerance.
Look for a stiff spring, a vanishing mass or a speed without bound; then try other tolerances.""",
)
case(
    errors.NoGradient,
    "another mode sequence than that of a simulation function",
    lambda: simulation_function(Turning(x=0.0), ["turn"], ["x"], until=1.0).at([2.0]),
    """\
Turning has another mode sequence at these parameter values: as mode change 1, 'mode: rising → falling' is missing.
A function with a fixed mode sequence has derivatives only as long as the sequence stays.
Bound the parameters, start elsewhere, or allow it with any_sequence=True.""",
)
case(
    errors.MissingExtra,
    "an optional package is not installed",
    lambda: without("pandas"),
    'pandas is not installed.\nInstall it with: pip install "modelica-like[data]"',
)
case(
    errors.UnknownName,
    "a group that no component type has",
    lambda: library_table({"Wheel": Turning}, group="test_component_message"),
    """\
There is no group 'test_component_message'; did you mean 'test_component_messages'?
There are messages, test_component_messages.""",
)
case(
    errors.UnknownName,
    "words that no component type has",
    lambda: library_table({"Wheel": Turning}, ["worm", "gear"]),
    """\
No component type has 'worm' and 'gear' in its name or text.
Search for fewer or shorter words; `modelica-like library` lists all types.""",
)
case(
    errors.UnknownName,
    "a part in the place of another",
    lambda: build(Coupled(clutch=Inertia(J=1.0))),
    """\
clutch is of type Inertia and has no 'f_normalized', which its owner uses.
  in test_component_messages.py:{pressed} `self.clutch.f_normalized`
A part that takes the place of another needs its connectors and signals.""",
)


case(
    errors.LanguageError,
    "a controller with one limit",
    lambda: flatten(Assembly("d", parts={"speed": PI(k=1.0, Ti=1.0, u_s=0.0, u_m=0.0, y_min=-1.0)})),
    """\
speed has a y_min, but no y_max.
Give y_max, too, or leave y_min out.""",
)
case(
    errors.LanguageError,
    "half of what acts with a delay",
    lambda: flatten(Assembly("d", parts={"cells": Battery(ocv=((0.0, 3.0),), Q=1.0, R_1=0.5)})),
    """\
cells has R_1, but no C_1.
Give both, for resistance that acts with a delay, or leave R_1 out.""",
)


def test_what_an_event_has_to_say():
    run = simulate(Alarm(), 2.0)
    assert notices(run) == ["At 1.5 s Alarm exceeds 1.5."]


@pytest.mark.parametrize("name", CASES)
def test_message(check_message, name):
    check_message(*CASES[name])
