"""Runs in the page: played in the picture, signals dragged into curves, kept, measured files, calibration."""

from math import exp, pi

import pytest
from hand import Hand

TEXT = """[parts]
wall = { is = "Fixed" }
oil = { is = "Damper", d = "0.5 N.m.s/rad" } # of the data sheet
wheel = { is = "Inertia", J = "2 kg.m2", phi = 0, w = "50 rad/s" }
brake = { is = "Brake", capacity = "10 N.m" }

[series]
drive = ["wall", "oil", "wheel", "brake"]

[simulate]
until = "4 s"
"""
CAPACITY, DAMPING = 14.0, 0.3
"""What the measured wheel has."""
END = "values(results.run, results.content.variables.find((one) => one.name === 'wheel.w')).at(-1)"


def speed(time: float) -> float:
    """The wheel runs down by J dω/dt = −M − d ω."""
    return (50 + CAPACITY / DAMPING) * exp(-DAMPING * time / 2) - CAPACITY / DAMPING


def table() -> bytes:
    """As another program writes it: milliseconds, which begin 100 ms late, rpm, decimal commas, a gap, UTF-16."""
    rows = [f"{1000 * t - 100:.3f};{speed(t) * 30 / pi:.7f};x" for t in (0.25 * k for k in range(1, 17))]
    rows[3] = rows[3].split(";")[0] + ";;x"
    return "\n".join(["time [ms];tacho [rpm];note", *(row.replace(".", ",") for row in rows)]).encode("utf-16")


@pytest.fixture
def hand(hand: Hand) -> Hand:
    hand.until("results.run")
    return hand


def measured(hand: Hand) -> None:
    hand.browser.run("results.shown.includes('wheel.w') || toggleCurve('wheel.w')")
    hand.wait()
    file = {"name": "rundown.csv", "mimeType": "text/csv", "buffer": table()}
    hand.page.set_input_files("#csv", file)
    hand.page.locator("#dialog select[name='c:wheel.w']").select_option("tacho [rpm]")
    hand.page.fill("#dialog input[name=shift]", "0,1")
    hand.page.locator("#dialog .main").click()
    hand.wait()


@pytest.mark.browser
def test_a_measured_file_is_laid_over_in_its_units_and_calibrates_the_drive(hand: Hand) -> None:
    measured(hand)
    drawn = hand.browser.run("[kept[0].run.times[7], kept[0].run.own.get('wheel.w')[7]]")
    assert drawn == pytest.approx([2.0, speed(2.0)], rel=1e-6)
    hand.page.get_by_role("button", name="Calibrate …").click()
    hand.page.get_by_role("button", name="Calibrate", exact=True).click()
    assert hand.page.inner_text("#dialog .refused") == "Choose at least one value."
    for name, low, high in (("brake.capacity", "5", "30"), ("oil.d", "0,05", "1")):
        hand.page.get_by_label(f"{name}: low", exact=True).fill(low)
        hand.page.get_by_label(f"{name}: high", exact=True).fill(high)
        assert hand.page.get_by_label(f"find {name}", exact=True).is_checked()
    hand.page.get_by_role("button", name="Calibrate", exact=True).click()
    hand.page.get_by_role("button", name="Take into the netlist").wait_for()
    hand.wait()
    assert "15 numbers, 2 parameters" in hand.page.inner_text("#dialog pre")
    assert hand.text == TEXT, "nothing is written before it is asked for"
    assert hand.browser.run("kept[1].name") == "fit of rundown.csv"
    hand.page.get_by_role("button", name="Take into the netlist").click()
    hand.wait()
    values = hand.browser.run("[page.data.parts.brake.capacity, page.data.parts.oil.d]")
    assert [value.split()[1] for value in values] == ["N.m", "N.m.s/rad"]
    assert [float(value.split()[0]) for value in values] == pytest.approx([CAPACITY, DAMPING], rel=1e-3)
    assert "# of the data sheet" in hand.text
    hand.until("results.revision === page.revision")
    assert hand.browser.run(END) == pytest.approx(speed(4.0), abs=1e-2)
    hand.page.click("#undo")
    assert hand.text == TEXT


@pytest.mark.browser
def test_a_calibration_that_cannot_be_is_told(hand: Hand) -> None:
    measured(hand)
    for low, high, said in (
        ("x", "1", "A bound is no number."),
        ("2", "1", "oil.d: the lower bound 2 is not below the upper bound 1."),
        ("-1", "1", "oil.d = -1.0 is out of range"),
    ):
        hand.page.get_by_role("button", name="Calibrate …").click()
        hand.page.get_by_label("oil.d: low", exact=True).fill(low)
        hand.page.get_by_label("oil.d: high", exact=True).fill(high)
        hand.page.get_by_role("button", name="Calibrate", exact=True).click()
        hand.wait()
        assert hand.page.inner_text("#dialog .refused").startswith(said)
        hand.page.get_by_role("button", name="Cancel").click()
    hand.page.get_by_role("button", name="Columns …").click()
    hand.page.fill("#dialog input[name='u:wheel.w']", "kg")
    hand.page.locator("#dialog .main").click()
    hand.wait()
    assert "kg" in hand.said
    assert hand.browser.run("kept[0].pairs.get('wheel.w').unit") == "rpm", "what cannot be leaves all as it was"


@pytest.mark.browser
def test_a_kept_run_says_what_was_changed_and_comes_back(hand: Hand) -> None:
    hand.select("wheel")
    hand.type("wheel.J", "3 kg.m2")
    changed = hand.text
    hand.until("results.revision === page.revision")
    hand.page.click("#keep")
    hand.page.fill("#dialog input", "heavy")
    hand.page.click("#dialog .main")
    hand.wait()
    assert hand.page.inner_text(".kept small") == "", "it is the present one"
    hand.page.click("#undo")
    hand.wait()
    assert hand.page.inner_text(".kept small") == 'wheel = { is = "Inertia", J = "3 kg.m2", phi = 0, w = "50 rad/s" }'
    assert hand.text == TEXT
    hand.page.get_by_role("button", name="Take over").click()
    hand.wait()
    assert hand.text == changed


