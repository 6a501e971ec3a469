"""The report of a run: what is written, and what a browser makes of it."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calls import called

from components import ConstantTorque, Inertia
from modelica_like import export_fmu, load, sensitivities, simulate
from modelica_like.errors import UnknownName
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    param,
    sin,
    var,
)
from modelica_like.show.report.files import write_solution
from modelica_like.show.report.page import assessed, report, save_report
from modelica_like.show.report.page.page import curves

EXAMPLES = Path(__file__).parents[2] / "examples"
SPEED, INERTIA = 200 * np.pi, 0.02 + 500 * (0.0075 / np.pi) ** 2
CLUTCH_TORQUE = INERTIA * SPEED / 0.2 + 15.0
"""Of document 000, in SI units."""
LARGEST = 1_500_000
"""Bytes of a page."""
FILTER = """
[parts]
supply = { is = "ConstantVoltage", V = "24 V" }
wire = { is = "Resistor", R = "2 Ohm" }
store = { is = "Capacitor", C = "10 mF", v = 0 }
earth = { is = "Ground" }
[connect]
a = ["supply.p", "wire.p"]
b = ["wire.n", "store.p"]
c = ["supply.n", "store.n", "earth.p"]
[simulate]
until = "0.1 s"
"""
INK = "getComputedStyle(document.documentElement).getPropertyValue('--ink')"
# How many dots of a panel have a colour.
DRAWN = """[...document.querySelectorAll("canvas")].map((one) => {
  const { data } = one.getContext("2d").getImageData(0, 0, one.width, one.height);
  return data.filter((value, k) => k % 4 === 3 && value).length;
})"""
MOVE = """((name, x) => {
  const canvas = document.querySelector("canvas"), box = canvas.getBoundingClientRect();
  const place = { clientX: box.left + 64 + x * (box.width - 76), clientY: box.top + 40, pointerId: 1, bubbles: true };
  canvas.setPointerCapture = () => {};
  canvas.dispatchEvent(new PointerEvent(name, place));
})"""


@pytest.fixture(scope="session")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    drive = load(EXAMPLES / "machine_tool_startup.toml")
    path = tmp_path_factory.mktemp("report") / "startup.html"
    save_report(drive, simulate(drive), path)
    return path


@pytest.fixture(scope="session")
def table_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    path = tmp_path_factory.mktemp("report") / "table.html"
    save_report(drive, simulate(drive), path)
    return path


def rows(page: Path, title: str) -> list[list[str]]:
    """Cells of the table of a section."""
    text = re.search(rf"<h2>{title}</h2>(.*?)</section>", page.read_text("utf-8"), re.DOTALL)
    assert text
    found = re.findall(r"<tr>(.*?)</tr>", text[1])
    cells = ([re.sub("<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row)] for row in found)
    return [row for row in cells if row]


def test_it_is_one_file_that_asks_for_nothing(page: Path) -> None:
    text = page.read_text("utf-8")
    assert len(text) < LARGEST
    assert not re.search(r'(?:src|href)="(?!data:)', text)
    assert "http://www.w3.org/2000/svg" in text


def test_what_happens_is_told_in_words(page: Path) -> None:
    text = page.read_text("utf-8")
    assert "<b>0.265473 s</b> clutch becomes stuck (slip reached zero, 537.7 J of friction work)." in text, (
        "document 003"
    )
    assert "load becomes forward (friction limit exceeded, slip begins)." in text


def test_shares_of_energy_add_up(page: Path) -> None:
    # What comes in, and what stores give, is stored or lost.
    signs = {"brought in": 1.0, "taken out": -1.0, "stored": -1.0, "lost": -1.0}
    total = sum(signs[what] * float(share.rstrip("%")) for _, what, _, share, _ in rows(page, "Energy"))
    assert total == pytest.approx(0.0, abs=0.7), "rounded to a tenth of a percent"
    clutch = next(row for row in rows(page, "Energy") if row[:2] == ["clutch", "lost"])
    assert float(clutch[2]) == pytest.approx(0.5377, abs=1e-4), "document 003, in kJ"


def test_eigenfrequencies_are_listed(page: Path) -> None:
    assert len(rows(page, "Small motions at the end")) == 3


def test_a_page_does_not_wait_for_the_modes_of_large_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assessed, "_MOST_STATES", 1)
    run = simulate(Inertia(J=1.0, phi=0.0, w=1.0), 0.1, points=2)
    assert assessed.small_motions(Inertia(), run) == (
        "<p>Not computed: all modes of 2 states take long. <code>modelica-like modes</code> computes them.</p>"
    )


def test_shapes_stand_below_the_schematic(page: Path) -> None:
    text = page.read_text("utf-8")
    assert [f"mode {k}: " in text for k in (1, 2, 3, 4)] == [True, True, True, False]


def test_energy_flows_along_the_drive(table_page: Path) -> None:
    flow = table_page.read_text("utf-8").partition("<h2>Energy</h2>")[2].partition("<table")[0]
    # All comes from the motor; half of what slips is lost, whatever the torque.
    motor = CLUTCH_TORQUE * SPEED * 0.2 + 15.0 * SPEED * 0.2
    lost = CLUTCH_TORQUE * SPEED * 0.2 / 2
    assert f"lost {lost / 1e3:.3g} kJ, {lost / motor:.1%}" in flow
    assert f">{1 - lost / motor:.0%}</text>" in flow


def test_design_checks_take_loads_from_the_run(table_page: Path) -> None:
    found = {row[0]: row[1:] for row in rows(table_page, "Design checks")}
    stress = 3**0.5 * 16 * CLUTCH_TORQUE / (np.pi * 0.032**3)
    assert found["spindle.safety"][:3] == [f"{275e6 / stress:.6g}", "", "ok"]
    drive = load(EXAMPLES / "machine_table_direct.toml")
    drive.set("load_torque", "600 N.m")
    text = report(drive, simulate(drive))
    assert '<td class="missed">below the limit 2.5 by' in text
    assert "2 limits, 1 missed: machine_table.toml." in text


def test_a_wrong_sizing_file_is_told_in_its_section(tmp_path: Path) -> None:
    text = (EXAMPLES / "machine_table_direct.toml").read_text("utf-8").replace("sizing/machine_table", "none")
    (tmp_path / "drive.toml").write_text(text, "utf-8")
    drive = load(tmp_path / "drive.toml")
    assert "none.toml&#x27; does not exist." in report(drive, simulate(drive))


def test_what_matters_most_comes_first(table_page: Path) -> None:
    found = {row[0]: row[3:] for row in rows(table_page, "What matters")}
    # W = J·w²/2 + M·w·t/2
    lost = CLUTCH_TORQUE * SPEED * 0.2 / 2
    assert next(iter(found)) == "motor_speed"
    assert float(found["motor_speed"][-1]) == pytest.approx((lost + 0.5 * INERTIA * SPEED**2) / lost, abs=1e-3)
    assert float(found["table_mass"][-1]) == pytest.approx(250.0 * (0.0075 / np.pi * SPEED) ** 2 / lost, abs=1e-3)
    assert found["lead"][:3] == ["0.000", "0.000", "1.000"], "the table moves with the lead"


class Touch(Component):
    """A wave whose crest reaches a level by a hair."""

    mode = Mode("below", "above")
    T: Parameter = param("s", "time", default=1.0)
    x: Variable = var("1", "wave")
    y: Variable = var("1", "what turns round", default=0.0)

    def equations(self) -> Equations:
        yield self.x == sin(self.time / self.T)
        yield self.T * der(self.y) == self.mode.choose(below=1, above=-1)

    def events(self) -> Events:
        yield self.mode.go("below", "above", when=self.x > 1 - 1e-14)


def test_a_gradient_that_does_not_exist_is_told() -> None:
    drive = Touch()
    told = report(drive, simulate(drive, 3.0)).partition("What matters</h2>")[2].partition("</section>")[0]
    assert told.startswith("<p>No gradient at t = 1.5707")
    assert "mode changes from below to above where its condition only grazes zero." in told
    assert ".py:" not in told


def test_parameters_are_listed_with_units(page: Path) -> None:
    assert ["k1", "6120", "N.m/rad", ""] in rows(page, "Parameters")


def test_start_values_are_listed(page: Path) -> None:
    found = {row[0]: row[1:] for row in rows(page, "Start")}
    assert found["J2.w"][:2] == ["32.401", "rad/s"]
    assert found["J2.w"][2].startswith("given in machine_tool_startup.toml:")


def test_curves_keep_both_sides_of_events() -> None:
    run = simulate(EXAMPLES / "machine_tool_startup.toml", points=10_000)
    drawn = curves(run, ["clutch.tau"])
    assert len(drawn["times"]) < 1300
    for event in run.events:
        assert drawn["times"].count(float(f"{event.time:.9g}")) >= 2
    (panel,) = drawn["panels"]
    values = np.interp(drawn["times"], run.time, -run["clutch.tau"])  # it drives where it is negative
    single = np.array([drawn["times"].count(t) == 1 for t in drawn["times"]])  # times are rounded across an event
    assert np.array(panel["curves"][0]["values"])[single] == pytest.approx(values[single], rel=1e-3, abs=1.0)


def test_curves_are_in_the_units_of_the_netlist_and_may_be_formulas() -> None:
    run = simulate(EXAMPLES / "launch.toml", points=20)
    first, second = curves(run, ["engine.w", "clutch.tau*clutch.w_rel"])["panels"]
    assert (first["title"], second["title"]) == ("speed in rpm", "power in W")
    assert first["curves"][0]["values"][-1] == pytest.approx(run["engine.w"][-1] * 30 / np.pi, rel=1e-5)
    assert second["curves"][0]["values"][0] == pytest.approx(run["clutch.loss_power"][0], abs=1e-6)


def test_modes_are_bands_without_gaps() -> None:
    run = simulate(EXAMPLES / "lepelletier.toml")
    for mode in curves(run)["modes"]:
        assert mode["bands"][0][0] == 0.0
        assert mode["bands"][-1][1] == run.time[-1]
        for (_, end, before), (begin, _, after) in zip(mode["bands"], mode["bands"][1:], strict=False):
            assert end == begin
            assert before != after


def test_names_from_outside_are_text() -> None:
    parts = {"motor": ConstantTorque(tau_constant=1), "J": Inertia(J=1)}
    wires = {"a": ["motor.flange", "J.flange_a"]}
    drive = Assembly("</script><b>", parts=parts, connect=wires, description="<i>")
    text = report(drive, simulate(drive, 1.0, start="rest"))
    assert "</script><b>" not in text
    assert "&lt;/script&gt;&lt;b&gt;" in text
    assert "<i>" not in text.partition("<section>")[0]


def test_an_unknown_pattern_is_told() -> None:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    with pytest.raises(UnknownName, match=r"no variable 'nix\.\*'"):
        report(drive, simulate(drive), show=["nix.*"])


def test_the_command_writes_it(tmp_path: Path) -> None:
    file = tmp_path / "table.html"
    result = called(["report", str(EXAMPLES / "machine_table_direct.toml"), "-o", str(file)])
    assert result.exit_code == 0, result.stdout + result.stderr
    assert file.read_text("utf-8").startswith("<!DOCTYPE html>")


# -- in a browser ------------------------------------------------------------------------------------------------------


@pytest.mark.browser
@pytest.mark.parametrize("width", [1200, 420])
def test_all_panels_are_drawn_without_complaint(browser: Any, page: Path, width: int) -> None:
    browser.open(page, width)
    assert browser.complaints == []
    drawn = browser.run(DRAWN)
    assert len(drawn) == 4
    assert min(drawn) > 1000
    assert browser.run("document.documentElement.scrollWidth <= innerWidth"), "nothing is wider than the page"


@pytest.mark.browser
def test_values_are_read_under_the_pointer(browser: Any, page: Path) -> None:
    browser.open(page)
    browser.run(f"{MOVE}('pointermove', 0.5)")
    read = browser.run("[...document.querySelectorAll('.panel output')].map((one) => one.textContent)")
    assert float(read[0]) == pytest.approx(32.417, abs=1e-3), "the motor turns with 309.6 rpm"
    assert read[-1].startswith("t = 0.5")
    assert "clutch.mode stuck" in read[-1]


@pytest.mark.browser
def test_all_panels_zoom_together(browser: Any, page: Path) -> None:
    browser.open(page)
    for name, x in (("pointerdown", 0.2), ("pointermove", 0.4), ("pointerup", 0.4)):
        browser.run(f"{MOVE}('{name}', {x})")
    low, high = browser.run("[view.low, view.high]")
    assert (low, high) == (pytest.approx(0.2, abs=0.01), pytest.approx(0.4, abs=0.01))
    browser.run(f"{MOVE}('dblclick', 0.4)")
    assert browser.run("[view.low, view.high]") == [0, 1]


@pytest.mark.browser
def test_it_has_dark_colours_and_prints(browser: Any, page: Path) -> None:
    browser.open(page)
    light = browser.run(INK)
    browser.page.emulate_media(color_scheme="dark")
    assert browser.run(INK) != light
    browser.page.emulate_media(color_scheme="light")
    assert len(browser.page.pdf()) > 15_000


@pytest.mark.browser
def test_a_long_drive_fits_a_narrow_window(browser: Any, tmp_path: Path) -> None:
    drive = load(EXAMPLES / "winch.toml")
    save_report(drive, simulate(drive), tmp_path / "winch.html")
    browser.open(tmp_path / "winch.html", 420)
    assert browser.complaints == []
    assert browser.run("[document.documentElement.scrollWidth, innerWidth]") == [420, 420]


def test_results_without_equations_have_a_report(tmp_path: Path) -> None:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    export_fmu(drive, tmp_path / "table.fmu", check=False)
    write_solution(simulate(drive), tmp_path / "table.csv")
    for source, curve in (("table.fmu", "clutch.tau"), ("table.csv", "table.v")):
        words = ["report", str(tmp_path / source), "-o", str(tmp_path / "page.html"), "--show", curve]
        result = called(words)
        assert result.exit_code == 0, result.stdout + result.stderr
        text = (tmp_path / "page.html").read_text("utf-8")
        assert re.findall(r"<h2>(.*?)</h2>", text) == ["What happens", "Curves"]
        assert f'"name":"{curve}"' in text
    result = called(["report", str(tmp_path / "table.csv"), "--set", "k=1"])
    assert (result.exit_code, result.stderr) == (2, "--set changes netlists; 'table.csv' is none.\n")


def test_a_circuit_shows_voltages_and_currents(tmp_path: Path) -> None:
    path = tmp_path / "filter.toml"
    path.write_text(FILTER, encoding="utf-8")
    panels = {one["title"]: {curve["name"]: curve["values"] for curve in one["curves"]}
              for one in curves(simulate(path))["panels"]}  # fmt: skip
    assert list(panels) == ["voltage in V", "current in A"]
    charged = 24 * (1 - np.exp(-5))  # R·C = 20 ms
    assert panels["voltage in V"]["store.v"][-1] == pytest.approx(charged, rel=1e-4)
    assert panels["current in A"]["wire.i"][0] == pytest.approx(12)


def test_what_the_curves_leave_out_is_told() -> None:
    drive = load(EXAMPLES / "machine_tool_startup.toml")
    text = report(drive, simulate(drive))
    assert "Not drawn: 3 of 9 speeds (shaft2.w_rel, J4.w, clutch.w_rel)," in text
    assert "Not drawn" not in report(drive, simulate(drive), show=["J4.w"])


def test_a_run_knows_how_it_has_started() -> None:
    drive = Assembly("drive", parts={"motor": ConstantTorque(tau_constant=2.0), "J": Inertia(J=4.0)},
                     connect={"a": ["motor.flange", "J.flange_a"]})  # fmt: skip
    run = simulate(drive, 3.0, start="rest")
    assert sensitivities(run, ["J.w"])["J.w", "J.J"] == pytest.approx(-2.0 / 4.0**2 * 3.0, rel=1e-9)
    text = report(drive, run)
    assert "<td>J.w</td>" in text.partition("<h2>Start</h2>")[2].partition("</section>")[0]
