"""Errors and notes as data, with their places and with suggestions that can be applied."""

import json
import pickle
import unicodedata
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from calls import called
from payloads import texts

from modelica_like import errors
from modelica_like.edit import apply
from modelica_like.errors import FreeFlange, ModelicaLikeError, Source, WiringErrors
from modelica_like.netlist import loads

KEYS = {"kind", "file", "line", "column", "length", "path", "what", "why", "advice", "places", "suggestion"}
PLACE = {"file", "line", "column", "length", "path"}
EXAMPLES = Path(__file__).parents[2] / "examples"


def problems(file: Path, command: str = "check") -> list[dict[str, Any]]:
    result = called([command, str(file), "--json"])
    return json.loads(result.stdout)["problems"]


def marked(text: str, problem: dict[str, Any]) -> str:
    line = text.split("\n")[problem["line"] - 1]
    return line[problem["column"] - 1 :][: problem["length"]]


def applied(text: str, suggestions: Sequence[dict[str, Any]]) -> str:
    lines = text.split("\n")
    for change in sorted(suggestions, key=lambda change: -change["column"]):
        line, begin, end = lines[change["line"] - 1], change["column"] - 1, change["column"] - 1 + change["length"]
        assert line[begin:end] == change["old"]
        lines[change["line"] - 1] = line[:begin] + change["new"] + line[end:]
    return "\n".join(lines)


SLIPS = """
[parts]
motor = { is = "Torq", tau = "5 Nm" }
n = { is = "Inertia", J = "0.02 kg.m2", n = 3 }
  [parts.shaft]
  is = "SpringDampr" # not SpringDamper
  c = "400 N.m/rad"
  d = "0.2 N.m.s/rad"
J2 = "x"
[series]
drive = [
  "motor", "n",
  "shaft",  "J3" ]
[start]
"n.phii" = "0 rad"
[simulte]
until = "1 s"
"""


def test_places_and_suggestions(tmp_path: Path):
    file = tmp_path / "slips.toml"
    file.write_text(SLIPS, encoding="utf-8")
    result = called(["check", str(file), "--json"])
    listed = json.loads(result.stdout)["problems"]
    assert result.exit_code == 2
    assert all(set(problem) == KEYS and problem["file"] == str(file) for problem in listed)
    assert [(marked(SLIPS, problem), problem["path"]) for problem in listed] == [
        ("simulte", "simulte"), ("Torq", "parts.motor.is"), ("n", "parts.n.n"), ("SpringDampr", "parts.shaft.is"),
        ("phii", "start.n.phii"), ("J3", "series.drive"),
    ]  # fmt: skip
    assert (listed[2]["line"], listed[2]["column"]) == (4, SLIPS.split("\n")[3].index("n = 3") + 1)
    swaps = [problem["suggestion"] for problem in listed if problem["suggestion"]]
    assert {(swap["old"], swap["new"]) for swap in swaps} == {
        ("simulte", "simulate"), ("Torq", "Torque"), ("SpringDampr", "SpringDamper"), ("phii", "phi"),
    }  # fmt: skip
    again = applied(SLIPS, swaps)
    assert '"5 Nm"' in again
    file.write_text(again, encoding="utf-8")
    left = [(problem["kind"], marked(again, problem)) for problem in problems(file)]
    assert left == [("UnitError", "Nm"), ("UnknownName", "n"), ("UnknownName", "J2"), ("UnknownName", "J3")]


UNITS = {
    'a = { is = "Inertia", J = "2 kgm2" }': ("kgm2", "kg.m2"),
    't = { is = "Torque", tau = "5 Nm" }': ("Nm", "N.m"),
    'b = { is = "Brake", capacity = 1, mode = "stick" }': ("stick", "stuck"),
    'a = { is = "Inertia", J = "sqr(4)" }': ("sqr", "sqrt"),
}


@pytest.mark.parametrize("line", UNITS)
def test_a_word_in_a_value_is_replaced(line: str, tmp_path: Path):
    file = tmp_path / "drive.toml"
    file.write_text(f"[parts]\n{line}\n", encoding="utf-8")
    first = problems(file)[0]
    swap = first["suggestion"]
    assert (swap["operation"], swap["old"], swap["new"], swap["line"]) == ("replace", *UNITS[line], 2)
    assert line[swap["column"] - 1 :].startswith(swap["old"])


def test_a_word_that_is_there_twice_is_not_replaced(tmp_path: Path):
    file = tmp_path / "drive.toml"
    file.write_text('[parts]\na = { is = "Inertia", J = 1 }\n[series]\nx = ["b", "a", "b"]\n', encoding="utf-8")
    (problem,) = problems(file)
    assert (problem["suggestion"], problem["line"], problem["column"]) == (None, 4, 1)


