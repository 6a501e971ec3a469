"""The values of what is selected: where they come from, what is missing, tables, and parts that are netlists."""

import pytest
from hand import Hand

TEXT = """[parts]
motor = { is = "Torque", tau = "5 N.m" }
J1 = { is = "Inertia", J = "2 kg.m2", w = "3 rad/s" }
shaft = { is = "SpringDamper", c = "100 N.m/rad", d = "1 N.m.s/rad" }
J2 = { is = "Inertia", J = "1 kg.m2" }

[series]
drive = ["motor", "J1", "shaft", "J2"]

[start]
"J1.phi" = "0.25 rad"
"shaft.phi_rel" = 0
"shaft.w_rel" = 0

[simulate]
until = "1 s"
"""
OTHERS = {
    "tail.toml": """[parameters]
damping = "2 N.m.s/rad"

[parts]
oil = { is = "Damper", d = "damping" }
wall = { is = "Fixed" }

[series]
x = ["oil", "wall"]

[expose]
flange_a = "oil.flange_a"
"""
}


@pytest.fixture
def hand(hand: Hand) -> Hand:
    hand.until("results.run")
    return hand


@pytest.mark.browser
def test_start_values_say_where_they_come_from_and_are_guesses_on_request(hand: Hand) -> None:
    hand.select("J2")
    hand.page.locator("#inspector summary", has_text="Start values").click()
    hand.page.locator("#inspector .origin").first.wait_for()
    hand.wait()
    rows = {}
    for name in ("J1", "J2"):
        hand.select(name)
        hand.page.locator("#inspector .origin").first.wait_for()
        for path in (f"{name}.phi", f"{name}.w"):
            line = hand.page.locator(f'#inspector [data-path="{path}"]').locator("xpath=..")
            rows[path] = line.locator(".origin").inner_text()
    assert rows["J1.phi"].startswith("0.25 rad · ")
    assert rows["J1.w"].startswith("3 rad/s · ")
    assert rows["J2.phi"].startswith("0.25 rad · "), "the shaft is not twisted"
    assert rows["J2.w"].startswith("3 rad/s · ")
    assert "given" in rows["J1.phi"]
    assert "given" not in rows["J2.w"]
    hand.select("J1")
    hand.page.get_by_label("J1.phi: given or guess").select_option("guess")
    hand.wait()
    assert hand.browser.run("[page.data.guess['J1.phi'], 'J1.phi' in page.data.start]") == ["0.25 rad", False]


@pytest.mark.browser
def test_a_field_says_unit_limits_and_default(hand: Hand) -> None:
    hand.select("J1")
    line = hand.page.locator('#inspector [data-path="J1.J"]').locator("xpath=..")
    assert line.locator("label").get_attribute("title") == "moment of inertia\nat least 0 kg.m2"
    assert line.locator(".unit").inner_text() == "kg.m2"
    hand.type("J1.J", "300 kg.cm2")
    assert 'J1 = { is = "Inertia", J = "300 kg.cm2"' in hand.text


@pytest.mark.browser
def test_a_slider_writes_a_number_where_the_unit_is_that_of_what_it_drives(hand: Hand) -> None:
    hand.put("Ramp")
    hand.type("ramp.duration", "1 s")
    hand.type("ramp.height", "2")
    hand.until("results.revision === page.revision")
    hand.page.get_by_label("ramp.height").locator("xpath=../input[@type='range']").evaluate(
        "(one) => { one.value = 0.9; one.dispatchEvent(new Event('change')); }"
    )
    hand.wait()
    assert isinstance(hand.browser.run("page.data.parts.ramp.height"), float | int)
    assert hand.browser.run("page.data.parts.ramp.height") != 2
    assert hand.browser.run("page.valid")


