"""Tapes of a model as compiled code: written, compiled by this machine's compiler and stored once, then loaded."""

from __future__ import annotations

import ctypes
import hashlib
import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from modelica_like.errors import ExportError
from modelica_like.fmi.build import RUNTIMES, build, compiler_command, flags, native_platform
from modelica_like.fmi.runtime import cache_folder
from modelica_like.fmi.sources import own_sources
from modelica_like.fmi.tables import Tables
from modelica_like.native.straight import straight
from modelica_like.writing import write_bytes

_HEADERS = ("code.h", "operations.h", "rodas.h")


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
        files = {f"{name}.c": "#define CODE_ONLY\n" + text} | {header: sources[header] for header in _HEADERS}
        with TemporaryDirectory(prefix="modelica_like_") as place:
            write_bytes(library, build(files, platform, Path(place), name).read_bytes())
    return library


@cache
def _version(command: tuple[str, ...]) -> str:
    told = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    return f"{command} {told.stdout}"
