"""A headless browser of the Chromium family, told what to do through its debugging pipe."""

import base64
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
_MISSING = "No browser was found: install Chromium (make browser), or name one by $BROWSER_FOR_TESTS."
# Chromium reads file 3 and writes file 4; either number may be taken where this begins.
_LAUNCH = """
import os, sys
from fcntl import F_DUPFD, fcntl
for place, file in enumerate([fcntl(int(one), F_DUPFD, 10) for one in sys.argv[1:3]], 3):
    os.dup2(file, place)
os.execvp(sys.argv[3], sys.argv[3:])
"""
_FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars", "--no-first-run",
    "--remote-debugging-pipe", "--disable-background-networking",
)  # fmt: skip


class Browser:
    """One page of a browser.

    Attributes:
        complaints: what was written to the console, exceptions that nobody caught, and what was asked for from outside.
    """

    def __init__(self, program: str, folder: Path) -> None:
        theirs, self._send = os.pipe()
        self._receive, answers = os.pipe()
        launch = [sys.executable, "-c", _LAUNCH, str(theirs), str(answers)]
        self._process = subprocess.Popen(
            [*launch, program, *_FLAGS, f"--user-data-dir={folder}"],
            pass_fds=(theirs, answers), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(theirs)
        os.close(answers)
        self._rest, self._number, self._session = b"", 0, ""
        self.complaints: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol; what happens meanwhile is noted."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        message |= {"sessionId": self._session} if self._session else {}
        os.write(self._send, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._number:
                assert "error" not in answer, answer["error"]
                return answer["result"]
            self._note(answer)

    def open(self, page: Path | str, width: int = 1200, height: int = 900) -> None:
        """Open a file or an address, and wait until the first curves are drawn."""
        self.resize(width, height)
        self.complaints.clear()
        self.call("Page.navigate", url=page if isinstance(page, str) else page.as_uri())
        self.run("new Promise((go) => { const look = () => "
                 "(document.getElementById('status')?.textContent || document.getElementById('said')?.textContent "
                 "|| document.documentElement?.dataset.ready) "
                 "? go(1) : setTimeout(look, 10); look(); })")  # fmt: skip

    def resize(self, width: int, height: int) -> None:
        """Give the page another size."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600
        )

    def run(self, script: str) -> Any:
        """Evaluate an expression in the page, and wait for what it promises."""
        found = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def picture(self, path: Path) -> None:
        """Write what is seen as a PNG file."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def close(self) -> None:
        """End the browser."""
        self._process.terminate()
        self._process.wait(timeout=20)
        os.close(self._send)
        os.close(self._receive)

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            more = os.read(self._receive, 1 << 20)
            assert more, "The browser has ended."
            self._rest += more
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)

    def _note(self, event: dict[str, Any]) -> None:
        kind, about = event.get("method", ""), event.get("params", {})
        asked = about.get("request", {}).get("url", "") if kind == "Network.requestWillBeSent" else ""
        if kind in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"):
            self.complaints.append(json.dumps(about))
        elif asked and not asked.startswith(("file:", "data:")):
            self.complaints.append(asked)


def _program() -> str:
    named = os.environ.get("BROWSER_FOR_TESTS")
    return named or next((found for name in _NAMES if (found := shutil.which(name))), "")


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser. Without one, tests are skipped; but not in continuous integration, which must have one."""
    program = _program()
    if not program:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(_MISSING)
    made = Browser(program, tmp_path_factory.mktemp("browser"))
    yield made
    made.close()
