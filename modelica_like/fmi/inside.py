"""What processes that run foreign FMUs have in common, seen from inside.

A folder holds `job.json` and unpacked FMUs. What came out is left there: `result.npy` and `meta.json`, or `error.json`;
`progress` holds the time reached and the number of the FMU that was called last. The process starts fast: nothing else
of the package is imported here.
"""

from __future__ import annotations

import json
import mmap
import struct
import sys
from pathlib import Path
from types import TracebackType
from typing import Any

REAL = ("Real", "Float32", "Float64")
WHOLE = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
DISCRETE = ("Integer", "Enumeration", "Boolean", *WHOLE)
PLACE = struct.Struct("dq")
"""What `progress` holds."""
_MESSAGES = 20


class Refused(Exception):
    """What was asked for cannot be done; `detail` says why, for the process that asked."""

    def __init__(self, **detail: Any) -> None:
        super().__init__(str(detail))
        self.detail = detail


class Messages(list[str]):
    """The last messages of an FMU; called by it."""

    def __call__(self, *arguments: Any) -> None:
        """Keep a message, the last of the arguments."""
        text = arguments[-1]
        self.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))
        del self[:-_MESSAGES]


class Job:
    """What is to be done in a folder, and who is at work.

    Attributes:
        asked: what `job.json` says.
        messages: of each FMU by its name.
        unit: name of the FMU that was called last.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.messages: dict[str, Messages] = {}
        self.unit = ""
        sys.excepthook = self._report
        self.asked: dict[str, Any] = json.loads((folder / "job.json").read_text())
        with (folder / "progress").open("r+b") as file:
            self._place = mmap.mmap(file.fileno(), PLACE.size)

    def reach(self, time: float) -> None:
        """Tell the time reached."""
        self._place[:8] = struct.pack("d", time)

    def call(self, number: int, unit: str) -> None:
        """Tell which FMU is called now."""
        self.unit = unit
        self._place[8:] = struct.pack("q", number)

    def leave(self, meta: dict[str, Any], name: str = "meta.json") -> Path:
        """Leave what is to be known, whole or not at all; `meta.json` is the end of the work."""
        (self.folder / "draft").write_text(json.dumps(meta))
        return (self.folder / "draft").rename(self.folder / name)

    def _report(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        messages = self.messages.get(self.unit, [])
        failed = {"kind": "failed", "unit": self.unit, "text": str(error) or kind.__name__, "messages": messages}
        detail = error.detail if isinstance(error, Refused) else failed
        (self.folder / "error.json").write_text(json.dumps(detail))


def savings(fmu: Any, version: str) -> tuple[Any, Any, Any]:
    """Return the functions of an FMU that save a state, go back to it, and give it back."""
    name = "FMUstate" if version == "2.0" else "FMUState"
    save, load, free = (getattr(fmu, f"{verb}{name}") for verb in ("get", "set", "free"))
    return save, load, free


def about(variable: Any) -> dict[str, Any]:
    """Return what is to be known about a variable, by the names of `RecordedVariable`."""
    declared = variable.declaredType
    return {
        "path": variable.name,
        "unit": variable.unit or getattr(declared, "unit", None) or "1",
        "description": variable.description or "",
        "kind": "discrete" if variable.type in DISCRETE else variable.causality or "local",
        "names": [(int(item.value), item.name) for item in getattr(declared, "items", None) or ()],
    }
