"""FMU files and other archives: valid names, and the same bytes for the same content."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from modelica_like.errors import ExportError, UnknownName
from modelica_like.writing import check_writable, replacing

_LEVEL = 5  # 6 takes almost twice as long for files that are 2 % smaller
_EPOCH = (1980, 1, 1, 0, 0, 0)
_FILE = 0o644 << 16
_LIBRARY = 0o755 << 16


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write files to a zip archive, the description first, the others by name, without time and user.

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


def target_file(path: str | Path, ending: str, what: str) -> Path:
    """Return the path of a file that can be written.

    Args:
        path: the file.
        ending: required ending of its name.
        what: kind of file, such as `An FMU`.

    Raises:
        ExportError: it has another ending, or there is no such folder.
        OSError: it cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() != ending:
        raise ExportError(f"{what} is a file with the ending {ending}, not '{target.name}'.")
    if not target.absolute().parent.is_dir():
        raise ExportError(f"There is no folder '{target.parent}' for {target.name}.", advice="Create it first.")
    check_writable(target)
    return target


def known_version(version: str, versions: Any, standard: str) -> Any:
    """Return the requested version of a standard, a member of a `Literal`.

    Raises:
        UnknownName: there is no such version.
    """
    if version in get_args(versions):
        return version
    raise UnknownName(
        f"{standard} {version} is not supported.", advice=f"There are {' and '.join(get_args(versions))}."
    )
