"""The compiled run-time, the same for all models: shipped with the package, or built once and kept.

This module needs the standard library only, so that building a wheel can import it.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from modelica_like.fmi.build import BROWSER, RUNTIMES, build, flags
from modelica_like.fmi.sources import Face, own_sources, runtime_sources
from modelica_like.writing import write_bytes

SHIPPED = Path(__file__).parent / "runtimes"
"""Libraries of the package, one folder per platform."""


def _faces(platform: str) -> tuple[Face, ...]:
    return ("native",) if platform == BROWSER.name else ("2.0", "3.0", "native")


def runtime_library(platform: str, report: Callable[[str], None] = lambda _: None) -> Path:
    """Return the compiled run-time for a platform, which reads its model.

    It has the functions of FMI 2.0 and 3.0 and those of native.c; for a browser the latter only.

    A library belongs to its sources by a checksum in its name. The package's own one is taken, or one that was built
    before; else it is built and kept in the user's cache.

    Args:
        platform: a key of `RUNTIMES`.
        report: called with what is being done, where it takes time.

    Raises:
        UnknownName: there is no such platform.
        MissingExtra, ExportError: it must be built, and there is no compiler, or the compiler failed.
    """
    found = found_runtime(platform)
    if found is not None:
        return found
    stale = any((SHIPPED / platform).glob("runtime-*"))
    report(f"compiling the run-time for {platform}, once" + (": its sources have changed" if stale else ""))
    return build_runtime(platform, cache_folder() / platform)


def found_runtime(platform: str) -> Path | None:
    """Return the library for a platform that belongs to the sources, if there is one."""
    homes = (folder / platform / _library_name(platform) for folder in (SHIPPED, cache_folder()))
    return next((home for home in homes if home.is_file()), None)


def build_runtime(platform: str, folder: Path) -> Path:
    """Compile the run-time for a platform into a folder, unless it is there; others may be reading in that folder."""
    library = folder / _library_name(platform)
    if library.is_file():
        return library
    with TemporaryDirectory(prefix="modelica_like_") as place:
        write_bytes(library, build(runtime_sources(_faces(platform)), platform, Path(place)).read_bytes())
    return library


def _library_name(platform: str) -> str:
    total = hashlib.sha256(repr((own_sources(_faces(platform)), flags(platform))).encode()).hexdigest()
    return f"runtime-{total[:16]}{RUNTIMES[platform].suffix}"


def cache_folder() -> Path:
    """Return where libraries are kept: `$MODELICA_LIKE_CACHE`, or a folder of the user."""
    given = os.environ.get("MODELICA_LIKE_CACHE")
    if given:
        return Path(given)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return base / "modelica-like" / "runtimes"
