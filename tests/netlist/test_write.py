"""Writing: what is written reads back as the same tree."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from components import Clutch, ConstantSpeed, Flange, IdealGear, Inertia, Spring, SpringDamper, Table
from modelica_like.errors import NetlistError
from modelica_like.flatten import flatten
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Parameter,
    Variable,
    connect,
    der,
    free,
    guess,
    param,
    series,
    var,
)
from modelica_like.language.inside import declarations, inside
from modelica_like.netlist import dumps, load, loads, save

NUMBERS = st.floats(1e-3, 1e3)
TORQUES = st.one_of(NUMBERS, st.integers(1, 99), NUMBERS.map(lambda v: f"{v!r} N.m"), st.just("2 * limit + 1"))
INERTIAS = st.one_of(
    NUMBERS, NUMBERS.map(lambda v: f"{v!r} kg.cm2"), st.just("inertia"), st.just("inertia / (1 + ratio)**2")
)
ANGLES = st.one_of(st.floats(-10, 10), NUMBERS.map(lambda v: f"{v!r} deg"))
STARTS = st.one_of(ANGLES, ANGLES.map(guess))
PARTS = st.one_of(
    st.builds(Inertia, J=INERTIAS, phi=STARTS, w=st.floats(-5, 5)),
    st.builds(Inertia, J=INERTIAS),
    st.builds(SpringDamper, c=NUMBERS, d=NUMBERS, phi_rel=STARTS),
    st.builds(IdealGear, ratio=NUMBERS.map(lambda v: f"{v!r}")),
    st.builds(Clutch, capacity=TORQUES, smooth=st.booleans()),
    st.builds(
        Table,
        table=st.lists(st.tuples(NUMBERS, NUMBERS), min_size=2, max_size=4, unique_by=lambda row: row[0]).map(sorted),
    ),
)
NAMES = st.text(alphabet="abcdefgh_", min_size=1, max_size=6).filter(
    lambda name: name[0] != "_" and not hasattr(Component, name)
)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)


@st.composite
def assemblies(draw: st.DrawFn) -> Assembly:
    parts: dict[str, Any] = draw(
        st.dictionaries(NAMES, st.one_of(PARTS, st.lists(PARTS, min_size=1, max_size=3)), min_size=1, max_size=5)
    )
    parameters = {
        "inertia": draw(NUMBERS),
        "ratio": draw(st.integers(1, 9)),
        "limit": draw(NUMBERS.map(lambda v: f"{v!r} N.m")),
    }
    ends = st.lists(st.sampled_from([f"{name}.flange_a" for name in parts]), min_size=2, max_size=3)
    return Assembly(
        draw(TEXTS.filter(bool)), parts=parts, parameters=parameters, description=draw(TEXTS),
        connect=draw(st.dictionaries(NAMES, ends, max_size=2)), series=draw(st.dictionaries(NAMES, ends, max_size=2)),
        free=draw(ends.map(tuple)),
    )  # fmt: skip


def assert_same(ours: Component, theirs: Component) -> None:
    assert type(ours) is type(theirs)
    assert {k: (v.given, v.number, v.unit) for k, v in inside(ours).values.items()} == {
        k: (v.given, v.number, v.unit) for k, v in inside(theirs).values.items()
    }
    assert {k: (v.number, v.fixed) for k, v in inside(ours).starts.items()} == {
        k: (v.number, v.fixed) for k, v in inside(theirs).starts.items()
    }
    assert [ours.start_mode(name) for name in ours.modes] == [theirs.start_mode(name) for name in theirs.modes]
    assert {key: getattr(ours, key) for key in declarations(ours).structural} == {
        key: getattr(theirs, key) for key in declarations(theirs).structural
    }
    assert list(ours.parts) == list(theirs.parts)
    for name in ours.parts:
        assert_same(ours.parts[name], theirs.parts[name])


@settings(max_examples=60, deadline=None)
@given(assemblies())
def test_round_trip_loses_nothing(assembly: Assembly) -> None:
    text = dumps(assembly)
    again = loads(text)
    assert_same(again, assembly)
    assert (inside(again).name, again.description) == (inside(assembly).name, assembly.description)
    assert (again.wires, again.chains, again.free_ends) == (assembly.wires, assembly.chains, assembly.free_ends)
    assert {k: f.default for k, f in again.fields.items()} == {k: f.default for k, f in assembly.fields.items()}
    assert dumps(again) == text


class Drive(Component):
    """A motor, a gear and a load."""

    outlet = "shaft_end"
    shaft_end = Flange("the load's end")
    inertia: Parameter = param("kg.m2", "inertia of the load", default=0.3)
    motor: ConstantSpeed = ConstantSpeed(w_fixed="600 rpm")
    gear = IdealGear(ratio=3)
    loads = [Inertia(J=inertia), Inertia(J=2 * inertia)]

    def equations(self) -> Equations:
        yield from series(self.motor, self.gear, *self.loads)
        yield connect(self.shaft_end, self.loads[1].flange_b)


class Free(Component):
    """An inertia that hangs on nothing."""

    rotor = Inertia(J=1)

    def equations(self) -> Equations:
        yield free(self.rotor.flange_a)
        yield free(self.rotor.flange_b)


class OwnEquation(Component):
    """Something with an equation of its own."""

    x: Variable = var("m", "position")

    def equations(self) -> Equations:
        yield der(self.x) == -self.x


def test_a_class_of_parts_and_wires_becomes_a_netlist() -> None:
    again = loads(dumps(Drive()))
    assert list(again.parts) == ["motor", "gear", "loads[1]", "loads[2]"]
    assert str(again.fields["inertia"].default) == "0.3 kg.m2"
    assert str(again.find("loads[2]").value("J").formula) == "2.0 * inertia"
    assert set(again.wires.values()) == {
        ("motor.flange", "gear.flange_a"), ("gear.flange_b", "loads[1].flange_a"),
        ("loads[1].flange_b", "loads[2].flange_a"),
    }  # fmt: skip
    assert again.exposed == (("shaft_end", "loads[2].flange_b"),)
    assert loads(dumps(Free())).free_ends == ("rotor.flange_a", "rotor.flange_b")


def test_a_part_with_parts_is_written_by_what_differs_from_its_class() -> None:
    drive = Drive(motor=ConstantSpeed(w_fixed=5), inertia="1 kg.m2")
    drive.set("gear.ratio", 7)
    drive.set("loads[2].w", 1.5)
    kind = f"{Drive.__module__}:Drive"
    text = dumps(Assembly("a", parts={"d": drive}))
    assert f'd = {{ is = "{kind}", inertia = "1 kg.m2", motor = {{ w_fixed = 5 }}, gear = {{ ratio = 7 }} }}' in text
    assert '"d.loads[2].w" = 1.5' in text
    assert_same(loads(text).find("d"), drive)


def test_arrays_of_equal_parts_are_counted_and_others_listed() -> None:
    same = Assembly("a", parts={"m": [Inertia(J=1)] * 3})
    assert 'm = { is = "Inertia", count = 3, J = 1 }' in dumps(same)
    mixed = Assembly("a", parts={"m": [Inertia(J=1), Spring(c=2)]})
    assert_same(loads(dumps(mixed)), mixed)


def test_values_of_other_packages_become_text() -> None:
    values = [np.float64(0.5), np.int64(3), pint.Quantity(2.0, "kg * cm**2")]
    for value in values:
        before = Assembly("a", parts={"m": Inertia(J=value)})
        after = loads(dumps(before))
        assert math.isclose(after.find("m").value("J").number, before.find("m").value("J").number, rel_tol=1e-15)


def test_netlists_inside_are_named_by_file(tmp_path: Path) -> None:
    save(Assembly("box", parts={"shaft": Inertia(J=1)}, parameters={"k": 2}), tmp_path / "box.toml")
    box = load(tmp_path / "box.toml")
    box.set("shaft.J", 4)
    box.set("k", 3)
    outer = Assembly("outer", parts={"b": box})
    (tmp_path / "sub").mkdir()
    save(outer, tmp_path / "sub" / "outer.toml")
    assert 'b = { is = "../box.toml", k = 3, shaft = { J = 4 } }' in (tmp_path / "sub" / "outer.toml").read_text()
    assert_same(load(tmp_path / "sub" / "outer.toml"), outer)


def test_formulas_keep_the_names_they_use(tmp_path: Path) -> None:
    box = '[parameters]\ni = 3\nJ = "2 kg.m2"\n[parts]\na = { is = "Inertia", J = "J" }\n'
    (tmp_path / "box.toml").write_text(box)
    text = '[parameters]\ni = 7\n[parts]\nq = { is = "./box.toml", a.J = "i * J" }\n[start]\n"q.a.w" = "i * 1 rad/s"\n'
    drive = loads(text, file=str(tmp_path / "bench.toml"))
    written = dumps(drive, folder=tmp_path)
    assert 'a = { J = "i * J" }' in written
    assert '"q.a.w" = "i * 1 rad/s"' in written
    drive.find("q").set("a.J", "i * J")  # the i of the box
    written = dumps(drive, folder=tmp_path)
    assert 'a = { J = "q.i * q.J" }' in written
    read = loads(written, file=str(tmp_path / "bench.toml"))
    assert {p.path: p.value for p in flatten(read).derived}["q.a.J"] == 3 * 2.0


def test_what_no_netlist_can_hold_is_told() -> None:
    with pytest.raises(
        NetlistError, match="OwnEquation has x of its own; a netlist contains only parts and connections"
    ):
        dumps(OwnEquation())
    with pytest.raises(NetlistError, match="inner is an assembly without a file"):
        dumps(Assembly("a", parts={"inner": Assembly("b", parts={"m": Inertia(J=1)})}))

    class Local(Component):
        """A class that no file can name."""

    with pytest.raises(NetlistError, match=r"Local is not at the top level of its module"):
        dumps(Assembly("a", parts={"m": Local()}))


def test_a_sizing_file_is_found_from_another_folder(tmp_path: Path) -> None:
    examples = Path(__file__).parents[2] / "examples"
    drive = load(examples / "machine_table_direct.toml")
    save(drive, tmp_path / "saved.toml")
    found = [Path(one.sizing).resolve() for one in (drive, load(tmp_path / "saved.toml"))]
    assert found == [examples / "sizing" / "machine_table.toml"] * 2
