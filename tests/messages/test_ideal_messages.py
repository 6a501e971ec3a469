"""Ideal elements: combinations of modes that are impossible, and wrong declarations."""

import pytest

from components import (
    Capacitor,
    ConstantCurrent,
    ConstantVoltage,
    Ground,
    IdealDiode,
    IdealSwitch,
    Inductor,
    Pulse,
    Ramp,
    Resistor,
)
from components.electrical.analog import SignalVoltage, TwoPins
from modelica_like import Assembly, simulate
from modelica_like.errors import LanguageError, NoValidModes
from modelica_like.flatten import flatten
from modelica_like.language import Equations, Mode


def switched(close: float, load: TwoPins) -> Assembly:
    """24 V on a load in series with a resistor, by a switch that is closed for 1 ms."""
    parts = {"U": ConstantVoltage(V=24.0), "S": IdealSwitch(), "load": load, "R": Resistor(R=5.0), "earth": Ground()}
    parts["clock"] = Pulse(period=1.0, width=1e-3, start_time=close)
    connect = {"s": ["clock.y", "S.closed"], "1": ["U.p", "S.p"], "2": ["S.n", "load.p"], "0": ["U.n", "earth.p"]}
    if isinstance(load, Capacitor):
        return Assembly("circuit", parts=parts, connect=connect | {"0": [*connect["0"], "load.n", "R.n"],
                                                                   "2": [*connect["2"], "R.p"]})  # fmt: skip
    return Assembly("circuit", parts=parts, connect=connect | {"3": ["load.n", "R.p"], "0": [*connect["0"], "R.n"]})


def across(source: TwoPins, part: TwoPins) -> Assembly:
    """A part across a source."""
    parts = {"source": source, "part": part, "earth": Ground()}
    return Assembly(
        "circuit", parts=parts, connect={"1": ["source.p", "part.p"], "0": ["source.n", "part.n", "earth.p"]}
    )


class Wired(TwoPins):
    """Closed or open, but the equation of the open one is missing."""

    contact = Mode("open", "closed", ideal={"open": "i", "closed": "v"})

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.contact.choose(open=self.v, closed=self.v) == 0


CASES = {
    "a switch interrupts the current of an inductor": (
        NoValidModes,
        lambda: simulate(switched(0.0, Inductor(L=1e-3, i=0.0)), 0.01),
        "At t = 0.001 s no combination of modes is valid: with S off, 4.768 A are left over.\n"
        "The elements are ideal, and states change continuously; here a current would stop at once.\n"
        "Give the current another path (a freewheeling diode), or put a resistance in series with a capacitor.",
    ),
    "a switch connects a capacitor to a source": (
        NoValidModes,
        lambda: simulate(switched(0.0, Capacitor(C=1e-3, v=4.0)), 0.01),
        "At t = 0 s no combination of modes is valid: with S on, 20 V are left over.\n"
        "The elements are ideal, and states change continuously; here voltages would jump.\n"
        "Give the current another path (a freewheeling diode), or put a resistance in series with a capacitor.",
    ),
    "an ideal diode across a source": (
        NoValidModes,
        lambda: simulate(across(ConstantVoltage(V=10.0), IdealDiode()), 0.01),
        "At t = 0 s part contradicts the rest of the circuit: it is ideal and on, so its voltage is zero, but the rest "
        "makes it 10 V.\n"
        "Put a resistance in series with part, or take an element that is not ideal (Diode, Switch).",
    ),
    "an open ideal switch in series with a current": (
        NoValidModes,
        lambda: simulate(across(ConstantCurrent(I=10.0), IdealSwitch(closed=0.0)), 0.01),
        "At t = 0 s part contradicts the rest of the circuit: it is ideal and off, so its current is zero, but the "
        "rest makes it -10 A.\n"
        "Put a resistance in parallel with part, or take an element that is not ideal (Diode, Switch).",
    ),
    "an ideal mode without its equation": (
        LanguageError,
        lambda: flatten(Wired()),
        "Wired.contact is ideal, but no equation sets i and v to zero.\n"
        "Write contact.choose(open=self.i, closed=self.v) == 0.",
    ),
    "an ideal mode without a variable": (
        LanguageError,
        lambda: type("Half", (TwoPins,), {"contact": Mode("open", "closed", ideal={"closed": "v"})}),
        "Half.contact needs two modes with one zero variable each to be ideal.",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_message(check_message, name):
    check_message(*CASES[name])


def test_the_compiled_runtime_tells_the_same(check_message):
    _, _, text = CASES["a switch interrupts the current of an inductor"]
    check_message(NoValidModes, lambda: simulate(switched(0.0, Inductor(L=1e-3, i=0.0)), 0.01, solver="native"), text)


@pytest.mark.parametrize(
    ("source", "part"), [(ConstantVoltage(V=10.0), IdealDiode()), (ConstantCurrent(I=10.0), IdealSwitch(closed=0.0))]
)
def test_the_compiled_runtime_refuses_contradictions(source, part):
    with pytest.raises(NoValidModes, match="At t = 0 s part contradicts the rest of the circuit"):
        simulate(across(source, part), 0.01, solver="native")


def test_a_source_that_blocks_the_diode_does_not_contradict_it():
    run = simulate(across(ConstantVoltage(V=-10.0), IdealDiode()), 0.01)
    assert (run["part.v"][-1], abs(run["part.i"][-1])) == (-10.0, 0.0)


def test_a_voltage_that_rises_across_a_closed_switch_contradicts_it():
    parts = {"ramp": Ramp(duration=1.0, height=5.0), "source": SignalVoltage(), "part": IdealSwitch(closed=1.0)}
    connect = {"1": ["source.p", "part.p"], "0": ["source.n", "part.n", "earth.p"], "s": ["ramp.y", "source.v_ref"]}
    drive = Assembly("circuit", parts=parts | {"earth": Ground()}, connect=connect)
    for solver in ("idas", "native"):
        with pytest.raises(NoValidModes, match="part contradicts the rest of the circuit"):
            simulate(drive, 1.0, solver=solver)
