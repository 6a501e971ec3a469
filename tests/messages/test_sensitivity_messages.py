# ruff: noqa: E501 messages stand here as they are told
"""What is said where a gradient does not exist, or is not asked for rightly."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from components import Freewheel, Inertia
from modelica_like import Assembly, build, load, sensitivities, simulate, simulation_function
from modelica_like.analyse.replay.make import replay
from modelica_like.errors import LanguageError, ModelicaLikeError, NoGradient, StepFailed, UnknownName, ValueOutOfRange
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    param,
    sin,
    terminate,
    var,
    when,
)

DIRECT = Path(__file__).parents[2] / "examples" / "machine_table_direct.toml"


class Touch(Component):
    """A wave whose crest reaches a level by a hair."""

    T: Parameter = param("s", "time", default=1.0)
    level: Parameter = param("1", "level", default=1 - 1e-14)
    x: Variable = var("1", "wave")
    y: Variable = var("1", "what turns round")
    mode = Mode("below", "above")

    def equations(self) -> Equations:
        yield self.x == sin(self.time / self.T)
        yield self.T * der(self.y) == self.mode.choose(below=1, above=-1)

    def events(self) -> Events:
        yield self.mode.go("below", "above", when=self.x > self.level)  # touch


def lagging() -> Assembly:
    """5 rad/s fall into a freewheel that drives 2 kg.m2: 25/2 J become 25/6 J."""
    parts = {"front": Inertia(J=1.0, w=5.0), "freewheel": Freewheel(), "back": Inertia(J=2.0, w=0.0)}
    drive = Assembly("lagging", parts=parts, series={"shaft": [*parts]})
    drive.simulate.update(start="rest", until=1.0)
    return drive


class Race(Component):
    """Two levels that are reached at once."""

    T: Parameter = param("s", "time", default=1.0)
    one: Parameter = param("1", "level", default=0.5)
    two: Parameter = param("1", "level", default=0.5)
    x: Variable = var("1", "what rises")
    y: Variable = var("1", "what turns round")
    first = Mode("below", "above")
    second = Mode("below", "above")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1
        yield self.T * der(self.y) == self.first.choose(below=1, above=-1) * self.second.choose(below=1, above=3)

    def events(self) -> Events:
        yield self.first.go("below", "above", when=self.x > self.one)  # one
        yield self.second.go("below", "above", when=self.x > self.two)  # two


class Counted(Component):
    """A quantity with a rate that is fixed when the model is compiled."""

    n: Parameter = param("1/s", "rate", default=2.0, tunable=False)
    x: Variable = var("1", "quantity")

    def equations(self) -> Equations:
        yield der(self.x) == self.n


class Timeless(Component):
    """A variable that follows from the time."""

    T: Parameter = param("s", "time", default=1.0)
    x: Variable = var("1", "quantity")

    def equations(self) -> Equations:
        yield self.x == self.time / self.T


class Explosion(Component):
    """A quantity that is infinite after 1 s."""

    T: Parameter = param("s", "time", default=1.0)
    x: Variable = var("1", "quantity")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.x**2


def past_the_end() -> Any:
    run = simulate(Explosion(x=1.0), 0.9)
    only = run.segments[0]
    longer = replace(only, times=np.append(only.times, 1.5))
    return replay(replace(run, segments=(longer,)))


def strong() -> Any:
    drive = load(DIRECT)
    drive.set("clutch_torque", "87 N.m")
    return drive


def of_numbers() -> Any:
    drive = load(DIRECT.with_name("machine_table_geared.toml"))
    drive.set("ratio", "pi/13")
    return build(drive)


def table(*of: str, to: tuple[str, ...] = ("load_torque",), **options: Any) -> Any:
    return sensitivities(DIRECT, of, to, **options)


class Arriving(Component):
    x: Variable = var("1", "grows", default=0.0)
    T: Parameter = param("s", "time", default=2.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1

    def events(self) -> Events:
        yield when(self.x > 0.5, terminate("has arrived"))


def doubtful_hessian() -> None:
    """Ask for second derivatives of a run that ends just after the lock-up."""
    drive = load(DIRECT)
    drive.set("clutch_torque", "86.78432 N.m")
    function = simulation_function(drive, ["clutch_torque"], ["table.v"], any_sequence=True, until=0.2002)
    p = ca.MX.sym("p", 1)
    with suppress(RuntimeError):
        ca.Function("hessian", [p], [ca.hessian(function(p), p)[0]])([86.78432])
    assert function.refusal is not None
    raise function.refusal


CASES: dict[str, tuple[type[ModelicaLikeError], Callable[[], Any], str]] = {
    "a run that a component ends": (
        NoGradient,
        lambda: sensitivities(Arriving(), ["x"], ["T"], until="3 s"),
        """\
