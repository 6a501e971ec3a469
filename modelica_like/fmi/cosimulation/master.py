"""Masters: order, inputs and lengths of the steps of FMUs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil, inf, isfinite
from typing import Any, Protocol

from modelica_like.fmi.cosimulation.slaves import Refused, Slave
from modelica_like.fmi.cosimulation.system import Energies

Row = Any
Memory = list[dict[str, Any]]

_NOT_FINITE, _UNSTABLE = "not finite", "unstable"
_DECADES, _WILD = 10, 0.5
"""A run ends where the energy through a bond grows so many times tenfold, and differs by this share all the time."""
_ROUNDS = 50
_SETTLED = 1e-10
_SAFETY, _SHORTEST, _LONGEST = 0.9, 0.2, 2.0
_RESOLUTION = 1e-9
_SMALLEST = 1e-9
_SMALL = 1e-3


class Observer(Protocol):
    """Recorder of a run: it looks at a row when FMUs are at its time, and keeps the row when the step is accepted."""

    def look(self, time: float) -> Row:
        """Read a row."""
        ...

    def keep(self, row: Row) -> None:
        """Keep a row."""
        ...


@dataclass
class Signal:
    """One connection while it runs.

    Attributes:
        source: number of the FMU with the output, and the variable's name.
        targets: the same for the inputs.
        value: at the last communication point.
        slope: of the last step.
        used: value at the beginning of the step and slope, as given to the targets.
        reached: value at the end of the step, before outputs follow the new inputs.
        nominal: magnitude below which the value does not matter.
    """

    source: tuple[int, str]
    targets: list[tuple[int, str]]
    nominal: float = 1.0
    value: float = 0.0
    slope: float = 0.0
    used: tuple[float, float] = (0.0, 0.0)
    reached: float = 0.0
    largest: float = 0.0


@dataclass
class Balance(Energies):
    """Energy at a bond of two signals.

    Attributes:
        flow, rate: numbers of the signals.
        name: of the bond.
        power: at the last communication point, in W.
        mark: throughput and mismatch when the throughput had last grown tenfold, in J.
        wild: how often in a row it has done so while both sides disagreed.
    """

    flow: int
    rate: int
    name: str = ""
    power: float = 0.0
    mark: tuple[float, float] = (0.0, 0.0)
    wild: int = 0

    def add(self, signals: Sequence[Signal], before: Sequence[float], size: float) -> None:
        """Add a step, by the trapezoidal rule."""
        flow, rate = signals[self.flow], signals[self.rate]
        used = [_moved(flow.used, size), _moved(rate.used, size)]
        delivered = (before[self.flow] * rate.used[0] + flow.reached * used[1]) * size / 2
        received = (flow.used[0] * before[self.rate] + used[0] * rate.reached) * size / 2
        self.delivered += delivered
        self.received += received
        self.throughput += (abs(delivered) + abs(received)) / 2
        self.mismatch += abs(received - delivered)
        if self.throughput > 10.0 * self.mark[0]:
            through, differing = self.throughput - self.mark[0], self.mismatch - self.mark[1]
            self.wild = self.wild + 1 if differing > _WILD * through else 0
            self.mark = self.throughput, self.mismatch
        self.power = flow.reached * rate.reached

    def told(self) -> list[float]:
        """Return the power and the energies."""
        return [self.power, self.delivered, self.received, self.throughput, self.mismatch]


@dataclass
class Counts:
    """Counts of a run: communication steps, rejected steps, the shortest and the longest."""

    steps: int = 0
    rejected: int = 0
    shortest: float = float("inf")
    longest: float = 0.0

    def add(self, size: float) -> None:
        """Count a step."""
        self.steps += 1
        self.shortest, self.longest = min(self.shortest, size), max(self.longest, size)


@dataclass
class Master:
    """Steps all FMUs of a system together.

    Attributes:
        slaves: in the order of a Gauss-Seidel master.
        signals: the connections, and what else a variable step watches, without targets.
        balances: energies at the bonds.
        sequential: Gauss-Seidel instead of Jacobi.
        linear: inputs are interpolated linearly if FMUs support it.
    """

    slaves: Sequence[Slave]
    signals: list[Signal]
    balances: list[Balance]
    sequential: bool = False
    linear: bool = True
    counts: Counts = field(default_factory=Counts)

    def __post_init__(self) -> None:
        self._given = [[k for k, s in enumerate(self.signals) if s.source[0] == n] for n in range(len(self.slaves))]
        self._read = [
            slave.reader([self.signals[k].source[1] for k in given])
            for slave, given in zip(self.slaves, self._given, strict=True)
        ]
        self._taken = [
            [(k, name) for k, s in enumerate(self.signals) for unit, name in s.targets if unit == n]
            for n in range(len(self.slaves))
        ]
        self._moves = [self.linear and all(self.slaves[n].slopes for n, _ in s.targets) for s in self.signals]

    # -- values at a communication point -----------------------------------------------------------------------------

    def begin(self, time: float) -> None:
        """Read all outputs, and settle."""
        for n in range(len(self.slaves)):
            self._outputs(n, time)
        self.settle(time)

    def settle(self, time: float) -> None:
        """Pass outputs to inputs until they settle: some outputs depend directly on inputs."""
        moved: list[Signal] = []
        for _ in range(_ROUNDS):
            for slave, taken in zip(self.slaves, self._taken, strict=True):
                for k, name in taken:
                    slave.set(name, self.signals[k].value)
            before = [signal.value for signal in self.signals]
            for n in range(len(self.slaves)):
                self._outputs(n, time)
            moved = [
                signal
                for old, signal in zip(before, self.signals, strict=True)
                if not abs(signal.value - old) <= _SETTLED * max(abs(old), signal.nominal)
            ]
            if not moved:
                return
        n, name = moved[0].source
        raise Refused(kind="not settled", unit=self.slaves[n].name, name=name, time=time)

    def _outputs(self, n: int, time: float) -> None:
        if not self._given[n]:
            return
        for k, value in zip(self._given[n], self._read[n](), strict=True):
            signal = self.signals[k]
            if not isfinite(value):
                raise Refused(kind=_NOT_FINITE, unit=self.slaves[n].name, name=signal.source[1], time=time)
            signal.value = value

    # -- one step ----------------------------------------------------------------------------------------------------

    def step(self, time: float, size: float) -> None:
        """Step all FMUs from one communication point to the next."""
        before = [signal.value for signal in self.signals]
        for signal, moves in zip(self.signals, self._moves, strict=True):
            signal.used = (signal.value, signal.slope if moves else 0.0)
        for n, slave in enumerate(self.slaves):
            for k, name in self._taken[n]:
                slave.set(name, self.signals[k].used[0])
            moving = [(name, self.signals[k].used[1]) for k, name in self._taken[n] if self._moves[k]]
            if moving:
                slave.give_slopes(*zip(*moving, strict=True))
            slave.step(time, size)
            if self.sequential:
                self._outputs(n, time + size)
                self._tell_later(n, before, size)
        if not self.sequential:
            for n in range(len(self.slaves)):
                self._outputs(n, time + size)
        for signal in self.signals:
            signal.reached = signal.value
        for balance in self.balances:
            balance.add(self.signals, before, size)
            if balance.wild >= _DECADES:
                raise Refused(kind=_UNSTABLE, bond=balance.name, time=time + size, size=size)
        self.settle(time + size)
        for signal, old in zip(self.signals, before, strict=True):
            signal.slope = (signal.value - old) / size
            signal.largest = max(signal.largest, abs(signal.value))

    def _tell_later(self, n: int, before: Sequence[float], size: float) -> None:
        """Pass the results of an FMU to those that step after it."""
        for k in self._given[n]:
            signal = self.signals[k]
            if any(unit > n for unit, _ in signal.targets):
                rise = (signal.value - before[k]) / size
                signal.used = (before[k], rise) if self._moves[k] else (signal.value, 0.0)

    # -- many steps --------------------------------------------------------------------------------------------------

    def run_fixed(self, start: float, stop: float, step: float, observer: Observer) -> None:
        """Step with a fixed step; the last one ends at the end."""
        count = max(1, ceil((stop - start) / step * (1 - _RESOLUTION)))
        time = start
        for k in range(1, count + 1):
            after = stop if k == count else start + k * step
            self.step(time, after - time)
            self.counts.add(after - time)
            observer.keep(observer.look(after))
            time = after

    def run_variable(self, start: float, stop: float, step: float, tolerance: float, observer: Observer) -> None:
        """Step such that a step and two halves of it agree; the halves are kept."""
        time, size = start, step
        order = 2 if self.linear and all(slave.slopes for slave in self.slaves) else 1
        resolution = _RESOLUTION * (stop - start)
        while stop - time > resolution:
            last = time + size >= stop - resolution
            size = stop - time if last else size
            error = self._attempt(time, size, tolerance, observer)
            if error <= 1:
                time = stop if last else time + size
                observer.keep(observer.look(time))
            elif size < _SMALLEST * (stop - start):
                raise Refused(kind="step", time=time)
            change = _SAFETY * error ** (-1 / (order + 1)) if error > 0 else _LONGEST
            size *= min(max(change, _SHORTEST), _LONGEST)

    def _attempt(self, time: float, size: float, tolerance: float, observer: Observer) -> float:
        """Try a step; return its error over the tolerance. The step is rejected if that is above one."""
        begin, states = self._memory(), [slave.save() for slave in self.slaves]
        try:
            error, middle = self._once_and_halved(time, size, tolerance, states, begin, observer)
            if not error <= 1:
                self._back(states, begin)
                self.counts.rejected += 1
                return error
        finally:
            for slave, state in zip(self.slaves, states, strict=True):
                slave.free(state)
        observer.keep(middle)
        self.counts.add(size / 2)
        self.counts.add(size / 2)
        return error

    def _once_and_halved(
        self, time: float, size: float, tolerance: float, states: Sequence[Any], begin: Memory, observer: Observer
    ) -> tuple[float, Row]:
        """Take a step, go back, and take it in halves; return the difference, and the row in the middle."""
        try:
            self.step(time, size)
            once = [signal.value for signal in self.signals]
            self._back(states, begin)
            self.step(time, size / 2)
            middle = observer.look(time + size / 2)
            self.step(time + size / 2, size / 2)
        except Refused as refusal:
            if refusal.detail["kind"] not in (_NOT_FINITE, _UNSTABLE):
                raise
            return inf, None  # a shorter step may succeed
        pairs = zip(self.signals, once, strict=True)
        errors = [abs(s.value - other) / (tolerance * max(s.largest, _SMALL * s.nominal)) for s, other in pairs]
        return max(errors, default=0.0), middle

    def _memory(self) -> Memory:
        return [dict(vars(item)) for item in (*self.signals, *self.balances)]

    def _back(self, states: Sequence[Any], memory: Memory) -> None:
        for slave, state in zip(self.slaves, states, strict=True):
            slave.load(state)
        for item, values in zip((*self.signals, *self.balances), memory, strict=True):
            vars(item).update(values)


def _moved(used: tuple[float, float], size: float) -> float:
    value, slope = used
    return value + slope * size
