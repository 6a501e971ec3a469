"""A page on the loopback interface: a drive is built, changed and run there, in this process."""

from __future__ import annotations

import contextlib
import io
import json
import re
import secrets
import socket
import sys
import tempfile
import threading
import time
import webbrowser
from collections.abc import Mapping, Sequence
from html import escape
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
from modelica_like.page.files import FILES
from modelica_like.page.runs import number
from modelica_like.page.session import Session
from modelica_like.show.browser.page import CURVES, HELPERS, joined_scripts, script_hash
from modelica_like.writing import write_text

_LARGEST = 2_000_000
"""Bytes of a request: the text of a netlist is in some."""
_PATIENCE = 5.0
"""Seconds for a request to arrive, for its answer to leave, for a free place; on one machine they take milliseconds."""
_PLACES = 16
"""Connections at once; a browser opens six for a page."""
_WRONG = (ArithmeticError, AttributeError, KeyError, RecursionError, TypeError, ValueError)
"""What a request that is no JSON, or has other content than expected, ends in."""
_HERE = Path(__file__).parent
_SCRIPTS = (
    "core",
    "picture",
    "hand",
    "palette",
    "inspector",
    "table",
    "text",
    "results",
    "runs",
    "fitting",
    "files",
    "start",
)
"""The scripts of the page, in their order."""


@checked
def explore(
    drive: Assembly | str | Path, until: float | str | None = None, *, show: Sequence[str] = (),
    folder: str | Path = ".",
) -> None:  # fmt: skip
    """Show a drive in the browser, with its parameters and curves, until Ctrl-C.

    Args:
        drive: an assembly or a netlist file.
        until: end time, a number in s or a quantity; by default that of the netlist.
        show: names, patterns or formulas of the first curves; by default speeds, torques and forces of the parts, or
            what a circuit has.
        folder: for netlists, FMUs and reports saved by the page.

    Raises:
        ModelicaLikeError: the drive has an error.
    """
    assembly = drive if isinstance(drive, Assembly) else load(drive)
    with PageServer(Session(assembly, until, show=show, folder=Path(folder)), folded=True) as server:
        server.show()


class PageServer(ThreadingHTTPServer):
    """Serves the page of a session to this machine only.

    Args:
        session: what is shown.
        folded: whether the text of the netlist is folded away at first.

    Attributes:
        address: of the page, with a secret that every request needs.
    """

    daemon_threads = True
    request_queue_size = 64

    def __init__(self, session: Session, *, folded: bool = False) -> None:
        self.session, self.token = session, secrets.token_urlsafe(16)
        self.page = _page(session.desk.path.name, {"token": self.token, "folded": folded, "files": [*FILES]}).encode()
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
                way = Path(private) / "page.html"
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


def _page(name: str, content: Mapping[str, Any]) -> str:
    """Return the page: its own script is the only one that runs there."""
    script = joined_scripts(HELPERS, CURVES, *(_HERE / f"{name}.js" for name in _SCRIPTS))
    parts = {
        "name": escape(name), "style": (_HERE / "page.css").read_text(encoding="utf-8"), "script": script,
        "hash": script_hash(script), "content": json.dumps(content).replace("<", "\\u003c"),
    }  # fmt: skip
    text = (_HERE / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], text)


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

    server: PageServer  # pyright: ignore[reportIncompatibleVariableOverride]
    timeout = _PATIENCE
    disable_nagle_algorithm = True
    _asked: ClassVar = frozenset((
        "state", "apply", "text", "undo", "redo", "model", "ranking", "starts", "instant", "palette", "kind", "page",
        "fits", "copy", "complete", "explain", "scale", "save", "export", "watch", "take", "trust", "open", "back",
        "progress",
    ))  # fmt: skip
    """Methods of `Session` that a page may call."""
    _awaited: ClassVar = frozenset(("calibrate", "optimize"))
    """Those that end when nobody waits for them any more."""

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
        what = self.path[1:]
        if what not in (*self._asked, *self._awaited, "run") or not size.isdecimal() or int(size) > _LARGEST:
            self._answer(HTTPStatus.NOT_FOUND, b"There is nothing here.")
            return
        body = self.rfile.read(int(size))
        self.connection.settimeout(_PATIENCE)
        try:
            request = json.loads(body)
            if what == "run":
                self._run(request)
                return
            awaited = (self._waits,) if what in self._awaited else ()
            answer = getattr(self.server.session, what)(request, *awaited)
            self._answer(HTTPStatus.OK, json.dumps(answer, default=str).encode(), "application/json")
        except ModelicaLikeError as error:
            # Told in the page, with an answer that browsers do not report as a failure.
            message = " ".join(filter(None, (error.what, error.why, error.advice)))
            self._answer(HTTPStatus.OK, message.encode(), refused=True)
        except _WRONG as error:
            self._answer(HTTPStatus.BAD_REQUEST, f"The request is wrong: {error!r}.".encode())
        except OSError as error:
            self._answer(HTTPStatus.OK, f"{error.filename}: {error.strerror}.".encode(), refused=True)

    def _known(self, token: str) -> bool:
        """Another site can neither name this host nor know the token, and says where it comes from."""
        right = secrets.compare_digest(token.encode(), self.server.token.encode())
        origin = self.headers.get("Origin") in (None, f"http://{self.server.host}")
        if right and origin and self.headers.get("Host") == self.server.host:
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
        runs = self.server.session.runs(request)
        result = runs.run(runs.values(request), runs.outputs(request), number(request["until"]), self._waits)
        if result is None:
            return
        about, arrays = result
        head = json.dumps(about | {"sizes": [array.size for array in arrays]}).encode()
        head += b" " * (-len(head) % 8)
        parts = [np.array([len(head)], "<i8"), *(np.asarray(array, "<f8") for array in arrays)]
        self._answer(HTTPStatus.OK, b"".join((parts[0].tobytes(), head, *(part.tobytes() for part in parts[1:]))))

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
