"""Blocks of control: against SciPy, closed forms and published numbers."""

from math import exp, log, pi, sin
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from components import (
    PI,
    PID,
    Constant,
    DeadZone,
    Derivative,
    FirstOrder,
    FrequencyMeter,
    Hysteresis,
    Integrator,
    Limiter,
    NormalNoise,
    P,
    PulseCounter,
    Quantizer,
    Ramp,
    SecondOrder,
    Sine,
    SlewRateLimiter,
    StateSpace,
    Step,
    TransferFunction,
    UniformNoise,
    VariableLimiter,
    ZeroOrderHold,
)
from components.blocks.sampled import Noise
from modelica_like import Assembly, Component, ModelicaLikeError, Solution, simulate
from modelica_like.errors import LanguageError, LimitPassed

TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-11}


def driven(
    block: Component, until: float = 4.0, *, name: str = "u", points: int = 200, **signals: Component
) -> Solution:
    connect = {key: [f"{key}.y", f"b.{name if key == 's' else key}"] for key in signals}
    return simulate(Assembly("d", parts={"b": block, **signals}, connect=connect), until, points=points, **TIGHT)


def away(run: Solution) -> np.ndarray:
    """Results that are not at an event."""
    moments = np.array([*(event.time for event in run.events), -1.0])
    return np.all(np.abs(run.time[:, None] - moments) > 1e-9, axis=1)


# -- linear ------------------------------------------------------------------------------------------------------------

NUM, DEN = (2.0, 0.5, 3.0), (1.5, 2.0, 4.0, 1.0)


@pytest.mark.parametrize(
    ("num", "den"), [(NUM, DEN), ((3.0,), (2.0, 1.0)), ((1.0, 2.0, 3.0), (2.0, 1.0, 4.0)), ((3.0,), (4.0,))]
)
def test_a_transfer_function(num: tuple[float, ...], den: tuple[float, ...]) -> None:
    run = driven(TransferFunction(num=num, den=den, k=2.0, time_scale=0.5), s=Sine(f=0.4))
    fine = np.linspace(0, 4, 40001)
    scaled = [[c * 0.5 ** (len(one) - 1 - k) for k, c in enumerate(one)] for one in (num, den)]
    signal = np.sin(0.8 * pi * fine)
    reference = lsim((2 * np.array(scaled[0]), scaled[1]), signal, fine)[1] if len(den) > 1 else 2 * 3 / 4 * signal
    np.testing.assert_allclose(run["b.y"], np.interp(run.time, fine, reference), atol=1e-6)


@pytest.mark.parametrize("wrong", [{"num": (1.0, 2.0), "den": (3.0,)}, {"den": (0.0, 1.0)}])
def test_what_is_no_transfer_function(wrong: dict[str, Any]) -> None:
    with pytest.raises(ModelicaLikeError, match="is no transfer function that can be computed"):
        TransferFunction(**wrong)


def test_followers_of_a_step() -> None:
    parts = [FirstOrder(T=0.5, k=3.0, y=0.0), SecondOrder(w=2.0, D=0.5, k=3.0, y=0.0, yd=0.0), Integrator(k=3.0, y=1.0)]
    first, second, third = (driven(one, s=Constant(k=2.0)) for one in parts)
    t = first.time
    np.testing.assert_allclose(first["b.y"], 6 * (1 - np.exp(-2 * t)), atol=1e-7)
    d = 2 * np.sqrt(0.75)
    np.testing.assert_allclose(second["b.y"], 6 * (1 - np.exp(-t) * (np.cos(d * t) + np.sin(d * t) / d)), atol=1e-7)
    np.testing.assert_allclose(third["b.y"], 1 + 6 * t, atol=1e-7)
    run = driven(Derivative(k=3.0, T=0.5, x=0.0), s=Ramp(height=8.0, duration=4.0))
    np.testing.assert_allclose(run["b.y"][:-1], 6 * (1 - np.exp(-2 * run.time[:-1])), atol=1e-7)


# -- controllers -------------------------------------------------------------------------------------------------------


