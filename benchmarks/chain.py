"""Elastic chain of N inertias: build time, and simulation against hand-written CasADi IDAS.

Run with `python benchmarks/chain.py [N …]`. The baseline takes CSparse, which is quicker than CasADi's default from
N = 50 and ten times as quick at N = 1000. Ratios are of CPU times in the same run, best of several; times are for
orientation only.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from components import Inertia, SpringDamper
from modelica_like import build, simulate
from modelica_like.language import Component, Equations, connect

RTOL, ATOL, POINTS, UNTIL = 1e-6, 1e-8, 100, 1.0
J, C, D = 0.1, 1000.0, 1.0


class Chain(Component):
    """N inertias joined by spring-dampers; the first one turns."""

    n: int = 10

    def build(self) -> None:
        """Make the masses and springs."""
        self.masses = [Inertia(J=J, w=1.0 if k == 0 else 0.0) for k in range(self.n)]
        self.springs = [SpringDamper(c=C, d=D, phi_rel=0.0) for _ in range(self.n - 1)]
        self.masses[0].phi = 0.0

    def equations(self) -> Equations:
        """Join them."""
        for left, spring, right in zip(self.masses, self.springs, self.masses[1:], strict=False):
            yield connect(left.flange_b, spring.flange_a)
            yield connect(spring.flange_b, right.flange_a)


def hand_written(n: int) -> tuple[ca.Function, list[float], list[float]]:
    """The same chain, written down by hand: angles and speeds as states."""
    phi, w = ca.SX.sym("phi", n), ca.SX.sym("w", n)
    inertia, c, d = ca.SX.sym("J", n), ca.SX.sym("c", n - 1), ca.SX.sym("d", n - 1)
    tau = c * (phi[1:] - phi[:-1]) + d * (w[1:] - w[:-1])
    acceleration = (ca.vertcat(tau, 0) - ca.vertcat(0, tau)) / inertia
    problem = {"x": ca.vertcat(phi, w), "p": ca.vertcat(inertia, c, d), "ode": ca.vertcat(w, acceleration)}
    grid = [UNTIL * k / POINTS for k in range(1, POINTS + 1)]
    options = {"reltol": RTOL, "abstol": ATOL, "linear_solver": "csparse"}
    function = ca.integrator("chain", "idas", problem, 0, grid, options)
    return function, [0.0] * n + [1.0] + [0.0] * (n - 1), [J] * n + [C] * (n - 1) + [D] * (n - 1)


def best(action: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Shortest CPU time of several runs, and the last result."""
    times: list[float] = []
    result: Any = None
    for _ in range(repeats):
        begin = time.process_time()
        result = action()
        times.append(time.process_time() - begin)
    return min(times), result


def measure(n: int) -> str:
    repeats = 7 if n <= 100 else 5 if n <= 1000 else 2
    chain = Chain(n=n)
    build_seconds, model = best(lambda: build(chain), repeats)
    options = {"rtol": RTOL, "atol": ATOL, "points": POINTS}
    simulate(model, UNTIL, **options)
    own_seconds, run = best(lambda: simulate(model, UNTIL, **options), repeats)
    _, (function, x0, p) = best(lambda: hand_written(n), repeats)
    function(x0=x0, p=p)
    hand_seconds, result = best(lambda: function(x0=x0, p=p), repeats)
    difference = float(
        np.max(np.abs(np.array(result["xf"])[n:, -1] - [run.final[f"masses[{k}].w"] for k in range(1, n + 1)]))
    )
    return (
        f"{n:6d}  build {build_seconds:8.3f} s ({build_seconds / n * 1e3:6.3f} ms per link)   "
        f"simulate {own_seconds * 1e3:9.2f} ms   hand-written {hand_seconds * 1e3:9.2f} ms   "
        f"ratio {own_seconds / hand_seconds:5.2f}   "
        f"largest difference in speed {difference:.1e} rad/s"
    )


def main(sizes: list[int]) -> None:
    build(Chain(n=3))
    for n in sizes:
        sys.stdout.write(measure(n) + "\n")
        sys.stdout.flush()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    sys.stdout.write(f"peak memory {memory:.0f} MB\n")


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or [10, 100, 1000])
