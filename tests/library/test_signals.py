"""Signals: their values, and time events exactly where they jump or have a kink."""

from math import pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from components import (
    CoilForce,
    Constant,
    Inertia,
    Product,
    Pulse,
    Ramp,
    Sine,
    Step,
    Table,
    TimeFormula,
    Torque,
    TorqueStep,
    Trapezoid,
)
from modelica_like import Assembly, Component, Solution, simulate
from modelica_like.errors import LanguageError, ModelicaLikeError, NetlistError


def torque_of(signal: Component, until: float = 2.0, **options: Any) -> Solution:
    """Run a drive whose torque is the signal."""
    parts = {"signal": signal, "torque": Torque(), "mass": Inertia(J=1.0, phi=0.0, w=0.0)}
    return simulate(
        Assembly(
            "drive", parts=parts, series={"shaft": ["torque", "mass"]}, connect={"drive": ["signal.y", "torque.tau"]}
        ),
        until,
        **options,
    )


def moments(run: Solution, part: str = "signal") -> list[float]:
    """Times of its events, but for the one that tells that its table has ended."""
    return [one.time for one in run.events if one.mode.startswith(f"{part}.") and one.mode != f"{part}.end"]


def pulse(t: float) -> float:
    return 1.0 + (2.0 if t >= 0.3 and (t - 0.3) % 0.5 < 0.2 else 0.0)


def trapezoid(t: float) -> float:
    return float(np.interp((t - 0.1) % 0.8, [0, 0.1, 0.3, 0.4, 0.8], [0, 3, 3, 0, 0])) - 1.0 if t >= 0.1 else -1.0


CASES = [
    (Constant(k="3 N.m"), lambda t: 3.0, []),
    (Step(height="2 N.m", offset="1 N.m", start_time=0.7), lambda t: 3.0 if t >= 0.7 else 1.0, [0.7]),
    (
        Ramp(height="4 N.m", duration=0.5, offset="-1 N.m", start_time=0.3),
        lambda t: -1 + 4 * min(max((t - 0.3) / 0.5, 0), 1),
        [0.3, 0.8],
    ),
    (
        Sine(amplitude="2 N.m", f=3.0, phase="30 deg", offset="1 N.m", start_time=0.4),
        lambda t: 1 + (2 * np.sin(6 * pi * (t - 0.4) + pi / 6) if t >= 0.4 else 0),
        [0.4],
    ),
    (
        CoilForce(amplitude="5 N.m", T=0.2, start_time=0.3),
        lambda t: 5 * (1 - np.exp(-(t - 0.3) / 0.2)) ** 2 if t >= 0.3 else 0.0,
        [0.3],
    ),
    (
        CoilForce(amplitude="5 N.m", T=0.2, start_time=0.3, stop_time=0.7, T_off="40 ms"),
        lambda t: (
            0.0
            if t < 0.3
            else 5 * (1 - np.exp(-(t - 0.3) / 0.2)) ** 2
            if t < 0.7
            else 5 * ((1 - np.exp(-2)) * np.exp(-(t - 0.7) / 0.04)) ** 2
            if t < 0.7 + 0.36 * np.log(10)
            else 0.0
        ),
        [0.3, 0.7, 0.7 + 0.36 * np.log(10)],
    ),
    (
        Pulse(amplitude="2 N.m", period=0.5, width=0.4, offset="1 N.m", start_time=0.3),
        pulse,
        [0.3, 0.5, 0.8, 1.0, 1.3, 1.5, 1.8, 2.0],
    ),
    (
        Trapezoid(amplitude="3 N.m", period=0.8, rising=0.1, width=0.2, falling=0.1, offset="-1 N.m", start_time=0.1),
        trapezoid,
        [0.1, 0.2, 0.4, 0.5, 0.9, 1.0, 1.2, 1.3, 1.7, 1.8, 2.0],
    ),
    (TimeFormula(formula="2*sin(3*time) + max(time, 1)", scale="1 N.m"), lambda t: 2 * np.sin(3 * t) + max(t, 1), []),
    (TimeFormula(formula="time**2", scale="1 N.m", time_scale="0.1 s"), lambda t: 100 * t**2, []),
    (
        Table(table=((0, 0), (0.5, 2), (1.5, -1)), scale="1 N.m"),
        lambda t: np.interp(t, [0, 0.5, 1.5, 2.0], [0, 2, -1, -1]),
        [0, 0.5, 1.5],
    ),
    (Table(table=((0, 1), (500, 3)), scale="2 N.m", time_scale="1 ms"), lambda t: 2 + 8 * min(t, 0.5), [0, 0.5]),
    (
        Table(table=((0, 1), (500, 3)), scale="2 N.m", time_scale="1 ms", extrapolate="linear"),
        lambda t: 2 + 8 * t,
        [0, 0.5],
    ),
]


