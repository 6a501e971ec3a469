"""The page that runs a drive on this machine: what it answers, whom, and how soon."""

import contextlib
import http.client
import json
import math
import socket
import threading
import time
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

import numpy as np
import pytest
from pages import serving

from modelica_like import load, run_fmu, sensitivities, simulate
from modelica_like.page import PageServer, Session, server
from modelica_like.page.runs import Runs

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def page(tmp_path: Path) -> Iterator[PageServer]:
    with serving(Session(EXAMPLES / "machine_tool_startup.toml", folder=tmp_path)) as made:
        built(made)
        yield made


def ask(
    page: PageServer, path: str, content: Any = None, *, token: str | None = None, host: str = "", origin: str = ""
) -> tuple[int, bytes]:
    headers = {"X-Token": page.token if token is None else token, "Host": host or page.host}
    headers |= {"Origin": origin} if origin else {}
    with contextlib.closing(http.client.HTTPConnection(page.host, timeout=60)) as connection:
        if content is None:
            connection.request("GET", path, headers=headers)
        else:
            connection.request("POST", path, content if isinstance(content, str) else json.dumps(content), headers)
        answer = connection.getresponse()
        return answer.status, answer.read()


def built(page: PageServer) -> Runs:
    """Let the page build its model, as a browser does first."""
    revision = page.session.desk.revision
    code, body = ask(page, "/model", {"revision": revision, "shown": []})
    assert code == 200
    assert json.loads(body)["content"] is not None
    return page.session.runs({"revision": revision})


def request(page: PageServer, names: list[str], until: float = 1.0, **values: float) -> dict[str, Any]:
    revision = page.session.desk.revision
    known = page.session.runs({"revision": revision}).references
    return {
        "revision": revision, "until": until, "references": [known[name] for name in names],
        "values": [[known[name.replace("__", ".")], value] for name, value in values.items()],
    }  # fmt: skip


def read(body: bytes) -> tuple[dict[str, Any], list[np.ndarray]]:
    length = int(np.frombuffer(body, "<i8", 1)[0])
    about = json.loads(body[8 : 8 + length])
    numbers = np.frombuffer(body, "<f8", offset=8 + length)
    return about, np.split(numbers, np.cumsum(about["sizes"])[:-1])


def test_a_run_is_that_of_simulate(page: PageServer) -> None:
    code, body = ask(page, "/run", request(page, ["J1.w", "clutch.tau"], J1__J=2.0))
    assert code == 200
    about, (times, outputs, events) = read(body)
    run = simulate(EXAMPLES / "machine_tool_startup.toml", 1.0, parameters={"J1.J": 2.0}, solver="native")
    assert about["message"] == ""
    assert times[-1] == 1.0
    assert outputs.reshape(-1, 2)[-1] == pytest.approx([run["J1.w"][-1], run["clutch.tau"][-1]], rel=1e-6)
    assert events.reshape(-1, 7)[:, 0] == pytest.approx([one.time for one in run.events], rel=1e-6)


def test_only_who_knows_the_address_is_answered(page: PageServer) -> None:
    asked = request(page, ["J1.w"])
    assert ask(page, f"/?token={page.token}")[0] == 200
    assert ask(page, "/")[0] == 403
    assert ask(page, f"/?token={page.token}", host="evil.example")[0] == 403
    assert ask(page, "/run", asked, token="guessed")[0] == 403
    assert ask(page, "/run", asked, host="evil.example:80")[0] == 403
    assert ask(page, f"/../../etc/passwd?token={page.token}")[0] == 404
    assert ask(page, "/run", asked, origin=f"http://{page.host}")[0] == 200
    assert ask(page, "/run", asked, origin="http://evil.example")[0] == 403
    assert page.server_address[0] == "127.0.0.1"


def test_a_wrong_request_gets_a_sentence(page: PageServer) -> None:
    right = request(page, ["J1.w"], J1__J=2.0)
    wrong: list[Any] = ["no json", "[" * 500_000, "3", "[]", {"until": 1}, "\x00"]
    wrong += [{**right, "references": [one]} for one in (-1, 2**32, 2**70, 0.5, "1", None)]
    wrong += [{**right, "values": [[one, 1.0]]} for one in (-1, 2**32, right["references"][0], "1")]
    wrong += [{**right, "values": one} for one in (3, [1, 2], [[1]], [[right["values"][0][0], "2"]])]
    wrong += [json.dumps(right).replace("2.0", one) for one in ("Infinity", "NaN", "1" * 400)]
    wrong += [{**right, "until": one} for one in (math.inf, math.nan, "1 s", None, [])]
    for one in wrong:
        code, said = ask(page, "/run", one)
        assert (code, said[:21]) == (400, b"The request is wrong:"), one
    assert ask(page, "/export", {"what": "passwd", **request(page, [])})[0] == 400
    assert ask(page, "/elsewhere", {})[0] == 404


def test_a_request_that_no_browser_writes_gets_an_answer(page: PageServer, capfd: pytest.CaptureFixture[str]) -> None:
    known = f"Host: {page.host}\r\nX-Token: {page.token}\r\n"
    for head, code in (
        ("GET http://[ HTTP/1.1\r\n", b"403"),
        (f"GET http://[?token={page.token} HTTP/1.1\r\n", b"404"),
        (f"POST /run HTTP/1.1\r\nContent-Length: {'9' * 5000}\r\n", b"404"),
        ("POST /run HTTP/1.1\r\nContent-Length: 1234567890\r\n", b"404"),
        ("POST /run HTTP/1.1\r\nContent-Length: \xb2\r\n", b"404"),
        ("POST /run HTTP/1.1\r\n", b"404"),
    ):
        with socket.create_connection(("127.0.0.1", page.server_port), timeout=60) as connection:
            connection.sendall(f"{head}{known}\r\n".encode("latin-1"))
            assert connection.recv(4096).split(b" ")[1] == code, head
    assert capfd.readouterr() == ("", "")


