"""Operating points and characteristic curves against closed forms."""

from pathlib import Path

import numpy as np
import pytest

from components import (
    AngleSensor,
    AsynchronousMachine,
    BearingFriction,
    Clutch,
    Constant,
    ConstantTorque,
    Freewheel,
    FrequencyMeter,
    Inertia,
    LinearSpeedDependentTorque,
    LossyGear,
    P,
    PulseCounter,
    PulseSensor,
    SpeedDependentLoad,
    SpeedSensor,
    SpringDamper,
    Torque,
    UniformNoise,
    ZeroOrderHold,
)
from modelica_like import Assembly, build, simulate
from modelica_like.analyse.operating.curves import characteristic
from modelica_like.analyse.operating.steady import steady, steady_slopes
from modelica_like.errors import InitializationError, UnknownName, ValueOutOfRange
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Input,
    Output,
    Parameter,
    Variable,
    absolute,
    clock,
    der,
    discrete,
    guess,
    param,
    pre,
    series,
    signal_in,
    signal_out,
    var,
    when,
)

EXAMPLES = Path(__file__).parents[2] / "examples"
# Document 002, set A: the measured speed line and the no-load current exactly.
K, R, FRICTION, SUPPLY = 0.04668892, 0.7943932, 0.04949025, 24.0


@pytest.fixture(scope="module")
def motor():
    return build(EXAMPLES / "dc_bench_motor.toml", free=["first_load"])


def current(torque):
    return (torque + FRICTION) / K


def speed(torque):
    return (SUPPLY - R * current(torque)) / K


def test_an_implicit_unknown_without_a_steady_value_is_named():
    class Open(Component):
        x: Variable = var("1", "state")
        y: Variable = var("1", "implicit")
        T: Parameter = param("s", "time constant", default=1.0)

        def equations(self) -> Equations:
            yield self.T * der(self.x) == -self.x
            yield self.y**2 + self.y + 1 + self.x == 0

    with pytest.raises(InitializationError, match="y keeps changing"):
        simulate(Open(), 1.0, start="steady")


