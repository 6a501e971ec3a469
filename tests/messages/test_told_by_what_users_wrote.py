"""Messages in the words of what a user wrote: the domain, the option, the netlist; never a place in foreign code."""

from collections.abc import Callable
from pathlib import Path

import pytest
from calls import called

from components import Inertia, Pin, Torque
from modelica_like import build, simulate
from modelica_like.errors import (
    ComponentUnbalanced,
    FreeFlange,
    LanguageError,
    ModelicaLikeError,
    Overdetermined,
    SingularAtStart,
    UnitError,
)
from modelica_like.language import (
    Component,
    Connector,
    Domain,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    absolute,
    all_of,
    connect,
    der,
    flow,
    negate,
    param,
    series,
    tanh,
    var,
    where,
)
from modelica_like.language.units import parse_unit
from modelica_like.netlist import loads
from modelica_like.show.report.changes import reasons

CIRCUIT = """
[parts]
u = { is = "ConstantVoltage", V = "10 V" }
r = { is = "Resistor", R = "1 Ohm" }
[connect]
plus = ["u.p", "r.p"]
minus = ["u.n", "r.n"]
"""
ON_SUPPLY = """
[parts]
pack = { is = "ConstantVoltage", V = "48 V" }
motor = { is = "MappedDrive", limit = [[0, 10]], tau_ref = 1, Jr = 0.1 }
wheel = { is = "Inertia", J = 1 }
[connect]
plus = ["pack.p", "motor.p_dc"]
minus = ["pack.n", "motor.n_dc"]
shaft = ["motor.flange", "wheel.flange_a"]
"""
GEARED = """
[parts]
push = { is = "ConstantTorque", tau_constant = "1 N.m" }
fast = { is = "Inertia", J = 1 }
gear = { is = "IdealGear", ratio = 0 }
slow = { is = "Inertia", J = 1 }
[series]
train = ["push", "fast", "gear", "slow"]
[simulate]
until = "1 s"
start = "rest"
"""
GRIP = """
[parameters]
J = "2 kg.m2"
[parts]
push = { is = "ConstantTorque", tau_constant = "1 N.m" }
rotor = { is = "Inertia", J = "J", w = 1, phi = 0 }
grip = { is = "Brake", capacity = "2 N.m" }
[series]
train = ["push", "rotor", "grip"]
[simulate]
until = "3 s"
"""


class Driven(Component):
    """Gives a part's input a value by an equation."""

    def build(self) -> None:
        self.motor = Torque()
        self.rotor = Inertia(J=1.0)

    def equations(self) -> Equations:
        yield from series(self.motor, self.rotor)
        yield self.motor.tau == 3 - self.rotor.w  # driven


class Port(Connector):
    """A third party's domain."""

    domain = Domain("volume flow", "pressure", "a throttle", converters={"Flange": "A pump"})
    p: Variable = var("Pa", "pressure")
    V_flow: Variable = flow("m3/s", "volume flow")


class Tank(Component):
    """A third party's part."""

    port = Port("bottom")
    p_tank: Parameter = param("Pa", "pressure", default=1e5)

    def equations(self) -> Equations:
        yield self.port.p == self.p_tank  # tank


class TwoTanks(Component):
    """Two tanks at one pipe."""

    def build(self) -> None:
        self.a, self.b = Tank(), Tank()

    def equations(self) -> Equations:
        yield connect(self.a.port, self.b.port)


