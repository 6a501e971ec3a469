"""What stands at a place of a text that is being written: words that fit, explanations, definitions, symbols."""

import inspect
from pathlib import Path

import pytest
from payloads import texts

import components
from modelica_like.lsp.answers import complete, definition, explain, symbols
from modelica_like.lsp.text import Text

DRIVE = """name = "d"
[parameters]
load = "2 kg.m2"
[parts]
motor = { is = "Torque", tau = "5 N.m" }
J1 = { is = "Inertia", J = "load" }
shaft = { is = "SpringDamper", c = 400, d = 1 }
brake = { is = "Brake", capacity = 1 }
[parts.servo]
is = "PositionServo"
"""
SIZING = """[parameters]
t = "3 N.m"
[checks.shaft]
is = "shaft_stress"
diameter = "32 mm"
"""


def at(written: str, path: Path = Path("drive.toml")) -> tuple[Text, int]:
    """Return a text, and the place of the mark in it."""
    return Text(path, written.replace("¦", "")), written.index("¦")


def words(written: str, path: Path = Path("drive.toml")) -> list[str]:
    return [item.word.label for item in complete(*at(written, path))]


def accepted(written: str, label: str) -> str:
    """Return the text with a word taken."""
    text, offset = at(written)
    (item,) = (item for item in complete(text, offset) if item.word.label == label)
    begin, end = item.span
    return text.text[:begin] + item.text + text.text[end:]


NETLISTS = {
    "sections": ("[¦", {"parts", "series", "start"}, {"checks"}),
    "a section half written": ("[parts]\na = { is = \"Inertia\" }\n[ser¦", {"series"}, set()),
    "keys above all sections": ("na¦", {"name", "description", "free"}, set()),
    "types": (DRIVE + "[parts.x]\nis = \"¦\"", {"Inertia", "Clutch"}, {"shaft_stress"}),
    "types in braces that are open": ("[parts]\na = { is = \"In¦\nb = { is = \"Mass\" }", {"Inertia"}, set()),
    "types without quotes": ("[parts]\na = { is = ¦ }", {"Inertia"}, set()),
    "values of a part": (DRIVE.replace("c = 400", "¦"), {"c", "d", "phi_rel", "is", "count"}, {"J"}),
    "values in a table of its own": (DRIVE + "K¦", {"Kv", "R", "J"}, {"c"}),
    "units": (DRIVE.replace('"5 N.m"', '"5 ¦"'), {"N.m", "kN.m", "N.mm"}, {"kg", "N", "mm"}),
    "units of a start": (DRIVE + "[start]\n\"J1.w\" = \"5 ¦\"", {"rad/s", "rpm"}, {"Hz", "s"}),
    "a time": (DRIVE + "[simulate]\nuntil = \"5 ¦\"", {"s", "min"}, {"Hz"}),
    "options": (DRIVE + "[simulate]\n¦", {"until", "rtol", "start"}, {"parts"}),
    "words of an option": (DRIVE + "[simulate]\nstart = \"¦\"", {"given", "rest", "steady"}, {"load"}),
    "modes": (DRIVE.replace("capacity = 1", "mode = \"¦\""), {"stuck", "forward", "backward"}, set()),
    "parameters in a value": (DRIVE.replace('"load"', '"lo¦"'), {"load"}, set()),
    "parts of a series": (DRIVE + "[series]\nx = [\"motor\", \"¦\"]", {"J1", "shaft", "servo"}, {"load"}),
    "parts of a series in several lines": (DRIVE + "[series]\nx = [\n  \"motor\",\n  ¦\n]", {"J1", "shaft"}, set()),
    "ends of a part": (DRIVE + "[connect]\nx = [\"J1.¦\"]", {"flange_a", "flange_b"}, {"J1", "J"}),
    "signals": (DRIVE + "[connect]\nx = [\"motor.¦\"]", {"tau", "flange"}, {"phi"}),
    "a free end": ("free = [\"J1.¦\"]\n" + DRIVE, {"flange_a"}, set()),
    "an outer end": (DRIVE + "[expose]\nflange = \"J1.¦\"", {"flange_a"}, set()),
    "starts": (DRIVE + "[start]\n\"J1.¦\" = 0", {"phi", "w"}, {"flange_a", "motor"}),
    "starts without quotes": (DRIVE + "[start]\nJ1.¦", {"phi", "w"}, {"flange_a"}),
    "parts in a start": (DRIVE + "[start]\n¦", {"J1", "shaft"}, set()),
    "another file": ("[tool.ruff]\nline-length = 3\n[¦", set(), {"parts"}),
}  # fmt: skip


@pytest.mark.parametrize("case", NETLISTS)
def test_words_that_fit(case: str):
    written, some, none = NETLISTS[case]
    fitting = set(words(written if "¦" in written else written + "¦"))
    assert some <= fitting
    assert not none & fitting


def test_a_word_replaces_what_is_written():
    assert '{ is = "Inertia", J' in accepted(DRIVE.replace('"Inertia"', '"Iner¦"'), "Inertia")
    assert '{ is = "Inertia", J' in accepted(DRIVE.replace('"Inertia"', "¦"), "Inertia")
    assert 'x = ["J1.flange_b"]' in accepted(DRIVE + '[connect]\nx = ["J1.fl¦"]', "flange_b")
    assert 'tau = "5 N.m" }' in accepted(DRIVE.replace("5 N.m", "5 k¦"), "N.m")
    assert accepted('[parts]\na = { is = "Inertia" }\n[ser¦]', "series").endswith("\n[series]")