def test_a_free_flange_and_a_missing_value(tmp_path: Path):
    file = tmp_path / "drive.toml"
    file.write_text('[parts]\na = { is = "Inertia" }\nb = { is = "IdealGear", ratio = 2 }\n'
                    '[connect]\nx = ["a.flange_b", "b.flange_a"]\n', encoding="utf-8")  # fmt: skip
    suggestions = [problem["suggestion"] for problem in problems(file)]
    assert suggestions == [
        {"operation": "set", "path": "a.J", "unit": "kg.m2", "file": str(file)},
        {"operation": "free", "end": "b.flange_b", "file": str(file)},
    ]


MOTOR = '[parts]\nm = { is = "Torque", tau = 1 }\ng = { is = "IdealGear", ratio = 2 }\n'
FIXABLE = {
    "a free end, and one part without connections": (
        MOTOR + 'load = { is = "Inertia", J = 1 }\n[series]\nx = ["m", "g"]\n',
        {"operation": "connect", "first": "g.flange_b", "second": "load.flange_a"},
        "",
    ),
    "a free end, and two parts without connections": (
        MOTOR + 'r = { is = "Inertia", J = 1 }\n'
        'load = { is = "Inertia", J = 1 }\nother = { is = "Inertia", J = 1 }\n[series]\nx = ["m", "r", "g"]\n',
        {"operation": "free", "end": "g.flange_b"},
        "",
    ),
    "a free end, and another that would close a loop": (
        MOTOR + 'r = { is = "Inertia", J = 1 }\n[connect]\nx = ["r.flange_b", "g.flange_a", "m.flange"]\n',
        {"operation": "free", "end": "g.flange_b"},
        "",
    ),
    "an input": (
        '[parts]\nm = { is = "Torque" }\nr = { is = "Inertia", J = 1 }\n[series]\nx = ["m", "r"]\n',
        {"operation": "set", "path": "m.tau", "unit": "N.m", "value": "3 N.m"},
        "",
    ),
    "two speeds on one shaft": (
        '[parts]\na = { is = "ConstantSpeed", w_fixed = 3 }\nr = { is = "Inertia", J = 1 }\n'
        'b = { is = "ConstantSpeed", w_fixed = 4 }\n[series]\nx = ["a", "r", "b"]\n',
        {"operation": "insert", "name": "spring", "kind": "SpringDamper", "between": ["r.flange_b", "b.flange"]},
        "spring.c (SpringDamper) has no value.",
    ),
    "two fixed slides": (
        '[parts]\na = { is = "TranslationalFixed" }\nb = { is = "TranslationalFixed" }\n[series]\nx = ["a", "b"]\n',
        {"operation": "insert", "name": "spring", "kind": "TranslationalSpringDamper",
         "between": ["a.flange", "b.flange"]},
        "spring.c (TranslationalSpringDamper) has no value.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FIXABLE)
def test_a_suggestion_is_an_operation(case: str, tmp_path: Path):
    file = tmp_path / "drive.toml"
    text, expected, left = FIXABLE[case]
    file.write_text(text, encoding="utf-8")
    (problem,) = problems(file)
    suggestion = problem["suggestion"]
    assert {**suggestion, "file": ""} == {**{key: expected[key] for key in expected if key != "value"}, "file": ""}
    file.write_text(apply(text, {**suggestion, **expected}, file=file).text, encoding="utf-8")
    errors = [problem["what"] for problem in problems(file) if problem["kind"] != "note"]
    assert errors[:1] == ([left] if left else [])


MISSPELLED = {
    'a = { is = "Inertia", j = 1 }': ("a.j", "J"),
    'a = { is = "Inertia", inertia = 1 }': ("a.inertia", "J"),
    'a = { is = "Inertia", Jx = 1 }': ("a.Jx", "J"),
    'a = { is = "Inertia", colour = 1 }': ("a.colour", None),
}


@pytest.mark.parametrize("line", MISSPELLED)
def test_a_misspelled_name_is_told_once(line: str, tmp_path: Path):
    file = tmp_path / "drive.toml"
    file.write_text(f"[parts]\n{line}\n", encoding="utf-8")
    (problem,) = problems(file)
    path, meant = MISSPELLED[line]
    assert (problem["path"], (problem["suggestion"] or {}).get("new")) == (f"parts.{path}", meant)


def test_an_end_of_another_kind_is_replaced(tmp_path: Path):
    file = tmp_path / "drive.toml"
    text = (
        '[parts]\na = { is = "Inertia", J = 1 }\ns = { is = "BallScrew", lead = "10 mm" }\n'
        '[connect]\nx = ["a.flange_b", "s.flange_b"]\n'
    )
    file.write_text(text, encoding="utf-8")
    for problem in problems(file):
        if problem["kind"] == "WrongConnection":
            swap = problem["suggestion"]
            assert (swap["old"], swap["new"]) == ("s.flange_b", "s.flange_a")


def test_notes_are_problems_of_a_kind(tmp_path: Path):
    file = tmp_path / "drive.toml"
    file.write_text("""[parts]
a = { is = "Inertia", J = 1, phi = 0, w = 0 }
s = { is = "SpringDamper", c = 1, d = 1 }
b = { is = "Inertia", J = "1 g.cm2", phi = 0, w = 0 }
[series]
x = ["a", "s", "b"]
""", encoding="utf-8")  # fmt: skip
    result = called(["check", str(file), "--json"])
    (note,) = json.loads(result.stdout)["problems"]
    assert (result.exit_code, note["kind"], note["line"], note["path"]) == (0, "note", 2, "parts.a")
    assert note["what"].startswith("a.J is 1e+07 times b.J")
    assert note["what"] in result.stderr


@pytest.mark.parametrize("command", ["simulate", "modes", "steady", "size", "describe"])
def test_other_commands_that_fail(command: str, tmp_path: Path):
    file = tmp_path / "drive.toml"
    file.write_text('[parts]\na = { is = "Inertja" }\n', encoding="utf-8")
    result, plain = called([command, str(file), "--json"]), called([command, str(file)])
    assert (result.exit_code, result.stderr) == (plain.exit_code, plain.stderr)
    assert plain.stdout == ""
    listed = json.loads(result.stdout)["problems"]
    assert listed
    assert all(set(problem) == KEYS and problem["what"] in plain.stderr for problem in listed)


def test_what_is_no_error_of_the_family(tmp_path: Path):
    (tmp_path / "folder.csv").mkdir()
    result = called(["simulate", str(EXAMPLES / "two_mass.toml"), "--csv", str(tmp_path / "folder.csv"), "--json"])
    (problem,) = json.loads(result.stdout)["problems"]
    assert (problem["kind"], problem["file"], result.exit_code) == (
        "IsADirectoryError",
        str(tmp_path / "folder.csv"),
        2,
    )
    (problem,) = json.loads(called(["check", "x.toml", "--jsn", "--json"]).stdout)["problems"]
    assert (problem["kind"], problem["what"]) == ("Usage", "No such option '--jsn'; did you mean '--json'?")


def test_a_table_on_the_screen_leaves_stderr_to_json(tmp_path: Path):
    result = called(["simulate", str(tmp_path / "none.toml"), "--csv", "-", "--json"])
    assert result.stdout == ""
    assert len(json.loads(result.stderr)["problems"]) == 1


def test_every_error_is_data_also_of_another_process():
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, ModelicaLikeError)]
    assert len(kinds) > 40
    place = Source("f.toml", 3, "x = 1", 1, 5, "parts.x", "x = 1")
    several = WiringErrors("2 errors", errors=[FreeFlange("a", where=place), FreeFlange("b")])
    given: Any = {"where": [place, Source("g.py", 7)], "why": "why", "advice": "advice", "word": "x", "instead": "y"}
    for kind in kinds:
        error = several if kind is WiringErrors else kind("what", **given)
        data = error.as_json()
        assert json.loads(json.dumps(data)) == data
        assert data["kind"] == kind.__name__
        assert set(data) - {"problems"} == KEYS
        assert all(set(other) == PLACE for other in data["places"])
        assert [problem.as_json() for problem in pickle.loads(pickle.dumps(error)).problems()] == [
            problem.as_json() for problem in error.problems()
        ]