No gradient: Arriving ends the run at 1 s, and this time depends on parameters.
End the run before, or compare other values by a sweep, which has the numbers at each end.""",
    ),
    "an event that grazes": (
        NoGradient,
        lambda: sensitivities(Touch(y=0.0), ["y"], ["T"], until="3 s"),
        """\
No gradient at t = 1.57079619 s: mode changes from below to above where its condition only grazes zero.
  in test_sensitivity_messages.py:{touch} `yield self.mode.go("below", "above", when=self.x > self.level)`
A small change of a parameter moves the event far, or removes it.
Move the parameters away from this limit.""",
    ),
    "two events at once": (
        NoGradient,
        lambda: sensitivities(Race(x=0.0, y=0.0), ["y"], ["one"], until="1 s"),
        """\
No gradient at t = 0.5 s: 'first: below → above' and 'second: below → above' happen at the same instant but for different reasons.
  in test_sensitivity_messages.py:{one} `yield self.first.go("below", "above", when=self.x > self.one)`
  in test_sensitivity_messages.py:{two} `yield self.second.go("below", "above", when=self.x > self.two)`
A small change of a parameter decides which comes first, so the derivatives on both sides differ.
Leave out one, or choose parameter values that separate the two events.""",
    ),
    "an event at the end": (
        NoGradient,
        lambda: sensitivities(Race(x=0.0, y=0.0, two=0.9), ["y"], ["one"], until="0.5 s"),
        """\
No gradient at t = 0.5 s: first becomes above exactly at the end of the run.
  in test_sensitivity_messages.py:{one} `yield self.first.go("below", "above", when=self.x > self.one)`
A small change of a parameter moves it to either side, so the derivatives on both sides differ.
Leave out one, or move the parameters away from this limit.""",
    ),
    "another mode sequence": (
        NoGradient,
        lambda: simulation_function(strong(), ["load_torque"], ["table.s"]).at([86.0]),
        """\
machine_table_direct has another mode sequence at these parameter values: as mode change 1, 'clutch.mode: backward → stuck' is missing.
A function with a fixed mode sequence has derivatives only as long as the sequence stays.
Bound the parameters, start elsewhere, or allow it with any_sequence=True.""",
    ),
    "a step of the replay": (StepFailed, past_the_end, """\
The replay of the run stalled at t = 1 s: its steps do not converge.
Look for a function without a slope there, or for a mode that should have changed."""),
    "a model without states": (LanguageError, lambda: sensitivities(Timeless(), ["x"], ["T"], until="1 s"), """\
Timeless has no states, so there is no run to differentiate.
Compare runs with other parameter values instead."""),
    "an output that does not exist": (UnknownName, lambda: table("table.x"), """\
machine_table_direct has no variable 'table.x'; did you mean 'table.v'?
Other outputs are peak(…), max(…), min(…), integral(…), mean(…), rms(…), at(…, time), first(… > …), duration(mode: name), series(…), time(mode: before -> after), and of components loss_energy, source_energy, lock_time, unlock_time."""),
    "a mode that does not exist": (UnknownName, lambda: table("time(clutch.node -> stuck)"), """\
machine_table_direct has no mode 'clutch.node'; did you mean 'clutch.mode'?"""),
    "a mode change that does not exist": (UnknownName, lambda: table("time(clutch.mode -> stack)"), """\
clutch.mode has no mode 'stack'; did you mean 'stuck'? It has free, stuck, start_forward, start_backward, forward, backward."""),
    "a mode change that is not written as one": (UnknownName, lambda: table("time(clutch.mode)"), """\
