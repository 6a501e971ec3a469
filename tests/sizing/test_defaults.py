"""Defaults of the sizing functions are what users' calculations rely on; a change of one is a decision.

`python tests/sizing/test_defaults.py` writes the list anew.
"""

from collections.abc import Iterator
from importlib import import_module
from inspect import isclass, isfunction, signature
from pathlib import Path
from pkgutil import walk_packages

import components.sizing as package

LIST = Path(__file__).with_name("defaults.txt")


def defaults() -> Iterator[str]:
    """One line for each function and class that has defaults."""
    for module in sorted(one.name for one in walk_packages(package.__path__, "components.sizing.")):
        for name, one in vars(import_module(module)).items():
            if name.startswith("_") or not (isfunction(one) or isclass(one)) or one.__module__ != module:
                continue
            given = (
                f"{key}={it.default!r}" for key, it in signature(one).parameters.items() if it.default is not it.empty
            )
            if told := ", ".join(given):
                yield f"{module.removeprefix('components.sizing.')}.{name}({told})"


def test_defaults_are_what_calculations_rely_on() -> None:
    assert list(defaults()) == LIST.read_text(encoding="utf-8").splitlines()


if __name__ == "__main__":
    LIST.write_text("\n".join(defaults()) + "\n", encoding="utf-8")
