"""A model at its start; parts of several files of tests are modules beside them."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from modelica_like import build
from modelica_like.language import Component
from modelica_like.native.start import initialize
from modelica_like.solve.initialize import Point

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def start() -> Callable[..., dict[str, float]]:
    """Set start values (`a__w` for a.w), initialise, and return all variables."""

    def started(model: Component, how: str = "given", **values: object) -> dict[str, float]:
        for key, value in values.items():
            model.set(key.replace("__", "."), value)
        compiled = build(model)
        point: Point = initialize(compiled, 0.0, how)  # type: ignore[arg-type]
        found = np.array(
            compiled.equations.variables(point.t, point.x, point.z, compiled.p, compiled.u, point.d)
        ).ravel()
        names = {variable.path: float(value) for variable, value in zip(compiled.flat_variables, found, strict=True)}
        # Behind modes and discrete values stand approaches and shares.
        modes = {
            one.path: one.names[int(d)] for one, d in zip(compiled.flat_discretes, point.d, strict=False) if one.names
        }
        return {**names, **modes}  # type: ignore[dict-item]

    return started
