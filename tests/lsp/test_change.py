"""New names, and suggestions that are applied."""

import re
import tomllib
from pathlib import Path

import pytest

from modelica_like import build, load
from modelica_like.errors import DuplicateName, ModelicaLikeError, NetlistError, UnknownName
from modelica_like.lsp.change import Edit, applied, renamed
from modelica_like.lsp.text import Text
from modelica_like.netlist import loads

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVE = """free = ["m.support"] # m is no part of this comment
[parameters]
n = 2
J = "n * 3 kg.m2"
[parts]
m = { is = "Torque", tau = "5 N.m" } # m
mm = { is = "Inertia", J = "2*m.J + J + 3 kg.m2" }
n2 = { is = "Inertia", J = "sqrt(n) * 2 m" }
[[parts.row]]
is = "Inertia"
J = "n"
[series]
x = ["m", "mm", "row[1]", 'm']
[connect]
m = ["m.flange", "mm.flange_a", "row[1].flange_a"]
[start]
m.w = 0
"m.phi" = "m.w0"
"mm.w" = 0
[expose]
m = "m.flange"
[display]
"m.*" = "rpm"
"""


def changed(text: str, edits: list[Edit]) -> str:
    for (begin, end), new in sorted(edits, reverse=True):
        text = text[:begin] + new + text[end:]
    return text


def with_name(old: str, new: str, line: int) -> str:
    text = Text(Path("drive.toml"), DRIVE)
    return changed(DRIVE, renamed(text, text.outline.offset(line, DRIVE.split("\n")[line - 1].index(old) + 1), new))


def test_a_part_gets_a_name_everywhere():
    assert (
        with_name("m", "motor", 6)
        == """free = ["motor.support"] # m is no part of this comment
[parameters]
n = 2
J = "n * 3 kg.m2"
[parts]
motor = { is = "Torque", tau = "5 N.m" } # m
mm = { is = "Inertia", J = "2*motor.J + J + 3 kg.m2" }
n2 = { is = "Inertia", J = "sqrt(n) * 2 m" }
[[parts.row]]
is = "Inertia"
J = "n"
[series]
x = ["motor", "mm", "row[1]", 'motor']
[connect]
m = ["motor.flange", "mm.flange_a", "row[1].flange_a"]
[start]
motor.w = 0
"motor.phi" = "motor.w0"
"mm.w" = 0
[expose]
m = "motor.flange"
[display]
"motor.*" = "rpm"
"""
    )


def test_what_is_asked_of_a_drive_follows():
    drive = """[parts]
a = { is = "Inertia", J = 1 }
[optimize]
minimize = "max(peak(a.w), a.phi)"
free = { "a.J" = [1, 2] }
[tolerances]
"a.J" = "±5 %"
correlated = [{ of = ["a.J", "b.J"], rho = 0.5 }]
"""
    edits = renamed(Text(Path("drive.toml"), drive), drive.index("a ="), "rotor")
    assert changed(drive, edits) == drive.replace("a.", "rotor.").replace("a =", "rotor =")


def test_words_that_are_no_names_stay():
    drive = """[parameters]
stuck = 1
[parts]
b = { is = "Brake", capacity = "stuck", mode = "stuck" }
c = { is = "CombiTable1Ds", table = [["0", "stuck"]] }
"""
    edits = renamed(Text(Path("drive.toml"), drive), drive.index("stuck"), "force")
    assert changed(drive, edits) == drive.replace("stuck =", "force =").replace(
        'capacity = "stuck"', 'capacity = "force"'
    )


def test_an_array_and_a_parameter_get_names():
    assert with_name("row", "gear", 13).count("gear") == 3
    assert with_name("n", "count", 3) == DRIVE.replace("n = 2", "count = 2").replace('"n * 3', '"count * 3').replace(
        "sqrt(n)", "sqrt(count)").replace('J = "n"', 'J = "count"')  # fmt: skip


REFUSED = {
    ("mm", 6): (DuplicateName, "The netlist has a part 'mm' already."),
    ("pi", 6): (DuplicateName, "'pi' is no name for a part: it is a constant of formulas."),
    ("2m", 6): (NetlistError, "'2m' is no name for a part."),
}


@pytest.mark.parametrize(("name", "line"), REFUSED)
def test_names_that_are_refused(name: str, line: int):
    kind, message = REFUSED[name, line]
    with pytest.raises(kind) as refused:
        with_name("m", name, line)
    assert refused.value.what == message


@pytest.mark.parametrize("offset", [0, 3, DRIVE.index("flange"), DRIVE.index("5 N.m") + 4, DRIVE.index("# m") + 2])
def test_what_has_no_name(offset: int):
    with pytest.raises(UnknownName) as caught:
        renamed(Text(Path("drive.toml"), DRIVE), offset, "a")
    assert str(caught.value) == "There is no part or parameter of this netlist."


def test_examples_are_the_same_with_other_names():
    count = 0
    for file in sorted(EXAMPLES.glob("*.toml")):
        text = Text(file, file.read_text(encoding="utf-8"))
        data = tomllib.loads(text.text)
        if "parts" not in data or "start" not in data:
            continue
        name = next(iter(data["parts"]))
        place = text.outline.by_path["parts", name].names[-1][0]
        new = changed(text.text, renamed(text, place, "renamed_part"))
        before, after = build(load(file, trust=True)), build(loads(new, str(file), trust=True))
        expected = [re.sub(rf"(?<![\w.]){re.escape(name)}(?=[.\[])", "renamed_part", path) for path in before.states]
        assert list(after.states) == expected
        count += 1
    assert count > 5


def test_a_value_and_a_free_end_are_added():
    drive = '[parts]\na = { is = "Inertia" }\n[parts.b]\nis = "Inertia" # last\n'
    for path, expected in (
        ("a.J", '{ is = "Inertia", J = "… kg.m2" }'),
        ("b.J", '# last\nJ = "… kg.m2"\n'),
    ):
        edits = applied(Text(Path("d.toml"), drive), {"operation": "set", "path": path, "unit": "kg.m2"})
        new = changed(drive, edits)
        assert expected in new
        with pytest.raises(ModelicaLikeError, match="…"):
            loads(new)
    one = applied(Text(Path("d.toml"), drive), {"operation": "free", "end": "a.flange_a"})
    new = changed(drive, one)
    assert tomllib.loads(new)["free"] == ["a.flange_a"]
    again = changed(new, applied(Text(Path("d.toml"), new), {"operation": "free", "end": "a.flange_b"}))
    assert tomllib.loads(again)["free"] == ["a.flange_a", "a.flange_b"]
    empty = "free = []\n" + drive
    new = changed(empty, applied(Text(Path("d.toml"), empty), {"operation": "free", "end": "a.flange_b"}))
    assert tomllib.loads(new)["free"] == ["a.flange_b"]


def test_what_has_changed_since_is_not_replaced():
    swap = {"operation": "replace", "line": 2, "column": 12, "length": 7, "old": "Inertja", "new": "Inertia"}
    assert applied(Text(Path("d.toml"), '[parts]\na = { is = "Inertia" }\n'), swap) == []


def test_several_lines_become_others():
    before = '[parts]\na = { is = "Inertia", J = 1 }\nb = { is = "Inertia", J = 1 }\n'
    swap = {"operation": "connect", "first": "a.flange_b", "second": "b.flange_a"}
    edits = applied(Text(Path("d.toml"), before), swap)
    assert edits == [((len(before), len(before)), '\n[connect]\na_b = ["a.flange_b", "b.flange_a"]\n')]
