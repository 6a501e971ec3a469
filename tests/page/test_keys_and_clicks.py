"""What a hand does with parts: copies, cuts, pastes, groups, opens, replaces; and what is saved without being asked."""

from pathlib import Path
from typing import Any

import pytest
from hand import Hand, using
from pages import serving

from modelica_like import simulate
from modelica_like.page import Session

TEXT = """# A drive.
[parts]
motor = { is = "ConstantTorque", tau_constant = "5 N.m" }
J1 = { is = "Inertia", J = "2 kg.m2", w = 0, phi = 0 } # of the motor
shaft = { is = "SpringDamper", c = "100 N.m/rad", d = "1 N.m.s/rad", phi_rel = 0, w_rel = 0 }
J2 = { is = "Inertia", J = "1 kg.m2" }

[series]
drive = ["motor", "J1", "shaft", "J2"]

[simulate]
until = "1 s"
"""
PASTED = """[parts]
J1 = { is = "Inertia", J = "7 kg.m2" }
oil = { is = "Damper", d = "1 N.m.s/rad" }

[series]
brake = ["J1", "oil"]
"""


def chosen(hand: Hand) -> list[str]:
    return sorted(hand.browser.run("[...page.selected]"))


def choose(hand: Hand, *names: str) -> None:
    """Click parts, the further ones with Shift."""
    hand.select(names[0])
    for name in names[1:]:
        hand.page.keyboard.down("Shift")
        hand.select(name)
        hand.page.keyboard.up("Shift")
    assert chosen(hand) == sorted(names)


def clipboard(hand: Hand, text: str) -> None:
    """Put text into the clipboard, as another program does."""
    hand.page.evaluate(
        """(text) => { const field = document.createElement("textarea"); field.value = text;
        document.body.append(field); field.select(); document.execCommand("copy"); field.remove(); }""", text,
    )  # fmt: skip


@pytest.mark.browser
def test_parts_are_copied_cut_and_pasted_by_keys(hand: Hand) -> None:
    press = hand.page.keyboard.press
    choose(hand, "J1", "shaft")
    press("Control+c")
    press("Control+v")
    hand.wait()
    assert chosen(hand) == ["J3", "shaft_2"], "J2 is in use"
    assert hand.browser.run("page.data.series.drive_2") == ["J3", "shaft_2"]
    assert 'J3 = { is = "Inertia", J = "2 kg.m2", w = 0, phi = 0 }' in hand.text
    press("Control+x")
    hand.wait()
    assert hand.text == TEXT
    press("Control+v")
    hand.wait()
    assert hand.browser.run("page.data.parts.J3.J") == "2 kg.m2"
    press("Control+z")
    assert hand.text == TEXT


@pytest.mark.browser
def test_text_of_a_netlist_is_pasted_as_parts(hand: Hand) -> None:
    clipboard(hand, PASTED)
    hand.page.locator("#sheet").focus()
    hand.page.keyboard.press("Control+v")
    hand.wait()
    assert chosen(hand) == ["J3", "oil"]
    assert hand.browser.run("page.data.series.brake") == ["J3", "oil"]
    hand.page.keyboard.press("Control+z")
    assert hand.text == TEXT
    clipboard(hand, "no netlist")
    hand.page.locator("#sheet").focus()
    hand.page.keyboard.press("Control+v")
    hand.wait()
    assert hand.said != ""
    assert hand.text == TEXT
    hand.page.locator("#search").focus()  # in a field it is text
    hand.page.keyboard.press("Control+v")
    assert hand.page.input_value("#search") == "no netlist"


@pytest.mark.browser
def test_parts_are_grouped_opened_changed_and_left(hand: Hand, tmp_path: Path) -> None:
    before = simulate(tmp_path / "drive.toml")["J2.w"][-1]
    choose(hand, "shaft", "J2")
    hand.page.get_by_role("button", name="Group …").click()
    hand.page.fill("#dialog input[name=name]", "tail")
    hand.page.click("#dialog .main")
    hand.wait()
    assert chosen(hand) == ["tail"]
    hand.page.dblclick("#sheet .part[data-part=tail] .hold")
    hand.wait()
    assert hand.said.startswith("'tail.toml' is not written yet.")
    hand.page.keyboard.press("Control+s")
    hand.wait()
    assert (tmp_path / "tail.toml").is_file()
    assert simulate(tmp_path / "drive.toml")["tail.J2.w"][-1] == pytest.approx(before, rel=1e-9)
    hand.page.dblclick("#sheet .part[data-part=tail] .hold")
    hand.until("page.file === 'tail.toml'")
    hand.wait()
    assert hand.page.locator("#trail > *").all_inner_texts() == ["drive.toml", "tail.toml"]
    hand.select("J2")
    hand.type("J2.J", "4 kg.m2")
    hand.page.get_by_role("button", name="drive.toml").click()
    hand.until("page.file === 'drive.toml'")
    hand.until(
        "results.revision === page.revision && results.content?.variables.some((one) => one.name === 'tail.J2.w')"
    )
    end = "values(results.run, results.content.variables.find((one) => one.name === 'tail.J2.w')).at(-1)"
    hand.browser.run("results.shown.includes('tail.J2.w') || toggleCurve('tail.J2.w')")
    hand.wait()
    changed = simulate(_changed(tmp_path), solver="native")["J2.w"][-1]
    assert hand.browser.run(end) == pytest.approx(changed, rel=1e-6), "the part inside has what is not saved yet"
    assert "4 kg.m2" not in (tmp_path / "tail.toml").read_text()
    choose(hand, "tail")
    hand.page.keyboard.press("Enter")
    hand.until("page.file === 'tail.toml'")


