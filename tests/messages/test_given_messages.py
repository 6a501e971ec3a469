"""What is given to a model that exists: parameters, parts and inputs by name."""

from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, cast

import pytest

from components import Fixed
from components.interfaces import Flange
from modelica_like import Component, build, simulate
from modelica_like.errors import (
    DuplicateName,
    FreeFlange,
    LanguageError,
    ModelicaLikeError,
    Overdetermined,
    UnitError,
    UnknownName,
    ValueOutOfRange,
    WiringErrors,
)
from modelica_like.language import element
from modelica_like.language.expr import TIME
from modelica_like.netlist import loads

BRAKE = """[parts]
disc = { is = "Inertia", J = 1, w = 10 }
eddy = { is = "EddyCurrentTorque", tau_nominal = 10, w_nominal = 100 }
frame = { is = "Fixed" }
[series]
shaft = ["disc", "eddy", "frame"]
"""


class Ends(Component):
    """What authors try for several ends."""

    def build(self) -> None:
        self.ends = [Flange(), Flange()]  # connectors


class Parts(Component):
    """What authors try for several parts."""

    def build(self) -> None:
        self.ends = [("a", Fixed())]  # tuples


class Grid(Component):
    """What authors try for rows of rows."""

    def build(self) -> None:
        self.ends = [[Fixed()], [Fixed()]]  # lists


def in_a_class() -> object:
    class Row(Component):
        ends = [Flange(), Flange()]

    return Row


MACHINE = """[parts]
J = { is = "Inertia", J = 1 }
m = { is = "PermanentMagnetDCMachine" }
[series]
shaft = ["J", "m"]
"""
PUSHED = """name = "pushed"
[parts]
push = { is = "Force" }
mass = { is = "Mass", m = 2, s = 0, v = 0 }
[connect]
end = ["push.flange", "mass.flange_a"]
"""
FED = PUSHED.replace("[connect]", 'one = { is = "Constant", k = 1 }\n[connect]\nf = ["one.y", "push.f"]')


def no_time() -> Path:
    path = Path(mkdtemp()) / "force.csv"
    path.write_text("t,push.f\n0,1\n")
    return path


