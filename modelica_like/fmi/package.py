"""FMU files: zip archives with the same bytes for the same content."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

from modelica_like.writing import replacing

_LEVEL = 5  # 6 takes almost twice as long for files that are 2 % smaller
_EPOCH = (1980, 1, 1, 0, 0, 0)
_FILE = 0o644 << 16
_LIBRARY = 0o755 << 16


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write files to a zip archive, the description first, the others by name; no clock, no user goes in.

    Args:
        path: the archive; it is replaced.
        files: content by name.
    """
    with replacing(path) as draft, zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, key=lambda name: (name != "modelDescription.xml", name)):
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.create_system = 3  # Unix, wherever it is written
            entry.external_attr = _LIBRARY if name.startswith("binaries/") else _FILE
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name], compresslevel=_LEVEL)
