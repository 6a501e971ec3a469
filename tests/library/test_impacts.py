"""Impacts: momentum is conserved, and what is lost stands where it was lost."""

from typing import Any, get_args

import numpy as np
import pytest

from components import (
    Brake,
    Clutch,
    Constant,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    DogClutch,
    Fixed,
    Freewheel,
    HydraulicActuator,
    IdealGear,
    Inertia,
    Mass,
    MassWithStopAndFriction,
    OneWayClutch,
    RigidBacklash,
    RuptureCoupling,
    SpringDamper,
    Step,
    TranslationalSpring,
)
from components.interfaces import LinearCompliantWithRelativeStates
from modelica_like import Assembly, Component, Solution, simulate
from modelica_like.language import Equations, Events, Hold, Mode, Parameter, Variable, all_of, der, param, var
from modelica_like.simulation import Solver


def run(parts: dict[str, Component], until: float, series: tuple[str, ...] = (), **options: float) -> Solution:
    return simulate(Assembly("drive", parts=parts, series={"s": series or tuple(parts)}), until, **options)


@pytest.mark.parametrize("coupling", [Freewheel(), OneWayClutch(capacity=1.0)])
def test_a_lagging_output_is_taken_along(coupling: Component) -> None:
    """2·5 + 3·0 = 5·2 kg.m2/s; lost are 2·25/2 - 5·4/2 = 15 J, in the coupling."""
    drive = run({"a": Inertia(J=2.0, phi=0, w=5.0), "coupling": coupling, "b": Inertia(J=3.0, w=0.0)}, 1.0)
    assert drive.final["a.w"] == pytest.approx(2.0, rel=1e-12)
    assert drive.final["b.w"] == pytest.approx(2.0, rel=1e-12)
    assert [one.component for one in drive.impacts] == ["coupling"]
    balance = drive.energy()
    assert balance["coupling"].impact == pytest.approx(15.0, rel=1e-12)
    assert balance.lost == pytest.approx(15.0, rel=1e-12)


def test_an_impact_goes_through_gears_but_not_through_friction() -> None:
    """The wheel behind the gear takes part, 2² times as heavy; the one behind the clutch slips after it."""
    parts = {
        "a": Inertia(J=1.0, phi=0, w=6.0), "freewheel": Freewheel(), "b": Inertia(J=1.0, w=0.0),
        "gear": IdealGear(ratio=0.5), "c": Inertia(J=1.0), "clutch": Clutch(capacity=1e-3), "d": Inertia(J=1.0, w=0.0),
    }  # fmt: skip
    drive = run(parts, 1e-3)
    common = 6.0 / (1.0 + 1.0 + 4.0)
    assert drive.final["a.w"] == pytest.approx(common, rel=1e-5)
    assert drive.final["c.w"] == pytest.approx(2.0 * common, rel=1e-5)
    assert drive.final["d.w"] == pytest.approx(1e-6, rel=1e-5)
    assert [event.after for event in drive.events if event.mode == "clutch.mode"] == ["backward"]


def test_what_slides_is_turned_by_an_impact() -> None:
    """A brake that slides forward slides backward after it: its torque of 1 N.m now drives the other way."""
    parts = {
        "brake": Brake(capacity=1.0),
        "a": Inertia(J=1.0, phi=0, w=1.0),
        "f": Freewheel(),
        "b": Inertia(J=1.0, w=-5.0),
    }
    drive = run(parts, 1.0)
    assert drive.final["a.w"] == pytest.approx(-2.0 + 0.5, rel=1e-9)
    assert drive.energy()["f"].impact == pytest.approx(0.25 * 6.0**2, rel=1e-12)


def test_the_mass_behind_a_spring_keeps_its_speed() -> None:
    """2 kg meet a stop at 3 m/s; the 1 kg behind a soft spring does not feel it at that instant."""
    parts = {
        "other": Mass(m=1.0, v=3.0), "spring": TranslationalSpring(c=1.0, s_rel=0.0),
        "mass": MassWithStopAndFriction(m=2.0, smin=-9.0, smax=1.0, s=0.7, v=3.0, F_Coulomb=0.0),
    }  # fmt: skip
    drive = run(parts, 0.1 + 1e-6)
    assert drive.impacts[0].time == pytest.approx(0.1, abs=1e-9)
    assert drive.impacts[0].energy == pytest.approx(0.5 * 2.0 * 9.0, rel=1e-9)
    assert abs(drive.final["mass.v"]) <= 1e-30
    assert drive.final["other.v"] == pytest.approx(3.0, rel=1e-6)
    assert drive.energy().at_events <= 1e-12


