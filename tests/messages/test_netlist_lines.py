"""What is wrong with a netlist is told with its own lines, and with what to write instead."""

from collections.abc import Callable

import pytest

from modelica_like import simulate
from modelica_like.errors import (
    ContradictingStart,
    ModelicaLikeError,
    NetlistError,
    UnitError,
    UnknownName,
    ValueOutOfRange,
    WrongConnection,
)
from modelica_like.netlist import loads

TEXT = """name = "d"
[parameters]
z = 0
T = "10 N.m"
[parts]
m = { is = "ConstantTorque", tau_constant = "T" }
a = { is = "Inertia", J = "0.1 kg.m2" }
s = { is = "SpringDamper", c = "1000 N.m/rad", d = 1 }
b = { is = "Inertia", J = "0.2 kg.m2", w = 0 }
[series]
x = ["m", "a", "s", "b"]
[start]
"a.w" = "0 rpm"
"s.phi_rel" = 0
"b.phi" = 0
[simulate]
until = "0.1 s"
"""
SERIES, TORQUE = '"m", "a", "s", "b"', '"10 N.m"'
CASES: dict[str, tuple[type[ModelicaLikeError], tuple[str, str], str]] = {
    "kNm": (UnitError, ('"0.1 kg.m2"', '"2 kNm"'), """\
Inertia.J = '2 kNm': Unknown unit 'kNm'; did you mean 'kN.m'?
  in d.toml:7 `a = { is = "Inertia", J = "2 kNm" }`"""),
    "mNms": (UnitError, ('"0.1 kg.m2"', '"2 mNms"'), """\
Inertia.J = '2 mNms': Unknown unit 'mNms'; did you mean 'mN.m.s'?
  in d.toml:7 `a = { is = "Inertia", J = "2 mNms" }`"""),
    "kNm/rad": (UnitError, ('"1000 N.m/rad"', '"1 kNm/rad"'), """\
SpringDamper.c = '1 kNm/rad': Unknown unit 'kNm' in 'kNm/rad'; did you mean 'kN.m/rad'?
  in d.toml:8 `s = { is = "SpringDamper", c = "1 kNm/rad", d = 1 }`"""),
    "kNm in a formula": (NetlistError, (TORQUE, '"2*(3 kNm)"'), """\
'2*(3 kNm)' is neither a quantity nor a formula; unknown unit 'kNm'; did you mean 'kN.m'.
  in d.toml:4 `T = "2*(3 kNm)"`
A quantity is a number with a unit ("8.5 kg.cm2"), a formula is arithmetic of parameters ("2*J")."""),
    "a quantity over a parameter": (UnitError, (TORQUE, '"10 N.m/z"'), """\
d.T = '10 N.m/z': Unknown unit 'z' in 'N.m/z'; did you mean 'N.m/Hz'?
  in d.toml:4 `T = "10 N.m/z"`
In a formula, a quantity that goes on with / or * is in brackets: "(10 N.m)/z"."""),
    "a quantity over numbers": (UnitError, (TORQUE, '"8 N.m/2/2"'), """\
d.T = '8 N.m/2/2': 'N.m/2/2' is not a unit.
  in d.toml:4 `T = "8 N.m/2/2"`
In a formula, a quantity that goes on with / or * is in brackets: "(8 N.m)/2/2"."""),
    "a quantity over a quantity": (NetlistError, (TORQUE, '"T*1 s/(1 s)"'), """\
'T*1 s/(1 s)' is neither a quantity nor a formula.
  in d.toml:4 `T = "T*1 s/(1 s)"`
In a formula, a quantity that goes on with / or * is in brackets: "T*(1 s)/(1 s)"."""),
    "no such connector in a series": (UnknownName, (SERIES, '"m", "a.flange_c", "s", "b"'), """\
a (Inertia) has no connector 'flange_c'; did you mean 'flange_b'? It has flange_a, flange_b.
  in d.toml:11 `x = ["m", "a.flange_c", "s", "b"]`"""),
    "no such part in a series": (UnknownName, (SERIES, '"m", "aa", "s", "b"'), """\
d has no part 'aa'; did you mean 'a'? It has m, a, s, b.
  in d.toml:11 `x = ["m", "aa", "s", "b"]`"""),
    "a part twice in a row": (WrongConnection, (SERIES, '"m", "a", "a", "s", "b"'), """\
a follows itself in a series.
  in d.toml:11 `x = ["m", "a", "a", "s", "b"]`
Its outlet would be joined to its own inlet.
Name it once. Several equal parts are an array: count = 2."""),
    "start values that contradict each other": (
        ContradictingStart, ('"b.phi" = 0', '"b.phi" = 0\n"s.w_rel" = "3 rad/s"'), """\
a.w = 0 and s.w_rel = 3 and b.w = 0 contradict each other: b.w would be 3.
  in d.toml:13 `"a.w" = "0 rpm"`
  in d.toml:16 `"s.w_rel" = "3 rad/s"`
  in d.toml:9 `b = { is = "Inertia", J = "0.2 kg.m2", w = 0 }`
Remove one of the start values, or make one a guess."""),
    "a parameter that is not finite": (ValueOutOfRange, (TORQUE, '"1/z*10 N.m"'), """\
T must be a finite number, not inf.
  in d.toml:4 `T = "1/z*10 N.m"`"""),
    "a parameter of a part that is out of range": (ValueOutOfRange, ('"0.1 kg.m2"', '"(z - 1)*1 kg.m2"'), """\
a.J = -1 is out of range: it must be at least 0 kg.m2.
  in d.toml:7 `a = { is = "Inertia", J = "(z - 1)*1 kg.m2" }`"""),
    "an inertia of zero, which has no speed of its own": (ContradictingStart, ('"0.1 kg.m2"', "0"), """\
a.w = 0 and s.phi_rel = 0 and b.w = 0 contradict each other: b.w would be -10.
  in d.toml:13 `"a.w" = "0 rpm"`
  in d.toml:14 `"s.phi_rel" = 0`
  in d.toml:9 `b = { is = "Inertia", J = "0.2 kg.m2", w = 0 }`
Remove one of the start values, or make one a guess."""),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "wrong", "text"), CASES.values(), ids=CASES.keys())
def test_message(
    kind: type[ModelicaLikeError], wrong: tuple[str, str], text: str, check_message: Callable[..., None]
) -> None:
    assert TEXT.count(wrong[0]) == 1
    check_message(kind, lambda: simulate(loads(TEXT.replace(*wrong), file="d.toml")), text)


def test_two_start_values_of_one_motion(check_message: Callable[..., None]) -> None:
    text = '[parts]\none = { is = "Inertia", J = 1, phi = 0 }\ntwo = { is = "Inertia", J = 1 }\n'
    text += '[series]\nx = ["one", "two"]\n[start]\n"one.w" = 1\n"two.w" = 2\n[simulate]\nuntil = 1\n'
    told = """\
one.w = 1 and two.w = 2 contradict each other: they are the same motion.
  in d.toml:7 `"one.w" = 1`
  in d.toml:8 `"two.w" = 2`
Remove one of the two start values."""
    check_message(ContradictingStart, lambda: simulate(loads(text, file="d.toml")), told)


def test_a_ring_of_parts_is_no_part_that_follows_itself() -> None:
    circuit = '[parts]\nv = { is = "ConstantVoltage", V = 10 }\nr = { is = "Resistor", R = 5 }\ng = { is = "Ground" }\n'
    circuit += '[series]\nring = ["v", "r", "v"]\n[connect]\nzero = ["v.n", "g.p"]\n[simulate]\nuntil = 1\n'
    assert abs(simulate(loads(circuit)).final["r.i"]) == pytest.approx(2.0, rel=1e-12)
