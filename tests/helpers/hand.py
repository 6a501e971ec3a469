"""A hand at the page: it moves a mouse and types, as a user does."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

READY = "() => document.querySelector('#trail h1')"
"""The page has its netlist."""


@contextmanager
def using(browser: Any, server: Any) -> Iterator[Hand]:
    """Open the page of a server; nothing must be written to the console, and nothing asked for elsewhere."""
    browser.open(server.address, 1400, 900, ready=READY)
    hand = Hand(browser)
    hand.wait()
    yield hand
    assert [one for one in browser.complaints if not one.startswith(server.address[:20])] == []


class Hand:
    """Works on the page of a browser that has it open.

    Args:
        browser: as the fixture gives it.
    """

    def __init__(self, browser: Any) -> None:
        self.browser, self.page = browser, browser.page

    def wait(self) -> None:
        """Wait until all that was asked for has been answered and drawn."""
        frames = "new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))"
        for _ in range(2):  # an answer may ask for more
            self.browser.run(f"queue.then(() => {frames})")
            self.until("asking === 0")

    def until(self, expression: str) -> None:
        """Wait until an expression is true; the policy of the page forbids that Playwright evaluates text there."""
        self.browser.run(
            f"""new Promise((go, fail) => {{ const begin = Date.now(), look = () => {expression} ? go(1)
            : Date.now() - begin > 20000 ? fail(Error("never")) : setTimeout(look, 10); look(); }})"""
        )

    @property
    def text(self) -> str:
        """The netlist, as the page has it."""
        self.wait()
        return self.browser.run("page.text")

    @property
    def said(self) -> str:
        """What stands below the picture."""
        return self.page.inner_text("#said")

    def middle(self, selector: str) -> tuple[float, float]:
        """Return where the middle of an element is, in sight."""
        self.page.wait_for_selector(selector, state="attached")
        x, y = self.page.evaluate(
            """(selector) => { const one = document.querySelector(selector);
            one.scrollIntoView({ block: "nearest", inline: "nearest" });
            const box = one.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }""",
            selector,
        )
        return x, y

    def end(self, path: str) -> tuple[float, float]:
        """Return where an end is."""
        return self.middle(f'.end[data-end="{path}"]')

    def find(self, kind: str) -> None:
        """Find a type by typing."""
        self.page.fill("#search", kind.lower())
        self.page.locator(f'.entry[data-kind="{kind}"]').wait_for()

    def put(self, kind: str, *, end: str = "", line: str = "") -> None:
        """Click a type, and then the sheet, an end or a line."""
        self.find(kind)
        self.page.locator(f'.entry[data-kind="{kind}"]').click()
        if end:
            self.page.mouse.click(*self.end(end))
        elif line:  # a straight one
            self.page.mouse.click(*self.middle(f'.wire[data-ends="{line}"]'))
        else:
            self.page.locator("#sheet").click(position={"x": 8, "y": 8})
        self.wait()

    def drag(self, first: str, second: str) -> None:
        """Drag from an end to another."""
        for path in (first, second):
            self.show(path)
        self.page.mouse.move(*self.end(first))
        self.page.mouse.down()
        x, y = self.end(second)
        self.page.mouse.move(x - 20, y - 20, steps=3)
        self.until("joining && Object.keys(joining.fits).length")
        self.page.mouse.move(x, y, steps=2)
        self.page.mouse.up()
        self.wait()

    def show(self, end: str) -> None:
        """Select the part of an end that is seen only then."""
        if self.page.locator(f'.end.optional[data-end="{end}"]').count():
            self.select(end.rpartition(".")[0])

    def select(self, name: str) -> None:
        """Click a part, or the sheet."""
        if name:
            place = f"""(() => {{ const part = document.querySelector('.part[data-part="{name}"]');
            part.scrollIntoView({{ block: "nearest", inline: "nearest" }});
            const at = new DOMPoint(0, 0).matrixTransform(part.getScreenCTM()); return [at.x, at.y]; }})()"""
            self.page.mouse.click(*self.browser.run(place))
        else:
            self.page.locator("#sheet").click(position={"x": 8, "y": 8})
        self.wait()

    def write(self, text: str) -> None:
        """Type another text."""
        self.page.fill("#text", text)
        self.page.locator("#text").blur()
        self.wait()

    def rename(self, name: str) -> None:
        """Give the selected part another name."""
        field = self.page.locator("#inspector .name")
        field.fill(name)
        field.press("Enter")
        self.wait()
        self.until(f"page.selected.has({name!r})")
        self.until(f"document.querySelector('#inspector .name')?.value === {name!r}")

    def unfold(self, path: str) -> None:
        """Open what a field is folded into."""
        inside = self.page.locator(f'#inspector [data-inside="{path.rpartition(".")[0]}"]')
        if inside.count() and not self.page.locator(f'#inspector [data-path="{path}"]').count():
            inside.evaluate("(one) => { one.open = true; }")
        self.page.wait_for_selector(f'#inspector [data-path="{path}"]', state="attached")
        opened = "(one) => { const box = one.closest('details'); if (box) box.open = true; }"
        self.page.locator(f'#inspector [data-path="{path}"]').evaluate(opened)

    def type(self, path: str, value: Any) -> None:
        """Type a value into its field; a table into its grid."""
        self.unfold(path)
        field = self.page.locator(f'#inspector [data-path="{path}"]')
        kind = field.evaluate("(one) => one.tagName")
        text = str(value).lower() if isinstance(value, bool) else str(value)
        if kind == "BUTTON":
            self.fill_table(path, value)
        elif kind == "SELECT":
            field.select_option(text)
        else:
            field.fill(text)
            field.press("Enter")
        self.wait()

    def fill_table(self, path: str, rows: Any) -> None:
        """Paste rows into the grid of a table, as from a spreadsheet."""
        self.page.locator(f'#inspector [data-path="{path}"]').click()
        rows = rows if isinstance(rows[0], list) else [[one] for one in rows]
        widest = max(map(len, rows))
        while self.page.locator("#dialog tbody tr").first.locator("input").count() < widest:
            self.page.get_by_role("button", name="Another column").click()
        for k, row in enumerate(rows):
            for j, cell in enumerate(row):
                self.page.locator("#dialog tbody tr").nth(k).locator("input").nth(j).fill(str(cell))
        self.page.locator("#dialog button.main").click()
        self.until("!document.getElementById('dialog').open")
        self.wait()

    def parameter(self, name: str, value: Any) -> None:
        """Add a parameter of the drive."""
        self.page.get_by_role("button", name="Add a parameter").click()
        self.page.fill("#dialog input[name=name]", name)
        self.page.fill("#dialog input[name=value]", str(value))
        self.page.locator("#dialog button.main").click()
        self.wait()
