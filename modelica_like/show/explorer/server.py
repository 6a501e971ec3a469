"""A page on the loopback interface that runs a drive here, in this process."""

from __future__ import annotations

import contextlib
import io
import json
import secrets
import socket
import sys
import tempfile
import threading
import time
import webbrowser
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, ClassVar
from urllib.parse import parse_qs

import numpy as np

from modelica_like.arguments import checked
from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Assembly
from modelica_like.netlist import load
from modelica_like.show.browser.page import page, page_content
from modelica_like.show.draw import schematic
from modelica_like.show.explorer.runs import FILES, Runs, number
from modelica_like.show.plot import for_page
from modelica_like.simulation import build, seconds, simulate
from modelica_like.writing import write_text

_LARGEST = 1_000_000
"""Bytes of a request."""
_PATIENCE = 5.0
"""Seconds for a request to arrive, for its answer to leave, for a free place; on one machine they take milliseconds."""
_PLACES = 16
"""Connections at once; a browser opens six for a page."""
_WRONG = (ArithmeticError, KeyError, RecursionError, TypeError, ValueError)
"""What a request that is no JSON, or has other content than expected, ends in."""


@checked
def explore(
    drive: Assembly | str | Path, until: float | str | None = None, *, show: Sequence[str] = (),
    folder: str | Path = ".",
) -> None:  # fmt: skip
    """Show a drive in the browser, with sliders for its parameters, until Ctrl-C.

    Args:
        drive: an assembly or a netlist file.
        until: end time, a number in s or a quantity; by default that of the netlist.
        show: names, patterns or formulas of the first curves; by default speeds, torques and forces of the parts, or
            what a circuit has.
        folder: for netlists, FMUs and reports saved by the page.

    Raises:
        UnknownName: nothing matches a pattern.
        ModelicaLikeError: the drive has an error, or cannot be simulated.
    """
    with Explorer(drive, until, show=show, folder=folder) as explorer:
        explorer.show()


