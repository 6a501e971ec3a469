"""Gradients of random drives against differences in fractions: steps so small that no more than the slope is left.

Where the derivatives of both sides differ, the drive is on an edge, and there is no gradient.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from typing import Any, Literal

import numpy as np
import pytest
from exact_drives import Drive, Element, run_exactly
from random_drives import assembly, random_drive
from some import some

from modelica_like import Options, sensitivities
from modelica_like.errors import NoGradient

Method = Literal["forward", "adjoint"]
STEP = Fraction(1, 2**70)
PRECISE = 1e-9
"""Errors relative to the largest speed per relative change of a parameter."""
SMOOTH = (0, 1, 2, 3, 4, 5, 7, 8, 9, 11, 12, 13, 14, 16, 17, 18, 19, 20, 21, 22)
TIES = (10, 37, 55, 253, 295, 306)
"""Drives in ties that later friction makes up for, or with two events at one instant in whatever order."""
EDGES = {6: 0.25, 10: 2.0, 15: 2.0, 55: 1.0, 57: 0.25, 101: 0.5, 112: 0.25, 178: 0.5, 202: 0.5, 210: 0.5, 285: 1.0}
"""Drives on an edge, and a time by which it shows.

Torques are just what friction bears, an impact leaves friction a slip of zero, or events happen at one instant, or at
the end.
"""


def parameters(drive: Drive) -> dict[str, Callable[[Any], Drive]]:
    """Give the inertias and the constant capacities and torques, with the drive in which they are a times as large."""
    found: dict[str, Callable[[Any], Drive]] = {}
    for k, J in enumerate(drive.J):
        found[f"J{k}.J"] = partial(_with, drive, "J", k, J)
    for k, e in enumerate(drive.elements):
        if len(e.capacity) == 1 and e.capacity[0][1]:
            found[f"{e.name}.capacity"] = partial(_with, drive, "elements", k, e)
    for k, one in enumerate(drive.torques):
        if len(one[1]) == 1 and one[1][0][1]:
            found[f"tau{k}.tau_constant"] = partial(_with, drive, "torques", k, one)
    return found


def _with(drive: Drive, field: str, k: int, one: Any, times: Fraction) -> Drive:
    if isinstance(one, Element):
        one = replace(one, capacity=((0.0, times * Fraction(one.capacity[0][1])),))
    elif isinstance(one, tuple):
        one = one[0], ((0.0, times * Fraction(one[1][0][1])),)
    else:
        one = times * Fraction(one)
    every = getattr(drive, field)
    return replace(drive, **{field: (*every[:k], one, *every[k + 1 :])})


@cache
def exactly(drive: Drive) -> np.ndarray:
    """Give the changes of the final speeds per relative change of a parameter upwards and downwards, over the largest.

    Shape (sides, speeds, parameters).
    """
    run = run_exactly(drive)
    largest = Fraction(max(run.largest)) or Fraction(1)
    return np.array([
        [[float((b - a) / step / largest) for a, b in zip(run.speeds[-1], moved.speeds[-1], strict=True)]
         for moved in (run_exactly(change(1 + step)) for change in parameters(drive).values())]
        for step in (STEP, -STEP)
    ]).transpose(0, 2, 1)  # fmt: skip


def gradient(drive: Drive, method: Method) -> np.ndarray:
    """Give the same by the product."""
    names = list(parameters(drive))
    result = sensitivities(
        assembly(drive), [f"J{k}.w" for k in range(len(drive.J))], names, until=drive.until, start="rest",
        options=Options(rtol=1e-9), method=method,
    )  # fmt: skip
    return result.derivatives * [one.value for one in result.parameters] / (max(run_exactly(drive).largest) or 1.0)


@pytest.mark.parametrize("number", some(SMOOTH + TIES))
def test_a_gradient_is_exact(number):
    drive = random_drive(number)
    above, below = exactly(drive)
    assert above == pytest.approx(below, abs=1e-12)
    assert gradient(drive, "forward") == pytest.approx(above, abs=PRECISE)


@pytest.mark.slow
@pytest.mark.parametrize("number", SMOOTH + TIES)
def test_an_adjoint_gradient_is_exact(number):
    drive = random_drive(number)
    assert gradient(drive, "adjoint") == pytest.approx(exactly(drive)[0], abs=PRECISE)


@pytest.mark.parametrize("number", some([*EDGES]))
def test_on_an_edge_there_is_none(number):
    drive = replace(random_drive(number), until=EDGES[number])
    above, below = exactly(drive)
    assert np.abs(above - below).max() > 1e-3
    with pytest.raises(NoGradient, match=r"exactly at the (limit|end)|for different reasons|because .* is zero"):
        gradient(drive, "adjoint")
