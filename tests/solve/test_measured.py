"""Tables as spreadsheets write them: the same numbers from every encoding, separator and decimal mark."""

import random
from itertools import product
from pathlib import Path

import pytest

from modelica_like.errors import ModelicaLikeError, NetlistError
from modelica_like.runs.measured import read_columns

NUMBERS = {"time": (0.0, 0.5, 1.0), "Öl [°C]": (20.25, -3.5e-4, 1e3), "τ": (1.0, 2.0, 3.0)}
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "cp1252")


def written(separator: str, comma: bool, *, end: str, said: bool, trailing: bool) -> str:
    rows = [
        list(NUMBERS),
        *([repr(x).replace(".", "," if comma else ".") for x in row] for row in zip(*NUMBERS.values(), strict=True)),
    ]
    tail = separator * 2 * trailing
    return f"sep={separator}{end}" * said + "".join(f"{separator.join(row)}{tail}{end}" for row in rows)


@pytest.mark.parametrize(("encoding", "separator", "end"), [*product(ENCODINGS, ",;\t", ("\n", "\r\n"))])
def test_every_form_has_the_same_numbers(encoding: str, separator: str, end: str, tmp_path: Path) -> None:
    path = tmp_path / "measured.csv"
    for comma, said, trailing in product((False, True), repeat=3):
        if comma and separator == ",":
            continue
        text = written(separator, comma, end=end, said=said, trailing=trailing)
        if encoding == "cp1252":
            text = text.replace("τ", "tau")
        path.write_bytes(text.encode(encoding))
        columns = read_columns(path)
        assert [column.tolist() for column, _ in columns.values()] == [list(row) for row in NUMBERS.values()]
        assert [unit for _, unit in columns.values()] == ["", "°C", ""]
        assert list(columns)[1] == "Öl"


WRONG = {
    "a point beside decimal commas": (b"time;x\n0;1.234\n1;1,5\n", """\
bad.csv:2: '1.234' is not a number.
Write numbers without separators of thousands, all with the same decimal mark."""),
    "thousands": (b'time,x\n0,"1,234.5"\n', """\
bad.csv:2: '1,234.5' is not a number.
Write numbers without separators of thousands, all with the same decimal mark."""),
    "neither encoding": (b"time,x\n0,\x81\n", "bad.csv is not a text: a table is UTF-8, UTF-16 or Windows-1252."),
    "an odd byte": (b"\xff\xfet\x00i\x00m", "bad.csv is not a text: a table is UTF-8, UTF-16 or Windows-1252."),
    "bytes of zero": (b"time,x\n0,\x00\n", "bad.csv is not a text: a table is UTF-8, UTF-16 or Windows-1252."),
    "nothing": (b"", "bad.csv is not a table: it needs a line of names, and lines of numbers."),
    "a name twice": (b"time,x,x\n0,1,2\n", "bad.csv: two columns are called 'x'.\nRename one of them."),
    "an endless cell": (b'time,x\n0,"' + b"1" * 200_000 + b'"\n', """\
bad.csv:2: this is no line of a table: field larger than field limit (131072)."""),
    "a cell without a number": (b"time;x\n0;\n1;2\n", "bad.csv:2: '' is not a number."),
    "too few": (b"time;x\n0\n", "bad.csv:2: 1 values under 2 names."),
}  # fmt: skip


@pytest.mark.parametrize(("data", "sentence"), WRONG.values(), ids=WRONG.keys())
def test_what_is_no_table_is_told(data: bytes, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_bytes(data)
    with pytest.raises(NetlistError) as caught:
        read_columns(path)
    assert str(caught.value) == sentence


def test_random_bytes_are_numbers_or_a_sentence(tmp_path: Path) -> None:
    chance, path = random.Random(28), tmp_path / "any.csv"
    read = 0
    for _ in range(2_000):
        form = chance.choice(";,\t"), chance.random() < 0.5
        text = written(*form, end=chance.choice(("\n", "\r\n", "\r")), said=chance.random() < 0.2, trailing=False)
        data = bytearray(text.encode(chance.choice(ENCODINGS), "replace"))
        for _ in range(chance.randrange(4)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        path.write_bytes(data[: chance.randrange(len(data))] if chance.random() < 0.3 else data)
        try:
            read_columns(path)
            read += 1
        except ModelicaLikeError:
            continue
    assert read > 200
