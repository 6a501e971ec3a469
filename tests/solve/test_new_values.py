"""New values at events: what is named takes them, what it is rigidly coupled with follows, all else keeps its own."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from components import (
    Brake,
    Clutch,
    Constant,
    ConstantTorque,
    Damper,
    Freewheel,
    IdealPlanetary,
    Inertia,
    InitializeFlange,
    Mass,
    MassWithStopAndFriction,
    Move,
    Ramp,
    SliderCrank,
    Speed,
    SpringDamper,
    TranslationalInitializeFlange,
    TranslationalSpeed,
    TranslationalSpringDamper,
)
from modelica_like import Options, build, export_fmu, run_fmu, sensitivities, simulate
from modelica_like.language import Component, Equations, Events, Mode, Parameter, connect, free, param, series, when
from modelica_like.runs.solution import Solution

SOLVERS = pytest.mark.parametrize("solver", ["idas", "native"])
PRECISE = {"rtol": 1e-9, "atol": 1e-12}


class Struck(Component):
    """At `tr` the first body gets the speed w1."""

    A = Inertia(J=1.0, phi=0.0, w=5.0)
    tr: Parameter = param("s", default=0.2)
    w1: Parameter = param("rad/s", default=-3.0)

    def events(self) -> Events:
        yield when(self.time > self.tr, {self.A.w: self.w1})


class Braked(Struck):
    """A closed brake holds the body until then."""

    A = Inertia(J=1.0, phi=0.0, w=0.0)
    br = Brake(capacity=10.0)

    def equations(self) -> Equations:
        yield connect(self.A.flange_b, self.br.flange_a)


class Clutched(Struck):
    """A closed clutch joins two bodies."""

    cl = Clutch(capacity=100.0)
    B = Inertia(J=2.0, w=5.0)

    def equations(self) -> Equations:
        yield from series(self.A, self.cl, self.B)


class ByMode(Clutched):
    """The same by the reset of a mode."""

    go = Mode("a", "b")

    def events(self) -> Events:
        yield self.go.go("a", "b", at=self.tr, reset={self.A.w: self.w1})


class Locked(Struck):
    """The body drives another one through a freewheel."""

    fw = Freewheel()
    B = Inertia(J=2.0, w=5.0)
    T = ConstantTorque(tau_constant=2.0)

    def equations(self) -> Equations:
        yield connect(self.T.flange, self.A.flange_a)
        yield from series(self.A, self.fw, self.B)


class Sliding(Component):
    """A mass at rest with friction gets a speed."""

    tr: Parameter = param("s", default=0.2)
    v1: Parameter = param("m/s", default=7.0)
    m = MassWithStopAndFriction(m=2.0, smin=-9.0, smax=9.0, s=0.0, v=0.0, F_Coulomb=6.0)

    def equations(self) -> Equations:
        yield free(self.m.flange_a)

    def events(self) -> Events:
        yield when(self.time > self.tr, {self.m.v: self.v1})


class Chain(Component):
    """Three bodies with springs between them; the states are differences of speeds."""

    A = Inertia(J=1.0, phi=0.0, w=1.0)
    s = SpringDamper(c=10.0, d=0.1, phi_rel=0.0)
    B = Inertia(J=1.0, w=4.0)
    s2 = SpringDamper(c=10.0, d=0.0, phi_rel=0.0)
    C = Inertia(J=1.0, w=-2.0)
    tr: Parameter = param("s", default=0.2)
    w3: Parameter = param("rad/s", default=3.0)
    w5: Parameter = param("rad/s", default=5.0)

    def equations(self) -> Equations:
        yield from series(self.A, self.s, self.B, self.s2, self.C)


class ChainA(Chain):
    def events(self) -> Events:
        yield when(self.time > self.tr, {self.A.w: self.w3})


class ChainB(Chain):
    def events(self) -> Events:
        yield when(self.time > self.tr, {self.B.w: self.w3})


class ChainAC(Chain):
    """Two conditions that come true together."""

    def events(self) -> Events:
        yield when(self.time > self.tr, {self.A.w: self.w3})
        yield when(self.time > self.tr, {self.C.w: self.w5})


class Cranked(Component):
    """The ram of a crank gets a speed: the crank follows, and stays where it is."""

    A = Inertia(J=1.0, phi=0.5, w=2.0)
    crank = SliderCrank(r=0.1, l=0.3)
    ram = Mass(m=2.0)
    tr: Parameter = param("s", default=0.2)
    v1: Parameter = param("m/s", default=0.3)

    def equations(self) -> Equations:
        yield from series(self.A, self.crank, self.ram)

    def events(self) -> Events:
        yield when(self.time > self.tr, {self.ram.v: self.v1})


def sides(run: Solution, name: str, time: float = 0.2) -> tuple[float, float]:
    """Values before and behind an event."""
    (k, *_) = np.flatnonzero((np.diff(run.time) == 0) & (np.abs(run.time[:-1] - time) < 1e-9))[::-1]
    return float(run[name][k]), float(run[name][k + 1])


@SOLVERS
@pytest.mark.parametrize(("w1", "sign"), [(-3.0, -1), (7.0, 1)])
def test_friction_lets_go_of_what_gets_a_speed(solver: str, w1: float, sign: int) -> None:
    run = simulate(Braked(w1=w1), 0.4, solver=solver, **PRECISE)
    assert run["A.w"][-1] == pytest.approx(w1 - sign * 10 * 0.2, rel=1e-8)
    assert run["A.phi"][-1] == pytest.approx(w1 * 0.2 - sign * 0.5 * 10 * 0.2**2, rel=1e-8)
    slides = simulate(Sliding(), 0.4, solver=solver, **PRECISE)
    assert not any("without an impact or a reset" in note for note in slides.energy().notices)
    assert slides["m.v"][-1] == pytest.approx(7 - 3 * 0.2, rel=1e-8)
    assert slides["m.s"][-1] == pytest.approx(7 * 0.2 - 0.5 * 3 * 0.2**2, rel=1e-8)


@SOLVERS
@pytest.mark.parametrize("drive", [Clutched, ByMode])
def test_a_closed_clutch_slips_until_momentum_is_shared(solver: str, drive: type[Clutched]) -> None:
    run = simulate(drive(), 0.4, solver=solver, **PRECISE)
    slip = -3 + 100 * 0.04, 5 - 50 * 0.04  # A.w and B.w after 0.04 s
    assert [run.read(f"at({name}, 0.24 s)")[0] for name in ("A.w", "B.w")] == pytest.approx(slip, rel=1e-7)
    assert [run[name][-1] for name in ("A.w", "B.w")] == pytest.approx([7 / 3] * 2, rel=1e-8)
    assert run.events[-1].time == pytest.approx(0.2 + 8 / 150, rel=1e-8)


@SOLVERS
def test_a_locked_freewheel_is_struck_or_released(solver: str) -> None:
    before = 5 + 2 / 3 * 0.2
    struck = simulate(Locked(w1=7.0), 0.4, solver=solver, **PRECISE)
    both = (7 + 2 * before) / 3 + 2 / 3 * 0.2
    assert [struck[name][-1] for name in ("A.w", "B.w")] == pytest.approx([both, both], rel=1e-8)
    lost = 0.5 * (1 * 2 / 3) * (7 - before) ** 2  # of an impact without restitution
    assert [(one.component, one.energy) for one in struck.impacts] == [("fw", pytest.approx(lost, rel=1e-8))]
    released = simulate(Locked(w1=-3.0), 0.4, solver=solver, **PRECISE)
    assert [released[name][-1] for name in ("A.w", "B.w")] == pytest.approx([-3 + 2 * 0.2, before], rel=1e-8)


@SOLVERS
def test_bodies_behind_springs_keep_their_speeds(solver: str) -> None:
    for drive, new in ((ChainA, {"A.w": 3.0}), (ChainB, {"B.w": 3.0}), (ChainAC, {"A.w": 3.0, "C.w": 5.0})):
        run = simulate(drive(), 0.3, solver=solver, **PRECISE)
        for name in ("A.w", "B.w", "C.w", "A.phi", "B.phi", "C.phi"):
            before, behind = sides(run, name)
            assert behind == pytest.approx(new.get(name, before), rel=1e-9), (drive, name)


@SOLVERS
def test_a_new_speed_moves_no_position(solver: str) -> None:
    run = simulate(Cranked(), 0.3, solver=solver, **PRECISE)
    assert sides(run, "ram.v")[1] == pytest.approx(0.3, rel=1e-9)
    for name in ("A.phi", "ram.s"):
        before, behind = sides(run, name)
        assert behind == pytest.approx(before, rel=1e-12)
    (_, v), (_, w), (phi, _) = (sides(run, name) for name in ("ram.v", "A.w", "A.phi"))
    swing = 0.1 * np.sin(phi)
    assert abs(v) == pytest.approx(abs(w) * (swing + swing * 0.1 * np.cos(phi) / np.sqrt(0.3**2 - swing**2)), rel=1e-9)


class FromSpeed(Component):
    src = Speed(exact=False, f_crit=5.0)
    by = Damper(d=0.5, phi_rel=0.0)
    J = Inertia(J=1.0, w=0.0, phi=0.0)
    ref = Constant(k="5 rad/s")

    def equations(self) -> Equations:
        yield from series(self.src, self.by, self.J)
        yield connect(self.ref.y, self.src.w_ref)


class FromSpeedByClutch(FromSpeed):
    by = Clutch(capacity=10.0)
    J = Inertia(J=2.0, w=0.0, phi=0.0)


class FromMove(Component):
    src = Move()
    by = Clutch(capacity=10.0)
    J = Inertia(J=2.0, w=0.0, phi=0.0)
    w_ref = Constant(k="5 rad/s")
    phi_ref = Ramp(height="5 rad", duration="1 s")
    a_ref = Constant(k="0 rad/s2")

    def equations(self) -> Equations:
        yield from series(self.src, self.by, self.J)
        yield connect(self.w_ref.y, self.src.w_ref)
        yield connect(self.phi_ref.y, self.src.phi_ref)
        yield connect(self.a_ref.y, self.src.a_ref)


class Initialized(Component):
    ini = InitializeFlange()
    J = Inertia(J=1.0)
    by = Brake(capacity=10.0)
    w_start = Constant(k="5 rad/s")
    phi_start = Constant(k="0 rad")

    def equations(self) -> Equations:
        yield connect(self.ini.flange, self.J.flange_a)
        yield connect(self.J.flange_b, self.by.flange_a)
        yield connect(self.w_start.y, self.ini.w_start)
        yield connect(self.phi_start.y, self.ini.phi_start)


class InitializedSprung(Component):
    ini = InitializeFlange()
    J = Inertia(J=1.0)
    s = SpringDamper(c=10.0, d=0.0, phi_rel=0.0)
    B = Inertia(J=1.0, w=0.0)
    w_start = Constant(k="5 rad/s")
    phi_start = Constant(k="0 rad")

    def equations(self) -> Equations:
        yield from series(self.J, self.s, self.B)
        yield connect(self.ini.flange, self.J.flange_a)
        yield connect(self.w_start.y, self.ini.w_start)
        yield connect(self.phi_start.y, self.ini.phi_start)


class InitializedMass(Component):
    ini = TranslationalInitializeFlange()
    J = MassWithStopAndFriction(m=2.0, F_Coulomb=6.0)
    v_start = Constant(k="5 m/s")
    s_start = Constant(k="0 m")

    def equations(self) -> Equations:
        yield connect(self.ini.flange, self.J.flange_a)
        yield connect(self.v_start.y, self.ini.v_start)
        yield connect(self.s_start.y, self.ini.s_start)


class FromLinearSpeed(Component):
    src = TranslationalSpeed(exact=False, f_crit=5.0)
    by = TranslationalSpringDamper(c=10.0, d=0.0, s_rel=0.0)
    J = Mass(m=1.0, v=0.0)
    ref = Constant(k="5 m/s")

    def equations(self) -> Equations:
        yield from series(self.src, self.by, self.J)
        yield connect(self.ref.y, self.src.v_ref)


SWING = 10**0.5
AT_STARTS: dict[type[Component], tuple[str, Callable[[float], float]]] = {
    FromSpeed: ("J.w", lambda t: 5 * (1 - np.exp(-t / 2))),
    FromSpeedByClutch: ("J.w", lambda t: 5 * t),
    FromMove: ("J.w", lambda t: 5 * t),
    Initialized: ("J.w", lambda t: 5 - 10 * t),
    InitializedSprung: ("B.w", lambda t: 2.5 * (1 - np.cos(20**0.5 * t))),
    InitializedMass: ("J.v", lambda t: 5 - 3 * t),
    FromLinearSpeed: ("J.v", lambda t: 5 * (1 - np.cos(SWING * t))),
}


@SOLVERS
@pytest.mark.parametrize("drive", AT_STARTS)
def test_sources_that_set_their_speed_at_the_start_move_nothing_else(solver: str, drive: type[Component]) -> None:
    name, expected = AT_STARTS[drive]
    run = simulate(drive(), 0.2, solver=solver, **PRECISE)
    assert run[name] == pytest.approx(expected(run.time), abs=1e-6)


@pytest.mark.parametrize(
    ("drive", "outputs", "by", "expected"),
    [
        (Braked(), ["A.w", "A.phi"], ["w1", "br.capacity"], [[1.0, 0.2], [0.2, 0.02]]),
        (Clutched(), ["A.w", "B.w"], ["w1", "cl.capacity"], [[1 / 3, 0.0], [1 / 3, 0.0]]),
        (Locked(w1=7.0), ["A.w", "B.w"], ["w1"], [[1 / 3], [1 / 3]]),
        (Locked(), ["A.w", "B.w"], ["w1"], [[1.0], [0.0]]),
    ],
)
def test_derivatives_by_new_values(
    drive: Component, outputs: list[str], by: list[str], expected: list[list[float]]
) -> None:
    result = sensitivities(drive, outputs, by, until=0.4, options=Options(**PRECISE))
    assert result.derivatives == pytest.approx(np.array(expected), abs=1e-6)
    handle = build(drive).native(outputs=outputs, by=by, rtol=1e-9)
    handle.reset(until=0.4)
    handle.step(0.4)
    assert handle.gradient() == pytest.approx(np.array(expected), abs=1e-5)


def test_an_fmu_slides_too(tmp_path: Path) -> None:
    export_fmu(Sliding(), tmp_path / "sliding.fmu")
    for kind in ("cs", "me"):
        run = run_fmu(tmp_path / "sliding.fmu", stop=0.4, kind=kind)
        assert run["m.v"][-1] == pytest.approx(6.4, abs=1e-5)
        assert run["m.s"][-1] == pytest.approx(1.34, abs=1e-5)


class Planets(Component):
    """Three bodies of a planetary set, of which two move freely."""

    gear = IdealPlanetary(ratio=2.0)
    S = Inertia(J=1.0, phi=0.0, w=1.0)
    C = Inertia(J=1.0, phi=0.0, w=2.0)
    R = Inertia(J=1.0)
    tr: Parameter = param("s", default=0.2)
    a: Parameter = param("rad/s", default=5.0)
    b: Parameter = param("rad/s", default=-1.0)

    def equations(self) -> Equations:
        yield connect(self.gear.sun, self.S.flange_a)
        yield connect(self.gear.carrier, self.C.flange_a)
        yield connect(self.gear.ring, self.R.flange_a)


class SunAndCarrier(Planets):
    def events(self) -> Events:
        yield when(self.time > self.tr, {self.S.w: self.a, self.C.w: self.b})


class SunAndRing(Planets):
    """Two conditions that come true together: none of them knows that the other one moves the ring."""

    def events(self) -> Events:
        yield when(self.time > self.tr, {self.S.w: self.a})
        yield when(self.time > self.tr, {self.R.w: self.b})


@SOLVERS
def test_the_third_body_of_a_planetary_set_follows(solver: str) -> None:
    """By Willis' equation: w_S = 3 w_C - 2 w_R."""
    for drive, third, value in ((SunAndCarrier(), "R.w", -4.0), (SunAndRing(), "C.w", 1.0)):
        run = simulate(drive, 0.3, solver=solver)
        assert (run["S.w"][-1], run[third][-1]) == pytest.approx((5.0, value), rel=1e-9)


@pytest.mark.parametrize(
    ("drive", "third", "slopes"), [(SunAndCarrier(), "R.w", [-1 / 2, 3 / 2]), (SunAndRing(), "C.w", [1 / 3, 2 / 3])]
)
def test_derivatives_of_the_third_body(drive: Component, third: str, slopes: list[float]) -> None:
    assert sensitivities(drive, third, ["a", "b"], until=0.3).derivatives[0] == pytest.approx(slopes, rel=1e-9)
