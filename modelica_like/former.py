"""Modules under names that they had before they were moved."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType


def moved(homes: Mapping[str, str]) -> None:
    """Let modules be imported by former names, too.

    Args:
        homes: full name of today by former full name. Modules of a package move along with it.
    """
    # First, since the folder of a package would otherwise give its modules again, under the former name.
    sys.meta_path.insert(0, _Former(homes))


class _Former:
    # Not derived from the classes of importlib.abc: that module loads tempfile, random and what reads resources.
    def __init__(self, homes: Mapping[str, str]) -> None:
        self.homes = homes
        self.tops = {name.partition(".")[0] for name in homes}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return ModuleSpec(fullname, self) if self._home(fullname) else None  # pyright: ignore[reportArgumentType]

    def create_module(self, spec: ModuleSpec) -> None:
        """Let Python create the module."""

    def exec_module(self, module: ModuleType) -> None:
        sys.modules[module.__name__] = import_module(self._home(module.__name__))

    def _home(self, name: str) -> str:
        if name.partition(".")[0] not in self.tops:
            return ""
        package = next((home for home in self.homes if name == home or name.startswith(f"{home}.")), None)
        return f"{self.homes[package]}{name[len(package) :]}" if package else ""
