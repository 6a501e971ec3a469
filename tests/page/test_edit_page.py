"""The page in a browser: mistakes, curves, keys, other editors, and clicks without a meaning."""

import random
from pathlib import Path
from typing import Any

import pytest
from hand import READY, Hand
from pages import serving

from modelica_like import simulate
from modelica_like.page import PageServer, Session

EXAMPLES = Path(__file__).parents[2] / "examples"
TEXT = (EXAMPLES / "machine_tool_startup.toml").read_text()
FIELDS = [
    ("J1.J", "-1"), ("J1.J", "three"), ("J1.J", "1 N.m"), ("J1.J", "1 furlong"), ("J1.J", "1/"), ("J1.J", "1e999"),
    ("J1.J", "nan"), ("J1.J", "1 kg.m3"), ("clutch.capacity", "1 s"), ("clutch.peak", "0.1"), ("J1.w", "fast"),
]  # fmt: skip
TEXTS = [
    ('is = "Inertia"', 'is = "Inertai"'), ("[parts]", "[prats]"), ("[parts]", "[parts"), ('"Inertia"', '"Inertia'),
    ("[series]", '[series]\nmore = ["J1", "nobody"]'),
    ("[connect]", '[connect]\nmore = ["J1.flange_x", "J2.flange_a"]'),
    ("[parts]", "[parts]\nnew = 3"), ("[parts]", '[parts]\nnew = { is = "" }'), ("[parts]", '[parts]\nnew = { J = 1 }'),
    ("[parts]", '[parts]\nJ1 = { is = "Inertia", J = 1 }'), ("[parts]", '[parts]\nnew = { is = "./nowhere.toml" }'),
    ("[parts]", '[parts]\nnew = { is = "nowhere:Class" }'), ("[parts]", '[parts]\n"a b" = { is = "Inertia", J = 1 }'),
    ("[parts]", '[parts]\nnew = { is = "Inertia", J = "2*new.J" }'), ("[parts]", "[unknown]\na = 1\n[parts]"),
    ("[parts]", '[parts]\nnew = { is = "Clutch" }'), ("[parts]", '[parts]\nnew = { is = "Inertia", J = 1, K = 2 }'),
    ("[parts]", '[start]\n"J1.x" = 1\n[parts]'), ("[parts]", '[parts]\nnew = { is = "Inertia", count = -1, J = 1 }'),
]  # fmt: skip


@pytest.mark.browser
def test_thirty_mistakes_are_told_and_taken_back(hand: Hand) -> None:
    """A field tells why it is refused; a text that is not valid leaves the picture, greyed."""
    for path, value in FIELDS:
        hand.select(path.partition(".")[0])
        hand.type(path, value)
        field = hand.page.locator(f'#inspector [data-path="{path}"]')
        refused = field.locator("xpath=..").locator(".refused")
        assert refused.count() or hand.browser.run("page.problems.length"), (path, value)
        if hand.text != TEXT:
            hand.page.click("#undo")
        assert hand.text == TEXT
        hand.select("")
    parts = hand.page.locator("#sheet .part").count()
    for old, new in TEXTS:
        assert old in TEXT
        hand.write(TEXT.replace(old, new, 1))
        assert hand.page.locator("#problems li").count() > 0, new
        assert hand.page.locator("#sheet .part").count() >= parts
        valid = hand.browser.run("page.valid")
        assert ("stale" in hand.page.get_attribute("#sheet", "class").split()) is not valid, new
        hand.page.click("#undo")
        assert hand.text == TEXT
    assert len(FIELDS) + len(TEXTS) == 30


@pytest.mark.browser
def test_a_part_is_clicked_or_dragged_onto_a_line(hand: Hand) -> None:
    hand.put("SpringDamper", line="J1.flange_b shaft1.flange_a")
    assert hand.browser.run("page.data.series.drive.indexOf('spring_damper')") == 4
    hand.find("Inertia")
    hand.page.mouse.move(*hand.middle('.entry[data-kind="Inertia"]'))
    hand.page.mouse.down()
    hand.page.mouse.move(300, 300, steps=3)
    hand.page.mouse.move(*hand.middle('.wire[data-ends="J3.flange_b shaft2.flange_a"]'), steps=3)
    hand.page.mouse.up()
    hand.wait()
    assert hand.browser.run("page.data.series.drive.slice(8, 11).join()") == "J3,inertia,shaft2"


@pytest.mark.browser
def test_a_suggestion_is_applied_by_one_click(hand: Hand) -> None:
    hand.write(TEXT.replace('is = "Inertia"', 'is = "Inertai"', 1))
    assert hand.page.locator(".marked").inner_text() == "Inertai"
    hand.page.get_by_role("button", name="Write 'Inertia'").click()
    assert hand.text == TEXT


