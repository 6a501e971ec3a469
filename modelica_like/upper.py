"""Functions of upper layers for lower ones, registered here by the top-level package."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_makers: dict[str, Callable[[str], Any]] = {}


def provide(names: tuple[str, ...], load: Callable[[str], Any]) -> None:
    """Register loaders of upper layers' functions by name, for first use."""
    _makers.update(dict.fromkeys(names, load))


def upper(name: str) -> Any:
    """Return a function of an upper layer."""
    return _makers[name](name)


class Shown:
    """A result that a notebook shows as its tables."""

    def _repr_html_(self) -> str:
        return upper("html")(self)
