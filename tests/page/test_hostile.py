"""Names and descriptions of a drive are text in its pages, whatever they contain; only the pages' own scripts run.

Forty payloads stand in every field that is a text: of netlists, of files beside them, and of the page itself.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hand import Hand, using
from pages import serving
from payloads import FIELDS, PAYLOADS

from modelica_like import ModelicaLikeError, export_html, load, save_report, simulate
from modelica_like.netlist import loads
from modelica_like.page import Session

NETLIST = """
name = {0}
description = {0}
[parts]
a = {{ is = "Inertia", J = "1 kg.m2", w = 1, phi = 0 }} # {2}
s = {{ is = "SpringDamper", c = 10, d = 1, phi_rel = 0 }}
b = {{ is = {1}, J = 1 }}
[series]
{0} = ["a", "s", "b"]
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
# What the page's own template and script do not make; of a page that was opened as a file, links lead to its places.
FOREIGN = """document.querySelectorAll("script:not([type])").length !== 1 || !!window.hacked
  || !!document.querySelector("img, iframe, object, embed, form[action], [onload], [onerror], [onclick]")
  || [...document.querySelectorAll("[href]")].some((one) => /^\\s*(javascript|file|data:text)/i.test(
    one.getAttribute("href")))"""
INJECT = """new Promise((go) => {
  const one = document.createElement("script");
  one.textContent = "window.hacked = 1";
  document.body.append(one);
  document.body.insertAdjacentHTML("beforeend", "<img src=x onerror='window.hacked = 1'>");
  setTimeout(go, 200);
})"""
# What a payload meets in the page: texts that the server reads, and all that can be typed.
MEETS = """async ({ payload, texts, valid }) => {
  const bad = [], settled = async () => {
    await queue;
    for (let k = 0; k < 2000 && asking; k++) await new Promise((go) => setTimeout(go, 5));
  };
  const look = async (where) => { await settled(); if (FOREIGN) bad.push(where); };
  const typed = async (field, where) => {
    if (!field) return bad.push(`no ${where}`);
    field.value = payload;
    for (const kind of ["input", "change"]) field.dispatchEvent(new Event(kind));
    await look(where);
  };
  const field = (path) => document.querySelector(`#inspector [data-path="${path}"]`);
  const answer = async (values) => { // to a dialog
    for (let k = 0; k < 200 && !at("dialog").open; k++) await new Promise((go) => setTimeout(go, 5));
    if (!at("dialog").open) return bad.push("no dialog");
    for (const input of at("dialog").querySelectorAll("input")) if (input.type !== "checkbox") input.value = values;
    await look(`dialog ${at("dialog").querySelector("h2").textContent}`);
    at("dialog").querySelector("button.main").click();
  };
  for (const [k, text] of texts.entries()) { await change("text", { text }); await look(`text ${k}`); }
  await change("text", { text: valid });
  await look("valid text");
  if (!page.valid || !results.run) bad.push("it must run");
  if (!page.text.includes(payload.slice(0, 3)) && !/[^ -~]/.test(payload)) bad.push("the payload is not there");
  for (const name of ["a", "s", "b"]) { select([name]); await settled(); await look(`part ${name}`); }
  select([], ["a.flange_b", "s.flange_a"]); await look("line");
  select([]); await settled();
  for (const name of ["description", "simulate.until"]) await typed(field(name), name);
  await change("text", { text: valid });
  select(["a"]); await settled();
  for (const name of ["a.J", "a.w"]) await typed(field(name), name);
  await typed(document.querySelector("#inspector .name"), "name");
  await change("text", { text: valid });
  for (const name of ["search", "add", "until"]) await typed(at(name), name);
  at("search").value = "";
  await new Promise((go) => setTimeout(go, 100)); await settled(); await look("palette"); // files of the folder
  await change("text", { text: valid });
  kept.splice(0);
  keepRun(); await answer(payload); await look("kept run");
  const title = payload.replace(/[\\r\\n,]/g, "");
  const file = new File([`time,${title},s.tau [${title}]\\n0,1,1\\n1,2,2\\n`], `${title}.csv`);
  measured(file); // is refused for its unit, or asks for its columns where their titles name no variable
  for (let k = 0; k < 40 && kept.length < 2 && !at("dialog").open; k++) await new Promise((go) => setTimeout(go, 5));
  await look("measured file");
  if (!at("dialog").open) {
    const columns = readCsv(await textOf(file));
    columnsOf({ columns, name: file.name, time: columns[1], timeUnit: payload, pairs: new Map(), shift: 0 });
  }
  await answer(payload); await look("columns");
  groupChosen(); select(["a"]); groupChosen(); await answer(payload); await look("group");
  conflict(payload); await look("conflict"); conflict(null);
  await paste(payload); await look("pasted");
  for (const kind of ["complete", "explain"]) await ask(kind, { text: valid, offset: 9 }).then((made) =>
    kind === "explain" ? hint(made, { clientX: 0, clientY: 0 }) : words(made)).catch(tell);
  await look("words"); words([]); hint("");
  await instant(0.5); await look("instant"); leave();
  return bad;
}"""
GROUPS = [PAYLOADS[k::8] for k in range(8)]