@pytest.mark.parametrize(("signal", "formula", "events"), CASES, ids=lambda value: type(value).__name__)
def test_values_and_moments(signal: Component, formula: Any, events: list[float]) -> None:
    run = torque_of(signal)
    np.testing.assert_allclose(moments(run), events, rtol=0, atol=1e-15 * 4)
    away = np.all(np.abs(run.time[:, None] - np.array([*events, -1.0])) > 1e-9, axis=1)
    expected = [formula(t) for t in run.time[away]]
    np.testing.assert_allclose(run["signal.y"][away], expected, atol=1e-12)


@pytest.mark.parametrize(
    "factory",
    [lambda: Step(height="1 N.m", start_time=0.7), lambda: Ramp(height="1 N.m", duration=0.4, start_time=0.3)],
)
def test_both_sides_of_an_event_are_in_the_results(factory: Any) -> None:
    run = torque_of(factory())
    for moment in moments(run):
        assert np.count_nonzero(run.time == moment) == 2


def test_a_signal_that_has_started_before() -> None:
    for signal, value in (
        (Step(height="2 N.m", start_time=-1.0), 2.0),
        (Ramp(height="2 N.m", duration=1.0, start_time=-0.5), 1.0),
        (Ramp(height="2 N.m", duration=1.0, start_time=-5.0), 2.0),
        (Sine(amplitude="2 N.m", f=1.0, start_time=-0.25), 2.0),
    ):
        assert torque_of(signal, 0.1)["signal.y"][
            -1 if value == 2.0 and isinstance(signal, Step) else 0
        ] == pytest.approx(value)


@pytest.mark.parametrize(("periods", "expected"), [(0, []), (1, [0.1]), (3, [0.1, 0.2, 0.3, 0.4, 0.5]), (-1, None)])
def test_number_of_pulses(periods: int, expected: list[float] | None) -> None:
    run = torque_of(Pulse(amplitude="1 N.m", period=0.2, periods=periods), 1.0)
    if expected is None:
        expected = [0.1 * k for k in range(1, 11)]  # it starts high: that is no event
    np.testing.assert_allclose(moments(run), expected, atol=1e-15)


def test_pulses_of_full_and_no_width() -> None:
    assert torque_of(Pulse(amplitude="1 N.m", period=0.2, width=1.0), 0.95).final["mass.w"] == pytest.approx(
        0.95, rel=1e-9
    )
    assert torque_of(Pulse(amplitude="1 N.m", period=0.2, width=0.0), 0.95).final["mass.w"] == pytest.approx(
        0.0, abs=1e-12
    )


def test_the_impulse_of_pulses_is_exact() -> None:
    """No solver step crosses a flank: so the speed after 1,000 pulses is that of the closed form."""
    run = torque_of(Pulse(amplitude="1 N.m", period=0.002, width=0.25), 2.0, points=100)
    assert run.final["mass.w"] == pytest.approx(1000 * 0.0005, rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(
    rows=st.lists(st.tuples(st.floats(0.01, 0.5), st.floats(-10, 10)), min_size=2, max_size=6),
    at=st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3),
)  # fmt: skip
def test_tables_linear_and_smooth(rows: list[tuple[float, float]], at: list[float]) -> None:
    times = np.cumsum([step for step, _ in rows])
    values = np.array([value for _, value in rows])
    table = tuple(zip(times.tolist(), values.tolist(), strict=True))
    until = float(times[-1])
    for smooth in (False, True):
        run = torque_of(Table(table=table, scale="1 N.m", smooth=smooth), until, points=50)
        for part in at:
            t = float(times[0] + part * (times[-1] - times[0]))
            value = run.at(t)["signal.y"]
            if not smooth:
                assert value == pytest.approx(np.interp(t, times, values), abs=1e-9)
            k = min(int(np.searchsorted(times, t, side="right")) - 1, len(times) - 2)
            assert min(values[k : k + 2]) - 1e-9 <= value <= max(values[k : k + 2]) + 1e-9


def test_smooth_table_has_the_slopes_of_fritsch_and_butland() -> None:
    """SciPy's PCHIP has the same inner slopes; its end slopes differ, so compare between the inner rows."""
    times, values = [0.0, 0.2, 0.5, 0.9, 1.0], [0.0, 1.0, 1.2, 3.0, 3.1]
    run = torque_of(Table(table=tuple(zip(times, values, strict=True)), scale="1 N.m", smooth=True), 1.0)
    reference = PchipInterpolator(times, values)
    for t in (0.25, 0.4, 0.6, 0.85):
        assert run.at(t)["signal.y"] == pytest.approx(float(reference(t)), abs=1e-9)


