"""Tests over all examples: some of them in the quick suite, the others among the slow tests."""

from collections.abc import Callable, Sequence
from typing import Any

import pytest

SHARE = 3
"""One of so many stays: a fault of the framework shows in many examples, one of an example in the slow tests."""


def some(of: Sequence[Any], name: Callable[[Any], str] = str, also: Sequence[str] = ()) -> list[Any]:
    """Return parameters of a test, of which every third one, and those called so, are not slow."""
    return [
        pytest.param(one, id=name(one), marks=() if k % SHARE == 0 or name(one) in also else pytest.mark.slow)
        for k, one in enumerate(of)
    ]
