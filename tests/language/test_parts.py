"""The tree of components: copies, arrays, replaceable parts, paths, pickles."""

import copy
import pickle

import pytest

from modelica_like.errors import LanguageError, UnknownName
from modelica_like.flatten import flatten
from modelica_like.language import (
    Assembly,
    Component,
    Connector,
    Equations,
    Parameter,
    Variable,
    connect,
    der,
    flow,
    guess,
    param,
    series,
    var,
)
from modelica_like.language.inside import inside


class End(Connector):
    s: Variable = var("m", "position")
    f: Variable = flow("N", "force")


class Mass(Component):
    flange_a = End("left", free=True)
    flange_b = End("right", free=True)
    m: Parameter = param("kg", "mass")
    s: Variable = var("m", "position")
    v: Variable = var("m/s", "velocity")

    def equations(self) -> Equations:
        yield self.flange_a.s == self.s
        yield self.flange_b.s == self.s
        yield der(self.s) == self.v
        yield self.m * der(self.v) == self.flange_a.f + self.flange_b.f


class Spring(Component):
    flange_a = End("left")
    flange_b = End("right")
    c: Parameter = param("N/m", "stiffness")

    def equations(self) -> Equations:
        yield self.flange_b.f == self.c * (self.flange_b.s - self.flange_a.s)
        yield self.flange_a.f == -self.flange_b.f


class Chain(Component):
    n: int = 3

    def build(self) -> None:
        self.masses = [Mass(m=1.0 + k) for k in range(self.n)]
        self.springs = [Spring(c=10.0)] * (self.n - 1)

    def equations(self) -> Equations:
        for k in range(self.n - 1):
            yield from series(self.masses[k], self.springs[k], self.masses[k + 1])


class Drive(Component):
    first: Mass = Mass(m=1.0)
    spring = Spring(c=5.0)
    last = Mass(m=2.0)

    def equations(self) -> Equations:
        yield from series(self.first, self.spring, self.last)


def test_parts_of_a_class_are_copied_for_each_owner():
    one, two = Drive(), Drive()
    assert one.first is not two.first is not Drive.first
    one.first.m = 9.0
    assert [drive.first.value("m").number for drive in (one, two, Drive())] == [9.0, 1.0, 1.0]  # type: ignore[union-attr]


def test_the_elements_of_an_array_are_copies_too():
    chain = Chain(n=4)
    chain.springs[0].c = 99.0
    assert [spring.value("c").number for spring in chain.springs] == [99.0, 10.0, 10.0]  # type: ignore[union-attr]


def test_paths_of_arrays_count_from_one():
    chain = Chain()
    assert chain.masses[0].path == "masses[1]"
    assert chain.find("masses[3]") is chain.masses[2]
    assert list(chain.parts) == ["masses[1]", "masses[2]", "masses[3]", "springs[1]", "springs[2]"]
    paths = [variable.path for variable in flatten(chain).variables]
    assert "masses[1].s" in paths
    assert "masses[3].flange_b.f" in paths
    with pytest.raises(UnknownName, match=r"Chain has no part 'masses\[0\]'"):
        chain.find("masses[0]")
    with pytest.raises(UnknownName, match=r"Chain has no part 'masses'"):
        chain.find("masses")


@pytest.mark.parametrize("number", [1, 2, 7])
def test_build_follows_the_structural_field(number):
    assert len(Chain(n=number).masses) == number


def test_a_structural_field_set_later_builds_again():
    chain = Chain()
    chain.n = 5
    assert len(chain.masses) == len(chain.springs) + 1 == 5
    assert "masses[5]" in chain.parts
    chain.set("n", 2)
    assert list(chain.parts) == ["masses[1]", "masses[2]", "springs[1]"]
    chain.n = 1
    assert list(chain.parts) == ["masses[1]"]
    flatten(chain)


def test_the_parts_by_name_follow_what_replaces_them():
    chain = Chain()
    known = chain.parts
    assert chain.parts["masses[1]"] is chain.masses[0]
    copies = [chain.copy(), copy.deepcopy(chain), pickle.loads(pickle.dumps(chain))]
    chain.springs = [Spring(c=5.0)]
    assert list(chain.parts) == ["masses[1]", "masses[2]", "masses[3]", "springs[1]"]
    assert chain.find("springs[1]") is chain.springs[0]
    assert list(known) == ["masses[1]", "masses[2]", "masses[3]", "springs[1]", "springs[2]"]
    for one in copies:
        assert list(one.parts) == list(known)
        assert all(inside(part).owner is one and part is not known[name] for name, part in one.parts.items())


def test_an_annotated_part_is_replaceable():
    class HeavyMass(Mass):
        m: Parameter = param("kg", "mass", default=100.0)

    drive = Drive(first=HeavyMass(s=0.5))
    assert isinstance(drive.first, HeavyMass)
    assert drive.first.path == "first"
    drive.set("first", Mass(m=4.0))
    assert type(drive.first) is Mass
    with pytest.raises(LanguageError, match="Annotate the part in Drive"):
        Drive(last=HeavyMass())


