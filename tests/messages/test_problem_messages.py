"""Several mistakes of one netlist, told at once."""

from collections.abc import Callable
from pathlib import Path

import pytest

from modelica_like.errors import ModelicaLikeError, WiringErrors
from modelica_like.netlist import load
from modelica_like.netlist.further import thoroughly
from modelica_like.netlist.read import load_thoroughly
from modelica_like.simulation import build

Check = Callable[[type[ModelicaLikeError], Callable[[], object], str], None]
FIVE = """
[parts]
wheel = { is = "Inertja", J = "2 kg.m2" }
rotor = { is = "Inertia", J = "2 kg.m" }
shaft = { is = "SpringDamper", c = "9 N.m/rad", d = 1, k = 3 }
load = { is = "Inertia" }
[series]
drive = ["wheel", "shaft", "lode"]
"""
READ = """\
There is no component type 'Inertja'; did you mean 'Inertia'?
  in bad.toml:3 `wheel = { is = "Inertja", J = "2 kg.m2" }`
`modelica-like library` lists all types.

Inertia.J expects kg.m2; '2 kg.m' is kg.m.
  in bad.toml:4 `rotor = { is = "Inertia", J = "2 kg.m" }`

SpringDamper has no parameter or variable 'k'. It has phi_rel, tau, w_rel, c, d, phi_rel0.
  in bad.toml:5 `shaft = { is = "SpringDamper", c = "9 N.m/rad", d = 1, k = 3 }`"""
BEYOND = """\


bad has no part 'lode'; did you mean 'load'? It has rotor, shaft, load.
  in bad.toml:8 `drive = ["wheel", "shaft", "lode"]`

load.J (Inertia) has no value.
  in bad.toml:6 `load = { is = "Inertia" }`
Give it one: J = …"""


@pytest.fixture
def bad(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    monkeypatch.chdir(tmp_path)

    def write(text: str) -> Path:
        Path("bad.toml").write_text(text, encoding="utf-8")
        return Path("bad.toml")

    return write


def test_a_netlist_is_read_on_after_a_mistake(bad: Callable[[str], Path], check_message: Check):
    file = bad(FIVE)
    check_message(WiringErrors, lambda: load(file), READ)
    check_message(WiringErrors, lambda: load_thoroughly(file), READ + BEYOND)


def test_what_follows_from_a_mistake_is_not_told(bad: Callable[[str], Path]):
    # Without the motor the shaft is free, without `d` it has no damping, and the start names a part that is not there.
    file = bad("""
[parts]
motor = { is = "Torq", tau = 1 }
shaft = { is = "SpringDamper", c = 1, dd = 1 }
rotor = { is = "Inertia", J = 1 }
[series]
drive = ["motor", "shaft", "rotor"]
[connect]
end = ["motor.support", "shaft.flange_a"]
[start]
"motor.phi" = 0
[expose]
out = "motor.flange"
""")
    with pytest.raises(WiringErrors) as caught:
        load_thoroughly(file)
    assert [error.word for error in caught.value.problems()] == ["Torq", "dd"]


def test_a_mistake_of_the_form_and_others(bad: Callable[[str], Path], check_message: Check):
    text = (
        '[parts]\na = { is = "Inertia", J = 1, K = 2 }\na2 = 3\n[simulate]\nuntil = "2 m"\n[start]\nb.w = 0\na.v = 0\n'
    )
    check_message(WiringErrors, lambda: load(bad(text)), """\
parts.a2 must be a table: { is = "Inertia", J = "1 kg.m2" }.
  in bad.toml:3 `a2 = 3`

simulate.until expects s; '2 m' is m.
  in bad.toml:5 `until = "2 m"`

Inertia has no parameter or variable 'K'. It has J, phi, w.
  in bad.toml:2 `a = { is = "Inertia", J = 1, K = 2 }`

bad has no part 'b'. It has a.
  in bad.toml:7 `b.w = 0`

Inertia has no parameter or variable 'v'. It has J, phi, w.
  in bad.toml:8 `a.v = 0`""")  # fmt: skip


def test_values_are_missing_and_a_connection_is_wrong(bad: Callable[[str], Path], check_message: Check):
    file = bad("""
[parts]
a = { is = "Inertia" }
b = { is = "SpringDamper", c = 1 }
[series]
x = ["a", "b", "c"]
""")

    def check() -> None:
        drive = load_thoroughly(file)
        with thoroughly(drive):
            build(drive)

    check_message(WiringErrors, check, """\
bad has no part 'c'. It has a, b.
  in bad.toml:6 `x = ["a", "b", "c"]`

a.J (Inertia) has no value.
  in bad.toml:3 `a = { is = "Inertia" }`
Give it one: J = …

b.d (SpringDamper) has no value.
  in bad.toml:4 `b = { is = "SpringDamper", c = 1 }`
Give it one: d = …""")  # fmt: skip


def test_reading_ends_after_a_hundred_errors(bad: Callable[[str], Path]):
    text = "[parts]\n" + "".join(f'p{k} = {{ is = "Nothing{k}" }}\n' for k in range(150))
    with pytest.raises(WiringErrors) as caught:
        load(bad(text))
    assert len(caught.value.errors) == 101
    assert str(caught.value.errors[-1]) == "After 100 errors, the netlist is not read on."