class Buffer(LinearCompliantWithRelativeStates):
    """Two bodies that meet and part again with e times the speed."""

    e: Parameter = param("1", "restitution", min=0, max=1)
    s_rel: Variable = var("m", "distance", state="always")
    v_rel: Variable = var("m/s", "speed of the distance", state="always")
    mode = Mode(
        "apart", "together", holds={"together": Hold("v_rel", reaction="f", capacity="limits", restitution="e")}
    )

    def limits(self) -> tuple[float, None]:
        return 0.0, None

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.mode.choose(apart=self.f, together=der(self.v_rel)) == 0

    def events(self) -> Events:
        yield self.mode.initially("apart", when=self.v_rel > 0)
        yield self.mode.go("apart", "together", when=all_of(self.s_rel < 0, self.v_rel < 0))


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_bodies_part_with_what_restitution_leaves(e: float) -> None:
    """1 kg at 4 m/s meets 3 kg: the centre of mass goes on at 1 m/s, the difference is turned and shrinks by e."""
    parts = {"a": Mass(m=1.0, s=0.0, v=4.0), "gap": Buffer(e=e), "b": Mass(m=3.0, s=1.0, v=0.0)}
    drive = run(parts, 0.5)
    assert drive.final["a.v"] == pytest.approx(1.0 - 3.0 * e, abs=1e-9)
    assert drive.final["b.v"] == pytest.approx(1.0 + e, abs=1e-9)
    assert drive.energy().lost == pytest.approx(0.5 * 0.75 * 16.0 * (1.0 - e**2), abs=1e-9)


PISTON: Any = {"m": 0.02, "travel": 1e-3, "f_spring": 5.0, "A": 1e-4, "Q_nominal": 1e-6, "C": 1e-13}
"""A piston that the spring alone takes back from its far stop."""
STARTS: dict[str, tuple[Component, str, float, float]] = {
    "right stop": (MassWithStopAndFriction(m=3.0, smin=-1.0, smax=1.0, s=1.0, v=2.0, e=0.5), "v", -1.0, 4.5),
    "left stop": (MassWithStopAndFriction(m=3.0, smin=-1.0, smax=1.0, s=-1.0, v=-2.0, e=0.5), "v", 1.0, 4.5),
    "beyond a stop": (MassWithStopAndFriction(m=3.0, smin=-1.0, smax=1.0, s=1.5, v=2.0), "v", 0.0, 6.0),
    "away from a stop": (MassWithStopAndFriction(m=3.0, smin=-1.0, smax=1.0, s=1.0, v=-2.0), "v", -2.0, 0.0),
    "piston at its far stop": (HydraulicActuator(**PISTON, s=1e-3, v=0.1, p=0.0), "v", 0.0, 1e-4),
    "piston that leaves it": (HydraulicActuator(**PISTON, s=1e-3, v=-0.1, p=0.0), "v", -0.1, 0.0),
    "piston at rest": (HydraulicActuator(**PISTON, s=0.0, v=-0.1, p=0.0), "v", 0.0, 1e-4),
    "piston that begins": (HydraulicActuator(**PISTON, s=0.0, v=0.1, p=0.0), "v", 0.1, 0.0),
}


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("start", STARTS)
def test_what_moves_against_its_stop_at_the_start_meets_it(start: str, solver: Solver) -> None:
    """It is not held from the start, with its speed for ever; what it loses is booked."""
    part, name, after, lost = STARTS[start]
    oil = {"oil": ("supply.y", "part.p_in")} if isinstance(part, HydraulicActuator) else {}
    drive = Assembly("d", parts={"part": part, "supply": Constant(k=0.0)}, connect=oil)
    found = simulate(drive, 1e-6, solver=solver)
    assert found[f"part.{name}"][-1] == pytest.approx(after, abs=1e-3)
    assert sum(one.energy for one in found.impacts) == pytest.approx(lost, rel=1e-9)
    assert found.energy().power_closure <= 1e-8


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("side", [-1, 1])
def test_flanks_that_approach_from_the_start_meet(side: int, solver: Solver) -> None:
    """1 and 3 kg m² meet with 4 rad/s: the difference is turned and halved, 0.75·16·0.75/2 = 4.5 J are lost."""
    parts = {"a": Inertia(J=1.0, phi=0.0, w=0.0), "play": RigidBacklash(b=0.2, phi_rel=0.1 * side, e=0.5)}
    parts["b"] = Inertia(J=3.0, w=4.0 * side)
    drive = Assembly("d", parts=parts, series={"s": ("a", "play", "b")})
    found = simulate(drive, 0.01, solver=solver)
    assert (found.final["a.w"], found.final["b.w"]) == (pytest.approx(4.5 * side), pytest.approx(2.5 * side))
    assert found.energy().lost == pytest.approx(4.5, rel=1e-9)


