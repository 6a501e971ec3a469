"""Names and descriptions of a drive are text in its pages, whatever they contain; only the pages' own scripts run."""

import threading
from pathlib import Path
from typing import Any

import pytest

from modelica_like import ModelicaLikeError, export_html, load, save_report, simulate
from modelica_like.netlist import loads
from modelica_like.page import PageServer, Session

PAYLOADS = (
    "<script>window.hacked=1</script>", "<img src=x onerror=window.hacked=1>", "\"><svg onload=window.hacked=1>",
    "</title></style></pre><script>window.hacked=1</script>", "'-window.hacked=1-'", "{{page}}{{script}}",
    "]]><script>window.hacked=1</script>", "\u2028</script ><script>window.hacked=1</script>",
)  # fmt: skip
NETLIST = """
name = {0}
description = {0}
[parameters]
load = "1 kg.m2"
"{3}" = "2 kg.m2"
[parts]
a = {{ is = "Inertia", J = "load", w = 1, phi = 0 }} # {1}
s = {{ is = "SpringDamper", c = 10, d = 1, phi_rel = 0 }}
b = {{ is = "./{2}", J = 1 }}
[series]
x = ["a", "s", "b"]
[start]
"b.m.w" = 0
[simulate]
until = "1 s"
"""
INNER = """
name = {0}
description = {0}
[parameters]
J = 1
[parts]
m = {{ is = "Inertia", J = "J" }}
[expose]
flange_a = "m.flange_a"
flange_b = "m.flange_b"
"""
# What the page's own template and script do not make.
FOREIGN = """document.querySelectorAll("script:not([type])").length !== 1
  || !!document.querySelector("img, [onload], [onerror]")"""
INJECT = """new Promise((go) => {
  const one = document.createElement("script");
  one.textContent = "window.hacked = 1";
  document.body.append(one);
  document.body.insertAdjacentHTML("beforeend", "<img src=x onerror='window.hacked = 1'>");
  setTimeout(go, 200);
})"""


def _text(payload: str) -> str:
    return "'''" + payload + "'''" if "'" not in payload else '"' + payload + '"'


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')


def _check(browser: Any) -> None:
    assert browser.run(FOREIGN) is False
    assert browser.run("window.hacked === undefined")
    complaints = [one for one in browser.complaints if not one.startswith("http://127.0.0.1")]
    assert complaints == []
    browser.run(INJECT)
    assert browser.run("window.hacked === undefined"), "the policy forbids scripts that the page does not name"
    assert sum("Content Security Policy" in one for one in browser.complaints) >= 2
    browser.complaints.clear()


@pytest.fixture(params=range(len(PAYLOADS)))
def drive(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    payload = PAYLOADS[request.param]
    inner = f"{payload.replace('/', '')}.toml"
    (tmp_path / inner).write_text(INNER.format(_text(payload)))
    path = tmp_path / f"{payload.replace('/', '')}_whole.toml"
    path.write_text(NETLIST.format(_text(payload), payload.replace("\u2028", " "), _quoted(inner), _quoted(payload)))
    return path


@pytest.mark.browser
def test_payloads_are_text_in_reports_and_pages(browser: Any, drive: Path, tmp_path: Path) -> None:
    assembly = load(drive)
    save_report(assembly, simulate(assembly), tmp_path / "report.html")
    browser.open(tmp_path / "report.html")
    _check(browser)
    with PageServer(Session(drive, folder=tmp_path)) as explorer:
        thread = threading.Thread(target=explorer.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            browser.open(explorer.address)
            _check(browser)
        finally:
            explorer.shutdown()
            thread.join()


@pytest.mark.parametrize("payload", PAYLOADS)
def test_no_part_has_such_a_name(payload: str) -> None:
    with pytest.raises(ModelicaLikeError):
        loads(f'[parts]\n"a{_quoted(payload)}" = {{ is = "Inertia", J = 1 }}\n')


@pytest.mark.browser
def test_a_page_without_a_server_names_its_script(browser: Any, tmp_path: Path) -> None:
    export_html(Path(__file__).parents[2] / "examples" / "two_mass.toml", tmp_path / "page.html")
    browser.open(tmp_path / "page.html")
    _check(browser)
