"""Events of discrete equations are told by the variables that users have declared, not by the relations behind them."""

import pytest

from components import Inertia, SpeedSensor, Torque
from modelica_like import simulate
from modelica_like.errors import StructureError
from modelica_like.language import (
    TIME,
    Assembly,
    Component,
    Discrete,
    Equations,
    Events,
    Input,
    Output,
    Parameter,
    all_of,
    any_of,
    boolean,
    change,
    clock,
    connect,
    discrete,
    integer,
    param,
    pre,
    signal_in,
    signal_out,
    when,
    where,
)
from modelica_like.show.report.changes import changes
from modelica_like.show.report.page import report
from modelica_like.show.report.structure import structure_report


class Relay(Component):
    w: Input = signal_in("rad/s", "speed")
    tau: Output = signal_out("N.m", "torque")
    slow: Parameter = param("rad/s", "speed below which it is on", default=1.0)
    torque: Parameter = param("N.m", "torque while it is on", default=3.0)
    second: Parameter = param("s", "a second", default=1.0)
    on: Discrete = boolean("the drive is on")
    n: Discrete = integer("switchings")
    last: Discrete = discrete("s", "time of the last one")

    def equations(self) -> Equations:
        yield self.on == any_of(all_of(pre(self.on), self.w < 2 * self.slow), self.w < self.slow)
        yield self.tau == where(self.on, self.torque, -self.torque / 2)

    def events(self) -> Events:
        yield when(change(self.on), {self.n: pre(self.n) + 1, self.last: TIME})


class Watch(Relay):
    """Looks at the speed now and then; counts, and remembers the speed."""

    def equations(self) -> Equations:
        yield self.tau == self.torque / 3

    def events(self) -> Events:
        yield when(clock(self.second), {self.last: TIME, self.on: self.w > 2.5 * self.slow})
        yield when(clock(2 * self.second), {self.n: pre(self.n) + 1})


class Drive(Assembly):
    def __init__(self, control: Relay) -> None:
        super().__init__("drive")
        self.control = control
        self.J, self.sensor, self.motor = Inertia(J=1.0, phi=0.0, w=0.0), SpeedSensor(), Torque()

    def equations(self) -> Equations:
        yield connect(self.J.flange_a, self.sensor.flange, self.motor.flange)
        yield connect(self.sensor.w, self.control.w)
        yield connect(self.control.tau, self.motor.tau)


def test_variables_are_told_instead_of_relations() -> None:
    told = [(round(one.time, 9), one.path, one.before, one.after) for one in changes(simulate(Drive(Relay()), 1.8))]
    # 3 N.m up to 2 rad/s, then half of it backwards, down to 1 rad/s
    assert told == [
        (0.333333333, "control", "", ""),
        (0.666666667, "control.on", "true", "false"), (0.666666667, "control.n", "0", "1"),
        (1.333333333, "control.on", "false", "true"), (1.333333333, "control.n", "1", "2"),
        (1.666666667, "control.on", "true", "false"), (1.666666667, "control.n", "2", "3"),
    ]  # fmt: skip


def test_ticks_are_told_where_they_change_more_than_a_number() -> None:
    told = [(one.time, one.path, one.before, one.after) for one in changes(simulate(Drive(Watch()), 3.5))]
    assert told == [(2.0, "control.n", "1", "2"), (3.0, "control.on", "false", "true")]


class Circular(Relay):
    def equations(self) -> Equations:
        yield self.on == all_of(self.w < self.slow, self.n < 3)
        yield self.tau == where(self.on, self.torque, -self.torque)


def test_a_check_finds_loops_and_names_what_users_know() -> None:
    with pytest.raises(StructureError) as caught:
        structure_report(Drive(Circular()))
    assert caught.value.what == (
        "Discrete variables determine each other in a loop: control.on → control.n → control.on."
    )
    assert len(caught.value.where) == 2


def test_reports_tell_the_same_in_words() -> None:
    text = report(Drive(Relay()), simulate(Drive(Relay()), 0.8))
    assert "<b>0.333333 s</b> control: speed w rose above slow = 1 rad/s." in text
    assert "control.on becomes false (speed w rose above " in text
    assert "relation[" not in text
