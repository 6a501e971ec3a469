"""Chromium or one of its family, driven by Playwright: the browser of the system, none is downloaded."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hand import Hand, using
from pages import serving
from playwright.sync_api import Page, sync_playwright

from modelica_like.page import PageServer, Session

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
_MISSING = "No browser was found: install Chromium (make browser), or name one by $BROWSER_FOR_TESTS."
_FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars")
_READY = """() => document.getElementById('status')?.textContent || document.getElementById('said')?.textContent
  || document.documentElement?.dataset.ready"""


class Browser:
    """One page of a browser.

    Attributes:
        page: as Playwright has it.
        complaints: what was written to the console, exceptions that nobody caught, and what was asked for from outside.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.complaints: list[str] = []
        page.on("console", lambda message: self.complaints.append(message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self._asked(request.url))

    def _asked(self, address: str) -> None:
        if not address.startswith(("file:", "data:", "blob:")):
            self.complaints.append(address)

    def open(self, page: Path | str, width: int = 1200, height: int = 900, *, ready: str = _READY) -> None:
        """Open a file or an address, and wait until the first curves are drawn."""
        self.resize(width, height)
        self.complaints.clear()
        self.page.goto(page if isinstance(page, str) else page.as_uri())
        self.page.wait_for_function(ready)

    def resize(self, width: int, height: int) -> None:
        """Give the page another size."""
        self.page.set_viewport_size({"width": width, "height": height})

    def run(self, script: str) -> Any:
        """Evaluate an expression in the page, and wait for what it promises."""
        return self.page.evaluate(script)

    def picture(self, path: Path) -> None:
        """Write what is seen as a PNG file."""
        self.page.screenshot(path=path)


def program() -> str:
    named = os.environ.get("BROWSER_FOR_TESTS")
    return named or next((found for name in _NAMES if (found := shutil.which(name))), "")


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """The program. Without one, tests are skipped; but not in continuous integration, which must have one."""
    path = program()
    if not path:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(_MISSING)
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=path, args=[*_FLAGS])
        yield launched
        launched.close()


@pytest.fixture
def browser(chromium: Any) -> Iterator[Browser]:
    """A page with a profile of its own."""
    context = chromium.new_context()
    yield Browser(context.new_page())
    context.close()


@pytest.fixture
def server(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[PageServer]:
    """Serve the netlist that a module has as `TEXT`, with the files of its `OTHERS` beside it."""
    for name, text in {"drive.toml": request.module.TEXT, **getattr(request.module, "OTHERS", {})}.items():
        (tmp_path / name).write_text(text)
    with serving(Session(tmp_path / "drive.toml", folder=tmp_path)) as served:
        yield served


@pytest.fixture
def hand(browser: Any, server: PageServer) -> Iterator[Hand]:
    with using(browser, server) as hand:
        yield hand
