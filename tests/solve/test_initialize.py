"""Start values: given, at rest, steady; missing, contradicting, redundant; and the modes that follow from them."""

import math

import numpy as np
import pytest

from components import (
    BearingFriction,
    Clutch,
    ConstantSpeed,
    ConstantTorque,
    Fixed,
    IdealGear,
    Inertia,
    SpeedDependentLoad,
    SpringDamper,
)
from modelica_like import build, simulate
from modelica_like.errors import (
    ContradictingStart,
    InitializationError,
    MissingStart,
    SingularAtStart,
    UnknownName,
)
from modelica_like.initialize import Point, initialize
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    connect,
    der,
    discrete,
    guess,
    param,
    series,
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


def start(model: Component, how: str = "given", **values: object) -> dict[str, float]:
    """Set start values (`a__w` for a.w), initialise, and return all variables."""
    for key, value in values.items():
        model.set(key.replace("__", "."), value)
    compiled = build(model)
    point: Point = initialize(compiled, 0.0, how)  # type: ignore[arg-type]
    found = np.array(compiled.variables(point.t, point.x, point.z, compiled.p, compiled.u, point.d)).ravel()
    names = {variable.path: float(value) for variable, value in zip(compiled.flat_variables, found, strict=True)}
    modes = {one.path: one.names[int(d)] for one, d in zip(compiled.flat_discretes, point.d, strict=True) if one.names}
    return {**names, **modes}  # type: ignore[dict-item]


# -- given -----------------------------------------------------------------------------------------------------------


def test_start_values_of_states():
    found = start(Geared(), a__phi=0.25, a__w=4.0)
    assert (found["b.phi"], found["b.w"]) == (0.125, 2.0)


def test_start_values_of_variables_that_are_no_states():
    found = start(Geared(), b__phi=0.5, b__w=-1.0)
    assert (found["a.phi"], found["a.w"]) == pytest.approx((1.0, -2.0), rel=1e-15)


def test_start_values_of_a_torque():
    """5 N.m push, 7 N.m in the spring: 0.07 rad with no speed, or less with some."""
    found = start(Elastic(), spring__tau=7.0, rotor__w=0.0)
    assert found["spring.phi_rel"] == pytest.approx(0.07, rel=1e-14)
    found = start(Elastic(), spring__tau=7.0, rotor__w=1.5)
    assert found["spring.phi_rel"] == pytest.approx((7.0 - 2.0 * 1.5) / 100.0, rel=1e-14)
    assert found["rotor.phi"] == pytest.approx(0.54, rel=1e-14)


@pytest.mark.parametrize(
    "values",
    [
        {"a__phi": 1.0, "a__w": 4.0, "b__w": 2.0},
        {"a__phi": 1.0, "b__phi": 0.5, "a__w": 4.0, "b__w": 2.0},
        {"b__phi": 0.5, "b__w": 2.0, "a__w": 4.0},
    ],
)
def test_redundant_start_values_that_agree(values):
    found = start(Geared(), **values)
    assert [found[name] for name in ("a.phi", "a.w", "b.phi", "b.w")] == pytest.approx([1.0, 4.0, 0.5, 2.0])


@pytest.mark.parametrize(
    ("values", "names"),
    [
        ({"a__phi": 0.0, "a__w": 4.0, "b__w": 2.1}, ("a.w = 4", "b.w = 2.1", "b.w follows to be 2.")),
        ({"a__phi": 0.0, "b__phi": 1.0, "a__w": 0.0}, ("a.phi = 0", "b.phi = 1", "b.phi follows to be 0.")),
    ],
)
def test_start_values_that_contradict_each_other(values, names):
    with pytest.raises(ContradictingStart) as caught:
        start(Geared(), **values)
    for name in names:
        assert name in caught.value.what
    assert "gears.py" in str(caught.value)


def test_two_start_values_of_one_motion_that_contradict():
    class Rigid(Component):
        one, two = Inertia(J=1.0, w=1.0, phi=0.0), Inertia(J=1.0, w=2.0)

        def equations(self) -> Equations:
            yield from series(self.one, self.two)

    with pytest.raises(
        ContradictingStart, match=r"one\.w = 1 and two\.w = 2 contradict each other: they are the same motion\."
    ):
        start(Rigid())
    assert start(Rigid(), two__w=1.0)["two.w"] == 1.0


