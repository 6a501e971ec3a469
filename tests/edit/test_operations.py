"""Each operation changes the lines that it must, and no others."""

from pathlib import Path

import pytest

from modelica_like import edit
from modelica_like.edit import Document, apply
from modelica_like.errors import NetlistError

TEXT = """\
# A drive.
name = "drive"   # its name

[parameters]
J = "2 kg.m2"  # of the rotor

[parts]
# the machine
motor  = { is = "ConstantTorque", tau_constant = "5 N.m" }
rotor = { is = 'Inertia', J = "J" } # turns
shaft = { is = "SpringDamper", c = "100 N.m/rad", d = "0.1 N.m.s/rad" }
load = { is = "Inertia", J = "2*J + rotor.J" }
sine = { is = "Sine", f = "1 Hz" }

[parts.brake]
is = "Brake"
capacity = "20 N.m"

[series]
drive = ["motor", "rotor", "shaft", "load"]

[connect]
brake = ["load.flange_b", "brake.flange_a"]
pressed = ["sine.y", "brake.f_normalized"]

[start]
"rotor.w" = "10 rad/s"
shaft.phi_rel = 0

[simulate]
until = "1 s"

[display]
"rotor.w" = "rpm"
speed = "rpm"
"""


def lines(before: str, after: str) -> tuple[list[str], list[str]]:
    """Return the lines that went, and those that came."""
    old, new = before.splitlines(), after.splitlines()
    return [line for line in old if line not in new], [line for line in new if line not in old]


def test_a_part_is_inserted_into_a_series() -> None:
    gone, new = lines(TEXT, edit.insert(TEXT, "gear", "IdealGear", between=("shaft", "rotor"), ratio=3))
    assert gone == ['drive = ["motor", "rotor", "shaft", "load"]']
    assert new == ['gear = { is = "IdealGear", ratio = 3 }', 'drive = ["motor", "rotor", "gear", "shaft", "load"]']
    assert '"load", "last"]' in edit.insert(TEXT, "last", "Inertia", after="load", J=1)
    assert '"motor", "first", "rotor"' in edit.insert(TEXT, "first", "Inertia", before="rotor", J=1)
    assert 'brake = ["brake", "disc"]' in edit.insert(TEXT, "disc", "Inertia", after="brake", J=1)


def test_a_part_is_inserted_into_a_connection_with_its_sides_the_right_way_round() -> None:
    gone, new = lines(TEXT, edit.insert(TEXT, "hub", "SpringDamper", between=("brake", "load"), c=1, d=1))
    assert gone == ['brake = ["load.flange_b", "brake.flange_a"]']
    assert new[1:] == ['brake = ["load.flange_b", "hub.flange_a"]', 'hub = ["hub.flange_b", "brake.flange_a"]']
    gone, new = lines(TEXT, edit.insert(TEXT, "half", "Gain", between=("brake.f_normalized", "sine"), k=0.5))
    assert new[1:] == ['pressed = ["sine.y", "half.u"]', 'half = ["half.y", "brake.f_normalized"]']


def test_ends_are_connected() -> None:
    text = edit.add(TEXT, "watch", "SpeedSensor")
    assert lines(TEXT, text) == ([], ['watch = { is = "SpeedSensor" }'])
    joined = edit.connect(text, "watch.flange", "load.flange_b")
    assert lines(text, joined)[1] == ['brake = ["load.flange_b", "brake.flange_a", "watch.flange"]']
    assert lines(text, edit.connect(text, "rotor.flange_a", "watch.flange", name="seen"))[1] == [
        'seen = ["rotor.flange_a", "watch.flange"]'
    ]
    freed = edit.set(text, "free", ["watch.flange"], section="")
    assert 'free = ["watch.flange"]\n' in freed
    assert edit.connect(freed, "watch.flange", "load.flange_b") == joined


def test_a_connection_is_taken_away() -> None:
    text = edit.disconnect(TEXT, "rotor", "shaft")
    assert lines(TEXT, text)[1] == ['drive = ["motor", "rotor"]', 'drive_2 = ["shaft", "load"]']
    assert edit.disconnect(TEXT, "rotor.flange_b", "shaft.flange_a") == text
    assert lines(TEXT, edit.disconnect(TEXT, "motor", "rotor")) == lines(
        TEXT, TEXT.replace('"motor", "rotor"', '"rotor"')
    )
    assert lines(TEXT, edit.disconnect(TEXT, "sine.y")) == (['pressed = ["sine.y", "brake.f_normalized"]'], [])
    three = edit.connect(edit.add(TEXT, "watch", "SpeedSensor"), "watch.flange", "load.flange_b")
    assert 'brake = ["load.flange_b", "watch.flange"]' in edit.disconnect(three, "load.flange_b", "brake.flange_a")