def test_a_pin_between_shafts_of_different_speeds_is_broken() -> None:
    parts = {"a": Inertia(J=1.0, phi=0.0, w=1.0), "pin": RuptureCoupling(tau_break=9.0, w_rel=2.0), "b": Inertia(J=1.0)}
    found = run(parts, 1.0)
    assert found.final["pin.pin"] == 1
    assert (found.final["a.w"], found.final["b.w"]) == (1.0, 3.0)


def test_three_that_meet_at_once() -> None:
    """a and c drive b, which stands still: a takes b to 5 rad/s, and c, at 1 rad/s, is overrun."""
    parts = {
        "a": Inertia(J=1.0, phi=0, w=10.0), "c": Inertia(J=1.0, phi=0, w=1.0), "b": Inertia(J=1.0, w=0.0),
        "fa": Freewheel(), "fc": Freewheel(),
    }  # fmt: skip
    drive = simulate(Assembly("drive", parts=parts, series={"s": ("a", "fa", "b"), "t": ("c", "fc", "b")}), 0.1)
    np.testing.assert_allclose([drive.final[f"{name}.w"] for name in "abc"], [5.0, 5.0, 1.0], rtol=1e-12)


def test_a_stop_on_an_elastic_shaft() -> None:
    """A freewheel to a wall stops the hub at once; the flywheel behind the shaft swings on at its frequency."""
    parts = {
        "wall": Fixed(), "stop": Freewheel(), "hub": Inertia(J=1.0, w=-1.0),
        "shaft": SpringDamper(c=100.0, d=0.0, phi_rel=0.0, w_rel=0.0), "flywheel": Inertia(J=4.0),
    }  # fmt: skip
    drive = run(parts, np.pi / 10, rtol=1e-9)
    assert drive["hub.w"][0] == 0.0
    assert drive["flywheel.w"][0] == pytest.approx(-1.0, rel=1e-12)
    assert drive.final["flywheel.w"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_flanks_part_with_what_restitution_leaves(e: float) -> None:
    """Play of 0.8 rad: the first impact after 0.4/3 s, the way back takes 0.8/(3·e) s, 1/e times the one before."""
    parts = {"a": Inertia(J=1.0, phi=0, w=3.0), "play": RigidBacklash(b=0.8, phi_rel0=0.3, e=e)}
    parts["b"] = Inertia(J=2.0, phi=0.3, w=0.0)
    drive = run(parts, 0.8, rtol=1e-9)
    momentum = drive["a.w"] + 2 * drive["b.w"]
    np.testing.assert_allclose(momentum, 3.0, rtol=1e-9)
    meetings = [event.time for event in drive.events if event.before == "gap"]
    wanted = {0.0: [1 / 6], 0.5: [1 / 6, 5 / 6], 1.0: [1 / 6, 1 / 2, 5 / 6]}[e]
    np.testing.assert_allclose(meetings, 0.8 * np.array(wanted), rtol=1e-8)
    np.testing.assert_allclose(drive.final["b.w"] - drive.final["a.w"], -3.0 * (-e) ** len(meetings), atol=1e-9)
    assert drive.energy().lost == pytest.approx(0.5 * (2 / 3) * 9 * (1 - e ** (2 * len(meetings))), abs=1e-9)


@pytest.mark.parametrize("away", [-1.0, 1.0])
def test_flanks_do_not_pull(away: float) -> None:
    """0.5 N.m part 1 kg.m2 from another one that rests against it: phi = 0.25·t², and the other one stays."""
    parts = {"torque": ConstantTorque(tau_constant=0.5 * away), "a": Inertia(J=1.0, w=0.0)}
    drive = run({**parts, "play": RigidBacklash(b=8.0, phi_rel=4.0 * away), "b": Inertia(J=1.0, phi=0.0, w=0.0)}, 1.0)
    assert drive.final["a.phi"] == pytest.approx((0.25 - 4.0) * away, rel=1e-9)
    assert drive.final["b.w"] == 0.0


def test_a_mass_bounces_at_its_stop_until_it_rests() -> None:
    """3 N push 2 kg with 4 m/s against a stop 1 m ahead: v² = 16 + 3; then e times as fast, 2·v·m/F each time."""
    mass = MassWithStopAndFriction(m=2.0, smin=-100.0, smax=1.0, s=0.0, v=4.0, e=0.5)
    drive = run({"push": ConstantForce(f_constant=3.0), "mass": mass}, 10.0, rtol=1e-9)
    first, v = (19**0.5 - 4) / 1.5, 0.5 * 19**0.5
    wanted = first + np.array([0.0, *np.cumsum(v * 0.5 ** np.arange(3) * 4 / 3)])
    np.testing.assert_allclose([one.time for one in drive.impacts[:4]], wanted, rtol=1e-7)
    np.testing.assert_allclose([one.energy for one in drive.impacts[:4]], 19 * 0.75 * 0.25 ** np.arange(4), rtol=1e-7)
    assert (drive.final["mass.s"], drive.final["mass.v"]) == (1.0, 0.0)


def test_dogs_go_in_at_a_small_slip() -> None:
    """1 kg m² slows down by 2 rad/s²: its slip of 9 rad/s is 5 at 2 s; then both turn with 5/(1 + 3) rad/s."""
    parts = {
        "brake": ConstantTorque(tau_constant=-2.0), "a": Inertia(J=1.0, phi=0, w=9.0),
        "dogs": DogClutch(w_max=5.0), "b": Inertia(J=3.0, w=0.0),
    }  # fmt: skip
    drive = run(parts, 2.0 + 1e-6, rtol=1e-9)
    (impact,) = drive.impacts
    assert impact.time == pytest.approx(2.0, rel=1e-9)
    assert impact.energy == pytest.approx(0.5 * 0.75 * 25, rel=1e-9)
    assert drive.final["b.w"] == pytest.approx(1.25, rel=1e-5)


def test_dogs_that_are_pulled_out_carry_nothing() -> None:
    parts = {
        "drive": ConstantTorque(tau_constant=4.0), "a": Inertia(J=1.0, phi=0, w=0.0),
        "dogs": DogClutch(), "b": Inertia(J=3.0, w=0.0),
    }  # fmt: skip
    out = Step(offset=1.0, height=-1.0, start_time=1.0)
    wired = {"e": ["out.y", "dogs.engage"]}
    drive = simulate(Assembly("d", parts={**parts, "out": out}, series={"s": [*parts]}, connect=wired), 2.0)
    np.testing.assert_allclose([drive.final["a.w"], drive.final["b.w"]], [5.0, 1.0], rtol=1e-8)
    assert drive.impacts == ()


@pytest.mark.parametrize("gap", [0.0, 1.0])
def test_a_prescribed_motion_works_in_an_impact(gap: float) -> None:
    """1 kg.m2 is taken from rest to 5 rad/s at once: an impulse of 5 N.m.s, 25 J from the source, half of them lost."""
    coupling = RigidBacklash(b=2 * gap, phi_rel=0.0) if gap else Freewheel()
    drive = run({"source": ConstantSpeed(w_fixed=5.0), "coupling": coupling, "b": Inertia(J=1.0, w=0.0)}, 1.0)
    balance = drive.energy()
    assert balance["source"].source == pytest.approx(25.0, rel=1e-9)
    assert balance["coupling"].impact == pytest.approx(12.5, rel=1e-9)
    assert balance["b"].stored == pytest.approx(12.5, rel=1e-9)
    assert balance.notices == ()


# -- several contacts at one instant: Newton's law for each, all at once ----------------------------------------------


SOLVERS = pytest.mark.parametrize("solver", ["idas", "native"])


def carts(masses: list[float], gaps: list[float], speeds: list[float], e: list[float], **options: Any) -> Solution:
    """Run carts in a row; the lines of the gaps are in the opposite order if `turned`."""
    parts: dict[str, Component] = {}
    places = np.concatenate([[0.0], np.cumsum(gaps)])
    for k, (m, s, v) in enumerate(zip(masses, places, speeds, strict=True)):
        parts[f"m{k}"] = Mass(m=m, s=float(s), v=v)
    order = sorted(range(len(gaps)), reverse=options.pop("turned", False))
    parts |= {f"g{k}": Buffer(e=e[k]) for k in order}
    series = {f"s{k}": (f"m{k}", f"g{k}", f"m{k + 1}") for k in order}
    return simulate(Assembly("carts", parts=parts, series=series), 1.0, **options)


def finals(run: Solution, count: int) -> list[float]:
    return [run.final[f"m{k}.v"] for k in range(count)]


@SOLVERS
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("e", "f"), [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0), (1.0, 0.3)])
def test_a_cart_that_is_hit_from_both_sides_at_once(solver: str, turned: bool, e: float, f: float) -> None:
    """2 kg and 1 kg meet 3 kg at rest: v0' - v1' = -e·4, v1' - v2' = -f·2, and 2·4 - 1·2 is conserved."""
    run = carts([2.0, 3.0, 1.0], [2.0, 1.0], [4.0, 0.0, -2.0], [e, f], solver=solver, turned=turned)
    expected = np.linalg.solve([[1, -1, 0], [0, 1, -1], [2, 3, 1]], [-4 * e, -2 * f, 6.0])
    np.testing.assert_allclose(finals(run, 3), expected, atol=1e-9)
    lost = 0.5 * (2 * 16 + 4) - 0.5 * float([2.0, 3.0, 1.0] @ expected**2)
    assert sum(one.energy for one in run.impacts) == pytest.approx(lost, abs=1e-8)


