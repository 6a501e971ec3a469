"""Connections: sets, signs, free ends, and everything that can be wrong with them."""

import itertools
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from components import ConstantTorque, Fixed, Flange, Inertia, LinearFlange, Mass, SpringDamper, TorqueSensor
from modelica_like import simulate
from modelica_like.errors import FreeFlange, UnknownName, WiringErrors, WrongConnection
from modelica_like.flatten import FlatModel, flatten
from modelica_like.language import Assembly, Component, Connector, Equations, Variable, connect, flow, free, var


def connections(flat: FlatModel) -> list[list[tuple[str, float]]]:
    """Connection equations as sorted pairs of variable and coefficient."""
    found = [e for e in flat.linear if e.origin.kind == "connection"]
    return [sorted((flat.node_name(node), float(c)) for node, c in e.terms) for e in found]


def star(ends: list[list[int]], number: int) -> Assembly:
    """Inertias whose flanges are joined as told: flange k belongs to inertia k // 2."""
    names = [f"rotors[{k // 2 + 1}].flange_{'ab'[k % 2]}" for k in range(2 * number)]
    wires = {f"w{n}": [names[k] for k in group] for n, group in enumerate(ends)}
    return Assembly("star", parts={"rotors": [Inertia(J=1.0) for _ in range(number)]}, connect=wires)


trees = st.integers(2, 7).flatmap(
    lambda n: st.tuples(st.just(n), st.lists(st.integers(0, 10**6), min_size=n - 1, max_size=n - 1), st.randoms())
)


@given(trees)
@settings(deadline=None, max_examples=40)
def test_a_tree_of_connects_gives_one_set(tree):
    """n ends joined by n - 1 pairs, in any order: n - 1 equal potentials and one sum of flows."""
    number, choices, shuffle = tree
    pairs = [[2 * (choice % k), 2 * k] for k, choice in enumerate(choices, 1)]
    pairs = [shuffle.sample(pair, 2) for pair in pairs]
    shuffle.shuffle(pairs)
    equations = connections(flatten(star(pairs, number)))
    angles = [e for e in equations if "phi" in e[0][0]]
    torques = [e for e in equations if "tau" in e[0][0]]
    assert len(angles) == number - 1
    assert torques == [[(f"rotors[{k}].flange_a.tau", 1.0) for k in range(1, number + 1)]]
    joined = {name for e in angles for name, _ in e}
    assert joined == {f"rotors[{k}].flange_a.phi" for k in range(1, number + 1)}


@given(st.randoms())
@settings(deadline=None, max_examples=5)
def test_the_order_of_connecting_does_not_matter(shuffle):
    pairs = [
        ["left.flange_b", "spring.flange_a"],
        ["spring.flange_b", "right.flange_a"],
        ["push.flange", "left.flange_a"],
    ]
    expected = None
    for _ in range(2):
        wires = {f"w{k}": shuffle.sample(pair, 2) for k, pair in enumerate(shuffle.sample(pairs, 3))}
        parts: dict[str, Component] = {
            "left": Inertia(J=1.0, phi=0.0, w=1.0), "right": Inertia(J=2.0, phi=0.1, w=0.0),
            "spring": SpringDamper(c=10.0, d=0.5), "push": ConstantTorque(tau_constant=1.5),
        }  # fmt: skip
        order = shuffle.sample(list(parts), 4)
        run = simulate(
            Assembly("drive", parts={name: parts[name] for name in order}, connect=wires),
            1.0,
            points=20,
            rtol=1e-10,
            atol=1e-12,
        )
        values = np.array([run["left.w"], run["right.w"], run["spring.tau"]])
        expected = values if expected is None else expected
        np.testing.assert_allclose(values, expected, atol=1e-8)


def test_free_ends_and_values_are_plain_equations():
    flat = flatten(star([[0, 2]], 2))
    ends = {e.origin.path: [(flat.node_name(node), c, e.constant) for node, c in e.terms]
            for e in flat.linear if e.origin.kind == "free end"}  # fmt: skip
    assert ends == {f"rotors[{k}].flange_b": [(f"rotors[{k}].flange_b.tau", 1.0, 0.0)] for k in (1, 2)}


def test_connecting_twice_changes_nothing():
    once, twice = star([[0, 2]], 2), star([[0, 2], [2, 0], [0, 2, 0]], 2)
    assert connections(flatten(once)) == connections(flatten(twice))


