"""Defaults of the sizing functions and of the framework are what users rely on; a change of one is a decision.

`python tests/library/test_defaults.py` writes the list anew.
"""

from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from inspect import isclass, isfunction, signature
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import components.sizing as package
import modelica_like

LIST = Path(__file__).with_name("defaults.txt")


def defaults() -> Iterator[str]:
    """One line for each function and class that has defaults."""
    for module in sorted(one.name for one in walk_packages(package.__path__, "components.sizing.")):
        for name, one in vars(import_module(module)).items():
            if not name.startswith("_") and (isfunction(one) or isclass(one)) and one.__module__ == module:
                yield from _told(f"{module.removeprefix('components.')}.{name}", one)
    for name in sorted(modelica_like.__all__):
        if callable(one := getattr(modelica_like, name)):
            yield from _told(name, one)


def _told(name: str, one: Any) -> Iterator[str]:
    given = {key: it.default for key, it in signature(one).parameters.items() if it.default is not it.empty}
    if told := ", ".join(f"{key}={getattr(it, '__name__', repr(it))}" for key, it in given.items()):
        yield f"{name}({told})"


def test_defaults_are_what_users_rely_on() -> None:
    assert list(defaults()) == LIST.read_text(encoding="utf-8").splitlines()


def test_what_is_exported_has_no_name_of_a_module() -> None:
    """Python replaces the function by the module as soon as anything in the module is imported."""
    assert [name for name in modelica_like.__all__ if find_spec(f"modelica_like.{name}")] == []


if __name__ == "__main__":
    LIST.write_text("\n".join(defaults()) + "\n", encoding="utf-8")
