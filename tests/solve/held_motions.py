"""Held motions of a model of which only some values are given."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from modelica_like.solve.initialize import holds as module
from modelica_like.solve.initialize.point import Point


class Fake:
    """Stands for the functions of a model, whose values at a point are given; tells how often they are called."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **values: Any) -> None:
        self.calls: list[str] = []
        self.model: Any = SimpleNamespace(**{name: name for name in values})

        def call(model: Any, function: str, point: Any) -> Any:
            assert model is self.model
            self.calls.append(function)
            return np.array(values[function](point), float)

        monkeypatch.setattr(module, "call", call)


def at(*d: float, x: tuple[float, ...] = ()) -> Point:
    return Point(2.0, np.array(x, float), np.zeros(0), np.array(d, float))


def held(k: int, **given: Any) -> Any:
    """Motion k: variable 10 + k, reaction 20 + k, mode k, which holds it with number 1 and lets it go with 2."""
    known = {"component": f"c{k}", "mode": k, "number": 1, "loose": 2, "motion": 10 + k, "reaction": 20 + k}
    return SimpleNamespace(**{**known, "approach": 30 + k, "state": None, **given})
