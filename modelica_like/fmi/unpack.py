"""FMUs of others: archives are checked before anything is unpacked."""

from __future__ import annotations

import lzma
import stat
import struct
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import lxml.etree as etree

from modelica_like.errors import FmuRefused

_ENCRYPTED = 0x1
_DAMAGED = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, EOFError, OSError, RuntimeError, ValueError,
)  # fmt: skip
"""What damaged archives end in: places before their beginning (an OSError without a file), unknown methods, names."""
_LONGEST, _LONGEST_PART = 500, 255
"""Characters of a path inside, bytes of a name: files 1,500 folders deep can be neither created nor removed."""


@dataclass(frozen=True)
class Kind:
    """A kind of archive: its name, and its required description."""

    name: str
    description: str


FMU = Kind("FMU", "modelDescription.xml")
SSP = Kind("SSP", "SystemStructure.ssd")


@dataclass(frozen=True)
class Limits:
    """Limits of an archive.

    Attributes:
        members: number of files and folders.
        total: bytes of all files when unpacked.
        ratio: unpacked over packed size of all files together, where they are larger than `harmless`.
        harmless: bytes below which the ratio does not matter.
    """

    members: int = 10_000
    total: int = 2 * 1024**3
    ratio: float = 200.0
    harmless: int = 10 * 1024**2


LIMITS = Limits()


def unpack(path: Path, target: Path, limits: Limits = LIMITS, kind: Kind = FMU) -> Path:
    """Unpack an FMU, or another archive, into a folder, if it is safe to do so.

    Args:
        path: the archive.
        target: an existing, empty folder.
        limits: of the archive.
        kind: expected kind.

    Returns:
        The folder.

    Raises:
        FmuRefused: there is no such file, or it is not an archive, is damaged, has paths outside, links or a bomb, or
            is not of this kind.
        OSError: the file cannot be read.
    """
    refuse_missing(path, kind)
    try:
        with zipfile.ZipFile(path) as archive:
            _look_through(path.name, archive.infolist(), limits, kind)
            archive.extractall(target)
    except (IsADirectoryError, NotADirectoryError, FileExistsError):
        raise FmuRefused(f"{path.name} is refused: a file in it has the name of a folder.") from None
    except _DAMAGED as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise
        text = str(error) or "It is truncated."
        raise FmuRefused(
            f"{path.name} is not an {kind.name}: it is not a valid zip archive.",
            why=text if text.endswith(".") else f"{text}.",
        ) from None
    refuse_document_type(path.name, target / kind.description)
    return target


def refuse_missing(path: Path, kind: Kind = FMU) -> None:
    """Refuse a path without a file.

    Raises:
        FmuRefused: there is none.
    """
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist"
        raise FmuRefused(f"The {kind.name} '{path}' {what}.", advice=f"Give the path of an {kind.name}.")


def refuse_document_type(name: str, file: Path) -> None:
    """Refuse a description of an archive that declares a document type.

    Raises:
        FmuRefused: it does.
    """
    # A search for bytes would not find it in UTF-16 or UTF-7.
    parser, content = etree.XMLParser(resolve_entities=False, no_network=True), file.read_bytes()
    try:
        declared = etree.fromstring(content, parser).getroottree().docinfo.internalDTD is not None
    except etree.XMLSyntaxError:  # its reader reports the error
        declared = b"<!DOCTYPE" in content
    if declared:
        raise FmuRefused(
            f"{name} is refused: its {file.name} declares a document type.",
            why="A model description needs none; it can make a small file enormous, or read other files.",
        )


def printable(text: str) -> str:
    """Return a text without control characters."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def _look_through(name: str, members: Sequence[zipfile.ZipInfo], limits: Limits, kind: Kind) -> None:
    if len(members) > limits.members:
        raise FmuRefused(f"{name} is refused: it holds {len(members)} files, more than {limits.members}.")
    seen: set[str] = set()
    for member in members:
        if reason := _objection(member, seen):
            raise FmuRefused(f"{name} is refused: '{printable(member.orig_filename)}' {reason}.")
        seen.add(member.filename)
    unpacked, packed = sum(m.file_size for m in members), sum(m.compress_size for m in members)
    if unpacked > limits.total:
        raise FmuRefused(f"{name} is refused: it would unpack to {_size(unpacked)}, more than {_size(limits.total)}.")
    if unpacked > limits.harmless and unpacked > limits.ratio * packed:
        raise FmuRefused(
            f"{name} is refused: {_size(packed)} would unpack to {_size(unpacked)}.",
            why=f"A file that shrinks to less than 1/{limits.ratio:g} is more likely a zip bomb than an {kind.name}.",
        )
    if kind.description not in seen:
        raise FmuRefused(f"{name} is not an {kind.name}: it has no {kind.description}.")


def _objection(member: zipfile.ZipInfo, seen: set[str]) -> str:
    """Return the objection against a member, or an empty string."""
    inside, kind = member.orig_filename, stat.S_IFMT(member.external_attr >> 16)
    if inside.startswith(("/", "\\")) or ":" in inside or "\0" in inside:
        return "is an absolute path"
    if ".." in PurePosixPath(inside.replace("\\", "/")).parts:
        return "leads out of the archive"
    if len(inside) > _LONGEST or any(len(part.encode(errors="replace")) > _LONGEST_PART for part in inside.split("/")):
        return "has a longer name than file systems allow"
    if "\\" in inside:
        return "has a backslash where the standard requires a slash"
    if kind == stat.S_IFLNK:
        return "is a link"
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is neither a file nor a folder"
    if member.flag_bits & _ENCRYPTED:
        return "is encrypted"
    return "occurs twice" if member.filename in seen else ""


def _size(count: float) -> str:
    for unit in ("bytes", "kB", "MB"):
        if count < 1024:
            return f"{count:.4g} {unit}"
        count /= 1024
    return f"{count:.4g} GB"