def test_a_part_goes_with_its_lines_and_its_neighbours_are_joined() -> None:
    gone, new = lines(TEXT, edit.remove(TEXT, "shaft"))
    assert new == ['drive = ["motor", "rotor", "load"]']
    assert gone == [line for line in TEXT.splitlines() if "shaft" in line]
    result = apply(TEXT, {"op": "remove", "name": "rotor"})
    assert result.notes == ("load.J = '2*J + rotor.J' still uses rotor.",)
    assert [line for line in result.text.splitlines() if "rotor" in line] == [
        'J = "2 kg.m2"  # of the rotor', 'load = { is = "Inertia", J = "2*J + rotor.J" }',
    ]  # fmt: skip
    gone, new = lines(TEXT, edit.remove(TEXT, "brake"))
    assert new == []
    assert gone == ["[parts.brake]", 'is = "Brake"', 'capacity = "20 N.m"', *TEXT.splitlines()[22:24]]


def test_neighbours_that_do_not_fit_are_not_joined() -> None:
    text = '[parts]\na = { is = "Inertia", J = 1 }\ns = { is = "BallScrew", lead = 1 }\nm = { is = "Mass", m = 1 }\n'
    text += 'n = { is = "Mass", m = 1 }\n[series]\nx = ["a", "s", "m", "n"]\n'
    result = apply(text, {"op": "remove", "name": "s"})
    assert result.text.endswith('[series]\nx = ["m", "n"]\n')
    assert result.notes == ("a and m are not joined: their ends are of different kinds, or one has none.",)


def test_every_place_follows_a_name() -> None:
    text = edit.rename(TEXT, "rotor", "wheel")
    assert lines(TEXT, text)[1] == [
        "wheel = { is = 'Inertia', J = \"J\" } # turns", 'load = { is = "Inertia", J = "2*J + wheel.J" }',
        'drive = ["motor", "wheel", "shaft", "load"]', '"wheel.w" = "10 rad/s"', '"wheel.w" = "rpm"',
    ]  # fmt: skip
    assert edit.rename(text, "wheel", "rotor") == TEXT
    assert "[parts.hold]\n" in edit.rename(TEXT, "brake", "hold")
    assert "Welle.phi_rel = 0\n" in edit.rename(TEXT, "shaft", "Welle")
    assert '"Rädchen.w" = "rpm"\n' in edit.rename(TEXT, "rotor", "Rädchen")
    assert '"Rädchen" = { is =' in edit.rename(TEXT, "rotor", "Rädchen")
    inertia = edit.rename(TEXT, "J", "m")
    assert lines(TEXT, inertia)[1] == [
        'm = "2 kg.m2"  # of the rotor', "rotor = { is = 'Inertia', J = \"m\" } # turns",
        'load = { is = "Inertia", J = "2*m + rotor.J" }',
    ]  # fmt: skip


def test_tables_of_a_part_in_other_sections_follow() -> None:
    text = 'parts.a.is = "Inertia"\nparts.a.J = 1\n[start.a]\nw = 1\n[display.a]\nw = "rpm"\n'
    assert edit.rename(text, "a", "b") == text.replace("a.is", "b.is").replace("a.J", "b.J").replace(".a]", ".b]")
    assert edit.remove(text, "a") == ""


def test_signals_without_a_source_go() -> None:
    text = '[parts]\na = { is = "Sine" }\ng = { is = "Gain" }\nh = { is = "Gain" }\n'
    text += '[connect]\nx = ["a.y", "g.u", "h.u"]\n'
    result = apply(text, {"op": "remove", "name": "a"})
    assert result.text == text.replace('a = { is = "Sine" }\n', "").replace('x = ["a.y", "g.u", "h.u"]\n', "")
    assert result.notes == ("g.u, h.u are not connected any more.",)
    assert edit.disconnect(text, "g.u", "a.y") == text.replace('"g.u", ', "")


def test_units_texts_and_modes_are_no_names() -> None:
    text = """\
description = "N of m stuck"
[parameters]
m = "3 m"
N = "2 N.m"
[parts]
s = { is = "Inertia", J = "2 kg.m2 + m*1 kg.m" }
stuck = { is = "Clutch", capacity = "N + 1 N.m", f_normalized = 1 }
watch = { is = "SpeedLimit", w_max = "40 1/s", reason = "N" }
[start]
"stuck.mode" = "stuck"
"s.w" = "3 rad/s"
[display]
N = "m"
"""
    assert lines(text, edit.rename(text, "m", "l"))[1] == [
        'l = "3 m"',
        's = { is = "Inertia", J = "2 kg.m2 + l*1 kg.m" }',
    ]
    assert lines(text, edit.rename(text, "N", "F"))[1] == [
        'F = "2 N.m"', 'stuck = { is = "Clutch", capacity = "F + 1 N.m", f_normalized = 1 }',
    ]  # fmt: skip
    assert '"k.mode" = "stuck"' in edit.rename(text, "stuck", "k")
    assert '"40 1/s"' in edit.rename(text, "s", "t")