def test_two_sets_stay_two():
    equations = connections(flatten(star([[1, 2], [3, 4]], 3)))
    assert sorted(e[0][0] for e in equations if "tau" in e[0][0]) == [
        "rotors[1].flange_b.tau",
        "rotors[2].flange_b.tau",
    ]


class Box(Component):
    """An assembly with flanges of its own."""

    left = Flange("left")
    right = Flange("right", free=True)
    rotor = Inertia(J=2.0)

    def equations(self) -> Equations:
        yield connect(self.left, self.rotor.flange_a)
        yield connect(self.rotor.flange_b, self.right)


def test_the_flow_of_an_outer_flange_counts_once_from_inside_and_once_from_outside():
    class Machine(Component):
        push = ConstantTorque(tau_constant=3.0)
        box = Box()

        def equations(self) -> Equations:
            yield connect(self.push.flange, self.box.left)

    flat = flatten(Machine())
    torques = [e for e in connections(flat) if "tau" in e[0][0]]
    assert sorted(torques) == [
        [("box.left.tau", -1.0), ("box.rotor.flange_a.tau", 1.0)],
        [("box.left.tau", 1.0), ("push.flange.tau", 1.0)],
        [("box.right.tau", -1.0), ("box.rotor.flange_b.tau", 1.0)],
    ]
    machine = Machine()
    machine.set("box.rotor.phi", 0.0)
    machine.set("box.rotor.w", 0.0)
    run = simulate(machine, 2.0, points=4)
    assert run.final["box.rotor.w"] == pytest.approx(3.0 / 2.0 * 2.0, rel=1e-12)  # tau / J * t
    assert run.final["box.left.tau"] == pytest.approx(3.0)
    assert run.final["box.right.tau"] == 0.0


def nested(depth: int) -> Component:
    """Box in box in box: every level passes both flanges on."""
    inner: Component = Box()
    for _ in range(depth):

        class Shell(Component):
            left = Flange("left")
            right = Flange("right", free=True)
            content = inner

            def equations(self) -> Equations:
                yield connect(self.left, self.content.left)
                yield connect(self.content.right, self.right)

        inner = Shell()
    return inner


@pytest.mark.parametrize("depth", [0, 1, 4])
def test_signs_of_flows_through_nested_assemblies(depth):
    class Machine(Component):
        push = ConstantTorque(tau_constant=3.0)
        box = nested(depth)
        load = Inertia(J=1.0, phi=0.0, w=0.0)

        def equations(self) -> Equations:
            yield connect(self.push.flange, self.box.left)
            yield connect(self.box.right, self.load.flange_a)

    run = simulate(Machine(), 1.0, points=2)
    assert run.final["load.w"] == pytest.approx(1.0, rel=1e-12)  # 3 N.m on 2 + 1 kg.m2
    assert run.final["load.flange_a.tau"] == pytest.approx(1.0, rel=1e-12)
    assert run.final["box.right.tau"] == pytest.approx(-1.0, rel=1e-12)
    assert run.final["box.left.tau"] == pytest.approx(3.0, rel=1e-12)


def test_a_free_flange_carries_nothing():
    run = simulate(Inertia(J=1.0, phi=0.0, w=2.0), 1.0, points=2)
    assert run.final["flange_a.tau"] == run.final["flange_b.tau"] == 0.0
    assert run.final["w"] == 2.0


class Loose(Component):
    spring = SpringDamper(c=1.0, d=1.0)
    mass = Inertia(J=1.0)

    def equations(self) -> Equations:
        yield connect(self.spring.flange_b, self.mass.flange_a)


def test_a_flange_that_must_be_connected_is_told():
    with pytest.raises(FreeFlange) as caught:
        flatten(Loose())
    assert caught.value.what == "spring.flange_a is free, so spring (SpringDamper) carries no torque."


def test_free_says_that_it_is_meant():
    class Meant(Loose):
        def equations(self) -> Equations:
            yield from super().equations()
            yield free(self.spring.flange_a)

    flat = flatten(Meant())
    ends = [flat.node_name(e.terms[0][0]) for e in flat.linear if e.origin.kind == "free end"]
    assert "spring.flange_a.tau" in ends


def test_all_free_flanges_are_told_together():
    class Scattered(Component):
        one, two = SpringDamper(c=1.0, d=1.0), SpringDamper(c=1.0, d=1.0)

    with pytest.raises(WiringErrors) as caught:
        flatten(Scattered())
    assert [type(error) for error in caught.value.errors] == [FreeFlange] * 4


