"""Every way in which a netlist can be wrong, and the sentence that tells it."""

from pathlib import Path

import pytest

from components import Inertia
from modelica_like import simulate
from modelica_like.errors import ModelicaLikeError, NetlistError
from modelica_like.language import Assembly
from modelica_like.netlist import load

MESSAGES = {
    "unknown type": (
        '[parts]\nk = { is = "Cluch" }\n',
        "There is no component type 'Cluch'; did you mean 'Clutch'?\n"
        '  in bad.toml:2 `k = { is = "Cluch" }`\n'
        "`modelica-like library` lists all types.",
    ),
    "class of a module with a dot": (
        '[parts]\nk = { is = "mine.Hub" }\n',
        "There is no component type 'mine.Hub'.\n"
        '  in bad.toml:2 `k = { is = "mine.Hub" }`\n'
        "`modelica-like library` lists all types. A class of a module is written 'mine:Hub'.",
    ),
    "unknown parameter": (
        '[parts]\nm = { is = "Mass", n = 3 }\n',
        "Mass has no parameter or variable 'n'. It has m, angle, g, s, v, L.\n"
        '  in bad.toml:2 `m = { is = "Mass", n = 3 }`',
    ),
    "former name of a parameter": (
        '[parts]\nm = { is = "SeriesDCMachine", alpha = 0.0038 }\n',
        "SeriesDCMachine has no parameter or variable 'alpha' any more.\n"
        '  in bad.toml:2 `m = { is = "SeriesDCMachine", alpha = 0.0038 }`\n'
        "Write alpha20 = alpha/(1 - alpha*(T_ref - 293.15 K)): alpha was the coefficient at T_ref.",
    ),
    "former name of a part": (
        '[parts]\nm = { is = "PositionServo", servo.J = 1 }\n',
        "PositionServo has no part 'servo' any more.\n"
        '  in bad.toml:2 `m = { is = "PositionServo", servo.J = 1 }`\n'
        "Write its values and parts without 'servo.': J instead of servo.J.",
    ),
    "wrong unit": (
        '[parts]\nrotor = { is = "Inertia", J = "8.5 kg.cm" }\n',
        "Inertia.J expects kg.m2; '8.5 kg.cm' is kg.m.\n"
        '  in bad.toml:2 `rotor = { is = "Inertia", J = "8.5 kg.cm" }`',
    ),
    "parameter out of range": (
        '[parts]\nrotor = { is = "Inertia", J = -1 }\n',
        "Inertia.J = -1 is out of range: it must be at least 0 kg.m2.\n"
        '  in bad.toml:2 `rotor = { is = "Inertia", J = -1 }`',
    ),
    "nan": (
        '[parts]\nrotor = { is = "Inertia", J = nan }\n',
        'Inertia.J must be a finite number, not nan.\n  in bad.toml:2 `rotor = { is = "Inertia", J = nan }`',
    ),
    "duplicate name": (
        '[parts]\na = { is = "Inertia" }\na = { is = "Mass" }\n',
        "'a' in [parts] is declared twice.\n"
        '  in bad.toml:2 `a = { is = "Inertia" }`\n'
        '  in bad.toml:3 `a = { is = "Mass" }`',
    ),
    "part and parameter of one name": (
        '[parameters]\na = 1\n[parts]\na = { is = "Inertia" }\n',
        "'a' is both a parameter and a part.\n  in bad.toml:2 `a = 1`\n  in bad.toml:4 `a = { is = \"Inertia\" }`",
    ),
    "a value given twice": (
        '[parts]\na = { is = "Inertia", J = 1, J = 2 }\n',
        'J is given twice.\n  in bad.toml:2 `a = { is = "Inertia", J = 1, J = 2 }`',
    ),
    "unknown entry": (
        '[part]\na = { is = "Inertia" }\n',
        "A netlist has no entry 'part'; did you mean 'parts'? "
        "It has name, description, "
        "parameters, parts, series, connect, start, guess, free, expose, simulate, display, sizing, "
        "optimize, tolerances, modelica.\n"
        "  in bad.toml:1 `[part]`",
    ),
    "no type": (
        "[parts]\na = { J = 1 }\n",
        'parts.a has no type.\n  in bad.toml:2 `a = { J = 1 }`\nGive its type, such as is = "Inertia".',
    ),
    "no parts": ('name = "x"\n', "x has no parts.\n  in bad.toml\nDeclare them in [parts]."),
    "one end": (
        '[parts]\na = { is = "Inertia" }\n[connect]\nw = ["a.flange_a"]\n',
        'connect.w must name at least two ends.\n  in bad.toml:4 `w = ["a.flange_a"]`',
    ),
    "lists in a list": (
        '[parts]\na = { is = "Inertia" }\n[connect]\nw = [["a.flange_a", "a.flange_b"]]\n',
        'connect.w must be a list of names.\n  in bad.toml:4 `w = [["a.flange_a", "a.flange_b"]]`\n'
        "Write a separate entry for every list.",
    ),
    "start of a parameter": (
        '[parts]\na = { is = "Inertia", J = 1 }\n[start]\n"a.J" = 1\n',
        'a.J is a parameter, not a variable.\n  in bad.toml:4 `"a.J" = 1`\nGive its value where the part is declared.',
    ),
    "unknown start": (
        '[parts]\nrotor = { is = "Inertia", J = 1 }\n[start]\nroter.w = 1\n',
        "bad has no part 'roter'; did you mean 'rotor'? It has rotor.\n  in bad.toml:4 `roter.w = 1`",
    ),
    "time in metres": (
        '[parts]\na = { is = "Inertia", J = 1 }\n[simulate]\nuntil = "2 m"\n',
        "simulate.until expects s; '2 m' is m.\n  in bad.toml:4 `until = \"2 m\"`",
    ),
    "unknown option": (
        '[parts]\na = { is = "Inertia", J = 1 }\n[simulate]\nstop = 2\n',
        "[simulate] has no 'stop'. It has from, until, start, rtol, points, on_chattering.\n  in bad.toml:4 `stop = 2`",
    ),
    "not a formula": (
        '[parts]\na = { is = "Inertia", J = "2 *" }\n',
        "'2 *' is neither a quantity nor a formula.\n"
        '  in bad.toml:2 `a = { is = "Inertia", J = "2 *" }`\n'
        'A quantity is a number with a unit ("8.5 kg.cm2"), a formula is arithmetic of parameters ("2*J").',
    ),
    "a class that is no component": (
        '[parts]\na = { is = "os:system" }\n',
        "'os:system' is not a component class.\n  in bad.toml:2 `a = { is = \"os:system\" }`",
    ),
    "a module that is not there": (
        '[parts]\na = { is = "no_such_module:A" }\n',
        "There is no module 'no_such_module' beside the netlist, or in a folder above.\n"
        '  in bad.toml:2 `a = { is = "no_such_module:A" }`\n'
        "A module from elsewhere must be installed as a library.",
    ),
    "a netlist that is not there": (
        '[parts]\na = { is = "./bat.toml" }\n',
        "The netlist 'bat.toml' does not exist. Did you mean 'bad.toml'?\n"
        '  in bad.toml:2 `a = { is = "./bat.toml" }`',
    ),
    "itself": (
        '[parts]\na = { is = "./bad.toml" }\n',
        "A netlist contains itself: bad.toml contains bad.toml.\n"
        '  in bad.toml:2 `a = { is = "./bad.toml" }`\nRemove one of them.',
    ),
    "empty": ("", "'bad.toml' is empty.\n  in bad.toml\nA netlist has at least one part in [parts]."),
    "not TOML": (
        "[parts]\na is b\n",
        "'bad.toml' is not TOML: expected '=' after a key in a key/value pair.\n  in bad.toml:2 `a is b`",
    ),
    "an FMU": (
        b"PK\3\4\xff",
        """\
'bad.toml' is an archive, such as an FMU, and no netlist.
An FMU is run by run_fmu(…) in Python, and by `compare` and `report` on the command line.""",
    ),
    "not a text": (b"\x89PNG\n\xff", "'bad.toml' is not a text file (UTF-8).\n  in bad.toml:1"),
    "brackets": (
        "x = " + "[" * 1_000_000,
        "Brackets or keys are nested too deeply for a netlist.\n  in bad.toml:1",
    ),
    "too large": ("[" * 10_000_000, "'bad.toml' is larger than 2 MB, the limit for netlists.\n  in bad.toml"),
    "a parameter that no formula could name": (
        '[parameters]\n"J[1]" = 3\n[parts]\na = { is = "Inertia", J = 1 }\n',
        "bad: a parameter cannot be called 'J[1]'.\n  in bad.toml:2 `\"J[1]\" = 3`\n"
        "A name is a letter, then letters, digits and _.",
    ),
    "a parameter with the name of a constant": (
        '[parameters]\npi = 3\nval = "pi"\n[parts]\na = { is = "Inertia", J = "val" }\n',
        "bad: a parameter cannot be called 'pi'.\n"
        "  in bad.toml:2 `pi = 3`\n"
        "In a formula, pi is always 3.141593….\n"
        "Choose another name.",
    ),
    "two errors": (
        '[parts]\na = { is = "Inertia", J = -1 }\nb = { is = "Inertia", K = 1 }\n',
        "Inertia.J = -1 is out of range: it must be at least 0 kg.m2.\n"
        '  in bad.toml:2 `a = { is = "Inertia", J = -1 }`\n\n'
        "Inertia has no parameter or variable 'K'. It has J, phi, w.\n"
        '  in bad.toml:3 `b = { is = "Inertia", K = 1 }`',
    ),
}


@pytest.mark.parametrize(("text", "message"), MESSAGES.values(), ids=MESSAGES.keys())
def test_message(text: str | bytes, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ModelicaLikeError) as caught:
        load("bad.toml")
    assert str(caught.value) == message


def test_a_folder_and_a_missing_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ModelicaLikeError, match=r"^The netlist '\.' is a folder\.$"):
        load(".")
    with pytest.raises(ModelicaLikeError, match=r"^The netlist 'nowhere/x\.toml' does not exist\.$"):
        load("nowhere/x.toml")


def test_a_missing_table_of_inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In Python as on the command line."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(NetlistError) as caught:
        simulate(Assembly("drive", parts={"wheel": Inertia(J=1.0)}), "1 s", inputs="no.csv", start="rest")
    assert str(caught.value) == "no.csv: No such file or directory."
