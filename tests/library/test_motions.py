"""Motions from signals, starts from signals, relative states, fastest ways."""

from math import cos, sin

import numpy as np
import pytest

from components import (
    Accelerate,
    Constant,
    Fixed,
    Inertia,
    InitializeFlange,
    KinematicPTP2,
    Mass,
    Move,
    Position,
    RelativeStates,
    Spring,
    SpringDamper,
    Table,
    TranslationalFixed,
    TranslationalInitializeFlange,
    TranslationalMove,
    TranslationalRelativeStates,
    TranslationalSpring,
)
from modelica_like import Assembly, simulate

REFERENCES = {"q": ["turn.q", "drive.phi_ref"], "qd": ["turn.qd", "drive.w_ref"], "qdd": ["turn.qdd", "drive.a_ref"]}


def turn(**values: str) -> KinematicPTP2:
    return KinematicPTP2(q_end="3 rad", qd_max="2 rad/s", qdd_max="5 rad/s2", **values)


@pytest.mark.parametrize(("begin", "duration"), [(1.0, 1 + 2 / 5), (5.0, 1 + 2 / 5), (2.8, 2 * 0.2), (3.0, 0.0)])
def test_fastest_way(begin: float, duration: float) -> None:
    """It takes way/speed + speed/acceleration; on a short way, without cruise, 2·sqrt(way/acceleration)."""
    parts = {"turn": turn(q_begin=f"{begin} rad", start_time="0.1 s"), "drive": Position(), "J": Inertia(J=2.0)}
    drive = Assembly("d", parts=parts, series={"s": ["drive", "J"]}, connect={"q": ["turn.q", "drive.phi_ref"]})
    run = simulate(drive, "2 s", rtol=1e-9)
    assert max(event.time for event in run.events) == pytest.approx(0.1 + duration, rel=1e-12)
    assert (run["J.phi"][0], run.final["J.phi"], run.final["J.w"]) == pytest.approx((begin, 3.0, 0.0), abs=1e-12)
    assert np.max(np.abs(run["turn.qd"])) <= 2 + 1e-12
    assert set(np.round(np.abs(run["turn.qdd"]), 9)) <= {0.0, 5.0}
    assert run.energy().power_closure <= 1e-8


def test_move_follows_without_differentiating() -> None:
    """The same motion by three signals, by the angle alone, and by the acceleration alone."""
    parts = {
        "turn": turn(q_begin="1 rad"), "drive": Move(), "J": Inertia(J=2.0), "exact": Position(), "J2": Inertia(J=2.0),
        "pushed": Accelerate(phi=1.0, w=0.0), "J3": Inertia(J=2.0),
    }  # fmt: skip
    connect = {
        **REFERENCES, "q": [*REFERENCES["q"], "exact.phi_ref"], "qdd": [*REFERENCES["qdd"], "pushed.a_ref"],
    }  # fmt: skip
    series = {"a": ["drive", "J"], "b": ["exact", "J2"], "c": ["pushed", "J3"]}
    run = simulate(Assembly("d", parts=parts, series=series, connect=connect), "2 s", rtol=1e-9)
    for other in ("J2", "J3"):
        np.testing.assert_allclose(run["J.phi"], run[f"{other}.phi"], atol=1e-7)
        np.testing.assert_allclose(run["J.w"], run[f"{other}.w"], atol=1e-6)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("turning", [True, False])
def test_deviation_of_inconsistent_signals_dies_out(turning: bool) -> None:
    """A kink in the place of which the speed knows nothing: e(t) = -0.1·exp(-p·t)·(1 + p·t) after a step of 0.1."""
    unit, place, speed = ("rad", "phi", "w") if turning else ("m", "s", "v")
    parts = {
        "q": Table(table=((0, 0), (1, 0), (1.0001, 0.1), (3, 0.1)), scale=f"1 {unit}"),
        "w": Constant(k=f"0 {unit}/s"), "a": Constant(k=f"0 {unit}/s2"),
        "drive": (Move if turning else TranslationalMove)(f_crit=2.0), "J": Inertia(J=2.0) if turning else Mass(m=2.0),
    }  # fmt: skip
    connect = {one: [f"{one}.y", f"drive.{name}_ref"] for one, name in (("q", place), ("w", speed), ("a", "a"))}
    run = simulate(Assembly("d", parts=parts, series={"a": ["drive", "J"]}, connect=connect), "2 s", rtol=1e-9)
    pull = 4 * np.pi
    left = 0.1 * np.exp(-pull * 0.2) * (1 + pull * 0.2)
    assert 0.1 - run.at(1.2)[f"J.{place}"] == pytest.approx(left, rel=1e-3)


