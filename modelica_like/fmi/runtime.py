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

from modelica_like.fmi.build import FLAGS, PLATFORMS, build
from modelica_like.fmi.sources import runtime_sources

FACES = ("2.0", "3.0", "native")
"""What the library can be called by: importers of both versions, and Python."""
SHIPPED = Path(__file__).parent / "runtimes"
"""Libraries of the package, one folder per platform."""


def runtime_library(platform: str, report: Callable[[str], None] = lambda _: None) -> Path:
    """Return the compiled run-time for a platform; it has the functions of FMI 2.0 and 3.0 and reads its model.

    A library belongs to its sources by a checksum in its name. The package's own one is taken, or one that was built
    before; else it is built and kept in the user's cache.

    Args:
        platform: a key of `PLATFORMS`.
        report: called with what is being done, where it takes time.

    Raises:
        UnknownName: there is no such platform.
        MissingExtra, ExportError: it must be built, and there is no compiler, or the compiler failed.
    """
    sources = runtime_sources(FACES)
    name = library_name(platform, sources)
    homes = [folder / platform for folder in (SHIPPED, cache_folder())]
    for home in homes:
        if (home / name).is_file():
            return home / name
    stale = any(homes[0].glob("runtime-*"))
    report(f"compiling the run-time for {platform}, once" + (": its sources have changed" if stale else ""))
    return build_runtime(platform, homes[1], sources)


def build_runtime(platform: str, folder: Path, sources: dict[str, str] | None = None) -> Path:
    """Compile the run-time for a platform into a folder; a library that others may be reading is replaced at once."""
    sources = sources or runtime_sources(FACES)
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder) as place:
        built = build(sources, platform, Path(place), "runtime")
        return built.replace(folder / library_name(platform, sources))


def library_name(platform: str, sources: dict[str, str]) -> str:
    """Return the file name of the library that belongs to some sources."""
    total = hashlib.sha256(repr((sorted(sources.items()), FLAGS)).encode()).hexdigest()
    suffix = PLATFORMS[platform].suffix if platform in PLATFORMS else ""
    return f"runtime-{total[:16]}{suffix}"


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