def test_a_type_is_replaced() -> None:
    result = apply(TEXT, {"op": "replace", "name": "shaft", "kind": "Damper"})
    assert lines(TEXT, result.text)[1] == ['shaft = { is = "Damper", d = "0.1 N.m.s/rad" }']
    assert result.notes == ("shaft.c goes: Damper has no parameter or variable 'c'. It has phi_rel, tau, w_rel, d.",)
    result = apply(TEXT, {"op": "replace", "name": "rotor", "kind": "Mass", "m": 3})
    assert 'rotor = { is = "Mass", m = 3 }' in result.text or "rotor = { is = 'Mass', m = 3 } # turns" in result.text
    assert 'drive = ["shaft", "load"]' in result.text
    assert "rotor.w" not in result.text
    assert len(result.notes) == 5


def test_values_are_given_where_they_stand() -> None:
    for path, value, line in (
        ("shaft.d", "0.2 N.m.s/rad", 'shaft = { is = "SpringDamper", c = "100 N.m/rad", d = "0.2 N.m.s/rad" }'),
        ("rotor.w", 5, '"rotor.w" = 5'),
        ("J", 3, "J = 3  # of the rotor"),
        ("load.w", "1 rpm", '"load.w" = "1 rpm"'),
        ("brake.peak", 1.2, "peak = 1.2"),
        ("brake.mode", "stuck", '"brake.mode" = "stuck"'),
        ("length", "1 m", 'length = "1 m"'),
    ):
        assert lines(TEXT, edit.set(TEXT, path, value))[1] == [line]
    assert 'name = "other"   # its name' in edit.set(TEXT, "name", "other", section="")
    assert 'until = "1 s"\nrtol = 1e-06\n' in edit.set(TEXT, "rtol", 1e-6, section="simulate")
    assert '\n[guess]\n"load.phi" = 0\n\n[simulate]' in edit.set(TEXT, "load.phi", 0, section="guess")
    assert lines(TEXT, edit.unset(TEXT, "shaft.d"))[1] == ['shaft = { is = "SpringDamper", c = "100 N.m/rad" }']
    assert lines(TEXT, edit.unset(TEXT, "shaft.phi_rel")) == (["shaft.phi_rel = 0"], [])
    assert apply(TEXT, {"op": "unset", "path": "J"}).notes == ("rotor.J, load.J still use J.",)


def test_elements_of_arrays_are_meant() -> None:
    text = (
        '[parts]\nrow = [{ is = "Inertia", J = 1 }, { is = "Spring", c = 5 }]\n[[parts.row2]]\nis = "Inertia"\nJ = 1\n'
    )
    assert '{ is = "Spring", c = 7 }]' in edit.set(text, "row[2].c", 7)
    assert '[{ is = "Inertia", J = 1, w = 2 }' not in edit.set(text, "row[1].w", 2)
    assert text.replace("J = 1\n", "J = 4\n") == edit.set(text, "row2[1].J", 4)


def test_a_part_is_copied() -> None:
    gone, new = lines(TEXT, edit.duplicate(TEXT, "rotor", "other"))
    assert gone == []
    assert new == ["other = { is = 'Inertia', J = \"J\" } # turns", '"other.w" = "10 rad/s"', '"other.w" = "rpm"']
    assert '[parts.other]\nis = "Brake"\ncapacity = "20 N.m"\n\n[series]' in edit.duplicate(TEXT, "brake", "other")


def test_an_array_of_tables_is_copied() -> None:
    row = '[[parts.row]]\nis = "Inertia"\nJ = 1\n\n[[parts.row]]\nis = "Spring"\nc = 5\n'
    text = f"{row}[simulate]\nuntil = 1\n"
    copy = row.replace("row", "other")
    assert edit.duplicate(text, "row", "other") == f"{row}\n{copy}[simulate]\nuntil = 1\n"


def test_layout_of_lists_stays() -> None:
    text = "[parts]\n" + "".join(f'{name} = {{is="Inertia",J=1}}\n' for name in "abc")
    text += '[series]\nx = [\n  "a", # first\n  "b",\n  "c"\n]\n'
    assert edit.remove(text, "b") == text.replace('  "b",\n', "").replace('b = {is="Inertia",J=1}\n', "")
    assert '"a", # first\n  "b",\n  "d",\n  "c"\n]' in edit.insert(text, "d", "Spring", before="c", c=1)
    assert '  "c",\n  "d",\n]' in edit.insert(text, "d", "Spring", after="c", c=1)


