"""Files are written under a temporary name and renamed when they are complete."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a file to write that replaces `path` at the end; a full disk or an interrupt leaves the old file intact.

    Args:
        path: the file; its folder is created if it does not exist. Pipes and devices are written directly.

    Raises:
        OSError: it cannot be written; its `filename` is the path.
    """
    check_writable(path)
    # A link keeps its target.
    target = Path(os.path.realpath(path))
    beside = target.is_file() or not target.exists()
    draft = target.with_name(f".{os.urandom(4).hex()}{target.suffix}") if beside else target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield draft
        if beside:
            if target.exists():
                draft.chmod(stat.S_IMODE(target.stat().st_mode))
            draft.replace(target)
    except OSError as error:
        if error.filename is not None and os.fspath(error.filename) != os.fspath(draft):
            raise
        raise _refused(path, error.errno or errno.EIO, error.strerror or str(error)) from error
    finally:
        if beside:
            draft.unlink(missing_ok=True)


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a file completely or not at all.

    Raises:
        OSError: it cannot be written.
    """
    with replacing(path) as draft:
        draft.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file as UTF-8, completely or not at all.

    Raises:
        OSError: it cannot be written.
    """
    write_bytes(path, text.encode())


def check_writable(path: str | Path) -> None:
    """Raise an error before any work is done if a file cannot be written, as far as can be known.

    Raises:
        OSError: it is a folder, its folder is a file, or nothing can be written there.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise _refused(path, errno.EISDIR)
    if target.exists() and not os.access(target, os.W_OK):
        raise _refused(path, errno.EACCES)
    if target.exists() and not target.is_file():
        return
    given = target if Path(path).is_symlink() else Path(path)
    folder = next(parent for parent in given.parents if parent.exists())
    if not folder.is_dir():
        raise _refused(folder, errno.ENOTDIR)
    import tempfile  # with all archivers: slow to import

    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise _refused(folder, error.errno or errno.EACCES, error.strerror or "") from error


def _refused(path: str | Path, code: int, text: str = "") -> OSError:
    return OSError(code, text or os.strerror(code), os.fspath(path))
