"""What one of very many events costs, with both solvers, against the same segments by hand.

Run with `python benchmarks/events.py [number of events]`. A relay with hysteresis drives an integrator up and down
(state events); a sawtooth jumps back whenever it is full (state events with resets). By hand: one call of CasADi's IDAS
for each segment, through its buffer, with the event times known. CPU time.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any, cast

import casadi as ca
import numpy as np

from modelica_like import Options, build, simulate
from modelica_like.language import Component, Equations, Events, Mode, Parameter, Variable, der, param, var

DEFAULT = 10_000


class Relay(Component):
    """x goes up to 1, down to -1, and so on."""

    x: Variable = var("1", "error")
    T: Parameter = param("s", "time", default=1.0)
    state = Mode("up", "down")

    def equations(self) -> Equations:  # noqa: D102
        yield self.T * der(self.x) == self.state.choose(up=1, down=-1)

    def events(self) -> Events:  # noqa: D102
        yield self.state.go("up", "down", when=self.x > 1)
        yield self.state.go("down", "up", when=self.x < -1)


class Sawtooth(Component):
    """x goes up to 1 and jumps to 0."""

    x: Variable = var("1", "charge")
    T: Parameter = param("s", "time", default=1.0)
    state = Mode("charging", "full")

    def equations(self) -> Equations:  # noqa: D102
        yield self.T * der(self.x) == 1

    def events(self) -> Events:  # noqa: D102
        yield self.state.go("charging", "full", when=self.x > 1, reset={self.x: 0.0})
        yield self.state.go("full", "charging", when=self.x < 0.5)


def by_hand(count: int, jumps: bool) -> None:
    """Integrate as many segments of either drive, whose ends are known."""
    x, p = ca.SX.sym("x"), ca.SX.sym("p", 2)
    integrator = ca.integrator("segment", "idas", {"x": x, "p": p, "ode": p[0] * p[1]}, 0, 1,
                               {"reltol": 1e-7, "abstol": 1e-9, "step0": 1e-5})  # fmt: skip
    buffer, evaluate = integrator.buffer()
    state, known, end = np.zeros(1), np.zeros(2), np.zeros(1)
    buffer.set_arg(0, memoryview(cast(Any, state)))
    buffer.set_arg(2, memoryview(cast(Any, known)))
    buffer.set_res(0, memoryview(cast(Any, end)))
    for k in range(count):
        known[:] = (1.0, 1.0) if jumps else (1.0 if k == 0 else 2.0, (-1.0) ** k)
        evaluate()
        state[:] = 0.0 if jumps else end


def cpu(action: Callable[[], Any]) -> tuple[float, Any]:
    """Return the CPU time of an action in s, and its result."""
    begin = time.process_time()
    result = action()
    return time.process_time() - begin, result


def measure(kind: type[Component], count: int, period: float) -> str:
    """Compare both solvers with the loop by hand."""
    model, end = build(kind(x=0.0)), count * period
    hand, _ = cpu(lambda: by_hand(count, kind is Sawtooth))
    told = [f"{kind.__name__:9s} by hand {hand / count * 1e3:6.3f} ms per event"]
    for solver in ("idas", "native"):
        options: dict[str, Any] = {"solver": solver, "options": Options(max_events=3 * count)}
        simulate(model, 10.0, **options)
        spent, run = cpu(partial(simulate, model, end, **options))
        events = len({one.time for one in run.events})
        each, ratio = spent / events * 1e3, spent / hand
        told.append(f"{solver} {events} events in {spent:6.2f} s, {each:6.3f} ms each, ratio {ratio:5.2f}")
    return "; ".join(told)


def main(count: int) -> None:
    for kind, period in ((Relay, 2.0), (Sawtooth, 1.0)):
        sys.stdout.write(measure(kind, count, period) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT)
