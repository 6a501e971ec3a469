"""Start values: given, at rest, steady; missing, contradicting, redundant."""

import numpy as np
import pytest

from components import (
    BearingFriction,
    ConstantSpeed,
    ConstantTorque,
    Fixed,
    IdealGear,
    Inertia,
    SpeedDependentLoad,
    SpringDamper,
)
from modelica_like import Assembly, simulate
from modelica_like.errors import ContradictingStart, InitializationError, MissingStart, UnknownName
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    connect,
    der,
    guess,
    param,
    series,
    sqrt,
    var,
)


class Geared(Component):
    """Two inertias and a gear: two states, a.phi and a.w."""

    a, gear, b = Inertia(J=1.0), IdealGear(ratio=2.0), Inertia(J=2.0)

    def equations(self) -> Equations:
        yield from series(self.a, self.gear, self.b)


class Elastic(Component):
    """Ground, spring-damper, inertia, torque: two states, the relative angle and speed."""

    ground, spring, rotor = Fixed(phi0=0.5), SpringDamper(c=100.0, d=2.0), Inertia(J=1.0)
    push = ConstantTorque(tau_constant=5.0)

    def equations(self) -> Equations:
        yield from series(self.ground, self.spring, self.rotor)
        yield connect(self.rotor.flange_b, self.push.flange)


# -- given -----------------------------------------------------------------------------------------------------------


def test_start_values_of_states(start):
    found = start(Geared(), a__phi=0.25, a__w=4.0)
    assert (found["b.phi"], found["b.w"]) == (0.125, 2.0)


def test_start_values_of_variables_that_are_no_states(start):
    found = start(Geared(), b__phi=0.5, b__w=-1.0)
    assert (found["a.phi"], found["a.w"]) == pytest.approx((1.0, -2.0), rel=1e-15)


def test_start_values_of_a_torque(start):
    """5 N.m push, 7 N.m in the spring: 0.07 rad with no speed, or less with some."""
    found = start(Elastic(), spring__tau=7.0, rotor__w=0.0)
    assert found["spring.phi_rel"] == pytest.approx(0.07, rel=1e-14)
    found = start(Elastic(), spring__tau=7.0, rotor__w=1.5)
    assert found["spring.phi_rel"] == pytest.approx((7.0 - 2.0 * 1.5) / 100.0, rel=1e-14)
    assert found["rotor.phi"] == pytest.approx(0.54, rel=1e-14)


@pytest.mark.parametrize("size", [1.0, 1e5, 1e9, 1e13])
@pytest.mark.parametrize("number", [1 / 3, 0.7, 2 / 7, 1.1])
def test_the_rounding_of_large_start_values_is_no_error(start, size, number):
    """What is left of 1e13 N.m by rounding is 1e-3 N.m; compared with its size it is nothing."""
    found = start(Elastic(), spring__c=100 / 3, spring__d=0.7, spring__tau=number * size, rotor__w=size / 7)
    assert found["spring.phi_rel"] == pytest.approx((number - 0.7 / 7) * size * 0.03, rel=1e-13)


@pytest.mark.parametrize(
    "values",
    [
        {"a__phi": 1.0, "a__w": 4.0, "b__w": 2.0},
        {"a__phi": 1.0, "b__phi": 0.5, "a__w": 4.0, "b__w": 2.0},
        {"b__phi": 0.5, "b__w": 2.0, "a__w": 4.0},
    ],
)
def test_redundant_start_values_that_agree(start, values):
    found = start(Geared(), **values)
    assert [found[name] for name in ("a.phi", "a.w", "b.phi", "b.w")] == pytest.approx([1.0, 4.0, 0.5, 2.0])


