"""Foreign code in a separate process, which protects this one."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from math import isnan, nan
from pathlib import Path
from typing import Any

from modelica_like.errors import FmuCrashed, FmuTimeout
from modelica_like.fmi.inside import PLACE
from modelica_like.fmi.unpack import unpack

_PACKAGES = Path(__file__).parents[2]


@contextlib.contextmanager
def workplace(job: Mapping[str, Any], fmus: Sequence[Path] = ()) -> Iterator[Path]:
    """Yield a folder with a job and unpacked FMUs (`0`, `1`, …), for `inside.py`.

    Raises:
        FmuRefused: a file is not an FMU, or is unsafe to unpack.
        OSError: a file cannot be read.
    """
    with tempfile.TemporaryDirectory(prefix="modelica_like_", ignore_cleanup_errors=True) as work:
        folder = Path(work)
        for k, fmu in enumerate(fmus):
            (folder / str(k)).mkdir()
            unpack(fmu, folder / str(k))
        (folder / "job.json").write_text(json.dumps(job))
        (folder / "progress").write_bytes(PLACE.pack(nan, 0))
        yield folder


def run_child(name: str, script: Path, folder: Path, timeout: float, environment: dict[str, str] | None = None) -> str:
    """Run a Python script on a workplace and wait for its end.

    Args:
        name: of the FMU for messages.
        script: the script.
        folder: its argument and working directory.
        timeout: time limit in s.
        environment: additional environment variables.

    Returns:
        How the process ended after it had done its job, if it crashed then; otherwise an empty text.

    Raises:
        FmuCrashed: the process ended before the script did.
        FmuTimeout: the time limit was reached; the process is ended.
    """
    paths = os.pathsep.join(filter(None, (str(_PACKAGES), os.environ.get("PYTHONPATH", ""))))
    # -P: do not import from the script's folder.
    command = [sys.executable, "-P", str(script), str(folder)]
    code = _wait(command, folder, timeout, {**os.environ, "PYTHONPATH": paths, **(environment or {})})
    if code is None:
        raise FmuTimeout(
            f"{name} did not finish within {timeout:g} s, and was stopped{_reached(folder)}.",
            advice="Give it more time with `timeout`, or a shorter run.",
        )
    if not any((folder / file).exists() for file in ("meta.json", "error.json")):
        raise FmuCrashed(f"{name} {_death(code)}{_reached(folder)}.", why="It ran in a separate process.")
    return _death(code) if code else ""


def _wait(command: Sequence[str], folder: Path, timeout: float, environment: dict[str, str]) -> int | None:
    """Return the exit code, or None at the time limit. Output of the FMU is discarded.

    The script may watch its standard input, which ends with this process.
    """
    pipe, quiet = subprocess.PIPE, subprocess.DEVNULL
    with subprocess.Popen(
        command, cwd=folder, stdin=pipe, stdout=quiet, stderr=quiet, env=environment, start_new_session=True
    ) as process:
        try:
            return process.wait(timeout)
        except subprocess.TimeoutExpired:
            return None
        finally:
            _end(process)
            process.wait()  # an interrupted `with` does not


def _end(process: subprocess.Popen[bytes]) -> None:
    """End the process and its children."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        if os.name == "posix":
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()


def _death(code: int) -> str:
    if code >= 0:
        return f"ended its process with exit code {code},"
    try:
        return f"crashed with {signal.Signals(-code).name}"
    except ValueError:
        return f"crashed with signal {-code}"


def _reached(folder: Path) -> str:
    (time,) = struct.unpack("d", (folder / "progress").read_bytes()[:8])
    return " before the end of its first step" if isnan(time) else f" after t = {time:g} s"
