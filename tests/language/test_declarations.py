"""What a class body declares, and how declarations are inherited."""

from typing import ClassVar

import pytest

from modelica_like.errors import DuplicateName, LanguageError, MissingValue, UnknownName
from modelica_like.flatten import flatten
from modelica_like.language import (
    Component,
    Connector,
    Discrete,
    Equations,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    discrete,
    flow,
    param,
    signal_in,
    signal_out,
    var,
)


class Pin(Connector):
    v: Variable = var("V", "potential")
    i: Variable = flow("A", "current")


class TwoPins(Component, partial=True):
    p = Pin("plus")
    n = Pin("minus", free=True)
    u: Variable = var("V", "voltage", state="prefer", guess=1.5, nominal=10.0, min=-1e3, max=1e3)

    def equations(self) -> Equations:
        yield self.u == self.p.v - self.n.v
        yield self.p.i + self.n.i == 0


class Named(Component, partial=True):
    label_number: int = 7
    switch = Mode("off", "on", start="on", description="a switch")


class Resistor(TwoPins, Named):
    R: Parameter = param("Ohm", "resistance", default=2.0, min=0)
    count: Discrete = discrete("1", "how often")
    gain: Input = signal_in("1", "gain", default=1.0)
    heat: Output = signal_out("W", "heat")
    n = Pin("minus, must be connected here")
    library: ClassVar[str] = "electrical"

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.u == self.gain * self.R * self.p.i
        yield self.heat == self.u * self.p.i


def test_fields_are_collected_from_all_bases_in_their_order():
    assert list(Resistor().fields) == ["u", "R", "count", "gain", "heat"]
    kinds = {name: type(field) for name, field in Resistor().fields.items()}
    assert kinds == {"u": Variable, "R": Parameter, "count": Discrete, "gain": Input, "heat": Output}


def test_connectors_modes_and_structural_fields_come_along_the_whole_line_of_ancestors():
    part = Resistor(label_number=9)
    assert list(part.connectors) == ["p", "n"]
    assert part.connectors["n"].may_be_free is False  # declared again, so the nearest declaration counts
    assert list(part.modes) == ["switch"]
    assert part.start_mode("switch") == "on"
    assert part.label_number == 9
    assert Resistor().label_number == 7


def test_a_declaration_keeps_its_metadata():
    u, r = Resistor.u, Resistor.R
    assert (u.unit_text, u.description, u.state, u.guess, u.nominal, u.min, u.max) == (
        "V", "voltage", "prefer", 1.5, 10.0, -1e3, 1e3,
    )  # fmt: skip
    assert (r.label, r.default, r.min, r.max) == ("Resistor.R", 2.0, 0, None)
    assert Resistor.switch.description == "a switch"


def test_two_bases_with_equations_are_joined_by_super():
    class Doubled(Component, partial=True):
        twice: Variable = var("V", "double voltage")

        def equations(self) -> Equations:
            yield from super().equations()
            yield self.twice == 2 * self.u  # type: ignore[attr-defined]

    class Both(Doubled, Resistor):
        pass

    class Circuit(Component):
        a = Both()
        b = Both()

        def equations(self) -> Equations:
            from modelica_like.language import connect

            yield connect(self.a.p, self.b.p)
            yield connect(self.a.n, self.b.n)

    flat = flatten(Circuit())
    own = [v.path for v in flat.variables if v.path.startswith("a.") and v.kind in ("local", "output")]
    assert sorted(own) == ["a.heat", "a.twice", "a.u"]


def test_symbols_are_the_same_each_time_and_differ_between_instances():
    first, second = Resistor(), Resistor()
    assert first.u is first.u
    assert first.u is not second.u
    assert first.p.v is first.p.v


def test_a_partial_class_is_only_a_base():
    with pytest.raises(LanguageError, match=r"TwoPins is partial: it is only a base class\.") as caught:
        TwoPins()
    assert caught.value.where[0].file == __file__


def test_a_structural_field_without_default_must_be_given():
    class Stack(Component):
        layers: int

    assert Stack(layers=3).layers == 3
    with pytest.raises(LanguageError, match=r"Stack needs a value for layers\."):
        Stack()


def test_lists_in_structural_fields_become_tuples():
    class Table(Component):
        rows: tuple[tuple[float, float], ...] = ((0.0, 1.0),)

    assert Table(rows=[[1, 2], [3, 4]]).rows == ((1, 2), (3, 4))


@pytest.mark.parametrize("name", ["R", "switch", "label_number"])
def test_a_part_cannot_take_the_name_of_a_declaration(name):
    with pytest.raises(DuplicateName, match="already in use"):
        setattr(Resistor(), name, Resistor())


@pytest.mark.parametrize("name", ["equations", "find", "path", "fields"])
def test_a_part_cannot_take_the_name_of_a_method(name):
    with pytest.raises(DuplicateName, match="already in use: every component has something of this name"):
        setattr(Resistor(), name, Resistor())


def test_names_begin_with_a_letter():
    with pytest.raises(
        LanguageError, match=r"Hidden declares '_phi'.\nA name is a letter, then letters, digits and _."
    ):

        class Hidden(Component):
            _phi: Variable = var("rad", "hidden")


def test_a_mode_needs_distinct_names_and_a_known_start():
    with pytest.raises(LanguageError, match="needs distinct names"):

        class Twice(Component):
            state = Mode("a", "a")

    with pytest.raises(UnknownName, match=r"Wrong.state has no mode 'c'"):

        class Wrong(Component):
            state = Mode("a", "b", start="c")


def test_unknown_keywords_are_told_with_a_suggestion_and_the_line():
    with pytest.raises(UnknownName) as caught:
        Resistor(gian=2)
    assert "Resistor has no parameter or variable 'gian'; did you mean 'gain'?" in str(caught.value)
    assert "Resistor(gian=2)" in caught.value.where[0].text


def test_a_parameter_without_value_is_told_when_it_is_used():
    class Lamp(Component):
        P: Parameter = param("W", "power")
        heat: Variable = var("W", "heat")

        def equations(self) -> Equations:
            yield self.heat == self.P

    with pytest.raises(MissingValue, match=r"P \(Lamp\) has no value"):
        flatten(Lamp())


def test_given_tells_whether_there_is_a_value():
    class Lamp(Component):
        P: Parameter = param("W", "power")
        q: Parameter = param("W", "power", default=1.0)

    assert [Lamp().given("P"), Lamp(P=3).given("P"), Lamp().given("q")] == [False, True, True]