@pytest.mark.parametrize(
    ("values", "names"),
    [
        ({"a__phi": 0.0, "a__w": 4.0, "b__w": 2.1}, ("a.w = 4", "b.w = 2.1", "b.w would be 2.")),
        ({"a__phi": 0.0, "b__phi": 1.0, "a__w": 0.0}, ("a.phi = 0", "b.phi = 1", "b.phi would be 0.")),
    ],
)
def test_start_values_that_contradict_each_other(start, values, names):
    with pytest.raises(ContradictingStart) as caught:
        start(Geared(), **values)
    for name in names:
        assert name in caught.value.what
    assert "gears.py" in str(caught.value)


def test_two_start_values_of_one_motion_that_contradict(start):
    class Rigid(Component):
        one, two = Inertia(J=1.0, w=1.0, phi=0.0), Inertia(J=1.0, w=2.0)

        def equations(self) -> Equations:
            yield from series(self.one, self.two)

    with pytest.raises(
        ContradictingStart, match=r"one\.w = 1 and two\.w = 2 contradict each other: they are the same motion\."
    ):
        start(Rigid())
    assert start(Rigid(), two__w=1.0)["two.w"] == 1.0


@pytest.mark.parametrize(
    ("one", "other"),
    [(1e6, 1e6 * (1 + 3e-8)), (1e6, 1e6 * (1 - 3e-8)), (0.0, 3e-8), (0.0, 1.5e-8), (-1e-3, -1e-3 + 3e-8)],
)
def test_start_values_agree_to_eight_digits_or_to_1e_8(start, one, other):
    """Compared as states (one shaft) and behind a gear; a tenth of the difference is rounding."""

    class Rigid(Component):
        one, two = Inertia(J=1.0, phi=0.0), Inertia(J=1.0)

        def equations(self) -> Equations:
            yield from series(self.one, self.two)

    class Drive(Component):
        motor, rotor = ConstantSpeed(w_fixed=1.0), Inertia(J=1.0)

        def equations(self) -> Equations:
            yield from series(self.motor, self.rotor)

    near = one + 0.1 * (other - one)
    assert start(Rigid(), one__w=one, two__w=near)["one.w"] == one
    assert start(Drive(), motor__w_fixed=one, rotor__w=near)["rotor.w"] == one
    with pytest.raises(ContradictingStart):
        start(Rigid(), one__w=one, two__w=other)
    with pytest.raises(ContradictingStart):
        start(Drive(), motor__w_fixed=one, rotor__w=other)


def test_a_start_value_against_a_constant(start):
    class Driven(Component):
        motor, rotor = ConstantSpeed(w_fixed=5.0), Inertia(J=1.0, w=6.0)

        def equations(self) -> Equations:
            yield from series(self.motor, self.rotor)

    with pytest.raises(ContradictingStart, match=r"rotor\.w = 6.*would be 5"):
        start(Driven())
    assert start(Driven(), rotor__w=5.0)["rotor.w"] == 5.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "Initialization (not the model) lacks 2 equations: give a.phi, a.w start values."),
        ({"a__w": 1.0}, "Initialization (not the model) lacks one equation: give a.phi a start value."),
        ({"b__phi": 1.0}, "Initialization (not the model) lacks one equation: give a.w a start value."),
        (
            {"a__phi": 1.0, "a__w": guess(1.0)},
            "Initialization (not the model) lacks one equation: give a.w a start value.",
        ),
    ],
)
def test_missing_start_values(start, values, message):
    with pytest.raises(MissingStart) as caught:
        start(Geared(), **values)
    assert caught.value.what == message


@pytest.mark.parametrize(("count", "more"), [(8, ""), (9, ", …")])
def test_of_many_missing_start_values_eight_are_named_at_three_places(start, count, more):
    parts = {f"i{k}": Inertia(J=1.0, phi=0.0) for k in range(count)}
    with pytest.raises(MissingStart) as caught:
        start(Assembly("many", parts=parts))
    named = ", ".join(f"i{k}.w" for k in range(8))
    assert caught.value.what.endswith(f" lacks {count} equations: give {named}{more} start values.")
    assert len(caught.value.where) == 3


