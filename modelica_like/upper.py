"""What lower layers offer of upper ones: the face of the package, which stands above all, puts it here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_makers: dict[str, Callable[[str], Any]] = {}


def provide(names: tuple[str, ...], load: Callable[[str], Any]) -> None:
    """Say how things of upper layers are loaded by their names, on first use."""
    _makers.update(dict.fromkeys(names, load))


def upper(name: str) -> Any:
    """Return something of an upper layer."""
    return _makers[name](name)