def told(text: str, file: Path) -> Sequence[ModelicaLikeError]:
    try:
        loads(text, str(file))
    except ModelicaLikeError as error:
        return error.problems()
    return ()


def test_hostile_texts_stay_texts(tmp_path: Path):
    for text in texts():
        for problem in told(text, tmp_path / "drive.toml"):
            data = problem.as_json()
            assert json.loads(json.dumps(data)) == data
            if data["column"]:
                assert marked(text, data)
            if swap := data["suggestion"]:
                assert marked(text, swap) == swap["old"]


@pytest.mark.parametrize("control", [chr(code) for code in range(32) if chr(code) not in "\t\n\r"] + ["\x7f", "\x00"])
def test_control_characters_reach_no_terminal(control: str, tmp_path: Path):
    assert unicodedata.category(control) == "Cc"
    file = tmp_path / "drive.toml"
    file.write_text(f'[parts]\na = {{ is = "Iner{control}tia" }}\n', encoding="utf-8", newline="")
    result = called(["check", str(file), "--json"])
    assert control not in result.stdout
    assert result.exit_code == 2
    assert json.loads(result.stdout)["problems"][0]["line"] == 2


def test_a_huge_line_is_marked_where_it_is_wrong(tmp_path: Path):
    file = tmp_path / "drive.toml"
    parts = ", ".join(f'"p{k}"' for k in range(20_000))
    text = f'[parts]\np = {{ is = "Inertia", J = 1 }}\n[series]\nx = [{parts}, "q"]\n'
    file.write_text(text, encoding="utf-8")
    (problem,) = problems(file)
    assert marked(text, problem) == "p0"
    assert len(json.dumps(problem)) < 5000