def test_a_limited_pid_is_that_of_the_modelica_standard_library() -> None:
    """Plant y' = 2·u - y; the equations of Blocks.Continuous.LimPID by hand."""
    k, Ti, Td, Nd, Ni, wp, wd, low, high = 3.0, 0.5, 0.1, 8.0, 0.7, 0.8, 0.3, -0.2, 1.1

    def wanted(y: Any) -> float:
        plant, integral, x = y
        return k * (wp * 1.5 - plant + integral + Nd * (wd * 1.5 - plant - x)) + 0.1

    def rates(t: float, y: Any) -> list[float]:
        free = wanted(y)
        u = min(max(free, low), high)
        return [2 * u - y[0], (1.5 - y[0] + (u - free) / (k * Ni)) / Ti, (wd * 1.5 - y[0] - y[2]) * Nd / Td]

    pid = PID(
        k=k, Ti=Ti, Td=Td, Nd=Nd, Ni=Ni, wp=wp, wd=wd, y_min=low, y_max=high, u_ff=0.1, integral=0.0, smoothed=0.0
    )
    connect = {"a": ["wanted.y", "c.u_s"], "b": ["c.y", "plant.u"], "c": ["plant.y", "c.u_m"]}
    parts = {"c": pid, "plant": FirstOrder(T=1.0, k=2.0, y=0.0), "wanted": Constant(k=1.5)}
    drive = Assembly("d", parts=parts, connect=connect)
    run = simulate(drive, 4.0, **TIGHT)
    assert {event.after for event in run.events} >= {"free"}
    oracle = solve_ivp(rates, (0, 4), [0, 0, 0], rtol=1e-10, atol=1e-12, dense_output=True, max_step=0.002)
    for t in (0.2, 1.0, 2.0, 4.0):
        y = oracle.sol(t)
        assert [run.at(t)[n] for n in ("plant.y", "c.integral", "c.smoothed")] == pytest.approx(
            list(y), rel=1e-6, abs=1e-7
        )
        assert run.at(t)["c.y"] == pytest.approx(min(max(wanted(y), low), high), rel=1e-6)


def test_controllers_have_two_limits_and_feed_forward() -> None:
    p = driven(
        P(k=2.0, y_max=5.0, y_min=-1.0, u_m=0.0, u_ff=1.0), name="u_s", s=Ramp(offset=-4.0, height=8.0, duration=4.0)
    )
    np.testing.assert_allclose(p["b.y"], np.clip(2 * (2 * p.time - 4) + 1, -1, 5), atol=1e-9)
    pi_ = driven(PI(k=2.0, Ti=4.0, wp=0.5, u_m=1.0, integral=0.0), name="u_s", s=Constant(k=3.0))
    np.testing.assert_allclose(pi_["b.y"], 2 * (0.5 * 3 - 1 + 2 / 4 * pi_.time), atol=1e-9)


# -- kinks -------------------------------------------------------------------------------------------------------------


def test_a_variable_limiter() -> None:
    run = driven(
        VariableLimiter(), s=Sine(amplitude=2.0, f=0.5), limit1=Ramp(offset=0.5, height=1.0, duration=4.0),
        limit2=Constant(k=-1.0),
    )  # fmt: skip
    wanted = np.clip(2 * np.sin(pi * run.time), -1.0, 0.5 + 0.25 * run.time)
    np.testing.assert_allclose(run["b.y"], wanted, atol=1e-9)
    assert len(run.events) >= 7


def test_a_slew_rate_limiter() -> None:
    """2/s up and 1/s down; the last Td·rate of the way is exponential."""
    run = driven(SlewRateLimiter(rising=2.0, falling=-1.0, Td=0.01, y=0.0), s=Step(height=3.0, start_time=0.5))
    assert run.at(1.0)["b.y"] == pytest.approx(1.0, rel=1e-8)
    reached = 0.5 + (3.0 - 0.02) / 2.0
    assert run.at(reached + 0.02)["b.y"] == pytest.approx(3.0 - 0.02 * exp(-2), rel=1e-8)
    down = driven(SlewRateLimiter(rising=2.0, falling=-1.0, y=3.0), s=Constant(k=-10.0))
    np.testing.assert_allclose(down["b.y"], 3.0 - down.time, atol=1e-9)


