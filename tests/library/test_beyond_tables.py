"""What tables do beyond their rows: hold, go on, or end the run; and what they cannot contain."""

from collections.abc import Callable
from math import log

import numpy as np
import pytest

from components import (
    BearingFriction,
    Brake,
    Clutch,
    CombustionEngine,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    ConstantVoltage,
    Fixed,
    FormingForce,
    Ground,
    Inertia,
    LossyGear,
    MappedDrive,
    Mass,
    Sine,
    SupportFriction,
    Table,
    TorqueConverter,
    TranslationalBrake,
    ViscousClutch,
)
from modelica_like import Assembly, Component, ModelicaLikeError, Solution, simulate
from modelica_like.errors import LimitPassed
from modelica_like.show.report.run import notices

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def shaft(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def spun_up(**more: object) -> Assembly:
    clutch = Clutch(fn_max=100.0, mu_pos=((0, 0.3), (100, 0.1)), **more)
    return shaft(source=ConstantSpeed(w_fixed=200.0), clutch=clutch, load=Inertia(J=1.0, phi=0.0, w=0.0))


def test_a_clutch_beyond_its_table_holds_the_last_friction() -> None:
    """10 N.m until the slip is 100 rad/s, at 10 s; then 30 N.m - 0.2 N.m s slip to the lock after 5·ln(3) s more."""
    run = simulate(spun_up(), 20.0, **TIGHT)
    assert run.at(10.0)["load.w"] == pytest.approx(100.0, rel=1e-9)
    lock = next(event.time for event in run.events if event.after == "stuck")
    assert lock == pytest.approx(10.0 + 5.0 * log(3.0), rel=1e-8)
    # Whatever the law of friction, half of the source's work is lost.
    assert run.energy()["clutch"].lost == pytest.approx(0.5 * 200.0**2, rel=1e-8)
    assert run.energy().notices == ()
    assert notices(run) == ["At 0 s clutch leaves the rows of mu_pos: its last value holds."]


def test_inside_its_rows_a_table_tells_nothing() -> None:
    run = simulate(
        shaft(rotor=Inertia(J=1.0, phi=0.0, w=100.0), brake=Brake(fn_max=1.0, mu_pos=((0, 0.3), (100, 0.1)))), 1.0
    )
    assert notices(run) == []
    assert run.events == ()


def test_open_plates_may_slip_as_fast_as_they_like() -> None:
    run = simulate(spun_up(f_normalized=0.0), 1.0)
    assert notices(run) == []


def test_the_first_time_is_told_once() -> None:
    """2 N.m on 1 kg m²: 10 rad/s after 5 s."""
    bearing = BearingFriction(tau_pos=((0, 0), (10, 0)))
    run = simulate(
        shaft(push=ConstantTorque(tau_constant=2.0), rotor=Inertia(J=1.0, phi=0.0, w=0.0), bearing=bearing), 8.0
    )
    assert notices(run) == ["At 5 s bearing leaves the rows of tau_pos: its last value holds."]


def test_an_efficiency_beyond_its_table_stays() -> None:
    """1 kg m² at flange_a is driven with 10 N.m through an efficiency that would reach 1.1 at 20 rad/s."""
    table = ((0, 0.9, 0.9, 0, 0), (10, 1.0, 1.0, 0, 0))
    gear = LossyGear(ratio=1.0, loss_table=table)
    run = simulate(shaft(motor=ConstantSpeed(w_fixed=20.0), gear=gear, load=ConstantTorque(tau_constant=-10.0)), 1.0)
    assert run.final["gear.flange_a.tau"] == pytest.approx(10.0, rel=1e-12)
    assert run.energy().notices == ()


def test_the_last_slope_goes_on_where_it_is_asked_for() -> None:
    """3 N.m + 1 N.m s w against 1 kg m² from 5 rad/s: w = 8·exp(-t) - 3 rad/s."""
    bearing = BearingFriction(tau_pos=((0, 3), (1, 4)), extrapolate="linear")
    run = simulate(shaft(rotor=Inertia(J=1.0, phi=0.0, w=5.0), bearing=bearing), 0.5, **TIGHT)
    np.testing.assert_allclose(run["rotor.w"], 8 * np.exp(-run.time) - 3, rtol=1e-8)
    assert notices(run) == []


def test_the_run_ends_where_it_is_asked_for() -> None:
    bearing = BearingFriction(tau_pos=((0, 0), (10, 0)), extrapolate="error")
    drive = shaft(push=ConstantTorque(tau_constant=2.0), rotor=Inertia(J=1.0, phi=0.0, w=0.0), bearing=bearing)
    with pytest.raises(LimitPassed, match=r"At 5 s bearing leaves the rows of tau_pos\.") as caught:
        simulate(drive, 8.0)
    run: Solution = caught.value.run
    assert run.time[-1] == pytest.approx(5.0, rel=1e-9)
    assert run.final["rotor.w"] == pytest.approx(10.0, rel=1e-9)


ROWS = {"w_scale": 0.5, "extrapolate": "error"}
SLIDING = {"v_scale": 0.5, "extrapolate": "error"}
ENDS: dict[str, Component] = {
    "bearing": BearingFriction(tau_pos=((0, 1), (10, 2)), **ROWS),
    "brake": Brake(fn_max=1.0, mu_pos=((0, 0.3), (10, 0.4)), **ROWS),
    "gear": LossyGear(ratio=1.0, loss_table=((0, 1, 1, 1, 1), (10, 1, 1, 2, 2)), **ROWS),
    "drive": MappedDrive(limit=((0, 1), (10, 2)), Jr=0.0, tau_ref=0.0, **ROWS),
    "slideway": SupportFriction(f_pos=((0, 1), (10, 2)), **SLIDING),
    "slide brake": TranslationalBrake(fn_max=1.0, mu_pos=((0, 0.3), (10, 0.4)), **SLIDING),
}


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("name", ENDS)
def test_the_last_row_counts_in_its_scale_and_in_both_directions(name: str, sign: int) -> None:
    """The last row is 10, which is 5 rad/s or 5 m/s."""
    turns = "slide" not in name
    push: Component = ConstantTorque(tau_constant=40.0 * sign) if turns else ConstantForce(f_constant=40.0 * sign)
    body: Component = Inertia(J=1.0, phi=0.0, w=0.0) if turns else Mass(m=1.0, s=0.0, v=0.0)
    parts = {"push": push, "body": body, "part": ENDS[name]}
    if name == "gear":
        parts["load"] = Inertia(J=1.0)
    series, wires = {"s": list(parts)}, dict[str, list[str]]()
    if name == "drive":
        parts |= {"supply": ConstantVoltage(V=100.0), "ground": Ground()}
        wires = {
            "plus": ["supply.p", "part.p_dc"],
            "minus": ["supply.n", "part.n_dc", "ground.p"],
            "shaft": ["body.flange_b", "part.flange"],
        }
        series = {"s": ["push", "body"]}
    with pytest.raises(LimitPassed, match="part leaves the rows") as caught:
        simulate(Assembly("d", parts=parts, series=series, connect=wires), 5.0)
    assert caught.value.run.final["body.w" if turns else "body.v"] == pytest.approx(5.0 * sign, rel=1e-8)


def test_an_open_brake_does_not_slide_beyond_its_rows() -> None:
    brake = TranslationalBrake(fn_max=1.0, mu_pos=((0, 0.3), (10, 0.4)), f_normalized=0.0, **SLIDING)
    parts: dict[str, Component] = {"body": Mass(m=1.0, s=0.0, v=50.0), "brake": brake}
    assert simulate(Assembly("d", parts=parts, series={"s": list(parts)}), 1.0).final["body.v"] == 50.0


@pytest.mark.parametrize(("how", "expected"), [("linear", 4.0), ("hold", 2.0)])
@pytest.mark.parametrize("smooth", [False, True])
def test_a_signal_beyond_its_table(how: str, expected: float, smooth: bool) -> None:
    run = simulate(Assembly("d", parts={"s": Table(table=((0, 0), (1, 2)), extrapolate=how, smooth=smooth)}), 2.0)
    assert run.final["s.y"] == pytest.approx(expected, rel=1e-12)


def pressed(command: Component, **more: object) -> Assembly:
    parts = {"command": command, "motor": ConstantSpeed(w_fixed=100.0), "clutch": Clutch(capacity=10.0)}
    parts["load"] = Inertia(J=1.0, phi=0.0, w=0.0)
    #: Inertia(J=1.0, phi=0.0, w=0.0)}
    wires = {"press": ["command.y", "clutch.f_normalized"]}
    return Assembly("d", parts=parts, series={"s": ["motor", "clutch", "load"]}, connect=wires)


COMMAND = ((0, 0), (0.2, 0.4), (0.3, 1))


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_command_holds_behind_its_table(solver: str) -> None:
    """10 N.m on 1 kg m²: 1.1 rad/s until 0.3 s, then 17 rad/s more until 2 s."""
    run = simulate(pressed(Table(table=COMMAND)), 2.0, solver=solver, **TIGHT)
    assert run.final["load.w"] == pytest.approx(10 * (0.04 + 0.07 + 1.7), rel=1e-9)
    assert notices(run) == ["At 0.300000001 s command has no more rows: its last value holds."]


def test_a_table_that_ends_flat_or_with_the_run_tells_nothing() -> None:
    assert notices(simulate(pressed(Table(table=(*COMMAND, (0.4, 1)))), 2.0)) == []
    assert notices(simulate(pressed(Table(table=COMMAND)), 0.3)) == []


def test_a_table_that_begins_late() -> None:
    run = simulate(pressed(Table(table=((0.5, 0.2), (1, 0.4), (2, 0.4)))), 1.0)
    assert notices(run) == ["At 0 s command has no rows yet: its first value counts."]
    assert run.final["load.w"] == pytest.approx(10 * (0.1 + 0.15), rel=1e-6)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_command_above_one_is_told(solver: str) -> None:
    """A slope of 6/s from 1 at 0.3 s makes 11.2 at 2 s."""
    first, second = notices(simulate(pressed(Table(table=COMMAND, extrapolate="linear")), 2.0, solver=solver))
    assert first == "At 0.300000001 s command has no more rows: its last slope goes on."
    assert second == "At 0.300000167 s clutch gets a command above 1: f_normalized reaches 11.2."


def test_the_largest_command_is_none_of_the_results() -> None:
    """1 + 0.5 sin(2 pi t) is 1 at all three results."""
    (told,) = notices(simulate(pressed(Sine(amplitude=0.5, offset=1.0, f=1.0)), 1.0, points=2))
    assert told.endswith("clutch gets a command above 1: f_normalized reaches 1.5.")


@pytest.mark.parametrize("name", ["f_normalized", "pedal", "fill"])
def test_every_normalised_command_is_told_above_one(name: str) -> None:
    """By a value of the part itself, too; 1 itself is no excess."""
    made: dict[str, Callable[[float], Component]] = {
        "f_normalized": lambda u: Brake(capacity=1.0, f_normalized=u),
        "pedal": lambda u: CombustionEngine(
            speeds=(0, 400), pedals=(0, 1), torque=((0, 100), (0, 100)), drag=((0, 1), (400, 1)), J=0.1, pedal=u
        ),
        "fill": lambda u: ViscousClutch(tau_nominal=1.0, w_nominal=10.0, fill=u),
    }
    for value, told in ((1.0, []), (1.5, [f"At 0 s part gets a command above 1: {name} reaches 1.5."])):
        far = [Fixed()] if name == "fill" else []
        parts = {"source": ConstantSpeed(w_fixed=10.0), "part": made[name](value), **dict(zip("f", far, strict=False))}
        assert notices(simulate(shaft(**parts), 0.1)) == told


def test_a_signal_that_ends_the_run() -> None:
    signal = Assembly("d", parts={"s": Table(table=((0, 0), (1, 2)), extrapolate="error")})
    assert simulate(signal, 1.0).final["s.y"] == 2.0
    with pytest.raises(LimitPassed, match="At 1 s s has no more rows"):
        simulate(signal, 2.0)
    late = Assembly("d", parts={"s": Table(table=((1000, 0), (1000.1, 2)), extrapolate="error")})
    with pytest.raises(LimitPassed) as caught:
        simulate(late, 1002.0, t0=1000.0)
    assert caught.value.run.time[-1] - 1000.1 == pytest.approx(0.0, abs=1e-9)


WRONG = {
    "LossyGear.loss_table, row 1, eta_mf1: 1.1 is above 1": lambda: LossyGear(ratio=1, loss_table=((0, 1.1, 1, 0, 0),)),
    "LossyGear.loss_table, row 1, eta_mf2: 1.2 is above 1": lambda: LossyGear(ratio=1, loss_table=((0, 1, 1.2, 0, 0),)),
    "row 2, sliding friction coefficient: -0.1 is below 0": lambda: Clutch(fn_max=1, mu_pos=((0, 0.1), (1, -0.1))),
    "friction force: '-1 N' is below 0": lambda: SupportFriction(f_pos=((0, "-1 N"),)),
    "extrapolate = 'holt' must be hold or linear or error.": lambda: Brake(extrapolate="holt"),
}


@pytest.mark.parametrize("told", WRONG)
def test_what_a_table_cannot_contain(told: str) -> None:
    with pytest.raises(ModelicaLikeError) as caught:
        WRONG[told]()
    assert told in str(caught.value)


CAPACITY = ((0.0, 2e-3), (0.8, 1.5e-3), (1.0, 0.0))


@pytest.mark.parametrize(
    ("ratio", "at", "worst"),
    [
        (((0.0, 2.0), (0.85, 1.2)), "1", "1.2"),  # it holds up to the speed ratio 1
        (((0.0, 2.5), (1.0, 1.0)), "0.8333", "1.25"),  # the top of x·(2.5 - 1.5 x)
        (((0.0, 1.5), (0.5, 2.2), (1.0, 0.0)), "0.5", "2.2"),
        (((0.0, 1.9), (0.5, 1.9), (0.9, 1.1), (1.0, 1.0)), "0.725", "1.45"),  # the top of x·(2.9 - 2 x)
        (((0.0, 1.0), (0.5, 1.5), (1.5, 1.0)), "1", "1.25"),  # of rows beyond, only what they say of 1 counts
    ],
)
def test_no_converter_gives_more_than_it_takes(ratio: tuple[tuple[float, float], ...], at: str, worst: str) -> None:
    converter = TorqueConverter(capacity=CAPACITY, torque_ratio=ratio)
    with pytest.raises(ModelicaLikeError, match=f"torque ratio {worst} at the speed ratio {at} the turbine gives"):
        simulate(shaft(pump=ConstantSpeed(w_fixed=100.0), part=converter, load=ConstantSpeed(w_fixed=90.0)), 1.0)


def test_a_converter_has_no_jump_at_any_speed_of_its_pump() -> None:
    """The pump passes through standstill, and both turn against each other with the same speed."""

    def torques(pump: float, turbine: float) -> np.ndarray:
        converter = TorqueConverter(capacity=CAPACITY, torque_ratio=((0.0, 1.9), (0.8, 1.0)))
        run = simulate(
            shaft(pump=ConstantSpeed(w_fixed=pump), part=converter, load=ConstantSpeed(w_fixed=turbine)), 0.1
        )
        assert run["part.loss_power"][-1] > 0
        assert run.energy().imbalance == 0
        return np.array([run.final[f"part.flange_{end}.tau"] for end in "ab"])

    for pump, turbine in ((0.0, 100.0), (-100.0, 100.0), (0.0, -50.0), (100.0, -100.0)):
        before, after = torques(pump - 1e-5, turbine), torques(pump + 1e-5, turbine)
        np.testing.assert_allclose(before, after, atol=2e-5)
    # Standing pump, turning turbine: C(0)·w² brakes the turbine and drives the pump.
    np.testing.assert_allclose(torques(0.0, 100.0), [-20.0, 20.0], rtol=1e-12)


def test_the_compiled_run_time_ends_there_too() -> None:
    bearing = BearingFriction(tau_pos=((0, 0), (10, 0)), extrapolate="error")
    drive = shaft(push=ConstantTorque(tau_constant=2.0), rotor=Inertia(J=1.0, phi=0.0, w=0.0), bearing=bearing)
    with pytest.raises(ModelicaLikeError, match=r"At 5 s bearing leaves the rows of tau_pos\."):
        simulate(drive, 8.0, solver="native")


MAP = {"torque": ((0, 50), (0, 100), (0, 150)), "speeds": (0, 100, 200), "pedals": (0, 0.5), "J": 1e9, "phi": 0.0}
EFFICIENCY = {"limit": ((0, 100), (200, 100)), "speeds": (0, 100), "torques": (0, 20), "eta": ((0.5, 0.7), (0.6, 0.9))}


def driven(w: float, torque: float, **more: object) -> Assembly:
    drive = MappedDrive(Jr=0.0, tau_ref=torque, tau=torque, **EFFICIENCY, **more)
    parts = {"supply": ConstantVoltage(V=100.0), "ground": Ground(), "part": drive, "held": ConstantSpeed(w_fixed=w)}
    wires = {"plus": ["supply.p", "part.p_dc"], "minus": ["supply.n", "part.n_dc", "ground.p"]}
    return Assembly("d", parts=parts, connect=wires | {"shaft": ["part.flange", "held.flange"]})


def fired(w: float, pedal: float, **more: object) -> Assembly:
    return shaft(part=CombustionEngine(w=w, pedal=pedal, **MAP, **more), body=Inertia(J=1.0))


EDGES: dict[str, tuple[Callable[..., Assembly], float, float]] = {
    "speeds": (driven, 150.0, 10.0), "torques": (driven, -50.0, -50.0), "pedals": (fired, 150.0, 1.0),
}  # fmt: skip


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("name", EDGES)
def test_a_map_is_left_at_each_of_its_edges(name: str, solver: str) -> None:
    made, w, other = EDGES[name]
    told = notices(simulate(made(w, other), 0.1, solver=solver))
    assert told == [f"At 0 s part leaves the rows of {name}: its last value holds."]
    with pytest.raises(LimitPassed, match=f"At 0 s part leaves the rows of {name}"):
        simulate(made(w, other, extrapolate="error"), 0.1, solver=solver)
    assert notices(simulate(made(50.0, 0.4), 0.1, solver=solver)) == []


@pytest.mark.parametrize("torque", [50.0, -50.0])
def test_the_last_slope_makes_no_efficiency_above_one(torque: float) -> None:
    """At 150 rad/s and 50 N.m the slopes of the map lead to 1.525."""
    run = simulate(driven(150.0, torque, extrapolate="linear"), 0.1)
    assert run.final["part.efficiency"] == 1.0
    assert run.final["part.i_dc"] == pytest.approx(150.0 * torque / 100.0, rel=1e-9)


def test_the_last_slope_makes_no_power_from_friction() -> None:
    """0.3 falls to zero at 150 rad/s: above it the brake does nothing, and below 10·(0.3 - 0.002 w) N.m."""
    brake = Brake(fn_max=10.0, mu_pos=((0, 0.3), (100, 0.1)), extrapolate="linear")
    run = simulate(shaft(rotor=Inertia(J=1.0, phi=0.0, w=200.0), brake=brake), 1.0)
    assert run.final["rotor.w"] == 200.0
    table = ((0, 0.9, 0.9, 0, 0), (100, 0.5, 0.5, 0, 0))
    gear = LossyGear(ratio=2.0, loss_table=table, extrapolate="linear")
    run = simulate(shaft(motor=ConstantSpeed(w_fixed=300.0), gear=gear, load=ConstantTorque(tau_constant=-20.0)), 1.0)
    assert run.final["gear.flange_a.tau"] == pytest.approx(10.0 / 1e-3, rel=1e-9)  # the smallest efficiency of a cell


def test_a_workpiece_beyond_its_table_is_told_while_it_resists() -> None:
    for last, told in ((0.0, []), (5.0, ["At 0.1 s part leaves the rows of table: its last value holds."])):
        force = FormingForce(table=((0, 0), (0.05, 5), (0.1, last)))
        run = simulate(shaft(slide=Mass(m=1e9, s=0.0, v=1.0), part=force), 0.2)
        assert notices(run) == told
