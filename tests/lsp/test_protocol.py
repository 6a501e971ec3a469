"""The language server as an editor meets it: messages over pipes."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlparse
from urllib.request import url2pathname

import pytest
from calls import called
from editor import Client

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVE = """# 😀 é
[parts]
motor = { is = "Torque", tau = "5 N.m" } # 😀
J1 = { is = "Inertja", J = "2 kg.m2" }
"""


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    """One server for all tests: it begins in seconds."""
    client = Client()
    yield client
    assert client.close() == 0


def applied(text: str, edits: list[dict[str, Any]]) -> str:
    """Apply edits whose characters are counted in UTF-16."""
    lines = text.split("\n")
    for edit in sorted(edits, key=lambda edit: (-edit["range"]["start"]["line"], -edit["range"]["start"]["character"])):
        (start, end), line = (edit["range"]["start"], edit["range"]["end"]), edit["range"]["start"]["line"]
        assert line == end["line"]
        units = lines[line].encode("utf-16-le")
        before, after = units[: 2 * start["character"]], units[2 * end["character"] :]
        lines[line] = before.decode("utf-16-le") + edit["newText"] + after.decode("utf-16-le")
    return "\n".join(lines)


def marked(text: str, place: dict[str, Any]) -> str:
    line = text.split("\n")[place["start"]["line"]].encode("utf-16-le")
    return line[2 * place["start"]["character"] : 2 * place["end"]["character"]].decode("utf-16-le")


def test_what_the_server_can(client: Client):
    can = client.capabilities
    assert can["positionEncoding"] == "utf-16"
    assert can["textDocumentSync"]["openClose"]
    for what in ("completion", "hover", "definition", "documentSymbol", "rename", "codeAction"):
        assert can[f"{what}Provider"]


def test_the_same_problems_as_check(client: Client, tmp_path: Path):
    file = tmp_path / "drive.toml"
    text = DRIVE + 'J2 = { is = "Inertia" }\n[series]\nx = ["motor", "J3"] # 😀\n'
    file.write_text(text, encoding="utf-8")
    listed = json.loads(called(["check", str(file), "--json"]).stdout)["problems"]
    diagnostics = client.open(file, text)
    assert [one["code"] for one in diagnostics] == [problem["kind"] for problem in listed]
    assert [marked(text, one["range"]) for one in diagnostics] == ["Inertja", "J3", 'J2 = { is = "Inertia" }']
    for one, problem in zip(diagnostics, listed, strict=True):
        assert one["message"].startswith(problem["what"])
        assert (one["range"]["start"]["line"], one["severity"]) == (problem["line"] - 1, 1)


def test_problems_come_and_go_while_typing(client: Client, tmp_path: Path):
    file = tmp_path / "drive.toml"
    assert len(client.open(file, DRIVE)) == 1
    client.change(file, DRIVE.replace("Inertja", "Inertjaa"), 2)  # not checked: the next change follows at once
    good = DRIVE.replace("Inertja", "Inertia") + '[series]\nx = ["motor", "J1"]\n[start]\nJ1.phi = 0\nJ1.w = 0\n'
    client.change(file, good, 3)
    assert client.notified("textDocument/publishDiagnostics")["diagnostics"] == []
    client.change(file, good + "[", 4)
    (broken,) = client.notified("textDocument/publishDiagnostics")["diagnostics"]
    assert "is not TOML" in broken["message"]
    client.tell("textDocument/didClose", {"textDocument": {"uri": file.as_uri()}})
    assert client.notified("textDocument/publishDiagnostics")["diagnostics"] == []


def test_notes_are_told_as_information(client: Client, tmp_path: Path):
    text = DRIVE.replace("Inertja", "Inertia") + '[series]\nx = ["motor", "J1"]\n'
    (note,) = client.open(tmp_path / "drive.toml", text)
    assert (note["code"], note["severity"]) == ("note", 3)
    assert "start value" in note["message"]


def test_other_files_are_left_alone(client: Client, tmp_path: Path):
    assert client.open(tmp_path / "pyproject.toml", "[tool.ruff]\nline-length = 'x'\n[[[") == []
    assert client.open(tmp_path / "cosim.toml", '[parts]\na = { is = "FMU", file = "a.fmu" }\n') == []


@pytest.mark.parametrize("file", ["sizing/machine_table.toml", "sizing/lepelletier.toml", "two_mass.toml"])
def test_examples_are_right(client: Client, file: str):
    assert client.open(EXAMPLES / file, (EXAMPLES / file).read_text(encoding="utf-8")) == []


def test_a_sizing_file_is_checked_without_a_run(client: Client, tmp_path: Path):
    text = """[parameters]