def _changed(folder: Path) -> Path:
    path = folder / "expected.toml"
    path.write_text(TEXT.replace('J = "1 kg.m2"', 'J = "4 kg.m2"'))
    return path


@pytest.mark.browser
def test_a_part_is_replaced_by_a_click_and_what_goes_is_told(hand: Hand) -> None:
    hand.select("shaft")
    hand.page.get_by_role("button", name="Replace …").click()
    hand.page.fill("#search", "spring")
    hand.page.locator('.entry[data-kind="Spring"]').click()
    hand.wait()
    assert hand.browser.run("page.data.parts.shaft") == {"is": "Spring", "c": "100 N.m/rad", "phi_rel": 0}
    assert hand.browser.run("page.data.series.drive") == ["motor", "J1", "shaft", "J2"]
    assert all(f"shaft.{name}" in hand.said or f" {name}" in hand.said for name in ("d", "w_rel"))
    hand.page.keyboard.press("Control+z")
    assert hand.text == TEXT
    hand.select("shaft")
    hand.page.get_by_role("button", name="Replace …").click()
    hand.page.keyboard.press("Escape")
    hand.find("Spring")
    hand.page.locator('.entry[data-kind="Spring"]').click()
    hand.page.keyboard.press("Escape")
    assert hand.text == TEXT, "Esc leaves it as it is"


@pytest.mark.browser
def test_what_is_valid_is_saved_by_itself(browser: Any, tmp_path: Path) -> None:
    """`--autosave`; what is not valid, and a file that another editor has changed, wait."""
    file = tmp_path / "drive.toml"
    file.write_text(TEXT)
    with serving(Session(file, autosave=True)) as server, using(browser, server) as hand:
        hand.select("J2")
        hand.type("J2.J", "3 kg.m2")
        assert file.read_text() == hand.text == TEXT.replace('"1 kg.m2"', '"3 kg.m2"')
        assert hand.page.inner_text("#unsaved") == ""
        hand.write(TEXT.replace("Inertia", "Inertai", 1))
        assert "Inertai" not in file.read_text()
        assert hand.page.inner_text("#unsaved") == "not saved"
        hand.write(TEXT)
        assert file.read_text() == TEXT
        hand.page.click("#undo")
        hand.page.click("#undo")
        hand.wait()
        assert file.read_text() == hand.text
        theirs = TEXT.replace("# A drive.", "# Their drive.")
        server.session.watch = lambda request: {**request, "conflict": None}  # it has not looked yet
        file.write_text(theirs)
        hand.type("J2.J", "5 kg.m2")
        said = hand.page.locator("#inspector .refused", has_text="'drive.toml' has been changed by another program.")
        assert said.count() == 1
        assert file.read_text() == theirs
        del server.session.watch
        hand.page.get_by_role("button", name="Keep mine").click()
        hand.wait()
        assert "5 kg.m2" in hand.text


OWN = """from pathlib import Path
Path(__file__).with_name("has_run").touch()
from components import Inertia

class Hub(Inertia):
    'A hub.'
"""


@pytest.mark.browser
def test_the_page_asks_before_a_module_runs(browser: Any, tmp_path: Path) -> None:
    (tmp_path / "own_hub_of_page.py").write_text(OWN)
    (tmp_path / "drive.toml").write_text(TEXT.replace('"Inertia", J = "1', '"own_hub_of_page:Hub", J = "1'))
    with serving(Session(tmp_path / "drive.toml")) as server, using(browser, server) as hand:
        button = hand.page.get_by_role("button", name="Run the modules of this folder")
        button.click()
        hand.page.get_by_role("button", name="Cancel").click()
        hand.wait()
        assert not (tmp_path / "has_run").exists()
        assert hand.page.locator("#sheet .part").count() == 0
        button.click()
        hand.page.get_by_role("button", name="Run them").click()
        hand.wait()
        assert (tmp_path / "has_run").exists()
        assert hand.page.locator('#sheet .part[data-part="J2"]').count() == 1


@pytest.mark.browser
def test_ends_that_fit_light_up_and_the_others_say_why(hand: Hand) -> None:
    hand.put("Resistor")
    hand.page.mouse.click(*hand.end("J2.flange_b"))
    hand.until("joining && Object.keys(joining.fits).length")
    fits = hand.browser.run("[...document.querySelectorAll('#sheet .end.fit')].map((one) => one.dataset.end)")
    assert {end.partition(".")[0] for end in fits} == {"motor", "J1", "shaft", "J2"}
    hand.page.mouse.move(*hand.end("resistor.p"))
    assert "a Flange (rad, N.m) cannot join a Pin (V, A)" in hand.page.inner_text("#hint")
    hand.page.keyboard.press("Escape")
    assert hand.page.locator("#sheet .end.fit").count() == 0
