"""What operations on netlists refuse, and the sentence that tells why."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from modelica_like.edit import Document, apply
from modelica_like.errors import (
    DuplicateName,
    ModelicaLikeError,
    NetlistError,
    UnitError,
    UnknownName,
    ValueOutOfRange,
    WrongConnection,
)

TEXT = """\
[parameters]
J = "2 kg.m2"
[parts]
motor = { is = "ConstantTorque", tau_constant = "5 N.m" }
rotor = { is = "Inertia", J = "J" }
sine = { is = "Sine", f = "1 Hz" }
brake = { is = "Brake", capacity = "20 N.m" }
row = [{ is = "Inertia", J = 1 }, { is = "Spring", c = 5 }]
three = { is = "Inertia", count = 3, J = "two.J" }
ramp = { is = "Ramp" }
[series]
drive = ["motor", "rotor", "brake"]
[connect]
pressed = ["sine.y", "brake.f_normalized"]
[expose]
out = "rotor.flange_b"
"""
CASES: dict[str, tuple[type[ModelicaLikeError], dict[str, Any], str]] = {
    "unknown operation": (
        UnknownName, {"op": "renam"},
        "There is no operation 'renam'; did you mean 'rename'? There are add, insert, connect, disconnect, remove, "
        "rename, replace, set, unset, duplicate, group.",
    ),
    "unknown argument": (
        UnknownName, {"op": "remove", "nam": "rotor"},
        "remove has no argument 'nam'; did you mean 'name'? It takes name.",
    ),
    "missing argument": (NetlistError, {"op": "rename", "old": "rotor"}, "rename needs new.\nIt takes old, new."),
    "argument of another kind": (
        ValueOutOfRange, {"op": "remove", "name": 3}, 'remove: name = 3 is no text.\nGive one, such as "…".',
    ),
    "no such part": (
        UnknownName, {"op": "remove", "name": "motr"},
        "The netlist has no part 'motr'; did you mean 'motor'? It has motor, rotor, sine, brake, row, three, ramp.\n"
        "  in drive.toml:3 `[parts]`",
    ),
    "a constant": (
        DuplicateName, {"op": "rename", "old": "rotor", "new": "pi"},
        "'pi' is no name for a part: it is a constant of formulas.",
    ),
    "a suggestion that is none": (
        UnknownName, {"operation": "repl"},
        "There is no operation 'repl'; did you mean 'replace'? There are replace, set, free, connect, insert.",
    ),
    "a word that has changed since": (
        NetlistError,
        {"operation": "replace", "line": 4, "column": 18, "length": 7, "old": "Inertja", "new": "Inertia", "file": ""},
        "There is no 'Inertja' at line 4, column 18.\nCheck the netlist again.",
    ),
    "no name": (
        NetlistError, {"op": "add", "name": "a b", "kind": "Inertia"},
        "'a b' is no name for a part.\nA name is a letter, then letters, digits and _.",
    ),
    "name of a part": (
        DuplicateName, {"op": "add", "name": "rotor", "kind": "Inertia"},
        "The netlist has a part 'rotor' already.\n  in drive.toml:5 `rotor = { is = \"Inertia\", J = \"J\" }`",
    ),
    "name of a parameter": (
        DuplicateName, {"op": "duplicate", "name": "rotor", "new": "J"},
        "The netlist has a parameter 'J' already.\n  in drive.toml:2 `J = \"2 kg.m2\"`",
    ),
    "name of an outer connector": (
        DuplicateName, {"op": "rename", "old": "rotor", "new": "out"},
        "The netlist has an outer connector 'out' already.\n  in drive.toml:16 `out = \"rotor.flange_b\"`",
    ),
    "name of every component": (
        DuplicateName, {"op": "rename", "old": "J", "new": "equations"},
        "'equations' is no name for a parameter: every component has something of this name.",
    ),
    "name in a formula": (
        DuplicateName, {"op": "rename", "old": "rotor", "new": "two"},
        "The formula 'two.J' uses the name 'two' already.\n"
        "  in drive.toml:9 `three = { is = \"Inertia\", count = 3, J = \"two.J\" }`\nChoose another name.",
    ),
    "half of a character": (
        NetlistError, {"op": "set", "path": "description", "value": "\ud800", "section": ""},
        "'\\ud800' has half of a character, which no file can hold.",
    ),
    "unknown type": (
        UnknownName, {"op": "add", "name": "new", "kind": "Inertja"},
        "There is no component type 'Inertja'; did you mean 'Inertia'?\n"
        '  in drive.toml:11 `new = { is = "Inertja" }`\n`modelica-like library` lists all types.',
    ),
    "place not clear": (
        NetlistError, {"op": "insert", "name": "new", "kind": "Inertia", "after": "motor", "before": "rotor"},
        "It is not clear where new is to be inserted.\n"
        'Write between=("a", "b"), after="a" or before="b"; `add` makes a part that is free.',
    ),
    "place where nothing is connected": (
        NetlistError, {"op": "insert", "name": "new", "kind": "Inertia", "between": ["motor", "brake"]},
        "motor and brake are not connected, so nothing can be put between them.\n"
        '  in drive.toml:4 `motor = { is = "ConstantTorque", tau_constant = "5 N.m" }`\n'
        '  in drive.toml:7 `brake = { is = "Brake", capacity = "20 N.m" }`\n'
        "Use `connect` after `add`, or name two parts that are connected.",
    ),
    "other domain in a series": (
        WrongConnection, {"op": "insert", "name": "new", "kind": "Mass", "after": "brake"},
        "connect(brake.flange_b, new.flange_a): a Flange (rad, N.m) cannot join a LinearFlange (m, N). "
        "A spindle or rack goes between.",
    ),
    "no two sides for a signal": (
        WrongConnection, {"op": "insert", "name": "new", "kind": "Sum", "between": ["sine.y", "brake.f_normalized"]},
        "new has 2 inputs and 1 outputs, so it cannot be put into a signal.\nUse `add` and `connect`.",
    ),
    "domains do not fit": (
        WrongConnection, {"op": "connect", "first": "sine.y", "second": "rotor.flange_b"},
        "connect joins the signal sine.y with the connector rotor.flange_b.\n"
        "Signals go to signals: use a sensor or a source between.",
    ),
    "two sources": (
        WrongConnection, {"op": "connect", "first": "ramp.y", "second": "brake.f_normalized"},
        "The connection of sine.y, brake.f_normalized, ramp.y has 2 outputs (sine.y, ramp.y).\n"
        "Connect one output with any number of inputs.",
    ),
    "part instead of an end": (
        WrongConnection, {"op": "connect", "first": "motor", "second": "brake.flange_b"},
        "'motor' is a part, and ends of parts are connected.\nName one: \"motor.flange\".",
    ),
    "connected already": (
        NetlistError, {"op": "connect", "first": "rotor.flange_a", "second": "motor.flange"},
        "rotor.flange_a and motor.flange are connected already.\n"
        '  in drive.toml:12 `drive = ["motor", "rotor", "brake"]`',
    ),
    "name of a line": (
        NetlistError, {"op": "connect", "first": "rotor.flange_a", "second": "brake.flange_b", "name": "pressed"},
        "[connect] has a line 'pressed' already.\n"
        '  in drive.toml:14 `pressed = ["sine.y", "brake.f_normalized"]`\nChoose another name.',
    ),
    "nothing to separate": (
        NetlistError, {"op": "disconnect", "first": "rotor.flange_b", "second": "sine.y"},
        "rotor.flange_b and sine.y are not connected, so nothing can be separated.\n"
        "Name ends, or neighbours in a series.",
    ),
    "end in no line": (
        NetlistError, {"op": "disconnect", "first": "rotor.flange_b"},
        "rotor.flange_b is in no line of [connect], so nothing can be separated.\n"
        "Name ends, or neighbours in a series.",
    ),
    "wrong unit": (
        UnitError, {"op": "set", "path": "brake.capacity", "value": "3 kg"},
        "PressedFriction.capacity expects N.m; '3 kg' is kg.\n"
        "  in drive.toml:7 `brake = { is = \"Brake\", capacity = \"3 kg\" }`",
    ),
    "wrong parameter": (
        NetlistError, {"op": "set", "path": "J", "value": "2 +"},
        "'2 +' is neither a quantity nor a formula.\n  in drive.toml:2 `J = \"2 +\"`\n"
        'A quantity is a number with a unit ("8.5 kg.cm2"), a formula is arithmetic of parameters ("2*J").',
    ),
    "unknown section": (
        UnknownName, {"op": "set", "path": "until", "value": 3, "section": "simulat"},
        "A netlist has no section 'simulat'; did you mean 'simulate'? It has name, description, parameters, parts, "
        "series, connect, start, guess, free, expose, simulate, display, sizing, optimize, tolerances, modelica.",
    ),
    "value of a part": (
        NetlistError, {"op": "set", "path": "rotor", "value": 3},
        "'rotor' is a part, and no value.\nName one of its values: rotor.….",
    ),
    "array of different parts": (
        NetlistError, {"op": "replace", "name": "row", "kind": "Inertia"},
        "row is an array of 2 different parts.\n"
        '  in drive.toml:8 `row = [{ is = "Inertia", J = 1 }, { is = "Spring", c = 5 }]`\nName one: row[1].',
    ),
    "one of equal parts": (
        NetlistError, {"op": "set", "path": "three[2].J", "value": 3},
        "three[2] is one of equal parts, which share their values.\n"
        '  in drive.toml:9 `three = { is = "Inertia", count = 3, J = "two.J" }`\nWrite three to change all of them.',
    ),
    "no value": (UnknownName, {"op": "unset", "path": "brake.peak"}, "The netlist has no value for 'brake.peak'."),
    "no value in a section": (
        UnknownName, {"op": "unset", "path": "outer", "section": "expose"},
        "[expose] has no value for 'outer'; did you mean 'out'?",
    ),
    "needed value": (
        NetlistError, {"op": "unset", "path": "rotor.is"},
        'parts.rotor has no type.\n  in drive.toml:5 `rotor = { J = "J" }`\nGive its type, such as is = "Inertia".',
    ),
    "no parts to group": (
        NetlistError, {"op": "group", "names": [], "name": "box"}, "No part is to be grouped.\nName at least one.",
    ),
    "file elsewhere": (
        NetlistError, {"op": "group", "names": ["rotor"], "name": "box", "file": "../box.toml"},
        "'../box.toml' is no name for a netlist beside this one.\nWrite box.toml.",
    ),
    "long name of a file": (
        NetlistError, {"op": "group", "names": ["rotor"], "name": "w" * 300},
        f"'{'w' * 300}.toml' cannot be the name of a file: File name too long.",
    ),
    "file of no possible name": (
        NetlistError, {"op": "group", "names": ["rotor"], "name": "box", "file": "\0.toml"},
        "'\\x00.toml' is no name for a netlist beside this one.\nWrite box.toml.",
    ),
    "file that exists": (
        DuplicateName, {"op": "group", "names": ["rotor"], "name": "box", "file": "drive.toml"},
        "'drive.toml' exists already.\nName another file.",
    ),
}  # fmt: skip
Check = Callable[[type[ModelicaLikeError], Callable[[], object], str], None]


@pytest.mark.parametrize("case", CASES)
def test_refused_operations(case: str, tmp_path: Path, check_message: Check) -> None:
    kind, request, message = CASES[case]
    (tmp_path / "drive.toml").write_text(TEXT)
    check_message(kind, lambda: apply(TEXT, request, file=tmp_path / "drive.toml"), message)


def test_refused_documents(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, check_message: Check) -> None:
    monkeypatch.chdir(tmp_path)
    Path("drive.toml").write_text(TEXT)
    document = Document("drive.toml")
    check_message(
        DuplicateName, lambda: Document.new("drive.toml"),
        "'drive.toml' exists already.\nOpen it: Document(\"drive.toml\").",
    )  # fmt: skip
    check_message(NetlistError, document.undo, "There is nothing to undo.")
    check_message(NetlistError, document.redo, "There is nothing to redo.")
    check_message(
        NetlistError, lambda: document.save("elsewhere/drive.toml"),
        "'elsewhere/drive.toml' is in another folder than 'drive.toml'.\n"
        "Use `save(load(…), path)` of modelica_like.netlist, which names its files anew.",
    )  # fmt: skip
    document.group(["rotor"], "box")
    Path("box.toml").write_text(TEXT)
    check_message(
        DuplicateName, document.save, f"'{tmp_path.resolve() / 'box.toml'}' exists already.\n"
        "Undo the grouping and name another file.",
    )  # fmt: skip
    Path("bad.toml").write_text("[parts\n")
    check_message(
        NetlistError, lambda: Document("bad.toml"),
        "'bad.toml' is not TOML: expected ']' at the end of a table declaration.\n  in bad.toml:1 `[parts`",
    )  # fmt: skip