def test_a_long_table_and_a_late_start() -> None:
    table = tuple((0.01 * k, (-1.0) ** k) for k in range(60))
    run = torque_of(Table(table=table, scale="1 N.m"), 0.5, t0=0.305)
    np.testing.assert_allclose(moments(run), [0.305, *(0.01 * k for k in range(31, 51))], atol=1e-12)


@pytest.mark.parametrize("table", [((0.0, 1.0), (0.0, 2.0)), ((1.0, 0.0), (0.5, 1.0))])
def test_tables_must_increase(table: Any) -> None:
    with pytest.raises(NetlistError, match="is not above"):
        torque_of(Table(table=table, scale="1 N.m"))


def test_formula_is_not_python() -> None:
    for text in ("__import__('os')", "time.real", "open('x')", "foo"):
        with pytest.raises(ModelicaLikeError):
            torque_of(TimeFormula(formula=text, scale="1 N.m"))
    with pytest.raises(LanguageError, match="uses 'speed', but it can use only `time`"):
        torque_of(TimeFormula(formula="2*speed", scale="1 N.m"))


def test_product_multiplies_units_too() -> None:
    parts = {
        "torque": Torque(),
        "mass": Inertia(J=1.0, phi=0.0, w=0.0),
        "share": Step(height=0.5, start_time=0.5),
        "full": Constant(k="8 N.m"),
        "product": Product(),
    }
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["torque", "mass"]},
        connect={"a": ["share.y", "product.u1"], "b": ["full.y", "product.u2"], "c": ["product.y", "torque.tau"]},
    )  # fmt: skip
    assert simulate(drive, 1.0).final["mass.w"] == pytest.approx(2.0, rel=1e-9)


def test_torque_step_has_its_own_time_event() -> None:
    parts = {
        "torque": TorqueStep(step_torque=4.0, offset_torque=1.0, start_time=0.3),
        "mass": Inertia(J=1.0, phi=0.0, w=0.0),
    }
    run = simulate(Assembly("drive", parts=parts, series={"shaft": list(parts)}), 1.0)
    assert moments(run, "torque") == [0.3]
    assert run.final["mass.w"] == pytest.approx(1.0 + 4.0 * 0.7, rel=1e-9)


@pytest.mark.parametrize("t0", [3.0, 3.03, 250.01])
@pytest.mark.parametrize("kind", [Pulse, Trapezoid])
def test_pulses_of_a_run_that_starts_late(kind: type[Component], t0: float) -> None:
    """Thousands of periods late the signal is where it would have been: the impulse of each full period is the same."""
    shape = {"width": 0.3} if kind is Pulse else {"rising": 0.01, "width": 0.02, "falling": 0.01}
    area = 2.0 * 0.03
    run = torque_of(kind(amplitude="2 N.m", period=0.1, **shape), t0 + 0.5, t0=t0, rtol=1e-9)
    for periods in (1, 3, 5):
        assert run.at(t0 + 0.1 * periods)["mass.w"] == pytest.approx(area * periods, rel=1e-8)
    begin = 0.1 * (round(t0 / 0.1) + 2)
    for elapsed, value in ((0.02, 2.0), (0.05, 0.0)):
        assert run.at(begin + elapsed)["signal.y"] == value


def test_pulses_that_are_over_before_a_late_start() -> None:
    run = torque_of(Pulse(amplitude="2 N.m", period=0.1, periods=25), 50.5, t0=50.0)
    assert np.all(run["mass.w"] == 0.0)
    assert run.final["signal.done"] == 25


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize(
    ("rising", "width", "falling"),
    [(0.1, 0.2, 0.3), (0.1, 0.5, 0.3), (0.5, 0.1, 0.1), (0.1, 0.3, 0.1), (0.4, 0.1, 0.1)],
)
@pytest.mark.parametrize("t0", [0.0, 0.85])
def test_a_trapezoid_longer_than_its_period_begins_anew(
    rising: float, width: float, falling: float, t0: float, solver: str
) -> None:
    """As the standard library has it; the impulse of one period of 0.4 s, in parts of a polygon."""
    signal = Trapezoid(amplitude="1 N.m", period=0.4, rising=rising, width=width, falling=falling)
    run = torque_of(signal, t0 + 2.0, t0=t0, solver=solver, rtol=1e-9)
    times = np.array([0.0, rising, rising + width, rising + width + falling])
    corners = np.append(times[times < 0.4], 0.4)
    impulse = 5 * np.trapezoid(np.interp(corners, times, [0.0, 1.0, 1.0, 0.0]), corners)
    assert run.final["mass.w"] == pytest.approx(impulse, rel=1e-9)