def test_line_breaks_of_windows_and_the_mark_of_the_byte_order_stay(tmp_path: Path) -> None:
    content = b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode()
    (tmp_path / "drive.toml").write_bytes(content)
    document = Document(tmp_path / "drive.toml").rename("rotor", "wheel").add("further", "Inertia", J=1)
    document.set("until", "2 s", section="simulate").set("k", 3).set("load.w", 3, section="guess").save()
    written = (tmp_path / "drive.toml").read_bytes()
    assert written.count(b"\n") == written.count(b"\r\n") == content.count(b"\n") + 5
    assert document.problems() == []
    for _ in range(5):
        document.undo()
    document.save()
    assert (tmp_path / "drive.toml").read_bytes() == content


def test_a_document_is_edited_undone_and_done_again(tmp_path: Path) -> None:
    document = Document.new(tmp_path / "drive.toml")
    assert str(document.problems()[0]).startswith("'drive.toml' is empty.")
    document.add("a", "Inertia", J="2 kg.m2").insert("b", "Spring", after="a", c=1)
    document.insert("c", "Inertia", after="b", J=1).connect("c.flange_b", "a.flange_a")
    text = document.text
    assert document.problems() == []
    assert document.undo().undo().redo().redo().text == text
    removed = document.undo().add("d", "Inertia", J=3).apply({"op": "remove", "name": "d"}).text
    assert removed == document.undo().undo().text
    while document.text:
        document.undo()
    with pytest.raises(NetlistError, match="nothing to undo"):
        document.undo()
    document.redo().redo()
    with pytest.raises(FileNotFoundError):
        (tmp_path / "drive.toml").read_text()
    document.save()
    assert Document(tmp_path / "drive.toml").text == document.text
    document.save(tmp_path / "other.toml")
    assert (document.path.name, document.path.read_text()) == ("other.toml", document.text)


def test_an_editor_types_and_does_several_operations_as_one(tmp_path: Path) -> None:
    """Text that is being written need not be TOML; several operations are one step, of which all or none are done."""
    document = Document.draft(tmp_path / "drive.toml", "[parts")
    assert (document.text, document.steps) == ("[parts", (0, 0))
    assert document.problems() != []
    document.write('[parts]\na = { is = "Inertia", J = 1 }\n')
    steps = [
        {"op": "duplicate", "name": "a", "new": "b"},
        {"op": "connect", "first": "a.flange_b", "second": "b.flange_a"},
    ]
    joined = document.together(steps).text
    assert document.problems() == []
    assert document.steps == (2, 0)
    assert document.undo().text == '[parts]\na = { is = "Inertia", J = 1 }\n'
    assert document.steps == (1, 1)
    assert document.redo().text == joined
    with pytest.raises(NetlistError):
        document.together([{"op": "remove", "name": "a"}, {"op": "rename", "old": "b", "new": "1"}])
    assert (document.text, document.steps) == (joined, (2, 0))
    notes = document.together([{"op": "set", "path": "k", "value": 2}, {"op": "set", "path": "a.J", "value": "k"},
                               {"op": "unset", "path": "k"}, {"op": "remove", "name": "b"}]).notes  # fmt: skip
    assert notes == ("a.J still uses k.",)
    assert not (tmp_path / "drive.toml").exists()


def test_netlists_of_groups_are_pending_until_they_are_saved(tmp_path: Path) -> None:
    document = Document.draft(tmp_path / "drive.toml", TEXT).group(["rotor", "shaft"], "line")
    (file,) = document.pending
    assert (file, "[expose]" in document.pending[file]) == (tmp_path.resolve() / "line.toml", True)
    assert document.undo().pending == {}
    document.redo().save()
    assert document.pending == {}
    assert (tmp_path / "line.toml").is_file()
    assert document.rename("load", "table").pending == {}


def test_paths_in_a_sizing_file_are_told(tmp_path: Path) -> None:
    (tmp_path / "checks.toml").write_text('[checks.x]\ntorque = { from = "drive.toml", peak = "shaft.tau" }\n')
    text = 'sizing = "checks.toml"\n' + TEXT
    notes = ("'checks.toml' uses shaft.tau: change that there.",)
    file = tmp_path / "drive.toml"
    assert apply(text, {"op": "rename", "old": "shaft", "new": "rod"}, file=file).notes == notes
    assert apply(text, {"op": "remove", "name": "shaft"}, file=file).notes == notes
    assert apply(text, {"op": "remove", "name": "sine"}, file=file).notes == ()
