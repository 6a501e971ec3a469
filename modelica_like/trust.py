"""What may be used: modules beside a netlist in trusted folders only, because a module can do all that its user can."""

from __future__ import annotations

import json
import os
import stat
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from modelica_like.errors import NetlistError
from modelica_like.writing import write_text

Decide = Callable[[Path], bool]
"""Tells whether the modules of a folder may run."""
_HOME = Path(__file__).resolve().parent
_EXAMPLES = next((folder / "examples" for folder in (_HOME, _HOME.parent) if (folder / "examples").is_dir()), _HOME)
"""They come with this package, whose code runs anyway: in its wheel, or beside it."""
_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def _nobody(folder: Path) -> bool:
    return False


def _everybody(folder: Path) -> bool:
    return True


_decision: ContextVar[Decide] = ContextVar("decision", default=_nobody)
_confinement: ContextVar[Path | None] = ContextVar("confinement", default=None)


@contextmanager
def trusting(decide: Decide | None = None) -> Generator[None]:
    """Run the modules beside all netlists that are read inside, not only those in trusted folders.

    Args:
        decide: is asked about each folder that is not trusted; by default all folders are.
    """
    token = _decision.set(decide or _everybody)
    try:
        yield
    finally:
        _decision.reset(token)


@contextmanager
def confined(folder: Path) -> Generator[None]:
    """Read no netlist, and nothing that it uses, outside of a folder."""
    token = _confinement.set(folder.resolve())
    try:
        yield
    finally:
        _confinement.reset(token)


def require_confined(path: Path) -> None:
    """Refuse a file outside of the folder to which reading is confined, also one behind a link.

    Raises:
        NetlistError: it is there.
    """
    folder = _confinement.get()
    if folder is None:
        return
    try:
        inside = path.resolve().is_relative_to(folder)
    except (OSError, RuntimeError, ValueError):  # links in a circle, half characters
        inside = False
    if not inside:
        raise NetlistError(f"'{path}' is outside of the folder '{folder}'.", advice="Name a file in this folder.")


def everything_trusted() -> bool:
    """Tell whether the modules beside all netlists run here, as the user has said for this once."""
    return _decision.get() is _everybody


def may_run(folder: Path) -> bool:
    """Tell whether the modules of a folder may run.

    Raises:
        NetlistError: the list of trusted folders is damaged, or others can write it.
    """
    trusted = trusted_folders()
    for place in (folder, *folder.parents):
        if place == _EXAMPLES or (place in trusted and not _everyone_writes(place)):
            return True
        if _everyone_writes(place):
            break  # what lies in it may be of others, whoever trusts a folder around it
    return _decision.get()(folder)


def _everyone_writes(folder: Path) -> bool:
    return os.name == "posix" and bool(folder.stat().st_mode & stat.S_IWOTH)


def trusted_folders() -> list[Path]:
    """Return the folders that the user trusts, with all that is in them.

    Raises:
        NetlistError: the list is damaged, or others can write it.
    """
    store = _store()
    try:
        status, text = store.stat(), store.read_text(encoding="utf-8")
    except FileNotFoundError:
        return []
    except (OSError, UnicodeDecodeError) as error:
        raise NetlistError(f"The list of trusted folders, '{store}', cannot be read: {error}.") from None
    if os.name == "posix" and (status.st_uid not in (0, os.getuid()) or status.st_mode & _OTHERS):
        raise NetlistError(
            f"The list of trusted folders, '{store}', can be written by others.",
            advice=f"Look through it, and then: chmod go-w '{store}'",
        )
    try:
        return [Path(folder) for folder in json.loads(text)["folders"]]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise NetlistError(f"The list of trusted folders, '{store}', is damaged.", advice="Remove it.") from None


def trust(folder: str | Path) -> Path:
    """Trust a folder from now on: netlists in it, and in the folders below, may use modules beside them.

    Returns:
        The folder, without links.

    Raises:
        NetlistError: there is no such folder, or everyone can write there.
        OSError: the list cannot be written.
    """
    place = Path(folder).resolve()
    if not place.is_dir():
        raise NetlistError(f"'{folder}' is not a folder.")
    if _everyone_writes(place):
        raise NetlistError(
            f"'{place}' cannot be trusted: everyone can write there.",
            advice="Trust a folder of yours, such as one in it.",
        )
    _write([*trusted_folders(), place])
    return place


def distrust(folder: str | Path) -> Path:
    """Trust a folder no longer.

    Returns:
        The folder, without links.

    Raises:
        NetlistError: it is not on the list.
        OSError: the list cannot be written.
    """
    place, trusted = Path(folder).resolve(), trusted_folders()
    if place not in trusted:
        above = next((parent for parent in place.parents if parent in trusted), None)
        raise NetlistError(f"'{place}' is not on the list" + (f"; '{above}', around it, is." if above else "."))
    _write([folder for folder in trusted if folder != place])
    return place


def _write(folders: list[Path]) -> None:
    store = _store()
    store.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    write_text(store, json.dumps({"folders": sorted({str(folder) for folder in folders})}, indent=1) + "\n")
    store.chmod(0o600)


def _store() -> Path:
    """Return the list: in `$MODELICA_LIKE_CONFIG`, or in a folder of the user."""
    given = os.environ.get("MODELICA_LIKE_CONFIG")
    if given:
        return Path(given) / "trusted.json"
    if sys.platform == "win32":
        base = Path(os.environ.get("APPDATA", Path.home() / "AppData" / "Roaming"))
    else:
        base = Path(os.environ.get("XDG_CONFIG_HOME", Path.home() / ".config"))
    return base / "modelica-like" / "trusted.json"