t = "3 N.m"
[checks.a]
is = "shaft_strss"
[checks.b]
is = "shaft_stress"
bending = "t"
torque = { from = "not_there.toml", peak = "a.tau" }
diameter = "32 kg"
[checks.c]
is = "shaft_stress"
bendng = 0
[checks.d]
is = "shaft_stress"
bending = "u"
torque = 0
diameter = "3 mm"
yield_strength = "200 N/mm2"
required_safety = 2
"""
    diagnostics = client.open(tmp_path / "sizing.toml", text)
    assert {marked(text, one["range"]) for one in diagnostics} >= {"shaft_strss", "bendng", "u"}
    assert not any("not_there" in one["message"] for one in diagnostics)


def test_an_error_of_a_netlist_inside_stands_where_it_is_used(client: Client, tmp_path: Path):
    (tmp_path / "box.toml").write_text('[parts]\na = { is = "Inertja" }\n')
    text = '[parts]\nb = { is = "./box.toml" }\n'
    (one,) = client.open(tmp_path / "drive.toml", text)
    assert marked(text, one["range"]) == "./box.toml"


def test_places_are_counted_as_the_client_does(tmp_path: Path):
    text = 'name = "😀😀é"\n[parts]\n"😀é" = { is = "Inertja" }\n'
    for encoding, begin in (("utf-8", 6 + 9 + 7), ("utf-16", 3 + 12 + 5), ("utf-32", 3 + 12 + 4)):
        client = Client(encoding)
        assert client.capabilities["positionEncoding"] == encoding
        (one, *_) = client.open(tmp_path / "drive.toml", text)
        line = text.split("\n")[2]
        codec = {"utf-8": "utf-8", "utf-16": "utf-16-le", "utf-32": "utf-32-le"}[encoding]
        width = {"utf-8": 1, "utf-16": 2, "utf-32": 4}[encoding]
        start = one["range"]["start"]["character"]
        assert start == len(line[: line.index("Inertja")].encode(codec)) // width
        items = client.at("completion", tmp_path / "drive.toml", 2, start + 2)
        assert items[0]["textEdit"]["range"]["start"]["character"] == start
        assert client.close() == 0
        assert begin


def test_completion_is_taken(client: Client, tmp_path: Path):
    file = tmp_path / "drive.toml"
    client.open(file, DRIVE)
    items = {item["label"]: item for item in client.at("completion", file, 3, 16 + 3)}
    assert items["Inertia"]["detail"].startswith("Rigid rotating mass")
    assert applied(DRIVE, [items["Inertia"]["textEdit"]]) == DRIVE.replace("Inertja", "Inertia")


def test_hover_is_plain_text(client: Client, tmp_path: Path):
    file = tmp_path / "drive.toml"
    client.open(file, DRIVE.replace("Inertja", "Inertia"))
    hover = client.at("hover", file, 3, DRIVE.split("\n")[3].index("J ="))
    assert hover["contents"] == {"kind": "plaintext", "value": "J: moment of inertia [kg.m2]; at least 0"}
    assert client.at("hover", file, 0, 3) is None


def test_definition_and_symbols(client: Client, tmp_path: Path):
    file = tmp_path / "drive.toml"
    text = DRIVE + '[series]\nx = ["motor", "J1"]\n'
    client.open(file, text)
    place = client.at("definition", file, 5, 8)
    assert (place["uri"], marked(text, place["range"])) == (file.as_uri(), "motor")
    place = client.at("definition", file, 2, 18)
    source = Path(url2pathname(urlparse(place["uri"]).path)).read_text(encoding="utf-8").split("\n")
    assert source[place["range"]["start"]["line"]].startswith("class Torque(")
    symbols = client.ask("textDocument/documentSymbol", {"textDocument": {"uri": file.as_uri()}})
    assert [symbol["name"] for symbol in symbols] == ["parts", "series"]
    assert [(inner["name"], inner["detail"]) for inner in symbols[0]["children"]] == [
        ("motor", "Torque"), ("J1", "Inertja"),
    ]  # fmt: skip


def test_rename(client: Client, tmp_path: Path):
    file = tmp_path / "drive.toml"
    text = DRIVE + '[series]\nx = ["motor", "J1"] # 😀\n[start]\n"J1.w" = 0\n'
    client.open(file, text)
    changes = client.at("rename", file, 5, 16, newName="rotor")["changes"]
    assert [*changes] == [file.as_uri()]
    assert applied(text, changes[file.as_uri()]) == text.replace("J1", "rotor")
    place = {"textDocument": {"uri": file.as_uri()}, "position": {"line": 5, "character": 16}, "newName": "motor"}
    assert client.answer("textDocument/rename", place)["error"]["message"] == "The netlist has a part 'motor' already."


def fix(client: Client, file: Path, text: str) -> str:
    """Take the first quick fix of a text."""
    diagnostics = client.open(file, text)
    context = {"diagnostics": diagnostics[:1]}
    asked = {"textDocument": {"uri": file.as_uri()}, "range": diagnostics[0]["range"], "context": context}
    (action, *_) = client.ask("textDocument/codeAction", asked)
    return applied(text, action["edit"]["changes"][file.as_uri()])


def test_quick_fixes(client: Client, tmp_path: Path):
    file = tmp_path / "drive.toml"
    text = fix(client, file, DRIVE)
    assert text == DRIVE.replace("Inertja", "Inertia")
    gear = '[parts]\nm = { is = "Torque", tau = 1 }\ng = { is = "IdealGear", ratio = 2 }\n[series]\nx = ["m", "g"]\n'
    text = fix(client, file, gear)
    assert text == 'free = ["g.flange_b"]\n\n' + gear
    text = fix(client, file, gear.replace("[series]", 'r = { is = "Inertia", J = 1 }\n[series]'))
    assert text.endswith('x = ["m", "g"]\n\n[connect]\ng_r = ["g.flange_b", "r.flange_a"]\n')
    text = fix(
        client, file, '[parts]\nm = { is = "Torque" }\nr = { is = "Inertia", J = 1 }\n[series]\nx = ["m", "r"]\n'
    )
    assert 'm = { is = "Torque", tau = "… N.m" }' in text
    text = fix(client, file, '[parts]\na = { is = "Inertia" }\n')
    assert text == '[parts]\na = { is = "Inertia", J = "… kg.m2" }\n'
    (one, *_) = client.open(file, text)
    assert "… kg.m2" in one["message"]


def test_no_code_runs_without_trust(tmp_path: Path):
    (tmp_path / "own.py").write_text(
        "from pathlib import Path\nPath(__file__).with_name('ran').write_text('')\n"
        "print('Content-Length: 3\\r\\n\\r\\nabc')\n"
        "from modelica_like.language import *\nfrom components import Inertia\nclass Hub(Inertia):\n    'A hub.'\n"
    )
    text = '[parts]\na = { is = "own:Hub", J = 1, phi = 0, w = 0 }\n[start]\n"a.w" = 0\n'
    file = tmp_path / "drive.toml"
    client = Client()
    (one, *_) = client.open(file, text)
    assert (one["code"], marked(text, one["range"])) == ("UntrustedModule", 'is = "own:Hub"')
    client.at("completion", file, 1, 27)
    client.at("completion", file, 3, 3)
    client.at("hover", file, 1, 18)
    client.at("definition", file, 1, 18)
    assert client.close() == 0
    assert not (tmp_path / "ran").exists()
    trusting = Client(words=("--trust",))
    assert trusting.open(file, text) == []
    assert (tmp_path / "ran").exists()
    assert trusting.at("hover", file, 1, 18)["contents"]["value"] == "Hub\n\nA hub."
    assert trusting.at("definition", file, 1, 18)["uri"].endswith("own.py")
    assert trusting.close() == 0


HOSTILE = {
    "control characters": '[parts]\na = { is = "' + "".join(map(chr, range(1, 32))) + '\x7f" }\n',
    "line separators": '[parts]\na\u2028b\x0b\x0c\x85 = { is = "Iner\u2028tja" }\nc = { is = "Inertja" }\n',
    "half a character": '[parts]\na = { is = "\\ud800" }\n',
    "a huge line": '[parts]\np = { is = "Inertia", J = 1 }\n[series]\nx = [' + '"p", ' * 50_000 + '"q"]\n',
    "a huge word": '[parts]\np = { is = "' + "x" * 200_000 + '" }\n',
    "a huge key": "[parts]\n" + "x" * 200_000,
    "brackets": "[parts]\nx = " + "[" * 100_000,
    "open strings": '[parts]\nx = "' + '\\"' * 50_000,
    "dots": "[parts]\n" + "a." * 50_000,
    "many mistakes": "[parts]\n" + "".join(f'p{k} = {{ is = "Inertja" }}\n' for k in range(2000)),
    "nothing": "",
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_texts_are_survived(client: Client, case: str, tmp_path: Path):
    text, file = HOSTILE[case], tmp_path / "drive.toml"
    diagnostics = client.open(file, text)
    assert len(diagnostics) <= 101
    assert all(len(one["message"]) < 3000 for one in diagnostics)
    for method in ("hover", "completion", "definition"):
        for line, character in ((0, 0), (1, 3), (1, 14), (3, 60), (9, 10**6)):
            client.at(method, file, line, character)
    client.ask("textDocument/documentSymbol", {"textDocument": {"uri": file.as_uri()}})
    if case == "line separators":
        lines = text.split("\n")
        assert [one["range"]["start"]["line"] for one in diagnostics] == [1] or len(lines) == 4


def test_garbage_ends_nothing(client: Client, tmp_path: Path):
    nowhere = {"textDocument": {"uri": "untitled:Untitled-1"}, "position": {"line": 5, "character": 5}}
    client.answer("textDocument/hover", nowhere)
    client.answer("textDocument/nothing", nowhere)
    client.tell("textDocument/didChange", {"textDocument": 3})
    client.tell("no/method", {})
    assert client.open(tmp_path / "drive.toml", "") == []


def test_saved_files_are_checked_again_with_those_that_use_them(client: Client, tmp_path: Path):
    box, drive = tmp_path / "box.toml", tmp_path / "drive.toml"
    right = '[parts]\na = { is = "Inertia", J = 1, phi = 0, w = 0 }\n'
    box.write_text(right.replace("Inertia", "Inertja"), encoding="utf-8")
    assert len(client.open(drive, '[parts]\nb = { is = "./box.toml" }\n')) == 1
    box.write_text(right, encoding="utf-8")
    client.tell("textDocument/didSave", {"textDocument": {"uri": drive.as_uri()}})
    while (told := client.notified("textDocument/publishDiagnostics"))["uri"] != drive.as_uri():
        pass
    assert told["diagnostics"] == []


def test_without_the_extra():
    # A module of this name that cannot be imported stands before the real one.
    blocked = "import sys; sys.modules['pygls'] = None; from modelica_like.cli import run; run(['lsp'])"
    done = subprocess.run([sys.executable, "-c", blocked], capture_output=True, text=True, env=os.environ, timeout=120)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == 'pygls is not installed.\nInstall it with: pip install "modelica-like[lsp]"\n'
