"""Tapes of a model as compiled code: written, compiled by this machine's compiler and stored once, then loaded."""

from __future__ import annotations

import ctypes
import hashlib
import os
import subprocess
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from modelica_like.errors import ExportError
from modelica_like.fmi.build import RUNTIMES, build, compiler_command, flags, native_platform
from modelica_like.fmi.runtime import cache_folder
from modelica_like.fmi.sources import own_sources
from modelica_like.fmi.straight import straight
from modelica_like.fmi.tables import Tables
from modelica_like.writing import write_bytes

_HEADERS = ("code.h", "operations.h", "rodas.h")
_MOST_BYTES = 200_000_000
"""All libraries together: some thousand models, as one has about 70 kB."""
_MOST_AGE = 90 * 86_400.0
"""Time in s since the last use: other versions of the run-time and of the compiler have left what is so old."""
_TOUCHED = 3600.0
"""Age in s from which on a use is noted: not at every start of many processes."""


def compiled_code(tables: Tables) -> tuple[Any, str]:
    """Return the library of a model's tapes and "", or None and a notice that says why there is none."""
    try:
        return ctypes.CDLL(str(_library(straight(tables)))), ""
    except (ExportError, OSError) as error:
        return None, f"The equations run as tapes, since they cannot be compiled. {error}"


def _library(text: str) -> Path:
    """Return the library of a text; it is compiled once for all models of the same structure.

    Its name has a checksum of the text, of the run-time that calls it, and of the compiler.
    """
    platform, sources = native_platform(), own_sources(())
    parts = text, sorted(sources.items()), flags(platform), _version(tuple(compiler_command(platform)))
    name = f"code-{hashlib.sha256(repr(parts).encode()).hexdigest()[:32]}"
    library = cache_folder() / platform / f"{name}{RUNTIMES[platform].suffix}"
    if not library.is_file():
        whole = f"#define CODE_ONLY\n#define NEW_GLIBC\n{text}"
        files = {f"{name}.c": whole} | {header: sources[header] for header in _HEADERS}
        with TemporaryDirectory(prefix="modelica_like_") as place:
            write_bytes(library, build(files, platform, Path(place), name).read_bytes())
        _tidy(library)
    elif time.time() - library.stat().st_mtime > _TOUCHED:
        with suppress(OSError):  # the folder may be for reading only
            os.utime(library)
    return library


def _tidy(newest: Path) -> None:
    """Remove libraries beside the newest one that nobody has used for long, and the oldest of those that are too many.

    Who has loaded one keeps it; on Windows that one also stays in the folder.
    """
    ages: list[tuple[float, int, Path]] = []
    for file in newest.parent.glob("code-*"):
        with suppress(FileNotFoundError):  # other processes tidy up, too
            status = file.stat()
            ages.append((time.time() - status.st_mtime, status.st_size, file))
    total = 0
    for age, size, file in sorted(ages):
        total += size
        if file != newest and (age > _MOST_AGE or total > _MOST_BYTES):
            with suppress(FileNotFoundError, PermissionError):
                file.unlink()


@cache
def _version(command: tuple[str, ...]) -> str:
    told = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    return f"{command} {told.stdout}"
