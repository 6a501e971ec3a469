"""The page of a drive: what is written, and what a browser makes of it."""

import json
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calls import called

from modelica_like import build, export_html, simulate
from modelica_like.errors import ExportError, UnitError, UnknownName, ValueOutOfRange
from modelica_like.language.units import parse_unit
from modelica_like.show.browser.page import _span, _spelled

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVES = ("machine_table_direct", "machine_table_geared", "machine_tool_startup")
LARGEST = 1_000_000
"""Bytes of a page."""
SOONEST = 100.0
"""Time in ms within which a moved slider shows its curves."""

in_a_browser = pytest.mark.browser

# Put a value, and wait until its picture stands there; the time in ms that this took.
PUT = """(async (name, value, how) => {
  const field = [...document.querySelectorAll(`input[type="${how}"]`)].find((one) => one.ariaLabel.startsWith(name));
  const status = document.getElementById("status"), before = status.dataset.turn, begin = performance.now();
  field.value = value;
  field.dispatchEvent(new Event("input"));
  while (status.dataset.turn === before) await new Promise(requestAnimationFrame);
  await new Promise(requestAnimationFrame);
  return performance.now() - begin;
})"""


@pytest.fixture(scope="session")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    for name in DRIVES:
        export_html(EXAMPLES / f"{name}.toml", folder / f"{name}.html")
    return {name: folder / f"{name}.html" for name in DRIVES}


def content(page: Path) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="page">(.*?)</script>', page.read_text(encoding="utf-8"))
    assert found is not None
    return json.loads(found[1])


def put(browser: Any, name: str, value: float, how: str = "number") -> float:
    return browser.run(f"{PUT}({json.dumps(name)}, {value!r}, {how!r})")


def said(browser: Any) -> str:
    return browser.run("document.getElementById('said').textContent")


def curves(browser: Any) -> dict[str, np.ndarray]:
    """What the page shows, in its units and with the signs of variables; and times."""
    script = """({time: [...picture.times], events: [...picture.run.events],
      ...Object.fromEntries([...shown, ...MODES].map((one) =>
        [one.name, [...values(picture.run, one)].map((value) => one.driving * value)]))})"""
    return {name: np.array(values) for name, values in browser.run(script).items()}


# -- what is written ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DRIVES)
def test_a_page_is_small_and_asks_for_nothing(pages: dict[str, Path], name: str) -> None:
    text = pages[name].read_text(encoding="utf-8")
    assert pages[name].stat().st_size < LARGEST
    assert re.findall(r'(?:src|href)="([^"]*)"', text) == ["data:,"]
    assert "default-src 'none'" in text


