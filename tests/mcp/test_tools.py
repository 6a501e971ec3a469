"""The tools of the Model Context Protocol as a program meets them: its own client, over pipes."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from anyio.from_thread import start_blocking_portal
from jsonschema import Draft202012Validator
from mcp import Client, MCPError, StdioServerParameters, stdio_client
from mcp_types import CallToolResult, Tool

from modelica_like import load
from modelica_like.edit.document import OPERATIONS
from modelica_like.mcp import tools
from modelica_like.mcp.turns import Call, Turns
from modelica_like.show.report.problems import netlist_problems

EXAMPLES = Path(__file__).parents[2] / "examples"
LONGEST = 4000
"""Characters of an answer about an example: some hundred tokens."""
DRIVE = """[parts]
m = { is = "Torque", tau = "6 N.m" }
J = { is = "Inertia", J = "2 kg.m2", w = 0, phi = 0 }
d = { is = "Damper", d = "3 N.m.s/rad" }
wall = { is = "Fixed" }
[series]
x = ["m", "J", "d", "wall"]
"""


class Program:
    """A program that uses the tools."""

    def __init__(self, use: Callable[..., CallToolResult], listed: list[Tool]) -> None:
        self._use, self.listed = use, listed

    def ask(self, tool: str, /, **arguments: Any) -> tuple[dict[str, Any], bool]:
        result = self._use(tool, arguments)
        (content,) = result.content
        assert content.type == "text"
        return json.loads(content.text), result.is_error

    def __call__(self, tool: str, /, **arguments: Any) -> dict[str, Any]:
        answer, failed = self.ask(tool, **arguments)
        assert not failed, answer
        return answer

    def refused(self, tool: str, /, **arguments: Any) -> str:
        answer, failed = self.ask(tool, **arguments)
        assert failed, answer
        return answer["problems"][0]["what"]


@contextmanager
def program(folder: Path, *words: str, before: str = "", patience: float | None = None) -> Iterator[Program]:
    """Begin a server, and a client of it.

    Args:
        folder: of the netlists.
        words: further arguments of the command.
        before: Python that the server's process does first.
        patience: seconds after which the client cancels a call.
    """
    variables = {"MODELICA_LIKE_CONFIG": os.environ["MODELICA_LIKE_CONFIG"]}
    code = f"{before}\nfrom modelica_like.cli import main\nmain()"
    command = StdioServerParameters(
        command=sys.executable, args=["-c", code, "mcp", str(folder), *words], env=variables
    )
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(Client(stdio_client(command))) as client:
        listed = portal.call(client.list_tools).tools
        yield Program(lambda name, arguments: portal.call(client.call_tool, name, arguments, patience), listed)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("outer") / "inner"
    shutil.copytree(EXAMPLES, folder, ignore=lambda _, names: [name for name in names if not name.endswith(".toml")])
    (folder / "drive.toml").write_text(DRIVE, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def ask(folder: Path) -> Iterator[Program]:
    """One program for all tests: its server begins in seconds."""
    with program(folder) as client:
        yield client


def test_every_tool_is_described(ask: Program) -> None:
    assert [tool.name for tool in ask.listed] == [*OPERATIONS, *tools.OWN]
    tried = Path(__file__).read_text(encoding="utf-8")
    for tool in ask.listed:
        assert f'"{tool.name}"' in tried  # each is used here
        assert tool.description
        Draft202012Validator.check_schema(tool.input_schema)
        assert all(entry["description"] for entry in tool.input_schema["properties"].values())
        assert set(tool.input_schema["required"]) <= set(tool.input_schema["properties"])
    assert sum(len(tool.model_dump_json(exclude_none=True)) for tool in ask.listed) < 14_000


def test_a_drive_is_built_and_run(ask: Program, folder: Path) -> None:
    assert ask("new", file="new/built.toml") == {"written": "new/built.toml"}
    file = "new/built.toml"
    assert "Inertia: Rigid rotating mass." in ask("library", search="rotating mass")["types"]
    assert ask("library", kind="Inertia")["values"]["J"] == "moment of inertia [kg.m2]; at least 0"
    for name, kind, values in (("m", "Torque", {"tau": "6 N.m"}), ("J", "Inertia", {"J": "2 kg.m2"})):
        added = ask("add", file=file, name=name, kind=kind, values=values)
    assert added["changed"] == ['+J = { is = "Inertia", J = "2 kg.m2" }']
    assert added["problems"] == ["m.flange is free, so m (Torque) carries no torque."]
    ask("connect", file=file, first="m.flange", second="J.flange_a")
    ask("insert", file=file, name="s", kind="Spring", between=["m", "J"], values={"c": "9 N.m/rad"})
    assert ask("undo", file=file)["changed"]
    for name in ("J.w", "J.phi"):
        ask("set", file=file, path=name, value=0)
    ask("rename", file=file, old="J", new="rotor")
    ask("duplicate", file=file, name="rotor", new="other")
    ask("replace", file=file, name="other", kind="Spring", values={"c": 1})
    ask("remove", file=file, name="other")
    ask("set", file=file, path="until", value="3 s", section="simulate")
    ask("unset", file=file, path="until", section="simulate")
    ask("disconnect", file=file, first="m.flange", second="rotor.flange_a")
    ask("connect", file=file, first="m.flange", second="rotor.flange_a")
    checked = ask("check", file=file)
    assert checked["problems"] == []
    assert {"what": "states", "number": 2, "which": "m.phi, rotor.w"} in checked["sizes"]
    run = ask("simulate", file=file, until="2 s", readings=["rotor.w", "peak(rotor.w)"])
    speed = 6.0 / 2.0 * 2.0  # tau/J·t
    assert run["readings"] == {name: {"value": speed, "unit": "rad/s"} for name in ("rotor.w", "peak(rotor.w)")}
    assert any("energy balance closes" in text for text in run["text"])
    assert ask("values", file=file, readings=["at(rotor.w, 1 s)"])["at(rotor.w, 1 s)"]["value"] == speed / 2
    rows = ask("sensitivities", file=file, readings=["rotor.w"], until="2 s")["rotor.w"]
    assert {row["parameter"]: row["derivative"] for row in rows} == {"rotor.J": -speed / 2.0, "m.tau": speed / 6.0}
    grouped = ask("group", file=file, names=["rotor"], name="box")
    assert grouped["files"] == ["new/box.toml"]
    assert (folder / "new" / "box.toml").is_file()
    assert {"new/box.toml", file} <= set(ask("netlists")["netlists"])
    assert "./box.toml" in ask("text", file=file)["text"]


def test_an_operating_point(ask: Program) -> None:
    (torque,) = (row for row in ask("steady", file="drive.toml", show=["J.w"])["values"] if row["name"] == "J.w")
    assert torque == {"name": "J.w", "value": 6.0 / 3.0, "unit": "rad/s"}
    held = ask("steady", file="drive.toml", hold={"J.w": "5 rad/s"}, by=["m.tau"], show=["m.tau"])["values"]
    assert held == [{"name": "m.tau", "value": 5.0 * 3.0, "unit": "N.m"}]


def test_files_are_written(ask: Program, folder: Path) -> None:
    ask("export", file="drive.toml", output="drive.fmu")
    assert "modelDescription.xml" in zipfile.ZipFile(folder / "drive.fmu").namelist()
    ask("export", file="drive.toml", output="drive.mo")
    assert [*load(folder / "drive.mo").parts] == ["m", "J", "d", "wall"]
    ask("draw", file="drive.toml", output="drive.svg")
    assert (folder / "drive.svg").read_text(encoding="utf-8").startswith("<svg")


def test_problems_are_those_of_check_and_their_suggestions_are_made(ask: Program, folder: Path) -> None:
    text = '[parts]\nm = { is = "Torque" }\nJ = { is = "Inertja", J = 1 }\n[series]\nx = ["m", "J"]\n'
    (folder / "slips.toml").write_text(text, encoding="utf-8")
    expected = netlist_problems(folder / "slips.toml", text)
    answer = ask("check", file="slips.toml")["problems"]
    assert [problem["what"] for problem in answer] == [problem["what"] for problem in expected]
    assert [problem["file"] for problem in answer] == ["slips.toml"] * len(answer)
    assert ask("apply", file="slips.toml", suggestion=answer[0]["suggestion"])["changed"] == [
        '-J = { is = "Inertja", J = 1 }', '+J = { is = "Inertia", J = 1 }',
    ]  # fmt: skip
    (problem,) = ask("check", file="slips.toml")["problems"]
    ask("apply", file="slips.toml", suggestion=problem["suggestion"], value="3 N.m")
    (note,) = ask("check", file="slips.toml")["problems"]
    assert note["kind"] == "note"


def test_changes_by_others_are_seen(ask: Program, folder: Path) -> None:
    file = folder / "shared.toml"
    file.write_text(DRIVE, encoding="utf-8")
    ask("rename", file="shared.toml", old="J", new="rotor")
    ask("simulate", file="shared.toml", until=1)
    file.write_text(DRIVE.replace("6 N.m", "7 N.m"), encoding="utf-8")
    assert ask.refused("values", file="shared.toml", readings=["J.w"]).startswith("There is no run of")
    assert ask.refused("undo", file="shared.toml") == "There is nothing to undo."
    ask("set", file="shared.toml", path="m.tau", value="8 N.m")
    assert file.read_text(encoding="utf-8") == DRIVE.replace("6 N.m", "8 N.m")


MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "simulat": ({}, "There is no tool 'simulat'; did you mean 'simulate'? There are add, "),
    "check": ({}, "check needs file."),
    "rename": ({"old": "J", "new": "x"}, "rename needs file."),
    "remove": ({"file": "drive.toml"}, "remove needs name."),
    "steady": ({"file": "drive.toml", "fle": 1}, "steady has no argument 'fle'; did you mean 'file'?"),
    "text": ({"file": 3}, "text: file = 3 is no text."),
    "add": ({"file": ["a"], "name": "a", "kind": "b"}, "add: file = ['a'] is no text."),
    "draw": ({"file": "drive.toml", "output": "x.toml"}, "'x.toml' must end in .svg or .png or .pdf."),
    "export": ({"file": "drive.toml", "output": ""}, "'' is no name of a file."),
    "simulate": ({"file": "drive.toml", "until": 1, "readings": ["peak(K.w)"]}, "drive has no variable 'K.w'"),
    "values": ({"file": "two_mass.toml", "readings": ["J1.w"]}, "There is no run of 'two_mass.toml' as it is now."),
    "new": ({"file": "drive.toml"}, "'"),
    "library": ({"kind": "Inertja"}, "There is no component type 'Inertja'; did you mean 'Inertia'?"),
    "insert": ({"file": "nowhere.toml", "name": "a", "kind": "Inertia", "after": "m"}, "The netlist '"),
    "connect": ({"file": "drive.toml", "first": "m.flange", "second": "J.flange_a"}, "m.flange and J.flange_a are con"),
    "sensitivities": ({"file": "drive.toml", "readings": []}, "There is no output to differentiate"),
    "apply": ({"file": "drive.toml", "suggestion": {"operation": "run"}}, "There is no operation 'run'."),
}


@pytest.mark.parametrize("tool", MISTAKES)
def test_mistakes_are_answers(ask: Program, tool: str, folder: Path) -> None:
    arguments, what = MISTAKES[tool]
    before = (folder / "drive.toml").read_bytes()
    assert ask.refused(tool, **arguments).startswith(what)
    assert (folder / "drive.toml").read_bytes() == before


SECRET = "secret-word"


@pytest.fixture
def secret(folder: Path) -> Path:
    file = folder.parent / "secret.toml"
    file.write_text(f'{SECRET} = [\n[parts]\n{SECRET} = {{ is = "{SECRET}" }}\n', encoding="utf-8")
    if not (folder / "link.toml").is_symlink():
        (folder / "link.toml").symlink_to(file)
        (folder / "way").symlink_to(folder.parent, target_is_directory=True)
    return file


HOSTILE = [
    "../secret.toml", "new/../../secret.toml", "link.toml", "way/secret.toml", "ABSOLUTE", "a\0b.toml", ".", "..",
    "x" * 5000 + ".toml",
]  # fmt: skip


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
@pytest.mark.parametrize("path", HOSTILE)
def test_files_outside_are_refused(ask: Program, secret: Path, path: str, folder: Path) -> None:
    before, beside = secret.read_bytes(), sorted(folder.parent.iterdir())
    path = str(secret) if path == "ABSOLUTE" else path
    requests: list[tuple[str, dict[str, Any]]] = [
        (tool, {"file": path}) for tool in ("text", "check", "new", "undo", "simulate", "steady")
    ]
    requests.append(("add", {"file": path, "name": "a", "kind": "Inertia"}))
    if not path.startswith((".", "x")) or "/" in path:  # those with these endings are files of the folder
        requests += [("draw", {"file": "drive.toml", "output": f"{path}.svg"})] * ("link" not in path)
        requests += [("export", {"file": "drive.toml", "output": f"{path}.mo"})] * ("link" not in path)
    for tool, arguments in requests:
        answer, failed = ask.ask(tool, **arguments)
        assert failed, tool
        assert SECRET not in json.dumps(answer)
    assert secret.read_bytes() == before
    assert sorted(folder.parent.iterdir()) == beside


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
@pytest.mark.parametrize("used", ["../secret.toml", "link.toml", "way/secret.toml", "../secret.mo", "../x.mo:Y"])
def test_netlists_use_nothing_outside(ask: Program, secret: Path, used: str, folder: Path) -> None:
    secret.with_suffix(".mo").write_text(f"model {SECRET}", encoding="utf-8")
    (folder / "uses.toml").write_text(f'sizing = "{used}"\n[parts]\na = {{ is = "{used}" }}\n', encoding="utf-8")
    for tool, arguments in (
        ("simulate", {}),
        ("steady", {}),
        ("draw", {"output": "a.svg"}),
        ("export", {"output": "a.mo"}),
    ):
        answer, failed = ask.ask(tool, file="uses.toml", **arguments)
        assert failed
        assert "is outside of the folder" in answer["problems"][0]["what"]
        assert SECRET not in json.dumps(answer)
    for tool, arguments in (("check", {}), ("remove", {"name": "a"})):
        answer, _ = ask.ask(tool, file="uses.toml", **arguments)
        assert SECRET not in json.dumps(answer)


OWN = """from pathlib import Path
Path(__file__).with_name("ran").write_text("")
print("not of the protocol")
from modelica_like.language import *
from components import Inertia
class Hub(Inertia):
    'A hub.'
