"""Lines of keys in TOML texts."""

import contextlib
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from modelica_like.errors import NetlistError, Source
from modelica_like.netlist.locate import locate

TEXT = '''# comment with = and [brackets]
name = "a = [b]"
long = """
x = 1
"""

[parts]
motor = { is = "A", J = 1 } # comment
"quoted key" = { is = 'B' }
list = [
  { is = "C" },
]
[parts.sub]
is = "D"
a.b = 3

[[parts.row]]
is = "E"
[[parts.row]]
is = "F"
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("name",), 2), (("long",), 3), (("parts",), 7), (("parts", "motor"), 8), (("parts", "motor", "J"), 8),
        (("parts", "quoted key"), 9), (("parts", "list"), 10), (("parts", "sub"), 13), (("parts", "sub", "is"), 14),
        (("parts", "sub", "a", "b"), 15), (("parts", "row"), 17), (("parts", "missing"), 7),
    ],
)  # fmt: skip
def test_lines(path: tuple[str, ...], line: int) -> None:
    assert locate(TEXT, "f.toml").source(*path).line == line


def test_the_text_of_the_line_comes_with_it() -> None:
    lines = locate(TEXT, "f.toml")
    assert lines.source("parts", "sub", "is") == Source("f.toml", 14, 'is = "D"')
    assert lines.source("nothing") == Source("f.toml")
    assert locate("x = '" + "y" * 500 + "'", "f.toml").source("x").text == "x = '" + "y" * 112 + "..."


def test_repetitions_are_found() -> None:
    assert locate("[a]\nx = 1\ny = 2\nx = 3\n", "f.toml").repeated == [(("a", "x"), 2, 4)]
    assert locate("[a]\nx = 1\n[a]\ny = 2\n", "f.toml").repeated == [(("a",), 1, 3)]
    assert locate("[a]\nx = {}\n[a.x]\ny = 2\n", "f.toml").repeated == [(("a", "x"), 2, 3)]
    assert locate("[a]\nx = 1\n[a.b]\ny = 2\n[a.b.c]\n[[r]]\n[[r]]\n", "f.toml").repeated == []


def test_a_right_text_has_no_repetitions_by_mistake() -> None:
    tomllib.loads(TEXT.replace("[[parts.row]]\nis", "[[parts.other]]\nis", 1))
    lines = locate(TEXT, "f.toml")
    assert [path for path, _, _ in lines.repeated if path != ("parts", "row", "is")] == []


HOSTILE = {
    "brackets": "x = " + "[" * 2_000_000,
    "braces": "x = " + "{a=" * 600_000,
    "headers": "[" * 2_000_000,
    "dots": "a." * 1_000_000 + "b = 1",
    "quotes": '"' * 2_000_000,
    "broken string": 'x = "' + "\\" * 2_000_000,
    "triple quotes": 'x = """' + '\\"""' * 500_000,
    "commas": "x = " + "," * 300_000,
    "entries": "x = {" + "a = 1, " * 200_000,
    "words": "a " * 500_000,
    "equals": "=" * 300_000,
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_hostile_texts_are_survived(text: str) -> None:
    with contextlib.suppress(NetlistError):
        assert locate(text, "f.toml").source("parts", "none").file == "f.toml"


@given(st.text(alphabet="[]{}=.,#'\"\\\n \tabc1", max_size=80))
def test_any_text_is_survived(text: str) -> None:
    lines = locate(text, "f.toml")
    assert all(1 <= number <= len(lines.text) for number in lines.numbers.values())


KEYS = st.text(alphabet="abcxyz", min_size=1, max_size=3)


@given(st.dictionaries(KEYS, st.dictionaries(KEYS, st.integers(), min_size=1, max_size=4), max_size=4))
def test_every_key_of_a_right_text_is_found(tables: dict[str, dict[str, int]]) -> None:
    text, expected = "", {}
    for table, entries in tables.items():
        text += f"\n[{table}]\n"
        for key, value in entries.items():
            expected[table, key] = text.count("\n") + 1
            text += f"{key} = {value}\n"
    lines = locate(text, "f.toml")
    assert tomllib.loads(text) == tables
    assert {path: lines.source(*path).line for path in expected} == expected
    assert not lines.repeated