class Pumped(TwoTanks):
    """A tank joined to a shaft."""

    def build(self) -> None:
        super().build()
        self.rotor = Inertia(J=1.0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield connect(self.a.port, self.rotor.flange_a)  # pumped


CASES: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    "a circuit without ground": (
        Overdetermined,
        lambda: build(loads(CIRCUIT, "circuit.toml")),
        """\
The network of u, r has no Ground.
  in circuit.toml:3 `u = { is = "ConstantVoltage", V = "10 V" }`
  in circuit.toml:4 `r = { is = "Resistor", R = "1 Ohm" }`
Every voltage in it is relative to another one; none is zero.
Connect a part that is = "Ground" to it.""",
    ),
    "a drive on a circuit without ground": (
        Overdetermined,
        lambda: build(loads(ON_SUPPLY, "drive.toml")),
        """\
The network of pack, motor has no Ground.
  in drive.toml:3 `pack = { is = "ConstantVoltage", V = "48 V" }`
  in drive.toml:4 `motor = { is = "MappedDrive", limit = [[0, 10]], tau_ref = 1, Jr = 0.1 }`
Every voltage in it is relative to another one; none is zero.
Connect a part that is = "Ground" to it.""",
    ),
    "two voltages between the same pins": (
        Overdetermined,
        lambda: build(
            loads(
                CIRCUIT.replace("[connect]", 'g = { is = "Ground" }\nv = { is = "ConstantVoltage", V = 1 }\n[connect]')
                .replace('"r.p"]', '"r.p", "v.p"]')
                .replace('"r.n"]', '"r.n", "v.n", "g.p"]')
            )
        ),
        """\
u, v, g fix the same voltage or current more than once.
  in analog.py:{analog.py:yield self.v == self.V} `yield self.v == self.V`
  in analog.py:{analog.py:yield self.p.v == 0} `yield self.p.v == 0`
Two parts prescribe it, or rigid parts form a loop.
Remove one, or put a resistor between.""",
    ),
    "words of a third party's domain": (
        Overdetermined,
        lambda: build(TwoTanks()),
        """\
b, a fix the same pressure or volume flow more than once.
  in test_told_by_what_users_wrote.py:{tank} `yield self.port.p == self.p_tank`
Two parts prescribe it, or rigid parts form a loop.
Remove one, or put a throttle between.""",
    ),
    "a ratio of zero": (
        SingularAtStart,
        lambda: simulate(loads(GEARED)),
        """\
The Jacobian is singular at t = 0 s in block 1 (fast.flange_b.tau, gear.flange_b.tau, der(slow.w), der(fast.w)).
  in inertias.py:{inertias.py:yield self.J * der(self.w) == a.tau + b.tau} `yield self.J * der(self.w) == a.tau + b.tau`
  in ideal_gears.py:{ideal_gears.py:yield self.ratio * a.tau + b.tau == 0} `yield self.ratio * a.tau + b.tau == 0`
  in ideal_gears.py:{ideal_gears.py:yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)} `yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)`
gear.ratio is zero, so these unknowns are undetermined.
Give it another value.""",  # noqa: E501
    ),
    "an equation drives an input": (
        ComponentUnbalanced,
        lambda: build(Driven()),
        """\
Driven declares 1 equation for no unknowns of its own.
  in test_told_by_what_users_wrote.py:{driven} `yield self.motor.tau == 3 - self.rotor.w`
motor.tau is an input of a part: inputs are connected, not set by equations. Declare an output in Driven, and yield connect(self.…, self.motor.tau).""",  # noqa: E501
    ),
    "a free connector in a netlist": (
        FreeFlange,
        lambda: build(loads('[parts]\nstop = { is = "Fixed" }\n', "bench.toml")),
        """\
stop.flange is free, so stop (Fixed) carries no torque.
  in bench.toml:2 `stop = { is = "Fixed" }`
Connect it, or list it: free = ["stop.flange"].""",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_message(check_message, name: str) -> None:
    check_message(*CASES[name])


def test_what_goes_between_two_kinds_is_declared_by_them() -> None:
    with pytest.raises(
        ModelicaLikeError, match=r"a Port \(Pa, m3/s\) cannot join a Flange \(rad, N\.m\)\. A pump goes"
    ):
        build(Pumped())
    assert Pin.domain.reference == "Ground"


@pytest.mark.parametrize(
    ("written", "meant"), [("kgm2", "kg.m2"), ("Nm/rad", "N.m/rad"), ("Nms/rad", "N.m.s/rad"), ("J/kgK", "kg.K")]
)
def test_a_unit_without_its_dots_is_suggested_whole(written: str, meant: str) -> None:
    with pytest.raises(UnitError, match=rf"did you mean '.*{meant}'\?"):
        parse_unit(written)


@pytest.fixture
def grip(tmp_path: Path) -> str:
    (tmp_path / "grip.toml").write_text(GRIP)
    return str(tmp_path / "grip.toml")


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ("rotor.j=3", "Inertia has no parameter or variable 'j'; did you mean 'J'? It has J, phi, w."),
        ("rotr.J=3", "grip has no part 'rotr'; did you mean 'rotor'? It has push, rotor, grip."),
        ("rotor.J=3 kgm2", "Inertia.J = '3 kgm2': Unknown unit 'kgm' in 'kgm2'; did you mean 'kg.m2'?"),
        ("rotor.J=3*K", "rotor.J: grip has no parameter 'K'. It has J."),
    ],
)
def test_what_is_set_on_the_command_line_is_named_there(grip: str, given: str, what: str) -> None:
    result = called(["check", grip, "--set", given])
    assert result.exit_code == 2
    assert result.stderr.splitlines()[:2] == [what, f"  in --set `{given}`"]


