"""Connections of signals: one output drives inputs, which are bound, given or missing."""

import pytest

from modelica_like import simulate
from modelica_like.errors import MissingValue, UnknownName, WiringErrors, WrongConnection
from modelica_like.flatten import flatten
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    Variable,
    connect,
    param,
    signal_in,
    signal_out,
    var,
)


class Source(Component):
    k: Parameter = param("*", "value", default=1.0)
    y: Output = signal_out("*", "signal")

    def equations(self) -> Equations:
        yield self.y == self.k


class Sink(Component):
    u: Input = signal_in("N.m", "torque")
    x: Variable = var("N.m", "what came")

    def equations(self) -> Equations:
        yield self.x == self.u


class Defaulted(Sink):
    u: Input = signal_in("N.m", "torque", default="2 kN.m")


class Pair(Component):
    source, sink, more = Source(k="3 N.m"), Sink(), Sink()

    def equations(self) -> Equations:
        yield connect(self.source.y, self.sink.u, self.more.u)


def test_one_output_drives_many_inputs_and_its_unit_follows_its_value():
    flat = flatten(Pair())
    units = {v.path: str(v.unit) for v in flat.variables}
    assert units["source.y"] == "N.m"
    run = simulate(Pair(), 1.0, points=1)
    assert run.final["sink.x"] == run.final["more.x"] == 3.0


def test_a_signal_in_the_wrong_unit_is_refused():
    class Wrong(Pair):
        source = Source(k="3 rad/s")

    with pytest.raises(WiringErrors) as caught:
        flatten(Wrong())
    assert [error.what for error in caught.value.errors] == [
        "source.y is in rad/s, sink.u expects N.m.", "source.y is in rad/s, more.u expects N.m.",
    ]  # fmt: skip


def test_an_input_is_bound_given_or_missing():
    assert simulate(Assembly("one", parts={"sink": Sink(u=5.0)}), 1.0, points=1).final["sink.x"] == 5.0
    assert simulate(Assembly("one", parts={"sink": Defaulted()}), 1.0, points=1).final["sink.x"] == 2000.0
    with pytest.raises(MissingValue, match=r"^sink\.u is an input without a value\."):
        flatten(Assembly("one", parts={"sink": Sink()}))


def test_an_input_of_the_whole_model_is_an_input_of_the_flat_one():
    flat = flatten(Sink())
    assert [flat.variables[k].path for k in flat.inputs] == ["u"]
    assert simulate(Sink(), 1.0, points=1, parameters={"u": "4 N.m"}).final["x"] == 4.0


def test_a_given_input_follows_a_formula():
    class Drive(Component):
        base: Parameter = param("N.m", "base", default=2.0)
        sink = Sink(u="3*base")

    assert simulate(Drive(), 1.0, points=1).final["sink.x"] == 6.0
    assert simulate(Drive(), 1.0, points=1, parameters={"base": 5.0}).final["sink.x"] == 15.0


def test_an_outer_input_is_passed_on():
    class Shell(Component):
        u: Input = signal_in("N.m", "torque")
        inner = Sink()

        def equations(self) -> Equations:
            yield connect(self.u, self.inner.u)

    class Machine(Component):
        source, shell = Source(k="7 N.m"), Shell()

        def equations(self) -> Equations:
            yield connect(self.source.y, self.shell.u)

    assert simulate(Machine(), 1.0, points=1).final["shell.inner.x"] == 7.0


@pytest.mark.parametrize(
    ("wires", "message"),
    [
        ([["source.y", "other.y"]], "The connection of source.y, other.y has 2 outputs (source.y, other.y)."),
        ([["sink.u", "more.u"]], "The connection of sink.u, more.u has no output."),
        ([["source.y", "sink.u"], ["other.y", "sink.u"]], "The input sink.u is connected twice."),
    ],
)
def test_wrong_signals(wires, message):
    parts = {"source": Source(k="1 N.m"), "other": Source(k="1 N.m"), "sink": Defaulted(), "more": Defaulted()}
    with pytest.raises(WrongConnection) as caught:
        flatten(Assembly("wrong", parts=parts, connect={f"w{k}": ends for k, ends in enumerate(wires)}))
    assert caught.value.what == message


def test_a_variable_is_no_signal():
    parts = {"source": Source(k="1 N.m"), "sink": Defaulted()}
    with pytest.raises((WrongConnection, UnknownName)):
        flatten(Assembly("wrong", parts=parts, connect={"w": ["source.y", "sink.x"]}))