class Explorer(ThreadingHTTPServer):
    """Serves the page of one drive to this machine only.

    Args:
        drive, until, show, folder: as of `explore`.

    Raises:
        ModelicaLikeError: as `explore`.

    Attributes:
        address: of the page, with a secret that every request needs.
    """

    daemon_threads = True
    request_queue_size = 64

    def __init__(
        self, drive: Assembly | str | Path, until: float | str | None = None, *, show: Sequence[str] = (),
        folder: str | Path = ".",
    ) -> None:  # fmt: skip
        assembly = drive if isinstance(drive, Assembly) else load(drive)
        model = build(assembly)
        end = until if until is not None else model.settings.get("until")
        run = simulate(model, end)
        self.runs, self.folder, self.token = Runs(assembly, model, run.options), Path(folder), secrets.token_urlsafe(16)
        content = page_content(model, for_page(run, show)[0], seconds(end), run.options) | {"token": self.token}
        self.page = page(
            model.name, str(assembly.description), content, Path(__file__).parent / "explore.js", connect="'self'",
            schematic=f'<div id="schematic">{schematic(assembly, background=False)}</div>', more=_BELOW,
        ).encode()  # fmt: skip
        self._places = threading.BoundedSemaphore(_PLACES)
        super().__init__(("127.0.0.1", 0), _Handler)
        self.address = f"http://{self.host}/?token={self.token}"

    def show(self, *, browser: bool = True) -> None:
        """Serve until Ctrl-C, the normal end.

        Args:
            browser: open the page.
        """
        with tempfile.TemporaryDirectory(prefix="modelica_like_") as private, contextlib.suppress(KeyboardInterrupt):
            if browser:
                # All users of the machine can read the command line of the browser, but not this file.
                way = Path(private) / "explore.html"
                write_text(way, f'<meta http-equiv="refresh" content="0;url={self.address}">')
                webbrowser.open(way.as_uri())
            self.serve_forever()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a thread, if there is a place for it."""
        if self._places.acquire(timeout=_PATIENCE):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer a connection, and leave its place."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that has left is no error."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)

    @property
    def host(self) -> str:
        """Name and port, as a browser names them."""
        return f"127.0.0.1:{self.server_address[1]}"


_BUTTONS = " ".join(f'<button value="{what}">{what}</button>' for what in FILES)
_BELOW = f"""
<div id="files">Save as {_BUTTONS} <span id="saved"></span></div>
<details id="bars"><summary>What decides the final value of <select aria-label="final value of"></select></summary>
<table></table></details>"""


class _Arriving(socket.SocketIO):
    """What a connection sends until a time."""

    def __init__(self, connection: socket.socket, end: float) -> None:
        super().__init__(connection, "r")
        self._connection, self._end = connection, end

    def readinto(self, b: Any) -> int | None:
        self._connection.settimeout(max(self._end - time.monotonic(), 1e-3))
        return super().readinto(b)


class _Handler(BaseHTTPRequestHandler):
    """Answers one request, and closes the connection, so that none waits for a next one in a place."""

    server: Explorer  # pyright: ignore[reportIncompatibleVariableOverride]
    timeout = _PATIENCE
    disable_nagle_algorithm = True
    _kinds: ClassVar = {"/run": "_run", "/ranking": "_ranking", "/save": "_save"}

    def setup(self) -> None:
        super().setup()
        self.rfile = io.BufferedReader(_Arriving(self.connection, time.monotonic() + _PATIENCE))

    def do_GET(self) -> None:
        # Not by urlsplit, which refuses some addresses with an error.
        path, _, query = self.path.partition("?")
        if not self._known(parse_qs(query).get("token", [""])[0]):
            return
        if path == "/":
            self._answer(HTTPStatus.OK, self.server.page, "text/html; charset=utf-8")
        else:
            self._answer(HTTPStatus.NOT_FOUND, b"There is nothing here.")

    def do_POST(self) -> None:
        size = self.headers.get("Content-Length", "")[:9]  # more digits are too many, and no number for Python
        if not self._known(self.headers.get("X-Token", "")):
            return
        if self.path not in self._kinds or not size.isdecimal() or int(size) > _LARGEST:
            self._answer(HTTPStatus.NOT_FOUND, b"There is nothing here.")
            return
        body = self.rfile.read(int(size))
        self.connection.settimeout(_PATIENCE)
        try:
            getattr(self, self._kinds[self.path])(json.loads(body))
        except ModelicaLikeError as error:
            # Told in the page, with an answer that browsers do not report as a failure.
            message = " ".join(filter(None, (error.what, error.why, error.advice)))
            self._answer(HTTPStatus.OK, message.encode(), refused=True)
        except _WRONG as error:
            self._answer(HTTPStatus.BAD_REQUEST, f"The request is wrong: {error!r}.".encode())

    def _known(self, token: str) -> bool:
        """Another site can neither name this host nor know the token."""
        right = secrets.compare_digest(token.encode(), self.server.token.encode())
        if right and self.headers.get("Host") == self.server.host:
            return True
        self._answer(HTTPStatus.FORBIDDEN, b"Open the address that the command has printed.")
        return False

    def _waits(self) -> bool:
        """Tell whether the browser still waits: a page that wants another run closes the connection."""
        self.connection.setblocking(False)
        try:
            return self.connection.recv(1, socket.MSG_PEEK) != b""
        except BlockingIOError:
            return True
        except OSError:
            return False
        finally:
            self.connection.settimeout(_PATIENCE)

    def _run(self, request: Mapping[str, Any]) -> None:
        runs = self.server.runs
        result = runs.run(runs.values(request), runs.outputs(request), number(request["until"]), self._waits)
        if result is None:
            return
        about, arrays = result
        head = json.dumps(about | {"sizes": [array.size for array in arrays]}).encode()
        head += b" " * (-len(head) % 8)
        parts = [np.array([len(head)], "<i8"), *(np.asarray(array, "<f8") for array in arrays)]
        self._answer(HTTPStatus.OK, b"".join((parts[0].tobytes(), head, *(part.tobytes() for part in parts[1:]))))

    def _ranking(self, request: Mapping[str, Any]) -> None:
        rows = self.server.runs.ranking(
            self.server.runs.values(request), number(request["until"]), str(request["output"])
        )
        self._answer(HTTPStatus.OK, json.dumps(rows).encode(), "application/json")

    def _save(self, request: Mapping[str, Any]) -> None:
        runs, what, until = self.server.runs, str(request["what"]), number(request["until"])
        try:
            said, refused = str(runs.save(what, runs.values(request), until, self.server.folder)), False
        except OSError as error:
            said, refused = str(error), True
        self._answer(HTTPStatus.OK, said.encode(), refused=refused)

    def _answer(
        self, code: HTTPStatus, body: bytes, kind: str = "application/octet-stream", *, refused: bool = False
    ) -> None:
        self.send_response(code)
        for name, value in (
            ("Content-Type", kind), ("Content-Length", str(len(body))), ("Cache-Control", "no-store"),
            ("X-Content-Type-Options", "nosniff"), ("Referrer-Policy", "no-referrer"),
            ("Content-Security-Policy", "frame-ancestors 'none'"),
            *([("X-Refused", "yes")] if refused else []),
        ):  # fmt: skip
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are not worth a line."""