def _text(payload: str) -> str:
    return json.dumps(payload, ensure_ascii="\x7f" in payload)


def _file(payload: str) -> str:
    """A name of a file with the payload, as far as there can be one."""
    return "".join(letter for letter in payload if letter.isprintable() and letter != "/") + ".toml"


def _drive(folder: Path, payload: str) -> Path:
    inner = _file(payload)
    (folder / inner).write_text(INNER.format(_text(payload)), encoding="utf-8")
    path = folder / f"whole_{inner}"
    comment = "".join(letter for letter in payload if letter.isprintable())
    path.write_text(NETLIST.format(_text(payload), _text(f"./{inner}"), comment), encoding="utf-8")
    return path


def _check(browser: Any) -> None:
    assert browser.run(FOREIGN) is False
    complaints = [one for one in browser.complaints if not one.startswith("http://127.0.0.1")]
    assert complaints == []
    browser.run(INJECT)
    assert browser.run("window.hacked === undefined"), "the policy forbids scripts that the page does not name"
    assert sum("Content Security Policy" in one for one in browser.complaints) >= 2
    browser.complaints.clear()


@pytest.mark.browser
@pytest.mark.parametrize("group", range(8))
def test_payloads_are_text_in_reports(browser: Any, tmp_path: Path, group: int) -> None:
    for payload in GROUPS[group]:
        assembly = load(_drive(tmp_path, payload))
        save_report(assembly, simulate(assembly), tmp_path / "report.html")
        browser.open(tmp_path / "report.html")
        assert browser.run(FOREIGN) is False, payload
    _check(browser)


@pytest.fixture
def hand(browser: Any, tmp_path: Path) -> Iterator[Hand]:
    with serving(Session(_drive(tmp_path, PAYLOADS[0]), folder=tmp_path)) as server, using(browser, server) as made:
        yield made


@pytest.mark.browser
@pytest.mark.parametrize("group", range(8))
def test_payloads_are_text_in_the_page(hand: Hand, tmp_path: Path, group: int) -> None:
    for payload in GROUPS[group]:
        texts = [field.format(_text(payload)) for field in FIELDS]
        valid = _drive(tmp_path, payload).read_text(encoding="utf-8")
        content = {"payload": payload, "texts": texts, "valid": valid}
        assert hand.page.evaluate(MEETS.replace("FOREIGN", FOREIGN), content) == [], payload
    _check(hand.browser)


@pytest.mark.parametrize("payload", [one for one in PAYLOADS if not f"a{one}".isidentifier()])
@pytest.mark.parametrize("section", ['[parts]\n{0} = {{ is = "Inertia", J = 1 }}\n', "[parameters]\n{0} = 1\n"])
def test_no_part_and_no_parameter_has_such_a_name(payload: str, section: str) -> None:
    with pytest.raises(ModelicaLikeError):
        loads(section.format(_text(f"a{payload}")) + '[parts.b]\nis = "Inertia"\nJ = 1\n')


@pytest.mark.browser
def test_a_page_without_a_server_names_its_script(browser: Any, tmp_path: Path) -> None:
    export_html(Path(__file__).parents[2] / "examples" / "two_mass.toml", tmp_path / "page.html")
    browser.open(tmp_path / "page.html")
    _check(browser)