def test_a_bad_value_is_told_as_the_command_line_tells_it(page: PageServer) -> None:
    _, body = ask(page, "/run", request(page, ["J1.w"], J1__J=-1.0))
    assert read(body)[0]["message"] == "Inertia.J = -1.0 is out of range: it must be at least 0 kg.m2."


def test_a_run_that_nobody_waits_for_ends(page: PageServer, capfd: pytest.CaptureFixture[str]) -> None:
    """Its page has been closed, or wants a newer run; the next one begins at once."""
    body = json.dumps(request(page, ["J1.w"], until=1e9)).encode()
    head = f"POST /run HTTP/1.1\r\nHost: {page.host}\r\nX-Token: {page.token}\r\n"
    for _ in range(3):
        with socket.create_connection(("127.0.0.1", page.server_port)) as left:
            left.sendall(head.encode() + b"Content-Length: %d\r\n\r\n" % len(body) + body)
            time.sleep(0.2)
    begin = time.monotonic()
    assert ask(page, "/run", request(page, ["J1.w"]))[0] == 200
    assert time.monotonic() - begin < 3.0
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_connections_without_a_request_hold_few_threads(page: PageServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_PATIENCE", 1.0)
    with contextlib.ExitStack() as stack:
        for k in range(100):
            half = stack.enter_context(socket.create_connection(("127.0.0.1", page.server_port)))
            half.sendall(b"POST /run HTTP/1.1\r\nHost: a\r\n"[: k % 30])
        assert threading.active_count() < 30
        assert ask(page, "/run", request(page, ["J1.w"]))[0] == 200
        # A byte from time to time does not keep a place.
        slow = stack.enter_context(socket.create_connection(("127.0.0.1", page.server_port)))
        begin = time.monotonic()
        with contextlib.suppress(OSError):
            while time.monotonic() - begin < 10.0:
                slow.sendall(b"G")
                time.sleep(0.1)
        assert time.monotonic() - begin < 5.0


def test_the_secret_is_in_no_command_line(page: PageServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """The browser opens a file that only this user can read, and that leads to the page."""
    opened: list[str] = []

    def browse(address: str) -> None:
        way = Path(url2pathname(urlsplit(address).path))
        opened.extend([address, way.read_text()])
        assert way.parent.stat().st_mode & 0o077 == 0

    monkeypatch.setattr(webbrowser, "open", browse)
    monkeypatch.setattr(page, "serve_forever", lambda: None)
    page.show()
    assert page.token not in opened[0]
    assert f"url={page.address}" in opened[1]
    assert not Path(url2pathname(urlsplit(opened[0]).path)).exists()


def test_sensitivities_follow_the_values(page: PageServer) -> None:
    code, body = ask(page, "/ranking", {"output": "J1.phi", **request(page, [], h1=5.0)})
    assert code == 200
    assert json.loads(body)["caption"] == "change in percent for one percent of the parameter"
    found = dict(json.loads(body)["rows"])
    changed = load(EXAMPLES / "machine_tool_startup.toml")
    changed.set("h1", 5.0)
    expected = sensitivities(changed, ["J1.phi"], until=1.0).ranking("J1.phi")
    assert found == pytest.approx({one.name: relative for one, _, relative in expected if one.name in found}, rel=1e-6)
    assert len(found) > 3


def test_a_calibration_that_nobody_waits_for_ends(page: PageServer) -> None:
    asked = request(page, []) | {"time": [0.5, 1.0], "columns": [["J1.w", [1.0, None]]], "free": [["J1.J", 0.1, 2.0]]}
    looks = iter([True, True, False])
    assert page.session.calibrate(asked, lambda: next(looks)) is None
    assert next(looks, "all were taken") == "all were taken"


def test_what_is_saved_is_the_changed_drive(page: PageServer, tmp_path: Path) -> None:
    asked = request(page, [], J1__J=2.0)
    endings = {"netlist": "toml", "FMU": "fmu", "report": "html", "picture": "svg"}
    for what in [*endings, "netlist"]:
        code, body = ask(page, "/export", {"what": what, **asked})
        assert code == 200, body
        assert Path(json.loads(body)).parent == tmp_path
        assert Path(json.loads(body)).suffix == f".{endings[what]}"
    _, body = ask(page, "/export", {"what": "Modelica text", **asked})
    assert body.startswith(b"load is a SpeedDependentLoad, for which the Modelica Standard Library has no class")
    assert len(list(tmp_path.glob("*.toml"))) == 2, "nothing is written over"
    saved = simulate(next(tmp_path.glob("*_copy.toml")), 1.0)
    expected = simulate(EXAMPLES / "machine_tool_startup.toml", 1.0, parameters={"J1.J": 2.0})
    assert saved["J2.w"][-1] == pytest.approx(expected["J2.w"][-1], rel=1e-9)
    fmu = run_fmu(next(tmp_path.glob("*.fmu")), stop=1.0)
    assert fmu["J2.w"][-1] == pytest.approx(expected["J2.w"][-1], rel=1e-5)