def test_netlists_beside_it(tmp_path: Path):
    (tmp_path / "box.toml").write_text('[parts]\nhub = { is = "Inertia", J = 1 }\n[expose]\nshaft = "hub.flange_a"\n')
    (tmp_path / "drive.toml").write_text("")
    drive = tmp_path / "drive.toml"
    assert "./box.toml" in words('[parts]\nb = { is = "¦" }', drive)
    assert "./drive.toml" not in words('[parts]\nb = { is = "¦" }', drive)
    assert words('[parts]\nb = { is = "./box.toml" }\n[connect]\nx = ["b.¦"]', drive) == ["hub", "shaft"]
    text, offset = at('[parts]\nb = { is = "./bo¦x.toml" }', drive)
    assert definition(text, offset) == (tmp_path / "./box.toml", 1, 1, 0)


def test_words_of_a_sizing_file():
    assert "shaft_stress" in words('[checks.a]\nis = "¦"')
    assert {"bending", "torque", "note", "limits"} <= set(words(SIZING + "¦"))
    assert "mm" in words(SIZING.replace("32 mm", "32 ¦"))
    assert words(SIZING + '[compare]\nx = ["¦"]') == ["shaft"]
    assert {"checks", "compare"} <= set(words(SIZING + "[¦"))


HOVERS = {
    DRIVE.replace('J = "load"', 'J¦ = "load"'): "J: moment of inertia [kg.m2]; at least 0",
    DRIVE.replace('"Inertia"', '"Iner¦tia"'): "Inertia\n\n",
    DRIVE.replace('"load"', '"lo¦ad"'): "load = 2 kg.m2",
    DRIVE + '[series]\nx = ["J¦1"]': "Inertia\n\n",
    DRIVE + '[connect]\nx = ["J1.flan¦ge_a"]': "Flange: left end",
    DRIVE + '[start]\n"J1.¦w" = 0': "w: ",
    DRIVE + "[sim¦ulate]\nuntil = 1": "how the drive is run",
    DRIVE + "[simulate]\nun¦til = 1": "until: end time [s]",
    SIZING.replace("diameter", "diam¦eter"): "diameter: ",
    SIZING.replace("shaft_stress", "shaft_str¦ess"): "",
}


@pytest.mark.parametrize("written", HOVERS)
def test_words_are_explained(written: str):
    told = explain(*at(written))
    assert told
    assert told[0].startswith(HOVERS[written])
    assert "\n\n\n" not in told[0]


def test_a_default_and_limits_are_told():
    field = components.Mass.g
    told = explain(*at('[parts]\nm = { is = "Mass", ¦g = 9 }'))
    assert told
    assert f"default: {field.default}" in told[0]
    told = explain(*at('[parts]\nm = { is = "Mass", ¦m = 9 }'))
    assert told
    assert "at least 0" in told[0]


def test_what_is_unknown_is_not_explained():
    for written in (DRIVE.replace("tau =", "tou¦ ="), "[tool.x]\na¦ = 1", DRIVE + '[series]\nx = ["J¦9"]', "¦"):
        assert explain(*at(written)) is None


def test_definitions():
    line = inspect.getsourcelines(components.Inertia)[1]
    assert definition(*at(DRIVE.replace('"Inertia"', '"In¦ertia"'))) == (
        Path(inspect.getsourcefile(components.Inertia) or ""), line, 1, 0,
    )  # fmt: skip
    here = Path("drive.toml")
    assert definition(*at(DRIVE + '[series]\nx = ["J¦1"]')) == (here, 6, 1, 2)
    assert definition(*at(DRIVE + '[connect]\nx = ["J1.flange¦_a"]')) == (here, 6, 1, 2)
    assert definition(*at(DRIVE + "[start]\nJ1.¦w = 0")) == (here, 6, 1, 2)
    assert definition(*at(DRIVE + '[series]\nx = ["ser¦vo"]')) == (here, 9, 8, 5)
    assert definition(*at(DRIVE.replace('"load"', '"2*lo¦ad"'))) == (here, 3, 1, 4)
    assert definition(*at(SIZING + '[compare]\nx = ["sh¦aft"]')) == (here, 3, 9, 5)
    assert definition(*at(DRIVE + '[series]\nx = ["J¦9"]')) is None


def test_symbols():
    text = Text(Path("drive.toml"), DRIVE)
    tops = symbols(text)
    assert [top.name for top in tops] == ["name", "parameters", "parts"]
    assert [(inner.name, inner.about) for inner in tops[2].inner] == [
        ("motor", "Torque"), ("J1", "Inertia"), ("shaft", "SpringDamper"), ("brake", "Brake"),
        ("servo", "PositionServo"),
    ]  # fmt: skip
    assert [text.text[slice(*inner.span)] for inner in tops[2].inner] == ["motor", "J1", "shaft", "brake", "servo"]
    for symbol in (*tops, *tops[2].inner):
        assert symbol.whole[0] <= symbol.span[0] <= symbol.span[1] <= symbol.whole[1]
    assert symbols(Text(Path("pyproject.toml"), "[tool.x]\na = 1\n")) == []


def test_hostile_texts_are_survived():
    """Answers are texts, and places in the file; what the file says stands in them as it is."""
    for written in texts():
        text = Text(Path("drive.toml"), written)
        for offset in (0, len(text.text) // 2, text.text.rfind("=") + 3, len(text.text)):
            offset = min(offset, len(text.text))
            items, told, place = complete(text, offset), explain(text, offset), definition(text, offset)
            assert all(0 <= item.span[0] <= item.span[1] <= len(text.text) for item in items)
            assert told is None or told[0]
            assert place is None or place[1] > 0
        assert all(top.span[1] <= len(text.text) for top in symbols(text))
