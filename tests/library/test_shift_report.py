"""The largest torque of an element that slips, between results, too."""

from typing import cast

import numpy as np
import pytest

from components.clutches.friction import DryFriction
from components.gears.shift_report import Run, _slip

TIME = np.arange(10) / 10
FORWARD, STUCK = (DryFriction.mode.names.index(name) for name in ("forward", "stuck"))


class Known:
    """Stands for a run: a torque of -10 N.m at 0.53 s, on a parabola near that, else of 1 N.m."""

    def __init__(self, time: np.ndarray, mode: np.ndarray) -> None:
        tau = np.array([self.at(t)["clutch.tau"] for t in time])
        self.results = {"time": time, "clutch.mode": mode, "clutch.tau": tau}

    def __getitem__(self, name: str) -> np.ndarray:
        return self.results[name]

    def at(self, t: float) -> dict[str, float]:
        return {"clutch.tau": -max(10 - 100 * (t - 0.53) ** 2, 1.0)}


@pytest.mark.parametrize(("sticks", "largest"), [([], 10.0), ([0, 9], 10.0), ([4], 9.91), ([6], 9.91), ([5], 9.51)])
def test_the_largest_torque(sticks: list[int], largest: float) -> None:
    """At the vertex between three results, if it slips at all three of them."""
    mode = np.full(10, FORWARD)
    mode[sticks] = STUCK
    assert _slip(cast(Run, Known(TIME, mode)), "clutch", slice(0, 10)) == pytest.approx((0.9, largest), abs=1e-9)
    assert _slip(cast(Run, Known(TIME, np.full(10, STUCK))), "clutch", slice(0, 10)) == (0.0, 0.0)


@pytest.mark.parametrize("side", [0, 1])
def test_no_parabola_goes_through_an_event(side: int) -> None:
    """At 0.5 s, where the torque jumps up, or falls."""
    run = Known(np.insert(TIME, 5, 0.5), np.full(11, FORWARD))
    run["clutch.tau"][6 - side] = 0.1
    assert _slip(cast(Run, run), "clutch", slice(0, 11)) == pytest.approx((0.9, 9.91), abs=1e-9)
