"""A client of the language server: the protocol over pipes, as an editor speaks it."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any, BinaryIO

_LONGEST = 60.0
"""Seconds for an answer: the first check of a process loads CasADi, also on a machine with other work."""


class Client:
    """Starts `modelica-like lsp`, and talks to it.

    Args:
        encodings: of positions that the client knows.
        environment: of the server, beside that of this process.
        words: of the command line, behind `lsp`.
    """

    def __init__(self, *encodings: str, environment: dict[str, str] | None = None, words: tuple[str, ...] = ()) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "modelica_like", "lsp", *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, env={**os.environ, **(environment or {})},
        )  # fmt: skip
        assert self.process.stdin
        assert self.process.stdout
        self.to_server, self.number = self.process.stdin, 0
        self.received: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self.reader = threading.Thread(target=self._read, args=(self.process.stdout,), daemon=True)
        self.reader.start()
        general = {"positionEncodings": list(encodings)} if encodings else {}
        asked = {"processId": None, "rootUri": None, "capabilities": {"general": general}}
        self.capabilities = self.ask("initialize", asked)["capabilities"]
        self.tell("initialized", {})

    def _read(self, stream: BinaryIO) -> None:
        while header := stream.readline():
            length = 0
            while header.strip():
                name, _, value = header.partition(b":")
                length = int(value) if name.lower() == b"content-length" else length
                header = stream.readline()
            self.received.put(json.loads(stream.read(length)))
        self.received.put(None)

    def _send(self, message: dict[str, Any]) -> None:
        data = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.to_server.write(b"Content-Length: %d\r\n\r\n%s" % (len(data), data))
        self.to_server.flush()

    def tell(self, method: str, params: dict[str, Any]) -> None:
        """Send a notification."""
        self._send({"method": method, "params": params})

    def answer(self, method: str, params: dict[str, Any] | None) -> dict[str, Any]:
        """Ask, and return the whole answer."""
        self.number += 1
        self._send({"id": self.number, "method": method, "params": params})
        while (message := self.received.get(timeout=_LONGEST)) is not None:
            if message.get("id") == self.number:
                return message
        raise EOFError

    def ask(self, method: str, params: dict[str, Any] | None) -> Any:
        """Ask, and return the result."""
        answer = self.answer(method, params)
        assert "error" not in answer, answer
        return answer["result"]

    def notified(self, method: str) -> dict[str, Any]:
        """Wait for a notification."""
        while (message := self.received.get(timeout=_LONGEST)) is not None:
            if message.get("method") == method:
                return message["params"]
        raise EOFError

    def open(self, file: Path, text: str) -> list[dict[str, Any]]:
        """Open a file, and return its diagnostics."""
        document = {"uri": file.as_uri(), "languageId": "toml", "version": 1, "text": text}
        self.tell("textDocument/didOpen", {"textDocument": document})
        return self.notified("textDocument/publishDiagnostics")["diagnostics"]

    def change(self, file: Path, text: str, version: int) -> None:
        """Change a file."""
        document = {"uri": file.as_uri(), "version": version}
        self.tell("textDocument/didChange", {"textDocument": document, "contentChanges": [{"text": text}]})

    def at(self, method: str, file: Path, line: int, character: int, **others: Any) -> Any:
        """Ask about a place, counted from zero."""
        place = {"textDocument": {"uri": file.as_uri()}, "position": {"line": line, "character": character}}
        return self.ask(f"textDocument/{method}", place | others)

    def close(self) -> int:
        """End the server, and return its exit code."""
        self.ask("shutdown", None)
        self.tell("exit", {})
        code = self.process.wait(_LONGEST)
        self.reader.join()
        for stream in (self.process.stdin, self.process.stdout):
            if stream:
                stream.close()
        return code