def test_events_are_told_in_words_and_their_lines_with_debug(grip: str) -> None:
    plain = called(["simulate", grip, "--no-energy"]).stdout
    table = [line.split(maxsplit=4) for line in plain.splitlines()]
    assert [[*row[1:4], row[4].strip()] for row in table if "grip.mode" in row] == [
        ["grip.mode", "forward", "stuck", "slip reached zero"]
    ]
    assert "friction.py" not in plain
    debug = called(["simulate", grip, "--no-energy", "--debug"]).stdout
    assert "slip reached zero" in debug
    assert "friction.py:" in debug


class Counter(Component):
    """Modes whose transitions say nothing, or are written in two steps."""

    mode = Mode("low", "high", "over")
    x: Variable = var("s", "rising")
    limit: Parameter = param("s", "bound", default=0.5)
    late: Parameter = param("s", "time", default=0.9)

    def equations(self) -> Equations:
        yield der(self.x) == 1

    def events(self) -> Events:
        yield self.mode.go("low", "high", when=self.x > self.limit)
        there = self.mode.go("high", "over", when=self.x > 2 * self.limit)
        yield there
        yield self.mode.go("over", "low", at=self.late)
        yield self.mode.go("low", "over", when=all_of(negate(-self.x >= -self.late), self.mode.is_("low")))
        yield self.mode.go("high", "over", when=tanh(self.x / self.limit) > where(self.x > self.late, 1, 0))
        yield self.mode.go("high", "low", when=absolute(self.x) < self.limit, because="is back below {limit}")


def test_a_condition_without_words_is_put_into_words() -> None:
    transitions = build(Counter(x=0.0)).events.transitions
    assert [one.because for one in transitions] == [
        "rising x rose above {limit}",
        "rising x rose above 2*limit",
        "its time is reached",
        "rising x rose above {late} and mode is low",
        "its condition on x holds",
        "is back below {limit}",
    ]


def test_parameters_in_a_reason_have_their_values() -> None:
    run = simulate(Counter(x=0.0, limit="400 ms"), 0.45)
    assert reasons(run) == ["rising x rose above limit = 0.4 s", "its condition on x holds"]


class Misspelt(Counter):
    """A reason that names what is no parameter."""

    def events(self) -> Events:
        yield self.mode.go("low", "high", when=self.x > self.limit, because="beyond {limt}")


def test_a_reason_names_parameters_only() -> None:
    with pytest.raises(LanguageError, match=r"names limt, which is not a parameter; did you mean 'limit'\?"):
        build(Misspelt(x=0.0))


def test_brackets_in_paths_are_no_markup(grip: str, tmp_path: Path) -> None:
    picture = tmp_path / "[bold]grip[/x].svg".replace("/", "_")
    result = called(["draw", grip, "-o", str(picture)])
    assert (result.exit_code, result.stdout) == (0, f"{picture}\n")
    result = called(["check", str(tmp_path / "[red]none.toml")])
    assert "[red]none.toml' does not exist" in result.stderr


def test_brackets_in_help_are_no_markup() -> None:
    text = " ".join(called(["split", "--help"]).stdout.replace("│", " ").split())
    assert "or a name in [connect]." in text


@pytest.mark.parametrize("command", ["simulate", "check", "compare"])
def test_an_unknown_value_of_an_option_is_placed_there(command: str, grip: str) -> None:
    result = called([command, grip, *[grip] * (command == "compare"), "--set", "rotor.q=4"])
    assert (result.exit_code, result.stderr) == (
        2,
        """Inertia has no parameter or variable 'q'. It has J, phi, w.
  in --set `rotor.q=4`
""",
    )