SUGGESTED = {
    "Connect s.flange_b to b.flange_a": (
        """[parts]
a = { is = "Inertia", J = 1 }
s = { is = "Spring", c = 5 }
b = { is = "Inertia", J = 2 }
[series]
x = ["a", "s"]
""", "page.problems.every((one) => !one.what.includes('s.flange_b'))"),
    "Put a SpringDamper between a.flange and b.flange": (
        """[parts]
a = { is = "ConstantSpeed", w_fixed = 1 }
b = { is = "ConstantSpeed", w_fixed = 2 }
[connect]
x = ["a.flange", "b.flange"]
""", "page.data.parts.spring.is === 'SpringDamper'"),
    "Give m.tau a value": (
        """[parts]
m = { is = "Torque" }
a = { is = "Inertia", J = 1 }
[series]
x = ["m", "a"]
""", "document.activeElement.dataset.path === 'm.tau'"),
}  # fmt: skip


@pytest.mark.browser
@pytest.mark.parametrize("button", SUGGESTED)
def test_every_kind_of_suggestion_is_a_button(hand: Hand, button: str) -> None:
    text, reached = SUGGESTED[button]
    hand.write(text)
    hand.page.get_by_role("button", name=button, exact=True).click()
    hand.wait()
    hand.until(reached)
    assert not any("is not a function" in one for one in hand.browser.complaints)


@pytest.mark.browser
def test_curves_are_those_of_a_run_and_follow_a_value(hand: Hand) -> None:
    ends = "values(results.run, results.content.variables.find((one) => one.name === 'J1.w')).at(-1)"
    hand.browser.run("results.shown.includes('J1.w') || toggleCurve('J1.w')")
    hand.wait()
    before = hand.browser.run(ends)
    assert before == pytest.approx(
        simulate(EXAMPLES / "machine_tool_startup.toml", solver="native")["J1.w"][-1], rel=1e-6
    )
    hand.select("J1")
    hand.type("J1.J", "3 kg.m2")
    run = simulate(EXAMPLES / "machine_tool_startup.toml", solver="native", parameters={"J1.J": 3.0})
    assert hand.browser.run(ends) == pytest.approx(run["J1.w"][-1], rel=1e-6)
    assert hand.page.locator("#curves path.before").count() > 0, "the earlier run is a thin line"
    hand.page.click("#keep")
    hand.page.fill("#dialog input", "<b>heavy</b>")
    hand.page.click("#dialog .main")
    hand.page.get_by_label("only differences").check()
    assert hand.browser.run("[...minus(kept[0].run, wanted()[0])].every((value) => value === 0)")
    table = "time;J1.w [rad/s]\n0,0;1,5\n0,5;2,5\n1,0;3,5\n"
    hand.page.set_input_files("#csv", {"name": "measured.csv", "mimeType": "text/csv", "buffer": table.encode()})
    hand.wait()
    hand.until("kept.length === 2")
    assert hand.browser.run("[...kept[1].run.own.get('J1.w')]") == [1.5, 2.5, 3.5]
    hand.page.click("#show-clock")
    hand.wait()
    assert hand.page.locator("body.instant").count() == 1
    hand.page.keyboard.press("Escape")
    assert hand.page.locator("#sheet .end").count() > 0


@pytest.mark.browser
def test_everything_by_keyboard(hand: Hand) -> None:
    """A part is found, inserted, renamed, doubled, removed; all is undone."""
    press = hand.page.keyboard.press
    press("/")
    hand.page.keyboard.type("springdamper")
    hand.page.locator('.entry[data-kind="SpringDamper"]').wait_for()
    hand.page.wait_for_timeout(200)
    press("Enter")
    hand.page.locator('#sheet .wire[data-ends="J1.flange_b shaft1.flange_a"]').focus()
    press("Enter")
    hand.wait()
    assert hand.browser.run("'spring_damper' in parts()")
    hand.page.locator('.part[data-part="spring_damper"]').focus()
    press("F2")
    hand.page.keyboard.type("spring")
    press("Enter")
    hand.wait()
    assert hand.browser.run("'spring' in parts()")
    hand.page.locator('.part[data-part="spring"]').focus()
    press("Control+d")
    hand.wait()
    press("Delete")
    hand.wait()
    for _ in range(4):
        press("Control+z")
        hand.wait()
    assert hand.text == TEXT
    press("Control+s")
    hand.wait()
    assert hand.page.inner_text("#unsaved") == ""


