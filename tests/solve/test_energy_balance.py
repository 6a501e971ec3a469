"""Energies are integrated along the run's own results: how precisely, and from how few."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from components import ConstantTorque, Damper, Fixed, Inertia, RigidBacklash, SpringDamper
from modelica_like import Assembly, Component, build, load, simulate
from modelica_like.errors import ValueOutOfRange
from modelica_like.language import Equations, Events, Expr, Mode, Parameter, Variable, der, param, sin, var
from modelica_like.runs import energy, powers
from modelica_like.runs.energy import _SAME_TIME, _is_rounding, _unexplained
from modelica_like.solve.initialize import Point

EXAMPLES = Path(__file__).parents[2] / "examples"

LOSSY_GEAR = """
[parts]
sine = { is = "Sine", f = 5, amplitude = 20 }
torque = { is = "Torque" }
inertia3 = { is = "Inertia", J = 2, phi = 0, w = 0 }
spring3 = { is = "Spring", c = 1e4 }
inertia4 = { is = "Inertia", J = 2 }
gear = { is = "LossyGear", ratio = 2, loss_table = [[0, 0.8, 0.8, 1, 1]] }
inertia5 = { is = "Inertia", J = 2, phi = 0, w = 0 }
[series]
shaft = ["torque", "inertia3", "spring3", "inertia4", "gear", "inertia5"]
[connect]
drive = ["sine.y", "torque.tau"]
[simulate]
until = "1 s"
"""


def braked() -> Assembly:
    """A flywheel that a damper stops: w = 3·exp(-0.4·t/0.5)."""
    parts = {"J": Inertia(J=0.5, phi=0.0, w=3.0), "oil": Damper(d=0.4), "wall": Fixed()}
    return Assembly("drive", parts=parts, series={"s": list(parts)})


def oscillator(c: float, d: float) -> Assembly:
    parts = {"J": Inertia(J=0.5, phi=0.3, w=0.0), "spring": SpringDamper(c=c, d=d), "wall": Fixed()}
    return Assembly("drive", parts=parts, series={"s": list(parts)})


@pytest.mark.parametrize("points", [1, 2, 5, 50, 500])
def test_a_loss_by_its_closed_form_from_few_results(points: int) -> None:
    balance = simulate(braked(), 2.0, points=points, rtol=1e-9, atol=1e-11).energy()
    assert balance["oil"].lost == pytest.approx(0.25 * 9 * (1 - np.exp(-3.2)), rel=1e-8)
    assert balance.drift < 1e-8


def test_the_energies_of_a_part_of_a_run() -> None:
    """Between any two times, on results or beside them, of few results or many; the parts add up."""
    for points in (1, 3, 500):
        run = simulate(braked(), 2.0, points=points, rtol=1e-9, atol=1e-11)
        cuts = [0.0, 0.3, 1.0, 1.7, 2.0]
        parts = [run.energy(begin, end) for begin, end in pairwise(cuts)]
        left = np.exp(-1.6 * np.array(cuts))
        np.testing.assert_allclose([one["oil"].lost for one in parts], -0.25 * 9 * np.diff(left), rtol=1e-7)
        np.testing.assert_allclose([one["J"].stored for one in parts], 0.25 * 9 * np.diff(left), rtol=1e-7)
        assert max(one.power_closure for one in parts) < 1e-9
        assert run.energy("300 ms", "1 s")["oil"].lost == pytest.approx(parts[1]["oil"].lost, rel=1e-12)
    with pytest.raises(ValueOutOfRange, match=r"2\.5"):
        run.energy(1.0, 2.5)
    for begin, end in ((1.0, 1.0), (1.5, 1.0)):
        with pytest.raises(
            ValueOutOfRange, match=f"^The end of a balance, 1 s, is not after its beginning, {begin:g} s"
        ):
            run.energy(begin, end)


def test_an_impact_belongs_to_the_part_that_begins_with_it() -> None:
    """1 kg m² at 3 rad/s meets another one after 0.5 rad: half of its 4.5 J is lost at 1/6 s."""
    parts = {"a": Inertia(J=1.0, phi=0.0, w=3.0), "play": RigidBacklash(b=1.0), "b": Inertia(J=1.0, w=0.0)}
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 1.0)
    (impact,) = run.impacts
    before, after = run.energy(0.0, impact.time), run.energy(impact.time, 1.0)
    assert (before.lost, after.lost) == (0.0, pytest.approx(2.25, rel=1e-9))


@pytest.mark.parametrize("points", [1, 4, 20, 21])
def test_oscillations_between_results_are_seen(points: int) -> None:
    """Twenty periods of exactly 0.05 s: with 4 or 20 results the mass stands still at each, as if nothing moved.

    After whole periods the energy of the oscillation has fallen by exp(-d/J·t).
    """
    omega, delta = 40 * np.pi, 0.1
    run = simulate(oscillator(0.5 * (omega**2 + delta**2), 2 * 0.5 * delta), 1.0, points=points, rtol=1e-10, atol=1e-13)
    stored = 0.5 * 0.5 * (omega**2 + delta**2) * 0.09
    assert run.energy()["spring"].lost == pytest.approx(stored * -np.expm1(-2 * delta), rel=1e-6)


@pytest.mark.parametrize("name", ["msl/rotational/CoupledClutches", "stick_slip", "machine_tool_startup", "two_mass"])
def test_the_drift_is_that_of_the_run_whatever_its_results(name: str) -> None:
    model = build(load(EXAMPLES / f"{name}.toml"))
    run = simulate(model)
    fine = run.energy()
    assert fine.drift <= 10 * run.options.rtol
    for points in (1, 5, 50):
        balance = simulate(model, points=points).energy()
        # Runs with other results differ within their tolerance themselves.
        assert balance.lost == pytest.approx(fine.lost, abs=20 * run.options.rtol * fine.throughput)
        assert balance.source == pytest.approx(fine.source, abs=20 * run.options.rtol * fine.throughput)
        assert balance.power_closure <= 1e-12


def test_a_drive_that_idas_gives_up_at_a_higher_precision_has_a_balance(tmp_path: Path) -> None:
    """Of a stiff train with a lossy gear; the loss is that of a run of a hundredth of the tolerance."""
    file = tmp_path / "lossy.toml"
    file.write_text(LOSSY_GEAR)
    for points in (1, 500):
        balance = simulate(load(file), points=points).energy()
        assert balance["gear"].lost == pytest.approx(0.1545424, rel=1e-5)
        # What is told is at most how much the run itself drifts.
        assert all("drifts" in notice for notice in balance.notices)


@pytest.mark.parametrize("points", [1, 3, 500])
def test_powers_along_straight_lines_are_no_straight_lines(points: int) -> None:
    """A constant torque: the speed is t·tau/J, which no step of an integrator can miss, its energy is not."""
    parts = {"push": ConstantTorque(tau_constant=2.0), "J": Inertia(J=0.5, phi=0.0, w=0.0)}
    balance = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 3.0, points=points).energy()
    assert balance["push"].source == pytest.approx(0.5 * 0.5 * 12.0**2, rel=1e-8)
    assert balance.drift < 1e-8


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("points", [1, 5, 500])
def test_a_start_of_nanoseconds_is_seen_in_a_run_of_hours(points: int, solver: Any) -> None:
    """An oil stops a small wheel: it loses J·w²/2, all of it within J/d = 1 ns."""
    parts = {"J": Inertia(J=1e-9, phi=0.0, w=3.0), "oil": Damper(d=1.0), "wall": Fixed()}
    drive = Assembly("drive", parts=parts, series={"s": list(parts)})
    balance = simulate(drive, 3600.0, points=points, solver=solver).energy()
    assert balance["oil"].lost == pytest.approx(0.5e-9 * 9.0, rel=1e-6)
    assert balance["J"].stored == pytest.approx(-0.5e-9 * 9.0, rel=1e-6)
    assert balance.closure < 1e-6


def test_a_power_that_is_over_at_once_does_not_widen_tolerances() -> None:
    """Contacts begin with 250 N.s/m: their power lasts a microsecond, the first interval of results 0.2 s."""
    run = simulate(load(EXAMPLES / "msl/translational/PreLoad.toml"))
    work = powers.Powers(run.model, run.options, len(run.time))
    for every in powers.results(run.model, run.segments):
        work.integrals(every)
    # 250 N.s/m for 0.2 s would be a hundred times as much.
    balance = run.energy()
    assert work.moved < 10 * balance.throughput
    # The plates, 10 g each, ring for two milliseconds; at rest before and after, they keep nothing (tolerance: 100 s of
    # preload, 300 N, at speeds within 1e-9 m/s).
    assert all(abs(balance[f"springPlate{side}"].inflow) < 3e-5 for side in "AB")


def test_a_drift_that_adds_up_is_told() -> None:
    """A hundred swings: what a step may lose comes back in no other step."""
    run = simulate(oscillator(0.5 * (200 * np.pi) ** 2, 0.0), 1.0, rtol=1e-6, atol=1e-8)
    balance = run.energy()
    assert balance.drift > 10 * 1e-6
    told = f"{balance.drift / 1e-6:.2g} times the run's relative tolerance"
    assert told in balance.notices[-1]
    assert replace(balance, tolerance=0.0).notices == balance.notices[:-1]
    # The run lost it, not the quadrature: nothing takes energy away.
    assert balance.stored < -1e-5 * balance.throughput
    assert sum(row.drift for row in balance) == pytest.approx(balance.stored, rel=1e-6)


class Cycle(Component):
    """A power without states: P·sin²(omega·t) through friction."""

    omega: Parameter = param("rad/s", "angular frequency", default=40.0)
    v: Variable = var("m/s", "speed")
    f: Variable = var("N", "force")
    amplitude: Parameter = param("m/s", "largest speed", default=1.0)
    d: Parameter = param("N.s/m", "damping coefficient", default=3.0)

    def equations(self) -> Equations:
        yield self.v == self.amplitude * sin(self.omega * self.time)
        yield self.f == self.d * self.v

    def loss_power(self) -> Any:
        return self.f * self.v

    def source_power(self) -> Any:
        return self.f * self.v


@pytest.mark.parametrize("points", [1, 7, 13, 500])
def test_a_model_without_states(points: int) -> None:
    """With 13 results the power seems to change thirteen times as slowly as it does."""
    balance = simulate(Cycle(), 1.0, points=points).energy()
    assert balance.lost == pytest.approx(3 * (0.5 - np.sin(80.0) / 160), rel=1e-7)
    assert balance.power_closure < 1e-12


@pytest.mark.parametrize(("bound", "most"), [("_PIECE", 40), ("_LARGEST", 1)])
def test_a_long_run_is_looked_at_in_pieces(monkeypatch: pytest.MonkeyPatch, bound: str, most: int) -> None:
    run = simulate(load(EXAMPLES / "msl/rotational/CoupledClutches.toml"))
    whole = run.energy()
    monkeypatch.setattr(powers, bound, most)
    parts = replace(run).energy()
    for row in whole:
        other = parts[row.component]
        for name in ("inflow", "source", "stored", "lost", "at_events"):
            expected = pytest.approx(getattr(row, name), abs=1e-6 * whole.throughput)
            assert getattr(other, name) == expected, (row.component, name)
    assert parts.drift <= 10 * run.options.rtol


def test_where_nothing_can_be_integrated_again_the_results_count(monkeypatch: pytest.MonkeyPatch) -> None:
    run = simulate(oscillator(200.0, 0.1), 1.0, points=40)

    expected = run.energy()
    monkeypatch.setattr(powers.Powers, "_finer", lambda *_: None)
    balance = replace(run).energy()
    assert balance["spring"].lost == pytest.approx(expected["spring"].lost, rel=1e-4)


def test_states_that_are_no_numbers_have_a_balance_of_none() -> None:
    run = simulate(Inertia(J=1.0), 1.0, start="rest", points=5)
    segment = replace(run.segments[0], x=run.segments[0].x * float("nan"))
    assert np.isnan(replace(run, segments=(segment,)).energy().stored)


class Flywheel(Component):
    """Its only transition, the first of the model, lets it jump to half of its speed."""

    w: Variable = var("rad/s", "speed")
    J: Parameter = param("kg.m2", "inertia", default=2.0)
    at: Parameter = param("s", "time of the jump", default=0.5)
    mode = Mode("fast", "slow")

    def equations(self) -> Equations:
        yield self.J * der(self.w) == 0

    def events(self) -> Events:
        yield self.mode.go("fast", "slow", at=self.at, reset={self.w: self.w / 2})

    def stored_energy(self) -> Expr:
        return 0.5 * self.J * self.w**2


def test_a_reset_explains_what_changes_with_it() -> None:
    balance = simulate(Flywheel(w=4.0), 1.0, points=4).energy()
    assert balance.at_events == 0.0
    assert balance.notices == ()
    assert [row.at_events for row in balance] == [-12.0]


def test_energy_at_events_that_nothing_explains() -> None:
    """Jumps of 1 J and 2 J at 1 s and of -5 J at 2 s: what explains one counts at its own time only."""
    times, jumps = np.array([1.0, 1.0, 2.0]), np.array([1.0, 2.0, -5.0])
    near = 2.0 + 1e-12
    assert _unexplained(times, jumps, [], []) == 5.0
    assert _unexplained(times, jumps, [2.0], []) == 3.0
    assert _unexplained(times, jumps, [near], [(1.0, -3.0)]) == 0.0
    assert _unexplained(times, jumps, [], [(near, 5.0)]) == 3.0
    assert _unexplained(times, jumps, [2.1, 0.9], [(1.5, 7.0), (9.0, 7.0)]) == 5.0
    assert _unexplained(times[:0], jumps[:0], [1.0], [(1.0, 1.0)]) == 0.0
    start, apart = np.zeros(1), (0.9 * _SAME_TIME, 1.1 * _SAME_TIME)
    assert [_unexplained(start, jumps[:1], [time], []) for time in apart] == [0.0, 1.0]


@pytest.mark.parametrize(("wrong", "rounding"), [(0.0, True), (1.0, False)])
def test_an_imbalance_is_rounding_if_it_follows_the_last_digits(
    monkeypatch: pytest.MonkeyPatch, wrong: float, rounding: bool
) -> None:
    """Of 3 W in and 2 W from a source 7 W are lost and -2 W stored, each but for its last digits, or 1 W besides."""

    def call(twin: Any, _function: Any, _point: Any) -> np.ndarray:
        last = 1e3 * (twin.p - 1.0)
        return np.array([0.0, 7.0 + last[0], 2.0 + last[1], 3.0 + last[2], -2.0 + last[3] + wrong, 0.0])

    monkeypatch.setattr(energy, "call", call)
    monkeypatch.setattr(energy, "solve_implicit", lambda *_: None)
    model: Any = SimpleNamespace(p=np.ones(4), components=["a"])
    model.twin = lambda p: SimpleNamespace(p=p, energy=None)
    point = Point(0.0, np.zeros(1), np.zeros(0), np.zeros(0))
    assert _is_rounding(model, point, 0) == rounding