def test_series_uses_the_named_ends():
    class Lever(Component):
        left = End("left")
        right = End("right")
        inlet, outlet = "left", "right"

        def equations(self) -> Equations:
            yield self.left.s == 2 * self.right.s
            yield 2 * self.left.f + self.right.f == 0

    lever = Lever()
    assert lever.inlet_connector() is lever.left
    assert lever.outlet_connector() is lever.right

    class Both(Component):
        a, lever, b = Mass(m=1.0), Lever(), Mass(m=1.0)

        def equations(self) -> Equations:
            yield from series(self.a, self.lever, self.b)

    names = [e.origin.path for e in flatten(Both()).linear if e.origin.kind == "connection"]
    assert set(names) == {"a.flange_b – lever.left", "lever.right – b.flange_a"}


def test_series_needs_an_outlet():
    class Stop(Component):
        end = End("only end")

        def equations(self) -> Equations:
            yield self.end.s == 0

    class Both(Component):
        stop, mass = Stop(), Mass(m=1.0)

        def equations(self) -> Equations:
            yield from series(self.stop, self.mass)

    with pytest.raises(UnknownName, match=r"stop \(Stop\) has no outlet 'flange_b or flange'.*It has end\."):
        flatten(Both())


def test_find_and_walk():
    class Machine(Component):
        drive = Drive()
        chain = Chain(n=2)

    machine = Machine()
    assert machine.find("drive.spring") is machine.drive.spring
    assert machine.find("") is machine
    paths = [part.path for part in machine.walk()]
    assert paths == [
        "", "drive", "drive.first", "drive.spring", "drive.last",
        "chain", "chain.masses[1]", "chain.masses[2]", "chain.springs[1]",
    ]  # fmt: skip
    with pytest.raises(UnknownName, match=r"drive has no part 'sprung'; did you mean 'spring'\?"):
        machine.find("drive.sprung")


def test_copies_are_independent():
    drive = Drive()
    drive.first.m = 3.0
    drive.first.s = guess(0.25)
    _ = drive.first.s  # its symbol
    for twin in (drive.copy(), copy.deepcopy(drive), pickle.loads(pickle.dumps(drive))):
        assert twin.first is not drive.first
        assert twin.first.path == "first"
        assert inside(twin.first).owner is twin
        assert twin.first.s is not drive.first.s
        assert twin.first.value("m") == drive.first.value("m")
        assert twin.first.start("s").fixed is False  # type: ignore[union-attr]
        twin.first.m = 7.0
        assert drive.first.value("m").number == 3.0  # type: ignore[union-attr]
        assert [v.path for v in flatten(twin).variables] == [v.path for v in flatten(drive).variables]


def test_a_pickle_of_a_flattened_tree_still_works():
    chain = Chain(n=3)
    before = flatten(chain)
    twin = pickle.loads(pickle.dumps(chain))
    after = flatten(twin)
    assert str(before) == str(after)


def test_an_assembly_is_a_component_put_together_at_run_time():
    assembly = Assembly(
        "drive",
        parts={"first": Mass(m="total / 2"), "spring": Spring(c=5.0), "last": Mass(m=2.0), "more": [Mass(m=1.0)] * 2},
        series={"shaft": ["first", "spring", "last"]},
        connect={"end": ["last.flange_b", "more[1].flange_a"]},
        parameters={"total": "3 kg"},
    )
    flat = flatten(assembly)
    assert {one.path: one.value for one in flat.derived} == {"first.m": 1.5}
    assert "more[2].s" in [v.path for v in flat.variables]
    twin = pickle.loads(pickle.dumps(assembly))
    assert str(flatten(twin)) == str(flat)
    assert repr(twin.copy()) == repr(assembly)


def test_an_assembly_exposes_inner_ends():
    inner = Assembly("inner", parts={"mass": Mass(m=1.0)})
    inner.expose("left", "mass.flange_a")
    outer = Assembly(
        "outer",
        parts={"box": inner, "spring": Spring(c=1.0), "end": Mass(m=2.0)},
        connect={"a": ["box.left", "spring.flange_a"], "b": ["spring.flange_b", "end.flange_a"]},
    )
    kinds = [e.origin.path for e in flatten(outer).linear if e.origin.kind == "connection"]
    assert "box.left – box.mass.flange_a" in kinds or "box.mass.flange_a – box.left" in kinds


def test_connect_takes_any_number_of_ends():
    class Star(Component):
        a, b, c = Mass(m=1.0), Mass(m=1.0), Mass(m=1.0)

        def equations(self) -> Equations:
            yield connect(self.a.flange_b, self.b.flange_b, self.c.flange_b)

    equations = [e for e in flatten(Star()).linear if e.origin.kind == "connection"]
    assert sorted(len(e.terms) for e in equations) == [2, 2, 3]