@pytest.mark.parametrize(("zone", "low"), [({}, -0.5), ({"u_min": -0.2}, -0.2)])
def test_a_dead_zone(zone: dict[str, float], low: float) -> None:
    run = driven(DeadZone(u_max=0.5, **zone), s=Sine(f=0.5))
    u = np.sin(pi * run.time)
    np.testing.assert_allclose(run["b.y"], np.where(u > 0.5, u - 0.5, np.where(u < low, u - low, 0)), atol=1e-9)


def test_a_two_point_controller() -> None:
    run = driven(Hysteresis(u_low=-21.0, u_high=-19.0), s=Sine(offset=-20.0, amplitude=2.0, f=0.25), until=8.0)
    switched = [event.time for event in run.events]
    assert switched == pytest.approx([1 / 3, 2 + 1 / 3, 4 + 1 / 3, 6 + 1 / 3], rel=1e-8)
    assert run.at(1.0)["b.y"] == 1.0
    assert run.at(3.0)["b.y"] == 0.0


def test_a_quantizer() -> None:
    run = driven(Quantizer(q=0.25), s=Sine(f=0.5, amplitude=0.9))
    u = 0.9 * np.sin(pi * run.time)
    np.testing.assert_allclose(run["b.y"][away(run)], 0.25 * np.round(u / 0.25)[away(run)], atol=1e-12)
    jump = driven(Quantizer(q=0.001), s=Step(height=-5.0, start_time=1.0))
    assert jump.final["b.y"] == pytest.approx(-5.0, rel=1e-12)
    assert len(jump.events) == 2


def test_pulses_are_counted() -> None:
    run = driven(PulseCounter(u_high=0.5, u_low=-0.5), s=Sine(f=3.0))
    assert [run.at(t)["b.y"] for t in (0.02, 0.1, 1.0, 3.99)] == [0, 1, 3, 12]


# -- samples -----------------------------------------------------------------------------------------------------------


def test_sample_and_hold() -> None:
    run = driven(ZeroOrderHold(period=0.3, start_time=0.1), s=Sine(f=0.5))
    moments = [event.time for event in run.events if event.mode.startswith("b")]
    np.testing.assert_allclose(moments, 0.1 + 0.3 * np.arange(14), atol=1e-14)
    for t in (0.05, 0.2, 1.0, 3.9):
        last = 0.1 + 0.3 * np.floor((t - 0.1) / 0.3)
        assert run.at(t)["b.y"] == pytest.approx(sin(pi * last) if t > 0.1 else 0.0, abs=1e-12)
    parts = {"b": ZeroOrderHold(period=0.3), "s": Ramp(height=8.0, duration=4.0)}
    late = simulate(Assembly("d", parts=parts, connect={"s": ["s.y", "b.u"]}), 2.0, t0=1.0)
    assert [event.time for event in late.events if event.mode.startswith("b")] == pytest.approx([1.0, 1.2, 1.5, 1.8])


def test_a_frequency_meter_counts_pulses() -> None:
    parts = {
        "pulses": Sine(f=7.0),
        "counter": PulseCounter(u_high=0.5, u_low=-0.5),
        "b": FrequencyMeter(period=0.5, k=2.0),
    }
    connect = {"a": ["pulses.y", "counter.u"], "b": ["counter.y", "b.u"]}
    run = simulate(Assembly("d", parts=parts, connect=connect), 3.0, **TIGHT)
    assert [run.at(t)["b.y"] for t in (0.2, 0.75, 1.25, 2.75)] == pytest.approx([0, 2 * 8, 2 * 6, 2 * 8])


def test_noise_is_the_published_sequence() -> None:
    """`minstd_rand`: the 10,000th number from the seed 1 is 399268537 (ISO/IEC 14882, [rand.predef])."""
    state = 1
    for _ in range(9990):
        state = 48271 * state % 2147483647
    run = driven(UniformNoise(period=0.1, seed=state, y_min=0.0, y_max=2147483647.0), until=0.95)
    assert run.final["b.y"] == pytest.approx(399268537, abs=1e-6)


