"""Times of mode changes in runs that begin with one: the value and its derivative belong to the same change."""

from math import asin, cos, pi, sin
from typing import Any, Literal

import pytest
from scipy.optimize import brentq

from components import ConstantTorque, Freewheel, Inertia, Sine, Torque
from modelica_like import Assembly, sensitivities
from modelica_like.errors import UnknownName

A, C, W = 10.0, 2.0, 2 * pi
OPENS = (pi + asin(C / A)) / W
"""Where A·sin(W·t) = -C: both inertias are 1, so the torque in the locked freewheel is (A·sin(W·t) + C)/2."""


def _behind(t: float) -> float:
    """Return by how much the driven inertia is faster, t after it has begun to overrun at `OPENS`."""
    return -C * (t - OPENS) - A / W * (cos(W * OPENS) - cos(W * t))


LOCKS: Any = brentq(_behind, OPENS + 0.1, OPENS + 0.9, xtol=1e-14)


def drive() -> Assembly:
    """The driving side is faster at the start: the freewheel locks there, in an impact."""
    parts = {
        "s": Sine(amplitude=A, f=1.0), "torque": Torque(), "left": Inertia(J=1.0, phi=0.0, w=1.0),
        "fw": Freewheel(), "right": Inertia(J=1.0, phi=0.0, w=0.0), "load": ConstantTorque(tau_constant=-C),
    }  # fmt: skip
    wires = {"s": ["s.y", "torque.tau"]}
    return Assembly("d", parts=parts, series={"a": ["torque", "left", "fw", "right", "load"]}, connect=wires)


@pytest.mark.parametrize("method", ["forward", "adjoint"])
def test_a_change_at_the_start_counts(method: Literal["forward", "adjoint"]) -> None:
    names = ["time(fw.mode -> overrunning)", "time(fw.mode -> locked, 2)"]
    found = sensitivities(drive(), until=1.5, of=names, to=["load.tau_constant"], method=method)
    assert [one.value for one in found.outputs] == pytest.approx([OPENS, LOCKS], abs=1e-6)
    # A·sin(W·t) = -c, and c·(t - t_opens) + A/W·(cos(W·t_opens) - cos(W·t)) = 0, by -c
    assert found[names[0], "load.tau_constant"] == pytest.approx(1 / (A * W * cos(W * OPENS)), rel=1e-6)
    by = (LOCKS - OPENS) / (C + A * sin(W * LOCKS))
    assert found[names[1], "load.tau_constant"] == pytest.approx(by, rel=1e-6)


def test_the_time_of_the_start_has_no_derivative() -> None:
    with pytest.raises(UnknownName, match="does not happen after the start of the run"):
        sensitivities(drive(), until=1.5, of=["time(fw.mode -> locked)"], to=["load.tau_constant"])
