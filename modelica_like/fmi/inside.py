"""Common code inside the processes that run foreign FMUs.

A folder contains `job.json` and unpacked FMUs. Results are written there: `result.npy` and `meta.json`, or
`error.json`; `progress` holds the time reached and the number of the FMU that was called last. The process starts fast:
nothing else of the package is imported here.
"""

from __future__ import annotations

import json
import mmap
import os
import struct
import sys
import threading
from pathlib import Path
from types import TracebackType
from typing import Any

REAL = ("Real", "Float32", "Float64")
WHOLE = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
DISCRETE = ("Integer", "Enumeration", "Boolean", *WHOLE)
PLACE = struct.Struct("dq")
"""What `progress` holds."""
_MESSAGES = 20
MEMORY = "MODELICA_LIKE_FMU_MEMORY"
"""Environment variable with the most memory that the process may take, in MB."""
_MEMORY = 8000


class Refused(Exception):
    """A request cannot be done; `detail` is the reason, for the process that asked."""

    def __init__(self, **detail: Any) -> None:
        super().__init__(str(detail))
        self.detail = detail


class Job:
    """The job of a folder, and the FMU that is running.

    Attributes:
        asked: content of `job.json`.
        messages: the last ones of each FMU by its name.
        unit: name of the FMU that was called last.
    """

    def __init__(self, folder: Path) -> None:
        threading.Thread(target=_end_with_parent, daemon=True).start()
        # What is allocated, not addresses: run-times of other languages reserve hundreds of gigabytes of those.
        if sys.platform == "linux":
            import resource

            most = int(os.environ.get(MEMORY) or _MEMORY)
            resource.setrlimit(resource.RLIMIT_DATA, (most * 10**6, resource.RLIM_INFINITY))
        self.folder = folder
        self.messages: dict[str, list[str]] = {}
        self.unit = ""
        sys.excepthook = self._report
        self.asked: dict[str, Any] = json.loads((folder / "job.json").read_text())
        with (folder / "progress").open("r+b") as file:
            self._place = mmap.mmap(file.fileno(), PLACE.size)

    def reach(self, time: float) -> None:
        """Write the time reached."""
        self._place[:8] = struct.pack("d", time)

    def call(self, number: int, unit: str) -> None:
        """Write which FMU is called now."""
        self.unit = unit
        self._place[8:] = struct.pack("q", number)

    def hear(self, *arguments: Any) -> None:
        """Keep a message, the last of the arguments, of the FMU that was called last: FMPy has one logger for all."""
        text, heard = arguments[-1], self.messages.setdefault(self.unit, [])
        heard.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))
        del heard[:-_MESSAGES]

    def leave(self, meta: dict[str, Any], name: str = "meta.json") -> Path:
        """Write a result, completely or not at all; `meta.json` ends the job."""
        (self.folder / "draft").write_text(json.dumps(meta))
        return (self.folder / "draft").rename(self.folder / name)

    def _report(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        messages = self.messages.get(self.unit, [])
        failed = {"kind": "failed", "unit": self.unit, "text": str(error) or kind.__name__, "messages": messages}
        detail = error.detail if isinstance(error, Refused) else failed
        (self.folder / "error.json").write_text(json.dumps(detail))


def _end_with_parent() -> None:
    """End where the process that asked has ended, killed perhaps: then this end of the pipe is closed."""
    while os.read(0, 1):  # unbuffered: the lock of a buffer would abort the process at its end
        pass
    os._exit(1)


def savings(fmu: Any, version: str) -> tuple[Any, Any, Any]:
    """Return the functions of an FMU that save, restore and free a state."""
    name = "FMUstate" if version == "2.0" else "FMUState"
    save, load, free = (getattr(fmu, f"{verb}{name}") for verb in ("get", "set", "free"))
    return save, load, free


def about(variable: Any) -> dict[str, Any]:
    """Return the attributes of a variable, by the names of `RecordedVariable`."""
    declared = variable.declaredType
    return {
        "path": variable.name,
        "unit": variable.unit or getattr(declared, "unit", None) or "1",
        "description": variable.description or "",
        "kind": "discrete" if variable.type in DISCRETE else variable.causality or "local",
        "names": [(int(item.value), item.name) for item in getattr(declared, "items", None) or ()],
    }