@pytest.mark.browser
def test_a_signal_is_dragged_from_a_part_into_the_curves(hand: Hand) -> None:
    hand.select("brake")
    before = hand.page.locator("#curves figure").count()
    chip = hand.page.locator(".chip", has_text="tau").first
    name = f"brake.{chip.inner_text()}"
    hand.browser.run(f"results.shown.includes({name!r}) && toggleCurve({name!r})")
    hand.wait()
    chip.drag_to(hand.page.locator("#curves"))
    hand.wait()
    assert hand.browser.run("results.shown").count(name) == 1
    assert hand.page.locator("#curves figcaption button", has_text=name).count() == 1
    assert hand.page.locator("#curves figure").count() >= before


@pytest.mark.browser
def test_the_time_cursor_colours_the_picture_and_plays(hand: Hand) -> None:
    picture = "document.querySelector('#sheet svg').outerHTML"
    plain = hand.browser.run(picture)
    box = hand.page.locator("#curves svg").first.bounding_box()
    assert box is not None
    hand.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    hand.wait()
    time = hand.browser.run("playing.time")
    assert 1.0 < time < 3.0
    assert hand.page.inner_text("#now") == f"{float(f'{time:.4g}'):g} s"
    middle = hand.browser.run(picture)
    assert middle != plain
    hand.page.locator("#moment").evaluate("(one) => { one.value = 0.1; one.dispatchEvent(new Event('input')); }")
    hand.until("playing.time === 0.1 && !playing.busy")
    moving = hand.browser.run(picture)
    assert moving != middle
    hand.page.click("#play")
    hand.until("playing.moving && playing.time > 0.5")
    assert hand.page.inner_text("#play") == "❚❚"
    hand.page.click("#play")
    hand.until("!playing.moving")
    stopped = hand.browser.run("playing.time")
    hand.page.wait_for_timeout(300)
    assert hand.browser.run("playing.time") == stopped
    hand.page.keyboard.press("Escape")
    hand.wait()
    assert hand.browser.run(picture) == plain


OPTIMIZE = """
[optimize]
minimize = "brake.capacity"
free = { "brake.capacity" = ["5 N.m", "100 N.m"] }
subject_to = ["brake.lock_time <= 3 s"]
"""
STOPS = TEXT.replace('"10 N.m"', '"40 N.m"')


def locked_after(time: float) -> float:
    """The torque M with which J dω/dt = −M − d ω stops the wheel after a time: w = (w + M/d) exp(−d t/J) − M/d."""
    part = exp(-0.5 * time / 2)
    return 50 * 0.5 * part / (1 - part)


@pytest.mark.browser
def test_the_best_design_stands_in_the_netlist_and_can_be_undone(hand: Hand) -> None:
    assert hand.page.locator("#best").is_hidden()
    given = STOPS + OPTIMIZE
    hand.browser.run(f"change('text', {{ text: {given!r} }})")
    hand.until("results.revision === page.revision")
    hand.page.click("#best")
    hand.page.get_by_role("button", name="Undo", exact=True).last.wait_for()
    hand.wait()
    assert "brake.lock_time <= 3 s' is active" in hand.page.inner_text("#dialog pre")
    value, unit = hand.browser.run("page.data.parts.brake.capacity").split()
    assert (float(value), unit) == (pytest.approx(locked_after(3.0), rel=1e-6), "N.m")
    assert "# of the data sheet" in hand.text
    hand.until("results.revision === page.revision")
    slider = "results.content.sliders.find((one) => one.name === 'brake.capacity').value"
    assert hand.browser.run(slider) == pytest.approx(locked_after(3.0), rel=1e-6)
    hand.page.locator("#dialog button", has_text="Undo").click()
    assert hand.text == given


@pytest.mark.browser
def test_a_search_shows_how_far_it_is_and_can_be_cancelled(hand: Hand) -> None:
    given = STOPS + OPTIMIZE.replace("<= 3 s", "<= 1 ms") + "starts = 500\n"
    hand.browser.run(f"change('text', {{ text: {given!r} }})")
    hand.until("results.revision === page.revision")
    hand.page.click("#best")
    hand.until("/^[1-9][0-9]* designs tried, at most about 40000/.test(at('dialog').textContent.slice(11))")
    hand.page.get_by_role("button", name="Cancel").click()
    hand.wait()
    assert hand.text == given
    hand.page.click("#best")  # the search that nobody waits for has ended, or this one would wait for it
    hand.until("/^[1-9][0-9]* designs tried/.test(at('dialog').textContent.slice(11))")
    hand.page.get_by_role("button", name="Cancel").click()


@pytest.mark.browser
def test_limits_that_cannot_be_met_leave_the_netlist_until_it_is_asked_for(hand: Hand) -> None:
    given = STOPS + OPTIMIZE.replace("<= 3 s", "<= 0.1 s")
    hand.browser.run(f"change('text', {{ text: {given!r} }})")
    hand.until("results.revision === page.revision")
    hand.page.click("#best")
    take = hand.page.get_by_role("button", name="Take into the netlist")
    take.wait_for()
    assert "The limits cannot all be met" in hand.page.inner_text("#dialog pre")
    assert hand.text == given
    take.click()
    hand.wait()
    assert hand.browser.run("page.data.parts.brake.capacity") == "100 N.m"