@pytest.mark.browser
def test_a_missing_value_is_a_marked_field_and_all_problems_are_told(hand: Hand) -> None:
    hand.write(TEXT.replace(', tau = "5 N.m"', "").replace('c = "100 N.m/rad", ', ""))
    told = hand.page.locator("#problems li").all_inner_texts()
    assert len(told) == 2
    assert "motor" in told[0] + told[1]
    assert "shaft" in told[0] + told[1]
    for name, path in (("motor", "motor.tau"), ("shaft", "shaft.c")):
        hand.select(name)
        field = hand.page.locator(f'#inspector [data-path="{path}"]')
        assert field.get_attribute("placeholder") == "needs a value"
        assert "missing" in str(field.locator("xpath=..").get_attribute("class"))
    hand.type("shaft.c", "100 N.m/rad")
    hand.select("motor")
    hand.type("motor.tau", "5 N.m")
    assert hand.page.locator("#problems li:not(.note)").count() == 0


@pytest.mark.browser
def test_a_netlist_of_the_folder_is_a_part(hand: Hand) -> None:
    hand.put("./tail.toml", end="J2.flange_b")
    assert hand.said == ""
    assert hand.browser.run("page.data.parts.tail") == {"is": "./tail.toml"}
    assert hand.browser.run("page.data.series.drive.at(-1)") == "tail"
    field = hand.page.locator('#inspector [data-path="tail.damping"]')
    assert "2 N.m.s/rad" in str(field.get_attribute("placeholder"))
    hand.type("tail.damping", "3 N.m.s/rad")
    assert 'tail = { is = "./tail.toml", damping = "3 N.m.s/rad" }' in hand.text
    hand.until("results.revision === page.revision && results.content")
    assert hand.browser.run("results.content.variables.some((one) => one.name === 'tail.oil.tau')")


@pytest.mark.browser
def test_the_page_of_a_class_is_one_click_away(hand: Hand) -> None:
    hand.select("shaft")
    hand.page.get_by_role("button", name="Page", exact=True).click()
    page = hand.page.locator("#dialog .page")
    page.wait_for()
    assert page.locator("h3").all_inner_texts()[0] == "Parameters"
    assert page.locator("td", has_text="N.m/rad").count() > 0
    assert "yield" in page.locator("pre").last.inner_text()
    assert "$" not in page.inner_text()
    assert page.locator("tr").nth(1).locator("td").all_inner_texts()[:2] == ["c", "N.m/rad"]
    hand.page.keyboard.press("Escape")


PASTE = """(text) => { const data = new DataTransfer(); data.setData("text/plain", text);
  document.querySelector("#dialog tbody input").dispatchEvent(new ClipboardEvent("paste",
    { clipboardData: data, bubbles: true, cancelable: true })); }"""
LINE = "[...document.querySelector('#dialog .curve path').getAttribute('d').matchAll(/[ML]/g)].length"


@pytest.mark.browser
def test_a_table_is_a_grid_with_its_curve_and_takes_cells_of_a_spreadsheet(hand: Hand) -> None:
    hand.put("CombiTable")
    hand.page.locator('#inspector [data-path="combi_table.table"]').click()
    hand.page.evaluate(PASTE, "0\t0\n1\t5\n2\t5\n")
    assert hand.page.locator("#dialog tbody tr").count() == 4, "one more to go on"
    assert hand.browser.run(LINE) == 3
    hand.page.locator("#dialog tbody tr").nth(3).locator("input").nth(0).fill("3 s")
    hand.page.locator("#dialog tbody tr").nth(3).locator("input").nth(1).fill("7")
    hand.page.locator("#dialog tbody tr").nth(1).get_by_role("button", name="Remove the row").click()
    assert hand.browser.run(LINE) == 3
    hand.page.locator("#dialog .main").click()
    hand.until("!document.getElementById('dialog').open")
    hand.wait()
    if hand.page.get_by_role("button", name="Put it on the sheet").count():
        hand.page.get_by_role("button", name="Put it on the sheet").click()
        hand.wait()
    assert hand.browser.run("page.data.parts.combi_table.table") == [[0, 0], [2, 5], ["3 s", 7]]
    assert hand.page.locator('#inspector [data-path="combi_table.table"]').inner_text() == "3 rows …"
    assert hand.page.locator("#inspector .curve path").count() == 1
