"""Large drives with clutches, backlash and gears: how build and runs grow with the number of parts.

Run with `python benchmarks/large.py [parts] [factor]`. A random tree of parts is built and run with `parts` and with
`factor` times as many, in both integrators. What grows linearly has a ratio of about the factor. The number of events
grows like the drive, and each of them begins all of it anew: so a run grows with the square of the factor, but no
faster. Times are CPU times, for orientation only.
"""

from __future__ import annotations

import random
import resource
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from components import Clutch, ElastoBacklash, IdealGear, Inertia, SpringDamper
from modelica_like import build, simulate
from modelica_like.language import Component, Equations, connect
from modelica_like.simulation import Solver

SEED, UNTIL = 1, 0.1
SOLVERS: tuple[Solver, ...] = ("native", "idas")
_NEAR = 30
"""The last inertias, to which the next one may be joined."""


class Drive(Component):
    """Inertias, each joined to one of the last by a spring, a gear with a spring, a clutch or backlash."""

    n: int = 100

    def build(self) -> None:
        """Make the parts."""
        chance = random.Random(SEED)
        members: list[Any] = [self.inertia(chance)]
        joined: list[tuple[int, int]] = []
        heads = [0]
        while len(members) < self.n - 3:
            last = chance.choice(heads[-_NEAR:])
            for part in (*self.link(chance), self.inertia(chance)):
                members.append(part)
                joined.append((last, len(members) - 1))
                last = len(members) - 1
            heads.append(last)
        self.members, self._joined = members, tuple(joined)

    @staticmethod
    def inertia(chance: random.Random) -> Component:
        """An inertia that turns."""
        return Inertia(J=chance.uniform(0.5, 2), phi=0.0, w=chance.uniform(0, 20))

    @staticmethod
    def link(chance: random.Random) -> tuple[Component, ...]:
        """What joins two inertias."""
        kind, d = chance.random(), chance.uniform(1, 5)
        if kind < 0.2:
            return (Clutch(capacity=chance.uniform(1, 20)),)
        if kind < 0.4:
            return (ElastoBacklash(c=chance.uniform(500, 3000), d=d, b=chance.uniform(0.01, 0.1)),)
        spring = SpringDamper(c=chance.uniform(200, 2000), d=d)
        return (spring,) if kind < 0.75 else (IdealGear(ratio=chance.choice([0.5, 2, 1.5, -1])), spring)

    def equations(self) -> Equations:
        """Join them."""
        for left, right in self._joined:
            yield connect(self.members[left].flange_b, self.members[right].flange_a)


def timed(action: Callable[[], Any]) -> tuple[float, Any]:
    """CPU time in s, and the result."""
    begin = time.process_time()
    result = action()
    return time.process_time() - begin, result


def measure(n: int) -> dict[str, float]:
    """Build and run a drive; CPU times in s, and what there was to do."""
    found: dict[str, float] = {}
    found["build"], model = timed(lambda: build(Drive(n=n)))
    for solver in SOLVERS:
        found[f"prepare {solver}"], _ = timed(partial(simulate, model, 1e-6, solver=solver))
        found[f"run {solver}"], run = timed(partial(simulate, model, UNTIL, solver=solver))
        found[f"events {solver}"] = len(run.events)
        found[f"energy {solver}"], _ = timed(run.energy)
    found["memory, MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return found


def main(parts: int = 100, factor: int = 10) -> None:
    build(Drive(n=20))
    small, large = measure(parts), measure(parts * factor)
    sys.stdout.write(f"{'':16s} {parts:10d} {parts * factor:10d}  ratio\n")
    for name, value in small.items():
        sys.stdout.write(f"{name:16s} {value:10.3f} {large[name]:10.3f}  {large[name] / max(value, 1e-9):5.1f}\n")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