def test_a_start_value_against_a_constant():
    class Driven(Component):
        motor, rotor = ConstantSpeed(w_fixed=5.0), Inertia(J=1.0, w=6.0)

        def equations(self) -> Equations:
            yield from series(self.motor, self.rotor)

    with pytest.raises(ContradictingStart, match=r"rotor\.w = 6.*follows to be 5"):
        start(Driven())
    assert start(Driven(), rotor__w=5.0)["rotor.w"] == 5.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "Initialisation (not the model) lacks 2 equations: give a.phi, a.w start values."),
        ({"a__w": 1.0}, "Initialisation (not the model) lacks one equation: give a.phi a start value."),
        ({"b__phi": 1.0}, "Initialisation (not the model) lacks one equation: give a.w a start value."),
        (
            {"a__phi": 1.0, "a__w": guess(1.0)},
            "Initialisation (not the model) lacks one equation: give a.w a start value.",
        ),
    ],
)
def test_missing_start_values(values, message):
    with pytest.raises(MissingStart) as caught:
        start(Geared(), **values)
    assert caught.value.what == message


def test_several_states_may_take_the_missing_value():
    """The torque of a spring-damper is one equation for two states: either can be given."""
    with pytest.raises(MissingStart) as caught:
        start(Elastic(), spring__tau=7.0)
    assert "lacks one equation: give spring.phi_rel or spring.w_rel a start value." in caught.value.what


def test_a_start_value_may_follow_from_parameters():
    class Scaled(Geared):
        speed: Parameter = param("rad/s", "speed", default=3.0)
        a = Inertia(J=1.0, phi=0.0, w="2*speed")

    assert start(Scaled())["a.w"] == 6.0
    run = simulate(Scaled(), 1.0, points=1, parameters={"speed": 5.0})
    assert run["a.w"][0] == 10.0


def test_a_default_start_gives_way_to_a_given_one():
    """A prescribed speed begins at the angle zero unless something else says otherwise."""

    class Driven(Component):
        motor, rotor = ConstantSpeed(w_fixed=5.0), Inertia(J=1.0)

        def equations(self) -> Equations:
            yield from series(self.motor, self.rotor)

    assert start(Driven())["rotor.phi"] == 0.0
    assert start(Driven(), rotor__phi=0.75)["motor.phi"] == 0.75
    assert start(Driven(), motor__phi=0.25)["rotor.phi"] == 0.25


# -- rest ------------------------------------------------------------------------------------------------------------


def test_at_rest_what_is_not_given_begins_at_zero():
    found = start(Geared(), "rest")
    assert [found[name] for name in ("a.phi", "a.w", "b.phi", "b.w")] == [0.0] * 4
    found = start(Geared(), "rest", b__w=3.0)
    assert [found[name] for name in ("a.phi", "a.w", "b.phi", "b.w")] == [0.0, 6.0, 0.0, 3.0]


# -- steady ----------------------------------------------------------------------------------------------------------


def test_in_the_steady_state_nothing_changes():
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


def test_a_fan_turns_steadily_and_its_angle_is_kept():
    found = start(Fan(), "steady", rotor__w=guess(3.0), rotor__phi=0.25)
    assert found["rotor.w"] == pytest.approx(5.0, rel=1e-12)
    assert found["rotor.phi"] == 0.25


def test_the_steady_state_depends_on_the_mode_the_guess_chooses():
    """Friction 1 N.m + 1 N.m s/rad w against 5 N.m: steady at 4 rad/s when it slides, none when it sticks."""

    class Rubbing(Component):
        push, rotor, bearing = (
            ConstantTorque(tau_constant=5.0),
            Inertia(J=1.0),
            BearingFriction(tau_pos=((0, 1), (1, 2))),
        )

        def equations(self) -> Equations:
            yield from series(self.push, self.rotor, self.bearing)

    found = start(Rubbing(), "steady", bearing__w=guess(1.0))
    assert found["rotor.w"] == pytest.approx(4.0, rel=1e-12)
    assert found["bearing.mode"] == "forward"
    with pytest.raises(InitializationError, match=r"bearing\.mode does not stay stuck"):
        start(Rubbing(), "steady")
    # A torque that friction can hold: it sticks.
    found = start(Rubbing(), "steady", push__tau_constant=0.5)
    assert (found["rotor.w"], found["bearing.mode"]) == (0.0, "stuck")


def test_where_there_is_no_steady_state_it_is_told():
    class Pushed(Component):
        push, rotor = ConstantTorque(tau_constant=5.0), Inertia(J=1.0)

        def equations(self) -> Equations:
            yield from series(self.push, self.rotor)

    with pytest.raises(InitializationError, match=r"^No steady state was found at t = 0 s: rotor\.w keeps changing\."):
        start(Pushed(), "steady")


def test_an_unknown_kind_of_start_is_refused():
    with pytest.raises(UnknownName, match=r"^There is no start 'stedy'; did you mean 'steady'\?"):
        start(Elastic(), "stedy")


# -- nonlinear -------------------------------------------------------------------------------------------------------


class Nonlinear(Component):
    """y² = x + 1 and u = x³ + x."""

    x: Variable = var("1", "state")
    y: Variable = var("1", "root", guess=1.0)
    u: Variable = var("1", "cubic")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == -self.x
        yield self.y**2 == self.x + 1
        yield self.u == self.x**3 + self.x