def test_characteristic_curves_of_the_motor(motor):
    torques = np.linspace(0.0, 0.25, 6)
    curves = characteristic(motor, {"first_load": torques})
    np.testing.assert_allclose(curves["motor.ia"], current(torques), rtol=1e-9)
    np.testing.assert_allclose(curves["motor.w"], speed(torques), rtol=1e-9)
    efficiency = torques * speed(torques) / (SUPPLY * current(torques))
    np.testing.assert_allclose(curves["efficiency"], efficiency, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(curves["loss"], (1 - efficiency) * SUPPLY * current(torques), rtol=1e-9)
    assert curves.unit("motor.w") == "rad/s"
    above, below = curves.plot("motor.w", "efficiency").axes
    assert (above.get_ylabel(), below.get_ylabel()) == ("motor.w in rad/s", "efficiency")
    np.testing.assert_array_equal(below.lines[0].get_ydata(), curves["efficiency"])
    with pytest.raises(UnknownName, match=r"There is no 'motor\.speed' in these curves"):
        curves.unit("motor.speed")


def test_the_load_that_holds_a_speed(motor):
    """TARGETS of document 002: 0.2116379 N.m at 4000/min."""
    point = steady(motor, {"motor.w": "4000 rpm"}, by="first_load")
    assert point["motor.w"] == pytest.approx(4000 * np.pi / 30, rel=1e-11)
    assert point["first_load"] == pytest.approx(0.2116379, abs=1e-7)
    assert point["first_load"] == pytest.approx(K * (SUPPLY - K * point["motor.w"]) / R - FRICTION, rel=1e-9)
    assert point.losses == pytest.approx({"motor": R * point["motor.ia"] ** 2, "bearing": FRICTION * point["motor.w"]})
    assert str(point).splitlines()[0] == "Operating point of dc_bench_motor"


def test_curve_over_a_held_variable(motor):
    speeds = np.array([4000.0, 4500.0]) * np.pi / 30
    curves = characteristic(motor, {"motor.w": speeds}, by="first_load")
    np.testing.assert_allclose(curves["first_load"], K * (SUPPLY - K * speeds) / R - FRICTION, rtol=1e-9)


def test_two_held_by_two(motor):
    model = build(EXAMPLES / "dc_bench_motor.toml", free=["first_load", "supply"])
    point = steady(model, {"motor.w": 400.0, "motor.ia": 4.0}, by=["first_load", "supply"])
    assert point["supply"] == pytest.approx(K * 400.0 + R * 4.0, rel=1e-9)
    assert point["first_load"] == pytest.approx(K * 4.0 - FRICTION, rel=1e-9)


def test_wrong_calls(motor):
    with pytest.raises(ValueOutOfRange, match="each held variable needs one parameter"):
        steady(motor, {"motor.w": 400.0})
    with pytest.raises(UnknownName, match=r"no variable 'motor.speed'"):
        steady(motor, {"motor.speed": 400.0}, by="first_load")
    with pytest.raises(UnknownName, match="no input or parameter 'load'"):
        steady(motor, {"motor.w": 400.0}, by="load")
    with pytest.raises(InitializationError, match="cannot be held by last_load"):
        steady(motor, {"motor.w": 400.0}, by="last_load")
    with pytest.raises(ValueOutOfRange, match="varies one quantity, not 2"):
        characteristic(motor, {"first_load": [0.1], "supply": [24.0]})


def test_a_gearbox_begins_from_a_run_that_has_closed_its_clutches():
    """Document 001, first gear: ratio (1 + 1/1.917)·2.74, efficiency 0.96368 with 0.99 in every mesh."""
    gears = EXAMPLES / "lepelletier_gears.toml"
    point = steady(gears, near=simulate(gears, "2 s"))
    assert point["motor.w"] / point["load.w"] == pytest.approx((1 + 1 / 1.917) * 2.74, rel=1e-9)
    assert point.efficiency == pytest.approx(0.96368, abs=5e-6)
    assert point.stuck == ("box.clutch_a", "box.brake_d")


def test_a_gearbox_finds_what_sticks_without_a_run():
    """Sliding either way, the brake would pull the carrier through standstill; in between it holds it."""
    point = steady(EXAMPLES / "lepelletier_gears.toml")
    assert point["motor.w"] / point["load.w"] == pytest.approx((1 + 1 / 1.917) * 2.74, rel=1e-9)
    assert point.stuck == ("box.clutch_a", "box.brake_d")


def test_a_gear_that_locks_itself_is_told():
    """A worm of efficiency 0.4 is not turned by its load, before its motor is switched on."""
    point = steady(EXAMPLES / "components" / "self_locking_worm.toml", parameters={"on.start_time": 1.0})
    assert point.stuck == ("worm",)
    assert point["worm.w_a"] == 0.0


class Accelerated(Component):
    def build(self) -> None:
        self.torque = ConstantTorque(tau_constant=0.0)
        self.mass = Inertia(J=1.0, w=0.0, phi=0.0)

    def equations(self) -> Equations:
        yield from series(self.torque, self.mass)


def test_a_point_without_steady_state_is_named():
    """Without friction, only no torque at all keeps a speed."""
    with pytest.raises(InitializationError, match=r"At torque.tau_constant = 5.0: No steady state"):
        characteristic(Accelerated(), {"torque.tau_constant": [0.0, 5.0]})


class TwoFans(Component):
    """A torque T turns two fans, one behind a clutch: T = 3 N.m w/(100 rad/s) + 5 N.m (w/(100 rad/s))²."""

    motor = ConstantTorque(tau_constant=10.0)
    rotor = Inertia(J=0.1, w=guess(100.0), phi=0)
    first = SpeedDependentLoad(b=3.0, p=1.0, w_ref=100.0)
    coupling = Clutch(capacity=100.0)
    wheel = Inertia(J=0.2, w=guess(100.0))
    second = SpeedDependentLoad(b=5.0, p=2.0, w_ref=100.0)

    def equations(self) -> Equations:
        yield from series(self.motor, self.rotor, self.coupling, self.wheel, self.second)
        yield from series(self.rotor, self.first)


def speed_of_fans(torque):
    return 10.0 * (np.sqrt(9.0 + 20.0 * torque) - 3.0)


@pytest.fixture(scope="module")
def fans():
    return build(TwoFans())


@pytest.mark.parametrize("torque", [10.0, 20.0, 30.0])
def test_a_clutch_that_sticks_turns_as_one(fans, torque):
    near = steady(fans)
    for begin in (None, near, simulate(fans, "20 s", start="rest")):
        point = steady(fans, parameters={"motor.tau_constant": torque}, near=begin)
        assert (point["rotor.w"], point["wheel.w"]) == pytest.approx([speed_of_fans(torque)] * 2, rel=1e-12)
        assert point.stuck == ("coupling",)
        assert sum(point.losses.values()) == pytest.approx(torque * point["rotor.w"], rel=1e-12)


def test_a_torque_that_holds_a_speed_through_a_clutch(fans):
    point = steady(fans, {"wheel.w": 150.0}, by="motor.tau_constant")
    assert point["motor.tau_constant"] == pytest.approx(3.0 * 1.5 + 5.0 * 1.5**2, rel=1e-11)


def test_a_freewheel_that_drives_turns_as_one():
    """5 N.m against 1 N.m + 1 N.m s/rad w: 4 rad/s, before and behind the freewheel."""

    class Driven(Component):
        motor, rotor, freewheel = ConstantTorque(tau_constant=5.0), Inertia(J=0.1, phi=0), Freewheel()
        wheel = Inertia(J=0.2, w=guess(1.0))
        bearing = BearingFriction(tau_pos=((0, 1), (1, 2)), extrapolate="linear")

        def equations(self) -> Equations:
            yield from series(self.motor, self.rotor, self.freewheel, self.wheel, self.bearing)

    point = steady(Driven())
    assert (point["rotor.w"], point["wheel.w"]) == pytest.approx((4.0, 4.0), rel=1e-12)
    assert point["freewheel.tau"] == pytest.approx(-5.0, rel=1e-12)


@pytest.mark.parametrize(("name", "value"), [("box.front_ratio", -2.0), ("box.small_ratio", 3.0)])
def test_other_ratios_keep_clutches_closed(name, value):
    """The slip of the brake that holds the carrier depends on the ratios, and stays zero: (1 - 1/front)·small."""
    model = build(EXAMPLES / "lepelletier_gears.toml", free=["box.front_ratio", "box.small_ratio"])
    near = simulate(model, "2 s")
    point = steady(model, parameters={name: value}, near=near)
    ratio = (1 - 1 / point["box.front_ratio"]) * point["box.small_ratio"]
    assert point["motor.w"] / point["load.w"] == pytest.approx(ratio, rel=1e-12)
    assert point["box.brake_d.w"] == pytest.approx(0.0, abs=1e-12)
    held = steady(model, {"load.w": 1.01 * point["load.w"]}, "box.small_ratio", parameters={name: value}, near=point)
    assert held["box.small_ratio"] == pytest.approx(point["box.small_ratio"] / 1.01, rel=1e-9)


@pytest.mark.parametrize(
    "drive",
    [
        "dc_bench_motor", "dc_machines/series", "fan", "lepelletier_gears", "machine_tool_startup", "stick_slip",
        "msl/dcmachines/DCPM_withLosses", "msl/translational/Friction",
    ],
)  # fmt: skip
def test_powers_are_in_balance(drive):
    model = build(EXAMPLES / f"{drive}.toml")
    powers = steady(model, near=simulate(model, model.settings.get("until", 1.0))).powers.values()
    brought = sum(source for source, _ in powers)
    assert brought > 0.1
    assert sum(loss for _, loss in powers) == pytest.approx(brought, rel=1e-9)


class Stateless(Component):
    """Its unknown has the closed form p = z + z³."""

    p: Parameter = param("1", "load", default=10.0)
    z: Variable = var("1", "unknown", guess=1.0)

    def equations(self) -> Equations:
        yield self.z + self.z**3 == self.p


def test_a_model_without_states_is_steady():
    found = steady(Stateless())
    assert found["z"] == pytest.approx(2.0)
    assert steady(Stateless(), near=found, parameters={"p": 68.0})["z"] == pytest.approx(4.0)
    assert steady(Stateless(), hold={"z": 3.0}, by=["p"])["p"] == pytest.approx(30.0)


@pytest.mark.parametrize("line", [["rotor", "gear", "shaft", "table"], ["rotor", "shaft", "gear", "table"]])
def test_drives_with_friction_at_both_ends_turn_steadily(line):
    """In either order: gear and load have speeds that are states, but a drive has one absolute angle."""
    parts = {
        "motor": ConstantTorque(tau_constant=10.0), "rotor": Inertia(J=0.1),
        "gear": LossyGear(ratio=2.0, loss_table=[(0.0, 0.9, 0.8, 0.1, 0.1)]), "shaft": SpringDamper(c=400.0, d=0.2),
        "table": Inertia(J=0.8), "load": SpeedDependentLoad(a=0.0, b=10.0, w_ref=10.0, p=1.0),
    }  # fmt: skip
    found = steady(Assembly("drive", parts=parts, series={"line": ("motor", *line, "load")}))
    assert found["table.w"] == pytest.approx(2.0 * (0.9 * 10.0 - 0.1))
    assert found["rotor.w"] == pytest.approx(2.0 * found["table.w"])


# -- samplers ----------------------------------------------------------------------------------------------------------

LOAD = 2.0
"""Torque of the load over the speed in N.m.s."""


def turned(wires, w=0.0, **parts):
    """A torque turns 1 kg.m² under a load; blocks make it of the speed, which a sensor tells."""
    given = {
        "drv": Torque(), "rotor": Inertia(J=1.0, phi=0.0, w=w), "s": SpeedSensor(), **parts,
        "load": LinearSpeedDependentTorque(tau_nominal=-2.0 * LOAD, w_nominal=2.0),
    }  # fmt: skip
    wires = {f"w{k}": wire.split() for k, wire in enumerate(wires)} | {"l": ["load.flange", "rotor.flange_b"]}
    return Assembly("turned", parts=given, series={"line": ["drv", "rotor", "s"]}, connect=wires)


def controlled(k, **parts):
    """Torque k·(ref - speed as it was sampled)."""
    wires = ["ref.y ctl.u_s", "s.w hold.u", "hold.y ctl.u_m", "ctl.y drv.tau"]
    return turned(wires, **{"ref": Constant(k=10.0), "ctl": P(k=k), "hold": ZeroOrderHold(period=0.1), **parts})


class Adding(Component):
    """Adds up k times what it is from 10 at each tick: a digital integral controller."""

    units_checked = False
    u: Input = signal_in("*", "speed")
    y: Output = signal_out("*", "torque")
    k: Parameter = param("1", "gain of a sample", default=0.5)
    sum: Discrete = discrete("*", "what was added up")

    def equations(self) -> Equations:
        yield self.y == self.sum

    def events(self) -> Events:
        yield when(clock(0.1), {self.sum: pre(self.sum) + self.k * (10 - self.u)})


@pytest.mark.parametrize("k", [1.0, 5.0, 30.0])
def test_what_samplers_keep_is_steady_too(k):
    """k·(10 - w) = 2·w, whether the sampled loop gets there (k = 1) or runs away (k = 30)."""
    found = steady(controlled(k))
    assert found["rotor.w"] == pytest.approx(10 * k / (k + LOAD), rel=1e-12)
    assert (found["hold.last"], found["hold.y"]) == pytest.approx(2 * (found["rotor.w"],), rel=1e-12)


def test_parameters_are_found_through_samplers():
    """3 rad/s ask for 5·(ref - 3) = 2·3; a curve follows w = 5·ref/7."""
    found = steady(controlled(5.0), hold={"rotor.w": 3.0}, by="ref.k")
    assert found["ref.k"] == pytest.approx(4.2, rel=1e-12)
    curves = characteristic(controlled(5.0), {"ref.k": [1.0, 10.0]})
    np.testing.assert_allclose(curves["rotor.w"], [5 / 7, 50 / 7], rtol=1e-12)
    curves = characteristic(controlled(5.0), {"rotor.w": [1.0, 10.0]}, by="ref.k")
    np.testing.assert_allclose(curves["ref.k"], [7 / 5, 70 / 5], rtol=1e-12)


def test_the_slopes_of_steady_states_pass_samplers():
    """w = k·ref/(k + 2): by k 2·ref/(k + 2)², by ref k/(k + 2)."""
    found = steady(controlled(5.0))
    slopes = steady_slopes(found.model, found.point, ["rotor.w", "hold.y"], ["ctl.k", "ref.k"])
    np.testing.assert_allclose(slopes, 2 * [[20 / 49, 5 / 7]], rtol=1e-12)


def test_a_run_that_has_not_settled_is_a_beginning_only():
    drive = controlled(5.0)
    found = steady(drive, near=simulate(drive, 0.35))
    assert found["rotor.w"] == pytest.approx(50 / 7, rel=1e-12)


def test_a_sampled_integral_leaves_no_error():
    found = steady(turned(["s.w ctl.u", "ctl.y drv.tau"], ctl=Adding()))
    assert (found["rotor.w"], found["ctl.sum"]) == pytest.approx((10.0, 10.0 * LOAD), rel=1e-12)


def test_samples_of_a_given_signal_and_samples_of_samples():
    """2·w = ref after both; and what is sampled for display only is read as it is after ticks."""
    parts = {"ref": Constant(k=10.0), "first": ZeroOrderHold(period=0.1), "second": ZeroOrderHold(period=0.03)}
    wires = ["ref.y first.u", "first.y second.u", "second.y drv.tau", "s.w shown.u"]
    drive = turned(wires, **parts, shown=ZeroOrderHold(period=0.5))
    found = steady(drive)
    assert (found["rotor.w"], found["shown.y"]) == pytest.approx((5.0, 5.0), rel=1e-12)
    assert steady(drive, hold={"shown.y": 3.0}, by="ref.k")["ref.k"] == pytest.approx(6.0, rel=1e-12)


def test_a_start_that_samples_would_move_is_refused():
    drive = controlled(5.0)
    for solver in ("native", "idas"):
        with pytest.raises(InitializationError, match=r"hold\.last changes at the next tick, and the motion with it"):
            simulate(drive, 1.0, start="steady", solver=solver)
    # Nothing moves, and nothing will.
    still = simulate(controlled(5.0, ref=Constant(k=0.0)), 1.0, start="steady")
    assert np.abs(still["rotor.w"]).max() == 0.0


METERED = ["a.flange rotor.flange_b", "meter.y ctl.u_m", "ref.y ctl.u_s", "ctl.y drv.tau"]
PULSES = ["hall.flange rotor.flange_b", "hall.y count.u", "count.y meter.u", *METERED]


def metered(wires, k=5.0, **parts):
    """Torque k·(10 - what a frequency meter shows)."""
    given = {"ref": Constant(k=10.0), "ctl": P(k=k), "a": AngleSensor(), "meter": FrequencyMeter(period=0.1), **parts}
    return turned(wires, **given)


def counted():
    return {"hall": PulseSensor(n=4), "count": PulseCounter(u_high=0.5)}


def noisy():
    return turned(["noise.y drv.tau"], noise=UniformNoise(period=0.1, y_min=-1.0, y_max=1.0))


@pytest.mark.parametrize(
    ("drive", "named"),
    [
        (noisy, "noise.uniform"),
        (lambda: metered(["a.phi meter.u", *METERED]), "meter.last"),
        (lambda: metered(PULSES, **counted()), "meter.last"),
    ],
)
def test_what_never_settles_is_named(drive, named):
    """Noise, and the speed of an angle or of pulses that are sampled: they grow from tick to tick."""
    with pytest.raises(InitializationError, match=named):
        steady(drive())


def test_what_is_only_read_and_never_settles_has_no_value():
    """10 N.m turn the load: pulses are counted, and their frequency shown; what is sampled is the speed."""
    parts = {**counted(), "zero": Constant(k=0.0), "shown": ZeroOrderHold(period=0.1)}
    wires = ["hall.flange rotor.flange_b", "hall.y count.u", "count.y meter.u", "a.flange rotor.flange_b"]
    wires += ["ref.y ctl.u_s", "zero.y ctl.u_m", "ctl.y drv.tau", "s.w shown.u"]
    found = steady(metered(wires, 1.0, **parts))
    assert (found["rotor.w"], found["shown.y"]) == pytest.approx((10.0 / LOAD, 10.0 / LOAD), rel=1e-12)
    assert all(np.isnan(found[name]) for name in ("meter.y", "count.number", "count.y"))


def test_which_of_two_steady_states_is_stable():
    """Kloss: s = s_k·(q ± sqrt(q² - 1)), q = tau_k/tau; small motions go with -J·dw' = dtau/ds·dw/w_s."""
    tau_k, s_k, load, J, w_s = 100.0, 0.2, 50.0, 0.1, 50 * np.pi
    for sign, near in ((-1, 150.0), (1, 50.0)):
        machine = AsynchronousMachine(p=2, Jr=J, tau_k=tau_k, s_k=s_k, w=near)
        parts = {"machine": machine, "load": ConstantTorque(tau_constant=-load)}
        drive = Assembly("d", parts=parts, series={"s": list(parts)})
        point = steady(drive)
        q = tau_k / load
        s = s_k * (q + sign * np.sqrt(q**2 - 1))
        assert point["machine.w"] == pytest.approx(w_s * (1 - s), rel=1e-9)
        slope = 2 * tau_k * s_k * (s_k**2 - s**2) / (s**2 + s_k**2) ** 2
        rate = -slope / w_s / J
        assert (rate > 0) == (sign > 0)
        assert point.growth == pytest.approx(max(rate, 0.0), rel=1e-9)
        told = [f"It is not stable: what departs from it grows to e times in {1 / rate:.3g} s."] if rate > 0 else []
        assert list(point.notices) == told
        assert all(line in str(point) for line in told)
        start = [line.replace("It", "The steady state at the start") for line in told]
        assert list(simulate(drive, 0.1, start="steady").notices) == start


class Kinked(Component):
    """x' = c·|x| - b·x departs from zero to the right with the rate c - b, and comes back from the left."""

    b: Parameter = param("1/s", "decay", default=0.5)
    c: Parameter = param("1/s", "rate", default=2.0)
    x: Variable = var("1", "state", state="always")
    y: Variable = var("1", "follows", state="always")

    def equations(self) -> Equations:
        yield der(self.x) == self.c * absolute(self.x) - self.b * self.x
        yield der(self.y) == self.b * (self.x - self.y)


@pytest.mark.parametrize(("c", "rate"), [(2.0, 1.5), (-2.0, 1.5), (0.4, 0.0)])
def test_what_departs_to_one_side_of_a_kink_grows(c, rate):
    point = steady(Kinked(c=c, x=guess(0.0), y=guess(0.0)))
    assert (point["x"], point["y"]) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert point.growth == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_free_rotation_and_undamped_vibration_do_not_grow(damping):
    """Two zeros of a free rotation are known to the root of the rounding only."""
    parts = {}
    for k in range(12):
        parts[f"J{k}"] = Inertia(J=0.1 * (k + 1))
        parts[f"s{k}"] = SpringDamper(c=1e4 * (k + 1), d=damping)
    parts["last"] = Inertia(J=1.0)
    assert steady(Assembly("d", parts=parts, series={"s": list(parts)})).growth == 0.0
