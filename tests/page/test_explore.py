"""The page that runs a drive on this machine: what it answers, whom, and how soon."""

import contextlib
import http.client
import json
import math
import socket
import statistics
import threading
import time
import webbrowser
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

import numpy as np
import pytest

from modelica_like import load, run_fmu, sensitivities, simulate
from modelica_like.errors import NoGradient
from modelica_like.show.explorer import Explorer, server

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVES = {"machine_table_direct": "table_mass", "machine_tool_startup": "J2.J"}
# Move a slider, and wait until its picture stands there; the time in ms that this took.
MOVE = """(async (name, place) => {
  const field = [...document.querySelectorAll('input[type="range"]')].find((one) => one.ariaLabel === name);
  const status = document.getElementById("status"), before = status.dataset.turn, begin = performance.now();
  field.value = place;
  field.dispatchEvent(new Event("input"));
  while (status.dataset.turn === before) await new Promise(requestAnimationFrame);
  return performance.now() - begin;
})"""
WAIT = """(async (find) => {
  for (let k = 0; k < 3000 && !find(); k++) await new Promise((go) => setTimeout(go, 20));
  return find();
})"""
BARS = """((name) => {
  const select = document.querySelector("#bars select");
  select.value = name;
  select.onchange();
})"""


@contextlib.contextmanager
def served(name: str, folder: Path, show: Sequence[str] = ()) -> Iterator[Explorer]:
    with Explorer(EXAMPLES / f"{name}.toml", folder=folder, show=show) as explorer:
        thread = threading.Thread(target=explorer.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield explorer
        finally:
            explorer.shutdown()
            thread.join()


@pytest.fixture
def explorer(tmp_path: Path) -> Iterator[Explorer]:
    with served("machine_tool_startup", tmp_path) as made:
        yield made


def ask(
    explorer: Explorer, path: str, content: Any = None, *, token: str | None = None, host: str = ""
) -> tuple[int, bytes]:
    headers = {"X-Token": explorer.token if token is None else token, "Host": host or explorer.host}
    with contextlib.closing(http.client.HTTPConnection(explorer.host, timeout=60)) as connection:
        if content is None:
            connection.request("GET", path, headers=headers)
        else:
            connection.request("POST", path, content if isinstance(content, str) else json.dumps(content), headers)
        answer = connection.getresponse()
        return answer.status, answer.read()


def request(explorer: Explorer, names: list[str], until: float = 1.0, **values: float) -> dict[str, Any]:
    known = explorer.runs.references
    return {
        "until": until, "references": [known[name] for name in names],
        "values": [[known[name.replace("__", ".")], value] for name, value in values.items()],
    }  # fmt: skip


def read(body: bytes) -> tuple[dict[str, Any], list[np.ndarray]]:
    length = int(np.frombuffer(body, "<i8", 1)[0])
    about = json.loads(body[8 : 8 + length])
    numbers = np.frombuffer(body, "<f8", offset=8 + length)
    return about, np.split(numbers, np.cumsum(about["sizes"])[:-1])


def test_a_run_is_that_of_simulate(explorer: Explorer) -> None:
    code, body = ask(explorer, "/run", request(explorer, ["J1.w", "clutch.tau"], J1__J=2.0))
    assert code == 200
    about, (times, outputs, events) = read(body)
    run = simulate(EXAMPLES / "machine_tool_startup.toml", 1.0, parameters={"J1.J": 2.0}, solver="native")
    assert about["message"] == ""
    assert times[-1] == 1.0
    assert outputs.reshape(-1, 2)[-1] == pytest.approx([run["J1.w"][-1], run["clutch.tau"][-1]], rel=1e-6)
    assert events.reshape(-1, 7)[:, 0] == pytest.approx([one.time for one in run.events], rel=1e-6)


def test_only_who_knows_the_address_is_answered(explorer: Explorer) -> None:
    asked = request(explorer, ["J1.w"])
    assert ask(explorer, f"/?token={explorer.token}")[0] == 200
    assert ask(explorer, "/")[0] == 403
    assert ask(explorer, f"/?token={explorer.token}", host="evil.example")[0] == 403
    assert ask(explorer, "/run", asked, token="guessed")[0] == 403
    assert ask(explorer, "/run", asked, host="evil.example:80")[0] == 403
    assert ask(explorer, f"/../../etc/passwd?token={explorer.token}")[0] == 404
    assert explorer.server_address[0] == "127.0.0.1"


def test_a_wrong_request_gets_a_sentence(explorer: Explorer) -> None:
    right = request(explorer, ["J1.w"], J1__J=2.0)
    wrong: list[Any] = ["no json", "[" * 500_000, "3", "[]", {"until": 1}, "\x00"]
    wrong += [{**right, "references": [one]} for one in (-1, 2**32, 2**70, 0.5, "1", None)]
    wrong += [{**right, "values": [[one, 1.0]]} for one in (-1, 2**32, explorer.runs.references["J1.w"], "1")]
    wrong += [{**right, "values": one} for one in (3, [1, 2], [[1]], [[right["values"][0][0], "2"]])]
    wrong += [json.dumps(right).replace("2.0", one) for one in ("Infinity", "NaN", "1" * 400)]
    wrong += [{**right, "until": one} for one in (math.inf, math.nan, "1 s", None, [])]
    for one in wrong:
        code, said = ask(explorer, "/run", one)
        assert (code, said[:21]) == (400, b"The request is wrong:"), one
    assert ask(explorer, "/save", {"what": "passwd", **request(explorer, [])})[0] == 400
    assert ask(explorer, "/elsewhere", {})[0] == 404


def test_a_request_that_no_browser_writes_gets_an_answer(explorer: Explorer, capfd: pytest.CaptureFixture[str]) -> None:
    known = f"Host: {explorer.host}\r\nX-Token: {explorer.token}\r\n"
    for head, code in (
        ("GET http://[ HTTP/1.1\r\n", b"403"),
        (f"GET http://[?token={explorer.token} HTTP/1.1\r\n", b"404"),
        (f"POST /run HTTP/1.1\r\nContent-Length: {'9' * 5000}\r\n", b"404"),
        ("POST /run HTTP/1.1\r\nContent-Length: 1234567890\r\n", b"404"),
        ("POST /run HTTP/1.1\r\nContent-Length: \xb2\r\n", b"404"),
        ("POST /run HTTP/1.1\r\n", b"404"),
    ):
        with socket.create_connection(("127.0.0.1", explorer.server_port), timeout=60) as connection:
            connection.sendall(f"{head}{known}\r\n".encode("latin-1"))
            assert connection.recv(4096).split(b" ")[1] == code, head
    assert capfd.readouterr() == ("", "")


def test_a_bad_value_is_told_as_the_command_line_tells_it(explorer: Explorer) -> None:
    _, body = ask(explorer, "/run", request(explorer, ["J1.w"], J1__J=-1.0))
    assert read(body)[0]["message"] == "Inertia.J = -1.0 is out of range: it must be at least 0 kg.m2."


def test_a_run_that_nobody_waits_for_ends(explorer: Explorer, capfd: pytest.CaptureFixture[str]) -> None:
    """Its page has been closed, or wants a newer run; the next one begins at once."""
    body = json.dumps(request(explorer, ["J1.w"], until=1e9)).encode()
    head = f"POST /run HTTP/1.1\r\nHost: {explorer.host}\r\nX-Token: {explorer.token}\r\n"
    for _ in range(3):
        with socket.create_connection(("127.0.0.1", explorer.server_port)) as left:
            left.sendall(head.encode() + b"Content-Length: %d\r\n\r\n" % len(body) + body)
            time.sleep(0.2)
    begin = time.monotonic()
    assert ask(explorer, "/run", request(explorer, ["J1.w"]))[0] == 200
    assert time.monotonic() - begin < 3.0
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_connections_without_a_request_hold_few_threads(explorer: Explorer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_PATIENCE", 1.0)
    with contextlib.ExitStack() as stack:
        for k in range(100):
            half = stack.enter_context(socket.create_connection(("127.0.0.1", explorer.server_port)))
            half.sendall(b"POST /run HTTP/1.1\r\nHost: a\r\n"[: k % 30])
        assert threading.active_count() < 30
        assert ask(explorer, "/run", request(explorer, ["J1.w"]))[0] == 200
        # A byte from time to time does not keep a place.
        slow = stack.enter_context(socket.create_connection(("127.0.0.1", explorer.server_port)))
        begin = time.monotonic()
        with contextlib.suppress(OSError):
            while time.monotonic() - begin < 10.0:
                slow.sendall(b"G")
                time.sleep(0.1)
        assert time.monotonic() - begin < 5.0


def test_the_secret_is_in_no_command_line(explorer: Explorer, monkeypatch: pytest.MonkeyPatch) -> None:
    """The browser opens a file that only this user can read, and that leads to the page."""
    opened: list[str] = []

    def browse(address: str) -> None:
        way = Path(url2pathname(urlsplit(address).path))
        opened.extend([address, way.read_text()])
        assert way.parent.stat().st_mode & 0o077 == 0

    monkeypatch.setattr(webbrowser, "open", browse)
    monkeypatch.setattr(explorer, "serve_forever", lambda: None)
    explorer.show()
    assert explorer.token not in opened[0]
    assert f"url={explorer.address}" in opened[1]
    assert not Path(url2pathname(urlsplit(opened[0]).path)).exists()


def test_sensitivities_follow_the_values(explorer: Explorer) -> None:
    code, body = ask(explorer, "/ranking", {"output": "J1.phi", **request(explorer, [], h1=5.0)})
    assert code == 200
    assert json.loads(body)["caption"] == "change in percent for one percent of the parameter"
    found = dict(json.loads(body)["rows"])
    changed = load(EXAMPLES / "machine_tool_startup.toml")
    changed.set("h1", 5.0)
    expected = sensitivities(changed, ["J1.phi"], until=1.0).ranking("J1.phi")
    assert found == pytest.approx({one.name: relative for one, _, relative in expected if one.name in found}, rel=1e-6)
    assert len(found) > 3


def test_what_is_saved_is_the_changed_drive(explorer: Explorer, tmp_path: Path) -> None:
    asked = request(explorer, [], J1__J=2.0)
    for what, ending in (("netlist", "toml"), ("FMU", "fmu"), ("report", "html"), ("netlist", "toml")):
        code, body = ask(explorer, "/save", {"what": what, **asked})
        assert code == 200, body
        assert Path(body.decode()).parent == tmp_path
        assert Path(body.decode()).suffix == f".{ending}"
    assert len(list(tmp_path.glob("*.toml"))) == 2, "nothing is written over"
    saved = simulate(next(tmp_path.glob("*_explored.toml")), 1.0)
    expected = simulate(EXAMPLES / "machine_tool_startup.toml", 1.0, parameters={"J1.J": 2.0})
    assert saved["J2.w"][-1] == pytest.approx(expected["J2.w"][-1], rel=1e-9)
    fmu = run_fmu(next(tmp_path.glob("*.fmu")), stop=1.0)
    assert fmu["J2.w"][-1] == pytest.approx(expected["J2.w"][-1], rel=1e-5)


@pytest.mark.browser
@pytest.mark.parametrize(("name", "slider"), DRIVES.items())
def test_a_slider_moves_the_curves(browser: Any, tmp_path: Path, name: str, slider: str) -> None:
    with served(name, tmp_path) as explorer:
        browser.open(explorer.address)
        before = browser.run("picture.result.outputs.reduce((a, b) => a + b)")
        took = [browser.run(f"{MOVE}({json.dumps(slider)}, {place})") for place in np.linspace(0.3, 0.7, 21)]
        assert browser.run("picture.result.outputs.reduce((a, b) => a + b)") != before
        # What a person feels as at once; the figures stand in docs/explore.md.
        assert statistics.median(took[3:]) < 100.0
        assert [one for one in browser.complaints if not one.startswith(explorer.address[:20])] == []
        for _ in range(6):
            browser.run("document.getElementById('keep').click()")
        browser.run(f"{MOVE}({json.dumps(slider)}, 0.55)")
        assert browser.run("picture.earlier.length") == 6, "five kept runs and the first one"


@pytest.mark.browser
def test_reload_and_a_second_page_work(browser: Any, explorer: Explorer) -> None:
    for _ in range(3):
        browser.open(explorer.address)
        before = browser.run("picture.result.outputs.reduce((a, b) => a + b)")
        browser.run(f"{MOVE}('J2.J', 0.6)")
        assert browser.run("picture.result.outputs.reduce((a, b) => a + b)") != before
        assert ask(explorer, "/run", request(explorer, ["J1.w"]))[0] == 200, "another page"
    assert [one for one in browser.complaints if not one.startswith(explorer.address[:20])] == []


@pytest.mark.browser
def test_formulas_follow_the_sliders(browser: Any, tmp_path: Path) -> None:
    shown = ["-clutch.tau*clutch.w_rel", "min(J4.w, 100 rpm)*J4.J + 0*time*1 N.m", "clutch.mode", "J1.w**2/sqrt(4)"]
    with served("machine_tool_startup", tmp_path, show=shown) as explorer:
        browser.open(explorer.address)
        browser.run(f"{MOVE}('J4.J', 0.6)")
        read = "[one.name, PAGE.units[one.unit].text, [...values(picture.result, one)]]"
        found = browser.run(f"[...shown].map((one) => {read})")
        inertia = browser.run("PAGE.sliders.find((one) => one.name === 'J4.J').now")
        assert [one for one in browser.complaints if not one.startswith(explorer.address[:20])] == []
    run = simulate(EXAMPLES / "machine_tool_startup.toml", parameters={"J4.J": inertia}, solver="native")
    expected = [
        ("W", -run["clutch.tau"] * run["clutch.w_rel"]),
        ("rad·kg·m²/s", np.minimum(run["J4.w"], 100 * np.pi / 30) * inertia),
        ("rad²/s²", run["J1.w"] ** 2 / 2),
    ]
    assert [name for name, *_ in found] == [shown[0], shown[1], shown[3]], "modes are bands"
    for (_, unit, values), (wanted, reference) in zip(found, expected, strict=True):
        assert unit == wanted
        assert values == pytest.approx(reference, rel=1e-6, abs=1e-6)


@pytest.mark.browser
def test_bars_and_files_answer(browser: Any, explorer: Explorer, tmp_path: Path) -> None:
    browser.open(explorer.address)
    browser.run("document.querySelector('#bars summary').click()")
    browser.run(f"{WAIT}(() => document.querySelectorAll('#bars tr').length)")
    browser.run(f"{BARS}('J3.w')")
    assert browser.run(f"{WAIT}(() => document.querySelectorAll('#bars tr').length > 3)")
    browser.run("document.querySelector('#files button').click()")
    said = browser.run(f"{WAIT}(() => document.getElementById('saved').textContent.replace('…', ''))")
    assert Path(said) == tmp_path / "machine_tool_startup_explored.toml"
    assert browser.run("document.querySelectorAll('#schematic svg').length") == 1


@pytest.mark.browser
@pytest.mark.parametrize(
    "name", ["winch", *(pytest.param(n, marks=pytest.mark.slow) for n in ("servo_axis", "launch"))]
)
def test_larger_drives_are_explored_without_complaint(browser: Any, tmp_path: Path, name: str) -> None:
    with served(name, tmp_path) as explorer:
        browser.open(explorer.address)
        assert browser.run("document.documentElement.scrollWidth <= innerWidth")
        labels = browser.run(
            "[...document.querySelectorAll('figure:last-child svg text')].map((one) => one.textContent)"
        )
        run = simulate(EXAMPLES / f"{name}.toml")
        modes = {one.path: np.ptp(run[one.path]) > 0 for one in run.model.flat_discretes if one.names}
        assert {path for path, changes in modes.items() if changes} == modes.keys() & {*labels}
        # A click on a part opens its parameters.
        part = {"winch": "worm", "servo_axis": "table", "launch": "clutch_a"}[name]
        browser.run(f"[...document.querySelectorAll('#schematic g > title')]"
                    f".find((one) => one.textContent.startsWith('{part}:')).parentNode.onclick()")  # fmt: skip
        opened = "[...document.querySelectorAll('aside details[open] summary')].map((one) => one.textContent)"
        assert [one.rpartition(".")[2] for one in browser.run(opened)] == [part]
        browser.run("document.querySelector('#bars summary').click()")
        end = {
            "winch": "motor.w ends at 0 rad/s, and no parameter",
            "servo_axis": "forth.qd ends at 0 rad/s, and no parameter",
            "launch": "change in percent",
        }
        found = browser.run(f"{WAIT}(() => document.querySelector('#bars caption')?.textContent)")
        assert found.startswith(end[name])
        assert [one for one in browser.complaints if not one.startswith(explorer.address[:20])] == []


@pytest.mark.browser
def test_what_has_no_gradient_is_told_in_the_page(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise NoGradient("No gradient at t = 1 s: it grazes.", advice="Move the parameters.")

    monkeypatch.setattr("modelica_like.show.explorer.runs.sensitivities", refuse)
    with served("components/h_bridge", tmp_path) as explorer:
        browser.open(explorer.address)
        browser.run("shown.add(PAGE.variables[0]); ask(); document.querySelector('#bars summary').click()")
        found = browser.run(f"{WAIT}(() => document.querySelector('#bars table').textContent)")
        assert found.startswith("No gradient at t = 1 s: it grazes.")
        assert ".py:" not in found
        assert [one for one in browser.complaints if not one.startswith(explorer.address[:20])] == []
