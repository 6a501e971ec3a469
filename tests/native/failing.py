"""Small drives that fail, for the errors of the run-time in C."""

from components import (
    BearingFriction,
    Clutch,
    ConstantTorque,
    ConstantVoltage,
    Ground,
    IdealSwitch,
    Inductor,
    Inertia,
    Pulse,
    Resistor,
)
from modelica_like import Assembly, build
from modelica_like.language import (
    TIME,
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    absolute,
    clock,
    delay,
    der,
    discrete,
    floor,
    integer,
    maximum,
    param,
    pre,
    sqrt,
    terminate,
    var,
    when,
    where,
)

TABLE = ((0, 1), (2, 3))


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


class Running(Basis):
    """Nothing stops it."""

    def equations(self) -> Equations:
        yield der(self.x) == 1 + self.x**2


class Implicit(Basis):
    z: Variable = var("1", "root")

    def equations(self) -> Equations:
        yield der(self.x) == -self.z
        yield self.a * (self.z**3 + self.z) == self.x


class Marked(Basis):
    n: Discrete = discrete("1", "mark")

    def equations(self) -> Equations:
        yield der(self.x) == -self.x

    def events(self) -> Events:
        yield when(self.x < 0.5, {self.n: 1})


class Ending(Basis):
    def equations(self) -> Equations:
        yield der(self.x) == self.a

    def events(self) -> Events:
        yield when(self.x > 1, terminate("is there"))


class Kinked(Basis):
    """v rests at the kink of the rate of x, and a moves it away."""

    v: Variable = var("1", "rate", default=0.0)

    def equations(self) -> Equations:
        yield der(self.v) == self.a - 1 - self.v
        yield der(self.x) == maximum(self.v, 0)


class Silent(Basis):
    """The rate jumps at x = 0.5 without an event."""

    def equations(self) -> Equations:
        yield der(self.x) == self.a + where(self.x < 0.5, 0.0, 1.0, events=False)


class Rooted(Basis):
    """The root of a distance, which has no slope where that is zero."""

    y: Variable = var("1", "integral", default=0.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.a
        yield der(self.y) == sqrt(absolute(self.x - 0.5))


class Touching(Basis):
    """The condition jumps, so nothing tells how its instant moves."""

    n: Discrete = discrete("1", "mark")

    def equations(self) -> Equations:
        yield der(self.x) == self.a * (1 + self.n)

    def events(self) -> Events:
        yield when(floor(self.x) > 0.5, {self.n: 1})


class Meeting(Basis):
    """A clock ticks just when x reaches 1."""

    n: Discrete = discrete("1", "mark")
    ticks: Discrete = discrete("1", "number of ticks")

    def equations(self) -> Equations:
        yield der(self.x) == self.a * (1 + self.n) + self.ticks

    def events(self) -> Events:
        yield when(self.x > 1, {self.n: 1})
        yield when(clock(1.0, 1.0), {self.ticks: pre(self.ticks) + 1})


def rubbing() -> Assembly:
    parts = {"torque": ConstantTorque(tau_constant=0.0), "J": Inertia(J=1.0, phi=0.0),
             "bearing": BearingFriction(tau_pos=((0, 3), (1, 3)))}  # fmt: skip
    return Assembly("rubbing", parts=parts, series={"shaft": [*parts]})


class Sampling(Basis):
    """At rest at x = 1 while nothing is sampled, and nowhere near it after a tick."""

    last: Discrete = discrete("1", "sample of the state")

    def equations(self) -> Equations:
        yield der(self.x) == 1 - self.x - 2 * self.last

    def events(self) -> Events:
        yield when(clock(0.1), {self.last: self.x})


class Given(Basis):
    """y is prescribed, and yet gets a value."""

    y: Variable = var("1", "prescribed")

    def equations(self) -> Equations:
        yield der(self.x) == -1
        yield self.y == 2 * self.a

    def events(self) -> Events:
        yield when(self.x < 0.5, {self.y: 1})


class GivenTwice(Basis):
    """Two conditions that come true together give x a value."""

    m = Mode("a", "b")
    n = Mode("a", "b")

    def equations(self) -> Equations:
        yield der(self.x) == -1

    def events(self) -> Events:
        yield self.m.go("a", "b", when=self.x < 0.5, reset={self.x: 2})
        yield self.n.go("a", "b", when=self.x < 0.5, reset={self.x: 3})


def gradient(drive, of, by, do=lambda _: None):
    handle = build(drive).native(outputs=[of], by=[by])
    handle.reset(until=10.0)
    do(handle)
    return handle.gradient()


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


def leaving() -> Assembly:
    return coasting(tau_pos=TABLE, extrapolate="error")


def clutched() -> Assembly:
    """At equal speeds the clutch sticks, at all others it slides."""
    return shaft(("clutch", Clutch(capacity=5.0)), second={"w": 1.0})
