"""Docstrings of the public interface: every argument is described, arrays have shapes."""

import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import modelica_like
import modelica_like.language as language

MANY = 3
"""Parameters from which on a method describes each."""
ARRAY = re.compile(r"\b(Vector|Matrix|ndarray|NDArray)\b")


def exported() -> Iterator[tuple[str, Any]]:
    for name in modelica_like.__all__:
        yield f"modelica_like.{name}", getattr(modelica_like, name)
    for name, value in vars(language).items():
        if not name.startswith("_") and getattr(value, "__module__", "").startswith("modelica_like"):
            yield f"language.{name}", value


def functions() -> Iterator[tuple[str, Callable[..., Any], int]]:
    """Yield all public functions, and from how many parameters on each describes them."""
    for name, value in exported():
        if inspect.isfunction(value):
            yield name, value, 1
        if not inspect.isclass(value) or issubclass(value, Exception):
            continue
        if "__init__" in vars(value) and not hasattr(value, "__dataclass_fields__"):
            yield name, value, 1
        for key, inner in vars(value).items():
            method = getattr(inner, "__func__", inner)
            if inspect.isfunction(method) and not key.startswith("_"):
                yield f"{name}.{key}", method, 1 if name.startswith("language.BoundMode") else MANY


PUBLIC = {name: (function, least) for name, function, least in functions()}


@pytest.mark.parametrize("name", PUBLIC)
def test_arguments_are_described(name: str):
    function, least = PUBLIC[name]
    parameters = [key for key in inspect.signature(function).parameters if key not in ("self", "cls")]
    text = inspect.getdoc(function) or ""
    described = re.findall(r"^ {4}\**(\w+(?:, \w+)*):", text.partition("\nArgs:\n")[2], re.MULTILINE)
    named = {one for names in described for one in names.split(", ")}
    assert len(parameters) < least or set(parameters) <= named


@pytest.mark.parametrize("name", PUBLIC)
def test_arrays_have_shapes(name: str):
    function, _ = PUBLIC[name]
    hints = getattr(function, "__annotations__", {})
    if any(ARRAY.search(str(hint)) for hint in hints.values()):
        assert re.search(r"shape|Shape|\(n\w*[,)]", inspect.getdoc(function) or "")