LOOSE = """[parts]
m = { is = "Torque", tau = 1 }
g = { is = "IdealGear", ratio = 2 }
load = { is = "Inertia", J = 1 }
[series]
x = ["m", "g"]
"""
TWICE = """[parts]
a = { is = "Fixed" }
b = { is = "Fixed" }
[connect]
x = ["a.flange", "b.flange"]
"""
METER = """[parts]
v = { is = "ConstantVoltage", V = 1 }
meter = { is = "VoltageSensor" }
[series]
circuit = ["v", "meter"]
"""
SIGNAL = """[parts]
k = { is = "Constant", k = 1 }
J = { is = "Inertia", J = 1 }
[series]
shaft = ["k", "J"]
"""
WRONG: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    "a former name": (UnknownName, lambda: build(loads(BRAKE)).with_parameters({"eddy.alpha": 0.004}), """\
netlist has no parameter 'eddy.alpha'.
Write alpha20, with the same value."""),
    "a list of tuples as a drive": (LanguageError, lambda: build(cast(Any, [("a", Fixed())])), """\
Something of type list is no drive: write a component, a built model, or a netlist's path.
Parts become a drive as Assembly(parts={"motor": …, "load": …}, series={"shaft": ["motor", "load"]})."""),
    "an element of no list": (LanguageError, lambda: element([], 0.0), """\
element takes a list of numbers, at least one.
Of expressions, `where` chooses one; of a table over a variable, `interpolate` is the value."""),
    "an element of expressions": (LanguageError, lambda: element([1.0, cast(Any, TIME)], 0.0), """\
element takes a list of numbers, at least one.
Of expressions, `where` chooses one; of a table over a variable, `interpolate` is the value."""),
    "a class as a drive": (LanguageError, lambda: build(cast(Any, Fixed)), """\
Fixed is a class, not a drive.
Create one: Fixed(…)."""),
    "a list of connectors": (LanguageError, Ends, """\
Ends.ends is a list that is no array of parts: it has Flange.
  in test_given_messages.py:{connectors} `self.ends`
Give each a name of its own: flange_1 and flange_2; where their number varies, by setattr in `build`."""),
    "a list of tuples of parts": (LanguageError, Parts, """\
Parts.ends is a list that is no array of parts: it has tuple.
  in test_given_messages.py:{tuples} `self.ends`
An array is a list of parts only: [Inertia(J=1), Inertia(J=2)]; other parts have names of their own."""),
    "a list of lists of parts": (LanguageError, Grid, """\
Grid.ends is a list that is no array of parts: it has list.
  in test_given_messages.py:{lists} `self.ends`
An array is a list of parts only: [Inertia(J=1), Inertia(J=2)]; other parts have names of their own."""),
    "a list of connectors in a class": (LanguageError, in_a_class, """\
Row.ends is a list that is no array of parts: it has Flange.
Give each a name of its own: flange_1 and flange_2; where their number varies, by setattr in `build`."""),
    "a machine in a series": (WiringErrors, lambda: build(loads(MACHINE)), """\
connect(J.flange_b, m.ap): a Flange (rad, N.m) cannot join a Pin (V, A). Join connectors of one kind.
  in netlist.toml:5 `shaft = ["J", "m"]`
To join them, write in [connect]: joint = ["J.flange_b", "m.flange"]

m.flange is free, so m (PermanentMagnetDCMachine) carries no torque.
  in netlist.toml:3 `m = { is = "PermanentMagnetDCMachine" }`
Connect it, or list it: free = ["m.flange"].

m.an is free, so m (PermanentMagnetDCMachine) carries no current.
  in netlist.toml:3 `m = { is = "PermanentMagnetDCMachine" }`
Connect it, or list it: free = ["m.an"]."""),
    "a free end that fits one other": (FreeFlange, lambda: build(loads(LOOSE)), """\
g.flange_b is free, so g (IdealGear) carries no torque.
  in netlist.toml:3 `g = { is = "IdealGear", ratio = 2 }`
Connect it to load.flange_a, or list it: free = ["g.flange_b"]."""),
    "two speeds in a netlist": (Overdetermined, lambda: build(loads(TWICE)), """\
b, a fix the same motion or torque more than once.
  in netlist.toml:3 `b = { is = "Fixed" }`
  in netlist.toml:2 `a = { is = "Fixed" }`
  in fixed.py:{fixed.py:yield self.flange.phi == self.phi0} `yield self.flange.phi == self.phi0`
Two parts prescribe it, or rigid parts form a loop.
Remove one, or put a spring or clutch between."""),
    "a part without an inlet in a series": (UnknownName, lambda: build(loads(METER)), """\
meter (VoltageSensor) has no inlet 'flange_a or flange'. It has p, n.
  in netlist.toml:5 `circuit = ["v", "meter"]`
Join it in [connect], not in a series: joint = ["meter.n", …]"""),
    "a signal in a series": (UnknownName, lambda: build(loads(SIGNAL)), """\
k (Constant) has no outlet 'flange_b or flange'. It has none.
  in netlist.toml:5 `shaft = ["k", "J"]`
Join it in [connect], not in a series: joint = ["k.y", …]"""),
    "an input that does not exist": (UnknownName, lambda: simulate(loads(PUSHED), 1, inputs={"push.g": 3}), """\
pushed has no input 'push.g'; did you mean 'push.f'?"""),
    "times that do not rise": (
        ValueOutOfRange, lambda: simulate(loads(PUSHED), 1, inputs={"push.f": [(1, 2), (1, 3)]}), """\
The times of the input 'push.f' do not rise.
For a jump, write two times close to each other."""),
    "an input that is no trajectory": (
        LanguageError, lambda: simulate(loads(PUSHED), 1, inputs={"push.f": [1, 2, 3]}), """\
The input 'push.f' is given no trajectory.
Give pairs of time in s and value, arrays (times, values), {"time": …, "path": …}, a pandas table, or a CSV file."""),
    "inputs without names": (LanguageError, lambda: simulate(loads(PUSHED), 1, inputs=[1, 2]), """\
Something of type list is no trajectory of inputs.
Give pairs of time in s and value, arrays (times, values), {"time": …, "path": …}, a pandas table, or a CSV file."""),
    "a table without time": (LanguageError, lambda: simulate(loads(PUSHED), 1, inputs=no_time()), """\
'force.csv' has no column `time`.
Give pairs of time in s and value, arrays (times, values), {"time": …, "path": …}, a pandas table, or a CSV file."""),
    "more times than values": (
        ValueOutOfRange, lambda: simulate(loads(PUSHED), 1, inputs={"time": [0, 1], "push.f": [1]}), """\
The input 'push.f' has 2 times and 1 values."""),
    "times that are texts": (
        LanguageError, lambda: simulate(loads(PUSHED), 1, inputs={"time": ["a"], "push.f": [1]}), """\
The times of 'push.f' are no numbers in s.
Give pairs of time in s and value, arrays (times, values), {"time": …, "path": …}, a pandas table, or a CSV file."""),
    "an input twice": (
        DuplicateName, lambda: simulate(loads(PUSHED), 1, inputs={"push.f [kN]": 1, "push.f [N]": 1}), """\
Two trajectories are given for 'push.f'.
Leave one of them out."""),
    "an input with another unit": (UnitError, lambda: simulate(loads(PUSHED), 1, inputs={"push.f [m]": [(0, 1)]}), """\
push.f expects N; '1.0 m' is m."""),
    "an input that is connected": (LanguageError, lambda: simulate(loads(FED), 1, inputs={"push.f": 3}), """\
The input 'push.f' is connected already.
Inputs over time are for open inputs of parts."""),
    "inputs of a compiled model": (
        LanguageError, lambda: simulate(build(loads(FED)), 1, inputs={"push.f": 3}), """\
What has been compiled keeps its inputs during a run.
Give inputs over time with the component, or with its netlist."""),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "make", "text"), WRONG.values(), ids=WRONG.keys())
def test_message(
    kind: type[ModelicaLikeError], make: Callable[[], object], text: str, check_message: Callable[..., None]
) -> None:
    check_message(kind, make, text)
