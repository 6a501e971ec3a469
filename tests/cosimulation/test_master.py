"""Masters with FMUs that are a few lines of Python: loops, rollback, steps too small, inputs that cannot move."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import exp, nan
from typing import Any

import pytest

from modelica_like.fmi.cosimulation.master import Balance, Master, Signal
from modelica_like.fmi.cosimulation.slaves import Refused


@dataclass
class Fake:
    """x' = u, y = gain x + direct u; its input moves on a line, where it can."""

    name: str = "fake"
    gain: float = 1.0
    direct: float = 0.0
    x: float = 0.0
    slopes: bool = True
    can_save: bool = True
    u: float = 0.0
    slope: float = 0.0
    saved: int = 0
    steps: list[tuple[float, float]] = field(default_factory=list)

    def set(self, name: str, value: float) -> None:
        assert name == "u"
        self.u = value

    def reader(self, names: Sequence[str]) -> Callable[[], list[float]]:
        return lambda: [self.output() for _ in names]

    def output(self) -> float:
        return self.gain * self.x + self.direct * self.u

    def give_slopes(self, names: Sequence[str], slopes: Sequence[float]) -> None:
        (self.slope,) = slopes

    def step(self, time: float, size: float) -> None:
        self.steps.append((time, size))
        self.x += self.u * size + self.slope * size**2 / 2
        self.u += self.slope * size

    def save(self) -> Any:
        self.saved += 1
        return self.x, self.u

    def load(self, state: Any) -> None:
        self.x, self.u = state

    def free(self, state: Any) -> None:
        self.saved -= 1


@dataclass
class Rows:
    """Keeps the times."""

    times: list[float] = field(default_factory=list)

    def look(self, time: float) -> float:
        return time

    def keep(self, row: float) -> None:
        self.times.append(row)


def loop(*fakes: Fake, **options: Any) -> Master:
    """Join all in a ring."""
    count = len(fakes)
    signals = [Signal((n, "y"), [((n + 1) % count, "u")]) for n in range(count)]
    slaves: Any = list(fakes)
    return Master(slaves, signals, [], **options)


@pytest.mark.parametrize(("linear", "order"), [(True, 2), (False, 1)])
@pytest.mark.parametrize("sequential", [False, True])
def test_growth_is_exponential(linear: bool, order: int, sequential: bool) -> None:
    """x' = y, y' = x with x = y = 1 at the start: both are exp(t)."""
    errors = []
    for step in (0.02, 0.01):
        fakes = Fake(x=1.0), Fake(x=1.0)
        master = loop(*fakes, linear=linear, sequential=sequential)
        master.begin(0.0)
        master.run_fixed(0.0, 1.0, step, Rows())
        errors.append(max(abs(fake.x - exp(1)) for fake in fakes))
    assert errors[0] / errors[1] == pytest.approx(2**order, rel=0.1)


def test_one_that_takes_no_slopes_gets_held_inputs() -> None:
    master = loop(Fake(x=1.0), Fake(x=1.0, slopes=False))
    master.begin(0.0)
    master.run_fixed(0.0, 1.0, 0.1, Rows())
    assert master.slaves[0].slope != 0.0  # type: ignore[attr-defined]
    assert master.slaves[1].slope == 0.0  # type: ignore[attr-defined]


def test_the_last_step_ends_at_the_end() -> None:
    rows, fake = Rows(), Fake()
    master = loop(fake, Fake())
    master.run_fixed(0.0, 1.0, 0.3, rows)
    assert rows.times == pytest.approx([0.3, 0.6, 0.9, 1.0])
    assert rows.times[-1] == 1.0
    assert master.counts.steps == 4
    assert master.counts.shortest == pytest.approx(0.1)


def test_a_loop_that_contracts_comes_to_rest() -> None:
    """y1 = x1 + u1/2, y2 = u2/2 with x1 = 1: y1 = 1/(1 - 1/4)."""
    master = loop(Fake(x=1.0, direct=0.5), Fake(direct=0.5))
    master.begin(0.0)
    assert master.signals[0].value == pytest.approx(4 / 3, rel=1e-9)


@pytest.mark.parametrize("direct", [1.0, -1.0, 1.1])
def test_a_loop_that_does_not_is_refused(direct: float) -> None:
    master = loop(Fake("first", x=1.0, direct=direct), Fake("second", direct=1.0))
    with pytest.raises(Refused) as told:
        master.begin(0.5)
    assert told.value.detail == {"kind": "not settled", "unit": "first", "name": "y", "time": 0.5}


def test_what_is_no_number_is_refused() -> None:
    with pytest.raises(Refused) as told:
        loop(Fake("first", x=nan), Fake()).begin(0.25)
    assert told.value.detail == {"kind": "not finite", "unit": "first", "name": "y", "time": 0.25}


@pytest.mark.parametrize("sequential", [False, True])
def test_a_variable_step_keeps_the_tolerance_of_a_step(sequential: bool) -> None:
    errors = []
    for tolerance in (1e-4, 1e-7):
        fakes, rows = (Fake(x=1.0), Fake(x=1.0)), Rows()
        master = loop(*fakes, sequential=sequential)
        master.begin(0.0)
        master.run_variable(0.0, 1.0, 0.5, tolerance, rows)
        errors.append(abs(fakes[0].x - exp(1)) / exp(1))
        assert rows.times[-1] == 1.0
        assert fakes[0].saved == 0, "every saved state is given back"
        assert master.counts.rejected > 0
    assert errors[0] < 1e-2
    assert errors[1] < 1e-4


def test_a_step_taken_back_leaves_nothing() -> None:
    fakes = Fake(x=1.0), Fake(x=1.0)
    master = loop(*fakes)
    master.begin(0.0)
    before = [dict(vars(signal)) for signal in master.signals], [fake.save() for fake in fakes]
    assert master._attempt(0.0, 0.5, 1e-9, Rows()) > 1
    assert ([vars(signal) for signal in master.signals], [fake.save() for fake in fakes]) == before


class Noisy(Fake):
    """Tells something else in every step, however short."""

    def step(self, time: float, size: float) -> None:
        super().step(time, size)
        self.x = float(len(self.steps) % 3)


def test_a_step_that_gets_too_small_is_refused() -> None:
    master = loop(Noisy(), Fake())
    master.begin(0.0)
    with pytest.raises(Refused) as told:
        master.run_variable(0.0, 1.0, 0.1, 1e-6, Rows())
    assert told.value.detail["kind"] == "step"


def test_both_powers_of_a_bond_are_equal_where_inputs_are_what_outputs_tell() -> None:
    """x' = 1 gives y = x linear in time, which straight lines carry without error once a slope is known."""
    master = loop(Fake(x=1.0, gain=0.0, direct=0.0), Fake(gain=0.0))
    master.balances.append(Balance(0, 1))
    master.begin(0.0)
    master.run_fixed(0.0, 1.0, 0.1, Rows())
    assert master.balances[0].residual == 0.0


def test_the_residual_is_the_difference_of_both_powers() -> None:
    """Flow 1, then 3; rate held at 2: the first FMU sends 2·(1 + 3)/2, the second is told 1 and gets 2."""
    balance = Balance(0, 1)
    flow = Signal((0, "tau"), [], used=(1.0, 0.0), reached=3.0)
    rate = Signal((1, "w"), [], used=(2.0, 0.0), reached=2.0)
    balance.add([flow, rate], [1.0, 2.0], 1.0)
    assert (balance.delivered, balance.received, balance.residual) == (4.0, 2.0, -2.0)
    assert (balance.throughput, balance.mismatch, balance.power) == (3.0, 2.0, 6.0)
