"""The positions of keys and values: at each stands what the reader of the standard library finds there."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

from modelica_like.edit.sheet import Sheet
from modelica_like.edit.tree import Tree
from modelica_like.netlist.outline import Outline, decoded

EXAMPLES = Path(__file__).parents[2] / "examples"
HARD = r'''# a comment with = and [brackets]
name = "a = [b] # no comment" # one
"quoted.key" = 'C:\path'
text = """
x = 1 \
   # no comment
""""
'''
HARD += r"""
plain = '''
'quoted' ''two'' '''
escaped = "\"\\\u00e4\t" 	# tab
number = 1_000.5e-3
date = 1979-05-27 07:32:00
yes=true
empty = []
none = {}
nested = [ [1, 2], # one
  [ 3 , "]" ] , # two
  [
  "a = b",
  'c = [' ],
]
a.b."c d".e = { f.g = "1" , h = [{ i = "}" }, {}], j = 'x' }

  [ parts . "sub table" ] # a header
  x = 1
[[rows]]
is = "E"
inner = { k = 1 }
[rows.deeper]
l = 2
[[rows]]
is = "F"
[[rows.more]]
m = 3
[[rows.more]]
m = 4
"""


def at(data: Any, path: tuple[str | int, ...]) -> Any:
    for name in path:
        data = data[name]
    return data


def leaves(data: Any, path: tuple[str | int, ...] = ()) -> set[tuple[str | int, ...]]:
    """Return the paths of all values; elements of lists that are no tables belong to the list."""
    if isinstance(data, dict):
        return {leaf for name, value in data.items() for leaf in leaves(value, (*path, name))} or {path}
    if isinstance(data, list) and any(isinstance(item, dict) for item in data):
        return {leaf for k, item in enumerate(data) for leaf in leaves(item, (*path, k))}
    return {path}


@pytest.mark.parametrize("text", [HARD, HARD.replace("\n", "\r\n"), HARD.strip()], ids=["plain", "windows", "open end"])
def test_hard_texts(text: str) -> None:
    check(text)


def test_examples() -> None:
    for path in EXAMPLES.rglob("*.toml"):
        check(path.read_bytes().decode())


def check(text: str) -> None:
    tree, data = Tree(Outline(text)), tomllib.loads(text)
    for path, entry in tree.entries.items():
        # Line breaks of Windows count as one character to the reader.
        written = text[entry.value.start : entry.value.end].replace("\r\n", "\n")
        assert decoded(written) == at(data, path), path
        assert [decoded(text[item.start : item.end]) for item in entry.value.items or []] == (
            at(data, path) if entry.value.items else []
        )
        assert [*map(decoded_name, entry.names, [text] * len(entry.names))] == [*path[len(path) - len(entry.names) :]]
    missing = {leaf for leaf in leaves(data) if leaf not in tree.entries}
    assert all(any(leaf[:k] in tree.entries for k in range(len(leaf))) for leaf in missing), missing


def decoded_name(span: tuple[int, int], text: str) -> str:
    name = text[slice(*span)]
    return decoded(name) if name[0] in "\"'" else name


def test_every_key_of_a_hard_text_is_removed_and_written() -> None:
    data = tomllib.loads(HARD)
    for path in Tree(Outline(HARD)).entries:
        sheet = Sheet(HARD, "hard.toml")
        sheet.delete([path])
        sheet.commit()
        assert path not in Tree(Outline(sheet.text)).entries
        assert len(leaves(data)) - len(leaves(sheet.data)) >= 0
        sheet = Sheet(HARD, "hard.toml")
        sheet.write(path, "new # text")
        sheet.commit()
        assert at(sheet.data, path) == "new # text"
        again = Sheet(HARD, "hard.toml")
        again.write((*path[:-1], "another"), 1)
        again.commit()
        assert at(again.data, (*path[:-1], "another")) == 1