def test_noise_is_uniform_or_normal() -> None:
    uniform = driven(UniformNoise(period=0.01, y_min=-1.0, y_max=3.0, seed=7), until=19.995, points=2001)
    values = uniform["b.y"][away(uniform)]
    assert (values.min(), values.max()) == pytest.approx((-1, 3), abs=0.02)
    normal = driven(NormalNoise(period=0.01, mu=2.0, sigma=0.5, seed=7), until=19.995, points=2001)
    values = normal["b.y"][away(normal)][1:]
    # Mean and standard deviation of 2,000 numbers are within four of their own standard deviations.
    assert values.mean() == pytest.approx(2.0, abs=4 * 0.5 / 2000**0.5)
    assert values.std() == pytest.approx(0.5, abs=4 * 0.5 / 4000**0.5)
    assert log(np.mean((values - 2) ** 4)) == pytest.approx(log(3 * 0.5**4), abs=0.3)


A, B, C = ((0.0, 1.0), (-4.0, -0.4)), ((0.0, 1.0), (2.0, 0.0)), ((1.0, 0.0), (1.0, 1.0), (0.0, 3.0))
D = ((0.0, 0.5), (0.0, 0.0), (1.0, 0.0))


@pytest.mark.parametrize("through", [D, None])
def test_a_state_space(through: Any) -> None:
    """Two signals, three outputs; one starts away from zero."""
    block = StateSpace(A=A, B=B, C=C, time_scale=0.5, **({"D": through} if through else {}))
    block.set("x[2]", 0.7)
    parts = {"b": block, "one": Sine(f=0.4), "two": Ramp(height=2.0, duration=4.0)}
    connect = {"1": ["one.y", "b.u[1]"], "2": ["two.y", "b.u[2]"]}
    run = simulate(Assembly("d", parts=parts, connect=connect), 4.0, **TIGHT)
    fine = np.linspace(0, 4, 40001)
    signals = np.column_stack([np.sin(0.8 * pi * fine), fine / 2])
    system = (2 * np.array(A), 2 * np.array(B), np.array(C), np.array(through or np.zeros((3, 2))))
    reference = lsim(system, signals, fine, [0, 0.7])[1]
    for k in range(3):
        np.testing.assert_allclose(run[f"b.y[{k + 1}]"], np.interp(run.time, fine, reference[:, k]), atol=1e-6)


@pytest.mark.parametrize(("name", "told"), [("A", "give 1 of 1"), ("B", "give 2 of 1"), ("D", "give 1 of 1")])
def test_what_is_no_state_space(name: str, told: str) -> None:
    values = {"A": A, "B": ((1.0,), (0.0,)), "C": ((1.0, 0.0),)} | {name: ((1.0, 2.0, 3.0),)}
    if name == "B":
        values["B"] = ((1.0,),)
    with pytest.raises(ModelicaLikeError, match=told):
        StateSpace(**values)


@pytest.mark.parametrize(
    ("block", "told"),
    [
        (Limiter(y_max=-1.0), "b has its upper limit below its lower one"),
        (DeadZone(u_max=0.1, u_min=0.2), "b has its upper limit below its lower one"),
        (SlewRateLimiter(rising=-1.0, y=0.0), "b has its upper limit below its lower one"),
        (Hysteresis(u_low=1.0, u_high=-1.0), "b becomes 1 below where it becomes 0"),
        (PulseCounter(u_low=1.0, u_high=-1.0), "b has u_high below u_low"),
    ],
)
def test_crossed_limits_end_the_run(block: Component, told: str) -> None:
    with pytest.raises(LimitPassed, match=f"At 0 s {told}"):
        driven(block, s=Sine(f=0.5))


def test_limits_may_cross_later() -> None:
    with pytest.raises(LimitPassed, match="At 3 s b has its upper limit below its lower one"):
        driven(
            VariableLimiter(),
            s=Sine(f=0.5),
            limit1=Ramp(offset=2.0, height=-4.0, duration=4.0),
            limit2=Constant(k=-1.0),
        )


def test_noise_without_a_distribution_is_no_part() -> None:
    with pytest.raises(LanguageError, match="partial"):
        Noise(period=0.1)