@SOLVERS
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_carts_that_touch_are_hit_as_one_and_others_in_turn(solver: str, e: float) -> None:
    """Touching: 1 kg at 2 m/s meets 2 kg, v = ((1 - 2 e) / 3, (1 + e) / 3)·2. Apart, the second passes it on."""
    together = carts([1.0, 1.0, 1.0], [1.0, 0.0], [2.0, 0.0, 0.0], [e, e], solver=solver)
    np.testing.assert_allclose(finals(together, 3), np.array([1 - 2 * e, 1 + e, 1 + e]) * 2 / 3, atol=1e-9)
    in_turn = carts([1.0, 1.0, 1.0], [1.0, 1e-3], [2.0, 0.0, 0.0], [e, e], solver=solver)
    if e == 1.0:  # Newton's cradle
        np.testing.assert_allclose(finals(in_turn, 3), [0.0, 0.0, 2.0], atol=1e-8)
    assert sum(finals(in_turn, 3)) == pytest.approx(2.0, rel=1e-9)
    assert in_turn.final["m2.v"] >= in_turn.final["m1.v"] >= in_turn.final["m0.v"] - 1e-9


class Bar(Component):
    """A uniform bar above two stops, one at each end."""

    y: Variable = var("m", "height of its centre")
    a: Variable = var("rad", "angle")
    v: Variable = var("m/s", "speed of its centre")
    w: Variable = var("rad/s", "angular velocity")
    left: Variable = var("m/s", "speed of the left end", state="always")
    right: Variable = var("m/s", "speed of the right end", state="always")
    P: Variable = var("N", "force of the left stop, against upward motion")
    Q: Variable = var("N", "force of the right stop, against upward motion")
    m: Parameter = param("kg", "mass", default=3.0)
    L: Parameter = param("m", "length", default=2.0)
    e: Parameter = param("1", "restitution of the left stop", default=0.5)
    f: Parameter = param("1", "restitution of the right stop", default=0.2)
    at_left = Mode("air", "stop", holds={"stop": Hold("left", reaction="P", capacity="limits", restitution="e")})
    at_right = Mode("air", "stop", holds={"stop": Hold("right", reaction="Q", capacity="limits", restitution="f")})

    def limits(self) -> tuple[float, None]:
        return 0.0, None

    def equations(self) -> Equations:
        yield der(self.y) == self.v
        yield der(self.a) == self.w
        yield self.left == self.v - self.w * self.L / 2
        yield self.right == self.v + self.w * self.L / 2
        yield self.m * der(self.v) == -self.P - self.Q
        yield self.m * self.L**2 / 12 * der(self.w) == (self.P - self.Q) * self.L / 2
        yield self.at_left.choose(air=self.P, stop=der(self.left)) == 0
        yield self.at_right.choose(air=self.Q, stop=der(self.right)) == 0

    def events(self) -> Events:
        tip = self.a * self.L / 2
        for mode, height, speed in ((self.at_left, self.y - tip, self.left), (self.at_right, self.y + tip, self.right)):
            yield mode.initially("air", when=speed > 0)
            yield mode.go("air", "stop", when=all_of(height < 0, speed < 0))