def test_the_command_writes_a_page_alone_or_with_an_fmu(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["export", str(EXAMPLES / "two_mass.toml"), "--html", "two.html", "--show", "J?.w", "--set", "J1.J=2"]
    result = called(command)
    assert re.fullmatch(r"two\.html: \d+ sliders, 2 curves, \d+ kB, \d+\.\d s\n", result.stdout)
    assert [one.name for one in tmp_path.iterdir()] == ["two.html"]
    page = content(tmp_path / "two.html")
    assert [one["name"] for one in page["variables"] if one["shown"]] == ["J1.w", "J2.w"]
    assert next(one["value"] for one in page["sliders"] if one["name"] == "J1.J") == 2.0
    result = called([*command, "-o", "two.fmu", "--platform", "none"])
    assert [line.partition(":")[0] for line in result.stdout.splitlines()[:2]] == ["two.html", "two.fmu"]


def test_sliders_are_the_tunable_parameters_in_their_units(pages: dict[str, Path]) -> None:
    model = build(EXAMPLES / "machine_table_direct.toml")
    sliders = {one["name"]: one for one in content(pages["machine_table_direct"])["sliders"]}
    assert set(sliders) == {"end time", *(one.path for one in model.flat_parameters if one.tunable)}
    assert (sliders["motor_speed"]["value"], sliders["motor_speed"]["unit"]) == (pytest.approx(6000.0), "rpm")
    assert (sliders["lead"]["value"], sliders["lead"]["low"], sliders["lead"]["high"]) == pytest.approx((15, 3, 75))
    assert sliders["table_mass"]["log"]
    assert sliders["hub_inertia"]["unit"] == "kg·m²"


@pytest.mark.parametrize(
    ("value", "low", "high", "expected"),
    [
        (2.0, None, None, (0.4, 10.0, True)),
        (-2.0, None, None, (-10.0, -0.4, True)),
        (2.0, 1.0, None, (1.0, 10.0, True)),
        (0.5, 0.0, 1.0, (0.0, 1.0, False)),
        (0.0, None, None, (-1.0, 1.0, False)),
        (0.0, 0.0, None, (0.0, 1.0, False)),
    ],
)
def test_ranges_of_sliders(value: float, low: float | None, high: float | None, expected: tuple[Any, ...]) -> None:
    assert _span(value, low, high) == pytest.approx(expected)


def test_the_netlist_chooses_units(tmp_path: Path) -> None:
    text = (EXAMPLES / "machine_table_direct.toml").read_text(encoding="utf-8")
    drive = tmp_path / "rpm.toml"
    drive.write_text(f'{text}\n[display]\nspeed = "rpm"\n', encoding="utf-8")
    export_html(drive, tmp_path / "rpm.html")
    page = content(tmp_path / "rpm.html")
    speed = next(one for one in page["sliders"] if one["name"] == "motor_speed")
    assert (speed["value"], speed["unit"]) == (pytest.approx(6000.0), "rpm")
    curve = next(one for one in page["variables"] if one["name"] == "motor.w")
    assert page["units"][curve["unit"]]["text"] == "rpm"


@pytest.mark.parametrize(
    ("unit", "text"), [("N.m.s/rad", "N·m·s/rad"), ("kg.m2/s2", "kg·m²/s²"), ("deg", "°"), ("1", ""), ("*", "")]
)
def test_spelling_of_units(unit: str, text: str) -> None:
    assert _spelled(parse_unit(unit)) == text


def test_no_text_of_a_model_gets_out_of_its_place(tmp_path: Path) -> None:
    text = (EXAMPLES / "two_mass.toml").read_text(encoding="utf-8")
    text = re.sub(r'description = ".*"', 'description = "</script><script>throw 1</script> {{page}}"', text, count=1)
    (tmp_path / "x.toml").write_text(text, encoding="utf-8")
    export_html(tmp_path / "x.toml", tmp_path / "x.html")
    page = (tmp_path / "x.html").read_text(encoding="utf-8")
    assert "<p>&lt;/script&gt;&lt;script&gt;throw 1&lt;/script&gt; {{page}}</p>" in page
    assert page.count("</script>") == 2


def test_mistakes_are_told(tmp_path: Path) -> None:
    drive = EXAMPLES / "two_mass.toml"
    with pytest.raises(ExportError, match=r"A page is a file with the ending \.html, not 'x\.htm'\."):
        export_html(drive, tmp_path / "x.htm")
    with pytest.raises(UnknownName, match=r"two_mass has no variable 'J9\.w'"):
        export_html(drive, tmp_path / "x.html", show=["J9.w"])
    with pytest.raises(UnknownName, match=r"^A page with sliders cannot show 'J1\.stored_energy': it has variables, "
                                          r"parameters and modes\.$"):  # fmt: skip
        export_html(drive, tmp_path / "x.html", show=["2*J1.stored_energy"])
    with pytest.raises(UnitError, match=r"^'J1.w \+ J1.phi' mixes rad/s and rad\.$"):
        export_html(drive, tmp_path / "x.html", show=["J1.w + J1.phi"])

    endless = tmp_path / "endless.toml"
    endless.write_text(re.sub(r"(?m)^until = .*$", "", drive.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(ValueOutOfRange, match=r"There is no end time\."):
        export_html(endless, tmp_path / "x.html")
    assert list(tmp_path.iterdir()) == [endless]


# -- in a browser ------------------------------------------------------------------------------------------------------


@in_a_browser
@pytest.mark.parametrize("name", DRIVES)
def test_curves_are_those_of_idas(browser: Any, pages: dict[str, Path], name: str) -> None:
    browser.open(pages[name])
    put(browser, "motor_speed", 900.0 if "table" in name else 25.0)
    si = 900.0 * 2 * np.pi / 60 if "table" in name else 25.0
    assert (said(browser), browser.complaints) == ("", [])
    run = simulate(EXAMPLES / f"{name}.toml", parameters={"motor_speed": si}, rtol=1e-9)
    drawn = curves(browser)
    once = np.flatnonzero(np.diff(drawn["time"], append=np.inf, prepend=-np.inf)[1:] > 0)
    near = np.abs(run.time[:, None] - drawn["time"][None, once]).argmin(axis=0)
    same = np.abs(run.time[near] - drawn["time"][once]) < 1e-12
    instants = {event.time for event in run.events}
    same &= np.array([all(abs(t - one) > 1e-6 for one in instants) for t in drawn["time"][once]])
    assert same.sum() > 450
    for variable in set(drawn) - {"time", "events"}:
        if variable in run.model.position:
            expected = run[variable][near[same]]
            scale = max(np.ptp(run[variable]), 1e-3 * np.abs(run[variable]).max())
            np.testing.assert_allclose(drawn[variable][once][same], expected, atol=2e-5 * scale, rtol=0)
    times = drawn["events"].reshape(-1, 7)[:, 0]
    np.testing.assert_allclose(times, [event.time for event in run.events], atol=1e-6)


@in_a_browser
def test_the_clutch_of_document_000_engages_when_its_slider_says(browser: Any, pages: dict[str, Path]) -> None:
    browser.open(pages["machine_table_direct"])
    put(browser, "acceleration_time", 0.3)
    drawn = curves(browser)
    assert drawn["events"].reshape(-1, 7)[-1, 0] == pytest.approx(0.3, abs=1e-6)
    assert drawn["table.v"][-1] == pytest.approx(100 * 0.015)


@in_a_browser
@pytest.mark.parametrize(("name", "slider"), [*zip(DRIVES, ("acceleration_time", "table_mass", "k1"), strict=True)])
def test_a_moved_slider_redraws_at_once(browser: Any, pages: dict[str, Path], name: str, slider: str) -> None:
    browser.open(pages[name])
    taken = [put(browser, slider, 0.3 + 0.02 * k, "range") for k in range(14)]
    assert (said(browser), browser.complaints) == ("", [])
    # Other processes interrupt; the fastest quarter tells what the page takes.
    assert sorted(taken[2:])[3] < SOONEST


@in_a_browser
def test_what_cannot_run_is_told_and_reset_mends_it(browser: Any, pages: dict[str, Path]) -> None:
    browser.open(pages["machine_table_direct"])
    put(browser, "clutch.creep_time", -1.0)
    assert said(browser) == "clutch.creep_time = -1 is out of range: it must be at least 0."
    assert browser.run("document.getElementById('curves').className") == "stale"
    browser.run("document.getElementById('reset').click()")
    browser.run("new Promise((go) => setTimeout(go, 300))")
    assert (said(browser), browser.run("document.getElementById('curves').className")) == ("", "")
    assert browser.complaints == []


@in_a_browser
def test_a_long_run_gives_way_to_the_next_one(browser: Any, pages: dict[str, Path]) -> None:
    browser.open(pages["machine_tool_startup"])
    browser.run("(PAGE.sliders[0].put(1e6), new Promise((go) => setTimeout(go, 400)))")
    begin = time.perf_counter()
    put(browser, "end time", 0.5)
    assert time.perf_counter() - begin < 2.0
    assert curves(browser)["time"][-1] == 0.5
    assert said(browser) == ""


@in_a_browser
def test_curves_come_and_go_and_tell_their_values(browser: Any, pages: dict[str, Path]) -> None:
    browser.open(pages["machine_table_direct"])
    wait = "new Promise((go) => setTimeout(go, 300))"
    browser.run(f"(at('add').value = 'table.s', at('add').onchange(), {wait})")
    assert "position in m" in browser.run("document.getElementById('curves').textContent")
    box = browser.run("(({left, width}) => [left, width])(at('curves').getBoundingClientRect())")
    x = box[0] + 58 + 0.5 * (box[1] - 58 - 14)
    browser.page.mouse.move(x, 200)
    read = browser.run(f"{wait}.then(() => at('readout').textContent)")
    assert re.fullmatch(r"t = (0\.2|0\.19\d+|0\.20\d+) s · clutch\.mode \w+.*", read)
    values = browser.run("[...document.querySelectorAll('figcaption button')].map((one) => one.textContent)")
    names = [one.partition("\u2002")[0] for one in values]
    assert names == ["motor.w", "clutch.w_rel", "hub.w", "\u2212clutch.tau", "table.v", "table.s"], (
        "what drives is positive"
    )
    assert float(values[0].partition("\u2002")[2]) == pytest.approx(200 * np.pi, abs=0.01)
    browser.run(f"([...document.querySelectorAll('figcaption button')].at(-1).click(), {wait})")
    assert "position" not in browser.run("document.getElementById('curves').textContent")


@in_a_browser
@pytest.mark.parametrize("width", [340, 700, 1600])
def test_it_fits_any_width_and_both_themes(browser: Any, pages: dict[str, Path], width: int) -> None:
    browser.open(pages["machine_tool_startup"], width, 800)
    assert browser.run("document.documentElement.scrollWidth") <= width
    colours = set[str]()
    for theme in ("light", "dark"):
        browser.page.emulate_media(color_scheme=theme)
        colours.add(browser.run("getComputedStyle(document.body).backgroundColor"))
    browser.page.emulate_media(color_scheme="light")
    assert colours == {"rgb(255, 255, 255)", "rgb(21, 24, 29)"}
    assert browser.complaints == []