'time(clutch.mode)' does not say which mode change.
Write time(clutch.mode: forward -> stuck), and a number if it happens again: time(clutch.mode -> stuck, 2)."""),
    "an energy with an impact": (NoGradient, lambda: sensitivities(lagging(), ["freewheel.loss_energy"], ["front.J"]), """\
No gradient of freewheel.loss_energy: freewheel loses 8.33333 J in an impact at t = 0 s.
Only losses over time are differentiated, not the energy of an impact.
Ask for integral(freewheel.loss_power), which leaves impacts out, or for speeds after the impact."""),
    "a mode change that does not happen": (UnknownName, lambda: table("time(clutch.mode -> stuck, 2)"), """\
'time(clutch.mode -> stuck, 2)' does not happen after the start of the run.
clutch.mode changes: backward → stuck at 0.2 s."""),
    "a time outside the run": (ValueOutOfRange, lambda: table("at(table.s, 7 s)"), """\
at(table.s, 7 s): the run goes from 0 s to 0.4 s."""),
    "a parameter that does not exist": (UnknownName, lambda: table("table.s", to=("load_torqe",)), """\
machine_table_direct has no parameter 'load_torqe'; did you mean 'load_torque'?"""),
    "a parameter that follows from others": (
        LanguageError, lambda: sensitivities(build(DIRECT), ["table.s"], ["clutch.capacity"]), """\
clutch.capacity follows from other parameters (motor_speed, acceleration_time, load_torque, lead, table_mass, hub_inertia, spindle_inertia).
Ask for these, or pass the drive before it is compiled or run: clutch.capacity is then decoupled from its formula."""),
    "a parameter that is a formula of numbers": (LanguageError, lambda: sensitivities(of_numbers(), ["table.s"], ["ratio"]), """\
ratio is given by a formula of numbers.
Pass the drive before it is compiled or run: ratio is then decoupled from its formula."""),
    "a parameter that is fixed": (LanguageError, lambda: sensitivities(Counted(x=0.0), ["x"], ["n"], until=1.0), """\
n cannot change after compilation, so there are no derivatives with respect to it.
Compare runs of models that were built with other values."""),
    "no output": (ValueOutOfRange, lambda: table(), """\
There is no output to differentiate: give at least one name."""),
    "a function without inputs": (ValueOutOfRange, lambda: simulation_function(DIRECT, [], ["table.s"]), """\
There is no parameter as input: give at least one name."""),
    "a method that does not exist": (UnknownName, lambda: table("table.s", method="adjiont"), """\
There is no method 'adjiont'; did you mean 'adjoint'?
The methods are forward, adjoint and auto (the cheaper of both)."""),
    "an output that was not asked for": (UnknownName, lambda: table("table.s")["table.v", "load_torque"], """\
There is no output 'table.v' in these sensitivities; did you mean 'table.s'?"""),
    "a derivative with one name": (UnknownName, lambda: table("table.s")["load_torque"], """\
A derivative has two names, of an output and of a parameter, not 'load_torque'.
Write result["…", "…"]."""),
    "a precision out of range": (ValueOutOfRange, lambda: table("table.s", precision=1e-20), """\
The precision of a replay, 1e-20, is out of range: it must be between 1e-13 and 0.001."""),
    "an output that is infinite": (NoGradient, lambda: table("table.s/0"), """\
table.s/0 is inf: what is not finite has no derivative."""),
    "a direction of another length": (ValueOutOfRange, lambda: simulation_function(
        DIRECT, ["load_torque"], ["clutch.lock_time"]
    ).hessian_products([15.0], [1.0, 2.0]), """\
The direction needs a number for each parameter, 1 in all, of which one is not zero."""),
    "second derivatives beside another sequence": (NoGradient, lambda: doubtful_hessian(), """\
The second derivatives of table.v by clutch_torque are not certain: steps of 0.001 and 0.002 of its value differ by 0.14 of the largest one.
Within these steps the mode sequence changes, or the gradient bends sharply.
Use the gradient alone: hessian_approximation = limited-memory in IPOPT."""),
    "a series as output of a function": (
        LanguageError, lambda: simulation_function(DIRECT, ["lead"], ["series(table.s)"]), """\
series(table.s) is a trajectory; the outputs of a simulation function are numbers.
Ask for single times: at(table.s, 0.3 s)."""),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_message(check_message, name):
    check_message(*CASES[name])