@SOLVERS
@pytest.mark.parametrize(("e", "f"), [(0.5, 0.2), (0.0, 0.0), (1.0, 1.0)])
def test_a_bar_lands_on_two_stops_at_once(solver: str, e: float, f: float) -> None:
    """It falls flat at 2 m/s: its ends rise with 2 e and 2 f; the impulses are those of the two balances."""
    run = simulate(Bar(y=1.0, a=0.0, left=-2.0, right=-2.0, e=e, f=f), 0.5 + 1e-6, solver=solver)
    np.testing.assert_allclose([run.final["left"], run.final["right"]], [2 * e, 2 * f], atol=1e-9)
    v, w = e + f, f - e
    lost = 0.5 * 3 * (4 - v**2) - 0.5 * w**2  # J = 1 kg.m2
    assert sum(one.energy for one in run.impacts) == pytest.approx(lost, abs=1e-9)


@SOLVERS
def test_a_bar_lands_on_one_stop(solver: str) -> None:
    """Its left end is lower; P acts at L/2: v + P/m, w - P·(L/2)/J, and the left end rises with e times its speed."""
    run = simulate(Bar(y=1.0, a=0.1, left=-2.0, right=-2.0), 0.45 + 1e-6, solver=solver)
    impulse = (1 + 0.5) * 2 / (1 / 3 + 1)
    assert run.final["right"] == pytest.approx(-2 + impulse / 3 - impulse, rel=1e-9)
    assert run.final["left"] == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("solver", get_args(Solver))
def test_nothing_that_is_struck_gives_energy(seed: int, solver: Solver) -> None:
    """Freewheels in both directions between any two of three wheels: each loses, together what the wheels have lost."""
    rng = np.random.default_rng(seed)
    masses, speeds = rng.integers(1, 4, 3), rng.integers(-4, 5, 3)
    wheels = {f"J{k}": Inertia(J=float(masses[k]), phi=0, w=float(speeds[k])) for k in range(3)}
    pairs = [rng.choice(3, 2, replace=False) for _ in range(3)]
    series = {f"s{k}": (f"J{a}", f"f{k}", f"J{b}") for k, (a, b) in enumerate(pairs)}
    freewheels: dict[str, Component] = {f"f{k}": Freewheel() for k in range(3)}
    drive = simulate(Assembly("drive", parts=wheels | freewheels, series=series), 0.1, solver=solver)
    after = [drive.final[f"J{k}.w"] for k in range(3)]
    assert masses @ after == pytest.approx(masses @ speeds, abs=1e-9)
    assert all(impact.energy > 0 for impact in drive.impacts)
    lost = float(0.5 * masses @ (speeds**2 - np.square(after)))
    assert sum(impact.energy for impact in drive.impacts) == pytest.approx(lost, abs=1e-8)
