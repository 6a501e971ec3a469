"""Film how a drive is built in the page: python docs/examples/animation.py writes docs/pictures/edit.webp.

A hand of the tests moves the mouse of Chromium; the pointer, which no screenshot has, is drawn into the frames.
"""

import io
import sys
import tempfile
import threading
from pathlib import Path

from PIL import Image, ImageDraw
from playwright.sync_api import Page, sync_playwright

from modelica_like.page import PageServer, Session

HERE = Path(__file__).parent
sys.path += [str(HERE.parents[1] / "tests" / folder) for folder in ("helpers", "page")]
from conftest import Browser, program  # noqa: E402
from hand import READY, Hand  # noqa: E402

TARGET = HERE.parent / "pictures" / "edit.webp"
SIZE, SHOWN = (1240, 760), (930, 570)
POINTER = [(0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12)]
PARTS = (
    ("ConstantTorque", "", "motor", {"tau_constant": "5 N.m"}),
    ("Inertia", "motor.flange", "rotor", {"J": "0.2 kg.m2"}),
    ("SpringDamper", "rotor.flange_b", "shaft", {"c": "60 N.m/rad", "d": "0.4 N.m.s/rad"}),
    ("Inertia", "shaft.flange_b", "table", {"J": "1 kg.m2"}),
)
"""Type, end to which it is joined, name, values."""
WATCH = """document.addEventListener("pointermove",
  (event) => { window.pointer = [event.clientX, event.clientY]; }, true)"""


class Film:
    """Frames of a page, each with the milliseconds for which it stays."""

    def __init__(self, page: Page) -> None:
        self.page, self.frames = page, list[tuple[Image.Image, int]]()

    def take(self, stays: int, wait: int = 120) -> None:
        """Keep what is seen after a wait in ms."""
        self.page.wait_for_timeout(wait)
        frame = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        x, y = self.page.evaluate("window.pointer ?? [620, 500]")
        ImageDraw.Draw(frame).polygon([(x + u, y + v) for u, v in POINTER], fill="black", outline="white")
        self.frames.append((frame.resize(SHOWN, Image.Resampling.LANCZOS), stays))

    def save(self, place: Path) -> None:
        """Write all frames as one file."""
        (first, _), *others = self.frames
        stays = [stays for _, stays in self.frames]
        further = [frame for frame, _ in others]
        first.save(place, save_all=True, append_images=further, duration=stays, loop=0, quality=72, method=6)


def build(hand: Hand, film: Film) -> None:
    """Put the parts on the sheet, from the left to the right."""
    for kind, end, name, values in PARTS:
        hand.find(kind)
        hand.page.locator(f'.entry[data-kind="{kind}"]').click()
        film.take(500)
        if end:
            hand.page.mouse.move(*hand.end(end))
            film.take(500)
            hand.page.mouse.click(*hand.end(end))
        else:
            hand.page.locator("#sheet").click(position={"x": 300, "y": 110})
        hand.wait()
        hand.rename(name)
        for key, value in values.items():
            hand.type(f"{name}.{key}", value)
        film.take(900)


def run(hand: Hand, film: Film) -> None:
    """Let it run, change a value, insert a part, and look at an instant."""
    hand.page.fill("#search", "")
    hand.select("")
    hand.type("simulate.start", "rest")
    hand.until("results.run")
    for name in ("rotor.w", "table.w"):
        hand.browser.run(f"results.shown.includes('{name}') || toggleCurve('{name}')")
        hand.wait()
    hand.type("simulate.until", "2 s")
    film.take(1500, 400)
    hand.select("shaft")
    hand.type("shaft.c", "400 N.m/rad")
    film.take(1800, 400)
    hand.find("Damper")
    hand.page.locator('.entry[data-kind="Damper"]').click()
    hand.page.mouse.move(*hand.end("table.flange_b"))
    film.take(700)
    hand.page.mouse.click(*hand.end("table.flange_b"))
    hand.wait()
    if hand.page.get_by_role("button", name="Put it on the sheet").count():
        hand.type("damper.d", "0.5 N.m.s/rad")
        hand.page.get_by_role("button", name="Put it on the sheet").click()
    else:
        hand.type("damper.d", "0.5 N.m.s/rad")
    film.take(900, 300)
    hand.find("Fixed")
    hand.page.locator('.entry[data-kind="Fixed"]').click()
    hand.page.mouse.click(*hand.end("damper.flange_b"))
    hand.wait()
    hand.page.fill("#search", "")
    film.take(1800, 500)
    box = hand.page.locator("#curves svg").first.bounding_box()
    assert box
    for share in (0.2, 0.5, 0.8):
        hand.page.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
        hand.wait()
        film.take(900, 300)


def main() -> None:
    """Film it."""
    with tempfile.TemporaryDirectory() as folder, PageServer(Session(Path(folder) / "drive.toml")) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with sync_playwright() as playwright:
            chromium = playwright.chromium.launch(executable_path=program(), args=["--no-sandbox", "--hide-scrollbars"])
            page = chromium.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
            page.goto(server.address)
            page.wait_for_function(READY)
            page.evaluate(WATCH)
            hand, film = Hand(Browser(page)), Film(page)
            hand.wait()
            film.take(1200)
            build(hand, film)
            run(hand, film)
            text = hand.text
            chromium.close()
        film.save(TARGET)
        server.shutdown()
    if text not in (HERE.parent / "tutorial.md").read_text(encoding="utf-8"):
        raise SystemExit(f"The tutorial has another drive than the film:\n{text}")


if __name__ == "__main__":
    main()