def test_wrong_connections_are_collected():
    class Wrong(Component):
        a, b, slide = Inertia(J=1.0), Inertia(J=1.0), Mass(m=1.0)
        sensor = TorqueSensor()

        def equations(self) -> Equations:
            yield connect(self.a.flange_b, self.slide.flange_a)
            yield connect(self.sensor.tau, self.b.flange_a)
            yield connect(self.sensor.flange_a, self.a.flange_a)

    with pytest.raises(WiringErrors) as caught:
        flatten(Wrong())
    kinds = [type(error) for error in caught.value.errors]
    assert kinds == [WrongConnection, WrongConnection, FreeFlange]
    text = str(caught.value)
    assert "connect(a.flange_b, slide.flange_a): a Flange (rad, N.m) cannot join a LinearFlange (m, N)." in text
    assert "connect joins the signal sensor.tau with the connector b.flange_a." in text
    assert "sensor.flange_b is free" in text
    assert text.count("test_wiring.py:") == 2


def test_a_part_of_another_tree_is_not_connected():
    stranger = Inertia(J=1.0)

    class Wrong(Component):
        rotor = Inertia(J=1.0)

        def equations(self) -> Equations:
            yield connect(self.rotor.flange_a, stranger.flange_b)

    with pytest.raises(WrongConnection, match=r"^Wrong connects flange_b of a component that is not part of it\."):
        flatten(Wrong())


def test_flanges_of_different_kinds_name_what_goes_between():
    class Pin(Connector):
        v: Variable = var("V", "potential")
        i: Variable = flow("A", "current")

    class Lamp(Component):
        pin = Pin("pin", free=True)

        def equations(self) -> Equations:
            yield self.pin.i == 0

    class Wrong(Component):
        lamp, rotor = Lamp(), Inertia(J=1.0)

        def equations(self) -> Equations:
            yield connect(self.lamp.pin, self.rotor.flange_a)

    with pytest.raises(
        WrongConnection, match=r"a Pin \(V, A\) cannot join a Flange \(rad, N\.m\)\. Join connectors of one kind"
    ):
        flatten(Wrong())
    assert issubclass(LinearFlange, Connector)


@pytest.mark.parametrize(
    ("wire", "message"),
    [
        (["a.flange_c", "b.flange_a"], "a (Inertia) has no connector 'flange_c'; did you mean 'flange_b'?"),
        (["c.flange_a", "b.flange_a"], "has no part 'c'"),
        (["a", "b.flange_a"], "has no connector 'a'"),
        (["a.w", "b.flange_a"], "joins the signal a.w with the connector b.flange_a"),
    ],
)
def test_unknown_ends_of_an_assembly(wire, message):
    with pytest.raises((UnknownName, WrongConnection)) as caught:
        flatten(Assembly("wrong", parts={"a": Inertia(J=1.0), "b": Inertia(J=1.0)}, connect={"w": wire}))
    assert message in str(caught.value)


def test_a_tree_can_be_flattened_again_after_its_wiring_changed():
    """Whether an optional connector is used is found anew each time."""

    class Held(Component):
        drive = ConstantTorque(tau_constant=1.0)
        rotor, housing = Inertia(J=1.0), Fixed()
        hold: bool = True

        def equations(self) -> Equations:
            yield connect(self.drive.flange, self.rotor.flange_a)
            if self.hold:
                yield connect(self.drive.support, self.housing.flange)
            else:
                yield free(self.housing.flange)

    held = Held()
    names = [v.path for v in flatten(held).variables]
    assert "drive.support.tau" in names
    held.hold = False
    assert "drive.support.tau" not in [v.path for v in flatten(held).variables]
    held.hold = True
    assert [v.path for v in flatten(held).variables] == names


def test_random_wirings_of_a_ring_are_the_same_model():
    """Connection sets do not depend on how their pairs are written: all orders of three pairs that join four ends."""
    pairs = [[1, 2], [2, 4], [4, 6]]
    found = {str(connections_as_sets(list(order))) for order in itertools.permutations(pairs)}
    assert len(found) == 1
    random.seed(0)


def connections_as_sets(pairs: list[list[int]]) -> list[list[str]]:
    return sorted(sorted(name for name, _ in e) for e in connections(flatten(star(pairs, 4))) if "tau" in e[0][0])