"""


def test_no_code_runs_without_trust(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN)
    (tmp_path / "drive.toml").write_text('[parts]\na = { is = "own:Hub", J = 1, phi = 0, w = 3 }\n')
    with program(tmp_path) as ask:
        for tool, arguments in (
            ("simulate", {"until": 1}), ("steady", {}), ("sensitivities", {"readings": ["a.w"]}),
            ("draw", {"output": "a.svg"}), ("export", {"output": "a.fmu"}),
        ):  # fmt: skip
            assert "in a folder that is not trusted" in ask.refused(tool, file="drive.toml", **arguments)
        assert "not trusted" in ask.refused("library", kind="own:Hub")
        (problem,) = ask("check", file="drive.toml")["problems"]
        assert problem["kind"] == "UntrustedModule"
        ask("rename", file="drive.toml", old="a", new="b")
        ask.refused("add", file="drive.toml", name="c", kind="own:Hub")
    assert not (tmp_path / "ran").exists()
    with program(tmp_path, "--trust") as ask:
        assert ask("simulate", file="drive.toml", until=1, readings=["b.w"])["readings"]["b.w"]["value"] == 3.0
        assert ask("library", kind="own:Hub")["about"] == "Hub\n\nA hub."
    assert (tmp_path / "ran").exists()


@pytest.mark.parametrize("name", ["two_mass", "winch", "launch", "lepelletier", "servo_axis"])
def test_answers_about_examples_are_short(ask: Program, name: str) -> None:
    for tool, more in (("check", {}), ("simulate", {"until": "0.01 s"}), ("steady", {})):
        answer, _ = ask.ask(tool, file=f"{name}.toml", **more)
        assert len(json.dumps(answer, ensure_ascii=False)) < LONGEST, tool


ENDLESS = """[parts]
wall = { is = "Fixed" }
shaft = { is = "Spring", c = "1 MN.m/rad", phi_rel = 0 }
J = { is = "Inertia", J = "1 kg.m2", w = 1 }
[series]
x = ["wall", "shaft", "J"]
"""
"""Minutes of work, if its end is at 2000 s: 300,000 periods."""
LONG: dict[str, dict[str, Any]] = {
    "simulate": {"until": "2000 s"}, "sensitivities": {"until": "2000 s", "readings": ["J.w"]},
}  # fmt: skip


def test_a_call_that_takes_too_long_is_stopped(tmp_path: Path) -> None:
    (tmp_path / "endless.toml").write_text(ENDLESS, encoding="utf-8")
    with program(tmp_path, before="from modelica_like.mcp import server; server.SECONDS = 1.5") as ask:
        ask("library", kind="Inertia")  # what is read at first takes a second
        for tool, more in LONG.items():
            said = ask.refused(tool, file="endless.toml", **more)
            assert said.startswith(f"{tool} took more than 1.5 s, and was stopped")
        assert " at t = " in ask.refused("simulate", file="endless.toml", until="2000 s")
        run = ask("simulate", file="endless.toml", until="1 ms", readings=["J.w"])
        assert run["readings"]["J.w"]["unit"] == "rad/s"


def test_a_call_that_is_cancelled_is_stopped(tmp_path: Path) -> None:
    """Otherwise the next one would wait for it, as one works at a time."""
    (tmp_path / "endless.toml").write_text(ENDLESS, encoding="utf-8")
    with program(tmp_path, patience=4.0) as ask:
        ask("library", kind="Inertia")
        for tool, more in LONG.items():
            with pytest.raises(MCPError, match=r"[Tt]imed out"):
                ask(tool, file="endless.toml", **more)
        assert ask("set", file="endless.toml", path="J.J", value=3)["changed"]


def test_a_run_ends_with_the_program_that_asked_for_it(tmp_path: Path) -> None:
    (tmp_path / "endless.toml").write_text(ENDLESS, encoding="utf-8")
    command = [sys.executable, "-m", "modelica_like", "mcp", str(tmp_path)]
    about = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "program", "version": "1"}}
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for message in (
            {"id": 1, "method": "initialize", "params": about},
            {"method": "notifications/initialized"},
            {"id": 2, "method": "tools/call", "params": {"name": "text", "arguments": {"file": "endless.toml"}}},
            {"id": 3, "method": "tools/call",
             "params": {"name": "simulate", "arguments": {"file": "endless.toml", "until": "2000 s"}}},
        ):  # fmt: skip
            process.stdin.write(json.dumps({"jsonrpc": "2.0", **message}) + "\n")
            process.stdin.flush()
        assert [json.loads(process.stdout.readline())["id"] for _ in range(2)] == [1, 2]
        time.sleep(2.0)  # the run has begun
        process.stdin.close()
        assert process.wait(60) == 0


def test_only_the_call_that_is_meant_is_stopped() -> None:
    """An interrupt that comes late meets no other call, and a call that waits is not begun."""
    turns, begun, done = Turns[int](), threading.Event(), list[int]()

    def endless() -> int:
        begun.set()
        while True:
            time.sleep(0.001)

    def work(number: int) -> Callable[[], int]:
        return lambda: done.append(number) or number

    def other() -> None:
        begun.wait()
        for call in (waits, long, long, waits):
            turns.stop(call)
        assert long.answer.result() == -1
        turns.stop(long)
        for k in range(200):
            turns.add(call := Call(work(k), lambda interrupt: -1))
            if k % 2:
                call.answer.result()
            turns.stop(call)  # perhaps while it works
            assert call.answer.result() in (k, -1)
        turns.add(None)

    long, waits, last = (Call(what, lambda interrupt: -1) for what in (endless, work(1000), work(2000)))
    for call in (long, waits, last):
        turns.add(call)
    before, thread = signal.getsignal(signal.SIGINT), threading.Thread(target=other)
    thread.start()
    try:
        turns.work()
    finally:
        signal.signal(signal.SIGINT, before)
        thread.join()
    assert (waits.answer.result(), last.answer.result()) == (-1, 2000)
    assert 1000 not in done
    assert {*range(1, 200, 2)} <= {*done}


def test_without_the_extra(tmp_path: Path) -> None:
    # A module of this name that cannot be imported stands before the real one.
    blocked = "import sys; sys.modules['mcp'] = None; from modelica_like.cli import run; run(['mcp'])"
    done = subprocess.run([sys.executable, "-c", blocked], capture_output=True, text=True, cwd=tmp_path, timeout=120)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == 'mcp is not installed.\nInstall it with: pip install "modelica-like[mcp]"\n'


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "modelica_like", "mcp", str(tmp_path / "nowhere")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"'{tmp_path / 'nowhere'}' is not a folder.\n"