@pytest.mark.parametrize(("use_phi", "use_w"), [(True, True), (True, False), (False, True)])
def test_start_from_signals(use_phi: bool, use_w: bool) -> None:
    parts = {
        "wall": Fixed(), "spring": Spring(c=8.0), "J": Inertia(J=2.0),
        "begin": InitializeFlange(use_phi=use_phi, use_w=use_w, phi_start=0.3, w_start=1.0),
    }  # fmt: skip
    run = simulate(Assembly("d", parts=parts, series={"s": list(parts)}), "2 s", rtol=1e-9)
    wanted = 0.3 * use_phi * cos(4) + 0.5 * use_w * sin(4)
    assert run.final["J.phi"] == pytest.approx(wanted, rel=1e-6)
    assert run.energy().power_closure <= 1e-8


def test_start_with_an_acceleration() -> None:
    """5 rad/s² of 2 kg.m2 at 1 rad/s against 3 N.m.s/rad: the spring of 100 N.m/rad is twisted by 0.13 rad."""
    parts = {
        "begin": InitializeFlange(use_phi=False, w_start=1.0, w=1.0, a=5.0), "J": Inertia(J=2.0),
        "shaft": SpringDamper(c=100.0, d=3.0), "wall": Fixed(),
    }  # fmt: skip
    run = simulate(Assembly("d", parts=parts, series={"s": list(parts)}), 0.1)
    assert (run["begin.a"][0], run["J.w"][0], run["J.phi"][0]) == pytest.approx((5.0, 1.0, -0.13), rel=1e-12)


def test_slides_start_and_move_from_signals() -> None:
    parts = {
        "wall": TranslationalFixed(), "spring": TranslationalSpring(c=8.0), "m": Mass(m=2.0),
        "begin": TranslationalInitializeFlange(s_start=0.3, v_start=1.0),
        "way": KinematicPTP2(q_end="2 m", qd_max="3 m/s", qdd_max="2 m/s2"), "drive": TranslationalMove(),
        "table": Mass(m=3.0),
    }  # fmt: skip
    connect = {"s": ["way.q", "drive.s_ref"], "v": ["way.qd", "drive.v_ref"], "a": ["way.qdd", "drive.a_ref"]}
    series = {"s": ["wall", "spring", "m", "begin"], "t": ["drive", "table"]}
    run = simulate(Assembly("d", parts=parts, series=series, connect=connect), "2 s", rtol=1e-9)
    assert run.final["m.s"] == pytest.approx(0.3 * cos(4) + 0.5 * sin(4), rel=1e-6)
    assert run.final["table.s"] == pytest.approx(2.0, rel=1e-7)
    assert run.at(0.5)["drive.flange.f"] == pytest.approx(-3 * 2, rel=1e-4)
    assert run.energy().power_closure <= 1e-8


def test_relative_states() -> None:
    """They are the states, where without them the absolute ones are; the motion is the same."""
    shafts = {"J1": Inertia(J=1.0, phi=0.0, w=5.0), "spring": Spring(c=6.0), "J2": Inertia(J=2.0)}
    twisted = {**shafts, "rel": RelativeStates(phi_rel=0.1, w_rel=0.0)}
    series = {"s": ["J1", "spring", "J2"], "r": ["J1", "rel", "J2"]}
    run = simulate(Assembly("d", parts=twisted, series=series), "2 s", rtol=1e-9)
    assert {"rel.phi_rel", "rel.w_rel"} < set(run.model.states)
    assert run.final["rel.phi_rel"] == pytest.approx(0.1 * cos(3 * 2), rel=1e-6)
    slides = {"m1": Mass(m=1.0, s=0.0, v=5.0), "spring": TranslationalSpring(c=6.0), "m2": Mass(m=2.0)}
    apart = {**slides, "rel": TranslationalRelativeStates(s_rel=0.1, v_rel=0.0)}
    series = {"s": ["m1", "spring", "m2"], "r": ["m1", "rel", "m2"]}
    other = simulate(Assembly("d", parts=apart, series=series), "2 s", rtol=1e-9)
    assert {"rel.s_rel", "rel.v_rel"} < set(other.model.states)
    assert other.final["rel.s_rel"] == pytest.approx(0.1 * cos(3 * 2), rel=1e-6)
    assert max(run.energy().power_closure, other.energy().power_closure) <= 1e-8
