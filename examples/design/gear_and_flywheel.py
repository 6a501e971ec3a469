"""Belt ratio and flywheel of the bench of document 002 that store a given energy in a given time for the least supply.

The clutch slips until it locks, and may not turn faster than 1500/min; the motor heats its winding. Sought with IPOPT;
energies and times with their exact derivatives come from the simulation as one CasADi function.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import casadi as ca
import numpy as np

from modelica_like import load, simulation_function

NETLIST = Path(__file__).parents[1] / "dc_bench.toml"
INPUTS = ("ratio", "disc")
OUTPUTS = ("battery.source_energy", "flywheel.stored_energy", "clutch.lock_time", "clutch.loss_energy", "flywheel.w")
LARGEST_SPEED = 1500 * pi / 30


@dataclass(frozen=True)
class Design:
    """A drive and what it gives.

    Attributes:
        ratio: of the belt between motor and clutch.
        disc: inertia of the flywheel in kg.m2.
        supply: energy from the battery in J.
        stored: energy of the flywheel in the end in J.
        lock_time: in s.
        work: friction work of the clutch in J.
        speed: of the flywheel in the end in rad/s.
        runs: number of simulations.
    """

    ratio: float
    disc: float
    supply: float
    stored: float
    lock_time: float
    work: float
    speed: float
    runs: int


def design(stored: float, lock_time: float) -> tuple[Design, Design]:
    """Return the bench as it is, and the best one.

    Args:
        stored: energy that the flywheel must hold after 1 s, in J.
        lock_time: time after which the clutch must have locked, in s.
    """
    drive = load(NETLIST)
    simulation = simulation_function(drive, INPUTS, OUTPUTS, until="1 s", any_sequence=True)
    begin = simulation.start_values
    first = _result(simulation(begin), begin, simulation.runs)
    relative = ca.MX.sym("relative", 2)
    results = simulation(relative * ca.DM(begin))
    limits = ca.vertcat(results[1] / stored, results[2] / lock_time, results[4] / LARGEST_SPEED)
    problem = {"x": relative, "f": results[0] / first.supply, "g": limits}
    quiet = {"print_level": 0, "sb": "yes"}
    options = {"ipopt": {"hessian_approximation": "limited-memory", "tol": 1e-7, **quiet}, "print_time": False}
    solver = ca.nlpsol("design", "ipopt", problem, options)
    found = solver(x0=[1.0, 1.0], lbx=0.2, ubx=2.0, lbg=[1.0, 0.0, 0.0], ubg=[np.inf, 1.0, 1.0])
    best = np.array(found["x"]).ravel() * begin
    return first, _result(simulation(best), best, simulation.runs)


def _result(values: ca.DM, inputs: np.ndarray, runs: int) -> Design:
    return Design(*map(float, inputs), *map(float, np.array(values).ravel()), runs)


if __name__ == "__main__":
    for title, one in zip(("bench", "best"), design(20.0, 0.8), strict=True):
        print(
            f"{title:6} ratio {one.ratio:.4f}   flywheel {one.disc * 1e6:7.1f} kg.mm2   supply {one.supply:6.2f} J   "
            f"stored {one.stored:5.2f} J   lock-up {one.lock_time:.4f} s   friction work {one.work:5.2f} J   "
            f"{one.runs} runs"
        )
