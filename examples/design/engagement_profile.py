"""Engagement of the multi-plate clutch of document 003 that loads the shafts least, at a bounded friction work.

The normal force over time is a polygon with fixed instants; its heights are sought with IPOPT. Peaks, friction work and
lock-up time with their exact derivatives come from the simulation as one CasADi function. The largest of several peaks
has no derivative where another one overtakes, so the bound of all is minimised instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from modelica_like import load, simulation_function
from modelica_like.language import Component, Equations, Expr, Output, Parameter, param, signal_out, where

NETLIST = Path(__file__).parents[1] / "machine_tool_startup.toml"
KNOTS = (0.07, 0.17, 0.27, 0.37)
PEAKS = ("max(shaft1.tau)", "min(shaft1.tau)", "max(shaft2.tau)", "min(shaft2.tau)")
LIMITED = ("clutch.loss_energy", "clutch.lock_time")
LATEST_LOCK = 0.4
TYPICAL = 500.0
TYPICAL = 500.0


class Profile(Component):
    """Signal through given heights at fixed times: zero before the first, constant after the last."""

    y1: Parameter = param("1", "height at the second time", default=0.4, min=0)
    y2: Parameter = param("1", "height at the third time", default=0.7, min=0)
    y3: Parameter = param("1", "height at the last time", default=1.0, min=0)
    time_scale: Parameter = param("s", "scale of the times", default=1.0)
    y: Output = signal_out("1", "signal")

    def equations(self) -> Equations:
        """Interpolate between the heights."""
        now = self.time / self.time_scale
        heights: list[Expr | float] = [0.0, self.y1, self.y2, self.y3]
        signal: Expr | float = heights[-1]
        for k in reversed(range(1, len(KNOTS))):
            slope = (heights[k] - heights[k - 1]) / (KNOTS[k] - KNOTS[k - 1])
            signal = where(now < KNOTS[k], heights[k - 1] + slope * (now - KNOTS[k - 1]), signal)
        yield self.y == where(now < KNOTS[0], 0.0, signal)


@dataclass(frozen=True)
class Design:
    """A profile and what it gives.

    Attributes:
        heights: of the profile.
        peak: largest shaft torque in N.m.
        work: friction work in J.
        lock_time: in s.
        runs: number of simulations.
    """

    heights: tuple[float, ...]
    peak: float
    work: float
    lock_time: float
    runs: int


def design(most_work: float) -> tuple[Design, Design]:
    """Return the profile to begin with, and the one of least shaft torque among those that never fall.

    Args:
        most_work: bound of the friction work in J.
    """
    drive = load(NETLIST)
    drive.coil = Profile()
    heights = [f"coil.y{k}" for k in range(1, len(KNOTS))]
    # Where the clutch slips once more, or does not lock, IPOPT takes a shorter step.
    outputs = [*PEAKS, "clutch.loss_energy", "clutch.lock_time"]
    options = {"until": "0.5 s", "precision": 1e-7, "nan_where_refused": True}
    simulation = simulation_function(drive, heights, outputs, **options)
    y, bound = ca.MX.sym("y", len(heights)), ca.MX.sym("bound")
    results = simulation(y)
    signs = ca.DM([1.0, -1.0, 1.0, -1.0])
    below = bound - signs * results[:4] / TYPICAL
    limits = ca.vertcat(below, results[4] / most_work, results[5] / LATEST_LOCK, ca.diff(y))
    quiet = {"print_level": 0, "sb": "yes"}
    ipopt = {"hessian_approximation": "limited-memory", "tol": 1e-5, "mu_init": 1e-3, "max_iter": 40, **quiet}
    options = {"ipopt": ipopt, "print_time": False}
    solver = ca.nlpsol("design", "ipopt", {"x": ca.vertcat(y, bound), "f": bound, "g": limits}, options)
    begin = simulation.start_values
    first = _result(simulation(begin), begin, simulation.runs)
    upper = [np.inf] * 4 + [1.0] * 2 + [np.inf] * (len(heights) - 1)
    found = solver(x0=[*begin, first.peak / TYPICAL], lbx=0.1, ubx=1.2, lbg=0.0, ubg=upper)
    best = np.array(found["x"]).ravel()[:-1]
    return first, _result(simulation(best), best, simulation.runs)


def _result(values: ca.DM, heights: np.ndarray, runs: int) -> Design:
    numbers = np.array(values).ravel()
    return Design(tuple(map(float, heights)), float(np.max(np.abs(numbers[:4]))), numbers[4], numbers[5], runs)


if __name__ == "__main__":
    for title, one in zip(("begin", "best"), design(600.0), strict=True):
        print(
            f"{title:6} peak {one.peak:7.2f} N.m   friction work {one.work:6.1f} J   lock-up {one.lock_time:.4f} s   "
            f"heights {', '.join(f'{y:.3f}' for y in one.heights)}   {one.runs} runs"
        )
