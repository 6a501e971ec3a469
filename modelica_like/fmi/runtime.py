"""The compiled run-time, the same for all models: shipped with the package, or built once and stored.

This module needs only the standard library, so that a wheel build can import it.
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

    It has the functions of FMI 2.0 and 3.0 and those of native.c; for a browser only the latter.

    The name of a library has a checksum of its sources. The package's own library is used, or one built before;
    otherwise it is built and stored in the user's cache.

    Args:
        platform: a key of `RUNTIMES`.
        report: called with the present activity, if it takes time.

    Raises:
        UnknownName: there is no such platform.
        MissingExtra, ExportError: it must be built, but there is no compiler, or the compiler failed.
    """
    library = found_runtime(platform)
    if library is not None:
        return library
    stale = any((SHIPPED / platform).glob("runtime-*"))
    report(f"compiling the run-time for {platform}, once" + (": its sources have changed" if stale else ""))
    return build_runtime(platform, cache_folder() / platform)


def found_runtime(platform: str) -> Path | None:
    """Return the library for a platform and the present sources, if there is one."""
    homes = (folder / platform / _library_name(platform) for folder in (SHIPPED, cache_folder()))
    return next((home for home in homes if home.is_file()), None)


def build_runtime(platform: str, folder: Path) -> Path:
    """Compile the run-time for a platform into a folder, unless it exists; others may read there at the same time."""
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
    """Return the folder of libraries: `$MODELICA_LIKE_CACHE`, or a folder of the user."""
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