def test_several_states_may_take_the_missing_value(start):
    """The torque of a spring-damper is one equation for two states: either can be given."""
    with pytest.raises(MissingStart) as caught:
        start(Elastic(), spring__tau=7.0)
    assert "lacks one equation: give spring.phi_rel or spring.w_rel a start value." in caught.value.what


def test_a_start_value_may_follow_from_parameters(start):
    class Scaled(Geared):
        speed: Parameter = param("rad/s", "speed", default=3.0)
        a = Inertia(J=1.0, phi=0.0, w="2*speed")

    assert start(Scaled())["a.w"] == 6.0
    run = simulate(Scaled(), 1.0, points=1, parameters={"speed": 5.0})
    assert run["a.w"][0] == 10.0


def test_a_default_start_gives_way_to_a_given_one(start):
    """A prescribed speed begins at the angle zero unless something else says otherwise."""

    class Driven(Component):
        motor, rotor = ConstantSpeed(w_fixed=5.0), Inertia(J=1.0)

        def equations(self) -> Equations:
            yield from series(self.motor, self.rotor)

    assert start(Driven())["rotor.phi"] == 0.0
    assert start(Driven(), rotor__phi=0.75)["motor.phi"] == 0.75
    assert start(Driven(), motor__phi=0.25)["rotor.phi"] == 0.25


def test_many_start_values_on_a_rigid_chain(start):
    """Start values on the far end of twenty gears."""

    class Train(Component):
        def build(self) -> None:
            self.inertias = [Inertia(J=1.0) for _ in range(20)]
            self.gears = [IdealGear(ratio=1.1) for _ in range(19)]

        def equations(self) -> Equations:
            for k in range(19):
                yield from series(self.inertias[k], self.gears[k], self.inertias[k + 1])

    train = Train()
    train.inertias[-1].w = 2.0
    train.inertias[10].phi = 1.0
    found = start(train)
    assert found["inertias[1].w"] == pytest.approx(2.0 * 1.1**19, rel=1e-12)
    assert found["inertias[1].phi"] == pytest.approx(1.1**10, rel=1e-12)


# -- rest ------------------------------------------------------------------------------------------------------------


def test_at_rest_what_is_not_given_begins_at_zero(start):
    found = start(Geared(), "rest")
    assert [found[name] for name in ("a.phi", "a.w", "b.phi", "b.w")] == [0.0] * 4
    found = start(Geared(), "rest", b__w=3.0)
    assert [found[name] for name in ("a.phi", "a.w", "b.phi", "b.w")] == [0.0, 6.0, 0.0, 3.0]


# -- steady ----------------------------------------------------------------------------------------------------------


def test_in_the_steady_state_nothing_changes(start):
    found = start(Elastic(), "steady")
    assert found["spring.phi_rel"] == pytest.approx(0.05, rel=1e-14)
    assert found["rotor.phi"] == pytest.approx(0.55, rel=1e-14)
    assert found["rotor.w"] == pytest.approx(0.0, abs=1e-20)
    run = simulate(Elastic(), 3.0, start="steady", points=5)
    assert np.ptp(run["rotor.phi"]) < 1e-12


class Fan(Component):
    """Torque against a load that grows with the square of the speed: 5 N.m = 0.2 N.m (w/(rad/s))²."""

    push, rotor, load = ConstantTorque(tau_constant=5.0), Inertia(J=1.0), SpeedDependentLoad(a=0.0, b=0.2, p=2.0)

    def equations(self) -> Equations:
        yield from series(self.push, self.rotor, self.load)


def test_a_fan_turns_steadily_and_its_angle_is_kept(start):
    found = start(Fan(), "steady", rotor__w=guess(3.0), rotor__phi=0.25)
    assert found["rotor.w"] == pytest.approx(5.0, rel=1e-12)
    assert found["rotor.phi"] == 0.25