def test_a_nonlinear_variable_is_given():
    assert start(Nonlinear(), u=10.0)["x"] == pytest.approx(2.0, rel=1e-14)
    assert start(Nonlinear(), y=3.0)["x"] == pytest.approx(8.0, rel=1e-14)


def test_a_guess_chooses_the_branch():
    assert start(Nonlinear(), x=3.0)["y"] == pytest.approx(2.0, rel=1e-14)
    assert start(Nonlinear(), x=3.0, y=guess(-1.0))["y"] == pytest.approx(-2.0, rel=1e-14)
    assert start(Nonlinear(), x=guess(0.5), y=guess(-1.0), u=10.0)["y"] == pytest.approx(-math.sqrt(3.0), rel=1e-14)


def test_what_has_no_solution_is_told():
    with pytest.raises(InitializationError, match=r"The equations for y were not solved at t = 0 s\."):
        start(Nonlinear(), x=-3.0)


def test_a_point_where_a_derivative_is_infinite_is_told():
    class Zero(Component):
        rotor = Inertia(J=0.0, phi=0.0, w=1.0)
        push = ConstantTorque(tau_constant=1.0)

        def equations(self) -> Equations:
            yield from series(self.push, self.rotor)

    with pytest.raises(SingularAtStart, match=r"The derivative of .* is not finite at t = 0 s") as caught:
        start(Zero())
    assert "inertia or ratio of zero" in caught.value.advice


# -- modes -----------------------------------------------------------------------------------------------------------


class Coupled(Component):
    a, clutch, b = Inertia(J=1.0, phi=0.0), Clutch(capacity=5.0, phi_rel=0.0), Inertia(J=1.0, w=0.0)

    def equations(self) -> Equations:
        yield from series(self.a, self.clutch, self.b)


@pytest.mark.parametrize(("w", "mode"), [(10.0, "backward"), (0.0, "stuck"), (-10.0, "forward")])
def test_modes_follow_from_the_start_values(w, mode):
    """The slip speed is that of b over a."""
    assert start(Coupled(), a__w=w)["clutch.mode"] == mode


def test_the_first_condition_that_holds_wins_and_start_is_the_last_resort():
    class Choosy(Component):
        x: Variable = var("1", "x")
        T: Parameter = param("s", "time", default=1.0)
        mode = Mode("low", "middle", "high", "none", start="none")
        plain = Mode("first", "second", start="second")

        def equations(self) -> Equations:
            yield self.T * der(self.x) == 0

        def events(self) -> Events:
            yield self.mode.initially("high", when=self.x > 2)
            yield self.mode.initially("middle", when=self.x > 1)
            yield self.mode.initially("low", when=self.x < 0)

    found = {x: start(Choosy(x=x))["mode"] for x in (-1.0, 0.5, 1.5, 3.0)}
    assert found == {-1.0: "low", 0.5: "none", 1.5: "middle", 3.0: "high"}
    assert start(Choosy(x=0.0))["plain"] == "second"
    assert start(Choosy(x=0.0, plain="first"))["plain"] == "first"


def test_modes_and_start_values_that_chase_each_other_are_told():
    """x follows from y by the mode, and the mode from x: y = 1 gives x = 2 in `a`, which asks for `b`, where x = -2."""

    class Chasing(Component):
        x: Variable = var("1", "state")
        y: Variable = var("1", "given")
        T: Parameter = param("s", "time", default=1.0)
        mode = Mode("a", "b")

        def equations(self) -> Equations:
            yield self.T * der(self.x) == -self.x
            yield self.y == self.mode.choose(a=self.x - 1, b=self.x + 3)

        def events(self) -> Events:
            yield self.mode.initially("b", when=self.x > 0)
            yield self.mode.initially("a", when=self.x < 0)

    with pytest.raises(InitializationError, match=r"^The modes at the start do not settle: mode and the start values"):
        start(Chasing(y=1.0))
    assert start(Chasing(x=1.0))["mode"] == "b"


def test_discrete_values_start_from_numbers_quantities_and_formulas():
    class Counter(Component):
        x: Variable = var("1", "x")
        number: Discrete = discrete("1", "number", start=3)
        moment: Discrete = discrete("s", "quantity", start="20 ms")
        follows: Discrete = discrete("s", "formula", start="2*period")
        period: Parameter = param("s", "period", default=0.5)

        def equations(self) -> Equations:
            yield self.x == self.number

    run = simulate(Counter(), 1.0, points=1)
    assert [run.final[name] for name in ("number", "moment", "follows")] == [3.0, 0.02, 1.0]
    run = simulate(Counter(), 1.0, points=1, parameters={"period": "1 s"})
    assert run.final["follows"] == 2.0
    assert simulate(Counter(number=7), 1.0, points=1).final["x"] == 7.0


def test_many_start_values_on_a_rigid_chain():
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