@pytest.mark.browser
def test_a_second_editor_writes_the_file(hand: Hand, server: PageServer, tmp_path: Path) -> None:
    theirs = TEXT.replace("[parts]", "# of the other editor\n[parts]")
    (tmp_path / "drive.toml").write_text(theirs)
    hand.until("page.text.includes('of the other editor')")
    hand.select("J1")
    hand.type("J1.J", "3 kg.m2")
    (tmp_path / "drive.toml").write_text(TEXT)
    hand.page.get_by_role("button", name="Take the file").wait_for()
    assert hand.page.locator("#asked pre").first.inner_text().strip() == TEXT.strip()
    hand.page.get_by_role("button", name="Keep mine").click()
    hand.wait()
    hand.page.click("#save")
    hand.wait()
    assert "3 kg.m2" in (tmp_path / "drive.toml").read_text()
    server.session.desk.change(lambda document: document.write(TEXT))  # another page of the same session
    hand.until("!page.text.includes('3 kg.m2')")


@pytest.mark.browser
def test_completion_and_explanation(hand: Hand) -> None:
    hand.page.locator("#text").focus()
    place = TEXT.index('is = "Inertia"') + len('is = "Iner')
    hand.browser.run(f"document.getElementById('text').setSelectionRange({place}, {place})")
    hand.page.keyboard.press("Control+Space")
    hand.page.locator("#words li").first.wait_for()
    assert "Inertia" in hand.page.locator("#words li b").all_inner_texts()
    hand.page.keyboard.press("Escape")
    assert hand.page.locator("#words li:visible").count() == 0


def clicks(hand: Hand, number: int, seed: int) -> None:
    """Clicks, drags and keys at random; what asks whether to leave the page, or writes files, is left out."""
    chance = random.Random(seed)
    keys = [
        *"/?abcdefghijklmnopqrstuvwxyz0123456789.", "Enter", "Escape", "Tab", "Delete", "Backspace", "F2", "ArrowLeft",
        "ArrowRight", "ArrowUp", "ArrowDown", "Control+z", "Control+y", "Control+d", "Control+c", "Control+v",
        "Control+x", "Control+a", "Control+g", "Control+Space", " ", "Shift+Tab",
    ]  # fmt: skip
    for _ in range(number):
        x, y, what = chance.uniform(0, 1399), chance.uniform(0, 899), chance.random()
        if what < 0.45:
            hand.page.mouse.click(x, y, click_count=chance.choice((1, 1, 2)))
        elif what < 0.6:
            hand.page.mouse.move(x, y)
            hand.page.mouse.down()
            hand.page.mouse.move(chance.uniform(0, 1399), chance.uniform(0, 500), steps=3)
            hand.page.mouse.up()
        else:
            hand.page.keyboard.press(chance.choice(keys))


@pytest.mark.browser
@pytest.mark.parametrize(
    ("seed", "number"), [(1, 120), *(pytest.param(k, 500, marks=pytest.mark.slow) for k in (2, 3, 4))]
)
def test_clicks_and_keys_without_a_meaning(hand: Hand, server: PageServer, seed: int, number: int) -> None:
    hand.browser.run("document.getElementById('export').remove()")
    hand.page.on("filechooser", lambda chooser: None)  # so that none waits for an answer
    clicks(hand, number, seed)
    hand.page.keyboard.press("Escape")
    hand.page.keyboard.press("Escape")
    assert hand.text == server.session.desk.document.text
    assert not hand.said.startswith("Nobody answers")


@pytest.mark.browser
def test_a_server_that_has_ended_is_told_and_its_text_goes_to_the_next(browser: Any, tmp_path: Path) -> None:
    (tmp_path / "drive.toml").write_text(TEXT)
    with serving(Session(tmp_path / "drive.toml", folder=tmp_path)) as server:
        browser.open(server.address, 1400, 900, ready=READY)
        hand = Hand(browser)
        hand.wait()
        server.shutdown()
        server.server_close()
        hand.page.click("#shelf-button")
        hand.page.fill("#text", f"# kept\n{TEXT}")
        hand.page.locator("#text").blur()
        hand.until("document.getElementById('said').textContent.startsWith('Nobody answers.')")
        kept = hand.page.input_value("#text")
        assert kept.startswith("# kept")
    browser.complaints.clear()
    with serving(Session(tmp_path / "drive.toml", folder=tmp_path)) as again:
        browser.open(again.address, 1400, 900, ready=READY)
        hand.wait()
        assert hand.text == TEXT
        hand.page.click("#shelf-button")
        hand.write(kept)
        hand.page.click("#save")
        hand.wait()
    assert (tmp_path / "drive.toml").read_text() == kept