def test_a_steady_state_has_modes_that_stay(start):
    """Friction 1 N.m + 1 N.m s/rad w against 5 N.m: steady at 4 rad/s when it slides; it cannot stick."""

    class Rubbing(Component):
        push, rotor, bearing = (
            ConstantTorque(tau_constant=5.0),
            Inertia(J=1.0),
            BearingFriction(tau_pos=((0, 1), (1, 2)), extrapolate="linear"),
        )

        def equations(self) -> Equations:
            yield from series(self.push, self.rotor, self.bearing)

    found = start(Rubbing(), "steady", bearing__w=guess(1.0))
    assert found["rotor.w"] == pytest.approx(4.0, rel=1e-12)
    assert start(Rubbing(), "steady", bearing__w=1.0)["rotor.w"] == pytest.approx(4.0, rel=1e-12)
    assert found["bearing.mode"] == "forward"
    found = start(Rubbing(), "steady")
    assert (found["rotor.w"], found["bearing.mode"]) == (pytest.approx(4.0, rel=1e-12), "forward")
    # A torque that friction can hold: it sticks.
    found = start(Rubbing(), "steady", push__tau_constant=0.5)
    assert (found["rotor.w"], found["bearing.mode"]) == (0.0, "stuck")


def test_where_there_is_no_steady_state_it_is_told(start):
    class Pushed(Component):
        push, rotor = ConstantTorque(tau_constant=5.0), Inertia(J=1.0)

        def equations(self) -> Equations:
            yield from series(self.push, self.rotor)

    with pytest.raises(InitializationError, match=r"^No steady state was found at t = 0 s: rotor\.w keeps changing\."):
        start(Pushed(), "steady")


def test_a_speed_that_an_impact_turned_is_no_speed_that_is_held(start):
    """Between two walls nothing changes the speed of a ball: it keeps its guess."""

    class Ball(Component):
        wall: Parameter = param("m", "distance of the walls", default=1.0)
        s: Variable = var("m", "way", default=0.5)
        v: Variable = var("m/s", "speed")
        mode = Mode("back", "forth")

        def equations(self) -> Equations:
            yield der(self.s) == self.v
            yield der(self.v) == 0

        def events(self) -> Events:
            yield self.mode.go("forth", "back", when=self.s > self.wall, reset={self.v: -0.7 * self.v})
            yield self.mode.go("back", "forth", when=self.s < 0, reset={self.v: -0.7 * self.v})

    assert start(Ball(), "steady", v=guess(-3.0))["v"] == -3.0


def test_a_guess_outside_the_domain_of_the_equations_is_told(start):
    class Draining(Component):
        v: Variable = var("1", "level")
        period: Parameter = param("s", "time constant", default=1.0)

        def build(self) -> None:
            self.v = guess(-1.0)

        def equations(self) -> Equations:
            yield self.period * der(self.v) == 1 - sqrt(self.v)

    assert start(Draining(), "steady", v=guess(0.5))["v"] == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(InitializationError, match=r"^No steady state was found at t = 0 s: v keeps changing\."):
        start(Draining(), "steady")


def test_an_unknown_kind_of_start_is_refused(start):
    with pytest.raises(UnknownName, match=r"^There is no start 'stedy'; did you mean 'steady'\?"):
        start(Elastic(), "stedy")


def test_a_steady_start_keeps_a_momentum_beside_implicit_equations(start):
    """A free shaft keeps its speed; beside it, v + v³ = w brakes another one to rest."""

    class Both(Component):
        free = Inertia(J=2.0, phi=0.0, w=3.0)
        v: Variable = var("1", "implicit")
        w: Variable = var("rad/s", "speed that is braked")
        T: Parameter = param("rad", "time constant times speed", default=0.5)
        unit: Parameter = param("rad/s", "unit", default=1.0)

        def equations(self) -> Equations:
            yield self.T * der(self.w) == -self.v * self.unit**2
            yield self.unit * (self.v + self.v**3) == self.w

    drive = Both(w=guess(1.0))
    found = start(drive, "steady")
    assert found["free.w"] == pytest.approx(3.0, rel=1e-12)
    assert (found["v"], found["w"]) == pytest.approx((0.0, 0.0), abs=1e-12)
